"""A quicker simulation of a map, the default theory of maps: `theory="corrected"`.

As `theory="simulated"` with fewer loads and a larger tolerance; its flow is that of "simulated" at the same pressures.
"""

import functools
from types import MappingProxyType

from mbma_tables.common.errors import ConvergenceError, OutOfRangeError
from mbma_tables.laws.pressing import MIN_POINTS, ROUNDING
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.theories import own_map
from mbma_tables.theories.saturated import BoundaryElements

# points along a side, and of the map, between which it is the default
LEAST_SIDE, MOST_POINTS = 64, 2**18


class Corrected(BoundaryElements):
    """The map pressed at nine loads: half a second for 256 x 256 points, one core."""

    name = "corrected"
    areas = tuple(area for area in own_map.AREAS if area not in (7e-4, 0.3, 0.95))
    tolerance = 3e-4
    tested = 3e-3, 0.8
    scatters = MappingProxyType(
        {
            "area": (0.0494, 0.0176, 0.00784, 0.0104, 0.0102, 0.002, 0.00622),
            "pressure": (0.00485, 0.00251, 0.000943, 0.00116, 0.00155, 0.00133, 0.00239),
            "stiffness": (0.0361, 0.0135, 0.00624, 0.00772, 0.0076, 0.0033, 0.0131),
            "flow": (0.00594, 0.0106, 0.0111, 0.0125, 0.0125, 0.0125, 0.0125),
        }
    )


def applies(surface: AnySurface) -> bool:
    """Whether it is the default for a surface: of a map that is resolved, and pressed within seconds."""
    if not isinstance(surface, MeasuredSurface) or surface.map is None or surface.bands is None:
        return False
    whole = surface.map
    if whole.heights.ndim != 2:
        return False
    resolved = own_map.steps_along(surface, whole) >= MIN_POINTS * (1 - ROUNDING)
    if whole.heights.size > MOST_POINTS or min(whole.heights.shape) < LEAST_SIDE or not resolved:
        return False
    try:
        of_map(Corrected.name, surface)
    except (ConvergenceError, OutOfRangeError):
        return False
    return True


@functools.lru_cache(maxsize=8)
def of_map(name: str, surface: AnySurface) -> BoundaryElements:
    """The theory of that name for a surface's map, cached."""
    return {kind.name: kind for kind in (BoundaryElements, Corrected)}[name].of(surface)
