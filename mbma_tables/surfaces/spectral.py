"""A surface given by its spectrum, measured or as samples, without a fit."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import finite_array, one_number, positive_array, require
from mbma_tables.common.display import Variable
from mbma_tables.common.errors import InputError, OutOfRangeError
from mbma_tables.common.units import Units
from mbma_tables.surfaces.any_surface import AnySurface, frozen
from mbma_tables.surfaces.bearing_curve import Bearing, RadialSpectrum
from mbma_tables.surfaces.heights import Heights, of_area
from mbma_tables.surfaces.spectrum import MIN_ZETA_1, Band, PowerLaws
from mbma_tables.surfaces.treatment import Treated

if TYPE_CHECKING:
    from mbma_tables.surfaces.map_simulation import MapSimulation

# ranges of the surfaces of the data set's group elastic. If they are taken as isotropic
# Gaussian ones, area is within 20% between 1% and 10% contact; outside the ranges it is
# wrong by 30% to factors
BY_SPECTRUM = {
    "skewness of heights": (-0.4, 0.4),
    "kurtosis of heights": (2.4, 4.4),
    "kurtosis of slopes": (2.8, 3.3),
    "anisotropy": (1.0, 4.1),
}
# ranges of maps with the stated scatter; and of all kinds of which several were simulated
# (also of its group machined), for which the law by their map is wrong by up to 80%
BY_MAP = {
    "skewness of heights": (-0.5, 0.5),
    "kurtosis of heights": (2.0, 4.0),
    "kurtosis of slopes": (2.9, 3.1),
    "anisotropy": (1.0, 1.2),
}
PRESSED = {
    "skewness of heights": (-3.1, 3.3),
    "kurtosis of slopes": (2.6, 16.5),
    "anisotropy": (1.0, 17.6),
}
# ends of the largest islands' band (27a); wavenumbers at which it is tried
WIDEST = 1.5
SCAN = 400
# largest deviation of ln C from one power law for which a spectrum counts as self-affine
SAME_LAW = 0.01
# ratio of wavenumbers at the end of a spectrum by which it is continued, that of the narrowest
# spectrum; and the least Hurst exponent there
TOP = MIN_ZETA_1
LEAST_HURST = 0.05
# ratio of wavenumbers in a sum of spectra, which deviates from power laws between them by
# at most 1e-4
FINE = 1.02
NO_POWER = 1e-3  # share of the squared gradient beyond the last wavelengths that count
# the same for boundary elements: rounding to single precision, or to the 16 bits of an
# instrument, is 1e-13 or 1e-7
ROUNDED = 1e-6
SIDE = 1e-12  # beside a wavenumber, relative
# power laws up to which a spectrum is one of numbers, not of a measurement
FEW_BANDS = 4
NO_MAP: dict[str, Any] = {
    "bearing": None,
    "bands": None,
    "map": None,
    "table": None,
    "scans": (),
}


@dataclasses.dataclass(frozen=True, eq=False)
class SpectralSurface(AnySurface):
    """A surface given by its isotropic spectrum.

    `Surface.from_spectrum`, `Surface.from_map` and `AnySurface.combined` make one.

    Parameters
    ----------
    q : array_like, shape (n,)
        Wavenumber [1/length], positive, in any order; a repeated one is a jump of the spectrum.
    C : array_like, shape (n,)
        Spectrum [length^4] as h_rms^2 = 2 pi integral C q dq (Eqs. 4-6), not negative: a
        power law between neighbours, nothing beyond the ends or beside a zero.
    h_max : float, optional
        Height of the highest point above the mid-plane [length]; that of `heights` if not given.
    heights : Heights, optional
        Distribution of heights; a Gaussian that ends at h_max if not given.
    bearing : Bearing, optional
        Curves of a periodic map: shape of its highest and lowest parts
        (`mbma_tables.surfaces.bearing_curve`).
    bands : RadialSpectrum, optional
        The same map's spectrum by bands, unsmoothed; goes with `bearing`.
    map : Treated, optional
        The treated heights themselves, for `theory="simulated"`.
    table : MapSimulation, optional
        What boundary elements found of them already (`mbma_tables.theories.simulated.pressing`).
    scans : tuple of MeasuredSurface, optional
        Several, of which it is the average (`mbma_tables.surfaces.averages`), or, of
        traces, surfaces that differ by their sampling error. What laws of them differ by
        adds to the scatter.
    samples : array_like, shape (n,), optional
        Independent samples behind each entry of C, as weights of a fit.
    anisotropy : float, optional
        Root of the ratio of the gradient tensor's eigenvalues, 1 if isotropic; None where
        not measured.
    unit : str, optional
        Unit of length, such as "um", of the numbers and the results; None if it is not known.
    provenance : sequence of mapping, optional
        The treatment of the measurement, a plain record for each step: {"step": "detrend",
        "kind": "plane"}, ...
    nominal_area : float or str, optional
        Instead of h_max, as for `Surface`.

    Raises
    ------
    InputError, OutOfRangeError
        For an invalid spectrum: NaN, wrong shapes, negative values, less than a factor 3 of
        wavenumbers.

    Examples
    --------
    >>> import numpy as np
    >>> from mbma_tables import Surface
    >>> q = np.geomspace(0.2, 50, 200)  # a plateau up to 1, then H = 0.8
    >>> surface = Surface.from_spectrum(q, 0.01 * np.minimum(1, q**-3.6), h_max=1.1, unit="um")
    >>> surface
    MeasuredSurface(200 samples from q = 0.2 to 50, h_rms=0.2634, h_max=1.1,
                    rms gradient 0.7808, unit='um')
    """

    q: Any
    C: Any
    h_max: Any = None
    heights: Any = None
    bearing: Bearing | None = None
    bands: RadialSpectrum | None = None
    map: Treated | None = None
    table: MapSimulation | None = None
    scans: tuple[Any, ...] = ()
    samples: Any = None
    anisotropy: float | None = None
    unit: str | None = None
    provenance: tuple[Mapping[str, Any], ...] = ()
    nominal_area: dataclasses.InitVar[Any] = None

    def __post_init__(self, nominal_area: Any) -> None:
        q = finite_array("q", self.q)
        C = finite_array("C", self.C)
        if q.ndim != 1 or q.shape != C.shape:
            raise InputError(
                f"q and C must be two columns of one length, got shapes {q.shape} and {C.shape}"
            )
        require("q", q, q > 0, "positive (leave q = 0 out)")
        require("C", C, C >= 0, "zero or positive")
        keep = {"q": q, "C": C}
        if self.samples is not None:
            keep["samples"] = np.broadcast_to(
                positive_array("samples", self.samples), q.shape
            )
        order = np.argsort(q, kind="stable")
        with_power = np.flatnonzero(C[order] > 0)
        inside = (
            order[with_power[0] : with_power[-1] + 1] if with_power.size else order[:0]
        )
        vars(self).update({name: frozen(array[inside]) for name, array in keep.items()})
        if with_power.size == 1:
            raise InputError(
                f"the spectrum has one wavenumber, {self.q[0]:.6g}: theories need a band of them, "
                "the largest more than 3 times the smallest"
            )
        if with_power.size < 2 or not self.laws.width.size:
            raise InputError(
                "the spectrum holds no height: no two neighbours in q have positive C"
            )
        numbers = {
            "q0": self.q[0],
            "q1": self.q[-1],
            "h_rms": math.sqrt(self.laws.moment(0)),
        }
        numbers |= {f"m{order}": self.laws.moment(order) for order in (2, 4)}
        vars(self).update({name: np.float64(number) for name, number in numbers.items()})
        require(
            "largest q over smallest",
            np.asarray(self.zeta_1),
            self.zeta_1 > MIN_ZETA_1,
            "greater than 3",
        )
        if not all(math.isfinite(m) and m > 0 for m in (self.m0, self.m2, self.m4)):
            raise OutOfRangeError(
                "the spectrum's moments overflow or vanish: choose another length unit"
            )
        vars(self).update(unit=Units(self.unit).length)
        heights = self.heights
        top = self.h_max
        provenance = tuple(self.provenance)
        if nominal_area is not None:
            top, provenance = of_area(self, nominal_area, top)
            heights = None if heights is None or heights.is_gaussian else heights
        if heights is None and top is None:
            raise InputError(
                "h_max is missing: the highest point above the mid-plane, heights= of "
                "the surface, or nominal_area"
            )
        top = (
            heights.h_max
            if top is None
            else float(positive_array("h_max", one_number("h_max", top)))
        )
        heights = Heights.gaussian(self.h_rms, top) if heights is None else heights
        vars(self).update(heights=heights, h_max=top, provenance=provenance)

    def __repr__(self) -> str:
        numbers = (
            f"h_rms={self.h_rms:.4g}, h_max={self.h_max:.4g}, rms gradient "
            f"{self.rms_gradient:.4g}"
        )
        unit = "" if self.unit is None else f", unit={self.unit!r}"
        return (
            f"{type(self).__name__}({self.q.size} samples from q = {self.q0:.4g} to "
            f"{self.q1:.4g}, {numbers}{unit})"
        )

    def _variables(self) -> dict[str, Variable]:
        length = self.unit or "length"
        spectrum = {
            "q": Variable(self.q, f"1/{length}", "wavenumber", ("q",)),
            "C": Variable(
                self.C,
                f"{length}^4",
                "power spectrum, h_rms^2 = 2 pi integral C q dq",
                ("q",),
            ),
        }
        return super()._variables() | spectrum

    @functools.cached_property
    def laws(self) -> PowerLaws:
        """The power laws between samples."""
        return PowerLaws(self.q, self.C)

    @property
    def skewness(self) -> float:
        """Skewness of heights."""
        return float(self.heights.skewness)

    @property
    def kurtosis(self) -> float:
        """Kurtosis of heights, 3 if Gaussian."""
        return float(self.heights.kurtosis)

    @functools.cached_property
    def hurst(self) -> float | None:
        """Hurst exponent of a spectrum that is one power law within a percent; else None."""
        x = np.log(self.q)
        y = np.log(np.maximum(self.C, np.finfo(float).tiny))
        slope, level = np.polyfit(x, y, 1)
        exponent = -slope / 2 - 1
        straight = np.abs(y - level - slope * x).max() <= SAME_LAW
        return (
            float(min(exponent, 1.0))
            if straight and 0 < exponent <= 1 + SAME_LAW
            else None
        )

    @functools.cached_property
    def beyond(self) -> float:
        """Height variance [length^2] of waves shorter than the shortest, if the spectrum went on.

        It goes on by the power law whose variances from q1/3 to q1/sqrt(3), and from there
        to q1, are its own: a continuous function of the spectrum, also of that of two faces
        that differ little, which has a jump at each end. Below a Hurst exponent of 0.05, as
        the variance of such a power law has no bound, it falls to 0, which it is where the
        variances rise.
        """
        last, both = self.laws.above(self.laws.place(self.q1 / TOP ** np.array([0.5, 1])))
        if not last:
            return 0.0
        # of a power law 3^H - 1
        fall = max(both / last - 2, 0.0)
        return float(last * fall / max(fall, TOP**LEAST_HURST - 1) ** 2)

    @functools.cached_property
    def longest(self) -> float:
        """Wavenumber q_L from which a band holds most height [1/length].

        The band is as wide as that of the largest islands. q_L is the lowest wavenumber of a
        self-affine spectrum, near the roll-off of one with a plateau. MBMA's floors refer to it.
        """
        q = np.unique(np.append(self.q, np.geomspace(self.q0, self.q1, SCAN)))[:-1]
        start = self.laws.place(q)
        end = self.laws.place(np.minimum(WIDEST * q, self.q1))
        return float(q[self.laws.between(0, start, end).argmax()])

    def departures(self, by_map: bool = False) -> tuple[str, ...]:
        """Reasons why it is unlike the surfaces compared with BEM.

        These were maps, or isotropic Gaussian surfaces.
        """
        return (*self.doubts, *self.outside(BY_MAP if by_map else BY_SPECTRUM, by_map))

    def outside(
        self, tested: Mapping[str, tuple[float, float]], by_map: bool = False
    ) -> tuple[str, ...]:
        """Statistics that lie outside tested ranges, and the remedy."""
        statistics = {
            "skewness of heights": self.skewness,
            "kurtosis of heights": self.kurtosis,
        }
        if self.bearing is not None:
            statistics["kurtosis of slopes"] = self.bearing.slope_kurtosis
        if self.anisotropy is not None:
            statistics["anisotropy"] = self.anisotropy
        remedy = "beyond, only 'calibrated' by a map was tested"
        if self.scans and (call := self.scans[0].simulating("surface.scans[0]")):
            remedy = f"{call} simulates one scan"
        elif call := self.simulating():
            remedy = f"{call} simulates the map"
        return tuple(
            f"{name} is {statistics[name]:.3g}, tested from {low:g} to {high:g}: {remedy}"
            for name, (low, high) in tested.items()
            if name in statistics and not low <= statistics[name] <= high
        )

    def simulating(self, name: str = "surface") -> str:
        """A call that simulates the map, at wavelengths that its sampling resolves.

        Empty where there is no map.
        """
        if self.map is None or self.map.heights.ndim != 2:
            return ""
        return f"contact({name}, ..., theory='simulated')"

    def power_spectrum(self, q: ArrayLike) -> Any:
        """C(q) [length^4], a power law between samples, zero outside [q0, q1]."""
        return self.laws.at(positive_array("q", q))[()]

    def sampled(self) -> Self:
        """Itself."""
        return self

    def bands_if_few(self) -> tuple[Band, ...]:
        """The power laws between its samples, where these are few and all that is known of it."""
        laws = self.laws
        is_measured = self.anisotropy is not None or self.bearing or self.scans
        if laws.width.size > FEW_BANDS or is_measured or not self.heights.is_gaussian:
            return ()
        numbers = np.exp(laws.log_low), np.exp(laws.log_high), laws.low, laws.slope
        return tuple(map(Band, *(each.tolist() for each in numbers)))

    def scaled(self, factor: float, unit: str | None) -> Self:
        """The same surface in another length unit; `factor` is the old unit in the new one."""
        return dataclasses.replace(self.resized(factor, factor), unit=unit)

    def resized(self, up: float, along: float) -> Self:
        """The surface with heights `up` times as large.

        Lengths along the plane are `along` times as large.
        """
        bearing = self.bearing
        bands = self.bands
        whole = self.map
        if bearing is not None:
            moved = dict.fromkeys(("h_rms", "h_max", "quantiles", "mean_height"), up)
            moved |= dict.fromkeys(("gradient", "tension_force", "tension"), up / along)
            bearing = dataclasses.replace(
                bearing,
                **{name: by * getattr(bearing, name) for name, by in moved.items()},
            )
        if bands is not None:
            bands = dataclasses.replace(
                bands, q=bands.q / along, variance=bands.variance * up**2
            )
        if whole is not None:
            steps = tuple(along * step for step in whole.steps)
            whole = dataclasses.replace(whole, heights=up * whole.heights, steps=steps)
        table = None if self.table is None else self.table.resized(up, along)
        scans = tuple(scan.resized(up, along) for scan in self.scans)
        parts: dict[str, Any] = {
            "bearing": bearing,
            "bands": bands,
            "map": whole,
            "table": table,
            "scans": scans,
        }
        parts |= {"q": self.q / along, "C": self.C * (up * along) ** 2}
        return dataclasses.replace(
            self, **parts, h_max=self.h_max * up, heights=self.heights.scaled(up)
        )

    def between(self, low: float, high: float) -> Self:
        """The wavelengths from one wavenumber to another; heights shrink in proportion.

        The curves of a map are left out.
        """
        inside = (self.q > low) & (self.q < high)
        q = np.concatenate([[low], self.q[inside], [high]])
        C = np.concatenate(
            [self.power_spectrum(q[:1]), self.C[inside], self.power_spectrum(q[-1:])]
        )
        scans = tuple(scan.between(low, high) for scan in self.scans)
        changed = {**NO_MAP, "scans": scans, "q": q, "C": C, "samples": None}
        less = dataclasses.replace(self, **changed)
        return dataclasses.replace(
            less, heights=self.heights.scaled(float(less.h_rms / self.h_rms))
        )

    def added(self, other: SpectralSurface) -> Self:
        """The equivalent surface of two in one unit; see `AnySurface.combined`."""
        low = min(self.q0, other.q0)
        high = max(self.q1, other.q1)
        fine = np.geomspace(
            low, high, math.ceil(math.log(high / low) / math.log(FINE)) + 1
        )
        grid = np.unique(np.clip(np.concatenate([fine, self.q, other.q]), low, high))
        # both sides of every wavenumber, since the sum jumps at the ends of bands
        sides = np.stack([grid[:-1] * (1 + SIDE), grid[1:] * (1 - SIDE)], axis=1).ravel()
        q = np.repeat(grid, 2)[1:-1]
        C = self.laws.at(sides) + other.laws.at(sides)
        distinct = np.append(True, (np.diff(q) > 0) | (np.abs(np.diff(C)) > 1e-9 * C[1:]))
        remarks = []
        stretch = None
        if self.bearing is not None or other.bearing is not None:
            remarks.append(
                "curves of the maps' summits and valleys are not used: the relative "
                "position of the maps is not known"
            )
        if self.anisotropy is not None or other.anisotropy is not None:
            # the largest of a sum: parallel, their tensors of mean gradients have the same axes
            parts = [
                (float(one.m2), (one.anisotropy or 1.0) ** 2) for one in (self, other)
            ]
            stretch = math.sqrt(
                sum(m2 * a / (1 + a) for m2, a in parts)
                / sum(m2 / (1 + a) for m2, a in parts)
            )
            remarks.append(
                f"lays are assumed to be parallel: anisotropy {stretch:.3g} at most"
            )
        record = {
            "step": "combined",
            "of": [list(self.provenance), list(other.provenance)],
        }
        both = type(self)(
            q[distinct],
            C[distinct],
            heights=self.heights.convolved(other.heights),
            scans=self._scans_added(other),
            anisotropy=stretch,
            unit=self.unit,
            provenance=(
                record
                | ({"told": "two rough faces: " + "; ".join(remarks)} if remarks else {}),
            ),
        )
        return both.resolved() if self.resolution or other.resolution else both

    def _scans_added(self, other: SpectralSurface) -> tuple[Self, ...]:
        """Sums of the scans of both surfaces, each of which is its own scan where it has none."""
        one = self.scans or (self,)
        two = other.scans or (other,)
        count = max(len(one), len(two))
        if count == 1:
            return ()
        return tuple(one[k % len(one)].added(two[k % len(two)]) for k in range(count))

    def resolved(self) -> Self:
        """The same measured surface, with a record of what its shortest octave contributes."""
        unit = f" {self.unit}" if self.unit else ""
        # the map may be sampled more finely than its shortest wavelength
        shortest = self.shortest(NO_POWER)
        sampled = 2 * math.pi / float(self.q[-1])
        before = float(
            self.laws.below(2, self.laws.place(np.asarray(math.pi / shortest)))
        )
        gradient = math.sqrt(before / float(self.laws.moment(2)))
        finer = (
            f" (sampled to {sampled:.4g}{unit}, without power there)"
            if sampled < shortest
            else ""
        )
        known = (
            "area depends on resolution: wavelengths are known down to "
            f"{shortest:.4g}{unit}{finer}"
        )
        # of a map it is simulated when it is asked for, as the gradient does not determine it
        more = (
            ", and without the last octave of them the rms gradient would be "
            f"{gradient:.2f} times as large"
            if self.map is None
            else "; last_octave(contact(surface, ...)) simulates what the last octave of "
            "them does to it"
        )
        record = {
            "step": "resolution",
            "shortest": shortest,
            "gradient_without_last_octave": gradient,
            "told": known + more,
        }
        return dataclasses.replace(self, provenance=(*self.provenance, record))

    def shortest(self, without: float) -> float:
        """Wavelength [length] below which lies at most this share of the squared gradient."""
        below = self.laws.below(2, self.laws.place(self.q))
        return 2 * math.pi / float(self.q[np.argmax(below >= (1 - without) * below[-1])])
