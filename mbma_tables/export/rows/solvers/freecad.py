"""Conductance and friction of a contact of FreeCAD, by the names of its ConstraintContact.

FreeCAD writes them for CalculiX, in `write_constraint_contact.py`: each text of the list is a
line below *GAP CONDUCTANCE, the slopes are converted to MPa/mm.
"""

import ast

import numpy as np

from mbma_tables.common.errors import InputError
from mbma_tables.export.law_table import Curve, LawTable, titled
from mbma_tables.export.targets import CONDUCTANCES, SI, RowFormat
from mbma_tables.export.text import number

# FreeCAD hands CalculiX lengths in mm and stresses in MPa, in which a conductance is in
# mW/(mm^2 K)
MPA = 1e-6  # of a Pa
MPA_PER_MM = 1e-9  # of a Pa/m
MW_PER_MM2 = 1e-3  # of a W/m^2
UNIT = "W/(m K)/m"
ROWS = 20  # that CalculiX keeps


def _freecad(law: LawTable) -> str:
    if law.y_unit != UNIT:
        raise InputError(
            f"FreeCAD takes conductances of heat, from conductivities in W/(m K), got one in "
            f"{law.y_unit}"
        )
    closure = law.behaviour
    assert closure is not None
    slope = closure.y[-1] / closure.x[-1]
    lines = [
        "import FreeCADGui",
        "",
        "for contact in FreeCADGui.Selection.getSelection():",
        '    contact.SurfaceBehavior = "Linear"',
        f'    contact.Slope = "{number(slope * MPA_PER_MM)} MPa/mm"',
    ]
    if "friction" in law.facts:
        friction, _ = law.facts["friction"]
        stick_slope, _ = law.facts["stick"]
        lines += [
            "    contact.Friction = True",
            f"    contact.FrictionCoefficient = {number(friction)}",
            f'    contact.StickSlope = "{number(stick_slope * MPA_PER_MM)} MPa/mm"',
        ]
    lines += [
        "    contact.EnableThermalContact = True",
        "    contact.ThermalContactConductance = [",
    ]
    for x, y in zip(law.x, law.y, strict=True):
        lines.append(f'        "{number(y * MW_PER_MM2)}, {number(x * MPA)}",')
    return "\n".join([*lines, "    ]"]) + "\n"


def _read(text: str) -> list[Curve]:
    """The list of conductances and pressures, of which FreeCAD writes each as a line, in the rows' units."""
    values = {}
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Attribute):
            values[node.targets[0].attr] = ast.literal_eval(node.value)
    lines = values["ThermalContactConductance"]
    assert values["EnableThermalContact"] is True
    y, x = np.array([line.split(", ") for line in lines], dtype=float).T
    # units are converted with roundoff
    return [Curve(titled(text)[0], x / MPA, y / MW_PER_MM2, 1e-14)]


freecad = RowFormat(
    name="freecad",
    program="FreeCAD",
    output=(
        "a macro: the list of thermal contact conductances and pressures, the slope, and "
        "with `--friction` coefficient and stick slope, for the selected contacts"
    ),
    outside="keeps the last value, in CalculiX",
    tested="executed with an object of these properties; CalculiX reads the lines",
    read=_read,
    mark="#",
    body=dict.fromkeys(reversed(CONDUCTANCES), _freecad),
    beyond=(
        "CalculiX keeps the value of the last row beyond it. FreeCAD has no closure by rows: "
        "the slope is the law's at the largest pressure alone, which does not change the "
        "conductance where forces are prescribed."
    ),
    most=dict.fromkeys(CONDUCTANCES, ROWS),
    units=SI,
    friction="Its stick slope is that of one pressure.",
)
