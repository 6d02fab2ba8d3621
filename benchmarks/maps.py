"""Simulated maps and bearing tables, each of a surface that was not asked about before."""

import os
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
QUICK = Simulated(grid="quick")
FULL = Simulated(grid="full")
# points a side, largest magnification (8 points a shortest wavelength), whether periodic,
# bars of both grids [s]
MAPS = (
    (256, 8.0, True, 0.7, 6.0),
    (256, 8.0, False, 0.7, 6.0),
    (512, 16.0, True, None, 20.0),
)


def maps(rng: np.random.Generator) -> None:
    """Seconds of a process from a map to its answer, and of a surface to 200 rows of a bearing table."""
    click.echo("\nMaps and bearing tables, a new surface each")
    before = os.environ.get(VARIABLE)
    os.environ[VARIABLE] = "off"
    try:
        for points, zeta_1, periodic, most_quick, most_full in MAPS:
            z = heights(
                Recipe(
                    "self_affine", 0.8, zeta_1, 4, int(rng.integers(1000, 9999)), points
                )
            )
            for theory, most in ((QUICK, most_quick), (FULL, most_full)):
                start = time.process_time()
                surface = Surface.from_map(z, 1.0, periodic=periodic)
                contact(surface, area=0.1, theory=theory)
                if theory is FULL:
                    contact(surface, area=0.1, theory=theory).leakage.x  # noqa: B018
                shape = (
                    f"{points} x {points}, {'periodic' if periodic else 'not periodic'}"
                )
                flow = ", with flow" if theory is FULL else ""
                report(
                    f"a map of {shape}: simulated, {theory.grid} grid{flow}",
                    time.process_time() - start,
                    "s",
                    at_most=most,
                )
    finally:
        os.environ.pop(VARIABLE) if before is None else os.environ.update(
            {VARIABLE: before}
        )
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
