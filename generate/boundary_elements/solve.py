"""One surface pressed flat: Tamaas at a list of loads, and all that is kept of it."""

from __future__ import annotations

import importlib.metadata
import os
import pathlib
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from generate.boundary_elements.surfaces import Recipe, heights
from mbma_tables.arguments import FloatArray
from mbma_tables.bearing import BANDS, bearing, half_plane_weights, radial_spectrum, wavevectors

# F/(A0 E* g), g the rms gradient: from 0.1% to 97% contact of a Gaussian surface ...
LOADS = (4.4e-4, 1e-3, 2e-3, 4.5e-3, 0.01, 0.02, 0.04, 0.07, 0.11, 0.17, 0.25, 0.37, 0.53, 0.75, 1.05)
HIGHER_LOADS = (1.5, 2.1, 3.0)  # ... and on, where heavy tails of the gradient keep gaps open
FULL = 0.96
TOLERANCE = 1e-6
MAX_ITERATIONS = 50_000  # surfaces stretched 1:16 take 4,000
CORRECTION = (np.pi - 1 + np.log(2)) / 24  # Yastrebov, Anciaux, Molinari 2017


class Contact:
    """A periodic map against a rigid plane: Polonsky and Keer's conjugate gradients as Tamaas has them, E* = 1.

    Each load starts from the pressures of the one before; `gap` has the last one's gaps, zero in contact.
    """

    gap: FloatArray

    def __init__(self, surface: FloatArray, sizes: tuple[float, float], tolerance: float = TOLERANCE) -> None:
        os.environ.setdefault("OMP_NUM_THREADS", "1")
        import tamaas

        tamaas.set_log_level(tamaas.LogLevel.error)
        self.surface = np.ascontiguousarray(surface, dtype=float)
        self.model = tamaas.ModelFactory.createModel(
            tamaas.model_type.basic_2d, list(map(float, sizes)), list(surface.shape)
        )
        self.model.E, self.model.nu = 1.0, 0.0
        self._solver = tamaas.PolonskyKeerRey(self.model, self.surface, tolerance)
        self._solver.max_iter = MAX_ITERATIONS
        self._tolerance = tolerance

    def press(self, force: float) -> dict[str, float]:
        """Contact under a mean pressure F/(A0 E*); areas as shares of A0, lengths as those of the map."""
        started = time.process_time()
        residual = self._solver.solve(force)
        if not residual <= self._tolerance:
            raise RuntimeError(f"boundary elements at F/(A0 E*) = {force:g} end with a residual of {residual:.1e}")
        seconds = time.process_time() - started
        pressure, moved = np.asarray(self.model.traction), np.asarray(self.model.displacement)
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


QUANTITIES = ("area", "area_raw", "mean_separation", "energy", "pressure_weighted_height", "residual", "seconds")


def simulate(recipe: Recipe) -> dict[str, Any]:
    """All that is kept of one surface: lengths in h_rms, force in A0 E* g, energy in A0 E* g h_rms."""
    unscaled = heights(recipe)
    # rms gradient 1: mean pressure is then F/(A0 E* g)
    surface = unscaled / bearing(unscaled, recipe.sizes).gradient
    known, spectrum = bearing(surface, recipe.sizes), radial_spectrum(surface, recipe.sizes)
    h_rms = known.h_rms
    wavenumber = np.hypot(*wavevectors(surface.shape, recipe.sizes))
    wavenumber[0, 0] = np.inf
    weights = half_plane_weights(surface.shape)
    length = np.array([1, 1, h_rms, h_rms, h_rms, 1, 1])
    contact = Contact(surface, recipe.sizes)
    rows: list[FloatArray] = []
    shares: list[FloatArray] = []
    for force in (*LOADS, *HIGHER_LOADS):
        if force > LOADS[-1] and rows[-1][0] > FULL:
            break
        result = contact.press(force)
        rows.append(np.array([result[name] for name in QUANTITIES]) / length)
        # elastic energy by bands, sum |p_q|^2/|q|: longer waves than the surface has, its bands, shorter ones
        pressure = np.fft.rfft2(np.asarray(contact.model.traction)) / surface.size
        modes = np.abs(pressure) ** 2 * weights / wavenumber
        shares.append(np.bincount(spectrum.band.ravel() + 1, modes.ravel(), BANDS + 2) / h_rms)
    return {
        **dict(zip(QUANTITIES, np.array(rows).T, strict=True)),
        "force": np.array((*LOADS, *HIGHER_LOADS)[: len(rows)]),
        "band_energy": np.array(shares),
        "q0_h_rms": recipe.q0 * h_rms,
        "h_max": known.h_max / h_rms,
        "quantiles": known.quantiles / h_rms,
        "mean_height": known.mean_height / h_rms,
        "top_gradient": known.top_gradient,
        "tension_force": known.tension_force,
        "tension": known.tension,
        "anisotropy": known.anisotropy,
        "slope_kurtosis": known.slope_kurtosis,
        "band_q": spectrum.q / recipe.q0,
        "band_variance": spectrum.variance / h_rms**2,
        "band_inverse_q2": spectrum.q2_mean_inverse * recipe.q0**2,
        "band_gradient": spectrum.gradient,
        # in units of 1/h_rms^2: m0 m4/m2^2 is 4 times its sum at g = 1
        "band_curvature": spectrum.curvature * h_rms**2,
        "engine": f"Tamaas {importlib.metadata.version('tamaas')}",
        "numpy": np.__version__,
    }


def simulate_to(recipe: Recipe, folder: str, solve: Callable[[Recipe], dict[str, Any]] = simulate) -> str:
    """Simulate one surface into a file of its own, which stands only when it is whole."""
    target = pathlib.Path(folder) / f"{recipe.name}.npz"
    if not target.exists():
        partial = target.with_suffix(f".{os.getpid()}.partial")
        try:
            found = solve(recipe)
        except RuntimeError as fault:
            raise RuntimeError(f"{recipe.name}: {fault}") from None
        with open(partial, "wb") as stream:
            np.savez_compressed(stream, **found)
        partial.replace(target)
    return recipe.name
