"""Totals of one surface at any gap from its islands, answered once (Eqs. 44-49).

Everything of an island depends on its approach delta alone; a gap enters through the Gaussian of its height and the
upper limit h_max - d. So islands are answered once, at Gauss nodes of panels of delta, and summed at some gaps of each
panel. These sums make polynomials of ln(F) and ln(A), and any other gap costs no more than their values.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from mbma_tables.arguments import FloatArray
from mbma_tables.errors import ConvergenceError, OutOfRangeError
from mbma_tables.islands.geometry import geometry
from mbma_tables.islands.measured import floors_of, measured_islands, s_over_h_rms
from mbma_tables.models import AnyModel, answer_islands
from mbma_tables.models.universal import UniversalModel
from mbma_tables.surfaces.measured import MeasuredSurface
from mbma_tables.surfaces.power_laws import Place
from mbma_tables.surfaces.readings import Reading
from mbma_tables.totals import kernel, panels, panels_kernel
from mbma_tables.totals.island import refuse_bands, scale_area, scale_force
from mbma_tables.totals.island_sum import kinks
from mbma_tables.totals.panels import BLOCK, CHECKS, COUNTS, MORE, POWERS, SEEN, TAIL_SHARE, Nodes, Panels, rule_of

FEW = 256  # gaps that are asked of numpy, one by one
KEPT = 64  # profiles, for whoever asks the same surface again
WIDEST = 1.25  # panels above the floor of zeta_d, in h_rms
SLOPES = 0.1  # of their relative error counts
FAR_SHARE = 0.1  # of the tolerance, for sums over islands far below
ONE_BY_ONE = 64  # panels up to which compiled code sums every island
MAX_ROUNDS = 14
NARROWED = 4  # times 32 is the end of a table found closer
MOST = 1000  # panels to be answered anew at a time


class Source(NamedTuple):
    """The islands of one surface at approaches in h_rms."""

    islands: Callable[[FloatArray], dict[str, FloatArray]]  # `geometry.FIELDS`
    h_rms: float  # in their unit of height
    peak: float  # h_max/h_rms
    layer: float  # where a band leaves the shortest wave
    at_d: float  # where zeta_d reaches its floor
    breaks: FloatArray  # where anything changes
    jacobian: float  # K1 (47) below at_d

    def density(self, g: dict[str, FloatArray], x: FloatArray, height: Any = 0.0) -> FloatArray:
        """Islands per area and approach (42, 46) in the units of `g`; but for the Gaussian without a height."""
        K1 = np.where(x < self.at_d, self.jacobian, 1.0)
        return np.asarray(kernel.island_density(height, g["D_d"], g["sigma_d"]) * K1)

    def heights(self, g: dict[str, FloatArray], x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Shift and rate of z'/sigma_d (41) = shift - rate compression; nothing cancels at first contact."""
        return ((self.peak + x) * self.h_rms - g["h_d"]) / g["sigma_d"], self.h_rms / g["sigma_d"]


