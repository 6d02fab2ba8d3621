"""Statistics and profiles of islands, and the area without finer roughness."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.geometry import geometry
from mbma_tables.islands.measured import measured_islands
from mbma_tables.models import AnyModel, IslandAnswer, answer_islands, get_model, tier_name
from mbma_tables.models.protocol import AREA, BOTH
from mbma_tables.scenes.plan import Step
from mbma_tables.scenes.problem import Problem
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.measured import MeasuredSurface
from mbma_tables.surfaces.readings import Reading, get_reading
from mbma_tables.surfaces.surface import Surface
from mbma_tables.totals.gauss_kronrod import Integrals, integrate
from mbma_tables.totals.island import islands_of, scale_area, scale_force
from mbma_tables.totals.island_sum import density_of, kinks, sum_islands
from mbma_tables.totals.kernel import Pairs
from mbma_tables.totals.measured import IslandCurve

Fields = dict[str, tuple[tuple[str, ...], Any]]


@dataclasses.dataclass(frozen=True)
class HertzArea:
    """An island model whose summits touch on their whole Hertz area: eta = 1 in Eq. 38 (C.1)."""

    model: AnyModel
    name: str = "hertz area"

    def of_islands(self, islands: Mapping[str, FloatArray], outside: str = "raise", which: int = BOTH) -> IslandAnswer:
        """Phi_F and Phi_A/eta of islands."""
        found = answer_islands(self.model, islands, outside, which)
        return found._replace(phi_A=found.phi_A / islands["eta"])


def _asked(problem: Problem, step: Step) -> tuple[Reading, float, str | AnyModel]:
    """Reading, tolerance and island model of a step."""
    assert step.rtol is not None
    assert step.tier is not None
    return get_reading(problem.reading), step.rtol, step.tier


def _outside(tier: str | AnyModel) -> str:
    """What to do about islands outside a table: solve them."""
    return "exact" if tier_name(tier) in ("universal", "island4d") else "raise"


def hertz_area(problem: Problem, surface: AnySurface, gap: FloatArray, step: Step) -> tuple[Fields, float]:
    """A/A0 with eta = 1, and the bound on its relative error."""
    reading, rtol, tier = _asked(problem, step)
    model, depth = HertzArea(get_model(tier, rtol, reading)), np.asarray(surface.h_max - gap)
    if isinstance(surface, MeasuredSurface):
        own = IslandCurve(surface, model, reading, rtol, _outside(tier)).totals(depth)
        return {"area": (("gap",), own.area)}, float(own.error.max())
    assert isinstance(surface, Surface)
    found = sum_islands(Pairs.of(surface, depth), reading, model, rtol, _outside(tier), AREA)
    return {"area": (("gap",), found.area)}, float(found.error.max())


def _to_angle(approach: FloatArray, layer: FloatArray) -> FloatArray:
    """The integration variable: approach = layer sinh(t)^2."""
    return np.arcsinh(np.sqrt(approach / layer))


def _number_of_islands(pairs: Pairs, reading: Reading, rtol: float) -> Integrals:
    """Islands in contact per nominal area of every pair, over q0^2 (Eq. 42)."""

    def integrand(owner: NDArray[np.intp], t: FloatArray) -> FloatArray:
        layer = pairs.layer[owner, None]
        approach = layer * np.sinh(t) ** 2
        hurst, zeta_1 = (np.broadcast_to(field[owner, None], t.shape).copy() for field in (pairs.hurst, pairs.zeta_1))
        g = geometry(approach, hurst, zeta_1, reading)
        weight = density_of(pairs, owner, approach, g, reading)
        return np.asarray(weight * pairs.rms_over_s[owner, None] * layer * np.sinh(2 * t))[..., None]

    end = np.maximum(pairs.compression, 0)
    floors = (np.minimum(kink, end) for kink in kinks(pairs.hurst, pairs.zeta_1, reading))
    breaks = np.sort(np.stack([np.zeros(end.size), *floors, end]), axis=0)
    low, high = _to_angle(breaks[:-1], pairs.layer), _to_angle(breaks[1:], pairs.layer)
    owner = np.broadcast_to(np.arange(end.size), low.shape)
    touching = high > low
    return integrate(integrand, owner[touching], low[touching], high[touching], end.size, rtol)


def island_statistics(problem: Problem, surface: AnySurface, gap: FloatArray, step: Step) -> tuple[Fields, float]:
    """Number of islands at every gap; load, area and density of islands along their approach (Eqs. 40, 42).

    The density is zero beyond h_max - d. Also returns the bound on the relative error.
    """
    if isinstance(surface, MeasuredSurface):
        return _own_statistics(problem, surface, gap, step)
    assert isinstance(surface, Surface)
    reading, rtol, tier = _asked(problem, step)
    pairs = Pairs.of(surface, surface.h_max - gap)
    s, q0 = float(surface.s), float(surface.q0)
    number = _number_of_islands(pairs, reading, rtol)
    error = float(number.error.max(initial=0.0))
    grid = _grid(problem, float(pairs.compression.max()), float(pairs.layer[0]))
    deepest = np.maximum(pairs.compression.max(), 0)
    # where no gap touches there is no distribution
    force, area, density = np.zeros(grid.size), np.zeros(grid.size), np.zeros((gap.size, grid.size))
    if deepest > 0:
        hurst, zeta_1 = np.full(grid.size, float(surface.hurst)), np.full(grid.size, float(surface.zeta_1))
        g = geometry(grid, hurst, zeta_1, reading)
        phi = answer_islands(get_model(tier, rtol, reading), g | {"hurst": hurst}, _outside(tier))
        force = problem.E_star * s / q0 * scale_force(g) * phi.phi_F
        share = g["eta"] if "subscale_area" in problem.dropped else 1.0
        area = scale_area(g) * phi.phi_A / share / q0**2
        approach = np.broadcast_to(grid, density.shape)
        spread = density_of(pairs, np.arange(gap.size), approach, {k: field[None] for k, field in g.items()}, reading)
        density = np.where(approach <= pairs.compression[:, None], spread, 0.0) * q0**2 / s
        error = max(error, float(np.max(phi.error)))
    return _fields(number.value[:, 0] * q0**2, grid * float(surface.h_rms), force, area, density), error


def _grid(problem: Problem, deepest: float, layer: float) -> FloatArray:
    """Approaches up to the deepest, graded towards first contact."""
    t = np.linspace(0, 1, problem.points + 1)[1:] * np.arcsinh(np.sqrt(max(deepest, 0.0) / layer))
    return np.asarray(layer * np.sinh(t) ** 2)


def _fields(number: FloatArray, delta: FloatArray, force: FloatArray, area: FloatArray, density: FloatArray) -> Fields:
    along = {"island_delta": delta, "island_force": force, "island_area": area}
    return {
        "island_number": (("gap",), number),
        **{name: (("approach",), values) for name, values in along.items()},
        "island_density": (("gap", "approach"), density),
    }


def _own_statistics(problem: Problem, surface: MeasuredSurface, gap: FloatArray, step: Step) -> tuple[Fields, float]:
    """`island_statistics` of a surface that is its own spectrum."""
    reading, rtol, tier = _asked(problem, step)
    curve = IslandCurve(surface, get_model(tier, rtol, reading), reading, rtol, _outside(tier))
    depth = float(surface.h_max) - gap
    found = curve.totals(depth)
    grid = _grid(problem, float(depth.max()), curve.layer)
    if depth.max() > 0:
        nodes = curve.nodes(grid)
        eta = measured_islands(surface, grid, reading)["eta"] if "subscale_area" in problem.dropped else 1.0
        force, area = problem.E_star * nodes.force, nodes.area / eta
        density = np.where(grid <= depth[:, None], curve.density(nodes, depth[:, None]), 0.0)
    else:
        force, area, density = np.zeros(grid.size), np.zeros(grid.size), np.zeros((gap.size, grid.size))
    return _fields(found.number, grid, force, area, density), float(found.error.max(initial=curve.island_error))


def profiles(problem: Problem, surface: AnySurface, gap: Any, step: Step) -> tuple[Fields, float]:
    """p(r) and d(r) of the islands at these approaches, solved exactly (Eqs. 34, 36, 37)."""
    reading, rtol, _ = _asked(problem, step)
    delta = np.atleast_1d(np.asarray(problem.deltas, dtype=float)).ravel()
    g, s, q0 = islands_of(surface, delta, reading)
    solved = greenwood_tripp.solve(g["X"], g["mu"], rtol=rtol)
    radius = np.sqrt(2 * g["R_d"] * g["sigma"])
    dims = ("island", "node")
    fields: Fields = {
        "profile_delta": (("island",), delta),
        "profile_radius": (dims, solved.rho * radius[:, None] / q0),
        "profile_pressure": (dims, problem.E_star * q0 * s * (g["sigma"] / radius)[:, None] * solved.pressure),
        "profile_gap": (dims, solved.gap * g["sigma"][:, None] * s),
    }
    return fields, float(np.max(solved.error))
