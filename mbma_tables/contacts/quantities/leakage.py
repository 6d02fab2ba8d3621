"""Leakage of a contact: flow coefficient with uncertainty, by a table of the effective medium, and leakage rates."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import (
    FloatArray,
    Numbers,
    answered,
    filled,
    finite_array,
    is_labelled,
    nearest,
    positive_array,
    require,
    require_name,
    rows,
)
from mbma_tables.common.display import Displayed, Variable, shown
from mbma_tables.common.errors import InputError
from mbma_tables.common.plots import draw_compression, leakage_label, pressure_label
from mbma_tables.common.shared import shared, shared_property
from mbma_tables.common.units import Dimension, Units, factor
from mbma_tables.contacts.quantities.conductances import UNIT_OF_LENGTH
from mbma_tables.contacts.quantities.declaration import (
    DIMENSIONLESS,
    Quantity,
    on_request,
    quantity,
)
from mbma_tables.contacts.quantities.effective_medium import (
    LARGEST_AREA,
    FlowConstants,
    contact_factor,
    wide_gap,
)
from mbma_tables.contacts.quantities.gas_flow import (
    RATE_UNITS,
    gas_for_flow,
    gas_scatter,
    mass_flow,
)
from mbma_tables.contacts.quantities.state import Need, State
from mbma_tables.contacts.quantities.validity import reasons_with_masks, valid_where_none
from mbma_tables.core import core
from mbma_tables.surfaces.any_surface import agree
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.theories.base import Theory
from mbma_tables.theories.calibrated.formulas import (
    CONSTANTS,
    Spectrum,
    force_at_area,
    light_factor,
    spectrum_of,
)
from mbma_tables.theories.calibrated.spectra import (
    inner_integral,
    laws_of,
    power_laws_of,
)
from mbma_tables.theories.evidence import (
    Owners,
    SurfaceSpline,
    known_at,
    nodes_of,
    shipped_part,
)

GROUP = "leakage"
AXES = ("hurst", "log_zeta_1", "log_odds")
COVERED = np.array(
    [[0.1, 1.0], [math.log(3.0), math.log(1e5)]]
)  # H and ln zeta_1, where the error was measured
LEAST = 1e-300  # smaller contact fractions count as zero
OWN_NODES = 64  # contact fractions at which a spectrum's own factor is found
FLOW_NODES = 32  # of gaps between two magnifications, in batches
STEP = 0.25  # of odds, for a slope at the table's end
KEPT = 64  # spectra whose factors are kept
# standard deviations of ln k of maps by their isotropic spectrum, which come on top, of
# maps that are valid for the calibrated law and of others; at these contacts of the data
# set's group machined
MAP_AREAS = (0.003, 0.025, 0.067, 0.14, 0.39)
LIKE_GAUSSIAN = (0.29, 0.60, 0.89, 1.9, 6.3)
OTHERS = (0.84, 1.3, 1.9, 3.0, 7.3)
# of leak rates of liquids, over m^3/s
LIQUID_UNITS = {
    "m^3/s": 1.0,
    "mm^3/s": 1e9,
    "ml/s": 1e6,
    "ml/min": 6e7,
    "ml/h": 3.6e9,
    "l/h": 3.6e6,
}
OF_LIQUIDS = "mm^3/s"  # the unit of the leak rate of a seal that states none
OF_GASES = "kg/s"  # that of `Leakage.gas`
SEALS = (
    "{'viscosity': '0.1 Pa s', 'pressure_drop': '0.5 MPa', 'width': '2 mm', 'length': '0.3 m'} "
    "of a liquid, {'gas': 'helium', 'inlet': '2 bar', 'outlet': '1 bar', 'width': '2 mm', "
    "'length': '0.3 m'} of a gas"
)
SIMULATED = 64.0  # zeta_1 up to which flow was simulated
# yielded share of the contact up to which its flow is that of the elastic contact: gap and
# area differ by less than this share, the scatter of flow is at least forty times as large
NEGLIGIBLE_YIELD = 1e-3
# growth of the hydraulic aperture over that of the mean gap on unloading, and p_m/(E* g),
# zeta_1 and shares of the largest pressure at which it was simulated, by `python -m generate
# unloaded_flow`
OPENING = 1.1
UNLOADED_ETA = (0.03, 0.5)
UNLOADED_TO = 16.0
LEAST_RATIO = 0.05
MEANINGS = {
    "K": "flow coefficient",
    "x": "flow coefficient along the first axis",
    "y": "flow coefficient along the second axis",
    "xy": "flow coefficient of flow along one axis by pressure along the other",
    "hydraulic_aperture": "K^(1/3)",
    "flow_factor": "K over the cube of the mean separation",
    "scatter": "model uncertainty: standard deviation of ln K",
    "valid": "whether flow through such contacts was simulated",
    "blocked": "whether contact percolates",
}


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Leakage(Displayed):
    """Flow through the gaps of a contact; arrays of the contact's shape.

    Reynolds' equation on the gaps: no flow where bodies touch, small slopes, isotropic
    roughness, and a fluid whose pressure does not move the solids. It is the mean of a long
    seal, many of the longest wavelengths each way; cells of a few wavelengths differ by
    `scatter`. Flow per length of seal is K (p1 - p2)/(12 viscosity width). With
    ``theory="simulated"`` K is the geometric mean of both axes, else that of isotropic
    roughness on both.
    """

    #: flow coefficient [length^3], the cube of the `hydraulic_aperture`; exactly 0 where
    #: `blocked`, and NaN where the simulated gaps of an elastic contact are blocked but the
    #: contact yields, so that compact patches leave channels
    K: Numbers
    x: Numbers  #: that along the first axis of the map [length^3]
    y: Numbers  #: along the second axis
    #: flow per width along one axis by a pressure gradient along the other; 0 where
    #: isotropic
    xy: Numbers
    _contact: Any = dataclasses.field(repr=False)

    def _facts(self) -> dict[str, str]:
        known = {
            name: shown(value, unit)
            for name, (value, unit, *_) in self._variables().items()
        }
        return {"theory": self._contact.theory, **known}

    def _variables(self) -> dict[str, Variable]:
        units = dict.fromkeys(("x", "y", "xy"), self.units["K"]) | self.units
        return {
            n: Variable(getattr(self, n), units.get(n, "1"), meaning)
            for n, meaning in MEANINGS.items()
        }

    def _origin(self) -> Any:
        return self._contact._origin()

    def _figure(self) -> Any:
        return draw_compression(
            [self._contact.curve(leakage=True)],
            pressure_label=pressure_label(self._contact.units["pressure"]),
            leakage_label=leakage_label(self.units["K"]),
        )

    blocked = property(
        lambda self: self.K == 0,
        doc="Whether contact percolates, A/A0 from 0.42 on, or 0.55 where all of it yields; False where K is not known.",
    )

    def along(self, direction: ArrayLike | str) -> Any:
        """Flow coefficient of a long seal whose width is along "x", "y" or degrees from x [length^3].

        K_x cos^2 + K_y sin^2 + 2 K_xy sin cos: pressure falls along the width alone.

        Examples
        --------
        >>> from mbma_tables import Surface, contact
        >>> seal = Surface(hurst=0.8, q0=0.01, q1=1.0, h_rms=1.0, h_max=3.5, unit="um")
        >>> found = contact(seal, "10 MPa", area=0.1, theory="calibrated").leakage
        >>> bool(abs(found.along(30.0) / found.K - 1) < 1e-12)
        True
        """
        return along(direction, self.x, self.y, self.xy)

    #: K^(1/3) [length], the gap of parallel plates with the same flow
    hydraulic_aperture = property(lambda self: np.cbrt(self.K))
    #: K/u^3, Patir and Cheng's pressure flow factor of the mean separation u
    flow_factor = property(lambda self: self.K / self._contact.mean_separation**3)

    @shared_property
    def scatter(self) -> Any:
        """Model uncertainty, one standard deviation of ln K, of cells at least four longest wavelengths wide.

        NaN where not known, and where blocked.
        """

        @np.errstate(divide="ignore")
        def stated(
            by: Theory, surface: Any, u: FloatArray, E: FloatArray, area: FloatArray
        ) -> tuple[FloatArray]:
            simulated = _simulated(by)
            if simulated is not None:
                return (simulated.flow_trust(surface, u, area)[0],)
            area = largest_area(by, surface, u, area)
            stated = shipped_flow().standard_deviation(by.elastic.name, area)
            if not isinstance(surface, MeasuredSurface) or surface.bearing is None:
                # none of surfaces unlike those that were simulated, as of the theory's own
                is_unlike = bool(surface.departures())
                return (np.full(stated.shape, np.nan) if is_unlike else stated,)
            # channels and walls of a map are not in its spectrum
            of_maps = LIKE_GAUSSIAN if not surface.departures(by_map=True) else OTHERS
            return (
                np.hypot(stated, np.interp(np.log(area), np.log(MAP_AREAS), of_maps)),
            )

        return self._contact.evaluate(stated, 1, {"area": self._contact.area})[0]

    @shared_property
    def valid(self) -> Any:
        """Whether flow through such contacts was simulated; if not, `reasons` explains why."""
        contact = self._contact
        return contact.valid & valid_where_none(
            contact, reasons_against, {"area": contact.area}
        )

    @shared_property
    def reasons(self) -> Any:
        """Reasons why entries are not valid, each with its mask; for plain arrays."""
        contact = self._contact
        return contact.reasons | reasons_with_masks(
            contact, reasons_against, {"area": contact.area}
        )

    @property
    def units(self) -> dict[str, str]:
        """Units of the quantities that are not dimensionless."""
        units = self._contact.unit_system
        return {
            "K": flow_coefficient.unit_in(units),
            "hydraulic_aperture": hydraulic_aperture.unit_in(units),
        }

    def liquid(
        self,
        viscosity: ArrayLike | str,
        pressure_drop: ArrayLike | str,
        width: ArrayLike | str,
        length: ArrayLike | str | None = None,
        unit: str | None = None,
    ) -> Any:
        """Volume that leaks per time and length of seal [length^2/time], K (p1 - p2)/(12 viscosity width).

        Parameters
        ----------
        viscosity : array_like or str
            Dynamic viscosity [stress time], such as "1e-3 Pa s"; a number is in the
            modulus's unit of stress times the unit of time that the result then has.
        pressure_drop : array_like or str
            p1 - p2 [stress].
        width : array_like or str
            Of the seal, along the flow [length].
        length : array_like or str, optional
            Of the seal, across the flow [length], by which the result is multiplied; with
            `unit` by default a metre.
        unit : str, optional
            Of the result: "m^3/s", "mm^3/s", "ml/s", "ml/min", "ml/h" or "l/h"; a plain
            viscosity is then a stress times seconds.

        Raises
        ------
        InputError, OutOfRangeError
            For numbers that are not positive and finite, units that cannot be converted, and
            with `unit` a surface whose unit of length is not known.

        Examples
        --------
        >>> from mbma_tables import Surface, contact
        >>> seal = Surface(hurst=0.8, q0=0.01, q1=1.0, h_rms=1.0, h_max=3.5, unit="um")
        >>> found = contact(seal, "10 MPa", area=0.1, theory="calibrated").leakage
        >>> f"{found.liquid('1e-3 Pa s', '0.1 MPa', '2 mm'):.1e} um^2/s"
        '3.0e+02 um^2/s'
        >>> f"{found.liquid('1e-3 Pa s', '0.1 MPa', '2 mm', '0.3 m', 'ml/h'):.2f} ml/h"
        '0.32 ml/h'
        """
        units = self._contact.unit_system
        if unit is not None:
            require_name("unit of leak rates", unit, LIQUID_UNITS)
            metre = _metre(units, "a liquid")
            length = metre if length is None else length
        found: dict[str, Any] = {
            "viscosity": stress_of(viscosity),
            "pressure_drop": pressure_drop,
            "width": width,
        }
        if length is not None:
            found["length"] = length
        for name, value in found.items():
            number = units.number(name, value)
            array = positive_array(name, number)
            found[name] = number if is_labelled(number) else array
        agree(K=self.K, **found)
        flow = self.K * (
            found["pressure_drop"] / (12 * found["viscosity"] * found["width"])
        )
        if length is not None:
            flow = flow * found["length"]
        return flow if unit is None else flow * (LIQUID_UNITS[unit] / metre**3)

    def gas(
        self,
        gas: str | Mapping[str, Any],
        inlet: ArrayLike | str,
        outlet: ArrayLike | str,
        width: ArrayLike | str,
        length: ArrayLike | str | None = None,
        temperature: ArrayLike = 293.15,
        unit: str = OF_GASES,
    ) -> Any:
        """Gas that leaks per time, from continuum through slip to free molecules, at constant temperature.

        Parameters
        ----------
        gas : {"air", "helium", "nitrogen", "argon", "hydrogen", "methane"} or mapping
            Or its own "mass" [kg/mol] and "viscosity" [Pa s].
        inlet, outlet : array_like or str
            Absolute pressures [Pa], such as "2 bar"; 0 is a vacuum.
        width : array_like or str
            Of the seal, along the flow [length].
        length : array_like or str, optional
            Of the seal, across the flow [length]; by default a metre.
        temperature : array_like
            [K]; of named gases from 200 to 600.
        unit : str
            "kg/s", "g/s", "mg/s", "g/h" or "mg/h"; "mbar l/s" or "Pa m^3/s", pressure times
            volume at that temperature; "sccm", cm^3 a minute at 0 deg C and 1 atm.

        Raises
        ------
        InputError, OutOfRangeError
            For numbers that are not positive and finite, an outlet above the inlet, units
            that cannot be converted, and a surface whose unit of length is not known.

        Examples
        --------
        >>> from mbma_tables import Surface, contact
        >>> seal = Surface(hurst=0.8, q0=0.01, q1=1.0, h_rms=1.0, h_max=3.5, unit="um")
        >>> found = contact(seal, "10 MPa", area=0.1, theory="calibrated").leakage
        >>> rate = found.gas("helium", "1 bar", "0 bar", "2 mm", "0.3 m", unit="mbar l/s")
        >>> f"{rate:.1e} mbar l/s"
        '1.9e-02 mbar l/s'
        """
        units = self._contact.unit_system
        metre = _metre(units, "a gas")
        pascals = Units(stress="Pa")
        own_numbers = dict(gas) if isinstance(gas, Mapping) else {}
        arrays = {
            "K": self.K,
            "area": self._contact.area,
            "width": units.number("width", width),
            "inlet": pascals.number("inlet", inlet),
            "outlet": pascals.number("outlet", outlet),
            "length": metre if length is None else units.number("length", length),
            "temperature": temperature,
            **own_numbers,
        }

        def rate(
            theory: Theory, surface: Any, u: Any, E_star: Any, K: Any, area: Any,
            across: Any, high: Any, low: Any, size: Any, T: Any, *of_gas: Any,
        ) -> tuple[FloatArray]:  # fmt: skip
            named = dict(zip(own_numbers, of_gas, strict=True))
            flowing = gas_for_flow(named or gas, T)
            for name, value in (("width", across), ("inlet", high), ("length", size)):
                positive_array(name, value)
            low = finite_array("outlet", low)
            is_below = (low >= 0) & (low <= high)
            require("outlet", low, is_below, "from 0 to the inlet's pressure")
            per_metre = mass_flow(K / metre**3, area, flowing, high, low, across / metre)
            return (per_metre * (size / metre) * flowing.in_unit(unit),)

        return self._contact.evaluate(rate, 1, arrays)[0]

    def through(self, seal: Mapping[str, Any]) -> Any:
        """Leak rate of a seal, which has the arguments of `gas` or of `liquid` by name, in the `unit_of_rate`."""
        if "gas" in seal:
            return self.gas(**seal)
        return self.liquid(**{"unit": OF_LIQUIDS, **seal})

    def error_of_rate(
        self, seal: Mapping[str, Any], of_flow: Any, deviations: Any
    ) -> Any:
        """ln of a seal's leak rate with an error of ln K over that without.

        A gas in narrow channels flows as a lower power of K than the first: the rate is that
        of the other K. In quadrature to it is the error of the law of gases, so many of its
        standard deviations.
        """

        def error(
            theory: Theory, surface: Any, u: Any, E_star: Any, rate: Any, other: Any,
            shift: Any, size: Any, area: Any,
        ) -> tuple[FloatArray]:  # fmt: skip
            with np.errstate(divide="ignore", invalid="ignore"):
                found = np.log(other / rate)
            if "gas" in seal:
                found = np.copysign(np.hypot(found, size * gas_scatter(area)), shift)
            return (np.where(rate == 0, shift, found),)

        moved = dataclasses.replace(self, K=self.K * np.exp(of_flow))
        arrays = {
            "rate": self.through(seal),
            "other": moved.through(seal),
            "of_flow": of_flow,
            "deviations": deviations,
            "area": self._contact.area,
        }
        return self._contact.evaluate(error, 1, arrays)[0]

    def scatter_of_rate(self, seal: Mapping[str, Any]) -> Any:
        """Model uncertainty, one standard deviation of ln of a seal's leak rate; NaN where it is not known."""
        more = self.error_of_rate(seal, self.scatter, 1.0)
        return (more - self.error_of_rate(seal, -self.scatter, -1.0)) / 2


