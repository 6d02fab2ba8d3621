"""Tangential stiffness and partial slip of a contact under constant normal pressure, from its normal law.

With kappa the normal over the tangential stiffness (`materials.tangential_ratio`), Coulomb friction f at each point::

    full stick        k_t = k_n/kappa, k_n of small unloading: `unloading_stiffness`
    partial slip      tau(delta) = f [p(u) - p(u + delta/(f kappa))]
    gross slip        tau = f p, from delta = f kappa (h_max - u) on
    energy of a cycle 8 times the integral of tau to its amplitude, less 4 tau delta (Masing 1926)

Partial slip is the difference of two normal contacts (M. Ciavarella, J. Mech. Phys. Solids 46 (1998) 2391; J. Jaeger),
for bodies whose normal pressures do not move them tangentially: nu = 0, or alike bodies nearly so. docs/joints.md has
the distance from boundary elements, and how far surfaces with a lay differ.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import Numbers, is_labelled, number_in, require
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import Units
from mbma_tables.materials import Pair, tangential_ratio

OF_YIELDING = (
    "slip of a contact that yields is not known: its normal law is of loading alone; `stiffness` of full stick is"
)


@dataclasses.dataclass(frozen=True, eq=False)
class Tangential:
    """A contact that is sheared, made by `tangential` of contacts and laws; lengths and stresses as theirs."""

    ratio: Any  # kappa
    friction: float | None
    pressure: Numbers
    mean_separation: Numbers
    stiffness: Numbers  # k_t of full stick, d(tau)/d(delta) [stress/length]
    last: Any  # mean separation of last contact, infinite where the theory has none
    units: Units
    # pressure and energy at mean separations, these at pressures; None where it yields
    _normal: tuple[Callable[[Any], Any], Callable[[Any], Any], Callable[[Any], Any]] | None

    def __post_init__(self) -> None:
        if self.friction is not None:
            number_in("friction", self.friction, 1e-12, 1e12)

    @property
    def gross_slip(self) -> Numbers:
        """Displacement from which all of the contact slips [length], f kappa (h_max - u)."""
        found: Numbers = self._known()[3] * (self.last - self.mean_separation)
        return found

    def shear(self, displacement: ArrayLike | str) -> Numbers:
        """Shear stress F_t/A0 at a tangential displacement from rest [stress]; f p from `gross_slip` on.

        Raises
        ------
        InputError, OutOfRangeError
            Without a friction, with a hardness, and for negative displacements.
        """
        normal, _, _, scale = self._known()
        delta = self._checked("displacement", displacement)
        found: Numbers = self.friction * (self.pressure - normal(self._moved(delta / scale)))
        return found

    def displacement(self, shear: ArrayLike | str) -> Numbers:
        """Tangential displacement at a shear stress of at most f p [length]; `gross_slip` at f p."""
        _, _, inverse, scale = self._known()
        tau = self._checked("shear", shear)
        left = self.pressure - tau / self.friction
        if not is_labelled(left):
            left = np.where(np.abs(left) <= 4 * np.finfo(float).eps * np.asarray(self.pressure), 0.0, left)
            require("shear", np.broadcast_to(tau, np.shape(left)), left >= 0, "at most the friction times the pressure")
        found: Numbers = scale * (inverse(left) - self.mean_separation)
        return found

    def energy_loss(self, shear: ArrayLike | str) -> Numbers:
        """Energy per nominal area that a cycle between -shear and shear dissipates [stress length]."""
        _, energy, _, scale = self._known()
        tau, delta = self._checked("shear", shear), self.displacement(shear)
        released = energy(self.mean_separation) - energy(self._moved(delta / scale))
        found: Numbers = 8 * (self.friction or 0.0) * (self.pressure * delta - scale * released) - 4 * tau * delta
        return found

    def _moved(self, approach: Any) -> Any:
        """Mean separation of the contact that is taken off."""
        return np.minimum(self.mean_separation + approach, self.last)

    def _checked(self, name: str, value: Any) -> Any:
        given = self.units.number(name, value)
        if is_labelled(given):
            return given
        array = np.asarray(given, dtype=float)
        require(name, array, array >= 0, "at least 0")
        return array

    def _known(self) -> tuple[Any, ...]:
        """The normal law and f kappa, tangential over normal displacement."""
        if self._normal is None:
            raise InputError(OF_YIELDING)
        if self.friction is None:
            raise InputError("slip needs friction, the coefficient of friction: tangential(friction=...)")
        return *self._normal, self.friction * self.ratio


def ratio_of(nu: Any, E: Any, pair: Pair | None) -> Any:
    """kappa of Poisson's ratios and moduli as given, or of the materials that are named."""
    if nu is not None:
        return tangential_ratio(nu, E)
    if pair is None:
        raise InputError("tangential stiffness needs nu, Poisson's ratio of the bodies, where no materials are named")
    return tangential_ratio(*zip(*((metal.nu, metal.E) for metal in pair.metals), strict=True))
