"""Laws of machined maps, maps from files and spoilt maps, against boundary elements on the maps themselves."""

import dataclasses
import re

import numpy as np
import pytest
from helpers import contact_of, topographies
from scipy.ndimage import gaussian_filter

from generate.boundary_elements.solve import Contact
from generate.machined.makers import Part, finished, heights, rough
from generate.pages import maps
from generate.pages.maps import BARS, ratios, read_rows
from mbma_tables import Bodies, Scene, Surface, contact, contact_law
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.theories import Calibrated, Simulated, resolve
from mbma_tables.theories.simulated.grids import GRIDS, QUICK
from mbma_tables.theories.simulated.own_map import law_loads
from mbma_tables.theories.simulated.pressing import Press


def surface_of(family, number):
    return Surface.from_map(heights(Part(family, number)), 1.0, periodic=True, unit="um")


@pytest.mark.parametrize("number", [2, 3])
def test_gaussian_maps_are_valid(number):
    found = contact(
        surface_of("gaussian", number), area=[0.01, 0.1, 0.5], theory="calibrated"
    )
    assert found.valid.all()
    assert ((found.scatter > 0.02) & (found.scatter < 0.06)).all()
    assert ((found.area_scatter > 0.01) & (found.area_scatter < 0.03)).all()


@pytest.mark.parametrize(
    ("family", "number", "statistic"),
    [
        ("honed", 1, "skewness of heights"),
        ("ground", 1, "anisotropy"),
        ("milled", 3, "kurtosis of slopes"),
    ],
)
def test_other_maps_are_not_and_say_what_helps(family, number, statistic):
    found = contact(
        surface_of(family, number), area=[0.01, 0.1, 0.5], theory="calibrated"
    )
    assert not found.valid.any()
    (reason,) = (text for text in found.reasons if text.startswith(statistic))
    assert reason.endswith("theory='simulated') simulates the map")
    coarse = Surface.from_map(
        surface_of(family, number).map.heights[::2, ::2], 2.0, periodic=True
    )
    remedy = "contact(surface, ..., theory='simulated') simulates the map"
    assert any(remedy in text for text in coarse.departures(by_map=True))
    named = "short_cutoff=8.008"
    assert named in contact(coarse, area=0.1, theory="simulated").surface.resolution
    assert (found.scatter > 0.13).all()
    assert (found.area_scatter > 0.07).all()
    assert (found.stiffness_scatter > 0.2).all()


def test_nothing_is_stated_of_maps_unlike_all_that_were_pressed():
    ridges = np.repeat(heights(Part("gaussian", 0, 128))[:1], 128, axis=0)
    found = contact(
        Surface.from_map(ridges, 1.0, periodic=True), area=0.1, theory="calibrated"
    )
    assert not found.valid
    assert np.isnan([found.scatter, found.area_scatter, found.stiffness_scatter]).all()


class TestQuickGrid:
    @pytest.fixture(
        scope="class",
        params=[("pitted", 1, 128), ("ground", 0, 128)],
        ids=["pitted", "ground"],
    )
    @staticmethod
    def part(request):
        pytest.importorskip("tamaas")
        values = heights(Part(*request.param))
        surface = Surface.from_map(values, 1.0, periodic=True, unit="um")
        engine = Contact(values, (128.0, 128.0))
        pressure = law_loads(surface, (0.07, 0.14, 0.35, 0.55))
        rows = [engine.press(float(each)) for each in pressure]
        return (
            surface,
            pressure,
            *np.array([(row["area"], row["mean_separation"]) for row in rows]).T,
        )

    def test_it_is_nearer_than_the_law_and_within_its_scatter(self, part):
        surface, pressure, area, u = part
        found, law = (
            contact(surface, pressure=pressure, theory=theory)
            for theory in (Simulated(grid="quick"), "calibrated")
        )
        assert found.theory == "simulated"
        own, other = (
            (
                np.log(one.area / area),
                (one.mean_separation - u) * found.stiffness / pressure,
            )
            for one in (found, law)
        )
        assert np.square(own).mean() < np.square(other).mean()
        assert (np.abs(own) < 3 * np.array([found.area_scatter, found.scatter])).all()
        assert found.valid.all()


