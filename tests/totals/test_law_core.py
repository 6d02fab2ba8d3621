"""The core's law: the same bits however it is asked, and no gap, force or block that could make it read elsewhere."""

import functools
import math
import sys

import numpy as np
import pytest
import xarray as xr

from mbma_tables import OutOfRangeError, Surface, contact_law
from mbma_tables.core import core
from mbma_tables.law.block import AREA, EXPONENT, FORCE, HEAD, HIGH, MINUS_ROWS, QUANTITIES, RECORDS

SURFACES = {
    "mbma": (Surface(0.8, 0.3, 64.8, 0.7, 2.1), {}),
    "turning": (Surface(0.3, 1.0, 1e4, 0.7, 2.8), {}),
    # two sides of d = 0
    "calibrated": (Surface(0.8, 0.3, 64.8, 0.7, 2.1), {"theory": "calibrated"}),
    # no last contact
    "persson": (Surface(0.8, 0.3, 64.8, 0.7, 2.1), {"theory": "persson"}),
}
NO_GAPS = [math.nan, -math.nan, math.inf, -math.inf, -1e300, -2.9, np.int64(0x7FF4 << 48).view(float).item()]
TINY = [5e-324, -5e-324, 1e-310, 2.2250738585072014e-308, 0.0, -0.0]


@functools.cache
def law_of(name):
    surface, options = SURFACES[name]
    return contact_law(surface, rtol=1e-6, E_star=3.0, **options)


def gaps_of(law, count=3000):
    top = law.h_max if math.isinf(law.highest) else law.highest
    rng = np.random.default_rng(8)
    near = top - (top - law.lowest) * 10 ** rng.uniform(-16, 0, count)
    return np.concatenate([near, rng.uniform(law.lowest, top, count), TINY, [top, math.nextafter(top, 0), law.lowest]])


@pytest.mark.parametrize("name", SURFACES)
def test_the_same_bits_however_asked(name):
    law = law_of(name)
    d = gaps_of(law)
    u, named = (d[d > law.lowest + 1e-9] + law.h_max) / 2, xr.DataArray(d.reshape(-1, 3), dims=("a", "b"))
    for what in QUANTITIES:
        ask, asked = getattr(law, what), law.compiled(what)
        whole = ask(separation=d)
        assert np.isfinite(whole).all()
        for size in (1, 7, 1000, 1001):
            parts = [ask(separation=d[k : k + size]) for k in range(0, d.size, size)]
            np.testing.assert_array_equal(np.concatenate(parts), whole)
        np.testing.assert_array_equal([ask(separation=gap) for gap in d.tolist()], whole)
        np.testing.assert_array_equal([asked.function(gap, asked.user_data) for gap in d.tolist()], whole)
        np.testing.assert_array_equal(ask(separation=d.tolist()), whole)
        np.testing.assert_array_equal(ask(separation=d.reshape(3, -1).T), whole.reshape(3, -1).T)
        np.testing.assert_array_equal(ask(separation=np.tile(d, 12)), np.tile(whole, 12))
        for labelled in (named, named.chunk(500)):
            np.testing.assert_array_equal(ask(separation=labelled), whole.reshape(-1, 3))
        np.testing.assert_array_equal([ask(gap) for gap in u.tolist()], ask(u))
    together = law.values(separation=d)
    np.testing.assert_array_equal(together, [getattr(law, what)(separation=d) for what in together._fields])
    np.testing.assert_array_equal(law.pressure_and_stiffness(separation=d), (together.pressure, together.stiffness))


@pytest.mark.parametrize("name", SURFACES)
def test_inverses_have_the_same_bits_however_asked(name):
    law = law_of(name)
    d = gaps_of(law, 300)
    force = law.pressure(separation=d[d > (law.lowest if law.turning_point is None else law.turning_point)])
    whole = law.at_pressure(force)
    assert [law.at_pressure(value).separation for value in force] == whole.separation.tolist()
    assert [law.at_pressure(value).stiffness for value in force] == whole.stiffness.tolist()
    np.testing.assert_array_equal(law.separation(pressure=force), whole.separation)
    labelled = xr.DataArray(force, dims="a")
    for given in (labelled, labelled.chunk(100)):
        back = law.separation(pressure=given)
        assert (back.dims, back.chunks) == (("a",), given.chunks)
        np.testing.assert_array_equal(back, whole.separation)
    np.testing.assert_array_equal(law.leakage(separation=d), [law.leakage(separation=gap) for gap in d])


