"""A surface's islands as functions of their approach delta, and the totals of many gaps from them.

Everything of an island depends on delta alone; the gap enters through the Gaussian of its height and the upper limit
(Eqs. 44-49). So densities, forces and areas are kept as polynomials in panels of delta, and a gap costs one
exponential a node. Panels are halved until halves of their own agree with them.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from mbma_tables.arguments import FloatArray
from mbma_tables.errors import ConvergenceError, OutOfRangeError
from mbma_tables.islands.geometry import geometry
from mbma_tables.models import answer_islands
from mbma_tables.models.universal_kernel import OK, REASONS
from mbma_tables.surfaces.readings import Reading
from mbma_tables.totals import kernel
from mbma_tables.totals.island import scale_area, scale_force
from mbma_tables.totals.island_sum import jacobian_of, kinks
from mbma_tables.totals.profile_kernel import ENDS, ORDER, RATE, SHIFT, fill_sums

KEPT = 64  # profiles, for whoever asks the same surface again
WIDEST = 1.25  # panels above the floor of zeta_d, in h_rms
MAX_ROUNDS = 12
SEEN = 9  # gaps a panel is checked at
BETWEEN = 2.0  # times more is missed at gaps between them
FEW = 256  # gaps summed in numpy, without a compiler
HIGH = 6.0  # of sigma_d: islands beyond carry less than 1e-7
POWERS = (2.5, 7 / 3)  # of delta, in which weights of force and area start


def _rule_with_power(power: float) -> tuple[FloatArray, FloatArray]:
    """Gauss nodes and weights for integrals of x^power times a smooth function over [0, 1] (Golub and Welsch)."""
    n = np.arange(ENDS)
    diagonal = power**2 / ((2 * n + power) * (2 * n + power + 2))
    k = n[1:]
    beside = 2 * k * (k + power) / (2 * k + power) / np.sqrt((2 * k + power) ** 2 - 1)
    nodes, vectors = np.linalg.eigh(np.diag((1 + diagonal) / 2) + np.diag(beside / 2, 1) + np.diag(beside / 2, -1))
    return nodes, vectors[0] ** 2 / (power + 1)


@functools.cache
def _rules() -> tuple[FloatArray, ...]:
    """Gauss nodes and weights on [0, 1], those with the powers of delta, and values at the nodes to a series."""
    x, w = np.polynomial.legendre.leggauss(ORDER)
    jacobi = [_rule_with_power(power) for power in POWERS]
    transform = np.linalg.inv(chebyshev.chebvander(x, ORDER - 1))
    halves = np.concatenate([(x - 1) / 2, (x + 1) / 2])
    between = chebyshev.chebvander(halves, ORDER - 1) @ transform
    ends = (np.array([pair[k] for pair in jacobi]) for k in (0, 1))
    return ((1 + x) / 2, w / 2, *ends, transform, between)


@dataclasses.dataclass(frozen=True)
class Profile:
    """Islands of one surface up to an approach: totals of any gaps within it.

    Attributes
    ----------
    edges : ndarray, shape (panels + 1,)
        Ends of the panels, delta/h_rms.
    series : ndarray, shape (panels, 4, ORDER)
        Weights of force and area, shift and rate of the height, as Chebyshev series (`profile_kernel.fill_sums`).
    error : float
        Bound on the relative error of totals, of panels and islands together.
    islands : int
        Islands answered for it.
    compiled : bool
        Whether gaps are summed by compiled code; derivatives are always summed in numpy.
    """

    edges: FloatArray
    series: FloatArray
    error: float
    islands: int
    compiled: bool

    def totals(self, compression: FloatArray, slopes: bool = False) -> FloatArray:
        """F/(A0 E* q0 s) and the sum of areas over A0 at (h_max - d)/h_rms > 0 within the profile, shape (2, gaps).

        With their derivatives by the compression it is (4, gaps).
        """
        if slopes or not self.compiled:
            parts = [self._sums(compression[k : k + FEW]) for k in range(0, compression.size, FEW)]
            return np.concatenate(parts, axis=1)[: 4 if slopes else 2]
        order = np.argsort(compression, kind="stable")
        sums, out = np.empty((2, compression.size)), np.empty((2, compression.size))
        nodes, weights, end_nodes, end_weights, *_ = _rules()
        fill_sums(compression[order], self.edges, self.series, nodes, weights, end_nodes, end_weights, sums)
        out[:, order] = sums
        return out

    @functools.cached_property
    def _fields(self) -> FloatArray:
        """Fields of the panels but the first at their Gauss nodes, weights times the nodes' own, and ends of panels."""
        nodes, weights = _rules()[:2]
        basis = chebyshev.chebvander(2 * nodes - 1, ORDER - 1)
        fields = np.moveaxis(self.series[1:] @ basis.T, 0, 1)
        fields[:2] *= np.diff(self.edges)[1:, None] * weights
        ends = np.broadcast_to(self.edges[2:, None], fields.shape[1:])
        return np.concatenate([fields, ends[None]]).reshape(5, -1)

    def _first(self, width: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Weights of force and area, shift and rate at the nodes of [0, width] in the first panel, by rule."""
        end_nodes, end_weights = _rules()[2:4]
        basis = chebyshev.chebvander(2 * width[:, None] / self.edges[1] * end_nodes[:, None] - 1, ORDER - 1)
        fields = np.einsum("fk,rgnk->frgn", self.series[0], basis)
        powers = np.array([width ** (power + 1) for power in POWERS])[:, :, None]
        return fields[[0, 1], [0, 1]] * end_weights[:, None] * powers, fields[SHIFT], fields[RATE]

    @np.errstate(under="ignore")
    def _sums(self, c: FloatArray) -> FloatArray:
        """`fill_sums` in numpy, with derivatives by the compression: shape (4, gaps)."""
        nodes, weights = _rules()[:2]
        low_panel = np.clip(np.searchsorted(self.edges, c, side="right") - 1, 0, self.edges.size - 2)

        def add(weight: Any, shift: Any, rate: Any, gap: FloatArray) -> FloatArray:
            height = shift - rate * gap
            terms = weight * np.exp(-0.5 * height * height)
            return np.concatenate([terms.sum(axis=-1), (terms * height * rate).sum(axis=-1)])

        *weight, shift, rate, ends = self._fields
        gap, low = c[:, None], self.edges[low_panel]
        sums = add(np.array(weight)[:, None] * (ends <= low[:, None]), shift, rate, gap)
        whole = bool((c >= self.edges[1]).all())
        first = self._whole_first if whole else self._first(np.minimum(c, self.edges[1]))
        sums += add(*first, gap)
        # the panel that the gap cuts, and the island at the gap itself
        width = self.edges[low_panel + 1] - low
        place = np.append(nodes, 1.0) * (c - low)[:, None]
        basis = chebyshev.chebvander(2 * place / width[:, None] - 1, ORDER - 1)
        fields = np.einsum("gfk,gnk->fgn", self.series[low_panel], basis)
        cut = low_panel > 0
        shares = np.where(cut, c - low, 0.0)[:, None] * weights
        sums += add(fields[:2, :, :-1] * shares, fields[SHIFT, :, :-1], fields[RATE, :, :-1], gap)
        power = np.where(cut, 1.0, c ** np.array(POWERS)[:, None])
        height = fields[SHIFT, :, -1] - fields[RATE, :, -1] * c
        sums[2:] += power * fields[:2, :, -1] * np.exp(-0.5 * height * height)
        return sums

    @functools.cached_property
    def _whole_first(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """`_first` of gaps that reach beyond the first panel."""
        return self._first(self.edges[1:2])

    @functools.cached_property
    def leverage(self) -> float:
        """What a relative error of islands is worth in slopes over F/l, the largest at some panels' ends.

        An error e of f in F = integral of f G up to l changes l dF/dl by at most e (l f G + integral of f |l dG/dl|).
        """
        nodes, weights = _rules()[:2]
        at = np.append(2 * nodes - 1, 1.0)
        fields = chebyshev.chebval(at, np.moveaxis(self.series, -1, 0), tensor=True)
        delta = self.edges[:-1, None] + np.diff(self.edges)[:, None] * np.append(nodes, 1.0)
        fields[0, :2] *= np.stack([delta[0] ** power for power in POWERS])
        ends = np.unique(np.linspace(0, self.edges.size - 2, SEEN).astype(int))
        c = self.edges[1 + ends, None, None]
        heights = fields[:, SHIFT] - fields[:, RATE] * c
        gaussian = np.exp(-0.5 * heights**2) * (delta <= c)
        shares = np.diff(self.edges)[:, None] * weights
        worst = 0.0
        for row in range(2):
            density = gaussian * fields[:, row]
            total = (density[..., :-1] * shares).sum(axis=(1, 2))
            turned = (density * np.abs(heights * fields[:, RATE]))[..., :-1] * shares
            at_end = density[np.arange(ends.size), ends, -1]
            carried = total > 0
            ratio = c[carried, 0, 0] * (turned.sum(axis=(1, 2)) + at_end)[carried] / total[carried]
            worst = max(worst, float(ratio.max(initial=0.0)))
        return worst


@functools.lru_cache(maxsize=KEPT)
def profile(
    hurst: float,
    zeta_1: float,
    peak: float,
    last: float,
    model: Any,
    reading: Reading,
    rtol: float,
    compiled: bool = False,
) -> Profile:
    """The profile of one surface with h_max/h_rms = `peak` up to compressions of `last` h_rms.

    It is made to `rtol`, and the model's own error. `compiled` asks a universal table in one pass, for who compiles
    anyway.

    Raises
    ------
    ConvergenceError, OutOfRangeError
    """
    worst, islands = 0.0, 0
    at = tuple(float(kink) for kink in kinks(hurst, zeta_1, reading))

    def fields(low: FloatArray, high: FloatArray) -> FloatArray:
        """Weights, shift and rate at the nodes of panels, shape (4, panels, ORDER)."""
        nonlocal worst, islands
        nodes = _rules()[0]
        x = low[:, None] + (high - low)[:, None] * nodes
        flat = x.ravel()
        if compiled:
            found = np.empty((4, flat.size))
            printed = reading.jacobian == "printed"
            status, error = kernel.fill_fields(flat, peak, hurst, zeta_1, reading.numbers, printed, model.kernel, found)
            if status != OK:
                raise OutOfRangeError(f"islands of this surface lie outside the {model.name} table: {REASONS[status]}")
            worst, islands = max(worst, error), islands + flat.size
            return found.reshape(4, *x.shape)
        g = geometry(flat, np.full(flat.size, hurst), np.full(flat.size, zeta_1), reading)
        try:
            phi = answer_islands(model, g | {"hurst": np.full(flat.size, hurst)})
        except OutOfRangeError as fault:
            raise OutOfRangeError(f"islands of this surface lie outside the {model.name} table: {fault}") from None
        worst, islands = max(worst, float(np.max(phi.error))), islands + flat.size
        rms = np.full(flat.size, math.sqrt(-math.expm1(-2 * hurst * math.log(zeta_1))))
        each = jacobian_of(reading, rms, flat < at[0]) * rms * kernel.island_density(0.0, g["D_d"], g["sigma_d"])
        rate = rms / g["sigma_d"]
        shift = ((peak + flat) * rms - g["h_d"]) / g["sigma_d"]
        found = np.stack([scale_force(g) * phi.phi_F * each, scale_area(g) * phi.phi_A * each, shift, rate])
        return found.reshape(4, *x.shape)

    edges = _first_edges(zeta_1**-hurst, last, *at)
    low, high = edges[:-1], edges[1:]
    values = fields(low, high)
    kept: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    error = 0.0
    for _ in range(MAX_ROUNDS):
        middle = (low + high) / 2
        ends = np.stack([low, middle, middle, high], axis=-1).reshape(-1, 2).T
        halves = fields(*ends)
        seen = _disagreement(low, high, values, halves, last)
        # no nearer than islands themselves are known
        good = seen <= max(rtol, worst)
        if good.any():
            error = max(error, float(seen[good].max()))
            kept.append((low[good], high[good], values[:, good]))
        if good.all():
            break
        again = np.repeat(~good, 2)
        low, high, values = ends[0][again], ends[1][again], halves[:, again]
    else:
        raise ConvergenceError(f"a profile of islands did not reach {rtol:.1e}", np.array(True))
    low, high = (np.concatenate([part[k] for part in kept]) for k in (0, 1))
    order = np.argsort(low)
    ordered = np.concatenate([part[2] for part in kept], axis=1)[:, order]
    _without_powers(ordered, high[order[0]] * _rules()[0], 0)
    series = np.einsum("kj,fpj->pfk", _rules()[4], ordered)
    return Profile(np.append(low[order], last), np.ascontiguousarray(series), error + worst, islands, compiled)


def _first_edges(layer: float, last: float, at_d: float, at_u: float) -> FloatArray:
    """Panels that double from the boundary layer on, with ends at the kinks, and equal ones above zeta_d's floor."""
    start = min(layer, at_d, at_u, last)
    breaks = sorted({start, *(kink for kink in (at_d, at_u) if kink < last), last})
    edges = [0.0, start]
    for a, b in itertools.pairwise(breaks):
        if a >= at_d:
            edges += np.linspace(a, b, math.ceil((b - a) / WIDEST) + 1)[1:].tolist()
        else:
            edges += np.geomspace(a, b, math.ceil(math.log2(b / a)) + 1)[1:].tolist()
            edges[-1] = b
    return np.array(edges)


def _without_powers(values: FloatArray, x: FloatArray, panel: int) -> None:
    """Divide the weights of a panel that begins at zero by what they rise with, in place."""
    for row, power in enumerate(POWERS):
        values[row, panel] /= x**power


def _disagreement(low: FloatArray, high: FloatArray, values: FloatArray, halves: FloatArray, last: float) -> FloatArray:
    """Relative error of panels against their halves: of what they interpolate, and of their sums at some gaps."""
    nodes, weights, _, _, _, between = _rules()
    true = halves.reshape(4, low.size, 2 * ORDER).copy()
    if low[0] == 0:
        values = values.copy()
        _without_powers(values, high[0] * nodes, 0)
        _without_powers(true, high[0] * np.concatenate([nodes / 2, (1 + nodes) / 2]), 0)
    missed = np.einsum("jk,fpk->fpj", between, values) - true
    # what underflows is right
    relative = np.abs(np.divide(missed[:2], true[:2], out=np.zeros_like(true[:2]), where=true[:2] > 0)).max(axis=(0, 2))
    # heights count where the Gaussian does
    turned = np.abs(missed[SHIFT]) + last * np.abs(missed[RATE])
    field = relative + HIGH * turned.max(axis=1)
    # sums over whole panels, relative to the largest node of the Gaussian there
    spread = low[:, None] + (last - low)[:, None] * np.linspace(0, 1, SEEN)
    # where Gaussians are narrow no such gap may meet one: gaps at which one has its top in the panel
    tops = (values[SHIFT] / values[RATE])[:, ::2]
    c = np.clip(np.concatenate([spread, tops], axis=1), high[:, None], last)[..., None]

    def gaussian(v: FloatArray) -> FloatArray:
        return np.asarray(np.exp(-0.5 * (v[SHIFT][:, None, :] - v[RATE][:, None, :] * c) ** 2))

    coarse = (gaussian(values) * values[0][:, None, :]) @ weights
    fine = (gaussian(true) * true[0][:, None, :]) @ np.tile(weights / 2, 2)
    # what a panel adds is compared with what it adds at its best gap: others carry the load where it adds little
    most = fine.max(axis=1)
    summed = np.divide(np.abs(coarse - fine).max(axis=1), most, out=np.zeros_like(most), where=most > 0)
    return np.asarray(field + BETWEEN * summed)
