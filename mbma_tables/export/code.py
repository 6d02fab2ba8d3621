"""The whole model as source code: the core's C, and Fortran and JavaScript over it; written, built and replayed.

The interfaces in these languages are generated from the C headers, whose comments describe each call.
"""

import base64
import functools
import importlib.util
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from mbma_tables.common.errors import InputError
from mbma_tables.common.files import write_file
from mbma_tables.export import c_code
from mbma_tables.export.conformance import KINDS, POINTS_FILE, points_text
from mbma_tables.export.targets import Target
from mbma_tables.export.text import filled, opening, wrapped
from mbma_tables.models.tables import universal_model
from mbma_tables.models.universal import UniversalModel
from mbma_tables.surfaces.variants import Variant, get_variant

TIMEOUT = 300.0  # seconds, of a build or a replay
ZIG = ("-m", "ziglang", "cc", "-target", "wasm32-wasi", "-mexec-model=reactor", *c_code.FLAGS, "-s")


class Language(NamedTuple):
    """A target's own files, each made from a template; and how its self-test is built and run.

    In the commands, `{0}` is the folder of the sources and `{1}` the one to build in; an empty one builds nothing.
    """

    files: tuple[str, ...]
    usage: str
    build: tuple[str, ...]
    run: tuple[str, ...]


SOURCES = (*c_code.CORE, "mbma_model.c", "mbma_data.c", "mbma_selftest.c")
IN_PLACE = tuple(f"{{0}}/{name}" for name in SOURCES)
LANGUAGES = {
    "c": Language(
        ("mbma_selftest.c",),
        c_code.USAGE,
        ("cc", *c_code.FLAGS, *IN_PLACE, "-lm", "-o", "selftest"),
        ("{1}/selftest",),
    ),
    "fortran": Language(
        ("mbma.f90", "mbma_selftest.f90", "mbma_selftest.c"),
        "Compile it with the C files but mbma_selftest.c, which these flags are for: gfortran "
        f"{' '.join(c_code.FLAGS[1:])} {' '.join(SOURCES[:-1])} mbma.f90 program.f90. Every procedure may be called "
        "from any thread.",
        (
            *("gfortran", *c_code.FLAGS[1:], "-DMBMA_OTHER_REPLAY", *IN_PLACE),
            *("{0}/mbma.f90", "{0}/mbma_selftest.f90", "-o", "selftest"),
        ),
        ("{1}/selftest",),
    ),
    "javascript": Language(
        ("mbma.mjs", "mbma_selftest.mjs"),
        "import { total, totalSlopes, calibrated, phi } from './mbma.mjs', in any browser since 2021 "
        "and in node: one file, no dependency, nothing to fetch. Answers are objects with a status, which is STATUS.OK "
        "where they hold numbers; an argument that is not a number, or is NaN, throws a TypeError.",
        (),
        ("node", "{0}/mbma_selftest.mjs"),
    ),
}


def write_code(target: str, folder: os.PathLike[str] | str, variant: str | Variant = "reported") -> list[pathlib.Path]:
    """Write the model as code into a folder, with conformance points and a self-test that replays them.

    The target "c" is C11, which C++ compiles too; "fortran" a Fortran 2008 module over that C; "javascript" an
    ECMAScript module with that C in it as WebAssembly, which the package ziglang compiles. A missing folder is made,
    files of the same names are replaced. Returns the files written.

    Examples
    --------
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     [path.name for path in write_code("c", folder) if path.name.startswith("mbma_")]
    ['mbma_model.h', 'mbma_model.c', 'mbma_data.c', 'mbma_selftest.c', 'mbma_conformance.csv']
    """
    if target not in LANGUAGES:
        raise InputError(f"target must be one of {tuple(LANGUAGES)}, got {target!r}")
    rule, model = get_variant(variant), universal_model()
    texts = {**source_texts(target, model, rule), POINTS_FILE: points_text(model, rule)}
    for name, text in texts.items():
        write_file(pathlib.Path(folder, name), text.encode(), make_folders=True)
    return [pathlib.Path(folder, name) for name in texts]


def source_texts(target: str, model: UniversalModel, variant: Variant) -> dict[str, str]:
    """Names and texts of a target's source files."""
    language, c_texts = LANGUAGES[target], c_code.c_texts(model, variant)
    texts = {} if target == "javascript" else c_texts
    declarations = c_texts["mbma.h"] + c_texts["mbma_model.h"]
    for name in language.files:
        lines = c_code.header(name, target, language.usage, model, variant)
        parts = {"HEADER": opening(lines, "!" if name.endswith(".f90") else "/*")}
        if name == "mbma.f90":
            parts |= fortran_interface(declarations)
        if name == "mbma.mjs":
            parts |= javascript_interface(declarations)
            parts["WASM"] = base64.encodebytes(web_assembly(c_texts, Declared(declarations).calls)).decode("ascii")
        texts[name] = filled(name, **parts)
    return texts


