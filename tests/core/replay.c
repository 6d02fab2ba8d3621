/* Calls of the compiled core, recorded from Python by record.py, once more and without Python: on another processor, or
 * under sanitizers. What binding.c takes for Python is a few functions here, so that every wrapper is tried as it is.
 *
 * replay FILE TOLERANCE: for each function how many calls, the FNV-1a hash of the bits of its answers, and how far they are
 * from those recorded; ends with 1 if by more than the tolerance.
 * replay FILE mutate COUNT: as often each call with arguments spoilt: sizes, types, NaN, huge and tiny numbers. */
#include <stdio.h>
#include <stdlib.h>

#include "binding.c"

typedef struct {
    PyObject head;
    char kind; /* d, i, N for None, A for an array, and e for errors */
    char format[2];
    bool writable;
    double d;
    long long i;
    Py_ssize_t itemsize;
    size_t bytes;
    unsigned char *data;
} object;

static object type_error, value_error, answer;
static bool raised;
PyObject _Py_NoneStruct;
PyObject *PyExc_TypeError = &type_error.head, *PyExc_ValueError = &value_error.head;
static PyThreadState *const STATE = NULL;

PyObject *PyErr_Occurred(void) { return raised ? &type_error.head : NULL; }
PyObject *PyErr_Format(PyObject *type, const char *text, ...) {
    raised = type != NULL && text != NULL;
    return NULL;
}
void PyErr_Clear(void) { raised = false; }
PyThreadState *PyEval_SaveThread(void) { return STATE; }
void PyEval_RestoreThread(PyThreadState *state) { (void)state; }
PyObject *PyModuleDef_Init(PyModuleDef *definition) { return (PyObject *)(void *)definition; }
PyObject *PyLong_FromLongLong(long long value) {
    answer.i = value;
    return &answer.head;
}
double PyFloat_AsDouble(PyObject *given) {
    const object *const o = (const object *)(const void *)given;
    raised = raised || given == Py_None || (o->kind != 'd' && o->kind != 'i');
    return raised ? -1.0 : o->kind == 'd' ? o->d : (double)o->i;
}
long long PyLong_AsLongLong(PyObject *given) {
    const object *const o = (const object *)(const void *)given;
    raised = raised || given == Py_None || o->kind != 'i';
    return raised ? -1 : o->i;
}
int PyObject_GetBuffer(PyObject *given, Py_buffer *view, int flags) {
    object *const o = (object *)(void *)given;
    raised = raised || given == Py_None || o->kind != 'A' || ((flags & PyBUF_WRITABLE) && !o->writable);
    if (raised)
        return -1;
    memset(view, 0, sizeof *view);
    view->buf = o->data;
    view->len = (Py_ssize_t)o->bytes;
    view->itemsize = o->itemsize;
    view->format = o->format;
    return 0;
}
void PyBuffer_Release(Py_buffer *view) { view->buf = NULL; }

/* What the class of laws and the start of the module ask for, which are not tried here. */
struct _typeobject {
    int unused;
};
PyTypeObject PyFloat_Type;
PyObject *PyFloat_FromDouble(double value) { return value == value ? NULL : Py_None; }
int PyModule_AddIntConstant(PyObject *module, const char *name, long value) { return module && name && value; }
int PyModule_AddObjectRef(PyObject *module, const char *name, PyObject *value) { return module && name && value; }
int PyModule_AddStringConstant(PyObject *module, const char *name, const char *value) { return module && name && value; }
PyObject *PyObject_CallMethod(PyObject *given, const char *name, const char *format, ...) {
    return name && format ? given : NULL;
}
PyObject *PyObject_GetAttrString(PyObject *given, const char *name) { return name ? given : NULL; }
PyObject *PyTuple_GetItem(PyObject *tuple, Py_ssize_t place) { return place ? tuple : NULL; }
Py_ssize_t PyTuple_Size(PyObject *tuple) { return tuple != NULL; }
PyObject *PyType_FromSpec(PyType_Spec *spec) { return spec ? Py_None : NULL; }
void *PyType_GetSlot(PyTypeObject *type, int slot) { return slot ? type : NULL; }
int PyUnicode_CompareWithASCIIString(PyObject *text, const char *other) { return text && other; }
PyObject *Py_BuildValue(const char *format, ...) { return format ? Py_None : NULL; }
void Py_DecRef(PyObject *given) { (void)given; }

/* ---- the file ---- */

typedef struct {
    object like; /* without data of its own */
    bool trusted;
    unsigned char *content;
} stored;

typedef struct {
    char name[64];
    int count;
    long long returned;
    struct {
        object value;
        uint32_t before, after; /* numbers of stored arrays */
    } given[MOST_ARGUMENTS];
} call;

static void *allocated(size_t bytes) {
    void *const found = malloc(bytes);
    if (found == NULL && bytes > 0)
        exit(3);
    return found;
}
static unsigned char *copied(const void *from, size_t bytes) {
    unsigned char *const found = (unsigned char *)allocated(bytes);
    memcpy(found, from, bytes);
    return found;
}
static void get(FILE *file, void *out, size_t bytes) {
    if (bytes > 0 && fread(out, 1, bytes, file) != bytes)
        exit(3);
}
static uint32_t whole(FILE *file) {
    uint32_t found;
    get(file, &found, sizeof found);
    return found;
}

