"""Declarations of targets, the programs and formats that laws are written for: each stands beside its writer."""

from __future__ import annotations

import dataclasses
import pathlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np

from mbma_tables.common.arguments import require_flag, require_name
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import write_file
from mbma_tables.contacts.quantities.conductances import GAS
from mbma_tables.contacts.quantities.registry import (
    conductances,
    get,
    in_files,
    needs_of,
)
from mbma_tables.export.law_table import FILM, Curve, LawTable
from mbma_tables.export.text import checked_name, comment

# of a law that is not of a joint, whose file has them
LAW = frozenset(
    {
        *("theory", "variant", "hardness", "largest_pressure"),
        *("conductivity", "conductivity_unit", "kappa"),
    }
)
FRICTION = {"kappa", "friction", "friction_pressure"}
SI = ("m", "Pa")
STAY_WITHIN_ROWS = (
    "Stay within the rows: the solver's behaviour beyond them was not tested."
)
MAX_NAME = 80  # letters of a name, as CalculiX and Abaqus read them
# those that the solid spots have a part in: of spots and gas together, and of the spots alone
CONDUCTANCES = tuple(name for name in conductances() if get(name).follows)


def names_of_rows() -> list[str]:
    """Names that rows can be asked for: of the quantities of the registry, and a film."""
    return [*in_files(), FILM]


def follows(name: str) -> str:
    """The quantity of a law that rows follow from; empty of a film, and of those of contacts."""
    return "" if name == FILM else in_files()[name].follows


def has_gas(name: str) -> bool:
    """Whether a gas conducts beside the solid spots in rows that follow from a law."""
    return bool(follows(name)) and GAS in needs_of(in_files()[name].name)


def against(name: str) -> str:
    """The abscissa of rows; that of a film, which is several quantities, is the mean gap."""
    return "mean_separation" if name == FILM else in_files()[name].against


def options_of(name: str) -> set[str]:
    """Options that belong to rows: those that give what the quantity needs."""
    if name == FILM:
        return {"peklenik"}
    options: set[str] = set()
    for need in needs_of(in_files()[name].name):
        options.update(need.options)
    return options


def option(
    help: str, kind: str = "text", check: Callable[[str, Any], Any] | None = None
) -> dict[str, Any]:
    """What is declared of an option of a file beside its name and its default, None, that it was not given.

    Parameters
    ----------
    help : str
        What it does, in the command's help and in docs/export.md.
    kind : str
        How the command reads it: "text", "names" with commas between them, "whole" or
        "number", "quantity" with a unit, "range" of two of these, "flag", "off" for a flag
        that is called --without-NAME, or words with a bar between them, of which it is one.
        It is no option of the command where this is empty.
    check : callable, optional
        Called with its name and value, raises an `InputError` for wrong ones; writers check
        those that depend on the law.
    """
    return {"help": help, "kind": kind, "check": check}


def checked_names(name: str, value: Any) -> list[str]:
    """Names of quantities of rows, of which each is one."""
    names = [value] if isinstance(value, str) else value
    if not isinstance(names, Sequence) or not names:
        raise InputError(f"{name} must be a name or several, got {value!r}")
    for one in names:
        if not isinstance(one, str):
            raise InputError(f"{name} must be a name or several, got {value!r}")
        require_quantity(one)
    if len(set(names)) < len(names):
        raise InputError(f"{name} has the same name twice: {value!r}")
    return list(names)


