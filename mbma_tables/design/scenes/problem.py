"""The problem defined by a scene, with its effects, checked on construction.

`plan` and `run` solve it.
"""

import dataclasses
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from mbma_tables.bodies.materials import hardness_in
from mbma_tables.common.arguments import (
    finite_array,
    number_in,
    require,
    require_name,
    whole_number_in,
)
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import Units, modulus_and_units, require_surface
from mbma_tables.contacts.quantities.declaration import of_all_contacts
from mbma_tables.contacts.quantities.registry import registry
from mbma_tables.contacts.question import Question, name_of_the_given
from mbma_tables.islands.island_models import ISLAND_MODELS, AnyModel
from mbma_tables.islands.variants import Variant, get_variant
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.tables.island4d import Island4dModel
from mbma_tables.tables.universal import UniversalModel
from mbma_tables.theories import THEORIES, default_name, is_table, resolve
from mbma_tables.theories.base import Theory
from mbma_tables.theories.mbma.models import with_table
from mbma_tables.theories.named import OF_MAPS, options_of

# effects, described in docs/scenes.md, beside the quantities of the registry, each of which
# is an effect of its name: several quantities of a contact under one name, and others
GROUPS = ("leakage", "validity", "yield")
OF_ISLANDS = ("island_statistics", "pressure_profile")  # available for MBMA only
OF_SUMS = "island_model"  # option of theories that sum islands
OTHERS = (*GROUPS, *OF_ISLANDS, "comparison")
# part of the model, and on unless switched off
REFINEMENTS = ("subscale_area", "sphere_deformation", "finite_height")
ELASTIC = ("energy", *OF_ISLANDS)  # for contacts without yielding
# parameters of which one is prescribed, and the quantity that it has numbers of
PRESCRIBED = {
    "separations": "separation",
    "mean_separations": "mean_separation",
    "pressures": "pressure",
    "areas": "area",
}
MIN_RTOL = 1e-10
MAX_RTOL = 0.1
MAX_SECONDS = 1e6
DEFAULT_RTOL = 1e-6  # of MBMA
DEFAULT_RTOL_OF_OTHERS = 1e-4  # of theories without a certified table
NEEDS = {  # what an effect needs and no other uses
    "yield": ("hardness", "the largest pressure that the softer body bears"),
    "solid_conductance": ("conductivities", "k1 and k2 of the two bodies"),
    "pressure_profile": ("deltas", "the approaches of the islands"),
    "comparison": ("theories", f"one or more of {', '.join(THEORIES)}"),
}


def effects() -> dict[str, None]:
    """Names of all effects: every quantity of the registry, and `OTHERS`."""
    return dict.fromkeys((*registry(), *OTHERS))


def usual_effects() -> list[str]:
    """Effects that texts list: `OTHERS`, and what any contact of a scene has with a model uncertainty."""
    names = []
    for name, declared in registry().items():
        # gaps are there without being asked for
        is_usual = declared.uncertainty is not None and name != "mean_separation"
        is_usual &= declared.is_listed is of_all_contacts
        # what only a joint is given, no scene has
        if is_usual and (not declared.needs or name in (*NEEDS, *ELASTIC)):
            names.append(name)
    return [*names, *OTHERS]


def of_contact(outputs: Iterable[str]) -> list[str]:
    """Effects among `outputs` that are read from one contact."""
    names = dict.fromkeys((*registry(), *GROUPS))
    return [name for name in names if name in outputs]


def is_made_of(name: str, effect: str) -> bool:
    """Whether an effect is another one, or a quantity of the registry that is made of it."""
    parts = registry()[name].made_of if name in registry() else ()
    return name == effect or any(is_made_of(part, effect) for part in parts)


