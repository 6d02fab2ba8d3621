"""No jumps of values; slopes jump where those of the model do, by what the model gives.

Pairs a relative 1e-9 apart may differ by the slope between the two, and by the errors
stated. At the model's kinks one-sided differences are compared. MBMA_GAUNTLET sets how many
pairs.
"""

import math

import numpy as np
import pytest
from catalogue import LEVEL, OWN
from helpers import SCALE, difference_weights, with_slopes

from mbma_tables import Surface, contact_law, greenwood_tripp
from mbma_tables.contacts.law.block import CENTRE, RATE
from mbma_tables.core import core
from mbma_tables.islands.geometry import kinks
from mbma_tables.islands.greenwood_tripp import height_integral
from mbma_tables.islands.variants import VARIANTS, get_variant
from mbma_tables.tables.open import universal_model
from mbma_tables.theories import Mbma

STEP = 1e-9
FAR = 1e-5
EPS = np.finfo(float).eps
INPUTS = ("hurst", "q0", "q1", "h_rms", "h_max", "separation")
SOLVER_RTOL = 1e-10
PROMISED = 1e-6  # of derivatives
# in h_rms: above the floor of zeta_d, intervals up to it take the smaller rule (totals.c)
NARROW = 2.5


def surfaces(rng, count):
    hurst = rng.uniform(0.1, 1, count)
    # where differences of powers go over to expm1, and the end of the range
    hurst[::10], hurst[5::10] = 1 - 0.01 / 2, 1 - STEP / 2
    return hurst, 10 ** rng.uniform(0.5, 6, count), rng.uniform(2.5, 4.5, count)


def reaches(rng, hurst, zeta_1, h_max, rule):
    """(h_max - d)/h_rms: at random, next to first contact, and where segments appear or change their rule."""
    kink_d, kink_u = kinks(hurst, zeta_1, rule)
    reach = rng.uniform(1e-6, 2, hurst.size) * h_max
    reach[1::6] = 10 ** rng.uniform(-6, 0, reach[1::6].size)
    for start, switch in (
        (2, kink_d),
        (3, kink_u),
        (4, kink_d + NARROW),
        (5, kink_u + NARROW),
    ):
        reach[start::6] = switch[start::6]
    return np.minimum(reach, 2 * h_max * (1 - 10 * FAR))


def pressed(rng, count, rule):
    """Numbers of surfaces and gaps, in any unit of length."""
    hurst, zeta_1, h_max = surfaces(rng, count)
    reach = reaches(rng, hurst, zeta_1, h_max, rule)
    lengths = 10 ** rng.uniform(-9, 3, count)
    heights = 0.01 * lengths
    return {
        "hurst": hurst,
        "q0": 1 / lengths,
        "q1": zeta_1 / lengths,
        "h_rms": heights,
        "h_max": heights * h_max,
        "separation": heights * (h_max - reach),
    }


def moved_by(numbers, which, share):
    """The numbers with one of them changed by a share of itself; h_max and the gap by a share of the depth."""
    size = (
        numbers["h_max"] - numbers["separation"]
        if which in ("h_max", "separation")
        else numbers[which]
    )
    own = numbers | {which: numbers[which] + share * size}
    return own | {"hurst": np.minimum(own["hurst"], 1)}


def totals_of(numbers, slopes=False, **options):
    surface = Surface(*(numbers[name] for name in INPUTS[:-1]))
    return Mbma(**options).totals(surface, numbers["separation"], slopes=slopes)


def apart(a, b, moved):
    """How far two answers are apart beyond what the slope between them moves them, relative."""
    return np.abs(np.log(b / a) - moved)


