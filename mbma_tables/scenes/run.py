"""Carry a plan out: each step imports, reads and evaluates what it needs and nothing else."""

from __future__ import annotations

import dataclasses
import functools
import json
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from mbma_tables.errors import ConvergenceError, OutOfRangeError
from mbma_tables.scenes.plan import LEAST_LAW_RTOL, Plan, Step, note_opened, rigid_error, top_of

if TYPE_CHECKING:
    from mbma_tables.scenes.scene import Progress, Scene
    from mbma_tables.surfaces.surface import Surface
    from mbma_tables.totals.law import ContactLaw

BLOCK = 64  # gaps between two reports of progress
TABLES = {"universal", "island4d"}
SLOPE_OF_SLOPE = 3.0  # largest d log(stiffness)/d log(h_max - d), next to first contact 5/2


@dataclasses.dataclass
class _State:
    """What steps hand on."""

    scene: Scene
    surface: Surface
    rtol: float
    found: dict[str, tuple[tuple[str, ...], Any, str, str]]
    progress: Progress | None
    gap: Any = None
    law: Any = None
    errors: dict[str, float] = dataclasses.field(default_factory=dict)
    tiers: dict[str, str] = dataclasses.field(default_factory=dict)

    def add(self, name: str, dims: tuple[str, ...], values: Any, units: str, meaning: str) -> None:
        self.found[name] = (dims, np.asarray(values), units, meaning)

    @property
    def length(self) -> str:
        return self.scene.length_unit or "length"

    @property
    def stress(self) -> str:
        return self.scene.stress_unit or ("stress" if self.scene.E_star != 1.0 else "1")

    def close(self, step: Step, error: float, tier: str) -> None:
        """The bound reached; rigid spheres stand in for elastic ones at the price of theirs."""
        if tier == "rigid" and "sphere_deformation" not in self.scene.dropped:
            error += rigid_error(self.scene)
        self.errors[step.name], self.tiers[step.name] = error, tier

    def report(self, step: Step, done: int, total: int) -> None:
        if self.progress is not None:
            self.progress(step.name, done, total)


def run_scene(scene: Scene, plan: Plan, progress: Progress | None = None) -> xr.Dataset:
    """The scene's quantities, each with its unit; what made them in the attributes."""
    surface = scene.surface
    if "finite_height" in scene.dropped:
        surface = dataclasses.replace(surface, h_max=top_of(scene, 0.1 * plan.rtol))
    state = _State(scene, surface, plan.rtol, {}, progress)
    if scene.gaps is not None and scene.prescribed != "nominal_pressures":
        h_max = float(scene.surface.h_max)
        state.gap = scene.gaps if scene.prescribed == "separations" else 2 * scene.gaps - h_max
    for step in plan.steps:
        state.report(step, 0, step.count)
        _STEPS.get(step.name, _theory)(state, step)
        if step.tier is not None:
            note_opened(step.tier)
        state.report(step, step.count, step.count)
    return _dataset(state, plan)


def _make_law(state: _State, tier: str, rtol: float) -> tuple[ContactLaw, str]:
    """The law, and the tier that made it: the exact one where a table does not reach."""
    from mbma_tables.totals.law import contact_law

    scene = state.scene
    try:
        return contact_law(state.surface, rtol, tier, scene.reading, scene.E_star), tier
    except OutOfRangeError:
        if tier not in TABLES:
            raise
    return contact_law(state.surface, rtol, "exact", scene.reading, scene.E_star), "exact"


