"""Ways to hold the islands over four parameters, compared at equal size: the trial's axes and the library's."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.stats import qmc

from generate.tables.configuration import load
from generate.tables.island4d import Island4d
from generate.tables.solves import log_ratio
from mbma_tables.arguments import FloatArray
from mbma_tables.islands.four_numbers import SPHERE_FLOOR, band_fields, from_axes, hat_scales
from mbma_tables.islands.greenwood_tripp import rigid_sphere
from mbma_tables.surfaces.readings import Reading
from mbma_tables.tablefiles.interpolate import cubic, quintic
from mbma_tables.tablefiles.schema import ISLAND4D, Axis
from mbma_tables.tablefiles.splines import coefficients

RTOL = 1e-8  # of the islands, far below the errors compared
POINTS = 3000  # held-out points, half over the box and half at islands of surfaces
FEWEST = 8  # nodes of an axis
BLOCK = 500  # points interpolated at once
TRIAL_SHAPE = (36, 22, 36, 10)
OWN_SHAPE = (30, 50, 8, 15)
SIZES = (12000, 30000, 95000, 286000)
LEAST_SPREADS = (1e-3, 1e-9)  # where the axis of the band's width begins
MOST_WIDE = 95000  # nodes for the second of these
LARGEST_ZETA_D = 1e4
X_RANGE, LARGEST_SPREAD, HURST_RANGE = (0.5, 26.0), 2500.0, (0.3, 1.0)

Raw = tuple[FloatArray, ...]  # X, spread, zeta_d, hurst


@dataclasses.dataclass(frozen=True)
class Grid:
    """Axes of one choice of coordinates, with the way to them and back from X, spread, zeta_d, hurst."""

    axes: tuple[Axis, ...]
    to_own: Callable[..., tuple[Any, ...]]
    from_own: Callable[..., tuple[Any, ...]]

    def sized(self, total: int) -> tuple[Axis, ...]:
        """The axes with at most `total` nodes in all, in the same proportions, none below `FEWEST`."""
        counts = np.array([axis.nodes for axis in self.axes], dtype=float)

        def at(scale: float) -> Any:
            return np.maximum(np.round(counts * scale), FEWEST).astype(int)

        scales = np.geomspace(0.05, 5, 2000)
        fitting = [scale for scale in scales if math.prod(map(int, at(scale))) <= total]
        return tuple(
            dataclasses.replace(axis, nodes=int(n)) for axis, n in zip(self.axes, at(fitting[-1]), strict=True)
        )


@dataclasses.dataclass(frozen=True)
class Row:
    """Largest errors: cubic over box and visited islands, quintic over box and visited islands."""

    least: float
    shape: tuple[int, ...]
    scheme: str
    errors: tuple[float, float, float, float]

    @property
    def nodes(self) -> int:
        """Nodes in all."""
        return math.prod(self.shape)


def _axis(name: str, transform: str, offset: float, ends: tuple[float, float], nodes: int) -> Axis:
    return Axis(name, name, transform, offset, *ends, nodes)  # type: ignore[arg-type]


def _own_sphere(zeta_d: FloatArray, hurst: FloatArray) -> Any:
    return (SPHERE_FLOOR / zeta_d) ** (4 - 2 * hurst)


def trial_grid(least: float) -> Grid:
    """ln X, ln zeta_d, ln ln(zeta_u/zeta_d), H."""
    widths = (math.log1p(least), math.log1p(LARGEST_SPREAD))
    ends = (X_RANGE, (1.5, LARGEST_ZETA_D), widths, HURST_RANGE)
    rows = zip(("X", "zeta_d", "width", "H"), ("log", "log", "log", "linear"), ends, TRIAL_SHAPE, strict=True)
    return Grid(
        tuple(_axis(name, transform, 0.0, pair, nodes) for name, transform, pair, nodes in rows),
        lambda X, spread, zeta_d, hurst: (X, zeta_d, np.log1p(spread), hurst),
        lambda X, zeta_d, width, hurst: (X, np.expm1(width), zeta_d, hurst),
    )


def own_grid(least: float) -> Grid:
    """log(X + 3), log spread, sphere, H."""
    ends = (X_RANGE, (least, LARGEST_SPREAD), (0.0, 1.0), HURST_RANGE)
    rows = zip(
        ("X", "spread", "sphere", "H"),
        ("log", "log", "linear", "linear"),
        (3.0, 0.0, 0.0, 0.0),
        ends,
        OWN_SHAPE,
        strict=True,
    )
    return Grid(
        tuple(_axis(*row) for row in rows),
        lambda X, spread, zeta_d, hurst: (X, spread, _own_sphere(zeta_d, hurst), hurst),
        lambda X, spread, sphere, hurst: (X, spread, from_axes(sphere, hurst), hurst),
    )


@functools.cache
def reading() -> Reading:
    """The reading of the shipped configuration."""
    return Island4d(load(ISLAND4D)).reading


def exact(raw: Raw) -> FloatArray:
    """Log ratio to the rigid sphere, shape (islands, 2)."""
    X, spread, zeta_d, hurst = raw
    return log_ratio(X, band_fields(spread, _own_sphere(zeta_d, hurst), hurst, reading())[0], RTOL)


def log_rigid_hats(raw: Raw) -> FloatArray:
    """Logarithms of F_hat and A_hat of the rigid sphere, shape (islands, 2)."""
    X, spread, zeta_d, hurst = raw
    mu, sigma, _ = band_fields(spread, _own_sphere(zeta_d, hurst), hurst, reading())
    scales = np.stack(hat_scales(spread, zeta_d, hurst, sigma, reading()))
    logs: FloatArray = np.log(scales * rigid_sphere(X, mu)).T
    return logs


def spline_at(coefs: FloatArray, positions: Sequence[FloatArray], degree: int) -> FloatArray:
    """A tensor spline of any number of axes at positions in node units, last axis F, A."""
    compiled: Any = cubic if degree == 3 else quintic
    rule = compiled.py_func
    parts = []
    for start in range(0, positions[0].size, BLOCK):
        index, weights = [], []
        for number, position in enumerate(positions):
            p = position[start : start + BLOCK]
            first = np.minimum(p.astype(int), coefs.shape[number] - degree - 1)
            along = [1] * len(positions)
            along[number] = degree + 1
            index.append((first[:, None] + np.arange(degree + 1)).reshape(-1, *along))
            weights.append(np.stack(rule(p - first), axis=1))
        block = coefs[tuple(index)]
        for w in weights:
            block = np.einsum("pk,pk...->p...", w, block)
        parts.append(block)
    return np.concatenate(parts)


@functools.cache
def held_out(least: float) -> tuple[Raw, FloatArray]:
    """Islands on which grids are compared, first over the box and then of surfaces, and their log ratios."""
    half = POINTS // 2
    places = qmc.Halton(4, seed=11).random(half).T
    ends = (X_RANGE, (least, LARGEST_SPREAD), (1.5, LARGEST_ZETA_D))
    box = [low * (high / low) ** u for (low, high), u in zip(ends, places[:3], strict=True)]
    box.append(HURST_RANGE[0] + (HURST_RANGE[1] - HURST_RANGE[0]) * places[3])
    X, spread, sphere, hurst = Island4d(load(ISLAND4D)).manifold(3 * half)
    zeta_d = np.clip(from_axes(sphere, hurst), 1.5, LARGEST_ZETA_D)
    kept = np.flatnonzero(spread > least)[:half]
    visited = [array[kept] for array in (X, spread, zeta_d, hurst)]
    raw = tuple(np.concatenate(pair) for pair in zip(box, visited, strict=True))
    return raw, exact(raw)


def rows_of(grid: Grid, names: dict[str, bool], least: float, total: int) -> list[Row]:
    """Errors on one grid: `names` of schemes, and whether each holds the log ratio or log F_hat and log A_hat."""
    axes = grid.sized(total)
    shape = tuple(axis.nodes for axis in axes)
    own = np.meshgrid(*(axis.values for axis in axes), indexing="ij")
    raw = tuple(np.ascontiguousarray(r).ravel() for r in np.broadcast_arrays(*grid.from_own(*own)))
    ratio = exact(raw)
    points, truth = held_out(least)
    positions = [
        # rounding may put an end a hair outside
        np.clip(axis.position(x), 0, axis.nodes - 1)
        for axis, x in zip(axes, grid.to_own(*points), strict=True)
    ]
    rows = []
    for name, holds_ratio in names.items():
        values, wanted = (
            (ratio, truth) if holds_ratio else (ratio + log_rigid_hats(raw), truth + log_rigid_hats(points))
        )
        errors: list[float] = []
        for degree in (3, 5):
            coefs = coefficients(values.reshape(*shape, 2), degree, len(shape))
            error = np.abs(np.expm1(spline_at(coefs, positions, degree) - wanted))
            errors += [float(error[: POINTS // 2].max()), float(error[POINTS // 2 :].max())]
        rows.append(Row(least, shape, name, tuple(errors)))  # type: ignore[arg-type]
    return rows


@functools.cache
def compare(largest: int) -> tuple[Row, ...]:
    """The three schemes at every size up to `largest`."""
    rows: list[Row] = []
    for least in LEAST_SPREADS:
        for total in SIZES:
            if total > largest or (least == LEAST_SPREADS[1] and total > MOST_WIDE):
                continue
            rows += rows_of(
                trial_grid(least), {"trial's axes, log F": False, "trial's axes, log ratio": True}, least, total
            )
            rows += rows_of(own_grid(least), {"library's axes, log ratio": True}, least, total)
    return tuple(rows)
