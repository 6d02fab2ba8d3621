"""A joint written for other programs: each target with the files that belong to it, in any units."""

from __future__ import annotations

import math
import pathlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from mbma_tables import __version__
from mbma_tables.common.arguments import nearest
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import factor
from mbma_tables.export.exported_law import GasInGaps
from mbma_tables.export.languages import LANGUAGES
from mbma_tables.export.law_rows import describe_law
from mbma_tables.export.targets import Target, targets
from mbma_tables.quantities.gas import VACUUM
from mbma_tables.quantities.interface import Gas
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


def joint_files(
    joint: ExportedJoint,
    target: str,
    *,
    out: pathlib.Path | None = None,
    pressures: Any = None,
    name: str | None = None,
    heat: bool = True,
    friction_pressure: float | str | None = None,
    quantity: str | Sequence[str] | None = None,
    length_unit: str | None = None,
    stress_unit: str | None = None,
    made_by: tuple[str, ...] = (),
    **options: Any,
) -> Mapping[str, bytes]:
    """The files of a target by the ends of their names, as `Joint.export` describes them.

    Options of some targets alone, such as `rows` or `leakage`, are refused by name where
    others get them.
    """
    program = _target_of_laws(target)
    units = _units(program, length_unit, stress_unit)
    given = {key: value for key, value in options.items() if value not in (None, False)}
    _refuse(target, [key for key in given if key not in program.takes])
    shared = {"theory": joint.theory, "hardness": joint.hardness, **units, **given}
    made_by = made_by or (
        f"written from Python by mbma_tables {__version__}: a joint for {target}",
    )
    if name is not None and "name" not in program.takes and not program.end:
        # the format has no place for it but the comments
        made_by = (f"name: {name}", *made_by)
    named = (
        {"name": name}
        if name is not None and ("name" in program.takes or program.end)
        else {}
    )
    if program.end:
        # what belongs together is found by the file's name
        if out is not None and out.suffix != program.end:
            raise InputError(
                f"the path of {target} must be NAME{program.end}, got {out.name!r}"
            )
        if out is not None and name not in (None, out.stem):
            raise InputError(
                f"{target} is called by the name of its file, {out.stem!r}: leave name out, got {name!r}"
            )
        named = {"name": name or ("joint" if out is None else out.stem)}
    if out is None and not program.alone:
        raise InputError(
            f"{target} is several files, of which the first needs the others: give path"
        )
    shared["made_by"] = made_by
    if not program.rows:
        _refuse(
            target,
            [
                key
                for key, value in {"pressures": pressures, "quantity": quantity}.items()
                if value
            ],
        )
        _refuse(target, ["friction_pressure"] if friction_pressure is not None else [])
        language = LANGUAGES.get(target)
        if language and language.frictionless and joint.friction is not None:
            note = f"the joint's friction, {joint.friction:g}, is left out: the faces slide freely"
            shared["made_by"] = (note, *made_by)
        return program.files(
            joint.surface,
            joint.E_star,
            **_of_code(joint, target, units, heat),
            **shared,
            **named,
        )
    wanted = (
        [quantity]
        if isinstance(quantity, str)
        else list(quantity or [_usual(program, heat)])
    )
    if len(wanted) > 1 and not program.several:
        raise InputError(f"{target} has one quantity a file: give one of {wanted}")
    if pressures is None and wanted != ["film"]:
        raise InputError(
            f"{target} needs pressures, the smallest and the largest, such as ('1 MPa', '50 MPa')"
        )
    if pressures is not None:
        shared["pressures"] = pressures
    rubbed = joint.friction is not None and "friction" in program.takes
    if rubbed:
        shared |= {"friction": joint.friction, "friction_pressure": friction_pressure}
    elif friction_pressure is not None:
        _refuse(target, ["friction_pressure"])
    laws = [_rows(joint, program, one, units, shared, rubbed) for one in wanted]
    return program.files(laws[0] if len(laws) == 1 else laws, **named)


def _target_of_laws(target: str) -> Target:
    """The target of this name, unless it is the whole model."""
    of_laws = {
        key: each for key, each in targets().items() if each.rows or "kappa" in each.takes
    }
    if target not in of_laws:
        raise InputError(
            f"no target of laws is called {target!r}: {nearest(target, of_laws)}"
        )
    return of_laws[target]


def _units(program: Target, length: str | None, stress: str | None) -> dict[str, str]:
    """Units of length and stress: those asked for, those that the program prescribes, or mm and MPa."""
    prescribed = program.units or (length or "mm", stress or "MPa")
    asked = (length or prescribed[0], stress or prescribed[1])
    if asked != prescribed:
        raise InputError(
            f"{program.name} is written in {' and '.join(prescribed)}, got {' and '.join(asked)}"
        )
    return {"length_unit": asked[0], "stress_unit": asked[1]}


def _refuse(target: str, names: list[str]) -> None:
    if names:
        raise InputError(f"without effect on {target}: leave {' and '.join(names)} out")


def _usual(program: Target, heat: bool) -> str:
    """The quantity of rows where none is asked for: conductance, or what the program takes."""
    if heat and "conductance" in program.quantities:
        return "conductance"
    return program.quantity


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
    units: Mapping[str, str],
    shared: Mapping[str, Any],
    rubbed: bool,
) -> Any:
    """Rows of one quantity."""
    asked = dict(shared)
    if program.most:
        asked["most_rows"] = program.most.get(quantity)
    if quantity == "conductance":
        heat, unit = _conductivity(joint, units)
        asked |= heat
        gas = GasInGaps(joint.gas, unit)
        if program.conducts_gas:
            asked["gas"] = gas
    if rubbed or quantity == "tangential_stiffness":
        asked["kappa"] = joint.kappa
    return describe_law(joint.surface, joint.E_star, quantity=quantity, **asked)


def _of_code(
    joint: ExportedJoint, target: str, units: Mapping[str, str], heat: bool
) -> dict[str, Any]:
    """Arguments of a law as code: the stiffness before slip, and with `heat` conductance, as far as it has them."""
    language = LANGUAGES.get(target)
    if language and not language.unloads and not _is_infinite(joint.hardness):
        note = (
            "without conductance and tangential stiffness, which follow the unloading stiffness of contact that "
            "yields: c-law, fortran-law, javascript-law, modelica-law, an FMU and rows have them"
        )
        return {"notes": (note,)}
    arguments: dict[str, Any] = {}
    if joint.kappa_varies:
        arguments["notes"] = (
            "without tangential stiffness, whose ratio varies with the area: rows have it",
        )
    else:
        arguments["kappa"] = float(joint.kappa(None))
    if heat:
        if language and language.subroutine and joint.gas.name != VACUUM:
            raise InputError(
                f"{target} has the conductance of the solid spots alone, without that of {joint.gas.name} in the gaps: "
                "take rows, which have both, such as target 'abaqus' or 'calculix', or a joint with gas='vacuum'; "
                "heat=False leaves conductance out"
            )
        conductivity, unit = _conductivity(joint, units)
        arguments |= conductivity
        arguments["gas"] = GasInGaps(joint.gas, unit)
    return arguments


def _is_infinite(hardness: float | str) -> bool:
    return not isinstance(hardness, str) and math.isinf(hardness)
