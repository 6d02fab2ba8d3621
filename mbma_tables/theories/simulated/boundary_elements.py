"""Boundary elements: a height map pressed flat, elastic or with pressures that cannot exceed a hardness, E* = 1.

Conjugate gradients run on the points that are free to move, and every step is projected
exactly onto the pressures 0 <= p <= p_m of a given mean; scaling the load instead can
cycle. A map that its mirror images continue is solved by cosine transforms on its own
points. Loading only, frictionless.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import scipy.fft
from scipy.sparse.linalg import LinearOperator, cg

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.surfaces.bearing_curve import wavevectors

# F/(A0 E* g), g the rms gradient: from 0.1% to 97% contact of a Gaussian surface
LOADS = (
    4.4e-4,
    1e-3,
    2e-3,
    4.5e-3,
    0.01,
    0.02,
    0.04,
    0.07,
    0.11,
    0.17,
    0.25,
    0.37,
    0.53,
    0.75,
    1.05,
)
TOLERANCE = 1e-6  # mean complementarity error over mean pressure times h_rms
MAX_ITERATIONS = 3000
STIFFNESS_RTOL = 1e-4
CORRECTION = (np.pi - 1 + np.log(2)) / 24  # Yastrebov, Anciaux, Molinari 2017
# of the boundary of the area in cell edges: elastic points beside yielded ones, and the
# yielded area's own boundary
MIXED = 0.8
YIELDED = 0.65
YIELDING = 1 - 1e-9  # of the hardness, from which a point counts as yielded


def waves(values: FloatArray, mirrored: bool = False) -> FloatArray:
    """Amplitudes of the waves of a periodic map, or of the cosines of one that its mirror images continue."""
    return np.asarray(
        scipy.fft.dctn(values, norm="forward")
        if mirrored
        else scipy.fft.rfft2(values, norm="forward")
    )


def composed(
    modes: FloatArray, shape: tuple[int, ...], mirrored: bool = False
) -> FloatArray:
    """The map of such amplitudes; of cosines on another number of points, too."""
    if mirrored:
        return np.asarray(scipy.fft.idctn(modes, s=shape, norm="forward"))
    return np.asarray(scipy.fft.irfft2(modes, s=shape, norm="forward"))


def wavenumbers(
    shape: tuple[int, ...], sizes: tuple[float, float], mirrored: bool = False
) -> FloatArray:
    """Wavenumber of each of these amplitudes [1/length]."""
    if not mirrored:
        return np.asarray(np.hypot(*wavevectors(shape, sizes)))
    x, y = (
        np.pi * np.arange(count) / side for count, side in zip(shape, sizes, strict=True)
    )
    return np.asarray(np.hypot(x[:, None], y))


def project(p: FloatArray, mean: float, cap: float) -> FloatArray:
    """The nearest pressures in [0, cap] of that mean: all shifted alike, then clipped; the shift by Newton's method."""
    low = float(p.min()) - cap if np.isfinite(cap) else float(p.min()) - mean - 1
    high = float(p.max())
    shift = 0.0
    total = mean * p.size
    for _ in range(200):
        moved = p - shift
        clipped = np.clip(moved, 0, cap)
        miss = float(clipped.sum()) - total
        if abs(miss) <= 1e-13 * total:
            break
        if miss > 0:
            low = max(low, shift)
        else:
            high = min(high, shift)
        free = int(np.count_nonzero((moved > 0) & (moved < cap)))
        following = shift + miss / free if free else 0.5 * (low + high)
        shift = following if low < following < high else 0.5 * (low + high)
    return clipped


