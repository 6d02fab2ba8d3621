"""Elastic constants, hardness and conductivity of metals.

The constants of two bodies are joined into the one modulus that contact needs.

Hardnesses are converted from Brinell, Vickers or Rockwell numbers to the mean pressure over
the projected area, which is the pressure that counts here. A ground or polished face is
harder than its bulk at depths of micrometres: measure it if it matters. The sources of the
numbers are in tables/metals.csv.
"""

from __future__ import annotations

import dataclasses
import difflib
import functools
import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import (
    FloatArray,
    answered,
    broadcast_shape,
    finite_array,
    number_in,
    one_number,
    positive_array,
    require,
)
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import records, shipped_file
from mbma_tables.common.units import Units, factor, in_one_unit, read
from mbma_tables.core import core

# plasticity index E* g/p_m up to which elastic areas are within 5% of those with a hardness
ELASTIC_PSI = 1.1
# largest ratio of tempers' hardnesses for which their geometric mean is used, within 14% of
# both
ONE_TEMPER = 1.3
TEMPERS = ("soft", "hard")
# Vickers number of non-austenitic steels at Rockwell C numbers: ASTM E140 table 1, as printed at
# mikipulley.co.jp/EN/Services/Tech_data/tech20.html
HRC = (20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0, 55.0, 60.0, 65.0, 68.0)
HV_OF_HRC = (238.0, 266.0, 302.0, 345.0, 392.0, 446.0, 513.0, 595.0, 697.0, 832.0, 940.0)
# Vickers number of unalloyed and low-alloy steels at Rockwell B numbers: ISO 18265 table
# A.1, DIN 50150 before, from where on other prints and ASTM E140 agree within 6%
HRB = (71.2, 75.0, 78.7, 81.7, 85.0, 87.1, 89.5, 91.5, 93.5, 95.0, 96.7, 98.1, 99.5)
HV_OF_HRB = (
    130.0,
    140.0,
    150.0,
    160.0,
    170.0,
    180.0,
    190.0,
    200.0,
    210.0,
    220.0,
    230.0,
    240.0,
    250.0,
)
ROCKWELL = {"HRC": (HRC, HV_OF_HRC), "HRB": (HRB, HV_OF_HRB)}
BRINELL_LOAD = (
    30.0  # kgf per D^2 [mm^2] of Brinell numbers without one: steels, ISO 6506-1
)
BRINELL_DIAMETERS = (0.24, 0.6)  # of indentations over that of the ball, ISO 6506-1
# number, scale, and of Brinell numbers the ball's diameter [mm] and force [kgf]; other
# loads do not matter
_SCALE = re.compile(
    r"\s*([0-9]+\.?[0-9]*(?:[eE][-+]?[0-9]+)?)\s*(HV|HRC|HRB|HBW?)\s*"
    r"(?:([0-9]+\.?[0-9]*)/([0-9]+\.?[0-9]*))?[0-9./]*\s*"
)
# mean pressure of an indentation over the yield stress of a metal that does not harden
# (Tabor 1951); 2.8 in others' books
OVER_YIELD = 3.0
_YIELD = re.compile(r"\s*(?:([0-9.]+)\s*(?:x|\*)\s*)?yield\s+(\S.*?)\s*", re.IGNORECASE)
# ranges of metals' constants: numbers outside are in another unit
MODULI = (0.01, 2000.0)
HARDNESSES = (1e-4, 150.0)
CONDUCTIVITIES = (0.01, 5000.0)


def _poisson(name: str, value: ArrayLike) -> FloatArray:
    """Poisson's ratios."""
    ratio = finite_array(name, value)
    require(name, ratio, (ratio > -1) & (ratio <= 0.5), "in (-1, 0.5]")
    return ratio


