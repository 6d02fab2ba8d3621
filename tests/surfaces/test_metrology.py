"""What metrologists bring: filters by their nesting index, several scans, forms and outliers that are told."""

import dataclasses
import json

import numpy as np
import pytest
from helpers import random_map, run
from scipy.integrate import quad
from scipy.special import ndtri
from scipy.stats import norm

from generate.machined.makers import Part, heights, rough
from mbma_tables import InputError, Surface, contact
from mbma_tables.surfaces.averages import average
from mbma_tables.surfaces.roughness import areal_parameters, core


def told(surface, step):
    return " ".join(entry["told"] for entry in surface.provenance if entry["step"] == step)


class TestFilters:
    @pytest.mark.parametrize(("name", "short"), [("s_filter", True), ("l_filter", False)])
    def test_a_wave_of_the_nesting_index_is_halved(self, name, short):
        x = np.arange(128.0)
        q = 2 * np.pi * np.array([2, 8, 22]) / 128
        values = sum(np.sin(one * x)[:, None] + 0 * x for one in q)
        own = Surface.from_map(values, 0.5, periodic=True, unit="um", **{name: 0.5 * 16.0})
        left = 2 * np.abs(np.fft.fft(own.map.heights[:, 5]))[[2, 8, 22]] / 128
        # ISO 16610-61, alpha = sqrt(ln 2/pi)
        passed = np.exp(-np.pi * (np.sqrt(np.log(2) / np.pi) * 16 / (2 * np.pi / q)) ** 2)
        expected = passed if short else 1 - passed
        # shorter than 0.39 times the nesting index: none is left
        expected = np.where(short & (expected < 0.01), 0.0, expected)
        np.testing.assert_allclose(left, expected, atol=1e-9)
        assert left[1] == pytest.approx(0.5)

    def test_they_are_told_and_limit_the_spectrum(self):
        noise = 0.1 * np.random.default_rng(1).standard_normal((64, 64))
        own = Surface.from_map(noise, 1.0, periodic=True, unit="um", s_filter="10 um")
        assert "an S-filter at 10 um removes" in told(own, "s_filter")
        assert "times larger than without" in told(own, "s_filter")
        assert 2 * np.pi / float(own.q1) == pytest.approx(0.388 * 10, rel=0.1)
        with pytest.raises(InputError, match="leaves no wave"):
            Surface.from_map(heights(Part("gaussian", 0, 64)), 1.0, periodic=True, l_filter=1e-9)


