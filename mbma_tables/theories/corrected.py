"""The quick law of a map corrected by boundary elements on half of its grid: `theory="corrected"`.

The half grid, c, is pressed at the loads of `theory="simulated"` and carried to the full map by the law's own change::

    u = u_c + u_law - u_law,c        A = erf(e),  e = e_c e_law/e_law,c

with the geometric mean of A and the law's own where A is below 1%, and u = u_c exp((u_law - u_law,c)/u_c) where that
change is negative. What the law, and the quarter grid carried likewise, differ from it by measures its scatter.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from scipy.special import erf, erfinv

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError, OutOfRangeError
from mbma_tables.laws.energy_spline import LARGEST_AREA, LoadCurve
from mbma_tables.laws.pressing import MIN_POINTS, ROUNDING, TOLERANCE, Press, coarser
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.maps import measured_map
from mbma_tables.surfaces.spectral import PRESSED
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.surfaces.treatment import Treated
from mbma_tables.theories import own_map, simulated
from mbma_tables.theories.calibrated_curves import OwnLaw, own_law
from mbma_tables.theories.protocol import TheoryAnswer
from mbma_tables.theories.simulated import BoundaryElements

LIGHT = 0.01  # contact below which the law's own area counts, too
FINE = 4000  # loads over which the law's change is integrated
LOWEST, HIGHEST = 3e-3, 0.8  # A/A0 that was tested
# points along a side, and of the map, between which it is the default
LEAST_SIDE, MOST_POINTS = 64, 2**18
# a, b and c of the scatter, root of a^2 + (b D1)^2 + (c D2)^2: D1 is what the law differs by from the answer, D2 what
# that by the quarter grid does; fitted to the 65 maps of `python -m generate machined` (generate/machined/coverage.py)
SCATTER = {"pressure": (0.021, 0.51, 0.43), "area": (0.0095, 0.28, 0.61), "stiffness": (0.034, 0.44, 0.27)}
OF_FLOW = (0.065, 0.061, 0.16, 0.83, 2.8, 2.8, 2.8)  # of ln of the flow, at `TESTED_AREAS` of simulated maps


class Corrected(BoundaryElements):
    """The law of a map, corrected by its half grid: under a second for 256 x 256 points, one core."""

    name = "corrected"

    def __init__(self, surface: MeasuredSurface, half: FloatArray, quarter: FloatArray, tolerance: float) -> None:
        pressure, area, u, energy = half
        whole = own_map.map_of(surface)
        points, origin = own_map.steps_along(surface, whole), f"corrected by {own_map.origin_of(whole, TOLERANCE)}"
        # flow is that of the full grid
        mirrored, law = not whole.periodic, own_law(surface)
        heights = whole.heights - whole.heights.mean()
        pressed = Press(heights, own_map.sides(whole), law.gradient, tolerance, mirrored)
        super().__init__(surface, pressure, area, u, energy, points, whole.heights.size, pressed, True, origin)
        other = LoadCurve(quarter)
        x = self.fit.x
        inside = np.clip(x, other.x[0], other.x[-1])
        gaps = np.array([law.separations(pressure), other.separation(inside)])
        areas = np.array([law.area(pressure), other.area(inside)])
        stiff = np.array([-pressure / np.gradient(gaps[0], x), other.stiffness(inside)])
        own = self.fit.stiffness(x)
        # by quantity, law or quarter grid, and load
        self._apart_by = {
            "pressure": np.abs(gaps - u) * own / pressure,
            "area": np.abs(np.log(areas / area)),
            "stiffness": np.abs(np.log(np.maximum(stiff, 1e-6 * own) / own)),
        }

    @classmethod
    def of(cls, surface: AnySurface, loads: Any = None, tolerance: float = TOLERANCE) -> Corrected:
        """Press half and quarter of the grid of a surface from `mbma_tables.Surface.from_map`."""
        own_map.map_of(surface)
        assert isinstance(surface, MeasuredSurface)
        return cls(surface, _carried(surface, 1, tolerance), _carried(surface, 2, tolerance), tolerance)

    def reasons(self, surface: AnySurface, answer: TheoryAnswer, mean_separation: FloatArray) -> dict[str, Any]:
        """Reasons against maps unlike those tested, and contact areas that were not tested."""
        assert isinstance(self.surface, MeasuredSurface)
        everywhere = np.ones(answer.area.shape, bool)
        odd = dict.fromkeys(self.surface.outside(PRESSED, by_map=True), everywhere)
        low, high = (answer.area < LOWEST) & (answer.area > 0), answer.area > HIGHEST
        odd |= own_map.unresolved(self.points, answer.area)
        return odd | {f"A/A0 is below {LOWEST:g}": low, f"A/A0 is above {HIGHEST:g}": high}

    def apart(self, quantity: str, area: FloatArray) -> list[FloatArray]:
        """What the law, and the quarter grid, differ from the answer at contact areas, as errors of that quantity."""
        x = self.fit.log_force_at(np.clip(area, *self.rows[1, [0, -1]]))
        return [np.interp(x, self.fit.x, difference) for difference in self._apart_by[quantity]]

    def scatter(self, surface: AnySurface, quantity: str, area: FloatArray) -> FloatArray:
        """Standard deviation against the full grid, by what the law and the quarter grid differ from the answer."""
        if quantity == "flow":
            with np.errstate(divide="ignore"):
                found = np.interp(np.log(area), np.log(simulated.TESTED_AREAS), OF_FLOW)
        else:
            a, b, c = SCATTER[quantity]
            by_law, by_quarter = self.apart(quantity, area)
            found = np.sqrt(a**2 + (b * by_law) ** 2 + (c * by_quarter) ** 2)
        return np.where(self._beyond(area), np.nan, found)


def _carried(surface: MeasuredSurface, halvings: int, tolerance: float) -> FloatArray:
    """Rows of a map pressed on a coarser grid, carried to the full one; loads end where the gap no longer falls."""
    whole = own_map.map_of(surface)
    coarse, sizes = whole.heights - whole.heights.mean(), own_map.sides(whole)
    for _ in range(halvings):
        coarse = coarser(coarse, MIN_POINTS, not whole.periodic)
    steps = tuple(side / count for side, count in zip(sizes, coarse.shape, strict=True))
    treated = Treated(coarse, steps, whole.periodic, None, window=whole.window)
    law, other = own_law(surface), OwnLaw(MeasuredSurface.of(measured_map(treated, None)))
    press = Press(coarse, sizes, law.gradient, tolerance, not whole.periodic)
    pressure, (area, u, energy) = press.loads(own_map.law_loads(surface, own_map.AREAS), False)
    change = law.separations(pressure) - other.separations(pressure)
    # the coarse grid may be in full contact
    lower = u * np.exp(np.minimum(change, 0.0) / np.maximum(u, np.finfo(float).tiny))
    gap = np.where(change < 0, lower, u + change)
    root = erfinv(np.minimum([area, law.area(pressure), other.area(pressure)], LARGEST_AREA))
    carried = erf(root[0] * root[1] / root[2])
    weight = np.exp(-carried / LIGHT) / 2
    carried = np.maximum.accumulate(carried ** (1 - weight) * law.area(pressure) ** weight)
    # dU = -F du of the change alone, which adds nothing at the lightest load
    fine = np.geomspace(pressure[0], pressure[-1], FINE)
    changes = law.separations(fine) - other.separations(fine)
    added = np.append(0.0, np.cumsum((changes[1:] + changes[:-1]) / 2 * np.diff(fine)))
    work = energy + pressure * u + np.interp(pressure, fine, added) + pressure[0] * (gap[0] - u[0])
    rows = np.array([pressure, carried, gap, work - pressure * gap])
    kept = int(np.count_nonzero(np.cumprod((np.diff(gap, prepend=np.inf) < 0) & (rows[3] > 0))))
    if kept < simulated.MIN_LOADS:
        raise ConvergenceError("the law of this map changes so much with its grid that nothing is left to correct")
    return rows[:, :kept]


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
        return of_map(Corrected.name, surface).ends_at_h_max
    except (ConvergenceError, OutOfRangeError):
        return False


@functools.lru_cache(maxsize=8)
def of_map(name: str, surface: AnySurface) -> BoundaryElements:
    """The theory of that name of a surface's map, kept while it is asked again."""
    return {kind.name: kind for kind in (BoundaryElements, Corrected)}[name].of(surface)
