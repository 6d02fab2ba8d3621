"""What islands cost: every way to solve or look up one, on islands that made no table."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from scipy.stats import qmc

from generate.tables.solves import log_ratio
from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import njit
from mbma_tables.errors import ConvergenceError
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.classical import iterate, ring_matrix
from mbma_tables.islands.four_numbers import Coordinates, band_fields
from mbma_tables.islands.newton import extent_squared
from mbma_tables.models import TIERS, get_model
from mbma_tables.models.closed_forms import FormulaModel
from mbma_tables.models.island4d import Island4dModel
from mbma_tables.models.protocol import IslandAnswer
from mbma_tables.models.universal import UniversalModel, shipped
from mbma_tables.scenes.costs import Row, measure, variant
from mbma_tables.surfaces.readings import get_reading
from mbma_tables.tablefiles.netcdf import read_table
from mbma_tables.tablefiles.schema import ISLAND4D, UNIVERSAL, TableContent
from mbma_tables.tablefiles.splines import coefficients
from mbma_tables.totals.island import geometry

ISLANDS = 1000  # looked up in a batch
HARD = 12  # of them, for the classical iteration
PROFILES = 20
REFERENCE_RTOL = 1e-12
SEED = 2026
RANGES = ((0.32, 0.7, -4.0), (0.98, 3.9, 0.9))  # H, log10 zeta_1, log10 delta/h_rms
DAMPING, MOST_STEPS = 0.1, 5000
MESHES = {25: (1e-2, 1e-4), 50: (1e-3,), 100: (1e-2, 1e-4, 1e-6), 200: (1e-5,), 400: (1e-6,), 800: (1e-7,)}
FINEST_MESH = {1600: (1e-8,)}
NEWTON_RTOLS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
NEWTON_NODES = (8, 12, 16, 24, 32, 48, 64, 96)
UNIVERSAL_SHARES = (0.06, 0.12, 0.25, 0.5)  # of the shipped table's nodes along each axis
ISLAND4D_SHAPES = ((9, 16, 8, 8), (16, 27, 8, 8))

FORMS = ("pocket", "standard", "long")

Islands = dict[str, FloatArray]


@dataclasses.dataclass(frozen=True)
class HeldOut:
    """Islands of surfaces that made no table, and their Phi_F and Phi_A (2, islands) on twice the nodes."""

    islands: Islands
    truth: FloatArray

    def error(self, phi_F: FloatArray, phi_A: FloatArray, chosen: Any = slice(None)) -> float:
        """Largest relative error of both."""
        return float(np.abs(np.stack([phi_F, phi_A]) / self.truth[:, chosen] - 1).max())


@functools.cache
def held_out(count: int = ISLANDS) -> HeldOut:
    """Islands of random surfaces, reading reported."""
    hurst, log_zeta, log_approach = qmc.scale(qmc.Halton(3, seed=SEED).random(count), *RANGES).T
    fields = geometry(10**log_approach, hurst, 10**log_zeta, get_reading("reported"))
    ratio = log_ratio(fields["X"], fields["mu"], REFERENCE_RTOL, 2)
    return HeldOut(fields | {"hurst": hurst}, np.exp(ratio).T * greenwood_tripp.rigid_sphere(fields["X"], fields["mu"]))


def classical(X: FloatArray, mu: FloatArray, matrix: FloatArray, tolerance: float) -> tuple[Any, ...]:
    """Steps, converged, Phi_F and Phi_A of islands; the matrix is made beforehand, and not timed."""
    rings = len(matrix)
    w, p = np.empty(rings), np.empty(rings)
    rows = [
        iterate(x, m, math.sqrt(extent_squared(x, m, 0.03 * tolerance)), matrix, DAMPING, tolerance, MOST_STEPS, w, p)
        for x, m in zip(X, mu, strict=True)
    ]
    return tuple(np.array(column) for column in zip(*rows, strict=True))


def classical_rows(quick: bool) -> Iterator[Row]:
    """The damped iteration at several meshes and tolerances."""
    held = held_out()
    chosen = np.linspace(0, ISLANDS - 1, HARD).astype(int)
    X, mu = held.islands["X"][chosen], held.islands["mu"][chosen]
    for rings, tolerances in (MESHES if quick else MESHES | FINEST_MESH).items():
        matrix = ring_matrix(rings)
        for tolerance in tolerances:
            steps, converged, force, area = classical(X, mu, matrix, tolerance)
            if not converged.all():
                raise ConvergenceError(f"the classical iteration on {rings} rings did not converge", ~converged)
            cost, _ = measure(functools.partial(classical, X, mu, matrix, tolerance))
            pressures = rings * (float(steps.mean()) + 1)
            error = held.error(force, area, chosen)
            yield Row("classical", variant(f"rings={rings}", tolerance), "both", error, cost / HARD, pressures)


def newton_rows(quick: bool) -> Iterator[Row]:
    """Newton to several tolerances, and on several numbers of nodes."""
    held = held_out()
    chosen = np.arange(0, ISLANDS, 10 if quick else 4)
    X, mu = held.islands["X"][chosen], held.islands["mu"][chosen]
    ways: list[tuple[str, dict[str, Any]]] = [
        (variant("island", rtol), {"rtol": max(0.1 * rtol, greenwood_tripp.TIGHTEST)}) for rtol in NEWTON_RTOLS
    ]
    ways += [(f"nodes={nodes}", {"rtol": 1e-11, "nodes": nodes}) for nodes in NEWTON_NODES]
    for name, options in ways:
        solved = greenwood_tripp.solve(X, mu, **options)
        cost, _ = measure(functools.partial(greenwood_tripp.solve, X, mu, **options))
        pressures = float((solved.nodes * (solved.iterations + 1)).mean())
        error = held.error(solved.phi_F, solved.phi_A, chosen)
        yield Row("exact", name, "both", error, cost / X.size, pressures)
    for rtol in (1e-4, 1e-8):
        cost, _ = measure(functools.partial(_profiles, X[:PROFILES], mu[:PROFILES], rtol))
        yield Row("exact", variant("profile", rtol), "both", None, cost / PROFILES)


def _profiles(X: FloatArray, mu: FloatArray, rtol: float) -> FloatArray:
    return greenwood_tripp.solve(X, mu, rtol=rtol).pressure


def looked_up(model: Any) -> tuple[float, float]:
    """Error and cost of an island of any model, in one batch."""
    held = held_out()
    answer: IslandAnswer = model.of_islands(held.islands)
    cost, _ = measure(lambda: model.of_islands(held.islands))
    return held.error(answer.phi_F, answer.phi_A), cost / ISLANDS


def tier_rows() -> Iterator[Row]:
    """The shipped tiers."""
    for tier in TIERS:
        if tier != "exact":
            error, cost = looked_up(get_model(tier, 1e-8, get_reading("reported")))
            yield Row(tier, "island", "both", error, cost, 2)


def resized(content: TableContent, ratio: FloatArray, axes: Any, degree: int) -> TableContent:
    """A table of another resolution in memory, for timing and errors only: its error field says nothing."""
    return dataclasses.replace(
        content,
        axes=axes,
        log_ratio=ratio,
        coefficients=coefficients(ratio, degree, len(axes)),
        local_error=np.zeros((*(axis.nodes - 1 for axis in axes), 2)),
    )


def universal_rows(quick: bool) -> Iterator[Row]:
    """The universal table at several resolutions; the shipped one is among the tiers."""
    content = read_table(shipped(UNIVERSAL), UNIVERSAL)
    for share in UNIVERSAL_SHARES[: 2 if quick else None]:
        axes = tuple(dataclasses.replace(axis, nodes=round(share * axis.nodes)) for axis in content.axes)
        X, mu = (g.ravel() for g in np.meshgrid(*(axis.values for axis in axes), indexing="ij"))
        shape = tuple(axis.nodes for axis in axes)
        ratio = log_ratio(X, mu, 1e-11).reshape(*shape, 2)
        error, cost = looked_up(UniversalModel(resized(content, ratio, axes, 5)))
        yield Row("universal", f"island nodes={shape[0]}x{shape[1]}", "both", error, cost, 2)


@njit(cache=True, error_model="numpy")
def _fill_linear(table: FloatArray, positions: FloatArray, out: FloatArray) -> None:
    """Linear interpolation between the 16 nodes around each position."""
    cell, share = np.empty(4, dtype=np.int64), np.empty((4, 2))
    for k in range(positions.shape[1]):
        for axis in range(4):
            cell[axis] = min(int(positions[axis, k]), table.shape[axis] - 2)
            share[axis, 1] = positions[axis, k] - cell[axis]
            share[axis, 0] = 1.0 - share[axis, 1]
        force = area = 0.0
        for corner in range(16):
            a, b, c, d = corner & 1, (corner >> 1) & 1, (corner >> 2) & 1, corner >> 3
            weight = share[0, a] * share[1, b] * share[2, c] * share[3, d]
            force += weight * table[cell[0] + a, cell[1] + b, cell[2] + c, cell[3] + d, 0]
            area += weight * table[cell[0] + a, cell[1] + b, cell[2] + c, cell[3] + d, 1]
        out[0, k], out[1, k] = force, area


class LinearModel(Island4dModel):
    """The four-parameter table read linearly between its nodes."""

    def log_ratio(self, place: Coordinates, parallel: bool = False) -> FloatArray:
        """log(Phi/Phi_rigid), shape (2, entries)."""
        out = np.empty((2, place.X.size))
        _fill_linear(self.content.log_ratio, self._positions(place), out)
        scaled: FloatArray = out * self._share(place)
        return scaled


def _shape(content: TableContent) -> str:
    return "x".join(str(axis.nodes) for axis in content.axes)


def island4d_rows(quick: bool) -> Iterator[Row]:
    """The four-parameter table at several resolutions, read with splines and linearly."""
    content = read_table(shipped(ISLAND4D), ISLAND4D)
    error, cost = looked_up(LinearModel(content))
    yield Row("island4d", f"island linear nodes={_shape(content)}", "both", error, cost, 2)
    for shape in ISLAND4D_SHAPES[: 1 if quick else None]:
        axes = tuple(dataclasses.replace(axis, nodes=n) for axis, n in zip(content.axes, shape, strict=True))
        X, spread, sphere, hurst = (g.ravel() for g in np.meshgrid(*(axis.values for axis in axes), indexing="ij"))
        mu = band_fields(spread, sphere, hurst, get_reading("reported"))[0]
        smaller = resized(content, log_ratio(X, mu, 1e-8).reshape(*shape, 2), axes, 3)
        models: dict[str, Callable[[TableContent], Island4dModel]] = {"cubic": Island4dModel, "linear": LinearModel}
        for scheme, model in models.items():
            error, cost = looked_up(model(smaller))
            yield Row("island4d", f"island {scheme} nodes={_shape(smaller)}", "both", error, cost, 2)


def formula_rows() -> Iterator[Row]:
    """Each form of the formula file."""
    for name in FORMS:
        error, cost = looked_up(FormulaModel(name))
        yield Row("formula", f"island form={name}", "both", error, cost, 2)


def island_rows(quick: bool) -> list[Row]:
    """Everything that answers an island."""
    return [
        *tier_rows(),
        *formula_rows(),
        *universal_rows(quick),
        *island4d_rows(quick),
        *newton_rows(quick),
        *classical_rows(quick),
    ]
