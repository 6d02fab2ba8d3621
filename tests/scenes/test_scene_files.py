"""Mistakes in scene files: one message each, that says what to write instead."""

import json
import pathlib

import pytest

from mbma_tables import Scene
from mbma_tables.common.errors import InputError, MbmaError
from mbma_tables.scenes.problem import EFFECTS, REFINEMENTS
from mbma_tables.scenes.specimen import schema

EXAMPLES = pathlib.Path(__file__).parents[2] / "examples"


def scene(more="", surface='name = "concrete"', effects='on = ["pressure"]', at="separations = [0.5]"):
    """The text of a scene file, less what is None; `more` stands in front of the tables if it is no table itself."""
    tables = {"surface": surface, "effects": effects, "prescribed": at}
    text = "".join(f"[{name}]\n{lines}\n" for name, lines in tables.items() if lines is not None)
    return text + more if more.startswith("[") else f"{more}\n{text}"


MISTAKES = {
    "unknown table": (scene("[efects]\non = []\n"), "did you mean 'effects'"),
    "unknown key": (scene(surface='nme = "concrete"'), "did you mean 'name'"),
    "unknown key of prescribed": (scene(at="separation = 1"), "did you mean 'separations'"),
    "key of another table": (scene("[material]\nhardness = 3.0"), r"it belongs to \[yield\]"),
    "unknown effect": (scene(effects='on = ["presure"]'), "did you mean 'pressure'"),
    "unknown refinement": (scene(effects='on = ["pressure"]\noff = ["subscale"]'), "subscale_area"),
    "unknown surface": (scene(surface='name = "concret"'), "there are yang-persson"),
    "unknown variant": (scene('variant = "printd"'), "did you mean 'printed'"),
    "unknown theory": (
        scene('[comparison]\ntheories = ["person"]', effects='on = ["comparison"]'),
        "did you mean 'persson'",
    ),
    "no surface": (scene(surface=None), "'surface' is a required property"),
    "half a surface": (scene(surface="hurst = 0.8\nq0 = 1.0"), "a surface needs hurst, q0, q1"),
    "name and numbers": (scene(surface='name = "concrete"\nhurst = 0.8'), "leave one of them out"),
    "name and map": (scene(surface='name = "concrete"\nmap = "a.nc"'), "one of name, map, psd or numbers"),
    "missing map": (scene(surface='map = "none.nc"'), "is not a file; paths are relative"),
    "convention without psd": (scene(surface='name = "concrete"\nconvention = "paper"'), "give psd"),
    "another length unit": (scene(surface='name = "concrete"\nlength_unit = "MPa"'), "no known unit of length"),
    "no effects": (scene(effects=None), "'effects' is a required property"),
    "empty effects": (scene(effects="on = []"), "effects.on: .* should be non-empty"),
    "only refinements": (scene(effects='on = ["finite_height"]'), "needs at least one of pressure"),
    "on and off": (
        scene(effects='on = ["area", "subscale_area"]\noff = ["subscale_area"]'),
        "leave it in one of the two lists",
    ),
    "off of an output": (scene(effects='on = ["pressure"]\noff = ["area"]'), "did you mean|known are"),
    "energy of no end": (scene(effects='on = ["energy"]\noff = ["finite_height"]'), "leave finite_height on"),
    "rigid profile": (
        scene(
            "[pressure_profile]\ndeltas = [0.1]",
            effects='on = ["pressure_profile"]\noff = ["sphere_deformation"]',
            at=None,
        ),
        "leave sphere_deformation on",
    ),
    "nothing prescribed": (scene(at=None), "give one of separations"),
    "unknown theory of the scene": (scene('theory = "persons"'), "did you mean 'persson'"),
    "variant of another theory": (
        scene('theory = "persson"\nvariant = "printed"'),
        "variant: of theory 'mbma', not of 'persson'",
    ),
    "pressure and separation": (scene(at="separations = [0.5]\npressures = [0.1]"), "prescribe one of"),
    "below the model's end": (scene(at="separations = [-2.0]"), "at least -h_max"),
    "pressure over h_rms": (scene(at="pressures = [0.01]\nover_h_rms = true"), "leave it out"),
    "pressure without an end": (
        scene(effects='on = ["pressure"]\noff = ["finite_height"]', at="pressures = [0.01]"),
        "leave finite_height on, or give separations",
    ),
    "text for a number": (
        scene(at='separations = ["a"]'),
        "separations must be a number, or one with its unit, got 'a'",
    ),
    "impossible tolerance": (scene("[accuracy]\nrtol = 1e-14"), "rtol: 1e-14 is less than the minimum of 1e-10"),
    "tolerance and time": (scene("[accuracy]\nrtol = 1e-3\nseconds = 1.0"), "one of them"),
    "no time": (scene("[accuracy]\nseconds = 0.0"), "0.0 is less than or equal to the minimum of 0"),
    "half a material": (scene("[material]\nE1 = 3.0"), "all of E1, nu1, E2, nu2"),
    "conductance alone": (scene(effects='on = ["conductance"]'), "needs conductivities"),
    "conductance off": (scene("[conductance]\nk1 = 1.0\nk2 = 1.0"), "add it to the effects"),
    "profile alone": (scene(effects='on = ["pressure_profile"]', at=None), "needs deltas"),
    "table as text": (
        scene('surface = "concrete"', surface=None),
        r"surface: 'concrete' is not of type 'object'; write \[surface\]",
    ),
    "a number beyond doubles": (scene(at=f"separations = [{10**400}]"), "must be real numbers"),
    "lists without end": (scene(at="separations = " + "[" * 100_000), "is not a TOML file"),
    "no toml": ("[surface\n", "is not a TOML file"),
}


