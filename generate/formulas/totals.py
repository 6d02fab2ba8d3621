"""Closed forms of total force and area over the range of practice, in two branches, certified on other surfaces.

The branches meet where the largest islands reach the floor of zeta_d, at l = k with l = (h_max - d)/h_rms. Below it the
end of the integral decides, F ~ l^(7/2) and A ~ l^(10/3) at first contact; above it hardly more than the gap does. The
logarithms are sums of products of a few variables of order one: terms by backward elimination and annealing,
coefficients of least largest error. Force is over E* q0 h_rms, reading "reported".
"""

from __future__ import annotations

import functools
import itertools
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from generate.formulas.heights import rounded
from generate.formulas.terms import least_largest
from mbma_tables import Surface, contact
from mbma_tables.arguments import FloatArray
from mbma_tables.formulas.expressions import evaluate_steps

NAMES = ("force", "area")
POWERS = {"force": 3.5, "area": 10 / 3}
RANGE = {
    "d_over_h_rms": (-4.5, 4.5),
    "h_max_over_h_rms": (3.0, 4.5),
    "zeta_1": (10.0, 1000.0),
    "hurst": (0.5, 1.0),
}
LEAST_AREA = 1e-6
MARGIN = 0.7  # samples of the fit go down to this share of it
LEAST_REACH = 0.05  # l below which no surface of the range reaches LEAST_AREA
OVERLAP = 0.02  # of k, by which the samples of the branches overlap
DEGREE = 3
# what a power of each variable counts towards DEGREE, by branch
NEAR = {"t": 0.75, "b": 0.75, "q": 0.75, "c": 1.0, "z": 1.0, "h": 1.0}
FAR = {"g": 0.5, "s": 0.5, "y": 1.0, "h": 1.0, "z": 1.0}
TERMS = {"force": (22, 18), "area": (23, 17)}  # of the near and the far branch
POINTS, HELD_OUT = 12_000, 60_000
EDGE = 0.3  # share of each property that lies on an end of its range, where the error is largest
FIT_SEED, HELD_OUT_SEED = 41, 42
TRIALS = 3000  # exchanges tried by annealing, on every THIN-th sample
THIN = 4
HEAT = 0.04  # relative loss that a swap may cost at first
CHOICES = 4.0  # how deep into the ranked columns a swap reaches
TRIAL_ROUNDS = 15
ANNEAL_SEED = 43
SLACK = 1.01
MOST_DIGITS = 15

Form = dict[str, Any]
Powers = tuple[int, ...]

VARIABLES = [
    ["l", "h_max_over_h_rms - d_over_h_rms"],
    ["k", "2.25*sqrt(1.5**(-2*hurst) - zeta_1**(-2*hurst))"],
    ["t", "log(1 + l*zeta_1**hurst)/3 - 1"],
    ["q", "1/(1 + l*zeta_1**hurst)"],
    ["b", "l - 1"],
    ["c", "(h_max_over_h_rms - 3.75)/0.75"],
    ["z", "log(zeta_1)/2.3 - 2"],
    ["y", "2/sqrt(zeta_1) - 0.4"],
    ["h", "4*hurst - 3"],
    ["g", "(d_over_h_rms + 1)/3.7"],
    ["s", "(d_over_h_rms + 0.3)/sqrt((d_over_h_rms + 0.3)**2 + 1)"],
]


def arguments(count: int, seed: int) -> dict[str, FloatArray]:
    """Random surfaces and gaps of the range; a share of each property on the ends of its range, corners included."""
    rng = np.random.default_rng(seed)

    def drawn(low: float, high: float) -> FloatArray:
        place = rng.uniform(-EDGE / 2, 1 + EDGE / 2, count)
        return low + (high - low) * np.clip(place, 0.0, 1.0)

    hurst = drawn(*RANGE["hurst"])
    zeta_1 = np.clip(np.exp(drawn(*np.log(RANGE["zeta_1"]))), *RANGE["zeta_1"])
    top = drawn(*RANGE["h_max_over_h_rms"])
    reach = np.minimum(np.exp(rng.uniform(np.log(LEAST_REACH), np.log(2 * top))), 2 * top)
    part = rng.uniform(size=count)
    # full compression; evenly in d; and where the branches meet, which no random point hits
    reach = np.where(part < 0.03, 2 * top, np.where(part < 0.35, rng.uniform(0.1, 1.0, count) * 2 * top, reach))
    meet = 2.25 * np.sqrt(1.5 ** (-2 * hurst) - zeta_1 ** (-2 * hurst)) * rng.uniform(1 - OVERLAP, 1 + OVERLAP, count)
    reach = np.where(part > 0.9, meet, reach)
    return {"d_over_h_rms": top - reach, "h_max_over_h_rms": top, "zeta_1": zeta_1, "hurst": hurst}


