"""Units of length and stress: parsing and conversion of texts, units of results.

The same rule applies everywhere. Plain numbers are in the known unit, the surface's or the
modulus's; texts with a unit are converted to it. A requested unit converts values that have
another one, and is that of plain numbers if none is known yet. An error is raised for
values that cannot be converted.
"""

import dataclasses
import difflib
import functools
import math
import re
import reprlib
from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Any

from mbma_tables.common.arguments import one_number, positive_array
from mbma_tables.common.errors import InputError

_POUND_PER_INCH = Fraction("4.4482216152605") / Fraction("0.0254") ** 2
_LENGTHS = (
    "m=1 km=1e3 cm=1e-2 mm=1e-3 um=1e-6 nm=1e-9 angstrom=1e-10 pm=1e-12 ft=0.3048 "
    "in=0.0254 mil=254e-7 uin=254e-10"
)
_STRESSES = "Pa=1 kPa=1e3 MPa=1e6 GPa=1e9 TPa=1e12 mbar=1e2 bar=1e5 atm=101325"


def _sizes(text: str) -> dict[str, Fraction]:
    """Sizes of units in that of the SI, from a text such as "m=1 km=1e3"."""
    sizes = {}
    for pair in text.split():
        unit, size = pair.split("=")
        sizes[unit] = Fraction(size)
    return sizes


SIZES: dict[str, dict[str, Fraction]] = {
    "length": _sizes(_LENGTHS),
    "stress": _sizes(_STRESSES),
}
SIZES["stress"] |= {
    "psi": _POUND_PER_INCH,
    "ksi": 1000 * _POUND_PER_INCH,
    "Msi": 10**6 * _POUND_PER_INCH,
}
SIZES["force"] = _sizes("N=1 mN=1e-3 kN=1e3 MN=1e6 lbf=4.4482216152605")
ALIASES = {
    "micron": "um",
    "Å": "angstrom",
    "inch": "in",
    "N/mm^2": "MPa",
    "N/mm2": "MPa",
    "N/m^2": "Pa",
    "N/m2": "Pa",
}
# powers of length and of stress of arguments, and of numbers of surfaces and islands; those
# of the quantities of a contact are declared in `mbma_tables.contacts.quantities`
_NAMES_OF_POWERS = {
    (1, 0): (
        "h_rms h_max Ra Rq Rsm Sa Sq Sp longest shortest rolloff separation "
        "mean_separation delta R_d R_u sigma h_d overclosure separations "
        "mean_separations deltas dx dy short_cutoff long_cutoff s_filter l_filter "
        "extrapolate_to width length displacement radius approach reference gap range"
    ),
    (0, 1): (
        "viscosity pressure_drop E_star E E1 E2 hardness pressure pressures shear "
        "gas_pressure inlet outlet largest_pressure"
    ),
    (-1, 0): "q0 q1",
    (-2, 0): "D m4",
    (2, 0): "m0 nominal_area island_area",
    (2, 1): "island_force",
    (-3, 0): "island_density",
    (0, 0): (
        "hurst zeta_1 m2 alpha Rdq Sdq rms_gradient heights lengths extrapolate_hurst "
        "zeta_d zeta_u eta X mu"
    ),
}
DIMENSIONS: dict[str, tuple[int, int]] = {}
for _powers, _names in _NAMES_OF_POWERS.items():
    DIMENSIONS |= dict.fromkeys(_names.split(), _powers)
# of conductivities, and the unit of conductance, over a length in metres
CONDUCTIVITIES = {"W": "W/(m^2 K)", "S": "S/m^2"}
PREFIXES = {"u": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6}
# "mW/(mm K)", "W/m/K" and "MS/m" without spaces, brackets and asterisks
_CONDUCTIVITY = re.compile(r"([umkM]?)(?:(W)/([a-z]+)/?K|(S)/([a-z]+))")
_ASCII = str.maketrans(
    {"\N{MICRO SIGN}": "u", "\N{GREEK SMALL LETTER MU}": "u", "²": "2"}
)
#: what ranges and means with a deviation have between their numbers
RANGE = re.compile(r"\.\.|\+-|\+/-|\N{PLUS-MINUS SIGN}")
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(.*)", re.DOTALL)


