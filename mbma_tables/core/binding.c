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
        out[k] = which == 0 ? mbma_exp(x[k]) : which == 1 ? mbma_expm1(x[k]) : which == 2 ? mbma_log(x[k])
                 : which == 3 ? mbma_log1p(x[k]) : mbma_erf(x[k]);
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
#define BASIS(k) {a[k].n, a[k].data, a[(k) + 1].data, a[(k) + 2].data, a[(k) + 3].data}
#define BASIS_FITS(k) (a[(k) + 1].n == a[k].n && a[(k) + 2].n == a[k].n * a[k].n && a[(k) + 3].n == a[k].n * a[k].n)
static size_t solve_islands(const argument *a) {
    const mbma_basis fine = BASIS(3), coarse = BASIS(7);
    return mbma_solve_islands(a[0].n, a[0].data, a[1].data, a[2].d, &fine, &coarse, a[11].data, a[12].data, a[13].data,
                              a[14].data, a[15].data, a[16].data, a[17].data);
}
WRAP(height_integrals, "iDw", a[1].n == a[2].n, mbma_height_integrals(a[0].i, a[1].n, a[1].data, a[2].data))
WRAP(islands_work, "i", a[0].i >= 0 && a[0].i < 1 << 20, MBMA_ISLANDS_WORK(a[0].i))
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
static mbma_law law_in(const argument *block) {
    return mbma_law_open(block->data, block->n);
}
static mbma_inverse inverse_in(const argument *block) {
    return mbma_inverse_open(block->data, block->n);
}
static bool is_law(const argument *a) { return law_in(a).head != NULL; }
/* whether arrays are as long as the first, or not wanted */
static bool alike(const argument *a, Py_ssize_t first, Py_ssize_t count) {
    bool good = a[0].data != NULL;
    for (Py_ssize_t k = first; k < first + count; k++)
        good = good && (a[k].data == NULL || a[k].n == a[0].n);
    return good;
}
static size_t law_fill(const argument *a) {
    const mbma_law law = law_in(&a[1]);
    return mbma_law_fill(a[0].n, a[0].data, &law, a[2].data, a[3].data, a[4].data, a[5].data, a[6].data);
}
WRAP(law_fill, "DDwwwww", is_law(&a[1]) && alike(a, 2, 5), law_fill(a))
static size_t law_records(const argument *a) {
    const mbma_law law = law_in(&a[2]);
    return mbma_law_records(a[0].n, a[0].data, a[1].data, &law, a[3].data);
}
WRAP(law_records, "DDDl", is_law(&a[2]) && a[1].data && a[3].data && alike(a, 1, 1) && alike(a, 3, 1), law_records(a))
static size_t inverse_nodes(const argument *a) {
    const mbma_law law = law_in(&a[1]);
    return mbma_inverse_nodes(a[0].n, a[0].data, &law, (mbma_quantity)a[2].i, a[3].d, a[4].data, a[5].data);
}
WRAP(inverse_nodes, "DDidww", is_law(&a[1]) && a[4].data && a[5].data && alike(a, 4, 2), inverse_nodes(a))
static size_t law_invert(const argument *a) {
    const mbma_law law = law_in(&a[1]);
    const mbma_inverse inverse = inverse_in(&a[2]);
    return mbma_law_invert(a[0].n, a[0].data, &law, &inverse, (mbma_quantity)a[3].i, a[4].data, a[5].data, a[6].data);
}
WRAP(law_invert, "DDDiwww", is_law(&a[1]) && inverse_in(&a[2]).head && a[4].data && alike(a, 4, 3), law_invert(a))
static size_t law_flow_fill(const argument *a) {
    const mbma_law flow = law_in(&a[1]);
    return mbma_law_flow_fill(a[0].n, a[0].data, &flow, a[2].d, a[3].d, a[4].data);
}
WRAP(law_flow_fill, "DDddw", is_law(&a[1]) && a[4].data && alike(a, 4, 1), law_flow_fill(a))
WRAP(law_fit, "DDDDDw",
     a[0].data && a[1].data && a[2].data && a[3].data && a[4].data && a[5].data && a[0].n % 2 == 0 &&
         a[1].n == MBMA_FIT_SAMPLES * a[0].n && a[2].n == MBMA_FIT_SAMPLES * MBMA_FIT_SAMPLES &&
         a[3].n == 2 * MBMA_FIT_SAMPLES && a[4].n == (MBMA_LAW_DEGREE + 1) * (MBMA_LAW_DEGREE + 1) &&
         a[5].n == a[0].n / 2 * (sizeof(mbma_law_record) / sizeof(double) + 3),
     mbma_law_fit(a[0].n / 2, a[0].data, a[1].data, a[2].data, a[3].data, a[4].data, a[5].data))

