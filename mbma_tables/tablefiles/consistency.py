"""Whether the parts of a table fit one another, as compiled code that looks them up takes for granted."""

from __future__ import annotations

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.tablefiles.schema import FUNCTIONS, ISLAND4D, UNIVERSAL, Axis, TableContent
from mbma_tables.tablefiles.splines import padding

TRANSFORMS = {
    UNIVERSAL: {"X": "log", "mu": "log"},
    ISLAND4D: {"X": "log", "spread": "log", "sphere": "linear", "hurst": "linear"},
}
LIMITS = {"spread": (0.0, np.inf), "sphere": (0.0, 1.0), "hurst": (0.0, 1.0)}
ISLANDS = ("delta_over_h_rms", "zeta_d", "zeta_u", "hurst")
POINTS = {UNIVERSAL: {"X", "mu"}, ISLAND4D: set(ISLANDS)}
TEXTS = ("reading", "data_version", "physics_sha256")
NUMBERS = ("largest_error_F", "largest_error_A")
LARGEST_LOGARITHM = 100.0  # of a ratio to the rigid sphere; those of the shipped tables are below 20
ANSWERS = (1e-250, 1e250)


def _is_axis(axis: Axis) -> bool:
    with np.errstate(all="ignore"):
        ends = np.array([axis.low + axis.offset, axis.high + axis.offset])
        if not np.isfinite(ends).all() or (axis.transform == "log" and ends[0] <= 0):
            return False
        low, high = LIMITS.get(axis.name, (-np.inf, np.inf))
        if axis.low < low or axis.high > high:
            return False
        # of the axes only X has an offset, which the compiled lookups rely on
        return axis.nodes > 1 and bool((np.diff(axis.values) > 0).all()) and (axis.name == "X" or axis.offset == 0)


def _are_in_the_table(content: TableContent) -> bool:
    """Whether conformance points lie where the table answers."""
    points = content.conformance
    stored = np.stack([points[f"{which}_{function}"] for which in ("table", "exact") for function in FUNCTIONS])
    # a NaN among them is told with the point by whoever replays them
    good = ~np.any((stored < ANSWERS[0]) | (stored > ANSWERS[1]), axis=0) & (points["tolerance"] > 0)
    places: tuple[FloatArray, ...]
    if content.kind == UNIVERSAL:
        places = points["X"], points["mu"]
    else:
        from mbma_tables.islands.four_numbers import to_axes
        from mbma_tables.surfaces.readings import get_reading

        delta, low, high, hurst = (points[name] for name in ISLANDS)
        good &= (delta > 0) & (low > 1) & (high > low) & (hurst > 0) & (hurst <= 1)
        if not good.all():
            return False
        places = to_axes(delta, low, high, hurst, get_reading(content.attributes["reading"])).axes
    for axis, place in zip(content.axes, places, strict=True):
        position = axis.position(place)
        good &= (position > -0.5) & (position < axis.nodes - 0.5)
    return bool(good.all())


def _are_logarithms(values: FloatArray) -> bool:
    return bool((np.abs(values) <= LARGEST_LOGARITHM).all())


def misfit(content: TableContent) -> str:
    """What does not fit; empty where all does."""
    names = {axis.name: axis.transform for axis in content.axes}
    if names != TRANSFORMS[content.kind] or list(names) != list(TRANSFORMS[content.kind]):
        return f"its axes are {names}, not {TRANSFORMS[content.kind]}"
    for axis in content.axes:
        if not _is_axis(axis):
            return f"axis {axis.name} does not rise, or leaves where there are islands"
    nodes = tuple(axis.nodes for axis in content.axes)
    knots = tuple(count + 2 * padding(content.degree) for count in nodes)
    cells = content.local_error.shape[:-1]
    if content.log_ratio.shape[:-1] != nodes or content.coefficients.shape[:-1] != knots:
        return "its values and coefficients are not over its axes"
    if len(cells) != len(nodes) or not all(0 < count < most for count, most in zip(cells, nodes, strict=True)):
        return "its errors are not over its axes"
    given = POINTS[content.kind] | {f"{which}_{f}" for which in ("table", "exact") for f in FUNCTIONS} | {"tolerance"}
    sizes = {values.shape for values in content.conformance.values()}
    if set(content.conformance) != given or len(sizes) != 1 or len(*sizes) != 1:
        return "its conformance points are not complete"
    texts = all(isinstance(content.attributes.get(name), str) for name in TEXTS)
    if not texts or not all(isinstance(content.attributes.get(name), float) for name in NUMBERS):
        return f"it lacks some of the attributes {', '.join(TEXTS + NUMBERS)}"
    numbers = [value for value in content.attributes.values() if isinstance(value, float)]
    if not np.isfinite(numbers).all() or not np.isfinite(content.local_error).all() or (content.local_error < 0).any():
        return "some of its numbers are not finite, or errors below zero"
    if not _are_logarithms(content.log_ratio) or not _are_logarithms(content.coefficients):
        return "its values are no logarithms of ratios"
    with np.errstate(all="ignore"):
        if not _are_in_the_table(content):
            return "its conformance points lie outside it"
    return ""
