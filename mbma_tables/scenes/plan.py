"""The plan of a scene: steps from effects and tolerance.

The plan depends on the scene only: the island model is the universal table where its certificate suffices, else the
exact solver, and many gaps are evaluated by a contact law. The tolerance is divided as follows. A step whose results
amplify the error of force and area by a factor (`AMPLIFICATION`) has the tolerance over that factor; one half of it is
for the islands, the other for the quadrature or the polynomials of a law.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from mbma_tables.common.errors import InputError
from mbma_tables.models import AnyModel
from mbma_tables.scenes.costs import Costs, shipped_costs
from mbma_tables.scenes.problem import INVERTED, OF_LAW, OUTPUTS, REFINEMENTS, Problem

ISLAND_SHARE = 0.5  # share of a step's tolerance; the rest is for its quadrature or law
# inverting a law adds the gap's error to that of the values; slopes of a law are rarely worse by more than 300;
# p(r) at a point converges later than its integrals
AMPLIFICATION = {"inverse": 2.0, "slopes": 300.0, "profile": 10.0}
# gaps from which a new law costs less processor time than `contact`, both timed in turns on new surfaces: profiles of
# islands answer a further gap in half a microsecond
MIN_LAW_GAPS, MIN_LAW_GAPS_OF_OTHERS = 4000, 150  # of MBMA, and of other theories
MIN_THEORY_LAW_RTOL = 1e-9
YIELDING_CALL, YIELDING_GAP = 2.2, 2.6  # over an elastic call, and over one of many elastic gaps (docs/yield.md)
LAST = 0.95  # largest share of h_max at which the error of a theory is looked up
LADDER = (1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1)


@dataclasses.dataclass(frozen=True)
class Step:
    """One step of a plan."""

    name: str
    why: str  # effects that need it
    what: str  # description of its evaluation
    island_model: str | AnyModel | None
    rtol: float | None  # relative tolerance of the totals, the law or the solver
    count: int  # gaps, islands or points evaluated
    error: float  # certified beforehand; NaN if known from the results only
    seconds: float  # by the measured costs, without first use; NaN where nothing was measured
    theory: str | None = None  # name of the scene's theory if it is not MBMA, in steps that use it

    @property
    def island_model_name(self) -> str | None:
        """The island model's name."""
        return getattr(self.island_model, "name", self.island_model)  # type: ignore[arg-type]


@dataclasses.dataclass(frozen=True)
class Plan:
    """Steps in the order in which they run."""

    steps: tuple[Step, ...]
    left_out: tuple[str, ...]  # effects that were not requested
    switched_off: tuple[str, ...]  # refinements of the model that are off
    rtol: float  # tolerance of the plan
    overhead: float  # seconds that every scene takes
    first_use: float  # seconds that the first scene of a process takes besides; no choice depends on it
    theory: str = "mbma"

    @property
    def seconds(self) -> float:
        """Seconds for all steps and the overhead, without first use."""
        return self.overhead + sum(step.seconds for step in self.steps)

    @property
    def error(self) -> float:
        """Largest error of a step of the scene's theory; those compared state their own."""
        return max((step.error for step in self.steps if step.island_model is not None or step.theory), default=0.0)

    def text(self) -> str:
        """The plan as text, like a query plan of a database."""
        times = f"time={duration(self.seconds)}, first use in a process {duration(self.first_use)} more"
        lines = [f"Scene  (rtol={self.rtol:.1e}, {_bound(self.error)}, {times})", f"  theory: {self.theory}"]
        for step in self.steps:
            source = step.theory or step.island_model_name
            by = "" if source is None else f" by {source}"
            asked = "" if step.rtol is None else f", rtol={step.rtol:.1e}"
            numbers = f"(count={step.count}{asked}, {_bound(step.error)}, time={duration(step.seconds)})"
            lines += [f"  -> {step.name}{by}  {numbers}", f"       {step.what}", f"       for: {step.why}"]
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
    unit, size = next(((u, s) for u, s in (("s", 1.0), ("ms", 1e-3)) if seconds >= s), ("us", 1e-6))
    return f"{seconds / size:.3g} {unit}"


def make_plan(problem: Problem, costs: Costs | None = None) -> Plan:
    """The steps that meet the tolerance, or the tightest tolerance of `LADDER` whose steps fit the time budget."""
    measured = shipped_costs() if costs is None else costs
    if problem.rtol is not None:
        return _Planner(problem, problem.rtol, measured).plan()
    assert problem.seconds is not None
    least = math.nan
    for rtol in LADDER:
        try:
            plan = _Planner(problem, rtol, measured).plan()
        except InputError:
            continue  # too tight for a law
        if plan.error > rtol:
            continue  # too tight for the theory
        if math.isnan(plan.seconds):
            step = next(step for step in plan.steps if math.isnan(step.seconds))
            unknown = f"theory {step.theory!r}" if step.theory else f"step {step.name!r}"
            raise InputError(f"the cost of {unknown} is not known: give rtol instead of seconds")
        if plan.seconds <= problem.seconds:
            return plan
        least = plan.seconds
    raise InputError(f"seconds = {problem.seconds:g} is too little: the cheapest plan takes about {least:.3g} s")


