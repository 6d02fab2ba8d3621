"""The compiled core's quintic splines over surfaces, the calibrated law's table and the flow through its gaps."""

import importlib
import math

import mpmath
import numpy as np
import pytest
from scipy.interpolate import NdBSpline
from scipy.special import erf

from mbma_tables import ConvergenceError, InputError
from mbma_tables.contacts.quantities import leakage
from mbma_tables.contacts.quantities.leakage import shipped_flow
from mbma_tables.core import GENERATIONS, core
from mbma_tables.theories.calibrated.formulas import (
    CONSTANTS,
    LAW_ERROR,
    PERSSON,
    YANG_PERSSON,
    Spectrum,
    SpectrumLaw,
)
from mbma_tables.theories.calibrated.table import shipped

PLAIN = importlib.import_module("mbma_tables.core._plain")
FUSED = [importlib.import_module(f"mbma_tables.core._{name}") for name, least in GENERATIONS.items()
         if name != "plain" and PLAIN.generation >= least]  # fmt: skip
CORES = [PLAIN, *FUSED]
TABLE = shipped()
FLOW = shipped_flow()
BAD = [math.nan, math.inf, -math.inf, 5e-324, -5e-324, 1e308, -1e308, 0.0, -0.0, -1.0]


def batch(n, seed=0, top=12.0):
    """Surfaces inside the table, with some on its edges, and gaps from full compression to beyond last contact."""
    rng = np.random.default_rng(seed)
    (h0, h1), (z0, z1) = TABLE.covered[:2]
    rows = rng.uniform((h0, z0, 2), (h1, z1, top), (n, 3)).T.copy()
    rows[:2, :2] = [[h0, h1], [z0, z1]]
    u = rows[2] * np.where(
        rng.random(n) < 0.5, rng.uniform(0, 1.02, n), 10.0 ** rng.uniform(-12, 0, n)
    )
    return rows, u


def fill(rows, owner, u, used=core, pieces=None):
    ends = np.empty((rows.shape[1], 2))
    out = np.empty((3, u.size))
    used.calibrated_ends(*TABLE.core_table, *rows, None, None, ends)
    given = *TABLE.core_table, *rows, ends, pieces
    bad = used.calibrated_contact(*given, owner, u, *out)
    assert bad == np.isnan(out[0]).sum()
    return out


def separations(rows, owner, force, used=core, pieces=None):
    ends = np.empty((rows.shape[1], 2))
    out = np.empty(force.size)
    used.calibrated_ends(*TABLE.core_table, *rows, None, None, ends)
    bad = used.calibrated_separation(
        *TABLE.core_table, *rows, ends, pieces, owner, force, out
    )
    assert bad == np.isnan(out).sum()
    return out


def flow(rows, owner, u, area, pieces=None):
    return leakage._flow(
        (*FLOW.core_table, *rows[:2], None, None, pieces), owner, u, area
    )


def pieces_of(table, rows, used=core):
    out = np.empty((rows.shape[1], int(table.cells[2]), 6))
    used.spline_pieces(*table.core_table, *rows[:2], None, None, None, out)
    return out


@pytest.mark.parametrize("used", CORES)
def test_erf_within_1e_15(used):
    x = np.concatenate([np.geomspace(1e-300, 1e-3, 200), np.linspace(1e-3, 6.5, 3001)])
    found = np.empty(x.size)
    used.elementary(4, x, found)
    with mpmath.workdps(40):
        exact = np.array([mpmath.erf(mpmath.mpf(value)) for value in x.tolist()])
        assert max(abs(found / exact - 1)) < 1e-15
    mirrored = np.empty(x.size)
    used.elementary(4, -x, mirrored)
    np.testing.assert_array_equal(mirrored, -found)


