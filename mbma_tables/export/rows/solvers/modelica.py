"""Contact laws as matrices for the tables of Modelica's standard library, `CombiTable1Ds`."""

import re
from collections.abc import Sequence

from mbma_tables.common.errors import InputError
from mbma_tables.export.law_table import Curve, LawTable, titled
from mbma_tables.export.rows.solvers.comsol import columns, read_columns
from mbma_tables.export.targets import RowFormat
from mbma_tables.export.text import comment


def _matrix(law: LawTable, name: str) -> str:
    return f"double {name}({law.x.size},{len(law.columns)})\n{columns(law)}"


def _matrices(laws: Sequence[LawTable], name: str) -> str:
    """A matrix for each law, with a title above it."""
    text = ""
    for law in laws:
        text += comment([law.title], "#") + _matrix(law, f"{name}_{law.y_name}")
    return text


def _read(text: str) -> list[Curve]:
    """Columns of the matrices, below the first line, as the standard library's C reader has them."""
    if not text.startswith("#1\n"):
        raise InputError("the first line must be #1")
    lines = text.splitlines()
    curves = []
    for start, line in enumerate(lines):
        found = re.fullmatch(r"double (\w+)\((\d+),(\d+)\)", line)
        if found is None:
            continue
        rows = lines[start + 1 : start + 1 + int(found[2])]
        names = titled("\n".join(reversed(lines[:start])))
        if len(names) + 1 != int(found[3]):
            raise InputError(f"{found[1]} has {found[3]} columns, its title {names}")
        curves += read_columns(rows, names)
    return curves


modelica = RowFormat(
    name="modelica",
    program="Modelica",
    output="text for CombiTable",
    outside="an error, with the settings of the header",
    tested=(
        "checked against the rules of the standard library's reader, not with the reader "
        "itself"
    ),
    read=_read,
    several=_matrices,
    mark="#",
    of_any=_matrix,
    beyond=(
        "smoothness = Modelica.Blocks.Types.Smoothness.LinearSegments; no extrapolation"
    ),
    named="law",
    first="#1\n",
)
