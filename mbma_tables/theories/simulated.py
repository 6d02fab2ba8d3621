"""The last resort: one map pressed flat by boundary elements, as a theory of that map alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, finite_array, require
from mbma_tables.common.errors import InputError
from mbma_tables.laws.boundary_elements import LOADS, Contact
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.maps import measured_map, prepared
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.surfaces.treatment import Treated, mirrored
from mbma_tables.theories.protocol import Theory, TheoryAnswer

MIN_LOADS = 4
MIN_POINTS = 4.0  # sampling steps a wave, below which areas of boundary elements are too large
MATCHED = 1e-6  # relative, of the surface that is asked about
STRAYS = 2.7  # roots of the elements that join between two loads: beyond strays one path in 10^6 (Kolmogorov)


def continued(treated: Treated) -> tuple[FloatArray, tuple[float, float]]:
    """A map of mean zero whose edges meet, by its mirror images where it is not periodic, and its sides [length]."""
    values = treated.heights if treated.periodic else mirrored(treated.heights)
    sizes = values.shape[0] * treated.steps[0], values.shape[1] * treated.steps[1]
    return values - values.mean(), sizes


class BoundaryElements(Theory):
    """What boundary elements found of one map at a list of loads, and curves between them.

    Parameters
    ----------
    surface : MeasuredSurface
        The map; contacts of no other surface are answered.
    pressure : array_like, shape (n,)
        Loads over A0 E*, rising, at least four.
    area, mean_separation, energy : array_like, shape (n,)
        A/A0, u [length] and elastic energy over A0 E* [length] at these loads.
    points : float, optional
        Sampling steps along the shortest wave; below four areas are too large, and answers are not `valid`.
    elements : float, optional
        Of the map that do not repeat each other; 1, where the number is not known, leaves `error` to the first bound.

    Notes
    -----
    Between loads ln F and ln A follow ln u by monotone cubics; lighter and heavier contacts are refused. Both rise with
    compression: `error` there reaches at most to the values of the two loads beside. Less is stated where two things
    add up to less: what leaving out one of the four nearest loads changes, and how far the count of touching elements
    strays from a curve if those that join come in random order, which a map that repeats itself does not obey. At 0.1%
    contact of a small map that are a few elements, and half of the area is uncertain.
    """

    name = "boundary_elements"
    ends_at_h_max = False

    def departures(self, surface: AnySurface) -> tuple[str, ...]:
        """None: it is of this very map."""
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
    ) -> None:
        self.surface, self.points, self.elements = surface, points, elements
        columns = {"pressure": pressure, "area": area, "mean_separation": mean_separation, "energy": energy}
        rows = np.stack([finite_array(name, column) for name, column in columns.items()])
        if rows.ndim != 2 or rows.shape[1] < MIN_LOADS:
            raise InputError(f"at least {MIN_LOADS} loads are needed, got shape {rows.shape[1:]}")
        require("loads", rows, rows > 0, "positive")
        require("pressure", rows[0], np.diff(rows[0], prepend=0) > 0, "rising")
        require("area", rows[1], np.diff(rows[1], prepend=0) >= 0, "rising")
        require("mean_separation", rows[2], np.diff(rows[2], prepend=np.inf) < 0, "falling")
        self.rows = rows
        self._logs = np.log(rows)
        self._curves = self._between()
        self._left_out = self._changes()

    @classmethod
    def from_map(
        cls,
        heights: Any,
        dx: Any = None,
        dy: Any = None,
        *,
        periodic: bool | None = None,
        detrend: str | None = None,
        loads: Sequence[float] = LOADS,
        **treatment: Any,
    ) -> BoundaryElements:
        """Press a map flat by Tamaas (the extra `simulate`): half a minute for 256 x 256 points, one core.

        Parameters
        ----------
        heights, dx, dy, periodic, detrend, **treatment
            As for `mbma_tables.Surface.from_map`. A map that is not periodic is continued by its mirror images, four
            times the points.
        loads : sequence of float, optional
            F/(A0 E* g), g the rms gradient, rising; by default 15 from 0.1% to 97% contact.

        Raises
        ------
        MbmaError
            Where Tamaas is not installed.
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
        surface = MeasuredSurface.of(measured_map(treated, None))
        values, sizes = continued(treated)
        wanted = finite_array("loads", loads)
        require("loads", wanted, (wanted > 0) & (np.diff(wanted, prepend=0) > 0), "positive and rising")
        # of rms gradient 1, heights of order one
        known = surface.bearing
        assert known is not None
        gradient, scale = known.gradient, float(np.abs(values).max())
        engine = Contact(values / scale, (sizes[0] * gradient / scale, sizes[1] * gradient / scale))
        found = [engine.press(float(load)) for load in wanted]
        area, u, energy = (np.array([each[name] for each in found]) for name in ("area", "mean_separation", "energy"))
        points = 2 * np.pi / float(surface.q1) / max(treated.steps)
        return cls(surface, gradient * wanted, area, scale * u, gradient * scale * energy, points, treated.heights.size)

    def _between(self, without: int | None = None) -> Any:
        """ln F, ln A and ln U over ln u, perhaps without one load."""
        from scipy.interpolate import PchipInterpolator

        kept = self._logs if without is None else np.delete(self._logs, without, axis=1)
        return PchipInterpolator(kept[2, ::-1], kept[[0, 1, 3], ::-1], axis=1)

    def _changes(self) -> FloatArray:
        """Change of ln F and ln A that one of the four loads nearest to an interval makes, at most."""
        changes = np.zeros((2, self.rows.shape[1] + 2))
        for k in range(1, self.rows.shape[1] - 1):
            changes[:, k + 1] = np.abs(self._between(k)(self._logs[2, k])[:2] - self._logs[:2, k])
        return np.asarray(np.lib.stride_tricks.sliding_window_view(changes, 4, axis=1).max(axis=-1))

    def _error(self, u: FloatArray, found: FloatArray) -> FloatArray:
        """Bound on the relative error of force and area, from their logarithms at mean separations."""
        k = np.clip(np.searchsorted(-self.rows[2], -u) - 1, 0, self.rows.shape[1] - 2)
        low, high = self._logs[:2, k], self._logs[:2, k + 1]
        joining = np.sqrt((self.rows[1, k + 1] - self.rows[1, k]) / self.elements) / np.exp(found[1])
        likely = self._left_out[:, k] + STRAYS * joining
        above, below = np.expm1(np.minimum(found - low, likely)), -np.expm1(-np.minimum(high - found, likely))
        return np.asarray(np.maximum(above, below).max(axis=0))

    def interval(self, surface: AnySurface, quantity: str = "pressure") -> tuple[FloatArray, FloatArray]:
        """Mean separations [length] that were simulated."""
        return np.asarray(self.rows[2, -1]), np.asarray(self.rows[2, 0])

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and stiffness at mean separations u [length] of this map, and no other."""
        u = self._within(surface, mean_separation)
        log_u = np.log(u)
        found = self._curves(log_u)[:2]
        pressure, area = np.exp(found)
        stiffness = -self._curves(log_u, 1)[0] * pressure / u
        return TheoryAnswer(pressure, area, stiffness, self._error(u, found))

    def energy(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        """Elastic energy over A0 E* [length]."""
        return np.asarray(np.exp(self._curves(np.log(self._within(surface, mean_separation)))[2]))

    def concerns(self, surface: AnySurface, answer: TheoryAnswer, mean_separation: FloatArray) -> dict[str, Any]:
        """Reason against grids that are too coarse."""
        coarse = self.points < MIN_POINTS * (1 - 1e-6)
        text = f"the map's shortest wave has {self.points:.2g} sampling steps, fewer than {MIN_POINTS:g}"
        return {text: np.full(answer.area.shape, coarse)}

    def scatter(self, surface: AnySurface, area: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Zero: this is the simulation."""
        return np.zeros(np.shape(area)), np.zeros(np.shape(area))

    def stiffness_scatter(self, surface: AnySurface, area: FloatArray) -> FloatArray:
        """Not known: it is a slope between simulated loads."""
        return np.full(np.shape(area), np.nan)

    def _within(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        for name in ("h_rms", "h_max"):
            own, given = float(getattr(self.surface, name)), np.asarray(getattr(surface, name))
            good = np.abs(given - own) <= MATCHED * own
            require(name, given, good, f"{own:.9g}: boundary elements of one map know that map alone, their .surface")
        u = np.broadcast_to(
            np.asarray(mean_separation, float), np.broadcast_shapes(np.shape(mean_separation), surface.shape)
        )
        low, high = self.rows[2, -1], self.rows[2, 0]
        good = (u >= low * (1 - 1e-12)) & (u <= high * (1 + 1e-12))
        require("mean_separation", u, good, f"between {low:.6g} and {high:.6g}, which were simulated")
        return np.asarray(np.clip(u, low, high))
