"""docs/stability.md: corners of parameter space, counted and drawn.

The reference is mpmath at 40 digits or more where a closed form exists, else the exact
solver at a tighter tolerance.
"""

import functools
import itertools
import math
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import mpmath as mp
import numpy as np
from matplotlib.colors import LogNorm

from generate.page import Measured, panels, table
from generate.tables.exact_geometry import DOUBLES, divisor, exact_island
from generate.tables.height_coefficients import height_integral
from mbma_tables import Surface, contact, greenwood_tripp
from mbma_tables.common.errors import MbmaError
from mbma_tables.theories import Mbma
from mbma_tables.theories.mbma.geometry import geometry, kinks
from mbma_tables.theories.mbma.island_models import answer_islands
from mbma_tables.theories.mbma.tables import get_model
from mbma_tables.theories.mbma.variants import get_variant

ULP = np.finfo(float).eps
ISLAND_MODELS, VARIANTS = (
    ("exact", "universal", "formula", "rigid"),
    ("reported", "printed"),
)

# islands
X_CORNERS = np.concatenate([-np.geomspace(40, 0.5, 9), [0.0], np.geomspace(0.5, 1e4, 19)])
MU_CORNERS = np.concatenate(
    [[0.0], 10.0 ** np.array([-300, -200, -100, -30, -16]), np.geomspace(1e-12, 1e12, 25)]
)
RIGID_MU = 1e-13  # below it mu Q is less than 1e-9 up to X = 1e4
SOLVED, ISLAND_TRUTH = 1e-9, 1e-11

# geometry; corners of the maps first
APPROACHES = np.geomspace(1e-12, 30, 44)
BANDS = np.concatenate([[3.0000001, 3.001], np.geomspace(3.1, 1e8, 30)])
HURSTS, MAPPED = (0.05, 0.3, 0.5, 0.8, 1 - ULP / 2, 1.0), (0.8, "reported")
FIELDS = ("X", "mu", "eta", "D_d", "sigma_d", "R_u")

# totals
DEPTHS = (1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 3.0, 6.0)  # h_max - d
TOTAL_BANDS = (3.0000001, 3.1, 10.0, 216.0, 1e4, 1e6, 1e8)
TOTAL_HURSTS = (0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 1 - ULP / 2, 1.0)
TOP, TOTAL_TRUTH = 3.0, 1e-10

Way = Callable[
    ..., tuple[Sequence[Any], float]
]  # values, and a bound on their relative error


class Outcome(NamedTuple):
    """What one answer is: its error is NaN where it was refused, has no number, or its truth is not known."""

    refused: bool = False
    not_finite: bool = False
    warned: int = 0
    error: float = math.nan
    beyond: bool = False


def relative_error(found: float, truth: Any) -> float:
    """Zero where both underflow."""
    if abs(float(truth)) < 1e-300:
        return 0.0 if abs(found) < 1e-290 else math.inf
    return abs(float(found / truth - 1))


def outcome(
    answer: Callable[[], tuple[Sequence[Any], float]], truth: Sequence[Any] | None
) -> Outcome:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            values, bound = answer()
        except MbmaError:
            return Outcome(refused=True)
        except (ArithmeticError, ValueError):
            values, bound = [math.nan], math.inf
    finite = bool(np.isfinite(np.array(values, float)).all())
    if truth is None or not finite:
        return Outcome(not_finite=not finite, warned=len(caught))
    error = max(map(relative_error, values, truth))
    return Outcome(warned=len(caught), error=error, beyond=error > bound)


def counted(
    ways: Mapping[str, Way],
    corners: Iterable[tuple[Any, ...]],
    truth: Callable[..., Sequence[Any]],
) -> dict[str, list[Outcome]]:
    """Every way at every corner; rigid spheres do not claim to be elastic ones, and have no truth."""
    found: dict[str, list[Outcome]] = {name: [] for name in ways}
    for corner in corners:
        try:
            exact: Sequence[Any] | None = truth(*corner)
        except MbmaError:
            exact = None
        for name, way in ways.items():
            known = None if name.endswith("rigid") else exact
            found[name].append(outcome(functools.partial(way, *corner), known))
    return found


def islands() -> dict[str, list[Outcome]]:

    def ask(name: str, X: float, mu: float) -> tuple[Sequence[Any], float]:
        model = get_model(name, 10 * SOLVED, get_variant("reported"))
        found = answer_islands(model, {"X": np.array([X]), "mu": np.array([mu])})
        return (float(found.phi_F[0]), float(found.phi_A[0])), float(
            found.error[0]
        ) + ISLAND_TRUTH + 1e-14

    def truth(X: float, mu: float) -> Sequence[Any]:
        if mu > RIGID_MU:
            solved = greenwood_tripp.solve(X, mu, rtol=ISLAND_TRUTH)
            return solved.phi_F, solved.phi_A
        with mp.workdps(40):
            # of a rigid sphere, by parabolic cylinder functions
            force, area = (
                height_integral(mp.mpf(n), -mp.mpf(float(X))) for n in (2.5, 2)
            )
            return mp.pi / 5 * force * mp.mpf(float(mu)), mp.pi / 2 * area

    ways = {f"islands by {name}": functools.partial(ask, name) for name in ISLAND_MODELS}
    return counted(ways, itertools.product(X_CORNERS, MU_CORNERS), truth)


