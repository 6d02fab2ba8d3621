"""The law of a map on machined surfaces: what it states of itself, against what boundary elements found."""

import numpy as np
import pytest

from generate.machined.makers import Part, heights
from mbma_tables import Surface, contact


def surface_of(family, number):
    return Surface.from_map(heights(Part(family, number)), 1.0, periodic=True, unit="um")


@pytest.mark.parametrize(("family", "number"), [("gaussian", 2), ("milled", 3)])
def test_maps_like_gaussian_ones_are_valid(family, number):
    found = contact(surface_of(family, number), area=[0.01, 0.1, 0.5], theory="calibrated")
    assert found.valid.all()
    assert (found.scatter < 0.08).all()
    assert ((found.area_scatter > 0.03) & (found.area_scatter < 0.05)).all()


@pytest.mark.parametrize(
    ("family", "number", "statistic"),
    [("honed", 1, "skewness of heights"), ("ground", 1, "anisotropy"), ("etched", 1, "kurtosis of slopes")],
)
def test_other_maps_are_not_and_say_what_helps(family, number, statistic):
    found = contact(surface_of(family, number), area=[0.01, 0.1, 0.5], theory="calibrated")
    assert not found.valid.any()
    (reason,) = (text for text in found.reasons if text.startswith(statistic))
    assert "theory='simulated' presses the map itself" in reason
    assert (found.scatter > 0.13).all()
    assert (found.area_scatter > 0.07).all()
    assert (found.stiffness_scatter > 0.2).all()


def test_nothing_is_stated_of_maps_unlike_all_that_were_pressed():
    ridges = np.repeat(heights(Part("gaussian", 0, 128))[:1], 128, axis=0)
    found = contact(Surface.from_map(ridges, 1.0, periodic=True), area=0.1, theory="calibrated")
    assert not found.valid
    assert np.isnan([found.scatter, found.area_scatter, found.stiffness_scatter]).all()