class TestSpline:
    def test_is_the_tensor_spline_of_scipy(self):
        rows, _ = batch(300, seed=2)
        x = np.random.default_rng(3).uniform(TABLE.first[2], TABLE.last, 300)
        knots = tuple(first + step * np.arange(-5, cells + 6) for first, step, cells
                      in zip(TABLE.first, TABLE.step, TABLE.cells, strict=True))  # fmt: skip
        expected = NdBSpline(knots, TABLE.coefficients.astype(float), 5)(
            np.stack([*rows[:2], x], axis=1)
        )
        place = (x - TABLE.first[2]) / TABLE.step[2]
        cell = place.astype(int)
        six = pieces_of(TABLE, rows)[np.arange(300), cell]
        found = [
            np.polynomial.polynomial.polyval(z, c)
            for z, c in zip(place - cell, six, strict=True)
        ]
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)

    def test_surfaces_outside_have_no_pieces(self):
        rows = np.array([[0.05, 0.8, 0.8, math.nan], [4.0, 0.1, 4.0, 4.0]])
        out = np.empty((4, int(TABLE.cells[2]), 6))
        assert core.spline_pieces(*TABLE.core_table, *rows, None, None, None, out) == 3
        assert np.isnan(out).all(axis=(1, 2)).tolist() == [True, True, False, True]


class TestBits:
    def test_alone_in_a_batch_and_with_pieces(self):
        rows, u = batch(400)
        everyone = np.arange(400)
        out = fill(rows, everyone, u)
        force = np.where(out[0] > 0, np.minimum(out[0], 1e3), 1e-3)
        gaps = separations(rows, everyone, force)
        area = np.random.default_rng(1).uniform(0, 0.5, 400)
        k = flow(rows, everyone, u, area)
        mixed = np.random.default_rng(2).permutation(np.tile(everyone, 3))
        pieces = pieces_of(TABLE, rows)
        own = pieces_of(FLOW, rows)
        for made, made_flow in ((None, None), (pieces, own)):
            np.testing.assert_array_equal(
                fill(rows, mixed, u[mixed], pieces=made), out[:, mixed]
            )
            np.testing.assert_array_equal(
                separations(rows, mixed, force[mixed], pieces=made), gaps[mixed]
            )
            np.testing.assert_array_equal(
                flow(rows, mixed, u[mixed], area[mixed], pieces=made_flow), k[mixed]
            )
        for n in range(0, 400, 7):
            one = np.ascontiguousarray(rows[:, n : n + 1])
            first = np.zeros(1, np.int64)
            np.testing.assert_array_equal(fill(one, first, u[n : n + 1])[:, 0], out[:, n])
            np.testing.assert_array_equal(
                separations(one, first, force[n : n + 1])[0], gaps[n]
            )
            np.testing.assert_array_equal(
                flow(one, first, u[n : n + 1], area[n : n + 1])[0], k[n]
            )


@pytest.mark.parametrize("used", CORES)
class TestAnyInput:
    def test_of_gaps_forces_and_areas(self, used):
        rows, _ = batch(4)
        x = np.array(BAD)
        for pieces in (None, pieces_of(TABLE, rows, used)):
            out = fill(rows, np.zeros(x.size, np.int64), x, used, pieces)
            assert np.isnan(out[:, 0]).all()
            np.testing.assert_array_equal(out[:, [1, 5]], 0.0)
            full = x <= 0
            assert np.isinf(out[0, full]).all()
            np.testing.assert_array_equal(out[1, full], 1.0)
            # as at the least separation that counts
            np.testing.assert_array_equal(
                out[:2, 3],
                fill(rows, np.zeros(1, np.int64), np.array([1e-300]), used)[:2, 0],
            )
            u = separations(rows, np.zeros(x.size, np.int64), x, used, pieces)
            assert np.isfinite(u).tolist() == (x == 5e-324).tolist()
            assert u[3] == pytest.approx(rows[2, 0], rel=1e-12)
        for pieces in (None, pieces_of(FLOW, rows, used)):
            for area in BAD:
                k = flow(
                    rows, np.zeros(x.size, np.int64), x, np.full(x.size, area), pieces
                )
                assert np.isnan(k).tolist() == (np.isnan(x) | np.isnan(area)).tolist()
                assert area < 0.4 or not np.nan_to_num(k).any()

    def test_of_surfaces_and_owners(self, used):
        rows, u = batch(len(BAD) * 3, seed=4)
        for row in range(3):
            rows[row, row * len(BAD) : (row + 1) * len(BAD)] = BAD
        everyone = np.arange(u.size)
        out = fill(rows, everyone, np.full(u.size, 0.5), used)
        inside = TABLE.covers(*rows[:2]) & (rows[2] >= 1e-300)
        assert np.isfinite(out).all(axis=0).tolist() == inside.tolist()
        assert inside.sum() == 2  # h_max of infinity and 1e308
        assert (
            np.isfinite(separations(rows, everyone, np.full(u.size, 1e-3), used)).tolist()
            == inside.tolist()
        )
        k = flow(rows, everyone, np.full(u.size, 0.5), np.full(u.size, 0.1))
        assert np.isfinite(k).tolist() == FLOW.covers(*rows[:2]).tolist()
        rows, _ = batch(3)
        wrong = np.array([-1, 3, 2**62, -(2**62), 1])
        for pieces in (None, pieces_of(TABLE, rows, used)):
            found = (
                *fill(rows, wrong, np.full(5, 0.5), used, pieces),
                separations(rows, wrong, np.full(5, 0.1), used, pieces),
            )
            assert (np.isfinite(found) == [*[False] * 4, True]).all()
        nobody = np.empty((3, 0))
        half = np.full(5, 0.5)
        for ask in (fill, separations):
            with pytest.raises(ValueError, match="sizes"):
                ask(nobody, wrong, half, used)
        with pytest.raises(ValueError, match="sizes"):
            flow(nobody, wrong, half, half)