def known(unit: Any, kind: str = "length") -> str:
    """A unit's name as this package writes it; an error suggests the nearest name."""
    if not isinstance(unit, str):
        raise InputError(
            f"a unit of {kind} is a text such as {next(iter(SIZES[kind]))!r}, got {unit!r}"
        )
    plain = ALIASES.get(unit.strip(), unit.strip().translate(_ASCII))
    plain = ALIASES.get(plain, plain)
    if kind == "length" and plain in SIZES["stress"]:
        raise InputError(
            f"{unit!r} is no known unit of length but one of stress, as pressure= takes"
        )
    if plain not in SIZES[kind]:
        near = difflib.get_close_matches(plain, SIZES[kind], 3, 0.6) or SIZES[kind]
        raise InputError(
            f"{unit!r} is no known unit of {kind}: write {' or '.join(near)}"
        )
    return plain


@functools.lru_cache(1024)
def factor(have: str, want: str, kind: str = "length", power: int = 1) -> float:
    """Factor from one unit to another, rounded once."""
    return float(
        (SIZES[kind][known(have, kind)] / SIZES[kind][known(want, kind)]) ** power
    )


@functools.lru_cache(1024)
def read(name: str, text: str) -> tuple[float, str | None]:
    """A number and the unit of length or stress that a text gives it, None where it gives none."""
    match = _NUMBER.fullmatch(text)
    if RANGE.search(text):
        raise InputError(
            f"{name} = {text[:60]!r} is a range, and one number is needed here: Joint and "
            "uncertainty take ranges"
        )
    if match is None:
        raise InputError(
            f"{name} must be a number, or one with its unit, got {text[:60]!r}"
        )
    number = float(match[1])
    rest = match[2].strip()
    if math.isinf(number):
        raise InputError(
            f"{name} = {text[:60]!r} is above the largest number of 64 bits, 1.8e308"
        )
    if not rest:
        return number, None
    return number, _base_unit(name, rest, text)


def _base_unit(name: str, unit: str, text: str) -> str:
    """The unit of length or stress in that of a named quantity: "mm" of "mm^2", "1/mm^2" or "mm-2"."""
    length, stress = DIMENSIONS.get(name, (0, 0))
    if not (length or stress):
        raise InputError(f"{name} has no unit: leave {unit!r} out")
    kind, power = ("length", length) if length else ("stress", stress)
    base = unit.translate(_ASCII).replace("**", "^")
    if power == 1:
        return known(base, kind)
    # 1/mm^2, /mm2, mm^-2 and mm-2 for power -2
    whole = re.fullmatch(r"(1? ?/ ?)?(.*?)\^?(-?\d+)?", base)
    if whole is not None and int(whole[3] or 1) * (-1 if whole[1] else 1) == power:
        return known(whole[2], kind)
    sample = unit_of(
        name, Units(next(iter(SIZES["length"])), next(iter(SIZES["stress"])))
    )
    raise InputError(f"{name} = {text!r}: the unit must be like {sample}")


def _base_of_attribute(name: str, value: Any) -> str | None:
    """The unit of length or stress in the attribute `units` of a DataArray, None where it states none."""
    stated = getattr(value, "attrs", {}).get("units")
    if not isinstance(stated, str) or not any(DIMENSIONS.get(name, ())):
        return None
    # "length^2" is that of results whose unit is not known
    if stated.strip() in ("", "1", unit_of(name, UNKNOWN)):
        return None
    return _base_unit(name, stated.strip(), stated)


