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
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError, OutOfRangeError
from mbma_tables.common.interrupts import in_blocks
from mbma_tables.common.shared import kept_with, shared, shared_property
from mbma_tables.core import core
from mbma_tables.islands.geometry import (
    floors_of,
    geometry,
    kinks,
    measured_islands,
    s_over_h_rms,
)
from mbma_tables.islands.island_models import AnyModel, answer_islands
from mbma_tables.islands.variants import Variant
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.banded import BandedSurface
from mbma_tables.surfaces.spectrum import Band, Place
from mbma_tables.surfaces.surface import MeasuredSurface, Surface
from mbma_tables.tables.universal import UniversalModel
from mbma_tables.theories.mbma.island import refuse_bands, scale_area, scale_force

NODES = 16  # nodes of a panel, MBMA_PANEL_NODES of mbma.h
GAPS = 10  # largest number of gaps of a panel: a series has 2 GAPS terms
# points where the polynomials' errors are largest, as shares of the panel
CHECKS = np.array([1e-5, 0.5, 1 - 1e-5])
# leading powers of delta of force, area, number of islands and Hertz area, in rows
POWERS = np.array([5 / 2, 7 / 3, 0, 2])[:, None]
BLOCK = 1 << 14  # gaps between two checks for interrupts

KEPT = 256  # profiles
# hurst, zeta_1 and h_max/h_rms of self-affine surfaces, or a measured one
Shape = tuple[float, float, float] | MeasuredSurface
# function of approaches and which of them are used: rows of `Panels.fields`, and their error
Fields = Callable[[FloatArray, NDArray[np.bool_]], tuple[FloatArray, float]]
# islands at nodes: weights (rows, nodes), shift and rate of heights, and how many lie below
# each panel, and in all
Nodes = tuple[FloatArray, FloatArray, FloatArray, NDArray[np.int64]]


def spectra_of(surface: AnySurface) -> list[MeasuredSurface]:
    """One surface given by its spectrum, or those of a batch of sums of power laws, in their order."""
    if isinstance(surface, MeasuredSurface):
        return [surface]
    return _spectra_of_batch(surface)


# of a batch, whose surfaces may be more than `_of_bands` keeps
@kept_with
def _spectra_of_batch(surface: AnySurface) -> list[MeasuredSurface]:
    numbers = np.broadcast_arrays(*surface.numbers().values())
    rows = np.reshape(numbers, (len(numbers), -1)).T.tolist()
    return [_of_bands(tuple(row)) for row in rows]


@shared(KEPT)
def _of_bands(numbers: tuple[float, ...]) -> MeasuredSurface:
    """One sum of power laws by samples of its spectrum; the same object for the same numbers, by which its profile is kept."""
    bands = [Band(*numbers[k : k + 4]) for k in range(1, len(numbers), 4)]
    sampled: MeasuredSurface = BandedSurface(bands, numbers[0]).sampled()
    return sampled


def shape_of(surface: AnySurface) -> Shape:
    """One surface as `profile` takes it."""
    if not isinstance(surface, Surface):
        return spectra_of(surface)[0]
    peak = float(surface.h_max / surface.h_rms)
    return float(surface.hurst), float(surface.zeta_1), peak


