"""The plan of a scene: its steps from quantities and tolerance, by the costs of tables/cost.csv.

The plan depends on the scene only: the island model is the universal table where its certificate
suffices, else the exact solver, and many gaps of other theories are evaluated by a contact law. A
step whose results amplify the error of force and area by a factor (`AMPLIFICATION`) has the
tolerance over that factor; one half of it is for the islands, the other for the quadrature.

A cost is a time divided by that of a fixed piece of work timed in the same run; the row "unit" has
the seconds of that work on the machine that measured. `python -m generate cost` measures.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import pathlib
from typing import Any, NamedTuple

import numpy as np

from mbma_tables.common.errors import InputError
from mbma_tables.common.files import records, shipped_file
from mbma_tables.contacts.question import both_separations
from mbma_tables.islands.island_models import AnyModel
from mbma_tables.tables.island4d import Island4dModel
from mbma_tables.tables.universal import UniversalModel
from mbma_tables.theories import resolve

LEAKAGE = "leakage"  # of `Contact.leakage`: several quantities under one name
ISLAND_SHARE = 0.5  # share of a step's tolerance; the rest is for its quadrature
# the error of a sum has the table's bound three times: for its islands, its panels and its tails
ISLAND_BOUNDS = 3
AMPLIFICATION = {
    # gaps that follow from pressures add their error to that of the values
    "inverse": 2.0,
    "slopes": 2.0,
    # the elastic errors of force and of area at that force add up where points yield
    "yield": 2.0,
    # p(r) at a point converges later than its integrals
    "profile": 10.0,
}
# parts of a contact that are measured, of quantities that are made of one
PART_OF = {"energy": "energy", "flow_coefficient": "leakage"}
MIN_ENERGY_RTOL = 2e-9  # of an integral to 1e-9
MIN_LAW_GAPS = 150  # from which a law pays where costs were not measured
MIN_LAW_RTOL = 1e-9
LAST = 0.95  # largest share of h_max at which the error of a theory is looked up
# tolerances of which a time budget allows the first that it can
LADDER = (1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1)

UNIT = "unit"
TEXTS = ("island_model", "variant", "quantity", "theory", "way")  # text fields


class Costs(NamedTuple):
    """All measurements of a file, and the seconds of the fixed work where they were made."""

    # a measurement each: island model, variant such as "gap rtol=1e-06", quantity, error,
    # cost over that of the fixed work, and evaluations
    rows: tuple[dict[str, Any], ...]
    seconds: float

    def of(self, island_model: str, what: str, rtol: float | None = None) -> float:
        """Seconds at the loosest measured tolerance that meets `rtol`, else the tightest.

        NaN if none was measured.
        """
        by_rtol: list[tuple[float, float]] = []
        for row in self.rows:
            measured, _, of_row = row["variant"].partition(" rtol=")
            if (row["island_model"], measured) == (island_model, what):
                # calls and opening a table have one row, without a tolerance
                by_rtol.append((float(of_row or 0.0), row["cost"]))
        by_rtol.sort()
        # decimal tolerances of a file and of a product may differ by roundoff
        limit = math.inf if rtol is None else rtol * (1 + 1e-9)
        costs = [cost for measured_rtol, cost in by_rtol if measured_rtol <= limit]
        tightest = [cost for _, cost in by_rtol[:1]]
        return self.seconds * (costs or tightest or [math.nan])[-1]


def measurements(path: pathlib.Path) -> tuple[dict[str, Any], ...]:
    """Rows of a file of measurements by column: texts, and numbers, None where a cell is empty."""
    rows = []
    for record in records(path):
        row: dict[str, Any] = dict(record)
        for column, text in record.items():
            if column not in TEXTS:
                row[column] = float(text) if text else None
        rows.append(row)
    return tuple(rows)


def read_costs(path: pathlib.Path) -> Costs:
    """Costs from a CSV file."""
    rows = measurements(path)
    (seconds,) = (row["cost"] for row in rows if row["island_model"] == UNIT)
    return Costs(rows, seconds)


@functools.cache
def shipped_costs() -> Costs:
    """The costs that ship with the library."""
    return read_costs(shipped_file("cost.csv"))


@dataclasses.dataclass(frozen=True)
class Step:
    """One step of a plan."""

    name: str
    why: str  # quantities that need it
    what: str  # description of its evaluation
    count: int  # gaps, islands or points evaluated
    error: float  # certified beforehand; NaN if known from the results only
    # by the measured costs, without first use; NaN where nothing was measured
    seconds: float
    island_model: str | AnyModel | None = None
    rtol: float | None = None  # relative tolerance of the totals, the law or the solver
    theory: str | None = None  # name of the scene's theory, in steps that use it

    @property
    def island_model_name(self) -> str | None:
        """The island model's name."""
        return getattr(self.island_model, "name", self.island_model)  # type: ignore[arg-type]

    def text(self) -> str:
        """The step in three lines."""
        source = self.island_model_name or self.theory
        by = "" if source is None else f" by {source}"
        rtol = "" if self.rtol is None else f", rtol={self.rtol:.1e}"
        time = f"time={duration(self.seconds)}"
        numbers = f"(count={self.count}{rtol}, {_bound(self.error)}, {time})"
        first = f"  -> {self.name}{by}  {numbers}"
        return f"{first}\n       {self.what}\n       for: {self.why}"


