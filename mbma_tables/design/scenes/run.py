"""Execute a plan: an xarray Dataset of quantities with their units and provenance.

Each step imports, reads and evaluates only what it needs.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.bodies.adhesion import AdhesionInUnits
from mbma_tables.bodies.materials import ELASTIC_PSI
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.common.plots import Curve, theory_label
from mbma_tables.common.progress import doing
from mbma_tables.contacts.quantities.declaration import of_yielding_contacts
from mbma_tables.contacts.quantities.registry import registry, unit_of
from mbma_tables.design.scenes.plan import AMPLIFICATION, LEAKAGE, TABLES, Plan, Step
from mbma_tables.islands.island_models import RigidModel, answer_islands
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.self_affine import PARAMETERS
from mbma_tables.surfaces.surface import Surface
from mbma_tables.theories import resolve
from mbma_tables.theories.adhesion import with_adhesion
from mbma_tables.theories.hardness import with_hardness
from mbma_tables.theories.mbma.models import get_model

if TYPE_CHECKING:
    import xarray as xr

    from mbma_tables.contacts.result import Contact
    from mbma_tables.theories.mbma.profile import Shape


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
    "hertz_area": ("area", "Hertz area of the summits over A0 (eta = 1)"),
}
# the gaps, the prescribed quantity, and what islands are ordered by
COORDINATES = (
    "separation",
    "mean_separation",
    *GIVEN.values(),
    "profile_delta",
    "island_delta",
)


@dataclasses.dataclass
class Run:
    """A plan in execution: values passed between steps, and results."""

    scene: Any  # a `Scene`, whose module imports this one
    surface: AnySurface
    gap: Any = None  # separations d
    # dimensions, values, unit and meaning by name
    quantities: dict[str, tuple[tuple[str, ...], ArrayLike, str, str]] = (
        dataclasses.field(default_factory=dict)
    )
    errors: dict[str, float] = dataclasses.field(
        default_factory=dict
    )  # bounds that steps reached
    reasons: dict[str, list[int]] | None = None

    def keep(
        self,
        name: str,
        values: ArrayLike,
        *dims: str,
        unit: str | None = None,
        meaning: str | None = None,
        same: str = "",
    ) -> None:
        """Record values over dimensions, gaps by default.

        Unit and meaning are those of the declaration, or of `OF_SCENES`; `same` is a name
        whose unit and meaning they are.
        """
        of_scene = OF_SCENES.get(same or name)
        like = of_scene[0] if of_scene else same or name
        if unit is None:
            unit = unit_of(like, self.scene.in_units.units)
        if meaning is None:
            meaning = of_scene[1] if of_scene else registry()[like].meaning
        self.quantities[name] = (dims or ("gap",), values, unit, meaning)


def _contact(run: Run, step: Step) -> None:
    """One contact at all gaps, and of it the requested quantities."""
    from mbma_tables.contacts.contact import contact_of

    scene = run.scene
    theory = scene.theory
    if scene.sums_islands:
        options = {
            "island_model": step.island_model,
            "variant": scene.variant,
            "rtol": step.rtol,
            "outside": _outside(step),
        }
        theory = resolve(theory, options=options)
    assert scene.question is not None
    given = {scene.question.name: scene.question.value}
    # without its end the surface is a higher one, whose mean gaps are others than the scene's
    if "finite_height" in scene.without:
        given = {"separation": run.gap}
    pressed = contact_of(run.surface, scene.in_units, given, theory)
    if run.gap is None:
        run.gap = pressed.separation
    _keep_quantities(run, pressed)
    error = float(pressed.error.max())
    if scene.sums_islands and not scene.yields:
        error *= _amplification(run, theory)
    run.errors[step.name] = error


def _keep_quantities(run: Run, pressed: Contact) -> None:
    """Record the requested quantities of a contact."""
    names = [name for name in run.scene.of_contact if name in registry()]
    if "valid" in names:
        # with the model uncertainty of every quantity that such contacts show
        uncertainties = {declared.uncertainty for declared in registry().values()}
        names += [
            name
            for name, declared in registry().items()
            if name in uncertainties and declared.is_shown(pressed)
        ]
        # places of the entries that each reason concerns
        run.reasons = {}
        for reason, is_concerned in pressed.reasons.items():
            run.reasons[reason] = np.flatnonzero(is_concerned).tolist()
    if run.scene.yields:
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
        run.keep(name, values, unit=registry()[name].unit(pressed))
    if LEAKAGE in run.scene.quantities:
        for key, variable in pressed.leakage.to_dataset().data_vars.items():
            field = LEAKAGE if key == "K" else f"{LEAKAGE}_{key}"
            facts = variable.attrs
            run.keep(
                field, variable.values, unit=facts["units"], meaning=facts["long_name"]
            )


def _outside(step: Step) -> str:
    """What `outside` is for islands of a step: those that a table does not cover are solved."""
    return "exact" if step.island_model_name in TABLES else "raise"


def _amplification(run: Run, theory: Any) -> float:
    """Largest ratio of the errors of the requested quantities to that of force and area."""
    scene = run.scene
    h_max = float(run.surface.h_max)
    gap = run.gap[run.gap < h_max]
    is_inverted = scene.is_inverted
    needs_slopes = scene.needs_slopes
    if not gap.size or not (needs_slopes or is_inverted):
        return 1.0
    totals = theory.totals(run.surface, gap, slopes=True)
    # -d ln p/dd
    log_slope = -totals.pressure_slope / totals.pressure
    factor = 1.0
    if is_inverted:
        # pressures at prescribed areas: less accurate where the area hardly rises
        by_area = log_slope * totals.area / np.abs(totals.area_slope)
        at_areas = scene.area is not None
        factor += max(1.0, float(by_area.max())) if at_areas else 1.0
    if not needs_slopes:
        return factor
    # the stiffness is small only next to a turning point
    flatness = 1 / ((h_max - gap) * np.abs(log_slope))
    return factor * (AMPLIFICATION["slopes"] * max(1.0, float(flatness.max())))


def _law(run: Run, step: Step) -> None:
    """Pressure and area of a theory other than MBMA by its law."""
    from mbma_tables.contacts.law.make import contact_law

    scene = run.scene
    assert step.rtol is not None
    assert scene.question is not None
    law = contact_law(run.surface, scene.bodies, theory=scene.theory, rtol=step.rtol)
    amplification = 1.0
    if scene.is_inverted:
        run.gap = law.separations_of(scene.question)
        amplification = AMPLIFICATION["inverse"]
    for name in scene.of_contact:
        run.keep(name, getattr(law, name)(separation=run.gap))
    run.errors[step.name] = amplification * law.error


def _shape(surface: AnySurface) -> Shape:
    """The surface as profiles take it."""
    if not isinstance(surface, Surface):
        return cast("Shape", surface)
    return (
        float(surface.hurst),
        float(surface.zeta_1),
        float(surface.h_max / surface.h_rms),
    )


def hertz_area(run: Run, step: Step) -> None:
    """A/A0 with eta = 1 in Eq. 38 (C.1)."""
    from mbma_tables.theories.mbma.profile import profile

    assert step.island_model is not None
    assert step.rtol is not None
    surface = run.surface
    variant = run.scene.variant
    island_model = get_model(step.island_model, step.rtol, variant)
    depth = (float(surface.h_max) - run.gap) / float(surface.h_rms)
    along_depth = profile(
        _shape(surface),
        island_model,
        variant,
        step.rtol,
        _outside(step),
        rows=4,
    )
    is_touching = depth > 0
    area = np.zeros(depth.shape)
    area[is_touching] = along_depth.totals(depth[is_touching])[3]
    run.keep("area", area, meaning=OF_SCENES["hertz_area"][1])
    run.errors[step.name] = along_depth.error


def island_statistics(run: Run, step: Step) -> None:
    """Number of islands at every gap; load, area, density along their approach (Eqs. 40, 42)."""
    from mbma_tables.theories.mbma.island import islands_of, scale_area, scale_force
    from mbma_tables.theories.mbma.profile import profile, source_of

    assert step.island_model is not None
    assert step.rtol is not None
    scene = run.scene
    assert scene.points is not None
    surface = run.surface
    shape = _shape(surface)
    variant = scene.variant
    h_rms = float(surface.h_rms)
    depth = np.asarray(surface.h_max - run.gap) / h_rms
    source = source_of(shape, variant)
    deepest = max(float(depth.max()), 0.0)
    # approaches up to the deepest, graded towards first contact
    fraction = np.linspace(0, 1, scene.points + 1)[1:]
    stretched = fraction * np.arcsinh(np.sqrt(deepest / source.layer))
    delta = source.layer * np.sinh(stretched) ** 2
    # where no gap touches there is no distribution
    number = np.zeros(depth.size)
    density = np.zeros((depth.size, delta.size))
    pressure = np.zeros(delta.size)
    area = np.zeros(delta.size)
    error = 0.0
    if deepest > 0:
        # islands are counted without an island model
        counted = profile(shape, RigidModel(), variant, step.rtol, rows=3)
        number[depth > 0] = counted.totals(depth[depth > 0])[2]
        groups, s, q0 = islands_of(surface, delta * h_rms, variant)
        island_model = get_model(step.island_model, step.rtol, variant)
        phi = answer_islands(island_model, groups, _outside(step))
        pressure = scene.E_star * s / q0 * scale_force(groups) * phi.phi_F
        # without the area of smaller scales, all of the summit's area is in contact: eta = 1
        eta = groups["eta"] if "subscale_area" in scene.without else 1.0
        area = scale_area(groups) * phi.phi_A / eta / q0**2
        shift, rate = source.heights(groups, delta)
        spread = source.density(groups, delta, shift - rate * depth[:, None])
        number = number * q0**2
        # no island approaches further than the highest one
        density = np.where(delta <= depth[:, None], spread, 0.0) * q0**2 / s
        error = max(counted.error, float(np.max(phi.error)))
    run.keep("island_number", number)
    run.keep("island_delta", delta * h_rms, "approach")
    run.keep("island_force", pressure, "approach")
    run.keep("island_area", area, "approach")
    run.keep("island_density", density, "gap", "approach")
    run.errors[step.name] = error


def profiles(run: Run, step: Step) -> None:
    """p(r) and d(r) of the islands at these approaches, solved exactly (Eqs. 34, 36, 37)."""
    from mbma_tables.islands import greenwood_tripp
    from mbma_tables.theories.mbma.island import islands_of

    assert step.rtol is not None
    scene = run.scene
    delta = np.ravel(scene.deltas)
    groups, s, q0 = islands_of(run.surface, delta, scene.variant)
    sigma = groups["sigma"]
    solved = greenwood_tripp.solve(groups["X"], groups["mu"], rtol=step.rtol)
    radius = np.sqrt(2 * groups["R_d"] * sigma)
    run.keep("profile_delta", delta, "island")
    pressure = scene.E_star * q0 * s * (sigma / radius)[:, None] * solved.pressure
    nodes = ("island", "node")
    run.keep("profile_radius", solved.rho * radius[:, None] / q0, *nodes)
    run.keep("profile_pressure", pressure, *nodes)
    run.keep("profile_gap", solved.gap * sigma[:, None] * s, *nodes)
    run.errors[step.name] = float(np.max(solved.error))


def other_theory(
    theory: Any,
    surface: AnySurface,
    gap: FloatArray,
    E_star: float,
    hardness: float = math.inf,
    adhesion: AdhesionInUnits | None = None,
) -> Curve:
    """A theory, given as for `contact`, at gaps; NaN where its force has no bound, as Persson's at u = 0."""
    from mbma_tables.theories.users import answer_where_finite

    chosen = resolve(theory, surface)
    u = (float(surface.h_max) + gap) / 2
    if hardness < math.inf:
        chosen = with_hardness(chosen, hardness, E_star)
    elif adhesion is not None:
        chosen = with_adhesion(chosen, adhesion, E_star)
    answer = answer_where_finite(chosen, surface, u)
    of_pressure, of_area = answer._fields[:2]
    return Curve(
        theory_label(chosen.name),
        u / surface.h_rms,
        E_star * answer.pressure,
        answer.area,
        chosen.scatter(surface, of_pressure, answer.area),
        chosen.scatter(surface, of_area, answer.area),
    )


