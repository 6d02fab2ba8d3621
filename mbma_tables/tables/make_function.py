"""Make a table of any function of 1 to 6 numbers: grown in pieces, certified, written whole.

Pieces of the range are made one by one and kept in a folder beside the table, so that a run
that ends early goes on where it was, and parts can be made on several machines. The table
does not depend on who made which piece, nor on the number of processes.
"""

from __future__ import annotations

import dataclasses
import functools
import importlib
import inspect
import io
import json
import math
import os
import pathlib
import shutil
import sys
import time
import zipfile
from collections.abc import Callable, Iterator, Mapping
from typing import Any, cast

import numpy as np

from mbma_tables.common.arguments import FloatArray, nearest
from mbma_tables.common.errors import InputError, TableFileError, UncertifiedError
from mbma_tables.common.files import write_file
from mbma_tables.common.netcdf import write_own
from mbma_tables.common.toml_files import check, read_toml
from mbma_tables.common.workers import Crew, crew, share_of
from mbma_tables.tables.boxes import (
    MOST_HALVINGS,
    PENDING,
    POLYNOMIAL,
    Aim,
    Box,
    Piece,
    UnsmoothError,
    middle_of,
)
from mbma_tables.tables.function_table import (
    FORMAT,
    KIND,
    FunctionAxis,
    FunctionOutput,
    FunctionTable,
    checked,
    read_function_table,
)
from mbma_tables.tables.members import RULES, Members
from mbma_tables.tables.sources import versions

HERE = pathlib.Path(__file__).parent
SCHEMA = json.loads((HERE / "function.schema.json").read_text(encoding="utf-8"))
DEFAULTS: dict[str, Any] = {
    "target": 1e-6,
    "vectorized": True,
    "seed": 1,
    "certificate_points": 20_000,
    "max_coefficients": 4_000_000,
    "pieces": 16,
    "chunk": 256,
    "on_failure": "stop",
    "title": "",
    "licence": "",
    "source": "",
}
SAVED_EVERY = 5.0  # s, between two states of a piece that is not finished
JOBS_AHEAD = 4  # jobs a worker between two looks at the clock
ERROR_BLOCK = 1 << 14  # random points at a time


@dataclasses.dataclass(frozen=True)
class Wanted:
    """What a table of a function is to cover, and how accurately."""

    function: str  # module:function
    target: float
    vectorized: bool
    seed: int
    certificate_points: int
    max_coefficients: int
    pieces: int
    chunk: int
    on_failure: str
    title: str
    licence: str
    source: str
    axes: tuple[FunctionAxis, ...]
    outputs: tuple[FunctionOutput, ...]
    members: Members | None = None

    @property
    def stored(self) -> tuple[FunctionOutput, ...]:
        """Outputs of the table's value and of the members that are stored beside it."""
        beside = 0 if self.members is None else len(self.members.stored)
        return self.outputs * (1 + beside)

    @property
    def as_json(self) -> str:
        """All of it as text."""
        return json.dumps(dataclasses.asdict(self), sort_keys=True)

    @classmethod
    def from_json(cls, text: str) -> Wanted:
        """Inverse of `as_json`."""
        entries = json.loads(text)
        entries["axes"] = tuple(FunctionAxis(**axis) for axis in entries["axes"])
        entries["outputs"] = tuple(
            FunctionOutput(**output) for output in entries["outputs"]
        )
        if entries.get("members") is not None:
            entries["members"] = Members.from_json(entries["members"])
        return cls(**entries)

    @property
    def aim(self) -> Aim:
        """What its pieces aim at."""
        return Aim(
            np.full(len(self.stored), self.target),
            np.array([output.error == "relative" for output in self.stored]),
            np.array([output.least for output in self.stored]),
            np.array([output.transform == "log" for output in self.stored]),
        )


def example() -> str:
    """A configuration with every key and what it means, as TOML."""
    return (HERE / "function.toml").read_text(encoding="utf-8")


