"""Members from tables that were made one by one, by the boxes on which all of them are polynomials."""

from __future__ import annotations

import dataclasses
import pathlib
from collections.abc import Sequence

import numpy as np
from numpy.polynomial import chebyshev

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError, UncertifiedError
from mbma_tables.tables.boxes import (
    BOUND,
    NO_ANSWER,
    POLYNOMIAL,
    ROUNDING,
    Aim,
    Box,
    cells_at,
    coefficients_of,
    fit,
    grid_of,
    nodes,
    tests,
    value_at,
)
from mbma_tables.tables.function_table import FunctionTable, read_function_table
from mbma_tables.tables.make_function import (
    Wanted,
    assembled,
    in_x,
    values_of,
    write,
)
from mbma_tables.tables.members import Members

MORE_TERMS = 2  # of the logarithm of a mean, than of the members' logarithms
TERMS_OF_A_FILE = 24  # at most, as MBMA_MAX_TERMS of mbma.h


def merge_members(
    path: pathlib.Path,
    files: Sequence[pathlib.Path],
    rule: str,
    names: Sequence[str] = (),
) -> FunctionTable:
    """Write one table whose members are tables of the same axes and outputs.

    Parameters
    ----------
    path : Path
        The file to write.
    files : sequence of Path
        Tables without members, the first member first; their boxes may differ.
    rule : {"replicas", "envelope", "symmetric_hessian", "hessian"}
        How members are combined.
    names : sequence of str, optional
        Of the members; the names of their functions by default.

    Raises
    ------
    InputError
        For tables of different axes or outputs, or a table that has members itself.
    UncertifiedError
        If the boxes that they have together take too many coefficients.

    Notes
    -----
    Each polynomial is stated anew on the smaller boxes, which changes it by rounding alone.
    The functions are asked at the held-out points of all tables, to certify the result.
    """
    if len(files) < 2:
        raise InputError(f"members are two tables or more, got {len(files)}")
    tables = [read_function_table(file) for file in files]
    made = [Wanted.from_json(table.attributes["configuration"]) for table in tables]
    for file, table, own in zip(files, tables, made, strict=True):
        _require_alike(file, table, own, files[0], made[0])
    entries = {
        "functions": [own.function for own in made[1:]],
        "names": [*(names or (own.function.rpartition(":")[2] for own in made))],
        "rule": rule,
    }
    members = Members.from_entries(entries, made[0].function)
    wanted = dataclasses.replace(
        made[0],
        members=members,
        target=max(own.target for own in made),
        on_failure="mark" if any(o.on_failure == "mark" for o in made) else "stop",
    )
    boxes = _boxes_of_all(tables, wanted)
    x = np.concatenate([table.arrays["conformance_x"] for table in tables])
    t = np.stack([axis.to_grid(x[:, a]) for a, axis in enumerate(wanted.axes)], axis=-1)
    exact = _exact(made, members, in_x(wanted, t))
    write(path, _certified(wanted, boxes, t, exact))
    return read_function_table(path)


def _require_alike(
    file: pathlib.Path,
    table: FunctionTable,
    own: Wanted,
    first_file: pathlib.Path,
    first: Wanted,
) -> None:
    """Refuse a table that cannot be a member beside the first one."""
    if table.members is not None:
        raise InputError(f"{file} has members itself: merge tables of one function each")
    if own.vectorized != first.vectorized:
        raise InputError(
            f"{file} and {first_file} differ in vectorized: functions of members must be "
            "called alike"
        )
    for kind, mine, theirs in (
        ("axes", own.axes, first.axes),
        ("outputs", own.outputs, first.outputs),
    ):
        if mine == theirs:
            continue
        names, others = ([each.name for each in part] for part in (mine, theirs))
        what = f"{', '.join(names)}, not {', '.join(others)}"
        if names == others:
            one, other = next(
                pair for pair in zip(mine, theirs, strict=True) if pair[0] != pair[1]
            )
            what = f"{one}, not {other}"
        raise InputError(
            f"the {kind} of {file} differ from those of {first_file}: {what}"
        )


def _exact(made: Sequence[Wanted], members: Members, x: FloatArray) -> FloatArray:
    """The functions at points, shape (points, outputs of the value and stored members)."""
    rows = np.array([values_of(own, x) for own in made])
    beside = rows[len(rows) - len(members.stored) :]
    return np.concatenate([members.central(rows), *beside], axis=1)


