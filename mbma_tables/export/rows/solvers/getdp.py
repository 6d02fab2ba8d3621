"""Contact laws as interpolated functions of GetDP; 3.2 was run."""

import re
from collections.abc import Iterable, Sequence

import numpy as np

from mbma_tables.export.law_table import Curve, LawTable
from mbma_tables.export.targets import RowFormat
from mbma_tables.export.text import number


def _functions(law: LawTable, name: str) -> str:
    return _block(_lines(law, name, name))


def _functions_of_several(laws: Sequence[LawTable], name: str) -> str:
    lines: list[str] = []
    for law in laws:
        # each law has its own abscissas
        lines += _lines(law, name, f"{name}_rows_{law.y_name}")
    return _block(lines)


def _block(lines: Iterable[str]) -> str:
    return "\n  ".join(["Function {", *lines]) + "\n}\n"


def _lines(law: LawTable, name: str, rows: str) -> list[str]:
    """Lists of columns, and functions that interpolate in them.

    The names of lists begin with `rows`, those of functions with `name`.
    """
    lines = []
    for column, (values, _) in law.columns.items():
        listed = ", ".join(map(number, values))
        lines.append(f"{rows}_{column}() = {{{listed}}};")
    abscissa, *others = law.columns
    for column in others:
        pair = f"{rows}_{abscissa}(), {rows}_{column}()"
        lines.append(f"{name}_{column}[] = InterpolationLinear[$1]{{ListAlt[{pair}]}};")
    return lines


def _read(text: str) -> list[Curve]:
    """The functions, by their lists; their names begin with that of the file."""
    lists = {}
    for name, numbers in re.findall(r"^  (\w+)\(\) = \{(.*)\};$", text, re.M):
        lists[name] = np.array(numbers.split(","), dtype=float)
    functions = re.findall(
        r"^  (\w+)\[\] = InterpolationLinear\[\$1\]\{ListAlt\[(\w+)\(\), (\w+)\(\)\]\};$",
        text,
        re.M,
    )
    return [Curve(name, lists[x], lists[y]) for name, x, y in functions]


getdp = RowFormat(
    name="getdp",
    program="GetDP",
    output="`InterpolationLinear` functions",
    outside="stops below the rows, continues the last chord above them",
    tested="GetDP 3.2: to 1e-6",
    read=_read,
    mark="//",
    of_any=_functions,
    beyond=(
        "GetDP 3.2 stops below the first row and continues the last chord beyond the last one."
    ),
    named="rough",
    several=_functions_of_several,
)
