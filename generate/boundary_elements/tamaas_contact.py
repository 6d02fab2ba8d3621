"""Boundary elements by Tamaas (the extra `simulate`): the reference of laws, and of the library's own simulation."""

import os
import time

import numpy as np

from mbma_tables.common.arguments import FloatArray, needed
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.laws.boundary_elements import CORRECTION, TOLERANCE

MAX_ITERATIONS = 50_000  # surfaces stretched 1:16 take 4,000


class Contact:
    """A periodic map against a rigid plane: Polonsky and Keer's conjugate gradients as Tamaas has them, E* = 1.

    Each load starts from the pressures of the one before; `gap` has the last one's gaps, zero in contact.
    """

    gap: FloatArray

    def __init__(self, surface: FloatArray, sizes: tuple[float, float], tolerance: float = TOLERANCE) -> None:
        os.environ.setdefault("OMP_NUM_THREADS", "1")
        tamaas = needed("tamaas")
        tamaas.set_log_level(tamaas.LogLevel.error)
        self.surface = np.ascontiguousarray(surface, dtype=float)
        self.model = tamaas.ModelFactory.createModel(
            tamaas.model_type.basic_2d, list(map(float, sizes)), list(surface.shape)
        )
        self.model.E, self.model.nu = 1.0, 0.0
        self._solver = tamaas.PolonskyKeerRey(self.model, self.surface, tolerance)
        self._solver.max_iter = MAX_ITERATIONS
        self._tolerance = tolerance

    @property
    def traction(self) -> FloatArray:
        return np.asarray(self.model.traction)

    def press(self, force: float) -> dict[str, float]:
        """Contact under a mean pressure F/(A0 E*); areas as shares of A0, lengths as those of the map."""
        started = time.process_time()
        try:
            residual = self._solver.solve(force)
        except (ArithmeticError, RuntimeError) as fault:
            # of a single element in contact, for instance
            raise ConvergenceError(f"boundary elements at F/(A0 E*) = {force:g} fail: {fault}") from None
        if not residual <= self._tolerance:
            raise ConvergenceError(f"boundary elements at F/(A0 E*) = {force:g} end with a residual of {residual:.1e}")
        seconds = time.process_time() - started
        pressure, moved = self.traction, np.asarray(self.model.displacement)
        touching = pressure > 0
        edges = sum(int(np.count_nonzero(touching != np.roll(touching, 1, axis))) for axis in (0, 1))
        raw = float(touching.mean())
        # the engine moves the whole surface by the gap; elastic energy has the displacement about its mean
        gap = moved - self.surface
        self.gap = np.where(touching, 0.0, np.maximum(gap - gap[touching].mean(), 0.0))
        return {
            "area": raw - CORRECTION * edges / touching.size,
            "area_raw": raw,
            "mean_separation": float(gap.mean() - gap[touching].mean()),
            "energy": float(np.mean(pressure * (moved - moved.mean())) / 2),
            "pressure_weighted_height": float(np.mean(pressure * self.surface) / force),
            "residual": float(residual),
            "seconds": seconds,
        }
