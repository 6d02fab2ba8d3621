"""The theories beside MBMA: Greenwood-Williamson (11, 12), Persson (18-21), and how d and u relate (50).

All take and return DataArrays too, dask-backed ones lazily.
"""

from mbma_tables.theories.greenwood_williamson import Asperities, greenwood_williamson, mean_separation, separation
from mbma_tables.theories.persson import Method, persson_area, persson_force, persson_separation

__all__ = [
    "Asperities",
    "Method",
    "greenwood_williamson",
    "mean_separation",
    "persson_area",
    "persson_force",
    "persson_separation",
    "separation",
]
