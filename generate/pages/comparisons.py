"""What the page on fidelity compares: theories at given loads, gaps and areas, and reference data of brute force."""

from __future__ import annotations

import dataclasses
import functools
import pathlib
from typing import Any

import numpy as np

from mbma_tables import Surface, contact, theories
from mbma_tables.arguments import FloatArray

DATA = pathlib.Path(__file__).parents[2] / "docs" / "data"
READINGS = {"MBMA reported": "reported", "MBMA printed": "printed"}
PERSSON: dict[str, theories.Method] = {"Persson full": "full", "Persson simplified": "simplified"}
THEORIES = (*READINGS, "G-W", *PERSSON)
AREA_THEORIES = (*READINGS, "G-W", "Persson")  # (18) is Persson's area in full and simplified alike
GAPS = 60  # a curve
RTOL = 1e-6  # of each of its points
CORRECTIONS = 3  # after which a solution no longer depends on the interpolation


@dataclasses.dataclass(frozen=True)
class Reference:
    """A data set made by brute force, and the surface that it is compared with."""

    file: str
    title: str
    zeta_1: float
    gradient: float
    h_max: float
    band: tuple[float, float]  # A/A0

    def surface(self, h_max: float | None = None) -> Surface:
        """The self-affine surface (H = 0.8) of the data's rms gradient."""
        unit = Surface(0.8, 1.0, self.zeta_1, 1.0, 1.0)
        h_rms = self.gradient / unit.rms_gradient
        return Surface(0.8, 1.0, self.zeta_1, h_rms, (h_max or self.h_max) * h_rms)

    def column(self, name: str) -> FloatArray:
        """One column of the data file."""
        text = (DATA / self.file).read_text(encoding="utf-8")
        lines = [line for line in text.splitlines() if not line.startswith("#")]
        table = np.genfromtxt(lines, delimiter=",", names=True)
        return np.atleast_1d(np.asarray(table[name], dtype=float))


REFERENCES = {
    "bem": Reference("bem_hurst0.8_zeta64.csv", "Boundary elements", 64, 1.0, 3.3973, (0.002, 0.12)),
    "gfmd": Reference("gfmd_hurst0.8_zeta100.csv", "Molecular dynamics", 100, 0.2766, 3.4, (0.002, 0.08)),
    "challenge": Reference("challenge.csv", "Contact-mechanics challenge", 200, 1.0, 3.45, (0.002, 0.12)),
}


def evaluate(surface: Surface, theory: str, gap: Any) -> tuple[Any, Any]:
    """F/(A0 E*) and A/A0 of a theory that answers at a separation d."""
    if theory in READINGS:
        found = contact(surface, gap, tier="exact", reading=READINGS[theory], rtol=RTOL)
        return found.force, found.area
    summits = theories.greenwood_williamson(surface, gap)
    return summits.force, summits.area


def start(surface: Surface, theory: str) -> Any:
    """Separation d at which contact starts; G-W's Gaussian has no end, and three more h_rms are sampled."""
    return surface.h_max + (0.0 if theory in READINGS else 3 * surface.h_rms)


@functools.cache
def sample(surface: Surface, theory: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Separation, force and area from first contact to full compression, geometrically spaced."""
    first = start(surface, theory)
    gap = first - (first + surface.h_max) * np.geomspace(0.005, 1, GAPS)
    gap[-1] = -surface.h_max
    return gap, *evaluate(surface, theory, gap)


def solve(surface: Surface, theory: str, kind: str, wanted: Any) -> tuple[FloatArray, FloatArray]:
    """Force and area where the force (or the area) is as wanted; NaN where the theory does not reach it."""
    from scipy.interpolate import CubicSpline
    from scipy.special import erfinv

    targets = np.atleast_1d(np.asarray(wanted, dtype=float))
    which = ("force", "area").index(kind)
    if theory == "Persson":
        if kind == "force":
            return targets, theories.persson_area(surface, targets)
        return np.sqrt(surface.m2) * erfinv(targets), targets
    gap, *columns = sample(surface, theory)
    first = start(surface, theory)
    falls = np.flatnonzero(np.diff(columns[which]) <= 0)
    branch = slice(None, falls[0] + 1 if falls.size else None)  # the branch of first contact
    known = columns[which][branch]
    reached = (targets >= known[0]) & (targets <= known[-1])
    result = np.full((2, targets.size), np.nan)
    if reached.any():
        log_depth = CubicSpline(np.log(known), np.log(first - gap[branch]))
        goal = np.log(targets[reached])
        x = log_depth(goal)
        smallest = gap[branch][-1]
        for _ in range(CORRECTIONS):
            pair = evaluate(surface, theory, np.maximum(first - np.exp(x), smallest))
            x = x + (goal - np.log(pair[which])) * log_depth(goal, 1)
        result[:, reached] = evaluate(surface, theory, np.maximum(first - np.exp(x), smallest))
    return result[0], result[1]


def force_at(surface: Surface, theory: str, ratio: Any) -> Any:
    """F/(A0 E*) at mean separations u = ratio * h_rms; NaN where the theory has none."""
    u = np.asarray(ratio, dtype=float) * surface.h_rms
    if theory == "G-W":
        return np.asarray(evaluate(surface, theory, theories.separation(surface, u))[0])
    if theory in READINGS:
        result, some = np.zeros(u.shape), u < surface.h_max
        if some.any():
            result[some] = evaluate(surface, theory, theories.separation(surface, u[some]))[0]
        return result
    # at u = 0 the full form needs an infinite load
    result, some = np.full(u.shape, np.nan), (u > 0) | (PERSSON[theory] == "simplified")
    if some.any():
        result[some] = theories.persson_force(surface, u[some], method=PERSSON[theory])
    return result


def kappa(surface: Surface, theory: str, area: Any) -> FloatArray:
    """A/F sqrt(2 m2) E*, Eq. (51), at the contact areas A/A0."""
    force, reached = solve(surface, theory, "area", area)
    return np.asarray(reached / force * surface.rms_gradient)


def area_ratios(reference: Reference, surface: Surface) -> dict[str, FloatArray]:
    """Area over the data's area at the data's forces."""
    force, area = reference.column("force"), reference.column("area")
    return {t: solve(surface, t, "force", force)[1] / area for t in AREA_THEORIES}


def force_ratios(reference: Reference, surface: Surface) -> dict[str, FloatArray]:
    """Force over the data's force at the data's separations over h_rms."""
    force, u = reference.column("force"), reference.column("mean_separation_over_h_rms")
    return {t: force_at(surface, t, u) / force for t in THEORIES}
