"""Conductance and tangential stiffness of a contact: quantities that depend on constants of the bodies or of a gas."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import (
    FloatArray,
    Numbers,
    is_labelled,
    number_in,
    require,
)
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import Units, factor
from mbma_tables.materials import Pair, tangential_ratio
from mbma_tables.quantities.lay import stress_shares
from mbma_tables.surfaces.any_surface import AnySurface

OF_YIELDING = "slip of a contact that yields is not known: its normal law is for loading only; `stiffness` of full stick is known"
OF_LAY = "slip of a surface with a lay was not compared with simulations; `stiffness` of full stick is known"
DIRECTIONS = ("along", "across")
ISOTROPIC = 1.4  # anisotropy up to which the isotropic ratio is taken


def _pressure_at(
    theory: Any, surface: AnySurface, u: FloatArray, E_star: FloatArray
) -> tuple[Any]:
    return (E_star * theory.answer(surface, u).pressure,)


def _energy_at(
    theory: Any, surface: AnySurface, u: FloatArray, E_star: FloatArray
) -> tuple[Any]:
    return (E_star * theory.energy(surface, u),)


def _separation_at(
    theory: Any,
    surface: AnySurface,
    _: FloatArray,
    E_star: FloatArray,
    pressure: FloatArray,
) -> tuple[Any]:
    return (theory.mean_separation_at(surface, "pressure", pressure / E_star),)


@dataclasses.dataclass(frozen=True, eq=False)
class NormalOfContact:
    """Normal contact of the bodies of a `Contact` at other gaps, from which its partial slip follows."""

    source: Any  # of the contact
    contact: Any

    def pressure(self, mean_separation: Any) -> Any:
        """Pressure at mean separations."""
        return self._at(_pressure_at, mean_separation)

    def energy(self, mean_separation: Any) -> Any:
        """Elastic energy per nominal area at mean separations."""
        return self._at(_energy_at, mean_separation)

    def separation(self, pressure: Any) -> Any:
        """Mean separation at pressures."""
        return self.source.map(_separation_at, self.contact, 1, {"pressure": pressure})[0]

    def _at(self, function: Callable[..., tuple[Any]], mean_separation: Any) -> Any:
        moved = dataclasses.replace(self.contact, mean_separation=mean_separation)
        return self.source.map(function, moved, 1)[0]


@dataclasses.dataclass(frozen=True, eq=False)
class NormalOfLaw:
    """The same of a `ContactLaw`."""

    law: Any

    def pressure(self, mean_separation: Any) -> Any:
        """Pressure at mean separations."""
        return self.law.pressure(mean_separation)

    def energy(self, mean_separation: Any) -> Any:
        """Elastic energy per nominal area at mean separations."""
        return self.law.energy(mean_separation)

    def separation(self, pressure: Any) -> Any:
        """Mean separation at pressures."""
        return self.law.at_pressure(pressure).mean_separation


def checked_friction(friction: Any) -> None:
    """Reject coefficients of friction that are given and not positive."""
    if friction is not None:
        number_in("friction", friction, 1e-12, 1e12)


def checked_direction(direction: Any, surface: AnySurface) -> None:
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
    Solids 46 (1998) 2391), for isotropic bodies whose normal pressures do not move them
    tangentially: nu = 0, or alike bodies nearly so.
    """

    ratio: Any  # kappa
    friction: float | None
    pressure: Numbers
    mean_separation: Numbers
    stiffness: Numbers  #: k_t of full stick, d(tau)/d(delta) [stress/length]
    last: Any  # mean separation of last contact, infinite where the theory has none
    units: Units
    # or why slip is not known
    _normal: NormalOfContact | NormalOfLaw | str = dataclasses.field(repr=False)

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
            Without a friction, with a hardness, and for negative displacements.
        """
        normal, friction = self._slipping()
        delta = self._checked("displacement", displacement)
        apart = self._moved(delta / (friction * self.ratio))
        shear: Numbers = friction * (self.pressure - normal.pressure(apart))
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
            friction * self.ratio * (normal.separation(left) - self.mean_separation)
        )
        return displacement

    def energy_loss(self, shear: ArrayLike | str) -> Numbers:
        """Energy per nominal area that a cycle between -shear and shear dissipates [stress length]."""
        normal, friction = self._slipping()
        tau = self._checked("shear", shear)
        delta = self.displacement(shear)
        scale = friction * self.ratio
        released = normal.energy(self.mean_separation) - normal.energy(
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
        array = np.asarray(given, dtype=float)
        require(name, array, array >= 0, "at least 0")
        return array

    def _slipping(self) -> tuple[NormalOfContact | NormalOfLaw, float]:
        """The normal contact, and the coefficient of friction; an error where slip is not known."""
        if isinstance(self._normal, str):
            raise InputError(self._normal)
        if self.friction is None:
            raise InputError(
                "slip needs friction, the coefficient of friction: tangential(friction=...)"
            )
        return self._normal, self.friction


def ratio_of(
    nu: Any, E: Any, pair: Pair | None, direction: str | None, surface: Any, area: Any
) -> Any:
    """kappa for given Poisson's ratios and moduli, or for the named materials."""
    if nu is None and pair is None:
        raise InputError(
            "tangential stiffness needs nu, Poisson's ratio of the bodies, where no materials are named"
        )
    if nu is None:
        nu, E = zip(*((metal.nu, metal.E) for metal in pair.metals), strict=True)  # type: ignore[union-attr]
    lay: Any = getattr(surface, "anisotropy", None)
    if direction is None:
        if lay is not None and lay > ISOTROPIC:
            raise InputError(
                f"the surface has a lay (anisotropy {lay:.3g}): give direction, 'along' or 'across' it"
            )
        return tangential_ratio(nu, E)
    checked_direction(direction, surface)

    def share(poisson: FloatArray) -> Any:
        return stress_shares(
            lay, np.asarray(area)[(..., *[None] * poisson.ndim)], poisson
        )[DIRECTIONS.index(direction)]

    return tangential_ratio(nu, E, share)


