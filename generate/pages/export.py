"""The tables of targets in docs/export.md, from their declarations."""

from __future__ import annotations

import csv
from collections.abc import Iterable

from generate.files import ROOT
from generate.page import Measured, table
from mbma_tables.export.registry import OF_LAWS, declared_options, targets
from mbma_tables.export.targets import Options, Target, names_of

# what targets write, by their groups
KINDS = {
    "all rows": ("SOLVERS", "DATA"),
    "all laws as code": ("LAWS",),
    "FMUs": ("FMUS",),
}

# written by `python -m benchmarks exports --write`
MEASURED = ROOT / "docs" / "data" / "exports.csv"


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
    blocks = {"code": of_code, "formats": table(header, rows), "options": _options()}
    return blocks | {"programs": _programs()}, {}


def _programs() -> str:
    """What was measured of every target, and what it does outside the range of a law."""
    rows = []
    with MEASURED.open(encoding="utf-8") as stream:
        measured = {row["target"]: row for row in csv.DictReader(stream)}
    for name, target in targets().items():
        one = measured.get(name)
        if one is None:
            # a new one, until the command is run
            cells = ("not measured", "", "", "")
            rows.append((f"`{name}`", *cells, target.outside, ""))
            continue
        share = f"{100 * float(one['share']):.0f}%"
        cells = (one["program"], one["laws"], one["error"], share)
        rows.append((f"`{name}`", *cells, target.outside, one["date"]))
    header = (
        "target | read or run by | laws | largest error | of the stated one | "
        "outside the range | date"
    )
    return table(header, rows)


def _options() -> str:
    """Options of files, by the classes that declare them."""
    rows = []
    for name, declared in declared_options(*OF_LAWS).items():
        kind = declared.metadata["kind"]
        words = f"`--{'without-' if kind == 'off' else ''}{name.replace('_', '-')}`"
        of = "; ".join(_takers(name))
        rows.append((f"`{name}`", words if kind else "", of, declared.metadata["help"]))
    return table("name | in a shell | targets | what it is", rows)


def _takers(option: str) -> Iterable[str]:
    """Targets that have an option, by what they write."""
    of_all = option in Options.names()
    for label, groups in KINDS.items():
        takers: list[str] = []
        others: list[str] = []
        for name, target in targets(*groups).items():
            taken = of_all or option in target.takes & names_of(target.options)
            (takers if taken else others).append(f"`{name}`")
        if takers and len(others) < len(takers):
            yield f"{label} but {', '.join(others)}" if others else label
        elif takers:
            yield ", ".join(takers)


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
