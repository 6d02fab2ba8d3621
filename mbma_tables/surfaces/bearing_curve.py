"""Statistics of a height map: bearing curve, highest parts, anisotropy, radial spectrum."""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray

FRACTIONS = np.logspace(-4.5, 0, 91)  # shares of the map, from the highest point downward
# shares of the map below a height: finer near its highest points
QUANTILES = 1 - np.concatenate(
    [[0], np.logspace(-5, -1, 61)[:-1], np.linspace(0.1, 1, 139)]
)
BANDS = 40


@dataclasses.dataclass(frozen=True, eq=False)
class RadialSpectrum:
    """Height variance by bands of wavenumber, shape (BANDS,)."""

    # of each band, the root of mean q^2 weighted by variance [1/length]; NaN for an empty
    # band
    q: FloatArray
    variance: FloatArray  # contribution of the band to m0 [length^2]


@dataclasses.dataclass(frozen=True, eq=False)
class Bearing:
    """Curves, shape (91,), and numbers of a map that contact depends on.

    Lengths are in the map's unit.
    """

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
    waves_x = np.fft.fftfreq(shape[0], 1 / shape[0])[:, None]
    waves_y = np.fft.rfftfreq(shape[1], 1 / shape[1])[None, :]
    qx = np.asarray(2 * np.pi / sizes[0] * waves_x, float)
    qy = np.asarray(2 * np.pi / sizes[1] * waves_y, float)
    return qx, qy


def half_plane_weights(shape: tuple[int, ...]) -> FloatArray:
    """Number of wavevectors represented by each column of the real transform."""
    column = np.arange(shape[1] // 2 + 1)
    # the first and, of an even number, the last column are their own conjugates
    is_own_conjugate = 2 * column % shape[1] == 0
    return np.where(is_own_conjugate, 1.0, 2.0)


def radial_bands(
    heights: FloatArray, sizes: tuple[float, float]
) -> tuple[FloatArray, FloatArray, NDArray[np.intp]]:
    """Variance, wavenumber and band of every wavevector of a periodic map.

    Bands are numbered from 1 to BANDS; 0 is below them.
    """
    qx, qy = wavevectors(heights.shape, sizes)
    q = np.hypot(qx, qy)
    amplitude = np.abs(np.fft.rfft2(heights) / heights.size)
    power = amplitude**2 * half_plane_weights(heights.shape)
    # the mean of the map is no roughness
    power[0, 0] = 0.0
    # less than that of the strongest wavevector is rounding
    has_power = power > 1e-20 * power.max()
    power[~has_power] = 0.0
    # a little wider than the wavevectors, so that none lies on an end
    lowest = q[has_power].min() * (1 - 1e-9)
    highest = q[has_power].max() * (1 + 1e-9)
    edges = np.geomspace(lowest, highest, BANDS + 1)
    return power, q, np.searchsorted(edges, q)


def band_sums(values: FloatArray, band: NDArray[np.intp]) -> FloatArray:
    """Sums over the wavevectors of each band."""
    sums = np.bincount(band.ravel(), values.ravel(), BANDS + 2)
    return sums[1:-1].astype(float)


def radial_spectrum(heights: FloatArray, sizes: tuple[float, float]) -> RadialSpectrum:
    """Variance of a periodic map by logarithmic bands of wavenumber."""
    power, q, band = radial_bands(heights, sizes)
    variance = band_sums(power, band)
    # an empty band has no wavenumber
    with np.errstate(invalid="ignore"):
        mean_square = band_sums(power * q**2, band) / variance
        return RadialSpectrum(np.sqrt(mean_square), variance)


def bearing(
    heights: FloatArray, sizes: tuple[float, float], part: tuple[slice, ...] = ()
) -> Bearing:
    """Curves of a periodic map; its mean is taken off, gradients are spectral.

    If all but a `part` are mirror images, gradients are of that part: images hide a lay at
    an angle to the axes.
    """
    whole = heights - heights.mean()
    values = whole[part]
    qx, qy = wavevectors(whole.shape, sizes)
    transform = np.fft.rfft2(whole)
    half_q = np.hypot(qx, qy) / 2
    # pressures of full contact, E* |q| h_q/2
    full_pressure = np.fft.irfft2(transform * half_q, s=whole.shape)[part]
    slopes = _slopes(transform, qx, qy, whole.shape, part)
    whitened, anisotropy, gradient, is_ridged = _whitened(slopes)
    # <|w|> and <|w|^4>/3 of Gaussian gradients w of unit variance: of ridges along one
    # axis, else along both
    mean_norm = np.sqrt(2 / np.pi) if is_ridged else np.sqrt(np.pi / 2)
    fourth = 1.0 if is_ridged else 8 / 3

    falling = np.argsort(values, axis=None)[::-1]
    ordered = values.ravel()[falling]
    count = np.arange(1, values.size + 1)
    share = count / values.size
    share_below = (count - 1) / (values.size - 1)
    mean_heights = np.cumsum(ordered) / count
    mean_gradients = np.cumsum(whitened[falling]) / count / mean_norm
    # gradients are averaged over at least 16 points, fewer scatter too much
    first = min(16, values.size) - 1
    averaged_shares = np.maximum(FRACTIONS, share[first])
    # pressures about their mean, lowest first
    lowest_first = np.sort(full_pressure, axis=None)
    pull = (np.cumsum(lowest_first) - lowest_first * count) / values.size
    return Bearing(
        h_rms=float(values.std()),
        h_max=float(ordered[0]),
        gradient=gradient,
        quantiles=np.interp(1 - QUANTILES, share_below, ordered),
        mean_height=np.interp(FRACTIONS, share, mean_heights),
        top_gradient=np.interp(averaged_shares, share, mean_gradients),
        tension_force=np.interp(FRACTIONS, share, -lowest_first),
        tension=np.interp(FRACTIONS, share, -pull),
        anisotropy=anisotropy,
        slope_kurtosis=float(np.mean(whitened**4) / fourth),
    )


def _slopes(
    transform: NDArray[np.complex128],
    qx: FloatArray,
    qy: FloatArray,
    shape: tuple[int, ...],
    part: tuple[slice, ...],
) -> FloatArray:
    """Both components of the gradient at the points of a part, shape (2, n)."""
    slopes = []
    for q, count in zip((qx, qy), shape, strict=True):
        if count % 2 == 0:
            # the shortest wavelength has no slope at its points
            q.flat[count // 2] = 0.0
        slope = np.fft.irfft2(1j * q * transform, s=shape)
        slopes.append(slope[part].ravel())
    return np.stack(slopes)


def _whitened(slopes: FloatArray) -> tuple[FloatArray, float, float, bool]:
    """|w| of gradients whitened by their tensor; anisotropy, rms, whether all are ridges."""
    tensor = slopes @ slopes.T / slopes.shape[1]
    eigenvalues, directions = np.linalg.eigh(tensor)
    # share of the larger eigenvalue: a smaller one is rounding, as for ridges
    least = 1e-14 * eigenvalues[1]
    is_ridged = not eigenvalues[0] > least
    eigenvalues = np.maximum(eigenvalues, least)
    first, second = directions.T @ slopes / np.sqrt(eigenvalues)[:, None]
    anisotropy = float(np.sqrt(eigenvalues[1] / eigenvalues[0]))
    gradient = float(np.sqrt(np.trace(tensor)))
    return np.hypot(first, second), anisotropy, gradient, is_ridged
