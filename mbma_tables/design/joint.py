"""`Joint`: two rough metal parts and all their interface laws."""

from __future__ import annotations

import dataclasses
import functools
import os
import pathlib
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.bodies.bodies import (
    Bodies,
    BodiesInUnits,
    after,
    is_array,
    names_metals,
)
from mbma_tables.bodies.materials import Pair, tangential_ratio
from mbma_tables.common.arguments import (
    FloatArray,
    any_labelled,
    broadcast_shape,
    finite_array,
    hinted,
    is_labelled,
    one_number,
    positive_array,
    require,
    require_name,
    spread,
)
from mbma_tables.common.display import Displayed, Variable, dataset_of, saved, shown
from mbma_tables.common.distributions import (
    Distribution,
    distribution_of,
    distributions_in,
    of_all,
    with_numbers,
)
from mbma_tables.common.errors import InputError, OutOfRangeError
from mbma_tables.common.plots import draw_panels
from mbma_tables.common.toml_files import read_toml
from mbma_tables.common.units import (
    Units,
    force_over_area,
    stated_unit,
)
from mbma_tables.contacts.contact import contact_of
from mbma_tables.contacts.law.law import ContactLaw
from mbma_tables.contacts.law.make import law_of
from mbma_tables.contacts.quantities import registry
from mbma_tables.contacts.quantities.interface import Gas, Interface
from mbma_tables.contacts.quantities.leakage import checked_seal
from mbma_tables.contacts.quantities.properties import JointQuantities
from mbma_tables.contacts.quantities.tangential import (
    checked_direction,
    checked_friction,
    ratio_on,
)
from mbma_tables.contacts.result import Contact
from mbma_tables.design.body_numbers import BodyNumbers
from mbma_tables.design.derivatives import Described
from mbma_tables.design.functions import ContactFunction
from mbma_tables.design.labels import Labels
from mbma_tables.design.sensitivity import Sensitivity, sensitivity_of
from mbma_tables.design.specimen import is_of_numbers, surface_of_entries, take_theory
from mbma_tables.design.uncertainty import (
    DRAWS,
    LEVELS,
    Description,
    Pressed,
    Replica,
    Uncertainty,
    bodies_of_entries,
    entries_of_bodies,
    replicas_of,
    uncertainty_of,
)
from mbma_tables.design.unknowns import OfOneMap, Unknowns, unknowns_of
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.drawing import entries_of, lacks_area, with_area
from mbma_tables.surfaces.roughness import TOPS
from mbma_tables.surfaces.surface import Surface, assumptions
from mbma_tables.theories import THEORIES, is_table, resolve, theory_text
from mbma_tables.theories.base import Theory
from mbma_tables.theories.named import OF_MAPS, options_of

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from mbma_tables.export.request import Subject

Part = AnySurface | Mapping[str, Any]
FACES = ("part_a", "part_b")
EXAMPLE = '{"Rq": "0.4 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}'
# the unit of a plain modulus
PLAIN_STRESS = "GPa"
# pressures over the hardness, and their number, in pictures
RANGE = (1e-5, 0.3)
POINTS = 41


