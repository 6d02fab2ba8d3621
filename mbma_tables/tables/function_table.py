"""Tables of any function of 1 to 6 numbers: values, slopes, inverses, each with a bound on its error."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.common.arguments import (
    FloatArray,
    broadcast_shape,
    finite_array,
    is_labelled,
    nearest,
    require,
)
from mbma_tables.common.display import Variable, dataset_of
from mbma_tables.common.errors import InputError
from mbma_tables.common.interrupts import in_blocks
from mbma_tables.common.netcdf import opened, own_content
from mbma_tables.common.shared import frozen, shared_property
from mbma_tables.core import core
from mbma_tables.tables.boxes import NO_ANSWER, POLYNOMIAL, tests
from mbma_tables.tables.members import Members, Spread

if TYPE_CHECKING:
    import netCDF4
    import xarray as xr

KIND = "function"
FORMAT = "1.0"
REMEDY = (
    "make it anew: `mbma tables make MODULE:FUNCTION --config AXES.toml --out TABLE.nc`"
)
MOST_AXES = 6
OUTSIDE = ("raise", "nan", "nearest", "periodic")  # policies of an axis
IN_CORE = {"raise": 0, "nan": 0, "nearest": 1, "periodic": 2}  # as in mbma.h
BLOCK = 1 << 14  # points between two checks for Ctrl-C
NOT_REACHED = -2  # of an inverse, as in mbma.h
NUMBERS = ("axis_numbers", "output_numbers")
ROUNDING = 4e-15


@dataclasses.dataclass(frozen=True)
class FunctionAxis:
    """An argument of the function: its range, the coordinate on which it is tabulated, its unit."""

    name: str
    low: float
    high: float
    transform: str = "linear"  # or "log": ln(x + offset)
    offset: float = 0.0
    unit: str = "1"
    meaning: str = ""
    outside: str = "raise"

    def to_grid(self, x: Any) -> Any:
        """The coordinate on which boxes are halved."""
        shifted = np.asarray(x, dtype=float)
        return np.log(shifted + self.offset) if self.transform == "log" else shifted

    def by_grid(self, x: FloatArray) -> FloatArray:
        """The derivative of the argument by the coordinate."""
        return np.asarray(x + self.offset if self.transform == "log" else np.ones_like(x))

    def from_grid(self, t: Any) -> Any:
        """Inverse of `to_grid`, within the range."""
        x = np.exp(t) - self.offset if self.transform == "log" else np.asarray(t)
        return np.clip(x, self.low, self.high)


@dataclasses.dataclass(frozen=True)
class FunctionOutput:
    """A result of the function: how its error is measured, its unit."""

    name: str
    error: str = "relative"  # or "absolute"
    least: float = 1e-300  # magnitude below which a relative error is that over `least`
    transform: str = "linear"  # or "log": the logarithm is stored
    unit: str = "1"
    meaning: str = ""


@dataclasses.dataclass(frozen=True)
class Looked:
    """Values of a table, bounds on their errors, and derivatives; dicts by the names of outputs.

    Attributes
    ----------
    values : dict of str to ndarray
        Each output, in the broadcast shape of the arguments.
    error : dict of str to ndarray
        Bounds on the absolute error of each.
    derivatives : dict of str to dict of str to ndarray
        By output and by axis; empty unless asked for.
    derivative_error : dict of str to dict of str to ndarray
        Bounds on their absolute errors.
    spread : dict of str to Spread
        Each output over the members of the table; empty unless asked for.
    """

    values: dict[str, Any]
    error: dict[str, Any]
    derivatives: dict[str, dict[str, Any]]
    derivative_error: dict[str, dict[str, Any]]
    spread: dict[str, Spread] = dataclasses.field(default_factory=dict)

    def __getitem__(self, output: str) -> Any:
        return self.values[output]


class FunctionTable:
    """A table of any function, which `open_table` reads and `mbma tables make MODULE:FUNCTION` makes.

    Parameters
    ----------
    axes : tuple of FunctionAxis
    outputs : tuple of FunctionOutput
    arrays : dict
        Tree and polynomials, by the names of the file's variables.
    attributes : dict
        Attributes of the file.
    """

    name = KIND

    def __init__(
        self,
        axes: tuple[FunctionAxis, ...],
        outputs: tuple[FunctionOutput, ...],
        arrays: Mapping[str, Any],
        attributes: Mapping[str, Any],
    ) -> None:
        self.axes, self.outputs = axes, outputs
        self.attributes = dict(attributes)
        self.arrays = frozen({name: np.array(array) for name, array in arrays.items()})

    def __reduce__(self) -> Any:
        return type(self), (self.axes, self.outputs, self.arrays, self.attributes)

    def __repr__(self) -> str:
        ranges = ", ".join(f"{a.name} {a.low:g} to {a.high:g}" for a in self.axes)
        largest = json.loads(self.attributes["certificate"])["largest_error"]
        errors = ", ".join(f"{name} {error:.2g}" for name, error in largest.items())
        cells = self.arrays["starts"].size
        members = ""
        if self.members is not None:
            members = f"{len(self.members.names)} members ({self.members.rule}), "
        return (
            f"FunctionTable({self.attributes['function']}: covers {ranges}, {cells} cells, "
            f"{members}largest held-out error {errors})"
        )

    @shared_property
    def members(self) -> Members | None:
        """Its members and their rule; None for a table without any."""
        text = self.attributes.get("members")
        return None if text is None else Members.from_json(json.loads(text))

    def numbers(self) -> dict[str, FloatArray]:
        """Axes and outputs as numbers, for readers in languages without JSON."""
        rows = [
            (output.transform == "log", output.error == "relative", output.least)
            for output in self.outputs
        ]
        axes = self._core[0].reshape(len(self.axes), -1)
        return {"axis_numbers": axes, "output_numbers": np.array(rows, dtype=float)}

    def _require_members(self) -> Members:
        if self.members is None:
            raise InputError(
                "this table has no members: a configuration's [members] makes them"
            )
        return self.members

    def _some(
        self,
        coefficients: FloatArray,
        errors: FloatArray,
        exact: FloatArray,
        which: slice,
    ) -> dict[str, Any]:
        """The arrays of a table of some of the outputs that coefficients and bounds are of."""
        width, count = errors.shape[1], len(range(errors.shape[1])[which])
        starts = self.arrays["starts"].astype(int) // len(self.outputs)
        blocks = np.split(coefficients, starts[1:] * width)
        parts = [block.reshape(width, -1)[which].ravel() for block in blocks]
        return {
            **{name: self.arrays[name] for name in ("branches", "middles", "terms")},
            "starts": starts * count,
            "coefficients": np.concatenate(parts),
            "errors": errors[:, which],
            "conformance_x": self.arrays["conformance_x"],
            "conformance_exact": exact[:, which],
        }

    def _of_members(self, which: slice) -> dict[str, Any]:
        """The arrays of some of the outputs of the stored members."""
        arrays = self.arrays
        return self._some(
            arrays["member_coefficients"],
            arrays["member_errors"],
            arrays["member_exact"],
            which,
        )

    @shared_property
    def _members_table(self) -> FunctionTable:
        """The stored members as outputs of one table."""
        outputs = self.outputs * len(self._require_members().stored)
        plain = {n: v for n, v in self.attributes.items() if n != "members"}
        return FunctionTable(self.axes, outputs, self._of_members(slice(None)), plain)

    def member(self, name: str) -> FunctionTable:
        """A member as a table of its own.

        Parameters
        ----------
        name : str
            One of ``members.names``.

        Raises
        ------
        InputError
            For a table without members, or without this one.
        """
        members = self._require_members()
        number = members.index(name)
        attributes = {n: v for n, v in self.attributes.items() if n != "members"}
        if members.functions:
            own = dict(zip(members.names, members.functions, strict=True))
            attributes["function"] = own[name]
        attributes["title"] = f"{attributes['title']}, member {name}"
        if number < 0:
            arrays = {n: v for n, v in self.arrays.items() if not n.startswith("member_")}
            return FunctionTable(self.axes, self.outputs, arrays, attributes)
        certificate = json.loads(attributes["certificate"])
        largest = certificate.pop("largest_error_of_members")[name]
        attributes["certificate"] = json.dumps(certificate | {"largest_error": largest})
        outputs = len(self.outputs)
        columns = slice(number * outputs, (number + 1) * outputs)
        return FunctionTable(
            self.axes, self.outputs, self._of_members(columns), attributes
        )

    def _spread(
        self,
        x: FloatArray,
        values: FloatArray,
        bounds: FloatArray,
        shape: tuple[int, ...],
    ) -> dict[str, Spread]:
        """Each output over the members, at points whose values and bounds are these."""
        members = self._require_members()
        table = self._members_table
        of_members, _, errors, _ = table._answers(x, False)
        off = table._absolute(of_members, errors)
        spread = {}
        for k, output in enumerate(self.outputs):
            rows, row_errors = (
                part.reshape(len(x), -1, len(self.outputs))[:, :, k].T
                for part in (of_members, off)
            )
            found = members.spread(values[:, k], bounds[:, k], rows, row_errors)
            spread[output.name] = Spread(
                *(part.reshape((*part.shape[:-1], *shape))[()] for part in found)
            )
        return spread

    @shared_property
    def _core(self) -> tuple[Any, ...]:
        """The table as arguments of the core."""
        rows = [
            (
                *(axis.low, axis.high, axis.offset),
                *map(float, (axis.to_grid(axis.low), axis.to_grid(axis.high))),
                *(float(axis.transform == "log"), float(IN_CORE[axis.outside])),
            )
            for axis in self.axes
        ]
        logs = [output.transform == "log" for output in self.outputs]
        whole = {"starts": np.int64, "branches": np.int32, "terms": np.int32}
        arrays = {
            name: np.ascontiguousarray(array, dtype=whole.get(name, np.float64)).ravel()
            for name, array in self.arrays.items()
        }
        names = ("branches", "middles", "starts", "terms", "coefficients", "errors")
        exponential = np.array(logs, dtype=np.int32)
        return np.array(rows).ravel(), exponential, *(arrays[name] for name in names)

    @shared_property
    def _widths(self) -> FloatArray:
        """Widths of the cells in coordinates, shape (cells, axes)."""
        low, high = self._ends
        return high - low

    @shared_property
    def _box_ends(self) -> tuple[FloatArray, FloatArray]:
        """Ends of all boxes in coordinates, shape (boxes, axes)."""
        branches = self.arrays["branches"].astype(int)
        middles = self.arrays["middles"]
        low, high = np.empty((2, len(branches), len(self.axes)))
        low[0] = [axis.to_grid(axis.low) for axis in self.axes]
        high[0] = [axis.to_grid(axis.high) for axis in self.axes]
        for box, (axis, child) in enumerate(branches):
            if axis < 0:
                continue
            low[child : child + 2], high[child : child + 2] = low[box], high[box]
            high[child, axis] = low[child + 1, axis] = middles[box]
        return low, high

    @shared_property
    def _ends(self) -> tuple[FloatArray, FloatArray]:
        """Ends of the cells in coordinates, shape (cells, axes)."""
        branches = self.arrays["branches"]
        low, high = self._box_ends
        boxes = np.flatnonzero(branches[:, 0] == POLYNOMIAL)
        order = boxes[np.argsort(branches[boxes, 1])]
        return low[order], high[order]

    def cells(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Lower and upper ends of the cells in coordinates of the axes, and stored bounds.

        Returns
        -------
        low, high : ndarray, shape (cells, axes)
            Coordinates on which the axes are tabulated; `FunctionAxis.from_grid` has the
            arguments.
        errors : ndarray, shape (cells, outputs)
            Bounds on the errors, relative or absolute as each output says.
        """
        low, high = self._ends
        return low.copy(), high.copy(), self.arrays["errors"].copy()

    def _columns(
        self, given: tuple[ArrayLike, ...], named: Mapping[str, ArrayLike]
    ) -> list[ArrayLike]:
        """The arguments in the order of the axes."""
        names = [axis.name for axis in self.axes]
        if len(given) > len(names):
            raise InputError(
                f"this table takes {', '.join(names)}, got {len(given)} numbers"
            )
        columns: dict[str, ArrayLike] = dict(zip(names, given, strict=False))
        for name, value in named.items():
            if name not in names:
                raise InputError(
                    f"this table has no axis {name!r}; {nearest(name, names)}"
                )
            if name in columns:
                raise InputError(f"{name} is given twice")
            columns[name] = value
        missing = [name for name in names if name not in columns]
        if missing:
            raise InputError(
                f"this table takes {', '.join(names)}: {missing[0]} is missing"
            )
        return [columns[name] for name in names]

    def _answers(self, x: FloatArray, slopes: bool) -> tuple[Any, Any, Any, Any]:
        """Values, slopes or None, bounds as stored and cells at points (points, axes)."""
        count, outputs, axes = len(x), len(self.outputs), len(self.axes)
        values, errors = np.empty((2, count, outputs))
        by_axes = np.empty((count if slopes else 0, outputs, axes))
        cells = np.empty(count, dtype=np.int64)

        def fill(block: slice) -> None:
            core.cell_answers(
                *self._core,
                x[block].ravel(),
                values[block].reshape(-1),
                int(slopes),
                by_axes[block].reshape(-1),
                errors[block].reshape(-1),
                cells[block],
            )

        in_blocks(fill, count, BLOCK)
        return values, by_axes, errors, cells

    def _points(self, columns: list[ArrayLike]) -> tuple[FloatArray, tuple[int, ...]]:
        """Points (points, axes) of arguments, those outside of an axis that raises refused."""
        arrays: dict[str, FloatArray] = {}
        for axis, column in zip(self.axes, columns, strict=True):
            arrays[axis.name] = finite_array(axis.name, column)
            if axis.outside == "raise":
                array = arrays[axis.name]
                inside = (array >= axis.low) & (array <= axis.high)
                allowed = f"in [{axis.low:g}, {axis.high:g}], the range of this table"
                require(axis.name, array, inside, allowed)
        shape = broadcast_shape(**arrays)
        flat = [np.broadcast_to(array, shape).ravel() for array in arrays.values()]
        return np.ascontiguousarray(np.stack(flat, axis=-1)), shape

    def lookup(
        self,
        *arguments: ArrayLike,
        derivatives: int = 0,
        members: bool = False,
        **named: ArrayLike,
    ) -> Looked:
        """Values with bounds on their errors, and derivatives.

        Parameters
        ----------
        *arguments, **named : array_like
            The function's arguments, in the order of the axes or by name; they broadcast,
            and DataArrays give DataArrays.
        derivatives : {0, 1}
            1: first derivatives by every axis too.
        members : bool
            Whether each output's `spread` over the members of the table is answered too.

        Returns
        -------
        Looked

        Raises
        ------
        OutOfRangeError
            Outside an axis whose policy is "raise".
        InputError
            For a name that is no axis, or NaN; for members of a table that has none.
        """
        if derivatives not in (0, 1):
            raise InputError(f"derivatives must be 0 or 1, got {derivatives!r}")
        columns = self._columns(arguments, named)
        if any(map(is_labelled, columns)):
            return self._labelled(columns, derivatives, members)
        x, shape = self._points(columns)
        values, slopes, errors, cells = self._answers(x, derivatives == 1)
        bounds = self._absolute(values, errors)
        by_output: dict[str, dict[str, Any]] = {}
        slope_errors: dict[str, dict[str, Any]] = {}
        if derivatives:
            most = self._slope_errors(x, bounds, cells)
            for k, output in enumerate(self.outputs):
                by_output[output.name], slope_errors[output.name] = (
                    {
                        axis.name: found[:, k, a].reshape(shape)[()]
                        for a, axis in enumerate(self.axes)
                    }
                    for found in (slopes, most)
                )
        names = [output.name for output in self.outputs]
        return Looked(
            {name: values[:, k].reshape(shape)[()] for k, name in enumerate(names)},
            {name: bounds[:, k].reshape(shape)[()] for k, name in enumerate(names)},
            by_output,
            slope_errors,
            self._spread(x, values, bounds, shape) if members else {},
        )

    def _labelled(
        self, columns: list[ArrayLike], derivatives: int, members: bool
    ) -> Looked:
        """The answer as DataArrays, with units."""
        import xarray

        together = xarray.broadcast(*map(xarray.DataArray, columns))
        found = self.lookup(
            *(column.values for column in together),
            derivatives=derivatives,
            members=members,
        )

        def labelled(values: Any, unit: str) -> Any:
            if np.ndim(values) > together[0].ndim:
                names = self._require_members().names
                coordinate = xarray.Variable("member", [*names])
                like = together[0].expand_dims(member=coordinate)
                return like.copy(data=values).assign_attrs(units=unit)
            return together[0].copy(data=np.asarray(values)).assign_attrs(units=unit)

        units = {output.name: output.unit for output in self.outputs}
        slopes, slope_errors = (
            {
                name: {a: labelled(v, "") for a, v in by_axis.items()}
                for name, by_axis in part.items()
            }
            for part in (found.derivatives, found.derivative_error)
        )
        values, errors = (
            {name: labelled(values, units[name]) for name, values in part.items()}
            for part in (found.values, found.error)
        )
        spread = {
            name: Spread(*(labelled(part, units[name]) for part in parts))
            for name, parts in found.spread.items()
        }
        return Looked(values, errors, slopes, slope_errors, spread)

    def _absolute(self, values: FloatArray, errors: FloatArray) -> FloatArray:
        """Bounds on absolute errors from those that are stored, shape (points, outputs)."""
        columns = [
            self._absolute_of(k, values[:, k], errors[:, k])
            for k in range(len(self.outputs))
        ]
        return np.stack(columns, axis=-1)

    def _absolute_of(self, k: int, values: FloatArray, errors: FloatArray) -> FloatArray:
        """The same of one output."""
        output = self.outputs[k]
        size = np.abs(values)
        if output.transform == "log":
            return np.asarray(size * np.expm1(errors))
        if output.error == "relative":
            # of the exact value, which may be larger by its error
            size = np.maximum(size, output.least)
            return np.asarray(errors * size / (1 - np.minimum(errors, 0.5)))
        return errors.copy()

    def _slope_errors(
        self, x: FloatArray, bounds: FloatArray, cells: NDArray[np.int64]
    ) -> FloatArray:
        """Bounds on the errors of derivatives.

        By Markov's inequality, for an error that behaves as a polynomial of twice the
        terms of the cell: its slope is at most (2 terms)^2 times its largest value over
        half the cell's width.
        """
        terms = self.arrays["terms"].astype(float)
        factors = (2 * terms) ** 2 * 2 / self._widths
        found = bounds[:, :, None] * factors[cells][:, None, :]
        for a, axis in enumerate(self.axes):
            if axis.transform == "log":
                found[:, :, a] /= (x[:, a] + axis.offset)[:, None]
        found[cells < 0] = np.nan
        return np.asarray(found)

    @shared_property
    def _directions(self) -> NDArray[np.int64]:
        low, high = self._ends
        places = 0.5 * (1 + tests(len(self.axes)))
        t = low[:, None] + places * (high - low)[:, None]
        points = np.stack(
            [axis.from_grid(t[..., a]).ravel() for a, axis in enumerate(self.axes)],
            axis=-1,
        )
        slopes = self._answers(np.ascontiguousarray(points), True)[1]
        rises = np.nanmin(slopes, axis=0) > 0
        falls = np.nanmax(slopes, axis=0) < 0
        return np.asarray(rises.astype(int) - falls.astype(int))

    def directions(self) -> NDArray[np.int64]:
        """By output and axis 1 or -1, the sign of all slopes, or 0 where both signs occur.

        Slopes are those at some points of every cell.
        """
        return self._directions.copy()

    def has_inverse(self, output: str, axis: str) -> bool:
        """Whether an output increases, or decreases, everywhere along an axis."""
        outputs = [each.name for each in self.outputs]
        axes = [each.name for each in self.axes]
        return bool(self._directions[outputs.index(output), axes.index(axis)])

    def inverse(self, axis: str, **given: ArrayLike) -> tuple[Any, Any]:
        """The number on an axis at which an output has a value, and a bound on its error.

        Parameters
        ----------
        axis : str
            The axis to solve for.
        **given : array_like
            One output, and all other axes; they broadcast.

        Returns
        -------
        value, error : ndarray
            In the unit of the axis.

        Raises
        ------
        OutOfRangeError
            Where the table does not reach the value; the message has the range.
        InputError
            If the output neither increases nor decreases everywhere along the axis.
        """
        names = [a.name for a in self.axes]
        if axis not in names:
            raise InputError(f"this table has no axis {axis!r}; {nearest(axis, names)}")
        outputs = [output.name for output in self.outputs]
        asked = [name for name in given if name in outputs]
        if len(asked) != 1:
            raise InputError(
                f"give a value of one of {', '.join(outputs)}, got {len(asked)}"
            )
        k, a = outputs.index(asked[0]), names.index(axis)
        direction = int(self._directions[k, a])
        if direction == 0:
            raise InputError(
                f"{asked[0]} increases along {axis} at some places and decreases at others, "
                "so that it has no inverse"
            )
        others = {name: value for name, value in given.items() if name != asked[0]}
        columns = self._columns((), others | {axis: self.axes[a].low})
        wanted = finite_array(asked[0], given[asked[0]])
        x, shape = self._points(columns)
        whole = np.broadcast_shapes(shape, wanted.shape)
        index = np.broadcast_to(np.arange(len(x)).reshape(shape), whole).ravel()
        target = np.broadcast_to(wanted, whole).flatten()
        found, error = self._solved(np.ascontiguousarray(x[index]), k, a, target)
        return found.reshape(whole)[()], error.reshape(whole)[()]

    def _solved(
        self, x: FloatArray, k: int, a: int, target: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Where output `k` has these values along axis `a` from the points `x`, and bounds on its error."""
        count = len(x)
        slopes, stated = np.empty((2, count))
        cells = np.empty(count, dtype=np.int64)
        rises = int(self._directions[k, a] > 0)

        def fill(block: slice) -> None:
            core.cell_inverse(
                *self._core,
                *(k, a, rises, self._guesses[k].ravel(), target[block]),
                *(x[block].reshape(-1), slopes[block], stated[block], cells[block]),
            )

        in_blocks(fill, count, BLOCK)
        missed = cells == NOT_REACHED
        if missed.any():
            self._refuse_missed(x, k, a, target, ~missed)
        found = x[:, a]
        bound = self._absolute_of(k, target, stated)
        return found, bound / np.abs(slopes) + ROUNDING * np.abs(found)

    def _refuse_missed(
        self,
        x: FloatArray,
        k: int,
        a: int,
        target: FloatArray,
        is_reached: NDArray[np.bool_],
    ) -> None:
        """Raise the error of values that an output does not reach along an axis."""
        axis, ends = self.axes[a], []
        for end in (axis.low, axis.high)[:: int(self._directions[k, a])]:
            x[:, a] = end
            ends.append(self._answers(x, False)[0][:, k])
        limits = f"within {np.nanmin(ends[0]):g} to {np.nanmax(ends[1]):g}"
        allowed = f"{limits}, which the table reaches along {axis.name}"
        require(self.outputs[k].name, target, is_reached, allowed)

    @shared_property
    def _guesses(self) -> FloatArray:
        """Guesses of stored outputs where boxes are halved, by which an inverse takes a half.

        Parabolas through the middle of the two halves' common face and the ends of its
        middle lines. Shape (outputs, boxes, 2 axes + 1), as mbma.h describes them.
        """
        branches = self.arrays["branches"]
        low, high = self._box_ends
        count = len(self.axes)
        boxes = np.flatnonzero(branches[:, 0] >= 0)
        center = 0.5 * (low[boxes] + high[boxes])
        center[np.arange(len(boxes)), branches[boxes, 0].astype(int)] = self.arrays[
            "middles"
        ][boxes]
        found = np.zeros((len(self.outputs), len(branches), 2 * count + 1))
        value = self._stored(center)
        constant = value.copy()
        for a in range(count):
            half = 0.5 * (high[boxes, a] - low[boxes, a])
            ends = []
            for sign in (-1, 1):
                places = center.copy()
                places[:, a] += sign * half
                ends.append(self._stored(places))
            slope = 0.5 * (ends[1] - ends[0]) / half
            curvature = 0.5 * (ends[1] + ends[0] - 2 * value) / half**2
            found[:, boxes, a] = slope - 2 * curvature * center[:, a]
            found[:, boxes, count + a] = curvature
            constant += (curvature * center[:, a] - slope) * center[:, a]
        # along the axis itself nothing is added
        halved = branches[boxes, 0].astype(int)
        place = center[np.arange(len(boxes)), halved]
        own = found[:, boxes, halved] + found[:, boxes, count + halved] * place
        found[:, boxes, -1] = constant + own * place
        return found

    def _stored(self, places: FloatArray) -> FloatArray:
        """Outputs as they are stored, shape (outputs, points), at coordinates of the axes."""
        x = [axis.from_grid(places[:, a]) for a, axis in enumerate(self.axes)]
        values = self._answers(np.ascontiguousarray(np.stack(x, axis=-1)), False)[0].T
        logs = [output.transform == "log" for output in self.outputs]
        values[logs] = np.log(values[logs])
        return np.asarray(values)

    def replayed(self) -> tuple[int, float]:
        """Held-out points that the file keeps, and the largest error there over the bound."""
        x, exact = self.arrays["conformance_x"], self.arrays["conformance_exact"]
        values, _, errors, _ = self._answers(np.ascontiguousarray(x), False)
        bounds = self._absolute(values, errors)
        excess = float(np.max(np.abs(values - exact) / bounds, initial=0.0))
        if self.members is not None:
            excess = max(excess, self._members_table.replayed()[1])
        return len(x), excess

    def to_dataset(self, **axes: ArrayLike) -> xr.Dataset:
        """Every output and the bound on its error on a grid, as an xarray Dataset.

        Parameters
        ----------
        **axes : array_like
            By name, each a number or of one dimension.
        """
        columns = self._columns((), axes)
        lines = {
            axis.name: np.atleast_1d(finite_array(axis.name, column))
            for axis, column in zip(self.axes, columns, strict=True)
        }
        has_members = self.members is not None
        found = self.lookup(*np.ix_(*lines.values()), members=has_members)
        names = tuple(lines)
        variables = {
            axis.name: Variable(lines[axis.name], axis.unit, axis.meaning, (axis.name,))
            for axis in self.axes
        }
        for output in self.outputs:
            meaning = output.meaning or output.name
            variables[output.name] = Variable(
                found.values[output.name], output.unit, meaning, names
            )
            variables[f"{output.name}_error"] = Variable(
                found.error[output.name],
                output.unit,
                f"bound on the absolute error of {output.name}",
                names,
            )
            if has_members:
                ends = found.spread[output.name]
                for end, values in (("low", ends.low), ("high", ends.high)):
                    variables[f"{output.name}_{end}"] = Variable(
                        values,
                        output.unit,
                        f"{end} end of {output.name} over the members",
                        names,
                    )
        return dataset_of(
            variables, {"table": KIND, "function": self.attributes["function"]}
        )


def table_in(dataset: netCDF4.Dataset) -> FunctionTable:
    """The table of an open file, checked; ValueError where it is of another kind or does not fit together."""
    values, attributes = own_content(dataset, KIND, FORMAT)
    try:
        axes = tuple(FunctionAxis(**entry) for entry in json.loads(attributes["axes"]))
        outputs = tuple(
            FunctionOutput(**entry) for entry in json.loads(attributes["outputs"])
        )
        for name in NUMBERS:  # what the attributes say, for other languages
            values.pop(name, None)
        points = values["conformance_x"], values["conformance_exact"]
        shapes = [(len(points[0]), len(axes)), (len(points[0]), len(outputs))]
        if [array.shape for array in points] != shapes:
            raise ValueError("has incomplete conformance points")
        table = checked(FunctionTable(axes, outputs, values, attributes))
        if table.members is not None:
            checked(_with_members(table))
        return table
    except (KeyError, TypeError) as fault:
        raise ValueError(f"lacks what a table of a function has: {fault}") from None


def _with_members(table: FunctionTable) -> FunctionTable:
    """The members' table of one whose members have all arrays, or ValueError."""
    arrays = table.arrays
    width = len(table.outputs) * len(table._require_members().stored)
    sizes = {
        "member_coefficients": arrays["coefficients"].size * width // len(table.outputs),
        "member_errors": len(arrays["starts"]) * width,
        "member_exact": len(arrays["conformance_x"]) * width,
    }
    for name, size in sizes.items():
        if arrays[name].size != size:
            raise ValueError(f"has {name} of {arrays[name].size} numbers, not {size}")
    return table._members_table


def read_function_table(path: os.PathLike[str] | str) -> FunctionTable:
    """The table of a file, checked; TableFileError where it is damaged or of another kind."""
    with opened(path, REMEDY) as dataset:
        return table_in(dataset)


def checked(table: FunctionTable) -> FunctionTable:
    """A table whose tree and polynomials fit together, or ValueError."""
    arrays = table.arrays
    branches, terms = arrays["branches"], arrays["terms"]
    cells, axes, outputs = len(arrays["starts"]), len(table.axes), len(table.outputs)
    if not 1 <= axes <= MOST_AXES or outputs < 1:
        raise ValueError(f"has {axes} axes and {outputs} outputs")
    shapes = {
        "branches": (len(arrays["middles"]), 2),
        "terms": (cells, axes),
        "errors": (cells, outputs),
    }
    wrong = [name for name, shape in shapes.items() if arrays[name].shape != shape]
    sizes = outputs * terms.prod(axis=1)
    starts = np.concatenate([[0], np.cumsum(sizes)])
    numbers = np.arange(len(branches))
    halved = branches[:, 0] >= 0
    ends = branches[:, 0] == POLYNOMIAL
    if (
        wrong
        or (starts[:-1] != arrays["starts"]).any()
        or starts[-1] != arrays["coefficients"].size
        or (branches[halved, 1] <= numbers[halved]).any()
        or (branches[halved, 1] + 1 >= len(branches)).any()
        or sorted(branches[ends, 1]) != [*range(cells)]
        or not (halved | ends | (branches[:, 0] == NO_ANSWER)).all()
        or (branches[:, 0] >= axes).any()
    ):
        raise ValueError("has a tree and polynomials that do not fit together")
    return table
