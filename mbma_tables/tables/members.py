"""Members of a table: variants of a function or replicas of a calibration, and the rules that combine them."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from mbma_tables.common.arguments import FloatArray, nearest
from mbma_tables.common.errors import InputError

# what the value of a table is, and what its lower and upper ends are
RULES = {
    "replicas": "the mean of all members; one standard deviation of them on either side",
    "envelope": "the first member; the least and the largest of all",
    "symmetric_hessian": (
        "the first member; the root of the sum of squares of the others' differences from "
        "it, on either side"
    ),
    "hessian": (
        "the first member; of each pair of those that follow the larger difference from it "
        "upwards, and downwards, and the roots of the sums of their squares"
    ),
}
AVERAGED = "replicas"


class Spread(NamedTuple):
    """An output over the members of a table.

    `low` and `high` are its ends by the table's rule, `error` bounds the error of both that the
    table makes, and `members` has each member's value, along a first axis.
    """

    low: Any
    high: Any
    error: Any
    members: Any


@dataclasses.dataclass(frozen=True)
class Members:
    """Members of a table: a value each of an argument of its function, or a function each.

    Attributes
    ----------
    names : tuple of str
    rule : {"replicas", "envelope", "symmetric_hessian", "hessian"}
        How they are combined, as in `RULES`.
    argument : str
        The function's argument that differs; empty where functions differ.
    values : tuple
        Of this argument.
    functions : tuple of str
        ``module:function`` of each member where functions differ.
    """

    names: tuple[str, ...]
    rule: str = AVERAGED
    argument: str = ""
    values: tuple[Any, ...] = ()
    functions: tuple[str, ...] = ()

    @classmethod
    def from_entries(cls, entries: Mapping[str, Any], function: str) -> Members:
        """The members of a configuration's table `members`, checked.

        Parameters
        ----------
        entries : mapping
        function : str
            ``module:function`` of the table, which is the first member's where functions differ.

        Raises
        ------
        InputError
        """
        values, others = entries.get("values"), entries.get("functions")
        argument = entries.get("argument", "")
        if (values is None) == (others is None) or bool(argument) != (values is not None):
            raise InputError(
                "members takes argument and values of the function, or functions of the "
                "members after the first"
            )
        functions = () if others is None else (function, *others)
        given = functions if values is None else tuple(values)
        names = tuple(entries.get("names", map(str, given)))
        if len(names) != len(given) or len({*names}) != len(names):
            raise InputError(
                f"members.names must be {len(given)} different names, got {', '.join(names)}"
            )
        rule = entries.get("rule", AVERAGED)
        if rule == "hessian" and len(names) % 2 == 0:
            raise InputError(
                "members of the rule hessian are a first one and pairs, an odd number, got "
                f"{len(names)}"
            )
        return cls(names, rule, argument, tuple(values or ()), functions)

    @classmethod
    def from_json(cls, entries: Mapping[str, Any]) -> Members:
        """Inverse of `dataclasses.asdict`, through JSON."""
        lists = ("names", "values", "functions")
        own: dict[str, Any] = {
            name: tuple(value) if name in lists else value
            for name, value in entries.items()
        }
        return cls(**own)

    @property
    def as_json(self) -> str:
        """All of it as text."""
        return json.dumps(dataclasses.asdict(self), sort_keys=True)

    @property
    def central_is_mean(self) -> bool:
        """Whether the table's value is a mean of all members, not the first."""
        return self.rule == AVERAGED

    @property
    def stored(self) -> tuple[str, ...]:
        """Names of those that a file has beside the table's value, which is else the first."""
        return self.names if self.central_is_mean else self.names[1:]

    def central(self, rows: FloatArray) -> FloatArray:
        """The table's value from those of all members, along the first axis."""
        return np.asarray(rows.mean(axis=0) if self.central_is_mean else rows[0])

    def index(self, name: str) -> int:
        """The number of a member among those of `stored`, -1 for the first where it is the value."""
        if name not in self.names:
            raise InputError(
                f"this table has no member {name!r}; {nearest(name, self.names)}"
            )
        return self.names.index(name) - (len(self.names) - len(self.stored))

    def spread(
        self, value: FloatArray, error: FloatArray, rows: FloatArray, errors: FloatArray
    ) -> Spread:
        """The spread of an output.

        Parameters
        ----------
        value, error : ndarray
            The table's, and the bound on its error.
        rows, errors : ndarray, shape (stored, ...)
            Those of the members that are stored beside it.
        """
        if self.central_is_mean:
            deviation = rows.std(axis=0, ddof=1)
            factor = math.sqrt(len(rows) / (len(rows) - 1))
            of_deviation = factor * np.sqrt((errors**2).mean(axis=0))
            low, high = value - deviation, value + deviation
            return Spread(low, high, error + of_deviation, rows)
        everyone = np.concatenate([value[None], rows])
        if self.rule == "envelope":
            worst = np.maximum(error, errors.max(axis=0))
            return Spread(everyone.min(axis=0), everyone.max(axis=0), worst, everyone)
        differences = rows - value
        # each difference is off by both errors at most, and so is the root of their squares
        off = error + np.sqrt(((errors + error) ** 2).sum(axis=0))
        if self.rule == "hessian":
            pairs = differences.reshape(-1, 2, *value.shape)
            up = np.maximum(pairs.max(axis=1), 0.0)
            down = np.maximum(-pairs.min(axis=1), 0.0)
        else:
            up = down = np.abs(differences)
        low, high = (
            value - np.sqrt((down**2).sum(axis=0)),
            value + np.sqrt((up**2).sum(axis=0)),
        )
        return Spread(low, high, off, everyone)
