/* The core as a Python module (stable ABI of CPython 3.11): buffers in, numbers out, the
 * interpreter's lock released.
 *
 * The same sources are compiled for each generation of processor, as modules of different names;
 * `core/__init__.py` imports the best one that the processor can run. Whatever arguments a function
 * is called with, it reads and writes inside their arrays or raises an error, as long as no other
 * thread changes an array during the call: types, places in memory and sizes are checked here, what
 * else loops rely on in `calls.h`, which also describes the kinds of arguments.
 */
#if defined(__x86_64__) || defined(_M_X64)
#include <cpuid.h>
#include <immintrin.h>
#endif

#include "calls.h"
#include "stable_abi.h"

/* ---- arguments ---- */

/* More than fit into any memory; a small multiple does not overflow. */
#define MOST_ITEMS ((size_t)1 << 56)

/* Arrays of a kind: its letter, the letters that Python's buffers have for its items, and their
 * size. Which of the letters of 4 and 8 bytes is whose differs between platforms. */
typedef struct {
    char letter;
    const char *formats;
    Py_ssize_t item_size;
} array_kind;

static const array_kind ARRAY_KINDS[] = {
    {'D', "d", 8}, {'L', "lq", 8}, {'J', "il", 4}, {'F', "f", 4},
    {'w', "d", 8}, {'l', "lq", 8}, {'b', "B?", 1},
};

static array_kind array_kind_of(char letter) {
    const array_kind *kind = ARRAY_KINDS;
    while (kind->letter != letter)
        kind++;
    return *kind;
}

static bool is_written(char letter) { return letter == 'w' || letter == 'l' || letter == 'b'; }

/* Whether a buffer has items of a kind where a processor can load them; else an error is set. */
static bool has_items(const Py_buffer *view, array_kind kind) {
    /* bytes, if none is given */
    const char *const format = view->format ? view->format : "B";
    const bool is_one_letter = format[0] != '\0' && format[1] == '\0';
    if (view->itemsize != kind.item_size || !is_one_letter ||
        strchr(kind.formats, format[0]) == NULL) {
        PyErr_Format(PyExc_TypeError, "core: an array of '%c' was expected, got one of '%s'",
                     kind.formats[0], format);
        return false;
    }
    if ((uintptr_t)view->buf % (uintptr_t)kind.item_size != 0) {
        PyErr_Format(PyExc_ValueError, "core: an array of '%c' is not aligned in memory",
                     kind.formats[0]);
        return false;
    }
    return true;
}

/* One argument by the letter of its kind; `view` receives the buffer of an array, to be released
 * by the caller if this succeeds. */
static bool take(PyObject *object, char letter, argument *a, Py_buffer *view) {
    memset(a, 0, sizeof *a);
    memset(view, 0, sizeof *view);
    if (letter == 'd') {
        a->real = PyFloat_AsDouble(object);
        return !PyErr_Occurred();
    }
    if (letter == 'i') {
        a->whole = PyLong_AsLongLong(object);
        return !PyErr_Occurred();
    }
    if (object == Py_None)
        return true;

    const int writable = is_written(letter) ? PyBUF_WRITABLE : 0;
    const int access = writable | PyBUF_C_CONTIGUOUS | PyBUF_FORMAT;
    if (PyObject_GetBuffer(object, view, access) != 0)
        return false;
    if (!has_items(view, array_kind_of(letter))) {
        PyBuffer_Release(view);
        return false;
    }
    a->items = view->buf;
    a->count = (size_t)(view->len / view->itemsize);
    return true;
}

/* Sizes that the letters k to n stand for; UNKNOWN before the first array that has the letter. */
enum { SIZE_LETTERS = 4 };
#define UNKNOWN SIZE_MAX

static bool is_end(char kind) { return kind == ' ' || kind == '\0'; }

/* Whether an argument has the size that its kind gives from `*kind` on, if there is any; `*kind` is
 * moved behind it. */
