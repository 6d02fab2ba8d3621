"""Files for other programs, of a surface, a joint, a law or rows: one request, with one set of defaults and refusals."""

from __future__ import annotations

import dataclasses
import functools
import math
import pathlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

from mbma_tables import __version__
from mbma_tables.bodies.bodies import Bodies, BodiesInUnits
from mbma_tables.common.arguments import require_name
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import HEAT_CONDUCTANCE, Units, factor
from mbma_tables.contacts.law.law import ContactLaw
from mbma_tables.contacts.quantities.gas import VACUUM
from mbma_tables.contacts.quantities.interface import (
    NOTHING_BETWEEN,
    Gas,
    Interface,
)
from mbma_tables.contacts.quantities.leakage import flow_coefficient
from mbma_tables.contacts.quantities.tangential import ratio_on
from mbma_tables.export.code.languages import LANGUAGES
from mbma_tables.export.exported_law import GasInGaps
from mbma_tables.export.law_table import FILM, LawTable
from mbma_tables.export.registry import declared_options, targets
from mbma_tables.export.rows.law_rows import describe_law
from mbma_tables.export.targets import (
    CONDUCTANCES,
    Options,
    RowOptions,
    Target,
    checked_names,
    follows,
    has_gas,
    options_of,
    write_files,
)
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.base import Theory, UserTheory

# options that bodies have in them
OF_BODIES = ("hardness", "largest_pressure", "adhesion")
MILLI = 1e3  # mW of a W, the power of the system N, mm, MPa, s
# numbers of a law with lengths and stresses in such units: the arguments of `describe_law`
# for conductance, and one W/(m^2 K) in their unit
Heat: TypeAlias = Callable[[Mapping[str, str | None]], tuple[dict[str, Any], float]]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Subject:
    """What a file is of: a surface between bodies, of a joint or not."""

    surface: AnySurface
    E_star: float | str
    stress_unit: str | None = None  # of a plain modulus
    theory: str | Theory | UserTheory | None = None
    variant: str = "reported"
    hardness: float | str = math.inf  # infinite where nothing yields
    largest_pressure: float | str | None = None  # so far; None of first loading
    heat: Heat | None = None  # None where there is no conductivity
    # normal over tangential stiffness, or that at a contact area
    kappa: float | Callable[[Any], Any] | None = None
    kappa_varies: bool = False  # whether it depends on the contact area
    friction: float | None = None
    gas: Gas | None = None
    # of quantities that are read from a contact; None where modulus and hardness are all
    bodies: Bodies | None = None
    interface: Interface = NOTHING_BETWEEN
    # A joint has conductance, friction and tangential stiffness without being asked, and
    # its file says what is left out of it. Others have what was asked for.
    is_joint: bool = False


class Written(NamedTuple):
    """Files of a target, and what is said of them."""

    files: Mapping[str, bytes]  # by the ends of their names, that of the first being ""
    doubts: tuple[str, ...]  # at which of the pressures asked for the law is not valid


def subject_of_law(law: ContactLaw) -> Subject:
    """A law as what a file is of: its surface, bodies, theory and interface."""
    setup = law.setup
    bodies = setup.bodies.bodies
    # its numbers have the units of the user, or none, as the law's have
    return Subject(
        surface=law.surface,
        E_star=bodies.E_star,
        stress_unit=law.units.stress,
        theory=setup.theory,
        hardness=math.inf if bodies.hardness is None else bodies.hardness,
        largest_pressure=bodies.largest_pressure,
        heat=heat_of(setup.bodies, law.surface),
        kappa=functools.partial(ratio_on, law.surface, bodies, None),
        bodies=bodies,
        interface=setup.interface,
        gas=setup.interface.gas,
    )


