"""Compiled evaluation of contact laws: values, slopes, energy, inverses. No work space, no shared state."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import CONTRACT, njit

TERMS = 16
FORCE, AREA, FORCE_SLOPE, AREA_SLOPE, ENERGY, FORCE_LOG_SLOPE, AREA_LOG_SLOPE = range(7)
INVERSE_STEPS = 100
EXACT = 1e-15  # of the logarithm of a depth
SMALL = 1e-290  # forces and areas below it may have lost digits

_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(20)


class Law(NamedTuple):
    """A law as compiled code takes it, or as a plain tuple, which a call from Python passes on faster."""

    breaks: FloatArray  # ends of the pieces in tau
    pieces: FloatArray  # coefficients (pieces, TERMS, 2)
    energies: FloatArray  # from first contact to each break
    layer: float
    h_max: float
    E_star: float


@njit(cache=True, fastmath=CONTRACT, error_model="numpy")
def locate(tau: float, breaks: FloatArray) -> int:
    """Piece that holds tau; a break belongs to the piece of the larger gap."""
    low, high = 0, breaks.size - 1
    while high - low > 1:
        middle = (low + high) >> 1
        if breaks[middle] < tau:
            low = middle
        else:
            high = middle
    return low


@njit(cache=True, fastmath=CONTRACT, error_model="numpy")
def value_in(pieces: FloatArray, piece: int, which: int, u: float) -> float:
    """A piece's polynomial at u in [-1, 1]."""
    value: float = pieces[piece, TERMS - 1, which]
    for k in range(TERMS - 2, -1, -1):
        value = value * u + pieces[piece, k, which]
    return value


@njit(cache=True, fastmath=CONTRACT, error_model="numpy")
def slope_in(pieces: FloatArray, piece: int, which: int, u: float) -> float:
    """Its derivative by u."""
    slope: float = (TERMS - 1) * pieces[piece, TERMS - 1, which]
    for k in range(TERMS - 2, 0, -1):
        slope = slope * u + k * pieces[piece, k, which]
    return slope


@njit(cache=True, fastmath=CONTRACT, error_model="numpy")
def _lead(which: int, depth: float) -> float:
    """l^(7/2) or l^(10/3)."""
    root: float = math.sqrt(depth) if which == 0 else np.cbrt(depth)
    return depth * depth * depth * root


@njit(cache=True, fastmath=CONTRACT, error_model="numpy", forceinline=True)
def _residue(which: int, depth: float, law: Law) -> float:
    """What is left of the logarithm of force or area without `_lead`."""
    tau = math.asinh(math.sqrt(depth / law.layer))
    piece = locate(tau, law.breaks)
    a, b = law.breaks[piece], law.breaks[piece + 1]
    return value_in(law.pieces, piece, which, (2.0 * tau - a - b) / (b - a))


@njit(cache=True, fastmath=CONTRACT, error_model="numpy", forceinline=True)
def _direct(which: int, depth: float, law: Law) -> float:
    """Force or area at depth > 0."""
    value = _lead(which, depth) * math.exp(_residue(which, depth, law))
    return value * law.E_star if which == 0 else value


@njit(cache=True, fastmath=CONTRACT, error_model="numpy")
def _log_slope(which: int, depth: float, law: Law) -> float:
    """d log(force or area)/d log(depth)."""
    root = math.sqrt(depth / law.layer)
    tau = math.asinh(root)
    piece = locate(tau, law.breaks)
    a, b = law.breaks[piece], law.breaks[piece + 1]
    slope: float = slope_in(law.pieces, piece, which, (2.0 * tau - a - b) / (b - a)) * 2.0 / (b - a)
    # l dtau/dl
    inner = 0.5 * root / math.sqrt(1.0 + root * root)
    return (3.5 if which == 0 else 10.0 / 3.0) + slope * inner


@njit(cache=True, error_model="numpy")
def _work(tau_low: float, tau_high: float, law: Law) -> float:
    """Integral of force over l between two tau."""
    half, centre = 0.5 * (tau_high - tau_low), 0.5 * (tau_high + tau_low)
    total = 0.0
    for k in range(_GAUSS_NODES.size):
        t = centre + half * _GAUSS_NODES[k]
        rise = math.sinh(t)
        total += _GAUSS_WEIGHTS[k] * _direct(0, law.layer * rise * rise, law) * law.layer * math.sinh(2.0 * t)
    return half * total


@njit(cache=True, error_model="numpy")
def _evaluate(what: int, d: float, law: Law) -> float:
    """One of FORCE, AREA, FORCE_SLOPE, AREA_SLOPE (both against -d), ENERGY at d >= -h_max."""
    depth = law.h_max - d
    if not depth > 0.0:
        return 0.0 if depth == depth else math.nan
    if what in (FORCE, AREA):
        return _direct(what, depth, law)
    if what == ENERGY:
        tau = math.asinh(math.sqrt(depth / law.layer))
        piece = locate(tau, law.breaks)
        below: float = law.energies[piece]
        return below + _work(law.breaks[piece], tau, law)
    if what in (FORCE_LOG_SLOPE, AREA_LOG_SLOPE):
        return _log_slope(what - FORCE_LOG_SLOPE, depth, law)
    which = what - FORCE_SLOPE
    return _direct(which, depth, law) * _log_slope(which, depth, law) / depth


@njit(cache=True, error_model="numpy")
def evaluate(what: int, d: float, law: Any) -> float:
    """`_evaluate` of a law as a plain tuple."""
    own = Law(*law)
    if what == FORCE and d < own.h_max:
        return _direct(FORCE, own.h_max - d, own)
    return _evaluate(what, d, own)


