"""Curves through simulated loads of one surface, which use the elastic energy, and go on beyond the loads.

Lengths in one unit, force and energy over A0 E*. Since dU = -F du, the integral of u over F
between two loads is known exactly: G2 - G1 with G = U + F u. So a cubic spline of u over ln
F has an extra knot between each two loads, whose value follows from this integral. A/A0 =
erf(F exp(s)) with a natural cubic spline s of ln(erfinv(A)/F) over ln F. Where a spline is
not monotone, as with few, distant loads, monotone cubics through the loads replace it.

Beyond the loads, with the stiffness at the first and the last, H the height of the highest
point, in proportion at light load and as Gaussian pressures near full contact: ::

    light: F ~ (H - u)^n       heavy: F^2 linear in ln u       both: erfinv(A) ~ F
"""

from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.optimize.elementwise import find_root
from scipy.special import erf, erfinv

from mbma_tables.common.arguments import FloatArray

NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
FINE = 64  # parts of an interval between loads, to see whether a spline is monotone
LARGEST_AREA = 1 - 1e-12


class LoadCurve:
    """Mean separation, area and energy by ln F, from first contact to full compression; arguments are not checked.

    `rows`, shape (4, n), are F/(A0 E*), rising, A/A0, rising, u [length], falling, and
    U/(A0 E*) [length]; `top` is u of first contact [length], above the first load's.
    """

    def __init__(self, rows: FloatArray, top: float) -> None:
        force, area, u, energy = rows
        self.x, self.top = np.log(force), top
        self._work = energy + force * u
        fine = np.append(
            self.x[:-1, None] + np.diff(self.x)[:, None] * np.arange(FINE) / FINE,
            self.x[-1],
        )
        self._spline: Any = _constrained(self.x, u, np.diff(self._work))
        self._slope = self._spline.derivative()
        if not (self._slope(fine) < 0).all():
            self._spline = PchipInterpolator(self.x, u)
            self._slope = self._spline.derivative()
        root = np.log(erfinv(np.minimum(area, LARGEST_AREA)))
        self._root: Any = CubicSpline(self.x, root - self.x, bc_type="natural")
        self._line = 1.0  # spline of the remainder beside ln F
        if not (self._root(fine, 1) > -1).all():
            self._root, self._line = PchipInterpolator(self.x, root), 0.0
        # ln F, u and ln erfinv(A) of the first and the last load
        self._ends = self.x[[0, -1]]
        self._gaps, self._roots = self._spline(self._ends), self._log_root(self._ends)
        # a monotone cubic may be level at an end: the straight line to the load beside it is not
        chords = np.diff(u)[[0, -1]] / np.diff(self.x)[[0, -1]]
        slopes = self._slope(self._ends)
        first, last = force[[0, -1]] / -np.where(slopes < 0, slopes, chords)
        self._power = max(float(first * (top - u[0]) / force[0]), 1.0)
        self._rate = float(last * u[-1] / force[-1])  # -d ln F/d ln u

    def _split(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """ln F within the loads, and what lies below and above them."""
        inside = np.clip(np.asarray(x, float), *self._ends)
        return inside, np.minimum(x - self._ends[0], 0), np.maximum(x - self._ends[1], 0)

    @np.errstate(all="ignore")
    def separation(self, x: FloatArray) -> FloatArray:
        """Mean separation [length] at ln F."""
        inside, light, heavy = self._split(x)
        lighter = self.top - (self.top - self._gaps[0]) * np.exp(light / self._power)
        heavier = self._gaps[1] * np.exp(-np.expm1(2 * heavy) / (2 * self._rate))
        return np.asarray(
            np.where(
                light < 0, lighter, np.where(heavy > 0, heavier, self._spline(inside))
            )
        )

    @np.errstate(all="ignore")
    def stiffness(self, x: FloatArray) -> FloatArray:
        """-dF/du at ln F; infinite where u does not change, zero at first contact."""
        inside, light, heavy = self._split(x)
        n = self._power
        lighter = (
            n * np.exp(self._ends[0] + light * (1 - 1 / n)) / (self.top - self._gaps[0])
        )
        heavier = np.where(
            heavy < np.inf,
            self._rate * np.exp(self._ends[1] - heavy) / self.separation(x),
            np.inf,
        )
        return np.where(
            light < 0,
            lighter,
            np.where(heavy > 0, heavier, np.exp(inside) / -self._slope(inside)),
        )

    def area(self, x: FloatArray) -> FloatArray:
        """A/A0 at ln F."""
        inside, light, heavy = self._split(x)
        return np.asarray(erf(np.exp(self._log_root(inside) + light + heavy)))

    def log_force(self, u: FloatArray) -> FloatArray:
        """ln F at mean separations from 0 to `top`: infinite at either."""
        inside = self._inverse(self._spline, np.clip(u, *self._gaps[::-1]))
        with np.errstate(divide="ignore"):
            lighter = self._ends[0] + self._power * np.log(
                np.maximum(self.top - u, 0) / (self.top - self._gaps[0])
            )
            heavier = (
                self._ends[1]
                + np.log1p(-2 * self._rate * np.log(np.minimum(u / self._gaps[1], 1))) / 2
            )
        return np.asarray(
            np.where(
                u > self._gaps[0], lighter, np.where(u < self._gaps[1], heavier, inside)
            )
        )

    def log_force_at(self, area: FloatArray) -> FloatArray:
        """ln F at A/A0 from 0 to below 1."""
        with np.errstate(divide="ignore"):
            root = np.log(erfinv(area))
        known = np.clip(root, *self._roots)
        return np.asarray(self._inverse(self._log_root, known) + (root - known))

    def _log_root(self, x: FloatArray) -> Any:
        """ln erfinv(A) within the loads."""
        return self._root(x) + self._line * x

    def _inverse(self, curve: Any, wanted: FloatArray) -> FloatArray:
        """ln F within the loads at which a monotone curve has these values."""
        return np.asarray(
            find_root(
                lambda x, value: curve(x) - value, tuple(self._ends), args=(wanted,)
            ).x
        )

    @np.errstate(all="ignore")
    def energy(self, x: FloatArray) -> FloatArray:
        """U/(A0 E*) at ln F."""
        inside, light, heavy = self._split(x)
        k = np.clip(np.searchsorted(self.x, inside, side="right") - 1, 0, self.x.size - 2)
        force = np.exp(inside)
        start = np.exp(self.x[k])
        end = np.exp(self.x[k + 1])
        missed = np.diff(self._work)[k] - self._integral(self.x[k], self.x[k + 1])
        work = (
            self._work[k]
            + self._integral(self.x[k], inside)
            + missed * (force - start) / (end - start)
        )
        energy = np.asarray(
            (work - force * self._spline(inside)) * np.exp(light * (1 + 1 / self._power))
        )
        heavier = heavy > 0
        if heavier.any():
            # and the integral of F over u
            gap = self.separation(x)[heavier]
            half = (self._gaps[1] - gap)[..., None] / 2
            energy[heavier] += np.sum(
                np.exp(self.log_force(gap[..., None] + half * (1 + NODES)))
                * half
                * WEIGHTS,
                -1,
            )
        return energy

    def _integral(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """Integral of u over F; the knots between loads do not reduce the accuracy noticeably."""
        half = (high - low)[..., None] / 2
        t = low[..., None] + half * (1 + NODES)
        return np.asarray((self._spline(t) * np.exp(t) * half) @ WEIGHTS)


def _constrained(x: FloatArray, u: FloatArray, work: FloatArray) -> CubicSpline:
    """Cubic spline of u over ln F, not-a-knot, with the integrals of u over F between loads."""
    middle = (x[1:] + x[:-1]) / 2
    knots = np.sort(np.append(x, middle))
    at = np.searchsorted(knots, x)
    between = np.searchsorted(knots, middle)
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
