"""Statistics of a height map: bearing curve, gradients of its highest parts, anisotropy, radial spectrum."""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray

FRACTIONS = np.logspace(-4.5, 0, 91)  # shares of the map, from the highest point downward
MIN_TOP_POINTS = 16  # gradients are averaged over at least so many points
QUANTILES = 1 - np.concatenate(
    [[0], np.logspace(-5, -1, 61)[:-1], np.linspace(0.1, 1, 139)]
)
BANDS = 40
# share of the larger eigenvalue of a gradient tensor: a smaller one is rounding, as for
# ridges
RESOLVED = 1e-14
# <|w|> and <|w|^4>/3 of Gaussian gradients w of unit variance: of ridges along one axis,
# else along both
RIDGES, BOTH = (np.sqrt(2 / np.pi), 1.0), (np.sqrt(np.pi / 2), 8 / 3)


@dataclasses.dataclass(frozen=True, eq=False)
class RadialSpectrum:
    """Height variance by bands of wavenumber, shape (BANDS,)."""

    # of each band, the root of mean q^2 weighted by variance [1/length]; NaN for an empty
    # band
    q: FloatArray
    variance: FloatArray  # contribution of the band to m0 [length^2]


@dataclasses.dataclass(frozen=True, eq=False)
class Bearing:
    """Curves, shape (91,), and numbers of a map that contact depends on; lengths in the map's unit."""

    h_rms: float
    h_max: float  # above the mean
    gradient: float  # rms in two dimensions
    # heights below which shares `QUANTILES` of the map lie, highest first, shape (200,)
    quantiles: FloatArray
    # M(a), mean height of the highest fraction a of the map, a = `FRACTIONS`
    mean_height: FloatArray
    # (2/sqrt(pi)) <|w|>/sqrt(2) over the same highest parts, w the gradient whitened by its
    # own tensor: 1 if Gaussian. Of ridges, where w has one component, sqrt(pi/2) <|w|>
    top_gradient: FloatArray
    # mean pressures F at which full contact is tensile on shares `FRACTIONS` of the map,
    tension_force: FloatArray
    tension: FloatArray  # and the mean tension then, <max(-p, 0)> over the whole map [E*]
    # root of the ratio of the gradient tensor's eigenvalues, 1 to 1e7, which stands for
    # ridges
    anisotropy: float
    slope_kurtosis: float  # (3/8) <|w|^4>, of ridges <|w|^4>: 3 if Gaussian


def wavevectors(
    shape: tuple[int, ...], sizes: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    """Wavevectors of the real transform of a periodic map [1/length]."""
    qx = np.asarray(
        2 * np.pi / sizes[0] * np.fft.fftfreq(shape[0], 1 / shape[0])[:, None], float
    )
    qy = np.asarray(
        2 * np.pi / sizes[1] * np.fft.rfftfreq(shape[1], 1 / shape[1])[None, :], float
    )
    return qx, qy


def half_plane_weights(shape: tuple[int, ...]) -> FloatArray:
    """Number of wavevectors represented by each column of the real transform."""
    # the first and, of an even number, the last column are their own conjugates
    return np.where(2 * np.arange(shape[1] // 2 + 1) % shape[1] == 0, 1.0, 2.0)


def radial_bands(
    heights: FloatArray, sizes: tuple[float, float]
) -> tuple[FloatArray, FloatArray, NDArray[np.intp]]:
    """Of every wavevector of a periodic map: variance, wavenumber, and its band, from 1 to BANDS, 0 below them."""
    q = np.hypot(*wavevectors(heights.shape, sizes))
    power = np.abs(np.fft.rfft2(heights) / heights.size) ** 2 * half_plane_weights(
        heights.shape
    )
    power[0, 0] = 0.0
    lit = power > 1e-20 * power.max()
    power[~lit] = 0.0
    edges = np.geomspace(q[lit].min() * (1 - 1e-9), q[lit].max() * (1 + 1e-9), BANDS + 1)
    return power, q, np.searchsorted(edges, q)


def band_sums(values: FloatArray, band: NDArray[np.intp]) -> FloatArray:
    """Sums over the wavevectors of each band."""
    return np.bincount(band.ravel(), values.ravel(), BANDS + 2)[1:-1].astype(float)


def radial_spectrum(heights: FloatArray, sizes: tuple[float, float]) -> RadialSpectrum:
    """Variance of a periodic map by logarithmic bands of wavenumber."""
    power, q, band = radial_bands(heights, sizes)
    variance = band_sums(power, band)
    with np.errstate(invalid="ignore"):
        return RadialSpectrum(np.sqrt(band_sums(power * q**2, band) / variance), variance)


def bearing(
    heights: FloatArray, sizes: tuple[float, float], part: tuple[slice, ...] = ()
) -> Bearing:
    """Curves of a periodic map; its mean is taken off, gradients are spectral.

    If all but a `part` are mirror images, gradients are of that part: images hide a lay at
    an angle to the axes.
    """
    whole = heights - heights.mean()
    qx, qy = wavevectors(whole.shape, sizes)
    transform = np.fft.rfft2(whole)
    values = whole[part]
    stiffness = np.hypot(qx, qy) / 2
    for q, count in zip((qx, qy), whole.shape, strict=True):
        if count % 2 == 0:
            # the shortest wavelength has no slope at its points
            q.flat[count // 2] = 0.0
    slopes = np.stack(
        [np.fft.irfft2(1j * q * transform, s=whole.shape)[part].ravel() for q in (qx, qy)]
    )
    tensor = slopes @ slopes.T / values.size
    eigenvalues, directions = np.linalg.eigh(tensor)
    mean_norm, fourth = BOTH if eigenvalues[0] > RESOLVED * eigenvalues[1] else RIDGES
    eigenvalues = np.maximum(eigenvalues, RESOLVED * eigenvalues[1])
    whitened = np.hypot(*(directions.T @ slopes / np.sqrt(eigenvalues)[:, None]))
    order = np.argsort(values, axis=None)[::-1]
    ordered = values.ravel()[order]
    count = np.arange(1, values.size + 1)
    share = count / values.size
    first = min(MIN_TOP_POINTS, values.size) - 1
    tops = np.cumsum(whitened[order]) / count / mean_norm
    # pressures of full contact, E* |q| h_q/2, about their mean; lowest first
    full = np.sort(np.fft.irfft2(transform * stiffness, s=whole.shape)[part], axis=None)
    pull = (np.cumsum(full) - full * count) / values.size
    return Bearing(
        float(values.std()),
        float(ordered[0]),
        float(np.sqrt(np.trace(tensor))),
        np.interp(1 - QUANTILES, (count - 1) / (values.size - 1), ordered),
        np.interp(FRACTIONS, share, np.cumsum(ordered) / count),
        np.interp(np.maximum(FRACTIONS, share[first]), share, tops),
        np.interp(FRACTIONS, share, -full),
        np.interp(FRACTIONS, share, -pull),
        float(np.sqrt(eigenvalues[1] / eigenvalues[0])),
        float(np.mean(whitened**4) / fourth),
    )