def function_of(reference: str) -> Callable[..., Any]:
    """The function that ``module:function`` names; modules of the current folder are found too."""
    module_name, colon, name = reference.partition(":")
    if not (module_name and colon and name):
        raise InputError(
            f"a function is named as module:function, such as my_model:force, got {reference!r}"
        )
    here = os.getcwd()
    if here not in sys.path:
        sys.path.insert(0, here)
    function: Any
    try:
        function = importlib.import_module(module_name)
        for part in name.split("."):
            function = getattr(function, part)
    except ImportError as fault:
        raise InputError(f"{module_name} cannot be imported: {fault}") from None
    except AttributeError:
        names = [n for n in vars(sys.modules[module_name]) if not n.startswith("_")]
        raise InputError(
            f"{module_name} has no function {name!r}; {nearest(name, names)}"
        ) from None
    if not callable(function):
        raise InputError(
            f"{reference} is no function but of type {type(function).__name__}"
        )
    return cast(Callable[..., Any], function)


def _ordered(
    function: Callable[..., Any], names: list[str], reference: str, of_members: str = ""
) -> list[str]:
    """The axes in the order of the function's arguments; that of members is none of them."""
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return names
    kinds = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    taken = [p.name for p in parameters if p.kind in kinds]
    if any(p.kind == inspect.Parameter.VAR_POSITIONAL for p in parameters):
        return names
    needed = [
        p.name
        for p in parameters
        if p.kind in kinds and p.default is inspect.Parameter.empty
    ]
    for name in names:
        if name not in taken:
            raise InputError(
                f"{reference} has no argument {name!r}; {nearest(name, taken)}"
            )
    if of_members and of_members not in taken + [p.name for p in parameters]:
        raise InputError(
            f"{reference} has no argument {of_members!r}; {nearest(of_members, taken)}"
        )
    for name in needed:
        if name not in (*names, of_members):
            raise InputError(
                f"axes.{name} is missing: {reference} takes {', '.join(taken)}"
            )
    ordered = [name for name in taken if name in names]
    if taken[: len(ordered)] != ordered:
        raise InputError(
            f"axes must be the first arguments of {reference}, {', '.join(taken)}, got "
            f"{', '.join(names)}"
        )
    return ordered


def _require_axis(axis: FunctionAxis) -> None:
    place = f"axes.{axis.name}"
    numbers = (axis.low, axis.high, axis.offset)
    if not all(map(math.isfinite, numbers)):
        raise InputError(f"{place}: its numbers must be finite, got {numbers}")
    if not axis.low < axis.high:
        raise InputError(
            f"{place}: low must be below high, got {axis.low:g} and {axis.high:g}"
        )
    if axis.transform == "log" and not axis.low + axis.offset > 0:
        raise InputError(
            f"{place}: low + offset must be above 0 on a logarithmic axis, got "
            f"{axis.low + axis.offset:g}"
        )
    if axis.transform == "linear" and axis.offset:
        raise InputError(f"{place}: offset is of logarithmic axes alone")


def wanted_of(
    entries: Mapping[str, Any],
    reference: str | None = None,
    target: float | None = None,
    place: str = "configuration",
) -> Wanted:
    """The configuration of a table of a function, checked, with the function's arguments.

    Parameters
    ----------
    entries : mapping
        As in the file that ``mbma tables make module:function --example`` prints.
    reference : str, optional
        ``module:function``, in place of the entry `function`.
    target : float, optional
        In place of the entry `target`.
    place : str
        What messages call the entries.

    Raises
    ------
    InputError
    """
    own = dict(entries)
    own |= {} if target is None else {"target": target}
    own |= {} if reference is None else {"function": reference}
    try:
        check(own, SCHEMA)
        if "function" not in own:
            raise InputError("function is missing: module:function")
        merged = DEFAULTS | own
        if not math.isfinite(merged["target"]):
            raise InputError(f"target must be finite, got {merged['target']}")
        members = _members_of(merged)
        names = _ordered_for_all(merged, members)
        axes = tuple(FunctionAxis(name, **merged["axes"][name]) for name in names)
        axes = tuple(
            dataclasses.replace(a, low=float(a.low), high=float(a.high)) for a in axes
        )
        for axis in axes:
            _require_axis(axis)
        outputs = tuple(
            FunctionOutput(name, **entry)
            for name, entry in merged.get("outputs", {"value": {}}).items()
        )
        both = {axis.name for axis in axes} & {output.name for output in outputs}
        if both:
            raise InputError(f"{both.pop()} names an axis and an output")
    except ValueError as fault:
        raise InputError(f"{place}: {fault}") from None
    found = {"axes": axes, "outputs": outputs, "members": members}
    return Wanted(**(merged | found))