def export_law(
    law: ContactLaw,
    target: str,
    pressures: tuple[float | str, float | str] | None = None,
    *,
    path: pathlib.Path | str | None = None,
    **options: Any,
) -> str | bytes | list[pathlib.Path]:
    """A law as input of a solver, as data or as code; arguments as for `Joint.export`.

    Units are those of the law; pressures may be left out, as for `describe_law`.

    Examples
    --------
    >>> from mbma_tables import Surface, contact_law
    >>> law = contact_law(Surface.named("concrete"), "13.3 MPa", "calibrated")
    >>> export_law(law, "optistruct", rows=20).count("TABLES1*")
    1
    """
    return exported(
        subject_of_law(law), target, {"pressures": pressures, **options}, path
    )


def exported(
    subject: Subject, target: str, given: Mapping[str, Any], path: Any = None
) -> str | bytes | list[pathlib.Path]:
    """The first file of a target, as text where it is; with a path the paths of all files."""
    try:
        out = None if path is None else pathlib.Path(path)
    except TypeError:
        raise InputError(f"path must be that of a file, got {path!r}") from None
    files = files_of(subject, target, given, out).files
    if out is not None:
        return write_files(out, files)
    try:
        return files[""].decode()
    except UnicodeDecodeError:
        return files[""]


def files_of(
    subject: Subject | Sequence[LawTable],
    target: str,
    asked: Mapping[str, Any],
    out: pathlib.Path | None = None,
) -> Written:
    """The files of a target, of a subject or of rows that were written before.

    Raises
    ------
    InputError
        For an option that the target does not take or that has a wrong type, for the
        whole model, which is of no subject, and for a target that is several files without
        the path `out`.
    """
    program = _target_of_laws(target)
    require_options(asked)
    if not isinstance(subject, Subject):
        return _of_rows(subject, program, asked, out)
    options = program.given_options(asked)
    units = _units(subject, program, options)
    if out is None and not program.alone:
        raise InputError(
            f"{target} is several files, of which the first needs the others: give path"
        )
    named, line_of_name = program.place_of_name(options.name, out)
    subject = _with_units_of_adhesion(subject, units)
    shared: dict[str, Any] = {"theory": subject.theory, "hardness": subject.hardness}
    shared |= units
    shared |= options.given()
    if subject.bodies is not None and subject.bodies.adhesion is not None:
        shared["adhesion"] = subject.bodies.adhesion
    if subject.largest_pressure is not None:
        shared["largest_pressure"] = subject.largest_pressure
    if subject.variant != "reported":
        shared["variant"] = subject.variant
    shared["made_by"] = (*line_of_name, *_made_by(target, options.made_by))
    if isinstance(options, RowOptions):
        laws = _all_rows(subject, program, options, shared)
        files = program.files(laws[0] if len(laws) == 1 else laws, **named)
        return Written(files, _doubts(laws) if options.pressures is not None else ())
    bodies: float | str | Bodies = subject.E_star
    if "quantity" in shared and subject.bodies is not None:
        # those of the contact itself
        for name in OF_BODIES:
            shared.pop(name, None)
        bodies = subject.bodies
        shared["interface"] = subject.interface
    if "direction" in shared and "leakage" not in shared:
        raise InputError("direction is of leakage: ask for leakage or leave it out")
    shared |= _of_code(subject, target, units, options.heat)
    return Written(program.files(subject.surface, bodies, **shared, **named), ())


def _of_rows(
    laws: Sequence[LawTable],
    program: Target,
    asked: Mapping[str, Any],
    out: pathlib.Path | None,
) -> Written:
    """Files of rows that were written before, whose comments stay."""
    if not program.rows:
        raise InputError(
            f"{program.name} is made from a surface or a joint, not from rows"
        )
    given = [
        name
        for name, value in asked.items()
        if value is not None and name not in ("name", "made_by")
    ]
    if given:
        raise InputError(f"rows are written as they are: leave {' and '.join(given)} out")
    options = program.given_options(asked)
    named, line_of_name = program.place_of_name(options.name, out)
    more = (*line_of_name, *(options.made_by or ()))
    again = [dataclasses.replace(law, comments=(*law.comments, *more)) for law in laws]
    if len(again) > 1 and not program.several:
        listed = [law.quantity for law in again]
        raise InputError(
            f"{program.name} has one quantity a file, and these are {listed}"
        )
    return Written(program.files(again[0] if len(again) == 1 else again, **named), ())


