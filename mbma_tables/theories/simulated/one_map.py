"""BEM simulation of one map, and of the flow through its gaps, as a theory of that map alone."""

from __future__ import annotations

import hashlib
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator, interp1d

from mbma_tables.common.arguments import FloatArray, require
from mbma_tables.common.errors import InputError, OutOfRangeError
from mbma_tables.common.shared import shared, shared_property
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.map_simulation import (
    MIN_POINTS,
    ROUNDING,
    MapSimulation,
    resolving,
)
from mbma_tables.surfaces.spectral import ROUNDED
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.theories import gap_law, tested
from mbma_tables.theories.base import Theory, TheoryAnswer
from mbma_tables.theories.calibrated.curves import own_law
from mbma_tables.theories.calibrated.theory import Calibrated
from mbma_tables.theories.simulated import map_gaps, own_map
from mbma_tables.theories.simulated.energy_spline import LoadCurve
from mbma_tables.theories.simulated.grids import (
    FULL,
    GRIDS,
    HALF,
    TESTED_AREAS,
    Grid,
    steps_along,
)
from mbma_tables.theories.simulated.pressing import AREA_OF_FLOW, Press

# scatter increases by this power of a map's `sensitivity_at` over that of most maps, found
# between these A/A0
POWER = 0.75
TYPICAL = 0.0025
SENSITIVE = (0.003, 0.95)
# of ln A by the map's own grid at `MIN_POINTS` steps a wavelength: on a grid four times
# finer areas are 0.8 to 1.5% larger; of the second order in the step. Along a lay the edges
# of contacts lie alike on the grid, so that fewer of them are independent, by the anisotropy:
# on a grid twice as fine, areas of ridges differ by up to 30% at 0.6% contact, 9% at 6%
GRID = 0.012
# of the other quantities, against grids twice and four times as fine, on 127 raw maps of 24 kinds
# (`python -m generate raw_maps`): peaks between the points are higher by so many times the
# gradient times the step, which changes the gap; of ln of the stiffness; and of ln flow over
# d ln K/d ln u, which is large where an axis closes
GRID_GAP = 0.0042
GRID_STIFFNESS = 0.008
GRID_FLOW = 0.009
NEAR = 1.02  # times a gap, at which that slope is found
EVALUATED = 1e-5  # error of the curves through the loads; laws need not be more accurate
STEEPEST = 8.0  # largest power of u - u1 by which an axis closes
MATCHED = 1e-6  # relative, of the surface that is asked about


