"""Roughness parameters: a surface from those of a drawing, and back; those of a map."""

import dataclasses
import json
import math
import pickle

import numpy as np
import pytest
import xarray as xr
from helpers import random_map, refusals, refused, run
from scipy.integrate import quad
from scipy.special import ndtri
from scipy.stats import norm

from generate.boundary_elements.surfaces import Recipe, heights
from mbma_tables import InputError, OutOfRangeError, Surface, contact
from mbma_tables.design.specimen import from_numbers
from mbma_tables.surfaces.heights import highest_point
from mbma_tables.surfaces.roughness import areal_parameters, core

SURFACE = Surface(0.75, 0.02, 5.0, 0.6, 2.1, unit="um")


def drawn_from(surface):
    """What an ideal instrument says of a Gaussian isotropic surface."""
    slope = float(np.sqrt(surface.m2))
    mean = math.sqrt(2 / math.pi) * surface.h_rms
    heights = {"Rq": surface.h_rms, "Ra": mean, "Sq": surface.h_rms, "Sa": mean}
    slopes = {
        "Rdq": slope,
        "Sdq": math.sqrt(2) * slope,
        "Rsm": 2 * math.pi * surface.h_rms / slope,
    }
    waves = {"longest": 2 * math.pi / surface.q0, "shortest": 2 * math.pi / surface.q1}
    return (
        heights
        | slopes
        | waves
        | {"Sp": surface.h_max, "h_max": surface.h_max, "hurst": surface.hurst}
    )


COMBINATIONS = [
    (height, slope, third, top)
    for height in ("Rq", "Ra", "Sq", "Sa")
    for slope, third in [
        ("Rdq", "longest"),
        ("Sdq", "shortest"),
        ("Rsm", "shortest"),
        ("Rsm", "longest"),
    ]
    for top in ("h_max", "Sp")
] + [("Ra", "longest", "shortest", "Sp"), ("Rq", "Sdq", "longest", "h_max")]


@pytest.mark.parametrize("names", COMBINATIONS, ids="-".join)
def test_numbers_lead_back_to_their_surface(names):
    numbers = {name: drawn_from(SURFACE)[name] for name in ("hurst", *names)}
    found = Surface.from_roughness(**numbers, unit="um")
    for name in ("hurst", "q0", "q1", "h_rms", "h_max"):
        assert getattr(found, name) == pytest.approx(getattr(SURFACE, name), rel=1e-10)
    assert found.unit == "um"
    (record,) = found.provenance
    assert set(record["given"]) == set(numbers)
    # each number has its assumption, in words
    assert record["assumed"][0].startswith(
        "heights are Gaussian and the surface is isotropic"
    )
    assert len(record["assumed"]) == len(numbers) + 1
    assert all(
        ":" in line or "h_max" in line or "Hurst" in line for line in record["assumed"]
    )


def test_arrays_and_units():
    given = {
        "Ra": "400 nm",
        "Rdq": [0.05, 0.1],
        "longest": "0.25 mm",
        "hurst": 0.8,
        "h_max": "1.8 um",
    }
    found = Surface.from_roughness(**given, unit="um")
    assert found.shape == (2,)
    assert found.h_rms == pytest.approx([0.4 * math.sqrt(math.pi / 2)] * 2)
    np.testing.assert_allclose(np.sqrt(found.m2), [0.05, 0.1], rtol=1e-12)
    assert found.to("mm").provenance == found.provenance