def _made_by(target: str, lines: Any) -> tuple[str, ...]:
    """Lines of the header on how the file was made."""
    by_default = f"written from Python by mbma_tables {__version__}: a joint for {target}"
    return tuple(lines or ()) or (by_default,)


def require_options(given: Mapping[str, Any]) -> None:
    """Refuse names that are no options of any target."""
    for name in given:
        require_name("option of exports", name, declared_options())


def _all_rows(
    subject: Subject, program: Target, options: RowOptions, shared: dict[str, Any]
) -> list[LawTable]:
    """Rows of one quantity, or of several."""
    for name in ("pressures", "quantity", "friction_pressure"):
        shared.pop(name, None)
    leakage = shared.pop("leakage", False)
    wanted = _quantities(subject, program, options, leakage)
    flows = [name for name in wanted if follows(name) == flow_coefficient.name]
    if options.direction is not None and not flows:
        raise InputError("direction is of leakage: ask for leakage or leave it out")
    if options.pressures is not None:
        shared["pressures"] = options.pressures
    elif subject.is_joint and wanted != [FILM]:
        raise InputError(
            f"{program.name} needs pressures, the smallest and the largest, such as ('1 MPa', '50 MPa')"
        )
    rubbed = subject.friction is not None and "friction" in program.takes
    if rubbed:
        shared["friction"] = subject.friction
        shared["friction_pressure"] = options.friction_pressure
    elif options.friction_pressure is not None:
        raise InputError(f"without effect on {program.name}: leave friction_pressure out")
    if subject.bodies is None:
        _refuse_unused(subject, wanted)
    return [_rows(subject, program, one, shared, rubbed) for one in wanted]


def _refuse_unused(subject: Subject, wanted: Sequence[str]) -> None:
    """Refuse what was asked for and no quantity uses."""
    needed: set[str] = set()
    for name in wanted:
        needed |= options_of(name)
    unused = []
    if subject.heat is not None and "conductivity" not in needed:
        unused.append("conductivity")
    if subject.kappa is not None and "kappa" not in needed and subject.friction is None:
        unused.append("nu")
    if unused:
        raise InputError(
            f"{' and '.join(unused)} does not belong to quantity={list(wanted)}: leave it out"
        )


def _quantities(
    subject: Subject, program: Target, options: RowOptions, leakage: bool
) -> list[str]:
    """Names of the quantities of rows: those asked for, else the usual one of the program."""
    quantity = options.quantity
    if quantity is None:
        return ["leakage"] if leakage else [_usual(subject, program, options.heat)]
    if leakage:
        raise InputError("quantity and leakage are both given: give quantity='leakage'")
    names = checked_names("quantity", quantity)
    if len(names) > 1 and not program.several:
        raise InputError(f"{program.name} has one quantity a file: give one of {names}")
    return names


def _target_of_laws(target: Any) -> Target:
    """The target of this name, unless it is the whole model."""
    if not isinstance(target, str):
        raise InputError(f"target must be the name of one, such as 'csv', got {target!r}")
    require_name("target", target, targets())
    found = targets()[target]
    if "theory" not in found.takes:
        raise InputError(
            f"target {target!r} is the whole model, without any joint: `mbma export {target}` writes it; "
            "the law of a joint in C is target 'c-law'"
        )
    return found


def _units(subject: Subject, program: Target, options: Options) -> dict[str, str | None]:
    """Units of length and stress: those asked for, those that the program prescribes, or the usual ones.

    These are mm and MPa of a joint, and those of the surface and its modulus otherwise.
    """
    usual = ("mm", "MPa") if subject.is_joint else (None, subject.stress_unit)
    prescribed = program.units or usual
    asked = (
        prescribed[0] if options.length_unit is None else options.length_unit,
        prescribed[1] if options.stress_unit is None else options.stress_unit,
    )
    if program.units is not None and asked != prescribed:
        raise InputError(
            f"{program.name} is written in {' and '.join(program.units)}, got {' and '.join(map(str, asked))}"
        )
    return {"length_unit": asked[0], "stress_unit": asked[1]}


