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
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError
from mbma_tables.surfaces.heights import Heights
from mbma_tables.surfaces.spectral import SpectralSurface
from mbma_tables.surfaces.spectrum import PowerLaws
from mbma_tables.surfaces.treatment import MIN_POWER, Treated

PER_DECADE = 10  # nodes of the spectrum
PANELS = 8  # panels between two nodes
BLOCK = 10_000  # wavenumbers whose panels are in memory at a time: 40 MB, 0.1 s
END = 1e-3  # share of the squared gradient in the wavelengths above the surface's last
LONGEST = 4  # longest wavelengths of a trace,
ROLLED_OFF = (
    0.5  # which have no roll-off if they have more than this share of the variance
)
MIN_NODES = 5
ONE_TRACE = (
    "one trace cannot tell lay, heights and gradient of a surface as well as the stated "
    "scatter: measure a map, Surface.from_map(map)"
)


@dataclasses.dataclass(frozen=True, eq=False)
class _Trace:
    """The Fourier components of a line scan, by bins; lengths are over its highest point."""

    q: FloatArray
    C: FloatArray  # C_1D of each component
    slopes: FloatArray  # C_1D q^2
    edges: FloatArray  # wavenumbers between bins
    bin_of: NDArray[np.intp]  # of each component
    count: FloatArray  # components in each bin
    overlap: float  # components that count as one independent component
    h_rms: float
    gradient: float

    @property
    def independent(self) -> FloatArray:
        """Independent components in each bin."""
        return self.count / self.overlap


def measured_profile(treated: Treated) -> SpectralSurface:
    """The isotropic surface of a treated line scan; see `Surface.from_profile`."""
    # lengths of order one, so that their powers neither underflow nor overflow
    scale = float(np.abs(treated.heights).max())
    step = treated.steps[0] / scale
    low, high = (scale * wave for wave in treated.waves)
    # oblique wavelengths appear longer along the line: the cut-off applies to the spectrum,
    # not to the trace
    uncut = treated.heights if treated.uncut is None else treated.uncut
    whole = dataclasses.replace(treated, heights=uncut / scale)
    heights = Heights.of(treated.heights / scale)
    length = treated.heights.size * step

    trace = _trace_of(whole, step, length, low)
    nodes = _spectrum_at_nodes(trace)
    waves = length * trace.gradient / trace.h_rms
    notes = [_accuracy(trace, high), _limits(waves)]
    longest = float(trace.C[:LONGEST].sum() / trace.C.sum())
    if longest > ROLLED_OFF:
        # the distribution needs more than a few wavelengths
        heights = Heights.gaussian(trace.h_rms, heights.h_max)
        notes.append(_without_roll_off(longest))

    end = min(high, float(trace.edges[-1]))
    q = np.append(trace.edges[trace.edges < end], end)
    C = PowerLaws(trace.edges, nodes).at(q)
    samples = np.interp(np.log(q), np.log(trace.edges[:-1]), trace.independent)
    surface = SpectralSurface(q, C, heights=heights, samples=samples)
    surface = surface.scaled(scale, treated.unit)
    return dataclasses.replace(surface, provenance=treated.history(*notes))


def _trace_of(whole: Treated, step: float, length: float, low: float) -> _Trace:
    """The components of a trace of that step and length, from a wavenumber on."""
    unit = 2 * math.pi / length
    q, C = _components(whole, step, low)
    edges, bin_of = _bins(q, unit)
    slopes = C * q**2
    return _Trace(
        q=q,
        C=C,
        slopes=slopes,
        edges=edges,
        bin_of=bin_of,
        count=np.bincount(bin_of).astype(float),
        overlap=whole.overlap,
        h_rms=float(whole.heights.std()),
        gradient=math.sqrt(2 * slopes.sum() * unit / np.pi),
    )


