"""Height maps: radial spectrum, the surface given by it or fitted to it, extrapolation to shorter wavelengths."""

import dataclasses
import math
import os
from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np

from mbma_tables.common.arguments import FloatArray, nearest, number_in, require_flag
from mbma_tables.common.errors import InputError, NotSelfAffineError, OutOfRangeError
from mbma_tables.common.units import Units, factor, known, resolve
from mbma_tables.surfaces import bearing_curve as bearing
from mbma_tables.surfaces.heights import Heights
from mbma_tables.surfaces.measurements import grid_of, read_measurement
from mbma_tables.surfaces.profiles import measured_profile
from mbma_tables.surfaces.psd import SCATTER, log_bins
from mbma_tables.surfaces.spectral import NO_MAP, SpectralSurface
from mbma_tables.surfaces.spectrum import MIN_ZETA_1, PowerLaws
from mbma_tables.surfaces.treatment import (
    CALLED,
    MIN_POWER,
    OPTIONS,
    Treated,
    Treatment,
    mirrored,
    squares,
    treat,
)

S = TypeVar("S", bound=SpectralSurface)
RINGS = (
    8  # per grid step in wavenumber: narrow enough that C hardly changes across a ring
)
# half-width of a Hann window's main lobe, in grid steps: closer to q = 0 it mixes with the
# mean
WINDOW_LOBE = 2.0
# slopes on 2% of the points only; Gaussian surfaces have 3, worn or scratched ones up to 10
# or 20
MAX_KURTOSIS = 50.0
STEPS_PER_OCTAVE = 8  # of an extrapolated spectrum