def unit_of_rate(seal: Mapping[str, Any]) -> str:
    """Unit of the leak rate of a seal."""
    return str(seal.get("unit", OF_GASES if "gas" in seal else OF_LIQUIDS))


def checked_seal(seal: Mapping[str, Any] | None) -> None:
    """Reject a seal that has not the arguments of `Leakage.gas` or of `Leakage.liquid`."""
    if seal is None:
        return
    if not isinstance(seal, Mapping):
        raise InputError(f"seal has its numbers by name, such as {SEALS}, got {seal!r}")
    of = Leakage.gas if "gas" in seal else Leakage.liquid
    parameters = dict(inspect.signature(of).parameters)
    del parameters["self"]
    for name in seal:
        if name not in parameters:
            raise InputError(
                f"seal has no {name!r}: with 'gas' it has those of Leakage.gas, else of "
                f"Leakage.liquid; {nearest(str(name), parameters)}"
            )
    missing = [
        name
        for name, each in parameters.items()
        if each.default is inspect.Parameter.empty and name not in seal
    ]
    if missing:
        raise InputError(f"seal needs {', '.join(missing)}: it is such as {SEALS}")
    require_name(
        "unit of leak rates",
        unit_of_rate(seal),
        RATE_UNITS if "gas" in seal else LIQUID_UNITS,
    )