class BoundaryElementContact:
    """A map against a rigid plane; each load starts from the pressures of the one before.

    Parameters
    ----------
    surface, sizes : ndarray of shape (n, m), pair of float
        Heights and sides of the map [length].
    tolerance : float
        Mean complementarity error over mean pressure times h_rms, at which iterations end.
    hardness : float
        Largest pressure over E*; infinite where nothing yields.
    mirrored : bool
        Whether mirror images along both axes continue the map, which otherwise is periodic.
    """

    def __init__(
        self, surface: FloatArray, sizes: tuple[float, float], tolerance: float = TOLERANCE, hardness: float = np.inf,
        mirrored: bool = False,
    ) -> None:  # fmt: skip
        self.surface = np.asarray(surface, float) - np.mean(surface)
        self.sizes, self.tolerance, self.cap, self.mirrored = (
            sizes,
            tolerance,
            hardness,
            mirrored,
        )
        self.h_rms = float(self.surface.std())
        q = wavenumbers(self.surface.shape, sizes, mirrored)
        self._compliance = np.divide(2.0, q, out=np.zeros_like(q), where=q > 0)
        self._stiffness = q / 2
        self.pressure: FloatArray | None = None

    def deflect(
        self, pressure: FloatArray, filter_: FloatArray | None = None
    ) -> FloatArray:
        """Displacement of mean zero, or the field after another filter."""
        own = self._compliance if filter_ is None else filter_
        return composed(
            waves(pressure, self.mirrored) * own, pressure.shape, self.mirrored
        )

    def press(self, force: float) -> dict[str, float]:
        """Contact under a mean pressure F/(A0 E*); areas as shares of A0, lengths as those of the map.

        Raises
        ------
        ConvergenceError
            Where the tolerance is not reached.
        """
        started = time.process_time()
        shape = self.surface.shape
        cap = self.cap
        p = (
            np.full(shape, force)
            if self.pressure is None
            else project(self.pressure, force, cap)
        )
        gap = self.deflect(p) - self.surface
        direction = np.zeros(shape)
        size = 1.0
        free_before = None
        for iteration in range(MAX_ITERATIONS):
            inside = (p > 0) & (p < cap)
            if inside.any():
                level = float(gap[inside].mean())
            else:
                # any level between open and yielded points
                level = 0.5 * (
                    float(gap[p <= 0].min(initial=np.inf))
                    + float(gap[p >= cap].max(initial=-np.inf))
                )
            rest = gap - level
            # what is left to gain by each point, over the load
            wrong = np.where(rest > 0, rest * p, -rest * np.minimum(cap - p, force))
            residual = float(wrong.mean()) / (force * self.h_rms)
            if residual <= self.tolerance:
                break
            free = inside | ((p <= 0) & (rest < 0)) | ((p >= cap) & (rest > 0))
            slope = np.where(free, rest - rest[free].mean(), 0.0)
            new_size = float(np.sum(slope * slope))
            kept = free_before is not None and np.array_equal(free, free_before)
            direction = slope + (
                new_size / size if iteration and size > 0 else 0.0
            ) * np.where(free, direction, 0.0)
            if free_before is not None and not kept:
                direction = np.where(free, direction - direction[free].mean(), 0.0)
            size = new_size
            free_before = free
            moved = self.deflect(direction)
            step = float(np.sum(slope * direction)) / float(np.sum(direction * moved))
            if not step > 0:
                direction = slope
                step = new_size / float(np.sum(slope * self.deflect(slope)))
            # held points are pushed against their bounds, so that the projection's shift
            # does not free them
            p = project(p - step * np.where(free, direction, rest), force, cap)
            gap = self.deflect(p) - self.surface
        else:
            what = f"F/(A0 E*) = {force:g}" + (f", p_m = {cap:g}" if cap < np.inf else "")
            raise ConvergenceError(
                f"boundary elements at {what} end with a residual of {residual:.1e}"
            )
        self.pressure, self._rest = p, rest
        return self._found(force, residual, iteration) | {
            "seconds": time.process_time() - started
        }

    def _beside(self, field: Any) -> Any:
        """The field at the four neighbours of each point."""
        wide = np.pad(field, 1, "symmetric" if self.mirrored else "wrap")
        return np.stack(
            [wide[2:, 1:-1], wide[:-2, 1:-1], wide[1:-1, 2:], wide[1:-1, :-2]]
        )

    def _found(self, force: float, residual: float, iterations: int) -> dict[str, float]:
        p = self.traction
        rest = self._rest
        touching = p > 0
        yielded = p >= self.cap * YIELDING
        elastic = touching & ~yielded
        held = self._beside(touching)
        hard = self._beside(yielded)
        open_edges = np.count_nonzero(elastic & ~held)
        mixed_edges = np.count_nonzero(elastic & hard.any(axis=0) & ~held)
        own_edges = np.count_nonzero(yielded & ~hard)
        raw = float(touching.mean())
        raw_yielded = float(yielded.mean())
        full = force / self.cap
        area = raw - CORRECTION * (open_edges + MIXED * mixed_edges) / p.size
        return {
            "area": max(area, full),
            "area_yielded": min(
                raw_yielded + YIELDED * CORRECTION * own_edges / p.size, full
            ),
            "area_raw": raw,
            "area_yielded_raw": raw_yielded,
            "mean_separation": float(np.maximum(rest, 0).mean()),
            "plane_separation": float(rest.mean()),
            "energy": float(np.mean(p * self.deflect(p)) / 2),
            "pressure_weighted_height": float(np.mean(p * self.surface) / force),
            "residual": residual,
            "iterations": float(iterations),
        }

    @property
    def traction(self) -> FloatArray:
        """Pressures of the last load over E*."""
        assert self.pressure is not None
        return self.pressure

    @property
    def gap(self) -> FloatArray:
        """Gaps of the last load, zero in contact, yielded points flattened."""
        return np.where(self.traction > 0, 0.0, np.maximum(self._rest, 0))

    def residual_heights(self) -> FloatArray:
        """Heights [length] of the map after the last load is taken off; of mean below zero where points yielded.

        What yielded points overlap the other body by stays (Almqvist, Sahlin, Larsson,
        Glavatskih 2007).
        """
        yielded = self.traction >= self.cap * YIELDING
        overlap = np.where(yielded, np.minimum(self._rest, 0.0), 0.0)
        return np.asarray(self.surface + overlap)

    def unloading(self) -> BoundaryElementContact:
        """The elastic contact of the map as the last load left it, under that load."""
        after = BoundaryElementContact(
            self.residual_heights(), self.sizes, self.tolerance, mirrored=self.mirrored
        )
        after.pressure = self.traction.copy()
        return after

    def frozen_stiffness(self) -> float:
        """-dF/du of the contact area as it is, sticking neither to yielding nor to opening [E*/length].

        Pressures on the area alone, of mean 1, that move it as a whole: preconditioned
        conjugate gradients.
        """
        shape = self.surface.shape
        touching = self.traction > 0
        even = np.where(touching, touching.size / touching.sum(), 0.0)

        def inside(filter_: FloatArray) -> LinearOperator:
            """Filters fields on the area, whose mean there is taken off."""

            def filtered(field: FloatArray) -> FloatArray:
                found = self.deflect(field.reshape(shape), filter_)
                return np.where(touching, found - found[touching].mean(), 0.0).ravel()

            return LinearOperator((touching.size, touching.size), filtered, dtype=float)

        compliance = inside(self._compliance)
        stiffness = inside(self._stiffness)
        start = -compliance @ even.ravel()
        more, failed = cg(
            compliance, start, rtol=STIFFNESS_RTOL, maxiter=MAX_ITERATIONS, M=stiffness
        )
        if failed:
            raise ConvergenceError("the stiffness of a frozen contact was not found")
        return 1 / float(self.deflect(even + more.reshape(shape))[touching].mean())