@dataclasses.dataclass(frozen=True)
class Plan:
    """Steps in the order in which they run."""

    steps: tuple[Step, ...]
    left_out: tuple[str, ...]  # what was not requested
    switched_off: tuple[str, ...]  # refinements of the model that are off
    rtol: float  # tolerance of the plan
    overhead: float  # seconds that every scene takes
    # seconds that the first scene of a process takes besides; no choice depends on it
    first_use: float
    theory: str = "mbma"

    @property
    def seconds(self) -> float:
        """Seconds for all steps and the overhead, without first use."""
        return self.overhead + sum(step.seconds for step in self.steps)

    @property
    def error(self) -> float:
        """Largest error of a step of the scene's theory; those compared state their own."""
        of_theory = [
            step for step in self.steps if step.island_model is not None or step.theory
        ]
        return max((step.error for step in of_theory), default=0.0)

    def text(self) -> str:
        """The plan as text, like a query plan of a database."""
        first_use = f"first use in a process {duration(self.first_use)} more"
        times = f"time={duration(self.seconds)}, {first_use}"
        lines = [
            f"Scene  (rtol={self.rtol:.1e}, {_bound(self.error)}, {times})",
            f"  theory: {self.theory}",
            *(step.text() for step in self.steps),
            f"  left out: {', '.join(self.left_out) or 'nothing'}",
        ]
        if self.switched_off:
            lines.append(f"  switched off: {', '.join(self.switched_off)}")
        return "\n".join(lines) + "\n"


def _bound(error: float) -> str:
    return "error not certified" if math.isnan(error) else f"error={error:.1e}"


def duration(seconds: float) -> str:
    """A time in its unit."""
    if math.isnan(seconds):
        return "not measured"
    for unit, length in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= length:
            return f"{seconds / length:.3g} {unit}"
    return f"{seconds / 1e-6:.3g} us"


def make_plan(scene: Any) -> Plan:
    """The steps that meet the tolerance, or the tightest of `LADDER` that fit the time budget."""
    if scene.rtol is not None:
        return _Planner(scene, scene.rtol).plan()
    least = math.nan
    for rtol in LADDER:
        try:
            plan = _Planner(scene, rtol).plan()
        except InputError:
            continue  # too tight for the energy
        if plan.error > rtol:
            continue  # too tight for the theory
        for step in plan.steps:
            if math.isnan(step.seconds):
                source = (
                    f"theory {step.theory!r}" if step.theory else f"step {step.name!r}"
                )
                raise InputError(
                    f"the cost of {source} is not known: give rtol instead of seconds"
                )
        if plan.seconds <= scene.seconds:
            return plan
        least = plan.seconds
    budget = f"seconds = {scene.seconds:g}"
    raise InputError(
        f"{budget} is too little: the cheapest plan takes about {least:.3g} s"
    )


