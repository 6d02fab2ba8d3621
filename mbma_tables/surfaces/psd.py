"""The self-affine band of a power spectrum: a power law, with or without a roll-off and a cut, and how well it fits."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.special import beta, betaincc

from mbma_tables.arguments import FloatArray
from mbma_tables.errors import NotSelfAffineError
from mbma_tables.surfaces.surface import LEAST_ZETA_1, Surface

BINS_PER_DECADE = 20  # 12% wide: a break is placed to that, a dense spectrum still averages many entries
LEAST_POINTS = 6  # two make the line, four judge it
LEAST_PIECE = 3  # bins in a roll-off or in what follows a cut; fewer would fit noise
SCATTER = 0.1  # of ln C beyond counting statistics: what a real surface strays from a power law
LARGEST_RESIDUAL = 0.2  # of log10 C, a factor 1.6: beyond it the law says little about any one scale
LARGEST_HURST_ERROR = 0.1  # the model's answers at H and H +- 0.1 differ by tens of percent
LARGEST_EXCESS = 10.0  # C over the law in a single bin; chance gives this less than once in 1e4
LARGEST_PEAK = 100.0  # C over both its neighbourhoods; chance, in single samples, gives this twice in 1e4
LEAST_SHARE = 0.1  # of the variance; a flat roll-off leaves 1/(1 + H) > 0.5, form or waviness leaves less
HURST_TOLERANCE = 0.05  # bias of H on small windowed maps: up to here above 1 the surface holds H = 1
MARGIN = 6.0  # of Bayesian information: beyond it the evidence is held to be strong
EXACT = 1e-6  # mean misfit at which a spectrum counts as computed, not measured
LEAST_RATIO = 0.8  # of largest wavenumber to a profile's q1: there the drop is 30%; with less, q1 would be guessed
TYPICAL_SLOPE = 3.5  # C q^3.5 is nearly flat for every H, so that averages within a bin do not depend on its filling


@dataclasses.dataclass(frozen=True)
class SpectrumFit:
    """How well a self-affine band describes a measured spectrum. Units follow the measurement's length unit.

    Attributes
    ----------
    hurst, hurst_error : float
        Fitted Hurst exponent and its standard error.
    hurst_held : bool
        True where `hurst` lies above 1 within its uncertainty and the surface therefore has 1.
    q0, q1 : float
        The surface's band.
    q_low, q_high : float
        Least and largest wavenumber of the points that the line was fitted to.
    points : int
        How many spectral points (logarithmic bins) those are.
    residual : float
        Root-mean-square deviation of log10 C from the law.
    r_squared : float
        Coefficient of determination of log C; like `residual`, with bins weighted by what they average.
    roll_off, cut_off : float or None
        Where the spectrum turns flat below the law, and where it leaves the law above; None where it does not.
    variance_share : float
        Share of the measured variance of height inside [q0, q1].
    h_rms_total : float
        Root-mean-square height of the whole measurement.
    convention : str
        Of the spectrum given; 'paper' for a map.
    windowed : bool
        Whether a window was applied.
    detrend : str or None
        What was subtracted from the map; None for a spectrum.
    anisotropy : float or None
        0 where all directions carry the same power, 1 where one carries all; None for a spectrum.
    length_unit : str or None
        The map's, where it named one.
    """

    hurst: float
    hurst_error: float
    hurst_held: bool
    q0: float
    q1: float
    q_low: float
    q_high: float
    points: int
    residual: float
    r_squared: float
    roll_off: float | None
    cut_off: float | None
    variance_share: float
    h_rms_total: float
    convention: str
    windowed: bool = False
    detrend: str | None = None
    anisotropy: float | None = None
    length_unit: str | None = None

    def __repr__(self) -> str:
        def shown(value: Any) -> str:
            return f"{value:.4g}" if isinstance(value, float) else repr(value)

        fields = (f"{field.name}={shown(getattr(self, field.name))}" for field in dataclasses.fields(self))
        return f"SpectrumFit({', '.join(fields)})"


@dataclasses.dataclass(frozen=True)
class _Bins:
    """Spectral points: wavenumber, spectrum, and the weight 1/variance of its logarithm."""

    q: FloatArray
    log_c: FloatArray
    weight: FloatArray


@dataclasses.dataclass(frozen=True)
class _Law:
    """ln C = log_k - slope ln(q/unit) + damp(q) over bins[start:stop]; `end` is where a profile's surface ends."""

    start: int
    stop: int
    log_k: float
    slope: float
    slope_error: float
    misfit: float
    parameters: int
    level: float | None = None
    end: float = math.inf

    def log_at(self, q: FloatArray, unit: float) -> FloatArray:
        law: FloatArray = self.log_k - self.slope * np.log(q / unit)
        return law + _profile_damping(q, self.slope, self.end)


