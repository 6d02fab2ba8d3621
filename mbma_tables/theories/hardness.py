"""A theory of elastic contact made one of bodies with a hardness."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.theories.base import Theory


def with_hardness(
    theory: Theory,
    hardness: ArrayLike,
    E_star: ArrayLike = 1.0,
    largest_pressure: ArrayLike | None = None,
) -> Theory:
    """The theory of bodies whose pressure cannot exceed a hardness.

    Parameters
    ----------
    theory : Theory
        The elastic one; a user's object becomes one by `resolve`.
    hardness : array_like
        Largest pressure p_m that the softer body supports, positive, in the unit of
        `E_star`; where it is infinite, nothing yields.
    largest_pressure : array_like, optional
        Nominal pressure that was the largest so far, in the unit of `E_star`: below it the
        theory is that of unloading and reloading. Default: that of first loading.
    E_star : array_like
        Effective modulus; if it is 1, the hardness is over E*.

    Returns
    -------
    Theory
        The simulation of a map is made anew with the hardness; any other theory is corrected
        by `mbma_tables.theories.yielding`.

    Examples
    --------
    >>> import numpy as np
    >>> from mbma_tables import Surface
    >>> from mbma_tables.theories import resolve
    >>> from mbma_tables.theories.hardness import with_hardness
    >>> surface = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0)
    >>> metal = with_hardness(resolve("calibrated"), 1500.0, E_star=100e3)
    >>> f"{metal.area_at(surface, np.array(3e-4)):.4f}"
    '0.0210'
    """
    # beyond the largest number nothing yields
    with np.errstate(over="ignore"):
        hardness_over_E_star = np.asarray(hardness, dtype=float) / E_star
    # all modules import scipy, which takes long and which elastic contacts do without
    loading: Theory
    if theory.presses_anew:
        from mbma_tables.theories.simulated.yielded import Saturated

        loading = saturated = Saturated(theory, hardness_over_E_star)
        if largest_pressure is not None:
            from mbma_tables.theories.simulated.yielded import UnloadedMap

            return UnloadedMap(saturated, np.asarray(largest_pressure, float) / E_star)
    else:
        from mbma_tables.theories.yielding.theory import Yielding

        loading = Yielding(theory, hardness_over_E_star)
    if largest_pressure is None:
        return loading
    from mbma_tables.theories.yielding.unloading import Unloading

    return Unloading(loading, np.asarray(largest_pressure, dtype=float) / E_star)
