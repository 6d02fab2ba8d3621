"""Separations of a contact: of the rigid plane, of the mean planes, and the mean gap."""

from typing import Any

from mbma_tables.common.units import Dimension
from mbma_tables.contacts.quantities.declaration import of_yielding_contacts, quantity
from mbma_tables.contacts.quantities.state import State

LENGTH = Dimension(length=1)


@quantity(
    LENGTH,
    "mean gap u = (h_max + d)/2",
    uncertainty="separation_scatter",
    error_sign=-1,
    similarity=(1, 0),
)
def mean_separation(contact: State) -> Any:
    """Mean separation u = (h_max + d)/2 (50) [length]: the mean gap, with yielded points flattened."""
    return contact.answered("mean_separation")


@quantity(
    LENGTH,
    "d, rigid plane to mid-plane",
    similarity=(1, 0),
)
def separation(contact: State) -> Any:
    """Separation d between the rigid plane and the mid-plane [length]."""
    return contact.answered("separation")


@quantity(
    LENGTH,
    "gap between mean planes",
    is_listed=of_yielding_contacts,
    is_column=False,
)
def plane_separation(contact: State) -> Any:
    """Gap between the mean planes [length]: u less the flattening of yielded points."""
    if not contact.yields:
        return contact.mean_separation
    return contact.of_loading("plane_separation")
