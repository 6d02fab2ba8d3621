"""The island problem of Greenwood and Tripp (1967): a rough elastic sphere on a plane (Eqs. 34, 36, 37, 40).

With heights over the summits' standard deviation sigma and radii over L = sqrt(2 R_d sigma),

    d(rho) = rho^2 - X + w(rho),   p = (mu/2) F_{3/2}(d),   w = (4/pi) integral t/(t + rho) p K(k) dt
"""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mbma_tables.common.arguments import (
    FloatArray,
    answered,
    broadcast_shape,
    finite_array,
    number_in,
    require,
    whole_number_in,
)
from mbma_tables.common.errors import ConvergenceError, InputError
from mbma_tables.common.interrupts import in_blocks
from mbma_tables.core import core
from mbma_tables.islands.half_space import basis

ORDERS = (0.5, 1.0, 1.5, 2.0, 2.5)  # of height integrals
LEVELS = np.array(
    [*range(12, 64, 4), *range(64, 128, 8), *range(128, 256, 32), *range(256, 513, 64)]
)
MIN_SOLVER_RTOL = 1e-13
MAX_NODES = 1024  # a few seconds for an island
BLOCK = (
    1 << 22
)  # islands times nodes^2 in one call of the core, well under a second, which no signal interrupts
COARSE_NODES = 12  # nodes of the initial guess


