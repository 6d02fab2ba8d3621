"""The self-affine surface fitted to a power spectrum, and the quality of the fit."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import beta

from mbma_tables.common.arguments import FloatArray, finite_array, require
from mbma_tables.common.errors import InputError, NotSelfAffineError
from mbma_tables.surfaces.heights import one_height
from mbma_tables.surfaces.measurements import MAX_LENGTH, MIN_LENGTH
from mbma_tables.surfaces.power_law import (
    HURST_TOLERANCE,
    MIN_PIECE,
    MIN_POINTS,
    Bins,
    PowerLaw,
    band_of,
    find_law,
    log_bins,
    with_end_of_profile,
)
from mbma_tables.surfaces.power_laws import two_columns
from mbma_tables.surfaces.spectral import SpectralSurface
from mbma_tables.surfaces.spectrum import MIN_ZETA_1

CONVENTIONS = ("paper", "isotropic", "profile")
MAX_RESIDUAL = 0.2  # of log10 C, a factor 1.6: larger ones make the fit meaningless at single wavelengths
MAX_HURST_ERROR = 0.1  # the model's results at H and H +- 0.1 differ by tens of percent
MAX_EXCESS = 10.0  # C over the law in a single bin; random with a probability below 1e-4
MAX_PEAK = 100.0  # C over both its neighbourhoods; random in single samples with a probability of 2e-4
MIN_VARIANCE_SHARE = 0.1  # of the variance; a flat roll-off leaves 1/(1 + H) > 0.5, form or waviness leaves less


@dataclasses.dataclass(frozen=True)
class SpectrumFit:
    """Quality of the fit of a self-affine band to a measured spectrum, in the measurement's unit of length.

    Examples
    --------
    >>> import numpy as np
    >>> from mbma_tables import Surface
    >>> q = np.geomspace(1, 100, 40)
    >>> Surface.from_spectrum(q, 1e-3 * q**-3.4, h_max=0.3, unit="um", model="self-affine").fit
    SpectrumFit(hurst=0.7, hurst_error=..., hurst_held=False, q0=1, q1=100, q_low=1, q_high=100, points=40,
    residual=..., roll_off=None, cut_off=None, variance_share=1, convention='paper', windowed=False, detrend=None, ...)
    """

    hurst: float  # fitted,
    hurst_error: float  # and its standard error
    hurst_held: bool  # whether `hurst` lies above 1 within its uncertainty and the surface therefore has 1
    q0: float  # the surface's band
    q1: float
    q_low: float  # least and largest wavenumber of the points that the line was fitted to
    q_high: float
    points: int  # number of these spectral points (logarithmic bins)
    residual: float  # rms deviation of log10 C from the law, bins weighted by what they average
    roll_off: float | None  # wavenumber below which the spectrum is flat; None if it is not
    cut_off: float | None  # wavenumber above which it departs from the law, likewise
    variance_share: float  # of the measured variance of height, inside [q0, q1]
    convention: str  # of the spectrum given; 'paper' for a map
    windowed: bool = False
    detrend: str | None = None  # what was subtracted from the map; None for a spectrum
    anisotropy: float | None = None  # 0: all directions carry the same power, 1: one carries all; None for a spectrum
    length_unit: str | None = None  # the map's, where it named one

    def __repr__(self) -> str:
        def shown(value: Any) -> str:
            return f"{value:.4g}" if isinstance(value, float) else repr(value)

        fields = (f"{field.name}={shown(getattr(self, field.name))}" for field in dataclasses.fields(self))
        return f"SpectrumFit({', '.join(fields)})"


def check_band(band: Any, low: float, high: float) -> tuple[float, float] | None:
    """A forced band as two numbers inside [low, high], the range that the measurement holds."""
    if band is None:
        return None
    pair = finite_array("band", band)
    if pair.shape != (2,) or not pair[0] < pair[1]:
        raise InputError(f"band must be two wavenumbers (q_low, q_high) with q_low < q_high, got {band!r}")
    good = (pair >= low * (1 - 1e-9)) & (pair <= high * (1 + 1e-9))
    require("band", pair, good, f"within the measured range [{low:.6g}, {high:.6g}]")
    return float(pair[0]), float(pair[1])


def fit_psd(q: ArrayLike, C: ArrayLike, h_max: Any, convention: str, band: Any) -> dict[str, Any]:
    """Arguments of the `Surface` fitted to a measured spectrum; see `Surface.from_spectrum`.

    Notes
    -----
    C_1D of Eq. (6) is 2 pi B(H + 1/2, 1/2) q C(q), exactly so where q1 is infinite; towards q1 it drops (by 7%
    at q1/2, to zero at q1). Where that drop describes the spectrum better than a plain power law it is fitted
    too; the surface's q1 is where it ends if that is within 1.25 of the largest wavenumber, which else is q1.
    Oblique wavelengths appear longer in a profile: its roll-off is determined within a factor of 1.5 only.
    """
    if h_max is None:
        raise InputError("h_max is missing: the highest point above the mid-plane, or heights= of the surface")
    if convention not in CONVENTIONS:
        raise InputError(f"convention must be one of {', '.join(CONVENTIONS)}, got {convention!r}")
    height = one_height(h_max)
    wavenumber, spectrum = _positive_spectrum(q, C)
    if convention == "isotropic":
        spectrum = spectrum / (4 * math.pi**2)
    # (4)-(6): h_rms^2 = 2 pi integral C q dq; of a profile, integral C dq / pi
    density = spectrum / math.pi if convention == "profile" else 2 * math.pi * spectrum * wavenumber
    variances = density * _steps(wavenumber) / 2
    ends = float(wavenumber[0]), float(wavenumber[-1])
    return fit_spectrum(
        wavenumber,
        spectrum,
        np.ones(len(wavenumber)),
        variances,
        h_max=height,
        usable=ends,
        band=check_band(band, *ends),
        power=float(variances.sum()),
        convention=convention,
    )


def _steps(q: FloatArray) -> FloatArray:
    """Twice the width of wavenumbers that each sample stands for."""
    return np.asarray(np.diff(q, prepend=q[0]) + np.diff(q, append=q[-1]))


def fit_samples(surface: SpectralSurface, band: Any) -> dict[str, Any]:
    """Arguments of the `Surface` fitted to a surface's own spectrum; see `MeasuredSurface.fit`."""
    q, C, ends = surface.q, surface.C, (float(surface.q0), float(surface.q1))
    positive = C > 0
    return fit_spectrum(
        q[positive],
        C[positive],
        (np.ones(q.size) if surface.samples is None else surface.samples)[positive],
        (math.pi * C * q * _steps(q))[positive],
        h_max=float(surface.h_max),
        usable=ends,
        band=check_band(band, *ends),
        power=float(surface.m0),
        convention="paper",
    )