def comparison(run: Run, step: Step) -> None:
    """Another theory beside the scene's own."""
    scene = run.scene
    cap = float(scene.in_units.hardness)
    other = other_theory(
        *(step.name, scene.surface, run.gap, scene.E_star, cap),
        adhesion=scene.in_units.adhesion,
    )
    for name, values in (("pressure", other.pressure), ("area", other.area)):
        letter = "F" if name == "pressure" else "A"
        meaning = f"{letter}/A0 by {step.name}"
        run.keep(f"{step.name}_{name}", values, meaning=meaning, same=name)


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
        is_separation = question.name == "separation"
        run.gap = question.value if is_separation else 2 * question.value - h_max
        if "finite_height" in scene.without:
            run.surface = _without_end(scene.surface, run.gap, plan.rtol)
    elif question is not None:
        run.keep(GIVEN[question.name], question.value)
    # steps of a plan by name; any other name is that of a theory to compare with
    evaluated_by: dict[str, Callable[[Run, Step], None]] = {
        "contact": _contact,
        "law": _law,
        "profiles": profiles,
        "hertz area": hertz_area,
        "island statistics": island_statistics,
    }
    for step in plan.steps:
        doing(f"{step.name}: {step.count}")
        evaluate = evaluated_by.get(step.name, comparison)
        evaluate(run, step)
    error = max(run.errors.values(), default=0.0)
    if error > plan.rtol:
        reached = f"the error bound reached is {error:.2e}, above rtol = {plan.rtol:.2e}"
        raise ConvergenceError(f"{reached}: give a larger rtol")
    if run.gap is not None:
        run.keep("separation", run.gap)
        run.keep("mean_separation", (h_max + run.gap) / 2)
    return to_dataset(run, plan)


