"""Roughness parameters: the surface with those of a drawing, and those of a height map.

Each assumption is stated. A profile along any line of an isotropic surface has its variance
of height m0 and, for the variance of slope, m2, while the gradient of the surface has 2 m2.
Everything else that is assumed follows from Gaussian heights.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import (
    FloatArray,
    broadcast_shape,
    describe_entries,
    finite_array,
    positive_array,
    require,
    require_name,
)
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import records, shipped_file
from mbma_tables.common.shared import shared
from mbma_tables.common.units import in_one_unit
from mbma_tables.surfaces import spectrum

HEIGHTS = ("Rq", "Ra", "Sq", "Sa")
SLOPES = ("Rdq", "Sdq", "Rsm")
WAVES = ("longest", "shortest")
TOPS = ("h_max", "Sp", "nominal_area")
ROUGHNESS = (*HEIGHTS, *SLOPES, *WAVES, "rolloff", *TOPS[1:], "process")
UNKNOWN = "unknown"  # a process that is not named
GAUSSIAN = "gaussian"  # the process of a face that is known to be Gaussian and isotropic
ASSUMED = (
    "heights are Gaussian and the surface is isotropic: measure a map of a ground, milled "
    "or worn face"
)
SAID = {
    "Rq": (
        "h_rms = Rq: the profile is long and no filter removed wavelengths of the surface"
    ),
    "Ra": (
        "h_rms = sqrt(pi/2) Ra: heights are Gaussian; the profile is long and unfiltered"
    ),
    "Sq": "h_rms = Sq: the map is large and no filter removed wavelengths of the surface",
    "Sa": "h_rms = sqrt(pi/2) Sa: heights are Gaussian; the map is large and unfiltered",
    "Rdq": (
        "m2 = Rdq^2: the surface is isotropic, and Rdq was measured down to the shortest "
        "wavelength"
    ),
    "Sdq": (
        "m2 = Sdq^2/2: the surface is isotropic, and Sdq was measured down to the "
        "shortest wavelength"
    ),
    "Rsm": (
        "m2 = (2 pi h_rms/Rsm)^2: heights are Gaussian, every upward crossing of the mean "
        "line counts (Rice 1945); if an instrument omits small ones, the slope found here "
        "is a lower bound"
    ),
    "longest": "q0 = 2 pi/longest: no roughness of longer wavelengths",
    "shortest": "q1 = 2 pi/shortest: no roughness of shorter wavelengths",
    "rolloff": (
        "the spectrum is flat from the longest wave to this one, and one power law from "
        "there on"
    ),
    "hurst": (
        "the spectrum is one power law with this Hurst exponent between its longest and "
        "its shortest wave"
    ),
    "h_max": "contact begins at h_max above the mid-plane",
    "nominal_area": (
        "contact begins at the highest point of a Gaussian surface of this area, the "
        "median"
    ),
    "Sp": (
        "h_max = Sp: contact begins at the highest point of the map; a larger map has a "
        "higher one"
    ),
}
TYPICAL = (
    "of Gaussian heights 3 to 4.5 times the rms height, near sqrt(2 ln N) times it of N "
    "independent points"
)
BAND = "two of longest, shortest and Rdq (or Sdq, Rsm)"
FILTERS = (
    "the cut-off lambda_c is longest, the filter lambda_s or the resolution shortest"
)
# where each number comes from
PAGE = "docs/surfaces.md, 'From Ra and a filter to a surface', says where to find each"


def _one_of(names: tuple[str, ...], numbers: Mapping[str, Any], what: str) -> str:
    """The one of the names that has a number, "" for none; an error for several."""
    several = [name for name in names if name in numbers]
    if len(several) > 1:
        raise InputError(
            f"{what}: give one of {', '.join(names)}; got {' and '.join(several)}"
        )
    return several[0] if several else ""


@shared()
def processes() -> dict[str, dict[str, str]]:
    """What is known of faces by the process that made them, a row of the shipped file each."""
    return {row["process"]: row for row in records(shipped_file("processes.csv"))}


def spread_of_processes(provenance: Iterable[Mapping[str, Any]], kind: str) -> float:
    """Standard deviation of ln of a law's answer for faces of the processes of a surface's records; 0 without one.

    `kind` is "area", "gap", "stiffness" or "flow". It is that of maps of the process, whose skewed
    heights, lay and spectrum Ra does not tell; of two faces the larger. That of flow is along
    and across the lay.
    """
    found = 0.0
    for record in provenance:
        process = record.get("process")
        if process is not None:
            found = max(found, float(processes()[process][f"{kind}_spread"]))
        for face in record.get("of", ()):
            found = max(found, spread_of_processes(face, kind))
    return found


def record_of_process(process: Any) -> dict[str, str]:
    """Entries of a surface's record: the process, and why a theory is not valid for it."""
    if process is None:
        return {}
    require_name("process", process, processes())
    row = processes()[process]
    record = {"process": process}
    if row["valid"] and float(row["valid"]) > 0:
        return record
    if process == UNKNOWN:
        record["not_valid"] = (
            "the process that made the face is not known, and of many processes no face is "
            "Gaussian and isotropic: name the process, or measure a map"
        )
        return record
    if int(row["maps"]):
        factor = math.exp(float(row["stiffness_error"]))
        compared = (
            f"the calibrated law is valid for none of {row['maps']} maps of {process} faces; of one "
            f"contact in ten its stiffness is wrong by a factor of {factor:.2f} or more"
        )
    else:
        compared = f"no map of {process} faces was compared with simulations"
    record["not_valid"] = (
        f"the face is {process}, not Gaussian and isotropic: {compared}; "
        "contact(Surface.from_map(...), theory='simulated') answers for a measured one"
    )
    return record


