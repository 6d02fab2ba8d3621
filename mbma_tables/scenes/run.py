"""Execute a plan: an xarray Dataset of quantities with their units and provenance.

Each step imports, reads and evaluates only what it needs.
"""

from __future__ import annotations

import dataclasses
import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.common.plots import Curve, theory_label
from mbma_tables.common.progress import doing
from mbma_tables.common.units import unit_of
from mbma_tables.contacts.source import MEANINGS
from mbma_tables.materials import ELASTIC_PSI
from mbma_tables.scenes.plan import AMPLIFICATION, TABLES, Plan, Step
from mbma_tables.scenes.problem import INVERTED, OF_CONTACT, Problem
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.self_affine import PARAMETERS
from mbma_tables.surfaces.surface import Surface
from mbma_tables.theories.mbma.island_models import RigidModel, answer_islands
from mbma_tables.theories.mbma.tables import get_model
from mbma_tables.theories.mbma.variants import Variant, get_variant

if TYPE_CHECKING:
    import xarray as xr

    from mbma_tables.theories.mbma.theory import Mbma

VALIDITY = (
    "valid",
    "scatter",
    "area_scatter",
    "stiffness_scatter",
    "unloading_stiffness_scatter",
    "separation_scatter",
)
YIELDED = ("yielded", "mean_pressure", "plane_separation", "unloading_stiffness")


@dataclasses.dataclass
class Run:
    """A plan in execution: values passed between steps, and results."""

    problem: Problem
    surface: AnySurface
    gap: Any = None  # separations d
    found: dict[str, tuple[tuple[str, ...], Any]] = dataclasses.field(default_factory=dict)
    errors: dict[str, float] = dataclasses.field(default_factory=dict)  # bounds that steps reached
    reasons: dict[str, list[int]] | None = None

    def keep(self, values: dict[str, Any], *dims: str) -> None:
        """Record values over dimensions, gaps by default."""
        self.found |= {name: (dims or ("gap",), array) for name, array in values.items()}


def _contact(run: Run, step: Step) -> None:
    """One contact at all gaps, and of it the requested quantities."""
    from mbma_tables.contacts.contact import contact

    problem, wanted, theory = run.problem, run.problem.outputs, run.problem.theory
    if theory == "mbma":
        from mbma_tables.theories.mbma.theory import Mbma

        assert step.island_model is not None
        assert step.rtol is not None
        theory = Mbma(step.island_model, problem.variant, step.rtol, _outside(step))
    assert problem.prescribed is not None
    known = {"separation": run.gap} if "finite_height" in problem.dropped else {problem.prescribed[:-1]: problem.gaps}
    if problem.hardness is not None:
        known["hardness"] = problem.hardness
    found = contact(run.surface, E_star=problem.E_star, theory=theory, **known)
    run.gap = found.separation if run.gap is None else run.gap
    names: list[str] = [name for name in OF_CONTACT[:4] if name in wanted]
    names += VALIDITY * ("validity" in wanted) + YIELDED * ("yield" in wanted)
    run.keep({n: getattr(found, n) for n in names if n != "area" or "subscale_area" not in problem.dropped})
    if "conductance" in wanted:
        assert problem.conductivities is not None
        run.keep({"conductance": found.conductance(*problem.conductivities)})
    if "leakage" in wanted:
        fields = {"": "K", "_valid": "valid", "_scatter": "scatter", "_blocked": "blocked"}
        run.keep({f"leakage{end}": getattr(found.leakage, field) for end, field in fields.items()})
    if "validity" in wanted:
        run.reasons = {reason: np.flatnonzero(mask).tolist() for reason, mask in found.reasons.items()}
    elastic = problem.theory == "mbma" and problem.hardness is None
    run.errors[step.name] = float(found.error.max()) * (_amplification(run, theory) if elastic else 1.0)


def _outside(step: Step) -> str:
    """What `outside` is for islands of a step: those that a table does not cover are solved."""
    return "exact" if step.island_model_name in TABLES else "raise"