def effective_modulus(
    E1: ArrayLike | str, nu1: ArrayLike, E2: ArrayLike | str, nu2: ArrayLike
) -> Any:
    """Effective modulus of two elastic bodies, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2.

    Parameters
    ----------
    E1, E2 : array_like or str
        Young's moduli, positive, in one unit of stress; or texts with theirs, "210 GPa".
    nu1, nu2 : array_like
        Poisson's ratios, in (-1, 0.5].

    Returns
    -------
    float, ndarray or str
        E*, in the unit of E1 and E2; the arguments broadcast. A text with that unit where
        texts were given, which `E_star=` takes as it is. Against a rigid body it is E1/(1 -
        nu1^2), the limit of large E2.

    Raises
    ------
    InputError, OutOfRangeError
        For NaN, infinite or empty input, shapes that do not broadcast, and numbers outside
        these ranges.

    Examples
    --------
    Steel on steel, in GPa:

    >>> from mbma_tables.bodies.materials import effective_modulus
    >>> round(float(effective_modulus(210.0, 0.3, 210.0, 0.3)), 2)
    115.38
    >>> effective_modulus("200 GPa", 0.0, "50 GPa", 0.0)
    '40.0 GPa'
    """
    plain, unit = in_one_unit({"E1": E1, "nu1": nu1, "E2": E2, "nu2": nu2}, kind="stress")
    moduli = [positive_array(name, plain[name]) for name in ("E1", "E2")]
    ratios = [_poisson(name, plain[name]) for name in ("nu1", "nu2")]
    broadcast_shape(E1=moduli[0], nu1=ratios[0], E2=moduli[1], nu2=ratios[1])
    a, b = ((1 - nu) * (1 + nu) / E for nu, E in zip(ratios, moduli, strict=True))
    modulus = (1 / (a + b))[()]
    return (
        modulus
        if unit is None or not isinstance(E1, str)
        else f"{one_number('E_star', modulus)} {unit}"
    )


@dataclasses.dataclass(frozen=True)
class Metal:
    """Ranges of a metal's constants at room temperature.

    Parameters
    ----------
    name : str
    E : float or str
        Young's modulus, 0.01 to 2000; plain numbers in GPa, or a text with its unit, "210 GPa".
    nu : float
        Poisson's ratio, in (-1, 0.5].
    hardness : float or str, or pair of these
        Mean pressure of an indentation, of soft and of hard tempers, or one for both: plain
        numbers in GPa, or texts as for `hardness`, "200 HV".
    conductivity : float or str, or pair of these
        Thermal, lowest and highest, or one for both: plain numbers in W/(m K), or texts,
        "45 W/(m K)".
    source : str, optional
        Titles and addresses of the pages on which the numbers were read.

    Raises
    ------
    InputError, OutOfRangeError
        For constants that no metal has, such as a modulus in MPa; the message has the
        allowed range.

    Examples
    --------
    >>> from mbma_tables.bodies.materials import Metal
    >>> steel = Metal("own steel", "210 GPa", 0.3, hardness="200 HV", conductivity="45 W/(m K)")
    >>> steel.E, steel.hardness, steel.conductivity
    (210.0, (2.11536, 2.11536), (45.0, 45.0))
    """

    name: str
    E: Any
    nu: Any
    hardness: Any
    conductivity: Any
    source: str = ""

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name:
            raise InputError(f"the name of a metal is a text, got {self.name!r}")
        whose = f" of {self.name!r}"
        modulus = one_number("E" + whose, Units(stress="GPa").number("E", self.E))
        require(
            f"E{whose} [GPa]", np.asarray(modulus), (modulus >= MODULI[0]) & (modulus <= MODULI[1]),
            f"from {MODULI[0]:g} to {MODULI[1]:g} GPa, as a number in GPa or as a text "
            "such as '210 GPa'",
        )  # fmt: skip
        ratio = one_number("nu" + whose, self.nu)
        _poisson("nu" + whose, ratio)
        tempers = []
        for each in _both("hardness" + whose, self.hardness):
            number = (
                hardness_in(Units(stress="GPa"), each) if isinstance(each, str) else each
            )
            tempers.append(number_in(f"hardness{whose} in GPa", number, *HARDNESSES))
        conductivities = []
        for each in _both("conductivity" + whose, self.conductivity):
            number = _conductivity("conductivity" + whose, each)
            conductivities.append(
                number_in(f"conductivity{whose} in W/(m K)", number, *CONDUCTIVITIES)
            )
        for name, ends in (("hardness", tempers), ("conductivity", conductivities)):
            if ends[0] > ends[1]:
                raise InputError(
                    f"{name}{whose}: the lowest comes first, got {ends[0]:g} and {ends[1]:g}"
                )
        constants = {
            "E": float(modulus),
            "nu": float(ratio),
            "hardness": tuple(tempers),
            "conductivity": tuple(conductivities),
        }
        for name, value in constants.items():
            object.__setattr__(self, name, value)


