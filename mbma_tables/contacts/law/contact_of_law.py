"""The contact that a law gives at one question, by the law's polynomials where it has them."""

from __future__ import annotations

from typing import Any

import numpy as np

from mbma_tables.common.arguments import is_labelled
from mbma_tables.contacts.question import Question
from mbma_tables.contacts.result import Contact

#: quantities beside those of the law's polynomials
OF_LAWS = ("error", "energy", "unloading_stiffness")


class LawContact(Contact):
    """A contact whose pressure, area, stiffnesses and energy are those of a law; made by `ContactLaw.at`."""

    _law: Any

    @classmethod
    def of(cls, law: Any, question: Question) -> LawContact:
        """The contact of a law at a gap, a pressure or an area."""
        if question.name == "pressure":
            values = law.values_at_pressures(question)
        else:
            gaps = question
            if not question.is_gap:
                gaps = Question("separation", law.separations_of(question))
            d, u = law.both_separations(gaps.name, gaps.value)
            names = ("pressure", "area", "stiffness")
            values = dict(zip(names, law.values_of(names, gaps), strict=True))
            values |= {"separation": d[()], "mean_separation": u[()]}
        contact = cls(law.setup, values)
        contact._law = law
        if is_labelled(question.value):
            contact.describe({})
        return contact

    def quantity(self, name: str) -> Any:
        """A quantity by its name; error, energy and unloading stiffness are the law's."""
        # a law has the work of loading, not the energy that a yielded contact gives back
        of_law = name in OF_LAWS and not (name == "energy" and self.yields)
        if of_law and name not in self._values:
            if name == "error":
                value = self._law.error + 0.0 * self.area
            else:
                value = getattr(self._law, name)(separation=self.separation)
            self._values[name] = self._described(name, value)
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