@pytest.mark.parametrize(
    ("hurst", "log_zeta_1"),
    [(0.1, 1.1), (0.37, 5.0), (1.0, 11.5), (1e-9, 2.0), (1 - 1e-12, 3.0)],
)
def test_moments_of_self_affine_surfaces(hurst, log_zeta_1):
    alpha = np.empty(1)
    gradient = np.empty(1)
    assert (
        core.self_affine(np.array([hurst]), np.array([log_zeta_1]), alpha, gradient) == 0
    )
    with mpmath.workdps(40):
        m0, m2, m4 = (mpmath.quad(lambda t, k=k: mpmath.exp((2 * k - 2 * mpmath.mpf(hurst)) * t), [0, log_zeta_1])
                      for k in range(3))  # fmt: skip
        assert alpha[0] == pytest.approx(float(1.5 * m0 * m4 / m2**2), rel=4e-15)
        assert gradient[0] == pytest.approx(float(mpmath.sqrt(m2 / m0)), rel=2e-15)
    assert alpha[0] == pytest.approx(
        Spectrum.self_affine(hurst, math.exp(log_zeta_1)).alpha, rel=1e-13
    )
    for bad in BAD:
        given = np.array([bad, 0.5]), np.array([1.0, bad])
        out = np.empty((2, 2))
        assert (
            core.self_affine(*given, *out)
            == np.isnan(out[0]).sum()
            == np.isnan(out[1]).sum()
            >= 1
        )


SELF_AFFINE = [(0.8, 64.0), (0.3, 4.0), (0.1, 1e5), (1.0, 1e6), (0.5, 3.1), (0.02, 1e8)]
ODD = [math.nan, math.inf, -math.inf, -1.0, 0.0, -0.0, 5e-324, 1e-310, 1e308, 1e200]
FINE = [*np.arange(1, 4) / 4, *0.5 ** np.arange(3, 20, 2)]
NODE, WEIGHT = np.polynomial.legendre.leggauss(20)


def gauss(low, high):
    """Nodes and weights between the ends of panels, in a last axis."""
    half = (np.asarray(high) - low)[..., None] / 2
    return np.asarray(low)[..., None] + half * (1 + NODE), half * WEIGHT


def inner(y, weights):
    """I(y) exp(2 y^2): over v = 2 (y'^2 - y^2); a logarithm of small y."""
    light = np.log(np.maximum(1e-6 / y, 1))
    y = np.maximum(y, 1e-6)
    v, d_v = gauss(
        *(np.append(0.0, np.geomspace(1e-16, 45, 50))[k : k + 50] for k in (0, 1))
    )
    v = v.ravel()
    d_v = d_v.ravel()
    square = y[..., None] ** 2 + v / 2
    P = erf(np.sqrt(2 * square))
    slope = weights[0] + 3 * weights[1] * P**2 + 16 * weights[2] * P**15
    return ((slope * np.exp(-v) / (4 * square)) @ d_v + weights[0] * light) * math.sqrt(
        8 / math.pi
    )