def _law(state: _State, step: Step) -> None:
    scene = state.scene
    assert step.tier is not None
    assert step.rtol is not None
    asked, by_pressure = step.rtol, scene.prescribed == "nominal_pressures"
    while True:
        law, tier = _make_law(state, step.tier, asked)
        if by_pressure:
            state.gap = law.separation(force=scene.gaps)
        error = law.error
        if scene.outputs & {"stiffness", "conductance"}:
            error = _slope_error(law, state.gap, by_pressure)
        elif by_pressure:
            # the gap carries the error of the force
            error *= 2
        if error <= state.rtol or asked <= LEAST_LAW_RTOL:
            break
        asked = max(0.1 * asked, LEAST_LAW_RTOL)
    if by_pressure:
        state.add("nominal_pressure", ("gap",), scene.gaps, state.stress, "F/A0 as prescribed")
    gap, wanted = state.gap, scene.outputs
    if "force" in wanted:
        state.add("force", ("gap",), law.force(gap), state.stress, "nominal pressure F/A0")
    if "area" in wanted and "subscale_area" not in scene.dropped:
        state.add("area", ("gap",), law.area(gap), "1", "real contact area A/A0")
    if "stiffness" in wanted:
        unit = f"{state.stress}/{state.length}" if state.stress != "1" else f"1/{state.length}"
        state.add("stiffness", ("gap",), law.stiffness(gap), unit, "-dF/dd per nominal area")
        state.add("stiffness_mean", ("gap",), law.stiffness_mean(gap), unit, "-dF/du per nominal area")
    if "energy" in wanted:
        unit = f"{state.stress} {state.length}" if state.stress != "1" else state.length
        state.add("energy", ("gap",), law.energy(gap), unit, "elastic energy per nominal area")
    if "conductance" in wanted:
        from mbma_tables.totals.conductance import conductance, mean_conductivity

        assert scene.conductivities is not None
        k_s = mean_conductivity(*scene.conductivities)
        value = conductance(law.stiffness_mean(gap), k_s, scene.E_star)
        state.add("conductance", ("gap",), value, f"conductivity/{state.length}", "conductance per nominal area")
    state.close(step, error, tier)


def _slope_error(law: ContactLaw, gap: Any, inverted: bool) -> float:
    """Bound on the relative error of the stiffness at these gaps, and of force, area and energy."""
    touching = gap[gap < law.h_max]
    if touching.size == 0:
        return law.error
    # F/l over the stiffness: large only next to a turning point
    share = law.force(touching) / ((law.h_max - touching) * np.abs(law.stiffness(touching)))
    moved = SLOPE_OF_SLOPE * law.error if inverted else 0.0
    return max(2 * law.error, float(((law.slope_error(touching) + moved) * share).max()))


def _answer(state: _State, step: Step, wanted: tuple[str, ...]) -> dict[str, Any]:
    """Force and area gap by gap, in blocks; by the exact solver where a table does not reach."""
    from mbma_tables.totals.contact import contact

    scene, gap = state.scene, state.gap
    assert step.tier is not None
    assert step.rtol is not None
    block = gap.size if step.tier in ("universal", "rigid") or state.progress is None else BLOCK
    parts = []
    for first in range(0, gap.size, block):
        own = gap[first : first + block]
        asked = functools.partial(
            contact, state.surface, own, step.tier, scene.reading, scene.E_star, step.rtol, quantities=wanted
        )
        try:
            answer = asked()
        except OutOfRangeError:
            if step.tier not in TABLES:
                raise
            answer = asked(outside="exact")
        parts.append(answer)
        state.report(step, min(first + block, gap.size), gap.size)
    names = (*wanted, "error")
    return {name: np.concatenate([np.atleast_1d(getattr(part, name)) for part in parts]) for name in names}


def _totals(state: _State, step: Step) -> None:
    scene = state.scene
    wanted = tuple(name for name in ("force", "area") if name in scene.outputs)
    if "subscale_area" in scene.dropped:
        wanted = tuple(name for name in wanted if name != "area")
    answer = _answer(state, step, wanted)
    if "force" in wanted:
        state.add("force", ("gap",), answer["force"], state.stress, "nominal pressure F/A0")
    if "area" in wanted:
        state.add("area", ("gap",), answer["area"], "1", "real contact area A/A0")
    assert step.tier is not None
    state.close(step, float(answer["error"].max()), step.tier)


def _hertz_area(state: _State, step: Step) -> None:
    from mbma_tables.scenes.statistics import hertz_area

    assert step.tier is not None
    assert step.rtol is not None
    area, error = hertz_area(state.surface, state.gap, step.tier, state.scene.rule, step.rtol)
    meaning = "Hertz area of the summits over A0 (eta = 1)"
    state.add("area", ("gap",), area, "1", meaning)
    state.close(step, error, step.tier)


