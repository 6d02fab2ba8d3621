"""What a table file holds: every name of the format in one place.

A file holds, for functions F and A over some axes, the logarithm of the ratio to the rigid sphere at the nodes, the
spline coefficients that interpolate it, a field of local error, conformance points, and attributes that tell
where all of it came from. `docs/tables.md` describes the format for readers in other languages.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any, Literal

import numpy as np

from mbma_tables.arguments import FloatArray

FORMAT_VERSION = "1.0"
CONVENTIONS = "CF-1.11"
FUNCTIONS = ("F", "A")
UNIVERSAL = "universal"
ISLAND4D = "island4d"
KINDS = (UNIVERSAL, ISLAND4D)
DEGREES = {UNIVERSAL: 5, ISLAND4D: 3}

OUT_OF_RANGE = {
    UNIVERSAL: (
        "below the smallest mu the stored logarithm is proportional to mu (first order about the rigid sphere, "
        "within the stated error); anywhere else outside the axes there is no answer: never clamp, never extrapolate"
    ),
    ISLAND4D: (
        "below the smallest spread the stored logarithm is proportional to mu (first order about the rigid "
        "sphere, within the stated error); anywhere else outside the axes there is no answer"
    ),
}

Transform = Literal["linear", "log"]


@dataclasses.dataclass(frozen=True)
class Axis:
    """An axis of equally spaced nodes in t = x + offset or t = log(x + offset).

    Attributes
    ----------
    name, long_name : str
        Coordinate name and what it is.
    transform : {"linear", "log"}
        Whether t is the coordinate itself or its logarithm, after the offset.
    offset : float
        Added to the coordinate first.
    low, high : float
        First and last coordinate that is covered, both included.
    nodes : int
        Number of nodes.
    """

    name: str
    long_name: str
    transform: Transform
    offset: float
    low: float
    high: float
    nodes: int

    def to_grid(self, x: Any) -> Any:
        """Transformed coordinate t."""
        shifted = np.asarray(x, dtype=float) + self.offset
        return np.log(shifted) if self.transform == "log" else shifted

    @property
    def start(self) -> float:
        """First t."""
        return float(self.to_grid(self.low))

    @property
    def step(self) -> float:
        """Spacing in t."""
        return (float(self.to_grid(self.high)) - self.start) / (self.nodes - 1)

    def position(self, x: Any) -> Any:
        """Place in node units, 0 ... nodes - 1."""
        return (self.to_grid(x) - self.start) * (1 / self.step)

    def coordinate(self, position: Any) -> Any:
        """Inverse of `position`; the ends are met exactly."""
        place = np.asarray(position, dtype=float)
        t = self.start + place * self.step
        x = (np.exp(t) if self.transform == "log" else t) - self.offset
        return np.where(place <= 0, self.low, np.where(place >= self.nodes - 1, self.high, x))[()]

    @property
    def values(self) -> FloatArray:
        """Coordinates of the nodes."""
        values: FloatArray = self.coordinate(np.arange(self.nodes))
        return values

    def formula(self) -> str:
        """The position in node units as a formula."""
        shifted = f"{self.name} + {self.offset!r}" if self.offset else self.name
        t = f"log({shifted})" if self.transform == "log" else shifted
        return f"position = ({t} - {self.start!r}) / {self.step!r}"

    def attributes(self) -> dict[str, Any]:
        """What the file says of this axis."""
        return {
            "long_name": self.long_name,
            "units": "1",
            "transform": self.transform,
            "offset": self.offset,
            "first": self.low,
            "last": self.high,
            "position_formula": self.formula(),
        }


@dataclasses.dataclass(frozen=True)
class TableContent:
    """A table in memory, as written and as read.

    Attributes
    ----------
    kind : str
        One of `KINDS`.
    axes : tuple of Axis
        In the order of the arrays' dimensions.
    log_ratio : ndarray
        log(Phi/Phi of the rigid sphere) at the nodes, last axis F, A.
    coefficients : ndarray
        B-spline coefficients of the same, each axis longer by degree - 1.
    local_error : ndarray
        Largest relative error found near each cell of a coarser grid, times its factor, last axis F, A.
    auxiliary : dict
        Further variables, name -> (dimension names, values, attributes).
    conformance : dict
        Arguments and answers of the points to replay, name -> (points,) array.
    attributes : dict
        Global attributes beyond those that follow from the rest.
    """

    kind: str
    axes: tuple[Axis, ...]
    log_ratio: FloatArray
    coefficients: FloatArray
    local_error: FloatArray
    auxiliary: dict[str, tuple[tuple[str, ...], FloatArray, dict[str, Any]]]
    conformance: dict[str, FloatArray]
    attributes: dict[str, Any]

    @property
    def degree(self) -> int:
        """Spline degree."""
        return DEGREES[self.kind]

    def arrays(self) -> dict[str, Any]:
        """Every array that the values' hash covers, by the name that it has in the file."""
        named: dict[str, Any] = {axis.name: axis.values for axis in self.axes}
        for number, function in enumerate(FUNCTIONS):
            named[f"log_ratio_{function}"] = self.log_ratio[..., number]
            named[f"spline_{function}"] = self.coefficients[..., number]
            named[f"error_{function}"] = self.local_error[..., number]
        named |= {name: entry[1] for name, entry in self.auxiliary.items()}
        named |= {f"conformance_{name}": values for name, values in self.conformance.items()}
        return named


def error_cells(axis: Axis, largest: int = 32) -> int:
    """Cells of the error field along an axis: as the nodes where those are few."""
    return min(axis.nodes - 1, largest)


def error_cell(axis: Axis, cells: int, position: Any) -> Any:
    """Which cell of the error field a position lies in."""
    scaled = np.asarray(position) * (cells / (axis.nodes - 1))
    return np.clip(np.floor(scaled).astype(np.intp), 0, cells - 1)


def is_finite_content(content: TableContent) -> bool:
    """Whether every number of the table is finite."""
    return all(np.isfinite(values).all() for values in content.arrays().values()) and not any(
        isinstance(value, float) and not math.isfinite(value) for value in content.attributes.values()
    )
