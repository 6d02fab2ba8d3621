"""Height maps: radial spectrum, the surface given by it, extrapolation to shorter waves."""

import dataclasses
import math
import os
from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np

from mbma_tables.common.arguments import FloatArray, nearest, number_in, require_flag
from mbma_tables.common.errors import InputError, NotSelfAffineError, OutOfRangeError
from mbma_tables.common.units import Units, factor, in_one_unit, known
from mbma_tables.surfaces import bearing_curve as bearing
from mbma_tables.surfaces.blocks import is_large, mapped, read_by_blocks
from mbma_tables.surfaces.heights import Heights
from mbma_tables.surfaces.measurements import grid_of, read_measurement
from mbma_tables.surfaces.profiles import measured_profiles
from mbma_tables.surfaces.psd import SCATTER, Bins, log_bins
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
    treat_further,
    within,
)

S = TypeVar("S", bound=SpectralSurface)
# rings per grid step in wavenumber: narrow enough that C hardly changes across a ring
RINGS = 8
# slopes on 2% of the points only; Gaussian surfaces have 3, worn or scratched ones up to 10
# or 20
MAX_KURTOSIS = 50.0
# steps of a provenance that are made anew where wavelengths are left out
OF_SPECTRUM = ("window", "few wavelengths", "corners", "resolution")
STEPS_PER_OCTAVE = 8  # of an extrapolated spectrum
# grid steps in wavenumber; a window weights the few wavelengths below at random; none lies
# on this limit
LONG = 4.0 * (1 - 1e-9)
STEEPEST = 30.0  # largest tilt of a spectrum in `matched`
TOLD = 0.05  # relative difference of rms gradients that is reported, and half of that of h_rms


