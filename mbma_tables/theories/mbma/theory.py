"""The MBMA model as a theory: totals of its islands at separations d = 2 u - h_max (50)."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.common.arguments import FloatArray, require
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.common.shared import shared_property
from mbma_tables.islands.geometry import kinks
from mbma_tables.islands.island_models import (
    ISLAND_MODELS,
    MIN_RTOL,
    AnyModel,
    check_outside,
    island_model_name,
)
from mbma_tables.islands.variants import NAMED, get_variant
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.surface import Surface
from mbma_tables.theories.base import (
    EVERYWHERE,
    Compression,
    Gaps,
    Solved,
    Theory,
    TheoryAnswer,
    curve_values,
    select,
)
from mbma_tables.theories.inversion import Curve
from mbma_tables.theories.mbma.island import check_band
from mbma_tables.theories.mbma.models import get_model, with_table
from mbma_tables.theories.mbma.profile import Shape, profile, shape_of, spectra_of
from mbma_tables.theories.mbma.sums import (
    QUADRATURE_SHARE,
    Sums,
    totals_at,
)

SCAN = 49  # compressions at which force, area and stiffness are searched for a maximum
# leading powers of h_max - d of force and area
POWERS = (3.5, 10 / 3)
LAYER_SHARE = 0.5  # of the boundary layer, up to which these powers dominate
MAX_AREA = 0.1  # above it islands begin to overlap (docs/fidelity.md)


@dataclasses.dataclass(frozen=True, repr=False)
class Mbma(Theory):
    """The MBMA model of one island model and variant.

    Parameters
    ----------
    island_model : str or island model
        How islands are evaluated: "universal" or "island4d", the shipped tables; "exact",
        the solver; "formula" or "rigid", closed forms; the path of a table's file, which is
        read once; or an object, such as that of `mbma_tables.open_table`.
    variant : str or Variant
        Interpretation of the paper: "reported", "printed" or "fitted", or a `Variant`.
    rtol : float
        Relative error of totals against the island model, in [1e-11, 0.1].
    outside : {"raise", "exact", "nan"}
        What happens where a table does not cover an island: an error, the solver, or NaN.

    Raises
    ------
    InputError
        For an unknown variant or `outside`.

    Examples
    --------
    >>> from mbma_tables.theories import Mbma
    >>> Mbma(rtol=1e-4, outside="exact")
    Mbma(rtol=0.0001, outside='exact')
    >>> Mbma(variant="reported") == Mbma()
    True
    """

    island_model: str | AnyModel = "universal"
    variant: Any = "reported"
    rtol: float = 1e-8
    outside: str = "raise"

    name = "mbma"
    looks_of_batch = 4  # a look costs as much as a step of Newton's method
    advice = "theory='calibrated' for stiffness or separation"

    def __post_init__(self) -> None:
        check_outside(self.outside)
        object.__setattr__(self, "variant", get_variant(self.variant))
        if self.island_model not in ISLAND_MODELS:
            object.__setattr__(self, "island_model", with_table(self.island_model))

    @property
    def variant_name(self) -> str:
        """Name of the variant in results."""
        return str(self.variant.name)

    @property
    def island_model_name(self) -> str:
        """Name of the island model in results."""
        return island_model_name(self.island_model)

    @shared_property
    def sums(self) -> Sums:
        """The island model as an object, and how its islands are summed."""
        model = get_model(self.island_model, self.rtol, self.variant)
        return Sums(model, self.variant, self.rtol, self.outside)

    @shared_property
    def _scanned(self) -> Mbma:
        """The same theory, but with NaN instead of errors for islands that are not covered."""
        if self.outside != "raise":
            return self
        return dataclasses.replace(self, outside="nan")

    def totals(
        self,
        surface: AnySurface,
        separation: FloatArray,
        E_star: ArrayLike = 1.0,
        slopes: bool = False,
    ) -> Solved:
        """Force and area at separations d [length] of the surface's broadcast shape."""
        gap = np.asarray(separation, float)
        require(
            "separation",
            gap,
            gap >= -surface.h_max,
            "at least -h_max, where the model ends at full compression",
        )
        if isinstance(surface, Surface):
            check_band(surface, self.variant)
        return totals_at(surface, gap, self.sums, E_star, slopes)

    def solved(self, surface: AnySurface, gaps: Gaps, modulus: FloatArray) -> Solved:
        """Totals at separations d, the model's own coordinate, without their slopes."""
        return self.totals(surface, gaps.separation, modulus)

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and stiffness at mean separations u [length] from 0 to h_max."""
        u = np.asarray(mean_separation, dtype=float)
        separation = 2 * u - np.asarray(surface.h_max)
        totals = self.totals(surface, separation, slopes=True)
        # du = dd/2
        stiffness = -2 * totals.pressure_slope
        return TheoryAnswer(totals.pressure, totals.area, stiffness, totals.error)

    def curve(self, surface: AnySurface, quantity: str) -> Curve:
        h_max = np.asarray(surface.h_max)

        def values(u: FloatArray) -> tuple[FloatArray, FloatArray, bool]:
            totals = totals_at(surface, 2 * u - h_max, self.sums, 1.0, slopes=True)
            stiffness = -2 * totals.pressure_slope
            return curve_values(quantity, totals.pressure, totals.area, stiffness)

        return values

    def law_curves(self, surface: AnySurface, rtol: float) -> Compression:
        """Totals of a profile of islands, to the island model's end or full compression.

        Below half of the boundary layer force and area are powers of the compression times
        polynomials.
        """
        # the sums over islands are to be ten times as accurate as the polynomials
        rtol_of_sums = max(0.1 * rtol, MIN_RTOL)
        model = get_model(self.island_model, rtol_of_sums, self.variant)
        if not isinstance(surface, Surface):
            (surface,) = spectra_of(surface)
        h_max = float(surface.h_max)
        h_rms = float(surface.h_rms)
        stress = 1.0
        if isinstance(surface, Surface):
            check_band(surface, self.variant)
            # totals of a self-affine surface are over q0 s, too
            stress = float(surface.q0 * surface.s)
        outside = "exact" if self.outside == "exact" else "nan"
        totals = profile(shape_of(surface), model, self.variant, rtol_of_sums, outside)
        # rounding may pass full compression
        end = min(float(totals.edges[-1]) * h_rms, 2 * h_max)

        def force_and_area(x: FloatArray) -> FloatArray:
            sums = totals.totals(x * end / h_rms)
            if not sums.all():
                raise OutOfRangeError(
                    f"h_max is {h_max / h_rms:g} h_rms, so high that force or area underflow"
                )
            sums[0] *= stress
            sums[1] = self.variant.area_of(sums[1])
            return sums

        return Compression(
            end=end,
            values=force_and_area,
            kinks=tuple((totals.source.breaks[-2:] * h_rms / end).tolist()),
            layer=LAYER_SHARE * totals.source.layer * h_rms / end,
            powers=POWERS,
            error=totals.error,
            leverage=totals.leverage,
        )

    def bends(self, surface: AnySurface) -> FloatArray:
        """Mean separations [length] at which the largest island reaches floors (27, 30).

        First that of zeta_d, then that of zeta_u.
        """
        if not isinstance(surface, Surface):
            return np.empty(0)
        approaches_over_h_rms = np.array(
            kinks(surface.hurst, surface.zeta_1, self.variant)
        )
        approaches = approaches_over_h_rms * np.asarray(surface.h_rms)
        u = np.asarray(surface.h_max) - approaches / 2
        return np.asarray(u[u > 0] if surface.shape == () else np.maximum(u, 0))

    def interval(
        self, surface: AnySurface, quantity: str = "pressure"
    ) -> tuple[FloatArray, FloatArray]:
        """Mean separations [length] from where force or area is largest to first contact.

        Or from where the table ends.
        """
        high = np.asarray(surface.h_max, dtype=float)
        lowest = np.zeros(surface.shape)
        if isinstance(surface, Surface):
            check_band(surface, self.variant)
        else:
            # islands up to an approach of 2 h_max make u = 0
            ends = [self._end(shape) for shape in spectra_of(surface)]
            lowest = high * (1 - np.reshape(ends, surface.shape))
        return self._maximum(surface, quantity, lowest), high

    def _end(self, surface: Shape) -> float:
        """Where the islands of a spectrum end, over twice the highest point."""
        rtol = QUADRATURE_SHARE * self.rtol
        of_surface = profile(surface, self.sums.model, self.variant, rtol, self.outside)
        return float(of_surface.edges[-1]) / (2 * of_surface.source.peak)

    def branch(
        self, surface: AnySurface, quantity: str, wanted: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """The part of the interval in which force and area rise with compression, if it suffices.

        In batches, whose islands are summed gap by gap, the search for their maximum costs
        more than the rest of an inversion.
        """
        if not isinstance(surface, Surface):
            return self.interval(surface, quantity)
        check_band(surface, self.variant)
        high = np.asarray(surface.h_max, dtype=float)
        first = np.asarray(self._rising_from(surface))
        separation = 2 * first - high
        answer = self._scanned.totals(surface, separation)
        reached = answer.pressure if quantity == "pressure" else answer.area
        shape = np.broadcast_shapes(wanted.shape, surface.shape)
        is_beyond = np.broadcast_to(~(wanted <= reached), shape)
        if not is_beyond.any():
            return first, high
        places = np.flatnonzero(is_beyond)
        deeper, _ = self.interval(select(surface, shape, places), quantity)
        first = np.array(np.broadcast_to(first, shape))
        first[is_beyond] = deeper
        return first, high

    def _rising_from(self, surface: Surface) -> FloatArray:
        """Mean separation [length] from which on force and area fall for sure.

        Every island has fewer of its kind at a larger separation d where its height z' = d +
        delta - h_d (41) is positive, thus from the largest h_d - delta on. Up to the floor of
        zeta_d, h_d is a multiple of delta; it is constant from there on.
        """
        h_rms_over_s = np.sqrt(-np.expm1(-2 * surface.hurst * np.log(surface.zeta_1)))
        multiple = 4 / 3 * self.variant.beta / h_rms_over_s
        at_floor, _ = kinks(surface.hurst, surface.zeta_1, self.variant)
        separation = np.maximum(multiple - 1, 0) * at_floor * surface.h_rms
        h_max = np.asarray(surface.h_max)
        return np.asarray((h_max + np.minimum(separation, h_max)) / 2)

    def domain(self, surface: AnySurface) -> tuple[FloatArray, FloatArray]:
        """All mean separations from 0: answers are beyond the largest force, too.

        Where islands lie outside their table, `outside` says what happens.
        """
        return EVERYWHERE

    def softening(self, surface: AnySurface) -> FloatArray:
        """Mean separation [length] below which stiffness falls with compression.

        NaN where it does not.
        """
        return self._maximum(surface, "stiffness", np.full(surface.shape, np.nan))

    def provenance(self) -> tuple[str, ...]:
        content = getattr(self.sums.model, "content", None)
        if content is None:
            return (f"island model: {self.island_model_name}",)
        return (f"table: data {str(content.attributes['values_sha256'])[:16]}",)

    def reasons_of_flow(self) -> tuple[str, ...]:
        return ("leakage: the mean separation of 'mbma' is wrong by factors",)

    def scatter_name(self, surface: AnySurface) -> str:
        """Scatter of the variant: only the named ones were compared with boundary elements."""
        name = self.variant.name
        if self.variant not in NAMED.values():
            return f"{self.name}, user-defined variant"
        return self.name if name == "reported" else f"{self.name}_{name}"

    def reasons(
        self, surface: AnySurface, answer: TheoryAnswer, mean_separation: FloatArray
    ) -> dict[str, NDArray[np.bool_]]:
        reasons = dict(super().reasons(surface, answer, mean_separation))
        overlap = (
            f"areas of islands are added without overlap, but A/A0 is above {MAX_AREA:g}"
        )
        reasons[overlap] = (answer.area > MAX_AREA) & (self.variant.addition == "sum")
        softer = "stiffness falls with compression here, which no simulation shows"
        reasons[softer] = mean_separation < self.softening(surface)
        return reasons

    def _maximum(
        self, surface: AnySurface, quantity: str, otherwise: FloatArray
    ) -> FloatArray:
        """Mean separation of the first local maximum of a quantity under compression.

        `otherwise` where there is none.
        """
        kind = "pressure" if quantity == "stiffness" else quantity
        row = 1 if quantity == "stiffness" else 0  # of the results of `curve`
        depth = np.arange(1, SCAN + 1) / SCAN
        h_max = np.asarray(surface.h_max, dtype=float)
        places = np.arange(h_max.size).reshape(*surface.shape, 1)
        batch = select(surface, surface.shape, places)
        # entries whose islands are not covered are ignored
        curve = self._scanned.curve(batch, kind)
        scanned = np.reshape(curve(h_max[..., None] * (1 - depth))[row], (-1, SCAN))
        falls = np.diff(scanned, axis=-1) < 0
        turns = np.flatnonzero(falls.any(axis=-1))
        result = np.array(otherwise, dtype=float).reshape(-1)
        if turns.size:
            top = h_max.ravel()[turns]
            curve = self._scanned.curve(select(surface, surface.shape, turns), kind)
            result[turns] = _refined(curve, row, top, falls[turns].argmax(axis=-1))
        return result.reshape(surface.shape)


def _refined(
    curve: Curve, row: int, h_max: FloatArray, peak: NDArray[np.intp]
) -> FloatArray:
    """Mean separations of maxima, whose compressions are beside those numbered `peak`.

    scipy.optimize would take 0.3 s to import.
    """
    column = np.arange(peak.size)
    # compressions over h_max
    low = np.maximum(peak, 0.5) / SCAN
    high = (peak + 2) / SCAN
    # eight times the two points of nine beside the highest one bound the next nine
    for _ in range(8):
        depth = np.linspace(low, high, 9)
        values = np.nan_to_num(curve(h_max * (1 - depth))[row], nan=-np.inf)
        highest = values.argmax(axis=0).clip(1, 7)
        low = depth[highest - 1, column]
        high = depth[highest + 1, column]
    return np.asarray(h_max * (1 - (low + high) / 2))
