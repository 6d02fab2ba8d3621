"""Errors and model uncertainties of a contact, and whether it is of a kind that was tested."""

from typing import Any

import numpy as np

from mbma_tables.common.units import Dimension
from mbma_tables.contacts.quantities.declaration import (
    DIMENSIONLESS,
    on_request,
    quantity,
)
from mbma_tables.contacts.quantities.state import State


def scatter_of_theory(contact: State, quantity_of_theory: str) -> Any:
    """Standard deviation of ln of a quantity of the theory against simulations, at the contact area."""
    more = {"area": contact.area}
    return contact.evaluate(
        lambda theory, surface, u, E_star, area: (
            theory.scatter(surface, quantity_of_theory, area),
        ),
        1,
        more,
    )[0]


@quantity(DIMENSIONLESS, "bound on the relative numerical error against the theory")
def error(contact: State) -> Any:
    """Bound on the relative numerical error of pressure and area against the theory; NaN where not known."""
    return contact.answered("error")


@quantity(
    DIMENSIONLESS, "model uncertainty: standard deviation of ln F at this mean separation"
)
def scatter(contact: State) -> Any:
    """Model uncertainty, one standard deviation of ln F at this mean separation; NaN if unknown."""
    return scatter_of_theory(contact, "pressure")


@quantity(
    DIMENSIONLESS,
    "model uncertainty: standard deviation of ln A at this pressure",
    spread_of_process="area",
)
def area_scatter(contact: State) -> Any:
    """Model uncertainty, one standard deviation of ln A at this pressure."""
    return scatter_of_theory(contact, "area")


@quantity(
    DIMENSIONLESS,
    "model uncertainty: standard deviation of ln of the loading stiffness at this pressure",
    is_column=False,
    spread_of_process="stiffness",
)
def stiffness_scatter(contact: State) -> Any:
    """Model uncertainty, one standard deviation of ln `stiffness` at this pressure.

    NaN where a hardness is given that anything reaches: the slope of the loading curve of contacts that yield was
    not compared with simulations; `unloading_stiffness_scatter` is that of their unloading
    stiffness.
    """
    return scatter_of_theory(contact, "stiffness")


@quantity(
    DIMENSIONLESS,
    "model uncertainty: standard deviation of ln of the unloading stiffness at this pressure",
    is_column=False,
    spread_of_process="stiffness",
)
def unloading_stiffness_scatter(contact: State) -> Any:
    """Model uncertainty, one standard deviation of ln `unloading_stiffness` at this pressure.

    Also of the solid conductance and of the tangential stiffness, which are proportional to it.
    Without a hardness both stiffnesses are the same, and so are their uncertainties.
    """
    is_its_own = contact.yields or contact.bodies.adhesion is not None
    return scatter_of_theory(
        contact, "unloading_stiffness" if is_its_own else "stiffness"
    )


@quantity(
    Dimension(length=1),
    "model uncertainty: standard deviation of the mean separation at this pressure",
    is_column=False,
    spread_of_process="gap",
)
def separation_scatter(contact: State) -> Any:
    """Model uncertainty of the mean separation at this pressure [length], `scatter` times F/(-dF/du)."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return (
            contact.scatter * contact.answer.pressure / np.abs(contact.answer.stiffness)
        )


@quantity(
    DIMENSIONLESS,
    "model uncertainty: standard deviation of ln of the energy that unloading gives back",
    is_column=False,
    is_listed=on_request,
)
def energy_scatter(contact: State) -> Any:
    """Model uncertainty, one standard deviation of ln `energy`: with a hardness that at this pressure, else `scatter`."""
    if not contact.yields:
        return contact.scatter
    return scatter_of_theory(contact.unloading(), "energy")


@quantity(DIMENSIONLESS, "whether the theory was tested for such contacts")
def valid(contact: State) -> Any:
    """Whether the theory was tested for such contacts; if not, `reasons` gives where and why."""
    return contact.is_valid()
