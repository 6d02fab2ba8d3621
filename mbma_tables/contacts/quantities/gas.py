"""Conductance of a gas in the gaps of a contact, by the distribution of gaps; docs/joints.md has the equations."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import (
    FloatArray,
    broadcast_shape,
    finite_array,
    nearest,
    require,
    rows,
)
from mbma_tables.common.errors import InputError
from mbma_tables.common.interrupts import in_blocks
from mbma_tables.common.shared import shared

# constants of q
BEND = 0.3
LIGHT = 0.004
SOFT = 0.3
POWER = 1.2
# d above which it is this much of u/h_rms at most: in the lightest contact s is h_rms
DEEP = 2.5
DEEPEST = 1.25
FIRST = 1e-5  # A/A0 below which gaps go over to those before contact, without a jump
# range of heights in standard deviations, and number of quadrature nodes
TAIL = 8.0
NODES = 96
FULLEST = 1 - 1e-12
# contacts that are computed at a time, each with NODES gaps, which fit into the caches of a
# processor
BLOCK = 1 << 9
# held-out simulations of gaps: jumps [h_rms], root mean square errors, smallest and
# largest A/A0 (docs/joints.md, "Gas in the gaps", by `python -m generate gas`)
JUMPS = (0.03, 0.1, 0.3, 1.0, 3.0)
ERRORS = (0.055, 0.034, 0.019, 0.008, 0.003)
AREAS = (0.001, 0.75)
R = 8.314462618  # J/(mol K)
TEMPERATURES = (200.0, 300.0, 400.0, 500.0, 600.0)  # K


class GasConstants(NamedTuple):
    """A gas at low pressure."""

    mass: float  # kg/mol
    gamma: float  # ratio of specific heats
    accommodation: float  # thermal, on metals as machined
    conductivity: tuple[float, ...]  # W/(m K) at `TEMPERATURES`
    viscosity: tuple[float, ...]  # Pa s, likewise


# conductivities: engineersedge.com/heat_transfer/thermal-conductivity-gases.htm;
# viscosities: air by 1.4592e-6 T^1.5/(T + 109.1) (cableizer.com/documentation/eta_gas),
# helium NIST SRD 134, nitrogen and argon M. L. Huber and A. H. Harvey in the CRC handbook
# (docslib.org/doc/166791/viscosity-of-gases-references); thermal accommodation near 0.95 of
# argon, 0.85 of nitrogen and 0.45 of helium on most metals: W. M. Trott et al., Sandia
# National Laboratories, 2010. Hydrogen is left out: that table ends at 400 K, and its
# accommodation on machined metals was not found
AIR = (
    (0.0184, 0.0262, 0.0333, 0.0397, 0.0457),
    (13.35e-6, 18.53e-6, 22.93e-6, 26.79e-6, 30.25e-6),
)
HELIUM = (
    (0.1193, 0.1567, 0.1906, 0.2223, 0.2524),
    (15.1e-6, 19.9e-6, 24.3e-6, 28.3e-6, 32.2e-6),
)
NITROGEN = (
    (0.0187, 0.0260, 0.0323, 0.0383, 0.0440),
    (12.9e-6, 17.9e-6, 22.2e-6, 26.1e-6, 29.6e-6),
)
ARGON = (
    (0.0124, 0.0179, 0.0226, 0.0268, 0.0306),
    (15.9e-6, 22.7e-6, 28.6e-6, 33.9e-6, 38.8e-6),
)
GASES = {
    "air": GasConstants(28.97e-3, 1.4, 0.85, *AIR),
    "helium": GasConstants(4.0026e-3, 5 / 3, 0.45, *HELIUM),
    "nitrogen": GasConstants(28.014e-3, 1.4, 0.85, *NITROGEN),
    "argon": GasConstants(39.948e-3, 5 / 3, 0.95, *ARGON),
}
VACUUM = "vacuum"
# gases that flow through seals and have no conductance
WITHOUT_ACCOMMODATION = ("hydrogen", "methane")


def checked_gas(
    gas: Any, temperature: ArrayLike, pressure: ArrayLike, accommodation: ArrayLike | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Temperature [K], pressure [Pa] and thermal accommodation of a gas, at which its properties are known."""
    if isinstance(gas, str) and gas in WITHOUT_ACCOMMODATION:
        raise InputError(
            f"{gas} has no conductance here, since its accommodation on machined metals was "
            f"not found in print: give one of {', '.join((*GASES, VACUUM))}"
        )
    if not isinstance(gas, str) or gas not in (*GASES, VACUUM):
        raise InputError(
            f"no gas is named {gas!r}: {nearest(str(gas), [*GASES, VACUUM])}"
        )
    if accommodation is None:
        accommodation = 1.0 if gas == VACUUM else GASES[gas].accommodation
    T = finite_array("temperature", temperature)
    P = finite_array("gas_pressure", pressure)
    share = finite_array("accommodation", accommodation)
    require("accommodation", share, (share > 0) & (share <= 1), "in (0, 1]")
    # without a gas neither temperature nor pressure matters
    if gas != VACUUM:
        low = TEMPERATURES[0]
        high = TEMPERATURES[-1]
        require("temperature", T, (low <= T) & (high >= T), f"from {low:g} to {high:g} K")
        require("gas_pressure", P, P > 0, "positive; 'vacuum' is without a gas")
    broadcast_shape(temperature=T, gas_pressure=P, accommodation=share)
    return T, P, share


