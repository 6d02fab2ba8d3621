"""Pressure and area of theories as functions of plain numbers, for tables: `mbma tables make`.

The shipped theories are attributes of this module, such as ``mbma_tables.theories.totals:persson``.
A theory of one's own needs one line in a module of one's own, ``totals = totals_of(MyTheory())``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.surfaces.surface import Surface
from mbma_tables.theories import THEORIES, resolve
from mbma_tables.theories.base import Theory, UserTheory

Totals = Callable[..., dict[str, FloatArray]]
# theories of the shape of the spectrum alone
WITHOUT_H_MAX = ("persson",)
ANY_H_MAX = 3.0  # over h_rms, for these


def totals_of(theory: str | Theory | UserTheory, of_h_max: bool = True) -> Totals:
    """Pressure over E* g, g the rms gradient, and contact area over A0 as a function of numbers.

    Parameters
    ----------
    theory : str or theory
        A name, or an object with a `name` and an `answer`.
    of_h_max : bool
        False for a theory whose contacts do not depend on h_max.

    Returns
    -------
    callable
        Of arrays (hurst, zeta_1, h_max, compression) for a theory whose contact ends at h_max;
        else (hurst, zeta_1, h_max, gap), without h_max if that is not of it. h_max and gap,
        the mean separation, are over h_rms; compression is 1 - u/h_max. It returns
        {"pressure": ..., "area": ...}.

    Examples
    --------
    >>> from mbma_tables.theories.totals import totals_of
    >>> found = totals_of("persson", of_h_max=False)(0.8, 100.0, 1.0)
    >>> round(float(found["area"]), 4)
    0.0492
    """
    chosen = resolve(theory)

    def at(hurst: Any, zeta_1: Any, h_max: Any, u: Any) -> dict[str, FloatArray]:
        surface = Surface(hurst, q0=1.0, q1=zeta_1, h_rms=1.0, h_max=h_max)
        answer = chosen.answer(surface, np.asarray(u, dtype=float))
        return {
            "pressure": answer.pressure / np.asarray(surface.rms_gradient),
            "area": answer.area,
        }

    def of_compression(
        hurst: Any, zeta_1: Any, h_max: Any, compression: Any
    ) -> dict[str, FloatArray]:
        return at(hurst, zeta_1, h_max, np.asarray(h_max) * (1 - np.asarray(compression)))

    def of_gap(hurst: Any, zeta_1: Any, h_max: Any, gap: Any) -> dict[str, FloatArray]:
        return at(hurst, zeta_1, h_max, gap)

    def of_gap_alone(hurst: Any, zeta_1: Any, gap: Any) -> dict[str, FloatArray]:
        return at(hurst, zeta_1, ANY_H_MAX, gap)

    if not of_h_max:
        return of_gap_alone
    return of_compression if chosen.ends_at_h_max else of_gap


def __getattr__(name: str) -> Totals:
    if name in THEORIES:
        return totals_of(name, name not in WITHOUT_H_MAX)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
