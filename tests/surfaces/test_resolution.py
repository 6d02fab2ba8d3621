"""What the shortest waves do, and power laws beyond them."""

import numpy as np
import pytest
from helpers import random_map

from mbma_tables import Surface, contact, contact_law
from mbma_tables.common.errors import InputError
from mbma_tables.export.law_rows import describe_law
from mbma_tables.surfaces.maps import extrapolated
from mbma_tables.surfaces.spectral import resolution

WHOLE = Surface(0.7, 1.0, 400.0, 0.3, 1.0)


def measured(end):
    """The longer waves of `WHOLE`."""
    q = np.geomspace(1.0, end, 120)
    return Surface.from_spectrum(q, WHOLE.power_spectrum(q * (1 - 1e-12)), h_max=1.0, unit="um")


def test_the_last_octave():
    found = resolution(measured(100.0))
    assert found["shortest"] == pytest.approx(2 * np.pi / 100)
    expected = float(measured(100.0).rms_gradient / measured(50.0).rms_gradient)
    assert found["area_without_last_octave"] == pytest.approx(expected, rel=1e-3)
    assert f"{expected:.2f} times larger" in found["told"]


def test_waves_that_hold_no_power_are_not_known():
    q = np.geomspace(1.0, 400.0, 200)
    C = WHOLE.power_spectrum(q * (1 - 1e-12)) * np.where(q > 100, 1e-6, 1.0)
    found = resolution(Surface.from_spectrum(q, C, h_max=1.0, unit="um"))
    assert found["shortest"] == pytest.approx(2 * np.pi / 100, rel=0.04)
    assert found["area_without_last_octave"] == pytest.approx(
        resolution(measured(100.0))["area_without_last_octave"], rel=0.02
    )
    assert "(sampled to 0.01571 um, without power there)" in found["told"]


def test_the_true_power_law_gives_the_whole_surface_back():
    longer = extrapolated(measured(50.0), 2 * np.pi / 400, 0.7)
    assert longer.rms_gradient == pytest.approx(WHOLE.rms_gradient, rel=2e-3)
    assert longer.m4 == pytest.approx(WHOLE.m4, rel=4e-3)
    assert longer.q1 == pytest.approx(400.0)
    record = longer.provenance[-1]
    assert record["area"] == pytest.approx(float(measured(50.0).rms_gradient / WHOLE.rms_gradient), rel=2e-3)
    assert "which was not measured" in record["told"]


def test_as_options_of_a_map():
    heights = random_map(64, 0, 1)
    options = {"dx": 1.0, "periodic": True, "unit": "um", "model": "measured"}
    plain = Surface.from_map(heights, **options)
    longer = Surface.from_map(heights, **options, extrapolate_to="100 nm", extrapolate_hurst=0.8)
    assert longer.q1 == pytest.approx(2 * np.pi / 0.1)
    assert longer.rms_gradient > 1.2 * plain.rms_gradient
    assert [entry["step"] for entry in longer.provenance[-2:]] == ["resolution", "extrapolated"]
    with pytest.raises(InputError, match="both or neither"):
        Surface.from_map(heights, **options, extrapolate_to=0.1)


def test_every_answer_of_a_map_says_so():
    heights = 0.05 * random_map(64, 0.02, 0.4)
    told = "area depends on resolution: wavelengths are known down to"
    for model in ("measured", "self-affine"):
        surface = Surface.from_map(heights, 1.0, periodic=True, unit="um", model=model)
        rows = describe_law(surface, "1 GPa", rows=10, theory="calibrated")
        assert any(told in line for line in rows.comments)
        answers = [contact(surface, pressure=0.01), contact_law(surface, theory="persson")]
        answers.append(contact(surface.combined(WHOLE.scaled(1.0, "um")), pressure=0.01))
        for found in answers:
            assert told in repr(found)
            assert told in found.to_dataset().attrs["resolution"]
    longer = Surface.from_map(heights, 1.0, periodic=True, extrapolate_to=0.5, extrapolate_hurst=0.8)
    assert "which was not measured" in repr(contact(longer, pressure=0.01))
    assert "resolution" not in repr(contact(WHOLE, pressure=0.01))


def test_what_was_measured_is_not_replaced():
    with pytest.raises(InputError, match="must be below the shortest measured wavelength"):
        extrapolated(measured(50.0), 1.0, 0.7)
    with pytest.raises(InputError, match="extrapolate_hurst must be a number"):
        extrapolated(measured(50.0), 0.01, 1.7)
