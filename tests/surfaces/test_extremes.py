"""The highest point of a surface of a nominal area, against simulated surfaces, and through the constructors."""

import dataclasses
import pickle

import numpy as np
import pytest

from generate.boundary_elements.surfaces import Recipe, heights
from mbma_tables import InputError, OutOfRangeError, Surface, contact
from mbma_tables.scenes.specimen import from_numbers
from mbma_tables.surfaces.extremes import highest_point

NUMBERS = {"hurst": 0.8, "q0": 0.025, "q1": 3.0, "h_rms": 1.0, "unit": "um"}


@pytest.mark.parametrize(
    ("kind", "hurst", "zeta_1", "waves"),
    [("self_affine", 0.8, 4, 8), ("self_affine", 0.8, 32, 1), ("self_affine", 0.5, 8, 4), ("plateau", 0.8, 4, 8)],
)
def test_medians_and_spread_are_those_of_simulated_surfaces(kind, hurst, zeta_1, waves):
    tops, slopes = [], []
    for seed in range(48):
        z = heights(Recipe(kind, hurst, zeta_1, waves, 500 + seed, 256))
        tops.append(z.max())
        wavenumber = 2 * np.pi * np.fft.fftfreq(256, 1 / 256)
        slopes.append(np.mean(np.fft.ifft(1j * wavenumber[:, None] * np.fft.fft(z, axis=0), axis=0).real ** 2))
    known = highest_point(1.0, np.mean(slopes), 1.0, [0.16, 0.5, 0.84])
    assert np.median(tops) == pytest.approx(known[1], rel=0.04)
    assert np.quantile(tops, [0.16, 0.84]) == pytest.approx(known[[0, 2]], abs=0.3)


def test_it_solves_the_formula():
    chance, area = np.array([0.1, 0.5, 0.9]), np.geomspace(1e5, 1e14, 5)[:, None]
    x = highest_point(2.0, 0.05, area, chance) / 2.0
    number = area * 0.05 / 4.0 * (2 * np.pi) ** -1.5 * x * np.exp(-(x**2) / 2)
    np.testing.assert_allclose(np.exp(-number), np.broadcast_to(chance, number.shape), rtol=1e-12)


def test_every_constructor_takes_the_area():
    made = Surface(**NUMBERS, nominal_area="4 cm^2")
    assert made.h_max == pytest.approx(float(highest_point(1.0, made.m2, 4e8)), rel=1e-15)
    assert made.provenance[-1]["from"] < made.h_max < made.provenance[-1]["to"]
    assert Surface(**NUMBERS, nominal_area=[4e8, 1e6]).h_max[0] == made.h_max
    drawn = Surface.from_roughness(
        Rq="1 um", longest=f"{2 * np.pi / 0.025!r} um", shortest=f"{2 * np.pi / 3.0!r} um", hurst=0.8,
        nominal_area="4 cm^2",
    )  # fmt: skip
    moments = {name: getattr(made, name) for name in ("hurst", "m0", "m2", "m4")}
    spectrum = np.geomspace(0.025, 3.0, 200)
    others = [
        drawn,
        Surface.from_moments(**moments, nominal_area=4e8),
        Surface.from_spectrum(spectrum, made.power_spectrum(spectrum), nominal_area=4e8),
        made.sampled(),
        pickle.loads(pickle.dumps(made)),
        dataclasses.replace(made),
        made.to("mm").to("um"),
    ]
    for other in others:
        assert float(other.h_max) == pytest.approx(made.h_max, rel=1e-6)
    fitted = Surface.from_spectrum(
        spectrum, made.power_spectrum(spectrum), nominal_area=4e8, model="self-affine", band=(0.025, 3.0)
    )
    assert float(fitted.h_max) == pytest.approx(made.h_max, rel=1e-3)
    line = np.random.default_rng(3).standard_normal(400).cumsum()[:400]
    short, long = (Surface.from_profile(line, dx=1.0, nominal_area=area) for area in (1e5, 1e8))
    assert short.h_max < long.h_max == pytest.approx(float(highest_point(long.h_rms, long.m2, 1e8)))
    # two faces alike: sqrt(2) times as high
    both = made.combined(made, "4 cm^2")
    assert both.h_max == pytest.approx(2**0.5 * made.h_max, rel=1e-3)


def test_files_and_options_take_the_area():
    made = Surface(**NUMBERS, nominal_area="4 cm^2")
    five = {"hurst": 0.8, "q0": "0.025/um", "q1": "3/um", "h_rms": "1 um", "nominal_area": "400 mm^2"}
    moments = {"hurst": 0.8, "m0": "1 um^2", "m2": float(made.m2), "m4": f"{made.m4} 1/um^2", "nominal_area": "4 cm^2"}
    drawn = {"hurst": 0.8, "Rq": "1 um", "longest": f"{2 * np.pi / 0.025} um", "shortest": f"{2 * np.pi / 3} um"}
    for given in (five, moments, drawn | {"nominal_area": "4e8 um^2"}):
        assert float(from_numbers(given).surface.h_max) == pytest.approx(made.h_max, rel=1e-6)
    with pytest.raises(InputError, match="h_max or nominal_area"):
        from_numbers({"hurst": 0.8, "nominal_area": "4 cm^2"})


def test_areas_that_are_refused():
    for given, message in (
        ({"h_max": 3.0, "nominal_area": 1e6}, "both given"),
        ({}, "h_max is missing"),
        ({"nominal_area": "4 cm"}, "must be like"),
    ):
        with pytest.raises(InputError, match=message):
            Surface(**NUMBERS, **given)
    for area in (0.0, -1.0, np.nan, np.inf, 100.0):
        with pytest.raises(OutOfRangeError, match="nominal_area"):
            Surface(**NUMBERS, nominal_area=area)
    xr = pytest.importorskip("xarray")
    with pytest.raises(InputError, match="DataArrays"):
        Surface(**NUMBERS | {"h_rms": xr.DataArray([1.0, 2.0], dims="case")}, nominal_area=1e6)


def test_beyond_the_heights_simulated_nothing_changes():
    """Why h_max up to 8 h_rms counts as tested: above 5.5 h_rms it does not matter from 0.1% contact on."""
    for hurst, zeta_1 in ((0.2, 4.0), (0.8, 16.0), (1.0, 128.0)):
        near, far = (
            contact(Surface(hurst, 0.001, 0.001 * zeta_1, 1.0, h_max), area=[1e-3, 1e-2, 0.1], theory="calibrated")
            for h_max in (5.5, 8.0)
        )
        for name, rtol in {"pressure": 1e-6, "mean_separation": 2e-4, "stiffness": 2e-3}.items():
            np.testing.assert_allclose(getattr(far, name), getattr(near, name), rtol=rtol)
        assert far.valid.all()
