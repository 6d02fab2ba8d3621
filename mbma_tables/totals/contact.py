"""Total force and area of a surface at a gap: the sum over its contact islands (Eqs. 44-50).

Everything of an island depends on its approach delta alone; the gap enters through the Gaussian weight and
the upper limit h_max - d. In units of s and 1/q0,

    F/(A0 E* q0 s) = integral_0^((h_max - d)/s) F_hat D_d K1 G d(delta/s),
    G = exp(-z'^2/2 sigma_d^2)/(sqrt(2 pi) sigma_d),   z' = (d + delta)/s - h_d (41),

and A/A0 likewise.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.arguments import FloatArray, broadcast_shape, finite_array, require
from mbma_tables.errors import ConvergenceError
from mbma_tables.islands.geometry import floor_offset
from mbma_tables.islands.island import geometry, scale_area, scale_force
from mbma_tables.models import IslandModel, get_model
from mbma_tables.surfaces.readings import Reading, get_reading
from mbma_tables.surfaces.surface import Surface
from mbma_tables.totals.quadrature import integrate


@dataclasses.dataclass(frozen=True, eq=False)
class Contact:
    """Force and area at given separations; arrays of the broadcast shape.

    Attributes
    ----------
    separation : ndarray
        d, between the rigid plane and the mid-plane [length].
    mean_separation : ndarray
        u = (h_max + d)/2 (50) [length].
    force : ndarray
        F/A0 in the unit of E_star; F/(A0 E*) where that is 1.
    area : ndarray
        A/A0. The model does not end at 1 under full compression, and this is not clamped.
    error : ndarray
        Bound on the relative error of both, of quadrature and island solutions together.
    reading, tier : str
        What made them.
    islands : int
        Islands evaluated.
    """

    separation: Any
    mean_separation: Any
    force: Any
    area: Any
    error: Any
    reading: str
    tier: str
    islands: int


@dataclasses.dataclass(frozen=True)
class _Pairs:
    """Flat (surface, gap) pairs in units of h_rms and 1/q0."""

    hurst: FloatArray
    zeta_1: FloatArray
    room: FloatArray  # h_rms/s = sqrt(1 - zeta_1^(-2H))
    reach: FloatArray  # (h_max - d)/h_rms
    top: FloatArray  # h_max/h_rms
    layer: FloatArray  # approach at which zeta_d leaves zeta_1, zeta_1^(-H)


def kinks(hurst: Any, zeta_1: Any, reading: Reading) -> tuple[Any, Any]:
    """delta/h_rms at which zeta_d (27) and zeta_u (30) reach their floors; arrays of one shape."""
    h, z = np.broadcast_arrays(np.asarray(hurst, dtype=float), np.asarray(zeta_1, dtype=float))
    at_d, at_u = np.empty(h.shape), np.empty(h.shape)
    for place in np.ndindex(h.shape):
        own, most = float(h[place]), float(z[place])
        room = math.sqrt(-math.expm1(-2 * own * math.log(most)))
        at_d[place] = math.sqrt(floor_offset(own, most, reading.floor_d)) / (4 / 3 * reading.beta)
        at_u[place] = math.sqrt(floor_offset(own, most, reading.floor_u)) * (1 + reading.phi) / (reading.phi * room)
    return at_d[()], at_u[()]


def _jacobian(reading: Reading, room: FloatArray, below_kink: NDArray[np.bool_]) -> FloatArray:
    """K1 (47), or what (46) gives."""
    share = 4 / 3 * reading.beta
    if reading.jacobian == "printed":
        return np.where(below_kink, 1 - share, 1.0)
    slope = share / room if reading.offset else np.zeros_like(room)
    return np.where(below_kink, 1 - slope, 1.0)


def _totals(
    pairs: _Pairs, reading: Reading, model: IslandModel, rtol: float
) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    """F/(A0 E* q0 s), A/A0, the bound on their relative error, and the islands evaluated."""
    count = pairs.reach.size
    kink_d, kink_u = kinks(pairs.hurst, pairs.zeta_1, reading)
    worst_island = np.zeros(count)

    def to_grid(approach: FloatArray, layer: FloatArray) -> FloatArray:
        # approach = layer sinh(t)^2: a power at 0, geometric beyond the boundary layer
        return np.arcsinh(np.sqrt(approach / layer))

    def integrand(owner: NDArray[np.intp], t: FloatArray) -> FloatArray:
        layer, room, hurst, zeta_1 = (
            np.broadcast_to(field[owner, None], t.shape)
            for field in (pairs.layer, pairs.room, pairs.hurst, pairs.zeta_1)
        )
        approach = layer * np.sinh(t) ** 2
        g = geometry(approach, hurst, zeta_1, reading)
        try:
            phi = model.answer(g["X"], g["mu"])
        except ConvergenceError as fault:
            failed = np.zeros(count, dtype=bool)
            failed[owner[fault.mask.any(axis=1)]] = True
            raise ConvergenceError(f"an island failed: {fault}", failed) from fault
        np.maximum.at(worst_island, owner, phi.error.max(axis=1))
        # z_max/s counted down from h_max, where nothing cancels near first contact
        below_top = pairs.reach[owner, None] - approach
        height = (pairs.top[owner, None] - below_top) * room - g["h_d"]
        weight = (
            g["D_d"]
            * np.exp(-0.5 * (height / g["sigma_d"]) ** 2)
            / (math.sqrt(2 * math.pi) * g["sigma_d"])
            * _jacobian(reading, room, approach < kink_d[owner, None])
            * room
            * layer
            * np.sinh(2 * t)
        )
        force = scale_force(g) * phi.phi_F * weight
        area = scale_area(g) * phi.phi_A * weight
        return np.stack([force, area], axis=-1)

    everyone = np.arange(count)
    edges = [np.minimum(k, pairs.reach) for k in (kink_d, kink_u)]
    breaks = np.sort(np.stack([np.zeros(count), *edges, np.maximum(pairs.reach, 0)]), axis=0)
    low, high = (to_grid(np.maximum(b, 0), pairs.layer) for b in (breaks[:-1], breaks[1:]))
    owner = np.broadcast_to(everyone, low.shape)
    filled = high > low
    found = integrate(integrand, owner[filled], low[filled], high[filled], count, rtol, components=2)
    error = found.error.max(axis=1) + worst_island
    return found.value[:, 0], found.value[:, 1], error, found.evaluations


def contact(
    surface: Surface,
    separation: ArrayLike,
    tier: str = "exact",
    reading: str | Reading = "reported",
    E_star: ArrayLike = 1.0,
    rtol: float = 1e-8,
) -> Contact:
    """Force and real contact area of a surface at given separations (Eqs. 48, 49).

    Parameters
    ----------
    surface : Surface
        One surface or a batch; it broadcasts against `separation`.
    separation : array_like
        d between the rigid plane and the mid-plane [length], at least -h_max (full compression). From h_max
        on there is no contact, and force and area are zero.
    tier : {"exact", "rigid"}
        The island model: the full solver, or spheres that do not deform, in closed form.
    reading : {"reported", "printed"} or Reading
        Which reading of the paper's equations.
    E_star : array_like
        Effective modulus, (1 - nu1^2)/E1 + (1 - nu2^2)/E2 inverted; force is in its unit.
    rtol : float
        Relative error asked of force and area, in [1e-11, 0.1].

    Returns
    -------
    Contact

    Raises
    ------
    InputError, OutOfRangeError
        For NaN, infinite or empty input and separations below -h_max.
    ConvergenceError
        Where the accuracy was not reached; its `mask` says which entries.
    """
    gap = finite_array("separation", separation)
    modulus = finite_array("E_star", E_star)
    require("E_star", modulus, modulus > 0, "positive")
    rule = get_reading(reading)
    model = get_model(tier, rtol)
    shape = broadcast_shape(separation=gap, surface=surface.hurst, E_star=modulus)
    gap = np.broadcast_to(gap, shape)
    h_max = np.broadcast_to(np.asarray(surface.h_max), shape)
    require("separation", gap, gap >= -h_max, "at least -h_max, where the model ends")

    def flat(field: Any) -> FloatArray:
        return np.broadcast_to(np.asarray(field, dtype=float), shape).ravel()

    room = flat(surface.h_rms / surface.s)
    zeta_1, hurst = flat(surface.zeta_1), flat(surface.hurst)
    pairs = _Pairs(
        hurst=hurst,
        zeta_1=zeta_1,
        room=room,
        reach=((h_max - gap) / surface.h_rms).ravel(),
        top=flat(surface.h_max / surface.h_rms),
        layer=np.exp(-hurst * np.log(zeta_1)),
    )
    try:
        force, area, error, islands = _totals(pairs, rule, model, 0.5 * rtol)
    except ConvergenceError as fault:
        fault.mask = fault.mask.reshape(shape)
        raise
    stress = modulus * surface.q0 * surface.s
    return Contact(
        separation=gap[()],
        mean_separation=((h_max + gap) / 2)[()],
        force=(force.reshape(shape) * stress)[()],
        area=area.reshape(shape)[()],
        error=error.reshape(shape)[()],
        reading=rule.name,
        tier=model.name,
        islands=islands,
    )
