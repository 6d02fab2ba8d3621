"""Mistakes in scene files: one message each, that says what to write instead."""

import dataclasses
import json
import math
import pathlib

import numpy as np
import pytest

from mbma_tables import Scene
from mbma_tables.common.errors import InputError, MbmaError
from mbma_tables.common.files import shipped_file
from mbma_tables.contacts.quantities.registry import registry
from mbma_tables.design.scenes.plan import read_costs, shipped_costs
from mbma_tables.design.scenes.scene import REFINEMENTS
from mbma_tables.design.specimen import schema
from mbma_tables.theories import THEORIES

EXAMPLES = pathlib.Path(__file__).parents[2] / "examples"


SURFACE = 'name = "concrete"'
ASKED = {"quantities": '["pressure"]', "separation": "[0.5]"}


def scene(more="", surface=SURFACE, **entries):
    """The text of a scene file, less what is None; `more` stands in front of the tables if it is no table itself."""
    lines = [
        f"{name} = {value}\n"
        for name, value in (ASKED | entries).items()
        if value is not None
    ]
    table = "" if surface is None else f"[surface]\n{surface}\n"
    parts = [table, more] if more.startswith("[") else [more + "\n", table]
    return "".join([*lines, *parts])


MISTAKES = [
    (scene('quantites = ["area"]'), "did you mean 'quantities'"),
    (scene(surface='nme = "concrete"'), "did you mean 'name'"),
    (scene("separations = 1"), "did you mean 'separation'"),
    (scene("h_rms = 3.0"), r"it belongs to \[surface\]"),
    (scene(quantities='["presure"]'), "'presure' is not one of"),
    (scene(without='["subscale"]'), "subscale_area"),
    (scene(surface='name = "concret"'), "there are yang-persson"),
    (scene('variant = "printd"'), "'printd' is not one of"),
    (scene(theories='["person"]'), "did you mean 'persson'"),
    (scene(surface=None), "'surface' is a required property"),
    (scene(surface="hurst = 0.8\nq0 = 1.0"), "a surface needs hurst, q0, q1"),
    (
        scene(surface='name = "concrete"\nhurst = 0.8'),
        r"name and numbers \(hurst\) are given",
    ),
    (scene(surface='name = "concrete"\nmap = "a.nc"'), "one of name, map or numbers"),
    (scene(surface='map = "none.nc"'), "none.nc' is not a file"),
    (scene(surface='name = "concrete"\nlength_unit = "MPa"'), "no known unit of length"),
    (scene(quantities="[]"), "nothing is requested: give quantities"),
    (scene(without='["area"]'), "'area' is not one of"),
    (
        scene(quantities='["energy"]', without='["finite_height"]'),
        "leave finite_height on",
    ),
    (scene(separation=None), "give exactly one of separation"),
    (scene(theory='"persons"'), "did you mean 'persson'"),
    (scene(separation="[-2.0]"), "at least -h_max"),
    (
        scene(without='["finite_height"]', separation=None, pressure="[0.01]"),
        "leave finite_height on, or ask for pressure and area at a separation",
    ),
    (
        scene(separation='["a"]'),
        "separation must be a number, or one with its unit, got 'a'",
    ),
    (scene(rtol="1e-14"), "rtol: 1e-14 is less than the minimum of 1e-10"),
    (scene(rtol="1e-3", seconds="1.0"), "one of them"),
    (scene(seconds="0.0"), "0.0 is less than or equal to the minimum of 0"),
    (scene("[bodies]\nE = [3.0, 3.0]"), "E needs nu"),
    (scene("[bodies]\nE_star = 3.0\nhardnes = 1.0"), "did you mean 'hardness'"),
    (
        scene('[bodies]\nE = ["210 GPa", 70]\nnu = [0.3, 0.3]'),
        "E2 without a unit beside numbers in GPa",
    ),
    (scene(bodies='"210 mm"'), "no known unit of stress"),
    (
        scene(surface='hurst = 0.8\nq0 = "0.1/mm"\nzeta_1 = 50\nh_rms = 0.8\nh_max = 3'),
        "h_rms, h_max without a unit",
    ),
    (scene(quantities='["solid_conductance"]'), "needs conductivity"),
    (scene(quantities="[]", deltas="[0.1]"), "separation is not needed for profiles"),
    (
        scene('surface = "concrete"', surface=None),
        r"surface: 'concrete' is not of type 'object'; write \[surface\]",
    ),
    (scene(separation=f"[{10**400}]"), "must be real numbers"),
    (scene(separation="[" * 100_000), "is not a TOML file"),
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
        (scene(seconds="1e-8"), "the cheapest plan takes"),
        (scene(rtol="1e-10", quantities='["energy"]'), "at best"),
        (
            scene(theory='"mbma"', separation=None, pressure="[1e6]"),
            "pressure must be at most what theory 'mbma' reaches on this surface",
        ),
        (
            scene(
                "[bodies]\nE_star = 1.0\nhardness = 0.1",
                separation=None,
                pressure="[0.2]",
            ),
            "pressure must be at most the hardness",
        ),
    ):
        with pytest.raises(MbmaError, match=words):
            Scene.from_toml(write(tmp_path, text)).run()


