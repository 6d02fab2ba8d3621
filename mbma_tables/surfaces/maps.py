"""Surfaces from what was measured: spectra in three conventions, and height maps.

Reading map files is SurfaceTopography's job (the extra `maps`); nothing else here needs it.
"""

from __future__ import annotations

import dataclasses
import math
import os
import warnings
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.arguments import FloatArray, finite_array, require
from mbma_tables.errors import InputError, MbmaError, NotSelfAffineError
from mbma_tables.surfaces.psd import SpectrumFit, fit_surface
from mbma_tables.surfaces.surface import Surface

__all__ = ["SpectrumFit", "radial_spectrum", "read_map", "surface_from_map", "surface_from_psd"]

CONVENTIONS = ("paper", "isotropic", "profile")
DETRENDS = {"mean": 0, "plane": 1, "quadratic": 2}
SMALLEST, LARGEST = 1e-30, 1e30  # lengths in their unit: fourth powers of them, which C has, keep their digits
LEAST_GRID = 32  # points along each side: 16 wavenumbers, of which a window spoils the first
RINGS = 8  # per grid step in wavenumber: narrow enough that C hardly changes across a ring
WINDOW_REACH = 2.0  # half-width of a Hann window's main lobe, in grid steps: closer to q = 0 it mixes with the mean
WINDOW_OVERLAP = (35 / 18) ** 2  # waves under that window that carry what one independent wave does
LEAST_POWER = 1e-24  # of the strongest wave: below it rounding, not a measured wave
LARGEST_KURTOSIS = (
    50.0  # all slopes on 2% of the points; Gaussian surfaces have 3, worn or scratched ones up to 10 or 20
)
LARGEST_ANISOTROPY = 0.3  # of a cosine around the circle: four times the power one way than across it


def check_band(band: Any, low: float, high: float) -> tuple[float, float] | None:
    """A forced band as two numbers inside [low, high], the range that the measurement holds."""
    if band is None:
        return None
    pair = finite_array("band", band)
    if pair.shape != (2,) or not pair[0] < pair[1]:
        raise InputError(f"band must be two wavenumbers (q_low, q_high) with q_low < q_high, got {band!r}")
    good = (pair >= low * (1 - 1e-9)) & (pair <= high * (1 + 1e-9))
    require("band", pair, good, f"within the measured range [{low:.6g}, {high:.6g}]")
    return float(pair[0]), float(pair[1])


def check_height(h_max: Any) -> float:
    """h_max as one positive number."""
    height = finite_array("h_max", h_max)
    if height.shape != ():
        raise InputError(f"h_max must be one number, got shape {height.shape}")
    require("h_max", height, height > 0, "positive")
    return float(height)


