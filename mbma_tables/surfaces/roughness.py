"""Roughness parameters: the surface with those of a drawing, each assumption stated; those of a height map.

A profile along any line of an isotropic surface has its variance of height m0 and, for the
variance of slope, m2, while the gradient of the surface has 2 m2. Everything else that is
assumed follows from Gaussian heights.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
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
)
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import resolve
from mbma_tables.surfaces import spectrum

HEIGHTS = ("Rq", "Ra", "Sq", "Sa")
SLOPES = ("Rdq", "Sdq", "Rsm")
WAVES = ("longest", "shortest")
TOPS = ("h_max", "Sp", "nominal_area")
ROUGHNESS = (*HEIGHTS, *SLOPES, *WAVES, "rolloff", *TOPS[1:])
ASSUMED = "heights are Gaussian and the surface is isotropic: measure a map of a ground, milled or worn face"
SAID = {
    "Rq": "h_rms = Rq: the profile is long and no filter removed wavelengths of the surface",
    "Ra": "h_rms = sqrt(pi/2) Ra: heights are Gaussian; the profile is long and unfiltered",
    "Sq": "h_rms = Sq: the map is large and no filter removed wavelengths of the surface",
    "Sa": "h_rms = sqrt(pi/2) Sa: heights are Gaussian; the map is large and unfiltered",
    "Rdq": "m2 = Rdq^2: the surface is isotropic, and Rdq was measured down to the shortest wavelength",
    "Sdq": "m2 = Sdq^2/2: the surface is isotropic, and Sdq was measured down to the shortest wavelength",
    "Rsm": "m2 = (2 pi h_rms/Rsm)^2: heights are Gaussian, every upward crossing of the mean line counts (Rice 1945);"
    " if an instrument omits small ones, the slope found here is a lower bound",
    "longest": "q0 = 2 pi/longest: no roughness of longer wavelengths",
    "shortest": "q1 = 2 pi/shortest: no roughness of shorter wavelengths",
    "rolloff": "the spectrum is flat from the longest wave to this one, and one power law from there on",
    "hurst": "the spectrum is one power law with this Hurst exponent between its longest and its shortest wave",
    "h_max": "contact begins at h_max above the mid-plane",
    "nominal_area": "contact begins at the highest point of a Gaussian surface of this area, the median",
    "Sp": "h_max = Sp: contact begins at the highest point of the map; a larger map has a higher one",
}
TYPICAL = "of Gaussian heights 3 to 4.5 times the rms height, near sqrt(2 ln N) times it of N independent points"
CORE = 0.4  # share of the material ratio curve that the straight line is fitted to


def _one_of(names: tuple[str, ...], given: Mapping[str, Any], what: str) -> str:
    """The one of the names that is given, "" for none; an error for several."""
    several = [name for name in names if name in given]
    if len(several) > 1:
        raise InputError(
            f"{what}: give one of {', '.join(names)}; got {' and '.join(several)}"
        )
    return several[0] if several else ""


def surface_of_roughness(unit: str | None, numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of `Surface` from numbers of a drawing; see `Surface.from_roughness`."""
    given, unit = resolve(
        {name: value for name, value in numbers.items() if value is not None}, unit
    )
    height = _one_of(HEIGHTS, given, "the height of roughness")
    slope = _one_of(SLOPES, given, "the slope of roughness")
    top = _one_of(TOPS, given, "the highest point")
    band = [name for name in (slope, *WAVES) if name in given]
    missing = []
    if not height:
        missing.append(f"the height of roughness, one of {', '.join(HEIGHTS)}")
    if "hurst" not in given:
        missing.append(
            "hurst, which a drawing does not tell (0.8 is common, and `sensitivity` gives its influence)"
        )
    if len(band) < 2:
        others = " and ".join(band) or "none"
        missing.append(
            f"the band of wavelengths, two of longest, shortest and Rdq (or Sdq, Rsm); got {others}"
        )
    if not top:
        missing.append(
            f"the highest point, one of {', '.join(TOPS)}, which Rq and Ra do not determine ({TYPICAL})"
        )
    if missing:
        raise InputError(
            f"roughness has {', '.join(given) or 'no numbers'}; missing: {'; '.join(missing)}"
        )
    if len(band) > 2:
        raise InputError(
            f"the band of wavelengths needs two of longest, shortest and Rdq (or Sdq, Rsm); got {' and '.join(band)}"
        )
    arrays = {name: positive_array(name, value) for name, value in given.items()}
    require("hurst", arrays["hurst"], arrays["hurst"] <= 1, "in (0, 1]")
    shape = broadcast_shape(**arrays)
    at = {name: np.broadcast_to(array, shape) for name, array in arrays.items()}
    h_rms = at[height] * (math.sqrt(math.pi / 2) if height in ("Ra", "Sa") else 1.0)
    said = f" [{unit}]" if unit else ""
    if top != "nominal_area":
        require(
            f"{top}{said}", at[top], at[top] > h_rms, f"above the rms height; {TYPICAL}"
        )
    if not slope:
        long, short = at["longest"], at["shortest"]
        few = long <= spectrum.MIN_ZETA_1 * short
        require(
            f"longest{said}",
            long,
            ~few,
            f"more than 3 times shortest, {describe_entries(short, few)}",
        )
    if slope and "rolloff" in at:
        q0, q1 = _band_with_rolloff(at, h_rms, slope)
    else:
        q0, q1 = _band(at, h_rms, slope)
    used = ("hurst", height, top, *band, *(["rolloff"] if "rolloff" in given else []))
    shown = {
        name: given[name].tolist() if hasattr(given[name], "tolist") else given[name]
        for name in used
    }
    record = {
        "given": shown,
        "unit": unit,
        "assumed": [ASSUMED, *(SAID[name] for name in used)],
    }
    surface: dict[str, Any] = {
        "hurst": at["hurst"],
        "q0": q0,
        "q1": q1,
        "h_rms": h_rms,
        "unit": unit,
    }
    surface |= {"provenance": ({"step": "from_roughness", **record},)}
    surface["nominal_area" if top == "nominal_area" else "h_max"] = at[top]
    return surface if "rolloff" not in given else _rolled_off(surface, at["rolloff"])


