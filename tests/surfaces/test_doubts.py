"""Measurements that may not represent their surface: results are not valid, and the stated remedy works."""

import dataclasses
import re

import numpy as np
import pytest
from helpers import topographies

from generate.machined.artefacts import (
    CUTOFF,
    KINDS,
    bow,
    has_note,
    opened,
    squares,
    step,
    with_artefact,
)
from generate.machined.makers import FAMILIES, Part, finished, heights, rough
from mbma_tables import InputError, OutOfRangeError, Surface, contact
from mbma_tables.surfaces.averages import average
from mbma_tables.theories import Simulated
from mbma_tables.theories.simulated.grids import GRIDS

topographies()


def pasted(found, given, surface=None, **question):
    """The call in a contact's reason with what it leaves out filled in: map and question."""
    call = next(
        match[0]
        for text in found.reasons
        if (match := re.search(r"contact\(.*theory=(?:'\w+'|Simulated\(.*?\))\)", text))
    )
    call = call.replace("Surface.from_map(...", "Surface.from_map(**given")
    names = {"Surface": Surface, "contact": contact, "Simulated": Simulated}
    names |= {"surface": surface or Surface.from_map(**given), "given": given}
    return eval(call.replace("...", "**question"), names | {"question": question})


# a plane is subtracted, and few filled points do nothing
UNSEEN = ("tilt by 1 h_rms", "tilt by 10 h_rms", "1 x 1 undefined on 0.001")
# such a bow may be a wave of the surface itself: it is told, and no doubt
SMALL = [bow(height, axes) for height in (0.35, 0.5, 0.7) for axes in (1, 2)]
SLIGHT = [kind.name for kind in KINDS if " 0." in kind.name and kind.group == "bow"]
SEEN = [kind for kind in KINDS if kind.name not in (*UNSEEN, *SLIGHT)]
# of maps that have a bow, or a highest place that stands alone, by nature
AS_IT_IS = {"confirmed": "bow, highest place"}
PART = Part("eroded", 1, 64)
MAP = heights(PART)


def asked(surface, theory="simulated", area=0.1):
    return contact(surface, area=area, theory=theory)


def of(values, **options):
    return Surface.from_map(values, 1.0, periodic=True, **options)


def with_spikes(share, seed=0):
    """The map with points of both signs, three standard deviations away."""
    rng = np.random.default_rng(seed)
    chosen = rng.random(MAP.shape) < share
    chosen[30, 30] = True
    return MAP + np.where(
        chosen, rng.choice([-3.0, 3.0], MAP.shape) * MAP.std(), 0.0
    ), chosen


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("points", [64, 128])
def test_machined_surfaces_raise_no_doubt(family, points):
    for number in (1, 2, 3):
        values = heights(Part(family, number, points))
        assert of(values, **AS_IT_IS).doubts == ()
        assert opened(values, **AS_IT_IS).doubts == ()


class TestSpikes:
    @pytest.mark.parametrize("share", [0.0, 0.001, 0.006, 0.02])
    @pytest.mark.parametrize("theory", ["simulated", "calibrated"])
    def test_results_are_not_valid_until_they_are_removed(self, share, theory):
        spoilt, _ = with_spikes(share)
        found = asked(of(spoilt), theory)
        assert not found.valid
        reason = next(text for text in found.reasons if "spikes" in text)
        assert re.search(r"\(\.\.\., (outliers=10)\)", reason)

    @pytest.mark.parametrize("share", [0.0, 0.006, 0.02])
    def test_the_remedy_removes_them_and_little_else(self, share):
        spoilt, chosen = with_spikes(share)
        mended = of(spoilt, outliers=10)
        removed = next(
            entry["points"] for entry in mended.provenance if entry["step"] == "outliers"
        )
        assert removed == pytest.approx(chosen.sum(), abs=2)
        assert not any("spikes" in text for text in mended.doubts)
        assert asked(mended).pressure == pytest.approx(asked(of(MAP)).pressure, rel=0.02)

    def test_the_edge_of_a_pillar_is_none(self):
        pillar = 0.1 * heights(Part("gaussian", 1, 64))
        pillar[20:30, 20:30] += 5.0
        assert of(finished(pillar, 5.0)).doubts == ()
        # a cut-off rings where the edge is within one sampling step
        assert not any("spikes" in text for text in of(pillar).doubts)
        assert of(pillar, short_cutoff=4.0).doubts


