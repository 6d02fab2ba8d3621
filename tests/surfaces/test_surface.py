"""`Surface` against its spectrum, units, batches, bad input; the paper's cases and variants."""

import dataclasses
import math

import mpmath as mp
import numpy as np
import pytest
import scipy.integrate
import xarray as xr
from helpers import refusals
from hypothesis import given, settings
from hypothesis import strategies as st

from mbma_tables import OutOfRangeError, Surface
from mbma_tables.islands.variants import PRINTED, REPORTED, VARIANTS, get_variant
from mbma_tables.surfaces import spectrum
from mbma_tables.surfaces.self_affine import CASES

GOOD = {"hurst": 0.8, "q0": 0.5, "q1": 100.0, "h_rms": 0.2, "h_max": 0.6}


def integral(surface, order):
    """2 pi <cos^n> integral C q^(1+n) dq over the band (Eq. 7), in log q."""
    angular = {0: 1, 2: 1 / 2, 4: 3 / 8}[order]
    found, _ = scipy.integrate.quad(
        lambda x: surface.power_spectrum(math.exp(x)) * math.exp((2 + order) * x),
        math.log(surface.q0) * (1 + 1e-15),
        math.log(surface.q1) * (1 - 1e-15),
        epsabs=0,
        epsrel=1e-12,
        limit=200,
    )
    return 2 * math.pi * angular * found


@pytest.mark.parametrize(
    ("hurst", "zeta_1"), [(0.1, 1e5), (0.5, 3.01), (0.8, 216.0), (1.0, 1e3)]
)
def test_moments_are_those_of_the_power_spectrum(hurst, zeta_1):
    surface = Surface(hurst, 0.37, 0.37 * zeta_1, 0.21, 0.7)
    m0, m2, m4 = (integral(surface, order) for order in (0, 2, 4))
    # the gradient has two components
    found = (
        surface.h_rms**2,
        surface.m0,
        surface.m2,
        surface.m4,
        surface.rms_gradient**2,
    )
    assert found == pytest.approx((m0, m0, m2, m4, 2 * m2), rel=1e-10, abs=0)
    assert surface.s == pytest.approx(
        0.21 / math.sqrt(1 - zeta_1 ** (-2 * hurst)), rel=1e-15, abs=0
    )
    assert surface.shape == ()
    assert all(
        isinstance(getattr(surface, name), float)
        for name in ("hurst", "q0", "h_max", "m2", "summit_density")
    )
    # Nayak's summits
    alpha = m0 * m4 / m2**2
    density = m4 / m2 / (6 * math.pi * math.sqrt(3))
    radius = 3 * math.sqrt(math.pi) / (8 * math.sqrt(m4))
    found = (
        surface.alpha,
        surface.summit_density,
        surface.summit_radius,
        surface.summit_sigma,
    )
    known = (alpha, density, radius, math.sqrt((1 - 0.8968 / alpha) * m0))
    assert found == pytest.approx(known, rel=1e-9, abs=0)


def test_power_spectrum_ends_with_the_band():
    surface = Surface(**GOOD)
    assert surface.power_spectrum([0.499, 100.1]).tolist() == [0.0, 0.0]
    assert (surface.power_spectrum([0.5, 100.0]) > 0).all()
    ratio = surface.power_spectrum(1.0) / surface.power_spectrum(2.0)
    assert ratio == pytest.approx(2**3.6, rel=1e-14, abs=0)
    batch = Surface([0.5, 0.8], 0.5, 100.0, 0.2, 0.6)
    assert batch.power_spectrum([[1.0], [2.0], [3.0]]).shape == (3, 2)


