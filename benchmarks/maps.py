"""Simulated maps, each in a process of its own, and bearing tables, each of a new surface.

`python -m benchmarks.maps 256 512` prints the rows of maps of these numbers of points a side.
"""

import json
import os
import resource
import subprocess
import sys
import time
import timeit

import click
import numpy as np

from benchmarks.rows import report
from generate.boundary_elements.surfaces import Recipe, heights
from mbma_tables import Surface, contact, contact_law
from mbma_tables.common.cache import VARIABLE
from mbma_tables.export.rows.law_rows import describe_law
from mbma_tables.theories import Simulated

SEEDS = 5
FULL = Simulated(grid="full")
# bars of a map of so many points a side, by seconds of the clock on two cores that nothing else
# uses, flow included
MOST = {256: 2.0, 512: 10.0, 1024: 60.0}
STEPS = 32  # of four longest wavelengths along a side, eight along the shortest one


def rough(points: int, seed: int = 1234) -> np.ndarray:
    """Heights of a self-affine surface with four of its longest wavelengths along a side."""
    return heights(Recipe("self_affine", 0.8, points / STEPS, 4, seed, points))


def one_map(points: int, periodic: bool, grid: str, flow: bool) -> None:
    """Ask about a map's contact, and its flow; seconds and memory as a line of JSON."""
    values = rough(points)
    clock, cpu = time.monotonic(), time.process_time()
    surface = Surface.from_map(values, 1.0, periodic=periodic)
    found = contact(surface, area=0.1, theory=Simulated(grid=grid))
    if flow:
        found.leakage.x  # noqa: B018
    taken = time.monotonic() - clock, time.process_time() - cpu
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps([*taken, memory]))


def of_cold_process(points: int, periodic: bool, grid: str, flow: bool) -> list[float]:
    """Seconds of the clock and of the processor, and MB, of a process that has no cache."""
    case = json.dumps([points, periodic, grid, flow])
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.maps", "--one", case],
        check=True,
        capture_output=True,
        text=True,
        env=os.environ | {VARIABLE: "off"},
    )
    seconds: list[float] = json.loads(done.stdout.splitlines()[-1])
    return seconds


def simulated(every_size: tuple[int, ...]) -> None:
    """Rows of maps of some sizes: on both grids, periodic or not, with flow and without."""
    for points in every_size:
        for periodic in (True, False):
            for grid, flow in (("quick", False), ("full", False), ("full", True)):
                clock, cpu, memory = of_cold_process(points, periodic, grid, flow)
                kind = "periodic" if periodic else "not periodic"
                name = f"{points} x {points}, {kind}: {grid} grid{', flow' * flow}"
                report(name, clock, "s", at_most=MOST.get(points) if flow else None)
                report("  of the processor", cpu, "s")
                report("  memory of the process", memory, "MB")


def maps(rng: np.random.Generator) -> None:
    """Seconds from a map to its answer, and of a surface to 200 rows of a bearing table."""
    click.echo("\nMaps and bearing tables, a new surface each")
    simulated((256, 512))
    surface = Surface.from_map(rough(128), 1.0, periodic=True)
    law = contact_law(surface, theory=FULL)
    u = rng.uniform(0.2, 2.0, 100_000) * float(surface.h_rms)
    out = []
    for _ in range(SEEDS):
        hurst = rng.uniform(0.5, 0.9)
        shortest = rng.uniform(1.0, 4.0)
        bearing = Surface(hurst, 0.05, 6.0 / shortest, 0.5, 1.75, unit="um")
        start = time.process_time()
        describe_law(
            bearing, "110 GPa", length_unit="um", stress_unit="GPa", quantity="film"
        )
        out.append(time.process_time() - start)
    report(
        "a law of that map, a random gap",
        1e9 * min(timeit.repeat(lambda: law.pressure(u), number=1)) / u.size,
        "ns",
        at_most=60,
    )
    report("a bearing table of 200 gaps", 1e3 * float(np.median(out)), "ms", at_most=50)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        one_map(*json.loads(sys.argv[2]))
    else:
        simulated(tuple(int(text) for text in sys.argv[1:]) or (256, 512))
