"""Height maps: their radial power spectrum, and the surface fitted to it.

Reading map files is left to SurfaceTopography (the extra `maps`); nothing else here needs it.
"""

from __future__ import annotations

import dataclasses
import math
import os
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbma_tables import bearing
from mbma_tables.arguments import FloatArray, finite_array, require
from mbma_tables.errors import InputError, MbmaError, NotSelfAffineError
from mbma_tables.surfaces.measured import Heights, MeasuredSurface
from mbma_tables.surfaces.power_law import SCATTER, log_bins
from mbma_tables.surfaces.power_laws import PowerLaws
from mbma_tables.surfaces.psd import MAX_LENGTH, MIN_LENGTH, FittedSurface, check_band, check_height, fit_spectrum

DETRENDS = {"mean": 0, "plane": 1, "quadratic": 2}
MIN_GRID = 32  # points along each side: 16 wavenumbers, of which a window spoils the first
RINGS = 8  # per grid step in wavenumber: narrow enough that C hardly changes across a ring
WINDOW_LOBE = 2.0  # half-width of a Hann window's main lobe, in grid steps: closer to q = 0 it mixes with the mean
WINDOW_OVERLAP = (35 / 18) ** 2  # waves under that window that carry what one independent wave does
MIN_POWER = 1e-24  # of the strongest wave: below it rounding, not a measured wave
MAX_KURTOSIS = 50.0  # all slopes on 2% of the points; Gaussian surfaces have 3, worn or scratched ones up to 10 or 20
MAX_ANISOTROPY = 0.3  # of a cosine around the circle: four times the power one way than across it


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

    Returns mean wavenumber of each ring, mean C, number of wavevectors, and power-weighted means of exp(2 i theta) and
    exp(4 i theta), shape (2, n). C times waves times (2 pi)^2/(nx dx ny dy) is the variance of height in the ring.
    """
    nx, ny = heights.shape
    step_x, step_y = 2 * math.pi / (nx * dx), 2 * math.pi / (ny * dy)
    power = np.abs(np.fft.fft2(heights)) ** 2 / (nx * ny) ** 2 / (step_x * step_y)
    qx, qy = np.meshgrid(step_x * nx * np.fft.fftfreq(nx), step_y * ny * np.fft.fftfreq(ny), indexing="ij")
    q = np.hypot(qx, qy)
    inside = (q > 0) & (q <= math.pi / max(dx, dy) * (1 + 1e-12))
    measured = q[inside & (power > MIN_POWER * power.max())]
    if measured.size == 0:
        raise NotSelfAffineError("every wave of the map is shorter than two sampling steps")
    inside &= (q >= measured.min()) & (q <= measured.max())
    q, strength = q[inside], power[inside]
    ring = np.rint(RINGS * q / min(step_x, step_y)).astype(int)
    waves: FloatArray = np.bincount(ring).astype(float)
    filled = waves > 0
    total = np.bincount(ring, strength)[filled]
    waves = waves[filled]
    turn = ((qx + 1j * qy)[inside] / q) ** 2
    sums = [[np.bincount(ring, strength * part)[filled] for part in (t.real, t.imag)] for t in (turn, turn**2)]
    directions: NDArray[np.complex128] = np.array([real + 1j * imaginary for real, imaginary in sums])
    directions /= np.where(total > 0, total, 1.0)
    return np.bincount(ring, q)[filled] / waves, total / waves, waves, directions


def _refuse_edges(heights: FloatArray) -> None:
    """Refuse a map of facets: between steps, ridges or spikes, its spectrum alone can look self-affine."""
    scale = float(np.abs(heights).max())
    steps = [np.diff(heights / scale, axis=axis).ravel() for axis in (0, 1)]
    squares, fourths = (sum(float(np.mean(step**power)) for step in steps) / 2 for power in (2, 4))
    kurtosis = fourths / squares**2
    if kurtosis > MAX_KURTOSIS:
        raise NotSelfAffineError(
            f"the map's slopes lie in a few edges or spikes: the kurtosis of neighbouring heights' differences is "
            f"{kurtosis:.3g}, more than {MAX_KURTOSIS:g} (3: Gaussian)"
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
            require(name, step, (step >= MIN_LENGTH) & (step <= MAX_LENGTH), "in [1e-30, 1e30]")
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
    require("physical_sizes", extent, (extent >= MIN_LENGTH) & (extent <= MAX_LENGTH), "in [1e-30, 1e30]")
    if periodic is None:
        periodic = getattr(heights, "is_periodic", False)
    step_x, step_y = (float(size) / max(count, 1) for size, count in zip(extent, np.shape(grid), strict=True))
    return grid, step_x, step_y, bool(periodic), getattr(heights, "unit", None)


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
    require("heights", heights, np.abs(heights) <= MAX_LENGTH, "at most 1e30 in magnitude")
    if min(heights.shape) < MIN_GRID:
        raise NotSelfAffineError(
            f"a map of {heights.shape[0]} x {heights.shape[1]} points holds too few scales; "
            f"the least is {MIN_GRID} x {MIN_GRID}"
        )
    return heights


def _flattened(grid: Any, periodic: bool, detrend: str | None) -> tuple[FloatArray, str]:
    """Heights less their trend, and which one it was."""
    values = _without_holes(grid)
    trend = detrend if detrend is not None else ("mean" if periodic else "plane")
    if trend not in DETRENDS:
        raise InputError(f"detrend must be one of {', '.join(DETRENDS)}, got {detrend!r}")
    flat = _detrended(values, DETRENDS[trend])
    size = float(np.abs(values).max())
    if not float(np.abs(flat).max()) > max(1e3 * np.finfo(float).eps * size, MIN_LENGTH):
        raise NotSelfAffineError(f"the map is flat: nothing is left once its {trend} is subtracted")
    return flat, trend


def detrended_map(
    heights: Any, dx: float | None, dy: float | None, periodic: bool | None, detrend: str | None
) -> tuple[FloatArray, float, float, bool]:
    """Heights less their trend [length], sampling steps and periodicity; arguments as of `Surface.from_map`."""
    grid, step_x, step_y, periodic, _ = _grid_of(heights, dx, dy, periodic)
    return _flattened(grid, periodic, detrend)[0], step_x, step_y, periodic


def fit_map(
    heights: Any,
    dx: float | None,
    dy: float | None,
    periodic: bool | None,
    detrend: str | None,
    h_max: float | None,
    band: tuple[float, float] | None,
) -> FittedSurface:
    """The self-affine surface fitted to a height map; see `Surface.from_map`."""
    grid, step_x, step_y, periodic, unit = _grid_of(heights, dx, dy, periodic)
    top = None if h_max is None else check_height(h_max)
    flat, trend = _flattened(grid, periodic, detrend)
    _refuse_edges(flat)
    # heights of order one, so that their squares neither underflow nor overflow
    scale = float(np.abs(flat).max())
    windowed = flat / scale if periodic else _windowed(flat / scale)
    q, C, waves, directions = radial_spectrum(windowed, step_x, step_y)
    C = C * scale**2
    nx, ny = flat.shape
    steps = 2 * math.pi / (nx * step_x), 2 * math.pi / (ny * step_y)
    low = float(q[0]) if periodic else WINDOW_LOBE * max(steps)
    fitted = fit_spectrum(
        q,
        C,
        waves / (2.0 if periodic else 2.0 * WINDOW_OVERLAP),
        C * waves * (steps[0] * steps[1]),
        h_max=float(flat.max()) if top is None else top,
        usable=(low, float(q[-1])),
        band=check_band(band, float(q[0]), float(q[-1])),
        power=float(np.mean(windowed**2)) * scale**2,
        convention="paper",
        windowed=not periodic,
        detrend=trend,
        length_unit=unit,
    )
    return _with_anisotropy(fitted, q, C * waves, directions)


def _matched(q: FloatArray, C: FloatArray, variance: float, square: float) -> FloatArray:
    """C of averaged samples, tilted a little so that its variance and mean square wavenumber are those of all waves.

    The longest waves of a map are few, and samples do not reach half way to the next ones.
    """
    from scipy.optimize import brentq

    def excess(tilt: float) -> float:
        laws = PowerLaws(q, C * (q / q[0]) ** tilt)
        return math.log(2 * laws.moment(2) / laws.moment(0) / square)

    tilted = C * (q / q[0]) ** brentq(excess, -4.0, 4.0)
    return np.asarray(tilted * (variance / PowerLaws(q, tilted).moment(0)))


def measured_map(
    heights: Any, dx: float | None, dy: float | None, periodic: bool | None, detrend: str | None, h_max: float | None
) -> MeasuredSurface:
    """A height map as its own radial spectrum, heights and curves; see `Surface.from_map`."""
    grid, step_x, step_y, periodic, unit = _grid_of(heights, dx, dy, periodic)
    flat, trend = _flattened(grid, periodic, detrend)
    # lengths of order one, so that their powers neither underflow nor overflow
    scale = float(np.abs(flat).max())
    values, unit_x, unit_y = flat / scale, step_x / scale, step_y / scale
    q, C, waves, _ = radial_spectrum(values if periodic else _windowed(values), unit_x, unit_y)
    bins = log_bins(q, C, waves / (2.0 if periodic else 2.0 * WINDOW_OVERLAP))
    own = Heights.of(values)
    C_bins = _matched(bins.q, np.exp(bins.log_c), own.h_rms**2, float((C * waves) @ q**2 / (C @ waves)))
    if not periodic:
        # its mirror images continue it
        values = np.concatenate([values, values[::-1]])
        values = np.concatenate([values, values[:, ::-1]], axis=1)
    sizes = values.shape[0] * unit_x, values.shape[1] * unit_y
    curves = bearing.bearing(values, sizes)
    known = MeasuredSurface(
        bins.q,
        C_bins,
        None if h_max is None else check_height(h_max) / scale,
        own,
        curves,
        bearing.radial_spectrum(values, sizes),
        1 / (1 / bins.weight - SCATTER**2),
        curves.anisotropy,
    ).scaled(scale, unit)
    steps: tuple[dict[str, Any], ...] = (
        {"step": "read", "points": list(flat.shape), "dx": step_x, "dy": step_y, "unit": unit},
        {"step": "detrend", "kind": trend},
        {"step": "edges", "kind": "periodic" if periodic else "Hann window for the spectrum, mirrored for the curves"},
    )
    return dataclasses.replace(known, provenance=steps)


def _with_anisotropy(
    fitted: FittedSurface, q: FloatArray, strength: FloatArray, directions: NDArray[np.complex128]
) -> FittedSurface:
    """The same with its anisotropy noted; refused where its fitted waves favour a direction."""
    fit = fitted.fit
    inside = (q >= fit.q_low) & (q <= fit.q_high)
    # whitened by the law, and between every wave alike (the shortest decide) and every octave alike (the longest)
    weight = strength[inside] * q[inside] ** (1 + 2 * fitted.hurst)
    anisotropy = float(np.abs(directions[:, inside] @ weight).max() / weight.sum())
    if anisotropy > MAX_ANISOTROPY:
        raise NotSelfAffineError(
            f"the map is not isotropic: an anisotropy of {anisotropy:.2g} between q = {fit.q_low:.4g} and "
            f"{fit.q_high:.4g}, more than {MAX_ANISOTROPY} (1: all power in one direction)"
        )
    return fitted._replace(fit=dataclasses.replace(fit, anisotropy=anisotropy))


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
