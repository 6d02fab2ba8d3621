"""Treatment of measured maps and line scans, with a record of each step.

Options have the names of SurfaceTopography (the extra `maps`).
"""

from __future__ import annotations

import dataclasses
import itertools
import math
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray, number_in
from mbma_tables.common.errors import InputError
from mbma_tables.surfaces import artefacts
from mbma_tables.surfaces.artefacts import SMALLEST, Artefact
from mbma_tables.surfaces.measurements import MAX_LENGTH, MIN_LENGTH, heights_of, wrapped

DEGREES = {
    "mean": 0,
    "plane": 1,
    "quadratic": 2,
    "height": 1,
    "curvature": 2,
}  # of least-squares polynomials
DETRENDS = (
    "mean",
    "plane",
    "quadratic",
    "median",
    "height",
    "mad-tilt",
    "slope",
    "curvature",
    "mad-curvature",
)
MIN_GRID = SMALLEST  # points along each side: 16 wavenumbers, the first of which is distorted by a window
FREE_HOLES = 0.05  # share of undefined points that is filled without being requested
MEDIAN_POINTS = 3  # side of the neighbourhood that an outlier is compared with
# share of points that set the scale of differences, and where it ends if Gaussian
USUAL = 0.99
USUAL_DEVIATES = 2.576
MEDIAN_DEVIATES = 0.6745  # where half of Gaussian magnitudes end
OVERLAP = (
    35 / 18
)  # Fourier components along an axis under a Hann window that count as one independent component
MIN_POWER = (
    1e-24  # power over that of the strongest wavelength: lower values are rounding
)
# share of the height variance in a tilt or a bow above which it is reported; a bow is from
# `artefacts.LEAST_BOW` on where nobody chose what to subtract, since at half an h_rms it
# changes areas by up to 50%, and half of the machined maps have as much by their own waves
FORM = 0.5
# standard deviations of an outlier; share of points up to which they are reported
USUAL_LIMIT = 10.0
FEW = 1e-3
# a spike differs this many times as much from the median of its neighbourhood as its
# neighbours do but two, which may be spikes too: on 130 maps of machined surfaces one point
# does, and also stands out by `USUAL_LIMIT`
ISOLATED = 4.0
OTHER_SPIKES = 2
# share of filled points above which results are not valid: with 0.2% of the points missing
# at random, pressures at a gap change by up to 0.3%, and by 0.7 to 5% with 1 to 3% missing
# in patches, more than the scatter of a simulation
MOST_FILLED = 1e-3
# a line between two rows is a seam if the median step across it is this many times those
# beside it, and all but those of so many seams, and as large as what the step varies by along
# the line: on 130 maps of machined surfaces, at most 1.7 and 1.2 times; lines of scanning
# probes jump too, but many of them
SEAM = 2.5
SEAM_SPREAD = 1.0
MOST_SEAMS = 3
# a seam between tiles steps up and down along its line: the median magnitude of third
# differences across it, which waves hardly have, is this many times that of all lines but
# other seams, which are at least half as high, and the lines beside them, if these are most
TILE_SEAM = 3.5
MOST_OF_LINES = 5 / 8
# heights change sharply where their wavelengths below `SHARP_STEPS` sampling steps, which no
# answer may hang on, are this many times their standard deviation by the median: at a single
# point, or at more than a share of the points. Three measured maps have at most 19 times, and
# 10 times on 0.07% of the points, machined maps less; `python -m generate artefacts`
SHARP_STEPS = 4.0
SHARPEST = 25.0
SHARP = 10.0
MOST_SHARP = 1e-3
SHARP_HEIGHT = 0.05  # least height of such places, in h_rms
# where waves reach down to the sampling step: places of up to 5 x 5 points that rise by so
# many h_rms above all points of the ring around them, mostly within one step, and by so many
# times the range of that ring; machined maps have none, self-affine ones reach 1.7 times
TALL = 2.5
TALL_OVER_RING = 1.75
LARGEST_PLACE = 5
SHARP_SHARE = 0.2  # of that rise, in wavelengths below `SHARP_STEPS`
BEYOND_EDGE = 24  # points by which a map is continued for that
DISTORTED = 2  # and points along its edges that are left out
CALLED = {"long_cutoff": "a long cut-off", "short_cutoff": "a short cut-off"}
CALLED |= {"s_filter": "an S-filter", "l_filter": "an L-filter"}
GAUSSIAN = math.log(
    2
)  # factor in the filter's exponent: wavelengths equal to the nesting index are halved
LAST_WAVES = 0.01  # amplitude below which wavelengths count as removed by an S-filter
# what is doubtful about a map unless it is confirmed, by its step in the provenance
CONFIRMABLE = ("bow", "highest place", "saturation", "seam", "sharp places", "spikes")
Provenance = tuple[Mapping[str, Any], ...]


