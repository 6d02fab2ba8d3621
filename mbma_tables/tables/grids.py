"""What the models of shipped tables share: their content, and results on a grid as an xarray Dataset."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, finite_array
from mbma_tables.common.display import Variable, dataset_of
from mbma_tables.common.errors import InputError
from mbma_tables.tables.schema import TableContent

if TYPE_CHECKING:
    import xarray as xr

MEANINGS = {
    "delta": "approach of the island over h_rms, that for infinite zeta_1",
    "zeta_d": "lower magnification of the island's roughness",
    "zeta_u": "upper magnification of the island's roughness",
    "hurst": "Hurst exponent",
    "X": "depth of the island over the standard deviation of its summits",
    "mu": "stiffness of the island's roughness against its sphere",
    "F_hat": "force of the island, F^i q0/(E* s)",
    "A_hat": "contact area of the island, A^i q0^2/eta",
    "phi_F": "force of the island, Phi_F",
    "phi_A": "contact area of the island, Phi_A",
    "error": "bound on the relative error of force and area",
}
OUTSIDE_MEANS = {
    "nan": "NaN where the table does not cover the island, or no such island exists",
    "exact": "the exact solver where the table does not cover the island",
    "raise": "no island outside the table",
}


class OfTable:
    """A model of islands that is its table: pickled and shown by the table's content."""

    def __init__(self, content: TableContent) -> None:
        self.content = content

    def __reduce__(self) -> tuple[type[OfTable], tuple[TableContent]]:
        return type(self), (self.content,)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.content.describe()})"


def on_grid(
    content: TableContent,
    axes: Mapping[str, ArrayLike],
    lookup: Callable[..., Any],
    outside: str,
) -> xr.Dataset:
    """The Dataset of what `lookup` finds at every combination of the entries of axes."""
    found_axes: dict[str, FloatArray] = {}
    for name, values in axes.items():
        axis = np.atleast_1d(finite_array(name, values))
        if axis.ndim != 1:
            raise InputError(f"{name} must be an axis of one dimension, got {axis.ndim}")
        if np.unique(axis).size < axis.size:
            raise InputError(f"{name} must be an axis without equal entries")
        found_axes[name] = axis
    found = lookup(*np.ix_(*found_axes.values()), outside=outside)
    variables = {
        name: Variable(axis, "1", MEANINGS[name], (name,))
        for name, axis in found_axes.items()
    }
    for name, values in found._asdict().items():
        variables[name] = Variable(values, "1", MEANINGS[name], tuple(found_axes))
    facts = {name: content.attributes[name] for name in ("variant", "data_version")}
    return dataset_of(
        variables,
        {"table": content.kind, **facts, "outside": OUTSIDE_MEANS[outside]},
    )
