"""The registry of quantities: each is declared once, and whatever shows quantities iterates over them.

A file of this folder declares a quantity, or a family that shares a formula, by decorating the
function that computes it from the state of a contact (`declaration`); `MODULES` lists these files. Contacts, laws,
joints, datasets and tables know of a quantity what its declaration has.
"""

from __future__ import annotations

import functools
import importlib
import types
from collections.abc import Mapping

from mbma_tables.common import units as of_arguments
from mbma_tables.common.arguments import nearest
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import HEAT_CONDUCTANCE, Units
from mbma_tables.contacts.quantities.declaration import Quantity
from mbma_tables.contacts.quantities.state import Need

#: modules that declare quantities, in the order in which these are shown
MODULES = [
    "mbma_tables.contacts.quantities.separations",
    "mbma_tables.contacts.quantities.pressures",
    "mbma_tables.contacts.quantities.stiffnesses",
    "mbma_tables.contacts.quantities.conductances",
    "mbma_tables.contacts.quantities.leakage",
    "mbma_tables.contacts.quantities.gaps",
    "mbma_tables.contacts.quantities.adhesion",
    "mbma_tables.contacts.quantities.uncertainty",
]


@functools.cache
def _declared_in(name: str) -> dict[str, Quantity]:
    """The quantities of one module, in their order."""
    module = importlib.import_module(name)
    return {
        value.name: value
        for value in vars(module).values()
        if isinstance(value, Quantity)
    }


def registry() -> Mapping[str, Quantity]:
    """All quantities by name."""
    return _declared_in_all(tuple(MODULES))


@functools.cache
def _declared_in_all(modules: tuple[str, ...]) -> Mapping[str, Quantity]:
    """The quantities of several modules by name: a table of a joint asks for them a hundred times."""
    quantities: dict[str, Quantity] = {}
    for module in modules:
        for name, declaration in _declared_in(module).items():
            if name in quantities:
                raise ValueError(
                    f"the quantity {name} is declared twice, the second time in {module}"
                )
            quantities[name] = declaration
    return types.MappingProxyType(quantities)


def results() -> list[str]:
    """Names of the quantities that pictures and sensitivities have without being asked."""
    return [name for name, declared in registry().items() if declared.is_result]


def conductances() -> list[str]:
    """Names of the conductances of heat, that of the whole interface first."""
    return [
        name
        for name, declared in registry().items()
        if declared.dimension == HEAT_CONDUCTANCE
    ]


def needs_of(name: str) -> list[Need]:
    """What a quantity and those that it is made of need, each once."""
    declared = get(name)
    needs = dict.fromkeys(declared.needs)
    for part in declared.made_of:
        needs |= dict.fromkeys(needs_of(part))
    return list(needs)


def names_of_parts(name: str) -> set[str]:
    """Names of a quantity and of all that it is made of by its declaration."""
    return {name}.union(*map(names_of_parts, registry()[name].made_of))


def in_files() -> dict[str, Quantity]:
    """Quantities by their names in files for other programs: their own and further ones."""
    quantities = dict(registry())
    for declared in registry().values():
        if declared.name_in_files:
            quantities[declared.name_in_files] = declared
    return quantities


def law_functions() -> dict[str, Quantity]:
    """Quantities that every law as code has, by the names of their functions."""
    return {
        declared.law_function.name: declared
        for declared in registry().values()
        if declared.law_function is not None
    }


def get(name: str) -> Quantity:
    """A quantity by its name; the error for an unknown one names the nearest, and all."""
    if name not in registry():
        known = [*registry()]
        if name in in_files():
            hint = f"did you mean {in_files()[name].name!r}? "
        else:
            # a model uncertainty is not meant where its name is not begun
            meant = [n for n in known if "scat" in str(name) or not n.endswith("scatter")]
            near = nearest(str(name), meant)
            hint = f"{near} " if near.endswith("?") else ""
        raise InputError(
            f"no quantity is named {name!r}; {hint}known are {', '.join(known)}"
        )
    return registry()[name]


def unit_of(name: str, units: Units) -> str:
    """The unit of a quantity by its declaration, or of an argument, beside lengths and stresses in `units`."""
    if name in registry():
        return registry()[name].unit_in(units)
    return of_arguments.unit_of(name, units)
