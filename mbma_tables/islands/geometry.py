"""From an island's approach delta to its band, radii, densities, X and mu (Section 3.2); heights in s, lengths in 1/q0.

With e = zeta_1^(-2H) the ends are carried as

    zeta_d^(-2H) = e + a,   zeta_u^(-2H) = e + b

so that m0 = a - b, h_d = sqrt(a), h_u = sqrt(b) and log(zeta_u/zeta_d) = log1p((a - b)/(e +
b))/(2H) keep their accuracy when both ends tend to zeta_1, that is for delta to 0.

On a surface given by a spectrum, lengths have its unit. With T(q) = m_0(q..q_1), the
roughness finer than q, the paper's (27) and (30) read

    T(q_d) = (4 beta/3 delta s/h_rms)^2,   T(q_u) = (phi/(1 + phi) delta)^2,   h_d = sqrt(T(q_d)),

with floors of q_d and q_u at multiples of q_L, the spectrum's `longest`, and s^2 = h_rms^2 and
the variance `beyond` q_1. On a self-affine spectrum these are the paper's equations.
"""

from typing import Any, NamedTuple

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.islands.variants import Variant
from mbma_tables.surfaces.spectrum import (
    BROADENING,
    RADIUS,
    Place,
    alpha_of,
    moment_of,
    summit_rate,
)
from mbma_tables.surfaces.surface import MeasuredSurface

# of an island in units of s and 1/q0: zeta_d (27), zeta_u (30), R_d (26), R_u (29), D and
# sigma (32), h_d (B.3), h_u (B.12), eta (39), X = (h_rms/s delta/h_rms - h_d)/sigma, mu =
# 8/3 D sigma sqrt(2 R_u R_d), D_d and sigma_d (43), width = log(zeta_u/zeta_d)
BANDS = (
    "zeta_d",
    "zeta_u",
    "R_d",
    "R_u",
    "D",
    "sigma",
    "h_d",
    "h_u",
    "D_d",
    "sigma_d",
    "width",
)
FIELDS = (*BANDS[:8], "eta", "X", "mu", *BANDS[8:])


def floor_offset(hurst: Any, zeta_1: Any, floor: float) -> Any:
    """floor^(-2H) - zeta_1^(-2H) without cancellation: the largest a (or b) above a floor; of numbers or arrays."""
    e = np.exp(-2.0 * hurst * np.log(zeta_1))
    return e * np.expm1(2.0 * hurst * np.log1p((zeta_1 - floor) / floor))


def kinks(hurst: Any, zeta_1: Any, variant: Variant) -> tuple[Any, Any]:
    """delta/h_rms at which zeta_d (27) and zeta_u (30) reach their floors; arrays of one shape."""
    rms_over_s = np.sqrt(-np.expm1(-2 * hurst * np.log(zeta_1)))
    slope_d = 4 / 3 * variant.beta
    slope_u = variant.phi / (1 + variant.phi) * rms_over_s
    at_d, at_u = (
        np.sqrt(floor_offset(hurst, zeta_1, floor))
        for floor in (variant.floor_d, variant.floor_u)
    )
    return (at_d / slope_d)[()], (at_u / slope_u)[()]


def summit_sigma(m0: Any, alpha: Any, summits: bool) -> Any:
    """Standard deviation of summit heights (2), or of all heights in variants that use these."""
    return np.sqrt((1.0 - (BROADENING / alpha if summits else 0.0)) * m0)


@np.errstate(
    under="ignore", over="ignore"
)  # a square that overflows lies beyond the floors
def geometry(
    approach: FloatArray, hurst: Any, zeta_1: Any, variant: Variant
) -> dict[str, FloatArray]:
    """`FIELDS` of islands at delta/h_rms = approach > 0; arguments of one shape, or numbers for one surface."""
    log_zeta_1 = np.log(zeta_1)
    e = np.exp(-2.0 * hurst * log_zeta_1)
    h_rms = np.sqrt(-np.expm1(-2.0 * hurst * log_zeta_1))  # over s, sqrt(1 - e)

    def end(root: FloatArray, floor: float) -> tuple[FloatArray, ...]:
        """The square root and the square of an end's offset, its log(zeta) and zeta, not below the floor."""
        top = floor_offset(hurst, zeta_1, floor)
        square = root * root
        log_zeta = log_zeta_1 - np.log1p(root * root / e) / (2.0 * hurst)
        held = square >= top
        return (
            np.where(held, np.sqrt(top), root),
            np.where(held, top, square),
            np.where(held, np.log(floor), log_zeta),
            np.where(held, floor, np.exp(log_zeta)),
        )

    root_a, a, log_d, zeta_d = end(4.0 / 3.0 * variant.beta * approach, variant.floor_d)
    root_b, b, log_u, zeta_u = end(
        variant.phi / (1.0 + variant.phi) * h_rms * approach, variant.floor_u
    )
    # the band [zeta_d, zeta_u]; m0 = a - b, and alpha from the width alone
    width = np.log1p((a - b) / (e + b)) / (2.0 * hurst)
    D = summit_rate(hurst, log_d, width) / variant.density_divisor
    # a and b may underflow where their roots do not
    m0_root = np.sqrt(root_a - root_b) * np.sqrt(root_a + root_b)
    sigma = m0_root * summit_sigma(1.0, alpha_of(hurst, width), variant.summit_sigma)
    R_d, R_u, R_top = (
        RADIUS / np.sqrt(moment_of(4, hurst, 0.0, log))
        for log in (log_d, log_u, log_zeta_1)
    )
    D_top = summit_rate(hurst, 0.0, log_zeta_1) / variant.density_divisor
    D_d = summit_rate(hurst, 0.0, log_d) / variant.density_divisor
    sigma_d = summit_sigma(
        moment_of(0, hurst, 0.0, log_d), alpha_of(hurst, log_d), variant.summit_sigma
    )
    bands = zeta_d, zeta_u, R_d, R_u, D, sigma, root_a, root_b, D_d, sigma_d, width
    return _fields(h_rms * approach, bands, D_top, R_top, variant)


