"""Simulations that are kept: a table of one's own surface, the cache, and laws in other languages."""

import dataclasses
import json
import os
import pathlib

import netCDF4
import numpy as np
import pytest
from helpers import contact_of, refused, run
from scipy.special import erf
from small_tables import edited

from generate.machined.makers import Part, heights
from mbma_tables import Scene, Surface, contact, contact_law, sensitivity
from mbma_tables.common import cache
from mbma_tables.common.errors import ConvergenceError, InputError, TableFileError
from mbma_tables.theories import BoundaryElements, Simulated
from mbma_tables.theories.simulated import boundary_elements, pressing
from mbma_tables.theories.simulated.energy_spline import LoadCurve
from mbma_tables.theories.simulated.grids import FULL as FULL_GRID
from mbma_tables.theories.simulated.grids import GRIDS

pytest.importorskip("tamaas")

FULL = Simulated(grid="full")


@pytest.fixture(scope="module")
def surface():
    return Surface.from_map(heights(Part("milled", 1, 64)), 1.0, periodic=True, unit="um")


@pytest.fixture(scope="module")
def file(surface, tmp_path_factory):
    path = tmp_path_factory.mktemp("own") / "own.nc"
    BoundaryElements.of(surface).to_netcdf(path)
    return path


@pytest.fixture(scope="module")
def own(file):
    return BoundaryElements.from_netcdf(file).surface


def test_it_opens_without_the_map(surface, own):
    assert own.map is None
    for theory in (None, "calibrated"):
        found = contact(own, "1 GPa", area=[0.01, 0.1, 0.5], theory=theory)
        known = contact(surface, "1 GPa", area=[0.01, 0.1, 0.5], theory=theory or FULL)
        assert found.theory == known.theory
        for name in (
            "pressure",
            "mean_separation",
            "stiffness",
            "energy",
            "scatter",
            "error",
            "valid",
        ):
            np.testing.assert_array_equal(getattr(found, name), getattr(known, name))
        np.testing.assert_array_equal(
            [found.leakage.x, found.leakage.y], [known.leakage.x, known.leakage.y]
        )
    hard = {"pressure": 0.005, "hardness": 0.05}
    # a law of hardness without the map, simulated with it
    assert contact_of(own, **hard).yielded == pytest.approx(
        contact_of(surface, **hard, theory=FULL).yielded, abs=0.1
    )
    assert own.provenance[0]["points"] == [64, 64]
    with pytest.raises(InputError, match="this surface has none"):
        contact(own, area=0.1, theory=Simulated(grid="quick"))


def test_laws_scenes_and_other_units(surface, own):
    law = contact_law(own)
    known = contact_law(surface, theory=FULL)
    np.testing.assert_array_equal(law.block, known.block)
    found = Scene(own, pressure=[0.01, 0.02]).run()
    np.testing.assert_allclose(found.area, contact(own, pressure=[0.01, 0.02]).area)
    moved = contact(own.to("mm"), pressure=0.01)
    one = contact(own, pressure=0.01)
    assert moved.mean_separation == pytest.approx(1e-3 * one.mean_separation)
    np.testing.assert_allclose(moved.leakage.K, 1e-9 * one.leakage.K)
    # all lengths twice as large, along the plane and across: nothing changes but these;
    # heights alone: slopes
    steep = contact(own.resized(2.0, 1.0), pressure=0.02)
    assert (steep.area, steep.energy) == (
        pytest.approx(one.area),
        pytest.approx(4 * one.energy),
    )
    assert (
        contact(own.between(float(own.q0), float(own.q1) / 1.5), pressure=0.01).theory
        == "calibrated"
    )
    assert sensitivity(own, pressure=0.01).slopes["heights"]["area"] < -0.5


def test_damaged_edited_and_other_files_are_refused(file, tmp_path):
    content = file.read_bytes()
    bad = tmp_path / "bad.nc"
    for broken in (
        content[:-10],
        content[:2000],
        content[:3000] + b"x" + content[3001:],
        b"",
    ):
        bad.write_bytes(broken)
        with pytest.raises(TableFileError, match="mbma fit MAP --simulate --out"):
            BoundaryElements.from_netcdf(bad)
    sealed = edited(
        tmp_path / "edited.nc",
        content,
        lambda dataset: dataset["pressure"].__setitem__(0, 1e-9),
    )
    for path, match in (
        (sealed, "do not match their hash"),
        ("tables/universal.nc", "not a simulated_map"),
    ):
        with pytest.raises(TableFileError, match=match):
            BoundaryElements.from_netcdf(path)


