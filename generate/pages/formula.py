"""The measured parts of docs/formula.md: closed forms with their certificates."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from scipy.special import erf

from generate.boundary_elements.design import TRAINING
from generate.boundary_elements.evidence import MIN_WAVES, cases
from generate.formulas.printing import MODULE, latex_steps, read_functions
from generate.pages.page import ROOT, table
from mbma_tables.arguments import FloatArray
from mbma_tables.models.closed_form_functions import CERTIFICATES, RANGES

SHOWN = ("pocket", "standard", "totals")
POCKET_AREAS = (0.01, 0.97)  # contact fractions at which the pocket laws are held to simulations
HEADER = ("form", "function", "coefficients", "largest error", "median", "worst at")


def certificates() -> str:
    """What each function's certificate states."""
    rows = []
    for form, results in CERTIFICATES.items():
        for result, found in results.items():
            worst = ", ".join(f"{name} = {value:g}" for name, value in found.worst_at.items())
            rows.append([form, result, str(found.coefficients), f"{found.largest:g}", f"{found.median:.2g}", worst])
    return table(HEADER, rows)


def ranges() -> str:
    """Where each form holds."""
    return "\n".join(
        f"- {form}: {', '.join(f'`{low:g} <= {name} <= {high:g}`' for name, (low, high) in found.items())}"
        for form, found in RANGES.items()
    )


def equations(form: str) -> str:
    """The equations of a form, steps that its functions share once."""
    functions = read_functions(MODULE.read_text(encoding="utf-8"))
    lines = [line for function in functions.values() if function.form == form for line in latex_steps(function)]
    return "\n\n".join(f"$${line}$$" for line in dict.fromkeys(lines))


def pocket_area(pressure: FloatArray, alpha: float) -> FloatArray:
    """A/A0 at p/(E* g): the area law of the README."""
    t = pressure / 0.33
    s = (0.51 + 0.033 * math.log(alpha / 10) + t) / (1 + t)
    return np.asarray(erf(pressure * np.sqrt(2 / s)))


def pocket_pressure(u: FloatArray, nu: float) -> FloatArray:
    """p/(E* q0 h_rms) at u/h_rms: the law of separation of the README, by the spectrum's narrowness."""
    return np.asarray(u**-0.26 * np.exp(-1.91 * u - 2.8 * (nu - 0.63)))


def pocket_errors() -> tuple[dict[str, tuple[float, ...]], int]:
    """Median, nine in ten and largest error [%] of both on surfaces that they were not fitted to, and how many."""
    seen = [
        one
        for one in cases(xr.open_dataset(ROOT / "docs" / "data" / "boundary_elements.nc"))
        if one.split != TRAINING and one.kind == "self_affine" and one.waves >= MIN_WAVES
    ]
    area, pressure = [], []
    for one in seen:
        inside = (one.area >= POCKET_AREAS[0]) & (one.area <= POCKET_AREAS[1])
        spectrum, force = one.spectrum, one.force[inside]
        area.append(pocket_area(force, float(spectrum.alpha)) / one.area[inside] - 1)
        law = pocket_pressure(one.u[inside], float(spectrum.narrowness)) / float(spectrum.gradient)
        pressure.append(law / force - 1)
    told = {"area at a pressure": area, "pressure at a separation": pressure}
    shares = (0.5, 0.9, 1.0)
    return {k: tuple(100 * np.quantile(np.abs(np.concatenate(v)), shares)) for k, v in told.items()}, len(seen)


def pocket_laws() -> str:
    """The same as a table."""
    told, count = pocket_errors()
    rows = [[what, *(f"{error:.2g}%" for error in errors), str(count)] for what, errors in told.items()]
    return table(("pocket law", "half of errors below", "nine in ten", "largest", "surfaces"), rows)


def measure() -> tuple[dict[str, str], dict[str, bytes]]:
    """The measured parts of the page."""
    return {"laws": pocket_laws(), "certificates": certificates(), "ranges": ranges()} | {
        form: equations(form) for form in SHOWN
    }, {}
