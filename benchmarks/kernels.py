"""Kernels through the public interface, beside their times in the last version that used numba.

`BEFORE` was measured by ``python -m benchmarks.kernels`` with this file in a checkout of
that version (33125d6, numba 0.68.1, everything compiled), in turns with the present one.
Times are in evaluations of `scipy.special.erf` of the same round, so that they compare
across machines of one kind.
"""

import dataclasses
import itertools
import json
import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.special import erf

from mbma_tables import Bodies, Surface, contact, contact_law, greenwood_tripp, open_table
from mbma_tables.islands.geometry import geometry
from mbma_tables.islands.variants import get_variant

MANY = 100_000
SURFACES = 2_000
DESIGNS = 20
SOME = 1_000
CALLS = 2_000
SEED = 7
ROUNDS = 9

# evaluations of erf
BEFORE: dict[str, float] = {
    "universal table, random": 2.498,
    "universal table, path": 1.73,
    "totals, a new surface each": 311.4,
    "1,000 gaps on a new surface": 34.41,
    "1,000 gaps on a known surface": 11.53,
    "100,000 gaps on a new surface": 4.454,
    "one gap on a new surface": 1.036e05,
    "law: pressure, area, stiffness, energy": 1.371,
    "calibrated law, one surface": 3.809,
    "calibrated law, at a pressure": 14.11,
    "calibrated law, a new surface each": 30.37,
    "calibrated law with a hardness": 24.85,
    "leakage, a new surface each": 55.34,
    "exact islands to 1e-6": 1477,
    "exact islands to 1e-13": 4571,
}


def held_out(count: int, rng: np.random.Generator) -> tuple[Surface, np.ndarray]:
    """Random surfaces, and a gap of each between -h_max and 0.9999 h_max."""
    hurst = rng.uniform(0.3, 1, count)
    zeta_1 = np.exp(rng.uniform(np.log(3.01), np.log(1e4), count))
    h_max = rng.uniform(2.5, 4.7, count)
    return Surface(hurst, 1.0, zeta_1, 1.0, h_max), rng.uniform(-1, 0.9999, count) * h_max


def kernels() -> dict[str, tuple[Callable[[], Any], int]]:
    """Calls by name, with the number of answers of each."""
    rng = np.random.default_rng(SEED)
    universal = open_table("universal")
    X = rng.uniform(-6.25, 41.0, MANY)
    mu = 10 ** rng.uniform(-8, 6, MANY)
    fields = geometry(
        np.linspace(1e-3, 4, MANY),
        np.full(MANY, 0.8),
        np.full(MANY, 200.0),
        get_variant("reported"),
    )
    path = [np.ascontiguousarray(fields[name]) for name in ("X", "mu")]
    surfaces, gaps = held_out(SURFACES, rng)
    one = Surface.named("asphalt")
    fresh = itertools.count(1)
    some, many = (
        rng.uniform(-one.h_max, 0.9999 * one.h_max, count) for count in (SOME, MANY)
    )

    def another() -> Surface:
        # one that nothing is kept of
        return dataclasses.replace(one, h_max=one.h_max * (1 + 1e-9 * next(fresh)))

    law = contact_law(one, theory="mbma")
    place = float((one.h_max + many[0]) / 2)
    flat = Surface(0.8, 1.0, 64.0, 1.0, 3.3)
    u = rng.uniform(0.01, 3.3, MANY)
    mean = (gaps + surfaces.h_max) / 2
    calibrated = contact(flat, mean_separation=u, theory="calibrated").pressure
    loads = {}
    for nodes in (28, 96):
        # nodes follow from the accuracy asked
        loads[nodes] = (
            rng.uniform(0, 20, 200),
            10 ** rng.uniform(-2, 4, 200),
            {28: 1e-6, 96: 1e-13}[nodes],
        )
    return {
        "universal table, random": (lambda: universal.answer(X, mu, outside="nan"), MANY),
        "universal table, path": (lambda: universal.answer(*path, outside="nan"), MANY),
        "totals, a new surface each": (
            lambda: contact(surfaces, separation=gaps),
            SURFACES,
        ),
        "1,000 gaps on a new surface": (
            lambda: [contact(another(), separation=some) for _ in range(DESIGNS)],
            SOME * DESIGNS,
        ),
        "1,000 gaps on a known surface": (
            lambda: [contact(one, separation=some) for _ in range(DESIGNS)],
            SOME * DESIGNS,
        ),
        "100,000 gaps on a new surface": (
            lambda: contact(another(), separation=many),
            MANY,
        ),
        "one gap on a new surface": (
            lambda: [contact(another(), mean_separation=place) for _ in range(50)],
            50,
        ),
        "law: pressure, area, stiffness, energy": (
            lambda: law.values(separation=many),
            MANY,
        ),
        "calibrated law, one surface": (
            lambda: contact(flat, mean_separation=u, theory="calibrated"),
            MANY,
        ),
        "calibrated law, at a pressure": (
            lambda: contact(flat, pressure=calibrated, theory="calibrated"),
            MANY,
        ),
        "calibrated law, a new surface each": (
            lambda: contact(surfaces, mean_separation=mean, theory="calibrated"),
            SURFACES,
        ),
        "calibrated law with a hardness": (
            lambda: contact(
                flat, Bodies(hardness=2.0), mean_separation=u, theory="calibrated"
            ),
            MANY,
        ),
        "leakage, a new surface each": (
            lambda: contact(surfaces, mean_separation=mean, theory="calibrated").leakage,
            SURFACES,
        ),
        "exact islands to 1e-6": (
            lambda: greenwood_tripp.solve(*loads[28][:2], rtol=loads[28][2]),
            200,
        ),
        "exact islands to 1e-13": (
            lambda: greenwood_tripp.solve(*loads[96][:2], rtol=loads[96][2]),
            200,
        ),
    }


def measured(rounds: int = ROUNDS) -> dict[str, float]:
    """Times of an answer in evaluations of erf: the median over rounds, in each of which all take turns."""
    runs = kernels()
    at = np.random.default_rng(SEED).uniform(0.01, 3.3, MANY)
    taken: dict[str, list[float]] = {name: [] for name in runs}
    for number in range(rounds + 1):
        for name, (run, count) in runs.items():
            spent = []
            for work, answers in ((lambda: erf(at), MANY), (run, count)):
                start = time.thread_time()
                work()
                spent.append((time.thread_time() - start) / answers)
            # the first round warms up
            if number:
                taken[name].append(spent[1] / spent[0])
    return {name: statistics.median(ratios) for name, ratios in taken.items()}


if __name__ == "__main__":
    json.dump(measured(), sys.stdout, indent=4)