static bool has_size(const argument *a, const char **kind, size_t sizes[SIZE_LETTERS]) {
    bool any_size = is_end(**kind);
    bool countable = true;
    size_t number = 0, product = 1;
    for (; !is_end(**kind); ++*kind) {
        const char symbol = **kind;
        if (symbol == '?') {
            any_size = a->items == NULL;
        } else if (symbol <= '9') {
            number = 10 * number + (size_t)(symbol - '0');
        } else {
            size_t *const size = &sizes[symbol - 'k'];
            if (*size == UNKNOWN)
                *size = a->count;
            countable = countable && (*size == 0 || product <= MOST_ITEMS / *size);
            product *= *size;
        }
    }
    return any_size || (countable && a->count == (number ? number : 1) * product);
}

static bool overlap(const Py_buffer *one, const Py_buffer *other) {
    const char *const first = one->buf, *const second = other->buf;
    if (one->len == 0 || other->len == 0)
        return false;
    return first < second + other->len && second < first + one->len;
}

/* Whether no result is written to what is read, or to another result: loops would use what they
 * wrote as if it had been checked. */
static bool are_apart(const char *kind, const Py_buffer *views, Py_ssize_t count) {
    bool written[MOST_ARGUMENTS];
    for (Py_ssize_t k = 0; k < count; k++) {
        written[k] = is_written(*kind);
        kind += strcspn(kind, " ");
        kind += *kind == ' ';
        for (Py_ssize_t before = 0; before < k; before++)
            if ((written[k] || written[before]) && overlap(&views[k], &views[before]))
                return false;
    }
    return true;
}

/* A function of arguments: whether they fit, and the answer. */
typedef bool (*core_function)(const argument *, long long *);

/* A call of a function by the kinds of its arguments: "Dn w3n w?n" are numbers, three results for
 * each, and optionally one more. */
static PyObject *called(const char *name, const char *kinds, core_function function,
                        PyObject *const *arguments, Py_ssize_t count) {
    size_t sizes[SIZE_LETTERS] = {UNKNOWN, UNKNOWN, UNKNOWN, UNKNOWN};
    argument a[MOST_ARGUMENTS];
    Py_buffer views[MOST_ARGUMENTS];
    const char *kind = kinds;
    bool all_taken = true, all_sized = true;
    Py_ssize_t taken = 0;
    while (taken < count && *kind && all_taken) {
        all_taken = take(arguments[taken], *kind++, &a[taken], &views[taken]);
        if (all_taken) {
            all_sized = has_size(&a[taken], &kind, sizes) && all_sized;
            kind += *kind == ' ';
            taken++;
        }
    }

    long long answer = 0;
    bool good = false;
    if (all_taken && (taken < count || *kind))
        PyErr_Format(PyExc_TypeError, "core: %s does not take %d arguments", name, (int)count);
    else if (all_taken && !all_sized)
        PyErr_Format(PyExc_ValueError, "core: sizes of the arrays of %s do not match", name);
    else if (all_taken && !are_apart(kinds, views, count))
        PyErr_Format(PyExc_ValueError,
                     "core: a result of %s overlaps another of its arrays in memory", name);
    else if (all_taken) {
        Py_BEGIN_ALLOW_THREADS good = function(a, &answer);
        Py_END_ALLOW_THREADS
        if (!good)
            PyErr_Format(PyExc_ValueError,
                         "core: sizes of the arrays of %s, "
                         "or numbers of items in them, do not match",
                         name);
    }
    while (taken-- > 0)
        PyBuffer_Release(&views[taken]); /* no effect without a buffer */
    return good ? PyLong_FromLongLong(answer) : NULL;
}

#define WRAP(name, kinds) \
    static PyObject *py_##name(PyObject *module, PyObject *const *arguments, Py_ssize_t count) { \
        (void)module; \
        return called(#name, kinds, do_##name, arguments, count); \
    }
FUNCTIONS(WRAP)
#define ENTRY(name, kinds) {#name, (PyCFunction)(void (*)(void))py_##name, METH_FASTCALL, NULL},
static PyMethodDef METHODS[] = {FUNCTIONS(ENTRY){NULL, NULL, 0, NULL}};

/* ---- laws as objects ---- */

enum { FEW = 1000 }; /* gaps, for which the interpreter lock is kept */

