"""Two bodies in contact: their modulus, hardness, Poisson's ratios and conductivities, as people type them."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables import materials
from mbma_tables.common.arguments import Numbers, broadcast_shape, positive_array
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import Units, modulus_and_units
from mbma_tables.materials import Metal, Pair

# "45 W/(m K)" gives a conductance in W/(m^2 K), "6e7 S/m" one in S/m^2
Conductivity = ArrayLike | str | Sequence[ArrayLike | str]


@dataclasses.dataclass(frozen=True, eq=False)
class Bodies:
    """Constants of two bodies in contact.

    Wherever the library takes bodies, it also takes what `Bodies.of` accepts: a number or
    "100 GPa" as the modulus, and a metal or a pair of metals by name.

    Parameters
    ----------
    E_star : array_like or str, optional
        Effective modulus, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2; stresses are in its unit.
        Default: that of `metals`, or 1, which makes stresses relative to E*.
    hardness : array_like or str, optional
        Largest pressure that the softer body supports, in the unit of `E_star`, or a text
        that `mbma_tables.materials.hardness` accepts: "1.5 GPa", "200 HV". Default: that of
        the softer of `metals`.
    nu : float or pair of float, optional
        Poisson's ratio, one of both bodies, or one of each together with `E`; for
        tangential stiffness.
    E : pair of float or str, optional
        Young's moduli of the bodies, for the tangential stiffness of bodies with different `nu`.
    conductivity : array_like or str, or pair of them, optional
        Of both bodies or of each, thermal "45 W/(m K)" or electrical "6e7 S/m"; for conductance.
    metals : str, Metal, or pair of them, optional
        In place of `E_star`; names are those of `mbma_tables.materials.METALS`. Other
        constants that are not given are theirs.

    Examples
    --------
    >>> from mbma_tables import Bodies
    >>> Bodies("100 GPa", hardness="1.5 GPa", conductivity="45 W/(m K)").hardness
    '1.5 GPa'
    >>> Bodies.of(("steel 4140 hard", "aluminium 6061 hard")).hardness
    '0.95 GPa'
    """

    E_star: Any = None
    _: dataclasses.KW_ONLY
    hardness: Any = None
    nu: Any = None
    E: Any = None
    conductivity: Any = None
    metals: Any = None

    def __post_init__(self) -> None:
        if self.metals is None:
            object.__setattr__(
                self, "E_star", 1.0 if self.E_star is None else self.E_star
            )
            return
        pair = materials.pair(self.metals)
        # bodies that were made from metals already may be replaced in part
        if self.E_star not in (None, pair.E_star):
            raise InputError("E_star and metals are both given: give one of them")
        of_metals = {
            "metals": pair,
            "E_star": pair.E_star,
            "hardness": pair.hardness,
            "conductivity": pair.conductivities,
        }
        if self.nu is None:
            of_metals |= {
                "nu": tuple(metal.nu for metal in pair.metals),
                "E": tuple(metal.E for metal in pair.metals),
            }
        for name, value in of_metals.items():
            if name in ("metals", "E_star") or getattr(self, name) is None:
                object.__setattr__(self, name, value)

    @classmethod
    def of(cls, given: Any) -> Bodies:
        """Bodies from what people type: a modulus, a metal or a pair of metals, or `Bodies` as they are.

        A mapping, as files have them, is that of the arguments of `Bodies`, or of one metal.
        """
        if isinstance(given, Bodies):
            return given
        if isinstance(given, Mapping) and given.keys() & {"E_star", "metals"}:
            return cls(**given)
        if names_metals(given):
            return cls(metals=given)
        return cls(given)

    def in_units(self, surface: Any, stress_unit: str | None = None) -> BodiesInUnits:
        """The constants as numbers, in the surface's unit of length and the modulus's, or another, of stress."""
        E_star, units = modulus_and_units(self.E_star, surface, stress_unit)
        hardness = np.inf
        if self.hardness is not None:
            hardness = materials.hardness_in(units, self.hardness)
        return BodiesInUnits(self, E_star, hardness, units)


def names_metals(given: Any) -> bool:
    """Whether bodies are given as metals, by name or as objects."""
    if isinstance(given, Metal | Pair | Mapping):
        return True
    if isinstance(given, str):
        return given.strip()[:1].isalpha()
    return isinstance(given, tuple | list) and any(names_metals(each) for each in given)


@dataclasses.dataclass(frozen=True, eq=False)
class BodiesInUnits:
    """Bodies beside a surface: their constants as numbers, in the units of the contact."""

    bodies: Bodies
    E_star: Any
    hardness: Any  # infinite where nothing yields
    units: Units

    @property
    def pair(self) -> Pair | None:
        """The metals, if they are named."""
        metals: Pair | None = self.bodies.metals
        return metals

    @property
    def conductivity_is_given(self) -> bool:
        """Whether the conductivity of the bodies is."""
        return self.bodies.conductivity is not None

    @property
    def conductivity_has_unit(self) -> bool:
        """Whether conductivities are texts with their unit."""
        conductivity = self.bodies.conductivity
        each = conductivity if isinstance(conductivity, tuple | list) else [conductivity]
        return any(isinstance(value, str) for value in each)

    @property
    def hardness_is_given(self) -> bool:
        """Whether there is a hardness, infinite or not."""
        return self.bodies.hardness is not None

    @functools.cached_property
    def yields(self) -> bool:
        """Whether there is a hardness that is not infinite; what is no number is refused where it is checked."""
        if self.bodies.hardness is None:
            return False
        if not isinstance(self.hardness, float | np.ndarray):
            return True
        values = np.asarray(self.hardness)
        if values.dtype.kind != "f" or not values.size:
            return True
        return bool((values != np.inf).any())

    @functools.cached_property
    def conductivity(self) -> tuple[Any, str]:
        """k_s = 2 k1 k2/(k1 + k2) over the unit of length, and the unit that a conductance has with it."""
        given = self.bodies.conductivity
        if given is None:
            raise InputError(
                "conductance needs the bodies' conductivity, which is missing: "
                "Bodies(..., conductivity='45 W/(m K)'), or one for each body"
            )
        each = given if isinstance(given, tuple | list) else (given, given)
        if len(each) != 2:
            raise InputError(
                f"conductivity is of both bodies or of each: one or two, got {len(each)}"
            )
        numbers, unit = self.units.conductivities(*each)
        return mean_conductivity(*numbers), unit

    def at(self, E_star: Any, hardness: Any) -> BodiesInUnits:
        """The same bodies with other numbers, such as those of a block of an array."""
        return dataclasses.replace(self, E_star=E_star, hardness=hardness)


def mean_conductivity(k1: ArrayLike, k2: ArrayLike) -> Numbers:
    """k_s = 2 k1 k2/(k1 + k2) of two bodies, positive conductivities in one unit."""
    first = positive_array("k1", k1)
    second = positive_array("k2", k2)
    broadcast_shape(k1=first, k2=second)
    smaller = np.minimum(first, second)
    larger = np.maximum(first, second)
    # the smaller over the larger cannot overflow
    return (2 * (smaller / (1 + smaller / larger)))[()]
