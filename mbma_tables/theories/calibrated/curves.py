"""Curves of the calibrated law on measured surfaces: of a spectrum, of heights or of a map."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator
from scipy.special import erfc, ndtri

from mbma_tables.common.arguments import FloatArray, require
from mbma_tables.common.shared import shared, shared_property
from mbma_tables.surfaces.bearing_curve import FRACTIONS
from mbma_tables.surfaces.heights import SHARES
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.theories.calibrated.formulas import (
    LAW_ERROR,
    SpectrumLaw,
    force_at_area,
    light_factor,
    spectrum_of,
)
from mbma_tables.theories.calibrated.map_curves import LOG_FORCE, MapLaw, convex
from mbma_tables.theories.tested import elastic_ranges

if TYPE_CHECKING:
    from mbma_tables.theories.yielding.formulas import BearingCurve

# error of a map's curve, which is smoother than the nodes of its law, for nine maps in ten
MAP_ERROR = 3e-2
# range of ln F over which constant stiffness is unreliable; differences due to rounding
STRAIGHT = 1.0
SAME = 1e-9
# steps of a map's curve in ln F and ln u, since its nodes are rough; parts of an integral
NODE_STEP = 0.2
FINE = 8
ENDS = ", where the light-load and near-full-contact approximations of this map leave no gap: use theory='simulated'"


class CompressionCurve:
    """A map's curve from its highest point to full contact: stiffness rises monotonically between nodes of the law."""

    def __init__(self, law: MapLaw, h_max: float) -> None:
        log_force = LOG_FORCE
        u = law.separation(np.exp(LOG_FORCE))
        kept = np.flatnonzero((u > 1e-9) & (u < h_max * (1 - 1e-9)))
        nodes = [kept[0]]
        for k in kept:
            last = nodes[-1]
            if (
                log_force[k] - log_force[last] > NODE_STEP
                or np.log(u[last] / u[k]) > NODE_STEP
            ):
                nodes.append(k)
        pressure = np.append(0, np.exp(log_force[nodes]))
        gap = np.append(h_max, u[nodes])
        gap = convex(pressure, gap)
        # one stiffness between two nodes, at the middle
        log_u = np.log(gap)
        middle = (log_u[1:] + log_u[:-1])[::-1] / 2
        # equal ones differ by rounding
        stiffness = np.minimum.accumulate(np.log(np.diff(pressure) / -np.diff(gap))[::-1])
        self._log_stiffness = PchipInterpolator(middle, stiffness)
        self._h_max, self._top = h_max, float(np.exp(middle[-1]))
        self._lightest = float(np.exp(stiffness[-1])) * (h_max - self._top)
        # force = integral of stiffness over u, from the top
        fine = np.concatenate(
            [
                np.linspace(a, b, FINE, endpoint=False)
                for a, b in itertools.pairwise(middle)
            ]
        )
        fine = np.append(fine, middle[-1])
        node, weight = np.polynomial.legendre.leggauss(4)
        half = np.diff(fine) / 2
        x = fine[:-1, None] + half[:, None] * (1 + node)
        work = (np.exp(self._log_stiffness(x) + x) @ weight) * half
        total = self._lightest + np.append(np.cumsum(work[::-1])[::-1], 0.0)
        self._log_u, self._log_force = fine, np.log(total)
        rate = np.exp(self._log_stiffness(fine) + fine) / total
        self._log_force_at = CubicHermiteSpline(fine, self._log_force, -rate)
        # -d ln F/d ln u where full contact is continued
        self._heaviest_rate = -float(rate[0])
        self._law = law
        # both approximations may disagree: gaps close, or increase with load, at partial contact
        heaviest = float(total[0])
        closed = float(self.area(np.array(heaviest))) < elastic_ranges()["area"][1]
        self.end, self.heaviest = (
            (float(np.exp(fine[0])), heaviest) if closed else (0.0, np.inf)
        )
        pieces = np.split(middle, np.flatnonzero(np.diff(stiffness) < -SAME) + 1)
        ends = [np.array(piece[[0, -1]]) for piece in pieces if piece.size > 1]
        self._straight = [
            np.exp(pair)
            for pair in ends
            if -np.diff(self._log_force_at(pair))[0] > STRAIGHT
        ]

    def answer(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Force, area and stiffness: F^2 linear in ln u below the nodes, a straight line to zero at h_max above."""
        with np.errstate(divide="ignore"):
            log_u = np.log(u)
        inside = np.clip(log_u, self._log_u[0], self._log_u[-1])
        # 1 from the heaviest node up
        square = 1 + 2 * self._heaviest_rate * np.minimum(log_u - self._log_u[0], 0)
        pressure = np.exp(self._log_force_at(inside)) * np.sqrt(square)
        with np.errstate(divide="ignore", invalid="ignore"):
            full = np.where(u > 0, -pressure * self._heaviest_rate / square / u, np.inf)
        stiffness = np.where(
            log_u > self._log_u[0], np.exp(self._log_stiffness(inside)), full
        )
        above = u > self._top
        rest = np.clip((self._h_max - u) / (self._h_max - self._top), 0, 1)
        pressure = np.where(above, self._lightest * rest, pressure)
        stiffness = np.where(above & (rest <= 0), 0.0, stiffness)
        return pressure, self.area(pressure), stiffness

    def straight(self, u: FloatArray) -> NDArray[np.bool_]:
        """True within ranges of constant stiffness, where the approximations disagree."""
        found = [(u >= low) & (u <= high) for low, high in self._straight]
        return np.asarray(
            np.logical_or.reduce([np.zeros(np.shape(u), dtype=bool), *found])
        )

    def area(self, pressure: FloatArray) -> FloatArray:
        """A/A0 at a force, in proportion below the law's lightest load."""
        known = np.clip(pressure, np.exp(LOG_FORCE[0]), np.exp(LOG_FORCE[-1]))
        area = self._law.area(known) * np.minimum(pressure / known, 1)
        # the remaining open area decreases as for Gaussian pressures
        left = erfc(np.sqrt(2) * np.maximum(pressure, known)) / erfc(np.sqrt(2) * known)
        return np.where(pressure > known, 1 - (1 - area) * left, area)

    def separation(
        self, quantity: str, wanted: FloatArray, gradient: float
    ) -> FloatArray:
        """Mean separation [h_rms]: the inverse of `answer`."""
        pressure = wanted / gradient
        if quantity == "area":
            known = self._law.area(np.exp(LOG_FORCE))
            require(
                "area",
                wanted,
                wanted <= known[-1],
                f"at most {known[-1]:.9g}, where the map's curve ends",
            )
            # the law interpolates in its odds
            share = np.maximum(wanted, known[0])
            log_force = np.interp(
                np.log(share / (1 - share)), np.log(known / (1 - known)), LOG_FORCE
            )
            pressure = np.exp(log_force) * np.minimum(wanted / known[0], 1)
        if self.end:
            most = (
                gradient * self.heaviest
                if quantity == "pressure"
                else float(self.area(np.array(self.heaviest)))
            )
            require(
                quantity,
                wanted,
                pressure <= self.heaviest * (1 + 1e-9),
                f"at most {most:.4g}{ENDS}",
            )
        lightest, heaviest = np.exp(self._log_force[[-1, 0]])
        goal = np.log(np.clip(pressure, lightest, heaviest))
        low = np.full(goal.shape, self._log_u[0])
        high = np.full(goal.shape, self._log_u[-1])
        for _ in range(60):
            middle = (low + high) / 2
            more = self._log_force_at(middle) > goal
            low = np.where(more, middle, low)
            high = np.where(more, high, middle)
        light = self._h_max - (self._h_max - self._top) * pressure / lightest
        full = (np.maximum(pressure / heaviest, 1) ** 2 - 1) / (2 * self._heaviest_rate)
        return np.asarray(
            np.where(pressure < lightest, light, np.exp((low + high) / 2 + full))
        )


class OwnLaw:
    """The law of a surface given by a spectrum: by the spectrum alone, or with its heights or its map's curves."""

    def __init__(self, surface: MeasuredSurface) -> None:
        self.h_rms, self.h_max = float(surface.h_rms), float(surface.h_max)
        self.gradient = float(surface.rms_gradient)
        self.law: SpectrumLaw = SpectrumLaw(spectrum_of(surface), self.h_max / self.h_rms)
        self._known = self._map_law(surface)
        self.curve = (
            None
            if self._known is None
            else CompressionCurve(self._known, self.h_max / self.h_rms)
        )

    @shared_property
    def heights(self) -> BearingCurve | None:
        """Its own bearing curve, for a hardness."""
        from mbma_tables.theories.yielding.formulas import BearingCurve

        return (
            None
            if self._known is None
            else BearingCurve(self._known.mean_height, self.h_max / self.h_rms)
        )

    def _map_law(self, surface: MeasuredSurface) -> MapLaw | None:
        if surface.bearing is not None and surface.bands is not None:
            self.h_rms, self.gradient = surface.bearing.h_rms, surface.bearing.gradient
            return MapLaw.from_curves(surface.bearing, surface.bands)
        if surface.heights.is_gaussian:
            return None
        # heights without a map: gradients and full contact as on Gaussian surfaces
        heights = surface.heights
        tops = (
            np.interp(
                FRACTIONS,
                SHARES,
                cumulative_trapezoid(heights.quantiles, SHARES, initial=0.0),
            )
            / FRACTIONS
        )
        level = ndtri(np.minimum(FRACTIONS, 1 - 1e-12))
        pull = (np.exp(-level * level / 2) / np.sqrt(2 * np.pi) + level * FRACTIONS) / 2
        return MapLaw(
            self.law.spectrum,
            tops / heights.h_rms,
            np.ones(FRACTIONS.size),
            -level / 2,
            np.maximum(pull, 0.0),
        )

    @property
    def end(self) -> float:
        """Mean separation [length] at which the curve ends: 0 unless a map's gap closes at partial contact."""
        return 0.0 if self.curve is None else self.curve.end * self.h_rms

    def answer(self, u: FloatArray) -> tuple[list[FloatArray], float]:
        """Force over A0 E*, area and stiffness at mean separations u >= 0 [length], and their error."""
        end = self.end
        require("mean_separation", u, u >= end * (1 - 1e-9), f"at least {end:.4g}{ENDS}")
        flat = u.ravel() / self.h_rms
        parts = self.law.contact(flat) if self.curve is None else self.curve.answer(flat)
        units = self.gradient, 1.0, self.gradient / self.h_rms
        scaled = [
            np.reshape(part, u.shape) * unit
            for part, unit in zip(parts, units, strict=True)
        ]
        return scaled, LAW_ERROR if self.curve is None else MAP_ERROR

    def area(self, pressure: FloatArray) -> FloatArray:
        """A/A0 at a force over A0 E*."""
        return (self.law if self.curve is None else self.curve).area(
            pressure / self.gradient
        )

    def mean_separation(self, quantity: str, wanted: FloatArray) -> FloatArray:
        """Mean separation u [length] at a force over A0 E* or an area below 1; h_max at zero."""
        if self.curve is not None:
            u = self.curve.separation(quantity, wanted, self.gradient) * self.h_rms
        else:
            light = light_factor(self.law.spectrum.alpha)
            pressure = (
                force_at_area(wanted, light)
                if quantity == "area"
                else wanted / self.gradient
            )
            u = self.law.separation(np.maximum(pressure, 1e-300)) * self.h_rms
            u = np.where(pressure > 0, np.minimum(u, self.h_max), self.h_max)
        # beside h_max, with which it makes d
        require(
            quantity,
            wanted,
            u > np.finfo(float).eps * self.h_max,
            "less: the mean separation vanishes",
        )
        return np.asarray(u)


own_law = shared(32)(OwnLaw)
