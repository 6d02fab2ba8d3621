"""From effects and tolerance to steps: the cheapest tier whose certified error leaves room for the quadrature."""

from __future__ import annotations

import dataclasses
import math
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from mbma_tables.errors import InputError
from mbma_tables.scenes.costs import Costs, shipped_costs
from mbma_tables.scenes.effects import EFFECTS, OF_LAW, OUTPUTS, REFINEMENTS

if TYPE_CHECKING:
    from mbma_tables.scenes.scene import Scene

# bounds on islands that the shipped tables' certificates give; each run checks its own
CERTIFIED = {"rigid": 1e-14, "formula": 1e-2, "island4d": 1.75e-4, "universal": 6e-9, "exact": 0.0}
LADDER = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
SLOPE_SHARE = 1 / 300  # of the tolerance: a law's slopes are rarely worse than its values by more
LEAST_LAW_RTOL, LEAST_CONTACT_RTOL = 1e-9, 1e-11
MOST_RTOL = 0.1
LEAST_ISLAND4D_HURST = 0.3
OF_SLOPES = ("universal", "exact")  # nothing bounds the slopes of the others
LEAST_RIGID_RTOL = 1e-3  # below it no rigid sphere is worth its bound
SAMPLES = 96  # islands at which the rigid sphere's error is bounded


@dataclasses.dataclass(frozen=True)
class Step:
    """One step of a plan.

    Attributes
    ----------
    name, why, what : str
        What it is called, which effects asked for it, what it evaluates.
    tier : str or None
        Island model.
    rtol : float or None
        Asked of the totals, the law or the solver.
    count : int
        Gaps, islands or points evaluated.
    error, seconds : float
        Predicted.
    """

    name: str
    why: str
    what: str
    tier: str | None
    rtol: float | None
    count: int
    error: float
    seconds: float


@dataclasses.dataclass(frozen=True)
class Plan:
    """Steps in the order in which they run, what was left out, and seconds that every scene takes."""

    steps: tuple[Step, ...]
    left_out: tuple[str, ...]
    rtol: float
    overhead: float

    @property
    def seconds(self) -> float:
        """Predicted for all steps and what surrounds them."""
        return self.overhead + sum(step.seconds for step in self.steps)

    @property
    def error(self) -> float:
        """Largest predicted error of a step of this model; other theories state their own."""
        return max((step.error for step in self.steps if step.tier is not None), default=0.0)

    def step(self, name: str) -> Step | None:
        """The step of that name."""
        return next((step for step in self.steps if step.name == name), None)

    def text(self) -> str:
        """As a database prints a query plan."""
        head = f"Scene  (rtol={self.rtol:.1e}, predicted error={self.error:.1e}, time={_shown(self.seconds)})"
        lines = [head]
        for step in self.steps:
            by = "" if step.tier is None else f" by {step.tier}"
            asked = "" if step.rtol is None else f", rtol={step.rtol:.1e}"
            numbers = f"(count={step.count}{asked}, error={step.error:.1e}, time={_shown(step.seconds)})"
            lines += [f"  -> {step.name}{by}  {numbers}", f"       {step.what}", f"       for: {step.why}"]
        lines.append(f"  left out: {'; '.join(self.left_out) or 'nothing'}")
        return "\n".join(lines) + "\n"


def _shown(seconds: float) -> str:
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-6:.3g} us"


def make_plan(scene: Scene, costs: Costs | None = None) -> Plan:
    """The cheapest plan that meets the scene's tolerance, or the most accurate one within its time.

    Raises
    ------
    InputError
        Where no tier meets the tolerance, or no plan the time budget.
    """
    own = shipped_costs() if costs is None else costs
    if scene.rtol is not None:
        return _plan_at(scene, scene.rtol, own)
    seconds = scene.seconds
    assert seconds is not None
    best: Plan | None = None
    cheapest = math.inf
    for rtol in LADDER:
        try:
            plan = _plan_at(scene, rtol, own)
        except InputError:
            break
        cheapest = min(cheapest, plan.seconds)
        if plan.seconds <= seconds:
            best = plan
    if best is None:
        raise InputError(f"seconds = {seconds:g} is too little: the cheapest plan takes about {cheapest:.3g} s")
    return best


