"""MBMA on surfaces that are their own spectrum, against the five numbers, quadrature, and boundary elements."""

import dataclasses
import pathlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mbma_tables import InputError, OutOfRangeError, Surface, contact, contact_law, island
from mbma_tables.islands.island_models import answer_islands
from mbma_tables.islands.variants import FITTED, PRINTED, REPORTED
from mbma_tables.theories import Mbma
from mbma_tables.theories.mbma.models import get_model
from mbma_tables.theories.mbma.profile import _of_bands, profile, source_of, spectra_of

DATA = pathlib.Path(__file__).parents[2] / "data"
DEPTHS = np.array([1e-9, 1e-4, 0.02, 0.3, 1.0, 1.5, 2.0])  # (h_max - d)/h_max


def five_numbers(hurst=0.8, zeta_1=200.0, h_max=3.0):
    return Surface(hurst=hurst, q0=0.01, q1=0.01 * zeta_1, h_rms=1.0, h_max=h_max)


def sampled(surface, count):
    q = np.geomspace(surface.q0, surface.q1, count)
    return Surface.from_spectrum(q, surface.power_spectrum(q), h_max=float(surface.h_max))


def rough(seed=1, count=60, h_max=3.5, gap=True):
    """A plateau, a power law with scatter, a gap."""
    q = np.geomspace(0.2, 60, count)
    C = np.minimum(1, q**-3.5) * np.random.default_rng(seed).uniform(0.7, 1.4, count)
    C[count // 2] *= not gap
    unit = Surface.from_spectrum(q, C, h_max=1.0).h_rms
    return Surface.from_spectrum(q, C / unit**2, h_max=h_max)


@pytest.mark.parametrize("variant", [REPORTED, PRINTED, FITTED], ids=lambda r: r.name)
@pytest.mark.parametrize(
    ("hurst", "zeta_1"),
    [(0.8, 200.0), (0.5, 30.0), (1.0, 1000.0), (0.3, 64.0), (0.9, 6.0)],
)
def test_a_sampled_power_law_has_the_totals_of_its_five_numbers(variant, hurst, zeta_1):
    surface = five_numbers(hurst, zeta_1)
    d = surface.h_max * (1 - DEPTHS[1:])
    theory = Mbma(variant=variant)
    plain = theory.totals(surface, d, slopes=True)
    for count in (2, 200):
        found = theory.totals(sampled(surface, count), d, slopes=True)
        bound = float(np.max(plain.error + found.error))
        for name in ("pressure", "area"):
            np.testing.assert_allclose(
                getattr(found, name), getattr(plain, name), rtol=bound
            )
        for name in ("pressure_slope", "area_slope"):
            np.testing.assert_allclose(
                getattr(found, name), getattr(plain, name), rtol=10 * bound
            )


APART = 1e-9


@pytest.mark.parametrize("island_model", ["universal", "exact"])
@settings(max_examples=6, deadline=None)
@given(
    hurst=st.floats(0.06, 1.0),
    log_zeta=st.floats(0.6, 4.0),
    heights=st.floats(0.1, 10.0),
    sides=st.tuples(*[st.sampled_from([-APART, 0.0, APART])] * 3).filter(any),
)
def test_faces_alike_are_the_limit_of_faces_that_differ(
    island_model, hurst, log_zeta, heights, sides
):
    """One self-affine surface, and a sum of two spectra with a jump at their ends."""
    hurst = min(hurst, 1 - APART)
    face = Surface(hurst, 1.0, 10**log_zeta, 1.0, 3.0)
    numbers = np.array([hurst, 1.0, 10**log_zeta])
    alike, near = (
        face.combined(
            Surface(*numbers * (1 + share * np.array(sides)), heights, 3 * heights)
        )
        for share in (0, 1)
    )
    assert isinstance(alike, Surface)
    assert not isinstance(near, Surface)
    theory = Mbma(island_model=island_model, outside="exact")
    d = float(alike.h_max) * (1 - np.array([0.01, 0.3, 1.0, 1.5]))
    one, two = (theory.totals(surface, d, slopes=True) for surface in (alike, near))
    # the numbers themselves change force and area by at most a hundred times their own change
    bound = one.error + two.error + 100 * APART
    for name in ("pressure", "area"):
        missed = np.abs(getattr(two, name) / getattr(one, name) - 1)
        assert (missed <= bound).all()


def test_a_spectrum_goes_on_as_its_power_law_if_it_has_one():
    """Variance beyond the shortest wavelength: of self-affine ones, of sums, and where spectra rise."""
    face = five_numbers(0.4, 30.0)
    of_face = float(face.s**2 - face.h_rms**2)
    assert sampled(face, 7).beyond == pytest.approx(of_face, rel=1e-12)
    # of two power laws no more than both have, and continuous where one vanishes
    rougher = five_numbers(0.2, 60.0)
    both = face.combined(rougher).sampled().beyond
    assert both < of_face + float(rougher.s**2 - rougher.h_rms**2)
    less = Surface(0.2, 0.01, 0.6, 1e-6, 3.0)
    assert rougher.combined(less).sampled().beyond == pytest.approx(
        float(rougher.s**2 - rougher.h_rms**2), rel=1e-9
    )
    # equal variances in equal octaves have no end, and less than that is none
    q = np.geomspace(1, 30, 30)
    steps = [
        Surface.from_spectrum(q, q**power, h_max=3.0).beyond
        for power in (-2.1, -2.05, -2.01, -2.0, -1.9)
    ]
    assert np.diff(steps[:2]) != 0
    assert np.all(np.diff(steps[1:4]) < 0)
    assert steps[3:] == [pytest.approx(0.0, abs=1e-9), 0.0]
    # a last sample that stands alone holds no height
    alone = Surface.from_spectrum([1, 2, 3, 4, 20], [1, 1, 0, 0, 1], h_max=3.0)
    assert alone.beyond == 0.0


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 1000), st.floats(0.5, 4.0))
def test_errors_hold_and_slopes_are_slopes(seed, share):
    surface = rough(seed)
    model = get_model("universal", 1e-8, REPORTED)
    coarse, fine = (profile(surface, model, REPORTED, rtol) for rtol in (1e-5, 1e-10))
    c = share * np.array([1e-5, 0.1, 1.0])
    one = coarse.totals(c)
    two = fine.totals(c, slopes=True)
    assert (np.abs(one / two[:2] - 1) <= coarse.error + fine.error).all()
    step = 1e-4 * c
    slopes = (fine.totals(c + step) - fine.totals(c - step)) / (2 * step)
    assert two[2:] == pytest.approx(slopes, rel=2e-5)


