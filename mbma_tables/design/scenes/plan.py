"""The plan of a scene: its steps from quantities and tolerance, by the costs of tables/cost.csv.

The plan depends on the scene only: the island model is the universal table where its certificate
suffices, else the exact solver, and many gaps of other theories are evaluated by a contact law. A
step whose results amplify the error of force and area by a factor (`AMPLIFICATION`) has the
tolerance over that factor; one half of it is for the islands, the other for the quadrature.

A cost is a time divided by that of a fixed piece of work timed in the same run; the row "unit" has
the seconds of that work on the machine that measured. `python -m generate cost` measures.
"""

from __future__ import annotations

import csv
import dataclasses
import functools
import math
import pathlib
from typing import Any, NamedTuple

import numpy as np

from mbma_tables.common.errors import InputError
from mbma_tables.common.files import shipped_file
from mbma_tables.contacts.question import both_separations
from mbma_tables.islands.island_models import AnyModel
from mbma_tables.tables.island4d import Island4dModel
from mbma_tables.tables.universal import UniversalModel

TABLES = ("universal", "island4d")  # island models that are tables
LEAKAGE = "leakage"  # of `Contact.leakage`: several quantities under one name
ISLAND_SHARE = 0.5  # share of a step's tolerance; the rest is for its quadrature
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


class Row(NamedTuple):
    """One measurement: method, task, largest relative error, time and evaluations."""

    island_model: str
    variant: str  # "gap rtol=1e-06", "island", "open"
    quantity: str  # "both", or "pressure" that a law is inverted for
    error: float | None
    # time over that of the fixed work; seconds in the row of island model `UNIT`
    cost: float
    # islands for a gap, pressures for an exact island, height integrals for a table
    evaluations: float | None = None

    @property
    def what(self) -> str:
        """The variant without its tolerance."""
        return self.variant.partition(" rtol=")[0]

    @property
    def rtol(self) -> float | None:
        """The requested tolerance, if the variant contains one."""
        _, separator, text = self.variant.partition(" rtol=")
        return float(text) if separator else None


class Costs(NamedTuple):
    """All measurements of a file, and the seconds of the fixed work where they were made."""

    rows: tuple[Row, ...]
    seconds: float

    def of(self, island_model: str, what: str, rtol: float | None = None) -> float:
        """Seconds at the loosest measured tolerance that meets `rtol`, else the tightest.

        NaN if none was measured.
        """
        rows = [
            row
            for row in self.rows
            if row.island_model == island_model and row.what == what
        ]
        if not rows:
            return math.nan
        # calls and opening a table have one row, without a tolerance
        by_rtol = sorted((row.rtol or 0.0, row.cost) for row in rows)
        _, cost = by_rtol[0]
        for measured_rtol, cost_there in by_rtol:
            # decimal tolerances of a file and of a product may differ by roundoff
            if rtol is None or measured_rtol <= rtol * (1 + 1e-9):
                cost = cost_there
        return self.seconds * cost


class Distance(NamedTuple):
    """A method for a theory: its cost, and the theory's deviation from boundary elements.

    Deviations are those on held-out surfaces: root mean squares of ln(theory/simulation), of area
    at equal force and of force at equal mean separation, light at 1-10% contact and deep at 10-97%.
    """

    theory: str
    way: str
    cost: float  # cost of a point, over that of the fixed work
    once: float  # cost of preparing a surface
    area_light: float
    area_deep: float
    force_light: float
    force_deep: float
    reached_light: float  # share of simulated loads that the theory reaches
    reached_deep: float


def _cell(column: str, text: str) -> str | float | None:
    """Content of a cell of a CSV file; an empty one is no number."""
    if column in TEXTS:
        return text
    return float(text) if text else None


def _records(kind: Any, path: pathlib.Path) -> tuple[Any, ...]:
    """Rows of a CSV file whose columns are the fields of a kind."""
    with path.open(encoding="utf-8", newline="") as file:
        content = csv.DictReader(line for line in file if not line.startswith("#"))
        records = list(content)
    rows = []
    for record in records:
        fields = {column: _cell(column, text) for column, text in record.items()}
        rows.append(kind(**fields))
    return tuple(rows)


@functools.cache
def shipped_distances() -> tuple[Distance, ...]:
    """The distances that ship with the library."""
    return _records(Distance, shipped_file("distance.csv"))