def test_show_and_verify(file, tmp_path):
    with netCDF4.Dataset(file) as dataset:
        assert "SHA-256" in dataset.source
        assert all(
            variable.long_name and variable.units
            for variable in dataset.variables.values()
        )
        assert (dataset["mean_separation"].units, dataset["C"].units) == ("um", "um^4")
    table = json.loads(run("tables", "show", file, "--json"))
    assert table["attributes"]["mbma_kind"] == "simulated_map"
    assert table["variables"]["area"]["largest"] > 0.9
    (verdict,) = json.loads(run("tables", "verify", file, "--json"))["tables"]
    assert verdict["points"] >= 12
    assert verdict["table_error"] < 1e-9
    assert "hashes match; 14 simulated loads" in run("tables", "verify", file)
    bad = tmp_path / "bad.nc"
    bad.write_bytes(file.read_bytes().replace(b"mbma fit MAP", b"mbma fit PAM"))
    assert "mbma fit MAP --simulate" in refused("tables", "verify", bad)


def test_exports_have_the_leakage_along_an_axis(file, own, tmp_path):
    out = tmp_path / "law.py"
    words = ("--map", file, "--E-star", "1GPa", "--leakage", "--direction")
    run("export", "python-law", *words, "y", "--out", out)
    code: dict = {}
    exec(out.read_text(), code)
    gap = np.linspace(0.3, 0.9, 20) * own.h_max
    expected = contact(own, mean_separation=gap).leakage.y
    np.testing.assert_allclose(code["leakage"](own.h_max - gap), expected, rtol=1e-3)
    assert "direction y" in out.read_text()
    run("export", "csv", *words, "30", "--out", tmp_path / "rows.csv")
    rows = np.genfromtxt(tmp_path / "rows.csv", delimiter=",", comments="#")
    rows = rows[np.isfinite(rows).all(axis=1)]
    known = contact(own, 1.0, pressure=rows[5, 0]).leakage.along(30.0)
    assert rows[5, 1] == pytest.approx(known, rel=0.02)
    assert "must be 'x', 'y' or degrees" in refused(
        "export", "csv", *words, "z", "--out", tmp_path / "no.csv"
    )
    assert "ask for leakage" in refused(
        "export", "csv", *words[:4], "--direction", "x", "--out", tmp_path / "no.csv"
    )


def test_on_the_command_line(tmp_path):
    np.save(tmp_path / "map.npy", heights(Part("milled", 1, 64)))
    table = tmp_path / "own.nc"
    words = ("--dx", "1um", "--periodic", "--E-star", "1GPa", "--simulate")
    said = run("fit", tmp_path / "map.npy", *words, "--out", table)
    assert f"{table} has the simulation" in said
    found = json.loads(
        run("contact", "--map", table, "--E-star", "1GPa", "-p", "5MPa", "--json")
    )
    assert found["theory"] == "simulated"
    own = BoundaryElements.from_netcdf(table).surface
    assert found["columns"]["area"] == pytest.approx(
        contact(own, "1 GPa", pressure="5 MPa").area
    )
    assert run("curve", "--map", table, "--points", 7, "--length-unit", "nm")
    assert "leave dx out" in refused(
        "contact", "--map", table, "--dx", "1um", "-a", "0.1"
    )
    assert "not the map" in refused("fit", table)