def _both(name: str, value: Any) -> tuple[Any, Any]:
    """Both ends of a range, which one number may stand for."""
    if not isinstance(value, tuple | list | np.ndarray):
        return value, value
    if len(value) != 2:
        raise InputError(
            f"{name} is one number, or the ends of a range, got {len(value)} numbers"
        )
    return value[0], value[1]


def _conductivity(name: str, value: Any) -> Any:
    """A thermal conductivity in W/(m K)."""
    if not isinstance(value, str):
        return value
    (number,), unit = Units(length="m").conductivities(value)
    if unit != "W/(m^2 K)":
        raise InputError(f"{name} is thermal, such as '45 W/(m K)', got {value!r}")
    return number


def _vickers_pressure(number: float) -> float:
    """Force over projected area [GPa] of a Vickers number (136 degrees between faces)."""
    return 9.80665e-3 * number / math.sin(math.radians(68))


def _brinell_pressure(number: float, load: float) -> float:
    """Force over projected area [GPa] of a Brinell number, with its load in kgf per D^2 [mm^2].

    The number is force over the cap pi D h, the projected area is pi h (D - h).
    """
    return 9.80665e-3 * number / (1 - load / (math.pi * number))


def _metals() -> tuple[dict[str, Metal], dict[tuple[str, ...], str]]:
    """The metals of tables/metals.csv by name, and all their names by the words of these."""
    metals: dict[str, Metal] = {}
    names: dict[tuple[str, ...], str] = {}
    for row in records(shipped_file("metals.csv")):
        name = row["name"]
        scale = row["scale"]
        tempers = []
        for end in TEMPERS:
            number = float(row[end])
            pressure = (
                _vickers_pressure(number)
                if scale == "HV"
                else _brinell_pressure(number, float(scale.removeprefix("HB")))
            )
            tempers.append(round(pressure, 2))
        E, nu, low, high = (float(row[column]) for column in ("E", "nu", "low", "high"))
        metals[name] = Metal(name, E, nu, tuple(tempers), (low, high), row["source"])
        names[_words(name)] = name
        for alias in row["also"].split(";"):
            other, _, temper = alias.partition(" = ")
            names[_words(other)] = f"{name} {temper}".strip()
    return metals, names


def _words(name: str) -> tuple[str, ...]:
    """The words of a metal's name in alphabetical order, in one spelling."""
    plain = name.lower().replace("aluminum", "aluminium").replace("gray", "grey")
    return tuple(sorted(re.findall(r"[a-z0-9.]+", plain)))


KEPT = 256  # pairs of metals
_METALS, _NAMES = _metals()
METALS = tuple(_METALS)
HARDEST = max(metal.hardness[1] for metal in _METALS.values())


