/* The core as a Python module (stable ABI of CPython 3.11): buffers in, numbers out, the interpreter lock released.
 *
 * The same sources are compiled for each generation of processor, as modules of different names; `core/__init__.py`
 * imports the best one that the processor can run. Whatever arguments a function is called with, it reads and writes
 * inside their arrays or raises an error, as long as no other thread changes an array during the call: types, places in
 * memory and sizes are checked here, what else loops rely on in `calls.h`.
 */
#if defined(__x86_64__) || defined(_M_X64)
#include <cpuid.h>
#include <immintrin.h>
#endif

#include "calls.h"
#include "stable_abi.h"

#define MOST_ITEMS ((size_t)1 << 56) /* more than fit into any memory; a small multiple does not overflow */

/* One argument by its kind: d a double, i a whole number; arrays of D doubles, L int64, J int32, F floats to be read,
 * and w doubles, l int64, b bytes to be written. */
static bool take(PyObject *given, char kind, argument *a, Py_buffer *view) {
    /* which of the letters of 4 and 8 bytes is whose differs between platforms */
    static const char KINDS[] = "DLJFwlb", *const FORMATS[] = {"d", "lq", "il", "f", "d", "lq", "B?"};
    static const Py_ssize_t SIZES[] = {8, 8, 4, 4, 8, 8, 1};
    memset(a, 0, sizeof *a);
    memset(view, 0, sizeof *view);
    if (kind == 'd')
        a->d = PyFloat_AsDouble(given);
    else if (kind == 'i')
        a->i = PyLong_AsLongLong(given);
    if (kind == 'd' || kind == 'i')
        return !PyErr_Occurred();
    if (given == Py_None)
        return true;
    const size_t number = (size_t)(strchr(KINDS, kind) - KINDS);
    const int access = (number > 3 ? PyBUF_WRITABLE : 0) | PyBUF_C_CONTIGUOUS | PyBUF_FORMAT;
    if (PyObject_GetBuffer(given, view, access) != 0)
        return false;
    const char *const format = view->format ? view->format : "B", *const formats = FORMATS[number];
    if (view->itemsize != SIZES[number] || format[0] == '\0' || strchr(formats, format[0]) == NULL ||
        format[1] != '\0') {
        PyErr_Format(PyExc_TypeError, "core: an array of '%c' was expected, got one of '%s'", formats[0], format);
        PyBuffer_Release(view);
        return false;
    }
    if ((uintptr_t)view->buf % (uintptr_t)SIZES[number] != 0) {
        PyErr_Format(PyExc_ValueError, "core: an array of '%c' is not aligned in memory", formats[0]);
        PyBuffer_Release(view);
        return false;
    }
    a->data = view->buf;
    a->n = (size_t)(view->len / view->itemsize);
    return true;
}

/* Whether an array has the size given from *kinds on, if there is any: a product of a number and of the letters
 * k, m and n, each the size of the first array that has it; ? allows None. */
static bool has_size(const argument *a, const char **kinds, size_t letters[4]) {
    bool any = **kinds == ' ' || **kinds == '\0', countable = true;
    size_t number = 0, product = 1;
    for (; **kinds != ' ' && **kinds != '\0'; ++*kinds)
        if (**kinds == '?')
            any = a->data == NULL;
        else if (**kinds <= '9')
            number = 10 * number + (size_t)(**kinds - '0');
        else {
            size_t *const letter = &letters[**kinds - 'k'];
            *letter = *letter == SIZE_MAX ? a->n : *letter;
            countable = countable && (*letter == 0 || product <= MOST_ITEMS / *letter);
            product *= *letter;
        }
    return any || (countable && a->n == (number ? number : 1) * product);
}

static bool overlap(const Py_buffer *one, const Py_buffer *other) {
    const char *const first = one->buf, *const second = other->buf;
    return one->len > 0 && other->len > 0 && first < second + other->len && second < first + one->len;
}

/* Whether no result is written to what is read, or to another result: loops would use what they wrote as if it had
 * been checked. */