class TestSharpPlaces:
    """Dust, lost lines and images that do not fit, which a cut-off makes smooth."""

    @pytest.mark.parametrize("artefact", SEEN, ids=lambda artefact: artefact.name)
    @pytest.mark.parametrize("family", ["gaussian", "milled", "worn", "patchy"])
    def test_results_are_not_valid(self, artefact, family):
        values, clean = with_artefact(Part(family, 1, 96), artefact)
        assert opened(clean, **AS_IT_IS).doubts == ()
        assert opened(values).doubts

    @pytest.mark.parametrize("side", [2, 3])
    @pytest.mark.parametrize("hurst", [0.4, 0.6, 0.8, 1.0])
    def test_clusters_on_waves_down_to_the_sampling_step(self, side, hurst):
        clean = rough(np.random.default_rng(3), 128, 16, 2.0, hurst)
        dusty = squares(side, 6e-3, 8.0).plant(np.random.default_rng(4), clean)
        assert opened(clean).doubts == ()
        assert opened(dusty).doubts

    @pytest.mark.parametrize(
        "artefact", [squares(1, 1e-3, 8.0), squares(3, 1e-3, 8.0), step(20.0, 1.5)]
    )
    @pytest.mark.parametrize("periodic", [True, False])
    @pytest.mark.parametrize("unit", [None, "um"])
    def test_whatever_the_unit_and_the_tilt(self, artefact, periodic, unit):
        values, _ = with_artefact(PART, artefact)
        tilted = values if periodic else values + 0.2 * np.arange(64.0)
        assert Surface.from_map(
            1e-3 * tilted, 1e-3, periodic=periodic, short_cutoff=1e-3 * CUTOFF, unit=unit
        ).doubts

    @pytest.mark.parametrize("artefact", [squares(3, 1e-4, 8.0), squares(5, 1e-4, 8.0)])
    def test_the_part_that_is_named_is_valid(self, artefact):
        part = Part("gaussian", 1, 128)
        values, _ = with_artefact(part, artefact)
        found = contact(opened(values), area=0.1, theory="simulated")
        assert not found.valid
        reason = next(iter(found.reasons))
        call = re.search(r"Surface\.from_map\(heights\[.*?\], \.\.\.\)", reason)[0]
        options = f"1.0, short_cutoff={CUTOFF}"
        names = {"Surface": Surface, "heights": values}
        assert asked(eval(call.replace("...", options), names)).valid


class TestHoles:
    @pytest.mark.parametrize(("count", "valid"), [(4, True), (40, False)])
    def test_more_than_a_thousandth_filled_is_not_valid(self, count, valid):
        holed = MAP.copy()
        holed.ravel()[np.random.default_rng(1).choice(MAP.size, count, replace=False)] = (
            np.nan
        )
        # filled points leave waves of two sampling steps
        found = asked(of(holed, short_cutoff=4.0))
        assert bool(found.valid) == valid
        assert valid or "of the points are filled" in next(iter(found.reasons))

    def test_the_shipped_map_with_holes_is_not_valid(self):
        surface = Surface.from_map(
            "docs/data/maps/frt-2.frt", fill="harmonic", short_cutoff=0.0008, outliers=10
        )
        found = asked(surface, area=0.005)
        assert not found.valid
        assert any("0.28 of the points are filled" in text for text in found.reasons)


