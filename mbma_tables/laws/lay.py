"""Tangential stiffness of surfaces with a lay: the share c of stress that varies along shear; docs/joints.md."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, require

CONSTANTS = 1.441, 0.217, 0.714, 0.445  # in this order in the formulas above
TESTED_AREA, TESTED_LAY = (0.015, 0.43), 8.5


def stress_shares(
    anisotropy: ArrayLike, area: ArrayLike, nu: ArrayLike, constants: Sequence[float] | FloatArray = CONSTANTS
) -> tuple[FloatArray, FloatArray]:
    """c along and across the lay at contact fractions; the arguments broadcast.

    Raises
    ------
    OutOfRangeError
        For anisotropies and contact fractions that were not simulated.

    Examples
    --------
    >>> from mbma_tables.laws.lay import stress_shares
    >>> along, across = stress_shares(4.0, 0.12, 0.3)
    >>> round(float(along), 3), round(float(across), 3)
    (0.211, 0.821)
    """
    r, A, poisson = (np.asarray(each, float) for each in (anisotropy, area, nu))
    low, high = TESTED_AREA
    require("anisotropy", r, (r >= 1) & (r <= TESTED_LAY), f"from 1 to {TESTED_LAY}, which was simulated")
    require("area", A, (low <= A) & (high >= A), f"from {low} to {high}, which was simulated")
    exponent, growth, excess, power = constants
    p = 1 / (1 + r ** (exponent + growth * np.log(A)))
    both = 1 + excess * poisson / (2 - poisson) * A**power * 4 * p * (1 - p)
    return both * p, both * (1 - p)
