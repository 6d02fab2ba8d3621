"""Areal parameters of a height map: ISO 25178-2, with the core of the material ratio curve as in ISO 13565-2."""

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, finite_array
from mbma_tables.common.errors import InputError

CORE = 0.4  # share of the material ratio curve that the straight line is fitted to


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
        Lengths in the unit of the map; `Smr1` and `Smr2` as shares; `Sdq` by central differences; `lay` in degrees from
        the x axis towards y, in [0, 180): the direction along which the mean squared gradient is least.

    Examples
    --------
    >>> import numpy as np
    >>> from mbma_tables.surfaces.areal import areal_parameters
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

    A line is fitted to the 40% of the material ratio curve where its secant is least steep. Sk is the line's height
    difference between ratios 0 and 1, and Smr1 and Smr2 are the ratios at which the curve has these heights. Spk and
    Svk are the heights of triangles over Smr1 and 1 - Smr2 of the area of the curve beyond.
    """
    curve = np.sort(heights, axis=None)[::-1]
    count = curve.size
    ratio, width = (np.arange(count) + 0.5) / count, max(round(CORE * count), 2)
    secants = curve[: count - width + 1] - curve[width - 1 :]
    # the middle one if several are least, as for uniform heights
    least = np.flatnonzero(secants <= secants.min() * (1 + 1e-12))
    part = slice(first := int(least[least.size // 2]), first + width)
    centre, level = ratio[part].mean(), curve[part].mean()
    slope = ((ratio[part] - centre) @ (curve[part] - level)) / np.sum((ratio[part] - centre) ** 2)
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