@pytest.mark.parametrize("variant", sorted(VARIANTS))
@pytest.mark.parametrize("which", INPUTS)
@pytest.mark.parametrize(
    ("island_model", "rtol", "count"),
    [("universal", 1e-8, 240), ("universal", 1e-10, 240), ("exact", 1e-9, 6)],
)
def test_totals_do_not_jump(variant, which, island_model, rtol, count):
    count *= SCALE
    rng = np.random.default_rng(
        [
            5,
            sorted(VARIANTS).index(variant),
            INPUTS.index(which),
            round(-math.log10(rtol)),
        ]
    )
    numbers = pressed(rng, count, get_variant(variant))
    below, above = (moved_by(numbers, which, sign * STEP / 2) for sign in (-1, 1))
    options = {"variant": variant, "outside": "nan"}
    # slopes by the numbers on both sides, and by the separation at the pair
    far = [
        totals_of(moved_by(numbers, which, sign * FAR), rtol=1e-10, **options)
        for sign in (-1, 1)
    ]
    near = [
        totals_of(side, rtol=1e-10, slopes=True, **options) for side in (below, above)
    ]
    one, other = (
        totals_of(side, island_model=island_model, rtol=rtol, **options)
        for side in (below, above)
    )
    some = np.isfinite([found.pressure for found in (*far, *near)]).all(axis=0)
    assert some.mean() > 0.6
    reach = (numbers["h_max"] - numbers["separation"]) / numbers["h_rms"]
    rounded = 8 * EPS * numbers["h_max"] / numbers["h_rms"] / reach
    # where K1 switches slopes jump: test_sensitivity.py
    switch = kinks(numbers["hurst"], numbers["q1"] / numbers["q0"], get_variant(variant))[
        0
    ]
    clear = some & (np.abs(reach / switch - 1) > 1e-3)
    for name in ("pressure", "area"):
        lower, upper = (getattr(found, f"{name}_slope") for found in near)
        scale = np.maximum(
            np.abs(lower), np.abs(getattr(near[0], name) / (reach * numbers["h_rms"]))
        )
        assert (np.abs(upper - lower) <= PROMISED * scale)[clear].all(), name
        ends, sides = ([getattr(found, name) for found in pair] for pair in (far, near))
        low, high = STEP / FAR * np.log([sides[0] / ends[0], ends[1] / sides[1]])
        off = apart(getattr(one, name), getattr(other, name), (low + high) / 2)
        assert (off <= one.error + other.error + np.abs(high - low) + rounded)[some].all()


def level_changes(rng, count, rtol):
    """X and mu where the solver goes over to more nodes: by X in the first half, by mu in the other."""
    digits = -math.log10(rtol)
    X = rng.uniform(-5, 38, count)
    mu = 10 ** rng.uniform(-12, 6, count)
    level = rng.choice(greenwood_tripp.LEVELS[greenwood_tripp.LEVELS < 100], count)
    softness = 1 + np.log10(np.maximum(mu, 1)) / 12
    by_X = (level / (digits * softness)) ** 2 - 5
    by_mu = 10 ** (12 * (level / (digits * np.sqrt(np.maximum(X, 0) + 5)) - 1))
    half = np.arange(count) < count // 2
    X[half], mu[~half] = by_X[half], by_mu[~half]
    kept = (
        (np.where(half, 0, -5) < X) & (X < 40) & (mu > np.where(half, 0, 1)) & (mu < 1e6)
    )
    return X[kept], mu[kept], half[kept]


def two_numbers(rng, count):
    """X and mu at random, at edges of the table's cells, where the height integrals change their piece, and at 1."""
    X_axis = universal_model().content.axes[0]
    X = rng.uniform(X_axis.low + 1e-3, X_axis.high - 1e-3, count)
    mu = 10 ** rng.uniform(-12, 6, count)
    edges = universal_model().content.auxiliary
    X[1::6] = rng.choice(np.setdiff1d(edges["X_low"][1], [0.0, X_axis.low]), X[1::6].size)
    mu[2::6] = rng.choice(edges["mu_low"][1][edges["mu_low"][1] > 0], mu[2::6].size)
    X[3::6] = rng.choice([-4.0, -1.0, 2.0, 4.0, 6.0, 8.0], X[3::6].size)
    mu[4::6] = 1e-8
    mu[5::6] = 1.0
    return X, mu


