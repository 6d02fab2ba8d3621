"""The costs that plans state, from a file of measurements, and the theories nearer to simulation that they advise."""

import dataclasses
import math
import re

import numpy as np
import pytest

from mbma_tables import Scene, Surface, contact
from mbma_tables.common.files import shipped_file
from mbma_tables.scenes.costs import Row, read_costs, shipped_costs
from mbma_tables.scenes.scene import advice
from mbma_tables.surfaces.variants import get_variant
from mbma_tables.theories import THEORIES

HEADER = ",".join(Row._fields)
SOME = f"""# a comment
{HEADER}
unit,seconds,both,,0.002,
universal,gap rtol=1e-02,both,1e-9,4,50
universal,gap rtol=1e-06,both,1e-9,16,60
universal,gap rtol=1e-06,pressure,1e-9,10,60
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
        # the loosest measured tolerance that meets the one asked for, beyond all of them the tightest
        (("universal", "gap", 1e-1), 4),
        (("universal", "gap", 1e-4), 16),
        (("universal", "gap", 1e-9), 16),
        (("universal", "gap", 1e-6, "pressure"), 10),
        # area alone was not measured
        (("universal", "gap", 1e-6, "area"), 16),
        (("universal", "call", 1e-6), 3),
        (("universal", "law", 1e-6), math.nan),
    ],
)
def test_costs_are_those_of_the_measured_row(tmp_path, asked, cost):
    assert read(tmp_path, SOME).of(*asked) == pytest.approx(0.002 * cost, rel=1e-12, abs=0, nan_ok=True)


def test_shipped_costs_have_what_plans_need():
    costs, calls = shipped_costs(), ("gap", "call", "import", "law")
    needed = dict.fromkeys(("exact", "universal", "rigid"), calls) | {"law": ("lookup", "invert")}
    needed |= dict.fromkeys(THEORIES[1:], ("gap", "call", "invert", "energy", "law"))
    needed |= {"exact": (*calls, "profile"), "scene": ("call",), "island4d": ("gap",)}
    for name, whats in needed.items():
        for what in whats:
            assert 0 < costs.of(name, what, 1e-4, "pressure") < 10, (name, what)
    errors = [row.error for row in costs.rows if row.island_model == "universal" and row.what == "gap"]
    assert 0 < max(errors) <= 1e-8
    assert costs.of("exact", "gap", 1e-8) > 3 * costs.of("universal", "gap", 1e-8)
    assert read_costs(shipped_file("cost.csv")) == costs


SURFACE = Surface(hurst=0.8, q0=0.01, q1=0.64, h_rms=1.0, h_max=3.3)


def stated(theory, quantity, area):
    found = contact(SURFACE, area=area, theory=theory)
    return found.stiffness_scatter if quantity == "stiffness" else found.scatter


@pytest.mark.parametrize(
    ("effects", "prescribed", "name", "quantity"),
    [
        (["stiffness"], {"areas": [0.05]}, "stiffness", "stiffness"),
        (["area"], {"areas": [0.05]}, "gap", "force"),
        (["area", "energy"], {"areas": [0.02, 0.05, 0.9]}, "gap", "force"),
        (["pressure"], {"mean_separations": [1.0, 4.0]}, "pressure", "force"),
    ],
)
def test_it_tells_what_the_shipped_file_states(effects, prescribed, name, quantity):
    text = Scene(SURFACE, effects=effects, **prescribed).explain()
    (line,) = re.findall("advice: .*", text)
    found = re.search(r"for (\w+) theory '(\w+)' .* elements, (\S+)% instead of (.+) at (\S+)% contact, in", line)
    assert found.group(1, 2) == (name, "calibrated")
    area = float(found[5]) / 100
    if "areas" in prescribed:
        assert area == 0.05
    assert float(found[3]) / 100 == pytest.approx(stated("calibrated", quantity, area), rel=0.02)
    other = re.fullmatch(r"a factor (\S+)", found[4])
    own = np.log(float(other[1])) if other else float(found[4].rstrip("%")) / 100
    assert own == pytest.approx(stated("mbma", quantity, area), rel=0.1)


def test_what_else_is_advised_and_where_there_is_nothing_to_say():
    # conductance is a stiffness
    said = advice(Scene(SURFACE, effects=["conductance"], conductivities=(1.0, 1.0), pressures=[1e-4]))
    assert "for conductance theory 'calibrated' is closer" in said
    assert said.count("\n") == 1
    own = dataclasses.replace(get_variant("printed"), name="own", beta=0.3)
    said = advice(Scene(SURFACE, effects=["stiffness"], areas=[1e-4], variant=own))
    assert "instead of an unknown distance at 0.01% contact" in said
    assert "not tested there: A/A0 is below" in said
    quiet = [
        Scene(SURFACE, theory="persson", pressures=[1e-4]),
        Scene(SURFACE, effects=["area"], mean_separations=[1.0]),
        Scene(SURFACE, effects=["pressure"], mean_separations=[4.0]),
        Scene(SURFACE, effects=["pressure_profile"], deltas=[0.1]),
    ]
    assert [advice(scene) for scene in quiet] == [""] * 4