def filled(law, d, count=5):
    out = np.full((5, d.size), -7.0)
    bad = core.law_fill(d, law.block, *(out[k] if k < count else None for k in range(5)))
    return bad, out


@pytest.mark.parametrize("name", SURFACES)
def test_gaps_outside_are_nan_and_counted(name):
    law = law_of(name)
    d = np.concatenate([gaps_of(law, 500), NO_GAPS, gaps_of(law, 500), [-math.inf]])
    outside = np.isin(np.arange(d.size), [*range(1009, 1009 + len(NO_GAPS)), d.size - 1])
    bad, out = filled(law, d)
    assert bad == outside.sum()
    assert (np.isnan(out) == outside).all()
    assert (law.leakage(separation=d[~outside]) >= 0).all()
    for gap in NO_GAPS:
        for ask in (law.pressure, law.area, law.stiffness, law.area_slope, law.energy, law.values, law.leakage):
            for given in (gap, np.array([gap]), np.array([1.0, gap]), np.full(2000, gap)):
                with pytest.raises(OutOfRangeError, match=r"^separation must be") as caught:
                    ask(separation=given)
                assert caught.value.mask.sum() == np.size(given) - (np.size(given) == 2)


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("which", [FORCE, AREA])
def test_values_that_no_gap_has_are_nan_and_counted(name, which):
    law = law_of(name)
    inverse = law._inverse_block(QUANTITIES[which])
    most = float((law.pressure, law.area)[which](separation=inverse[5]))
    wanted = np.array([0.5 * most, math.nan, math.inf, -math.inf, -1.0, 1.001 * most, 1e300, 0.1 * most, -5e-324])
    gap, area, stiffness = np.empty((3, wanted.size))
    assert core.law_invert(wanted, law.block, inverse, which, gap, area, stiffness) == 7
    for found in (gap, area, stiffness):
        assert np.isfinite(found).tolist() == [True, *[False] * 6, True, False]
    for bad in (math.nan, [math.inf], np.array([0.1 * most, math.nan])):
        with pytest.raises(OutOfRangeError, match=f"{QUANTITIES[which]} must be finite"):
            law.separation(**{QUANTITIES[which]: bad})
    for tiny in (0.0, 5e-324, 1e-310):
        if math.isinf(law.highest):
            assert law.separation(**{QUANTITIES[which]: tiny}) == law.h_max


def test_broken_blocks_are_refused():
    law = law_of("calibrated")
    out, d = np.empty(1), np.zeros(1)

    def refused(block):
        with pytest.raises(ValueError, match="sizes of the arrays of law_fill do not match"):
            core.law_fill(d, block, out, None, None, None, None)

    for words in (0, 1, HEAD, int(law.block.view(np.int64)[RECORDS]), law.block.size - 1):
        refused(law.block[:words].copy())
    for word, values in {
        RECORDS: (-1, 0, HEAD - 1, HEAD, 1 << 62, -(1 << 63)),
        EXPONENT: (-1, 0, 1022, 1 << 40, -(1 << 63)),
        MINUS_ROWS: (-1, 1 << 40),
        HIGH: (math.inf, math.nan, -1.0, 2.0),
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
    law = law_of("mbma")
    for ask in (law.pressure, law.energy):
        with pytest.raises(TypeError, match="one mean separation is taken, or separation=, got 2 arguments"):
            ask(1.0, 2.0)
        with pytest.raises(TypeError, match="unexpected keyword argument 'v': mean_separation or separation is taken"):
            ask(v=1.0)
        with pytest.raises(TypeError, match="unexpected keyword argument 'mean_separation'"):
            ask(1.0, mean_separation=1.0)


def test_a_law_is_answered_without_leaving_anything():
    law = law_of("mbma")
    d = np.linspace(0, 2, 10)
    law.pressure(separation=d), law.pressure(separation=1.0)
    before = sys.getrefcount(law.block), sys.getrefcount(d)
    for _ in range(100):
        law.pressure(separation=d), law.pressure(separation=1.0), law.area(1.0)
        with pytest.raises(OutOfRangeError):
            law.pressure(separation=np.array([math.nan]))
    assert (sys.getrefcount(law.block), sys.getrefcount(d)) == before
