"""Rows of the table of ``python -m benchmarks``, and times of the processor taken in turns."""

import dataclasses
import statistics
import time
from collections.abc import Callable
from typing import Any

import click

ROUNDS = 9


@dataclasses.dataclass(frozen=True)
class Line:
    """One measured number; `wanted` as a sentence part, empty where nothing is asked."""

    name: str
    value: float
    unit: str
    wanted: str = ""
    met: bool | None = None


LINES: list[Line] = []


def report(
    name: str,
    value: float,
    unit: str,
    at_least: float | None = None,
    at_most: float | None = None,
) -> None:
    """Keep and print a number."""
    wanted = ""
    met = None
    if at_least is not None:
        wanted = f">= {at_least:g}"
        met = value >= at_least
    if at_most is not None:
        wanted = f"<= {at_most:g}"
        met = value <= at_most
    LINES.append(
        Line(name, float(value), unit, wanted, None if met is None else bool(met))
    )
    mark = {None: "", True: "met", False: "MISSED"}[met]
    click.echo(f"  {name:<72} {value:10.4g} {unit:<6} {wanted:>9} {mark}".rstrip())


def rounds(
    runs: dict[str, Callable[[], Any]], count: int = ROUNDS
) -> dict[str, list[float]]:
    """Processor seconds of each run in every round; runs take turns, a first round is not counted."""
    taken: dict[str, list[float]] = {name: [] for name in runs}
    for number in range(count + 1):
        for name, run in runs.items():
            start = time.thread_time()
            run()
            spent = time.thread_time() - start
            if number:
                taken[name].append(spent)
    return taken


def times_faster(taken: dict[str, list[float]], slow: str, fast: str) -> float:
    """Median over rounds of the ratio of two times."""
    return statistics.median(a / b for a, b in zip(taken[slow], taken[fast], strict=True))


def microseconds(taken: list[float], count: int) -> float:
    """Median time of one of `count`."""
    return 1e6 * statistics.median(taken) / count
