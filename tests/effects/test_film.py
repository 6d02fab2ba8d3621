"""Flow factors: exact limits, published curves, Reynolds' equation on gaps that no fit saw; its solver."""

import pathlib

import numpy as np
import pytest
from helpers import random_map, refusals

from generate.pages.simulations import PATIR_CHENG, published
from mbma_tables import InputError, Surface, contact, flow_factors
from mbma_tables.contacts.quantities.effective_medium import FlowConstants
from mbma_tables.contacts.quantities.lay import factors
from mbma_tables.theories import BoundaryElements
from mbma_tables.theories.simulated.reynolds import (
    flow_and_couette,
    flow_conductance,
    open_ways,
)

STATUS = pathlib.Path("/proc/self/status")
BEARING = Surface(hurst=0.8, q0=0.05, q1=1.5, h_rms=0.5, h_max=1.75, unit="um")


def test_wide_gaps_have_the_known_expansion():
    u = np.array([30.0, 60.0])
    for gamma in (1 / 8, 0.5, 1.0, 4.0):
        ratio, shear = factors(u, np.zeros(2), gamma, FlowConstants())
        plain, _ = factors(u, np.zeros(2), 1.0, FlowConstants())
        for k, c in enumerate((1 / (1 + gamma), gamma / (1 + gamma))):
            expanded = (1 - 1.5 / u**2) * ratio[k] / plain[k]
            np.testing.assert_allclose(
                expanded, 1 + 3 * (1 - 3 * c) / u**2, atol=30 / 30**4
            )
            np.testing.assert_allclose(shear[k] * u, 3 * c, rtol=0.01)


def test_ridges_are_the_averages_of_one_dimension():
    h = 1 + 0.5 * np.sin(np.linspace(0, 2 * np.pi, 64, endpoint=False))
    K, couette = flow_and_couette(np.repeat(h[:, None], 3, 1))
    np.testing.assert_allclose(K, [1 / np.mean(h**-3.0), np.mean(h**3)])
    np.testing.assert_allclose(couette, [np.mean(h**-2.0) / np.mean(h**-3.0), np.mean(h)])


@pytest.mark.parametrize("gamma", PATIR_CHENG)
def test_published_curves(gamma):
    """Fits to simulations of 20 x 20 points; within 8% of theirs from h = 3 h_rms on."""
    H = np.array([3.0, 4.0, 6.0])
    peklenik = min(max(gamma, 1 / 8.5), 8.5)
    found = flow_factors(Surface(0.8, 0.05, 1.5, 1.0, 2.9), H, peklenik=peklenik).phi_x
    np.testing.assert_allclose(found, published(gamma, H), rtol=0.08)


def test_reynolds_on_a_stretched_surface_that_no_fit_saw():
    rng = np.random.default_rng(5)
    n = 256
    lay = 3.0
    q = np.meshgrid(*2 * [np.fft.fftfreq(n)], indexing="ij")
    length = np.hypot(q[0] * lay, q[1])
    amplitude = np.where(
        (length > 1 / 32) & (np.hypot(*q) < 1 / 8), np.maximum(length, 1 / 32) ** -1.8, 0
    )
    z = np.fft.ifft2(np.fft.fft2(rng.standard_normal((n, n))) * amplitude).real
    z /= z.std()
    surface = Surface.from_map(z - z.mean(), dx=1.0, periodic=True, detrend="mean")
    u = np.array([1.01, 1.5]) * float(surface.h_max)
    found = flow_factors(surface, u)
    assert found.peklenik == pytest.approx(lay, rel=0.5)
    for k, gap in enumerate(u):
        K, couette = flow_and_couette(gap - z, (n, n))
        assert abs(np.log([found.phi_x[k], found.phi_y[k]] / (K / gap**3))).max() < 0.1
        assert (
            abs(
                np.log([found.shear_x[k], found.shear_y[k]] / ((gap - couette) / z.std()))
            ).max()
            < 0.35
        )


def test_the_asperity_pressure_is_as_valid_as_that_of_the_contact():
    """Flow through the lightest contacts is nearly that before contact; their pressure was not simulated."""
    u = np.array([0.8, 1.0, 1.5, 1.7])
    found = flow_factors(BEARING, u, "110 GPa", theory="calibrated")
    known = contact(BEARING, "110 GPa", mean_separation=u, theory="calibrated")
    assert found.valid.all()
    np.testing.assert_array_equal(found.pressure_valid, known.valid)
    assert list(found.pressure_valid) == [True, True, False, False]
    np.testing.assert_array_equal(found.pressure_scatter, known.scatter)