def read_costs(path: pathlib.Path) -> Costs:
    """Costs from a CSV file."""
    rows = _records(Row, path)
    (seconds,) = (row.cost for row in rows if row.island_model == UNIT)
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
    island_model: str | AnyModel | None
    rtol: float | None  # relative tolerance of the totals, the law or the solver
    count: int  # gaps, islands or points evaluated
    error: float  # certified beforehand; NaN if known from the results only
    seconds: (
        float  # by the measured costs, without first use; NaN where nothing was measured
    )
    theory: str | None = None  # name of the scene's theory, in steps that use it

    @property
    def island_model_name(self) -> str | None:
        """The island model's name."""
        return getattr(self.island_model, "name", self.island_model)  # type: ignore[arg-type]


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
        ]
        for step in self.steps:
            source = step.island_model_name or step.theory
            by = "" if source is None else f" by {source}"
            rtol = "" if step.rtol is None else f", rtol={step.rtol:.1e}"
            time = f"time={duration(step.seconds)}"
            numbers = f"(count={step.count}{rtol}, {_bound(step.error)}, {time})"
            lines += [
                f"  -> {step.name}{by}  {numbers}",
                f"       {step.what}",
                f"       for: {step.why}",
            ]
        lines.append(f"  left out: {', '.join(self.left_out) or 'nothing'}")
        if self.switched_off:
            lines.append(f"  switched off: {', '.join(self.switched_off)}")
        return "\n".join(lines) + "\n"


def _bound(error: float) -> str:
    return "error not certified" if math.isnan(error) else f"error={error:.1e}"


def duration(seconds: float) -> str:
    """A time in its unit."""
    if math.isnan(seconds):
        return "not measured"
    if seconds >= 1:
        return f"{seconds:.3g} s"
    if seconds >= 1e-3:
        return f"{seconds / 1e-3:.3g} ms"
    return f"{seconds / 1e-6:.3g} us"