def write(folder, text):
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("kind", MISTAKES)
def test_each_mistake_has_a_message_that_says_what_to_write_instead(kind, tmp_path):
    text, words = MISTAKES[kind]
    path = write(tmp_path, text)
    with pytest.raises(InputError, match=words) as fault:
        Scene.from_toml(path)
    message = str(fault.value)
    assert message.startswith(str(path))
    assert "\n" not in message.strip() or kind == "no toml"


PLANNED = {
    "time too short": (scene("[accuracy]\nseconds = 1e-8"), "the cheapest plan takes"),
    "too tight for a law": (scene("[accuracy]\nrtol = 1e-10", effects='on = ["energy"]'), "at best"),
    "unreachable pressure": (scene(at="pressures = [1e6]"), "where the branch ends"),
}


@pytest.mark.parametrize("kind", PLANNED)
def test_what_only_a_plan_or_a_run_can_know(kind, tmp_path):
    text, words = PLANNED[kind]
    with pytest.raises(MbmaError, match=words):
        Scene.from_toml(write(tmp_path, text)).run()


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match="give the path of a scene file"):
        Scene.from_toml(tmp_path / "none.toml")


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("scene_*.toml")), ids=lambda path: path.stem)
def test_examples_are_scenes(path):
    scene = Scene.from_toml(path)
    assert "Scene" in scene.explain()


def test_the_schema_names_what_the_code_knows():
    tables = schema()["properties"]
    assert set(tables["effects"]["properties"]["on"]["items"]["enum"]) == set(EFFECTS)
    assert tuple(tables["effects"]["properties"]["off"]["items"]["enum"]) == REFINEMENTS
    json.dumps(schema(), allow_nan=False)


def test_a_psd_file(tmp_path):
    q = [1.05**k for k in range(100)]
    lines = "\n".join(f"{a} {1e-3 * a**-3.6}" for a in q)
    (tmp_path / "psd.txt").write_text(lines, encoding="utf-8")
    path = write(tmp_path, scene(surface='psd = "psd.txt"\nh_max = 0.3', at="separations = [0.1]"))
    assert float(Scene.from_toml(path).surface.hurst) == pytest.approx(0.8, rel=0.02, abs=0)
    (tmp_path / "psd.txt").write_text("# q C\n")
    with pytest.raises(InputError, match="must hold two columns"):
        Scene.from_toml(path)