def log_separation(q, C, force, law):
    """ln u + 2 F^2 of power laws between samples, by panels graded towards both ends."""
    log_q = np.log(q / q[0])
    last = log_q[-1]
    first = min(log_q[-1], 1.0)
    graded = (
        np.append(0.0, first * np.exp(np.arange(-60, 0.5, 1.0))),
        last - first * 0.5 ** np.arange(13),
    )
    fine = [log_q[:-1] + np.diff(log_q) * part for part in FINE]
    edges = np.unique(
        np.concatenate([log_q, *graded, *fine, np.arange(first, last, 0.5)])
    )
    root, d_root = gauss(np.sqrt(edges[:-1]), np.sqrt(edges[1:]))
    t = root**2
    d_t = 2 * root * d_root

    def content(order, x):
        return np.exp(np.interp(x, log_q, np.log(C)) + (order + 2) * x)

    inside, weight = gauss(np.broadcast_to(edges[:-1, None], t.shape), t)
    before = np.append(0, np.cumsum((content(2, t) * d_t).sum(axis=1)))
    m0 = (content(0, t) * d_t).sum()
    m2 = before[-1]
    below = (before[:-1, None] + (content(2, inside) * weight).sum(axis=2)) / m2
    share = (
        np.exp(t) * content(0, t) * d_t / m0 / (4 * math.sqrt(m2 / m0) * np.sqrt(below))
    )
    found = []
    for load in force:
        seen = load**2 * (1 / below - 1) < 40
        part = inner(load / np.sqrt(below[seen]), law.coefficients) * np.exp(
            -2 * load**2 * (1 / below[seen] - 1)
        )
        found.append(math.log(part @ share[seen]))
    return np.array(found)


def self_affine(hurst, zeta_1):
    return np.array([1.0, zeta_1]), np.array([1.0, zeta_1 ** (-2 - 2 * hurst)])


class TestCurve:
    @pytest.mark.parametrize(("hurst", "zeta_1"), SELF_AFFINE)
    def test_of_self_affine_surfaces(self, hurst, zeta_1):
        number = SELF_AFFINE.index((hurst, zeta_1))
        law = SpectrumLaw(
            Spectrum.self_affine(hurst, zeta_1),
            None,
            [CONSTANTS, YANG_PERSSON, PERSSON][number % 3],
        )
        log_force = np.concatenate(
            [np.linspace(-50, 2.8, 9), np.random.default_rng(number).uniform(-2, 1, 5)]
        )
        found, slope = law.separation_persson(np.exp(log_force))
        expected = log_separation(
            *self_affine(hurst, zeta_1), np.exp(log_force), law
        ) - 2 * np.exp(2 * log_force)
        np.testing.assert_allclose(np.log(found), expected, rtol=0, atol=1e-11)
        step = 1e-4
        ends = [
            np.log(law.separation_persson(np.exp(log_force + k * step))[0])
            for k in (-2, -1, 1, 2)
        ]
        rate = (ends[0] - ends[3] + 8 * (ends[2] - ends[1])) / (12 * step)
        np.testing.assert_allclose(slope / found, rate, rtol=1e-7)

    @pytest.mark.parametrize(
        ("samples", "scatter"), [(2, 0.0), (20, 0.2), (40, 2.0), (80, 0.2)]
    )
    def test_of_scattered_spectra(self, samples, scatter):
        random = np.random.default_rng(samples)
        q = np.sort(np.exp(random.uniform(0, 6, samples)))
        C = np.minimum(1, q**-3.5) * np.exp(random.normal(0, scatter, samples))
        law = SpectrumLaw(Spectrum.from_samples(q, C))
        force = np.array([1e-9, 0.03, 1.5])
        found = np.log(law.separation_persson(force)[0]) + 2 * force**2
        np.testing.assert_allclose(
            found, log_separation(q, C, force, law), rtol=0, atol=LAW_ERROR / 30
        )

    @pytest.mark.parametrize("h_max", [None, 0.5, 3.2, 30.0, 1e300])
    def test_separation_is_the_inverse_of_force(self, h_max):
        law = SpectrumLaw(Spectrum.self_affine(0.7, 100.0), h_max)
        u = np.append(10.0 ** np.linspace(-280, -1, 60), np.linspace(0.11, 12, 50))
        u = u[u < 0.999 * (h_max or np.inf)]
        force, area, stiffness = law.contact(u)
        assert np.all(np.diff(force) < 0)
        assert np.all(np.diff(area) <= 0)
        np.testing.assert_allclose(law.separation(force), u, rtol=1e-10)
        np.testing.assert_allclose(area, law.area(force), rtol=1e-14)
        some = u > 1e-3
        ends = [law.force(u[some] * (1 + k * 1e-4)) for k in (-2, -1, 1, 2)]
        rate = (ends[0] - ends[3] + 8 * (ends[2] - ends[1])) / (12e-4 * u[some])
        np.testing.assert_allclose(stiffness[some], -rate, rtol=1e-8)

    def test_ends(self):
        law = SpectrumLaw(Spectrum.self_affine(0.7, 100.0), 3.0)
        assert [row.tolist() for row in law.contact([0.0, 3.0, 4.0])] == [
            [np.inf, 0, 0],
            [1, 0, 0],
            [np.inf, 0, 0],
        ]
        assert law.separation([1e-300, 20.0, 1e300]) == pytest.approx(
            [3.0, 0.0, 0.0], rel=1e-15, abs=0
        )
        # as sharp as what is left of Gaussian tails: the slope of a surface without end
        assert law.contact(3 - 1e-9)[0] == pytest.approx(
            1e-9 * law.contact(3 - 1e-9)[2], rel=1e-6
        )