@functools.cache
def samples(
    count: int, seed: int, least_area: float = LEAST_AREA
) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
    """Arguments, and force and area by the universal table (error 1e-8), where contact is above `least_area`."""
    given = arguments(count, seed)
    surface = Surface(given["hurst"], 1.0, given["zeta_1"], 1.0, given["h_max_over_h_rms"])
    found = contact(surface, given["d_over_h_rms"])
    kept = found.area > least_area
    return {name: a[kept] for name, a in given.items()}, {name: getattr(found, name)[kept] for name in NAMES}


def products(weights: dict[str, float]) -> list[Powers]:
    """Powers of the variables whose weighted sum is at most DEGREE."""
    each = (range(int(DEGREE / w) + 1) for w in weights.values())
    return [p for p in itertools.product(*each) if np.dot(p, list(weights.values())) <= DEGREE + 1e-9]


def matrix(powers: list[Powers], weights: dict[str, float], named: dict[str, FloatArray]) -> FloatArray:
    """One column a product."""
    return np.stack([np.prod([named[v] ** n for v, n in zip(weights, p, strict=True)], axis=0) for p in powers], 1)


def _lawson(M: FloatArray, target: FloatArray, weight: FloatArray, rounds: int) -> tuple[float, FloatArray]:
    """Least largest error by few and quick rounds of reweighting (normal equations), and the weights found."""
    best, kept_weight = np.inf, weight
    for _ in range(rounds):
        weighted = M * weight[:, None]
        gram = weighted.T @ M
        solved = np.linalg.solve(gram + 1e-12 * np.trace(gram) * np.eye(len(gram)), weighted.T @ target)
        error = np.abs(M @ solved - target)
        largest = float(error.max())
        if largest < best:
            best, kept_weight = largest, weight
        grown = weight * (error / largest + 1e-3)
        weight = np.maximum(grown / grown.mean(), 1e-5)
    return best, kept_weight


