"""The table of formats of rows in docs/export.md, from their declarations."""

from __future__ import annotations

from collections.abc import Iterable

from generate.page import Measured, table
from mbma_tables.export.targets import AGAINST, Target, targets


def formats() -> Measured:
    """Every format of rows that is declared: what it has, of which quantities, and how that was tested."""
    rows = []
    for name, target in targets("SOLVERS", "DATA").items():
        cells = (_quantities(target), "; ".join(_limits(target)))
        rows.append((f"`{name}`", target.output, *cells, target.tested))
    header = "target | output | quantities | units, rows, name | tested with"
    return {"formats": table(header, rows)}, {}


def _quantities(target: Target) -> str:
    """Which quantities a file can have, and how many."""
    taken = ", ".join(f"`{name}`" for name in target.quantities)
    if target.quantities == tuple(AGAINST):
        taken = "any"
    return f"{taken}; several in one file" if target.several else taken


def _limits(target: Target) -> Iterable[str]:
    """What the program prescribes."""
    if target.units is not None:
        yield " and ".join(target.units)
    for name, most in target.most.items():
        yield f"{most} rows of `{name}`"
    if target.longest_name is not None:
        yield f"name of {target.longest_name} letters"
