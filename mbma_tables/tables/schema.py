"""Contents of a table file: names, types of attributes, consistency (docs/tables.md).

The core relies on these checks, and the text of attributes is written to exported files.
"""

import dataclasses
from typing import Any, Literal

import numpy as np

from mbma_tables.common.arguments import FloatArray

FUNCTIONS = ("F", "A")
UNIVERSAL = "universal"
ISLAND4D = "island4d"
KINDS = (UNIVERSAL, ISLAND4D)
FORMAT_VERSIONS = {UNIVERSAL: "2.0", ISLAND4D: "2.0"}
COEFFICIENTS = {UNIVERSAL: "chebyshev", ISLAND4D: "spline"}
DEGREE = 5  # degree of the splines of island4d
AXES = {
    UNIVERSAL: (("X", "linear"), ("mu", "linear")),
    ISLAND4D: (
        ("X", "log"),
        ("spread", "log"),
        ("sphere", "linear"),
        ("hurst", "linear"),
    ),
}
# edges of cells: of X at whole multiples of 1/X_STEPS from the first, of mu where the last
# bits of a double are 0, eight to an octave, so that a cell is found without a search; the
# last edge of each is the end of the range
X_STEPS = 16
BUCKET_BITS = 49
CELL_EDGES = {
    "X_low": "least X of a cell",
    "X_high": "largest X of a cell",
    "mu_low": "least mu of a cell",
    "mu_high": "largest mu of a cell",
}
# largest logarithm of a ratio to the rigid sphere; in the shipped tables below 20
MAX_LOG_RATIO = 100.0
# largest numbers of buckets of mu, eight per octave, and of X
MAX_BUCKETS = 4096
MAX_STEPS = 30_000
TERMS = 8  # terms of a Chebyshev series
LIMITS = {
    "mu": (0.0, np.inf),
    "spread": (0.0, np.inf),
    "sphere": (0.0, 1.0),
    "hurst": (0.0, 1.0),
}
ARGUMENTS = {
    UNIVERSAL: ("X", "mu"),
    ISLAND4D: ("delta_over_h_rms", "zeta_d", "zeta_u", "hurst"),
}
REQUIRED = (
    *("variant", "data_version", "values_sha256", "source_sha256", "certificate_points"),
    *(f"largest_error_{function}" for function in FUNCTIONS),
)
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

    #: first t
    start = property(lambda self: float(self.to_grid(self.low)))
    #: spacing in t
    step = property(
        lambda self: (float(self.to_grid(self.high)) - self.start) / (self.nodes - 1)
    )

    def position(self, x: Any) -> Any:
        """Place in node units, 0 ... nodes - 1."""
        return (self.to_grid(x) - self.start) * (1 / self.step)

    def coordinate(self, position: Any) -> Any:
        """Inverse of `position`; the ends are met exactly."""
        place = np.asarray(position, dtype=float)
        t = self.start + place * self.step
        x = (np.exp(t) if self.transform == "log" else t) - self.offset
        return np.where(
            place <= 0, self.low, np.where(place >= self.nodes - 1, self.high, x)
        )[()]

    @property
    def values(self) -> FloatArray:
        """Coordinates of the nodes."""
        return np.asarray(self.coordinate(np.arange(self.nodes)))

    def formula(self) -> str:
        """The position in node units as a formula."""
        shifted = f"{self.name} + {self.offset!r}" if self.offset else self.name
        t = f"log({shifted})" if self.transform == "log" else shifted
        return (
            f"position = ({t} {'-' if self.start >= 0 else '+'} {abs(self.start)!r}) / "
            f"{self.step!r}"
        )

    def attributes(self) -> dict[str, Any]:
        """Attributes of the axis in the file."""
        entries: dict[str, Any] = {
            "long_name": self.long_name,
            "units": "1",
            "transform": self.transform,
        }
        entries |= {"offset": self.offset, "first": self.low, "last": self.high}
        return entries | {"position_formula": self.formula()}


