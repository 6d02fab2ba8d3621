"""Lines of `totals` that altered code got past the other tests with."""

import dataclasses
import math

import numpy as np
import pytest
import xarray as xr

from mbma_tables import InputError, OutOfRangeError, Surface, contact
from mbma_tables.surfaces.readings import PRINTED, REPORTED
from mbma_tables.totals import law_kernel
from mbma_tables.totals.conductance import conductance, mean_conductivity
from mbma_tables.totals.gauss_kronrod import integrate
from mbma_tables.totals.island import geometry
from mbma_tables.totals.island_sum import kinks


def test_mean_conductivity_is_harmonic():
    assert mean_conductivity(50.0, 200.0) == pytest.approx(80.0, rel=1e-15, abs=0)
    assert mean_conductivity(3.0, 3.0) == pytest.approx(3.0, rel=1e-15, abs=0)
    # a body that conducts without limit leaves twice the other
    assert mean_conductivity(7.0, 1e300) == pytest.approx(14.0, rel=1e-15, abs=0)
    assert mean_conductivity(1e300, 7.0) == pytest.approx(14.0, rel=1e-15, abs=0)
    found = mean_conductivity([[1.0], [2.0]], [1.0, 4.0, 6.0])
    np.testing.assert_allclose(found, [[1, 1.6, 12 / 7], [4 / 3, 8 / 3, 3]], rtol=1e-15)
    assert np.shape(mean_conductivity(1.0, 2.0)) == ()


def test_conductance_per_stiffness():
    assert conductance(6.0, 5.0, 4.0) == pytest.approx(7.5, rel=1e-15, abs=0)
    found = conductance([0.0, 1.0, 3.0], [[2.0], [8.0]], 4.0)
    np.testing.assert_allclose(found, [[0, 0.5, 1.5], [0, 2, 6]], rtol=1e-15)
    assert np.shape(conductance(6.0, 5.0, 4.0)) == ()


@pytest.mark.parametrize("bad", [0.0, -2.0, math.nan, [1.0, 0.0], [1.0, -1e-300]])
def test_conductivities_and_moduli_are_positive(bad):
    for call, name in (
        (lambda: mean_conductivity(bad, 1.0), "k1"),
        (lambda: mean_conductivity(1.0, bad), "k2"),
        (lambda: conductance(1.0, bad, 1.0), "k_s"),
        (lambda: conductance(1.0, 1.0, bad), "E_star"),
    ):
        with pytest.raises(OutOfRangeError, match=f"^{name} must be") as caught:
            call()
        assert caught.value.mask.shape == np.shape(bad)
        assert caught.value.mask.sum() == 1


def test_conductivities_that_do_not_broadcast():
    with pytest.raises(InputError, match="broadcast"):
        mean_conductivity([1.0, 2.0], [1.0, 2.0, 3.0])
    with pytest.raises(InputError, match="broadcast"):
        conductance([1.0, 2.0], [1.0, 2.0, 3.0], 1.0)


SURFACE = Surface(0.8, 0.3, 60.0, 0.7, 2.1)
OWN = dataclasses.replace(PRINTED, name="own", beta=0.3, phi=0.08, floor_d=1.6, floor_u=3.5)
ROUGH = Surface(0.05, 0.2, 0.2e8, 1.0, 3.0)  # leaves the table where it is pressed


@pytest.mark.parametrize("tier", ["universal", "rigid"])
def test_the_floor_of_zeta_u_itself_is_refused(tier):
    with pytest.raises(OutOfRangeError, match=r"q1/q0 must be greater than 3\.5"):
        contact(Surface(0.8, 1.0, 3.5, 1.0, 3.0), 1.0, tier=tier, reading=OWN)
    assert contact(Surface(0.8, 1.0, math.nextafter(3.5, 4), 1.0, 3.0), 1.0, tier=tier, reading=OWN).force > 0


LABELLED = Surface(xr.DataArray([0.5, 0.8], dims="s"), 0.3, 60.0, 0.7, 2.1)
LABELLED_GAPS = xr.DataArray([-1.0, 0.4, 2.0], dims="d")


@pytest.mark.parametrize("chunked", [False, True])
def test_slopes_of_labelled_surfaces(chunked):
    gaps = LABELLED_GAPS.chunk(d=2) if chunked else LABELLED_GAPS
    found = contact(LABELLED, gaps, E_star=3.0, derivatives=True)
    plain = contact(Surface([[0.5], [0.8]], 0.3, 60.0, 0.7, 2.1), LABELLED_GAPS.values, E_star=3.0, derivatives=True)
    for own, true in ((found.force_by, plain.force_by), (found.area_by, plain.area_by)):
        assert list(own) == list(true)
        for name, slope in own.items():
            np.testing.assert_array_equal(slope.transpose("s", "d"), true[name], err_msg=name)
    np.testing.assert_array_equal(found.mean_separation, plain.mean_separation[0])
    assert found.separation is gaps
    assert found.force.attrs == {"long_name": "force over nominal area", "units": "unit of E_star"}


