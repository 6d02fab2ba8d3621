"""Numbers of a drawing: back from a surface's own numbers, against a simulated profile, and what is refused."""

import json
import math

import numpy as np
import pytest
from helpers import refusals, refused, run

from mbma_tables import InputError, OutOfRangeError, Surface

SURFACE = Surface(0.75, 0.02, 5.0, 0.6, 2.1, unit="um")


def drawn_from(surface):
    """What an ideal instrument says of a Gaussian isotropic surface."""
    slope = float(np.sqrt(surface.m2))
    return {
        "Rq": surface.h_rms,
        "Ra": math.sqrt(2 / math.pi) * surface.h_rms,
        "Sq": surface.h_rms,
        "Sa": math.sqrt(2 / math.pi) * surface.h_rms,
        "Rdq": slope,
        "Sdq": math.sqrt(2) * slope,
        "Rsm": 2 * math.pi * surface.h_rms / slope,
        "Sds": surface.summit_density,
        "Spd": surface.summit_density,
        "longest": 2 * math.pi / surface.q0,
        "shortest": 2 * math.pi / surface.q1,
        "Sp": surface.h_max,
        "h_max": surface.h_max,
        "hurst": surface.hurst,
    }


COMBINATIONS = [
    (height, slope, third, top)
    for height in ("Rq", "Ra", "Sq", "Sa")
    for slope, third in [("Rdq", "longest"), ("Sdq", "shortest"), ("Rsm", "Sds"), ("Rsm", "longest")]
    for top in ("h_max", "Sp")
] + [("Ra", "longest", "shortest", "Sp"), ("Rq", "Sdq", "Spd", "h_max")]


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
    assert record["assumed"][0].startswith("heights are Gaussian and the surface is isotropic")
    assert len(record["assumed"]) == len(numbers) + 1
    assert all(":" in line or "h_max" in line or "Hurst" in line for line in record["assumed"])


def test_arrays_and_units():
    found = Surface.from_roughness(
        Ra="400 nm", Rdq=[0.05, 0.1], longest="0.25 mm", hurst=0.8, h_max="1.8 um", unit="um"
    )
    assert found.shape == (2,)
    assert found.h_rms == pytest.approx([0.4 * math.sqrt(math.pi / 2)] * 2)
    np.testing.assert_allclose(np.sqrt(found.m2), [0.05, 0.1], rtol=1e-12)
    assert found.to("mm").provenance == found.provenance


