"""The distribution of gaps of an elastic contact, from its mean gap and area; docs/adhesion.md has the equations.

Lay points of the surface in the order of their gaps, with a share t of the open ones below.
Had the surface kept its Gaussian heights, with the highest share A/A0 of them in contact, the
gap there would be y(t), in units of h_rms. Gaps g follow from y: ::

    ln g = ln u + C + (3/2) ln y + c y/(y + y1) - (1/2) ln(1 + k y)
    c = rise ln(spread alpha)    y1 = reach exp(-narrowing D)    k = bend alpha^power

with Nayak's parameter alpha, D the level of Gaussian heights that a share A/A0 exceeds, and C
from the mean gap u. Beside the edges of contact g rises as y^(3/2), so that the density of gaps is that of
Hertz, g^(-1/3); far above light contacts g is y less a constant, the gaps of heights that
nothing deforms.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.common.arguments import FloatArray, grouped
from mbma_tables.common.shared import shared

NODES = 64
FULLEST = 1 - 1e-12  # A/A0 above which contacts count as this full
# D above which it is this much of u/h_rms at most: in the lightest contact heights are those
# of the whole surface
DEEP = 2.5
DEEPEST = 1.25
EDGE = 2 / 3  # power of a small gap that its share beside contact edges rises with
SHARPNESS = 20.0
FARTHEST = 3.0  # D up to which constants depend on it, a little beyond contacts simulated
# held-out simulations: contact fractions, ranges over h_rms, and there the root mean square
# errors of ln of the mean of exp(-g/range), by `python -m generate gaps --fit`
AREAS = (0.003, 0.01, 0.03, 0.1, 0.3, 0.6, 0.9)
RANGES = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0)
ERRORS = (
    (0.21, 0.2, 0.16, 0.15, 0.055, 0.0084),
    (0.17, 0.15, 0.12, 0.12, 0.041, 0.0063),
    (0.1, 0.092, 0.075, 0.055, 0.017, 0.0028),
    (0.051, 0.041, 0.037, 0.029, 0.0086, 0.0014),
    (0.04, 0.036, 0.026, 0.014, 0.0039, 0.00066),
    (0.054, 0.044, 0.025, 0.01, 0.0021, 0.00032),
    (0.089, 0.059, 0.024, 0.0069, 0.0011, 0.00014),
)
ALPHAS = (3.5, 400.0)  # of the surfaces simulated


@dataclasses.dataclass(frozen=True)
class GapConstants:
    """Constants of the distribution, fitted to boundary elements by `python -m generate gaps`."""

    rise: float = 0.539
    spread: float = 1.75
    reach: float = 0.931
    narrowing: float = 0.496
    bend: float = 1.13
    power: float = 0.594


CONSTANTS = GapConstants()


@shared()
def rule() -> tuple[FloatArray, FloatArray]:
    """Shares t of the open area, denser at both ends and most at 0, and weights."""
    x, weight = np.polynomial.legendre.leggauss(NODES)
    x = (x + 1) / 2
    return x**3 * (4 - 3 * x), weight / 2 * 12 * x**2 * (1 - x)


def level(u_over_h_rms: FloatArray, area: FloatArray) -> FloatArray:
    """D, the level of Gaussian heights over h_rms that a share `area` exceeds; of bodies apart, about their gap."""
    from scipy.special import ndtri

    with np.errstate(divide="ignore"):
        of_area = -ndtri(np.minimum(area, FULLEST))
    return _smaller(of_area, -_smaller(-DEEPEST * u_over_h_rms, -DEEP))


def _smaller(one: FloatArray, other: ArrayLike) -> FloatArray:
    """About the smaller of two numbers, smooth where they are equal: laws are derived from it."""
    return -np.logaddexp(-SHARPNESS * one, -SHARPNESS * np.asarray(other)) / SHARPNESS


def open_gaps(
    u: ArrayLike,
    area: ArrayLike,
    alpha: ArrayLike,
    h_rms: ArrayLike = 1.0,
    constants: GapConstants = CONSTANTS,
) -> tuple[FloatArray, FloatArray]:
    """Shares of the nominal area and gaps there [length], rising, on a last axis of `NODES`.

    The shares add up to that of the open gaps, 1 - A/A0; the mean gap over the nominal area
    is u.

    Parameters
    ----------
    u, area, alpha, h_rms : array_like
        Mean gap [length], A/A0, m0 m4/m2^2 and root-mean-square height [length].

    Examples
    --------
    >>> import numpy as np
    >>> from mbma_tables.theories.gap_law import open_gaps
    >>> share, gap = open_gaps(0.7, 0.1, 10.0)
    >>> f"{share.sum():.3f} {(share * gap).sum():.3f} {(share * np.exp(-gap / 0.1)).sum():.4f}"
    '0.900 0.700 0.0805'
    """
    from scipy.special import ndtr, ndtri

    mean, contact, nayak, height = (
        part[..., None] for part in np.broadcast_arrays(u, area, alpha, h_rms)
    )
    mean, contact = np.asarray(mean, float), np.minimum(contact, FULLEST)
    t, weight = rule()
    d = level(mean / height, contact)
    # by the tail of heights that is the smaller share
    covered = ndtr(-d)
    is_light = d > 0
    tail = np.where(is_light, covered + t * (1 - covered), (1 - covered) * (1 - t))
    y = np.where(is_light, 1.0, -1.0) * ndtri(tail) + d
    scale = _smaller(d, FARTHEST)
    c = constants.rise * np.log(np.maximum(constants.spread * nayak, 1.0))
    y1 = constants.reach * np.exp(-constants.narrowing * scale)
    k = constants.bend * nayak**constants.power
    g = y * np.sqrt(y / (1 + k * y)) * np.exp(c * y / (y + y1))
    share = weight * (1 - contact)
    with np.errstate(invalid="ignore", divide="ignore"):
        scaled = g * (mean / (share * g).sum(axis=-1, keepdims=True))
    return share, np.where(mean > 0, scaled, 0.0)


def untested(alpha: ArrayLike, area: FloatArray) -> dict[str, Any]:
    """Reasons why the distribution of gaps was not compared with simulations, each with a mask."""
    least, most = ALPHAS
    lightest, heaviest = AREAS[0], AREAS[-1]
    shape = np.shape(area)
    nayak = np.broadcast_to(alpha, shape)
    return {
        f"gaps: alpha = m0 m4/m2^2 is below {least:g}, the least that was simulated": (
            nayak < least
        ),
        f"gaps: alpha = m0 m4/m2^2 is above {most:g}, the largest that was simulated": (
            nayak > most
        ),
        f"gaps: A/A0 is below {lightest:g}, the lightest contact that was simulated": (
            area < lightest
        ),
        f"gaps: A/A0 is above {heaviest:g}, the heaviest contact that was simulated": (
            area > heaviest
        ),
    }


def scatter_of_decay(area: ArrayLike, range_over_h_rms: ArrayLike) -> FloatArray:
    """Standard deviation of ln of the mean of exp(-g/range) against simulations whose u and A/A0 are known.

    NaN where there was no comparison: of areas outside 0.3% to 90%, and ranges below 0.01
    h_rms. Of ranges above 3 h_rms, where it depends less on the gaps, that at 3 h_rms.

    Examples
    --------
    >>> from mbma_tables.theories.gap_law import scatter_of_decay
    >>> bool(scatter_of_decay(0.3, 0.1) < 0.05), float(scatter_of_decay(0.3, 1e-3))
    (True, nan)
    """
    share, over = np.broadcast_arrays(area, range_over_h_rms)
    compared = (over >= RANGES[0]) & (share >= AREAS[0]) & (share <= AREAS[-1])
    row, below = _place(np.log(AREAS), np.clip(share, AREAS[0], AREAS[-1]))
    column, left = _place(np.log(RANGES), np.clip(over, RANGES[0], RANGES[-1]))
    errors = np.array(ERRORS)
    near = errors[row, column] * (1 - left) + errors[row, column + 1] * left
    far = errors[row + 1, column] * (1 - left) + errors[row + 1, column + 1] * left
    return np.where(compared, near * (1 - below) + far * below, np.nan)


def _place(nodes: FloatArray, values: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """Intervals of rising logarithms that numbers lie in, and their share of the way through."""
    x = np.log(values)
    interval = np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, nodes.size - 2)
    width = nodes[interval + 1] - nodes[interval]
    return interval, (x - nodes[interval]) / width


def share_below(gaps: FloatArray, area: FloatArray, gap: FloatArray) -> FloatArray:
    """Share of the nominal area with gaps of at most `gap`, contact included.

    `gaps` are those at the shares of `rule` on a last axis; arrays broadcast.
    """
    share: FloatArray = area + (1 - area) * _along(gaps, area, gap)[0]
    return share


def density(gaps: FloatArray, area: FloatArray, gap: FloatArray) -> FloatArray:
    """Density of the open gaps at `gap` > 0 [1/length], the slope of `share_below`."""
    share, slope = _along(gaps, area, gap)
    return (1 - area) * share * slope / gap


def _along(
    gaps: FloatArray, area: FloatArray, gap: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Share of the open gaps below `gap`, and its slope in logarithms, 2/3 beside contact."""
    from scipy.interpolate import PchipInterpolator

    log_t = np.log(rule()[0])
    entries = gaps.shape[:-1]
    rows = gaps.reshape(-1, log_t.size)
    shape = np.broadcast_shapes(entries, np.shape(area), np.shape(gap))
    wanted = np.broadcast_to(gap, shape).ravel()
    owner = np.broadcast_to(np.arange(len(rows)).reshape(entries), shape).ravel()
    found = np.empty((2, wanted.size))
    for number, places in grouped(owner):
        curve = PchipInterpolator(np.log(rows[number]), log_t)
        found[:, places] = _on_curve(curve, wanted[places])
    share, slope = found
    return share.reshape(shape), slope.reshape(shape)


def _on_curve(curve: Any, gap: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Share and slope of one contact, whose smallest gaps are those beside an edge."""
    first, last = curve.x[[0, -1]]
    with np.errstate(divide="ignore"):
        x = np.log(gap)
    inside = np.clip(x, first, last)
    log_share = curve(inside) + EDGE * np.minimum(x - first, 0.0)
    slope = np.where(x < first, EDGE, np.where(x > last, 0.0, curve(inside, 1)))
    return np.exp(np.where(x > last, 0.0, log_share)), slope