def get(name: str) -> Metal:
    """Ranges of a metal's constants; `METALS` lists names, "soft" or "hard" may follow.

    Names in other standards, such as "S355J2", "1.4301", "6061-T6" or "GG25", are known too
    (`also` in tables/metals.csv). Capitals, hyphens and the order of words do not count.

    Raises
    ------
    InputError
        For an unknown name; the message names the nearest.

    Examples
    --------
    >>> from mbma_tables.bodies import materials
    >>> steel = materials.get("steel 4140")
    >>> steel.hardness, steel.conductivity[0]
    ((2.06, 5.76), 42.7)
    >>> materials.get("steel 4140 hard").hardness
    (5.76, 5.76)
    >>> materials.get("6061-T6").name, materials.get("Aluminum 6061").name
    ('aluminium 6061 hard', 'aluminium 6061')
    """
    full_name = _full_name(str(name))
    if full_name is None:
        raise InputError(
            f"no metal is named {name!r}: give {_alike(str(name))}, perhaps with ' soft' "
            "or ' hard', or a Metal"
        )
    plain, _, temper = full_name.rpartition(" ")
    if plain in _METALS and temper in TEMPERS:
        one = _METALS[plain].hardness[TEMPERS.index(temper)]
        return dataclasses.replace(_METALS[plain], name=full_name, hardness=(one, one))
    return _METALS[full_name]


@functools.lru_cache(1024)
def _full_name(name: str) -> str | None:
    """The name in `METALS`, perhaps with a temper, that is meant by any name of a metal; None if it is none."""
    words = _words(name)
    full_name = _NAMES.get(words)
    if full_name is not None:
        return full_name
    # one word may be the temper
    for temper in TEMPERS:
        rest = list(words)
        if temper in rest:
            rest.remove(temper)
            plain = _NAMES.get(tuple(rest))
            if plain in _METALS:
                return f"{plain} {temper}"
    return None


def is_name(name: str) -> bool:
    """Whether a text is a metal's name, in any spelling that `get` takes."""
    return _full_name(name) is not None


def _alike(name: str) -> str:
    """Names of metals that share a word with a name or are spelt like it, or all of them."""
    words = _words(name)
    spelt = difflib.get_close_matches(
        " ".join(words), [" ".join(words_of_metal) for words_of_metal in _NAMES], 3, 0.6
    )
    alike: dict[str, None] = {}
    for words_of_metal, metal in _NAMES.items():
        if (
            set(words) & set(words_of_metal) - set(TEMPERS)
            or " ".join(words_of_metal) in spelt
        ):
            alike[metal.removesuffix(" soft").removesuffix(" hard")] = None
    return ", ".join(alike or METALS)


@dataclasses.dataclass(frozen=True)
class Pair:
    """Two metals in contact, made by `pair`."""

    metals: tuple[Metal, Metal]

    @functools.cached_property
    def E_star(self) -> str:
        """Effective modulus with its unit."""
        a, b = self.metals
        return f"{effective_modulus(a.E, a.nu, b.E, b.nu):.17g} GPa"

    @functools.cached_property
    def softer(self) -> Metal:
        """The softer metal, which yields."""
        return min(self.metals, key=lambda metal: metal.hardness)

    @functools.cached_property
    def hardness(self) -> str | None:
        """Hardness of the softer one with its unit.

        None if its tempers differ by more than a factor of 1.3.
        """
        soft, hard = self.softer.hardness
        return f"{math.sqrt(soft * hard):.6g} GPa" if hard <= ONE_TEMPER * soft else None

    @functools.cached_property
    def conductivities(self) -> tuple[str, str]:
        """Thermal conductivities with their unit, geometric means of the ranges."""
        first, second = self.metals
        return _mean_conductivity(first), _mean_conductivity(second)

    @property
    def remedy(self) -> str:
        """How to give the hardness of the softer one."""
        soft, hard = self.softer.hardness
        if soft == hard:
            return f"Bodies(metals=..., hardness='{soft:g} GPa')"
        remedy = f"Bodies(metals=..., hardness=...), '{soft:g} GPa' to '{hard:g} GPa'"
        if not is_name(f"{self.softer.name} hard"):
            return remedy
        tempers = f"'{self.softer.name} soft' or '{self.softer.name} hard'"
        return f"its temper, {tempers}, or {remedy}"

    @property
    def without_hardness(self) -> str:
        """What is stated in place of a hardness where the metals have none."""
        return (
            f"not known, so that contacts are elastic: of {self.softer.name} give "
            f"{self.remedy}"
        )

    @property
    def ranges_of_conductivity(self) -> str:
        """The ranges in the literature of which `conductivities` are the means, as text."""
        ranges = [metal.conductivity for metal in self.metals]
        texts = [
            f"{low:g}" if low == high else f"{low:g} to {high:g}" for low, high in ranges
        ]
        text = f"{' and '.join(texts)} W/(m K)"
        if all(low == high for low, high in ranges):
            return text
        return f"{text}; of a range the geometric mean is used"


