"""The C of the model for other languages: what `mbma_model.h` declares, as a module of Fortran and one of Rust.

Both are written from the text of the header, so that they cannot differ from it.
"""

import re
from typing import NamedTuple

from mbma_tables.export.text import filled

PREFIX = "mbma_"
OPAQUE = "mbma_spectrum"  # its memory is an array of doubles there
SINGLE = ("mbma_surface", OPAQUE)  # are never an array
FORTRAN = {
    "int": "integer(c_int)",
    "size_t": "integer(c_size_t)",
    "double": "real(c_double)",
    "const char *": "type(c_ptr)",
    OPAQUE: "real(c_double)",
}
RUST = {
    "int": "c_int",
    "size_t": "usize",
    "double": "f64",
    "const char *": "*const c_char",
    OPAQUE: "f64",
}
WIDTH = 110  # of lines of Fortran, which end at 132

_PROTOTYPE = re.compile(
    r"^(int|double|size_t|const char \*)\s?(mbma_\w+)\(([^)]*)\);", re.MULTILINE
)
_RECORD = re.compile(
    r"^typedef struct \{\s*double ([\w,\s]+);\s*\} (mbma_\w+);", re.MULTILINE
)
_STATUSES = re.compile(r"typedef enum \{([^}]*)\} mbma_status;")
_STATUS = re.compile(r"(MBMA_\w+) = (\d+),? +/\* (.*) \*/")
_THEORIES = re.compile(r"enum \{ (MBMA_PERSSON = .*) \};")


class Argument(NamedTuple):
    """An argument of a function in C: `kind` without const and star."""

    name: str
    kind: str
    is_const: bool
    is_pointer: bool
    is_array: bool

    @property
    def is_opaque(self) -> bool:
        """Whether it is memory whose type other languages do not see."""
        return self.kind == OPAQUE


class Function(NamedTuple):
    """A function of `mbma_model.h`."""

    name: str
    kind: str
    arguments: tuple[Argument, ...]

    @property
    def answer(self) -> Argument | None:
        """The one result beside a status, where there is one."""
        results = [one for one in self.arguments if one.is_pointer and not one.is_const]
        is_one = (
            self.kind == "int" and len(results) == 1 and results[0] is self.arguments[-1]
        )
        return results[0] if is_one and not results[0].is_opaque else None


class Constant(NamedTuple):
    """A number with a name; `meaning` is empty where the name is enough."""

    name: str
    value: str
    meaning: str = ""


class Record(NamedTuple):
    """A structure of doubles."""

    name: str
    fields: tuple[str, ...]


class Declarations(NamedTuple):
    """What other languages need of the headers."""

    constants: list[Constant]
    records: list[Record]
    functions: list[Function]


def _argument(text: str, is_array_function: bool) -> Argument:
    words = text.replace("*", " * ").split()
    is_pointer = "*" in words
    kind = next(word for word in words if word not in {"const", "*"})
    is_array = is_pointer and (
        (kind == "double" and "const" in words)
        or (is_array_function and kind not in SINGLE)
    )
    return Argument(words[-1], kind, "const" in words, is_pointer, is_array)


def declarations(core_header: str, model_header: str) -> Declarations:
    """Constants, structures of doubles and functions of the two headers, in their order."""
    functions = []
    for kind, name, arguments in _PROTOTYPE.findall(model_header):
        given = [] if arguments == "void" else arguments.split(",")
        many = any("size_t count" in one for one in given)
        functions.append(
            Function(name, kind, tuple(_argument(one, many) for one in given))
        )
    (theories,) = _THEORIES.findall(model_header)
    (statuses,) = _STATUSES.findall(core_header)
    constants = [Constant(*found) for found in _STATUS.findall(statuses)]
    for text in theories.split(", "):
        name, value = text.split(" = ")
        constants.append(Constant(name, value))
    used = {argument.kind for one in functions for argument in one.arguments}
    records = [
        Record(name, tuple(re.split(r",\s*", fields)))
        for fields, name in _RECORD.findall(core_header + model_header)
        if name in used
    ]
    return Declarations(constants, records, functions)


