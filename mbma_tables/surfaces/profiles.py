"""Line scans: the isotropic surface of a measured profile.

A profile's spectrum C_1D, with h_rms^2 = integral C_1D dq/pi, follows from the isotropic
one: C_1D(q) = 4 pi integral from q of C q' dq'/sqrt(q'^2 - q^2), an Abel transform. Its
inverse is sought as a power law between nodes, as straight in its logarithms as the scatter
of the measurement allows, with the profile's variance of height and gradient.
"""

import dataclasses
import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError
from mbma_tables.surfaces.heights import Heights
from mbma_tables.surfaces.spectral import BY_SPECTRUM, SpectralSurface
from mbma_tables.surfaces.spectrum import PowerLaws
from mbma_tables.surfaces.treatment import MIN_POWER, Provenance, Treated

PER_DECADE = 10  # nodes of the spectrum
PANELS = 8  # panels between two nodes
BLOCK = 10_000  # wavenumbers whose panels are in memory at a time: 40 MB, 0.1 s
END = 1e-3  # share of the squared gradient in the wavelengths above the surface's last
LONGEST = 4  # longest wavelengths of a trace,
ROLLED_OFF = (
    0.5  # which have no roll-off if they have more than this share of the variance
)
MIN_NODES = 5
# of a spectrum that is given: how far beyond its last wavenumber it is continued, and the
# independent samples of each entry
CONTINUED = 10.0
AVERAGED = 1e4
REPLICAS = 20  # whose standard deviation is known to 16%
# longest wavelengths that the traces hold together: with 64 of them 78% of the errors lay
# within two standard deviations, with 96 and more 90 to 100% (`python -m generate profiles`)
MIN_WAVES = 100.0
# bands of wavenumbers, q (1 - b) to q (1 + b), of which no isotropic surface has much of its
# power in a trace; of so many components at least, and beyond so many standard deviations
BANDS = (0.02, 0.05, 0.1)
IN_BAND = 8
BEYOND = 3.0
ISOTROPIC = "the surface is isotropic: traces in one direction do not show a lay"
ONE_DIRECTION = (
    "isotropy is assumed, and traces in one direction do not show a lay: "
    "Surface.from_profile(..., across=[...]) takes traces at right angles, "
    "isotropic=True states that there is no lay"
)


@dataclasses.dataclass(frozen=True, eq=False)
class _Traces:
    """Fourier components of line scans, by bins; lengths are over their highest point."""

    q: FloatArray
    C: FloatArray  # C_1D of each component
    width: FloatArray  # dq of each in the mean spectrum of all traces and directions
    overlap: FloatArray  # components that count as one independent component
    edges: FloatArray  # wavenumbers between bins
    bin_of: NDArray[np.intp]  # of each component
    h_rms: float

    @property
    def slopes(self) -> FloatArray:
        """C_1D q^2 of each component."""
        return self.C * self.q**2

    @property
    def gradient(self) -> float:
        """Root mean square gradient of the isotropic surface."""
        return math.sqrt(2 * float(self.slopes @ self.width) / math.pi)

    @property
    def independent(self) -> FloatArray:
        """Independent components in each bin."""
        return self.sums(1.0) ** 2 / self.sums(self.overlap * self.width)

    def sums(self, values: Any) -> FloatArray:
        """Sums of values times dq over each bin."""
        return np.asarray(np.bincount(self.bin_of, values * self.width), float)

    def resampled(self, rng: np.random.Generator) -> tuple[FloatArray, float, float]:
        """Mean C_1D of bins, h_rms and gradient of other traces of a Gaussian surface."""
        by = rng.gamma(self.independent) / self.independent
        powers = self.sums(self.C)
        slopes = self.sums(self.slopes)
        # heights are not under the window, whose components are correlated
        change = float(powers @ (by - 1) / powers.sum())
        square = 1 + max(change / math.sqrt(float(self.overlap.max())), -0.9)
        gradient = self.gradient * math.sqrt(float(slopes @ by / slopes.sum()))
        mean = powers / self.sums(1.0)
        return mean * by, self.h_rms * math.sqrt(square), gradient


