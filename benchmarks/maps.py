"""Simulated maps, each in a process of its own, and bearing tables, each of a new surface.

`python -m benchmarks.maps 256 512` prints the rows of maps of these numbers of points a side, and
`python -m benchmarks.maps --file 8192` those of a map in a file that is not loaded as a whole.
"""

import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
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
TILE = 1024  # points a side of the periodic map that fills a file
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


def one_file(path: str) -> None:
    """Ask about the contact of a map in a file: seconds and memory after it is read, and in the end."""
    clock, cpu = time.monotonic(), time.process_time()
    numbers = []

    def note() -> None:
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        numbers.extend([time.monotonic() - clock, time.process_time() - cpu, memory])

    surface = Surface.from_map(path, 1.0, periodic=False, confirmed="bow")
    note()
    contact(surface, area=0.1)
    note()
    print(json.dumps(numbers))


def from_file(points: int) -> None:
    """Rows of a map of that many points a side in a .npy file of 8 bytes a point."""
    tile = rough(TILE)
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "map.npy"
        whole = np.lib.format.open_memmap(path, "w+", "<f8", (points, points))
        for first in range(0, points, TILE):
            rows = whole[first : first + TILE]
            rows[:] = np.tile(tile, (1, points // TILE + 1))[: len(rows), :points]
        whole.flush()
        del whole
        numbers = _cold("--one-file", str(path))
        size = path.stat().st_size / 1e6
    name = f"{points} x {points}, a file of {size:.0f} MB"
    for what, first in (("read", 0), ("read, quick grid", 3)):
        report(f"{name}: {what}", numbers[first], "s")
        report("  of the processor", numbers[first + 1], "s")
        report("  memory of the process", numbers[first + 2], "MB")


def of_cold_process(points: int, periodic: bool, grid: str, flow: bool) -> list[float]:
    """Seconds of the clock and of the processor, and MB, of a process that has no cache."""
    return _cold("--one", json.dumps([points, periodic, grid, flow]))


def _cold(*arguments: str) -> list[float]:
    """The numbers that such a process of this module prints."""
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.maps", *arguments],
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
    """Nanoseconds of the law of a map, and of a surface to 200 rows of a bearing table."""
    click.echo("\nThe law of a map, and bearing tables of a new surface each")
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
    elif sys.argv[1:2] == ["--one-file"]:
        one_file(sys.argv[2])
    elif sys.argv[1:2] == ["--file"]:
        for text in sys.argv[2:] or ("8192",):
            from_file(int(text))
    else:
        simulated(tuple(int(text) for text in sys.argv[1:]) or (256, 512))