def _metre(units: Units, what: str) -> float:
    """A metre in the unit of lengths, which a leak rate needs."""
    if units.length is None:
        raise InputError(
            f"a leak rate of {what} beside lengths whose unit is not known: give the surface "
            "its unit"
        )
    return factor("m", units.length)


def stress_of(viscosity: Any) -> Any:
    """The stress of a viscosity that is a text, "1e-3 Pa s"; lists by entry, numbers as they are."""
    if isinstance(viscosity, list | tuple):
        return [stress_of(each) for each in viscosity]
    if not isinstance(viscosity, str):
        return viscosity
    text, stress, seconds = viscosity.strip().rpartition(" ")
    if seconds != "s" or not stress:
        raise InputError(
            f"viscosity = {viscosity!r} must be a stress times seconds, such as '1e-3 Pa s'"
        )
    return text


def leakage_of(contact: Any) -> Leakage:
    """The leakage of a contact."""

    def answer(
        theory: Theory, surface: Any, u: FloatArray, E: FloatArray, share: FloatArray
    ) -> tuple[FloatArray, ...]:
        simulated = _simulated(theory)
        if simulated is not None:
            own = np.asarray(simulated.flow(surface, u))
            if simulated is not theory:
                own = unknown_where_blocked(own, yields_noticeably(theory, surface, u))
            return np.sqrt(own[0]) * np.sqrt(own[1]), *own
        K = flow_of_contact(theory, surface, u, share) * np.asarray(surface.h_rms) ** 3
        return K, K, K, np.zeros_like(K)

    K, x, y, xy = contact.evaluate(answer, 4, {"area": contact.area})
    return Leakage(K, x, y, xy, contact)