class TestSeams:
    @pytest.mark.parametrize("axis", [0, 1])
    def test_a_step_between_two_images_is_not_valid(self, axis):
        stitched = np.array(np.moveaxis(MAP, axis, 0))
        stitched[32:] += MAP.std()
        stitched = np.moveaxis(stitched, 0, axis)
        found = asked(Surface.from_map(stitched, 1.0, short_cutoff=4.0))
        assert not found.valid
        reason = next(iter(found.reasons))
        assert f"between {('rows', 'columns')[axis]} 31 and 32" in reason
        parts = re.findall(r"Surface\.from_map\((heights\[.*?\]), \.\.\.\)", reason)
        for part, half in zip(parts, np.split(stitched, 2, axis), strict=True):
            values = eval(part, {"heights": stitched})
            np.testing.assert_array_equal(values, half)
            assert Surface.from_map(values, 1.0).doubts == ()


def bowed(height, names="xy"):
    """The map on a parabola of so many h_rms."""
    along = np.linspace(-1, 1, len(MAP)) ** 2
    form = along[:, None] * ("x" in names) + along * ("y" in names)
    return MAP + height * MAP.std() * (form - form.mean()) / form.std()


def as_read(found, name, heights):
    """The call in a surface's doubt about something, made with its heights."""
    doubt = next(text for text in found.doubts if name in text)
    call = re.search(r"Surface\.from_map\((.*?)\)( |,|$)", doubt)[1]
    given = call.replace("...", "heights, 1.0", 1 if call.startswith("...") else 0)
    given = given.replace("...", "1.0")
    return eval(f"Surface.from_map({given})", {"Surface": Surface, "heights": heights})


class TestBows:
    @pytest.mark.parametrize("names", ["x", "xy"])
    @pytest.mark.parametrize("height", [-3.0, 1.0, 3.0])
    def test_results_are_not_valid_until_it_is_removed(self, height, names):
        values = bowed(height, names)
        spoilt = Surface.from_map(values, 1.0)
        assert not asked(spoilt).valid
        mended = as_read(spoilt, "a bow has", values)
        assert mended.doubts == ()
        same = Surface.from_map(MAP, 1.0, detrend="quadratic")
        assert asked(mended).pressure == pytest.approx(asked(same).pressure, rel=1e-6)

    @pytest.mark.parametrize("option", [{"detrend": "plane"}, {"confirmed": "bow"}])
    def test_a_curved_part_is_valid_if_that_is_said(self, option):
        assert Surface.from_map(bowed(3.0), 1.0, **option).doubts == ()


class TestLostLines:
    @pytest.mark.parametrize("axis", [0, 1])
    @pytest.mark.parametrize("value", [None, 0.0])
    def test_results_are_not_valid_and_a_part_without_them_is(self, axis, value):
        values = np.moveaxis(heights(Part("gaussian", 1, 128)), axis, 0).copy()
        values[[20, 30]] = values[[19, 29]] if value is None else value
        values = np.moveaxis(values, 0, axis)
        spoilt = Surface.from_map(values, 1.0, detrend="plane")
        assert "(20, 30)" in spoilt.doubts[0]
        cut = as_read(spoilt, "an instrument lost", values)
        assert cut.map.heights.shape[axis] == 128 - 31
        assert not any("lost" in text for text in cut.doubts)

    def test_ridges_are_no_lost_lines(self):
        ridges = np.repeat(MAP[:, :1], 64, axis=1) + 1e-3 * MAP[:1]
        assert Surface.from_map(ridges, 1.0, confirmed="bow").doubts == ()


class TestSaturation:
    @pytest.mark.parametrize("sign", [1, -1])
    @pytest.mark.parametrize("bits", [None, 12])
    def test_results_are_not_valid_unless_it_is_confirmed(self, sign, bits):
        values = MAP.copy()
        if bits:
            values = np.ptp(MAP) / 2**bits * np.rint(MAP / np.ptp(MAP) * 2**bits)
        assert of(values).doubts == ()
        clipped = sign * np.minimum(sign * values, np.quantile(sign * values, 0.98))
        assert "exactly the" in of(clipped).doubts[0]
        named = re.search(r"confirmed='(.*?)'", of(clipped).doubts[0])[1]
        assert not any("exactly" in text for text in of(clipped, confirmed=named).doubts)


