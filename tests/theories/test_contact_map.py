"""`contact(...).map()`: where a map touches."""

import math

import numpy as np
import pytest

from generate.machined.makers import Part, heights
from mbma_tables import InputError, Surface, contact
from mbma_tables.theories import BoundaryElements

pytest.importorskip("tamaas")


@pytest.fixture(scope="module")
def surface():
    return Surface.from_map(heights(Part("honed", 1, 64)), 0.5, 1.0, periodic=True, unit="um")


def test_pressures_gaps_and_contact_fit_each_other(surface):
    found = contact(surface, pressure="20 MPa", E_star="2 GPa", theory="simulated")
    pressed = found.map()
    data = pressed.to_dataset()
    assert data.pressure.mean() == pytest.approx(0.02, rel=1e-3)
    assert (data.pressure.units, data.gap.units, data.x.units) == ("GPa", "um", "um")
    assert data.x[1] == 0.5
    assert data.y[1] == 1.0
    assert not (data.gap.values[data.contact.values] > 0).any()
    assert (data.gap.values[~data.contact.values] > 0).all()
    assert data.gap.mean() == pytest.approx(float(found.mean_separation), rel=0.01)
    # points in contact are more than the area, whose perimeter is corrected
    assert float(found.area) < data.contact.mean() < 1.3 * float(found.area)
    assert data.heights.values[data.contact.values].mean() > data.heights.values.std() / 2
    assert repr(pressed).startswith("ContactMap(points 64 x 64, pressure 0.02")


def test_a_map_that_is_not_periodic_is_cut_out_of_its_mirror_images():
    half = heights(Part("honed", 1, 64))[:40, :48]
    own = Surface.from_map(half, 1.0, detrend="mean")
    images = np.block([[half, half[:, ::-1]], [half[::-1], half[::-1, ::-1]]])
    whole = Surface.from_map(images, 1.0, periodic=True)
    one, other = (contact(s, pressure=0.01, theory="simulated").map() for s in (own, whole))
    assert one.gap.shape == (40, 48)
    np.testing.assert_allclose(one.gap, other.gap[:40, :48], atol=1e-3 * one.gap.max())


def test_its_picture(surface, tmp_path):
    pytest.importorskip("matplotlib")
    contact(surface, pressure=0.01).map().plot(tmp_path / "map.png")
    assert (tmp_path / "map.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_what_has_no_map(surface, tmp_path):
    for found in (
        contact(surface, pressure=[0.01, 0.02]),
        contact(surface, pressure=0.01, hardness=[0.1, 0.2]),
        contact(surface, mean_separation=2 * float(surface.h_max)),
        contact(Surface(0.8, 0.1, 2.0, 1.0, 3.0), separation=1.0),
    ):
        with pytest.raises(InputError):
            found.map()
    BoundaryElements.of(surface).to_netcdf(tmp_path / "own.nc")
    own = BoundaryElements.from_netcdf(tmp_path / "own.nc").surface
    with pytest.raises(InputError, match="this surface has none"):
        contact(own, pressure=0.01, hardness=math.inf).map()
