"""Routes that take a table by its file; each answers what the shipped table does, within both tables' errors."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from small_tables import small_table

from mbma_tables import Scene, Surface, contact, contact_law, island
from mbma_tables.cli import main
from mbma_tables.common.errors import InputError, TableFileError
from mbma_tables.design.scenes.plan import certified_error
from mbma_tables.tables.open import open_table
from mbma_tables.tables.writer import write_table
from mbma_tables.theories import Mbma

SURFACE = Surface(0.8, 1.0, 30.0, 1.0, 3.0)
GAP = 2.0
SCENE = """
theory = "mbma"
island_model = {model!r}
[surface]
hurst = 0.8
q0 = 1.0
q1 = 30.0
h_rms = 1.0
h_max = 3.0
[effects]
on = ["pressure"]
[prescribed]
separations = [2.0]
[accuracy]
rtol = 0.05
"""


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
    scene = Scene(
        SURFACE, separations=[GAP], island_model=table, theory="mbma", rtol=0.05
    )
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


ROUTES = [by_contact, by_many, by_law, by_scene, by_scene_file, by_command, by_island]


@pytest.mark.parametrize("route", ROUTES)
def test_routes_that_take_a_tables_file(route, path, tmp_path):
    """Small tables are accurate to a few percent, so that they are told from the shipped one."""
    shipped = float(np.squeeze(route("universal", tmp_path)))
    found = float(np.squeeze(route(path, tmp_path)))
    assert found == pytest.approx(shipped, rel=0.1)
    assert found != shipped
    assert float(np.squeeze(route(str(path), tmp_path))) == found


def test_theories_of_one_file_are_equal(path):
    assert Mbma(island_model=path) == Mbma(island_model=str(path)) != Mbma()
    assert "data" in repr(Mbma(island_model=path)) or "Model(" in repr(
        Mbma(island_model=path)
    )


def test_the_certificate_of_a_file_is_its_error(path):
    stored = open_table(path).content.attributes
    largest = max(stored["largest_error_F"], stored["largest_error_A"])
    assert certified_error(open_table(path), 1e-6) == largest


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