def radial_spectrum(
    heights: FloatArray, dx: float, dy: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """C(q) of a map, averaged over narrow rings up to the Nyquist circle pi/max(dx, dy) (Eqs. 4, 5).

    Returns each ring's mean wavenumber, mean C, and number of wavevectors, which times C (2
    pi)^2/(nx dx ny dy) is the ring's variance of height.
    """
    nx, ny = heights.shape
    step_x = 2 * math.pi / (nx * dx)
    step_y = 2 * math.pi / (ny * dy)
    power = np.abs(np.fft.fft2(heights)) ** 2 / (nx * ny) ** 2 / (step_x * step_y)
    q = np.hypot(
        step_x * nx * np.fft.fftfreq(nx)[:, None], step_y * ny * np.fft.fftfreq(ny)
    )
    inside = (q > 0) & (q <= math.pi / max(dx, dy) * (1 + 1e-12))
    measured = q[inside & (power > MIN_POWER * power.max())]
    if measured.size == 0:
        raise InputError("every wavelength of the map is shorter than two sampling steps")
    inside &= (q >= measured.min()) & (q <= measured.max())
    q = q[inside]
    strength = power[inside]
    ring = np.rint(RINGS * q / min(step_x, step_y)).astype(int)
    waves: FloatArray = np.bincount(ring).astype(float)
    filled = waves > 0
    total = np.bincount(ring, strength)[filled]
    waves = waves[filled]
    return np.bincount(ring, q)[filled] / waves, total / waves, waves


def prepared(
    source: Any, options: Mapping[str, Any], dimensions: int | None = 2
) -> Treated:
    """A map or line scan, treated, with options of `Surface.from_map`; without `dimensions` a file decides which."""
    given = {name: value for name, value in options.items() if value is not None}
    for name in given.keys() - set(OPTIONS):
        raise TypeError(f"there is no option {name!r}: {nearest(name, OPTIONS)}")
    if "periodic" in given:
        require_flag("periodic", given["periodic"])
    lengths, unit = resolve(
        {name: given.pop(name) for name in ("dx", "dy") if name in given},
        given.pop("unit", None),
    )
    channel = given.pop("channel", None)
    periodic = given.pop("periodic", None)
    if isinstance(source, str | os.PathLike):
        source = read_measurement(source, **lengths, unit=unit, channel=channel)
        lengths = {}
    elif channel is not None:
        raise InputError("channel belongs to a file")
    dimensions = source.dim if dimensions is None else dimensions
    grid, steps, whole, own = grid_of(
        source, lengths.get("dx"), lengths.get("dy"), periodic, dimensions
    )
    own = unit if own is None else known(own)
    if own is not None and unit not in (None, own):
        by = factor(own, unit)
        own = unit
        # given steps are in the given unit
        grid, steps = grid * by, steps if lengths else tuple(step * by for step in steps)
    units = Units(own)
    given |= {
        name: units.number(name, given[name])
        for name in given.keys() & {*CALLED, "outliers"}
    }
    return treat(grid, steps, whole, Treatment(**given), own)


def points_of_fit(surface: SpectralSurface) -> dict[str, Any]:
    """Arguments of `fit_spectrum`: rings of a map's spectrum, else the samples."""
    treated = surface.map
    known = surface.bearing
    if known is not None and known.slope_kurtosis > MAX_KURTOSIS:
        raise NotSelfAffineError(
            f"the map's slopes lie in a few edges or spikes: their kurtosis is {known.slope_kurtosis:.3g}, "
            f"more than {MAX_KURTOSIS:g} (3: Gaussian)"
        )
    if treated is None:
        q = surface.q
        C = surface.C
        width = np.diff(q, prepend=q[0]) + np.diff(q, append=q[-1])
        counts = np.ones(q.size) if surface.samples is None else surface.samples
        given = {"q": q, "C": C, "counts": counts, "variances": np.pi * C * q * width}
        return {name: values[C > 0] for name, values in given.items()} | {
            "low": float(q[0])
        }
    # heights of order one, so that their squares neither underflow nor overflow
    scale = float(np.abs(treated.heights).max())
    q, C, waves, grid = _rings(treated, scale, 1.0)
    C = C * scale**2
    given = {
        "q": q,
        "C": C,
        "counts": waves / (2 * treated.overlap),
        "variances": C * waves * (grid[0] * grid[1]),
    }
    return given | {
        "low": float(q[0])
        if treated.periodic
        else max(WINDOW_LOBE * max(grid), float(q[0]))
    }


def _rings(
    treated: Treated, up: float, along: float
) -> tuple[FloatArray, FloatArray, FloatArray, list[float]]:
    """The radial spectrum within the band kept, heights over `up`, steps over `along`; the grid's steps in q."""
    q, C, waves = radial_spectrum(
        treated.windowed() / up, *(step / along for step in treated.steps)
    )
    # a window smears some beyond the band
    held = (q / along >= treated.waves[0] * (1 - 1e-9)) & (
        q / along <= treated.waves[1] * (1 + 1e-9)
    )
    if not held.any():
        raise InputError("no wavelength of the map lies between its cut-offs")
    grid = [
        2 * math.pi * along / (n * d)
        for n, d in zip(treated.heights.shape, treated.steps, strict=True)
    ]
    return q[held], C[held], waves[held], grid


# grid steps in wavenumber; a window weights the few wavelengths below at random; none lies
# on this limit
LONG = 4.0 * (1 - 1e-9)
# largest change of ln C of the strongest wavelengths under a window; tolerance of the sums
RAISED = 6.0
MET = 1e-6
STEEPEST = 30.0  # largest tilt of a spectrum in `matched`
TOLD = 0.05  # relative difference of rms gradients that is reported, and half of that of h_rms


def matched(q: FloatArray, C: FloatArray, variance: float, square: float) -> FloatArray:
    """C of averaged samples, tilted a little to the variance and mean square wavenumber of all wavelengths."""
    from scipy.optimize import brentq

    def excess(tilt: float) -> float:
        laws = PowerLaws(q, C * (q / q[0]) ** tilt)
        return math.log(2 * laws.moment(2) / laws.moment(0) / square)

    if q.size < 2:
        # rejected later
        return C
    slope = excess(-STEEPEST) < 0 < excess(STEEPEST)
    tilted = C * (q / q[0]) ** brentq(excess, -STEEPEST, STEEPEST) if slope else C
    return np.asarray(tilted * (variance / PowerLaws(q, tilted).moment(0)))


def raised(q: FloatArray, C: FloatArray, variance: float, slopes: float) -> FloatArray:
    """C with another variance and mean squared gradient, by its few longest wavelengths."""
    from scipy.optimize import least_squares

    # the likeliest change if the variance of ln C is the inverse number of samples:
    # proportional to C times 1 and q^2
    ways = np.stack([C / C.max(), C * q**2 / (C * q**2).max()])

    def misses(by: FloatArray) -> FloatArray:
        laws = PowerLaws(q, C * np.exp(by @ ways))
        return np.log([laws.moment(0) / variance, 2 * laws.moment(2) / slopes])

    with np.errstate(all="ignore"):
        if not np.isfinite(misses(np.zeros(2))).all():
            # one wavelength, or moments that overflow
            return C
    found = least_squares(misses, np.zeros(2), bounds=(-RAISED, RAISED), xtol=1e-12)
    # not for heights with a trend, which has no wavelength under the window
    changed = C * np.exp(found.x @ ways)
    return np.asarray(
        changed * (variance / PowerLaws(q, changed).moment(0))
        if np.abs(found.fun).max() < MET
        else C
    )


def _unwindowed(
    q: FloatArray,
    C: FloatArray,
    variance: float,
    slopes: float,
    seen: float,
    parts: tuple[float, float],
) -> tuple[FloatArray, dict[str, Any]]:
    """C under a window as that of the whole map, and what was done; `parts` are those of short wavelengths."""
    rougher = parts[1] / parts[0] if min(parts) > 0 else 1.0
    under = math.sqrt(PowerLaws(q, C).moment(0) / variance)
    C = raised(q, C * rougher, variance, slopes)
    record = {"step": "window", "h_rms": under, "rms_gradient": math.sqrt(seen / slopes)}
    told = []
    if abs(math.sqrt(rougher) - 1) > TOLD:
        told.append(
            f"roughness differs from place to place: the rms gradient of short wavelengths is {math.sqrt(rougher):.2f} "
            "times that under the window of the spectrum, which is scaled to it"
        )
    if abs(under - 1) > 2 * TOLD:
        told.append(
            "most of the height variance lies in a few long wavelengths (check for residual form): under the window of "
            f"the spectrum h_rms is {under:.2f} times the map's"
        )
    told += _disagreement(q, C, variance, slopes)
    return C, record | ({"told": "; ".join(told)} if told else {})


def _disagreement(
    q: FloatArray, C: FloatArray, variance: float, slopes: float
) -> list[str]:
    """Lines to report if a spectrum differs in variance or mean squared gradient from the heights."""
    laws = PowerLaws(q, C)
    h_rms = math.sqrt(laws.moment(0) / variance)
    gradient = math.sqrt(2 * laws.moment(2) / slopes)
    if max(abs(h_rms - 1), abs(gradient - 1)) <= TOLD:
        return []
    return [
        "spectrum and heights disagree, as where a trend is left or wavelengths are few: h_rms of the spectrum is "
        f"{h_rms:.2f} times the map's, its rms gradient {gradient:.2f} times"
    ]


def measured_map(treated: Treated) -> SpectralSurface:
    """A height map as its own radial spectrum, heights and curves; see `Surface.from_map`."""
    # lengths of order one, so that their powers neither underflow nor overflow
    scale = float(np.abs(treated.heights).max())
    values, (unit_x, unit_y) = (
        treated.heights / scale,
        (step / scale for step in treated.steps),
    )
    q, C, waves, grid = _rings(treated, scale, scale)
    bins = log_bins(q, C, waves / (2 * treated.overlap))
    # for ridges, or a few cosines, some bins have no wavelength
    bins = bins[bins.log_c > bins.log_c.max() + math.log(MIN_POWER)]
    if bins.q.size < 2 or bins.q[-1] <= MIN_ZETA_1 * bins.q[0]:
        ends = sorted(
            {f"{2 * math.pi * scale / float(bins.q[k]):.4g}" for k in (0, -1)}, key=float
        )
        raise OutOfRangeError(
            f"the map holds wavelengths of {' to '.join(ends)} {treated.unit or ''}".rstrip()
            + f" only, and a rough surface has wavelengths of more than a factor of {MIN_ZETA_1:g}: use a theory of "
            "regular patterns, or include the roughness that the pattern carries"
        )
    own = Heights.of(values)
    values = values if treated.periodic else mirrored(values)

    def slopes(low: float) -> float:
        """Mean squared gradient of the map itself from a wavenumber to the spectrum's last ring."""
        return squares(values, (unit_x, unit_y), (low, float(q[-1]) + min(grid) / RINGS))[
            1
        ]

    notes: list[dict[str, Any]] = []
    C_bins = np.exp(bins.log_c)
    variance = own.h_rms**2
    whole = slopes(0.0)
    if treated.periodic:
        changed = raised(bins.q, C_bins, variance, whole)
        # a tilt if there are many long wavelengths, as for a step
        C_bins = (
            matched(bins.q, C_bins, variance, whole / variance)
            if changed is C_bins
            else changed
        )
        few = _disagreement(bins.q, C_bins, variance, whole)
        notes += [{"step": "few wavelengths", "told": line} for line in few]
    else:
        seen = C * waves * q**2 * grid[0] * grid[1]
        floor = LONG * max(grid)
        parts = float(seen[q >= floor].sum()), slopes(floor)
        C_bins, note = _unwindowed(
            bins.q, C_bins, variance, whole, float(seen.sum()), parts
        )
        notes.append(note)
    sizes = values.shape[0] * unit_x, values.shape[1] * unit_y
    curves = bearing.bearing(
        values, sizes, tuple(slice(count) for count in treated.heights.shape)
    )
    rougher = curves.gradient / math.sqrt(whole)
    if rougher > 1 + TOLD:
        told = (
            "wavelengths that only one axis or the diagonals sample are left out of the spectrum: with them the rms "
            f"gradient would be {rougher:.2f} times as large"
        )
        notes.append({"step": "corners", "rms_gradient": rougher, "told": told})
    known = SpectralSurface(
        bins.q,
        C_bins,
        heights=own,
        bearing=curves,
        bands=bearing.radial_spectrum(values, sizes),
        samples=1 / (1 / bins.weight - SCATTER**2),
        anisotropy=curves.anisotropy,
    ).scaled(scale, treated.unit)
    more = "" if treated.periodic else ", mirrored for the curves"
    kept = dataclasses.replace(treated, uncut=None, form=None)
    return dataclasses.replace(
        known, map=kept, provenance=treated.history(*notes, more=more)
    )


def measured_surface(
    treated: Treated, h_max: float | None = None, shortest: Any = None, hurst: Any = None
) -> SpectralSurface:
    """The surface of a treated map or line scan, extrapolated to a shorter wavelength if requested."""
    if (shortest is None) != (hurst is None):
        raise InputError("extrapolate_to and extrapolate_hurst: give both or neither")
    found = (measured_profile if treated.heights.ndim == 1 else measured_map)(treated)
    known = (
        found if h_max is None else dataclasses.replace(found, h_max=h_max)
    ).resolved()
    return known if shortest is None else extrapolated(known, shortest, hurst)


def extrapolated(surface: S, shortest: Any, hurst: Any) -> S:
    """A measured spectrum continued to a shorter wavelength [length] by a given power law."""
    wave = number_in(
        "extrapolate_to",
        Units(surface.unit).number("extrapolate_to", shortest),
        1e-30,
        1e30,
    )
    exponent = number_in("extrapolate_hurst", hurst, 0.0, 1.0)
    last = float(surface.q1)
    end = 2 * math.pi / wave
    if not end > last:
        raise InputError(
            f"extrapolate_to must be below the shortest measured wavelength, {2 * math.pi / last:.6g}, got {wave:g}"
        )
    # from the mean level of the last measured octave
    slope = 2 + 2 * exponent
    octave = last / 2 * 2 ** ((np.arange(STEPS_PER_OCTAVE) + 0.5) / STEPS_PER_OCTAVE)
    known = np.asarray(surface.power_spectrum(octave))
    level = float(np.mean(np.log(known[known > 0]) + slope * np.log(octave[known > 0])))
    q = np.geomspace(
        last, end, max(2, math.ceil(math.log2(end / last) * STEPS_PER_OCTAVE) + 1)
    )
    samples = (
        None
        if surface.samples is None
        else np.append(surface.samples, np.full(q.size, surface.samples[-1]))
    )
    # the curves of the map do not include the added wavelengths
    C = np.append(surface.C, np.exp(level - slope * np.log(q)))
    longer = dataclasses.replace(
        surface, **NO_MAP, q=np.append(surface.q, q), C=C, samples=samples
    )
    area = float(surface.rms_gradient / longer.rms_gradient)
    stiffness = float(surface.h_rms / longer.h_rms)
    told = (
        f"continued to wavelengths of {wave:.4g} {surface.unit or ''}".rstrip()
        + f" by a power law with H = {exponent:g}, which was not measured: area at light load is {area:.3g} times "
        f"that of the measured wavelengths, stiffness and conductance at a pressure {stiffness:.3g} times"
    )
    record = {
        "step": "extrapolated",
        "shortest": wave,
        "hurst": exponent,
        "area": area,
        "stiffness": stiffness,
    }
    return dataclasses.replace(
        longer, provenance=(*surface.provenance, record | {"told": told})
    )