def test_a_surface_does_not_change():
    h_rms = np.array([0.1, 0.2])
    surface = Surface(0.8, 0.5, 100.0, h_rms, 0.6)
    h_rms[0] = 5.0
    assert surface.h_rms.tolist() == [0.1, 0.2]
    with pytest.raises(ValueError, match="read-only"):
        surface.h_rms[0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        surface.h_rms = 1.0


def test_prints_plain_numbers():
    assert repr(Surface(**{**GOOD, "hurst": [0.5, 0.8]})).startswith(
        "Surface(hurst=array([0.5, 0.8]), q0=array("
    )
    labelled = Surface(**{**GOOD, "hurst": xr.DataArray([0.5, 0.8], dims="site")})
    assert repr(labelled).startswith("Surface(hurst=<DataArray {'site': 2}>, q0=0.5,")


@pytest.mark.parametrize(
    ("said", "name", "value"),
    [("hurst", "hurst", value) for value in (0.0, -0.1, 1.01)]
    + [
        (name, name, value)
        for name in ("q0", "q1", "h_rms", "h_max")
        for value in (0.0, -1.0)
    ]
    + [("q1/q0", "q1", zeta_1) for zeta_1 in (0.5, 1.0, 3.0, 1.0001e8)],
)
def test_out_of_range(said, name, value):
    good = GOOD | {"q0": 1.0}
    with pytest.raises(OutOfRangeError, match=f"^{said} must be") as caught:
        Surface(**good | {name: [good[name], value]})
    assert caught.value.mask.tolist() == [False, True]
    assert Surface(1.0, 1.0, [math.nextafter(3, 4), 1e8], 0.2, 0.6).zeta_1[1] == 1e8


# name: H, zeta_1, q0 h_rms, h_max/h_rms, to the digits known
KNOWN = {
    "yang-persson": (0.8, 216, 6 * math.pi / 1040 * 10, 3),
    "papangelo": (0.8, 64, 2 * math.pi / 100 * 5, 3),
    "challenge": (0.8, 200, 2 * math.pi / 20 * 0.762, 3.7),
    **{f"resolution-{z}": (0.7, z, 0.1, 3) for z in (125, 250, 500, 1000)},
}
ROADS = {
    "concrete": (0.7, 64.8598, 0.538132, 0.071, 0.27, 62.0, 1.1),
    "asphalt": (0.85, 143.8668, 1.734830, 0.091, 2.67, 21000.0, 1.37),
}


@pytest.mark.parametrize("name", CASES)
def test_cases_of_the_paper(name):
    surface = Surface.named(name)
    if name not in ROADS:
        found = (
            surface.hurst,
            surface.zeta_1,
            surface.q0 * surface.h_rms,
            surface.h_max / surface.h_rms,
        )
        assert found == pytest.approx(KNOWN[name], rel=1e-13, abs=0)
        return
    hurst, zeta_1, q0, m0, m2, m4, h_max = ROADS[name]
    assert (surface.hurst, surface.h_max) == (hurst, h_max)
    assert surface.zeta_1 == pytest.approx(zeta_1, abs=5e-5)
    assert surface.q0 == pytest.approx(q0, abs=5e-7)
    assert (surface.m0, surface.m2, surface.m4) == pytest.approx(
        (m0, m2, m4), rel=1e-12, abs=0
    )


test_unknown_case = refusals(
    Surface.named, ("moon", "no surface is named 'moon'; there are yang-persson")
)


def test_the_two_variants_differ_by_pi_alone():
    assert math.pi * REPORTED.density_divisor == pytest.approx(
        PRINTED.density_divisor, rel=1e-15, abs=0
    )
    assert PRINTED.density_divisor == pytest.approx(
        6 * math.pi * math.sqrt(3), rel=1e-15, abs=0
    )
    same = dataclasses.replace(
        REPORTED, name="printed", density_divisor=PRINTED.density_divisor
    )
    assert same == PRINTED
    assert set(VARIANTS) == {"reported", "printed"}
    assert (PRINTED.beta, PRINTED.phi, PRINTED.floor_d, PRINTED.floor_u) == (
        1 / 3,
        0.05,
        1.5,
        3.0,
    )
    assert (PRINTED.jacobian, PRINTED.offset, PRINTED.summit_sigma) == (
        "printed",
        True,
        True,
    )


def test_by_name_or_own():
    assert get_variant("printed") is PRINTED
    own = dataclasses.replace(PRINTED, name="own", beta=0.3)
    assert get_variant(own) is own
    assert own.recorded == [PRINTED.density_divisor, 0.3, 0.05, 1.5, 3.0, True, True]
    assert own.numbers.tolist() == [*own.recorded, True]


NONSENSE = {
    "density_divisor": (0.0, -1.0, math.nan, math.inf),
    "jacobian": ("guessed",),
    "beta": (0.0, 0.75, math.nan),
}
NONSENSE |= {
    "phi": (0.0, 2.0, math.nan),
    "floor_d": (1.0, 3.0),
    "floor_u": (1.2, math.nan),
}
test_unknown_variants = refusals(
    get_variant,
    *((name, "variant must be one of") for name in ("guessed", "", None, 3, ["printed"])),
)
test_variants_without_meaning = refusals(
    lambda field, value: dataclasses.replace(PRINTED, name="own", **{field: value}),
    *(
        (field, value, f"variant 'own': .*{field}")
        for field in NONSENSE
        for value in NONSENSE[field]
    ),
)


HURSTS = [1e-3, 0.05, 0.3, 0.5, 0.8, math.nextafter(1, 0), 1.0]


def exact_moment(order, hurst, start, log_ratio):
    """m_n over [za, za exp(log_ratio)], from 2 H integral zeta^(n-1-2H) d zeta times the mean of cos^n."""
    with mp.workdps(50):
        h = mp.mpf(hurst)
        za = mp.mpf(start)
        width = mp.mpf(log_ratio)
        power = order - 2 * h
        angular = {0: mp.mpf(1), 2: mp.mpf(1) / 2, 4: mp.mpf(3) / 8}[order]
        growth = mp.expm1(power * width) / power if power != 0 else width
        return 2 * h * angular * za**power * growth


def relative(found, exact):
    with mp.workdps(50):
        return float(abs(mp.mpf(float(found)) / exact - 1))


@pytest.mark.parametrize("order", [0, 2, 4])
def test_band_moments(order):
    rng = np.random.default_rng(order)
    start = 10 ** rng.uniform(0, 7, 300)
    zeta_1 = np.tile(
        [math.nextafter(3, 4), 3.01, 10.0, 216.0, 1e4, 1e6, 1e8], len(HURSTS)
    )
    hurst, start, end, allowed = (
        np.append(*parts)
        for parts in (
            (rng.uniform(0.01, 1, 300), np.repeat(HURSTS, 7)),
            (start, np.ones(zeta_1.size)),
            (start * (1 + 10 ** rng.uniform(-3, 1, 300)), zeta_1),
            (np.full(300, 2e-14), np.full(zeta_1.size, 1e-14)),
        )
    )
    found = spectrum.band_moment(order, hurst, start, end)
    for k in range(found.size):
        with mp.workdps(50):
            width = mp.log(mp.mpf(float(end[k])) / mp.mpf(float(start[k])))
        assert (
            relative(found[k], exact_moment(order, hurst[k], start[k], width))
            <= allowed[k]
        )


@pytest.mark.parametrize("hurst", HURSTS)
def test_alpha(hurst):
    for width in (1e-12, 1e-6, 1e-3, 0.01, 0.1, 1.0, 3.0, 10.0, math.log(1e8)):
        with mp.workdps(50):
            m0, m2, m4 = (exact_moment(order, hurst, 1, width) for order in (0, 2, 4))
            exact = m0 * m4 / m2**2
        assert relative(spectrum.alpha_of(hurst, width), exact) <= 2e-14
    # of a band without width
    for width in (0.0, 1e-300, 1e-15):
        assert spectrum.alpha_of(hurst, width) == pytest.approx(1.5, rel=1e-14, abs=0)


@settings(deadline=None)
@given(
    hurst=st.floats(0.05, 1),
    log_zeta=st.floats(math.log(3.01), math.log(9.9e7)),
    q0=st.floats(1e-6, 1e6),
    h_rms=st.floats(1e-6, 1e3),
)
def test_moments_give_the_surface_back(hurst, log_zeta, q0, h_rms):
    first = Surface(hurst, q0, q0 * math.exp(log_zeta), h_rms, 3 * h_rms)
    again = Surface.from_moments(
        hurst=hurst, m0=first.m0, m2=first.m2, m4=first.m4, h_max=first.h_max
    )
    # the moments come back to rounding; zeta_1 as well as alpha fixes it
    for name, rel in {
        "m0": 1e-12,
        "m2": 1e-12,
        "m4": 1e-12,
        "zeta_1": 1e-11,
        "q0": 1e-11,
        "h_rms": 1e-14,
    }.items():
        assert getattr(again, name) == pytest.approx(getattr(first, name), rel=rel, abs=0)


def test_no_band_has_this_alpha():
    with pytest.raises(OutOfRangeError, match="alpha") as caught:
        Surface.from_moments(
            hurst=0.7, m0=1.0, m2=1.0, m4=[10.0, 1.0, 1.5, 1e12], h_max=1.0
        )
    assert caught.value.mask.tolist() == [False, True, True, True]
