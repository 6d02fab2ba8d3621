"""Surfaces given by a spectrum: moments, heights, two surfaces as one, the shortest waves, averages of scans."""

import dataclasses
import json
import math

import mpmath
import numpy as np
import pytest
import xarray as xr
from helpers import random_map, refusals, run
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import mutually_broadcastable_shapes

from generate.machined.makers import rough
from mbma_tables import Bodies, InputError, Surface, contact, contact_law
from mbma_tables.contacts.quantities.leakage import shipped_flow
from mbma_tables.export.rows.law_rows import describe_law
from mbma_tables.surfaces.averages import average
from mbma_tables.surfaces.heights import SHARES, Heights
from mbma_tables.surfaces.maps import extrapolated
from mbma_tables.surfaces.spectrum import PowerLaws
from mbma_tables.surfaces.surface import MeasuredSurface, assumptions

FIVE = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.5, h_max=4.0)
# a plateau, a rise, a jump and a gap
Q = np.array([0.5, 1.0, 2.0, 2.0, 3.0, 5.0, 8.0, 20.0, 40.0])
C = np.array([3.0, 3.0, 4.0, 2.0, 0.5, 0.0, 1e-2, 1e-3, 5e-5])
MOMENTS = (
    "h_rms",
    "m0",
    "m2",
    "m4",
    "alpha",
    "rms_gradient",
    "summit_density",
    "summit_radius",
    "summit_sigma",
)


def integral(order: int, low: float, high: float) -> float:
    """m_n by mpmath's quadrature over the pieces of Q, C."""
    share = {0: 1, 2: 0.5, 4: 0.375}[order]
    total = mpmath.mpf(0)
    for a, b, first, last in zip(Q[:-1], Q[1:], C[:-1], C[1:], strict=True):
        start = max(a, low)
        end = min(b, high)
        if b > a and first > 0 and last > 0 and end > start:
            power = math.log(last / first) / math.log(b / a)
            total += mpmath.quad(
                lambda q, a=a, first=first, power=power: (
                    first * (q / a) ** power * q ** (order + 1)
                ),
                [start, end],
            )
    return float(2 * mpmath.pi * share * total)


class TestPowerLaws:
    def test_moments_of_bands_are_integrals(self):
        laws = PowerLaws(Q, C)
        for order in (0, 2, 4):
            assert laws.moment(order) == pytest.approx(integral(order, 0, 99), rel=1e-13)
            for low, high in [
                (0.6, 0.9),
                (0.7, 2.5),
                (1.5, 30.0),
                (9.0, 40.0),
                (30.0, 30.001),
            ]:
                a = laws.place(low)
                b = laws.place(high)
                assert laws.between(order, a, b) == pytest.approx(
                    integral(order, low, high), rel=1e-10
                )
                assert laws.below(order, b) == pytest.approx(
                    integral(order, 0, high), rel=1e-12
                )
        assert laws.above(laws.place(10.0)) == pytest.approx(
            integral(0, 10, 99), rel=1e-12
        )

    @given(st.floats(-300, 0))
    def test_variance_above_is_inverted_down_to_nothing(self, log_share: float):
        laws = PowerLaws(Q, C)
        wanted = laws.moment(0) * math.exp(log_share)
        place = laws.where_above_is(wanted)
        assert laws.above(place) == pytest.approx(wanted, rel=1e-12)
        assert Q[0] <= math.exp(laws.log_q(place)) * (1 + 1e-15)


