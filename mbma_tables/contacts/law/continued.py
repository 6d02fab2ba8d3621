"""A contact law continued by its tangents, for the trial steps of Newton's method."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, Numbers, finite_array


@dataclasses.dataclass(frozen=True, eq=False)
class ContinuedLaw:
    """Pressure of a `ContactLaw` between two mean separations, and straight lines that continue it with its slope.

    Towards wide gaps the line crosses zero: pressure is negative there, which attracts
    separated bodies in trial steps. Neither end is a law of contact: check with `inside`
    that a solution lies between them.
    """

    law: Any
    light: float  #: mean separation of the end towards wide gaps [length]
    heavy: float  #: and of the other

    def pressure_and_stiffness(
        self, mean_separation: ArrayLike | str
    ) -> tuple[Numbers, Numbers]:
        """F/A0 and its derivative -dp/du, in one pass."""
        u = self._given(mean_separation)
        inside_gap = np.clip(u, self.heavy, self.light)
        pressure, stiffness = self.law.pressure_and_stiffness(inside_gap)
        return pressure + stiffness * (inside_gap - u), stiffness

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
        return finite_array(
            "mean_separation", self.law.units.number("mean_separation", mean_separation)
        )
