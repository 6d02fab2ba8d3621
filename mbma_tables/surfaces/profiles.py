"""Line scans: the isotropic surface of a measured profile.

A profile's spectrum C_1D, with h_rms^2 = integral C_1D dq/pi, follows from the isotropic
one: C_1D(q) = 4 pi integral from q of C q' dq'/sqrt(q'^2 - q^2), an Abel transform. Its
inverse is sought as a power law between nodes, as straight in its logarithms as the scatter
of the measurement allows, with the profile's variance of height and gradient.
"""

import dataclasses
import itertools
import math
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError
from mbma_tables.surfaces.heights import Heights
from mbma_tables.surfaces.spectral import SpectralSurface
from mbma_tables.surfaces.spectrum import PowerLaws
from mbma_tables.surfaces.treatment import MIN_POWER, Treated

PER_DECADE = 10  # nodes of the spectrum
PANELS = 8  # panels between two nodes
BLOCK = 10_000  # wavenumbers whose panels are in memory at a time: 40 MB, 0.1 s
STRAIGHT = (
    1.0  # standard deviation of the change of slope, d ln C/d ln q, from node to node
)
HELD = 1e3  # weight of height variance and gradient, which are met to 1e-5
END = 1e-3  # share of the squared gradient in the wavelengths above the surface's last
LONGEST, ROLLED_OFF = (
    4,
    0.5,
)  # longest wavelengths of a trace: with half of the variance there is no roll-off
MIN_NODES = 5
ONE_TRACE = (
    "one trace cannot tell lay, heights and gradient of a surface as well as the stated scatter: measure a map, "
    "Surface.from_map(map)"
)


def measured_profile(treated: Treated) -> SpectralSurface:
    """The isotropic surface of a treated line scan; see `Surface.from_profile`."""
    # lengths of order one, so that their powers neither underflow nor overflow
    scale = float(np.abs(treated.heights).max())
    step, (low, high) = treated.steps[0] / scale, (scale * wave for wave in treated.waves)
    # oblique wavelengths appear longer along the line: the cut-off applies to the spectrum,
    # not to the trace
    trace = dataclasses.replace(
        treated,
        heights=(treated.heights if treated.uncut is None else treated.uncut) / scale,
    )
    heights, length = Heights.of(treated.heights / scale), treated.heights.size * step
    unit, overlap = 2 * math.pi / length, treated.overlap
    q, C = _components(trace, step, low)
    edges, number = _bins(q, unit)
    count, slopes = np.bincount(number).astype(float), C * q**2
    h_rms, gradient = (
        float(trace.heights.std()),
        math.sqrt(2 * slopes.sum() * unit / np.pi),
    )
    # panels between nodes, evenly spaced in ln q
    place = np.arange(PANELS * (edges.size - 1) + 1) / PANELS
    fine = np.exp(np.interp(place, np.arange(edges.size), np.log(edges)))
    kernel = _panel_sums(fine, q, np.searchsorted(number, np.arange(count.size)))
    mean, squares = np.bincount(number, C) / count, (h_rms**2, gradient**2)
    nodes = _isotropic(
        edges, fine, mean, count / overlap, kernel / count[:, None], squares
    )
    longest, notes = (
        float(C[:LONGEST].sum() / C.sum()),
        _limits(length * gradient / h_rms),
    )
    # powers are exponentially distributed: the mean of squares is twice the square of the mean
    kept = q <= high * (1 + 1e-9)
    errors = [
        math.sqrt(each @ each / 2) / each.sum() / 2 for each in (C[kept], slopes[kept])
    ]
    told = (
        f"h_rms is known to {errors[0]:.1%} and the rms gradient to {math.sqrt(overlap) * errors[1]:.1%} (one standard "
        "error, of a Gaussian surface)"
    )
    found = {
        "step": "errors",
        "h_rms": errors[0],
        "rms_gradient": math.sqrt(overlap) * errors[1],
        "told": told,
    }
    if longest > ROLLED_OFF:
        # the distribution needs more than a few wavelengths
        heights = Heights.gaussian(h_rms, heights.h_max)
        told = (
            f"the {LONGEST} longest wavelengths of the trace hold {longest:.0%} of its variance: "
            "h_rms grows with its length, its error is larger than stated, and heights are taken as Gaussian"
        )
        notes += ({"step": "no roll-off", "share": longest, "told": told},)
    end = min(high, float(edges[-1]))
    q = np.append(edges[edges < end], end)
    own, samples = (
        PowerLaws(edges, nodes).at(q),
        np.interp(np.log(q), np.log(edges[:-1]), count / overlap),
    )
    surface = SpectralSurface(q, own, heights=heights, samples=samples).scaled(
        scale, treated.unit
    )
    return dataclasses.replace(surface, provenance=treated.history(found, *notes))