def _assumed_of(process: Any) -> list[str]:
    return [] if process == GAUSSIAN else [ASSUMED]


def surface_of_roughness(
    unit: str | None, numbers: Mapping[str, Any], process: Any = None
) -> dict[str, Any]:
    """Arguments of `Surface` from numbers of a drawing; see `Surface.from_roughness`."""
    of_process = record_of_process(process)
    stated = {name: value for name, value in numbers.items() if value is not None}
    stated, unit = in_one_unit(stated, unit)
    height = _one_of(HEIGHTS, stated, "the height of roughness")
    slope = _one_of(SLOPES, stated, "the slope of roughness")
    top = _one_of(TOPS, stated, "the highest point")
    band = [name for name in (slope, *WAVES) if name in stated]
    _refuse_missing(stated, height, band, top)
    if len(band) > 2:
        raise InputError(
            f"the band of wavelengths needs {BAND}; got {' and '.join(band)}"
        )
    arrays = {name: positive_array(name, value) for name, value in stated.items()}
    require("hurst", arrays["hurst"], arrays["hurst"] <= 1, "in (0, 1]")
    shape = broadcast_shape(**arrays)
    at = {name: np.broadcast_to(array, shape) for name, array in arrays.items()}
    # of Gaussian heights the mean absolute one is sqrt(2/pi) times the rms
    is_mean = height in ("Ra", "Sa")
    h_rms = at[height] * (math.sqrt(math.pi / 2) if is_mean else 1.0)
    in_unit = f" [{unit}]" if unit else ""
    if top != "nominal_area":
        allowed = f"above the rms height; {TYPICAL}"
        require(f"{top}{in_unit}", at[top], at[top] > h_rms, allowed)
    if not slope:
        _require_waves(at["longest"], at["shortest"], in_unit)
    if slope and "rolloff" in at:
        q0, q1 = _band_with_rolloff(at, h_rms, slope)
    else:
        q0, q1 = _band(at, h_rms, slope)

    used = ["hurst", height, top, *band]
    if "rolloff" in stated:
        used.append("rolloff")
    record = {
        "step": "from_roughness",
        "given": {name: _plain(stated[name]) for name in used},
        "unit": unit,
        "assumed": [*_assumed_of(process), *(SAID[name] for name in used)],
        **of_process,
    }
    surface: dict[str, Any] = {
        "hurst": at["hurst"],
        "q0": q0,
        "q1": q1,
        "h_rms": h_rms,
        "unit": unit,
        "provenance": (record,),
    }
    surface["nominal_area" if top == "nominal_area" else "h_max"] = at[top]
    return surface if "rolloff" not in stated else _rolled_off(surface, at["rolloff"])


def record_of_labels(
    names: list[str], unit: str | None, process: str | None
) -> dict[str, Any]:
    """The record of a surface of DataArrays, whose numbers may be lazy and are left out."""
    return {
        "step": "from_roughness",
        "unit": unit,
        "assumed": [*_assumed_of(process), *(SAID[name] for name in names)],
        **record_of_process(process),
    }


