"""The choice of a grid on which a map is simulated."""

import pickle

import numpy as np
import pytest
from helpers import refused, run

from generate.machined.makers import Part, heights
from mbma_tables import InputError, Surface, contact, contact_law
from mbma_tables.theories import Simulated, resolve
from mbma_tables.theories.simulated.grids import GRIDS

AREAS = [0.01, 0.1, 0.5]


def surface_of(part, family="honed"):
    """A map of 64 x 64 points; part 0 has 4.8 points along the shortest wavelength, part 2 eight."""
    return Surface.from_map(heights(Part(family, part, 64)), 1.0, periodic=True)


def test_without_a_choice_a_map_is_simulated_on_the_quick_grid():
    surface = surface_of(1)
    quick = contact(surface, area=AREAS, theory=Simulated(grid="quick"))
    full = contact(surface, area=AREAS, theory=Simulated(grid="full"))
    for theory in (None, "simulated", Simulated()):
        pressed = contact(surface, area=AREAS, theory=theory)
        assert pressed.theory == "simulated"
        np.testing.assert_array_equal(pressed.pressure, quick.pressure)
        assert (pressed.pressure != full.pressure).all()
    law = contact_law(surface, theory=Simulated(grid="full"))
    assert law.at_pressure(full.pressure[1]).area == pytest.approx(0.1, rel=1e-2)


@pytest.mark.parametrize("grid", GRIDS)
def test_light_and_heavy_contacts_are_valid_where_the_grid_was_tested(grid):
    least, most = GRIDS[grid].tested
    areas = np.array([0.97 * least, 1.03 * least, 0.97 * most, 1.03 * most])
    pressed = contact(surface_of(2), area=areas, theory=Simulated(grid))
    assert pressed.valid.tolist() == [False, True, True, False]


def test_half_of_the_points_are_enough_of_a_finely_sampled_map():
    """Its errors by the points that are left are within the scatter that it states."""
    surface = surface_of(2)
    full = contact(surface, area=AREAS, theory=Simulated(grid="full"))
    half = contact(surface, pressure=full.pressure, theory=Simulated(grid="half"))
    assert Simulated(grid="half").of(surface).pressed.heights.shape == (32, 32)
    assert half.valid.all()
    assert (half.area_scatter > full.area_scatter).all()
    assert (np.abs(np.log(half.area / full.area)) < 2 * half.area_scatter).all()


def test_half_of_the_points_of_another_map_leave_wavelengths_out():
    surface = surface_of(0, "gaussian")
    pressed = contact(surface, area=0.1, theory=Simulated(grid="half"))
    assert not pressed.valid
    reason = (
        "wavelengths below 8 were left out, since the grid has fewer points than the "
        "map: contact(surface, ..., theory=Simulated(grid='full')) leaves none out"
    )
    assert reason in pressed.reasons


def test_a_grid_that_is_none_is_refused():
    with pytest.raises(InputError, match="no grid is named 'ful'"):
        Simulated(grid="ful")
    with pytest.raises(InputError, match="needs a height map"):
        resolve("simulated")


def test_a_table_is_of_the_full_grid_alone(tmp_path):
    quick = Simulated(grid="quick").of(surface_of(1))
    with pytest.raises(InputError, match=r"write that of Simulated\(grid='full'\)"):
        quick.to_netcdf(tmp_path / "own.nc")
    assert not list(tmp_path.iterdir())
    # a theory from another process is of the full grid too
    full = pickle.loads(pickle.dumps(Simulated(grid="full").of(surface_of(1))))
    full.to_netcdf(tmp_path / "own.nc")


def test_on_the_command_line(tmp_path):
    path = tmp_path / "map.npy"
    np.save(path, heights(Part("honed", 1, 64)))
    words = (
        "contact",
        "--map",
        path,
        "--dx",
        "1",
        "--periodic",
        "--area",
        "0.002",
        "--csv",
    )
    quick = run(*words)
    full = run(*words, "--grid", "full")
    assert run(*words, "--theory", "simulated", "--grid", "quick") == quick
    assert "Simulated(grid='full')) was tested from 0.001 on" in quick
    assert "tested from" not in full
    assert "grid: options of theory 'simulated' alone, not of 'persson'" in refused(
        *words, "--theory", "persson", "--grid", "full"
    )
