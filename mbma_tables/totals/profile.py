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
from mbma_tables.islands.geometry import floors_of, geometry, measured_islands, s_over_h_rms
from mbma_tables.models import AnyModel, answer_islands
from mbma_tables.models.universal import UniversalModel
from mbma_tables.surfaces.measured import MeasuredSurface
from mbma_tables.surfaces.power_laws import Place
from mbma_tables.surfaces.readings import Reading
from mbma_tables.totals import kernel, panels, panels_kernel
from mbma_tables.totals.island import refuse_bands, scale_area, scale_force
from mbma_tables.totals.island_sum import kinks
from mbma_tables.totals.panels import CHECKS, COUNTS, POWERS, Group, Nodes, Panels, rule_of

FEW = 256  # gaps that are asked of numpy, one by one
KEPT = 64  # profiles, for whoever asks the same surface again
WIDEST = 1.25  # panels above the floor of zeta_d, in h_rms
MAX_ROUNDS = 30
MOST = 1000  # panels to be answered anew at a time

Fields = Callable[[FloatArray], tuple[FloatArray, float]]  # rows of `Panels.fields` at approaches, and their error
Part = tuple[Panels, FloatArray]  # panels that were answered at once, and their errors


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
    """

    source: Source
    edges: FloatArray
    series: Any
    error: float
    islands: int
    nodes: Nodes
    groups: list[Group]

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
        if self.series is None:
            parts = [self._summed(compression[k : k + FEW]) for k in range(0, compression.size, FEW)]
            return np.concatenate(parts, axis=1)[: 2 * count if slopes else count]
        if not slopes:
            out = np.empty((2, compression.size))
            panels_kernel.fill_totals(compression, self.edges, self.series, out)
            return out
        panel = self._panel(compression)
        low, high = self.edges[panel], self.edges[panel + 1]
        basis = chebyshev.chebvander((2 * compression - low - high) / (high - low), self.series.shape[-1] - 1)
        # sums whose order does not depend on the number of gaps
        found: FloatArray = (self.series[panel] * basis[:, None]).sum(axis=-1).T
        found[:count] = np.exp(found[:count]) * np.where(panel > 0, 1.0, compression ** (POWERS[:count, 0] + 1))
        found[count:] *= found[:count] / compression
        return found

    def _panel(self, compression: FloatArray) -> NDArray[np.intp]:
        places = np.searchsorted(self.edges, compression, side="right") - 1
        return np.clip(places, 0, self.edges.size - 2)

    @np.errstate(under="ignore")
    def _summed(self, compression: FloatArray) -> FloatArray:
        logs, by_gap = panels.sums_at(compression, self._panel(compression), self.groups, self.nodes)
        return np.concatenate([np.exp(logs), np.exp(logs) * by_gap])

    @functools.cached_property
    def leverage(self) -> float:
        """What a relative error of islands is worth in slopes over F/l, the largest at some panels' ends.

        An error e of f in F = integral of f G up to l changes l dF/dl by at most e (l f G + integral of f |l dG/dl|).
        """
        ends = np.unique(np.linspace(0, self.edges.size - 2, 9).astype(int))
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


def _answered(
    fields: Fields, low: FloatArray, high: FloatArray, counts: NDArray[np.intp], last: float, few: bool
) -> tuple[list[Part], int, float]:
    """Panels of so many nodes and their errors, the number of islands, and their own error.

    Raises
    ------
    _EndOfTable
    """
    kinds = 2 * counts + (low == 0)
    groups = [(rule_of(kind // 2, 1 + kind % 2), kinds == kind) for kind in sorted(set(kinds.tolist()))[::-1]]
    places = [rule.approach(low[own], high[own], rule.seen) for rule, own in groups]
    x = np.concatenate([part.ravel() for part in places])
    found, error = fields(x)
    if np.isnan(found).any():
        known = x[x < x[np.isnan(found).any(axis=0)].min()]
        if not known.size:
            raise OutOfRangeError("no island of this surface lies inside the table")
        raise _EndOfTable(float(known.max()))
    if (found[:-2] < 0).any():
        raise ConvergenceError("K1 (47) is negative", np.array(True))
    parts, missed_by = [], panels.missed_by if few else panels_kernel.missed_by
    for (rule, own), at, end in zip(groups, places, np.cumsum([part.size for part in places]), strict=True):
        values = found[:, end - at.size : end].reshape(-1, *at.shape)
        if rule.power > 1:
            values[:-2] /= at ** POWERS[: len(values) - 2]
        made = Panels(rule, low[own], high[own], np.ascontiguousarray(values[..., : -CHECKS.size]))
        parts.append((made, missed_by(made, values[..., -CHECKS.size :], last)))
    return parts, x.size, error


def _merged(parts: list[Part]) -> tuple[FloatArray, list[Group], Nodes]:
    """Low ends of panels, panels of each rule with their places among all, and islands, all in order."""
    made = []
    for rule in {id(own.rule): own.rule for own, _ in parts}.values():
        low, high, fields = zip(*(own[1:] for own, _ in parts if own.rule is rule), strict=True)
        every = Panels(rule, np.concatenate(low), np.concatenate(high), np.concatenate(fields, axis=1))
        made.append(every if (np.diff(every.low) > 0).all() else every.some(np.argsort(every.low)))
    starts = np.sort(np.concatenate([own.low for own in made]))
    groups = [(own, np.searchsorted(starts, own.low)) for own in made]
    panel, weights, turns = [], [], []
    for (rule, low, high, fields), rank in groups:
        rows = len(fields) - 2
        panel.append(rank.repeat(rule.nodes.size))
        weights.append((fields[:-2] * rule.measure(high - low, rule.nodes, rows) * rule.weights).reshape(rows, -1))
        turns.append(fields[-2:].reshape(2, -1))
    nodes = Nodes(np.concatenate(panel), np.concatenate(weights, axis=1).T, *np.concatenate(turns, axis=1))
    ordered = (np.diff(nodes.panel) >= 0).all()
    return starts, groups, nodes if ordered else nodes.some(np.argsort(nodes.panel, kind="stable"))


def _built(source: Source, fields: Fields, edges: FloatArray, rtol: float, few: bool) -> Profile:
    """Panels, halved until polynomials through their islands, and those of their sums, are good to `rtol`."""
    low, high, last = edges[:-1], edges[1:], float(edges[-1])
    counts, islands, worst, seen = _count(low, high), 0, 0.0, 0.0
    parts: list[Part] = []
    for _ in range(MAX_ROUNDS):
        fresh, count, error = _answered(fields, low, high, counts, last, few)
        islands, worst = islands + count, max(worst, error)
        # no nearer than islands themselves are known
        limit = max(0.5 * rtol, worst)
        seen = max([seen, *(float(errors[errors <= limit].max(initial=0.0)) for _, errors in fresh)])
        parts += fresh
        if all((errors <= limit).all() for _, errors in parts):
            starts, groups, nodes = _merged(parts)
            ends = np.append(starts, last)
            if few:
                return Profile(source, ends, None, seen + worst, islands, nodes, groups)
            series, tails = panels_kernel.series_of(groups, nodes)
            if (tails <= limit).all():
                return Profile(source, ends, series, seen + worst + float(tails.max()), islands, nodes, groups)
            parts = [(own, tails[rank]) for own, rank in groups]
        bad = [(own.some(~(errors <= limit)), own.rule.nodes.size) for own, errors in parts]
        parts = [(own.some(errors <= limit), errors[errors <= limit]) for own, errors in parts]
        low, high = (np.concatenate([getattr(own, end) for own, _ in bad]) for end in ("low", "high"))
        middle = (low + high) / 2
        counts = np.tile(np.concatenate([np.full(own.low.size, count) for own, count in bad]), 2)
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
        if low.size > MOST + edges.size:
            break
    raise ConvergenceError(f"a profile of islands did not reach {rtol:.1e}", np.array(True))


@functools.lru_cache(maxsize=KEPT)
def _profile(surface: Any, model: Any, reading: Reading, rtol: float, exact: bool, few: bool, rows: int) -> Profile:
    source = source_of(surface, reading)
    if not few and isinstance(surface, tuple) and isinstance(model, UniversalModel):
        fields = _compiled_fields(surface, model, reading)
    else:
        fields = _fields(source, model, "exact" if exact else "nan", rows)
    edges = _edges(source, 2 * source.peak)
    # what underflows is right
    with np.errstate(under="ignore"):
        try:
            return _built(source, fields, edges, rtol, few)
        except _EndOfTable as fault:
            end = fault.args[0]
            return _built(source, fields, np.append(edges[edges < end * (1 - 1e-12)], end), rtol, few)


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
    `size` of up to FEW gaps, or where the number of islands or their Hertz area is wanted as the third and fourth of
    `rows`, islands are summed at each gap in numpy. Else there are series, made and asked by compiled code.

    Raises
    ------
    InputError, OutOfRangeError, ConvergenceError
    """
    if isinstance(surface, MeasuredSurface):
        refuse_bands(model)
    make: Any = _profile
    few = rows > 2 or (size is not None and size <= FEW)
    kept: Profile = make(surface, model, reading, rtol, outside == "exact", few, rows)
    return kept
