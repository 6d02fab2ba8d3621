"""Times of the processor as ratios to one fixed piece of work, and the surfaces and gaps on which totals are timed."""

from __future__ import annotations

import functools
import math
import statistics
import time
import timeit
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.special import erfcx

from mbma_tables import Surface
from mbma_tables.common.arguments import FloatArray

WORK_SIZE = 2**15
ROUNDS = (2, 25)  # of a measurement, at least and at most
GAPS = 50  # of each surface
# H, zeta_1, q0 h_rms, h_max/h_rms of surfaces that no table, formula or fit was made from
HELD_OUT = (
    (0.35, 40.0, 0.05, 3.1),
    (0.52, 1300.0, 0.02, 3.4),
    (0.63, 14.0, 0.30, 2.7),
    (0.74, 330.0, 0.10, 3.0),
    (0.86, 6100.0, 0.18, 3.6),
    (0.97, 90.0, 0.08, 3.8),
)


@functools.cache
def _work_points() -> FloatArray:
    return np.linspace(-5.0, 5.0, WORK_SIZE)


def fixed_work() -> float:
    """The piece of work that costs 1: the sum of erfcx at 32768 points between -5 and 5, by scipy."""
    return float(erfcx(_work_points()).sum())


def measure(run: Callable[[], Any], budget: float = 0.5) -> tuple[float, float]:
    """Cost of one call and the seconds of the fixed work.

    Both are timed in turns, each call against the work before and after it, and the median ratio is taken: a
    machine that slows down for a while slows both.

    Parameters
    ----------
    run : callable
        Its first call is not timed.
    budget : float
        Seconds after which no further round begins, but for the second.
    """

    def seconds_of(function: Callable[[], Any], calls: int = 1) -> float:
        return timeit.timeit(function, timer=time.process_time, number=calls) / calls

    def work() -> float:
        # what else the machine does can only add
        return min(seconds_of(fixed_work) for _ in range(3))

    run()
    fixed_work()
    # short runs are repeated until the clock and its calls no longer count
    calls = max(1, math.ceil(2e-3 / max(seconds_of(run), 1e-7)))
    works, ratios = [work()], list[float]()
    started = time.process_time()
    while len(ratios) < ROUNDS[1] and (len(ratios) < ROUNDS[0] or time.process_time() - started <= budget):
        spent = seconds_of(run, calls)
        works.append(work())
        ratios.append(2 * spent / (works[-2] + works[-1]))
    return statistics.median(ratios), min(works)


def variant(what: str, rtol: float) -> str:
    """The name of a variant at a tolerance, as `Row` reads it."""
    return f"{what} rtol={rtol:.0e}"


def held_out_surfaces() -> list[Surface]:
    """The surfaces on which totals are measured, with q0 = 1."""
    return [Surface(hurst, 1.0, zeta_1, rough, top * rough) for hurst, zeta_1, rough, top in HELD_OUT]


def measured_gaps(surface: Surface, count: int = GAPS) -> FloatArray:
    """Gaps evenly over [-h_max/2, h_max), the upper end left out."""
    return np.linspace(-0.5, 1.0, count, endpoint=False) * float(surface.h_max)
