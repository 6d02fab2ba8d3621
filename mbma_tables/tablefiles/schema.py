"""What a table file holds: every name of the format in one place.

The universal table is a list of cells of (X, mu), each with a Chebyshev series of Phi_F/mu and of Phi_A. The
four-parameter table holds the logarithm of the ratio to the rigid sphere at the nodes of four axes, and the spline
coefficients that interpolate it. Both have bounds on the error, conformance points, and attributes that say where all
of it came from. `docs/tables.md` describes the format for readers in other languages.
"""

from __future__ import annotations

import dataclasses
from typing import Any, Literal

import numpy as np

from mbma_tables.common.arguments import FloatArray

FUNCTIONS = ("F", "A")
UNIVERSAL = "universal"
ISLAND4D = "island4d"
KINDS = (UNIVERSAL, ISLAND4D)
FORMAT_VERSIONS = {UNIVERSAL: "2.0", ISLAND4D: "1.0"}
COEFFICIENTS = {UNIVERSAL: "chebyshev", ISLAND4D: "spline"}
DEGREE = 3  # of the splines of island4d
AXES = {
    UNIVERSAL: (("X", "linear"), ("mu", "linear")),
    ISLAND4D: (("X", "log"), ("spread", "log"), ("sphere", "linear"), ("hurst", "linear")),
}
# edges of cells: of X at whole multiples of 1/X_STEPS from the first, of mu where the last bits of a double are 0,
# eight to an octave, so that a cell is found without a search; the last edge of each is the end of the range
X_STEPS = 16
BUCKET_BITS = 49
CELL_EDGES = {
    "X_low": "least X of a cell",
    "X_high": "largest X of a cell",
    "mu_low": "least mu of a cell",
    "mu_high": "largest mu of a cell",
}
Transform = Literal["linear", "log"]


@dataclasses.dataclass(frozen=True)
class Axis:
    """An axis of equally spaced nodes in t = x + offset or t = log(x + offset)."""

    name: str
    long_name: str
    transform: Transform
    offset: float
    low: float  # first and last coordinate that is covered, both included
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

    def side(self, x: FloatArray) -> Any:
        """-1 below the axis, 0 on it, 1 above."""
        return ((x > self.high).astype(np.int8) - (x < self.low).astype(np.int8))[()]

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
        return f"position = ({t} {'-' if self.start >= 0 else '+'} {abs(self.start)!r}) / {self.step!r}"

    def attributes(self) -> dict[str, Any]:
        """Attributes of the axis in the file."""
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
    """A table in memory, as written and as read."""

    kind: str
    axes: tuple[Axis, ...]  # in the order of dimensions; of the universal table the ranges of X and mu, two nodes each
    # Chebyshev coefficients of Phi_F/mu and Phi_A, (cells, 8 of X, 8 of mu, 2), of the universal table; else B-spline
    # coefficients of log(Phi/Phi of the rigid sphere), each axis longer by degree - 1, last axis F, A
    coefficients: FloatArray
    local_error: FloatArray  # largest relative error in each cell (of a coarser grid: near it), times its factor; F, A
    # name -> (dimensions, values, attributes): edges of cells; log(Phi/Phi of the rigid sphere) at nodes, coordinates
    auxiliary: dict[str, tuple[tuple[str, ...], FloatArray, dict[str, Any]]]
    conformance: dict[str, FloatArray]  # arguments and answers of the points to replay, shape (points,)
    attributes: dict[str, Any]  # beyond those that follow from the rest

    @property
    def size(self) -> str:
        """How many cells or nodes it has, in words."""
        if self.kind == UNIVERSAL:
            return f"{self.coefficients.shape[0]} cells"
        return " x ".join(f"{axis.nodes} {axis.name}" for axis in self.axes)

    def facts(self) -> dict[str, str]:
        """What it covers and how right it is, for a line."""
        ranges = ", ".join(f"{axis.name} {axis.low:g} to {axis.high:g}" for axis in self.axes)
        errors = ", ".join(f"{f} {self.attributes[f'largest_error_{f}']:.2g}" for f in FUNCTIONS)
        return {"covers": ranges, "size": self.size, "largest held-out error": errors}

    def arrays(self) -> dict[str, Any]:
        """Every array that the values' hash covers, by the name that it has in the file."""
        named: dict[str, Any] = {axis.name: axis.values for axis in self.axes}
        for number, function in enumerate(FUNCTIONS):
            named[f"{COEFFICIENTS[self.kind]}_{function}"] = self.coefficients[..., number]
            named[f"error_{function}"] = self.local_error[..., number]
        named |= {name: entry[1] for name, entry in self.auxiliary.items()}
        named |= {f"conformance_{name}": values for name, values in self.conformance.items()}
        return named


def dimensions(kind: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the dimensions of the coefficients and of the error bounds, the functions apart."""
    if kind == UNIVERSAL:
        return ("cell", "degree_X", "degree_mu"), ("cell",)
    names = [name for name, _ in AXES[kind]]
    return tuple(f"{name}_knot" for name in names), tuple(f"{name}_cell" for name in names)


def error_cell(axis: Axis, cells: int, position: Any) -> Any:
    """Which cell of the error field a position lies in."""
    scaled = np.asarray(position) * (cells / (axis.nodes - 1))
    return np.clip(np.floor(scaled).astype(np.intp), 0, cells - 1)
