"""Two bodies in contact: their modulus, hardness, Poisson's ratios and conductivities, as people type them."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.bodies import materials
from mbma_tables.bodies.adhesion import AdhesionInUnits, adhesion_of
from mbma_tables.bodies.materials import Metal, Pair
from mbma_tables.common.arguments import (
    FloatArray,
    Numbers,
    broadcast_shape,
    checked_hardness,
    detached,
    finite_array,
    is_labelled,
    one_number,
    positive_array,
    require,
    require_fields,
)
from mbma_tables.common.distributions import distributions_in
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import (
    Units,
    has_text,
    modulus_and_units,
    number_with_unit,
    stated_unit,
)
from mbma_tables.surfaces.any_surface import apply

# "45 W/(m K)" gives a conductance in W/(m^2 K), "6e7 S/m" one in S/m^2
Conductivity = ArrayLike | str | Sequence[ArrayLike | str]
# types whose values cannot change after they were given
UNCHANGING = (float, int, str, type(None))
# largest ln of a modulus over that of Young's moduli given besides, both rounded by hand
ROUNDED = 0.01


@dataclasses.dataclass(frozen=True, eq=False)
class Bodies:
    """Constants of two bodies in contact.

    Wherever the library takes bodies, it also takes what `Bodies.of` accepts: a number or
    "100 GPa" as the modulus, and a metal or a pair of metals by name.

    Parameters
    ----------
    E_star : array_like or str, optional
        Effective modulus, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2; stresses are in its unit.
        Default: that of `metals`, or of `E` and `nu`, or 1, which makes stresses relative
        to E*.
    hardness : array_like or str, optional
        Largest pressure that the softer body supports, in the unit of `E_star`, or a text
        that `mbma_tables.bodies.materials.hardness` accepts: "1.5 GPa", "200 HV". Default: that of
        the softer of `metals`.
    largest_pressure : array_like or str, optional
        The largest nominal pressure under which the bodies were pressed together so far, in
        the unit of `E_star`. Contacts with a hardness then unload and reload below it, on
        what yielded; heavier ones are those of first loading. Without a hardness it changes
        nothing. Default: every contact is reached by first loading.
    nu : float or pair of float, optional
        Poisson's ratio, one of both bodies, or one of each together with `E`; for
        tangential stiffness.
    E : pair of float or str, optional
        Young's moduli of the bodies, for `E_star` and for the tangential stiffness of
        bodies with different `nu`; plain numbers in the unit of `E_star`.
    conductivity : array_like or str, or pair of them, optional
        Of both bodies or of each, thermal "45 W/(m K)" or electrical "6e7 S/m"; for conductance.
    adhesion : Adhesion, optional
        Attraction between the bodies, `Adhesion(work="50 mJ/m^2", range="0.3 nm")`, or a
        mapping of its arguments; of elastic bodies alone, not beside a hardness.
    metals : str, Metal, or pair of them, optional
        In place of `E_star`; names are those of `mbma_tables.bodies.materials.METALS`. Other
        constants that are not given are theirs.

    Raises
    ------
    InputError, OutOfRangeError
        For constants that contradict each other: `metals` beside another `E_star` or
        beside `E`, and an `E_star` that differs by more than 1% from that of `E` and `nu`.

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
    largest_pressure: Any = None
    nu: Any = None
    E: Any = None
    conductivity: Any = None
    metals: Any = None
    adhesion: Any = None

    def __post_init__(self) -> None:
        if self.adhesion is not None:
            object.__setattr__(self, "adhesion", adhesion_of(self.adhesion))
        for name, value in vars(self).items():
            if type(value) not in UNCHANGING:
                object.__setattr__(self, name, detached(value))
        given = self.E is not None or self.nu is not None
        if given and any(distributions_in((self.E, self.nu))):
            return  # what follows from them is that of drawn numbers
        if self.metals is not None:
            self._take_metals()
        elif self.E is not None:
            self._take_moduli()
        elif self.E_star is None:
            object.__setattr__(self, "E_star", 1.0)
        if self.nu is not None:
            # refuses what tangential stiffness would refuse later
            materials.tangential_ratio(self.nu, self.E)

    def _take_metals(self) -> None:
        """The constants of the metals, as far as none are given."""
        pair = materials.pair(self.metals)
        E = tuple(metal.E for metal in pair.metals)
        # bodies that were made from metals already may be replaced in part
        if self.E_star is not None and not np.array_equal(self.E_star, pair.E_star):
            raise InputError("E_star and metals are both given: give one of them")
        if self.E is not None and not np.array_equal(self.E, E):
            raise InputError("E and metals are both given: give one of them")
        of_metals = {
            "metals": pair,
            "E_star": pair.E_star,
            "hardness": pair.hardness,
            "conductivity": pair.conductivities,
        }
        if self.nu is None:
            of_metals |= {"nu": tuple(metal.nu for metal in pair.metals), "E": E}
        for name, value in of_metals.items():
            if name in ("metals", "E_star") or getattr(self, name) is None:
                object.__setattr__(self, name, value)

    def _take_moduli(self) -> None:
        """The effective modulus of Young's moduli, or a check that the one given is theirs."""
        if self.nu is None:
            raise InputError("E needs nu, Poisson's ratio of each body")
        if not (_is_pair(self.E) and _is_pair(self.nu)):
            raise InputError(
                "E and nu are two each, one of each body: E=('210 GPa', '70 GPa'), "
                f"nu=(0.3, 0.33), got E={self.E!r} and nu={self.nu!r}"
            )
        (E1, E2), (nu1, nu2) = self.E, self.nu
        E_star = materials.effective_modulus(E1, nu1, E2, nu2)
        if self.E_star is None:
            object.__setattr__(self, "E_star", E_star)
            return
        unit = stated_unit("E_star", self.E_star)
        unit_of_E = stated_unit("E_star", E_star)
        if unit is None and unit_of_E is not None:
            return  # the unit of the modulus is not known
        units = Units(stress=unit)
        ratio = np.asarray(units.number("E_star", self.E_star), dtype=float)
        ratio = ratio / units.number("E_star", E_star)
        if not (np.abs(np.log(ratio)) <= ROUNDED).all():
            raise InputError(
                f"E_star = {self.E_star!r} contradicts E and nu, whose modulus is "
                f"{E_star}: leave E_star out"
            )

    @classmethod
    def of(cls, given: Any) -> Bodies:
        """Bodies from what people type: a modulus, a metal or a pair of metals, or `Bodies` as they are.

        A mapping, as files have them, is that of the arguments of `Bodies`, or of one metal.
        """
        if isinstance(given, Bodies):
            return given
        if given is None:
            raise InputError(
                "bodies are missing: a modulus such as '100 GPa', metals by name, or Bodies"
            )
        # two moduli are those of two bodies, a metal has one
        if isinstance(given, Mapping) and (
            given.keys() & {"E_star", "metals"} or is_array(given.get("E"))
        ):
            require_fields(cls, given)
            return cls(**given)
        if names_metals(given):
            return cls(metals=given)
        return cls(given)

    def with_stress_unit(self, unit: str) -> Bodies:
        """The same bodies, with plain stresses as texts where they are one number.

        A plain modulus is in `unit`, a plain hardness in the unit of the modulus. Arrays stay
        as they are: `in_units` takes the unit for them.
        """
        E_star = self.E_star
        if not is_array(E_star):
            E_star = number_with_unit("E_star", E_star, unit)
        largest = self.largest_pressure
        if largest is not None and not is_array(largest):
            of_modulus = stated_unit("E_star", E_star) or unit
            largest = number_with_unit("largest_pressure", largest, of_modulus)
        hardness = self.hardness
        is_one = hardness is not None and not is_array(hardness)
        if is_one and not np.array_equal(hardness, np.inf):
            text = materials.hardness(hardness) if isinstance(hardness, str) else hardness
            of_modulus = stated_unit("E_star", E_star) or unit
            with_unit = number_with_unit("hardness", text, of_modulus)
            # what states its unit already stays as it was written, "200 HV"
            hardness = hardness if with_unit == text else with_unit
        return dataclasses.replace(
            self, E_star=E_star, hardness=hardness, largest_pressure=largest
        )

    def in_units(self, surface: Any, stress_unit: str | None = None) -> BodiesInUnits:
        """The constants as numbers, in the surface's unit of length and the modulus's, or another, of stress."""
        E_star, units = modulus_and_units(self.E_star, surface, stress_unit)
        if isinstance(E_star, float) or not is_labelled(E_star):
            E_star = positive_array("E_star", E_star)[()]
        hardness: Any = np.inf
        if self.hardness is not None:
            hardness = materials.hardness_in(units, self.hardness)
            if isinstance(hardness, float) or not is_labelled(hardness):
                hardness = checked_hardness(hardness)[()]
        largest = self.largest_pressure
        if largest is not None:
            largest = units.number("largest_pressure", largest)
            if isinstance(largest, float) or not is_labelled(largest):
                largest = checked_largest(largest)[()]
        if self.adhesion is None:
            return BodiesInUnits(self, E_star, hardness, units, largest)
        adhesion = AdhesionInUnits.of(self.adhesion, units)
        in_units = BodiesInUnits(
            self, E_star, hardness, units, largest, adhesion=adhesion
        )
        if adhesion is not None and in_units.yields:
            raise InputError(
                "adhesion and hardness were not simulated together: give hardness=inf for "
                "bodies that stay elastic, or no adhesion"
            )
        return in_units


