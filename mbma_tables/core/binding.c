/* The core as a Python module (stable ABI of CPython 3.11): buffers in, numbers out, the interpreter lock released.
 *
 * The same sources are compiled once for each generation of processor, as modules of different names; `core/__init__.py`
 * imports the best one that the processor can run. Sizes are checked here, values in the core.
 */
#define Py_LIMITED_API 0x030B0000
#define PY_SSIZE_T_CLEAN
#if __has_include(<Python.h>)
#include <Python.h>
#else
#include "stable_abi.h"
#endif

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

/* The table from three arrays: cells, places, and X_low, X_high, X_rate, mu_high, first_bucket, buckets. */
static mbma_cells cells_of(const argument *a) {
    const double *const n = a[2].data;
    return (mbma_cells){a[0].data, a[1].data, n[0], n[1], n[2], n[3], (int64_t)n[4], (int64_t)n[5]};
}
/* Whether places and cells lie inside their arrays; checked once for a table, by the function `table_fits`. */
static bool is_table(const argument *a) {
    if (a[2].n != 6 || a[1].n == 0 || a[0].n % (sizeof(mbma_cell) / sizeof(double)) != 0)
        return false;
    const mbma_cells t = cells_of(a);
    const double steps = (t.X_high - t.X_low) * t.X_rate;
    if (!(steps >= 0.0 && steps < (double)a[1].n && t.buckets > 0))
        return false;
    const size_t strips = (size_t)steps + 1, cells = a[0].n / (sizeof(mbma_cell) / sizeof(double));
    for (size_t k = 0; k < a[1].n; k++) {
        const int64_t place = t.places[k];
        if (place < 0 || (k < strips ? (size_t)(place + t.buckets) > a[1].n : (size_t)place >= cells))
            return false;
    }
    return true;
}
WRAP(table_fits, "DJD", true, is_table(a))
static size_t phi_of(const argument *a, size_t n, int slopes) {
    const mbma_cells t = cells_of(a + 2);
    return mbma_phi(n, a[0].data, a[1].data, &t, slopes, a[6].data, a[7].data);
}
WRAP(phi, "DDDJDiwb",
     a[1].n == a[0].n && a[4].n == 6 && a[6].n == a[0].n * (a[5].i ? 7 : 3) && (!a[7].data || a[7].n == a[0].n),
     phi_of(a, a[0].n, (int)a[5].i))

/* ---- totals.c ---- */

/* From density_divisor, beta, phi, floor_d, floor_u, offset, summit_sigma, printed. */
static mbma_variant variant_of(const argument *a) {
    const double *const n = a->data;
    return (mbma_variant){n[0], n[1], n[2], n[3], n[4], n[5] != 0.0, n[6] != 0.0, n[7] != 0.0};
}
static size_t totals_of(const argument *a) {
    const mbma_variant v = variant_of(a + 5);
    const mbma_cells t = cells_of(a + 6);
    return mbma_totals(a[0].n, a[0].data, a[1].data, a[2].data, a[3].data, a[4].d, &v, &t, (int)a[9].i, a[10].data,
                       a[11].data, a[12].data, a[13].data);
}
WRAP(totals, "DDDDdDDJDiwwbl",
     a[1].n == a[0].n && a[2].n == a[0].n && a[3].n == a[0].n && a[5].n == 8 && a[8].n == 6 &&
         a[10].n == a[0].n * (a[9].i ? 2 * MBMA_TOTALS_COLUMNS : 2) && a[11].n == a[0].n && a[12].n == a[0].n && a[13].n == 1,
     totals_of(a))
static int64_t geometry_of(const argument *a) {
    const mbma_variant v = variant_of(a + 3);
    return mbma_island_geometry(a[0].d, a[1].d, a[2].d, &v, a[4].data);
}
WRAP(island_geometry, "dddDw", a[3].n == 8 && a[4].n == sizeof(mbma_island) / sizeof(double), geometry_of(a))
WRAP(kronrod, "iwww", a[0].i > 0 && a[0].i < 32 && a[1].n == (size_t)a[0].i && a[2].n == a[1].n && a[3].n == a[1].n,
     mbma_kronrod((int)a[0].i, a[1].data, a[2].data, a[3].data))

