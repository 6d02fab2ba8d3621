"""Large maps, which are read part by part as means of blocks."""

import tracemalloc

import numpy as np
import pytest
from helpers import topographies

from mbma_tables import Surface
from mbma_tables.common.errors import InputError
from mbma_tables.surfaces import blocks
from mbma_tables.surfaces.treatment import Treatment

topographies()
POINTS = 512
SIDE = 4  # of blocks


@pytest.fixture(autouse=True)
def small_limits(monkeypatch):
    """Limits that a map of 512 x 512 points exceeds, by the same factor as one of 8192 x 8192."""
    monkeypatch.setattr(blocks, "MOST_POINTS", (POINTS // SIDE) ** 2)
    monkeypatch.setattr(blocks, "PART", 128)


def long_waves(shape=(POINTS, POINTS), seed=3):
    """A periodic sum of waves of at least 24 steps, so that no block is steep."""
    rng = np.random.default_rng(seed)
    q = np.hypot(np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1]))
    noise = np.fft.rfft2(rng.standard_normal(shape))
    heights = np.fft.irfft2(np.where((q > 0.004) & (q < 1 / 24), noise, 0), s=shape)
    return heights / heights.std()


MAP = long_waves()


def step_of(surface, name):
    return next((step for step in surface.provenance if step["step"] == name), None)


def test_a_large_file_is_never_loaded_as_a_whole(tmp_path, monkeypatch):
    monkeypatch.setattr(blocks, "PART", POINTS // 8)
    path = tmp_path / "map.npy"
    np.save(path, MAP)
    mapped = blocks.mapped(path)
    assert isinstance(mapped, np.memmap)
    ask = (mapped, (1.0, 1.0), False, Treatment(), None)
    # modules are imported at the first time
    blocks.read_by_blocks(*ask)
    # numpy counts its arrays there, but not pages of a file
    tracemalloc.start()
    read = blocks.read_by_blocks(*ask)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert read.heights.shape == (POINTS // SIDE, POINTS // SIDE)
    # a part of a 64th of the map, with what is made of it
    assert peak < 0.6 * MAP.nbytes


@pytest.mark.parametrize("periodic", [True, False])
def test_blocks_hold_the_means_of_the_map(tmp_path, periodic):
    path = tmp_path / "map.npy"
    np.save(path, MAP.astype("<f4"))
    surface = Surface.from_map(path, "0.5 um", periodic=periodic, detrend="mean")
    expected = MAP.reshape(POINTS // SIDE, SIDE, -1, SIDE).mean(axis=(1, 3))
    np.testing.assert_allclose(surface.map.heights, expected, atol=1e-6)
    assert surface.map.steps == (2.0, 2.0)
    assert surface.unit == "um"
    assert not surface.doubts
    assert (
        "512 x 512 points were read as the means of blocks of 4 x 4"
        in (step_of(surface, "blocks")["told"])
    )
    # an array on the disk, as of a raw file, is read in the same way
    raw = tmp_path / "map.raw"
    MAP.astype("<f4").tofile(raw)
    array = np.memmap(raw, "<f4", "r", shape=MAP.shape)
    other = Surface.from_map(array, "0.5 um", periodic=periodic, detrend="mean")
    np.testing.assert_array_equal(other.map.heights, surface.map.heights)


def test_long_waves_are_those_of_the_whole_map(monkeypatch):
    coarse = Surface.from_map(MAP, 1.0, periodic=True)
    monkeypatch.setattr(blocks, "MOST_POINTS", MAP.size)
    whole = Surface.from_map(MAP, 1.0, periodic=True)
    assert step_of(whole, "blocks") is None
    # the mean of a wave of 24 steps over four of them is sinc(1/6), at each axis
    most = 1 - np.sinc(SIDE / 24) ** 2
    assert 0 < 1 - coarse.h_rms / whole.h_rms < most
    assert 0 < 1 - coarse.rms_gradient / whole.rms_gradient < most


@pytest.mark.parametrize("count", [1, 40])
def test_spikes_are_seen_at_single_points_and_taken_out_of_them(count):
    rng = np.random.default_rng(5)
    spiked = MAP.copy()
    # one of each block that is chosen, at no edge of a part
    chosen = rng.choice((POINTS // 16) ** 2, count, replace=False)
    row, column = np.unravel_index(chosen, (POINTS // 16, POINTS // 16))
    spiked[16 * row + 5, 16 * column + 9] += 3.0
    seen = step_of(Surface.from_map(spiked, 1.0), "spikes")
    assert seen["points"] == count
    assert "outliers=10" in seen["not_valid"]
    mended = Surface.from_map(spiked, 1.0, outliers=10.0)
    assert not mended.doubts
    taken_out = step_of(mended, "outliers")
    assert taken_out["points"] == count
    difference = mended.map.heights - Surface.from_map(MAP, 1.0).map.heights
    assert np.abs(difference).max() < 0.05


def test_lost_lines_and_saturation_are_seen_at_single_points():
    lost = MAP.copy()
    lost[201] = lost[200]
    surface = Surface.from_map(lost, 1.0)
    assert step_of(surface, "lost lines")["points"] == POINTS
    assert any("in 4 of 16 parts" in doubt for doubt in surface.doubts)
    saturated = np.minimum(MAP, np.quantile(MAP, 0.97))
    assert step_of(Surface.from_map(saturated, 1.0), "saturation")["points"] == (
        (saturated == saturated.max()).sum()
    )


def test_undefined_points_count_where_they_are_half_of_a_block():
    holes = MAP.copy()
    holes[0, :2] = np.nan
    holes[4:6, 4:8] = np.nan
    holes[8:12, 8:11] = np.nan
    read = blocks.read_by_blocks(holes, (1.0, 1.0), False, Treatment(), None)
    undefined = np.argwhere(np.ma.getmaskarray(read.heights))
    assert undefined.tolist() == [[2, 2]]
    assert read.heights[0, 0] == pytest.approx(np.nanmean(holes[:4, :4]))
    assert read.heights[1, 1] == pytest.approx(np.nanmean(holes[4:8, 4:8]))


def test_sides_that_blocks_do_not_divide():
    uneven = long_waves((510, 513))
    surface = Surface.from_map(uneven, 1.0)
    assert surface.map.heights.shape == (127, 128)
    assert "the last 2 rows and 1 columns" in step_of(surface, "blocks")["told"]
    # 3 is the largest number that divides both
    with pytest.raises(InputError, match="a periodic map of 510 x 513 points"):
        Surface.from_map(uneven, 1.0, periodic=True)
    # 510 and 520 have 5 and 10 as well as 2
    periodic = Surface.from_map(long_waves((510, 520)), 1.0, periodic=True)
    assert periodic.map.heights.shape == (102, 104)


def test_what_is_no_map_is_refused(tmp_path):
    endless = MAP.copy()
    endless[300, 7] = np.inf
    with pytest.raises(InputError, match="heights"):
        Surface.from_map(endless, 1.0)
    with pytest.raises(InputError, match="every height is undefined"):
        Surface.from_map(np.full_like(MAP, np.nan), 1.0)
    path = tmp_path / "map.npy"
    np.save(path, MAP)
    with pytest.raises(InputError, match="dx"):
        Surface.from_map(path)
    with pytest.raises(InputError, match="channels 0 to 0"):
        Surface.from_map(path, 1.0, channel=1)
    path.write_bytes(path.read_bytes()[: MAP.nbytes // 2])
    with pytest.raises(InputError, match=r"map\.npy is cut short"):
        Surface.from_map(path, 1.0)
