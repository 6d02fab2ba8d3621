"""Random surfaces and gaps by a seed, and variants of one's own."""

import dataclasses

import numpy as np

from mbma_tables import Surface
from mbma_tables.islands.variants import PRINTED, REPORTED

# variants of one's own: other numbers, and other formulas
OWN = dataclasses.replace(
    PRINTED, name="own", jacobian="exact", beta=0.3, phi=0.08, floor_d=1.6, floor_u=3.5
)
LEVEL = dataclasses.replace(
    REPORTED, name="level", jacobian="exact", offset=False, summit_sigma=False
)


def random_surfaces(
    count: int,
    seed: int,
    *,
    hurst: tuple[float, float] = (0.1, 1.0),
    zeta_1: tuple[float, float] = (3.01, 1e8),
) -> Surface:
    """A batch over these ranges (zeta_1 even in its logarithm), their ends included again and again."""
    rng = np.random.default_rng(seed)
    hursts = rng.uniform(*hurst, count)
    hursts[::9], hursts[4::18] = hurst[1], hurst[0]
    zetas = np.exp(rng.uniform(*np.log(zeta_1), count))
    zetas[::7], zetas[::11] = zeta_1
    return Surface(hursts, 0.2, 0.2 * zetas, 1.0, rng.uniform(2.5, 4.7, count))


def random_gaps(surfaces: Surface, seed: int) -> np.ndarray:
    """A gap for each surface from 0.9999 h_max, near first contact, to -h_max, full compression."""
    count = surfaces.hurst.size
    rng = np.random.default_rng(seed)
    share = rng.uniform(-1, 0.9999, count)
    share[::5] = 1 - 10 ** rng.uniform(-4, -0.5, count)[::5]
    share[3::20], share[4::20] = -1, 0.9999
    return share * surfaces.h_max
