"""Tables of designs: a joint in each row, its numbers by column, and every quantity beside them."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import itertools
import os
import pathlib
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from mbma_tables.bodies.bodies import Bodies, names_metals
from mbma_tables.bodies.materials import Metal
from mbma_tables.common.arguments import FloatArray, nearest, whole_number_in
from mbma_tables.common.distributions import (
    MEASURED,
    Distribution,
    distribution_of,
)
from mbma_tables.common.errors import InputError, MbmaError
from mbma_tables.common.progress import doing, shown
from mbma_tables.common.toml_files import set_entry, value_of
from mbma_tables.common.units import (
    DIMENSIONS,
    RANGE,
    SIZES,
    Units,
    known,
    read,
    unit_of,
)
from mbma_tables.common.workers import crew
from mbma_tables.contacts.quantities import registry
from mbma_tables.contacts.quantities.interface import Gas
from mbma_tables.contacts.quantities.leakage import SEAL, Leakage, stress_of
from mbma_tables.contacts.result import Contact
from mbma_tables.design.joint import FACES, PLAIN_STRESS, Joint
from mbma_tables.design.row_files import (
    Chunk,
    Rows,
    RowSource,
    csv_lines,
    is_csv,
    open_writer,
    opened,
    require_writable,
)
from mbma_tables.design.uncertainty import MOST_DRAWS, Uncertainty, uncertainty_of
from mbma_tables.surfaces.surface import Surface

# arguments whose cells are no numbers
NAMES = ("bodies", "metals", "gas", "name", "theory", "direction", "process", "unit")
REASON = "reason"
VALID = "valid"
ENDS = ("_low", "_high")  # of the columns of quantiles
# units of arguments that are neither lengths nor stresses
OTHER_UNITS = {
    "force": "N",
    "conductivity": "W/(m K)",
    "temperature": "K",
    "viscosity": "Pa s",
}
# whose plain numbers are in pascals
IN_PASCALS = ("gas.pressure", "seal.inlet", "seal.outlet")
MOST_WORKERS = 256
# of a row in which something is missing
EMPTY = "{name} is empty"


def _arguments(of: Callable[..., Any]) -> list[str]:
    return [name for name in inspect.signature(of).parameters if name != "self"]


def known_columns() -> list[str]:
    """Names of columns: the arguments of `Joint` as in its files, and what is given in `Joint.at`."""
    of_joint = [each.name for each in dataclasses.fields(Joint) if each.init]
    names = [name for name in of_joint if name not in FACES]
    of_face = dict.fromkeys((*_arguments(Surface.from_roughness), *_arguments(Surface)))
    for left_out in ("nominal_area", "provenance", "fit"):
        of_face.pop(left_out, None)
    names += [f"{face}.{name}" for face in FACES for name in of_face if name != "unit"]
    names += [f"bodies.{each.name}" for each in dataclasses.fields(Bodies)]
    names += [f"bodies.{name}" for name in _arguments(Metal) if name not in vars(Bodies)]
    names += [f"gas.{each.name}" for each in dataclasses.fields(Gas)]
    of_seal = [*_arguments(Leakage.liquid), *_arguments(Leakage.gas)]
    names += [f"seal.{name}" for name in of_seal]
    return [*dict.fromkeys(names), *_arguments(Joint.at), "force"]


def loads() -> list[str]:
    """Names of the columns of which one is needed."""
    return [*_arguments(Joint.at), "force"]


def _without_index(name: str) -> str:
    """The name of an argument that is one of each body: "bodies" of "bodies.0"."""
    return re.sub(r"\.[01]$", "", name)


@dataclasses.dataclass(frozen=True)
class Column:
    """A column of numbers, or of names."""

    name: str
    unit: str  # of its header

    @property
    def argument(self) -> str:
        """The argument's own name."""
        name = _without_index(self.name).rpartition(".")[2]
        return "gas_pressure" if self.name == "gas.pressure" else name

    @property
    def is_name(self) -> bool:
        """Whether cells are names, not numbers."""
        return self.argument in NAMES

    @property
    def needs_unit(self) -> bool:
        """Whether its numbers have no meaning without a unit."""
        return any(DIMENSIONS.get(self.argument, ())) or self.argument in OTHER_UNITS

    @property
    def is_length(self) -> bool:
        """Whether its unit is a power of a length."""
        return bool(DIMENSIONS.get(self.argument, (0, 0))[0])

    def factor_to(self, units: Units) -> float:
        """What numbers of the column are multiplied with, in these units.

        Raises
        ------
        InputError
            For a unit that the argument does not have.
        """
        if not self.unit:
            return 1.0
        if self.argument == "force":
            return float(SIZES["force"][known(self.unit, "force")])
        if self.argument == "conductivity":
            units.conductivities(f"1 {self.unit}")
            return 1.0
        if self.argument == "temperature" and self.unit == "K":
            return 1.0
        if self.argument == "viscosity":
            # in the unit of stress that results have, times seconds
            return float(units.number("viscosity", stress_of(f"1 {self.unit}")))
        if self.name in IN_PASCALS:
            units = Units(stress="Pa")
        return float(units.number(self.argument, f"1 {self.unit}"))

    def numbers(
        self, cells: Any, units: Units, ranges: dict[int, Any] | None = None
    ) -> tuple[FloatArray, dict[int, str]]:
        """Numbers in these units, NaN where there are none, and why.

        Ranges are entered in `ranges`, by row as they would be typed; without it they are
        faults.
        """
        is_plain = self.needs_unit and not self.unit
        try:
            given = cells if isinstance(cells, np.ndarray) else list(map(float, cells))
            numbers = np.asarray(given, dtype=float)
        except ValueError:
            numbers = np.full(len(cells), np.nan)
        if np.isfinite(numbers).all() and not is_plain:
            return numbers * self.factor_to(units), {}
        texts = cells
        if isinstance(cells, np.ndarray):
            texts = ["" if cell != cell else repr(cell) for cell in cells.tolist()]
        return self._cell_by_cell(texts, units, ranges)

    def range_of(self, cell: Any) -> Distribution | None:
        """The distribution in a cell; None of other cells.

        Raises
        ------
        InputError
            For a range that is upside down or none, and one without a unit.
        """
        if not isinstance(cell, str) or not (RANGE.search(cell) or MEASURED in cell):
            return None
        found = distribution_of(self.argument, value_of(cell))
        if found is not None and bool(found.unit) == bool(self.unit) and self.needs_unit:
            fault = "has a unit beside that of its header" if self.unit else "has no unit"
            raise InputError(f"{self.name} = {cell!r} {fault}: write it once")
        return found

    def typed(self, found: Distribution) -> Any:
        """What is typed for a distribution in a cell: with the unit of the header, but of a temperature."""
        if not self.unit or self.argument == "temperature":
            return value_of(found.text) if found.kind == MEASURED else found.text
        return found.retyped(1.0, self.unit)

    def _cell_by_cell(
        self, cells: Sequence[str], units: Units, ranges: dict[int, Any] | None
    ) -> tuple[FloatArray, dict[int, str]]:
        numbers = np.full(len(cells), np.nan)
        faults = {}
        factor = self.factor_to(units)
        for k, cell in enumerate(cells):
            try:
                found = None if ranges is None else self.range_of(cell)
                if ranges is not None and found is not None:
                    ranges[k] = self.typed(found)
                else:
                    numbers[k] = self._number(cell, units, factor)
            except InputError as fault:
                text = str(fault)
                said = text if self.argument in text else f"{self.name}: {text}"
                faults[k] = said
        return numbers, faults

    def _number(self, cell: str, units: Units, factor: float) -> float:
        """The number of a cell, which has a unit of its own only if the header has none."""
        if not cell.strip():
            raise InputError(EMPTY.format(name=self.name))
        try:
            number = float(cell)
        except ValueError:
            pass
        else:
            if not np.isfinite(number):
                raise InputError(f"{self.name} must be finite, got {cell!r}")
            if self.needs_unit and not self.unit:
                sample = OTHER_UNITS.get(self.argument) or unit_of(self.argument, units)
                raise InputError(
                    f"{self.name} = {cell!r} has no unit: write it in the header, "
                    f"'{self.name} [{sample}]'"
                )
            return number * factor
        if self.range_of(cell) is not None:
            raise InputError(
                f"{self.name} = {cell!r} is a range, and a row has one number: quantiles "
                "are those of --draws, as in draws=2000"
            )
        if self.unit:
            raise InputError(
                f"{self.name} = {cell!r} is no number; its unit is in the header, {self.unit}"
            )
        if self.argument in OTHER_UNITS:
            raise InputError(f"{self.name} = {cell!r}: write the unit in the header")
        if self.name in IN_PASCALS:
            units = Units(stress="Pa")
        return float(units.number(self.argument, cell))


