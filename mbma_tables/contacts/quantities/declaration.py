"""The declaration of a quantity of contacts: its unit, its meaning, what it needs, and its function."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from mbma_tables.common.errors import MissingError
from mbma_tables.common.units import Dimension, Units
from mbma_tables.contacts.quantities.state import Need, State

DIMENSIONLESS = Dimension()


def of_all_contacts(state: State) -> bool:
    """Whether a quantity is listed: of every contact."""
    return True


def on_request(state: State) -> bool:
    """Whether a quantity is listed: of no contact."""
    return False


def of_yielding_contacts(state: State) -> bool:
    """Whether a quantity is listed: of contacts with a hardness, since others have it under another name or as 0."""
    return state.yields


def of_elastic_contacts(state: State) -> bool:
    """Whether a quantity is listed: of contacts without a hardness, since others take several answers for it."""
    return not state.yields


class LawFunction(NamedTuple):
    """The function of a quantity that every law as code has."""

    name: str
    core: str  # of the `mbma_quantity` of core/mbma.h that it is
    meaning: str = ""  # along loading; that of the quantity where it is empty


@dataclasses.dataclass(frozen=True)
class Quantity:
    """Declaration of a quantity, all that anyone who shows it needs to know."""

    name: str
    dimension: Dimension
    meaning: str  # one phrase, for attributes of datasets, help texts, and tooltips
    notes: str  # docstring of the function that computes it
    compute: Callable[[State], Any]
    needs: tuple[Need, ...] = ()
    #: names of the quantities that it is computed from, whose needs are needs of its own
    made_of: tuple[str, ...] = ()
    #: name of the quantity that holds its model uncertainty, None where it has none of its own
    uncertainty: str | None = None
    #: sign of the model's error at a pressure where that of the area is positive; 0 where its
    #: uncertainty is not one at a pressure
    error_sign: int = 1
    is_column: bool = True  # whether tables in a terminal have it
    # whether datasets and tables have it without being asked: not where it takes a further
    # simulation, nor of contacts of which it says nothing new
    is_listed: Callable[[State], bool] = of_all_contacts
    unit_of_state: Callable[[State], str] | None = (
        None  # where the unit depends on what the user gave
    )
    #: abscissa of its rows in files for other programs
    against: str = "pressure"
    #: quantity of a law that such rows follow from, by a factor or a power, and the
    #: conductance of a gas beside it; empty where they are those of contacts
    follows: str = ""
    #: its further name in such files
    name_in_files: str = ""
    law_function: LawFunction | None = None
    #: of a model uncertainty: the kind of the spread that faces of a process have beside it
    spread_of_process: str = ""
    #: powers of factors of heights and lengths by which it is larger where both of a map,
    #: and the modulus by their ratio, are: a contact similar to that of the map
    similarity: tuple[int, int] | None = None

    @property
    def is_result(self) -> bool:
        """Whether pictures and sensitivities have it without being asked: columns with a model uncertainty."""
        return self.is_column and self.uncertainty is not None

    def missing(self, state: State) -> list[Need]:
        """What it needs and was not given, for itself or for the quantities that it is made of."""
        missing = [need for need in self.needs if not need.is_given(state)]
        for name in self.made_of:
            missing += [need for need in state.missing(name) if need not in missing]
        return missing

    def is_available(self, state: State) -> bool:
        """Whether a contact has it: all it needs is given."""
        return not state.missing(self.name)

    def is_shown(self, state: State) -> bool:
        """Whether a contact shows it without being asked."""
        return self.is_available(state) and self.is_listed(state)

    def require_given(self, state: State) -> None:
        """Raise an error that names what is missing, where anything is."""
        if missing := state.missing(self.name):
            remedies = "; ".join(dict.fromkeys(need.remedy for need in missing))
            names = " and ".join(need.name for need in missing)
            raise MissingError(f"{self.name} needs {names}, which is missing: {remedies}")

    def of(self, state: State) -> Any:
        """Its value, or an error that names what is missing."""
        self.require_given(state)
        # ratios may be infinite or undefined where bodies do not touch
        with np.errstate(divide="ignore", invalid="ignore"):
            return self.compute(state)

    def unit(self, state: State) -> str:
        """Its unit in a contact."""
        if self.unit_of_state is not None and self.is_available(state):
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
