"""The registry of quantities: each is declared once, and whatever shows quantities iterates over them.

A file of this folder declares a quantity, or a family that shares a formula, by decorating the
function that computes it from the state of a contact; `MODULES` lists these files. Contacts, laws,
joints, datasets and tables know of a quantity what its declaration has.
"""

from __future__ import annotations

import dataclasses
import functools
import importlib
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from mbma_tables.common import units as of_arguments
from mbma_tables.common.arguments import require_name
from mbma_tables.common.errors import MissingError
from mbma_tables.common.units import Dimension, Units

if TYPE_CHECKING:
    from mbma_tables.quantities.state import State

#: modules that declare quantities, in the order in which these are shown
MODULES = [
    "mbma_tables.quantities.separations",
    "mbma_tables.quantities.pressures",
    "mbma_tables.quantities.stiffnesses",
    "mbma_tables.quantities.conductances",
    "mbma_tables.quantities.leakage",
    "mbma_tables.quantities.uncertainty",
]
DIMENSIONLESS = Dimension()


@dataclasses.dataclass(frozen=True)
class Need:
    """What a user must give for some quantities."""

    name: str  # such as "conductivity"
    is_given: Callable[[State], bool]
    remedy: str  # how to give it


@dataclasses.dataclass(frozen=True)
class Quantity:
    """Declaration of a quantity, all that anyone who shows it needs to know."""

    name: str
    dimension: Dimension
    meaning: str  # one phrase, for attributes of datasets, help texts, and tooltips
    notes: str  # docstring of the function that computes it
    compute: Callable[[State], Any]
    needs: tuple[Need, ...] = ()
    applies: Callable[[State], bool] | None = (
        None  # whether it is shown of a contact; of all where it is None
    )
    #: name of the quantity that holds its model uncertainty, None where it has none of its own
    uncertainty: str | None = None
    #: curve of a law to which it is proportional, for the bodies of that law: rows and
    #: code write it as such
    ratio_to: str | None = None
    is_column: bool = True  # whether tables in a terminal have it
    # whether datasets have it without being asked, since it takes no further simulation
    is_listed: bool = True
    unit_of_state: Callable[[State], str] | None = (
        None  # where the unit depends on what the user gave
    )

    def missing(self, state: State) -> list[Need]:
        """What it needs and was not given."""
        return [need for need in self.needs if not need.is_given(state)]

    def is_available(self, state: State) -> bool:
        """Whether it can be shown of a contact: all it needs is given, and it applies."""
        return not self.missing(state) and (self.applies is None or self.applies(state))

    def of(self, state: State) -> Any:
        """Its value, or an error that names what is missing."""
        if missing := self.missing(state):
            remedies = "; ".join(need.remedy for need in missing)
            names = " and ".join(need.name for need in missing)
            raise MissingError(f"{self.name} needs {names}, which is missing: {remedies}")
        return self.compute(state)

    def unit(self, state: State) -> str:
        """Its unit in a contact."""
        if self.unit_of_state is not None and not self.missing(state):
            return self.unit_of_state(state)
        return self.dimension.unit(state.unit_system)

    def unit_in(self, units: Units) -> str:
        """Its unit beside lengths and stresses in `units`."""
        return self.dimension.unit(units)


def quantity(
    dimension: Dimension, meaning: str, **declared: Any
) -> Callable[[Callable[[State], Any]], Quantity]:
    """Decorator: declare the quantity that a function of the state of a contact computes, under the function's name."""

    def declare(compute: Callable[[State], Any]) -> Quantity:
        notes = compute.__doc__ or meaning
        return Quantity(compute.__name__, dimension, meaning, notes, compute, **declared)

    return declare


@functools.cache
def _declared_in(name: str) -> dict[str, Quantity]:
    """The quantities of one module, in their order."""
    module = importlib.import_module(name)
    return {
        value.name: value
        for value in vars(module).values()
        if isinstance(value, Quantity)
    }


def registry() -> Mapping[str, Quantity]:
    """All quantities by name."""
    quantities: dict[str, Quantity] = {}
    for module in MODULES:
        for name, declaration in _declared_in(module).items():
            if name in quantities:
                raise ValueError(
                    f"the quantity {name} is declared twice, the second time in {module}"
                )
            quantities[name] = declaration
    return quantities


def get(name: str) -> Quantity:
    """A quantity by its name; the error for an unknown one names the nearest."""
    require_name("quantity", name, registry())
    return registry()[name]


def unit_of(name: str, units: Units) -> str:
    """The unit of a quantity by its declaration, or of an argument, beside lengths and stresses in `units`."""
    if name in registry():
        return registry()[name].unit_in(units)
    return of_arguments.unit_of(name, units)
