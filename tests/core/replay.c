/* Calls of the compiled core, recorded from Python by record.py, once more and without Python: on another processor.
 *
 * replay < CALLS > ANSWERS: of each call what it returned and the contents of its arrays; ends with 1 if one is refused. */
#include <stdio.h>
#include <stdlib.h>

#include "calls.h"

#define ROW(name, kinds, fits, call) {#name, do_##name},
static const struct {
    const char *name;
    bool (*call)(const argument *, long long *);
} CALLS[] = {FUNCTIONS(ROW)};
enum { COUNT = sizeof CALLS / sizeof *CALLS };

static void get(void *out, size_t bytes) {
    if (bytes > 0 && fread(out, 1, bytes, stdin) != bytes)
        exit(3);
}

int main(void) {
    char name[64];
    while (fread(name, sizeof name, 1, stdin) == 1) {
        argument a[MOST_ARGUMENTS];
        /* of each argument: bytes of its array, or -1, the size of an item, and a number */
        int64_t count, head[MOST_ARGUMENTS][3], m = 0;
        long long found;
        get(&count, sizeof count);
        for (int k = 0; k < count; k++) {
            get(head[k], sizeof head[k]);
            get(&a[k].d, sizeof a[k].d);
            const size_t bytes = head[k][0] > 0 ? (size_t)head[k][0] : 0;
            a[k].n = bytes / (size_t)head[k][1];
            a[k].i = head[k][2];
            get(a[k].data = head[k][0] < 0 ? NULL : malloc(bytes + 1), bytes);
        }
        while (m < COUNT && strcmp(CALLS[m].name, name) != 0)
            m++;
        if (m == COUNT || !CALLS[m].call(a, &found)) {
            fprintf(stderr, "%s was refused\n", name);
            return 1;
        }
        fwrite(&found, sizeof found, 1, stdout);
        for (int k = 0; k < count; k++) {
            fwrite(a[k].data, 1, head[k][0] > 0 ? (size_t)head[k][0] : 0, stdout);
            free(a[k].data);
        }
    }
    return 0;
}