def island_geometry() -> dict[str, list[Outcome]]:
    """Geometry by the library and by the paper's formulas as printed, against 60 digits."""

    def library(
        approach: float, zeta_1: float, hurst: float, variant: str
    ) -> tuple[Sequence[Any], float]:
        found = geometry(
            np.array([approach]),
            np.array([hurst]),
            np.array([zeta_1]),
            get_variant(variant),
        )
        return [float(found[name][0]) for name in FIELDS], math.inf

    def exact(
        approach: float, zeta_1: float, hurst: float, variant: str, *arithmetic: Any
    ) -> Sequence[Any]:
        density = float(divisor(variant)) if arithmetic else divisor(variant)
        found = exact_island(approach, hurst, zeta_1, density, *arithmetic)
        return [found[name] for name in FIELDS]

    others = [own for own in itertools.product(HURSTS, VARIANTS) if own != MAPPED]
    corners = [
        (*place, *own)
        for own in (MAPPED, *others)
        for place in itertools.product(APPROACHES, BANDS)
    ]
    for zeta_1, (hurst, variant) in itertools.product(
        map(float, BANDS), (MAPPED, *others)
    ):
        # one ulp around the floors of zeta_d and zeta_u
        floors = itertools.product(
            map(float, kinks(hurst, zeta_1, get_variant(variant))), (-1, 0, 1)
        )
        corners += [
            (kink * (1 + side * ULP), zeta_1, hurst, variant) for kink, side in floors
        ]
    ways: dict[str, Way] = {"geometry, library": library}
    ways["geometry, the paper's formulas as printed"] = lambda *corner: (
        exact(*corner, DOUBLES),
        math.inf,
    )
    return counted(ways, corners, exact)


def totals() -> dict[str, list[Outcome]]:
    """Totals of every island model at corners of surfaces and gaps, both variants, against the exact one at 1e-10."""

    def ask(
        name: str,
        variant: str,
        hurst: float,
        zeta_1: float,
        depth: float,
        rtol: float = 1e-8,
    ) -> Any:
        surface = Surface(hurst, 1.0, zeta_1, 1.0, TOP)
        found = contact(
            surface,
            separation=TOP - depth,
            theory=Mbma(island_model=name, variant=variant, rtol=rtol),
        )
        return (float(found.pressure), float(found.area)), float(
            found.error
        ) + TOTAL_TRUTH

    exact, found = (
        functools.partial(ask, "exact", rtol=TOTAL_TRUTH),
        dict[str, list[Outcome]](),
    )
    # the four-number table is of one variant
    for names, variants in ((ISLAND_MODELS, VARIANTS), (["island4d"], VARIANTS[:1])):
        ways = {f"totals by {name}": functools.partial(ask, name) for name in names}
        corners = itertools.product(variants, TOTAL_HURSTS, TOTAL_BANDS, DEPTHS)
        found |= counted(ways, corners, lambda *corner: exact(*corner)[0])
    return found


def draw(found: Mapping[str, Sequence[Outcome]]) -> Any:
    """Maps of error: geometry by the paper's formulas as printed and by the library."""
    figure, axes = panels(1, 2, (10, 4.2), sharey=True)
    for panel, name in zip(
        axes,
        ("geometry, the paper's formulas as printed", "geometry, library"),
        strict=True,
    ):
        errors = np.array(
            [one.error for one in found[name][: APPROACHES.size * BANDS.size]]
        )
        errors = np.maximum(errors, 1e-16).reshape(APPROACHES.size, BANDS.size)
        mesh = panel.pcolormesh(
            BANDS,
            APPROACHES,
            errors,
            norm=LogNorm(1e-16, 1.0),
            shading="nearest",
            rasterized=True,
        )
        panel.set(xscale="log", yscale="log", xlabel="zeta_1", title=name)
    axes[0].set_ylabel("delta/h_rms")
    figure.colorbar(mesh, ax=axes, label="largest relative error")
    return figure


def row(name: str, outcomes: Sequence[Outcome]) -> list[Any]:
    """Sums over corners, and the largest error where one was compared."""
    refused, not_finite, warned, errors, beyond = zip(*outcomes, strict=True)
    largest = max((error for error in errors if not math.isnan(error)), default=math.nan)
    return [
        name,
        len(outcomes),
        sum(refused),
        sum(not_finite),
        sum(warned),
        largest,
        sum(beyond),
    ]


def measure() -> Measured:
    found = islands() | island_geometry() | totals()
    header = "corners | tried | refused | not finite | warnings | largest error of answers | beyond their bound"
    text = table(
        header,
        itertools.starmap(row, found.items()),
        "{} | {} | {} | {} | {} | {:.1e} | {}",
    )
    return {"corners": text.replace("—", "-")}, {
        "docs/figures/stability.svg": draw(found)
    }