@dataclasses.dataclass(frozen=True)
class Treatment:
    """The treatment of a measurement; steps are done in this order.

    Attributes
    ----------
    outliers : float, optional
        Points further from the median of their 3 x 3 neighbourhood than this many standard
        deviations of such differences, by their 99% quantile, are removed and filled; 10
        finds bad pixels and little else.
    fill : {"harmonic"}, optional
        How undefined points are filled (`interpolate_undefined_data`). By default up to 5%
        are filled harmonically.
    detrend : str, optional
        Mode of `detrend`: mean, median, height (or plane), mad-tilt, slope, curvature (or
        quadratic), mad-curvature. By default the mean of periodic data, the plane of any
        other.
    short_cutoff, long_cutoff : float, optional
        Wavelengths [length]: shorter ones, below the instrument's resolution, and longer
        ones, form, are left out (`shortcut`, `longcut`). Data that are not periodic are
        continued by their mirror images for that.
    s_filter, l_filter : float, optional
        Nesting indices of ISO 25178 [length], of Gaussian filters (ISO 16610-61) that halve
        this wavelength. An S-filter removes shorter ones, completely below 0.39 times the
        index, an L-filter longer ones.
    confirmed : str or sequence of str, optional
        What looks like an artefact and was found to be the surface itself: bow, highest place,
        saturation, seam, sharp places or spikes; of a string the names are separated by
        commas. Results are then valid in spite of it.
    """

    outliers: float | None = None
    fill: str | None = None
    detrend: str | None = None
    short_cutoff: float | None = None
    long_cutoff: float | None = None
    s_filter: float | None = None
    l_filter: float | None = None
    confirmed: str | Sequence[str] | None = None

    def __post_init__(self) -> None:
        for name in ("outliers", *CALLED):
            if getattr(self, name) is not None:
                object.__setattr__(
                    self,
                    name,
                    number_in(name, getattr(self, name), MIN_LENGTH, MAX_LENGTH),
                )
        for name, allowed in (("fill", ("harmonic",)), ("detrend", DETRENDS)):
            if getattr(self, name) not in (None, *allowed):
                raise InputError(
                    f"{name} must be one of {', '.join(allowed)}, got {getattr(self, name)!r}"
                )
        object.__setattr__(self, "confirmed", names_of(self.confirmed))


def names_of(confirmed: Any) -> tuple[str, ...]:
    """The names of `Treatment.confirmed`, an InputError for others."""
    if confirmed is None:
        return ()
    names = confirmed.split(",") if isinstance(confirmed, str) else confirmed
    try:
        stripped = tuple(name.strip() for name in names)
    except (TypeError, AttributeError):
        raise InputError(f"confirmed must be names, got {confirmed!r}") from None
    for name in stripped:
        if name not in CONFIRMABLE:
            raise InputError(
                f"confirmed must be of {', '.join(CONFIRMABLE)}, got {name!r}"
            )
    return stripped


# options of `Surface.from_map` and `Surface.from_profile` on reading and treatment
OPTIONS = (
    "unit",
    "dx",
    "dy",
    "channel",
    "periodic",
    *(field.name for field in dataclasses.fields(Treatment)),
)


