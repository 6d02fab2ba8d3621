/* The core as a Python module (stable ABI of CPython 3.11): buffers in, numbers out, the interpreter lock released.
 *
 * The same sources are compiled once for each generation of processor, as modules of different names; `core/__init__.py`
 * imports the best one that the processor can run. Sizes are checked here, values in the core.
 */
#define Py_LIMITED_API 0x030B0000
#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include "elementary.h"
#include "mbma.h"

enum { MOST_ARGUMENTS = 24 };

/* An argument: a number, or the items of a buffer; `data` is NULL where None was given. */
typedef struct {
    double d;
    int64_t i;
    void *data;
    size_t n;
    Py_buffer view;
    bool held;
} argument;

static void release(argument *a, Py_ssize_t count) {
    for (Py_ssize_t k = 0; k < count; k++)
        if (a[k].held)
            PyBuffer_Release(&a[k].view);
}

/* One argument by its kind: d a double, i a whole number; arrays of D doubles, L int64, J int32, F floats, B bytes to be
 * read, and w doubles, l int64, b bytes to be written; of d, D and w None is taken for arrays that are not wanted. */
static bool take(PyObject *given, char kind, argument *a) {
    static const char *const KINDS = "DLJFBwlb";
    static const char *const FORMATS[] = {"d", "lq", "i", "f", "B?", "d", "lq", "B?"};
    static const Py_ssize_t SIZES[] = {8, 8, 4, 4, 1, 8, 8, 1};
    a->held = false;
    a->data = NULL;
    a->n = 0;
    if (kind == 'd') {
        a->d = PyFloat_AsDouble(given);
        return !(a->d == -1.0 && PyErr_Occurred());
    }
    if (kind == 'i') {
        a->i = PyLong_AsLongLong(given);
        return !(a->i == -1 && PyErr_Occurred());
    }
    if (given == Py_None)
        return true;
    const char *const place = strchr(KINDS, kind);
    const size_t number = (size_t)(place - KINDS);
    const bool writable = number >= 5;
    if (PyObject_GetBuffer(given, &a->view, (writable ? PyBUF_WRITABLE : 0) | PyBUF_C_CONTIGUOUS | PyBUF_FORMAT) != 0)
        return false;
    a->held = true;
    const char *const format = a->view.format ? a->view.format : "B";
    if (a->view.itemsize != SIZES[number] || strchr(FORMATS[number], format[0]) == NULL || format[1] != '\0') {
        PyErr_Format(PyExc_TypeError, "core: an array of '%c' was expected, got one of '%s'", FORMATS[number][0], format);
        return false;
    }
    a->data = a->view.buf;
    a->n = (size_t)(a->view.len / a->view.itemsize);
    return true;
}

static bool take_all(PyObject *const *given, Py_ssize_t count, const char *kinds, argument *a, const char *name) {
    if (count != (Py_ssize_t)strlen(kinds)) {
        PyErr_Format(PyExc_TypeError, "core: %s takes %d arguments, got %d", name, (int)strlen(kinds), (int)count);
        return false;
    }
    for (Py_ssize_t k = 0; k < count; k++)
        if (!take(given[k], kinds[k], &a[k])) {
            release(a, a[k].held ? k + 1 : k);
            return false;
        }
    return true;
}

