"""Totals of a surface that is its own spectrum: its islands once, on panels, then many gaps at once (Eqs. 44-49).

Everything of an island depends on its approach delta alone; a gap enters through the Gaussian and the upper limit
h_max - d. So islands are answered once, at Gauss-Kronrod nodes of panels that break wherever q_d or q_u passes a sample
of the spectrum; a gap then costs one exponential a node near its limit, a series in the gap for all nodes far below
it, and the few islands of the panel that its limit cuts. Force rises like delta^(5/2) from first contact and area like
delta^(7/3): the first panel has Gauss-Jacobi nodes for each.
"""

from __future__ import annotations

import functools
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.compiled import REORDER, njit
from mbma_tables.elementary import exp
from mbma_tables.errors import ConvergenceError, OutOfRangeError
from mbma_tables.islands.measured import floors_of, measured_islands, s_over_h_rms
from mbma_tables.models import AnyModel, answer_islands
from mbma_tables.surfaces.measured import MeasuredSurface
from mbma_tables.surfaces.power_laws import Place
from mbma_tables.surfaces.readings import Reading
from mbma_tables.totals.island import refuse_bands, scale_area, scale_force
from mbma_tables.totals.kernel import island_density, jacobian_below

RATIO = 1.25  # between the ends of a panel
STEP = 0.5  # of a panel, in the least standard deviation of islands' heights
FIRST = 0.05  # of the least approach at which anything changes: the first panel
ENDS, FEW = 10, 7  # Gauss-Jacobi nodes of the first panel, and of its check
TERMS = 12  # of a series in the gap over a stretch, and one for each standard deviation up to the highest point
MAX_ROUNDS = 12  # halvings of panels
QUADRATURE_SHARE = 0.9  # of the tolerance asked for; the islands' own error comes on top
SAFETY = 4.0  # as in `intervals`


def _rules() -> tuple[FloatArray, FloatArray]:
    """Nodes on [-1, 1] and weights of the sums of `Found`: Kronrod's seven points, and Gauss's three among them."""
    root = math.sqrt(100 / 81 - 620 / 891)
    half = [math.sqrt((10 / 9 + root) / 2), math.sqrt(0.6), math.sqrt((10 / 9 - root) / 2)]
    nodes = np.array([*(-x for x in half), 0.0, *half[::-1]])
    kronrod = np.linalg.solve(np.polynomial.legendre.legvander(nodes, 6).T, np.array([2.0, 0, 0, 0, 0, 0, 0]))
    gauss = np.array([0, 5, 0, 8, 0, 5, 0]) / 9
    return nodes, np.stack([kronrod, kronrod, gauss, gauss, kronrod], axis=1) / 2


def _first_rules() -> tuple[FloatArray, FloatArray]:
    """The same on [0, 1] of the first panel, where force and area are powers of delta times smooth functions."""
    from scipy.special import roots_jacobi

    places, weights = [], []
    for column, (power, count) in enumerate([(5 / 2, ENDS), (7 / 3, ENDS), (5 / 2, FEW), (7 / 3, FEW), (0.0, ENDS)]):
        node, weight = roots_jacobi(count, 0.0, power)
        x = (1 + node) / 2
        places.append(x)
        weights.append(np.zeros((count, 5)))
        weights[-1][:, column] = weight / 2 ** (power + 1) / x**power
    return np.concatenate(places), np.concatenate(weights)


NODES, RULES = _rules()


class Nodes(NamedTuple):
    """Islands at approaches, arrays of one shape."""

    delta: FloatArray
    h_d: FloatArray
    sigma_d: FloatArray
    density: FloatArray  # D_d K1/(sqrt(2 pi) sigma_d), islands per area and approach but for the Gaussian (42, 46)
    force: FloatArray  # F^i/E* [length^2]
    area: FloatArray  # A^i [length^2]

    def some(self, chosen: Any) -> Nodes:
        """Those at these places."""
        return Nodes(*(field[chosen] for field in self))


class Found(NamedTuple):
    """Totals at depths; the number of islands in contact is per area."""

    force: FloatArray  # F/(A0 E*)
    area: FloatArray  # A/A0 as a sum
    force_slope: FloatArray  # against the depth [1/length]
    area_slope: FloatArray
    number: FloatArray
    error: FloatArray
    uncovered: NDArray[np.bool_]  # where islands lie outside of the model's table