@pytest.mark.parametrize(("wanted", "other"), [("force", "area"), ("area", "force")])
def test_slopes_of_one_quantity_of_labelled_surfaces(wanted, other):
    found = contact(LABELLED, LABELLED_GAPS, derivatives=True, quantities=[wanted])
    both = contact(LABELLED, LABELLED_GAPS, derivatives=True)
    for name, slope in getattr(both, f"{wanted}_by").items():
        np.testing.assert_array_equal(getattr(found, f"{wanted}_by")[name], slope)
    assert getattr(found, other) is getattr(found, f"{other}_by") is None
    none = contact(LABELLED, LABELLED_GAPS)
    assert none.force_by is none.area_by is None


@pytest.mark.parametrize("rtol", [1e-2, 1e-6, 1e-9, 1e-11])
def test_slopes_refine_as_totals_do(rtol):
    """Two passes over the same integral: the same islands and the same bound."""
    rng = np.random.default_rng(5)
    hurst, top, share = rng.uniform(0.3, 1, 40), rng.uniform(2.5, 4.5, 40), rng.uniform(-1, 1, 40)
    surfaces = Surface(hurst, 0.3, 0.3 * 10 ** rng.uniform(0.5, 4, 40), 0.7, 0.7 * top)
    plain = contact(surfaces, share * surfaces.h_max, rtol=rtol)
    slopes = contact(surfaces, share * surfaces.h_max, rtol=rtol, derivatives=True)
    assert slopes.islands == plain.islands
    np.testing.assert_allclose(slopes.error, plain.error, rtol=1e-6)
    np.testing.assert_allclose(slopes.force, plain.force, rtol=1e-12)
    np.testing.assert_allclose(slopes.area, plain.area, rtol=1e-12)


@pytest.mark.parametrize(("wanted", "other"), [("force", "area"), ("area", "force")])
def test_one_quantity_alone(wanted, other):
    gaps = np.linspace(-2.0, 2.0, 9)
    alone, both = contact(SURFACE, gaps, quantities=[wanted]), contact(SURFACE, gaps)
    np.testing.assert_allclose(getattr(alone, wanted), getattr(both, wanted), rtol=1e-8)
    assert getattr(alone, other) is None


@pytest.mark.parametrize(("offset", "summit_sigma"), [(True, False), (False, True), (False, False)])
def test_slopes_of_readings_of_ones_own(offset, summit_sigma):
    """Each of the two flags by itself, against differences of the totals."""
    own = dataclasses.replace(OWN, offset=offset, summit_sigma=summit_sigma)
    hurst, gap, step = 0.8, 0.4, 1e-4

    def log_totals(hurst, gap):
        found = contact(Surface(hurst, 0.3, 60.0, 0.7, 2.1), gap, reading=own, rtol=1e-10)
        return np.log([found.force, found.area])

    found = contact(SURFACE, gap, reading=own, rtol=1e-10, derivatives=True)
    by_hurst = (log_totals(hurst + step, gap) - log_totals(hurst - step, gap)) / (2 * step)
    by_gap = (log_totals(hurst, gap + step) - log_totals(hurst, gap - step)) / (2 * step)
    for k, (value, by) in enumerate(((found.force, found.force_by), (found.area, found.area_by))):
        assert by["hurst"] / value == pytest.approx(by_hurst[k], rel=1e-5, abs=0)
        assert by["separation"] / value == pytest.approx(by_gap[k], rel=1e-5, abs=0)


ROUGH_GAPS = np.array([2.9999, 0.5, -2.0])  # the last two are outside


@pytest.mark.parametrize("rtol", [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7])
def test_outside_the_table_the_solver_answers_at_any_tolerance(rtol):
    found = contact(ROUGH, ROUGH_GAPS, outside="exact", rtol=rtol)
    true = contact(ROUGH, ROUGH_GAPS[1:], tier="exact", rtol=rtol)
    table = contact(ROUGH, ROUGH_GAPS[0], rtol=rtol)
    for name in ("force", "area", "error"):
        np.testing.assert_array_equal(getattr(found, name), [getattr(table, name), *getattr(true, name)])
    assert found.islands > table.islands + true.islands


def test_the_first_entry_outside_is_named():
    with pytest.raises(OutOfRangeError, match=r"islands of 2 of 3 .* \(h_max - d\)/h_rms = 2\.5 \(mu above"):
        contact(ROUGH, ROUGH_GAPS)


