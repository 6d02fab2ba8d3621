"""Slopes jump where the model's own do, by what the model says, and nowhere else.

The model's kinks are `ISLAND_KINKS` and `TOTAL_KINKS`. Slopes are found by one-sided differences of values, and by the
derivatives that the library gives just either side. MBMA_GAUNTLET sets how many places are looked at.
"""

import math

import numpy as np
import pytest
from catalogue import LEVEL, OWN
from helpers import SCALE, difference_weights, with_slopes

from generate.tables.island4d import from_axes
from mbma_tables import Surface, contact, contact_law, island
from mbma_tables.islands.four_numbers import to_axes
from mbma_tables.islands.geometry import FIELDS, geometry
from mbma_tables.law.block import CENTRE, RATE
from mbma_tables.models.island4d import RAW
from mbma_tables.models.tables import open_table, universal_model
from mbma_tables.surfaces.spectrum import band_moment
from mbma_tables.surfaces.variants import REPORTED, VARIANTS
from mbma_tables.totals.island_sum import kinks

EVERY = [*VARIANTS.values(), OWN, LEVEL]
PROMISED = 1e-6  # of derivatives
STEP = 1e-9
INPUTS = ("hurst", "q0", "q1", "h_rms", "h_max", "separation")

# numbers of an island, as functions of its approach, whose slope jumps where zeta_d or zeta_u reaches its floor
ISLAND_KINKS = {
    "zeta_d": {"zeta_d", "R_d", "D", "sigma", "h_d", "X", "mu", "D_d", "sigma_d", "width"},
    "zeta_u": {"zeta_u", "R_u", "D", "sigma", "h_u", "eta", "X", "mu", "width"},
}
# totals whose slope jumps, in every input but E*, where the gap lets in islands at the floor: there K1 switches
TOTAL_KINKS = {"zeta_d": {"pressure", "area"}, "zeta_u": set()}

# slope at 0 from values at 0, 1, 2 ... steps on one side
OFFSETS = np.arange(6.0)
WEIGHTS = difference_weights(OFFSETS)

NARROW = 2.5  # in h_rms: above the floor of zeta_d, intervals up to it take the smaller rule (totals.c)


def surfaces(rng, count):
    return rng.uniform(0.3, 0.98, count), 10 ** rng.uniform(0.6, 4, count), rng.uniform(2.5, 4.5, count)


def one_sided(function, at, step):
    """Slopes of `function` of (places, 6) on the left and on the right of `at`."""
    return [
        np.asarray(function(at[:, None] + side * step[:, None] * OFFSETS)) @ WEIGHTS / (side * step) for side in (-1, 1)
    ]


def fields_of(name, hurst, zeta_1, rule):
    """One of `FIELDS` as a function of the approach."""
    return lambda approach: geometry(
        approach, *(np.broadcast_to(a[:, None], approach.shape).copy() for a in (hurst, zeta_1)), rule
    )[name]


@pytest.mark.parametrize("rule", EVERY, ids=lambda rule: rule.name)
def test_numbers_of_islands(rule, record_property):
    count = 40 * SCALE
    rng = np.random.default_rng(1)
    hurst, zeta_1, _ = surfaces(rng, count)
    for which, at in zip(ISLAND_KINKS, kinks(hurst, zeta_1, rule), strict=True):
        listed = ISLAND_KINKS[which] - ({"h_d"} if not rule.offset else set())
        for name in FIELDS:
            left, right = one_sided(fields_of(name, hurst, zeta_1, rule), at, 1e-3 * at)
            scale = np.abs(fields_of(name, hurst, zeta_1, rule)(at[:, None])[:, 0] / at)
            jump = np.abs(right - left) / np.where(scale > 0, scale, 1)
            if name in listed:
                assert (jump > 1e-4).all(), (which, name)
            else:
                assert (jump < 1e-9).all(), (which, name)
    record_property("pairs compared", 2 * count)


