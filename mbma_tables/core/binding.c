/* The core as a Python module (stable ABI of CPython 3.11): buffers in, numbers out, the interpreter lock released.
 *
 * The same sources are compiled for each generation of processor, as modules of different names; `core/__init__.py`
 * imports the best one that the processor can run. Sizes are checked here, values in the core.
 */
#define Py_LIMITED_API 0x030B0000
#define PY_SSIZE_T_CLEAN
#if __has_include(<Python.h>)
#include <Python.h>
#else
#include "stable_abi.h"
#endif
#if defined(__x86_64__) || defined(_M_X64)
#include <cpuid.h>
#include <immintrin.h>
#endif

#include "closed_forms.h"
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
} argument;

static void release(argument *a, Py_ssize_t count) {
    for (Py_ssize_t k = 0; k < count; k++)
        PyBuffer_Release(&a[k].view); /* nothing where no buffer was taken */
}

/* One argument by its kind: d a double, i a whole number; arrays of D doubles, L int64, J int32, F floats to be read,
 * and w doubles, l int64, b bytes to be written. */
static bool take(PyObject *given, char kind, argument *a) {
    static const char KINDS[] = "DLJFwlb", *const FORMATS[] = {"d", "lq", "i", "f", "d", "lq", "B?"};
    static const Py_ssize_t SIZES[] = {8, 8, 4, 4, 8, 8, 1};
    memset(a, 0, sizeof *a);
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
    if (PyObject_GetBuffer(given, &a->view, access) != 0)
        return false;
    const char *const format = a->view.format ? a->view.format : "B", *const formats = FORMATS[number];
    if (a->view.itemsize != SIZES[number] || strchr(formats, format[0]) == NULL || format[1] != '\0') {
        PyErr_Format(PyExc_TypeError, "core: an array of '%c' was expected, got one of '%s'", formats[0], format);
        release(a, 1);
        return false;
    }
    a->data = a->view.buf;
    a->n = (size_t)(a->view.len / a->view.itemsize);
    return true;
}

/* Whether an array has the size that is said from *kinds on, if there is any: a product of a number and of the letters
 * k, m and n, each the size of the first array that has it; ? allows None. */
static bool has_size(const argument *a, const char **kinds, size_t letters[4]) {
    bool any = **kinds == ' ' || **kinds == '\0';
    size_t number = 0, product = 1;
    for (; **kinds != ' ' && **kinds != '\0'; ++*kinds)
        if (**kinds == '?')
            any = a->data == NULL;
        else if (**kinds <= '9')
            number = 10 * number + (size_t)(**kinds - '0');
        else {
            size_t *const letter = &letters[**kinds - 'k'];
            *letter = *letter == SIZE_MAX ? a->n : *letter;
            product *= *letter;
        }
    return any || a->n == (number ? number : 1) * product;
}

/* All arguments: "Dn w3n w?n" are numbers, three answers for each, and if wanted one more; `fit`: their sizes do. */
static bool take_all(PyObject *const *given, Py_ssize_t count, const char *kinds, argument *a, const char *name,
                     bool *fit) {
    size_t letters[4] = {SIZE_MAX, SIZE_MAX, SIZE_MAX, SIZE_MAX};
    Py_ssize_t k = 0;
    for (*fit = true; k < count && *kinds; k++, kinds += *kinds == ' ') {
        if (!take(given[k], *kinds++, &a[k])) {
            release(a, k);
            return false;
        }
        *fit = has_size(&a[k], &kinds, letters) && *fit;
    }
    if (k == count && *kinds == '\0')
        return true;
    PyErr_Format(PyExc_TypeError, "core: %s does not take %d arguments", name, (int)count);
    release(a, k);
    return false;
}