def checked_lines(name: str, value: Any) -> None:
    """Refuse what is no lines of text."""
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise InputError(f"{name} must be lines of text, got {value!r}")
    for line in value:
        if not isinstance(line, str):
            raise InputError(f"{name} must be lines of text, got {line!r} among them")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Options:
    """Options of every file of a law; a format that has more declares them in a class of its own."""

    name: Any = field(
        default=None,
        metadata=option(
            "Of the interaction, table, functions or module; else in the comments."
        ),
    )
    heat: Any = field(
        default=None, metadata=option("Leave conductance out.", "off", require_flag)
    )
    length_unit: Any = field(
        default=None, metadata=option("Of the file; of a joint mm by default.")
    )
    stress_unit: Any = field(
        default=None, metadata=option("Of the file; of a joint MPa by default.")
    )
    made_by: Any = field(
        default=None,
        metadata=option(
            "Lines of the header on how the file was made.", "", checked_lines
        ),
    )

    @classmethod
    def names(cls) -> dict[str, dataclasses.Field[Any]]:
        """Declarations by name, those of every file first."""
        return {each.name: each for each in dataclasses.fields(cls)}

    def __post_init__(self) -> None:
        for name, declared in self.names().items():
            value = getattr(self, name)
            check = declared.metadata["check"]
            if value is not None and check is not None:
                check(name, value)

    def given(self) -> dict[str, Any]:
        """Those that were given, of the format itself."""
        more = [name for name in self.names() if name not in Options.names()]
        values = {name: getattr(self, name) for name in more}
        return {name: value for name, value in values.items() if value is not None}


