"""Targets: programs and formats that laws are written for, each declared once, in TARGETS of a module of `GROUPS`."""

from __future__ import annotations

import dataclasses
import functools
import importlib
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from mbma_tables.common.errors import InputError
from mbma_tables.export.text import checked_name, comment

if TYPE_CHECKING:
    from mbma_tables.export.law_table import LawTable

LAW = frozenset({"theory", "variant", "hardness", "conductivity", "conductivity_unit", "kappa"})
ROWS = LAW | {"rows", "rtol", "pressures", "leakage", "quantity", "peklenik", "direction"}
CODE = LAW | {"name", "leakage", "direction"}
FRICTION = {"kappa", "friction", "friction_pressure"}
# groups by the modules that declare them, in the order in which help lists them
GROUPS = {"SOLVERS": "solvers", "DATA": "data", "LAWS": "law_code", "FMUS": "fmu", "CODE": "c_code"}
SI = ("m", "Pa")
MAX_NAME = 80  # letters of a name, as CalculiX and Abaqus read them
# by quantity: options for it alone, and the abscissa of its rows
OPTIONS = {
    "conductance": {"conductivity", "conductivity_unit"}, "tangential_stiffness": {"kappa"}, "film": {"peklenik"},
}  # fmt: skip
AGAINST = {
    "pressure": "overclosure", "conductance": "pressure", "tangential_stiffness": "pressure",
    "leakage": "pressure", "hydraulic_aperture": "pressure", "film": "mean_separation",
}  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Target:
    """Declaration of the output for one program, or in one format."""

    name: str  # in the command `mbma export`
    # of a `LawTable` and options by name; of surface, E_star and options where `rows` is False. Text or bytes, or
    # several files by how their names end after that of the first, whose own end is ""
    write: Callable[..., Any]
    takes: frozenset[str] = ROWS  # options of the command
    rows: bool = True
    end: str = ""  # of the first file's name, where it must be that; functions are then called by the rest of it
    quantity: str = "pressure"  # of the rows, where none is asked for
    units: tuple[str, str] | None = None  # of length and of stress, where the program prescribes them

    def files(self, *given: Any, **options: Any) -> Mapping[str, bytes]:
        """The files by the ends of their names, that of the first being ""."""
        made = self.write(*given, **options)
        files = made if isinstance(made, Mapping) else {"": made}
        return {end: text if isinstance(text, bytes) else text.encode() for end, text in files.items()}


@dataclasses.dataclass(frozen=True)
class Grammar:
    """Format of the rows of a law for a program; called with a `LawTable` it returns the text of a file."""

    program: str
    mark: str  # of comments
    body: Mapping[str, Callable[..., str]]  # by quantity: text below the comments, from the law and the names
    beyond: str  # behaviour of the program outside the rows, and further notes for its user
    most: Mapping[str, int] = dataclasses.field(default_factory=dict)  # rows that it holds, by quantity
    named: str | None = None  # default name; None if there is none
    first: str = ""  # line of the file
    units: tuple[str, str] | None = None  # of length and of stress, if they are prescribed
    friction: str = ""  # notes for the user of its friction card; empty without one

    def __call__(self, law: LawTable, name: str | None = None) -> str:
        """The text of a file; a law that the program does not take raises an `InputError`."""
        own, most = tuple(law.facts[fact][1] for fact in ("h_rms", "E_star")), self.most.get(law.y_name, law.x.size)
        taken = " or ".join(f"{y} against {AGAINST[y]}" for y in self.body)
        for allowed, takes, got in (
            (law.quantity in self.body, taken, f"{law.y_name} against {law.x_name}"),
            (self.units in (None, own), " and ".join(self.units or ()), " and ".join(own)),
            (law.x.size <= most, f"{most} rows of {law.y_name} at most", f"{law.x.size}"),
            ("friction" not in law.facts or self.friction, "no friction", "friction"),
        ):
            if not allowed:
                raise InputError(f"{self.program} takes {takes} here, got {got}")
        named = {} if self.named is None else {"name": checked_name(self.named if name is None else name, MAX_NAME)}
        said = [self.friction] if "friction" in law.facts else []
        head = comment([*law.comments, *said, self.beyond], self.mark)
        return self.first + head + self.body[law.quantity](law, **named)

    def target(self, name: str) -> Target:
        """The target of this name."""
        takes = ROWS | ({"name"} if self.named else set()) | (FRICTION if self.friction else set())
        for quantity, options in OPTIONS.items():
            takes -= options if quantity not in self.body and not (self.friction and "kappa" in options) else set()
        return Target(name, self, takes, quantity=next(iter(self.body)), units=self.units)


@functools.cache
def targets(*groups: str) -> dict[str, Target]:
    """Targets of some of `GROUPS`, or of all, by their names."""
    modules = [importlib.import_module(f"mbma_tables.export.{GROUPS[name]}") for name in groups or GROUPS]
    return {target.name: target for module in modules for target in module.TARGETS}