def _plan_at(scene: Scene, rtol: float, costs: Costs) -> Plan:
    steps: list[Step] = []
    outputs, dropped = scene.outputs, scene.dropped
    count = 0 if scene.gaps is None else int(scene.gaps.size)
    pressures = scene.prescribed == "nominal_pressures"
    slopes = outputs & {"stiffness", "conductance"}
    of_law = sorted(outputs & set(OF_LAW)) + (["nominal pressures prescribed"] if pressures else [])
    apart = "area" in outputs and "subscale_area" in dropped
    totals: list[str] = [name for name in ("force", "area") if name in outputs and not (name == "area" and apart)]
    tiers = candidates(scene, rtol) if (of_law or totals or apart or "island_statistics" in outputs) else {}
    smooth = {tier: bound for tier, bound in tiers.items() if tier in OF_SLOPES or "sphere_deformation" in dropped}
    law = None
    if of_law or totals:
        share = SLOPE_SHARE if slopes else 0.5 if (of_law or pressures) else 1.0
        law = _law_step(scene, rtol, share, count, smooth if slopes else tiers, costs, of_law or totals)
        if not of_law:
            direct = _totals_step(rtol, count, tiers, costs, totals)
            if direct is None and law is None:
                raise _impossible(rtol, tiers)
            law_pays = law is not None and (direct is None or law.seconds < direct.seconds)
            if not law_pays or "finite_height" in dropped:
                law = None
                if direct is None:
                    raise _impossible(rtol, tiers)
                steps.append(direct)
        if of_law and law is None:
            raise InputError(
                f"rtol = {rtol:g} is too tight for {', '.join(of_law)}: a law meets "
                f"{2 * LEAST_LAW_RTOL / share:.0e} at best"
            )
        if law is not None:
            steps.append(law)
    if apart:
        step = _totals_step(rtol, count, tiers, costs, ["area"], steps, "island4d")
        if step is None:
            raise _impossible(rtol, tiers)
        what = "adaptive sum over islands with eta = 1, the Hertz area"
        steps.append(dataclasses.replace(step, name="hertz area", why="area without subscale_area", what=what))
    if "island_statistics" in outputs:
        # the integral takes the geometry of a gap, the distribution some lookups
        step = _totals_step(rtol, count, tiers, costs, ["island_statistics"], steps, "rigid")
        if step is None:
            raise _impossible(rtol, tiers)
        what = f"number of islands at {count} gaps, {scene.points} islands of the distribution (Eq. 42)"
        steps.append(dataclasses.replace(step, name="island statistics", why="island_statistics", what=what))
    if "pressure_profile" in outputs:
        import numpy as np

        islands = int(np.size(scene.deltas))
        asked = max(0.1 * rtol, 1e-12)
        price = islands * costs.of("exact", "profile", rtol) + _start("exact", costs, steps)
        what = "the island problem solved anew, with p(r) and d(r)"
        steps.append(Step("profiles", "pressure_profile", what, "exact", asked, islands, asked, price))
    for theory in scene.theories:
        key = "greenwood_williamson" if theory == "greenwood_williamson" else "persson"
        price = count * costs.of(key, "gap")
        exact = 1e-14 if key == "greenwood_williamson" else 1e-9
        steps.append(Step(theory, "comparison", "another theory at the same gaps", None, None, count, exact, price))
    nobody = [f"{name} (nothing asked)" for name in OUTPUTS if name not in outputs]
    off = [f"{name} (switched off)" for name in REFINEMENTS if name in dropped]
    bounded = "rigid" in tiers and "sphere_deformation" not in dropped
    overhead = costs.of("scene", "call") + bounded * costs.of("scene", "bound")
    return Plan(tuple(steps), tuple(nobody + off), rtol, overhead)


def _impossible(rtol: float, tiers: dict[str, float]) -> InputError:
    return InputError(f"rtol = {rtol:g} is met by none of {', '.join(tiers)} here: give a larger rtol, 1e-8 say")


def _start(tier: str, costs: Costs, before: Sequence[Step] = ()) -> float:
    """First use of a tier, where it is still to come; what is loaded costs nothing again."""
    tiers = {step.tier for step in before if step.tier is not None}
    if tier in tiers or _opened(tier):
        return 0.0
    warm = bool(tiers) or "mbma_tables.totals.contact" in sys.modules
    return costs.of(tier, "open" if warm else "import")


def _opened(tier: str) -> bool:
    tabulated = sys.modules.get("mbma_tables.models.universal")
    return tabulated is not None and (tier, tabulated.shipped(tier)) in _asked


_asked: set[tuple[str, Any]] = set()


def note_opened(tier: str) -> None:
    """Remember that a table was opened: its start is paid for."""
    tabulated = sys.modules.get("mbma_tables.models.universal")
    if tabulated is not None and tier in ("universal", "island4d"):
        _asked.add((tier, tabulated.shipped(tier)))


def candidates(scene: Scene, rtol: float) -> dict[str, float]:
    """Tiers that may answer, each with the bound on its islands' relative error."""
    from mbma_tables.models import TIERS

    if "sphere_deformation" in scene.dropped:
        return {"rigid": CERTIFIED["rigid"]}
    found = {tier: bound for tier, bound in CERTIFIED.items() if tier in TIERS and tier != "rigid"}
    if (
        scene.rule.name != "reported"
        or float(scene.surface.hurst) < LEAST_ISLAND4D_HURST
        or "finite_height" in scene.dropped
    ):
        found.pop("island4d", None)
    worth = rtol >= LEAST_RIGID_RTOL
    return ({"rigid": rigid_error(scene)} if worth else {}) | found


