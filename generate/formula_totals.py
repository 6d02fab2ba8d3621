"""Closed forms of total force and area over the range of practice, in two branches, certified on other surfaces.

The branches meet where the largest islands reach the floor of zeta_d, at l = k with l = (h_max - d)/h_rms. Below it the
end of the integral decides, F ~ l^(7/2) and A ~ l^(10/3) at first contact; above it hardly more than the gap does. The
logarithms are sums of products of a few variables of order one: terms by backward elimination and exchange,
coefficients of least largest error. Force is over E* q0 h_rms, reading "reported".
"""

from __future__ import annotations

import functools
import itertools
from typing import Any

import numpy as np

from generate.formula_heights import rounded
from generate.formula_terms import least_largest
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
MARGIN = 0.5  # samples of the fit go down to this share of it
LEAST_REACH = 0.05  # l below which no surface of the range reaches LEAST_AREA
OVERLAP = 0.05  # of k, by which the samples of the branches overlap
DEGREE = 3
# what a power of each variable counts towards DEGREE, by branch
NEAR = {"t": 0.75, "b": 0.75, "q": 0.75, "c": 1.0, "z": 1.0, "h": 1.0}
FAR = {"g": 0.5, "s": 0.5, "x": 1.0, "c": 1.0, "y": 1.0, "h": 1.0, "z": 1.0}
TERMS = (20, 20)
POINTS, HELD_OUT = 9000, 20_000
FIT_SEED, HELD_OUT_SEED = 41, 42
DROPS, ADDITIONS = 8, 6  # exchanges tried a round
ROUNDS = 30
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
    ["x", "exp(-2*(l - k))"],
]


def arguments(count: int, seed: int) -> dict[str, FloatArray]:
    """Random surfaces and gaps of the range; a share of them on each of its edges."""
    rng = np.random.default_rng(seed)
    hurst = rng.uniform(*RANGE["hurst"], count)
    least, most = np.log(RANGE["zeta_1"])
    zeta_1 = np.exp(rng.uniform(least, most, count))
    top = rng.uniform(*RANGE["h_max_over_h_rms"], count)
    reach = np.exp(rng.uniform(np.log(LEAST_REACH), np.log(2 * top)))
    share = count // 20
    for number, (field, name) in enumerate(((hurst, "hurst"), (zeta_1, "zeta_1"), (top, "h_max_over_h_rms"))):
        field[2 * number * share : (2 * number + 1) * share] = RANGE[name][0]
        field[(2 * number + 1) * share : (2 * number + 2) * share] = RANGE[name][1]
    reach = np.minimum(reach, 2 * top)
    reach[6 * share : 7 * share] = 2 * top[6 * share : 7 * share]
    # where the branches meet, which no random point hits
    meet = slice(7 * share, 9 * share)
    floor, end = 1.5 ** (-2 * hurst[meet]), zeta_1[meet] ** (-2 * hurst[meet])
    reach[meet] = 2.25 * np.sqrt(floor - end) * rng.uniform(1 - OVERLAP, 1 + OVERLAP, 2 * share)
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