/* Base class of laws in Python: quantities at one float or a small array are computed here, all
 * others by the method `_ask_one`. */
typedef struct {
    PyObject_HEAD
    Py_buffer view; /* of the attribute `block` */
    mbma_law law;   /* its head is NULL before the first use */
} law_object;

/* Opens the law of an object by its block; false if that set an error. */
static bool open_law(law_object *object) {
    PyObject *const block = PyObject_GetAttrString((PyObject *)object, "block");
    argument words;
    Py_buffer view;
    const bool taken = block != NULL && take(block, 'D', &words, &view);
    Py_XDECREF(block);
    if (!taken)
        return false;

    const bool constant = view.readonly != 0;
    const bool good = constant && is_law(&words);
    if (!constant)
        PyErr_Format(PyExc_ValueError, "core: the block of a law must be read-only");
    else if (!good)
        PyErr_Format(PyExc_ValueError, "core: the block is not that of a law");
    /* another thread may have opened it */
    if (good && object->law.head == NULL) {
        object->view = view;
        object->law = mbma_law_open(words.items, words.count);
    } else {
        PyBuffer_Release(&view);
    }
    return good;
}

/* Its law, opened when it is first needed: from then on nothing may change the block, which is not
 * checked again. NULL if that is not the block of a law. */
static const mbma_law *law_of(PyObject *self) {
    law_object *const object = (law_object *)self;
    if (object->law.head == NULL && !open_law(object))
        return NULL;
    return &object->law;
}

static void law_dealloc(PyObject *self) {
    PyTypeObject *const type = Py_TYPE(self);
    PyBuffer_Release(&((law_object *)self)->view);
    ((freefunc)PyType_GetSlot(type, Py_tp_free))(self);
    Py_DECREF(type);
}

/* A quantity of a small array of doubles, numpy's own as the block is; NULL if Python must compute
 * it. */
static PyObject *ask_law_array(law_object *self, PyObject *gaps, bool by_mean, int what) {
    const bool is_small = self->law.head != NULL && Py_TYPE(gaps) == Py_TYPE(self->view.obj) &&
                          (size_t)PyObject_Size(gaps) - 1 < FEW;
    PyObject *values = is_small ? PyObject_CallMethod(gaps, "copy", NULL) : NULL;
    argument a = {0};
    Py_buffer view;
    bool computed = false;
    if (values != NULL && take(values, 'w', &a, &view)) {
        /* the copy holds the gaps, and then the quantity */
        double *quantities[5] = {NULL};
        double *const copy = a.items;
        double separations[FEW];
        quantities[what] = copy;
        if (a.count > 0 && a.count <= FEW) {
            const double h_max = self->law.head->h_max;
            for (size_t k = 0; k < a.count; k++)
                separations[k] = by_mean ? 2.0 * copy[k] - h_max : copy[k];
            computed = mbma_law_fill(a.count, separations, &self->law, quantities[0], quantities[1],
                                     quantities[2], quantities[3], quantities[4]) == 0;
        }
        PyBuffer_Release(&view);
    }
    if (!computed)
        Py_CLEAR(values);
    PyErr_Clear();
    return values;
}

static bool is_name(PyObject *name, const char *text) {
    return PyUnicode_CompareWithASCIIString(name, text) == 0;
}

/* One gap or an array: the mean separation by position or by name, or the separation by name; a
 * pressure or an area is left to Python. */
