"""An exported law: the law of one surface with its units, and the header of all files written from it."""

import dataclasses
import functools
import hashlib
from collections.abc import Iterator
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from typing import Any, NamedTuple

import numpy as np

from mbma_tables import __version__
from mbma_tables.bodies.adhesion import Adhesion
from mbma_tables.bodies.bodies import Bodies, after
from mbma_tables.bodies.materials import ELASTIC_PSI
from mbma_tables.common.arguments import FloatArray, Numbers, number_in
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import factor, in_unit
from mbma_tables.contacts.contact import contact
from mbma_tables.contacts.law import block as at
from mbma_tables.contacts.law.law import ContactLaw
from mbma_tables.contacts.law.leakage import LeakageLaw
from mbma_tables.contacts.law.make import law_of
from mbma_tables.contacts.quantities.conductances import conductance_of_gas
from mbma_tables.contacts.quantities.declaration import Quantity
from mbma_tables.contacts.quantities.gas import VACUUM
from mbma_tables.contacts.quantities.interface import NOTHING_BETWEEN, Gas, Interface
from mbma_tables.contacts.quantities.stiffnesses import tangential_stiffness
from mbma_tables.effects.force_law import ForceLaw
from mbma_tables.effects.rough_contact import pressed
from mbma_tables.export.text import about, bound, number
from mbma_tables.islands.variants import Variant
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.banded import BandedSurface
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.theories import resolve
from mbma_tables.theories.base import Theory, UserTheory

LAW_RTOL = 1e-8
LOOKED_AT = 200  # compressions at which validity and scatter are looked at
# smaller ones for validity alone, down to this share of the largest
SMALL = 20
NEAREST = 1e-5
# rounds and parts of the search for an end of validity between two of them
ROUNDS = 4
PARTS = 32
NEAREST_BLOCKED = 1e-9  # share of the blocked gaps that is left out
BISECTIONS = 60  # of the overclosure from which on a flow is not known
KAPPA = 0.5, 2.0  # range of normal over tangential stiffness
GAS_AT = 5  # pressures at which a header has the conductance of the gas alone
OWN_NUMBERS = (
    "q0",
    "q1",
    "h_rms",
    "h_max",
    "rms_gradient",
)  # description of a surface given by a spectrum


class GasInGaps(NamedTuple):
    """Gas that conducts heat beside the solid spots of an exported law."""

    gas: Gas
    unit: float  # one W/(m^2 K) in the unit of the law's conductance

    def __str__(self) -> str:
        pressure = self.gas.pascals
        temperature = about(float(np.asarray(self.gas.temperature)))
        return f"{self.gas.name} at {temperature} K and {about(pressure, 6)} Pa"

    def conductance(self, found: Any) -> FloatArray:
        """Of contacts, in the unit of the law's conductance."""
        of_gas = conductance_of_gas(found, self.gas)
        return self.unit * np.asarray(of_gas, dtype=float)