def _panel_sums(fine: FloatArray, q: FloatArray, starts: Any) -> FloatArray:
    """C_1D for C = 1 on each panel, summed over the wavenumbers of each bin; bins begin at `starts`."""
    sums = np.zeros((starts.size, fine.size - 1))
    for bin_, (start, stop) in enumerate(itertools.pairwise([*starts.tolist(), q.size])):
        # a wave appears at lower wavenumbers only: panels below the bin have no share
        lowest = max(int(np.searchsorted(fine, q[start])) - 1, 0)
        for first in range(start, stop, BLOCK):
            block = q[first : min(first + BLOCK, stop), None]
            sides = 4 * np.pi * np.sqrt(np.maximum(fine[lowest:] ** 2 - block**2, 0))
            sums[bin_, lowest:] += np.diff(sides, axis=1).sum(axis=0)
    return sums


def _components(trace: Treated, step: float, low: float) -> tuple[FloatArray, FloatArray]:
    """Wavenumbers and C_1D of a trace's Fourier components, up to the surface's last."""
    size = trace.heights.size
    transform, last = step * np.fft.rfft(trace.windowed()), (size - 1) // 2
    q = 2 * math.pi / (size * step) * np.arange(1, last + 1)
    C = np.abs(transform[1 : last + 1]) ** 2 / (size * step)
    held = q >= low * (1 - 1e-9)
    if held.any():
        # beyond the surface's end there is only rounding and spectral leakage
        rest = np.cumsum((C * q**2 * held)[::-1])[::-1]
        held &= rest > END * rest[0]
    return q[held], C[held]


def _bins(q: FloatArray, unit: float) -> tuple[FloatArray, Any]:
    """Wavenumbers between logarithmic bins that are not empty, and the bin of each wavenumber."""
    bins = math.ceil(PER_DECADE * math.log10(q[-1] / q[0])) if q.size > 1 else 0
    if bins < MIN_NODES:
        raise InputError(
            f"the line scan holds {q.size} wavelengths: too few for a spectrum"
        )
    edges = np.geomspace(q[0] - unit / 2, q[-1] + unit / 2, bins + 1)
    filled = np.unique(np.searchsorted(edges, q, side="right") - 1)
    edges = np.append(edges[filled], edges[-1])
    return edges, np.searchsorted(edges, q, side="right") - 1


def _isotropic(
    edges: FloatArray, fine: FloatArray, mean: FloatArray, count: FloatArray, kernel: FloatArray,
    squares: tuple[float, float],
) -> FloatArray:  # fmt: skip
    """C at the edges of bins [length^4], h_rms^2 = 2 pi integral C q dq.

    `fine` are the ends of panels, `mean` is C_1D of each bin, `count` its independent
    components, `kernel` its C_1D for C = 1 on each panel, `squares` are the mean squares of
    height and gradient.
    """
    from scipy.optimize import least_squares
    from scipy.special import digamma

    log_q = np.log(edges)
    middle = np.log(fine[1:] * fine[:-1]) / 2
    between = np.stack(
        [np.interp(middle, log_q, row) for row in np.eye(log_q.size)], axis=1
    )
    independent = np.maximum(count, 1.0)
    # bins without power, as for a square profile, are omitted
    lit = mean > MIN_POWER * mean.max()
    weight, mean = np.sqrt(independent) * lit, np.where(lit, mean, 1.0)
    # the logarithm of a mean of few samples is biased low
    wanted = np.log(mean) - digamma(independent) + np.log(independent)
    bend = (
        np.diff(np.diff(np.eye(log_q.size), axis=0) / np.diff(log_q)[:, None], axis=0)
        / STRAIGHT
    )
    sums = np.stack([np.pi * np.diff(fine**2), np.pi / 2 * np.diff(fine**4)])
    totals = np.log(squares)

    def deviations(log_C: FloatArray) -> FloatArray:
        C = np.exp(between @ log_C)
        seen, held = np.log(kernel @ C) - wanted, np.log(sums @ C) - totals
        return np.concatenate([weight * seen, bend @ log_C, HELD * held])

    def jacobian(log_C: FloatArray) -> FloatArray:
        C = np.exp(between @ log_C)
        seen = (kernel * C) @ between / (kernel @ C)[:, None]
        held = (sums * C) @ between / (sums @ C)[:, None]
        return np.vstack([weight[:, None] * seen, bend, HELD * held])

    middles = np.sqrt(edges[1:] * edges[:-1])
    start = np.interp(
        log_q, np.log(middles[lit]), np.log(mean[lit] / (2 * np.pi * middles[lit]))
    )
    return np.asarray(np.exp(least_squares(deviations, start, jac=jacobian).x))


def _limits(waves: float) -> tuple[dict[str, Any], ...]:
    """Notes on what a trace of that length over h_rms/gradient does not determine."""
    # expected Euler characteristic of a Gaussian square above the level: one summit left
    summits = waves**2 / 2 / (2 * math.pi) ** 1.5
    level = math.sqrt(2 * math.log(max(summits, 2.0)))
    level = math.sqrt(2 * math.log(max(level * summits, 2.0)))
    told = (
        "one trace cannot tell anisotropy: across a lay the gradient is up to sqrt(2) times too large, along it too "
        f"small. Its highest point is a line's: a Gaussian square of its length reaches about {level:.1f} h_rms"
    )
    return ({"step": "unseen", "h_max": level, "told": told, "not_valid": ONE_TRACE},)
