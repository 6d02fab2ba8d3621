"""The state of a contact: what quantities are computed from."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from mbma_tables.common.units import Units
from mbma_tables.contacts.quantities.interface import Interface
from mbma_tables.contacts.quantities.properties import ContactQuantities

if TYPE_CHECKING:
    from mbma_tables.bodies.bodies import BodiesInUnits
    from mbma_tables.surfaces.any_surface import AnySurface
    from mbma_tables.theories.base import Theory, TheoryAnswer


@dataclasses.dataclass(frozen=True)
class Need:
    """What a user must give for some quantities."""

    name: str  # such as "conductivity"
    is_given: Callable[[State], bool]
    remedy: str  # how to give it
    options: tuple[str, ...] = ()  # of a file for another program, which give it


class State(ContactQuantities, abc.ABC):
    """A contact as quantities see it: the question, the theory's answer, and the other quantities by name."""

    surface: AnySurface
    bodies: BodiesInUnits
    interface: Interface
    elastic_theory: Theory  # without the hardness

    @property
    def unit_system(self) -> Units:
        """The units of lengths and stresses."""
        return self.bodies.units

    @property
    def E_star(self) -> Any:
        """The effective modulus, in the unit of stresses."""
        return self.bodies.E_star

    @property
    def yields(self) -> bool:
        """Whether there is a hardness that is not infinite."""
        return self.bodies.yields

    @property
    @abc.abstractmethod
    def answer(self) -> TheoryAnswer:
        """The theory's answer at the mean separations of the contact, over E*."""

    @property
    @abc.abstractmethod
    def leakage(self) -> Any:
        """Flow through the gaps of the contact."""

    @abc.abstractmethod
    def answered(self, name: str) -> Any:
        """One of the quantities that contacts are made with, where this one was made without it."""

    @abc.abstractmethod
    def quantity(self, name: str) -> Any:
        """A quantity by its name, computed when it is first asked for."""

    @abc.abstractmethod
    def missing(self, name: str) -> list[Need]:
        """What a quantity needs and was not given."""

    @abc.abstractmethod
    def evaluate(
        self,
        function: Callable[..., tuple[Any, ...]],
        outputs: int = 1,
        more: Mapping[str, Any] | None = None,
    ) -> tuple[Any, ...]:
        """``function(theory, surface, mean_separation, E_star, *more)`` of plain arrays, for arrays of any kind."""

    @abc.abstractmethod
    def of_loading(self, name: str) -> Any:
        """A field of `theories.yielding.theory.Loaded`, of a contact that yields."""

    @abc.abstractmethod
    def theory_of(self, bodies: BodiesInUnits) -> Theory:
        """The theory for bodies, with their hardness where they have one."""

    @abc.abstractmethod
    def pressure_at(self, mean_separation: Any) -> Any:
        """Pressure of the same surface and bodies at other mean separations."""

    @abc.abstractmethod
    def energy_at(self, mean_separation: Any) -> Any:
        """Elastic energy at other mean separations."""

    @abc.abstractmethod
    def separation_at(self, pressure: Any) -> Any:
        """Mean separation at other pressures."""

    @property
    @abc.abstractmethod
    def last_contact(self) -> Any:
        """Mean separation of last contact; infinite where the theory has none."""

    @abc.abstractmethod
    def unloading(self) -> State:
        """The contact as it unloads from here; itself where nothing yields."""

    @abc.abstractmethod
    def is_valid(self) -> Any:
        """Where no reason against the contact applies."""