def _fields(
    delta: FloatArray,
    bands: tuple[FloatArray, ...],
    D_top: Any,
    R_top: Any,
    variant: Variant,
) -> dict[str, FloatArray]:
    """`FIELDS` of islands from their bands, and from the summits of all wavelengths (top)."""
    _, _, R_d, R_u, D, sigma, root_a, root_b, _, _, _ = bands
    h_d = root_a if variant.offset else np.zeros_like(root_a)
    return dict(zip(BANDS, bands, strict=True)) | {
        "h_d": h_d,
        "eta": 0.75
        * np.cbrt(np.pi * D_top)
        * np.cbrt(1.5 * R_top) ** 2
        * np.cbrt(root_b / (variant.phi * R_u)),
        "X": (delta - h_d) / sigma,
        "mu": 8.0 / 3.0 * D * sigma * np.sqrt(2.0 * R_u * R_d),
    }


class Floors(NamedTuple):
    """Values at which q_d and q_u reach their floors, and the slopes of the roots of T in delta up to there."""

    at_d: Place
    at_u: Place
    root_d: float  # sqrt(T) at the floor [length]
    root_u: float
    slope_d: float  # sqrt(T(q_d)) over delta
    slope_u: float


def s_over_h_rms(surface: MeasuredSurface) -> float:
    """s/h_rms: s^2 is h_rms^2 and the variance beyond q1, if the spectrum went on there.

    (1 - zeta_1^(-2H))^(-1/2) of a self-affine spectrum.
    """
    return float(np.sqrt(1 + surface.beyond / surface.m0))


def floors_of(surface: MeasuredSurface, variant: Variant) -> Floors:
    """The floors of a variant; an error if the spectrum ends below that of q_u."""
    if not surface.q1 > variant.floor_u * surface.longest:
        raise OutOfRangeError(
            f"the spectrum ends at q = {surface.q1:.4g}, and MBMA's smallest band at {variant.floor_u:g} times "
            f"{surface.longest:.4g}, where most height is: measure shorter wavelengths, or use another theory"
        )
    at_d, at_u = (
        surface.laws.place(floor * surface.longest)
        for floor in (variant.floor_d, variant.floor_u)
    )
    root_d, root_u = (float(np.sqrt(surface.laws.above(place))) for place in (at_d, at_u))
    slope_u = variant.phi / (1 + variant.phi)
    return Floors(
        at_d, at_u, root_d, root_u, 4 / 3 * variant.beta * s_over_h_rms(surface), slope_u
    )


def measured_islands(
    surface: MeasuredSurface, delta: FloatArray, variant: Variant
) -> dict[str, FloatArray]:
    """`islands.geometry.FIELDS` of islands at approaches delta > 0 [length], in powers of length."""
    laws = surface.laws
    floors = floors_of(surface, variant)

    def place(root: FloatArray, largest: float, floor: Place) -> Place:
        free = laws.where_above_is(np.minimum(root, largest) ** 2)
        held = root >= largest
        return Place(
            np.where(held, floor.piece, free.piece), np.where(held, floor.rest, free.rest)
        )

    root_a = floors.slope_d * delta
    root_b = floors.slope_u * delta
    at_d = place(root_a, floors.root_d, floors.at_d)
    at_u = place(root_b, floors.root_u, floors.at_u)
    root_a = np.minimum(root_a, floors.root_d)
    root_b = np.minimum(root_b, floors.root_u)

    def sigma_of(m0: FloatArray, m2: FloatArray, m4: FloatArray) -> FloatArray:
        # (m2/m0) (m2/m4): squares of small moments might underflow
        share = 1 - BROADENING * (m2 / m0) * (m2 / m4) if variant.summit_sigma else 1.0
        return np.sqrt(m0 * share)

    m2, m4 = (laws.between(order, at_d, at_u) for order in (2, 4))
    below_0, below_2, below_4 = (laws.below(order, at_d) for order in (0, 2, 4))
    D = m4 / m2 / variant.density_divisor
    sigma = sigma_of((root_a - root_b) * (root_a + root_b), m2, m4)
    R_d = RADIUS / np.sqrt(below_4)
    R_u = RADIUS / np.sqrt(laws.below(4, at_u))
    D_top = surface.m4 / surface.m2 / variant.density_divisor
    R_top = RADIUS / np.sqrt(surface.m4)
    log_d = laws.log_q(at_d)
    log_u = laws.log_q(at_u)
    D_d = below_4 / below_2 / variant.density_divisor
    sigma_d = sigma_of(below_0, below_2, below_4)
    width = np.where(at_d.piece == at_u.piece, at_d.rest - at_u.rest, log_u - log_d)
    zeta_d = np.exp(log_d) / surface.q0
    zeta_u = np.exp(log_u) / surface.q0
    bands = zeta_d, zeta_u, R_d, R_u, D, sigma, root_a, root_b, D_d, sigma_d, width
    return _fields(delta, bands, D_top, R_top, variant)
