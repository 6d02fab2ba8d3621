"""docs/stability.md: corners of parameter space, counted and drawn.

The reference is mpmath at 40 digits or more where a closed form exists, else the exact solver at a tighter tolerance.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import mpmath as mp
import numpy as np

from generate.pages import islands as another_program
from generate.pages.page import Measured, panels, svg, table
from generate.tables.exact_geometry import DOUBLES, divisor, exact_island
from mbma_tables import Surface, contact, greenwood_tripp
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import MbmaError
from mbma_tables.islands.geometry import geometry
from mbma_tables.models import answer_islands
from mbma_tables.models.named import get_model
from mbma_tables.surfaces.variants import Variant, get_variant
from mbma_tables.totals.island_sum import kinks

DIGITS = 40
ULP = np.finfo(float).eps

MIN_ERROR, MAX_ERROR = 1e-16, 1e0  # of the colour scale

# islands
X_CORNERS = np.concatenate([-np.geomspace(40, 0.5, 9), [0.0], np.geomspace(0.5, 1e4, 19)])
MU_CORNERS = np.concatenate([[0.0], 10.0 ** np.array([-300, -200, -100, -30, -16]), np.geomspace(1e-12, 1e12, 25)])
RIGID_MU = 1e-13  # below it mu Q is less than 1e-9 up to X = 1e4
SOLVED, ISLAND_TRUTH = 1e-9, 1e-11
ISLAND_MODELS = ("exact", "universal", "formula", "rigid")

# geometry
APPROACHES = np.geomspace(1e-12, 30, 44)
BANDS = np.concatenate([[3.0000001, 3.001], np.geomspace(3.1, 1e8, 30)])
HURSTS = (0.05, 0.3, 0.5, 0.8, 1 - ULP / 2, 1.0)
MAP_HURST = 0.8
FIELDS = ("X", "mu", "eta", "D_d", "sigma_d", "R_u")

# totals
DEPTHS = (1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 3.0, 6.0)  # h_max - d
TOTAL_BANDS = (3.0000001, 3.1, 10.0, 216.0, 1e4, 1e6, 1e8)
TOTAL_HURSTS = (0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 1 - ULP / 2, 1.0)
TOP = 3.0
TOTAL_TRUTH = 1e-10

Answer = tuple[Sequence[Any], float]  # values, and a bound on their relative error


@dataclasses.dataclass
class Tally:
    """The outcome at some corners: how many were refused or without a number, and the largest error of the rest."""

    name: str
    tried: int = 0
    refused: int = 0
    not_finite: int = 0
    warned: int = 0
    beyond: int = 0
    largest: float = 0.0

    def add(self, answer: Callable[[], Answer], truth: Sequence[Any] | None) -> float:
        """Evaluate one corner; its error, NaN where it was refused, has no number, or its truth is not known."""
        self.tried += 1
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                values, bound = answer()
            except MbmaError:
                self.refused += 1
                return math.nan
            except (ArithmeticError, ValueError):
                values, bound = [math.nan], math.inf
        self.warned += len(caught)
        if not all(math.isfinite(value) for value in values):
            self.not_finite += 1
            return math.nan
        if truth is None:
            return math.nan
        error = max(relative_error(value, exact) for value, exact in zip(values, truth, strict=True))
        self.largest = max(self.largest, error)
        self.beyond += error > bound
        return error


def relative_error(found: float, truth: Any) -> float:
    """Relative error; zero where both underflow."""
    if abs(float(truth)) < 1e-300:
        return 0.0 if abs(found) < 1e-290 else math.inf
    return abs(float(found / truth - 1))


def rigid_truth(X: float) -> tuple[mp.mpf, mp.mpf]:
    """(pi/5) F_{5/2}(-X) and (pi/2) F_2(-X) by mpmath: parabolic cylinder functions."""
    with mp.workdps(DIGITS):
        x = -mp.mpf(float(X))
        # F_n(x) = Gamma(n + 1) exp(-x^2/4) U(n + 1/2, x)/sqrt(2 pi)
        force, area = (
            mp.gamma(n + 1) * mp.exp(-x * x / 4) * mp.pcfu(n + mp.mpf(1) / 2, x) / mp.sqrt(2 * mp.pi)
            for n in (mp.mpf(5) / 2, mp.mpf(2))
        )
        return mp.pi / 5 * force, mp.pi / 2 * area


def island_truth(X: float, mu: float) -> tuple[Any, Any] | None:
    """Phi_F and Phi_A, or None where the solver refuses."""
    if mu <= RIGID_MU:
        force, area = rigid_truth(X)
        return force * mp.mpf(float(mu)), area
    try:
        solved = greenwood_tripp.solve(X, mu, rtol=ISLAND_TRUTH)
    except MbmaError:
        return None
    return solved.phi_F, solved.phi_A


def islands() -> tuple[list[Tally], dict[str, FloatArray]]:
    """Every island model at every corner of (X, mu); maps of the larger error of both functions, NaN where refused."""
    tallies = {island_model: Tally(f"islands by {island_model}") for island_model in ISLAND_MODELS}
    models = {
        island_model: get_model(island_model, 10 * SOLVED, get_variant("reported")) for island_model in ISLAND_MODELS
    }
    maps = {island_model: np.full((X_CORNERS.size, MU_CORNERS.size), np.nan) for island_model in ISLAND_MODELS}

    def ask(model: Any, X: float, mu: float) -> Answer:
        found = answer_islands(model, {"X": np.array([X]), "mu": np.array([mu])})
        return (float(found.phi_F[0]), float(found.phi_A[0])), float(found.error[0]) + ISLAND_TRUTH + 1e-14

    for (i, X), (j, mu) in itertools.product(enumerate(X_CORNERS), enumerate(MU_CORNERS)):
        truth = island_truth(X, mu)
        for island_model, model in models.items():
            # rigid spheres do not claim to be elastic ones
            maps[island_model][i, j] = tallies[island_model].add(
                functools.partial(ask, model, X, mu), None if island_model == "rigid" else truth
            )
    return list(tallies.values()), maps


def _approaches(hurst: float, zeta_1: float, variant: Variant) -> Iterator[float]:
    """Values of delta/h_rms: those of the map, then one ulp around the floors of zeta_d and zeta_u."""
    yield from map(float, APPROACHES)
    yield from (float(kink) * (1 + side * ULP) for kink in kinks(hurst, zeta_1, variant) for side in (-1, 0, 1))


def island_geometry() -> tuple[list[Tally], dict[str, FloatArray]]:
    """Geometry by the library and by the paper's formulas as printed, against 60 digits."""
    maps = {name: np.full((APPROACHES.size, BANDS.size), np.nan) for name in ("library", "direct")}
    tallies = {"library": Tally("geometry, library"), "direct": Tally("geometry, the paper's formulas as printed")}

    def library(approach: float, hurst: float, zeta_1: float, variant: str) -> Answer:
        found = geometry(np.array([approach]), np.array([hurst]), np.array([zeta_1]), get_variant(variant))
        return [float(found[name][0]) for name in FIELDS], math.inf

    def direct(approach: float, hurst: float, zeta_1: float, variant: str) -> Answer:
        found = exact_island(approach, hurst, zeta_1, float(divisor(variant)), DOUBLES)
        return [found[name] for name in FIELDS], math.inf

    for hurst, variant, (j, zeta_1) in itertools.product(HURSTS, ("reported", "printed"), enumerate(map(float, BANDS))):
        for i, approach in enumerate(_approaches(hurst, zeta_1, get_variant(variant))):
            exact = exact_island(approach, hurst, zeta_1, divisor(variant))
            for name, way in (("library", library), ("direct", direct)):
                error = tallies[name].add(
                    functools.partial(way, approach, hurst, zeta_1, variant), [exact[field] for field in FIELDS]
                )
                if hurst == MAP_HURST and variant == "reported" and i < APPROACHES.size:
                    maps[name][i, j] = error
    return list(tallies.values()), maps


