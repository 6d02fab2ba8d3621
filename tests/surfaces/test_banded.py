"""Batches of surfaces whose spectra are sums of power laws."""

import dataclasses
import itertools

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import quad

from mbma_tables import Bodies, Joint, Surface, contact, island, sensitivity
from mbma_tables.common.errors import InputError, OutOfRangeError
from mbma_tables.export.page.explorer import explorer_page
from mbma_tables.surfaces.banded import BandedSurface
from mbma_tables.surfaces.surface import MeasuredSurface

METALS = ("steel 4140 hard", "aluminium 6061 hard")


def random_faces(n, rng):
    return [
        {
            "Rq": rng.uniform(0.2, most, n),
            "hurst": rng.uniform(0.5, 1.0, n),
            "longest": rng.uniform(200.0, 800.0, n),
            "shortest": rng.uniform(2.0, 8.0, n),
            "unit": "um",
        }
        for most in (0.8, 1.6)
    ]


def entry(face, k):
    return {n: v if isinstance(v, str) else float(v[k]) for n, v in face.items()}


def integral(surface, k, order):
    """2 pi integral C q^(order + 1) dq of one entry by quadrature of its spectrum."""

    def content(log_q):
        q = np.exp(log_q)
        return surface.power_spectrum(q)[k] * q ** (order + 2)

    ends = sorted(np.log([end[k] for band in surface.bands for end in band[:2]]))
    parts = itertools.pairwise(ends)
    return 2 * np.pi * sum(quad(content, a, b, epsrel=1e-11)[0] for a, b in parts)


def test_moments_are_integrals_of_the_spectrum():
    rng = np.random.default_rng(5)
    one, other = (
        Surface.from_roughness(**face, h_max=9.0) for face in random_faces(4, rng)
    )
    both = one.combined(other)
    assert isinstance(both, BandedSurface)
    np.testing.assert_allclose(both.h_rms, np.hypot(one.h_rms, other.h_rms), rtol=1e-13)
    np.testing.assert_allclose(both.h_max, np.hypot(9.0, 9.0), rtol=1e-13)
    for k in range(4):
        assert both.h_rms[k] ** 2 == pytest.approx(integral(both, k, 0), rel=1e-9)
        assert both.m2[k] == pytest.approx(integral(both, k, 2) / 2, rel=1e-9)
        assert both.m4[k] == pytest.approx(3 / 8 * integral(both, k, 4), rel=1e-9)


def test_joints_of_two_bands_are_as_one_by_one():
    """One joint has the exact sum too; samples of it depart by up to 1e-4 between samples."""
    rng = np.random.default_rng(57)
    n = 60
    faces = random_faces(n, rng)
    pressures = rng.uniform(1e-3, 0.05, n)
    given = {"bodies": METALS, "nominal_area": "4 cm^2", "friction": 0.2}
    pressed = Joint(*faces, **given).at_pressure(pressures)
    for k in range(0, n, 20):
        own = Joint(*(entry(face, k) for face in faces), **given)
        one = own.at_pressure(pressures[k])
        assert isinstance(own.surface, BandedSurface)
        sampled = dataclasses.replace(own, part_a=own.surface.sampled(), part_b=None)
        by_samples = sampled.at_pressure(pressures[k])
        for name in pressed.available():
            many = np.asarray(pressed.quantity(name))
            assert many.shape == (n,)
            found = many[k]
            wanted = one.quantity(name)
            np.testing.assert_allclose(found, wanted, rtol=1e-11, err_msg=name)
            flows = name in ("flow_coefficient", "hydraulic_aperture")
            rtol = 2e-3 if flows else 3e-6
            np.testing.assert_allclose(
                found, by_samples.quantity(name), rtol=rtol, err_msg=name
            )


def test_entries_of_one_band_are_as_the_power_law():
    """Faces with one band are a `Surface`; between others its numbers are met."""
    longest = np.array([500.0, 500.0, 300.0])
    one = Surface.from_roughness(
        Rq=0.5, hurst=0.8, longest=longest, shortest=5.0, h_max=2.0, unit="um"
    )
    other = Surface.from_roughness(
        Rq=0.3, hurst=0.8, longest=500.0, shortest=5.0, h_max=1.0, unit="um"
    )
    bodies = Bodies("100 GPa", hardness="2 GPa")
    both = contact(one.combined(other), bodies, pressure="20 MPa")
    same = Surface(
        0.8, one.q0[0], one.q1[0], np.hypot(0.5, 0.3), np.hypot(2.0, 1.0), unit="um"
    )
    alone = contact(same, bodies, pressure="20 MPa")
    for name in ("mean_separation", "area", "stiffness", "unloading_stiffness"):
        found = getattr(both, name)
        # to the certified error of the power law's table
        np.testing.assert_allclose(found[:2], getattr(alone, name), rtol=2e-5)
        assert abs(found[2] / found[0] - 1) > 1e-3