def _profile_damping(q: FloatArray, slope: float, end: float) -> FloatArray:
    """How far ln C_1D lies below its power law as waves beyond `end` are missing; exact for Eq. (6)."""
    with np.errstate(divide="ignore"):
        damping: FloatArray = np.log(betaincc(slope / 2, 0.5, np.minimum(q / end, 1.0) ** 2))
    return damping


def _log_bins(q: FloatArray, C: FloatArray, counts: FloatArray) -> _Bins:
    # half a bin ahead, so that the first wavenumbers of a grid do not lie on an edge
    place = np.floor(BINS_PER_DECADE * np.log10(q / q.min()) + 0.5).astype(int)
    total = np.bincount(place, counts)
    filled = total > 0
    total = total[filled]
    log_q = np.bincount(place, counts * np.log(q))[filled] / total
    relative = q / np.exp(log_q)[np.cumsum(filled)[place] - 1]
    mean = np.bincount(place, counts * C * relative**TYPICAL_SLOPE)[filled] / total
    floor = np.finfo(float).tiny  # a gap in the spectrum: as a logarithm, far off any law
    return _Bins(np.exp(log_q), np.log(np.maximum(mean, floor)), 1 / (1 / total + SCATTER**2))


def _straight(x: FloatArray, bins: _Bins, start: int, stop: int) -> tuple[float, float, float, float]:
    """Weighted line through bins[start:stop]: (intercept, slope, chi^2, weighted spread of x)."""
    w, x, y = bins.weight[start:stop], x[start:stop], bins.log_c[start:stop]
    x_mean, y_mean = np.average(x, weights=w), np.average(y, weights=w)
    spread = float(w @ (x - x_mean) ** 2)
    slope = float(w @ ((x - x_mean) * (y - y_mean))) / spread
    intercept = float(y_mean - slope * x_mean)
    return intercept, slope, float(w @ (y - intercept - slope * x) ** 2), spread


def _roll_off(x: FloatArray, bins: _Bins, stop: int) -> tuple[float, int, float | None]:
    """A flat or else a rising line through bins[:stop]: (chi^2, parameters with the break, level if flat)."""
    if stop == 0:
        return 0.0, 0, None
    w, y = bins.weight[:stop], bins.log_c[:stop]
    level = float(np.average(y, weights=w))
    flat = float(w @ (y - level) ** 2)
    _, slope, rising, _ = _straight(x, bins, 0, stop)
    return (rising, 3, None) if slope > 0 and rising + math.log(len(x)) < flat else (flat, 2, level)


def _criterion(pieces: Iterable[tuple[float, int]], parameters: int, floor: float = 1.0) -> float:
    """Bayesian information of pieces (chi^2, bins); the floor, 1 for the scatter expected anyway, is not fitted."""
    held = [(chi2, count) for chi2, count in pieces if count]
    information = sum(count * math.log(floor + chi2 / count) for chi2, count in held)
    return information + parameters * math.log(sum(count for _, count in held))


def _find_law(bins: _Bins, unit: float, offset: float, breaks: bool) -> _Law:
    """The best of: a power law, with or without a roll-off before it and a departure after it."""
    x, count = np.log(bins.q / unit), len(bins.q)
    starts, stops = [0], [count]
    if breaks:
        starts += range(LEAST_PIECE, count - LEAST_POINTS + 1)
        stops += range(LEAST_POINTS, count - LEAST_PIECE + 1)
    befores = {start: _roll_off(x, bins, start) for start in starts}
    afters = {stop: _straight(x, bins, stop, count)[2] if stop < count else 0.0 for stop in stops}
    laws = []
    for start, stop in itertools.product(starts, stops):
        if stop - start < LEAST_POINTS:
            continue
        log_k, slope, chi2, spread = _straight(x, bins, start, stop)
        before, more, level = befores[start]
        parameters = 2 + more + 3 * (stop < count)
        misfit = before + chi2 + afters[stop]
        error = math.sqrt(chi2 / (stop - start - 2) / spread)
        laws.append(_Law(start, stop, log_k, -slope, error, misfit, parameters, level))

    def criterion(law: _Law) -> float:
        # each piece by its own scatter, or a tail that no line describes would hide what the law misses
        pieces = (
            (befores[law.start][0], law.start),
            (law.misfit - befores[law.start][0] - afters[law.stop], law.stop - law.start),
            (afters[law.stop], count - law.stop),
        )
        return _criterion(pieces, law.parameters)

    best = min(laws, key=criterion)
    # a roll-off and its law can also be described as a law and what follows its cut: only one is self-affine
    likely = [
        law
        for law in laws
        if 0 < (law.slope - offset) / 2 <= 1 + HURST_TOLERANCE
        and bins.q[law.stop - 1] > LEAST_ZETA_1 * bins.q[law.start]
    ]
    chosen = min(likely, key=criterion, default=best)
    return chosen if criterion(chosen) <= criterion(best) + MARGIN else best