@dataclasses.dataclass(frozen=True)
class Units:
    """The units that numbers are in; None where not known, and stress "1" where it is over E*."""

    length: str | None = None
    stress: str | None = None

    def __post_init__(self) -> None:
        for kind in ("length", "stress"):
            unit = getattr(self, kind)
            if (
                unit is None
                or (kind == "stress" and unit == "1")
                or (isinstance(unit, str) and unit in SIZES[kind])
            ):
                continue
            object.__setattr__(self, kind, known(unit, kind))

    def number(self, name: str, value: Any) -> Any:
        """`value` in these units: numbers as they are, "0.8 um" converted, lists by entry."""
        if isinstance(value, list | tuple):
            flat = list(_entries(value))
            bare = [
                entry
                for entry in flat
                if not isinstance(entry, str) or read(name, entry)[1] is None
            ]
            if 0 < len(bare) < len(flat):
                raise InputError(
                    f"{name}: {bare[0]!r} has no unit beside others that have: write it to each"
                )
            return [self.number(name, entry) for entry in value]
        length, power = DIMENSIONS.get(name, (0, 0))
        kind, target_unit = ("length", self.length) if length else ("stress", self.stress)
        if not isinstance(value, str):
            if target_unit in SIZES[kind]:
                base = _base_of_attribute(name, value)
                if base not in (None, target_unit):
                    raise InputError(
                        f"{name} is in {value.attrs['units']!r} by its attribute units, and "
                        f"asked for in {unit_of(name, self)!r}: convert it"
                    )
            return value
        number, unit = read(name, value)
        if unit is None:
            return number
        if target_unit == "1":
            raise InputError(
                f"{name} = {value!r} needs a modulus, which is missing: stresses are "
                "over E* without one"
            )
        if target_unit is None:
            mend = (
                "give the surface its unit"
                if length
                else "give E* with its unit, such as '100 GPa'"
            )
            raise InputError(
                f"{name} = {value!r} beside numbers whose unit of {kind} is not known: {mend}"
            )
        converted = number * factor(unit, target_unit, kind, length or power)
        if math.isinf(converted):
            raise InputError(
                f"{name} = {value!r} is above the largest number of 64 bits in {target_unit}"
            )
        return converted

    def conductivities(self, *conductivities: Any) -> tuple[list[Any], str]:
        """Conductivities and their unit over this unit of length, an SI unit for texts."""
        if not has_text(conductivities):
            return list(conductivities), f"conductivity/{unit_of('separation', self)}"
        if self.length is None:
            raise InputError(
                f"conductivity {conductivities[0]!r} beside lengths whose unit is not known: give "
                "the surface its unit"
            )
        kinds = set[str]()
        numbers = [
            _conductivities_in(value, factor("m", self.length), kinds)
            for value in conductivities
        ]
        if len(kinds) > 1:
            raise InputError(
                "conductivities are both thermal or both electrical, got "
                f"{' and '.join(map(repr, conductivities))}"
            )
        return numbers, CONDUCTIVITIES[kinds.pop()]


def _conductivities_in(value: Any, metre: float, kinds: set[str]) -> Any:
    """A conductivity over a unit of length, or a list of them; their kinds are added to `kinds`."""
    if isinstance(value, list | tuple):
        return [_conductivities_in(each, metre, kinds) for each in value]
    number, kind = _conductivity_per_metre(value)
    kinds.add(kind)
    return number * metre


def _conductivity_per_metre(value: Any) -> tuple[float, str]:
    """A conductivity in W/(m K) or S/m, and which of both by its first letter."""
    match = _NUMBER.fullmatch(value) if isinstance(value, str) else None
    unit = _CONDUCTIVITY.fullmatch(re.sub(r"[\s()*]", "", match[2])) if match else None
    if match is None or unit is None:
        raise InputError(
            "conductivities are numbers, or texts such as '45 W/(m K)', '45 mW/(mm K)' or "
            f"'6e7 S/m', got {value!r}"
        )
    prefix, watt, metre, siemens, other = unit.groups()
    number = float(match[1]) * PREFIXES[prefix]
    return number / factor(metre or other, "m"), watt or siemens