class TestHighestPlace:
    def test_light_contacts_on_one_place_are_not_valid_until_it_is_confirmed(self):
        x, y = np.indices(MAP.shape) - 30
        lump = MAP + 6 * MAP.std() * np.exp(-(x**2 + y**2) / 2 / 3.0**2)
        spoilt = of(finished(lump, 8.0))
        assert "hang on it alone" in spoilt.doubts[0]
        assert not asked(spoilt, area=0.005).valid
        confirmed = of(finished(lump, 8.0), confirmed=["highest place"])
        assert asked(confirmed, area=0.005).valid
        assert any("confirmed" in str(step) for step in confirmed.provenance)


def clipped_corner():
    values = heights(Part("gaussian", 1, 128)).copy()
    values[70:76, 80:86] = values.max() + values.std()
    return values


def holed_corner():
    values = heights(Part("gaussian", 1, 128)).copy()
    values[70:76, 80:86] = np.nan
    return values


def with_lump():
    values = heights(Part("gaussian", 1, 128))
    x, y = np.indices(values.shape) - 90
    lump = np.exp(-(x**2 + y**2) / 2 / 5.0**2)
    return finished(values + 6 * values.std() * lump, 8.0)


def with_dust():
    return with_artefact(Part("gaussian", 1, 128), squares(3, 1e-4, 8.0))[0]


def with_lost_row():
    values = heights(Part("gaussian", 1, 128)).copy()
    values[100] = values[99]
    return values


def in_two_parts():
    values = heights(Part("gaussian", 1, 128)).copy()
    values[64:] += values.std()
    return values


@pytest.mark.parametrize(
    ("spoilt", "name"),
    [
        (lambda: with_spikes(0.006)[0], "spikes"),
        (lambda: bowed(3.0), "a bow has"),
        (clipped_corner, "exactly the highest value"),
        (holed_corner, "are filled"),
        (with_lump, "hang on it alone"),
        (with_dust, "change within a sampling step"),
        (with_lost_row, "an instrument lost"),
        (in_two_parts, "the heights step by"),
    ],
)
def test_each_remedy_can_be_pasted_and_removes_its_reason(spoilt, name):
    values = spoilt()
    found = contact(Surface.from_map(values, 1.0), area=0.1, theory="calibrated")
    assert not found.valid
    assert any(name in reason for reason in found.reasons)
    mended = as_read(found.surface, name, values)
    assert not any(name in doubt for doubt in mended.doubts)


def variance_of_bow(values):
    """The share of the height variance, but for a plane, in polynomials of second degree."""
    x, y = (axis.ravel() for axis in np.indices(values.shape) - len(values) / 2)
    left = []
    for powers in ((x**0, x, y), (x**0, x, y, x**2, x * y, y**2)):
        basis = np.stack(powers, axis=1)
        fitted = np.linalg.lstsq(basis, values.ravel(), rcond=None)[0]
        left.append(np.var(values.ravel() - basis @ fitted))
    return 1 - left[1] / left[0]


@pytest.mark.parametrize("artefact", SMALL, ids=lambda artefact: artefact.name)
@pytest.mark.parametrize("family", ["gaussian", "worn", "sprayed"])
def test_a_small_bow_is_told_with_what_removes_it(artefact, family):
    values, _ = with_artefact(Part(family, 1, 96), artefact)
    surface = opened(values)
    # the map's own bow may be opposite
    share = variance_of_bow(values)
    assert has_note(surface) == (share > 0.05)
    texts = [step.get("not_valid", step.get("told", "")) for step in surface.provenance]
    told = [text for text in texts if f"a bow has {share:.0%} of" in text]
    assert bool(told) == (share > 0.05)
    assert all("detrend='quadratic'" in text and "removes it" in text for text in told)
    assert not has_note(opened(values, detrend="quadratic"))
    # whoever asked for a plane knows what it leaves, but for most of the heights
    kept = has_note(opened(values, detrend="plane"))
    assert kept == (share > 0.5)


