"""Islands solved per second, Newton against the classical iteration, and the cost of the import.

Run with ``python benchmarks/islands.py``. One core; every ratio is of two times taken in this run.
"""

from __future__ import annotations

import os

os.environ["NUMBA_NUM_THREADS"] = "1"
os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import functools
import itertools
import math
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from mbma_tables import Surface, greenwood_tripp
from mbma_tables.islands.classical import iterate, ring_matrix
from mbma_tables.islands.geometry import geometry
from mbma_tables.islands.newton import extent_squared
from mbma_tables.surfaces.readings import READINGS
from mbma_tables.totals.gauss_kronrod import NODES_21 as NODES
from mbma_tables.totals.island_sum import kinks

SPLITS = 8  # intervals between two kinks, each with the quadrature's 21 nodes
RINGS = (25, 50, 100, 200, 400, 800, 1600)
TARGETS = (1e-3, 1e-4, 1e-5, 1e-6)
SAMPLES = 12  # islands on which the two methods are compared
DAMPING = 0.3
MAX_MU = 1e6  # beyond what the model visits at H >= 0.1 and zeta_1 <= 1e6


def seconds(run: Callable[[], Any], repeats: int = 5) -> float:
    """The shortest of several times; the first call, which compiles, is not counted."""
    run()
    taken = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        taken.append(time.perf_counter() - start)
    return min(taken)


def visited_islands() -> tuple[np.ndarray, np.ndarray]:
    """(X, mu) at quadrature nodes of the Yang-Persson surface, delta in (0, 2 h_max], both readings."""
    surface = Surface.named("yang-persson")
    layer = surface.zeta_1**-surface.hurst
    reach = 2 * surface.h_max / surface.h_rms
    found = []
    for reading in READINGS.values():
        breaks = [0.0, *(k for k in kinks(surface.hurst, surface.zeta_1, reading) if k < reach), reach]
        ends = np.arcsinh(np.sqrt(np.array(breaks) / layer))
        edges = np.concatenate(
            [np.linspace(low, high, SPLITS + 1)[:-1] for low, high in itertools.pairwise(ends)] + [ends[-1:]]
        )
        t = ((edges[1:] + edges[:-1])[:, None] + np.diff(edges)[:, None] * NODES).ravel() / 2
        approach = layer * np.sinh(t) ** 2
        g = geometry(
            approach,
            np.full_like(approach, surface.hurst),
            np.full_like(approach, surface.zeta_1),
            reading,
        )
        found.append((g["X"], g["mu"]))
    X, mu = (np.concatenate(part) for part in zip(*found, strict=True))
    return X, mu


def largest_error(phi_F: np.ndarray, phi_A: np.ndarray, exact: greenwood_tripp.IslandSolution) -> float:
    """Largest relative error of force and area."""
    return float(max(np.abs(phi_F / exact.phi_F - 1).max(), np.abs(phi_A / exact.phi_A - 1).max()))


def newton_rate(X: np.ndarray, mu: np.ndarray) -> None:
    """Print islands per second of Newton at several tolerances."""
    exact = greenwood_tripp.solve(X, mu, rtol=1e-13)
    many_X, many_mu = np.tile(X, 5), np.tile(mu, 5)
    print(f"Newton on {X.size} islands of the Yang-Persson surface, mu up to {mu.max():.2g}")
    print("  rtol     islands/s   largest error   nodes (median)")
    for rtol in (1e-4, 1e-6, 1e-9, 1e-12):
        solved = greenwood_tripp.solve(X, mu, rtol=rtol)
        error = largest_error(solved.phi_F, solved.phi_A, exact)
        rate = many_X.size / seconds(functools.partial(greenwood_tripp.solve, many_X, many_mu, rtol=rtol))
        print(f"  {rtol:.0e}   {rate:9.0f}   {error:13.1e}   {np.median(solved.nodes):6.0f}")