class TestMeasuredSurface:
    @pytest.mark.parametrize("count", [2, 3, 50])
    def test_samples_of_a_self_affine_spectrum_are_that_surface(self, count: int):
        q = np.geomspace(FIVE.q0, FIVE.q1, count)
        found = Surface.from_spectrum(q[::-1], FIVE.power_spectrum(q)[::-1], h_max=4.0)
        for name in MOMENTS:
            assert getattr(found, name) == pytest.approx(
                getattr(FIVE, name), rel=1e-12
            ), name
        assert found.hurst == pytest.approx(0.8, rel=1e-12)
        other = Surface.from_spectrum(
            q, 4 * np.pi**2 * FIVE.power_spectrum(q), h_max=4.0, convention="isotropic"
        )
        assert other.h_rms == pytest.approx(found.h_rms, rel=1e-14)
        assert found.fit().hurst == pytest.approx(0.8, rel=1e-6) if count > 10 else True
        assert (found.shape, found.labelled, found.skewness, found.kurtosis) == (
            (),
            False,
            0,
            3,
        )

    test_what_is_no_spectrum_is_refused = staticmethod(
        refusals(
            lambda q, c, options: Surface.from_spectrum(q, c, **options),
            (Q, C, {}, "h_max is missing"),
            (Q, -C, {"h_max": 1.0}, "C must be zero or positive"),
            (
                Q,
                np.where(Q == 1, np.nan, C),
                {"h_max": 1.0},
                r"C must be finite, got nan at \(1,\)",
            ),
            (Q - 0.5, C, {"h_max": 1.0}, "leave q = 0 out"),
            (Q[:3], C[:2], {"h_max": 1.0}, "two columns of one length"),
            (
                Q.reshape(3, 3),
                C.reshape(3, 3),
                {"h_max": 1.0},
                "two columns of one length",
            ),
            (Q[:1], C[:1], {"h_max": 1.0}, "the spectrum has one wavenumber"),
            ([1.0, 2.0], [1.0, 1.0], {"h_max": 1.0}, "greater than 3"),
            ([1.0, 9.0], [0.0, 0.0], {"h_max": 1.0}, "holds no height"),
            ([1.0, 9.0, 99.0], [1.0, 0.0, 1.0], {"h_max": 1.0}, "holds no height"),
            (Q, C, {"h_max": -1.0}, "h_max must be positive"),
            (Q, C, {"heights": np.ones(9)}, "heights are all the same"),
            (Q, C, {"h_max": 1.0, "convention": "profile"}, "no convention is named"),
        )
    )


