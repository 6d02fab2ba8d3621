"""Execute a plan: an xarray Dataset of quantities with their units and provenance.

Each step imports, reads and evaluates only what it needs.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.display import Variable, dataset_of
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.common.progress import doing
from mbma_tables.contacts.quantities.declaration import of_yielding_contacts
from mbma_tables.contacts.quantities.registry import registry, unit_of
from mbma_tables.contacts.question import both_separations
from mbma_tables.design.scenes.plan import AMPLIFICATION, LEAKAGE, Plan, Step
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.self_affine import PARAMETERS
from mbma_tables.tables.open import open_islands
from mbma_tables.tables.schema import KINDS
from mbma_tables.theories import resolve

if TYPE_CHECKING:
    import xarray as xr

    from mbma_tables.contacts.result import Contact


# names of prescribed quantities in results, beside what is computed
GIVEN = {"pressure": "nominal_pressure", "area": "prescribed_area"}
# what scenes have besides the quantities of contacts: one with the same unit, and the meaning
OF_SCENES = {
    "nominal_pressure": ("pressure", "F/A0 as prescribed"),
    "prescribed_area": ("area", "A/A0 as prescribed"),
    "island_number": ("D", "islands in contact per nominal area (Eq. 42)"),
    "island_delta": ("delta", "approach of an island"),
    "island_force": ("island_force", "load of an island at that approach"),
    "island_area": ("island_area", "contact area of an island at that approach"),
    "island_density": ("island_density", "islands per nominal area and approach"),
    "profile_delta": ("delta", "approach of the island"),
    "profile_radius": ("R_d", "radius r in the island"),
    "profile_pressure": ("pressure", "pressure p(r) (Eq. 36)"),
    "profile_gap": (
        "separation",
        "d(r), deformed sphere to mid-plane of the summits (Eq. 34)",
    ),
}
# the gaps, the prescribed quantity, and what islands are ordered by
COORDINATES = {
    *("separation", "mean_separation", "profile_delta", "island_delta"),
    *GIVEN.values(),
}


@dataclasses.dataclass
class Run:
    """A plan in execution: values passed between steps, and results."""

    scene: Any  # a `Scene`, whose module imports this one
    surface: AnySurface
    gap: Any = None  # separations d
    variables: dict[str, Variable] = dataclasses.field(default_factory=dict)
    # bounds that steps reached
    errors: dict[str, float] = dataclasses.field(default_factory=dict)
    reasons: dict[str, list[int]] | None = None
    evidence: str = ""

    def keep(
        self, name: str, values: ArrayLike, *dims: str, like: str = "", meaning: str = ""
    ) -> None:
        """Record values over dimensions, gaps by default.

        Unit and meaning are those of the declaration, or of `OF_SCENES`; `like` is another
        quantity with the unit.
        """
        alike, of_scene = OF_SCENES.get(name, (like or name, ""))
        unit = unit_of(alike, self.scene.in_units.units)
        meaning = meaning or of_scene or registry()[alike].meaning
        self.variables[name] = Variable(values, unit, meaning, dims or ("gap",))

    def summing(self, step: Step) -> Any:
        """The theory that sums islands, with what the plan chose for a step."""
        # islands that a table does not cover are solved
        options = self.scene.options | {
            "island_model": step.island_model,
            "rtol": step.rtol,
            "outside": "exact" if step.island_model_name in KINDS else "raise",
        }
        return resolve(self.scene.theory, options=options)


def _contact(run: Run, step: Step) -> None:
    """One contact at all gaps, and of it the requested quantities."""
    from mbma_tables.contacts.contact import contact_of

    scene = run.scene
    theory = run.summing(step) if scene.sums_islands else scene.theory
    given = {scene.question.name: scene.question.value}
    # without its end the surface is a higher one, whose mean gaps are others than the scene's
    if "finite_height" in scene.without:
        given = {"separation": run.gap}
    pressed = contact_of(run.surface, scene.in_units, given, theory)
    if run.gap is None:
        run.gap = pressed.separation
    _keep_quantities(run, pressed)
    error = float(pressed.error.max())
    if scene.sums_islands and not scene.in_units.yields:
        error *= _amplification(run, theory)
    run.errors[step.name] = error


def _keep_quantities(run: Run, pressed: Contact) -> None:
    """Record the requested quantities of a contact."""
    names = [name for name in run.scene.of_contact if name != LEAKAGE]
    if "valid" in names:
        # with the model uncertainty of every quantity that such contacts show
        uncertainties = {declared.uncertainty for declared in registry().values()}
        names += [
            name
            for name, declared in registry().items()
            if name in uncertainties and declared.is_shown(pressed)
        ]
        # places of the entries that each reason concerns
        run.reasons = {
            reason: np.flatnonzero(is_concerned).tolist()
            for reason, is_concerned in pressed.reasons.items()
        }
        run.evidence = pressed.evidence
    if pressed.yields:
        # how near the pressure of the spots is to the hardness, and what elastic contacts lack
        names.append("mean_pressure")
        names += [
            name
            for name, declared in registry().items()
            if declared.is_listed is of_yielding_contacts
        ]
    # some are one number for all gaps
    shape = np.shape(pressed.mean_separation)
    for name in names:
        values = np.broadcast_to(pressed.quantity(name), shape)
        declared = registry()[name]
        run.variables[name] = Variable(
            values, declared.unit(pressed), declared.meaning, ("gap",)
        )
    if LEAKAGE in run.scene.quantities:
        for key, variable in pressed.leakage.to_dataset().data_vars.items():
            field = LEAKAGE if key == "K" else f"{LEAKAGE}_{key}"
            facts = variable.attrs
            run.variables[field] = Variable(
                variable.values, facts["units"], facts["long_name"], ("gap",)
            )


def _amplification(run: Run, theory: Any) -> float:
    """Largest ratio of the errors of the requested quantities to that of force and area."""
    scene = run.scene
    h_max = float(run.surface.h_max)
    gap = run.gap[run.gap < h_max]
    if not gap.size or not (scene.needs_slopes or scene.is_inverted):
        return 1.0
    totals = theory.totals(run.surface, gap, slopes=True)
    # -d ln p/dd
    log_slope = -totals.pressure_slope / totals.pressure
    factor = 1.0
    if scene.is_inverted and scene.area is not None:
        # pressures at prescribed areas: less accurate where the area hardly rises
        by_area = log_slope * totals.area / np.abs(totals.area_slope)
        factor += max(1.0, float(by_area.max()))
    if not scene.needs_slopes:
        return factor
    # the stiffness is small only next to a turning point
    flatness = 1 / ((h_max - gap) * np.abs(log_slope))
    return factor * (AMPLIFICATION["slopes"] * max(1.0, float(flatness.max())))


def _law(run: Run, step: Step) -> None:
    """Pressure and area of a theory other than MBMA by its law."""
    from mbma_tables.contacts.law.make import contact_law

    scene = run.scene
    rtol = {} if step.rtol is None else {"rtol": step.rtol}
    law = contact_law(run.surface, scene.bodies, theory=scene.theory, **rtol)
    if scene.is_inverted:
        run.gap = law.separations_of(scene.question)
    for name in scene.of_contact:
        run.keep(name, getattr(law, name)(separation=run.gap))
    factor = AMPLIFICATION["inverse"] if scene.is_inverted else 1.0
    run.errors[step.name] = factor * law.error


def hertz_area(run: Run, step: Step) -> None:
    """A/A0 with eta = 1 in Eq. 38 (C.1)."""
    from mbma_tables.theories.mbma.profile import profile, shape_of

    surface = run.surface
    model, variant, rtol, outside = run.summing(step).sums
    along_depth = profile(shape_of(surface), model, variant, rtol, outside, rows=4)
    depth = (float(surface.h_max) - run.gap) / float(surface.h_rms)
    area = np.zeros(depth.shape)
    area[depth > 0] = along_depth.totals(depth[depth > 0])[3]
    run.keep("area", area, meaning="Hertz area of the summits over A0 (eta = 1)")
    run.errors[step.name] = along_depth.error


def island_statistics(run: Run, step: Step) -> None:
    """Number of islands at every gap; load, area, density along their approach (Eqs. 40, 42)."""
    from mbma_tables.theories.mbma.sums import distribution

    # without the area of smaller scales, all of the summit's area is in contact: eta = 1
    of_summits = "subscale_area" in run.scene.without
    how = run.summing(step).sums
    found = distribution(run.surface, run.gap, run.scene.points, how, of_summits)
    found["force"] = float(run.scene.in_units.E_star) * found["force"]
    run.errors[step.name] = float(np.max(found.pop("error")))
    run.keep("island_number", found.pop("number"))
    run.keep("island_density", found.pop("density"), "gap", "approach")
    for name, values in found.items():
        run.keep(f"island_{name}", values, "approach")


def profiles(run: Run, step: Step) -> None:
    """p(r) and d(r) of the islands at these approaches, solved exactly (Eqs. 34, 36, 37)."""
    from mbma_tables.theories.mbma.island import profiles_of

    theory = run.summing(step)
    delta = np.ravel(run.scene.deltas)
    radius, pressure, gap, error = profiles_of(
        run.surface, delta, theory.variant, theory.rtol
    )
    nodes = ("island", "node")
    run.keep("profile_delta", delta, "island")
    run.keep("profile_radius", radius, *nodes)
    run.keep("profile_pressure", float(run.scene.in_units.E_star) * pressure, *nodes)
    run.keep("profile_gap", gap, *nodes)
    run.errors[step.name] = error


def comparison(run: Run, step: Step) -> None:
    """Another theory beside the scene's own."""
    from mbma_tables.contacts.contact import contact_where_finite

    scene = run.scene
    other = contact_where_finite(scene.surface, scene.in_units, run.gap, step.name)
    for name, letter in (("pressure", "F"), ("area", "A")):
        meaning = f"{letter}/A0 by {step.name}"
        values = other.quantity(name)
        run.keep(f"{step.name}_{name}", values, like=name, meaning=meaning)


