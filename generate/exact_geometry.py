"""Islands' geometry transcribed from the paper at 60 digits, in units of s and 1/q0."""

import math
import types
from typing import Any

import mpmath

DIGITS = 60
# the functions of mpmath that are used below, in double precision
DOUBLES = types.SimpleNamespace(
    mpf=float, sqrt=math.sqrt, cbrt=math.cbrt, log=math.log, pi=math.pi
)


def exact_island(
    approach: float,
    hurst: float,
    zeta_1: float,
    density_divisor: mpmath.mpf,
    mp: Any = mpmath,
) -> dict[str, mpmath.mpf]:
    """Geometry of the island at delta = approach * h_rms; `density_divisor` as in D = m4/(divisor m2).

    With `DOUBLES` for `mp`, the paper's formulas as printed in double precision.
    """
    with mpmath.workdps(DIGITS):
        delta, h, z1 = (mp.mpf(float(value)) for value in (approach, hurst, zeta_1))
        e = z1 ** (-2 * h)
        s = 1 / mp.sqrt(1 - e)  # in h_rms

        # (27), with the factor 1 - e dropped as printed, and (30)
        zeta_d = max(mp.mpf(3) / 2, ((mp.mpf(4) / 9 * delta) ** 2 + e) ** (-1 / (2 * h)))
        zeta_u = max(mp.mpf(3), ((delta / 21) ** 2 * (1 - e) + e) ** (-1 / (2 * h)))

        def moment(order: int, low: Any, high: Any) -> Any:
            # (31): the spectrum 2 H zeta^(-1-2H), the mean of cos^2 is 1/2, of cos^4 3/8
            power = order - 2 * h
            factor = {0: 2 * h, 2: h, 4: mp.mpf(3) / 4 * h}[order]
            return factor * (
                mp.log(high / low) if power == 0 else (high**power - low**power) / power
            )

        def summits(low: Any, high: Any) -> tuple[Any, Any]:
            # (2): density, and standard deviation of heights
            m0, m2, m4 = (moment(order, low, high) for order in (0, 2, 4))
            alpha = m0 * m4 / m2**2
            return m4 / density_divisor / m2, mp.sqrt((1 - mp.mpf("0.8968") / alpha) * m0)

        def radius(high: Any) -> Any:
            return 3 * mp.sqrt(mp.pi) / 8 / mp.sqrt(moment(4, mp.mpf(1), high))

        D, sigma = summits(zeta_d, zeta_u)
        D_d, sigma_d = summits(mp.mpf(1), zeta_d)
        D_top = summits(mp.mpf(1), z1)[0]
        R_d = radius(zeta_d)
        R_u = radius(zeta_u)
        R_top = radius(z1)
        h_d = mp.sqrt(zeta_d ** (-2 * h) - e)  # (B.3)
        h_u = mp.sqrt(zeta_u ** (-2 * h) - e)  # (B.12)
        # (39), phi = 0.05
        eta = (
            mp.mpf(3)
            / 4
            * mp.cbrt(mp.pi * D_top)
            * mp.cbrt(1.5 * R_top) ** 2
            * mp.cbrt(20 * h_u / R_u)
        )
        X = (delta / s - h_d) / sigma
        mu = mp.mpf(8) / 3 * D * sigma * mp.sqrt(2 * R_u * R_d)
        found = {
            "zeta_d": zeta_d,
            "zeta_u": zeta_u,
            "R_d": R_d,
            "R_u": R_u,
            "D": D,
            "sigma": sigma,
            "h_d": h_d,
        }
        found |= {
            "h_u": h_u,
            "eta": eta,
            "X": X,
            "mu": mu,
            "D_d": D_d,
            "sigma_d": sigma_d,
        }
        return found | {"width": mp.log(zeta_u / zeta_d)}


def divisor(variant: str) -> mpmath.mpf:
    """Nayak's 6 pi sqrt(3), without its pi in `reported`."""
    with mpmath.workdps(DIGITS):
        return 6 * mpmath.sqrt(3) * (mpmath.pi if variant == "printed" else 1)