@dataclasses.dataclass(frozen=True, eq=False)
class IslandSolution:
    """Solutions of the island problem."""

    X: FloatArray  #: the arguments, broadcast
    mu: FloatArray
    phi_F: FloatArray  #: force over E* sigma L
    phi_A: FloatArray  #: area over eta pi D R_u sigma L^2
    error: FloatArray  #: estimate of the larger relative error of the two
    iterations: NDArray[np.int64]  #: Newton steps of each solution
    nodes: NDArray[np.int64]  #: Gauss nodes of each solution
    rtol: float

    @functools.cached_property
    def _profiles(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        count = int(np.max(self.nodes))
        shape = (*np.shape(self.X), count)
        profiles = np.empty((3, np.size(self.X), count))
        _newton(np.ravel(self.X), np.ravel(self.mu), self.rtol, count, profiles)
        rho, pressure, gap = (rows.reshape(shape) for rows in profiles)
        return rho, pressure, gap

    rho = property(
        lambda self: self._profiles[0],
        doc="Radii of the profiles over L, shape (..., nodes).",
    )
    pressure = property(
        lambda self: self._profiles[1], doc="p(rho) over E* sigma/L, shape (..., nodes)."
    )
    gap = property(
        lambda self: self._profiles[2],
        doc="d(rho) over sigma, from sphere to mid-plane, (..., nodes).",
    )


def _newton(
    X: FloatArray,
    mu: FloatArray,
    rtol: float,
    nodes: int,
    profiles: FloatArray | None = None,
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Phi_F, Phi_A and their error (entries, 3), and the steps, of all entries on one basis.

    `profiles` (3, entries, nodes) receives rho, pressure and gap.
    """
    phi = np.empty((X.size, 3))
    steps = np.empty(X.size, dtype=np.int64)
    status = np.empty(X.size, dtype=np.uint8)
    work = np.empty(core.islands_work(nodes))
    bases = (*basis(nodes), *basis(COARSE_NODES))

    def fill(part: slice) -> None:
        kept = (None,) * 3 if profiles is None else profiles[:, part]
        core.solve_islands(
            X[part],
            mu[part],
            rtol,
            *bases,
            phi[part],
            steps[part],
            status[part],
            *kept,
            work,
        )

    in_blocks(fill, X.size, max(1, BLOCK // nodes**2))
    return phi, steps


def height_integral(n: float, x: ArrayLike) -> Any:
    """F_n(x) = integral_x^inf (z - x)^n phi(z) dz of the normal density phi, for n = 1/2, 1, 3/2, 2 or 5/2.

    Eqs. (36) and (38) are F_{3/2} and F_1; F_{5/2} and F_2 are their integrals over a rigid
    sphere. The relative error is 1e-13 for x <= 10 and 5e-13 up to 37; scipy's parabolic
    cylinder functions lose up to seven digits.

    Parameters
    ----------
    n : float
        The order, one of `ORDERS`.
    x : array_like
        Separation over the summits' standard deviation; any finite numbers, any shape.

    Returns
    -------
    numpy.ndarray or numpy.float64
        F_n(x), dimensionless, in the shape of `x`; beyond x = 38 zero.

    Raises
    ------
    InputError
        If `n` is not one of `ORDERS` or `x` holds NaN or infinity.

    Examples
    --------
    >>> from mbma_tables.islands.greenwood_tripp import height_integral
    >>> height_integral(1.5, [-1.0, 0.0, 1.0]).round(6)
    array([1.404597, 0.43002 , 0.075668])
    """
    if n not in ORDERS:
        raise InputError(f"n must be one of {ORDERS}, got {n!r}")
    argument = finite_array("x", x)
    return answered(
        lambda part, found: core.height_integrals(int(2 * n), part, found), (argument,)
    )[0][()]


def rigid_sphere(X: FloatArray, mu: FloatArray) -> FloatArray:
    """(Phi_F, Phi_A) where the sphere does not deform, stacked first: the limit of both as mu goes to 0.

    Phi_F = (mu/2) pi F_{5/2}(-X)/(5/2), Phi_A = pi F_2(-X)/2.
    """
    return np.stack(
        [
            math.pi / 5 * mu * height_integral(2.5, -X),
            math.pi / 2 * height_integral(2.0, -X),
        ]
    )


def _solve_newton(
    X: FloatArray, mu: FloatArray, rtol: float, nodes: int | None
) -> tuple[Any, ...]:
    """Phi_F, Phi_A and error (entries, 3), steps, nodes, and which entries failed."""
    phi, (steps, used) = (
        np.full((X.size, 3), np.nan),
        np.zeros((2, X.size), dtype=np.int64),
    )
    failed = np.ones(X.size, dtype=bool)
    levels = LEVELS if nodes is None else np.array([nodes])
    # nodes that usually give `rtol`; the error estimate of each solution is then checked
    softness = 1 + np.log10(np.maximum(mu, 1.0)) / 12
    needed = max(-math.log10(rtol), 3.0) * np.sqrt(np.maximum(X, 0) + 5) * softness
    level = np.minimum(np.searchsorted(levels, needed), len(levels) - 1)
    for number, count in enumerate(levels):
        now = np.flatnonzero(failed & (level <= number))
        if now.size == 0:
            continue
        found, taken = _newton(X[now], mu[now], rtol, int(count))
        phi[now], used[now] = found, count
        steps[now] += taken
        # a requested number of nodes is used as it is
        failed[now] = ~(found[:, 2] <= (rtol if nodes is None else np.inf))
    return phi, steps, used, failed | ~np.isfinite(phi).all(axis=1)


def solve(
    X: ArrayLike, mu: ArrayLike, rtol: float = 1e-10, nodes: int | None = None
) -> IslandSolution:
    """Solve the island problem for phi_F, phi_A and the profiles of pressure and gap.

    Parameters
    ----------
    X : array_like
        Approach over the summits' standard deviation, Delta/sigma.
    mu : array_like
        Stiffness of the roughness against the sphere, (8/3) D sigma sqrt(2 R_u R_d), at least 0;
        broadcasts against `X`.
    rtol : float
        Relative error asked of phi_F and phi_A, at least 1e-13; it sets the node count.
    nodes : int, optional
        Use this many Gauss nodes (8 to 1024) instead; then `error` is the accuracy reached.

    Returns
    -------
    IslandSolution

    Raises
    ------
    ConvergenceError
        Where the accuracy was not reached: at entries of its `mask`; its `result` holds the others.

    Examples
    --------
    >>> from mbma_tables import greenwood_tripp
    >>> found = greenwood_tripp.solve([2.0, 5.0], mu=1.0)
    >>> found.phi_F.round(6), found.phi_A.round(6)
    (array([2.079306, 7.917221]), array([ 3.675097, 12.208736]))
    >>> bool((found.error < 1e-10).all())
    True
    """
    approach = finite_array("X", X)
    stiffness = finite_array("mu", mu)
    require("mu", stiffness, stiffness >= 0, "at least 0")
    rtol = number_in("rtol", rtol, MIN_SOLVER_RTOL, 0.1)
    nodes = None if nodes is None else whole_number_in("nodes", nodes, 8, MAX_NODES)
    shape = broadcast_shape(X=approach, mu=stiffness)
    flat_X, flat_mu = (
        np.broadcast_to(each, shape).ravel() for each in (approach, stiffness)
    )
    phi, steps, used, missed = _solve_newton(flat_X, flat_mu, rtol, nodes)
    fields: list[Any] = [
        *(part.reshape(shape) for part in (flat_X, flat_mu, *phi.T, steps, used)),
        rtol,
    ]
    result = IslandSolution(*fields)
    if missed.any():
        first = int(np.flatnonzero(missed)[0])
        raise ConvergenceError(
            f"the solver did not reach the requested accuracy at {int(missed.sum())} of {missed.size} "
            f"entries, the first at X = {flat_X[first]:.6g}, mu = {flat_mu[first]:.6g} "
            f"(reached {phi[first, 2]:.1e}, requested {rtol:.1e})",
            missed.reshape(shape),
            result,
        )
    return result
