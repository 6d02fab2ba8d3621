"""docs/machined.md: errors of answers on maps of machined surfaces by family, and how many their scatter covers."""

from __future__ import annotations

import numpy as np
import xarray as xr

from generate.machined.campaign import FORMS
from generate.machined.coverage import left_out
from generate.machined.errors import QUANTITIES, coverage, errors, seen
from generate.machined.makers import FAMILIES
from generate.pages.page import DATA, Measured, dataset, table
from mbma_tables.common.arguments import FloatArray


def _by_family(data: xr.Dataset, form: str) -> str:
    lines = []
    for family in FAMILIES:
        own = data.isel(surface=np.flatnonzero(data.family.values == family))
        cells = []
        for quantity in QUANTITIES:
            found = np.abs(errors(own, form, quantity)[seen(own, form, quantity)])
            cells.append("{:.3f}, {:.3f}".format(*np.quantile(found, (0.5, 0.9))) if found.size else "")
        valid = float(np.mean(own[f"{form}_valid"].values))
        lines.append([f"{family} ({own.sizes['surface']})", *cells, f"{valid:.0%}"])
    return table("family (maps) | ln A | ln F at equal u | ln stiffness | ln flow, A < 20% | valid", lines)


def _left_out(data: xr.Dataset, form: str) -> str:
    columns = [left_out(data, form, quantity) for quantity in QUANTITIES]
    pooled = [{"all": np.concatenate([*column.values()]), **column} for column in columns]
    rows = [[name, *(_shares(column[name]) for column in pooled)] for name in pooled[0]]
    return table("family | area | pressure | stiffness | flow", rows)


def _shares(ratio: FloatArray) -> str:
    return f"{np.mean(ratio < 1):.2f}, {np.mean(ratio < 2):.2f} ({ratio.size})" if ratio.size else ""


def measure() -> Measured:
    """The tables."""
    data, lines = dataset(DATA / "machined.nc"), []
    for form in FORMS:
        for valid, name in ((True, "valid"), (False, "not valid")):
            found = [coverage(data, form, quantity, valid) for quantity in QUANTITIES]
            lines.append([form, name, *(f"{a:.2f}, {b:.2f} ({n})" if n else "" for a, b, n in found)])
    parts = {form: _by_family(data, form) for form in FORMS}
    parts |= {f"left_out_{form}": _left_out(data, form) for form in FORMS}
    return parts | {"coverage": table("theory | entries | area | pressure | stiffness | flow", lines)}, {}
