"""Theories of others, for `python -m generate score`: Persson's with published corrections.

Corrections of its energy and its area. The formulas were read in the public programs
github.com/xylcsi/PerssonModelFudgeFactor, which compare them. With the share s of the squared
gradient g^2 of wavenumbers below q, forces F over A0 E* g and the cover P(q)::

    P = erf(sqrt(2) F/sqrt(v)),  dv/ds = S(P), v(0) = 0      Yang and Persson, Wang and Mueser
    P = erf(sqrt(2) F/sqrt(s (gamma + (1 - gamma) P)))       Xu et al.
    U = pi/2 E* integral C q^2 P S(P) dq,  u = integral from F to infinity of dU/F

Yang and Persson, J. Phys.: Condens. Matter 20 (2008) 215214: S = gamma + (1 - gamma) P^2, gamma =
0.42. Wang and Mueser, Tribol. Lett. 65(3) (2017): S = 5/9 - 2/9 P^2 + 6/9 P^4. "Xu24" of these
programs: gamma = 0.42, the energy with Wang and Mueser's S.
"""

import dataclasses
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.special import erf

from mbma_tables.common.arguments import FloatArray
from mbma_tables.theories.calibrated.formulas import Spectrum

FORCES = np.geomspace(1e-7, 30.0, 400)
BEFORE = (
    10.0  # range of ln s, below the first wavenumber, over which v is integrated, too
)
STEPS = 60  # of the iteration for P


@dataclasses.dataclass(frozen=True)
class Corrected:
    """Persson's theory with S(P), given by its coefficients of 1, P^2, P^4.

    The cover is with gamma where there is one.
    """

    name: str
    weight: tuple[float, ...]
    gamma: float | None = None

    def _weight(self, P: FloatArray) -> FloatArray:
        return np.asarray(np.polynomial.polynomial.polyval(P**2, self.weight))

    def _cover_with_gamma(self, below: FloatArray, gamma: float) -> FloatArray:
        """P by iteration from full contact."""
        P: FloatArray = np.ones((below.size, FORCES.size))
        for _ in range(STEPS):
            variance = below[:, None] * (gamma + (1 - gamma) * P)
            P = erf(np.sqrt(2) * FORCES / np.sqrt(variance))
        return np.asarray(P)

    def cover(self, below: FloatArray) -> FloatArray:
        """P at shares of g^2 (n,), rising, and at `FORCES`; shape (n, forces)."""
        if self.gamma is not None:
            return self._cover_with_gamma(below, self.gamma)
        log_share = np.log(below)

        def slope(log_s: float, log_v: FloatArray) -> FloatArray:
            """d ln v/d ln s."""
            P = erf(np.sqrt(2) * FORCES * np.exp(-log_v / 2))
            return np.asarray(np.exp(log_s - log_v) * self._weight(P))

        start = log_share[0] - BEFORE
        solution = solve_ivp(
            slope,
            (start, 0.0),
            np.full(FORCES.size, start),
            t_eval=log_share,
            rtol=1e-6,
            atol=1e-8,
        )
        log_v = solution.y.T
        return np.asarray(erf(np.sqrt(2) * FORCES * np.exp(-log_v / 2)))

    def at_pressure(
        self, surface: Any, pressure: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """A/A0 and mean separation of a self-affine surface at F/(A0 E*)."""
        spectrum = Spectrum.self_affine(float(surface.hurst), float(surface.zeta_1))
        cover = self.cover(np.append(spectrum.below, 1.0))
        # all wavenumbers are below the end of the spectrum
        area = cover[-1]
        P = cover[:-1]
        energy = (
            (spectrum.x * spectrum.variance)
            @ (P * self._weight(P))
            / (4 * spectrum.gradient)
        )
        # u is the integral of dU/F from F to infinity
        log_force = np.log(FORCES)
        slope = CubicSpline(log_force, energy).derivative()(log_force) / FORCES
        u = CubicSpline(log_force, slope).antiderivative()(log_force)
        log_load = np.log(pressure / surface.rms_gradient)
        area_at = PchipInterpolator(log_force, area, extrapolate=False)
        gap_at = PchipInterpolator(log_force, u[-1] - u, extrapolate=False)
        return area_at(log_load), gap_at(log_load) * surface.h_rms


YANG_PERSSON = Corrected("Yang-Persson 2008, energy and area", (0.42, 0.58))
WANG_MUESER = Corrected("Wang-Müser 2017", (5 / 9, -2 / 9, 6 / 9))
XU = Corrected("Xu et al. 2024", WANG_MUESER.weight, 0.42)