def equivalent(faces: Sequence[Any], nominal_area: Any) -> AnySurface:
    """The rough surface whose contact with a smooth one is that of one or two faces.

    With a nominal area its highest point is that of Gaussian heights of this area.
    """
    surface: AnySurface
    if len(faces) == 2:
        surface = faces[0].combined(faces[1], nominal_area)
    elif nominal_area is None:
        surface = faces[0]
    else:
        surface = dataclasses.replace(faces[0], h_max=None, nominal_area=nominal_area)
    return surface


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Joint(JointQuantities, Displayed):
    """Two rough metal parts pressed together: stiffness, real area, gap and conductance from one description.

    Numbers of the parts, `nominal_area`, constants in `Bodies` and those of the gas may be
    arrays, which broadcast to a batch of joints: quantities of `at_pressure` then have the
    broadcast shape, with that of the pressures. Tables, plots, laws and exports are of one
    joint.

    Parameters
    ----------
    part_a, part_b : Surface or mapping
        Roughness of each part: a surface (from a map, a profile, a spectrum or five
        numbers); the arguments of `Surface.from_roughness` without a highest point; those
        of `Surface` or `Surface.from_moments`; or those of `Surface.from_map`, with the
        file under "map". Without `part_b` the other
        face is smooth.
    bodies : str, Metal, pair of them, float, or Bodies
        Metals of the parts, from `mbma_tables.bodies.materials.METALS`, or the arguments of
        `materials.Metal` by name; one if both are the same. Or `Bodies`, with the hardness
        of the softer metal, as for `contact`: by default it is that of the metals, whose
        temper must then be named. Or the effective modulus, "58 GPa"; a plain number is in
        GPa. Plain pressures, here and in every method but `export`, are in the unit of the
        modulus, GPa for metals.
    nominal_area : array_like or str, optional
        A0 [length^2], from which the highest point of Gaussian heights follows (`Surface`);
        needed for parts that are mappings. Without it, surfaces keep their own highest
        point.
    friction : array_like, optional
        Coefficient of friction, for slip (`Contact.tangential`) and friction cards of solvers.
    direction : {"along", "across"}, optional
        Of the shear relative to the lay, for parts that have one.
    gas : {"air", "helium", "nitrogen", "argon", "vacuum"} or Gas
        In the gaps, at 300 K and 1 atm, or ``Gas("helium", temperature=400)``.
    seal : mapping, optional
        For `leak_rate`, the arguments of `Leakage.gas` or of `Leakage.liquid` by name:
        {"gas": "helium", "inlet": "2 bar", "outlet": "1 bar", "width": "2 mm"}, or
        {"viscosity": "0.1 Pa s", "pressure_drop": "0.5 MPa", "width": "2 mm"}.
    theory : str or Theory, optional
        As for `contact`.

    Attributes
    ----------
    surface : AnySurface
        The equivalent surface of both parts.
    pair : Pair or None
        The metals, where they are named.
    inputs : dict
        Numbers that are not known, by place such as "part_a.Ra". Numbers of the parts (not
        of maps), `nominal_area`, `friction`, constants of `bodies` and those of the gas and the seal may be ranges,
        "0.25..2.5 mm", means with a standard deviation, "1.6 um +- 0.2 um", or measured
        values, {"measured": ["1.5 um", "1.7 um"]}. Tables and plots then have quantiles, as
        `uncertainty`; `central` is the joint of the medians.
    assumed : dict
        By place, the ranges of what a drawing does not state, with the source of each: of
        parts that name their "process" and leave the Hurst exponent or the band of
        wavelengths out, {"Ra": "1.6 um", "process": "milled"}, as of `Surface.from_drawing`.

    Raises
    ------
    InputError, OutOfRangeError
        For any argument that a result would refuse later: the names of gas, theory and
        metals, the hardness, the numbers of a face, of which all that are missing are named
        at once.

    Examples
    --------
    >>> from mbma_tables import Joint
    >>> ground = {"Rq": "0.4 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
    >>> milled = ground | {"Rq": "0.7 um"}
    >>> metals = ("steel 4140 hard", "aluminium 6061 hard")
    >>> joint = Joint(ground, milled, bodies=metals, nominal_area="4 cm^2")
    >>> found = joint.at_pressure("10 MPa")
    >>> f"{found.area:.2%}, {found.solid_conductance:.3g} W/(m^2 K), {found.tangential_stiffness:.3g} GPa/um"
    '1.17%, 3.96e+04 W/(m^2 K), 0.0271 GPa/um'
    >>> table = joint.table(["10 MPa", "50 MPa"])
    >>> [f"{value:.3g}" for value in table["total_conductance"].values]
    ['5.72e+04', '2.07e+05']

    Three finishes of one part, each with two hardnesses:

    >>> from mbma_tables import Bodies
    >>> finishes = ground | {"Rq": ["0.2 um", "0.4 um", "0.8 um"]}
    >>> hardened = Bodies(metals=metals, hardness=[["0.95 GPa"], ["1.2 GPa"]])
    >>> batch = Joint(finishes, milled, bodies=hardened, nominal_area="4 cm^2")
    >>> batch.at_pressure("10 MPa").total_conductance.round(-2)
    array([[61600., 57200., 47500.],
           [59300., 54700., 44400.]])
    """

    part_a: Part
    part_b: Part | None = None
    _: dataclasses.KW_ONLY
    bodies: Any  # `Bodies` once it is made
    nominal_area: ArrayLike | str | None = None
    friction: Any = None  # ArrayLike or a range
    direction: str | None = None
    gas: str | Gas | Mapping[str, Any] = "air"
    seal: Mapping[str, Any] | None = None
    theory: str | Theory | None = None
    surface: AnySurface = dataclasses.field(init=False)
    interface: Interface = dataclasses.field(init=False)
    inputs: dict[str, Distribution] = dataclasses.field(init=False)
    assumed: dict[str, str] = dataclasses.field(init=False)
    _faces: dict[str, AnySurface] = dataclasses.field(init=False)
    _central: Joint | None = dataclasses.field(init=False)

    def __post_init__(self) -> None:
        self._complete_drawings()
        inputs = dict(distributions_in(self._entries))
        object.__setattr__(self, "inputs", inputs)
        if inputs:
            self._take_medians()
            return
        object.__setattr__(self, "_central", None)
        faces = {}
        for name in FACES:
            part = getattr(self, name)
            if part is not None or name == "part_a":
                faces[name] = self._face(name, part)
        object.__setattr__(self, "_faces", faces)
        drawn = (
            isinstance(self.part_a, Mapping)
            and "map" not in self.part_a
            and not is_of_numbers(self.part_a)
        )
        # a face made of numbers has the highest point of the nominal area already
        area = None if drawn and len(faces) == 1 else self.nominal_area
        surface = equivalent(list(faces.values()), area)
        object.__setattr__(self, "surface", surface)
        if is_array(self.bodies) and not names_metals(self.bodies):
            raise InputError(
                f"bodies are metals, a modulus of both, or Bodies; got {self.bodies!r}. Of two "
                "Young's moduli: Bodies(E=..., nu=...); of a batch of joints: Bodies(E_star=[...])"
            )
        # from here on every route reads the modulus and the hardness with their unit
        bodies = Bodies.of(self.bodies).with_stress_unit(PLAIN_STRESS)
        object.__setattr__(self, "bodies", bodies)
        checked_seal(self.seal)
        interface = Interface(self.friction, self.direction, Gas.of(self.gas), self.seal)
        object.__setattr__(self, "interface", interface)
        self._check()

    def _complete_drawings(self) -> None:
        """Take ranges for what drawings of the faces do not state, a face that names its process."""
        assumed: dict[str, str] = {}
        for name in FACES:
            part, of_part = entries_of(getattr(self, name))
            assumed |= {f"{name}.{key}": text for key, text in of_part.items()}
            if of_part and self.nominal_area is None and "nominal_area" in part:
                object.__setattr__(self, "nominal_area", part.pop("nominal_area"))
            object.__setattr__(self, name, part)
        faces = [getattr(self, name) for name in FACES]
        if self.nominal_area is None and any(lacks_area(part) for part in faces):
            area: dict[str, Any] = {}
            with_area(area, assumed)
            object.__setattr__(self, "nominal_area", area["nominal_area"])
        object.__setattr__(self, "assumed", assumed)

    @property
    def _typed(self) -> dict[str, Any]:
        """The arguments that have numbers."""
        names = (*FACES, "nominal_area", "friction", "gas", "seal", "bodies")
        return {name: getattr(self, name) for name in names}

    @property
    def _entries(self) -> dict[str, Any]:
        """What was typed, of which numbers may be distributions."""
        return self._typed | {"bodies": entries_of_bodies(self.bodies)}

    def _with(self, numbers: Mapping[str, Any]) -> Joint:
        """The joint of numbers in place of its inputs."""
        entries = with_numbers(self._entries, numbers)
        entries["bodies"] = bodies_of_entries(self.bodies, entries["bodies"])
        return dataclasses.replace(self, **entries)

    def _take_medians(self) -> None:
        """What is of the joint of the inputs' medians, after a check of both ends of each."""
        central = self._with(of_all(self.inputs, lambda each: each.median))
        for end in ("low", "high"):
            numbers = {
                name: each.written(getattr(each, end))
                for name, each in self.inputs.items()
            }
            typed = ", ".join(f"{name} = {number}" for name, number in numbers.items())
            try:
                self._with(numbers)
            except OutOfRangeError as fault:
                raise OutOfRangeError(
                    f"{fault}; at the ends of the ranges: {typed}", fault.mask
                ) from None
        for name in ("surface", "interface", "_faces"):
            object.__setattr__(self, name, getattr(central, name))
        object.__setattr__(self, "_central", central)

    @property
    def central(self) -> Joint:
        """The joint of the medians of all numbers that are not known; itself where all are."""
        return self if self._central is None else self._central

    def require_known(self, what: str) -> None:
        """Reject numbers that are not known where something is of one joint."""
        if self.inputs:
            raise InputError(
                f"{what} is of known numbers, and {', '.join(self.inputs)} are distributions: "
                "uncertainty(pressure) has the quantiles, central is the joint of their "
                "medians, replicas(n) are draws"
            )

    @property
    def description(self) -> Description:
        """How contacts are made of drawn numbers."""

        def make(numbers: Mapping[str, Any]) -> Pressed:
            return self._with(numbers).at_pressure

        return Description(self.inputs, make, "the joint")

    def uncertainty(
        self,
        pressure: ArrayLike | str,
        *,
        draws: int = DRAWS,
        quantiles: ArrayLike = LEVELS,
        quantities: Sequence[str] | None = None,
        seed: int = 0,
    ) -> Uncertainty:
        """Quantiles of every quantity at pressures, and the share of each number that is not known.

        The model's own error is drawn, too: one number for each draw, in standard
        deviations, multiplies the stated scatter of every quantity at every pressure.

        Parameters
        ----------
        pressure : array_like or str
            F/A0, one or several, as for `at_pressure`; any may be a distribution, too.
        draws, quantiles, quantities, seed
            As for `mbma_tables.uncertainty`.

        Returns
        -------
        Uncertainty

        Raises
        ------
        InputError, OutOfRangeError
            As `mbma_tables.uncertainty`.

        Examples
        --------
        >>> from mbma_tables import Joint
        >>> face = {"Ra": "0.8 um +- 0.1 um", "hurst": 0.8, "longest": "0.25..2.5 mm", "shortest": "8 um"}
        >>> joint = Joint(face, bodies="steel 1020", nominal_area="4 cm^2", theory="calibrated")
        >>> found = joint.uncertainty("10 MPa")
        >>> shares = found.shares["solid_conductance"]
        >>> shares["part_a.longest"] > shares["part_a.Ra"] > 0
        array([ True])
        """
        return uncertainty_of(
            self.description,
            pressure,
            draws=draws,
            quantiles=quantiles,
            quantities=quantities,
            seed=seed,
        )

    def replicas(self, n: int, seed: int = 0) -> list[Replica]:
        """Draws of all numbers that are not known and of the model's error, for a loop of one's own.

        All quantities and loads of one replica belong together, as those of a member of a
        set of LHAPDF do. They are the first draws of `uncertainty` with the same seed.

        Examples
        --------
        >>> from mbma_tables import Joint
        >>> face = {"Ra": "0.8 um +- 0.1 um", "hurst": 0.8, "longest": "0.25..2.5 mm", "shortest": "8 um"}
        >>> joint = Joint(face, bodies="steel 1020", nominal_area="4 cm^2", theory="calibrated")
        >>> drops = [1e4 / replica.at_pressure("10 MPa").solid_conductance for replica in joint.replicas(100)]
        >>> len(drops), min(drops) < max(drops)
        (100, np.True_)
        """
        return replicas_of(self.description, n, seed)

    @property
    def pair(self) -> Pair | None:
        """The metals, where they are named."""
        metals: Pair | None = self.central.bodies.metals
        return metals

    @functools.cached_property
    def _in_units(self) -> BodiesInUnits:
        """The bodies as numbers."""
        stress = stated_unit("E_star", self.bodies.E_star) or PLAIN_STRESS
        in_units: BodiesInUnits = self.bodies.in_units(self.surface, stress)
        return in_units

    @functools.cached_property
    def _arrays(self) -> dict[str, Any]:
        """All numbers of the joint that may be arrays, by name."""
        in_units = self._in_units
        gas = self.interface.gas
        assert gas is not None
        numbers = {
            "parts and nominal_area": self.surface.h_max,
            "E_star": in_units.E_star,
            "hardness": in_units.hardness,
            "largest_pressure": in_units.largest,
            "conductivity": in_units.conductivity_if_known,
            "temperature": gas.temperature,
            "gas_pressure": gas.pascals,
            "accommodation": gas.accommodation,
            "friction": self.friction,
        }
        numbers |= self._arrays_of_seal
        return {name: value for name, value in numbers.items() if value is not None}

    @property
    def _arrays_of_seal(self) -> dict[str, Any]:
        """Numbers of the seal that may be arrays, by name, and those of its gas."""
        seal = dict(self.seal or {})
        gas = seal.pop("gas", None)
        seal |= gas if isinstance(gas, Mapping) else {}
        return {
            f"seal.{name}": each
            for name, each in seal.items()
            if not isinstance(each, str)
        }

    @property
    def _is_labelled(self) -> bool:
        return any_labelled(self.surface, *self._arrays.values())

    @functools.cached_property
    def shape(self) -> tuple[int, ...]:
        """Shape of a batch of joints; () for one."""
        return broadcast_shape(**self._arrays)

    def require_one(self, what: str) -> None:
        """Reject a batch where something is of one joint."""
        self.require_known(what)
        if self._is_labelled or self.shape != ():
            raise InputError(
                f"{what} is of one joint, and this is a batch"
                f"{'' if self._is_labelled else f' of shape {self.shape}'}: make a Joint of one "
                "entry's numbers, or take the quantities of at_pressure(...), which has all entries"
            )

    def _face(self, name: str, part: Any) -> AnySurface:
        """The surface of a part."""
        if isinstance(part, AnySurface):
            return part
        if not isinstance(part, Mapping):
            raise InputError(
                f"{name} is a surface, or its numbers by name, such as {EXAMPLE}; got {part!r}"
            )
        try:
            if "map" in part:
                options = {key: value for key, value in part.items() if key != "map"}
                return Surface.from_map(part["map"], **options)
            if "nominal_area" in part:
                raise InputError(
                    "nominal_area is of the joint, Joint(part_a, part_b, nominal_area=...), "
                    "in a file above the tables of the parts"
                )
            if is_of_numbers(part):
                return surface_of_entries(part)
            made: AnySurface = Surface.from_roughness(
                **part, nominal_area=self.nominal_area
            )
        except TypeError as fault:
            raise InputError(f"{name}: {fault}") from None
        except OutOfRangeError as fault:
            raise OutOfRangeError(f"{name}: {fault}", fault.mask) from None
        except InputError as fault:
            raise InputError(f"{name}: {fault}") from None
        return made

    def _check(self) -> None:
        """Refuse at once what single results would refuse."""
        if not self._is_labelled:
            broadcast_shape(**self._arrays)
        checked_friction(self.friction)
        checked_direction(self.direction, self.surface)
        if self.bodies.nu is not None:
            one_number("nu", tangential_ratio(self.bodies.nu, self.bodies.E))
        if is_table(self.theory):
            resolve(self.theory)
        elif isinstance(self.theory, str):
            require_name("theory", self.theory, (*THEORIES, *OF_MAPS))
            surface: Any = self.surface
            points = getattr(surface, "map", None), getattr(surface, "table", None)
            if self.theory in OF_MAPS and points == (None, None):
                raise InputError(
                    f"theory {self.theory!r} is of one map: a joint of two faces, or of numbers, has none; "
                    "theory='calibrated' applies"
                )
        elif self.theory is not None:
            resolve(self.theory, self.surface)

    @classmethod
    def from_toml(cls, path: str | os.PathLike[str]) -> Joint:
        """The joint that a TOML file describes: the arguments by name, the parts as tables.

        Options of the theory "mbma", such as ``island_model = "mine.nc"``, are entries too.
        Paths of maps and of tables are relative to the file.

        Raises
        ------
        InputError
            For a file that is not valid TOML, and for unknown or missing arguments.

        Examples
        --------
        >>> from mbma_tables import Joint
        >>> Joint.from_toml("examples/joint.toml").pair.softer.name  # doctest: +SKIP
        'aluminium 6061 hard'
        """
        path = pathlib.Path(path)
        return cls.from_entries(read_toml(path, "joint"), path)

    @classmethod
    def from_entries(
        cls, entries: Mapping[str, Any], path: pathlib.Path = pathlib.Path("joint")
    ) -> Joint:
        """The joint of the entries of a TOML file, whose path is that of a file of maps and of messages."""
        given = dict(entries)
        take_theory(given, options_of("mbma"), pathlib.Path(path).parent)
        for name in FACES:
            part = given.get(name)
            if isinstance(part, Mapping) and "map" in part:
                given[name] = {**part, "map": path.parent / part["map"]}
        try:
            return cls(**given)
        except TypeError as fault:
            raise InputError(f"{path}: {fault}") from None

    def pressure_of(self, force: float | str) -> Any:
        """F/A0 of a force on the nominal area, with its unit, as every method with a pressure takes it; a list for areas.

        Parameters
        ----------
        force : float or str
            "40 kN"; plain numbers in N. Of a range, "30..50 kN", the pressure is a range.

        Raises
        ------
        InputError, OutOfRangeError
            Without a nominal area, and for forces that are not positive.

        Examples
        --------
        >>> from mbma_tables import Joint
        >>> face = {"Rq": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
        >>> joint = Joint(face, bodies="steel 1020", nominal_area="4 cm^2", theory="calibrated")
        >>> joint.pressure_of("40 kN"), f"{joint.at_pressure(joint.pressure_of('40 kN')).pressure:.2f} GPa"
        ('100000000 Pa', '0.10 GPa')
        """
        if "nominal_area" in self.inputs:
            self.require_known("the pressure of a force")
        if self.nominal_area is None:
            raise InputError("a force needs nominal_area, over which it is the pressure")
        known = distribution_of("force", force)
        if known is None:
            return force_over_area(force, self.nominal_area, self.surface.unit)
        one = force_over_area(
            f"1 {known.unit or 'N'}", self.nominal_area, self.surface.unit
        )
        if not isinstance(one, str):
            raise InputError(f"force = {known.text!r} is of one joint, not of a batch")
        return known.retyped(float(one.removesuffix(" Pa")), "Pa")

    def at_pressure(self, pressure: ArrayLike | str) -> Contact:
        """The contact at pressures F/A0 ("10 MPa"; plain numbers in the unit of the modulus), as of `contact`.

        Each of several pressures is reached by first loading, also where a smaller one follows
        a larger one: `path` has pressures one after the other, and `after` a joint that was
        loaded before.
        """
        return self.at(pressure=pressure)

    def after(self, largest_pressure: ArrayLike | str) -> Joint:
        """The joint after a largest pressure: contacts below it unload and reload on what yielded.

        Every method of it is about such contacts: its law, tables, plots, and exports, as
        those of a joint about its preload.

        Parameters
        ----------
        largest_pressure : array_like or str
            F/A0; plain numbers in the unit of the modulus.

        Raises
        ------
        InputError
            For a joint whose bodies have a largest pressure.

        Examples
        --------
        >>> from mbma_tables import Joint
        >>> face = {"Rq": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
        >>> joint = Joint(face, bodies="steel 1020", nominal_area="4 cm^2", theory="calibrated")
        >>> preloaded = joint.after("50 MPa")
        >>> first, later = joint.at_pressure("25 MPa"), preloaded.at_pressure("25 MPa")
        >>> bool(later.stiffness > 1.5 * first.stiffness)
        True
        """
        return dataclasses.replace(self, bodies=after(self.bodies, largest_pressure))

    def path(self, pressures: ArrayLike | Sequence[str]) -> Contact:
        """The contacts at pressures that follow one another, each after the largest before it.

        Parameters
        ----------
        pressures : array_like or sequence of str
            F/A0 in their order; plain numbers in the unit of the modulus.

        Returns
        -------
        Contact
            One entry a pressure. Its energy is what unloading from there gives back.

        Raises
        ------
        InputError
            For a batch of joints, and where pressures are no list of numbers.

        Examples
        --------
        >>> from mbma_tables import Joint
        >>> face = {"Rq": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
        >>> joint = Joint(face, bodies="steel 1020", nominal_area="4 cm^2", theory="calibrated")
        >>> pressed = joint.path(["25 MPa", "50 MPa", "25 MPa", "50 MPa", "60 MPa"])
        >>> [f"{gap:.2f}" for gap in pressed.mean_separation]
        ['1.38', '1.13', '1.29', '1.13', '1.06']
        """
        self.require_one("a path")
        in_units = self._in_units
        numbers = finite_array("pressures", in_units.units.number("pressure", pressures))
        if numbers.ndim != 1:
            raise InputError(
                f"pressures are a list of numbers in their order, got shape {numbers.shape}"
            )
        before = 0.0 if in_units.largest is None else float(in_units.largest)
        largest = np.maximum(np.maximum.accumulate(numbers), before)
        return contact_of(
            self.surface,
            dataclasses.replace(in_units, largest=largest),
            {"pressure": numbers},
            self.theory,
            self.interface,
        )

    def settling(self, pressure: ArrayLike | str, reference: ArrayLike | str) -> Any:
        """Approach of the bodies that stays after a pressure [length]: what a bolt loses of its stretch.

        It is the difference of the gaps of mean planes at a small pressure in first loading,
        and at the same pressure after the larger one.

        Parameters
        ----------
        pressure : array_like or str
            The largest F/A0.
        reference : array_like or str
            The small one, at which the joint was before; they broadcast.

        Raises
        ------
        OutOfRangeError
            Where the reference is not below the pressure.

        Examples
        --------
        >>> from mbma_tables import Joint
        >>> face = {"Rq": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
        >>> joint = Joint(face, bodies="steel 1020", nominal_area="4 cm^2", theory="calibrated")
        >>> f"{joint.settling('50 MPa', '1 MPa'):.2f} um"
        '0.66 um'
        """
        units = self._in_units.units
        largest = finite_array("pressure", units.number("pressure", pressure))
        least = finite_array("reference", units.number("pressure", reference))
        largest, least = np.broadcast_arrays(largest, least)
        require("reference", least, least < largest, "below the pressure")
        first = self.at(pressure=least).plane_separation
        return first - self.after(largest[()]).at(pressure=least).plane_separation

    def at(
        self,
        *,
        separation: ArrayLike | str | None = None,
        mean_separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Contact:
        """The contact at a gap, a pressure or an area, as of `contact`: each in first loading, or `after` a largest pressure.

        They broadcast with the arrays of the joint, and every quantity has the broadcast
        shape.

        Examples
        --------
        >>> from mbma_tables import Joint
        >>> face = {"Rq": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
        >>> joint = Joint(face, bodies="steel 1020", nominal_area="4 cm^2", theory="calibrated")
        >>> pressed = joint.at(mean_separation="2 um")
        >>> f"{pressed.area:.2%}, {joint.at(area=pressed.area).mean_separation:.3f} um"
        '0.29%, 2.000 um'
        """
        self.require_known("a contact")
        candidates = {
            "separation": separation,
            "mean_separation": mean_separation,
            "pressure": pressure,
            "area": area,
        }
        for name, value in candidates.items():
            if value is not None:
                candidates[name] = self._spread(name, value)
        return contact_of(
            self.surface, self._of_entries, candidates, self.theory, self.interface
        )

    @functools.cached_property
    def _of_entries(self) -> BodiesInUnits:
        """The bodies of a batch, each with a modulus, so that what depends on them alone has its shape."""
        in_units = self._in_units
        if self._is_labelled or self.shape == ():
            return in_units
        modulus = spread(np.asarray(in_units.E_star), self.shape)
        return dataclasses.replace(in_units, E_star=modulus)

    def _spread(self, name: str, value: Any) -> Any:
        """A gap, pressure or area in the units of the joint, for a batch in its shape.

        All quantities have this shape then, also where the gas alone differs.
        """
        given = self._in_units.units.number(name, value)
        if self._is_labelled or is_labelled(given) or self.shape == ():
            return given
        numbers = finite_array(name, given)
        return spread(numbers, broadcast_shape(**{name: numbers}, **self._arrays))

    def law(self) -> ContactLaw:
        """The joint's contact law, for many gaps or pressures, as of `contact_law`."""
        self.require_one("a law")
        return law_of(self.surface, self.bodies, self.theory, None, self.interface)

    def sensitivity(
        self, pressure: ArrayLike | str, quantities: Sequence[str] | None = None
    ) -> Sensitivity:
        """Quantities at a pressure and their derivatives by the numbers that the joint was described by.

        Parameters
        ----------
        pressure : array_like or str
            F/A0, held fixed; plain numbers in the unit of the modulus. It broadcasts with
            the arrays of the joint.
        quantities : sequence of str, optional
            As for `sensitivity`; by default with the conductances of the joint.

        Returns
        -------
        Sensitivity
            With a row for each number of each face, "part_a.Rq", "part_a.longest"; Young's
            moduli, Poisson's ratios and conductivities of both bodies, "part_a.E",
            "part_b.nu"; the nominal area, the hardness of the softer metal, the pressure,
            and the "temperature", "gas_pressure" and "accommodation" of a gas that is not
            given by its name alone. Of a face given by a spectrum or a map as for
            `sensitivity`: "part_a.heights", "part_a.lengths", its cut-offs.

        Raises
        ------
        InputError, OutOfRangeError
            As `sensitivity`.

        Examples
        --------
        >>> from mbma_tables import Joint
        >>> face = {"Rq": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
        >>> metal = "copper C11000 hard"
        >>> joint = Joint(face, bodies=metal, nominal_area="4 cm^2", theory="calibrated")
        >>> slopes = joint.sensitivity("10 MPa").slopes
        >>> f"conductance goes like Rq^{slopes['part_a.Rq']['solid_conductance']:.2f}"
        'conductance goes like Rq^-0.67'
        """
        self.require_known("a sensitivity")
        labels = Labels.of(*self._typed.values(), pressure)
        typed = {name: labels.plain(each) for name, each in self._typed.items()}
        joint = self if labels.template is None else dataclasses.replace(self, **typed)
        described = joint.described("pressure", labels.plain(pressure))
        return sensitivity_of(described, quantities, labels)

    def function(
        self,
        quantities: str | Sequence[str],
        numbers: Sequence[str],
        pressure: float | str,
    ) -> ContactFunction:
        """Quantities at a pressure as a differentiable function of some numbers of the joint, for optimisers, JAX and PyTorch.

        Parameters
        ----------
        quantities : str or sequence of str
            Names of quantities.
        numbers : sequence of str
            Names of the numbers that the function takes, as `sensitivity` has them, such as
            "part_a.Rq", "hardness", "pressure"; all others stay those of the joint.
        pressure : float or str
            F/A0, plain numbers in the unit of the modulus; where "pressure" is among the
            numbers, that at which a search begins.

        Returns
        -------
        ContactFunction

        Raises
        ------
        InputError, OutOfRangeError
            As `sensitivity`; for names that are unknown, and for batches.

        Examples
        --------
        >>> from mbma_tables import Joint
        >>> face = {"Rq": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
        >>> joint = Joint(face, bodies="copper C11000 hard", nominal_area="4 cm^2", theory="calibrated")
        >>> conductance = joint.function("total_conductance", ["part_a.Rq", "pressure"], "10 MPa")
        >>> value, gradient = conductance.values_and_jacobian([0.4, 0.02])  # um, GPa
        >>> f"{value:.3g} W/(m^2 K), {gradient[0]:.3g} more for each um"
        '6.97e+05 W/(m^2 K), -1.53e+06 more for each um'
        """
        self.require_one("a function")
        return ContactFunction.of(
            self.described("pressure", pressure), quantities, numbers
        )

    def described(self, by: str, value: Any) -> Described:
        """All numbers of the joint and the quantity at which it is asked for, for derivatives by each."""
        batches = [name for name, each in self._arrays_of_seal.items() if np.ndim(each)]
        if batches:
            raise InputError(
                f"derivatives are of one seal, and {', '.join(batches)} have several numbers: "
                "make a Joint of each"
            )
        chosen = resolve(self.theory, self.surface)
        in_units = self._in_units
        return Described.of(
            self.surface,
            self._unknowns(chosen),
            BodyNumbers.of(in_units, self.interface, isinstance(self.gas, str)),
            chosen,
            by,
            self._spread(by, value),
        )

    def _unknowns(self, theory: Theory) -> Unknowns:
        """The numbers of the faces, each with the name of its part before it, and the nominal area."""
        unit = self.surface.unit
        overridden = () if self.nominal_area is None else TOPS
        alone = len(self._faces) == 1
        if alone:
            own = unknowns_of(self.surface, theory, unit)
            if (
                not overridden
                or isinstance(own, OfOneMap)
                or "nominal_area" in own.numbers
            ):
                labels = {name: f"part_a.{name}" for name in own.numbers}
                if overridden:
                    labels["nominal_area"] = "nominal_area"
                return dataclasses.replace(own, labels=labels)
        faces = {
            name: unknowns_of(face, theory if alone else None, unit)
            for name, face in self._faces.items()
        }
        numbers: dict[str, float] = {}
        one_sided: dict[str, float] = {}
        fixed: dict[str, dict[str, float]] = {}
        for part, face in faces.items():
            # the nominal area determines the highest point of Gaussian heights
            fixed[part] = {
                name: float(np.max(number))
                for name, number in face.numbers.items()
                if name in overridden
            }
            for name, number in face.numbers.items():
                if name not in overridden:
                    numbers[f"{part}.{name}"] = number
            one_sided |= {f"{part}.{name}": sign for name, sign in face.one_sided.items()}
        if overridden:
            numbers["nominal_area"] = Units(unit).number(
                "nominal_area", self.nominal_area
            )

        def make(**given: Any) -> AnySurface:
            surfaces = []
            for part, face in faces.items():
                own = {
                    name: given[f"{part}.{name}"]
                    for name in face.numbers
                    if name not in fixed[part]
                }
                surfaces.append(face.make(**own, **fixed[part]))
            return equivalent(surfaces, given.get("nominal_area"))

        at_once = all(face.batches for face in faces.values())
        if at_once:
            return Unknowns(numbers, make, batches=True, one_sided=one_sided)
        # moduli, pressure and hardness are varied with the same surface
        return Unknowns(numbers, functools.cache(make), one_sided=one_sided)

    def export(
        self,
        target: str,
        pressures: tuple[float | str, float | str] | None = None,
        *,
        path: str | os.PathLike[str] | None = None,
        **options: Any,
    ) -> str | bytes | list[pathlib.Path]:
        """The joint as input of a solver, as data or as code, for every target of laws of `mbma export`.

        Conductance in rows, cards and subroutines of solvers is the total one, of the solid
        spots and of the gas in the gaps together. Laws as code have `total_conductance`, and
        beside it `solid_conductance` and `gas_conductance`.

        Parameters
        ----------
        target : str
            A target of `mbma export` that accepts a law: rows such as "calculix", "abaqus",
            "csv", functions such as "c-law", "modelica-law" and "fmu".
        pressures : pair of float or str
            Smallest and largest pressure of rows; plain numbers in the unit of stress of the file.
        path : path-like, optional
            File to write, and beside it those that belong to it, by the end that the target
            gives them.
        **options
            Of the target, by the names of the options of `mbma export` with _ for -, and
            with the same defaults: docs/export.md has a table of them. `name` is that of
            the interaction or of the functions, `quantity` a name or several, `rows` and
            `rtol` the number of rows or their largest error, `length_unit` and `stress_unit`
            those of the file. `heat=False` leaves conductance out, which is written by
            default where bodies have a thermal conductivity; `made_by` has lines of the
            header on how the file was made.

        Returns
        -------
        str, bytes or list of pathlib.Path
            Without a path the first file of the target, bytes of a binary format; with a
            path the paths of all files. Solver input has a friction card if the joint has a
            coefficient of friction; functions contain the tangential stiffness, which
            needs Poisson's ratio of the bodies: comments say so where it is missing.

        Raises
        ------
        InputError
            For an option that the target does not take or that has a wrong type, for
            target "c", which is the whole model, and for a target that is several files
            without a path.

        Examples
        --------
        >>> from mbma_tables import Joint
        >>> face = {"Rq": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
        >>> copper = "copper C11000 hard"
        >>> joint = Joint(face, bodies=copper, nominal_area="4 cm^2", theory="calibrated")
        >>> card = joint.export("calculix", ("0.1 MPa", "50 MPa"), name="JOINT")
        >>> [line for line in card.splitlines() if line.startswith("*") and line[1] != "*"][:2]
        ['*SURFACE INTERACTION, NAME=JOINT', '*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=EXPONENTIAL']
        """
        from mbma_tables.export.request import exported

        given = {"pressures": pressures, **options}
        return exported(self.subject(), target, given, path)

    def subject(self) -> Subject:
        """What an export needs of the joint."""
        from mbma_tables.export.request import Subject, heat_of

        self.require_one("an export")
        return Subject(
            surface=self.surface,
            E_star=self.bodies.E_star,
            theory=self.theory,
            hardness=np.inf if self.bodies.hardness is None else self.bodies.hardness,
            largest_pressure=self.bodies.largest_pressure,
            heat=heat_of(self._in_units, self.surface),
            kappa=self._kappa,
            kappa_varies=self.direction is not None,
            friction=self.friction,
            gas=self.interface.gas,
            bodies=self.bodies,
            interface=self.interface,
            is_joint=True,
        )

    def _kappa(self, area: Any) -> Any:
        """Normal over tangential stiffness at a contact area, which only matters to surfaces with a lay."""
        simulated = resolve(self.theory, self.surface).surface_of(self.surface)
        return ratio_on(simulated, self.bodies, self.direction, area)

    def table(self, pressures: ArrayLike | Sequence[str]) -> xr.Dataset:
        """Every quantity of the joint at pressures, as an xarray Dataset with units and model uncertainties.

        Where numbers are not known it has their quantiles, as of `uncertainty`.
        """
        if self.inputs:
            return self.uncertainty(pressures).to_dataset()
        self.require_one("a table")
        pressed = self.at_pressure(np.atleast_1d(np.asarray(pressures)).tolist())
        variables = {}
        for name, variable in self.quantities(pressed).items():
            dims = ("pressure",) if np.ndim(variable.values) else ()
            variables[name] = variable._replace(dims=dims)
        return dataset_of(variables, self.facts_of(pressed))

    def quantities(self, pressed: Contact) -> dict[str, Variable]:
        """Values, units, meanings and model uncertainties of a contact of this joint, by name."""
        return pressed.variables()

    def plot(
        self,
        path: str | os.PathLike[str] | None = None,
        pressures: tuple[float | str, float | str] | None = None,
    ) -> Figure:
        """Plot the quantities against pressure, as `Contact.plot`.

        Parameters
        ----------
        path : str or path, optional
            File to save the figure to: "name.svg", .pdf, .png.
        pressures : pair of float or str, optional
            Smallest and largest pressure, plain numbers in the unit of the modulus;
            default: 1e-5 and 0.3 of the softer metal's hardness.

        Raises
        ------
        InputError
            For pressures that do not rise, and an unknown kind of file.
        """
        if pressures is None:
            return super().plot(path)
        between = self.central._pressures_between(pressures)
        if self.inputs:
            return self.uncertainty(between).plot(path)
        self.require_one("a plot")
        return saved(self._drawn(self.at_pressure(between)), path)

    def _pressures_between(self, pressures: Any) -> FloatArray:
        """Pressures of a plot between the smallest and the largest."""
        if not isinstance(pressures, tuple | list) or len(pressures) != 2:
            raise InputError(
                f"pressures are the smallest and the largest, got {pressures!r}"
            )
        units = self._in_units.units
        low, high = (
            float(
                positive_array(
                    "pressures", one_number("pressures", units.number("pressure", end))
                )
            )
            for end in pressures
        )
        if low >= high:
            raise InputError(
                f"pressures are the smallest and the largest, got {pressures!r}"
            )
        return np.geomspace(low, high, POINTS)

    def _range(self) -> FloatArray:
        """Pressures from 1e-5 to 0.3 of the softer metal's hardness."""
        in_units = self._in_units
        largest = float(np.asarray(in_units.hardness))
        if np.isinf(largest):
            # of metals without a temper the softest, else the mean pressure in light contact
            largest = float(in_units.E_star * self.surface.rms_gradient) / 2
            if self.pair is not None:
                largest = Units(stress=in_units.units.stress).number(
                    "pressure", f"{self.pair.softer.hardness[0]} GPa"
                )
        return np.geomspace(*RANGE, POINTS) * largest

    def facts(self) -> dict[str, str]:
        """The arguments of the joint, by name, and what its faces assume beyond them."""
        if self.inputs:
            typed = {name: each.text for name, each in self.inputs.items()}
            facts = self.central.facts() | typed
            lines = [f"{name} {text}" for name, text in self.assumed.items()]
            if "assumed" in facts:
                lines.append(facts["assumed"])
            return facts | ({"assumed": "; ".join(lines)} if lines else {})
        facts = {}
        hardness = self.bodies.hardness
        if self.pair is not None:
            metal_a, metal_b = self.pair.metals
            facts["metals"] = f"{metal_a.name} on {metal_b.name}"
            if self.bodies.conductivity == self.pair.conductivities:
                facts["conductivities"] = self.pair.ranges_of_conductivity
            if hardness is None:
                hardness = self.pair.without_hardness
        in_units = self._in_units
        facts["E_star"] = shown(in_units.E_star, str(in_units.units.stress))
        if is_array(hardness):
            hardness = shown(in_units.hardness, str(in_units.units.stress))
        facts["hardness"] = "infinite" if hardness is None else str(hardness)
        if in_units.largest is not None:
            facts["largest_pressure"] = shown(
                in_units.largest, str(in_units.units.stress)
            )
        facts["theory"] = theory_text(self.surface, self.theory)
        facts["gas"] = Gas.of(self.gas).name
        if self.seal is not None:
            facts["seal"] = ", ".join(
                f"{name} {each}" for name, each in self.seal.items()
            )
        facts["surface"] = repr(self.surface)
        assumed = assumptions(self.surface)
        if assumed:
            facts["assumed"] = "; ".join(assumed)
        return facts

    def facts_of(self, pressed: Contact) -> dict[str, str]:
        """The facts of the joint with what is known of a contact of it: the theory by which it was computed, and the loading."""
        facts = self.facts() | {"theory": pressed.theory}
        if pressed.loading:
            facts["loading"] = pressed.loading
        return facts

    _facts = facts

    def _variables(self) -> Mapping[str, Variable]:
        if self.inputs:
            return self.uncertainty(self.central._range())._variables()
        self.require_one("a dataset")
        return self.quantities(self.at_pressure(self._range()))

    def _figure(self) -> Figure:
        if self.inputs:
            return self.uncertainty(self.central._range())._figure()
        self.require_one("a plot")
        return self._drawn(self.at_pressure(self._range()))

    def _drawn(self, pressed: Contact) -> Figure:
        unit = pressed.units["pressure"]
        names = [name for name in registry.results() if name != "pressure"]
        return draw_panels(
            np.ravel(pressed.pressure), pressed.panels(names), f"pressure F/A0 [{unit}]"
        )


Joint.__init__ = hinted(Joint.__init__)  # type: ignore[method-assign]
