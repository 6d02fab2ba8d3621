"""Fit the closed forms and write tables/formula.json (``python -m generate formula``)."""

from __future__ import annotations

import pathlib
import platform
from typing import Any

import numpy as np
import scipy
import sklearn

from generate.formulas import islands as formula_islands
from generate.formulas import totals as formula_totals
from mbma_tables import __version__
from mbma_tables.formulas.file import TOTALS, Formulas, write
from mbma_tables.tablefiles.netcdf import MODULES
from mbma_tables.tablefiles.provenance import physics_digest
from mbma_tables.tablefiles.schema import UNIVERSAL


def build(target: pathlib.Path) -> Formulas:
    """Fit, certify and write the forms."""
    forms: dict[str, Any] = formula_islands.island_forms()
    forms[TOTALS] = formula_totals.totals_form()
    return write(target, forms, provenance())


def provenance() -> dict[str, Any]:
    """What made the forms."""
    return {
        "physics_hash": physics_digest(MODULES[UNIVERSAL]),
        "mbma_tables": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "scikit-learn": sklearn.__version__,
    }
