"""Persson's theory of area and average separation (Eqs. 18-21).

In units of s, 1/q0 and E* q0 s, with y = sqrt(m2) over [1, zeta] (so that w = 1/y) in place of q, (19) is

    u = 2/sqrt(pi) integral_0^Y J(p0/y) / zeta(y) dy,   Y = sqrt(m2) over [1, zeta_1],
    J(a) = integral_a^inf (gamma + 3 (1 - gamma) erf(x)^2) exp(-x^2)/x dx,

where w is infinite at q0 in (19) and nothing is here; u0 and lambda of (21) are moments of 1/zeta(y).
"""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf, erfinv, exp1

from mbma_tables.arguments import FloatArray, finite_array, require
from mbma_tables.calibrated import YANG_PERSSON
from mbma_tables.errors import ConvergenceError, InputError
from mbma_tables.surfaces import spectrum
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.measured import MeasuredSurface
from mbma_tables.surfaces.surface import Surface
from mbma_tables.theories.calibrated_curves import LAW_ERROR, TabulatedLaw, spectrum_of
from mbma_tables.theories.protocol import Theory, TheoryAnswer, select
from mbma_tables.totals.gauss_kronrod import integrate

Method = Literal["full", "simplified"]

GAMMA = 0.42  # Eq. (19)
LAMBDA = 4.047  # Eq. (21b)
RTOL = 1e-12  # asked of the quadratures
DECAY = 45.0  # exp(-DECAY) of an integrand's largest value counts as nothing
MAX_RATIO = 26.0  # p0/Y at which u is still a normal number, about exp(-676)
MIN_LOG_FORCE = -690.0  # log p0/(E* q0 s) of the lightest load that the inverse answers
INVERSE_RTOL = 1e-10  # of a load found from its separation
MANY, SPLINE_NODES = 200, 64  # loads of one surface from which a spline gives the first guess; its nodes
MAX_STEPS = 100  # of the safeguarded Newton iteration; it takes 5 to 15

# exp(-t) over [0, DECAY]: 64 nodes leave 1e-15
_T, _T_WEIGHTS = (
    DECAY / 2 * (np.polynomial.legendre.leggauss(64)[0] + 1),
    DECAY / 2 * np.polynomial.legendre.leggauss(64)[1],
)


def _log_stress(surface: Surface) -> Any:
    """Logarithm of the unit of stress over E*, q0 s."""
    return np.log(surface.q0) + np.log(surface.s)


@dataclasses.dataclass(frozen=True)
class _Bands:
    """Flat (surface, load) pairs: Hurst exponent, log Y, and the log y below which nothing is left."""

    hurst: FloatArray
    log_top: FloatArray
    log_bottom: FloatArray

    @classmethod
    def of(cls, surface: Surface, shape: tuple[int, ...]) -> _Bands:
        hurst = np.broadcast_to(np.asarray(surface.hurst), shape).ravel()
        zeta_1 = np.broadcast_to(np.asarray(surface.zeta_1), shape).ravel()
        log_top = 0.5 * np.log(spectrum.band_moment(2, hurst, 1.0, zeta_1))
        # 1/zeta is 1 below y = sqrt(H): what is left of it there is exp(-DECAY)
        return cls(hurst, log_top, np.minimum(log_top, 0.5 * np.log(hurst)) - DECAY)


def _weight(hurst: FloatArray, log_y: FloatArray) -> FloatArray:
    """y/zeta(y), from y^2 = m2 = H (zeta^(2-2H) - 1)/(2 - 2H): 1/zeta(y) dy = this d(log y)."""
    scaled = np.exp(2 * log_y) / hurst
    x = (2 - 2 * hurst) * scaled
    log_zeta = scaled * np.divide(np.log1p(x), x, out=np.ones_like(x), where=x > 0)
    return np.exp(log_y - log_zeta)