@dataclasses.dataclass(frozen=True, eq=False)
class Treated:
    """Heights for a spectrum, and their treatment."""

    heights: Any  # [length], shape (nx, ny) or (n,); none undefined in the end
    steps: tuple[float, ...]  # sampling step along each axis [length]
    periodic: bool  # else they are continued by their mirror images if needed
    unit: str | None  # of length, that the file names
    waves: tuple[float, float] = (0.0, math.inf)  # smallest and largest wavenumber kept
    # each step: its name ("step"), its numbers, and a sentence ("told")
    provenance: Provenance = ()
    uncut: Any = None  # heights before the short cut-off, where there is one
    form: Any = None  # what detrending removed, if more than a plane
    confirmed: tuple[str, ...] = ()  # of `Treatment`

    @property
    def overlap(self) -> float:
        """Fourier components, under the window, that count as one independent component."""
        return 1.0 if self.periodic else OVERLAP**self.heights.ndim

    def after(self, heights: Any, step: str, description: str, **numbers: Any) -> Treated:
        """The heights after a step, with its record."""
        record = {"step": step, **numbers, "told": description}
        return dataclasses.replace(
            self, heights=heights, provenance=(*self.provenance, record)
        )

    def doubted(self, step: str, seen: str, remedy: str, **numbers: Any) -> Treated:
        """The same heights, with a record of what results are not valid for unless confirmed."""
        if step in self.confirmed:
            return self.after(self.heights, step, f"{seen}; this is confirmed", **numbers)
        own = (
            f", or confirmed={step!r} if the surface is so" if step in CONFIRMABLE else ""
        )
        reason = f"{seen}: {remedy}{own}"
        return self.after(self.heights, step, seen, **numbers, not_valid=reason)

    def with_artefact(self, found: Artefact) -> Treated:
        """The same heights, with a record of an artefact."""
        return self.doubted(found.step, found.seen, found.remedy, points=found.points)

    def history(self, *notes: Mapping[str, Any], more: str = "") -> Provenance:
        """All steps of a surface made of it: reading, treatment, its edges, and notes."""
        shape = self.heights.shape
        unit = f" {self.unit}" if self.unit else ""
        sides = " x ".join(
            f"{count * step:.4g}" for count, step in zip(shape, self.steps, strict=True)
        )
        description = (
            f"{'map' if len(shape) == 2 else 'line scan'} of "
            f"{' x '.join(map(str, shape))} points, {sides}{unit}, heights read in "
            f"{self.unit or 'the same unit, which is not known'}"
        )
        read = {
            "step": "read",
            "points": list(shape),
            "steps": list(self.steps),
            "unit": self.unit,
            "told": description,
        }
        edges = (
            "periodic" if self.periodic else "under a window for the spectrum"
        ) + more
        return (read, *self.provenance, {"step": "edges", "kind": edges}, *notes)

    def windowed(self) -> FloatArray:
        """Heights under a Hann window of unit mean square, without their mean under it.

        Periodic heights are returned as they are.
        """
        if self.periodic:
            return np.asarray(self.heights)
        windows = [
            np.sin(np.pi * (np.arange(count) + 0.5) / count) ** 2
            for count in self.heights.shape
        ]
        window = windows[0] if len(windows) == 1 else np.outer(*windows)
        values = self.heights - np.average(self.heights, weights=window)
        return np.asarray(values * (window / math.sqrt(np.mean(window**2))))


def _by(shape: tuple[int, ...]) -> str:
    """Numbers of points, such as "512 x 256"."""
    return " x ".join(map(str, shape))


def treat(
    grid: Any,
    steps: tuple[float, ...],
    periodic: bool,
    treatment: Treatment,
    unit: str | None = None,
) -> Treated:
    """Heights [length] made ready for their spectrum; NaN and masked points are undefined."""
    heights = heights_of(grid, len(steps))
    confirmed = names_of(treatment.confirmed)
    return treat_further(
        Treated(heights, steps, periodic, unit, confirmed=confirmed), treatment
    )