def _without_end(surface: Any, gap: FloatArray, rtol: float) -> AnySurface:
    """The surface with an h_max beyond which nothing contributes at the gaps."""
    # exp(-(d + t)^2/2) <= exp(-d^2/2) exp(-t^2/2), of which less than a tenth of the tolerance is
    # left beyond this height; ten more for the powers before it, one s, or h_rms, for h_d
    tail = math.sqrt(2 * (10 - math.log(0.1 * rtol))) + 1
    s = float(getattr(surface, "s", surface.h_rms))
    height = max(float(gap.max()), 0.0) + tail * s
    higher: AnySurface = dataclasses.replace(surface, h_max=height)
    return higher


def to_dataset(run: Run, plan: Plan) -> xr.Dataset:
    """The computed quantities; coordinates are gaps and the prescribed quantity."""
    import xarray as xr

    variables = {}
    for name, (dims, values, unit, meaning) in run.quantities.items():
        variables[name] = xr.Variable(dims, values, {"units": unit, "long_name": meaning})
    dataset = xr.Dataset(variables, attrs=_attributes(run, plan))
    return dataset.set_coords([name for name in COORDINATES if name in variables])


def _attributes(run: Run, plan: Plan) -> dict[str, str | float]:
    """What the quantities were calculated from and how."""
    scene = run.scene
    surface = scene.surface
    by_islands = [step for step in plan.steps if step.island_model is not None]
    island_models = {step.name: step.island_model_name for step in by_islands}
    attributes: dict[str, str | float] = {
        "title": scene.title,
        "plan": plan.text(),
        "rtol": plan.rtol,
        "error": max(run.errors.values(), default=0.0),
        "errors": json.dumps(run.errors),
        "theory": scene.theory_name,
        "variant": scene.variant.name if scene.sums_islands else "",
        "island_models": json.dumps(island_models),
        "switched_off": " ".join(sorted(scene.without)),
        "E_star": float(scene.E_star),
        "table_hashes": json.dumps(_hashes(by_islands)),
    }
    # psi times the hardness
    stress = float(scene.E_star * surface.rms_gradient)
    if not scene.yields:
        attributes["elastic_hardness"] = stress / ELASTIC_PSI
    else:
        attributes["hardness"] = float(scene.in_units.hardness)
        attributes["psi"] = stress / float(scene.in_units.hardness)
    if run.reasons is not None:
        attributes["reasons"] = json.dumps(run.reasons)
    for name in PARAMETERS:
        number = getattr(surface, name)
        # a spectrum that is no power law has no Hurst exponent
        if number is not None:
            attributes[f"surface_{name}"] = float(number)
    return attributes


def _hashes(steps: list[Step]) -> dict[str, str]:
    """Hashes of the values of the tables used."""
    used = {step.island_model_name: step.island_model for step in steps}
    if not used.keys() & set(TABLES):
        return {}
    from mbma_tables.tables.open import open_islands

    hashes = {}
    for name in TABLES:
        if name in used:
            # a table is named, or is an object that a user opened
            island_model: Any = used[name]
            table = open_islands(name) if island_model == name else island_model
            hashes[name] = str(table.content.attributes["values_sha256"])
    return hashes