def radial_spectrum(
    heights: FloatArray, dx: float, dy: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """C(q) of a map, averaged over narrow rings (Eqs. 4, 5).

    Rings reach to the Nyquist circle pi/max(dx, dy). Returns each ring's mean wavenumber,
    mean C, and number of wavevectors, which times C (2 pi)^2/(nx dx ny dy) is the ring's
    variance of height.
    """
    nx, ny = heights.shape
    step_x = 2 * math.pi / (nx * dx)
    step_y = 2 * math.pi / (ny * dy)
    power = np.abs(np.fft.fft2(heights)) ** 2 / (nx * ny) ** 2 / (step_x * step_y)
    qx = step_x * nx * np.fft.fftfreq(nx)[:, None]
    qy = step_y * ny * np.fft.fftfreq(ny)
    q = np.hypot(qx, qy)
    inside = (q > 0) & (q <= math.pi / max(dx, dy) * (1 + 1e-12))
    with_power = q[inside & (power > MIN_POWER * power.max())]
    if with_power.size == 0:
        raise InputError("every wavelength of the map is shorter than two sampling steps")
    inside &= (q >= with_power.min()) & (q <= with_power.max())
    q = q[inside]
    ring = np.rint(RINGS * q / min(step_x, step_y)).astype(int)
    waves: FloatArray = np.bincount(ring).astype(float)
    filled = waves > 0
    waves = waves[filled]
    mean_q = np.bincount(ring, q)[filled] / waves
    mean_power = np.bincount(ring, power[inside])[filled] / waves
    return mean_q, mean_power, waves


def prepared(
    source: Any, options: Mapping[str, Any], dimensions: int | None = 2
) -> Treated:
    """A map or line scan, treated, with options of `Surface.from_map`.

    Without `dimensions` a file decides which of both it is.
    """
    stated = {name: value for name, value in options.items() if value is not None}
    for name in stated.keys() - set(OPTIONS):
        raise TypeError(f"there is no option {name!r}: {nearest(name, OPTIONS)}")
    if "periodic" in stated:
        require_flag("periodic", stated["periodic"])
    names: list[str] = [name for name in ("dx", "dy") if name in stated]
    steps_of_array = {name: stated.pop(name) for name in names}
    lengths, unit = in_one_unit(steps_of_array, stated.pop("unit", None))
    channel = stated.pop("channel", None)
    periodic = stated.pop("periodic", None)
    if isinstance(source, str | os.PathLike):
        large = mapped(source) if channel in (None, 0) else None
        if large is None:
            source = read_measurement(source, **lengths, unit=unit, channel=channel)
            lengths = {}
        else:
            source = large
    elif channel is not None:
        raise InputError("channel belongs to a file")
    if dimensions is None:
        dimensions = 2 if is_large(source) else source.dim
    grid, steps, whole, unit_of_source = grid_of(
        source, lengths.get("dx"), lengths.get("dy"), periodic, dimensions
    )
    unit_of_heights = unit if unit_of_source is None else known(unit_of_source)
    if unit_of_heights is not None and unit not in (None, unit_of_heights):
        by = factor(unit_of_heights, unit)
        unit_of_heights = unit
        grid = grid * by
        if not lengths:
            # steps of an array are in the requested unit already
            steps = tuple(step * by for step in steps)
    units = Units(unit_of_heights)
    for name in stated.keys() & {*CALLED, "outliers"}:
        stated[name] = units.number(name, stated[name])
    treatment = Treatment(**stated)
    if dimensions == 2 and is_large(grid):
        read = read_by_blocks(grid, steps, whole, treatment, unit_of_heights)
        return treat_further(read, treatment)
    return treat(grid, steps, whole, treatment, unit_of_heights)


def points_of_fit(surface: SpectralSurface) -> dict[str, Any]:
    """Arguments of `fit_spectrum`: rings of a map's spectrum, else the samples."""
    curves = surface.bearing
    if curves is not None and curves.slope_kurtosis > MAX_KURTOSIS:
        raise NotSelfAffineError(
            "the map's slopes lie in a few edges or spikes: their kurtosis is "
            f"{curves.slope_kurtosis:.3g}, more than {MAX_KURTOSIS:g} (3: Gaussian)"
        )
    treated = surface.map
    return _points_of_samples(surface) if treated is None else _points_of_rings(treated)


def _points_of_samples(surface: SpectralSurface) -> dict[str, Any]:
    """Arguments of `fit_spectrum` from samples of a spectrum."""
    q = surface.q
    C = surface.C
    # from the sample before to the sample after, twice the width of its own part
    width = np.diff(q, prepend=q[0]) + np.diff(q, append=q[-1])
    counts = np.ones(q.size) if surface.samples is None else surface.samples
    # beside a zero of C there is no power law
    positive = C > 0
    return {
        "q": q[positive],
        "C": C[positive],
        "counts": counts[positive],
        "variances": (np.pi * C * q * width)[positive],
        "low": float(q[0]),
    }


def _points_of_rings(treated: Treated) -> dict[str, Any]:
    """Arguments of `fit_spectrum` from the rings of a map's spectrum."""
    # heights of order one, so that their squares neither underflow nor overflow
    scale = float(np.abs(treated.heights).max())
    rings = _rings(treated, scale, 1.0)
    C = rings.C * scale**2
    low = float(rings.q[0])
    if not treated.periodic:
        # half the width of a Hann window's main lobe: closer to q = 0 it mixes with the
        # mean
        low = max(2.0 * max(rings.grid), low)
    return {
        "q": rings.q,
        "C": C,
        "counts": rings.waves / (2 * treated.overlap),
        "variances": C * rings.waves * (rings.grid[0] * rings.grid[1]),
        "low": low,
    }


@dataclasses.dataclass(frozen=True, eq=False)
class _Rings:
    """The radial spectrum of a map within its cut-offs."""

    q: FloatArray
    C: FloatArray
    waves: FloatArray  # wavevectors of each ring
    grid: list[float]  # steps of the wavevectors along both axes


def _rings(treated: Treated, up: float, along: float) -> _Rings:
    """The radial spectrum of heights over `up`, with steps over `along`."""
    step_x, step_y = (step / along for step in treated.steps)
    q, C, waves = radial_spectrum(treated.windowed() / up, step_x, step_y)
    # a window smears some beyond the band
    low, high = treated.waves
    inside = (q / along >= low * (1 - 1e-9)) & (q / along <= high * (1 + 1e-9))
    if not inside.any():
        raise InputError("no wavelength of the map lies between its cut-offs")
    grid = []
    for count, step in zip(treated.heights.shape, treated.steps, strict=True):
        grid.append(2 * math.pi * along / (count * step))
    return _Rings(q[inside], C[inside], waves[inside], grid)


def matched(q: FloatArray, C: FloatArray, variance: float, square: float) -> FloatArray:
    """C of averaged samples, tilted a little to the sums over all wavelengths.

    `variance` is that of heights, `square` the mean square wavenumber.
    """
    from scipy.optimize import brentq

    def excess(tilt: float) -> float:
        laws = PowerLaws(q, C * (q / q[0]) ** tilt)
        return math.log(2 * laws.moment(2) / laws.moment(0) / square)

    if q.size < 2:
        # rejected later
        return C
    tilted = C
    if excess(-STEEPEST) < 0 < excess(STEEPEST):
        tilted = C * (q / q[0]) ** brentq(excess, -STEEPEST, STEEPEST)
    return np.asarray(tilted * (variance / PowerLaws(q, tilted).moment(0)))


def raised(q: FloatArray, C: FloatArray, variance: float, slopes: float) -> FloatArray:
    """C with another variance and mean squared gradient, by its few longest wavelengths."""
    from scipy.optimize import least_squares

    # the likeliest change if the variance of ln C is the inverse number of samples:
    # proportional to C times 1 and q^2
    slope_power = C * q**2
    ways = np.stack([C / C.max(), slope_power / slope_power.max()])

    def misses(by: FloatArray) -> FloatArray:
        laws = PowerLaws(q, C * np.exp(by @ ways))
        return np.log([laws.moment(0) / variance, 2 * laws.moment(2) / slopes])

    with np.errstate(all="ignore"):
        if not np.isfinite(misses(np.zeros(2))).all():
            # one wavelength, or moments that overflow
            return C
    # ln C of the strongest wavelengths under a window changes by at most 6
    fitted = least_squares(misses, np.zeros(2), bounds=(-6.0, 6.0), xtol=1e-12)
    if not np.abs(fitted.fun).max() < 1e-6:
        # heights with a trend, which has no wavelength under the window
        return C
    changed = C * np.exp(fitted.x @ ways)
    return np.asarray(changed * (variance / PowerLaws(q, changed).moment(0)))


def _unwindowed(
    q: FloatArray,
    C: FloatArray,
    variance: float,
    slopes: float,
    windowed_slopes: float,
    parts: tuple[float, float],
) -> tuple[FloatArray, dict[str, Any]]:
    """C under a window as that of the whole map, and what was done.

    `slopes` is the mean squared gradient of the map, `windowed_slopes` that under the
    window; `parts` are those of short wavelengths, under the window and of the map.
    """
    rougher = parts[1] / parts[0] if min(parts) > 0 else 1.0
    steeper = math.sqrt(rougher)
    h_rms_share = math.sqrt(PowerLaws(q, C).moment(0) / variance)
    C = raised(q, C * rougher, variance, slopes)
    record: dict[str, Any] = {
        "step": "window",
        "h_rms": h_rms_share,
        "rms_gradient": math.sqrt(windowed_slopes / slopes),
    }
    lines = []
    if abs(steeper - 1) > TOLD:
        lines.append(
            "roughness differs from place to place: the rms gradient of short "
            f"wavelengths is {steeper:.2f} times that under the window of the spectrum, "
            "which is scaled to it"
        )
    if abs(h_rms_share - 1) > 2 * TOLD:
        lines.append(
            "most of the height variance lies in a few long wavelengths (check for "
            "residual form): under the window of the spectrum h_rms is "
            f"{h_rms_share:.2f} times the map's"
        )
    lines += _disagreement(q, C, variance, slopes)
    if lines:
        record["told"] = "; ".join(lines)
    return C, record


def _disagreement(
    q: FloatArray, C: FloatArray, variance: float, slopes: float
) -> list[str]:
    """Lines to report if a spectrum differs from the heights in variance or gradient."""
    laws = PowerLaws(q, C)
    h_rms = math.sqrt(laws.moment(0) / variance)
    gradient = math.sqrt(2 * laws.moment(2) / slopes)
    if max(abs(h_rms - 1), abs(gradient - 1)) <= TOLD:
        return []
    return [
        "spectrum and heights disagree, as where a trend is left or wavelengths are few: "
        f"h_rms of the spectrum is {h_rms:.2f} times the map's, its rms gradient "
        f"{gradient:.2f} times"
    ]


def measured_map(treated: Treated) -> SpectralSurface:
    """A height map as its own radial spectrum, heights and curves; see `Surface.from_map`."""
    # lengths of order one, so that their powers neither underflow nor overflow
    scale = float(np.abs(treated.heights).max())
    values = treated.heights / scale
    step_x, step_y = (step / scale for step in treated.steps)
    rings = _rings(treated, scale, scale)
    bins = _bins(rings, treated, scale)
    heights = Heights.of(values)
    values = values if treated.periodic else mirrored(values)
    # beyond the last ring
    last = float(rings.q[-1]) + min(rings.grid) / RINGS

    def slopes(low: float) -> float:
        """Mean squared gradient of the map from a wavenumber to the spectrum's last ring."""
        _, squared_gradient = squares(values, (step_x, step_y), (low, last))
        return squared_gradient

    variance = heights.h_rms**2
    squared_gradient = slopes(0.0)
    C = np.exp(bins.log_c)
    notes: list[dict[str, Any]] = []
    if treated.periodic:
        C = _of_all_wavelengths(bins.q, C, variance, squared_gradient)
        lines = _disagreement(bins.q, C, variance, squared_gradient)
        notes += [{"step": "few wavelengths", "told": line} for line in lines]
    else:
        step_qx, step_qy = rings.grid
        of_rings = rings.C * rings.waves * rings.q**2 * step_qx * step_qy
        floor = LONG * max(rings.grid)
        parts = (float(of_rings[rings.q >= floor].sum()), slopes(floor))
        windowed = float(of_rings.sum())
        C, note = _unwindowed(bins.q, C, variance, squared_gradient, windowed, parts)
        notes.append(note)

    sizes = (values.shape[0] * step_x, values.shape[1] * step_y)
    part = tuple(slice(count) for count in treated.heights.shape)
    curves = bearing.bearing(values, sizes, part)
    steeper = curves.gradient / math.sqrt(squared_gradient)
    if steeper > 1 + TOLD:
        notes.append(_unsampled(steeper))
    surface = SpectralSurface(
        bins.q,
        C,
        heights=heights,
        bearing=curves,
        bands=bearing.radial_spectrum(values, sizes),
        samples=1 / (1 / bins.weight - SCATTER**2),
        anisotropy=curves.anisotropy,
    ).scaled(scale, treated.unit)
    more = "" if treated.periodic else ", mirrored for the curves"
    without_copies = dataclasses.replace(treated, uncut=None, form=None)
    provenance = treated.history(*notes, more=more)
    return dataclasses.replace(surface, map=without_copies, provenance=provenance)


def _bins(rings: _Rings, treated: Treated, scale: float) -> Bins:
    """Logarithmic bins with power; an error if they are no band of a rough surface."""
    bins = log_bins(rings.q, rings.C, rings.waves / (2 * treated.overlap))
    # for ridges, or a few cosines, some bins have no wavelength
    bins = bins[bins.log_c > bins.log_c.max() + math.log(MIN_POWER)]
    if bins.q.size < 2 or bins.q[-1] <= MIN_ZETA_1 * bins.q[0]:
        ends = {f"{2 * math.pi * scale / float(bins.q[k]):.4g}" for k in (0, -1)}
        wavelengths = " to ".join(sorted(ends, key=float))
        raise OutOfRangeError(
            f"the map holds wavelengths of {wavelengths} {treated.unit or ''}".rstrip()
            + " only, and a rough surface has wavelengths of more than a factor of "
            f"{MIN_ZETA_1:g}: use a theory of regular patterns, or include the roughness "
            "that the pattern carries"
        )
    return bins


def _of_all_wavelengths(
    q: FloatArray, C: FloatArray, variance: float, slopes: float
) -> FloatArray:
    """C of bins with the variance and squared gradient of all wavelengths of a periodic map."""
    changed = raised(q, C, variance, slopes)
    if changed is not C:
        return changed
    # a tilt if there are many long wavelengths, as for a step
    return matched(q, C, variance, slopes / variance)


def _unsampled(steeper: float) -> dict[str, Any]:
    """Note on the corners of the spectrum, beyond its last ring."""
    description = (
        "wavelengths that only one axis or the diagonals sample are left out of the "
        f"spectrum: with them the rms gradient would be {steeper:.2f} times as large"
    )
    return {"step": "corners", "rms_gradient": steeper, "told": description}


def measured_traces(
    heights: Any,
    across: Any,
    options: Mapping[str, Any],
    isotropic: bool,
    shortest: Any = None,
    hurst: Any = None,
) -> SpectralSurface:
    """The surface of line scans, extrapolated if requested; see `Surface.from_profile`."""
    if across is not None and isotropic:
        raise InputError(
            "isotropic=True is of traces in one direction: traces across measure the lay"
        )
    lists = [_several(heights), [] if across is None else _several(across)]
    traces, crossing = ([prepared(each, options, 1) for each in some] for some in lists)
    units = dict.fromkeys(trace.unit for trace in (*traces, *crossing))
    if None in units and len(units) > 1:
        raise InputError(
            "some traces have a unit and some do not: give unit=..., to which those of "
            "files are converted"
        )
    if len(units) > 1:
        same = {**options, "unit": traces[0].unit}
        traces, crossing = ([prepared(each, same, 1) for each in some] for some in lists)
    surface = measured_profiles(traces, crossing, isotropic).resolved()
    _require_both(shortest, hurst)
    return surface if shortest is None else extrapolated(surface, shortest, hurst)


def _several(traces: Any) -> list[Any]:
    """The traces of a list of them, or the only one."""
    if not isinstance(traces, list | tuple) or not traces:
        return [traces]
    is_number = np.isscalar(traces[0]) and not isinstance(traces[0], str)
    return [traces] if is_number or traces[0] is None else list(traces)


def _require_both(shortest: Any, hurst: Any) -> None:
    if (shortest is None) != (hurst is None):
        raise InputError("extrapolate_to and extrapolate_hurst: give both or neither")


def measured_surface(
    treated: Treated, h_max: float | None = None, shortest: Any = None, hurst: Any = None
) -> SpectralSurface:
    """The surface of a treated map or line scan, extrapolated if requested."""
    _require_both(shortest, hurst)
    is_trace = treated.heights.ndim == 1
    surface = measured_profiles([treated]) if is_trace else measured_map(treated)
    if h_max is not None:
        surface = dataclasses.replace(surface, h_max=h_max)
    surface = surface.resolved()
    return surface if shortest is None else extrapolated(surface, shortest, hurst)


def without_shorter(surface: S, wavelength: float, why: str, chosen: bool = True) -> S:
    """The surface of a map without its wavelengths below one [length].

    `why` says in the provenance what they are left out for, and `chosen` that nobody asked
    for it.
    """
    assert surface.map is not None
    treatment = Treatment(short_cutoff=wavelength)
    cut = within(dataclasses.replace(surface.map, provenance=()), treatment)
    (step,) = cut.provenance
    record = {**step, "chosen": chosen, "told": f"{step['told']}; {why}"}
    less = measured_surface(dataclasses.replace(cut, provenance=(record,)))
    # a highest point that was given stays as it is
    is_own_top = math.isclose(surface.h_max, surface.heights.h_max, rel_tol=1e-9)
    earlier = [step for step in surface.provenance if step["step"] not in OF_SPECTRUM]
    later = [step for step in less.provenance if step["step"] not in ("read", "edges")]
    return dataclasses.replace(
        surface,
        q=less.q,
        C=less.C,
        h_max=less.h_max if is_own_top else surface.h_max,
        heights=less.heights,
        bearing=less.bearing,
        bands=less.bands,
        map=less.map,
        samples=less.samples,
        anisotropy=less.anisotropy,
        provenance=(*earlier, *later),
    )


def extrapolated(surface: S, shortest: Any, hurst: Any) -> S:
    """A measured spectrum continued to a shorter wavelength [length] by a given power law."""
    length = Units(surface.unit).number("extrapolate_to", shortest)
    wave = number_in("extrapolate_to", length, 1e-30, 1e30)
    exponent = number_in("extrapolate_hurst", hurst, 0.0, 1.0)
    last = float(surface.q1)
    end = 2 * math.pi / wave
    if not end > last:
        raise InputError(
            "extrapolate_to must be below the shortest measured wavelength, "
            f"{2 * math.pi / last:.6g}, got {wave:g}"
        )
    # from the mean level of the last measured octave
    slope = 2 + 2 * exponent
    octave = last / 2 * 2 ** ((np.arange(STEPS_PER_OCTAVE) + 0.5) / STEPS_PER_OCTAVE)
    C_of_octave = np.asarray(surface.power_spectrum(octave))
    positive = C_of_octave > 0
    levels = np.log(C_of_octave[positive]) + slope * np.log(octave[positive])
    level = float(np.mean(levels))
    steps = math.ceil(math.log2(end / last) * STEPS_PER_OCTAVE)
    q = np.geomspace(last, end, max(2, steps + 1))
    samples = surface.samples
    if samples is not None:
        samples = np.append(samples, np.full(q.size, samples[-1]))
    C = np.append(surface.C, np.exp(level - slope * np.log(q)))
    # the curves of the map do not include the added wavelengths
    scans = tuple(extrapolated(scan, shortest, hurst) for scan in surface.scans)
    changed = {**NO_MAP, "scans": scans, "C": C, "samples": samples}
    longer = dataclasses.replace(surface, **changed, q=np.append(surface.q, q))
    area = float(surface.rms_gradient / longer.rms_gradient)
    stiffness = float(surface.h_rms / longer.h_rms)
    description = (
        f"continued to wavelengths of {wave:.4g} {surface.unit or ''}".rstrip()
        + f" by a power law with H = {exponent:g}, which was not measured: area at light "
        f"load is {area:.3g} times that of the measured wavelengths, stiffness and "
        f"conductance at a pressure {stiffness:.3g} times"
    )
    record = {
        "step": "extrapolated",
        "shortest": wave,
        "hurst": exponent,
        "area": area,
        "stiffness": stiffness,
        "told": description,
    }
    return dataclasses.replace(longer, provenance=(*surface.provenance, record))
