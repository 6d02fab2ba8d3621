"""Interfaces of other languages to the exported C, written from its headers, whose comments say what each call does."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable
from typing import NamedTuple

from mbma_tables.export.text import wrapped

DEFAULTS = {"E_star": "1", "rtol": "1e-8"}  # of arguments in JavaScript


class Argument(NamedTuple):
    """Of a call: a number or a structure that is read, or a place that is written."""

    kind: str  # "double" or a structure
    name: str
    pointer: bool
    read: bool


class Declared:
    """Numbers of a status; structures of doubles; and calls of one island or surface, which take no others."""

    def __init__(self, headers: str) -> None:
        self.statuses: list[tuple[str, str, str]] = re.findall(r"MBMA_(\w+) = (\d+),? +/\* (.*?) \*/", headers)
        # with what the header says of them
        self.structures: dict[str, tuple[str, list[str]]] = {}
        self.calls: dict[str, tuple[str, list[Argument]]] = {}
        for paragraph in headers.split("\n\n"):
            note, _, code = paragraph.removeprefix("/* ").replace("\n *", "\n").partition(" */\n")
            note, code = " ".join(note.split()), " ".join(code.split())
            if struct := re.fullmatch(r"typedef struct \{ double ([^;[]*); \} (\w+);", code):
                self.structures[struct[2]] = note, struct[1].split(", ")
            elif call := re.fullmatch(r"int (\w+_of)\((.*)\);", code):
                found = re.findall(r"(const )?(\w+) (\*?)(\w+)(?:, |$)", call[2])
                arguments = [Argument(kind, own, bool(at), not at or bool(c)) for c, kind, at, own in found]
                if {argument.kind for argument in arguments} <= {"double", *self.structures}:
                    self.calls[call[1]] = note, arguments


def fortran_interface(headers: str) -> dict[str, str]:
    """The places of mbma.f90.in."""
    declared, types, functions = Declared(headers), [], []
    for name, (note, fields) in declared.structures.items():
        types += [*_lines(note, "! "), f"type, bind(c), public :: {name}"]
        types += [f"  real(c_double) :: {', '.join(fields)}", "end type", ""]
    for name, (note, arguments) in declared.calls.items():
        kinds = sorted({argument.kind for argument in arguments} - {"double"} | {"c_double", "c_int"})
        names = ", ".join(argument.name for argument in arguments)
        functions += [*_lines(note, "! "), f"function {name}({names}) bind(c) result(status)"]
        functions += [f"  import :: {', '.join(kinds)}"]
        for kind, own, pointer, read in arguments:
            passed = "value" if not pointer else "intent(in)" if read else "intent(out)"
            functions += [f"  {'real(c_double)' if kind == 'double' else f'type({kind})'}, {passed} :: {own}"]
        functions += ["  integer(c_int) :: status", "end function", ""]
    parameter = "integer(c_int), parameter, public :: MBMA_{} = {}  ! {}"
    return {
        "NAMES": wrapped(declared.calls, indent="    ", end=" &"),
        "STATUS": _text((parameter.format(*row) for row in declared.statuses), 2),
        "TYPES": _text(types, 2),
        "FUNCTIONS": _text(functions, 4),
    }


def javascript_interface(headers: str) -> dict[str, str]:
    """The places of mbma.mjs.in."""
    declared, fields, types, functions = Declared(headers), [], [], []
    for name, (note, own) in declared.structures.items():
        quoted = ", ".join(f'"{field}"' for field in own)
        fields += _lines(f"const {_plain(name).upper()} = [{quoted}];", "", "  ")
        typedef = f"@typedef {{{{ {', '.join(f'{field}: number' for field in own)} }}}} {_plain(name)}"
        types += [*_lines(note, " * "), *_lines(typedef, " * ", " *   "), " *"]
    for name, (note, arguments) in declared.calls.items():
        given, (first, *more) = ([part for part in arguments if part.read == read] for read in (True, False))
        takes = ", ".join(f"{own}{'?' * (own in DEFAULTS)}: {_plain(kind)}" for kind, own, *_ in given)
        gives = f"{{ {first.name}: number }}" if first.kind == "double" else _plain(first.kind)
        gives += "".join(f" & {{ {own}: {_plain(kind)} }}" for kind, own, *_ in more)
        signature = ", ".join(f"{own} = {DEFAULTS[own]}" if own in DEFAULTS else own for _, own, *_ in given)
        names, written = (", ".join(parts) for parts in ((part.name for part in given), map(_written, (first, *more))))
        word, *words = name.removeprefix("mbma_").removesuffix("_of").split("_")
        functions += ["/**", *_lines(note, " * "), *_lines(f"@type {{({takes}) => Status & {gives}}}", " * ", " *   ")]
        functions += [" */", f"export const {word}{''.join(map(str.capitalize, words))} = ({signature}) =>"]
        functions += [f'  ask("{name}", {{ {names} }}, {{ {written} }});', ""]
    statuses = (f"{name}: {k}, // {what}" for name, k, what in declared.statuses)
    return {"STATUS": _text(statuses, 2), "FIELDS": _text(fields), "TYPES": _text(types), "FUNCTIONS": _text(functions)}


def _plain(kind: str) -> str:
    """A type of C in JavaScript."""
    return "number" if kind == "double" else kind.removeprefix("mbma_").capitalize()


def _written(part: Argument) -> str:
    return f'{part.name}: ["{part.name}"]' if part.kind == "double" else f"{part.name}: {_plain(part.kind).upper()}"


def _lines(text: str, first: str, later: str | None = None) -> list[str]:
    return textwrap.wrap(text, 110, initial_indent=first, subsequent_indent=first if later is None else later)


def _text(lines: Iterable[str], indent: int = 0) -> str:
    return textwrap.indent("\n".join(lines), " " * indent)
