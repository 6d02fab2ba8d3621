"""What the stability atlas evaluates: corners of parameter space, and the truth there.

Truth is mpmath at 40 digits or more where a closed form exists, else the exact tier at a tighter tolerance.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import warnings
from collections.abc import Iterator
from typing import Any

import mpmath as mp
import numpy as np

from generate.tables.exact_geometry import divisor, exact_island
from mbma_tables import Surface, contact, greenwood_tripp
from mbma_tables.arguments import FloatArray
from mbma_tables.errors import MbmaError
from mbma_tables.models import get_model
from mbma_tables.surfaces.readings import Reading, get_reading
from mbma_tables.totals.island import geometry
from mbma_tables.totals.pairs import kinks

DIGITS = 40
FORCE, AREA = 0, 1
ULP = np.finfo(float).eps

# islands
X_CORNERS = np.concatenate([-np.geomspace(40, 0.5, 9), [0.0], np.geomspace(0.5, 1e4, 19)])
MU_CORNERS = np.concatenate([[0.0], 10.0 ** np.array([-300, -200, -100, -30, -16]), np.geomspace(1e-12, 1e12, 25)])
RIGID_MU = 1e-13  # below it mu Q is less than 1e-9 up to X = 1e4
SOLVED, ISLAND_TRUTH = 1e-9, 1e-11
TIERS = ("exact", "universal", "formula", "rigid")

# geometry
APPROACHES = np.geomspace(1e-12, 30, 44)
BANDS = np.concatenate([[3.0000001, 3.001], np.geomspace(3.1, 1e8, 30)])
HURSTS = (0.05, 0.3, 0.5, 0.8, 1 - ULP / 2, 1.0)
MAP_HURST = 0.8
FIELDS = ("X", "mu", "eta", "D_d", "sigma_d", "R_u")

# totals
REACHES = (1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 3.0, 6.0)
TOTAL_BANDS = (3.0000001, 3.1, 10.0, 216.0, 1e4, 1e6, 1e8)
TOTAL_HURSTS = (0.05, 0.1, 0.2, 0.3, 0.5, 0.8, 1 - ULP / 2, 1.0)
TOP = 3.0
TOTAL_TRUTH = 1e-10


@dataclasses.dataclass(frozen=True)
class Tally:
    """What became of some corners: answered with which largest error, refused, or worse."""

    name: str
    tried: int
    refused: int
    not_finite: int
    warned: int
    largest: float
    bound_broken: int


def quietly(answer: Any) -> tuple[Any, int]:
    """A result, or None where it was refused with a typed error; and the number of warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            result = answer()
        except MbmaError:
            result = None
    return result, len(caught)


def rigid_truth(X: float) -> tuple[mp.mpf, mp.mpf]:
    """(pi/5) F_{5/2}(-X) and (pi/2) F_2(-X) by mpmath: parabolic cylinder functions."""
    with mp.workdps(DIGITS):
        x = -mp.mpf(float(X))

        def integral(n: mp.mpf) -> mp.mpf:
            # F_n(x) = Gamma(n + 1) exp(-x^2/4) U(n + 1/2, x)/sqrt(2 pi)
            return mp.gamma(n + 1) * mp.exp(-x * x / 4) * mp.pcfu(n + mp.mpf(1) / 2, x) / mp.sqrt(2 * mp.pi)

        return mp.pi / 5 * integral(mp.mpf(5) / 2), mp.pi / 2 * integral(mp.mpf(2))


def _error(found: float, truth: Any) -> float:
    """Relative error; zero where both underflow."""
    exact = float(truth)
    if not math.isfinite(found):
        return math.nan
    if exact == 0 or abs(exact) < 1e-300:
        return 0.0 if abs(found) < 1e-290 else math.inf
    return abs(float(found / truth - 1))


