"""Every target by its name: those that a module of `GROUPS` declares, in its TARGETS."""

from __future__ import annotations

import dataclasses
import functools
import importlib
from typing import Any

from mbma_tables.export.targets import Options, Target

# groups by the modules that declare them, in the order in which help lists them
GROUPS = {
    "SOLVERS": "rows.solvers",
    "DATA": "rows.data",
    "LAWS": "code.law_code",
    "FMUS": "code.fmu",
    "CODE": "model.c_code",
}
# those that are written of a surface or a joint, and not the whole model
OF_LAWS = ("SOLVERS", "DATA", "LAWS", "FMUS")


@functools.cache
def targets(*groups: str) -> dict[str, Target]:
    """Targets of some of `GROUPS`, or of all, by their names."""
    modules = [
        importlib.import_module(f"mbma_tables.export.{GROUPS[name]}")
        for name in groups or GROUPS
    ]
    return {target.name: target for module in modules for target in module.TARGETS}


@functools.cache
def declared_options(*groups: str) -> dict[str, dataclasses.Field[Any]]:
    """Declarations of the options of some groups of targets, or of all, those of every file first."""
    declared = dict(Options.names())
    for target in targets(*groups).values():
        declared |= target.options.names()
    return declared