def _never_yields(theory: Any) -> bool:
    """Whether it is the theory of bodies without a hardness, with an attraction or not."""
    return bool(np.isinf(getattr(theory, "hardness", np.inf)).all())


def flow_of_contact(
    theory: Theory, surface: Any, u: FloatArray, area: FloatArray
) -> FloatArray:
    """K/h_rms^3 of mean separations u [length] and A/A0 of a theory; 0 where blocked.

    NaN after unloading from a contact that was blocked.
    """
    k = flow(surface, u, area_of_flow(theory, surface, u, area))
    unloads, peak = unloading_from(theory, surface, u)
    if not unloads.any():
        return k
    u0, area0, yielded = (
        np.broadcast_to(part, np.shape(k))
        for part in (peak.mean_separation, peak.area, peak.yielded)
    )
    smaller = shipped_flow().constants.elastic_area(area0, np.nan_to_num(yielded))
    before = flow(surface, u0, smaller)
    h_rms = np.asarray(surface.h_rms)
    given = before, (u - u0) / h_rms, u / h_rms
    return np.where(unloads, answered(core.unloaded_flows, given, 1, OPENING)[0], k)


def unloading_from(theory: Any, surface: Any, u: FloatArray) -> tuple[Any, Any]:
    """Mask of contacts below the largest pressure after yielding, and the contact at that pressure."""
    if not hasattr(theory, "peak"):
        return np.zeros(np.shape(u), bool), None
    peak = theory.peak(surface)
    return peak.remembered & (u > peak.mean_separation), peak