def _descended(table: FunctionTable, number: int, box: Box) -> int:
    """The box of a table, from one of its boxes down, that contains all of another."""
    branches, middles = table.arrays["branches"], table.arrays["middles"]
    while branches[number, 0] >= 0:
        axis, middle = int(branches[number, 0]), middles[number]
        is_below, is_above = box.high[axis] <= middle, box.low[axis] >= middle
        if not (is_below or is_above):
            return number
        number = int(branches[number, 1]) + int(is_above)
    return number


def _halves(box: Box, axis: int, middle: float) -> list[Box]:
    lower_end, upper_start = box.high.copy(), box.low.copy()
    lower_end[axis] = upper_start[axis] = middle
    return [
        Box(box.low, lower_end, box.halvings, ()),
        Box(upper_start, box.high, box.halvings, ()),
    ]


def _boxes_of_all(tables: Sequence[FunctionTable], wanted: Wanted) -> list[Box]:
    """A tree whose boxes each lie in one box of every table, with the polynomials of all."""
    low = np.array([float(axis.to_grid(axis.low)) for axis in wanted.axes])
    high = np.array([float(axis.to_grid(axis.high)) for axis in wanted.axes])
    members = [_Polynomials(table) for table in tables]
    boxes = [Box(low, high, np.zeros(low.size, dtype=np.int64), ())]
    places = [[0] * len(tables)]  # boxes of the tables that contain each
    size = 0
    for number, box in enumerate(boxes):  # which grows on the way
        at = [
            _descended(table, place, box)
            for table, place in zip(tables, places[number], strict=True)
        ]
        kinds = [int(t.arrays["branches"][k, 0]) for t, k in zip(tables, at, strict=True)]
        if NO_ANSWER in kinds:
            box.axis = NO_ANSWER
            continue
        halved = next((k for k, kind in enumerate(kinds) if kind >= 0), None)
        if halved is not None:
            box.axis, box.child = kinds[halved], len(boxes)
            middle = float(tables[halved].arrays["middles"][at[halved]])
            boxes += _halves(box, box.axis, middle)
            places += [at, at]
            continue
        own = [member.on(k, box) for member, k in zip(members, at, strict=True)]
        _fill(box, own, wanted)
        size += 0 if box.coefficients is None else box.coefficients.size
        if size > wanted.max_coefficients:
            raise UncertifiedError(
                f"the boxes of these tables take more than {wanted.max_coefficients} "
                "coefficients together: set max_coefficients of the first one, or make the "
                "members in one run"
            )
    return boxes


class _Polynomials:
    """The polynomials of a table, by its boxes."""

    def __init__(self, table: FunctionTable) -> None:
        self.table = table
        self.low, self.high, self.errors = table.cells()
        starts = table.arrays["starts"].astype(int)
        self.blocks = np.split(table.arrays["coefficients"], starts[1:])

    def on(self, number: int, box: Box) -> tuple[FloatArray, FloatArray]:
        """Coefficients (outputs, *terms) on a part of a box, and the bounds of that box."""
        cell = int(self.table.arrays["branches"][number, 1])
        terms = self.table.arrays["terms"][cell].astype(int)
        series = self.blocks[cell].reshape(-1, *terms)
        low, high = self.low[cell], self.high[cell]
        for axis, count in enumerate(terms):
            if box.low[axis] == low[axis] and box.high[axis] == high[axis]:
                continue
            middle = 0.5 * (box.low[axis] + box.high[axis])
            t = middle + 0.5 * (box.high[axis] - box.low[axis]) * nodes(count)
            y = (2 * t - low[axis] - high[axis]) / (high[axis] - low[axis])
            matrix = fit(count) @ chebyshev.chebvander(y, count - 1)
            moved = np.tensordot(matrix, series, (1, axis + 1))
            series = np.moveaxis(moved, 0, axis + 1)
        return series, self.errors[cell]


def _padded(series: FloatArray, terms: tuple[int, ...]) -> FloatArray:
    """Coefficients with zeros for further terms."""
    more = [(0, count - old) for old, count in zip(series.shape[1:], terms, strict=True)]
    return np.pad(series, [(0, 0), *more])