class TestCombined:
    def test_spectra_add(self):
        other = Surface(hurst=0.6, q0=0.05, q1=7.0, h_rms=0.5, h_max=2.0)
        both = FIVE.combined(other)
        for name in ("m0", "m2", "m4"):
            assert getattr(both, name) == pytest.approx(
                getattr(FIVE, name) + getattr(other, name), rel=1e-6
            )
        q = np.array([0.02, 0.05001, 1.0, 1.9999, 2.001, 6.0])
        assert both.power_spectrum(q) == pytest.approx(
            FIVE.power_spectrum(q) + other.power_spectrum(q), rel=1e-5
        )
        assert both.h_max == pytest.approx(math.hypot(4.0, 2.0))
        back = other.combined(FIVE)
        assert back.m4 == pytest.approx(both.m4, rel=1e-12)

    def test_a_sum_may_be_added_to(self):
        twice = FIVE.combined(FIVE)
        thrice = twice.combined(FIVE)
        assert thrice.m2 == pytest.approx(3 * FIVE.m2, rel=1e-9)
        assert thrice.hurst == pytest.approx(0.8, rel=1e-6)

    @pytest.mark.parametrize("law", ["exponential", "uniform", "normal"])
    def test_heights_convolve(self, law: str):
        rng = np.random.default_rng(5)
        x = rng.normal(size=200_000)
        y = getattr(rng, law)(size=200_000)
        found = Heights.of(x).convolved(Heights.of(y))
        truth = Heights.of(x + y)
        middle = (SHARES > 0.001) & (SHARES < 0.999)
        assert (
            np.abs(found.quantiles - truth.quantiles)[middle].max() < 0.03 * truth.h_rms
        )
        assert found.h_max == pytest.approx(
            truth.h_max, rel=0.15
        )  # the highest of many: chance
        assert found.skewness == pytest.approx(truth.skewness, abs=0.02)
        assert found.kurtosis == pytest.approx(truth.kurtosis, abs=0.1)

    def test_what_two_maps_do_not_keep_is_told(self):
        rng = np.random.default_rng(2)
        one, other = (
            Surface.from_map(rng.normal(size=(40, 40)), 1.0, step, periodic=True)
            for step in (2.0, 3.0)
        )
        both = one.combined(other)
        assert both.bearing is None
        assert (
            "the relative position of the maps is not known" in both.provenance[0]["told"]
        )
        # parallel lays: gradients' mean squares add along both axes
        square = np.array([one.anisotropy, other.anisotropy]) ** 2
        m2 = np.array([one.m2, other.m2])
        assert both.anisotropy == pytest.approx(
            np.sqrt(m2 @ (square / (1 + square)) / (m2 @ (1 / (1 + square))))
        )
        assert one.combined(FIVE).anisotropy < one.anisotropy
        broad = dataclasses.replace(FIVE, q1=2 * FIVE.q1)
        assert FIVE.combined(broad).anisotropy is None

    @pytest.mark.parametrize("theory", ["calibrated", "persson", "mbma"])
    @pytest.mark.parametrize(
        ("hurst", "q1", "area"), [(0.8, 2.0, None), (0.5, 1.28, 4e6), (0.3, 1.0, None)]
    )
    def test_a_common_band_gives_the_numbers_of_the_spectral_sum(
        self, hurst: float, q1: float, area: float | None, theory: str
    ):
        """Five numbers answer as the sum of both spectra does, within the errors that both state."""
        one = Surface(hurst, 0.01, q1, 3.0, 11.0, unit="um")
        other = Surface(hurst, 10.0, 1e3 * q1, 0.8e-3, 3.5e-3, unit="mm")
        both = one.combined(other, area)
        assert isinstance(both, Surface)
        assert both.unit == "um"
        spectral = one.sampled().added(other.to("um").sampled())
        if area is not None:
            spectral = dataclasses.replace(spectral, h_max=None, nominal_area=area)
        for name in ("h_rms", "h_max", "q0", "q1", "m2", "m4"):
            known = getattr(spectral, name)
            assert getattr(both, name) == pytest.approx(known, rel=1e-10), name
        gaps = np.array([0.02, 0.1, 0.3, 0.5, 0.7, 0.9]) * both.h_max
        for bodies in (
            Bodies("60 GPa"),
            Bodies("60 GPa", hardness="1.5 GPa", conductivity="50 W/(m K)"),
        ):
            found, known = (
                contact(surface, bodies, mean_separation=gaps, theory=theory)
                for surface in (both, spectral)
            )
            within = found.error + known.error + 1e-10
            for name in ("pressure", "area"):
                ratio = getattr(found, name) / getattr(known, name)
                assert (np.abs(ratio - 1) <= within).all(), name
            np.testing.assert_array_equal(found.valid, known.valid)
            assert {reason: mask.tolist() for reason, mask in found.reasons.items()} == {
                reason: mask.tolist() for reason, mask in known.reasons.items()
            }
            np.testing.assert_allclose(found.scatter, known.scatter, rtol=1e-5)
            flows = found.leakage.K, known.leakage.K
            np.testing.assert_allclose(*flows, rtol=math.expm1(shipped_flow().error))

    def test_a_common_band_keeps_what_both_faces_assume_and_doubt(self):
        numbers = {"hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
        ground = Surface.from_roughness(
            Rq="0.4 um", h_max="2 um", process="ground", **numbers
        )
        plain = Surface.from_roughness(Ra="0.7 um", h_max="3 um", **numbers)
        both = ground.combined(plain)
        assert isinstance(both, Surface)
        spectral = ground.sampled().added(plain.sampled())
        assert both.provenance == spectral.provenance
        assert both.doubts == spectral.doubts
        assert both.doubts
        assert both.departures() == spectral.departures()
        assert assumptions(both) == assumptions(spectral)

    @given(
        of_one=mutually_broadcastable_shapes(num_shapes=2, max_dims=2, max_side=3),
        seed=st.integers(0, 2**32 - 1),
    )
    def test_batches_are_sums_of_their_entries(self, of_one, seed: int):
        rng = np.random.default_rng(seed)
        tops, areas = of_one.input_shapes
        one = Surface(
            rng.uniform(0.3, 1.0, tops[-1:]), 0.01, 2.0, rng.uniform(1, 2, tops), 9.0
        )
        hurst = np.broadcast_to(one.hurst, of_one.result_shape)
        other = Surface(hurst, 0.01, 2.0, rng.uniform(1, 2, areas), 7.0)
        both = one.combined(other)
        assert both.shape == of_one.result_shape
        for place in np.ndindex(both.shape):
            first, second, known = (
                Surface(
                    *(
                        np.broadcast_to(getattr(surface, name), both.shape)[place]
                        for name in surface.parameters
                    )
                )
                for surface in (one, other, both)
            )
            alone = first.combined(second)
            assert all(getattr(alone, n) == getattr(known, n) for n in alone.parameters)

    def test_labelled_batches_keep_their_names(self):
        heights = xr.DataArray([1.0, 2.0], dims="ground")
        one = dataclasses.replace(FIVE, h_rms=heights)
        other = dataclasses.replace(
            FIVE, h_rms=xr.DataArray([0.5, 0.7, 0.9], dims="milled").chunk(milled=1)
        )
        both = one.combined(other)
        assert both.h_rms.sizes == {"ground": 2, "milled": 3}
        assert both.h_rms.chunks is not None
        expected = np.hypot([[1.0], [2.0]], [0.5, 0.7, 0.9])
        np.testing.assert_array_equal(both.h_rms.compute(), expected)
        with pytest.raises(InputError, match="beside DataArrays"):
            one.combined(dataclasses.replace(FIVE, h_rms=np.array([1.0, 2.0])))
        narrow = dataclasses.replace(other, q1=1.0)
        np.testing.assert_allclose(one.combined(narrow).h_rms.compute(), expected)

    def test_a_batch_of_other_bands_is_that_of_each(self):
        both = Surface([0.5, 0.8], 0.01, 2.0, 1.5, 4.0).combined(FIVE)
        for number, hurst in enumerate((0.5, 0.8)):
            one = Surface(hurst, 0.01, 2.0, 1.5, 4.0).combined(FIVE)
            # that of one joint is of a sampled spectrum
            assert both.h_rms[number] == pytest.approx(one.h_rms, rel=1e-5)
            assert both.rms_gradient[number] == pytest.approx(one.rms_gradient, rel=1e-4)

    def test_batches_that_do_not_broadcast_are_refused(self):
        with pytest.raises(InputError, match="do not broadcast"):
            Surface(0.8, 0.01, 2.0, [1.5, 1.6], 4.0).combined(
                Surface(0.8, 0.01, 2.0, [1.5, 1.6, 1.7], 4.0)
            )


def test_a_map_is_its_own_spectrum():
    heights = random_map(128, 0, 1)
    found = Surface.from_map(heights, dx=0.5, periodic=True, model="measured")
    assert isinstance(found, MeasuredSurface)
    assert found.h_rms == pytest.approx(heights.std(), rel=1e-12)
    assert found.h_max == pytest.approx(heights.max() - heights.mean(), rel=1e-9)
    # the spectrum ends at the Nyquist circle, the map's corners hold waves beyond
    assert found.rms_gradient == pytest.approx(found.bearing.gradient, rel=0.05)
    assert [step["step"] for step in found.provenance] == [
        "read",
        "detrend",
        "edges",
        "resolution",
    ]
    assert found.fit().hurst == pytest.approx(0.8, abs=0.05)


WHOLE = Surface(0.7, 1.0, 400.0, 0.3, 1.0)


def measured(end):
    q = np.geomspace(1.0, end, 120)
    return Surface.from_spectrum(
        q, WHOLE.power_spectrum(q * (1 - 1e-12)), h_max=1.0, unit="um"
    )


def test_the_last_octave():
    found = measured(100.0).resolved().provenance[-1]
    assert found["shortest"] == pytest.approx(2 * np.pi / 100)
    expected = float(measured(50.0).rms_gradient / measured(100.0).rms_gradient)
    assert found["gradient_without_last_octave"] == pytest.approx(expected, rel=1e-3)
    assert f"the rms gradient would be {expected:.2f} times as large" in found["told"]


def test_waves_that_hold_no_power_are_not_known():
    q = np.geomspace(1.0, 400.0, 200)
    C = WHOLE.power_spectrum(q * (1 - 1e-12)) * np.where(q > 100, 1e-6, 1.0)
    sampled = Surface.from_spectrum(q, C, h_max=1.0, unit="um")
    found, known = (
        surface.resolved().provenance[-1] for surface in (sampled, measured(100.0))
    )
    assert found["shortest"] == pytest.approx(2 * np.pi / 100, rel=0.04)
    assert found["gradient_without_last_octave"] == pytest.approx(
        known["gradient_without_last_octave"], rel=0.02
    )
    assert "(sampled to 0.01571 um, without power there)" in found["told"]


def test_the_true_power_law_gives_the_whole_surface_back():
    longer = extrapolated(measured(50.0), 2 * np.pi / 400, 0.7)
    assert longer.rms_gradient == pytest.approx(WHOLE.rms_gradient, rel=2e-3)
    assert longer.m4 == pytest.approx(WHOLE.m4, rel=4e-3)
    assert longer.q1 == pytest.approx(400.0)
    record = longer.provenance[-1]
    assert record["area"] == pytest.approx(
        float(measured(50.0).rms_gradient / WHOLE.rms_gradient), rel=2e-3
    )
    assert "which was not measured" in record["told"]


def test_every_answer_of_a_map_says_so():
    heights = 0.05 * random_map(64, 0.02, 0.4)
    told = "area depends on resolution: wavelengths are known down to"
    for model in ("measured", "self-affine"):
        surface = Surface.from_map(heights, 1.0, periodic=True, unit="um", model=model)
        rows = describe_law(surface, "1 GPa", rows=10, theory="calibrated")
        assert any(told in line for line in rows.comments)
        answers = [
            contact(surface, pressure=0.01),
            contact_law(surface, theory="persson"),
        ]
        answers.append(contact(surface.combined(WHOLE.scaled(1.0, "um")), pressure=0.01))
        for found in answers:
            assert told in repr(found)
            assert told in found.to_dataset().attrs["resolution"]
    longer = Surface.from_map(
        heights, 1.0, periodic=True, extrapolate_to=0.5, extrapolate_hurst=0.8
    )
    assert "which was not measured" in repr(contact(longer, pressure=0.01))
    assert "resolution" not in repr(contact(WHOLE, pressure=0.01))


test_what_was_measured_is_not_replaced = refusals(
    lambda shortest, hurst: extrapolated(measured(50.0), shortest, hurst),
    (1.0, 0.7, "must be below the shortest measured wavelength"),
    (0.01, 1.7, "extrapolate_hurst must be a number"),
)


class TestScans:
    @pytest.fixture(scope="class")
    @staticmethod
    def scans():
        whole = 0.3 * rough(np.random.default_rng(5), 256, 32, 6.0, 0.8)
        corners = [(i, j) for i in (0, 64, 128, 192) for j in (0, 64, 128, 192)]
        maps = [whole[i : i + 64, j : j + 64] for i, j in corners]
        return Surface.from_map(whole, 1.0, periodic=True, unit="um"), [
            Surface.from_map(part, 1.0, detrend="mean", unit="um") for part in maps
        ]

    def test_their_average_is_nearer_than_one(self, scans):
        whole, parts = scans
        mean = average(parts)
        known = contact(whole, area=[0.03, 0.2], theory="calibrated")
        found = contact(mean, pressure=known.pressure)
        each = np.array(
            [
                contact(one, pressure=known.pressure, theory="calibrated").area
                for one in parts
            ]
        )
        assert found.theory == "calibrated"
        assert (
            np.abs(np.log(found.area / known.area))
            < np.sqrt(np.mean(np.log(each / known.area) ** 2, axis=0))
        ).all()
        assert "average of 16 scans: h_rms" in mean.provenance[0]["told"]
        assert mean.h_rms == pytest.approx(float(whole.h_rms), rel=0.1)

    def test_their_spread_adds_to_the_scatter(self, scans):
        parts = scans[1][:4]
        areas = [0.03, 0.2]
        names = ("scatter", "area_scatter", "stiffness_scatter")
        mean = average(parts)
        found, alone = (
            contact(one, area=areas)
            for one in (mean, dataclasses.replace(mean, scans=()))
        )
        each = [
            contact(one, pressure=found.pressure, theory="calibrated") for one in parts
        ]
        # of ln F at equal u, and of the others at equal F
        pressure = [
            one.mean_separation * found.stiffness / found.pressure for one in each
        ]
        logs = np.log([[one.area for one in each], [one.stiffness for one in each]])
        expected = np.std([pressure, *logs], axis=1, ddof=1)
        added = [
            np.sqrt(getattr(found, name) ** 2 - getattr(alone, name) ** 2)
            for name in names
        ]
        np.testing.assert_allclose(added, expected, rtol=1e-3)
        assert (expected > 0.01).all()
        twice, once = (
            contact(one, area=areas, theory="calibrated")
            for one in (average(2 * parts[:1]), parts[0])
        )
        for name in names:
            np.testing.assert_allclose(
                getattr(twice, name), getattr(once, name), rtol=1e-6
            )

    def test_the_average_of_one_scan_twice_is_that_scan(self, scans):
        one = scans[1][0]
        both = average([one, one.to("mm")])
        for theory in ("calibrated", "persson"):
            known = contact(one, pressure=0.01, theory=theory)
            found = contact(both, pressure=0.01, theory=theory)
            assert found.area == pytest.approx(known.area, rel=1e-3)
            assert found.mean_separation == pytest.approx(known.mean_separation, rel=1e-3)
        assert (both.skewness, both.kurtosis) == (
            pytest.approx(one.skewness),
            pytest.approx(one.kurtosis),
        )

    def test_refusals(self, scans):
        whole, parts = scans
        for wrong in (
            [whole],
            [whole, Surface(0.8, 0.1, 2.0, 1.0, 3.0)],
            [average(parts), whole],
        ):
            with pytest.raises(InputError, match="two or more"):
                average(wrong)
        with pytest.raises(InputError, match="some do not"):
            average([whole, Surface.from_map(0.3 * random_map(64, 0.1, 0.3), 1.0)])

    def test_on_the_command_line(self, tmp_path):
        for seed in (1, 2):
            np.save(
                tmp_path / f"{seed}.npy", 0.02 * random_map(64, 0.05, 0.25, seed=seed)
            )
        words = ("--dx", "1um", "--periodic", "--json")
        found = json.loads(run("fit", tmp_path / "1.npy", tmp_path / "2.npy", *words))
        assert found["provenance"][0]["told"].startswith("average of 2 scans")
        one = json.loads(run("fit", tmp_path / "1.npy", *words))
        values = np.load(tmp_path / "1.npy")
        assert one["areal"]["Sq"] == pytest.approx(values.std(), rel=1e-6)
        assert "core [um]: Sk" in run(
            "fit", tmp_path / "1.npy", "--dx", "1um", "--periodic"
        )
