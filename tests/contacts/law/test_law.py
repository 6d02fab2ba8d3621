"""Contact laws against totals, differences and quadrature; the same bits however asked; what the core refuses."""

import functools
import gc
import itertools
import math
import pickle
import sys
import weakref

import numpy as np
import pytest
import xarray as xr
from helpers import contact_of, difference_weights, law_of_names, refusals, with_slopes
from scipy.integrate import quad

from mbma_tables import (
    ContactLaw,
    ConvergenceError,
    InputError,
    OutOfRangeError,
    Surface,
    contact,
    contact_law,
)
from mbma_tables.contacts.law import block as at
from mbma_tables.core import core
from mbma_tables.islands.variants import NAMED
from mbma_tables.theories import Mbma
from mbma_tables.theories.mbma.models import get_model
from mbma_tables.theories.mbma.profile import profile
from mbma_tables.theories.mbma.sums import Sums, by_table

# hurst, zeta_1, h_max/h_rms, variant
CASES = [
    (0.8, 216.0, 3.0, "reported"),
    (0.3, 1e4, 4.0, "reported"),
    (0.5, 1e4, 3.0, "printed"),
    (1.0, 3.01, 3.3, "reported"),
    (1.0, 1e4, 4.7, "printed"),
    (0.3, 3.01, 2.5, "printed"),
    (0.6, 50.0, 2.5, "reported"),
]
FALLING = CASES[1]


@functools.cache
def surface_of(hurst, zeta_1, top):
    return Surface(hurst, 0.3, 0.3 * zeta_1, 0.7, 0.7 * top)


@functools.cache
def law_of(case, rtol=1e-8):
    return contact_law(surface_of(*case[:3]), rtol=rtol, theory=Mbma(variant=case[3]))


def depths(law, seed, least=1e-9):
    rng = np.random.default_rng(seed)
    many = 10 ** rng.uniform(math.log10(least), math.log10(2), 300)
    return np.concatenate([many, rng.uniform(0, 2, 300), [least, 1.0, 2.0]]) * law.h_max


def pieces_of(law):
    centre = law.records[1:, at.CENTRE]
    half = 1 / law.records[1:, at.RATE]
    return 2 * law.h_max * (centre - half), 2 * law.h_max * (centre + half)


def missed(law, surface, gaps, rtol):
    """Largest relative error of the law's pressure and area."""
    own = {"variant": law.variant, "island_model": law.island_model, "rtol": rtol}
    true = contact_of(surface, separation=np.maximum(gaps, -law.h_max), **own)
    pairs = (
        (law.pressure(separation=true.separation), true.pressure),
        (law.area(separation=true.separation), true.area),
    )
    return max(np.abs(value / known - 1).max() for value, known in pairs)


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("rtol", [1e-4, 1e-8, 1e-9])
def test_within_its_tolerance_and_its_bound(case, rtol):
    law = law_of(case, rtol)
    assert (
        missed(law, surface_of(*case[:3]), law.h_max - depths(law, 50), 1e-11)
        <= min(rtol, law.error) + 1e-11
    )
    assert law.error <= 1.1 * rtol + 1e-9
    assert (law.variant, law.island_model) == (case[3], "universal")


@pytest.mark.parametrize("island_model", ["exact", "rigid", "island4d"])
def test_of_any_island_model(island_model):
    surface = surface_of(*CASES[0][:3])
    law = contact_law(surface, rtol=1e-5, theory=Mbma(island_model=island_model))
    assert (
        missed(
            law, surface, law.h_max * (1 - np.array([1e-5, 0.01, 0.3, 0.9, 1.7])), 1e-8
        )
        <= 1.1e-5
    )
    assert law.island_model == island_model


