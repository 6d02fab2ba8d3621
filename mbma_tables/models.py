"""Island models: anything that answers (X, mu) with force and area. Totals ask no more."""

from __future__ import annotations

import dataclasses
import math
from typing import Literal, Protocol

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.errors import InputError
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.height_integrals import height_integral

Tier = Literal["exact", "rigid"]

TIGHTEST_ISLAND = greenwood_tripp.TIGHTEST
CLOSED_FORM_ERROR = 1e-14


@dataclasses.dataclass(frozen=True)
class IslandAnswer:
    """Phi_F and Phi_A of islands, with a bound on their relative error; arrays of one shape."""

    phi_F: FloatArray
    phi_A: FloatArray
    error: FloatArray


class IslandModel(Protocol):
    """What the layers above need of an island model."""

    @property
    def name(self) -> str:
        """The tier that selects it."""

    def answer(self, X: FloatArray, mu: FloatArray) -> IslandAnswer:
        """Phi_F and Phi_A at finite X and mu >= 0."""


@dataclasses.dataclass(frozen=True)
class ExactModel:
    """The island problem solved anew for each island (Newton), to a relative error of `rtol`."""

    rtol: float
    name: str = "exact"

    def answer(self, X: FloatArray, mu: FloatArray) -> IslandAnswer:
        """Phi_F and Phi_A by `greenwood_tripp.solve`."""
        solved = greenwood_tripp.solve(X, mu, rtol=self.rtol)
        return IslandAnswer(solved.phi_F, solved.phi_A, solved.error)


@dataclasses.dataclass(frozen=True)
class RigidModel:
    """The sphere does not deform (w = 0 in Eq. 34): closed form, exact as mu goes to 0."""

    name: str = "rigid"

    def answer(self, X: FloatArray, mu: FloatArray) -> IslandAnswer:
        """Phi_F = (mu/2) pi F_{5/2}(-X)/(5/2), Phi_A = pi F_2(-X)/2."""
        force = np.asarray(mu * (math.pi / 5) * height_integral(2.5, -X))
        area = np.asarray(math.pi / 2 * height_integral(2.0, -X))
        return IslandAnswer(force, area, np.full(force.shape, CLOSED_FORM_ERROR))


def get_model(tier: str, rtol: float) -> IslandModel:
    """The island model of a tier, accurate enough for results at `rtol`."""
    if tier == "exact":
        return ExactModel(max(0.1 * rtol, TIGHTEST_ISLAND))
    if tier == "rigid":
        return RigidModel()
    raise InputError(f"tier must be 'exact' or 'rigid', got {tier!r}")
