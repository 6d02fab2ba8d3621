"""What is done to a measurement before its spectrum is taken, and what is said of it."""

import math
import re

import numpy as np
import pytest
import scipy.io
import scipy.signal
import xarray as xr
from helpers import random_map, refusals, topographies

from mbma_tables import Surface
from mbma_tables.common.errors import InputError
from mbma_tables.surfaces.measurements import read_measurement
from mbma_tables.surfaces.treatment import Treatment, treat

library = topographies()

# of numpy, to that library, when a test calls it
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")
POINTS = 96
STEP = 0.25
SIDE = POINTS * STEP


def waves(highest=12, seed=4, shape=(POINTS, POINTS)):
    """A periodic sum of a few dozen waves, at most `highest` a side."""
    rng = np.random.default_rng(seed)
    x, y = (np.arange(n) / n for n in shape)
    heights = np.zeros(shape)
    for m, n in rng.integers(-highest, highest + 1, (60, 2)):
        phase = 2 * np.pi * np.add.outer(m * x, n * y) + rng.uniform(0, 6)
        heights += np.cos(phase) / (1 + np.hypot(m, n)) ** 1.5
    return heights - heights.mean()


MAP = waves()
LIST = np.array([(i * STEP, j * STEP, MAP[i, j]) for i in range(40) for j in range(40)])


def write_h5(path, values):
    import h5py

    with h5py.File(path, "w") as file:
        file["heights"] = values


def write_nc(path, values):
    """As any program writes it: that library marks undefined heights in a second field."""
    import xarray as xr

    x, y = (np.arange(count) for count in values.shape)
    xr.Dataset({"heights": (("x", "y"), values)}, {"x": x, "y": y}).to_netcdf(path)


def write_xyz(path, values):
    x, y = np.indices(values.shape) * STEP
    np.savetxt(path, np.column_stack([x.ravel(), y.ravel(), values.ravel()]))


# programs that write a map in a format
WRITERS = {
    ".npy": np.save,
    ".npz": np.savez,
    ".txt": np.savetxt,
    ".csv": lambda path, values: np.savetxt(path, values, delimiter=";"),
    ".xyz": write_xyz,
    ".nc": write_nc,
    ".mat": lambda path, values: scipy.io.savemat(path, {"heights": values}),
    ".h5": write_h5,
}


def treated(heights=MAP, periodic=False, steps=(STEP, STEP), **options):
    return treat(heights, steps, periodic, Treatment(**options))


def told(result, step):
    return " ".join(entry["told"] for entry in result.provenance if entry["step"] == step)


@pytest.mark.parametrize(
    ("mode", "theirs"),
    [
        ("plane", "height"),
        ("quadratic", "curvature"),
        ("median", "median"),
        ("slope", "slope"),
        ("mean", "center"),
    ],
)
def test_trends_are_the_librarys(mode, theirs):
    x = np.linspace(0, 1, POINTS)
    bent = MAP + 3 * x[:, None] - 2 * x[None, :] ** 2 + 7
    other = library.Topography(bent, (SIDE, SIDE)).detrend(theirs).heights()
    found = treated(bent, detrend=mode)
    np.testing.assert_allclose(found.heights, other, atol=1e-12)
    if mode not in ("mean", "plane"):
        np.testing.assert_allclose(found.heights + found.form, bent, atol=1e-12)
    if mode not in ("median", "slope"):
        other = library.UniformLineScan(bent[5], SIDE).detrend(theirs).heights()
        np.testing.assert_allclose(
            treated(bent[5], steps=(STEP,), detrend=mode).heights, other, atol=1e-12
        )


