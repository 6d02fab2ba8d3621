"""Interpolation between simulated loads of one surface, also by means of the elastic energy.

Lengths in one unit, force and energy over A0 E*. Since dU = -F du, the integral of u over F between two loads is known
exactly, ::

    integral from F1 to F2 of u dF = G2 - G1,    G = U + F u

so a cubic spline of u over ln F has an extra knot between each two loads, whose value follows from this integral.
A/A0 = erf(F exp(s)) with a natural cubic spline s of ln(erfinv(A)/F) over ln F. Where a spline is not monotone, as with
few, distant loads, monotone cubics through the loads replace it.

`Continued` extrapolates beyond the loads with the stiffness at the first and the last, ::

    light: F ~ (H - u)^n       heavy: F^2 linear in ln u       both: erfinv(A) ~ F

H being the height of the highest point: area and force in proportion at light load, and the area of Gaussian pressures
near full contact.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.special import erf, erfinv

from mbma_tables.common.arguments import FloatArray

NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
FINE = 64  # parts of an interval between loads: for inverses, and to see whether a spline is monotone
HALVINGS = 60
LARGEST_AREA = 1 - 1e-12


class LoadCurve:
    """Mean separation, area and energy between loads, by ln F; arguments are not checked.

    Parameters
    ----------
    rows : ndarray, shape (4, n)
        F/(A0 E*), rising, A/A0, rising, u [length], falling, and U/(A0 E*) [length].
    """

    def __init__(self, rows: FloatArray) -> None:
        force, area, mean_separation, energy = rows
        self.x = np.log(force)
        self.work = energy + force * mean_separation
        fine = self.x[:-1, None] + np.diff(self.x)[:, None] * np.arange(FINE) / FINE
        self._fine = np.append(fine, self.x[-1])
        self._spline: Any = _constrained(self.x, mean_separation, np.diff(self.work))
        self._slope = self._spline.derivative()
        if not (self._slope(self._fine) < 0).all():
            self._spline = PchipInterpolator(self.x, mean_separation)
            self._slope = self._spline.derivative()
        self._fine_u = np.minimum.accumulate(self._spline(self._fine))
        root = np.log(erfinv(np.minimum(area, LARGEST_AREA)))
        self._root: Any = CubicSpline(self.x, root - self.x, bc_type="natural")
        self._line = 1.0  # spline of the remainder beside ln F
        if not (self._root(self._fine, 1) > -1).all():
            self._root, self._line = PchipInterpolator(self.x, root), 0.0

    def separation(self, x: FloatArray) -> FloatArray:
        """Mean separation [length] at ln F."""
        return np.asarray(self._spline(x))

    def stiffness(self, x: FloatArray) -> FloatArray:
        """-dF/du at ln F; infinite where u does not change."""
        with np.errstate(divide="ignore"):
            return np.asarray(np.exp(x) / -self._slope(x))

    def area(self, x: FloatArray) -> FloatArray:
        """A/A0 at ln F."""
        return np.asarray(erf(np.exp(self._root(x) + self._line * x)))

    def log_force(self, u: FloatArray) -> FloatArray:
        """ln F at mean separations between those of the first and the last load."""
        place = np.clip(np.searchsorted(-self._fine_u, -u) - 1, 0, self._fine.size - 2)
        low, high = self._fine[place], self._fine[place + 1]
        x = (low + high) / 2
        for _ in range(HALVINGS):
            over = self._spline(x) - u
            low, high = np.where(over > 0, x, low), np.where(over > 0, high, x)
            with np.errstate(divide="ignore", invalid="ignore"):
                step = x - over / self._slope(x)
            step = np.where((step >= low) & (step <= high), step, (low + high) / 2)
            if np.allclose(step, x, rtol=0, atol=1e-14 * np.abs(self.x).max()):
                break
            x = step
        return np.asarray(x)

    def log_force_at(self, area: FloatArray) -> FloatArray:
        """ln F at A/A0 between those of the first and the last load."""
        low, high = np.full(np.shape(area), self.x[0]), np.full(np.shape(area), self.x[-1])
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            more = self.area(middle) > area
            low, high = np.where(more, low, middle), np.where(more, middle, high)
        return np.asarray((low + high) / 2)

    def energy(self, x: FloatArray) -> FloatArray:
        """U/(A0 E*) at ln F."""
        k = np.clip(np.searchsorted(self.x, x, side="right") - 1, 0, self.x.size - 2)
        force, start, end = np.exp(x), np.exp(self.x[k]), np.exp(self.x[k + 1])
        missed = np.diff(self.work)[k] - self._integral(self.x[k], self.x[k + 1])
        work = self.work[k] + self._integral(self.x[k], x) + missed * (force - start) / (end - start)
        return np.asarray(work - force * self._spline(x))

    def _integral(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """Integral of u over F; the knots between loads do not reduce the accuracy noticeably."""
        half = (high - low)[..., None] / 2
        t = low[..., None] + half * (1 + NODES)
        return np.asarray((self._spline(t) * np.exp(t) * half) @ WEIGHTS)


class Continued(LoadCurve):
    """The curves with extrapolation, from full compression at u = 0 to first contact at u = `top` [length]."""

    def __init__(self, rows: FloatArray, top: float) -> None:
        super().__init__(rows)
        self.top, self.u = top, (float(rows[2, 0]), float(rows[2, -1]))
        first, last = (float(part) for part in super().stiffness(self.x[[0, -1]]))
        self.power = max(first * (top - self.u[0]) / float(rows[0, 0]), 1.0)
        self.rate = last * self.u[1] / float(rows[0, -1])  # -d ln F/d ln u
        self._energies = super().energy(self.x[[0, -1]])

    def _joined(self, x: FloatArray, inside: Any, light: Any, heavy: Any) -> FloatArray:
        """A curve of ln F in three parts; the outer ones receive the distance beyond the loads."""
        x = np.asarray(x, float)
        low, high = self.x[[0, -1]]
        with np.errstate(all="ignore"):
            beyond = np.where(x < low, light(np.minimum(x - low, 0)), heavy(np.maximum(x - high, 0)))
        return np.asarray(np.where((x >= low) & (x <= high), inside(np.clip(x, low, high)), beyond))

    def _light_gap(self, beyond: FloatArray) -> FloatArray:
        return self.top - (self.top - self.u[0]) * np.exp(beyond / self.power)

    def _heavy_gap(self, beyond: FloatArray) -> FloatArray:
        return self.u[1] * np.exp(-np.expm1(2 * beyond) / (2 * self.rate))

    def separation(self, x: FloatArray) -> FloatArray:
        """Mean separation [length] at ln F."""
        return self._joined(x, super().separation, self._light_gap, self._heavy_gap)

    def stiffness(self, x: FloatArray) -> FloatArray:
        """-dF/du at ln F; zero at first contact."""
        (low, high), n = self.x[[0, -1]], self.power
        return self._joined(
            x,
            super().stiffness,
            lambda beyond: n * np.exp(low + beyond * (1 - 1 / n)) / (self.top - self.u[0]),
            lambda beyond: np.where(
                beyond < np.inf, self.rate * np.exp(high - beyond) / self._heavy_gap(beyond), np.inf
            ),
        )

    def area(self, x: FloatArray) -> FloatArray:
        """A/A0 at ln F."""
        first, last = super().area(self.x[[0, -1]])
        return self._joined(
            x,
            super().area,
            lambda beyond: erf(erfinv(first) * np.exp(beyond)),
            lambda beyond: erf(erfinv(min(last, LARGEST_AREA)) * np.exp(beyond)),
        )

    def log_force(self, u: FloatArray) -> FloatArray:
        """ln F at mean separations from 0 to `top`: infinite at either."""
        (low, high), (top, bottom) = self.x[[0, -1]], self.u
        with np.errstate(divide="ignore"):
            light = low + self.power * np.log(np.maximum(self.top - u, 0) / (self.top - top))
            heavy = high + np.log1p(-2 * self.rate * np.log(np.minimum(u, bottom) / bottom)) / 2
        inside = super().log_force(np.clip(u, bottom, top))
        return np.where(u > top, light, np.where(u < bottom, heavy, inside))

    def log_force_at(self, area: FloatArray) -> FloatArray:
        """ln F at A/A0 from 0 to below 1."""
        ends = super().area(self.x[[0, -1]])
        known = np.clip(area, *ends)
        with np.errstate(divide="ignore"):
            beyond = np.log(erfinv(area) / erfinv(np.minimum(known, LARGEST_AREA)))
        return np.asarray(super().log_force_at(known) + np.where(known == area, 0.0, beyond))

    def energy(self, x: FloatArray) -> FloatArray:
        """U/(A0 E*) at ln F."""
        light, heavy = self._energies

        def pressed(beyond: FloatArray) -> FloatArray:
            gap = self._heavy_gap(beyond)
            half = (self.u[1] - gap)[..., None] / 2
            force = np.exp(self.log_force(gap[..., None] + half * (1 + NODES)))
            return np.asarray(heavy + np.sum(force * half * WEIGHTS, axis=-1))

        return self._joined(x, super().energy, lambda beyond: light * np.exp(beyond * (1 + 1 / self.power)), pressed)


def left_out(rows: FloatArray) -> FloatArray:
    """Change of ln F and ln A that one of the four loads nearest to an interval makes, at most, shape (2, n - 1)."""
    changes = np.zeros((2, rows.shape[1] + 2))
    for k in range(1, rows.shape[1] - 1):
        less = LoadCurve(np.delete(rows, k, axis=1))
        x = less.log_force(rows[2, k])
        found = np.array([x, np.log(less.area(x))])
        changes[:, k + 1] = np.abs(found - np.log(rows[:2, k]))
    return np.asarray(np.lib.stride_tricks.sliding_window_view(changes, 4, axis=1).max(axis=-1))


def _constrained(x: FloatArray, u: FloatArray, work: FloatArray) -> CubicSpline:
    """Cubic spline of u over ln F, not-a-knot, with the integrals of u over F between loads."""
    middle = (x[1:] + x[:-1]) / 2
    knots = np.sort(np.append(x, middle))
    at, between = np.searchsorted(knots, x), np.searchsorted(knots, middle)
    basis = CubicSpline(knots, np.eye(knots.size))
    # each half of an interval is one polynomial
    half = np.diff(knots)[:, None] / 2
    t = knots[:-1, None] + half * (1 + NODES)
    parts = np.einsum("ij,ijk->ik", np.exp(t) * half * WEIGHTS, basis(t))
    sums = parts[at[:-1]] + parts[between]
    values = np.zeros(knots.size)
    values[at] = u
    values[between] = np.linalg.solve(sums[:, between], work - sums[:, at] @ u)
    return CubicSpline(knots, values)