def test_rolloffs_are_arrays():
    numbers = {"Rq": 0.4, "hurst": 0.8, "h_max": 2.0, "unit": "um"}
    rolloffs = np.array([[100.0], [50.0]])
    for band in (
        {"longest": 500.0, "shortest": np.array([5.0, 8.0, 10.0])},
        {"longest": 500.0, "Rdq": np.array([0.1, 0.15, 0.2])},
    ):
        many = Surface.from_roughness(**numbers, **band, rolloff=rolloffs)
        assert many.shape == (2, 3)
        pressed = contact(many, "100 GPa", pressure="10 MPa")
        for place in ((0, 0), (1, 2)):
            own = {n: v[place[1]] if np.ndim(v) else v for n, v in band.items()}
            one = Surface.from_roughness(**numbers, **own, rolloff=rolloffs[place[0], 0])
            for name in ("q0", "q1", "h_rms", "m2", "m4"):
                found = getattr(many, name)[place]
                assert found == pytest.approx(getattr(one, name), rel=1e-10), name
            wanted = contact(one, "100 GPa", pressure="10 MPa")
            for name in ("area", "mean_separation", "stiffness"):
                found = getattr(pressed, name)[place]
                assert found == pytest.approx(getattr(wanted, name), rel=1e-7), name
    with pytest.raises(
        OutOfRangeError, match=r"rolloff must be between .*got 600.*\(1,\)"
    ):
        Surface.from_roughness(
            **numbers, longest=500.0, shortest=5.0, rolloff=[100.0, 600.0]
        )


def test_the_longest_wave_follows_from_a_spacing_and_a_rolloff():
    numbers = {"Rq": 0.4, "hurst": 0.8, "h_max": 2.0, "shortest": 5.0, "unit": "um"}
    longest = np.array([300.0, 400.0, 700.0])
    rolloff = np.array([[100.0], [50.0]])
    known = Surface.from_roughness(**numbers, longest=longest, rolloff=rolloff)
    # Rice's spacing of upward crossings
    Rsm = 2 * np.pi * known.h_rms / np.sqrt(known.m2)
    found = Surface.from_roughness(**numbers, Rsm=Rsm, rolloff=rolloff)
    np.testing.assert_allclose(2 * np.pi / found.q0 / longest, 1.0, rtol=1e-9)


@pytest.mark.parametrize("lazy", [False, True])
def test_data_arrays_broadcast_by_name(lazy):
    shortest = xr.DataArray([2.0, 3.0], dims="wave")
    heights = xr.DataArray([0.4, 0.5, 0.6], dims="height")
    if lazy:
        pytest.importorskip("dask")
        shortest, heights = shortest.chunk(1), heights.chunk(2)

    def both(q1, h_rms):
        one = Surface(hurst=0.8, q0=0.01, q1=q1, h_rms=0.4, h_max=2.0, unit="um")
        other = Surface(hurst=0.7, q0=0.05, q1=5.0, h_rms=h_rms, h_max=2.0, unit="um")
        return one.combined(other)

    bodies = Bodies("100 GPa", hardness="1 GPa")
    found = contact(both(shortest, heights), bodies, pressure="10 MPa")
    plain = contact(
        both(np.array([[2.0], [3.0]]), np.array([0.4, 0.5, 0.6])),
        bodies,
        pressure="10 MPa",
    )
    assert found.area.dims == ("wave", "height")
    for name in ("area", "mean_separation", "stiffness", "valid", "scatter"):
        labelled = getattr(found, name)
        assert (labelled.chunks is not None) == lazy
        np.testing.assert_allclose(labelled.values, getattr(plain, name), rtol=1e-12)


def test_what_is_of_one_surface_is_refused():
    one = Surface(hurst=0.8, q0=0.01, q1=[2.0, 3.0], h_rms=0.4, h_max=2.0, unit="um")
    other = Surface(hurst=0.7, q0=0.05, q1=5.0, h_rms=0.5, h_max=2.0, unit="um")
    both = one.combined(other)
    with pytest.raises(InputError, match="take one surface at a time"):
        both.sampled()
    q = np.geomspace(0.02, 3.0, 50)
    measured = Surface.from_spectrum(
        q, q**-3.5 * (1 + 0.1 * np.sin(9 * q)), h_max=90.0, convention="paper", unit="um"
    )
    with pytest.raises(InputError, match="combine each entry of the batch with it"):
        one.combined(measured)
    with pytest.raises(InputError, match="do not broadcast"):
        both.combined(Surface(0.8, 0.01, 2.0, [0.3, 0.4, 0.5], 2.0, unit="um"))
    with pytest.raises(OutOfRangeError, match=r"q_low_0 must be below .*got 2 at \(1,\)"):
        BandedSurface([(np.array([0.5, 2.0]), 2.0, 1.0, -3.0)], 1.0)


