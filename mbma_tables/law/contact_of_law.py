"""The contact that a law gives at separations or pressures, by the law's polynomials where it has them."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbma_tables.common.errors import InputError
from mbma_tables.contacts.result import Contact


class LawContact(Contact):
    """A contact whose pressure, area, stiffnesses and energy are those of a law; made by `ContactLaw.at`."""

    _law: Any

    @classmethod
    def of(
        cls, law: Any, mean_separation: Any, separation: Any, pressure: Any
    ) -> LawContact:
        """The contact of a law at one of the three."""
        candidates = {
            "mean_separation": mean_separation,
            "separation": separation,
            "pressure": pressure,
        }
        names = [name for name, value in candidates.items() if value is not None]
        if len(names) != 1:
            raise InputError(
                "give the mean separation, separation= or pressure=, one of them"
            )
        value = law.units.number(names[0], candidates[names[0]])
        if names[0] == "pressure":
            d, u, area, stiffness, pressures = law.at_pressure(value)
            values = {
                "separation": d,
                "mean_separation": u,
                "area": area,
                "stiffness": stiffness,
            }
            return cls._made(law, values | {"pressure": pressures})
        u = value if names[0] == "mean_separation" else (law.h_max + value) / 2
        d = value if names[0] == "separation" else 2 * value - law.h_max
        pressures, area, stiffness, energy = law.values(separation=d)
        values = {
            "separation": d,
            "mean_separation": u,
            "area": area,
            "stiffness": stiffness,
        }
        values |= {"pressure": pressures}
        if law.elastic is None:
            values["energy"] = energy
        return cls._made(law, values)

    @classmethod
    def _made(cls, law: Any, values: dict[str, Any]) -> LawContact:
        values["error"] = law.error + 0.0 * values["area"]
        contact = cls(law.setup, values)
        contact.describe({})
        contact._law = law
        return contact

    def quantity(self, name: str) -> Any:
        """A quantity by its name; the unloading stiffness is the law's."""
        if name == "unloading_stiffness" and name not in self._values:
            stiffness = self._law.unloading_stiffness(separation=self.separation)
            self._values[name] = self._described(name, stiffness)
        return super().quantity(name)

    def pressure_at(self, mean_separation: Any) -> Any:
        """The law's pressure."""
        return self._law.pressure(mean_separation)

    def energy_at(self, mean_separation: Any) -> Any:
        """The law's energy."""
        return self._law.energy(mean_separation)

    def separation_at(self, pressure: Any) -> Any:
        """The law's mean separation at a pressure."""
        return self._law.at_pressure(pressure).mean_separation

    @property
    def last_contact(self) -> float:
        """Mean separation of last contact; infinite where the law has none."""
        return float(self._law.h_max) if np.isinf(self._law.highest) else np.inf
