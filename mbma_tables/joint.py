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

from mbma_tables.common.arguments import (
    checked_hardness,
    hinted,
    one_number,
    positive_array,
    require_name,
)
from mbma_tables.common.display import Displayed, Variable, dataset_of, saved
from mbma_tables.common.errors import InputError, OutOfRangeError
from mbma_tables.common.plots import draw_panels
from mbma_tables.common.units import Units, force_over_area
from mbma_tables.contacts.contact import chosen_theory, contact
from mbma_tables.contacts.interface import checked_direction, checked_friction, ratio_of
from mbma_tables.contacts.result import Contact
from mbma_tables.contacts.sensitivity import (
    OfOneMap,
    Sensitivity,
    Unknowns,
    relative_derivatives,
    unknowns_of,
)
from mbma_tables.law.law import ContactLaw
from mbma_tables.law.make import contact_law
from mbma_tables.materials import Metal, Pair, effective_modulus, hardness_in, pair
from mbma_tables.quantities.gas import checked_gas
from mbma_tables.scenes.specimen import read_toml
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.roughness import TOPS
from mbma_tables.surfaces.surface import Surface, assumptions
from mbma_tables.theories import OF_MAPS, THEORIES, get_theory
from mbma_tables.theories.base import Theory

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from mbma_tables.export.of_joint import ExportedJoint

