"""Theories of rough contact, one file each, behind one protocol."""

from __future__ import annotations

import importlib
import reprlib
from typing import TYPE_CHECKING, Any

from mbma_tables.common.errors import InputError
from mbma_tables.common.shared import shared

if TYPE_CHECKING:
    from mbma_tables.surfaces.any_surface import AnySurface
    from mbma_tables.theories.base import Theory, TheoryAnswer, UserTheory
    from mbma_tables.theories.calibrated.theory import Calibrated
    from mbma_tables.theories.greenwood_williamson import GreenwoodWilliamson
    from mbma_tables.theories.mbma.theory import Mbma
    from mbma_tables.theories.mbma.variants import Variant as Variant
    from mbma_tables.theories.persson import Method, Persson
    from mbma_tables.theories.simulated.one_map import BoundaryElements
    from mbma_tables.theories.simulated.theory import Simulated

__all__ = [
    "THEORIES",
    "BoundaryElements",
    "Calibrated",
    "GreenwoodWilliamson",
    "Mbma",
    "Method",
    "Persson",
    "Simulated",
    "Theory",
    "TheoryAnswer",
    "UserTheory",
    "Variant",
    "default_theory",
    "get_theory",
    "theory_name",
]

THEORIES = ("mbma", "calibrated", "persson", "greenwood_williamson")
_NAMED = {
    "mbma": "Mbma",
    "calibrated": "Calibrated",
    "persson": "Persson",
    "greenwood_williamson": "GreenwoodWilliamson",
    "simulated": "Simulated",
}
# a theory's module is imported when first needed
_HOMES = {
    "Mbma": "mbma.theory",
    "Variant": "mbma.variants",
    "Calibrated": "calibrated.theory",
    "Persson": "persson",
    "Method": "persson",
    "GreenwoodWilliamson": "greenwood_williamson",
    "BoundaryElements": "simulated.one_map",
    "Simulated": "simulated.theory",
    "Theory": "base",
    "TheoryAnswer": "base",
    "UserTheory": "base",
}
OF_MAPS = ("simulated",)  # theories of one map, made by simulating it
# of MBMA
OPTIONS = {
    "island_model": "universal",
    "variant": "reported",
    "rtol": 1e-8,
    "outside": "raise",
}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def get_theory(theory: str | Theory | UserTheory, surface: Any = None) -> Theory:
    """A theory by name, or as an object: one of this package's, or any with a `name` and an `answer`.

    "simulated" and `Simulated` are theories of one `surface`, made from a map: the simulation
    of that map, kept for the last eight of them.

    Raises
    ------
    InputError
        For an unknown name, an object that is not a theory, and theories of a map for a
        surface without one.

    Examples
    --------
    >>> from mbma_tables.theories import get_theory
    >>> get_theory("persson").name
    'persson'
    """
    from mbma_tables.theories.base import Theory, UserTheory
    from mbma_tables.theories.users import Wrapped

    chosen: Any = theory
    if isinstance(theory, str) and theory in _NAMED:
        chosen = __getattr__(_NAMED[theory])()
    if isinstance(chosen, Theory):
        if chosen.elastic is not chosen:
            raise InputError(
                f"theory {chosen.name!r} is one with a hardness: a hardness is of the bodies, "
                "Bodies(..., hardness=...), beside the elastic theory"
            )
        return chosen

    from mbma_tables.theories.simulated.theory import Simulated

    if isinstance(chosen, Simulated):
        return chosen.of(surface)
    if isinstance(chosen, UserTheory) and not isinstance(chosen, type):
        return Wrapped(chosen)
    raise InputError(
        f"theory must be one of {(*THEORIES, *OF_MAPS)} or an object with a name and answer(surface, u), "
        f"got {reprlib.repr(theory)}"
    )


@shared()
def default_theory(name: str) -> Theory:
    """One of `THEORIES` with its defaults, made once per process."""
    return get_theory(name)


def theory_name(
    surface: AnySurface,
    theory: str | Theory | UserTheory | None,
    given_name: str | None = None,
) -> Any:
    """The given theory, or the default one: the rule of contacts, laws, joints, scenes, exports and commands.

    Parameters
    ----------
    surface : Surface
        One surface or a batch.
    theory : str, theory or None
        What the caller gave; anything but None is returned as it is.
    given_name : str, optional
        The quantity at which the contact is asked for, "separation", "mean_separation",
        "pressure" or "area"; None for laws and curves, which are functions of the mean
        separation.

    Returns
    -------
    str or theory
        By default "mbma" at a given separation d, which is MBMA's coordinate; else
        "simulated" for a surface opened from the table of its simulation, and for a map that
        is resolved and of at most 2^18 points; and "calibrated" for every other
        surface.

    Examples
    --------
    >>> from mbma_tables import Surface
    >>> from mbma_tables.theories import theory_name
    >>> road = Surface.named("concrete")
    >>> theory_name(road, None, "pressure"), theory_name(road, None, "separation"), theory_name(road, "persson")
    ('calibrated', 'mbma', 'persson')
    """
    if theory is not None:
        return theory
    if given_name == "separation":
        return "mbma"
    if getattr(surface, "table", None) is not None:
        return "simulated"
    if getattr(surface, "map", None) is None:
        return "calibrated"
    from mbma_tables.theories.simulated.theory import is_default

    return "simulated" if is_default(surface) else "calibrated"


def theory_text(surface: AnySurface, theory: str | Theory | UserTheory | None) -> str:
    """The name of the theory of pressures and laws, for texts: a simulation that it may depend on is not made."""
    if theory is None and getattr(surface, "table", None) is None:
        from mbma_tables.theories.simulated.theory import is_for_simulation

        if is_for_simulation(surface):
            return "simulated, or calibrated if the simulation does not converge"
    name_or_theory = theory_name(surface, theory)
    return str(getattr(name_or_theory, "name", name_or_theory))