/* ---- profile.c ---- */

enum { PLACES = MBMA_PANEL_NODES + MBMA_PANEL_CHECKS, SERIES_TERMS = 2 * MBMA_PANEL_GAPS };

/* The rules as one array, and kinds, low and high ends and fields of panels. */
static bool are_panels(const argument *a, int64_t rows) {
    const size_t panels = a[1].n;
    if (a[0].n != sizeof(mbma_rules) / sizeof(double) || rows < 2 || rows > MBMA_PANEL_ROWS || a[2].n != panels ||
        a[3].n != panels || a[4].n != (size_t)(rows + 2) * panels * PLACES)
        return false;
    for (size_t k = 0; k < panels; k++) {
        const int64_t kind = ((const int64_t *)a[1].data)[k];
        if (kind < 0 || kind > 2)
            return false;
    }
    return true;
}
static int64_t islands_of_profile(const argument *a) {
    const mbma_variant v = variant_of(a + 4);
    const mbma_cells t = cells_of(a + 5);
    return mbma_profile_islands(a[0].n, a[0].data, a[1].d, a[2].d, a[3].d, &v, &t, a[8].data, a[9].data);
}
WRAP(profile_islands, "DdddDDJDww", a[4].n == 8 && a[7].n == 6 && a[8].n == 4 * a[0].n && a[9].n == 1,
     islands_of_profile(a))
WRAP(profile_missed, "DLDDDidw", are_panels(a, a[5].i) && a[7].n == a[1].n,
     (mbma_profile_missed(a[0].data, a[1].n, a[1].data, a[2].data, a[3].data, a[4].data, (int)a[5].i, a[6].d, a[7].data),
      0))
static int64_t series_of(const argument *a) {
    const mbma_nodes islands = {(int64_t)a[9].n, a[8].data, a[9].data, a[10].data};
    mbma_profile_series(a[0].data, a[1].n, a[1].data, a[2].data, a[3].data, a[4].data, (int)a[5].i, a[6].data, a[7].data,
                        &islands, a[11].data);
    return 0;
}
WRAP(profile_series, "DLDDDiwwwwwl",
     are_panels(a, a[5].i) && a[6].n == a[1].n * (size_t)a[5].i * SERIES_TERMS && a[7].n == a[1].n &&
         a[9].n == a[1].n * MBMA_PANEL_NODES && a[8].n == (size_t)a[5].i * a[9].n && a[10].n == a[9].n &&
         a[11].n == a[1].n + 1,
     series_of(a))
WRAP(profile_totals, "DDDiiw",
     a[1].n > 1 && a[3].i > 0 && a[3].i <= MBMA_PANEL_ROWS &&
         a[2].n == (a[1].n - 1) * (size_t)a[3].i * SERIES_TERMS && a[5].n == a[0].n * (size_t)a[3].i * (a[4].i ? 2 : 1),
     (mbma_profile_totals(a[0].n, a[0].data, a[1].n - 1, a[1].data, a[2].data, (int)a[3].i, (int)a[4].i, a[5].data), 0))

/* ---- spline4.c ---- */
/* How many coefficients a table of so many nodes has; 0 of one that cannot be. */
static size_t coefficients_of(const argument *nodes) {
    const int64_t *const count = (const int64_t *)nodes->data;
    size_t product = nodes->n == 4 ? 2 : 0;
    for (size_t k = 0; k < nodes->n && product; k++)
        product = count[k] >= 2 && count[k] < 4096 ? product * (size_t)(count[k] + 2) : 0;
    return product;
}
WRAP(spline4, "DDLiw",
     coefficients_of(&a[2]) && a[1].n == coefficients_of(&a[2]) && 4 * a[4].n == (a[3].i ? 10 : 2) * a[0].n,
     mbma_spline4(a[0].n / 4, a[0].data, a[1].data, a[2].data, a[3].i != 0, a[4].data))
