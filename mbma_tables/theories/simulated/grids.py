"""Grids of points and loads on which a map is simulated, and what was measured of each.

A grid is the points of the map that boundary elements get, and the loads at which these are
pressed. Contact areas of the loads are by the quick law of the map, so that they are known before
anything is simulated; boundary elements then give areas that differ from these.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING

from mbma_tables.surfaces.spectral import ROUNDED
from mbma_tables.theories.tested import elastic_ranges

if TYPE_CHECKING:
    from mbma_tables.surfaces.surface import MeasuredSurface
    from mbma_tables.surfaces.treatment import Treated

# A/A0 of the loads; these were chosen between `TESTED_AREAS`, so that curves between loads were
# tested too
AREAS = (7e-4, 0.0015, 0.006, 0.012, 0.05, 0.09, 0.22, 0.3, 0.52, 0.65, 0.88, 0.95)
# three that the quick grid does without
AREAS_LEFT_OUT = (7e-4, 0.3, 0.95)
TOLERANCE = 1e-5  # of boundary elements
# A/A0 of the 142 maps of `python -m generate machined` at which scatter was measured
TESTED_AREAS = (0.003, 0.025, 0.067, 0.14, 0.39, 0.58, 0.78)
# measured on the full grid, by whose flow that of the quick one is
FLOW_SCATTER = (0.00729, 0.0153, 0.0185, 0.0327, 0.0327, 0.0327, 0.0327)


def steps_along(surface: MeasuredSurface, whole: Treated) -> float:
    """Sampling steps along the shortest wavelength of a map, but for rounding of its heights."""
    return surface.shortest(ROUNDED) / max(whole.steps)


@dataclasses.dataclass(frozen=True, eq=False)
class Grid:
    """Points and loads of a simulation, with the range and the scatter that were measured.

    Attributes
    ----------
    name : str
        In `Simulated(grid=...)`.
    areas : tuple of float
        A/A0 of the loads, by the law of the map.
    tolerance : float
        Of boundary elements, relative.
    rows : str
        Name of its rows in tested.csv.
    scatters : mapping of str to tuple of float
        Standard deviation of ln of a quantity at `TESTED_AREAS`, of a map of typical
        sensitivity, against contact on the full grid at tolerance 1e-6: the larger of the 70%
        and half of the 97.5% quantile of the errors.
    halvings : int
        How often the number of points along each side is halved at least.
    most_points : int
        Points above which a map is halved further.
    simulates_all : bool
        Whether flow and a hardness are simulated on it too. Otherwise flow is that of the full
        grid at equal pressure, and a hardness is by the law of hardness.
    """

    name: str
    areas: tuple[float, ...]
    tolerance: float
    rows: str
    scatters: Mapping[str, tuple[float, ...]]
    halvings: int = 0
    most_points: int = 2**20
    simulates_all: bool = True

    @property
    def tested(self) -> tuple[float, float]:
        """A/A0 from which and up to which contacts are valid."""
        return elastic_ranges(self.rows)["area"]

    @property
    def call(self) -> str:
        """The theory of this grid, as it is written."""
        return "'simulated'" if self is QUICK else f"Simulated(grid={self.name!r})"


FULL = Grid(
    name="full",
    areas=AREAS,
    tolerance=TOLERANCE,
    rows="simulated",
    scatters={
        "area": (0.0649, 0.0233, 0.0105, 0.00936, 0.00987, 0.00321, 0.00615),
        "pressure": (0.00529, 0.00286, 0.00041, 0.000948, 0.000686, 0.00022, 0.00187),
        "stiffness": (0.0402, 0.0165, 0.0112, 0.00981, 0.00805, 0.00436, 0.0105),
        "flow": FLOW_SCATTER,
    },
)
# every second point of a map of at least eight a wavelength is such a map as were tested; of
# others wavelengths are left out, which is not valid
HALF = dataclasses.replace(FULL, name="half", halvings=1)
QUICK = Grid(
    name="quick",
    areas=tuple(area for area in AREAS if area not in AREAS_LEFT_OUT),
    tolerance=3e-4,
    rows="simulated_quick",
    scatters={
        "area": (0.0494, 0.0176, 0.00947, 0.0104, 0.0102, 0.00223, 0.00622),
        "pressure": (0.00485, 0.00251, 0.00115, 0.00116, 0.00155, 0.00161, 0.00239),
        "stiffness": (0.0361, 0.0135, 0.00813, 0.00772, 0.0076, 0.0054, 0.0131),
        "flow": FLOW_SCATTER,
    },
    # about 15 s of one core
    most_points=2**19,
    simulates_all=False,
)
GRIDS = {grid.name: grid for grid in (FULL, HALF, QUICK)}