class Draws(NamedTuple):
    """Draws of numbers that are ranges, for each row."""

    of_each_row: int
    seed: int
    quantities: Sequence[str] | None  # that were asked for


@dataclasses.dataclass(frozen=True)
class Designs:
    """The columns of a table of designs, and what all rows have in common."""

    columns: tuple[Column, ...]
    common: Mapping[str, Any]  # entries as those of a file of a joint, with the load
    units: Units  # of all numbers: lengths and stresses
    path: pathlib.Path = pathlib.Path("joint")  # of the file of common entries
    draws: Draws | None = None  # where cells may be ranges

    def require_load(self) -> str:
        """The name of what is given, a pressure, a gap, an area or a force; an error for none and several."""
        names = [column.name for column in self.columns] + list(self.common)
        given = [name for name in loads() if name in names]
        if len(given) != 1:
            got = " and ".join(given) or "none"
            raise InputError(f"one of {', '.join(loads())} is needed, got {got}")
        return given[0]

    def joint(self, numbers: Mapping[str, Any]) -> tuple[Joint, dict[str, Any]]:
        """The joint of some rows, whose columns are arrays or one number each, and its load."""
        entries = dict(self.common)
        for name in (*FACES, "bodies", "gas", "seal"):
            if isinstance(entries.get(name), Mapping):
                entries[name] = dict(entries[name])
        for column in self.columns:
            if not column.is_name:
                value = numbers[column.name]
                if column.argument == "conductivity" and not is_typed(value):
                    value = _conductivity(column, value)
                set_entry(entries, column.name, value)
        entries = {name: _listed(entry) for name, entry in entries.items()}
        entries["bodies"] = _in_unit_of_results(entries.get("bodies"))
        load = self.require_load()
        given = {load: entries.pop(load)}
        for face in FACES:
            if isinstance(entries.get(face), Mapping):
                entries[face] = {**entries[face], "unit": self.units.length}
        joint = Joint.from_entries(entries, self.path)
        if "force" in given:
            return joint, {"pressure": _pressure(joint, given["force"])}
        return joint, given


