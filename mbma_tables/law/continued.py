"""A law continued by its tangents beyond its range, for the trial steps of Newton's method."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, Numbers, finite_array
from mbma_tables.common.errors import InputError

LIGHT, HEAVY = 1e-2, 0.99  # overclosures of the default ends, over that of the law's last


@dataclasses.dataclass(frozen=True, eq=False)
class ContinuedLaw:
    """Pressure of a `ContactLaw` between two mean separations, and straight lines that continue it with its slope.

    Towards wide gaps the line crosses zero: pressure is negative there, which attracts separated bodies in trial steps.
    Neither end is a law of contact: check with `inside` that a solution lies between them.

    Attributes
    ----------
    law : ContactLaw
        The law that is continued.
    light, heavy : float
        Mean separations of the ends [length].
    """

    law: Any
    light: float
    heavy: float

    def pressure_and_stiffness(self, mean_separation: ArrayLike | str) -> tuple[Numbers, Numbers]:
        """F/A0 and its derivative -dp/du, in one pass."""
        u = self._given(mean_separation)
        held = np.clip(u, self.heavy, self.light)
        pressure, stiffness = self.law.pressure_and_stiffness(held)
        return pressure + stiffness * (held - u), stiffness

    def pressure(self, mean_separation: ArrayLike | str) -> Numbers:
        """F/A0."""
        return self.pressure_and_stiffness(mean_separation)[0]

    def stiffness(self, mean_separation: ArrayLike | str) -> Numbers:
        """-dp/du."""
        return self.pressure_and_stiffness(mean_separation)[1]

    def inside(self, mean_separation: ArrayLike | str) -> Any:
        """Whether the law itself applies, or the bodies are apart and its pressure is zero; False at first contact."""
        u = self._given(mean_separation)
        return (self.heavy <= u) & (u <= self.light)

    def _given(self, mean_separation: ArrayLike | str) -> FloatArray:
        return finite_array("mean_separation", self.law.units.number("mean_separation", mean_separation))


def continued_law(law: Any, pressures: tuple[Any, Any] | None) -> ContinuedLaw:
    """The law continued beyond the two pressures, or beyond 1% and 99% of its compression."""
    if pressures is None:
        end = law.lowest if law.turning_point is None else law.turning_point
        c = (law.h_max - end) / 2 * np.array([LIGHT, HEAVY])
        light, heavy = (law.h_max - c).tolist()
        if law.softening is not None:  # beyond it tangents fall, to zero where pressure turns down
            heavy = max(heavy, float(law.softening))
    else:
        if not isinstance(pressures, tuple | list | np.ndarray) or len(pressures) != 2:
            raise InputError(f"pressures must be two rising numbers, got {pressures!r}")
        light, heavy = (float(law.at_pressure(pressure).mean_separation) for pressure in pressures)
    if not heavy < light or not float(law.stiffness(light)) > 0:
        raise InputError(f"pressures must be two rising numbers above zero, got {pressures!r}")
    return ContinuedLaw(law, light, heavy)