static stored *arrays;
static uint32_t array_count;

static void get_arrays(FILE *file) {
    array_count = whole(file);
    arrays = (stored *)allocated(array_count * sizeof *arrays);
    for (uint32_t k = 0; k < array_count; k++) {
        stored *const s = &arrays[k];
        memset(s, 0, sizeof *s);
        s->like.kind = 'A';
        s->like.format[0] = (char)whole(file);
        s->like.itemsize = (Py_ssize_t)whole(file);
        s->trusted = whole(file) != 0;
        s->like.bytes = whole(file);
        s->content = (unsigned char *)allocated(s->like.bytes);
        get(file, s->content, s->like.bytes);
    }
}

static void get_call(FILE *file, call *c) {
    memset(c, 0, sizeof *c);
    const uint32_t length = whole(file);
    if (length >= sizeof c->name)
        exit(3);
    get(file, c->name, length);
    get(file, &c->returned, sizeof c->returned);
    c->count = (int)whole(file);
    for (int k = 0; k < c->count && k < MOST_ARGUMENTS; k++) {
        object *const o = &c->given[k].value;
        o->kind = (char)whole(file);
        if (o->kind == 'd')
            get(file, &o->d, sizeof o->d);
        else if (o->kind == 'i')
            get(file, &o->i, sizeof o->i);
        else if (o->kind == 'A') {
            const bool writable = whole(file) != 0;
            c->given[k].before = whole(file);
            c->given[k].after = whole(file);
            if (c->given[k].before >= array_count || c->given[k].after >= array_count)
                exit(3);
            *o = arrays[c->given[k].before].like;
            o->writable = writable;
        }
    }
}

/* ---- calls ---- */

static PyMethodDef *methods;

/* Calls a function by its name; false where it refuses. */
static bool called(const call *c, object *values) {
    PyObject *given[MOST_ARGUMENTS];
    for (int k = 0; k < c->count; k++)
        given[k] = values[k].kind == 'N' ? Py_None : &values[k].head;
    for (const PyMethodDef *m = methods; m->ml_name; m++)
        if (strcmp(m->ml_name, c->name) == 0) {
            raised = false;
            PyObject *const found =
                ((PyObject * (*)(PyObject *, PyObject *const *, Py_ssize_t))(void (*)(void))m->ml_meth)(NULL, given, c->count);
            return found != NULL && !raised;
        }
    printf("%s is no function of the core\n", c->name);
    exit(1);
}

typedef struct {
    char name[64];
    int calls;
    uint64_t hash;
    double worst;
} tally;

static tally tallies[256];

static void add_byte(tally *t, unsigned char byte) { t->hash = (t->hash ^ byte) * UINT64_C(1099511628211); }

static void add_bits(tally *t, uint64_t bits) {
    for (int k = 0; k < 8; k++)
        add_byte(t, (unsigned char)(bits >> (8 * k)));
}

static tally *tally_of(const char *name) {
    tally *t = tallies;
    while (t->calls && strcmp(t->name, name) != 0)
        t++;
    if (!t->calls)
        t->hash = UINT64_C(14695981039346656037);
    memcpy(t->name, name, sizeof t->name);
    t->calls++;
    return t;
}

#define SMALL 1e-3 /* less counts as this much: bounds on rounding errors are roundings themselves */

static void compare(tally *t, const object *found, const stored *expected) {
    if (found->format[0] != 'd') {
        for (size_t k = 0; k < found->bytes; k++)
            add_byte(t, found->data[k]);
        if (memcmp(found->data, expected->content, found->bytes) != 0)
            t->worst = INFINITY;
        return;
    }
    for (size_t k = 0; k < found->bytes / sizeof(double); k++) {
        double a, b;
        memcpy(&a, found->data + k * sizeof a, sizeof a);
        memcpy(&b, expected->content + k * sizeof b, sizeof b);
        /* every NaN is one, as processors differ in its sign */
        add_bits(t, a == a ? (uint64_t)mbma_bits(a) : 0);
        const double off = fabs(a - b) / mbma_max(SMALL, mbma_max(fabs(a), fabs(b)));
        if (!(a == b || (a != a && b != b)))
            t->worst = off == off ? mbma_max(t->worst, off) : INFINITY;
    }
}

/* As recorded: are the answers? */
static void replay(const call *c) {
    object values[MOST_ARGUMENTS];
    tally *const t = tally_of(c->name);
    for (int k = 0; k < c->count; k++) {
        values[k] = c->given[k].value;
        if (values[k].kind != 'A')
            continue;
        values[k].data = arrays[c->given[k].before].content;
        if (values[k].writable)
            values[k].data = copied(values[k].data, values[k].bytes);
    }
    if (!called(c, values) || answer.i != c->returned)
        t->worst = INFINITY;
    add_bits(t, (uint64_t)answer.i);
    for (int k = 0; k < c->count; k++)
        if (values[k].kind == 'A' && values[k].writable) {
            compare(t, &values[k], &arrays[c->given[k].after]);
            free(values[k].data);
        }
}

