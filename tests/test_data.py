"""The data set of boundary-element simulations: found, described, consistent, and refused where there is none."""

import pathlib
import re
import shutil

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from mbma_tables import TableFileError
from mbma_tables.theories import dataset as data
from mbma_tables.theories.dataset import boundary_elements

GROUPS = [
    "elastic",
    "hardness",
    "leakage",
    "light_loads",
    "machined",
    "measured",
    "rough_spheres",
    "tangential",
]


@pytest.fixture(scope="module")
def tree():
    return boundary_elements()


def test_every_variable_of_every_group_is_described(tree):
    assert sorted(tree.children) == GROUPS
    assert tree.attrs["license"] == "BSD-3-Clause"
    for name, group in tree.children.items():
        assert {"title", "source", "history"} <= set(group.attrs), name
        for key, variable in group.dataset.variables.items():
            assert "long_name" in variable.attrs, (name, key)
            assert "units" in variable.attrs or "flag_meanings" in variable.attrs, (
                name,
                key,
            )


def test_pages_that_shipped_files_name_exist():
    texts = [path.read_text() for path in pathlib.Path("tables").glob("*.csv")]
    for path in pathlib.Path("tables").glob("*.nc"):
        texts += [str(group.attrs) for group in data.read_groups(path).values()]
    pages = {page for text in texts for page in re.findall(r"docs/[\w/]+\.md", text)}
    assert len(pages) > 3
    assert [page for page in pages if not pathlib.Path(page).exists()] == []


def test_energy_gap_and_stiffness_agree(tree):
    elastic = tree["elastic"].to_dataset()
    weighted = elastic.mean_separation + 2 * elastic.energy / elastic.force
    assert float(np.abs(weighted - elastic.pressure_weighted_height).max()) < 1e-6
    # the stiffness is by a spline, the energy the solver's: dU/d ln F = F^2/k
    ratios = []
    for number in range(elastic.sizes["surface"]):
        one = elastic.isel(surface=number).dropna("load", subset=["stiffness"])
        log_force = np.log(one.force.values)
        integral = CubicSpline(
            log_force, one.force.values**2 / one.stiffness.values
        ).antiderivative()(log_force)
        ratio = np.diff(integral) / np.diff(one.energy.values)
        ratios.append(
            np.log(ratio[(one.area.values[1:] > 0.01) & (one.area.values[:-1] < 0.9)])
        )
    assert np.std(np.concatenate(ratios)) < 0.01


def test_a_copy_elsewhere_is_opened_and_checked(tree, tmp_path, monkeypatch):
    copy = tmp_path / "copy.nc"
    shutil.copy(data.FILE, copy)
    assert boundary_elements(copy)["hardness"].sizes == tree["hardness"].sizes
    copy.write_bytes(copy.read_bytes()[:-200])
    with pytest.raises(TableFileError, match="cut short"):
        boundary_elements(copy)
    monkeypatch.setattr(data, "FILE", tmp_path / "absent.nc")
    with pytest.raises(
        TableFileError, match="wheels do not contain the BEM data set; give the path"
    ):
        boundary_elements()