@pytest.mark.parametrize("rule", EVERY, ids=lambda rule: rule.name)
def test_numbers_of_islands_elsewhere(rule, record_property):
    count = 100 * SCALE
    rng = np.random.default_rng(2)
    hurst, zeta_1, _ = surfaces(rng, count)
    at = 10 ** rng.uniform(-9, 1.3, count)
    clear = np.all([np.abs(kink / at - 1) > 0.01 for kink in kinks(hurst, zeta_1, rule)], axis=0)
    hurst, zeta_1, at = hurst[clear], zeta_1[clear], at[clear]
    for name in FIELDS:
        left, right = one_sided(fields_of(name, hurst, zeta_1, rule), at, 1e-3 * at)
        value = fields_of(name, hurst, zeta_1, rule)(at[:, None])[:, 0]
        assert (np.abs(right - left) <= 1e-9 * np.maximum(np.abs(value / at), np.abs(left))).all(), name
    record_property("pairs compared", at.size)


def changed(numbers, which, value):
    """Numbers as columns, with one of them replaced by rows of values."""
    own = {name: np.broadcast_to(given[:, None], value.shape) for name, given in numbers.items()}
    return own | {which: value}


def totals_of(numbers, rule, **options):
    surface = Surface(*(numbers[name] for name in INPUTS[:-1]))
    return contact(surface, separation=numbers["separation"], variant=rule, **options)


def beyond_the_kink(numbers, rule):
    """(h_max - d)/h_rms less the approach at which zeta_d reaches its floor."""
    kink = kinks(numbers["hurst"], numbers["q1"] / numbers["q0"], rule)[0]
    return (numbers["h_max"] - numbers["separation"]) / numbers["h_rms"] - kink


def step_of_K1(hurst, zeta_1, rule):
    """By how much K1 of (47), or what (46) gives, rises where zeta_d reaches its floor."""
    share = 4 / 3 * rule.beta
    if rule.jacobian == "printed":
        return np.full(hurst.size, share)
    return share / np.sqrt(1 - zeta_1 ** (-2 * hurst)) if rule.offset else np.zeros(hurst.size)


def models_jump(numbers, name, rule):
    """Jump of dF/d(reach) or dA/d(reach) at the kink: the step of K1 times the islands at the upper limit (44, 48)."""
    hurst, zeta_1, h_rms = numbers["hurst"], numbers["q1"] / numbers["q0"], numbers["h_rms"]
    surface = Surface(*(numbers[key] for key in INPUTS[:-1]))
    found = island(surface, kinks(hurst, zeta_1, rule)[0] * h_rms, variant=rule)
    m0, m2, m4 = (band_moment(order, hurst, 1.0, rule.floor_d) for order in (0, 2, 4))
    density = m4 / m2 / rule.density_divisor * numbers["q0"] ** 2
    sigma = surface.s * np.sqrt(m0 - (0.8968 * m2**2 / m4 if rule.summit_sigma else 0))
    height = numbers["h_max"] - (found.h_d if rule.offset else 0)
    weight = density * np.exp(-0.5 * (height / sigma) ** 2) / (math.sqrt(2 * math.pi) * sigma)
    return step_of_K1(hurst, zeta_1, rule) * weight * getattr(found, {"pressure": "force"}.get(name, name)) * h_rms


