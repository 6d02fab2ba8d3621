"""Elastic constants of the two bodies, joined into the one modulus that contact needs, and ranges for common metals.

Hardnesses are converted from Brinell or Vickers number to the mean pressure over the projected area, which is the
pressure that counts here. A ground or polished face is harder than its bulk at depths of micrometres: measure where it
matters. Where the numbers were read is in tables/metals.csv.
"""

from __future__ import annotations

import csv
import dataclasses
import difflib
import math
from typing import Any

from numpy.typing import ArrayLike

from mbma_tables.common.arguments import broadcast_shape, finite_array, one_number, require
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import shipped_file
from mbma_tables.common.units import resolve

ELASTIC_PSI = 1.1  # plasticity index E* g/p_m up to which elastic areas are within 5% of those with a hardness


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
    given = {name: finite_array(name, value) for name, value in plain.items()}
    for name in ("E1", "E2"):
        require(name, given[name], given[name] > 0, "positive")
    for name in ("nu1", "nu2"):
        require(name, given[name], (given[name] > -1) & (given[name] <= 0.5), "in (-1, 0.5]")
    broadcast_shape(**given)
    a, b = ((1 - nu) * (1 + nu) / E for nu, E in ((given["nu1"], given["E1"]), (given["nu2"], given["E2"])))
    found = (1 / (a + b))[()]
    return found if unit is None or not isinstance(E1, str) else f"{one_number('E_star', found)} {unit}"


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


def _metals() -> dict[str, Metal]:
    """Those of tables/metals.csv, by name."""
    found = {}
    lines = shipped_file("metals.csv").read_text(encoding="utf-8").splitlines()
    for row in csv.DictReader(line for line in lines if not line.startswith("#")):
        soft, hard = (round(_mean_pressure(row["scale"], float(row[end])), 2) for end in ("soft", "hard"))
        conductivity = float(row["low"]), float(row["high"])
        found[row["name"]] = Metal(
            row["name"], float(row["E"]), float(row["nu"]), (soft, hard), conductivity, row["source"]
        )
    return found


_METALS = _metals()
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
