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

static void get(void *out, size_t bytes) {
    if (bytes > 0 && fread(out, 1, bytes, stdin) != bytes)
        exit(3);
}

/* One of record.py's arguments; the bytes of its array. */
static size_t get_argument(argument *a) {
    int32_t kind, head[2] = {0, 1};
    uint32_t bytes = 0;
    memset(a, 0, sizeof *a);
    get(&kind, sizeof kind);
    if (kind == 'd')
        get(&a->d, sizeof a->d);
    else if (kind == 'i') {
        get(&a->i, sizeof a->i);
        a->d = (double)a->i;
    } else if (kind == 'A') {
        get(head, sizeof head); /* the kind of items and their size */
        get(&bytes, sizeof bytes);
        a->n = bytes / (uint32_t)head[1];
        a->data = malloc(bytes + 1);
        if (a->data == NULL)
            exit(3);
        get(a->data, bytes);
    }
    return bytes;
}

int main(void) {
    char name[64];
    while (fread(name, sizeof name, 1, stdin) == 1) {
        argument a[MOST_ARGUMENTS];
        size_t bytes[MOST_ARGUMENTS], m = 0;
        long long found;
        int32_t count;
        get(&count, sizeof count);
        for (int k = 0; k < count && k < MOST_ARGUMENTS; k++)
            bytes[k] = get_argument(&a[k]);
        while (m < sizeof CALLS / sizeof *CALLS && strcmp(CALLS[m].name, name) != 0)
            m++;
        if (m == sizeof CALLS / sizeof *CALLS || !CALLS[m].call(a, &found)) {
            fprintf(stderr, "%s was refused\n", name);
            return 1;
        }
        fwrite(&found, sizeof found, 1, stdout);
        for (int k = 0; k < count; k++) {
            fwrite(a[k].data, 1, bytes[k], stdout);
            free(a[k].data);
        }
    }
    return 0;
}
