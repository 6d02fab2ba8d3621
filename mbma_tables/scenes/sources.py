"""Where a surface and a material come from: a name, numbers or a measured map, with words for what is wrong."""

from __future__ import annotations

import dataclasses
import difflib
import os
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbma_tables.errors import InputError

if TYPE_CHECKING:
    from mbma_tables.surfaces.surface import Surface

BAND = ("hurst", "q0", "q1", "h_rms", "h_max")
MAGNIFICATION = ("hurst", "q0", "zeta_1", "h_rms", "h_max")
MOMENTS = ("hurst", "m0", "m2", "m4", "h_max")
NUMBERS = tuple(dict.fromkeys(BAND + MAGNIFICATION + MOMENTS))
MATERIAL = ("E_star", "E1", "nu1", "E2", "nu2")


@dataclasses.dataclass(frozen=True)
class Source:
    """A surface, and what is known about it besides its five numbers."""

    surface: Surface
    title: str
    length_unit: str | None = None
    E_star: float | None = None


def from_name(name: str) -> Source:
    """A case of the paper."""
    from mbma_tables.surfaces.cases import get_case
    from mbma_tables.surfaces.surface import Surface

    case = get_case(name)
    return Source(Surface.named(name), case.title, case.length_unit)


def from_map(path: Path) -> Source:
    """The surface fitted to a measured map."""
    from mbma_tables.surfaces.maps import read_map
    from mbma_tables.surfaces.surface import Surface

    surface = Surface.from_map(read_map(path))
    unit = None if surface.fit is None else surface.fit.length_unit
    return Source(surface, f"fitted to the map {shown(path)}", unit)


def shown(path: Path) -> str:
    """The file's name without its folder, bytes that are no text replaced."""
    return os.fsencode(path.name).decode("utf-8", "replace")


def from_numbers(given: Mapping[str, Any]) -> Surface:
    """The surface of one complete set of numbers."""
    from mbma_tables.arguments import require
    from mbma_tables.surfaces.moments import MIN_ZETA_1
    from mbma_tables.surfaces.surface import Surface

    if set(given) not in (set(BAND), set(MAGNIFICATION), set(MOMENTS)):
        raise InputError(
            f"a surface needs {', '.join(BAND)} (or zeta_1 for q1), or {', '.join(MOMENTS)}; got "
            f"{', '.join(given) or 'none of them'}"
        )
    numbers = {key: _one_number(key, value) for key, value in given.items()}
    if "m0" in numbers:
        return Surface.from_moments(**numbers)
    if "zeta_1" in numbers:
        zeta_1 = numbers.pop("zeta_1")
        require("zeta_1", zeta_1, zeta_1 > MIN_ZETA_1, "greater than 3 (the model's floors need room)")
        numbers["q1"] = numbers["q0"] * zeta_1
    return Surface(**numbers)


def _one_number(name: str, value: Any) -> Any:
    from mbma_tables.arguments import finite_array

    array = finite_array(name, value)
    if array.ndim:
        raise InputError(f"{name} must be one number, got {array.size}")
    return array


def modulus(given: Mapping[str, Any]) -> float | None:
    """E* of a material's numbers; None of none."""
    from mbma_tables.arguments import require
    from mbma_tables.materials import effective_modulus

    if not given:
        return None
    numbers = {key: _one_number(key, value) for key, value in given.items()}
    if set(numbers) == {"E_star"}:
        require("E_star", numbers["E_star"], numbers["E_star"] > 0, "positive")
        return float(numbers["E_star"])
    if set(numbers) != set(MATERIAL[1:]):
        raise InputError(f"a material is E_star alone, or all of E1, nu1, E2, nu2; got {', '.join(given)}")
    return float(effective_modulus(**numbers))


def known_keys(entries: Mapping[str, Any], known: Collection[str], where: str) -> None:
    """Refuse a key that is not known, with the nearest one that is."""
    for key in entries:
        if key not in known:
            near = difflib.get_close_matches(key, known, 1)
            hint = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(known)}"
            raise InputError(f"{where}: unknown key {key!r}; {hint}")