@dataclasses.dataclass(frozen=True)
class TableContent:
    """A table in memory, as written and as read."""

    kind: str
    axes: tuple[
        Axis, ...
    ]  # in the order of dimensions; of the universal table the ranges of X and mu, two nodes each
    # Chebyshev coefficients of Phi_F/mu and Phi_A, (cells, 8 of X, 8 of mu, 2), of the
    # universal table; else B-spline coefficients of log(Phi/Phi of the rigid sphere), each
    # axis longer by degree - 1, last axis F, A
    coefficients: FloatArray
    # bound on the relative error in each cell; F, A
    local_error: FloatArray
    # name -> (dimensions, values, attributes): edges of cells; log(Phi/Phi of the rigid
    # sphere) at nodes, coordinates
    auxiliary: dict[str, tuple[tuple[str, ...], FloatArray, dict[str, Any]]]
    conformance: dict[
        str, FloatArray
    ]  # arguments and results of the conformance points, shape (points,)
    attributes: dict[str, Any]  # attributes that do not follow from the rest

    @property
    def size(self) -> str:
        """Number of cells or nodes, as text."""
        cells = f"{self.coefficients.shape[0]} cells"
        return (
            cells
            if self.kind == UNIVERSAL
            else " x ".join(f"{axis.nodes} {axis.name}" for axis in self.axes)
        )

    def describe(self) -> str:
        """Range and error of the table, in one line."""
        ranges = ", ".join(
            f"{axis.name} {axis.low:g} to {axis.high:g}" for axis in self.axes
        )
        errors = ", ".join(
            f"{f} {self.attributes[f'largest_error_{f}']:.2g}" for f in FUNCTIONS
        )
        return f"covers {ranges}, size {self.size}, largest held-out error {errors}"

    def arrays(self) -> dict[str, Any]:
        """All arrays included in the values' hash, by their names in the file."""
        named: dict[str, Any] = {axis.name: axis.values for axis in self.axes}
        for number, function in enumerate(FUNCTIONS):
            named[f"{COEFFICIENTS[self.kind]}_{function}"] = self.coefficients[
                ..., number
            ]
            named[f"error_{function}"] = self.local_error[..., number]
        named |= {name: entry[1] for name, entry in self.auxiliary.items()}
        named |= {
            f"conformance_{name}": values for name, values in self.conformance.items()
        }
        return named


