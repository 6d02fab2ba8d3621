"""Persson's energy integral with cover and weight calibrated on boundary elements; equations in docs/theories.md.

Force is over A0 E* g with g the rms gradient in two dimensions, lengths in h_rms,
wavenumbers x = q/q0, energy over A0 E* g h_rms. The compiled core, spectrum_laws.c, keeps
u_P(F) as polynomials of ln F.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, answered, entry_by_entry, require
from mbma_tables.common.errors import ConvergenceError, InputError
from mbma_tables.common.shared import shared, shared_property
from mbma_tables.core import core

POWERS = (1, 3, 16)  # powers of the cover in the weight W
NARROWNESS = 0.65  # reference of W's slope
LAW_ERROR = 1e-7  # numerical error of a measured spectrum's law
KEPT = 256  # spectra and laws of surfaces in the cache
MOST_FORCE = 1e100  # for which contact is full
UNRESOLVED = 4  # the core's status where a quadrature did not reach its tolerance


@dataclasses.dataclass(frozen=True)
class CalibratedConstants:
    """The law's constants."""

    # S of the area: s0 = area_s0 + area_slope ln(alpha/10), at most Persson's 1
    area_s0: float = 0.5131
    area_slope: float = 0.02973
    area_t0: float = 0.3428
    weight: float = 0.438  # W's coefficient a,
    weight_slope: float = 0.08577  # its slope in the narrowness less 0.65,
    cubic: float = 0.4279  # and b
    tail: float = 0.05822  # c of the Gaussian tail factor


CONSTANTS = CalibratedConstants()
PERSSON = CalibratedConstants(
    area_s0=1.0, area_slope=0.0, weight=1.0, weight_slope=0.0, cubic=0.0, tail=0.0
)
YANG_PERSSON = dataclasses.replace(PERSSON, weight=0.42, cubic=0.58)


def area(
    force: ArrayLike, alpha: ArrayLike, constants: CalibratedConstants = CONSTANTS
) -> FloatArray:
    """A/A0 at F/(A0 E* g) >= 0 on a surface of Nayak's parameter alpha = m0 m4/m2^2."""
    return area_of(force, light_factor(alpha, constants), constants.area_t0)


def area_of(force: ArrayLike, s0: ArrayLike, t0: float) -> FloatArray:
    """A/A0 at F/(A0 E* g) by the light factor s0 and t0."""
    from scipy.special import erf

    F = np.minimum(force, MOST_FORCE)
    F = np.where(F >= 0, F, np.nan)
    return np.asarray(erf(F * np.sqrt(2 * (1 + F / t0) / (np.asarray(s0) + F / t0))))


def force_of(
    e: ArrayLike, light: ArrayLike, constants: CalibratedConstants = CONSTANTS
) -> FloatArray:
    """F/(A0 E* g) at A/A0 = erf(e) by the light-load factor s0; inverts `area`: 2 y^2 (1 + y/t0) = e^2 (s0 + y/t0)."""
    wanted = np.asarray(e, float)
    s0 = np.asarray(light)
    t0 = constants.area_t0
    # at y = e/sqrt(2) the left side is the larger, and the cubic is convex from there to its root
    y = wanted / np.sqrt(2)
    for _ in range(60):
        miss = 2 * y**2 * (1 + y / t0) - wanted**2 * (s0 + y / t0)
        slope = 4 * y + 6 * y**2 / t0 - wanted**2 / t0
        step = np.divide(miss, slope, out=np.zeros(np.shape(slope)), where=slope > 0)
        y = np.maximum(y - step, 0.3 * y)
        if (step <= 1e-15 * y).all():
            break
    return np.asarray(y)


def light_factor(
    alpha: ArrayLike, constants: CalibratedConstants = CONSTANTS
) -> FloatArray:
    """s0, the value of S at light loads."""
    return np.minimum(
        constants.area_s0 + constants.area_slope * np.log(np.asarray(alpha) / 10), 1.0
    )


@dataclasses.dataclass(frozen=True, eq=False)
class Spectrum:
    """An isotropic spectrum as a quadrature rule, arrays of shape (n,)."""

    x: FloatArray  # wavenumbers over a reference q0 (any: it cancels), rising
    variance: FloatArray  # shares of h_rms^2, their sum 1
    below: FloatArray  # shares of g^2 of wavenumbers below each x
    gradient: float  # g/(q0 h_rms)
    alpha: float  # m0 m4/m2^2

    @shared_property
    def narrowness(self) -> float:
        """Harmonic over arithmetic mean wavenumber, weighted by variance: 1 for one wavelength, 0 for a broad band."""
        return float(
            1 / (np.sum(self.variance * self.x) * np.sum(self.variance / self.x))
        )

    @classmethod
    def self_affine(cls, hurst: float, zeta_1: float) -> Spectrum:
        """Power law x^(-2H) between 1 and zeta_1."""
        return cls.from_samples(
            np.array([1.0, zeta_1]), np.array([1.0, zeta_1 ** (-2 - 2 * hurst)])
        )

    @classmethod
    def from_samples(cls, q: FloatArray, C: FloatArray) -> Spectrum:
        """Power laws between samples of C(q) [length^4], h_rms^2 = 2 pi integral C q dq; a repeated q is a jump."""
        facts = np.empty(4)
        none = np.empty(0)
        count = core.spectrum_waves(q, C, none, none, none, facts)
        if not count:
            raise InputError(
                "there is no spectrum between these samples, or its moments are not finite"
            )
        x, variance, below = np.empty((3, count))
        core.spectrum_waves(q, C, x, variance, below, facts)
        return cls(x, variance, below, *facts[:2].tolist())

    @classmethod
    def from_shares(cls, x: ArrayLike, variance: ArrayLike) -> Spectrum:
        """Spectrum from bands of wavenumber x (root mean square of each) with these shares of the height variance."""
        wavenumber = np.asarray(x, float)
        share = np.asarray(variance, float)
        held = share > 0
        wavenumber = wavenumber[held]
        share = share[held] / share[held].sum()
        slopes = share * wavenumber**2
        m2 = slopes.sum()
        # half of a band lies below its middle
        below = (np.cumsum(slopes) - slopes / 2) / m2
        alpha = 1.5 * np.sum(share * wavenumber**4) / m2**2
        return cls(wavenumber, share, below, float(np.sqrt(m2)), float(alpha))


