"""A scene: surface, bodies, gaps or loads, requested quantities, and tolerance or time budget.

`plan` and `run` solve it.
"""

from __future__ import annotations

import dataclasses
import os
import pathlib
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mbma_tables.bodies.bodies import Bodies, BodiesInUnits
from mbma_tables.common.arguments import (
    number_in,
    positive_array,
    require_name,
    whole_number_in,
)
from mbma_tables.common.errors import InputError
from mbma_tables.common.toml_files import check, read_toml
from mbma_tables.common.units import require_surface
from mbma_tables.contacts.quantities.registry import names_of_parts, registry
from mbma_tables.contacts.question import PRESCRIBED, Question
from mbma_tables.contacts.result import Contact, Setup
from mbma_tables.design.scenes.plan import LEAKAGE, Plan, make_plan
from mbma_tables.design.specimen import from_tables, refuse_joint, schema, take_theory
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.tables.island4d import Island4dModel
from mbma_tables.tables.universal import UniversalModel
from mbma_tables.theories import THEORIES, default_name, is_table, resolve
from mbma_tables.theories.named import OF_MAPS, options_of

if TYPE_CHECKING:
    import xarray

# the steps of arguments that ask by themselves, as plans list what is not requested
BY_ARGUMENTS = {
    "deltas": "pressure_profile",
    "points": "island_statistics",
    "theories": "comparison",
}
OF_SUMS = "island_model"  # option of theories that sum islands
OF_ISLANDS = ("deltas", "points", "without")  # arguments of such theories
# island models whose cost was measured; None is one that the plan chooses
MEASURED_MODELS = (str, UniversalModel, Island4dModel, type(None))
OF_FILES = (OF_SUMS, "variant")  # options of a theory that are entries of a file
# part of the model, and on unless switched off
REFINEMENTS = ("subscale_area", "sphere_deformation", "finite_height")
MIN_RTOL = 1e-10
MAX_RTOL = 0.1
MAX_SECONDS = 1e6
DEFAULT_RTOL = 1e-6  # of MBMA
DEFAULT_RTOL_OF_OTHERS = 1e-4  # of theories without a certified table


