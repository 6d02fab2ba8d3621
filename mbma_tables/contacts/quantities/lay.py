"""Surfaces with a lay: flow factors by an effective medium of gaps (docs/leakage.md), tangential stiffness."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, entry_by_entry, require
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.contacts.quantities.effective_medium import NEAREST, FlowConstants
from mbma_tables.contacts.quantities.gas import NODES, open_gaps

ROUNDS = 200
RESOLVED = 1e-11
# root mean square of ln(medium/simulation) at 16 surfaces with gamma from 1 to 8, `python
# -m generate film`: phi without contact; addition by a lay per e-fold of gamma and A/A0 to
# the power 1.2; phi_s
OPEN = 0.022
LAY = (12.0, 1.2)
SHEAR = 0.15
# gamma, or its inverse, up to which flow, and anisotropy up to which stiffness was
# simulated
WIDEST_LAY = 8.5
CONSTANTS = (
    1.441,
    0.217,
    0.714,
    0.445,
)  # exponent, its growth, excess and its power in `stress_shares`
TESTED_AREA = (0.015, 0.43)


def anisotropic_medium(
    share: FloatArray, gap: FloatArray, blocked: FloatArray, peklenik: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Conductivities k [length^3] and gaps h_c [length] along x and y, each of shape (2, n).

    `share` and `gap`, shape (n, m), are shares of the nominal area and open gaps there
    [length]; `blocked`, shape (n,), is (1 - Ac) (A/Ac)^m, and `peklenik`, shape (n,), is
    gamma.
    """
    scale = np.sum(share * gap, axis=1)
    cube = (gap / scale[:, None]) ** 3
    log_k = np.zeros((2, len(share)))
    # each entry ends by itself, so that it does not depend on the others
    active = np.ones(len(share), dtype=bool)
    for _ in range(ROUNDS):
        factor = _depolarisation(log_k, peklenik)
        t = cube / np.exp(log_k)[..., None]
        inside = 1 + factor[..., None] * (t - 1)
        part = (t - 1) / inside
        miss = np.sum(share * part, axis=-1) - blocked / (1 - factor)
        own = -np.sum(share * t / inside**2, axis=-1)
        by_factor = -np.sum(share * part**2, axis=-1) - blocked / (1 - factor) ** 2
        turn = by_factor * factor[0] * factor[1] / 2  # derivative of L by ln k
        (a, d), (b, c) = own + turn, -turn
        step = np.stack([miss[0] * d - b * miss[1], a * miss[1] - c * miss[0]]) / (
            a * d - b * c
        )
        log_k -= np.where(active, np.clip(step, -1, 1), 0.0)
        active &= np.abs(step).max(axis=0) >= RESOLVED
        if not active.any():
            break
    else:
        raise ConvergenceError(
            f"the effective medium of gaps did not converge to {RESOLVED:g} in {ROUNDS} steps"
        )
    factor = _depolarisation(log_k, peklenik)
    weight = share / (1 + factor[..., None] * (cube / np.exp(log_k)[..., None] - 1))
    carried = np.sum(weight * gap, axis=-1) / (
        weight.sum(axis=-1) + blocked / (1 - factor)
    )
    return np.exp(log_k) * scale**3, carried


def _depolarisation(log_k: FloatArray, peklenik: FloatArray) -> FloatArray:
    along = 1 / (1 + peklenik * np.exp((log_k[1] - log_k[0]) / 2))
    return np.stack([along, 1 - along])


def factors(
    u: FloatArray, area: FloatArray, peklenik: ArrayLike, flow: FlowConstants
) -> tuple[FloatArray, FloatArray]:
    """phi over the isotropic phi, and phi_s, along x and y, shape (2, n); u in h_rms, A/A0 below the threshold.

    Examples
    --------
    Wide gaps across (x) and along (y) ridges, by c = 1/(1 + gamma):

    >>> import numpy as np
    >>> from mbma_tables.contacts.quantities.lay import factors
    >>> from mbma_tables.contacts.quantities.effective_medium import FlowConstants
    >>> u = np.array([20.0])
    >>> ratio, shear = factors(u, np.zeros(1), 0.25, FlowConstants())
    >>> ((1 - 1.5 / u**2) * ratio[:, 0]).round(4), [1 + 3 * (1 - 3 * c) / 400 for c in (0.8, 0.2)]
    (array([0.9895, 1.0029]), [0.9895, 1.003])
    """
    isotropic = bool(np.all(np.asarray(peklenik) == 1))

    def of_block(gaps: FloatArray, areas: FloatArray, lays: FloatArray) -> FloatArray:
        percolating = np.minimum(areas, flow.threshold - NEAREST)
        share, gap = open_gaps(gaps, percolating, 1.0, blended=True)
        blocked = np.where(areas > 0, flow.obstructed(percolating), 0.0)
        k, carried = anisotropic_medium(share, gap, blocked, lays)
        ratio = np.ones_like(k)
        if not isotropic:
            plain, _ = anisotropic_medium(share, gap, blocked, np.ones(gaps.shape))
            ratio = k / plain
        return np.stack([ratio, gaps - carried])

    # a dozen arrays of two axes for each node
    ratio, shear = entry_by_entry(of_block, 24 * NODES, u, area, peklenik)
    return ratio, shear


def stress_shares(
    anisotropy: ArrayLike,
    area: ArrayLike,
    nu: ArrayLike,
    constants: Sequence[float] | FloatArray = CONSTANTS,
) -> tuple[FloatArray, FloatArray]:
    """c, the share of stress that varies along shear, along and across the lay at contact fractions; docs/joints.md.

    Raises
    ------
    OutOfRangeError
        For anisotropies and contact fractions that were not simulated.

    Examples
    --------
    >>> from mbma_tables.contacts.quantities.lay import stress_shares
    >>> along, across = stress_shares(4.0, 0.12, 0.3)
    >>> round(float(along), 3), round(float(across), 3)
    (0.211, 0.821)
    """
    r, A, poisson = (np.asarray(each, float) for each in (anisotropy, area, nu))
    low, high = TESTED_AREA
    require(
        "anisotropy",
        r,
        (r >= 1) & (r <= WIDEST_LAY),
        f"from 1 to {WIDEST_LAY}, which was simulated",
    )
    require(
        "area", A, (low <= A) & (high >= A), f"from {low} to {high}, which was simulated"
    )
    exponent, growth, excess, power = constants
    p = 1 / (1 + r ** (exponent + growth * np.log(A)))
    both = 1 + excess * poisson / (2 - poisson) * A**power * 4 * p * (1 - p)
    return both * p, both * (1 - p)
