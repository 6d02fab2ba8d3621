"""Closed forms of total force and area over the range of practice, in two branches, certified on other surfaces.

The branches meet where the largest islands reach the floor of zeta_d, at r = k with r = (h_max - d)/h_rms. Below it the
end of the integral decides, F ~ r^(7/2) and A ~ r^(10/3) at first contact; above it hardly more than the gap does. The
logarithms are sums of products of a few variables of order one: terms by backward elimination and annealing,
coefficients of least largest error. Force is over E* q0 h_rms, variant "reported".
"""

from __future__ import annotations

import functools
import itertools

import numpy as np
import sympy
from threadpoolctl import threadpool_limits

from generate.formulas.fit import DATA_DIGITS, certificate, fewest_digits, least_largest, rounded, score
from generate.formulas.printing import Form, Function, Step, evaluate, needed, steps_of
from mbma_tables import Surface, contact
from mbma_tables.common.arguments import FloatArray

NAMES = ("pressure", "area")
RANGES = {
    "d_over_h_rms": (-4.5, 4.5),
    "h_max_over_h_rms": (3.0, 4.5),
    "zeta_1": (10.0, 1000.0),
    "hurst": (0.5, 1.0),
}
MIN_AREA = 1e-6
MARGIN = 0.7  # samples of the fit go down to this share of it
MIN_PENETRATION = 0.03  # r below which no surface of the range reaches MARGIN*MIN_AREA
OVERLAP = 0.02  # of k, by which the samples of the branches overlap
DEGREE = 3
# what a power of each variable counts towards DEGREE, by branch
NEAR = {"t": 0.75, "b": 0.75, "q": 0.75, "c": 1.0, "z": 1.0, "h": 1.0}
FAR = {"g": 0.5, "s": 0.5, "y": 1.0, "h": 1.0, "z": 1.0}
TERMS = {"pressure": (22, 18), "area": (23, 17)}  # of the near and the far branch
POINTS, HELD_OUT = 40_000, 60_000
EDGE = 0.3  # share of each property that lies on an end of its range, where the error is largest
FIT_SEED, HELD_OUT_SEED = 41, 42
TRIALS = 6000  # exchanges tried by annealing, on every THIN-th sample
THIN = 12
HEAT = 0.04  # relative loss that a swap may cost at first
CHOICES = 4.0  # how deep into the ranked columns a swap reaches
TRIAL_ROUNDS = 15
# share of the trace added to normal equations: with 1e-12 the search takes another turn when samples change by 1e-15,
# with 1e-9 when they change by 1e-13, with 1e-7 not when they change by 1e-13
RIDGE = 1e-7
ANNEAL_SEEDS = (43, 44, 45, 46)  # the best of as many searches
SLACK = 1.01

Powers = tuple[int, ...]

VARIABLES = steps_of(
    [
        ("r", "h_max_over_h_rms - d_over_h_rms"),
        ("k", "9/4*sqrt((3/2)**(-2*hurst) - zeta_1**(-2*hurst))"),
        ("t", "log(1 + r*zeta_1**hurst)/3 - 1"),
        ("q", "1/(1 + r*zeta_1**hurst)"),
        ("b", "r - 1"),
        ("c", "4*h_max_over_h_rms/3 - 5"),
        ("z", "log(zeta_1)/log(10) - 2"),
        ("y", "2/sqrt(zeta_1) - 2/5"),
        ("h", "4*hurst - 3"),
        ("g", "(d_over_h_rms + 1)/4"),
        ("s", "(d_over_h_rms + 0.3)/sqrt((d_over_h_rms + 0.3)**2 + 1)"),
    ],
    RANGES,
)
# what a branch starts from: the power of first contact, the layer and the Gaussian at the largest islands; beyond, the
# tail of heights
STARTS = {
    ("pressure", False): "7/2*log(r/(1 + r*zeta_1**hurst)) - (h_max_over_h_rms - 4*r/9)**2/2",
    ("area", False): "10/3*log(r/(1 + r*zeta_1**hurst)) - (h_max_over_h_rms - 4*r/9)**2/2",
    ("pressure", True): "-(d_over_h_rms + sqrt(d_over_h_rms**2 + 2))**2/8",
    ("area", True): "-(d_over_h_rms + sqrt(d_over_h_rms**2 + 2))**2/8",
}


