"""Carry a plan out: each step imports, reads and evaluates what it needs and nothing else."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr

from mbma_tables.arguments import FloatArray
from mbma_tables.errors import ConvergenceError, OutOfRangeError
from mbma_tables.scenes.plan import Plan, Step
from mbma_tables.scenes.problem import Problem
from mbma_tables.surfaces.readings import get_reading

if TYPE_CHECKING:
    from mbma_tables.surfaces.surface import Surface
    from mbma_tables.theories.protocol import Theory
    from mbma_tables.totals.law import MbmaLaw

Progress = Callable[[str, int, int], None]
BLOCK = 64  # gaps between two reports of progress, where a gap is slow
TABLES = ("universal", "island4d")
MAX_SLOPE_OF_STIFFNESS = 3.0  # of log(stiffness) by log(h_max - d); 5/2 next to first contact


@dataclasses.dataclass
class Run:
    """A plan on its way: what steps hand on, and what they found."""

    problem: Problem
    surface: Surface
    rtol: float
    progress: Progress
    gap: Any = None
    found: dict[str, tuple[tuple[str, ...], Any]] = dataclasses.field(default_factory=dict)
    errors: dict[str, float] = dataclasses.field(default_factory=dict)
    tiers: dict[str, str] = dataclasses.field(default_factory=dict)

    def close(self, step: Step, error: float, tier: str | None) -> None:
        """Note the error bound that a step reached, and its island model."""
        self.errors[step.name], self.tiers[step.name] = error, str(tier)


def run_plan(problem: Problem, plan: Plan, progress: Progress | None = None) -> xr.Dataset:
    """The quantities of a problem, each with its unit; what made them in the attributes.

    Raises
    ------
    InputError, OutOfRangeError, ConvergenceError
        The last also where a step's error bound exceeds the tolerance.
    """
    surface, h_max = problem.surface, float(problem.surface.h_max)
    if "finite_height" in problem.dropped:
        surface = dataclasses.replace(surface, h_max=height_without_end(problem, 0.1 * plan.rtol))
    run = Run(problem, surface, plan.rtol, progress or (lambda *_: None))
    if problem.gaps is not None and problem.prescribed != "nominal_pressures":
        run.gap = problem.gaps if problem.prescribed == "separations" else 2 * problem.gaps - h_max
    for step in plan.steps:
        run.progress(step.name, 0, step.count)
        _STEPS.get(step.name, _comparison)(run, step)
        run.progress(step.name, step.count, step.count)
    error = max(run.errors.values(), default=0.0)
    if error > plan.rtol:
        raise ConvergenceError(
            f"the error bound reached is {error:.2e}, above rtol = {plan.rtol:.2e}: give a larger rtol"
        )
    if run.gap is not None:
        run.found |= {"separation": (("gap",), run.gap), "mean_separation": (("gap",), (h_max + run.gap) / 2)}
    return _dataset(run, plan)


def height_without_end(problem: Problem, rtol: float) -> float:
    """Height [length] beyond which the whole Gaussian adds less than `rtol` at the largest gap."""
    h_max = float(problem.surface.h_max)
    gap = problem.gaps.max() if problem.prescribed == "separations" else 2 * problem.gaps.max() - h_max
    # exp(-(d + t)^2/2) <= exp(-d^2/2) exp(-t^2/2); ten more for the powers before it, one s for h_d
    tail = math.sqrt(2 * (10 - math.log(rtol))) + 1
    return max(float(gap), 0.0) + tail * float(problem.surface.s)


def _law(run: Run, step: Step) -> None:
    from mbma_tables.totals.law import MIN_LAW_RTOL, mbma_law

    problem, wanted = run.problem, run.problem.outputs
    assert step.rtol is not None
    assert step.tier is not None
    by_pressure = problem.prescribed == "nominal_pressures"
    tier, asked = step.tier, step.rtol
    while True:
        try:
            law = mbma_law(run.surface, asked, tier, problem.reading, problem.E_star)
        except OutOfRangeError:
            if not isinstance(tier, str) or tier not in TABLES:
                raise
            tier = "exact"
            continue
        if by_pressure:
            run.gap = law.separation(force=problem.gaps)
        # a gap found by force carries the error of the force
        error = 2 * law.error if by_pressure else law.error
        if wanted & {"stiffness", "conductance"}:
            error = _slope_error(law, run.gap, by_pressure)
        if error <= run.rtol or asked <= MIN_LAW_RTOL:
            break
        asked = max(0.1 * asked, MIN_LAW_RTOL)
    values = {"nominal_pressure": problem.gaps} if by_pressure else {}
    if "force" in wanted:
        values["force"] = law.force(run.gap)
    if "area" in wanted and "subscale_area" not in problem.dropped:
        values["area"] = law.area(run.gap)
    if "stiffness" in wanted:
        values |= {"stiffness": law.stiffness(run.gap), "stiffness_mean": law.stiffness_mean(run.gap)}
    if "energy" in wanted:
        values["energy"] = law.energy(run.gap)
    if "conductance" in wanted:
        from mbma_tables.totals.conductance import conductance, mean_conductivity

        assert problem.conductivities is not None
        k_s = mean_conductivity(*problem.conductivities)
        values["conductance"] = conductance(law.stiffness_mean(run.gap), k_s, problem.E_star)
    run.found |= {name: (("gap",), array) for name, array in values.items()}
    run.close(step, error, dataclasses.replace(step, tier=tier).tier_name)


def _slope_error(law: MbmaLaw, gap: Any, inverted: bool) -> float:
    """Bound on the relative error of the stiffness at these gaps, and of force, area and energy."""
    touching = gap[gap < law.h_max]
    if touching.size == 0:
        return law.error
    # F/l over the stiffness: large only next to a turning point
    ratio = law.force(touching) / ((law.h_max - touching) * np.abs(law.stiffness(touching)))
    moved = MAX_SLOPE_OF_STIFFNESS * law.error if inverted else 0.0
    return max(2 * law.error, float(((law.slope_error(touching) + moved) * ratio).max()))


def _totals(run: Run, step: Step) -> None:
    from mbma_tables.theories.contact import contact

    problem = run.problem
    assert step.rtol is not None
    assert step.tier is not None
    wanted = tuple(name for name in ("force", "area") if name in problem.outputs)
    if "subscale_area" in problem.dropped:
        wanted = tuple(name for name in wanted if name != "area")
    block = run.gap.size if step.tier_name in ("universal", "rigid") else BLOCK
    answers = []
    for first in range(0, run.gap.size, block):
        answer = contact(
            run.surface,
            run.gap[first : first + block],
            tier=step.tier,
            reading=problem.reading,
            E_star=problem.E_star,
            rtol=step.rtol,
            outside="exact" if step.tier_name in TABLES else "raise",
            quantities=wanted,
        )
        answers.append(answer)
        run.progress(step.name, min(first + block, run.gap.size), run.gap.size)
    for name in wanted:
        run.found[name] = (("gap",), np.concatenate([getattr(answer, name) for answer in answers]))
    run.close(step, max(float(answer.error.max()) for answer in answers), step.tier_name)


def _islands(run: Run, step: Step) -> None:
    from mbma_tables.scenes import statistics

    functions = {
        "hertz area": statistics.hertz_area,
        "island statistics": statistics.island_statistics,
        "profiles": statistics.profiles,
    }
    fields, error = functions[step.name](run.problem, run.surface, run.gap, step)
    run.found |= fields
    run.close(step, error, step.tier_name)


class OtherTheory(NamedTuple):
    """Force and area by a theory, and standard deviations of their logarithms; NaN where there is no answer."""

    force: FloatArray
    area: FloatArray
    scatter: FloatArray
    area_scatter: FloatArray


def other_theory(name: str, surface: Surface, gap: FloatArray, E_star: float) -> OtherTheory:
    """A theory, one of `effects.COMPARED`, at gaps; NaN where its force has no bound, as Persson's at u = 0."""
    from mbma_tables.theories.protocol import answer_where_finite
    from mbma_tables.theories.registry import get_theory

    if name == "persson_simplified":
        from mbma_tables.theories.persson import Persson

        theory: Theory = Persson("simplified")
    else:
        theory = get_theory(name)
    found = answer_where_finite(theory, surface, (float(surface.h_max) + gap) / 2)
    return OtherTheory(E_star * found.force, found.area, *theory.scatter(surface, found.area))


