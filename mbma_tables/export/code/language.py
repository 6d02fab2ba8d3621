"""What a language states of itself, for contact laws as source code, and what it is handed."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from mbma_tables.common.arguments import FloatArray
from mbma_tables.contacts.law.law import ContactLaw
from mbma_tables.contacts.quantities.registry import law_functions
from mbma_tables.export.code.curves import Curve
from mbma_tables.export.exported_law import ExportedLaw
from mbma_tables.export.text import file, number, rendered

# functions of every law, the last of which are of no quantity; those of other quantities are
# called by their names
FUNCTIONS = (*law_functions(), "with_tangent", "curvature", "overclosure")
NAN = "Outside the range: NaN."
# folder of templates and evaluators, from that of `export` on
FOLDER = "code/languages"


@dataclasses.dataclass(frozen=True)
class Function:
    """A quantity as a function of overclosure: a ratio to the slope of a law, and a curve, added."""

    unit: str
    meaning: str
    ratio: float = 0.0
    law: str = "law"  # whose slope it is, of `AskedLaw.laws`
    curve: str = ""  # of `AskedLaw.curves`; empty for none


class AskedLaw(NamedTuple):
    """A law and the contents common to its files."""

    name: str  # prefix of functions, or name of the module or package
    exported: ExportedLaw
    # "law", and "elastic" of the contact without a hardness where functions need it
    laws: dict[str, ContactLaw]
    functions: dict[str, Function]  # of further quantities
    curves: dict[str, Curve]
    said: tuple[str, ...]  # lines of the header
    friction: float | None = None  # coefficient, where the solver asks for shear


def evaluator(name: str) -> str:
    """The text of a plain file that evaluates any law, from its folder."""
    return file(f"{FOLDER}/evaluators/{name}")


class Program(NamedTuple):
    """A program that asks laws, which tests run: it writes the values of functions at the overclosures of c.txt."""

    file: str
    #: a template, of `laws` by name and of `asked`, pairs of a law and its function: it writes
    #: a line of values.txt for each line of c.txt, a number for each pair
    text: str
    #: templates of commands, that build and run it beside the files of `laws`
    commands: tuple[str, ...]
    end: str  # of a law's file
    modules: tuple[str, ...] = ()  # of Python that it needs

    def written(self, laws: Sequence[str], functions: Sequence[str]) -> str:
        """Its text for laws of these names, the same functions of each."""
        asked = [(law, function) for law in laws for function in functions]
        return rendered(self.text, laws=laws, asked=asked)

    def built(self, laws: Sequence[str]) -> list[str]:
        """The commands that build and run it."""
        return [rendered(command, laws=laws) for command in self.commands]


class Beside(NamedTuple):
    """A file beside the first one of a target."""

    end: str  # of its name
    template: str = ""
    target: str = ""  # whose first file it is, in place of a template
    parts: Mapping[str, str] = {}  # filled in as those of its language


def _no_words() -> frozenset[str]:
    return frozenset()


def _no_places(asked: AskedLaw) -> dict[str, Any]:
    return {}


@dataclasses.dataclass(frozen=True)
class Language:
    """Format of a law in one language: a plain file that evaluates any law, and a template of the law's numbers.

    Both are named by their files in `languages`.
    """

    template: str
    mark: str  # of comments
    usage: str  # lines of the header: of {name} and {interface}
    call: str  # of a function, with {name}, {what} and {x}
    program: Program
    # for the documentation: what the file has, and how that was tested
    output: str
    outside: str  # what functions do outside the range
    tested: str
    evaluator: str = ""
    check: tuple[str, ...] = ()  # a command of its own tools that finds errors in {file}
    number: Callable[[float], str] = number
    # a column, or rows of polynomials, where the language has numbers of laws and curves
    array: Callable[[FloatArray], str] | None = None
    booleans: tuple[str, str] = ("false", "true")
    # further places of the template, from the law
    places: Callable[[AskedLaw], dict[str, Any]] = _no_places
    parts: Mapping[str, str] = dataclasses.field(
        default_factory=dict
    )  # the same of all laws
    beside: tuple[Beside, ...] = ()  # other files of the target
    alone: bool = True  # whether the first file can be used without those beside it
    # names that it cannot have, in small letters
    reserved: Callable[[], frozenset[str]] = _no_words
    inverts: bool = True  # whether it has the function `overclosure`
    subroutine: str = ""  # routine of a solver, where it calls the law: of a template
    conductance_alone: bool = False  # whether the solver asks for nothing else
    # what the header says without and with the friction of a joint, where the solver's own
    # is lost
    friction: tuple[str, str] | None = None
