"""The model as a Fortran 2008 module, with the table as a module of its own.

The table is text too: DATA statements of 1000 numbers each stay within 255 continuation lines of 132 characters, and
gfortran compiles all 120 000 numbers in about a second, so that no file has to be found and read at run time.
"""

from __future__ import annotations

import math

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.export.numbers import Numbers
from mbma_tables.formulas.printers import assignments, wrap_fortran

USAGE = (
    "Compile in this order: gfortran -std=f2008 -O2 -c mbma_table.f90 mbma.f90 (any Fortran 2008 compiler; expm1, "
    "log1p and cbrt come from the C mathematics library, which Fortran programs are linked with). "
    "Every procedure may be called from any thread; nothing is allocated and nothing is kept between calls. "
    "mbma_selftest.f90 replays the conformance points of mbma_conformance.csv."
)
TITLES = {
    "mbma_table.f90": "mbma_table.f90: the numbers of the MBMA model in Fortran 2008, for module mbma alone.",
    "mbma.f90": "mbma.f90: the MBMA model in Fortran 2008.",
    "mbma_selftest.f90": "mbma_selftest.f90: replays the conformance points of the MBMA model in Fortran 2008.",
}
TEMPLATES = ("mbma.f90", "mbma_selftest.f90")
PER_LINE = 4
PER_STATEMENT = 1000


def comment(lines: list[str]) -> str:
    """Lines as comments."""
    return "\n".join(f"! {line}".rstrip() for line in lines)


def _literal(value: float) -> str:
    return f"{float(value)!r}_dp"


def _data(name: str, values: FloatArray) -> list[str]:
    """One rank-1 array as DATA statements."""
    lines = []
    for start in range(0, values.size, PER_STATEMENT):
        part = values[start : start + PER_STATEMENT]
        lines.append(f"  data ({name}(table_index), table_index = {start + 1}, {start + part.size}) / &")
        rows = [", ".join(map(_literal, part[k : k + PER_LINE])) for k in range(0, part.size, PER_LINE)]
        lines += [f"    {text}, &" for text in rows[:-1]]
        lines.append(f"    {rows[-1]} /")
    return lines


def parts(numbers: Numbers) -> dict[str, str]:
    """What stands in the templates' places."""
    return {"FORMULA": _formula(numbers)}


def _formula(numbers: Numbers) -> str:
    """The closed form's declarations, steps and results; every name ends in _."""
    form = numbers.form
    steps = assignments(form, "fortran")
    names = [f"{name}_" for name in form.arguments] + [name for name, _ in steps]
    lines = [f"real(dp) :: {', '.join(names)}"]
    lines += [f"{name}_ = {name}" for name in form.arguments]
    lines += [f"{name} = {text}" for name, text in steps]
    lines += [f"answer%{name} = {step}_" for name, step in form.outputs.items()]
    return "\n".join(wrap_fortran(line, "    ") for line in lines)


def numbers_text(numbers: Numbers, header: list[str]) -> str:
    """The table's own module; arrays of more dimensions are flat, their last index fastest."""
    lines = [
        comment(header),
        "module mbma_table",
        "  use, intrinsic :: iso_fortran_env, only: dp => real64",
        "  implicit none",
        "  private :: table_index, dp",
        "  integer :: table_index",
    ]
    for name, value in numbers.whole.items():
        # flags
        if value in (0, 1) and name in ("OFFSET", "SUMMITS", "PRINTED_JACOBIAN"):
            lines.append(f"  logical, parameter :: {name} = {'.true.' if value else '.false.'}")
        else:
            lines.append(f"  integer, parameter :: {name} = {value}")
    lines += [f"  real(dp), parameter :: {name} = {_literal(value)}" for name, value in numbers.scalars.items()]
    for name, values in numbers.arrays.items():
        lines.append(f"  real(dp), save, protected :: {name}({math.prod(values.shape)})")
        lines += _data(name, np.ravel(values))
    return "\n".join([*lines, "end module mbma_table", ""])
