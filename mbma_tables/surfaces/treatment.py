"""Measured maps and line scans, treated by SurfaceTopography (the extra `maps`), each step on record.

Terms are that library's: detrend modes, windows, harmonic filling of undefined data, short and long cut-off, tip
radius. Only the search for outliers is added here.
"""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mbma_tables.arguments import FloatArray, number_in
from mbma_tables.errors import InputError
from mbma_tables.surfaces.measurements import MAX_LENGTH, MIN_LENGTH, heights_of, wrapped

DEGREES = {"mean": 0, "plane": 1, "quadratic": 2, "height": 1, "curvature": 2}  # of least-squares polynomials
DETRENDS = ("mean", "plane", "quadratic", "median", "height", "mad-tilt", "slope", "curvature", "mad-curvature")
FILLS = ("harmonic",)
MIN_GRID = 32  # points along each side: 16 wavenumbers, of which a window spoils the first
FREE_HOLES = 0.05  # share of undefined points that is filled unasked
MEDIAN_POINTS = 3  # side of the neighbourhood that an outlier is compared with
USUAL, USUAL_DEVIATES = 0.99, 2.576  # share of points that set the scale of differences, and where it ends if Gaussian
LENGTHS = ("short_cutoff", "long_cutoff", "tip_radius")  # options that are lengths
Provenance = tuple[Mapping[str, Any], ...]


@dataclasses.dataclass(frozen=True)
class Treatment:
    """What is done to a measurement, in this order.

    Attributes
    ----------
    outliers : float, optional
        Points further from the median of their 3 x 3 neighbourhood than this many standard deviations of such
        differences, by their 99% quantile, are taken out and filled; 10 finds bad pixels and little else.
    fill : {"harmonic"}, optional
        How undefined points are filled (`interpolate_undefined_data`). Up to 5% are filled unasked, harmonically.
    detrend : str, optional
        Mode of `detrend`: mean, median, height (or plane), mad-tilt, slope, curvature (or quadratic), mad-curvature.
        By default the mean of periodic data, the plane of any other.
    short_cutoff, long_cutoff : float, optional
        Wavelengths [length]: shorter waves are below the instrument's resolution, longer ones form, and left out
        (`shortcut`, `longcut`). Data that are not periodic are continued by their mirror images for that.
    tip_radius : float, optional
        Of a scanning probe or stylus [length]: sets `short_cutoff` where `scanning_probe_reliability_cutoff` finds
        waves that such a tip cannot follow.
    reliable : bool, optional
        Whether a resolution or tip radius that the file states counts as given, the default.
    window : str, optional
        Of the power spectrum, as in `scipy.signal.get_window`; a Hann window by default, none where periodic.
    """

    outliers: float | None = None
    fill: str | None = None
    detrend: str | None = None
    short_cutoff: float | None = None
    long_cutoff: float | None = None
    tip_radius: float | None = None
    reliable: bool = True
    window: str | None = None

    def __post_init__(self) -> None:
        for name in ("outliers", *LENGTHS):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, number_in(name, getattr(self, name), MIN_LENGTH, MAX_LENGTH))
        for name, allowed in (("fill", FILLS), ("detrend", DETRENDS)):
            if getattr(self, name) not in (None, *allowed):
                raise InputError(f"{name} must be one of {', '.join(allowed)}, got {getattr(self, name)!r}")


@dataclasses.dataclass(frozen=True, eq=False)
class Treated:
    """Heights as they go into a spectrum, and how they came about."""

    heights: FloatArray  # [length], shape (nx, ny) or (n,); none undefined
    steps: tuple[float, ...]  # sampling step along each axis [length]
    periodic: bool  # else they continue by their mirror images where that is needed
    unit: str | None  # of length, that the file names
    waves: tuple[float, float]  # wavenumbers between which the waves are that were kept: (0, inf) if all
    provenance: Provenance  # each step: its name ("step"), its numbers, and a sentence ("told")
    window: str | None = None

    def windowed(self) -> FloatArray:
        """Heights under a window of unit mean square, their mean under it removed; as they are where periodic."""
        if self.window is None and self.periodic:
            return self.heights
        if self.window is None:
            windows = [np.sin(np.pi * (np.arange(count) + 0.5) / count) ** 2 for count in self.heights.shape]
        else:
            windows = [
                np.asarray(wrapped(np.ones(count), (1.0,), False).window(self.window).heights())
                for count in self.heights.shape
            ]
        window = windows[0] if len(windows) == 1 else np.outer(*windows)
        values = self.heights - np.average(self.heights, weights=window)
        return np.asarray(values * (window / math.sqrt(np.mean(window**2))))