UNKNOWN = Units()


def in_one_unit(
    quantities: Mapping[str, Any], requested_unit: str | None = None, kind: str = "length"
) -> tuple[dict[str, Any], str | None]:
    """Numbers in one unit of length or stress, and that unit: as requested, else the first."""
    named = {name: _named(name, value, kind) for name, value in quantities.items()}
    unit = (
        known(requested_unit, kind)
        if requested_unit
        else next((u for u in named.values() if u is not None), None)
    )
    if (
        unit is not None
        and not requested_unit
        and any(isinstance(value, str) for value in quantities.values())
    ):
        plain = [
            n for n in quantities if any(DIMENSIONS.get(n, ())) and named.get(n) is None
        ]
        if plain:
            raise InputError(
                f"{', '.join(plain)} without a unit beside numbers in {unit}: write the "
                "unit to each"
            )
    units = Units(length=unit) if kind == "length" else Units(stress=unit)
    return {name: units.number(name, value) for name, value in quantities.items()}, unit


def has_text(value: Any) -> bool:
    """Whether a value is a text, or a list with one in it."""
    if isinstance(value, list | tuple):
        return any(map(has_text, value))
    return isinstance(value, str)


def _entries(value: Any) -> Iterator[Any]:
    """The entries of a list and of the lists in it."""
    for entry in value:
        yield from _entries(entry) if isinstance(entry, list | tuple) else (entry,)


def _named(name: str, value: Any, kind: str) -> str | None:
    """The unit named by a text, the first in a list, or the attribute of a DataArray."""
    if isinstance(value, list | tuple):
        for entry in value:
            if unit := _named(name, entry, kind):
                return unit
        return None
    if isinstance(value, str):
        return read(name, value)[1]
    length, _ = DIMENSIONS.get(name, (0, 0))
    return _base_of_attribute(name, value) if (kind == "length") == bool(length) else None


def stated_unit(name: str, value: Any) -> str | None:
    """The unit of stress that a value states, as a text, in a list, or as a DataArray; None of plain numbers."""
    return _named(name, value, "stress")


def number_with_unit(name: str, value: Any, unit: str | None) -> str:
    """A stress as a text with the unit that it states, or with another if it states none."""
    stated = stated_unit(name, value)
    if isinstance(value, str) and stated is not None:
        return value
    number = positive_array(name, Units(stress=stated).number(name, value))
    return f"{float(one_number(name, number))!r} {stated or unit}"


def require_surface(surface: Any) -> None:
    """Reject what is no surface, with a hint for the name of one."""
    if not hasattr(surface, "unit"):
        hint = "; a named one is Surface.named(...)" if isinstance(surface, str) else ""
        raise InputError(f"surface must be a Surface, got {reprlib.repr(surface)}{hint}")


def modulus_and_units(
    E_star: Any, surface: Any, requested_stress: str | None = None
) -> tuple[Any, Units]:
    """A modulus as a number, and the units of results.

    Length is in the surface's unit, stress in the one requested or named by "100 GPa".
    """
    require_surface(surface)
    stress = (
        known(requested_stress, "stress")
        if requested_stress
        else _named("E_star", E_star, "stress")
    )
    # without a modulus, stresses are over it
    absent = stress is None and isinstance(E_star, int | float) and E_star == 1.0
    units = Units(surface.unit, "1" if absent else stress)
    return units.number("E_star", E_star), units