def _series_matrices(gap_points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Matrices to Chebyshev series: of values and slopes, and of slopes and the mean value.

    Rows are values at the gaps, then slopes.
    """
    gaps = gap_points.size
    terms = np.eye(2 * gaps)
    values = chebyshev.chebval(gap_points, terms)
    slopes = chebyshev.chebval(gap_points, chebyshev.chebder(terms))
    by_both = np.linalg.inv(np.concatenate([values, slopes], axis=1))
    # the mean value is the constant term; the others are the integral of the slopes' series
    slopes_to_series = np.linalg.inv(values[:gaps])
    by_slopes = np.zeros_like(by_both)
    by_slopes[:gaps, 0] = 1 / gaps
    integrals = chebyshev.chebint(slopes_to_series, axis=1)
    by_slopes[gaps:, 1 : gaps + 1] = integrals[:, 1:]
    return by_both, by_slopes


def _padded(part: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """An array with zeros behind it along each axis, flat, as a rule's field in C."""
    field = np.zeros(shape)
    field[tuple(slice(size) for size in part.shape)] = part
    return field.ravel()


def _rule(count: int, power: int) -> tuple[FloatArray, FloatArray]:
    """`mbma_panel_rule` of mbma.h, of so many nodes, along which delta rises like place^power.

    The second result are its nodes and then `CHECKS`, as shares of the panel of delta; 1
    where a rule has fewer than `NODES`.
    """
    gauss_points, weights = np.polynomial.legendre.leggauss(count)
    nodes = (1 + gauss_points) / 2
    gaps = (count + 4) // 2
    gap_points = chebyshev.chebpts1(gaps)
    # places of the gaps, and the end of the panel
    reach = np.append(((1 + gap_points) / 2) ** (1 / power), 1.0)

    vandermonde = chebyshev.chebvander(gauss_points, count - 1)
    nodes_to_series = np.linalg.inv(vandermonde).T

    def interpolation_at(places: FloatArray) -> FloatArray:
        """The matrix that takes values at the nodes to those at other places."""
        return np.asarray(
            nodes_to_series @ chebyshev.chebvander(2 * places - 1, count - 1).T
        )

    at_halves = np.concatenate([nodes, 1 + nodes]) / 2
    at_parts = np.outer(reach, nodes).ravel()
    by_both, by_slopes = _series_matrices(gap_points)
    fields = [
        np.array([power, count, gaps], float),
        _padded(nodes, (NODES,)),
        _padded(weights / 2, (NODES,)),
        _padded(reach, (GAPS + 1,)),
        _padded(interpolation_at(CHECKS), (NODES, CHECKS.size)),
        _padded(interpolation_at(at_halves), (NODES, 2 * NODES)),
        _padded(interpolation_at(at_parts), (NODES, NODES * (GAPS + 1))),
        _padded(interpolation_at(reach[:-1]), (NODES, GAPS)),
        _padded(by_both, (2 * GAPS, 2 * GAPS)),
        _padded(by_slopes, (2 * GAPS, 2 * GAPS)),
    ]

    shares = np.ones(NODES + CHECKS.size)
    shares[:count] = nodes**power
    shares[NODES:] = CHECKS**power
    return np.concatenate(fields), shares


# rules of the panel from 0, where delta is the square of the place, of others, and of narrow
# ones, which need fewer nodes
FIRST, USUAL, NARROW = range(3)
_RULES = [_rule(NODES, 2), _rule(NODES, 1), _rule(8, 1)]
RULES = np.concatenate([rule for rule, _ in _RULES])
# where panels have islands, by rule, and which of these places are used
SHARES = np.array([shares for _, shares in _RULES])
COUNTED = SHARES < 1


def _rules_of(low: FloatArray, high: FloatArray) -> NDArray[np.intp]:
    """Numbers of the rules for panels between these approaches [h_rms]."""
    # above delta = h_rms/2 the curvature is that of the Gaussian
    is_narrow = high - low <= 0.3 * np.minimum(low, 0.5)
    return np.where(is_narrow, NARROW, (low > 0).astype(np.intp))


class Panels(NamedTuple):
    """Panels in order; in the one from 0, weights are without their leading powers of delta."""

    kind: NDArray[np.int64]  # number of the rule
    low: FloatArray
    high: FloatArray
    # weights of force, area and so on, shift and rate of heights; (rows + 2, panels, nodes,
    # checks)
    fields: FloatArray

    def some(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> Panels:
        """The panels under a mask, or at these indices."""
        fields = np.ascontiguousarray(self.fields[:, chosen])
        return Panels(self.kind[chosen], self.low[chosen], self.high[chosen], fields)

    def joined(self, other: Panels) -> Panels:
        """These panels, followed by others."""
        return Panels(
            np.concatenate([self.kind, other.kind]),
            np.concatenate([self.low, other.low]),
            np.concatenate([self.high, other.high]),
            np.concatenate([self.fields, other.fields], axis=1),
        )

    def halves(
        self, chosen: NDArray[np.bool_]
    ) -> tuple[NDArray[np.intp], FloatArray, FloatArray]:
        """Rules, lower and upper ends of the halves of panels, all lower halves first."""
        low = self.low[chosen]
        high = self.high[chosen]
        kind = self.kind[chosen]
        middle = (low + high) / 2
        # the upper half of the panel from 0 does not begin there
        upper_kind = np.maximum(kind, USUAL)
        return (
            np.concatenate([kind, upper_kind]),
            np.concatenate([low, middle]),
            np.concatenate([middle, high]),
        )

    def missed(self, last: float) -> FloatArray:
        """Bound on the relative error of each: of the interpolated islands, and of its sums."""
        error = np.empty(self.low.size)
        rows = len(self.fields) - 2
        core.profile_missed(RULES, *self, rows, last, error)
        return error

    def series(self) -> tuple[FloatArray, FloatArray, Nodes]:
        """Chebyshev series of ln of each row's sum, (panels, rows, 2 GAPS), with their errors.

        The third result are the islands at nodes.
        """
        count = self.low.size
        rows = len(self.fields) - 2
        series = np.empty((count, rows, 2 * GAPS))
        error = np.empty(count)
        # narrow panels have fewer nodes, so that these arrays may end early
        weights = np.zeros((rows, NODES * count))
        shift = np.zeros(NODES * count)
        rate = np.zeros(NODES * count)
        stops = np.empty(count + 1, np.int64)
        core.profile_series(
            RULES, *self, rows, series, error, weights, shift, rate, stops
        )
        total = stops[-1]
        nodes = weights[:, :total], shift[:total], rate[:total], stops
        return series, error, nodes


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
        self, g: dict[str, FloatArray], x: FloatArray, height: FloatArray | float = 0.0
    ) -> FloatArray:
        """Islands per area and approach (42, 43, 46) in the units of `g`.

        `height` is z'/sigma_d.
        """
        K1 = np.where(x < self.at_d, self.jacobian, 1.0)
        gaussian = g["D_d"] * np.exp(-0.5 * height * height)
        norm = math.sqrt(2.0 * math.pi) * g["sigma_d"]
        return np.asarray(gaussian / norm * K1)

    def heights(
        self, g: dict[str, FloatArray], x: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Shift and rate of z'/sigma_d (41) = shift - rate compression.

        Nothing cancels at first contact.
        """
        shift = ((self.peak + x) * self.h_rms - g["h_d"]) / g["sigma_d"]
        return shift, self.h_rms / g["sigma_d"]


def _jacobian_below(rms_over_s: float, variant: Variant) -> float:
    """K1 below the kink, by (47) or (46)."""
    if variant.jacobian == "printed":
        return 1.0 - 4.0 / 3.0 * variant.beta
    return 1.0 - 4.0 / 3.0 * variant.beta / rms_over_s if variant.offset else 1.0


def source_of(surface: Shape, variant: Variant) -> Source:
    """The islands of a surface."""
    if isinstance(surface, MeasuredSurface):
        return _measured_source(surface, variant)
    hurst, zeta_1, peak = surface
    h_rms_over_s = math.sqrt(-math.expm1(-2 * hurst * math.log(zeta_1)))
    breaks = np.array(kinks(hurst, zeta_1, variant))

    def islands(x: FloatArray) -> dict[str, FloatArray]:
        return geometry(x, hurst, zeta_1, variant) | {"hurst": np.full(x.size, hurst)}

    return Source(
        islands,
        h_rms_over_s,
        peak,
        layer=zeta_1**-hurst,
        at_d=float(breaks[0]),
        breaks=breaks,
        jacobian=_jacobian_below(h_rms_over_s, variant),
    )


def _measured_source(surface: MeasuredSurface, variant: Variant) -> Source:
    """The islands of a surface given by a spectrum."""
    h_rms = float(surface.h_rms)
    laws = surface.laws
    floors = floors_of(surface, variant)

    def islands(x: FloatArray) -> dict[str, FloatArray]:
        return measured_islands(surface, x * h_rms, variant)

    # approaches [length] at which an end of the band passes a sample of the spectrum, up to
    # its floor
    samples = Place(np.arange(laws.width.size), laws.width)
    roots = np.sqrt(laws.above(samples))
    samples_d = roots[roots < floors.root_d] / floors.slope_d
    samples_u = roots[roots < floors.root_u] / floors.slope_u
    at_d = floors.root_d / floors.slope_d
    at_u = floors.root_u / floors.slope_u
    breaks = np.concatenate([samples_d, samples_u, (at_d, at_u)]) / h_rms
    # T is a straight line up to a part of it
    root_of_slope = math.sqrt(2 * math.pi * surface.C[-1])
    layer = root_of_slope * float(surface.q1) / floors.slope_d
    return Source(
        islands,
        h_rms,
        float(surface.h_max) / h_rms,
        layer=layer / h_rms,
        at_d=at_d / h_rms,
        breaks=breaks,
        jacobian=_jacobian_below(1 / s_over_h_rms(surface), variant),
    )


@dataclasses.dataclass(frozen=True)
class Profile:
    """Totals of one surface at any gap."""

    source: Source  # the surface's islands
    # ends of the panels, delta/h_rms; the last is 2 h_max/h_rms, or less where a table ends
    edges: FloatArray
    # ln(F), ln(A) and so on as Chebyshev series of the compression, (panels, rows, terms);
    # in the first panel without the logarithms of the powers that they begin with
    series: FloatArray
    error: float  # bound on the relative error of totals, of panels and islands together
    islands: int  # evaluated for it
    nodes: Nodes  # the islands of the panels

    @shared_property
    def end(self) -> float:
        """The largest compression covered."""
        return float(self.edges[-1]) * (1 + 1e-14)

    def totals(self, compression: FloatArray, slopes: bool = False) -> FloatArray:
        """Totals at (h_max - d)/h_rms > 0 within the profile, shape (rows, gaps).

        F/(A0 E* q0 s) and the sum of areas over A0, perhaps the number of islands per area
        and the Hertz area; of a measured surface F/(A0 E*). With `slopes`, their
        derivatives by the compression below.
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
        gaps = np.ascontiguousarray(compression)
        core.profile_totals(gaps, self.edges, self.series, rows, int(slopes), out)
        return out

    @shared_property
    def leverage(self) -> float:
        """Error of slopes over F/l per relative error of islands.

        It is 1.5 times the largest at some panels' ends. An error e of f in F = integral of
        f G up to l changes l dF/dl by at most e (l f G + integral of f |l dG/dl|).
        """
        # nine panels from the first to the last
        panels = np.arange(9) * (self.edges.size - 2) // 8
        low = self.edges[panels]
        compression = self.edges[1 + panels]
        series = self.series[panels]
        # at a panel's end Chebyshev polynomials are 1, and their slopes squares of degrees
        squares = np.arange(series.shape[-1]) ** 2
        log_slopes = 2 * compression / (compression - low) * (series @ squares).T
        # where the series is without the powers that ln F and ln A begin with
        log_slopes[:, panels == 0] += POWERS[:2] + 1

        # |l dG/dl| is l dG/dl, which the slope has, less twice its part where z' is negative
        weights, shift, rate, stops = self.nodes
        heights = shift - rate * compression[:, None]
        negative = np.exp(-0.5 * heights * heights) * np.minimum(heights, 0)
        numbers_below = stops[1 + panels]
        is_below = np.arange(shift.size) < numbers_below[:, None]
        negative *= is_below
        turned = (weights * rate) @ negative.T
        totals = self.totals(compression)
        shares = np.divide(turned, totals, out=np.zeros_like(totals), where=totals > 0)
        return 1.5 * float((log_slopes - 2 * compression * shares).max())


def _edges(source: Source, last: float) -> FloatArray:
    """Ends of panels: of doubling width from the first on, and equal ones above zeta_d's floor.

    All breaks are among them.
    """
    breaks = [place for place in source.breaks.tolist() if place < last]
    first = min(source.layer, last, *breaks)
    top = min(source.at_d, last)
    doubled = math.ceil(math.log2(top / first))
    graded = [first * (top / first) ** (k / doubled) for k in range(doubled)] or [first]
    # up to 1.25 h_rms wide
    count = math.ceil((last - top) / 1.25)
    equal = [top + (last - top) * k / count for k in range(count)]
    edges = sorted([0.0, *graded, *breaks, *equal, last])
    # breaks that coincide but for rounding
    distinct = [
        low for low, high in itertools.pairwise(edges) if high - low > 1e-12 * low
    ]
    return np.array([*distinct, last])


class _EndOfTable(Exception):
    """Islands beyond the given approach are not covered."""


def _fields(source: Source, model: AnyModel, outside: str, rows: int) -> Fields:
    """Islands by any model, as fields of panels."""

    def fields(places: FloatArray, used: NDArray[np.bool_]) -> tuple[FloatArray, float]:
        x = places[used]
        g = source.islands(x)
        phi = answer_islands(model, g, outside)
        force = scale_force(g) * phi.phi_F
        area = scale_area(g) * phi.phi_A
        weights = [force, area, np.ones(x.size), area / g["eta"]]
        density = source.density(g, x) * source.h_rms
        out = np.zeros((rows + 2, *used.shape))
        for row, weight in enumerate(weights[:rows]):
            out[row, used] = weight * density
        out[rows:, used] = source.heights(g, x)
        return out, float(np.nanmax(phi.error, initial=0.0))

    return fields


def _fields_by_table(
    shape: tuple[float, float, float], model: UniversalModel, variant: Variant
) -> Fields:
    """Islands of a self-affine surface by the universal table, force and area in one pass."""
    hurst, zeta_1, peak = shape

    def fields(x: FloatArray, used: NDArray[np.bool_]) -> tuple[FloatArray, float]:
        out = np.empty((4, x.size))
        error = np.empty(1)
        core.profile_islands(
            x.ravel(), peak, hurst, zeta_1, variant.numbers, *model.cells, out, error
        )
        return out.reshape(4, *x.shape), float(error[0])

    return fields


def _evaluated(
    fields: Fields, kind: NDArray[np.intp], low: FloatArray, high: FloatArray
) -> tuple[Panels, int, float]:
    """Panels with their islands, the number of these, and their own error."""
    x = low[:, None] + (high - low)[:, None] * SHARES[kind]
    used = COUNTED[kind]
    rows, error = fields(x, used)
    weights = rows[:-2]
    if not (weights >= 0).all():
        is_missing = np.isnan(rows).any(axis=0)
        if not is_missing.any():
            raise ConvergenceError("K1 (47) is negative", np.array(True))
        covered = x[x < x[is_missing].min(initial=math.inf)]
        if not covered.size:
            raise OutOfRangeError("no island of this surface lies inside the table")
        raise _EndOfTable(float(covered.max()))
    if kind[0] == FIRST:
        weights[:, 0] /= x[0] ** POWERS[: len(weights)]
    return Panels(kind, low, high, rows), int(used.sum()), error


def _built(source: Source, fields: Fields, edges: FloatArray, rtol: float) -> Profile:
    """Panels, halved until polynomials through their islands, and of their sums, are good.

    That is, to `rtol`.
    """
    last = float(edges[-1])
    low = edges[:-1]
    high = edges[1:]
    kind = _rules_of(low, high)
    panels: Panels | None = None
    errors = edges[:0]
    islands = 0
    islands_error = 0.0
    for _ in range(30):
        fresh, count, error = _evaluated(fields, kind, low, high)
        fresh_errors = fresh.missed(last)
        if panels is None:
            panels = fresh
            errors = fresh_errors
        else:
            order = np.argsort(np.append(panels.low, low))
            panels = panels.joined(fresh).some(order)
            errors = np.append(errors, fresh_errors)[order]
        islands += count
        islands_error = max(islands_error, error)

        # not closer than the error of the islands
        limit = max(0.5 * rtol, islands_error)
        is_coarse = ~(errors <= limit)
        if not is_coarse.any():
            series, tails, nodes = panels.series()
            is_coarse = ~(tails <= limit)
            if not is_coarse.any():
                ends = np.append(panels.low, last)
                bound = float(errors.max()) + islands_error + float(tails.max())
                return Profile(source, ends, series, bound, islands, nodes)

        kind, low, high = panels.halves(is_coarse)
        panels = panels.some(~is_coarse)
        errors = errors[~is_coarse]
        # panels that are evaluated together, of 19 islands each
        if low.size > 1000 + edges.size:
            break
    message = f"a profile of islands did not reach {rtol:.1e}"
    raise ConvergenceError(message, np.array(True))


@shared(KEPT)
def _profile(
    surface: Shape,
    model: AnyModel,
    variant: Variant,
    rtol: float,
    outside: str,
    rows: int,
    last: float,
) -> Profile:
    """`profile`, made anew."""
    if isinstance(surface, MeasuredSurface):
        refuse_bands(model)
    source = source_of(surface, variant)
    by_table = False
    if rows == 2 and isinstance(surface, tuple) and isinstance(model, UniversalModel):
        by_table = True
        fields = _fields_by_table(surface, model, variant)
    else:
        fields = _fields(source, model, outside, rows)
    edges = _edges(source, min(2 * source.peak, last))
    # underflow to zero is correct here
    with np.errstate(under="ignore"):
        while True:
            try:
                return _built(source, fields, edges, rtol)
            except _EndOfTable as fault:
                if by_table and outside == "exact":
                    # islands beyond the table are solved one by one
                    by_table = False
                    fields = _fields(source, model, outside, rows)
                    continue
                end = fault.args[0]
                edges = np.append(edges[edges < end * (1 - 1e-12)], end)


def profile(
    surface: Shape,
    model: AnyModel,
    variant: Variant,
    rtol: float,
    outside: str = "nan",
    rows: int = 2,
    last: float = math.inf,
) -> Profile:
    """The profile of a surface to `rtol` and the model's error.

    It ends at the compression `last`, or with a table unless `outside` is "exact". Rows 3
    and 4: number and Hertz area. Profiles of the library's own island models are cached;
    objects of users may change.
    """
    is_of_library = type(model).__module__.startswith("mbma_tables.")
    make: Callable[..., Profile] = _profile if is_of_library else _profile.__wrapped__
    # one profile for all who end at the table, whether they refuse what is beyond or not
    beyond = "exact" if outside == "exact" else "nan"
    return make(surface, model, variant, rtol, beyond, rows, last)