@pytest.mark.parametrize("case", CASES)
def test_slopes_are_those_of_the_law_itself(case):
    law = law_of(case, 1e-4)
    low, high = pieces_of(law)
    centres = (low + high) / 2
    span = (high - low) / 40
    gaps = law.h_max - centres
    offsets = np.arange(-3.0, 4)
    weights = difference_weights(offsets)
    points = gaps[:, None] + span[:, None] * offsets
    for value, slope in with_slopes(law):
        differences = -(value(separation=points) @ weights) / span
        scale = np.maximum(np.abs(differences), value(separation=gaps) / centres)
        assert (np.abs(slope(separation=gaps) - differences) <= 1e-8 * scale).all()


@pytest.mark.parametrize("case", CASES)
def test_energy_is_the_integral_of_force(case):
    law = law_of(case)
    roots = np.sqrt(np.append(0.0, pieces_of(law)[0]))
    for depth in law.h_max * np.array([1e-6, 1e-3, 0.05, 0.4, 1.0, 1.999]):
        ends = [*roots[roots < math.sqrt(depth)], math.sqrt(depth)]
        # l = x^2; between breaks force is smooth
        force = lambda x: law.pressure(separation=law.h_max - x * x) * 2 * x  # noqa: E731
        parts = [
            quad(force, a, b, epsabs=0, epsrel=1e-11)[0]
            for a, b in itertools.pairwise(ends)
        ]
        gap = law.h_max - depth
        rounded = np.finfo(float).eps * law.h_max / depth
        assert 2 * law.energy(separation=gap) == pytest.approx(
            math.fsum(parts), rel=1e-8 + 10 * rounded, abs=0
        )


@pytest.mark.parametrize(
    ("surface", "variant", "name"),
    [
        (surface_of(*FALLING[:3]), "reported", "pressure"),
        (Surface(0.2, 0.3, 0.3e7, 0.7, 2.1), "printed", "area"),
    ],
    ids=["pressure", "area"],
)
def test_turning_points(surface, variant, name):
    law = contact_law(surface, theory=Mbma(variant=variant))
    value = getattr(law, name)
    turn = law.turning_point if name == "pressure" else law.area_turning_point
    assert -law.h_max < turn < 0
    assert name == "pressure" or turn < law.turning_point
    assert (np.diff(value(separation=np.linspace(law.h_max, turn, 200))) > 0).all()
    assert (
        np.diff(value(separation=np.linspace(turn, turn - 0.1 * law.h_max, 50))) < 0
    ).all()
    near = turn + np.array([-0.02, 0.0, 0.02]) * law.h_max
    totals = getattr(
        contact(surface, separation=near, theory=Mbma(variant=variant, rtol=1e-11)), name
    )
    assert totals[1] > max(totals[0], totals[2])
    peak = float(value(separation=turn))
    wanted = np.array(
        [
            1e-3 * peak,
            0.5 * peak,
            0.999 * peak,
            (1 - 1e-6) * peak,
            value(separation=near[0]),
        ]
    )
    gaps = law.separation(**{name: wanted})
    assert (gaps > turn).all()
    np.testing.assert_allclose(value(separation=gaps), wanted, rtol=1e-10)
    with pytest.raises(
        OutOfRangeError,
        match=f"{name} must be at most {peak:.6g}, at d = {turn:.6g} where the branch",
    ):
        law.separation(**{name: 1.0001 * peak})


@pytest.mark.parametrize("case", CASES)
def test_a_pickle_is_the_same_law_and_small(case):
    law = law_of(case)
    kept = pickle.dumps(law_of(case))
    assert len(kept) < 20_000
    back = pickle.loads(kept)
    gaps = law.h_max - depths(law, 53)
    assert isinstance(back, ContactLaw)
    for name in at.QUANTITIES:
        np.testing.assert_array_equal(
            getattr(back, name)(separation=gaps), getattr(law, name)(separation=gaps)
        )
    force = law.pressure(separation=law.h_max * np.array([0.9, 0.5, 0.1]))
    np.testing.assert_array_equal(
        back.separation(pressure=force), law.separation(pressure=force)
    )
    # its numbers share one type where its arrays have read theirs from the file: the same
    # bytes from then on
    again = pickle.dumps(back)
    assert pickle.dumps(pickle.loads(again)) == again