def _in_unit_of_results(bodies: Any) -> Any:
    """Bodies whose modulus, if it is a text, is in the unit of all plain stresses of a joint."""
    if isinstance(bodies, dict) and isinstance(bodies.get("E_star"), str):
        return bodies | {"E_star": _in_unit_of_results(bodies["E_star"])}
    if not isinstance(bodies, str) or names_metals(bodies):
        return bodies
    number = Units(stress=PLAIN_STRESS).number("E_star", bodies)
    return f"{number!r} {PLAIN_STRESS}"


def is_typed(value: Any) -> bool:
    """Whether a number of a row is as it was typed, with its unit."""
    return isinstance(value, str | Mapping)


def _conductivity(column: Column, value: Any) -> Any:
    """Conductivities with their unit; of both bodies where the column has no index."""
    texts: Any = f"{value!r} {column.unit}"
    if np.ndim(value):
        texts = [f"{each!r} {column.unit}" for each in value.tolist()]
    return texts if column.name != "bodies.conductivity" else (texts, texts)


def _pressure(joint: Joint, force: Any) -> Any:
    if np.ndim(force):
        return [joint.pressure_of(each) for each in force.tolist()]
    return joint.pressure_of(force)


def _listed(entry: Any) -> Any:
    """An entry of both bodies by their index as a list."""
    if not isinstance(entry, dict):
        return entry
    if entry.keys() == {"0", "1"}:
        return [entry["0"], entry["1"]]
    return {name: _listed(each) for name, each in entry.items()}