def surface_from_psd(
    q: ArrayLike,
    C: ArrayLike,
    *,
    h_max: float,
    convention: str = "paper",
    band: tuple[float, float] | None = None,
) -> Surface:
    """The self-affine surface fitted to a power spectrum.

    Parameters
    ----------
    q : array_like, shape (n,)
        Wavenumber, 1/length, positive; in any order and spacing.
    C : array_like, shape (n,)
        Spectrum [length^4; a profile's length^3], not negative. Zeros at either end say where it ends;
        entries that a masked array hides are left out.
    h_max : float
        Height of the highest point above the mid-plane [length].
    convention : {"paper", "isotropic", "profile"}, optional
        h_rms^2 = 2 pi integral C q dq (Eqs. 4-6), = integral C q dq / (2 pi), or = integral C dq / pi.
    band : tuple of float, optional
        (q0, q1) to fit and to take, as a plain power law; else a roll-off below and a departure above are found
        and left out.

    Returns
    -------
    Surface
        With `fit`, a `SpectrumFit`. Its h_rms is that of the fitted law between q0 and q1.

    Raises
    ------
    InputError, OutOfRangeError
        For input that is no spectrum.
    NotSelfAffineError
        Where no power law with 0 < H <= 1 describes it; the message has the numbers.

    Notes
    -----
    C_1D of Eq. (6) is 2 pi B(H + 1/2, 1/2) q C(q), exactly so where q1 is infinite; towards q1 it drops (by 7%
    at q1/2, to zero at q1). Where that drop describes the spectrum better than a plain power law it is fitted
    too; the surface's q1 is where it ends if that is within 1.25 of the largest wavenumber, which else is q1.
    A profile mixes long waves with longer ones, so its roll-off is placed to a factor of 1.5 only.
    """
    if convention not in CONVENTIONS:
        raise InputError(f"convention must be one of {', '.join(CONVENTIONS)}, got {convention!r}")
    height = check_height(h_max)
    if np.ma.isMaskedArray(q) or np.ma.isMaskedArray(C):
        if np.shape(q) != np.shape(C):
            raise InputError(f"q and C must be of one length, got shapes {np.shape(q)} and {np.shape(C)}")
        shown = ~(np.ma.getmaskarray(np.ma.asanyarray(q)) | np.ma.getmaskarray(np.ma.asanyarray(C)))
        q, C = np.asarray(q)[shown], np.asarray(C)[shown]
    wavenumber, spectrum = finite_array("q", q), finite_array("C", C)
    if wavenumber.ndim != 1 or wavenumber.shape != spectrum.shape:
        raise InputError(
            f"q and C must be one-dimensional and of one length, got {wavenumber.shape} and {spectrum.shape}"
        )
    require("q", wavenumber, wavenumber > 0, "positive (leave q = 0 out)")
    require("q", wavenumber, (wavenumber >= SMALLEST) & (wavenumber <= LARGEST), "in [1e-30, 1e30]")
    require("C", spectrum, spectrum >= 0, "zero or positive")
    order = np.argsort(wavenumber, kind="stable")
    wavenumber, spectrum = wavenumber[order], spectrum[order]
    lit = np.flatnonzero(spectrum > 0)
    if lit.size == 0:
        raise NotSelfAffineError("C is zero everywhere: the surface is flat")
    wavenumber, spectrum = wavenumber[lit[0] : lit[-1] + 1], spectrum[lit[0] : lit[-1] + 1]
    require("C", spectrum, spectrum > 0, "positive between its first and last positive entries")
    require("C", spectrum, (spectrum >= 1e-200) & (spectrum <= 1e200), "in [1e-200, 1e200], its unit well chosen")
    if convention == "isotropic":
        spectrum = spectrum / (4 * math.pi**2)
    density = spectrum / math.pi if convention == "profile" else 2 * math.pi * spectrum * wavenumber
    steps = np.diff(wavenumber, prepend=wavenumber[0]) + np.diff(wavenumber, append=wavenumber[-1])
    variances = density * steps / 2
    ends = float(wavenumber[0]), float(wavenumber[-1])
    return fit_surface(
        wavenumber,
        spectrum,
        np.ones(len(wavenumber)),
        variances,
        h_max=height,
        usable=ends,
        band=check_band(band, *ends),
        power=float(variances.sum()),
        convention=convention,
        h_rms_total=math.sqrt(variances.sum()),
    )


def _detrended(heights: FloatArray, degree: int) -> FloatArray:
    """Heights less their least-squares polynomial of that total degree."""
    along, across = (
        np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1, 1, count), degree))[0] for count in heights.shape
    )
    wanted = np.add.outer(np.arange(degree + 1), np.arange(degree + 1)) <= degree
    trend: FloatArray = along @ (wanted * (along.T @ heights @ across)) @ across.T
    return heights - trend


def _windowed(heights: FloatArray) -> FloatArray:
    """Heights under a Hann window of unit mean square, their mean under it removed."""
    along, across = (np.sin(np.pi * (np.arange(count) + 0.5) / count) ** 2 for count in heights.shape)
    window = np.outer(along, across)
    return (heights - np.average(heights, weights=window)) * (window / math.sqrt(np.mean(window**2)))


