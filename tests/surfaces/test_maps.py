"""Surfaces from spectra and maps: known surfaces come back, everything else is refused with its reason."""

import functools
import math
import sys
import types

import numpy as np
import pytest
from helpers import refusals, topographies
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mbma_tables import Surface, contact
from mbma_tables.common.errors import (
    InputError,
    MbmaError,
    NotSelfAffineError,
    OutOfRangeError,
)
from mbma_tables.surfaces.maps import radial_spectrum
from mbma_tables.surfaces.measurements import read_measurement

from_map = functools.partial(Surface.from_map, model="self-affine")

SIDE = 2 * math.pi  # so that wavenumbers are whole numbers
POINTS = 256
STEP = SIDE / POINTS


def synthetic(surface, points=POINTS, *, seed=0, plateau=False, gaussian=False):
    """A periodic map of side 2 pi with that spectrum and random phases; Gaussian: with random amplitudes too."""
    noise = (
        np.fft.rfft2(np.random.default_rng(seed).standard_normal((points, points)))
        / points
    )
    if not gaussian:
        noise /= np.abs(noise)
    whole = np.fft.fftfreq(points, 1 / points)
    q = np.hypot(whole[:, None], whole[None, : points // 2 + 1])
    inside = np.clip(q, surface.q0, surface.q1)
    C = np.where(
        (q <= surface.q1) & ((q >= surface.q0) | plateau & (q > 0)),
        surface.power_spectrum(inside),
        0,
    )
    return np.fft.irfft2(noise * np.sqrt(C) * points**2, s=(points, points))


def seen_in(truth, q0, q1):
    ratio = (q0 ** (-2 * truth.hurst) - q1 ** (-2 * truth.hurst)) / (
        truth.q0 ** (-2 * truth.hurst) - truth.q1 ** (-2 * truth.hurst)
    )
    return Surface(truth.hurst, q0, q1, truth.h_rms * math.sqrt(ratio), truth.h_max)


X, Y = np.meshgrid(np.arange(POINTS) / POINTS, np.arange(POINTS) / POINTS, indexing="ij")
ROUGH = Surface(0.8, 4.0, 100.0, 1.0, 3.0)
BASE = synthetic(ROUGH, gaussian=True, seed=5)


class TestKnownMaps:
    @pytest.mark.parametrize("hurst", [0.3, 0.5, 0.8, 1.0])
    @pytest.mark.parametrize("q0", [1.0, 4.0])
    def test_a_periodic_band_comes_back(self, hurst, q0):
        truth = Surface(hurst, q0, 100.0, 1.7, 3.0)
        heights = synthetic(truth)
        found = from_map(heights, STEP, periodic=True)
        assert found.hurst == pytest.approx(hurst, abs=0.01)
        assert found.q0 == pytest.approx(q0, rel=1e-12)
        assert found.q1 == pytest.approx(100, rel=1e-3)
        assert found.h_rms == pytest.approx(truth.h_rms, rel=0.01)
        assert found.rms_gradient == pytest.approx(truth.rms_gradient, rel=0.01)
        assert found.h_max == pytest.approx(heights.max(), rel=1e-12)
        assert (found.fit.roll_off, found.fit.cut_off) == (None, None)
        assert found.fit.variance_share == pytest.approx(1, rel=1e-9)

    @pytest.mark.parametrize("hurst", [0.3, 0.5, 0.8, 1.0])
    def test_a_flat_roll_off_is_found(self, hurst):
        truth = Surface(hurst, 8.0, 100.0, 1.0, 3.0)
        found = from_map(synthetic(truth, plateau=True), STEP, periodic=True)
        assert found.fit.roll_off == found.q0 == pytest.approx(8, rel=0.01)
        assert found.hurst == pytest.approx(hurst, abs=0.01)
        assert found.h_rms == pytest.approx(1, rel=0.02)
        assert found.rms_gradient == pytest.approx(truth.rms_gradient, rel=0.01)
        # the band holds 1/(1 + H) of the variance but for what lies beyond q1
        band = (1 - (100 / 8) ** (-2 * hurst)) / hurst
        assert found.fit.variance_share == pytest.approx(band / (1 + band), abs=0.03)

    @pytest.mark.parametrize("seed", range(4))
    def test_random_amplitudes_scatter_as_the_fit_says(self, seed):
        found = from_map(synthetic(ROUGH, gaussian=True, seed=seed), STEP, periodic=True)
        assert abs(found.fit.hurst - 0.8) < 4 * found.fit.hurst_error < 0.08
        assert found.h_rms == pytest.approx(1, rel=0.12)
        assert found.rms_gradient == pytest.approx(ROUGH.rms_gradient, rel=0.05)

    @pytest.mark.parametrize("hurst", [0.3, 0.5, 0.8, 1.0])
    @pytest.mark.parametrize("seed", [1, 2])
    def test_a_cut_out_is_windowed_and_comes_back(self, hurst, seed):
        # a quarter of the side of a larger surface: sampling scatter of its few long waves,
        # plus the window's bias
        truth = Surface(hurst, 1.0, 400.0, 1.0, 3.0)
        heights = synthetic(truth, 1024, gaussian=True, seed=seed)[:POINTS, :POINTS]
        found = from_map(heights, SIDE / 1024)
        assert found.q0 == pytest.approx(4, rel=1e-12)
        expected = seen_in(truth, found.q0, found.q1)
        assert found.hurst == pytest.approx(hurst, abs=0.05)
        assert found.h_rms == pytest.approx(expected.h_rms, rel=0.15)
        assert found.rms_gradient == pytest.approx(expected.rms_gradient, rel=0.06)

    @pytest.mark.parametrize(("noise", "periodic"), [(0.003, True), (0.0, False)])
    def test_a_noise_floor_and_sharp_ends_are_left_out(self, noise, periodic):
        # the window smears the band's ends into its surroundings
        floor = noise * np.random.default_rng(3).standard_normal(BASE.shape)
        found = from_map(BASE + floor, STEP, periodic=periodic)
        assert found.fit.cut_off == found.q1 == pytest.approx(100, rel=0.1)
        assert periodic or found.fit.roll_off == pytest.approx(4, rel=0.1)
        assert found.hurst == pytest.approx(0.8, abs=0.05)

    def test_a_forced_band_is_taken(self):
        found = from_map(BASE, STEP, periodic=True, band=(8, 60), h_max=4.5)
        assert (found.q0, found.q1, found.h_max) == (8.0, 60.0, 4.5)
        assert found.h_rms == pytest.approx(seen_in(ROUGH, 8, 60).h_rms, rel=0.05)

    def test_a_rectangle_with_oblong_steps(self):
        heights = synthetic(Surface(0.8, 4.0, 50.0, 1.0, 3.0), gaussian=True, seed=2)[
            :, ::2
        ]
        found = from_map(heights, STEP, 2 * STEP, periodic=True)
        turned = from_map(heights.T, 2 * STEP, STEP, periodic=True)
        assert found.hurst == pytest.approx(0.8, abs=0.06)
        assert found.q1 == pytest.approx(50, rel=1e-3)
        assert turned.h_rms == pytest.approx(found.h_rms, rel=1e-9)

    def test_above_one_within_the_tolerance_holds_one(self):
        heights = synthetic(ROUGH)
        waves = np.fft.fftfreq(POINTS, 1 / POINTS)
        q = np.hypot(waves[:, None], waves[None, :])
        steeper = np.fft.ifft2(np.fft.fft2(heights) * np.where(q > 0, q, 1) ** -0.23).real
        found = from_map(steeper, STEP, periodic=True)
        assert found.hurst == 1.0
        assert found.fit.hurst == pytest.approx(1.03, abs=0.005)


class TestTopography:
    def test_radial_spectra_agree(self):
        topography = topographies().Topography(BASE, (SIDE, SIDE), periodic=True)
        edges = np.arange(1, 100, 3) - 0.4375  # edges of this library's rings too
        _, other = topography.power_spectrum_from_area(collocation=edges)
        q, C, waves = radial_spectrum(BASE - BASE.mean(), STEP, STEP)
        place = np.digitize(q, edges) - 1
        inside = (place >= 0) & (place < len(edges) - 1) & (q >= 4)
        own = np.bincount(place[inside], (C * waves)[inside], len(edges) - 1)
        count = np.bincount(place[inside], waves[inside], len(edges) - 1)
        # the first bin but one holds the map's first waves, and reaches below them
        np.testing.assert_allclose(
            own[2:] / count[2:], np.asarray(other)[2:] / (4 * math.pi**2), rtol=1e-10
        )

    def test_is_taken_as_it_is(self):
        topography = topographies().Topography(
            BASE, (SIDE, SIDE), periodic=True, unit="um"
        )
        found = from_map(topography)
        plain = from_map(BASE, STEP, periodic=True)
        assert found.h_rms == pytest.approx(plain.h_rms, rel=1e-12)
        assert (found.fit, found.unit) == (plain.fit, "um")

    def test_odd_ones_are_refused(self):
        named = types.SimpleNamespace(
            heights=lambda: np.ones((40, 40)), physical_sizes=("a", "b")
        )
        for heights, dx, message in (
            (
                topographies().Topography(BASE, (SIDE, SIDE), periodic=True),
                1.0,
                "dx and dy belong to a plain array",
            ),
            (named, None, "physical_sizes must be real numbers"),
        ):
            with pytest.raises(InputError, match=message):
                from_map(heights, dx)


def test_a_spectrum_with_a_plateau_zeros_and_masked_entries_in_any_order():
    truth = Surface(0.7, 2.0, 150.0, 1.0, 3.0)
    q = np.geomspace(0.1, 200, 120)
    C = np.where(q <= truth.q1, truth.power_spectrum(np.clip(q, 2, 150)), 0)
    C = np.ma.masked_array(
        np.where(np.arange(120) % 17 == 3, np.nan, C), np.arange(120) % 17 == 3
    )
    found = Surface.from_spectrum(q[::-1], C[::-1], h_max=3, model="self-affine")
    assert found.fit.roll_off == found.q0 == pytest.approx(2, rel=0.01)
    assert found.q1 == q[q <= 150][-1]
    assert (found.h_rms, found.hurst) == (
        pytest.approx(1, rel=0.01),
        pytest.approx(0.7, rel=1e-3),
    )


SLOPED = np.geomspace(1, 100, 40)
WHITE = np.random.default_rng(1).standard_normal((128, 128))

test_maps_that_are_not_self_affine = refusals(
    lambda heights, options: from_map(heights, STEP, **options),
    (
        BASE[:3, :3],
        {},
        r"3 x 3 points have too few wavelengths; needed are at least 32 x 32",
    ),
    (3 * X + 2 * Y + 7, {}, "flat"),
    (WHITE, {"periodic": True}, r"exponent of -[01]\.\d+ .*not above 0"),
    (np.sin(10 * np.pi * X), {"periodic": True}, "the map holds wavelengths of"),
    (np.sin(10.6 * np.pi * X), {}, "a wavelength stands out"),
    (
        BASE + 5 * np.sin(40 * np.pi * X),
        {"periodic": True},
        r"a wavelength stands out: at q = 20\.\d+ ",
    ),
    (np.where(X > 0.37, 1.0, 0.0), {}, "few edges"),
    (synthetic(ROUGH, 512, gaussian=True)[::2, :256], {}, "not isotropic"),
    (
        synthetic(Surface(0.8, 30.0, 91.0, 1.0, 3.0))[:, :],
        {"periodic": True},
        "more than a factor of 3",
    ),
    (
        np.where((np.arange(64)[:, None] + np.arange(64)) % 2, 1.0, -1.0),
        {"periodic": True},
        "shorter than two",
    ),
    error=(InputError, NotSelfAffineError),
)

test_spectra_that_are_not_self_affine = refusals(
    lambda C: Surface.from_spectrum(SLOPED, C, h_max=3, model="self-affine"),
    (SLOPED**0.0, "not above 0"),
    (SLOPED**-4.5, "exponent of 1.25 .*above 1"),
    (
        SLOPED**-3.4 * np.where(np.arange(40) == 20, 50.0, 1.0),
        "a wavelength stands out|scatters by",
    ),
    (SLOPED**-3.4 * 10 ** (np.arange(40) % 2), "scatters by"),
    error=(InputError, NotSelfAffineError),
)

test_bad_maps = refusals(
    lambda change: from_map(**({"heights": BASE, "dx": STEP} | change)),
    (
        {"heights": np.where(BASE > 1, np.nan, BASE)},
        InputError,
        f"has {(BASE > 1).sum()} holes among 65536 points",
    ),
    ({"heights": np.ma.masked_greater(BASE, 1)}, InputError, r"has \d+ holes"),
    ({"heights": BASE[0]}, InputError, "two-dimensional"),
    ({"heights": BASE * 1e40}, OutOfRangeError, "at most 1e30"),
    ({"dx": None}, InputError, "dx is missing"),
    ({"dy": 0.0}, OutOfRangeError, "dy must be positive"),
    ({"short_cutoff": 1.9 * STEP}, InputError, "longer than two sampling steps"),
    (
        {"detrend": "cubic"},
        InputError,
        "detrend must be one of mean, plane, quadratic, median",
    ),
    ({"band": (20.0, 10.0)}, InputError, "band must be two wavenumbers"),
    ({"band": (10.0, 500.0)}, OutOfRangeError, "within the measured range"),
    ({"band": (10.0, 20.0)}, NotSelfAffineError, "too narrow: q1/q0 = 2"),
    ({"band": (10.0, 15.0)}, NotSelfAffineError, "only 4 spectral points"),
)


class Charge:
    def __reduce__(self):
        return pytest.fail, ("a pickle was executed",)


class TestFiles:
    def test_without_the_reader_says_what_to_install(self, monkeypatch, tmp_path):
        monkeypatch.setitem(sys.modules, "SurfaceTopography", None)
        with pytest.raises(MbmaError, match=r"pip install SurfaceTopography"):
            read_measurement(tmp_path / "a.sur")

    def test_no_file_and_no_map(self, tmp_path):
        topographies()
        with pytest.raises(InputError, match="it is a folder"):
            read_measurement(tmp_path)
        with pytest.raises(InputError, match="there is no file"):
            read_measurement(tmp_path / "a.sur")
        (tmp_path / "b.sur").write_text("not a map")
        with pytest.raises(InputError, match=r"cannot read .*b\.sur"):
            read_measurement(tmp_path / "b.sur")

    @pytest.mark.parametrize(("suffix", "save"), [("npy", np.save), ("npz", np.savez)])
    def test_arrays_of_objects_are_not_unpickled(self, suffix, save, tmp_path):
        pytest.importorskip("NuMPI")
        path = tmp_path / f"map.{suffix}"
        save(path, np.full((40, 40), Charge(), dtype=object), allow_pickle=True)
        with pytest.raises(InputError, match="cannot read"):
            read_measurement(path)


def cut_out(seed, roll_off, points=128, tiles=4):
    """A part of a larger periodic map with H = 0.8 and its own mean squared gradient; 1 wide, six points a wave."""
    count = tiles * points
    part = (slice(points), slice(points))
    truth = Surface(0.8, tiles / roll_off, count / 6, 1.0, 3.0)
    whole = synthetic(truth, count, seed=seed, plateau=True, gaussian=True)
    q = 2 * np.pi * np.fft.fftfreq(count, 1 / points)
    transform = np.fft.fft2(whole)
    slopes = [np.fft.ifft2(1j * wave * transform).real[part] for wave in (q[:, None], q)]
    return whole[part], math.sqrt(sum(np.mean(slope**2) for slope in slopes))


@pytest.mark.parametrize("roll_off", [1.0, 0.5, 0.25])
def test_the_gradient_of_a_map_that_is_not_periodic_is_that_of_its_heights(roll_off):
    ratios = []
    for seed in range(8):
        heights, gradient = cut_out(seed, roll_off)
        surface = Surface.from_map(heights, 1 / 128)
        assert surface.h_rms == pytest.approx(surface.heights.h_rms, rel=1e-5)
        ratios.append(surface.rms_gradient / gradient)
    assert np.abs(np.array(ratios) - 1).max() < 0.05
    assert np.mean(ratios) == pytest.approx(1, abs=0.02)


@pytest.mark.parametrize("roll_off", [1.0, 0.25])
def test_moments_of_a_periodic_map_are_those_of_its_waves(roll_off):
    heights, gradient = cut_out(3, roll_off, points=256, tiles=1)
    k = np.hypot(
        *np.meshgrid(
            np.fft.fftfreq(256, 1 / 256), np.fft.fftfreq(256, 1 / 256), indexing="ij"
        )
    )
    m4 = 0.375 * np.sum(
        (2 * np.pi * k) ** 4 * np.abs(np.fft.fft2(heights) / heights.size) ** 2
    )
    surface = Surface.from_map(heights, 1 / 256, periodic=True)
    assert surface.rms_gradient == pytest.approx(gradient, rel=1e-3)
    assert surface.m4 == pytest.approx(m4, rel=0.08)


@pytest.mark.parametrize("periodic", [True, False])
def test_ridges_are_a_line_seen_twice(periodic):
    waves = np.arange(65.0)
    noise = np.random.default_rng(2).standard_normal(65) * np.exp(
        2j * np.pi * np.random.default_rng(3).random(65)
    )
    line = np.fft.irfft(np.where(waves > 0, noise / np.maximum(waves, 1) ** 1.3, 0))
    ridges = Surface.from_map(
        np.repeat(line[:, None], 100, axis=1), 0.5, periodic=periodic
    )
    turned = Surface.from_map(
        np.repeat(line[None, :], 100, axis=0), 0.5, periodic=periodic
    )
    assert ridges.h_rms == pytest.approx(ridges.heights.h_rms, rel=1e-5)
    assert ridges.rms_gradient == pytest.approx(ridges.bearing.gradient, rel=0.01)
    assert any(
        "anisotropy is 1e+07, tested" in reason
        for reason in ridges.departures(by_map=True)
    )
    if periodic:
        slope = np.fft.irfft(2j * np.pi * waves / 64 * np.fft.rfft(line))
        assert ridges.bearing.gradient == pytest.approx(slope.std(), rel=1e-9)
        assert ridges.bearing.slope_kurtosis == pytest.approx(
            np.mean(slope**4) / slope.var() ** 2, rel=1e-9
        )
        whitened = np.sqrt(np.pi / 2) * np.abs(slope).mean() / slope.std()
        assert ridges.bearing.top_gradient[-1] == pytest.approx(whitened, rel=1e-9)
    for theory in ("calibrated", "persson", "mbma"):
        answers = [
            contact(one, area=[0.01, 0.1], theory=theory) for one in (ridges, turned)
        ]
        assert not answers[0].valid.any()
        assert answers[1].pressure == pytest.approx(answers[0].pressure, rel=0.05)


@pytest.mark.parametrize("turn", [0.0, math.pi / 4, 1.0])
def test_a_lay_at_an_angle_to_the_axes_is_seen(turn):
    count = 512
    k = np.stack(
        np.meshgrid(
            np.fft.fftfreq(count, 1 / count),
            np.fft.rfftfreq(count, 1 / count),
            indexing="ij",
        )
    )
    along, across = np.tensordot(
        [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]], k, 1
    )
    q = np.hypot(4 * along, across)
    noise = np.fft.rfft2(np.random.default_rng(4).standard_normal((count, count)))
    heights = np.fft.irfft2(
        noise * np.where((q > 20) & (q < 200), np.maximum(q, 1.0) ** -1.8, 0)
    )
    assert Surface.from_map(heights, 1.0, periodic=True).anisotropy == pytest.approx(
        4, rel=0.05
    )
    found = Surface.from_map(heights[:400, :300], 1.0)
    assert found.anisotropy == pytest.approx(4, rel=0.1)
    assert found.anisotropy == found.bearing.anisotropy


@settings(max_examples=20, deadline=None)
@example(scale=0.26362359173243805, lift=0.0, periodic=False, square=False)
@given(
    scale=st.floats(1e-6, 1e6),
    lift=st.floats(-1e6, 1e6),
    periodic=st.booleans(),
    square=st.booleans(),
)
def test_neither_units_nor_heights_from_afar_matter(scale, lift, periodic, square):
    # waves on the axes lie where a range of wavenumbers ends
    heights = BASE[::4, ::4] if square else BASE[:48, :40]
    heights = heights / heights.std()
    plain = Surface.from_map(heights, 0.5, periodic=periodic)
    found = Surface.from_map(scale * (heights + lift), scale * 0.5, periodic=periodic)
    assert found.h_rms == pytest.approx(scale * plain.h_rms, rel=1e-7)
    assert found.rms_gradient == pytest.approx(plain.rms_gradient, rel=1e-7)
    assert found.m4 == pytest.approx(plain.m4 / scale**2, rel=1e-6)
    assert found.bearing.anisotropy == pytest.approx(plain.bearing.anisotropy, rel=1e-6)


@pytest.mark.parametrize("periodic", [True, False])
def test_waves_that_one_axis_alone_samples_are_told(periodic):
    even = Surface.from_map(BASE, STEP, periodic=periodic)
    assert not any(entry["step"] == "corners" for entry in even.provenance)
    uneven = Surface.from_map(BASE[:, ::4], STEP, 4 * STEP, periodic=periodic)
    (entry,) = (entry for entry in uneven.provenance if entry["step"] == "corners")
    assert entry["rms_gradient"] == pytest.approx(
        uneven.bearing.gradient / uneven.rms_gradient, rel=0.02
    )
    assert (
        "are left out of the spectrum: with them the rms gradient would be 1."
        in entry["told"]
    )


@pytest.mark.parametrize("shape", [(64, 64), (63, 64), (64, 45)])
def test_which_way_a_periodic_map_is_turned_does_not_matter(shape):
    heights = np.random.default_rng(8).standard_normal(shape)  # up to the shortest wave
    plain = Surface.from_map(heights, 1.0, periodic=True)
    for turned in (
        heights.T,
        heights[::-1],
        heights[:, ::-1],
        np.roll(heights, (5, 9), (0, 1)),
    ):
        found = Surface.from_map(turned, 1.0, periodic=True)
        for name in ("gradient", "slope_kurtosis", "anisotropy"):
            assert getattr(found.bearing, name) == pytest.approx(
                getattr(plain.bearing, name), rel=1e-12
            )
        np.testing.assert_allclose(
            found.bearing.top_gradient, plain.bearing.top_gradient, rtol=1e-12
        )
        assert found.rms_gradient == pytest.approx(plain.rms_gradient, rel=1e-9)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6))
@example(seed=0)
def test_a_periodic_map_of_few_waves_keeps_its_height_and_gradient_or_tells(seed):
    rng = np.random.default_rng(seed)
    x, y = np.mgrid[:64, :64] / 64
    waves = rng.integers(0, 20, (rng.integers(2, 8), 2))
    heights = sum(
        10 ** rng.uniform(-4, 0) * np.cos(2 * np.pi * (m * x + n * y) + rng.uniform(0, 6))
        for m, n in waves
    )
    try:
        found = Surface.from_map(heights, 1.0, periodic=True)
    except InputError:
        # no spectrum from so few
        return
    assert found.h_rms == pytest.approx(found.heights.h_rms, rel=1e-9)
    told = any(
        "wavelengths are few" in entry.get("told", "") for entry in found.provenance
    )
    assert told == (abs(found.rms_gradient / found.bearing.gradient - 1) > 0.05)
