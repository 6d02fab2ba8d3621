"""The result of `contact`: pressure, area and quantities derived from them on access."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from mbma_tables.common.arguments import FloatArray, Numbers, any_labelled
from mbma_tables.common.display import Displayed, Variable, quantity, shown
from mbma_tables.common.errors import InputError
from mbma_tables.common.plots import (
    Curve,
    draw_compression,
    new_figure,
    pressure_label,
    theory_label,
)
from mbma_tables.common.progress import shown as progress
from mbma_tables.common.units import unit_of
from mbma_tables.contacts.interface import Interface
from mbma_tables.contacts.source import MEANINGS, Source, named, reasons_against
from mbma_tables.materials import ELASTIC_PSI
from mbma_tables.theories.base import TheoryAnswer

if TYPE_CHECKING:
    from mbma_tables.contacts.leakage import Leakage

OF_HARDNESS = (
    "yielded",
    "unloading_stiffness",
    "unloading_stiffness_scatter",
    "plane_separation",
)
# what yields depends on the heaviest load before: none is assumed, also where pressures of
# one request fall
FIRST_LOADING = "first; each pressure is reached from no contact"
MOST_SHOWN = 10_000  # entries up to which the text includes errors, scatter and validity


def described(method: Callable[[Any], Any]) -> functools.cached_property[Numbers]:
    """A quantity of a contact that is computed on first access and then kept."""

    @functools.wraps(method)
    def found(contact: Contact) -> Numbers:
        value: Numbers = named(method(contact), method.__name__, contact._source.units)
        return value

    return functools.cached_property(found)


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Contact(Interface, Displayed):
    """Result of a contact: pressure, area and derived quantities; arrays of the broadcast shape, or DataArrays."""

    separation: Numbers  #: d, between the rigid plane and the mid-plane [length]
    mean_separation: Numbers  #: u = (h_max + d)/2 (50) [length]
    pressure: Numbers  #: F/A0 in the unit of E_star; F/(A0 E*) where that is 1
    area: Numbers  #: A/A0; MBMA does not end at 1 under full compression, and this is not clamped
    # : bound on the relative numerical error of both against the theory (for "mbma" against
    # its island model), NaN where : not known; the deviation of the theory from simulation
    # is `scatter`
    error: Numbers
    # : name of what computed them; variant and island model are empty unless the theory is
    # MBMA
    theory: str
    variant: str
    island_model: str
    islands: (
        int | None
    )  #: number of islands evaluated; None if computed by dask or if the theory has none
    _source: Source = dataclasses.field(repr=False, kw_only=True)

    @property
    def units(self) -> dict[str, str]:
        """The unit of each quantity; "1" where it has none, and stresses are over E* where no modulus was given."""
        names = {*MEANINGS, "elastic_hardness"} - {"valid"}
        return {name: unit_of(name, self._source.units) for name in sorted(names)}

    def _facts(self) -> dict[str, str]:
        units, source = self.units, self._source
        chosen = f" ({self.variant}, {self.island_model})" if self.variant else ""
        facts = {"theory": self.theory + chosen}
        if source.surface.resolution:
            facts["resolution"] = source.surface.resolution
        for name in ("mean_separation", "pressure", "area"):
            facts[name] = shown(getattr(self, name), units[name])
        if (
            any_labelled(source.surface, self.mean_separation)
            or np.size(self.error) > MOST_SHOWN
        ):
            return facts
        if np.all(self.area == 0):
            facts["contact"] = "none: the bodies are apart"
        facts["separation_scatter"] = shown(
            self.separation_scatter, units["separation_scatter"]
        )
        facts |= {
            name: shown(values, unit)
            for name, (values, unit) in self._stiffness().items()
        }
        if source.materials is not None and source.units.length is None:
            facts["conductance"] = "needs the surface's unit"
        more = {
            name: getattr(self, name)
            for name in ("error", "scatter", "stiffness_scatter", "valid")
        }
        if source.yields:
            more["unloading_stiffness_scatter"] = self.unloading_stiffness_scatter
            more |= {"psi": self.psi, "yielded": self.yielded}
            facts["loading"] = FIRST_LOADING
        elif units["pressure"] != "1":
            facts["elastic_hardness"] = shown(self.elastic_hardness, units["pressure"])
            # reveals a pressure in an unintended unit
            light = self.elastic_hardness * ELASTIC_PSI / 2
            if np.any(self.pressure > light):
                limit = shown(light, units["pressure"])
                facts["pressure"] += (
                    f" (above E* g/2 = {limit}, the mean pressure in light contact)"
                )
        if source.theory.advice:
            facts["advice"] = source.theory.advice
        return facts | {name: shown(value) for name, value in more.items()}

    def _stiffness(self) -> dict[str, tuple[Any, str]]:
        """Stiffnesses, and the conductance of named materials, with their units."""
        found = {"stiffness": (self.stiffness, self.units["stiffness"])}
        if self._source.yields:
            found["unloading_stiffness"] = (
                self.unloading_stiffness,
                self.units["unloading_stiffness"],
            )
        if self._source.materials is not None and self._source.units.length is not None:
            found["conductance"] = self.conductance(), "W/(m^2 K)"
        return found

    def _variables(self) -> dict[str, Variable]:
        source = self._source
        known = {
            n: getattr(self, n)
            for n in MEANINGS
            if n not in (("energy",) if source.yields else OF_HARDNESS)
        }
        return {
            n: Variable(v, unit_of(n, source.units), MEANINGS[n])
            for n, v in known.items()
            if v is not None
        }

    def _origin(self) -> dict[str, str]:
        source = self._source
        return {
            "E_star": shown(source.E_star, unit_of("pressure", source.units)),
            "surface": repr(source.surface),
        }

    def _figure(self) -> Any:
        source, unit = self._source, self.units["pressure"]
        title = f"hardness {shown(source.hardness, unit)}" if source.yields else ""
        order = np.argsort(-np.ravel(self.mean_separation), kind="stable")
        more: dict[str, dict[str, Any]] = {}
        for name, (values, of_values) in self._stiffness().items():
            label = f"{name.rpartition('_')[2]} [{of_values}]"
            more.setdefault(label, {})[name.replace("_", " ")] = np.ravel(values)[order]
        return draw_compression([self.curve()], title, pressure_label(unit), more=more)

    def curve(self, leakage: bool = False) -> Curve:
        """The line that plots draw, for one surface at several separations; optionally with its leakage."""
        surface = self._source.surface
        if np.size(self.pressure) < 2 or surface.shape != ():
            raise InputError(
                "one surface's force and area at several separations make a curve, and this has none"
            )
        order = np.argsort(-np.ravel(self.mean_separation), kind="stable")
        fields = [
            self.mean_separation / surface.h_rms,
            self.pressure,
            self.area,
            self.scatter,
            self.area_scatter,
        ]
        if leakage:
            fields += [self.leakage.K, self.leakage.scatter]
        label = theory_label(self.theory) + (f", {self.variant}" if self.variant else "")
        return Curve(label, *(np.ravel(field)[order] for field in fields))

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
        >>> pressed = contact(surface, pressure="10 MPa", E_star="1 GPa").map()
        >>> data = pressed.to_dataset()
        >>> f"{float(data.pressure.mean()):.3f} {data.pressure.units} on {float(data.contact.mean()):.0%} of the points"
        '0.010 GPa on 45% of the points'
        """
        from mbma_tables.theories.simulated import boundary_elements, pressing
        from mbma_tables.theories.simulated.own_map import map_of, sides

        source, pressure = self._source, np.asarray(self.pressure, float)
        if pressure.ndim or np.ndim(source.E_star) or np.ndim(source.hardness):
            raise InputError(
                "a map is of one contact: give one pressure, one modulus and one hardness"
            )
        surface: Any = source.surface
        whole = map_of(surface)
        modulus, force = float(source.E_star), float(pressure) / float(source.E_star)
        if not 0 < force < np.inf:
            raise InputError(f"a map needs a pressure above 0, got {float(pressure):g}")
        values, sizes = whole.heights - whole.heights.mean(), sides(whole)
        # of rms gradient one, heights of order one
        scale, gradient = float(np.abs(values).max()), float(surface.bearing.gradient)
        stretched = sizes[0] * gradient / scale, sizes[1] * gradient / scale
        cap = float(source.hardness) / modulus / gradient
        engine = boundary_elements.Contact(
            values / scale, stretched, pressing.TOLERANCE, cap, not whole.periodic
        )
        with progress("boundary elements"):
            engine.press(force / gradient)
        units = {"pressure": self.units["pressure"]} | dict.fromkeys(
            ("gap", "heights"), source.units.length or "1"
        )
        return ContactMap(
            whole.steps,
            units,
            modulus * gradient * engine.traction,
            scale * engine.gap,
            values,
        )

    @functools.cached_property
    def _answer(self) -> TheoryAnswer:
        """The theory's result at these separations, computed once."""
        source = self._source
        if source.answer is not None:
            return source.answer
        found: Any = source.map(lambda theory, s, u, E: theory.answer(s, u), self, 4)
        return TheoryAnswer(*found)

    @described
    def stiffness(self) -> Any:
        """-d(F/A0)/du [stress/length] of loading, against the mean separation; computed when first read."""
        return (self._source.E_star * self._answer.stiffness)[()]

    @described
    def energy(self) -> Any:
        """Elastic energy per nominal area [stress length], the integral of F/A0 over u; computed when first read."""
        if self._source.yields:
            raise InputError(
                "energy: the energy that a yielded contact gives back is not known, since its residual shape is not; "
                "contact_law(..., hardness=...).energy is the work of loading, unloading_stiffness the "
                "initial stiffness of unloading"
            )
        return self._source.map(
            lambda theory, s, u, E: (E * theory.energy(s, u),), self, 1
        )[0]

    def _of_loading(self, name: str, elastic: Any) -> Any:
        """A field of `Loaded`, divided by E*; `elastic` where nothing yields."""
        source = self._source
        if not source.yields:
            return elastic
        if source.loaded is not None:
            return getattr(source.loaded, name)[()]
        return source.map(
            lambda theory, s, u, E: (getattr(theory.loaded(s, u), name),), self, 1
        )[0]

    @described
    def yielded(self) -> Any:
        """Share of the contact area at the hardness, 0 to 1."""
        return self._of_loading("yielded", 0.0 * self.mean_separation)

    @described
    def unloading_stiffness(self) -> Any:
        """-d(F/A0)/du [stress/length] of a small unloading at constant contact area; `stiffness` if nothing yields."""
        if not self._source.yields:
            return self.stiffness
        return (self._source.E_star * self._of_loading("unloading_stiffness", None))[()]

    @described
    def plane_separation(self) -> Any:
        """Gap between the mean planes [length]: u less the flattening of yielded points."""
        return self._of_loading("plane_separation", self.mean_separation)

    @property
    def psi(self) -> Any:
        """Plasticity index E* g/p_m, g the rms gradient; 0 where the hardness is infinite."""
        return (
            self._source.E_star
            * self._source.surface.rms_gradient
            / self._source.hardness
        )[()]

    @property
    def elastic_hardness(self) -> Any:
        """Hardness above which the elastic area is within 5%, E* g/1.1 [stress]."""
        return (self._source.E_star * self._source.surface.rms_gradient / ELASTIC_PSI)[()]

    @described
    def mean_pressure(self) -> Any:
        """Mean pressure in the contact, F/A [stress]; NaN where there is none."""
        with np.errstate(invalid="ignore"):
            return self.pressure / self.area

    @described
    def scatter(self) -> Any:
        """Model uncertainty, one standard deviation of ln F at this mean separation; NaN if unknown."""
        return self._scatter("pressure")

    @described
    def area_scatter(self) -> Any:
        """Model uncertainty, one standard deviation of ln A at this pressure."""
        return self._scatter("area")

    @described
    def stiffness_scatter(self) -> Any:
        """Model uncertainty, one standard deviation of ln `stiffness` at this pressure.

        NaN where a hardness is given: the slope of the loading curve of contacts that yield
        was not compared with simulations; `unloading_stiffness_scatter` is that of their
        unloading stiffness and conductance.
        """
        return self._scatter("stiffness")

    @described
    def unloading_stiffness_scatter(self) -> Any:
        """Model uncertainty, one standard deviation of ln `unloading_stiffness` at this pressure.

        Also of the conductance and of the tangential stiffness, which are proportional to
        it. Without a hardness both stiffnesses are the same, and so are their
        uncertainties.
        """
        return self._scatter(
            "unloading_stiffness" if self._source.yields else "stiffness"
        )

    @described
    def separation_scatter(self) -> Any:
        """Model uncertainty of the mean separation at this pressure [length], `scatter` times F/(-dF/du)."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return self.scatter * self._answer.pressure / np.abs(self._answer.stiffness)

    def _scatter(self, of: str) -> Numbers:
        return self._source.map(
            lambda by, s, u, E, A: (by.scatter(s, of, A),), self, 1, {"area": self.area}
        )[0]

    @functools.cached_property
    def leakage(self) -> Leakage:
        """Flow through the gaps of the contact; computed when first read."""
        from mbma_tables.contacts.leakage import leakage_of

        return leakage_of(self)

    @property
    def _against(self) -> tuple[Any, ...]:
        """Arguments for `Source.valid` and `Source.reasons`."""
        return (
            self,
            functools.partial(reasons_against, self._source),
            self._answer._asdict(),
        )

    @described
    def valid(self) -> Any:
        """Whether the theory was tested for such contacts; if not, `reasons` gives where and why."""
        return self._source.valid(*self._against)

    @functools.cached_property
    def reasons(self) -> dict[str, Any]:
        """Reasons why entries are not `valid`, each with the mask of these entries as a plain array."""
        return self._source.reasons(*self._against)


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
        length, stress = (
            {"1": "length"}.get(self.units["gap"], self.units["gap"]),
            self.units["pressure"],
        )
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