def arguments(count: int, seed: int) -> dict[str, FloatArray]:
    """Random surfaces and gaps of the range; a share of each property on the ends of its range, corners included."""
    rng = np.random.default_rng(seed)

    def drawn(low: float, high: float) -> FloatArray:
        place = rng.uniform(-EDGE / 2, 1 + EDGE / 2, count)
        return low + (high - low) * np.clip(place, 0.0, 1.0)

    hurst = drawn(*RANGES["hurst"])
    zeta_1 = np.clip(np.exp(drawn(*np.log(RANGES["zeta_1"]))), *RANGES["zeta_1"])
    top = drawn(*RANGES["h_max_over_h_rms"])
    r = np.minimum(np.exp(rng.uniform(np.log(MIN_PENETRATION), np.log(2 * top))), 2 * top)
    part = rng.uniform(size=count)
    # full compression; evenly in d; and where the branches meet, which no random point hits
    r = np.where(part < 0.03, 2 * top, np.where(part < 0.35, rng.uniform(0.1, 1.0, count) * 2 * top, r))
    meet = 2.25 * np.sqrt(1.5 ** (-2 * hurst) - zeta_1 ** (-2 * hurst)) * rng.uniform(1 - OVERLAP, 1 + OVERLAP, count)
    r = np.where(part > 0.9, meet, r)
    drawn_values = {"h_max_over_h_rms": top, "zeta_1": zeta_1, "hurst": hurst}
    # full compression stays within -h_max as top is rounded before r is taken off it
    given = {name: rounded(values, DATA_DIGITS) for name, values in drawn_values.items()}
    gap = np.maximum(rounded(given["h_max_over_h_rms"] - r, DATA_DIGITS), -given["h_max_over_h_rms"])
    return {"d_over_h_rms": gap, **given}


@functools.cache
def samples(count: int, seed: int, min_area: float = MIN_AREA) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
    """Arguments, and force and area by the universal table (error 1e-8), where contact is above `min_area`."""
    given = arguments(count, seed)
    surface = Surface(given["hurst"], 1.0, given["zeta_1"], 1.0, given["h_max_over_h_rms"])
    found = contact(surface, separation=given["d_over_h_rms"])
    kept = found.area > min_area
    return {name: a[kept] for name, a in given.items()}, {name: getattr(found, name)[kept] for name in NAMES}


def products(weights: dict[str, float]) -> list[Powers]:
    """Powers of the variables whose weighted sum is at most DEGREE."""
    each = (range(int(DEGREE / w) + 1) for w in weights.values())
    return [p for p in itertools.product(*each) if np.dot(p, list(weights.values())) <= DEGREE + 1e-9]


def matrix(powers: list[Powers], weights: dict[str, float], named: dict[str, FloatArray]) -> FloatArray:
    """One column a product."""
    return np.stack([np.prod([named[v] ** n for v, n in zip(weights, p, strict=True)], axis=0) for p in powers], 1)