def test_isotropic_factors_are_those_of_the_leakage():
    u = np.array([0.6, 1.0, 1.7, 4.0])
    found = flow_factors(BEARING, u, "110 GPa")
    known = contact(BEARING, "110 GPa", mean_separation=u, theory="calibrated")
    np.testing.assert_allclose(found.phi_x, known.leakage.flow_factor)
    np.testing.assert_array_equal(found.phi_x, found.phi_y)
    np.testing.assert_array_equal(found.pressure, known.pressure)
    assert found.pressure[-1] == 0
    assert found.valid.all()


def test_factors_are_continuous_at_first_contact():
    h_max = float(BEARING.h_max)
    found = flow_factors(BEARING, h_max * np.array([1 - 1e-9, 1 + 1e-9]), peklenik=3)
    assert found.area[0] > found.area[1] == 0
    for name in ("phi_x", "phi_y", "shear_x", "shear_y"):
        np.testing.assert_allclose(*getattr(found, name), rtol=1e-5, err_msg=name)


def test_a_lay_turned_by_a_right_angle():
    u = np.linspace(0.6, 4, 9)
    one, other = (flow_factors(BEARING, u, peklenik=gamma) for gamma in (3.0, 1 / 3))
    np.testing.assert_allclose(one.phi_x, other.phi_y, rtol=1e-9)
    np.testing.assert_allclose(one.shear_y, other.shear_x, rtol=1e-9)
    assert (one.phi_x > one.phi_y).all()


@pytest.fixture(scope="module")
def own_map():
    """A map of 96 x 96 points, and its factors by its own simulation at 60 gaps."""
    pytest.importorskip("tamaas")
    z = random_map(96, 1 / 34, 1 / 6, power=0, seed=8)
    face = Surface.from_map(z / z.std(), dx=1.0, periodic=True, detrend="mean")
    return face, flow_factors(face, np.geomspace(0.6, 10, 60), theory="simulated")


@pytest.mark.slow
def test_factors_of_a_simulated_map_are_those_of_its_gaps(own_map):
    """Between their knots too."""
    face, film = own_map
    z = face.map.heights - face.map.heights.mean()
    for k in (8, 17, 26, 35, 44, 53):
        u = film.mean_separation[k]
        found = contact(face, mean_separation=u, theory="simulated")
        gap = u - z if u > z.max() else found.map().gap
        assert gap.mean() == pytest.approx(u, rel=0.01)
        K, couette = flow_and_couette(gap, gap.shape)
        phi = [film.phi_x[k], film.phi_y[k]]
        shear = [film.shear_x[k], film.shear_y[k]]
        deep = found.area > 0.05
        np.testing.assert_allclose(phi, K / gap.mean() ** 3, rtol=0.2 if deep else 0.02)
        np.testing.assert_allclose(shear, gap.mean() - couette, rtol=0.02)
        assert np.all(
            np.abs(np.log(phi / (K / gap.mean() ** 3))) < 3 * film.scatter[k] + 0.01
        )


@pytest.mark.slow
def test_a_simulated_map_continued_by_its_images_and_what_is_refused(own_map):
    face, film = own_map
    assert film.pressure[-1] == 0 < film.pressure[0]
    alone = flow_factors(face, film.mean_separation[50:], theory="simulated")
    np.testing.assert_allclose(alone.phi_x, film.phi_x[50:], rtol=2e-3)
    u = 4.0
    whole = Surface.from_map(face.map.heights, dx=1.0, periodic=False, detrend="mean")
    z = whole.map.heights - whole.map.heights.mean()
    K, couette = flow_and_couette(
        u - np.block([[z, z[:, ::-1]], [z[::-1], z[::-1, ::-1]]]), (192, 192)
    )
    found = flow_factors(whole, [u], theory="simulated")
    np.testing.assert_allclose([found.phi_x[0], found.phi_y[0]], K / u**3, rtol=1e-4)
    np.testing.assert_allclose(
        [found.shear_x[0], found.shear_y[0]], (u - couette) / whole.h_rms, rtol=1e-4
    )
    with pytest.raises(InputError, match="peklenik"):
        flow_factors(face, 1.0, theory=BoundaryElements.of(face), peklenik=2.0)