static PyObject *ask_law(PyObject *self, PyObject *const *arguments, Py_ssize_t count,
                         PyObject *names, int what) {
    PyObject *mean_separation = count > 0 ? arguments[0] : Py_None;
    PyObject *separation = Py_None;
    PyObject *pressure = Py_None;
    PyObject *area = Py_None;
    if (count > 1)
        return PyErr_Format(PyExc_TypeError,
                            "one mean separation is taken, or separation=, got %zd arguments",
                            count);
    const Py_ssize_t named = names == NULL ? 0 : PyTuple_Size(names);
    for (Py_ssize_t k = 0; k < named; k++) {
        PyObject *const name = PyTuple_GetItem(names, k);
        PyObject *const value = arguments[count + k];
        if (is_name(name, "separation"))
            separation = value;
        else if (count == 0 && is_name(name, "mean_separation"))
            mean_separation = value;
        else if (is_name(name, "pressure"))
            pressure = value;
        else if (is_name(name, "area"))
            area = value;
        else
            return PyErr_Format(PyExc_TypeError,
                                "unexpected keyword argument %R: mean_separation, separation, "
                                "pressure or area is taken",
                                name);
    }

    const bool by_mean = mean_separation != Py_None;
    PyObject *const gaps = by_mean ? mean_separation : separation;
    PyObject *answer = NULL;
    if ((by_mean && separation != Py_None) || pressure != Py_None || area != Py_None) {
        /* of two given Python raises the error */
    } else if (PyFloat_CheckExact(gaps)) {
        const mbma_law *const law = law_of(self);
        if (law == NULL)
            return NULL;
        const double gap = PyFloat_AsDouble(gaps);
        const double d = by_mean ? 2.0 * gap - law->head->h_max : gap;
        const double value = mbma_law_at(law, (mbma_quantity)what, d);
        /* NaN is refused by Python, with a reason */
        if (value == value)
            return PyFloat_FromDouble(value);
    } else {
        answer = ask_law_array((law_object *)self, gaps, by_mean, what);
    }
    if (answer != NULL)
        return answer;
    return PyObject_CallMethod(self, "_ask_one", "iOOOO", what, mean_separation, separation,
                               pressure, area);
}

#define QUANTITIES(OF) \
    OF(pressure, MBMA_FORCE, \
       "F/A0 in the unit of E_star; where contact ends at h_max, zero from there on.") \
    OF(area, MBMA_AREA, "A/A0; where contact ends at h_max, zero from there on.") \
    OF(stiffness, MBMA_STIFFNESS, \
       "-dp/du, against the mean separation u = (h_max + d)/2: -2 dp/dd.\n\n" \
       "MBMA's jumps where zeta_d reaches its floor, and belongs to the larger gap there.") \
    OF(area_slope, MBMA_AREA_SLOPE, "-d(A/A0)/dd.") \
    OF(energy, MBMA_ENERGY, \
       "Elastic energy per nominal area, the integral of F/A0 over u to last contact; an error\n" \
       "with a hardness, as of contact.")
#define ASK(name, what, text) \
    static PyObject *law_##name(PyObject *self, PyObject *const *arguments, Py_ssize_t count, \
                                PyObject *names) { \
        return ask_law(self, arguments, count, names, what); \
    } \
    static double call_##name(double d, void *law) { \
        return mbma_law_at((const mbma_law *)law, what, d); \
    }
QUANTITIES(ASK)

/* Addresses of the functions of (d, data), one for each quantity, and data, which is valid as long
 * as the law. */
static PyObject *law_addresses(PyObject *self, PyObject *nothing) {
    (void)nothing;
    const mbma_law *const law = law_of(self);
    if (law == NULL)
        return NULL;
#define ADDRESS(name, what, text) (unsigned long long)(uintptr_t)call_##name,
    return Py_BuildValue("(KKKKK)K", QUANTITIES(ADDRESS) (unsigned long long)(uintptr_t)law);
}

#define METHOD(name, what, text) \
    {#name, (PyCFunction)(void (*)(void))law_##name, METH_FASTCALL | METH_KEYWORDS, \
     #name "($self, mean_separation=None, *, separation=None, pressure=None, area=None)" \
           "\n--\n\n" text},
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
static PyType_Spec LAW_TYPE = {
    "mbma_tables.core.Law", sizeof(law_object), 0, Py_TPFLAGS_DEFAULT | Py_TPFLAGS_BASETYPE,
    LAW_SLOTS,
};

/* ---- tables as objects ---- */

/* A table of islands that is checked once, in read-only arrays. */
typedef struct {
    PyObject_HEAD
    Py_buffer views[ISLAND_TABLE_ARGUMENTS];
    mbma_cells cells;          /* one of both */
    mbma_island_table islands;
    Py_ssize_t numbers;        /* of an island: 2, 4, or 0 before there is a table */
} table_object;

