"""The calibrated law for a height map, by its highest parts at light loads and its valleys near full contact.

Lengths in h_rms, force over A0 E* g as in `calibrated`; docs/theories.md has the equations.
"""

from __future__ import annotations

import dataclasses
import operator

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq, isotonic_regression
from scipy.special import ellipe, ellipkm1, erf, expit, ndtr, ndtri

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.shared import shared, shared_property
from mbma_tables.surfaces.bearing_curve import FRACTIONS, Bearing, RadialSpectrum
from mbma_tables.theories.calibrated import formulas as calibrated
from mbma_tables.theories.calibrated.formulas import (
    CONSTANTS,
    CalibratedConstants,
    Spectrum,
    SpectrumLaw,
    light_factor,
)

# ln F^ of a map's curve
LIGHTEST = -16.0
HEAVIEST = 1.4
NODES = 500
LOG_FORCE = np.linspace(LIGHTEST, HEAVIEST, NODES)
# tension on fewer points is that of single points
MIN_TENSION = 1e-12
MIN_SHARE = 1e-4
MIN_RATIO = 0.05
MIN_GRADIENT = 1e-3
ELLIPTIC_AREA = 0.03  # contact above which Hertz's elliptic factor is used unchanged
ERF_INVERSE = (1e-7, 3.9)  # erfinv(A) over which F(A) is tabulated


@dataclasses.dataclass(frozen=True)
class MapConstants:
    """Constants of the map's law.

    c = 0.8 max(1, b (alpha/2)^(curvature/2)/breadth_onset)^breadth for an isotropic map,
    once contacts have merged, b the root mean square over the geometric mean wavenumber,
    alpha = m0 m4/m2^2.
    """

    breadth: float = 0.5988
    breadth_onset: float = 1.512
    # contact where the deviation of a Gaussian surface from M(c A) takes over,
    gaussian_area: float = 0.2897
    valley_area: float = 0.6527  # and then the valleys
    # contact above which the tensile area in full contact replaces that of the highest
    # parts
    tension_area: float = 0.6
    merging_area: float = 0.00761  # contact over which c grows from a single contact's
    # further exponent of Hertz's elliptic factor at the lightest contact of stretched surfaces
    elliptic: float = 0.7245
    curvature: float = 0.09953


MAP_CONSTANTS = MapConstants()
# of maps whose light- and full-contact curves disagree at 30% contact, fitted to machined
# surfaces: valleys take over at a contact larger by shift (1 - exp(-(D/onset)^4)), D the
# difference of their pressure-weighted heights there [h_rms], which is below 0.1 on
# Gaussian maps, larger on plateaus and with pits
PLATEAU_SHIFT = 0.45
PLATEAU_ONSET = 0.8
PLATEAU_AREA = 0.3


@shared(256)
def hertz_ellipse(anisotropy: float) -> tuple[float, float]:
    """Area factor k and height factor c_r of an elliptic Hertzian contact, curvatures as anisotropy^2 to 1."""
    if anisotropy < 1 + 1e-6:
        return 1.0, 1.0

    def curvatures(b: float) -> tuple[float, float]:
        m = 1 - b * b
        K = float(ellipkm1(b * b))
        E = float(ellipe(m))
        return 2 * b / m * (E / (b * b) - K), 2 * b / m * (K - E)

    b = brentq(
        lambda b: operator.truediv(*curvatures(b)) - anisotropy**2,
        1e-9,
        1 - 1e-7,
        xtol=1e-14,
    )
    kb, ka = curvatures(b)
    product = np.sqrt(ka * kb)
    # the circle has curvatures pi/2 at semi-axis 1
    factor = np.sqrt(b * product * (ka + kb)) / (np.pi / np.sqrt(2))
    height = (ka + kb * b * b) / (2 * b * product)
    return float(factor), float(height)


def convex(force: FloatArray, u: FloatArray) -> FloatArray:
    """u(F), from the lightest load on, with decreasing compliances: with few points in contact it may reverse slightly.

    Least squares of the compliances, weighted by steps of force; a monotone u is unchanged.
    """
    steps = np.diff(force)
    compliance = isotonic_regression(
        -np.diff(u) / steps, weights=steps, increasing=False
    ).x
    return np.asarray(u[-1] + np.append(np.cumsum((compliance * steps)[::-1])[::-1], 0.0))


