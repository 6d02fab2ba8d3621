"""Mistakes in scene files: one message each, that says what to write instead."""

import json
import pathlib

import pytest

from mbma_tables import Scene
from mbma_tables.common.errors import InputError, MbmaError
from mbma_tables.scenes.problem import EFFECTS, REFINEMENTS
from mbma_tables.scenes.specimen import schema

EXAMPLES = pathlib.Path(__file__).parents[2] / "examples"
SURFACE = '[surface]\nname = "concrete"\n'
ON = '[effects]\non = ["pressure"]\n'
AT = "[prescribed]\nseparations = [0.5]\n"

MISTAKES = {
    "unknown table": (SURFACE + ON + AT + "[efects]\non = []\n", "did you mean 'effects'"),
    "unknown key": ('[surface]\nnme = "concrete"\n' + ON + AT, "did you mean 'name'"),
    "unknown key of prescribed": (SURFACE + ON + "[prescribed]\nseparation = 1\n", "did you mean 'separations'"),
    "unknown key of accuracy": (SURFACE + ON + AT + "[accuracy]\nrtoll = 1e-3\n", "did you mean 'rtol'"),
    "unknown key of material": (SURFACE + ON + AT + "[material]\nE = 3.0\n", "did you mean 'E[12]'"),
    "key of another table": (SURFACE + ON + AT + "[material]\nhardness = 3.0\n", r"it belongs to \[yield\]"),
    "unknown effect": (SURFACE + '[effects]\non = ["presure"]\n' + AT, "did you mean 'pressure'"),
    "unknown refinement": (SURFACE + '[effects]\non = ["pressure"]\noff = ["subscale"]\n' + AT, "subscale_area"),
    "unknown surface": ('[surface]\nname = "concret"\n' + ON + AT, "there are yang-persson"),
    "unknown variant": ('variant = "printd"\n' + SURFACE + ON + AT, "did you mean 'printed'"),
    "unknown theory": (
        SURFACE + '[effects]\non = ["comparison"]\n' + AT + '[comparison]\ntheories = ["person"]\n',
        "did you mean 'persson'",
    ),
    "no surface": (ON + AT, "'surface' is a required property"),
    "empty surface": ("[surface]\n" + ON + AT, "a surface needs hurst"),
    "half a surface": ("[surface]\nhurst = 0.8\nq0 = 1.0\n" + ON + AT, "a surface needs hurst, q0, q1"),
    "name and numbers": ('[surface]\nname = "concrete"\nhurst = 0.8\n' + ON + AT, "leave one of them out"),
    "name and map": ('[surface]\nname = "concrete"\nmap = "a.nc"\n' + ON + AT, "one of name, map, psd or numbers"),
    "missing map": ('[surface]\nmap = "none.nc"\n' + ON + AT, "is not a file; paths are relative"),
    "missing psd": ('[surface]\npsd = "none.txt"\nh_max = 1.0\n' + ON + AT, "is not a file"),
    "convention without psd": ('[surface]\nname = "concrete"\nconvention = "paper"\n' + ON + AT, "give psd"),
    "another length unit": ('[surface]\nname = "concrete"\nlength_unit = "MPa"\n' + ON + AT, "no known unit of length"),
    "hurst above one": (
        "[surface]\nhurst = 1.8\nq0 = 1.0\nzeta_1 = 50\nh_rms = 0.1\nh_max = 0.3\n" + ON + AT,
        r"hurst must be in \(0, 1\]",
    ),
    "no effects": (SURFACE + AT, "'effects' is a required property"),
    "empty effects": (SURFACE + "[effects]\non = []\n" + AT, "effects.on: .* should be non-empty"),
    "only refinements": (SURFACE + '[effects]\non = ["finite_height"]\n' + AT, "needs at least one of pressure"),
    "on and off": (
        SURFACE + '[effects]\non = ["area", "subscale_area"]\noff = ["subscale_area"]\n' + AT,
        "leave it in one of the two lists",
    ),
    "off of an output": (SURFACE + '[effects]\non = ["pressure"]\noff = ["area"]\n' + AT, "did you mean|known are"),
    "energy of no end": (
        SURFACE + '[effects]\non = ["energy"]\noff = ["finite_height"]\n' + AT,
        "leave finite_height on",
    ),
    "rigid profile": (
        SURFACE
        + '[effects]\non = ["pressure_profile"]\noff = ["sphere_deformation"]\n[pressure_profile]\ndeltas = [0.1]\n',
        "leave sphere_deformation on",
    ),
    "effects as text": (SURFACE + '[effects]\non = "pressure"\n' + AT, "effects.on: 'pressure' is not of type 'array'"),
    "nothing prescribed": (SURFACE + ON, "give one of separations"),
    "unknown theory of the scene": ('theory = "persons"\n' + SURFACE + ON + AT, "did you mean 'persson'"),
    "areas over h_rms": (SURFACE + ON + "[prescribed]\nareas = [0.01]\nover_h_rms = true\n", "areas have none"),
    "variant of another theory": (
        'theory = "persson"\nvariant = "printed"\n' + SURFACE + ON + AT,
        "variant: of theory 'mbma', not of 'persson'",
    ),
    "empty prescribed": (SURFACE + ON + "[prescribed]\n", "give one of separations, mean_separations"),
    "pressure and separation": (
        SURFACE + ON + "[prescribed]\nseparations = [0.5]\npressures = [0.1]\n",
        "prescribe one of",
    ),
    "below the model's end": (SURFACE + ON + "[prescribed]\nseparations = [-2.0]\n", "at least -h_max"),
    "negative mean separation": (SURFACE + ON + "[prescribed]\nmean_separations = [-0.1]\n", "at least 0"),
    "negative pressure": (SURFACE + ON + "[prescribed]\npressures = [-1.0]\n", "at least 0"),
    "pressure over h_rms": (SURFACE + ON + "[prescribed]\npressures = [0.01]\nover_h_rms = true\n", "leave it out"),
    "pressure without an end": (
        SURFACE + '[effects]\non = ["pressure"]\noff = ["finite_height"]\n[prescribed]\npressures = [0.01]\n',
        "leave finite_height on, or give separations",
    ),
    "text for a number": (
        SURFACE + ON + '[prescribed]\nseparations = ["a"]\n',
        "separations must be a number, or one with its unit, got 'a'",
    ),
    "not finite": (SURFACE + ON + "[prescribed]\nseparations = [nan]\n", "must be finite"),
    "impossible tolerance": (
        SURFACE + ON + AT + "[accuracy]\nrtol = 1e-14\n",
        "accuracy.rtol: 1e-14 is less than the minimum of 1e-10",
    ),
    "loose tolerance": (SURFACE + ON + AT + "[accuracy]\nrtol = 2.0\n", "2.0 is greater than the maximum of 0.1"),
    "tolerance and time": (SURFACE + ON + AT + "[accuracy]\nrtol = 1e-3\nseconds = 1.0\n", "one of them"),
    "no time": (SURFACE + ON + AT + "[accuracy]\nseconds = 0.0\n", "0.0 is less than or equal to the minimum of 0"),
    "half a material": (SURFACE + ON + AT + "[material]\nE1 = 3.0\n", "all of E1, nu1, E2, nu2"),
    "negative modulus": (SURFACE + ON + AT + "[material]\nE_star = -3.0\n", "E_star must be positive"),
    "conductance alone": (SURFACE + '[effects]\non = ["conductance"]\n' + AT, "needs conductivities"),
    "conductance off": (SURFACE + ON + AT + "[conductance]\nk1 = 1.0\nk2 = 1.0\n", "add it to the effects"),
    "profile alone": (SURFACE + '[effects]\non = ["pressure_profile"]\n', "needs deltas"),
    "comparison alone": (SURFACE + '[effects]\non = ["comparison"]\n' + AT, "needs theories"),
    "statistics off": (SURFACE + ON + AT + "[island_statistics]\npoints = 5\n", "add it to on"),
    "table as text": (
        'surface = "concrete"\n' + ON + AT,
        r"surface: 'concrete' is not of type 'object'; write \[surface\]",
    ),
    "a number beyond doubles": (SURFACE + ON + f"[prescribed]\nseparations = [{10**400}]\n", "must be real numbers"),
    "lists without end": (SURFACE + ON + "[prescribed]\nseparations = " + "[" * 100_000, "is not a TOML file"),
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
    "time too short": (SURFACE + ON + AT + "[accuracy]\nseconds = 1e-8\n", "the cheapest plan takes"),
    "too tight for a law": (SURFACE + '[effects]\non = ["energy"]\n' + AT + "[accuracy]\nrtol = 1e-10\n", "at best"),
    "unreachable pressure": (SURFACE + ON + "[prescribed]\npressures = [1e6]\n", "where the branch ends"),
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
    path = write(tmp_path, '[surface]\npsd = "psd.txt"\nh_max = 0.3\n' + ON + AT.replace("0.5", "0.1"))
    assert float(Scene.from_toml(path).surface.hurst) == pytest.approx(0.8, rel=0.02, abs=0)
    (tmp_path / "psd.txt").write_text("# q C\n")
    with pytest.raises(InputError, match="must hold two columns"):
        Scene.from_toml(path)
