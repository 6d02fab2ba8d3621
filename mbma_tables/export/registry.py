"""Every target by its name: those that a module of `GROUPS` declares, in its TARGETS."""

from __future__ import annotations

import functools
import importlib

from mbma_tables.export.targets import Target

# groups by the modules that declare them, in the order in which help lists them
GROUPS = {
    "SOLVERS": "rows.solvers",
    "DATA": "rows.data",
    "LAWS": "code.law_code",
    "FMUS": "code.fmu",
    "CODE": "model.c_code",
}


@functools.cache
def targets(*groups: str) -> dict[str, Target]:
    """Targets of some of `GROUPS`, or of all, by their names."""
    modules = [
        importlib.import_module(f"mbma_tables.export.{GROUPS[name]}")
        for name in groups or GROUPS
    ]
    return {target.name: target for module in modules for target in module.TARGETS}