def _with_units_of_adhesion(subject: Subject, units: Mapping[str, str | None]) -> Subject:
    """The subject with units of plain numbers of its attraction, as files may have others than the surface."""
    if subject.bodies is None or subject.bodies.adhesion is None:
        return subject
    bodies = subject.bodies
    known = bodies.in_units(subject.surface).units
    stress = subject.stress_unit if known.stress in (None, "1") else known.stress
    named = bodies.adhesion.named(
        Units(
            length=known.length or units["length_unit"],
            stress=stress or units["stress_unit"],
        )
    )
    return dataclasses.replace(
        subject, bodies=dataclasses.replace(bodies, adhesion=named)
    )


def _usual(subject: Subject, program: Target, heat: bool | None) -> str:
    """The quantity of rows where none is asked for.

    It is conductance where the bodies have a conductivity, or a joint may have, the total
    one in a gas; else what the program takes.
    """
    conducts = heat or (heat is None and (subject.is_joint or subject.heat is not None))
    is_vacuum = subject.gas is None or subject.gas.name == VACUUM
    of_subject = CONDUCTANCES[1:] if is_vacuum else CONDUCTANCES
    taken = [name for name in of_subject if program.takes_rows(name)]
    return taken[0] if taken and conducts else program.quantity


def heat_of(in_units: BodiesInUnits, surface: AnySurface) -> Heat | None:
    """Conductance of bodies with a thermal conductivity beside a surface; None without one."""
    if not in_units.conductivity_is_given:
        return None
    per_length, unit = in_units.conductivity
    if unit != HEAT_CONDUCTANCE.unit(in_units.units):
        return None
    # k_s over the surface's unit of length, to W/(m K)
    conductivity = float(per_length) / factor("m", str(surface.unit))

    def of_units(units: Mapping[str, str | None]) -> tuple[dict[str, Any], float]:
        """Of power mW with N, mm and MPa, else W."""
        length = units["length_unit"] or str(surface.unit)
        metre = factor("m", length)
        consistent = (length, units["stress_unit"]) == ("mm", "MPa")
        power, symbol = (MILLI, "mW") if consistent else (1.0, "W")
        arguments = {
            "conductivity": power * conductivity / metre,
            "conductivity_unit": f"{symbol}/({length} K)",
        }
        return arguments, power / metre**2

    return of_units


def given_heat(conductivity: float | None, unit: str | None) -> Heat:
    """Conductance of k_s in a unit of the user, which stays."""

    def of_units(units: Mapping[str, str | None]) -> tuple[dict[str, Any], float]:
        arguments = {"conductivity": conductivity, "conductivity_unit": unit}
        return arguments, math.nan

    return of_units


def _conductivity(
    subject: Subject, program: Target, units: Mapping[str, str | None]
) -> tuple[dict[str, Any], float]:
    """k_s in units of the law, and one W/(m^2 K) in those of conductance."""
    if subject.heat is not None:
        return subject.heat(units)
    # of a program whose numbers do not depend on the conductivity
    if program.quantity in CONDUCTANCES:
        return {"conductivity": 1.0, "conductivity_unit": "W/(m K)"}, math.nan
    if subject.bodies is None:
        raise InputError(
            "conductance needs conductivity, which is missing: k_s = 2 k1 k2/(k1 + k2)"
        )
    raise InputError(
        "conductance needs the thermal conductivity of the bodies: "
        "Bodies(..., conductivity='45 W/(m K)'), or heat=False, which leaves conductance out"
    )


