"""Elastic constants, hardness and conductivity of metals.

The constants of two bodies are joined into the one modulus that contact needs.

Hardnesses are converted from Brinell, Vickers or Rockwell number to the mean pressure over the projected area, which is
the pressure that counts here. A ground or polished face is harder than its bulk at depths of micrometres: measure it if
it matters. The sources of the numbers are in tables/metals.csv.
"""

import csv
import dataclasses
import difflib
import math
import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, broadcast_shape, finite_array, one_number, positive_array, require
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import shipped_file
from mbma_tables.common.units import Units, factor, resolve

ELASTIC_PSI = 1.1  # plasticity index E* g/p_m up to which elastic areas are within 5% of those with a hardness
ONE_TEMPER = 1.3  # largest ratio of tempers' hardnesses for which their geometric mean is used, within 14% of both
TEMPERS = ("soft", "hard")
# Vickers number of non-austenitic steels at Rockwell C numbers: ASTM E140 table 1, as printed at
# mikipulley.co.jp/EN/Services/Tech_data/tech20.html
HRC = (20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0, 55.0, 60.0, 65.0, 68.0)
HV_OF_HRC = (238.0, 266.0, 302.0, 345.0, 392.0, 446.0, 513.0, 595.0, 697.0, 832.0, 940.0)
_SCALE = re.compile(r"\s*((?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(HV|HRC)\s*", re.ASCII)


def _poisson(name: str, value: ArrayLike) -> FloatArray:
    """Poisson's ratios."""
    ratio = finite_array(name, value)
    require(name, ratio, (ratio > -1) & (ratio <= 0.5), "in (-1, 0.5]")
    return ratio


def effective_modulus(E1: ArrayLike | str, nu1: ArrayLike, E2: ArrayLike | str, nu2: ArrayLike) -> Any:
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
        E*, in the unit of E1 and E2; the arguments broadcast. A text with that unit where texts were given, which
        `E_star=` takes as it is. Against a rigid body it is E1/(1 - nu1^2), the limit of large E2.

    Raises
    ------
    InputError, OutOfRangeError
        For NaN, infinite or empty input, shapes that do not broadcast, and numbers outside these ranges.

    Examples
    --------
    Steel on steel, in GPa:

    >>> from mbma_tables.materials import effective_modulus
    >>> round(float(effective_modulus(210.0, 0.3, 210.0, 0.3)), 2)
    115.38
    >>> effective_modulus("200 GPa", 0.0, "50 GPa", 0.0)
    '40.0 GPa'
    """
    plain, unit = resolve({"E1": E1, "nu1": nu1, "E2": E2, "nu2": nu2}, kind="stress")
    moduli = [positive_array(name, plain[name]) for name in ("E1", "E2")]
    ratios = [_poisson(name, plain[name]) for name in ("nu1", "nu2")]
    broadcast_shape(E1=moduli[0], nu1=ratios[0], E2=moduli[1], nu2=ratios[1])
    a, b = ((1 - nu) * (1 + nu) / E for nu, E in zip(ratios, moduli, strict=True))
    found = (1 / (a + b))[()]
    return found if unit is None or not isinstance(E1, str) else f"{one_number('E_star', found)} {unit}"


@dataclasses.dataclass(frozen=True)
class Metal:
    """Ranges of a metal's constants at room temperature."""

    name: str
    E: float  # Young's modulus [GPa]
    nu: float  # Poisson's ratio
    hardness: tuple[float, float]  # of soft and of hard tempers [GPa], mean pressure of an indentation; may be equal
    conductivity: tuple[float, float]  # thermal, lowest and highest of what was found [W/(m K)]
    source: str = ""  # titles and addresses of the pages on which the numbers were read


def _mean_pressure(scale: str, number: float) -> float:
    """Force over projected area [GPa] of a Vickers number, or of a Brinell number at 30 or 5 kgf per D^2 [mm^2]."""
    over_faces = 9.80665e-3 * number
    if scale == "HV":  # pyramid of 136 degrees between faces
        return over_faces / math.sin(math.radians(68))
    return over_faces / (1 - {"HB30": 30, "HB5": 5}[scale] / (math.pi * number))


def _metals() -> dict[str, Metal]:
    """The metals of tables/metals.csv, by name."""
    found = {}
    lines = shipped_file("metals.csv").read_text(encoding="utf-8").splitlines()
    for row in csv.DictReader(line for line in lines if not line.startswith("#")):
        soft, hard = (round(_mean_pressure(row["scale"], float(row[end])), 2) for end in ("soft", "hard"))
        E, nu, low, high = (float(row[name]) for name in ("E", "nu", "low", "high"))
        found[row["name"]] = Metal(row["name"], E, nu, (soft, hard), (low, high), row["source"])
    return found