@dataclasses.dataclass(frozen=True, kw_only=True)
class QuantityOptions(Options):
    """Options of formats that have further quantities: laws as code, FMUs and rows."""

    quantity: Any = field(
        default=None,
        metadata=option(
            "Of the rows, any that contacts have, else the usual one; several for some "
            "programs. Of laws as code further functions.",
            "names",
            checked_names,
        ),
    )
    leakage: Any = field(
        default=None,
        metadata=option(
            "Flow coefficient of the gaps: rows of it alone, laws as code with it.",
            "flag",
            require_flag,
        ),
    )
    direction: Any = field(
        default=None,
        metadata=option(
            "Of leakage of a map, x, y or degrees; else the mean of both axes."
        ),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class RowOptions(QuantityOptions):
    """Options of rows; a format takes those that its quantities need."""

    pressures: Any = field(
        default=None,
        metadata=option(
            "Smallest and largest pressure: where the error holds, and the rows end.",
            "range",
        ),
    )
    rows: Any = field(
        default=None,
        metadata=option("Number of rows; else as few as --rtol needs.", "whole"),
    )
    rtol: Any = field(
        default=None,
        metadata=option(
            "Largest relative error of linear interpolation; 1e-3 by default.", "number"
        ),
    )
    friction_pressure: Any = field(
        default=None,
        metadata=option(
            "At which a friction card's stiffness holds; else amid --pressures.",
            "quantity",
        ),
    )
    peklenik: Any = field(
        default=None,
        metadata=option(
            "Of a film: length of the roughness along x over that along y.", "number"
        ),
    )


def names_of(options: type[Options]) -> set[str]:
    """Names of the options that a format has beside those of every file."""
    return options.names().keys() - Options.names().keys()


ROWS = LAW | (names_of(RowOptions) - FRICTION)


@dataclasses.dataclass(frozen=True)
class Target:
    """Declaration of the output for one program, or in one format."""

    name: str  # in the command `mbma export`
    # of a `LawTable` and options by name; of surface, E_star and options where `rows` is
    # False. Text or bytes, or several files by how their names end after that of the first,
    # whose own end is ""
    write: Callable[..., Any]
    takes: frozenset[str] = ROWS  # options of the format, and those of a law
    options: type[Options] = RowOptions  # their declarations
    rows: bool = True
    # of the first file's name, where it must be that; functions are then called by the rest
    # of it
    end: str = ""
    quantity: str = "pressure"  # of the rows, where none is asked for
    units: tuple[str, str] | None = (
        None  # of length and of stress, where the program prescribes them
    )
    most: Mapping[str, int] = dataclasses.field(
        default_factory=dict
    )  # rows that the program keeps, by quantity
    # of rows, which the program takes, all where it is empty; several in one file where
    # `several`
    quantities: tuple[str, ...] = ()
    several: bool = False
    alone: bool = True  # whether the first file can be used without those beside it
    beside: tuple[str, ...] = ()  # ends of the names of other files
    # for the documentation: what the file has, and how that was tested
    output: str = ""
    outside: str = ""  # what it does outside the range of a law
    tested: str = ""
    longest_name: int | None = None  # letters of a name, where one stands in the file
    # curves that the first file of rows has
    read: Callable[[bytes], list[Curve]] | None = None

    def given_options(self, given: Mapping[str, Any]) -> Options:
        """The options of a file, checked.

        Raises
        ------
        InputError
            For options that the target does not have, and values of a wrong type.
        """
        declared = self.options.names()
        values = {}
        for name, value in given.items():
            is_flag = name in declared and declared[name].metadata["kind"] == "flag"
            is_off = is_flag and isinstance(value, bool | np.bool_) and not value
            if value is not None and not is_off:
                values[name] = value
        allowed = self.takes & names_of(self.options) | Options.names().keys()
        unused = [name for name in values if name not in allowed]
        if unused:
            raise InputError(
                f"without effect on {self.name}: leave {' and '.join(unused)} out"
            )
        return self.options(**values)

    def takes_rows(self, name: str) -> bool:
        """Whether the program takes rows of a quantity."""
        return self.rows and (not self.quantities or name in self.quantities)

    def place_of_name(
        self, name: str | None, out: pathlib.Path | None
    ) -> tuple[dict[str, str], tuple[str, ...]]:
        """Where a name stands: the argument of `write`, or else a line of the comments.

        Raises
        ------
        InputError
            Where the functions are called by the name of the file `out`, which has another
            end, or another name is asked for.
        """
        if not self.end:
            if name is None:
                return {}, ()
            if "name" in self.takes:
                return {"name": name}, ()
            if not isinstance(name, str):
                raise InputError(f"a name must be text, got {name!r}")
            return {}, (f"name: {name}",)
        if out is None:
            return {"name": "joint" if name is None else name}, ()
        if out.suffix != self.end:
            raise InputError(
                f"the path of {self.name} must be NAME{self.end}, got {out.name!r}"
            )
        if name not in (None, out.stem):
            raise InputError(
                f"{self.name} is called by the name of its file, {out.stem!r}: leave name out, got {name!r}"
            )
        return {"name": out.stem}, ()

    def files(self, *given: Any, **options: Any) -> Mapping[str, bytes]:
        """The files by the ends of their names, that of the first being ""."""
        made = self.write(*given, **options)
        files = made if isinstance(made, Mapping) else {"": made}
        return {
            end: text if isinstance(text, bytes) else text.encode()
            for end, text in files.items()
        }


@dataclasses.dataclass(frozen=True, kw_only=True)
class RowFormat:
    """Declaration of the rows of a program; called with a `LawTable` it returns a text.

    It stands beside the functions that write and read the text. The command, `Joint.export`,
    the tests and the table of docs/export.md take every one that a file of `rows/solvers`
    declares.
    """

    name: str  # of the target
    program: str
    output: str  # what the file has, for the documentation
    outside: str  # what the program does outside the rows, in a few words
    tested: str  # how the program was seen to read it
    mark: str  # of comments
    # behaviour of the program outside the rows, and further notes for its user
    beyond: str
    # curves as the program takes them from a text, which the tests compare with the rows
    read: Callable[[str], list[Curve]]
    # by quantity: text below the comments, from the law and the names
    body: Mapping[str, Callable[..., str]] = dataclasses.field(default_factory=dict)
    # the same text of any quantity, where the program takes all of them
    of_any: Callable[..., str] | None = None
    # rows that it holds, by quantity
    most: Mapping[str, int] = dataclasses.field(default_factory=dict)
    named: str | None = None  # default name; None if there is none
    longest_name: int = MAX_NAME  # letters
    first: str = ""  # line of the file
    # of length and of stress, if they are prescribed
    units: tuple[str, str] | None = None
    friction: str = ""  # notes for the user of its friction card; empty without one
    # whether rows of conductance stand beside those of the pressure of the same joint
    closure: bool = False
    # the text of several laws below the comments, where a file may have them, from the laws
    # and the names
    several: Callable[..., str] | None = None

    def __call__(
        self, law: LawTable | Sequence[LawTable], name: str | None = None
    ) -> str:
        """The text of a file of one law, or of several; what the program does not take raises an `InputError`."""
        laws = [law] if isinstance(law, LawTable) else list(law)
        if len(laws) > 1 and self.several is None:
            raise InputError(
                f"{self.program} takes one quantity a file, got {len(laws)}: write a file for each"
            )
        named = (
            {}
            if self.named is None
            else {
                "name": checked_name(
                    self.named if name is None else name, self.longest_name
                )
            }
        )
        for one in laws:
            self._check(one)
        # those of the first law, and what else the others have to say
        comments = list(laws[0].comments)
        closures = [
            one.behaviour for one in laws if self.closure and one.behaviour is not None
        ]
        for other in (*laws[1:], *closures):
            comments += [line for line in other.comments if line not in comments]
        comments += [self.friction] if "friction" in laws[0].facts else []
        head = self.first + comment([*comments, self.beyond], self.mark)
        if len(laws) > 1 and self.several is not None:
            return head + self.several(laws, **named)
        text = self.of_any or self.body[laws[0].quantity]
        return head + text(laws[0], **named)

    def _check(self, law: LawTable) -> None:
        """Refuse a law that the program does not take."""
        own = tuple(law.facts[fact][1] for fact in ("h_rms", "E_star"))
        most = self.most.get(law.y_name, law.x.size)
        taken = " or ".join(f"{y} against {against(y)}" for y in self.body)
        for allowed, takes, got in (
            (
                self.of_any is not None or law.quantity in self.body,
                taken,
                f"{law.y_name} against {law.x_name}",
            ),
            (
                self.units in (None, own),
                " and ".join(self.units or ()),
                " and ".join(own),
            ),
            (law.x.size <= most, f"{most} rows of {law.y_name} at most", f"{law.x.size}"),
            ("friction" not in law.facts or self.friction, "no friction", "friction"),
        ):
            if not allowed:
                raise InputError(f"{self.program} takes {takes} here, got {got}")

    def target(self) -> Target:
        """The same as a target."""
        quantities = tuple(self.body) if self.of_any is None else ()
        of_any: set[str] = set()
        own: set[str] = set()
        for name in names_of_rows():
            options = options_of(name)
            of_any |= options
            own |= options if name in (quantities or names_of_rows()) else set()
        takes = (
            (ROWS - of_any)
            | own
            | ({"name"} if self.named else set())
            | (FRICTION if self.friction else set())
        )
        return Target(
            self.name,
            self,
            takes,
            quantity=next(iter(self.body), "pressure"),
            units=self.units,
            most=self.most,
            quantities=quantities,
            several=self.several is not None,
            output=self.output,
            outside=self.outside,
            tested=self.tested,
            longest_name=self.longest_name if self.named else None,
            read=lambda content: self.read(content.decode()),
        )


def write_files(out: pathlib.Path, files: Mapping[str, bytes]) -> list[pathlib.Path]:
    """Write all files of a target, the first as `out`, those beside it by its name; the paths, the first one last.

    Raises
    ------
    InputError
        Where a file beside the first one would have its name.
    """
    if out.suffix and any(out.name == f"{out.stem}{end}" for end in files):
        raise InputError(
            f"{out.name}: a file beside the first one has this name, take another"
        )
    paths = []
    # files that the first one needs are written before it
    for end in sorted(files, reverse=True):
        path = out.with_name(f"{out.stem}{end}") if end else out
        write_file(path, files[end])
        paths.append(path)
    return paths


def require_quantity(name: str) -> None:
    """Refuse a name that is no quantity of rows."""
    require_name("quantity of rows", name, dict.fromkeys(names_of_rows()))
