"""Execute a plan: an xarray Dataset of quantities with their units and provenance."""

from __future__ import annotations

import dataclasses
import json
import math
from typing import TYPE_CHECKING, Any

from mbma_tables.answers.source import MEANINGS
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.common.units import unit_of
from mbma_tables.materials import ELASTIC_PSI
from mbma_tables.scenes.plan import TABLES, Plan
from mbma_tables.scenes.problem import CORRELATIONS, INVERTED, Problem
from mbma_tables.scenes.steps import STEPS, Progress, Run, comparison
from mbma_tables.surfaces.self_affine import PARAMETERS
from mbma_tables.surfaces.variants import get_variant

if TYPE_CHECKING:
    import xarray as xr


def run_plan(problem: Problem, plan: Plan, progress: Progress | None = None) -> xr.Dataset:
    """The quantities of a problem with units and provenance; raises if their error exceeds the tolerance."""
    surface, h_max = problem.surface, float(problem.surface.h_max)
    if "finite_height" in problem.dropped:
        plain: Any = surface
        surface = dataclasses.replace(plain, h_max=height_without_end(problem, 0.1 * plan.rtol))
    run, report = Run(problem, surface), progress or (lambda *_: None)
    if problem.prescribed in INVERTED:
        name = "nominal_pressure" if problem.prescribed == "pressures" else "prescribed_area"
        run.found[name] = (("gap",), problem.gaps)
    elif problem.gaps is not None:
        run.gap = problem.gaps if problem.prescribed == "separations" else 2 * problem.gaps - h_max
    for step in plan.steps:
        report(step.name, 0, step.count)
        STEPS.get(step.name, comparison)(run, step)
        report(step.name, step.count, step.count)
    error = max(run.errors.values(), default=0.0)
    if error > plan.rtol:
        raise ConvergenceError(
            f"the error bound reached is {error:.2e}, above rtol = {plan.rtol:.2e}: give a larger rtol"
        )
    if run.gap is not None:
        run.found |= {"separation": (("gap",), run.gap), "mean_separation": (("gap",), (h_max + run.gap) / 2)}
    return to_dataset(run, plan)


def height_without_end(problem: Problem, rtol: float) -> float:
    """Height [length] beyond which the whole Gaussian adds less than `rtol` at the largest gap."""
    h_max = float(problem.surface.h_max)
    gap = problem.gaps.max() if problem.prescribed == "separations" else 2 * problem.gaps.max() - h_max
    # exp(-(d + t)^2/2) <= exp(-d^2/2) exp(-t^2/2); ten more for the powers before it, one s, or h_rms, for h_d
    tail = math.sqrt(2 * (10 - math.log(rtol))) + 1
    return max(float(gap), 0.0) + tail * float(getattr(problem.surface, "s", problem.surface.h_rms))


def _units(problem: Problem) -> dict[str, tuple[str, str]]:
    """Unit and meaning of every quantity that a scene can hold."""
    hertz = "subscale_area" in problem.dropped
    # the quantity with the same unit, and the description
    quantities = {name: (name, text) for name, text in MEANINGS.items()} | {
        "nominal_pressure": ("pressure", "F/A0 as prescribed"),
        "prescribed_area": ("area", "A/A0 as prescribed"),
        "area": ("area", "Hertz area of the summits over A0 (eta = 1)" if hertz else "real contact area A/A0"),
        "leakage": ("leakage", "flow coefficient k h_rms^3: flow per length of seal is it dp/(12 viscosity width)"),
        "leakage_valid": ("valid", "whether flow through such contacts was simulated"),
        "leakage_scatter": ("scatter", "standard deviation of ln of the flow coefficient between simulations"),
        "leakage_blocked": ("valid", "whether contact percolates"),
        "island_number": ("D", "islands in contact per nominal area (Eq. 42)"),
        "island_delta": ("delta", "approach of an island"),
        "island_force": ("island_force", "load of an island at that approach"),
        "island_area": ("island_area", "contact area of an island at that approach"),
        "island_density": ("island_density", "islands per nominal area and approach"),
        "profile_delta": ("delta", "approach of the island"),
        "profile_radius": ("R_d", "radius r in the island"),
        "profile_pressure": ("pressure", "pressure p(r) (Eq. 36)"),
        "profile_gap": ("separation", "d(r), deformed sphere to mid-plane of the summits (Eq. 34)"),
    }
    for name in problem.theories:
        quantities |= {f"{name}_pressure": ("pressure", f"F/A0 by {name}"), f"{name}_area": ("area", f"A/A0 by {name}")}
    units = {name: (unit_of(like, problem.units), meaning) for name, (like, meaning) in quantities.items()}
    unit = problem.conductance_unit
    correlations = {f"{name}_conductance": (unit, f"conductance by {name}") for name in CORRELATIONS}
    return units | correlations | {"conductance": (unit, "conductance per nominal area")}


def to_dataset(run: Run, plan: Plan) -> xr.Dataset:
    """The computed quantities; coordinates are gaps and the prescribed quantity."""
    import xarray as xr

    problem, units = run.problem, _units(run.problem)
    variables = {
        name: xr.Variable(dims, values, {"units": units[name][0], "long_name": units[name][1]})
        for name, (dims, values) in run.found.items()
    }
    named = ("separation", "mean_separation", "nominal_pressure", "prescribed_area", "profile_delta", "island_delta")
    facts: dict[str, Any] = {
        "title": problem.title,
        "plan": plan.text(),
        "rtol": plan.rtol,
        "error": max(run.errors.values(), default=0.0),
        "errors": json.dumps(run.errors),
        "theory": problem.theory_name,
        "variant": get_variant(problem.variant).name if problem.theory == "mbma" else "",
        "island_models": json.dumps(run.island_models),
        "switched_off": " ".join(sorted(problem.dropped)),
        "E_star": float(problem.E_star),
        "table_hashes": json.dumps(_hashes(problem, set(run.island_models.values()))),
    }
    # psi times the hardness
    stress = float(problem.E_star * problem.surface.rms_gradient)
    if problem.hardness is None:
        facts["elastic_hardness"] = stress / ELASTIC_PSI
    else:
        facts |= {"hardness": float(problem.hardness), "psi": stress / float(problem.hardness)}
    if run.reasons is not None:
        facts["reasons"] = json.dumps(run.reasons)
    known = {name: getattr(problem.surface, name) for name in PARAMETERS}
    # a spectrum that is no power law has no Hurst exponent
    facts |= {f"surface_{name}": float(number) for name, number in known.items() if number is not None}
    return xr.Dataset(variables, attrs=facts).set_coords([name for name in named if name in variables])


def _hashes(problem: Problem, island_models: set[str]) -> dict[str, str]:
    """Hashes of the values of the tables used."""
    used = sorted(island_models & set(TABLES))
    if not used:
        return {}
    from mbma_tables.models.tables import open_table

    tables: dict[str, Any] = {name: open_table(name) for name in used}
    if not isinstance(problem.island_model, str | None):
        tables[problem.island_model.name] = problem.island_model
    return {name: str(table.content.attributes["values_sha256"]) for name, table in tables.items() if name in used}