@dataclasses.dataclass(frozen=True, eq=False)
class Scene:
    """Description of a simulation, checked on construction; it can be run repeatedly.

    Parameters
    ----------
    surface : Surface
        One surface, not a batch.
    bodies : Bodies or float or str
        As for `contact`, each constant one number. With a hardness the theory's elastic
        result is corrected by `mbma_tables.theories.yielding`, and the result has what
        yields besides the requested quantities.
    quantities : sequence of str
        Names of quantities of a contact, as `Contact.quantity` takes them. "valid" brings
        the model uncertainties and the reasons, "leakage" stands for all of
        `Contact.leakage`.
    separation, mean_separation, pressure, area : array_like, one of them
        d [length], u [length], F/A0 in the unit of the modulus, or A/A0; one number or a
        list. Texts such as "0.8 um" are converted to the units of the surface and the
        modulus. A scene of profiles alone has none of them.
    theory : str or theory, optional
        As for `contact`. Of `Mbma` the plan chooses the island model and the tolerance,
        unless the object has others than its defaults.
    rtol : float, optional
        Requested relative error, in [1e-10, 0.1]; without `seconds` by default 1e-6, or
        1e-4 for other theories than MBMA.
    seconds : float, optional
        Time budget instead of `rtol`; the measured costs determine the accuracy that it allows.
    without : sequence of str
        Refinements of MBMA switched off: "subscale_area", "sphere_deformation",
        "finite_height".
    deltas : array_like, optional
        Approaches [length] of islands, of which MBMA's pressure and gap are computed along
        the radius.
    points : int, optional
        Of MBMA's islands, over their approach: their number, loads, areas and density.
    theories : sequence of str
        Names of other theories, whose pressure and area stand beside those of the scene's.
    title : str
        For the result.

    Raises
    ------
    InputError, OutOfRangeError
        For meaningless or contradictory arguments; the message has the correction.

    Examples
    --------
    >>> from mbma_tables import Scene, Surface
    >>> road = Surface.named("concrete")
    >>> scene = Scene(road, quantities=["pressure"], separation=[0.2, 0.5], rtol=1e-5)
    >>> [step.name for step in scene.plan().steps]
    ['contact']
    >>> found = scene.run()
    >>> [f"{pressure:.3e}" for pressure in found["pressure"].values]
    ['1.754e-03', '1.292e-04']
    >>> found.attrs["error"] <= 1e-5
    True
    """

    surface: AnySurface
    bodies: Any = 1.0
    _: dataclasses.KW_ONLY
    quantities: Any = None
    separation: Any = None
    mean_separation: Any = None
    pressure: Any = None
    area: Any = None
    theory: Any = None
    rtol: float | None = None
    seconds: float | None = None
    without: Sequence[str] = ()
    deltas: Any = None
    points: int | None = None
    theories: Sequence[str] = ()
    title: str = "scene"
    #: the bodies' constants as numbers, in the units of the scene
    in_units: BodiesInUnits = dataclasses.field(init=False)
    #: the prescribed quantity; None if nothing needs one
    question: Question | None = dataclasses.field(init=False)
    #: options of MBMA that are not left to the plan
    options: Mapping[str, Any] = dataclasses.field(init=False)

    def __post_init__(self) -> None:
        require_surface(self.surface)
        if self.surface.labelled or self.surface.shape != ():
            raise InputError(
                "a scene has one surface, not a batch: make a scene for each"
            )
        in_units = Bodies.of(self.bodies).in_units(self.surface)
        for name in ("E_star", "hardness"):
            if np.ndim(getattr(in_units, name)):
                raise InputError(
                    f"a scene has one {name}, not several: make a scene for each"
                )
        in_units.require_one_conductivity()
        deltas = self.deltas
        if deltas is not None:
            deltas = positive_array("deltas", in_units.units.number("deltas", deltas))
        vars(self).update(in_units=in_units, deltas=deltas)
        self._take_names()
        vars(self).update(question=self._checked_question())
        self._take_theory()
        self._set_tolerance()
        self._check_needs()
        self._check_refinements()

    def _take_names(self) -> None:
        """Take what is requested, without deltas or other theories pressure and area."""
        if self.quantities is None:
            is_alone = self.deltas is not None and not self._given(*PRESCRIBED)
            vars(self).update(quantities=() if is_alone else ("pressure", "area"))
        for name, kind, choices in (
            ("quantities", "quantity", {**registry(), LEAKAGE: None}),
            ("without", "refinement", REFINEMENTS),
            ("theories", "theory", THEORIES),
        ):
            names = getattr(self, name)
            if isinstance(names, str) or not isinstance(names, Iterable):
                raise InputError(f"{name} must be a list of names: write [{names!r}]")
            for each in names:
                require_name(kind, each, choices)
            vars(self)[name] = tuple(dict.fromkeys(names))
        if self.points is not None:
            whole_number_in("points", self.points, 2, 10_000)
        if not (self.quantities or self._given(*BY_ARGUMENTS)):
            raise InputError(
                "nothing is requested: give quantities, deltas, points or theories"
            )

    def _given(self, *arguments: str) -> list[str]:
        """Arguments that are given: neither None nor an empty list."""
        return [
            name
            for name in arguments
            if getattr(self, name) is not None and np.size(getattr(self, name))
        ]

    def _checked_question(self) -> Question | None:
        """The prescribed quantity with its numbers, a row; None if nothing needs it."""
        # profiles are those of islands at approaches
        if not (self.quantities or self._given("points", "theories")):
            for name in self._given(*PRESCRIBED):
                raise InputError(
                    f"{name} is not needed for profiles: leave it out, or give quantities"
                )
            return None
        question = Question.of(
            self.in_units.units, {name: getattr(self, name) for name in PRESCRIBED}
        )
        if np.ndim(question.value) > 1:
            raise InputError(
                f"{question.name} must be one number or a list, got shape "
                f"{question.value.shape}"
            )
        is_pulled = self.in_units.adhesion is not None
        question.require_in_range(float(self.surface.h_max), is_pulled)
        return question.of_block(np.atleast_1d(question.value))

    def _take_theory(self) -> None:
        """Take the theory, or the default one, and its options that are not left to the plan."""
        theory = self.theory
        changed: Mapping[str, Any] = {}
        if theory is None:
            given_name = None if self.question is None else self.question.name
            options = [OF_SUMS] if self._given(*OF_ISLANDS) else []
            theory = default_name(self.surface, given_name, options)
        elif isinstance(theory, str) and not is_table(theory):
            require_name("theory", theory, (*THEORIES, *OF_MAPS))
        else:
            resolved = resolve(theory, self.surface)
            theory = resolved if is_table(theory) else theory
            if OF_SUMS in resolved.options:
                changed = resolved.changed_options
                theory = resolved.name
        vars(self).update(theory=theory, options=changed)

    def _set_tolerance(self) -> None:
        """Set `rtol`: as given, by default, or None where a time budget is given."""
        if "outside" in self.options:
            raise InputError(
                "outside: a scene solves the islands that no table covers: leave it out"
            )
        given = {"rtol": self.rtol, "seconds": self.seconds}
        given["rtol of the theory"] = self.options.get("rtol")
        names = [name for name, value in given.items() if value is not None]
        if len(names) > 1:
            raise InputError(
                f"{' and '.join(names)} are given: give the accuracy or the time budget, "
                "one of them"
            )
        default = DEFAULT_RTOL if self.sums_islands else DEFAULT_RTOL_OF_OTHERS
        rtol: float | None = default
        if self.seconds is not None:
            number_in("seconds", self.seconds, 1e-9, MAX_SECONDS)
            rtol = None
            if not isinstance(self.island_model, MEASURED_MODELS):
                raise InputError(
                    "the cost of your own island model is not known: give rtol instead "
                    "of seconds"
                )
        elif names:
            rtol = number_in("rtol", given[names[0]], MIN_RTOL, MAX_RTOL)
        vars(self).update(rtol=rtol)

    def _check_needs(self) -> None:
        """Check what quantities need by their declarations, and what theories have."""
        for name in self.quantities:
            if name != LEAKAGE:
                registry()[name].require_given(self.state)
        if self.theory_name in self.theories:
            raise InputError(
                f"the scene is by theory {self.theory_name!r} itself: leave it out of "
                "theories"
            )
        of_islands = " and ".join(self._given(*OF_ISLANDS))
        if of_islands and not self.sums_islands:
            owner = default_name(self.surface, options=[OF_SUMS])
            raise InputError(
                f"{of_islands}: of theory {owner!r}, not of {self.theory_name!r}: leave out"
            )
        if of_islands and self.in_units.yields:
            raise InputError(
                f"{of_islands}: of elastic contacts, and the bodies have a hardness: leave "
                "one of the two out"
            )

    def _check_refinements(self) -> None:
        """Check what cannot be computed without a refinement."""
        if "sphere_deformation" in self.without and self.island_model is not None:
            raise InputError(
                "sphere_deformation is off, which is the rigid sphere: leave island_model out"
            )
        if "sphere_deformation" in self.without and self.deltas is not None:
            raise InputError(
                "deltas are of profiles of the deformed sphere: leave sphere_deformation on"
            )
        if "finite_height" not in self.without:
            return
        others = [n for n in self.quantities if n not in ("pressure", "area")]
        if self.question is not None and self.is_inverted:
            others.append(f"a given {self.question.name}")
        if others:
            raise InputError(
                f"{others[0]} needs a surface that ends at h_max: leave finite_height on, "
                "or ask for pressure and area at a separation"
            )

    @property
    def state(self) -> Contact:
        """A contact of the scene at its highest point, by which needs are checked."""
        setup = Setup(self.surface, self.in_units, self.theory)
        return Contact(setup, {"mean_separation": self.surface.h_max})

    @property
    def island_model(self) -> Any:
        """The island model that the theory was given; None where the plan chooses."""
        return self.options.get(OF_SUMS)

    @property
    def sums_islands(self) -> bool:
        """Whether the theory sums islands, whose model and refinements a plan chooses."""
        return isinstance(self.theory, str) and OF_SUMS in options_of(self.theory)

    @property
    def theory_name(self) -> str:
        """Name of the theory in results."""
        return self.theory if isinstance(self.theory, str) else self.theory.name

    @property
    def is_inverted(self) -> bool:
        """Whether gaps follow from prescribed pressures or areas."""
        return self.question is not None and not self.question.is_gap

    @property
    def is_hertz_area(self) -> bool:
        """Whether the area is that of the summits, which has a step of its own."""
        return "area" in self.quantities and "subscale_area" in self.without

    @property
    def of_contact(self) -> tuple[str, ...]:
        """Requested quantities that are read from one contact."""
        of_summits = ("area",) if self.is_hertz_area else ()
        return tuple(name for name in self.quantities if name not in of_summits)

    @property
    def not_requested(self) -> list[str]:
        """What such a contact shows with a model uncertainty, and other steps, that are not requested."""
        state = self.state
        # gaps are there without being asked for
        requested = {*self.quantities, "mean_separation"}
        requested |= {BY_ARGUMENTS[name] for name in self._given(*BY_ARGUMENTS)}
        shown = [
            name
            for name, declared in registry().items()
            if declared.uncertainty is not None and declared.is_shown(state)
        ]
        others = [LEAKAGE, "valid", *BY_ARGUMENTS.values()]
        return [name for name in (*shown, *others) if name not in requested]

    def computes(self, part: str) -> bool:
        """Whether a quantity is requested, or one that is made of it by its declaration."""
        of_leakage = {LEAKAGE: "flow_coefficient"}
        names = [of_leakage.get(name, name) for name in self.quantities]
        return any(part in names_of_parts(name) for name in names)

    @property
    def needs_slopes(self) -> bool:
        """Whether derivatives are computed: of all quantities but some, as far as is known here."""
        return not {*self.quantities} <= {"pressure", "area", "energy", "valid", LEAKAGE}

    @classmethod
    def from_toml(cls, path: os.PathLike[str] | str) -> Scene:
        """The scene of a TOML file, see docs/lookup.md and `scene.schema.json`.

        Raises
        ------
        InputError
            For errors in the file: one message that starts with its path and has the correction.
        """
        file = pathlib.Path(path)
        entries = read_toml(file, "scene")
        refuse_joint(file, entries)
        try:
            return cls.from_mapping(entries, file.parent, file.stem)
        except InputError as fault:
            raise InputError(f"{file}: {fault}") from None

    @classmethod
    def from_mapping(
        cls,
        content: Mapping[str, Any],
        folder: pathlib.Path = pathlib.Path(),
        title: str = "scene",
    ) -> Scene:
        """The scene of the content of a TOML file; paths in it are relative to `folder`, the current one by default.

        Entries are the arguments of `Scene`, and options of the theory.
        """
        check(content, schema())
        given = {"title": title} | dict(content)
        specimen = from_tables({"surface": given.pop("surface")}, folder, title)
        take_theory(given, OF_FILES, folder)
        return cls(specimen.surface, **given)

    def plan(self) -> Plan:
        """The planned steps with island models, tolerances, certified errors and measured costs."""
        return make_plan(self)

    def explain(self) -> str:
        """The plan as text."""
        return self.plan().text()

    def run(self) -> xarray.Dataset:
        """Compute the requested quantities.

        Returns
        -------
        xarray.Dataset
            Quantities with units; in its attributes the plan, the error bound reached, the
            variant and the hashes of the tables that were used.

        Raises
        ------
        InputError, OutOfRangeError, ConvergenceError
        """
        from mbma_tables.design.scenes.run import run_plan

        return run_plan(self, self.plan())