def test_other_theories_of_batches_are_as_one_by_one():
    one = Surface(hurst=0.8, q0=0.01, q1=[2.0, 3.0], h_rms=0.4, h_max=2.0, unit="um")
    other = Surface(hurst=0.7, q0=0.05, q1=5.0, h_rms=0.5, h_max=2.0, unit="um")
    both = one.combined(other)
    for theory in ("persson", "greenwood_williamson", "mbma"):
        many = contact(both, "100 GPa", pressure="10 MPa", theory=theory)
        alone = Surface(0.8, 0.01, 3.0, 0.4, 2.0, unit="um").combined(other)
        wanted = contact(alone, "100 GPa", pressure="10 MPa", theory=theory)
        for name in ("area", "mean_separation", "stiffness"):
            found = getattr(many, name)[1]
            assert found == pytest.approx(getattr(wanted, name), rel=1e-5), name


def rolled_off(Ra):
    return Surface.from_roughness(
        Ra=Ra, hurst=0.8, longest=800.0, shortest=8.0, rolloff=200.0, h_max=8.0, unit="um"
    )


def with_a_gap(h_rms):
    """No wavelengths between two power laws."""
    long = Surface(0.8, 0.01, 0.05, h_rms, 9.0, unit="um")
    return long.combined(Surface(0.7, 0.5, 5.0, 1.0, 3.0, unit="um"))


def sampled(batch, k):
    """One of a batch by the same samples of its spectrum, by the public route."""
    one = batch.entry((k,))
    return Surface.from_spectrum(
        one.q, one.C, h_max=one.h_max, unit="um", convention="paper"
    )


@pytest.mark.parametrize("made", [rolled_off, with_a_gap])
@pytest.mark.parametrize("bodies", ["100 GPa", Bodies("100 GPa", hardness="2 GPa")])
def test_islands_of_batches_are_those_of_each_spectrum(made, bodies):
    """The paper's model takes all it needs of a surface from the spectrum."""
    batch = made([1.6, 2.0])
    for asked in (
        {"separation": [[4.0], [6.0]]},
        {"pressure": [["10 MPa"], ["20 MPa"]]},
        {"area": [[0.01], [0.02]]},
    ):
        many = contact(batch, bodies, theory="mbma", **asked)
        name, column = next(iter(asked.items()))
        for k in range(2):
            one = {name: [entry for (entry,) in column]}
            alone = contact(sampled(batch, k), bodies, theory="mbma", **one)
            for quantity in ("area", "pressure", "stiffness", "mean_separation"):
                np.testing.assert_allclose(
                    many.quantity(quantity)[:, k], alone.quantity(quantity), rtol=1e-7
                )


@pytest.mark.parametrize("lazy", [False, True])
@pytest.mark.parametrize("rolloff", [{}, {"rolloff": 60.0}], ids=["power law", "rolloff"])
def test_roughness_parameters_are_data_arrays(lazy, rolloff):
    Ra = xr.DataArray([0.3, 0.4], dims="height")
    slope = xr.DataArray([0.1, 0.15, 0.2], dims="slope")
    if lazy:
        pytest.importorskip("dask")
        Ra, slope = Ra.chunk(1), slope.chunk(2)
    rest = {"hurst": 0.8, "longest": 400.0, "nominal_area": 4e8, "unit": "um"} | rolloff
    many = Surface.from_roughness(Ra=Ra, Rdq=slope, **rest)
    plain = Surface.from_roughness(
        Ra=np.array([[0.3], [0.4]]), Rdq=np.array([0.1, 0.15, 0.2]), **rest
    )
    for name in ("q1", "h_rms", "h_max", "m2"):
        found = getattr(many, name)
        assert found.dims == ("height", "slope")
        assert (found.chunks is not None) == lazy
        np.testing.assert_allclose(found.values, getattr(plain, name), rtol=1e-12)
    area = contact(many, "100 GPa", pressure="5 MPa").area
    wanted = contact(plain, "100 GPa", pressure="5 MPa").area
    np.testing.assert_allclose(area.values, wanted, rtol=1e-12)
    assert any("Ra" in line for line in many.provenance[0]["assumed"])


def test_one_sum_of_power_laws_serves_where_samples_do():
    """Islands, derivatives, a fit and the page of one pair are those of its samples."""
    one = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=0.4, h_max=2.0, unit="um")
    other = Surface(hurst=0.7, q0=0.05, q1=5.0, h_rms=0.5, h_max=2.0, unit="um")
    both = one.combined(other)
    samples = both.sampled()
    assert isinstance(both, BandedSurface)
    assert isinstance(samples, MeasuredSurface)
    assert both.fit().hurst == samples.fit().hurst
    assert island(both, 0.1).force == island(samples, 0.1).force
    slopes = [
        sensitivity(each, "100 GPa", pressure="10 MPa", quantities=["area"]).slopes
        for each in (both, samples)
    ]
    for number, row in slopes[1].items():
        # the area does not depend on some of these numbers, and differences have noise
        np.testing.assert_allclose(
            slopes[0][number]["area"], row["area"], rtol=1e-5, atol=1e-9
        )
    assert explorer_page(both) == explorer_page(samples)