def source_of(surface: tuple[float, float, float] | MeasuredSurface, reading: Reading) -> Source:
    """The islands of a surface; of a self-affine one by hurst, zeta_1 and h_max/h_rms.

    Raises
    ------
    OutOfRangeError
        Where a spectrum ends below the floor of zeta_u.
    """
    printed = reading.jacobian == "printed"
    if not isinstance(surface, MeasuredSurface):
        hurst, zeta_1, peak = surface
        h_rms = math.sqrt(-math.expm1(-2 * hurst * math.log(zeta_1)))
        breaks = np.array(kinks(hurst, zeta_1, reading))

        def islands(x: FloatArray) -> dict[str, FloatArray]:
            return geometry(x, hurst, zeta_1, reading) | {"hurst": np.full(x.size, hurst)}

        jacobian = float(kernel.jacobian_below(h_rms, reading.beta, printed, reading.offset))
        return Source(islands, h_rms, peak, zeta_1**-hurst, float(breaks[0]), breaks, jacobian)
    own, h_rms, laws, floors = surface, float(surface.h_rms), surface.laws, floors_of(surface, reading)
    roots = np.sqrt(laws.above(Place(np.arange(laws.width.size), laws.width)))
    samples = [roots[roots < floors.root_d] / floors.slope_d, roots[roots < floors.root_u] / floors.slope_u]
    # T is a straight line up to a part of it
    layer = math.sqrt(2 * math.pi * surface.C[-1]) * float(surface.q1) / floors.slope_d
    jacobian = float(kernel.jacobian_below(1 / s_over_h_rms(surface), reading.beta, printed, reading.offset))
    return Source(
        lambda x: measured_islands(own, x * h_rms, reading), h_rms, float(surface.h_max) / h_rms, layer / h_rms,
        floors.kinks[0] / h_rms, np.concatenate([*samples, floors.kinks]) / h_rms, jacobian,
    )  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Profile:
    """Totals of one surface at any gap.

    Attributes
    ----------
    source : Source
        The surface's islands.
    edges : ndarray, shape (panels + 1,)
        Ends of the panels, delta/h_rms; the last is 2 h_max/h_rms, or less where a table ends.
    series : ndarray, shape (panels, 2 rows, n), or None
        ln(F), ln(A) and so on, then their slopes by ln(compression), as Chebyshev series of the compression. In the
        first panel the logarithms lack those of the powers that they begin with. For few gaps there is none.
    error : float
        Bound on the relative error of totals, of panels and islands together.
    islands : int
        Islands answered for it.
    nodes : Nodes
        The islands.
    groups : list of (Panels, ndarray)
        Panels of one rule, and their places among all.
    compiled : bool
        Whether totals are asked of compiled code; slopes never are.
    """

    source: Source
    edges: FloatArray
    series: Any
    error: float
    islands: int
    nodes: Nodes
    groups: list[tuple[Panels, NDArray[np.intp]]]
    compiled: bool

    @property
    def end(self) -> float:
        """The largest compression that it answers."""
        return float(self.edges[-1]) * (1 + 1e-14)

    @np.errstate(under="ignore")
    def totals(self, compression: FloatArray, slopes: bool = False) -> FloatArray:
        """Totals at (h_max - d)/h_rms > 0 within the profile, shape (rows, gaps), and slopes by the compression below.

        F/(A0 E* q0 s) and the sum of areas over A0, perhaps the number of islands per area; of a measured surface
        F/(A0 E*).
        """
        count = self.nodes.weights.shape[1]
        if self.compiled and not slopes and count == 2:
            out = np.empty((2, compression.size))
            panels_kernel.fill_totals(compression, self.edges, self.series, out)
            return out
        panel = np.clip(np.searchsorted(self.edges, compression, side="right") - 1, 0, self.edges.size - 2)
        if self.series is None:
            logs, by_gap = panels.sums_at(compression, panel, self.groups, self.nodes)
            return np.concatenate([np.exp(logs), np.exp(logs) * by_gap])[: 2 * count if slopes else count]
        low, high = self.edges[panel], self.edges[panel + 1]
        basis = chebyshev.chebvander((2 * compression - low - high) / (high - low), self.series.shape[-1] - 1)
        # sums whose order does not depend on the number of gaps
        found: FloatArray = (self.series[panel, : 2 * count if slopes else count] * basis[:, None]).sum(axis=-1).T
        found[:count] = np.exp(found[:count])
        begun = panel == 0
        if begun.any():
            found[:count, begun] *= compression[begun] ** (POWERS[:count, 0] + 1)
        if slopes:
            found[count:] *= found[:count] / compression
        return found

    @functools.cached_property
    def leverage(self) -> float:
        """What a relative error of islands is worth in slopes over F/l, the largest at some panels' ends.

        An error e of f in F = integral of f G up to l changes l dF/dl by at most e (l f G + integral of f |l dG/dl|).
        """
        ends = np.unique(np.linspace(0, self.edges.size - 2, SEEN).astype(int))
        c, count = self.edges[1 + ends], self.nodes.weights.shape[1]
        found = self.totals(c, slopes=True)
        heights = self.nodes.shift - self.nodes.rate * c[:, None]
        negative = np.exp(-0.5 * heights**2) * np.minimum(heights, 0) * (self.nodes.panel <= ends[:, None])
        turned = found[count:] - 2 * (negative @ (self.nodes.weights * self.nodes.rate[:, None])).T
        own = found[:count]
        return float(np.divide(c * turned, own, out=np.zeros_like(own), where=own > 0).max())


