"""Theories at given loads, separations and areas, for what the paper quotes and shows."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from scipy.special import erfinv

from mbma_tables import Surface, theories
from mbma_tables.common.arguments import FloatArray

VARIANTS = {"MBMA reported": "reported", "MBMA printed": "printed"}
PERSSON: dict[str, theories.Method] = {"Persson full": "full", "Persson simplified": "simplified"}
SEPARATIONS: dict[str, theories.Theory] = {
    **{name: theories.Mbma(variant=variant) for name, variant in VARIANTS.items()},
    "G-W": theories.GreenwoodWilliamson(),
    **{name: theories.Persson(method) for name, method in PERSSON.items()},
}
THEORIES = tuple(SEPARATIONS)
AREA_THEORIES = (*VARIANTS, "G-W", "Persson")  # (18) is Persson's area in full and simplified alike
GAPS = 60  # a curve


@functools.cache
def sample(surface: Surface, theory: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean separation, force and area from first contact to full compression, closer at first contact."""
    # G-W's Gaussian heights are unbounded, and three more h_rms are sampled
    first = surface.h_max + (0.0 if theory in VARIANTS else 1.5 * surface.h_rms)
    u = first * (1 - np.append(np.geomspace(0.005, 0.1, GAPS // 2)[:-1], np.linspace(0.1, 1, GAPS)))
    found = SEPARATIONS[theory].answer(surface, u)
    return u, found.pressure, found.area


def force_at(surface: Surface, theory: str, ratio: Any) -> FloatArray:
    """F/(A0 E*) at mean separations u = ratio * h_rms; NaN where the theory has none."""
    u = np.asarray(ratio, dtype=float) * surface.h_rms
    # at u = 0 the full form needs an infinite load
    some = (u > 0) | (theory != "Persson full")
    result = np.full(u.shape, np.nan)
    if some.any():
        result[some] = SEPARATIONS[theory].answer(surface, u[some]).pressure
    return result


def kappa(surface: Surface, theory: str, area: float) -> float:
    """A/F sqrt(2 m2) E*, Eq. (51), at a contact area A/A0."""
    if theory == "Persson":
        force = np.sqrt(surface.m2) * erfinv(area)
    else:
        u = SEPARATIONS[theory].mean_separation_at(surface, "area", np.array([area]))
        force = SEPARATIONS[theory].answer(surface, u).pressure[0]
    return float(area / force * surface.rms_gradient)