def test_slopes_outside_the_table_are_none():
    with pytest.raises(OutOfRangeError, match="islands of 2 of 3") as caught:
        contact(ROUGH, ROUGH_GAPS, derivatives=True)
    assert caught.value.mask.tolist() == [False, True, True]
    found = contact(ROUGH, ROUGH_GAPS, outside="nan", derivatives=True)
    assert np.isnan(found.force_by["separation"]).tolist() == [False, True, True]


def test_pieces_at_the_ends():
    """What rounds beyond the last break belongs to the last piece."""
    breaks = np.array([0.0, 0.5, 0.7, 2.0])
    places = [0.0, 0.5, math.nextafter(0.5, 1), 0.7, 1.9, 2.0, math.nextafter(2.0, 3)]
    assert [law_kernel._locate(place, breaks) for place in places] == [0, 0, 1, 1, 2, 2, 2]


@pytest.mark.parametrize("width", [3.0, 0.9])
@pytest.mark.parametrize(("which", "power"), [(0, 3.5), (1, 10 / 3)])
def test_a_dip_inside_one_piece_is_a_turning_point(which, power, width):
    """A piece that rises at both ends and falls between them."""
    pieces = np.zeros((1, law_kernel.TERMS, 2))
    pieces[0, [1, 3], which] = -20.0, 8.0
    breaks, layer, h_max = np.array([0.0, width]), 0.4, 50.0
    law = law_kernel.Law(breaks, pieces, breaks, layer, h_max, 1.0)
    tau = np.linspace(1e-3, width, 200_001)
    u = 2 * tau / width - 1
    value = power * np.log(layer * np.sinh(tau) ** 2) - 20 * u + 8 * u**3
    assert np.diff(value)[-1] > 0
    first = np.argmax(np.diff(value) < 0)
    turn = law_kernel.turning_point(which, law, 24)
    assert h_max - layer * math.sinh(tau[first + 1]) ** 2 < turn < h_max - layer * math.sinh(tau[first - 1]) ** 2
    assert law_kernel.turning_point(1 - which, law, 24) is None


@pytest.mark.parametrize("at", np.linspace(-0.77, 0.99, 34))
def test_a_dip_between_two_samples_is_a_turning_point(at):
    """A slope that is 0 but for a millionth of itself: the dip is 100 times narrower than samples are apart."""
    tau = np.linspace(0.02, 0.9, 2_000_001)
    u = tau / 0.45 - 1
    rest = 2 * 3.5 * 0.45 / np.tanh(tau) + 3e3 * (u - at) ** 2
    steepest = rest.min() * (1 + 1e-6)
    pieces = np.zeros((1, law_kernel.TERMS, 2))
    # the integral of 3e3 (u - at)^2 - steepest
    pieces[0, :4, 0] = 0, 3e3 * at**2 - steepest, -3e3 * at, 1e3
    breaks = np.array([0.0, 0.9])
    law = law_kernel.Law(breaks, pieces, breaks, 0.4, 50.0, 1.0)
    falls = tau[rest < steepest]
    assert 0 < np.ptp(falls) < 0.9 / 24 / 10
    turn = law_kernel.turning_point(0, law, 24)
    assert np.arcsinh(np.sqrt((50 - turn) / 0.4)) == pytest.approx(falls[0], rel=1e-5, abs=0)


@pytest.mark.parametrize("reading", [REPORTED, OWN], ids=lambda reading: reading.name)
def test_kinks_are_where_geometry_reaches_its_floors(reading):
    rng = np.random.default_rng(6)
    hurst, zeta_1 = rng.uniform(0.1, 1, 200), 3.51 * 10 ** rng.uniform(0, 7, 200)
    for kink, name, floor in zip(
        kinks(hurst, zeta_1, reading), ("zeta_d", "zeta_u"), (reading.floor_d, reading.floor_u), strict=True
    ):
        before, beyond = (geometry(kink * (1 + sign * 1e-9), hurst, zeta_1, reading)[name] for sign in (-1, 1))
        assert (before > floor).all()
        assert (beyond == floor).all()


def test_the_estimate_is_of_the_kronrod_sum():
    """Not of the Gauss sum, which is far worse: where that one alone misses the tolerance, nothing is halved."""
    x, weights = np.polynomial.legendre.leggauss(10)
    true, gauss = 4 + 0.4 * math.sin(5), weights @ (2 + np.cos(5 * x))
    rtol = abs(gauss / true - 1) / 5
    ends = np.array([-1.0]), np.array([1.0])
    found = integrate(lambda _, points: 2 + np.cos(5 * points)[..., None], np.array([0]), *ends, 1, rtol)
    assert found.evaluations == 21
    assert abs(found.value[0, 0] / true - 1) <= found.error[0, 0] <= rtol