def _edges(source: Source, last: float) -> FloatArray:
    """Panels that double from the first on, with ends where anything changes, and equal ones above zeta_d's floor."""
    breaks = source.breaks[source.breaks < last]
    first, top = min(source.layer, float(breaks.min(initial=last))), min(source.at_d, last)
    doubled, count = math.ceil(math.log2(top / first)), math.ceil((last - top) / WIDEST)
    graded = first * (top / first) ** (np.arange(doubled) / doubled) if doubled else np.array([first])
    equal = top + (last - top) * (np.arange(count) / max(count, 1))
    edges = np.sort(np.concatenate([[0.0], graded, breaks, equal, [last]]))
    # breaks that coincide but for rounding
    return np.append(edges[:-1][np.diff(edges) > 1e-12 * edges[:-1]], last)


def _count(low: FloatArray, high: FloatArray) -> NDArray[np.intp]:
    """Numbers of nodes of panels."""
    # above delta = h_rms/2 it is the Gaussian that bends
    ratio = np.divide(high - low, np.minimum(low, 0.5), out=np.full(low.size, math.inf), where=low > 0)
    counts: NDArray[np.intp] = np.array([n for _, n in COUNTS])[np.searchsorted([bound for bound, _ in COUNTS], ratio)]
    return counts


class _EndOfTable(Exception):
    """Islands beyond the approach given are not known."""


class Part(NamedTuple):
    """Panels that were answered at once, and what is known of them."""

    panels: Panels
    errors: FloatArray
    series: Any = None  # (2 rows, panels, gaps), see `Profile`
    tails: Any = None  # errors of the series

    def some(self, chosen: Any) -> Part:
        """Those at these places."""
        known = (None, None) if self.series is None else (self.series[:, chosen], self.tails[chosen])
        return Part(self.panels.some(chosen), self.errors[chosen], *known)


def _nodes(parts: list[Part]) -> tuple[FloatArray, list[NDArray[np.intp]], Nodes]:
    """Ends of all panels, the places of each part's among them, and their islands."""
    low = np.concatenate([part.panels.low for part in parts])
    order = np.argsort(low)
    ranks = np.split(np.argsort(order), np.cumsum([part.errors.size for part in parts])[:-1])
    panel, weights, turns = [], [], []
    for (rule, start, end, fields), rank in zip((part.panels for part in parts), ranks, strict=True):
        rows = len(fields) - 2
        panel.append(rank.repeat(rule.nodes.size))
        weights.append((fields[:-2] * rule.measure(end - start, rule.nodes, rows) * rule.weights).reshape(rows, -1))
        turns.append(fields[-2:].reshape(2, -1))
    shift, rate = np.concatenate(turns, axis=1)
    nodes = Nodes(np.concatenate(panel), np.concatenate(weights, axis=1).T, shift, rate)
    return low[order], ranks, nodes.some(np.argsort(nodes.panel, kind="stable"))