def treat_further(treated: Treated, treatment: Treatment) -> Treated:
    """Heights after the steps of a treatment, as they are read."""
    heights = treated.heights
    if min(heights.shape) < MIN_GRID:
        points = _by(heights.shape)
        least = _by((MIN_GRID,) * heights.ndim)
        raise InputError(
            f"{points} points have too few wavelengths; needed are at least {least}"
        )
    for found in artefacts.as_read(heights) if heights.ndim == 2 else ():
        treated = treated.with_artefact(found)
    with warnings.catch_warnings():
        # warnings of numpy inside that library are ignored
        warnings.simplefilter("ignore")
        treated = _filled(without_outliers(treated, treatment.outliers), treatment.fill)
        treated = _without_seams(treated)
        treated = _without_sharp_places(treated, heights)
        treated = _flattened(treated, treatment.detrend)
        return within(_with_high_place(treated), treatment)


def _flattened(treated: Treated, mode: str | None) -> Treated:
    """Heights less their trend."""
    heights = treated.heights
    trend = mode or ("mean" if treated.periodic else "plane")
    degree = DEGREES.get(trend)
    if degree is None:
        flat = np.asarray(
            wrapped(heights, treated.steps, treated.periodic).detrend(trend).heights(),
            float,
        )
    else:
        flat = without_polynomial(heights, degree)
    size = float(np.abs(heights).max())
    if not float(np.abs(flat).max()) > max(1e3 * np.finfo(float).eps * size, MIN_LENGTH):
        raise InputError(f"the map is flat: without its {trend} it is zero")
    before = float(np.std(heights))
    after = float(np.std(flat))
    description = f"{trend} subtracted" + (
        f": h_rms {before:.4g} before, {after:.4g} after" if trend != "mean" else ""
    )
    # what to subtract was nobody's choice
    is_default = mode is None and not treated.periodic and flat.ndim == 2
    bow = artefacts.bow(flat) if is_default else None
    if degree is not None:
        # a doubt says the same
        is_slight = is_default and bow is None
        least_bow = artefacts.LEAST_BOW if is_slight else FORM
        description += _form_left(flat, degree, least_bow)
    removed = None if trend in ("mean", "plane") else heights - flat
    treated = treated.after(
        flat, "detrend", description, mode=trend, h_rms_before=before, h_rms_after=after
    )
    treated = treated if bow is None else treated.with_artefact(bow)
    return dataclasses.replace(treated, form=removed)


def _form_left(flat: FloatArray, degree: int, least_bow: float) -> str:
    """The statement on a tilt or a bow that a trend of that degree leaves in the heights; empty without one."""
    variance = float(np.var(flat))
    for more, form, remedy, least in (
        (1, "tilt", "plane", FORM),
        (2, "bow", "quadratic", least_bow),
    ):
        if more <= degree:
            continue
        share = 1 - float(np.var(without_polynomial(flat, more))) / variance
        if share > least:
            return (
                f"; a {form} has {share:.0%} of the height variance: detrend={remedy!r} "
                "removes it"
            )
    return ""


def _with_high_place(treated: Treated) -> Treated:
    """The same heights, with a record of a place on which light contacts hang."""
    heights = treated.heights
    if heights.ndim == 1 or any("not_valid" in step for step in treated.provenance):
        return treated
    place = artefacts.highest_place(heights, treated.periodic)
    return treated if place is None else treated.with_artefact(place)


def _counted(count: int, size: int) -> str:
    return f"{count} of {size} points ({count / size:.2g} of all)"


def _harmonic(treated: Treated) -> FloatArray:
    """Heights, with undefined points filled smoothly."""
    heights = treated.heights
    if np.ma.getmaskarray(heights).any():
        scan = wrapped(heights, treated.steps, treated.periodic)
        heights = scan.interpolate_undefined_data(method="harmonic").heights()
    return np.asarray(np.ma.getdata(heights), float)


