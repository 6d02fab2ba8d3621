"""The effects that a scene can call for: what each is, its equation, its price, and what contradicts what."""

from __future__ import annotations

import dataclasses
import difflib
from collections.abc import Iterable

from mbma_tables.errors import InputError


@dataclasses.dataclass(frozen=True)
class Effect:
    """One effect; `refines` marks those that are part of the model and on unless switched off."""

    name: str
    meaning: str
    equation: str
    cost: str
    refines: bool = False


_ALL = (
    Effect("force", "nominal pressure F/A0 at every gap", "Eqs. 40b, 48", "one sum over islands a gap, or a law"),
    Effect("area", "real contact area A/A0 at every gap", "Eqs. 38, 40a, 49", "the sum of force, shared with it"),
    Effect(
        "subscale_area",
        "eta, the share of a summit's Hertz area left by roughness finer than zeta_u; off is eta = 1, the Hertz area",
        "Eq. 39, Appendix C",
        "nothing where on; off takes the adaptive sum over islands for area",
        refines=True,
    ),
    Effect(
        "sphere_deformation",
        "w in Eq. 34, by which an island's sphere gives way; off is the rigid sphere, in closed form",
        "Eqs. 34, 37",
        "a table lookup or a solution an island; off one closed form",
        refines=True,
    ),
    Effect(
        "finite_height",
        "heights end at h_max; off integrates the whole Gaussian",
        "upper limit of Eqs. 44, 45, 48, 49",
        "nothing where on; off a longer interval, to where the Gaussian adds less than rtol",
        refines=True,
    ),
    Effect("stiffness", "-dF/dd and -dF/du per nominal area", "derivative of Eq. 48, Eq. 50", "a contact law"),
    Effect("energy", "elastic energy per nominal area, the integral of F from d to h_max", "of Eq. 48", "a law"),
    Effect(
        "conductance",
        "thermal or electrical conductance per nominal area from stiffness",
        "Barber 2003: h = -(k_s/E*) dp/du",
        "the law of stiffness",
    ),
    Effect(
        "island_statistics",
        "how many islands touch, of which area, under which load",
        "Eqs. 40, 42",
        "one integral of the geometry a gap, and one lookup for each point of the distribution",
    ),
    Effect(
        "pressure_profile",
        "p(r) and d(r) of chosen islands",
        "Eqs. 34, 36, 37",
        "one exact solution for each island",
    ),
    Effect("comparison", "other theories at the same gaps", "Eqs. 11, 12 and 18-21", "closed form; an integral a gap"),
)
EFFECTS = {effect.name: effect for effect in _ALL}
REFINEMENTS = tuple(effect.name for effect in _ALL if effect.refines)
OUTPUTS = tuple(effect.name for effect in _ALL if not effect.refines)
OF_LAW = ("stiffness", "energy", "conductance")
THEORIES = ("greenwood_williamson", "persson", "persson_simplified")


def nearest(name: str, known: Iterable[str]) -> str:
    """Words that point from an unknown name to the nearest known one."""
    names = list(known)
    near = difflib.get_close_matches(name, names, 1)
    return f"did you mean {near[0]!r}?" if near else f"known are {', '.join(names)}"


def chosen(on: Iterable[str], off: Iterable[str]) -> tuple[frozenset[str], frozenset[str]]:
    """Outputs asked for and refinements switched off, checked against each other.

    Raises
    ------
    InputError
        For unknown names, contradictions, and nothing asked for.
    """
    wanted, without = list(on), list(off)
    for name in (*wanted, *without):
        if name not in EFFECTS:
            raise InputError(f"no effect is named {name!r}; {nearest(str(name), EFFECTS)}")
    both = sorted(set(wanted) & set(without))
    if both:
        raise InputError(f"effect {both[0]!r} is both on and off: leave it in one of the two lists")
    for name in without:
        if name in OUTPUTS:
            raise InputError(
                f"{name!r} is off unless it is asked for: leave it out; off takes {', '.join(REFINEMENTS)}"
            )
    outputs = frozenset(wanted) & frozenset(OUTPUTS)
    if not outputs:
        raise InputError(f"no effect is asked for: on needs at least one of {', '.join(OUTPUTS)}")
    dropped = frozenset(without)
    if "finite_height" in dropped and outputs & set(OF_LAW):
        name = sorted(outputs & set(OF_LAW))[0]
        raise InputError(f"{name!r} comes from a law, which ends at h_max: leave finite_height on, or {name!r} out")
    if "subscale_area" in dropped and not outputs & {"area", "island_statistics"}:
        raise InputError("subscale_area changes areas alone: ask for 'area' too, or leave it out of off")
    if outputs == {"comparison"} and dropped:
        raise InputError(f"{sorted(dropped)[0]!r} does not touch other theories: leave it out of off")
    if outputs == {"pressure_profile"} and "finite_height" in dropped:
        raise InputError("finite_height does not touch single islands: leave it out of off")
    if "pressure_profile" in outputs and "sphere_deformation" in dropped:
        raise InputError(
            "pressure_profile is of the deformed sphere: leave sphere_deformation on, or pressure_profile out"
        )
    return outputs, dropped
