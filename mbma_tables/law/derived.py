"""Quantities derived from a law on first access: unloading, sliding, tangents, softening, leakage, its picture."""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, Numbers, finite_array
from mbma_tables.common.errors import InputError
from mbma_tables.common.plots import Curve, draw_compression, pressure_label, theory_label
from mbma_tables.common.units import unit_of
from mbma_tables.contacts.interface import (
    OF_LAY,
    OF_YIELDING,
    NormalOfLaw,
    Tangential,
    ratio_of,
)

if TYPE_CHECKING:
    from mbma_tables.law.leakage import LeakageLaw

LIGHT, HEAVY = (
    1e-2,
    0.99,
)  # overclosures of the default ends of a continued law, over that of the law's last
SCAN = 49  # gaps at which a law's stiffness is looked at for its maximum
DIGITS = 10.0  # times a law's error: smaller decreases of stiffness are errors of the polynomials


@dataclasses.dataclass(frozen=True, eq=False)
class ContinuedLaw:
    """Pressure of a `ContactLaw` between two mean separations, and straight lines that continue it with its slope.

    Towards wide gaps the line crosses zero: pressure is negative there, which attracts
    separated bodies in trial steps. Neither end is a law of contact: check with `inside`
    that a solution lies between them.
    """

    law: Any
    light: float  #: mean separation of the end towards wide gaps [length]
    heavy: float  #: and of the other

    def pressure_and_stiffness(
        self, mean_separation: ArrayLike | str
    ) -> tuple[Numbers, Numbers]:
        """F/A0 and its derivative -dp/du, in one pass."""
        u = self._given(mean_separation)
        held = np.clip(u, self.heavy, self.light)
        pressure, stiffness = self.law.pressure_and_stiffness(held)
        return pressure + stiffness * (held - u), stiffness

    def pressure(self, mean_separation: ArrayLike | str) -> Numbers:
        """F/A0."""
        return self.pressure_and_stiffness(mean_separation)[0]

    def stiffness(self, mean_separation: ArrayLike | str) -> Numbers:
        """-dp/du."""
        return self.pressure_and_stiffness(mean_separation)[1]

    def inside(self, mean_separation: ArrayLike | str) -> Any:
        """Whether the law itself applies, or the bodies are apart and its pressure is zero; False at first contact."""
        u = self._given(mean_separation)
        return (self.heavy <= u) & (u <= self.light)

    def _given(self, mean_separation: ArrayLike | str) -> FloatArray:
        return finite_array(
            "mean_separation", self.law.units.number("mean_separation", mean_separation)
        )


