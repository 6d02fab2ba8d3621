"""Contact laws as piecewise linear functions of MOOSE, by its `PiecewiseTabularBase`."""

from collections.abc import Sequence

from mbma_tables.export.law_table import LawTable
from mbma_tables.export.rows.solvers.comsol import columns
from mbma_tables.export.targets import Grammar
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


moose = Grammar(
    program="MOOSE",
    mark="#",
    of_any=columns,
    beyond=(
        "[Functions/law] type = PiecewiseLinear, data_file = THIS, format = columns; constant "
        "outside the rows. Of more than two columns: xy_in_file_only = false, "
        "y_index_in_file = 1, 2, ..."
    ),
)
# of conductances, by its `GapFluxModelConduction`
moose_function = Grammar(
    program="MOOSE",
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
