"""A quantity that someone adds: one file in which it is declared."""

from mbma_tables.common.units import Dimension
from mbma_tables.quantities.conductances import CONDUCTIVITY
from mbma_tables.quantities.registry import quantity

HEAT_CAPACITY = 3.7e6  # of a layer, per volume [J/(m^3 K)]
THICKNESS = 1e-3  # [m]


@quantity(
    Dimension(time=1),
    "time in which a layer of 1 mm reaches the other body's temperature",
    needs=(CONDUCTIVITY,),
    uncertainty="solid_conductance_scatter",
)
def thermal_time(contact):
    """Heat capacity of the layer over the conductance [s]."""
    return HEAT_CAPACITY * THICKNESS / contact.solid_conductance
