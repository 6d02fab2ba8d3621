"""``python -m generate rough_spheres``: boundary elements of rough spheres on a flat.

Gaussian roughness on spheres of radius `RADIUS` against a rigid flat, on a half-space that
is not periodic (Tamaas with the convolution of DC-FFT), E* = 1, lengths in sampling steps.
Their rows are a group of docs/data/boundary_elements.nc.
"""

import itertools
from collections.abc import Iterator

import click
import numpy as np

from generate.boundary_elements.run import of_contacts
from generate.boundary_elements.solve import Contact
from generate.calibrated_file import write_part
from generate.machined.makers import rough
from mbma_tables.common.arguments import FloatArray
from mbma_tables.theories.dataset import FILE

POINTS = 320
SHORTEST = 6.0
RADIUS = 3000.0
TOLERANCE = 1e-5
HURSTS = (0.5, 0.8)
LONGEST = (24.0, 48.0)
HEIGHTS = (0.1, 0.3, 1.0)
EACH = 2
FIRST_SEED = 71
SMOOTH_RADII = (10.0, 20.0, 35.0, 60.0)  # of Hertz's contact at the loads


def heights(hurst: float, longest: float, h_rms: float, seed: int) -> FloatArray:
    z = rough(np.random.default_rng(seed), POINTS, longest, SHORTEST, hurst)
    return np.asarray((z - z.mean()) * (h_rms / z.std()))


def simulated(z: FloatArray) -> Iterator[tuple[float, ...]]:
    """Force over E*, approach, real area, and the mean distance from the axis, weighted by pressure."""
    x = np.arange(POINTS) - (POINTS - 1) / 2
    r = np.hypot(x[:, None], x)
    contact = Contact(z - r**2 / (2 * RADIUS), (POINTS, POINTS), TOLERANCE, "dcfft")
    for a in SMOOTH_RADII:
        force = 4 / 3 * a**3 / RADIUS
        found = contact.press(force / r.size)
        pressure = contact.traction
        yield (
            force,
            found["approach"],
            found["area"] * r.size,
            float(np.mean(pressure * r) / pressure.mean()),
        )


@click.command()
def rough_spheres() -> None:
    """Press rough spheres on a flat, for docs/joints.md: two minutes."""
    rows = []
    for seed, design in enumerate(
        itertools.product(HURSTS, LONGEST, HEIGHTS, range(EACH)), FIRST_SEED
    ):
        rows += [
            [*design[:-1], seed, *row] for row in simulated(heights(*design[:-1], seed))
        ]
    write_part(FILE, of_contacts("rough_spheres", np.transpose(rows)), "rough_spheres")
    click.echo(FILE)