/* A function `name` of arguments by their kinds; `fits` checks their sizes, `call` gives a whole number. */
#define WRAP(name, kinds, fits, call) \
    static PyObject *py_##name(PyObject *module, PyObject *const *given, Py_ssize_t count) { \
        argument a[MOST_ARGUMENTS]; \
        long long found = 0; \
        (void)module; \
        if (!take_all(given, count, kinds, a, #name)) \
            return NULL; \
        const bool good = (fits); \
        if (good) { \
            Py_BEGIN_ALLOW_THREADS found = (long long)(call); \
            Py_END_ALLOW_THREADS \
        } else \
            PyErr_SetString(PyExc_ValueError, "core: sizes of the arrays of " #name " do not match"); \
        release(a, count); \
        return good ? PyLong_FromLongLong(found) : NULL; \
    }
#define ENTRY(name) {#name, (PyCFunction)(void (*)(void))py_##name, METH_FASTCALL, NULL}

/* Elementary functions of an array, for their test against mpmath. */
static size_t elementary(int64_t which, size_t n, const double *x, double *out) {
    for (size_t k = 0; k < n; k++)
        out[k] = which == 0 ? mbma_exp(x[k]) : which == 1 ? mbma_expm1(x[k]) : which == 2 ? mbma_log(x[k])
                 : which == 3 ? mbma_log1p(x[k]) : mbma_erf(x[k]);
    return 0;
}
WRAP(elementary, "iDw", a[1].n == a[2].n, elementary(a[0].i, a[1].n, a[1].data, a[2].data))

/* ---- phi.c ---- */

/* ---- totals.c ---- */

/* ---- profile.c ---- */

/* ---- spline4.c ---- */

/* ---- newton.c ---- */

/* ---- law.c ---- */

/* ---- calibrated.c ---- */

/* First in all calls: coefficients; first nodes, rates, ends of what is covered, three constants; cells; of surfaces
 * Hurst exponents, ln zeta_1, h_max or None, ends or None, pieces or None. */
#define SPLINE "FDLDDDDD"
enum { SPLINE_NUMBERS = 13 };
typedef struct {
    mbma_calibrated_table law;
    mbma_flow_table flow;
    mbma_surfaces surfaces;
} spline_call;
static bool fits_spline(const argument *a, bool law) {
    const int64_t *c = a[2].data;
    const size_t count = a[3].n;
    if (a[1].n != SPLINE_NUMBERS || a[2].n != 3 || a[4].n != count || (law && a[5].n != count))
        return false;
    for (int k = 0; k < 3; k++)
        if (c[k] < 1 || c[k] > 100000)
            return false;
    return a[7].data ? a[7].n == count * 6 * (size_t)c[2]
                     : a[0].n >= (size_t)(c[0] + 5) * (size_t)(c[1] + 5) * (size_t)(c[2] + 5) + 2;
}
static spline_call spline_of(const argument *a) {
    const int64_t *c = a[2].data;
    const double *x = a[1].data;
    const mbma_spline s = {a[0].data,          {(size_t)c[0], (size_t)c[1], (size_t)c[2]},
                           {x[0], x[1], x[2]}, {x[3], x[4], x[5]},
                           {x[6], x[8]},       {x[7], x[9]}};
    const spline_call call = {
        {s, x[10], x[11], x[12]}, {s, x[10], x[11]}, {a[3].n, a[3].data, a[4].data, a[5].data, a[6].data, a[7].data}};
    return call;
}
#define CALL_SPLINE(name, table, ...) \
    static size_t name(const argument *a) { \
        const spline_call call = spline_of(a); \
        return mbma_##name(&call.table, &call.surfaces, __VA_ARGS__); \
    }
CALL_SPLINE(spline_pieces, law.log_force, a[8].data)
CALL_SPLINE(calibrated_ends, law, a[8].data)
CALL_SPLINE(calibrated_contact, law, a[8].n, a[8].data, a[9].data, a[10].data, a[11].data, a[12].data)
CALL_SPLINE(calibrated_separation, law, a[8].n, a[8].data, a[9].data, a[10].data)
CALL_SPLINE(calibrated_slopes, law, a[8].data, a[9].data)
CALL_SPLINE(flow, flow, a[8].n, a[8].data, a[9].data, a[10].data, a[11].data)
WRAP(contact_area, "DDdw", a[0].n == a[1].n && a[0].n == a[3].n,
     mbma_contact_area(a[0].n, a[0].data, a[1].data, a[2].d, a[3].data))
WRAP(spline_pieces, SPLINE "w",
     fits_spline(a, false) && !a[7].data && a[8].n == a[3].n * 6 * (size_t)((int64_t *)a[2].data)[2], spline_pieces(a))
WRAP(calibrated_ends, SPLINE "w", fits_spline(a, true) && a[8].n == 2 * a[3].n, calibrated_ends(a))
WRAP(calibrated_contact, SPLINE "LDwww",
     fits_spline(a, true) && a[6].n == 2 * a[3].n && a[9].n == a[8].n && a[10].n == a[8].n && a[11].n == a[8].n &&
         a[12].n == a[8].n,
     calibrated_contact(a))
WRAP(calibrated_separation, SPLINE "LDw",
     fits_spline(a, true) && a[6].n == 2 * a[3].n && a[9].n == a[8].n && a[10].n == a[8].n, calibrated_separation(a))
WRAP(calibrated_slopes, SPLINE "Dw", fits_spline(a, true) && !a[7].data && a[8].n == a[3].n && a[9].n == 10 * a[3].n,
     calibrated_slopes(a))
WRAP(flow, SPLINE "LDDw", fits_spline(a, false) && a[9].n == a[8].n && a[10].n == a[8].n && a[11].n == a[8].n, flow(a))
WRAP(self_affine, "DDww", a[0].n == a[1].n && a[0].n == a[2].n && a[0].n == a[3].n,
     mbma_self_affine(a[0].n, a[0].data, a[1].data, a[2].data, a[3].data))

/* ---- spectrum_laws.c ---- */
#define WORDS(type) (sizeof(type) / sizeof(double))
static size_t inner_integrals(void *inner) {
    mbma_inner_integrals(inner);
    return 0;
}
/* The inner integrals; x, variances, shares below; gradient, alpha, seven constants and h_max; work; the law. */
static mbma_status spectrum_law_of(const argument *a) {
    const double *c = a[4].data;
    const mbma_waves waves = {a[1].n, a[1].data, a[2].data, a[3].data, c[0], c[1]};
    const mbma_law_constants constants = {c[2], c[3], c[4], c[5], c[6], c[7], c[8]};
    return mbma_spectrum_law_of(a[0].data, &waves, &constants, c[9], a[5].data, a[6].data);
}
WRAP(words_of_inner, "", true, WORDS(mbma_inner))
WRAP(words_of_spectrum_law, "", true, WORDS(mbma_spectrum_law))
WRAP(inner_integrals, "w", a[0].n == WORDS(mbma_inner), inner_integrals(a[0].data))
WRAP(spectrum_waves, "DDwwww", a[0].n == a[1].n && a[2].n == a[3].n && a[2].n == a[4].n && a[5].n == 2,
     mbma_spectrum_waves(a[0].n, a[0].data, a[1].data, a[2].n, a[2].data, a[3].data, a[4].data, a[5].data))
WRAP(spectrum_law_of, "DDDDDww",
     a[0].n == WORDS(mbma_inner) && a[1].n == a[2].n && a[1].n == a[3].n && a[4].n == 10 && a[5].n == 9 * a[1].n &&
         a[6].n == WORDS(mbma_spectrum_law),
     spectrum_law_of(a))
WRAP(spectrum_law_persson, "DDww", a[0].n == WORDS(mbma_spectrum_law) && a[2].n == a[1].n && a[3].n == a[1].n,
     mbma_spectrum_law_persson(a[0].data, a[1].n, a[1].data, a[2].data, a[3].data))
WRAP(spectrum_law_contact, "DDwww",
     a[0].n == WORDS(mbma_spectrum_law) && a[2].n == a[1].n && a[3].n == a[1].n && a[4].n == a[1].n,
     mbma_spectrum_law_contact(a[0].data, a[1].n, a[1].data, a[2].data, a[3].data, a[4].data))
WRAP(spectrum_law_separation, "DDw", a[0].n == WORDS(mbma_spectrum_law) && a[2].n == a[1].n,
     mbma_spectrum_law_separation(a[0].data, a[1].n, a[1].data, a[2].data))

/* ---- hardness.c ---- */

static PyMethodDef METHODS[] = {
    ENTRY(elementary),
    /* phi.c */

    /* totals.c */

    /* profile.c */

    /* spline4.c */

    /* newton.c */

    /* law.c */

    /* calibrated.c */
    ENTRY(contact_area),
    ENTRY(spline_pieces),
    ENTRY(calibrated_ends),
    ENTRY(calibrated_contact),
    ENTRY(calibrated_separation),
    ENTRY(calibrated_slopes),
    ENTRY(flow),
    ENTRY(self_affine),

    /* spectrum_laws.c */
    ENTRY(words_of_inner),
    ENTRY(words_of_spectrum_law),
    ENTRY(inner_integrals),
    ENTRY(spectrum_waves),
    ENTRY(spectrum_law_of),
    ENTRY(spectrum_law_persson),
    ENTRY(spectrum_law_contact),
    ENTRY(spectrum_law_separation),

    /* hardness.c */

    {NULL, NULL, 0, NULL},
};

#if defined(__x86_64__) || defined(_M_X64)
#include <cpuid.h>
#include <immintrin.h>

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

static int execute(PyObject *module) { return PyModule_AddIntConstant(module, "generation", generation()); }

static PyModuleDef_Slot SLOTS[] = {{Py_mod_exec, (void *)execute}, {0, NULL}};

#define TEXT_OF(name) #name
#define TEXT(name) TEXT_OF(name)
#define JOINED_OF(a, b) a##b
#define JOINED(a, b) JOINED_OF(a, b)

static struct PyModuleDef MODULE = {
    PyModuleDef_HEAD_INIT, TEXT(MBMA_MODULE), "The compiled core.", 0, METHODS, SLOTS, NULL, NULL, NULL,
};

PyMODINIT_FUNC JOINED(PyInit_, MBMA_MODULE)(void) { return PyModuleDef_Init(&MODULE); }