/* Takes the arrays by their kinds; false if that set an error. */
static bool take_table(PyObject *arrays, Py_ssize_t count, const char *kind, argument *a,
                       Py_buffer *views) {
    size_t sizes[SIZE_LETTERS] = {UNKNOWN, UNKNOWN, UNKNOWN, UNKNOWN};
    for (Py_ssize_t k = 0; k < count; k++) {
        if (!take(PyTuple_GetItem(arrays, k), *kind++, &a[k], &views[k]))
            return false;
        const bool fits = has_size(&a[k], &kind, sizes);
        kind += *kind == ' ';
        if (!fits || !views[k].readonly) {
            PyErr_Format(PyExc_ValueError, "core: arrays of a table must %s",
                         fits ? "be read-only" : "match in size");
            return false;
        }
    }
    return true;
}

/* Table(cells, places, numbers), or Table(coefficients, errors, cells, numbers, variant). */
static int table_init(PyObject *self, PyObject *arrays, PyObject *names) {
    table_object *const object = (table_object *)self;
    const Py_ssize_t count = PyTuple_Size(arrays);
    const bool by_two = count == TABLE_ARGUMENTS;
    if (object->numbers || names || !(by_two || count == ISLAND_TABLE_ARGUMENTS)) {
        PyErr_Format(PyExc_TypeError, "core: a table is made once, of %d or of %d arrays",
                     (int)TABLE_ARGUMENTS, (int)ISLAND_TABLE_ARGUMENTS);
        return -1;
    }
    argument a[ISLAND_TABLE_ARGUMENTS];
    Py_buffer views[ISLAND_TABLE_ARGUMENTS];
    memset(views, 0, sizeof views);
    bool good = take_table(arrays, count, by_two ? TABLE : ISLAND_TABLE, a, views);
    if (good && !(by_two ? is_table(a) : is_island_table(a))) {
        PyErr_Format(PyExc_ValueError, "core: sizes of the arrays of a table, "
                                       "or numbers of items in them, do not match");
        good = false;
    }
    if (!good) {
        for (Py_ssize_t k = 0; k < count; k++)
            PyBuffer_Release(&views[k]); /* no effect without a buffer */
        return -1;
    }
    memcpy(object->views, views, sizeof views);
    if (by_two)
        object->cells = cells_of(a);
    else
        object->islands = island_table_of(a);
    object->numbers = by_two ? 2 : ISLAND_AXES;
    return 0;
}

static void table_dealloc(PyObject *self) {
    PyTypeObject *const type = Py_TYPE(self);
    for (int k = 0; k < ISLAND_TABLE_ARGUMENTS; k++)
        PyBuffer_Release(&((table_object *)self)->views[k]);
    ((freefunc)PyType_GetSlot(type, Py_tp_free))(self);
    Py_DECREF(type);
}

/* Force, area and the bound on their error of one island, or None for what is no float and outside
 * the table, of which Python says what is wrong. */
static PyObject *table_at(PyObject *self, PyObject *const *arguments, Py_ssize_t count) {
    const table_object *const table = (const table_object *)self;
    double x[ISLAND_AXES], out[3];
    if (table->numbers == 0 || count != table->numbers)
        return PyErr_Format(PyExc_TypeError, "core: an island is not %d numbers", (int)count);
    for (Py_ssize_t k = 0; k < count; k++) {
        if (!PyType_IsSubtype(Py_TYPE(arguments[k]), &PyFloat_Type))
            return Py_BuildValue("");
        x[k] = PyFloat_AsDouble(arguments[k]);
    }
    const bool bad = table->numbers == 2
                         ? mbma_phi(1, &x[0], &x[1], &table->cells, out, NULL) != 0
                         : mbma_island_lookup(&table->islands, x[0], x[1], x[2], x[3], out);
    return bad ? Py_BuildValue("") : Py_BuildValue("(ddd)", out[0], out[1], out[2]);
}