test_what_is_refused = refusals(
    lambda face, u, more: flow_factors(face, u, **more),
    (BEARING, 0.01, {}, "mean_separation"),
    (Surface(0.8, 0.05, 1.5, [0.5, 0.6], 1.75), 1.0, {}, "batch"),
    (BEARING, 1.0, {"peklenik": 20.0}, "peklenik"),
    (BEARING, 1.0, {"theory": "simulated"}, "height map"),
)


def test_units_and_what_is_not_valid(tmp_path):
    film = flow_factors(BEARING, ["1 um", "2000 nm"], "110 GPa", peklenik=2.0)
    data = film.to_dataset()
    assert (data["K_x"].attrs["units"], data["pressure"].attrs["units"]) == (
        "um^3",
        "GPa",
    )
    film.plot(tmp_path / "film.svg")
    deep = flow_factors(BEARING, [0.2], peklenik=8.0)
    assert not deep.valid[0]
    assert any("uncertainty" in reason for reason in deep.reasons)


def test_scale_of_gaps_and_sides():
    gap = np.exp(0.3 * np.random.default_rng(1).standard_normal((20, 40)))
    first = flow_conductance(gap, (1.0, 2.0))
    np.testing.assert_allclose(
        flow_conductance(1e-3 * gap, (3.0, 6.0)), 1e-9 * first, rtol=1e-10
    )
    np.testing.assert_allclose(
        flow_conductance(gap.T, (2.0, 1.0)), first[::-1], rtol=1e-10
    )


def test_a_dam_blocks_one_way():
    gap = np.ones((16, 16))
    gap[5] = 0
    np.testing.assert_allclose(flow_conductance(gap), [0.0, 15 / 16], rtol=1e-12)
    gap[:, 7] = 0
    assert flow_conductance(gap).tolist() == [0.0, 0.0]


def test_a_slanted_channel_is_open_both_ways():
    # steps of one along x and y in turn: 32 faces in series
    gap = np.zeros((16, 16))
    for i in range(16):
        gap[i, i] = gap[i, (i + 1) % 16] = 1.0
    assert open_ways(gap)[1] == (True, True)
    np.testing.assert_allclose(flow_conductance(gap), 1 / 32, rtol=1e-12)


def test_dead_ends_carry_nothing():
    gap = np.zeros((16, 16))
    gap[:, 3] = 1.0
    straight = flow_conductance(gap)
    # a branch, and a hole that leads nowhere
    gap[4, 3:9] = gap[10:13, 10:13] = 5.0
    gap[4, 3] = 1.0
    assert (open_ways(gap)[0] > 0).sum() == 16 + 5
    np.testing.assert_allclose(flow_conductance(gap), straight, rtol=1e-12)


@pytest.mark.slow
def test_another_solver():
    transport = pytest.importorskip("reynoldsflow.transport")
    field = random_map(64, 1.99 / 64, 12.01 / 64, power=0, seed=3)
    # 5% and 30% of the points touch
    for level, touching in ((1.6, 0.055), (0.5, 0.31)):
        gap = np.maximum(field / field.std() + level, 0)
        assert np.mean(gap == 0) == pytest.approx(touching, abs=0.03)
        for axis, values in enumerate((gap, gap.T)):
            kept, _, flux = transport.solve_fluid_problem(
                values, "scipy-spsolve", boundary_mode="periodic"
            )
            theirs, _ = transport.compute_total_flux(kept, flux, 64, "periodic")
            assert flow_conductance(gap)[axis] == pytest.approx(theirs, rel=1e-6)


test_no_gaps = refusals(
    flow_conductance,
    (np.ones(4), "gap must be a grid"),
    (np.full((4, 4), -1.0), "gap must be at least 0"),
    (np.full((4, 4), np.nan), "gap must be finite"),
)


@pytest.mark.skipif(not STATUS.exists(), reason="resident memory is read from /proc")
def test_factors_of_many_gaps_are_freed():
    def resident() -> int:
        lines = STATUS.read_text("utf-8").splitlines()
        line = next(line for line in lines if line.startswith("VmRSS"))
        return int(line.split()[1])  # kB

    gap = np.random.default_rng(3).uniform(0.5, 1.5, (128, 128))
    flow_conductance(gap)
    before = resident()
    for _ in range(5):
        flow_conductance(gap)
    # the factors of one such grid have 12 MB
    assert resident() - before < 12e3