static bool are_apart(const char *kinds, const Py_buffer *views, Py_ssize_t count) {
    bool written[MOST_ARGUMENTS];
    for (Py_ssize_t k = 0; k < count; k++) {
        written[k] = strchr("wlb", *kinds) != NULL;
        kinds += strcspn(kinds, " ");
        kinds += *kinds == ' ';
        for (Py_ssize_t before = 0; before < k; before++)
            if ((written[k] || written[before]) && overlap(&views[k], &views[before]))
                return false;
    }
    return true;
}

/* A call of a function by the kinds of its arguments: "Dn w3n w?n" are numbers, three results for each, and
 * optionally one more. */
static PyObject *called(const char *name, const char *kinds, bool (*call)(const argument *, long long *),
                        PyObject *const *given, Py_ssize_t count) {
    const char *const all_kinds = kinds;
    size_t letters[4] = {SIZE_MAX, SIZE_MAX, SIZE_MAX, SIZE_MAX};
    argument a[MOST_ARGUMENTS];
    Py_buffer views[MOST_ARGUMENTS];
    long long answer = 0;
    bool taken = true, sized = true, good = false;
    Py_ssize_t k = 0;
    for (; k < count && *kinds && taken; k++, kinds += *kinds == ' ') {
        taken = take(given[k], *kinds++, &a[k], &views[k]);
        sized = taken && has_size(&a[k], &kinds, letters) && sized;
    }
    if (taken && (k < count || *kinds))
        PyErr_Format(PyExc_TypeError, "core: %s does not take %d arguments", name, (int)count);
    else if (taken && !sized)
        PyErr_Format(PyExc_ValueError, "core: sizes of the arrays of %s do not match", name);
    else if (taken && !are_apart(all_kinds, views, count))
        PyErr_Format(PyExc_ValueError, "core: a result of %s overlaps another of its arrays in memory", name);
    else if (taken) {
        Py_BEGIN_ALLOW_THREADS good = call(a, &answer);
        Py_END_ALLOW_THREADS
        if (!good)
            PyErr_Format(PyExc_ValueError, "core: sizes of the arrays of %s, or numbers of items in them, do not match",
                         name);
    }
    for (Py_ssize_t used = taken ? k : k - 1; used-- > 0;)
        PyBuffer_Release(&views[used]); /* no effect without a buffer */
    return good ? PyLong_FromLongLong(answer) : NULL;
}

#define WRAP(name, kinds, fits, call) \
    static PyObject *py_##name(PyObject *module, PyObject *const *given, Py_ssize_t count) { \
        (void)module; \
        return called(#name, kinds, do_##name, given, count); \
    }
FUNCTIONS(WRAP)
#define ENTRY(name, kinds, fits, call) {#name, (PyCFunction)(void (*)(void))py_##name, METH_FASTCALL, NULL},
static PyMethodDef METHODS[] = {FUNCTIONS(ENTRY){NULL, NULL, 0, NULL}};

/* ---- laws as objects ---- */

enum { FEW = 1000 }; /* gaps, for which the interpreter lock is kept */

/* Base class of laws in Python: quantities at one float or a small array are computed here, all others by the
 * method `_ask_one`. */
typedef struct {
    PyObject_HEAD
    Py_buffer view; /* of the attribute `block` */
    mbma_law law;   /* its head is NULL before the first use */
} law_object;

/* Its law, opened when it is first needed: from then on nothing may change the block, which is not checked again. */
static const mbma_law *law_of(PyObject *self) {
    law_object *const own = (law_object *)self;
    if (own->law.head == NULL) {
        PyObject *const block = PyObject_GetAttrString(self, "block");
        argument words;
        Py_buffer view;
        const bool taken = block != NULL && take(block, 'D', &words, &view);
        Py_XDECREF(block);
        if (!taken)
            return NULL;
        const bool constant = view.readonly != 0, good = constant && is_law(&words);
        if (!constant)
            PyErr_Format(PyExc_ValueError, "core: the block of a law must be read-only");
        else if (!good)
            PyErr_Format(PyExc_ValueError, "core: the block is not that of a law");
        /* another thread may have set it */
        if (good && own->law.head == NULL) {
            own->view = view;
            own->law = mbma_law_open(words.data, words.n);
        } else
            PyBuffer_Release(&view);
        if (!good)
            return NULL;
    }
    return &own->law;
}