def _spectrum_at_nodes(trace: _Trace) -> FloatArray:
    """C of the isotropic surface at the edges of bins."""
    edges = trace.edges
    # panels between nodes, evenly spaced in ln q
    place = np.arange(PANELS * (edges.size - 1) + 1) / PANELS
    fine = np.exp(np.interp(place, np.arange(edges.size), np.log(edges)))
    starts = np.searchsorted(trace.bin_of, np.arange(trace.count.size))
    kernel = _panel_sums(fine, trace.q, starts)
    mean = np.bincount(trace.bin_of, trace.C) / trace.count
    squares = (trace.h_rms**2, trace.gradient**2)
    return _isotropic(
        edges, fine, mean, trace.independent, kernel / trace.count[:, None], squares
    )


def _accuracy(trace: _Trace, high: float) -> dict[str, Any]:
    """Note on the standard errors of h_rms and gradient."""
    # powers are exponentially distributed: the mean of squares is twice the square of the
    # mean
    is_measured = trace.q <= high * (1 + 1e-9)
    of_height = _relative_error(trace.C[is_measured])
    of_slope = _relative_error(trace.slopes[is_measured])
    of_gradient = math.sqrt(trace.overlap) * of_slope
    description = (
        f"h_rms is known to {of_height:.1%} and the rms gradient to {of_gradient:.1%} "
        "(one standard error, of a Gaussian surface)"
    )
    return {
        "step": "errors",
        "h_rms": of_height,
        "rms_gradient": of_gradient,
        "told": description,
    }


def _relative_error(powers: FloatArray) -> float:
    """Relative standard error of the root of a sum of independent powers."""
    error: float = math.sqrt(powers @ powers / 2) / powers.sum() / 2
    return error


def _without_roll_off(share: float) -> dict[str, Any]:
    """Note that the longest wavelengths have a large share of the variance."""
    description = (
        f"the {LONGEST} longest wavelengths of the trace hold {share:.0%} of its "
        "variance: h_rms grows with its length, its error is larger than stated, and "
        "heights are taken as Gaussian"
    )
    return {"step": "no roll-off", "share": share, "told": description}


def _panel_sums(fine: FloatArray, q: FloatArray, starts: NDArray[np.intp]) -> FloatArray:
    """C_1D for C = 1 on each panel, summed over the wavenumbers of each bin.

    Bins begin at `starts`.
    """
    sums = np.zeros((starts.size, fine.size - 1))
    ends = [*starts.tolist(), q.size]
    for bin_, (start, stop) in enumerate(itertools.pairwise(ends)):
        # a wave appears at lower wavenumbers only: panels below the bin have no share
        lowest = max(int(np.searchsorted(fine, q[start])) - 1, 0)
        squared_ends = fine[lowest:] ** 2
        for first in range(start, stop, BLOCK):
            block = q[first : min(first + BLOCK, stop), None]
            # the integral of q' dq'/sqrt(q'^2 - q^2)
            roots = np.sqrt(np.maximum(squared_ends - block**2, 0))
            sums[bin_, lowest:] += np.diff(4 * np.pi * roots, axis=1).sum(axis=0)
    return sums


def _components(trace: Treated, step: float, low: float) -> tuple[FloatArray, FloatArray]:
    """Wavenumbers and C_1D of a trace's Fourier components, up to the surface's last."""
    size = trace.heights.size
    transform = step * np.fft.rfft(trace.windowed())
    last = (size - 1) // 2
    q = 2 * math.pi / (size * step) * np.arange(1, last + 1)
    C = np.abs(transform[1 : last + 1]) ** 2 / (size * step)
    is_used = q >= low * (1 - 1e-9)
    if is_used.any():
        # beyond the surface's end there is only rounding and spectral leakage
        squared_slopes = C * q**2 * is_used
        rest = np.cumsum(squared_slopes[::-1])[::-1]
        is_used &= rest > END * rest[0]
    return q[is_used], C[is_used]


def _bins(q: FloatArray, unit: float) -> tuple[FloatArray, NDArray[np.intp]]:
    """Wavenumbers between logarithmic bins that are not empty, and the bin of each wavenumber."""
    bins = 0
    if q.size > 1:
        bins = math.ceil(PER_DECADE * math.log10(q[-1] / q[0]))
    if bins < MIN_NODES:
        raise InputError(
            f"the line scan holds {q.size} wavelengths: too few for a spectrum"
        )
    edges = np.geomspace(q[0] - unit / 2, q[-1] + unit / 2, bins + 1)
    filled = np.unique(np.searchsorted(edges, q, side="right") - 1)
    edges = np.append(edges[filled], edges[-1])
    return edges, np.searchsorted(edges, q, side="right") - 1


