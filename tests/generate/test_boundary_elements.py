"""The boundary-element campaign: its engine against closed forms, its surfaces, its file."""

import dataclasses
import os
import pickle
import subprocess
import sys

import disturbed
import numpy as np
import pytest
import xarray as xr

from generate import files
from generate.boundary_elements.run import SOLVERS, TEXTS, dataset, group, run
from generate.boundary_elements.solve import Contact, simulate
from generate.boundary_elements.surfaces import (
    HELD_OUT_SPECTRUM,
    SPLITS,
    TRAINING,
    Recipe,
    Task,
    campaign,
    heights,
)
from generate.calibrated_file import write_part
from mbma_tables import InputError
from mbma_tables.surfaces.bearing_curve import FRACTIONS, bearing

pytest.importorskip("tamaas")
SQUARE = (1.0, 1.0)
RECIPE = Recipe("self_affine", 0.8, 8, 2, 5, 64)


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
def test_wavy_surface_against_westergaard(share):
    # mean pressure p over p* = pi E* amplitude/wavelength: A/A0 = (2/pi) asin(sqrt(p/p*))
    # (Westergaard 1939)
    amplitude = 0.01
    points = 512
    wave = amplitude * np.cos(2 * np.pi * np.arange(points) / points)
    full = np.pi * amplitude
    contact = Contact(np.tile(wave[:, None], (1, 8)), (1.0, 8 / points), 1e-9)
    result = contact.press(share * full)
    assert result["area_raw"] == pytest.approx(
        2 / np.pi * np.arcsin(np.sqrt(share)), abs=2 / points
    )
    # a row of flat strips of half width a gives by -(2 L/(pi E*)) ln sin(pi a/L) a mean pressure (Sadowsky 1928), here
    # -(L/(pi E*)) ln s as sin(pi a/L)^2 = s = p/p*; the mean gap is its integral over p from there to p*
    s = share
    assert result["mean_separation"] == pytest.approx(
        amplitude * (1 - s + s * np.log(s)), rel=2e-3
    )


def test_sphere_against_hertz():
    # Hertz (1882), E* = R = 1: F = 4 a^3/3, pressure (2 a/pi) sqrt(1 - r^2/a^2), whose mean
    # of -r^2/2 is -a^2/5
    points = 192
    radius = 0.12
    x = (np.arange(points) + 0.5) / points - 0.5
    contact = Contact(-(x[:, None] ** 2 + x[None, :] ** 2) / 2, SQUARE, 1e-9)
    result = contact.press(4 * radius**3 / 3)
    assert result["area"] == pytest.approx(np.pi * radius**2, rel=0.01)
    assert np.asarray(contact.model.traction).max() == pytest.approx(
        2 * radius / np.pi, rel=0.01
    )
    assert result["pressure_weighted_height"] == pytest.approx(-(radius**2) / 5, rel=0.01)


def test_force_is_the_derivative_of_energy():
    surface = heights(RECIPE)
    surface /= bearing(surface, SQUARE).gradient
    contact = Contact(surface, SQUARE, 1e-9)
    forces = np.geomspace(0.08, 0.12, 9)
    results = [contact.press(force) for force in forces]
    energy, gap, height = (
        np.array([r[k] for r in results])
        for k in ("energy", "mean_separation", "pressure_weighted_height")
    )
    np.testing.assert_allclose(height, gap + 2 * energy / forces, rtol=1e-7)
    work = -np.sum((forces[1:] + forces[:-1]) / 2 * np.diff(gap))
    assert energy[-1] - energy[0] == pytest.approx(work, rel=1e-3)


def test_spectrum_and_anisotropy_are_those_asked_for():
    # h_rms and gradient of fixed amplitudes |k|^-(1+H) on the lattice
    k = np.hypot(*np.meshgrid(np.arange(-16, 17), np.arange(-16, 17)))
    lattice = k[(k >= 2) & (k <= 16)]
    gradient = np.sqrt(np.sum(lattice**-1.6) / np.sum(lattice**-3.6)) * 2 * np.pi
    known = bearing(heights(RECIPE), SQUARE)
    assert (known.gradient, known.h_rms) == pytest.approx((gradient, 1), rel=1e-12)
    stretched = Recipe("stretched", 0.8, 8, 4, 1, 128, 4.0)
    assert bearing(heights(stretched), stretched.sizes).anisotropy == pytest.approx(
        4, rel=1e-6
    )


def test_seed_gives_the_same_surface_on_every_grid():
    fine = heights(dataclasses.replace(RECIPE, points=256))
    np.testing.assert_allclose(fine[::4, ::4], heights(RECIPE), atol=1e-12)