def test_as_a_function_of_c():
    law = law_of(CASES[0])
    for name in at.QUANTITIES:
        asked = law.compiled(name)
        assert asked.function(law.h_max + 1, asked.user_data) == 0.0
        for outside in (math.nextafter(-law.h_max, -9), math.nan, math.inf, -math.inf):
            assert math.isnan(asked.function(outside, asked.user_data))
    work, _ = quad(law.compiled(), 1.0, law.h_max, epsabs=0)
    assert work == pytest.approx(2 * law.energy(separation=1.0), rel=1e-7, abs=0)
    with pytest.raises(InputError, match="quantity must be one of"):
        law.compiled("force")
    # it keeps its law
    law = contact_law(surface_of(*CASES[0][:3]), theory="mbma", rtol=1e-3)
    gone = weakref.ref(law)
    expected = law.pressure(separation=1.0)
    asked = law.compiled()
    del law
    gc.collect()
    assert asked.function(1.0, asked.user_data) == expected
    del asked
    gc.collect()
    assert gone() is None


@pytest.mark.parametrize(
    ("numbers", "c", "rtol"),
    [
        # narrow Gaussians, cut by full compression
        ((0.3566638412640283, 15570.082637991512, 4.200752427274573), (8.2, 8.4), 1e-5),
        ((0.26366837301283275, 6448.236926881643, 3.711386736093041), (7.3, 7.42), 1e-5),
        # a series whose last two terms are small by chance
        ((0.439123191583504, 6417.32666104977, 5.8716562058171204), (5.7, 5.84), 1e-4),
        # heights of many standard deviations
        ((0.2608903712824928, 5.854429825826772, 23.84250400111467), (0.5, 2.0), 1e-8),
        ((0.5943805915598791, 7.218250172446161, 36.37146982662594), (7.0, 11.0), 1e-10),
        # next to first contact
        (
            (0.24350908204112362, 880518.4043600445, 4.509820485898938),
            (1.8e-11, 1.9e-11),
            1e-5,
        ),
    ],
)
def test_bounds_of_a_profile_where_a_search_found_them_exceeded(numbers, c, rtol):
    surface = Surface(numbers[0], 1.0, numbers[1], 1.0, numbers[2])
    variant = NAMED["fitted"]
    model = get_model("universal", 1e-8, variant)
    c = np.linspace(*c, 40)
    kept = profile(numbers, model, variant, 0.9 * rtol)
    rows = np.empty((3, c.size))
    # force and area by the core's quadrature
    by_table(surface, c, np.arange(c.size), model, Sums(model, variant, 1e-11), rows)
    assert np.abs(kept.totals(c) / rows[:2] - 1).max() <= kept.error


RANDOM = np.random.default_rng(9)
BOUNDS = [
    # between its samples a polynomial errs by more than at them; both are next to their worst
    (0.7981690190189619, 3.6, 3.2804122866615386, 0.1),
    # its first piece begins below the last digit of h_max
    (1.0, 1e8, 7.547388914185743, 1e-8),
    # area bends sharply in depth next to the floor of zeta_u, and few samples of a rough
    # polynomial see it
    (0.6625385170202142, 3.0 + 1.447598e-10, 2.3665629110520765, 0.09618),
    *((RANDOM.uniform(0.3, 1), 3 + 10 ** RANDOM.uniform(-10, -2), RANDOM.uniform(2, 4), 10 ** RANDOM.uniform(-3, -1))
      for _ in range(12)),
]  # fmt: skip


@pytest.mark.parametrize(("hurst", "zeta_1", "top", "rtol"), BOUNDS)
def test_bounds_of_laws_where_they_were_exceeded(hurst, zeta_1, top, rtol):
    surface = Surface(hurst, 1.0, zeta_1, 1.0, top)
    law = contact_law(surface, theory="mbma", rtol=rtol)
    assert (
        missed(
            law,
            surface,
            top - 2 * top * np.append(np.geomspace(1e-9, 1, 2000), 0.5),
            1e-10,
        )
        <= law.error + 1e-10
    )
    assert law.error <= 2 * rtol


