"""Hard cases of docs/guarantees.md: corners of parameter space, counted and drawn.

The reference is mpmath at 40 digits or more where a closed form exists, else the exact
solver at a tighter tolerance.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import math
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import mpmath as mp
import numpy as np
from matplotlib.colors import LogNorm

from generate.exact_geometry import DOUBLES, divisor, exact_island
from generate.height_coefficients import height_integral
from generate.page import Cell, Measured, panels, table
from mbma_tables import Surface, contact, greenwood_tripp
from mbma_tables.common.errors import MbmaError
from mbma_tables.islands.geometry import geometry, kinks
from mbma_tables.islands.island_models import answer_islands
from mbma_tables.islands.variants import get_variant
from mbma_tables.theories import Mbma
from mbma_tables.theories.mbma.models import get_model

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ULP = np.finfo(float).eps
ISLAND_MODELS = ("exact", "universal", "formula", "rigid")
VARIANTS = ("reported", "printed")

# islands
X_CORNERS = np.concatenate([-np.geomspace(40, 0.5, 9), [0.0], np.geomspace(0.5, 1e4, 19)])
MU_CORNERS = np.concatenate(
    [[0.0], 10.0 ** np.array([-300, -200, -100, -30, -16]), np.geomspace(1e-12, 1e12, 25)]
)
RIGID_MU = 1e-13  # below it mu Q is less than 1e-9 up to X = 1e4
# relative tolerances: of answers, and of what they are compared with
SOLVED = 1e-9
ISLAND_TRUTH = 1e-11

# geometry
APPROACHES = np.geomspace(1e-12, 30, 44)
BANDS = np.concatenate([[3.0000001, 3.001], np.geomspace(3.1, 1e8, 30)])
HURSTS = (0.05, 0.3, 0.5, 0.8, 1 - ULP / 2, 1.0)
MAPPED = (0.8, "reported")  # of the maps, whose corners come first
FIELDS = ("X", "mu", "eta", "D_d", "sigma_d", "R_u")

# totals
DEPTHS = (1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 3.0, 6.0)  # h_max - d
TOTAL_BANDS = (3.0000001, 3.1, 10.0, 216.0, 1e4, 1e6, 1e8)
TOTAL_HURSTS = (0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 1 - ULP / 2, 1.0)
TOP = 3.0
TOTAL_TRUTH = 1e-10

LIBRARY = "geometry, library"
PRINTED = "geometry, the paper's formulas as printed"

Number: TypeAlias = float | mp.mpf
Answer: TypeAlias = tuple[
    Sequence[float], float
]  # values, and a bound on their relative error
Corner: TypeAlias = tuple[float | str, ...]
Way: TypeAlias = Callable[..., Answer]  # to answer at a corner
Truth: TypeAlias = Callable[..., Sequence[Number]]


class Outcome(NamedTuple):
    """What one answer is.

    Its error is NaN where it was refused, has no number, or its truth is not known.
    """

    refused: bool = False
    not_finite: bool = False
    warned: int = 0
    error: float = math.nan
    beyond: bool = False


def relative_error(value: float, truth: Number) -> float:
    """Zero where both underflow."""
    if abs(float(truth)) < 1e-300:
        return 0.0 if abs(value) < 1e-290 else math.inf
    return abs(float(value / truth - 1))


def outcome(answer: Callable[[], Answer], truth: Sequence[Number] | None) -> Outcome:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            values, bound = answer()
        except MbmaError:
            return Outcome(refused=True)
        except (ArithmeticError, ValueError):
            values = [math.nan]
            bound = math.inf
    is_finite = bool(np.isfinite(np.array(values, float)).all())
    if truth is None or not is_finite:
        return Outcome(not_finite=not is_finite, warned=len(caught))
    error = max(map(relative_error, values, truth))
    return Outcome(warned=len(caught), error=error, beyond=error > bound)


def counted(
    ways: Mapping[str, Way], corners: Iterable[Corner], truth: Truth
) -> dict[str, list[Outcome]]:
    """Every way at every corner.

    Rigid spheres do not claim to be elastic ones, and have no truth.
    """
    outcomes: dict[str, list[Outcome]] = {name: [] for name in ways}
    for corner in corners:
        # where the truth is refused, an answer counts without an error
        exact: Sequence[Number] | None = None
        with contextlib.suppress(MbmaError):
            exact = truth(*corner)
        for name, way in ways.items():
            comparable = None if name.endswith("rigid") else exact
            outcomes[name].append(outcome(functools.partial(way, *corner), comparable))
    return outcomes


def _island_by(name: str, X: float, mu: float) -> Answer:
    model = get_model(name, 10 * SOLVED, get_variant("reported"))
    islands = answer_islands(model, {"X": np.array([X]), "mu": np.array([mu])})
    bound = float(islands.error[0]) + ISLAND_TRUTH + 1e-14
    return (float(islands.phi_F[0]), float(islands.phi_A[0])), bound


def _exact_island(X: float, mu: float) -> Sequence[Number]:
    if mu > RIGID_MU:
        solved = greenwood_tripp.solve(X, mu, rtol=ISLAND_TRUTH)
        return solved.phi_F, solved.phi_A
    with mp.workdps(40):
        # of a rigid sphere, by parabolic cylinder functions
        force = height_integral(mp.mpf(2.5), -mp.mpf(float(X)))
        area = height_integral(mp.mpf(2), -mp.mpf(float(X)))
        return mp.pi / 5 * force * mp.mpf(float(mu)), mp.pi / 2 * area


def islands() -> dict[str, list[Outcome]]:
    ways: dict[str, Way] = {}
    for name in ISLAND_MODELS:
        ways[f"islands by {name}"] = functools.partial(_island_by, name)
    return counted(ways, itertools.product(X_CORNERS, MU_CORNERS), _exact_island)


def _geometry_by_library(
    approach: float, zeta_1: float, hurst: float, variant: str
) -> Answer:
    fields = geometry(
        np.array([approach]),
        np.array([hurst]),
        np.array([zeta_1]),
        get_variant(variant),
    )
    return [float(fields[name][0]) for name in FIELDS], math.inf


def _geometry_as_printed(
    approach: float, zeta_1: float, hurst: float, variant: str
) -> Answer:
    """The paper's formulas in double precision."""
    density = float(divisor(variant))
    fields = exact_island(approach, hurst, zeta_1, density, DOUBLES)
    return [fields[name] for name in FIELDS], math.inf


