"""A self-affine rough surface, or a batch of them: five numbers and what follows from them."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.arguments import finite_array, require
from mbma_tables.errors import InputError
from mbma_tables.surfaces import spectrum

if TYPE_CHECKING:
    from mbma_tables.surfaces.maps import SpectrumFit

PARAMETERS = ("hurst", "q0", "q1", "h_rms", "h_max")
LEAST_ZETA_1 = 3.0  # the floors 1.5 and 3 of (27) and (30) need room below zeta_1
LARGEST_ZETA_1 = 1e8


@dataclasses.dataclass(frozen=True, eq=False)
class Surface:
    """A self-affine surface with the spectrum C(q) ~ q^(-2-2H) between q0 and q1 (Eq. 6).

    Any consistent length unit. Every argument may be an array; they broadcast to a batch of surfaces. Where one is
    an xarray DataArray, dask-backed or not, `contact` answers with DataArrays, and arguments are checked then.

    Parameters
    ----------
    hurst : array_like
        Hurst exponent, in (0, 1].
    q0, q1 : array_like
        Smallest and largest wavenumber, 1/length, with 3 < q1/q0 <= 1e8.
    h_rms : array_like
        Root-mean-square height, length.
    h_max : array_like
        Height of the highest point above the mid-plane, length; contact starts there.
    fit : SpectrumFit, optional
        Where the surface was fitted to a measurement: how well.

    Raises
    ------
    InputError, OutOfRangeError
        For NaN, infinite or empty input, and for numbers outside these ranges.
    """

    hurst: Any
    q0: Any
    q1: Any
    h_rms: Any
    h_max: Any
    fit: SpectrumFit | None = dataclasses.field(default=None, repr=False, kw_only=True)

    def __post_init__(self) -> None:
        if self.labelled:
            # perhaps lazy: checked block by block, where numbers are computed
            return
        given = {name: finite_array(name, getattr(self, name)) for name in PARAMETERS}
        require("hurst", given["hurst"], (given["hurst"] > 0) & (given["hurst"] <= 1), "in (0, 1]")
        for name in ("q0", "q1", "h_rms", "h_max"):
            require(name, given[name], given[name] > 0, "positive")
        try:
            arrays = np.broadcast_arrays(*given.values())
        except ValueError:
            shapes = ", ".join(f"{name} {array.shape}" for name, array in given.items())
            raise InputError(f"the surface's arguments do not broadcast: {shapes}") from None
        for name, array in zip(given, arrays, strict=True):
            own = np.array(array)
            own.setflags(write=False)
            object.__setattr__(self, name, own[()])
        zeta_1 = np.asarray(self.zeta_1)
        require("q1/q0", zeta_1, zeta_1 > LEAST_ZETA_1, "greater than 3 (the model's floors need room)")
        require("q1/q0", zeta_1, zeta_1 <= LARGEST_ZETA_1, "at most 1e8")

    @classmethod
    def from_moments(
        cls, *, hurst: ArrayLike, m0: ArrayLike, m2: ArrayLike, m4: ArrayLike, h_max: ArrayLike
    ) -> Surface:
        """The surface with these spectral moments (Eqs. 1, 7).

        Parameters
        ----------
        hurst : array_like
            Hurst exponent, in (0, 1].
        m0, m2, m4 : array_like
            Variance of height [length^2], of a profile's slope, of its second derivative [1/length^2].
        h_max : array_like
            Height of the highest point above the mid-plane [length].

        Returns
        -------
        Surface
            zeta_1 from alpha = m0 m4/m2^2, which rises with it, then q0 from m2/m0.
        """
        from mbma_tables.surfaces.moments import band_from_moments

        q0, q1, h_rms = band_from_moments(hurst, m0, m2, m4)
        return cls(hurst, q0, q1, h_rms, h_max)

    @classmethod
    def named(cls, name: str) -> Surface:
        """One of the paper's cases, see `mbma_tables.surfaces.cases.CASES`."""
        from mbma_tables.surfaces.cases import get_case

        return get_case(name).surface

    @classmethod
    def from_psd(
        cls,
        q: ArrayLike,
        C: ArrayLike,
        *,
        h_max: float,
        convention: str = "paper",
        band: tuple[float, float] | None = None,
    ) -> Surface:
        """The self-affine surface fitted to a measured spectrum; see `mbma_tables.surfaces.maps.surface_from_psd`."""
        from mbma_tables.surfaces.maps import surface_from_psd

        return surface_from_psd(q, C, h_max=h_max, convention=convention, band=band)

    @classmethod
    def from_map(cls, heights: Any, dx: float | None = None, dy: float | None = None, **options: Any) -> Surface:
        """The self-affine surface fitted to a measured map.

        `options` are `periodic`, `detrend`, `h_max` and `band` of `mbma_tables.surfaces.maps.surface_from_map`.
        """
        from mbma_tables.surfaces.maps import surface_from_map

        return surface_from_map(heights, dx, dy, **options)

    @property
    def labelled(self) -> bool:
        """Whether any parameter is an xarray DataArray."""
        return any(hasattr(getattr(self, name), "dims") for name in PARAMETERS)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the batch; () for one surface."""
        return np.shape(self.hurst)

    @property
    def zeta_1(self) -> Any:
        """Largest magnification q1/q0 (Eq. 13)."""
        return self.q1 / self.q0

    @property
    def s(self) -> Any:
        """Unit of height, h_rms/sqrt(1 - zeta_1^(-2H)) [length]."""
        return self.h_rms / np.sqrt(-np.expm1(-2 * self.hurst * np.log(self.zeta_1)))

    @property
    def m0(self) -> Any:
        """Variance of height [length^2], Eq. (8)."""
        return self.h_rms**2

    @property
    def m2(self) -> Any:
        """Variance of a profile's slope, Eq. (7)."""
        return (self.s * self.q0) ** 2 * spectrum.band_moment(2, self.hurst, 1.0, self.zeta_1)

    @property
    def m4(self) -> Any:
        """Variance of a profile's second derivative [1/length^2], Eq. (7)."""
        return (self.s * self.q0**2) ** 2 * spectrum.band_moment(4, self.hurst, 1.0, self.zeta_1)

    @property
    def alpha(self) -> Any:
        """Nayak's bandwidth parameter, Eq. (3)."""
        return self.m0 * self.m4 / self.m2**2

    @property
    def rms_gradient(self) -> Any:
        """Root-mean-square gradient of the surface, sqrt(2 m2)."""
        return np.sqrt(2 * self.m2)

    @property
    def summit_density(self) -> Any:
        """Nayak's density of summits [1/length^2], Eq. (2)."""
        return self.m4 / (spectrum.NAYAK * self.m2)

    @property
    def summit_radius(self) -> Any:
        """Mean radius of summits [length], Eq. (2)."""
        return spectrum.RADIUS / np.sqrt(self.m4)

    @property
    def summit_sigma(self) -> Any:
        """Standard deviation of summit heights [length], Eq. (2)."""
        return np.sqrt((1 - spectrum.BROADENING / self.alpha) * self.m0)

    def power_spectrum(self, q: ArrayLike) -> Any:
        """C(q) of Eq. (6) [length^4], zero outside [q0, q1]; for one surface or broadcasting against it."""
        wavenumber = finite_array("q", q)
        require("q", wavenumber, wavenumber > 0, "positive")
        scale = self.hurst / math.pi * (self.s / self.q0) ** 2
        inside = (wavenumber >= self.q0) & (wavenumber <= self.q1)
        return np.where(inside, scale * (wavenumber / self.q0) ** (-2 - 2 * self.hurst), 0.0)[()]