WRAP(four_numbers, "DDDdiw", a[0].n == a[1].n && a[0].n == a[2].n && a[5].n == 4 * a[0].n,
     mbma_four_numbers(a[0].n, a[0].data, a[1].data, a[2].data, a[3].d, a[4].i != 0, a[5].data))

/* ---- newton.c ---- */

/* ---- law.c ---- */

/* ---- calibrated.c ---- */

/* ---- spectrum_laws.c ---- */

/* ---- hardness.c ---- */

WRAP(gaussian_level, "Dw", a[0].n == a[1].n, mbma_gaussian_level(a[0].n, a[0].data, a[1].data))
WRAP(bearing_share, "DDww", a[0].n == a[1].n && a[0].n == a[2].n && a[0].n == a[3].n,
     mbma_bearing_share(a[0].n, a[0].data, a[1].data, a[2].data, a[3].data))
WRAP(diffused, "DDiw", a[0].n == a[1].n && a[0].n == a[3].n,
     mbma_diffused(a[0].n, a[0].data, a[1].data, a[2].i != 0, a[3].data))
WRAP(capped_area, "DDDddiw", a[0].n == a[1].n && a[0].n == a[2].n && a[0].n == a[6].n,
     mbma_capped_area(a[0].n, a[0].data, a[1].data, a[2].data, a[3].d, a[4].d, a[5].i != 0, a[6].data))
WRAP(capped_force, "DDDDDdddww",
     a[0].n == a[1].n && a[0].n == a[2].n && a[0].n == a[3].n && a[0].n == a[4].n && a[0].n == a[8].n &&
         a[0].n == a[9].n,
     mbma_capped_force(a[0].n, a[0].data, a[1].data, a[2].data, a[3].data, a[4].data, a[5].d, a[6].d, a[7].d, a[8].data,
                       a[9].data))
WRAP(gap_start, "iDDDiDDw",
     (a[0].i == 1 || (uint64_t)a[0].i == a[5].n) && a[0].i > 0 && a[1].n % (size_t)a[0].i == 0 && a[1].n == a[2].n &&
         a[1].n == a[3].n && a[1].n > 0 && a[5].n == a[6].n && 6 * a[5].n == a[7].n,
     mbma_gap_start(a[5].n, a[1].n / (size_t)a[0].i, (size_t)a[0].i, a[1].data, a[2].data, a[3].data, a[4].i != 0,
                    a[5].data, a[6].data, a[7].data))
WRAP(gap_step, "DDiLDDwb",
     a[0].n == a[1].n && a[0].n == a[3].n && a[4].n == a[5].n && 6 * a[4].n == a[6].n && a[0].n == a[7].n,
     mbma_gap_step(a[0].n, a[0].data, a[1].data, a[2].i != 0, a[3].data, a[4].n, a[4].data, a[5].data, a[6].data,
                   a[7].data))

static PyMethodDef METHODS[] = {
    ENTRY(elementary),
    /* phi.c */
    ENTRY(table_fits),
    ENTRY(phi),

    /* totals.c */
    ENTRY(totals),
    ENTRY(island_geometry),
    ENTRY(kronrod),

    /* profile.c */
    ENTRY(profile_islands),
    ENTRY(profile_missed),
    ENTRY(profile_series),
    ENTRY(profile_totals),

    /* spline4.c */
    ENTRY(spline4),
    ENTRY(four_numbers),

    /* newton.c */

    /* law.c */

    /* calibrated.c */

    /* spectrum_laws.c */

    /* hardness.c */
    ENTRY(gaussian_level),
    ENTRY(bearing_share),
    ENTRY(diffused),
    ENTRY(capped_area),
    ENTRY(capped_force),
    ENTRY(gap_start),
    ENTRY(gap_step),

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
