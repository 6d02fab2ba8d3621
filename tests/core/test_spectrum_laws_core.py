"""The compiled core's laws of spectra: against quadrature by numpy and mpmath, and on any input."""

import importlib
import math

import numpy as np
import pytest
from scipy.special import erf

from mbma_tables import ConvergenceError, InputError, Surface
from mbma_tables.core import GENERATIONS, core
from mbma_tables.laws.calibrated import CONSTANTS, LAW_ERROR, PERSSON, YANG_PERSSON, Law, Spectrum

PLAIN = importlib.import_module("mbma_tables.core._plain")
FUSED = [importlib.import_module(f"mbma_tables.core._{name}") for name, least in GENERATIONS.items()
         if name != "plain" and PLAIN.generation >= least]  # fmt: skip
CORES = [PLAIN, *FUSED]
SELF_AFFINE = [(0.8, 64.0), (0.3, 4.0), (0.1, 1e5), (1.0, 1e6), (0.5, 3.1), (0.02, 1e8)]
BAD = [math.nan, math.inf, -math.inf, -1.0, 0.0, -0.0, 5e-324, 1e-310, 1e308, 1e200]
FINE = [*np.arange(1, 4) / 4, *0.5 ** np.arange(3, 20, 2)]
NODE, WEIGHT = np.polynomial.legendre.leggauss(20)


def gauss(low, high):
    """Nodes and weights between the ends of panels, in a last axis."""
    half = (np.asarray(high) - low)[..., None] / 2
    return np.asarray(low)[..., None] + half * (1 + NODE), half * WEIGHT


def inner(y, weights):
    """I(y) exp(2 y^2): over v = 2 (y'^2 - y^2); a logarithm of small y."""
    light, y = np.log(np.maximum(1e-6 / y, 1)), np.maximum(y, 1e-6)
    v, d_v = gauss(*(np.append(0.0, np.geomspace(1e-16, 45, 50))[k : k + 50] for k in (0, 1)))
    v, d_v = v.ravel(), d_v.ravel()
    square = y[..., None] ** 2 + v / 2
    P = erf(np.sqrt(2 * square))
    slope = weights[0] + 3 * weights[1] * P**2 + 16 * weights[2] * P**15
    return ((slope * np.exp(-v) / (4 * square)) @ d_v + weights[0] * light) * math.sqrt(8 / math.pi)


def log_separation(q, C, force, law):
    """ln u + 2 F^2 of power laws between samples, by panels graded towards both ends."""
    log_q = np.log(q / q[0])
    last, first = log_q[-1], min(log_q[-1], 1.0)
    graded = np.append(0.0, first * np.exp(np.arange(-60, 0.5, 1.0))), last - first * 0.5 ** np.arange(13)
    fine = [log_q[:-1] + np.diff(log_q) * part for part in FINE]
    edges = np.unique(np.concatenate([log_q, *graded, *fine, np.arange(first, last, 0.5)]))
    root, d_root = gauss(np.sqrt(edges[:-1]), np.sqrt(edges[1:]))
    t, d_t = root**2, 2 * root * d_root

    def content(order, x):
        return np.exp(np.interp(x, log_q, np.log(C)) + (order + 2) * x)

    inside, weight = gauss(np.broadcast_to(edges[:-1, None], t.shape), t)
    before = np.append(0, np.cumsum((content(2, t) * d_t).sum(axis=1)))
    m0, m2 = (content(0, t) * d_t).sum(), before[-1]
    below = (before[:-1, None] + (content(2, inside) * weight).sum(axis=2)) / m2
    share = np.exp(t) * content(0, t) * d_t / m0 / (4 * math.sqrt(m2 / m0) * np.sqrt(below))
    found = []
    for load in force:
        seen = load**2 * (1 / below - 1) < 40
        part = inner(load / np.sqrt(below[seen]), law.coefficients) * np.exp(-2 * load**2 * (1 / below[seen] - 1))
        found.append(math.log(part @ share[seen]))
    return np.array(found)


def self_affine(hurst, zeta_1):
    return np.array([1.0, zeta_1]), np.array([1.0, zeta_1 ** (-2 - 2 * hurst)])