def _normal(M: FloatArray, target: FloatArray, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Normal equations of a weighted fit, ridge included, and their right-hand side."""
    weighted = M * weight[:, None]
    gram = weighted.T @ M
    return gram + RIDGE * np.trace(gram) * np.eye(len(gram)), weighted.T @ target


def _reweighted(M: FloatArray, target: FloatArray, weight: FloatArray, rounds: int) -> tuple[float, FloatArray]:
    """Least largest error by few and quick rounds of reweighting, and the weights found."""
    best, kept_weight = np.inf, weight
    for _ in range(rounds):
        error = np.abs(M @ np.linalg.solve(*_normal(M, target, weight)) - target)
        largest = float(error.max())
        if largest < best:
            best, kept_weight = largest, weight
        grown = weight * (error / largest + 1e-3)
        weight = np.maximum(grown / grown.mean(), 1e-5)
    return score(best), kept_weight


def _harm(M: FloatArray, target: FloatArray, weight: FloatArray) -> FloatArray:
    """How much worse the weighted fit becomes without each column."""
    gram, right = _normal(M, target, weight + 0.03)
    inverse = np.linalg.inv(gram)
    return rounded((inverse @ right) ** 2 / np.diag(inverse), 6)


def _root(weight: FloatArray) -> FloatArray:
    root: FloatArray = np.sqrt(weight) / np.sqrt(weight).mean()
    return root


def eliminate(M: FloatArray, target: FloatArray, count: int) -> list[int]:
    """Columns left when those that matter least to the largest error have gone one after another."""
    kept, weight = list(range(M.shape[1])), np.ones(target.size)
    while len(kept) > count:
        weight = _reweighted(M[:, kept], target, _root(weight), TRIAL_ROUNDS)[1]
        several = max(1, len(kept) // 15) if len(kept) > count + 10 else 1
        gone = set(np.argsort(_harm(M[:, kept], target, weight), kind="stable")[:several].tolist())
        kept = [column for place, column in enumerate(kept) if place not in gone]
    return kept


def _ranked(M: FloatArray, target: FloatArray, weight: FloatArray, rest: list[int]) -> list[int]:
    """Columns in the order in which they would help a weighted fit of the columns `rest`."""
    root = np.sqrt(weight + 0.03)
    weighted = M * root[:, None]
    Q = np.linalg.qr(weighted[:, rest])[0]
    right = target * root
    missing, free = right - Q @ (Q.T @ right), weighted - Q @ (Q.T @ weighted)
    size = np.linalg.norm(free, axis=0)
    new = size > 1e-4 * np.linalg.norm(weighted, axis=0)
    gain = np.where(new, np.abs(free.T @ missing) / np.maximum(size, 1e-9), 0.0)
    order: list[int] = np.argsort(-rounded(gain, 6), kind="stable").tolist()
    return order


def anneal(M: FloatArray, target: FloatArray, kept: list[int], seed: int) -> list[int]:
    """Swap columns, at first also for slightly worse ones, and keep the set of least largest error."""
    rng = np.random.default_rng(seed)
    now, weight = _reweighted(M[:, kept], target, np.ones(target.size), 2 * TRIAL_ROUNDS)
    best, found = now, kept
    tried = 0
    while tried < TRIALS:
        harm = np.argsort(_harm(M[:, kept], target, weight), kind="stable")
        drop = harm[min(int(rng.exponential(CHOICES)), len(kept) - 1)]
        rest = [column for place, column in enumerate(kept) if place != drop]
        ranked = [column for column in _ranked(M, target, weight, rest) if column not in kept]
        for _ in range(3):
            tried += 1
            trial = [*rest, ranked[min(int(rng.exponential(CHOICES)), len(ranked) - 1)]]
            error, heavier = _reweighted(M[:, trial], target, _root(weight), TRIAL_ROUNDS)
            if error < now * (1 + HEAT * (1 - tried / TRIALS) * rng.exponential()):
                now, weight, kept = error, heavier, trial
                break
        if now < best:
            best, found = now, kept
    return found


@functools.cache
def branch(name: str, far: bool, count: int) -> tuple[tuple[Powers, ...], tuple[float, ...]]:
    """Products and coefficients of one branch of log(force) or log(area)."""
    given, truth = samples(POINTS, FIT_SEED, MARGIN * MIN_AREA)
    start = steps_of([("start", STARTS[name, far])], [*RANGES, "r"])
    named = evaluate([*VARIABLES, *start], given)
    place = named["r"] / named["k"]
    mine = place > 1 - OVERLAP if far else place < 1 + OVERLAP
    weights = FAR if far else NEAR
    target = rounded((np.log(truth[name]) - named["start"])[mine], DATA_DIGITS)
    powers = products(weights)
    M = matrix(powers, weights, {v: rounded(named[v][mine], DATA_DIGITS) for v in weights})
    scaled = M / np.abs(M).max(axis=0)
    few = slice(None, None, THIN)
    # the order of a sum must not depend on the number of threads
    with threadpool_limits(1):
        first = eliminate(scaled[few], target[few], count)
        found = [sorted(anneal(scaled[few], target[few], first, seed)) for seed in ANNEAL_SEEDS]
        fits = [least_largest(M[:, kept], target) for kept in found]
    best = min(range(len(fits)), key=lambda place: score(fits[place][0]))
    return tuple(powers[k] for k in found[best]), tuple(fits[best][1].tolist())


def function_steps(name: str, digits: int) -> tuple[Step, ...]:
    """Steps of force or area, coefficients with that many digits."""
    logs = {}
    for far, side in ((False, "near"), (True, "far")):
        total = steps_of([(side, STARTS[name, far])], [*RANGES, "r"])[0][1]
        powers, coefficients = branch(name, far, TERMS[name][far])
        for p, value in zip(powers, rounded(np.array(coefficients), digits).tolist(), strict=True):
            named = map(sympy.Symbol, FAR if far else NEAR)
            total += sympy.Float(value) * sympy.Mul(*(v**n for v, n in zip(named, p, strict=True)))
        logs[side] = total
    ends = steps_of([("log_total", "where(r > k, far, near)"), (name, "exp(log_total)")], ["r", "k", "far", "near"])
    return needed([*VARIABLES, *logs.items(), *ends])


def totals_form() -> Form:
    """The closed totals with their certificates."""
    functions, certificates = [], {}
    for name in NAMES:

        def errors(digits: int, count: int = POINTS, seed: int = FIT_SEED, name: str = name) -> FloatArray:
            given, truth = samples(count, seed)
            error: FloatArray = np.abs(evaluate(function_steps(name, digits), given)[name] / truth[name] - 1)
            return error

        digits = fewest_digits(lambda digits, errors=errors: float(errors(digits).max()), SLACK)  # type: ignore[misc]
        given, _ = samples(HELD_OUT, HELD_OUT_SEED)
        certificates[name] = certificate(sum(TERMS[name]), errors(digits, HELD_OUT, HELD_OUT_SEED), given)
        quantity = {"pressure": "Pressure over E* q0 h_rms", "area": "A/A0"}[name]
        title = f"{quantity}, closed totals: within {certificates[name].largest:g}."
        functions.append(Function("totals", name, tuple(RANGES), title, function_steps(name, digits)))
    return Form("totals", RANGES | {"area": (MIN_AREA, 1.0)}, tuple(functions), certificates)