def measured_profiles(
    traces: Sequence[Treated], across: Sequence[Treated] = (), isotropic: bool = False
) -> SpectralSurface:
    """The isotropic surface of treated line scans; see `Surface.from_profile`."""
    every = [*traces, *across]
    # lengths of order one, so that their powers neither underflow nor overflow
    scale = max(float(np.abs(trace.heights).max()) for trace in every)
    low, high = (scale * wave for wave in traces[0].waves)
    directions = [_pooled(each, scale, low) for each in (traces, across) if each]
    pooled = directions[0] if len(directions) == 1 else _joined(directions)
    heights = _heights(every, scale)
    length = sum(map(_length, every)) / scale

    kernel = _kernel(pooled)
    mean = pooled.sums(pooled.C) / pooled.sums(1.0)
    nodes = _spectrum_at_nodes(pooled, kernel, (mean, pooled.h_rms, pooled.gradient))
    notes = [_accuracy(pooled, high), _limits(length * pooled.gradient / pooled.h_rms)]
    notes += _directions(directions, isotropic)
    notes += _of_slopes(every)
    longest = _share_of_longest(pooled, len(every))
    if longest > ROLLED_OFF:
        # the distribution needs more than a few wavelengths
        heights = Heights.gaussian(pooled.h_rms, heights.h_max)
        notes.append(_without_roll_off(longest))

    end = min(high, float(pooled.edges[-1]))
    q = np.append(pooled.edges[pooled.edges < end], end)
    samples = np.interp(np.log(q), np.log(pooled.edges[:-1]), pooled.independent)
    anisotropy = _anisotropy(directions)

    def surface_of(C_of_nodes: FloatArray, heights: Heights) -> SpectralSurface:
        return SpectralSurface(
            q,
            PowerLaws(pooled.edges, C_of_nodes).at(q),
            heights=heights,
            samples=samples,
            anisotropy=anisotropy,
        )

    surface = surface_of(nodes, heights)
    rng = np.random.default_rng(0)
    replicas = []
    for _ in range(REPLICAS):
        resampled = pooled.resampled(rng)
        size = resampled[1] / pooled.h_rms
        resampled_nodes = _spectrum_at_nodes(pooled, kernel, resampled, nodes)
        replicas.append(surface_of(resampled_nodes, heights.scaled(size)))
    notes += _few_waves(surface, length)
    surface = dataclasses.replace(surface, scans=tuple(replicas))
    surface = surface.scaled(scale, traces[0].unit)
    return dataclasses.replace(surface, provenance=_history(every, notes))


def _length(trace: Treated) -> float:
    return float(trace.heights.size * trace.steps[0])


def _heights(traces: Sequence[Treated], scale: float) -> Heights:
    """The distribution of heights of all traces, each by its length."""
    step = max(trace.steps[0] for trace in traces)
    values = []
    for trace in traces:
        count = round(_length(trace) / step)
        place = np.linspace(0, trace.heights.size - 1, count).round().astype(int)
        values.append(trace.heights[place] / scale)
    heights = Heights.of(np.concatenate(values))
    highest = max(float(trace.heights.max()) for trace in traces) / scale
    return dataclasses.replace(heights, h_max=highest)


def _pooled(traces: Sequence[Treated], scale: float, low: float) -> _Traces:
    """The components of parallel traces from a wavenumber on; each counts by its length."""
    whole_length = sum(map(_length, traces)) / scale
    components = []
    square = 0.0
    for trace in traces:
        # oblique wavelengths appear longer along the line: the cut-off applies to the
        # spectrum, not to the trace
        uncut = trace.heights if trace.uncut is None else trace.uncut
        whole = dataclasses.replace(trace, heights=uncut / scale)
        q, C = _components(whole, trace.steps[0] / scale, low)
        components.append((q, C, np.full(q.size, trace.overlap)))
        share = _length(trace) / scale / whole_length
        square += share * float(whole.heights.var())
    q, C, overlap = (np.concatenate(each) for each in zip(*components, strict=True))
    width = np.full(q.size, 2 * math.pi / whole_length)
    first = 2 * math.pi * scale / max(map(_length, traces))
    return _binned(q, C, width, overlap, math.sqrt(square), first)