@dataclasses.dataclass
class Answers:
    """Quantities of the rows of a chunk, NaN where there are none, and why."""

    values: dict[str, FloatArray]
    units: dict[str, str]
    valid: list[str]
    reasons: list[str]

    @classmethod
    def empty(
        cls, names: Sequence[str], rows: int, units: dict[str, str], ends: bool = False
    ) -> Answers:
        """Of rows that are not computed yet, perhaps with both ends of bands; units are shared by all chunks."""
        if ends:
            names = [f"{name}{end}" for name in names for end in ("", *ENDS)]
        values = {name: np.full(rows, np.nan) for name in names}
        return cls(values, units, [""] * rows, [""] * rows)

    def put(self, rows: FloatArray, pressed: Contact) -> None:
        """Enter the quantities of a contact of some rows."""
        for name, column in self.values.items():
            declared = registry.get(name)
            if not declared.is_available(pressed):
                continue
            unit = declared.unit(pressed)
            if self.units.setdefault(name, unit) != unit:
                raise InputError(
                    f"{name} is in {unit}, and in {self.units[name]} in rows before"
                )
            column[rows] = pressed.quantity(name)
        judged = pressed.judged(self.values)
        valid = np.broadcast_to(judged.valid, rows.shape)
        for row, is_valid in zip(rows.tolist(), valid.tolist(), strict=True):
            self.valid[row] = "yes" if is_valid else "no"
        for reason, mask in judged.reasons.items():
            for row in rows[np.broadcast_to(mask, rows.shape)].tolist():
                earlier = self.reasons[row]
                self.reasons[row] = f"{earlier}; {reason}" if earlier else reason

    def put_quantiles(self, row: int, found: Uncertainty) -> None:
        """Enter medians and quantiles of a row."""
        for name, (low, median, high) in found.quantiles.items():
            if name not in self.values:
                continue
            if self.units.setdefault(name, found.units[name]) != found.units[name]:
                raise InputError(
                    f"{name} is in {found.units[name]}, and in {self.units[name]} in rows before"
                )
            for end, numbers in zip(("", *ENDS), (median, low, high), strict=True):
                self.values[f"{name}{end}"][row] = numbers[0]
        self.valid[row] = "yes" if found.valid.all() else "no"
        self.reasons[row] = "; ".join(found.reasons)


def _solve_draws(
    designs: Designs,
    numbers: Mapping[str, Any],
    typed: Mapping[int, Mapping[str, Any]],
    rows: Any,
    answers: Answers,
) -> None:
    """Compute rows one after the other, each with quantiles of what is not known."""
    assert designs.draws is not None
    for row in rows.tolist():
        some: dict[str, Any] = {
            name: column[row].item() for name, column in numbers.items()
        }
        try:
            joint, given = designs.joint(some | dict(typed.get(row, {})))
            found = uncertainty_of(
                joint.description,
                given["pressure"],
                draws=designs.draws.of_each_row,
                quantities=designs.draws.quantities,
                seed=designs.draws.seed,
                may_be_known=True,
            )
            answers.put_quantiles(row, found)
        except MbmaError as fault:
            answers.reasons[row] = str(fault)
            answers.valid[row] = ""


