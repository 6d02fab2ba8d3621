"""From an island's approach delta to its band, radii, densities, X and mu, on a surface that is its own spectrum.

Lengths are the surface's own. With T(q) = m_0(q..q_1), the roughness finer than q, the paper's (27) and (30) read

    T(q_d) = (4 beta/3 delta s/h_rms)^2,   T(q_u) = (phi/(1 + phi) delta)^2,   h_d = sqrt(T(q_d)),

with floors of q_d and q_u at multiples of q_L, the spectrum's `longest`. On a self-affine spectrum these are the
paper's equations; s/h_rms = (1 - zeta_1^(-2H))^(-1/2) is theirs alone, and 1 on any other.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.errors import OutOfRangeError
from mbma_tables.surfaces.measured import MeasuredSurface
from mbma_tables.surfaces.power_laws import Place
from mbma_tables.surfaces.readings import Reading
from mbma_tables.surfaces.spectrum import BROADENING, RADIUS


class Floors(NamedTuple):
    """Where q_d and q_u reach their floors, and how fast the roots of T rise with delta until then."""

    at_d: Place
    at_u: Place
    root_d: float  # sqrt(T) at the floor [length]
    root_u: float
    slope_d: float  # sqrt(T(q_d)) over delta
    slope_u: float

    @property
    def kinks(self) -> tuple[float, float]:
        """delta at which q_d and q_u reach their floors [length]."""
        return self.root_d / self.slope_d, self.root_u / self.slope_u


def s_over_h_rms(surface: MeasuredSurface) -> float:
    """(1 - zeta_1^(-2H))^(-1/2) of a self-affine spectrum, 1 of any other."""
    if surface.hurst is None:
        return 1.0
    return float(1 / np.sqrt(-np.expm1(-2 * surface.hurst * np.log(surface.zeta_1))))


def floors_of(surface: MeasuredSurface, reading: Reading) -> Floors:
    """The floors of a reading.

    Raises
    ------
    OutOfRangeError
        Where the spectrum ends below the floor of q_u.
    """
    if not surface.q1 > reading.floor_u * surface.longest:
        raise OutOfRangeError(
            f"the spectrum ends at q = {surface.q1:.4g}, and MBMA's smallest band at {reading.floor_u:g} times "
            f"{surface.longest:.4g}, where most height is: measure shorter waves, or ask another theory"
        )
    at_d, at_u = (surface.laws.place(floor * surface.longest) for floor in (reading.floor_d, reading.floor_u))
    root_d, root_u = (float(np.sqrt(surface.laws.above(place))) for place in (at_d, at_u))
    slope_u = reading.phi / (1 + reading.phi)
    return Floors(at_d, at_u, root_d, root_u, 4 / 3 * reading.beta * s_over_h_rms(surface), slope_u)


def measured_islands(surface: MeasuredSurface, delta: FloatArray, reading: Reading) -> dict[str, FloatArray]:
    """`islands.geometry.FIELDS` of islands at approaches delta > 0 [length], in powers of length."""
    laws, floors = surface.laws, floors_of(surface, reading)

    def place(root: FloatArray, largest: float, floor: Place) -> Place:
        free = laws.where_above_is(np.minimum(root, largest) ** 2)
        held = root >= largest
        return Place(np.where(held, floor.piece, free.piece), np.where(held, floor.rest, free.rest))

    root_a, root_b = floors.slope_d * delta, floors.slope_u * delta
    at_d, at_u = place(root_a, floors.root_d, floors.at_d), place(root_b, floors.root_u, floors.at_u)
    root_a, root_b = np.minimum(root_a, floors.root_d), np.minimum(root_b, floors.root_u)

    def sigma_of(m0: FloatArray, m2: FloatArray, m4: FloatArray) -> FloatArray:
        # (m2/m0) (m2/m4): squares of small moments might underflow
        share = 1 - BROADENING * (m2 / m0) * (m2 / m4) if reading.summit_sigma else 1.0
        return np.sqrt(m0 * share)

    m2, m4 = (laws.between(order, at_d, at_u) for order in (2, 4))
    below_0, below_2, below_4 = (laws.below(order, at_d) for order in (0, 2, 4))
    D = m4 / m2 / reading.density_divisor
    sigma = sigma_of((root_a - root_b) * (root_a + root_b), m2, m4)
    R_d, R_u = RADIUS / np.sqrt(below_4), RADIUS / np.sqrt(laws.below(4, at_u))
    D_top, R_top = surface.m4 / surface.m2 / reading.density_divisor, RADIUS / np.sqrt(surface.m4)
    eta = 0.75 * np.cbrt(np.pi * D_top) * np.cbrt(1.5 * R_top) ** 2 * np.cbrt(root_b / (reading.phi * R_u))
    h_d = root_a if reading.offset else np.zeros_like(root_a)
    log_d, log_u = laws.log_q(at_d), laws.log_q(at_u)
    return {
        "zeta_d": np.exp(log_d) / surface.q0,
        "zeta_u": np.exp(log_u) / surface.q0,
        "R_d": R_d,
        "R_u": R_u,
        "D": D,
        "sigma": sigma,
        "h_d": h_d,
        "h_u": root_b,
        "eta": eta,
        "X": (delta - h_d) / sigma,
        "mu": 8 / 3 * D * sigma * np.sqrt(2 * R_u * R_d),
        "D_d": below_4 / below_2 / reading.density_divisor,
        "sigma_d": sigma_of(below_0, below_2, below_4),
        "width": np.where(at_d.piece == at_u.piece, at_d.rest - at_u.rest, log_u - log_d),
    }