def _members_of(merged: Mapping[str, Any]) -> Members | None:
    """The members of a configuration, if it has any."""
    if "members" not in merged:
        return None
    return Members.from_entries(merged["members"], merged["function"])


def _ordered_for_all(merged: Mapping[str, Any], members: Members | None) -> list[str]:
    """The axes in the order of the arguments, which is that of each member's function."""
    functions: tuple[str, ...] = (merged["function"],)
    argument = ""
    if members is not None:
        functions = members.functions or functions
        argument = members.argument
    if argument in merged["axes"]:
        raise InputError(f"{argument} is an axis and the argument of members")
    orders = [
        _ordered(function_of(each), list(merged["axes"]), each, argument)
        for each in functions
    ]
    for each, order in zip(functions, orders, strict=True):
        if order != orders[0]:
            raise InputError(
                f"{each} takes {', '.join(order)}, {functions[0]} {', '.join(orders[0])}: "
                "functions of members must take the same arguments"
            )
    return orders[0]


def load(
    path: pathlib.Path, reference: str | None = None, target: float | None = None
) -> Wanted:
    """The configuration of a TOML file."""
    return wanted_of(read_toml(path, "configuration"), reference, target, str(path))


# ---- values of the function ----


def _as_rows(
    found: Any, names: tuple[str, ...], count: int, reference: str
) -> FloatArray:
    """What a function returned for `count` points, shape (points, outputs)."""
    if hasattr(found, "_asdict"):
        found = found._asdict()
    if isinstance(found, Mapping):
        missing = [name for name in names if name not in found]
        if missing:
            raise InputError(
                f"{reference} returns {', '.join(map(str, found))}, not {missing[0]!r}"
            )
        found = [found[name] for name in names]
    elif len(names) == 1:
        shape = np.shape(found)
        # of one output alone, or in a list
        found = found if len(shape) == 2 and shape[0] == 1 else [found]
    try:
        if any(map(np.iscomplexobj, found)):
            raise TypeError("they are complex")
        columns = [np.asarray(column, dtype=float) for column in found]
    except (TypeError, ValueError) as fault:
        raise InputError(f"{reference} returned what are no numbers: {fault}") from None
    if len(columns) != len(names) or any(column.shape != (count,) for column in columns):
        shapes = ", ".join(str(column.shape) for column in columns)
        raise InputError(
            f"{reference} returned arrays of shape {shapes} for {count} points and outputs "
            f"{', '.join(names)}; each must have shape ({count},)"
        )
    return np.stack(columns, axis=-1)


def _one_by_one(
    function: Callable[..., Any], x: FloatArray, wanted: Wanted, marks: bool
) -> FloatArray:
    """The function called for each point, NaN where it raises and failures are marked."""
    names = tuple(output.name for output in wanted.outputs)
    rows = np.full((len(x), len(names)), np.nan)
    for row, point in zip(rows, x, strict=True):
        try:
            if wanted.vectorized:
                found = function(*(np.array([number]) for number in point))
            else:
                found = function(*map(float, point))
        except Exception as fault:
            if marks:
                continue
            raise InputError(_raised(wanted, fault, point)) from None
        if not wanted.vectorized:
            found = _in_arrays(found)
        row[:] = _as_rows(found, names, 1, wanted.function)[0]
    return rows


def _in_arrays(found: Any) -> Any:
    """Numbers of one point as arrays of one entry."""
    if hasattr(found, "_asdict"):
        found = found._asdict()
    if isinstance(found, Mapping):
        return {name: np.reshape(number, -1) for name, number in found.items()}
    if isinstance(found, tuple | list) or np.ndim(found):
        return [np.reshape(number, -1) for number in found]
    return np.reshape(found, -1)


def _at(wanted: Wanted, point: FloatArray) -> str:
    return ", ".join(
        f"{axis.name} = {float(number):.12g}"
        for axis, number in zip(wanted.axes, point, strict=True)
    )


