"""Pairs of a surface and a gap, flat and in units of h_rms and 1/q0, and where their integrands break."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.islands.geometry import floor_offset
from mbma_tables.surfaces.readings import Reading


@dataclasses.dataclass(frozen=True)
class Pairs:
    """Flat (surface, gap) pairs in units of h_rms and 1/q0."""

    hurst: FloatArray
    zeta_1: FloatArray
    room: FloatArray  # h_rms/s = sqrt(1 - zeta_1^(-2H))
    reach: FloatArray  # (h_max - d)/h_rms
    top: FloatArray  # h_max/h_rms
    layer: FloatArray  # approach at which zeta_d leaves zeta_1, zeta_1^(-H)

    def some(self, chosen: Any) -> Pairs:
        """The pairs at these places."""
        return Pairs(**{f.name: getattr(self, f.name)[chosen] for f in dataclasses.fields(self)})


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


def jacobian_of(reading: Reading, room: FloatArray, below_kink: NDArray[np.bool_]) -> FloatArray:
    """K1 (47), or what (46) gives."""
    share = 4 / 3 * reading.beta
    if reading.jacobian == "printed":
        return np.where(below_kink, 1 - share, 1.0)
    slope = share / room if reading.offset else np.zeros_like(room)
    return np.where(below_kink, 1 - slope, 1.0)