@pytest.mark.slow
def test_no_bound_is_exceeded_on_fresh_points_of_300_laws():
    rng = np.random.default_rng(77)
    for _ in range(300):
        top = rng.uniform(2.0, 5.0)
        rtol = 10 ** rng.uniform(-9, -2)
        surface = Surface(
            rng.uniform(0.25, 1.0), 1.0, 3 + 10 ** rng.uniform(-6, 5), 1.0, top
        )
        law = contact_law(
            surface,
            rtol=rtol,
            theory=Mbma(variant=("reported", "printed")[rng.integers(2)]),
        )
        gap = top - 2 * top * np.append(
            10 ** rng.uniform(-6, 0, 40), rng.uniform(0, 1, 40)
        )
        assert missed(law, surface, gap, 1e-10) <= law.error + 1e-10
        for misses in slope_misses(surface, law, gap, law.variant):
            assert (misses <= law.slope_error(separation=gap)).all()


test_bad_laws = refusals(
    lambda asked: law_of_names(
        **({"surface": surface_of(*CASES[0][:3]), "theory": "mbma"} | asked)
    ),
    (
        {"surface": Surface([0.5, 0.8], 0.2, 40.0, 1.0, 3.0)},
        r"one surface, got a batch of shape \(2,\)",
    ),
    (
        {"surface": Surface(xr.DataArray([0.7, 0.8], dims="s"), 0.3, 30.0, 0.7, 2.1)},
        "one surface, got a batch",
    ),
    *(({"rtol": rtol}, "rtol") for rtol in (0.0, 1e-10, 0.2, math.nan, "tight", [1e-8])),
    *(
        ({"E_star": modulus}, "E_star")
        for modulus in (0.0, -1.0, math.inf, math.nan, [1.0, 2.0])
    ),
    ({"island_model": "magic"}, "island_model"),
    ({"variant": "guessed"}, "variant"),
)


def test_laws_that_end_early_and_of_too_many_pieces(monkeypatch):
    assert -3 < contact_law(Surface(0.05, 0.2, 0.2e8, 1.0, 3.0), theory="mbma").lowest < 3
    surface = surface_of(*CASES[0][:3])
    labelled = Surface(
        xr.DataArray(0.8), surface.q0, surface.q1, surface.h_rms, surface.h_max
    )
    assert contact_law(labelled, theory="mbma").pressure(separation=1.0) == law_of(
        CASES[0]
    ).pressure(separation=1.0)
    monkeypatch.setattr(at, "MAX_RECORDS", 3)
    with pytest.raises(ConvergenceError, match="more than 3 pieces") as caught:
        contact_law(surface, theory="mbma")
    assert caught.value.mask


@pytest.mark.parametrize("rtol", [1e-4, 1e-7, 1e-9])
def test_slopes_are_within_their_bound(rtol):
    rng = np.random.default_rng(11)
    for _ in range(8):
        top = rng.uniform(2.5, 4.5)
        surface = Surface(rng.uniform(0.3, 1), 1.0, 10 ** rng.uniform(0.7, 5), 1.0, top)
        law = contact_law(surface, theory="mbma", rtol=rtol)
        # next to the ends of pieces, where slopes are worst, next to first contact, and between
        ends = pieces_of(law)[0]
        tiny = 10.0 ** np.arange(-15, -3)
        depth = np.concatenate(
            [
                ends * (1 - 1e-7),
                ends * (1 + 1e-7),
                tiny,
                top * 10 ** rng.uniform(-6, 0, 80),
            ]
        )
        gap = top - np.append(depth, rng.uniform(0, 2 * top, 40))
        # there the logarithm's slope is exact, and what is left is the error of the value itself
        assert law.slope_error(separation=top - tiny).max() < max(10 * rtol, 1e-7)
        for misses in slope_misses(surface, law, gap):
            assert (misses <= law.slope_error(separation=gap)).all()
    assert law.slope_error(separation=top) == 0.0
    with pytest.raises(OutOfRangeError):
        law.slope_error(separation=-1.1 * top)


