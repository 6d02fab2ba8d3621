"""The public surfaces, given by five numbers or a spectrum, and the conversions between them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import (
    FloatArray,
    finite_array,
    hinted,
    require_flag,
    require_name,
)
from mbma_tables.common.errors import InputError
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.heights import Heights
from mbma_tables.surfaces.roughness import ASSUMED, GAUSSIAN
from mbma_tables.surfaces.self_affine import SelfAffine
from mbma_tables.surfaces.spectral import SpectralSurface
from mbma_tables.surfaces.treatment import OPTIONS

UNNAMED = (
    "the convention of the spectrum is not named: give Surface.from_spectrum(..., "
    "convention='paper') if h_rms^2 is 2 pi integral C q dq, or convention='isotropic' "
    "if it is integral C q dq/(2 pi), as of most programs"
)
TRACES = (
    "the spectrum is of traces: isotropy is assumed and the sampling error is not known; "
    "Surface.from_profile([trace, ...], across=[...]) takes the traces"
)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Surface(SelfAffine):
    """A self-affine surface with the spectrum C(q) ~ q^(-2-2H) between q0 and q1 (Eq. 6).

    Lengths are in one unit. Every argument may be an array; they broadcast to a batch of
    surfaces. Where one is an xarray DataArray, dask-backed or not, `contact` returns
    DataArrays and checks the arguments then.

    Parameters
    ----------
    hurst : array_like
        Hurst exponent, in (0, 1].
    q0, q1 : array_like
        Smallest and largest wavenumber, 1/length, with 3 < q1/q0 <= 1e8.
    h_rms : array_like
        Root-mean-square height, length.
    h_max, nominal_area : array_like, one of them
        Highest point above the mid-plane, length; or A0, length^2: h_max is its median over
        Gaussian surfaces of A0.
    unit : str, optional
        Unit of length, such as "um", of the numbers and the results; None if it is not known.
    fit : SpectrumFit, optional
        Quality of the fit, in the measurement's unit, if the surface was fitted to a measurement.
    provenance : sequence of mapping, optional
        Origin and assumptions; a plain record for each step.

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
    """

    @classmethod
    @hinted
    def from_spectrum(
        cls,
        q: ArrayLike,
        C: ArrayLike,
        *,
        h_max: float | None = None,
        nominal_area: float | str | None = None,
        heights: ArrayLike | None = None,
        convention: str | None = None,
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
            Spectrum [length^4], not negative, interpolated by power laws. Masked entries
            are left out.
        h_max, nominal_area, unit : as for `Surface`
            The highest point is that of `heights` if none is given.
        heights : array_like, optional
            Heights measured anywhere on the surface [length], of any shape; their mean is
            subtracted. Default: a Gaussian distribution that ends at h_max.
        convention : {"paper", "isotropic", "C1D", "C1D+"}, optional
            h_rms^2 = 2 pi integral C q dq (Eqs. 4-6), or = integral C q dq / (2 pi). If it
            is not named, that of the paper is taken, and results are not `valid`. Spectra
            of traces [length^3] are "C1D", h_rms^2 = integral C dq / pi, or "C1D+",
            h_rms^2 = integral C dq / (2 pi); they are positive, of at least six
            wavenumbers, and results are not `valid`: `from_profile` takes the traces.
        model : {"measured", "self-affine"}, optional
            The spectrum itself, or the five numbers of its `MeasuredSurface.fit(band)`.
        band : tuple of float, optional
            (q0, q1) of that fit.

        Returns
        -------
        MeasuredSurface or Surface

        Raises
        ------
        InputError, OutOfRangeError, NotSelfAffineError
            For input that is no spectrum; as `MeasuredSurface.fit`.

        Examples
        --------
        >>> import numpy as np
        >>> from mbma_tables import Surface
        >>> q = np.geomspace(1, 100, 40)
        >>> surface = Surface.from_spectrum(q, 1e-3 * q**-3.4, h_max=0.3, convention="paper")
        >>> print(f"h_rms = {surface.h_rms:.4f}, rms gradient {surface.rms_gradient:.3f}")
        h_rms = 0.0669, rms gradient 0.394
        >>> print(f"alpha = {surface.alpha:.1f}")
        alpha = 106.5
        """
        from mbma_tables.surfaces.conventions import CONVENTIONS, OVER_C1D

        if convention is not None:
            require_name("convention", convention, CONVENTIONS)
        if np.ma.is_masked(C) and np.shape(q) == np.shape(C):
            shown = ~np.ma.getmaskarray(np.ma.asanyarray(C))
            q = np.asarray(q)[shown]
            C = np.asarray(C)[shown]
        distribution = None if heights is None else Heights.of(heights)
        q, C_of_paper = _of_paper(q, C, convention)
        records: tuple[Mapping[str, Any], ...] = ()
        if convention is None:
            records = ({"step": "convention", "not_valid": UNNAMED},)
        elif convention in OVER_C1D:
            records = ({"step": "convention", "not_valid": TRACES},)
        surface = MeasuredSurface(
            q,
            C_of_paper,
            h_max,
            distribution,
            unit=unit,
            provenance=records,
            nominal_area=nominal_area,
        )
        return _modelled(surface, model, band)

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
        s_filter: Any = None,
        l_filter: Any = None,
        confirmed: str | Sequence[str] | None = None,
        unit: str | None = None,
        channel: int | None = None,
    ) -> Surface | MeasuredSurface:
        """The surface of a measured map: its spectrum and heights, or a self-affine fit.

        Parameters
        ----------
        heights : array_like, shape (nx, ny), path or topography
            Heights [length], at least 32 x 32, NaN or masked where undefined; a file of any
            format that SurfaceTopography reads (the extra `maps`); or an object with that
            library's `heights()`, `physical_sizes` and `is_periodic`.
        dx, dy : float, optional
            Sampling steps along the first and the second axis [length]; dy is dx if not
            given. Topographies and most files contain them.
        periodic : bool, optional
            Whether the map continues periodically; else a Hann window is applied. A
            topography's own flag, False for an array.
        detrend : str, optional
            What to subtract: mean, plane, quadratic, or another mode of SurfaceTopography's
            `detrend`; by default the mean of a periodic map, the plane of any other.
        h_max : float, optional
            Height of the highest point above the mid-plane [length]; by default the map's,
            after detrending.
        model, band : as for `from_spectrum`
        extrapolate_to, extrapolate_hurst : float, optional
            Continue the measured spectrum to this wavelength [length] by a power law of
            this Hurst exponent; its influence is recorded.
        outliers, fill, short_cutoff, long_cutoff, s_filter, l_filter, confirmed : optional
            As in `mbma_tables.surfaces.treatment.Treatment`; the treatment is recorded in
            `provenance`.
        unit : str, optional
            Unit of the result and of plain lengths; lengths of a file are converted to it,
            or taken to be in it if the file names none. dx may have its own, such as "195
            nm", which is then that of heights if `unit` is missing.
        channel : int, optional
            Index of the map in a file with several maps.

        Returns
        -------
        Surface or MeasuredSurface
            In a topography's unit.

        Raises
        ------
        InputError, OutOfRangeError, NotSelfAffineError
            For holes, a missing or negative step, an unknown trend, nothing but a plane; as
            `MeasuredSurface.fit`.

        Examples
        --------
        >>> import numpy as np
        >>> from mbma_tables import Surface
        >>> noise = np.fft.rfft2(np.random.default_rng(1).standard_normal((128, 128)))
        >>> q = np.hypot(np.fft.fftfreq(128)[:, None], np.fft.rfftfreq(128))
        >>> q[0, 0] = np.inf
        >>> heights = np.fft.irfft2(noise / abs(noise) * q**-1.8)
        >>> surface = Surface.from_map(heights, dx=1 / 128, periodic=True, model="self-affine")
        >>> print(f"H = {surface.hurst:.2f}, q0 = {surface.q0:.3f}")
        H = 0.80, q0 = 6.283
        >>> surface.fit.points  # of the spectrum
        32
        """
        treatment = {name: value for name, value in locals().items() if name in OPTIONS}
        from mbma_tables.surfaces.maps import measured_surface, prepared

        if model != "measured" and (
            extrapolate_to is not None or extrapolate_hurst is not None
        ):
            raise InputError(
                "extrapolate_to and extrapolate_hurst belong to model='measured'"
            )
        measured = measured_surface(
            prepared(heights, treatment), h_max, extrapolate_to, extrapolate_hurst
        )
        return _modelled(MeasuredSurface.of(measured), model, band)

    @staticmethod
    def from_profile(
        heights: Any,
        dx: Any = None,
        *,
        across: Any = None,
        isotropic: bool = False,
        h_max: float | None = None,
        nominal_area: float | str | None = None,
        extrapolate_to: Any = None,
        extrapolate_hurst: float | None = None,
        **treatment: Any,
    ) -> MeasuredSurface:
        """The isotropic surface from measured line scans, for example by a stylus.

        Parameters
        ----------
        heights : array_like, shape (n,), path or line scan, or a list of these
            Heights [length], at least 32; a file that SurfaceTopography reads as a line
            scan, of two columns for instance; or such a line scan. Of several parallel
            traces each counts by its length.
        dx : float, optional
            Sampling step [length], of arrays.
        across : as heights, optional
            Traces at right angles to the others, of the same sampling step.
        isotropic : bool, optional
            Whether the surface is known to have no lay. Of traces in one direction, results
            are not `valid` without it; it is stated among the assumptions.
        extrapolate_to, extrapolate_hurst, **treatment : as for `from_map`
        h_max, nominal_area : as for `Surface`
            By default h_max is that of the lines, which is lower than that of a surface.

        Returns
        -------
        MeasuredSurface
            Its `provenance` has the accuracy of h_rms and gradient. Its `scans` are
            surfaces that differ from it by the sampling error of spectrum, height and
            gradient; what laws of them differ by adds to the scatter of contacts.

        Raises
        ------
        InputError, OutOfRangeError
            For input that is no line scan, holds too few wavelengths, or is flat, for
            traces of which only some have a unit, and for isotropic beside across.

        Examples
        --------
        >>> import numpy as np
        >>> from mbma_tables import Surface
        >>> noise = np.fft.rfft(np.random.default_rng(1).standard_normal(4000))
        >>> line = np.fft.irfft(noise * np.minimum(1, (np.arange(2001) / 40.0 + 1e-9) ** -1.3))
        >>> surface = Surface.from_profile(line, dx=0.5, unit="um", periodic=True)
        >>> [record["told"] for record in surface.provenance if record["step"] == "errors"]
        ['h_rms is known to 5.2% and the rms gradient to 1.4% (one standard error, of a Gaussian surface)']
        """
        from mbma_tables.surfaces.maps import measured_traces

        require_flag("isotropic", isotropic)
        options = treatment | {"dx": dx}
        measured = measured_traces(
            heights, across, options, isotropic, extrapolate_to, extrapolate_hurst
        )

        def with_top(surface: MeasuredSurface) -> MeasuredSurface:
            scans = tuple(map(with_top, surface.scans))
            if nominal_area is not None:
                changed: dict[str, Any] = {"h_max": h_max, "nominal_area": nominal_area}
            else:
                changed = {"h_max": surface.h_max if h_max is None else h_max}
            return dataclasses.replace(surface, **changed, scans=scans)

        return with_top(MeasuredSurface.of(measured))

    def sampled(self) -> MeasuredSurface:
        """The same surface by its spectrum, of which two samples suffice; not for a batch."""
        if self.labelled or self.shape != ():
            raise InputError("a batch has no single spectrum: take one surface at a time")
        ends = np.array([self.q0, self.q1])
        return MeasuredSurface(
            ends,
            self.power_spectrum(ends),
            self.h_max,
            unit=self.unit,
            provenance=self.provenance,
        )


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class MeasuredSurface(SpectralSurface):
    """A surface given by its isotropic spectrum; its parameters are those of `SpectralSurface`."""

    @classmethod
    def of(cls, spectral: SpectralSurface) -> MeasuredSurface:
        """The same spectrum, with the fit of five numbers."""
        fields = {
            field.name: getattr(spectral, field.name)
            for field in dataclasses.fields(spectral)
        }
        return cls(**{**fields, "scans": tuple(map(cls.of, spectral.scans))})

    def fit(self, band: tuple[float, float] | None = None) -> Surface:
        """The self-affine surface nearest to it: five numbers, and the quality of the fit.

        Parameters
        ----------
        band : tuple of float, optional
            (q0, q1) to fit and to take as a plain power law; else a roll-off below and a
            departure above are found and left out. Without a roll-off q0 is the lowest
            wavenumber, though of a map under a window the line is fitted from twice that
            on; without a departure q1 is the largest.

        Returns
        -------
        Surface
            With `fit`, a `SpectrumFit`. Its h_rms is that of the fitted law between q0 and q1.

        Raises
        ------
        NotSelfAffineError
            Where no power law with 0 < H <= 1 describes it, and for maps of edges or with a
            lay; the message has the numbers.

        Examples
        --------
        >>> import numpy as np
        >>> from mbma_tables import Surface
        >>> q = np.geomspace(0.2, 50, 60)
        >>> face = Surface.from_spectrum(q, np.maximum(q, 1) ** -3.6, h_max=9.0)
        >>> print(f"H = {face.fit().hurst:.2f} from q = {face.fit().q0:.2f}")
        H = 0.80 from q = 1.00
        """
        from mbma_tables.surfaces.maps import points_of_fit
        from mbma_tables.surfaces.psd import fit_spectrum

        numbers = fit_spectrum(
            **points_of_fit(self), band=band, anisotropy=self.anisotropy
        )
        return Surface(
            **numbers, h_max=self.h_max, unit=self.unit, provenance=self.provenance
        )


