"""Conformance points beside exported code, which its self-test replays.

A row of the points' file is: kind, tolerance, arguments, then for each answer the answer and what its difference is
taken relative to. Lines that begin with # say what the kinds are.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.export.c_code import FORM
from mbma_tables.export.text import comment
from mbma_tables.islands.geometry import FIELDS, geometry
from mbma_tables.models.closed_form_functions import RANGES
from mbma_tables.models.closed_forms import FUNCTIONS
from mbma_tables.models.universal import UniversalModel
from mbma_tables.surfaces.readings import Reading
from mbma_tables.surfaces.surface import Surface
from mbma_tables.theories.contact import contact
from mbma_tables.theories.result import Contact

POINTS_FILE = "mbma_conformance.csv"
BY = ("separation", "hurst", "q0", "q1", "h_rms", "h_max")
KINDS = {
    "phi": "X, mu; phi_F, phi_A, the bound on their error",
    "slopes": "X, mu; phi_F by X, phi_F by mu, phi_A by X, phi_A by mu, relative to themselves or |phi/argument|",
    "geometry": f"approach, hurst, zeta_1; {', '.join(FIELDS)}",
    "total": "hurst, q0, q1, h_rms, h_max, separation, E_star, rtol; force, area, stiffness",
    "total_by": f"the same; derivatives of force, then of area, by {', '.join(BY)}",
    "status": "X, mu; the status",
    "formula": "X, mu; phi_F, phi_A by the closed form",
    "calibrated": "hurst, q0, q1, h_rms, h_max, mean separation, E_star; force, area, stiffness, mean separation at it",
    "calibrated_by": "the same; derivatives of force, then of area, by mean separation, hurst, q0, q1, h_rms, h_max",
}
TOLERANCE, SLOPE_TOLERANCE = 1e-11, 1e-8
OK, X_BELOW, X_ABOVE, MU_ABOVE, INVALID = 0, 1, 2, 3, 5  # of mbma.h
SURFACES = (
    # hurst, q0, q1, h_rms, h_max
    (0.8, 1.0, 1e2, 1.0, 3.5),
    (0.3, 2e3, 5e7, 2e-5, 1e-4),
    (1.0, 0.01, 3.0, 4.0, 12.0),
)
DEPTHS = (0.05, 0.3, 0.8, 1.4)  # (h_max - d)/h_max
SHARES = (0.02, 0.3, 0.7, 0.99)  # u/h_max
RTOL = 1e-8


def row(
    kind: str,
    arguments: Iterable[float],
    answers: Iterable[float],
    scales: Iterable[float],
    tolerance: float = TOLERANCE,
) -> str:
    """One line of the points' file."""
    pairs = (number for pair in zip(answers, scales, strict=True) for number in pair)
    return ",".join((kind, *(repr(float(number)) for number in (tolerance, *arguments, *pairs))))


def phi_rows(model: UniversalModel, X: FloatArray, mu: FloatArray) -> Iterator[str]:
    """Values and slopes at flat (X, mu), mu > 0, by the compiled runtime."""
    answer = model.answer(X, mu)
    values = np.stack([answer.phi_F, answer.phi_A, answer.error])
    _, by_X, by_mu = model.slopes(X, mu)
    slopes = np.stack([by_X.phi_F, by_mu.phi_F, by_X.phi_A, by_mu.phi_A])
    # where a derivative changes sign there is nothing to be relative to but the value over the argument
    natural = np.abs(values[[0, 0, 1, 1]] / np.maximum([X, mu, X, mu], 1e-300))
    scales = np.maximum(np.abs(slopes), np.where(np.stack([X, mu, X, mu]) > 0, natural, 0.0))
    for k in range(X.size):
        yield row("phi", (X[k], mu[k]), values[:, k], np.abs(values[:, k]))
        yield row("slopes", (X[k], mu[k]), slopes[:, k], scales[:, k])


def geometry_rows(approach: FloatArray, hurst: FloatArray, zeta_1: FloatArray, reading: Reading) -> Iterator[str]:
    """Islands by the library."""
    fields = geometry(approach, hurst, zeta_1, reading)
    out = np.stack([fields[name] for name in FIELDS])
    for k in range(approach.size):
        # a height of exactly 0 is met exactly
        scales = np.where(out[:, k] == 0, 1.0, np.abs(out[:, k]))
        yield row("geometry", (approach[k], hurst[k], zeta_1[k]), out[:, k], scales)


def total_rows(surface: tuple[float, ...], separations: Any, reading: Reading, rtol: float = RTOL) -> Iterator[str]:
    """Totals of one surface and their derivatives by the compiled runtime."""
    gaps = np.asarray(separations)
    found = contact(Surface(*surface), gaps, reading=reading, rtol=rtol, derivatives=True)
    slopes = _slopes_of(found)
    values = np.array([found.force, found.area, -2 * slopes[0, 0]])
    # without contact all are exactly 0; at a maximum of force, stiffness is
    scales = np.where(values == 0, 1.0, np.abs(values))
    scales[2] = np.maximum(scales[2], scales[0] / surface[4])
    for k, gap in enumerate(gaps):
        given = (*surface, gap, 1.0, rtol)
        yield row("total", given, values[:, k], scales[:, k])
        yield _slopes_row("total_by", given, values[:2, k], slopes[:, :, k])