def rising_but_for(dip):
    """A law's one polynomial between x = 1/2 and 1 whose slope is that of `dip`, a polynomial in t."""
    record = np.zeros((1, at.RECORD))
    integral = dip.integ()
    record[0, [at.CENTRE, at.RATE]] = 0.75, 4.0
    record[0, at.FORCE_AT : at.FORCE_AT + integral.coef.size] = integral.coef
    return record


@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize("place", np.linspace(-0.97, 0.99, 30))
@pytest.mark.parametrize("width", [0.3, 1e-3, 1e-5])
def test_a_narrow_dip_is_a_turning_point(place, width, sign):
    t = np.polynomial.Polynomial([-place, 1.0])
    dip = (t**2 - width**2) * (1 + 0.3 * t**4)
    assert dip.degree() < at.DEGREE
    x, _ = at.first_falls(rising_but_for(-sign * dip), np.array([float(sign)]))[0]
    # compression goes from t = s to t = -s
    expected = max(place - width, -1.0) if sign < 0 else min(place + width, 1.0)
    assert 4 * (x - 0.75) == pytest.approx(expected, abs=1e-9)
    above = rising_but_for(-sign * (dip + 2 * width**2))
    assert at.first_falls(above, np.array([float(sign)]))[0][0] is None


def slope_misses(surface, law, gap, variant="reported"):
    """Errors of the law's slopes over F/l and A/l, against derivatives of totals."""
    truth = Mbma(variant=variant, rtol=1e-11).totals(surface, gap, slopes=True)
    for slope, true, value in (
        (law.stiffness(separation=gap) / 2, truth.pressure_slope, truth.pressure),
        (law.area_slope(separation=gap), truth.area_slope, truth.area),
    ):
        yield np.abs(slope + true) / (value / (law.h_max - gap))


def test_inverses_stay_within_the_law():
    # where Newton's method goes to and fro
    law = contact_law(surface_of(0.3, 4.477099447990553, 4.7), theory="mbma", rtol=1e-9)
    wanted = law.area(separation=np.linspace(-law.h_max, law.h_max, 4002)[1:-1])
    np.testing.assert_allclose(
        law.area(separation=law.separation(area=wanted)), wanted, rtol=1e-12
    )
    rng = np.random.default_rng(4)
    for _ in range(12):
        h_rms = 10 ** rng.uniform(-9, 3)
        surface = Surface(
            rng.uniform(0.5, 1),
            1 / h_rms,
            10 ** rng.uniform(0.6, 5) / h_rms,
            h_rms,
            3.1 * h_rms,
        )
        law = contact_law(surface, 10 ** rng.uniform(-5, 12), theory="mbma", rtol=1e-4)
        for name in ("pressure", "area"):
            value = getattr(law, name)
            end = law.turning_point if name == "pressure" else law.area_turning_point
            top = float(value(separation=-law.h_max if end is None else end))
            wanted = top * np.append(1 - np.arange(40) * 1e-16, [1e-200, 1e-100])
            gaps = law.separation(**{name: np.append(wanted[wanted <= top], 5e-324)})
            assert (gaps >= -law.h_max).all()
            assert gaps[-1] == law.h_max