def _raised(wanted: Wanted, fault: Exception, point: FloatArray) -> str:
    remedies = ['with on_failure = "mark" lookups are refused there']
    if wanted.vectorized and isinstance(fault, TypeError | ValueError):
        remedies.append("if the function takes one point a call, set vectorized = false")
    return (
        f"{wanted.function} raised {type(fault).__name__}: {fault}; at {_at(wanted, point)}; "
        f"{'; '.join(remedies)}"
    )


def values_of(wanted: Wanted, x: FloatArray) -> FloatArray:
    """The function at points (points, axes), shape (points, stored outputs); a job of workers."""
    members = wanted.members
    if members is None:
        return _values_of_one(wanted, function_of(wanted.function), x)
    rows = []
    for number, name in enumerate(members.names):
        reference = wanted.function
        if members.functions:
            reference = members.functions[number]
            function = function_of(reference)
        else:
            argument = {members.argument: members.values[number]}
            function = functools.partial(function_of(wanted.function), **argument)
        called = dataclasses.replace(wanted, function=f"{reference} (member {name})")
        rows.append(_values_of_one(called, function, x))
    together = np.array(rows)
    beside = together[len(rows) - len(members.stored) :]
    return np.concatenate([members.central(together), *beside], axis=1)


def _values_of_one(
    wanted: Wanted, function: Callable[..., Any], x: FloatArray
) -> FloatArray:
    """A function at points (points, axes), shape (points, outputs)."""
    marks = wanted.on_failure == "mark"
    names = tuple(output.name for output in wanted.outputs)
    # users' functions warn where they please; their values are checked here
    with np.errstate(all="ignore"):
        if not wanted.vectorized:
            rows = _one_by_one(function, x, wanted, marks)
        else:
            try:
                found = function(*(np.ascontiguousarray(column) for column in x.T))
            except Exception as fault:
                # the point that raises, if one does alone
                rows = _one_by_one(function, x, wanted, marks)
                if not marks:
                    raise InputError(_raised(wanted, fault, x[0])) from None
            else:
                rows = _as_rows(found, names, len(x), wanted.function)
    logs = np.array([output.transform == "log" for output in wanted.outputs])
    bad = ~np.isfinite(rows) | ((rows <= 0) & logs)
    if bad.any() and not marks:
        point, k = np.argwhere(bad)[0]
        allowed = "a finite number above 0" if logs[k] else "a finite number"
        raise InputError(
            f"{wanted.function} returned {names[k]} = {rows[point, k]:g}, not {allowed}; at "
            f'{_at(wanted, x[point])}; with on_failure = "mark" lookups are refused there'
        )
    rows[bad.any(axis=1)] = np.nan
    return rows


# ---- pieces ----


def tree_of(wanted: Wanted) -> list[Box]:
    """The range halved, the axes by turns, until there is a pending box for each piece."""
    low = np.array([float(axis.to_grid(axis.low)) for axis in wanted.axes])
    high = np.array([float(axis.to_grid(axis.high)) for axis in wanted.axes])
    none = np.zeros(low.size, dtype=np.int64)
    boxes = [Box(low, high, none, terms=())]
    level = boxes
    axis = 0
    while len(level) < wanted.pieces:
        halves: list[Box] = []
        for box in level:
            box.axis, box.child = axis, len(boxes) + len(halves)
            halves += box.halves(axis, terms=())
        boxes = boxes + halves
        level = halves
        axis = (axis + 1) % low.size
    return boxes


def pieces_of(wanted: Wanted) -> list[Piece]:
    """The pieces of the range."""
    parts = [box for box in tree_of(wanted) if box.axis == PENDING]
    points = math.ceil(wanted.certificate_points / wanted.pieces)
    return [
        Piece(
            part,
            wanted.aim,
            points,
            # rounds count on from here
            1000 * wanted.seed * wanted.pieces + 1000 * number,
            wanted.on_failure == "mark",
            wanted.max_coefficients,
        )
        for number, part in enumerate(parts)
    ]