@pytest.mark.parametrize(
    ("kind", "shape"), [("peaks", 0.5), ("valleys", 0.5), ("worn", 1.0), ("patchy", 0.6)]
)
def test_transforms_skew_and_normalise(kind, shape):
    z = heights(Recipe(kind, 0.8, 4, 4, 3, 128, shape))
    assert abs(z.mean()) < 1e-12
    assert z.std() == pytest.approx(1)
    skewness = np.mean(z**3)
    kurtosis = np.mean(z**4)
    assert {
        "peaks": skewness > 0.5,
        "valleys": skewness < -0.5,
        "worn": skewness < -0.3,
    }.get(kind, kurtosis > 3.5)


def test_bearing_of_a_paraboloid():
    n = 401
    x = (np.arange(n) - n // 2) / n
    heap = np.maximum(1 - 8 * (x[:, None] ** 2 + x[None, :] ** 2), 0)
    known = bearing(heap, SQUARE)
    # M(a) of the cap: the mean height of its highest share falls linearly
    share = FRACTIONS[60]
    base = np.pi / 8
    top = 1 - heap.mean()
    assert known.mean_height[60] == pytest.approx(top - share / base / 2, abs=2e-4)


def test_design_holds_out_whole_spectra_and_whole_surfaces():
    tasks = campaign()
    assert len({task.recipe.name for task in tasks}) == len(tasks)

    def spectra(split):
        return {
            dataclasses.replace(task.recipe, seed=0)
            for task in tasks
            if task.split == split
        }

    assert not spectra(TRAINING) & spectra(HELD_OUT_SPECTRUM)
    assert {r.kind for r in spectra(TRAINING)} == {
        r.kind for r in spectra(HELD_OUT_SPECTRUM)
    }
    assert len({task.recipe.seed for task in tasks}) > 150


def test_runs_resumes_and_collects(tmp_path):
    tasks = [
        Task(RECIPE, "training"),
        Task(dataclasses.replace(RECIPE, seed=6), "held_out_surface"),
    ]
    run(tasks[:1], tmp_path)
    before = (tmp_path / f"{RECIPE.name}.npz").stat().st_mtime_ns
    target = tmp_path / "evidence.nc"
    write_part(target, dataset(tasks, tmp_path), "elastic")
    run(tasks, tmp_path)
    assert (tmp_path / f"{RECIPE.name}.npz").stat().st_mtime_ns == before
    write_part(target, dataset(tasks, tmp_path), "elastic")
    with xr.open_dataset(target, group="elastic") as data:
        assert data.split.values.tolist() == [SPLITS.index(task.split) for task in tasks]
        assert all(
            "units" in v.attrs or "flag_meanings" in v.attrs
            for v in data.data_vars.values()
        )
        own = simulate(RECIPE)
        np.testing.assert_array_equal(
            data.area[0, : len(own["force"])], own["area"].astype("f4")
        )
        np.testing.assert_allclose(
            data.band_energy[0, : len(own["force"])], own["band_energy"], rtol=2.0**-10
        )
        np.testing.assert_allclose(
            own["band_energy"][:15].sum(axis=1), own["energy"][:15], rtol=1e-6
        )
        identity = data.mean_separation + 2 * data.energy / data.force
        np.testing.assert_allclose(data.pressure_weighted_height, identity, atol=1e-6)


@pytest.mark.parametrize("kind", list(TEXTS["groups"]))
def test_groups_name_the_code_that_made_them(kind):
    made = group(kind, {}, engine="x").attrs
    assert set(made) >= set(files.dataset(kind).attrs) - {"versions", "code_sha256"}
    assert made["title"] == files.dataset(kind).attrs["title"]


@pytest.mark.parametrize("kind", ["hardness", "leakage"])
def test_other_campaigns_keep_what_their_files_hold(kind, tmp_path):
    tasks = [Task(Recipe("self_affine", 0.8, 4, 2, 5, 32), "training")]
    run(tasks, tmp_path, solve=SOLVERS[kind])
    shipped = files.dataset(kind)
    assert set(dataset(tasks, tmp_path, kind).variables) == set(shipped.variables)
    assert len(campaign(kind)) == shipped.sizes["surface"]


def test_parts_solve_the_same_surfaces(tmp_path):
    tasks = [
        Task(Recipe("self_affine", 0.8, 4, 2, seed, 32), "training") for seed in range(5)
    ]
    run(tasks, tmp_path / "all", solve=_heights)
    run(tasks, tmp_path / "parts", solve=_heights, part=(1, 2))
    first = {path.name for path in (tmp_path / "parts").iterdir()}
    assert first == {f"{task.recipe.name}.npz" for task in tasks[::2]}
    run(tasks, tmp_path / "parts", solve=_heights, part=(2, 2))
    for task in tasks:
        found = []
        for folder in ("all", "parts"):
            with np.load(tmp_path / folder / f"{task.recipe.name}.npz") as content:
                found.append(content["heights"])
        assert np.array_equal(found[0], heights(task.recipe))
        np.testing.assert_equal(*found)
    with pytest.raises(InputError, match="1 <= k <= n"):
        run(tasks, tmp_path / "parts", part=(3, 2))


@pytest.mark.slow
def test_a_campaign_gives_the_same_bits_however_it_was_run(tmp_path, monkeypatch):
    """In one run, two parts, on a cluster with a worker that is killed and one that is slow, and after SIGKILL."""
    pytest.importorskip("distributed")
    tasks = [
        Task(dataclasses.replace(RECIPE, seed=seed), "training") for seed in range(5)
    ]
    run(tasks, tmp_path / "once", solve=disturbed.press)
    for part in (1, 2):
        run(tasks, tmp_path / "parts", part=(part, 2), solve=disturbed.press)
    monkeypatch.setenv("MBMA_TEST_MARKS", str(tmp_path / "cluster.marks"))
    run(tasks, tmp_path / "cluster", solve=disturbed.press_or_end, local_cluster=2)
    assert {*(tmp_path / "cluster.marks").read_text().split()} == {"killed", "slow"}
    program = (
        "import pathlib, pickle, sys, disturbed\n"
        "from generate.boundary_elements.run import run\n"
        "tasks = pickle.load(sys.stdin.buffer)\n"
        "run(tasks, pathlib.Path(sys.argv[1]), solve=disturbed.press_or_end)\n"
    )
    monkeypatch.setenv("MBMA_TEST_MARKS", str(tmp_path / "killed.marks"))
    done = subprocess.run(
        [sys.executable, "-c", program, str(tmp_path / "killed")],
        input=pickle.dumps(tasks),
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
        check=False,
        capture_output=True,
    )
    assert done.returncode == -9, done.stderr
    # those before it are there, whole
    assert len([*(tmp_path / "killed").iterdir()]) == disturbed.KILLED
    run(tasks, tmp_path / "killed", solve=disturbed.press_or_end)
    files = {path.name for path in (tmp_path / "once").iterdir()}
    assert files == {f"{task.recipe.name}.npz" for task in tasks}
    for folder in ("parts", "cluster", "killed"):
        assert {path.name for path in (tmp_path / folder).iterdir()} == files
        for name in files:
            with (
                np.load(tmp_path / "once" / name) as once,
                np.load(tmp_path / folder / name) as other,
            ):
                assert once["traction"].max() > 0
                np.testing.assert_equal({**other}, {**once})


def _heights(recipe):
    """A solver that is quick: what is solved is not looked at here."""
    return {"heights": heights(recipe)}


def test_failures_come_last_and_are_named(tmp_path, monkeypatch):
    monkeypatch.setattr("generate.boundary_elements.solve.MAX_ITERATIONS", 2)
    tasks = [
        Task(RECIPE, "training"),
        Task(dataclasses.replace(RECIPE, seed=6), "training"),
    ]
    with pytest.raises(RuntimeError, match=rf"2 of 2 surfaces failed: {RECIPE.name}"):
        run(tasks, tmp_path)
    assert not list(tmp_path.iterdir())
    with pytest.raises(InputError, match="no surface of this campaign is in"):
        dataset(tasks, tmp_path)


def test_loads_of_large_surfaces_are_kept_one_by_one(tmp_path, monkeypatch):
    import generate.boundary_elements.solve as solve

    monkeypatch.setattr(solve, "WIDE_LOADS", (0.1, 0.4, 0.02))
    for name in ("whole", "stopped"):
        (tmp_path / name).mkdir()
    whole = solve.simulate_wide(RECIPE, tmp_path / "whole")
    press = solve.boundary_elements.BoundaryElementContact.press
    pressed = []

    def stopped(self, force):
        if len(pressed) == 2:
            raise KeyboardInterrupt
        pressed.append(force)
        return press(self, force)

    monkeypatch.setattr(solve.boundary_elements.BoundaryElementContact, "press", stopped)
    folder = tmp_path / "stopped"
    with pytest.raises(KeyboardInterrupt):
        solve.simulate_wide(RECIPE, folder)
    path = folder / f"{RECIPE.name}.npz"
    assert not solve.is_solved(path, RECIPE)
    pressed.clear()
    run(
        [Task(RECIPE, TRAINING)],
        folder,
        solve=lambda one: solve.simulate_wide(one, folder),
    )
    # one load alone was left
    assert pressed == [0.02]
    assert solve.is_solved(path, RECIPE)
    found = dataset([Task(RECIPE, TRAINING)], folder, "bandwidth")
    for name in ("area", "mean_separation", "energy"):
        np.testing.assert_allclose(found[name][0], whole[name], rtol=1e-3)
    # the solver of this campaign against Tamaas
    surface, _, _ = solve.prepared(heights(RECIPE), RECIPE.sizes, RECIPE.q0)
    tamaas = Contact(surface, SQUARE)
    for k, force in enumerate(found.force.values[0]):
        other = tamaas.press(force)
        assert other["area"] == pytest.approx(float(found.area[0, k]), rel=2e-3)
