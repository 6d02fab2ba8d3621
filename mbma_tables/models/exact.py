"""Island models that need no table: the exact solver and the rigid sphere."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np

from mbma_tables.arguments import FloatArray
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.height_integrals import height_integral
from mbma_tables.models.protocol import BOTH, FORCE, IslandAnswer

CLOSED_FORM_ERROR = 1e-14


@dataclasses.dataclass(frozen=True)
class ExactModel:
    """The island problem solved for each island (Newton's method), to a relative error of `rtol`."""

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
        force, area = greenwood_tripp.rigid_sphere(X, mu)
        return IslandAnswer(force, area, np.full(force.shape, CLOSED_FORM_ERROR))

    def of_islands(self, islands: Mapping[str, FloatArray], outside: str = "raise", which: int = BOTH) -> IslandAnswer:
        """Phi_F and Phi_A of islands, or the one asked for."""
        X, mu = islands["X"], islands["mu"]
        if which == BOTH:
            return self.answer(X, mu)
        none, error = np.full(X.shape, np.nan), np.full(X.shape, CLOSED_FORM_ERROR)
        if which == FORCE:
            return IslandAnswer(math.pi / 5 * mu * height_integral(2.5, -X), none, error)
        return IslandAnswer(none, math.pi / 2 * height_integral(2.0, -X), error)