def eliminate(M: FloatArray, target: FloatArray, count: int) -> list[int]:
    """Columns left when those that matter least to the largest error have gone one after another."""
    kept, weight = list(range(M.shape[1])), np.ones(target.size)
    while len(kept) > count:
        own = M[:, kept]
        root = np.sqrt(weight)
        weight = _lawson(own, target, root / root.mean(), TRIAL_ROUNDS)[1]
        harm = _harm(own, target, weight)
        several = max(1, len(kept) // 15) if len(kept) > count + 10 else 1
        gone = set(np.argsort(harm)[:several].tolist())
        kept = [column for place, column in enumerate(kept) if place not in gone]
    return kept


def _harm(own: FloatArray, target: FloatArray, weight: FloatArray) -> FloatArray:
    """How much worse the weighted fit becomes without each column."""
    weighted = own * (weight + 0.03)[:, None]
    gram = weighted.T @ own
    inverse = np.linalg.inv(gram + 1e-12 * np.trace(gram) * np.eye(len(gram)))
    harm: FloatArray = (inverse @ (weighted.T @ target)) ** 2 / np.diag(inverse)
    return harm


def anneal(M: FloatArray, target: FloatArray, kept: list[int]) -> list[int]:
    """Swap columns, at first also for slightly worse ones, and keep the set of least largest error."""
    rng = np.random.default_rng(ANNEAL_SEED)
    now, weight = _lawson(M[:, kept], target, np.ones(target.size), 2 * TRIAL_ROUNDS)
    best, found = now, kept
    tried = 0
    while tried < TRIALS:
        root = np.sqrt(weight + 0.03)
        weighted, right = M * root[:, None], target * root
        norm = np.linalg.norm(weighted, axis=0)
        drop = np.argsort(_harm(M[:, kept], target, weight))[min(int(rng.exponential(CHOICES)), len(kept) - 1)]
        rest = [column for place, column in enumerate(kept) if place != drop]
        Q = np.linalg.qr(weighted[:, rest])[0]
        left, free = right - Q @ (Q.T @ right), weighted - Q @ (Q.T @ weighted)
        size = np.linalg.norm(free, axis=0)
        gain = np.where(size > 1e-4 * norm, np.abs(free.T @ left) / np.maximum(size, 1e-9), 0.0)
        gain[kept] = 0.0
        ranked = np.argsort(-gain)[: M.shape[1] - len(kept)]
        for _ in range(3):
            tried += 1
            trial = [*rest, int(ranked[min(int(rng.exponential(CHOICES)), len(ranked) - 1)])]
            start = np.sqrt(weight)
            error, heavier = _lawson(M[:, trial], target, start / start.mean(), TRIAL_ROUNDS)
            if error < now * (1 + HEAT * (1 - tried / TRIALS) * rng.exponential()):
                now, weight, kept = error, heavier, trial
                break
        if now < best:
            best, found = now, kept
    return found


def base(name: str, far: bool, named: dict[str, FloatArray], given: dict[str, FloatArray]) -> FloatArray:
    """What a branch starts from: `_start` as numbers."""
    found: FloatArray = evaluate_steps([["start", _start(name, far)]], named | given, ("start",))["start"]
    return found


def _start(name: str, far: bool) -> str:
    """The power of first contact, the layer and the Gaussian at the largest islands; beyond, the tail of heights."""
    if far:
        return "-((d_over_h_rms + sqrt(d_over_h_rms**2 + 2))**2)/8"
    layer = f"{POWERS[name]:.10g}*log(l/(1 + l*zeta_1**hurst))"
    return f"{layer} - (h_max_over_h_rms - 0.4444444444*l)**2/2"


@functools.cache
def branch(name: str, far: bool, count: int) -> tuple[tuple[Powers, ...], tuple[float, ...]]:
    """Products and coefficients of one branch of log(force) or log(area)."""
    given, truth = samples(POINTS, FIT_SEED, MARGIN * LEAST_AREA)
    named = evaluate_steps(VARIABLES, given, [step[0] for step in VARIABLES])
    place = named["l"] / named["k"]
    mine = place > 1 - OVERLAP if far else place < 1 + OVERLAP
    named, given = ({key: a[mine] for key, a in group.items()} for group in (named, given))
    target = np.log(truth[name][mine]) - base(name, far, named, given)
    weights = FAR if far else NEAR
    powers = products(weights)
    M = matrix(powers, weights, named)
    scaled = M / np.abs(M).max(axis=0)
    few = slice(None, None, THIN)
    # the search forks on the last digit of a sum, which must not depend on the number of threads
    with threadpool_limits(1):
        kept = anneal(scaled[few], target[few], eliminate(scaled[few], target[few], count))
    return tuple(powers[k] for k in kept), tuple(least_largest(M[:, kept], target)[1].tolist())


def _sum(name: str, far: bool, count: int, digits: int) -> str:
    weights = FAR if far else NEAR
    powers, coefficients = branch(name, far, count)
    text = ""
    for p, value in zip(powers, rounded(np.array(coefficients), digits).tolist(), strict=True):
        factors = [v if n == 1 else f"{v}**{n}" for v, n in zip(weights, p, strict=True) if n]
        sign = (" - " if value < 0 else " + ") if text else ("-" if value < 0 else "")
        text += sign + "*".join([repr(abs(value)), *factors])
    return text


def _steps(counts: dict[str, tuple[int, int]], digits: dict[str, int]) -> list[list[str]]:
    steps = list(VARIABLES)
    for name in NAMES:
        for far, side in ((False, "near"), (True, "far")):
            text = f"{_start(name, far)} + {_sum(name, far, counts[name][far], digits[name])}"
            steps.append([f"{side}_{name}", text.replace("+ -", "- ")])
        steps.append([name, f"exp(select(l - k, far_{name}, near_{name}))"])
    return steps


def _errors(steps: list[list[str]], count: int, seed: int) -> dict[str, FloatArray]:
    given, truth = samples(count, seed)
    found = evaluate_steps(steps, given, NAMES)
    return {name: np.abs(found[name] / truth[name] - 1) for name in NAMES}


def totals_form() -> Form:
    """The closed totals with their certificate, in the shape of the formula file."""

    def largest(places: int) -> dict[str, float]:
        steps = _steps(TERMS, dict.fromkeys(NAMES, places))
        return {name: float(error.max()) for name, error in _errors(steps, POINTS, FIT_SEED).items()}

    best = largest(MOST_DIGITS)
    digits = {
        name: next(p for p in range(2, MOST_DIGITS + 1) if largest(p)[name] <= SLACK * best[name]) for name in NAMES
    }
    steps = _steps(TERMS, digits)
    given, _ = samples(HELD_OUT, HELD_OUT_SEED)
    stated: Form = {"points": int(given["hurst"].size)}
    for name, error in _errors(steps, HELD_OUT, HELD_OUT_SEED).items():
        worst = int(error.argmax())
        stated[name] = {
            "largest": float(f"{error.max():.3g}"),
            "median": float(f"{np.median(error):.3g}"),
            "worst_at": {key: float(f"{a[worst]:.4g}") for key, a in given.items()},
        }
    return {
        "title": "totals: force over E* q0 h_rms, and area",
        "arguments": list(RANGE),
        "range": {name: list(ends) for name, ends in RANGE.items()} | {"area": [LEAST_AREA, 1.0]},
        "steps": steps,
        "outputs": {name: name for name in NAMES},
        "coefficients": {name: sum(TERMS[name]) for name in NAMES},
        "errors": stated,
    }