def rigid_error(scene: Scene) -> float:
    """Bound on the error of rigid spheres over the islands of a scene, at most 1.

    p <= p_rigid, so w <= w_rigid <= w_rigid(0) = mu integral of F_{3/2}(t^2 - X) dt, and lifting the sphere by that
    everywhere gives too little: Phi_rigid(X - w) <= Phi(X) <= Phi_rigid(X). Islands are sampled.
    """
    import numpy as np

    from mbma_tables.islands.height_integrals import height_integral
    from mbma_tables.totals.island import geometry

    surface = scene.surface
    gap = -float(surface.h_max)
    if scene.gaps is not None and scene.prescribed == "separations":
        gap = float(scene.gaps.min())
    elif scene.gaps is not None and scene.prescribed == "mean_separations":
        gap = 2 * float(scene.gaps.min()) - float(surface.h_max)
    reach = (top_of(scene, 1e-2) - gap) / float(surface.h_rms)
    if reach <= 0:
        return 0.0
    approach = reach * np.geomspace(1e-6, 1.0, SAMPLES)
    g = geometry(approach, np.full(SAMPLES, surface.hurst), np.full(SAMPLES, surface.zeta_1), scene.rule)
    X, mu = g["X"], g["mu"]
    half = np.sqrt(np.maximum(X, 0) + 8) / 2
    nodes, weights = np.polynomial.legendre.leggauss(32)
    t = half[:, None] * (nodes + 1)
    w = mu * half * (height_integral(1.5, t**2 - X[:, None]) @ weights)
    shares = [height_integral(n, w - X) / height_integral(n, -X) for n in (2.5, 2.0)]
    return float(1 - min(share.min() for share in shares))


def top_of(scene: Scene, rtol: float) -> float:
    """Highest point above the mid-plane: h_max, or where the rest of the Gaussian adds less than rtol."""
    surface = scene.surface
    if "finite_height" not in scene.dropped or scene.gaps is None:
        return float(surface.h_max)
    least = scene.gaps.max() if scene.prescribed == "separations" else 2 * scene.gaps.max() - float(surface.h_max)
    # exp(-(d + t)^2/2) <= exp(-d^2/2) exp(-t^2/2); ten more for the powers before it, one s for h_d
    tail = math.sqrt(2 * (10 - math.log(rtol))) + 1
    return max(float(least), 0.0) + tail * float(surface.s)


def _law_step(
    scene: Scene, rtol: float, share: float, count: int, tiers: dict[str, float], costs: Costs, why: list[str]
) -> Step | None:
    """The cheapest law within the tolerance; None where there is none."""
    found = []
    for tier, bound in tiers.items():
        asked = min(0.5 * (share * rtol - bound), MOST_RTOL)
        if asked < LEAST_LAW_RTOL or not (costs.knows(tier, "law") or tier == "exact"):
            continue
        each = costs.of("law", "lookup", None, "force") + costs.of("law", "lookup", None, "area")
        if scene.prescribed == "nominal_pressures":
            each += costs.of("law", "invert", None, "force")
        if tier == "exact" and not costs.knows("exact", "law"):
            # about 300 totals at a tenth of the tolerance
            price = 300 * costs.of("exact", "gap", max(0.1 * asked, LEAST_CONTACT_RTOL))
        else:
            price = costs.of(tier, "law", asked)
        seconds = _start(tier, costs) + price + count * each
        error = (2 * asked + bound) / share
        what = "the surface frozen into F(d), A(d), then asked at every gap"
        found.append(Step("law", ", ".join(why), what, tier, asked, count, error, seconds))
    return min(found, key=lambda step: step.seconds, default=None)


def _totals_step(
    rtol: float,
    count: int,
    tiers: dict[str, float],
    costs: Costs,
    why: list[str],
    before: Sequence[Step] = (),
    compiled_as: str | None = None,
) -> Step | None:
    """The cheapest totals, gap by gap, within the tolerance; None where there is none.

    `compiled_as` is the tier at whose price the compiled kernel's tier sums here, where that kernel does not serve.
    """
    quantity = why[0] if len(why) == 1 and why[0] in EFFECTS else "both"
    found = []
    for tier, bound in tiers.items():
        # the exact solver works to a tenth of what is asked
        asked = min((rtol - bound) / (1.1 if tier == "exact" else 1.0), MOST_RTOL)
        if asked < LEAST_CONTACT_RTOL:
            continue
        if not costs.knows(tier, "gap"):
            continue
        priced = compiled_as if compiled_as is not None and tier in ("universal", compiled_as) else tier
        each = costs.of(priced, "gap", asked, quantity)
        seconds = _start(tier, costs, before) + costs.of(tier, "call", None) + count * each
        what = f"sum over islands at {count} gaps (Eqs. 48, 49)"
        found.append(Step("totals", ", ".join(why), what, tier, asked, count, bound + asked, seconds))
    return min(found, key=lambda step: step.seconds, default=None)
