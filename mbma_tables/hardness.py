"""Contact whose pressure cannot exceed a hardness p_m, from the elastic contact of the same surface.

With eta = p_m/(E* g), g the rms gradient, x = F/(p_m A0) and F in A0 E* g; psi = 1/eta is the plasticity index. ::

    area        pressures diffuse as in Persson's theory, between walls at 0 and at p_m:
                A       = x + (2/pi) sum        sin(n pi x)/n exp(-n^2 pi^2 tau)
                A_yield = x + (2/pi) sum (-1)^n sin(n pi x)/n exp(-n^2 pi^2 tau),   tau = S/(8 eta^2)
                S^-a = S_el^-a + (eta^1.5/b)^-a,   A_el = erf(sqrt(2) F/sqrt(S_el)) the elastic area at F,
                a and b of their own for A and for A_yield
    force       F(u)^-n = F_el(u)^-n + (eta Q(u))^-n,   n = n0 + c eta + d Q(u)
                Q(u): share of heights above the level whose mean gap is u
    stiffness   of the frozen contact, -dF_el/du(u) (1 + e exp(-eta/f)): yielded points unload elastically

Hardness is constant, loading only, frictionless; yielded volume vanishes. The mean gap u has no negative gaps: points
that yield are flattened. A, A_yield and F go over to the elastic contact as eta grows, and to the bearing curve,
A = A_yield = x and F = eta Q(u), as it falls.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import erfinv, ndtri

from mbma_tables.arguments import FloatArray, rows
from mbma_tables.bearing_curve import BearingCurve as BearingCurve
from mbma_tables.bearing_curve import bearing_share as bearing_share
from mbma_tables.bearing_curve import filled
from mbma_tables.core import core


@dataclasses.dataclass(frozen=True)
class Constants:
    """The law's constants, fitted to boundary elements."""

    area_power: float = 3.196  # a and b of S for the contact area,
    area_scale: float = 0.6301
    yield_power: float = 2.426  # and for its yielded part
    yield_scale: float = 0.7138
    force_light: float = 1.119  # n0, c and d of the exponent n
    force_eta: float = 1.767
    force_share: float = 0.4736
    frozen: float = 0.3685  # e and f of the frozen contact's stiffness
    frozen_eta: float = 0.2407
    plane_eta: float = 3.375  # between mean planes interpenetration falls as exp(-(plane_eta - plane_load x) eta)
    plane_load: float = 2.505

    @property
    def exponent(self) -> tuple[float, float, float]:
        """n0, c and d."""
        return self.force_light, self.force_eta, self.force_share


CONSTANTS = Constants()


def area(force: ArrayLike, elastic_area: ArrayLike, eta: ArrayLike, constants: Constants = CONSTANTS) -> FloatArray:
    """A/A0 at F/(A0 E* g), at most eta, from the elastic A/A0 at that force; above 1 only where that is."""
    return np.maximum(elastic_area, 1.0) * _between_walls(
        force, elastic_area, eta, (constants.area_power, constants.area_scale), 0
    )


def yielded_area(
    force: ArrayLike, elastic_area: ArrayLike, eta: ArrayLike, constants: Constants = CONSTANTS
) -> FloatArray:
    """Yielded part of A/A0, likewise."""
    return _between_walls(force, elastic_area, eta, (constants.yield_power, constants.yield_scale), 1)


def _between_walls(
    force: ArrayLike, elastic_area: ArrayLike, eta: ArrayLike, numbers: tuple[float, float], yielded: int
) -> FloatArray:
    known, shape = rows(force, erfinv(np.minimum(elastic_area, 1.0)), eta)
    return filled(core.capped_area, known, np.empty(known.shape[1]), *numbers, yielded).reshape(shape)


def diffused(x: ArrayLike, tau: ArrayLike, sign: float) -> FloatArray:
    """Share of a diffusion from x, between walls at 0 and 1, after a variance of 2 tau.

    What has not ended at 0, or with a negative `sign` what has ended at 1.
    """
    known, shape = rows(x, tau)
    return filled(core.diffused, known, np.empty(known.shape[1]), int(sign < 0)).reshape(shape)


def force(
    elastic_force: ArrayLike,
    stiffness: ArrayLike,
    share: ArrayLike,
    slope: ArrayLike,
    eta: ArrayLike,
    constants: Constants = CONSTANTS,
) -> tuple[FloatArray, FloatArray]:
    """F/(A0 E* g) at a mean gap u and -dF/du, from the elastic force and stiffness, and from Q and dQ/du, there."""
    known, shape = rows(elastic_force, stiffness, share, slope, eta)
    found, steep = filled(core.capped_force, known, np.empty((2, known.shape[1])), *constants.exponent)
    return found.reshape(shape), steep.reshape(shape)


def frozen_factor(eta: ArrayLike, constants: Constants = CONSTANTS) -> FloatArray:
    """Stiffness of the frozen contact over the elastic -dF/du at the same mean gap."""
    return np.asarray(1 + constants.frozen * np.exp(-np.asarray(eta, float) / constants.frozen_eta))


def plane_separation(u: ArrayLike, load: ArrayLike, eta: ArrayLike, constants: Constants = CONSTANTS) -> FloatArray:
    """Gap between mean planes [h_rms] at mean gap u and x = F/(p_m A0): less by what yielded points are flattened."""
    x, cap = np.asarray(load, float), np.asarray(eta, float)
    d = -ndtri(x)
    with np.errstate(invalid="ignore"):
        flattened = np.where(x > 0, np.exp(-d * d / 2) / np.sqrt(2 * np.pi) - d * x, 0.0)
    return np.asarray(u - flattened * np.exp(-(constants.plane_eta - constants.plane_load * x) * cap))
