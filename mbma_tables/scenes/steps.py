"""The steps of a plan; each imports, reads and evaluates only what it needs."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.scenes.plan import Step
from mbma_tables.scenes.problem import CORRELATIONS, INVERTED, Problem
from mbma_tables.surfaces.any_surface import AnySurface

if TYPE_CHECKING:
    from mbma_tables.answers.result import Contact
    from mbma_tables.law.law import ContactLaw
    from mbma_tables.theories.protocol import Theory

Progress = Callable[[str, int, int], None]
TABLES = ("universal", "island4d")  # island models that are tables
MAX_SLOPE_OF_STIFFNESS = 3.0  # largest d log(stiffness)/d log(h_max - d); 5/2 next to first contact


@dataclasses.dataclass
class Run:
    """A plan in execution: values passed between steps, and results."""

    problem: Problem
    surface: AnySurface
    rtol: float
    progress: Progress
    gap: Any = None
    found: dict[str, tuple[tuple[str, ...], Any]] = dataclasses.field(default_factory=dict)
    errors: dict[str, float] = dataclasses.field(default_factory=dict)
    island_models: dict[str, str] = dataclasses.field(default_factory=dict)
    reasons: dict[str, list[int]] | None = None

    def close(self, step: Step, error: float, island_model: str | None) -> None:
        """Record the error bound that a step reached, and its island model."""
        self.errors[step.name] = error
        if island_model is not None:
            self.island_models[step.name] = island_model


def _law(run: Run, step: Step) -> None:
    """By a law; for MBMA its tolerance suffices for the requested slopes and gaps."""
    from mbma_tables.law.make import MIN_LAW_RTOL, contact_law

    problem, wanted = run.problem, run.problem.outputs
    assert step.rtol is not None
    inverse = problem.prescribed in INVERTED
    island_model, asked = step.island_model, step.rtol
    while True:
        own: dict[str, Any] = (
            {"theory": problem.theory} if step.theory else {"island_model": island_model, "variant": problem.variant}
        )
        try:
            law = contact_law(run.surface, rtol=asked, E_star=problem.E_star, **own)
        except OutOfRangeError:
            if not isinstance(island_model, str) or island_model not in TABLES:
                raise
            island_model = "exact"
            continue
        error = _find_gaps(run, law) if inverse else law.error
        if wanted & {"stiffness", "conductance"}:
            error = max(error, _slope_error(law, run.gap, inverse))
        if step.theory or error <= run.rtol or asked <= MIN_LAW_RTOL:
            break
        asked = max(0.1 * asked, MIN_LAW_RTOL)
    _keep(run, lambda name: getattr(law, name)(separation=run.gap))
    run.close(step, error, dataclasses.replace(step, island_model=island_model).island_model_name)


def _find_gaps(run: Run, law: ContactLaw) -> float:
    """Gaps at the pressures or areas prescribed; the bound on the error of force and area there."""
    if run.problem.prescribed == "pressures":
        run.gap = law.separation(pressure=run.problem.gaps)
        # a gap found by force carries the error of the force, and area falls less steeply
        return 2 * law.error
    run.gap = law.separation(area=run.problem.gaps)
    gap = run.gap[law.area(separation=run.gap) > 0]
    if not gap.size:
        return law.error
    # area falls by d, half as fast as by u
    ratio = law.stiffness(separation=gap) / 2 * law.area(separation=gap)
    ratio /= law.pressure(separation=gap) * law.area_slope(separation=gap)
    return (1 + max(1.0, float(ratio.max(initial=0.0)))) * law.error


def _keep(run: Run, quantity: Callable[[str], Any]) -> None:
    """The prescribed quantity, and the requested quantities at gaps, by name."""
    problem, wanted = run.problem, run.problem.outputs
    values: dict[str, Any] = {}
    if problem.prescribed in INVERTED:
        values["nominal_pressure" if problem.prescribed == "pressures" else "prescribed_area"] = problem.gaps
    for name in ("pressure", "area", "stiffness", "conductance", "energy"):
        if name == "conductance" and name in wanted:
            from mbma_tables.totals.conductance import conductance, mean_conductivity

            assert problem.conductivities is not None
            # yielded points unload elastically
            slope = quantity("stiffness" if problem.hardness is None else "unloading_stiffness")
            values[name] = conductance(slope, mean_conductivity(*problem.conductivities), problem.E_star)
        elif name in wanted and not (name == "area" and "subscale_area" in problem.dropped):
            values[name] = quantity(name)
    run.found |= {name: (("gap",), array) for name, array in values.items()}


def _contact(run: Run, step: Step) -> None:
    """Another theory, or one with a hardness, at the gaps themselves."""
    from mbma_tables.answers.contact import contact

    problem = run.problem
    assert problem.prescribed is not None
    known: dict[str, Any] = {problem.prescribed[:-1]: problem.gaps}
    if problem.hardness is not None:
        known["hardness"] = problem.hardness
        if problem.theory == "mbma":
            known |= {"variant": problem.variant, "rtol": step.rtol, "island_model": step.island_model}
    found = contact(run.surface, E_star=problem.E_star, theory=problem.theory, **known)
    run.gap = found.separation
    _keep(run, lambda name: getattr(found, name))
    if problem.hardness is not None:
        names = ("yielded", "mean_pressure", "plane_separation", "unloading_stiffness")
        run.found |= {name: (("gap",), getattr(found, name)) for name in names}
    run.close(step, float(found.error.max()), step.island_model_name)


def _asked(run: Run) -> Contact:
    """The scene's contact, with derived quantities."""
    from mbma_tables.answers.contact import contact
    from mbma_tables.theories.mbma import Mbma

    problem = run.problem
    theory = Mbma(variant=problem.variant, outside="nan") if problem.theory == "mbma" else problem.theory
    yields = {} if problem.hardness is None else {"hardness": problem.hardness, "E_star": problem.E_star}
    return contact(run.problem.surface, separation=run.gap, theory=theory, **yields)