def eliminate(M: FloatArray, target: FloatArray, count: int) -> list[int]:
    """Columns left when those that matter least have gone one after another."""
    scaled = M / np.abs(M).max(axis=0)
    gram, right = scaled.T @ scaled, scaled.T @ target
    kept = list(range(M.shape[1]))
    while len(kept) > count:
        inverse = np.linalg.inv(gram[np.ix_(kept, kept)] + 1e-9 * target.size * np.eye(len(kept)))
        harm = (inverse @ right[kept]) ** 2 / np.diag(inverse)
        several = max(1, len(kept) // 20) if len(kept) > count + 12 else 1
        gone = set(np.argsort(harm)[:several].tolist())
        kept = [column for place, column in enumerate(kept) if place not in gone]
    return kept


def exchange(M: FloatArray, target: FloatArray, kept: list[int]) -> list[int]:
    """Swap a column for another for as long as the largest error falls."""
    scaled = M / np.abs(M).max(axis=0)
    best, found = least_largest(M[:, kept], target)
    for _ in range(ROUNDS):
        error = np.abs(M[:, kept] @ found - target)
        # what is worst now counts most
        root = np.sqrt((error / error.max()) ** 2 + 1e-2)[:, None]
        weighted, right = scaled * root, target * root[:, 0]
        own = weighted[:, kept]
        inverse = np.linalg.pinv(own.T @ own)
        order = np.argsort((inverse @ (own.T @ right)) ** 2 / np.diag(inverse))
        for place in order[:DROPS]:
            rest = [column for k, column in enumerate(kept) if k != place]
            Q = np.linalg.qr(weighted[:, rest])[0]
            left, free = right - Q @ (Q.T @ right), weighted - Q @ (Q.T @ weighted)
            norm = np.linalg.norm(free, axis=0)
            gain = np.where(norm > 1e-6, np.abs(free.T @ left) / np.maximum(norm, 1e-6), 0.0)
            gain[kept] = 0.0
            trials = [(*least_largest(M[:, [*rest, int(k)]], target), int(k)) for k in np.argsort(-gain)[:ADDITIONS]]
            error_now, coefficients, column = min(trials, key=lambda trial: trial[0])
            if error_now < 0.999 * best:
                best, found, kept = error_now, coefficients, [*rest, column]
                break
        else:
            return kept
    return kept


def base(name: str, named: dict[str, FloatArray], given: dict[str, FloatArray]) -> FloatArray:
    """What the near branch starts from: the power of first contact, the layer, the Gaussian at the largest islands."""
    end = given["h_max_over_h_rms"] - 4 / 9 * named["l"]
    layer = named["l"] / (1 + named["l"] * given["zeta_1"] ** given["hurst"])
    found: FloatArray = POWERS[name] * np.log(layer) - end**2 / 2
    return found


@functools.cache
def branch(name: str, far: bool, count: int) -> tuple[tuple[Powers, ...], tuple[float, ...]]:
    """Products and coefficients of one branch of log(force) or log(area)."""
    given, truth = samples(POINTS, FIT_SEED, MARGIN * LEAST_AREA)
    named = evaluate_steps(VARIABLES, given, [step[0] for step in VARIABLES])
    place = named["l"] / named["k"]
    mine = place > 1 - OVERLAP if far else place < 1 + OVERLAP
    named, given = ({key: a[mine] for key, a in group.items()} for group in (named, given))
    target = np.log(truth[name][mine])
    if not far:
        target = target - base(name, named, given)
    weights = FAR if far else NEAR
    powers = products(weights)
    M = matrix(powers, weights, named)
    kept = exchange(M, target, eliminate(M, target, count))
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


def _steps(counts: tuple[int, int], digits: dict[str, int]) -> list[list[str]]:
    steps = list(VARIABLES)
    for name in NAMES:
        near, far = (_sum(name, side, counts[side], digits[name]) for side in (False, True))
        start = f"{POWERS[name]:.10g}*log(l/(1 + l*zeta_1**hurst)) - (h_max_over_h_rms - 0.4444444444*l)**2/2"
        steps += [
            [f"near_{name}", f"{start} + {near}".replace("+ -", "- ")],
            [f"far_{name}", far],
            [name, f"exp(select(l - k, far_{name}, near_{name}))"],
        ]
    return steps


def _errors(steps: list[list[str]], count: int, seed: int) -> dict[str, FloatArray]:
    given, truth = samples(count, seed)
    found = evaluate_steps(steps, given, NAMES)
    return {name: np.abs(found[name] / truth[name] - 1) for name in NAMES}


def totals_form(counts: tuple[int, int] = TERMS) -> Form:
    """The closed totals with their certificate, in the shape of the formula file."""

    def largest(places: int) -> dict[str, float]:
        steps = _steps(counts, dict.fromkeys(NAMES, places))
        return {name: float(error.max()) for name, error in _errors(steps, POINTS, FIT_SEED).items()}

    best = largest(MOST_DIGITS)
    digits = {
        name: next(p for p in range(2, MOST_DIGITS + 1) if largest(p)[name] <= SLACK * best[name]) for name in NAMES
    }
    steps = _steps(counts, digits)
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
        "coefficients": dict.fromkeys(NAMES, sum(counts)),
        "errors": stated,
    }


def front(sizes: tuple[int, ...] = (8, 12, 16, 20, 26)) -> list[dict[str, float]]:
    """Coefficients of each function against its largest error on held-out surfaces."""
    rows = []
    for size in sizes:
        errors = _errors(_steps((size, size), dict.fromkeys(NAMES, MOST_DIGITS)), HELD_OUT, HELD_OUT_SEED)
        rows.append({"coefficients": 2 * size} | {f"error_{name}": float(e.max()) for name, e in errors.items()})
    return rows
