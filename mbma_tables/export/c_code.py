"""The model as C99: its numbers as a header file, the comment that opens each file, and the texts of the files.

The table is text, in the shortest decimals that give back every bit, so that the files mean the same to any compiler on
any machine; 150,000 numbers are 3 MB of text and a fraction of a second of compiling.
"""

from __future__ import annotations

import ast
import inspect
import math
import textwrap
from collections.abc import Iterator

import numpy as np

from mbma_tables import __version__, calibrated
from mbma_tables.arguments import FloatArray
from mbma_tables.errors import InputError
from mbma_tables.export.text import filled, opening
from mbma_tables.models import closed_form_functions, universal_kernel
from mbma_tables.models.universal import UniversalModel
from mbma_tables.surfaces import spectrum
from mbma_tables.surfaces.readings import Reading
from mbma_tables.surfaces.spectrum import MAX_ZETA_1, MIN_ZETA_1
from mbma_tables.tablefiles.schema import BUCKET_BITS
from mbma_tables.theories import calibrated_table, persson, spectrum_laws
from mbma_tables.totals import gauss_kronrod, intervals, island_sum, kernel

FORM = "standard"  # that of tier "formula"
MIN_RTOL, MAX_RTOL = 1e-11, 0.1  # as `contact` allows
# what lies where in a record
RECORD_NAMES = (
    *("TERMS", "ERROR", "CENTRE", "RATE", "TOP_MU", "TOP", "BOTTOM_MU", "BOTTOM"),
    *("FORCE_POWERS", "AREA_POWERS"),
)
USAGE = (
    "Compile mbma.c and, for the calibrated law and Persson's theory, mbma_theories.c, each with its table beside it, "
    "and link the C mathematics library: cc -std=c99 -O2 -c mbma.c mbma_theories.c. Every function may be called from "
    "any thread; nothing is allocated and nothing is kept between calls."
)
TITLES = {
    "mbma.h": "the MBMA model in C99, declarations.",
    "mbma.c": "the MBMA model in C99.",
    "mbma_table.h": "the numbers of the MBMA model in C99, for mbma.c alone.",
    "mbma_theories.h": "the calibrated law and Persson's theory in C99, declarations.",
    "mbma_theories.c": "the calibrated law and Persson's theory in C99, beside mbma.c.",
    "mbma_theories_table.h": "the numbers of the calibrated law in C99, for mbma_theories.c alone.",
}
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


def c_texts(model: UniversalModel, reading: Reading) -> dict[str, str]:
    """Names and texts of the C sources, the self-test apart."""
    if reading.addition != "sum":
        raise InputError(f"exported code adds the areas of islands: reading {reading.name!r} takes their cover")
    tables = {
        "mbma_table.h": numbers_text(*numbers(model, reading)),
        "mbma_theories_table.h": numbers_text(*theory_numbers(), what="THEORIES_TABLE"),
    }
    prototypes, forms = closed_forms()
    texts = {}
    for name, title in TITLES.items():
        about = about_theories() if name.startswith("mbma_theories") else about_model(model, reading)
        head = opening(header(f"{name}: {title}", USAGE, about), "/*")
        parts = {"HEADER": head, "CLOSED_FORMS": forms, "PROTOTYPES": prototypes}
        texts[name] = f"{head}\n{tables[name]}" if name in tables else filled(name, **parts)
    return texts


class _InC(ast.NodeTransformer):
    """Arithmetic that Python and C read alike: doubles for whole numbers, pow for **."""

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        self.generic_visit(node)
        return ast.Call(ast.Name("pow"), [node.left, node.right], []) if isinstance(node.op, ast.Pow) else node

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        return ast.Constant(float(ast.unparse(node)))

    def visit_Name(self, node: ast.Name) -> ast.AST:
        return ast.Constant(math.pi) if node.id == "pi" else node


def closed_forms() -> tuple[str, str]:
    """Prototypes and definitions of the closed forms, from the text of the Python functions."""
    heads, definitions = [], []
    for node in ast.parse(inspect.getsource(closed_form_functions)).body:
        if isinstance(node, ast.FunctionDef):
            heads.append(f"double mbma_{node.name}({', '.join(f'double {given.arg}' for given in node.args.args)})")
            lines = [f"/* {ast.get_docstring(node)} */", f"{heads[-1]} {{"]
            for step in node.body[1:]:
                text = ast.unparse(_InC().visit(step)).replace("\n", " ")
                text = f"{'' if isinstance(step, ast.Return) else 'const double '}{text};"
                lines += textwrap.wrap(text, 120, initial_indent="    ", subsequent_indent="        ")
            definitions.append("\n".join([*lines, "}\n"]))
    return "".join(f"{head};\n" for head in heads), "\n".join(definitions)


