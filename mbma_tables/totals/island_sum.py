"""The sum over islands for any model: adaptive quadrature of a batch of pairs (Eqs. 44-49)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.errors import ConvergenceError
from mbma_tables.models import IslandModel
from mbma_tables.models.protocol import AREA, BOTH, FORCE
from mbma_tables.surfaces.readings import Reading
from mbma_tables.totals.gauss_kronrod import integrate
from mbma_tables.totals.intervals import STRETCH
from mbma_tables.totals.island import geometry, scale_area, scale_force
from mbma_tables.totals.pairs import Pairs, jacobian_of, kinks


def sum_islands(
    pairs: Pairs, reading: Reading, model: IslandModel, rtol: float, outside: str = "raise", which: int = BOTH
) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    """F/(A0 E* q0 s), A/A0, the bound on their relative error, and the islands evaluated.

    Of the two, the one that `which` leaves out is not told.
    """
    count = pairs.reach.size
    kink_d, kink_u = kinks(pairs.hurst, pairs.zeta_1, reading)
    worst_island = np.zeros(count)

    # as in `intervals`: approach = scale sinh(t)^2 up to the floor of zeta_d, and from there on as it is
    scale = STRETCH * pairs.layer
    turn = np.arcsinh(np.sqrt(kink_d / scale))

    def to_grid(approach: FloatArray) -> FloatArray:
        curved = np.arcsinh(np.sqrt(np.minimum(approach, kink_d) / scale))
        grid: FloatArray = curved + np.maximum(approach - kink_d, 0.0)
        return grid

    def integrand(owner: NDArray[np.intp], t: FloatArray) -> FloatArray:
        own_scale, own_turn, own_kink, room, hurst, zeta_1 = (
            np.broadcast_to(field[owner, None], t.shape)
            for field in (scale, turn, kink_d, pairs.room, pairs.hurst, pairs.zeta_1)
        )
        curved = np.minimum(t, own_turn)
        approach = np.where(t < own_turn, own_scale * np.sinh(curved) ** 2, own_kink + (t - own_turn))
        stretch = np.where(t < own_turn, own_scale * np.sinh(2 * curved), 1.0)
        g = geometry(approach, hurst, zeta_1, reading)
        try:
            phi = model.of_islands(g | {"hurst": hurst}, outside, which)
        except ConvergenceError as fault:
            failed = np.zeros(count, dtype=bool)
            failed[owner[fault.mask.any(axis=1)]] = True
            raise ConvergenceError(f"an island failed: {fault}", failed) from fault
        with np.errstate(invalid="ignore"):
            np.maximum.at(worst_island, owner, phi.error.max(axis=1))
        # z_max/s counted down from h_max, where nothing cancels near first contact
        below_top = pairs.reach[owner, None] - approach
        height = (pairs.top[owner, None] - below_top) * room - g["h_d"]
        weight = (
            g["D_d"]
            * np.exp(-0.5 * (height / g["sigma_d"]) ** 2)
            / (math.sqrt(2 * math.pi) * g["sigma_d"])
            * jacobian_of(reading, room, approach < own_kink)
            * room
            * stretch
        )
        parts = []
        if which != AREA:
            parts.append(scale_force(g) * phi.phi_F * weight)
        if which != FORCE:
            parts.append(scale_area(g) * phi.phi_A * weight)
        return np.stack(parts, axis=-1)

    everyone = np.arange(count)
    edges = [np.minimum(k, pairs.reach) for k in (kink_d, kink_u)]
    breaks = np.sort(np.stack([np.zeros(count), *edges, np.maximum(pairs.reach, 0)]), axis=0)
    low, high = (to_grid(np.maximum(b, 0)) for b in (breaks[:-1], breaks[1:]))
    owner = np.broadcast_to(everyone, low.shape)
    filled = high > low
    found = integrate(integrand, owner[filled], low[filled], high[filled], count, rtol)
    error = found.error.max(axis=1) + worst_island
    return found.value[:, 0], found.value[:, -1], error, found.evaluations