def _mean_conductivity(metal: Metal) -> str:
    """Thermal conductivity with its unit, the geometric mean of its range."""
    low, high = metal.conductivity
    return f"{math.sqrt(low * high):.6g} W/(m K)"


def pair(
    materials: str
    | Metal
    | Mapping[str, Any]
    | Pair
    | Sequence[str | Metal | Mapping[str, Any]],
) -> Pair:
    """Two metals in contact: names, `Metal` objects or mappings, or one for both bodies.

    Examples
    --------
    >>> from mbma_tables.bodies import materials
    >>> joint = materials.pair(("steel 4140 hard", "aluminium 6061 hard"))
    >>> joint.E_star[:4], joint.hardness, joint.softer.name
    ('57.5', '0.95 GPa', 'aluminium 6061 hard')
    """
    if isinstance(materials, Pair):
        return materials
    metals: Sequence[Any] = (
        materials if isinstance(materials, tuple | list) else [materials]
    )
    if len(metals) not in (1, 2):
        raise InputError(f"materials are one or two, got {len(metals)}")
    if all(isinstance(metal, str) for metal in metals):
        return _named_pair(metals[0], metals[-1])
    return Pair((_metal(metals[0]), _metal(metals[-1])))


@functools.lru_cache(maxsize=KEPT)
def _named_pair(first: str, second: str) -> Pair:
    """Two metals by their names, whose constants follow once for many joints."""
    return Pair((get(first), get(second)))


def _metal(metal: Any) -> Metal:
    """A metal by its name, as it is, or of its constants by name."""
    if isinstance(metal, Metal):
        return metal
    if not isinstance(metal, Mapping):
        return get(metal)
    fields = {field.name: field.default for field in dataclasses.fields(Metal)}
    missing = [
        name
        for name, default in fields.items()
        if default is dataclasses.MISSING and name not in metal
    ]
    unknown = [str(name) for name in metal if name not in fields]
    if missing or unknown:
        wrong = [f"{', '.join(missing)} missing"] if missing else []
        wrong += [f"{', '.join(unknown)} unknown"] if unknown else []
        raise InputError(f"a metal has {', '.join(fields)}: {' and '.join(wrong)}")
    return Metal(**metal)


