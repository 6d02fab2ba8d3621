"""Elastic constants of the two bodies, joined into the one modulus that contact needs."""

from __future__ import annotations

from typing import Any

from numpy.typing import ArrayLike

from mbma_tables.arguments import broadcast_shape, finite_array, require


def effective_modulus(E1: ArrayLike, nu1: ArrayLike, E2: ArrayLike, nu2: ArrayLike) -> Any:
    """Effective modulus of two elastic bodies, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2.

    Parameters
    ----------
    E1, E2 : array_like
        Young's moduli, positive, in one unit of stress.
    nu1, nu2 : array_like
        Poisson's ratios, in (-1, 0.5].

    Returns
    -------
    float or ndarray
        E*, in the unit of E1 and E2; the arguments broadcast. Against a rigid body it is E1/(1 - nu1^2), the
        limit of large E2.

    Raises
    ------
    InputError, OutOfRangeError
        For NaN, infinite or empty input, shapes that do not broadcast, and numbers outside these ranges.

    Examples
    --------
    Steel on steel, in GPa:

    >>> from mbma_tables.materials import effective_modulus
    >>> round(float(effective_modulus(210.0, 0.3, 210.0, 0.3)), 2)
    115.38
    """
    given = {name: finite_array(name, value) for name, value in {"E1": E1, "nu1": nu1, "E2": E2, "nu2": nu2}.items()}
    for name in ("E1", "E2"):
        require(name, given[name], given[name] > 0, "positive")
    for name in ("nu1", "nu2"):
        require(name, given[name], (given[name] > -1) & (given[name] <= 0.5), "in (-1, 0.5]")
    broadcast_shape(**given)
    a, b = ((1 - nu) * (1 + nu) / E for nu, E in ((given["nu1"], given["E1"]), (given["nu2"], given["E2"])))
    return (1 / (a + b))[()]
