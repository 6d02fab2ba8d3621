"""Mistakes in scene files: one message each, that says what to write instead."""

import json
import math
import pathlib

import pytest

from mbma_tables import Scene
from mbma_tables.common.errors import InputError, MbmaError
from mbma_tables.common.files import shipped_file
from mbma_tables.contacts.quantities.registry import registry
from mbma_tables.design.scenes import problem
from mbma_tables.design.scenes.plan import Row, read_costs, shipped_costs
from mbma_tables.design.scenes.problem import OTHERS, REFINEMENTS
from mbma_tables.design.scenes.specimen import schema
from mbma_tables.theories import THEORIES

EXAMPLES = pathlib.Path(__file__).parents[2] / "examples"


def scene(
    more="",
    surface='name = "concrete"',
    effects='on = ["pressure"]',
    at="separations = [0.5]",
):
    """The text of a scene file, less what is None; `more` stands in front of the tables if it is no table itself."""
    tables = {"surface": surface, "effects": effects, "prescribed": at}
    text = "".join(
        f"[{name}]\n{lines}\n" for name, lines in tables.items() if lines is not None
    )
    return text + more if more.startswith("[") else f"{more}\n{text}"


MISTAKES = [
    (scene("[efects]\non = []\n"), "did you mean 'effects'"),
    (scene(surface='nme = "concrete"'), "did you mean 'name'"),
    (scene(at="separation = 1"), "did you mean 'separations'"),
    (scene("[material]\nhardness = 3.0"), r"it belongs to \[yield\]"),
    (scene(effects='on = ["presure"]'), "'presure' is not one of"),
    (scene(effects='on = ["pressure"]\noff = ["subscale"]'), "subscale_area"),
    (scene(surface='name = "concret"'), "there are yang-persson"),
    (scene('variant = "printd"'), "'printd' is not one of"),
    (
        scene('[comparison]\ntheories = ["person"]', effects='on = ["comparison"]'),
        "did you mean 'persson'",
    ),
    (scene(surface=None), "'surface' is a required property"),
    (scene(surface="hurst = 0.8\nq0 = 1.0"), "a surface needs hurst, q0, q1"),
    (
        scene(surface='name = "concrete"\nhurst = 0.8'),
        r"name and numbers \(hurst\) are given",
    ),
    (scene(surface='name = "concrete"\nmap = "a.nc"'), "one of name, map or numbers"),
    (scene(surface='map = "none.nc"'), "none.nc' is not a file"),
    (scene(surface='name = "concrete"\nlength_unit = "MPa"'), "no known unit of length"),
    (scene(effects=None), "'effects' is a required property"),
    (scene(effects="on = []"), "effects.on: .* should be non-empty"),
    (scene(effects='on = ["pressure"]\noff = ["area"]'), "'area' is not one of"),
    (scene(effects='on = ["energy"]\noff = ["finite_height"]'), "leave finite_height on"),
    (scene(at=None), "give exactly one of separations"),
    (scene('theory = "persons"'), "did you mean 'persson'"),
    (scene(at="separations = [-2.0]"), "at least -h_max"),
    (
        scene(
            effects='on = ["pressure"]\noff = ["finite_height"]', at="pressures = [0.01]"
        ),
        "leave finite_height on, or give separations",
    ),
    (
        scene(at='separations = ["a"]'),
        "separations must be a number, or one with its unit, got 'a'",
    ),
    (scene("[accuracy]\nrtol = 1e-14"), "rtol: 1e-14 is less than the minimum of 1e-10"),
    (scene("[accuracy]\nrtol = 1e-3\nseconds = 1.0"), "one of them"),
    (scene("[accuracy]\nseconds = 0.0"), "0.0 is less than or equal to the minimum of 0"),
    (scene("[material]\nE1 = 3.0"), "all of E1, nu1, E2, nu2"),
    (
        scene('[material]\nE1 = "210 GPa"\nnu1 = 0.3\nE2 = 70\nnu2 = 0.3'),
        "E2 without a unit beside numbers in GPa",
    ),
    (scene('[material]\nE_star = "210 mm"'), "no known unit of stress"),
    (scene('[material]\nstress_unit = "MPa"'), "no modulus"),
    (
        scene(surface='hurst = 0.8\nq0 = "0.1/mm"\nzeta_1 = 50\nh_rms = 0.8\nh_max = 3'),
        "h_rms, h_max without a unit",
    ),
    (scene(effects='on = ["solid_conductance"]'), "needs conductivities"),
    (scene("[solid_conductance]\nk1 = 1.0\nk2 = 1.0"), "add it to the effects"),
    (scene(effects='on = ["pressure_profile"]', at=None), "needs deltas"),
    (
        scene('surface = "concrete"', surface=None),
        r"surface: 'concrete' is not of type 'object'; write \[surface\]",
    ),
    (scene(at=f"separations = [{10**400}]"), "must be real numbers"),
    (scene(at="separations = " + "[" * 100_000), "is not a TOML file"),
    ("[surface\n", "is not a TOML file"),
]


