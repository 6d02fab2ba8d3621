"""Specimens: a surface with its units and its material, from a name, numbers, a measured map or a TOML file."""

from __future__ import annotations

import dataclasses
import json
import os
import pathlib
from collections.abc import Iterable, Mapping
from typing import Any

from mbma_tables.bodies.materials import effective_modulus
from mbma_tables.common.arguments import finite_array, one_number, require
from mbma_tables.common.errors import InputError
from mbma_tables.common.netcdf import is_own
from mbma_tables.common.plain_text import visible
from mbma_tables.common.toml_files import check, read_toml
from mbma_tables.common.units import Units, factor, in_one_unit, in_unit, known
from mbma_tables.contacts.quantities.registry import registry
from mbma_tables.islands.island_models import beside
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.roughness import ROUGHNESS
from mbma_tables.surfaces.self_affine import CASES, PARAMETERS
from mbma_tables.surfaces.spectrum import MIN_ZETA_1
from mbma_tables.surfaces.surface import MeasuredSurface, Surface
from mbma_tables.surfaces.treatment import OPTIONS, Treated
from mbma_tables.theories import resolve

MAGNIFICATION = ("hurst", "q0", "zeta_1", "h_rms", "h_max")
MOMENTS = ("hurst", "m0", "m2", "m4", "h_max")
NUMBERS = tuple(dict.fromkeys(PARAMETERS + MAGNIFICATION + MOMENTS + ROUGHNESS))
MATERIAL = ("E_star", "E1", "nu1", "E2", "nu2")
MAP_OPTIONS = (
    *OPTIONS[1:],
    "extrapolate_to",
    "extrapolate_hurst",
)  # for a measured map; its unit is separate


@dataclasses.dataclass(frozen=True)
class Specimen:
    """A surface with its units and material."""

    surface: AnySurface
    title: str
    E_star: float | None = None
    stress_unit: str | None = None

    def __post_init__(self) -> None:
        if self.stress_unit is not None and self.E_star is None:
            raise InputError(
                f"a unit of stress, {self.stress_unit}, is given and no modulus: give E_star, or leave the unit out"
            )

    @property
    def units(self) -> Units:
        """Units of its lengths and stresses."""
        return Units(self.surface.unit, "1" if self.E_star is None else self.stress_unit)

    @property
    def modulus(self) -> float | str:
        """E* for `contact`: with its unit if known, 1 without a material."""
        number = 1.0 if self.E_star is None else self.E_star
        return number if self.stress_unit is None else f"{number!r} {self.stress_unit}"

    def in_units(self, length: str | None, stress: str | None) -> Specimen:
        """The specimen in the requested units: converted from known units, else taken to be in them."""
        modulus = self.E_star
        unit = self.stress_unit
        if stress is not None:
            stress = known(stress, "stress")
            if modulus is not None and unit is not None:
                modulus *= factor(unit, stress, "stress")
            unit = stress
        return dataclasses.replace(
            self, surface=in_unit(self.surface, length), E_star=modulus, stress_unit=unit
        )


def _from_map(path: pathlib.Path, options: dict[str, Any], unit: str | None) -> Specimen:
    """The surface of a measured map or line scan, with options of `Surface.from_map`, or of its simulation's table."""
    if is_own(path):
        if options:
            raise InputError(
                f"{_printable(path)} is a table of a simulated map: leave {', '.join(options)} out"
            )
        from mbma_tables.theories import BoundaryElements

        surface = BoundaryElements.from_netcdf(path).surface
        return Specimen(in_unit(surface, unit), f"simulated map: {_printable(path)}")
    fitted = options.pop("model", "") == "self-affine"
    surface = measured(path, options | {"unit": unit})[1]
    title = f"{'fitted to the map' if fitted else 'measured:'} {_printable(path)}"
    return Specimen(surface.fit() if fitted else surface, title)


def measured(
    path: pathlib.Path, treatment: Mapping[str, Any]
) -> tuple[Treated, MeasuredSurface]:
    """Treated heights of a map or line scan, and the surface that they are."""
    from mbma_tables.surfaces.maps import measured_surface, prepared

    if is_own(path):
        raise InputError(
            f"{_printable(path)} is a table of a simulated map, not the map: mbma curve --map reads it"
        )
    options = dict(treatment)
    further = [
        options.pop(name, None) for name in ("extrapolate_to", "extrapolate_hurst")
    ]
    treated = prepared(path, options, None)
    return treated, MeasuredSurface.of(measured_surface(treated, None, *further))


def _printable(path: pathlib.Path) -> str:
    """The file's name on one line, with undecodable bytes replaced and control characters as escapes."""
    return visible(os.fsencode(path.name).decode("utf-8", "replace"))


def from_numbers(
    given: Mapping[str, Any],
    unit: str | None = None,
    title: str = "surface given by numbers",
) -> Specimen:
    """The surface with one complete set of numbers, plain ones in `unit`."""
    if set(given) & set(ROUGHNESS) - {"nominal_area"}:
        alien = set(given) - {*ROUGHNESS, "hurst", "h_max"}
        if alien:
            raise InputError(
                f"{', '.join(alien)} beside numbers of a drawing: leave them out, or give longest or shortest"
            )
        return Specimen(
            Surface.from_roughness(**{"hurst": None, **given}, unit=unit), title
        )
    if {"h_max" if key == "nominal_area" else key for key in given} not in map(
        set, (PARAMETERS, MAGNIFICATION, MOMENTS)
    ):
        raise InputError(
            f"a surface needs {', '.join(PARAMETERS)} (or zeta_1 for q1), or {', '.join(MOMENTS)}, or "
            f"roughness (Rq, ...), with h_max or nominal_area; got {', '.join(given) or 'none of them'}"
        )
    plain, unit = in_one_unit(given, unit)
    numbers: dict[str, Any] = {
        key: finite_array(key, value)[()] for key, value in plain.items()
    }
    if "m0" in numbers:
        return Specimen(Surface.from_moments(**numbers, unit=unit), title)
    if "zeta_1" in numbers:
        zeta_1 = numbers.pop("zeta_1")
        require(
            "zeta_1",
            zeta_1,
            zeta_1 > MIN_ZETA_1,
            "greater than 3, so that the smallest island has a band",
        )
        numbers["q1"] = numbers["q0"] * zeta_1
    return Specimen(Surface(**numbers, unit=unit), title)