def islands() -> tuple[list[Tally], dict[str, FloatArray]]:
    """Every tier at every corner of (X, mu); maps of the larger error of both functions, NaN where refused."""
    truth = np.full((X_CORNERS.size, MU_CORNERS.size, 2), np.nan)
    for i, X in enumerate(X_CORNERS):
        rigid = rigid_truth(X)
        for j, mu in enumerate(MU_CORNERS):
            if mu <= RIGID_MU:
                truth[i, j] = float(rigid[FORCE] * mp.mpf(float(mu))), float(rigid[AREA])
                continue
            solved, _ = quietly(lambda X=X, mu=mu: greenwood_tripp.solve(X, mu, rtol=ISLAND_TRUTH))
            if solved is not None:
                truth[i, j] = solved.phi_F, solved.phi_A
    maps: dict[str, FloatArray] = {}
    tallies = []
    for tier in TIERS:
        model = get_model(tier, 10 * SOLVED, get_reading("reported"))
        field = np.full(truth.shape[:2], np.nan)
        refused = bad = warned = broken = 0
        for (i, X), (j, mu) in ((a, b) for a in enumerate(X_CORNERS) for b in enumerate(MU_CORNERS)):
            shaped = {"X": np.array([X]), "mu": np.array([mu])}
            found, count = quietly(lambda model=model, shaped=shaped: model.of_islands(shaped))
            warned += count
            if found is None:
                refused += 1
                continue
            error = max(_error(float(v[0]), t) for v, t in zip((found.phi_F, found.phi_A), truth[i, j], strict=True))
            bad += not all(math.isfinite(float(v[0])) for v in (found.phi_F, found.phi_A))
            field[i, j] = error
            broken += bool(tier != "rigid" and error > float(found.error[0]) + ISLAND_TRUTH + 1e-14)
        maps[tier] = field
        # rigid spheres do not claim to be elastic ones
        counted = tier != "rigid" and np.isfinite(field).any()
        largest = float(np.nanmax(field)) if counted else math.nan
        tallies.append(Tally(f"islands by {tier}", field.size, refused, bad, warned, largest, broken))
    return tallies, maps


def naive(approach: float, hurst: float, zeta_1: float, reading: str) -> dict[str, float]:
    """The paper's formulas as they stand, in double precision; K as `exact_island`."""
    divide = {"printed": 6 * math.pi * math.sqrt(3), "reported": 6 * math.sqrt(3)}[reading]
    e = zeta_1 ** (-2 * hurst)
    s = 1 / math.sqrt(1 - e)
    zeta_d = max(1.5, ((4 / 9 * approach) ** 2 + e) ** (-1 / (2 * hurst)))
    zeta_u = max(3.0, ((approach / 21) ** 2 * (1 - e) + e) ** (-1 / (2 * hurst)))

    def moment(order: int, low: float, high: float) -> float:
        power = order - 2 * hurst
        factor = {0: 2 * hurst, 2: hurst, 4: 0.75 * hurst}[order]
        return factor * (math.log(high / low) if power == 0 else (high**power - low**power) / power)

    def summits(low: float, high: float) -> tuple[float, float]:
        m0, m2, m4 = (moment(order, low, high) for order in (0, 2, 4))
        return m4 / divide / m2, math.sqrt((1 - 0.8968 / (m0 * m4 / m2**2)) * m0)

    def radius(high: float) -> float:
        return 3 * math.sqrt(math.pi) / 8 / math.sqrt(moment(4, 1.0, high))

    D, sigma = summits(zeta_d, zeta_u)
    D_d, sigma_d = summits(1.0, zeta_d)
    R_d, R_u, R_top = radius(zeta_d), radius(zeta_u), radius(zeta_1)
    h_d, h_u = (math.sqrt(zeta ** (-2 * hurst) - e) for zeta in (zeta_d, zeta_u))
    D_top = summits(1.0, zeta_1)[0]
    eta = 0.75 * (math.pi * D_top) ** (1 / 3) * (1.5 * R_top) ** (2 / 3) * (20 * h_u / R_u) ** (1 / 3)
    return {
        "X": (approach / s - h_d) / sigma,
        "mu": 8 / 3 * D * sigma * math.sqrt(2 * R_u * R_d),
        "eta": eta,
        "D_d": D_d,
        "sigma_d": sigma_d,
        "R_u": R_u,
    }