class Derived:
    """The part of a `ContactLaw` that is computed on first access."""

    def unloading_stiffness(
        self: Any,
        mean_separation: ArrayLike | None = None,
        *,
        separation: ArrayLike | None = None,
    ) -> Numbers:
        """-dp/du of a small unloading at constant contact area [stress/length]; `stiffness` where nothing yields.

        With a hardness it is made from the law of the elastic contact, which is fitted when
        this is first called.
        """
        law, factor = self.unloading
        found: Numbers = factor * law.stiffness(mean_separation, separation=separation)
        return found

    @functools.cached_property
    def unloading(self: Any) -> tuple[Any, float]:
        """The law of the elastic contact, and `unloading_stiffness` over its stiffness."""
        if math.isinf(self.hardness):
            return self, 1.0
        from mbma_tables.theories.yielding.formulas import frozen_factor

        factor = frozen_factor(
            self.hardness / (self.E_star * float(self.surface.rms_gradient))
        )
        return dataclasses.replace(self.elastic(), units=self.units), float(factor)

    def tangential(
        self: Any,
        mean_separation: ArrayLike | None = None,
        *,
        pressure: ArrayLike | str | None = None,
        friction: float | None = None,
        nu: Any = None,
        E: Any = None,
        direction: str | None = None,
    ) -> Tangential:
        """Tangential stiffness and slip at a mean separation or a pressure, as `Contact.tangential`."""
        if (mean_separation is None) == (pressure is None):
            raise InputError("give the mean separation, or pressure=, one of them")
        if pressure is None:
            u = self.units.number("mean_separation", mean_separation)
            held = self.pressure(u)
        else:
            u, held = (
                self.at_pressure(pressure).mean_separation,
                self.units.number("pressure", pressure),
            )
        ratio = ratio_of(nu, E, self.materials, direction, self.surface, self.area(u))
        normal: NormalOfLaw | str = NormalOfLaw(self)
        if self.hardness < math.inf:
            normal = OF_YIELDING
        elif direction:
            normal = OF_LAY
        return Tangential(
            ratio,
            friction,
            held,
            u,
            stiffness=self.unloading_stiffness(u) / ratio,
            last=self.h_max if math.isinf(self.highest) else math.inf,
            units=self.units,
            _normal=normal,
        )

    def continued(self: Any, pressures: tuple[Any, Any] | None = None) -> ContinuedLaw:
        """The law continued by its tangents beyond two pressures, for the trial steps of Newton's method.

        With the tangents, Newton's method returns from trial steps without contact, where
        the law has neither pressure nor stiffness, and from steps beyond full compression,
        where it raises an error. Check `inside` at the solution; if the bodies are apart
        there, continue the iteration with the law itself.

        Parameters
        ----------
        pressures : pair of float or str, optional
            Pressures between which the law itself is used; default: those at 1% and 99% of
            its compression, or where its stiffness begins to decrease.

        Examples
        --------
        >>> from mbma_tables import Surface, contact_law
        >>> law = contact_law(Surface.named("concrete"), E_star="13.3 MPa", theory="calibrated")
        >>> trial, u = law.continued(), law.h_max
        >>> for _ in range(12):  # the load is 0.1 MPa
        ...     pressure, stiffness = trial.pressure_and_stiffness(u)
        ...     u += (pressure - 0.1) / stiffness
        >>> bool(trial.inside(u)), round(float(law.pressure(u)), 12)
        (True, 0.1)
        """
        if pressures is None:
            end = self.lowest if self.turning_point is None else self.turning_point
            light, heavy = (
                self.h_max - share * (self.h_max - end) / 2 for share in (LIGHT, HEAVY)
            )
            if (
                self.softening is not None
            ):  # beyond it tangents fall, to zero where pressure turns down
                heavy = max(heavy, self.softening)
        elif isinstance(pressures, tuple | list | np.ndarray) and len(pressures) == 2:
            light, heavy = (
                float(self.at_pressure(pressure).mean_separation)
                for pressure in pressures
            )
        else:
            raise InputError(f"pressures must be two rising numbers, got {pressures!r}")
        if not heavy < light or not float(self.stiffness(light)) > 0:
            raise InputError(
                f"pressures must be two rising numbers above zero, got {pressures!r}"
            )
        return ContinuedLaw(self, light, heavy)

    @functools.cached_property
    def softening(self: Any) -> float | None:
        """Mean separation u [length] below which the stiffness decreases with compression; None if it never does."""
        from scipy.optimize import minimize_scalar

        lowest = max(self.lowest, -self.h_max)
        step = (self.h_max - lowest) / 2 / SCAN
        u = self.h_max - step * np.arange(1, SCAN + 1)
        u[-1] = max(u[-1], (self.h_max + lowest) / 2)
        values = np.asarray(self.stiffness(u))
        falls = values[1:] < values[:-1] * (1 - DIGITS * self.error)
        if not falls.any():
            return None
        peak = int(falls.argmax())
        low, high = u[peak + 1], min(u[peak] + step, self.h_max)
        near = {
            "bounds": (low, high),
            "method": "bounded",
            "options": {"xatol": 1e-7 * high},
        }
        return float(minimize_scalar(lambda x: -self.stiffness(x), **near).x)

    @functools.cached_property
    def leakage(self: Any) -> LeakageLaw:
        """Flow coefficient at a mean separation, ``separation=`` or ``pressure=``, a `LeakageLaw`, made when read.

        Examples
        --------
        >>> from mbma_tables import Surface, contact_law
        >>> seal = Surface(hurst=0.8, q0=0.01, q1=1.0, h_rms=1.0, h_max=3.5, unit="um")
        >>> law = contact_law(seal, E_star="10 MPa", theory="calibrated")
        >>> f"{law.leakage(pressure='0.05 MPa'):.1g} um^3"
        '0.001 um^3'
        """
        from mbma_tables.law.leakage import leakage_law

        if self.surface is None:
            raise InputError("leakage needs the surface, which this law does not contain")
        return leakage_law(self, self.surface)

    def _figure(self: Any) -> Any:
        held = self._variables()
        lines = (held[name].values for name in ("mean_separation", "pressure", "area"))
        pressure, gap = (
            pressure_label(unit_of("pressure", self.units)),
            self.units.length or "length",
        )
        curve, gap = (
            Curve(theory_label(self.theory), *lines),
            f"mean separation u [{gap}]",
        )
        return draw_compression([curve], pressure_label=pressure, gap_label=gap)