def _statistics(state: _State, step: Step) -> None:
    from mbma_tables.scenes.statistics import island_statistics

    assert step.tier is not None
    assert step.rtol is not None
    scene = state.scene
    fields, error = island_statistics(
        state.surface,
        state.gap,
        step.tier,
        scene.rule,
        step.rtol,
        scene.E_star,
        scene.points,
        "subscale_area" not in scene.dropped,
    )
    square = f"{state.length}^2"
    load = square if state.stress == "1" else f"{state.stress} {square}"
    units = {
        "island_number": (f"1/{square}", "islands in contact per nominal area (Eq. 42)"),
        "island_delta": (state.length, "approach of an island"),
        "island_force": (load, "load of an island at that approach"),
        "island_area": (square, "contact area of an island at that approach"),
        "island_density": (f"1/{state.length}^3", "islands per nominal area and approach"),
    }
    for name, (dims, values) in fields.items():
        state.add(name, dims, values, *units[name])
    state.close(step, error, step.tier)


def _profiles(state: _State, step: Step) -> None:
    from mbma_tables.scenes.statistics import profiles

    assert step.rtol is not None
    scene = state.scene
    fields, error = profiles(scene.surface, scene.deltas, scene.rule, step.rtol, scene.E_star)
    units = {
        "profile_delta": (state.length, "approach of the island"),
        "profile_radius": (state.length, "radius r in the island"),
        "profile_pressure": (state.stress, "pressure p(r) (Eq. 36)"),
        "profile_gap": (state.length, "d(r), deformed sphere to mid-plane of the summits (Eq. 34)"),
    }
    for name, (dims, values) in fields.items():
        state.add(name, dims, values, *units[name])
    state.close(step, error, "exact")


def _theory(state: _State, step: Step) -> None:
    from mbma_tables import theories

    scene, gap, name = state.scene, state.gap, step.name
    if name == "greenwood_williamson":
        found = theories.greenwood_williamson(scene.surface, gap, scene.E_star)
        force, area = found.force, found.area
    else:
        average = theories.mean_separation(scene.surface, gap)
        full = name == "persson"
        force, area = np.full((2, gap.size), np.nan)
        # the full form needs an infinite load at u = 0
        apart = average > 0 if full else average >= 0
        force[apart] = theories.persson_force(
            scene.surface, average[apart], scene.E_star, method="full" if full else "simplified"
        )
        area[apart] = theories.persson_area(scene.surface, force[apart], scene.E_star)
    state.add(f"{name}_force", ("gap",), force, state.stress, f"F/A0 by {name}")
    state.add(f"{name}_area", ("gap",), area, "1", f"A/A0 by {name}")


_STEPS = {
    "law": _law,
    "totals": _totals,
    "hertz area": _hertz_area,
    "island statistics": _statistics,
    "profiles": _profiles,
}


def _dataset(state: _State, plan: Plan) -> xr.Dataset:
    scene = state.scene
    error = max(state.errors.values(), default=0.0)
    if error > plan.rtol:
        raise ConvergenceError(f"the error bound reached is {error:.2e}, above rtol = {plan.rtol:.2e}; ask for more")
    if state.gap is not None:
        h_max = float(scene.surface.h_max)
        state.add("separation", ("gap",), state.gap, state.length, "d, rigid plane to mid-plane")
        state.add("mean_separation", ("gap",), (h_max + state.gap) / 2, state.length, "u = (h_max + d)/2 (Eq. 50)")
    variables = {
        name: xr.Variable(dims, values, {"units": units, "long_name": meaning})
        for name, (dims, values, units, meaning) in state.found.items()
    }
    named = ("separation", "mean_separation", "nominal_pressure", "profile_delta", "island_delta")
    places = [name for name in named if name in variables]
    facts: dict[str, Any] = {
        "title": scene.title,
        "plan": plan.text(),
        "rtol": plan.rtol,
        "error": error,
        "errors": json.dumps(state.errors),
        "reading": scene.rule.name,
        "tiers": json.dumps(state.tiers),
        "switched_off": " ".join(sorted(scene.dropped)),
        "E_star": float(scene.E_star),
        "table_hashes": json.dumps(_hashes(set(state.tiers.values()))),
    }
    facts |= {
        f"surface_{name}": float(getattr(scene.surface, name)) for name in ("hurst", "q0", "q1", "h_rms", "h_max")
    }
    return xr.Dataset(variables, attrs=facts).set_coords(places)


def _hashes(tiers: set[str]) -> dict[str, str]:
    """Hashes of the values of the tables that answered."""
    if not tiers & TABLES:
        return {}
    from mbma_tables.models.universal import open_table

    return {tier: str(open_table(tier).content.attributes["values_sha256"]) for tier in sorted(tiers & TABLES)}