def _own(approach: float, hurst: float, zeta_1: float, rule: Reading) -> dict[str, float]:
    """The library's geometry of one island."""
    found = geometry(np.array([approach]), np.array([hurst]), np.array([zeta_1]), rule)
    return {name: float(found[name][0]) for name in FIELDS}


def _places(hurst: float, rule: Reading) -> Iterator[tuple[tuple[int, float], tuple[int, float]]]:
    """Approaches and bands with their numbers; beyond those of the map, one ulp around the floors of zeta_d, zeta_u."""
    for j, zeta_1 in enumerate(BANDS):
        around = [float(kink) * (1 + side * ULP) for kink in kinks(hurst, zeta_1, rule) for side in (-1, 0, 1)]
        for i, approach in enumerate((*APPROACHES, *around)):
            yield (i, float(approach)), (j, float(zeta_1))


def island_geometry() -> tuple[list[Tally], dict[str, FloatArray]]:
    """Geometry by the library and by the paper's formulas as they stand, against 60 digits."""
    maps = {name: np.full((APPROACHES.size, BANDS.size), np.nan) for name in ("library", "direct")}
    counts = {name: [0, 0, 0, 0.0] for name in maps}  # tried, not finite, warned, largest
    for hurst in HURSTS:
        for reading in ("reported", "printed"):
            rule = get_reading(reading)
            for (i, approach), (j, zeta_1) in _places(hurst, rule):
                exact = exact_island(approach, hurst, zeta_1, divisor(reading))

                ways = {
                    "library": functools.partial(_own, approach, hurst, zeta_1, rule),
                    "direct": functools.partial(naive, approach, hurst, zeta_1, reading),
                }
                for name, way in ways.items():
                    try:
                        found, count = quietly(way)
                    except (ArithmeticError, ValueError):
                        found, count = dict.fromkeys(FIELDS, math.nan), 0
                    errors = [_error(found[field], exact[field]) for field in FIELDS]
                    error = math.nan if any(map(math.isnan, errors)) else max(errors)
                    counts[name][0] += 1
                    counts[name][1] += math.isnan(error)
                    counts[name][2] += count
                    counts[name][3] = max(counts[name][3], 0.0 if math.isnan(error) else error)
                    if hurst == MAP_HURST and reading == "reported" and i < APPROACHES.size:
                        maps[name][i, j] = error
    title = {"library": "geometry, library", "direct": "geometry, the paper's formulas as they stand"}
    tallies = [
        Tally(title[name], int(tried), 0, int(bad), int(warned), float(largest), 0)
        for name, (tried, bad, warned, largest) in counts.items()
    ]
    return tallies, maps


def totals() -> tuple[list[Tally], list[dict[str, Any]]]:
    """Totals of every tier at corners of surfaces and gaps, both readings, against the exact tier at 1e-10."""
    corners = [
        (hurst, zeta_1, reach, reading)
        for reading in ("reported", "printed")
        for hurst in TOTAL_HURSTS
        for zeta_1 in TOTAL_BANDS
        for reach in REACHES
    ]
    worst: list[dict[str, Any]] = []
    counts: dict[str, list[Any]] = {tier: [0, 0, 0, 0, 0.0, 0] for tier in (*TIERS, "island4d")}
    for hurst, zeta_1, reach, reading in corners:
        surface = Surface(hurst, 1.0, zeta_1, 1.0, TOP)
        gap = TOP - reach

        def answer(tier: str, rtol: float, surface: Any = surface, gap: float = gap, reading: str = reading) -> Any:
            return contact(surface, gap, tier=tier, reading=reading, rtol=rtol)

        truth, _ = quietly(lambda answer=answer: answer("exact", TOTAL_TRUTH))
        for tier, tally in counts.items():
            if tier == "island4d" and reading != "reported":
                continue
            found, count = quietly(lambda answer=answer, tier=tier: answer(tier, 1e-8))
            tally[0] += 1
            tally[3] += count
            if found is None:
                tally[1] += 1
                continue
            finite = math.isfinite(found.force) and math.isfinite(found.area)
            tally[2] += not finite
            if truth is None or not finite or tier == "rigid":
                continue
            error = max(_error(float(found.force), truth.force), _error(float(found.area), truth.area))
            tally[4] = max(tally[4], error)
            if error > float(found.error) + TOTAL_TRUTH:
                tally[5] += 1
                worst.append(
                    {"tier": tier, "hurst": hurst, "zeta_1": zeta_1, "reach": reach, "reading": reading, "error": error}
                )
    tallies = [
        Tally(f"totals by {tier}", tried, refused, bad, warned, math.nan if tier == "rigid" else largest, broken)
        for tier, (tried, refused, bad, warned, largest, broken) in counts.items()
    ]
    return tallies, worst