def _of_paper(q: Any, C: Any, convention: str | None) -> tuple[Any, FloatArray]:
    """q and C by the paper's convention [length^4]."""
    from mbma_tables.surfaces.conventions import OVER_PAPER, converted

    values = finite_array("C", C)
    if convention is None or convention in OVER_PAPER:
        return q, values / OVER_PAPER[convention or "paper"]
    wavenumber = finite_array("q", q)
    if wavenumber.ndim != 1 or wavenumber.shape != values.shape:
        raise InputError(
            "q and C must be two columns of one length, got shapes "
            f"{wavenumber.shape} and {values.shape}"
        )
    order = np.argsort(wavenumber, kind="stable")
    rising = wavenumber[order]
    return rising, converted(rising, values[order], convention, "paper")


def assumptions(surface: Any) -> list[str]:
    """What a surface and the faces that it combines assume, each line once."""
    lines = dict.fromkeys(_assumed(surface.provenance))
    known = _is_known_gaussian(surface.provenance)
    if isinstance(surface, Surface) and not known and ASSUMED not in lines:
        return [ASSUMED, *lines]
    return list(lines)


def is_assumed_gaussian(surface: Any) -> bool:
    """Whether nothing is known of a face but numbers, which the Gaussian and isotropic ones share with others."""
    return ASSUMED in assumptions(surface)


def _is_known_gaussian(provenance: Iterable[Mapping[str, Any]]) -> bool:
    """Whether the records of a face, or of each face that was combined, name the process "gaussian"."""
    return any(
        record.get("process") == GAUSSIAN
        or ("of" in record and all(map(_is_known_gaussian, record["of"])))
        for record in provenance
    )


def _assumed(provenance: Iterable[Mapping[str, Any]]) -> Iterator[str]:
    """The assumptions of records, and of the records of combined faces in them."""
    for record in provenance:
        yield from record.get("assumed", ())
        for face in record.get("of", ()):
            yield from _assumed(face)


def _modelled(
    surface: MeasuredSurface, model: str, band: Any
) -> Surface | MeasuredSurface:
    """A measured surface, or the five numbers fitted to it."""
    if model not in ("measured", "self-affine"):
        raise InputError(f"model must be 'measured' or 'self-affine', got {model!r}")
    if model == "self-affine":
        return surface.fit(band)
    if band is not None:
        raise InputError(
            "band belongs to model='self-affine': a measured surface is not fitted"
        )
    return surface


AnySurface.spectral = MeasuredSurface
Surface.__init__ = hinted(Surface.__init__)  # type: ignore[method-assign]
