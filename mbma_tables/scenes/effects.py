"""The effects that a scene can call for, docs/scenes.md says what each is, and what contradicts what."""

from __future__ import annotations

from collections.abc import Iterable

from mbma_tables.arguments import nearest
from mbma_tables.errors import InputError
from mbma_tables.theories import THEORIES

OUTPUTS = (
    "force",
    "area",
    "stiffness",
    "energy",
    "conductance",
    "leakage",
    "island_statistics",
    "pressure_profile",
    "comparison",
    "validity",
    "yield",
)
# part of the model, and on unless switched off
REFINEMENTS = ("subscale_area", "sphere_deformation", "finite_height")
EFFECTS = (*OUTPUTS, *REFINEMENTS)
OF_ISLANDS = ("island_statistics", "pressure_profile")  # of MBMA alone
OF_LAW = ("stiffness", "energy", "conductance")
ELASTIC = ("energy", *OF_ISLANDS)  # of contacts in which nothing yields
COMPARED = (*THEORIES, "persson_simplified")
CORRELATIONS = ("cooper_mikic_yovanovich", "mikic")  # of conductance


def chosen(on: Iterable[str], off: Iterable[str]) -> tuple[frozenset[str], frozenset[str]]:
    """Outputs asked for and refinements switched off, checked against each other."""
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
    if "yield" in outputs and (dropped or outputs & set(ELASTIC)):
        name = sorted(dropped | outputs & set(ELASTIC))[0]
        raise InputError(f"{name!r} is of elastic contacts, and effect 'yield' is on: leave one of the two out")
    if "finite_height" in dropped and outputs & set(OF_LAW):
        name = sorted(outputs & set(OF_LAW))[0]
        raise InputError(f"{name!r} comes from a law, which ends at h_max: leave finite_height on, or {name!r} out")
    if outputs == {"pressure_profile"} and "finite_height" in dropped:
        raise InputError("finite_height does not touch single islands: leave it out of off")
    if "pressure_profile" in outputs and "sphere_deformation" in dropped:
        raise InputError(
            "pressure_profile is of the deformed sphere: leave sphere_deformation on, or pressure_profile out"
        )
    return outputs, dropped
