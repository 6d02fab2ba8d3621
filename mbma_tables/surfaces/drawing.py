"""What a drawing does not state: ranges from ISO's default filters and from the process, each with its source."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from mbma_tables.common.distributions import (
    distribution_of,
    distributions_in,
    of_all,
    with_numbers,
)
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import factor, in_one_unit
from mbma_tables.surfaces import spectrum
from mbma_tables.surfaces.roughness import (
    HEIGHTS,
    SLOPES,
    TOPS,
    UNKNOWN,
    WAVES,
    processes,
    record_of_process,
)

# largest Ra [um], cut-off lambda_c and filter lambda_s [um] of the default settings; ISO
# 21920-3:2021 has the limits and cut-offs of ISO 4288, ISO 3274 the filters lambda_s
SETTINGS = (
    (0.02, 80.0, 2.5),
    (0.1, 250.0, 2.5),
    (2.0, 800.0, 2.5),
    (10.0, 2500.0, 8.0),
    (math.inf, 8000.0, 25.0),
)
ISO = "the default of ISO 21920-3 for this Ra"
# longest of the shortest wavelengths, over lambda_s
COARSEST = 8.0
# least longest wavelength over lambda_c, and over the shortest one
LONGEST = 0.05
LEAST_BAND = 4.0
# Rz over Ra: 4 of a regular profile, 7 of a rough one (supplement 1 of DIN 4768)
RZ_OVER_RA = (4.0, 7.0)
# without a nominal area [cm^2]
NOMINAL_AREA = "1..100 cm^2"
AREA_SOURCE = "no nominal area is given; h_max depends on its logarithm alone"
STEP = "from_drawing"


def is_drawing(part: Any) -> bool:
    """Whether numbers of a face name a process and leave others out, which are then assumed."""
    if not isinstance(part, Mapping) or "map" in part or part.get("process") is None:
        return False
    known = {name for name, value in part.items() if value is not None}
    has_band = len(known & {*SLOPES, *WAVES}) > 1
    return not (has_band and "hurst" in known)


def drawing_of(given: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, str]]:
    """The numbers of a drawing with ranges in place of those that it does not state.

    Parameters
    ----------
    given : mapping
        Arguments of `Surface.from_roughness`, or the height "Rz". Each is a number, or a
        distribution.

    Returns
    -------
    numbers : dict
        Arguments of `Surface.from_roughness` but the highest point, as they would be typed.
    assumed : dict
        Of each number that the drawing does not state, its range and the source of it.

    Raises
    ------
    InputError
        Without a height or a unit of length, for arrays, and for an unknown process.

    Examples
    --------
    >>> from mbma_tables.surfaces.drawing import drawing_of
    >>> numbers, assumed = drawing_of({"Ra": "1.6 um", "process": "milled"})
    >>> numbers["longest"], numbers["shortest"]
    ('80..800 um log', '2.5..20 um log')
    >>> assumed["shortest"]
    '2.5..20 um log: lambda_s = 2.5 um, the default of ISO 21920-3 for this Ra, or the resolution of a coarser stylus'
    """
    numbers = {name: value for name, value in given.items() if value is not None}
    numbers.setdefault("process", UNKNOWN)
    record_of_process(numbers["process"])
    assumed: dict[str, str] = {}
    if "Rz" in numbers:
        numbers["Ra"] = _mean_height_of(numbers.pop("Rz"), numbers)
        assumed["Ra"] = f"{numbers['Ra']}: Rz is 4 to 7 times Ra (DIN 4768, supplement 1)"
    Ra = _mean_height(numbers)
    cut_off, filter_ = next(row[1:] for row in SETTINGS if row[0] >= Ra)
    shortest_most = min(COARSEST * filter_, cut_off / 8)
    longest_least = max(LONGEST * cut_off, LEAST_BAND * shortest_most)
    if "shortest" in numbers:
        coarsest = _end_of("shortest", numbers, "high")
        longest_least = min(max(longest_least, LEAST_BAND * coarsest), 0.9 * cut_off)
    if "longest" in numbers:
        finest = _end_of("longest", numbers, "low") / LEAST_BAND
        shortest_most = max(min(shortest_most, finest), 1.1 * filter_)
    slope = next((name for name in SLOPES if name in numbers), "")
    hurst = _hurst(numbers, slope, cut_off, filter_)
    if slope:
        exponent = numbers.get("hurst", hurst[0].split("..")[0])
        longest_least = _longest_of_slope(numbers, slope, exponent, cut_off)
    ranges = {
        "longest": (
            f"{longest_least:g}..{cut_off:g} um log",
            f"at most lambda_c = {cut_off / 1000:g} mm, {ISO}; the spectra of fine "
            "faces end far below it",
        ),
        "shortest": (
            f"{filter_:g}..{shortest_most:g} um log",
            f"lambda_s = {filter_:g} um, {ISO}, or the resolution of a coarser stylus",
        ),
    }
    needed = 2 - len({slope, *WAVES} & {*numbers})
    for name in WAVES:
        if name not in numbers and needed > 0:
            numbers[name], source = ranges[name]
            assumed[name] = f"{numbers[name]}: {source}"
            needed -= 1
    if "hurst" not in numbers:
        numbers["hurst"], assumed["hurst"] = hurst
    row = processes()[numbers["process"]]
    if assumed and numbers["process"] != "gaussian":
        maps = f"the {row['maps']} maps of it" if int(row["maps"]) else "any process"
        assumed["skewness and lay"] = (
            f"are those of {maps} (docs/fidelity.md): standard deviations of "
            f"{row['area_spread']} of ln area, {row['gap_spread']} of ln gap, "
            f"{row['stiffness_spread']} of ln stiffness and {row['flow_spread']} of ln flow"
        )
    return numbers, assumed


def _micrometres(name: str, value: Any, unit: str | None) -> float:
    """The middle of a number of a drawing [um]."""
    known = distribution_of(name, value)
    if known is not None:
        value = known.written(known.median)
    numbers, unit = in_one_unit({name: value}, unit)
    if unit is None:
        raise InputError(
            f"{name} = {value!r} has no unit of length, by which the default filters are "
            "known: write '1.6 um'"
        )
    number = np.asarray(numbers[name], float)
    if number.ndim or not number > 0:
        raise InputError(f"{name} of a drawing is one positive number, got {value!r}")
    return float(number) * factor(unit, "um")


def _end_of(name: str, numbers: Mapping[str, Any], end: str) -> float:
    """A wavelength of a drawing [um], or the "low" or "high" end of its range."""
    known = distribution_of(name, numbers[name])
    value = numbers[name] if known is None else known.written(getattr(known, end))
    return _micrometres(name, value, numbers.get("unit"))


def _mean_height_of(Rz: Any, numbers: Mapping[str, Any]) -> str:
    """The range of Ra of a face whose Rz is given."""
    if any(name in numbers for name in HEIGHTS):
        raise InputError("Rz beside another height of roughness: give one of them")
    middle = _micrometres("Ra", Rz, numbers.get("unit"))
    low, high = (middle / ratio for ratio in RZ_OVER_RA[::-1])
    return f"{low:.4g}..{high:.4g} um"


def _mean_height(numbers: Mapping[str, Any]) -> float:
    """Ra [um] of Gaussian heights, by which ISO has its default filters."""
    for name in HEIGHTS:
        if name in numbers:
            height = _micrometres(name, numbers[name], numbers.get("unit"))
            return height * (1.0 if name in ("Ra", "Sa") else math.sqrt(2 / math.pi))
    raise InputError(
        f"a drawing needs a height, one of {', '.join(HEIGHTS)} or Rz; got "
        f"{', '.join(numbers)}"
    )


def _hurst(
    numbers: Mapping[str, Any], slope: str, cut_off: float, filter_: float
) -> tuple[str, str]:
    """The range of Hurst exponents of a process; with a slope those that the filters leave."""
    row = processes()[numbers["process"]]
    low, high = float(row["hurst_least"]), float(row["hurst_most"])
    source = row["hurst_source"]
    if slope:
        by_slope = _hurst_of_slope(numbers, slope, cut_off, filter_)
        high = min(high, max(by_slope, 0.15))
        low = min(low, high - 0.1)
        source = f"{source}; at most that of this {slope} between lambda_c and lambda_s"
    text = f"{low:.4g}..{high:.4g}"
    return text, f"{text}: {source}"


def _hurst_of_slope(
    numbers: Mapping[str, Any], slope: str, cut_off: float, filter_: float
) -> float:
    """The Hurst exponent with which a band from lambda_c to lambda_s has a slope."""
    from scipy.optimize import brentq

    wanted = _wavenumber_of_slope(numbers, slope) ** 2 * (cut_off / (2 * math.pi)) ** 2
    zeta = cut_off / filter_

    def excess(hurst: float) -> float:
        m2, m0 = (spectrum.band_moment(order, hurst, 1.0, zeta) for order in (2, 0))
        return math.log(float(m2 / m0) / wanted)

    if excess(0.05) < 0:
        return 0.05
    return 1.0 if excess(1.0) > 0 else float(brentq(excess, 0.05, 1.0))


def _wavenumber_of_slope(numbers: Mapping[str, Any], slope: str) -> float:
    """Root mean square slope of a profile over h_rms [1/um]."""
    if slope == "Rsm":
        spacing = _micrometres(slope, numbers[slope], numbers.get("unit"))
        return 2 * math.pi / spacing
    known = distribution_of(slope, numbers[slope])
    value = float(np.asarray(numbers[slope] if known is None else known.median, float))
    h_rms = _mean_height(numbers) * math.sqrt(math.pi / 2)
    return value / h_rms / (math.sqrt(2) if slope == "Sdq" else 1.0)


def _longest_of_slope(
    numbers: Mapping[str, Any], slope: str, hurst: Any, cut_off: float
) -> float:
    """The longest wavelength [um] from which on a band of 1:8 has at most a slope."""
    known = distribution_of("hurst", hurst)
    exponent = float(hurst) if known is None else known.low
    m2, m0 = (spectrum.band_moment(order, exponent, 1.0, 8.0) for order in (2, 0))
    least = 2 * math.pi * math.sqrt(float(m2 / m0))
    least /= _wavenumber_of_slope(numbers, slope)
    return min(max(least, LONGEST * cut_off), 0.9 * cut_off)


def with_area(numbers: dict[str, Any], assumed: dict[str, str]) -> None:
    """Add the range of nominal areas where numbers have no highest point."""
    if not top_in(numbers):
        numbers["nominal_area"] = NOMINAL_AREA
        assumed["nominal_area"] = f"{NOMINAL_AREA}: {AREA_SOURCE}"


def surface_of_drawing(surface_type: Any, given: Mapping[str, Any]) -> Any:
    """The surface of the middle of every range of a drawing; see `Surface.from_drawing`."""
    numbers, assumed = drawing_of(given)
    with_area(numbers, assumed)
    inputs = dict(distributions_in(numbers))
    middle = with_numbers(numbers, of_all(inputs, lambda each: each.median))
    surface = surface_type.from_roughness(**middle)
    if not assumed:
        return surface
    record = {
        "step": STEP,
        "given": {name: value for name, value in given.items() if value is not None},
        "assumed": [f"{name} {text}" for name, text in assumed.items()],
        "not_valid": (
            f"{', '.join(assumed)} of the drawing are ranges, of which this is the "
            "middle: uncertainty(...) and Joint(...) have the quantities of the whole ranges"
        ),
    }
    return dataclasses.replace(surface, provenance=(*surface.provenance, record))


def entries_of(surface: Any) -> tuple[Any, dict[str, str]]:
    """Arguments with ranges of a drawing or a surface of one, and what is assumed; anything else as it is."""
    given = surface if is_drawing(surface) else record_of(surface)
    if given is None:
        return surface, {}
    return drawing_of(given)


def record_of(surface: Any) -> Mapping[str, Any] | None:
    """The drawing from which a surface was made and not changed since; None for others."""
    records: Any = getattr(surface, "provenance", ())
    if len(records) < 2 or records[-1].get("step") != STEP:
        return None
    return dict(records[-1]["given"])


def lacks_area(part: Any) -> bool:
    """Whether numbers of a face of a process have no highest point."""
    named = isinstance(part, Mapping) and part.get("process") is not None
    return named and "map" not in part and not top_in(part)


def top_in(given: Mapping[str, Any]) -> bool:
    """Whether numbers have a highest point."""
    return any(given.get(name) is not None for name in TOPS)
