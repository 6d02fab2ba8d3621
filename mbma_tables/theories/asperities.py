"""The theory of Greenwood and Williamson (Eqs. 11, 12), and how the two separations relate (Eq. 50)."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.arguments import FloatArray, Numbers, broadcast_shape, finite_array, positive_modulus
from mbma_tables.islands.height_integrals import height_integral
from mbma_tables.labels import takes_labelled
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.protocol import Theory, TheoryAnswer

EPSILON = 1e-13  # accuracy of the height integrals
MAX_DEPTH = 37.0  # of d over the summits' standard deviation, where force is still a normal number
MAX_AREA = 0.1  # A/A0 up to which asperities may pass for independent


@dataclasses.dataclass(frozen=True, eq=False)
class Asperities:
    """Greenwood-Williamson force and area at given separations; arrays of the broadcast shape.

    Attributes
    ----------
    separation : ndarray
        d, between the rigid plane and the mid-plane [length].
    mean_separation : ndarray
        u = (h_max + d)/2 (50) [length].
    force : ndarray
        F/A0 in the unit of E_star; F/(A0 E*) where that is 1.
    area : ndarray
        A/A0.
    """

    separation: Numbers
    mean_separation: Numbers
    force: Numbers
    area: Numbers


@takes_labelled()
def mean_separation(surface: AnySurface, separation: ArrayLike) -> Numbers:
    """Average interfacial separation u = (h_max + d)/2 [length] at separations d [length], Eq. (50).

    Examples
    --------
    >>> from mbma_tables import Surface, theories
    >>> float(theories.mean_separation(Surface.named("concrete"), 0.5))
    0.8
    """
    gap = finite_array("separation", separation)
    broadcast_shape(separation=gap, surface=surface.h_rms)
    average: FloatArray = surface.h_max / 2 + gap / 2
    return average[()]


@takes_labelled()
def separation(surface: AnySurface, mean_separation: ArrayLike) -> Numbers:
    """Separation d = 2 u - h_max [length] at average interfacial separations u [length], Eq. (50).

    Examples
    --------
    >>> from mbma_tables import Surface, theories
    >>> float(theories.separation(Surface.named("concrete"), 0.8))
    0.5
    """
    average = finite_array("mean_separation", mean_separation)
    broadcast_shape(mean_separation=average, surface=surface.h_rms)
    gap: FloatArray = 2 * average - surface.h_max
    return gap[()]


@takes_labelled(Asperities)
def greenwood_williamson(surface: AnySurface, separation: ArrayLike, E_star: ArrayLike = 1.0) -> Asperities:
    """Force and area of equal spheres with Gaussian heights (Eqs. 11, 12), Nayak's summits (Eq. 2).

    Parameters
    ----------
    surface : Surface
        One surface or a batch; it broadcasts against `separation`.
    separation : array_like
        d between the rigid plane and the mid-plane [length]. The heights are the whole Gaussian: neither
        h_max nor -h_max ends it.
    E_star : array_like
        Effective modulus; force is in its unit.

    Returns
    -------
    Asperities

    Raises
    ------
    InputError, OutOfRangeError

    Examples
    --------
    >>> from mbma_tables import Surface, theories
    >>> found = theories.greenwood_williamson(Surface.named("concrete"), [0.2, 0.5], E_star=10.0)
    >>> found.area.round(4), found.force.round(4)
    (array([0.064 , 0.0056]), array([0.4545, 0.0334]))
    """
    gap = finite_array("separation", separation)
    modulus = positive_modulus(E_star)
    shape = broadcast_shape(separation=gap, surface=surface.h_rms, E_star=modulus)
    density, radius, sigma = surface.summit_density, surface.summit_radius, surface.summit_sigma
    depth = np.broadcast_to(gap / sigma, shape)
    force = 4 / 3 * density * np.sqrt(radius * sigma) * sigma * height_integral(1.5, depth)
    area = math.pi * density * radius * sigma * height_integral(1.0, depth)
    gap = np.broadcast_to(gap, shape)
    return Asperities(gap[()], mean_separation(surface, gap), (modulus * force)[()], area)


class GreenwoodWilliamson(Theory):
    """Greenwood and Williamson's theory, its separations related by Eq. (50)."""

    name = "greenwood_williamson"
    ends_at_h_max = False

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and stiffness at mean separations u [length]."""
        gap = 2 * mean_separation - np.asarray(surface.h_max)
        density, radius, sigma = surface.summit_density, surface.summit_radius, surface.summit_sigma
        found = greenwood_williamson(surface, gap)
        # d(F_3/2)/dx = -3/2 F_1/2, and du = dd/2
        slope = 4 * density * np.sqrt(radius * sigma) * height_integral(0.5, gap / sigma)
        return TheoryAnswer(found.force, found.area, slope, np.full(np.shape(gap), EPSILON))

    def interval(self, surface: AnySurface, quantity: str = "force") -> tuple[FloatArray, FloatArray]:
        """Mean separations [length] from u = 0 to where force underflows."""
        high = np.asarray((surface.h_max + MAX_DEPTH * surface.summit_sigma) / 2, dtype=float)
        return np.zeros_like(high), high

    def concerns(self, surface: AnySurface, answer: TheoryAnswer, mean_separation: FloatArray) -> dict[str, Any]:
        """Reasons for which answers lie outside what the theory was made for."""
        return {f"asperities are taken as independent, A/A0 is above {MAX_AREA:g}": answer.area > MAX_AREA}