static void law_dealloc(PyObject *self) {
    PyTypeObject *const type = Py_TYPE(self);
    PyBuffer_Release(&((law_object *)self)->view);
    ((freefunc)PyType_GetSlot(type, Py_tp_free))(self);
    Py_DECREF(type);
}

/* A quantity of a small array of doubles, numpy's own as the block is; NULL if Python must compute it. */
static PyObject *ask_law_array(law_object *self, PyObject *gaps, bool by_mean, int what) {
    double *out[5] = {NULL}, separations[FEW];
    argument a = {0};
    Py_buffer view;
    PyObject *found = NULL;
    if (self->law.head != NULL && Py_TYPE(gaps) == Py_TYPE(self->view.obj) && (size_t)PyObject_Size(gaps) - 1 < FEW)
        found = PyObject_CallMethod(gaps, "copy", NULL);
    if (found != NULL && take(found, 'w', &a, &view)) {
        out[what] = a.data;
        for (size_t k = 0; k < a.n && a.n <= FEW; k++)
            separations[k] = by_mean ? 2.0 * out[what][k] - self->law.head->h_max : out[what][k];
        if (a.n > FEW || mbma_law_fill(a.n, separations, &self->law, out[0], out[1], out[2], out[3], out[4]) > 0)
            a.n = 0;
        PyBuffer_Release(&view);
    }
    if (a.n == 0)
        Py_CLEAR(found);
    PyErr_Clear();
    return found;
}

/* One gap or an array: the mean separation by position or by name, or the separation by name. */
static PyObject *ask_law(PyObject *self, PyObject *const *given, Py_ssize_t count, PyObject *names, int what) {
    const Py_ssize_t named = names == NULL ? 0 : PyTuple_Size(names);
    PyObject *by[] = {count > 0 ? given[0] : Py_None, Py_None};
    if (count > 1)
        return PyErr_Format(PyExc_TypeError, "one mean separation is taken, or separation=, got %zd arguments", count);
    for (Py_ssize_t k = 0; k < named; k++) {
        PyObject *const name = PyTuple_GetItem(names, k);
        const bool is_d = PyUnicode_CompareWithASCIIString(name, "separation") == 0;
        if (!is_d && (count > 0 || PyUnicode_CompareWithASCIIString(name, "mean_separation") != 0))
            return PyErr_Format(PyExc_TypeError, "unexpected keyword argument %R: mean_separation or separation is taken",
                                name);
        by[is_d] = given[count + k];
    }
    const bool by_d = by[0] == Py_None;
    PyObject *found = NULL;
    if (by[!by_d] == Py_None) {
        if (PyFloat_CheckExact(by[by_d])) {
            const mbma_law *const law = law_of(self);
            if (law == NULL)
                return NULL;
            const double gap = PyFloat_AsDouble(by[by_d]);
            const double value = mbma_law_at(law, (mbma_quantity)what, by_d ? gap : 2.0 * gap - law->head->h_max);
            /* NaN: rejected below, with a reason */
            if (value == value)
                return PyFloat_FromDouble(value);
        } else
            found = ask_law_array((law_object *)self, by[by_d], !by_d, what);
    }
    return found != NULL ? found : PyObject_CallMethod(self, "_ask_one", "iOO", what, by[0], by[1]);
}

#define QUANTITIES(OF) \
    OF(pressure, MBMA_FORCE, "F/A0 in the unit of E_star; where contact ends at h_max, zero from there on.") \
    OF(area, MBMA_AREA, "A/A0; where contact ends at h_max, zero from there on.") \
    OF(stiffness, MBMA_STIFFNESS, \
       "-dp/du, against the mean separation u = (h_max + d)/2: -2 dp/dd.\n\n" \
       "MBMA's jumps where zeta_d reaches its floor, and belongs to the larger gap there.") \
    OF(area_slope, MBMA_AREA_SLOPE, "-d(A/A0)/dd.") \
    OF(energy, MBMA_ENERGY, "Elastic energy per nominal area, the integral of F/A0 over u to last contact.")
#define ASK(name, what, text) \
    static PyObject *law_##name(PyObject *self, PyObject *const *given, Py_ssize_t count, PyObject *names) { \
        return ask_law(self, given, count, names, what); \
    } \
    static double call_##name(double d, void *law) { return mbma_law_at((const mbma_law *)law, what, d); }
