"""Compiled evaluation of contact laws: values, slopes, energy, inverses. No work space, no shared state."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import njit

TERMS = 16
FORCE, AREA, FORCE_SLOPE, AREA_SLOPE, ENERGY = range(5)
INVERSE_STEPS = 100
EXACT = 1e-15  # of the logarithm of a depth

# breaks in tau, polynomial pieces (pieces, TERMS, 2), layer, h_max, E_star
State = tuple[FloatArray, FloatArray, float, float, float]

_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(20)
_LOOSE = {"contract"}


@njit(cache=True, fastmath=_LOOSE, error_model="numpy")
def _locate(tau: float, breaks: FloatArray) -> int:
    """Piece that holds tau; a break belongs to the piece of the larger gap."""
    low, high = 0, breaks.size - 1
    while high - low > 1:
        middle = (low + high) >> 1
        if breaks[middle] < tau:
            low = middle
        else:
            high = middle
    return low


@njit(cache=True, fastmath=_LOOSE, error_model="numpy")
def _value(pieces: FloatArray, piece: int, which: int, u: float) -> float:
    value: float = pieces[piece, TERMS - 1, which]
    for k in range(TERMS - 2, -1, -1):
        value = value * u + pieces[piece, k, which]
    return value


@njit(cache=True, fastmath=_LOOSE, error_model="numpy")
def _slope(pieces: FloatArray, piece: int, which: int, u: float) -> float:
    slope: float = (TERMS - 1) * pieces[piece, TERMS - 1, which]
    for k in range(TERMS - 2, 0, -1):
        slope = slope * u + k * pieces[piece, k, which]
    return slope


@njit(cache=True, fastmath=_LOOSE, error_model="numpy")
def _lead(which: int, depth: float) -> float:
    """l^(7/2) or l^(10/3)."""
    root: float = math.sqrt(depth) if which == 0 else np.cbrt(depth)
    return depth * depth * depth * root


@njit(cache=True, fastmath=_LOOSE, error_model="numpy")
def _direct(which: int, depth: float, state: State) -> float:
    """Force or area at depth > 0."""
    breaks, pieces, layer, _, modulus = state
    tau = math.asinh(math.sqrt(depth / layer))
    piece = _locate(tau, breaks)
    a, b = breaks[piece], breaks[piece + 1]
    value = _lead(which, depth) * math.exp(_value(pieces, piece, which, (2.0 * tau - a - b) / (b - a)))
    return value * modulus if which == 0 else value


@njit(cache=True, fastmath=_LOOSE, error_model="numpy")
def _log_slope(which: int, depth: float, state: State) -> float:
    """d log(force or area)/d log(depth)."""
    breaks, pieces, layer, _, _ = state
    root = math.sqrt(depth / layer)
    tau = math.asinh(root)
    piece = _locate(tau, breaks)
    a, b = breaks[piece], breaks[piece + 1]
    slope: float = _slope(pieces, piece, which, (2.0 * tau - a - b) / (b - a)) * 2.0 / (b - a)
    # l dtau/dl
    inner = 0.5 * root / math.sqrt(1.0 + root * root)
    return (3.5 if which == 0 else 10.0 / 3.0) + slope * inner


@njit(cache=True, error_model="numpy")
def _work(tau_low: float, tau_high: float, state: State) -> float:
    """Integral of force over l between two tau."""
    layer = state[2]
    half, centre = 0.5 * (tau_high - tau_low), 0.5 * (tau_high + tau_low)
    total = 0.0
    for k in range(_GAUSS_NODES.size):
        t = centre + half * _GAUSS_NODES[k]
        rise = math.sinh(t)
        total += _GAUSS_WEIGHTS[k] * _direct(0, layer * rise * rise, state) * layer * math.sinh(2.0 * t)
    return half * total


@njit(cache=True, error_model="numpy")
def evaluate(what: int, d: float, state: State, energies: FloatArray) -> float:
    """One of FORCE, AREA, FORCE_SLOPE, AREA_SLOPE (both against -d), ENERGY at d >= -h_max."""
    depth = state[3] - d
    if not depth > 0.0:
        return 0.0 if depth == depth else math.nan
    if what in (FORCE, AREA):
        return _direct(what, depth, state)
    if what == ENERGY:
        tau = math.asinh(math.sqrt(depth / state[2]))
        piece = _locate(tau, state[0])
        below: float = energies[piece]
        return below + _work(state[0][piece], tau, state)
    which = what - FORCE_SLOPE
    return _direct(which, depth, state) * _log_slope(which, depth, state) / depth


@njit(cache=True, error_model="numpy", nogil=True)
def fill(what: int, d: FloatArray, state: State, energies: FloatArray, out: FloatArray) -> None:
    """`evaluate` of each entry."""
    if what == FORCE:
        for k in range(d.size):
            depth = state[3] - d[k]
            out[k] = _direct(0, depth, state) if depth > 0.0 else 0.0
    else:
        for k in range(d.size):
            out[k] = evaluate(what, d[k], state, energies)


@njit(cache=True, error_model="numpy")
def energies(state: State) -> FloatArray:
    """Elastic energy from first contact to each break."""
    breaks = state[0]
    sums = np.zeros(breaks.size)
    for piece in range(breaks.size - 1):
        sums[piece + 1] = sums[piece] + _work(breaks[piece], breaks[piece + 1], state)
    return sums


@njit(cache=True, error_model="numpy")
def _slope_at(which: int, tau: float, state: State) -> float:
    """d log F / d log l, or that of A, at tau."""
    slope: float = _log_slope(which, state[2] * math.sinh(tau) ** 2, state)
    return slope


@njit(cache=True, error_model="numpy")
def _least_slope(which: int, low: float, high: float, state: State) -> float:
    """Where the slope is least between two places, of which none in between is higher than both."""
    for _ in range(INVERSE_STEPS):
        third = (high - low) / 3.0
        if _slope_at(which, low + third, state) < _slope_at(which, high - third, state):
            high -= third
        else:
            low += third
    return high


@njit(cache=True, error_model="numpy")
def _first_fall(which: int, low: float, high: float, state: State) -> float:
    """Gap where a slope that is positive at `low` and not at `high` changes its sign."""
    for _ in range(INVERSE_STEPS):
        middle = 0.5 * (low + high)
        if _slope_at(which, middle, state) <= 0.0:
            high = middle
        else:
            low = middle
    gap: float = state[3] - state[2] * math.sinh(low) ** 2
    return gap


@njit(cache=True, error_model="numpy")
def turning_point(which: int, state: State, samples: int) -> float | None:
    """Gap at which force (which = 0) or area (1) first stops rising with compression; None where it never does."""
    breaks = state[0]
    before = previous = breaks[0]
    slope_before = slope_previous = math.inf
    for piece in range(breaks.size - 1):
        for k in range(1, samples + 1):
            tau = breaks[piece] + (breaks[piece + 1] - breaks[piece]) * k / samples
            slope = _slope_at(which, tau, state)
            if slope <= 0.0:
                return _first_fall(which, previous, tau, state)
            # a dip may be narrower than the samples are apart
            if slope_previous < slope_before and slope_previous <= slope:
                least = _least_slope(which, before, tau, state)
                if _slope_at(which, least, state) <= 0.0:
                    return _first_fall(which, before, least, state)
            before, previous = previous, tau
            slope_before, slope_previous = slope_previous, slope
    least = _least_slope(which, before, previous, state)
    if _slope_at(which, least, state) <= 0.0:
        return _first_fall(which, before, least, state)
    return None


@njit(cache=True, error_model="numpy", nogil=True)
def invert(which: int, wanted: FloatArray, end: float, state: State, out: FloatArray) -> None:
    """Gaps at which force (which = 0) or area (1) takes the wanted values, down to `end`; NaN where not found."""
    h_max = state[3]
    most = h_max - end
    for k in range(wanted.size):
        if wanted[k] == 0.0:
            out[k] = h_max
            continue
        low, high = 0.0, most
        # the power law from the end as first guess
        full = _direct(which, most, state)
        depth = most * (wanted[k] / full) ** (2.0 / 7.0 if which == 0 else 0.3)
        allowed = math.inf
        out[k] = math.nan
        for _ in range(INVERSE_STEPS):
            value = _direct(which, depth, state)
            if value < wanted[k]:
                low = depth
            else:
                high = depth
            step = -math.log(value / wanted[k]) / _log_slope(which, depth, state)
            following = depth * math.exp(step)
            # steps that do not halve may go to and fro for ever
            if abs(step) > EXACT and not (low < following < high and abs(step) <= 0.5 * allowed):
                following = math.sqrt(low) * math.sqrt(high) if low > 0.0 else 0.5 * high
                step = math.log(following / depth)
            depth = following
            if abs(step) <= EXACT:
                out[k] = h_max - depth
                break
            allowed = abs(step)


def bind(what: int, state: State, energy_sums: FloatArray) -> Any:
    """A compiled function of d alone, with the law inside; NaN below -h_max."""
    breaks, pieces, layer, h_max, modulus = state

    @njit(error_model="numpy")
    def law(d: float) -> float:
        if d < -h_max:
            return math.nan
        return evaluate(what, d, (breaks, pieces, layer, h_max, modulus), energy_sums)

    return law
