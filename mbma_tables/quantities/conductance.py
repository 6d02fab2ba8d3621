"""Conductivity of two bodies, and an older correlation for the conductance of their contact, thermal or electrical."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import Numbers, broadcast_shape, positive_array


def mean_conductivity(k1: ArrayLike, k2: ArrayLike) -> Numbers:
    """k_s = 2 k1 k2/(k1 + k2) of two bodies, positive conductivities in one unit."""
    first, second = positive_array("k1", k1), positive_array("k2", k2)
    broadcast_shape(k1=first, k2=second)
    smaller = np.minimum(first, second)
    larger = np.maximum(first, second)
    # the smaller over the larger cannot overflow
    return (2 * (smaller / (1 + smaller / larger)))[()]


def cooper_mikic_yovanovich(
    surface: Any,
    pressure: ArrayLike,
    k_s: ArrayLike,
    E_star: ArrayLike,
    hardness: ArrayLike,
) -> Numbers:
    """Conductance of plastic contacts, h = 1.25 k_s (m/sigma) (p/H)^0.95; E* does not matter.

    Model of M. G. Cooper, B. B. Mikic, M. M. Yovanovich, Int. J. Heat Mass Transfer 12
    (1969) 279-300, in the power law of M. M. Yovanovich, "Thermal contact correlations"
    (1982); the first paper's own is taken to be 1.45 (p/H)^0.985. Both were found in public
    programs only, neither paper was consulted. This one is within 1.6% of the model for p/H
    of 1e-6 to 0.023, the other up to 28% below it. m is the mean absolute slope of a
    Gaussian profile, sqrt(2 m2/pi), sigma is h_rms.

    Examples
    --------
    >>> from mbma_tables import Surface
    >>> from mbma_tables.quantities.conductance import cooper_mikic_yovanovich
    >>> joint = Surface(hurst=0.8, q0=6e3, q1=6e5, h_rms=1e-6, h_max=3.5e-6)  # m
    >>> float(cooper_mikic_yovanovich(joint, 1e7, 100.0, 1e11, 1e9).round(-2))
    24600.0
    """
    by_slope = np.asarray(k_s) * np.sqrt(2 * surface.m2 / np.pi) / surface.h_rms
    found: Numbers = (by_slope * 1.25 * (np.asarray(pressure) / hardness) ** 0.95)[()]
    return found