class TestHoles:
    def test_a_few_are_filled_unasked_and_told(self):
        holed = MAP.copy()
        holed[20:24, 30:34] = np.nan
        found = treated(holed)
        assert "16 of 9216 points" in told(found, "fill")
        # harmonic: the mean of the four neighbours, before the plane is taken off
        inside = found.heights[21, 31]
        near = [
            found.heights[21 + i, 31 + j] for i, j in ((0, 1), (1, 0), (0, -1), (-1, 0))
        ]
        assert inside == pytest.approx(np.mean(near), abs=1e-9)
        assert np.isfinite(found.heights).all()

    def test_many_only_when_asked(self):
        holed = np.where(np.random.default_rng(0).random(MAP.shape) < 0.2, np.nan, MAP)
        with pytest.raises(InputError, match="more than 5%: fill them"):
            treated(holed)
        with pytest.raises(InputError, match="every height is undefined"):
            treated(np.full((40, 40), np.nan))
        assert np.isfinite(treated(holed, fill="harmonic").heights).all()


def test_a_bad_pixel_goes_and_little_else():
    spoilt = MAP.copy()
    spoilt[40, 50], spoilt[0, 0] = 30.0, -20.0
    found = treated(spoilt, outliers=10)
    assert "2 of 9216 points" in told(found, "outliers")
    left = np.abs(found.heights - treated(MAP).heights)
    assert left.max() < 0.3 * MAP.std()
    assert left.mean() < 1e-3 * MAP.std()
    clean = treated(outliers=10)
    assert "0 of 9216 points" in told(clean, "outliers")
    np.testing.assert_array_equal(clean.heights, treated().heights)


class TestCutoff:
    @pytest.mark.parametrize("periodic", [True, False])
    def test_gradient_and_variance_that_go(self, periodic):
        whole = treated(periodic=periodic)
        cut = treated(periodic=periodic, short_cutoff=SIDE / 6.5)
        entry = next(e for e in cut.provenance if e["step"] == "short_cutoff")

        def squares(heights):
            if not periodic:
                heights = np.block(
                    [[heights, heights[:, ::-1]], [heights[::-1], heights[::-1, ::-1]]]
                )
            size = heights.shape[0] * STEP
            scan = library.Topography(heights, (size, size), periodic=True)
            return heights.var(), np.mean(
                sum(np.square(part) for part in scan.fourier_derivative())
            )

        before = squares(whole.heights)
        after = squares(cut.heights)
        assert entry["of_variance"] == pytest.approx(1 - after[0] / before[0], rel=1e-9)
        assert entry["of_gradient"] == pytest.approx(1 - after[1] / before[1], rel=1e-9)
        assert 0.1 < entry["of_gradient"] < 0.9
        assert (
            f"the rms gradient is {math.sqrt(after[1] / before[1]):.2f} times"
            in entry["told"]
        )
        assert cut.waves == (0.0, pytest.approx(2 * np.pi * 6.5 / SIDE))

    def test_periodic_waves_are_those_of_the_library(self):
        cut = treated(periodic=True, short_cutoff=3.0, long_cutoff=12.0)
        other = library.Topography(MAP, (SIDE, SIDE), periodic=True)
        other = other.longcut(cutoff_wavelength=12.0).shortcut(cutoff_wavelength=3.0)
        np.testing.assert_allclose(cut.heights, other.heights(), atol=1e-12)
        cut = treated(MAP[3], periodic=True, steps=(STEP,), short_cutoff=3.0)
        other = library.UniformLineScan(
            MAP[3] - MAP[3].mean(), SIDE, periodic=True
        ).shortcut(cutoff_wavelength=3.0)
        np.testing.assert_allclose(cut.heights, other.heights(), atol=1e-12)

    test_refused = staticmethod(
        refusals(
            lambda options: treated(periodic=True, **options),
            ({"short_cutoff": 5.0, "long_cutoff": 4.0}, "long_cutoff must be larger"),
            ({"short_cutoff": 1e9}, "leaves no wavelength"),
            ({"l_filter": 1e-9}, "leaves no wavelength"),
            ({"short_cutoff": -1.0}, "short_cutoff must be a number"),
            ({"outliers": math.nan}, "outliers must be finite"),
            ({"fill": "zero"}, "fill must be one of harmonic"),
        )
    )


