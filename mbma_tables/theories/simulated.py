"""BEM simulation of one map, as a theory of that map alone: `theory="simulated"`."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.common.arguments import FloatArray, finite_array, require
from mbma_tables.common.errors import InputError
from mbma_tables.laws.energy_spline import Continued, LoadCurve, left_out
from mbma_tables.laws.pressing import HIGHEST, LOWEST, ROUNDING, TOLERANCE, Press, Table
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.maps import measured_map, prepared
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.theories import own_map
from mbma_tables.theories.calibrated import Calibrated
from mbma_tables.theories.calibrated_curves import own_law
from mbma_tables.theories.own_table import read_surface, write_table
from mbma_tables.theories.protocol import TheoryAnswer
from mbma_tables.theories.simulated_flow import SimulatedFlow

MIN_LOADS = 4
STRAYS = 2.7  # roots of the elements that join between two loads: beyond strays one path in 10^6 (Kolmogorov)
# A/A0 of the 65 maps of `python -m generate machined` at which scatter was measured
TESTED_AREAS = (0.003, 0.025, 0.067, 0.14, 0.39, 0.58, 0.78)
EVALUATED = 1e-5  # error of the curves through the default loads; laws need not be more accurate


class BoundaryElements(SimulatedFlow):
    """BEM results of one map at a list of loads, and curves between them.

    Parameters
    ----------
    surface : MeasuredSurface
        The map; other surfaces raise an error.
    pressure : array_like, shape (n,)
        Loads over A0 E*, rising, at least four.
    area, mean_separation, energy : array_like, shape (n,)
        A/A0, u [length] and elastic energy over A0 E* [length] at these loads.
    points : float, optional
        Sampling steps per shortest wavelength; below four, areas are too large and results are not `valid`.
    elements : float, optional
        Of the map that do not repeat each other; 1, where the number is not known, leaves `error` to the first bound.
    pressed : Press or Table, optional
        What they are of, from which the flow is known.
    origin : str, optional
        Description of the map and of the simulation.
    own_loads : bool, optional
        Whether the loads are those of `of`, of which the scatter was measured; else it is NaN, and contacts lighter and
        heavier than the loads are refused.

    Notes
    -----
    Between loads the curves are those of `mbma_tables.laws.energy_spline`. The default loads' go on beyond them
    (`Continued`), where no answer is `valid`; these curves are the theory, `error` is that of evaluating them, and how
    far they are from contact simulated at a load between is the `scatter`, which was measured on 65 maps.

    For the user's own loads this scatter is not known, and `error` bounds it: pressure and area increase with
    compression, so they lie between the values of the two neighbouring loads. A smaller bound is the sum of two
    estimates: the change when one of the four nearest loads is omitted, and the random deviation of the number of
    elements in contact from a curve if elements join in random order, which they do not in maps that repeat
    themselves. At 0.1% contact of a small map few elements are in contact, and half of the area is uncertain.
    """

    name = "simulated"
    areas: tuple[float, ...] = own_map.AREAS  # by the law of the map, at its loads
    tolerance, tested = TOLERANCE, (LOWEST, HIGHEST)  # of boundary elements; A/A0
    # standard deviations against contact on the full grid at tolerance 1e-6, at `TESTED_AREAS`, which lie between the
    # loads: the larger of the 68% quantile and half of the 95% quantile of the errors
    scatters: Mapping[str, tuple[float, ...]] = MappingProxyType(
        {
            "area": (0.0443, 0.0191, 0.00644, 0.00653, 0.00586, 0.00316, 0.00536),
            "pressure": (0.0036, 0.00256, 0.000305, 0.000576, 0.000428, 0.000176, 0.00162),
            "stiffness": (0.0272, 0.0151, 0.00727, 0.00614, 0.00724, 0.00315, 0.00628),
            "flow": (0.00926, 0.0461, 0.0379, 0.0701, 0.0701, 0.0701, 0.0701),
        }
    )

    def departures(self, surface: AnySurface) -> tuple[str, ...]:
        """None: the theory is of this map."""
        return ()

    def __init__(
        self,
        surface: AnySurface,
        pressure: ArrayLike,
        area: ArrayLike,
        mean_separation: ArrayLike,
        energy: ArrayLike,
        points: float = np.inf,
        elements: float = 1.0,
        pressed: Press | Table | None = None,
        own_loads: bool = False,
        origin: str = "",
    ) -> None:
        self.surface, self.points, self.elements, self.origin = surface, points, elements, origin
        self.pressed, self.own_loads = pressed, own_loads
        columns = {"pressure": pressure, "area": area, "mean_separation": mean_separation, "energy": energy}
        rows = np.stack([finite_array(name, column) for name, column in columns.items()])
        if rows.ndim != 2 or rows.shape[1] < MIN_LOADS:
            raise InputError(f"at least {MIN_LOADS} loads are needed, got shape {rows.shape[1:]}")
        require("loads", rows, rows > 0, "positive")
        require("pressure", rows[0], np.diff(rows[0], prepend=0) > 0, "rising")
        require("area", rows[1], np.diff(rows[1], prepend=0) >= 0, "rising")
        require("mean_separation", rows[2], np.diff(rows[2], prepend=np.inf) < 0, "falling")
        self.rows = rows
        # an h_max that was stated may lie below the gap of the first load
        self.ends_at_h_max = own_loads and bool(rows[2, 0] < float(np.asarray(surface.h_max)))
        self.fit = Continued(rows, float(np.asarray(surface.h_max))) if self.ends_at_h_max else LoadCurve(rows)
        self._left_out = left_out(rows)

    @classmethod
    def of(
        cls, surface: AnySurface, loads: Sequence[float] | None = None, tolerance: float | None = None
    ) -> BoundaryElements:
        """Simulate the map of a surface from `Surface.from_map`; loads in `common.cache` or in its `table` are reused.

        Raises
        ------
        InputError
            For a surface that was not made from a map, or whose map is not known after a change.
        """
        table = surface.table if isinstance(surface, MeasuredSurface) and cls is BoundaryElements else None
        if table is not None and loads is None:
            F, A, u, U = table.rows
            return cls(surface, F, A, u, U, table.points, table.elements, table, True, table.origin)
        whole = own_map.map_of(surface)
        assert isinstance(surface, MeasuredSurface)
        steps, mirrored = own_map.steps_along(surface, whole), not whole.periodic
        values, points, cut = own_map.reduced(whole.heights - whole.heights.mean(), steps, mirrored)
        gradient = own_law(surface).gradient
        if loads is None:
            wanted = own_map.law_loads(surface, cls.areas)
        else:
            given = finite_array("loads", loads)
            require("loads", given, (given > 0) & (np.diff(given, prepend=0) > 0), "positive and rising")
            wanted = gradient * given
        accuracy = cls.tolerance if tolerance is None else tolerance
        settings: Any = {"mirrored": mirrored, "left_out": cut * max(whole.steps)}
        press = Press(values, own_map.sides(whole), gradient, accuracy, **settings)
        pressure, (area, u, energy) = press.loads(wanted, loads is None)
        # flow by the accurate gaps
        gaps = press if accuracy <= TOLERANCE else Press(values, own_map.sides(whole), gradient, **settings)
        size, origin = whole.heights.size, own_map.origin_of(whole, accuracy)
        return cls(surface, pressure, area, u, energy, points, size, gaps, loads is None, origin)

    @classmethod
    def from_map(
        cls,
        heights: Any,
        dx: Any = None,
        dy: Any = None,
        *,
        periodic: bool | None = None,
        detrend: str | None = None,
        loads: Sequence[float] | None = None,
        tolerance: float | None = None,
        **treatment: Any,
    ) -> BoundaryElements:
        """Simulate a map by boundary elements: about two seconds for 256 x 256 points, one core.

        Parameters
        ----------
        heights, dx, dy, periodic, detrend, **treatment
            As for `mbma_tables.Surface.from_map`. A map that is not periodic is continued by its mirror images, in
            twice the time.
        loads : sequence of float, optional
            F/(A0 E* g), g the rms gradient, rising; by default twelve at which the law of the map has areas from 0.07%
            to 95%, and more if these do not cover 0.1% to 90% contact. With eight or more sampling steps along
            the shortest wavelength, those above 6% contact then use every second step.
        tolerance : float, optional
            Of the boundary elements, 1e-5 by default.

        Raises
        ------
        ConvergenceError
            Where boundary elements do not converge.

        Examples
        --------
        >>> import numpy as np
        >>> from mbma_tables import contact
        >>> from mbma_tables.theories import BoundaryElements
        >>> noise = np.fft.rfft2(np.random.default_rng(1).standard_normal((64, 64)))
        >>> q = np.hypot(np.fft.fftfreq(64)[:, None], np.fft.rfftfreq(64))
        >>> heights = np.fft.irfft2(np.where((q > 0.05) & (q < 0.25), noise, 0))
        >>> truth = BoundaryElements.from_map(heights, dx=1.0, periodic=True, loads=[0.02, 0.05, 0.1, 0.2, 0.4])
        >>> found = contact(truth.surface, area=0.2, theory=truth)
        >>> f"u = {found.mean_separation / truth.surface.h_rms:.2f} h_rms"
        'u = 0.71 h_rms'
        """
        treated = prepared(heights, {"dx": dx, "dy": dy, "periodic": periodic, "detrend": detrend, **treatment})
        return cls.of(MeasuredSurface.of(measured_map(treated, None)), loads, tolerance)

    def to_netcdf(self, path: os.PathLike[str] | str) -> None:
        """Write the results, with the spectrum and curves of the surface, as a table that opens without the map.

        Raises
        ------
        InputError
            With loads of one's own.
        TableFileError
            Where the file cannot be written.
        """
        write_table(self, path)

    @classmethod
    def from_netcdf(cls, path: os.PathLike[str] | str) -> BoundaryElements:
        """Open such a table (`TableFileError` if damaged or edited); for its `.surface` "simulated" is the default."""
        return cls.of(read_surface(path))

    def _error(self, u: FloatArray, found: FloatArray) -> FloatArray:
        """Bound on the relative error of pressure and area, from their logarithms at mean separations."""
        if self.own_loads:
            return np.full(np.shape(u), EVALUATED)
        k = np.clip(np.searchsorted(-self.rows[2], -u) - 1, 0, self.rows.shape[1] - 2)
        low, high = np.log(self.rows[:2, k]), np.log(self.rows[:2, k + 1])
        joining = np.sqrt((self.rows[1, k + 1] - self.rows[1, k]) / self.elements) / np.exp(found[1])
        likely = self._left_out[:, k] + STRAYS * joining
        above, below = np.expm1(np.minimum(found - low, likely)), -np.expm1(-np.minimum(high - found, likely))
        return np.asarray(np.maximum(above, below).max(axis=0))

    def interval(self, surface: AnySurface, quantity: str = "pressure") -> tuple[FloatArray, FloatArray]:
        """Mean separations [length] covered."""
        if self.ends_at_h_max:
            return np.asarray(0.0), np.asarray(surface.h_max, float)
        return np.asarray(self.rows[2, -1]), np.asarray(self.rows[2, 0])

    def bends(self, surface: AnySurface) -> FloatArray:
        """Mean separations [length] of the first and the last load, if the curves go beyond them."""
        return self.rows[2, [-1, 0]] if self.ends_at_h_max else np.empty(0)

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and stiffness at mean separations u [length]; an error for surfaces other than this map."""
        u = self._within(surface, mean_separation)
        x = self.fit.log_force(u)
        area, stiffness = self.fit.area(x), self.fit.stiffness(x)
        with np.errstate(all="ignore"):
            return TheoryAnswer(np.exp(x), area, stiffness, self._error(u, np.array([x, np.log(area)])))

    def inverted(self, surface: AnySurface, quantity: str, wanted: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Mean separation [length] at a pressure over E* or an area between those of the first and the last load."""
        known = wanted
        if not self.ends_at_h_max:
            low, high = self.rows[0 if quantity == "pressure" else 1, [0, -1]]
            good = (wanted >= low * (1 - 1e-12)) & (wanted <= high * (1 + 1e-12))
            require(quantity, wanted, good, f"between {low:.4g} and {high:.4g}, which were simulated")
            known = np.clip(wanted, low, high)
        elif quantity == "area":
            require(quantity, wanted, wanted < 1, "less than 1")
        with np.errstate(divide="ignore"):
            x = np.log(known) if quantity == "pressure" else self.fit.log_force_at(known)
        u = np.asarray(self.fit.separation(x))
        require(quantity, wanted, u > np.finfo(float).eps * self.rows[2, 0], "less: the mean separation vanishes")
        return u, np.zeros(np.shape(wanted), bool)

    def energy(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        """Elastic energy over A0 E* [length]."""
        return self.fit.energy(self.fit.log_force(self._within(surface, mean_separation)))

    def heights(self, surface: AnySurface) -> Any:
        """The map's own bearing curve, for a hardness."""
        return Calibrated().heights(surface)

    def reasons(self, surface: AnySurface, answer: TheoryAnswer, mean_separation: FloatArray) -> dict[str, Any]:
        """Reasons: grids that are too coarse, and contact areas that were not tested."""
        left_out = 0.0 if self.pressed is None else self.pressed.left_out
        cut = f"wavelengths below {left_out:.4g} were left out, since the map has too many points"
        return {
            **own_map.unresolved(self.points, answer.area),
            cut: np.full(answer.area.shape, left_out > 0),
            f"A/A0 is below {self.tested[0]:g}": (answer.area < self.tested[0]) & (answer.area > 0),
            f"A/A0 is above {self.tested[1]:g}": answer.area > self.tested[1],
        }

    def scatter(self, surface: AnySurface, quantity: str, area: FloatArray) -> FloatArray:
        """Standard deviation against the full grid at tolerance 1e-6; NaN with loads of one's own, and beyond them."""
        with np.errstate(divide="ignore"):
            found = np.interp(np.log(area), np.log(TESTED_AREAS), self.scatters[quantity])
        return np.where(self.own_loads & ~self._beyond(area), found, np.nan)

    def _beyond(self, area: FloatArray) -> NDArray[np.bool_]:
        """Mask of contacts lighter or heavier than those simulated."""
        return np.asarray((area < self.rows[1, 0] * (1 - ROUNDING)) | (area > self.rows[1, -1] * (1 + ROUNDING)))
