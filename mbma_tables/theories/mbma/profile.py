"""Totals of one surface at any gap from its islands, evaluated once (Eqs. 42-49).

Islands depend on their approach delta alone; a gap enters through the Gaussian of their
height and the upper limit h_max - d. So islands are evaluated once, at Gauss nodes of
panels of delta, and summed at some gaps of each panel. Polynomials of ln(F) and ln(A)
interpolate these sums; any other gap costs only their evaluation.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError, OutOfRangeError
from mbma_tables.common.interrupts import in_blocks
from mbma_tables.common.shared import shared, shared_property
from mbma_tables.core import core
from mbma_tables.surfaces.spectrum import Place
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.theories.mbma.geometry import (
    floors_of,
    geometry,
    kinks,
    measured_islands,
    s_over_h_rms,
)
from mbma_tables.theories.mbma.island import refuse_bands, scale_area, scale_force
from mbma_tables.theories.mbma.island_models import AnyModel, answer_islands
from mbma_tables.theories.mbma.universal import UniversalModel
from mbma_tables.theories.mbma.variants import Variant

NODES, FEWER, NARROW = (
    16,
    8,
    0.3,
)  # nodes of a panel, and of one whose width is less than NARROW of its approaches
GAPS = 10  # largest number of gaps of a panel: a series has 2 GAPS terms
CHECKS = np.array(
    [1e-5, 0.5, 1 - 1e-5]
)  # points where the polynomials' errors are largest
# leading powers of delta of force, area, number of islands and Hertz area
POWERS = np.array([5 / 2, 7 / 3, 0, 2])[:, None, None]
KEPT = 64  # profiles in the cache
WIDEST = 1.25  # panels above the floor of zeta_d, in h_rms
MAX_ROUNDS = 30
BLOCK = 1 << 14  # gaps between two checks for interrupts
MOST = 1000  # panels evaluated together

Shape = (
    tuple[float, float, float] | MeasuredSurface
)  # hurst, zeta_1 and h_max/h_rms of self-affine ones
# function of approaches and which of them are used: rows of `Panels.fields`, and their error
Fields = Callable[[FloatArray, NDArray[np.bool_]], tuple[FloatArray, float]]


def _rule(n: int, power: int) -> tuple[FloatArray, Any]:
    """`mbma_panel_rule` of mbma.h, and the positions of its nodes and checks."""
    x, weights = np.polynomial.legendre.leggauss(n)
    nodes, gaps = (1 + x) / 2, (n + 4) // 2
    points, terms = chebyshev.chebpts1(gaps), np.eye(2 * gaps)
    to_series: Any = np.linalg.inv(chebyshev.chebvander(x, n - 1)).T
    reach = np.append(((1 + points) / 2) ** (1 / power), 1.0)
    places = (
        CHECKS,
        np.concatenate([nodes, 1 + nodes]) / 2,
        np.outer(reach, nodes).ravel(),
        reach[:-1],
    )
    matrices = [to_series @ chebyshev.chebvander(2 * at - 1, n - 1).T for at in places]
    both = [
        chebyshev.chebval(points, terms),
        chebyshev.chebval(points, chebyshev.chebder(terms)),
    ]
    series: Any = np.linalg.inv(np.concatenate(both, axis=1))
    slopes: Any = np.linalg.inv(both[0][:gaps])
    integrated = np.zeros_like(series)
    integrated[:gaps, 0], integrated[gaps:, 1 : gaps + 1] = (
        1 / gaps,
        chebyshev.chebint(slopes, axis=1)[:, 1:],
    )
    vectors: list[tuple[int, ...]] = [(NODES,), (NODES,), (GAPS + 1,)]
    columns = CHECKS.size, 2 * NODES, NODES * (GAPS + 1), GAPS
    shapes = [
        *vectors,
        *((NODES, count) for count in columns),
        (2 * GAPS, 2 * GAPS),
        (2 * GAPS, 2 * GAPS),
    ]
    held = [np.array([power, n, gaps], float)]
    for part, shape in zip(
        (nodes, weights / 2, reach, *matrices, series, integrated), shapes, strict=True
    ):
        held.append(np.zeros(shape))
        held[-1][tuple(slice(size) for size in part.shape)] = part
    shares = np.ones(NODES + CHECKS.size)
    shares[:n], shares[NODES:] = nodes**power, CHECKS**power
    return np.concatenate([part.ravel() for part in held]), shares


# rules of the panel from 0, where delta is the square of the place, of others, and of narrow ones
_RULES = [_rule(NODES, 2), _rule(NODES, 1), _rule(FEWER, 1)]
RULES = np.concatenate([rule for rule, _ in _RULES])
# positions in panels at which islands are evaluated, nodes and then CHECKS, and which of
# them are used
SHARES = np.array([shares for _, shares in _RULES])
COUNTED = SHARES < 1


class Panels(NamedTuple):
    """Panels in order; in the one from 0, weights are without their leading powers of delta."""

    kind: NDArray[np.int64]  # number of the rule
    low: FloatArray
    high: FloatArray
    # weights of force, area and so on, shift and rate of heights; (rows + 2, panels, nodes,
    # checks)
    fields: FloatArray

    def some(self, chosen: Any) -> Panels:
        """The panels at these indices."""
        fields = np.ascontiguousarray(self.fields[:, chosen])
        return Panels(self.kind[chosen], self.low[chosen], self.high[chosen], fields)

    def joined(self, other: Panels) -> Panels:
        """These panels, followed by others."""
        kind, low, high = (
            np.concatenate(pair) for pair in zip(self[:3], other[:3], strict=True)
        )
        return Panels(
            kind, low, high, np.concatenate([self.fields, other.fields], axis=1)
        )

    def missed(self, last: float) -> FloatArray:
        """Bound on the relative error of each: of the interpolated islands, and of its sums."""
        error = np.empty(self.low.size)
        core.profile_missed(RULES, *self, len(self.fields) - 2, last, error)
        return error

    def series(self) -> tuple[FloatArray, FloatArray, tuple[Any, ...]]:
        """Chebyshev series of ln of each row's sum, (panels, rows, 2 GAPS), their errors, and the islands at nodes.

        The last as weights, (rows, nodes), shift and rate of heights, and how many lie
        below each panel, and in all.
        """
        count, rows = self.low.size, len(self.fields) - 2
        series, error = np.empty((count, rows, 2 * GAPS)), np.empty(count)
        weights, (shift, rate) = (
            np.zeros((rows, NODES * count)),
            np.zeros((2, NODES * count)),
        )
        stops = np.empty(count + 1, np.int64)
        core.profile_series(
            RULES, *self, rows, series, error, weights, shift, rate, stops
        )
        return (
            series,
            error,
            (weights[:, : stops[-1]], shift[: stops[-1]], rate[: stops[-1]], stops),
        )


class Source(NamedTuple):
    """The islands of one surface at approaches in h_rms."""

    islands: Callable[[FloatArray], dict[str, FloatArray]]  # `geometry.FIELDS`
    h_rms: float  # in their unit of height
    peak: float  # h_max/h_rms
    layer: float  # where a band no longer reaches the shortest wavelength
    at_d: float  # where zeta_d reaches its floor
    breaks: FloatArray  # all breaks of the integrands
    jacobian: float  # K1 (47) below at_d

    def density(
        self, g: dict[str, FloatArray], x: FloatArray, height: Any = 0.0
    ) -> FloatArray:
        """Islands per area and approach (42, 43, 46) in the units of `g`, at `height` z'/sigma_d."""
        K1 = np.where(x < self.at_d, self.jacobian, 1.0)
        return np.asarray(
            g["D_d"]
            * np.exp(-0.5 * height * height)
            / (math.sqrt(2.0 * math.pi) * g["sigma_d"])
            * K1
        )

    def heights(
        self, g: dict[str, FloatArray], x: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Shift and rate of z'/sigma_d (41) = shift - rate compression; nothing cancels at first contact."""
        return ((self.peak + x) * self.h_rms - g["h_d"]) / g["sigma_d"], self.h_rms / g[
            "sigma_d"
        ]


def _jacobian_below(rms_over_s: float, variant: Variant) -> float:
    """K1 below the kink, by (47) or (46)."""
    if variant.jacobian == "printed":
        return 1.0 - 4.0 / 3.0 * variant.beta
    return 1.0 - 4.0 / 3.0 * variant.beta / rms_over_s if variant.offset else 1.0


def source_of(surface: Shape, variant: Variant) -> Source:
    """The islands of a surface."""
    if not isinstance(surface, MeasuredSurface):
        hurst, zeta_1, peak = surface
        h_rms = math.sqrt(-math.expm1(-2 * hurst * math.log(zeta_1)))
        breaks = np.array(kinks(hurst, zeta_1, variant))

        def islands(x: FloatArray) -> dict[str, FloatArray]:
            return geometry(x, hurst, zeta_1, variant) | {"hurst": np.full(x.size, hurst)}

        jacobian = _jacobian_below(h_rms, variant)
        return Source(
            islands, h_rms, peak, zeta_1**-hurst, float(breaks[0]), breaks, jacobian
        )
    own, h_rms, laws, floors = (
        surface,
        float(surface.h_rms),
        surface.laws,
        floors_of(surface, variant),
    )
    roots = np.sqrt(laws.above(Place(np.arange(laws.width.size), laws.width)))
    samples = [
        roots[roots < floors.root_d] / floors.slope_d,
        roots[roots < floors.root_u] / floors.slope_u,
    ]
    # T is a straight line up to a part of it
    layer = math.sqrt(2 * math.pi * surface.C[-1]) * float(surface.q1) / floors.slope_d
    jacobian = _jacobian_below(1 / s_over_h_rms(surface), variant)
    ends = floors.root_d / floors.slope_d, floors.root_u / floors.slope_u
    return Source(
        lambda x: measured_islands(own, x * h_rms, variant), h_rms, float(surface.h_max) / h_rms, layer / h_rms,
        ends[0] / h_rms, np.concatenate([*samples, ends]) / h_rms, jacobian,
    )  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Profile:
    """Totals of one surface at any gap."""

    source: Source  # the surface's islands
    # ends of the panels, delta/h_rms; the last is 2 h_max/h_rms, or less where a table ends
    edges: FloatArray
    # ln(F), ln(A) and so on as Chebyshev series of the compression, (panels, rows, terms);
    # in the first panel without the logarithms of the powers that they begin with
    series: Any
    error: float  # bound on the relative error of totals, of panels and islands together
    islands: int  # evaluated for it
    nodes: tuple[Any, ...]  # the islands of the panels, of `Panels.series`

    @shared_property
    def end(self) -> float:
        """The largest compression covered."""
        return float(self.edges[-1]) * (1 + 1e-14)

    def totals(self, compression: FloatArray, slopes: bool = False) -> FloatArray:
        """Totals at (h_max - d)/h_rms > 0 within the profile, shape (rows, gaps), and slopes by the compression below.

        F/(A0 E* q0 s) and the sum of areas over A0, perhaps the number of islands per area
        and the Hertz area; of a measured surface F/(A0 E*).
        """
        if compression.size > BLOCK:
            parts = in_blocks(
                lambda block: self.totals(compression[block], slopes),
                compression.size,
                BLOCK,
            )
            return np.concatenate(parts, axis=1)
        rows = self.series.shape[1]
        out = np.empty((2 * rows if slopes else rows, compression.size))
        core.profile_totals(
            np.ascontiguousarray(compression),
            self.edges,
            self.series,
            rows,
            int(slopes),
            out,
        )
        return out

    @shared_property
    def leverage(self) -> float:
        """Error of slopes over F/l per relative error of islands: 1.5 times the largest at some panels' ends.

        An error e of f in F = integral of f G up to l changes l dF/dl by at most e (l f G +
        integral of f |l dG/dl|).
        """
        ends = np.arange(9) * (self.edges.size - 2) // 8
        c, series, (weights, shift, rate, stops) = (
            self.edges[1 + ends],
            self.series[ends],
            self.nodes,
        )
        # at a panel's end Chebyshev polynomials are 1, and their slopes squares of degrees
        steep = (
            2 * c / (c - self.edges[ends]) * (series @ np.arange(series.shape[-1]) ** 2).T
        )
        steep[:, ends == 0] += POWERS[:2, 0] + 1
        heights = shift - rate * c[:, None]
        negative = np.exp(-0.5 * heights * heights) * np.minimum(heights, 0)
        negative *= np.arange(shift.size) < stops[1 + ends][:, None]
        turned, own = (weights * rate) @ negative.T, self.totals(c)
        return 1.5 * float(
            (
                steep
                - 2 * c * np.divide(turned, own, out=np.zeros_like(own), where=own > 0)
            ).max()
        )


def _edges(source: Source, last: float) -> FloatArray:
    """Panels of doubling width from the first on, with ends at all breaks, and equal ones above zeta_d's floor."""
    breaks = [place for place in source.breaks.tolist() if place < last]
    first, top = min(source.layer, last, *breaks), min(source.at_d, last)
    doubled, count = math.ceil(math.log2(top / first)), math.ceil((last - top) / WIDEST)
    graded = [first * (top / first) ** (k / doubled) for k in range(doubled)] or [first]
    equal = [top + (last - top) * k / count for k in range(count)]
    edges = sorted([0.0, *graded, *breaks, *equal, last])
    # breaks that coincide but for rounding
    return np.array(
        [
            *(low for low, high in itertools.pairwise(edges) if high - low > 1e-12 * low),
            last,
        ]
    )


class _EndOfTable(Exception):
    """Islands beyond the given approach are not covered."""


def _fields(source: Source, model: AnyModel, outside: str, rows: int) -> Fields:
    def fields(places: FloatArray, used: NDArray[np.bool_]) -> tuple[FloatArray, float]:
        x = places[used]
        g = source.islands(x)
        phi = answer_islands(model, g, outside)
        area = scale_area(g) * phi.phi_A
        weights = [scale_force(g) * phi.phi_F, area, np.ones(x.size), area / g["eta"]]
        density = source.density(g, x) * source.h_rms
        found = np.zeros((rows + 2, *used.shape))
        found[:, used] = [
            *(weight * density for weight in weights[:rows]),
            *source.heights(g, x),
        ]
        return found, float(np.nanmax(phi.error, initial=0.0))

    return fields


def _fields_by_table(
    shape: tuple[float, ...], model: UniversalModel, variant: Variant
) -> Fields:
    """Profile of a self-affine surface by the universal table, force and area in one pass."""
    hurst, zeta_1, peak = shape

    def fields(x: FloatArray, used: NDArray[np.bool_]) -> tuple[FloatArray, float]:
        found, error = np.empty((4, x.size)), np.empty(1)
        core.profile_islands(
            x.ravel(), peak, hurst, zeta_1, variant.numbers, *model.cells, found, error
        )
        return found.reshape(4, *x.shape), float(error[0])

    return fields


def _answered(
    fields: Fields, kind: NDArray[np.intp], low: FloatArray, high: FloatArray, last: float
) -> tuple[Panels, FloatArray, int, float]:
    """Panels and their errors, the number of islands, and their own error."""
    x, used = low[:, None] + (high - low)[:, None] * SHARES[kind], COUNTED[kind]
    found, error = fields(x, used)
    if not (found[:-2] >= 0).all():
        unknown = np.isnan(found).any(axis=0)
        known = x[x < x[unknown].min(initial=math.inf)]
        if not unknown.any():
            raise ConvergenceError("K1 (47) is negative", np.array(True))
        if not known.size:
            raise OutOfRangeError("no island of this surface lies inside the table")
        raise _EndOfTable(float(known.max()))
    if kind[0] == 0:
        found[:-2, 0] /= x[0] ** POWERS[: len(found) - 2, 0]
    made = Panels(kind, low, high, found)
    return made, made.missed(last), int(used.sum()), error


def _built(source: Source, fields: Fields, edges: FloatArray, rtol: float) -> Profile:
    """Panels, halved until polynomials through their islands, and those of their sums, are good to `rtol`."""
    low, high, last = edges[:-1], edges[1:], float(edges[-1])
    # above delta = h_rms/2 the curvature is that of the Gaussian
    kind = np.where(
        high - low <= NARROW * np.minimum(low, 0.5), 2, (low > 0).astype(np.intp)
    )
    islands, worst, known, errors = 0, 0.0, None, edges[:0]
    for _ in range(MAX_ROUNDS):
        fresh, missed, count, error = _answered(fields, kind, low, high, last)
        order = np.argsort(np.append(known.low, low)) if known else slice(None)
        known, errors = (
            known.joined(fresh).some(order) if known else fresh,
            np.append(errors, missed)[order],
        )
        islands, worst = islands + count, max(worst, error)
        # not closer than the error of the islands
        limit = max(0.5 * rtol, worst)
        bad = ~(errors <= limit)
        if not bad.any():
            ends, bound = np.append(known.low, last), float(errors.max()) + worst
            series, tails, nodes = known.series()
            bad = ~(tails <= limit)
            if not bad.any():
                return Profile(
                    source, ends, series, bound + float(tails.max()), islands, nodes
                )
        low, high = known.low[bad], known.high[bad]
        middle, parents = (low + high) / 2, known.kind[bad]
        kind = np.concatenate([parents, np.maximum(parents, 1)])
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
        known, errors = known.some(~bad), errors[~bad]
        if low.size > MOST + edges.size:
            break
    raise ConvergenceError(
        f"a profile of islands did not reach {rtol:.1e}", np.array(True)
    )


@shared(KEPT)
def _profile(
    surface: Shape, model: AnyModel, variant: Variant, rtol: float,
    outside: str = "nan", rows: int = 2, last: float = math.inf,
) -> Profile:  # fmt: skip
    """The profile of a surface to `rtol` and the model's error.

    It ends at the compression `last`, or with a table unless `outside` is "exact". Rows 3
    and 4: number and Hertz area.
    """
    if isinstance(surface, MeasuredSurface):
        refuse_bands(model)
    source = source_of(surface, variant)
    if rows == 2 and isinstance(surface, tuple) and isinstance(model, UniversalModel):
        fields = _fields_by_table(surface, model, variant)
    else:
        fields = _fields(source, model, "exact" if outside == "exact" else "nan", rows)
    edges = _edges(source, min(2 * source.peak, last))
    # underflow to zero is correct here
    with np.errstate(under="ignore"):
        while True:
            try:
                return _built(source, fields, edges, rtol)
            except _EndOfTable as fault:
                edges = np.append(
                    edges[edges < fault.args[0] * (1 - 1e-12)], fault.args[0]
                )


def profile(surface: Any, model: Any, *more: Any, **options: Any) -> Profile:
    """`_profile`, kept of the library's own island models; objects of users may change."""
    own = type(model).__module__.startswith("mbma_tables.")
    made: Profile = (_profile if own else _profile.__wrapped__)(
        surface, model, *more, **options
    )
    return made