class TestFilters:
    @pytest.mark.parametrize(("name", "short"), [("s_filter", True), ("l_filter", False)])
    def test_a_wave_of_the_nesting_index_is_halved(self, name, short):
        x = np.arange(128.0)
        q = 2 * np.pi * np.array([2, 8, 22]) / 128
        values = sum(np.sin(one * x)[:, None] + 0 * x for one in q)
        own = Surface.from_map(
            values, 0.5, periodic=True, unit="um", **{name: 0.5 * 16.0}
        )
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
        assert "times that without" in told(own, "s_filter")
        assert 2 * np.pi / float(own.q1) == pytest.approx(0.388 * 10, rel=0.1)


BOW = (np.arange(64.0)[:, None] - 32) ** 2 / 100
TILT = np.arange(64.0) / 10
SPIKE = np.zeros((64, 64))
SPIKE[10, 20] = 50.0


@pytest.mark.parametrize(
    ("form", "options", "said"),
    [
        (BOW, {}, "a bow has .* detrend='quadratic' removes it"),
        (TILT, {"periodic": True}, "a tilt has .* detrend='plane' removes it"),
        (SPIKE, {}, "1 of 4096 points .* outliers=10 removes them"),
        (BOW, {"detrend": "quadratic"}, None),
        (TILT, {"detrend": "plane"}, None),
        (SPIKE, {"outliers": 10}, None),
        (0.0, {}, None),
    ],
)
def test_what_would_remove_form_and_outliers_is_told(form, options, said):
    found = Surface.from_map(0.02 * random_map(64, 0.1, 0.3) + form, 1.0, **options)
    every = " ".join(told(found, step) for step in ("outliers seen", "detrend"))
    assert re.search(said, every) if said else " removes " not in every