class IslandCurve:
    """The islands of one surface by one model and reading.

    Parameters
    ----------
    surface : MeasuredSurface
    model : island model
        Any that needs X and mu alone.
    reading : Reading
    rtol : float
        Relative error asked of the quadrature.
    outside : {"raise", "exact", "nan"}
        "exact" solves islands that a table does not cover; else `Found.uncovered` says which depths have some.

    Raises
    ------
    InputError
        For an island model of self-affine bands alone.
    OutOfRangeError, ConvergenceError
    """

    def __init__(
        self, surface: MeasuredSurface, model: AnyModel, reading: Reading, rtol: float, outside: str = "raise"
    ) -> None:
        refuse_bands(model)
        self.surface, self.model, self.reading = surface, model, reading
        self.outside = "exact" if outside == "exact" else "nan"
        self.h_max = float(surface.h_max)
        floors = floors_of(surface, reading)
        self.kinks = floors.kinks
        # where q_d leaves the shortest wave: T is a straight line up to a part of it
        self.layer = math.sqrt(2 * math.pi * surface.C[-1]) * float(surface.q1) / floors.slope_d
        rms_over_s = 1 / s_over_h_rms(surface)
        self._K1 = float(jacobian_below(rms_over_s, reading.beta, reading.jacobian == "printed", reading.offset))
        self.islands = 0
        self.island_error = 0.0
        self._build(rtol)

    def nodes(self, delta: FloatArray) -> Nodes:
        """Islands at approaches [length]; NaN where they are not covered."""
        g = measured_islands(self.surface, delta, self.reading)
        phi = answer_islands(self.model, g, self.outside)
        self.islands += delta.size
        self.island_error = max(self.island_error, float(np.nanmax(phi.error, initial=0.0)))
        K1 = np.where(delta < self.kinks[0], self._K1, 1.0)
        density = island_density(0.0, g["D_d"], g["sigma_d"]) * K1
        return Nodes(delta, g["h_d"], g["sigma_d"], density, scale_force(g) * phi.phi_F, scale_area(g) * phi.phi_A)

    def _first_edges(self) -> FloatArray:
        """Ends of panels: where anything changes, and between them as many as geometry and Gaussian ask for."""
        laws, floors, last = self.surface.laws, floors_of(self.surface, self.reading), 2 * self.h_max
        roots = np.sqrt(laws.above(Place(np.arange(laws.width.size), laws.width)))
        kinks = [roots[roots < floors.root_d] / floors.slope_d, roots[roots < floors.root_u] / floors.slope_u]
        breaks = np.concatenate([*kinks, self.kinks])
        breaks = breaks[breaks < last]
        first = FIRST * min(self.layer, float(breaks.min(initial=last)))
        spread = float(np.sqrt(laws.below(0, floors.at_d)))
        count = math.ceil(math.log(last / first) / math.log(RATIO))
        steps = np.arange(first, last, STEP * spread)
        self._stretches = np.unique(np.append(np.geomspace(first, last, count + 1), steps))
        self._terms = TERMS + math.ceil(self.h_max / spread)
        edges = np.unique(np.append(self._stretches, breaks))
        # breaks that coincide but for rounding
        return np.append(edges[:-1][np.diff(edges) > 1e-12 * edges[:-1]], last)

    def _build(self, rtol: float) -> None:
        """Panels, halved until their Kronrod sums are good to `rtol` at every probe."""
        edges, end = self._first_edges(), 2 * self.h_max
        low, high = edges[:-1], edges[1:]
        inner = self._panels(low, high)
        probes = end * np.append(np.logspace(-4, -0.5, 6), np.linspace(0.4, 1.0, 6))
        allowed = rtol ** (2 / 3) / SAFETY
        for _ in range(MAX_ROUNDS):
            shares = self._shares(inner, low, high, probes)
            bad = shares * shares.size > allowed
            if shares.sum() <= allowed or not bad.any():
                break
            middle = np.sqrt(low[bad]) * np.sqrt(high[bad])
            fresh = np.append(low[bad], middle), np.append(middle, high[bad])
            found = self._panels(*fresh)
            inner = Nodes(*(np.concatenate([old[~bad], new]) for old, new in zip(inner, found, strict=True)))
            low, high = (np.append(old[~bad], new) for old, new in zip((low, high), fresh, strict=True))
        else:
            raise ConvergenceError(f"quadrature over islands did not reach {rtol:.1e}")
        self._quadrature_error = _bound(float(shares.sum()))
        order = np.argsort(low)
        first, first_columns = self._beginning(edges[:1])
        columns = self._columns_of(inner, low, high)[order].reshape(-1, RULES.shape[1])
        self._edges = np.append(low[order], end)
        self._nodes = Nodes(*(np.append(a, b[order]) for a, b in zip(first, inner, strict=True)))
        self._columns = np.concatenate([first_columns[0], columns])
        self._stops = first.delta.size + NODES.size * np.arange(low.size + 1)
        unknown = np.isnan(self._columns).any(axis=1)
        self._covered = float(self._nodes.delta[unknown].min(initial=math.inf))
        # up to which a law goes
        self.end = float(self._nodes.delta[self._nodes.delta < self._covered].max(initial=0.0))
        self.end = end if self._covered > end else self.end
        self._columns[unknown] = 0.0
        self._by_column = np.ascontiguousarray(self._columns.T)
        self._shift = self._heights(self._nodes, 0.0)
        starts = np.unique(np.searchsorted(self._edges, self._stretches[:-1]))
        self._stretches = np.append(self._edges[starts], end)
        points, widths = chebyshev.chebpts1(self._terms), np.diff(self._stretches)
        at = self._stretches[:-1, None] + widths[:, None] * (1 + points) / 2
        below = self._stops[starts].repeat(self._terms)
        sums = self._whole(at.ravel(), np.zeros_like(below), below).reshape(*at.shape, -1)
        # of the nodes below each stretch, over it; its own are added gap by gap
        self._series = np.linalg.inv(chebyshev.chebvander(points, self._terms - 1)) @ sums
        self._begins = self._stops[starts]

    def _panels(self, low: FloatArray, high: FloatArray) -> Nodes:
        """Islands of panels, shape (panels, 7)."""
        return self.nodes((low + high)[:, None] / 2 + (high - low)[:, None] / 2 * NODES)

    @staticmethod
    def _columns_of(nodes: Nodes, low: FloatArray, high: FloatArray) -> FloatArray:
        """What each node of panels adds to the sums, but for the Gaussian, shape (panels, 7, 5)."""
        return np.asarray(_integrands(nodes) * RULES * (high - low)[:, None, None])

    def _beginning(self, end: FloatArray) -> tuple[Nodes, FloatArray]:
        """Islands of panels from zero to these ends, and what each adds to the sums."""
        places, rules = _first_rules()
        nodes = self.nodes(end[:, None] * places)
        return nodes, np.asarray(_integrands(nodes) * rules * end[:, None, None])

    def _shares(self, inner: Nodes, low: FloatArray, high: FloatArray, depths: FloatArray) -> FloatArray:
        """Kronrod less Gauss of each panel over the whole, the largest at any depth that holds the panel."""
        worst, columns = np.zeros(low.size), self._columns_of(inner, low, high)
        # panels with islands that are not covered answer nothing
        columns[np.isnan(columns).any(axis=(1, 2))] = 0.0
        for depth in depths:
            gaussian = np.exp(-0.5 * self._heights(inner, depth) ** 2) * (high <= depth)[:, None]
            sums = np.einsum("pn,pnc->pc", gaussian, columns)
            for kronrod, gauss in ((0, 2), (1, 3)):
                total = sums[:, kronrod].sum()
                if total > 0:
                    worst = np.maximum(worst, np.abs(sums[:, kronrod] - sums[:, gauss]) / total)
        return worst

    def _heights(self, nodes: Nodes, depth: Any) -> FloatArray:
        """z'/sigma_d (41); z_max is counted down from h_max, so nothing cancels at first contact."""
        return np.asarray((self.h_max - (depth - nodes.delta) - nodes.h_d) / nodes.sigma_d)

    def density(self, nodes: Nodes, depth: Any) -> FloatArray:
        """Islands per area and approach (42, 46) at depths h_max - d [length]."""
        return np.asarray(nodes.density * np.exp(-0.5 * self._heights(nodes, depth) ** 2))

    def _whole(self, depth: FloatArray, starts: Any, stops: Any) -> FloatArray:
        """Sums over nodes from `starts` to `stops`, and slopes of the first two, shape (n, 7)."""
        out = np.empty((depth.size, RULES.shape[1] + 2))
        _add_nodes(depth, starts, stops, self._shift, 1 / self._nodes.sigma_d, self._by_column, out)
        return out

    def totals(self, depth: FloatArray) -> Found:
        """Totals at depths h_max - d [length], shape (n,); zero where they are not positive."""
        sums, slopes = np.zeros((depth.size, RULES.shape[1])), np.zeros((depth.size, 2))
        whole = np.searchsorted(self._edges, depth, side="right") - 1
        full = np.flatnonzero(whole >= 0)
        if full.size:
            own = depth[full]
            stretch = np.minimum(np.searchsorted(self._stretches, own, side="right") - 1, self._begins.size - 1)
            near = self._whole(own, self._begins[stretch], self._stops[whole[full]])
            low, high = self._stretches[stretch], self._stretches[stretch + 1]
            place = chebyshev.chebvander((2 * own - low - high) / (high - low), self._terms - 1)
            far = np.einsum("gt,gtc->gc", place, self._series[stretch])
            sums[full], slopes[full] = np.split(near + far, [-2], axis=1)
        # the panel that the depth cuts, and the island at the depth itself
        for chosen, first in ((full, False), (np.flatnonzero((whole < 0) & (depth > 0)), True)):
            if chosen.size:
                start = self._edges[np.maximum(whole[chosen], 0)]
                own = depth[chosen]
                if first:
                    nodes, columns = self._beginning(own)
                else:
                    nodes = self._panels(start, own)
                    columns = self._columns_of(nodes, start, own)
                height = self._heights(nodes, own[:, None])
                terms = np.exp(-0.5 * height * height)[..., None] * columns
                sums[chosen] += terms.sum(axis=1)
                slopes[chosen] += np.einsum("gnc,gn->gc", terms[..., :2], height / nodes.sigma_d)
                last = self.nodes(own)
                slopes[chosen] += np.exp(-0.5 * self._heights(last, own) ** 2)[:, None] * _integrands(last)[:, :2]
        unknown = ~np.isfinite(sums).all(axis=1) | (depth >= self._covered)
        touching = (depth > 0) & (sums[:, :2] > 0).all(axis=1)
        found = np.where(touching[:, None], sums, 1.0)
        difference = np.abs(found[:, 2:4] / found[:, :2] - 1).max(axis=1, initial=0.0)
        error = np.where(touching, np.maximum(_bound(difference), self._quadrature_error) + self.island_error, 0.0)
        return Found(sums[:, 0], sums[:, 1], slopes[:, 0], slopes[:, 1], sums[:, 4], error, unknown & (depth > 0))


