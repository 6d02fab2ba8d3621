"""A power law found in a power spectrum, with or without a roll-off before it and a departure after it."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.special import betaincc

from mbma_tables.common.arguments import FloatArray
from mbma_tables.surfaces.spectrum import MIN_ZETA_1

BINS_PER_DECADE = 20  # 12% wide: accuracy of a break's position; bins of a dense spectrum still average many entries
MIN_POINTS = 6  # two define the line, four test it
MIN_PIECE = 3  # bins in a roll-off or in what follows a cut; fewer would fit noise
SCATTER = 0.1  # of ln C beyond counting statistics: deviation of real surfaces from a power law
HURST_TOLERANCE = 0.05  # bias of H on small windowed maps: fitted values up to this far above 1 are set to 1
MARGIN = 6.0  # of Bayesian information: larger differences count as strong evidence
EXACT = 1e-6  # mean misfit at which a spectrum counts as computed, not measured
MIN_END_RATIO = 0.8  # of largest wavenumber to a profile's q1: there the drop is 30%; with less, q1 would be guessed
TYPICAL_SLOPE = 3.5  # C q^3.5 is nearly flat for every H, so that averages within a bin do not depend on its filling


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
        """ln C of the law."""
        law: FloatArray = self.log_k - self.slope * np.log(q / unit)
        return law + _profile_damping(q, self.slope, self.end)


def _profile_damping(q: FloatArray, slope: float, end: float) -> FloatArray:
    """Decrease of ln C_1D below its power law due to missing wavelengths beyond `end`; exact for Eq. (6)."""
    with np.errstate(divide="ignore"):
        damping: FloatArray = np.log(betaincc(slope / 2, 0.5, np.minimum(q / end, 1.0) ** 2))
    return damping


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
    return Bins(np.exp(log_q), np.log(np.maximum(mean, floor)), 1 / (1 / total + SCATTER**2))


def _straight(x: FloatArray, bins: Bins, start: int, stop: int) -> tuple[float, float, float, float]:
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
    return (rising, 3, None) if slope > 0 and rising + math.log(len(x)) < flat else (flat, 2, level)


def _criterion(pieces: Iterable[tuple[float, int]], parameters: int, floor: float = 1.0) -> float:
    """Bayesian information of pieces (chi^2, bins); the floor, 1 for the scatter expected anyway, is not fitted."""
    held = [(chi2, count) for chi2, count in pieces if count]
    information = sum(count * math.log(floor + chi2 / count) for chi2, count in held)
    return information + parameters * math.log(sum(count for _, count in held))


def find_law(bins: Bins, unit: float, offset: float, breaks: bool) -> PowerLaw:
    """The best of: a power law, with or without a roll-off before it and a departure after it."""
    x, count = np.log(bins.q / unit), len(bins.q)
    starts, stops = [0], [count]
    if breaks:
        starts += range(MIN_PIECE, count - MIN_POINTS + 1)
        stops += range(MIN_POINTS, count - MIN_PIECE + 1)
    roll_offs = {start: _roll_off(x, bins, start) for start in starts}
    departures = {stop: _straight(x, bins, stop, count)[2] if stop < count else 0.0 for stop in stops}
    laws = []
    for start, stop in itertools.product(starts, stops):
        if stop - start < MIN_POINTS:
            continue
        log_k, slope, chi2, spread = _straight(x, bins, start, stop)
        before, more, level = roll_offs[start]
        parameters = 2 + more + 3 * (stop < count)
        misfit = before + chi2 + departures[stop]
        error = math.sqrt(chi2 / (stop - start - 2) / spread)
        laws.append(PowerLaw(start, stop, log_k, -slope, error, misfit, parameters, level))

    def criterion(law: PowerLaw) -> float:
        # each piece by its own scatter, or a tail that no line fits would hide the misfit of the law
        pieces = (
            (roll_offs[law.start][0], law.start),
            (law.misfit - roll_offs[law.start][0] - departures[law.stop], law.stop - law.start),
            (departures[law.stop], count - law.stop),
        )
        return _criterion(pieces, law.parameters)

    best = min(laws, key=criterion)
    # a roll-off and its law can also be described as a law and its departure: only one of them is self-affine
    likely = [
        law
        for law in laws
        if 0 < (law.slope - offset) / 2 <= 1 + HURST_TOLERANCE and bins.q[law.stop - 1] > MIN_ZETA_1 * bins.q[law.start]
    ]
    chosen = min(likely, key=criterion, default=best)
    return chosen if criterion(chosen) <= criterion(best) + MARGIN else best


def with_end_of_profile(bins: Bins, unit: float, law: PowerLaw) -> PowerLaw:
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
    # compared with the scatter of this spectrum: every band end has such a drop
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


def band_of(bins: Bins, law: PowerLaw, unit: float, ends: tuple[float, float]) -> tuple[float, float]:
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
    return q0, law.end if law.end <= q[-1] / MIN_END_RATIO else q1