def _positive_spectrum(q: ArrayLike, C: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Wavenumbers in rising order and positive C, without masked entries and without zeros at either end."""
    if np.ma.isMaskedArray(q) or np.ma.isMaskedArray(C):
        if np.shape(q) != np.shape(C):
            raise InputError(f"q and C must be of one length, got shapes {np.shape(q)} and {np.shape(C)}")
        shown = ~(np.ma.getmaskarray(np.ma.asanyarray(q)) | np.ma.getmaskarray(np.ma.asanyarray(C)))
        q, C = np.asarray(q)[shown], np.asarray(C)[shown]
    wavenumber, spectrum = two_columns(q, C)
    require("q", wavenumber, wavenumber > 0, "positive (leave q = 0 out)")
    require("q", wavenumber, (wavenumber >= MIN_LENGTH) & (wavenumber <= MAX_LENGTH), "in [1e-30, 1e30]")
    require("C", spectrum, spectrum >= 0, "zero or positive")
    order = np.argsort(wavenumber, kind="stable")
    wavenumber, spectrum = wavenumber[order], spectrum[order]
    positive = np.flatnonzero(spectrum > 0)
    if positive.size == 0:
        raise NotSelfAffineError("C is zero everywhere: the surface is flat")
    inside = slice(positive[0], positive[-1] + 1)
    wavenumber, spectrum = wavenumber[inside], spectrum[inside]
    require("C", spectrum, spectrum > 0, "positive between its first and last positive entries")
    require("C", spectrum, (spectrum >= 1e-200) & (spectrum <= 1e200), "in [1e-200, 1e200], its unit well chosen")
    return wavenumber, spectrum


def fit_spectrum(
    q: FloatArray,
    C: FloatArray,
    counts: FloatArray,
    variances: FloatArray,
    *,
    h_max: float,
    usable: tuple[float, float],
    band: tuple[float, float] | None,
    power: float,
    convention: str,
    **known: Any,
) -> dict[str, Any]:
    """Arguments of the `Surface` whose band fits C, in the paper's convention or a profile's.

    `counts` and `variances` are independent samples and variance of height of each entry; `power` is the sum of all
    variances, `usable` the range to be trusted, `known` further fields of `SpectrumFit`.
    """
    profile = convention == "profile"
    unit = float(q.min())
    every, bins = _binned(q, C, counts, band or usable)
    _refuse_peak(bins)
    law, hurst, error = _law_of(bins, unit, profile, breaks=band is None)
    used = bins[law.start : law.stop]
    residual = math.sqrt(np.average((used.log_c - law.log_at(used.q, unit)) ** 2, weights=used.weight))
    # without roll-off the band extends to the map's size, though the longest wavelengths are too few to be fitted
    q0, q1 = band or band_of(bins, law, unit, (unit, float(q.max())))
    fit = SpectrumFit(
        hurst=hurst,
        hurst_error=error,
        hurst_held=hurst > 1,
        q0=q0,
        q1=q1,
        q_low=float(used.q[0]),
        q_high=float(used.q[-1]),
        points=law.stop - law.start,
        residual=residual / math.log(10),
        roll_off=q0 if law.start else None,
        cut_off=q1 if law.stop < len(bins.q) else None,
        variance_share=float(variances[(q >= q0) & (q <= q1)].sum() / power),
        convention=convention,
        **known,
    )
    below = every.q <= fit.q_high
    _refuse_poor(fit, every, below, every.log_c - law.log_at(every.q, unit), forced=band is not None)
    exponent = min(hurst, 1.0)
    # C_1D is 2 pi B(H + 1/2, 1/2) q C(q), and h_rms^2 the integral of (6) between q0 and q1
    scale = math.exp(law.log_k) / (2 * math.pi * beta(exponent + 0.5, 0.5) * unit if profile else 1.0)
    z0, z1 = q0 / unit, q1 / unit
    growth = -math.expm1(-2 * exponent * math.log(z1 / z0)) * z0 ** (-2 * exponent)
    h_rms = unit * math.sqrt(math.pi * scale * growth / exponent)
    return {"hurst": exponent, "q0": q0, "q1": q1, "h_rms": h_rms, "h_max": h_max, "fit": fit}


def _law_of(bins: Bins, unit: float, profile: bool, breaks: bool) -> tuple[PowerLaw, float, float]:
    """The law with 0 < H <= 1 that fits best, and the fitted H, which may lie above 1 by its error, with that error."""
    offset = 1.0 if profile else 2.0
    law = find_law(bins, unit, offset, breaks)
    if profile and breaks:
        law = with_end_of_profile(bins, unit, law)
    hurst, error = (law.slope - offset) / 2, law.slope_error / 2
    used = bins[law.start : law.stop]
    if not 0 < hurst <= 1 + max(HURST_TOLERANCE, 2 * error):
        raise NotSelfAffineError(
            f"between q = {used.q[0]:.4g} and {used.q[-1]:.4g} the spectrum goes like "
            f"q^{-law.slope:.3g}: a Hurst exponent of {hurst:.3g} +- {error:.2g}, "
            + ("above 1 (a smooth surface)" if hurst > 0 else "not above 0 (white noise has -1)")
        )
    if hurst > 1:
        law = dataclasses.replace(law, slope=2.0 + offset, log_k=0.0)
        shift = used.log_c - law.log_at(used.q, unit)
        law = dataclasses.replace(law, log_k=float(np.average(shift, weights=used.weight)))
    return law, hurst, error


def _binned(q: FloatArray, C: FloatArray, counts: FloatArray, usable: tuple[float, float]) -> tuple[Bins, Bins]:
    """Every logarithmic bin, and those between the usable wavenumbers."""
    low, high = usable
    every = log_bins(q, C, counts)
    bins = every[(every.q >= low * (1 - 1e-9)) & (every.q <= high * (1 + 1e-9))]
    if len(bins.q) < MIN_POINTS:
        raise NotSelfAffineError(
            f"only {len(bins.q)} spectral points between q = {low:.6g} and {high:.6g}; "
            f"a power law needs at least {MIN_POINTS}"
        )
    return every, bins


def _refuse_peak(bins: Bins) -> None:
    """Raise an error for a wavelength so strong that a break would be fitted beside it."""
    y, side = bins.log_c, MIN_PIECE
    rise = y[side:-side] - np.maximum(y[: -2 * side], y[2 * side :])
    if rise.size and rise.max() > math.log(MAX_PEAK):
        worst = int(np.argmax(rise))
        raise NotSelfAffineError(
            f"a wavelength stands out: at q = {bins.q[side + worst]:.4g} the spectrum is {math.exp(rise[worst]):.3g} "
            f"times what it is on either side, more than {MAX_PEAK:g}"
        )


def _refuse_poor(fit: SpectrumFit, every: Bins, below: NDArray[np.bool_], excess: FloatArray, *, forced: bool) -> None:
    band = f"between q = {fit.q_low:.4g} and {fit.q_high:.4g}"
    if not fit.q1 > MIN_ZETA_1 * fit.q0:
        raise NotSelfAffineError(
            f"the band q0 = {fit.q0:.6g}, q1 = {fit.q1:.6g} is too narrow: q1/q0 = {fit.q1 / fit.q0:.4g}, "
            "and the model needs more than 3"
        )
    if fit.residual > MAX_RESIDUAL:
        raise NotSelfAffineError(
            f"no power law: log10 C scatters by {fit.residual:.3g} about the best one {band}, more than {MAX_RESIDUAL}"
        )
    if fit.hurst_error > MAX_HURST_ERROR:
        raise NotSelfAffineError(
            f"the Hurst exponent {fit.hurst:.3g} +- {fit.hurst_error:.2g} is not determined to "
            f"{MAX_HURST_ERROR} by {fit.points} points {band}"
        )
    strong = below & (excess > math.log(MAX_EXCESS))
    if strong.any():
        worst = int(np.argmax(np.where(strong, excess, -np.inf)))
        raise NotSelfAffineError(
            f"a wavelength stands out: at q = {every.q[worst]:.4g} the spectrum is {math.exp(excess[worst]):.3g} "
            f"times the power law {band}, more than {MAX_EXCESS:g}"
        )
    if not forced and fit.variance_share < MIN_VARIANCE_SHARE:
        raise NotSelfAffineError(
            f"the self-affine band holds {fit.variance_share:.2%} of the variance of height, less than "
            f"{MIN_VARIANCE_SHARE:.0%}: the rest is form or waviness; remove it, or choose the band yourself"
        )