def without_outliers(treated: Treated, requested_limit: float | None) -> Treated:
    """Heights with outliers undefined; if not requested, a few outliers are only reported."""
    from scipy.ndimage import median_filter

    heights = treated.heights
    whole = _harmonic(treated)
    # far outliers distort the filling of their neighbours, not their median
    inner = (slice(1, -1),) * whole.ndim
    median = median_filter(_continued(whole, 1, treated.periodic), MEDIAN_POINTS)[inner]
    difference = np.abs(whole - median)
    measured = ~np.ma.getmaskarray(heights)
    isolated = measured & _isolated(whole, median, treated.periodic)
    # spikes on more than 1% of the points do not set the scale
    usual = measured & ~isolated
    scale = (
        float(np.quantile(difference[usual if usual.any() else measured], USUAL))
        / USUAL_DEVIATES
    )
    limit = USUAL_LIMIT if requested_limit is None else requested_limit
    outliers = measured & (difference > limit * scale)
    out = f"out by more than {limit:g} standard deviations: "
    if requested_limit is not None:
        left = np.ma.masked_array(np.ma.getdata(heights), ~measured | outliers)
        count = int(outliers.sum())
        description = f"{_counted(count, heights.size)} stood {out}taken out"
        return treated.after(left, "outliers", description, limit=limit, points=count)
    spikes = int((outliers & isolated).sum())
    count = int(outliers.sum())
    if spikes == 0 and not 0 < count <= FEW * heights.size:
        return treated
    count = count if count <= FEW * heights.size else spikes
    description = (
        f"{_counted(count, heights.size)} stand {out}outliers={limit:g} removes them"
    )
    if spikes == 0 or heights.ndim == 1:
        return treated.after(heights, "outliers seen", description, points=count)
    seen = f"{_counted(spikes, heights.size)} are spikes, on which contact would begin"
    remedy = f"outliers={limit:g} removes them, as in Surface.from_map(..., outliers={limit:g})"
    seen_before = treated.after(heights, "outliers seen", description, points=count)
    return seen_before.doubted("spikes", seen, remedy, points=spikes)


def _continued(values: FloatArray, points: int, periodic: bool) -> FloatArray:
    """Heights with more points around them; without a jump of their slopes at the edges."""
    if periodic:
        return np.pad(values, points, "wrap")
    return np.pad(values, points, "reflect", reflect_type="odd")


def _isolated(values: FloatArray, median: FloatArray, periodic: bool) -> Any:
    """Points of a map unlike nearly all of their neighbours: neither edges nor pillars."""
    if values.ndim == 1:
        return np.zeros(values.shape, bool)
    wide = _continued(values, 1, periodic)
    rows, columns = values.shape
    beside = []
    for shift in itertools.product((-1, 0, 1), repeat=2):
        if shift != (0, 0):
            first = 1 + shift[0]
            left = 1 + shift[1]
            neighbour = wide[first : first + rows, left : left + columns]
            beside.append(np.abs(neighbour - median))
    # the largest difference but those of neighbours that may be spikes, too
    usual = np.sort(np.stack(beside), axis=0)[-1 - OTHER_SPIKES]
    return np.abs(values - median) > ISOLATED * usual