class TestCurve:
    @pytest.mark.parametrize(("hurst", "zeta_1"), SELF_AFFINE)
    def test_of_self_affine_surfaces(self, hurst, zeta_1):
        number = SELF_AFFINE.index((hurst, zeta_1))
        law = Law(Spectrum.self_affine(hurst, zeta_1), None, [CONSTANTS, YANG_PERSSON, PERSSON][number % 3])
        log_force = np.concatenate([np.linspace(-50, 2.8, 9), np.random.default_rng(number).uniform(-2, 1, 5)])
        found, slope = law.separation_persson(np.exp(log_force))
        expected = log_separation(*self_affine(hurst, zeta_1), np.exp(log_force), law) - 2 * np.exp(2 * log_force)
        np.testing.assert_allclose(np.log(found), expected, rtol=0, atol=1e-11)
        step = 1e-4
        ends = [np.log(law.separation_persson(np.exp(log_force + k * step))[0]) for k in (-2, -1, 1, 2)]
        rate = (ends[0] - ends[3] + 8 * (ends[2] - ends[1])) / (12 * step)
        np.testing.assert_allclose(slope / found, rate, rtol=1e-7)

    @pytest.mark.parametrize(("samples", "scatter"), [(2, 0.0), (20, 0.2), (40, 2.0), (80, 0.2)])
    def test_of_scattered_spectra(self, samples, scatter):
        random = np.random.default_rng(samples)
        q = np.sort(np.exp(random.uniform(0, 6, samples)))
        C = np.minimum(1, q**-3.5) * np.exp(random.normal(0, scatter, samples))
        law, force = Law(Spectrum.from_samples(q, C)), np.array([1e-9, 0.03, 1.5])
        found = np.log(law.separation_persson(force)[0]) + 2 * force**2
        np.testing.assert_allclose(found, log_separation(q, C, force, law), rtol=0, atol=LAW_ERROR / 30)

    def test_of_waviness_and_roughness_far_apart(self):
        # u falls by orders of magnitude where the waviness has closed
        waves = np.array([1.0, 1e4]), np.array([0.999999, 0.000001]), np.array([0.0025, 0.5025])
        law = Law(Spectrum(*waves, 3.0, 50.0))
        force = np.geomspace(1e-9, 6, 40)
        shares = waves[0] * waves[1] / (4 * 3.0) / np.sqrt(waves[2])
        y = force[:, None] / np.sqrt(waves[2])
        bell = np.exp(-2 * (y**2 - y[:, 1:] ** 2))
        expected = np.log((inner(y, law.coefficients) * bell) @ shares) - 2 * y[:, 1] ** 2
        np.testing.assert_allclose(np.log(law.separation_persson(force)[0]), expected, rtol=0, atol=1e-10)

    @pytest.mark.parametrize("h_max", [None, 0.5, 3.2, 30.0, 1e300])
    def test_separation_is_the_inverse_of_force(self, h_max):
        law = Law(Spectrum.self_affine(0.7, 100.0), h_max)
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
        law = Law(Spectrum.self_affine(0.7, 100.0), 3.0)
        assert [row.tolist() for row in law.contact([0.0, 3.0, 4.0])] == [[np.inf, 0, 0], [1, 0, 0], [np.inf, 0, 0]]
        assert law.separation([1e-300, 20.0, 1e300]) == pytest.approx([3.0, 0.0, 0.0], rel=1e-15, abs=0)
        # as sharp as what is left of Gaussian tails: the slope of a surface without end
        assert law.contact(3 - 1e-9)[0] == pytest.approx(1e-9 * law.contact(3 - 1e-9)[2], rel=1e-6)