def hardness(given: str) -> str:
    """Hardness as a mean pressure with its unit, for the argument ``hardness=``.

    Parameters
    ----------
    given : str
        A Vickers number, "200 HV", force over the faces of the pyramid: p_m = 9.80665 MPa
        HV/sin(68 deg). A Rockwell number of steel, "58 HRC", from 20 to 68 by table 1 of
        ASTM E140, or "90 HRB", from 71.2 to 99.5 by table A.1 of ISO 18265 (other tables
        differ by up to 6%). A Brinell number, "200 HB" or "200 HBW": force over the cap of
        the indentation, from 96 to 653 at 3000 kgf and a ball of 10 mm; with other balls
        and loads [mm/kgf] after it, "95 HBW 10/500". A metal by name, with its temper where
        these differ by more than a factor of 1.3, "aluminium 6061 hard"; a pressure,
        "1.5 GPa"; or the yield stress of a metal that does not harden, "yield 350 MPa", of
        which three times is taken (Tabor 1951), or another factor, "2.8 x yield 350 MPa". Of
        one that hardens the yield stress after 8% strain counts.

    Raises
    ------
    InputError, OutOfRangeError

    Examples
    --------
    >>> from mbma_tables.bodies import materials
    >>> materials.hardness("200 HV"), materials.hardness("58 HRC")
    ('2.11536 GPa', '6.9405 GPa')
    >>> materials.hardness("200 HB"), materials.hardness("95 HBW 10/500")
    ('2.05967 GPa', '0.947505 GPa')
    >>> materials.hardness("90 HRB"), materials.hardness("aluminium 6061 hard")
    ('2.03604 GPa', '0.95 GPa')
    """
    text = str(given)
    if match := _YIELD.fullmatch(text):
        share = OVER_YIELD if match[1] is None else _number(match[1])
        require(
            "factor of the yield stress",
            np.asarray(share),
            1 <= share <= 4,
            "from 1 to 4",
        )
        if read("hardness", match[2])[1] is None:
            raise InputError(f"a yield stress has a unit, 'yield 350 MPa', got {text!r}")
        stress = Units(stress="GPa").number("hardness", match[2])
        return f"{share * float(positive_array('yield stress', stress)):.6g} GPa"
    if match := _SCALE.fullmatch(text):
        return f"{_pressure_of_number(float(match[1]), match[2], match[3], match[4]):.6g} GPa"
    # a name such as 6061-T6 begins with a digit; 1.4301 alone is a number here
    plain = text.strip().replace(".", "").isdigit()
    if text.strip()[:1].isalpha() or (_full_name(text) and not plain):
        try:
            pressure = pair(text).hardness
        except InputError as fault:
            kinds = (
                "a number, a text such as '1.5 GPa', '200 HV', '200 HB', '58 HRC' or "
                "'90 HRB', or a metal"
            )
            raise InputError(f"hardness must be {kinds}: {fault}") from None
        if pressure is None:
            soft, hard = get(text).hardness
            raise InputError(
                f"the hardness of {text!r} depends on its temper: write '{text} soft' "
                f"({soft:g} GPa), '{text} hard' ({hard:g} GPa), or a hardness such as "
                f"'{soft:g} GPa', '200 HV' or '40 HRC'"
            )
        return pressure
    return text


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(
            f"the factor of a yield stress is a number, got {text!r}"
        ) from None


def _pressure_of_number(
    number: float, scale: str, ball: str | None, force: str | None
) -> float:
    """Mean pressure [GPa] of a hardness number; Brinell with diameter [mm], force [kgf]."""
    value = finite_array("hardness", number)
    if scale.startswith("HB"):
        load = BRINELL_LOAD
        if ball is not None and force is not None:
            diameter = positive_array("ball [mm]", float(ball))
            kilograms = positive_array("force [kgf]", float(force))
            load = float(kilograms / diameter**2)
        # depth h of the indentation: (d/D)^2 = 4 (h/D) (1 - h/D), h/D = load/(pi number)
        shallow, deep = ((1 - math.sqrt(1 - ratio**2)) / 2 for ratio in BRINELL_DIAMETERS)
        least = math.ceil(load / (math.pi * deep))
        most = math.floor(load / (math.pi * shallow))
        require(
            f"hardness [{scale}]", value, (value >= least) & (value <= most),
            f"from {least} to {most} at {load:g} kgf per square millimetre of the ball's "
            "diameter (ISO 6506-1); with the ball's diameter in mm and another load in "
            "kgf it is written '95 HBW 10/500'",
        )  # fmt: skip
        return _brinell_pressure(number, load)
    if scale in ROCKWELL:
        numbers, vickers = ROCKWELL[scale]
        require(
            f"hardness [{scale}]", value, (value >= numbers[0]) & (value <= numbers[-1]),
            f"from {numbers[0]:g} to {numbers[-1]:g}, where the scale is converted",
        )  # fmt: skip
        return _vickers_pressure(float(np.interp(value, numbers, vickers)))
    require("hardness [HV]", value, value > 0, "positive")
    return _vickers_pressure(number)