def _comparison(run: Run, step: Step) -> None:
    found = other_theory(step.name, run.problem.surface, run.gap, run.problem.E_star)
    run.found |= {f"{step.name}_force": (("gap",), found.force), f"{step.name}_area": (("gap",), found.area)}


_STEPS = {
    "law": _law,
    "totals": _totals,
    "hertz area": _islands,
    "island statistics": _islands,
    "profiles": _islands,
}


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


def _dataset(run: Run, plan: Plan) -> xr.Dataset:
    problem, units = run.problem, _units(run.problem)
    variables = {
        name: xr.Variable(dims, values, {"units": units[name][0], "long_name": units[name][1]})
        for name, (dims, values) in run.found.items()
    }
    named = ("separation", "mean_separation", "nominal_pressure", "profile_delta", "island_delta")
    facts: dict[str, Any] = {
        "title": problem.title,
        "plan": plan.text(),
        "rtol": plan.rtol,
        "error": max(run.errors.values(), default=0.0),
        "errors": json.dumps(run.errors),
        "reading": get_reading(problem.reading).name,
        "tiers": json.dumps(run.tiers),
        "switched_off": " ".join(sorted(problem.dropped)),
        "E_star": float(problem.E_star),
        "table_hashes": json.dumps(_hashes(problem, set(run.tiers.values()))),
    }
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