def _joined(directions: Sequence[_Traces]) -> _Traces:
    """The components of traces in two directions, of which each counts half."""
    fields = [[each.q, each.C, each.width / 2, each.overlap] for each in directions]
    q, C, width, overlap = (np.concatenate(each) for each in zip(*fields, strict=True))
    h_rms = math.sqrt(sum(each.h_rms**2 for each in directions) / 2)
    first = min(2 * float(each.q[0] - each.edges[0]) for each in directions)
    return _binned(q, C, width, overlap, h_rms, first)


def _binned(
    q: FloatArray,
    C: FloatArray,
    width: FloatArray,
    overlap: FloatArray,
    h_rms: float,
    unit: float,
) -> _Traces:
    rising = np.argsort(q, kind="stable")
    q, C, width, overlap = (each[rising] for each in (q, C, width, overlap))
    edges, bin_of = _bins(q, unit)
    return _Traces(q, C, width, overlap, edges, bin_of, h_rms)


def _fine(edges: FloatArray) -> FloatArray:
    """Ends of panels between nodes, evenly spaced in ln q."""
    place = np.arange(PANELS * (edges.size - 1) + 1) / PANELS
    return np.exp(np.interp(place, np.arange(edges.size), np.log(edges)))


def _kernel(traces: _Traces) -> FloatArray:
    """Mean C_1D of each bin for C = 1 on each panel."""
    bins = np.arange(traces.edges.size - 1)
    starts = np.searchsorted(traces.bin_of, bins)
    sums = _panel_sums(_fine(traces.edges), traces.q, traces.width, starts)
    return sums / traces.sums(1.0)[:, None]


def _spectrum_at_nodes(
    traces: _Traces,
    kernel: FloatArray,
    measured: tuple[FloatArray, float, float],
    near: FloatArray | None = None,
) -> FloatArray:
    """C of the isotropic surface at the edges of bins.

    `measured` are the mean C_1D of bins, h_rms and gradient; `near` is a C to start from.
    """
    mean, h_rms, gradient = measured
    edges = traces.edges
    squares = (h_rms**2, gradient**2)
    fine = _fine(edges)
    return _isotropic(edges, fine, mean, traces.independent, kernel, squares, near)


def _history(traces: Sequence[Treated], notes: Sequence[dict[str, Any]]) -> Provenance:
    """All steps: reading and treatment of the first trace, the other traces, and notes."""
    if len(traces) == 1:
        return traces[0].history(*notes)
    others = {
        "step": "traces",
        "of": [list(trace.history()) for trace in traces[1:]],
        "told": f"mean of {len(traces)} traces, each by its length",
    }
    return traces[0].history(others, *notes)


def _directions(directions: Sequence[_Traces], isotropic: bool) -> list[dict[str, Any]]:
    """Note on what is known of the lay."""
    if len(directions) > 1:
        ratio = _anisotropy(directions)
        description = f"gradients along and across differ by a factor of {ratio:.3g}"
        return [{"step": "directions", "anisotropy": ratio, "told": description}]
    if isotropic:
        return [{"step": "directions", "assumed": [ISOTROPIC]}, *_lay(directions[0])]
    return [{"step": "directions", "not_valid": ONE_DIRECTION}]