def _refuse_missing(
    stated: Mapping[str, Any], height: str, band: list[str], top: str
) -> None:
    """Raise an error that names every kind of number that is missing."""
    missing = []
    if not height:
        missing.append(f"the height of roughness, one of {', '.join(HEIGHTS)}")
    if "hurst" not in stated:
        missing.append(
            "hurst, which a drawing does not tell (0.8 is common, and `sensitivity` gives "
            "its influence)"
        )
    if len(band) < 2:
        others = " and ".join(band) or "none"
        missing.append(f"the band of wavelengths, {BAND}, got {others} ({FILTERS})")
    if not top:
        missing.append(
            f"the highest point, one of {', '.join(TOPS)} (the last of a joint beside its "
            f"parts), which Rq and Ra do not determine ({TYPICAL})"
        )
    if missing:
        raise InputError(
            f"roughness has {', '.join(stated) or 'no numbers'}; "
            f"missing: {'; '.join(missing)}. {PAGE}"
        )


def _require_waves(longest: FloatArray, shortest: FloatArray, in_unit: str) -> None:
    """Raise an error for a band too narrow for a rough surface."""
    too_narrow = longest <= spectrum.MIN_ZETA_1 * shortest
    allowed = f"more than 3 times shortest, {describe_entries(shortest, too_narrow)}"
    require(f"longest{in_unit}", longest, ~too_narrow, allowed)


def _plain(value: Any) -> Any:
    """A number or a list of them, for a record."""
    return value.tolist() if hasattr(value, "tolist") else value


def _rolled_off(surface: dict[str, Any], rolloff: FloatArray) -> dict[str, Any]:
    """Arguments of a surface whose spectrum is flat down to a wavelength, or of a batch of them."""
    hurst, q0, q1, h_rms = (
        np.asarray(surface.pop(name)) for name in ("hurst", "q0", "q1", "h_rms")
    )
    start = 2 * math.pi / rolloff
    # 6 pi/q1 is 3 times the shortest wavelength
    least = describe_entries(6 * math.pi / q1, start >= q1 / spectrum.MIN_ZETA_1)
    most = describe_entries(2 * math.pi / q0, start <= q0)
    if rolloff.ndim == 0:
        least, most = f"{6 * math.pi / q1:.6g}", f"{2 * math.pi / q0:.6g}"
    good = (q0 < start) & (start < q1 / spectrum.MIN_ZETA_1)
    allowed = f"between 3 times shortest, {least}, and longest, {most}"
    require("rolloff", rolloff, good, allowed)
    # h_rms^2 = 2 pi level start^2 (flat + law), the integrals of q dq over start^2
    flat = (1 - (q0 / start) ** 2) / 2
    law = -np.expm1(-2 * hurst * np.log(q1 / start)) / (2 * hurst)
    level = h_rms**2 / (2 * math.pi * start**2 * (flat + law))
    power = -2 - 2 * hurst
    if rolloff.ndim:
        bands = (
            spectrum.Band(q0, start, level, 0.0),
            spectrum.Band(start, q1, level, power),
        )
        return surface | {"bands": bands}
    C = float(level) * np.array([1.0, 1.0, float((q1 / start) ** power)])
    return surface | {"q": np.array([float(q0), float(start), float(q1)]), "C": C}


