"""Pressure, contact area, and how far a contact yields."""

from typing import Any

import numpy as np

from mbma_tables.bodies.materials import ELASTIC_PSI
from mbma_tables.common.units import Dimension
from mbma_tables.contacts.quantities.declaration import (
    DIMENSIONLESS,
    LawFunction,
    of_yielding_contacts,
    quantity,
)
from mbma_tables.contacts.quantities.state import State

STRESS = Dimension(stress=1)


def _in_shape(contact: State, value: Any) -> Any:
    """What depends on surface and bodies alone: one number where they are one, else in the shape of the contact."""
    return 0.0 * contact.mean_separation + value if np.ndim(value) else value[()]


@quantity(
    STRESS,
    "force over nominal area",
    uncertainty="scatter",
    error_sign=0,
    against="overclosure",
    follows="pressure",
    law_function=LawFunction("pressure", "MBMA_FORCE"),
    similarity=(0, 0),
)
def pressure(contact: State) -> Any:
    """F/A0 in the unit of E*; F/(A0 E*) where that is 1."""
    return contact.answered("pressure")


@quantity(
    DIMENSIONLESS,
    "real over nominal contact area",
    uncertainty="area_scatter",
    law_function=LawFunction("area", "MBMA_AREA"),
    similarity=(0, 0),
)
def area(contact: State) -> Any:
    """A/A0; that of MBMA does not end at 1 under full compression, and is not clamped."""
    return contact.answered("area")


@quantity(
    STRESS,
    "mean pressure in the contact",
    uncertainty="area_scatter",
    error_sign=-1,
    is_column=False,
    similarity=(0, 0),
)
def mean_pressure(contact: State) -> Any:
    """Mean pressure in the contact, F/A [stress]; NaN where there is none."""
    with np.errstate(invalid="ignore"):
        return contact.pressure / contact.area


@quantity(
    DIMENSIONLESS,
    "share of the contact area at the hardness",
    is_listed=of_yielding_contacts,
)
def yielded(contact: State) -> Any:
    """Share of the contact area at the hardness, 0 to 1."""
    if not contact.yields:
        return 0.0 * contact.mean_separation
    return contact.of_loading("yielded")


@quantity(
    DIMENSIONLESS,
    "plasticity index E* g/p_m",
    is_column=False,
    is_listed=of_yielding_contacts,
)
def psi(contact: State) -> Any:
    """Plasticity index E* g/p_m, g the rms gradient; 0 where the hardness is infinite."""
    index = contact.E_star * contact.surface.rms_gradient / contact.bodies.hardness
    return _in_shape(contact, index)


@quantity(STRESS, "hardness above which the elastic area is within 5%", is_column=False)
def elastic_hardness(contact: State) -> Any:
    """Hardness above which the elastic area is within 5%, E* g/1.1 [stress]."""
    return _in_shape(contact, contact.E_star * contact.surface.rms_gradient / ELASTIC_PSI)
