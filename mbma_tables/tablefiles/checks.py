"""What a table file may hold: the type of every attribute, and how the parts of a table fit one another.

Compiled code takes for granted what is checked here, and the text of attributes goes into exported files.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np

from mbma_tables.tablefiles.schema import FUNCTIONS, ISLAND4D, UNIVERSAL, Axis, TableContent
from mbma_tables.tablefiles.splines import padding

MAX_LOG_RATIO = 100.0  # of a ratio to the rigid sphere; those of the shipped tables are below 20
AXES = {
    UNIVERSAL: (("X", "log"), ("mu", "log")),
    ISLAND4D: (("X", "log"), ("spread", "log"), ("sphere", "linear"), ("hurst", "linear")),
}
LIMITS = {"spread": (0.0, np.inf), "sphere": (0.0, 1.0), "hurst": (0.0, 1.0)}
ARGUMENTS = {UNIVERSAL: ("X", "mu"), ISLAND4D: ("delta_over_h_rms", "zeta_d", "zeta_u", "hurst")}
REQUIRED = (
    *("reading", "data_version", "values_sha256", "source_sha256", "certificate_points"),
    *(f"largest_error_{function}" for function in FUNCTIONS),
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
    ("reading|mbma_kind|transform", str, _matches("[A-Za-z][A-Za-z0-9_]{0,39}"), "a name"),
    (".*", str, str.isprintable, "printable text"),
)


def check_attribute(owner: str, name: str, value: Any) -> None:
    """Raise ValueError where an attribute of a file (`owner` empty) or of a variable is not what its name says."""
    expected, good, text = next(row[1:] for row in ATTRIBUTES if re.fullmatch(row[0], name))
    if type(value) is not expected or not good(value):
        shown = repr(value)[:60]
        raise ValueError(f"has attribute {owner + ':' if owner else ''}{name} = {shown}, which must be {text}")


def _check_axis(axis: Axis) -> None:
    low, high = LIMITS.get(axis.name, (-np.inf, np.inf))
    positive = axis.low + axis.offset > 0 or axis.transform == "linear"
    # compiled lookups know an offset of X alone
    known = axis.offset == 0 or axis.name == "X"
    if not (positive and known and low <= axis.low < axis.high <= high and axis.nodes > 1):
        raise ValueError(f"has axis {axis.name} from {axis.low:g} to {axis.high:g} with offset {axis.offset:g}")
    if not (np.diff(axis.values) > 0).all():
        raise ValueError(f"has axis {axis.name}, which does not increase")


@np.errstate(all="ignore")
def check_content(content: TableContent) -> None:
    """Raise ValueError where the parts of a table do not fit one another."""
    axes = tuple((axis.name, axis.transform) for axis in content.axes)
    if axes != AXES[content.kind]:
        raise ValueError(f"has axes {axes}, not {AXES[content.kind]}")
    for axis in content.axes:
        _check_axis(axis)
    nodes = tuple(axis.nodes for axis in content.axes)
    knots = tuple(count + 2 * padding(content.degree) for count in nodes)
    cells = content.local_error.shape[:-1]
    if content.log_ratio.shape[:-1] != nodes or content.coefficients.shape[:-1] != knots:
        raise ValueError("has values or coefficients that are not over its axes")
    if len(cells) != len(nodes) or not all(0 < count < most for count, most in zip(cells, nodes, strict=True)):
        raise ValueError("has error bounds that are not over its axes")
    answers = {f"{which}_{function}" for which in ("table", "exact") for function in FUNCTIONS} | {"tolerance"}
    sizes = {values.shape for values in content.conformance.values()}
    if set(content.conformance) != answers | set(ARGUMENTS[content.kind]) or len(sizes) != 1 or len(*sizes) != 1:
        raise ValueError("has incomplete conformance points")
    for name, values in content.arrays().items():
        if not np.isfinite(values).all():
            raise ValueError(f"has variable {name}, which is not finite")
    if max(np.abs(content.log_ratio).max(), np.abs(content.coefficients).max()) > MAX_LOG_RATIO:
        raise ValueError("has values that are not logarithms of ratios")
    if (content.local_error < 0).any() or any((content.conformance[name] <= 0).any() for name in answers):
        raise ValueError("has an error bound below 0, or a conformance answer that is not positive")
