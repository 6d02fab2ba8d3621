"""What a table file may hold: the type of every attribute, and how the parts of a table fit one another.

The core takes for granted what is checked here, and the text of attributes goes into exported files.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.tablefiles import schema

MAX_LOG_RATIO = 100.0  # of a ratio to the rigid sphere; those of the shipped tables are below 20
MAX_BUCKETS, MAX_STEPS = 4096, 30_000  # of mu, eight an octave, and of X
TERMS = 8  # of a Chebyshev series
LIMITS = {"mu": (0.0, np.inf), "spread": (0.0, np.inf), "sphere": (0.0, 1.0), "hurst": (0.0, 1.0)}
ARGUMENTS = {schema.UNIVERSAL: ("X", "mu"), schema.ISLAND4D: ("delta_over_h_rms", "zeta_d", "zeta_u", "hurst")}
REQUIRED = (
    *("variant", "data_version", "values_sha256", "source_sha256", "certificate_points"),
    *(f"largest_error_{function}" for function in schema.FUNCTIONS),
)


def _matches(pattern: str) -> Callable[[str], bool]:
    return lambda text: re.fullmatch(pattern, text) is not None


# the first pattern that a name matches says what the attribute must be
ATTRIBUTES: tuple[tuple[str, type, Callable[[Any], bool], str], ...] = (
    ("certificate_points|spline_degree", int, lambda value: value > 0, "a whole number above 0"),
    ("target|.*_error_[FA]", float, lambda value: 0 <= value < np.inf, "a finite number, at least 0"),
    ("offset|first|last", float, np.isfinite, "a finite number"),
    (".*_sha256", str, _matches("[0-9a-f]{64}"), "64 hexadecimal digits"),
    ("data_version", str, _matches("[0-9a-f]{12}"), "12 hexadecimal digits"),
    ("variant|mbma_kind|transform", str, _matches("[A-Za-z][A-Za-z0-9_]{0,39}"), "a name"),
    (".*", str, str.isprintable, "printable text"),
)


def check_attribute(owner: str, name: str, value: Any) -> None:
    """Raise ValueError where an attribute of a file (`owner` empty) or of a variable is not what its name says."""
    expected, good, text = next(row[1:] for row in ATTRIBUTES if re.fullmatch(row[0], name))
    if type(value) is not expected or not good(value):
        shown = repr(value)[:60]
        raise ValueError(f"has attribute {owner + ':' if owner else ''}{name} = {shown}, which must be {text}")


def _check_axis(axis: schema.Axis) -> None:
    low, high = LIMITS.get(axis.name, (-np.inf, np.inf))
    positive = axis.low + axis.offset > 0 or axis.transform == "linear"
    # lookups know an offset of X alone
    known = axis.offset == 0 or axis.name == "X"
    if not (positive and known and low <= axis.low < axis.high <= high and axis.nodes > 1):
        raise ValueError(f"has axis {axis.name} from {axis.low:g} to {axis.high:g} with offset {axis.offset:g}")
    if not (np.diff(axis.values) > 0).all():
        raise ValueError(f"has axis {axis.name}, which does not increase")


def _check_nodes(content: schema.TableContent) -> None:
    """Raise ValueError where the values of a table are not over the nodes of its axes."""
    nodes = tuple(axis.nodes for axis in content.axes)
    knots = tuple(count + schema.DEGREE - 1 for count in nodes)
    cells = content.local_error.shape[:-1]
    values = [content.auxiliary[f"log_ratio_{function}"][1] for function in schema.FUNCTIONS]
    if any(array.shape != nodes for array in values) or content.coefficients.shape[:-1] != knots:
        raise ValueError("has values or coefficients that are not over its axes")
    if len(cells) != len(nodes) or not all(0 < count < most for count, most in zip(cells, nodes, strict=True)):
        raise ValueError("has error bounds that are not over its axes")
    if max(np.abs(array).max() for array in (*values, content.coefficients)) > MAX_LOG_RATIO:
        raise ValueError("has values that are not logarithms of ratios")


def _check_cells(content: schema.TableContent) -> None:
    """Raise ValueError unless the cells fill the range in strips of X, in order, each from mu = 0 upwards."""
    X, mu = content.axes
    edges: list[FloatArray] = [content.auxiliary[name][1] for name in schema.CELL_EDGES]
    cells = edges[0].size
    shapes = {array.shape for array in edges}
    if shapes != {(cells,)} or content.coefficients.shape != (cells, TERMS, TERMS, 2) or cells == 0:
        raise ValueError(f"has {schema.COEFFICIENTS[content.kind]} coefficients that are not over its cells")
    if content.local_error.shape != (cells, 2):
        raise ValueError("has error bounds that are not over its cells")
    X_low, X_high, mu_low, mu_high = edges
    starts = mu_low == 0
    # each cell goes on where the one before it ends, up to the end of its strip
    upwards = (mu_low[1:] == mu_high[:-1]) & (X_low[1:] == X_low[:-1]) & (X_high[1:] == X_high[:-1])
    onwards = (mu_high[:-1] == mu.high) & (X_low[1:] == X_high[:-1])
    ends = (X_low[0], X_high[-1], mu_high[-1]) == (X.low, X.high, mu.high) and starts[0] and mu.low == 0
    grows = (X_high > X_low) & (mu_high > mu_low)
    if not (ends and grows.all() and np.where(starts[1:], onwards, upwards).all()):
        raise ValueError("has cells that do not fill its range one after the other")
    steps = (X_low - X.low) * schema.X_STEPS
    lower = mu_low[~starts].view(np.int64)
    if (steps != np.round(steps)).any() or (lower & ((1 << schema.BUCKET_BITS) - 1)).any():
        raise ValueError("has cells whose edges are not where they can be found by arithmetic")
    if np.ptp(np.append(mu_high, mu.high).view(np.int64) >> schema.BUCKET_BITS) >= MAX_BUCKETS or steps[-1] > MAX_STEPS:
        raise ValueError("has cells over too wide a range")


@np.errstate(all="ignore")
def check_content(content: schema.TableContent) -> None:
    """Raise ValueError where the parts of a table do not fit one another."""
    axes = tuple((axis.name, axis.transform) for axis in content.axes)
    if axes != schema.AXES[content.kind]:
        raise ValueError(f"has axes {axes}, not {schema.AXES[content.kind]}")
    for axis in content.axes:
        _check_axis(axis)
    (_check_cells if content.kind == schema.UNIVERSAL else _check_nodes)(content)
    answers = {f"{which}_{function}" for which in ("table", "exact") for function in schema.FUNCTIONS} | {"tolerance"}
    sizes = {values.shape for values in content.conformance.values()}
    if set(content.conformance) != answers | set(ARGUMENTS[content.kind]) or len(sizes) != 1 or len(*sizes) != 1:
        raise ValueError("has incomplete conformance points")
    for name, values in content.arrays().items():
        if not np.isfinite(values).all():
            raise ValueError(f"has variable {name}, which is not finite")
    if (content.local_error < 0).any() or any((content.conformance[name] <= 0).any() for name in answers):
        raise ValueError("has an error bound below 0, or a conformance answer that is not positive")