def totals() -> list[Tally]:
    """Totals of every island model at corners of surfaces and gaps, both variants, against the exact one at 1e-10."""
    tallies = {island_model: Tally(f"totals by {island_model}") for island_model in (*ISLAND_MODELS, "island4d")}

    def ask(surface: Surface, depth: float, island_model: str, variant: str, rtol: float) -> Answer:
        found = contact(surface, separation=TOP - depth, island_model=island_model, variant=variant, rtol=rtol)
        return (float(found.pressure), float(found.area)), float(found.error) + TOTAL_TRUTH

    for variant, hurst, zeta_1, depth in itertools.product(("reported", "printed"), TOTAL_HURSTS, TOTAL_BANDS, DEPTHS):
        surface = Surface(hurst, 1.0, zeta_1, 1.0, TOP)
        try:
            truth = ask(surface, depth, "exact", variant, TOTAL_TRUTH)[0]
        except MbmaError:
            truth = None
        for island_model, tally in tallies.items():
            # the four-number table is of one variant
            if island_model != "island4d" or variant == "reported":
                tally.add(
                    functools.partial(ask, surface, depth, island_model, variant, 1e-8),
                    None if island_model == "rigid" else truth,
                )
    return list(tallies.values())


def draw(geometry_maps: dict[str, FloatArray], island_maps: dict[str, FloatArray]) -> bytes:
    """Maps of error: geometry by the paper's formulas as printed and by the library, and islands."""
    from matplotlib import colormaps, colors

    figure, axes = panels(2, 2, (10, 8))
    colormap = colormaps["viridis"].with_extremes(bad="white")
    style = {"norm": colors.LogNorm(MIN_ERROR, MAX_ERROR), "cmap": colormap, "shading": "nearest", "rasterized": True}
    places = np.arange(MU_CORNERS.size), np.arange(X_CORNERS.size)
    for panel, name, title in zip(
        axes[0], ("direct", "library"), ("the paper's formulas as printed", "the library"), strict=True
    ):
        panel.pcolormesh(BANDS, APPROACHES, np.maximum(geometry_maps[name], MIN_ERROR), **style)
        panel.set(xscale="log", yscale="log", xlabel="zeta_1", ylabel="delta/h_rms", title=f"geometry: {title}")
    for panel, island_model in zip(axes[1], ("exact", "universal"), strict=True):
        mesh = panel.pcolormesh(*places, np.maximum(island_maps[island_model], MIN_ERROR), **style)
        panel.set(xlabel="mu", ylabel="X", title=f"islands: island model {island_model} (white: refused)")
        panel.set_xticks(places[0][::4], [f"{mu:.0e}" for mu in MU_CORNERS[::4]], rotation=45)
        panel.set_yticks(places[1][::4], [f"{X:.3g}" for X in X_CORNERS[::4]])
    figure.colorbar(mesh, ax=axes, label="largest relative error")
    return svg(figure)


def corners(tallies: Sequence[Tally]) -> str:
    """The table of all corners."""
    header = ["corners", "tried", "refused", "not finite", "warnings", "largest error of answers", "beyond their bound"]
    rows = []
    for tally in tallies:
        largest = "-" if "rigid" in tally.name else f"{tally.largest:.1e}"
        counts = (tally.tried, tally.refused, tally.not_finite, tally.warned)
        rows.append([tally.name, *map(str, counts), largest, str(tally.beyond)])
    return table(header, rows)


def measure() -> Measured:
    """The measured blocks of the page, and its figures."""
    (island_tallies, island_maps), (geometry_tallies, geometry_maps) = islands(), island_geometry()
    parts, files = another_program.measure()
    parts |= {"corners": corners([*island_tallies, *geometry_tallies, *totals()])}
    return parts, files | {"docs/figures/stability.svg": draw(geometry_maps, island_maps)}