def radial_spectrum(
    heights: FloatArray, dx: float, dy: float
) -> tuple[FloatArray, FloatArray, FloatArray, NDArray[np.complex128]]:
    """C(q) of a map, averaged over narrow rings up to the Nyquist circle pi/max(dx, dy) (Eqs. 4, 5).

    Parameters
    ----------
    heights : numpy.ndarray, shape (nx, ny)
        Heights, their trend removed, windowed unless periodic [length].
    dx, dy : float
        Sampling steps along the first and the second axis [length].

    Returns
    -------
    q, C, waves : numpy.ndarray, shape (n,)
        Mean wavenumber of each ring, mean C [length^4] and number of wavevectors. C times waves times the cell
        (2 pi)^2/(nx dx ny dy) is the variance of height in the ring.
    directions : numpy.ndarray, shape (2, n)
        Mean of exp(2 i theta) and of exp(4 i theta) around the ring, weighted by power.
    """
    nx, ny = heights.shape
    step_x, step_y = 2 * math.pi / (nx * dx), 2 * math.pi / (ny * dy)
    power = np.abs(np.fft.rfft2(heights)) ** 2
    power *= 1 / (nx * ny) ** 2 / (step_x * step_y)
    qx = (step_x * nx) * np.fft.fftfreq(nx)[:, None]
    qy = (step_y * ny) * np.fft.rfftfreq(ny)[None, :]
    q = np.hypot(qx, qy)
    copies = np.full(q.shape, 2.0)
    copies[:, 0] = 1.0
    if ny % 2 == 0:
        copies[:, -1] = 1.0
    seen = (q > 0) & (q <= math.pi / max(dx, dy) * (1 + 1e-12))
    lit = q[seen & (power > LEAST_POWER * power.max())]
    if lit.size == 0:
        raise NotSelfAffineError("every wave of the map is shorter than two sampling steps")
    seen &= (q >= lit.min()) & (q <= lit.max())
    ring = np.rint(RINGS * q[seen] / min(step_x, step_y)).astype(int)
    own, strength = copies[seen], copies[seen] * power[seen]
    counted = np.bincount(ring, own)
    held = counted > 0
    waves, total = counted[held].astype(float), np.bincount(ring, strength)[held]
    # the half-plane holds theta and stands for theta + pi too, for which both exponentials are the same
    turn = ((qx + 1j * qy)[seen] / q[seen]) ** 2
    directions = np.array(
        [
            np.bincount(ring, strength * t.real)[held] + 1j * np.bincount(ring, strength * t.imag)[held]
            for t in (turn, turn**2)
        ]
    )
    directions /= np.where(total > 0, total, 1.0)
    return np.bincount(ring, own * q[seen])[held] / waves, total / waves, waves, directions


def _refuse_edges(heights: FloatArray) -> None:
    """Refuse a map of facets: between steps, ridges or spikes, its spectrum alone can look self-affine."""
    scale = float(np.abs(heights).max())
    steps = [np.diff(heights / scale, axis=axis).ravel() for axis in (0, 1)]
    squares, fourths = (sum(float(np.mean(step**power)) for step in steps) / 2 for power in (2, 4))
    kurtosis = fourths / squares**2
    if kurtosis > LARGEST_KURTOSIS:
        raise NotSelfAffineError(
            f"the map's slopes lie in a few edges or spikes: the kurtosis of neighbouring heights' differences is "
            f"{kurtosis:.3g}, more than {LARGEST_KURTOSIS:g} (3: Gaussian)"
        )


