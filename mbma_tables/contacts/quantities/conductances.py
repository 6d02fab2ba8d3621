"""Thermal and electrical conductance of a contact: of its solid spots, of the gas in its gaps, and of both."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import Numbers, answered
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import HEAT_CONDUCTANCE, factor
from mbma_tables.contacts.quantities.declaration import DIMENSIONLESS, quantity
from mbma_tables.contacts.quantities.gas import (
    GASES,
    VACUUM,
    exponent_of_gap,
    jump_of,
    mean_inverse,
    scatter_of_mean,
)
from mbma_tables.contacts.quantities.interface import Gas
from mbma_tables.contacts.quantities.state import Need, State
from mbma_tables.core import core


def _has_conductivity(contact: State) -> bool:
    return contact.bodies.conductivity_is_given


def _has_unit_of_conductance(contact: State) -> bool:
    """Whether lengths have a unit, which conductivities in units of their own need."""
    return (
        contact.unit_system.length is not None or not contact.bodies.conductivity_has_unit
    )


def _has_thermal_conductivity(contact: State) -> bool:
    """Whether the conductance of the solid spots, where there is one, has the unit of that of a gas."""
    if solid_conductance.missing(contact):
        return True
    return contact.bodies.conductivity[1] == HEAT_CONDUCTANCE.unit(contact.unit_system)


def _has_gas(contact: State) -> bool:
    return contact.interface.gas is not None


def _has_unit_of_length(contact: State) -> bool:
    return contact.unit_system.length is not None


CONDUCTIVITY = Need(
    "conductivity",
    _has_conductivity,
    "that of the bodies, Bodies(..., conductivity='45 W/(m K)'), or named metals",
    options=("conductivity", "conductivity_unit"),
)
UNIT_OF_CONDUCTANCE = Need(
    "a unit of length beside conductivities with theirs",
    _has_unit_of_conductance,
    "give the surface its unit",
)
THERMAL_CONDUCTIVITY = Need(
    "thermal conductivity with its unit",
    _has_thermal_conductivity,
    "that of the bodies, Bodies(..., conductivity='45 W/(m K)'), or named metals; "
    "give the surface its unit",
)
GAS = Need("gas", _has_gas, "that in the gaps, Joint(..., gas='air')")
UNIT_OF_LENGTH = Need(
    "the unit of lengths", _has_unit_of_length, "give the surface its unit"
)


@quantity(
    HEAT_CONDUCTANCE,
    "thermal conductance of solid spots and gas in parallel, per nominal area",
    needs=(THERMAL_CONDUCTIVITY,),
    made_of=("solid_conductance", "gas_conductance"),
    follows="unloading_stiffness",
    uncertainty="total_conductance_scatter",
)
def total_conductance(contact: State) -> Any:
    """Thermal conductance of the solid spots and of the gas in parallel [W/(m^2 K)]."""
    return contact.solid_conductance + contact.gas_conductance


@quantity(
    HEAT_CONDUCTANCE,
    "conductance of the solid spots per nominal area",
    needs=(CONDUCTIVITY, UNIT_OF_CONDUCTANCE),
    uncertainty="solid_conductance_scatter",
    made_of=("unloading_stiffness",),
    follows="unloading_stiffness",
    unit_of_state=lambda contact: contact.bodies.conductivity[1],
    similarity=(0, -1),
)
def solid_conductance(contact: State) -> Any:
    """Thermal or electrical conductance of the solid spots, h = (k_s/E*) (-dF/du), at constant contact area.

    Conductance and stiffness solve the same potential problem (J. R. Barber, Proc. R. Soc. A
    459 (2003) 53). In W/(m^2 K) for conductivities such as "45 W/(m K)", in S/m^2 for "6e6 S/m".
    The slope of the loading curve of yielded contacts is up to ten times smaller.
    """
    return contact.evaluate(
        lambda theory, surface, u, E_star, k_s, stiffness: tuple(
            answered(core.solid_conductances, (stiffness, k_s, E_star))
        ),
        1,
        {
            "conductivity": contact.bodies.conductivity[0],
            "unloading_stiffness": contact.unloading_stiffness,
        },
    )[0]


@quantity(
    HEAT_CONDUCTANCE,
    "thermal conductance of the gas in the gaps per nominal area",
    needs=(GAS, UNIT_OF_LENGTH),
    uncertainty="gas_conductance_scatter",
)
def gas_conductance(contact: State) -> Any:
    """Thermal conductance of the gas in the gaps, parallel to that of the solid spots [W/(m^2 K)]."""
    assert contact.interface.gas is not None
    return conductance_of_gas(contact, contact.interface.gas)


@quantity(
    DIMENSIONLESS,
    "model uncertainty: standard deviation of ln of the total conductance at this pressure",
    made_of=("total_conductance",),
    is_column=False,
    spread_of_process="stiffness",
)
def total_conductance_scatter(contact: State) -> Any:
    """Model uncertainty, one standard deviation of ln `total_conductance` at this pressure.

    Those of `solid_conductance` and `gas_conductance`, each times its share of the total, in
    quadrature.
    """
    solid = contact.solid_conductance * contact.solid_conductance_scatter
    gas = contact.gas_conductance * contact.gas_conductance_scatter
    with np.errstate(invalid="ignore"):
        return np.sqrt(solid**2 + gas**2) / contact.total_conductance


@quantity(
    DIMENSIONLESS,
    "model uncertainty: standard deviation of ln of the solid conductance at this pressure",
    made_of=("solid_conductance",),
    is_column=False,
    spread_of_process="stiffness",
)
def solid_conductance_scatter(contact: State) -> Any:
    """Model uncertainty, one standard deviation of ln `solid_conductance` at this pressure.

    That of the unloading stiffness, to which the conductance is proportional. The
    uncertainty of the conductivities is not included.
    """
    return contact.unloading_stiffness_scatter


@quantity(
    DIMENSIONLESS,
    "model uncertainty: standard deviation of ln of the gas conductance at this pressure",
    made_of=("gas_conductance",),
    is_column=False,
    spread_of_process="gap",
)
def gas_conductance_scatter(contact: State) -> Any:
    """Model uncertainty, one standard deviation of ln `gas_conductance` at this pressure; 0 in vacuum.

    That of the distribution of gaps, by simulations with known mean gap and area, and that
    of the mean gap (`separation_scatter`), in quadrature. NaN where no simulation was
    compared: of areas outside 0.1% to 75%, and temperature jumps below 0.03 h_rms. The
    uncertainty of the gas's conductivity and accommodation is not included.
    """
    assert contact.interface.gas is not None
    gas = contact.interface.gas
    if gas.name == VACUUM:
        return 0.0 * contact.mean_separation

    def scatter(gaps: tuple[Any, ...], conductivity: Any, of_gap: Any) -> Any:
        u, area, jump, h_rms, _ = gaps
        of_mean = scatter_of_mean(area, jump, h_rms)
        return np.hypot(of_mean, exponent_of_gap(*gaps) * of_gap / u)

    return _of_gaps(contact, gas, scatter, contact.separation_scatter)


def conductance_of_gas(contact: State, gas: Gas) -> Any:
    """Conductance of a gas in the gaps of a contact; the law is in `mbma_tables.contacts.quantities.gas`."""
    if contact.unit_system.length is None:
        raise InputError(
            "conductance of a gas beside lengths whose unit is not known: give the surface its unit"
        )
    if gas.name == VACUUM:
        return 0.0 * contact.mean_separation
    metre = factor("m", contact.unit_system.length)

    def conductance(gaps: tuple[Any, ...], conductivity: Any) -> Any:
        return conductivity * metre * mean_inverse(*gaps)

    return _of_gaps(contact, gas, conductance)


def _of_gaps(contact: State, gas: Gas, function: Callable[..., Any], *others: Any) -> Any:
    """``function(gaps, conductivity, *others)`` of a contact's entries, with the gas's conductivity [W/(m K)].

    Gaps are what the laws of `mbma_tables.contacts.quantities.gas` take: u, area, jump and
    h_rms in the contact's unit of lengths, and eta.
    """
    metre = factor("m", str(contact.unit_system.length))

    def of_entries(
        theory: Any,
        surface: Any,
        u: Any,
        E_star: Any,
        area: Any,
        temperature: Any,
        pressure: Any,
        accommodation: Any,
        *more: Any,
    ) -> tuple[Any, ...]:
        conductivity, jump = jump_of(gas.name, temperature, pressure, accommodation)
        eta = getattr(theory, "hardness", np.inf) / np.asarray(surface.rms_gradient)
        gaps = (u, area, jump * metre, surface.h_rms, eta)
        return (function(gaps, conductivity, *more),)

    of_metals = GASES[gas.name].accommodation
    arrays = {
        "area": contact.area,
        "temperature": gas.temperature,
        "gas_pressure": gas.pascals,
        "accommodation": of_metals if gas.accommodation is None else gas.accommodation,
    }
    numbered = {f"other {k}": other for k, other in enumerate(others)}
    return contact.evaluate(of_entries, 1, arrays | numbered)[0]


def cooper_mikic_yovanovich(
    surface: Any,
    pressure: ArrayLike,
    k_s: ArrayLike,
    E_star: ArrayLike,
    hardness: ArrayLike,
) -> Numbers:
    """Conductance of plastic contacts, h = 1.25 k_s (m/sigma) (p/H)^0.95; E* does not matter.

    Model of M. G. Cooper, B. B. Mikic, M. M. Yovanovich, Int. J. Heat Mass Transfer 12
    (1969) 279-300, in the power law of M. M. Yovanovich, "Thermal contact correlations"
    (1982); the first paper's own is taken to be 1.45 (p/H)^0.985. Both were found in public
    programs only, neither paper was consulted. This one is within 1.6% of the model for p/H
    of 1e-6 to 0.023, the other up to 28% below it. m is the mean absolute slope of a
    Gaussian profile, sqrt(2 m2/pi), sigma is h_rms.

    Examples
    --------
    >>> from mbma_tables import Surface
    >>> from mbma_tables.contacts.quantities.conductances import cooper_mikic_yovanovich
    >>> joint = Surface(hurst=0.8, q0=6e3, q1=6e5, h_rms=1e-6, h_max=3.5e-6)  # m
    >>> float(cooper_mikic_yovanovich(joint, 1e7, 100.0, 1e11, 1e9).round(-2))
    24600.0
    """
    by_slope = np.asarray(k_s) * np.sqrt(2 * surface.m2 / np.pi) / surface.h_rms
    found: Numbers = (by_slope * 1.25 * (np.asarray(pressure) / hardness) ** 0.95)[()]
    return found