def islands_apart(answer, X, mu, which, room=1e-4):
    """Whether a model's answers at pairs in X or mu are apart by no more than slopes and errors say."""
    shares = [
        (1 + sign * STEP / 2 * np.array([which == "X", which == "mu"]))
        for sign in (-1, 1)
    ]
    one, other = (answer(X * in_X, mu * in_mu) for in_X, in_mu in shares)
    at = X if which == "X" else mu
    ends = [
        universal_model().answer(*((p, mu) if which == "X" else (X, p)))
        for p in (at * (1 - FAR), at * (1 + FAR))
    ]
    for name in ("phi_F", "phi_A"):
        moved = STEP / (2 * FAR) * np.log(getattr(ends[1], name) / getattr(ends[0], name))
        a = getattr(one, name)
        b = getattr(other, name)
        assert (
            apart(a, b, moved) <= one.error + other.error + room * np.abs(moved)
        ).all(), name
    return one, other


@pytest.mark.parametrize("which", ["X", "mu"])
def test_the_universal_table_does_not_jump(which):
    X, mu = two_numbers(np.random.default_rng(7), 1500 * SCALE)
    islands_apart(universal_model().answer, X, mu, which)


@pytest.mark.parametrize("which", ["X", "mu"])
def test_the_solver_does_not_jump(which):
    rng = np.random.default_rng(10)
    X, mu = two_numbers(rng, 300 * SCALE)

    def answer(X, mu):
        return greenwood_tripp.solve(X, mu, rtol=SOLVER_RTOL)

    islands_apart(answer, X, mu, which)
    at_X, at_mu, by_X = level_changes(rng, 1200 * SCALE, SOLVER_RTOL)
    chosen = by_X if which == "X" else ~by_X
    one, other = islands_apart(answer, at_X[chosen], at_mu[chosen], which)
    # the pairs are where they should be; an estimate that is not met sends both sides on
    assert np.mean(one.nodes < other.nodes) > 0.5


def test_the_solver_joins_the_rigid_sphere():
    X = np.random.default_rng(11).uniform(-20, 38, 200 * SCALE)
    squared = np.empty(X.size)
    assert core.island_extents(X, np.zeros(X.size), 0.03 * SOLVER_RTOL, squared) == 0
    # NEGLIGIBLE of newton.c
    edge = 1e-17 / (height_integral(0.5, -X) * (1 + squared))
    one, other = (
        greenwood_tripp.solve(X, edge * (1 + sign * STEP), rtol=SOLVER_RTOL)
        for sign in (-1, 1)
    )
    assert (one.iterations == 0).all()
    assert (other.iterations > 0).all()
    assert (apart(one.phi_F, other.phi_F, 2 * STEP) <= one.error + other.error).all()
    assert (apart(one.phi_A, other.phi_A, 0) <= one.error + other.error).all()


@pytest.mark.parametrize("side", ["X low", "X high", "mu high"])
def test_the_solver_takes_over_from_the_universal_table(side):
    count = 60 * SCALE
    rng = np.random.default_rng(13)
    axes = dict(zip(("X", "mu"), universal_model().content.axes, strict=True))
    numbers = {"X": rng.uniform(-5, 40, count), "mu": 10 ** rng.uniform(-10, 6, count)}
    which, end = side.split()
    at = getattr(axes[which], end)
    inside, outside = (
        numbers | {which: np.full(count, at - sign * STEP * abs(at))} for sign in (1, -1)
    )
    if end == "low":
        inside, outside = outside, inside
    one, other = (
        universal_model().answer(**n, outside="exact") for n in (inside, outside)
    )
    further = inside | {
        which: inside[which] + FAR / STEP * (inside[which] - outside[which])
    }
    beside = universal_model().answer(**further)
    for name in ("phi_F", "phi_A"):
        moved = STEP / FAR * np.log(getattr(one, name) / getattr(beside, name))
        assert (
            apart(getattr(one, name), getattr(other, name), moved)
            <= one.error + other.error + 1e-13
        ).all()