@pytest.mark.parametrize("wrong", ["dust", ["bow", 3], 7, "bow,,spikes"])
def test_only_what_is_known_is_confirmed(wrong):
    with pytest.raises(InputError, match="confirmed must be"):
        of(MAP, confirmed=wrong)


def test_a_short_trace_of_an_unknown_lay_is_not_valid():
    line = MAP[:, 5]
    for theory in ("calibrated", "persson", "mbma"):
        found = contact(Surface.from_profile(line, 1.0), pressure=1e-3, theory=theory)
        assert not found.valid
        assert np.isnan(found.scatter)
        assert "isotropy is assumed" in next(iter(found.reasons))
        assert any("hold" in reason and "trace" in reason for reason in found.reasons)


def test_doubts_go_on_to_what_is_made_of_a_surface():
    trace = Surface.from_profile(MAP[:, 5], 1.0)
    clean = of(MAP)
    for made in (trace.combined(clean), clean.combined(trace), trace.resized(2.0, 1.0)):
        assert made.doubts == trace.doubts
    spoilt = of(with_spikes(0.0)[0])
    assert average([clean, spoilt]).doubts == spoilt.doubts


def test_a_spectrum_without_its_convention_is_not_valid():
    q = np.geomspace(0.1, 10.0, 60)
    given = {"q": q, "C": 1e-4 * np.maximum(q, 0.3) ** -3.6, "h_max": 0.5}
    found = contact(Surface.from_spectrum(**given), pressure=1e-3, theory="calibrated")
    assert not found.valid
    remedies = re.findall(r"convention='(\w+)'", next(iter(found.reasons)))
    assert remedies == ["paper", "isotropic"]
    for remedy in remedies:
        named = Surface.from_spectrum(**given, convention=remedy)
        # with a highest point as of tested surfaces
        high = given | {"h_max": 4 * float(named.h_rms)}
        named = Surface.from_spectrum(**high, convention=remedy)
        assert contact(named, area=0.05, theory="calibrated").valid


