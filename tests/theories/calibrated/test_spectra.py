"""Laws of many spectra at once: against nested quadrature, and against the law of each."""

import itertools

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import erf, erfinv

from mbma_tables import Bodies, Surface, contact
from mbma_tables.theories.calibrated.formulas import (
    CONSTANTS,
    YANG_PERSSON,
    Spectrum,
    SpectrumLaw,
)
from mbma_tables.theories.calibrated.spectra import Spectra, self_affine_laws

POWERS = (1, 3, 16)


def inner(weights, y):
    """Integral of dW/y from y on, W a polynomial of P = erf(sqrt(2) y)."""

    def slope(log_y):
        z = np.exp(log_y)
        P = erf(np.sqrt(2) * z)
        by_P = sum(w * n * P ** (n - 1) for w, n in zip(weights, POWERS, strict=True))
        return by_P * np.sqrt(8 / np.pi) * np.exp(-2 * z * z)

    start = np.log(y)
    parts = [(a, min(a + 1, 2.0)) for a in np.arange(start, 2.0, 1.0)]
    return sum(quad(slope, a, b, epsabs=1e-14, epsrel=1e-12)[0] for a, b in parts)


def band_moment(parts, order, low, high):
    """Integral of C q^(order + 1) dq, of power laws one by one."""
    total = 0.0
    for q_low, q_high, C, power in parts:
        a, b = max(low, q_low), min(high, q_high)
        n = power + order + 2
        if b > a:
            scale = C * q_low**-power
            whole = np.log(b / a) if abs(n) < 1e-12 else (b**n - a**n) / n
            total += scale * whole
    return total


def separation(parts, force, constants):
    """u/h_rms at F/(A0 E* g) of an endless surface, before the tail's factor, and the narrowness."""
    ends = sorted({q for part in parts for q in part[:2]})
    m0, m2, mean, inverse = (
        band_moment(parts, n, ends[0], ends[-1]) for n in (0, 2, 1, -1)
    )
    narrowness = m0**2 / (mean * inverse)
    a = constants.weight + constants.weight_slope * (narrowness - 0.65)
    weights = a, constants.cubic, 1 - a - constants.cubic

    def contribution(root, start):
        # ln q = ln start + root^2: g rises like its root from the longest wave on
        q = start * np.exp(root * root)
        C = sum(p[2] * (q / p[0]) ** p[3] for p in parts if p[0] <= q <= p[1])
        below = band_moment(parts, 2, ends[0], q) / m2
        if below <= 0:
            return 0.0
        g = np.sqrt(below)
        return (
            2 * root * C * q**3 / (4 * np.sqrt(m0 * m2) * g) * inner(weights, force / g)
        )

    u = 0.0
    for low, high in itertools.pairwise(ends):
        last = np.sqrt(np.log(high / low))
        for edge in range(3):
            part = quad(
                contribution, last * edge / 3, last * (edge + 1) / 3, (low,), epsrel=1e-9
            )
            u += part[0]
    return u, narrowness


SPECTRA = {
    "self-affine": [(1.0, 200.0, 1.0, -3.6)],
    "H = 1": [(0.3, 20.0, 2.0, -4.0)],
    "roll-off": [(1.0, 8.0, 1.0, 0.0), (8.0, 600.0, 1.0, -3.4)],
    "two bands": [(1.0, 50.0, 1.0, -3.6), (3.0, 400.0, 0.05, -3.0)],
    "gap": [(1.0, 10.0, 1.0, -3.6), (40.0, 90.0, 1e-4, -3.2)],
}


@pytest.mark.parametrize("name", SPECTRA)
@pytest.mark.parametrize("constants", [CONSTANTS, YANG_PERSSON], ids=["own", "persson"])
def test_separations_are_those_of_nested_quadrature(name, constants):
    parts = np.array(SPECTRA[name])
    endless = Spectra(parts[None], np.array([50.0]), np.array([np.inf]), constants)
    for force in (1e-5, 0.003, 0.2, 1.2):
        wanted, narrowness = separation(SPECTRA[name], force, constants)
        # the tail: ln F falls by tail u^3
        tail = constants.tail * (1 - narrowness)
        with_tail = np.array([force * np.exp(-tail * wanted**3)])
        found = endless.separations((np.zeros(1, np.int64), with_tail))[0, 0]
        assert found == pytest.approx(wanted, rel=3e-8)


