"""The distribution of gaps of a simulated map, corrected for the cells that contact edges cut.

On a grid, cells that an edge of the contact cuts count as contact, so that most of the
smallest gaps are missing. The corrected contact area tells their share. They are put back as
gaps that rise with the power 3/2 of their share of the area, as beside any smooth edge.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator

from mbma_tables.common.arguments import FloatArray
from mbma_tables.theories import gap_law

# shares of the open points, densest at both ends
OPEN_SHARES = (1 - np.cos(np.pi * np.arange(1, 33) / 32)) / 2
# gaps count from where their share is this much of that of the missing cells
CERTAIN = 2.5


def restored(
    quantiles: FloatArray, area: float, area_raw: float, mean: float
) -> FloatArray:
    """Gaps at the shares of the open area that `gap_law` uses, of one contact.

    Parameters
    ----------
    quantiles : ndarray
        Gaps of the open points at `OPEN_SHARES` [length].
    area, area_raw : float
        A/A0 corrected for its edges, and the share of points in contact.
    mean : float
        Mean gap over the nominal area [length].
    """
    missing = max(area_raw - area, 0.0)
    found = OPEN_SHARES * (1 - area_raw)
    # a plateau may leave equal gaps beside the contact, and points without any
    certain = (found > CERTAIN * missing) & (quantiles > 0)
    x = np.log(found[certain] + missing)
    y = np.log(quantiles[certain])
    t, weight = gap_law.rule()
    at = np.log(t * (1 - area))
    inside = PchipInterpolator(x, y)(np.clip(at, x[0], x[-1]))
    gaps = np.exp(np.where(at < x[0], y[0] + 1.5 * (at - x[0]), inside))
    return np.asarray(gaps * (mean / ((weight * gaps).sum() * (1 - area))))


def of_map(gap: FloatArray, area: float, mean: float) -> FloatArray:
    """The same of a map's gaps [length], zero in contact."""
    found = gap[gap > 0].astype(float)
    quantiles = np.quantile(found, OPEN_SHARES)
    return restored(quantiles, area, 1 - found.size / gap.size, mean)