class BoundaryElements(Theory):
    """BEM results of one map at a row of loads, made by `of` or `from_netcdf`, and curves between them.

    Attributes
    ----------
    surface : MeasuredSurface
        The map; other surfaces raise an error.
    rows : ndarray, shape (4, n)
        Pressure over E*, A/A0, u [length] and elastic energy over A0 E* [length] of the loads.
    points : float
        Sampling steps per shortest wavelength; below four, areas are too large and results
        are not `valid`.

    Notes
    -----
    The curves are those of `energy_spline`; beyond the loads no answer is `valid`. They are the
    theory: `error` is that of evaluating them, and how far they are from contact simulated at a load between is the
    `scatter`, which was measured on 142 maps.

    Examples
    --------
    >>> import numpy as np
    >>> from mbma_tables import Surface, contact
    >>> from mbma_tables.theories import BoundaryElements
    >>> noise = np.fft.rfft2(np.random.default_rng(1).standard_normal((64, 64)))
    >>> q = np.hypot(np.fft.fftfreq(64)[:, None], np.fft.rfftfreq(64))
    >>> heights = np.fft.irfft2(np.where((q > 0.05) & (q < 0.25), noise, 0))
    >>> truth = BoundaryElements.of(Surface.from_map(heights, 1.0, periodic=True))
    >>> found = contact(truth.surface, area=0.2, theory=truth)
    >>> f"u = {found.mean_separation / truth.surface.h_rms:.2f} h_rms"
    'u = 0.71 h_rms'
    """

    name = "simulated"
    bends_in_area = True
    of_yielded_gaps = False  # whether its flow is that of gaps that yielded

    def __init__(
        self,
        surface: MeasuredSurface,
        rows: FloatArray,
        points: float,
        pressed: Press | MapSimulation,
        origin: str,
        grid: Grid = FULL,
        top: float | None = None,
        given: MeasuredSurface | None = None,
    ) -> None:
        self.grid = grid
        self.given = surface if given is None else given
        # a table without its map is not pressed anew
        self.presses_anew = isinstance(pressed, Press) and grid.simulates_all
        self.surface, self.rows, self.points, self.pressed, self.origin = (
            surface,
            rows,
            points,
            pressed,
            origin,
        )
        # the highest point, of the surface unless it is another after a load
        top = float(surface.h_max) if top is None else top
        steps = np.diff(rows)
        if not (
            (rows > 0).all()
            and (steps[:2] >= 0).all()
            and (steps[2] < 0).all()
            and rows[2, 0] < top
        ):
            raise OutOfRangeError(
                f"the simulation of this map is no law up to h_max = {top:.4g}: at rising loads, areas {rows[1]} must "
                f"rise, and mean separations {rows[2]} fall from below h_max"
            )
        self.fit = LoadCurve(rows, top)

    @classmethod
    def of(cls, surface: AnySurface, grid: str = FULL.name) -> BoundaryElements:
        """Simulate the map of a surface from `Surface.from_map`, on a grid as of `Simulated`.

        Loads in `common.cache`, or for the full grid in the surface's `table`, are reused.

        Raises
        ------
        InputError
            For a surface that was not made from a map, or whose map is not known after a change.
        ConvergenceError
            Where boundary elements do not converge.
        """
        chosen = GRIDS[grid]
        table = (
            surface.table
            if isinstance(surface, MeasuredSurface) and chosen.name == FULL.name
            else None
        )
        if table is not None:
            return cls(surface, table.rows, table.points, table, table.origin)  # type: ignore[arg-type]
        own_map.map_of(surface)
        assert isinstance(surface, MeasuredSurface)
        simulated = own_map.resolved(surface, chosen)
        whole = own_map.map_of(simulated)
        steps = steps_along(simulated, whole)
        mirrored = not whole.periodic
        values, points, cut = own_map.reduced(
            whole.heights - whole.heights.mean(), steps, mirrored, chosen
        )
        press = Press(
            values,
            own_map.sides(whole),
            own_law(simulated).gradient,
            chosen.tolerance,
            mirrored,
            left_out=cut * max(whole.steps),
        )
        force, rows = press.loads(own_map.law_loads(simulated, chosen.areas), True)
        digest = hashlib.sha256(
            np.ascontiguousarray(whole.heights, "<f8").tobytes()
        ).hexdigest()[:16]
        own = f"of the map of {' x '.join(map(str, whole.heights.shape))} points with SHA-256 {digest}"
        origin = f"boundary elements, tolerance {chosen.tolerance:g}, {own}"
        rows = _rising(np.array([force, *rows]), chosen.tested[0])
        return cls(simulated, rows, points, press, origin, chosen, given=surface)

    def to_netcdf(self, path: os.PathLike[str] | str) -> None:
        """Write a table that opens without the map.

        Raises
        ------
        InputError
            For another grid than the full one, of which tables are.
        TableFileError
            For a file that cannot be written.
        """
        if self.grid.name != FULL.name:
            raise InputError(
                f"a table is of the grid 'full', and this simulation is of {self.grid.name!r}: "
                "write that of Simulated(grid='full')"
            )
        own_map.write_table(self, path)

    @classmethod
    def from_netcdf(cls, path: os.PathLike[str] | str) -> BoundaryElements:
        """Open such a table (`TableFileError` if damaged or edited); for its `.surface` "simulated" is the default."""
        return cls.of(own_map.read_surface(path))

    def surface_of(self, surface: AnySurface) -> AnySurface:
        """The surface that is simulated: the given one, without wavelengths that no grid resolves."""
        return self.surface if surface is self.given else surface

    def departures(self, surface: AnySurface) -> tuple[str, ...]:
        """What is doubtful about the measurement; the theory is of this map, whatever its statistics."""
        return surface.doubts

    def bends(self, surface: AnySurface) -> FloatArray:
        """Mean separations [length] of the first and the last load."""
        return self.rows[2, [-1, 0]]

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and stiffness at mean separations u [length]; an error for surfaces other than this map."""
        x = self.fit.log_force(self._within(surface, mean_separation))
        return TheoryAnswer(
            np.exp(x),
            self.fit.area(x),
            self.fit.stiffness(x),
            np.full(np.shape(x), EVALUATED),
        )

    def inverted(
        self, surface: AnySurface, quantity: str, wanted: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        if quantity == "area":
            require(quantity, wanted, wanted < 1, "less than 1")
        with np.errstate(divide="ignore"):
            x = (
                np.log(wanted)
                if quantity == "pressure"
                else self.fit.log_force_at(wanted)
            )
        u = self.fit.separation(x)
        require(
            quantity,
            wanted,
            u > np.finfo(float).eps * self.rows[2, 0],
            "less: the mean separation vanishes",
        )
        return u, np.zeros(np.shape(wanted), bool)

    def energy(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        return self.fit.energy(self.fit.log_force(self._within(surface, mean_separation)))

    def heights(self, surface: AnySurface) -> Any:
        """The map's own bearing curve, for a hardness."""
        return Calibrated().heights(surface)

    def reasons(
        self, surface: AnySurface, answer: TheoryAnswer, mean_separation: FloatArray
    ) -> dict[str, Any]:
        area = answer.area
        left_out = self.pressed.left_out
        coarse = (
            f"the map's shortest wavelength has {self.points:.2g} sampling steps, fewer "
            f"than {MIN_POINTS:g}"
        )
        whole = self.surface.map
        if whole is None:
            coarse += f": simulate it again with a short_cutoff of {MIN_POINTS:g} steps"
        else:
            step = max(whole.steps)
            cutoff = resolving(self.points * step, step, self.surface.unit)
            coarse += (
                f": contact(Surface.from_map(..., {cutoff}), ..., theory={self.grid.call})"
                " simulates what is resolved"
            )
        cut = (
            f"wavelengths below {left_out:.4g} were left out, since the grid has fewer "
            "points than the map"
        )
        fits = whole is not None and whole.heights.size <= FULL.most_points
        if self.grid.name != FULL.name and fits:
            cut += f": contact(surface, ..., theory={FULL.call}) leaves none out"
        return {
            coarse: np.full(area.shape, self.points < MIN_POINTS * (1 - ROUNDING)),
            cut: np.full(area.shape, left_out > 0),
            **self._untested(area),
        }

    def _untested(self, area: FloatArray) -> dict[str, Any]:
        """Contacts lighter or heavier than this grid, and than any grid, was tested at."""
        least, most = self.grid.tested
        lightest, heaviest = FULL.tested
        call = f"contact(surface, ..., theory={FULL.call})"
        reasons = {
            f"A/A0 is below {lightest:g}, the lightest contact that was tested": (
                area < lightest
            )
            & (area > 0),
            f"A/A0 is above {heaviest:g}, the heaviest contact that was tested": (
                area > heaviest
            ),
        }
        if (least, most) != (lightest, heaviest):
            reasons[
                f"A/A0 is below {least:g}: {call} was tested from {lightest:g} on"
            ] = (area < least) & (area >= lightest)
            reasons[f"A/A0 is above {most:g}: {call} was tested up to {heaviest:g}"] = (
                area > most
            ) & (area <= heaviest)
        return reasons

    def evidence(self, surface: AnySurface) -> str:
        return tested.evidence(self.grid.rows, ["area"])

    def scatter(self, surface: AnySurface, quantity: str, area: FloatArray) -> FloatArray:
        """Standard deviation against the full grid at tolerance 1e-6, of areas a finer one; NaN beyond the loads."""
        with np.errstate(divide="ignore"):
            usual = np.interp(
                np.log(area), np.log(TESTED_AREAS), self.grid.scatters[quantity]
            )
        stated = usual * (self.sensitivity_at(area) / TYPICAL) ** POWER
        stated = np.hypot(stated, self._of_own_grid(quantity, area))
        low, high = self.rows[1, [0, -1]]
        return np.where(
            (area < low * (1 - ROUNDING)) | (area > high * (1 + ROUNDING)), np.nan, stated
        )

    def _of_own_grid(self, quantity: str, area: FloatArray) -> Any:
        """Standard deviation of ln of a quantity by the sampling step, beside that between loads."""
        coarse = (MIN_POINTS / self.points) ** 2
        if quantity == "area":
            return GRID * coarse * (self.surface.anisotropy or 1.0) ** 0.5
        if quantity == "stiffness":
            return GRID_STIFFNESS * coarse
        if quantity != "pressure":
            return 0.0
        low, high = self.rows[1, [0, -1]]
        x = self.fit.log_force_at(np.clip(area, low, high))
        # the step, and the height between the points, at four steps a wavelength
        step = self.surface.shortest(ROUNDED) / self.points
        height = GRID_GAP * self.surface.rms_gradient * step * coarse**0.5
        return height * self.fit.stiffness(x) / np.exp(x)

    @shared_property
    def changes(self) -> FloatArray:
        """Change of ln F at the gap of each load when it is left out of the curves; NaN where that is not tried."""
        low, high = SENSITIVE
        area = self.rows[1, 1:-1]
        changes = np.full(self.rows.shape[1], np.nan)
        for load in np.flatnonzero((area > low) & (area < high)) + 1:
            others = LoadCurve(np.delete(self.rows, load, axis=1), self.fit.top)
            changes[load] = abs(others.log_force(self.rows[2, load]) - self.fit.x[load])
        return changes

    @property
    def part_of_map(self) -> str:
        """Which points of the map were simulated, if not all of them."""
        whole = self.surface.map
        if whole is None or not isinstance(self.pressed, Press):
            return ""
        return own_map.which_points(len(whole.heights) // len(self.pressed.heights))

    @property
    def sensitivity(self) -> float:
        """Mean of `changes`."""
        return float(np.nanmean(self.changes))

    def sensitivity_at(self, area: FloatArray) -> FloatArray:
        """The mean of `changes`, or the larger one at both ends of the interval between loads if that is larger."""
        changes = np.nan_to_num(self.changes)
        intervals = np.maximum(changes[1:], changes[:-1])
        number = np.searchsorted(self.rows[1], area, side="right") - 1
        local = intervals[np.clip(number, 0, intervals.size - 1)]
        return np.asarray(np.maximum(local, self.sensitivity))

    def gaps(self) -> Any:
        return self

    @shared_property
    def gaps_of_loads(self) -> FloatArray | None:
        """Gaps over u at each load, at the shares of `gap_law`; None of a table without its map."""
        if not isinstance(self.pressed, Press):
            return None
        force, area, u, _ = self.rows
        gaps = [
            map_gaps.of_map(self.pressed(load)[1], share, mean)
            for load, share, mean in zip(force.tolist(), area, u, strict=True)
        ]
        return np.asarray(np.array(gaps) / u[:, None])

    def open_gaps(
        self, surface: AnySurface, mean_separation: FloatArray, area: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Those of the map, between loads by ln u; of a table without its map by `gap_law`."""
        known = self.gaps_of_loads
        if known is None:
            return super().open_gaps(surface, mean_separation, area)
        u, contact = np.broadcast_arrays(mean_separation, area)
        log_u = np.log(self.rows[2])
        with np.errstate(divide="ignore"):
            x = np.clip(np.log(u), log_u[-1], log_u[0])
        curve = interp1d(log_u[::-1], np.log(known[::-1]), axis=0)
        _, weight = gap_law.rule()
        share = weight * (1 - contact[..., None])
        gaps = np.exp(curve(x))
        mean = (share * gaps).sum(axis=-1, keepdims=True)
        return share, gaps * (u[..., None] / mean)

    @shared_property
    def flows(self) -> tuple[FloatArray, FloatArray]:
        """Mean gaps, falling, and flow coefficients xx, yy and xy there, found when they are first read."""
        if not self.grid.simulates_all:
            # those of the full grid, at the gaps that this one has under the same loads; on
            # half of the points where this one has fewer, too
            assert self.surface.map is not None
            assert isinstance(self.pressed, Press)
            is_whole = self.pressed.heights.size >= self.surface.map.heights.size
            full = simulation_of(self.surface, FULL.name if is_whole else HALF.name)
            full_gaps, flow = full.flows
            return self.fit.separation(full.fit.log_force(full_gaps)), flow
        return self.pressed.flows(self.fit.x, self.fit.separation)

    def flow(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        """Flow coefficients xx, yy and xy [length^3], by the gaps; 0 from the load on at which an axis is blocked."""
        # ln K is a monotone cubic of ln(u - u1) where an axis closes at u1; xy is sqrt(xx
        # yy) times what is linear in u bodies apart are farther apart than the theory needs
        u = np.maximum(self._within(surface, mean_separation), mean_separation)
        gaps, known = self.flows
        found = np.zeros((3, *u.shape))
        for axis, (last, end, _) in enumerate(self.closing):
            passing = (gaps >= last) & (known[:, axis] > 0)
            if passing.any():
                x = np.log(gaps[passing][::-1] - end)
                y = np.log(known[passing, axis][::-1])
                if x.size == 1:
                    x = np.append(x - 1, x)
                    y = np.append(y - 3, y)
                curve = PchipInterpolator(x, y)
                with np.errstate(divide="ignore"):
                    own = np.log(np.maximum(np.minimum(u, gaps[0]) - end, 0.0))
                below = max(float(curve(x[0], 1)), 1.0) * np.minimum(own - x[0], 0.0)
                found[axis] = np.exp(curve(np.maximum(own, x[0])) + below)
                # towards parallel planes, which pass the cube of their distance
                wide = u**3 - (gaps[0] ** 3 - known[0, axis]) * u / gaps[0]
                found[axis] = np.where(u > gaps[0], wide, found[axis])
        with np.errstate(divide="ignore", invalid="ignore"):
            turn = np.nan_to_num(known[:, 2] / np.sqrt(known[:, 0] * known[:, 1]))
        found[2] = np.sqrt(found[0] * found[1]) * np.interp(-u, -gaps, turn)
        return found

    @shared_property
    def closing(self) -> list[tuple[float, float, float]]:
        """Of both axes, u of the last open load, u1 at which it closes, and u of the first blocked load [length]."""
        gaps, known = self.flows
        u = np.append(gaps, 0.0)
        found = []
        for axis, count in enumerate(np.cumprod(known[:, :2] > 0, axis=0).sum(axis=0)):
            end = blocked = float(u[count])
            if count > 1:
                # between the last two open loads the power of u - u1 is at most STEEPEST
                ratio = (known[count - 2, axis] / known[count - 1, axis]) ** (
                    1 / STEEPEST
                )
                end = (
                    max(end, float((ratio * u[count - 1] - u[count - 2]) / (ratio - 1)))
                    if ratio > 1
                    else end
                )
            found.append((float(u[max(count - 1, 0)]), end, blocked))
        return found

    def flow_trust(
        self, surface: AnySurface, mean_separation: FloatArray, area: FloatArray
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Standard deviation of ln of that flow on tested maps, and a mask where an axis may be blocked."""
        near = [
            (mean_separation < last) & (mean_separation > blocked)
            for last, _, blocked in self.closing
        ]
        reasons = {
            "leakage: the map may be blocked, as it is at the next simulated load": np.logical_or(
                *near
            ),
            f"leakage: A/A0 is above {AREA_OF_FLOW:g}": area > AREA_OF_FLOW,
        }
        between = self.scatter(surface, "flow", area)
        own = GRID_FLOW * (MIN_POINTS / self.points) ** 2
        return np.hypot(between, own * self._steepness(surface, mean_separation)), reasons

    def _steepness(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        """The largest d ln K/d ln u of both axes, of those that are not blocked."""
        u = np.asarray(mean_separation, float)
        with np.errstate(divide="ignore", invalid="ignore"):
            here, beside = (np.log(self.flow(surface, by * u)[:2]) for by in (1.0, NEAR))
            slopes = (beside - here) / np.log(NEAR)
        return np.asarray(np.where(np.isfinite(slopes), slopes, 0.0).max(axis=0))

    def _within(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        """Mean separations of this map; bodies that are apart are at first contact."""
        for name in ("h_rms", "h_max"):
            own = float(getattr(self.surface, name))
            other = float(getattr(self.given, name))
            given = np.asarray(getattr(surface, name))
            good = np.abs(given - own) <= MATCHED * own
            good |= np.abs(given - other) <= MATCHED * other
            require(
                name,
                given,
                good,
                f"{own:.9g}: a simulation of one map is for that map only, its .surface",
            )
        u = np.broadcast_to(
            np.asarray(mean_separation, float),
            np.broadcast_shapes(np.shape(mean_separation), surface.shape),
        )
        require("mean_separation", u, u >= 0, "at least 0")
        return np.asarray(np.minimum(u, self.fit.top))

    def highest(self, surface: AnySurface) -> FloatArray:
        """The highest point of the map, which after a load may be another."""
        return np.asarray(self.fit.top)

    def interval(
        self, surface: AnySurface, quantity: str = "pressure"
    ) -> tuple[FloatArray, FloatArray]:
        return np.zeros(()), np.asarray(self.fit.top)


def _rising(rows: FloatArray, lightest: float) -> FloatArray:
    """Loads without those of a few touching elements, lighter than any tested, whose area exceeds the next one's."""
    while True:
        falls = (np.diff(rows[1]) < 0) & (rows[1, :-1] < lightest)
        if not falls.any():
            return rows
        rows = np.delete(rows, int(np.argmax(falls)), axis=1)


@shared(8)
def simulation_of(surface: AnySurface, grid: str) -> BoundaryElements:
    """The simulation of a surface's map on a grid, cached."""
    return BoundaryElements.of(surface, grid)