def _end_of_profile(bins: _Bins, unit: float, law: _Law) -> _Law:
    """The law with the surface's end fitted to a profile's drop, where that describes it better."""
    count = len(bins.q)
    q, y = bins.q[law.start :], bins.log_c[law.start :]
    root = np.sqrt(bins.weight[law.start :])

    def deviation(p: FloatArray) -> FloatArray:
        law: FloatArray = p[0] - p[1] * np.log(q / unit) + _profile_damping(q, p[1], q[-1] / p[2])
        return root * (law - y)

    slope = min(max(law.slope, 1.01), 5.0)
    trials = [
        least_squares(
            deviation,
            (law.log_k, slope, ratio),
            bounds=((-np.inf, 0.5, 1e-3), (np.inf, 6.0, 1 - 1e-9)),
            x_scale=(1.0, 1.0, 0.1),
            xtol=1e-12,
        )
        for ratio in (0.3, 0.9, 0.99)
    ]
    best = min(trials, key=lambda trial: float(trial.cost))
    before, more, _ = _roll_off(np.log(bins.q / unit), bins, law.start)
    misfit, parameters = before + 2 * best.cost, 3 + more
    # judged by the scatter of this very spectrum: the drop is no guess but what every end looks like
    plain = _criterion([(law.misfit, count)], law.parameters, EXACT)
    if _criterion([(misfit, count)], parameters, EXACT) >= plain:
        return law
    covariance = np.linalg.pinv(best.jac.T @ best.jac) * 2 * best.cost / max(len(q) - 3, 1)
    return dataclasses.replace(
        law,
        stop=count,
        log_k=float(best.x[0]),
        slope=float(best.x[1]),
        slope_error=float(math.sqrt(covariance[1, 1])),
        misfit=misfit,
        parameters=parameters,
        end=float(q[-1] / best.x[2]),
    )


def _edges(bins: _Bins, law: _Law, unit: float, ends: tuple[float, float]) -> tuple[float, float]:
    """The band that the law holds in, within `ends`."""
    q0, q1 = ends
    q = bins.q
    if law.start:
        q0 = math.sqrt(q[law.start - 1] * q[law.start])
        if law.level is not None:
            crossing = unit * math.exp((law.log_k - law.level) / law.slope)
            if q[law.start - 1] <= crossing <= q[law.start]:
                q0 = crossing
    if law.stop < len(q):
        q1 = math.sqrt(q[law.stop - 1] * q[law.stop])
    return q0, law.end if law.end <= q[-1] / LEAST_RATIO else q1