def test_a_spectrum_has_one_profile_whether_islands_beyond_the_table_are_refused_or_not():
    surface = rough()
    model = get_model("universal", 1e-8, REPORTED)
    made = profile(surface, model, REPORTED, 1e-3, "raise")
    assert profile(surface, model, REPORTED, 1e-3, "nan") is made
    assert profile(surface, model, REPORTED, 1e-3, "exact") is not made


def test_spectra_of_a_batch_are_made_once():
    one, other = five_numbers(), five_numbers(hurst=0.7, h_max=[2.0, 3.0])
    batch = one.combined(other, 1e8)
    made = spectra_of(batch)
    # as where a batch has more than are kept by their numbers
    _of_bands.cache_clear()
    assert [each is same for each, same in zip(made, spectra_of(batch), strict=True)] == [
        True,
        True,
    ]


def test_slopes_hold_in_thin_panels():
    # values of 5,000 samples round there to more than they change: against the integral and
    # its upper limit in numpy
    surface = rough(count=5000)
    model = get_model("universal", 1e-8, REPORTED)
    kept = profile(surface, model, REPORTED, 1e-10)
    source = source_of(surface, REPORTED)
    node, weight = np.polynomial.legendre.leggauss(8)

    def parts(x):
        """Force and area of the islands at approaches, without the Gaussian; shift and rate of their heights."""
        g = source.islands(x)
        phi = answer_islands(model, g)
        force = g["sigma"] * np.sqrt(2 * g["R_d"] * g["sigma"]) * phi.phi_F
        area = (
            2
            * np.pi
            * g["eta"]
            * g["D"]
            * g["R_u"]
            * g["R_d"]
            * g["sigma"] ** 2
            * phi.phi_A
        )
        return np.stack([force, area]) * source.density(
            g, x
        ) * source.h_rms, *source.heights(g, x)

    for c in np.linspace(0.01, 0.99, 20) * kept.end:
        edges = np.concatenate([[0.0, c], np.geomspace(1e-9 * c, c, 400), source.breaks])
        edges = np.unique(edges[edges <= c])
        half = np.diff(edges)[:, None] / 2
        weights, shift, rate = parts((edges[:-1, None] + half * (1 + node)).ravel())
        height, (own, own_shift, own_rate) = shift - rate * c, parts(np.array([c]))
        gaussian = np.exp(-(height**2) / 2) * (half * weight).ravel()
        last = own[:, 0] * np.exp(-((own_shift - own_rate * c)[0] ** 2) / 2)
        expected = *(weights @ gaussian), *(weights @ (gaussian * height * rate) + last)
        assert kept.totals(np.array([c]), slopes=True)[:, 0] == pytest.approx(
            expected, rel=2e-10
        )