def _fill(box: Box, own: list[tuple[FloatArray, FloatArray]], wanted: Wanted) -> None:
    """A box's polynomials of the table's value and the stored members, with their bounds."""
    members = wanted.members
    assert members is not None
    aim = wanted.aim
    one = _aim_of_one(wanted)
    shapes = [series.shape[1:] for series, _ in own]
    terms = tuple(max(counts) for counts in zip(*shapes, strict=True))
    has_logs = members.central_is_mean and bool(one.is_exponential.any())
    if has_logs:
        terms = tuple(min(count + MORE_TERMS, TERMS_OF_A_FILE) for count in terms)
    rows = np.array([_padded(series, terms) for series, _ in own])
    bounds = np.array([bound for _, bound in own])
    central, bound = rows[0], bounds[0]
    if members.central_is_mean:
        central, bound = _mean(rows, bounds, one)
    start = len(rows) - len(members.stored)
    series = np.concatenate([central, *rows[start:]])
    scale = aim.scale(value_at(series, tests(box.low.size))).min(axis=1)
    rounding = ROUNDING * np.abs(series).reshape(len(series), -1).sum(axis=1) / scale
    box.terms, box.axis = terms, POLYNOMIAL
    box.coefficients = np.ascontiguousarray(series)
    box.error = np.concatenate([bound, *bounds[start:]]) + rounding


def _aim_of_one(wanted: Wanted) -> Aim:
    """What the outputs of one member aim at."""
    return dataclasses.replace(wanted, members=None).aim


def _mean(
    rows: FloatArray, bounds: FloatArray, aim: Aim
) -> tuple[FloatArray, FloatArray]:
    """Coefficients of the mean of members, and bounds on its error as they are stored.

    Bounds are measured at the test points of a box as those of a polynomial's fit are: the
    mean may be smaller than its members, and the logarithm of a mean is no polynomial.
    """
    axes = rows.ndim - 2
    worst = bounds.max(axis=0)
    at_tests = np.array([value_at(each, tests(axes)) for each in rows])
    mean = rows.mean(axis=0)
    off = (bounds[:, :, None] * np.array([aim.scale(each) for each in at_tests])).mean(0)
    relative = (off / aim.scale(at_tests.mean(axis=0))).max(axis=1)
    # of members of one sign the mean's relative error is that of the worst at most
    bound = np.where(relative <= worst, worst, BOUND * relative)
    logs = aim.is_exponential
    if not logs.any():
        return mean, bound
    grid = grid_of(rows.shape[2:])
    at_nodes = np.array([value_at(each, grid) for each in rows])
    fitted = coefficients_of(_log_of_mean(at_nodes).reshape(mean.shape))
    missed = np.abs(value_at(fitted, tests(axes)) - _log_of_mean(at_tests)).max(axis=1)
    mean[logs] = fitted[logs]
    return mean, np.where(logs, worst + BOUND * missed, bound)


def _log_of_mean(logarithms: FloatArray) -> FloatArray:
    """ln of the mean, along the first axis, of numbers whose logarithms are given."""
    largest = logarithms.max(axis=0)
    return np.asarray(largest + np.log(np.exp(logarithms - largest).mean(axis=0)))


def _certified(
    wanted: Wanted, boxes: list[Box], t: FloatArray, exact: FloatArray
) -> FunctionTable:
    """The table of boxes, with its errors at coordinates where the functions are known."""
    logs = wanted.aim.is_exponential
    stored = np.where(logs, np.log(np.where(logs, exact, 1.0)), exact).T
    errors = np.full(stored.shape, np.nan)
    excess = 0
    owners = cells_at(boxes, t)
    for number in np.unique(owners):
        box, mine = boxes[number], np.flatnonzero(owners == number)
        if box.coefficients is None or box.error is None:
            continue
        found = value_at(box.coefficients, box.place(t[mine]))
        scale = wanted.aim.scale(stored[:, mine])
        errors[:, mine] = np.abs(found - stored[:, mine]) / scale
        excess += int((errors[:, mine] > box.error[:, None]).any(axis=0).sum())
        worst = np.nan_to_num(errors[:, mine]).max(axis=1)
        box.error = np.maximum(box.error, 1.5 * worst)
    some = np.isfinite(errors).all(axis=0)
    return assembled(wanted, boxes, (t[some], stored.T[some]), errors.T, excess)
