"""Routes that take a table by its file; each answers what the shipped table does, within both tables' errors."""

import json
import os
import pickle
import shutil
import subprocess

import numpy as np
import pytest
from click.testing import CliRunner
from helpers import refused
from small_tables import small_table

from mbma_tables import (
    Joint,
    Scene,
    Surface,
    contact,
    contact_law,
    island,
    sensitivity,
)
from mbma_tables.cli import main
from mbma_tables.common.errors import InputError, TableFileError
from mbma_tables.design.scenes.plan import certified_error
from mbma_tables.export.model.c_code import write_code
from mbma_tables.export.page.explorer import explorer_page
from mbma_tables.tables.open import open_table
from mbma_tables.tables.schema import KINDS
from mbma_tables.tables.writer import write_table
from mbma_tables.theories import Mbma

SURFACE = Surface(0.8, 1.0, 30.0, 1.0, 3.0)
GAP = 2.0
SCENE = """
theory = "mbma"
island_model = {model!r}
quantities = ["pressure"]
separation = [2.0]
rtol = 0.05
[surface]
hurst = 0.8
q0 = 1.0
q1 = 30.0
h_rms = 1.0
h_max = 3.0
"""


JOINT = """
bodies = "1 GPa"
theory = "mbma"
island_model = {model!r}
outside = "exact"
[part_a]
hurst = 0.8
Rq = "1 um"
h_max = "3 um"
longest = "6.28 um"
shortest = "0.21 um"
"""


def is_file(table):
    return table not in KINDS


@pytest.fixture(scope="module", params=["universal", "island4d"])
def path(request, tmp_path_factory):
    file = tmp_path_factory.mktemp("own") / f"{request.param}-own.nc"
    return write_table(file, small_table(request.param))


def by_contact(table, folder):
    theory = Mbma(island_model=table)
    return contact(SURFACE, separation=GAP, theory=theory).pressure


def by_many(table, folder):
    gaps = np.linspace(GAP, 2.5, 40)
    theory = Mbma(island_model=table)
    return contact(SURFACE, separation=gaps, theory=theory).pressure[0]


def by_law(table, folder):
    u = (GAP + SURFACE.h_max) / 2
    return contact_law(
        SURFACE, 1.0, Mbma(island_model=table, outside="exact", rtol=1e-2)
    ).pressure(u)


def by_scene(table, folder):
    scene = Scene(SURFACE, separation=[GAP], theory=Mbma(island_model=table), rtol=0.05)
    assert 0 < scene.plan().error < 0.1
    return scene.run()["pressure"].values[0]


def by_scene_file(table, folder):
    (folder / "scene.toml").write_text(SCENE.format(model=str(table)))
    return Scene.from_toml(folder / "scene.toml").run()["pressure"].values[0]


def by_command(table, folder):
    numbers = "--hurst 0.8 --q0 1 --q1 30 --h-rms 1 --h-max 3 --separation 2"
    asked = ["contact", *numbers.split(), "--json", "--island-model", str(table)]
    result = CliRunner().invoke(main, asked)
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)["columns"]["pressure"][0]


def by_island(table, folder):
    return island(SURFACE, 1.0, island_model=table).force


def by_joint(table, folder):
    theory = Mbma(island_model=table)
    return Joint(SURFACE, bodies=1.0, theory=theory).at(separation=GAP).pressure


def by_joint_file(table, folder):
    # of a path that is relative to the file, as of maps
    name = os.path.relpath(table, folder) if is_file(table) else table
    (folder / "joint.toml").write_text(JOINT.format(model=name))
    return Joint.from_toml(folder / "joint.toml").at(separation="2 um").pressure


def by_joint_command(table, folder):
    (folder / "joint.toml").write_text(JOINT.format(model=str(table)))
    asked = ["joint", str(folder / "joint.toml"), "--pressure", "50MPa", "--json"]
    result = CliRunner().invoke(main, asked)
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)["columns"]["area"][0]


def by_sensitivity(table, folder):
    theory = Mbma(island_model=table)
    found = sensitivity(SURFACE, separation=GAP, theory=theory, quantities=["pressure"])
    return found.answers["pressure"]


def by_plan(table, folder):
    """The plan's error is the largest bound of the table, and its cost that of the kind of table."""
    scene = Scene(SURFACE, separation=[GAP], theory=Mbma(island_model=table), rtol=0.05)
    plan = scene.plan()
    (step,) = (step for step in plan.steps if step.island_model is not None)
    largest = open_table(table).content.local_error.max()
    assert step.error == pytest.approx(step.rtol + largest)
    kind = open_table(table).name
    alike = Scene(SURFACE, separation=[GAP], theory=Mbma(island_model=kind), rtol=0.05)
    assert plan.seconds == alike.plan().seconds > 0
    found = scene.run()
    assert found.attrs["error"] > 0
    return found["pressure"].values[0]


PROGRAM = """
#include <stdio.h>
#include "mbma_model.h"
int main(void)
{
    const mbma_surface surface = {0.8, 1.0, 30.0, 1.0, 3.0};
    mbma_contact found;
    if (mbma_total_of(&surface, 2.0, 1.0, 1e-8, &found) != MBMA_OK)
        return 1;
    return printf("%.17g", found.force) < 0;
}
"""