def _without_seams(treated: Treated) -> Treated:
    """The same heights, with a record of a step along a whole row or column.

    Such a step arises where two images, or tiles of several, were joined.
    """
    heights = np.asarray(treated.heights)
    if heights.ndim == 1:
        return treated
    for axis, name in enumerate(("rows", "columns")):
        steps = np.moveaxis(np.diff(heights, axis=axis), axis, 0)
        across = np.median(steps, axis=1)
        size = np.abs(across)
        spread = np.median(np.abs(steps - across[:, None]), axis=1)
        beside = np.maximum(np.append(0.0, size[:-1]), np.append(size[1:], 0.0))
        usual = np.maximum(beside, np.sort(size)[-1 - MOST_SEAMS])
        seams = size > np.maximum(SEAM * usual, SEAM_SPREAD * spread)
        seams &= size > MIN_LENGTH
        if not seams.any():
            # half of the third difference is the step less those beside
            size = np.median(np.abs(np.diff(steps, 2, axis=0)), axis=1) / 2
            size = np.pad(size, 1)
            seams = _tile_seams(size)
        if not seams.any():
            continue
        place = int(np.argmax(np.where(seams, size, 0.0)))
        unit = f" {treated.unit}" if treated.unit else ""
        description = (
            f"the heights step by {size[place]:.4g}{unit} between {name} {place} and "
            f"{place + 1}, as where two images were joined at different levels"
        )
        parts = (":, " * axis) + f":{place + 1}", (":, " * axis) + f"{place + 1}:"
        remedy = (
            "give each part as a map of its own, "
            f"Surface.from_map(heights[{parts[0]}], ...) and "
            f"Surface.from_map(heights[{parts[1]}], ...)"
        )
        return treated.doubted(
            "seam", description, remedy, between=[place, place + 1], axis=axis
        )
    return treated


def _tile_seams(size: FloatArray) -> Any:
    """Lines whose third differences stand out from those of most others."""
    from scipy.ndimage import binary_dilation

    highest = float(size.max())
    seams = size > highest / 2
    others = size[~binary_dilation(seams)]
    stand_out = (
        others.size > MOST_OF_LINES * size.size
        and highest > TILE_SEAM * float(others.max())
        and highest > MIN_LENGTH
    )
    return seams if stand_out else np.zeros_like(seams)


def _without_sharp_places(treated: Treated, measured: Any) -> Treated:
    """The same heights, with a record of places that are sharper than waves can be.

    Dust, lost pixels and oblique steps between images change the heights within one
    sampling step; a cut-off makes smooth bumps of them, on which contact would begin.
    `measured` are the heights with their holes.
    """
    heights = np.asarray(treated.heights)
    if heights.ndim == 1 or any("not_valid" in step for step in treated.provenance):
        return treated
    short = _shortest_waves(heights, treated.periodic)
    usual = ~np.ma.getmaskarray(measured)
    rim = 0 if treated.periodic else DISTORTED
    usual &= np.pad(np.ones([count - 2 * rim for count in heights.shape], bool), rim)
    scale = float(np.median(short[usual])) / MEDIAN_DEVIATES
    high = usual & (short > SHARP_HEIGHT * np.std(without_polynomial(heights, 1)))
    tall = usual & _tall_places(heights, short, treated.periodic)
    places = tall | (high & (short > SHARP * scale))
    count = int(places.sum())
    if (
        count <= MOST_SHARP * heights.size
        and not (tall | (high & (short > SHARPEST * scale))).any()
    ):
        return treated
    row, column = np.unravel_index(
        int(np.argmax(np.where(places, short, 0.0))), short.shape
    )
    description = (
        f"at {_counted(count, heights.size)} the heights change within a sampling step "
        f"much more than elsewhere, for instance at heights[{row}, {column}], as "
        "with dust, lost pixels or images joined at different levels"
    )
    remedy = (
        f"contact would begin there: {artefacts.clean_part(places)}, or measure "
        "again, with smaller steps where the surface itself is so steep"
    )
    return treated.doubted("sharp places", description, remedy, points=count)


def _tall_places(heights: FloatArray, short: FloatArray, periodic: bool) -> Any:
    """Points of small places that rise steeply above the ring around them.

    `short` is the magnitude of the shortest wavelengths, which have a share of the rise:
    peaks of a map that has none are its own, however steep.
    """
    from scipy.ndimage import maximum_filter, minimum_filter

    least = TALL * float(np.std(without_polynomial(heights, 1)))
    mode = "wrap" if periodic else "mirror"
    lowest_beside = minimum_filter(heights, 3, mode=mode)
    steep = heights - lowest_beside > least / 2
    places = np.zeros(heights.shape, bool)
    if not steep.any():
        return places
    sharpest_beside = maximum_filter(short, 3, mode=mode)
    for side in range(2, LARGEST_PLACE + 1):
        ring = np.ones((2 * side + 1,) * 2, bool)
        ring[1:-1, 1:-1] = False
        top = maximum_filter(heights, footprint=ring, mode=mode)
        bottom = minimum_filter(heights, footprint=ring, mode=mode)
        rise = heights - top
        tall = (rise > least) & (rise > TALL_OVER_RING * (top - bottom))
        tall &= sharpest_beside > SHARP_SHARE * rise
        places |= tall & (heights - lowest_beside > rise / 2)
    return places


