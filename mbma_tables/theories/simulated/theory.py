"""Boundary elements on a surface's own map as a theory: `theory="simulated"`, or `Simulated(grid=...)`."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, ClassVar

from mbma_tables.common.arguments import FloatArray, require_name
from mbma_tables.common.errors import ConvergenceError, InputError, OutOfRangeError
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.theories.simulated.grids import FULL, GRIDS, QUICK

if TYPE_CHECKING:
    from mbma_tables.theories.simulated.one_map import BoundaryElements

LEAST_SIDE = 64  # of maps that are simulated by default


@dataclasses.dataclass(frozen=True)
class Simulated:
    """Contact by boundary elements on a surface's own map.

    Parameters
    ----------
    grid : {"quick", "full", "half"}, optional
        Points and loads of the simulation. "quick" has all points of the map, nine loads and a
        tolerance of 3e-4; contacts of 0.3% to 80% are valid. "full" has twelve loads and a
        tolerance of 1e-5, about twice the time; contacts of 0.1% to 90% are valid, and a hardness
        is simulated too. "half" is "full" on half of the points along each side, for maps of at
        least eight sampling steps along the shortest wavelength. Each adds loads where contact
        areas of two neighbours differ much. Default: "quick", or for a surface opened from the
        table of its simulation that table, which is of the full grid.

    Raises
    ------
    InputError
        For an unknown grid.

    Examples
    --------
    >>> import numpy as np
    >>> from mbma_tables import Surface, contact
    >>> from mbma_tables.theories import Simulated
    >>> noise = np.fft.rfft2(np.random.default_rng(1).standard_normal((64, 64)))
    >>> q = np.hypot(np.fft.fftfreq(64)[:, None], np.fft.rfftfreq(64))
    >>> heights = np.fft.irfft2(np.where((q > 0.05) & (q < 0.25), noise, 0))
    >>> surface = Surface.from_map(heights, dx=1.0, periodic=True)
    >>> pressed = contact(surface, area=0.002, theory=Simulated(grid="full"))
    >>> f"{float(pressed.pressure):.2e} E*, valid: {pressed.valid}"
    '3.66e-04 E*, valid: True'
    """

    grid: str | None = None
    name: ClassVar[str] = "simulated"

    def __post_init__(self) -> None:
        if self.grid is not None:
            require_name("grid", self.grid, GRIDS)

    def of(self, surface: AnySurface) -> BoundaryElements:
        """The simulation of a surface's map, kept for the last eight of them.

        Raises
        ------
        InputError
            For a surface that was not made from a map, or whose map is not known after a change.
        ConvergenceError
            Where boundary elements do not converge.
        """
        # imports scipy, which takes long
        from mbma_tables.theories.simulated.one_map import simulation_of

        if self.grid is not None:
            return simulation_of(surface, self.grid)
        has_table = getattr(surface, "table", None) is not None
        return simulation_of(surface, FULL.name if has_table else QUICK.name)

    def answer(
        self, surface: AnySurface, mean_separation: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """F/(A0 E*) and A/A0 of the simulation at mean separations u [length]."""
        simulation = self.of(surface)
        answer = simulation.answer(surface, mean_separation)
        return answer.pressure, answer.area


def is_default(surface: AnySurface) -> bool:
    """Whether simulation is the default: of a map of a kind for it, whose simulation converges."""
    if not is_for_simulation(surface):
        return False
    try:
        Simulated().of(surface)
    except (ConvergenceError, InputError, OutOfRangeError):
        return False
    return True


def is_for_simulation(surface: AnySurface) -> bool:
    """Whether a surface has a map of enough points, which is pressed within seconds."""
    if not isinstance(surface, MeasuredSurface):
        return False
    treated = surface.map
    if treated is None or surface.bands is None or treated.heights.ndim != 2:
        return False
    return bool(min(treated.heights.shape) >= LEAST_SIDE)
