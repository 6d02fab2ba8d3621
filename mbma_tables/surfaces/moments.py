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


def _interval(least: FloatArray, most: FloatArray) -> str:
    if least.size == 1:
        return f"in ({least.item():.6g}, {most.item():.6g}]"
    return f"between {least.min():.6g} and {most.max():.6g} for these surfaces"


def band_from_moments(
    hurst: ArrayLike, m0: ArrayLike, m2: ArrayLike, m4: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(q0, q1, h_rms) of the self-affine band with these moments; arrays broadcast.

    Raises
    ------
    OutOfRangeError
        Where no band with 3 < zeta_1 <= 1e8 has the ratio alpha = m0 m4/m2^2.
    """
    given = {name: finite_array(name, value) for name, value in {"hurst": hurst, "m0": m0, "m2": m2, "m4": m4}.items()}
    require("hurst", given["hurst"], (given["hurst"] > 0) & (given["hurst"] <= 1), "in (0, 1]")
    for name in ("m0", "m2", "m4"):
        require(name, given[name], given[name] > 0, "positive")
    try:
        h, a, b, c = np.broadcast_arrays(*given.values())
    except ValueError as fault:
        raise InputError(f"hurst, m0, m2 and m4 do not broadcast: {fault}") from None
    alpha = (a / b) * (c / b)
    low, high = math.log(LEAST_ZETA_1), math.log(LARGEST_ZETA_1)
    least, most = (np.vectorize(spectrum.alpha_of)(h, end) for end in (low, high))
    require(
        "alpha = m0 m4/m2^2",
        alpha,
        (alpha > least) & (alpha <= most),
        f"{_interval(least, most)}, what 3 < zeta_1 <= 1e8 gives at this hurst",
    )
    log_zeta = np.empty(h.shape)
    for place in np.ndindex(h.shape):
        log_zeta[place] = brentq(
            lambda x, own=float(h[place]), goal=float(alpha[place]): math.log(spectrum.alpha_of(own, x) / goal),
            low,
            high,
            xtol=1e-15,
            rtol=4 * np.finfo(float).eps,
        )
    zeta_1 = np.exp(log_zeta)
    ratio = spectrum.band_moment(2, h, 1.0, zeta_1) / spectrum.band_moment(0, h, 1.0, zeta_1)
    q0 = np.sqrt(b / a / ratio)
    return q0, q0 * zeta_1, np.sqrt(a)
