"""A contact under shear at constant normal pressure: full stick, partial and gross slip."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.bodies.materials import tangential_ratio
from mbma_tables.common.arguments import (
    FloatArray,
    Numbers,
    finite_array,
    is_labelled,
    positive_array,
    require,
)
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import Units
from mbma_tables.contacts.quantities.lay import stress_shares

if TYPE_CHECKING:
    from mbma_tables.contacts.quantities.state import State

OF_ADHESION = "slip of bodies that attract each other is not known: friction of what the attraction presses was not compared; `stiffness` of full stick is known"
OF_LAY = "slip of a surface with a lay was not compared with simulations; `stiffness` of full stick is known"
DIRECTIONS = ("along", "across")
ISOTROPIC = 1.4  # anisotropy up to which the isotropic ratio is taken


def checked_friction(friction: Any) -> None:
    """Reject coefficients of friction that are given and not positive."""
    if friction is not None:
        numbers = positive_array("friction", friction)
        require(
            "friction",
            numbers,
            (numbers >= 1e-12) & (numbers <= 1e12),
            "in [1e-12, 1e12]",
        )


def checked_direction(direction: Any, surface: Any) -> None:
    """Reject directions that are given and unknown, or of a surface whose lay is not known."""
    if direction is None:
        return
    if direction not in DIRECTIONS:
        raise InputError(
            f"direction must be one of {DIRECTIONS}, relative to the lay, got {direction!r}"
        )
    if getattr(surface, "anisotropy", None) is None:
        raise InputError(
            "direction needs a surface whose anisotropy is known, such as that of a map"
        )


@dataclasses.dataclass(frozen=True, eq=False)
class Tangential:
    """A contact under shear at constant normal pressure, made by `tangential` of contacts and laws, in their units.

    With kappa the normal over the tangential stiffness (`materials.tangential_ratio`),
    Coulomb friction f at each point::

        full stick        k_t = k_n/kappa, k_n of small unloading: `unloading_stiffness`
        partial slip      tau(delta) = f [p(u) - p(u + delta/(f kappa))]
        gross slip        tau = f p, from delta = f kappa (h_max - u) on
        energy of a cycle 8 times the integral of tau to its amplitude, less 4 tau delta (Masing 1926)

    Partial slip is the difference of two normal contacts (M. Ciavarella, J. Mech. Phys.
    Solids 46 (1998) 2391), with a hardness of those of unloading from this one, whose
    yielded points stay flat; for isotropic bodies whose normal pressures do not move them
    tangentially: nu = 0, or alike bodies nearly so.
    """

    ratio: Any  # kappa
    friction: ArrayLike | None
    pressure: Numbers
    mean_separation: Numbers
    stiffness: Numbers  #: k_t of full stick, d(tau)/d(delta) [stress/length]
    last: Any  # mean separation of last contact, infinite where the theory has none
    units: Units
    # or why slip is not known
    _normal: State | str = dataclasses.field(repr=False)

    def __post_init__(self) -> None:
        checked_friction(self.friction)

    @property
    def gross_slip(self) -> Numbers:
        """Tangential displacement at which the whole contact slips [length], f kappa (h_max - u)."""
        _, friction = self._slipping()
        displacement: Numbers = friction * self.ratio * (self.last - self.mean_separation)
        return displacement

    def shear(self, displacement: ArrayLike | str) -> Numbers:
        """Shear stress F_t/A0 at a tangential displacement from rest [stress]; f p from `gross_slip` on.

        Raises
        ------
        InputError, OutOfRangeError
            Without a friction, and for negative displacements.
        """
        normal, friction = self._slipping()
        delta = self._checked("displacement", displacement)
        apart = self._moved(delta / (friction * self.ratio))
        shear: Numbers = friction * (self.pressure - normal.pressure_at(apart))
        return shear

    def displacement(self, shear: ArrayLike | str) -> Numbers:
        """Tangential displacement at a shear stress of at most f p [length]; `gross_slip` at f p."""
        normal, friction = self._slipping()
        tau = self._checked("shear", shear)
        left = self.pressure - tau / friction
        if not is_labelled(left):
            left = np.where(
                np.abs(left) <= 4 * np.finfo(float).eps * np.asarray(self.pressure),
                0.0,
                left,
            )
            require(
                "shear",
                np.broadcast_to(tau, np.shape(left)),
                left >= 0,
                "at most the friction times the pressure",
            )
        displacement: Numbers = (
            friction * self.ratio * (normal.separation_at(left) - self.mean_separation)
        )
        return displacement

    def energy_loss(self, shear: ArrayLike | str) -> Numbers:
        """Energy per nominal area that a cycle between -shear and shear dissipates [stress length]."""
        normal, friction = self._slipping()
        tau = self._checked("shear", shear)
        delta = self.displacement(shear)
        scale = friction * self.ratio
        released = normal.energy_at(self.mean_separation) - normal.energy_at(
            self._moved(delta / scale)
        )
        loss: Numbers = (
            8 * friction * (self.pressure * delta - scale * released) - 4 * tau * delta
        )
        return loss

    def _moved(self, approach: Any) -> Any:
        """Mean separation of the contact whose pressure is subtracted."""
        return np.minimum(self.mean_separation + approach, self.last)

    def _checked(self, name: str, value: Any) -> Any:
        given = self.units.number(name, value)
        if is_labelled(given):
            return given
        array = finite_array(name, given)
        require(name, array, array >= 0, "at least 0")
        return array

    def _slipping(self) -> tuple[State, Any]:
        """The normal contact, and the coefficient of friction; an error where slip is not known."""
        if isinstance(self._normal, str):
            raise InputError(self._normal)
        if self.friction is None:
            raise InputError(
                "slip needs friction, the coefficient of friction: tangential(friction=...)"
            )
        if is_labelled(self.friction):
            return self._normal, self.friction
        return self._normal, np.asarray(self.friction, dtype=float)[()]


def tangential_ratio_of(contact: State, direction: str | None = None) -> Any:
    """kappa, normal over tangential stiffness of a stuck contact, in a direction or that of the joint's shear."""
    direction = contact.interface.direction if direction is None else direction
    return ratio_on(contact.surface, contact.bodies.bodies, direction, contact.area)


