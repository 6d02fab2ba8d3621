"""Area is a matter of resolution: what the shortest waves of a measurement do, and a power law beyond them."""

from __future__ import annotations

import dataclasses
import math
from typing import Any, TypeVar

import numpy as np

from mbma_tables.common.arguments import number_in
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import Units
from mbma_tables.surfaces.maps import measured_map
from mbma_tables.surfaces.profiles import measured_profile
from mbma_tables.surfaces.spectral import SpectralSurface, resolution
from mbma_tables.surfaces.treatment import Treated

S = TypeVar("S", bound=SpectralSurface)
STEPS_PER_OCTAVE = 8  # of an extrapolated spectrum


def measured_surface(
    treated: Treated, h_max: float | None = None, shortest: Any = None, hurst: Any = None
) -> SpectralSurface:
    """The surface of a treated map or line scan, continued to a shorter wavelength where that is asked for."""
    if (shortest is None) != (hurst is None):
        raise InputError("extrapolate_to and extrapolate_hurst: give both or neither")
    surface = (measured_profile if treated.heights.ndim == 1 else measured_map)(treated, h_max)
    known = dataclasses.replace(surface, provenance=(*surface.provenance, resolution(surface)))
    return known if shortest is None else extrapolated(known, shortest, hurst)


def extrapolated(surface: S, shortest: Any, hurst: Any) -> S:
    """A measured spectrum continued to a shorter wavelength [length] by a power law that is stated, not measured."""
    wave, exponent = (
        number_in("extrapolate_to", Units(surface.unit).number("extrapolate_to", shortest), 1e-30, 1e30),
        number_in("extrapolate_hurst", hurst, 0.0, 1.0),
    )
    last, end = float(surface.q1), 2 * math.pi / wave
    if not end > last:
        raise InputError(
            f"extrapolate_to must be below the shortest measured wavelength, {2 * math.pi / last:.6g}, got {wave:g}"
        )
    # from the mean level of the last measured octave
    slope = 2 + 2 * exponent
    octave = last / 2 * 2 ** ((np.arange(STEPS_PER_OCTAVE) + 0.5) / STEPS_PER_OCTAVE)
    known = np.asarray(surface.power_spectrum(octave))
    level = float(np.mean(np.log(known[known > 0]) + slope * np.log(octave[known > 0])))
    q = np.geomspace(last, end, max(2, math.ceil(math.log2(end / last) * STEPS_PER_OCTAVE) + 1))
    samples = None if surface.samples is None else np.append(surface.samples, np.full(q.size, surface.samples[-1]))
    # curves of the map's tops and valleys are not known of the waves added
    C = np.append(surface.C, np.exp(level - slope * np.log(q)))
    plain = dataclasses.replace(surface, bearing=None, bands=None, map=None)
    longer = dataclasses.replace(plain, q=np.append(surface.q, q), C=C, samples=samples)
    area = float(surface.rms_gradient / longer.rms_gradient)
    stiffness = float(surface.h_rms / longer.h_rms)
    told = (
        f"continued to waves of {wave:.4g} {surface.unit or ''}".rstrip()
        + f" by a power law with H = {exponent:g}, which was not measured: area at light load is {area:.3g} times "
        f"that of the measured waves, stiffness and conductance at a pressure {stiffness:.3g} times"
    )
    record = {"step": "extrapolated", "shortest": wave, "hurst": exponent, "area": area, "stiffness": stiffness}
    return dataclasses.replace(longer, provenance=(*surface.provenance, record | {"told": told}))