def jump_of(
    gas: str,
    temperature: ArrayLike,
    pressure: ArrayLike,
    accommodation: ArrayLike | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Conductivity [W/(m K)] and temperature jump of both faces together [m] of a gas by name.

    Parameters
    ----------
    gas : {"air", "helium", "nitrogen", "argon"}
    temperature, pressure : array_like
        Of the gas [K], from 200 to 600; [Pa].
    accommodation : array_like, optional
        Thermal accommodation coefficient of both faces, in (0, 1].

    Examples
    --------
    >>> from mbma_tables.contacts.quantities.gas import jump_of
    >>> k, jump = jump_of("air", 300.0, 101325.0)
    >>> f"{k:.4f} W/(m K), {1e6 * jump:.2f} um"
    '0.0262 W/(m K), 0.30 um'
    """
    T, P, share = checked_gas(gas, temperature, pressure, accommodation)
    one = GASES[gas]
    k, eta = (
        np.exp(np.interp(np.log(T), np.log(TEMPERATURES), np.log(row)))
        for row in (one.conductivity, one.viscosity)
    )
    prandtl = one.gamma / (one.gamma - 1) * R / one.mass * eta / k
    path = eta / P * np.sqrt(math.pi * R * T / (2 * one.mass))
    return k, 2 * (2 - share) / share * 2 * one.gamma / ((one.gamma + 1) * prandtl) * path


@shared()
def _rule() -> tuple[Any, Any]:
    """Nodes in [0, 1], denser at 0, and weights."""
    x, weight = np.polynomial.legendre.leggauss(NODES)
    t = (x + 1) / 2
    return t**2, weight * t


def mean_inverse(
    u: ArrayLike,
    area: ArrayLike,
    jump: ArrayLike,
    h_rms: ArrayLike,
    eta: ArrayLike = np.inf,
) -> FloatArray:
    """Mean over the nominal area of 1/(g + M) where bodies do not touch [1/length].

    Parameters
    ----------
    u, area : array_like
        Mean gap [length] and A/A0 of the contact.
    jump, h_rms : array_like
        M and root-mean-square height [length], positive.
    eta : array_like
        Hardness over E* times the rms gradient.

    Examples
    --------
    >>> from mbma_tables.contacts.quantities.gas import mean_inverse
    >>> f"{mean_inverse(2.0, 0.02, 0.3, 1.0):.3f}"  # 1/(u + M) is 0.435
    '0.573'
    """
    return _over_gaps(
        lambda density, g, distance: (density / (g + distance)).sum(axis=-1),
        *rows(u, area, jump, h_rms, eta),
    )


def exponent_of_gap(
    u: ArrayLike,
    area: ArrayLike,
    jump: ArrayLike,
    h_rms: ArrayLike,
    eta: ArrayLike = np.inf,
) -> FloatArray:
    """-d ln(`mean_inverse`)/d ln u of gaps that all grow alike, at constant contact area; from 0 to 1.

    Parameters
    ----------
    u, area, jump, h_rms, eta : array_like
        As for `mean_inverse`.

    Examples
    --------
    >>> from mbma_tables.contacts.quantities.gas import exponent_of_gap
    >>> f"{exponent_of_gap(2.0, 0.02, 0.3, 1.0):.2f}"  # u/(u + M) is 0.87
    '0.72'
    """

    def exponent(density: FloatArray, g: FloatArray, distance: FloatArray) -> FloatArray:
        inverse = density / (g + distance)
        falling = (inverse * g / (g + distance)).sum(axis=-1)
        slope: FloatArray = falling / inverse.sum(axis=-1)
        return slope

    return _over_gaps(exponent, *rows(u, area, jump, h_rms, eta))


def _over_gaps(
    reduce: Callable[[FloatArray, FloatArray, FloatArray], FloatArray],
    columns: FloatArray,
    shape: tuple[int, ...],
) -> FloatArray:
    """A function of the shares of gaps, the gaps and the temperature jump, block by block of contacts."""
    reduced = np.empty(columns.shape[1])

    def fill(some: slice) -> None:
        gap, share, distance, height, cap = columns[:, some]
        density, g = open_gaps(gap, share, height, cap)
        reduced[some] = reduce(density, g, distance[:, None])

    in_blocks(fill, reduced.size, BLOCK)
    return reduced.reshape(shape)


def scatter_of_mean(area: ArrayLike, jump: ArrayLike, h_rms: ArrayLike) -> FloatArray:
    """Standard deviation of ln(`mean_inverse`) against simulations, of contacts whose u and A/A0 are known.

    Parameters
    ----------
    area, jump, h_rms : array_like
        As for `mean_inverse`.

    Returns
    -------
    ndarray
        NaN where there was no comparison: of jumps below 0.03 h_rms, and of areas outside
        0.1% to 75%. Of jumps above 3 h_rms, where 1/(g + M) depends less on the gaps, that
        at 3 h_rms.

    Examples
    --------
    >>> from mbma_tables.contacts.quantities.gas import scatter_of_mean
    >>> scatter_of_mean([0.02, 0.02, 1e-5], 0.3, 1.0).tolist()
    [0.019, 0.019, nan]
    """
    share, over_h_rms = np.broadcast_arrays(area, np.asarray(jump) / np.asarray(h_rms))
    compared = (over_h_rms >= JUMPS[0]) & (share >= AREAS[0]) & (share <= AREAS[1])
    logarithm = np.interp(np.log(over_h_rms), np.log(JUMPS), np.log(ERRORS))
    scatter: FloatArray = np.where(compared, np.exp(logarithm), np.nan)
    return scatter


def open_gaps(
    u: ArrayLike,
    area: ArrayLike,
    h_rms: ArrayLike,
    eta: ArrayLike = np.inf,
    blended: bool = False,
) -> tuple[FloatArray, FloatArray]:
    """Shares of the nominal area and gaps there [length] on a last axis of `NODES`, of contacts as for `mean_inverse`.

    The shares add up to that of the open gaps; the mean gap over the nominal area is u.
    Those of light contacts go over into those before contact, `blended` ones from larger
    areas on.
    """
    from scipy.special import ndtri

    gap, share, height, cap = (
        part[..., None] for part in np.broadcast_arrays(u, area, h_rms, eta)
    )
    share = np.minimum(share, FULLEST)
    with np.errstate(divide="ignore"):
        d = np.minimum(
            -ndtri(share), TAIL if blended else np.maximum(DEEPEST * gap / height, DEEP)
        )
    weight = share / (share + (LIGHT if blended else FIRST))
    d = gap / height + (d - gap / height) * weight
    q = 1 + BEND * share / (share + LIGHT) * -np.expm1(-((cap / SOFT) ** POWER))
    node, share_of_node = _rule()
    low = np.maximum(d - TAIL, 0.0)
    high = np.maximum(d + TAIL, 0.0)
    y = low + (high - low) * node
    density = (
        np.exp(-((d - y) ** 2) / 2)
        / math.sqrt(2 * math.pi)
        * share_of_node
        * (high - low)
    )
    bent = y**q
    return density, gap * bent / (density * bent).sum(axis=-1, keepdims=True)