def dimensions(kind: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the dimensions of the coefficients and of the error bounds, the functions apart."""
    if kind == UNIVERSAL:
        return ("cell", "degree_X", "degree_mu"), ("cell",)
    names = [name for name, _ in AXES[kind]]
    return tuple(f"{name}_knot" for name in names), tuple(
        f"{name}_cell" for name in names
    )


def _check_axis(axis: Axis) -> None:
    low, high = LIMITS.get(axis.name, (-np.inf, np.inf))
    positive = axis.low + axis.offset > 0 or axis.transform == "linear"
    # lookups support an offset on the axis X only
    offset_is_supported = axis.offset == 0 or axis.name == "X"
    if not (
        positive
        and offset_is_supported
        and low <= axis.low < axis.high <= high
        and axis.nodes > 1
    ):
        raise ValueError(
            f"has axis {axis.name} from {axis.low:g} to {axis.high:g} with offset {axis.offset:g}"
        )
    if not (np.diff(axis.values) > 0).all():
        raise ValueError(f"has axis {axis.name}, which does not increase")


def _check_nodes(content: TableContent) -> None:
    nodes = tuple(axis.nodes for axis in content.axes)
    knots = tuple(count + DEGREE - 1 for count in nodes)
    cells = content.local_error.shape[:-1]
    values = [content.auxiliary[f"log_ratio_{function}"][1] for function in FUNCTIONS]
    if (
        any(array.shape != nodes for array in values)
        or content.coefficients.shape[:-1] != knots
    ):
        raise ValueError("has values or coefficients that are not over its axes")
    if cells != tuple(count - 1 for count in nodes):
        raise ValueError("has error bounds that are not over its cells")
    if (
        max(np.abs(array).max() for array in (*values, content.coefficients))
        > MAX_LOG_RATIO
    ):
        raise ValueError("has values that are not logarithms of ratios")
    # readers may hold them in single precision
    for name, array in (
        ("coefficients", content.coefficients),
        ("error bounds", content.local_error),
    ):
        rounded = array.astype(np.float32)
        if not np.array_equal(rounded, array, equal_nan=True):
            raise ValueError(f"has {name} that are not of single precision")


def _check_cells(content: TableContent) -> None:
    """Raise ValueError unless the cells fill the range in strips of X, from mu = 0 upwards."""
    X, mu = content.axes
    edges: list[FloatArray] = [content.auxiliary[name][1] for name in CELL_EDGES]
    cells = edges[0].size
    shapes = {array.shape for array in edges}
    if (
        shapes != {(cells,)}
        or content.coefficients.shape != (cells, TERMS, TERMS, 2)
        or cells == 0
    ):
        raise ValueError(
            f"has {COEFFICIENTS[content.kind]} coefficients that are not over its cells"
        )
    if content.local_error.shape != (cells, 2):
        raise ValueError("has error bounds that are not over its cells")
    X_low, X_high, mu_low, mu_high = edges
    starts = mu_low == 0
    # each cell begins where the previous one ends, up to the end of its strip
    upwards = (
        (mu_low[1:] == mu_high[:-1])
        & (X_low[1:] == X_low[:-1])
        & (X_high[1:] == X_high[:-1])
    )
    onwards = (mu_high[:-1] == mu.high) & (X_low[1:] == X_high[:-1])
    ends = (
        (X_low[0], X_high[-1], mu_high[-1]) == (X.low, X.high, mu.high)
        and starts[0]
        and mu.low == 0
    )
    grows = (X_high > X_low) & (mu_high > mu_low)
    if not (ends and grows.all() and np.where(starts[1:], onwards, upwards).all()):
        raise ValueError("has cells that do not fill its range one after the other")
    steps = (X_low - X.low) * X_STEPS
    lower = mu_low[~starts].view(np.int64)
    if (steps != np.round(steps)).any() or (lower & ((1 << BUCKET_BITS) - 1)).any():
        raise ValueError(
            "has cells whose edges are not where they can be found by arithmetic"
        )
    if (
        np.ptp(np.append(mu_high, mu.high).view(np.int64) >> BUCKET_BITS) >= MAX_BUCKETS
        or steps[-1] > MAX_STEPS
    ):
        raise ValueError("has cells over too wide a range")


@np.errstate(all="ignore")
def check_content(content: TableContent) -> None:
    """Raise ValueError if the parts of a table are inconsistent."""
    axes = tuple((axis.name, axis.transform) for axis in content.axes)
    if axes != AXES[content.kind]:
        raise ValueError(f"has axes {axes}, not {AXES[content.kind]}")
    for axis in content.axes:
        _check_axis(axis)
    (_check_cells if content.kind == UNIVERSAL else _check_nodes)(content)
    # results of the table and exact ones at the same points
    answers = {"tolerance"}
    for function in FUNCTIONS:
        answers |= {f"table_{function}", f"exact_{function}"}
    sizes = {values.shape for values in content.conformance.values()}
    if (
        set(content.conformance) != answers | set(ARGUMENTS[content.kind])
        or len(sizes) != 1
        or len(*sizes) != 1
    ):
        raise ValueError("has incomplete conformance points")
    for name, values in content.arrays().items():
        if not np.isfinite(values).all():
            raise ValueError(f"has variable {name}, which is not finite")
    if (content.local_error < 0).any() or any(
        (content.conformance[name] <= 0).any() for name in answers
    ):
        raise ValueError(
            "has an error bound below 0, or a conformance answer that is not positive"
        )
