"""The result of a scene as an xarray Dataset: quantities with their units, and what made them."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import xarray as xr

from mbma_tables.scenes.plan import Plan
from mbma_tables.scenes.problem import Problem
from mbma_tables.surfaces.readings import get_reading

if TYPE_CHECKING:
    from mbma_tables.scenes.run import Run

TABLES = ("universal", "island4d")


def _units(problem: Problem) -> dict[str, tuple[str, str]]:
    """Unit and meaning of every quantity that a scene can hold."""
    length = problem.length_unit or "length"
    stress = problem.stress_unit or ("stress" if problem.E_star != 1.0 else "1")

    def of_stress(unit: str) -> str:
        return unit if stress == "1" else f"{stress} {unit}"

    hertz = "subscale_area" in problem.dropped
    units = {
        "separation": (length, "d, rigid plane to mid-plane"),
        "mean_separation": (length, "u = (h_max + d)/2 (Eq. 50)"),
        "nominal_pressure": (stress, "F/A0 as prescribed"),
        "prescribed_area": ("1", "A/A0 as prescribed"),
        "valid": ("1", "whether the theory was tested for contacts such as these"),
        "scatter": ("1", "standard deviation of ln F at this gap from simulation to simulation"),
        "area_scatter": ("1", "standard deviation of ln A at this force from simulation to simulation"),
        "force": (stress, "nominal pressure F/A0"),
        "area": ("1", "Hertz area of the summits over A0 (eta = 1)" if hertz else "real contact area A/A0"),
        "stiffness": (f"{stress}/{length}", "-dF/dd per nominal area"),
        "stiffness_mean": (f"{stress}/{length}", "-dF/du per nominal area"),
        "energy": (of_stress(length), "elastic energy per nominal area"),
        "conductance": (f"conductivity/{length}", "conductance per nominal area"),
        "island_number": (f"1/{length}^2", "islands in contact per nominal area (Eq. 42)"),
        "island_delta": (length, "approach of an island"),
        "island_force": (of_stress(f"{length}^2"), "load of an island at that approach"),
        "island_area": (f"{length}^2", "contact area of an island at that approach"),
        "island_density": (f"1/{length}^3", "islands per nominal area and approach"),
        "profile_delta": (length, "approach of the island"),
        "profile_radius": (length, "radius r in the island"),
        "profile_pressure": (stress, "pressure p(r) (Eq. 36)"),
        "profile_gap": (length, "d(r), deformed sphere to mid-plane of the summits (Eq. 34)"),
    }
    for name in problem.theories:
        units |= {f"{name}_force": (stress, f"F/A0 by {name}"), f"{name}_area": ("1", f"A/A0 by {name}")}
    return units


def to_dataset(run: Run, plan: Plan) -> xr.Dataset:
    """Quantities that were found; coordinates are gaps and what was prescribed."""
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
        "reading": get_reading(problem.reading).name if problem.theory == "mbma" else "",
        "tiers": json.dumps(run.tiers),
        "switched_off": " ".join(sorted(problem.dropped)),
        "E_star": float(problem.E_star),
        "table_hashes": json.dumps(_hashes(problem, set(run.tiers.values()))),
    }
    if run.reasons is not None:
        facts["reasons"] = json.dumps(run.reasons)
    numbers = ("hurst", "q0", "q1", "h_rms", "h_max")
    facts |= {f"surface_{name}": float(getattr(problem.surface, name)) for name in numbers}
    return xr.Dataset(variables, attrs=facts).set_coords([name for name in named if name in variables])


def _hashes(problem: Problem, tiers: set[str]) -> dict[str, str]:
    """Hashes of the values of the tables that answered."""
    used = sorted(tiers & set(TABLES))
    if not used:
        return {}
    from mbma_tables.models.tables import open_table

    tables: dict[str, Any] = {name: open_table(name) for name in used}
    if not isinstance(problem.tier, str | None):
        tables[problem.tier.name] = problem.tier
    return {name: str(table.content.attributes["values_sha256"]) for name, table in tables.items() if name in used}