Part = AnySurface | Mapping[str, Any]
CONDUCTANCE = "W/(m^2 K)"
FACES = ("part_a", "part_b")
EXAMPLE = '{"Rq": "0.4 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}'
RANGE, POINTS = (
    (1e-5, 0.3),
    41,
)  # pressures over the hardness, and their number, in pictures


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
class Joint(Displayed):
    """Two rough metal parts pressed together: stiffness, real area, gap and conductance from one description.

    Parameters
    ----------
    part_a, part_b : Surface or mapping
        Roughness of each part: a surface (from a map, a profile, a spectrum or five
        numbers); the arguments of `Surface.from_roughness` without a highest point; or
        those of `Surface.from_map`, with the file under "map". Without `part_b` the other
        face is smooth.
    materials : str, Metal, mapping, or pair of them
        Metals of the parts, from `mbma_tables.materials.METALS`, or the arguments of
        `materials.Metal` by name; one if both are the same.
    nominal_area : float or str, optional
        A0 [length^2], from which the highest point of Gaussian heights follows (`Surface`);
        needed for parts that are mappings. Without it, surfaces keep their own highest
        point.
    hardness : float or str, optional
        Of the softer metal, as for `contact`; by default that of `materials`, whose temper
        must then be named.
    friction : float, optional
        Coefficient of friction, for friction cards of solvers.
    direction : {"along", "across"}, optional
        Of the shear relative to the lay, for parts that have one.
    gas : {"air", "helium", "nitrogen", "argon", "vacuum"}
    temperature : float
        Of the gas [K].
    gas_pressure : float or str
        Of the gas [Pa].
    theory : str or Theory, optional
        As for `contact`.

    Attributes
    ----------
    surface : AnySurface
        The equivalent surface of both parts.
    pair : Pair
        The metals.

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
    >>> joint = Joint(ground, milled, materials=metals, nominal_area="4 cm^2")
    >>> found = joint.at_pressure("10 MPa")
    >>> f"{found.area:.2%}, {found.conductance():.3g} W/(m^2 K), {found.tangential().stiffness:.3g} GPa/um"
    '1.17%, 3.96e+04 W/(m^2 K), 0.0271 GPa/um'
    >>> table = joint.table(["10 MPa", "50 MPa"])
    >>> [f"{value:.3g}" for value in table["total_conductance"].values]
    ['5.72e+04', '2.07e+05']
    """

    part_a: Part
    part_b: Part | None = None
    _: dataclasses.KW_ONLY
    materials: (
        str | Metal | Mapping[str, Any] | Pair | Sequence[str | Metal | Mapping[str, Any]]
    )
    nominal_area: float | str | None = None
    hardness: float | str | None = None
    friction: float | None = None
    direction: str | None = None
    gas: str = "air"
    temperature: float = 300.0
    gas_pressure: float | str = "1 atm"
    theory: str | Theory | None = None
    surface: AnySurface = dataclasses.field(init=False)
    pair: Pair = dataclasses.field(init=False)
    _faces: dict[str, AnySurface] = dataclasses.field(init=False)

    def __post_init__(self) -> None:
        faces = {}
        for name in FACES:
            part = getattr(self, name)
            if part is not None or name == "part_a":
                faces[name] = self._face(name, part)
        object.__setattr__(self, "_faces", faces)
        drawn = isinstance(self.part_a, Mapping) and "map" not in self.part_a
        # a face made of numbers has the highest point of the nominal area already
        area = None if drawn and len(faces) == 1 else self.nominal_area
        surface = equivalent(list(faces.values()), area)
        if surface.shape != ():
            raise InputError(
                f"a joint is of one surface, got a batch of shape {surface.shape}"
            )
        object.__setattr__(self, "surface", surface)
        object.__setattr__(self, "pair", pair(self.materials))
        self._check()

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
                raise InputError("nominal_area is of the joint: give it beside the parts")
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
        checked_gas(
            self.gas,
            self.temperature,
            Units(stress="Pa").number("gas_pressure", self.gas_pressure),
        )
        checked_friction(self.friction)
        checked_direction(self.direction, self.surface)
        if self.hardness is not None:
            number = checked_hardness(hardness_in(Units(stress="GPa"), self.hardness))
            if number.ndim:
                raise InputError(
                    f"hardness of a joint is one number, got shape {number.shape}"
                )
        if isinstance(self.theory, str):
            require_name("theory", self.theory, (*THEORIES, *OF_MAPS))
            surface: Any = self.surface
            points = getattr(surface, "map", None), getattr(surface, "table", None)
            if self.theory in OF_MAPS and points == (None, None):
                raise InputError(
                    f"theory {self.theory!r} is of one map: a joint of two faces, or of numbers, has none; "
                    "theory='calibrated' applies"
                )
        elif self.theory is not None:
            get_theory(self.theory, self.surface)

    @classmethod
    def from_toml(cls, path: str | os.PathLike[str]) -> Joint:
        """The joint that a TOML file describes: the arguments by name, the parts as tables.

        Paths of maps are relative to the file.

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
        content = read_toml(path, "joint")
        for name in ("part_a", "part_b"):
            if isinstance(content.get(name), Mapping) and "map" in content[name]:
                content[name]["map"] = path.parent / content[name]["map"]
        try:
            return cls(**content)
        except TypeError as fault:
            raise InputError(f"{path}: {fault}") from None

    @property
    def _asked(self) -> dict[str, Any]:
        return {"materials": self.pair, "hardness": self.hardness, "theory": self.theory}

    def pressure_of(self, force: float | str) -> str:
        """F/A0 of a force on the nominal area, with its unit, as every method with a pressure takes it.

        Parameters
        ----------
        force : float or str
            "40 kN"; plain numbers in N.

        Raises
        ------
        InputError, OutOfRangeError
            Without a nominal area, and for forces that are not positive.

        Examples
        --------
        >>> from mbma_tables import Joint
        >>> face = {"Rq": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
        >>> joint = Joint(face, materials="steel 1020", nominal_area="4 cm^2", theory="calibrated")
        >>> joint.pressure_of("40 kN"), f"{joint.at_pressure(joint.pressure_of('40 kN')).pressure:.2f} GPa"
        ('100000000 Pa', '0.10 GPa')
        """
        if self.nominal_area is None:
            raise InputError("a force needs nominal_area, over which it is the pressure")
        return force_over_area(force, self.nominal_area, self.surface.unit)

    def at_pressure(self, pressure: ArrayLike | str) -> Contact:
        """The contact at pressures F/A0 ("10 MPa"; plain numbers in GPa), as of `contact`: each in first loading."""
        return contact(self.surface, pressure=pressure, **self._asked)

    def law(self) -> ContactLaw:
        """The joint's contact law, for many gaps or pressures, as of `contact_law`."""
        return contact_law(self.surface, **self._asked)

    def sensitivity(self, pressure: float | str) -> Sensitivity:
        """d ln(result)/d ln(number) at a pressure, for the numbers that the joint was described by.

        Parameters
        ----------
        pressure : float or str
            F/A0, held fixed; plain numbers in GPa.

        Returns
        -------
        Sensitivity
            With a row for each number of each face, "part_a.Rq", "part_a.longest"; Young's
            moduli of both bodies, "part_a.E" and "part_b.E"; the nominal area, the hardness
            of the softer metal, and the pressure. Of a face given by a spectrum or a map as
            for `sensitivity`: "part_a.heights", "part_a.lengths", its cut-offs.

        Raises
        ------
        InputError, OutOfRangeError
            As `sensitivity`.

        Examples
        --------
        >>> from mbma_tables import Joint
        >>> face = {"Rq": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
        >>> metal = "copper C11000 hard"
        >>> joint = Joint(face, materials=metal, nominal_area="4 cm^2", theory="calibrated")
        >>> slopes = joint.sensitivity("10 MPa").slopes
        >>> f"conductance goes like Rq^{slopes['part_a.Rq']['conductance']:.2f}"
        'conductance goes like Rq^-0.67'
        """
        units = Units(self.surface.unit, "GPa")
        chosen = chosen_theory(self.surface, self.theory)
        bodies = self.pair.metals
        hardness = self.hardness or self.pair.hardness or np.inf

        def modulus_of(*moduli: Any) -> Any:
            (E_a, E_b), (nu_a, nu_b) = moduli, (metal.nu for metal in bodies)
            return effective_modulus(E_a, nu_a, E_b, nu_b)

        return relative_derivatives(
            self._unknowns(chosen),
            chosen,
            units,
            moduli={
                f"{name}.E": metal.E for name, metal in zip(FACES, bodies, strict=True)
            },
            modulus_of=modulus_of,
            by="pressure",
            value=units.number("pressure", pressure),
            hardness=hardness_in(units, hardness),
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
                name: number
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

        if alone and faces["part_a"].batches:
            return Unknowns(numbers, make, batches=True, one_sided=one_sided)
        # moduli, pressure and hardness are varied with the same surface
        return Unknowns(numbers, functools.cache(make), one_sided=one_sided)

    def export(
        self,
        target: str,
        pressures: tuple[float | str, float | str] | None = None,
        name: str | None = None,
        heat: bool = True,
        friction_pressure: float | str | None = None,
        *,
        path: str | os.PathLike[str] | None = None,
        quantity: str | Sequence[str] | None = None,
        rows: int | None = None,
        rtol: float | None = None,
        length_unit: str | None = None,
        stress_unit: str | None = None,
        leakage: bool = False,
        peklenik: float | None = None,
        binaries: str | None = None,
        made_by: tuple[str, ...] = (),
    ) -> str | bytes | list[pathlib.Path]:
        """The joint as input of a solver, as data or as code, for every target of laws of `mbma export`.

        Conductance is that of the solid spots and of the gas in the gaps together in rows.
        Laws as code have that of the solid spots, and their comments state that of the gas
        at some pressures.

        Parameters
        ----------
        target : str
            A target of `mbma export` that accepts a law: rows such as "calculix", "abaqus",
            "csv", functions such as "c-law", "modelica-law" and "fmu".
        pressures : pair of float or str
            Smallest and largest pressure of rows; plain numbers in the unit of stress of the file.
        name : str, optional
            Name of the surface interaction or of the functions, or what names begin with;
            formats without names have it in their comments.
        heat : bool
            Whether the conductance is also written.
        friction_pressure : float or str, optional
            Pressure at which a friction card's tangential stiffness is computed; default:
            the geometric mean.
        path : path-like, optional
            File to write, and beside it those that belong to it, by the end that the target
            gives them.
        quantity : str or sequence of str, optional
            Of the rows, as for `mbma export --quantity`; several for targets "lsdyna",
            "getdp" and "moose-function". Default: conductance, with the pressure in solvers
            that have both; without `heat` pressure.
        rows, rtol : int and float, optional
            Number of rows, or their largest error of linear interpolation; by default as
            few rows as 1e-3 needs, or as many as the program keeps.
        length_unit, stress_unit : str, optional
            Of the file: mm and MPa, with conductance in mW/(mm^2 K), or those that the
            program prescribes.
        leakage : bool
            Functions have the flow coefficient of the gaps, too.
        peklenik : float, optional
            Of a film, as for `flow_factors`.
        binaries : {"here", "all", "none"}, optional
            Of an FMU.
        made_by : tuple of str
            Lines of the header on how the file was made.

        Returns
        -------
        str, bytes or list of pathlib.Path
            Without a path the first file of the target, bytes of a binary format; with a
            path the paths of all files. Solver input has a friction card if the joint has a
            coefficient of friction; functions contain the tangential stiffness.

        Raises
        ------
        InputError
            For an option that the target does not take, and for a target that is several
            files without a path.

        Examples
        --------
        >>> from mbma_tables import Joint
        >>> face = {"Rq": "0.8 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
        >>> copper = "copper C11000 hard"
        >>> joint = Joint(face, materials=copper, nominal_area="4 cm^2", theory="calibrated")
        >>> card = joint.export("calculix", ("0.1 MPa", "50 MPa"), name="JOINT")
        >>> [line for line in card.splitlines() if line.startswith("*") and line[1] != "*"][:2]
        ['*SURFACE INTERACTION, NAME=JOINT', '*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=EXPONENTIAL']
        """
        from mbma_tables.export.of_joint import joint_files
        from mbma_tables.export.targets import write_files

        out = None if path is None else pathlib.Path(path)
        files = joint_files(
            self._exported(),
            target,
            out=out,
            pressures=pressures,
            name=name,
            heat=heat,
            friction_pressure=friction_pressure,
            quantity=quantity,
            length_unit=length_unit,
            stress_unit=stress_unit,
            made_by=made_by,
            rows=rows,
            rtol=rtol,
            leakage=leakage,
            peklenik=peklenik,
            binaries=binaries,
        )
        if out is not None:
            return write_files(out, files)
        try:
            return files[""].decode()
        except UnicodeDecodeError:
            return files[""]

    def _exported(self) -> ExportedJoint:
        """What an export needs of the joint."""
        from mbma_tables.export.of_joint import ExportedJoint

        k1, k2 = (float(text.split()[0]) for text in self.pair.conductivities)  # W/(m K)
        isotropic = self.direction is None
        return ExportedJoint(
            surface=self.surface,
            E_star=self.pair.E_star,
            theory=self.theory,
            hardness=self.hardness or self.pair.hardness or np.inf,
            conductivity=2 * k1 * k2 / (k1 + k2),
            kappa=self._kappa,
            kappa_varies=not isotropic,
            friction=self.friction,
            gas=self.gas,
            temperature=self.temperature,
            gas_pressure=self.gas_pressure,
        )

    def _kappa(self, area: Any) -> Any:
        """Normal over tangential stiffness at a contact area, which only matters to surfaces with a lay."""
        return ratio_of(None, None, self.pair, self.direction, self.surface, area)

    def table(self, pressures: ArrayLike | Sequence[str]) -> xr.Dataset:
        """Every quantity of the joint at pressures, as an xarray Dataset with units and one standard deviation."""
        held = self.quantities(
            self.at_pressure(np.atleast_1d(np.asarray(pressures)).tolist())
        )
        return dataset_of(
            {name: each._replace(dims=("pressure",)) for name, each in held.items()},
            self.facts(),
        )

    def quantities(self, found: Contact) -> dict[str, Variable]:
        """Values, units, meanings and model uncertainties of a contact of this joint, by name."""
        units = found.units
        stiff, gap = units["stiffness"], units["mean_separation"]
        sheared, solid = (
            found.tangential(self.friction, direction=self.direction),
            found.conductance(),
        )
        gas = found.gap_conductance(self.gas, self.temperature, self.gas_pressure)
        sd = "model uncertainty (1 sd) of ln"
        return {
            "pressure": Variable(
                found.pressure, units["pressure"], "force over nominal area"
            ),
            "area": Variable(found.area, "1", "real over nominal contact area"),
            "area_scatter": Variable(found.area_scatter, "1", f"{sd} area"),
            "mean_separation": Variable(found.mean_separation, gap, "mean gap"),
            "separation_scatter": Variable(
                found.separation_scatter, gap, "model uncertainty (1 sd) of the mean gap"
            ),
            "stiffness": Variable(found.stiffness, stiff, "-dp/du of loading"),
            "stiffness_scatter": Variable(
                found.stiffness_scatter, "1", f"{sd} stiffness; not known where it yields"
            ),
            "unloading_stiffness": Variable(
                found.unloading_stiffness, stiff, "-dp/du of a small unloading"
            ),
            "tangential_stiffness": Variable(
                sheared.stiffness, stiff, "shear stress over displacement before slip"
            ),
            "unloading_stiffness_scatter": Variable(
                found.unloading_stiffness_scatter,
                "1",
                f"{sd} unloading and tangential stiffness and of the solid's conductance",
            ),
            "conductance": Variable(solid, CONDUCTANCE, "thermal, of the solid spots"),
            "gas_conductance": Variable(
                gas, CONDUCTANCE, f"thermal, of {self.gas} in the gaps"
            ),
            "total_conductance": Variable(
                solid + gas, CONDUCTANCE, "thermal, of both in parallel"
            ),
            "yielded": Variable(
                found.yielded, "1", "share of the contact area at the hardness"
            ),
            "valid": Variable(
                found.valid,
                "1",
                "whether contacts of this kind were compared with simulations",
            ),
        }

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
            Smallest and largest pressure, plain numbers in GPa; default: 1e-5 and 0.3 of
            the softer metal's hardness.

        Raises
        ------
        InputError
            For pressures that do not rise, and an unknown kind of file.
        """
        if pressures is None:
            return super().plot(path)
        if not isinstance(pressures, tuple | list) or len(pressures) != 2:
            raise InputError(
                f"pressures are the smallest and the largest, got {pressures!r}"
            )
        low, high = (
            float(
                positive_array(
                    "pressures",
                    one_number("pressures", Units(stress="GPa").number("pressure", end)),
                )
            )
            for end in pressures
        )
        if low >= high:
            raise InputError(
                f"pressures are the smallest and the largest, got {pressures!r}"
            )
        return saved(self._drawn(self.at_pressure(np.geomspace(low, high, POINTS))), path)

    def _range(self) -> Contact:
        """The contact at pressures from 1e-5 to 0.3 of the softer metal's hardness."""
        hardness = (
            self.hardness or self.pair.hardness or f"{self.pair.softer.hardness[0]} GPa"
        )
        return self.at_pressure(
            np.geomspace(*RANGE, POINTS)
            * float(hardness_in(Units(stress="GPa"), hardness))
        )

    def facts(self) -> dict[str, str]:
        """The arguments of the joint, by name, and what its faces assume beyond them."""
        a, b = self.pair.metals
        hardness = (
            self.hardness
            or self.pair.hardness
            or f"not known: name the temper of {self.pair.softer.name}"
        )
        theory = chosen_theory(self.surface, self.theory).name
        facts = {
            "metals": f"{a.name} on {b.name}",
            "E_star": f"{float(self.pair.E_star.split()[0]):.4g} GPa",
        }
        facts |= {
            "hardness": str(hardness),
            "theory": theory,
            "gas": self.gas,
            "surface": repr(self.surface),
        }
        assumed = assumptions(self.surface)
        if assumed:
            facts["assumed"] = "; ".join(assumed)
        return facts

    _facts = facts

    def _variables(self) -> dict[str, Variable]:
        return self.quantities(self._range())

    def _figure(self) -> Figure:
        return self._drawn(self._range())

    def _drawn(self, pressed: Contact) -> Figure:
        held = self.quantities(pressed)
        x, values = held["pressure"], {name: one.values for name, one in held.items()}
        scatter = dict.fromkeys(
            ("unloading_stiffness", "tangential_stiffness", "conductance"),
            values["unloading_stiffness_scatter"],
        )
        scatter |= {
            "area": values["area_scatter"],
            "stiffness": values["stiffness_scatter"],
        }
        scatter |= {
            "mean_separation": values["separation_scatter"] / values["mean_separation"]
        }
        panels = {
            "real contact area  A/A0": ("area",),
            f"mean gap [{held['mean_separation'].unit}]": ("mean_separation",),
            f"stiffness [{held['stiffness'].unit}]": (
                "unloading_stiffness",
                "tangential_stiffness",
                "stiffness",
            ),
            f"thermal conductance [{CONDUCTANCE}]": (
                "total_conductance",
                "conductance",
                "gas_conductance",
            ),
        }
        lines = {
            label: [
                (name.replace("_", " "), values[name], scatter.get(name))
                for name in names
            ]
            for label, names in panels.items()
        }
        return draw_panels(x.values, lines, f"pressure F/A0 [{x.unit}]")


Joint.__init__ = hinted(Joint.__init__)  # type: ignore[method-assign]
