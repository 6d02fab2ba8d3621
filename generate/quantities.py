"""`python -m generate quantities`: typed properties of contacts, laws and joints, from the registry of quantities.

Editors and type checkers complete the names of quantities by these; `tests/contacts/quantities`
compares the file with the registry.
"""

import inspect
import pathlib
import textwrap

import click

from mbma_tables.common.files import write_file
from mbma_tables.contacts.quantities import registry

FILE = pathlib.Path(registry.__file__).with_name("properties.py")
HEAD = '''"""Typed access to the quantities of the registry, written by `python -m generate quantities`; do not edit."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from mbma_tables.common.arguments import Numbers
'''
CLASSES = {
    "ContactQuantities": "Quantities of a contact; `quantity` computes them.",
    "LawQuantities": "Quantities of a law, as functions of a gap, the pressure or the area.",
    "JointQuantities": "Quantities of a joint, as functions of the pressure.",
}
OF_CONTACTS = '''
    def quantity(self, name: str) -> Any:
        """A quantity by its name."""
        raise NotImplementedError
'''
CONTACT = """
    @property
    def {name}(self) -> Numbers:
{doc}
        value: Numbers = self.quantity("{name}")
        return value
"""
LAW = """
    def {name}(
        self: Any,
        mean_separation: ArrayLike | str | None = None,
        *,
        separation: ArrayLike | str | None = None,
        pressure: ArrayLike | str | None = None,
        area: ArrayLike | None = None,
    ) -> Numbers:
{doc}
        contact = self.at(
            mean_separation, separation=separation, pressure=pressure, area=area
        )
        value: Numbers = contact.quantity("{name}")
        return value
"""
JOINT = """
    def {name}(self: Any, pressure: ArrayLike | str) -> Numbers:
{doc}
        value: Numbers = self.at_pressure(pressure).quantity("{name}")
        return value
"""
# curves of a law that the compiled core evaluates, and inverses, which have their own arguments
OF_LAWS = (
    "pressure",
    "area",
    "stiffness",
    "energy",
    "error",
    "separation",
    "unloading_stiffness",
)
OF_JOINTS = ("pressure",)


def docstring(notes: str) -> str:
    """The docstring of a declaration, indented for a method."""
    text = inspect.cleandoc(notes)
    lines = text.splitlines()
    if len(lines) == 1:
        return f'        """{text}"""'
    return textwrap.indent(f'"""{text}\n"""', " " * 8)


def properties() -> str:
    """The text of the file."""
    parts = [HEAD]
    for (name, meaning), template, others in zip(
        CLASSES.items(), (CONTACT, LAW, JOINT), ((), OF_LAWS, OF_JOINTS), strict=True
    ):
        parts.append(f'\n\nclass {name}:\n    """{meaning}"""\n')
        if template is CONTACT:
            parts.append(OF_CONTACTS)
        for quantity, declared in registry.registry().items():
            if quantity not in others:
                parts.append(
                    template.format(name=quantity, doc=docstring(declared.notes))
                )
    return "".join(parts)


@click.command()
def quantities() -> None:
    """Write the typed properties of contacts, laws and joints."""
    write_file(FILE, properties().encode())
    click.echo(FILE)