def _summed(
    parts: list[Part], last: float, rtol: float, compiled: bool, few: bool
) -> tuple[list[Part], FloatArray, list[NDArray[np.intp]], Nodes]:
    """Parts with the series that they lacked; ends of panels, places of each part's among them, islands in order."""
    low, ranks, nodes = _nodes(parts)
    edges, full, missed = np.append(low, last), list(parts), 0.0
    places = [k for k, part in enumerate(parts) if part.series is None and not few]
    if not places:
        return full, edges, ranks, nodes
    fresh = [(parts[k].panels, ranks[k]) for k in places]
    if compiled and low.size <= ONE_BY_ONE:
        values = panels_kernel.sums_of(fresh, nodes)
    else:
        missed = FAR_SHARE * rtol if low.size > BLOCK else 0.0
        values = panels.sums_of(fresh, nodes, edges, FAR_SHARE * rtol / math.log2(edges.size))
    for k, part in zip(places, values, strict=True):
        rows = len(part) // 2
        series = part @ parts[k].panels.rule.series.T
        tails = np.abs(series[:, :, -2:]).sum(axis=-1)
        tails[rows:] *= SLOPES / np.abs(part[rows:]).max(axis=-1)
        full[k] = parts[k]._replace(series=series, tails=missed + TAIL_SHARE * tails.max(axis=0))
    return full, edges, ranks, nodes


Fields = Callable[[FloatArray], tuple[FloatArray, float]]  # rows of `Panels.fields` at approaches, and their error


def _fields(source: Source, model: AnyModel, outside: str, rows: int) -> Fields:
    def fields(x: FloatArray) -> tuple[FloatArray, float]:
        g = source.islands(x)
        phi = answer_islands(model, g, outside)
        area = scale_area(g) * phi.phi_A
        weights = [scale_force(g) * phi.phi_F, area, np.ones(x.size), area / g["eta"]]
        density = source.density(g, x) * source.h_rms
        return np.stack([*(weight * density for weight in weights[:rows]), *source.heights(g, x)]), float(
            np.nanmax(phi.error, initial=0.0)
        )

    return fields


def _compiled_fields(shape: tuple[float, float, float], model: Any, reading: Reading) -> Fields:
    """The same of a self-affine surface and the universal table in one pass, for who compiles anyway."""
    hurst, zeta_1, peak = shape
    printed = reading.jacobian == "printed"

    def fields(x: FloatArray) -> tuple[FloatArray, float]:
        found = np.empty((4, x.size))
        _, error = kernel.fill_fields(x, peak, hurst, zeta_1, reading.numbers, printed, model.kernel, found)
        return found, error

    return fields


def _covered(fields: Fields, x: FloatArray, unknown: NDArray[np.bool_]) -> float:
    """The largest approach up to which islands are known."""
    high = float(x[unknown].min())
    low = float(x[x < high].max(initial=0.0))
    for _ in range(NARROWED):
        between = np.linspace(low, high, 34)
        lost = np.isnan(fields(between[1:-1])[0]).any(axis=0)
        first = int(np.append(lost, True).argmax())
        low, high = float(between[first]), float(between[first + 1])
    if not low > 0:
        raise OutOfRangeError("no island of this surface lies inside the table")
    return low


