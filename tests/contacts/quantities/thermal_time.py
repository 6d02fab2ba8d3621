"""Quantities that someone adds: one file in which they are declared."""

from mbma_tables.common.units import Dimension
from mbma_tables.contacts.quantities.declaration import quantity

HEAT_CAPACITY = 3.7e6  # of a layer, per volume [J/(m^3 K)]
THICKNESS = 1e-3  # [m]


@quantity(
    Dimension(time=1),
    "time in which a layer of 1 mm reaches the other body's temperature",
    made_of=("solid_conductance",),
    uncertainty="solid_conductance_scatter",
)
def thermal_time(contact):
    """Heat capacity of the layer over the conductance [s]."""
    return HEAT_CAPACITY * THICKNESS / contact.solid_conductance


@quantity(
    Dimension(length=1),
    "elastic energy over pressure",
    made_of=("energy",),
    is_column=False,
)
def energy_depth(contact):
    """Elastic energy over pressure [length]; of elastic contacts."""
    return contact.energy / contact.pressure