def largest_area(
    theory: Theory, surface: Any, u: FloatArray, area: FloatArray
) -> FloatArray:
    """A/A0, after unloading that at the largest pressure, whose flow is less certain."""
    unloads, peak = unloading_from(theory, surface, u)
    return np.where(unloads, peak.area, area) if unloads.any() else area


def area_of_flow(
    theory: Any, surface: Any, u: FloatArray, area: FloatArray
) -> FloatArray:
    """A/A0 of the elastic contact that obstructs flow alike; `area` where nothing yields."""
    if _never_yields(theory):
        return area
    yielded = np.nan_to_num(theory.loaded(surface, u).yielded)
    return shipped_flow().constants.elastic_area(area, yielded)


def yields_noticeably(theory: Any, surface: Any, u: FloatArray) -> Any:
    """Mask of contacts of which more than a negligible share yields; False of an elastic theory."""
    if _never_yields(theory):
        return np.zeros(np.shape(u), bool)
    return np.asarray(theory.loaded(surface, u).yielded > NEGLIGIBLE_YIELD)


def unknown_where_blocked(K: FloatArray, yields: Any) -> FloatArray:
    """Flow coefficients, NaN where the contact yields and the elastic contact would be blocked."""
    return np.where((K == 0) & yields, np.nan, K)