@njit(cache=True, fastmath=REORDER, error_model="numpy", nogil=True)
def _add_nodes(
    depth: FloatArray,
    starts: NDArray[np.intp],
    stops: NDArray[np.intp],
    shift: FloatArray,
    rate: FloatArray,
    columns: FloatArray,
    out: FloatArray,
) -> None:
    """Sums of the rows of `columns` times exp(-(shift - rate depth)^2/2), and slopes of the first two by depth."""
    for k in range(depth.size):
        a = b = c = d = e = slope_a = slope_b = 0.0
        for j in range(starts[k], stops[k]):
            height = shift[j] - rate[j] * depth[k]
            share = exp(-0.5 * height * height)
            turned = share * height * rate[j]
            a += share * columns[0, j]
            b += share * columns[1, j]
            c += share * columns[2, j]
            d += share * columns[3, j]
            e += share * columns[4, j]
            slope_a += turned * columns[0, j]
            slope_b += turned * columns[1, j]
        out[k, 0], out[k, 1], out[k, 2], out[k, 3], out[k, 4], out[k, 5], out[k, 6] = a, b, c, d, e, slope_a, slope_b


def _integrands(nodes: Nodes) -> FloatArray:
    """Force, area, both again, and one, times the density of islands, in the last axis."""
    force, area = nodes.force * nodes.density, nodes.area * nodes.density
    return np.stack([force, area, force, area, nodes.density], axis=-1)