def by_c(table, folder):
    if shutil.which("cc") is None:
        pytest.skip("no C compiler")
    written = write_code(folder, table=table)
    (folder / "own.c").write_text(PROGRAM)
    sources = [path.name for path in written if path.suffix == ".c"]
    sources.remove("mbma_selftest.c")
    command = ["cc", "own.c", *sources, "-lm", "-o", "own"]
    subprocess.run(command, cwd=folder, check=True)
    done = subprocess.run(["./own"], cwd=folder, check=True, capture_output=True)
    return float(done.stdout)


ROUTES = [
    *(by_contact, by_many, by_law, by_scene, by_scene_file, by_command, by_island),
    *(by_joint, by_joint_file, by_joint_command, by_sensitivity, by_plan, by_c),
]


@pytest.mark.parametrize("route", ROUTES)
def test_routes_that_take_a_tables_file(route, path, tmp_path):
    """Small tables are accurate to a few percent, so that they are told from the shipped one."""
    shipped = float(np.squeeze(route("universal", tmp_path)))
    found = float(np.squeeze(route(path, tmp_path)))
    assert found == pytest.approx(shipped, rel=0.1)
    assert found != shipped
    assert float(np.squeeze(route(str(path), tmp_path))) == found


def test_the_page_of_the_explorer_refuses_a_table_by_name(path, tmp_path):
    """It holds the shipped table; another one is neither taken nor left out silently."""
    with pytest.raises(InputError, match="with the shipped table of islands, got Mbma"):
        explorer_page(SURFACE, theory=Mbma(island_model=path))
    out = tmp_path / "page.html"
    numbers = [
        "--hurst",
        "0.8",
        "--q0",
        "1",
        "--q1",
        "30",
        "--h-rms",
        "1",
        "--h-max",
        "3",
    ]
    asked = ("explore", *numbers, "--island-model", str(path), "--out", str(out))
    assert "No such option '--island-model'" in refused(*asked)
    assert not out.exists()


def test_a_law_through_a_coarse_table_of_four_numbers_is_within_its_error(tmp_path):
    file = write_table(tmp_path / "coarse.nc", small_table("island4d"))
    coarse = Mbma(island_model=file, outside="exact", rtol=1e-2)
    law = contact_law(SURFACE, 1.0, coarse)
    gaps = np.linspace(0.3, 2.8, 26)
    exact = contact(
        SURFACE, separation=gaps, theory=Mbma(island_model="exact", rtol=1e-8)
    )
    for name in ("pressure", "area"):
        found = getattr(law, name)(separation=gaps)
        difference = np.abs(found / getattr(exact, name) - 1)
        assert difference.max() <= law.error
        # the coarse table is what is seen, not the shipped one
        assert difference.max() > 1e-6
    assert pickle.loads(pickle.dumps(law)).pressure(1.0) == law.pressure(1.0)


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ({"island_model": 5}, "island_model must be one of .*, or the file of a table"),
        ({"island_model": "nowhere.nc"}, r"nowhere\.nc: cannot be read"),
        ({"island_model": "exact", "theory": "calibrated"}, "island_model"),
        ({"outside": "zero"}, "outside must be one of"),
    ],
)
def test_wrong_options_of_a_joints_file_are_refused_by_name(entries, message, tmp_path):
    part = {"Rq": "1 um", "hurst": 0.8, "longest": "6 um", "shortest": "0.2 um"}
    joint = {"bodies": "1 GPa", "part_a": part} | entries
    with pytest.raises((InputError, TableFileError), match=message):
        Joint.from_entries(joint, tmp_path / "joint.toml")


def test_theories_of_one_file_are_equal(path):
    assert Mbma(island_model=path) == Mbma(island_model=str(path)) != Mbma()
    assert "data" in repr(Mbma(island_model=path)) or "Model(" in repr(
        Mbma(island_model=path)
    )


def test_the_largest_bound_of_a_file_is_its_error(path):
    content = open_table(path).content
    assert certified_error(open_table(path), 1e-6) == content.local_error.max()


def test_what_is_no_table_is_refused_by_name(tmp_path):
    with pytest.raises(TableFileError, match=r"nowhere\.nc"):
        Mbma(island_model="nowhere.nc")
    (tmp_path / "text.nc").write_text("no table")
    with pytest.raises(TableFileError, match=r"text\.nc: is not a table file"):
        Mbma(island_model=tmp_path / "text.nc")
    with pytest.raises(InputError, match="the file of a table"):
        contact(SURFACE, separation=GAP, theory=Mbma(island_model="univresal"))


def test_a_table_of_another_variant_is_refused_by_name(tmp_path):
    file = write_table(tmp_path / "mine.nc", small_table("island4d"))
    theory = Mbma(island_model=file, variant="printed")
    with pytest.raises(InputError, match="made for the variant 'reported', not for 'pr"):
        contact(SURFACE, separation=GAP, theory=theory)