def _simulated(theory: Theory) -> Any:
    """The theory of simulated gaps, yielded ones where these are simulated, else the elastic contact's, if any."""
    return next(
        (one for one in (theory, theory.elastic) if hasattr(one, "flow_trust")), None
    )


def degrees(direction: ArrayLike | str) -> FloatArray:
    """Degrees from the first axis of "x", "y" or numbers."""
    if isinstance(direction, str):
        try:
            direction = float({"x": "0", "y": "90"}.get(direction, direction))
        except ValueError:
            raise InputError(
                f"direction must be 'x', 'y' or degrees from x, got {direction!r}"
            ) from None
    return finite_array("direction", direction)


def along(direction: ArrayLike | str, x: Any, y: Any, xy: Any) -> Any:
    """Flow coefficient in a direction, "x", "y" or degrees from x."""
    angle = np.deg2rad(degrees(direction))
    # zero across the axes, which may be blocked
    cos, sin = np.round([np.cos(angle), np.sin(angle)], 15)
    return x * cos**2 + y * sin**2 + 2 * xy * sin * cos


def reasons_against(
    theory: Theory, surface: Any, u: FloatArray, E_star: Any, area: FloatArray
) -> dict[str, Any]:
    """Reasons why the flow is not valid, in addition to those for the contact."""
    simulated = _simulated(theory)
    everywhere = np.ones(np.shape(area), bool)
    if simulated is not None:
        found = dict(simulated.flow_trust(surface, u, area)[1])
    else:
        many = f"leakage: A/A0 is above {LARGEST_AREA:g}, where cells of one spectrum differ by factors"
        far = f"leakage: the longest wavelength is more than {SIMULATED:g} times the shortest, beyond simulated flow"
        found = {
            many: largest_area(theory, surface, u, area) > LARGEST_AREA,
            far: everywhere & (np.asarray(surface.zeta_1) > SIMULATED),
        }
    if (
        simulated is None
        and isinstance(surface, MeasuredSurface)
        and surface.bearing is not None
    ):
        spectrum = (
            "leakage: channels and walls of a map are not in its isotropic spectrum"
        )
        found[f"{spectrum}: theory='simulated' has its flow"] = everywhere
    if theory.elastic is not theory is not simulated:
        yields = yields_noticeably(theory, surface, u)
        if simulated is not None:
            found["leakage: yielded contacts leak several times more"] = yields
        elif not theory.elastic.has_yielded_flow:
            untested = (
                "leakage: flow of yielded contacts was not compared for this theory"
            )
            found[untested] = yields
    if simulated is not None:
        after = "leakage: flow after a larger pressure was not compared with simulations"
        found[after] = everywhere & theory.unloads(surface, u)
    else:
        found |= _reasons_of_unloading(theory, surface, u)
    for reason in theory.reasons_of_flow():
        found[reason] = everywhere
    return found


def _reasons_of_unloading(theory: Any, surface: Any, u: FloatArray) -> dict[str, Any]:
    """Reasons why the flow after unloading is not valid."""
    unloads, peak = unloading_from(theory, surface, u)
    if not unloads.any():
        return {}
    low, high = UNLOADED_ETA
    eta = np.asarray(theory.hardness) / np.asarray(surface.rms_gradient)
    ratio = theory.answer(surface, u).pressure / peak.pressure
    text = "leakage: flow after unloading was simulated for"
    return {
        f"{text} p_m/(E* g) from {low:g} to {high:g}": unloads
        & ~((eta >= low) & (eta <= high)),
        f"{text} longest wavelengths of at most {UNLOADED_TO:g} times the shortest": unloads
        & (np.asarray(surface.zeta_1) > UNLOADED_TO),
        f"{text} pressures from {LEAST_RATIO:g} of the largest on": unloads
        & (ratio < LEAST_RATIO),
    }


