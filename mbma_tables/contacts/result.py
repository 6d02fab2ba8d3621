"""The result of `contact`: every quantity of the registry, computed when it is first asked for."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.bodies.bodies import BodiesInUnits
from mbma_tables.bodies.materials import ELASTIC_PSI
from mbma_tables.common.arguments import (
    FloatArray,
    Numbers,
    any_labelled,
    broadcast_shape,
    checked_hardness,
    is_labelled,
)
from mbma_tables.common.display import Displayed, Variable, quantity, shown
from mbma_tables.common.errors import InputError, MissingError
from mbma_tables.common.plots import (
    CompressionLines,
    Line,
    draw_compression,
    new_figure,
    pressure_label,
    theory_label,
)
from mbma_tables.common.progress import shown as progress
from mbma_tables.contacts.quantities import registry
from mbma_tables.contacts.quantities.interface import NOTHING_BETWEEN, Gas, Interface
from mbma_tables.contacts.quantities.state import Need, State
from mbma_tables.contacts.quantities.tangential import Tangential, sheared
from mbma_tables.contacts.quantities.validity import (
    reasons_of_contact,
    reasons_with_masks,
    valid_where_none,
)
from mbma_tables.contacts.question import GAPS, both_separations
from mbma_tables.surfaces.any_surface import AnySurface, apply_to_surface
from mbma_tables.surfaces.surface import (
    MeasuredSurface,
    assumptions,
    is_assumed_gaussian,
)
from mbma_tables.theories.adhesion import with_adhesion
from mbma_tables.theories.base import Theory, TheoryAnswer
from mbma_tables.theories.hardness import with_hardness

if TYPE_CHECKING:
    from mbma_tables.contacts.quantities.leakage import Leakage
    from mbma_tables.theories.yielding.theory import Loaded

# what yields depends on the heaviest load before: without one none is assumed, also where
# pressures of one request fall
FIRST_LOADING = "first; each pressure is reached from no contact"
AFTER = "after a largest pressure of {}, below which contacts unload and reload"
MOST_SHOWN = 1000  # entries up to which the text includes errors, scatter and validity
OF_FALLING = (
    ", also where a smaller one follows a larger one: that is no unloading, for which "
    "largest_pressure is"
)
# labels of panels whose quantities do not end in it
PANELS = {
    "area": "real contact area  A/A0",
    "mean_separation": "mean gap",
    "leak_rate": "leak rate",
}
CURVES = ("mean_separation", "pressure", "area")


def panel_label(name: str, unit: str) -> str:
    """Label of the panel of a quantity."""
    label = PANELS.get(name, name.rpartition("_")[2])
    return label if unit == "1" else f"{label} [{unit}]"


@dataclasses.dataclass(frozen=True, eq=False)
class Setup:
    """What is in contact: a surface, bodies, what is between them, and the theory of the elastic contact."""

    surface: AnySurface
    bodies: BodiesInUnits
    theory: Theory
    interface: Interface = NOTHING_BETWEEN
    # the theory of these bodies, once it is made
    _made: list[Theory] = dataclasses.field(default_factory=list, init=False, repr=False)

    def theory_of(self, bodies: BodiesInUnits) -> Theory:
        """The theory, with the bodies' hardness or adhesion where they have one.

        That of the setup's own bodies is made once, with what it keeps for a surface.
        """
        if not self.bodies.yields and bodies.adhesion is None:
            return self.theory
        is_own = bodies is self.bodies
        if is_own and self._made:
            return self._made[0]
        if not is_own:
            broadcast_shape(**bodies.numbers)
            checked_hardness(bodies.hardness)
        made: Theory
        if bodies.adhesion is not None:
            made = with_adhesion(self.theory, bodies.adhesion, bodies.E_star)
        else:
            hardness, largest = bodies.hardness, bodies.largest
            made = with_hardness(self.theory, hardness, bodies.E_star, largest)
        if is_own:
            self._made.append(made)
        return made


class Contact(State, Displayed):
    """A contact: its pressure and area, and every other quantity of the registry, by its name.

    Quantities are numbers or arrays of the broadcast shape, or DataArrays with their units;
    what is not asked for is not computed. `units` has the unit of each.
    """

    def __init__(
        self,
        setup: Setup,
        values: Mapping[str, Numbers],
        islands: int | None = None,
        answer: TheoryAnswer | None = None,
        loaded: Loaded | None = None,
    ) -> None:
        self._setup = setup
        self._values: dict[str, Any] = dict(values)
        self._missing: dict[str, list[Need]] = {}
        self._answer = answer
        self._loaded = loaded
        #: number of islands evaluated; None if computed by dask or if the theory has none
        self.islands = islands

    @property
    def surface(self) -> AnySurface:  # type: ignore[override]
        """The surface, in the unit of lengths of the contact."""
        return self._setup.surface

    @property
    def bodies(self) -> BodiesInUnits:  # type: ignore[override]
        """The bodies, in the units of the contact."""
        return self._setup.bodies

    @property
    def interface(self) -> Interface:  # type: ignore[override]
        """Friction, gas and direction of shear, of the contact of a joint."""
        return self._setup.interface

    @property
    def elastic_theory(self) -> Theory:  # type: ignore[override]
        """The theory, without the hardness."""
        return self._setup.theory

    @property
    def theory(self) -> str:
        """Name of the theory."""
        return self._setup.theory.name

    @property
    def variant(self) -> str:
        """Name of MBMA's variant; empty for other theories."""
        return self._setup.theory.variant_name

    @property
    def island_model(self) -> str:
        """Name of MBMA's island model; empty for other theories."""
        return self._setup.theory.island_model_name

    @property
    def units(self) -> dict[str, str]:
        """The unit of each quantity; "1" where it has none, and stresses are over E* where no modulus was given."""
        return {
            name: declared.unit(self)
            for name, declared in sorted(registry.registry().items())
        }

    def quantity(self, name: str) -> Any:
        """A quantity of the registry by its name, computed when it is first asked for, and kept.

        Raises
        ------
        InputError
            For an unknown name, and where something that the quantity needs was not given.
        """
        if name not in self._values:
            self._values[name] = self._described(name, registry.get(name).of(self))
        return self._values[name]

    def __getattr__(self, name: str) -> Any:
        # Python asks here, too, where a property ended with MissingError: it says what is missing
        if hasattr(type(self), name):
            return getattr(type(self), name).__get__(self, type(self))
        # quantities that are declared elsewhere than in this package have no typed property
        if name.startswith("_") or name not in registry.registry():
            raise AttributeError(
                f"{type(self).__name__!r} object has no attribute {name!r}"
            )
        return self.quantity(name)

    def describe(self, kept: Mapping[str, Any]) -> None:
        """Give DataArrays their names, meanings and units, but to those that keep their own."""
        for name, value in self._values.items():
            self._values[name] = kept.get(name, self._described(name, value))

    def _described(self, name: str, value: Any) -> Any:
        """A quantity as it is; a DataArray gets its name, meaning and unit."""
        if not is_labelled(value):
            return value
        declared = registry.get(name)
        return value.rename(name).assign_attrs(
            long_name=declared.meaning, units=declared.unit(self)
        )

    def answered(self, name: str) -> Any:
        """A separation, pressure, area or error, from the separation that the contact was made with.

        Raises
        ------
        MissingError
            For a contact made with neither separation.
        """
        gap = next((gap for gap in GAPS if gap in self._values), None)
        if gap is None:
            given = ", ".join(self._values) or "nothing"
            raise MissingError(
                f"{name} needs one of {', '.join(GAPS)}, which is missing: "
                f"this contact was made with {given}"
            )
        if name in GAPS:
            d, u = both_separations(
                gap,
                self._values[gap],
                self._highest,
                self.elastic_theory.ends_at_h_max,
            )
            return {"separation": d, "mean_separation": u}[name]
        field = getattr(self.answer, name)
        return self.E_star * field if name == "pressure" else field

    def scatter_of(self, name: str) -> Any:
        """Model uncertainty of a quantity by its name; NaN where it is not known."""
        uncertainty = registry.get(name).uncertainty
        if uncertainty is None:
            return np.nan * self.mean_separation
        return self.quantity(uncertainty)

    def missing(self, name: str) -> list[Need]:
        """What a quantity needs and was not given."""
        if name not in self._missing:
            self._missing[name] = registry.get(name).missing(self)
        return self._missing[name]

    def judged(self, names: Iterable[str]) -> Contact | Leakage:
        """What has the `valid` and the `reasons` of quantities: the leakage where one of them follows from the flow."""
        known = [name for name in names if name in registry.registry()]
        parts = set[str]().union(*map(registry.names_of_parts, known))
        return self.leakage if "flow_coefficient" in parts else self

    def available(self) -> list[str]:
        """Names of the quantities for which everything needed was given."""
        return [
            name
            for name, declared in registry.registry().items()
            if declared.is_available(self)
        ]

    def theory_of(self, bodies: BodiesInUnits) -> Theory:
        """The theory for bodies, with their hardness where they have one."""
        return self._setup.theory_of(bodies)

    def evaluate(
        self,
        function: Callable[..., tuple[Any, ...]],
        outputs: int = 1,
        more: Mapping[str, Any] | None = None,
    ) -> tuple[Any, ...]:
        """``function(theory, surface, mean_separation, E_star, *more)`` of the contact's entries, block by block."""
        bodies = self.bodies
        arrays = {
            "mean_separation": self.mean_separation,
            **bodies.numbers,
            **(more or {}),
        }
        count = len(bodies.numbers)

        def block(surface: AnySurface, u: Any, *others: Any) -> tuple[Any, ...]:
            own = bodies.at(*others[:count])
            theory = self.theory_of(own)
            return function(theory, surface, u, own.E_star, *others[count:])

        if any_labelled(self.surface, *arrays.values()):
            labelled: tuple[Any, ...] = apply_to_surface(
                block, self.surface, arrays, outputs
            )
            return labelled
        broadcast_shape(surface=self.surface.h_rms, **arrays)
        u, modulus, *others = map(np.asarray, arrays.values())
        theory = self.theory_of(bodies)
        found = function(theory, self.surface, u, modulus, *others[count - 1 :])
        return tuple(part[()] for part in found)

    @property
    def answer(self) -> TheoryAnswer:
        """The theory's result at these separations over E*, computed once."""
        if self._answer is None:
            fields: Any = self.evaluate(
                lambda theory, surface, u, E_star: theory.answer(surface, u), 4
            )
            self._answer = TheoryAnswer(*fields)
        return self._answer

    def of_loading(self, name: str) -> Any:
        """A field of the loaded contact that yields."""
        if self._loaded is not None:
            return getattr(self._loaded, name)[()]
        return self.evaluate(
            lambda theory, surface, u, E_star: (getattr(theory.loaded(surface, u), name),)
        )[0]

    def _moved(self, mean_separation: Any) -> Contact:
        """The same surface and bodies at other mean separations."""
        return Contact(self._setup, {"mean_separation": mean_separation})

    def pressure_at(self, mean_separation: Any) -> Any:
        """Pressure at other mean separations."""
        moved = self._moved(mean_separation)
        return moved.evaluate(
            lambda theory, surface, u, E_star: (
                E_star * theory.answer(surface, u).pressure,
            )
        )[0]

    def energy_at(self, mean_separation: Any) -> Any:
        """Elastic energy at other mean separations."""
        moved = self._moved(mean_separation)
        return moved.evaluate(
            lambda theory, surface, u, E_star: (E_star * theory.energy(surface, u),)
        )[0]

    def separation_at(self, pressure: Any) -> Any:
        """Mean separation at other pressures."""

        def find(
            theory: Any, surface: Any, u: Any, E_star: Any, wanted: Any
        ) -> tuple[Any]:
            return (theory.mean_separation_at(surface, "pressure", wanted / E_star),)

        return self.evaluate(find, 1, {"pressure": pressure})[0]

    @property
    def last_contact(self) -> Any:
        """Mean separation of last contact; infinite where the theory has none."""
        return self._highest if self.elastic_theory.ends_at_h_max else np.inf

    @property
    def _highest(self) -> Any:
        """Mean separation of first contact: h_max, after a larger pressure that of the residual shape."""
        if self.bodies.largest is None or not self.yields:
            return self.surface.h_max
        return self.evaluate(
            lambda theory, surface, u, E_star: (theory.highest(surface) + 0 * u,)
        )[0]

    def unloading(self) -> Contact:
        """The contact as it unloads from here, with its own pressure as the largest so far if it is."""
        return self._unloading if self.yields else self

    @functools.cached_property
    def _unloading(self) -> Contact:
        setup, before, largest = self._setup, self.bodies.largest, self.pressure
        if before is not None:
            largest = np.maximum(largest, before)
        if before is None or is_labelled(largest) or np.any(largest != before):
            bodies = dataclasses.replace(self.bodies, largest=largest)
            setup = dataclasses.replace(setup, bodies=bodies)
        # of the theory, also where this is a contact of a law
        near = Contact(setup, {"mean_separation": self.mean_separation})
        return near._moved(near.separation_at(self.pressure))

    @functools.cached_property
    def leakage(self) -> Leakage:
        """Flow through the gaps of the contact; computed when first read."""
        from mbma_tables.contacts.quantities.leakage import leakage_of

        return leakage_of(self)

    def tangential(
        self, friction: float | None = None, direction: str | None = None
    ) -> Tangential:
        """The contact under shear: stiffness of full stick, partial and gross slip.

        Parameters
        ----------
        friction : float, optional
            Coefficient of friction, for slip; by default that of the joint.
        direction : {"along", "across"}, optional
            Of the shear relative to the lay, for surfaces whose anisotropy is known and
            above 1.4: full stick alone.

        Examples
        --------
        >>> from mbma_tables import Bodies, Surface, contact
        >>> face = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0, unit="um")
        >>> pressed = contact(face, Bodies("100 GPa", nu=0.3), pressure="10 MPa", theory="calibrated")
        >>> sheared = pressed.tangential(friction=0.2)
        >>> f"{sheared.stiffness:.3g} GPa/um, {sheared.shear('0.05 um'):.3g} GPa; slip from {sheared.gross_slip:.2g} um"
        '0.0242 GPa/um, 0.000954 GPa; slip from 0.23 um'
        """
        return sheared(self, friction, direction)

    def gap_mean(self, function: Callable[[FloatArray], FloatArray]) -> Numbers:
        """Mean of a function of the gap, over the nominal area where the contact is open.

        Contact, whose gap is zero, is left out: add ``contact.area`` times the function's
        value there. The distribution of gaps is the law of docs/adhesion.md, of a simulated
        map that of the map itself.

        Parameters
        ----------
        function : callable
            Of an array of gaps [length], to an array of finite numbers of its shape.

        Raises
        ------
        InputError
            For a contact that yields, and a function of another shape.

        Examples
        --------
        >>> import numpy as np
        >>> from mbma_tables import Surface, contact
        >>> face = Surface(hurst=0.8, q0=0.1, q1=3.2, h_rms=1.0, h_max=3.5, unit="um")
        >>> pressed = contact(face, "1 GPa", area=0.1, theory="calibrated")
        >>> near = pressed.gap_mean(lambda gap: np.exp(-gap / 0.1))
        >>> f"{near:.3f}; open {pressed.gap_mean(np.ones_like):.2f}, mean gap {pressed.gap_mean(np.abs):.3f} um"
        '0.076; open 0.90, mean gap 0.841 um'
        """
        from mbma_tables.contacts.quantities.gaps import mean_over_gaps

        mean: Numbers = mean_over_gaps(self, function)
        return mean

    def gap_share(self, gap: ArrayLike | str) -> Numbers:
        """Share of the nominal area with gaps of at most `gap`, contact included.

        Parameters
        ----------
        gap : array_like or str
            At least 0 [length], or as text with its unit; broadcasts with the contact.

        Examples
        --------
        >>> from mbma_tables import Surface, contact
        >>> face = Surface(hurst=0.8, q0=0.1, q1=3.2, h_rms=1.0, h_max=3.5, unit="um")
        >>> pressed = contact(face, "1 GPa", area=0.1, theory="calibrated")
        >>> [f"{share:.3f}" for share in pressed.gap_share([0.0, 0.01, 0.1, 1.0])]
        ['0.100', '0.116', '0.181', '0.634']
        """
        from mbma_tables.contacts.quantities.gaps import share_of_gaps

        share: Numbers = share_of_gaps(self, gap)
        return share

    def gap_density(self, gap: ArrayLike | str) -> Numbers:
        """Share of the nominal area per length of gap, of open gaps, at `gap` > 0 [1/length].

        Beside contact edges it goes as gap^(-1/3).

        Parameters
        ----------
        gap : array_like or str
            Positive [length], or as text with its unit; broadcasts with the contact.
        """
        from mbma_tables.contacts.quantities.gaps import density_of_gaps

        density: Numbers = density_of_gaps(self, gap)
        return density

    def gap_conductance(
        self,
        gas: str = "air",
        temperature: ArrayLike = 300.0,
        gas_pressure: ArrayLike | str = "1 atm",
        accommodation: ArrayLike | None = None,
    ) -> Numbers:
        """Conductance per nominal area of a gas in the gaps, parallel to `solid_conductance` of the solid [W/(m^2 K)].

        The law, data of gases and their accuracy are in `mbma_tables.contacts.quantities.gas`;
        without radiation.

        Parameters
        ----------
        gas : {"air", "helium", "nitrogen", "argon", "vacuum"}
        temperature : array_like
            Of the gas [K], from 200 to 600.
        gas_pressure : array_like or str
            [Pa], or with its unit.
        accommodation : array_like, optional
            Thermal accommodation coefficient of the faces; default: that of machined metals.

        Examples
        --------
        >>> from mbma_tables import Surface, contact
        >>> face = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0, unit="um")
        >>> pressed = contact(face, "steel 1020", pressure="1 MPa", theory="calibrated")
        >>> f"{pressed.solid_conductance:.0f} W/(m^2 K) and {pressed.gap_conductance('air'):.0f}"
        '3345 W/(m^2 K) and 9921'
        """
        from mbma_tables.contacts.quantities.conductances import conductance_of_gas

        in_gaps = Gas(gas, temperature, gas_pressure, accommodation)
        conductance: Numbers = conductance_of_gas(self, in_gaps)
        return conductance

    @property
    def _reasons_of_contact(self) -> tuple[Any, Mapping[str, Any]]:
        """The reasons against a contact, and the further arrays that they depend on."""
        return functools.partial(reasons_of_contact, self), self.answer._asdict()

    def is_valid(self) -> Any:
        """Where no reason against the contact applies."""
        return valid_where_none(self, *self._reasons_of_contact)

    @functools.cached_property
    def reasons(self) -> dict[str, Any]:
        """Reasons why entries are not `valid`, each with the mask of these entries as a plain array."""
        return reasons_with_masks(self, *self._reasons_of_contact)

    @property
    def evidence(self) -> str:
        """What `valid` entries were compared with: simulated surfaces, the page on them, and the tested ranges."""
        return self.theory_of(self.bodies).evidence(self.surface)

    def _facts(self) -> dict[str, str]:
        of_mbma = f" ({self.variant}, {self.island_model})" if self.variant else ""
        # of a large map
        part = getattr(self.elastic_theory, "part_of_map", "")
        facts = {"theory": self.theory + of_mbma + (part and f", {part}")}
        if self.surface.resolution:
            facts["resolution"] = self.surface.resolution
        if isinstance(self.surface, MeasuredSurface) and assumptions(self.surface):
            facts["if"] = "; ".join(assumptions(self.surface))
        for name in ("mean_separation", "pressure", "area"):
            facts[name] = self._shown(name)
        pair = self.bodies.pair
        if pair is not None and not self.bodies.hardness_is_given:
            facts["hardness"] = pair.without_hardness
        if (
            any_labelled(self.surface, self.mean_separation)
            or np.size(self.error) > MOST_SHOWN
        ):
            return facts
        if np.all(self.area == 0):
            facts["contact"] = "none: the bodies are apart"
        facts["separation_scatter"] = self._shown("separation_scatter")
        facts |= self._conductances()
        for name in ("stiffness", "unloading_stiffness"):
            if registry.get(name).is_shown(self):
                facts[name] = self._shown(name)
        if not self.yields and self.bodies.units.stress != "1":
            facts["elastic_hardness"] = self._shown("elastic_hardness")
            # reveals a pressure in an unintended unit
            light = self.elastic_hardness * ELASTIC_PSI / 2
            if np.any(self.pressure > light):
                limit = shown(light, self.units["pressure"])
                facts["pressure"] += (
                    f" (above E* g/2 = {limit}, the mean pressure in light contact)"
                )
        if self.elastic_theory.advice:
            facts["advice"] = self.elastic_theory.advice
        names = ["error", "scatter", "stiffness_scatter", "valid"]
        if self.yields:
            names += ["unloading_stiffness_scatter", "psi", "yielded"]
            facts["loading"] = self.loading
        for name in names:
            facts[name] = self._shown(name)
        if np.any(self.valid):
            facts["evidence"] = self.evidence
            if is_assumed_gaussian(self.surface):
                facts["valid"] += ", if the face is Gaussian and isotropic"
        return facts

    @property
    def loading(self) -> str:
        """How the pressures are reached, of contacts that yield, for texts; empty of elastic ones."""
        if not self.yields:
            return ""
        if self.bodies.largest is not None:
            return AFTER.format(shown(self.bodies.largest, self.units["pressure"]))
        pressures = np.asarray(self.pressure)
        falling = pressures.ndim > 0 and bool((np.diff(pressures, axis=-1) < 0).any())
        return FIRST_LOADING + (OF_FALLING if falling else "")

    def _conductances(self) -> dict[str, str]:
        """Each conductance and its scatter as text, the total first."""
        if self.bodies.conductivity_is_given and registry.get(
            "solid_conductance"
        ).missing(self):
            return {"solid_conductance": "needs the surface's unit"}
        # without that of the solid, a gas alone is no conductance of the contact
        given = self.bodies.conductivity_is_given
        return {
            shown_name: self._shown(shown_name)
            for name in registry.conductances()
            if given and registry.get(name).is_available(self)
            for shown_name in (name, f"{name}_scatter")
        }

    def _shown(self, name: str) -> str:
        """A quantity as text, with its unit."""
        return shown(self.quantity(name), registry.get(name).unit(self))

    def variables(self) -> dict[str, Variable]:
        """Every listed quantity that is available: values, unit and meaning."""
        variables = {}
        for name, declared in registry.registry().items():
            if declared.is_shown(self):
                variables[name] = Variable(
                    self.quantity(name), declared.unit(self), declared.meaning
                )
        return variables

    _variables = variables

    def _origin(self) -> dict[str, str]:
        origin = {
            "E_star": shown(self.E_star, self.units["pressure"]),
            "surface": repr(self.surface),
        }
        assumed = assumptions(self.surface)
        return origin | ({"assumed": "; ".join(assumed)} if assumed else {})

    def _figure(self) -> Any:
        unit = self.units["pressure"]
        title = f"hardness {shown(self.bodies.hardness, unit)}" if self.yields else ""
        # pressure and area against the gap have panels of their own
        names = [name for name in registry.results() if name not in CURVES]
        return draw_compression(
            [self.curve()], title, pressure_label(unit), more=self.panels(names)
        )

    def panels(self, names: Sequence[str]) -> dict[str, list[Line]]:
        """Lines of quantities by the label of their panel, with scatter, from light to heavy contacts.

        Those without any positive value have no place on a logarithmic axis, such as the
        conductance of a vacuum.
        """
        order = np.argsort(-np.ravel(self.mean_separation), kind="stable")
        lines: dict[str, list[Line]] = {}
        for name in names:
            declared = registry.get(name)
            if not declared.is_shown(self):
                continue
            values = np.ravel(self.quantity(name))
            if not (values > 0).any():
                continue
            scatter = None
            if declared.uncertainty is not None:
                scatter = np.ravel(self.scatter_of(name))
                scatter = (scatter / values if name == "mean_separation" else scatter)[
                    order
                ]
            label = panel_label(name, declared.unit(self))
            lines.setdefault(label, []).append(
                Line(name.replace("_", " "), values[order], scatter)
            )
        return lines

    def curve(self, leakage: bool = False) -> CompressionLines:
        """The lines that plots draw, for one surface at several separations; optionally with its leakage."""
        if np.size(self.pressure) < 2 or self.surface.shape != ():
            raise InputError(
                "one surface's force and area at several separations make a curve, and this has none"
            )
        order = np.argsort(-np.ravel(self.mean_separation), kind="stable")
        fields: dict[str, tuple[Any, ...]] = {
            "gap": (self.mean_separation / self.surface.h_rms,),
            "pressure": (self.pressure, self.scatter),
            "area": (self.area, self.area_scatter),
        }
        if leakage:
            fields["leakage"] = (self.leakage.K, self.leakage.scatter)
        label = theory_label(self.theory) + (f", {self.variant}" if self.variant else "")
        lines = {}
        for axis, (values, *scatter) in fields.items():
            band = np.ravel(scatter[0])[order] if scatter else None
            lines[axis] = Line(label, np.ravel(values)[order], band)
        return lines

    def map(self) -> ContactMap:
        """Pressure, gap and contact at every point of the surface's map, simulated on its full grid at this pressure.

        Raises
        ------
        InputError
            For several contacts, and surfaces without a map.

        Examples
        --------
        >>> import numpy as np
        >>> from mbma_tables import Surface, contact
        >>> noise = np.fft.rfft2(np.random.default_rng(1).standard_normal((64, 64)))
        >>> q = np.hypot(np.fft.fftfreq(64)[:, None], np.fft.rfftfreq(64))
        >>> heights = 0.1 * np.fft.irfft2(np.where((q > 0.05) & (q < 0.25), noise, 0))
        >>> surface = Surface.from_map(heights, dx=1.0, periodic=True, unit="um")
        >>> pressed = contact(surface, "1 GPa", pressure="10 MPa").map()
        >>> data = pressed.to_dataset()
        >>> f"{float(data.pressure.mean()):.3f} {data.pressure.units} on {float(data.contact.mean()):.0%} of the points"
        '0.010 GPa on 45% of the points'
        """
        from mbma_tables.theories.simulated import boundary_elements, pressing
        from mbma_tables.theories.simulated.own_map import map_of, sides

        pressure = np.asarray(self.pressure, float)
        largest = 0.0 if self.bodies.largest is None else self.bodies.largest
        if any(map(np.ndim, (pressure, self.E_star, self.bodies.hardness, largest))):
            raise InputError(
                "a map is of one contact: give one pressure, one modulus and one hardness"
            )
        surface: Any = self.surface
        treated = map_of(surface)
        modulus = float(self.E_star)
        force = float(pressure) / modulus
        if not 0 < force < np.inf:
            raise InputError(f"a map needs a pressure above 0, got {float(pressure):g}")
        heights = treated.heights - treated.heights.mean()
        side_x, side_y = sides(treated)
        # boundary elements take heights of order one and an rms gradient of one
        scale = float(np.abs(heights).max())
        gradient = float(surface.bearing.gradient)
        stretched = side_x * gradient / scale, side_y * gradient / scale
        cap = float(self.bodies.hardness) / modulus / gradient
        is_mirrored = not treated.periodic
        engine = boundary_elements.BoundaryElementContact(
            heights / scale, stretched, pressing.TOLERANCE, cap, is_mirrored
        )
        with progress("boundary elements"):
            engine.press(max(force, float(largest) / modulus) / gradient)
            residual = scale * engine.residual_heights()
            if largest > pressure:
                engine = engine.unloading()
                engine.press(force / gradient)
        length = self.bodies.units.length or "1"
        units = {"pressure": self.units["pressure"], "gap": length, "heights": length}
        units["residual_heights"] = length
        traction = modulus * gradient * engine.traction
        gap = scale * engine.gap
        return ContactMap(treated.steps, units, traction, gap, heights, residual)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ContactMap(Displayed):
    """Contact of one map at one load, from `Contact.map`; arrays of shape (nx, ny), the first axis is x."""

    steps: tuple[float, ...]  #: sampling steps along x and y [length]
    units: dict[str, str]
    pressure: FloatArray = quantity(
        "contact pressure; zero where the gap is open [stress]"
    )
    gap: FloatArray = quantity("gap to the rigid plane; zero in contact [length]")
    heights: FloatArray = quantity("height above the mean [length]")
    residual_heights: FloatArray = quantity(
        "height above that mean after the largest pressure, where yielded points stay flat [length]"
    )
    _dims = ("x", "y")

    contact = property(
        lambda self: self.pressure > 0, doc="True where the map is in contact."
    )

    def _facts(self) -> dict[str, str]:
        return {
            "points": " x ".join(map(str, self.pressure.shape)),
            "pressure": shown(self.pressure.mean(), self.units["pressure"]),
            "contact": f"{self.contact.mean():.4g} of the points",
            "largest_pressure": shown(self.pressure.max(), self.units["pressure"]),
            "mean_gap": shown(self.gap.mean(), self.units["gap"]),
        }

    def _variables(self) -> dict[str, Variable]:
        axes = zip("xy", self.pressure.shape, self.steps, strict=True)
        places = {
            n: Variable(np.arange(count) * step, self.units["gap"], "", (n,))
            for n, count, step in axes
        }
        touching = {
            "contact": Variable(self.contact, "1", "whether the map touches", self._dims)
        }
        return {**places, **super()._variables(), **touching}

    def _figure(self) -> Any:
        figure = new_figure(10, 4.2)
        length = {"1": "length"}.get(self.units["gap"], self.units["gap"])
        stress = self.units["pressure"]
        sides = [
            count * step
            for count, step in zip(self.pressure.shape, self.steps, strict=True)
        ]
        fields = {
            pressure_label(stress): (
                np.where(self.contact, self.pressure, np.nan),
                "magma_r",
            ),
            f"gap [{length}]": (np.where(self.contact, np.nan, self.gap), "viridis"),
        }
        for axes, (label, (values, colours)) in zip(
            figure.subplots(1, 2), fields.items(), strict=True
        ):
            picture = axes.imshow(
                values.T, origin="lower", extent=(0, sides[0], 0, sides[1]), cmap=colours
            )
            axes.set_xlabel(f"x [{length}]")
            axes.set_ylabel(f"y [{length}]")
            figure.colorbar(picture, ax=axes, label=label, shrink=0.8)
        return figure