def _bound(difference: Any) -> Any:
    """Relative error of Kronrod sums that differ by so much from Gauss's."""
    return np.minimum(difference, (SAFETY * difference) ** 1.5)


@functools.lru_cache(maxsize=32)
def _kept(surface: Any, model: Any, reading: Reading, rtol: float, outside: str) -> IslandCurve:
    """`island_curve`, kept while it is asked again."""
    return IslandCurve(surface, model, reading, QUADRATURE_SHARE * rtol, outside)


def island_curve(surface: MeasuredSurface, model: AnyModel, reading: Reading, rtol: float, outside: str) -> IslandCurve:
    """The islands of a surface, to a share of `rtol`."""
    make: Any = _kept
    kept: IslandCurve = make(surface, model, reading, rtol, outside)
    return kept


def measured_totals(
    surface: MeasuredSurface, depth: FloatArray, model: AnyModel, reading: Reading, rtol: float, outside: str
) -> tuple[FloatArray, FloatArray, FloatArray, int, tuple[FloatArray, FloatArray]]:
    """F/(A0 E*), the sum of A/A0, error, islands, and slopes of both against the depth h_max - d, of its shape.

    Raises
    ------
    OutOfRangeError
        Where islands lie outside of a table and `outside` is "raise"; they are NaN if it is "nan".
    """
    curve = island_curve(surface, model, reading, rtol, outside)
    before = curve.islands
    found = curve.totals(depth.ravel())
    if outside == "raise" and found.uncovered.any():
        first = float(depth.ravel()[found.uncovered.argmax()])
        raise OutOfRangeError(
            f"islands of {int(found.uncovered.sum())} of {depth.size} entries lie outside of tier {model.name!r}, the "
            f"first at h_max - d = {first:g}; outside='exact' solves these",
            found.uncovered,
        )
    force, area, error, by_force, by_area = (
        np.where(found.uncovered, np.nan, part).reshape(depth.shape)
        for part in (found.force, found.area, found.error, found.force_slope, found.area_slope)
    )
    return force, area, error, curve.islands - before, (by_force, by_area)