@dataclasses.dataclass(frozen=True, eq=False)
class FlowTable(SurfaceSpline):
    """The group `leakage` of the shipped file: ln R."""

    constants: FlowConstants
    error: float  # largest error of ln R against the medium itself, at held-out surfaces
    scatter: dict[str, FloatArray]  # by theory: root mean squares of ln(k/simulation)
    contact: FloatArray  # at these contact fractions

    def flow(
        self, surfaces: FloatArray, owner: Owners, u: FloatArray, area: FloatArray
    ) -> FloatArray:
        """k of mean gaps [h_rms] and contact fractions; 0 where blocked. Columns of `surfaces`: H, ln zeta_1."""
        given = *self.core_table, *surfaces, None, None, self.shared(surfaces, u.size)
        return _flow(given, owner, u, area)

    def standard_deviation(self, theory: str, area: FloatArray) -> FloatArray:
        """Root mean square of ln(k/simulation) at contact fractions; NaN where not known or blocked."""
        row = self.scatter.get(theory)
        if row is None or not np.isfinite(row).any():
            return np.full(np.shape(area), np.nan)
        return np.where(
            np.asarray(area) < self.constants.threshold,
            known_at(self.contact, row, area),
            np.nan,
        )


@shared()
def shipped_flow() -> FlowTable:
    """The shipped table, read once."""
    values, facts = shipped_part(GROUP)
    constants = FlowConstants(
        *(float(facts[f"flow_{f.name}"]) for f in dataclasses.fields(FlowConstants))
    )
    return FlowTable(
        *nodes_of([values[name] for name in AXES]),
        COVERED,
        values["spline"],
        (constants.threshold, constants.obstruction, 0.0),
        constants,
        float(facts["largest_error_log_factor"]),
        dict(zip(facts["theories"].split(), values["stated_scatter"], strict=True)),
        values["contact"],
    )


def _flow(
    given: tuple[Any, ...], owner: Owners, u: FloatArray, area: FloatArray
) -> FloatArray:
    """u^3 (1 - 1.5/(u^2 + 4)) R, and 0 from A/A0 = threshold on; ln R over ln A/(threshold A0 - A)."""
    fill = functools.partial(core.contact_flows, *given)
    found: FloatArray = filled(fill, (owner, u, area), 1)[0]
    return found


@shared(KEPT)
def own_factor(spectrum: Spectrum) -> tuple[Any, ...]:
    """ln R over the table's odds of one spectrum, as `core.contact_flows` takes it."""
    from scipy.interpolate import PchipInterpolator

    table = shipped_flow()
    odds, step = np.linspace(table.first[2], table.last, OWN_NODES, retstep=True)
    log_factor = contact_factor(
        spectrum, table.constants.threshold / (1 + np.exp(-odds)), table.constants
    )
    cubics = PchipInterpolator(
        odds, np.minimum.accumulate(np.minimum(log_factor, 0.0))
    ).c[::-1]
    pieces = np.zeros((OWN_NODES - 1, 6))
    pieces[:, :4] = (cubics * step ** np.arange(4)[:, None]).T
    numbers = table.core_table[1].copy()
    numbers[5] = 1 / step
    anything = np.zeros(1)
    return (
        None,
        numbers,
        np.array([1, 1, OWN_NODES - 1]),
        anything,
        anything,
        None,
        None,
        pieces,
    )


def flow_of_spectrum(spectrum: Spectrum, u: FloatArray, area: FloatArray) -> FloatArray:
    """k of mean gaps [h_rms] and contact fractions of one spectrum; 0 where blocked."""
    return _flow(own_factor(spectrum), np.zeros(u.size, np.int64), u, area)


def _flow_of_spectra(
    laws: FloatArray, alpha: FloatArray, owner: Owners, u: FloatArray, area: FloatArray
) -> FloatArray:
    """k of mean gaps [h_rms] and contact fractions of many spectra, of the medium itself.

    Below and above the table's odds as of `_flow`.
    """
    table = shipped_flow()
    flow = table.constants
    with np.errstate(divide="ignore", invalid="ignore"):
        touching = np.maximum(area, LEAST)
        odds = np.log(touching / np.maximum(flow.threshold - area, LEAST))
    first, last = table.first[2], table.last
    inside = np.clip(odds, first, last)
    value = _log_factors(laws, alpha, owner, inside)
    near = np.flatnonzero((odds > last) & (area < flow.threshold))
    if near.size:
        before = np.full(near.size, last - STEP)
        slope = (value[near] - _log_factors(laws, alpha, owner[near], before)) / STEP
        value[near] += slope * (odds[near] - last)
    value = value * np.exp(flow.obstruction * np.minimum(odds - first, 0.0))
    wide = u * u * u * wide_gap(u) * np.exp(np.minimum(value, 0.0))
    return np.where(np.isnan(u), np.nan, np.where(area < flow.threshold, wide, 0.0))