def _lay(traces: _Traces) -> list[dict[str, Any]]:
    """Note on more power at one wavelength than traces of an isotropic surface can have.

    A trace crosses waves at all angles: of waves of one length, the share 1 - (2/pi)
    asin(q/q') appears at wavenumbers from q to their own q', and less of all other spectra.
    """
    powers = np.append(0.0, np.cumsum(traces.C * traces.width))
    overlap = float(traces.overlap.max())
    for band in BANDS:
        first = np.searchsorted(traces.q, traces.q * (1 - band))
        end = np.searchsorted(traces.q, traces.q * (1 + band), side="right")
        count = (end - first) / overlap
        share = (powers[end] - powers[first]) / powers[-1]
        of_ring = 1 - 2 / math.pi * math.asin((1 - band) / (1 + band))
        most = of_ring * (1 + BEYOND / np.sqrt(count))
        excess = np.where(end - first >= IN_BAND, share / most, 0.0)
        peak = int(excess.argmax())
        if excess[peak] > 1:
            why = (
                f"{share[peak]:.0%} of the traces' height variance lies within {band:.0%} of "
                f"one wavenumber, of an isotropic surface {of_ring:.0%} at most: the "
                "surface has a lay, as turned ones have, and "
                "Surface.from_profile(..., across=[...]) takes traces at right angles"
            )
            return [{"step": "lay", "share": float(share[peak]), "not_valid": why}]
    return []


def _anisotropy(directions: Sequence[_Traces]) -> float | None:
    """Root of the ratio of mean squared slopes in two directions; None of one direction."""
    if len(directions) == 1:
        return None
    one, other = (each.gradient for each in directions)
    return max(one, other) / min(one, other)


def _of_slopes(traces: Sequence[Treated]) -> list[dict[str, Any]]:
    """Note on slopes unlike those of Gaussian surfaces."""
    slopes = np.concatenate([np.diff(each.heights) / each.steps[0] for each in traces])
    slopes = slopes - slopes.mean()
    kurtosis = float(np.mean(slopes**4) / np.mean(slopes**2) ** 2)
    low, high = BY_SPECTRUM["kurtosis of slopes"]
    if low <= kurtosis <= high:
        return []
    why = (
        f"the kurtosis of slopes along the line is {kurtosis:.3g}, tested from {low:g} to "
        f"{high:g}: measure a map, Surface.from_map(map)"
    )
    return [{"step": "slopes", "kurtosis": kurtosis, "not_valid": why}]


def _few_waves(surface: SpectralSurface, length: float) -> list[dict[str, Any]]:
    """Note on traces that hold few of the longest wavelengths."""
    waves = length * surface.longest / (2 * math.pi)
    if waves >= MIN_WAVES:
        return []
    why = (
        f"the traces hold {waves:.3g} of the longest wavelengths, fewer than "
        f"{MIN_WAVES:g}: measure a longer trace, or several: "
        "Surface.from_profile([trace, trace, ...])"
    )
    return [{"step": "few wavelengths", "waves": waves, "not_valid": why}]


def _share_of_longest(traces: _Traces, count: int) -> float:
    """Share of the variance in the longest wavelengths of `count` traces."""
    longest = slice(LONGEST * count)
    powers = traces.C * traces.width
    return float(powers[longest].sum() / powers.sum())


def _accuracy(traces: _Traces, high: float) -> dict[str, Any]:
    """Note on the standard errors of h_rms and gradient."""
    # powers are exponentially distributed: the mean of squares is twice the square of the
    # mean
    is_measured = traces.q <= high * (1 + 1e-9)
    powers = (traces.C * traces.width)[is_measured]
    slopes = (traces.slopes * traces.width)[is_measured]
    of_height = _relative_error(powers)
    of_gradient = math.sqrt(float(traces.overlap.max())) * _relative_error(slopes)
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
    return math.sqrt(powers @ powers / 2) / float(powers.sum()) / 2


def _without_roll_off(share: float) -> dict[str, Any]:
    """Note that the longest wavelengths have a large share of the variance."""
    description = (
        f"the {LONGEST} longest wavelengths of the trace hold {share:.0%} of its "
        "variance: h_rms grows with its length, its error is larger than stated, and "
        "heights are taken as Gaussian"
    )
    why = f"{description}: measure longer traces, or give a long_cutoff"
    return {"step": "no roll-off", "share": share, "told": description, "not_valid": why}


