"""Exported C timed against the library: islands and totals, both in this process.

Run with ``python benchmarks/exports.py``. One core; the C source is compiled into a shared library and called on the
same arrays; every ratio is of two times taken in turn in this run, the median over the rounds, so that what else the
machine does falls on both.
"""

from __future__ import annotations

import os

os.environ["NUMBA_NUM_THREADS"] = "1"

import ctypes
import pathlib
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from mbma_tables import Surface, contact
from mbma_tables.export.code import write_code
from mbma_tables.models.tables import universal_model

ROUNDS = 15
POINTS = 20_000
GAPS = 200
RTOL = 1e-8
SEED = 11
OPTIONS = {
    "-O2": ("-std=c99", "-O2"),
    "-O3 -march=native": ("-std=c99", "-O3", "-march=native"),
    "-O3 -march=native -ffp-contract=fast": ("-std=c99", "-O3", "-march=native", "-ffp-contract=fast"),
}


class CSurface(ctypes.Structure):
    """`mbma_surface`."""

    _fields_ = [(name, ctypes.c_double) for name in ("hurst", "q0", "q1", "h_rms", "h_max")]


def in_turn(runs: list[Callable[[], Any]]) -> list[list[float]]:
    """Times of each, taken in turn; the first call of each is not counted."""
    for run in runs:
        run()
    taken: list[list[float]] = [[] for _ in runs]
    for _ in range(ROUNDS):
        for run, times in zip(runs, taken, strict=True):
            start = time.perf_counter()
            run()
            times.append(time.perf_counter() - start)
    return taken


def compiled(folder: pathlib.Path, number: int, options: tuple[str, ...]) -> ctypes.CDLL:
    """The exported C as a shared library."""
    target = folder / f"mbma_{number}.so"
    subprocess.run(["cc", *options, "-shared", "-fPIC", str(folder / "mbma.c"), "-lm", "-o", str(target)], check=True)
    return ctypes.CDLL(str(target))


def pointer(array: np.ndarray) -> ctypes.c_void_p:
    """Where an array's numbers lie."""
    return ctypes.c_void_p(array.ctypes.data)


def largest(found: np.ndarray, *known: np.ndarray) -> float:
    """The largest relative difference of columns from what is known."""
    return float(np.abs(found[:, : len(known)].T / np.stack(known) - 1).max())


def report(what: str, count: int, names: list[str], taken: list[list[float]]) -> None:
    """Nanoseconds an entry, and the ratio of Python's time to C's."""
    library = taken[0]
    print(f"{what}: library {statistics.median(library) / count * 1e9:.0f} ns")
    for name, times in zip(names, taken[1:], strict=True):
        ratio = statistics.median(python / c for python, c in zip(library, times, strict=True))
        print(f"  C {name}: {statistics.median(times) / count * 1e9:.0f} ns, {ratio:.2f} x as fast")


def main() -> None:
    """Time islands at random (X, mu), and totals of one surface at many gaps."""
    rng = np.random.default_rng(SEED)
    model = universal_model()
    X, mu = rng.uniform(-5.0, 40.0, POINTS), np.exp(rng.uniform(np.log(1e-7), np.log(1e6), POINTS))
    answers = np.empty((POINTS, 3))

    surface = Surface.named("yang-persson")
    gaps = np.linspace(-0.5, 0.95, GAPS) * surface.h_max
    contacts = np.empty((GAPS, 3))
    given = CSurface(surface.hurst, surface.q0, surface.q1, surface.h_rms, surface.h_max)

    with tempfile.TemporaryDirectory() as work:
        folder = pathlib.Path(work)
        write_code("c", folder)
        libraries = [compiled(folder, number, options) for number, options in enumerate(OPTIONS.values())]
        size, count = ctypes.c_size_t(POINTS), ctypes.c_size_t(GAPS)

        def islands(library: ctypes.CDLL) -> Callable[[], Any]:
            return lambda: library.mbma_phi_many(size, pointer(X), pointer(mu), pointer(answers), None)

        def totals(library: ctypes.CDLL) -> Callable[[], Any]:
            one, rtol = ctypes.c_double(1.0), ctypes.c_double(RTOL)
            return lambda: library.mbma_total_many(
                ctypes.byref(given), count, pointer(gaps), one, rtol, pointer(contacts), None
            )

        runs = [lambda: model.answer(X, mu), *map(islands, libraries)]
        report(f"islands, {POINTS} random (X, mu)", POINTS, list(OPTIONS), in_turn(runs))
        known = model.answer(X, mu)
        print(f"  largest relative difference {largest(answers, known.phi_F, known.phi_A):.1e}")
        runs = [lambda: contact(surface, gaps, rtol=RTOL), *map(totals, libraries)]
        report(f"totals, one surface at {GAPS} gaps", GAPS, list(OPTIONS), in_turn(runs))
        total = contact(surface, gaps, rtol=RTOL)
        print(f"  largest relative difference {largest(contacts, total.force, total.area):.1e}")


if __name__ == "__main__":
    main()
