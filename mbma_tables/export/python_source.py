"""The model as one Python file that needs numpy alone.

The table is at the end of the file, as the base64 text of its doubles: a single file cannot be parted from its numbers,
and neither netCDF nor HDF5 is needed to read them.
"""

from __future__ import annotations

import textwrap

from mbma_tables.export.javascript_source import encoded
from mbma_tables.export.numbers import Numbers
from mbma_tables.formulas.printers import assignments

USAGE = (
    "Needs Python 3.9 and numpy, nothing else; import it, or run it: `python mbma_reader.py mbma_conformance.csv` "
    "replays the conformance points."
)
TITLES = {"mbma_reader.py": "mbma_reader.py: the MBMA model for Python and numpy in one file."}
TEMPLATES = ("mbma_reader.py",)


def comment(lines: list[str]) -> str:
    """Lines as comments."""
    return "\n".join(f"# {line}".rstrip() for line in lines)


def parts(numbers: Numbers) -> dict[str, str]:
    """What stands in the templates' places."""
    return {"FORMULA": _formula(numbers), "NUMBERS": _numbers(numbers)}


def _formula(numbers: Numbers) -> str:
    """The closed form's steps."""
    return "\n".join(f"    {name} = {text}" for name, text in assignments(numbers.form, "python")) + (
        f"\n    return {numbers.form.outputs['phi_F']}, {numbers.form.outputs['phi_A']}"
    )


def _numbers(numbers: Numbers) -> str:
    """The table's part of the file."""
    lines = [f"{name} = {value}" for name, value in numbers.whole.items()]
    lines += [f"{name} = {value!r}" for name, value in numbers.scalars.items()]
    for name, values in numbers.arrays.items():
        if values.size < 100:
            indent = " " * 4
            text = textwrap.wrap(
                ", ".join(map(repr, values.tolist())), 116, initial_indent=indent, subsequent_indent=indent
            )
            lines += [f"{name} = np.array([", *text, "])"]
        else:
            lines += [f'{name} = _decoded("""', encoded(values), f'""", {values.shape})']
    return "\n".join(lines)
