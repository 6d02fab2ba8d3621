"""The self-affine surface fitted to a power spectrum.

With or without a roll-off before the power law and a departure after it.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray, finite_array, require
from mbma_tables.common.errors import InputError, NotSelfAffineError
from mbma_tables.surfaces.spectrum import MIN_ZETA_1

MIN_POINTS = 6  # two define the line, four test it
MIN_PIECE = 3  # bins in a roll-off or in what follows a cut; fewer would fit noise
# scatter of ln C of real surfaces about a power law, besides counting statistics
SCATTER = 0.1
# bias of H on small windowed maps: fitted values up to this far above 1 are set to 1
HURST_TOLERANCE = 0.05
# deviation of log10 C, a factor 1.6: larger ones make the fit meaningless at single
# wavelengths
MAX_RESIDUAL = 0.2
MAX_HURST_ERROR = 0.1  # the model's results at H and H +- 0.1 differ by tens of percent
MAX_ANISOTROPY = 1.36  # twice the mean squared gradient one way than across it
# a flat roll-off leaves 1/(1 + H) > 0.5, form or waviness leaves less
MIN_VARIANCE_SHARE = 0.1


@dataclasses.dataclass(frozen=True)
class SpectrumFit:
    """Quality of the fit of a self-affine band to a measured spectrum.

    In the measurement's unit of length.

    Examples
    --------
    >>> import numpy as np
    >>> from mbma_tables import Surface
    >>> q = np.geomspace(1, 100, 40)
    >>> C = 1e-3 * q**-3.4
    >>> fit = Surface.from_spectrum(q, C, h_max=0.3, unit="um", model="self-affine").fit
    >>> f"H = {fit.hurst:.2f} +- {fit.hurst_error:.2f} of {fit.points} points"
    'H = 0.70 +- 0.00 of 40 points'
    >>> fit.roll_off, fit.cut_off
    (None, None)
    """

    # fitted: where it lies above 1 within its uncertainty, the surface has 1
    hurst: float
    hurst_error: float  # its standard error
    q0: float  # the surface's band
    q1: float
    q_low: float  # least and largest wavenumber of the points that the line was fitted to
    q_high: float
    points: int  # number of these spectral points (logarithmic bins)
    # rms deviation of log10 C from the law, bins weighted by what they average
    residual: float
    # wavenumber below which the spectrum is flat; None if it is not
    roll_off: float | None
    cut_off: float | None  # wavenumber above which it departs from the law, likewise
    variance_share: float  # of the measured variance of height, inside [q0, q1]


@dataclasses.dataclass(frozen=True)
class Bins:
    """Spectral points: wavenumber, spectrum, and the weight 1/variance of its logarithm."""

    q: FloatArray
    log_c: FloatArray
    weight: FloatArray

    def __getitem__(self, chosen: slice | NDArray[np.bool_]) -> Bins:
        return Bins(self.q[chosen], self.log_c[chosen], self.weight[chosen])


@dataclasses.dataclass(frozen=True)
class PowerLaw:
    """ln C = log_k - slope ln(q/unit) over bins[start:stop].

    After a roll-off of that level if it is flat.
    """

    start: int
    stop: int
    log_k: float
    slope: float
    slope_error: float
    level: float | None
    criterion: float


def log_bins(q: FloatArray, C: FloatArray, counts: FloatArray) -> Bins:
    """Averages of C over logarithmic bins of the wavenumber, weighted by independent samples."""
    # 20 bins a decade, 12% wide: accuracy of a break's position; bins of a dense spectrum
    # still average many entries. Half a bin ahead, so that the first wavenumbers of a grid
    # do not lie on an edge
    place = np.floor(20 * np.log10(q / q.min()) + 0.5).astype(int)
    total = np.bincount(place, counts)
    filled = total > 0
    total = total[filled]
    log_q = np.bincount(place, counts * np.log(q))[filled] / total
    bin_of = np.cumsum(filled)[place] - 1
    relative = q / np.exp(log_q)[bin_of]
    # C q^3.5 is nearly flat for every H, so that averages do not depend on where in its
    # bin a wavenumber lies
    flattened = counts * C * relative**3.5
    mean = np.bincount(place, flattened)[filled] / total
    # a gap in the spectrum: as a logarithm, far off any law
    log_c = np.log(np.maximum(mean, np.finfo(float).tiny))
    return Bins(np.exp(log_q), log_c, 1 / (1 / total + SCATTER**2))


def _straight(
    x: FloatArray, bins: Bins, start: int, stop: int
) -> tuple[float, float, float, float]:
    """Weighted line through bins[start:stop]: intercept, slope, chi^2, and spread of x."""
    weight = bins.weight[start:stop]
    x = x[start:stop]
    y = bins.log_c[start:stop]
    x_mean = np.average(x, weights=weight)
    y_mean = np.average(y, weights=weight)
    spread = float(weight @ (x - x_mean) ** 2)
    slope = float(weight @ ((x - x_mean) * (y - y_mean))) / spread
    intercept = float(y_mean - slope * x_mean)
    chi2 = float(weight @ (y - intercept - slope * x) ** 2)
    return intercept, slope, chi2, spread


def _roll_off(x: FloatArray, bins: Bins, stop: int) -> tuple[float, int, float | None]:
    """What precedes a power law in bins[:stop], nothing, a flat or a rising line.

    Its chi^2, its number of parameters with the break, and its level of ln C if it is flat.
    """
    if stop == 0:
        return 0.0, 0, None
    weight = bins.weight[:stop]
    y = bins.log_c[:stop]
    level = float(np.average(y, weights=weight))
    flat = float(weight @ (y - level) ** 2)
    _, slope, chi2, _ = _straight(x, bins, 0, stop)
    # the slope is worth its parameter
    if slope > 0 and chi2 + math.log(len(x)) < flat:
        return chi2, 3, None
    return flat, 2, level


def find_law(bins: Bins, unit: float, breaks: bool) -> PowerLaw:
    """The best of: a power law, with or without a roll-off before it and a departure after it."""
    laws = _possible_laws(bins, unit, breaks)
    best = min(laws, key=_criterion)
    # a roll-off and its law can also be described as a law and its departure: only one of
    # them is self-affine
    likely = []
    for law in laws:
        is_wide = bins.q[law.stop - 1] > MIN_ZETA_1 * bins.q[law.start]
        if is_wide and 0 < law.slope / 2 - 1 <= 1 + HURST_TOLERANCE:
            likely.append(law)
    chosen = min(likely, key=_criterion, default=best)
    # differences of Bayesian information above 6 count as strong evidence
    return chosen if chosen.criterion <= best.criterion + 6.0 else best


def _criterion(law: PowerLaw) -> float:
    """Bayesian information, the less the better."""
    return law.criterion


def _possible_laws(bins: Bins, unit: float, breaks: bool) -> list[PowerLaw]:
    """Every power law through enough bins, with what is before and after it."""
    x = np.log(bins.q / unit)
    count = len(bins.q)
    starts = [0]
    stops = [count]
    if breaks:
        starts += range(MIN_PIECE, count - MIN_POINTS + 1)
        stops += range(MIN_POINTS, count - MIN_PIECE + 1)
    departures = {count: 0.0}
    for stop in stops[1:]:
        _, _, departures[stop], _ = _straight(x, bins, stop, count)
    laws = []
    for start in starts:
        roll_off = _roll_off(x, bins, start)
        for stop in stops:
            if stop - start < MIN_POINTS:
                continue
            law = _law(x, bins, start, stop, roll_off, departures[stop])
            laws.append(law)
    return laws


def _law(
    x: FloatArray,
    bins: Bins,
    start: int,
    stop: int,
    roll_off: tuple[float, int, float | None],
    departure: float,
) -> PowerLaw:
    """The power law through bins[start:stop], `departure` being chi^2 of the bins after it."""
    log_k, slope, misfit_of_law, spread = _straight(x, bins, start, stop)
    misfit_before, parameters_before, level = roll_off
    count = len(bins.q)
    after = count - stop
    # each piece by its own scatter, or a tail that no line fits would hide the misfit of
    # the law; the scatter expected anyway, 1, is not fitted
    pieces = (
        (misfit_before, start),
        (misfit_of_law, stop - start),
        (departure, after),
    )
    terms = [size * math.log(1 + misfit / size) for misfit, size in pieces if size]
    information = sum(terms)
    parameters = 2 + parameters_before + (3 if after else 0)
    information += parameters * math.log(count)
    error = math.sqrt(misfit_of_law / (stop - start - 2) / spread)
    return PowerLaw(start, stop, log_k, -slope, error, level, information)


def _band_of(
    bins: Bins, law: PowerLaw, unit: float, ends: tuple[float, float]
) -> tuple[float, float]:
    """The band that the law holds in, within `ends`."""
    q = bins.q
    q0, q1 = ends
    if law.start:
        before = q[law.start - 1]
        first = q[law.start]
        q0 = math.sqrt(before * first)
        if law.level is not None:
            crossing = unit * math.exp((law.log_k - law.level) / law.slope)
            q0 = crossing if before <= crossing <= first else q0
    if law.stop < len(q):
        q1 = math.sqrt(q[law.stop - 1] * q[law.stop])
    return q0, q1


def _checked(band: Any, low: float, high: float) -> tuple[float, float]:
    """A forced band as two numbers inside [low, high], the range that the measurement holds."""
    pair = finite_array("band", band)
    if pair.shape != (2,) or not pair[0] < pair[1]:
        raise InputError(
            "band must be two wavenumbers (q_low, q_high) with q_low < q_high, "
            f"got {band!r}"
        )
    good = (pair >= low * (1 - 1e-9)) & (pair <= high * (1 + 1e-9))
    require("band", pair, good, f"within the measured range [{low:.6g}, {high:.6g}]")
    return float(pair[0]), float(pair[1])


def fit_spectrum(
    q: FloatArray,
    C: FloatArray,
    counts: FloatArray,
    variances: FloatArray,
    low: float,
    band: Any,
    anisotropy: float | None,
) -> dict[str, Any]:
    """Numbers of the `Surface` whose band fits C of the paper's convention, with their `fit`.

    `counts` and `variances` are independent samples and variance of height of each entry;
    wavenumbers below `low` are not fitted.
    """
    unit = float(q.min())
    last = float(q.max())
    band = None if band is None else _checked(band, unit, last)
    least, most = band or (low, last)
    every = log_bins(q, C, counts)
    bins = every[(every.q >= least * (1 - 1e-9)) & (every.q <= most * (1 + 1e-9))]
    _check_bins(bins, least, most)
    law = find_law(bins, unit, breaks=band is None)
    used = bins[law.start : law.stop]
    hurst = law.slope / 2 - 1
    error = law.slope_error / 2
    if not 0 < hurst <= 1 + max(HURST_TOLERANCE, 2 * error):
        raise NotSelfAffineError(_steepness(used, law, hurst, error))
    exponent = min(hurst, 1.0)
    log_k = law.log_k
    if hurst > 1:
        log_levels = used.log_c + 4 * np.log(used.q / unit)
        log_k = float(np.average(log_levels, weights=used.weight))

    def beyond(points: Bins) -> FloatArray:
        """Ln of C over the law."""
        fall = (2 + 2 * exponent) * np.log(points.q / unit)
        return np.asarray(points.log_c - log_k + fall)

    # without roll-off the band extends to the map's size, though its longest wavelengths
    # are not fitted
    q0, q1 = band or _band_of(bins, law, unit, (unit, last))
    in_band = (q >= q0) & (q <= q1)
    mean_square = np.average(beyond(used) ** 2, weights=used.weight)
    fit = SpectrumFit(
        hurst=hurst,
        hurst_error=error,
        q0=q0,
        q1=q1,
        q_low=float(used.q[0]),
        q_high=float(used.q[-1]),
        points=law.stop - law.start,
        residual=math.sqrt(mean_square) / math.log(10),
        roll_off=q0 if law.start else None,
        cut_off=q1 if law.stop < len(bins.q) else None,
        variance_share=float(variances[in_band].sum() / variances.sum()),
    )
    below = every[every.q <= fit.q_high]
    over = f"the power law between {fit.q_low:.4g} and {fit.q_high:.4g}"
    # ten times the law in a single bin is random with a probability below 1e-4
    _refuse_peak(below.q, beyond(below), 10.0, over)
    _refuse_poor(fit, anisotropy or 1.0, forced=band is not None)
    # h_rms^2 is the integral of (6) between q0 and q1
    lost = -math.expm1(-2 * exponent * math.log(q1 / q0))
    content = lost * (q0 / unit) ** (-2 * exponent)
    h_rms = unit * math.sqrt(math.pi * math.exp(log_k) * content / exponent)
    return {"hurst": exponent, "q0": q0, "q1": q1, "h_rms": h_rms, "fit": fit}


def _check_bins(bins: Bins, least: float, most: float) -> None:
    """Raise an error for too few bins, and for one that stands out of its neighbours."""
    if len(bins.q) < MIN_POINTS:
        raise NotSelfAffineError(
            f"only {len(bins.q)} spectral points between q = {least:.6g} and {most:.6g}; "
            f"a power law needs at least {MIN_POINTS}"
        )
    before = bins.log_c[: -2 * MIN_PIECE]
    after = bins.log_c[2 * MIN_PIECE :]
    middle = bins[MIN_PIECE:-MIN_PIECE]
    rise = middle.log_c - np.maximum(before, after)
    # a hundred times both neighbourhoods is random in single samples with a probability of
    # 2e-4
    _refuse_peak(middle.q, rise, 100.0, "what it is on either side")


def _steepness(used: Bins, law: PowerLaw, hurst: float, error: float) -> str:
    """The message for an exponent that no self-affine surface has."""
    reason = "not above 0 (white noise has -1)"
    if hurst > 0:
        reason = "above 1 (a smooth surface)"
    return (
        f"between q = {used.q[0]:.4g} and {used.q[-1]:.4g} the spectrum goes like "
        f"q^{-law.slope:.3g}: a Hurst exponent of {hurst:.3g} +- {error:.2g}, {reason}"
    )


def _refuse_peak(q: FloatArray, excess: FloatArray, limit: float, over: str) -> None:
    """Raise an error for a wavelength whose ln C exceeds something by more than a factor."""
    if excess.size and excess.max() > math.log(limit):
        worst = int(np.argmax(excess))
        raise NotSelfAffineError(
            f"a wavelength stands out: at q = {q[worst]:.4g} the spectrum is "
            f"{math.exp(excess[worst]):.3g} times {over}, more than {limit:g}"
        )


def _refuse_poor(fit: SpectrumFit, anisotropy: float, *, forced: bool) -> None:
    """Raise an error for the first reason why the fit does not describe the surface."""
    band = f"between q = {fit.q_low:.4g} and {fit.q_high:.4g}"
    if not fit.q1 > MIN_ZETA_1 * fit.q0:
        raise NotSelfAffineError(
            f"the band q0 = {fit.q0:.6g}, q1 = {fit.q1:.6g} is too narrow: q1/q0 = "
            f"{fit.q1 / fit.q0:.4g}, and the model needs more than {MIN_ZETA_1:g}"
        )
    if fit.residual > MAX_RESIDUAL:
        raise NotSelfAffineError(
            f"no power law: log10 C scatters by {fit.residual:.3g} about the best one "
            f"{band}, more than {MAX_RESIDUAL}"
        )
    if fit.hurst_error > MAX_HURST_ERROR:
        raise NotSelfAffineError(
            f"the Hurst exponent {fit.hurst:.3g} +- {fit.hurst_error:.2g} is not "
            f"determined to {MAX_HURST_ERROR} by {fit.points} points {band}"
        )
    if not forced and fit.variance_share < MIN_VARIANCE_SHARE:
        raise NotSelfAffineError(
            f"the self-affine band holds {fit.variance_share:.2%} of the variance of "
            f"height, less than {MIN_VARIANCE_SHARE:.0%}: the rest is form or waviness; "
            "remove it, or choose the band yourself"
        )
    if anisotropy > MAX_ANISOTROPY:
        raise NotSelfAffineError(
            f"the map is not isotropic: its anisotropy is {anisotropy:.3g}, more than "
            f"{MAX_ANISOTROPY} (rms gradient along over across)"
        )