_METALS = _metals()
METALS = tuple(_METALS)
HARDEST = max(metal.hardness[1] for metal in _METALS.values())


def get(name: str) -> Metal:
    """Ranges of a metal's constants; `METALS` lists the names, after which "soft" or "hard" may name a temper.

    Raises
    ------
    InputError
        For an unknown name; the message names the nearest.

    Examples
    --------
    >>> from mbma_tables import materials
    >>> steel = materials.get("steel 4140")
    >>> steel.hardness, steel.conductivity[0]
    ((2.06, 5.76), 42.7)
    >>> materials.get("steel 4140 hard").hardness
    (5.76, 5.76)
    """
    plain, _, temper = str(name).rpartition(" ")
    if temper in TEMPERS and plain in _METALS:
        one = _METALS[plain].hardness[TEMPERS.index(temper)]
        return dataclasses.replace(_METALS[plain], name=name, hardness=(one, one))
    if str(name) not in _METALS:
        near = difflib.get_close_matches(str(name), METALS, 3, 0.4) or METALS
        raise InputError(f"no metal is named {name!r}: give a Metal, or {', '.join(near)}, or with ' soft', ' hard'")
    return _METALS[name]


@dataclasses.dataclass(frozen=True)
class Pair:
    """Two metals in contact, made by `pair`."""

    metals: tuple[Metal, Metal]

    @property
    def E_star(self) -> str:
        """Effective modulus with its unit."""
        a, b = self.metals
        return f"{effective_modulus(a.E, a.nu, b.E, b.nu):.17g} GPa"

    @property
    def softer(self) -> Metal:
        """The softer metal, which yields."""
        return min(self.metals, key=lambda metal: metal.hardness)

    @property
    def hardness(self) -> str | None:
        """Hardness of the softer one with its unit; None if its tempers differ by more than a factor of 1.3."""
        soft, hard = self.softer.hardness
        return f"{math.sqrt(soft * hard):.6g} GPa" if hard <= ONE_TEMPER * soft else None

    @property
    def conductivities(self) -> tuple[str, str]:
        """Thermal conductivities with their unit, geometric means of the ranges."""
        a, b = (f"{math.sqrt(low * high):.6g} W/(m K)" for low, high in (metal.conductivity for metal in self.metals))
        return a, b


def pair(materials: str | Metal | Pair | Sequence[str | Metal]) -> Pair:
    """Two metals in contact: names or `Metal` objects, or one metal for both bodies.

    Examples
    --------
    >>> from mbma_tables import materials
    >>> joint = materials.pair(("steel 4140 hard", "aluminium 6061 hard"))
    >>> joint.E_star[:4], joint.hardness, joint.softer.name
    ('57.5', '0.95 GPa', 'aluminium 6061 hard')
    """
    if isinstance(materials, Pair):
        return materials
    given: Sequence[Any] = materials if isinstance(materials, tuple | list) else [materials]
    if len(given) not in (1, 2):
        raise InputError(f"materials are one or two, got {len(given)}")
    one, other = (each if isinstance(each, Metal) else get(each) for each in (given[0], given[-1]))
    return Pair((one, other))


def hardness(given: str) -> str:
    """Hardness as a mean pressure with its unit, for the argument ``hardness=``.

    Parameters
    ----------
    given : str
        A Vickers number, "200 HV", force over the faces of the pyramid: p_m = 9.80665 MPa HV/sin(68 deg); a Rockwell C
        number of steel from 20 to 68, "58 HRC", by table 1 of ASTM E140; a metal by name, with its temper where these
        differ by more than a factor of 1.3, "aluminium 6061 hard"; or a pressure, "1.5 GPa", which of a metal that does
        not harden is three times its yield stress (Tabor 1951).

    Raises
    ------
    InputError, OutOfRangeError

    Examples
    --------
    >>> from mbma_tables import materials
    >>> materials.hardness("200 HV"), materials.hardness("58 HRC"), materials.hardness("aluminium 6061 hard")
    ('2.11536 GPa', '6.9405 GPa', '0.95 GPa')
    """
    text = str(given)
    if found := _SCALE.fullmatch(text):
        number, scale = finite_array("hardness", float(found[1])), found[2]
        if scale == "HRC":
            good = (number >= HRC[0]) & (number <= HRC[-1])
            require("hardness [HRC]", number, good, f"from {HRC[0]:g} to {HRC[-1]:g}, where the scale is converted")
            number = np.interp(number, HRC, HV_OF_HRC)
        require("hardness [HV]", number, number > 0, "positive")
        return f"{_mean_pressure('HV', float(number)):.6g} GPa"
    if text[:1].isalpha():
        try:
            known = pair(text).hardness
        except InputError as fault:
            kinds = "a number, a text such as '1.5 GPa', '200 HV' or '58 HRC', or a metal"
            raise InputError(f"hardness must be {kinds}: {fault}") from None
        if known is None:
            soft, hard = get(text).hardness
            raise InputError(
                f"the hardness of {text!r} depends on its temper: write '{text} soft' ({soft:g} GPa), '{text} hard' "
                f"({hard:g} GPa), or a hardness such as '{soft:g} GPa', '200 HV' or '40 HRC'"
            )
        return known
    return text


