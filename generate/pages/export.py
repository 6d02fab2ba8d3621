"""The tables of targets in docs/export.md, from their declarations."""

from __future__ import annotations

from collections.abc import Iterable

from generate.page import Measured, table
from mbma_tables.export.registry import targets
from mbma_tables.export.targets import Target


def formats() -> Measured:
    """Every target that is declared: what it has, of rows of which quantities, and how that was tested."""
    rows = []
    for name, target in targets("SOLVERS", "DATA").items():
        cells = (_quantities(target), "; ".join(_limits(target)))
        rows.append((f"`{name}`", target.output, *cells, target.tested))
    header = "target | output | quantities | units, rows, name | tested with"
    code = []
    for name, target in targets("LAWS", "FMUS", "CODE").items():
        code.append((f"`{name}`", target.output, target.tested))
    of_code = table("target | output | tested with", code)
    return {"code": of_code, "formats": table(header, rows)}, {}


def _quantities(target: Target) -> str:
    """Which quantities a file can have, and how many."""
    taken = ", ".join(f"`{name}`" for name in target.quantities) or "any"
    return f"{taken}; several in one file" if target.several else taken


def _limits(target: Target) -> Iterable[str]:
    """What the program prescribes."""
    if target.units is not None:
        yield " and ".join(target.units)
    for name, most in target.most.items():
        yield f"{most} rows of `{name}`"
    if target.longest_name is not None:
        yield f"name of {target.longest_name} letters"