def is_of_numbers(entries: Mapping[str, Any]) -> bool:
    """Whether entries of a surface are its five numbers or moments, not those of a drawing."""
    return "h_rms" in entries or "m0" in entries


def surface_of_entries(entries: Mapping[str, Any]) -> AnySurface:
    """The surface, or the batch, of the arguments of `Surface.from_roughness`, of `Surface` or of `Surface.from_moments`."""
    if not is_of_numbers(entries):
        drawn: AnySurface = Surface.from_roughness(**entries)
        return drawn
    numbers = dict(entries)
    return from_numbers(numbers, numbers.pop("unit", None)).surface


def effective_modulus_of(
    given: Mapping[str, Any], unit: str | None = None
) -> tuple[float | None, str | None]:
    """E* from a material's numbers, None if there are none, and its unit: the one given, or the first named."""
    plain, unit = in_one_unit(given, unit, "stress")
    if not given:
        return None, unit
    numbers = {key: one_number(key, value) for key, value in plain.items()}
    if set(numbers) == {"E_star"}:
        require("E_star", numbers["E_star"], numbers["E_star"] > 0, "positive")
        return float(numbers["E_star"]), unit
    if set(numbers) != set(MATERIAL[1:]):
        raise InputError(
            f"a material is E_star alone, or all of E1, nu1, E2, nu2; got {', '.join(given)}"
        )
    return float(effective_modulus(**numbers)), unit


def take_theory(
    entries: dict[str, Any], names: Iterable[str], folder: pathlib.Path
) -> None:
    """Put options of a theory among the entries of a file, those of `names`, into its theory.

    An island model that is a file is relative to `folder`.
    """
    options = {name: entries.pop(name) for name in names if name in entries}
    if "island_model" in options:
        options["island_model"] = beside(options["island_model"], folder)
    if options:
        entries["theory"] = resolve(entries.get("theory"), options=options)


def refuse_joint(path: pathlib.Path, entries: Mapping[str, Any]) -> None:
    """Raise an error for the file of a joint, with the commands that read it."""
    if "part_a" in entries:
        raise InputError(
            f"{path} describes a joint, not one surface: `mbma joint {path} --pressure 1MPa` has its results, and "
            f"`mbma export TARGET --joint {path} --pressures 1MPa:50MPa --out FILE` writes it for other programs"
        )


def read_specimen(
    path: pathlib.Path, entries: Mapping[str, Any] | None = None
) -> Specimen:
    """The specimen of a TOML file with the table [surface] of a scene, and [material]; `entries` if it was read."""
    if entries is None:
        entries = read_toml(path, "surface")
    content = schema()
    tables = {
        "surface": content["properties"]["surface"],
        "material": content["$defs"]["material"],
    }
    refuse_joint(path, entries)
    try:
        check(
            entries,
            {
                "type": "object",
                "required": ["surface"],
                "additionalProperties": False,
                "properties": tables,
            },
        )
        return from_tables(entries, path.parent, f"surface of {_printable(path)}")
    except InputError as fault:
        raise InputError(f"{path}: {fault}") from None


def from_tables(entries: Mapping[str, Any], folder: pathlib.Path, title: str) -> Specimen:
    """The specimen of the tables [surface] and [material]; files that they name are relative to `folder`."""
    material = dict(entries.get("material", {}))
    modulus, stress_unit = effective_modulus_of(
        material, material.pop("stress_unit", None)
    )
    found = _from_table(entries["surface"], folder, title)
    return dataclasses.replace(found, E_star=modulus, stress_unit=stress_unit)


def _from_table(surface: Mapping[str, Any], folder: pathlib.Path, title: str) -> Specimen:
    """The surface of a table [surface]."""
    numbers = dict(surface)
    name, source, unit = (
        numbers.pop(key, None) for key in ("name", "map", "length_unit")
    )
    treatment = {
        key: numbers.pop(key) for key in (*MAP_OPTIONS, "model") if key in numbers
    }
    given = (
        ["name"] * (name is not None)
        + ["map"] * (source is not None)
        + ["numbers"] * bool(numbers)
    )
    if len(given) > 1:
        listed = f" ({', '.join(numbers)})" if numbers else ""
        raise InputError(
            f"[surface]: {' and '.join(given)}{listed} are given: one of name, map or numbers"
        )
    if treatment and source is None:
        raise InputError(
            f"[surface]: {', '.join(treatment)}: for a measured map, which is missing: give map = ..."
        )
    if name is not None:
        return Specimen(Surface.named(name), CASES[name].title).in_units(unit, None)
    if source is None:
        return from_numbers(numbers, unit, title)
    path = folder / source
    if not path.is_file():
        raise InputError(f"[surface]: map = {str(path)!r} is not a file")
    return _from_map(path, treatment, unit)


def schema() -> dict[str, Any]:
    """The JSON schema of scene files, as published in the package, with the names of all quantities."""
    path = pathlib.Path(__file__).with_name("scenes") / "scene.schema.json"
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    items = content["properties"]["quantities"]["items"]
    # with that of `Contact.leakage`, which stands for several
    items["enum"] = [*registry(), "leakage"]
    return content