def make_plan(scene: Any) -> Plan:
    """The steps that meet the tolerance, or the tightest of `LADDER` that fit the time budget."""
    if scene.rtol is not None:
        return _Planner(scene, scene.rtol).plan()
    assert scene.seconds is not None
    least = math.nan
    for rtol in LADDER:
        try:
            plan = _Planner(scene, rtol).plan()
        except InputError:
            continue  # too tight for the energy
        if plan.error > rtol:
            continue  # too tight for the theory
        if math.isnan(plan.seconds):
            unmeasured = next(step for step in plan.steps if math.isnan(step.seconds))
            source = f"step {unmeasured.name!r}"
            if unmeasured.theory:
                source = f"theory {unmeasured.theory!r}"
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
        certificate = island_model.content.attributes
        return max(
            float(certificate["largest_error_F"]), float(certificate["largest_error_A"])
        )
    if island_model == "exact":
        # it works to a tenth of the requested tolerance
        return 0.1 * rtol
    return 0.0 if island_model == "rigid" else math.nan


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
        steps += [self.compared(name) for name in scene.theories]
        return steps

    def profiles(self) -> Step:
        """Islands solved one by one."""
        islands = int(np.size(self.scene.deltas))
        rtol = ISLAND_SHARE * self.rtol / AMPLIFICATION["profile"]
        return Step(
            name="profiles",
            why="deltas",
            what="the island problem solved with p(r) and d(r)",
            island_model="exact",
            rtol=rtol,
            count=islands,
            error=rtol,
            seconds=islands * self.costs.of("exact", "profile", rtol),
        )

    def compared(self, name: str) -> Step:
        """Another theory at the same gaps; where its cost was not measured, that of Persson's."""
        seconds = self.costs.of(name, "gap")
        if math.isnan(seconds):
            seconds = self.costs.of("persson", "gap")
        return Step(
            name=name,
            why="theories",
            what="another theory at the same gaps",
            island_model=None,
            rtol=None,
            count=self.count,
            error=1e-9,
            seconds=self.count * seconds,
        )

    def island_model(self, tolerance: float) -> str | AnyModel:
        """The island model for a step with that tolerance."""
        if self.scene.island_model is not None:
            given: str | AnyModel = self.scene.island_model
            return given
        if "sphere_deformation" in self.scene.without:
            return "rigid"
        share = ISLAND_SHARE * tolerance
        return "universal" if certified_error("universal", share) <= share else "exact"

    @property
    def parts(self) -> set[str]:
        """What of a contact takes time or amplifies errors, by what its quantities are made of."""
        scene = self.scene
        parts = {part for name, part in PART_OF.items() if scene.computes(name)}
        if scene.is_inverted:
            parts.add("inverse")
        if scene.needs_slopes:
            parts.add("slopes")
        if scene.yields:
            parts.add("yield")
        return parts

    def contact(self) -> Step:
        """One contact at all gaps, by the scene's theory, or by its law if that suffices and costs less."""
        scene = self.scene
        why = list(scene.of_contact)
        why += ["hardness"] * scene.yields
        if scene.is_inverted and scene.question is not None:
            why.append(f"{scene.question.name} prescribed")
        factor = math.prod(by for part, by in AMPLIFICATION.items() if part in self.parts)
        what = f"pressure, area and derived quantities at {self.count} gaps"
        if scene.sums_islands:
            if scene.computes("energy") and self.rtol < MIN_ENERGY_RTOL:
                best = f"{MIN_ENERGY_RTOL:.0e} at best"
                raise InputError(f"rtol = {self.rtol:g} is too tight for energy: {best}")
            what = f"sum over islands (Eqs. 48, 49): {what}"
            step = self.summed("contact", ", ".join(why), what, None, factor)
            seconds = step.seconds + self.besides()
            return dataclasses.replace(step, seconds=seconds, theory=scene.theory_name)
        return self.contact_or_law(", ".join(why), what, factor)

    def besides(self) -> float:
        """Seconds of what one contact computes besides pressures and areas at given gaps."""
        parts = self.parts
        # with a hardness the gap at a pressure is found otherwise
        if {"inverse", "yield"} <= parts:
            parts = parts - {"inverse", "yield"} | {"yield inverse"}
        if not self.scene.sums_islands:
            parts.discard("slopes")  # other theories have them at once
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
        if scene.yields:
            error = factor * error
        at_gaps = self.costs.of(theory, "call")
        at_gaps += self.count * self.costs.of(theory, "gap")
        seconds = at_gaps + self.besides()
        step = Step(
            name="contact",
            why=why,
            what=what,
            island_model=None,
            rtol=None,
            count=self.count,
            error=error,
            seconds=seconds,
            theory=theory,
        )
        # a law has force and area only
        if scene.yields or not {*scene.of_contact} <= {"pressure", "area"}:
            return step
        rtol = max(
            (1 - ISLAND_SHARE) * self.rtol / AMPLIFICATION["inverse"], MIN_LAW_RTOL
        )
        lookup = self.costs.of("law", "lookup")
        if scene.is_inverted:
            lookup += self.costs.of("law", "invert")
        by_law = self.costs.of(theory, "law", rtol) + self.count * lookup
        law_pays = by_law < seconds
        if math.isnan(seconds):
            law_pays = self.count >= MIN_LAW_GAPS
        if not law_pays:
            return step
        return dataclasses.replace(
            step, name="law", rtol=rtol, error=factor * (rtol + error), seconds=by_law
        )

    def summed(
        self,
        name: str,
        why: str,
        what: str,
        priced_as: str | None,
        factor: float = 1.0,
    ) -> Step:
        """A sum over islands at every gap.

        `priced_as` is an island model whose totals cost about the same.
        """
        tolerance = self.rtol / factor
        island_model = self.island_model(tolerance)
        rtol = (1 - ISLAND_SHARE) * tolerance
        priced = priced_as or _name(island_model)
        by_gap = self.costs.of(priced, "call") + self.count * self.costs.of(
            priced, "gap", rtol
        )
        # its islands are answered once, as for a law
        seconds = min(by_gap, self.costs.of(priced, "law", rtol))
        error = factor * (rtol + certified_error(island_model, rtol))
        return Step(name, why, what, island_model, rtol, self.count, error, seconds)

    def theory_error(self) -> float:
        """Bound of the scene's theory on its numerical error."""
        from mbma_tables.theories import resolve

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


def _name(island_model: Any) -> str:
    """The name of an island model in the table of measured costs.

    A table of a user's own costs what the shipped one of its kind does: the lookup does not
    depend on the number of nodes.
    """
    if isinstance(island_model, UniversalModel | Island4dModel):
        return island_model.name
    return island_model if isinstance(island_model, str) else ""