enum { FEW = 1000 }; /* gaps, for which the interpreter lock is kept */

/* Base class of laws in Python: quantities at one float, or at an array of few, are answered here, all else by the method
 * `_ask_one`. */
typedef struct {
    PyObject_HEAD
    Py_buffer view; /* of the attribute `block` */
    mbma_law law;   /* its head is NULL before the first question */
} law_object;

static const mbma_law *law_of(PyObject *self) {
    law_object *const own = (law_object *)self;
    if (own->law.head == NULL) {
        PyObject *const block = PyObject_GetAttrString(self, "block");
        argument a = {0};
        const bool good = block != NULL && take(block, 'D', &a);
        Py_XDECREF(block);
        if (!good)
            return NULL;
        mbma_law found = law_in(&a);
        /* another thread may have been faster */
        if (own->law.head == NULL && found.head != NULL) {
            own->view = a.view;
            own->law = found;
        } else
            release(&a, 1);
        if (found.head == NULL) {
            PyErr_SetString(PyExc_ValueError, "core: the block is not that of a law");
            return NULL;
        }
    }
    return &own->law;
}

static void law_dealloc(PyObject *self) {
    PyTypeObject *const type = Py_TYPE(self);
    if (((law_object *)self)->law.head != NULL)
        PyBuffer_Release(&((law_object *)self)->view);
    ((freefunc)PyType_GetSlot(type, Py_tp_free))(self);
    Py_DECREF(type);
}

/* A quantity of a small array of doubles, numpy's own as the block is; NULL where Python is to answer. */
static PyObject *ask_law_array(law_object *self, PyObject *gaps, int what) {
    argument a[2] = {{0}};
    PyObject *found = NULL;
    if (self->law.head == NULL || Py_TYPE(gaps) != Py_TYPE(self->view.obj) || !take(gaps, 'D', &a[0])) {
        PyErr_Clear();
        return NULL;
    }
    if (a[0].view.ndim > 0 && a[0].n > 0 && a[0].n <= FEW)
        found = PyObject_CallMethod(gaps, "copy", NULL);
    if (found != NULL && take(found, 'w', &a[1])) {
        double *out[5] = {NULL};
        out[what] = a[1].data;
        if (mbma_law_fill(a[0].n, a[0].data, &self->law, out[0], out[1], out[2], out[3], out[4]) > 0)
            Py_CLEAR(found);
    }
    release(a, 2);
    PyErr_Clear();
    return found;
}

static PyObject *ask_law(PyObject *self, PyObject *const *given, Py_ssize_t count, PyObject *names, int what) {
    const Py_ssize_t named = names == NULL ? 0 : PyTuple_Size(names);
    PyObject *by[] = {count > 0 ? given[0] : Py_None, Py_None};
    if (count > 1)
        return PyErr_Format(PyExc_TypeError, "one separation, or u=, is taken, got %zd arguments", count);
    for (Py_ssize_t k = 0; k < named; k++) {
        PyObject *const name = PyTuple_GetItem(names, k);
        const bool is_u = PyUnicode_CompareWithASCIIString(name, "u") == 0;
        if (!is_u && (count > 0 || PyUnicode_CompareWithASCIIString(name, "separation") != 0))
            return PyErr_Format(PyExc_TypeError, "unexpected keyword argument %R: separation or u is taken", name);
        by[is_u] = given[count + k];
    }
    const int which = by[0] == Py_None;
    if (PyFloat_CheckExact(by[which]) && by[1 - which] == Py_None) {
        const mbma_law *const law = law_of(self);
        if (law == NULL)
            return NULL;
        const double gap = PyFloat_AsDouble(by[which]);
        const double found = mbma_law_at(law, (mbma_quantity)what, which ? 2.0 * gap - law->head->h_max : gap);
        /* NaN: refused below, with a reason */
        if (found == found)
            return PyFloat_FromDouble(found);
    }
    PyObject *const found = which ? NULL : ask_law_array((law_object *)self, by[0], what);
    return found != NULL ? found : PyObject_CallMethod(self, "_ask_one", "iOO", what, by[0], by[1]);
}

#define ASK(name, what) \
    static PyObject *law_##name(PyObject *self, PyObject *const *given, Py_ssize_t count, PyObject *names) { \
        return ask_law(self, given, count, names, what); \
    } \
    static double call_##name(double d, void *law) { return mbma_law_at((const mbma_law *)law, what, d); }
