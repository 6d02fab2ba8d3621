"""Ranges of the simulated surfaces and contacts, outside which no theory is valid.

All theories were compared with the same boundary-element simulations; docs/fidelity.md lists them.
"""

from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.surface import MeasuredSurface

TESTED_AREA = (1e-3, 0.97)  # A/A0 that was simulated
HURST = 0.2  # least Hurst exponent
ZETA_1 = (8.0, 128.0)  # longest over shortest wavelength
# h_max/h_rms: simulated up to 5.5, beyond which separation and stiffness change by 0.1% at most from
# 0.1% contact on
HEIGHTS = (2.5, 8.0)
# longest wavelengths along a side of the nominal area from which surfaces of one spectrum differ by
# the stated scatter; with two, the gap of some is 7-14% off where 2-3% are stated
SIDE = 4.0
# longest over shortest wavelength of the broadest surface that was simulated, once
BROADEST = 256.0
ROUNDING = 1e-9  # relative, of numbers beside the ends of these ranges


def untested(surface: AnySurface, area: FloatArray) -> dict[str, Any]:
    """Reasons why contacts of these areas A/A0 are outside the simulated range, each with a mask."""
    reasons = {**_of_the_surface(surface), **_of_the_side(surface)}
    least, most = TESTED_AREA
    reasons[f"A/A0 is below {least:g}"] = (area > 0) & (area < least * (1 - ROUNDING))
    reasons[f"A/A0 is above {most:g}"] = area > most * (1 + ROUNDING)
    return {text: np.broadcast_to(mask, np.shape(area)) for text, mask in reasons.items()}


def is_compared(surface: AnySurface) -> FloatArray:
    """Mask of surfaces like those whose deviations from simulations are averaged in the scatter."""
    if isinstance(surface, MeasuredSurface):
        return np.asarray(surface.q1 / surface.longest <= BROADEST * (1 + ROUNDING))
    hurst = np.asarray(getattr(surface, "hurst", 1.0))
    ratio = np.asarray(surface.zeta_1)
    broad = ratio > BROADEST * (1 + ROUNDING)
    narrow = ratio < ZETA_1[0] * (1 - ROUNDING)
    return np.asarray(~(broad | narrow | (hurst < HURST * (1 - ROUNDING))))


def _of_the_surface(surface: AnySurface) -> dict[str, Any]:
    least, most = ZETA_1
    narrow = f"the longest wavelength is less than {least:g} times the shortest"
    broad = f"the longest wavelength is more than {most:g} times the shortest"
    if isinstance(surface, MeasuredSurface):
        ratio = surface.q1 / surface.longest
        return {broad: np.asarray(ratio > most * (1 + ROUNDING))}
    ratio = np.asarray(surface.zeta_1)
    hurst = np.asarray(getattr(surface, "hurst", 1.0))
    heights = np.asarray(surface.h_max / surface.h_rms)
    return {
        f"the Hurst exponent is below {HURST:g}": hurst < HURST * (1 - ROUNDING),
        narrow: ratio < least * (1 - ROUNDING),
        broad: ratio > most * (1 + ROUNDING),
        f"h_max/h_rms is outside {HEIGHTS}": (heights < HEIGHTS[0])
        | (heights > HEIGHTS[1]),
    }


def _of_the_side(surface: AnySurface) -> dict[str, Any]:
    """Whether a given nominal area holds few of the longest wavelengths."""
    steps = {record["step"]: record for record in surface.provenance}
    if "nominal_area" not in steps:
        return {}
    waves = np.asarray(steps["nominal_area"]["waves_a_side"])
    short = waves < SIDE * (1 - ROUNDING)
    shortest = f"{float(waves.min()):.2g}"
    text = (
        f"the nominal area has {shortest} longest wavelengths a side, fewer than {SIDE:g}: surfaces with so "
        "few summits differ by more than the scatter; contact(Surface.from_map(...), theory='simulated') "
        "answers for one whose heights were measured"
    )
    return {text: short}