static uint64_t state = 1;
static uint64_t any(uint64_t below) {
    state = state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (state >> 33) % below;
}

static const double ODD[] = {0.0, -0.0, 5e-324, -1e-310, 1e-300, 1.0, -1.0, 1e19, -1e300, INFINITY, -INFINITY, NAN};
static const long long ODD_WHOLE[] = {0, 1, -1, 2, 3, 4096, INT32_MAX, INT64_MAX, INT64_MIN};
enum { ODDS = sizeof ODD / sizeof *ODD, ODD_WHOLES = sizeof ODD_WHOLE / sizeof *ODD_WHOLE };

/* One argument as no caller would give it. */
static void spoil(object *o) {
    const uint64_t way = any(8);
    if (o->kind == 'd')
        o->d = ODD[any(ODDS)];
    else if (o->kind == 'i')
        o->i = ODD_WHOLE[any(ODD_WHOLES)];
    else if (o->kind == 'N' || way == 0)
        o->kind = o->kind == 'N' ? 'd' : 'N';
    else if (way == 1)
        o->format[0] = "dlifB"[any(5)];
    else if (way == 2)
        o->writable = !o->writable;
    else if (way == 3) {
        const size_t count = o->bytes / (size_t)o->itemsize;
        const size_t fewer[] = {0, count / 2, count - (count > 0), count / 3};
        o->bytes = fewer[any(4)] * (size_t)o->itemsize;
    } else
        for (uint64_t k = 0, spoilt = 1 + any(4); k < spoilt && o->bytes > 0; k++) {
            unsigned char *const place = o->data + any(o->bytes / (size_t)o->itemsize) * (size_t)o->itemsize;
            const long long number = ODD_WHOLE[any(ODD_WHOLES)];
            if (o->format[0] == 'd' && o->itemsize == sizeof *ODD)
                memcpy(place, &ODD[any(ODDS)], sizeof *ODD);
            else
                memcpy(place, &number, (size_t)o->itemsize); /* its low bytes */
        }
}


/* With one to three arguments spoilt, but for tables that the core has found to be sound: no crash. */
static bool mutate(const call *c) {
    object values[MOST_ARGUMENTS];
    bool own[MOST_ARGUMENTS] = {false};
    int spoilt[3];
    const uint64_t times = 1 + any(3);
    for (uint64_t k = 0; k < times; k++)
        spoilt[k] = (int)any((uint64_t)c->count);
    for (int k = 0; k < c->count; k++) {
        const stored *const array = &arrays[c->given[k].before];
        values[k] = c->given[k].value;
        if (values[k].kind != 'A')
            continue;
        values[k].data = array->content;
        own[k] = c->given[k].before != c->given[k].after;
        for (uint64_t m = 0; m < times; m++)
            own[k] = own[k] || (spoilt[m] == k && !array->trusted);
        if (own[k])
            values[k].data = copied(array->content, values[k].bytes);
    }
    for (uint64_t k = 0; k < times; k++)
        if (values[spoilt[k]].kind != 'A' || own[spoilt[k]])
            spoil(&values[spoilt[k]]);
    for (int k = 0; k < c->count; k++)
        if (own[k]) {
            /* it ends where the array does, so that a sanitizer sees what is read beyond */
            unsigned char *const exact = copied(values[k].data, values[k].bytes);
            free(values[k].data);
            values[k].data = exact;
        }
    const bool taken = called(c, values);
    for (int k = 0; k < c->count; k++)
        if (own[k])
            free(values[k].data);
    return taken;
}

int main(int argc, char **argv) {
    FILE *const file = argc >= 3 ? fopen(argv[1], "rb") : NULL;
    if (file == NULL)
        return 2;
    methods = ((PyModuleDef *)(void *)JOINED(PyInit_, MBMA_MODULE)())->m_methods;
    const bool mutating = strcmp(argv[2], "mutate") == 0;
    const double tolerance = mutating ? 0.0 : atof(argv[2]);
    const int times = mutating && argc > 3 ? atoi(argv[3]) : 0;
    long tried = 0, taken = 0;
    bool good = true;
    get_arrays(file);
    for (uint32_t k = 0, calls = whole(file); k < calls; k++) {
        call c;
        get_call(file, &c);
        if (!mutating)
            replay(&c);
        for (int m = 0; m < times && c.count > 0; m++, tried++)
            taken += mutate(&c);
    }
    fclose(file);
    for (const tally *t = tallies; t->calls; t++) {
        printf("%s %d %016llx %.3g\n", t->name, t->calls, (unsigned long long)t->hash, t->worst);
        good = good && t->worst <= tolerance;
    }
    if (mutating)
        printf("%ld tried, %ld taken\n", tried, taken);
    for (uint32_t k = 0; k < array_count; k++)
        free(arrays[k].content);
    free(arrays);
    return good ? 0 : 1;
}