@pytest.mark.parametrize(("count", "h_max"), [(60, 3.5), (2000, 3.5), (60, 13.0)])
def test_a_law_is_the_contacts(count, h_max):
    surface = rough(count=count, h_max=h_max)
    law = contact_law(surface, theory="mbma")
    d = surface.h_max * (1 - DEPTHS)
    d = d[d >= law.lowest]
    found = contact(surface, separation=d, theory="mbma")
    for name in ("pressure", "area"):
        np.testing.assert_allclose(
            getattr(law, name)(separation=d), getattr(found, name), rtol=2 * law.error
        )
    assert (law.theory, law.variant, law.island_model) == (
        "mbma",
        "reported",
        "universal",
    )


def test_a_law_ends_with_the_table():
    # high peaks: the islands of full compression lie outside of the table
    surface = rough(h_max=30.0)
    law = contact_law(surface, theory="mbma")
    assert -surface.h_max < law.lowest < surface.h_max / 2
    d = law.lowest + np.array([1e-9, 0.1, 1.0])
    np.testing.assert_allclose(
        law.pressure(separation=d),
        contact(surface, separation=d, theory="mbma").pressure,
        rtol=2 * law.error,
    )
    with pytest.raises(OutOfRangeError, match="where the theory ends"):
        law.pressure(separation=law.lowest - 0.1)
    np.testing.assert_allclose(
        law.separation(pressure=law.pressure(separation=d)), d, rtol=1e-6
    )
    # as far as there is a table, contacts are found by pressure and known to be valid or not
    found = contact(surface, pressure=law.pressure(separation=d), theory="mbma")
    np.testing.assert_allclose(found.separation, d, rtol=1e-6)
    assert found.valid.shape == (3,)
    with pytest.raises(OutOfRangeError, match="at most what theory 'mbma' reaches"):
        contact(surface, pressure=2 * law.pressure(separation=law.lowest), theory="mbma")


def test_islands():
    surface = five_numbers()
    delta = [0.01, 0.5, 2.0, 8.0]
    one = island(surface, delta)
    two = island(sampled(surface, 30), delta)
    for field in dataclasses.fields(one):
        value = getattr(one, field.name)
        if isinstance(value, np.ndarray) and field.name != "error":
            np.testing.assert_allclose(
                getattr(two, field.name), value, rtol=1e-12, err_msg=field.name
            )


def test_what_mbma_cannot_use_is_refused_with_the_mend():
    surface = rough()
    with pytest.raises(
        InputError, match=r"use 'universal' or 'exact', or surface\.fit\(\)"
    ):
        contact(surface, separation=1.0, theory=Mbma(island_model="island4d"))
    with pytest.raises(InputError, match=r"surface\.fit\(\)"):
        island(surface, 1.0, island_model="island4d")
    q = np.geomspace(1, 10, 30)
    blue = Surface.from_spectrum(q, q, h_max=3000.0)
    with pytest.raises(
        OutOfRangeError, match="measure shorter wavelengths, or use another theory"
    ):
        contact(blue, separation=1.0, theory="mbma")
    assert contact(blue, mean_separation=500.0, theory="calibrated").pressure > 0
    steep = Surface.from_spectrum(
        np.geomspace(1, 30, 50), np.geomspace(1, 30, 50) ** -2.1, h_max=30.0
    )
    deep = contact(
        steep, separation=-29.0, theory=Mbma(island_model="universal", outside="nan")
    ).pressure
    assert deep > 0 or np.isnan(deep)


@pytest.mark.parametrize("number", [0, 1])
def test_area_at_a_force_of_boundary_elements(number):
    hurst, waves, last, top = ((0.8, 8, 128, 0.041954782), (0.6, 4, 64, 0.037331897))[
        number
    ]
    q = 2 * np.pi * np.geomspace(1, last, 300)
    C = np.minimum(1, (q / (2 * np.pi * waves)) ** (-2 - 2 * hurst))
    surface = Surface.from_spectrum(
        q, 1e-4 * C / Surface.from_spectrum(q, C, h_max=1.0).m0, h_max=top
    )
    force, area = np.loadtxt(
        DATA / f"rolloff_{number}.csv", delimiter=",", usecols=(0, 1), unpack=True
    )
    tested = (area > 0.002) & (area < 0.25)
    ratio = contact(surface, pressure=force[tested], theory="mbma").area / area[tested]
    assert ((ratio > 0.85) & (ratio < 1.1)).all()
