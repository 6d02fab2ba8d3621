"""The shipped theories by name, whose modules are imported when first needed."""

import dataclasses
import importlib
from typing import Any

from mbma_tables.common.arguments import require_name
from mbma_tables.common.shared import shared

# the shipped theories: modules and classes by name; their fields are their options
NAMED = {
    "mbma": ("mbma.theory", "Mbma"),
    "calibrated": ("calibrated.theory", "Calibrated"),
    "persson": ("persson", "Persson"),
    "greenwood_williamson": ("greenwood_williamson", "GreenwoodWilliamson"),
    "simulated": ("simulated.theory", "Simulated"),
}
OF_MAPS = ("simulated",)  # theories of one map, made by simulating it
THEORIES = tuple(name for name in NAMED if name not in OF_MAPS)


def class_of(name: str) -> Any:
    """The class of a shipped theory."""
    module, made = NAMED[name]
    return getattr(importlib.import_module(f"mbma_tables.theories.{module}"), made)


@shared()
def shipped(name: str) -> Any:
    """A shipped theory with its defaults, made once per process."""
    return class_of(name)()


def options_of(name: str) -> list[str]:
    """Names of the options of a shipped theory; an error for an unknown name."""
    require_name("theory", name, NAMED)
    return [field.name for field in dataclasses.fields(class_of(name))]
