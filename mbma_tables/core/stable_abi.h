/* The part of CPython's stable ABI that binding.c uses: Python's own headers are not needed, on machines that have none
 * and for other platforms. Layouts and names are fixed for every CPython from 3.11 on with a global lock
 * (https://docs.python.org/3/c-api/stable.html); tests/core/test_core_builds.py compares them with Python.h. */
#ifndef MBMA_STABLE_ABI_H
#define MBMA_STABLE_ABI_H

#ifndef Py_PYTHON_H
#include <stddef.h>

typedef ptrdiff_t Py_ssize_t;
typedef struct _ts PyThreadState;
typedef struct _typeobject PyTypeObject;
typedef struct _object { Py_ssize_t ob_refcnt; PyTypeObject *ob_type; } PyObject;
typedef PyObject *(*PyCFunction)(PyObject *, PyObject *);
typedef void (*freefunc)(void *);
typedef struct {
    void *buf;
    PyObject *obj;
    Py_ssize_t len, itemsize;
    int readonly, ndim;
    char *format;
    Py_ssize_t *shape, *strides, *suboffsets;
    void *internal;
} Py_buffer;
typedef struct { const char *ml_name; PyCFunction ml_meth; int ml_flags; const char *ml_doc; } PyMethodDef;
typedef struct { int slot; void *value; } PyModuleDef_Slot;
typedef struct PyModuleDef {
    struct { PyObject ob_base; PyObject *(*m_init)(void); Py_ssize_t m_index; PyObject *m_copy; } m_base;
    const char *m_name, *m_doc;
    Py_ssize_t m_size;
    PyMethodDef *m_methods;
    PyModuleDef_Slot *m_slots;
    int (*m_traverse)(PyObject *, int (*)(PyObject *, void *), void *), (*m_clear)(PyObject *);
    void (*m_free)(void *);
} PyModuleDef;
typedef struct { int slot; void *pfunc; } PyType_Slot;
typedef struct { const char *name; int basicsize, itemsize; unsigned flags; PyType_Slot *slots; } PyType_Spec;

#define PyObject_HEAD PyObject ob_base;
#define PyModuleDef_HEAD_INIT {{1, NULL}, NULL, 0, NULL}
enum { METH_KEYWORDS = 2, METH_NOARGS = 4, METH_FASTCALL = 0x80, Py_mod_exec = 2 };
enum { Py_tp_dealloc = 52, Py_tp_doc = 56, Py_tp_init = 60, Py_tp_methods = 64, Py_tp_free = 74 };
enum { Py_TPFLAGS_DEFAULT = 0, Py_TPFLAGS_BASETYPE = 1 << 10 };
enum { PyBUF_WRITABLE = 1, PyBUF_FORMAT = 4, PyBUF_C_CONTIGUOUS = 0x38 };
#define Py_None (&_Py_NoneStruct)
#define Py_TYPE(object) (((PyObject *)(object))->ob_type)
#define PyFloat_CheckExact(object) (Py_TYPE(object) == &PyFloat_Type)
#define Py_DECREF(object) Py_DecRef((PyObject *)(object))
#define Py_XDECREF Py_DECREF /* NULL is taken */
#define Py_CLEAR(object) (Py_DECREF(object), (object) = NULL)
#define Py_BEGIN_ALLOW_THREADS { PyThreadState *held_state = PyEval_SaveThread();
#define Py_END_ALLOW_THREADS PyEval_RestoreThread(held_state); }

#ifdef _WIN32
#define PyAPI_FUNC(type) __declspec(dllimport) type
#define PyAPI_DATA(type) extern __declspec(dllimport) type
#define PyMODINIT_FUNC __declspec(dllexport) PyObject *
#else
#define PyAPI_FUNC(type) type
#define PyAPI_DATA(type) extern type
#define PyMODINIT_FUNC __attribute__((visibility("default"))) PyObject *
#endif
#endif

PyAPI_DATA(PyObject) _Py_NoneStruct; PyAPI_DATA(PyObject *) PyExc_TypeError;
PyAPI_DATA(PyObject *) PyExc_ValueError; PyAPI_DATA(PyTypeObject) PyFloat_Type;
PyAPI_FUNC(PyObject *) Py_BuildValue(const char *, ...); PyAPI_FUNC(void) Py_DecRef(PyObject *);
PyAPI_FUNC(void) PyBuffer_Release(Py_buffer *); PyAPI_FUNC(void) PyErr_Clear(void);
PyAPI_FUNC(PyObject *) PyErr_Format(PyObject *, const char *, ...); PyAPI_FUNC(PyObject *) PyErr_Occurred(void);
PyAPI_FUNC(void) PyEval_RestoreThread(PyThreadState *); PyAPI_FUNC(PyThreadState *) PyEval_SaveThread(void);
PyAPI_FUNC(double) PyFloat_AsDouble(PyObject *); PyAPI_FUNC(PyObject *) PyFloat_FromDouble(double);
PyAPI_FUNC(long long) PyLong_AsLongLong(PyObject *); PyAPI_FUNC(PyObject *) PyLong_FromLongLong(long long);
PyAPI_FUNC(int) PyModule_AddIntConstant(PyObject *, const char *, long);
PyAPI_FUNC(int) PyModule_AddObjectRef(PyObject *, const char *, PyObject *);
PyAPI_FUNC(int) PyModule_AddStringConstant(PyObject *, const char *, const char *);
PyAPI_FUNC(PyObject *) PyModuleDef_Init(PyModuleDef *);
PyAPI_FUNC(PyObject *) PyObject_CallMethod(PyObject *, const char *, const char *, ...);
PyAPI_FUNC(PyObject *) PyObject_GetAttrString(PyObject *, const char *);
PyAPI_FUNC(int) PyObject_GetBuffer(PyObject *, Py_buffer *, int); PyAPI_FUNC(Py_ssize_t) PyObject_Size(PyObject *);
PyAPI_FUNC(PyObject *) PyTuple_GetItem(PyObject *, Py_ssize_t); PyAPI_FUNC(Py_ssize_t) PyTuple_Size(PyObject *);
PyAPI_FUNC(PyObject *) PyType_FromSpec(PyType_Spec *); PyAPI_FUNC(int) PyType_IsSubtype(PyTypeObject *, PyTypeObject *); PyAPI_FUNC(void *) PyType_GetSlot(PyTypeObject *, int);
PyAPI_FUNC(int) PyUnicode_CompareWithASCIIString(PyObject *, const char *);

#endif