def _band(
    at: Mapping[str, FloatArray], h_rms: FloatArray, slope: str
) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest wavenumber, of both wavelengths or of one and a slope.

    q1/q0 is where m2/m0 over q0^2, or over q1^2, has the value of the slope.
    """
    if not slope:
        return 2 * math.pi / at["longest"], 2 * math.pi / at["shortest"]
    from scipy.optimize.elementwise import find_root

    hurst = at["hurst"]
    from_longest = "longest" in at
    end = 2 * math.pi / at["longest" if from_longest else "shortest"]
    power = 0 if from_longest else 2
    wanted = _slope_variance(at, h_rms, slope) / (h_rms * end) ** 2

    def ratio(log_zeta: FloatArray | float, exponent: FloatArray) -> FloatArray:
        """m2/m0 of a band over the square of the wavenumber at its end."""
        zeta = np.exp(log_zeta)
        m2 = spectrum.band_moment(2, exponent, 1.0, zeta)
        m0 = spectrum.band_moment(0, exponent, 1.0, zeta)
        return np.asarray(m2 / m0 / zeta**power)

    def excess(
        log_zeta: FloatArray, exponent: FloatArray, goal: FloatArray
    ) -> FloatArray:
        return np.log(ratio(log_zeta, exponent) / goal)

    ends = (math.log(spectrum.MIN_ZETA_1), math.log(spectrum.MAX_ZETA_1))
    at_ends = np.stack([ratio(log_zeta, hurst) for log_zeta in ends])
    least, most = np.sort(at_ends, axis=0)
    # a slope is as the root of m2, Rsm as its inverse
    root = -0.5 if slope == "Rsm" else 0.5
    bounds = np.stack([at[slope] * (limit / wanted) ** root for limit in (least, most)])
    allowed = (
        f"between {bounds.min():.4g} and {bounds.max():.4g}, for a band of "
        "3 < q1/q0 < 1e8 at these wavelengths"
    )
    require(slope, at[slope], (wanted > least) & (wanted < most), allowed)
    root_of_excess = find_root(
        excess, ends, args=(hurst, wanted), tolerances={"xrtol": 1e-15}
    )
    zeta = np.asarray(np.exp(root_of_excess.x))
    return (end, end * zeta) if from_longest else (end / zeta, end)


def _slope_variance(
    at: Mapping[str, FloatArray], h_rms: FloatArray, slope: str
) -> FloatArray:
    """m2 of a slope of roughness."""
    if slope == "Rsm":
        return np.asarray((2 * math.pi * h_rms / at["Rsm"]) ** 2)
    return np.asarray(at[slope] ** 2 / (2 if slope == "Sdq" else 1))


def _band_with_rolloff(
    at: Mapping[str, FloatArray], h_rms: FloatArray, slope: str
) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest wavenumber of a spectrum with a flat part and a given slope."""
    start = 2 * math.pi / at["rolloff"]
    hurst = at["hurst"]
    wanted = _slope_variance(at, h_rms, slope) / (h_rms * start) ** 2

    # the wavelength that is not given follows from the slope: it rises with q1, and falls
    # with the longest
    if "longest" in at:
        longer = at["longest"] * start / (2 * math.pi)
        if (longer < 1).any():
            raise InputError(
                "rolloff must be at most longest, from which on the spectrum is flat"
            )

        def excess_at_zeta(log_zeta: Any, longer: Any, H: Any, goal: Any) -> Any:
            return _excess_of_slope(longer, np.exp(log_zeta), H, goal)

        lowest = spectrum.MIN_ZETA_1 * (1 + 1e-9)
        given = longer, hurst, wanted
        zeta = _root_for(slope, at[slope], excess_at_zeta, lowest, given)
        return start / longer, start * zeta

    zeta = 2 * math.pi / at["shortest"] / start
    if (zeta <= spectrum.MIN_ZETA_1).any():
        raise InputError(
            "rolloff must be more than 3 times shortest, between which the spectrum falls"
        )

    def excess_at_longest(log_longer: Any, zeta: Any, H: Any, goal: Any) -> Any:
        return _excess_of_slope(np.exp(log_longer), zeta, H, goal)

    given = zeta, hurst, wanted
    longer = _root_for(slope, at[slope], excess_at_longest, 1 + 1e-9, given)
    return start / longer, start * zeta


def _excess_of_slope(longer: Any, zeta: Any, hurst: Any, wanted: Any) -> FloatArray:
    """ln of m2/(m0 start^2) over the wanted one, for q0 = start/longer and q1 = zeta start.

    m0 = 2 pi C (flat_0 + law_0) and m2 = pi C (flat_2 + law_2), with the integrals of q dq
    and q^3 dq.
    """
    flat_0 = (1 - longer**-2.0) / 2
    flat_2 = (1 - longer**-4.0) / 4
    log_zeta = np.log(zeta)
    law_0 = log_zeta * spectrum.growth(-2 * hurst, log_zeta)
    law_2 = log_zeta * spectrum.growth(2 - 2 * hurst, log_zeta)
    return np.asarray(np.log((flat_2 + law_2) / (2 * (flat_0 + law_0)) / wanted))


def _root_for(
    slope: str,
    number: FloatArray,
    excess: Callable[..., FloatArray],
    lowest: float,
    given: tuple[FloatArray, ...],
) -> FloatArray:
    """The ratios of wavenumbers, above the lowest, at which spectra have the slope."""
    from scipy.optimize.elementwise import find_root

    ends = math.log(lowest), math.log(spectrum.MAX_ZETA_1)
    # slopes at both ends over the stated one, of Rsm the inverse
    ratios = np.sort([np.exp(excess(end, *given) / 2) for end in ends], axis=0)
    least, most = number * (1 / ratios[::-1] if slope == "Rsm" else ratios)
    allowed = (
        f"between {least.min():.4g} and {most.max():.4g}, which spectra with this rolloff "
        "have"
    )
    require(slope, number, (least < number) & (number < most), allowed)
    root = find_root(
        excess, ends, args=given, tolerances={"xrtol": 1e-14, "xatol": 1e-14}
    )
    return np.asarray(np.exp(root.x))