class Kept:
    """The folder in which pieces are kept while a table is made."""

    def __init__(self, folder: pathlib.Path, wanted: Wanted) -> None:
        self.folder, self.wanted = folder, wanted

    def begin(self, resume: bool) -> None:
        """Use the folder of an earlier run of the same configuration, or start a new one."""
        note = self.folder / "configuration.json"
        if note.exists() and resume:
            text, own = note.read_text(encoding="utf-8"), self.wanted.as_json
            if text != own:
                raise InputError(
                    f"{self.folder} is of another configuration, with other "
                    f"{_differences(text, own)}: remove it, or give the same configuration "
                    "to go on"
                )
            return
        if note.exists():
            shutil.rmtree(self.folder)
        elif self.folder.exists():
            raise InputError(f"{self.folder} holds something else than pieces of a table")
        write_file(note, self.wanted.as_json.encode(), make_folders=True)

    def path(self, number: int) -> pathlib.Path:
        """The file of a piece."""
        return self.folder / f"piece-{number:03d}.npz"

    def save(self, number: int, piece: Piece, values: FloatArray) -> None:
        """Keep the state of a piece, and the values that it is waiting for, as far as known."""
        content = io.BytesIO()
        np.savez_compressed(content, **piece.state(), values=values)
        write_file(self.path(number), content.getvalue())

    def load(self, number: int, piece: Piece) -> FloatArray:
        """Continue a piece; the values that it is waiting for, as far as known."""
        path = self.path(number)
        none = np.empty((0, len(self.wanted.stored)))
        if not path.exists():
            return none
        try:
            # opened here, as numpy leaves what is no archive open
            with (
                path.open("rb") as stream,
                np.load(stream, allow_pickle=False) as stored,
            ):
                state = dict(stored)
            piece.restore(state)
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as fault:
            raise TableFileError(f"{path} is damaged ({fault}): remove it") from None
        return np.asarray(state["values"])


def in_x(wanted: Wanted, t: FloatArray) -> FloatArray:
    """Points of the axes from their coordinates."""
    columns = [axis.from_grid(t[:, a]) for a, axis in enumerate(wanted.axes)]
    return np.stack(columns, axis=-1)


def grow(
    number: int,
    piece: Piece,
    kept: Kept,
    run: Crew,
    progress: Callable[[int], object],
) -> None:
    """Make a piece to its end, keeping its state every few seconds."""
    wanted = kept.wanted
    values = kept.load(number, piece)
    saved = time.monotonic()
    while not piece.is_done:
        x = in_x(wanted, piece.points())
        size = wanted.chunk if wanted.vectorized else 1
        while len(values) < len(x):
            ahead = size * run.size() * JOBS_AHEAD
            end = min(len(values) + ahead, len(x))
            jobs = [
                (wanted, x[start : min(start + size, end)])
                for start in range(len(values), end, size)
            ]
            progress(end - len(values))
            values = np.concatenate([values, *run(values_of, jobs)])
            if time.monotonic() - saved > SAVED_EVERY:
                kept.save(number, piece, values)
                saved = time.monotonic()
        try:
            piece.take(values)
        except UnsmoothError as fault:
            place = in_x(wanted, fault.place[None])[0]
            raise UncertifiedError(
                f"{wanted.function} is not smooth at {_at(wanted, place)}: the target of "
                f"{wanted.target:g} is not reached in boxes of 2^-{MOST_HALVINGS} of the range; ask for a "
                'larger target, or set on_failure = "mark" to refuse lookups there'
            ) from None
        values = np.empty((0, len(wanted.stored)))
    kept.save(number, piece, values)


# ---- the table ----


def table_of(wanted: Wanted, pieces: list[Piece]) -> FunctionTable:
    """The table of finished pieces."""
    boxes = tree_of(wanted)
    places = [number for number, box in enumerate(boxes) if box.axis == PENDING]
    for place, piece in zip(places, pieces, strict=True):
        # the first of its boxes stands in the tree, the others behind all
        shift = len(boxes) - 1
        moved = [dataclasses.replace(b, child=b.child + shift) for b in piece.boxes]
        boxes[place] = moved[0]
        boxes += moved[1:]
    replayed = zip(*(piece.replayed for piece in pieces), strict=True)
    points, values = (np.concatenate(part) for part in replayed)
    errors = np.concatenate(
        [piece.errors for piece in pieces if piece.errors is not None]
    )
    excess = sum(piece.excess for piece in pieces)
    return assembled(wanted, boxes, (points, values), errors, excess)


