"""Surfaces whose spectra are sums of power laws: two parts in contact, a roll-off, a gap.

They have a row of numbers for each power law, as self-affine surfaces have for their one.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import (
    FloatArray,
    broadcast_shape,
    finite_array,
    is_labelled,
    positive_array,
    require,
    spread,
)
from mbma_tables.common.display import shown
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import Units
from mbma_tables.surfaces.any_surface import AnySurface, apply, frozen, refuse_plain
from mbma_tables.surfaces.heights import of_area
from mbma_tables.surfaces.spectral import WIDEST, SpectralSurface
from mbma_tables.surfaces.spectrum import (
    MAX_ZETA_1,
    MIN_ZETA_1,
    MOST_BANDS,
    SHARES,
    Band,
    growth,
)

# wavenumbers at which the longest waves are looked for, besides the ends of bands
SCAN = 48
SAME = 1e-12  # relative difference of numbers that differ by rounding
MOMENTS = ("m0", "m2", "m4")
DERIVED = ("q0", "q1", *MOMENTS)


def moment(order: int, bands: tuple[Band, ...], low: Any, high: Any) -> FloatArray:
    """m_n of the wavelengths between wavenumbers, of sums of power laws."""
    total: Any = 0.0
    for band in bands:
        start = np.maximum(low, band.q_low)
        width = np.log(np.minimum(high, band.q_high) / start)
        power = band.power + order + 2
        at_start = band.C * (start / band.q_low) ** band.power * start ** (order + 2)
        part = at_start * width * growth(power, width)
        total = total + np.where(width > 0, part, 0.0)
    return np.asarray(2 * math.pi * SHARES[order] * total)


def _bands_of(numbers: tuple[Any, ...]) -> tuple[Band, ...]:
    """Bands of their numbers in order, of one shape."""
    fields = np.broadcast_arrays(*numbers)
    return tuple(Band(*fields[k : k + 4]) for k in range(0, len(fields), 4))


def _ends(bands: tuple[Band, ...]) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest wavenumber of bands that hold height."""
    low = [np.where(band.C > 0, band.q_low, np.inf) for band in bands]
    high = [np.where(band.C > 0, band.q_high, 0.0) for band in bands]
    return np.min(low, axis=0), np.max(high, axis=0)


def _derived(*numbers: Any) -> tuple[FloatArray, ...]:
    """`DERIVED` of bands, from their numbers in order."""
    bands = _bands_of(numbers)
    q0, q1 = _ends(bands)
    with np.errstate(over="ignore", invalid="ignore"):
        return q0, q1, *(moment(order, bands, q0, q1) for order in SHARES)