def _shortest_waves(heights: FloatArray, periodic: bool) -> FloatArray:
    """Magnitude of the wavelengths below `SHARP_STEPS` sampling steps in heights."""
    from scipy.fft import dctn, idctn

    if periodic:
        long = filtered(heights, (1.0, 1.0), "short_cutoff", SHARP_STEPS)
        return np.asarray(np.abs(heights - long))
    wide = _continued(without_polynomial(heights, 1), BEYOND_EDGE, periodic)
    waves = [(np.arange(count) / count / 2) ** 2 for count in wide.shape]
    is_short = np.add.outer(*waves) > SHARP_STEPS**-2 * (1 + 1e-9)
    inner = slice(BEYOND_EDGE, -BEYOND_EDGE)
    short = idctn(np.where(is_short, dctn(wide), 0.0))
    return np.asarray(np.abs(short)[inner, inner])


def _filled(treated: Treated, fill: str | None) -> Treated:
    """Heights without undefined points."""
    heights = treated.heights
    size = heights.size
    undefined = np.ma.getmaskarray(heights)
    count = int(undefined.sum())
    share = count / size
    if count == 0:
        return dataclasses.replace(treated, heights=_harmonic(treated))
    if share > FREE_HOLES and fill is None:
        raise InputError(
            f"the map has {count} holes among {size} points, more than {FREE_HOLES:.0%}: "
            "fill them, smooth, with fill='harmonic', or cut them out"
        )
    description = (
        f"{_counted(count, size)} were undefined and are filled harmonically: smooth "
        "there, the map lacks about as large a share of its mean squared gradient"
    )
    more = {}
    if share > MOST_FILLED and heights.ndim == 2:
        more["not_valid"] = (
            f"{share:.2g} of the points are filled, more than {MOST_FILLED:g}: contact "
            f"and gaps there were not measured: {artefacts.clean_part(undefined)}, or "
            "measure again"
        )
    return treated.after(
        _harmonic(treated),
        "fill",
        description,
        method="harmonic",
        points=count,
        share=share,
        **more,
    )


def within(treated: Treated, treatment: Treatment) -> Treated:
    """Heights whose wavelengths lie between both cut-offs, or filters."""
    long = treatment.long_cutoff
    short = treatment.short_cutoff
    if short is not None and not short > 2 * min(treated.steps):
        raise InputError(
            "short_cutoff must be longer than two sampling steps, "
            f"{2 * min(treated.steps):.4g}, the shortest wavelength sampled, got {short:g}"
        )
    if short is not None and long is not None and not long > short:
        raise InputError(
            f"long_cutoff must be larger than short_cutoff, got {long:g} and {short:g}"
        )
    requested = {
        name: getattr(treatment, name)
        for name in CALLED
        if getattr(treatment, name) is not None
    }
    values = (
        treated.heights
        if treated.periodic or not requested
        else mirrored(treated.heights)
    )
    whole = tuple(slice(count) for count in treated.heights.shape)
    for name, wavelength in requested.items():
        if name == "short_cutoff":
            treated = dataclasses.replace(treated, uncut=values[whole])
        before = squares(values, treated.steps)
        values = filtered(values, treated.steps, name, wavelength)
        after = squares(values, treated.steps)
        if not after[0] > MIN_POWER * before[0]:
            raise InputError(
                f"{name} {wavelength:g} leaves no wavelength of the measurement"
            )
        of_variance, of_gradient = (
            max(1 - b / a, 0.0) for a, b in zip(before, after, strict=True)
        )
        length = f"{wavelength:.4g} {treated.unit or ''}".rstrip()
        description = f"{CALLED[name]} at {length} removes {of_gradient:.0%} of the squared gradient"
        if name in ("short_cutoff", "s_filter"):
            description += (
                f": the rms gradient is {math.sqrt(after[1] / before[1]):.2f} times that "
                "without"
            )
        description += f"; it removes {of_variance:.0%} of the height variance"
        treated = treated.after(
            values,
            name,
            description,
            wavelength=wavelength,
            of_gradient=of_gradient,
            of_variance=of_variance,
        )
    if not requested:
        return treated
    low, high = treated.waves
    ends = [2 * math.pi / short] if short else []
    ends += [last_wave(treatment.s_filter)] if treatment.s_filter else []
    waves = max(low, 2 * math.pi / (long or math.inf)), min(ends, default=high)
    return dataclasses.replace(
        treated, heights=values[whole], waves=(waves[0], min(high, waves[1]))
    )