def treat(
    grid: Any,
    steps: tuple[float, ...],
    periodic: bool,
    treatment: Treatment,
    unit: str | None = None,
    info: Mapping[str, Any] | None = None,
) -> Treated:
    """Heights [length] made ready for their spectrum, of a map or a line scan; NaN and masked points are undefined.

    `info` is what the file says of its instrument, as in SurfaceTopography.
    """
    record: list[dict[str, Any]] = []
    heights = heights_of(grid, len(steps))
    if min(heights.shape) < MIN_GRID:
        raise InputError(
            f"{' x '.join(map(str, heights.shape))} points hold too few scales; the least is "
            f"{' x '.join([str(MIN_GRID)] * heights.ndim)}"
        )
    with warnings.catch_warnings():
        # that library's calls of numpy are its own affair
        warnings.simplefilter("ignore")
        if treatment.outliers is not None:
            heights = _without_outliers(heights, steps, periodic, treatment.outliers, record)
        whole = _filled(heights, steps, periodic, treatment, record)
        values = _flattened(whole, steps, periodic, treatment.detrend, record)
        short = _resolution(values, steps, treatment, unit, info or {}, record)
        values = _within(values, steps, periodic, unit, short, treatment.long_cutoff, record)
    longest, shortest = treatment.long_cutoff or math.inf, short or 0.0
    waves = (2 * math.pi / longest, 2 * math.pi / shortest if shortest else math.inf)
    return Treated(values, steps, periodic, unit, waves, tuple(record), treatment.window)


def _flattened(
    heights: FloatArray, steps: tuple[float, ...], periodic: bool, mode: str | None, record: list[dict[str, Any]]
) -> FloatArray:
    """Heights less their trend."""
    trend = mode or ("mean" if periodic else "plane")
    degree = DEGREES.get(trend)
    if degree is None:
        flat = np.asarray(wrapped(heights, steps, periodic).detrend(trend).heights(), float)
    else:
        flat = _without_polynomial(heights, degree)
    size = float(np.abs(heights).max())
    if not float(np.abs(flat).max()) > max(1e3 * np.finfo(float).eps * size, MIN_LENGTH):
        raise InputError(f"the map is flat: nothing is left once its {trend} is subtracted")
    before, after = float(np.std(heights)), float(np.std(flat))
    told = f"{trend} subtracted" + (f": h_rms {before:.4g} before, {after:.4g} after" if trend != "mean" else "")
    record.append({"step": "detrend", "mode": trend, "h_rms_before": before, "h_rms_after": after, "told": told})
    return flat


def _without_polynomial(heights: FloatArray, degree: int) -> FloatArray:
    """Heights less their least-squares polynomial of that total degree: what the library's modes do, without it."""
    bases = [
        np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1, 1, count), degree))[0] for count in heights.shape
    ]
    if heights.ndim == 1:
        return np.asarray(heights - bases[0] @ (bases[0].T @ heights))
    along, across = bases
    wanted = np.add.outer(np.arange(degree + 1), np.arange(degree + 1)) <= degree
    return np.asarray(heights - along @ (wanted * (along.T @ heights @ across)) @ across.T)


def _counted(count: int, size: int) -> str:
    return f"{count} of {size} points ({count / size:.2g} of all)"


def _harmonic(heights: Any, steps: tuple[float, ...], periodic: bool) -> FloatArray:
    if not np.ma.getmaskarray(heights).any():
        return np.asarray(np.ma.getdata(heights), float)
    filled = wrapped(heights, steps, periodic).interpolate_undefined_data(method="harmonic").heights()
    return np.asarray(np.ma.getdata(filled), float)


def _without_outliers(
    heights: Any, steps: tuple[float, ...], periodic: bool, limit: float, record: list[dict[str, Any]]
) -> Any:
    """Heights with what stands out of its neighbourhood undefined."""
    from scipy.ndimage import median_filter

    whole = _harmonic(heights, steps, periodic)
    # far outliers bend what their neighbours are filled with, not their median
    difference = whole - median_filter(whole, MEDIAN_POINTS, mode="wrap" if periodic else "mirror")
    known = ~np.ma.getmaskarray(heights)
    scale = float(np.quantile(np.abs(difference[known]), USUAL)) / USUAL_DEVIATES
    found = known & (np.abs(difference) > limit * scale)
    count = int(found.sum())
    told = f"{_counted(count, heights.size)} stood out by more than {limit:g} standard deviations: taken out"
    record.append({"step": "outliers", "limit": limit, "points": count, "told": told})
    return np.ma.masked_array(np.ma.getdata(heights), np.ma.getmaskarray(heights) | found)


def _filled(
    heights: Any, steps: tuple[float, ...], periodic: bool, treatment: Treatment, record: list[dict[str, Any]]
) -> FloatArray:
    """Heights without undefined points."""
    holes = np.ma.getmaskarray(heights)
    count = int(holes.sum())
    if count == 0:
        return np.asarray(np.ma.getdata(heights), float)
    share = count / heights.size
    if share > FREE_HOLES and treatment.fill is None:
        raise InputError(
            f"the map has {count} holes among {heights.size} points, more than {FREE_HOLES:.0%}: fill them, smooth, "
            "with fill='harmonic', or cut them out"
        )
    told = (
        f"{_counted(count, heights.size)} were undefined and are filled harmonically: smooth there, the map lacks "
        "about as large a share of its mean squared gradient"
    )
    record.append({"step": "fill", "method": "harmonic", "points": count, "share": share, "told": told})
    return _harmonic(heights, steps, periodic)


