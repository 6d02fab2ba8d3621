"""What an island model is: anything that answers (X, mu) with force and area."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Mapping
from typing import Protocol

from mbma_tables.arguments import FloatArray

OUTSIDE = ("raise", "exact", "nan")  # what to do about islands that a table does not cover
QUANTITIES = ("force", "area")
FORCE, AREA, BOTH = 0, 1, 2  # which of them is asked for
EXACT_RTOL = 1e-10  # of the exact solver, where it stands in for a table


@dataclasses.dataclass(frozen=True)
class IslandAnswer:
    """Phi_F and Phi_A of islands, with a bound on their relative error; arrays of one shape.

    Where a model was asked for one of the two and the other would have cost more, the other is NaN.
    """

    phi_F: FloatArray
    phi_A: FloatArray
    error: FloatArray


class IslandModel(Protocol):
    """What the layers above need of an island model."""

    @property
    def name(self) -> str:
        """The tier that selects it."""

    def of_islands(self, islands: Mapping[str, FloatArray], outside: str = "raise", which: int = BOTH) -> IslandAnswer:
        """Phi_F and Phi_A of islands, given as `islands.geometry.FIELDS` and hurst, arrays of one shape.

        `outside` is one of `OUTSIDE`; `which` is FORCE, AREA or BOTH.
        """


class TwoNumberModel(abc.ABC):
    """A model that needs X and mu of an island and nothing else."""

    @abc.abstractmethod
    def answer(self, X: FloatArray, mu: FloatArray, *, outside: str = "raise") -> IslandAnswer:
        """Phi_F and Phi_A at finite X and mu >= 0."""

    def of_islands(self, islands: Mapping[str, FloatArray], outside: str = "raise", which: int = BOTH) -> IslandAnswer:
        """Phi_F and Phi_A of islands, both: a model whose halves cost apart has its own."""
        return self.answer(islands["X"], islands["mu"], outside=outside)