def _panel_sums(
    fine: FloatArray, q: FloatArray, width: FloatArray, starts: NDArray[np.intp]
) -> FloatArray:
    """C_1D times dq for C = 1 on each panel, summed over the wavenumbers of each bin.

    Bins begin at `starts`.
    """
    sums = np.zeros((starts.size, fine.size - 1))
    ends = [*starts.tolist(), q.size]
    for bin_, (start, stop) in enumerate(itertools.pairwise(ends)):
        # a wave appears at lower wavenumbers only: panels below the bin have no share
        lowest = max(int(np.searchsorted(fine, q[start])) - 1, 0)
        squared_ends = fine[lowest:] ** 2
        for first in range(start, stop, BLOCK):
            part = slice(first, min(first + BLOCK, stop))
            block = q[part, None]
            # the integral of q' dq'/sqrt(q'^2 - q^2)
            roots = np.sqrt(np.maximum(squared_ends - block**2, 0))
            sums[bin_, lowest:] += width[part] @ np.diff(4 * np.pi * roots, axis=1)
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
    squares: Sequence[float],
    near: FloatArray | None,
) -> FloatArray:
    """C at the edges of bins [length^4], h_rms^2 = 2 pi integral C q dq.

    `fine` are the ends of panels, `mean` is C_1D of each bin, `count` its independent
    components, `kernel` its C_1D for C = 1 on each panel, `squares` are the mean squares of
    height and gradient where they are known, `near` is a C to start from.
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
    every = [np.pi * np.diff(fine**2), np.pi / 2 * np.diff(fine**4)]
    sums = np.stack(every)[: len(squares)]
    log_squares = np.log(np.asarray(squares, float))
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

    if near is None:
        # of the right size to start from: C_1D/(2 pi q)
        middles = np.sqrt(edges[1:] * edges[:-1])[has_power]
        log_start = np.log(mean[has_power] / (2 * np.pi * middles))
        start = np.interp(log_q, np.log(middles), log_start)
    else:
        start = np.log(near)
    fitted = least_squares(deviations, start, jac=jacobian)
    return np.asarray(np.exp(fitted.x))


def isotropic_spectrum(q: FloatArray, C_1D: FloatArray) -> FloatArray:
    """C [length^4] at wavenumbers of the surface whose traces have a spectrum C_1D there.

    Beyond the last one C is continued.
    """
    if q.size < MIN_NODES + 1:
        raise InputError(
            f"a spectrum of traces of {q.size} wavenumbers: needed are at least "
            f"{MIN_NODES + 1}"
        )
    # lengths of order one, so that powers neither underflow nor overflow
    x = q / q[0]
    values = C_1D / C_1D[0]
    end = CONTINUED * x[-1]
    count = max(MIN_NODES, math.ceil(PER_DECADE * math.log10(end)))
    edges = np.geomspace(1.0, end, count + 1)
    fine = _fine(edges)
    kernel = _panel_sums(fine, x, np.ones(x.size), np.arange(x.size))
    log_x = np.log(x)
    last = max(math.log(x[-1]) - math.log(10) / 2, 0.0)
    (steep,) = np.diff(np.interp([last, log_x[-1]], log_x, np.log(values)))
    steep = min(steep / (log_x[-1] - last), 0.0)
    beyond = np.maximum(np.log(edges) - log_x[-1], 0.0)
    log_start = np.interp(np.log(edges), log_x, np.log(values)) + steep * beyond
    start = np.exp(log_start) / (2 * np.pi * edges)
    samples = np.full(x.size, AVERAGED)
    nodes = _isotropic(edges, fine, values, samples, kernel, (), start)
    C = np.exp(np.interp(log_x, np.log(edges), np.log(nodes)))
    return np.asarray(C * C_1D[0] / q[0])


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
        "one direction cannot tell anisotropy: across a lay the gradient is up to sqrt(2) "
        "times too large, along it too small. The highest point is a line's: a Gaussian "
        f"square of its length reaches about {level:.1f} h_rms"
    )
    return {"step": "unseen", "h_max": level, "told": description}