class TestWhatIsTold:
    x = np.arange(64.0)

    def map_with(self, form, **options):
        return Surface.from_map(0.02 * random_map(64, 0.1, 0.3) + form, 1.0, **options)

    def test_a_bow_and_a_tilt(self):
        bowed = self.map_with((self.x[:, None] - 32) ** 2 / 100)
        assert "a bow has" in told(bowed, "detrend")
        assert "detrend='quadratic' removes it" in told(bowed, "detrend")
        tilted = self.map_with(self.x / 10, periodic=True)
        assert "detrend='plane' removes it" in told(tilted, "detrend")
        for flat in (
            self.map_with((self.x[:, None] - 32) ** 2 / 100, detrend="quadratic"),
            self.map_with(self.x / 10, detrend="plane"),
            self.map_with(0.0),
        ):
            assert "removes it" not in told(flat, "detrend")

    def test_a_spike(self):
        spikes = np.zeros((64, 64))
        spikes[10, 20] = 50.0
        assert "1 of 4096 points" in told(self.map_with(spikes), "outliers seen")
        assert "outliers=10 removes them" in told(self.map_with(spikes), "outliers seen")
        assert not told(self.map_with(0.0), "outliers seen")
        assert not told(self.map_with(spikes, outliers=10), "outliers seen")


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
        each = np.array([contact(one, pressure=known.pressure, theory="calibrated").area for one in parts])
        assert found.theory == "calibrated"
        assert (
            np.abs(np.log(found.area / known.area)) < np.sqrt(np.mean(np.log(each / known.area) ** 2, axis=0))
        ).all()
        assert "average of 16 scans: h_rms" in told(mean, "average")
        assert mean.h_rms == pytest.approx(float(whole.h_rms), rel=0.1)

    def test_their_spread_adds_to_the_scatter(self, scans):
        parts, areas, names = scans[1][:4], [0.03, 0.2], ("scatter", "area_scatter", "stiffness_scatter")
        mean = average(parts)
        found, alone = (contact(one, area=areas) for one in (mean, dataclasses.replace(mean, scans=())))
        each = [contact(one, pressure=found.pressure, theory="calibrated") for one in parts]
        # of ln F at equal u, and of the others at equal F
        pressure = [one.mean_separation * found.stiffness / found.pressure for one in each]
        logs = np.log([[one.area for one in each], [one.stiffness for one in each]])
        expected = np.std([pressure, *logs], axis=1, ddof=1)
        added = [np.sqrt(getattr(found, name) ** 2 - getattr(alone, name) ** 2) for name in names]
        np.testing.assert_allclose(added, expected, rtol=1e-3)
        assert (expected > 0.01).all()
        twice, once = (contact(one, area=areas) for one in (average(2 * parts[:1]), parts[0]))
        for name in names:
            np.testing.assert_allclose(getattr(twice, name), getattr(once, name), rtol=1e-6)

    def test_the_average_of_one_scan_twice_is_that_scan(self, scans):
        one = scans[1][0]
        both = average([one, one.to("mm")])
        for theory in ("calibrated", "persson"):
            known = contact(one, pressure=0.01, theory=theory)
            found = contact(both, pressure=0.01, theory=theory)
            assert found.area == pytest.approx(known.area, rel=1e-3)
            assert found.mean_separation == pytest.approx(known.mean_separation, rel=1e-3)
        assert (both.skewness, both.kurtosis) == (pytest.approx(one.skewness), pytest.approx(one.kurtosis))

    def test_refusals(self, scans):
        whole, parts = scans
        for wrong in ([whole], [whole, Surface(0.8, 0.1, 2.0, 1.0, 3.0)], [average(parts), whole]):
            with pytest.raises(InputError, match="two or more"):
                average(wrong)
        with pytest.raises(InputError, match="some do not"):
            average([whole, Surface.from_map(0.3 * random_map(64, 0.1, 0.3), 1.0)])

    def test_on_the_command_line(self, tmp_path):
        for seed in (1, 2):
            np.save(tmp_path / f"{seed}.npy", 0.02 * random_map(64, 0.05, 0.25, seed=seed))
        words = ("--dx", "1um", "--periodic", "--json")
        found = json.loads(run("fit", tmp_path / "1.npy", tmp_path / "2.npy", *words))
        assert found["provenance"][0]["told"].startswith("average of 2 scans")
        one = json.loads(run("fit", tmp_path / "1.npy", *words))
        values = np.load(tmp_path / "1.npy")
        assert one["areal"]["Sq"] == pytest.approx(values.std(), rel=1e-6)
        assert "core [um]: Sk" in run("fit", tmp_path / "1.npy", "--dx", "1um", "--periodic")


SHARES = (np.arange(200_000) + 0.5) / 200_000


def gaussian_core():
    """Of the standard normal distribution: the line over the middle 40%, by integrals of its quantiles."""
    moment = quad(lambda p: (p - 0.5) * -ndtri(p), 0.3, 0.7)[0]
    slope = moment / (2 * 0.2**3 / 3)
    half = -slope / 2
    share = norm.sf(half)
    return 2 * half, 2 * (norm.pdf(half) / share - half), share


def test_gaussian_heights():
    found, (Sk, Spk, Smr1) = core(ndtri(SHARES)), gaussian_core()
    assert found["Sk"] == pytest.approx(Sk, rel=1e-3)
    assert found["Spk"] == pytest.approx(Spk, rel=2e-3)
    assert found["Svk"] == pytest.approx(Spk, rel=2e-3)
    assert (found["Smr1"], found["Smr2"]) == (pytest.approx(Smr1, abs=1e-3), pytest.approx(1 - Smr1, abs=1e-3))


def test_a_plateau_with_straight_valleys():
    # ratio 0 to 0.8 from 1 to 0.9, then straight down to -3: the curve is two lines
    curve = np.where(SHARES < 0.8, 1 - SHARES / 8, 0.9 - (SHARES - 0.8) * 19.5)
    found = core(curve)
    assert found["Sk"] == pytest.approx(0.125, rel=1e-3)
    assert found["Smr2"] == pytest.approx(0.8, abs=2e-3)
    # the triangle between both lines is one already
    lower = 0.875
    assert found["Svk"] == pytest.approx(2 * np.maximum(lower - curve, 0).mean() / 0.2, rel=0.01)
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