def run_plan(scene: Any, plan: Plan) -> xr.Dataset:
    """The quantities of a scene with units and provenance.

    Raises
    ------
    ConvergenceError
        If their error exceeds the tolerance.
    """
    run = Run(scene, scene.surface)
    h_max = float(scene.surface.h_max)
    question = scene.question
    if question is not None and question.is_gap:
        run.gap, _ = both_separations(question.name, question.value, h_max, False)
        if "finite_height" in scene.without:
            run.surface = _without_end(scene.surface, run.gap, plan.rtol)
    elif question is not None:
        run.keep(GIVEN[question.name], question.value)
    # steps by name; any other name is that of a theory to compare with
    evaluated_by: dict[str, Callable[[Run, Step], None]] = {
        "contact": _contact,
        "law": _law,
        "profiles": profiles,
        "hertz area": hertz_area,
        "island statistics": island_statistics,
    }
    for step in plan.steps:
        doing(f"{step.name}: {step.count}")
        evaluated_by.get(step.name, comparison)(run, step)
    error = max(run.errors.values(), default=0.0)
    if error > plan.rtol:
        reached = f"the error bound reached is {error:.2e}, above rtol = {plan.rtol:.2e}"
        raise ConvergenceError(f"{reached}: give a larger rtol")
    if run.gap is not None:
        run.keep("separation", run.gap)
        run.keep("mean_separation", (h_max + run.gap) / 2)
    found = dataset_of(run.variables, {})
    found.attrs = _attributes(run, plan)
    return found.set_coords(sorted(COORDINATES & run.variables.keys()))


