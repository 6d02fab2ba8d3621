"""Statistics and profiles of islands, and the area without finer roughness."""

from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.islands import greenwood_tripp
from mbma_tables.models import RigidModel, answer_islands
from mbma_tables.models.named import get_model
from mbma_tables.scenes.plan import TABLES, Step
from mbma_tables.scenes.problem import Problem
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.surface import Surface
from mbma_tables.surfaces.variants import Variant, get_variant
from mbma_tables.totals.island import islands_of, scale_area, scale_force
from mbma_tables.totals.profile import profile, source_of

Fields = dict[str, tuple[tuple[str, ...], Any]]


def _asked(surface: AnySurface, problem: Problem, step: Step) -> tuple[Any, Variant, float, Any, str]:
    """The surface as profiles take it, variant, tolerance and island model of a step; islands outside are solved."""
    assert step.rtol is not None
    shape: Any = surface
    if isinstance(surface, Surface):
        shape = float(surface.hurst), float(surface.zeta_1), float(surface.h_max / surface.h_rms)
    variant = get_variant(problem.variant)
    model = None if step.island_model is None else get_model(step.island_model, step.rtol, variant)
    return shape, variant, step.rtol, model, "exact" if step.island_model_name in TABLES else "raise"


def hertz_area(problem: Problem, surface: AnySurface, gap: FloatArray, step: Step) -> tuple[Fields, float]:
    """A/A0 with eta = 1 in Eq. 38 (C.1), and the bound on its relative error."""
    shape, variant, rtol, model, outside = _asked(surface, problem, step)
    depth = (float(surface.h_max) - gap) / float(surface.h_rms)
    kept = profile(shape, model, variant, rtol, outside, rows=4)
    area = np.zeros(depth.shape)
    area[depth > 0] = kept.totals(depth[depth > 0])[3]
    return {"area": (("gap",), area)}, kept.error


def island_statistics(problem: Problem, surface: AnySurface, gap: FloatArray, step: Step) -> tuple[Fields, float]:
    """Number of islands at every gap; load, area, density along their approach (Eqs. 40, 42), and the error's bound."""
    shape, variant, rtol, model, outside = _asked(surface, problem, step)
    h_rms = float(surface.h_rms)
    depth = np.asarray(surface.h_max - gap) / h_rms
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
        phi = answer_islands(model, g, outside)
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
    assert step.rtol is not None
    delta = np.atleast_1d(np.asarray(problem.deltas, dtype=float)).ravel()
    g, s, q0 = islands_of(surface, delta, get_variant(problem.variant))
    solved = greenwood_tripp.solve(g["X"], g["mu"], rtol=step.rtol)
    radius = np.sqrt(2 * g["R_d"] * g["sigma"])
    dims = ("island", "node")
    fields: Fields = {
        "profile_delta": (("island",), delta),
        "profile_radius": (dims, solved.rho * radius[:, None] / q0),
        "profile_pressure": (dims, problem.E_star * q0 * s * (g["sigma"] / radius)[:, None] * solved.pressure),
        "profile_gap": (dims, solved.gap * g["sigma"][:, None] * s),
    }
    return fields, float(np.max(solved.error))