class TestReading:
    def test_rows_of_arrays_in_files_are_x(self, tmp_path):
        values = waves(shape=(64, 48))
        np.save(tmp_path / "a.npy", values)
        np.savetxt(tmp_path / "a.txt", values)
        np.savetxt(tmp_path / "a.csv", values, delimiter=",")
        plain = Surface.from_map(values, 0.5, 0.8)
        for name in ("a.npy", "a.txt", "a.csv"):
            found = Surface.from_map(tmp_path / name, dx=0.5, dy=0.8, unit="um")
            np.testing.assert_allclose(found.map.heights, plain.map.heights, atol=1e-12)
            assert found.map.steps == pytest.approx((0.5, 0.8))
            assert found.rms_gradient == pytest.approx(plain.rms_gradient, rel=1e-9)
            assert found.unit == "um"
            with pytest.raises(
                InputError, match="has no lengths: give the sampling step dx"
            ):
                Surface.from_map(tmp_path / name)

    def test_missing_rows_of_a_list_are_undefined_points(self, tmp_path):
        # a whole row of the map is missing, too
        missing = [3, 77, *range(5 * len(MAP), 6 * len(MAP))]
        full = LIST.copy()
        full[missing, 2] = np.nan
        np.savetxt(tmp_path / "full.txt", full)
        expected = Surface.from_map(tmp_path / "full.txt", fill="harmonic")
        less = np.delete(LIST, missing, axis=0)
        less = less[np.random.default_rng(1).permutation(len(less))]
        np.savetxt(tmp_path / "a.xyz", less, header="Lateral units: um\nValue units: um")
        np.savetxt(tmp_path / "b.csv", less, delimiter=";")
        text = (tmp_path / "b.csv").read_text(encoding="utf-8")
        (tmp_path / "b.csv").write_text(text.replace(".", ","), encoding="utf-8")
        for name, unit in (("a.xyz", "um"), ("b.csv", None)):
            found = Surface.from_map(tmp_path / name, fill="harmonic")
            np.testing.assert_allclose(
                found.map.heights, expected.map.heights, atol=1e-9, rtol=0
            )
            assert found.map.steps == pytest.approx(expected.map.steps)
            assert found.unit == unit
            assert any("were undefined" in str(r.get("told")) for r in found.provenance)

    def test_points_off_a_grid_are_refused(self, tmp_path):
        path = tmp_path / "a.txt"
        step = LIST[1, 1] - LIST[0, 1]
        off = LIST.copy()
        off[7, 1] += 0.4 * step
        twice = np.concatenate([LIST, LIST[5:6]])
        for rows, message in (
            (off, "of a grid|off a grid"),
            (twice, "several heights at one x and y"),
            (np.delete(LIST, slice(40, -40), axis=0)[::3], "of a grid|off a grid"),
            (LIST * [1.0, 0.0, 1.0], "have one y"),
        ):
            np.savetxt(path, rows)
            with pytest.raises(InputError, match=message):
                Surface.from_map(path)

    def test_mixed_decimal_marks_are_refused(self, tmp_path):
        # a reader takes the rows up to the last one with a comma as a header
        path = tmp_path / "a.txt"
        np.savetxt(path, np.c_[np.arange(200.0), MAP.ravel()[:200]])
        lines = path.read_text(encoding="utf-8").splitlines()
        lines[10] = lines[10].replace(".", ",")
        path.write_text("\n".join(lines), encoding="utf-8")
        with pytest.raises(InputError, match="commas in line 11 and none in line 1:"):
            Surface.from_profile(path)

    def test_a_gap_in_a_line_is_refused(self, tmp_path):
        x = np.arange(200.0)
        x[50:] += 3
        np.savetxt(tmp_path / "a.txt", np.c_[x, MAP.ravel()[:200]])
        with pytest.raises(InputError, match="no points between x = 49 and 53"):
            Surface.from_profile(tmp_path / "a.txt")

    def test_a_file_knows_its_lengths_and_unit(self, tmp_path):
        path = tmp_path / "a.nc"
        library.Topography(MAP, (SIDE, SIDE), unit="nm").to_netcdf(str(path))
        found = Surface.from_map(path, model="measured")
        assert found.unit == "nm"
        assert found.h_rms == pytest.approx(
            Surface.from_map(MAP, STEP, model="measured").h_rms, rel=1e-6
        )
        with pytest.raises(InputError, match="has its own lengths"):
            read_measurement(path, dx=1.0)
        other = Surface.from_map(path, unit="um", short_cutoff=2e-3)
        expected = Surface.from_map(path, short_cutoff=2.0).to("um")
        assert (other.unit, other.q1, other.h_rms) == (
            "um",
            pytest.approx(expected.q1),
            pytest.approx(expected.h_rms),
        )
        with pytest.raises(InputError, match="has channels 0 to 0, not 3"):
            read_measurement(path, channel=3)

    @pytest.mark.parametrize(
        ("header", "unit", "scale"),
        [
            ("# 2024-05-03, probe 7\n# X(mm);Y(mm);Z(mm)", "mm", 1),
            ("x[\xb5m]\ty[\xb5m]\tz[nm]", "um", 1e-3),
            ("# [um]", "um", 1),
            ("x y z [V]", None, 1),
        ],
    )
    def test_units_in_the_header_of_points(self, tmp_path, header, unit, scale):
        (tmp_path / "a.xyz").write_text(
            "\n".join([header, *(" ".join(map(str, p)) for p in LIST)]), "latin-1"
        )
        found = Surface.from_map(tmp_path / "a.xyz")
        plain = Surface.from_map(MAP[:40, :40], STEP)
        assert found.unit == unit
        assert found.h_rms == pytest.approx(scale * plain.h_rms, rel=1e-9)
        assert found.q1 == pytest.approx(plain.q1, rel=1e-9)
        if unit == "um":
            other = Surface.from_map(tmp_path / "a.xyz", unit="mm")
            assert other.h_rms == pytest.approx(1e-3 * found.h_rms, rel=1e-9)

    def test_a_text_is_no_yes(self):
        with pytest.raises(InputError, match="periodic must be True or False, got 'no'"):
            Surface.from_map(MAP, STEP, periodic="no")

    def test_units_of_a_labelled_array(self):
        plain = Surface.from_map(MAP, STEP)
        own = xr.DataArray(MAP, dims=("x", "y"), attrs={"units": "um"})
        for dx, unit, scale in (
            (STEP, None, 1.0),
            (STEP * 1e-3, "mm", 1e-3),
            (f"{1e3 * STEP} nm", None, 1e3),
        ):
            found = Surface.from_map(own, dx, unit=unit)
            assert found.h_rms == pytest.approx(scale * plain.h_rms, rel=1e-9)
            assert found.rms_gradient == pytest.approx(plain.rms_gradient, rel=1e-9)
            assert found.unit == {1.0: "um", 1e-3: "mm", 1e3: "nm"}[scale]
        with pytest.raises(InputError, match="'V' is no known unit of length"):
            Surface.from_map(own.assign_attrs(units="V"), STEP)
        with pytest.raises(
            InputError,
            match="h_rms is in 'um' by its attribute units, and asked for in 'mm'",
        ):
            Surface(
                0.8, 1.0, 100.0, xr.DataArray(1.0, attrs={"units": "um"}), 3.0, unit="mm"
            )

    def test_units_of_points_that_differ_along_the_axes(self, tmp_path):
        np.savetxt(tmp_path / "a.xyz", LIST, header="x [um] y [mm] z [nm]")
        with pytest.raises(
            InputError, match="names the units um, mm, nm: write x and y in one unit"
        ):
            Surface.from_map(tmp_path / "a.xyz")

    def test_numbers_are_no_units(self, tmp_path):
        # of 64 bit, among which brackets may stand
        heights = MAP.copy()
        heights[3, :2] = np.frombuffer(b"(m) (m) [um]    ")
        np.save(tmp_path / "a.npy", heights)
        assert read_measurement(tmp_path / "a.npy", dx=STEP).unit is None

    @pytest.mark.parametrize("suffix", [".csv", ".txt", ".asc"])
    @pytest.mark.parametrize(
        "separator", [";", "; ", "\t", " ", ", ", "\u00a0", "\u202f"]
    )
    @pytest.mark.parametrize("mark", [".", ","])
    @pytest.mark.parametrize("start", ["", "\ufeff", "heights;in;um\n"])
    def test_every_separator_with_both_decimal_marks(
        self, tmp_path, suffix, separator, mark, start
    ):
        values = np.round(10 * waves(shape=(40, 36)), 3)
        path = tmp_path / f"a{suffix}"
        rows = [
            separator.join(f"{value:.3f}".replace(".", mark) for value in row)
            for row in values
        ]
        path.write_text(start + "\n".join(rows), encoding="utf-8")
        np.testing.assert_array_equal(
            read_measurement(path, dx=1.0, unit="um").heights(), values
        )

    @pytest.mark.parametrize("row", [0, 17])
    def test_a_row_with_a_word_is_refused(self, tmp_path, row):
        lines = [" ".join(f"{value:.3f}" for value in line) for line in MAP]
        lines[row] = "--- " + lines[row].split(" ", 1)[1]
        (tmp_path / "a.txt").write_text("\n".join(lines))
        with pytest.raises(
            InputError, match=f"line {row + 1} holds {POINTS - 1} numbers"
        ):
            Surface.from_map(tmp_path / "a.txt", STEP)

    @pytest.mark.parametrize("digits", [1, 2, 3])
    def test_commas_that_may_be_decimal_are_refused(self, tmp_path, digits):
        values = 7 + waves(shape=(40, 36))
        rows = [
            ",".join(f"{value:.{digits}f}".replace(".", ",") for value in row)
            for row in values
        ]
        (tmp_path / "a.csv").write_text("\n".join(rows))
        with pytest.raises(
            InputError, match=r"are decimal commas\. Write decimal points"
        ):
            read_measurement(tmp_path / "a.csv", dx=1.0)

    def test_whole_numbers_between_commas(self, tmp_path):
        values = np.rint(20000 + 3000 * waves(shape=(40, 36)))
        for offset in (0, 20000):
            np.savetxt(tmp_path / "a.csv", values - offset, delimiter=",", fmt="%d")
            np.testing.assert_array_equal(
                read_measurement(tmp_path / "a.csv", dx=1.0).heights(), values - offset
            )

    def test_two_decimal_marks_are_refused(self, tmp_path):
        (tmp_path / "a.csv").write_text("1,5;2.5\n" * 40)
        with pytest.raises(
            InputError, match="commas inside numbers that also hold points"
        ):
            read_measurement(tmp_path / "a.csv", dx=1.0)

    @pytest.mark.parametrize("suffix", WRITERS)
    @pytest.mark.parametrize("value", [np.inf, -np.inf])
    def test_infinite_heights_are_refused_as_in_an_array(self, tmp_path, suffix, value):
        values = MAP.copy()
        values[3, 4] = value
        path = tmp_path / f"a{suffix}"
        WRITERS[suffix](path, values)
        with pytest.raises(InputError, match="finite"):
            Surface.from_map(path, None if suffix == ".xyz" else STEP)
        with pytest.raises(InputError, match="finite"):
            Surface.from_map(values, STEP)

    @pytest.mark.parametrize("seed", range(5))
    def test_random_bytes_are_no_text(self, tmp_path, seed):
        (tmp_path / "a.csv").write_bytes(np.random.default_rng(seed).bytes(5000))
        with pytest.raises(InputError, match="is no text"):
            Surface.from_map(tmp_path / "a.csv", STEP)

    def test_a_csv_of_words(self, tmp_path):
        (tmp_path / "w.csv").write_text("1,2,3,4,5\na,b,c,d,e\n")
        with pytest.raises(InputError, match="must hold numbers with one separator"):
            read_measurement(tmp_path / "w.csv")