def _rolled_off(surface: dict[str, Any], rolloff: FloatArray) -> dict[str, Any]:
    """Arguments of a surface whose spectrum is flat down to a wavelength."""
    if rolloff.ndim:
        raise InputError(f"rolloff is of one surface, got shape {rolloff.shape}")
    hurst, q0, q1, h_rms = (
        float(surface.pop(name)) for name in ("hurst", "q0", "q1", "h_rms")
    )
    start = 2 * math.pi / float(rolloff)
    good = np.asarray(q0 < start < q1 / spectrum.MIN_ZETA_1)
    allowed = f"between 3 times shortest, {6 * math.pi / q1:.6g}, and longest, {2 * math.pi / q0:.6g}"
    require("rolloff", rolloff, good, allowed)
    law = -math.expm1(-2 * hurst * math.log(q1 / start)) / (2 * hurst)
    level = h_rms**2 / (2 * math.pi * start**2 * ((1 - (q0 / start) ** 2) / 2 + law))
    C = level * np.array([1.0, 1.0, (q1 / start) ** (-2 - 2 * hurst)])
    return surface | {"q": np.array([q0, start, q1]), "C": C}


def _band(
    at: Mapping[str, FloatArray], h_rms: FloatArray, slope: str
) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest wavenumber: q1/q0 is where m2/m0 over q0^2, or over q1^2, has the wanted value."""
    end, *other = (2 * math.pi / at[wave] for wave in WAVES if wave in at)
    if not slope:
        return end, other[0]
    from scipy.optimize.elementwise import find_root

    power = 0 if "longest" in at else 2
    wanted = _slope_variance(at, h_rms, slope) / (h_rms * end) ** 2

    def ratio(x: Any, h: Any) -> Any:
        zeta = np.exp(x)
        return (
            spectrum.band_moment(2, h, 1.0, zeta)
            / spectrum.band_moment(0, h, 1.0, zeta)
            / zeta**power
        )

    ends = math.log(spectrum.MIN_ZETA_1), math.log(spectrum.MAX_ZETA_1)
    least, most = np.sort(np.stack([ratio(x, at["hurst"]) for x in ends]), axis=0)
    bounds = np.stack(
        [
            at[slope] * (each / wanted) ** (-0.5 if slope == "Rsm" else 0.5)
            for each in (least, most)
        ]
    )
    allowed = f"between {bounds.min():.4g} and {bounds.max():.4g}, for a band of 3 < q1/q0 < 1e8 at these wavelengths"
    require(slope, at[slope], (wanted > least) & (wanted < most), allowed)
    args = (at["hurst"], wanted)
    found = find_root(
        lambda x, h, goal: np.log(ratio(x, h) / goal),
        ends,
        args=args,
        tolerances={"xrtol": 1e-15},
    )
    zeta = np.asarray(np.exp(found.x))
    return (end, end * zeta) if power == 0 else (end / zeta, end)


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
    """Smallest and largest wavenumber of a spectrum that is flat down to a wavelength and has a given slope."""
    if h_rms.ndim:
        raise InputError(f"rolloff is of one surface, got shape {h_rms.shape}")
    from scipy.optimize import brentq

    start = 2 * math.pi / float(at["rolloff"])
    hurst = float(at["hurst"])
    wanted = float(_slope_variance(at, h_rms, slope) / (h_rms * start) ** 2)

    def excess(longer: float, zeta: float) -> float:
        """ln of m2/(m0 start^2) over the wanted one, for q0 = start/longer and q1 = zeta start.

        m0 = 2 pi C (flat_0 + law_0) and m2 = pi C (flat_2 + law_2), with the integrals of q
        dq and q^3 dq.
        """
        flat_0 = (1 - longer**-2) / 2
        flat_2 = (1 - longer**-4) / 4
        law_0 = -math.expm1(-2 * hurst * math.log(zeta)) / (2 * hurst)
        law_2 = math.log(zeta)
        if hurst < 1:
            law_2 = math.expm1((2 - 2 * hurst) * math.log(zeta)) / (2 - 2 * hurst)
        return math.log((flat_2 + law_2) / (2 * (flat_0 + law_0)) / wanted)

    # the wavelength that is not given follows from the slope: it rises with q1, and falls
    # with the longest
    if "longest" in at:
        longer = float(at["longest"]) * start / (2 * math.pi)
        if longer < 1:
            raise InputError(
                "rolloff must be at most longest, from which on the spectrum is flat"
            )
        ends = spectrum.MIN_ZETA_1 * (1 + 1e-9), spectrum.MAX_ZETA_1

        def residual(x: float) -> float:
            return excess(longer, math.exp(x))
    else:
        zeta = 2 * math.pi / float(at["shortest"]) / start
        if zeta <= spectrum.MIN_ZETA_1:
            raise InputError(
                "rolloff must be more than 3 times shortest, between which the spectrum falls"
            )
        ends = 1 + 1e-9, spectrum.MAX_ZETA_1

        def residual(x: float) -> float:
            return excess(math.exp(x), zeta)

    low, high = map(math.log, ends)
    # of m2 over the wanted one at both ends, its root; of Rsm the inverse
    ratios = sorted(math.exp(residual(x) / 2) for x in (low, high))
    number = float(at[slope])
    bounds = sorted(
        number / ratio if slope == "Rsm" else number * ratio for ratio in ratios
    )
    allowed = f"between {bounds[0]:.4g} and {bounds[1]:.4g}, which spectra with this rolloff have"
    require(slope, at[slope], np.asarray(bounds[0] < number < bounds[1]), allowed)
    found = math.exp(brentq(residual, low, high, xtol=1e-14, rtol=1e-14))
    if "longest" in at:
        return np.asarray(start / longer), np.asarray(start * found)
    return np.asarray(start / found), np.asarray(start * zeta)


def areal_parameters(heights: ArrayLike, steps: tuple[float, float]) -> dict[str, float]:
    """Sq, Sa, Ssk, Sku, Sp, Sv, Sz, Sdq, Sk, Spk, Svk, Smr1, Smr2 and the direction of the lay.

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
    >>> found = areal_parameters(ridges, (1.0, 1.0))
    >>> f"Sq = {found['Sq']:.3f}, Sku = {found['Sku']:.2f}, lay at {found['lay']:.0f} degrees"
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
    along = np.linalg.eigh(tensor)[1][:, 0]
    top, bottom = float(values.max()), float(values.min())
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
        "lay": float(np.degrees(np.arctan2(along[1], along[0])) % 180),
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
    ratio, width = (np.arange(count) + 0.5) / count, max(round(CORE * count), 2)
    secants = curve[: count - width + 1] - curve[width - 1 :]
    # the middle one if several are least, as for uniform heights
    least = np.flatnonzero(secants <= secants.min() * (1 + 1e-12))
    part = slice(first := int(least[least.size // 2]), first + width)
    centre, level = ratio[part].mean(), curve[part].mean()
    slope = ((ratio[part] - centre) @ (curve[part] - level)) / np.sum(
        (ratio[part] - centre) ** 2
    )
    upper, lower = level - slope * centre, level + slope * (1 - centre)
    peaks, valleys = np.maximum(curve - upper, 0.0), np.maximum(lower - curve, 0.0)
    above, below = np.count_nonzero(peaks) / count, np.count_nonzero(valleys) / count
    return {
        "Sk": float(upper - lower),
        "Spk": float(2 * peaks.mean() / above) if above else 0.0,
        "Svk": float(2 * valleys.mean() / below) if below else 0.0,
        "Smr1": above,
        "Smr2": 1 - below,
    }
