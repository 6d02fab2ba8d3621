"""One surface pressed flat: Tamaas at a list of loads, and all that is kept of it."""

from __future__ import annotations

import importlib.metadata
import os
import pathlib
from collections.abc import Callable
from typing import Any

import numpy as np

from generate.boundary_elements.surfaces import Recipe, heights
from generate.boundary_elements.tamaas_contact import Contact as Contact
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.laws.bearing_curve import (
    BANDS,
    RadialSpectrum,
    bearing,
    half_plane_weights,
    radial_spectrum,
    wavevectors,
)
from mbma_tables.laws.boundary_elements import LOADS as LOADS

# beyond LOADS, where heavy tails of the gradient keep gaps open
HIGHER_LOADS = (1.5, 2.1, 3.0)
FULL = 0.96

QUANTITIES = ("area", "area_raw", "mean_separation", "energy", "pressure_weighted_height", "residual", "seconds")


def simulate(recipe: Recipe) -> dict[str, Any]:
    """All that is kept of one random surface."""
    return pressed(heights(recipe), recipe.sizes, recipe.q0)


def prepared(
    unscaled: FloatArray, sizes: tuple[float, float], q0: float
) -> tuple[FloatArray, RadialSpectrum, dict[str, Any]]:
    """A map at rms gradient 1, so that mean pressure is F/(A0 E* g), its spectrum, and what laws may know, in h_rms."""
    surface = unscaled / bearing(unscaled, sizes).gradient
    known, spectrum = bearing(surface, sizes), radial_spectrum(surface, sizes)
    h_rms = known.h_rms
    curves = {
        "q0_h_rms": q0 * h_rms,
        "h_max": known.h_max / h_rms,
        "quantiles": known.quantiles / h_rms,
        "mean_height": known.mean_height / h_rms,
        "top_gradient": known.top_gradient,
        "tension_force": known.tension_force,
        "tension": known.tension,
        "anisotropy": known.anisotropy,
        "slope_kurtosis": known.slope_kurtosis,
        "band_q": spectrum.q / q0,
        "band_variance": spectrum.variance / h_rms**2,
        "band_inverse_q2": spectrum.q2_mean_inverse * q0**2,
        "band_gradient": spectrum.gradient,
        # in units of 1/h_rms^2: m0 m4/m2^2 is 4 times its sum at g = 1
        "band_curvature": spectrum.curvature * h_rms**2,
        "numpy": np.__version__,
    }
    return surface, spectrum, curves


def pressed(unscaled: FloatArray, sizes: tuple[float, float], q0: float) -> dict[str, Any]:
    """All that is kept of one periodic map: lengths in h_rms, force in A0 E* g, energy in A0 E* g h_rms."""
    surface, spectrum, curves = prepared(unscaled, sizes, q0)
    h_rms = float(surface.std())
    wavenumber = np.hypot(*wavevectors(surface.shape, sizes))
    wavenumber[0, 0] = np.inf
    weights = half_plane_weights(surface.shape)
    length = np.array([1, 1, h_rms, h_rms, h_rms, 1, 1])
    contact = Contact(surface, sizes)
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
        **curves,
        "engine": f"Tamaas {importlib.metadata.version('tamaas')}",
    }


def simulate_to(recipe: Recipe, folder: str, solve: Callable[[Recipe], dict[str, Any]] = simulate) -> str:
    """Simulate one surface into a file of its own, which stands only when it is whole."""
    target = pathlib.Path(folder) / f"{recipe.name}.npz"
    if not target.exists():
        partial = target.with_suffix(f".{os.getpid()}.partial")
        try:
            found = solve(recipe)
        except (ConvergenceError, RuntimeError) as fault:
            raise RuntimeError(f"{recipe.name}: {fault}") from None
        with open(partial, "wb") as stream:
            np.savez_compressed(stream, **found)
        partial.replace(target)
    return recipe.name
