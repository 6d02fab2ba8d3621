"""Elastic constants of the two bodies, joined into the one modulus that contact needs, and ranges for common metals.

Every number of a metal was read in excerpts of the pages that `Metal.source` names: data sheets of makers and dealers,
and tables drawn from handbooks; the handbooks and standards themselves were not consulted. Where a page gives a range
of E or nu, a number in it is used. Pages differ by 10% in Young's modulus, by a quarter in conductivity (steel 1020),
and by more for the modulus of cast iron. Hardnesses are those of the softest and the hardest temper for which a page
was found, converted from Brinell or Vickers number to the mean pressure over the projected area, which is the pressure
that counts here. A ground or polished face is harder than its bulk at depths of micrometres: measure where it matters.
"""

from __future__ import annotations

import dataclasses
import difflib
import math
from typing import Any

from numpy.typing import ArrayLike

from mbma_tables.arguments import broadcast_shape, finite_array, require
from mbma_tables.errors import InputError

ELASTIC_PSI = 1.1  # plasticity index E* g/p_m up to which elastic areas are within 5% of those with a hardness


def effective_modulus(E1: ArrayLike, nu1: ArrayLike, E2: ArrayLike, nu2: ArrayLike) -> Any:
    """Effective modulus of two elastic bodies, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2.

    Parameters
    ----------
    E1, E2 : array_like
        Young's moduli, positive, in one unit of stress.
    nu1, nu2 : array_like
        Poisson's ratios, in (-1, 0.5].

    Returns
    -------
    float or ndarray
        E*, in the unit of E1 and E2; the arguments broadcast. Against a rigid body it is E1/(1 - nu1^2), the
        limit of large E2.

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
    """
    given = {name: finite_array(name, value) for name, value in {"E1": E1, "nu1": nu1, "E2": E2, "nu2": nu2}.items()}
    for name in ("E1", "E2"):
        require(name, given[name], given[name] > 0, "positive")
    for name in ("nu1", "nu2"):
        require(name, given[name], (given[name] > -1) & (given[name] <= 0.5), "in (-1, 0.5]")
    broadcast_shape(**given)
    a, b = ((1 - nu) * (1 + nu) / E for nu, E in ((given["nu1"], given["E1"]), (given["nu2"], given["E2"])))
    return (1 / (a + b))[()]


@dataclasses.dataclass(frozen=True)
class Metal:
    """Ranges of a metal's constants at room temperature.

    Attributes
    ----------
    name : str
    E : float
        Young's modulus [GPa].
    nu : float
        Poisson's ratio.
    hardness : tuple of float
        Of soft and of hard tempers [GPa], as mean pressure of an indentation; equal where only one was found.
    conductivity : tuple of float
        Thermal, lowest and highest of what was found [W/(m K)].
    source : str
        Titles and addresses of the pages on which the numbers were read.
    """

    name: str
    E: float
    nu: float
    hardness: tuple[float, float]
    conductivity: tuple[float, float]
    source: str


def _mean_pressure(scale: str, number: float) -> float:
    """Force over projected area [GPa] of a Vickers number, or of a Brinell number at 30 or 5 kgf per D^2 [mm^2]."""
    over_faces = 9.80665e-3 * number
    if scale == "HV":  # pyramid of 136 degrees between faces
        return over_faces / math.sin(math.radians(68))
    return over_faces / (1 - {"HB30": 30, "HB5": 5}[scale] / (math.pi * number))


