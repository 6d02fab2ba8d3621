"""Compiled sums over a profile's islands: one exponential a node and gap, in loops that vectorise.

Sums run over nodes in one order whatever the batch, so that a gap has one answer, alone or among others.
"""

from __future__ import annotations

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import CONTRACT, njit
from mbma_tables.elementary import exp

ORDER = 16  # Gauss nodes of a panel
ENDS = 12  # Gauss-Jacobi nodes of the panel at delta = 0
WEIGHT_FORCE, WEIGHT_AREA, SHIFT, RATE = range(4)


@njit(cache=True, fastmath=CONTRACT, error_model="numpy", forceinline=True)
def _series_at(series: FloatArray, place: float) -> float:
    """A Chebyshev series of ORDER terms at a place in [-1, 1]."""
    twice = 2.0 * place
    last = before = 0.0
    for k in range(ORDER - 1, 0, -1):
        last, before = twice * last - before + series[k], last
    value: float = place * last - before + series[0]
    return value


@njit(cache=True, fastmath=CONTRACT, error_model="numpy")
def _add_node(
    compression: FloatArray,
    weight_F: float,
    weight_A: float,
    shift: float,
    rate: float,
    force: FloatArray,
    area: FloatArray,
) -> None:
    """One node's share of force and area at gaps whose compression is beyond the panel."""  # fmt: skip
    for k in range(compression.size):
        height = shift - rate * compression[k]
        share = exp(-0.5 * height * height)
        force[k] += weight_F * share
        area[k] += weight_A * share


@njit(cache=True, fastmath=CONTRACT, error_model="numpy")
def _add_cut_node(
    compression: FloatArray,
    low: float,
    scale: float,
    node: float,
    weight_F: float,
    weight_A: float,
    series: FloatArray,
    force: FloatArray,
    area: FloatArray,
) -> None:
    """The same at gaps whose compression ends inside the panel; `scale` is 2 over its width."""  # fmt: skip
    of_force, of_area, shift, rate = series[WEIGHT_FORCE], series[WEIGHT_AREA], series[SHIFT], series[RATE]
    for k in range(compression.size):
        width = compression[k] - low
        place = scale * width * node - 1.0
        height = _series_at(shift, place) - _series_at(rate, place) * compression[k]
        share = width * exp(-0.5 * height * height)
        force[k] += weight_F * share * _series_at(of_force, place)
        area[k] += weight_A * share * _series_at(of_area, place)


@njit(cache=True, fastmath=CONTRACT, error_model="numpy", nogil=True)
def fill_sums(
    compression: FloatArray,
    edges: FloatArray,
    series: FloatArray,
    nodes: FloatArray,
    weights: FloatArray,
    end_nodes: FloatArray,
    end_weights: FloatArray,
    out: FloatArray,
) -> None:
    """F/(A0 E* q0 s) and A/A0 into the rows of `out` at rising compressions c = (h_max - d)/h_rms > 0.

    Of a panel (`series`: WEIGHT_FORCE, WEIGHT_AREA, SHIFT, RATE as Chebyshev series of delta) the integrand is
    weight exp(-(shift - rate c)^2/2). Nodes and weights are for [0, 1]; in the first panel, whose weights lack
    delta^(5/2) and delta^(7/3), there is a rule for each.
    """  # fmt: skip
    force, area = np.zeros(compression.size), np.zeros(compression.size)
    first = 0
    for panel in range(edges.size - 1):
        low, high, own = edges[panel], edges[panel + 1], series[panel]
        start = first
        while first < compression.size and compression[first] < high:
            first += 1
        inside, beyond = slice(start, first), slice(first, compression.size)
        scale = 2.0 / (high - low)
        for row in range(2 if panel == 0 else 1):
            rule, shares = (end_nodes[row], end_weights[row]) if panel == 0 else (nodes, weights)
            to_F, to_A = 1.0 if row == 0 else 0.0, 0.0 if panel == 0 and row == 0 else 1.0
            power = 1.0 if panel > 0 else 3.5 if row == 0 else 10.0 / 3.0
            full = (high - low) ** power
            for j in range(rule.size):
                place = 2.0 * rule[j] - 1.0
                weight_F, weight_A = to_F * shares[j], to_A * shares[j]
                _add_cut_node(
                    compression[inside], low, scale, rule[j], weight_F, weight_A, own, force[inside], area[inside]
                )
                _add_node(
                    compression[beyond],
                    full * weight_F * _series_at(own[WEIGHT_FORCE], place),
                    full * weight_A * _series_at(own[WEIGHT_AREA], place),
                    _series_at(own[SHIFT], place),
                    _series_at(own[RATE], place),
                    force[beyond],
                    area[beyond],
                )
        if panel == 0:
            # the powers that a cut first panel lacks, less the width that it has
            for k in range(first):
                c = compression[k]
                force[k] *= c * c * np.sqrt(c)
                area[k] *= c * c * np.cbrt(c)
    out[0], out[1] = force, area