class TestSampling:
    """Maps with wavelengths of fewer than four sampling steps."""

    NOISY = MAP + 0.02 * MAP.std() * np.random.default_rng(2).standard_normal(MAP.shape)

    @pytest.mark.parametrize("unit", [None, "um"])
    @pytest.mark.parametrize("step", [1.0, 0.123456])
    @pytest.mark.parametrize("grid", ["quick", "full"])
    @pytest.mark.parametrize("periodic", [True, False])
    def test_a_cutoff_is_chosen_and_named(self, unit, step, grid, periodic):
        given = {"heights": step * self.NOISY, "dx": step, "periodic": periodic}
        given["unit"] = unit
        found = asked(Surface.from_map(**given), Simulated(grid))
        assert found.valid
        named = re.search(r"short_cutoff='?([\d.]+(?: um)?)'?", found.surface.resolution)
        again = asked(Surface.from_map(**given, short_cutoff=named[1]), Simulated(grid))
        assert again.pressure == found.pressure
        assert again.surface.map.heights == pytest.approx(found.surface.map.heights)
        assert named[0] in repr(found)

    def test_a_highest_point_that_was_given_stays(self):
        found = asked(of(self.NOISY, h_max=2.0))
        assert found.surface.h_max == 2.0
        assert found.valid

    def test_a_cutoff_that_was_given_is_simulated_on_a_finer_grid(self):
        shorter = of(self.NOISY, short_cutoff=2.5)
        found = asked(shorter, Simulated("full"))
        assert found.valid
        assert found.elastic_theory.pressed.heights.shape == (128, 128)
        # the same waves on twice as many points a side
        fine = np.zeros((128, 128), complex)
        inner = np.ix_(*(np.r_[0:32, 97:128],) * 2)
        outer = np.ix_(*(np.r_[0:32, 33:64],) * 2)
        fine[inner] = np.fft.fft2(shorter.map.heights)[outer]
        finer = Surface.from_map(4 * np.fft.ifft2(fine).real, 0.5, periodic=True)
        again = asked(finer, Simulated("full"))
        assert found.pressure == pytest.approx(again.pressure, rel=found.area_scatter)

    def test_of_a_large_map_the_reason_names_a_cutoff_that_is_valid(self, monkeypatch):
        few = dataclasses.replace(GRIDS["quick"], most_points=MAP.size)
        monkeypatch.setitem(GRIDS, "quick", few)
        given = {"heights": self.NOISY, "dx": 1.0, "periodic": True}
        found = asked(of(self.NOISY, short_cutoff=2.5))
        assert not found.valid
        assert pasted(found, given, area=0.1).valid

    def test_the_calibrated_law_names_a_call_that_is_valid(self):
        noise = MAP + 0.02 * MAP.std() * np.random.default_rng(2).standard_normal(
            MAP.shape
        )
        given = {"heights": noise, "dx": 1.0, "periodic": True}
        for theory in ("calibrated", "persson", "mbma"):
            found = contact(Surface.from_map(**given), pressure=2e-3, theory=theory)
            assert not found.valid
            assert pasted(found, given, area=0.1).valid

    @pytest.mark.parametrize("bits", [16, 24])
    def test_rounding_of_heights_is_no_wavelength(self, bits):
        # as of an instrument with integers of 16 bits, and of single precision
        least = np.ptp(MAP) / 2**bits
        rounded = of(least * np.rint(MAP / least))
        assert asked(rounded).valid
        assert asked(rounded).pressure == pytest.approx(asked(of(MAP)).pressure, rel=1e-3)

    def test_light_contacts_name_the_grid_that_reaches_them(self):
        found = contact(of(MAP), area=0.002, theory="simulated")
        given = {"heights": MAP, "dx": 1.0, "periodic": True}
        assert pasted(found, given, area=0.002).valid
        # and nothing is named for those that no grid reaches
        lightest = contact(of(MAP), area=5e-4, theory="simulated")
        assert list(lightest.reasons) == [
            "A/A0 is below 0.001, the lightest contact that was tested"
        ]

    @pytest.mark.parametrize("noise", [0.0, 0.02])
    def test_an_average_names_a_scan(self, noise):
        rng = np.random.default_rng(3)
        maps = [
            values + noise * rng.standard_normal(MAP.shape) for values in (MAP, MAP[::-1])
        ]
        both = average([of(values) for values in maps])
        found = contact(both, area=0.1, theory="calibrated")
        given = {"heights": maps[0], "dx": 1.0, "periodic": True}
        assert "surface.scans[0]" in str(found.reasons)
        assert pasted(found, given, surface=both, area=0.1).valid


@pytest.mark.parametrize("pattern", ["sine", "egg-box"])
def test_a_regular_pattern_is_refused_with_its_wavelength(pattern):
    x = np.arange(64.0)
    along = np.sin(2 * np.pi * x / 16)
    values = np.outer(along, along if pattern == "egg-box" else np.ones(64))
    length = "16" if pattern == "sine" else "11.31"
    with pytest.raises(
        OutOfRangeError, match=f"the map holds wavelengths of {length} um only"
    ):
        Surface.from_map(values, 1.0, periodic=True, unit="um")


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("exponent", [0.0, -1.0, -1.8])
def test_peaks_of_a_map_without_short_wavelengths_are_its_own(seed, exponent):
    """White noise of wavelengths from four steps on had single peaks that were called dust."""
    noise = np.fft.rfft2(np.random.default_rng(seed).standard_normal((64, 64)))
    q = np.hypot(np.fft.fftfreq(64)[:, None], np.fft.rfftfreq(64))
    q[0, 0] = 1.0
    band = (q > 3 / 64) & (q < 0.25)
    heights = np.fft.irfft2(np.where(band, noise * q**exponent, 0))
    assert not Surface.from_map(heights, dx=1.0, periodic=True).doubts