@pytest.mark.parametrize("name", ["pressure", "area"])
def test_the_ends_of_the_branch(name):
    law = law_of(CASES[0])
    most = getattr(law, name)(separation=-law.h_max)
    assert law.separation(**{name: most}) == pytest.approx(-law.h_max, rel=1e-12, abs=0)
    with pytest.raises(
        OutOfRangeError,
        match=f"at most {most:.6g}, at d = {-law.h_max:.6g} where the bran",
    ) as caught:
        law.separation(**{name: [0.5 * most, 1.001 * most]})
    assert caught.value.mask.tolist() == [False, True]
    with pytest.raises(OutOfRangeError, match=f"{name} must be at least 0"):
        law.separation(**{name: -1e-9})
    for given in ({}, {"pressure": 1e-6, "area": 1e-6}):
        with pytest.raises(InputError, match="give exactly one of"):
            law.separation(**given)
    # of the smallest numbers one unit in the last place of h_max carries more
    assert (
        law.separation(**{name: [[0.0, 5e-324], [1e-300, 1e-60]]}).tolist()
        == [[law.h_max] * 2] * 2
    )
    with pytest.raises(OutOfRangeError, match="so high that force or area underflow"):
        contact_law(
            Surface(1.0, 1.0, 100.0, 1.0, 60.0),
            rtol=1e-3,
            theory=Mbma(island_model="rigid"),
        )


SURFACES = {
    "mbma": (Surface(0.8, 0.3, 64.8, 0.7, 2.1), "mbma"),
    "turning": (Surface(0.3, 1.0, 1e4, 0.7, 2.8), "mbma"),
    "calibrated": (Surface(0.8, 0.3, 64.8, 0.7, 2.1), "calibrated"),  # two sides of d = 0
    "persson": (Surface(0.8, 0.3, 64.8, 0.7, 2.1), "persson"),  # no last contact
}
NO_GAPS = [
    math.nan,
    -math.nan,
    math.inf,
    -math.inf,
    -1e300,
    -2.9,
    np.int64(0x7FF4 << 48).view(float).item(),
]
TINY = [5e-324, -5e-324, 1e-310, 2.2250738585072014e-308, 0.0, -0.0]


@functools.cache
def core_law_of(name):
    surface, theory = SURFACES[name]
    return contact_law(surface, 3.0, theory, rtol=1e-6)


def gaps_of(law, count=3000):
    top = law.h_max if math.isinf(law.highest) else law.highest
    rng = np.random.default_rng(8)
    near = top - (top - law.lowest) * 10 ** rng.uniform(-16, 0, count)
    return np.concatenate(
        [
            near,
            rng.uniform(law.lowest, top, count),
            TINY,
            [top, math.nextafter(top, 0), law.lowest],
        ]
    )


@pytest.mark.parametrize("name", SURFACES)
def test_the_same_bits_however_asked(name):
    law = core_law_of(name)
    d = gaps_of(law)
    u = (d[d > law.lowest + 1e-9] + law.h_max) / 2
    named = xr.DataArray(d.reshape(-1, 3), dims=("a", "b"))
    for what in at.QUANTITIES:
        ask = getattr(law, what)
        asked = law.compiled(what)
        whole = ask(separation=d)
        assert np.isfinite(whole).all()
        for size in (1, 7, 1000, 1001):
            parts = [ask(separation=d[k : k + size]) for k in range(0, d.size, size)]
            np.testing.assert_array_equal(np.concatenate(parts), whole)
        ones = [
            (ask(separation=gap), asked.function(gap, asked.user_data))
            for gap in d.tolist()
        ]
        np.testing.assert_array_equal(np.transpose(ones), [whole, whole])
        np.testing.assert_array_equal(ask(separation=d.tolist()), whole)
        np.testing.assert_array_equal(
            ask(separation=d.reshape(3, -1).T), whole.reshape(3, -1).T
        )
        np.testing.assert_array_equal(ask(separation=np.tile(d, 12)), np.tile(whole, 12))
        for labelled in (named, named.chunk(500)):
            np.testing.assert_array_equal(ask(separation=labelled), whole.reshape(-1, 3))
        np.testing.assert_array_equal([ask(gap) for gap in u.tolist()], ask(u))
    together = law.values(separation=d)
    np.testing.assert_array_equal(
        together, [getattr(law, what)(separation=d) for what in together._fields]
    )
    np.testing.assert_array_equal(
        law.pressure_and_stiffness(separation=d), (together.pressure, together.stiffness)
    )


