"""docs/formula.md: closed forms with their certificates, and errors of the pocket laws."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.special import erf

from generate.boundary_elements.design import TRAINING
from generate.boundary_elements.evidence import MIN_WAVES
from generate.formulas.printing import HEADER, latex_steps, read_functions
from generate.pages.page import Measured, evidence, table
from mbma_tables.common.arguments import FloatArray
from mbma_tables.models import Certificate
from mbma_tables.models.closed_form_certificates import CERTIFICATES, RANGES

POCKET_AREAS = (0.01, 0.97)  # contact fractions at which the pocket laws are compared with simulations


def pocket_area(pressure: FloatArray, alpha: float) -> FloatArray:
    """A/A0 at p/(E* g): the area law of the README."""
    t = pressure / 0.33
    s = (0.51 + 0.033 * math.log(alpha / 10) + t) / (1 + t)
    return np.asarray(erf(pressure * np.sqrt(2 / s)))


def pocket_pressure(u: FloatArray, nu: float) -> FloatArray:
    """p/(E* q0 h_rms) at u/h_rms: the law of separation of the README, by the spectrum's narrowness."""
    return np.asarray(u**-0.26 * np.exp(-1.91 * u - 2.8 * (nu - 0.63)))


def pocket_errors() -> list[list[Any]]:
    """Of both laws: name, median, 90% quantile and largest error [%] on held-out surfaces, number of surfaces."""
    seen = [o for o in evidence() if o.split != TRAINING and o.kind == "self_affine" and o.waves >= MIN_WAVES]
    area, pressure = [], []
    for one in seen:
        inside = (one.area >= POCKET_AREAS[0]) & (one.area <= POCKET_AREAS[1])
        spectrum, force = one.spectrum, one.force[inside]
        area.append(pocket_area(force, float(spectrum.alpha)) / one.area[inside] - 1)
        law = pocket_pressure(one.u[inside], float(spectrum.narrowness)) / float(spectrum.gradient)
        pressure.append(law / force - 1)
    found = {"area at given pressure": area, "pressure at given separation": pressure}
    sizes = {what: 100 * np.abs(np.concatenate(values)) for what, values in found.items()}
    return [[what, *np.quantile(size, (0.5, 0.9, 1.0)), len(seen)] for what, size in sizes.items()]


def pocket_laws() -> str:
    """The same as a table."""
    header = "pocket law | median error | 90% of errors below | largest | surfaces"
    return table(header, pocket_errors(), "{} | {:.2g}% | {:.2g}% | {:.2g}% | {}")


def equations(form: str) -> str:
    """A form in LaTeX."""
    functions = read_functions(HEADER.read_text(encoding="utf-8")).values()
    # steps that functions of a form share are printed once
    steps = dict.fromkeys(line for function in functions if function.form == form for line in latex_steps(function))
    return "\n\n".join(f"$${line}$$" for line in steps)


def worst(found: Certificate) -> str:
    """Where a form's error is largest."""
    return ", ".join(f"{name} = {value:g}" for name, value in found.worst_at.items())


def measure() -> Measured:
    """Certificates, ranges and equations of the closed forms."""
    rows = [
        (form, result, found.coefficients, found.largest, found.median, worst(found))
        for form, results in CERTIFICATES.items()
        for result, found in results.items()
    ]
    header = "form | function | coefficients | largest error | median | worst at"
    ranges = [
        f"- {form}: {', '.join(f'`{low:g} <= {name} <= {high:g}`' for name, (low, high) in limits.items())}"
        for form, limits in RANGES.items()
    ]
    certificates = table(header, rows, "{} | {} | {} | {:g} | {:.2g}")
    parts = {"laws": pocket_laws(), "certificates": certificates, "ranges": "\n".join(ranges)}
    return parts | {form: equations(form) for form in ("pocket", "standard", "totals")}, {}
