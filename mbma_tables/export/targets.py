"""Targets: programs and formats that laws are written for, each declared once, where it is written.

A new one is a function and a `Target` in the tuple TARGETS of its module: what it is written from, the quantities and
options that it takes, and, for rows, its comments, its limits and what the program does outside them.
"""

from __future__ import annotations

import dataclasses
import functools
import importlib
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from mbma_tables.common.errors import InputError
from mbma_tables.export.text import comment

if TYPE_CHECKING:
    from mbma_tables.export.law_rows import LawTable

LAW = frozenset({"theory", "variant", "hardness", "conductivity", "conductivity_unit"})
ROWS = LAW | {"rows", "rtol", "largest_overclosure", "pressures", "leakage", "direction"}
CODE = LAW | {"name", "leakage", "direction"}
# groups by the modules that declare them, in the order in which help lists them
GROUPS = {"SOLVERS": "solvers", "DATA": "data", "LAWS": "law_code", "FMUS": "fmu", "GRAPHS": "onnx", "CODE": "code"}


@dataclasses.dataclass(frozen=True)
class Target:
    """What is written for one program, or in one format.

    Parameters
    ----------
    name : str
        In the command `mbma export`.
    write : callable
        Of a `LawTable` and what is named: text or bytes, or several files by how their names end after that of the
        first, whose own end is "". Of a law, where `rows` is False: of surface, E_star and options.
    takes : frozenset of str
        Options of the command.
    end : str
        Of the first file's name, where it must be that; functions are then called by the rest of it.
    alone : bool
        Whether the first file is of use without the others.
    """

    name: str
    write: Callable[..., Any]
    takes: frozenset[str] = ROWS
    rows: bool = True
    end: str = ""
    alone: bool = True

    def files(self, *given: Any, **options: Any) -> Mapping[str, bytes]:
        """The files by the ends of their names, that of the first being ""."""
        made = self.write(*given, **options)
        files = made if isinstance(made, Mapping) else {"": made}
        return {end: text if isinstance(text, bytes) else text.encode() for end, text in files.items()}


@dataclasses.dataclass(frozen=True)
class Grammar:
    """How a program reads the rows of a law; called with a `LawTable` it gives the text of a file."""

    program: str
    mark: str  # of comments
    body: Mapping[str, Callable[..., str]]  # by quantity: what stands below the comments, of the law and what is named
    beyond: str  # what the program does outside the rows, and what else its user must know
    most: Mapping[str, int] = dataclasses.field(default_factory=dict)  # rows that it holds, by quantity
    named: str | None = None  # what a name stands for that is not given; None where there is none
    first: str = ""  # line of the file

    def __call__(self, law: LawTable, name: str | None = None, **numbers: int) -> str:
        """The text of a file.

        Raises
        ------
        InputError
            For a quantity that the program does not take, more rows than it holds, and a name that it cannot read.
        """
        if law.y_name not in self.body:
            taken = " or ".join(f"{y} against {'overclosure' if y == 'pressure' else 'pressure'}" for y in self.body)
            raise InputError(f"{self.program} takes {taken} here, got {law.y_name} against {law.x_name}")
        if law.x.size > (most := self.most.get(law.y_name, law.x.size)):
            raise InputError(
                f"{self.program} holds {most} rows of {law.y_name}, this law has {law.x.size}: give fewer rows"
            )
        named = {} if self.named is None else {"name": self.named if name is None else name}
        return (
            self.first
            + comment([*law.comments, self.beyond], self.mark)
            + self.body[law.y_name](law, **named, **numbers)
        )

    def target(self, name: str) -> Target:
        """The target of this name."""
        return Target(name, self, ROWS if self.named is None else ROWS | {"name"})


@functools.cache
def group(name: str) -> dict[str, Target]:
    """Targets of one of `GROUPS` by their names."""
    declared = importlib.import_module(f"mbma_tables.export.{GROUPS[name]}").TARGETS
    return {target.name: target for target in declared}


@functools.cache
def targets() -> dict[str, Target]:
    """All targets by their names."""
    return {name: target for key in GROUPS for name, target in group(key).items()}


def names(*groups: str) -> tuple[str, ...]:
    """What a user may name, of some groups or of all; a target of an option, with a space in its name, is none."""
    return tuple(name for key in groups or GROUPS for name in group(key) if " " not in name)