def microhardness(surface: Any, c1: float | str, c2: float) -> str:
    """Hardness of a face at the size of its own contacts, with its unit: what ``hardness=`` takes.

    H = c1 (1.62 sigma/m)^c2, sigma/m in micrometres, m the mean absolute slope of a
    profile: Yovanovich's, as in M. Bahrami et al., Thermal contact resistance of
    nonconforming rough surfaces 2, J. Thermophys. Heat Tr. 18 (2004).

    Parameters
    ----------
    surface : Surface
        With its unit of length.
    c1, c2 : float
        Vickers hardness of an indent of 1 um, with its unit or in GPa, and size index in (-1, 0].

    Examples
    --------
    >>> from mbma_tables import Surface, materials
    >>> face = Surface.from_roughness(
    ...     Rq="1 um", longest="250 um", shortest="4 um", hurst=0.8, nominal_area="4 cm^2"
    ... )
    >>> materials.microhardness(face, "5 GPa", -0.2)
    '2.57205 GPa'
    """
    if surface.unit is None:
        raise InputError("microhardness depends on lengths: give the surface its unit")
    one = positive_array("c1", Units(stress="GPa").number("pressure", c1))
    index = finite_array("c2", c2)
    require("c2", index, (index > -1) & (index <= 0), "in (-1, 0]")
    indent = (
        1.62
        * surface.h_rms
        / np.sqrt(2 * surface.m2 / math.pi)
        * factor(surface.unit, "um")
    )
    return f"{one_number('hardness', one * indent**index):.6g} GPa"


def hardness_in(units: Units, value: Any) -> Any:
    """A hardness in these units, from any text of `hardness`; numbers are unchanged."""
    if isinstance(value, list | tuple):
        return [hardness_in(units, each) for each in value]
    return units.number("hardness", hardness(value) if isinstance(value, str) else value)


# c of Poisson's ratio in the tangential compliance 1 - nu c of isotropic surfaces
ISOTROPIC_SHARE = 0.5


def tangential_ratio(
    nu: ArrayLike,
    E: Sequence[Any] | None = None,
    share: Callable[[FloatArray], Any] = lambda nu: ISOTROPIC_SHARE,
) -> Any:
    """kappa, normal over tangential stiffness of a stuck contact (Mindlin 1949).

    Parameters
    ----------
    nu : array_like
        Poisson's ratio of both bodies, or of the one that is not rigid; with `E` one of each body.
    E : pair of float or str, optional
        Young's moduli of the bodies.
    share : callable, optional
        c of Poisson's ratios, 1/2 for isotropic surfaces (`mbma_tables.contacts.quantities.lay`).

    Returns
    -------
    float or ndarray
        (1 - nu c)/(1 - nu), (2 - nu)/(2 (1 - nu)) if isotropic; of two bodies their
        compliances (1 - nu c)/G over (1 - nu)/G, both added.

    Examples
    --------
    >>> from mbma_tables.bodies.materials import tangential_ratio
    >>> round(float(tangential_ratio(0.3)), 4)
    1.2143
    >>> round(float(tangential_ratio((0.3, 0.3), (210.0, 70.0))), 4)
    1.2143
    """
    ratio = _poisson("nu", nu)
    if (E is None) == (ratio.shape == (2,)) or (E is not None and len(E) != 2):
        raise InputError(
            "nu is one number, or two with E=(E1, E2), the moduli of the bodies"
        )
    if E is None:
        return answered(core.tangential_ratios, (ratio, share(ratio)))[0][()]
    above = 1 - ratio * share(ratio)
    below = 1 - ratio
    modulus = positive_array(
        "E", list(in_one_unit({"E1": E[0], "E2": E[1]}, kind="stress")[0].values())
    )
    compliance = (1 + ratio) / modulus  # 1/(2 G)
    return (above * compliance).sum(axis=-1) / (below * compliance).sum()