class TestDefaultTheory:
    """Of a map: simulated, where that is possible within seconds."""

    @staticmethod
    def surface(points=128, **options):
        return Surface.from_map(
            heights(Part("milled", 1, points)),
            1.0,
            **{"periodic": True, "unit": "um"} | options,
        )

    def test_a_map_is_simulated(self):
        surface = self.surface()
        found = contact(surface, pressure=[0.0, 1e-6, 0.01, 0.03, 0.2])
        assert found.theory == contact_law(surface).theory == "simulated"
        assert Scene(surface, pressure=[0.01], quantities=["area"]).theory == "simulated"
        # any pressure is answered, and where none was tested is told
        assert (np.diff(found.area) > 0).all()
        assert found.area[0] == 0
        assert found.valid.tolist() == [True, False, True, True, False]
        assert contact(surface, separation=2 * float(surface.h_max)).pressure == 0
        assert contact(surface.combined(surface), pressure=0.01).theory == "calibrated"
        assert resolve(None, surface, "separation").name == "mbma"

    def test_small_ones_and_spectra_are_calibrated(self):
        for surface in (
            self.surface(48),
            Surface.from_spectrum([0.1, 1.0], [1.0, 1e-3], h_max=3.0),
        ):
            assert contact(surface, area=0.1).theory == "calibrated"

    @pytest.mark.parametrize(
        ("shortest", "noise", "cutoff"), [(10.0, 0.0, 0.0), (6.0, 0.02, 8.008)]
    )
    def test_a_large_map_is_simulated_on_half_of_its_points(
        self, monkeypatch, shortest, noise, cutoff
    ):
        """What the half cannot resolve of a raw map is left out, and told."""
        few = dataclasses.replace(QUICK, most_points=64 * 64)
        monkeypatch.setitem(GRIDS, "quick", few)
        rng = np.random.default_rng(3)
        values = finished(rough(rng, 128, 64.0, shortest, 0.8), shortest)
        values = values + noise * values.std() * rng.standard_normal(values.shape)
        surface = Surface.from_map(values, 1.0, periodic=True)
        half = contact(surface, area=[0.01, 0.1, 0.5])
        assert half.theory == "simulated"
        assert half.valid.all()
        assert half.elastic_theory.pressed.heights.shape == (64, 64)
        assert (f"short_cutoff={cutoff}" in half.surface.resolution) == (cutoff > 0)
        assert "simulated, on every second point along each side" in repr(half)
        whole = contact(
            half.surface, pressure=half.pressure, theory=Simulated(grid="full")
        )
        error = np.abs(np.log(half.area / whole.area))
        assert (error < 2 * np.hypot(half.area_scatter, whole.area_scatter)).all()
        flow = half.leakage.x / whole.leakage.x
        assert np.log(flow[:2]) == pytest.approx(0.0, abs=0.1)

    def test_a_cutoff_that_the_half_cannot_resolve_names_the_full_grid(self, monkeypatch):
        few = dataclasses.replace(QUICK, most_points=64 * 64)
        monkeypatch.setitem(GRIDS, "quick", few)
        found = contact(self.surface(128), area=0.1)
        assert not found.valid
        call = re.search(r"theory=(Simulated\(grid='full'\))", str(found.reasons))[1]
        assert contact(self.surface(128), area=0.1, theory=eval(call)).valid

    def test_its_law_with_a_hardness_is_as_accurate_as_its_answers(self):
        wafer = Surface.from_map("docs/data/maps/top-1.top", short_cutoff="9.4 nm")
        law = contact_law(wafer, Bodies("70 GPa", hardness="12 GPa"))
        pressure = np.array([0.01, 0.1, 0.5, 2.0, 8.0])
        truth = contact(wafer, Bodies("70 GPa", hardness="12 GPa"), pressure=pressure)
        np.testing.assert_allclose(
            law.pressure(truth.mean_separation),
            pressure,
            rtol=law.error + truth.error.max(),
        )
        assert law.error < 5e-5


topographies()


@pytest.mark.slow
@pytest.mark.parametrize("name", BARS)
def test_laws_of_maps_from_files(name):
    path, (force, area, u, _) = maps.path_of(name), read_rows()[name]
    if path is None:
        pytest.skip("no reference maps: set MBMA_REFERENCE_MAPS to their folder")
    by_force, by_gap = np.subtract(
        ratios(Calibrated(), Surface.from_map(path, **BARS[name]), force, area, u), 1
    )
    assert np.abs(by_gap[area >= 0.1]).max() < 0.10
    assert np.abs(by_gap[area >= 0.01]).max() < 0.30
    # of the force microscope's map 12% is not met below 0.9% contact
    assert (
        np.abs(by_force[area >= (0.002 if name == "al3d-1.al3d" else 0.009)]).max() < 0.12
    )
    assert np.abs(by_force[area >= 0.002]).max() < 0.21
    surface = Surface.from_map(path)
    for theory in ("calibrated", "mbma"):
        found = contact(surface, mean_separation=0.5 * surface.h_max, theory=theory)
        assert found.pressure > 0
        assert found.area > 0
    assert any(
        "area depends on resolution" in entry.get("told", "")
        for entry in surface.provenance
    )


