"""The boundary-element simulation of a map, as a surface carries it: loads and flow."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from mbma_tables.common.arguments import FloatArray

# sampling steps a wave, below which areas of boundary elements are too large
MIN_POINTS = 4.0
ROUNDING = 1e-6  # relative, of wavelengths and sampling steps


def resolving(shortest: float, step: float, unit: str | None) -> str:
    """The option of `Surface.from_map` that leaves wavelengths of enough sampling steps.

    Empty if they are that long already.
    """
    if shortest >= MIN_POINTS * step * (1 - ROUNDING):
        return ""
    # a little longer, so that four digits are enough
    return cutting(1.001 * MIN_POINTS * step, unit)


def cutting(wavelength: float, unit: str | None) -> str:
    """The option of `Surface.from_map` that leaves wavelengths of at least this [length]."""
    length = f"{wavelength:.4g}"
    return f"short_cutoff='{length} {unit}'" if unit else f"short_cutoff={length}"


@dataclasses.dataclass(frozen=True, eq=False)
class MapSimulation:
    """What was found of a map, without the map and its gaps."""

    rows: FloatArray  # F/(A0 E*), A/A0, u and U/(A0 E*) of loads, shape (4, n)
    flow_gaps: FloatArray  # mean gaps, falling, shape (m,),
    flow: FloatArray  # and flow coefficients xx, yy, xy there [length^3], shape (m, 3)
    points: float  # sampling steps along the shortest wavelength
    # wavelength [length] below which a large map was cut off; 0 if it was not
    left_out: float
    origin: str  # description of the map and of the simulation

    def flows(
        self, x: FloatArray, separation: Callable[[FloatArray], FloatArray]
    ) -> tuple[FloatArray, FloatArray]:
        """`flow_gaps` and `flow`."""
        return self.flow_gaps, self.flow

    def resized(self, up: float, along: float) -> MapSimulation:
        """For the surface with heights times `up` and lengths along the plane times `along`."""
        by = np.array([[up / along], [1.0], [up], [up**2 / along]])
        return dataclasses.replace(
            self,
            rows=self.rows * by,
            flow_gaps=self.flow_gaps * up,
            flow=self.flow * up**3,
            left_out=self.left_out * along,
        )