def write(folder, text):
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("text", "words"), MISTAKES, ids=[words for _, words in MISTAKES]
)
def test_each_mistake_has_a_message_that_says_what_to_write_instead(
    text, words, tmp_path
):
    path = write(tmp_path, text)
    with pytest.raises(InputError, match=words) as fault:
        Scene.from_toml(path)
    message = str(fault.value)
    assert message.startswith(str(path))
    assert "\n" not in message.strip() or "TOML" in message


def test_what_only_a_plan_or_a_run_can_know(tmp_path):
    for text, words in (
        (scene("[accuracy]\nseconds = 1e-8"), "the cheapest plan takes"),
        (scene("[accuracy]\nrtol = 1e-10", effects='on = ["energy"]'), "at best"),
        (
            'theory = "mbma"\n' + scene(at="pressures = [1e6]"),
            "pressure must be at most what theory 'mbma' reaches on this surface",
        ),
    ):
        with pytest.raises(MbmaError, match=words):
            Scene.from_toml(write(tmp_path, text)).run()


def test_examples_are_scenes_and_the_schema_names_what_the_code_knows():
    plans = [Scene.from_toml(path).explain() for path in EXAMPLES.glob("scene_*.toml")]
    assert len(plans) == 3
    assert all(text.startswith("Scene  (rtol=") for text in plans)
    tables = schema()["properties"]
    items = tables["effects"]["properties"]["on"]["items"]
    assert set(items["enum"]) == {*OTHERS, *registry()}
    path = pathlib.Path(problem.__file__).with_name("scene.schema.json")
    published = json.loads(path.read_text())["properties"]["effects"]["properties"]["on"]
    assert set(published["items"]["anyOf"][0]["enum"]) == set(OTHERS)
    assert tuple(tables["effects"]["properties"]["off"]["items"]["enum"]) == REFINEMENTS
    json.dumps(schema(), allow_nan=False)


HEADER = ",".join(Row._fields)
SOME = f"""# a comment
{HEADER}
unit,seconds,both,,0.002,
universal,gap rtol=1e-02,both,1e-9,4,50
universal,gap rtol=1e-06,both,1e-9,16,60
universal,call,both,,3,
"""


def read(tmp_path, text):
    path = tmp_path / "cost.csv"
    path.write_text(text, encoding="utf-8")
    return read_costs(path)


@pytest.mark.parametrize(
    ("asked", "cost"),
    [
        (("universal", "gap", 1e-2), 4),
        # the loosest measured tolerance that meets the one asked for, beyond all of them
        # the tightest
        (("universal", "gap", 1e-1), 4),
        (("universal", "gap", 1e-4), 16),
        (("universal", "gap", 1e-9), 16),
        (("universal", "call", 1e-6), 3),
        (("universal", "law", 1e-6), math.nan),
    ],
)
def test_costs_are_those_of_the_measured_row(tmp_path, asked, cost):
    assert read(tmp_path, SOME).of(*asked) == pytest.approx(
        0.002 * cost, rel=1e-12, abs=0, nan_ok=True
    )


def test_shipped_costs_have_what_plans_need():
    costs = shipped_costs()
    calls = ("gap", "call", "import", "law")
    needed = dict.fromkeys(("exact", "universal", "rigid"), calls) | {
        "law": ("lookup", "invert")
    }
    needed |= dict.fromkeys(THEORIES[1:], ("gap", "call", "law"))
    needed |= {"exact": (*calls, "profile"), "scene": ("call",), "island4d": ("gap",)}
    for name, whats in needed.items():
        for what in whats:
            assert 0 < costs.of(name, what, 1e-4) < 10, (name, what)
    parts = ("inverse", "energy", "leakage", "yield", "yield inverse")
    for theory in THEORIES:
        for part in parts:
            for what in (f"{part} once", f"{part} gap"):
                assert 0 < costs.of(theory, what) < 1, (theory, what)
    errors = [
        row.error
        for row in costs.rows
        if row.island_model == "universal" and row.what == "gap"
    ]
    assert 0 < max(errors) <= 1e-8
    assert costs.of("exact", "gap", 1e-8) > 3 * costs.of("universal", "gap", 1e-8)
    assert read_costs(shipped_file("cost.csv")) == costs
