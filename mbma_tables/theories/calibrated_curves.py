"""Curves of the calibrated law on the surfaces of a question, of a spectrum or of a map."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator
from scipy.special import erf, erfinv

from mbma_tables.arguments import FloatArray, require
from mbma_tables.calibrated import CONSTANTS, Law, Spectrum, light_factor
from mbma_tables.calibrated_map import LOG_FORCE, MapLaw
from mbma_tables.surfaces.spectrum import MAX_ZETA_1, band_moment
from mbma_tables.surfaces.surface import Surface
from mbma_tables.theories import calibrated_table

TESTED_AREA = (1e-3, 0.97)
MAX_RATIO, GRADING, GRADED = 1.05, 0.8, 120  # between wavenumbers of a spectrum's bands; towards its longest wave
NODE_STEP = 6  # of a map's curve: its own nodes are rougher than what they stand for
FULL_NODES = 3  # of a map's curve, from which full contact is continued
HURST = 0.8  # of the surface that stands for a spectrum or a map


class Places:
    """A batch of surfaces and numbers that broadcast with it, flat."""

    def __init__(self, surface: Surface, value: ArrayLike) -> None:
        self.shape = np.broadcast_shapes(np.shape(value), surface.shape)
        self.flat = np.ascontiguousarray(np.broadcast_to(np.asarray(value, float), self.shape)).ravel()
        hurst = np.asarray(surface.hurst, float).ravel()
        zeta_1, h_rms = np.asarray(surface.zeta_1, float).ravel(), np.asarray(surface.h_rms, float).ravel()
        light = light_factor(np.asarray(surface.alpha).ravel())
        heights = np.asarray(surface.h_max, float).ravel() / h_rms
        self.rows = np.ascontiguousarray(np.stack([hurst, np.log(zeta_1), light, heights], axis=1))
        number = np.arange(hurst.size).reshape(surface.shape)
        self.owner = np.ascontiguousarray(np.broadcast_to(number, self.shape)).ravel()
        self.h_rms = h_rms[self.owner] if hurst.size > 1 else h_rms
        gradient = np.asarray(surface.rms_gradient, float).ravel()
        self.gradient = gradient[self.owner] if hurst.size > 1 else gradient

    def covered(self, table: calibrated_table.Table) -> Any:
        """Whether the table holds each surface."""
        return table.covers(self.rows[:, 0], self.rows[:, 1])

    def outside(self, mask: Any) -> list[tuple[int, Any]]:
        """Surfaces that have entries under a mask, with these."""
        return [(int(row), np.flatnonzero(mask & (self.owner == row))) for row in np.unique(self.owner[mask])]

    def law(self, row: int) -> Law:
        """The law of one surface."""
        hurst, log_zeta, _, heights = self.rows[row]
        return Law(Spectrum.self_affine(float(hurst), float(np.exp(log_zeta))), float(heights))


class Curve:
    """A map's curve, smooth and monotone between its nodes, from full contact to the highest point."""

    def __init__(self, law: MapLaw, h_max: float) -> None:
        nodes = LOG_FORCE[::NODE_STEP]
        u = law.separation(np.exp(nodes))
        kept = (u > 1e-9) & (u < h_max * (1 - 1e-9))
        # nodes where the curve runs back are left out
        level = np.minimum.accumulate(np.where(kept, u, np.inf))
        kept &= u < np.append(np.inf, level[:-1]) * (1 - 1e-9)
        self._log_u, self._log_force = np.log(u[kept][::-1]), nodes[kept][::-1]
        self._h_max, self._top = h_max, float(u[kept][0])
        self._log_force_at = PchipInterpolator(self._log_u, self._log_force)
        self._rate = self._log_force_at.derivative()
        # d ln F/d ln u of full contact, over a few nodes
        first = slice(None, FULL_NODES)
        self._heaviest_rate = float(np.polyfit(self._log_u[first], self._log_force[first], 1)[0])
        self._law = law

    def answer(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Force, area and stiffness: F^2 linear in ln u below the nodes, a straight line to zero at h_max above."""
        with np.errstate(divide="ignore"):
            log_u = np.log(u)
        inside = np.clip(log_u, self._log_u[0], self._log_u[-1])
        # 1 from the heaviest node up
        square = 1 + 2 * self._heaviest_rate * np.minimum(log_u - self._log_u[0], 0)
        force = np.exp(self._log_force_at(inside)) * np.sqrt(square)
        with np.errstate(divide="ignore", invalid="ignore"):
            rate = np.where(log_u > self._log_u[0], self._rate(inside), self._heaviest_rate / square)
            stiffness = np.where(u > 0, -force * rate / u, np.inf)
        lightest = np.exp(self._log_force[-1])
        above = u > self._top
        rest = np.clip((self._h_max - u) / (self._h_max - self._top), 0, 1)
        force = np.where(above, lightest * rest, force)
        stiffness = np.where(above, lightest / (self._h_max - self._top) * (rest > 0), stiffness)
        return force, self.area(force), stiffness

    def area(self, force: FloatArray) -> FloatArray:
        """A/A0 at a force, in proportion below the law's lightest load."""
        known = np.clip(force, np.exp(LOG_FORCE[0]), np.exp(LOG_FORCE[-1]))
        area = self._law.area(known) * np.minimum(force / known, 1)
        return np.where(force > np.exp(LOG_FORCE[-1]), np.maximum(area, erf(np.sqrt(2) * force)), area)

    def separation(self, quantity: str, wanted: FloatArray, gradient: float) -> FloatArray:
        """Mean separation [h_rms]: the inverse of `answer`."""
        force = wanted / gradient
        if quantity == "area":
            known = self._law.area(np.exp(LOG_FORCE))
            require("area", wanted, wanted <= known[-1], f"at most {known[-1]:.9g}, where the map's curve ends")
            # the law interpolates in its odds
            share = np.maximum(wanted, known[0])
            log_force = np.interp(np.log(share / (1 - share)), np.log(known / (1 - known)), LOG_FORCE)
            force = np.exp(log_force) * np.minimum(wanted / known[0], 1)
        lightest, heaviest = np.exp(self._log_force[[-1, 0]])
        goal = np.log(np.clip(force, lightest, heaviest))
        low, high = np.full(goal.shape, self._log_u[0]), np.full(goal.shape, self._log_u[-1])
        for _ in range(60):
            middle = (low + high) / 2
            more = self._log_force_at(middle) > goal
            low, high = np.where(more, middle, low), np.where(more, high, middle)
        light = self._h_max - (self._h_max - self._top) * force / lightest
        full = (np.maximum(force / heaviest, 1) ** 2 - 1) / (2 * self._heaviest_rate)
        return np.asarray(np.where(force < lightest, light, np.exp((low + high) / 2 + full)))


def force_at_area(area: ArrayLike, light: ArrayLike) -> FloatArray:
    """F/(A0 E* g) at A/A0: the inverse of `calibrated.area`, from 2 y^2 (1 + y/t0) = e^2 (s0 + y/t0), A = erf(e)."""
    share = np.asarray(area, float)
    require("area", share, (share >= 0) & (share < 1), "below 1, which is reached at infinite load")
    e, s0, t0 = erfinv(share), np.asarray(light), CONSTANTS.area_t0
    # at y = e/sqrt(2) the left side is the larger, and the cubic is convex from there to its root
    y = e / np.sqrt(2)
    for _ in range(60):
        slope = 4 * y + 6 * y**2 / t0 - e**2 / t0
        step = np.divide(
            2 * y**2 * (1 + y / t0) - e**2 * (s0 + y / t0), slope, out=np.zeros(np.shape(slope)), where=slope > 0
        )
        y = np.maximum(y - step, 0.3 * y)
    return np.asarray(y)


def by_law(law: Law, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Force, area and stiffness by the law's quadrature."""
    positive = np.maximum(u, 1e-12)
    force, stiffness = law.force_and_stiffness(positive)
    full = u <= 0
    return np.where(full, np.inf, force), np.where(full, 1.0, law.area(force)), np.where(full, np.inf, stiffness)


def area_concerns(area: FloatArray) -> dict[str, Any]:
    """Contact fractions that were not simulated, or hardly."""
    low, high = TESTED_AREA
    return {
        f"A/A0 is below {low:g}": (area > 0) & (area < low),
        f"A/A0 is above {high:g}": area > high,
    }


def bands(q: FloatArray, C: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Integral of C q dq of narrow bands, and their root mean square wavenumbers, C a power law between samples."""
    held = np.flatnonzero(C > 0)
    if held.size < 2:
        return np.zeros(1), np.ones(1)
    # graded towards the longest wave, where the gradient of longer ones vanishes
    width, span = np.log(MAX_RATIO), float(np.log(q[held[-1]] / q[held[0]]))
    graded = np.append(width * GRADING ** np.arange(GRADED, 0.0, -1), np.arange(width, span, width))
    edges = np.unique(np.concatenate([np.log(q), np.log(q[held[0]]) + graded[graded < span]]))
    middle = (edges[1:] + edges[:-1]) / 2
    number = np.clip(np.searchsorted(np.log(q), middle) - 1, 0, q.size - 2)
    low, high, a = C[number], C[number + 1], q[number]
    real = (low > 0) & (high > 0)
    low, high, a, step, start = low[real], high[real], a[real], np.diff(edges)[real], np.exp(edges[:-1][real])
    power = np.log(high / low) / np.log(q[number + 1][real] / a)
    base = low * (start / a) ** power * start**2
    variance, slopes = base * growth(power + 2, step), base * start**2 * growth(power + 4, step)
    return variance, np.sqrt(slopes / variance)


def growth(power: FloatArray, width: FloatArray) -> FloatArray:
    """Integral of x^power d ln x from 1 over a width in ln x."""
    flat = np.abs(power) < 1e-9
    return np.where(flat, width, np.expm1(power * width) / np.where(flat, 1.0, power))


def standing_for(m0: float, m2: float, alpha: float, h_max: float) -> Surface:
    """A surface of these moments, its alpha the nearest that a band has."""

    def alpha_of(zeta: float) -> float:
        moments = [float(band_moment(order, HURST, 1.0, zeta)) for order in (0, 2, 4)]
        return moments[0] * moments[2] / moments[1] ** 2

    low, high = 3.0 * (1 + 1e-6), MAX_ZETA_1 * (1 - 1e-6)
    near = float(np.clip(alpha, alpha_of(low), alpha_of(high)))
    return Surface.from_moments(hurst=HURST, m0=m0, m2=m2, m4=near * m2**2 / m0, h_max=h_max)
