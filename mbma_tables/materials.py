"""Elastic constants of the two bodies, joined into the one modulus that contact needs, and ranges for common metals.

Moduli, Poisson's ratios and conductivities are those of W. D. Callister, "Materials Science and Engineering", Appendix
B. Hardnesses are ranges between soft and hard tempers, after the typical Brinell and Vickers numbers of the ASM
"Metals Handbook, Desk Edition": 1 HV is 9.81 MPa over the pyramid's faces and 10.6 MPa over the projected area, which
is the pressure that counts here. A ground or polished face is harder than its bulk at depths of micrometres: measure
where it matters.
"""

from __future__ import annotations

import dataclasses
import difflib
from typing import Any

from numpy.typing import ArrayLike

from mbma_tables.arguments import broadcast_shape, finite_array, require
from mbma_tables.errors import InputError


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
        Of soft and of hard tempers [GPa], as mean pressure of an indentation.
    conductivity : tuple of float
        Thermal, lowest and highest of the tempers [W/(m K)].
    """

    name: str
    E: float
    nu: float
    hardness: tuple[float, float]
    conductivity: tuple[float, float]


_METALS = {
    metal.name: metal
    for metal in (
        Metal("steel 1020", 207.0, 0.30, (1.2, 2.0), (51.9, 51.9)),
        Metal("steel 4140", 207.0, 0.30, (2.0, 6.0), (42.7, 42.7)),
        Metal("steel 52100", 207.0, 0.30, (7.0, 9.5), (37.0, 47.0)),
        Metal("stainless steel 304", 193.0, 0.30, (1.4, 4.0), (16.2, 16.2)),
        Metal("cast iron, grey", 110.0, 0.26, (1.7, 3.2), (46.0, 50.0)),
        Metal("aluminium 1100", 69.0, 0.33, (0.25, 0.50), (218.0, 222.0)),
        Metal("aluminium 6061", 69.0, 0.33, (0.30, 1.2), (154.0, 180.0)),
        Metal("aluminium 7075", 71.0, 0.33, (0.65, 1.9), (130.0, 130.0)),
        Metal("copper C11000", 115.0, 0.33, (0.45, 1.3), (388.0, 388.0)),
        Metal("brass C26000", 110.0, 0.35, (0.60, 2.0), (120.0, 120.0)),
        Metal("nickel 200", 204.0, 0.31, (0.95, 2.5), (70.0, 70.0)),
        Metal("titanium grade 2", 103.0, 0.34, (1.5, 2.3), (16.0, 16.0)),
        Metal("titanium Ti-6Al-4V", 114.0, 0.34, (3.3, 4.2), (6.7, 6.7)),
        Metal("magnesium AZ31B", 45.0, 0.35, (0.50, 0.85), (96.0, 96.0)),
        Metal("silver", 74.0, 0.37, (0.27, 1.0), (428.0, 428.0)),
        Metal("gold", 77.0, 0.42, (0.21, 0.70), (315.0, 315.0)),
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
    ((2.0, 6.0), 42.7)
    """
    if name not in _METALS:
        near = difflib.get_close_matches(str(name), METALS, 3, 0.4) or METALS
        raise InputError(f"no metal is named {name!r}: there are {', '.join(near)}")
    return _METALS[name]
