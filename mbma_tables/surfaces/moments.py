"""From spectral moments back to the band."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.arguments import FloatArray, broadcast_shape, finite_array, require
from mbma_tables.surfaces import spectrum

MIN_ZETA_1, MAX_ZETA_1 = 3.0, 1e8  # of a whole surface; above 3 for the floors 1.5 and 3 of (27), (30)


def band_from_moments(
    hurst: ArrayLike, m0: ArrayLike, m2: ArrayLike, m4: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(q0, q1, h_rms) of the self-affine band with these moments; arrays broadcast. See `Surface.from_moments`."""
    from scipy.optimize import brentq

    given = {name: finite_array(name, value) for name, value in {"hurst": hurst, "m0": m0, "m2": m2, "m4": m4}.items()}
    require("hurst", given["hurst"], (given["hurst"] > 0) & (given["hurst"] <= 1), "in (0, 1]")
    for name in ("m0", "m2", "m4"):
        require(name, given[name], given[name] > 0, "positive")
    shape = broadcast_shape(**given)
    h, a, b, c = (np.broadcast_to(array, shape) for array in given.values())
    # alpha rises with zeta_1 at a given Hurst exponent
    alpha = (a / b) * (c / b)
    low, high = math.log(MIN_ZETA_1), math.log(MAX_ZETA_1)
    least, most = (np.vectorize(spectrum.alpha_of)(h, end) for end in (low, high))
    allowed = f"({least.min():.6g}, {most.max():.6g}]" if least.size == 1 else "the range"
    require(
        "alpha = m0 m4/m2^2",
        alpha,
        (alpha > least) & (alpha <= most),
        f"in {allowed} that 3 < zeta_1 <= 1e8 gives at this hurst",
    )
    log_zeta = np.empty(shape)
    for place in np.ndindex(shape):
        goal = float(alpha[place])
        log_zeta[place] = brentq(
            lambda x, hurst=float(h[place]), goal=goal: math.log(spectrum.alpha_of(hurst, x) / goal),
            low,
            high,
            xtol=1e-15,
            rtol=4 * np.finfo(float).eps,
        )
    zeta_1 = np.exp(log_zeta)
    q0 = np.sqrt(b / a / (spectrum.band_moment(2, h, 1.0, zeta_1) / spectrum.band_moment(0, h, 1.0, zeta_1)))
    return q0, q0 * zeta_1, np.sqrt(a)