def test_random_surfaces_are_as_by_the_law_of_each():
    rng = np.random.default_rng(57)
    for _ in range(12):
        hurst, zeta = rng.uniform(0.02, 1.0), 10 ** rng.uniform(0.5, 8.0)
        h_max = rng.uniform(2.5, 12.0)
        spectrum = Spectrum.self_affine(hurst, zeta)
        law = SpectrumLaw(spectrum, h_max)
        many = Spectra(
            self_affine_laws(np.array([hurst]), np.array([zeta])),
            np.array([spectrum.alpha]),
            np.array([h_max]),
        )
        u = np.concatenate(
            [np.geomspace(1e-250, 0.1, 30), rng.uniform(0.1, 0.99 * h_max, 30)]
        )
        owner = np.zeros(u.size, np.int64)
        found = many.contacts((owner, u))
        for own, wanted in zip(found, law.contact(u), strict=True):
            np.testing.assert_allclose(own, wanted, rtol=1e-7)
        back = many.separations((owner, found[0]))[0]
        np.testing.assert_allclose(back, u, rtol=1e-7)


def test_ends_of_contact_and_numbers_that_are_none():
    one = Spectra(
        self_affine_laws(np.array([0.8]), np.array([100.0])),
        np.array([40.0]),
        np.array([4.0]),
    )
    u = np.array([0.0, 4.0, 5.0, np.nan])
    force, area, stiffness = one.contacts((np.zeros(4, np.int64), u))
    np.testing.assert_array_equal(force, [np.inf, 0.0, 0.0, np.nan])
    np.testing.assert_array_equal(area, [1.0, 0.0, 0.0, np.nan])
    np.testing.assert_array_equal(stiffness, [np.inf, 0.0, 0.0, np.nan])
    # numbers of surfaces that there are not
    assert np.isnan(one.contacts((np.array([-1, 1]), np.ones(2)))).all()
    assert np.isnan(one.separations((np.zeros(2, np.int64), np.array([0.0, -1.0])))).all()


def test_batches_beyond_the_table_are_as_one_surface():
    rng = np.random.default_rng(1)
    n = 40
    # contact of some begins above 8 h_rms, where the table ends
    batch = Surface(
        rng.uniform(0.03, 0.95, n),
        1.0,
        rng.uniform(30, 300, n),
        0.01,
        rng.uniform(0.04, 0.1, n),
    )
    for bodies in (1.0, Bodies(hardness=0.05, nu=0.3)):
        many = contact(batch, bodies, pressure=2e-4, theory="calibrated")
        for k in range(0, n, 7):
            numbers = [getattr(batch, name)[k] for name in batch.parameters]
            own = contact(Surface(*numbers), bodies, pressure=2e-4, theory="calibrated")
            for name in ("mean_separation", "area", "stiffness"):
                wanted = getattr(own, name)
                assert getattr(many, name)[k] == pytest.approx(wanted, rel=1e-7)


def test_areas_are_those_of_the_law():
    """A/A0 = erf(F sqrt(2 S)): at an area, the pressure that the formula inverts to."""
    face = Surface(hurst=0.05, q0=1.0, q1=90.0, h_rms=0.01, h_max=0.05)
    found = contact(face, area=[0.01, 0.2], theory="calibrated")
    load = found.pressure / face.rms_gradient
    c = CONSTANTS
    s0 = c.area_s0 + c.area_slope * np.log(face.alpha / 10)
    e = load * np.sqrt(2 * (1 + load / c.area_t0) / (s0 + load / c.area_t0))
    np.testing.assert_allclose(e, erfinv([0.01, 0.2]), rtol=1e-7)