def assembled(
    wanted: Wanted,
    boxes: list[Box],
    replayed: tuple[FloatArray, FloatArray],
    errors: FloatArray,
    excess: int,
) -> FunctionTable:
    """The table of a tree of boxes.

    Parameters
    ----------
    wanted : Wanted
    boxes : list of Box
        The first is the whole range.
    replayed : tuple of ndarray, shapes (points, axes), (points, stored outputs)
        Coordinates that the file keeps, and what is stored there by the function.
    errors : ndarray, shape (held-out points, stored outputs)
        As the outputs measure them; NaN where there is no answer.
    excess : int
        How many of them are above the bound.
    """
    points, values = replayed
    cells = [box for box in boxes if box.axis == POLYNOMIAL]
    branches = np.array([(box.axis, box.child) for box in boxes], dtype=float)
    branches[branches[:, 0] == POLYNOMIAL, 1] = np.arange(len(cells))
    outputs = len(wanted.outputs)
    sizes = [outputs * math.prod(box.terms) for box in cells]
    series = [box.coefficients for box in cells if box.coefficients is not None]
    bounds = np.array([box.error for box in cells])
    arrays = {
        "branches": branches,
        "middles": np.array([middle_of(boxes, box) for box in boxes]),
        "starts": np.cumsum([0, *sizes])[:-1].astype(float),
        "terms": np.array([box.terms for box in cells], dtype=float),
        "coefficients": np.concatenate([each[:outputs].ravel() for each in series]),
        "errors": bounds[:, :outputs],
    }
    logs = wanted.aim.is_exponential
    exact = np.where(logs, np.exp(np.where(logs, values, 0.0)), values)
    arrays["conformance_x"] = in_x(wanted, points)
    arrays["conformance_exact"] = exact[:, :outputs]
    if wanted.members is not None:
        arrays |= {
            "member_coefficients": np.concatenate(
                [each[outputs:].ravel() for each in series]
            ),
            "member_errors": bounds[:, outputs:],
            "member_exact": exact[:, outputs:],
        }
    attributes = _attributes(wanted, errors, excess)
    return checked(FunctionTable(wanted.axes, wanted.outputs, arrays, attributes))


def _attributes(wanted: Wanted, errors: FloatArray, excess: int) -> dict[str, str]:
    """What the file says of the table."""
    answered = errors[np.isfinite(errors).all(axis=1)]
    names = [output.name for output in wanted.outputs]
    members = () if wanted.members is None else wanted.members.stored
    if not len(answered):
        raise UncertifiedError(f"{wanted.function} has no value at any held-out point")
    statistics = {
        "largest_error": answered.max(axis=0),
        "p99_error": np.percentile(answered, 99, axis=0),
        "median_error": np.median(answered, axis=0),
    }
    certificate = {
        "held_out_points": len(answered),
        "without_answer": len(errors) - len(answered),
        "above_bound": excess,
        **{
            name: dict(zip(names, values[: len(names)].tolist(), strict=True))
            for name, values in statistics.items()
        },
    }
    if wanted.members is not None:
        largest = statistics["largest_error"].reshape(-1, len(names))[1:].tolist()
        certificate["largest_error_of_members"] = {
            member: dict(zip(names, row, strict=True))
            for member, row in zip(members, largest, strict=True)
        }
    return {
        "title": wanted.title or f"Table of {wanted.function}",
        "function": wanted.function,
        "licence": wanted.licence or "not stated",
        "source": wanted.source or "not stated",
        "target": wanted.target,  # type: ignore[dict-item]
        "axes": json.dumps([dataclasses.asdict(axis) for axis in wanted.axes]),
        "outputs": json.dumps([dataclasses.asdict(output) for output in wanted.outputs]),
        "configuration": wanted.as_json,
        "certificate": json.dumps(certificate),
        "versions": json.dumps(versions(), sort_keys=True),
        "lookup_01": "on each axis: t = x, or ln(x + offset) where its transform is log",
        "lookup_02": (
            "from box 0 down: if branches[box, 0] is an axis, box = branches[box, 1], plus 1 "
            "where t of that axis >= middles[box]; if it is -1, the cell is branches[box, 1]; "
            "if it is -2 there is no answer; low and high of the box are those of the axes, "
            "halved on the way"
        ),
        "lookup_03": "on each axis: y = (2 t - low - high)/(high - low) of the box",
        "lookup_04": (
            "output f is the sum over i, j, ... of coefficients[starts[cell] + f n + ((i n_1 + "
            "j) n_2 + ...)] T_i(y_0) T_j(y_1) ..., n_a = terms[cell, a], n their product, "
            "T_n(cos u) = cos(n u); its exponential where the output's transform is log"
        ),
        "lookup_05": (
            "errors[cell, f] bounds the error: of the logarithm, relative to the larger of the "
            "value and least, or absolute, as the output's transform and error say"
        ),
        **_attributes_of_members(wanted),
    }


