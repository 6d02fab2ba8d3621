"""The compiled core: all loops of the library, in C, as exports contain it.

`core` is the module of the newest generation of processor that this machine supports; the
environment variable MBMA_TABLES_CORE names another one, such as "x86_64_v3". `mbma.h`
describes the functions; arguments of the wrappers are in the same order, without the counts
of arrays.
"""

import importlib
import os
from typing import Any

# `mbma_status` of mbma.h
OK, X_BELOW, X_ABOVE, MU_ABOVE, UNRESOLVED, INVALID, OUTSIDE = range(7)
GENERATIONS = {"x86_64_v4": 4, "x86_64_v3": 3, "plain": 0}


def _load() -> Any:
    wanted = os.environ.get("MBMA_TABLES_CORE")
    if wanted:
        return importlib.import_module(f"mbma_tables.core._{wanted}")
    try:
        plain = importlib.import_module("mbma_tables.core._plain")
    except ModuleNotFoundError as missing:
        raise ImportError(
            f"the compiled core is not in {os.path.dirname(__file__)}: start Python outside of the checkout, or "
            "install it there with `pip install -e .`"
        ) from missing
    best = next(name for name, least in GENERATIONS.items() if plain.generation >= least)
    return (
        plain if best == "plain" else importlib.import_module(f"mbma_tables.core._{best}")
    )


core: Any = _load()
# builds with the same arithmetic give identical results
ARITHMETIC: str = core.arithmetic
