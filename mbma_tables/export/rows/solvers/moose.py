"""Contact laws as piecewise linear functions of MOOSE, by its `PiecewiseTabularBase`."""

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
from mbma_tables.export.text import number


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