def _simplified(bands: _Bands) -> tuple[FloatArray, FloatArray]:
    """u0/s and log(lambda/(q0 s)) of Eq. (21)."""
    count = bands.hurst.size

    def integrand(owner: NDArray[np.intp], log_y: FloatArray) -> FloatArray:
        weight = _weight(bands.hurst[owner, None], log_y)
        # log(Y/y), not log(1/y): a relative tolerance needs integrands of one sign
        return np.stack([weight, weight * (bands.log_top[owner, None] - log_y)], axis=-1)

    found = integrate(integrand, np.arange(count), bands.log_bottom, bands.log_top, count, RTOL).value
    log_lambda = math.log(LAMBDA) + bands.log_top - found[:, 1] / found[:, 0]
    return GAMMA * 2 / math.sqrt(math.pi) * found[:, 0], log_lambda


def _inner(log_a: FloatArray) -> FloatArray:
    """J(a) and -a J'(a), in the last axis; gamma/2 E1(a^2) and, by x^2 = a^2 + t, a smooth rest."""
    # E1(a^2) = -Euler - log(a^2) to rounding below a = 1e-9, where a^2 may underflow
    tiny = log_a < -20
    a = np.exp(np.where(tiny, -20.0, log_a))
    square = a * a
    exponential = np.where(tiny, -np.euler_gamma - 2 * log_a, exp1(square))
    x2 = square[..., None] + _T
    rest = (erf(np.sqrt(x2)) ** 2 / x2 * np.exp(-_T)) @ _T_WEIGHTS
    decay = np.exp(-square)
    value = GAMMA / 2 * exponential + 1.5 * (1 - GAMMA) * decay * rest
    return np.stack([value, (GAMMA + 3 * (1 - GAMMA) * erf(a) ** 2) * decay], axis=-1)


def _full(bands: _Bands, log_p: FloatArray) -> FloatArray:
    """u/s of Eq. (19) and -d(u/s)/d(log p0), shape (2, loads), at log of p0/(E* q0 s)."""
    log_a = log_p - bands.log_top
    # beyond it no quadrature of denormal numbers meets its tolerance
    some = np.flatnonzero(log_a < math.log(MAX_RATIO + 0.1))
    if some.size == 0:
        return np.zeros((2, log_p.size))
    a_top = np.exp(log_a[some])
    vanished = log_p[some] - 0.5 * np.log(a_top**2 + DECAY)
    low = np.maximum(bands.log_bottom[some], vanished)

    def integrand(owner: NDArray[np.intp], log_y: FloatArray) -> FloatArray:
        weight = _weight(bands.hurst[owner, None], log_y)
        return weight[..., None] * _inner(log_p[owner, None] - log_y)

    found = integrate(integrand, some, low, bands.log_top[some], log_p.size, RTOL)
    return np.asarray(2 / math.sqrt(math.pi) * found.value.T)