def test_the_window_is_hanns():
    found = treated(MAP[3], steps=(STEP,))
    weights = scipy.signal.windows.hann(2 * POINTS + 1)[
        1::2
    ]  # at the middle of each step
    weights = weights / np.sqrt(np.mean(weights**2))
    expected = weights * (found.heights - np.average(found.heights, weights=weights))
    np.testing.assert_allclose(found.windowed(), expected, atol=1e-12)


def test_lengths_with_their_unit():
    plain = Surface.from_map(MAP, STEP, unit="um", short_cutoff=3.0, model="measured")
    named = Surface.from_map(
        MAP, "250 nm", unit="um", short_cutoff="3e-6 m", model="measured"
    )
    assert named.q1 == pytest.approx(plain.q1, rel=1e-12)
    assert plain.q1 <= 2 * np.pi / 3 * (1 + 1e-9)
    assert named.unit == "um"
    with pytest.raises(InputError, match="whose unit of length is not known"):
        Surface.from_map(MAP, STEP, short_cutoff="3 um")


def test_a_file_of_a_sensofar_microscope(tmp_path):
    """As their .plux files are built: lengths and layers in XML, heights [um] along y first."""
    import zipfile

    heights = MAP[:40, :36].astype("<f4")
    heights[3, 7] = np.nan
    general = {
        "DATE": "Thu Nov 26 10:00:00 2020",
        "IMAGE_SIZE_X": 40,
        "IMAGE_SIZE_Y": 36,
        "FOV_X": 0.5,
        "FOV_Y": 0.25,
    }
    entries = "".join(f"<{name}>{value}</{name}>" for name, value in general.items())
    index = (
        f"<xml><GENERAL>{entries}</GENERAL>"
        "<INFO><ITEM_0><NAME>Device</NAME><VALUE>S neox</VALUE></ITEM_0></INFO>"
        "<LAYER_0><FILENAME_Z>LAYER_0.raw</FILENAME_Z></LAYER_0></xml>"
    )
    path = tmp_path / "a.plux"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("index.xml", index)
        archive.writestr("LAYER_0.raw", heights.T.tobytes())
    surface = Surface.from_map(path, detrend="mean")
    assert surface.unit == "um"
    assert surface.map.steps == pytest.approx((0.5, 0.25))
    known = np.isfinite(heights)
    found = surface.map.heights
    shift = np.mean(found[known] - heights[known])
    np.testing.assert_allclose(found[known], heights[known] + shift, atol=1e-6)
    assert "1 of 1440 points" in told(surface, "fill")
