"""Times of the processor as ratios to one fixed piece of work: the sum of erfcx at 32768 points, by scipy."""

import math
import statistics
import time
import timeit
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.special import erfcx

WORK_POINTS = np.linspace(-5.0, 5.0, 2**15)
ROUNDS = (2, 25)  # of a measurement, at least and at most
BUDGET = 0.5  # seconds after which no further round begins, but for the second


def seconds_of(function: Callable[[], Any], calls: int = 1) -> float:
    return timeit.timeit(function, timer=time.process_time, number=calls) / calls


def seconds_of_work() -> float:
    """Seconds of the fixed work: the least of three, since what else the machine does can only add."""
    return min(seconds_of(lambda: erfcx(WORK_POINTS).sum()) for _ in range(3))


def measure(run: Callable[[], Any]) -> tuple[float, float]:
    """Cost of one call, whose first is not timed, and the seconds of the fixed work.

    Both are timed in turns, each call against the work before and after it, and the median
    ratio is taken: a machine that slows down for a while slows both.
    """
    run()
    seconds_of_work()
    # short runs are repeated until the clock and its calls no longer count
    calls = max(1, math.ceil(2e-3 / max(seconds_of(run), 1e-7)))
    works = [seconds_of_work()]
    ratios = list[float]()
    started = time.process_time()
    while len(ratios) < ROUNDS[1] and (
        len(ratios) < ROUNDS[0] or time.process_time() - started <= BUDGET
    ):
        spent = seconds_of(run, calls)
        works.append(seconds_of_work())
        ratios.append(2 * spent / (works[-2] + works[-1]))
    return statistics.median(ratios), min(works)
