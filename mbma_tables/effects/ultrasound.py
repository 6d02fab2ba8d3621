"""Ultrasound at a contact: reflection by its stiffness, and the stiffness from a measured reflection.

A wave much longer than the gaps meets an interface whose faces move apart by the stress over
the stiffness. Displacement jumps, stress does not (Kendall, Tabor 1971; Tattersall 1973).
Ultrasound unloads and loads the contact by little, so that the stiffness is that of
unloading (Kim, Baltazar, Rokhlin, J. Mech. Phys. Solids 52 (2004) 1911).
"""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, finite_array, positive_array, require
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import factor
from mbma_tables.contacts.result import Contact

HERTZ = {"Hz": 1.0, "kHz": 1e3, "MHz": 1e6, "GHz": 1e9}
_FREQUENCY = re.compile(r"\s*([0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(G|M|k)?Hz\s*")


def impedance(E: ArrayLike, nu: ArrayLike, density: ArrayLike) -> Any:
    """Acoustic impedance rho c of longitudinal waves [kg/(m^2 s)].

    Parameters
    ----------
    E : array_like
        Young's modulus [GPa].
    nu : array_like
        Poisson's ratio, in (-1, 0.5).
    density : array_like
        [kg/m^3].

    Raises
    ------
    InputError, OutOfRangeError

    Examples
    --------
    Steel:

    >>> from mbma_tables.effects.ultrasound import impedance
    >>> f"{impedance(210.0, 0.3, 7850.0):.3g}"
    '4.71e+07'
    """
    modulus = 1e9 * positive_array("E", E)
    rho = positive_array("density", density)
    ratio = finite_array("nu", nu)
    require("nu", ratio, (ratio > -1) & (ratio < 0.5), "in (-1, 0.5)")
    stiff = modulus * (1 - ratio) / ((1 + ratio) * (1 - 2 * ratio))
    return np.sqrt(stiff * rho)[()]


def reflection(
    stiffness: Contact | ArrayLike, frequency: ArrayLike | str, impedances: ArrayLike
) -> Any:
    """Reflection coefficient of a contact, the amplitude that returns over that which arrives.

    Parameters
    ----------
    stiffness : Contact or array_like
        A contact, whose `unloading_stiffness` counts, or a stiffness [Pa/m].
    frequency : array_like or str
        [Hz], or a text, "5 MHz".
    impedances : array_like
        Of the first and the second body on a first axis [kg/(m^2 s)], or one of both.

    Returns
    -------
    float or ndarray
        |R|; stiffness, frequency and impedances broadcast. Of like bodies
        1/sqrt(1 + (2 K/(omega z))^2); of a stiff contact |z1 - z2|/(z1 + z2).

    Raises
    ------
    InputError, OutOfRangeError
        For numbers that are not positive, and contacts of which lengths or stresses have no
        unit.

    Examples
    --------
    >>> from mbma_tables import Joint
    >>> from mbma_tables.effects.ultrasound import impedance, reflection
    >>> ground = {"Rq": "0.4 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
    >>> joint = Joint(ground, ground, bodies="steel 1020 hard", nominal_area="4 cm^2")
    >>> steel = impedance(207.0, 0.3, 7870.0)
    >>> reflection(joint.at_pressure(["10 MPa", "100 MPa"]), "5 MHz", steel).round(2)
    array([1.  , 0.87])
    """
    K = _stiffness(stiffness)
    first, second = _impedances(impedances)
    # in phase with the stress and across it, over the stress
    moved = _angular(frequency) * first * second / K
    return np.hypot(first - second, moved)[()] / np.hypot(first + second, moved)[()]


def stiffness_from(
    reflection: ArrayLike, frequency: ArrayLike | str, impedances: ArrayLike
) -> Any:
    """Stiffness [Pa/m] of a contact with a measured reflection coefficient; `reflection` backwards.

    Raises
    ------
    InputError, OutOfRangeError
        For reflections of 1 and above, or at most that of bodies without an interface,
        |z1 - z2|/(z1 + z2).

    Examples
    --------
    >>> from mbma_tables.effects.ultrasound import impedance, stiffness_from
    >>> f"{stiffness_from(0.9, '5 MHz', impedance(207.0, 0.3, 7870.0)):.3g} Pa/m"
    '3.56e+14 Pa/m'
    """
    R = finite_array("reflection", reflection)
    first, second = _impedances(impedances)
    least = np.abs(first - second) / (first + second)
    require("reflection", R, (least < R) & (R < 1), "above |z1 - z2|/(z1 + z2), below 1")
    # both differences as products, which keep their digits near the ends
    lost = (1 - R) * (1 + R)
    total, apart = R * (first + second), np.abs(first - second)
    returned = (total - apart) * (total + apart)
    return (_angular(frequency) * first * second * np.sqrt(lost / returned))[()]


def _angular(frequency: Any) -> FloatArray:
    """Angular frequency [1/s] of a number in Hz or a text."""
    if isinstance(frequency, str):
        match = _FREQUENCY.fullmatch(frequency)
        if match is None:
            raise InputError(f"frequency must be such as '5 MHz', got {frequency!r}")
        frequency = float(match[1]) * HERTZ[f"{match[2] or ''}Hz"]
    return 2 * math.pi * positive_array("frequency", frequency)


def _impedances(given: Any) -> tuple[FloatArray, FloatArray]:
    """Impedances of both bodies."""
    z = positive_array("impedances", given)
    if z.ndim == 0:
        return z, z
    if z.shape[0] != 2:
        raise InputError(
            f"impedances are one, or that of each body on a first axis, got shape {z.shape}"
        )
    return z[0], z[1]


def _stiffness(given: Any) -> FloatArray:
    """A stiffness in Pa/m."""
    if not isinstance(given, Contact):
        return positive_array("stiffness", given)
    units = given.unit_system
    if units.length is None or units.stress is None:
        raise InputError(
            "the contact's stiffness has no unit: write units to the surface and the modulus"
        )
    of_stress = factor(units.stress, "Pa", kind="stress")
    in_pascals = of_stress / factor(units.length, "m")
    return np.asarray(given.quantity("unloading_stiffness") * in_pascals, float)