def fit_surface(
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
) -> Surface:
    """The surface whose band fits C, in the paper's convention or a profile's; the core of this module.

    Parameters
    ----------
    q, C, counts, variances : numpy.ndarray
        Wavenumber, positive spectrum, independent samples and variance of height that each entry stands for.
    h_max : float
        Highest point.
    usable : tuple of float
        Wavenumbers between which the spectrum is to be trusted.
    band : tuple of float or None
        The band, where the user forces it.
    power : float
        What `variances` adds up to if nothing is left out.
    convention : str
        'profile', or one whose C is the paper's by now.
    known : object
        Further fields of `SpectrumFit`.
    """
    profile = convention == "profile"
    unit, offset = float(q.min()), 1.0 if profile else 2.0
    low, high = band or usable
    every = _log_bins(q, C, counts)
    inside = (every.q >= low * (1 - 1e-9)) & (every.q <= high * (1 + 1e-9))
    bins = _Bins(every.q[inside], every.log_c[inside], every.weight[inside])
    if len(bins.q) < LEAST_POINTS:
        raise NotSelfAffineError(
            f"only {len(bins.q)} spectral points between q = {low:.6g} and {high:.6g}; "
            f"a power law needs at least {LEAST_POINTS}"
        )
    _refuse_peak(bins)
    law = _find_law(bins, unit, offset, breaks=band is None)
    if profile and band is None:
        law = _end_of_profile(bins, unit, law)
    hurst, error = (law.slope - offset) / 2, law.slope_error / 2
    used = slice(law.start, law.stop)
    if not 0 < hurst <= 1 + max(HURST_TOLERANCE, 2 * error):
        raise NotSelfAffineError(
            f"between q = {bins.q[used][0]:.4g} and {bins.q[used][-1]:.4g} the spectrum goes like "
            f"q^{-law.slope:.3g}: a Hurst exponent of {hurst:.3g} +- {error:.2g}, "
            + ("above 1 (a smooth surface)" if hurst > 0 else "not above 0 (white noise has -1)")
        )
    held = hurst > 1
    if held:
        law = dataclasses.replace(law, slope=2.0 + offset, log_k=0.0)
        shift = bins.log_c[used] - law.log_at(bins.q[used], unit)
        law = dataclasses.replace(law, log_k=float(np.average(shift, weights=bins.weight[used])))
    deviation, weight = bins.log_c[used] - law.log_at(bins.q[used], unit), bins.weight[used]
    residual = math.sqrt(np.average(deviation**2, weights=weight))
    y_mean = np.average(bins.log_c[used], weights=weight)
    spread = float(np.average((bins.log_c[used] - y_mean) ** 2, weights=weight))
    # a map without roll-off reaches to its own size, though its longest waves are too few to be fitted
    q0, q1 = band or _edges(bins, law, unit, (unit, float(q.max())))
    fit = SpectrumFit(
        hurst=hurst,
        hurst_error=error,
        hurst_held=held,
        q0=q0,
        q1=q1,
        q_low=float(bins.q[law.start]),
        q_high=float(bins.q[law.stop - 1]),
        points=law.stop - law.start,
        residual=residual / math.log(10),
        r_squared=1 - residual**2 / spread,
        roll_off=q0 if law.start else None,
        cut_off=q1 if law.stop < len(bins.q) else None,
        variance_share=float(variances[(q >= q0) & (q <= q1)].sum() / power),
        convention=convention,
        **known,
    )
    below = every.q <= fit.q_high
    _refuse_poor(fit, every, below, every.log_c - law.log_at(every.q, unit), forced=band is not None)
    own = min(hurst, 1.0)
    scale = math.exp(law.log_k) / (2 * math.pi * beta(own + 0.5, 0.5) * unit if profile else 1.0)
    z0, z1 = q0 / unit, q1 / unit
    growth = -math.expm1(-2 * own * math.log(z1 / z0)) * z0 ** (-2 * own)
    return Surface(own, q0, q1, unit * math.sqrt(math.pi * scale * growth / own), h_max, fit=fit)


def _refuse_peak(bins: _Bins) -> None:
    """Refuse a wave so strong that the pieces would be laid around it."""
    y, reach = bins.log_c, LEAST_PIECE
    rise = y[reach:-reach] - np.maximum(y[: -2 * reach], y[2 * reach :])
    if rise.size and rise.max() > math.log(LARGEST_PEAK):
        worst = int(np.argmax(rise))
        raise NotSelfAffineError(
            f"a wave stands out: at q = {bins.q[reach + worst]:.4g} the spectrum is {math.exp(rise[worst]):.3g} times "
            f"what it is on either side, more than {LARGEST_PEAK:g}"
        )


def _refuse_poor(fit: SpectrumFit, every: _Bins, below: NDArray[np.bool_], excess: FloatArray, *, forced: bool) -> None:
    band = f"between q = {fit.q_low:.4g} and {fit.q_high:.4g}"
    if not fit.q1 > LEAST_ZETA_1 * fit.q0:
        raise NotSelfAffineError(
            f"the band q0 = {fit.q0:.6g}, q1 = {fit.q1:.6g} is too narrow: q1/q0 = {fit.q1 / fit.q0:.4g}, "
            "and the model needs more than 3"
        )
    if fit.residual > LARGEST_RESIDUAL:
        raise NotSelfAffineError(
            f"no power law: log10 C scatters by {fit.residual:.3g} about the best one {band}, "
            f"more than {LARGEST_RESIDUAL}"
        )
    if fit.hurst_error > LARGEST_HURST_ERROR:
        raise NotSelfAffineError(
            f"the Hurst exponent {fit.hurst:.3g} +- {fit.hurst_error:.2g} is not determined to "
            f"{LARGEST_HURST_ERROR} by {fit.points} points {band}"
        )
    strong = below & (excess > math.log(LARGEST_EXCESS))
    if strong.any():
        worst = int(np.argmax(np.where(strong, excess, -np.inf)))
        raise NotSelfAffineError(
            f"a wave stands out: at q = {every.q[worst]:.4g} the spectrum is {math.exp(excess[worst]):.3g} "
            f"times the power law {band}, more than {LARGEST_EXCESS:g}"
        )
    if not forced and fit.variance_share < LEAST_SHARE:
        raise NotSelfAffineError(
            f"the self-affine band holds {fit.variance_share:.2%} of the variance of height, less than "
            f"{LEAST_SHARE:.0%}: the rest is form or waviness; remove it, or choose the band yourself"
        )