@dataclasses.dataclass(frozen=True, eq=False)
class Problem:
    """The parameters of `Scene`, with derived fields such as `outputs`, `question` and `units`."""

    surface: AnySurface
    effects: Sequence[str] = ("pressure", "area")
    without: Sequence[str] = ()
    separations: Any = None
    mean_separations: Any = None
    pressures: Any = None
    areas: Any = None
    E_star: Any = 1.0
    hardness: Any = None
    rtol: float | None = None
    seconds: float | None = None
    variant: str | Variant = "reported"
    island_model: str | AnyModel | None = None
    # str, Theory or UserTheory; by the surface where none is given
    theory: Any = None
    conductivities: tuple[float | str, float | str] | None = None
    deltas: Any = None
    theories: Sequence[str] = ()
    points: int = 64
    title: str = "scene"
    outputs: frozenset[str] = dataclasses.field(init=False)
    dropped: frozenset[str] = dataclasses.field(init=False)
    #: the prescribed quantity; None if no effect needs one
    question: Question | None = dataclasses.field(init=False)
    units: Units = dataclasses.field(init=False)
    conductance_unit: str = dataclasses.field(init=False, default="")

    def __post_init__(self) -> None:
        for name in ("effects", "without", "theories"):
            names = getattr(self, name)
            if isinstance(names, str) or not isinstance(names, Iterable):
                raise InputError(f"{name} must be a list of names: write [{names!r}]")
        self._choose_effects()
        require_surface(self.surface)
        if self.surface.labelled or self.surface.shape != ():
            raise InputError(
                "a scene has one surface, not a batch: make a scene for each"
            )
        self._set_numbers()
        if self.island_model is not None:
            vars(self).update(island_model=with_table(self.island_model))
        if self.theory is None:
            vars(self).update(theory=self._default_theory())
        elif is_table(self.theory):
            vars(self).update(theory=resolve(self.theory))
        self._take_options_of_theory()
        self._set_tolerance()
        whole_number_in("points", self.points, 2, 10_000)
        vars(self).update(
            variant=get_variant(self.variant),
            theories=tuple(self.theories),
        )
        vars(self).update(question=self._checked_question())
        self._check_parameters_of_effects()
        self._check_theories()

    def _set_numbers(self) -> None:
        """Take lengths, stresses and conductivities as numbers in one set of units."""
        E_star, units = modulus_and_units(self.E_star, self.surface)
        vars(self).update(E_star=number_in("E_star", E_star, 1e-300, 1e300), units=units)
        for name in ("separations", "mean_separations", "pressures", "deltas"):
            vars(self)[name] = units.number(name, getattr(self, name))
        vars(self).update(hardness=hardness_in(units, self.hardness))
        if self.conductivities is not None:
            conductivities, unit = units.conductivities(*self.conductivities)
            vars(self).update(conductivities=conductivities, conductance_unit=unit)

    def _default_theory(self) -> str:
        """MBMA where an option or effect is of it alone, else by the rule of `contact`."""
        options = []
        needs_islands = bool(self.outputs.intersection(OF_ISLANDS))
        if self.dropped or needs_islands or self.island_model is not None:
            options.append(OF_SUMS)
        if get_variant(self.variant) != get_variant("reported"):
            options.append("variant")
        given_name = "separation" if self.separations is not None else None
        return default_name(self.surface, given_name, options)

    def _take_options_of_theory(self) -> None:
        """Take options of MBMA as an object for those of the scene, whose steps choose the others."""
        if not isinstance(self.theory, Theory) or OF_SUMS not in self.theory.options:
            return
        for name, value in self.theory.changed_options.items():
            if name == "outside":
                raise InputError(
                    "outside: a scene solves the islands that no table covers: leave it out"
                )
            if getattr(self, name) not in (None, "reported"):
                raise InputError(
                    f"{name} is given by the scene and by its theory: give one of them"
                )
            vars(self)[name] = value
        vars(self).update(theory=self.theory.name)

    def _set_tolerance(self) -> None:
        """Set `rtol`: as given, by default, or None where a time budget is given."""
        rtol: float | None = DEFAULT_RTOL if self.sums_islands else DEFAULT_RTOL_OF_OTHERS
        if self.rtol is not None:
            rtol = number_in("rtol", self.rtol, MIN_RTOL, MAX_RTOL)
        if self.seconds is not None:
            if self.rtol is not None:
                both = "rtol and seconds are both given"
                raise InputError(
                    f"{both}: give the accuracy or the time budget, one of them"
                )
            number_in("seconds", self.seconds, 1e-9, MAX_SECONDS)
            rtol = None
        vars(self).update(rtol=rtol)

    def _choose_effects(self) -> None:
        """Set the requested outputs and the refinements switched off, checked with each other."""
        for name in self.effects:
            require_name("effect", name, effects())
        for name in self.without:
            require_name("refinement", name, REFINEMENTS)
        outputs = frozenset(self.effects)
        dropped = frozenset(self.without)
        if not outputs:
            listed = ", ".join(usual_effects())
            raise InputError(f"no effect is requested: on needs at least one of {listed}")
        if "yield" in outputs:
            # refinements are those of an elastic theory
            elastic = sorted(dropped | outputs & set(ELASTIC))
            if elastic:
                excluded = (
                    f"{elastic[0]!r} is for elastic contacts, and effect 'yield' is on"
                )
                raise InputError(f"{excluded}: leave one of the two out")
        if "finite_height" in dropped:
            needs_end = sorted({*of_contact(outputs)} - {"pressure", "area"})
            if needs_end:
                effect = repr(needs_end[0])
                remedy = f"leave finite_height on, or {effect} out"
                raise InputError(f"{effect} needs a surface that ends at h_max: {remedy}")
        if "pressure_profile" in outputs and "sphere_deformation" in dropped:
            remedy = "leave sphere_deformation on, or pressure_profile out"
            raise InputError(f"pressure_profile is that of the deformed sphere: {remedy}")
        vars(self).update(outputs=outputs, dropped=dropped)

    def _checked_question(self) -> Question | None:
        """The prescribed quantity with its numbers, a row; None if no effect needs it."""
        candidates = {name: getattr(self, name) for name in PRESCRIBED}
        # profiles are those of islands at approaches
        if self.outputs == {"pressure_profile"}:
            for name, value in candidates.items():
                if value is not None:
                    unused = f"{name} are not needed by any effect"
                    raise InputError(f"{unused}: leave them out, or request 'pressure'")
            return None
        name = name_of_the_given(candidates)
        numbers = finite_array(name, candidates[name])
        if numbers.ndim > 1:
            raise InputError(
                f"{name} must be one number or a list, got shape {numbers.shape}"
            )
        h_max = float(self.surface.h_max)
        least = 0.0
        allowed = "at least 0: there is no adhesion in the model"
        if name == "separations":
            least = -h_max
            allowed = f"at least -h_max = {-h_max:.6g}, where the model ends"
        if name == "mean_separations":
            allowed = "at least 0, where the model ends (d = -h_max)"
        require(name, numbers, numbers >= least, allowed)
        question = Question(PRESCRIBED[name], np.atleast_1d(numbers).astype(float))
        if not question.is_gap and "finite_height" in self.dropped:
            remedy = "leave finite_height on, or give separations"
            raise InputError(f"{name} need a surface that ends at h_max: {remedy}")
        return question

    def _check_parameters_of_effects(self) -> None:
        """Parameters that one effect needs and no other uses."""
        for effect, (name, meaning) in NEEDS.items():
            argument = getattr(self, name)
            is_given = argument is not None
            # no theories are an empty list
            if name == "theories":
                is_given = argument not in (None, ())
            if self.computes(effect) and not is_given:
                asked = [each for each in self.effects if is_made_of(each, effect)]
                raise InputError(f"effect {asked[0]!r} needs {name}: {meaning}")
            if not self.computes(effect) and is_given:
                remedy = f"add it to the effects, or leave {name} out"
                raise InputError(f"{name} given and effect {effect!r} is off: {remedy}")
        if self.hardness is not None:
            cap = number_in("hardness", self.hardness, 1e-300, 1e300)
            if self.pressures is not None:
                allowed = f"at most the hardness, {cap:.6g}"
                pressures = np.asarray(self.pressures)
                require("pressures", pressures, pressures <= cap, allowed)
        for name in ("conductivities", "deltas"):
            if getattr(self, name) is not None:
                numbers = finite_array(name, getattr(self, name))
                require(name, numbers, numbers > 0, "positive")

    def _check_theories(self) -> None:
        """Names of theories and island models, and options of MBMA beside other theories."""
        if isinstance(self.island_model, str):
            require_name("island model", self.island_model, ISLAND_MODELS)
        if self.island_model is not None and "sphere_deformation" in self.dropped:
            rigid = "sphere_deformation is off, which is the rigid sphere"
            raise InputError(f"{rigid}: leave island model out")
        is_measured = isinstance(self.island_model, str | UniversalModel | Island4dModel)
        if self.seconds is not None and self.island_model is not None and not is_measured:
            unmeasured = "the cost of your own island model is not known"
            raise InputError(f"{unmeasured}: give rtol instead of seconds")
        if isinstance(self.theory, str):
            require_name("theory", self.theory, (*THEORIES, *OF_MAPS))
        else:
            resolve(self.theory, self.surface)
        for name in self.theories:
            require_name("theory", name, THEORIES)
        if self.theory_name in self.theories:
            itself = f"the scene is by theory {self.theory_name!r} itself"
            raise InputError(f"{itself}: leave it out of theories")
        self._check_options_of_mbma()

    def _check_options_of_mbma(self) -> None:
        """Raise an error for options and effects that other theories do not have."""
        if self.sums_islands:
            return
        options = []
        if self.island_model is not None:
            options.append("island_model")
        if self.variant != get_variant("reported"):
            options.append("variant")
        if self.dropped:
            options.append("without")
        options += [f"effect {name!r}" for name in OF_ISLANDS if name in self.outputs]
        if options:
            owner = default_name(self.surface, options=[OF_SUMS])
            not_of = f"of theory {owner!r}, not of {self.theory_name!r}"
            raise InputError(f"{' and '.join(options)}: {not_of}: leave out")

    def computes(self, effect: str) -> bool:
        """Whether an effect is requested, or a quantity that is made of it."""
        return any(is_made_of(name, effect) for name in self.outputs)

    @property
    def needs_slopes(self) -> bool:
        """Whether derivatives are computed: of all quantities but pressure, area and energy, as far as is known here."""
        others = {*of_contact(self.outputs)} - {"pressure", "area", "energy"}
        return bool(others - {"leakage", "validity", "yield"})

    @property
    def sums_islands(self) -> bool:
        """Whether the scene's theory sums islands, whose model and refinements a plan chooses."""
        return isinstance(self.theory, str) and OF_SUMS in options_of(self.theory)

    @property
    def theory_name(self) -> str:
        """Name of the theory in results."""
        return self.theory if isinstance(self.theory, str) else self.theory.name

    @property
    def is_inverted(self) -> bool:
        """Whether gaps follow from prescribed pressures or areas."""
        return self.question is not None and not self.question.is_gap