@pytest.mark.parametrize("name", SURFACES)
def test_inverses_have_the_same_bits_however_asked(name):
    law = core_law_of(name)
    d = gaps_of(law, 300)
    force = law.pressure(
        separation=d[d > (law.lowest if law.turning_point is None else law.turning_point)]
    )
    whole = law.at_pressure(force)
    assert [
        law.at_pressure(value).separation for value in force
    ] == whole.separation.tolist()
    assert [
        law.at_pressure(value).stiffness for value in force
    ] == whole.stiffness.tolist()
    np.testing.assert_array_equal(law.separation(pressure=force), whole.separation)
    labelled = xr.DataArray(force, dims="a")
    for given in (labelled, labelled.chunk(100)):
        back = law.separation(pressure=given)
        assert (back.dims, back.chunks) == (("a",), given.chunks)
        np.testing.assert_array_equal(back, whole.separation)
    np.testing.assert_array_equal(
        law.leakage(separation=d), [law.leakage(separation=gap) for gap in d]
    )


@pytest.mark.parametrize("name", SURFACES)
def test_gaps_outside_are_nan_and_counted(name):
    law = core_law_of(name)
    d = np.concatenate([gaps_of(law, 500), NO_GAPS, gaps_of(law, 500), [-math.inf]])
    outside = np.isin(np.arange(d.size), [*range(1009, 1009 + len(NO_GAPS)), d.size - 1])
    out = np.full((5, d.size), -7.0)
    assert core.law_fill(d, law.block, *out) == outside.sum()
    assert (np.isnan(out) == outside).all()
    assert (law.leakage(separation=d[~outside]) >= 0).all()
    for gap in NO_GAPS:
        for ask in (
            law.pressure,
            law.area,
            law.stiffness,
            law.area_slope,
            law.energy,
            law.values,
            law.leakage,
        ):
            for given in (gap, np.array([gap]), np.array([1.0, gap]), np.full(2000, gap)):
                with pytest.raises(
                    OutOfRangeError, match=r"^separation must be"
                ) as caught:
                    ask(separation=given)
                assert caught.value.mask.sum() == np.size(given) - (np.size(given) == 2)


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("which", [at.FORCE, at.AREA])
def test_values_that_no_gap_has_are_nan_and_counted(name, which):
    law = core_law_of(name)
    inverse = law._inverse_block(at.QUANTITIES[which])
    most = float((law.pressure, law.area)[which](separation=inverse[5]))
    wanted = np.array(
        [
            0.5 * most,
            math.nan,
            math.inf,
            -math.inf,
            -1.0,
            1.001 * most,
            1e300,
            0.1 * most,
            -5e-324,
        ]
    )
    gap, area, stiffness = np.empty((3, wanted.size))
    assert core.law_invert(wanted, law.block, inverse, which, gap, area, stiffness) == 7
    for found in (gap, area, stiffness):
        assert np.isfinite(found).tolist() == [True, *[False] * 6, True, False]
    for bad in (math.nan, [math.inf], np.array([0.1 * most, math.nan])):
        with pytest.raises(
            OutOfRangeError, match=f"{at.QUANTITIES[which]} must be finite"
        ):
            law.separation(**{at.QUANTITIES[which]: bad})
    for tiny in (0.0, 5e-324, 1e-310):
        if math.isinf(law.highest):
            assert law.separation(**{at.QUANTITIES[which]: tiny}) == law.h_max