def after(bodies: Bodies, largest_pressure: Any) -> Bodies:
    """The same bodies after a largest pressure, which they may not have already."""
    if bodies.largest_pressure is not None:
        raise InputError("largest_pressure is given twice, of bodies and beside them")
    return dataclasses.replace(bodies, largest_pressure=largest_pressure)


def checked_largest(pressure: Any) -> FloatArray:
    """Largest pressures as numbers of at least 0, where there was none."""
    array = finite_array("largest_pressure", pressure)
    require("largest_pressure", array, array >= 0, "at least 0")
    return array


def is_array(value: Any) -> bool:
    """Whether a constant is an array of any kind or a list, not one number or text."""
    return isinstance(value, list | tuple) or getattr(value, "ndim", 0) > 0


def _is_pair(value: Any) -> bool:
    """Whether a constant is two numbers or texts, one of each body."""
    if not is_array(value) or len(value) != 2:
        return False
    return not any(map(is_array, value))


def names_metals(given: Any) -> bool:
    """Whether bodies are given as metals, by name or as objects."""
    if isinstance(given, Metal | Pair | Mapping):
        return True
    if isinstance(given, str):
        # names such as "1.4301" and "6061-T6" begin with digits
        return given.strip()[:1].isalpha() or materials.is_name(given)
    return isinstance(given, tuple | list) and any(names_metals(each) for each in given)


