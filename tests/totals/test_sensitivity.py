"""Derivatives of totals against differences of the solver's totals, and identities that they must keep."""

import dataclasses
import functools
import itertools
import math

import mpmath
import numpy as np
import pytest
from catalogue import LEVEL, OWN
from helpers import difference_weights

from generate.tables.exact_geometry import divisor, exact_island
from mbma_tables import Surface, contact
from mbma_tables.islands.geometry import kinks
from mbma_tables.models.tables import universal_model
from mbma_tables.surfaces.variants import REPORTED, get_variant

# each of two flags by itself
NO_OFFSET = dataclasses.replace(OWN, name="no offset", offset=False)
OF_HEIGHTS = dataclasses.replace(OWN, name="of heights", summit_sigma=False)
NAMES = ("hurst", "q0", "q1", "h_rms", "h_max", "separation")

# hurst, zeta_1, h_max/h_rms, (h_max - d)/h_rms
CASES = [
    (0.8, 216.0, 3.0, 1.0),
    (0.45, 1e4, 3.4, 0.02),
    (1.0, 60.0, 4.2, 2.5),
    (1.0, 3.8, 2.6, 4.9),
    (0.6, 12.0, 4.7, 7.0),
    (0.9, 1e3, 2.5, 1e-4),
    (0.7, 3.01, 3.0, 2.0),
]
# next to a kink, where a derivative that forgot it would be wrong: the third number is reach over the kink
AT_KINKS = [(0.9, 100.0, 0, 0.95), (0.9, 100.0, 0, 1.05), (0.9, 100.0, 1, 0.97), (0.9, 100.0, 1, 1.03)]


def differences(numbers, variant, step):
    """Values and derivatives of force and area by high-order differences of exact islands; numbers as `NAMES`."""
    shifted, spans = [], []
    for place, name in enumerate(NAMES):
        backward = name == "hurst" and numbers[place] == 1
        offsets = np.arange(-6.0, 1) if backward else np.arange(-3.0, 4)
        span = step * numbers[place]
        if name in ("q0", "q1"):
            # next to the floor of zeta_u, area rises like a sixth root of zeta_1 - floor
            span *= min(1.0, 10 * (numbers[2] / numbers[1] / get_variant(variant).floor_u - 1))
        if name in ("separation", "h_max"):
            # the depth is what matters near first contact
            span = step * (numbers[4] - numbers[5])
        points = np.repeat(np.asarray(numbers, dtype=float)[:, None], 7, axis=1)
        points[place] += span * offsets
        shifted.append(points)
        spans.append(difference_weights(offsets) / span)
    points = np.stack(shifted, axis=1)
    found = contact(Surface(*points[:5]), separation=points[5], island_model="exact", variant=variant, rtol=1e-11)
    return [np.einsum("nk,nk->n", spans, values) for values in (found.pressure, found.area)]


@functools.cache
def numbers_of(case):
    hurst, zeta_1, top, reach = case
    h_rms = 0.7
    return hurst, 0.3, 0.3 * zeta_1, h_rms, top * h_rms, (top - reach) * h_rms


EVERY = [(case, variant, 4e-3) for case in CASES for variant in ("reported", "printed")]
EVERY += [(CASES[k], variant, 4e-3) for k in (0, 2, 3) for variant in (OWN, LEVEL, NO_OFFSET, OF_HEIGHTS)]
for hurst, zeta_1, which, share in AT_KINKS:
    for variant in ("reported", OWN):
        reach = share * kinks(hurst, zeta_1, get_variant(variant))[which]
        EVERY.append(((hurst, zeta_1, 4.7, reach), variant, 2e-3))


@pytest.mark.parametrize(("case", "variant", "step"), EVERY, ids=str)
def test_against_differences(case, variant, step):
    numbers = numbers_of(case)
    found = contact(Surface(*numbers[:5]), separation=numbers[5], variant=variant, rtol=1e-10, derivatives=True)
    by_both = (found.pressure, found.pressure_by), (found.area, found.area_by)
    for (value, by), true in zip(by_both, differences(numbers, variant, step), strict=True):
        assert sorted(by) == sorted(NAMES)
        for name, parameter, slope in zip(NAMES, numbers, true, strict=True):
            scale = max(abs(slope), abs(value / parameter))
            assert abs(by[name] - slope) <= 1e-6 * scale, name


@pytest.mark.parametrize("variant", ["reported", "printed", OWN, LEVEL], ids=["reported", "printed", "own", "level"])
def test_lengths_and_slopes_scale_out(variant):
    """Euler's identity: force is of degree 1 in heights and in wavenumbers, area of degree 0, neither has lengths."""
    rng = np.random.default_rng(70)
    hurst, top = rng.uniform(0.3, 1, 60), rng.uniform(2.5, 4.7, 60)
    zeta_1, share = 10 ** rng.uniform(0.56, 4, 60), rng.uniform(-1, 1, 60)
    share[::4] = 1 - 10 ** rng.uniform(-6, -1, 15)
    surface = Surface(hurst, 0.3, 0.3 * zeta_1, 0.7, 0.7 * top)
    found = contact(surface, separation=share * surface.h_max, variant=variant, derivatives=True)
    for value, by, degree in ((found.pressure, found.pressure_by, 1), (found.area, found.area_by, 0)):
        terms = np.stack([np.asarray(getattr(found if n == "separation" else surface, n)) * by[n] for n in NAMES[1:]])
        waves, heights, size = terms[:2].sum(axis=0), terms[2:].sum(axis=0), np.abs(terms).sum(axis=0)
        assert (np.abs(heights - waves) <= 1e-13 * size).all()
        assert (np.abs(heights - degree * value) <= 1e-12 * size).all()