def seconds_by_theory(costs: Costs, theory: str, count: int, inverse: bool, energy: bool = False) -> float:
    """Seconds of a theory other than MBMA without a law, by mean separation, pressure or area."""
    each = costs.of(theory, "invert" if inverse else "gap") + (costs.of(theory, "energy") if energy else 0.0)
    return costs.of(theory, "call") + count * each


def certified_error(island_model: str | AnyModel, asked: float) -> float:
    """Bound on the relative error of islands, for results at `asked`; NaN if it is known afterwards only."""
    if island_model == "universal":
        from mbma_tables.models.tables import open_table

        certificate = open_table(island_model).content.attributes
        return max(float(certificate["largest_error_F"]), float(certificate["largest_error_A"]))
    # the exact solver works to a tenth of the requested tolerance
    return {"exact": 0.1 * asked, "rigid": 0.0}.get(_name(island_model), math.nan)


@dataclasses.dataclass(frozen=True)
class _Planner:
    """The plan of one problem at one tolerance."""

    problem: Problem
    rtol: float
    costs: Costs

    @property
    def count(self) -> int:
        return 0 if self.problem.gaps is None else int(self.problem.gaps.size)

    def island_model(self, tolerance: float) -> str | AnyModel:
        """The island model for a step with that tolerance."""
        if self.problem.island_model is not None:
            return self.problem.island_model
        if "sphere_deformation" in self.problem.dropped:
            return "rigid"
        share = ISLAND_SHARE * tolerance
        return "universal" if certified_error("universal", share) <= share else "exact"

    def plan(self) -> Plan:
        outputs, dropped = self.problem.outputs, self.problem.dropped
        hertz = "area" in outputs and "subscale_area" in dropped
        totals = [name for name in ("pressure", "area") if name in outputs and not (name == "area" and hertz)]
        of_law = sorted(outputs & set(OF_LAW))
        if self.problem.prescribed in INVERTED:
            of_law.append(f"{self.problem.prescribed} prescribed")
        steps = []
        if "yield" in outputs:
            steps.append(self.yielding([*totals, *of_law, "yield"]))
        elif self.problem.theory != "mbma":
            if of_law or totals:
                steps.append(self.by_theory([*totals, *of_law]))
        elif of_law:
            steps.append(self.law(of_law))
        elif totals:
            what = f"sum over islands at {self.count} gaps (Eqs. 48, 49)"
            steps.append(self.law(totals) if self.many_gaps() else self.summed("totals", ", ".join(totals), what, None))
        if hertz:
            what = "adaptive sum over islands with eta = 1, the Hertz area"
            steps.append(self.summed("hertz area", "area without subscale_area", what, "island4d"))
        if "island_statistics" in outputs:
            what = f"number of islands at {self.count} gaps, {self.problem.points} islands of the distribution (Eq. 42)"
            steps.append(self.summed("island statistics", "island_statistics", what, "rigid"))
        if "pressure_profile" in outputs:
            steps.append(self.profiles())
        followed = {
            "validity": f"validity and scatter of the theory at {self.count} gaps",
            "leakage": f"flow through the gaps of contacts at {self.count} gaps",
        }
        steps += [
            Step(name, name, what, None, None, self.count, 0.0, self.seconds_of_slopes())
            for name, what in followed.items()
            if name in outputs
        ]
        steps += [self.other_theory(name) for name in self.problem.theories]
        theory = self.problem.theory_name
        left_out = tuple(name for name in OUTPUTS if name not in outputs)
        switched_off = tuple(name for name in REFINEMENTS if name in dropped)
        island_models = {step.island_model for step in steps if isinstance(step.island_model, str)}
        first_use = max((self.costs.of(island_model, "import") for island_model in island_models), default=0.0)
        return Plan(tuple(steps), left_out, switched_off, self.rtol, self.costs.of("scene", "call"), first_use, theory)

    def many_gaps(self) -> bool:
        """Whether totals at the prescribed gaps cost more than a law, if one can be made."""
        if self.count < MIN_LAW_GAPS or "finite_height" in self.problem.dropped:
            return False
        from mbma_tables.law.make import MIN_LAW_RTOL

        return (1 - ISLAND_SHARE) * self.rtol >= MIN_LAW_RTOL

    def law(self, why: Sequence[str]) -> Step:
        from mbma_tables.law.make import MIN_LAW_RTOL

        inverse = self.problem.prescribed in INVERTED
        slopes = self.problem.outputs & {"stiffness", "conductance"}
        factor = AMPLIFICATION["slopes"] if slopes else AMPLIFICATION["inverse"] if inverse else 1.0
        tolerance = self.rtol / factor
        asked = (1 - ISLAND_SHARE) * tolerance
        if asked < MIN_LAW_RTOL:
            best = factor * MIN_LAW_RTOL / (1 - ISLAND_SHARE)
            raise InputError(f"rtol = {self.rtol:g} is too tight for {', '.join(why)}: a law meets {best:.0e} at best")
        island_model = self.island_model(tolerance)
        seconds = self.costs.of(_name(island_model), "law", asked) + self.seconds_of_law(inverse)
        error = factor * (asked + certified_error(island_model, asked))
        what = "the surface's force and area as piecewise polynomials of the gap, evaluated at every gap"
        return Step("law", ", ".join(why), what, island_model, asked, self.count, error, seconds)

    def summed(self, name: str, why: str, what: str, priced_as: str | None) -> Step:
        """A sum over islands at every gap; `priced_as` is an island model whose totals cost about the same."""
        island_model = self.island_model(self.rtol)
        asked = (1 - ISLAND_SHARE) * self.rtol
        priced = priced_as or _name(island_model)
        # its islands are answered once, as for a law
        seconds = self.costs.of(priced, "call") + self.count * self.costs.of(priced, "gap", asked)
        seconds = min(seconds, self.costs.of(priced, "law", asked))
        error = asked + certified_error(island_model, asked)
        return Step(name, why, what, island_model, asked, self.count, error, seconds)

    def profiles(self) -> Step:
        islands, asked = int(np.size(self.problem.deltas)), ISLAND_SHARE * self.rtol / AMPLIFICATION["profile"]
        seconds = islands * self.costs.of("exact", "profile", asked)
        what = "the island problem solved with p(r) and d(r)"
        return Step("profiles", "pressure_profile", what, "exact", asked, islands, asked, seconds)

    def by_theory(self, why: Sequence[str]) -> Step:
        """Results of another theory: computed directly, or by its law if that costs less and force and area suffice."""
        outputs, theory = self.problem.outputs, self.problem.theory_name
        inverse = self.problem.prescribed in INVERTED
        rtol = max((1 - ISLAND_SHARE) * self.rtol / AMPLIFICATION["inverse"], MIN_THEORY_LAW_RTOL)
        direct = seconds_by_theory(self.costs, theory, self.count, inverse, "energy" in outputs)
        by_law = self.costs.of(theory, "law", rtol) + self.seconds_of_law(inverse)
        pays = self.count >= MIN_LAW_GAPS_OF_OTHERS if math.isnan(direct) else by_law < direct
        own = self.own_error()
        name, asked, error, seconds = "contact", None, own, direct
        if pays and not outputs & set(OF_LAW):
            name, asked, seconds = "law", rtol, by_law
            error = (AMPLIFICATION["inverse"] if inverse else 1.0) * (rtol + own)
        what = f"pressure, area and derived quantities at {self.count} gaps"
        return Step(name, ", ".join(why), what, None, asked, self.count, error, seconds, theory=theory)

    def yielding(self, why: Sequence[str]) -> Step:
        """A theory's elastic results, corrected for a hardness."""
        theory, inverse = self.problem.theory_name, self.problem.prescribed in INVERTED
        mbma = self.problem.theory == "mbma"
        call = self.costs.of(theory, "call")
        each = seconds_by_theory(self.costs, theory, self.count, inverse) - call
        seconds = math.nan if mbma else YIELDING_CALL * call + YIELDING_GAP * each
        # the elastic errors of force and of area at that force may add up
        island_model, asked = (self.island_model(self.rtol / 2), ISLAND_SHARE * self.rtol / 2) if mbma else (None, None)
        error = 2 * (asked + certified_error(island_model, asked) if island_model and asked else self.own_error())
        what = f"pressure, area and yielded share at {self.count} gaps"
        return Step("contact", ", ".join(why), what, island_model, asked, self.count, error, seconds, theory=theory)

    def own_error(self) -> float:
        """Bound of the scene's theory on its numerical error."""
        from mbma_tables.theories import get_theory

        surface = self.problem.surface
        h_max, gaps = float(surface.h_max), self.problem.gaps
        known = gaps is not None and self.problem.prescribed not in INVERTED
        # the farther from the mid-plane, the larger
        farthest = np.max(gaps if self.problem.prescribed == "mean_separations" else (h_max + gaps) / 2) if known else 0
        u = min(max(farthest, 0.5 * h_max), LAST * h_max)
        return float(get_theory(self.problem.theory, surface).answer(surface, np.asarray(u)).error)

    def seconds_of_law(self, inverse: bool) -> float:
        """Seconds of a law's evaluations at the gaps."""
        found = self.costs.of("law", "invert") if inverse else 0.0
        return self.count * (self.costs.of("law", "lookup") + found)

    def seconds_of_slopes(self) -> float:
        """Seconds of totals with derivatives, about four times those without."""
        if self.problem.theory != "mbma":
            return self.count * self.costs.of(self.problem.theory_name, "gap")
        return 4 * self.count * self.costs.of("universal", "gap", self.rtol)

    def other_theory(self, name: str) -> Step:
        closed = name == "greenwood_williamson"
        seconds = self.count * self.costs.of(name if closed else "persson", "gap")
        what = "another theory at the same gaps"
        return Step(name, "comparison", what, None, None, self.count, 1e-14 if closed else 1e-9, seconds)


def _name(island_model: Any) -> str:
    """The name of an island model in the table of measured costs, which holds the shipped ones."""
    return island_model if isinstance(island_model, str) else ""