def _solve(
    designs: Designs, numbers: Mapping[str, Any], rows: Any, answers: Answers
) -> None:
    """Compute rows as one batch; those that refuse it are found and named."""
    if rows.size == 0:
        return
    is_one = rows.size == 1
    some = {
        name: column[rows[0]].item() if is_one else column[rows]
        for name, column in numbers.items()
    }
    try:
        joint, given = designs.joint(some)
        joint.require_known("a row")
        answers.put(rows, joint.at(**given))
    except MbmaError as fault:
        if is_one:
            answers.reasons[rows[0]] = str(fault)
            answers.valid[rows[0]] = ""
            return
        bad = np.asarray(getattr(fault, "mask", None))
        if bad.shape != rows.shape or not bad.any():
            bad = np.zeros(rows.shape, bool)
            bad[: rows.size // 2] = True
            _solve(designs, numbers, rows[bad], answers)
        else:
            for row in rows[bad]:
                _solve(designs, numbers, np.array([row]), answers)
        _solve(designs, numbers, rows[~bad], answers)


def answered(
    designs: Designs, chunk: Chunk, names: Sequence[str], units: dict[str, str]
) -> tuple[Answers, dict[str, FloatArray]]:
    """Quantities of a chunk of rows, and its numbers by column."""
    answers = Answers.empty(names, chunk.rows, units, designs.draws is not None)
    faults = dict(chunk.faults)
    typed: dict[int, dict[str, Any]] = {}
    numbers: dict[str, FloatArray] = {}
    texts: list[Column] = []
    for column in designs.columns:
        cells = chunk.columns[column.name]
        if column.is_name:
            texts.append(column)
            missing = [k for k, cell in enumerate(cells) if not str(cell).strip()]
            new = dict.fromkeys(missing, EMPTY.format(name=column.name))
        else:
            of_column: dict[int, Any] | None = None if designs.draws is None else {}
            numbers[column.name], new = column.numbers(cells, designs.units, of_column)
            for row, entry in (of_column or {}).items():
                typed.setdefault(row, {})[column.name] = entry
        for row, fault in new.items():
            faults[row] = f"{faults[row]}; {fault}" if row in faults else fault
    for row, fault in faults.items():
        answers.reasons[row] = fault
    groups: dict[tuple[str, ...], list[int]] = {}
    sound = [row for row in range(chunk.rows) if row not in faults]
    if not texts:
        groups[()] = sound
    for row in sound if texts else ():
        key = tuple(chunk.columns[column.name][row].strip() for column in texts)
        groups.setdefault(key, []).append(row)
    for key, members in groups.items():
        given = {c.name: _name_of(cell) for c, cell in zip(texts, key, strict=True)}
        common = _with(designs.common, given)
        own = dataclasses.replace(designs, common=common)
        if designs.draws is None:
            _solve(own, numbers, np.array(members), answers)
        else:
            _solve_draws(own, numbers, typed, np.array(members), answers)
    return answers, numbers


def _name_of(cell: str) -> Any:
    """A name as it is, which may look like a number ("1.4301"); a list as TOML has it."""
    value = value_of(cell)
    return value if isinstance(value, list | dict) else cell


def _with(common: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Common entries with the names of a group of rows."""
    entries = {
        name: dict(entry) if isinstance(entry, Mapping) else entry
        for name, entry in common.items()
    }
    for name, value in given.items():
        set_entry(entries, name, value)
    return entries


def designs_of(
    source: RowSource,
    common: Mapping[str, Any],
    keep: Sequence[str] = (),
    path: pathlib.Path = pathlib.Path("joint"),
) -> Designs:
    """The columns of a source as arguments; unknown ones are refused, but for those to keep."""
    arguments = known_columns()
    columns = []
    for name, unit in source.units.items():
        if name in keep:
            continue
        if _without_index(name) not in arguments:
            raise InputError(
                f"column {source.headers[name]!r} is no argument: {nearest(name, arguments)}; "
                "columns that are none are named by --keep"
            )
        columns.append(Column(name, unit))
    for name in keep:
        if name not in source.units:
            raise InputError(f"no column is named {name!r}, of those to keep")
    entries = _with(common, {})
    for column in columns:
        if column.unit and column.is_name:
            raise InputError(
                f"column {column.name!r} has names, and no unit {column.unit!r}"
            )
        try:
            column.factor_to(Units("um", PLAIN_STRESS))
        except InputError as fault:
            header = source.headers[column.name]
            raise InputError(f"column {header!r}: {fault}") from None
        # refuses both a name and numbers of one argument, "bodies" and "bodies.hardness"
        set_entry(entries, column.name, 1.0)
    lengths = [column for column in columns if column.is_length and column.unit]
    length = read(lengths[0].argument, f"1 {lengths[0].unit}")[1] if lengths else "um"
    units = Units(length, PLAIN_STRESS)
    designs = Designs(tuple(columns), common, units, path)
    designs.require_load()
    return designs


def asked_by_default(designs: Designs) -> list[str]:
    """Quantities that sensitivities have; the leak rate where rows have a seal."""
    given = [*designs.common, *(column.name for column in designs.columns)]
    has_seal = any(name.partition(".")[0] == SEAL.name for name in given)
    return [
        name
        for name in registry.results()
        if has_seal or SEAL not in registry.needs_of(name)
    ]


def names_of_results(load: str, quantities: Sequence[str]) -> list[str]:
    """Quantities of the answers and their model uncertainties: those asked for, or those that sensitivities have."""
    names = [name for name in dict.fromkeys(quantities) if name != load]
    stated = [registry.get(name).uncertainty for name in names]
    names += [name for name in stated if name is not None]
    return [name for name in dict.fromkeys(names) if name != VALID]


def names_of_medians(load: str, quantities: Sequence[str]) -> list[str]:
    """Quantities of which rows have medians and quantiles: those asked for, or those with a model uncertainty."""
    if load not in ("pressure", "force"):
        raise InputError(f"draws are of joints at a pressure or a force, got {load}")
    for name in quantities:
        registry.get(name)
    return [name for name in dict.fromkeys(quantities) if name not in (load, "pressure")]


@dataclasses.dataclass(frozen=True)
class Summary:
    """How many rows a table had, and how many of them have no answer or one that is not valid."""

    rows: int
    refused: int
    not_valid: int


def batch(
    designs: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    common: Mapping[str, Any] | None = None,
    quantities: Sequence[str] | None = None,
    keep: Sequence[str] = (),
    path: str | os.PathLike[str] = "joint",
    workers: int = 1,
    draws: int | None = None,
    seed: int = 0,
) -> Summary:
    r"""Compute a joint for each row of a table, and write the rows with every quantity beside them.

    Parameters
    ----------
    designs : path-like
        A file .csv, .parquet or .nc (variables of one dimension). Columns are named as the
        arguments of `Joint` in its files, with their unit: "part_a.Ra [um]",
        "part_a.hurst", "nominal_area [cm^2]", "bodies.hardness [GPa]", "bodies.0",
        "pressure [MPa]"; "part_a.h_rms [um]" with the other numbers of `Surface` in place
        of roughness parameters. Cells may have units of their own, "0.4 um", in columns
        without one. A column "pressure", "force", or another load is needed.
    out : path-like
        The file to write, of any of these kinds.
    common : mapping, optional
        Entries that all rows have, as those of a file of a joint, also a load.
    quantities : sequence of str, optional
        Default: those with a model uncertainty. Their model uncertainties are beside them.
    keep : sequence of str
        Columns that are no arguments, to be written as they are.
    path : path-like
        File of the common entries, for paths of maps.
    draws : int, optional
        Of numbers that are ranges, in cells or in common entries, "0.3..0.5 um", "0.4 um +-
        10%": rows then have the median of each quantity and, in columns that end with
        "_low" and "_high", its quantiles 5% and 95%, of inputs and model, as of
        `Joint.uncertainty`. Without it a range is refused.
    seed : int
        Of the draws.
    workers : int
        Processes that compute rows; their order and numbers do not depend on it. A script
        that asks for more than one needs ``if __name__ == "__main__":`` around its calls.

    Returns
    -------
    Summary

    Raises
    ------
    InputError
        For unknown columns, with the nearest name, columns that are there twice, units
        that an argument does not have, and files that are no tables. Rows that are
        refused stay in the table, without quantities: their column "reason" says why,
        and that of answers that are not valid says why not.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from mbma_tables.design.batch import batch
    >>> face = {"hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
    >>> common = {"bodies": "steel 1020", "nominal_area": "4 cm^2", "part_a": face}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     table = pathlib.Path(folder, "designs.csv")
    ...     _ = table.write_text("part_a.Ra [um],pressure [MPa]\n0.4,10\n-1,10\n")
    ...     found = batch(table, table.with_name("answers.csv"), common=common)
    ...     lines = table.with_name("answers.csv").read_text().splitlines()
    >>> found
    Summary(rows=2, refused=1, not_valid=0)
    >>> lines[2].rpartition('"part_a: ')[2]
    'Ra must be positive, got -1"'
    """
    target = pathlib.Path(out)
    require_writable(target)
    whole_number_in("workers", workers, 1, MOST_WORKERS)
    with opened(pathlib.Path(designs)) as source, shown("rows"):
        table = designs_of(source, common or {}, keep, pathlib.Path(path))
        load = table.require_load()
        asked = asked_by_default(table) if quantities is None else list(quantities)
        if draws is None:
            names = names_of_results(load, asked)
        else:
            whole_number_in("draws", draws, 100, MOST_DRAWS)
            names = names_of_medians(load, asked)
            drawn = Draws(draws, seed, quantities)
            table = dataclasses.replace(table, draws=drawn)
        clashes = [name for name in source.units if name in (*names, VALID, REASON)]
        if clashes:
            listed = ", ".join(clashes)
            raise InputError(f"columns are named as those of answers: {listed}")
        return _written(source, table, names, target, workers)


def _computed(
    designs: Designs,
    names: Sequence[str],
    units: Mapping[str, str],
    as_text: bool,
    chunk: Chunk,
) -> tuple[Rows, Summary, float]:
    """The rows of a chunk as they are written, how many, and the share of the table up to its end."""
    of_names = {name: units[name] for name in names}
    found = answered(designs, chunk, names, of_names)
    return _as_written(designs, units, as_text, chunk, *found)


def _as_written(
    designs: Designs,
    units: Mapping[str, str],
    as_text: bool,
    chunk: Chunk,
    answers: Answers,
    numbers: Mapping[str, FloatArray],
) -> tuple[Rows, Summary, float]:
    """A chunk with its answers; `units` has all columns in their order, rows of text are lines of CSV."""
    columns = dict(chunk.columns)
    if not as_text:
        columns |= {
            name: each / _factor(designs, name)
            for name, each in numbers.items()
            if designs.draws is None or isinstance(columns[name], np.ndarray)
        }
    columns |= answers.values
    columns |= {VALID: answers.valid, REASON: answers.reasons}
    rows = csv_lines(columns, list(units)) if as_text else columns
    counts = Summary(chunk.rows, answers.valid.count(""), answers.valid.count("no"))
    return rows, counts, chunk.done


def _written(
    source: RowSource,
    designs: Designs,
    names: Sequence[str],
    target: pathlib.Path,
    workers: int,
) -> Summary:
    """Compute and write chunk by chunk; quantities have the units of the first one."""
    first = next(source.chunks, None)
    if first is None:
        raise InputError("the table has no rows")
    of_first: dict[str, str] = {}
    answers, numbers = answered(designs, first, names, of_first)
    units = dict(source.units)
    ends = ("",) if designs.draws is None else ("", *ENDS)
    for name in names:
        unit = of_first.get(name) or registry.get(name).unit_in(designs.units)
        units |= {f"{name}{end}": unit for end in ends}
    units |= dict.fromkeys((VALID, REASON), "")
    as_text = is_csv(target)
    task = functools.partial(_computed, designs, names, units, as_text)
    written = _as_written(designs, units, as_text, first, answers, numbers)

    rows = refused = not_valid = 0
    with open_writer(target, units) as write, crew(workers) as run:
        others = run(task, ((chunk,) for chunk in source.chunks))
        for lines, counts, share in itertools.chain([written], others):
            write(lines)
            rows += counts.rows
            refused += counts.refused
            not_valid += counts.not_valid
            doing(f"{rows:,} rows, {share:.0%} of the table", share)
    return Summary(rows, refused, not_valid)


def _factor(designs: Designs, name: str) -> float:
    """That of a column from its own unit to those of the designs."""
    column = next(each for each in designs.columns if each.name == name)
    return column.factor_to(designs.units)