ASK(force, MBMA_FORCE)
ASK(area, MBMA_AREA)
ASK(stiffness, MBMA_STIFFNESS)
ASK(area_slope, MBMA_AREA_SLOPE)
ASK(energy, MBMA_ENERGY)

/* Addresses of a function of (d, data) that answers one quantity, and of its data, which live as long as the law. */
static PyObject *law_addresses(PyObject *self, PyObject *what) {
    static double (*const CALLS[])(double, void *) = {call_force, call_area, call_stiffness, call_area_slope,
                                                      call_energy};
    const long number = PyLong_AsLong(what);
    const mbma_law *const law = number == -1 && PyErr_Occurred() ? NULL : law_of(self);
    if (law == NULL)
        return NULL;
    if (number < MBMA_FORCE || number > MBMA_ENERGY)
        return PyErr_Format(PyExc_ValueError, "core: no quantity has the number %ld", number);
    return Py_BuildValue("KK", (unsigned long long)(uintptr_t)CALLS[number], (unsigned long long)(uintptr_t)law);
}

#define GAP "($self, separation=None, *, u=None)\n--\n\n"
#define METHOD(name, text) \
    {#name, (PyCFunction)(void (*)(void))law_##name, METH_FASTCALL | METH_KEYWORDS, #name GAP text}
static PyMethodDef LAW_METHODS[] = {
    METHOD(force, "F/A0 in the unit of E_star at d; where contact ends at h_max, zero from there on."),
    METHOD(area, "A/A0 at d; where contact ends at h_max, zero from there on."),
    METHOD(stiffness, "-dF/du per nominal area, against the mean separation u = (h_max + d)/2: -2 dF/dd.\n\n"
                      "MBMA's jumps where zeta_d reaches its floor, and belongs to the larger gap there."),
    METHOD(area_slope, "-d(A/A0)/dd."),
    METHOD(energy, "Elastic energy per nominal area, the integral of F/A0 over u to last contact."),
    {"_addresses", law_addresses, METH_O, NULL},
    {NULL, NULL, 0, NULL},
};
static PyType_Slot LAW_SLOTS[] = {
    {Py_tp_dealloc, (void *)law_dealloc},
    {Py_tp_methods, LAW_METHODS},
    {Py_tp_doc, (void *)"Quantities of a contact law's block at separations."},
    {0, NULL},
};
static PyType_Spec LAW_TYPE = {
    "mbma_tables.core.Law", sizeof(law_object), 0, Py_TPFLAGS_DEFAULT | Py_TPFLAGS_BASETYPE, LAW_SLOTS,
};

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
     fits_spline(a, true) && a[3].n > 0 && a[6].n == 2 * a[3].n && a[9].n == a[8].n && a[10].n == a[8].n && a[11].n == a[8].n &&
         a[12].n == a[8].n,
     calibrated_contact(a))
WRAP(calibrated_separation, SPLINE "LDw",
     fits_spline(a, true) && a[3].n > 0 && a[6].n == 2 * a[3].n && a[9].n == a[8].n && a[10].n == a[8].n, calibrated_separation(a))
WRAP(calibrated_slopes, SPLINE "Dw", fits_spline(a, true) && !a[7].data && a[8].n == a[3].n && a[9].n == 10 * a[3].n,
     calibrated_slopes(a))
WRAP(flow, SPLINE "LDDw", fits_spline(a, false) && a[3].n > 0 && a[9].n == a[8].n && a[10].n == a[8].n && a[11].n == a[8].n, flow(a))
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
WRAP(spectrum_waves, "DDwwww", a[0].n == a[1].n && a[2].n == a[3].n && a[2].n == a[4].n && a[5].n == 4,
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
    ENTRY(height_integrals),
    ENTRY(islands_work),
    ENTRY(solve_islands),
    ENTRY(island_extents),
    ENTRY(damped_steps),

    /* law.c */
    ENTRY(law_fill), ENTRY(law_records), ENTRY(inverse_nodes), ENTRY(law_invert), ENTRY(law_flow_fill), ENTRY(law_fit),

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

static int execute(PyObject *module) {
    PyObject *const law = PyType_FromSpec(&LAW_TYPE);
    const int added = law == NULL ? -1 : PyModule_AddObjectRef(module, "Law", law);
    Py_XDECREF(law);
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
    const char *const arithmetic = "fma";
#else
    const char *const arithmetic = "plain";
#endif
    if (added < 0 || PyModule_AddStringConstant(module, "arithmetic", arithmetic) < 0)
        return -1;
    return PyModule_AddIntConstant(module, "generation", generation());
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
