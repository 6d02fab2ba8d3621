"""The self-affine surface fitted to a power spectrum, with or without a roll-off before it and a departure after it."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray, finite_array, require
from mbma_tables.common.errors import InputError, NotSelfAffineError
from mbma_tables.surfaces.spectrum import MIN_ZETA_1

# 12% wide: accuracy of a break's position; bins of a dense spectrum still average many
# entries
BINS_PER_DECADE = 20
MIN_POINTS = 6  # two define the line, four test it
MIN_PIECE = 3  # bins in a roll-off or in what follows a cut; fewer would fit noise
SCATTER = (
    0.1  # scatter of ln C of real surfaces about a power law, besides counting statistics
)
# bias of H on small windowed maps: fitted values up to this far above 1 are set to 1
HURST_TOLERANCE = 0.05
MARGIN = 6.0  # differences of Bayesian information above this count as strong evidence
# C q^3.5 is nearly flat for every H, so that averages within a bin do not depend on its
# filling
TYPICAL_SLOPE = 3.5
# deviation of log10 C, a factor 1.6: larger ones make the fit meaningless at single
# wavelengths
MAX_RESIDUAL = 0.2
MAX_HURST_ERROR = 0.1  # the model's results at H and H +- 0.1 differ by tens of percent
MAX_EXCESS = 10.0  # C over the law in a single bin; random with a probability below 1e-4
# C over both its neighbourhoods; random in single samples with a probability of 2e-4
MAX_PEAK = 100.0
MAX_ANISOTROPY = 1.36  # twice the mean squared gradient one way than across it
MIN_VARIANCE_SHARE = (
    0.1  # a flat roll-off leaves 1/(1 + H) > 0.5, form or waviness leaves less
)


@dataclasses.dataclass(frozen=True)
class SpectrumFit:
    """Quality of the fit of a self-affine band to a measured spectrum, in the measurement's unit of length.

    Examples
    --------
    >>> import numpy as np
    >>> from mbma_tables import Surface
    >>> q = np.geomspace(1, 100, 40)
    >>> found = Surface.from_spectrum(q, 1e-3 * q**-3.4, h_max=0.3, unit="um", model="self-affine").fit
    >>> f"H = {found.hurst:.2f} +- {found.hurst_error:.2f} of {found.points} points, roll-off {found.roll_off}"
    'H = 0.70 +- 0.00 of 40 points, roll-off None'
    """

    hurst: (
        float  # fitted: where it lies above 1 within its uncertainty, the surface has 1
    )
    hurst_error: float  # its standard error
    q0: float  # the surface's band
    q1: float
    q_low: float  # least and largest wavenumber of the points that the line was fitted to
    q_high: float
    points: int  # number of these spectral points (logarithmic bins)
    residual: (
        float  # rms deviation of log10 C from the law, bins weighted by what they average
    )
    roll_off: (
        float | None
    )  # wavenumber below which the spectrum is flat; None if it is not
    cut_off: float | None  # wavenumber above which it departs from the law, likewise
    variance_share: float  # of the measured variance of height, inside [q0, q1]


@dataclasses.dataclass(frozen=True)
class Bins:
    """Spectral points: wavenumber, spectrum, and the weight 1/variance of its logarithm."""

    q: FloatArray
    log_c: FloatArray
    weight: FloatArray

    def __getitem__(self, chosen: Any) -> Bins:
        return Bins(self.q[chosen], self.log_c[chosen], self.weight[chosen])


@dataclasses.dataclass(frozen=True)
class PowerLaw:
    """ln C = log_k - slope ln(q/unit) over bins[start:stop], after a roll-off of that level if it is flat."""

    start: int
    stop: int
    log_k: float
    slope: float
    slope_error: float
    level: float | None
    criterion: float


def log_bins(q: FloatArray, C: FloatArray, counts: FloatArray) -> Bins:
    """Averages of C over logarithmic bins of the wavenumber, weighted by independent samples."""
    # half a bin ahead, so that the first wavenumbers of a grid do not lie on an edge
    place = np.floor(BINS_PER_DECADE * np.log10(q / q.min()) + 0.5).astype(int)
    total = np.bincount(place, counts)
    filled = total > 0
    total = total[filled]
    log_q = np.bincount(place, counts * np.log(q))[filled] / total
    relative = q / np.exp(log_q)[np.cumsum(filled)[place] - 1]
    mean = np.bincount(place, counts * C * relative**TYPICAL_SLOPE)[filled] / total
    floor = np.finfo(float).tiny  # a gap in the spectrum: as a logarithm, far off any law
    return Bins(
        np.exp(log_q), np.log(np.maximum(mean, floor)), 1 / (1 / total + SCATTER**2)
    )


def _straight(
    x: FloatArray, bins: Bins, start: int, stop: int
) -> tuple[float, float, float, float]:
    """Weighted line through bins[start:stop]: (intercept, slope, chi^2, weighted spread of x)."""
    w, x, y = bins.weight[start:stop], x[start:stop], bins.log_c[start:stop]
    x_mean, y_mean = np.average(x, weights=w), np.average(y, weights=w)
    spread = float(w @ (x - x_mean) ** 2)
    slope = float(w @ ((x - x_mean) * (y - y_mean))) / spread
    intercept = float(y_mean - slope * x_mean)
    return intercept, slope, float(w @ (y - intercept - slope * x) ** 2), spread


def _roll_off(x: FloatArray, bins: Bins, stop: int) -> tuple[float, int, float | None]:
    """A flat or else a rising line through bins[:stop]: (chi^2, parameters with the break, level if flat)."""
    if stop == 0:
        return 0.0, 0, None
    w, y = bins.weight[:stop], bins.log_c[:stop]
    level = float(np.average(y, weights=w))
    flat = float(w @ (y - level) ** 2)
    _, slope, rising, _ = _straight(x, bins, 0, stop)
    return (
        (rising, 3, None)
        if slope > 0 and rising + math.log(len(x)) < flat
        else (flat, 2, level)
    )


def find_law(bins: Bins, unit: float, breaks: bool) -> PowerLaw:
    """The best of: a power law, with or without a roll-off before it and a departure after it."""
    x, count = np.log(bins.q / unit), len(bins.q)
    starts, stops = [0], [count]
    if breaks:
        starts += range(MIN_PIECE, count - MIN_POINTS + 1)
        stops += range(MIN_POINTS, count - MIN_PIECE + 1)
    roll_offs = {start: _roll_off(x, bins, start) for start in starts}
    departures = {
        stop: _straight(x, bins, stop, count)[2] if stop < count else 0.0
        for stop in stops
    }
    laws = []
    for start, stop in ((i, j) for i in starts for j in stops if j - i >= MIN_POINTS):
        log_k, slope, chi2, spread = _straight(x, bins, start, stop)
        before, more, level = roll_offs[start]
        # each piece by its own scatter, or a tail that no line fits would hide the misfit
        # of the law; the scatter expected anyway, 1, is not fitted
        pieces = ((before, start), (chi2, stop - start), (departures[stop], count - stop))
        information = sum(
            size * math.log(1 + misfit / size) for misfit, size in pieces if size
        )
        information += (2 + more + 3 * (stop < count)) * math.log(count)
        error = math.sqrt(chi2 / (stop - start - 2) / spread)
        laws.append(PowerLaw(start, stop, log_k, -slope, error, level, information))
    best = min(laws, key=lambda law: law.criterion)
    # a roll-off and its law can also be described as a law and its departure: only one of
    # them is self-affine
    wide = [law for law in laws if bins.q[law.stop - 1] > MIN_ZETA_1 * bins.q[law.start]]
    likely = [law for law in wide if 0 < law.slope / 2 - 1 <= 1 + HURST_TOLERANCE]
    chosen = min(likely, key=lambda law: law.criterion, default=best)
    return chosen if chosen.criterion <= best.criterion + MARGIN else best


def _band_of(
    bins: Bins, law: PowerLaw, unit: float, ends: tuple[float, float]
) -> tuple[float, float]:
    """The band that the law holds in, within `ends`."""
    (q0, q1), q = ends, bins.q
    if law.start:
        q0 = math.sqrt(q[law.start - 1] * q[law.start])
        if law.level is not None:
            crossing = unit * math.exp((law.log_k - law.level) / law.slope)
            q0 = crossing if q[law.start - 1] <= crossing <= q[law.start] else q0
    return q0, q1 if law.stop == len(q) else math.sqrt(q[law.stop - 1] * q[law.stop])


def _checked(band: Any, low: float, high: float) -> tuple[float, float]:
    """A forced band as two numbers inside [low, high], the range that the measurement holds."""
    pair = finite_array("band", band)
    if pair.shape != (2,) or not pair[0] < pair[1]:
        raise InputError(
            f"band must be two wavenumbers (q_low, q_high) with q_low < q_high, got {band!r}"
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
    unit, last = float(q.min()), float(q.max())
    band = None if band is None else _checked(band, unit, last)
    least, most = band or (low, last)
    every = log_bins(q, C, counts)
    bins = every[(every.q >= least * (1 - 1e-9)) & (every.q <= most * (1 + 1e-9))]
    if len(bins.q) < MIN_POINTS:
        raise NotSelfAffineError(
            f"only {len(bins.q)} spectral points between q = {least:.6g} and {most:.6g}; "
            f"a power law needs at least {MIN_POINTS}"
        )
    rise = bins.log_c[MIN_PIECE:-MIN_PIECE] - np.maximum(
        bins.log_c[: -2 * MIN_PIECE], bins.log_c[2 * MIN_PIECE :]
    )
    _refuse_peak(
        bins.q[MIN_PIECE:-MIN_PIECE], rise, MAX_PEAK, "what it is on either side"
    )
    law = find_law(bins, unit, breaks=band is None)
    hurst, error, used = (
        law.slope / 2 - 1,
        law.slope_error / 2,
        bins[law.start : law.stop],
    )
    if not 0 < hurst <= 1 + max(HURST_TOLERANCE, 2 * error):
        raise NotSelfAffineError(
            f"between q = {used.q[0]:.4g} and {used.q[-1]:.4g} the spectrum goes like "
            f"q^{-law.slope:.3g}: a Hurst exponent of {hurst:.3g} +- {error:.2g}, "
            + (
                "above 1 (a smooth surface)"
                if hurst > 0
                else "not above 0 (white noise has -1)"
            )
        )
    exponent, log_k = min(hurst, 1.0), law.log_k
    if hurst > 1:
        log_k = float(
            np.average(used.log_c + 4 * np.log(used.q / unit), weights=used.weight)
        )

    def beyond(points: Bins) -> FloatArray:
        return np.asarray(
            points.log_c - log_k + (2 + 2 * exponent) * np.log(points.q / unit)
        )

    # without roll-off the band extends to the map's size, though its longest wavelengths
    # are not fitted
    q0, q1 = band or _band_of(bins, law, unit, (unit, last))
    fit = SpectrumFit(
        hurst=hurst,
        hurst_error=error,
        q0=q0,
        q1=q1,
        q_low=float(used.q[0]),
        q_high=float(used.q[-1]),
        points=law.stop - law.start,
        residual=math.sqrt(np.average(beyond(used) ** 2, weights=used.weight))
        / math.log(10),
        roll_off=q0 if law.start else None,
        cut_off=q1 if law.stop < len(bins.q) else None,
        variance_share=float(variances[(q >= q0) & (q <= q1)].sum() / variances.sum()),
    )
    below = every[every.q <= fit.q_high]
    _refuse_peak(
        below.q,
        beyond(below),
        MAX_EXCESS,
        f"the power law between {fit.q_low:.4g} and {fit.q_high:.4g}",
    )
    _refuse_poor(fit, anisotropy or 1.0, forced=band is not None)
    # h_rms^2 is the integral of (6) between q0 and q1
    growth = -math.expm1(-2 * exponent * math.log(q1 / q0)) * (q0 / unit) ** (
        -2 * exponent
    )
    h_rms = unit * math.sqrt(math.pi * math.exp(log_k) * growth / exponent)
    return {"hurst": exponent, "q0": q0, "q1": q1, "h_rms": h_rms, "fit": fit}


def _refuse_peak(q: FloatArray, excess: FloatArray, limit: float, over: str) -> None:
    """Raise an error for a wavelength whose ln C exceeds something by more than a factor."""
    if excess.size and excess.max() > math.log(limit):
        worst = int(np.argmax(excess))
        raise NotSelfAffineError(
            f"a wavelength stands out: at q = {q[worst]:.4g} the spectrum is {math.exp(excess[worst]):.3g} "
            f"times {over}, more than {limit:g}"
        )


def _refuse_poor(fit: SpectrumFit, anisotropy: float, *, forced: bool) -> None:
    band = f"between q = {fit.q_low:.4g} and {fit.q_high:.4g}"
    faults = {
        f"the band q0 = {fit.q0:.6g}, q1 = {fit.q1:.6g} is too narrow: q1/q0 = {fit.q1 / fit.q0:.4g}, and the model "
        f"needs more than {MIN_ZETA_1:g}": not fit.q1 > MIN_ZETA_1 * fit.q0,
        f"no power law: log10 C scatters by {fit.residual:.3g} about the best one {band}, more than "
        f"{MAX_RESIDUAL}": fit.residual > MAX_RESIDUAL,
        f"the Hurst exponent {fit.hurst:.3g} +- {fit.hurst_error:.2g} is not determined to {MAX_HURST_ERROR} by "
        f"{fit.points} points {band}": fit.hurst_error > MAX_HURST_ERROR,
        f"the self-affine band holds {fit.variance_share:.2%} of the variance of height, less than "
        f"{MIN_VARIANCE_SHARE:.0%}: the rest is form or waviness; remove it, or choose the band "
        "yourself": not forced and fit.variance_share < MIN_VARIANCE_SHARE,
        f"the map is not isotropic: its anisotropy is {anisotropy:.3g}, more than {MAX_ANISOTROPY} (rms gradient along "
        "over across)": anisotropy > MAX_ANISOTROPY,
    }
    for fault, found in faults.items():
        if found:
            raise NotSelfAffineError(fault)
