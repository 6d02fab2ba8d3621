"""Line scans: the isotropic surface of a measured profile.

A profile's spectrum C_1D, with h_rms^2 = integral C_1D dq/pi, follows from the isotropic one:
C_1D(q) = 4 pi integral from q of C q' dq'/sqrt(q'^2 - q^2), an Abel transform. Its inverse is sought as a power law
between nodes, as straight in its logarithms as the scatter of the measurement allows, with the profile's variance of
height and gradient.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError
from mbma_tables.surfaces.heights import Heights, one_height
from mbma_tables.surfaces.power_laws import PowerLaws
from mbma_tables.surfaces.spectral import SpectralSurface
from mbma_tables.surfaces.treatment import MIN_POWER, Treated

PER_DECADE = 10  # nodes of the spectrum
PANELS = 8  # between two nodes
STRAIGHT = 1.0  # standard deviation of the change of slope, d ln C/d ln q, from node to node
HELD = 1e3  # weight of height variance and gradient, which are met to 1e-5
OVERLAP = 35 / 18  # Fourier components under a Hann window that count as one independent component
END = 1e-3  # share of the squared gradient in the wavelengths above the surface's last
LONGEST, ROLLED_OFF = 4, 0.5  # longest wavelengths of a trace: with half of the variance there is no roll-off
MIN_NODES = 5


@dataclasses.dataclass(frozen=True, eq=False)
class ProfileSpectrum:
    """A line scan's spectrum in n bins, and what follows from it."""

    edges: FloatArray  # wavenumbers between bins, shape (n + 1,) [1/length]
    mean: FloatArray  # C_1D of each bin [length^3],
    count: FloatArray  # and its number of Fourier components
    kernel: FloatArray  # C_1D of each bin for C = 1 on each panel, shape (n, PANELS n)
    h_rms: float  # of the surface, if isotropic [length],
    gradient: float
    h_rms_error: float  # and relative standard errors, if Gaussian
    gradient_error: float
    longest: float  # share of the height variance in the LONGEST longest wavelengths

    @classmethod
    def of(cls, treated: Treated) -> ProfileSpectrum:
        """The spectrum of a treated line scan; errors are those of the wavelengths kept."""
        heights, step = treated.heights, treated.steps[0]
        length = heights.size * step
        unit = 2 * math.pi / length
        transform = step * np.fft.rfft(treated.windowed())
        last = (heights.size - 1) // 2
        q, C = unit * np.arange(1, last + 1), np.abs(transform[1 : last + 1]) ** 2 / length
        overlap = 1.0 if treated.plain else OVERLAP
        low, high = treated.waves
        held = q >= low * (1 - 1e-9)
        if held.any():
            # beyond the surface's end there is only rounding and spectral leakage
            rest = np.cumsum((C * q**2 * held)[::-1])[::-1]
            held &= rest > END * rest[0]
        q, C = q[held], C[held]
        bins = math.ceil(PER_DECADE * math.log10(q[-1] / q[0])) if q.size > 1 else 0
        if bins < MIN_NODES:
            raise InputError(f"the line scan holds {q.size} wavelengths: too few for a spectrum")
        edges = np.geomspace(q[0] - unit / 2, q[-1] + unit / 2, bins + 1)
        filled = np.unique(np.searchsorted(edges, q, side="right") - 1)
        edges = np.append(edges[filled], edges[-1])
        number = np.searchsorted(edges, q, side="right") - 1
        count = np.bincount(number).astype(float)
        sides = 4 * np.pi * np.sqrt(np.maximum(_panels(edges) ** 2 - q[:, None] ** 2, 0))
        kernel = np.add.reduceat(np.diff(sides, axis=1), np.searchsorted(number, np.arange(count.size)), axis=0)
        slopes, kept = C * q**2, q <= high * (1 + 1e-9)
        # powers are exponentially distributed: the mean of squares is twice the square of the mean
        errors = [math.sqrt(each @ each / 2) / each.sum() / 2 for each in (C[kept], slopes[kept])]
        return cls(
            edges,
            np.bincount(number, C) / count,
            count / overlap,
            kernel / count[:, None],
            float(heights.std()),
            math.sqrt(2 * slopes.sum() * unit / np.pi),
            errors[0],
            math.sqrt(overlap) * errors[1],
            float(C[:LONGEST].sum() / C.sum()),
        )

    def isotropic(self) -> FloatArray:
        """C at the edges [length^4], h_rms^2 = 2 pi integral C q dq."""
        from scipy.optimize import least_squares
        from scipy.special import digamma

        log_q, fine = np.log(self.edges), _panels(self.edges)
        middle = np.log(fine[1:] * fine[:-1]) / 2
        between = np.stack([np.interp(middle, log_q, row) for row in np.eye(log_q.size)], axis=1)
        independent = np.maximum(self.count, 1.0)
        # bins without power, as for a square profile, are omitted
        lit = self.mean > MIN_POWER * self.mean.max()
        weight, mean = np.sqrt(independent) * lit, np.where(lit, self.mean, 1.0)
        # the logarithm of a mean of few samples is biased low
        wanted = np.log(mean) - digamma(independent) + np.log(independent)
        bend = np.diff(np.diff(np.eye(log_q.size), axis=0) / np.diff(log_q)[:, None], axis=0) / STRAIGHT
        sums = np.stack([np.pi * np.diff(fine**2), np.pi / 2 * np.diff(fine**4)])
        totals = np.log([self.h_rms**2, self.gradient**2])

        def deviations(log_C: FloatArray) -> FloatArray:
            C = np.exp(between @ log_C)
            seen, held = np.log(self.kernel @ C) - wanted, np.log(sums @ C) - totals
            return np.concatenate([weight * seen, bend @ log_C, HELD * held])

        def jacobian(log_C: FloatArray) -> FloatArray:
            C = np.exp(between @ log_C)
            seen = (self.kernel * C) @ between / (self.kernel @ C)[:, None]
            held = (sums * C) @ between / (sums @ C)[:, None]
            return np.vstack([weight[:, None] * seen, bend, HELD * held])

        middles = np.sqrt(self.edges[1:] * self.edges[:-1])
        start = np.interp(log_q, np.log(middles[lit]), np.log(mean[lit] / (2 * np.pi * middles[lit])))
        return np.asarray(np.exp(least_squares(deviations, start, jac=jacobian).x))