def _rows(
    subject: Subject,
    program: Target,
    quantity: str,
    shared: Mapping[str, Any],
    rubbed: bool,
) -> LawTable:
    """Rows of one quantity."""
    asked = dict(shared)
    of_law = follows(quantity)
    if of_law != flow_coefficient.name:
        asked.pop("direction", None)
    if quantity != FILM:
        asked.pop("peklenik", None)
    if not of_law and quantity != FILM and subject.bodies is not None:
        # of the contact itself
        for name in OF_BODIES:
            asked.pop(name, None)
        return describe_law(
            subject.surface,
            subject.bodies,
            quantity=quantity,
            interface=subject.interface,
            **asked,
        )
    if program.most:
        asked["most_rows"] = program.most.get(quantity)
    units = {name: asked[name] for name in ("length_unit", "stress_unit")}
    if quantity in CONDUCTANCES:
        heat, unit = _conductivity(subject, program, units)
        asked |= heat
        if has_gas(quantity) and subject.gas is not None:
            asked["gas"] = GasInGaps(subject.gas, unit)
    elif (
        not of_law and subject.heat is not None and "conductivity" in options_of(quantity)
    ):
        asked |= subject.heat(units)[0]
    if rubbed or (of_law and "kappa" in options_of(quantity)):
        asked["kappa"] = subject.kappa
    return describe_law(subject.surface, subject.E_star, quantity=quantity, **asked)


def _doubts(laws: Sequence[LawTable]) -> tuple[str, ...]:
    """Lines of headers on the pressures asked for at which the law is not valid."""
    doubts: dict[str, None] = {}
    for law in laws:
        rows = law.behaviour or law
        for line in rows.comments:
            if not line.startswith("not valid"):
                continue
            # a limit below the smallest requested pressure does not matter
            below = line.startswith("not valid below") and rows.y_name == "pressure"
            if below and float(line.split("p = ")[1].split()[0]) <= rows.floor:
                continue
            doubts[line] = None
    return tuple(doubts)


def _of_code(
    subject: Subject,
    target: str,
    units: Mapping[str, str | None],
    heat: bool | None,
) -> dict[str, Any]:
    """Arguments of a law as code; comments name what is left out of a joint."""
    language = LANGUAGES.get(target)
    notes: list[str] = []
    if subject.largest_pressure is not None:
        if language and language.conductance_alone:
            raise InputError(
                f"{target} is of conductance alone, which jumps at the largest pressure: "
                "rows have it, as of abaqus and calculix"
            )
        notes.append(
            "without tangential stiffness and conductance, which jump at the largest pressure: "
            "rows have them"
        )
        return {"notes": tuple(notes)}
    arguments = _stiffness_before_slip(subject, notes)
    if language and language.friction and subject.friction is not None:
        if "kappa" in arguments or not subject.is_joint:
            arguments["friction"] = subject.friction
        else:
            notes.append(
                f"the joint's friction, {subject.friction:g}, is left out: the faces slide "
                "freely"
            )
    arguments |= _heat_of_code(subject, target, units, heat, notes)
    return {**arguments, "notes": tuple(notes)}


def _stiffness_before_slip(subject: Subject, notes: list[str]) -> dict[str, Any]:
    """The ratio of stiffnesses of a law as code, or a note that it is left out."""
    if subject.kappa_varies:
        notes.append(
            "without tangential stiffness, whose ratio varies with the area: rows have it"
        )
        return {}
    if not callable(subject.kappa):
        return {} if subject.kappa is None else {"kappa": subject.kappa}
    try:
        return {"kappa": float(subject.kappa(None))}
    except InputError as fault:
        # of bodies without Poisson's ratio, and of a lay without a direction
        notes.append(f"without tangential stiffness: {fault}")
        return {}


def _heat_of_code(
    subject: Subject,
    target: str,
    units: Mapping[str, str | None],
    heat: bool | None,
    notes: list[str],
) -> dict[str, Any]:
    """The conductivity of a law as code, and its gas; or a note that conductance is left out."""
    language = LANGUAGES.get(target)
    # of a routine that the solver asks for conductance
    alone = language is not None and language.conductance_alone
    if heat is False:
        if alone:
            raise InputError(f"{target} is of conductance alone: leave heat out")
        return {}
    if heat is None and subject.heat is None and not alone:
        if subject.is_joint:
            notes.append("without conductance: the bodies have no thermal conductivity")
        return {}
    conductivity, unit = _conductivity(subject, targets()[target], units)
    if subject.gas is None:
        return conductivity
    return conductivity | {"gas": GasInGaps(subject.gas, unit)}