def _isotropic(
    edges: FloatArray,
    fine: FloatArray,
    mean: FloatArray,
    count: FloatArray,
    kernel: FloatArray,
    squares: tuple[float, float],
) -> FloatArray:
    """C at the edges of bins [length^4], h_rms^2 = 2 pi integral C q dq.

    `fine` are the ends of panels, `mean` is C_1D of each bin, `count` its independent
    components, `kernel` its C_1D for C = 1 on each panel, `squares` are the mean squares of
    height and gradient.
    """
    from scipy.optimize import least_squares
    from scipy.special import digamma

    log_q = np.log(edges)
    independent = np.maximum(count, 1.0)
    # bins without power, as for a square profile, are omitted
    has_power = mean > MIN_POWER * mean.max()
    weight = np.sqrt(independent) * has_power
    mean = np.where(has_power, mean, 1.0)
    # the logarithm of a mean of few samples is biased low
    log_mean = np.log(mean) - digamma(independent) + np.log(independent)
    # height variance and squared gradient for C = 1 on each panel
    sums = np.stack([np.pi * np.diff(fine**2), np.pi / 2 * np.diff(fine**4)])
    log_squares = np.log(squares)
    # height variance and gradient weigh so much more that they are met to 1e-5
    exact = 1e3
    between = _interpolation(log_q, fine)
    bend = _bend(log_q)

    def deviations(log_C: FloatArray) -> FloatArray:
        C = np.exp(between @ log_C)
        of_trace = np.log(kernel @ C) - log_mean
        of_squares = np.log(sums @ C) - log_squares
        return np.concatenate([weight * of_trace, bend @ log_C, exact * of_squares])

    def jacobian(log_C: FloatArray) -> FloatArray:
        C = np.exp(between @ log_C)
        of_trace = (kernel * C) @ between / (kernel @ C)[:, None]
        of_squares = (sums * C) @ between / (sums @ C)[:, None]
        return np.vstack([weight[:, None] * of_trace, bend, exact * of_squares])

    # of the right size to start from: C_1D/(2 pi q)
    middles = np.sqrt(edges[1:] * edges[:-1])[has_power]
    log_start = np.log(mean[has_power] / (2 * np.pi * middles))
    start = np.interp(log_q, np.log(middles), log_start)
    fitted = least_squares(deviations, start, jac=jacobian)
    return np.asarray(np.exp(fitted.x))


def _interpolation(log_q: FloatArray, fine: FloatArray) -> FloatArray:
    """Matrix that interpolates from nodes to the middles of panels."""
    middle = np.log(fine[1:] * fine[:-1]) / 2
    columns = [np.interp(middle, log_q, row) for row in np.eye(log_q.size)]
    return np.stack(columns, axis=1)


def _bend(log_q: FloatArray) -> FloatArray:
    """Matrix of the changes of slope, d ln C/d ln q, from node to node.

    In standard deviations of real surfaces, 1.
    """
    differences = np.diff(np.eye(log_q.size), axis=0)
    slopes = differences / np.diff(log_q)[:, None]
    return np.diff(slopes, axis=0)


def _limits(waves: float) -> dict[str, Any]:
    """Note on what a trace of that length over h_rms/gradient does not determine."""
    # expected Euler characteristic of a Gaussian square above the level: one summit left
    summits = waves**2 / 2 / (2 * math.pi) ** 1.5
    level = math.sqrt(2 * math.log(max(summits, 2.0)))
    level = math.sqrt(2 * math.log(max(level * summits, 2.0)))
    description = (
        "one trace cannot tell anisotropy: across a lay the gradient is up to sqrt(2) "
        "times too large, along it too small. Its highest point is a line's: a Gaussian "
        f"square of its length reaches about {level:.1f} h_rms"
    )
    return {"step": "unseen", "h_max": level, "told": description, "not_valid": ONE_TRACE}
