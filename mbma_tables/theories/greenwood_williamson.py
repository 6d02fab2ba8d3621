"""The theory of Greenwood and Williamson (Eqs. 11, 12)."""

import dataclasses
import math
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.islands.greenwood_tripp import height_integral
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.base import EVERYWHERE, Theory, TheoryAnswer

EPSILON = 1e-13  # accuracy of the height integrals
MAX_DEPTH = (
    37.0  # largest d over the summits' standard deviation without underflow of force
)
MAX_AREA = 0.1  # A/A0 up to which asperities are nearly independent


@dataclasses.dataclass(frozen=True, repr=False)
class GreenwoodWilliamson(Theory):
    """Equal spheres with Gaussian heights (Eqs. 11, 12), Nayak's summits (Eq. 2), separations related by Eq. (50).

    The heights are the whole Gaussian: neither h_max nor -h_max ends it.

    Examples
    --------
    >>> from mbma_tables import Surface, contact
    >>> found = contact(Surface.named("concrete"), 10.0, separation=[0.2, 0.5], theory="greenwood_williamson")
    >>> found.area.round(4), found.pressure.round(4)
    (array([0.064 , 0.0056]), array([0.4545, 0.0334]))
    """

    name = "greenwood_williamson"
    ends_at_h_max = False

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        density = surface.summit_density
        radius = surface.summit_radius
        sigma = surface.summit_sigma
        x = (2 * np.asarray(mean_separation) - np.asarray(surface.h_max)) / sigma
        strength = density * np.sqrt(radius * sigma)
        pressure = 4 / 3 * strength * sigma * height_integral(1.5, x)
        area = math.pi * density * radius * sigma * height_integral(1.0, x)
        # d(F_3/2)/dx = -3/2 F_1/2, and du = dd/2
        return TheoryAnswer(
            pressure,
            area,
            4 * strength * height_integral(0.5, x),
            np.full(np.shape(x), EPSILON),
        )

    def interval(
        self, surface: AnySurface, quantity: str = "pressure"
    ) -> tuple[FloatArray, FloatArray]:
        """Mean separations [length] from u = 0 to the underflow of force."""
        high = np.asarray(
            (surface.h_max + MAX_DEPTH * surface.summit_sigma) / 2, dtype=float
        )
        return np.zeros_like(high), high

    def domain(self, surface: AnySurface) -> tuple[FloatArray, FloatArray]:
        """All mean separations from 0; the force of wide gaps underflows to zero."""
        return EVERYWHERE

    def reasons(
        self, surface: AnySurface, answer: TheoryAnswer, mean_separation: FloatArray
    ) -> dict[str, Any]:
        dense = {
            f"asperities are taken as independent, A/A0 is above {MAX_AREA:g}": answer.area
            > MAX_AREA
        }
        return {**super().reasons(surface, answer, mean_separation), **dense}
