"""docs/formula.md: closed forms with their certificates, and errors of the pocket laws."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import erf

from generate.boundary_elements.design import TRAINING
from generate.boundary_elements.evidence import MIN_WAVES
from generate.formulas.printing import MODULE, latex_steps, read_functions
from generate.pages.page import Measured, evidence, table
from mbma_tables.common.arguments import FloatArray
from mbma_tables.models.closed_form_functions import CERTIFICATES, RANGES

SHOWN = ("pocket", "standard", "totals")
POCKET_AREAS = (0.01, 0.97)  # contact fractions at which the pocket laws are compared with simulations


def pocket_area(pressure: FloatArray, alpha: float) -> FloatArray:
    """A/A0 at p/(E* g): the area law of the README."""
    t = pressure / 0.33
    s = (0.51 + 0.033 * math.log(alpha / 10) + t) / (1 + t)
    return np.asarray(erf(pressure * np.sqrt(2 / s)))


def pocket_pressure(u: FloatArray, nu: float) -> FloatArray:
    """p/(E* q0 h_rms) at u/h_rms: the law of separation of the README, by the spectrum's narrowness."""
    return np.asarray(u**-0.26 * np.exp(-1.91 * u - 2.8 * (nu - 0.63)))


def pocket_errors() -> tuple[dict[str, tuple[float, ...]], int]:
    """Median, 90% quantile and largest error [%] of both laws on held-out surfaces, and the number of surfaces."""
    seen = [o for o in evidence() if o.split != TRAINING and o.kind == "self_affine" and o.waves >= MIN_WAVES]
    area, pressure = [], []
    for one in seen:
        inside = (one.area >= POCKET_AREAS[0]) & (one.area <= POCKET_AREAS[1])
        spectrum, force = one.spectrum, one.force[inside]
        area.append(pocket_area(force, float(spectrum.alpha)) / one.area[inside] - 1)
        law = pocket_pressure(one.u[inside], float(spectrum.narrowness)) / float(spectrum.gradient)
        pressure.append(law / force - 1)
    found = {"area at given pressure": area, "pressure at given separation": pressure}
    shares = (0.5, 0.9, 1.0)
    return {k: tuple(100 * np.quantile(np.abs(np.concatenate(v)), shares)) for k, v in found.items()}, len(seen)


def pocket_laws() -> str:
    """The same as a table."""
    found, count = pocket_errors()
    rows = [[what, *(f"{error:.2g}%" for error in errors), str(count)] for what, errors in found.items()]
    return table(("pocket law", "median error", "90% of errors below", "largest", "surfaces"), rows)


def measure() -> Measured:
    """Certificates, ranges and equations of the closed forms."""
    rows = []
    for form, results in CERTIFICATES.items():
        for result, found in results.items():
            worst = ", ".join(f"{name} = {value:g}" for name, value in found.worst_at.items())
            rows.append([form, result, str(found.coefficients), f"{found.largest:g}", f"{found.median:.2g}", worst])
    ranges = [
        f"- {form}: {', '.join(f'`{low:g} <= {name} <= {high:g}`' for name, (low, high) in limits.items())}"
        for form, limits in RANGES.items()
    ]
    functions = read_functions(MODULE.read_text(encoding="utf-8")).values()
    # steps that functions of a form share are printed once
    steps = {
        form: dict.fromkeys(line for function in functions if function.form == form for line in latex_steps(function))
        for form in SHOWN
    }
    header = ("form", "function", "coefficients", "largest error", "median", "worst at")
    parts = {"laws": pocket_laws(), "certificates": table(header, rows), "ranges": "\n".join(ranges)}
    return parts | {form: "\n\n".join(f"$${line}$$" for line in lines) for form, lines in steps.items()}, {}