@dataclasses.dataclass(frozen=True, eq=False)
class BodiesInUnits:
    """Bodies beside a surface: their constants as numbers, in the units of the contact."""

    bodies: Bodies
    E_star: Any
    hardness: Any  # infinite where nothing yields
    units: Units
    #: largest nominal pressure so far; None where contacts are those of first loading
    largest: Any = None
    #: mean conductivity in place of that of `bodies`, as `conductivity` has it
    k_s: Any = None
    #: None where the bodies do not attract each other
    adhesion: AdhesionInUnits | None = None

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
        return has_text(conductivity)

    @property
    def hardness_is_given(self) -> bool:
        """Whether there is a hardness, infinite or not."""
        return self.bodies.hardness is not None

    @functools.cached_property
    def yields(self) -> bool:
        """Whether there is a hardness that is not infinite."""
        if self.bodies.hardness is None:
            return False
        if not isinstance(self.hardness, float | np.ndarray):
            return True  # of DataArrays, which may be lazy, it is not looked at
        return bool(np.any(self.hardness != np.inf))

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
        if self.k_s is not None:
            return self.k_s, unit
        return mean_conductivity(*numbers), unit

    @property
    def conductivity_if_known(self) -> Any:
        """k_s as `conductivity` has it; None where it or the unit of length is not known."""
        if self.conductivity_is_given and (
            self.units.length is not None or not self.conductivity_has_unit
        ):
            return self.conductivity[0]
        return None

    def require_one_conductivity(self) -> None:
        """Reject arrays of conductivities, where each constant is one number."""
        conductivity = self.conductivity_if_known
        if conductivity is not None:
            one_number("conductivity", conductivity)

    @property
    def numbers(self) -> dict[str, Any]:
        """What a contact depends on, in the order of `at`."""
        numbers = {"E_star": self.E_star, "hardness": self.hardness}
        if self.largest is not None:
            numbers["largest_pressure"] = self.largest
        if self.adhesion is not None:
            numbers |= {"work": self.adhesion.work, "range": self.adhesion.range}
        return numbers

    def at(self, *numbers: Any) -> BodiesInUnits:
        """The same bodies with other numbers, such as those of a block of an array."""
        given = dict(zip(self.numbers, numbers, strict=True))
        adhesion = self.adhesion
        if adhesion is not None:
            adhesion = dataclasses.replace(
                adhesion, work=given["work"], range=given["range"]
            )
        return dataclasses.replace(
            self,
            E_star=given["E_star"],
            hardness=given["hardness"],
            largest=given.get("largest_pressure"),
            adhesion=adhesion,
        )

    def checked(self) -> BodiesInUnits:
        """The same bodies, of arrays whose numbers were checked."""
        adhesion = self.adhesion
        return dataclasses.replace(
            self,
            E_star=positive_array("E_star", self.E_star),
            hardness=checked_hardness(self.hardness),
            largest=None if self.largest is None else checked_largest(self.largest),
            adhesion=None if adhesion is None else adhesion.checked(),
        )


def mean_conductivity(k1: ArrayLike, k2: ArrayLike) -> Numbers:
    """k_s = 2 k1 k2/(k1 + k2) of two bodies, positive conductivities in one unit."""
    if is_labelled(k1) or is_labelled(k2):
        labelled: Numbers = apply(
            lambda *both: (mean_conductivity(*both),), (k1, k2), outputs=1
        )[0]
        return labelled
    first = positive_array("k1", k1)
    second = positive_array("k2", k2)
    broadcast_shape(k1=first, k2=second)
    smaller = np.minimum(first, second)
    larger = np.maximum(first, second)
    # the smaller over the larger cannot overflow
    return (2 * (smaller / (1 + smaller / larger)))[()]