@dataclasses.dataclass(frozen=True)
class ExportedLaw:
    """One surface's law, whose units are known; with `force` of a rough body, in place of pressure."""

    surface: AnySurface  # in the units of the law
    law: ContactLaw
    theory: Theory  # what the law was made from, without the hardness
    modulus: float  # E*
    hardness: float  # infinite where the contact is elastic
    length: str  # unit of length,
    stress: str  # and of stress, or of force
    made_by: tuple[
        str, ...
    ] = ()  # header lines with the command that writes the file again
    direction: str | float | None = None  # of a simulated map's leakage
    force: ForceLaw | None = None

    def unit_of(self, quantity: Quantity) -> str:
        """The unit of a quantity of lengths and stresses; forces stand for stresses where the law is of them."""
        assert quantity.dimension.is_mechanical
        return quantity.dimension.mechanical_unit(self.length, self.stress)

    @property
    def ends(self) -> bool:
        """Whether contact ends at c = 0, and pressure is zero below."""
        return self.law.highest == np.inf

    @property
    def c_least(self) -> float:
        """Begin of the range of overclosures."""
        return (
            -np.inf
            if self.ends
            else (self.law.h_max - float(self.law.block[at.HIGHEST])) / 2
        )

    @property
    def begin(self) -> float:
        """The least overclosure of rows and functions, at first contact or where the law begins."""
        return 0.0 if self.ends else max(0.0, self.c_least)

    @property
    def attracts(self) -> bool:
        """Whether the bodies attract each other, so that contact has area at no load."""
        return self.force is None and self.law.setup.bodies.adhesion is not None

    @property
    def c_most(self) -> float:
        """End of the range of overclosures."""
        return (self.law.h_max - float(self.law.block[at.LOWEST])) / 2

    @property
    def c_turn(self) -> float:
        """Overclosure at the maximum of pressure, or at full compression."""
        law = self.law
        return (
            law.h_max - (law.lowest if law.turning_point is None else law.turning_point)
        ) / 2

    @property
    def facts(self) -> dict[str, tuple[float, str]]:
        """Numbers of a joint required by some programs, with their units."""
        own = {"h_rms": (float(self.surface.h_rms), self.length)}
        return own | {
            "rms_gradient": (float(self.surface.rms_gradient), "1"),
            "E_star": (self.modulus, self.stress),
        }

    def slope(
        self,
        quantity: str,
        conductivity: float | None = None,
        unit: str | None = None,
        kappa: Any = None,
    ) -> tuple[float, str]:
        """Conductance, or tangential stiffness, over the law's slope, and its unit; of k_s, or of normal stiffness."""
        if quantity == tangential_stiffness.name:
            return 1 / number_in("kappa", kappa, *KAPPA), f"{self.stress}/{self.length}"
        if conductivity is None:
            raise InputError(
                "conductance needs conductivity, which is missing: k_s = 2 k1 k2/(k1 + k2)"
            )
        if not unit:
            raise InputError(
                "conductance needs conductivity_unit, which is missing: that of k_s, such as 'W/(m K)'"
            )
        if not isinstance(unit, str) or not unit.isprintable():
            raise InputError(f"conductivity_unit is not printable: {unit!r}")
        return number_in(
            "conductivity", conductivity, 1e-300, 1e300
        ) / self.modulus, f"{unit}/{self.length}"

    @functools.cached_property
    def leakage(self) -> LeakageLaw:
        """The law's leakage, in its direction."""
        return (
            self.law.leakage
            if self.direction is None
            else self.law.leakage.along(self.direction)
        )

    @functools.cached_property
    def unknown_from(self) -> float:
        """Overclosure from which on the flow of a yielded contact is not known, infinite if there is none.

        Before it contact blocks the flow, or it is minus infinity: then all that blocks in
        elastic contact is not known.
        """
        blocked = self.leakage.blocked_at
        if blocked == -np.inf:
            return np.inf
        end = float(self.law.block[at.LOWEST])
        # just inside, where rounding does not count
        begin = 2 * blocked - self.law.h_max
        d = np.linspace(begin - NEAREST_BLOCKED * (begin - end), end, LOOKED_AT)
        unknown = np.isnan(self.leakage(separation=d))
        if unknown[0]:
            return -np.inf
        if not unknown.any():
            return np.inf
        first = int(np.argmax(unknown))
        good, bad = d[first - 1], d[first]
        for _ in range(BISECTIONS):
            middle = (good + bad) / 2
            if np.isnan(self.leakage(separation=middle)):
                bad = middle
            else:
                good = middle
        return float((self.law.h_max - bad) / 2)

    def answer(self, u: FloatArray) -> Any:
        """The theory itself at mean separations; of a body the contacts at approaches that are left to the largest."""
        if self.force is not None:
            return pressed(self.force.body, self.law.h_max + self.force.first - u)
        return contact(self.surface, self.bodies, mean_separation=u, theory=self.theory)

    @property
    def _loading(self) -> str:
        """On the way to the pressures of a law with a hardness."""
        largest = self.bodies.largest_pressure
        if largest is None:
            return "loading only, not for unloading, which is stiffer"
        return (
            f"after a largest pressure of {number(largest)} {self.stress}, below which it is that of unloading "
            "and reloading, whose overclosure is zero at first contact with what yielded"
        )

    @property
    def bodies(self) -> Bodies:
        """Modulus and hardness, and the largest pressure so far, in the units of the file."""
        largest = None if self.force is not None else self.law.setup.bodies.largest
        return Bodies(
            self.modulus,
            hardness=self.hardness,
            largest_pressure=largest,
            adhesion=self._adhesion,
        )

    @property
    def _adhesion(self) -> Adhesion | None:
        """The attraction in numbers, as the modulus is one."""
        if not self.attracts:
            return None
        setup = self.law.setup.bodies
        own = setup.adhesion
        assert own is not None
        adhesion: Adhesion = dataclasses.replace(
            setup.bodies.adhesion, work=float(own.work), range=float(own.range)
        )
        return adhesion

    def of_gas(
        self, gas: GasInGaps | None, unit: str, end: float, included: bool
    ) -> tuple[str, ...]:
        """Lines of a header on what conductance is of: solid spots, and gas in gaps up to an overclosure."""
        is_vacuum = gas is not None and gas.gas.name == VACUUM
        if gas is None or is_vacuum:
            name = "total" if is_vacuum and included else "solid"
            return (
                f"{name}_conductance is that of the solid spots alone, without gas in the gaps (contact conductance)",
            )
        u = self.law.h_max - np.linspace(self.begin, end, GAS_AT)
        values = gas.conductance(self.answer(u))
        pressures = np.asarray(self.law.pressure(u))
        alone = ", ".join(
            f"{about(value)} at {about(pressure, 3)}"
            for value, pressure in zip(values, pressures, strict=True)
        )
        what = (
            "total_conductance (joint conductance) is "
            f"that of the solid spots and of the gas in the gaps together, {gas}"
        )
        if not included:
            what = (
                "total_conductance (joint conductance) is that of the solid spots, solid_conductance (contact "
                "conductance), and that of the gas in the gaps, gas_conductance (gap conductance), together: "
                f"{gas}"
            )
        return (f"{what}; the gas has {alone} {self.stress}, in {unit}",)

    def _attraction(self) -> tuple[str, ...]:
        """Lines of a header on the bodies' attraction, and on the branch that the law is."""
        if not self.attracts:
            return ()
        own = self.law.setup.bodies.adhesion
        assert own is not None
        begins = f"c = {number(self.c_least)} {self.length}"
        least = f"{about(float(self.law.pressure(separation=self.law.highest)))}"
        return (
            f"adhesion: work {about(float(own.work))} {self.stress} {self.length}, range "
            f"{about(float(own.range))} {self.length}; pressure is the net one, load less attraction",
            f"of the contacts that balance a pressure this is the closest, of net pressures from {least} "
            f"{self.stress} on, at {begins},",
            "where pressure rises with c; contact at no load and in tension, pull-off and the jump into contact "
            "are not in it; energy counts from there",
        )

    def header(
        self, what: str, range_: str, *more: str, end: float, leakage: bool = False
    ) -> tuple[str, ...]:
        """Lines of a file's header: contents, range, error, validity up to `end`, and with `leakage` those of flow."""
        law = self.law
        stress = self.stress
        title = (
            f"MBMA model, variant {law.variant!r}"
            if law.variant
            else f"theory {law.theory!r}"
        )
        title = f"Contact law of a rough surface, {title}"
        meaning = (
            "pressure is force over nominal area;",
            "overclosure c = h_max - u, u = (h_max + d)/2 the mean separation, d the separation from the mid-plane;",
            "c = 0 is first contact: bodies meet where their mean planes are h_max apart",
        )
        if self.force is not None:
            body = self.force.body
            stress = self.force.body.units["pressure"]
            title = f"Force law of a rough {body.name} on a flat, theory {law.theory!r}"
            meaning = (
                f"here pressure is the force [{self.stress}], and A/A0 the real area [{body.units['area']}]",
                f"overclosure c = approach - ({number(self.force.first)}), zero at first contact; approach is zero "
                "where",
                "the mean planes of the faces touch",
            )
        gradient = self.modulus * float(self.surface.rms_gradient)
        plastic = f"elastic: within 5% in area for hardnesses from {about(gradient / ELASTIC_PSI)} {stress} on"
        if self.hardness < np.inf:
            plastic = (
                f"hardness = {number(self.hardness)} {stress}, plasticity index {about(gradient / self.hardness, 3)}: "
                + self._loading
            )
        names = self.surface.parameters or OWN_NUMBERS
        numbers = ", ".join(
            f"{name} = {number(getattr(self.surface, name))}" for name in names
        )
        return (
            f"{title}; mbma_tables {__version__}",
            what,
            f"surface: {numbers}; lengths in {self.length}",
            *filter(None, [self.surface.resolution, self.theory.origin]),
            f"E* = {number(self.modulus)} {stress}, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2",
            *meaning,
            *self._attraction(),
            f"range: {range_}",
            *more,
            f"the law is within {bound(law.error)} of its theory, in pressure and area",
            plastic,
            *self._validity(end, leakage),
            *self._hashes(),
            *(self.made_by or (f"written from Python by mbma_tables {__version__}",)),
        )

    def _validity(self, end: float, leakage: bool) -> Iterator[str]:
        """Lines on the valid range of the law, and its scatter against simulations."""
        law = self.law
        unit = self.stress
        # small overclosures by their logarithm, larger ones evenly
        small = np.geomspace(NEAREST, 1 / LOOKED_AT, SMALL, endpoint=False)
        shares = np.append(small, np.linspace(0, 1, LOOKED_AT + 1)[1:])
        u = law.h_max - self.begin - (end - self.begin) * shares
        found = self.answer(u)
        pressure = np.asarray(law.pressure(u))
        for reason, bad in (found.leakage if leakage else found).reasons.items():
            for first, last in np.flatnonzero(
                np.diff(bad, prepend=False, append=False)
            ).reshape(-1, 2):
                low = first and self._last_valid(
                    reason, u[first - 1], u[first], leakage, ROUND_FLOOR
                )
                high = last < u.size and self._last_valid(
                    reason, u[last], u[last - 1], leakage, ROUND_CEILING
                )
                where = (
                    f"from p = {low} to {high}"
                    if low and high
                    else f"above p = {low}"
                    if low
                    else f"below p = {high}"
                )
                yield f"not valid {f'{where} {unit}' if low or high else 'at any pressure of the range'}: {reason}"
        # a law after a largest pressure is softer beyond it, where the contact yields
        if law.softening is not None and np.isinf(law.largest_before):
            yield (
                f"softening: stiffness falls with compression from c = {about(law.h_max - law.softening)}, "
                f"p = {about(law.pressure(law.softening))} {unit} on, which no simulation shows"
            )
        if not self.ends and self.c_least <= 0:
            yield f"no last contact: pressure is {about(law.pressure(law.h_max))} {unit} at c = 0"
        spread = self._spread(
            "one standard deviation of ln p at a given c", found.scatter, pressure
        )
        yield f"scatter of simulations about the theory, {spread}"
        if leakage:
            spread = self._spread(
                "one standard deviation of ln K", found.leakage.scatter, pressure
            )
            yield from self._of_leakage(spread)

    def _last_valid(
        self, reason: str, good: float, bad: float, leakage: bool, rounding: str
    ) -> str:
        """Pressure, rounded outward, at the last separation where a reason does not apply, by bisection between two."""
        for _ in range(ROUNDS):
            u = np.linspace(good, bad, PARTS + 1)
            found = self.answer(u[1:-1])
            mask = (found.leakage if leakage else found).reasons.get(
                reason, np.zeros(PARTS - 1, bool)
            )
            k = 1 + int(np.argmax(np.append(mask, True)))
            good = u[k - 1]
            bad = u[k]
        four_digits = Context(prec=4, rounding=rounding)
        return about(four_digits.create_decimal(float(self.law.pressure(good))))

    def _hashes(self) -> Iterator[str]:
        """Lines on the table that the theory uses, and on a surface not given by five numbers."""
        yield from self.theory.provenance()
        samples = None
        if isinstance(self.surface, BandedSurface):
            samples = self.surface.sampled()
        elif isinstance(self.surface, MeasuredSurface):
            samples = self.surface
        if samples is not None:
            values = hashlib.sha256(np.stack([samples.q, samples.C]).tobytes())
            yield f"spectrum: values {values.hexdigest()[:16]}"

    def _spread(self, what: str, scatter: Numbers, pressure: FloatArray) -> str:
        """A scatter at five pressures where it is known."""
        sizes = np.asarray(scatter)[SMALL:]
        pressure = pressure[SMALL:]
        known = np.flatnonzero(np.isfinite(sizes))
        places = (
            known[np.linspace(0, known.size - 1, 5).astype(int)] if known.size else known
        )
        listed = ", ".join(
            f"{about(sizes[k], 2)} at {about(pressure[k], 3)}" for k in places
        )
        return f"{what}: {listed} {self.stress}" if listed else "not known"

    def _of_leakage(self, scatter: str) -> Iterator[str]:
        """Lines on leakage."""
        blocked = self.leakage.blocked_at
        stress = self.stress
        way = (
            ""
            if self.law.gaps is None
            else f", direction {self.direction or 'both, their geometric mean'}"
        )
        yield (
            f"leakage is the flow coefficient K [{self.length}^3] of the gaps{way}: flow per length of seal is "
            f"K dp/(12 viscosity width), viscosity in {stress} s: 1e-3 Pa s, as water's, is "
            f"{about(1e-3 * factor('Pa', stress, 'stress'))} {stress} s"
        )
        if blocked > -np.inf:
            load = float(self.law.pressure(blocked))
            c = self.law.h_max - blocked
            where = f"from p = {number(load)} {stress}, c = {number(c)} on"
            unknown = "the elastic contact blocks there, and a yielded one leaks"
            if self.unknown_from == -np.inf:
                yield f"K is not known {where}: {unknown}"
            else:
                yield f"blocked, K = 0, {where}"
            if np.isfinite(self.unknown_from):
                yield f"K is not known from c = {number(self.unknown_from)} on: {unknown}"
        else:
            yield "never blocked"
        yield f"K is within {bound(self.leakage.error)} of that at the law's area"
        yield f"scatter of K from simulation to simulation, {scatter}"


