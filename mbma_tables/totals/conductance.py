"""Conductance of a contact from its stiffness (Barber 2003), thermal or electrical."""

from __future__ import annotations

from numpy.typing import ArrayLike

from mbma_tables.arguments import Numbers, broadcast_shape, finite_array, require


def mean_conductivity(k1: ArrayLike, k2: ArrayLike) -> Numbers:
    """k_s = 2 k1 k2/(k1 + k2) of two bodies, positive conductivities in one unit."""
    first, second = finite_array("k1", k1), finite_array("k2", k2)
    require("k1", first, first > 0, "positive")
    require("k2", second, second > 0, "positive")
    broadcast_shape(k1=first, k2=second)
    # the smaller over the larger cannot overflow
    return (2 / (1 / first + 1 / second))[()]


def conductance(stiffness_mean: ArrayLike, k_s: ArrayLike, E_star: ArrayLike) -> Numbers:
    """Conductance per nominal area, h = -(k_s/E*) dp/du.

    J. R. Barber, "Bounds on the electrical resistance between contacting elastic rough bodies", Proc. R. Soc. A 459
    (2003): conductance and incremental stiffness of a contact of two half-spaces solve the same potential problem.

    Parameters
    ----------
    stiffness_mean : array_like
        -dp/du against the mean separation [stress/length], zero or positive.
    k_s : array_like
        Mean conductivity of the bodies, `mean_conductivity`; thermal or electrical.
    E_star : array_like
        Effective modulus, in the unit of stress of the stiffness.

    Returns
    -------
    float or ndarray
        [unit of k_s/length].

    Raises
    ------
    InputError, OutOfRangeError

    Examples
    --------
    >>> from mbma_tables.totals.conductance import conductance, mean_conductivity
    >>> k_s = mean_conductivity(50.0, 200.0)  # W/(m K)
    >>> float(conductance(1e14, k_s, 1e11))  # Pa/m and Pa give W/(m^2 K)
    80000.0
    """
    slope, mean, modulus = (
        finite_array(name, value)
        for name, value in {"stiffness_mean": stiffness_mean, "k_s": k_s, "E_star": E_star}.items()
    )
    require("k_s", mean, mean > 0, "positive")
    require("E_star", modulus, modulus > 0, "positive")
    broadcast_shape(stiffness_mean=slope, k_s=mean, E_star=modulus)
    return (mean / modulus * slope)[()]