class Interface:
    """Conductances and shear of a `Contact`."""

    def conductance(
        self: Any, k1: ArrayLike | str | None = None, k2: ArrayLike | str | None = None
    ) -> Numbers:
        """Conductance per nominal area of two bodies in contact, thermal or electrical, h = (k_s/E*) (-dF/du).

        It is proportional to the stiffness at constant contact area, as both solve the same
        potential problem (J. R. Barber, Proc. R. Soc. A 459 (2003)). The slope of the
        loading curve of yielded contacts is up to ten times smaller.

        Parameters
        ----------
        k1, k2 : array_like or str
            Conductivities of the bodies, k_s = 2 k1 k2/(k1 + k2); without k2 both have k1,
            and without both they are the thermal conductivities of the named `materials`.

        Returns
        -------
        ndarray or DataArray
            [unit of k/length of the surface]; in W/(m^2 K) for "45 W/(m K)", in S/m^2 for
            "6e6 S/m". Its scatter is `unloading_stiffness_scatter`.

        Examples
        --------
        >>> from mbma_tables import Surface, contact
        >>> face = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0, unit="um")
        >>> joint = contact(face, pressure="10 MPa", E_star="100 GPa", theory="calibrated", hardness="1.5 GPa")
        >>> f"{joint.conductance('45 W/(m K)', '167 W/(m K)'):.3g} W/(m^2 K)"
        '2.53e+04 W/(m^2 K)'
        """
        from mbma_tables.quantities.conductance import mean_conductivity

        source = self._source
        if k1 is None:
            if source.materials is None:
                raise InputError(
                    "conductance needs k1, the bodies' conductivity, where no materials are named"
                )
            k1, k2 = source.materials.conductivities
        (k1, k2), _ = source.units.conductivities(k1, k1 if k2 is None else k2)
        # linear in the stiffness, which may be NaN or a DataArray
        found: Numbers = (
            mean_conductivity(k1, k2) / source.E_star * self.unloading_stiffness
        )
        return found

    def gap_conductance(
        self: Any,
        gas: str = "air",
        temperature: ArrayLike = 300.0,
        gas_pressure: ArrayLike | str = "1 atm",
        accommodation: ArrayLike | None = None,
    ) -> Numbers:
        """Conductance per nominal area of the gas in the gaps, parallel to `conductance` of the solid [W/(m^2 K)].

        The law, data of gases and their accuracy are in `mbma_tables.quantities.gas`;
        without radiation.

        Parameters
        ----------
        gas : {"air", "helium", "nitrogen", "argon", "vacuum"}
        temperature : array_like
            Of the gas [K], from 200 to 600.
        gas_pressure : array_like or str
            [Pa], or with its unit.
        accommodation : array_like, optional
            Thermal accommodation coefficient of the faces; default: that of machined metals.

        Examples
        --------
        >>> from mbma_tables import Surface, contact
        >>> face = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0, unit="um")
        >>> joint = contact(face, pressure="1 MPa", theory="calibrated", materials="steel 1020")
        >>> f"{joint.conductance():.0f} W/(m^2 K) and {joint.gap_conductance('air'):.0f}"
        '3345 W/(m^2 K) and 9921'
        """
        from mbma_tables.quantities.gas import VACUUM, jump_of, mean_inverse

        source = self._source
        if source.units.length is None:
            raise InputError(
                "gap_conductance beside lengths whose unit is not known: give the surface its unit"
            )
        if gas == VACUUM:
            return 0.0 * self.mean_separation  # type: ignore[no-any-return]
        metre = factor("m", source.units.length)
        pressure = Units(stress="Pa").number("gas_pressure", gas_pressure)
        k, jump = jump_of(gas, temperature, pressure, accommodation)

        def mean(
            theory: Any,
            surface: AnySurface,
            u: FloatArray,
            E: FloatArray,
            area: FloatArray,
        ) -> tuple[Any, ...]:
            eta = getattr(theory, "hardness", np.inf) / np.asarray(surface.rms_gradient)
            return (k * metre * mean_inverse(u, area, jump * metre, surface.h_rms, eta),)

        found: Numbers = source.map(mean, self, 1, {"area": self.area})[0]
        return found

    def tangential(
        self: Any,
        friction: float | None = None,
        nu: Any = None,
        E: Any = None,
        direction: str | None = None,
    ) -> Tangential:
        """Tangential stiffness of full stick, partial and gross slip.

        Parameters
        ----------
        friction : float, optional
            Coefficient of friction, for slip. With a hardness only full stick is computed.
        nu, E : optional
            As for `materials.tangential_ratio`; by default those of the `materials` named.
        direction : {"along", "across"}, optional
            Of the shear relative to the lay, for surfaces whose anisotropy is known and
            above 1.4: full stick alone.

        Examples
        --------
        >>> from mbma_tables import Surface, contact
        >>> face = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0, unit="um")
        >>> joint = contact(face, pressure="10 MPa", E_star="100 GPa", theory="calibrated")
        >>> sheared = joint.tangential(friction=0.2, nu=0.3)
        >>> f"{sheared.stiffness:.3g} GPa/um, {sheared.shear('0.05 um'):.3g} GPa; slip from {sheared.gross_slip:.2g} um"
        '0.0242 GPa/um, 0.000954 GPa; slip from 0.23 um'
        """
        source = self._source
        ratio = ratio_of(nu, E, source.materials, direction, source.surface, self.area)
        normal: NormalOfContact | str = NormalOfContact(source, self)
        if source.yields:
            normal = OF_YIELDING
        elif direction:
            normal = OF_LAY
        return Tangential(
            ratio,
            friction,
            self.pressure,
            self.mean_separation,
            stiffness=self.unloading_stiffness / ratio,
            last=source.surface.h_max if source.theory.ends_at_h_max else np.inf,
            units=source.units,
            _normal=normal,
        )