def by_zeta_1(hurst, zeta_1, h_max, depth):
    """dF/dq1 and dA/dq1 at h_rms = q0 = 1, islands by their formulas at 60 digits, Phi and its slopes by the table."""
    near = [zeta_1 + sign * 1e-4 * (zeta_1 - 3) for sign in (-1, 1)]
    kink_d, kink_u = (float(kink) for kink in kinks(hurst, zeta_1, REPORTED))
    assert depth < kink_d
    edges = sorted({0.0, depth, *(kink_u * 3.0**k for k in range(40) if kink_u * 3.0**k < depth)})
    nodes, weights = np.polynomial.legendre.leggauss(20)
    sums = np.zeros(2)

    def logarithms(island, zeta):
        s = 1 / mpmath.sqrt(1 - mpmath.mpf(zeta) ** (-2 * mpmath.mpf(hurst)))
        height = ((mpmath.mpf(h_max) - (mpmath.mpf(depth) - mpmath.mpf(x))) / s - island["h_d"]) / island["sigma_d"]
        density = mpmath.log(island["D_d"] / island["sigma_d"]) - height**2 / 2 - mpmath.log(2 * mpmath.pi) / 2
        # force per nominal area is in units of q0 s, and d(delta) of s
        force = density + mpmath.log(island["sigma"]) + mpmath.log(2 * island["R_d"] * island["sigma"]) / 2
        area = density - mpmath.log(s) + mpmath.log(island["eta"] * island["D"] * island["R_u"] * island["R_d"])
        area += mpmath.log(2 * mpmath.pi) + 2 * mpmath.log(island["sigma"])
        return [force, area, island["X"], mpmath.log(island["mu"])]

    for low, high in itertools.pairwise(edges):
        power = 6 if low == 0 else 1  # force and area rise like powers of x
        for u, weight in zip((nodes + 1) / 2, weights / 2, strict=True):
            x = float(low + (high - low) * u**power)
            with mpmath.workdps(60):
                ends = [logarithms(exact_island(x, hurst, zeta, divisor("reported")), zeta) for zeta in near]
                slopes = [float((b - a) / (mpmath.mpf(near[1]) - near[0])) for a, b in zip(*ends, strict=True)]
                middle = logarithms(exact_island(x, hurst, zeta_1, divisor("reported")), zeta_1)
            X, mu = float(middle[2]), math.exp(middle[3])
            value, by_X, by_mu = universal_model().slopes(X, mu)
            for k, name in enumerate(("phi_F", "phi_A")):
                phi = getattr(value, name)
                log_slope = slopes[k] + (getattr(by_X, name) * slopes[2] + getattr(by_mu, name) * mu * slopes[3]) / phi
                sums[k] += (high - low) * power * u ** (power - 1) * weight * phi * math.exp(middle[k]) * log_slope
    # K1 of the printed Jacobian, 1 - 4/9
    return 5 / 9 * sums


@pytest.mark.parametrize(
    ("hurst", "left", "h_max", "depth"),
    [
        (0.961145541398031, 1.6217016267e-05, 1.859847391862941, 0.8),
        (0.7, 3e-3, 3.4, 0.3),
        (0.7, 1e-5, 3.4, 0.3),
        (0.7, 1e-7, 3.4, 0.3),
        (0.4, 1e-7, 3.4, 1e-3),
        (1.0, 1e-7, 2.5, 0.03),
    ],
)
def test_next_to_the_floor_of_zeta_u(hurst, left, h_max, depth):
    surface = Surface(hurst, 1.0, 3.0 + left, 1.0, h_max)
    found = contact(surface, separation=h_max - depth, derivatives=True)
    true = by_zeta_1(hurst, surface.zeta_1, h_max, float(h_max - found.separation))
    for by, value, slope in zip((found.pressure_by, found.area_by), (found.pressure, found.area), true, strict=True):
        assert abs(by["q1"] - slope) <= 1e-6 * max(abs(slope), value / 3)
        # the lengths' identity holds q0 to it
        terms = [surface.h_rms * by["h_rms"], h_max * by["h_max"], found.separation * by["separation"]]
        assert abs(by["q0"] + surface.q1 * by["q1"] - sum(terms)) <= 1e-12 * abs(surface.q1 * by["q1"])


def test_units_shapes_and_no_contact():
    surface, gap = Surface([[0.5], [1.0]], 0.3, 30.0, 0.7, 2.4), np.array([1.0, 2.4, 5.0])
    found, stiff = (contact(surface, separation=gap, E_star=e, derivatives=True) for e in (1.0, [2.0, 3.0, 4.0]))
    one = contact(Surface(0.5, 0.3, 30.0, 0.7, 2.4), separation=1.0, derivatives=True)
    for name in NAMES:
        assert found.pressure_by[name].shape == found.area_by[name].shape == (2, 3)
        assert (found.pressure_by[name][:, 1:] == 0).all()
        assert (found.area_by[name][:, 1:] == 0).all()
        np.testing.assert_allclose(stiff.pressure_by[name], np.array([2, 3, 4]) * found.pressure_by[name], rtol=1e-15)
        np.testing.assert_array_equal(stiff.area_by[name], found.area_by[name])
        assert np.shape(one.pressure_by[name]) == ()
        assert one.pressure_by[name] == found.pressure_by[name][0, 0]
