"""The law of a map on machined surfaces: what it states of itself, against what boundary elements found."""

import numpy as np
import pytest

from generate.boundary_elements.solve import Contact
from generate.machined.makers import Part, heights
from mbma_tables import Scene, Surface, contact, contact_law
from mbma_tables.theories import theory_name
from mbma_tables.theories.own_map import law_loads
from mbma_tables.theories.saturated import of_map


def surface_of(family, number):
    return Surface.from_map(heights(Part(family, number)), 1.0, periodic=True, unit="um")


@pytest.mark.parametrize("number", [2, 3])
def test_gaussian_maps_are_valid(number):
    found = contact(surface_of("gaussian", number), area=[0.01, 0.1, 0.5], theory="calibrated")
    assert found.valid.all()
    assert ((found.scatter > 0.02) & (found.scatter < 0.06)).all()
    assert ((found.area_scatter > 0.01) & (found.area_scatter < 0.03)).all()


@pytest.mark.parametrize(
    ("family", "number", "statistic"),
    [("honed", 1, "skewness of heights"), ("ground", 1, "anisotropy"), ("milled", 3, "kurtosis of slopes")],
)
def test_other_maps_are_not_and_say_what_helps(family, number, statistic):
    found = contact(surface_of(family, number), area=[0.01, 0.1, 0.5], theory="calibrated")
    assert not found.valid.any()
    (reason,) = (text for text in found.reasons if text.startswith(statistic))
    assert reason.endswith("theory='simulated' simulates the map")
    coarse = Surface.from_map(surface_of(family, number).map.heights[::2, ::2], 2.0, periodic=True)
    assert any("the map with a short_cutoff of 8" in text for text in coarse.departures(by_map=True))
    assert (found.scatter > 0.13).all()
    assert (found.area_scatter > 0.07).all()
    assert (found.stiffness_scatter > 0.2).all()


def test_nothing_is_stated_of_maps_unlike_all_that_were_pressed():
    ridges = np.repeat(heights(Part("gaussian", 0, 128))[:1], 128, axis=0)
    found = contact(Surface.from_map(ridges, 1.0, periodic=True), area=0.1, theory="calibrated")
    assert not found.valid
    assert np.isnan([found.scatter, found.area_scatter, found.stiffness_scatter]).all()


class TestCorrected:
    @pytest.fixture(scope="class", params=[("pitted", 1, 128), ("ground", 0, 128)], ids=["pitted", "ground"])
    @staticmethod
    def part(request):
        values = heights(Part(*request.param))
        surface = Surface.from_map(values, 1.0, periodic=True, unit="um")
        engine, pressure = Contact(values, (128.0, 128.0)), law_loads(surface, (0.07, 0.14, 0.35, 0.55))
        rows = [engine.press(float(each)) for each in pressure]
        return surface, pressure, *np.array([(row["area"], row["mean_separation"]) for row in rows]).T

    def test_it_is_nearer_than_the_law_and_within_its_scatter(self, part):
        surface, pressure, area, u = part
        found, law = (contact(surface, pressure=pressure, theory=theory) for theory in ("corrected", "calibrated"))
        assert found.theory == "corrected"
        errors = [
            (np.log(one.area / area), (one.mean_separation - u) * found.stiffness / pressure) for one in (found, law)
        ]
        assert np.square(errors[0]).mean() < np.square(errors[1]).mean()
        assert (np.abs(errors[0][0]) < 3 * found.area_scatter).all()
        assert (np.abs(errors[0][1]) < 3 * found.scatter).all()
        assert found.valid.all()

    def test_its_curve_holds_together(self, part):
        surface = part[0]
        theory = of_map("corrected", surface)
        u = np.geomspace(*theory.rows[2, [-1, 0]], 2001)
        found = contact(surface, mean_separation=u, theory="corrected")
        assert (np.diff(found.pressure) < 0).all()
        work = np.sum((found.pressure[1:] + found.pressure[:-1]) / 2 * np.diff(u))
        assert work == pytest.approx(np.ptp(theory.rows[3]), rel=0.02)
        assert contact(surface, area=0.1, theory="corrected").leakage.x > 0


class TestDefaultTheory:
    """Of a map: corrected, where that is possible within seconds."""

    @staticmethod
    def surface(points=128, **options):
        return Surface.from_map(heights(Part("milled", 1, points)), 1.0, **{"periodic": True, "unit": "um"} | options)

    def test_a_map_is_corrected(self):
        surface = self.surface()
        found = contact(surface, pressure=[0.0, 1e-6, 0.01, 0.03, 0.2])
        assert found.theory == contact_law(surface).theory == "corrected"
        assert Scene(surface, pressures=[0.01], effects=["area"]).theory == "corrected"
        # any pressure is answered, and where none was tested is told
        assert (np.diff(found.area) > 0).all()
        assert found.area[0] == 0
        assert found.valid.tolist() == [True, False, True, True, False]
        assert contact(surface, separation=2 * float(surface.h_max)).pressure == 0
        assert contact(surface.combined(surface), pressure=0.01).theory == "calibrated"
        assert theory_name(surface, None, variant="printed") == "mbma"

    @pytest.mark.parametrize(
        "surface",
        [
            lambda own: own.surface(48),
            lambda own: Surface.from_map(np.random.default_rng(1).standard_normal((64, 64)), 1.0, periodic=True),
            lambda own: Surface.from_map(np.tile(heights(Part("milled", 1, 128)), (6, 6)), 1.0, periodic=True),
            lambda own: Surface.from_spectrum([0.1, 1.0], [1.0, 1e-3], h_max=3.0),
        ],
        ids=["small", "not resolved", "large", "spectrum"],
    )
    def test_others_are_calibrated(self, surface):
        assert contact(surface(self), area=0.1).theory == "calibrated"

    def test_its_law_with_a_hardness_is_as_accurate_as_its_answers(self):
        wafer = Surface.from_map("docs/data/maps/top-1.top", short_cutoff="9.4 nm")
        law = contact_law(wafer, E_star="70 GPa", hardness="12 GPa")
        pressure = np.array([0.01, 0.1, 0.5, 2.0, 8.0])
        truth = contact(wafer, pressure=pressure, E_star="70 GPa", hardness="12 GPa")
        np.testing.assert_allclose(law.pressure(truth.mean_separation), pressure, rtol=law.error + truth.error.max())
        assert law.error < 5e-5

    def test_a_map_that_is_not_resolved_is_not_valid(self):
        noise = Surface.from_map(0.1 * np.random.default_rng(1).standard_normal((64, 64)), 1.0, periodic=True)
        found = contact(noise, area=0.1, theory="corrected")
        assert not found.valid
        assert any("sampling steps, fewer than 4" in reason for reason in found.reasons)