def _leakage(run: Run, step: Step) -> None:
    found = _asked(run).leakage
    fields = {"": found.K, "_valid": found.valid, "_scatter": found.scatter, "_blocked": found.blocked}
    run.found |= {f"leakage{end}": (("gap",), values) for end, values in fields.items()}


def _validity(run: Run, step: Step) -> None:
    found = _asked(run)
    names = ("valid", "scatter", "area_scatter", "stiffness_scatter", "separation_scatter")
    run.found |= {name: (("gap",), getattr(found, name)) for name in names}
    run.reasons = {reason: np.flatnonzero(mask).tolist() for reason, mask in found.reasons.items()}


def _slope_error(law: ContactLaw, gap: Any, inverted: bool) -> float:
    """Bound on the relative error of the stiffness at these gaps, and of force, area and energy."""
    touching = gap[gap < law.h_max]
    if touching.size == 0:
        return law.error
    # F/l over the stiffness: large only next to a turning point
    steep = (law.h_max - touching) * np.abs(law.stiffness(separation=touching))
    ratio = 2 * law.pressure(separation=touching) / steep
    moved = MAX_SLOPE_OF_STIFFNESS * law.error if inverted else 0.0
    return max(2 * law.error, float(((law.slope_error(separation=touching) + moved) * ratio).max()))


def _totals(run: Run, step: Step) -> None:
    from mbma_tables.answers.contact import contact

    problem = run.problem
    assert step.rtol is not None
    assert step.island_model is not None
    own = {"pressure"} if "subscale_area" in problem.dropped else {"pressure", "area"}
    wanted = tuple(sorted(problem.outputs & own, reverse=True))
    found = contact(
        run.surface,
        separation=run.gap,
        island_model=step.island_model,
        variant=problem.variant,
        E_star=problem.E_star,
        rtol=step.rtol,
        outside="exact" if step.island_model_name in TABLES else "raise",
    )
    run.found |= {name: (("gap",), getattr(found, name)) for name in wanted}
    run.close(step, float(found.error.max()), step.island_model_name)


def _islands(run: Run, step: Step) -> None:
    from mbma_tables.scenes import statistics

    functions = {
        "hertz area": statistics.hertz_area,
        "island statistics": statistics.island_statistics,
        "profiles": statistics.profiles,
    }
    fields, error = functions[step.name](run.problem, run.surface, run.gap, step)
    run.found |= fields
    run.close(step, error, step.island_model_name)


class OtherTheory(NamedTuple):
    """Force and area by a theory, and standard deviations of their logarithms; NaN where the theory has none."""

    pressure: FloatArray
    area: FloatArray
    scatter: FloatArray
    area_scatter: FloatArray


def other_theory(
    name: str, surface: AnySurface, gap: FloatArray, E_star: float, hardness: float = math.inf
) -> OtherTheory:
    """A theory, one of `effects.COMPARED`, at gaps; NaN where its force has no bound, as Persson's at u = 0."""
    from mbma_tables.theories import get_theory
    from mbma_tables.theories.numerical import answer_where_finite

    if name == "persson_simplified":
        from mbma_tables.theories.persson import Persson

        theory: Theory = Persson("simplified")
    else:
        theory = get_theory(name, surface)
    if hardness < math.inf:
        from mbma_tables.theories.yielding import WITH_HARDNESS, Yielding

        theory = WITH_HARDNESS.get(type(theory), Yielding)(theory, hardness / E_star)
    found = answer_where_finite(theory, surface, (float(surface.h_max) + gap) / 2)
    return OtherTheory(
        E_star * found.pressure, found.area, *(theory.scatter(surface, name, found.area) for name in found._fields[:2])
    )


def comparison(run: Run, step: Step) -> None:
    """Another theory, or a correlation of conductance, beside the scene's own."""
    problem = run.problem
    cap = math.inf if problem.hardness is None else problem.hardness
    if step.name in CORRELATIONS:
        from mbma_tables.totals import conductance

        assert problem.conductivities is not None
        pressure = (run.found.get("nominal_pressure") or run.found["pressure"])[1]
        k_s = conductance.mean_conductivity(*problem.conductivities)
        found = getattr(conductance, step.name)(problem.surface, pressure, k_s, problem.E_star, cap)
        run.found[f"{step.name}_conductance"] = (("gap",), found)
        return
    other = other_theory(step.name, problem.surface, run.gap, problem.E_star, cap)
    run.found |= {f"{step.name}_pressure": (("gap",), other.pressure), f"{step.name}_area": (("gap",), other.area)}


STEPS = {
    "law": _law,
    "contact": _contact,
    "totals": _totals,
    "hertz area": _islands,
    "island statistics": _islands,
    "validity": _validity,
    "leakage": _leakage,
    "profiles": _islands,
}
