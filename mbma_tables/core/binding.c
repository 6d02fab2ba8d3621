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
        out[k] = which == 0 ? mbma_exp(x[k]) : which == 1 ? mbma_expm1(x[k]) : which == 2 ? mbma_log(x[k]) : mbma_log1p(x[k]);
    return 0;
}
WRAP(elementary, "iDw", a[1].n == a[2].n, elementary(a[0].i, a[1].n, a[1].data, a[2].data))

/* ---- phi.c ---- */

/* ---- totals.c ---- */

/* ---- profile.c ---- */

/* ---- spline4.c ---- */

/* ---- newton.c ---- */
#define BASIS(k) {a[k].n, a[k].data, a[(k) + 1].data, a[(k) + 2].data, a[(k) + 3].data}
#define BASIS_FITS(k) (a[(k) + 1].n == a[k].n && a[(k) + 2].n == a[k].n * a[k].n && a[(k) + 3].n == a[k].n * a[k].n)
static size_t solve_islands(const argument *a) {
    const mbma_basis fine = BASIS(3), coarse = BASIS(7);
    return mbma_solve_islands(a[0].n, a[0].data, a[1].data, a[2].d, &fine, &coarse, a[11].data, a[12].data, a[13].data,
                              a[14].data, a[15].data, a[16].data, a[17].data);
}
WRAP(height_integrals, "iDw", a[1].n == a[2].n, mbma_height_integrals(a[0].i, a[1].n, a[1].data, a[2].data))
WRAP(islands_work, "i", true, MBMA_ISLANDS_WORK(a[0].i))
WRAP(solve_islands, "DDdDDDDDDDDwlbwwww",
     a[1].n == a[0].n && BASIS_FITS(3) && BASIS_FITS(7) && a[11].n == 3 * a[0].n && a[12].n == a[0].n &&
         a[13].n == a[0].n && a[14].n == (a[14].data ? a[0].n * a[3].n : 0) && a[15].n == a[14].n &&
         a[16].n == a[14].n && a[17].n >= MBMA_ISLANDS_WORK(a[3].n),
     solve_islands(a))
WRAP(island_extents, "DDdw", a[0].n == a[1].n && a[0].n == a[3].n,
     mbma_island_extents(a[0].n, a[0].data, a[1].data, a[2].d, a[3].data))
WRAP(damped_steps, "dddddiDwwwl",
     a[7].n > 0 && a[6].n == a[7].n * a[7].n && a[8].n == a[7].n && a[9].n == 2 && a[10].n == 1,
     mbma_damped_steps(a[0].d, a[1].d, a[2].d, a[3].d, a[4].d, a[5].i, a[7].n, a[6].data, a[7].data, a[8].data,
                       a[9].data, a[10].data))

/* ---- law.c ---- */

/* ---- calibrated.c ---- */

/* ---- spectrum_laws.c ---- */

/* ---- hardness.c ---- */

static PyMethodDef METHODS[] = {
    ENTRY(elementary),
    /* phi.c */

    /* totals.c */

    /* profile.c */

    /* spline4.c */

    /* newton.c */
    ENTRY(height_integrals),
    ENTRY(islands_work),
    ENTRY(solve_islands),
    ENTRY(island_extents),
    ENTRY(damped_steps),

    /* law.c */

    /* calibrated.c */

    /* spectrum_laws.c */

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
