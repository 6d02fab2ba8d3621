"""The steps of a plan; each imports, reads and evaluates only what it needs."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.scenes.plan import AMPLIFICATION, TABLES, Step
from mbma_tables.scenes.problem import CORRELATIONS, INVERTED, OF_CONTACT, Problem
from mbma_tables.surfaces.any_surface import AnySurface

if TYPE_CHECKING:
    from mbma_tables.theories.mbma import Mbma
    from mbma_tables.theories.protocol import Theory

Progress = Callable[[str, int, int], None]
VALIDITY = ("valid", "scatter", "area_scatter", "stiffness_scatter", "separation_scatter")
YIELDED = ("yielded", "mean_pressure", "plane_separation", "unloading_stiffness")


@dataclasses.dataclass
class Run:
    """A plan in execution: values passed between steps, and results."""

    problem: Problem
    surface: AnySurface
    gap: Any = None  # separations d
    found: dict[str, tuple[tuple[str, ...], Any]] = dataclasses.field(default_factory=dict)
    errors: dict[str, float] = dataclasses.field(default_factory=dict)
    island_models: dict[str, str] = dataclasses.field(default_factory=dict)
    reasons: dict[str, list[int]] | None = None

    def keep(self, step: Step, values: dict[str, Any], error: float) -> None:
        """Record values at gaps, the error bound that a step reached, and its island model."""
        self.found |= {name: (("gap",), array) for name, array in values.items()}
        self.errors[step.name] = error
        if step.island_model_name is not None:
            self.island_models[step.name] = step.island_model_name


def _contact(run: Run, step: Step) -> None:
    """One contact at all gaps, and of it the requested quantities."""
    from mbma_tables.answers.contact import contact

    problem, wanted, theory = run.problem, run.problem.outputs, run.problem.theory
    if theory == "mbma":
        from mbma_tables.theories.mbma import Mbma

        assert step.island_model is not None
        assert step.rtol is not None
        outside = "exact" if step.island_model_name in TABLES else "raise"
        theory = Mbma(step.island_model, problem.variant, step.rtol, outside)
    assert problem.prescribed is not None
    known = {"separation": run.gap} if "finite_height" in problem.dropped else {problem.prescribed[:-1]: problem.gaps}
    if problem.hardness is not None:
        known["hardness"] = problem.hardness
    found = contact(run.surface, E_star=problem.E_star, theory=theory, **known)
    run.gap = found.separation if run.gap is None else run.gap
    names: list[str] = [name for name in OF_CONTACT[:4] if name in wanted]
    names += VALIDITY * ("validity" in wanted) + YIELDED * ("yield" in wanted)
    values = {name: getattr(found, name) for name in names if name != "area" or "subscale_area" not in problem.dropped}
    if "conductance" in wanted:
        from mbma_tables.totals.conductance import mean_conductivity

        assert problem.conductivities is not None
        k_s = mean_conductivity(*problem.conductivities)
        # yielded points unload elastically
        values["conductance"] = k_s / problem.E_star * found.unloading_stiffness
    if "leakage" in wanted:
        fields = {"": "K", "_valid": "valid", "_scatter": "scatter", "_blocked": "blocked"}
        values |= {f"leakage{end}": getattr(found.leakage, field) for end, field in fields.items()}
    if "validity" in wanted:
        run.reasons = {reason: np.flatnonzero(mask).tolist() for reason, mask in found.reasons.items()}
    error = float(found.error.max())
    if problem.theory == "mbma" and problem.hardness is None:
        error *= _amplification(run, theory)
    run.keep(step, values, error)


def _amplification(run: Run, theory: Mbma) -> float:
    """Largest ratio of the errors of the requested quantities to that of force and area."""
    problem, h_max = run.problem, float(run.surface.h_max)
    gap = run.gap[run.gap < h_max]
    slopes = bool(problem.outputs & {"stiffness", "conductance"})
    if not gap.size or not (slopes or problem.prescribed in INVERTED):
        return 1.0
    found = theory.totals(run.surface, gap, derivatives="separation")
    assert found.pressure_by is not None
    assert found.area_by is not None
    steep = -found.pressure_by["separation"] / found.pressure
    factor = 1.0
    if problem.prescribed in INVERTED:
        # pressures at prescribed areas: less accurate where the area hardly rises
        by_area = steep * found.area / np.abs(found.area_by["separation"])
        factor += max(1.0, float(by_area.max())) if problem.prescribed == "areas" else 1.0
    # the stiffness is small only next to a turning point
    flat = 1 / ((h_max - gap) * np.abs(steep))
    return factor * (AMPLIFICATION["slopes"] * max(1.0, float(flat.max())) if slopes else 1.0)


def _law(run: Run, step: Step) -> None:
    """Pressure and area of a theory other than MBMA by its law."""
    from mbma_tables.law.make import contact_law

    problem, error = run.problem, 1.0
    assert step.rtol is not None
    assert problem.prescribed is not None
    law = contact_law(run.surface, problem.theory, rtol=step.rtol, E_star=problem.E_star)
    if problem.prescribed in INVERTED:
        run.gap, error = law.separation(**{problem.prescribed[:-1]: problem.gaps}), AMPLIFICATION["inverse"]
    names = problem.outputs & {"pressure", "area"}
    run.keep(step, {name: getattr(law, name)(separation=run.gap) for name in names}, error * law.error)


def _islands(run: Run, step: Step) -> None:
    from mbma_tables.scenes import statistics

    fields, error = getattr(statistics, step.name.replace(" ", "_"))(run.problem, run.surface, run.gap, step)
    run.found |= fields
    run.keep(step, {}, error)


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
        pressure = problem.gaps if problem.prescribed == "pressures" else run.found["pressure"][1]
        k_s = conductance.mean_conductivity(*problem.conductivities)
        found = getattr(conductance, step.name)(problem.surface, pressure, k_s, problem.E_star, cap)
        run.found[f"{step.name}_conductance"] = (("gap",), found)
        return
    other = other_theory(step.name, problem.surface, run.gap, problem.E_star, cap)
    run.found |= {f"{step.name}_pressure": (("gap",), other.pressure), f"{step.name}_area": (("gap",), other.area)}


STEPS = {"contact": _contact, "law": _law}
STEPS |= dict.fromkeys(("hertz area", "island statistics", "profiles"), _islands)