@dataclasses.dataclass(frozen=True, eq=False)
class SpectrumLaw:
    """The curve of a spectrum, of a Gaussian surface without end or, with `h_max` [h_rms], of one that ends there."""

    spectrum: Spectrum
    h_max: float | None = None
    constants: CalibratedConstants = CONSTANTS

    @shared_property
    def tail(self) -> float:
        """c (1 - nu) of the tail factor."""
        return self.constants.tail * (1 - self.spectrum.narrowness)

    @shared_property
    def coefficients(self) -> FloatArray:
        """Coefficients of `POWERS` in W."""
        c = self.constants
        a = c.weight + c.weight_slope * (self.spectrum.narrowness - NARROWNESS)
        return np.array([a, c.cubic, 1 - a - c.cubic])

    @shared_property
    def _prepared(self) -> FloatArray:
        """The law in the core's format."""
        s = self.spectrum
        highest = np.inf if self.h_max is None else self.h_max
        numbers = np.array(
            [s.gradient, s.alpha, *dataclasses.astuple(self.constants), highest]
        )
        law = np.empty(core.words_of_spectrum_law())
        work = np.empty(3 * s.x.size)
        status = core.spectrum_law_of(s.x, s.variance, s.below, numbers, work, law)
        if status == UNRESOLVED:
            raise ConvergenceError(
                "the law of this spectrum has no curve that polynomials follow"
            )
        if status:
            raise InputError(
                "a spectrum has rising positive wavenumbers and shares of variance that are not negative"
            )
        return law

    def energy(self, force: ArrayLike) -> FloatArray:
        """Elastic energy U of the endless Gaussian surface, before its tail factor."""
        from scipy.special import erf

        s = self.spectrum
        loads = np.asarray(force, float)
        shares = s.x * s.variance / (4 * s.gradient)
        reach = np.sqrt(2) / np.sqrt(s.below)

        def of_block(part: FloatArray) -> FloatArray:
            cover = erf(part[:, None] * reach)
            weights = np.zeros_like(cover)
            for power, coefficient in zip(
                POWERS, self.coefficients.tolist(), strict=True
            ):
                weights += coefficient * cover**power
            # a sum for each load, whose order does not depend on how many there are
            return np.asarray((weights * shares).sum(axis=-1))

        return entry_by_entry(of_block, s.x.size, loads)

    def separation_persson(self, force: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """u_P and du_P/d ln F, before the tail factor; 0 at loads that close the gap."""
        u, slope = answered(
            functools.partial(core.spectrum_law_separation, self._prepared),
            (force,),
            2,
            0,
        )
        return u, slope

    def contact(self, u: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Force, area and -dF/du at mean separations u [h_rms]: 0 from h_max on, without bound at u = 0."""
        force, share, stiffness = answered(
            functools.partial(core.spectrum_law_contact, self._prepared), (u,), 3
        )
        return force, share, stiffness

    def force(self, u: ArrayLike) -> FloatArray:
        """F/(A0 E* g) at mean separations u [h_rms]; zero from h_max on."""
        return self.contact(u)[0]

    def separation(self, force: ArrayLike) -> FloatArray:
        """Mean separation u [h_rms] at F/(A0 E* g): the inverse of `force`."""
        return answered(
            functools.partial(core.spectrum_law_separation, self._prepared),
            (force,),
            2,
            1,
        )[0]

    def area(self, force: ArrayLike) -> FloatArray:
        """A/A0 at F/(A0 E* g)."""
        return area(force, self.spectrum.alpha, self.constants)


@shared(KEPT)
def self_affine_law(
    hurst: float,
    zeta_1: float,
    h_max: float | None,
    constants: CalibratedConstants = CONSTANTS,
) -> SpectrumLaw:
    """The law of a self-affine surface, cached."""
    return SpectrumLaw(Spectrum.self_affine(hurst, zeta_1), h_max, constants)


@shared(KEPT)
def spectrum_of(surface: Any) -> Spectrum:
    """The spectrum of a `MeasuredSurface`."""
    return Spectrum.from_samples(
        *(np.ascontiguousarray(part, float) for part in (surface.q, surface.C))
    )


def force_at_area(
    area: ArrayLike, light: ArrayLike, constants: CalibratedConstants = CONSTANTS
) -> FloatArray:
    """F/(A0 E* g) at A/A0."""
    from scipy.special import erfinv

    share = np.asarray(area, float)
    require(
        "area",
        share,
        (share >= 0) & (share < 1),
        "below 1, which is reached at infinite load",
    )
    return force_of(erfinv(share), light, constants)


def mean_top_height(share: ArrayLike) -> FloatArray:
    """M_G(a) = phi(z)/a, z = -Phi^-1(a): mean height of the highest share a of a Gaussian surface [h_rms]."""
    from scipy.special import ndtri

    a = np.asarray(share, float)
    z = ndtri(a)
    return np.asarray(np.exp(-z * z / 2) / np.sqrt(2 * np.pi) / a)