def at_a_kink(rng, count, rule, which):
    """Numbers of surfaces pressed until islands at one of the floors just touch; the first half are `plain`."""
    hurst, zeta_1, h_max = surfaces(rng, count)
    # pressed to the floor of zeta_u, rougher ones leave the table
    hurst = np.maximum(hurst, 0.45)
    plain = slice(count // 2)
    # low tops leave many islands at the floor, and few magnifications let zeta_1 move it
    h_max[plain] = rng.uniform(1, 1.5, count // 2)
    hurst[plain], zeta_1[plain] = rng.uniform(0.6, 0.98, count // 2), 10 ** rng.uniform(0.6, 1.2, count // 2)
    at = dict(zip(ISLAND_KINKS, kinks(hurst, zeta_1, rule), strict=True))[which]
    # it must be reached before full compression
    h_max = np.maximum(h_max, 0.52 * at)
    heights = np.full(count, 0.3)
    numbers = {"hurst": hurst, "q0": np.full(count, 0.7), "q1": 0.7 * zeta_1, "h_rms": heights}
    return numbers | {"h_max": 0.3 * h_max, "separation": 0.3 * (h_max - at)}


@pytest.mark.parametrize("rule", EVERY, ids=lambda rule: rule.name)
@pytest.mark.parametrize("which", INPUTS)
@pytest.mark.parametrize("floor", list(TOTAL_KINKS))
def test_totals_at_the_floors(floor, which, rule, record_property):
    count = 8 * SCALE
    numbers = at_a_kink(np.random.default_rng([4, INPUTS.index(which)]), count, rule, floor)
    # the depth is what matters of heights, and of zeta_1 its logarithm
    step = 2e-3 * (numbers["h_max"] - numbers["separation"] if which in INPUTS[4:] else numbers[which])
    ends = [changed(numbers, which, (numbers[which] + sign * 1e-6 * step)[:, None]) for sign in (-1, 1)]
    turn = np.squeeze(np.subtract(*(beyond_the_kink(end, rule) for end in ends[::-1])), axis=1) / (2e-6 * step)
    by = [totals_of(end, rule, rtol=1e-10, derivatives=True) for end in ends]
    for name in ("pressure", "area"):

        def value(p, name=name):
            return getattr(totals_of(changed(numbers, which, p), rule, rtol=1e-11), name)

        left, right = one_sided(value, numbers[which], step)
        lower, upper = (getattr(found, f"{name}_by")[which][:, 0] for found in by)
        scale = np.maximum(np.abs(left), np.abs(value(numbers[which][:, None])[:, 0] / numbers[which]))
        model = models_jump(numbers, name, rule) * np.abs(turn) if name in TOTAL_KINKS[floor] else np.zeros(count)
        assert np.any(model) == (floor == "zeta_d" and rule is not LEVEL)
        if np.any(model):
            assert np.median((model / scale)[: count // 2]) > 20 * PROMISED
        assert (np.abs(right - left - model) <= PROMISED * scale).all(), name
        assert (np.abs(upper - lower - model) <= PROMISED * scale).all(), name
    record_property("pairs compared", count)


@pytest.mark.parametrize("rule", VARIANTS.values(), ids=lambda rule: rule.name)
@pytest.mark.parametrize("which", INPUTS)
def test_totals_elsewhere(which, rule, record_property):
    """Given derivatives just either side of random places, and of where the code switches."""
    count = 60 * SCALE
    rng = np.random.default_rng([5, INPUTS.index(which)])
    hurst, zeta_1, h_max = surfaces(rng, count)
    hurst[::4] = 1 - 0.01 / 2
    kink_d, kink_u = kinks(hurst, zeta_1, rule)
    reach = rng.uniform(1e-4, 2, count) * h_max
    reach[1::4], reach[2::4], reach[3::4] = (kink_d + NARROW)[1::4], (kink_u + NARROW)[2::4], (0.01 * reach)[3::4]
    reach = np.minimum(reach, 1.99 * h_max)
    clear = np.abs(reach / kink_d - 1) > 1e-3
    numbers = {"hurst": hurst, "q0": np.full(count, 0.7), "q1": 0.7 * zeta_1, "h_rms": np.full(count, 0.3)}
    numbers |= {"h_max": 0.3 * h_max, "separation": 0.3 * (h_max - reach)}
    steps = STEP * (numbers["h_max"] - numbers["separation"] if which in INPUTS[4:] else numbers[which])
    sides = [numbers | {which: numbers[which] + sign * steps} for sign in (-1, 1)]
    found = [totals_of(side, rule, rtol=1e-10, derivatives=True) for side in sides]
    for name in ("pressure", "area"):
        lower, upper = (getattr(side, f"{name}_by")[which] for side in found)
        scale = np.maximum(np.abs(lower), np.abs(getattr(found[0], name) / numbers[which]))
        assert (np.abs(upper - lower) <= PROMISED * scale)[clear].all(), name
    record_property("pairs compared", int(clear.sum()))


def test_the_universal_table(record_property):
    """At the edges of its cells."""
    model, rng, count = universal_model(), np.random.default_rng(6), 300 * SCALE
    X_low, mu_low = (model.content.auxiliary[name][1] for name in ("X_low", "mu_low"))
    X, mu = rng.uniform(-6.2, 40.9, count), 10 ** rng.uniform(-12, 6, count)
    X[1::3] = rng.choice(X_low[X_low > X_low[0]], X[1::3].size)
    mu[2::3] = rng.choice(mu_low[mu_low > 0], mu[2::3].size)
    for in_X, in_mu in ((STEP, 0), (0, STEP)):
        sides = [model.slopes(X * (1 + sign * in_X), mu * (1 + sign * in_mu)) for sign in (-1, 1)]
        for place, measure in ((1, 1.0), (2, mu)):
            for name in ("phi_F", "phi_A"):
                lower, upper = (getattr(side[place], name) * measure for side in sides)
                scale = np.maximum(np.abs(lower), np.abs(getattr(sides[0][0], name)))
                assert (np.abs(upper - lower) <= PROMISED * scale).all()
    record_property("pairs compared", 2 * count)


@pytest.mark.parametrize("which", RAW)
def test_the_four_parameter_table_at_its_nodes(which, record_property):
    count, model = 60 * SCALE, open_table("island4d")
    rng = np.random.default_rng([8, RAW.index(which)])
    X_axis, spread_axis, sphere_axis, hurst_axis = model.content.axes
    hurst = rng.choice(hurst_axis.values[1:-1], count)
    zeta_d = from_axes(rng.choice(sphere_axis.values[1:-1], count), hurst)
    spread = rng.choice(spread_axis.values[(spread_axis.values > 1e-3) & (spread_axis.values < 2400)], count)
    sigma = to_axes(np.ones(count), zeta_d, zeta_d * (1 + spread), hurst, REPORTED).sigma
    X = rng.choice(X_axis.values[1:-1], count)
    raw = dict(zip(RAW, ((X * sigma + 1) * zeta_d**-hurst, zeta_d, zeta_d * (1 + spread), hurst), strict=True))
    sides = [model.lookup(**(raw | {which: raw[which] * (1 + sign * STEP)}), derivatives=True) for sign in (-1, 1)]
    for hat, by in (("F_hat", "F_by"), ("A_hat", "A_by")):
        lower, upper = (getattr(side, by)[which] * raw[which] for side in sides)
        own = STEP / np.minimum(spread, sigma)
        assert (
            np.abs(upper - lower) <= (PROMISED + 100 * own) * np.maximum(np.abs(lower), getattr(sides[0], hat))
        ).all()
    record_property("pairs compared", count)


@pytest.mark.parametrize("rtol", [1e-5, 1e-9])
def test_laws_at_their_breaks(rtol, record_property):
    """Polynomials of two pieces meet with slopes as far apart as their errors let them be, but for the model's jump."""
    rng, compared = np.random.default_rng(9), 0
    for _ in range(4 * SCALE):
        rule = list(VARIANTS.values())[rng.integers(2)]
        hurst, zeta_1, h_max = (float(numbers[0]) for numbers in surfaces(rng, 1))
        law = contact_law(Surface(hurst, 1.0, zeta_1, 1.0, h_max), rtol=rtol, variant=rule)
        depth = 2 * h_max * (law.records[1:, CENTRE] - 1 / law.records[1:, RATE])
        clear = np.abs(depth / kinks(hurst, zeta_1, rule)[0] - 1) > 1e-9
        gaps = law.h_max - depth
        room = law.slope_error(separation=gaps + STEP * depth) + law.slope_error(separation=gaps - STEP * depth)
        for value, slope in with_slopes(law):
            larger, smaller = (slope(separation=gaps + sign * STEP * depth) for sign in (1, -1))
            # what the slope itself changes by over two steps
            further = [slope(separation=gaps + sign * 1e-4 * depth) for sign in (1, -1)]
            own = 4e4 * STEP * np.abs(np.array(further) - [larger, smaller]).max(axis=0)
            assert (np.abs(smaller - larger) <= room * value(separation=gaps) / depth + own)[clear].all()
        compared += int(clear.sum())
    record_property("pairs compared", compared)
