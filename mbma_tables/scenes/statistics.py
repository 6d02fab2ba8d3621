"""Statistics and profiles of islands, and the area without finer roughness."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.islands import greenwood_tripp
from mbma_tables.models import AnyModel, RigidModel, answer_islands, island_model_name
from mbma_tables.models.named import get_model
from mbma_tables.scenes.plan import Step
from mbma_tables.scenes.problem import Problem
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.surface import Surface
from mbma_tables.surfaces.variants import Variant, get_variant
from mbma_tables.totals.island import islands_of, scale_area, scale_force
from mbma_tables.totals.profile import profile, source_of

Fields = dict[str, tuple[tuple[str, ...], Any]]


def _asked(problem: Problem, step: Step) -> tuple[Variant, float, str | AnyModel]:
    """Variant, tolerance and island model of a step."""
    assert step.rtol is not None
    assert step.island_model is not None
    return get_variant(problem.variant), step.rtol, step.island_model


def _outside(island_model: str | AnyModel) -> str:
    """Option for islands outside a table: solve them."""
    return "exact" if island_model_name(island_model) in ("universal", "island4d") else "raise"


def _shape(surface: AnySurface) -> Any:
    """The surface as an argument of profiles: its numbers, or itself."""
    if not isinstance(surface, Surface):
        return surface
    return float(surface.hurst), float(surface.zeta_1), float(surface.h_max / surface.h_rms)


def hertz_area(problem: Problem, surface: AnySurface, gap: FloatArray, step: Step) -> tuple[Fields, float]:
    """A/A0 with eta = 1 in Eq. 38 (C.1), and the bound on its relative error."""
    variant, rtol, island_model = _asked(problem, step)
    depth = (float(surface.h_max) - gap) / float(surface.h_rms)
    kept = profile(
        _shape(surface), get_model(island_model, rtol, variant), variant, rtol, _outside(island_model), rows=4
    )
    area = np.zeros(depth.shape)
    area[depth > 0] = kept.totals(depth[depth > 0])[3]
    return {"area": (("gap",), area)}, kept.error


def island_statistics(problem: Problem, surface: AnySurface, gap: FloatArray, step: Step) -> tuple[Fields, float]:
    """Number of islands at every gap; load, area, density along their approach (Eqs. 40, 42), and the error's bound."""
    variant, rtol, island_model = _asked(problem, step)
    model, h_rms = get_model(island_model, rtol, variant), float(surface.h_rms)
    depth = np.asarray(surface.h_max - gap) / h_rms
    shape = _shape(surface)
    source, deepest = source_of(shape, variant), max(float(depth.max()), 0.0)
    # approaches up to the deepest, graded towards first contact
    t = np.linspace(0, 1, problem.points + 1)[1:] * np.arcsinh(np.sqrt(deepest / source.layer))
    grid = source.layer * np.sinh(t) ** 2
    number, density = np.zeros(depth.size), np.zeros((depth.size, grid.size))
    # where no gap touches there is no distribution
    pressure, area, error = np.zeros(grid.size), np.zeros(grid.size), 0.0
    if deepest > 0:
        # islands are counted without an island model
        kept = profile(shape, RigidModel(), variant, rtol, rows=3)
        number[depth > 0] = kept.totals(depth[depth > 0])[2]
        g, s, q0 = islands_of(surface, grid * h_rms, variant)
        phi = answer_islands(model, g, _outside(island_model))
        pressure = problem.E_star * s / q0 * scale_force(g) * phi.phi_F
        share = g["eta"] if "subscale_area" in problem.dropped else 1.0
        area = scale_area(g) * phi.phi_A / share / q0**2
        shift, rate = source.heights(g, grid)
        spread = source.density(g, grid, shift - rate * depth[:, None])
        number, density = number * q0**2, np.where(grid <= depth[:, None], spread, 0.0) * q0**2 / s
        error = max(kept.error, float(np.max(phi.error)))
    along = {"island_delta": grid * h_rms, "island_force": pressure, "island_area": area}
    fields: Fields = {
        "island_number": (("gap",), number),
        **{name: (("approach",), values) for name, values in along.items()},
        "island_density": (("gap", "approach"), density),
    }
    return fields, error


def profiles(problem: Problem, surface: AnySurface, gap: Any, step: Step) -> tuple[Fields, float]:
    """p(r) and d(r) of the islands at these approaches, solved exactly (Eqs. 34, 36, 37)."""
    variant, rtol, _ = _asked(problem, step)
    delta = np.atleast_1d(np.asarray(problem.deltas, dtype=float)).ravel()
    g, s, q0 = islands_of(surface, delta, variant)
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