def test_broken_blocks_are_refused():
    law = core_law_of("calibrated")
    out = np.empty(1)
    d = np.zeros(1)

    def refused(block):
        with pytest.raises(
            ValueError,
            match="sizes of the arrays of law_fill, or numbers of items in them, do not match",
        ):
            core.law_fill(d, block, out, None, None, None, None)

    for words in (
        0,
        1,
        at.HEAD,
        int(law.block.view(np.int64)[at.RECORDS]),
        law.block.size - 1,
    ):
        refused(law.block[:words].copy())
    for word, values in {
        at.RECORDS: (-1, 0, at.HEAD - 1, at.HEAD, 1 << 62, -(1 << 63)),
        at.EXPONENT: (-1, 0, 1022, 1 << 40, -(1 << 63)),
        at.MINUS_ROWS: (-1, 1 << 40),
        at.HIGH: (math.inf, math.nan, -1.0, 2.0),
    }.items():
        for value in values:
            block = law.block.copy()
            (block.view(np.int64) if isinstance(value, int) else block)[word] = value
            refused(block)
    with pytest.raises(ValueError, match="do not match"):
        core.law_fill(d, law.block, np.empty(2), None, None, None, None)
    with pytest.raises(TypeError, match="an array of 'd' was expected"):
        core.law_fill(d.astype(np.float32), law.block, out, None, None, None, None)


def test_questions_that_are_none():
    law = core_law_of("mbma")
    for ask in (law.pressure, law.energy):
        with pytest.raises(
            TypeError,
            match="one mean separation is taken, or separation=, got 2 arguments",
        ):
            ask(1.0, 2.0)
        with pytest.raises(
            TypeError,
            match="unexpected keyword argument 'v': mean_separation, separation, pressure",
        ):
            ask(v=1.0)
        with pytest.raises(
            TypeError, match="unexpected keyword argument 'mean_separation'"
        ):
            ask(1.0, mean_separation=1.0)


def test_a_law_is_answered_without_leaving_anything():
    law = core_law_of("mbma")
    d = np.linspace(0, 2, 10)
    law.pressure(separation=d), law.pressure(separation=1.0)
    before = sys.getrefcount(law.block), sys.getrefcount(d)
    for _ in range(100):
        law.pressure(separation=d), law.pressure(separation=1.0), law.area(1.0)
        with pytest.raises(OutOfRangeError):
            law.pressure(separation=np.array([math.nan]))
    assert (sys.getrefcount(law.block), sys.getrefcount(d)) == before


@pytest.mark.parametrize("theory", ["mbma", "calibrated", "persson"])
@pytest.mark.parametrize("pressures", [None, ("1 kPa", "0.5 MPa")])
def test_a_law_continued_by_its_tangents(theory, pressures):
    law = contact_law(Surface.named("concrete"), "13.3 MPa", theory=theory)
    trial = law.continued(pressures)
    inner = np.linspace(trial.heavy, trial.light, 50)
    np.testing.assert_array_equal(trial.pressure(inner), law.pressure(inner))
    np.testing.assert_array_equal(trial.stiffness(inner), law.stiffness(inner))
    assert trial.inside(inner).all()
    for end, side in ((trial.light, 1.0), (trial.heavy, -1.0)):
        beyond = end + side * np.array([1e-9, 0.1, 1e3])
        found, slope = trial.pressure_and_stiffness(beyond)
        assert (slope == law.stiffness(end)).all()
        np.testing.assert_allclose(
            found, law.pressure(end) - law.stiffness(end) * (beyond - end), rtol=1e-13
        )
        assert not trial.inside(beyond).any()
    # Newton's method from first contact, and from far beyond full compression
    for u in (law.h_max, -5.0):
        for _ in range(60):
            p, k = trial.pressure_and_stiffness(u)
            u += (p - 0.1) / k
        assert law.pressure(u) == pytest.approx(0.1, rel=1e-12)
    if pressures:
        assert law.pressure([trial.light, trial.heavy]) == pytest.approx([1e-3, 0.5])


def test_a_law_is_not_continued_beyond_pressures_that_do_not_rise():
    law = contact_law(Surface.named("concrete"), "13.3 MPa", theory="calibrated")
    for pressures in (("2 kPa", "1 kPa"), (0.0, 0.1), "12", (1, 2, 3)):
        with pytest.raises(InputError, match="two rising numbers"):
            law.continued(pressures)
    with pytest.raises(InputError, match="must be finite"):
        law.continued().pressure(np.nan)
