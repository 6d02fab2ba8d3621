"""Slopes at the model's kinks, `ISLAND_KINKS` and `TOTAL_KINKS`, jump by what the model gives.

By one-sided differences of values, and by the library's derivatives on either side; MBMA_GAUNTLET sets how many.
"""

import math

import numpy as np
import pytest
from catalogue import LEVEL, OWN
from helpers import SCALE, difference_weights

from mbma_tables import Surface, contact, island
from mbma_tables.islands.geometry import FIELDS, geometry
from mbma_tables.surfaces.spectrum import band_moment
from mbma_tables.surfaces.variants import VARIANTS
from mbma_tables.totals.island_sum import kinks

EVERY = [*VARIANTS.values(), OWN, LEVEL]
PROMISED = 1e-6  # of derivatives
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
def test_numbers_of_islands(rule):
    """At both kinks and at random approaches, which are moved away from kinks."""
    rng = np.random.default_rng(1)
    hurst, zeta_1, _ = surfaces(rng, 80 * SCALE)
    at_kinks, elsewhere = kinks(hurst, zeta_1, rule), 10 ** rng.uniform(-9, 1.3, hurst.size)
    for kink in at_kinks:
        elsewhere *= np.where(np.abs(kink / elsewhere - 1) < 0.01, 1.05, 1)
    listed = [fields - (set() if rule.offset else {"h_d"}) for fields in ISLAND_KINKS.values()]
    for at, jumps in zip((*at_kinks, elsewhere), (*listed, set()), strict=True):
        for name in FIELDS:
            field = fields_of(name, hurst, zeta_1, rule)
            left, right = one_sided(field, at, 1e-3 * at)
            scale = np.maximum(np.abs(field(at[:, None])[:, 0] / at), 0 if name in jumps else np.abs(left))
            jump = np.abs(right - left) / np.where(scale > 0, scale, 1)
            assert (jump > 1e-4 if name in jumps else jump < 1e-9).all(), (name, jumps)


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
def test_totals_at_the_floors(floor, which, rule):
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