class TestBeyondTheLoads:
    def test_force_and_stiffness_go_on(self, own):
        theory = Simulated().of(own)
        for u in theory.rows[2, [0, -1]]:
            beside = contact(own, mean_separation=u * (1 + np.array([-1e-9, 1e-9])))
            for name in ("pressure", "stiffness", "area", "energy"):
                assert np.ptp(np.log(getattr(beside, name))) < 1e-6, name
        ends = contact(own, mean_separation=[0.0, float(own.h_max)])
        assert ends.pressure.tolist() == [np.inf, 0.0]
        assert ends.area.tolist() == [1.0, 0.0]

    def test_what_was_not_simulated_is_told(self, own):
        found = contact(own, pressure=[1e-8, 0.01, 0.25])
        assert found.valid.tolist() == [False, True, False]
        assert np.isnan(found.scatter).tolist() == [True, False, True]
        assert (np.diff(found.area) > 0).all()
        # in proportion
        assert found.area[0] / found.pressure[0] == pytest.approx(
            contact(own, pressure=1e-9).area / 1e-9, rel=1e-6
        )
        for given, match in (
            ({"pressure": 1e3}, "less: the mean separation vanishes"),
            ({"area": 1.0}, "less than 1"),
        ):
            with pytest.raises(InputError, match=match):
                contact_of(own, **given)

    def test_closed_forms(self):
        # force (2 - u)^3 and its energy between loads, and beyond them the same
        u = np.linspace(1.9, 1.0, 30)
        force = 0.1 * (2 - u) ** 3
        rows = np.array([force, erf(0.2 * force), u, 0.1 * (2 - u) ** 4 / 4])
        curve = LoadCurve(rows, 2.0)
        light = np.array([1.92, 1.95, 1.999])
        x = np.log(0.1 * (2 - light) ** 3)
        np.testing.assert_allclose(curve.log_force(light), x, rtol=1e-3)
        np.testing.assert_allclose(curve.separation(x), light, rtol=1e-5)
        np.testing.assert_allclose(curve.stiffness(x), 0.3 * (2 - light) ** 2, rtol=3e-3)
        np.testing.assert_allclose(curve.energy(x), 0.1 * (2 - light) ** 4 / 4, rtol=3e-3)
        for heavy in (np.log([0.3, 1.0]), x):
            np.testing.assert_allclose(
                curve.area(heavy), erf(0.2 * np.exp(heavy)), rtol=1e-6
            )
            np.testing.assert_allclose(
                curve.log_force_at(curve.area(heavy)), heavy, atol=1e-9
            )
            np.testing.assert_allclose(
                curve.log_force(curve.separation(heavy)), heavy, atol=1e-9
            )
        # -du/dF and the work of pressing on, by differences
        step = np.log(0.3) + np.array([-1e-5, 1e-5])
        u = curve.separation(step)
        energy = curve.energy(step)
        assert curve.stiffness(np.log(0.3)) == pytest.approx(
            np.diff(np.exp(step))[0] / -np.diff(u)[0], rel=1e-6
        )
        assert np.diff(energy)[0] == pytest.approx(-0.3 * np.diff(u)[0], rel=1e-6)


