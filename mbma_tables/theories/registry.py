"""Theories by name; each theory's module is imported when it is asked for."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from mbma_tables.errors import InputError

if TYPE_CHECKING:
    from mbma_tables.theories.protocol import Theory, UserTheory

_HOMES = {
    "mbma": ("mbma", "Mbma"),
    "calibrated": ("calibrated", "Calibrated"),
    "persson": ("persson", "Persson"),
    "greenwood_williamson": ("asperities", "GreenwoodWilliamson"),
}
THEORIES = tuple(_HOMES)


def get_theory(theory: str | Theory | UserTheory) -> Theory:
    """A theory by name, or as an object: one of this package's, or any with a `name` and an `answer`.

    Raises
    ------
    InputError
        For an unknown name, or an object that is no theory.

    Examples
    --------
    >>> from mbma_tables.theories import get_theory
    >>> get_theory("persson").name
    'persson'
    """
    from mbma_tables.theories.protocol import Theory, UserTheory, Wrapped

    if isinstance(theory, Theory):
        return theory
    if isinstance(theory, str):
        if theory in _HOMES:
            module, name = _HOMES[theory]
            made: Any = getattr(importlib.import_module(f"mbma_tables.theories.{module}"), name)()
            assert isinstance(made, Theory)
            return made
    elif isinstance(theory, UserTheory) and not isinstance(theory, type):
        return Wrapped(theory)
    raise InputError(
        f"theory must be one of {THEORIES} or an object with a name and answer(surface, u), got {theory!r}"
    )


def refuse_options_of_mbma(**given: bool) -> None:
    """Refuse MBMA's own options where the theory is another, or an object that has its own."""
    names = ", ".join(name for name, it in given.items() if it)
    if names:
        raise InputError(f"{names}: options of theory 'mbma' alone, asked for by its name")
