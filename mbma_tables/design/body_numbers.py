"""The numbers of bodies and of a gas between them, and the bodies of others: what derivatives are taken by."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from mbma_tables.bodies.bodies import Bodies, BodiesInUnits, mean_conductivity
from mbma_tables.bodies.materials import effective_modulus
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.units import HEAT_CONDUCTANCE, Units, factor
from mbma_tables.contacts.quantities.gas import VACUUM
from mbma_tables.contacts.quantities.interface import Gas, Interface

PARTS = ("part_a", "part_b")
MODULI = tuple(f"{part}.E" for part in PARTS)
POISSONS_RATIOS = tuple(f"{part}.nu" for part in PARTS)
CONDUCTIVITIES = tuple(f"{part}.conductivity" for part in PARTS)
#: numbers of a gas by their names among its attributes
OF_GAS = {
    "temperature": "temperature",
    "gas_pressure": "pascals",
    "accommodation": "accommodation",
}
SAME_MODULUS = 1e-9  # relative: a modulus that was computed from those of the bodies


@dataclasses.dataclass(frozen=True)
class BodyNumbers:
    """Numbers of bodies and of what is between them, by name."""

    bodies: BodiesInUnits
    interface: Interface
    numbers: Mapping[str, Any]
    units: Mapping[str, str]  # of those that have no unit of length or stress alone
    metre: float  # conductivities over one of this package's, in the unit of length

    @classmethod
    def of(
        cls, bodies: BodiesInUnits, interface: Interface, gas_is_named: bool = True
    ) -> BodyNumbers:
        """Those of bodies as they were described; a gas that was given by its name has none."""
        numbers: dict[str, Any] = {}
        numbers |= _moduli(bodies)
        if bodies.yields:
            numbers["hardness"] = bodies.hardness
        if bodies.adhesion is not None:
            numbers |= {"work": bodies.adhesion.work, "range": bodies.adhesion.range}
        conductivities, unit, metre = _conductivities(bodies)
        numbers |= conductivities
        units = dict.fromkeys(conductivities, unit)
        gas = interface.gas
        if not gas_is_named and gas is not None and gas.name != VACUUM:
            given = {name: getattr(gas, own) for name, own in OF_GAS.items()}
            numbers |= {
                name: number for name, number in given.items() if number is not None
            }
        units |= {"temperature": "K", "gas_pressure": "Pa", "accommodation": "1"}
        units |= dict.fromkeys((*POISSONS_RATIOS, "nu"), "1")
        units["work"] = f"{bodies.units.stress} {bodies.units.length}"
        return cls(bodies, interface, numbers, units, metre)

    def of_columns(
        self, columns: Mapping[str, FloatArray]
    ) -> tuple[BodiesInUnits, Interface]:
        """The bodies of other numbers, and what is between them."""
        moved = dataclasses.replace(
            self.bodies,
            E_star=self._modulus(columns),
            hardness=columns.get("hardness", np.inf),
            k_s=self._conductivity(columns),
            adhesion=self._adhesion(columns),
        )
        gas = self.interface.gas
        if "temperature" not in columns or gas is None:
            return moved, self.interface
        other = Gas(
            gas.name,
            columns["temperature"],
            columns["gas_pressure"],
            columns.get("accommodation"),
        )
        return moved, dataclasses.replace(self.interface, gas=other)

    def moved(self, given: Mapping[str, Any]) -> BodyNumbers:
        """Those of other numbers."""
        numbers = {name: given[name] for name in self.numbers}
        bodies, interface = self.of_columns(numbers)
        moved = dataclasses.replace(
            self, bodies=bodies, interface=interface, numbers=numbers
        )
        changed = [
            name
            for name in (*MODULI, *POISSONS_RATIOS, "nu")
            if name in numbers and not np.array_equal(numbers[name], self.numbers[name])
        ]
        # arrays of these do not reach the ratio of stiffnesses
        if not changed or np.ndim(numbers[changed[0]]):
            return moved
        value = float(numbers[changed[0]])
        with_ratio = moved.with_ratio(bodies, changed[0], value)
        return dataclasses.replace(moved, bodies=with_ratio)

    def with_ratio(self, bodies: BodiesInUnits, name: str, value: float) -> BodiesInUnits:
        """Bodies with another Young's modulus or Poisson's ratio, and the same effective modulus."""
        own = bodies.bodies
        nu = own.nu
        E = None
        if MODULI[0] in self.numbers:
            changed = {**self.numbers, name: value}
            E = tuple(changed[each] for each in MODULI)
            nu = tuple(changed[each] for each in POISSONS_RATIOS)
        elif name == "nu":
            nu = value
        E_star = 1.0 if E is None else None
        sheared = Bodies(
            E_star,
            E=E,
            nu=nu,
            hardness=own.hardness,
            conductivity=own.conductivity,
        )
        return dataclasses.replace(bodies, bodies=sheared)

    def _adhesion(self, columns: Mapping[str, FloatArray]) -> Any:
        adhesion = self.bodies.adhesion
        if adhesion is None:
            return None
        return dataclasses.replace(adhesion, work=columns["work"], range=columns["range"])

    def _modulus(self, columns: Mapping[str, FloatArray]) -> Any:
        if MODULI[0] not in columns:
            return columns.get("E_star", self.bodies.E_star)
        E_a, E_b = (columns[name] for name in MODULI)
        nu_a, nu_b = (columns[name] for name in POISSONS_RATIOS)
        return effective_modulus(E_a, nu_a, E_b, nu_b)

    def _conductivity(self, columns: Mapping[str, FloatArray]) -> Any:
        if "conductivity" in columns:
            return columns["conductivity"] * self.metre
        if CONDUCTIVITIES[0] in columns:
            k_a, k_b = (columns[name] for name in CONDUCTIVITIES)
            return mean_conductivity(k_a, k_b) * self.metre
        return None


def _moduli(bodies: BodiesInUnits) -> dict[str, Any]:
    """Young's moduli and Poisson's ratios of both bodies where the modulus is theirs, else the effective one."""
    E = bodies.bodies.E
    nu = bodies.bodies.nu
    stress = bodies.units.stress
    # without a modulus all stresses are over it
    effective = {} if stress == "1" else {"E_star": bodies.E_star}
    if E is not None:
        unit = "GPa" if bodies.pair is not None else None
        units = Units(stress=stress)
        each = [
            units.number("E_star", f"{one!r} {unit}" if unit and units.stress else one)
            for one in E
        ]
        own = {**dict(zip(MODULI, each, strict=True))}
        own |= dict(zip(POISSONS_RATIOS, map(float, nu), strict=True))
        modulus = effective_modulus(each[0], nu[0], each[1], nu[1])
        if np.allclose(modulus, bodies.E_star, rtol=SAME_MODULUS, atol=0):
            return own
        return effective
    if nu is not None and np.ndim(nu) == 0:
        return {**effective, "nu": float(nu)}
    return effective


def _conductivities(bodies: BodiesInUnits) -> tuple[dict[str, Any], str, float]:
    """Conductivities of the bodies as they were typed, their unit, and the unit of length over theirs."""
    if bodies.conductivity_if_known is None:
        return {}, "1", 1.0
    given = bodies.bodies.conductivity
    names = CONDUCTIVITIES if isinstance(given, tuple | list) else ("conductivity",)
    each = given if isinstance(given, tuple | list) else (given,)
    numbers, unit = bodies.units.conductivities(*each)
    unit_of_number = "conductivity"
    metre = 1.0
    if bodies.conductivity_has_unit:
        is_heat = unit == HEAT_CONDUCTANCE.unit(bodies.units)
        unit_of_number = "W/(m K)" if is_heat else "S/m"
        metre = factor("m", str(bodies.units.length))
    values = [np.asarray(number, dtype=float)[()] / metre for number in numbers]
    return dict(zip(names, values, strict=True)), unit_of_number, metre