def _amplification(run: Run, theory: Mbma) -> float:
    """Largest ratio of the errors of the requested quantities to that of force and area."""
    problem, h_max = run.problem, float(run.surface.h_max)
    gap = run.gap[run.gap < h_max]
    slopes = bool(problem.outputs & {"stiffness", "conductance"})
    if not gap.size or not (slopes or problem.prescribed in INVERTED):
        return 1.0
    found = theory.totals(run.surface, gap, slopes=True)
    steep = -found.pressure_slope / found.pressure
    factor = 1.0
    if problem.prescribed in INVERTED:
        # pressures at prescribed areas: less accurate where the area hardly rises
        by_area = steep * found.area / np.abs(found.area_slope)
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
    run.keep({name: getattr(law, name)(separation=run.gap) for name in problem.outputs & {"pressure", "area"}})
    run.errors[step.name] = error * law.error


def _asked(run: Run, step: Step) -> tuple[Any, Variant, float]:
    """The surface as profiles take it, variant and tolerance of a step."""
    assert step.rtol is not None
    shape: Any = run.surface
    if isinstance(shape, Surface):
        shape = float(shape.hurst), float(shape.zeta_1), float(shape.h_max / shape.h_rms)
    return shape, get_variant(run.problem.variant), step.rtol


def hertz_area(run: Run, step: Step) -> None:
    """A/A0 with eta = 1 in Eq. 38 (C.1)."""
    from mbma_tables.theories.mbma.profile import profile

    shape, variant, rtol = _asked(run, step)
    assert step.island_model is not None
    depth = (float(run.surface.h_max) - run.gap) / float(run.surface.h_rms)
    kept = profile(shape, get_model(step.island_model, rtol, variant), variant, rtol, _outside(step), rows=4)
    area = np.zeros(depth.shape)
    area[depth > 0] = kept.totals(depth[depth > 0])[3]
    run.keep({"area": area})
    run.errors[step.name] = kept.error


def island_statistics(run: Run, step: Step) -> None:
    """Number of islands at every gap; load, area, density along their approach (Eqs. 40, 42)."""
    from mbma_tables.theories.mbma.island import islands_of, scale_area, scale_force
    from mbma_tables.theories.mbma.profile import profile, source_of

    problem, surface, (shape, variant, rtol) = run.problem, run.surface, _asked(run, step)
    assert step.island_model is not None
    h_rms = float(surface.h_rms)
    depth = np.asarray(surface.h_max - run.gap) / h_rms
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
        phi = answer_islands(get_model(step.island_model, rtol, variant), g, _outside(step))
        pressure = problem.E_star * s / q0 * scale_force(g) * phi.phi_F
        share = g["eta"] if "subscale_area" in problem.dropped else 1.0
        area = scale_area(g) * phi.phi_A / share / q0**2
        shift, rate = source.heights(g, grid)
        spread = source.density(g, grid, shift - rate * depth[:, None])
        number, density = number * q0**2, np.where(grid <= depth[:, None], spread, 0.0) * q0**2 / s
        error = max(kept.error, float(np.max(phi.error)))
    run.keep({"island_number": number})
    run.keep({"island_delta": grid * h_rms, "island_force": pressure, "island_area": area}, "approach")
    run.keep({"island_density": density}, "gap", "approach")
    run.errors[step.name] = error


def profiles(run: Run, step: Step) -> None:
    """p(r) and d(r) of the islands at these approaches, solved exactly (Eqs. 34, 36, 37)."""
    from mbma_tables.theories.mbma import greenwood_tripp
    from mbma_tables.theories.mbma.island import islands_of

    problem = run.problem
    delta = np.atleast_1d(np.asarray(problem.deltas, dtype=float)).ravel()
    g, s, q0 = islands_of(run.surface, delta, get_variant(problem.variant))
    assert step.rtol is not None
    solved = greenwood_tripp.solve(g["X"], g["mu"], rtol=step.rtol)
    radius = np.sqrt(2 * g["R_d"] * g["sigma"])
    run.keep({"profile_delta": delta}, "island")
    pressure = problem.E_star * q0 * s * (g["sigma"] / radius)[:, None] * solved.pressure
    fields = {"profile_radius": solved.rho * radius[:, None] / q0, "profile_pressure": pressure}
    run.keep(fields | {"profile_gap": solved.gap * g["sigma"][:, None] * s}, "island", "node")
    run.errors[step.name] = float(np.max(solved.error))


