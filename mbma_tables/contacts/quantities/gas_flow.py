"""Flow of a gas through narrow gaps, from continuum to free molecules; docs/leakage.md has the equations.

The mass that flows between parallel plates at a distance h is h^2 p Q(D)/(2 R_s T c) times
the pressure gradient, c = sqrt(2 R_s T), with the inverse Knudsen number D = p h/(viscosity
c). Q is that of the linearised Boltzmann equation with diffuse reflection: D/6 in a
continuum, plus 1.0162 with slip, and -ln(D)/sqrt(pi) of free molecules.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import (
    FloatArray,
    nearest,
    positive_array,
    require,
)
from mbma_tables.common.errors import InputError
from mbma_tables.contacts.quantities.gas import GASES, TEMPERATURES, R

# Poiseuille flow of a rarefied gas, terms c D^n of Q by powers n, and the least D of each
# row: S. Fukui, R. Kaneko, J. Tribology 112 (1990) 78; within 1% of the solved equation
PIECES = (
    (5.0, {1: 1 / 6, 0: 1.0162, -1: 1.0653, -2: -2.1354}),
    (0.15, {1: 0.13852, 0: 1.25087, -1: 0.15653, -2: -0.00969}),
    (0.01, {1: -2.22919, 0: 2.10673, -1: 0.01653, -2: -0.0000694}),
)
# gap of parallel plates whose gas flow is in the same proportion to that of a liquid as the
# contact's: K^(1/3) (1 + WIDER (A/A0)^POWER), fitted to Reynolds' equation on simulated gaps
WIDER = 1.12
POWER = 0.76
# contact fractions, and root mean squares of ln(flow/simulation) that this adds, at the
# worst of all mean free paths, on surfaces that no fit saw
AREAS = (0.03, 0.1, 0.18, 0.26, 0.36)
ERRORS = (0.027, 0.050, 0.069, 0.070, 0.16)
# kg/mol, and Pa s at `TEMPERATURES`; hydrogen and methane: Huber and Harvey, as in `gas`,
# which does not have them because their accommodation on machined metals was not found
FLOWING = {name: (one.mass, one.viscosity) for name, one in GASES.items()} | {
    "hydrogen": (2.01588e-3, (6.8e-6, 8.9e-6, 10.9e-6, 12.8e-6, 14.5e-6)),
    "methane": (16.0425e-3, (7.7e-6, 11.1e-6, 14.2e-6, 17.0e-6, 19.4e-6)),
}
STANDARD = 273.15 / 101325.0  # K/Pa, of standard volumes
MASS_UNITS = {"kg/s": 1.0, "g/s": 1e3, "mg/s": 1e6, "g/h": 3.6e6, "mg/h": 3.6e9}
# pressure times volume at the temperature of the gas, over Pa m^3
VOLUME_UNITS = {"Pa m^3/s": 1.0, "mbar l/s": 10.0}
STANDARD_UNITS = {"sccm": 6e7}  # standard cm^3 a minute: 0 deg C and 1 atm
RATE_UNITS = (*MASS_UNITS, *VOLUME_UNITS, *STANDARD_UNITS)


class GasFlow(NamedTuple):
    """What flow needs of a gas at its temperature."""

    mass: FloatArray  # kg/mol
    viscosity: FloatArray  # Pa s
    temperature: FloatArray  # K

    @property
    def speed(self) -> FloatArray:
        """sqrt(2 R_s T) [m/s]."""
        return np.asarray(np.sqrt(2 * R * self.temperature / self.mass))

    def mean_free_path(self, pressure: ArrayLike) -> FloatArray:
        """viscosity sqrt(pi R_s T/2)/p [m]."""
        return np.asarray(
            self.viscosity * self.speed * math.sqrt(math.pi) / 2 / np.asarray(pressure)
        )

    def in_unit(self, unit: str) -> FloatArray:
        """Factor from kg/s to a unit of leak rates."""
        if unit in MASS_UNITS:
            return np.asarray(MASS_UNITS[unit])
        moles = R / self.mass
        if unit in VOLUME_UNITS:
            return VOLUME_UNITS[unit] * moles * self.temperature
        if unit in STANDARD_UNITS:
            return STANDARD_UNITS[unit] * moles * STANDARD
        raise InputError(
            f"no unit of leak rates is {unit!r}: {nearest(unit, RATE_UNITS)}"
        )


def gas_for_flow(gas: str | Mapping[str, Any], temperature: ArrayLike) -> GasFlow:
    """A gas by its name, or by its "mass" [kg/mol] and "viscosity" [Pa s], at a temperature [K]."""
    T = positive_array("temperature", temperature)
    if isinstance(gas, Mapping):
        if set(gas) != {"mass", "viscosity"}:
            raise InputError(
                f"a gas by its own numbers has 'mass' and 'viscosity', got {sorted(gas)}"
            )
        mass, viscosity = (
            positive_array(name, gas[name]) for name in ("mass", "viscosity")
        )
        return GasFlow(mass, viscosity, T)
    if not isinstance(gas, str) or gas not in FLOWING:
        raise InputError(f"no gas is named {gas!r}: {nearest(str(gas), [*FLOWING])}")
    low, high = TEMPERATURES[0], TEMPERATURES[-1]
    require("temperature", T, (low <= T) & (high >= T), f"from {low:g} to {high:g} K")
    of_gas, row = FLOWING[gas]
    viscosity = np.exp(np.interp(np.log(T), np.log(TEMPERATURES), np.log(row)))
    return GasFlow(np.asarray(of_gas), viscosity, T)


def _terms(D: FloatArray, terms: Mapping[int, float]) -> FloatArray:
    return np.asarray(sum(c * D**n for n, c in terms.items()))


def _integral_of_terms(D: FloatArray, terms: Mapping[int, float]) -> FloatArray:
    return np.asarray(
        sum(
            c * (np.log(D) if n == -1 else D ** (n + 1) / (n + 1))
            for n, c in terms.items()
        )
    )


def poiseuille(D: ArrayLike) -> FloatArray:
    """Q at inverse Knudsen numbers D > 0.

    Examples
    --------
    >>> poiseuille([0.01, 1.0, 100.0]).round(2).tolist()
    [3.04, 1.54, 17.69]
    """
    given = np.asarray(D, float)
    least, terms = PIECES[-1]
    molecular = _terms(np.asarray(least), terms) - np.log(given / least) / math.sqrt(
        math.pi
    )
    return np.asarray(
        np.select(
            [given >= low for low, _ in PIECES],
            [_terms(given, terms) for _, terms in PIECES],
            molecular,
        )
    )


def poiseuille_integral(D: ArrayLike) -> FloatArray:
    """Integral of Q from 0 to D >= 0."""
    given = np.asarray(D, float)
    least, terms = PIECES[-1]
    at_least = float(_terms(np.asarray(least), terms))
    small = np.clip(given, np.finfo(float).tiny, least)
    # -ln(D/least)/sqrt(pi), integrated
    found = small * (at_least + (1 - np.log(small / least)) / math.sqrt(math.pi))
    found = np.asarray(np.where(given > 0, found, 0.0))
    high = np.inf
    for low, terms in PIECES:
        inside = np.clip(given, low, high)
        found += _integral_of_terms(inside, terms) - _integral_of_terms(
            np.asarray(low), terms
        )
        high = low
    return found


def flow_over_liquid(D: ArrayLike) -> FloatArray:
    """6 Q/D, flow of a gas between plates over that of a liquid, at inverse Knudsen numbers D > 0.

    Examples
    --------
    >>> flow_over_liquid([0.1, 1.0, 100.0]).round(2).tolist()
    [122.53, 9.22, 1.06]
    """
    return np.asarray(6 * poiseuille(D) / np.asarray(D))


def width_of_channels(K: ArrayLike, area: ArrayLike) -> FloatArray:
    """Gap of parallel plates [length] through which a gas flows as through a contact, by K [length^3] and A/A0.

    Flow of a gas, over that of a liquid, is `flow_over_liquid` there.
    """
    share = np.asarray(area, float)
    return np.asarray(np.cbrt(K) * (1 + WIDER * share**POWER))


def gas_scatter(area: ArrayLike) -> FloatArray:
    """Standard deviation of ln(gas flow) against simulations of contacts whose K and A/A0 are known.

    Of lighter contacts than 3% that at 3%, which is larger; NaN above 42%.
    """
    share = np.asarray(area, float)
    found = np.interp(np.log(np.maximum(share, AREAS[0])), np.log(AREAS), ERRORS)
    return np.asarray(np.where(share <= 0.42, found, np.nan))


def mass_flow(
    K: FloatArray | float,
    area: FloatArray | float,
    gas: GasFlow,
    inlet: FloatArray | float,
    outlet: FloatArray | float,
    width: FloatArray | float,
) -> FloatArray:
    """Mass per time and length of seal [kg/(m s)] of a long seal by K [m^3], pressures [Pa] and its width [m].

    Integral of K f p dp/(12 viscosity R_s T width) from the outlet's pressure to the inlet's:
    pressure falls little over one wavelength of the roughness, so that f is that of the
    local pressure.
    """
    h = width_of_channels(K, area)
    with np.errstate(divide="ignore", invalid="ignore"):
        # pressure at which D = 1
        unit = gas.viscosity * gas.speed / h
        integral = poiseuille_integral(np.asarray(inlet) / unit) - poiseuille_integral(
            np.asarray(outlet) / unit
        )
        found = K * 6 * unit**2 * integral / (6 * gas.viscosity * gas.speed**2 * width)
    return np.asarray(np.where(np.asarray(K) == 0, 0.0, found))