def _exact_geometry(
    approach: float, zeta_1: float, hurst: float, variant: str
) -> Sequence[Number]:
    fields = exact_island(approach, hurst, zeta_1, divisor(variant))
    return [fields[name] for name in FIELDS]


def _geometry_corners() -> Iterator[Corner]:
    """Corners of the maps first, then those of others, then those at the floors."""
    everything = list(itertools.product(HURSTS, VARIANTS))
    ordered = [MAPPED, *(pair for pair in everything if pair != MAPPED)]
    for hurst, variant in ordered:
        for approach, zeta_1 in itertools.product(APPROACHES, BANDS):
            yield approach, zeta_1, hurst, variant
    for zeta_1, (hurst, variant) in itertools.product(map(float, BANDS), ordered):
        # one ulp around the floors of zeta_d and zeta_u
        for kink in map(float, kinks(hurst, zeta_1, get_variant(variant))):
            for side in (-1, 0, 1):
                yield kink * (1 + side * ULP), zeta_1, hurst, variant


def island_geometry() -> dict[str, list[Outcome]]:
    """Geometry by the library and by the paper's formulas as printed, against 60 digits."""
    ways: dict[str, Way] = {LIBRARY: _geometry_by_library, PRINTED: _geometry_as_printed}
    return counted(ways, _geometry_corners(), _exact_geometry)


def _total_by(
    name: str,
    variant: str,
    hurst: float,
    zeta_1: float,
    depth: float,
    rtol: float = 1e-8,
) -> Answer:
    surface = Surface(hurst, 1.0, zeta_1, 1.0, TOP)
    total = contact(
        surface,
        separation=TOP - depth,
        theory=Mbma(island_model=name, variant=variant, rtol=rtol),
    )
    bound = float(total.error) + TOTAL_TRUTH
    return (float(total.pressure), float(total.area)), bound


def _exact_total(
    variant: str, hurst: float, zeta_1: float, depth: float
) -> Sequence[Number]:
    values, _ = _total_by("exact", variant, hurst, zeta_1, depth, rtol=TOTAL_TRUTH)
    return values


def totals() -> dict[str, list[Outcome]]:
    """Totals of every island model at corners of surfaces and gaps.

    Both variants, against the exact one at 1e-10.
    """
    outcomes: dict[str, list[Outcome]] = {}
    # the four-number table is of one variant
    for names, variants in ((ISLAND_MODELS, VARIANTS), (["island4d"], VARIANTS[:1])):
        ways: dict[str, Way] = {}
        for name in names:
            ways[f"totals by {name}"] = functools.partial(_total_by, name)
        corners = itertools.product(variants, TOTAL_HURSTS, TOTAL_BANDS, DEPTHS)
        outcomes |= counted(ways, corners, _exact_total)
    return outcomes


def draw(outcomes: Mapping[str, Sequence[Outcome]]) -> Figure:
    """Maps of error: geometry by the paper's formulas as printed and by the library."""
    figure, axes = panels(1, 2, (10, 4.2), sharey=True)
    shape = (APPROACHES.size, BANDS.size)
    for panel, name in zip(axes, (PRINTED, LIBRARY), strict=True):
        # those of the map's H and variant come first
        of_map = outcomes[name][: APPROACHES.size * BANDS.size]
        errors = np.array([one.error for one in of_map])
        errors = np.maximum(errors, 1e-16).reshape(shape)
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


def row(name: str, outcomes: Sequence[Outcome]) -> list[Cell]:
    """Sums over corners, and the largest error where one was compared."""
    errors = [one.error for one in outcomes if not math.isnan(one.error)]
    return [
        name,
        len(outcomes),
        sum(one.refused for one in outcomes),
        sum(one.not_finite for one in outcomes),
        sum(one.warned for one in outcomes),
        max(errors, default=math.nan),
        sum(one.beyond for one in outcomes),
    ]


def measure() -> Measured:
    outcomes = islands() | island_geometry() | totals()
    header = (
        "corners | tried | refused | not finite | warnings"
        " | largest error of answers | beyond their bound"
    )
    rows = itertools.starmap(row, outcomes.items())
    text = table(header, rows, "{} | {} | {} | {} | {} | {:.1e} | {}")
    parts = {"corners": text.replace("—", "-")}
    return parts, {"docs/figures/stability.svg": draw(outcomes)}