def _attributes_of_members(wanted: Wanted) -> dict[str, str]:
    """What the file says of its members."""
    if wanted.members is None:
        return {}
    return {
        "members": wanted.members.as_json,
        "members_rule": f"{wanted.members.rule}: {RULES[wanted.members.rule]}",
        "lookup_06": (
            f"members {', '.join(wanted.members.stored)}: output f of member m, from 0, is that "
            "sum with member_coefficients[starts[cell] M + (m F + f) n + ...] for M members and "
            "F outputs, and its bound member_errors[cell, m F + f]"
        ),
    }


def write(path: pathlib.Path, table: FunctionTable) -> None:
    """Write a table's file whole, or raise TableFileError and write nothing."""
    over = {
        "branches": (("box", "pair"), "axis and lower half of each box, or its cell"),
        "middles": (("box",), "where a box is halved"),
        "starts": (("cell",), "first coefficient of each cell"),
        "terms": (("cell", "axis"), "terms of each cell along each axis"),
        "coefficients": (("coefficient",), "Chebyshev coefficients"),
        "errors": (("cell", "output"), "bound on the error in each cell"),
        "conformance_x": (("conformance", "axis"), "held-out points to replay"),
        "conformance_exact": (("conformance", "output"), "what the function gives there"),
        "member_coefficients": (("member_coefficient",), "those of the members"),
        "member_errors": (("cell", "member_output"), "those of the members"),
        "member_exact": (("conformance", "member_output"), "what the members give there"),
        "axis_numbers": (
            ("axis", "of_axis"),
            "low, high, offset, both ends as coordinates, 1 for a logarithm, outside: 0 refused, "
            "1 nearest, 2 periodic",
        ),
        "output_numbers": (
            ("output", "of_output"),
            "1 for an exponential, 1 for a relative error, least",
        ),
    }
    arrays = {**table.arrays, **table.numbers()}
    variables = {
        name: (dims, arrays[name], meaning, "1")
        for name, (dims, meaning) in over.items()
        if name in arrays
    }
    write_own(path, variables, table.attributes, KIND, FORMAT)


def _differences(note: str, other: str) -> str:
    """Entries in which two configurations differ, for a message."""
    mine, theirs = map(json.loads, (note, other))
    return ", ".join(
        key for key in sorted({*mine, *theirs}) if mine.get(key) != theirs.get(key)
    )


def folder_of(path: pathlib.Path) -> pathlib.Path:
    """The folder in which the pieces of a table are kept while it is made."""
    return path.with_name(f"{path.name}.pieces")


def _bar(label: str) -> Any:
    from tqdm import tqdm

    return tqdm(desc=label, unit=" points", disable=None)