def calibrated_rows(surface: tuple[float, ...], shares: Any, E_star: float = 1.0) -> Iterator[str]:
    """The calibrated law of one surface at shares of h_max by the library, and its derivatives at given u."""
    u = surface[4] * np.asarray(shares)
    found = contact(Surface(*surface), mean_separation=u, theory="calibrated", E_star=E_star, derivatives=True)
    slopes = _slopes_of(found)
    slopes[:, 5] -= slopes[:, 0]  # h_max at given u = (h_max + d)/2
    slopes[:, 0] *= 2
    for k, *values in zip(range(u.size), *map(np.asarray, (found.force, found.area, found.stiffness, u)), strict=True):
        given = (*surface, u[k], E_star)
        yield row("calibrated", given, values, values)
        yield _slopes_row("calibrated_by", given, values[:2], slopes[:, :, k])


def _slopes_of(found: Contact) -> FloatArray:
    """Derivatives of force and area by `BY`."""
    return np.array([[slopes[name] for name in BY] for slopes in (found.force_by, found.area_by) if slopes])


def _slopes_row(kind: str, given: tuple[float, ...], values: Iterable[float], slopes: FloatArray) -> str:
    """Derivatives relative to themselves or the value over the parameter; by the gap over h_rms."""
    scales = np.maximum(np.abs(slopes), np.divide.outer(np.array(values), [given[3], *given[:5]]))
    return row(kind, given, slopes.ravel(), np.where(scales == 0, 1.0, scales).ravel(), SLOPE_TOLERANCE)


def status_rows(model: UniversalModel) -> Iterator[str]:
    """Points outside the table, and what is said of them."""
    X, mu = model.content.axes
    middle = 0.5 * (X.low + X.high)
    for place, status in (
        ((X.low, 1.0), OK),
        ((X.high, 1.0), OK),
        ((middle, mu.high), OK),
        ((middle, 0.0), OK),
        ((np.nextafter(X.low, -np.inf), 1.0), X_BELOW),
        ((np.nextafter(X.high, np.inf), 1.0), X_ABOVE),
        ((middle, np.nextafter(mu.high, np.inf)), MU_ABOVE),
        ((math.nan, 1.0), INVALID),
        ((middle, math.nan), INVALID),
        ((middle, -1e-300), INVALID),
    ):
        yield row("status", place, (status,), (1.0,))


def formula_rows(X: FloatArray, mu: FloatArray) -> Iterator[str]:
    """The closed form at those of some points that lie in its range."""
    functions, form = FUNCTIONS[FORM], RANGES[FORM]
    (X_low, X_high), (_, mu_high) = form["X"], form["mu"]
    inside = (np.clip(X, X_low, X_high) == X) & (mu <= mu_high)
    X, mu = X[inside], mu[inside]
    for *place, phi_F, phi_A in zip(X, mu, functions["phi_F"](X, mu), functions["phi_A"](X, mu), strict=True):
        yield row("formula", place, (phi_F, phi_A), (phi_F, phi_A))


def table_rows(model: UniversalModel) -> Iterator[str]:
    """The table's own conformance points, with the answers and tolerances that are stored in it."""
    points = model.content.conformance
    bound = model.answer(points["X"], points["mu"]).error
    for k in range(bound.size):
        answers = (points["table_F"][k], points["table_A"][k], bound[k])
        yield row("phi", (points["X"][k], points["mu"][k]), answers, answers, points["tolerance"][k])


def points_text(model: UniversalModel, reading: Reading) -> str:
    """The points' file: the table's own, and the runtime's slopes, islands, totals, refusals and calibrated law."""
    points = model.content.conformance
    head = [
        f"conformance points of the MBMA model, reading {reading.name}",
        f"data {model.content.attributes['values_sha256']}",
        "a row: kind, tolerance, arguments; then each answer and what its difference is taken relative to",
        *(f"{kind}: {meaning}" for kind, meaning in KINDS.items()),
    ]
    lines = [
        *table_rows(model),
        *(line for line in phi_rows(model, points["X"], points["mu"]) if line.startswith("slopes")),
        *status_rows(model),
        *formula_rows(points["X"], points["mu"]),
    ]
    for surface in SURFACES:
        zeta_1 = surface[2] / surface[1]
        if zeta_1 <= max(3.0, reading.floor_u):
            continue
        approach = np.geomspace(1e-3, 2 * surface[4] / surface[3], 8)
        lines += geometry_rows(approach, np.full(8, surface[0]), np.full(8, zeta_1), reading)
        lines += total_rows(surface, surface[4] * (1 - np.array(DEPTHS)), reading)
        lines += calibrated_rows(surface, SHARES)
    return comment(head, "#") + "\n".join(lines) + "\n"
