"""Theories of rough contact, one file each, behind one protocol."""

from __future__ import annotations

import importlib
import reprlib
import types
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

from mbma_tables.common.errors import InputError
from mbma_tables.theories.named import (
    NAMED,
    OF_MAPS,
    THEORIES,
    class_of,
    options_of,
    shipped,
)

if TYPE_CHECKING:
    from mbma_tables.islands.variants import Variant as Variant
    from mbma_tables.surfaces.any_surface import AnySurface
    from mbma_tables.theories.base import Theory, TheoryAnswer, UserTheory
    from mbma_tables.theories.calibrated.theory import Calibrated
    from mbma_tables.theories.greenwood_williamson import GreenwoodWilliamson
    from mbma_tables.theories.mbma.theory import Mbma
    from mbma_tables.theories.persson import Method, Persson
    from mbma_tables.theories.simulated.one_map import BoundaryElements
    from mbma_tables.theories.simulated.theory import Simulated
    from mbma_tables.theories.tabulated import Tabulated

__all__ = [
    "THEORIES",
    "BoundaryElements",
    "Calibrated",
    "GreenwoodWilliamson",
    "Mbma",
    "Method",
    "Persson",
    "Simulated",
    "Tabulated",
    "Theory",
    "TheoryAnswer",
    "UserTheory",
    "Variant",
    "default_name",
    "resolve",
]

NONE: Mapping[str, Any] = types.MappingProxyType({})
# a theory's module is imported when first needed
_HOMES = {
    **{made: module for module, made in NAMED.values()},
    "Variant": ".islands.variants",
    "Method": "persson",
    "BoundaryElements": "simulated.one_map",
    "Tabulated": "tabulated",
    "Theory": "base",
    "TheoryAnswer": "base",
    "UserTheory": "base",
}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(importlib.import_module(f".{_HOMES[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def resolve(
    theory: str | Theory | UserTheory | Simulated | None,
    surface: Any = None,
    given_name: str | None = None,
    options: Mapping[str, Any] = NONE,
) -> Theory:
    """The theory that is asked for, or the default one: of contacts, laws, joints, scenes, exports and commands.

    Parameters
    ----------
    theory : str, theory or None
        A name, the file of a table of totals (`Tabulated`), an object, or None for that of
        `default_name`. An object is one of this package's, or any with a `name` and an `answer`.
    surface : Surface, optional
        For the default, and for "simulated" and `Simulated`, which are theories of one
        surface: the simulation of its map, kept for the last eight of them.
    given_name : str, optional
        As for `default_name`.
    options : mapping, optional
        Options of a theory that is not given as an object, as commands and files have them.

    Raises
    ------
    InputError
        For an unknown name, an object that is not a theory or has a hardness, options that
        the theory does not have, and theories of a map for a surface without one.

    Examples
    --------
    >>> from mbma_tables import Surface
    >>> from mbma_tables.theories import resolve
    >>> road = Surface.named("concrete")
    >>> resolve(None, road, "pressure"), resolve(None, road, "separation"), resolve("persson")
    (Calibrated(), Mbma(), Persson())
    >>> resolve(None, road, options={"rtol": 1e-4})
    Mbma(rtol=0.0001)
    """
    chosen: Any = theory
    if chosen is None and (surface is not None or options):
        chosen = default_name(surface, given_name, options)
    if isinstance(chosen, str) and chosen in NAMED:
        chosen = _with_options(chosen, options) if options else shipped(chosen)
    elif is_table(chosen) and not options:
        chosen = __getattr__("Tabulated")(chosen)
    elif options:
        raise InputError(
            f"{', '.join(options)}: options of a theory given by its name, got {chosen!r}"
        )
    from mbma_tables.theories.base import Theory

    if isinstance(chosen, Theory) and chosen.elastic is chosen:
        return chosen
    return _of_object(chosen, surface)


def is_table(theory: Any) -> bool:
    """Whether a theory is given by the file of a table of its totals."""
    return isinstance(theory, str) and theory.endswith(".nc")


def _of_object(chosen: Any, surface: Any) -> Theory:
    """A simulation of a surface's map or a user's object as a theory; other objects are refused."""
    from mbma_tables.theories.base import Theory, UserTheory
    from mbma_tables.theories.simulated.theory import Simulated
    from mbma_tables.theories.users import Wrapped

    if isinstance(chosen, Simulated):
        return chosen.of(surface)
    if isinstance(chosen, Theory):
        raise InputError(
            f"theory {chosen.name!r} is one with a hardness: a hardness is of the bodies, "
            "Bodies(..., hardness=...), beside the elastic theory"
        )
    if isinstance(chosen, UserTheory) and not isinstance(chosen, type):
        return Wrapped(chosen)
    raise InputError(
        f"theory must be one of {(*THEORIES, *OF_MAPS)} or an object with a name and answer(surface, u), "
        f"got {reprlib.repr(chosen)}"
    )


def _with_options(name: str, options: Mapping[str, Any]) -> Any:
    """A shipped theory with options; those that it does not have are refused."""
    others = [option for option in options if option not in options_of(name)]
    if others:
        owners = [other for other in NAMED if others[0] in options_of(other)]
        owner = f"theory {owners[0]!r} alone" if owners else "no theory"
        known = ", ".join(options_of(name)) or "none"
        raise InputError(
            f"{', '.join(others)}: options of {owner}, not of {name!r}, which has {known}"
        )
    return class_of(name)(**options)


def default_name(
    surface: AnySurface | None,
    given_name: str | None = None,
    options: Collection[str] = (),
) -> str:
    """The name of the theory where none is given.

    Parameters
    ----------
    surface : Surface or None
        One surface or a batch; None where options alone say which theory it is.
    given_name : str, optional
        The quantity at which the contact is asked for, "separation", "mean_separation",
        "pressure" or "area"; None for laws and curves, which are functions of the mean
        separation.
    options : collection of str, optional
        Names of options that are given without a theory.

    Returns
    -------
    str
        The theory that has the options, if there are any. Else "mbma" at a given separation
        d, which is MBMA's coordinate; "simulated" for a surface opened from the table of its
        simulation, and for a map of at least 64 points a side; and "calibrated" for every
        other surface.

    Examples
    --------
    >>> from mbma_tables import Surface
    >>> from mbma_tables.theories import default_name
    >>> road = Surface.named("concrete")
    >>> default_name(road, "pressure"), default_name(road, "separation"), default_name(road, options=["variant"])
    ('calibrated', 'mbma', 'mbma')
    """
    for option in options:
        for name in NAMED:
            if option in options_of(name):
                return name
    if given_name == "separation":
        return "mbma"
    if getattr(surface, "table", None) is not None:
        return "simulated"
    if surface is None or getattr(surface, "map", None) is None:
        return "calibrated"
    from mbma_tables.theories.simulated.theory import is_default

    return "simulated" if is_default(surface) else "calibrated"


def theory_text(surface: AnySurface, theory: str | Theory | UserTheory | None) -> str:
    """The name of the theory of pressures and laws, for texts: a simulation that it may depend on is not made."""
    if theory is None and getattr(surface, "table", None) is None:
        from mbma_tables.theories.simulated.theory import is_for_simulation

        if is_for_simulation(surface):
            return "simulated, or calibrated if the simulation does not converge"
    name_or_theory = default_name(surface) if theory is None else theory
    return str(getattr(name_or_theory, "name", name_or_theory))
