"""Contact laws as piecewise linear functions of MOOSE, by its `PiecewiseTabularBase`."""

import math
import re
from collections.abc import Sequence

import numpy as np

from mbma_tables.export.law_table import Curve, LawTable, titled
from mbma_tables.export.rows.solvers.comsol import (
    below_comments,
    columns,
    read_columns,
)
from mbma_tables.export.targets import RowFormat
from mbma_tables.export.text import about, number, opening

# points of a formula that is read back
FITTED = 200


def _functions(law: LawTable, name: str) -> str:
    return f"[Functions]\n{_blocks(law, name)}[]\n"


def _functions_of_several(laws: Sequence[LawTable], name: str) -> str:
    blocks = [_blocks(law, name) for law in laws]
    return f"[Functions]\n{''.join(blocks)}[]\n"


def _blocks(law: LawTable, name: str) -> str:
    """A function for each column after the first."""
    listed = {}
    for column, (values, _) in law.columns.items():
        listed[column] = " ".join(map(number, values))
    abscissa, *others = listed
    text = ""
    for column in others:
        text += (
            f"  [{name}_{column}]\n"
            "    type = PiecewiseLinear\n"
            f"    x = '{listed[abscissa]}'\n"
            f"    y = '{listed[column]}'\n"
            "  []\n"
        )
    return text


def _proportional(law: LawTable, name: str) -> str:
    """The number of `GapFluxModelPressureDependentConduction`, whose conductance is proportional to pressure."""
    fitted = (law.x > 0) & (law.y >= law.floor)
    pressure = law.x[fitted]
    log_ratio = np.log(law.y[fitted] / pressure)
    # the one between the least and the largest
    middle = (log_ratio.max() + log_ratio.min()) / 2
    spread = (log_ratio.max() - log_ratio.min()) / 2
    note = (
        "The model's conductance, scaling k p/H with harmonic means k and H of both sides, is "
        f"within {about(math.expm1(spread), 2)} of the law's from p = {about(pressure[0])} to "
        f"{about(law.x[-1])} {law.x_unit} with these numbers, of which k and H are 1. Set "
        "temperature, contact_pressure and boundary to those of your input; the material "
        "belongs to the blocks of both sides."
    )
    return (
        f"{opening([note], '#')}\n"
        "[Materials]\n"
        f"  [{name}_of_one]\n"
        "    type = ADGenericConstantMaterial\n"
        f"    prop_names = '{name}_conductivity {name}_hardness'\n"
        "    prop_values = '1.0 1.0'\n"
        "  []\n"
        "[]\n"
        "[UserObjects]\n"
        f"  [{name}]\n"
        "    type = GapFluxModelPressureDependentConduction\n"
        "    temperature = temperature\n"
        "    contact_pressure = contact_pressure\n"
        "    boundary = interface\n"
        f"    scaling_coefficient = {number(math.exp(middle))}\n"
        f"    primary_conductivity = {name}_conductivity\n"
        f"    secondary_conductivity = {name}_conductivity\n"
        f"    primary_hardness = {name}_hardness\n"
        f"    secondary_hardness = {name}_hardness\n"
        "  []\n"
        "[]\n"
    )


def _read_proportional(text: str) -> list[Curve]:
    """The flux of `computeFlux` over the difference of temperatures, in the stated range."""
    given = dict(re.findall(r"^    (\w+) = (\S+)$", text, re.M))
    names = re.search(r"prop_names = '(\S+) (\S+)'\n +prop_values = '(\S+) (\S+)'", text)
    assert names is not None
    conductivity, hardness, *values = names.groups()
    properties = dict(zip((conductivity, hardness), map(float, values), strict=True))
    means = []
    for quantity in ("conductivity", "hardness"):
        sides = (given[f"{side}_{quantity}"] for side in ("primary", "secondary"))
        first, second = (properties[each] for each in sides)
        means.append(2 * first * second / (first + second))
    words = " ".join(text.replace("\n#", " ").split())
    stated = re.search(
        r"of both sides, is within (\S+) of .*? from p = (\S+) to (\S+) ", words
    )
    assert stated is not None
    misfit, low, high = map(float, stated.groups())
    pressure = np.geomspace(low, high, FITTED)
    scaling = float(given["scaling_coefficient"])
    conductance = scaling * means[0] * pressure / means[1]
    # the misfit has two digits
    return [Curve("solid_conductance", pressure, conductance, 1.05 * misfit)]


def _read_columns(text: str) -> list[Curve]:
    return read_columns(below_comments(text, "#"), titled(text))


def _read_functions(text: str) -> list[Curve]:
    """The functions, whose names begin with that of the file."""
    blocks = re.findall(
        r"^  \[([A-Za-z]\w*)\]\n"
        r"    type = PiecewiseLinear\n"
        r"    x = '(.*)'\n"
        r"    y = '(.*)'\n"
        r"  \[\]$",
        text,
        re.M,
    )
    curves = []
    for name, x, y in blocks:
        abscissas, values = np.array([x.split(), y.split()], dtype=float)
        curves.append(Curve(name, abscissas, values))
    return curves


moose = RowFormat(
    name="moose",
    program="MOOSE",
    output="columns with comments; of a film or aperture all columns",
    outside="keeps the end values",
    tested="written according to the reader's source, not tested",
    read=_read_columns,
    mark="#",
    of_any=columns,
    beyond=(
        "[Functions/law] type = PiecewiseLinear, data_file = THIS, format = columns; constant "
        "outside the rows. Of more than two columns: xy_in_file_only = false, "
        "y_index_in_file = 1, 2, ..."
    ),
)
# of conductances, by its `GapFluxModelConduction`
moose_function = RowFormat(
    name="moose-function",
    program="MOOSE",
    output="`[Functions]`, one `PiecewiseLinear` for each column",
    outside="keeps the end values",
    tested="parsed back",
    read=_read_functions,
    mark="#",
    of_any=_functions,
    beyond=(
        "Constant outside the rows. Of a conductance: type = GapFluxModelConduction, "
        "gap_conductivity_function, with gap_conductivity_function_variable = the contact "
        "pressure, and gap_conductivity and min_gap the same length, above all closed gaps."
    ),
    named="rough",
    several=_functions_of_several,
)
# of `GapFluxModelPressureDependentConduction.C`
moose_pressure = RowFormat(
    name="moose-pressure",
    program="MOOSE",
    output="`GapFluxModelPressureDependentConduction`, conductance proportional to pressure",
    outside="goes on by its formula",
    tested="MOOSE's formula, written again from its source: within the stated misfit",
    read=_read_proportional,
    mark="#",
    body={"solid_conductance": _proportional},
    beyond="For contacts pressed as hard as in this range: moose-function has the law itself.",
    named="rough",
)