class TestCache:
    @pytest.fixture
    def place(self, tmp_path, monkeypatch):
        monkeypatch.setenv(cache.VARIABLE, str(tmp_path / "kept"))
        return tmp_path / "kept"

    @staticmethod
    def pressed(times=1.0, unit="um"):
        values = times * heights(Part("milled", 1, 64))
        return BoundaryElements.of(
            Surface.from_map(values, times, periodic=True, unit=unit)
        )

    def test_a_second_process_simulates_nothing(self, place, monkeypatch):
        first = self.pressed()
        flows = first.flows
        monkeypatch.setattr(pressing, "BoundaryElementContact", None)
        monkeypatch.setattr(pressing, "flow_tensor", None)
        for again in (self.pressed(), self.pressed(1e-3, "mm")):
            np.testing.assert_allclose(again.rows[:2], first.rows[:2], rtol=1e-9)
        np.testing.assert_array_equal(self.pressed().flows[1], flows[1])
        np.testing.assert_allclose(
            self.pressed(1e-3, "mm").flows[1], 1e-9 * flows[1], rtol=1e-6
        )

    def test_it_goes_on_where_it_was_interrupted(self, place, monkeypatch):
        real = pressing.BoundaryElementContact
        calls = []

        class Interrupted(real):
            def press(self, force):
                calls.append(force)
                if len(calls) == 5:
                    raise KeyboardInterrupt
                return super().press(force)

        monkeypatch.setattr(pressing, "BoundaryElementContact", Interrupted)
        with pytest.raises(KeyboardInterrupt):
            self.pressed()
        assert len(cache.files()) == 4
        found = self.pressed()
        assert len(calls) == 5 + found.rows.shape[1] - 4
        monkeypatch.setenv(cache.VARIABLE, "off")
        np.testing.assert_allclose(found.rows, self.pressed().rows, rtol=5e-3)

    def test_damaged_files_are_made_anew_and_the_oldest_goes_first(self, place):
        first = self.pressed()
        for path, _ in cache.files():
            path.write_bytes(path.read_bytes()[:100])
        np.testing.assert_array_equal(self.pressed().rows, first.rows)
        cache.trim(0)
        for name, used in (("old", 100), ("new", 300), ("middle", 200)):
            cache.keep(name, values=np.random.default_rng(1).random(1000))
            os.utime(place / f"{name}{cache.SUFFIX}", (used, used))
        assert cache.trim(2 * (place / f"old{cache.SUFFIX}").stat().st_size) == 1
        assert [path.stem for path, _ in cache.files()] == ["middle", "new"]
        assert cache.load("middle", values=(1000,)) is not None
        assert cache.load("middle", values=(999,)) is None
        assert [path.stem for path, _ in cache.files()] == ["new", "middle"]

    def test_files_of_others_in_its_folder_are_neither_counted_nor_removed(self, place):
        place.mkdir()
        of_others = [
            place / name
            for name in (
                "measurement.npz",
                f"{'0' * 64}.npz",
                "notes.txt",
                "cache.npz.draft",
            )
        ]
        for path in of_others:
            path.write_bytes(b"of a user")
        cache.keep("own", values=np.zeros(10))
        assert len(cache.files()) == 1
        assert cache.trim(0) == 1
        cache.keep("own", values=np.zeros(10))
        assert json.loads(run("cache", "--clear", "--json"))["removed"] == 1
        assert sorted(place.iterdir()) == sorted(of_others)
        assert {path.read_bytes() for path in of_others} == {b"of a user"}

    def test_no_flipped_bit_is_an_error_or_another_number(self, place):
        cache.keep("own", row=np.arange(7.0), gap=np.arange(30.0).reshape(5, 6))
        path = place / f"own{cache.SUFFIX}"
        whole = path.read_bytes()
        for bit in range(8 * len(whole)):
            damaged = bytearray(whole)
            damaged[bit // 8] ^= 1 << bit % 8
            path.write_bytes(damaged)
            assert cache.load("own", row=(7,), gap=(5, 6)) is None
        for length in range(len(whole)):
            path.write_bytes(whole[:length])
            assert cache.load("own", row=(7,), gap=(5, 6)) is None
        path.write_bytes(whole)
        np.testing.assert_array_equal(cache.load("own", row=(7,))["row"], np.arange(7.0))
        assert cache.load("own", other=(7,)) is None

    def test_the_command_and_it_may_be_off_or_impossible(
        self, place, monkeypatch, tmp_path
    ):
        cache.keep("one", values=np.zeros(10))
        assert f"{place}: 1 files" in run("cache")
        cleared = {"folder": str(place), "files": 0, "bytes": 0, "removed": 1}
        assert json.loads(run("cache", "--clear", "--json")) == cleared
        monkeypatch.setenv(cache.VARIABLE, "off")
        assert cache.folder() is None
        assert "nothing is kept" in run("cache")
        monkeypatch.setenv(cache.VARIABLE, str(tmp_path / "file"))
        (tmp_path / "file").write_text("no folder")
        assert self.pressed().rows.shape[0] == 4
        monkeypatch.delenv(cache.VARIABLE)
        assert isinstance(cache.folder(), pathlib.Path)
        assert cache.folder().name == "mbma_tables"


class TestLargeMaps:
    @pytest.fixture(autouse=True)
    def few(self, monkeypatch):
        few = dataclasses.replace(FULL_GRID, most_points=32 * 32)
        monkeypatch.setitem(GRIDS, "full", few)

    def test_finely_sampled_ones_lose_nothing(self, monkeypatch):
        part = Part(
            "gaussian", 2, 64
        )  # eight sampling steps along the shortest wavelength
        own = BoundaryElements.of(Surface.from_map(heights(part), 1.0, periodic=True))
        assert own.pressed.heights.shape == (32, 32)
        assert own.points == pytest.approx(4.0, rel=0.05)
        found = contact(own.surface, area=0.2, theory=own)
        assert found.valid
        monkeypatch.setitem(GRIDS, "full", FULL_GRID)
        full = BoundaryElements.of(own.surface)
        assert found.pressure == pytest.approx(
            contact(own.surface, area=0.2, theory=full).pressure, rel=0.05
        )

    def test_others_are_cut_and_say_so(self, tmp_path):
        surface = Surface.from_map(
            0.5 * heights(Part("gaussian", 0, 64)), 0.5, periodic=True, unit="um"
        )
        own = BoundaryElements.of(surface)
        assert own.pressed.left_out == 4.0
        found = contact(surface, area=0.2, theory=own)
        assert not found.valid
        assert (
            next(iter(found.reasons))
            == "wavelengths below 4 were left out, since the grid has fewer points than the map"
        )
        own.to_netcdf(tmp_path / "own.nc")
        again = BoundaryElements.from_netcdf(tmp_path / "own.nc")
        assert again.pressed.left_out == 4.0
        assert BoundaryElements.of(
            again.surface.to("nm")
        ).pressed.left_out == pytest.approx(4000.0)


def test_a_solver_that_fails_is_no_crash(monkeypatch):
    monkeypatch.setenv(cache.VARIABLE, "off")
    monkeypatch.setattr(boundary_elements, "MAX_ITERATIONS", 2)
    surface = Surface.from_map(heights(Part("gaussian", 0, 64)), 1.0, periodic=True)
    with pytest.raises(ConvergenceError, match="boundary elements at F/"):
        BoundaryElements.of(surface)
    assert contact(surface, pressure=1e-3).theory == "calibrated"
