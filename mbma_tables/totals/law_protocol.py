"""What every contact law answers, whatever theory it is of: values, slopes, energy and inverses against the gap."""

from __future__ import annotations

import abc
import functools
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.arguments import FloatArray, Numbers, finite_array, is_labelled, require
from mbma_tables.compiled import in_blocks
from mbma_tables.errors import ConvergenceError, InputError
from mbma_tables.totals.law_kernel import AREA, AREA_SLOPE, ENERGY, FORCE, FORCE_SLOPE
from mbma_tables.units import Units

BLOCK = 1 << 16  # gaps between two looks for Ctrl-C
SCAN = 49  # gaps at which a law's stiffness is looked at for its maximum
ROUNDING = 4 * float(np.finfo(float).eps)
DIGITS = 10.0  # times a law's error: falls of stiffness below it are its polynomials'


class LawPoint(NamedTuple):
    """Where a law has a given pressure: separation d, mean separation u, A/A0 and -dF/du, of the pressure's shape."""

    separation: Any
    mean_separation: Any
    area: Any
    stiffness: Any


class ContactLaw(abc.ABC):
    """Force and area of one surface against its gap; made by `contact_law`, picklable, a few kB.

    Every method takes the separation d, or the mean separation ``u=`` instead: numbers in the law's unit of length, or
    texts with their own, "0.8 um".

    Attributes
    ----------
    h_max : float
        Highest point [length]; where contact ends there, laws answer zero from this gap on.
    lowest, highest : float
        Gaps d that the law covers; highest is infinite where contact ends at h_max.
    error : float
        Bound on the relative error of force and area, of the polynomials and of what they were made from together.
    turning_point, area_turning_point : float or None
        Gap below which force, or area, falls again, where it does; inverses end there.
    theory, reading, tier : str
        What made it; reading and tier are empty where the theory is not MBMA.
    units : Units
        Of lengths and stresses, as far as the surface and the modulus knew theirs.

    Examples
    --------
    >>> from mbma_tables import Surface, contact_law
    >>> law = contact_law(Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0), E_star=100e3)  # um, MPa
    >>> round(float(law.force(1.0)), 4), round(float(law.separation(force=7.9825)), 4)
    (7.9825, 1.0)
    >>> round(float(law.stiffness_mean(u=2.0)), 3)  # -dF/du [MPa/um]
    31.809
    >>> round(float(law.at_pressure(7.9825).area), 5), round(law.softening, 3)
    (0.00287, 1.06)
    """

    h_max: float
    E_star: float
    error: float
    turning_point: float | None
    area_turning_point: float | None
    theory: str
    reading: str
    tier: str
    units: Units

    @property
    @abc.abstractmethod
    def lowest(self) -> float:
        """Smallest gap covered."""

    @property
    @abc.abstractmethod
    def highest(self) -> float:
        """Largest gap covered."""

    @abc.abstractmethod
    def _fill(self, what: int, gap: FloatArray, out: FloatArray) -> None:
        """One of FORCE, AREA, ... at each gap."""

    @abc.abstractmethod
    def _invert(self, what: int, wanted: FloatArray, end: float, out: FloatArray) -> None:
        """Gaps down to `end` at which FORCE or AREA has the wanted values; NaN where not found."""

    def _gaps(self, separation: Any, u: Any) -> FloatArray:
        if separation is not None and u is not None:
            raise InputError("separation and u: give one of them")
        separation, u = (self.units.number("separation", gap) for gap in (separation, u))
        d = finite_array("separation", separation) if u is None else 2 * finite_array("u", u) - self.h_max
        # ends that are no round numbers are met but for rounding
        limit, slack = ("-h_max = ", 0.0) if self.lowest == -self.h_max else ("", ROUNDING * self.h_max)
        require("separation", d, d >= self.lowest - slack, f"at least {limit}{self.lowest:.17g}, where the theory ends")
        if self.highest < math.inf:
            good = d <= self.highest * (1 + ROUNDING)
            require("separation", d, good, f"at most {self.highest:.17g}, where the law ends")
        return d

    def _map(self, what: int, separation: Any, u: Any = None) -> Numbers:
        given = separation if u is None else u
        if is_labelled(given):
            from mbma_tables.labels import apply

            places = (lambda block: (block, None)) if u is None else (lambda block: (None, block))
            found: Numbers = apply(lambda block: self._map(what, *places(block)), (given,), 1)
            return found
        d = self._gaps(separation, u)
        flat, out = np.ascontiguousarray(d).reshape(-1), np.empty(d.size)
        in_blocks(lambda block: self._fill(what, flat[block], out[block]), d.size, BLOCK)
        return out.reshape(d.shape)[()]

    def __call__(self, separation: ArrayLike | None = None, *, u: ArrayLike | None = None) -> Numbers:
        """The same as `force`."""
        return self._map(FORCE, separation, u)

    def force(self, separation: ArrayLike | None = None, *, u: ArrayLike | None = None) -> Numbers:
        """F/A0 in the unit of E_star at d; where contact ends at h_max, zero from there on."""
        return self._map(FORCE, separation, u)

    def area(self, separation: ArrayLike | None = None, *, u: ArrayLike | None = None) -> Numbers:
        """A/A0 at d; where contact ends at h_max, zero from there on."""
        return self._map(AREA, separation, u)

    def stiffness(self, separation: ArrayLike | None = None, *, u: ArrayLike | None = None) -> Numbers:
        """-dF/dd per nominal area; MBMA's jumps where zeta_d reaches its floor, and belongs to the larger gap there."""
        return self._map(FORCE_SLOPE, separation, u)

    def stiffness_mean(self, separation: ArrayLike | None = None, *, u: ArrayLike | None = None) -> Numbers:
        """-dF/du per nominal area, against the mean separation u = (h_max + d)/2: twice `stiffness`."""
        return 2 * self.stiffness(separation, u=u)

    def area_slope(self, separation: ArrayLike | None = None, *, u: ArrayLike | None = None) -> Numbers:
        """-d(A/A0)/dd."""
        return self._map(AREA_SLOPE, separation, u)

    def energy(self, separation: ArrayLike | None = None, *, u: ArrayLike | None = None) -> Numbers:
        """Elastic energy per nominal area, the integral of force from d to last contact."""
        return self._map(ENERGY, separation, u)

    def separation(self, *, force: ArrayLike | None = None, area: ArrayLike | None = None) -> Numbers:
        """Gap d at a given force or area, on the branch of first contact; where contact ends at h_max, that at zero.

        Raises
        ------
        OutOfRangeError
            Where the branch does not reach the value; the message says how far it goes.
        """
        if (force is None) == (area is None):
            raise InputError("give force or area, one of them")
        name = "area" if force is None else "force"
        given: Any = area if force is None else self.units.number("force", force)
        if is_labelled(given):
            from mbma_tables.labels import apply

            found: Numbers = apply(lambda block: self.separation(**{name: block}), (given,), 1)
            return found
        what, wanted = (FORCE if name == "force" else AREA), finite_array(name, given)
        turn = self.turning_point if what == FORCE else self.area_turning_point
        end = self.lowest if turn is None else turn
        largest = float(self._map(what, end))
        require(name, wanted, wanted >= 0, "at least 0")
        if self.highest < math.inf:
            least = float(self._map(what, self.highest))
            require(name, wanted, wanted >= least, f"at least {least:.6g}, where the law of {self.theory!r} ends")
        require(name, wanted, wanted <= largest, f"at most {largest:.6g}, at d = {end:.6g} where the branch ends")
        flat, out = np.ascontiguousarray(wanted).reshape(-1), np.empty(wanted.size)
        in_blocks(lambda block: self._invert(what, flat[block], end, out[block]), out.size, BLOCK)
        gap = out.reshape(wanted.shape)
        if np.isnan(gap).any():
            raise ConvergenceError(f"no gap found for some of {name}", np.isnan(gap))
        return gap[()]

    def at_pressure(self, pressure: ArrayLike) -> LawPoint:
        """Separations, area and stiffness -dF/du where F/A0 is `pressure`, on the branch of first contact."""
        d = self.separation(force=pressure)
        return LawPoint(d, (self.h_max + d) / 2, self.area(d), self.stiffness_mean(d))

    @functools.cached_property
    def softening(self) -> float | None:
        """Mean separation u [length] below which stiffness falls with compression; None where it rises to the end."""
        from scipy.optimize import minimize_scalar

        step = (self.h_max - max(self.lowest, -self.h_max)) / 2 / SCAN
        u = self.h_max - step * np.arange(1, SCAN + 1)
        u[-1] = max(u[-1], (self.h_max + self.lowest) / 2)
        values = np.asarray(self.stiffness_mean(u=u))
        falls = values[1:] < values[:-1] * (1 - DIGITS * self.error)
        if not falls.any():
            return None
        peak = int(falls.argmax())
        low, high = u[peak + 1], min(u[peak] + step, self.h_max)
        found = minimize_scalar(
            lambda x: -self.stiffness_mean(u=x), bounds=(low, high), method="bounded", options={"xatol": 1e-7 * high}
        )
        return float(found.x)