def _grid_of(heights: Any, dx: Any, dy: Any, periodic: bool | None) -> tuple[Any, float, float, bool, str | None]:
    """Heights, sampling steps, periodicity and unit, from an array or from a topography."""
    if not callable(getattr(heights, "heights", None)):
        if dx is None:
            raise InputError("dx is missing: the sampling step of a plain array of heights")
        steps = finite_array("dx", dx), finite_array("dy", dx if dy is None else dy)
        for name, step in zip(("dx", "dy"), steps, strict=True):
            if step.shape != ():
                raise InputError(f"{name} must be one number, got shape {step.shape}")
            require(name, step, (step >= SMALLEST) & (step <= LARGEST), "in [1e-30, 1e30]")
        return heights, float(steps[0]), float(steps[1]), bool(periodic), None
    if dx is not None or dy is not None:
        raise InputError("dx and dy belong to a plain array; a topography has its own physical_sizes")
    grid = heights.heights()
    sizes = getattr(heights, "physical_sizes", None)
    if np.ndim(grid) != 2 or sizes is None or np.shape(sizes) != (2,):
        raise InputError(
            f"a topography must have two-dimensional heights and two physical_sizes, got shape {np.shape(grid)} "
            f"and {sizes}; a line's spectrum goes to from_psd with convention='profile'"
        )
    extent = finite_array("physical_sizes", sizes)
    require("physical_sizes", extent, (extent >= SMALLEST) & (extent <= LARGEST), "in [1e-30, 1e30]")
    own = bool(getattr(heights, "is_periodic", False)) if periodic is None else bool(periodic)
    step_x, step_y = (float(size) / max(count, 1) for size, count in zip(extent, np.shape(grid), strict=True))
    return grid, step_x, step_y, own, getattr(heights, "unit", None)


def _without_holes(grid: Any) -> FloatArray:
    try:
        values = np.ma.asanyarray(grid)
    except (TypeError, ValueError) as fault:
        raise InputError(f"heights must be an array of numbers: {fault}") from None
    if values.ndim != 2:
        raise InputError(f"heights must be two-dimensional, got shape {values.shape}")
    if values.dtype.kind not in "fiu":
        raise InputError(f"heights must be real numbers: entries of type {values.dtype}")
    holes = np.ma.getmaskarray(values)
    if values.dtype.kind == "f":
        holes = holes | np.isnan(values.data)
    if holes.any():
        raise InputError(
            f"the map has {holes.sum()} holes among {holes.size} points: fill them first, for instance with "
            "SurfaceTopography's interpolate_undefined_data()"
        )
    heights = finite_array("heights", values.data)
    require("heights", heights, np.abs(heights) <= LARGEST, "at most 1e30 in magnitude")
    if min(heights.shape) < LEAST_GRID:
        raise NotSelfAffineError(
            f"a map of {heights.shape[0]} x {heights.shape[1]} points holds too few scales; "
            f"the least is {LEAST_GRID} x {LEAST_GRID}"
        )
    return heights


