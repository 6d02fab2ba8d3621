"""Contacts of commands whose numbers are ranges: what was typed, as `uncertainty` takes it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from mbma_tables.bodies.bodies import Bodies
from mbma_tables.cli import options
from mbma_tables.common.distributions import (
    Distribution,
    distribution_of,
    distributions_in,
    of_all,
    with_numbers,
)
from mbma_tables.common.errors import InputError
from mbma_tables.common.toml_files import read_toml
from mbma_tables.common.units import factor
from mbma_tables.design import specimen as specimens
from mbma_tables.design.specimen import Specimen

if TYPE_CHECKING:
    from mbma_tables.design.uncertainty import Uncertainty


class Typed(NamedTuple):
    """A surface and bodies as they were typed, of which numbers may be ranges."""

    surface: dict[str, Any]  # numbers of the surface, with its unit
    material: dict[str, Any]  # moduli and Poisson's ratios
    of_bodies: dict[str, Any]  # hardness and conductivity
    stress_unit: str | None  # of plain moduli
    inputs: dict[str, Distribution]  # by place in the options, or in the file
    central: Specimen  # of the medians

    @property
    def has_range(self) -> bool:
        """Whether any number of the surface or the bodies is a range."""
        entries = (self.surface, self.material, self.of_bodies)
        return any(next(distributions_in(each), None) for each in entries)

    def bodies(self) -> Bodies:
        """The bodies, whose constants may be ranges."""
        moduli = {
            name: _in_stress_unit(name, each, self.stress_unit)
            for name, each in self.material.items()
            if name.startswith("E")
        }
        if not next(distributions_in(self.material), None):
            return Bodies(self.central.modulus, **self.of_bodies)
        if "E_star" in moduli:
            return Bodies(moduli["E_star"], **self.of_bodies)
        return Bodies(
            E=(moduli["E1"], moduli["E2"]),
            nu=(self.material["nu1"], self.material["nu2"]),
            **self.of_bodies,
        )

    def face(self) -> Any:
        """The surface, or its numbers where one of them is a range."""
        has_range = next(distributions_in(self.surface), None) is not None
        return self.surface if has_range else self.central.surface


def _in_stress_unit(name: str, given: Any, unit: str | None) -> Any:
    """A modulus in a unit of stress: as typed, or plain numbers in it."""
    known = distribution_of(name, given)
    if known is not None:
        own = known.unit or unit
        return given if own is None else known.retyped(_factor(own, unit), unit or own)
    if isinstance(given, str) or unit is None:
        return given
    return f"{given!r} {unit}"


def _factor(have: str, want: str | None) -> float:
    return 1.0 if want is None else factor(have, want, "stress")


def _medians(entries: Any) -> tuple[dict[str, Distribution], Any]:
    """The distributions among entries, and the entries with their medians."""
    found = dict(distributions_in(entries))
    return found, with_numbers(entries, of_all(found, lambda each: each.median))


def typed_of(
    given: Mapping[str, Any],
    model: options.Model,
    conductivity: Sequence[Any] | None,
) -> Typed:
    """What the options of a command, and the file that they name, have as numbers."""
    options.surface_in(given)
    entries: dict[str, Any] | None = None
    if given["file"] is not None:
        entries = read_toml(given["file"], "surface")
    in_file = {
        name: dict(entry)
        for name, entry in (entries or {}).items()
        if name in ("surface", "material") and isinstance(entry, Mapping)
    }
    surface = dict(in_file.get("surface", {}))
    unit = surface.pop("length_unit", None)
    numbers = {name: given[name] for name in specimens.NUMBERS}
    surface |= options.given_values(numbers)
    surface |= options.given_values({"unit": given["length_unit"] or unit})
    material = dict(in_file.get("material", {}))
    stress_unit = given["stress_unit"] or material.pop("stress_unit", None)
    moduli = options.given_values({name: given[name] for name in specimens.MATERIAL})
    material = moduli or material
    of_bodies = options.given_values(
        {"hardness": model.hardness, "largest_pressure": model.largest_pressure}
    )
    if conductivity:
        one = len(conductivity) == 1
        of_bodies["conductivity"] = conductivity[0] if one else tuple(conductivity)
    own, of_options = _medians(dict(given))
    inputs, of_file = _medians(entries)
    central = options.specimen_of(of_options, of_file)
    return Typed(surface, material, of_bodies, stress_unit, inputs | own, central)


def quantiles_of(
    typed: Typed,
    loads: Mapping[str, Sequence[Any]],
    model: options.Model,
    asked: Sequence[str],
    drawn: Mapping[str, Any],
) -> Uncertainty:
    """Quantiles at the pressures of a command, of quantities that tables have and of those that are asked for."""
    from mbma_tables.contacts.contact import contact
    from mbma_tables.design.uncertainty import (
        LOAD,
        Load,
        bodies_of_entries,
        names_by_default,
        uncertainty,
    )

    if [*loads] != [LOAD]:
        raise InputError(
            f"quantiles of numbers that are ranges are at a pressure, got {', '.join(loads)}"
        )
    pressures = list(loads[LOAD])
    quantities = None
    if asked:
        central = typed.central
        bodies = Bodies.of(typed.bodies())
        _, entries = _medians(vars(bodies))
        pressed = contact(
            central.surface,
            bodies_of_entries(bodies, entries),
            pressure=Load.of(pressures).at(0.5),
            theory=model.theory,
        )
        quantities = [*dict.fromkeys([*names_by_default(pressed), *asked])]
    return uncertainty(
        typed.face(),
        typed.bodies(),
        pressure=pressures,
        theory=model.theory,
        quantities=quantities,
        **drawn,
    )