def _log_factors(
    laws: FloatArray, alpha: FloatArray, owner: Owners, odds: FloatArray
) -> FloatArray:
    """ln R at the table's odds of contact."""
    flow = shipped_flow().constants
    contact = flow.threshold / (1 + np.exp(-odds))
    load = force_at_area(contact, light_factor(alpha)[owner])
    given = (
        np.ascontiguousarray(alpha, float),
        np.ascontiguousarray(laws, float).ravel(),
        np.array(dataclasses.astuple(CONSTANTS)),
        *inner_integral(CONSTANTS),
        np.array([flow.threshold, flow.obstruction]),
        np.concatenate(_rule()),
    )
    fill = functools.partial(core.gap_flow, *given)
    found: FloatArray = filled(fill, (np.ascontiguousarray(owner), load), 1)[0]
    return found


@shared()
def _rule() -> tuple[FloatArray, FloatArray]:
    """Gauss's nodes and weights of gaps between two magnifications."""
    return np.polynomial.legendre.leggauss(FLOW_NODES)


def flow(surface: Any, mean_separation: FloatArray, area: FloatArray) -> FloatArray:
    """K/h_rms^3 of mean separations u [length] and A/A0; 0 where blocked."""
    (u, contact), shape = rows(
        np.asarray(mean_separation) / np.asarray(surface.h_rms), area
    )
    if isinstance(surface, MeasuredSurface):
        return flow_of_spectrum(spectrum_of(surface), u, contact).reshape(shape)
    number = np.arange(math.prod(surface.shape)).reshape(surface.shape)
    owner = np.ascontiguousarray(np.broadcast_to(number, shape)).ravel()
    alpha = np.ravel(surface.alpha)
    hurst, zeta_1, is_self_affine = power_laws_of(surface)
    table = shipped_flow()
    given = np.stack([hurst, np.log(zeta_1)])
    out = table.flow(given, owner, u, contact)
    by_table = table.covers(*given) & is_self_affine
    if not by_table.all():
        laws = laws_of(surface)
        others = np.flatnonzero(~by_table[owner])
        out[others] = _flow_of_spectra(
            laws, alpha, owner[others], u[others], contact[others]
        )
    return out.reshape(shape)


@quantity(
    Dimension(length=3),
    "flow coefficient K: flow per length of seal is K dp/(12 viscosity width)",
    uncertainty="leakage_scatter",
    error_sign=-1,
    is_column=False,
    is_listed=on_request,
    follows="flow_coefficient",
    name_in_files="leakage",
)
def flow_coefficient(contact: State) -> Any:
    """Flow coefficient K of the gaps [length^3], `leakage.K`."""
    return contact.leakage.K


@quantity(
    Dimension(length=1),
    "hydraulic aperture K^(1/3)",
    made_of=("flow_coefficient",),
    is_column=False,
    is_listed=on_request,
    follows="flow_coefficient",
)
def hydraulic_aperture(contact: State) -> Any:
    """K^(1/3) [length], the gap of parallel plates with the same flow."""
    return contact.leakage.hydraulic_aperture


def power_of_flow(declared: Quantity) -> float:
    """The power of the flow coefficient that a quantity is; 0 of others."""
    if declared.follows != flow_coefficient.name:
        return 0.0
    return declared.dimension.length / flow_coefficient.dimension.length


@quantity(
    DIMENSIONLESS,
    "model uncertainty: standard deviation of ln K",
    made_of=("flow_coefficient",),
    spread_of_process="flow",
    is_column=False,
    is_listed=on_request,
)
def leakage_scatter(contact: State) -> Any:
    """Model uncertainty, one standard deviation of ln of the flow coefficient."""
    return contact.leakage.scatter


SEAL = Need(
    "seal",
    lambda contact: contact.interface.seal is not None,
    f"Joint(..., seal={SEALS})",
)


def _unit_of_rate(contact: State) -> str:
    assert contact.interface.seal is not None
    return unit_of_rate(contact.interface.seal)


@quantity(
    Dimension(length=3, time=-1),
    "leak rate of the joint's seal",
    needs=(SEAL, UNIT_OF_LENGTH),
    made_of=("flow_coefficient",),
    uncertainty="leak_rate_scatter",
    error_sign=-1,
    unit_of_state=_unit_of_rate,
)
def leak_rate(contact: State) -> Any:
    """Leak rate of the joint's seal, in its unit: that of `Leakage.gas` or `Leakage.liquid`."""
    assert contact.interface.seal is not None
    return contact.leakage.through(contact.interface.seal)


@quantity(
    DIMENSIONLESS,
    "model uncertainty: standard deviation of ln of the leak rate",
    made_of=("leak_rate",),
    spread_of_process="flow",
    is_column=False,
)
def leak_rate_scatter(contact: State) -> Any:
    """Model uncertainty, one standard deviation of ln `leak_rate`: that of the flow coefficient and of the law of gases."""
    return contact.leakage.scatter_of_rate(contact.interface.seal)