_SOURCES = {
    "steel 1020": "1020, esm.elwd.com/product/1020 (30 Msi, nu, 137 HB hot rolled, 360 Btu in/(h ft2 F)); MakeItFrom, "
    "makeitfrom.com/compare/Cold-Drawn-1020-Carbon-Steel/Hot-Rolled-1020-Carbon-Steel (120 HB)",
    "steel 4140": "MatWeb, AISI 4140 tempered at 205 C, matweb.com, datasheet 8e87bc1cf20343b985b1a46a1f1eb1c3 (E, nu, "
    "578 HB); MakeItFrom, makeitfrom.com/compare/Annealed-4140-Cr-Mo-Steel/Normalized-4140-Cr-Mo-Steel (200 HB); Miki "
    "Pulley, SCM440, mikipulley.co.jp/EN/Services/Tech_data/tech18.html (conductivity)",
    "steel 52100": "AISI 52100 chrome steel, scribd.com/document/252517093 (29.5 Msi, 60 to 67 HRC); Miki Pulley, "
    "mikipulley.co.jp/EN/Services/Tech_data/tech20.html (HRC to HV) and tech18.html (37, steel of 0.8 to 1.6% C); "
    "stindia.com/article/difference-between/difference-between-52100-e52100-steel.html (nu 0.27 to 0.30); SAE 52100, "
    "dhanlaxmimetals.com/alloy_steel/alloy-content.php?product=SAE+52100 (46.6)",
    "stainless steel 304": "apacinfrastructure.com.au/material-specifications-304-stainless-steel (E, nu, 123 HB); "
    "AISI Type 304, scribd.com/document/416534641 (conductivity); MakeItFrom, "
    "makeitfrom.com/material-properties/Half-Hard-304-Stainless-Steel (360 HB)",
    "cast iron, grey": "Grade 250: jgmtcasting.com/support/Mechanical-properties-of-gray-cast-iron.html (103 to 118 "
    "GPa, nu), Modelleria Zuin, modelleriazuin.it/en/prototypes/materials/pig-iron (hardness); any grade: Miki Pulley, "
    "mikipulley.co.jp/EN/Services/Tech_data/tech18.html (conductivity)",
    "aluminium 1100": "alloysintl.com/inventory/aluminum-alloys-supplier/aluminum-1100 (E, nu, 23 HB, conductivity); "
    "btimetals.com/aerospace_metal/aluminum_1100_tubes (38 HB, temper H16)",
    "aluminium 6061": "SubsTech, substech.com/dokuwiki/doku.php?id=wrought_aluminum-magnesium-silicon_alloy_6061 (E, "
    "hardness O and T6); mfgproto.com/aluminum-6061-t6-data-sheet (nu); "
    "btimetals.com/aerospace_metal/aluminum_6061_tubes (conductivity T451 and O)",
    "aluminium 7075": "MatWeb for ASM, 7075-O, asm.matweb.com/search/SpecificMaterial.asp?bassnum=MA7075O (E, 60 HB); "
    "apacinfrastructure.com.au/material-specifications-7075-t6-aluminium-alloy (nu, 150 HB, 130); SubsTech, "
    "substech.com/dokuwiki/doku.php?id=wrought_aluminum-zinc-magnesium_alloy_7075 (173)",
    "copper C11000": "Wieland-K32, scribd.com/document/651533098 (R220 from 40 HV, R360 from 110 HV)",
    "brass C26000": "Aurubis, CuZn30, scribd.com/document/410096786 (R270 from 55 HV, R550 to 200 HV); Engineering "
    "ToolBox, engineeringtoolbox.com/poissons-ratio-d_1224.html (nu)",
    "titanium grade 2": "MatWeb for ASM, asm.matweb.com/search/SpecificMaterial.asp?bassnum=MTU021 (E, nu); MatWeb, "
    "matweb.com, datasheet 24293fd5831941ec9fa01dce994973c7 (145 HV); Superior Tube, superiortube.com/products/"
    "materials/titanium-alloys/cp-titanium-grade2-uns-r56400-wnr-37124 (at most 200 HV, conductivity)",
    "titanium Ti-6Al-4V": "MatWeb for ASM, asm.matweb.com/search/SpecificMaterial.asp?bassnum=MTP644 (annealed) and "
    "MTP642 (aged), Vickers converted there from Rockwell; "
    "luminatitan.com/ti-6al-4v-astm-grade-5-titanium-technical-data-sheet (6.6); "
    "m.aseanbizs.com/sell/show-htm-itemid-32740.html (7.2)",
    "magnesium AZ31B": "Matmake, matmake.com/materials-data/magnesium-az31b-h24-properties.html (73 HB, all else); "
    "MakeItFrom, makeitfrom.com/compare/AZ31B-O-Magnesium/Annealed-204-Stainless-Steel (56 HB)",
    "silver": "AZoM, azom.com/article.aspx?ArticleID=9282 (25 HV; of worked silver no number was found); AlloyFYI, "
    "alloyfyi.com/ar/guides/thermal-conductivity-metals (conductivity)",
    "gold": "WebElements, webelements.com/gold/physics.html; C. W. Corti, Strong 24 carat golds, "
    "scribd.com/document/45797153 (20 HV annealed, 80 HV cold worked)",
}


def _metal(name: str, E: float, nu: float, scale: str, soft: float, hard: float, low: float, high: float) -> Metal:
    pressures = round(_mean_pressure(scale, soft), 2), round(_mean_pressure(scale, hard), 2)
    return Metal(name, E, nu, pressures, (low, high), _SOURCES[name])


# E [GPa], nu, hardness numbers, conductivities
_METALS = {
    metal.name: metal
    for metal in (
        _metal("steel 1020", 207.0, 0.30, "HB30", 120, 137, 51.9, 51.9),
        _metal("steel 4140", 205.0, 0.29, "HB30", 200, 578, 42.7, 42.7),
        _metal("steel 52100", 203.0, 0.29, "HV", 697, 900, 37.0, 46.6),
        _metal("stainless steel 304", 193.0, 0.29, "HB30", 123, 360, 16.2, 16.2),
        _metal("cast iron, grey", 110.0, 0.26, "HB30", 170, 240, 44.0, 58.6),
        _metal("aluminium 1100", 68.9, 0.33, "HB5", 23, 38, 222.0, 222.0),
        _metal("aluminium 6061", 69.0, 0.33, "HB5", 30, 95, 154.0, 180.0),
        _metal("aluminium 7075", 71.7, 0.33, "HB5", 60, 150, 130.0, 173.0),
        _metal("copper C11000", 115.0, 0.34, "HV", 40, 110, 390.0, 390.0),
        _metal("brass C26000", 110.0, 0.33, "HV", 55, 200, 121.0, 121.0),
        _metal("titanium grade 2", 102.0, 0.34, "HV", 145, 200, 16.4, 16.4),
        _metal("titanium Ti-6Al-4V", 114.0, 0.33, "HV", 349, 396, 6.6, 7.2),
        _metal("magnesium AZ31B", 45.0, 0.35, "HB5", 56, 73, 96.0, 96.0),
        _metal("silver", 76.0, 0.37, "HV", 25, 25, 429.0, 429.0),
        _metal("gold", 78.0, 0.44, "HV", 20, 80, 320.0, 320.0),
    )
}
METALS = tuple(_METALS)


def get(name: str) -> Metal:
    """Ranges of a metal's constants; `METALS` lists the names.

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
    """
    if name not in _METALS:
        near = difflib.get_close_matches(str(name), METALS, 3, 0.4) or METALS
        raise InputError(f"no metal is named {name!r}: there are {', '.join(near)}")
    return _METALS[name]