static PyMethodDef TABLE_METHODS[] = {
    {"at", (PyCFunction)(void (*)(void))table_at, METH_FASTCALL, NULL},
    {NULL, NULL, 0, NULL},
};
static PyType_Slot TABLE_SLOTS[] = {
    {Py_tp_dealloc, (void *)table_dealloc},
    {Py_tp_init, (void *)table_init},
    {Py_tp_methods, TABLE_METHODS},
    {Py_tp_doc, (void *)"A table of islands, for one of them at a time."},
    {0, NULL},
};
static PyType_Spec TABLE_TYPE = {
    "mbma_tables.core.Table", sizeof(table_object), 0, Py_TPFLAGS_DEFAULT, TABLE_SLOTS,
};

/* ---- the processor ---- */

#if defined(__x86_64__) || defined(_M_X64)

/* Registers that the system saves, as bits of XCR0: those of SSE and AVX, and all of AVX-512. */
#define AVX_REGISTERS 0x06u
#define AVX512_REGISTERS 0xE6u

__attribute__((target("xsave"))) static uint64_t enabled_registers(void) {
    return (uint64_t)_xgetbv(0);
}

static bool has_all(uint64_t bits, uint64_t wanted) { return (bits & wanted) == wanted; }

/* 4, 3 or 1: the newest of the generations x86-64-v4, x86-64-v3 and x86-64 that processor and
 * system support. */
static int generation(void) {
    unsigned eax, ebx, ecx, edx;
    if (!__get_cpuid(1, &eax, &ebx, &ecx, &edx))
        return 1;
    const unsigned first_of_v3 =
        bit_SSE4_2 | bit_POPCNT | bit_MOVBE | bit_FMA | bit_AVX | bit_F16C | bit_OSXSAVE;
    if (!has_all(ecx, first_of_v3))
        return 1;

    unsigned extensions, flags;
    if (!__get_cpuid_count(7, 0, &eax, &extensions, &ecx, &edx))
        return 1;
    if (!__get_cpuid(0x80000001, &eax, &ebx, &flags, &edx))
        return 1;
    /* _xgetbv is there if OSXSAVE is, which was checked above */
    const uint64_t registers = enabled_registers();
    const unsigned others_of_v3 = bit_AVX2 | bit_BMI | bit_BMI2;
    if (!has_all(flags, bit_LZCNT) || !has_all(extensions, others_of_v3) ||
        !has_all(registers, AVX_REGISTERS))
        return 1;

    const unsigned all_of_v4 =
        bit_AVX512F | bit_AVX512DQ | bit_AVX512CD | bit_AVX512BW | bit_AVX512VL;
    return has_all(extensions, all_of_v4) && has_all(registers, AVX512_REGISTERS) ? 4 : 3;
}
#else
static int generation(void) { return 0; }
#endif

static int execute(PyObject *module) {
    PyObject *const law = PyType_FromSpec(&LAW_TYPE);
    PyObject *const table = PyType_FromSpec(&TABLE_TYPE);
#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
    const char *const arithmetic = "fma";
#else
    const char *const arithmetic = "plain";
#endif
    const bool good = PyModule_AddObjectRef(module, "Law", law) == 0 &&
                      PyModule_AddObjectRef(module, "Table", table) == 0 &&
                      PyModule_AddStringConstant(module, "arithmetic", arithmetic) == 0 &&
                      PyModule_AddIntConstant(module, "generation", generation()) == 0;
    Py_XDECREF(law);
    Py_XDECREF(table);
    return good ? 0 : -1;
}

static PyModuleDef_Slot SLOTS[] = {{Py_mod_exec, (void *)execute}, {0, NULL}};

#define TEXT_OF(name) #name
#define TEXT(name) TEXT_OF(name)
#define JOINED_OF(a, b) a##b
#define JOINED(a, b) JOINED_OF(a, b)

static struct PyModuleDef MODULE = {
    PyModuleDef_HEAD_INIT,
    TEXT(MBMA_MODULE),
    "The compiled core.",
    0,
    METHODS,
    SLOTS,
    NULL,
    NULL,
    NULL,
};

PyMODINIT_FUNC JOINED(PyInit_, MBMA_MODULE)(void) { return PyModuleDef_Init(&MODULE); }