def certified_error(island_model: str | AnyModel, rtol: float) -> float:
    """Bound on the relative error of islands at `rtol`; NaN if only results have it."""
    if island_model == "universal":
        from mbma_tables.tables.open import open_islands

        island_model = open_islands(island_model)
    if isinstance(island_model, UniversalModel | Island4dModel):
        return float(np.max(island_model.content.local_error))
    # the solver works to a tenth of the requested tolerance
    known = {"exact": 0.1 * rtol, "rigid": 0.0}
    return (
        known.get(island_model, math.nan) if isinstance(island_model, str) else math.nan
    )


@dataclasses.dataclass(frozen=True)
class _Planner:
    """The plan of one scene at one tolerance."""

    scene: Any  # a `Scene`, whose module imports this one
    rtol: float
    costs: Costs = dataclasses.field(default_factory=shipped_costs)

    @property
    def count(self) -> int:
        question = self.scene.question
        return 0 if question is None else int(question.value.size)

    def plan(self) -> Plan:
        scene = self.scene
        steps = self.steps()
        shipped = {
            step.island_model for step in steps if isinstance(step.island_model, str)
        }
        imports = [self.costs.of(island_model, "import") for island_model in shipped]
        return Plan(
            steps=tuple(steps),
            left_out=tuple(scene.not_requested),
            switched_off=tuple(scene.without),
            rtol=self.rtol,
            overhead=self.costs.of("scene", "call"),
            first_use=max(imports, default=0.0),
            theory=scene.theory_name,
        )

    def steps(self) -> list[Step]:
        """All steps, in the order in which they run."""
        scene = self.scene
        steps = []
        if scene.of_contact or scene.is_inverted:
            steps.append(self.contact())
        if scene.is_hertz_area:
            what = "adaptive sum over islands with eta = 1, the Hertz area"
            steps.append(
                self.summed("hertz area", "area without subscale_area", what, "island4d")
            )
        if scene.points is not None:
            islands = f"{scene.points} islands of the distribution (Eq. 42)"
            what = f"number of islands at {self.count} gaps, {islands}"
            steps.append(self.summed("island statistics", "points", what, "rigid"))
        if scene.deltas is not None:
            steps.append(self.profiles())
        return steps + [self.compared(name) for name in scene.theories]

    def profiles(self) -> Step:
        """Islands solved one by one."""
        islands = int(np.size(self.scene.deltas))
        rtol = ISLAND_SHARE * self.rtol / AMPLIFICATION["profile"]
        seconds = islands * self.costs.of("exact", "profile", rtol)
        what = "the island problem solved with p(r) and d(r)"
        return Step("profiles", "deltas", what, islands, rtol, seconds, "exact", rtol)

    def compared(self, name: str) -> Step:
        """Another theory at the same gaps; where its cost was not measured, that of Persson's."""
        seconds = self.costs.of(name, "gap")
        if math.isnan(seconds):
            seconds = self.costs.of("persson", "gap")
        what = "another theory at the same gaps"
        return Step(name, "theories", what, self.count, 1e-9, self.count * seconds)

    def island_model(self, tolerance: float) -> str | AnyModel:
        """The island model for a step with that tolerance."""
        given: str | AnyModel | None = self.scene.island_model
        if given is not None:
            return given
        if "sphere_deformation" in self.scene.without:
            return "rigid"
        bound = certified_error("universal", tolerance)
        return "universal" if ISLAND_BOUNDS * bound <= tolerance else "exact"

    @property
    def parts(self) -> set[str]:
        """What of a contact takes time or amplifies errors, by what its quantities are made of."""
        scene = self.scene
        given = {
            "inverse": scene.is_inverted,
            "slopes": scene.needs_slopes,
            "yield": scene.in_units.yields,
        } | {part: scene.computes(name) for name, part in PART_OF.items()}
        return {part for part, is_needed in given.items() if is_needed}

    def contact(self) -> Step:
        """One contact at all gaps, by the scene's theory, or by its law if that suffices and costs less."""
        scene = self.scene
        parts = self.parts
        why = [*scene.of_contact, *["hardness"] * ("yield" in parts)]
        if scene.is_inverted:
            why.append(f"{scene.question.name} prescribed")
        reasons = ", ".join(why)
        factor = math.prod(by for part, by in AMPLIFICATION.items() if part in parts)
        what = f"pressure, area and derived quantities at {self.count} gaps"
        if not scene.sums_islands:
            return self.contact_or_law(reasons, what, factor)
        if "energy" in parts and self.rtol < MIN_ENERGY_RTOL:
            best = f"{MIN_ENERGY_RTOL:.0e} at best"
            raise InputError(f"rtol = {self.rtol:g} is too tight for energy: {best}")
        what = f"sum over islands (Eqs. 48, 49): {what}"
        step = self.summed("contact", reasons, what, None, factor)
        seconds = step.seconds + self.besides(parts)
        return dataclasses.replace(step, seconds=seconds, theory=scene.theory_name)

    def besides(self, parts: set[str]) -> float:
        """Seconds of what one contact computes besides pressures and areas at given gaps."""
        # with a hardness the gap at a pressure is found otherwise
        if {"inverse", "yield"} <= parts:
            parts = parts - {"inverse", "yield"} | {"yield inverse"}
        theory = self.scene.theory_name
        return sum(
            self.costs.of(theory, f"{part} once")
            + self.count * self.costs.of(theory, f"{part} gap")
            for part in parts
        )

    def contact_or_law(self, why: str, what: str, factor: float) -> Step:
        """One contact by a theory other than MBMA, or its law if that suffices and costs less."""
        scene = self.scene
        theory = scene.theory_name
        error = self.theory_error()
        yields = scene.in_units.yields
        seconds = self.costs.of(theory, "call")
        seconds += self.count * self.costs.of(theory, "gap")
        # such theories have slopes at once
        seconds += self.besides(self.parts - {"slopes"})
        own = factor * error if yields else error
        step = Step("contact", why, what, self.count, own, seconds, theory=theory)
        # a law has force and area only
        if yields or not {*scene.of_contact} <= {"pressure", "area"}:
            return step
        rtol = (1 - ISLAND_SHARE) * self.rtol / AMPLIFICATION["inverse"]
        rtol = max(rtol, MIN_LAW_RTOL)
        lookup = self.costs.of("law", "lookup")
        if scene.is_inverted:
            lookup += self.costs.of("law", "invert")
        by_law = self.costs.of(theory, "law", rtol) + self.count * lookup
        is_measured = not math.isnan(seconds)
        if not (by_law < seconds if is_measured else self.count >= MIN_LAW_GAPS):
            return step
        own = factor * (rtol + error)
        return dataclasses.replace(step, name="law", rtol=rtol, error=own, seconds=by_law)

    def summed(
        self, name: str, why: str, what: str, priced_as: str | None, factor: float = 1.0
    ) -> Step:
        """A sum over islands at every gap.

        `priced_as` is an island model whose totals cost about the same.
        """
        tolerance = self.rtol / factor
        island_model = self.island_model(tolerance)
        rtol = (1 - ISLAND_SHARE) * tolerance
        # a table of a user's own costs what the shipped one of its kind does
        is_named = isinstance(island_model, str | UniversalModel | Island4dModel)
        own = getattr(island_model, "name", island_model) if is_named else ""
        priced = priced_as or str(own)
        by_gap = self.costs.of(priced, "call")
        by_gap += self.count * self.costs.of(priced, "gap", rtol)
        # its islands are answered once, as for a law
        seconds = min(by_gap, self.costs.of(priced, "law", rtol))
        error = factor * (rtol + certified_error(island_model, rtol))
        return Step(name, why, what, self.count, error, seconds, island_model, rtol)

    def theory_error(self) -> float:
        """Bound of the scene's theory on its numerical error."""
        surface = self.scene.surface
        question = self.scene.question
        h_max = float(surface.h_max)
        farthest = 0.0
        # the farther from the mid-plane, the larger
        if question is not None and question.is_gap:
            _, u = both_separations(question.name, question.value, h_max, False)
            farthest = float(np.max(u))
        within = min(max(farthest, 0.5 * h_max), LAST * h_max)
        theory = resolve(self.scene.theory, surface)
        return float(theory.answer(surface, np.asarray(within)).error)