def web_assembly(c_texts: dict[str, str], names: Iterable[str], *options: str) -> bytes:
    """C sources compiled to WebAssembly, with the functions and variables that it exports."""
    if importlib.util.find_spec("ziglang") is None:
        raise InputError(
            "javascript is compiled from C by the package ziglang, which is not installed: pip install ziglang"
        )
    exports = [f"-Wl,--export={name}" for name in names]
    return built_by([sys.executable, *ZIG, *options, *exports], c_texts, "mbma.wasm")


class BuildError(InputError):
    """A compiler or program that is not installed, or failed."""


def built_by(command: list[str], texts: Mapping[str, str], made: str, *last: str) -> bytes:
    """The output of a compiler for the C sources among texts."""
    with tempfile.TemporaryDirectory() as work:
        for name, text in texts.items():
            write_file(pathlib.Path(work, name), text.encode())
        _run([*command, *(name for name in texts if name.endswith(".c")), "-o", made, *last], work, "did not compile")
        return pathlib.Path(work, made).read_bytes()


class Replay(NamedTuple):
    """Result of a replay in the target: by kind rows and largest relative difference; results that failed."""

    points: dict[str, int]
    largest: dict[str, float]
    failed: int  # beyond their tolerance, or rejected


def check(target: str, folder: os.PathLike[str] | str, points: os.PathLike[str] | str | None = None) -> Replay:
    """Build what `write_code` wrote, and replay the points beside it, or others.

    Raises
    ------
    BuildError
        Where the compiler or the interpreter is not installed, and where it fails.
    """
    if target not in LANGUAGES:
        raise InputError(f"target must be one of {tuple(LANGUAGES)}, got {target!r}")
    place = pathlib.Path(folder).absolute()
    csv = place / POINTS_FILE if points is None else pathlib.Path(points).absolute()
    if not csv.is_file():
        raise InputError(f"{csv} does not exist; write_code({target!r}, {str(place)!r}) makes it")
    language = LANGUAGES[target]
    with tempfile.TemporaryDirectory() as work:
        build, run = ([word.format(place, work) for word in command] for command in (language.build, language.run))
        if build:
            _run(build, work, "did not compile")
        return read_report(_run([*run, str(csv)], work))


def _run(command: list[str], folder: str, failure: str = "") -> str:
    """What a program prints; with `failure` it must end without an error."""
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=TIMEOUT, check=False)
    except FileNotFoundError:
        raise BuildError(f"{command[0]} is not installed") from None
    except subprocess.TimeoutExpired:
        raise BuildError(f"{command[0]}: no end within {TIMEOUT:g} s") from None
    if failure and done.returncode:
        raise BuildError(f"{' '.join(command[:3])} {failure}: {done.stderr.strip()[:500]}")
    return done.stdout


def read_report(text: str) -> Replay:
    """The output of a self-test: kind, rows, largest difference; then the number of failures."""
    rows = [line.split() for line in text.splitlines()]
    failed = [int(words[1]) for words in rows if len(words) == 2 and words[0] == "failed"]
    if not failed:
        raise BuildError(f"the self-test did not end: {text[-500:]}")
    kinds = [words for words in rows if len(words) == 3 and words[0] in KINDS]
    return Replay({kind: int(n) for kind, n, _ in kinds}, {kind: float(most) for kind, _, most in kinds}, failed[0])


DEFAULTS = {"E_star": "1", "rtol": "1e-8"}  # of arguments in JavaScript


class Argument(NamedTuple):
    """Argument of a call: a number or a structure that is read, or a pointer that is written to."""

    kind: str  # "double" or a structure
    name: str
    pointer: bool
    read: bool


class Declared:
    """Numbers of a status; structures of doubles; and calls of one island or surface, which take no others."""

    def __init__(self, headers: str) -> None:
        self.statuses: list[tuple[str, str, str]] = re.findall(r"MBMA_(\w+) = (\d+),? +/\* (.*?) \*/", headers)
        # with the header's comments on them
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


_TAKES = frozenset({"variant", "check"})
TARGETS = tuple(Target(name, functools.partial(write_code, name), _TAKES) for name in LANGUAGES)