def areal_parameters(heights: ArrayLike, steps: tuple[float, float]) -> dict[str, float]:
    """Areal roughness parameters of a map, and the direction of its lay.

    Sq, Sa, Ssk, Sku, Sp, Sv, Sz, Sdq, Sk, Spk, Svk, Smr1 and Smr2.

    Parameters
    ----------
    heights : array_like, shape (nx, ny)
        Height map [length]; its mean is subtracted. The first axis is x.
    steps : pair of float
        Sampling steps along x and y [length].

    Returns
    -------
    dict of float
        Lengths in the unit of the map; `Smr1` and `Smr2` as shares; `Sdq` by central
        differences; `lay` in degrees from the x axis towards y, in [0, 180): the direction
        along which the mean squared gradient is least.

    Examples
    --------
    >>> import numpy as np
    >>> from mbma_tables.surfaces.roughness import areal_parameters
    >>> x = np.arange(200.0)
    >>> ridges = np.repeat(np.sin(2 * np.pi * x / 40)[:, None], 100, axis=1)  # along y
    >>> sizes = areal_parameters(ridges, (1.0, 1.0))
    >>> f"Sq = {sizes['Sq']:.3f}, Sku = {sizes['Sku']:.2f}, lay at {sizes['lay']:.0f} degrees"
    'Sq = 0.707, Sku = 1.50, lay at 90 degrees'
    """
    values = finite_array("heights", heights)
    if values.ndim != 2 or min(values.shape) < 2:
        raise InputError(f"heights must be a map, got shape {values.shape}")
    values = values - values.mean()
    Sq = float(np.sqrt(np.mean(values**2)))
    if not Sq > 0:
        raise InputError("heights are all the same")
    slopes = np.stack(np.gradient(values, *steps)).reshape(2, -1)
    tensor = slopes @ slopes.T / values.size
    # the eigenvector of the smaller eigenvalue
    _, directions = np.linalg.eigh(tensor)
    along_x, along_y = directions[:, 0]
    top = float(values.max())
    bottom = float(values.min())
    return {
        "Sq": Sq,
        "Sa": float(np.mean(np.abs(values))),
        "Ssk": float(np.mean((values / Sq) ** 3)),
        "Sku": float(np.mean((values / Sq) ** 4)),
        "Sp": top,
        "Sv": -bottom,
        "Sz": top - bottom,
        "Sdq": float(np.sqrt(np.trace(tensor))),
        **core(values),
        "lay": float(np.degrees(np.arctan2(along_y, along_x)) % 180),
    }


def core(heights: FloatArray) -> dict[str, float]:
    """Sk, Spk, Svk, Smr1 and Smr2 of heights of any shape.

    A line is fitted to the 40% of the material ratio curve where its secant is least steep.
    Sk is the line's height difference between ratios 0 and 1, and Smr1 and Smr2 are the
    ratios at which the curve has these heights. Spk and Svk are the heights of triangles
    over Smr1 and 1 - Smr2 of the area of the curve beyond.
    """
    curve = np.sort(heights, axis=None)[::-1]
    count = curve.size
    ratio = (np.arange(count) + 0.5) / count
    # ISO 25178-2: the straight line is fitted to 40% of the curve
    width = max(round(0.4 * count), 2)
    secants = curve[: count - width + 1] - curve[width - 1 :]
    least = np.flatnonzero(secants <= secants.min() * (1 + 1e-12))
    # the middle one if several are least, as for uniform heights
    first = int(least[least.size // 2])
    part = slice(first, first + width)
    centre = ratio[part].mean()
    level = curve[part].mean()
    from_centre = ratio[part] - centre
    slope = (from_centre @ (curve[part] - level)) / np.sum(from_centre**2)
    # the line at ratios 0 and 1
    upper = level - slope * centre
    lower = level + slope * (1 - centre)
    peaks = np.maximum(curve - upper, 0.0)
    valleys = np.maximum(lower - curve, 0.0)
    above = np.count_nonzero(peaks) / count
    below = np.count_nonzero(valleys) / count
    return {
        "Sk": float(upper - lower),
        "Spk": float(2 * peaks.mean() / above) if above else 0.0,
        "Svk": float(2 * valleys.mean() / below) if below else 0.0,
        "Smr1": above,
        "Smr2": 1 - below,
    }
