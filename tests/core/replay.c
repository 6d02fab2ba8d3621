/* Calls of the compiled core, recorded from Python by record.py, once more and without Python: on
 * another processor.
 *
 * replay < CALLS > ANSWERS: of each call what it returned and the contents of its arrays; ends with
 * 1 if one is refused.
 */
#include <stdio.h>
#include <stdlib.h>

#include "calls.h"

typedef struct {
    const char *name;
    bool (*call)(const argument *, long long *);
} core_function;

#define ROW(name, kinds) {#name, do_##name},
static const core_function CORE_FUNCTIONS[] = {FUNCTIONS(ROW)};
enum { COUNT = sizeof CORE_FUNCTIONS / sizeof *CORE_FUNCTIONS };

/* An argument as it is recorded, before the items of its array. */
typedef struct {
    int64_t bytes; /* of the array, or -1 */
    int64_t item_size;
    int64_t whole;
    double real;
} recorded;

static void get(void *out, size_t bytes) {
    if (bytes > 0 && fread(out, 1, bytes, stdin) != bytes)
        exit(3);
}

static size_t bytes_of(const recorded *head) { return head->bytes > 0 ? (size_t)head->bytes : 0; }

static argument argument_of(const recorded *head) {
    argument a = {.real = head->real, .whole = head->whole};
    a.count = bytes_of(head) / (size_t)head->item_size;
    if (head->bytes >= 0) {
        a.items = malloc(bytes_of(head) + 1);
        get(a.items, bytes_of(head));
    }
    return a;
}

static const core_function *function_of(const char *name) {
    for (int k = 0; k < COUNT; k++)
        if (strcmp(CORE_FUNCTIONS[k].name, name) == 0)
            return &CORE_FUNCTIONS[k];
    return NULL;
}

int main(void) {
    char name[64];
    while (fread(name, sizeof name, 1, stdin) == 1) {
        argument arguments[MOST_ARGUMENTS];
        recorded heads[MOST_ARGUMENTS];
        int64_t count;
        get(&count, sizeof count);
        for (int64_t k = 0; k < count; k++) {
            get(&heads[k], sizeof heads[k]);
            arguments[k] = argument_of(&heads[k]);
        }
        const core_function *const function = function_of(name);
        long long answer;
        if (function == NULL || !function->call(arguments, &answer)) {
            fprintf(stderr, "%s was refused\n", name);
            return 1;
        }
        fwrite(&answer, sizeof answer, 1, stdout);
        for (int64_t k = 0; k < count; k++) {
            fwrite(arguments[k].items, 1, bytes_of(&heads[k]), stdout);
            free(arguments[k].items);
        }
    }
    return 0;
}
