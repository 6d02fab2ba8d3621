"""One catalogue of test surfaces, tagged by what makes them hard, and random surfaces and gaps by a seed.

``tagged("near-3", "low-hurst")`` gives the entries that carry all these tags, ready for ``pytest.mark.parametrize``:

- paper: a case of the paper's Section 4
- near-3: zeta_1 <= 3.01, where the floors of (27) and (30) leave hardly any range
- large-zeta: zeta_1 >= 1e6, where the integrals have a boundary layer
- low-hurst: H <= 0.3, stiff islands (mu up to 5e6) and force that is not monotone in the gap
- hurst-one: H within 1e-9 of 1, where powers of zeta vanish
- units: lengths far from 1
- extreme: at the end of a range that `Surface` accepts, or a surface on which a defect was found
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from mbma_tables import Surface
from mbma_tables.surfaces.cases import CASES
from mbma_tables.surfaces.readings import PRINTED, REPORTED

# readings of one's own: other numbers, and other formulas
OWN = dataclasses.replace(PRINTED, name="own", jacobian="exact", beta=0.3, phi=0.08, floor_d=1.6, floor_u=3.5)
LEVEL = dataclasses.replace(REPORTED, name="level", jacobian="exact", offset=False, summit_sigma=False)


@dataclasses.dataclass(frozen=True)
class Entry:
    """A surface with its name and tags; tags that follow from its numbers need not be given."""

    name: str
    surface: Surface
    given: tuple[str, ...] = ()

    @property
    def tags(self) -> frozenset[str]:
        """Every tag of the entry."""
        surface = self.surface
        measured = {
            "near-3": surface.zeta_1 <= 3.01,
            "large-zeta": surface.zeta_1 >= 1e6,
            "low-hurst": surface.hurst <= 0.3,
            "hurst-one": surface.hurst > 1 - 1e-9,
            "units": not 1e-6 < surface.h_rms < 1e6,
        }
        return frozenset(self.given) | {tag for tag, holds in measured.items() if holds}


def _made(hurst: float, zeta_1: float, h_max: float = 3.0, q0: float = 0.2, h_rms: float = 1.0) -> Surface:
    return Surface(hurst, q0, q0 * zeta_1, h_rms, h_max * h_rms)


ENTRIES = (
    *(Entry(name, Surface.named(name), ("paper",)) for name in CASES),
    Entry("plain", _made(0.8, 216.0)),
    Entry("middling", _made(0.5, 1e4)),
    Entry("narrow", _made(0.6, 5.0, 2.5)),
    Entry("narrow-smooth", _made(1.0, 3.01, 3.3)),
    Entry("narrow-rough", _made(0.1, 3.01, 2.5)),
    Entry("narrowest", _made(0.8, math.nextafter(3, 4) * (1 + 1e-15)), ("extreme",)),
    Entry("narrow-derivatives", Surface(0.961145541398031, 1, 3.000016217016267, 1, 1.859847391862941), ("extreme",)),
    Entry("narrow-law", Surface(0.6625385170202142, 1, 3.0000000001447598, 1, 2.3665629110520765), ("extreme",)),
    Entry("turning", _made(0.3, 1e4, 4.0)),
    Entry("rough", _made(0.1, 1e4, 4.5)),
    Entry("rough-wide", _made(0.1, 1e8), ("extreme",)),
    Entry("roughest", _made(0.05, 1e8), ("extreme",)),
    Entry("almost-one", _made(math.nextafter(1, 0), 50.0)),
    Entry("smooth", _made(1.0, 1e4, 4.7)),
    Entry("smooth-wide", Surface(1.0, 1, 1e8, 1, 7.547388914185743), ("extreme",)),
    Entry("wide", _made(0.9, 1e7)),
    Entry("nanometres-in-metres", _made(0.8, 100.0, 3.0, 1e8, 1e-9)),
    Entry("kilometres-in-nanometres", _made(0.8, 100.0, 3.0, 1e-15, 1e12)),
)


def tagged(*tags: str, without: tuple[str, ...] = ()) -> list[Any]:
    """The surfaces with all of `tags` and none of `without`, as parameters of a test, named."""
    unknown = {*tags, *without} - {tag for entry in ENTRIES for tag in entry.tags}
    if unknown:
        raise ValueError(f"no entry is tagged {', '.join(sorted(unknown))}")
    chosen = [entry for entry in ENTRIES if entry.tags.issuperset(tags) and entry.tags.isdisjoint(without)]
    return [pytest.param(entry.surface, id=entry.name) for entry in chosen]


def random_surfaces(
    count: int,
    seed: int,
    *,
    hurst: tuple[float, float] = (0.1, 1.0),
    zeta_1: tuple[float, float] = (3.01, 1e8),
    h_max: tuple[float, float] = (2.5, 4.7),
    any_unit: bool = False,
) -> Surface:
    """A batch over these ranges (h_max in h_rms, zeta_1 even in its logarithm), their ends included again and again."""
    rng = np.random.default_rng(seed)
    hursts = rng.uniform(*hurst, count)
    hursts[::9], hursts[4::18] = hurst[1], hurst[0]
    zetas = np.exp(rng.uniform(*np.log(zeta_1), count))
    zetas[::7], zetas[::11] = zeta_1
    q0, h_rms = np.exp(rng.uniform(-8, 8, (2, count))) if any_unit else (0.2, 1.0)
    return Surface(hursts, q0, q0 * zetas, h_rms, h_rms * rng.uniform(*h_max, count))


def random_gaps(surfaces: Surface, seed: int) -> np.ndarray:
    """A gap for each surface from 0.9999 h_max, near first contact, to -h_max, full compression."""
    count = surfaces.hurst.size
    rng = np.random.default_rng(seed)
    share = rng.uniform(-1, 0.9999, count)
    share[::5] = 1 - 10 ** rng.uniform(-4, -0.5, count)[::5]
    share[3::20], share[4::20] = -1, 0.9999
    return share * surfaces.h_max


def one_by_one(surfaces: Surface) -> Iterator[Surface]:
    """The single surfaces of a batch."""
    for numbers in zip(surfaces.hurst, surfaces.q0, surfaces.q1, surfaces.h_rms, surfaces.h_max, strict=True):
        yield Surface(*numbers)
