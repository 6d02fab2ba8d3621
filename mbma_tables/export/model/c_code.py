"""The model as C: the core's own files, its tables as data beside them, and calls of one surface; built and replayed.

Tables are text, in the shortest decimals that reproduce every bit, so that any compiler on
any machine reads the same numbers; 150,000 numbers are 3 MB of text and a fraction of a
second of compiling.
"""

import dataclasses
import math
import os
import pathlib
import re
import subprocess
import tempfile
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from typing import Any, NamedTuple

import numpy as np

from mbma_tables import __version__
from mbma_tables.bodies.materials import ISOTROPIC_SHARE
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import write_file
from mbma_tables.contacts.quantities.leakage import OPENING, shipped_flow
from mbma_tables.export.model.bindings import binding_texts
from mbma_tables.export.model.conformance import (
    FORM,
    POINTS_FILE,
    IslandTable,
    lookup_kind,
    points_text,
)
from mbma_tables.export.targets import Options, Target, names_of, option
from mbma_tables.export.text import (
    about,
    braces,
    core_file,
    filled,
    number,
    numerals,
    opening,
    written_by,
)
from mbma_tables.islands.island_models import MIN_RTOL
from mbma_tables.islands.variants import Variant, get_variant
from mbma_tables.surfaces.spectrum import MAX_ZETA_1
from mbma_tables.tables.island4d import Island4dModel
from mbma_tables.tables.open import open_table, universal_model
from mbma_tables.tables.universal import RECORD, UniversalModel
from mbma_tables.theories import persson
from mbma_tables.theories.calibrated import table as calibrated_table
from mbma_tables.theories.calibrated.formulas import LAW_ERROR, YANG_PERSSON
from mbma_tables.theories.evidence import SurfaceSpline
from mbma_tables.theories.mbma.closed_form_certificates import CERTIFICATES, RANGES
from mbma_tables.theories.mbma.closed_forms import FUNCTIONS
from mbma_tables.theories.mbma.models import get_model
from mbma_tables.theories.mbma.sums import QUADRATURE_SHARE
from mbma_tables.theories.yielding import formulas as yielding
from mbma_tables.theories.yielding import unloading