def test_examples_are_scenes_and_the_schema_names_what_the_code_knows():
    plans = [Scene.from_toml(path).explain() for path in EXAMPLES.glob("scene_*.toml")]
    assert len(plans) == 3
    assert all(text.startswith("Scene  (rtol=") for text in plans)
    entries = schema()["properties"]
    assert set(entries["quantities"]["items"]["enum"]) == {"leakage", *registry()}
    assert tuple(entries["without"]["items"]["enum"]) == REFINEMENTS
    arguments = {field.name for field in dataclasses.fields(Scene) if field.init}
    assert set(entries) == arguments | {"variant", "island_model"}
    json.dumps(schema(), allow_nan=False)


def test_the_files_of_the_page_are_scenes(tmp_path):
    page = (EXAMPLES.parent / "docs" / "lookup.md").read_text(encoding="utf-8")
    whole, bodies = (block.split("```")[0] for block in page.split("```toml\n")[1:])
    found = Scene.from_toml(write(tmp_path, whole)).run()
    assert found["solid_conductance"].attrs["units"] == "W/(m^2 K)"
    given = "\n".join(line for line in whole.split("\n") if "bodies" not in line)
    scene = Scene.from_toml(write(tmp_path, given + bodies))
    assert float(scene.in_units.hardness) == 1.2
    assert scene.run().attrs["theory"] == "calibrated"


# first and last numbers of the examples, as computed when scenes had tables of effects
KEPT = {
    "joint": {
        "separation": (3.123154464016858e-06, 3.89194494837839e-07),
        "area": (8.019657919870567e-06, 8.401661168922669e-03),
        "stiffness": (93596169650.66568, 33072150093412.227),
        "solid_conductance": (46.637719978301504, 16479.410224731855),
    },
    "rigid": {
        "pressure": (3.761643201707689e-05, 4.634523816957057e-04),
        "area": (7.741419838189296e-05, 9.191438740688065e-04),
    },
    "road": {
        "pressure": (1.918198356359841e-07, 0.09345043191737323),
        "area": (4.726918313713212e-08, 0.01820734395363279),
        "island_number": (1.3162659807368108e-4, 0.6586820621057403),
        "greenwood_williamson_pressure": (2.110153032697451e-05, 2.1194363869322963),
        "persson_area": (7.600152785316556e-05, 0.0058186656341277735),
    },
}


@pytest.mark.parametrize("name", KEPT)
def test_the_examples_give_the_numbers_that_they_gave(name):
    found = Scene.from_toml(EXAMPLES / f"scene_{name}.toml").run()
    for quantity, ends in KEPT[name].items():
        values = found[quantity].values[[0, -1]]
        np.testing.assert_allclose(values, ends, rtol=1e-9, err_msg=quantity)
    if name == "road":
        assert found["profile_pressure"].values[0, 0] == pytest.approx(1.0844949312081604)
        assert found["island_force"].values[1] == pytest.approx(4.6368279316600684e-09)


HEADER = "island_model,variant,quantity,error,cost,evaluations"
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
    # a theory whose costs are not measured takes an rtol, no time budget
    measured = [name for name in THEORIES if costs.of(name, "yield once") > 0]
    assert {"mbma", "calibrated", "persson", "greenwood_williamson"} <= set(measured)
    needed |= dict.fromkeys(measured[1:], ("gap", "call", "law"))
    needed |= {"exact": (*calls, "profile"), "scene": ("call",), "island4d": ("gap",)}
    for name, whats in needed.items():
        for what in whats:
            assert 0 < costs.of(name, what, 1e-4) < 10, (name, what)
    parts = ("inverse", "energy", "leakage", "yield", "yield inverse")
    for theory in measured:
        for part in parts:
            for what in (f"{part} once", f"{part} gap"):
                assert 0 < costs.of(theory, what) < 1, (theory, what)
    errors = [
        row["error"]
        for row in costs.rows
        if row["island_model"] == "universal" and row["variant"].startswith("gap ")
    ]
    assert 0 < max(errors) <= 1e-8
    assert costs.of("exact", "gap", 1e-8) > 3 * costs.of("universal", "gap", 1e-8)
    assert read_costs(shipped_file("cost.csv")) == costs