def _longest(*numbers: Any) -> tuple[FloatArray]:
    """Wavenumber from which on a band as wide as that of the largest islands holds most height."""
    bands = _bands_of(numbers)
    q0, q1 = _ends(bands)
    ends = [end for band in bands for end in band[:2]]
    places = [*ends, *(end / WIDEST for end in ends)]
    places += [q0 * (q1 / q0) ** (k / SCAN) for k in range(SCAN)]
    q = np.clip(np.stack(places), q0, q1 / (1 + 1e-9))
    held = moment(0, bands, q, np.minimum(WIDEST * q, q1))
    best = held.argmax(axis=0)[None]
    return (np.asarray(np.take_along_axis(q, best, axis=0)[0]),)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class BandedSurface(AnySurface):
    """A surface whose spectrum is a sum of power laws, or a batch of them, of Gaussian heights.

    `Surface.from_roughness` with arrays and a roll-off makes one, and `combined` of surfaces
    that differ in their wavelengths or Hurst exponents. `sampled` has one as samples q, C.

    Parameters
    ----------
    bands : sequence of Band
        Power laws, each with q_low, q_high [1/length], C at q_low [length^4] as h_rms^2 =
        2 pi integral C q dq, and the power of q: numbers, arrays or DataArrays, which
        broadcast. Bands may overlap, and add, or leave gaps. Where C is 0, a surface has
        not this band.
    h_max, nominal_area : array_like, one of them
        As for `Surface`.
    unit, provenance : as for `Surface`

    Raises
    ------
    InputError, OutOfRangeError
        For numbers that are no spectrum, and bands in all with less than a factor 3 of
        wavenumbers, or more than 1e8.

    Examples
    --------
    >>> from mbma_tables import Surface
    >>> ground = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=[0.3, 0.4], h_max=2.0, unit="um")
    >>> milled = Surface(hurst=0.7, q0=0.05, q1=[3.0, 5.0], h_rms=1.2, h_max=5.0, unit="um")
    >>> both = ground.combined(milled)
    >>> both
    BandedSurface(2 bands, shape (2,), h_rms=1.237 to 1.265 um, h_max=5.385 um)
    >>> both.q1
    array([3., 5.])
    """

    bands: Any
    h_max: Any = None
    _: dataclasses.KW_ONLY
    unit: str | None = None
    provenance: tuple[Mapping[str, Any], ...] = ()
    nominal_area: dataclasses.InitVar[Any] = None

    hurst = None
    anisotropy = None

    def __post_init__(self, nominal_area: Any) -> None:
        vars(self).update(unit=Units(self.unit).length)
        bands = tuple(Band(*band) for band in self.bands)
        if not 0 < len(bands) <= MOST_BANDS:
            raise InputError(f"a spectrum has 1 to {MOST_BANDS} bands, got {len(bands)}")
        vars(self).update(bands=bands)
        if nominal_area is not None:
            like = dataclasses.replace(self, h_max=1.0, nominal_area=None)
            h_max, provenance = of_area(like, nominal_area, self.h_max)
            vars(self).update(h_max=h_max, provenance=provenance)
        elif self.h_max is None:
            raise InputError(
                "h_max is missing: the highest point above the mid-plane, or give the nominal_area"
            )
        if self.labelled:
            refuse_plain(self.numbers())
            return
        self._check()

    def _check(self) -> None:
        """Numbers of one shape, each in its range."""
        numbers = {
            name: finite_array(name, number) for name, number in self.numbers().items()
        }
        for name, number in numbers.items():
            if name.startswith("C_"):
                require(name, number, number >= 0, "zero or positive")
            elif not name.startswith("power_"):
                positive_array(name, number)
        shape = broadcast_shape(**numbers)
        fields = [
            frozen(np.array(spread(number, shape)))[()] for number in numbers.values()
        ]
        bands = tuple(Band(*fields[k : k + 4]) for k in range(1, len(fields), 4))
        for k, band in enumerate(bands):
            low = np.asarray(band.q_low)
            require(f"q_low_{k}", low, band.q_high > low, "below the band's q_high")
        vars(self).update(h_max=fields[0], bands=bands)
        zeta_1 = np.asarray(self.zeta_1)
        in_range = (zeta_1 > MIN_ZETA_1) & (zeta_1 <= MAX_ZETA_1)
        require("largest q over smallest", zeta_1, in_range, "above 3 and at most 1e8")
        m4 = np.asarray(self.m4)
        require(
            "m4", m4, np.isfinite(m4) & (m4 > 0), "finite: take another unit of length"
        )

    def __repr__(self) -> str:
        if self.labelled:
            return f"BandedSurface({len(self.bands)} bands, of DataArrays)"
        unit = self.unit or ""
        sizes = f"h_rms={shown(self.h_rms, unit)}, h_max={shown(self.h_max, unit)}"
        return f"BandedSurface({len(self.bands)} bands, shape {self.shape}, {sizes})"

    def numbers(self) -> dict[str, Any]:
        """h_max and the numbers of each band, by name."""
        found = {"h_max": self.h_max}
        for k, band in enumerate(self.bands):
            found |= {f"{name}_{k}": number for name, number in band._asdict().items()}
        return found

    def with_numbers(self, *numbers: Any) -> Self:
        """The same kind of batch with other numbers, in their order; records that doubt it are kept."""
        bands = tuple(Band(*numbers[k : k + 4]) for k in range(1, len(numbers), 4))
        records = tuple({"step": "doubt", "not_valid": doubt} for doubt in self.doubts)
        return type(self)(bands, numbers[0], unit=self.unit, provenance=records)

    @functools.cached_property
    def labelled(self) -> bool:
        """Whether any number is an xarray DataArray."""
        return any(map(is_labelled, self.numbers().values()))

    @functools.cached_property
    def shape(self) -> tuple[int, ...]:
        """Shape of the batch; () for one surface."""
        return np.shape(self.h_max)

    def _of_bands(self, function: Any, outputs: int) -> tuple[Any, ...]:
        """What follows from the bands, lazy where they are."""
        numbers = tuple(number for band in self.bands for number in band)
        if any(map(is_labelled, numbers)):
            labelled: tuple[Any, ...] = apply(function, numbers, outputs)
            return labelled
        return tuple(frozen(each)[()] for each in function(*numbers))

    @functools.cached_property
    def _moments(self) -> dict[str, Any]:
        """`DERIVED` by name."""
        found = self._of_bands(_derived, len(DERIVED))
        return dict(zip(DERIVED, found, strict=True))

    @property
    def q0(self) -> Any:
        """Smallest wavenumber [1/length]."""
        return self._moments["q0"]

    @property
    def q1(self) -> Any:
        """Largest wavenumber [1/length]."""
        return self._moments["q1"]

    @functools.cached_property
    def h_rms(self) -> Any:
        """Root-mean-square height [length]."""
        return np.sqrt(self._moments["m0"])

    @property
    def m2(self) -> Any:
        """Variance of a profile's slope, Eq. (7)."""
        return self._moments["m2"]

    @property
    def m4(self) -> Any:
        """Variance of a profile's second derivative [1/length^2], Eq. (7)."""
        return self._moments["m4"]

    @functools.cached_property
    def power_laws(self) -> tuple[Any, Any, Any]:
        """Hurst exponent and zeta_1 where all bands are one, as for faces alike, and whether they are."""
        first = self.bands[0]
        same = np.ones(self.shape, bool)
        for band in self.bands[1:]:
            for one, other in zip(first, band, strict=True):
                if one is not first.C:
                    same = same & np.isclose(one, other, rtol=SAME, atol=0.0)
        hurst = np.broadcast_to(-1 - np.asarray(first.power) / 2, self.shape)
        is_one = same & (hurst > 0) & (hurst <= 1)
        usable = np.where(is_one, hurst, 0.5)
        return usable, np.asarray(first.q_high / first.q_low), is_one

    @functools.cached_property
    def longest(self) -> Any:
        """Wavenumber from which a band holds most height, as of `MeasuredSurface` [1/length]."""
        return self._of_bands(_longest, 1)[0]

    def power_spectrum(self, q: ArrayLike) -> Any:
        """C(q) [length^4], zero outside the bands; a batch broadcasts against q."""
        wavenumber = positive_array("q", q)
        total: Any = 0.0
        for band in self.bands:
            inside = (wavenumber >= band.q_low) & (wavenumber <= band.q_high)
            C = band.C * (wavenumber / band.q_low) ** band.power
            total = total + np.where(inside, C, 0.0)
        return total[()]

    def sampled(self) -> Any:
        """The same surface, a `MeasuredSurface` of samples of its spectrum; not for a batch."""
        if self.labelled or self.shape != ():
            raise InputError("a batch has no single spectrum: take one surface at a time")
        return self.entry(())

    def fit(self, band: tuple[float, float] | None = None) -> Any:
        """The self-affine surface nearest to it, as `MeasuredSurface.fit`; not for a batch."""
        return self.sampled().fit(band)

    def entry(self, index: tuple[int, ...]) -> Any:
        """One surface of the batch, a `MeasuredSurface` of samples of its spectrum."""
        parts = []
        for band in self.bands:
            low, high, C, power = (float(np.asarray(each)[index]) for each in band)
            if C > 0:
                ends = [C, C * (high / low) ** power]
                parts.append(SpectralSurface([low, high], ends, h_max=high))
        both = functools.reduce(SpectralSurface.added, parts)
        same = dataclasses.replace(
            both,
            h_max=float(np.asarray(self.h_max)[index]),
            heights=None,
            unit=self.unit,
            provenance=self.provenance,
        )
        return self.spectral.of(same)

    def scaled(self, factor: float, unit: str | None) -> Self:
        """The same surfaces in another length unit; `factor` is the old unit in the new one."""
        bands = tuple(
            Band(b.q_low / factor, b.q_high / factor, b.C * factor**4, b.power)
            for b in self.bands
        )
        return dataclasses.replace(
            self, bands=bands, h_max=self.h_max * factor, unit=unit
        )

    def bands_if_few(self) -> tuple[Band, ...]:
        """The bands."""
        bands: tuple[Band, ...] = self.bands
        return bands


AnySurface.banded = BandedSurface