@pytest.mark.slow
def test_a_simulated_profile_has_these_numbers():
    """A random surface of a given spectrum: its profiles by the definitions of the standard, mean over 400 lines."""
    points = 2048
    surface = Surface(0.8, 2 * math.pi / 100, 2 * math.pi / 6, 1.0, 4.0)
    heights = random_map(points, 1 / 100, 1 / 6, seed=3, phases=True)
    lines = heights[:: points // 400] / heights.std()
    slopes = np.fft.irfft(1j * 2 * math.pi * np.fft.rfftfreq(points) * np.fft.rfft(lines))
    upward = ((lines[:, 1:] >= 0) & (lines[:, :-1] < 0)).sum() / lines.size
    for name, number in {
        "Ra": np.abs(lines).mean(),
        "Rdq": slopes.std(),
        "Rsm": 1 / upward,
    }.items():
        assert number == pytest.approx(drawn_from(surface)[name], rel=0.01), name


GOOD = {"Rq": 0.6, "Rdq": 0.2, "longest": 300.0, "hurst": 0.8, "h_max": 2.0}


test_numbers_that_are_refused = refusals(
    lambda changed: Surface.from_roughness(**(GOOD | changed)),
    ({"Ra": 0.5}, "the height of roughness: give one of Rq, Ra, Sq, Sa; got Rq and Ra"),
    ({"hurst": None}, "missing: hurst, which a drawing does not tell"),
    (
        {"h_max": None},
        r"the highest point, one of h_max, Sp, .* 3 to 4.5 times the rms height",
    ),
    ({"h_max": 0.5}, "h_max must be above the rms height"),
    (
        {
            "Rdq": None,
            "longest": "2 um",
            "shortest": "0.1 mm",
            "Rq": "1 um",
            "h_max": "3 um",
        },
        r"longest \[um\] .* 100, got 2",
    ),
    ({"Sdq": 0.3}, "the slope of roughness: give one of"),
    ({"Rdq": None}, "the band of wavelengths, two of longest, shortest and Rdq"),
    ({"shortest": 2.0}, "got Rdq and longest and shortest"),
    ({"Rdq": 1e-3}, "Rdq must be between .* for a band of 3 < q1/q0 < 1e8"),
    ({"Rdq": None, "Rsm": 1e4}, "Rsm must be between"),
    ({"h_max": "2 um"}, "without a unit beside numbers in um"),
    ({"longest": None, "shortest": 400.0}, "Rdq must be between"),
)


def test_the_range_named_is_the_range():
    with pytest.raises(OutOfRangeError) as caught:
        Surface.from_roughness(**(GOOD | {"Rdq": 1e-3}))
    low, high = (
        float(word)
        for word in str(caught.value).split("between ")[1].split(",")[0].split(" and ")
    )
    for end, inward in ((low, 1.01), (high, 0.99)):
        assert Surface.from_roughness(**(GOOD | {"Rdq": end * inward})).zeta_1 > 3
        with pytest.raises(OutOfRangeError):
            Surface.from_roughness(**(GOOD | {"Rdq": end / inward}))


DRAWING = {
    "Ra": "0.4 um",
    "Rdq": 0.1,
    "longest": "0.1 mm",
    "hurst": 0.8,
    "h_max": "1.8 um",
}


def test_on_the_command_line_and_in_toml(tmp_path):
    options = [f"--{name.replace('_', '-')}={value}" for name, value in DRAWING.items()]
    (tmp_path / "s.toml").write_text(
        "[surface]\n" + "".join(f"{k} = {v!r}\n" for k, v in DRAWING.items())
    )
    surface = Surface.from_roughness(**DRAWING)
    for source in (options, ["--file", str(tmp_path / "s.toml")]):
        answer = json.loads(
            run("contact", *source, "--E-star=100GPa", "-p", "10MPa", "--json")
        )
        assert answer["surface"]["q1"] == surface.q1
        assert answer["surface"]["assumed"] == surface.provenance[0]["assumed"]
        assert answer["units"]["separation"] == "um"
    assert run("contact", *options, "-d", "1").count("\nassumed: ") == 6
    assert "q0 beside numbers of a drawing" in refused(
        "contact", *options, "--q0", "1/mm", "-d", "1"
    )


NUMBERS = {"hurst": 0.8, "q0": 0.025, "q1": 3.0, "h_rms": 1.0, "unit": "um"}


@pytest.mark.parametrize(
    ("kind", "hurst", "zeta_1", "waves"),
    [
        ("self_affine", 0.8, 4, 8),
        ("self_affine", 0.8, 32, 1),
        ("self_affine", 0.5, 8, 4),
        ("plateau", 0.8, 4, 8),
    ],
)
def test_medians_and_spread_are_those_of_simulated_surfaces(kind, hurst, zeta_1, waves):
    tops = []
    slopes = []
    for seed in range(48):
        z = heights(Recipe(kind, hurst, zeta_1, waves, 500 + seed, 256))
        tops.append(z.max())
        wavenumber = 2 * np.pi * np.fft.fftfreq(256, 1 / 256)
        slopes.append(
            np.mean(
                np.fft.ifft(1j * wavenumber[:, None] * np.fft.fft(z, axis=0), axis=0).real
                ** 2
            )
        )
    known = highest_point(1.0, np.mean(slopes), 1.0, [0.16, 0.5, 0.84])
    assert np.median(tops) == pytest.approx(known[1], rel=0.04)
    assert np.quantile(tops, [0.16, 0.84]) == pytest.approx(known[[0, 2]], abs=0.3)


def test_every_constructor_takes_the_area():
    made = Surface(**NUMBERS, nominal_area="4 cm^2")
    assert made.h_max == pytest.approx(float(highest_point(1.0, made.m2, 4e8)), rel=1e-15)
    assert made.provenance[-1]["from"] < made.h_max < made.provenance[-1]["to"]
    assert Surface(**NUMBERS, nominal_area=[4e8, 1e6]).h_max[0] == made.h_max
    ends = {"longest": f"{2 * np.pi / 0.025!r} um", "shortest": f"{2 * np.pi / 3.0!r} um"}
    moments = {name: getattr(made, name) for name in ("hurst", "m0", "m2", "m4")}
    q = np.geomspace(0.025, 3.0, 200)
    spectrum = {"q": q, "C": made.power_spectrum(q), "nominal_area": 4e8}
    others = [
        Surface.from_roughness(Rq="1 um", **ends, hurst=0.8, nominal_area="4 cm^2"),
        Surface.from_moments(**moments, nominal_area=4e8),
        Surface.from_spectrum(**spectrum),
        made.sampled(),
        pickle.loads(pickle.dumps(made)),
        dataclasses.replace(made),
        made.to("mm").to("um"),
    ]
    for other in others:
        assert float(other.h_max) == pytest.approx(made.h_max, rel=1e-6)
    fitted = Surface.from_spectrum(**spectrum, model="self-affine", band=(0.025, 3.0))
    assert float(fitted.h_max) == pytest.approx(made.h_max, rel=1e-3)
    line = np.random.default_rng(3).standard_normal(400).cumsum()[:400]
    short, long = (
        Surface.from_profile(line, dx=1.0, nominal_area=area) for area in (1e5, 1e8)
    )
    assert (
        short.h_max
        < long.h_max
        == pytest.approx(float(highest_point(long.h_rms, long.m2, 1e8)))
    )
    # two faces alike: sqrt(2) times as high
    both = made.combined(made, "4 cm^2")
    assert both.h_max == pytest.approx(2**0.5 * made.h_max, rel=1e-3)


def test_files_and_options_take_the_area():
    made = Surface(**NUMBERS, nominal_area="4 cm^2")
    five = {
        "hurst": 0.8,
        "q0": "0.025/um",
        "q1": "3/um",
        "h_rms": "1 um",
        "nominal_area": "400 mm^2",
    }
    moments = {
        "hurst": 0.8,
        "m0": "1 um^2",
        "m2": float(made.m2),
        "m4": f"{made.m4} 1/um^2",
        "nominal_area": "4 cm^2",
    }
    drawn = {
        "hurst": 0.8,
        "Rq": "1 um",
        "longest": f"{2 * np.pi / 0.025} um",
        "shortest": f"{2 * np.pi / 3} um",
    }
    for given in (five, moments, drawn | {"nominal_area": "4e8 um^2"}):
        assert float(from_numbers(given).surface.h_max) == pytest.approx(
            made.h_max, rel=1e-6
        )
    with pytest.raises(InputError, match="h_max or nominal_area"):
        from_numbers({"hurst": 0.8, "nominal_area": "4 cm^2"})


test_areas_that_are_refused = refusals(
    lambda given: Surface(**NUMBERS | given),
    ({"h_max": 3.0, "nominal_area": 1e6}, "both given"),
    ({}, "h_max is missing"),
    ({"nominal_area": "4 cm"}, "must be like"),
    *(
        ({"nominal_area": area}, OutOfRangeError, "nominal_area")
        for area in (0.0, -1.0, np.nan, np.inf, 100.0)
    ),
    ({"h_rms": xr.DataArray([1.0, 2.0], dims="case"), "nominal_area": 1e6}, "DataArrays"),
)


def test_beyond_the_heights_simulated_little_changes():
    """Why h_max up to 8 h_rms counts as tested: from 0.1% contact on, that above 5.5 hardly matters."""
    for hurst, zeta_1 in ((0.2, 8.0), (0.8, 16.0), (1.0, 128.0)):
        near, far = (
            contact(
                Surface(hurst, 0.001, 0.001 * zeta_1, 1.0, h_max),
                area=[1e-3, 1e-2, 0.1],
                theory="calibrated",
            )
            for h_max in (5.5, 8.0)
        )
        for name, rtol in {
            "pressure": 1e-6,
            "mean_separation": 5e-4,
            "stiffness": 4e-3,
        }.items():
            np.testing.assert_allclose(getattr(far, name), getattr(near, name), rtol=rtol)
        assert far.valid.all()


def test_a_roll_off_by_name():
    given = {
        "Rq": "0.5 um",
        "hurst": 0.7,
        "longest": "5 mm",
        "shortest": "4 um",
        "nominal_area": "4 cm^2",
    }
    face = Surface.from_roughness(**given, rolloff="250 um")
    plain = Surface.from_roughness(**given)
    assert face.h_rms == pytest.approx(0.5, rel=1e-12)
    q = 2 * np.pi / np.array([5000.0, 250.0, 4.0])
    np.testing.assert_allclose(face.q, q)
    assert face.C[0] == face.C[1]
    assert face.C[1] / face.C[2] == pytest.approx((q[2] / q[1]) ** 3.4)
    # the same variance over shorter wavelengths is rougher, and has a higher highest point
    # in one area
    assert face.rms_gradient > 3 * plain.rms_gradient
    assert face.h_max > plain.h_max
    assert any("flat" in text for text in face.provenance[0]["assumed"])
    for bad, match in (
        ({"rolloff": "5 um"}, "3 times shortest"),
        ({"rolloff": "6 mm"}, "longest"),
    ):
        with pytest.raises(OutOfRangeError, match=match):
            Surface.from_roughness(**given, **bad)


RATIOS = (np.arange(200_000) + 0.5) / 200_000


def gaussian_core():
    """Of the standard normal distribution: the line over the middle 40%, by integrals of its quantiles."""
    moment = quad(lambda p: (p - 0.5) * -ndtri(p), 0.3, 0.7)[0]
    slope = moment / (2 * 0.2**3 / 3)
    half = -slope / 2
    share = norm.sf(half)
    return 2 * half, 2 * (norm.pdf(half) / share - half), share


def test_gaussian_heights():
    found, (Sk, Spk, Smr1) = core(ndtri(RATIOS)), gaussian_core()
    assert found["Sk"] == pytest.approx(Sk, rel=1e-3)
    assert found["Spk"] == pytest.approx(Spk, rel=2e-3)
    assert found["Svk"] == pytest.approx(Spk, rel=2e-3)
    assert (found["Smr1"], found["Smr2"]) == (
        pytest.approx(Smr1, abs=1e-3),
        pytest.approx(1 - Smr1, abs=1e-3),
    )


def test_a_plateau_with_straight_valleys():
    # ratio 0 to 0.8 from 1 to 0.9, then straight down to -3: the curve is two lines
    curve = np.where(RATIOS < 0.8, 1 - RATIOS / 8, 0.9 - (RATIOS - 0.8) * 19.5)
    found = core(curve)
    assert found["Sk"] == pytest.approx(0.125, rel=1e-3)
    assert found["Smr2"] == pytest.approx(0.8, abs=2e-3)
    # the triangle between both lines is one already
    lower = 0.875
    assert found["Svk"] == pytest.approx(
        2 * np.maximum(lower - curve, 0).mean() / 0.2, rel=0.01
    )
    assert found["Spk"] < 1e-3


def test_moments_gradient_and_lay():
    x, y = np.meshgrid(np.arange(256.0), 2.0 * np.arange(128), indexing="ij")
    turn = np.radians(30)
    q = 2 * np.pi / 64
    # waves across a lay at 30 degrees, phases over whole periods and more
    values = 0.3 * np.sin(q * (-x * np.sin(turn) + y * np.cos(turn)))
    found = areal_parameters(values, (1.0, 2.0))
    assert found["lay"] == pytest.approx(30, abs=0.5)
    assert found["Sq"] == pytest.approx(0.3 / np.sqrt(2), rel=0.02)
    assert found["Sa"] == pytest.approx(0.3 * 2 / np.pi, rel=0.02)
    assert found["Sku"] == pytest.approx(1.5, rel=0.02)
    assert found["Sdq"] == pytest.approx(0.3 * q / np.sqrt(2), rel=0.02)
    assert found["Sz"] == pytest.approx(0.6, rel=0.01)
    assert found["Sz"] == found["Sp"] + found["Sv"]


def test_what_is_no_map():
    for wrong in (np.zeros((4, 4)), np.ones(5), [[1.0, np.nan], [0.0, 1.0]]):
        with pytest.raises(InputError):
            areal_parameters(wrong, (1.0, 1.0))


@pytest.mark.parametrize("hurst", [0.6, 1.0])
@pytest.mark.parametrize("wave", [{"longest": 5000.0}, {"shortest": 4.0}], ids=str)
def test_a_slope_beside_a_roll_off(hurst, wave):
    """The spectrum is flat down to the roll-off, and has the slope and the height that were given."""
    both = {"longest": 3000.0, "shortest": 4.0} | wave
    given = {"Rq": 0.5, "hurst": hurst, "rolloff": 250.0, "h_max": 2.0, "unit": "um"}
    known = Surface.from_roughness(
        **given, longest=both["longest"], shortest=both["shortest"]
    )
    slopes = {
        "Rdq": np.sqrt(known.m2),
        "Sdq": known.rms_gradient,
        "Rsm": 2 * np.pi * known.h_rms / np.sqrt(known.m2),
    }
    for name, value in slopes.items():
        face = Surface.from_roughness(**given, **wave, **{name: float(value)})
        np.testing.assert_allclose(face.q, known.q, rtol=1e-9)
        np.testing.assert_allclose(face.C, known.C, rtol=1e-9)
    with pytest.raises(OutOfRangeError, match="Rdq must be between"):
        Surface.from_roughness(**given, **wave, Rdq=1e-4)


def test_all_that_is_missing_is_named_at_once():
    missing = (
        r"Ra; missing: hurst.*two of longest, shortest.*one of h_max, Sp, nominal_area"
    )
    with pytest.raises(InputError, match=missing):
        Surface.from_roughness(Ra="1.6 um")