def _panels(edges: FloatArray) -> FloatArray:
    """Ends of the panels between nodes, evenly spaced in ln q."""
    place = np.arange(PANELS * (edges.size - 1) + 1) / PANELS
    return np.asarray(np.exp(np.interp(place, np.arange(edges.size), np.log(edges))))


def measured_profile(treated: Treated, h_max: Any) -> SpectralSurface:
    """The isotropic surface of a treated line scan; see `Surface.from_profile`."""
    # lengths of order one, so that their powers neither underflow nor overflow
    scale = float(np.abs(treated.heights).max())
    steps, waves = (treated.steps[0] / scale,), (scale * treated.waves[0], scale * treated.waves[1])
    scaled = dataclasses.replace(treated, heights=treated.heights / scale, steps=steps, waves=waves)
    # oblique wavelengths appear longer along the line: the cut-off applies to the spectrum, not to the trace
    uncut = scaled.heights if treated.uncut is None else treated.uncut / scale
    found = ProfileSpectrum.of(dataclasses.replace(scaled, heights=uncut))
    heights = Heights.of(scaled.heights)
    if found.longest > ROLLED_OFF:
        # the distribution needs more than a few wavelengths
        heights = Heights.gaussian(found.h_rms, heights.h_max)
    end = min(waves[1], float(found.edges[-1]))
    q = np.append(found.edges[found.edges < end], end)
    surface = SpectralSurface(
        q,
        PowerLaws(found.edges, found.isotropic()).at(q),
        None if h_max is None else one_height(h_max) / scale,
        heights,
        samples=np.interp(np.log(q), np.log(found.edges[:-1]), found.count),
    ).scaled(scale, treated.unit)
    notes = _limits(found, steps[0] * scaled.heights.size)
    return dataclasses.replace(surface, provenance=treated.history(*notes))


def _limits(found: ProfileSpectrum, length: float) -> tuple[dict[str, Any], ...]:
    """Notes on the accuracy of a single trace and on what it does not determine."""
    errors = (
        f"h_rms is known to {found.h_rms_error:.1%} and the rms gradient to {found.gradient_error:.1%} (one standard "
        "error, of a Gaussian surface)"
    )
    # expected Euler characteristic of a Gaussian square above the level: one summit left
    waves = length * found.gradient / math.sqrt(2) / found.h_rms
    level = math.sqrt(2 * math.log(max(waves**2 / (2 * math.pi) ** 1.5, 2.0)))
    level = math.sqrt(2 * math.log(max(level * waves**2 / (2 * math.pi) ** 1.5, 2.0)))
    unseen = (
        "one trace cannot tell anisotropy: across a lay the gradient is up to sqrt(2) times too large, along it too "
        f"small. Its highest point is a line's: a Gaussian square of its length reaches about {level:.1f} h_rms"
    )
    notes = [
        {"step": "errors", "h_rms": found.h_rms_error, "rms_gradient": found.gradient_error, "told": errors},
        {"step": "unseen", "h_max": level, "told": unseen},
    ]
    if found.longest > ROLLED_OFF:
        told = (
            f"the {LONGEST} longest wavelengths of the trace hold {found.longest:.0%} of its variance: "
            "h_rms grows with its length, its error is larger than stated, and heights are taken as Gaussian"
        )
        notes.append({"step": "no roll-off", "share": found.longest, "told": told})
    return tuple(notes)