CORE = (
    "totals.c",
    "calibrated.c",
    "spectrum_laws.c",
    "yielding.c",
)  # and the headers that they include
ISLANDS = "island4d.c"  # beside `CORE`, for tables of four numbers
# of the tables' arrays
TYPES = {
    "MBMA_CELLS": "mbma_cell",
    "MBMA_PLACES": "int32_t",
    "MBMA_COEFFICIENTS": "float",
    "MBMA_ERRORS": "float",
    "MBMA_SPLINE": "float",
    "MBMA_FLOW": "float",
}
MODEL = ("mbma_model.h", "mbma_model.c", "mbma_data.c")
SELFTEST = "mbma_selftest.c"
SOURCES = (*CORE, *MODEL[1:], SELFTEST)
# beside the C: its build, and modules of other languages, with the marks of their comments
PACKAGE = {
    "CMakeLists.txt": "#",
    "mbma.pc.in": "#",
    "mbma_model.f90": "!",
    "mbma_model.rs": "//",
}
TIMEOUT = 300.0  # seconds, of a build or a replay
REACHED = 1e-13  # relative, of forces at which separations are found
# flags of the library; rounding does not depend on the compiler
FLAGS = ("-std=c11", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math")
USAGE = (
    f"Compile with cc {' '.join(FLAGS)} -march=native -c {{}} mbma_model.c mbma_data.c, and link the C "
    "mathematics library; mbma_model.h has the calls of one surface, mbma.h those of arrays. Every function may be "
    "called from any thread; nothing is allocated and nothing is kept between calls."
)
LICENCE = (
    "SPDX-License-Identifier: BSD-3-Clause",
    "Copyright (c) 2026, mbma_tables contributors",
    "Redistribution and use in source and binary forms, with or without modification, are permitted as long as this "
    "notice is kept. The software is provided as is, without any warranty.",
)
CONVENTIONS = (
    "Conventions: force is per nominal area, F/A0, in the unit of E_star (F/(A0 E*) where that is 1), with 1/E* = "
    "(1 - nu1^2)/E1 + (1 - nu2^2)/E2; area is A/A0. Any consistent unit of length. The gap is the separation d from "
    "the mid-plane of the rough surface to the rigid plane, -h_max <= d; contact starts at d = h_max. The mean "
    "separation is u = (h_max + d)/2. Geometry and X, mu are as the table's documentation has them: heights in "
    "units of s = h_rms/sqrt(1 - zeta_1^(-2 H)), lengths in 1/q0, zeta_1 = q1/q0."
)


def core_sources(model: IslandTable) -> tuple[str, ...]:
    """The core's own sources that the model of a table needs."""
    return (*CORE, ISLANDS) if isinstance(model, Island4dModel) else CORE


def core_texts(names: Iterable[str] = CORE) -> dict[str, str]:
    """The core's own files that exports hold, unchanged: those of these names and all that they include."""
    texts: dict[str, str] = {}
    wanted = list(names)
    while wanted:
        name = wanted.pop()
        if name not in texts:
            texts[name] = core_file(name)
            wanted += re.findall(r'#include "(.*)"', texts[name])
    return dict(sorted(texts.items()))


def source_texts(
    model: IslandTable, variant: Variant, table: os.PathLike[str] | str | None = None
) -> dict[str, str]:
    """Names and texts of the source files; `table` is where the model was read."""
    if variant.addition != "sum":
        raise InputError(
            f"exported code adds the areas of islands: variant {variant.name!r} takes their cover"
        )
    heads = {
        name: opening(header(name, model, variant, table), "/*")
        for name in (*MODEL, SELFTEST)
    }
    is_of_four = isinstance(model, Island4dModel)
    texts = (
        core_texts(core_sources(model))
        | model_texts(heads, is_of_four)
        | {"mbma_data.c": f"{heads['mbma_data.c']}\n{data_text(model, variant)}"}
    )
    parts = {"FOUR": is_of_four, "LOOKUP": lookup_kind(model), "HEADER": heads[SELFTEST]}
    return texts | {SELFTEST: filled(f"model/{SELFTEST}", **parts)}


def package_texts(
    texts: Mapping[str, str], model: IslandTable, heads: dict[str, str]
) -> dict[str, str]:
    """What builds and installs the source files `texts` by CMake, and calls them from Fortran and Rust."""
    build = filled(
        "model/CMakeLists.txt",
        HEADER=heads["CMakeLists.txt"],
        VERSION=re.match(r"[\d.]*\d", __version__)[0],  # type: ignore[index]
        SOURCES=" ".join((*core_sources(model), *MODEL[1:])),
        FLAGS=" ".join(flag for flag in FLAGS if flag.startswith("-f")),
        POINTS=POINTS_FILE,
    )
    return {
        "CMakeLists.txt": build,
        "mbma.pc.in": filled("model/mbma.pc.in", HEADER=heads["mbma.pc.in"]),
    } | binding_texts(heads, texts["mbma.h"], texts["mbma_model.h"])


def model_texts(heads: dict[str, str], is_of_four: bool = False) -> dict[str, str]:
    """The calls of one surface, under the opening comments of their files."""
    form = RANGES[FORM]
    certificates = CERTIFICATES[FORM]
    prototypes, forms = closed_forms()
    parts = {
        "FOUR": is_of_four,
        "PROTOTYPES": prototypes,
        "CLOSED_FORMS": forms,
        "FORM_X_LOW": number(form["X"][0]),
        "FORM_X_HIGH": number(form["X"][1]),
        "FORM_MU_HIGH": number(form["mu"][1]),
        "FORM_ERROR": number(
            max(certificate.largest for certificate in certificates.values())
        ),
        "MIN_RTOL": "1e-11",  # as `contact` allows
        "MAX_RTOL": "0.1",
        "QUADRATURE_SHARE": number(QUADRATURE_SHARE),
        "CALIBRATED_ERROR": number(calibrated_table.shipped().error),
        "LAW_ERROR": number(LAW_ERROR),
        "PERSSON_ERROR": number(persson.INVERSE_RTOL),
        "ISOTROPIC_SHARE": number(ISOTROPIC_SHARE),
        "REACHED": number(REACHED),
        "LEAST_RATIO": number(unloading.LEAST),
        "OPENING": number(OPENING),
    }
    return {
        name: filled(f"model/{name}", **parts, HEADER=heads[name])
        for name in ("mbma_model.h", "mbma_model.c")
    }


def closed_forms() -> tuple[str, str]:
    """Prototypes and definitions of the closed forms."""
    prototypes = ""
    lines = list[str]()
    for one in (one for results in FUNCTIONS.values() for one in results.values()):
        head = f"double mbma_{one.form}_{one.result}({', '.join(f'double {name}' for name in one.arguments)})"
        prototypes += f"{head};\n"
        lines += [f"/* {one.title} */", f"{head} {{"]
        for name, text in one.steps.items():
            left = "return" if name == one.result else f"const double {name} ="
            lines += textwrap.wrap(
                f"{left} {text};",
                120,
                initial_indent="    ",
                subsequent_indent="        ",
            )
        lines += ["}", ""]
    return prototypes, re.sub(r"(\d)e0\b", r"\1.0", "\n".join(lines))


def tables(model: IslandTable) -> dict[str, Any]:
    """The arrays of the tables by their names in C."""
    spline = calibrated_table.shipped().core_table[0]
    if isinstance(model, Island4dModel):
        coefficients, errors, *_ = model.core_table
        return {
            "MBMA_COEFFICIENTS": coefficients,
            "MBMA_ERRORS": errors,
            "MBMA_SPLINE": spline,
        }
    cells, places, _ = model.cells
    return {
        "MBMA_CELLS": cells.reshape(-1, RECORD),
        "MBMA_PLACES": places,
        "MBMA_SPLINE": spline,
    }


def table_type(model: IslandTable) -> str:
    """The type of a table of islands in C."""
    return "mbma_island_table" if isinstance(model, Island4dModel) else "mbma_cells"


def island_table(model: IslandTable) -> str:
    """The initialiser of a table of islands."""
    if isinstance(model, Island4dModel):
        cells, numbers, variant = model.core_table[2:]
        by_axis = np.split(numbers[:-1], 4)  # first node, rate, low and high
        (offset,) = numerals(numbers[-1])
        names = "MBMA_COEFFICIENTS", "MBMA_ERRORS"
        return braces(*names, cells, *by_axis, offset, _variant(variant))
    X = model.cells[2][:4]
    buckets = model.cells[2][4:].astype(int)
    return braces("MBMA_CELLS", "MBMA_PLACES", *numerals(X), *numerals(buckets))


def _variant(numbers: FloatArray) -> str:
    """The initialiser of a variant of the equations."""
    return braces(*numerals(numbers[:5]), *numerals(numbers[5:].astype(int)))


def data_text(model: IslandTable, variant: Variant, later: bool = False) -> str:
    """The tables, and the variant of the equations; with `later` as variables, for a program to fill in."""
    lines = ['#include "mbma_model.h"']
    law = calibrated_table.shipped()
    flow = shipped_flow()
    arrays = tables(model)
    # in the page, which has no flow, it would be the larger part of what is added
    if not later:
        arrays["MBMA_FLOW"] = flow.core_table[0]
    for name, values in arrays.items():
        kind = TYPES[name]
        head = f"{kind} {name}[{len(values)}]"
        body = (
            _cells if kind == "mbma_cell" else lambda numbers: _wrapped(numerals(numbers))
        )
        lines += (
            ["", f"{head};"]
            if later
            else ["", f"static const {head} = {{", *body(values), "};"]
        )
    theories = [
        np.array(dataclasses.astuple(constants))
        for constants in (YANG_PERSSON, law.constants)
    ]
    values = {
        f"{table_type(model)} CELLS": island_table(model),
        "mbma_calibrated_table LAW": braces(
            _spline("MBMA_SPLINE", law), *numerals(theories[1][:3])
        ),
        "mbma_law_constants THEORIES[]": braces(*theories),
        "mbma_hardness_law HARDNESS": braces(
            *numerals(np.array(dataclasses.astuple(yielding.CONSTANTS)))
        ),
        "mbma_spots_law SPOTS[]": braces(
            *(
                braces(*numerals(spots.numbers()))
                for spots in (unloading.STIFFNESS, unloading.CONTACT)
            )
        ),
        "mbma_variant MBMA_VARIANT": _variant(variant.numbers),
    }
    lines_of_flow = []
    if not later:
        numbers = numerals(np.array(flow.law_constants[:2]))
        constants = numerals(np.array(dataclasses.astuple(flow.constants)))
        values["mbma_flow_table FLOWS"] = braces(_spline("MBMA_FLOW", flow), *numbers)
        values["mbma_flow_law FLOW"] = braces(*constants)
        lines_of_flow = [
            "const mbma_flow_table *mbma_flows(void) { return &FLOWS; }",
            "const mbma_flow_law *mbma_flow(void) { return &FLOW; }",
        ]
    held = (
        f"{'' if later and 'MBMA' in name else 'static const '}{name} = {text};"
        for name, text in values.items()
    )
    lines += [
        "",
        *held,
        "",
        f"const {table_type(model)} *mbma_table(void) {{ return &CELLS; }}",
        "const mbma_calibrated_table *mbma_law_table(void) { return &LAW; }",
        "const mbma_variant *mbma_model_variant(void) { return &MBMA_VARIANT; }",
        "const mbma_law_constants *mbma_theory(int theory) { return &THEORIES[theory == MBMA_CALIBRATED]; }",
        "const mbma_hardness_law *mbma_hardness(void) { return &HARDNESS; }",
        "const mbma_spots_law *mbma_spots(int of_area) { return &SPOTS[of_area != 0]; }",
        *lines_of_flow,
    ]
    return "\n".join([*lines, ""])


def _spline(name: str, table: SurfaceSpline) -> str:
    """The initialiser of a spline whose coefficients have a name."""
    low, high = table.covered[:2].T
    return braces(name, table.cells, table.first, 1 / table.step, low, high)


def _wrapped(items: Sequence[str], first: str = "", last: str = "") -> list[str]:
    text = f"{first}{', '.join(items)}{last}"
    return textwrap.wrap(
        text, 120, initial_indent="    ", subsequent_indent="    ", break_on_hyphens=False
    )


def _cells(cells: FloatArray) -> Iterator[str]:
    """Initialisers of mbma_cell."""
    for cell in cells:
        yield from _wrapped(numerals(cell[:8]), "{", ",")
        for name, powers in zip("FA", cell[8:].reshape(2, 8, 8), strict=True):
            yield from _wrapped(
                [braces(*numerals(row)) for row in powers],
                "{",
                "}," if name == "F" else "}},",
            )


def header(
    name: str,
    model: IslandTable,
    variant: Variant,
    table: os.PathLike[str] | str | None = None,
) -> list[str]:
    """Paragraphs of a file's opening comment: origin, contents, variant, range, errors, conventions, licence."""
    content = model.content
    law = calibrated_table.shipped()
    found = content.attributes
    sources = " ".join(core_sources(model))
    of_table = [] if table is None else ["--table", os.fspath(table)]
    worst, visited = (
        max(float(found[f"{which}largest_error_{of}"]) for of in ("F", "A"))
        for which in ("", "visited_")
    )
    form = RANGES[FORM]
    certificates = CERTIFICATES[FORM]
    ranges = [
        f"{axis} in [{about(math.exp(low) if k else low)}, {about(math.exp(high) if k else high)}]"
        for k, (axis, (low, high)) in enumerate(
            zip(("H", "zeta_1", "u/h_rms"), law.covered, strict=True)
        )
    ]
    return [
        f"{name}: part of the MBMA model and the calibrated law of rough contact as source code.",
        f"Written by mbma_tables {__version__}. {USAGE.format(sources)}",
        f"MBMA model of rough contact (Guo, Ma and Zhu): {_contents(model)}, or by a closed form of X and mu, islands "
        "of a self-affine surface, and the surface's force and area at a gap.",
        f"Variant: {variant.name} (density divisor {number(variant.density_divisor)}, beta {number(variant.beta)}, "
        f"phi {number(variant.phi)}, floors {number(variant.floor_d)} and {number(variant.floor_u)}, "
        f"Jacobian {variant.jacobian}, offset "
        f"{'on' if variant.offset else 'off'}, sigma of {'summits' if variant.summit_sigma else 'all heights'}).",
        f"Table: data {found['values_sha256']}",
        f"Range: {_range(model)}, zeta_1 up to {number(MAX_ZETA_1)}.",
        f"Largest relative error of the table against the solved model: {about(worst, 2)} on "
        f"{found['certificate_points']} held-out points, {about(visited, 2)} at islands of random surfaces; "
        "each answer carries its own bound.",
        f"Closed form, {FORM}: for {about(form['X'][0], 6)} <= X <= {about(form['X'][1], 6)} and "
        f"mu <= {about(form['mu'][1], 6)}; largest relative error {about(certificates['phi_F'].largest, 2)} of "
        f"Phi_F, {about(certificates['phi_A'].largest, 2)} of Phi_A.",
        "Outside the table there is no answer, only a status: nothing is clamped or extrapolated.",
        "Law calibrated on boundary elements, by a table of force over Hurst exponent, q1/q0 and mean separation, in C "
        f"also of any spectrum, as Persson's theory, by a sum over wavelengths. Table: {', '.join(ranges)}; other "
        "separations continue by the law's limits.",
        f"Largest relative error of the table against the law: {about(law.error, 2)}. Simulations scatter about the "
        "law by percents to tens of percents, which the documentation lists.",
        written_by(["c", *of_table, "--variant", variant.name, "--out", "."]),
        CONVENTIONS,
        *LICENCE,
    ]


def _contents(model: IslandTable) -> str:
    """What the table of islands has."""
    if isinstance(model, Island4dModel):
        return (
            "force and area of a contact island over (delta/h_rms, zeta_d, zeta_u, H) by a quintic "
            "spline"
        )
    return "Phi_F and Phi_A of a contact island over (X, mu) by local polynomials"


def _range(model: IslandTable) -> str:
    """What the table of islands covers."""
    if isinstance(model, Island4dModel):
        X, spread, sphere, hurst = model.content.axes
        return (
            f"{about(X.low, 6)} <= X = (delta zeta_d^H/h_rms - 1)/sigma <= {about(X.high, 6)}, "
            f"0 < zeta_u/zeta_d - 1 <= {about(spread.high, 6)}, "
            f"{about(sphere.low, 6)} <= (1.25/zeta_d)^(4 - 2 H) <= {about(sphere.high, 6)}, "
            f"{about(hurst.low, 6)} <= H <= {about(hurst.high, 6)}"
        )
    X, mu = model.content.axes
    return (
        f"{about(X.low, 6)} <= X <= {about(X.high, 6)}, 0 <= mu <= {about(mu.high, 6)}; "
        "H in (0, 1]"
    )


def _table_of(table: os.PathLike[str] | str, variant: Variant) -> IslandTable:
    """The model of a table, which must be of islands, and of this variant where it is of one."""
    model = open_table(table)
    if not isinstance(model, UniversalModel | Island4dModel):
        raise InputError(
            f"{table} is a table of a function, this C is of contact islands: `mbma tables export c` writes "
            "that of a function"
        )
    get_model(model, MIN_RTOL, variant)  # refuses another variant by name
    return model


def write_code(
    folder: os.PathLike[str] | str,
    variant: str | Variant = "reported",
    table: os.PathLike[str] | str | None = None,
) -> list[pathlib.Path]:
    """Write the model as C11, which C++ compiles too, with conformance points and a self-test that replays them.

    Beside it are a build by CMake, which installs it for `find_package` and pkg-config, and
    modules of Fortran and Rust that call it.

    A missing folder is made, files of the same names are replaced. Returns the files written.
    `table` is the file of a table to write in place of the shipped universal one; with a table
    of four numbers, which may be "island4d", `mbma_lookup_of` takes the place of `mbma_phi_of`.

    Raises
    ------
    InputError
        For a table that was made for another variant, or is not of islands.

    Examples
    --------
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     [path.name for path in write_code(folder) if path.name.startswith("mbma_")]
    ['mbma_model.h', 'mbma_model.c', 'mbma_data.c', 'mbma_selftest.c', 'mbma_conformance.csv', 'mbma_model.f90', 'mbma_model.rs']
    """
    rule = get_variant(variant)
    model = universal_model() if table is None else _table_of(table, rule)
    texts = source_texts(model, rule, table) | {POINTS_FILE: points_text(model, rule)}
    heads = {
        name: opening(header(name, model, rule, table), mark)
        for name, mark in PACKAGE.items()
    }
    texts |= package_texts(texts, model, heads)
    for name, text in texts.items():
        write_file(pathlib.Path(folder, name), text.encode(), make_folders=True)
    return [pathlib.Path(folder, name) for name in texts]


class BuildError(InputError):
    """A compiler or program that is not installed, or failed."""


def built_by(
    command: Sequence[str], texts: Mapping[str, str], made: str, *last: str
) -> bytes:
    """The output of a compiler for the C sources among texts."""
    with tempfile.TemporaryDirectory() as work:
        for name, text in texts.items():
            write_file(pathlib.Path(work, name), text.encode())
        _run(
            [
                *command,
                *(name for name in texts if name.endswith(".c")),
                "-o",
                made,
                *last,
            ],
            work,
            "did not compile",
        )
        return pathlib.Path(work, made).read_bytes()


def _run(command: Sequence[str], folder: str, failure: str = "") -> str:
    """What a program prints; with `failure` it must end without an error."""
    try:
        done = subprocess.run(
            command,
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=TIMEOUT,
            check=False,
        )
    except FileNotFoundError:
        raise BuildError(f"{command[0]} is not installed") from None
    except subprocess.TimeoutExpired:
        raise BuildError(f"{command[0]}: no end within {TIMEOUT:g} s") from None
    if failure and done.returncode:
        raise BuildError(
            f"{' '.join(command[:3])} {failure}: {done.stderr.strip()[:500]}"
        )
    return done.stdout


class Replay(NamedTuple):
    """Result of a self-test: by kind rows and largest relative difference; results that failed."""

    points: dict[str, int]
    largest: dict[str, float]
    failed: int  # beyond their tolerance, or rejected


def check(
    folder: os.PathLike[str] | str, points: os.PathLike[str] | str | None = None
) -> Replay:
    """Compile what `write_code` wrote, and replay the points beside it, or others.

    Raises
    ------
    BuildError
        Where the compiler is not installed, and where it fails.
    """
    place = pathlib.Path(folder).absolute()
    csv = place / POINTS_FILE if points is None else pathlib.Path(points).absolute()
    if not csv.is_file():
        raise InputError(f"{csv} does not exist; write_code({str(place)!r}) makes it")
    with tempfile.TemporaryDirectory() as work:
        _run(
            [
                "cc",
                *FLAGS,
                *(str(place / name) for name in SOURCES),
                *map(str, place.glob(ISLANDS)),
                "-lm",
                "-o",
                "selftest",
            ],
            work,
            "did not compile",
        )
        return read_report(_run([f"{work}/selftest", str(csv)], work))


def read_report(text: str) -> Replay:
    """The output of a self-test: kind, rows, largest difference; then the number of failures."""
    *kinds, last = [line.split() for line in text.splitlines()] or [[]]
    if last[:1] != ["failed"]:
        raise BuildError(f"the self-test did not end: {text[-500:]}")
    return Replay(
        {kind: int(n) for kind, n, _ in kinds},
        {kind: float(most) for kind, _, most in kinds},
        int(last[1]),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class ModelOptions(Options):
    """Options of the whole model."""

    table: Any = field(
        default=None,
        metadata=option(
            "Of the whole model: FILE.nc of a table, or island4d, in place of the shipped "
            "universal one."
        ),
    )
    check: Any = field(
        default=None,
        metadata=option(
            "Of the whole model: build it and replay its conformance points.", "flag"
        ),
    )


TARGETS = (
    Target(
        "c",
        write_code,
        frozenset({"variant"} | names_of(ModelOptions)),
        ModelOptions,
        output=(
            "the whole model, C11: the table, island geometry, totals, the closed "
            "forms; the calibrated law, with a hardness and after a larger pressure too, "
            "and Persson's theory"
        ),
        outside="NaN, and a status",
        tested=(
            "gcc and g++ 12.2, ziglang 0.17.1, warnings as errors, address and "
            "undefined-behaviour sanitizers"
        ),
    ),
)
