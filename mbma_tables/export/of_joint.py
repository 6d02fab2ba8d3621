"""A joint written for other programs: each target with the files that belong to it, in any units."""

from __future__ import annotations

import math
import pathlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from mbma_tables import __version__
from mbma_tables.bodies.bodies import Bodies
from mbma_tables.common.arguments import nearest, require_flag
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import factor
from mbma_tables.contacts.quantities.gas import VACUUM
from mbma_tables.contacts.quantities.interface import Gas, Interface
from mbma_tables.export.code.languages import LANGUAGES
from mbma_tables.export.exported_law import GasInGaps
from mbma_tables.export.rows.law_rows import describe_law
from mbma_tables.export.targets import (
    AGAINST,
    CONDUCTANCES,
    Target,
    require_quantity,
    targets,
)
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.base import Theory

MILLI = 1e3  # mW of a W, the power of the system N, mm, MPa, s


class ExportedJoint(NamedTuple):
    """What an export needs of a joint."""

    surface: AnySurface
    E_star: str
    theory: str | Theory | None
    hardness: float | str  # infinite where it is not known
    conductivity: float | None  # k_s = 2 k1 k2/(k1 + k2) [W/(m K)]
    kappa: Callable[[Any], Any]  # normal over tangential stiffness at a contact area
    kappa_varies: bool  # whether it depends on the contact area
    friction: float | None
    gas: Gas
    bodies: Bodies
    interface: Interface


def joint_files(
    joint: ExportedJoint,
    target: str,
    *,
    out: pathlib.Path | None = None,
    pressures: Any = None,
    name: str | None = None,
    heat: bool | None = None,
    friction_pressure: float | str | None = None,
    quantity: str | Sequence[str] | None = None,
    length_unit: str | None = None,
    stress_unit: str | None = None,
    leakage: bool = False,
    made_by: tuple[str, ...] = (),
    **options: Any,
) -> Mapping[str, bytes]:
    """The files of a target by the ends of their names, as `Joint.export` describes them.

    Options of some targets alone, such as `rows` or `binaries`, are refused by name where
    others get them.
    """
    program = _target_of_laws(target)
    units = _units(program, length_unit, stress_unit)
    require_flag("leakage", leakage)
    if heat is not None:
        require_flag("heat", heat)
    given = {key: value for key, value in options.items() if value is not None}
    if leakage:
        given["leakage"] = leakage
    _refuse(target, [key for key in given if key not in program.takes])
    if out is None and not program.alone:
        raise InputError(
            f"{target} is several files, of which the first needs the others: give path"
        )
    named, line_of_name = program.place_of_name(name, out)
    shared = {"theory": joint.theory, "hardness": joint.hardness, **units, **given}
    shared["made_by"] = (*line_of_name, *_made_by(target, made_by))
    for_rows = {
        "pressures": pressures,
        "quantity": quantity,
        "friction_pressure": friction_pressure,
    }
    if program.rows:
        return program.files(_all_rows(joint, program, heat, shared, **for_rows), **named)
    _refuse(target, [key for key, value in for_rows.items() if value is not None])
    shared |= _of_code(joint, target, units, heat)
    return program.files(joint.surface, joint.E_star, **shared, **named)


def _made_by(target: str, lines: Any) -> tuple[str, ...]:
    """Lines of the header on how the file was made."""
    if isinstance(lines, str) or not isinstance(lines, Sequence):
        raise InputError(f"made_by must be lines of text, got {lines!r}")
    for line in lines:
        if not isinstance(line, str):
            raise InputError(f"made_by must be lines of text, got {line!r} among them")
    by_default = f"written from Python by mbma_tables {__version__}: a joint for {target}"
    return tuple(lines) or (by_default,)


def _all_rows(
    joint: ExportedJoint,
    program: Target,
    heat: bool | None,
    shared: dict[str, Any],
    pressures: Any,
    quantity: str | Sequence[str] | None,
    friction_pressure: float | str | None,
) -> Any:
    """Rows of one quantity, or a list of those of several."""
    leakage = shared.pop("leakage", False)
    wanted = _quantities(joint, program, quantity, leakage, heat)
    if pressures is not None:
        shared["pressures"] = pressures
    elif wanted != ["film"]:
        raise InputError(
            f"{program.name} needs pressures, the smallest and the largest, such as ('1 MPa', '50 MPa')"
        )
    rubbed = joint.friction is not None and "friction" in program.takes
    if rubbed:
        shared |= {"friction": joint.friction, "friction_pressure": friction_pressure}
    elif friction_pressure is not None:
        _refuse(program.name, ["friction_pressure"])
    laws = [_rows(joint, program, one, shared, rubbed) for one in wanted]
    return laws[0] if len(laws) == 1 else laws


def _quantities(
    joint: ExportedJoint,
    program: Target,
    quantity: str | Sequence[str] | None,
    leakage: bool,
    heat: bool | None,
) -> list[str]:
    """Names of the quantities of rows: those asked for, else the usual one of the program."""
    if quantity is None:
        return ["leakage"] if leakage else [_usual(joint, program, heat)]
    if leakage:
        raise InputError("quantity and leakage are both given: give quantity='leakage'")
    names = [quantity] if isinstance(quantity, str) else quantity
    if not isinstance(names, Sequence) or not names:
        raise InputError(f"quantity must be a name or several, got {quantity!r}")
    for name in names:
        if not isinstance(name, str):
            raise InputError(f"quantity must be a name or several, got {quantity!r}")
        require_quantity(name)
    if len(set(names)) < len(names):
        raise InputError(f"quantity has the same name twice: {quantity!r}")
    if len(names) > 1 and not program.several:
        raise InputError(
            f"{program.name} has one quantity a file: give one of {list(names)}"
        )
    return list(names)