def test_waves_hold_the_moments_of_the_spectrum():
    for hurst, zeta_1 in SELF_AFFINE:
        spectrum, alpha, gradient = Spectrum.self_affine(hurst, zeta_1), np.empty(1), np.empty(1)
        core.self_affine(np.array([hurst]), np.log([zeta_1]), alpha, gradient)
        assert spectrum.alpha == pytest.approx(alpha[0], rel=1e-13)
        assert spectrum.gradient == pytest.approx(gradient[0], rel=1e-13)
        assert spectrum.variance.sum() == pytest.approx(1, rel=1e-14)
        assert spectrum.variance @ spectrum.x**2 == pytest.approx(gradient[0] ** 2, rel=1e-13)
        assert np.all(np.diff(spectrum.x) >= 0)
        assert np.all(np.diff(spectrum.below) >= 0)
        assert 0 < spectrum.below[0] < 1e-15
        assert spectrum.below[-1] == pytest.approx(1, rel=1e-4)
    # a jump, and a gap in which there is nothing
    q = np.array([1.0, 2.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    C = np.array([1.0, 0.5, 2.0, 1.0, 0.0, 0.7, 0.2])
    split = Spectrum.from_samples(q, C)
    assert not ((split.x > 3) & (split.x < 5)).any()
    surface = Surface.from_spectrum(q, C, h_max=1.0)
    assert split.gradient == pytest.approx(surface.rms_gradient / surface.h_rms / surface.q0, rel=1e-13)
    assert split.alpha == pytest.approx(surface.alpha, rel=1e-13)


@pytest.mark.parametrize("used", CORES)
class TestAnyInput:
    def test_of_forces_and_separations(self, used):
        x = np.array(BAD)
        for h_max in (None, 3.0):
            law = Law(Spectrum.self_affine(0.8, 64.0), h_max)._prepared
            u, slope, back = np.empty((3, x.size))
            assert used.spectrum_law_separation(law, x, 0, u, slope) == np.isnan(u).sum() == np.isnan(slope).sum()
            assert np.isfinite(u).tolist() == (x > 0).tolist()
            assert u[[1, 8, 9]].tolist() == [0, 0, 0]
            assert used.spectrum_law_separation(law, x, 1, back, slope) == np.isnan(back).sum() == 5
            out = np.empty((3, x.size))
            assert used.spectrum_law_contact(law, x, *out) == np.isnan(out[0]).sum()
            np.testing.assert_array_equal(out[:, [1, 8, 9]], 0.0)
            assert np.isinf(out[0]).tolist() == (x <= 0).tolist()

    def test_of_laws_that_were_not_prepared(self, used):
        one, out = np.ones(1), np.empty((3, 1))
        for fill in (0.0, math.nan, 1e300, -1.0, 5e-324 * 120):
            law = np.full(used.words_of_spectrum_law(), fill)
            for whole in (0, 1):
                used.spectrum_law_separation(law, one, whole, *out[:2])
            used.spectrum_law_contact(law, one, *out)
        with pytest.raises(ValueError, match="sizes"):
            used.spectrum_law_contact(law[:-1], one, *out)

    def test_of_spectra(self, used):
        none, facts = np.empty(0), np.empty(4)
        # falls and rises that no quotient holds, between samples as close as numbers are
        near = np.nextafter(2.0, 3.0)
        for C in ([1e308, 5e-324, 1.0, 1.0], [1.0, 1e308, 5e-324, 1.0], [5e-324, 1.0, 5e-324, 1e308]):
            for q in ([1.0, 2.0, 3.0, 4.0], [1.0, 2.0, near, 3.0], [2.0, near, 3.0, 4.0]):
                assert used.spectrum_waves(np.array(q), np.array(C), none, none, none, facts) < 100_000
        for count in (0, 1, 9):
            assert used.spectrum_waves(np.ones(count), np.ones(count), none, none, none, facts) == 0
        spectrum = Spectrum.self_affine(0.8, 64.0)
        few = np.full((3, 10), -7.0)
        count = used.spectrum_waves(*self_affine(0.8, 64.0), *few[:, :9].copy(), facts)
        assert count == spectrum.x.size
        constants = np.array([spectrum.gradient, spectrum.alpha, 0.5, 0.03, 0.34, 0.44, 0.09, 0.43, 0.06, 3.2])
        for bad in BAD:
            for column, place in [(3, k) for k in range(10)] + [(c, k) for c in range(3) for k in (0, 200, count - 1)]:
                own = [spectrum.x.copy(), spectrum.variance.copy(), spectrum.below.copy(), constants.copy()]
                own[column][place] = bad
                law, out = np.empty(used.words_of_spectrum_law()), np.empty((3, 3))
                status = used.spectrum_law_of(*own, np.empty(3 * count), law)
                assert used.spectrum_law_contact(law, np.array([0.01, 1.0, 2.5]), *out) == 3 or status == 0


def test_what_is_no_spectrum_is_refused():
    with pytest.raises(InputError, match="no spectrum"):
        Spectrum.from_samples(np.array([1.0, 2.0]), np.array([1.0, 0.0]))
    good = Spectrum.self_affine(0.8, 64.0)
    with pytest.raises(InputError, match="rising"):
        Law(Spectrum(good.x, good.variance, good.below[::-1].copy(), good.gradient, good.alpha)).force(1.0)
    # less than nothing is left by this weight
    with pytest.raises(ConvergenceError, match="no curve"):
        Law(good, None, CONSTANTS.__class__(weight=-5.0)).force(1.0)
