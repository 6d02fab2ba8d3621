"""Quantities as functions of an exported law: ratios to a slope, curves, or both."""

import math

from mbma_tables.common.errors import InputError
from mbma_tables.contacts.law.law import ContactLaw
from mbma_tables.contacts.quantities import registry
from mbma_tables.export.code.curves import Curve, Quantity, curve_of_flow, curve_of_gas
from mbma_tables.export.code.language import Function
from mbma_tables.export.exported_law import ExportedLaw, GasInGaps
from mbma_tables.export.text import bound


class Functions:
    """The functions of a file, with the laws and curves that they are made of."""

    def __init__(self, exported: ExportedLaw) -> None:
        self.exported = exported
        self.laws: dict[str, ContactLaw] = {"law": exported.law}
        self.functions: dict[str, Function] = {}
        self.curves: dict[str, Curve] = {}
        self._notes: dict[str, str] = {}

    def notes(self) -> tuple[str, ...]:
        """Lines of a header on errors and ranges."""
        return tuple(self._notes.values())

    def add_ratio(self, name: str, ratio: float, unit: str) -> None:
        """A quantity that is a ratio times the stiffness of a small unloading."""
        if math.isfinite(self.exported.law.largest_before):
            raise InputError(
                f"{name} as a function of the gap jumps at the largest pressure: leave it "
                "out, or write rows"
            )
        sloped, factor = self.exported.law.unloading()
        self._add_slope(name, factor * ratio, unit, sloped)

    def _add_slope(self, name: str, ratio: float, unit: str, of: ContactLaw) -> None:
        key = "law" if of is self.exported.law else "elastic"
        self.laws[key] = of
        meaning = registry.get(name).meaning
        self.functions[name] = Function(unit, meaning, ratio=ratio, law=key)

    def add_gas(self, gas: GasInGaps) -> None:
        """The conductance of a gas, and that of solid spots and gas."""
        solid = self.functions["solid_conductance"]
        self._add_curve(
            "gas_conductance",
            solid.unit,
            curve_of_gas(self.exported, gas),
            "is within {error} of the theory's, relative to it, or to that at first "
            "contact where that is larger",
        )
        meaning = registry.get("total_conductance").meaning
        self.functions["total_conductance"] = Function(
            solid.unit, meaning, solid.ratio, solid.law, "gas_conductance"
        )

    def _add_curve(
        self, name: str, unit: str, curve: Curve, note: str, meaning: str = ""
    ) -> None:
        self.curves[name] = curve
        self.functions[name] = Function(
            unit, meaning or registry.get(name).meaning, curve=name
        )
        if note:
            self._notes[name] = f"{name} {note.format(error=bound(curve.error))}"

    def add_flow(self) -> None:
        """The flow coefficient of the gaps, on which the header has lines of its own."""
        unit = f"{self.exported.length}^3"
        curve = curve_of_flow(self.exported)
        meaning = registry.get("flow_coefficient").meaning
        self._add_curve("leakage", unit, curve, "", meaning)

    def add(self, name: str) -> None:
        """Any quantity of the registry, unless it is there."""
        if name in self.functions:
            return
        quantity = Quantity(self.exported, name)
        for law in dict.fromkeys((self.exported.law, self.exported.law.unloading()[0])):
            if ratio := quantity.over_slope(law):
                self._add_slope(name, ratio, quantity.unit, law)
                return
        end = f" up to c = {quantity.end:.17g}" if math.isfinite(quantity.end) else ""
        self._add_curve(
            name,
            quantity.unit,
            quantity.curve(),
            "is within {error} of the contact's, relative to it, from "
            f"c = {quantity.c[0]:.4g} on{end}",
        )