def _invert(bands: _Bands, target: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Log of p0/(E* q0 s) at which (19) gives u/s = `target`, and -d(u/s)/d of it: Newton's method on log u."""
    low = np.full(bands.hurst.size, MIN_LOG_FORCE)
    high = bands.log_top + math.log(MAX_RATIO)
    wanted = target.ravel()
    one = bool((bands.hurst == bands.hurst[0]).all() and (bands.log_top == bands.log_top[0]).all())
    some = slice(1) if one else slice(None)
    few = _Bands(bands.hurst[some], bands.log_top[some], bands.log_bottom[some])
    most, least = (_full(few, end[some])[0] for end in (low, high))
    inside = (wanted >= least) & (wanted <= most)
    require(
        "mean_separation/s",
        target,
        inside.reshape(target.shape),
        f"within what normal numbers reach, {least.max():.3g} to {most.min():.6g}",
    )
    u0, log_lambda = _simplified(bands)
    guess = np.clip(log_lambda - wanted / u0, low, high)
    if one and guess.size > MANY:
        guess = np.clip(_guesses(few, wanted, guess), low, high)
    active, (value, slope) = np.ones(guess.size, dtype=bool), np.zeros((2, guess.size))
    for _ in range(MAX_STEPS):
        own = _Bands(bands.hurst[active], bands.log_top[active], bands.log_bottom[active])
        value[active], slope[active] = _full(own, guess[active])
        low = np.where(active & (value >= wanted), guess, low)
        high = np.where(active & (value <= wanted), guess, high)
        step = np.zeros_like(guess)
        step[active] = np.log(value[active] / wanted[active]) * value[active] / slope[active]
        following = guess + step
        outside = active & ((following < low) | (following > high))
        following[outside] = (low + high)[outside] / 2
        # log p0 near -690 carries an error of 1e-13
        active &= np.abs(following - guess) > 1e-12 * np.maximum(1, np.abs(guess))
        guess = following
        if not active.any():
            return guess, slope
    mask = active.reshape(target.shape)
    raise ConvergenceError(f"no load found for {int(mask.sum())} separations in {MAX_STEPS} steps", mask)


@functools.lru_cache(maxsize=32)
def _own_law(surface: MeasuredSurface, full: bool) -> TabulatedLaw:
    """Persson's theory of a surface's own spectrum, with Yang and Persson's weight."""
    if not full:
        raise InputError("the simplified form (20) is of self-affine surfaces: ask method='full', or surface.fit()")
    return TabulatedLaw(spectrum_of(surface), None, YANG_PERSSON)


def own_separation(surface: MeasuredSurface, force: FloatArray, full: bool) -> tuple[FloatArray, FloatArray]:
    """u and -du/dlog F [length] at loads over A0 E*."""
    u, slope = _own_law(surface, full).separation_persson(force / surface.rms_gradient)
    return u * surface.h_rms, -slope * surface.h_rms


def _guesses(band: _Bands, wanted: FloatArray, light: FloatArray) -> FloatArray:
    """Log of the loads at which one surface has u/s = `wanted`, by a spline; `light` is Eq. (20)'s answer."""
    from scipy.interpolate import CubicSpline

    # at high loads u falls faster than (20) has it
    log_p = np.linspace(light.min() - 1, band.log_top[0] + math.log(MAX_RATIO), SPLINE_NODES)
    own = _Bands(*(np.full(SPLINE_NODES, field[0]) for field in (band.hurst, band.log_top, band.log_bottom)))
    average = _full(own, log_p)[0]
    spline = CubicSpline(np.log(average[::-1]), log_p[::-1])
    return np.asarray(spline(np.clip(np.log(wanted), np.log(average[-1]), np.log(average[0]))))


class Persson(Theory):
    """Persson's theory: area by Eq. (18), average separation by Eqs. (19)-(21).

    Parameters
    ----------
    method : {"full", "simplified"}
        The double integral (19), to 1e-11, or its light-load form (20), which ends at u = 0, where the force is lambda.

    Raises
    ------
    InputError
        For another method.

    Examples
    --------
    >>> from mbma_tables import Surface, contact, theories
    >>> found = contact(Surface.named("concrete"), pressure=[0.001, 0.01], theory="persson")
    >>> found.mean_separation.round(4), found.area.round(5)
    (array([0.6721, 0.3801]), array([0.00217, 0.02171]))
    >>> light = theories.Persson("simplified")
    >>> print(f"{contact(Surface.named('concrete'), mean_separation=0.6, E_star=10.0, theory=light).force:.4f}")
    0.0184
    """

    name = "persson"
    ends_at_h_max = False

    def __init__(self, method: Method = "full") -> None:
        if method not in ("full", "simplified"):
            raise InputError(f"method must be 'full' or 'simplified', got {method!r}")
        self.method: Method = method

    @property
    def _is_full(self) -> bool:
        return self.method == "full"

    def scatter_name(self, surface: AnySurface) -> str:
        """The two forms differ by more than their distance from boundary elements."""
        return self.name if self._is_full else f"{self.name}_{self.method}"

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and stiffness at mean separations u [length], positive for the full form.

        Raises
        ------
        OutOfRangeError
            Also where u is so small or so large that the force of the full form is no normal number.
        """
        force, decay = self._force(surface, mean_separation)
        error = np.full(force.shape, LAW_ERROR if isinstance(surface, MeasuredSurface) else INVERSE_RTOL)
        return TheoryAnswer(force, self.area_at(surface, force), force / decay, error)

    def _force(self, surface: AnySurface, mean_separation: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Force over A0 E* at mean separations u [length], and -du/dlog F [length]."""
        u = finite_array("mean_separation", mean_separation)
        allowed = u > 0 if self._is_full else u >= 0
        require("mean_separation", u, allowed, "positive" if self._is_full else "zero or positive")
        u = np.broadcast_to(u, np.broadcast_shapes(u.shape, surface.shape))
        if isinstance(surface, MeasuredSurface):
            log_force, rate = _own_law(surface, self._is_full).gaussian(u / surface.h_rms)
            return np.exp(log_force) * surface.rms_gradient, surface.h_rms / rate
        assert isinstance(surface, Surface)
        bands, target = _Bands.of(surface, u.shape), u / surface.s
        if self._is_full:
            log_p, decay = _invert(bands, target)
        else:
            decay, log_lambda = _simplified(bands)
            log_p = log_lambda - target.ravel() / decay
        return np.exp(log_p.reshape(u.shape) + _log_stress(surface)), decay.reshape(u.shape) * surface.s

    def interval(self, surface: AnySurface, quantity: str = "force") -> tuple[FloatArray, FloatArray]:
        """Mean separations [length] of the theory, whose heights have no end."""
        low = np.zeros(surface.shape)
        return low, np.full_like(low, np.inf)

    def mean_separation_at(self, surface: AnySurface, quantity: str, wanted: FloatArray) -> FloatArray:
        """Mean separation u [length] at a force over A0 E* (19, 20) or an area (18); zero where it underflows."""
        if quantity == "area":
            require("area", wanted, wanted < 1, "below 1, which Persson's theory reaches at infinite load")
            wanted = erfinv(wanted) * np.sqrt(surface.m2)
        force = finite_array("force", wanted)
        require("force", force, force > 0, "positive: u is infinite at zero load")
        force = np.broadcast_to(force, np.broadcast_shapes(force.shape, surface.shape))
        if isinstance(surface, MeasuredSurface):
            return own_separation(surface, force, self._is_full)[0]
        assert isinstance(surface, Surface)
        bands, log_p = _Bands.of(surface, force.shape), (np.log(force) - _log_stress(surface)).ravel()
        if self._is_full:
            average = _full(bands, log_p)[0]
        else:
            u0, log_lambda = _simplified(bands)
            inside = (log_p <= log_lambda).reshape(force.shape)
            require("force", force, inside, "at most lambda E*, where the simplified form (20) reaches u = 0")
            average = u0 * (log_lambda - log_p)
        return np.asarray(average.reshape(force.shape) * surface.s)

    def area_at(self, surface: AnySurface, force: FloatArray) -> FloatArray:
        """A/A0 = erf(p0/(2 sqrt(G))) at a force over A0 E*, G = E*^2 m2/4 at the largest magnification (18)."""
        return np.asarray(erf(force / np.sqrt(surface.m2)))

    def energy(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        """Elastic energy over A0 E* [length], from dU = -F du = F (-du/dlog F) dlog F."""
        force, _ = self._force(surface, mean_separation)
        lighter = force[..., None] * np.exp(-_T)
        batch = select(surface, force.shape, np.arange(force.size).reshape(*force.shape, 1))
        return np.asarray((lighter * self._decay(batch, lighter)) @ _T_WEIGHTS)

    def _decay(self, surface: AnySurface, force: FloatArray) -> FloatArray:
        """-du/dlog F [length] at a load."""
        if isinstance(surface, MeasuredSurface):
            return own_separation(surface, force, self._is_full)[1]
        assert isinstance(surface, Surface)
        bands = _Bands.of(surface, force.shape)
        if not self._is_full:
            return np.asarray(_simplified(bands)[0].reshape(force.shape) * surface.s)
        log_p = (np.log(force) - _log_stress(surface)).ravel()
        return np.asarray(_full(bands, log_p)[1].reshape(force.shape) * surface.s)