def surface_from_map(
    heights: Any,
    dx: float | None = None,
    dy: float | None = None,
    *,
    periodic: bool | None = None,
    detrend: str | None = None,
    h_max: float | None = None,
    band: tuple[float, float] | None = None,
) -> Surface:
    """The self-affine surface fitted to a height map.

    Parameters
    ----------
    heights : array_like, shape (nx, ny), or topography
        Heights [length], at least 32 x 32; or an object with SurfaceTopography's `heights()`, `physical_sizes` and
        `is_periodic`, which is not imported for that.
    dx, dy : float, optional
        Sampling steps along the first and the second axis [length]; dy is dx if not given. A topography has its own.
    periodic : bool, optional
        Whether the map continues periodically; else a Hann window is applied. A topography's own flag, False for
        an array.
    detrend : {"mean", "plane", "quadratic"}, optional
        The least-squares polynomial to subtract; by default the mean of a periodic map, the plane of any other.
    h_max : float, optional
        Height of the highest point above the mid-plane [length]; by default the map's, after detrending.
    band : tuple of float, optional
        (q0, q1) to fit and to take; else a flat roll-off below and a departure above are found and left out.

    Returns
    -------
    Surface
        With `fit`, a `SpectrumFit`. h_rms is that of the fitted law between q0 and q1. Without a roll-off q0 is
        the map's own lowest wavenumber, though under a window the line is fitted from twice that on; without a
        cut q1 is the largest measured wavenumber, at most pi/max(dx, dy).

    Raises
    ------
    InputError, OutOfRangeError
        For input that is no map: holes, a missing or negative step, an unknown trend.
    NotSelfAffineError
        Where the map is no isotropic self-affine surface; the message has the reason and the numbers.
    """
    grid, step_x, step_y, own, unit = _grid_of(heights, dx, dy, periodic)
    values = _without_holes(grid)
    trend = detrend if detrend is not None else ("mean" if own else "plane")
    if trend not in DETRENDS:
        raise InputError(f"detrend must be one of {', '.join(DETRENDS)}, got {detrend!r}")
    top = None if h_max is None else check_height(h_max)
    flat = _detrended(values, DETRENDS[trend])
    size = float(np.abs(values).max())
    if not float(np.abs(flat).max()) > max(1e3 * np.finfo(float).eps * size, SMALLEST):
        raise NotSelfAffineError(f"the map is flat: nothing is left once its {trend} is subtracted")
    _refuse_edges(flat)
    # heights of order one, so that their squares neither underflow nor overflow
    scale = float(np.abs(flat).max())
    seen = flat / scale if own else _windowed(flat / scale)
    q, C, waves, directions = radial_spectrum(seen, step_x, step_y)
    C *= scale**2
    nx, ny = values.shape
    steps = 2 * math.pi / (nx * step_x), 2 * math.pi / (ny * step_y)
    low = float(q[0]) if own else WINDOW_REACH * max(steps)
    surface = fit_surface(
        q,
        C,
        waves / (2.0 if own else 2.0 * WINDOW_OVERLAP),
        C * waves * (steps[0] * steps[1]),
        h_max=float(flat.max()) if top is None else top,
        usable=(low, float(q[-1])),
        band=check_band(band, float(q[0]), float(q[-1])),
        power=float(np.mean(seen**2)) * scale**2,
        convention="paper",
        h_rms_total=float(np.std(flat / scale)) * scale,
        windowed=not own,
        detrend=trend,
        length_unit=unit,
    )
    return _with_anisotropy(surface, q, C * waves, directions)


def _with_anisotropy(
    surface: Surface, q: FloatArray, strength: FloatArray, directions: NDArray[np.complex128]
) -> Surface:
    """The surface, its anisotropy noted; refused where its fitted waves favour a direction."""
    fit = surface.fit
    assert fit is not None
    inside = (q >= fit.q_low) & (q <= fit.q_high)
    # whitened by the law, and between every wave alike (the shortest decide) and every octave alike (the longest)
    weight = strength[inside] * q[inside] ** (1 + 2 * surface.hurst)
    anisotropy = float(np.abs(directions[:, inside] @ weight).max() / weight.sum())
    if anisotropy > LARGEST_ANISOTROPY:
        raise NotSelfAffineError(
            f"the map is not isotropic: an anisotropy of {anisotropy:.2g} between q = {fit.q_low:.4g} and "
            f"{fit.q_high:.4g}, more than {LARGEST_ANISOTROPY} (1: all power in one direction)"
        )
    return dataclasses.replace(surface, fit=dataclasses.replace(fit, anisotropy=anisotropy))


def read_map(path: str | os.PathLike[str]) -> Any:
    """The topography in a map file, read by SurfaceTopography (the extra `maps`), its default channel.

    Raises
    ------
    MbmaError
        Where SurfaceTopography is not installed.
    InputError
        Where there is no such file or that library cannot read it.
    """
    with warnings.catch_warnings():
        # a user who reads a file is not helped by that library's remarks on its own optional parts
        warnings.simplefilter("ignore")
        try:
            from SurfaceTopography import open_topography
        except ImportError:
            raise MbmaError("reading map files needs SurfaceTopography: pip install 'mbma_tables[maps]'") from None
        if not os.path.isfile(path):
            raise InputError(f"there is no file {os.fspath(path)!r}")
        try:
            # opened here: its readers leave open what they cannot read
            with open(path, "rb") as stream, open_topography(stream) as reader:
                return reader.topography()
        # its readers raise whatever their parsers raise
        except Exception as fault:
            reason = str(fault).strip().splitlines() or [type(fault).__name__]
            raise InputError(
                f"SurfaceTopography cannot read {os.fspath(path)!r} as a map: {type(fault).__name__}: {reason[0]}"
            ) from None