@dataclasses.dataclass(frozen=True)
class Dimension:
    """Powers of length, stress, time, temperature and electric current; units follow from them."""

    length: int = 0
    stress: int = 0
    time: int = 0
    temperature: int = 0
    current: int = 0

    @property
    def is_mechanical(self) -> bool:
        """Whether it is of lengths and stresses alone."""
        return not (self.time or self.temperature or self.current)

    def unit(self, units: Units) -> str:
        """Its unit beside lengths and stresses in `units`; "1" for numbers without one.

        Units of heat and of currents are those of the SI, as conductivities are given in them.
        """
        return _unit_of(self, units)

    def mechanical_unit(self, length: str, stress: str) -> str:
        """Its unit by the names of those of length and stress, or of force where that stands for stress."""
        return _product({stress: self.stress, length: self.length})

    def _of_time(self) -> dict[str, int]:
        return {"s": self.time, "K": self.temperature, "A": self.current}


#: per area and degree, power being stress length^3/time
HEAT_CONDUCTANCE = Dimension(length=1, stress=1, time=-1, temperature=-1)
#: per area, from current^2 = power/resistance
ELECTRICAL_CONDUCTANCE = Dimension(length=-5, stress=-1, time=1, current=2)
NAMED = {HEAT_CONDUCTANCE: "W/(m^2 K)", ELECTRICAL_CONDUCTANCE: "S/m^2"}


@functools.lru_cache(maxsize=1024)
def _unit_of(dimension: Dimension, units: Units) -> str:
    if not dimension.is_mechanical:
        powers = {"m": dimension.length, "Pa": dimension.stress, **dimension._of_time()}
        return NAMED.get(dimension) or _product(powers)
    stress, length = units.stress or "stress", units.length or "length"
    return dimension.mechanical_unit(length, stress)


def _product(powers: Mapping[str, int]) -> str:
    """A unit such as "MPa/um" from the powers of its parts."""
    parts = {unit: power for unit, power in powers.items() if power and unit != "1"}
    above = [_power(unit, power) for unit, power in parts.items() if power > 0]
    below = [_power(unit, -power) for unit, power in parts.items() if power < 0]
    return (" ".join(above) or "1") + "".join(f"/{unit}" for unit in below)


def _power(unit: str, power: int) -> str:
    return unit if power == 1 else f"{unit}^{power}"


def unit_of(name: str, units: Units) -> str:
    """The unit of an argument or of a number of a surface, such as "1/um"; "1" for pure numbers.

    A name that is not in `DIMENSIONS` is a KeyError: that of a quantity is in its declaration,
    `mbma_tables.contacts.quantities.registry.unit_of`.
    """
    return Dimension(*DIMENSIONS[name]).unit(units)


def force_over_area(force: Any, area: Any, length: str | None) -> Any:
    """The pressure of a force on an area [length^2], as a text with its unit; a list for areas.

    Forces are texts such as "40 kN", or plain numbers in N.
    """
    number = force
    unit = "N"
    if isinstance(force, str):
        match = _NUMBER.fullmatch(force)
        if match is None:
            raise InputError(
                f"force must be a number, or one with its unit, got {force[:60]!r}"
            )
        number = float(match[1])
        unit = known(match[2], "force") if match[2].strip() else "N"
    newtons = float(positive_array("force", one_number("force", number))) * float(
        SIZES["force"][unit]
    )
    size = Units(length=length).number("nominal_area", area)
    if length is None:
        raise InputError(
            "force needs a nominal area whose unit is known: give the surface its unit"
        )
    pascals = newtons / (
        positive_array("nominal_area", size) * factor(length, "m", power=2)
    )
    return _pascals(pascals.tolist())


def _pascals(numbers: Any) -> Any:
    """A pressure as a text, or lists of them."""
    if isinstance(numbers, list):
        return [_pascals(each) for each in numbers]
    return f"{numbers:.15g} Pa"


def in_unit(surface: Any, unit: str | None) -> Any:
    """A surface in the requested unit: converted, or given that unit if it has none."""
    if unit is None:
        return surface
    return (
        dataclasses.replace(surface, unit=unit)
        if surface.unit is None
        else surface.to(unit)
    )