@njit(cache=True, error_model="numpy", nogil=True)
def fill(what: int, d: FloatArray, given: Any, out: FloatArray) -> None:
    """`_evaluate` of each entry."""
    law = Law(*given)
    if what == FORCE:
        for k in range(d.size):
            depth = law.h_max - d[k]
            out[k] = _direct(0, depth, law) if depth > 0.0 else 0.0
    else:
        for k in range(d.size):
            out[k] = _evaluate(what, d[k], law)


@njit(cache=True, error_model="numpy")
def fill_energies(law: Law) -> None:
    """Elastic energy from first contact to each break, into the law."""
    law.energies[0] = 0.0
    for piece in range(law.breaks.size - 1):
        law.energies[piece + 1] = law.energies[piece] + _work(law.breaks[piece], law.breaks[piece + 1], law)


@njit(cache=True, error_model="numpy")
def _slope_at(which: int, tau: float, law: Law) -> float:
    """d log F / d log l, or that of A, at tau."""
    slope: float = _log_slope(which, law.layer * math.sinh(tau) ** 2, law)
    return slope


@njit(cache=True, error_model="numpy")
def _lowest_slope(which: int, low: float, high: float, law: Law) -> float:
    """Where the slope is least between two places, of which none in between is higher than both."""
    for _ in range(INVERSE_STEPS):
        third = (high - low) / 3.0
        if _slope_at(which, low + third, law) < _slope_at(which, high - third, law):
            high -= third
        else:
            low += third
    return high


@njit(cache=True, error_model="numpy")
def _first_fall(which: int, low: float, high: float, law: Law) -> float:
    """Gap where a slope that is positive at `low` and not at `high` changes its sign."""
    for _ in range(INVERSE_STEPS):
        middle = 0.5 * (low + high)
        if _slope_at(which, middle, law) <= 0.0:
            high = middle
        else:
            low = middle
    gap: float = law.h_max - law.layer * math.sinh(low) ** 2
    return gap


@njit(cache=True, error_model="numpy")
def turning_point(which: int, law: Law, samples: int) -> float | None:
    """Gap at which force (which = 0) or area (1) first stops rising with compression; None where it never does."""
    breaks = law.breaks
    before = previous = breaks[0]
    slope_before = slope_previous = math.inf
    for piece in range(breaks.size - 1):
        for k in range(1, samples + 1):
            tau = breaks[piece] + (breaks[piece + 1] - breaks[piece]) * k / samples
            slope = _slope_at(which, tau, law)
            if slope <= 0.0:
                return _first_fall(which, previous, tau, law)
            # a dip may be narrower than the samples are apart
            if slope_previous < slope_before and slope_previous <= slope:
                lowest = _lowest_slope(which, before, tau, law)
                if _slope_at(which, lowest, law) <= 0.0:
                    return _first_fall(which, before, lowest, law)
            before, previous = previous, tau
            slope_before, slope_previous = slope_previous, slope
    lowest = _lowest_slope(which, before, previous, law)
    if _slope_at(which, lowest, law) <= 0.0:
        return _first_fall(which, before, lowest, law)
    return None


@njit(cache=True, error_model="numpy")
def _log_value(which: int, depth: float, law: Law) -> float:
    """Logarithm of force or area, which may be too small for a number."""
    lead = 3.5 * math.log(depth) + math.log(law.E_star) if which == 0 else 10.0 / 3.0 * math.log(depth)
    return lead + _residue(which, depth, law)


@njit(cache=True, error_model="numpy", forceinline=True)
def _log_ratio(which: int, depth: float, wanted: float, law: Law) -> float:
    """log of force or area over the wanted value."""
    value = _direct(which, depth, law)
    if value > SMALL and wanted > SMALL:
        return math.log(value / wanted)
    return _log_value(which, depth, law) - math.log(wanted)


@njit(cache=True, error_model="numpy", nogil=True)
def invert(which: int, wanted: FloatArray, end: float, law: Law, out: FloatArray) -> None:
    """Gaps at which force (which = 0) or area (1) takes the wanted values, down to `end`; NaN where not found."""
    deepest = law.h_max - end
    log_deepest = _log_value(which, deepest, law)
    for k in range(wanted.size):
        if wanted[k] == 0.0:
            out[k] = law.h_max
            continue
        low, high = 0.0, deepest
        # the power law from the end as first guess
        depth = deepest * math.exp((math.log(wanted[k]) - log_deepest) * (2.0 / 7.0 if which == 0 else 0.3))
        allowed = math.inf
        out[k] = math.nan
        for _ in range(INVERSE_STEPS):
            ratio = _log_ratio(which, depth, wanted[k], law)
            if ratio < 0.0:
                low = depth
            else:
                high = depth
            step = -ratio / _log_slope(which, depth, law)
            following = depth * math.exp(step)
            # steps that do not halve may go to and fro for ever
            if abs(step) > EXACT and not (low < following < high and abs(step) <= 0.5 * allowed):
                following = math.sqrt(low) * math.sqrt(high) if low > 0.0 else 0.5 * high
                step = math.log(following / depth)
            depth = following
            if abs(step) <= EXACT:
                # rounding may lead past the end
                out[k] = max(law.h_max - depth, end)
                break
            allowed = abs(step)


def bind(what: int, law: Law) -> Any:
    """A compiled function of d alone, with the law inside; NaN below -h_max."""
    breaks, pieces, energies, layer, h_max, E_star = law

    @njit(error_model="numpy")
    def bound(d: float) -> float:
        if d < -h_max:
            return math.nan
        return _evaluate(what, d, Law(breaks, pieces, energies, layer, h_max, E_star))

    return bound