def _resolution(
    values: FloatArray,
    steps: tuple[float, ...],
    treatment: Treatment,
    unit: str | None,
    info: Mapping[str, Any],
    record: list[dict[str, Any]],
) -> float | None:
    """Shortest wavelength that is kept: the largest of what is given, the tip follows, the file states; None: all."""
    found = [(treatment.short_cutoff, "as given")] if treatment.short_cutoff is not None else []
    tip, stated = treatment.tip_radius, (info.get("instrument") or {}).get("parameters") or {}
    if tip is None and not (treatment.reliable and unit and {"tip_radius", "resolution"} & set(stated)):
        return found[0][0] if found else None
    origin = "the file's instrument" if tip is None else f"a tip of radius {tip:g}"
    try:
        scan = wrapped(values, steps, False, unit, **({"instrument": info["instrument"]} if tip is None else {}))
        limit = scan.short_reliability_cutoff() if tip is None else scan.scanning_probe_reliability_cutoff(tip)
    except (ValueError, KeyError, TypeError) as fault:
        raise InputError(f"the reliability cut-off by {origin} cannot be found: {fault}") from None
    if limit is None or limit <= 2 * max(steps):
        told = f"{origin} follows every wave that was sampled"
        record.append({"step": "reliability", "told": told})
    else:
        told = f"{origin} follows no wave below {limit:.4g} {unit or ''}".rstrip()
        record.append({"step": "reliability", "wavelength": float(limit), "told": told})
        found.append((float(limit), origin))
    return max(found)[0] if found else None


def _within(
    values: FloatArray,
    steps: tuple[float, ...],
    periodic: bool,
    unit: str | None,
    short: float | None,
    long: float | None,
    record: list[dict[str, Any]],
) -> FloatArray:
    """Heights whose waves lie between both cut-offs."""
    cuts: list[tuple[str, str, float]] = []
    if long is not None:
        cuts.append(("longcut", "long_cutoff", long))
    if short is not None:
        cuts.append(("shortcut", "short_cutoff", short))
    if not cuts:
        return values
    if short is not None and long is not None and not long > short:
        raise InputError(f"long_cutoff must be larger than short_cutoff, got {long:g} and {short:g}")
    if not periodic:
        values = mirrored(values)
    for method, name, wavelength in cuts:
        before = _squares(values, steps)
        scan = wrapped(values, steps, True, unit)
        values = np.asarray(getattr(scan, method)(cutoff_wavelength=wavelength).heights(), float)
        after = _squares(values, steps)
        if not after[0] > 1e-24 * before[0]:
            raise InputError(f"{name} {wavelength:g} leaves no wave of the measurement")
        record.append(_told_of_cutoff(name, wavelength, unit, before, after))
    return values if periodic else values[tuple(slice(count // 2) for count in values.shape)]


def mirrored(values: FloatArray) -> FloatArray:
    """Heights and their mirror images along each axis, which continue them periodically."""
    for axis in range(values.ndim):
        values = np.concatenate([values, np.flip(values, axis)], axis)
    return values


def _told_of_cutoff(
    name: str, wavelength: float, unit: str | None, before: tuple[float, float], after: tuple[float, float]
) -> dict[str, Any]:
    lost = tuple(1 - b / a for a, b in zip(before, after, strict=True))
    length = f"{wavelength:.4g} {unit or ''}".rstrip()
    text = f"a {name.replace('_cutoff', ' cut-off')} at {length} removes {lost[1]:.0%} of the squared gradient"
    if name == "short_cutoff":
        text += f": area at light load is {math.sqrt(before[1] / after[1]):.2f} times larger than without"
    text += f"; it removes {lost[0]:.0%} of the height variance"
    return {"step": name, "wavelength": wavelength, "of_gradient": lost[1], "of_variance": lost[0], "told": text}


def _squares(values: FloatArray, steps: tuple[float, ...]) -> tuple[float, float]:
    """Mean squares of periodic heights and of their gradient."""
    power = np.abs(np.fft.fftn(values) / values.size) ** 2
    power.flat[0] = 0.0
    waves = [2 * np.pi * np.fft.fftfreq(count, step) for count, step in zip(values.shape, steps, strict=True)]
    squared: Callable[..., FloatArray] = np.add.outer
    q2 = squared(waves[0] ** 2, waves[1] ** 2) if values.ndim == 2 else waves[0] ** 2
    return float(power.sum()), float((power * q2).sum())