QUANTITIES(ASK)

/* Addresses of the functions of (d, data), one for each quantity, and data, which is valid as long as the law. */
static PyObject *law_addresses(PyObject *self, PyObject *nothing) {
    const mbma_law *const law = law_of(self);
    (void)nothing;
#define ADDRESS(name, what, text) (unsigned long long)(uintptr_t)call_##name,
    return law ? Py_BuildValue("(KKKKK)K", QUANTITIES(ADDRESS) (unsigned long long)(uintptr_t)law) : NULL;
}

#define METHOD(name, what, text) \
    {#name, (PyCFunction)(void (*)(void))law_##name, METH_FASTCALL | METH_KEYWORDS, \
     #name "($self, mean_separation=None, *, separation=None)\n--\n\n" text},
static PyMethodDef LAW_METHODS[] = {
    QUANTITIES(METHOD){"_addresses", law_addresses, METH_NOARGS, NULL},
    {NULL, NULL, 0, NULL},
};
static PyType_Slot LAW_SLOTS[] = {
    {Py_tp_dealloc, (void *)law_dealloc},
    {Py_tp_methods, LAW_METHODS},
    {Py_tp_doc, (void *)"Quantities of a contact law's block at separations."},
    {0, NULL},
};
static PyType_Spec LAW_TYPE = {"mbma_tables.core.Law", sizeof(law_object), 0, Py_TPFLAGS_DEFAULT | Py_TPFLAGS_BASETYPE,
                               LAW_SLOTS};

#if defined(__x86_64__) || defined(_M_X64)
__attribute__((target("xsave"))) static uint64_t enabled_registers(void) { return (uint64_t)_xgetbv(0); }

/* 4, 3 or 1: the newest of the generations x86-64-v4, x86-64-v3 and x86-64 that processor and system support. */
static int generation(void) {
    unsigned a, b, c, d, b7, extended;
    if (!__get_cpuid(1, &a, &b, &c, &d))
        return 1;
    const unsigned first = bit_SSE4_2 | bit_POPCNT | bit_MOVBE | bit_FMA | bit_AVX | bit_F16C | bit_OSXSAVE;
    if ((c & first) != first || !__get_cpuid_count(7, 0, &a, &b7, &c, &d))
        return 1;
    const uint64_t registers = enabled_registers();
    const unsigned second = bit_AVX2 | bit_BMI | bit_BMI2;
    if (!__get_cpuid(0x80000001, &a, &b, &extended, &d) || !(extended & bit_LZCNT) || (b7 & second) != second ||
        (registers & 6) != 6)
        return 1;
    const unsigned third = bit_AVX512F | bit_AVX512DQ | bit_AVX512CD | bit_AVX512BW | bit_AVX512VL;
    return (b7 & third) == third && (registers & 0xE6) == 0xE6 ? 4 : 3;
}
#else
static int generation(void) { return 0; }
#endif

static int execute(PyObject *module) {
    PyObject *const law = PyType_FromSpec(&LAW_TYPE);
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
    const char *const arithmetic = "fma";
#else
    const char *const arithmetic = "plain";
#endif
    const bool good = PyModule_AddObjectRef(module, "Law", law) == 0 &&
                      PyModule_AddStringConstant(module, "arithmetic", arithmetic) == 0 &&
                      PyModule_AddIntConstant(module, "generation", generation()) == 0;
    Py_XDECREF(law);
    return good ? 0 : -1;
}

static PyModuleDef_Slot SLOTS[] = {{Py_mod_exec, (void *)execute}, {0, NULL}};

#define TEXT_OF(name) #name
#define TEXT(name) TEXT_OF(name)
#define JOINED_OF(a, b) a##b
#define JOINED(a, b) JOINED_OF(a, b)

static struct PyModuleDef MODULE = {
    PyModuleDef_HEAD_INIT, TEXT(MBMA_MODULE), "The compiled core.", 0, METHODS, SLOTS, NULL, NULL, NULL,
};

PyMODINIT_FUNC JOINED(PyInit_, MBMA_MODULE)(void) { return PyModuleDef_Init(&MODULE); }