def microhardness(surface: Any, c1: float | str, c2: float) -> str:
    """Hardness of a face at the size of its own contacts, with its unit: what ``hardness=`` takes.

    H = c1 (1.62 sigma/m)^c2, sigma/m in micrometres, m the mean absolute slope of a profile: Yovanovich's, as in
    M. Bahrami et al., Thermal contact resistance of nonconforming rough surfaces 2, J. Thermophys. Heat Tr. 18 (2004).

    Parameters
    ----------
    surface : Surface
        With its unit of length.
    c1, c2 : float
        Vickers hardness of an indent of 1 um, with its unit or in GPa, and size index in (-1, 0].

    Examples
    --------
    >>> from mbma_tables import Surface, materials
    >>> face = Surface.from_roughness(Rq="1 um", longest="250 um", shortest="4 um", hurst=0.8, nominal_area="4 cm^2")
    >>> materials.microhardness(face, "5 GPa", -0.2)
    '2.57205 GPa'
    """
    if surface.unit is None:
        raise InputError("microhardness depends on lengths: give the surface its unit")
    one, index = positive_array("c1", Units(stress="GPa").number("pressure", c1)), finite_array("c2", c2)
    require("c2", index, (index > -1) & (index <= 0), "in (-1, 0]")
    indent = 1.62 * surface.h_rms / np.sqrt(2 * surface.m2 / math.pi) * factor(surface.unit, "um")
    return f"{one_number('hardness', one * indent**index):.6g} GPa"


def hardness_in(units: Units, value: Any) -> Any:
    """A hardness in the given units, from any text that `hardness` accepts; numbers are unchanged."""
    if isinstance(value, list | tuple):
        return [hardness_in(units, each) for each in value]
    return units.number("hardness", hardness(value) if isinstance(value, str) else value)


def bodies(materials: Any, E_star: Any, hardness: Any) -> tuple[Any, Any, Pair | None]:
    """Modulus and hardness of a contact, as given or from the named materials, and these materials."""
    if materials is None:
        return E_star, hardness, None
    known = pair(materials)
    if not (isinstance(E_star, int | float) and E_star == 1.0):
        raise InputError("E_star and materials are both given: give one of them")
    return known.E_star, known.hardness if hardness is None else hardness, known


def tangential_ratio(
    nu: ArrayLike, E: Sequence[Any] | None = None, share: Callable[[FloatArray], Any] = lambda nu: 0.5
) -> Any:
    """kappa, normal over tangential stiffness of a stuck contact (Mindlin 1949).

    Parameters
    ----------
    nu : array_like
        Poisson's ratio of both bodies, or of the one that is not rigid; with `E` one of each body.
    E : pair of float or str, optional
        Young's moduli of the bodies.
    share : callable, optional
        c of Poisson's ratios, 1/2 for isotropic surfaces (`mbma_tables.laws.lay`).

    Returns
    -------
    float or ndarray
        (1 - nu c)/(1 - nu), (2 - nu)/(2 (1 - nu)) if isotropic; of two bodies their compliances (1 - nu c)/G over
        (1 - nu)/G, both added.

    Examples
    --------
    >>> from mbma_tables.materials import tangential_ratio
    >>> round(float(tangential_ratio(0.3)), 4), round(float(tangential_ratio((0.3, 0.3), (210.0, 70.0))), 4)
    (1.2143, 1.2143)
    """
    ratio = _poisson("nu", nu)
    if (E is None) == (ratio.shape == (2,)) or (E is not None and len(E) != 2):
        raise InputError("nu is one number, or two with E=(E1, E2), the moduli of the bodies")
    above, below = 1 - ratio * share(ratio), 1 - ratio
    if E is None:
        return np.asarray(above / below)[()]
    modulus = positive_array("E", list(resolve({"E1": E[0], "E2": E[1]}, kind="stress")[0].values()))
    compliance = (1 + ratio) / modulus  # 1/(2 G)
    return (above * compliance).sum(axis=-1) / (below * compliance).sum()