def _answered(
    fields: Fields, low: FloatArray, high: FloatArray, counts: NDArray[np.intp], last: float, compiled: bool
) -> tuple[list[Part], int, float]:
    """Panels of so many nodes, the number of islands, and their error.

    Raises
    ------
    _EndOfTable
    """
    kinds = counts + (low == 0)
    groups = [(rule_of(int(kind) // 2 * 2, 1 + int(kind) % 2), kinds == kind) for kind in np.unique(kinds)]
    places = [rule.approach(low[own], high[own], np.append(rule.nodes, CHECKS)) for rule, own in groups]
    x = np.concatenate([part.ravel() for part in places])
    found, error = fields(x)
    unknown = np.asarray(np.isnan(found).any(axis=0))
    if unknown.any():
        raise _EndOfTable(_covered(fields, x, unknown))
    if (found[:-2] < 0).any():
        raise ConvergenceError("K1 (47) is negative", np.array(True))
    parts, begin = [], 0
    for (rule, own), at in zip(groups, places, strict=True):
        values = found[:, begin : begin + at.size].reshape(-1, *at.shape)
        begin += at.size
        if rule.power > 1:
            values[:-2] /= at ** POWERS[: len(values) - 2]
        count = rule.nodes.size
        made = Panels(rule, low[own], high[own], np.ascontiguousarray(values[..., :count]))
        missed_by = panels_kernel.missed_by if compiled else panels.missed_by
        parts.append(Part(made, missed_by(made, values[..., count:], last)))
    return parts, x.size, error


def _built(source: Source, fields: Fields, edges: FloatArray, rtol: float, compiled: bool, few: bool) -> Profile:
    """Panels, halved until polynomials through their islands and through their sums are good to `rtol`."""
    low, high, last = edges[:-1], edges[1:], float(edges[-1])
    counts, islands, worst = _count(low, high), 0, 0.0
    parts: list[Part] = []
    for _ in range(MAX_ROUNDS):
        fresh, count, error = _answered(fields, low, high, counts, last, compiled)
        parts, islands, worst = parts + fresh, islands + count, max(worst, error)
        # no nearer than islands themselves are known
        limit = max(0.5 * rtol, worst)
        good = [part.errors <= limit for part in parts]
        if all(own.all() for own in good):
            parts, ends, ranks, nodes = _summed(parts, last, limit, compiled, few)
            error = worst + max(part.errors.max() for part in parts)
            groups = [(part.panels, rank) for part, rank in zip(parts, ranks, strict=True)]
            if few:
                return Profile(source, ends, None, float(error), islands, nodes, groups, False)
            good = [part.tails <= limit for part in parts]
            if all(own.all() for own in good):
                series = np.zeros((ends.size - 1, len(parts[0].series), COUNTS[-1][1] + MORE))
                for part, rank in zip(parts, ranks, strict=True):
                    series[rank, :, : part.series.shape[-1]] = np.moveaxis(part.series, 0, 1)
                error += max(part.tails.max() for part in parts)
                return Profile(source, ends, series, float(error), islands, nodes, groups, compiled)
        bad = [part.panels.some(~own) for part, own in zip(parts, good, strict=True)]
        parts = [part.some(own) for part, own in zip(parts, good, strict=True) if own.any()]
        low, high = (np.concatenate([getattr(lost, end) for lost in bad]) for end in ("low", "high"))
        counts = np.tile(np.repeat([p.rule.nodes.size for p in bad], [p.low.size for p in bad]), 2)
        middle = (low + high) / 2
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
        if low.size > MOST + edges.size:
            break
    raise ConvergenceError(f"a profile of islands did not reach {rtol:.1e}", np.array(True))


@functools.lru_cache(maxsize=KEPT)
def _profile(
    surface: Any, model: Any, reading: Reading, rtol: float, exact: bool, compiled: bool, few: bool, rows: int
) -> Profile:
    source = source_of(surface, reading)
    if compiled and isinstance(surface, tuple) and isinstance(model, UniversalModel):
        fields = _compiled_fields(surface, model, reading)
    else:
        fields = _fields(source, model, "exact" if exact else "nan", rows)
    edges = _edges(source, 2 * source.peak)
    # what underflows is right
    with np.errstate(under="ignore"):
        try:
            return _built(source, fields, edges, rtol, compiled, few)
        except _EndOfTable as fault:
            end = fault.args[0]
            return _built(source, fields, np.append(edges[edges < end * (1 - 1e-12)], end), rtol, compiled, few)


def profile(
    surface: tuple[float, float, float] | MeasuredSurface,
    model: AnyModel,
    reading: Reading,
    rtol: float,
    outside: str = "nan",
    size: int | None = None,
    rows: int = 2,
) -> Profile:
    """The profile of a surface, (hurst, zeta_1, h_max/h_rms) or a `MeasuredSurface`, to `rtol` and the model's error.

    `outside` is "exact" to solve islands that a table does not cover; else the profile ends with the table. For a
    `size` of up to FEW gaps islands are summed at each, in numpy. Else there are series, asked of compiled code but
    where the number of islands, or their Hertz area, is wanted, as the third and fourth of `rows`.

    Raises
    ------
    InputError, OutOfRangeError, ConvergenceError
    """
    if isinstance(surface, MeasuredSurface):
        refuse_bands(model)
    make: Any = _profile
    few = size is not None and size <= FEW
    kept: Profile = make(surface, model, reading, rtol, outside == "exact", rows == 2 and not few, few, rows)
    return kept