def numbers(model: UniversalModel, reading: Reading) -> tuple[dict[str, int | float], dict[str, FloatArray]]:
    """Constants and arrays of the model by their names in C, from the modules that use them here, in one list."""
    table = model.kernel
    form, certificates = closed_form_functions.RANGES[FORM], closed_form_functions.CERTIFICATES[FORM]
    constants: dict[str, int | float] = {
        "OFFSET": int(reading.offset),
        "SUMMITS": int(reading.summit_sigma),
        "PRINTED_JACOBIAN": int(reading.jacobian == "printed"),
        "MAX_INTERVALS": intervals.MAX_INTERVALS,
        "PI": math.pi,
        **{name: getattr(universal_kernel, name) for name in RECORD_NAMES},
        "BUCKET_BITS": BUCKET_BITS,
        "FIRST_BUCKET": table.first_bucket,
        "BUCKETS": table.buckets,
        "X_LOW": table.X_low,
        "X_HIGH": table.X_high,
        "X_RATE": table.X_rate,
        "MU_HIGH": table.mu_high,
        "RADIUS": spectrum.RADIUS,
        "BROADENING": spectrum.BROADENING,
        "DIVISOR": reading.density_divisor,
        "BETA": reading.beta,
        "PHI": reading.phi,
        "FLOOR_D": reading.floor_d,
        "FLOOR_U": reading.floor_u,
        "MIN_ZETA_1": max(MIN_ZETA_1, reading.floor_u),
        "MAX_ZETA_1": MAX_ZETA_1,
        "MIN_APPROACH": 1e-140,  # squares of what is of its order do not underflow
        "STRETCH": kernel.STRETCH,
        "NARROW": intervals.NARROW,
        "SAFETY": intervals.safety_of(reading.floor_d),
        "QUADRATURE_SHARE": island_sum.QUADRATURE_SHARE,
        "FORMULA_X_LOW": form["X"][0],
        "FORMULA_X_HIGH": form["X"][1],
        "FORMULA_MU_HIGH": form["mu"][1],
        "FORMULA_ERROR": max(certificate.largest for certificate in certificates.values()),
        "MIN_RTOL": MIN_RTOL,
        "MAX_RTOL": MAX_RTOL,
    }
    arrays = {
        "NODES_21": gauss_kronrod.NODES_21,
        "KRONROD_21": gauss_kronrod.KRONROD_21,
        "GAUSS_21": gauss_kronrod.GAUSS_21,
        "NODES_31": gauss_kronrod.NODES_31,
        "KRONROD_31": gauss_kronrod.KRONROD_31,
        "GAUSS_31": gauss_kronrod.GAUSS_31,
        # whole numbers, as all arrays are of doubles
        "PLACES": table.places.astype(float),
        "RECORDS": table.records.reshape(-1, universal_kernel.RECORD),
    }
    return constants, arrays


def theory_numbers() -> tuple[dict[str, int | float], dict[str, FloatArray]]:
    """The same of mbma_theories.c: the calibrated law with its table, and Persson's."""
    table = calibrated_table.shipped()
    spline = table.coefficients
    rules = [np.polynomial.legendre.leggauss(count) for count in (2, 4, 6, 10)]
    constants: dict[str, int | float] = {"PI": math.pi, "MIN_ZETA_1": MIN_ZETA_1, "MAX_ZETA_1": MAX_ZETA_1}
    for k, name in enumerate(("HURST", "ZETA", "U")):
        constants |= {
            f"NODES_{name}": spline.shape[k] - 4,
            f"COLUMNS_{name}": spline.shape[k],
            f"{name}_START": table.first[k],
            f"{name}_RATE": 1 / table.step[k],
            f"{name}_LOW": table.covered[k, 0],
            f"{name}_HIGH": table.covered[k, 1],
        }
    constants |= {name.upper(): value for name, value in vars(table.constants).items()}
    constants |= {
        "NARROWNESS": calibrated.NARROWNESS,
        "PERSSON_GAMMA": persson.GAMMA,
        "CALIBRATED_ERROR": table.error,
        "PERSSON_ERROR": persson.INVERSE_RTOL,
        "LAW_ERROR": spectrum_laws.LAW_ERROR,
        "MAX_LOG_FORCE": -persson.MIN_LOG_FORCE,
        "GRADED": 36,
    }
    padded = [np.stack([np.pad(part, (0, 10 - part.size)) for part in column]) for column in zip(*rules, strict=True)]
    arrays = {"GAUSS_NODES": padded[0], "GAUSS_WEIGHTS": padded[1], "SPLINE": np.ravel(spline)}
    return constants, arrays


