"""Tangential stiffness and partial slip of a contact under constant normal pressure, from its normal law.

With kappa the normal over the tangential stiffness (`materials.tangential_ratio`), Coulomb friction f at each point::

    full stick        k_t = k_n/kappa, k_n of small unloading: `unloading_stiffness`
    partial slip      tau(delta) = f [p(u) - p(u + delta/(f kappa))]
    gross slip        tau = f p, from delta = f kappa (h_max - u) on
    energy of a cycle 8 times the integral of tau to its amplitude, less 4 tau delta (Masing 1926)

Partial slip is the difference of two normal contacts (M. Ciavarella, J. Mech. Phys. Solids 46 (1998) 2391; J. Jaeger),
for bodies whose normal pressures do not move them tangentially: nu = 0, or alike bodies nearly so. Boundary elements of
isotropic surfaces have kappa k_t/k_n from 0.997 to 1.021 at nu = 0.3 and from 1.001 to 1.07 at nu = 0.5, and tau within
0.013 f p of this at 5% and 21% contact. Surfaces stretched 4:1 are up to 16% stiffer across their lay, and as much
softer along it, at nu = 0.3; 36% at nu = 0.5.
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


@dataclasses.dataclass(frozen=True, eq=False)
class Tangential:
    """A contact under constant normal pressure that is sheared; made by `tangential` of contacts and laws.

    Attributes
    ----------
    ratio : ndarray
        kappa, normal over tangential stiffness of the stuck contact.
    friction : float or None
        Coefficient of friction f, where it is given.
    pressure, mean_separation : ndarray
        p [stress] and u [length].
    stiffness : ndarray
        k_t of full stick, d(tau)/d(delta) [stress/length].
    last : ndarray
        Mean separation of last contact [length], infinite where the theory has none.
    """

    ratio: Any
    friction: float | None
    pressure: Numbers
    mean_separation: Numbers
    stiffness: Numbers
    last: Any
    units: Units
    _normal: Callable[[Any], tuple[Any, Any]] | None  # pressure and energy at mean separations; None where it yields
    _inverse: Callable[[Any], Any]  # mean separations at pressures

    def __post_init__(self) -> None:
        if self.friction is not None:
            number_in("friction", self.friction, 1e-12, 1e12)

    @property
    def gross_slip(self) -> Numbers:
        """Displacement from which all of the contact slips [length], f kappa (h_max - u)."""
        self._needed()
        found: Numbers = self._scale * (self.last - self.mean_separation)
        return found

    def shear(self, displacement: ArrayLike | str) -> Numbers:
        """Shear stress F_t/A0 at a tangential displacement from rest [stress]; f p from `gross_slip` on.

        Raises
        ------
        InputError, OutOfRangeError
            Without a friction, with a hardness, and for negative displacements.
        """
        delta = self._checked("displacement", displacement)
        found: Numbers = self.friction * (self.pressure - self._needed()(self._beyond(delta))[0])
        return found

    def displacement(self, shear: ArrayLike | str) -> Numbers:
        """Tangential displacement at a shear stress of at most f p [length]; `gross_slip` at f p."""
        self._needed()
        tau = self._checked("shear", shear)
        left = self.pressure - tau / self.friction
        if not is_labelled(left):
            left = np.where(np.abs(left) <= 4 * np.finfo(float).eps * np.asarray(self.pressure), 0.0, left)
            require("shear", np.broadcast_to(tau, np.shape(left)), left >= 0, "at most the friction times the pressure")
        found: Numbers = self._scale * (self._inverse(left) - self.mean_separation)
        return found

    def energy_loss(self, shear: ArrayLike | str) -> Numbers:
        """Energy per nominal area that a cycle between -shear and shear dissipates [stress length]."""
        normal, delta = self._needed(), self.displacement(shear)
        tau = self._checked("shear", shear)
        released = normal(self.mean_separation)[1] - normal(self._beyond(delta))[1]
        work = self.friction * (self.pressure * delta - self._scale * released)
        found: Numbers = 8 * work - 4 * tau * delta
        return found

    @property
    def _scale(self) -> Any:
        """f kappa, tangential over normal displacement."""
        return self.friction * self.ratio

    def _beyond(self, delta: Any) -> Any:
        """Mean separation of the contact that is taken off."""
        return np.minimum(self.mean_separation + delta / self._scale, self.last)

    def _checked(self, name: str, value: Any) -> Any:
        given = self.units.number(name, value)
        if is_labelled(given):
            return given
        array = np.asarray(given, dtype=float)
        require(name, array, array >= 0, "at least 0")
        return array

    def _needed(self) -> Callable[[Any], tuple[Any, Any]]:
        """The normal law, refused where there is no friction, or where it holds for loading alone."""
        if self._normal is None:
            raise InputError(
                "slip of a contact that yields is not known: its normal law is of loading alone; only `stiffness`, "
                "that of full stick, holds with a hardness"
            )
        if self.friction is None:
            raise InputError("slip needs friction, the coefficient of friction: tangential(friction=...)")
        return self._normal


def ratio_of(nu: Any, E: Any, pair: Pair | None) -> Any:
    """kappa of Poisson's ratios and moduli as given, or of the materials that are named."""
    if nu is not None:
        return tangential_ratio(nu, E)
    if pair is None:
        raise InputError("tangential stiffness needs nu, Poisson's ratio of the bodies, where no materials are named")
    return pair.tangential_ratio
