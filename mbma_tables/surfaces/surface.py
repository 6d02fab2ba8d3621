"""A self-affine rough surface, or a batch of them: five numbers and what follows from them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.arguments import broadcast_shape, finite_array, hinted, is_labelled, require, spread
from mbma_tables.display import shown
from mbma_tables.errors import InputError
from mbma_tables.surfaces import spectrum
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.cases import get_case
from mbma_tables.units import Units

if TYPE_CHECKING:
    from mbma_tables.surfaces.measured import MeasuredSurface
    from mbma_tables.surfaces.psd import SpectrumFit

TREATMENT = (
    *("dx", "dy", "periodic", "unit", "channel"),
    *("detrend", "outliers", "fill", "short_cutoff", "long_cutoff", "tip_radius", "reliable", "window"),
)  # arguments of `from_map` and `from_profile` that are handed on
SHOWN = 6  # entries of a batch that are printed
PARAMETERS = ("hurst", "q0", "q1", "h_rms", "h_max")


@dataclasses.dataclass(frozen=True, eq=False)
class Surface(AnySurface):
    """A self-affine surface with the spectrum C(q) ~ q^(-2-2H) between q0 and q1 (Eq. 6).

    Lengths are in one unit. Every argument may be an array; they broadcast to a batch of surfaces. Where one is
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
    unit : str, optional
        The unit of length, such as "um"; None where it is not known. Results carry it.
    fit : SpectrumFit, optional
        Where the surface was fitted to a measurement: how well, in the measurement's unit.
    provenance : sequence of mapping, optional
        What it was made from, and what was assumed; a plain record each step.

    Raises
    ------
    InputError, OutOfRangeError
        For NaN, infinite, masked or empty input, and for numbers outside these ranges.
    TypeError
        For an unknown argument; the message names the nearest known one.

    Examples
    --------
    >>> from mbma_tables import Surface
    >>> surface = Surface(hurst=0.8, q0=0.5, q1=100.0, h_rms=0.2, h_max=0.6)
    >>> surface
    Surface(hurst=0.8, q0=0.5, q1=100.0, h_rms=0.2, h_max=0.6)
    >>> print(f"{surface.zeta_1:g}, rms gradient {surface.rms_gradient:.4f}")
    200, rms gradient 0.5414
    >>> Surface(hurst=[0.5, 0.8], q0=0.5, q1=100.0, h_rms=0.2, h_max=0.6).alpha.round(1)
    array([100.5, 387.8])
    """

    hurst: Any
    q0: Any
    q1: Any
    h_rms: Any
    h_max: Any
    parameters = PARAMETERS
    unit: str | None = dataclasses.field(default=None, kw_only=True)
    fit: SpectrumFit | None = dataclasses.field(default=None, repr=False, kw_only=True)
    provenance: tuple[Mapping[str, Any], ...] = dataclasses.field(default=(), repr=False, kw_only=True)

    def __post_init__(self) -> None:
        units = Units(self.unit)
        object.__setattr__(self, "unit", units.length)
        if self.labelled:
            for name in PARAMETERS:
                units.number(name, getattr(self, name))
            # perhaps lazy: checked block by block, where numbers are computed
            return
        given = {name: finite_array(name, getattr(self, name)) for name in PARAMETERS}
        require("hurst", given["hurst"], (given["hurst"] > 0) & (given["hurst"] <= 1), "in (0, 1]")
        for name in ("q0", "q1", "h_rms", "h_max"):
            require(name, given[name], given[name] > 0, "positive")
        shape = broadcast_shape(**given)
        for name, array in given.items():
            kept = np.array(spread(array, shape))
            kept.setflags(write=False)
            object.__setattr__(self, name, kept[()])
        zeta_1 = np.asarray(self.zeta_1)
        require("q1/q0", zeta_1, zeta_1 > spectrum.MIN_ZETA_1, "greater than 3: q1 is the largest wavenumber")
        require("q1/q0", zeta_1, zeta_1 <= spectrum.MAX_ZETA_1, "at most 1e8")

    def __repr__(self) -> str:
        numbers = [f"{name}={_shown(getattr(self, name))}" for name in PARAMETERS]
        return f"Surface({', '.join([*numbers, *([f'unit={self.unit!r}'] if self.unit else [])])})"

    def scaled(self, factor: float, unit: str | None) -> Surface:
        """The same surface in another length unit, of which the old one is `factor`."""
        waves, lengths = (self.q0 / factor, self.q1 / factor), (self.h_rms * factor, self.h_max * factor)
        return dataclasses.replace(self, q0=waves[0], q1=waves[1], h_rms=lengths[0], h_max=lengths[1], unit=unit)

    @classmethod
    @hinted
    def from_moments(
        cls,
        *,
        hurst: ArrayLike,
        m0: ArrayLike,
        m2: ArrayLike,
        m4: ArrayLike,
        h_max: ArrayLike,
        unit: str | None = None,
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
        unit : str, optional
            The unit of length.

        Returns
        -------
        Surface
            zeta_1 from alpha = m0 m4/m2^2, which rises with it, then q0 from m2/m0.

        Raises
        ------
        InputError, OutOfRangeError
            Where no band with 3 < zeta_1 <= 1e8 has that alpha, and as `Surface` itself.

        Examples
        --------
        >>> from mbma_tables import Surface
        >>> road = Surface.from_moments(hurst=0.7, m0=0.071, m2=0.27, m4=62.0, h_max=1.1)
        >>> print(f"zeta_1 = {road.zeta_1:.4f}, q0 = {road.q0:.6f}")
        zeta_1 = 64.8598, q0 = 0.538132
        """
        return cls(hurst, *spectrum.band_from_moments(hurst, m0, m2, m4), h_max, unit=unit)

    @classmethod
    @hinted
    def from_roughness(
        cls,
        *,
        hurst: Any,
        h_max: Any = None,
        Sp: Any = None,
        Rq: Any = None,
        Ra: Any = None,
        Sq: Any = None,
        Sa: Any = None,
        Rdq: Any = None,
        Sdq: Any = None,
        Rsm: Any = None,
        Sds: Any = None,
        Spd: Any = None,
        longest: Any = None,
        shortest: Any = None,
        unit: str | None = None,
    ) -> Surface:
        """The self-affine surface that numbers of a drawing or a profilometer describe.

        One height, one highest point, a Hurst exponent, and two of slope, longest wave and shortest wave (or slope and
        density of summits). What a drawing does not tell is to be given: nothing is filled in. `provenance` holds
        what each number was taken to mean; docs/surfaces.md has typical values. Lengths are numbers in one unit, or
        texts with theirs.

        Parameters
        ----------
        hurst : array_like
            Hurst exponent, in (0, 1].
        h_max, Sp : array_like, one of them
            Height of the highest point above the mid-plane [length].
        Rq, Ra, Sq, Sa : array_like, one of them
            Root-mean-square or mean absolute height of a profile or of a map [length].
        Rdq, Sdq, Rsm : array_like, one of them, optional
            Root-mean-square slope of a profile, gradient of a map, or mean spacing of a profile's elements [length].
        Sds, Spd : array_like, one of them, optional
            Summits per area [1/length^2].
        longest, shortest : array_like, optional
            Wavelengths at which the roughness ends [length].
        unit : str, optional
            The unit of length.

        Returns
        -------
        Surface

        Raises
        ------
        InputError, OutOfRangeError
            For too few or too many numbers, and for those that no band with 3 < q1/q0 <= 1e8 has.

        Examples
        --------
        >>> from mbma_tables import Surface
        >>> ground = Surface.from_roughness(Ra="0.4 um", Rdq=0.1, longest="100 um", hurst=0.8, h_max="1.8 um")
        >>> print(f"h_rms = {ground.h_rms:.3f} {ground.unit}, shortest wave {6.2832 / ground.q1:.2f} {ground.unit}")
        h_rms = 0.501 um, shortest wave 1.12 um
        >>> ground.provenance[0]["assumed"][2]
        'h_rms = sqrt(pi/2) Ra: heights are Gaussian; the profile is long and unfiltered'
        """
        given = {name: value for name, value in locals().items() if name not in ("cls", "unit")}
        from mbma_tables.surfaces.roughness import surface_of_roughness

        return cls(**surface_of_roughness(unit, given))

    @classmethod
    def named(cls, name: str) -> Surface:
        """One of the paper's cases, in the paper's unit of length where it has one.

        Raises
        ------
        InputError
            For an unknown name; the message lists those there are.

        Examples
        --------
        >>> from mbma_tables import Surface
        >>> challenge = Surface.named("challenge")
        >>> float(challenge.h_rms), challenge.unit
        (0.762, 'um')
        """
        case = get_case(name)
        make: Any = cls.from_moments if "m0" in case.numbers else cls
        surface: Surface = make(**case.numbers, unit=case.length_unit)
        return surface

    @classmethod
    @hinted
    def from_spectrum(
        cls,
        q: ArrayLike,
        C: ArrayLike,
        *,
        h_max: float | None = None,
        heights: ArrayLike | None = None,
        convention: str = "paper",
        unit: str | None = None,
        model: str = "measured",
        band: tuple[float, float] | None = None,
    ) -> Surface | MeasuredSurface:
        """The surface of an isotropic spectrum as it is, or the self-affine one fitted to it.

        Parameters
        ----------
        q : array_like, shape (n,)
            Wavenumber, 1/length, positive, in any order and spacing.
        C : array_like, shape (n,)
            Spectrum [length^4; a profile's length^3], not negative; a power law is taken between neighbours. A fit
            leaves out what a masked array hides.
        h_max : float, optional
            Height of the highest point above the mid-plane [length]; that of `heights` if not given.
        heights : array_like, optional
            Heights measured anywhere on the surface [length], of any shape; their mean is taken off. A Gaussian that
            ends at h_max if not given.
        convention : {"paper", "isotropic", "profile"}, optional
            h_rms^2 = 2 pi integral C q dq (Eqs. 4-6), = integral C q dq / (2 pi), or, for a fit alone,
            = integral C dq / pi.
        unit : str, optional
            The unit of length.
        model : {"measured", "self-affine"}, optional
            The spectrum itself, or five numbers fitted to it.
        band : tuple of float, optional
            (q0, q1) to fit and to take, as a plain power law; else a roll-off below and a departure above are found
            and left out.

        Returns
        -------
        MeasuredSurface or Surface
            Of the first, `fit()` is the self-affine surface nearest to it. The second has a `fit`, a `SpectrumFit`; its
            h_rms is that of the fitted law between q0 and q1.

        Raises
        ------
        InputError, OutOfRangeError
            For input that is no spectrum.
        NotSelfAffineError
            Where five numbers are asked for and no power law with 0 < H <= 1 describes it; the message has the numbers.

        Examples
        --------
        >>> import numpy as np
        >>> from mbma_tables import Surface
        >>> q = np.geomspace(1, 100, 40)
        >>> surface = Surface.from_spectrum(q, 1e-3 * q**-3.4, h_max=0.3)
        >>> print(f"h_rms = {surface.h_rms:.4f}, rms gradient {surface.rms_gradient:.3f}, alpha = {surface.alpha:.1f}")
        h_rms = 0.0669, rms gradient 0.394, alpha = 106.5
        """
        from mbma_tables.surfaces.heights import Heights
        from mbma_tables.surfaces.measured import MeasuredSurface
        from mbma_tables.surfaces.power_laws import two_columns

        _check_model(model, band)
        if model == "self-affine":
            from mbma_tables.surfaces.psd import fit_psd

            top = Heights.of(heights).h_max if h_max is None and heights is not None else h_max
            if top is None:
                raise InputError("h_max is missing: the highest point above the mid-plane, or heights= of the surface")
            return dataclasses.replace(fit_psd(q, C, top, convention, band), unit=unit)
        if convention not in ("paper", "isotropic"):
            raise InputError(
                f"convention must be 'paper' or 'isotropic', got {convention!r}: a profile's spectrum can be fitted, "
                "with model='self-affine'"
            )
        wavenumber, spectrum = two_columns(q, C)
        order = np.argsort(wavenumber, kind="stable")
        scale = 1.0 if convention == "paper" else 1 / (4 * math.pi**2)
        known = None if heights is None else Heights.of(heights)
        return MeasuredSurface(wavenumber[order], scale * spectrum[order], h_max, known, unit=unit)

    @classmethod
    @hinted
    def from_map(
        cls,
        heights: Any,
        dx: float | None = None,
        dy: float | None = None,
        *,
        periodic: bool | None = None,
        detrend: str | None = None,
        h_max: float | None = None,
        band: tuple[float, float] | None = None,
        model: str = "measured",
        extrapolate_to: Any = None,
        extrapolate_hurst: float | None = None,
        outliers: float | None = None,
        fill: str | None = None,
        short_cutoff: Any = None,
        long_cutoff: Any = None,
        tip_radius: Any = None,
        reliable: bool = True,
        window: str | None = None,
        unit: str | None = None,
        channel: int | None = None,
    ) -> Surface | MeasuredSurface:
        """The surface of a measured height map: its own spectrum and heights, or the self-affine one fitted to it.

        Parameters
        ----------
        heights : array_like, shape (nx, ny), path or topography
            Heights [length], at least 32 x 32, NaN or masked where undefined; a file of any format that
            SurfaceTopography reads (the extra `maps`); or an object with that library's `heights()`,
            `physical_sizes` and `is_periodic`.
        dx, dy : float, optional
            Sampling steps along the first and the second axis [length]; dy is dx if not given. A topography has its
            own, most files too.
        periodic : bool, optional
            Whether the map continues periodically; else a Hann window is applied. A topography's own flag, False for
            an array.
        detrend : str, optional
            What to subtract: mean, plane, quadratic, or another mode of SurfaceTopography's `detrend`; by default the
            mean of a periodic map, the plane of any other.
        h_max : float, optional
            Height of the highest point above the mid-plane [length]; by default the map's, after detrending.
        band : tuple of float, optional
            (q0, q1) to fit and to take; else a flat roll-off below and a departure above are found and left out.
        model : {"measured", "self-affine"}, optional
            The map's own spectrum, heights and curves, without a fit, or five numbers fitted to it.
        extrapolate_to, extrapolate_hurst : float, optional
            Continue the measured spectrum to this wavelength [length] by a power law of this Hurst exponent; what
            that changes is told.
        outliers, fill, short_cutoff, long_cutoff, tip_radius, reliable, window : optional
            As in `mbma_tables.surfaces.treatment.Treatment`; what was done is the surface's `provenance`.
        unit : str, optional
            Unit of the answer and of plain lengths, to which lengths of a file are converted, or which they have where
            it names none; dx may name its own, such as "195 nm", in which heights are too without a unit.
        channel : int, optional
            Of a file with several maps.

        Returns
        -------
        Surface or MeasuredSurface
            In a topography's unit. Five numbers come with `fit`, a `SpectrumFit`. h_rms is that of the fitted law
            between q0 and q1. Without a roll-off q0 is the map's own lowest wavenumber, though under a window the line
            is fitted from twice that on; without a cut q1 is the largest measured wavenumber, at most pi/max(dx, dy).

        Raises
        ------
        InputError, OutOfRangeError
            For input that is no map: holes, a missing or negative step, an unknown trend, nothing but a plane.
        NotSelfAffineError
            With model="self-affine", where the map is no such surface; the message has the reason and the numbers.

        Examples
        --------
        A periodic map of side 1 with random phases and H = 0.8:

        >>> import numpy as np
        >>> from mbma_tables import Surface
        >>> noise = np.fft.rfft2(np.random.default_rng(1).standard_normal((128, 128)))
        >>> q = np.hypot(np.fft.fftfreq(128)[:, None], np.fft.rfftfreq(128))
        >>> q[0, 0] = np.inf
        >>> heights = np.fft.irfft2(noise / abs(noise) * q**-1.8)
        >>> surface = Surface.from_map(heights, dx=1 / 128, periodic=True, model="self-affine")
        >>> print(f"H = {surface.hurst:.2f}, q0 = {surface.q0:.3f}, fitted at {surface.fit.points} points")
        H = 0.80, q0 = 6.283, fitted at 32 points
        """
        treatment = {name: value for name, value in locals().items() if name in TREATMENT}
        from mbma_tables.surfaces.maps import fit_map, prepared
        from mbma_tables.surfaces.measured import resolution
        from mbma_tables.surfaces.resolution import measured_surface

        _check_model(model, band)
        if model != "measured" and (extrapolate_to is not None or extrapolate_hurst is not None):
            raise InputError("extrapolate_to and extrapolate_hurst belong to model='measured'")
        treated = prepared(heights, treatment)
        if model == "measured":
            return measured_surface(treated, h_max, extrapolate_to, extrapolate_hurst)
        surface = fit_map(treated, h_max, band)
        return dataclasses.replace(surface, provenance=(*treated.provenance, resolution(surface.sampled())))

    @staticmethod
    @hinted
    def from_profile(
        heights: Any,
        dx: Any = None,
        *,
        periodic: bool | None = None,
        detrend: str | None = None,
        h_max: float | None = None,
        extrapolate_to: Any = None,
        extrapolate_hurst: float | None = None,
        outliers: float | None = None,
        fill: str | None = None,
        short_cutoff: Any = None,
        long_cutoff: Any = None,
        tip_radius: Any = None,
        reliable: bool = True,
        window: str | None = None,
        unit: str | None = None,
        channel: int | None = None,
    ) -> MeasuredSurface:
        """The isotropic surface of which a line was measured, by a stylus for instance.

        Parameters
        ----------
        heights : array_like, shape (n,), path or line scan
            Heights [length], at least 32; a file that SurfaceTopography reads as a line scan, of two columns for
            instance; or such a line scan.
        dx : float, optional
            Sampling step [length], of an array.
        periodic, detrend, extrapolate_to, extrapolate_hurst, outliers ... channel
            As for `from_map`; `tip_radius` is the stylus's.
        h_max : float, optional
            Height of the highest point above the mid-plane [length]; by default the line's, which lies below that of a
            surface.

        Returns
        -------
        MeasuredSurface
            Its `provenance` says how well h_rms and gradient are known, and what one trace cannot tell.

        Raises
        ------
        InputError, OutOfRangeError
            For input that is no line scan, holds too few waves, or is flat.

        Examples
        --------
        >>> import numpy as np
        >>> from mbma_tables import Surface
        >>> noise = np.fft.rfft(np.random.default_rng(1).standard_normal(4000))
        >>> line = np.fft.irfft(noise * np.minimum(1, (np.arange(2001) / 40.0 + 1e-9) ** -1.3))
        >>> surface = Surface.from_profile(line, dx=0.5, unit="um", periodic=True)
        >>> print(surface.provenance[-3]["told"])
        h_rms is known to 5.2% and the rms gradient to 1.4% (one standard error, of a Gaussian surface)
        """
        treatment = {name: value for name, value in locals().items() if name in TREATMENT}
        from mbma_tables.surfaces.maps import prepared
        from mbma_tables.surfaces.resolution import measured_surface

        return measured_surface(prepared(heights, treatment, 1), h_max, extrapolate_to, extrapolate_hurst)

    @property
    def labelled(self) -> bool:
        """Whether any parameter is an xarray DataArray."""
        return any(is_labelled(getattr(self, name)) for name in PARAMETERS)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the batch; () for one surface."""
        return np.shape(self.hurst)

    @property
    def s(self) -> Any:
        """Unit of height, h_rms/sqrt(1 - zeta_1^(-2H)) [length]."""
        return self.h_rms / np.sqrt(-np.expm1(-2 * self.hurst * np.log(self.zeta_1)))

    @property
    def m2(self) -> Any:
        """Variance of a profile's slope, Eq. (7)."""
        return (self.s * self.q0) ** 2 * spectrum.band_moment(2, self.hurst, 1.0, self.zeta_1)

    @property
    def m4(self) -> Any:
        """Variance of a profile's second derivative [1/length^2], Eq. (7)."""
        return (self.s * self.q0**2) ** 2 * spectrum.band_moment(4, self.hurst, 1.0, self.zeta_1)

    def with_numbers(self, *numbers: Any) -> Surface:
        """Another surface, in the same unit."""
        return Surface(*numbers, unit=self.unit)

    def sampled(self) -> MeasuredSurface:
        """The same surface by its spectrum, two samples of which hold all of it.

        Raises
        ------
        InputError
            For a batch.
        """
        from mbma_tables.surfaces.measured import MeasuredSurface

        if self.labelled or self.shape != ():
            raise InputError("a batch has no single spectrum: take one surface at a time")
        ends = np.array([self.q0, self.q1])
        return MeasuredSurface(ends, self.power_spectrum(ends), self.h_max, unit=self.unit, provenance=self.provenance)

    def power_spectrum(self, q: ArrayLike) -> Any:
        """C(q) of Eq. (6) [length^4], zero outside [q0, q1]; for one surface or broadcasting against it."""
        wavenumber = finite_array("q", q)
        require("q", wavenumber, wavenumber > 0, "positive")
        scale = self.hurst / math.pi * (self.s / self.q0) ** 2
        inside = (wavenumber >= self.q0) & (wavenumber <= self.q1)
        return np.where(inside, scale * (wavenumber / self.q0) ** (-2 - 2 * self.hurst), 0.0)[()]


def _check_model(model: str, band: Any) -> None:
    if model not in ("measured", "self-affine"):
        raise InputError(f"model must be 'measured' or 'self-affine', got {model!r}")
    if model == "measured" and band is not None:
        raise InputError("band belongs to model='self-affine': a measured surface is not fitted")


def _shown(value: Any) -> str:
    """A number as Python prints it, a DataArray by its sizes."""
    if is_labelled(value):
        return f"<DataArray {dict(value.sizes)}>"
    if np.size(value) > SHOWN:
        return f"<{'x'.join(map(str, np.shape(value)))} numbers, {shown(value)}>"
    return repr(np.asarray(value).item()) if np.ndim(value) == 0 else repr(value)


Surface.__init__ = hinted(Surface.__init__)  # type: ignore[method-assign]