def numbers_text(
    constants: dict[str, int | float], arrays: dict[str, FloatArray], later: tuple[str, ...] = (), what: str = "TABLE"
) -> str:
    """The numbers as macros and constant arrays; those named in `later` as variables, for a program to fill in."""
    lines = [f"#ifndef MBMA_{what}_H", f"#define MBMA_{what}_H", ""]
    for name, value in constants.items():
        text = value if isinstance(value, int) else f"({float(value)!r})"
        lines.append(f"double MBMA_{name};" if name in later else f"#define MBMA_{name} {text}")
    for name, values in arrays.items():
        kind = "float" if values.dtype == np.float32 else "double"
        what = f"{kind} MBMA_{name}{''.join(f'[{extent}]' for extent in values.shape)}"
        lines += [
            "",
            *([f"{what};"] if name in later else [f"static const {what} = {{", *_initializer(values, "  "), "};"]),
        ]
    return "\n".join([*lines, "", "#endif", ""])


def _initializer(values: FloatArray, indent: str) -> Iterator[str]:
    if values.ndim == 1:
        # in the shortest decimals of its precision
        text = ", ".join(values.astype(str).tolist())
        yield from textwrap.wrap(text, 120, initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False)
        return
    for row in values:
        yield f"{indent}{{"
        yield from _initializer(row, indent + "  ")
        yield f"{indent}}},"


def header(title: str, usage: str, about: list[str]) -> list[str]:
    """Paragraphs of a file's opening comment: what it is and what made it, what it holds, conventions, licence."""
    return [title, f"Written by mbma_tables {__version__}. {usage}", *about, CONVENTIONS, *LICENCE]


def about_model(model: UniversalModel, reading: Reading) -> list[str]:
    """The MBMA model, its reading, range and error."""
    content = model.content
    found, (X, mu) = content.attributes, content.axes
    worst, visited = (
        max(float(found[f"{which}largest_error_{name}"]) for name in ("F", "A")) for which in ("", "visited_")
    )
    form, certificates = closed_form_functions.RANGES[FORM], closed_form_functions.CERTIFICATES[FORM]
    return [
        "MBMA model of rough contact (Guo, Ma and Zhu): Phi_F and Phi_A of a contact island over (X, mu) by local "
        "polynomials or a closed form, islands of a self-affine surface, and the surface's force and area at a gap.",
        f"Reading: {reading.name} (density divisor {reading.density_divisor:.17g}, beta {reading.beta:.17g}, phi "
        f"{reading.phi:g}, floors {reading.floor_d:g} and {reading.floor_u:g}, Jacobian {reading.jacobian}, offset "
        f"{'on' if reading.offset else 'off'}, sigma of {'summits' if reading.summit_sigma else 'all heights'}).",
        f"Table: data {found['values_sha256']}",
        f"Range: {X.low:g} <= X <= {X.high:g}, 0 <= mu <= {mu.high:g}; H in (0, 1], zeta_1 up to {MAX_ZETA_1:g}.",
        f"Largest relative error of the table against the solved model: {worst:.2g} on {found['certificate_points']} "
        f"held-out points, {visited:.2g} at islands of random surfaces; each answer carries its own bound.",
        f"Closed form, {FORM}: for {form['X'][0]:g} <= X <= {form['X'][1]:g} and mu <= {form['mu'][1]:g}; largest "
        f"relative error {certificates['phi_F'].largest:.2g} of Phi_F, {certificates['phi_A'].largest:.2g} of Phi_A.",
        "Outside the table there is no answer, only a status: nothing is clamped or extrapolated.",
    ]


def about_theories() -> list[str]:
    """The calibrated law by its table, and theories by a spectrum."""
    table = calibrated_table.shipped()
    ranges = [
        f"{name} in [{math.exp(low) if k else low:.4g}, {math.exp(high) if k else high:.4g}]"
        for k, (name, (low, high)) in enumerate(zip(("H", "zeta_1", "u/h_rms"), table.covered, strict=True))
    ]
    return [
        "Law calibrated on boundary elements, by a table of force over Hurst exponent, q1/q0 and mean separation, in C "
        f"also of any spectrum, as Persson's theory, by a sum over waves. Table: {', '.join(ranges)}; other "
        "separations continue by the law's limits.",
        f"Largest relative error of the table against the law: {table.error:.2g}. Simulations scatter about the law by "
        "percents to tens of percents, which the documentation lists.",
    ]