def exported_law(
    surface: AnySurface | ForceLaw,
    E_star: float | str | Bodies = 1.0,
    length_unit: str | None = None,
    stress_unit: str | None = None,
    variant: str | Variant = "reported",
    theory: str | Theory | UserTheory | None = None,
    hardness: float | str = np.inf,
    made_by: tuple[str, ...] = (),
    direction: str | float | None = None,
    interface: Interface = NOTHING_BETWEEN,
    largest_pressure: float | str | None = None,
    adhesion: Adhesion | None = None,
) -> ExportedLaw:
    """The law of one surface in known units, of a modulus and a hardness or of `Bodies`; a batch of surfaces and missing units are refused."""
    if isinstance(surface, ForceLaw):
        if (
            E_star != 1.0
            or hardness != np.inf
            or any((length_unit, stress_unit, theory))
            or variant != "reported"
        ):
            raise InputError(
                "a force law has its modulus, hardness, units and theory: give no others"
            )
        body = surface.body
        layer = surface.body.law
        length, _ = _known(body.surface.unit, layer.units.stress)
        numbers = layer.E_star, layer.hardness, length, body.units["force"], made_by
        return ExportedLaw(
            body.surface, surface.law, body.theory, *numbers, force=surface
        )
    one: AnySurface = in_unit(surface, length_unit)
    given = (
        E_star
        if isinstance(E_star, Bodies)
        else Bodies(E_star, hardness=hardness, adhesion=adhesion)
    )
    if largest_pressure is not None:
        given = after(given, largest_pressure)
    bodies = given.in_units(one, stress_unit)
    length, stress = _known(bodies.units.length, bodies.units.stress)
    if one.shape != ():
        raise InputError("a contact law is of one surface, not of a batch")
    number_in("E_star", bodies.E_star, 1e-300, 1e300)
    options = {} if variant == "reported" else {"variant": variant}
    chosen = resolve(theory, one, options=options)
    law = law_of(one, bodies, chosen, LAW_RTOL, interface)
    return ExportedLaw(
        one, law, chosen, law.E_star, law.hardness, length, stress, made_by, direction
    )


def with_conductivity(
    E_star: Any, hardness: float | str, conductivity: float, unit: str | None
) -> Bodies:
    """The bodies of a modulus, with a conductivity."""
    if isinstance(E_star, Bodies):
        raise InputError("conductivity is that of the bodies: leave it out beside Bodies")
    text = number(number_in("conductivity", conductivity, 1e-300, 1e300))
    both = conductivity if unit is None else f"{text} {unit}"
    return Bodies(E_star, hardness=hardness, conductivity=(both, both))


def _known(length: str | None, stress: str | None) -> tuple[str, str]:
    """The units, neither of which may be missing."""
    if length is None:
        raise InputError(
            "length_unit is missing: give it, or numbers with units, like '0.8 um'"
        )
    if not stress or stress == "1":
        raise InputError(
            "stress_unit is missing: give it, or numbers with units, like E_star = '115 GPa'"
        )
    return length, stress