def other_theory(name: str, surface: AnySurface, gap: FloatArray, E_star: float, hardness: float = math.inf) -> Curve:
    """A theory, by its name, at gaps; NaN where its force has no bound, as Persson's at u = 0."""
    from mbma_tables.theories import get_theory
    from mbma_tables.theories.users import answer_where_finite

    theory, u = get_theory(name, surface), (float(surface.h_max) + gap) / 2
    if hardness < math.inf:
        theory = theory.with_hardness(hardness, E_star)
    found = answer_where_finite(theory, surface, u)
    scatter = (theory.scatter(surface, quantity, found.area) for quantity in found._fields[:2])
    return Curve(theory_label(name), u / surface.h_rms, E_star * found.pressure, found.area, *scatter)


def comparison(run: Run, step: Step) -> None:
    """Another theory beside the scene's own."""
    problem = run.problem
    cap = math.inf if problem.hardness is None else problem.hardness
    other = other_theory(step.name, problem.surface, run.gap, problem.E_star, cap)
    run.keep({f"{step.name}_pressure": other.pressure, f"{step.name}_area": other.area})


def run_plan(problem: Problem, plan: Plan) -> xr.Dataset:
    """The quantities of a problem with units and provenance; raises if their error exceeds the tolerance."""
    surface, h_max = problem.surface, float(problem.surface.h_max)
    run = Run(problem, surface)
    if problem.prescribed in INVERTED:
        run.keep({"nominal_pressure" if problem.prescribed == "pressures" else "prescribed_area": problem.gaps})
    elif problem.gaps is not None:
        run.gap = problem.gaps if problem.prescribed == "separations" else 2 * problem.gaps - h_max
        if "finite_height" in problem.dropped:
            plain: Any = surface
            # exp(-(d + t)^2/2) <= exp(-d^2/2) exp(-t^2/2), of which less than a tenth of the tolerance is left beyond
            # this height; ten more for the powers before it, one s, or h_rms, for h_d
            tail = math.sqrt(2 * (10 - math.log(0.1 * plan.rtol))) + 1
            height = max(float(run.gap.max()), 0.0) + tail * float(getattr(surface, "s", surface.h_rms))
            run.surface = dataclasses.replace(plain, h_max=height)
    steps: dict[str, Any] = {"contact": _contact, "law": _law, "profiles": profiles}
    steps |= {"hertz area": hertz_area, "island statistics": island_statistics}
    for step in plan.steps:
        doing(f"{step.name}: {step.count}")
        steps.get(step.name, comparison)(run, step)
    error = max(run.errors.values(), default=0.0)
    if error > plan.rtol:
        raise ConvergenceError(
            f"the error bound reached is {error:.2e}, above rtol = {plan.rtol:.2e}: give a larger rtol"
        )
    if run.gap is not None:
        run.keep({"separation": run.gap, "mean_separation": (h_max + run.gap) / 2})
    return to_dataset(run, plan)


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
    return units | {"conductance": (problem.conductance_unit, "conductance per nominal area")}


def to_dataset(run: Run, plan: Plan) -> xr.Dataset:
    """The computed quantities; coordinates are gaps and the prescribed quantity."""
    import xarray as xr

    problem, units = run.problem, _units(run.problem)
    steps = [step for step in plan.steps if step.island_model is not None]
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
        "island_models": json.dumps({step.name: step.island_model_name for step in steps}),
        "switched_off": " ".join(sorted(problem.dropped)),
        "E_star": float(problem.E_star),
        "table_hashes": json.dumps(_hashes(steps)),
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


def _hashes(steps: list[Step]) -> dict[str, str]:
    """Hashes of the values of the tables used."""
    used: dict[Any, Any] = {step.island_model_name: step.island_model for step in steps}
    if not used.keys() & set(TABLES):
        return {}
    from mbma_tables.theories.mbma.tables import open_table

    tables = {name: open_table(name) if used[name] == name else used[name] for name in TABLES if name in used}
    return {name: str(table.content.attributes["values_sha256"]) for name, table in tables.items()}
