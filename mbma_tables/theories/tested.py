"""Ranges of the simulated surfaces and contacts, outside which no theory is valid.

They are in the shipped file tested.csv, by theory, and for contacts with a hardness apart.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.files import records, shipped_file
from mbma_tables.common.shared import shared
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.banded import BandedSurface
from mbma_tables.surfaces.surface import MeasuredSurface

# longest wavelengths along a side of the nominal area from which surfaces of one spectrum differ by
# the stated scatter; with two, the gap of some is 7-14% off where 2-3% are stated
SIDE = 4.0
# longest over shortest wavelength of the broadest surface that was simulated, once
BROADEST = 256.0
ROUNDING = 1e-9  # relative, of numbers beside the ends of these ranges
ELASTIC = "elastic"
WITH_HARDNESS = "hardness"
# quantities whose ranges are those of theories that know all heights, and of those that know a spectrum
BY_MAP = ("hurst", "bandwidth", "area")
BY_SPECTRUM = (*BY_MAP, "heights")
# quantities of tested.csv in the one line of a contact
LABELS = {
    "hurst": "hurst",
    "bandwidth": "q1/q0",
    "heights": "h_max/h_rms",
    "area": "A/A0",
    "eta": "hardness/(E* rms gradient)",
}

Range = tuple[float, float]


@shared()
def _records() -> dict[tuple[str, str], dict[str, dict[str, str]]]:
    """Rows of the file by theory and contact, then by quantity, read once."""
    found: dict[tuple[str, str], dict[str, dict[str, str]]] = {}
    for row in records(shipped_file("tested.csv")):
        found.setdefault((row["theory"], row["contact"]), {})[row["quantity"]] = row
    return found


def _rows(theory: str, contact: str) -> dict[str, dict[str, str]]:
    """Rows by quantity: of elastic contacts those of all theories, or of one beyond."""
    own = _records().get((theory, contact), {})
    return own if contact == WITH_HARDNESS else {**_records()["any", contact], **own}


def _ranges(theory: str, contact: str) -> dict[str, Range]:
    rows = _rows(theory, contact).items()
    return {name: (float(row["least"]), float(row["most"])) for name, row in rows}


@shared()
def elastic_ranges(theory: str = "") -> Mapping[str, Range]:
    """Tested ranges of elastic contacts: of all theories but the ones of maps, or with those of one beyond."""
    return _ranges(theory, ELASTIC)


@shared()
def ranges_with_hardness(theory: str) -> Mapping[str, Range]:
    """Tested ranges of a theory with a hardness; empty where it was not compared."""
    return _ranges(theory, WITH_HARDNESS)


def evidence(theory: str, quantities: Collection[str], contact: str = ELASTIC) -> str:
    """The simulated surfaces that such contacts were compared with, the page on them, and the ranges of these quantities."""
    rows = _rows(theory, contact)
    asked = [rows[name] for name in LABELS if name in rows and name in quantities]
    counts: dict[str, int] = {}
    for row in asked:
        counts[row["evidence"]] = max(
            int(row["surfaces"]), counts.get(row["evidence"], 0)
        )
    pages = ", ".join(dict.fromkeys(row["page"] for row in asked))
    ranges = ", ".join(
        f"{LABELS[row['quantity']]} {row['least']} to {row['most']}" for row in asked
    ).replace(" to inf", " or more")
    return f"{sum(counts.values())} simulated surfaces ({pages}), {ranges}"


def below(values: Any, limits: Range) -> Any:
    """Mask of values below a range, but for rounding."""
    return np.asarray(values) < limits[0] * (1 - ROUNDING)


def above(values: Any, limits: Range) -> Any:
    """Mask of values above a range, but for rounding."""
    return np.asarray(values) > limits[1] * (1 + ROUNDING)


def untested(
    surface: AnySurface, area: FloatArray, by_heights: bool = False, theory: str = ""
) -> dict[str, Any]:
    """Reasons why contacts of these areas A/A0 are outside the simulated range, each with a mask.

    `by_heights` is of theories that know all heights of a map, `theory` the name of one
    whose scatter is stored under it.
    """
    own = _of_the_surface(surface, by_heights, theory)
    reasons = {**own, **_of_the_side(surface)}
    reasons |= untested_areas(area, elastic_ranges()["area"])
    return {text: np.broadcast_to(mask, np.shape(area)) for text, mask in reasons.items()}


def untested_areas(area: FloatArray, limits: Range, kind: str = "") -> dict[str, Any]:
    """Reasons of areas A/A0 outside a range; `kind` names the contacts that it is of."""
    return {
        f"A/A0 is below {limits[0]:g}{kind}": (area > 0) & below(area, limits),
        f"A/A0 is above {limits[1]:g}{kind}": above(area, limits),
    }


def untested_with_hardness(
    surface: AnySurface, theory: str, area: FloatArray, eta: FloatArray
) -> dict[str, Any]:
    """Reasons why contacts with a hardness were not compared with simulations, each with a mask.

    `theory` is the name under which its scatter is stored, `eta` the hardness over E* times
    the rms gradient; where it is infinite, the contact is elastic.
    """
    shape = np.broadcast_shapes(np.shape(area), np.shape(eta))
    yields = np.broadcast_to(np.isfinite(eta), shape)
    ranges = ranges_with_hardness(theory)
    if not ranges:
        text = (
            f"theory {theory!r} was not compared with simulations with a hardness: "
            "theory='calibrated' was"
        )
        return {text: yields}
    soft = f"the hardness over E* times the rms gradient is below {ranges['eta'][0]:g}"
    reasons = {soft: below(eta, ranges["eta"])}
    if "area" in ranges:
        reasons |= untested_areas(area, ranges["area"], ", with a hardness")
    if "bandwidth" in ranges:
        most = ranges["bandwidth"][1]
        text = f"the longest wavelength is more than {most:g} times the shortest, with a hardness"
        reasons[text] = above(bandwidth(surface), ranges["bandwidth"])
    if "heights" in ranges:
        low, high = ranges["heights"]
        heights = np.asarray(surface.h_max) / np.asarray(surface.h_rms)
        text = (
            f"h_max/h_rms is outside {low:g} to {high:g}, where {theory!r} was compared with "
            "simulations with a hardness"
        )
        reasons[text] = below(heights, (low, high)) | above(heights, (low, high))
    return {text: np.broadcast_to(mask, shape) & yields for text, mask in reasons.items()}


def is_compared(surface: AnySurface, theory: str = "") -> FloatArray:
    """Mask of surfaces like those whose deviations from simulations are averaged in the scatter."""
    ranges = elastic_ranges(theory)
    ratio = bandwidth(surface)
    broad = above(ratio, (0.0, max(BROADEST, ranges["bandwidth"][1])))
    if isinstance(surface, MeasuredSurface | BandedSurface):
        return np.asarray(~broad)
    low_hurst = below(getattr(surface, "hurst", 1.0), ranges["hurst"])
    return np.asarray(~(broad | below(ratio, ranges["bandwidth"]) | low_hurst))


def beyond_all(surface: AnySurface) -> FloatArray:
    """Doublings of the bandwidth beyond that up to which all theories were compared."""
    most = elastic_ranges()["bandwidth"][1]
    return np.asarray(np.log2(np.maximum(bandwidth(surface) / most, 1.0)))


def bandwidth(surface: AnySurface) -> Any:
    """Longest over shortest wavelength; of a spectrum from where on a band holds most height."""
    if isinstance(surface, MeasuredSurface | BandedSurface):
        return np.asarray(surface.q1 / surface.longest)
    return np.asarray(surface.zeta_1)


def _of_the_exponent(
    surface: AnySurface, least_hurst: Range, band: Range
) -> dict[str, Any]:
    """Whether short wavelengths weigh more than with the least Hurst exponent.

    A spectrum that is no power law, as of two faces, has no exponent. It is judged by its
    gradient: at equal height and band it is larger than that of the least exponent. Bands
    that are too narrow anyway are not judged.
    """
    hurst = getattr(surface, "hurst", 1.0)
    if hurst is not None:
        text = f"the Hurst exponent is below {least_hurst[0]:g}"
        return {text: below(hurst, least_hurst)}
    ratio = bandwidth(surface)
    least = 2 * least_hurst[0]
    # Eqs. (6) and (7) of a power law between 1/ratio and 1, in units of q1
    wide = np.maximum(ratio, 1 + 1e-9)
    squared_gradient = (1 - wide ** (least - 2)) / (2 - least)
    squared_height = (wide**least - 1) / least
    steepest = np.sqrt(squared_gradient / squared_height)
    steepness = surface.rms_gradient / (surface.h_rms * surface.q1)
    text = f"short wavelengths have more of the height than with a Hurst exponent of {least_hurst[0]:g}"
    is_steep = np.asarray(steepness) > steepest * (1 + ROUNDING)
    return {text: ~below(ratio, band) & is_steep}


def _of_the_surface(surface: AnySurface, by_heights: bool, theory: str) -> dict[str, Any]:
    ranges = elastic_ranges(theory)
    ratio = bandwidth(surface)
    least, most = ranges["bandwidth"]
    narrow = f"the longest wavelength is less than {least:g} times the shortest"
    broad = f"the longest wavelength is more than {most:g} times the shortest"
    reasons = {
        **_of_the_exponent(surface, ranges["hurst"], ranges["bandwidth"]),
        narrow: below(ratio, ranges["bandwidth"]),
        broad: above(ratio, ranges["bandwidth"]),
    }
    if by_heights:
        return reasons
    heights = np.asarray(surface.h_max) / np.asarray(surface.h_rms)
    limits = ranges["heights"]
    text = f"h_max/h_rms is outside {limits[0]:g} to {limits[1]:g}"
    reasons[text] = below(heights, limits) | above(heights, limits)
    return reasons


def _of_the_side(surface: AnySurface) -> dict[str, Any]:
    """Whether a given nominal area holds few of the longest wavelengths."""
    steps = {record["step"]: record for record in surface.provenance}
    if "nominal_area" not in steps:
        return {}
    waves = np.asarray(steps["nominal_area"]["waves_a_side"])
    short = waves < SIDE * (1 - ROUNDING)
    # rounded down, so that the text does not say "4, fewer than 4"; but for the rounding of
    # units, by which 2 in one unit of length is 1.9999999 in another
    hundredths = math.floor(100 * float(waves.min()) * (1 + ROUNDING))
    shortest = f"{hundredths / 100:g}"
    text = (
        f"the nominal area has {shortest} longest wavelengths a side, fewer than {SIDE:g}: surfaces with so "
        "few summits differ by more than the scatter; contact(Surface.from_map(...), theory='simulated') "
        "answers for one whose heights were measured"
    )
    return {text: short}