def make(
    wanted: Wanted,
    path: pathlib.Path,
    workers: int = 1,
    resume: bool = False,
    part: tuple[int, int] | None = None,
    scheduler: str | None = None,
    local_cluster: int | None = None,
) -> FunctionTable | None:
    """Make a table of a function, certify and write it.

    Parameters
    ----------
    wanted : Wanted
        From `load` or `wanted_of`.
    path : Path
        The file, which is replaced if it exists. Pieces are kept in the folder ``path.pieces``
        until it is written.
    workers : int
        Processes; the values do not depend on their number.
    resume : bool
        Go on with the pieces of an earlier run of the same configuration.
    part : (int, int), optional
        Make part k of n only; `merge` makes the table of all parts.
    scheduler : str, optional
        Address of a dask scheduler, whose workers call the function.
    local_cluster : int, optional
        Processes of a dask cluster on this machine, which replaces those that are killed.

    Returns
    -------
    FunctionTable or None
        None for a part.

    Raises
    ------
    InputError
        For a function that raises or returns no numbers, with the point.
    UncertifiedError
        If the target is not reached; what was found stays in the folder.
    """
    kept = Kept(folder_of(path), wanted)
    share = share_of(part, range(wanted.pieces))
    kept.begin(resume or part is not None)
    pieces = pieces_of(wanted)
    with crew(workers, scheduler, local_cluster) as run, _bar(wanted.function) as bar:
        for done, number in enumerate(share):
            bar.set_postfix_str(f"piece {done + 1} of {len(share)}", refresh=False)
            grow(number, pieces[number], kept, run, bar.update)
    if part is not None:
        return None
    table = table_of(wanted, pieces)
    write(path, table)
    shutil.rmtree(kept.folder, ignore_errors=True)
    return read_function_table(path)


def merge(path: pathlib.Path, folders: list[pathlib.Path]) -> FunctionTable:
    """The table of pieces that were made in parts, from the folders that hold them.

    Raises
    ------
    InputError
        If the folders are of different configurations, or a piece is missing.
    """
    notes = {
        folder: (folder / "configuration.json").read_text(encoding="utf-8")
        for folder in folders
        if (folder / "configuration.json").is_file()
    }
    lost = [folder for folder in folders if folder not in notes]
    if lost or not notes:
        raise InputError(f"{lost[0] if lost else path} holds no pieces of a table")
    first = folders[0]
    for folder, note in notes.items():
        if note != notes[first]:
            raise InputError(
                f"{folder} is of another configuration than {first}: they differ in "
                f"{_differences(note, notes[first])}"
            )
    wanted = Wanted.from_json(notes[first])
    pieces = pieces_of(wanted)
    unfinished = []
    for number, piece in enumerate(pieces):
        for folder in folders:
            kept = Kept(folder, wanted)
            if kept.path(number).exists() and not piece.is_done:
                kept.load(number, piece)
        if not piece.is_done:
            unfinished.append(number)
    if unfinished:
        raise InputError(
            f"{len(unfinished)} of {len(pieces)} pieces are not finished, the first is "
            f"{unfinished[0]}: make the parts to their end first"
        )
    write(path, table_of(wanted, pieces))
    return read_function_table(path)


def forecast(wanted: Wanted) -> str:
    """What a first round of a table asks of the function, and how long one call takes here."""
    piece = pieces_of(wanted)[0]
    x = in_x(wanted, piece.points())
    count = min(len(x), wanted.chunk if wanted.vectorized else 4)
    start = time.perf_counter()
    values_of(wanted, x[:count])
    seconds = (time.perf_counter() - start) / count
    return (
        f"at least {(len(x) + piece.held_out) * wanted.pieces} points in {wanted.pieces} pieces, "
        f"{seconds:.3g} s each in one process; how many more depends on the function"
    )


def verified_errors(
    table: FunctionTable, count: int, seed: int = 0
) -> Iterator[FloatArray]:
    """What a table's answers are beside its function at fresh random points, in blocks.

    Rows of each output are the absolute errors, the bounds that the table states, and the
    magnitudes of the function; shape (outputs, 3, points).
    """
    wanted = Wanted.from_json(table.attributes["configuration"])
    low, high = (
        np.array(
            [float(axis.to_grid(end)) for axis, end in zip(table.axes, ends, strict=True)]
        )
        for ends in (
            [axis.low for axis in table.axes],
            [axis.high for axis in table.axes],
        )
    )
    draws = np.random.default_rng(seed)
    for start in range(0, count, ERROR_BLOCK):
        size = min(ERROR_BLOCK, count - start)
        x = in_x(wanted, low + (high - low) * draws.random((size, low.size)))
        exact = values_of(wanted, x)[:, : len(table.outputs)]
        found = table.lookup(*x.T)
        rows = [
            [
                np.abs(found.values[output.name] - exact[:, k]),
                found.error[output.name],
                np.abs(exact[:, k]),
            ]
            for k, output in enumerate(table.outputs)
        ]
        yield np.array(rows)