@pytest.mark.slow
def test_a_simulated_profile_has_these_numbers():
    """A random surface of a given spectrum: its profiles by the definitions of the standard, mean over 400 lines."""
    points, surface = 2048, Surface(0.8, 2 * math.pi / 100, 2 * math.pi / 6, 1.0, 4.0)
    q = 2 * math.pi * np.hypot(np.fft.fftfreq(points)[:, None], np.fft.rfftfreq(points))
    inside = (q >= surface.q0) & (q <= surface.q1)
    amplitude = np.where(inside, np.where(inside, q, 1.0) ** -1.8, 0.0)
    noise = np.fft.rfft2(np.random.default_rng(3).standard_normal((points, points)))
    heights = np.fft.irfft2(noise / np.abs(noise) * amplitude)
    heights /= heights.std()
    lines = heights[:: points // 400]
    slopes = np.fft.irfft(1j * 2 * math.pi * np.fft.rfftfreq(points) * np.fft.rfft(lines))
    upward = ((lines[:, 1:] >= 0) & (lines[:, :-1] < 0)).sum() / lines.size
    numbers = {"Ra": np.abs(lines).mean(), "Rdq": slopes.std(), "Rsm": 1 / upward}
    ideal = drawn_from(surface)
    for name, rel in {"Ra": 0.01, "Rdq": 0.01, "Rsm": 0.01}.items():
        assert numbers[name] == pytest.approx(ideal[name], rel=rel), name


GOOD = {"Rq": 0.6, "Rdq": 0.2, "longest": 300.0, "hurst": 0.8, "h_max": 2.0}


test_numbers_that_are_refused = refusals(
    lambda changed: Surface.from_roughness(**(GOOD | changed)),
    ({"Ra": 0.5}, "the height of roughness: give one of Rq, Ra, Sq, Sa; got Rq and Ra"),
    ({"hurst": None}, "hurst is missing: a drawing does not tell it"),
    ({"h_max": None}, r"the highest point, .* 3 to 4.5 times the rms height.*: give one of h_max, Sp"),
    ({"h_max": 0.5}, "h_max must be above the rms height"),
    (
        {"Rdq": None, "longest": "2 um", "shortest": "0.1 mm", "Rq": "1 um", "h_max": "3 um"},
        r"longest \[um\] .* 100, got 2",
    ),
    ({"Sdq": 0.3}, "the slope of roughness: give one of"),
    ({"Rdq": None}, "the band of wavelengths needs a slope"),
    ({"shortest": 2.0}, "got Rdq and longest and shortest"),
    ({"Rdq": 1e-3}, "Rdq must be between .* for a band of 3 < q1/q0 < 1e8"),
    ({"Rdq": None, "Rsm": 1e4}, "Rsm must be between"),
    ({"h_max": "2 um"}, "without a unit beside numbers in um"),
    ({"longest": None, "shortest": 400.0}, "Rdq must be between"),
    ({"longest": None, "Sds": 1e-12}, "alpha = m0 m4/m2"),
)


def test_the_range_named_is_the_range():
    """Just inside the slopes that the message names there is a surface, just outside there is none."""
    with pytest.raises(OutOfRangeError) as caught:
        Surface.from_roughness(**(GOOD | {"Rdq": 1e-3}))
    low, high = (float(word) for word in str(caught.value).split("between ")[1].split(",")[0].split(" and "))
    for end, inward in ((low, 1.01), (high, 0.99)):
        assert Surface.from_roughness(**(GOOD | {"Rdq": end * inward})).zeta_1 > 3
        with pytest.raises(OutOfRangeError):
            Surface.from_roughness(**(GOOD | {"Rdq": end / inward}))


DRAWING = {"Ra": "0.4 um", "Rdq": 0.1, "longest": "0.1 mm", "hurst": 0.8, "h_max": "1.8 um"}


def test_on_the_command_line_and_in_toml(tmp_path):
    options = [f"--{name.replace('_', '-')}={value}" for name, value in DRAWING.items()]
    (tmp_path / "s.toml").write_text("[surface]\n" + "".join(f"{k} = {v!r}\n" for k, v in DRAWING.items()))
    surface = Surface.from_roughness(**DRAWING)
    for source in (options, ["--file", str(tmp_path / "s.toml")]):
        answer = json.loads(run("contact", *source, "--E-star=100GPa", "-p", "10MPa", "--json"))
        assert answer["surface"]["q1"] == surface.q1
        assert answer["surface"]["assumed"] == surface.provenance[0]["assumed"]
        assert answer["units"]["separation"] == "um"
    assert run("contact", *options, "-d", "1").count("\nassumed: ") == 6
    assert "q0 beside numbers of a drawing" in refused("contact", *options, "--q0", "1/mm", "-d", "1")


def test_a_roll_off_by_name():
    given = {"Rq": "0.5 um", "hurst": 0.7, "longest": "5 mm", "shortest": "4 um", "nominal_area": "4 cm^2"}
    face, plain = Surface.from_roughness(**given, rolloff="250 um"), Surface.from_roughness(**given)
    assert face.h_rms == pytest.approx(0.5, rel=1e-12)
    q = 2 * np.pi / np.array([5000.0, 250.0, 4.0])
    np.testing.assert_allclose(face.q, q)
    assert face.C[0] == face.C[1]
    assert face.C[1] / face.C[2] == pytest.approx((q[2] / q[1]) ** 3.4)
    # the same variance over shorter wavelengths is rougher, and has a higher highest point in one area
    assert face.rms_gradient > 3 * plain.rms_gradient
    assert face.h_max > plain.h_max
    assert any("flat" in text for text in face.provenance[0]["assumed"])
    for bad, match in (({"rolloff": "5 um"}, "3 times shortest"), ({"rolloff": "6 mm"}, "longest")):
        with pytest.raises(OutOfRangeError, match=match):
            Surface.from_roughness(**given, **bad)
    with pytest.raises(InputError, match="rolloff needs longest and shortest"):
        Surface.from_roughness(**given | {"shortest": None, "Rdq": 0.1}, rolloff="250 um")