def without_polynomial(heights: FloatArray, degree: int) -> FloatArray:
    """Heights less their least-squares polynomial of that total degree.

    The same as the modes of SurfaceTopography.
    """
    bases = [
        np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1, 1, count), degree))[
            0
        ]
        for count in heights.shape
    ]
    if heights.ndim == 1:
        return np.asarray(heights - bases[0] @ (bases[0].T @ heights))
    along, across = bases
    wanted = np.add.outer(np.arange(degree + 1), np.arange(degree + 1)) <= degree
    return np.asarray(
        heights - along @ (wanted * (along.T @ heights @ across)) @ across.T
    )


def last_wave(nesting: float) -> float:
    """Wavenumber above which an S-filter leaves less than `LAST_WAVES` of the amplitude."""
    return 2 * math.pi / nesting * math.sqrt(-math.log(LAST_WAVES) / GAUSSIAN)


def _squared_waves(shape: tuple[int, ...], steps: tuple[float, ...]) -> Any:
    """Squares of the wavenumbers of a grid's Fourier components."""
    waves = [
        2 * np.pi * np.fft.fftfreq(count, step)
        for count, step in zip(shape, steps, strict=True)
    ]
    return (
        np.add.outer(waves[0] ** 2, waves[1] ** 2) if len(shape) == 2 else waves[0] ** 2
    )


def filtered(
    values: FloatArray, steps: tuple[float, ...], name: str, wavelength: float
) -> FloatArray:
    """Periodic heights after a cut-off or a filter, an option of `Treatment`, at a wavelength."""
    q2 = _squared_waves(values.shape, steps)
    cut = (2 * math.pi / wavelength) ** 2
    if name == "short_cutoff":
        left = q2 <= cut * (1 + 1e-12)
    elif name == "long_cutoff":
        left = q2 >= cut * (1 - 1e-12)
    else:
        left = np.exp(-GAUSSIAN * q2 / cut)
        left = (
            1 - left
            if name == "l_filter"
            else np.where(q2 < last_wave(wavelength) ** 2, left, 0.0)
        )
    return np.asarray(np.fft.ifftn(np.fft.fftn(values) * left).real)


def mirrored(values: FloatArray) -> FloatArray:
    """Heights with their mirror images along each axis, which continue them periodically."""
    for axis in range(values.ndim):
        values = np.concatenate([values, np.flip(values, axis)], axis)
    return values


def squares(
    values: FloatArray,
    steps: tuple[float, ...],
    band: tuple[float, float] = (0.0, math.inf),
) -> tuple[float, float]:
    """Mean squares of periodic heights and gradient, between two wavenumbers."""
    power = np.abs(np.fft.fftn(values) / values.size) ** 2
    power.flat[0] = 0.0
    q2 = _squared_waves(values.shape, steps)
    power = power * ((q2 >= band[0] ** 2) & (q2 <= band[1] ** 2))
    return float(power.sum()), float((power * q2).sum())
