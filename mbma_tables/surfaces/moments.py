"""From spectral moments back to the band (model: alpha rises with zeta_1 at a given Hurst exponent)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from mbma_tables.arguments import FloatArray, finite_array, require
from mbma_tables.errors import InputError
from mbma_tables.surfaces import spectrum
from mbma_tables.surfaces.surface import LARGEST_ZETA_1, LEAST_ZETA_1


def band_from_moments(
    hurst: ArrayLike, m0: ArrayLike, m2: ArrayLike, m4: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(q0, q1, h_rms) of the self-affine band with these moments; arrays broadcast.

    Raises
    ------
    OutOfRangeError
        Where no band with 3 < zeta_1 <= 1e8 has the ratio alpha = m0 m4/m2^2.
    """
    given = {
        name: finite_array(name, value)
        for name, value in {"hurst": hurst, "m0": m0, "m2": m2, "m4": m4}.items()
    }
    require("hurst", given["hurst"], (given["hurst"] > 0) & (given["hurst"] <= 1), "in (0, 1]")
    for name in ("m0", "m2", "m4"):
        require(name, given[name], given[name] > 0, "positive")
    try:
        h, a, b, c = np.broadcast_arrays(*given.values())
    except ValueError as fault:
        raise InputError(f"hurst, m0, m2 and m4 do not broadcast: {fault}") from None
    alpha = (a / b) * (c / b)
    low, high = math.log(LEAST_ZETA_1), math.log(LARGEST_ZETA_1)
    log_zeta = np.empty(h.shape)
    for place in np.ndindex(h.shape):
        own, target = float(h[place]), float(alpha[place])
        least = spectrum.alpha_of(own, low)
        most = spectrum.alpha_of(own, high)
        inside = np.array(least < target <= most)
        require(
            "alpha = m0 m4/m2^2",
            np.asarray(target),
            inside,
            f"in ({least:.6g}, {most:.6g}], what 3 < zeta_1 <= 1e8 gives at hurst = {own:g}",
        )
        log_zeta[place] = brentq(
            lambda x, own=own, target=target: math.log(spectrum.alpha_of(own, x) / target),
            low,
            high,
            xtol=1e-15,
            rtol=4 * np.finfo(float).eps,
        )
    zeta_1 = np.exp(log_zeta)
    ratio = spectrum.band_moment(2, h, 1.0, zeta_1) / spectrum.band_moment(0, h, 1.0, zeta_1)
    q0 = np.sqrt(b / a / ratio)
    return q0, q0 * zeta_1, np.sqrt(a)