/* A function `name` of arguments by their kinds; `fits` says of sizes what kinds cannot, `call` is a whole number. */
#define WRAP(name, kinds, fits, call) \
    static PyObject *py_##name(PyObject *module, PyObject *const *given, Py_ssize_t count) { \
        argument a[MOST_ARGUMENTS]; \
        long long found = 0; \
        bool good; \
        (void)module; \
        if (!take_all(given, count, kinds, a, #name, &good)) \
            return NULL; \
        good = good && (fits); \
        if (good) { \
            Py_BEGIN_ALLOW_THREADS found = (long long)(call); \
            Py_END_ALLOW_THREADS \
        } else \
            PyErr_Format(PyExc_ValueError, "core: sizes of the arrays of " #name " do not match"); \
        release(a, count); \
        return good ? PyLong_FromLongLong(found) : NULL; \
    }

/* Of an argument its items, how many, a double, a whole number; how many doubles a structure has. */
#define P(k) a[k].data
#define N(k) a[k].n
#define X(k) a[k].d
#define I(k) a[k].i
#define WORDS(type) (sizeof(type) / sizeof(double))

/* Elementary functions of an array, for their test against mpmath. */
static size_t elementary(int64_t which, size_t n, const double *x, double *out) {
    for (size_t k = 0; k < n; k++)
        out[k] = which == 0 ? mbma_exp(x[k]) : which == 1 ? mbma_expm1(x[k]) : which == 2 ? mbma_log(x[k])
                 : which == 3 ? mbma_log1p(x[k]) : mbma_erf(x[k]);
    return 0;
}

static int of_islands(double (*form)(double, double), size_t n, const double *X, const double *mu, double *out) {
    for (size_t k = 0; k < n; k++)
        out[k] = form(X[k], mu[k]);
    return 0;
}
#define OF_ISLANDS(name) of_islands(mbma_##name, N(0), P(0), P(1), P(2))

static int of_gaps(double (*form)(double, double, double, double), const argument *a) {
    const double *const d = P(0), *const h_max = P(1), *const zeta_1 = P(2), *const hurst = P(3);
    double *const out = P(4);
    for (size_t k = 0; k < N(0); k++)
        out[k] = form(d[k], h_max[k], zeta_1[k], hurst[k]);
    return 0;
}

/* The table from three arrays: cells, places, and X_low, X_high, X_rate, mu_high, first_bucket, buckets. */
static mbma_cells cells_of(const argument *a) {
    const double *const n = P(2);
    return (mbma_cells){P(0), P(1), n[0], n[1], n[2], n[3], (int64_t)n[4], (int64_t)n[5]};
}
#define CELLS(k) ((const mbma_cells[]){cells_of(a + (k))})

/* Whether places and cells lie inside their arrays; checked once for a table, by the function `table_fits`. */
static bool is_table(const argument *a) {
    const mbma_cells t = cells_of(a);
    const double steps = (t.X_high - t.X_low) * t.X_rate;
    if (N(0) % WORDS(mbma_cell) != 0 || !(steps >= 0.0 && steps < (double)N(1) && t.buckets > 0))
        return false;
    const size_t strips = (size_t)steps + 1, cells = N(0) / WORDS(mbma_cell);
    for (size_t k = 0; k < N(1); k++) {
        const int64_t place = t.places[k];
        if (place < 0 || (k < strips ? (size_t)(place + t.buckets) > N(1) : (size_t)place >= cells))
            return false;
    }
    return true;
}

/* From density_divisor, beta, phi, floor_d, floor_u, offset, summit_sigma, printed. */
static mbma_variant variant_of(const argument *a) {
    const double *const n = a->data;
    return (mbma_variant){n[0], n[1], n[2], n[3], n[4], n[5] != 0.0, n[6] != 0.0, n[7] != 0.0};
}
#define VARIANT(k) ((const mbma_variant[]){variant_of(a + (k))})

enum { PLACES = MBMA_PANEL_NODES + MBMA_PANEL_CHECKS, SERIES_TERMS = 2 * MBMA_PANEL_GAPS };

/* The rules as one array, kinds, low and high ends and fields of panels, and how many rows these have. */
static bool are_panels(const argument *a) {
    const size_t panels = N(1);
    if (N(0) != WORDS(mbma_rules) || I(5) < 2 || I(5) > MBMA_PANEL_ROWS || N(4) != (size_t)(I(5) + 2) * panels * PLACES)
        return false;
    for (size_t k = 0; k < panels; k++)
        if (((const uint64_t *)P(1))[k] > 2)
            return false;
    return true;
}
#define NODES(k) ((const mbma_nodes[]){{(int64_t)N((k) + 1), P(k), P((k) + 1), P((k) + 2)}})

/* How many coefficients a table of so many nodes has; 0 of one that cannot be. */
static size_t coefficients_of(const argument *nodes) {
    const int64_t *const count = (const int64_t *)nodes->data;
    size_t product = 2;
    for (size_t k = 0; k < 4; k++)
        product *= count[k] >= 2 && count[k] < 4096 ? (size_t)(count[k] + 2) : 0;
    return product;
}

#define BASIS(k) ((const mbma_basis[]){{N(k), P(k), P((k) + 1), P((k) + 2), P((k) + 3)}})
#define LAW(k) ((const mbma_law[]){mbma_law_open(P(k), N(k))})
#define INVERSE(k) ((const mbma_inverse[]){mbma_inverse_open(P(k), N(k))})

/* First in all calls: coefficients; first nodes, rates, ends of what is covered, three constants; cells; of surfaces
 * Hurst exponents and ln zeta_1. Then their h_max, ends and pieces, or None. */
#define SPLINE "F D13 L3 Dn Dn "
static bool fits_spline(const argument *a) {
    const int64_t *const c = P(2);
    for (int k = 0; k < 3; k++)
        if (c[k] < 1 || c[k] > 100000)
            return false;
    const size_t coefficients = (size_t)(c[0] + 5) * (size_t)(c[1] + 5) * (size_t)(c[2] + 5) + 2;
    return P(7) ? N(7) == N(3) * 6 * (size_t)c[2] : N(0) >= coefficients;
}
static mbma_spline spline_of(const argument *a) {
    const int64_t *const c = P(2);
    const double *const x = P(1);
    return (mbma_spline){P(0), {(size_t)c[0], (size_t)c[1], (size_t)c[2]}, {x[0], x[1], x[2]}, {x[3], x[4], x[5]},
                         {x[6], x[8]}, {x[7], x[9]}};
}
#define CONSTANT(k) ((const double *)P(1))[10 + (k)]
#define LOG_FORCE ((const mbma_spline[]){spline_of(a)})
#define CALIBRATED ((const mbma_calibrated_table[]){{spline_of(a), CONSTANT(0), CONSTANT(1), CONSTANT(2)}})
#define SURFACES ((const mbma_surfaces[]){{N(3), P(3), P(4), P(5), P(6), P(7)}})

/* Of a law: gradient and alpha, seven constants and h_max. */
#define WAVES ((const mbma_waves[]){{N(0), P(0), P(1), P(2), NUMBER(0), NUMBER(1)}})
#define NUMBER(k) ((const double *)P(3))[k]
#define CONSTANTS \
    ((const mbma_law_constants[]){{NUMBER(2), NUMBER(3), NUMBER(4), NUMBER(5), NUMBER(6), NUMBER(7), NUMBER(8)}})

/* Every function: its name, the kinds of its arguments, what else their sizes must be, and the call. */
#define FUNCTIONS(FN) \
    /* elementary.h */ \
    FN(elementary, "i Dn wn", true, elementary(I(0), N(1), P(1), P(2))) \
    /* closed_forms.h */ \
    FN(pocket_phi_F, "Dn Dn wn", true, OF_ISLANDS(pocket_phi_F)) \
    FN(pocket_phi_A, "Dn Dn wn", true, OF_ISLANDS(pocket_phi_A)) \
    FN(standard_phi_F, "Dn Dn wn", true, OF_ISLANDS(standard_phi_F)) \
    FN(standard_phi_A, "Dn Dn wn", true, OF_ISLANDS(standard_phi_A)) \
    FN(long_phi_F, "Dn Dn wn", true, OF_ISLANDS(long_phi_F)) \
    FN(long_phi_A, "Dn Dn wn", true, OF_ISLANDS(long_phi_A)) \
    FN(totals_pressure, "Dn Dn Dn Dn wn", true, of_gaps(mbma_totals_pressure, a)) \
    FN(totals_area, "Dn Dn Dn Dn wn", true, of_gaps(mbma_totals_area, a)) \
    /* phi.c */ \
    FN(table_fits, "D J D", true, N(2) == 6 && is_table(a)) \
    FN(phi, "Dn Dn D J D6 i w b?n", N(6) == N(0) * (I(5) ? 7 : 3), \
       mbma_phi(N(0), P(0), P(1), CELLS(2), (int)I(5), P(6), P(7))) \
    /* totals.c */ \
    FN(totals, "Dn Dn Dn Dn d D8 D J D6 i w wn bn l1", N(10) == N(0) * (I(9) ? 2 * MBMA_TOTALS_COLUMNS : 2), \
       mbma_totals(N(0), P(0), P(1), P(2), P(3), X(4), VARIANT(5), CELLS(6), (int)I(9), P(10), P(11), P(12), P(13))) \
    FN(island_geometry, "d d d D8 w", N(4) == WORDS(mbma_island), \
       mbma_island_geometry(X(0), X(1), X(2), VARIANT(3), P(4))) \
    FN(kronrod, "i wn wn wn", I(0) > 0 && I(0) < 32 && N(1) == (size_t)I(0), \
       mbma_kronrod((int)I(0), P(1), P(2), P(3))) \
    /* profile.c */ \
    FN(profile_islands, "Dn d d d D8 D J D6 w4n w1", true, \
       mbma_profile_islands(N(0), P(0), X(1), X(2), X(3), VARIANT(4), CELLS(5), P(8), P(9))) \
    FN(profile_missed, "D Ln Dn Dn D i d wn", are_panels(a), \
       (mbma_profile_missed(P(0), N(1), P(1), P(2), P(3), P(4), (int)I(5), X(6), P(7)), 0)) \
    FN(profile_series, "D Ln Dn Dn D i w wn w wm wm l", \
       are_panels(a) && N(6) == N(1) * (size_t)I(5) * SERIES_TERMS && N(9) == N(1) * MBMA_PANEL_NODES && \
       N(8) == (size_t)I(5) * N(9) && N(11) == N(1) + 1, \
       (mbma_profile_series(P(0), N(1), P(1), P(2), P(3), P(4), (int)I(5), P(6), P(7), NODES(8), P(11)), 0)) \
    FN(profile_totals, "D D D i i w", \
       N(1) > 1 && I(3) > 0 && I(3) <= MBMA_PANEL_ROWS && N(2) == (N(1) - 1) * (size_t)I(3) * SERIES_TERMS && \
       N(5) == N(0) * (size_t)I(3) * (I(4) ? 2 : 1), \
       (mbma_profile_totals(N(0), P(0), N(1) - 1, P(1), P(2), (int)I(3), (int)I(4), P(5)), 0)) \
    /* spline4.c */ \
    FN(spline4, "D D L4 i w", \
       N(1) > 0 && N(1) == coefficients_of(&a[2]) && N(0) % 4 == 0 && N(4) == N(0) / 4 * (I(3) ? 10 : 2), \
       mbma_spline4(N(0) / 4, P(0), P(1), P(2), I(3) != 0, P(4))) \
    /* newton.c */ \
    FN(height_integrals, "i Dn wn", true, mbma_height_integrals(I(0), N(1), P(1), P(2))) \
    FN(islands_work, "i", I(0) >= 0 && I(0) < 1 << 20, MBMA_ISLANDS_WORK(I(0))) \
    FN(solve_islands, "Dn Dn d Dk Dk Dkk Dkk Dm Dm Dmm Dmm w3n ln bn w?nk w?nk w?nk w", \
       N(15) == N(14) && N(16) == N(14) && N(17) >= MBMA_ISLANDS_WORK(N(3)), \
       mbma_solve_islands(N(0), P(0), P(1), X(2), BASIS(3), BASIS(7), P(11), P(12), P(13), P(14), P(15), P(16), \
                          P(17))) \
    FN(island_extents, "Dn Dn d wn", true, mbma_island_extents(N(0), P(0), P(1), X(2), P(3))) \
    /* law.c */ \
    FN(law_fill, "Dn D w?n w?n w?n w?n w?n", LAW(1)->head, \
       mbma_law_fill(N(0), P(0), LAW(1), P(2), P(3), P(4), P(5), P(6))) \
    FN(inverse_nodes, "Dn D i d wn wn", LAW(1)->head, \
       mbma_inverse_nodes(N(0), P(0), LAW(1), (mbma_quantity)I(2), X(3), P(4), P(5))) \
    FN(law_invert, "Dn D D i wn w?n w?n", LAW(1)->head && INVERSE(2)->head, \
       mbma_law_invert(N(0), P(0), LAW(1), INVERSE(2), (mbma_quantity)I(3), P(4), P(5), P(6))) \
    /* calibrated.c */ \
    FN(spline_pieces, SPLINE "D D D w", fits_spline(a) && !P(7) && N(8) == N(3) * 6 * (size_t)((int64_t *)P(2))[2], \
       mbma_spline_pieces(LOG_FORCE, SURFACES, P(8))) \
    FN(calibrated_ends, SPLINE "Dn D D w2n", fits_spline(a), mbma_calibrated_ends(CALIBRATED, SURFACES, P(8))) \
    FN(calibrated_contact, SPLINE "Dn D2n D Lm Dm wm wm wm", fits_spline(a) && N(3) > 0, \
       mbma_calibrated_contact(CALIBRATED, SURFACES, N(8), P(8), P(9), P(10), P(11), P(12))) \
    FN(calibrated_separation, SPLINE "Dn D2n D Lm Dm wm", fits_spline(a) && N(3) > 0, \
       mbma_calibrated_separation(CALIBRATED, SURFACES, N(8), P(8), P(9), P(10))) \
    FN(spline_values, SPLINE "D D D Lm Dm wm wm", fits_spline(a) && N(3) > 0, \
       mbma_spline_values(LOG_FORCE, SURFACES, N(8), P(8), P(9), P(10), P(11))) \
    FN(self_affine, "Dn Dn wn wn", true, mbma_self_affine(N(0), P(0), P(1), P(2), P(3))) \
    /* spectrum_laws.c */ \
    FN(words_of_spectrum_law, "", true, WORDS(mbma_spectrum_law)) \
    FN(spectrum_waves, "Dn Dn wm wm wm w4", true, mbma_spectrum_waves(N(0), P(0), P(1), N(2), P(2), P(3), P(4), P(5))) \
    FN(spectrum_law_of, "Dn Dn Dn D10 w3n w", N(5) == WORDS(mbma_spectrum_law), \
       mbma_spectrum_law_of(WAVES, CONSTANTS, NUMBER(9), P(4), P(5))) \
    FN(spectrum_law_contact, "D Dn wn wn wn", N(0) == WORDS(mbma_spectrum_law), \
       mbma_spectrum_law_contact(P(0), N(1), P(1), P(2), P(3), P(4))) \
    FN(spectrum_law_separation, "D Dn i wn wn", N(0) == WORDS(mbma_spectrum_law), \
       mbma_spectrum_law_separation(P(0), N(1), P(1), I(2) != 0, P(3), P(4))) \
    /* hardness.c */ \
    FN(gaussian_level, "Dn wn", true, mbma_gaussian_level(N(0), P(0), P(1))) \
    FN(bearing_share, "Dn Dn wn wn", true, mbma_bearing_share(N(0), P(0), P(1), P(2), P(3))) \
    FN(capped_force, "Dn Dn Dn Dn Dn d d d wn wn", true, \
       mbma_capped_force(N(0), P(0), P(1), P(2), P(3), P(4), X(5), X(6), X(7), P(8), P(9))) \
    FN(gap_start, "i Dm Dm Dm i Dn Dn w6n", \
       I(0) > 0 && (I(0) == 1 || (uint64_t)I(0) == N(5)) && N(1) > 0 && N(1) % (size_t)I(0) == 0, \
       mbma_gap_start(N(5), N(1) / (size_t)I(0), (size_t)I(0), P(1), P(2), P(3), I(4) != 0, P(5), P(6), P(7))) \
    FN(gap_step, "Dn Dn i Ln Dm Dm w6m bn", true, \
       mbma_gap_step(N(0), P(0), P(1), I(2) != 0, P(3), N(4), P(4), P(5), P(6), P(7)))
FUNCTIONS(WRAP)
#define ENTRY(name, kinds, fits, call) {#name, (PyCFunction)(void (*)(void))py_##name, METH_FASTCALL, NULL},
static PyMethodDef METHODS[] = {FUNCTIONS(ENTRY){NULL, NULL, 0, NULL}};

/* ---- laws as objects ---- */

enum { FEW = 1000 }; /* gaps, for which the interpreter lock is kept */

/* Base class of laws in Python: quantities at one float, or at an array of few, are answered here, all else by the
 * method `_ask_one`. */
typedef struct {
    PyObject_HEAD
    Py_buffer view; /* of the attribute `block` */
    mbma_law law;   /* its head is NULL before the first question */
} law_object;

static const mbma_law *law_of(PyObject *self) {
    law_object *const own = (law_object *)self;
    if (own->law.head == NULL) {
        PyObject *const block = PyObject_GetAttrString(self, "block");
        argument a[1];
        const bool taken = block != NULL && take(block, 'D', a);
        Py_XDECREF(block);
        if (!taken)
            return NULL;
        const mbma_law found = mbma_law_open(P(0), N(0));
        if (found.head == NULL)
            PyErr_Format(PyExc_ValueError, "core: the block is not that of a law");
        /* another thread may have been faster */
        if (found.head != NULL && own->law.head == NULL) {
            own->view = a->view;
            own->law = found;
        } else
            release(a, 1);
    }
    return own->law.head != NULL ? &own->law : NULL;
}

static void law_dealloc(PyObject *self) {
    PyTypeObject *const type = Py_TYPE(self);
    PyBuffer_Release(&((law_object *)self)->view);
    ((freefunc)PyType_GetSlot(type, Py_tp_free))(self);
    Py_DECREF(type);
}

/* A quantity of a small array of doubles, numpy's own as the block is; NULL where Python is to answer. */
static PyObject *ask_law_array(law_object *self, PyObject *gaps, bool by_mean, int what) {
    argument a[2] = {{0}};
    PyObject *found = NULL;
    if (self->law.head == NULL || Py_TYPE(gaps) != Py_TYPE(self->view.obj))
        return NULL;
    if (take(gaps, 'D', &a[0]) && a[0].view.ndim > 0 && N(0) > 0 && N(0) <= FEW)
        found = PyObject_CallMethod(gaps, "copy", NULL);
    if (found != NULL && take(found, 'w', &a[1])) {
        double *out[5] = {NULL}, separations[FEW];
        const double *const known = P(0);
        out[what] = P(1);
        for (size_t k = 0; by_mean && k < N(0); k++)
            separations[k] = 2.0 * known[k] - self->law.head->h_max;
        if (mbma_law_fill(N(0), by_mean ? separations : known, &self->law, out[0], out[1], out[2], out[3], out[4]) > 0)
            Py_CLEAR(found);
    }
    release(a, 2);
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
            /* NaN: refused below, with a reason */
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

/* Addresses of the functions of (d, data) that answer one quantity each, and data, which lives as long as the law. */
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