@dataclasses.dataclass(frozen=True, eq=False)
class MapLaw:
    """The curve of a map, by its spectrum and its `bearing` curves; M(a) [h_rms], tension in full contact [E* g]."""

    spectrum: Spectrum
    mean_height: FloatArray
    top_gradient: FloatArray
    tension_force: FloatArray
    tension: FloatArray
    anisotropy: float = 1.0
    constants: CalibratedConstants = CONSTANTS
    map_constants: MapConstants = MAP_CONSTANTS
    plateau_shift: float = PLATEAU_SHIFT

    @classmethod
    def from_curves(cls, known: Bearing, bands: RadialSpectrum) -> MapLaw:
        """The law of a map by its curves and bands."""
        held = bands.variance > 0
        return cls(
            Spectrum.from_shares(bands.q[held], bands.variance[held]),
            known.mean_height / known.h_rms,
            known.top_gradient,
            known.tension_force / known.gradient,
            known.tension / known.gradient,
            known.anisotropy,
        )

    @shared_property
    def height_factor(self) -> float:
        """c of H_p = M(c A)."""
        r = self.anisotropy
        m = self.map_constants
        breadth = self.spectrum.gradient / np.exp(
            np.sum(self.spectrum.variance * np.log(self.spectrum.x))
        )
        # stretching an isotropic map by r multiplies it by sqrt(2 (1 + r^2))/(1 + r)
        breadth *= (1 + r) / np.sqrt(2 * (1 + r * r))
        breadth *= (self.spectrum.alpha / 2) ** (m.curvature / 2)
        return float(
            0.8 * max(1.0, breadth / m.breadth_onset) ** m.breadth * self._ellipse[1]
        )

    @shared_property
    def weighted_height(self) -> FloatArray:
        """M_w(a): mean height of the highest share a weighted by its gradient, to which pressures are proportional."""
        steps = np.diff(FRACTIONS, prepend=0.0)
        heights = np.diff(FRACTIONS * self.mean_height, prepend=0.0)
        gradients = np.maximum(
            np.diff(FRACTIONS * self.top_gradient, prepend=0.0), MIN_GRADIENT * steps
        )
        mean = np.cumsum(heights / steps * gradients) / np.cumsum(gradients)
        return np.asarray(np.minimum.accumulate(mean))

    def _tops_area(self) -> FloatArray:
        """A/A0 from the gradient of the highest parts, at the curve's forces."""
        c = self.constants
        e = np.exp(np.linspace(np.log(ERF_INVERSE[0]), np.log(ERF_INVERSE[1]), NODES))
        contact = erf(e)
        light = 1 + self.map_constants.elliptic * np.exp(-contact / ELLIPTIC_AREA)
        s0 = light_factor(self.spectrum.alpha, c) / self._ellipse[0] ** (2 * light)
        y = calibrated.force_of(e, s0, c)
        top = -np.expm1(2 * np.log1p(-np.minimum(contact, 1 - 1e-12)))
        gradient = np.interp(np.log(top), np.log(FRACTIONS), self.top_gradient)
        log_force = np.maximum.accumulate(np.log(y * gradient) + 1e-12 * np.arange(NODES))
        return np.asarray(erf(np.exp(np.interp(LOG_FORCE, log_force, np.log(e)))))

    def _valleys_area(self) -> FloatArray:
        """A/A0 for which Gaussian pressures of full contact are tensile on the same share as the map's."""
        pulled = np.exp(
            np.interp(
                np.exp(LOG_FORCE), self.tension_force[::-1], np.log(FRACTIONS[::-1])
            )
        )
        beyond = np.maximum(np.exp(LOG_FORCE) / self.tension_force[0], 1.0)
        force = np.maximum(-ndtri(np.minimum(pulled, 0.5)) / 2, 0.0) * beyond
        # Hertz's elliptic factor, in the place of alpha's
        s0 = light_factor(self.spectrum.alpha, self.constants) / self._ellipse[0] ** 2
        return calibrated.area_of(force, s0, self.constants.area_t0)

    @shared_property
    def _ellipse(self) -> tuple[float, float]:
        return hertz_ellipse(round(self.anisotropy, 3))

    @shared_property
    def _contact(self) -> FloatArray:
        """A/A0 on the curve's forces."""
        tops = self._tops_area()
        valleys = self._valleys_area()
        mixed = valleys + (tops - valleys) * np.exp(
            -((tops / self.map_constants.tension_area) ** 6)
        )
        return np.maximum.accumulate(
            np.minimum(mixed, 1 - 1e-15) * (1 + 1e-13 * np.arange(NODES))
        )

    def area(self, force: ArrayLike) -> FloatArray:
        """A/A0 at F/(A0 E* g)."""
        logit = np.log(self._contact / (1 - np.minimum(self._contact, 1 - 1e-15)))
        return np.asarray(
            expit(np.interp(np.log(np.asarray(force, float)), LOG_FORCE, logit))
        )

    def gaussian_force(self, force: ArrayLike) -> FloatArray:
        """F_D: force at which Gaussian pressures of full contact have the same mean tension as the map's at F."""
        # <max(-p, 0)> of Gaussian pressures, standard deviation 1/2
        x = np.linspace(-3.0, 4.0, 1500)
        gaussian = 0.5 * np.exp(-2 * x * x) / np.sqrt(2 * np.pi) - x * ndtr(-2 * x)
        kept = (self.tension > MIN_TENSION) & (FRACTIONS >= MIN_SHARE)
        matched = np.interp(-np.log(self.tension[kept]), -np.log(gaussian), x)[::-1]
        own = self.tension_force[kept][::-1]
        given = np.asarray(force, float)
        found = np.interp(given, own, matched) + np.maximum(given - own[-1], 0) * (
            matched[-1] / own[-1]
        )
        # at light loads another approximation applies: any positive increasing curve will do
        return np.asarray(np.maximum(found, MIN_RATIO * given))

    @shared_property
    def _curve(self) -> tuple[FloatArray, FloatArray]:
        """ln F and u, u falling."""
        law = SpectrumLaw(self.spectrum, None, self.constants)
        m = self.map_constants
        log_force = LOG_FORCE
        force = np.exp(LOG_FORCE)
        contact = self._contact
        # the valleys' curve, and its pressure-weighted height u + 2 U/F
        u = law.separation_persson(self.gaussian_force(force))[0]
        work = CubicSpline(log_force, u * force).antiderivative()
        # U_full - integral of F' (-du/dF') dF', by parts
        full = np.sum(self.spectrum.x * self.spectrum.variance) / (
            4 * self.spectrum.gradient
        )
        energy = full - u * force - (work(log_force[-1]) - work(log_force))
        valleys = u + 2 * energy / force
        # the curve of the highest parts, with the deviation of a Gaussian surface from M(c
        # A) at the same contact
        grid = np.linspace(LIGHTEST - 2, HEAVIEST + 1, 2000)
        same = np.exp(np.interp(contact, law.area(np.exp(grid)), grid))
        height = law.separation_persson(same)[0] + 2 * law.energy(same) / same
        shares = np.linspace(np.log(FRACTIONS[0]), 0, 2000)
        own = np.interp(-height, -calibrated.mean_top_height(np.exp(shares)), shares)
        near = np.exp(-((contact / m.gaussian_area) ** 2))
        single = 0.8 * self._ellipse[1]
        factor = single + (self.height_factor - single) * -np.expm1(
            -contact / m.merging_area
        )
        top = np.minimum(near * np.log(factor * contact) + (1 - near) * own, 0.0)
        tops = np.interp(top, np.log(FRACTIONS), self.weighted_height)
        # the highest parts have no influence in full contact
        apart = float(np.interp(PLATEAU_AREA, contact, valleys - tops))
        valley_area = m.valley_area - self.plateau_shift * np.expm1(
            -((apart / PLATEAU_ONSET) ** 4)
        )
        share = (contact / valley_area) ** 4 / np.maximum(1 - contact**4, 1e-12)
        difference = np.exp(-share) * (tops - valleys)
        # u is linear in H_p
        beyond = CubicSpline(log_force, difference * np.exp(-log_force)).antiderivative()
        u = u + 2 * force * (beyond(log_force[-1]) - beyond(log_force)) - difference
        return log_force, convex(force, u)

    def separation(self, force: ArrayLike) -> FloatArray:
        """Mean separation [h_rms] at F/(A0 E* g)."""
        log_force, u = self._curve
        return np.asarray(np.interp(np.log(np.asarray(force, float)), log_force, u))

    def force(self, u: ArrayLike) -> FloatArray:
        """F/(A0 E* g) at mean separations [h_rms]; zero above the tabulated lightest."""
        log_force, nodes = self._curve
        gap = np.asarray(u, float)
        positive = nodes > 1e-9
        log_u = np.log(nodes[positive][::-1])
        found = np.exp(np.interp(np.log(gap), log_u, log_force[positive][::-1]))
        return np.asarray(np.where(gap <= nodes[0], found, 0.0))
