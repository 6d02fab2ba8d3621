"""Theories by name."""

from __future__ import annotations

from mbma_tables.errors import InputError
from mbma_tables.theories.greenwood_williamson import GreenwoodWilliamson
from mbma_tables.theories.mbma import Mbma
from mbma_tables.theories.persson import Persson
from mbma_tables.theories.protocol import Theory, UserTheory, Wrapped

THEORIES = ("mbma", "persson", "greenwood_williamson")


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
    if isinstance(theory, Theory):
        return theory
    if isinstance(theory, str):
        known: dict[str, type[Theory]] = {t.name: t for t in (Mbma, Persson, GreenwoodWilliamson)}
        if theory in known:
            return known[theory]()
    elif isinstance(theory, UserTheory) and not isinstance(theory, type):
        return Wrapped(theory)
    raise InputError(
        f"theory must be one of {THEORIES} or an object with a name and answer(surface, u), got {theory!r}"
    )


def refuse_options_of_mbma(**given: bool) -> None:
    """Refuse MBMA's own options where the theory is another, or an object that has its own."""
    if any(given.values()):
        raise InputError(f"{', '.join(name for name, it in given.items() if it)}: options of theory 'mbma', by name")