def ratio_on(surface: Any, bodies: Any, direction: str | None, area: Any) -> Any:
    """kappa of bodies on a surface, whose lay and contact area count where a direction is given."""
    if bodies.nu is None:
        raise InputError(
            "tangential stiffness needs nu, Poisson's ratio of the bodies: Bodies(..., nu=0.3), or named metals"
        )
    lay: Any = getattr(surface, "anisotropy", None)
    if direction is None:
        if lay is not None and lay > ISOTROPIC:
            raise InputError(
                f"the surface has a lay (anisotropy {lay:.3g}): give direction, 'along' or 'across' it"
            )
        return tangential_ratio(bodies.nu, bodies.E)
    checked_direction(direction, surface)

    def share(poisson: FloatArray) -> Any:
        # one axis of Poisson's ratios after those of the contact areas
        areas = np.asarray(area)[(..., *[None] * poisson.ndim)]
        return stress_shares(lay, areas, poisson)[DIRECTIONS.index(direction)]

    return tangential_ratio(bodies.nu, bodies.E, share)


def sheared(
    contact: State, friction: float | None = None, direction: str | None = None
) -> Tangential:
    """A contact under shear, with the joint's friction and direction where they are not given."""
    direction = contact.interface.direction if direction is None else direction
    ratio = tangential_ratio_of(contact, direction)
    # shear takes pressure off in Ciavarella's superposition, which yielded points resist
    # elastically
    unloading = contact if direction is not None else contact.unloading()
    normal: State | str = unloading if direction is None else OF_LAY
    if contact.bodies.adhesion is not None:
        normal = OF_ADHESION
    return Tangential(
        ratio=ratio,
        friction=contact.interface.friction if friction is None else friction,
        pressure=contact.pressure,
        mean_separation=unloading.mean_separation,
        stiffness=contact.unloading_stiffness / ratio,
        last=unloading.last_contact,
        units=contact.unit_system,
        _normal=normal,
    )