@pytest.mark.parametrize("rtol", [1e-4, 1e-9])
def test_laws_do_not_jump_at_their_breaks(rtol):
    rng = np.random.default_rng(16)
    for _ in range(4 * SCALE):
        variant = sorted(VARIANTS)[rng.integers(2)]
        surface = Surface(
            rng.uniform(0.3, 1),
            1.0,
            10 ** rng.uniform(0.6, 4),
            1.0,
            rng.uniform(2.5, 4.5),
        )
        law = contact_law(surface, rtol=rtol, theory=Mbma(variant=variant))
        depth = 2 * law.h_max * (law.records[1:, CENTRE] - 1 / law.records[1:, RATE])
        clear = (
            np.abs(
                depth / kinks(surface.hurst, surface.zeta_1, get_variant(variant))[0] - 1
            )
            > 1e-9
        )
        sides = [law.h_max - depth * (1 - sign * STEP) for sign in (1, -1)]
        room = law.slope_error(separation=sides[0]) + law.slope_error(separation=sides[1])
        for value, slope in with_slopes(law):
            a, b = (value(separation=side) for side in sides)
            larger, smaller = (slope(separation=side) for side in sides)
            own = 2 * np.maximum(larger, smaller) * np.abs(sides[1] - sides[0]) / a
            assert (np.abs(b / a - 1) <= 2 * law.error + own).all()
            # what the slope itself changes by over two steps
            further = [
                slope(separation=law.h_max - depth * (1 - sign * 1e-4))
                for sign in (1, -1)
            ]
            bend = (
                4e4 * STEP * np.abs(np.subtract(further, [larger, smaller])).max(axis=0)
            )
            assert (np.abs(smaller - larger) <= room * a / depth + bend)[clear].all()


EVERY = [*VARIANTS.values(), OWN, LEVEL]


# slope at 0 from values at 0, 1, 2 ... steps on one side
OFFSETS = np.arange(6.0)
WEIGHTS = difference_weights(OFFSETS)


def smooth_surfaces(rng, count):
    return (
        rng.uniform(0.3, 0.98, count),
        10 ** rng.uniform(0.6, 4, count),
        rng.uniform(2.5, 4.5, count),
    )


def one_sided(function, at, step):
    """Slopes of `function` of (places, 6) on the left and on the right of `at`."""
    return [
        np.asarray(function(at[:, None] + side * step[:, None] * OFFSETS))
        @ WEIGHTS
        / (side * step)
        for side in (-1, 1)
    ]


def changed(numbers, which, value):
    own = {
        name: np.broadcast_to(given[:, None], value.shape)
        for name, given in numbers.items()
    }
    return own | {which: value}


@pytest.mark.parametrize("rule", EVERY, ids=lambda rule: rule.name)
@pytest.mark.parametrize("which", INPUTS)
def test_totals_do_not_bend_at_the_floor_of_zeta_u(which, rule):
    """At that of zeta_d K1 switches; both sides of it are compared with differences in test_sensitivity.py."""
    count = 8 * SCALE
    rng = np.random.default_rng([4, INPUTS.index(which)])
    hurst, zeta_1, h_max = smooth_surfaces(rng, count)
    # pressed to this floor, rougher ones leave the table
    hurst = np.maximum(hurst, 0.45)
    at = kinks(hurst, zeta_1, rule)[1]
    # it must be reached before full compression
    h_max = np.maximum(h_max, 0.52 * at)
    heights = np.full(count, 0.3)
    numbers = {
        "hurst": hurst,
        "q0": np.full(count, 0.7),
        "q1": 0.7 * zeta_1,
        "h_rms": heights,
    }
    numbers |= {"h_max": 0.3 * h_max, "separation": 0.3 * (h_max - at)}
    # the depth is what matters of heights, and of zeta_1 its logarithm
    step = 2e-3 * (
        numbers["h_max"] - numbers["separation"]
        if which in INPUTS[4:]
        else numbers[which]
    )
    ends = [
        changed(numbers, which, (numbers[which] + sign * 1e-6 * step)[:, None])
        for sign in (-1, 1)
    ]
    by = [totals_of(end, slopes=True, variant=rule, rtol=1e-10) for end in ends]
    for name in ("pressure", "area"):

        def value(p, name=name):
            return getattr(
                totals_of(changed(numbers, which, p), variant=rule, rtol=1e-11), name
            )

        left, right = one_sided(value, numbers[which], step)
        lower, upper = (getattr(found, f"{name}_slope")[:, 0] for found in by)
        scale = np.maximum(
            np.abs(left), np.abs(value(numbers[which][:, None])[:, 0] / numbers[which])
        )
        assert (np.abs(right - left) <= PROMISED * scale).all(), name
        assert (np.abs(upper - lower) <= PROMISED * np.abs(upper)).all(), name
