"""What a language states of itself, for contact laws as source code, and what it is handed."""

import dataclasses
from collections.abc import Callable, Mapping
from typing import NamedTuple

from mbma_tables.contacts.law.law import ContactLaw
from mbma_tables.export.exported_law import ExportedLaw
from mbma_tables.export.gas_law import GasLaw
from mbma_tables.export.text import number

# functions that are there where they are asked for; the first two are slopes times a ratio
MORE = (
    "solid_conductance",
    "tangential_stiffness",
    "gas_conductance",
    "total_conductance",
    "leakage",
)
FUNCTIONS = (
    "pressure",
    "tangent",
    "with_tangent",
    "curvature",
    "area",
    "energy",
    "overclosure",
    *MORE,
)
NAN = "Outside the range: NaN."


class AskedLaw(NamedTuple):
    """A law and the contents common to its files."""

    name: str  # prefix of functions, or name of the module or package
    exported: ExportedLaw
    slopes: dict[str, float]  # ratios of functions to the slope of a law,
    sloped: ContactLaw  # of the contact without a hardness
    more: dict[str, str]  # units of the requested quantities of `MORE`
    said: tuple[str, ...]  # lines of the header
    gas: GasLaw | None = None  # in the gaps

    @property
    def yields(self) -> bool:
        """Whether functions follow an unloading stiffness, which is not the law's own slope."""
        return self.sloped is not self.exported.law


class Beside(NamedTuple):
    """A file beside the first one of a target."""

    end: str  # of its name
    template: str = ""
    target: str = ""  # whose first file it is, in place of a template
    parts: Mapping[str, str] = {}  # filled in as those of its language


def _no_words() -> frozenset[str]:
    return frozenset()


@dataclasses.dataclass(frozen=True)
class Language:
    """Format of a law in one language; templates are named from the folder of `export` on."""

    template: str
    mark: str  # of comments
    usage: str  # lines of the header: of {name} and {interface}
    call: str  # of a function, with {name}, {what} and {x}
    # places of the template that hold the law itself, from the law and the other places
    law_places: Callable[[AskedLaw, Mapping[str, str]], dict[str, str]]
    number: Callable[[float], str] = number
    # `each` of the template, functions and numbers, by default those that are slopes times a ratio
    repeated: Callable[[AskedLaw], dict[str, str]] | None = None
    parts: Mapping[str, str] = dataclasses.field(default_factory=dict)  # other places
    # the flow where contact blocks it: not known from an overclosure on, and none
    unknown: str = "(c >= {} ? (double)NAN : 0.0)"
    none: str = "0.0"
    beside: tuple[Beside, ...] = ()  # other files of the target
    alone: bool = True  # whether the first file can be used without those beside it
    # names that it cannot have, in small letters
    reserved: Callable[[], frozenset[str]] = _no_words
    inverts: bool = True  # whether it has the function `overclosure`
    # whether functions may follow the unloading stiffness of contact that yields
    unloads: bool = True
    subroutine: str = ""  # routine of a solver, where it calls the law: of a template
    conductance_alone: bool = False  # whether the solver asks for nothing else
    frictionless: bool = False  # whether the solver's own friction is lost

    def ratios(self, asked: AskedLaw) -> dict[str, str]:
        """Ratios of functions to the slope of the law."""
        return {what: self.number(ratio) for what, ratio in asked.slopes.items()}