# files of instruments among the examples of SurfaceTopography, with what its own tests hold of
# them: points, sides, unit, and whether points are undefined
INSTRUMENTS = {
    "opd-1.opd": ((640, 480), (0.125909140, 0.094431855), "mm", True),
    "plux-1.plux": ((2583, 1023), (1666.034951, 659.83498), "um", True),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", INSTRUMENTS)
def test_files_of_instruments(name):
    path = maps.path_of(name)
    if path is None:
        pytest.skip("no reference maps: set MBMA_REFERENCE_MAPS to their folder")
    points, sides, unit, has_holes = INSTRUMENTS[name]
    surface = Surface.from_map(path, fill="harmonic", outliers=10, detrend="quadratic")
    assert surface.map.heights.shape == points
    steps = np.divide(sides, points)
    np.testing.assert_allclose(surface.map.steps, steps, rtol=1e-6)
    assert surface.unit == unit
    filled = [step for step in surface.provenance if step["step"] == "fill"]
    assert bool(filled) == has_holes
    assert contact(surface, area=0.1).pressure > 0


@pytest.mark.slow
def test_held_out_maps_that_are_stretched_or_not_gaussian():
    seen = set()
    for name, surface, rows in maps.simulated():
        force, area, u = rows[:, (rows[1] >= 0.01) & (rows[1] <= 0.97)]
        by_force, by_gap = ratios(Calibrated(), surface, force, area, u)
        assert np.abs(by_force - 1).max() < 0.12, name
        if name.startswith("stretched"):
            assert np.abs(by_gap - 1).max() < 0.15, name
            # others with a lay as strong are off by more
            assert not contact(
                surface, mean_separation=u, theory="calibrated"
            ).valid.any()
        seen.add(name)
    assert len(seen) >= 18


def test_no_answer_beyond_where_the_tops_and_valleys_of_a_map_leave_no_gap():
    surface = Surface.from_map("docs/data/maps/top-1.top", short_cutoff="9.4 nm")
    for wanted in (
        {"area": [0.01, 0.3]},
        {"mean_separation": [1.0, 0.0]},
        {"pressure": [1e-3, 0.02]},
    ):
        with pytest.raises(OutOfRangeError) as refused:
            contact_of(surface, **wanted, theory="calibrated")
        assert refused.value.mask.tolist() == [False, True]
    law = contact_law(surface, theory="calibrated")
    last = contact(surface, separation=law.lowest, theory="calibrated")
    assert 0.1 < last.area < 0.12
    assert law.pressure(separation=law.lowest) == pytest.approx(last.pressure, rel=1e-6)


def test_one_stiffness_over_a_range_of_forces_is_told():
    surface = Surface.from_map(
        "docs/data/maps/frt-2.frt", fill="harmonic", outliers=10, short_cutoff="0.8 mm"
    )
    found = contact(surface, area=[0.01, 0.3, 0.6], theory="calibrated")
    assert found.stiffness[1] == pytest.approx(found.stiffness[2])
    masks = [
        mask.tolist()
        for reason, mask in found.reasons.items()
        if "stiffness is constant" in reason
    ]
    assert masks == [[False, True, True]]
    with pytest.raises(OutOfRangeError, match="separation vanishes"):
        contact(surface, pressure=0.1, theory="calibrated")


POINTS = 256
STEP = 50.0
LOADS = (0.0105, 0.02, 0.06, 0.15, 0.35)  # from 2% to 60% contact


def spoilt(heights, seed):
    """The same blurred, with noise, tilted, with holes and a bad pixel; no longer periodic."""
    rng = np.random.default_rng(1000 + seed)
    x = np.arange(POINTS) / POINTS
    found = gaussian_filter(heights, 0.6, mode="wrap") + 0.01 * rng.standard_normal(
        heights.shape
    )
    found += np.add.outer(rng.uniform(-20, 20) * x, rng.uniform(-20, 20) * x)
    found[rng.random(heights.shape) < 0.01] = np.nan
    for i, j in rng.integers(20, POINTS - 20, (3, 2)):
        found[i : i + 3, j : j + 4] = np.nan
    found[tuple(rng.integers(10, POINTS - 10, 2))] = 60.0
    return found


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("seed", range(10))
def test_a_spoilt_map_answers_as_the_clean_one(seed):
    # a periodic map with a roll-off at four waves a side, eight points along its shortest wave
    k = np.hypot(np.fft.fftfreq(POINTS, 1 / POINTS)[:, None], np.arange(POINTS // 2 + 1))
    amplitude = np.where(
        (k > 0) & (k <= 32),
        np.maximum(k, 4) ** (-1 - (0.5, 0.8, 0.6, 0.9, 0.7)[seed % 5]),
        0,
    )
    noise = np.fft.rfft2(np.random.default_rng(seed).standard_normal((POINTS, POINTS)))
    heights = np.fft.irfft2(amplitude * noise)
    heights /= heights.std()
    gradient = Surface.from_map(heights, STEP, periodic=True).rms_gradient
    force, (area, u, _) = Press(heights, (POINTS * STEP, POINTS * STEP), gradient).loads(
        gradient * np.array(LOADS), False
    )
    assert 0.0195 < area[0] < 0.03
    assert area[-1] > 0.57
    surface = Surface.from_map(
        spoilt(heights, seed), STEP, outliers=10, short_cutoff=8 * STEP * (1 - 1e-9)
    )
    np.testing.assert_allclose(
        contact(surface, pressure=force, theory="calibrated").area, area, rtol=0.10
    )
    np.testing.assert_allclose(
        contact(surface, mean_separation=u, theory="calibrated").pressure,
        force,
        rtol=0.20,
    )
