/* Calls of the compiled core, recorded from Python by record.py, once more and without Python: on another processor.
 * What binding.c takes for Python is a few functions here.
 *
 * replay < CALLS > ANSWERS: of each call what it returned and the contents of its arrays; ends with 1 if one is refused. */
#include <stdio.h>
#include <stdlib.h>

#include "binding.c"

typedef struct {
    PyObject head;
    int32_t kind, format, itemsize; /* d, i, N for None, A for an array */
    double d;
    int64_t i;
    uint32_t bytes;
    char text[2];
    void *data;
} object;

static object error, answer;
static bool raised;
PyObject _Py_NoneStruct;
PyObject *PyExc_TypeError = &error.head, *PyExc_ValueError = &error.head;
static PyThreadState *const STATE = NULL;

PyObject *PyErr_Occurred(void) { return raised ? &error.head : NULL; }
PyObject *PyErr_Format(PyObject *type, const char *text, ...) {
    raised = type != NULL && text != NULL;
    return NULL;
}
PyThreadState *PyEval_SaveThread(void) { return STATE; }
void PyEval_RestoreThread(PyThreadState *state) { (void)state; }
PyObject *PyModuleDef_Init(PyModuleDef *definition) { return (PyObject *)(void *)definition; }
PyObject *PyLong_FromLongLong(long long value) {
    answer.i = value;
    return &answer.head;
}
double PyFloat_AsDouble(PyObject *given) {
    const object *const o = (const object *)(const void *)given;
    return o->kind == 'd' ? o->d : (double)o->i;
}
long long PyLong_AsLongLong(PyObject *given) { return ((const object *)(const void *)given)->i; }
int PyObject_GetBuffer(PyObject *given, Py_buffer *view, int flags) {
    object *const o = (object *)(void *)given;
    memset(view, 0, sizeof *view);
    view->buf = o->data;
    view->len = (Py_ssize_t)o->bytes;
    view->itemsize = o->itemsize;
    view->format = o->text;
    return o->kind == 'A' && flags != 0 ? 0 : -1;
}
void PyBuffer_Release(Py_buffer *view) { view->buf = NULL; }

/* What the class of laws and the start of the module ask for, which are not tried here. */
struct _typeobject {
    int unused;
};
PyTypeObject PyFloat_Type;
void PyErr_Clear(void) {}
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

static void get(void *out, size_t bytes) {
    if (bytes > 0 && fread(out, 1, bytes, stdin) != bytes)
        exit(3);
}

/* One of record.py's arguments. */
static PyObject *get_argument(object *o) {
    memset(o, 0, sizeof *o);
    get(&o->kind, sizeof o->kind);
    if (o->kind == 'd')
        get(&o->d, sizeof o->d);
    else if (o->kind == 'i')
        get(&o->i, sizeof o->i);
    else if (o->kind == 'A') {
        get(&o->format, sizeof o->format);
        get(&o->itemsize, sizeof o->itemsize);
        get(&o->bytes, sizeof o->bytes);
        o->text[0] = (char)o->format;
        o->data = malloc(o->bytes + 1);
        if (o->data == NULL)
            exit(3);
        get(o->data, o->bytes);
    }
    return o->kind == 'N' ? Py_None : &o->head;
}

int main(void) {
    const PyMethodDef *const methods = ((PyModuleDef *)(void *)JOINED(PyInit_, MBMA_MODULE)())->m_methods;
    char name[64];
    while (fread(name, sizeof name, 1, stdin) == 1) {
        object values[MOST_ARGUMENTS];
        PyObject *given[MOST_ARGUMENTS];
        int32_t count;
        get(&count, sizeof count);
        for (int k = 0; k < count && k < MOST_ARGUMENTS; k++)
            given[k] = get_argument(&values[k]);
        const PyMethodDef *m = methods;
        while (m->ml_name && strcmp(m->ml_name, name) != 0)
            m++;
        if (!m->ml_name || ((PyObject * (*)(PyObject *, PyObject *const *, Py_ssize_t))(void (*)(void))m->ml_meth)(
                               NULL, given, count) == NULL) {
            fprintf(stderr, "%s was refused\n", name);
            return 1;
        }
        fwrite(&answer.i, sizeof answer.i, 1, stdout);
        for (int k = 0; k < count; k++) {
            fwrite(values[k].data, 1, values[k].bytes, stdout);
            free(values[k].data);
        }
    }
    return 0;
}
