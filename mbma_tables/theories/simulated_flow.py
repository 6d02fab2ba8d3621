"""Flow through the gaps of a simulated map, along both axes."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from mbma_tables.common.arguments import FloatArray, require
from mbma_tables.laws.energy_spline import LoadCurve
from mbma_tables.laws.pressing import Press, Table
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.protocol import Theory

# A/A0 up to which flow along both axes was open on most maps, so that its scatter is known
AREA_OF_FLOW = 0.2
MATCHED = 1e-6  # relative, of the surface that is asked about


class SimulatedFlow(Theory):
    """A theory of one map whose gaps, and so their flow, may be known (`pressed`)."""

    pressed: Press | Table | None
    surface: AnySurface
    fit: LoadCurve  # curves through its loads

    def gaps(self) -> Any:
        """Itself, if the flow is known."""
        return None if self.pressed is None else self

    @functools.cached_property
    def _flows(self) -> tuple[FloatArray, FloatArray]:
        """Mean gaps, falling, and flow coefficients xx, yy and xy there, found when they are first read."""
        assert self.pressed is not None
        return self.pressed.flows(self.fit.x, self.fit.separation)

    def flow(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray | None:
        """Flow coefficients xx, yy and xy [length^3], by the gaps; 0 from the load on at which an axis is blocked.

        Along an axis that closes at u1, ln K over ln(u - u1) is a monotone cubic, straight below the last open load;
        xy is sqrt(xx yy) times what is linear in u.
        """
        if self.pressed is None:
            return None
        # bodies apart are farther apart than the theory needs
        u = np.maximum(self._within(surface, mean_separation), mean_separation)
        gaps, known = self._flows
        found = np.zeros((3, *u.shape))
        for axis, (last, end) in enumerate(self.closing):
            passing = (gaps >= last) & (known[:, axis] > 0)
            if passing.any():
                x, y = np.log(gaps[passing][::-1] - end), np.log(known[passing, axis][::-1])
                if x.size == 1:
                    x, y = np.append(x - 1, x), np.append(y - 3, y)
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

    @functools.cached_property
    def closing(self) -> list[tuple[float, float]]:
        """Of both axes, u of the last load at which it is open and of the first at which it is blocked [length]."""
        gaps, known = self._flows
        u = np.append(gaps, 0.0)
        return [(float(u[max(k - 1, 0)]), float(u[k])) for k in np.cumprod(known[:, :2] > 0, axis=0).sum(axis=0)]

    def flow_trust(
        self, surface: AnySurface, mean_separation: FloatArray, area: FloatArray
    ) -> tuple[FloatArray, dict[str, Any]] | None:
        """Standard deviation of ln of that flow on tested maps, and a mask where an axis may be blocked."""
        if self.pressed is None:
            return None
        near = [(mean_separation < last) & (mean_separation > end) for last, end in self.closing]
        reasons = {
            "leakage: the map may be blocked, as it is at the next simulated load": np.logical_or(*near),
            f"leakage: A/A0 is above {AREA_OF_FLOW:g}": area > AREA_OF_FLOW,
        }
        return self.scatter(surface, "flow", area), reasons

    def _within(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        for name in ("h_rms", "h_max"):
            own, given = float(getattr(self.surface, name)), np.asarray(getattr(surface, name))
            good = np.abs(given - own) <= MATCHED * own
            require(name, given, good, f"{own:.9g}: a simulation of one map is for that map only, its .surface")
        shape = np.broadcast_shapes(np.shape(mean_separation), surface.shape)
        u = np.broadcast_to(np.asarray(mean_separation, float), shape)
        low, high = map(float, self.interval(self.surface))
        if self.ends_at_h_max:
            # bodies are apart beyond h_max
            require("mean_separation", u, u >= 0, "at least 0")
            return np.asarray(np.minimum(u, high))
        good = (u >= low * (1 - 1e-12)) & (u <= high * (1 + 1e-12))
        require("mean_separation", u, good, f"between {low:.6g} and {high:.6g}, which were simulated")
        return np.asarray(np.clip(u, low, high))