@pytest.mark.parametrize("used", CORES)
class TestAnyInputOfSpectra:
    def test_of_forces_and_separations(self, used):
        x = np.array(ODD)
        for h_max in (None, 3.0):
            law = SpectrumLaw(Spectrum.self_affine(0.8, 64.0), h_max)._prepared
            u, slope, back = np.empty((3, x.size))
            assert (
                used.spectrum_law_separation(law, x, 0, u, slope)
                == np.isnan(u).sum()
                == np.isnan(slope).sum()
            )
            assert np.isfinite(u).tolist() == (x > 0).tolist()
            assert u[[1, 8, 9]].tolist() == [0, 0, 0]
            assert (
                used.spectrum_law_separation(law, x, 1, back, slope)
                == np.isnan(back).sum()
                == 5
            )
            out = np.empty((3, x.size))
            assert used.spectrum_law_contact(law, x, *out) == np.isnan(out[0]).sum()
            np.testing.assert_array_equal(out[:, [1, 8, 9]], 0.0)
            assert np.isinf(out[0]).tolist() == (x <= 0).tolist()


def test_what_is_no_spectrum_is_refused():
    with pytest.raises(InputError, match="no spectrum"):
        Spectrum.from_samples(np.array([1.0, 2.0]), np.array([1.0, 0.0]))
    good = Spectrum.self_affine(0.8, 64.0)
    with pytest.raises(InputError, match="rising"):
        SpectrumLaw(
            Spectrum(
                good.x, good.variance, good.below[::-1].copy(), good.gradient, good.alpha
            )
        ).force(1.0)
    # less than nothing is left by this weight
    with pytest.raises(ConvergenceError, match="no curve"):
        SpectrumLaw(good, None, CONSTANTS.__class__(weight=-5.0)).force(1.0)


CASES = {
    "exp": np.concatenate([np.linspace(-700, 700, 2001), np.linspace(-1, 1, 501)]),
    "expm1": np.concatenate(
        [
            np.linspace(-700, 700, 2001),
            np.linspace(-2, 2, 1001),
            np.geomspace(1e-300, 1, 300),
        ]
    ),
    "log": np.concatenate(
        [
            np.geomspace(2.3e-308, 1e308, 2001),
            np.linspace(0.5, 2, 1001),
            1 + np.geomspace(1e-15, 1),
        ]
    ),
    "log1p": np.concatenate(
        [
            np.geomspace(1e-300, 1e300, 2001),
            np.linspace(-0.999, 3, 1001),
            -np.geomspace(1e-300, 0.9),
        ]
    ),
}


def of_core(name, x):
    values = np.asarray(x, float)
    out = np.empty_like(values)
    core.elementary(list(CASES).index(name), values, out)
    return out


@pytest.mark.parametrize("name", CASES)
def test_within_1e_15(name):
    exact = getattr(mpmath, name)
    with mpmath.workdps(50):
        for x, found in zip(
            CASES[name].tolist(), of_core(name, CASES[name]).tolist(), strict=True
        ):
            right = exact(mpmath.mpf(x))
            assert abs(found - right) <= 1e-15 * abs(right), x


def test_exponentials_beyond_their_range_are_those_at_its_end():
    low, least, high, most, none = of_core("exp", [-1e300, -700.0, 1e300, 700.0, np.nan])
    assert low == least > 0
    assert high == most < np.inf
    # NaN is not passed on: an index that is made from it stays inside
    assert none == least
    assert of_core("expm1", [-1e300]) == -1