def _fortran_argument(argument: Argument, is_optional: bool) -> str:
    """The declaration of an argument."""
    kind = FORTRAN.get(argument.kind, f"type({argument.kind})")
    if not argument.is_pointer:
        return f"{kind}, value :: {argument.name}"
    intent = "in" if argument.is_const else "inout" if argument.is_opaque else "out"
    shape = "(*)" if argument.is_array or argument.is_opaque else ""
    optional = ", optional" if is_optional else ""
    return f"{kind}, intent({intent}){optional} :: {argument.name}{shape}"


def _fortran_interface(function: Function) -> str:
    """The interface of a function."""
    names = ", ".join(argument.name for argument in function.arguments)
    head = f"    {FORTRAN[function.kind]} function {function.name}({names})"
    end = f'bind(C, name="{function.name}")'
    gap = " &\n        " if len(head) + len(end) > WIDTH else " "
    records = {one.kind for one in function.arguments if one.kind not in FORTRAN}
    lines = [
        f"{head}{gap}{end}",
        f"      import :: {', '.join(['c_int', 'c_size_t', 'c_double', 'c_ptr', *sorted(records)])}",
        # statuses of an array may be left out, as NULL in C
        *(
            f"      {_fortran_argument(one, one.name == 'status' and one.is_array)}"
            for one in function.arguments
        ),
        f"    end function {function.name}",
    ]
    return "\n".join(lines)


def _rust_name(name: str) -> str:
    """`Contact` of mbma_contact."""
    return "".join(part.capitalize() for part in name.removeprefix(PREFIX).split("_"))


def _rust_kind(argument: Argument) -> str:
    kind = RUST.get(argument.kind) or _rust_name(argument.kind)
    if not argument.is_pointer:
        return kind
    return f"*{'const' if argument.is_const else 'mut'} {kind}"


def _rust_prototype(function: Function) -> str:
    given = ", ".join(f"{one.name}: {_rust_kind(one)}" for one in function.arguments)
    return f"        pub fn {function.name}({given}) -> {RUST[function.kind]};"


def _rust_wrapper(function: Function) -> str:
    """A safe call of a function with one answer beside its status, or of one without pointers."""
    answer = function.answer
    inputs = [one for one in function.arguments if one is not answer]
    arrays = [one for one in inputs if one.is_array]
    has_memory = any(one.is_opaque for one in inputs)
    if has_memory or arrays or (answer is None and function.kind != "double"):
        return ""
    name = function.name.removeprefix(PREFIX)
    given = ", ".join(
        f"{one.name}: {'&' + _rust_name(one.kind) if one.is_pointer else _rust_kind(one)}"
        for one in inputs
    )
    passed = ", ".join(one.name for one in inputs)
    if answer is None:
        return f"pub fn {name}({given}) -> f64 {{\n    unsafe {{ ffi::{function.name}({passed}) }}\n}}\n"
    kind = "f64" if answer.kind == "double" else _rust_name(answer.kind)
    return (
        f"pub fn {name}({given}) -> Result<{kind}, Status> {{\n"
        f"    let mut answer = {kind}::default();\n"
        f"    let status = unsafe {{ ffi::{function.name}({passed}, &mut answer) }};\n"
        "    if status == MBMA_OK { Ok(answer) } else { Err(Status(status)) }\n}\n"
    )


def binding_texts(
    headers: dict[str, str], core_header: str, model_header: str
) -> dict[str, str]:
    """Names and texts of the modules, under their opening comments."""
    found = declarations(core_header, model_header)
    parts = {
        "mbma_model.f90": {
            "RECORDS": found.records,
            "INTERFACES": [_fortran_interface(one) for one in found.functions],
        },
        "mbma_model.rs": {
            "RECORDS": [(_rust_name(one.name), one.fields) for one in found.records],
            "PROTOTYPES": [_rust_prototype(one) for one in found.functions],
            "WRAPPERS": [text for text in map(_rust_wrapper, found.functions) if text],
        },
    }
    return {
        name: filled(
            f"model/{name}",
            HEADER=headers[name],
            CONSTANTS=found.constants,
            **of_language,
        )
        for name, of_language in parts.items()
    }