def _without_end(surface: Any, gap: FloatArray, rtol: float) -> AnySurface:
    """The surface with an h_max beyond which nothing contributes at the gaps."""
    # exp(-(d + t)^2/2) <= exp(-d^2/2) exp(-t^2/2), of which less than a tenth of the tolerance is
    # left beyond this height; ten more for the powers before it, one s, or h_rms, for h_d
    tail = math.sqrt(2 * (10 - math.log(0.1 * rtol))) + 1
    s = float(getattr(surface, "s", surface.h_rms))
    height = max(float(gap.max()), 0.0) + tail * s
    higher: AnySurface = dataclasses.replace(surface, h_max=height)
    return higher


def _attributes(run: Run, plan: Plan) -> dict[str, Any]:
    """What the quantities were calculated from and how."""
    scene = run.scene
    models = {
        step.name: step.island_model
        for step in plan.steps
        if step.island_model is not None
    }
    names = {step: getattr(model, "name", model) for step, model in models.items()}
    variant = ""
    if scene.sums_islands:
        variant = resolve(scene.theory, options=scene.options).variant_name
    attributes: dict[str, Any] = {
        "title": scene.title,
        "plan": plan.text(),
        "rtol": plan.rtol,
        "error": max(run.errors.values(), default=0.0),
        "errors": json.dumps(run.errors),
        "theory": scene.theory_name,
        "variant": variant,
        "island_models": json.dumps(names),
        "switched_off": " ".join(sorted(scene.without)),
        "E_star": float(scene.in_units.E_star),
        "table_hashes": json.dumps(_hashes(list(models.values()))),
    }
    if scene.in_units.yields:
        attributes["hardness"] = float(scene.in_units.hardness)
        attributes["psi"] = float(scene.state.psi)
    else:
        attributes["elastic_hardness"] = float(scene.state.elastic_hardness)
    if run.reasons is not None:
        attributes["reasons"] = json.dumps(run.reasons)
        attributes["evidence"] = run.evidence
    for name in PARAMETERS:
        number = getattr(scene.surface, name)
        # a spectrum that is no power law has no Hurst exponent
        if number is not None:
            attributes[f"surface_{name}"] = float(number)
    return attributes


def _hashes(models: list[Any]) -> dict[str, str]:
    """Hashes of the values of the tables used, which are named or objects that a user opened."""
    hashes = {}
    for model in models:
        table = (
            open_islands(model) if isinstance(model, str) and model in KINDS else model
        )
        content = getattr(table, "content", None)
        if content is not None:
            hashes[table.name] = str(content.attributes["values_sha256"])
    return hashes