def arguments() -> Iterator[tuple[str, bool]]:
    """Kinds of arrays, units and moduli: what was tried, and whether the answer was the same."""
    gaps = np.linspace(-2.0, 2.9, 40)
    base = contact(Surface(0.8, 1.0, 216.0, 1.0, 3.0), gaps)

    def same(found: Any, rtol: float = 0.0) -> bool:
        pairs = ((found.force, base.force), (found.area, base.area))
        return all(bool(np.all(np.abs(np.asarray(a).ravel() / b - 1) <= rtol)) for a, b in pairs)

    surface = Surface(0.8, 1.0, 216.0, 1.0, 3.0)
    strided = np.repeat(gaps, 3)[::3]
    frozen = gaps.copy()
    frozen.flags.writeable = False
    yield "every third of a longer array", same(contact(surface, strided))
    yield "a read-only array", same(contact(surface, frozen))
    yield "a reversed view", same(contact(surface, gaps[::-1][::-1]))
    yield "Fortran order, two dimensions", same(contact(surface, np.asfortranarray(gaps.reshape(5, 8))))
    yield "a list of floats", same(contact(surface, gaps.tolist()))
    single = contact(surface, gaps.astype(np.float32))
    widened = contact(surface, gaps.astype(np.float32).astype(float))
    yield "float32, as the doubles they are", bool(np.array_equal(single.force, widened.force))
    whole = contact(Surface(1, 1, 216, 1, 3), np.array([1, 2]))
    yield (
        "integers",
        bool(np.array_equal(whole.force, contact(Surface(1.0, 1.0, 216.0, 1.0, 3.0), np.array([1.0, 2.0])).force)),
    )
    for unit in (1e-9, 1e-6, 1e-3, 1e3):
        scaled = Surface(0.8, 1.0 / unit, 216.0 / unit, unit, 3.0 * unit)
        yield f"length unit {unit:g}, to 1e-12", same(contact(scaled, gaps * unit), 1e-12)
    for modulus in (1.0, 1e6, 1e12):
        found = contact(surface, gaps, E_star=modulus)
        yield f"E* = {modulus:g}, to 1e-15", bool(np.all(np.abs(found.force / modulus / base.force - 1) <= 1e-15))
    many = np.tile(gaps, 25_000)
    large = contact(surface, many)
    yield "a million gaps, to 1e-8", bool(np.all(np.abs(large.force[:40] / base.force - 1) <= 1e-8))
    beyond = contact(surface, np.array([3.0, 3.0 * (1 + ULP), 1e6]))
    yield "d >= h_max is exactly zero", bool((beyond.force == 0).all() and (beyond.area == 0).all())
    refusals: dict[str, Any] = {
        "an empty array": lambda: contact(surface, np.empty(0)),
        "NaN": lambda: contact(surface, math.nan),
        "infinity": lambda: contact(surface, math.inf),
        "d one ulp below -h_max": lambda: contact(surface, -3.0 * (1 + ULP)),
        "H one ulp above 1": lambda: Surface(1 + ULP, 1.0, 216.0, 1.0, 3.0),
        "zeta_1 = 3": lambda: contact(Surface(0.8, 1.0, 3.0, 1.0, 3.0), 1.0),
        "mu one ulp below 0": lambda: greenwood_tripp.solve(1.0, -5e-324),
        "complex numbers": lambda: contact(surface, 1j),
        "text": lambda: contact(surface, "1.0"),
    }
    for name, answer in refusals.items():
        yield f"{name}: refused by a typed error", quietly(answer)[0] is None