def _target_of_laws(target: Any) -> Target:
    """The target of this name, unless it is the whole model."""
    of_laws = {key: each for key, each in targets().items() if "theory" in each.takes}
    if not isinstance(target, str):
        raise InputError(f"target must be the name of one, such as 'csv', got {target!r}")
    if target in targets() and target not in of_laws:
        raise InputError(
            f"target {target!r} is the whole model, without any joint: `mbma export {target}` writes it; "
            "the law of a joint in C is target 'c-law'"
        )
    if target not in of_laws:
        raise InputError(
            f"no target of laws is called {target!r}: {nearest(target, of_laws)}"
        )
    return of_laws[target]


def _units(program: Target, length: str | None, stress: str | None) -> dict[str, str]:
    """Units of length and stress: those asked for, those that the program prescribes, or mm and MPa."""
    prescribed = program.units or ("mm", "MPa")
    asked = (
        prescribed[0] if length is None else length,
        prescribed[1] if stress is None else stress,
    )
    if program.units is not None and asked != prescribed:
        raise InputError(
            f"{program.name} is written in {' and '.join(prescribed)}, got {' and '.join(map(str, asked))}"
        )
    return {"length_unit": asked[0], "stress_unit": asked[1]}


def _refuse(target: str, names: list[str]) -> None:
    if names:
        raise InputError(f"without effect on {target}: leave {' and '.join(names)} out")


def _usual(joint: ExportedJoint, program: Target, heat: bool | None) -> str:
    """The quantity of rows where none is asked for: conductance, the total one in a gas, or what the program takes."""
    of_joint = CONDUCTANCES[1:] if joint.gas.name == VACUUM else CONDUCTANCES
    taken = [name for name in of_joint if name in program.quantities]
    return taken[0] if taken and heat is not False else program.quantity


def _conductivity(
    joint: ExportedJoint, units: Mapping[str, str]
) -> tuple[dict[str, Any], float]:
    """k_s in units of the law: of power mW with N, mm and MPa, else W; and one W/(m^2 K) in those of conductance."""
    if joint.conductivity is None:
        raise InputError(
            "conductance needs the thermal conductivity of the bodies: "
            "Bodies(..., conductivity='45 W/(m K)'), or heat=False, which leaves conductance out"
        )
    length = units["length_unit"]
    metre = factor("m", length)
    consistent = (length, units["stress_unit"]) == ("mm", "MPa")
    power, symbol = (MILLI, "mW") if consistent else (1.0, "W")
    arguments = {
        "conductivity": power * joint.conductivity / metre,
        "conductivity_unit": f"{symbol}/({length} K)",
    }
    return arguments, power / metre**2


def _rows(
    joint: ExportedJoint,
    program: Target,
    quantity: str,
    shared: Mapping[str, Any],
    rubbed: bool,
) -> Any:
    """Rows of one quantity."""
    asked = dict(shared)
    if quantity not in AGAINST:
        # of the contact of the joint itself
        del asked["hardness"]
        return describe_law(
            joint.surface,
            joint.bodies,
            quantity=quantity,
            interface=joint.interface,
            **asked,
        )
    if program.most:
        asked["most_rows"] = program.most.get(quantity)
    if quantity in CONDUCTANCES:
        heat, unit = _conductivity(joint, shared)
        asked |= heat
        if quantity == "total_conductance":
            asked["gas"] = GasInGaps(joint.gas, unit)
    if rubbed or quantity == "tangential_stiffness":
        asked["kappa"] = joint.kappa
    return describe_law(joint.surface, joint.E_star, quantity=quantity, **asked)


def _of_code(
    joint: ExportedJoint, target: str, units: Mapping[str, str], heat: bool | None
) -> dict[str, Any]:
    """Arguments of a law as code, with what the joint has; comments name what is left out."""
    language = LANGUAGES.get(target)
    notes: list[str] = []
    if language and language.frictionless and joint.friction is not None:
        notes.append(
            f"the joint's friction, {joint.friction:g}, is left out: the faces slide freely"
        )
    arguments: dict[str, Any] = {}
    if language and not language.unloads and not _is_infinite(joint.hardness):
        notes.append(
            "without conductance and tangential stiffness, which follow the unloading stiffness of contact that "
            "yields: c-law, fortran-law, javascript-law, modelica-law, an FMU and rows have them"
        )
    else:
        arguments |= _stiffness_before_slip(joint, notes)
        arguments |= _heat_of_code(joint, target, units, heat, notes)
    return {**arguments, "notes": tuple(notes)}


def _stiffness_before_slip(joint: ExportedJoint, notes: list[str]) -> dict[str, Any]:
    """The ratio of stiffnesses of a law as code, or a note that it is left out."""
    if joint.kappa_varies:
        notes.append(
            "without tangential stiffness, whose ratio varies with the area: rows have it"
        )
        return {}
    try:
        return {"kappa": float(joint.kappa(None))}
    except InputError as fault:
        # of bodies without Poisson's ratio, and of a lay without a direction
        notes.append(f"without tangential stiffness: {fault}")
        return {}


def _heat_of_code(
    joint: ExportedJoint,
    target: str,
    units: Mapping[str, str],
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
    if heat is None and joint.conductivity is None and not alone:
        notes.append("without conductance: the bodies have no thermal conductivity")
        return {}
    conductivity, unit = _conductivity(joint, units)
    return conductivity | {"gas": GasInGaps(joint.gas, unit)}


def _is_infinite(hardness: float | str) -> bool:
    return not isinstance(hardness, str) and math.isinf(hardness)