def classical_run(
    X: np.ndarray, mu: np.ndarray, matrix: np.ndarray, tolerance: float, damping: float, steps: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Converged, Phi_F and Phi_A of each island; the matrix is made beforehand, and not timed."""
    n = len(matrix)
    w, p = np.empty(n), np.empty(n)
    rows = []
    for x, m in zip(X, mu, strict=True):
        a = math.sqrt(extent_squared(x, m, 0.1 * tolerance))
        rows.append(iterate(x, m, a, matrix, damping, tolerance, steps, w, p)[1:])
    converged, force, area = (np.array(column) for column in zip(*rows, strict=True))
    return converged, force, area


def equal_accuracy(X: np.ndarray, mu: np.ndarray) -> None:
    """Print times of both methods at the same largest error."""
    chosen = np.linspace(0, X.size - 1, SAMPLES).astype(int)
    X, mu = X[chosen], mu[chosen]
    exact = greenwood_tripp.solve(X, mu, rtol=1e-13)
    many_X, many_mu = np.tile(X, 200), np.tile(mu, 200)
    print(f"\nClassical iteration (damping {DAMPING}) against Newton, {SAMPLES} of these islands")
    print("  target   rings   error      us/island   Newton: error   us/island   time ratio")
    for target in TARGETS:
        solved = greenwood_tripp.solve(X, mu, rtol=target)
        newton_error = largest_error(solved.phi_F, solved.phi_A, exact)
        newton_time = seconds(functools.partial(greenwood_tripp.solve, many_X, many_mu, rtol=target)) / many_X.size
        error = math.inf
        for rings in RINGS:
            matrix = ring_matrix(rings)
            converged, force, area = classical_run(X, mu, matrix, 0.1 * target, DAMPING, 5000)
            if not converged.all():
                break
            error = largest_error(force, area, exact)
            if error <= target:
                break
        head = f"  {target:.0e}   {rings:5d}   {error:.1e}"
        tail = f"{newton_error:13.1e}   {1e6 * newton_time:9.1f}"
        if error <= target:
            run = functools.partial(classical_run, X, mu, matrix, 0.1 * target, DAMPING, 5000)
            spent = seconds(run, repeats=3) / X.size
            print(f"{head}    {1e6 * spent:9.0f}   {tail}   {spent / newton_time:10.0f}")
        else:
            print(f"{head}    not reached   {tail}            -")


def divergence() -> None:
    """Print the mu up to which the classical iteration converges."""
    dampings = (1.0, 0.3, 0.1, 0.03)
    matrix = ring_matrix(50)
    print("\nLargest mu at which the classical iteration converges (50 rings, to 1e-6, 100/damping steps)")
    print("      X " + "".join(f"  damping {damping:<5g}" for damping in dampings))
    for X in (0.0, 2.0, 5.0, 10.0, 20.0):
        row = []
        for damping in dampings:
            low, high = math.log(1e-4), math.log(MAX_MU)
            while high - low > 0.01:
                middle = (low + high) / 2
                good = classical_run(
                    np.array([X]),
                    np.array([math.exp(middle)]),
                    matrix,
                    1e-6,
                    damping,
                    round(100 / damping),
                )[0][0]
                low, high = (middle, high) if good else (low, middle)
            row.append(f"{math.exp(low):.2g}" if high < math.log(MAX_MU) else f"over {MAX_MU:.0e}")
        print(f"  {X:5g} " + "".join(f"  {value:>13}" for value in row))


def import_time() -> None:
    """Print the median time of the import in a new interpreter."""
    print("\nImport in a new interpreter, median of 5")
    for what in ("import mbma_tables", "from mbma_tables import Surface, contact"):
        code = f"import time; t = time.perf_counter(); {what}; print(time.perf_counter() - t)"
        taken = [float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(5)]
        print(f"  {what}: {statistics.median(taken):.3f} s")


if __name__ == "__main__":
    islands = visited_islands()
    newton_rate(*islands)
    equal_accuracy(*islands)
    divergence()
    import_time()
