"""The highest point of a Gaussian surface of a given nominal area.

The expected number of maxima above x = h/h_rms, of an area A0 and a variance m2 of a profile's slope (R. J. Adler, The
Geometry of Random Fields, 1981), for high levels::

    N(x) = A0 (m2/h_rms^2) (2 pi)^(-3/2) x exp(-x^2/2),    P(max < x) = exp(-N(x))
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, broadcast_shape, finite_array, positive_array, require
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import Units

LEAST = 2.0  # h_max/h_rms above which maxima are rare
STEPS = 60  # the error of a level falls fourfold in each, or faster
ENDS = (0.16, 0.84)  # shares of surfaces below the two ends of the stated spread


def highest_point(h_rms: ArrayLike, m2: ArrayLike, nominal_area: ArrayLike, probability: ArrayLike = 0.5) -> FloatArray:
    """Height below which the highest point of an area lies with a probability [length]; by default the median.

    Parameters
    ----------
    h_rms, m2, nominal_area : array_like
        Root-mean-square height [length], variance of a profile's slope, A0 [length^2]: so large that the highest point
        is above 2 h_rms.
    probability : array_like
        In (0, 1).

    Examples
    --------
    A joint of 20 mm x 20 mm with wavelengths up to 250 um [um]:

    >>> from mbma_tables import Surface
    >>> from mbma_tables.surfaces.extremes import highest_point
    >>> joint = Surface.from_roughness(Rq=1.0, longest=250.0, shortest=2.0, hurst=0.8, nominal_area=20e3**2)
    >>> round(float(joint.h_max), 2), highest_point(1.0, joint.m2, 20e3**2, [0.16, 0.84]).round(2)
    (5.33, array([5.13, 5.59]))
    """
    given = {"h_rms": h_rms, "m2": m2, "nominal_area": nominal_area, "probability": probability}
    arrays = {name: positive_array(name, value) for name, value in given.items()}
    height, slope, chance = arrays["h_rms"], arrays["m2"], arrays["probability"]
    require("probability", chance, chance < 1, "between 0 and 1")
    area = np.broadcast_to(arrays["nominal_area"], broadcast_shape(**arrays))
    c = -np.log(chance) * (2 * math.pi) ** 1.5 * height / area * height / slope
    least = area * c / (LEAST * math.exp(-(LEAST**2) / 2))
    allowed = f"at least {float(np.max(least)):.4g}, where the highest point is at 2 h_rms"
    require("nominal_area", area, area >= least, allowed)
    x = np.sqrt(-2 * np.log(np.minimum(c, 0.5)))
    for _ in range(STEPS):
        x = np.sqrt(2 * np.log(np.maximum(x, LEAST) / c))
    return np.asarray(height * x)


def of_area(surface: Any, nominal_area: Any, h_max: Any) -> tuple[Any, tuple[Mapping[str, Any], ...]]:
    """h_max of a surface of that area, and its provenance."""
    if h_max is not None:
        raise InputError("h_max and nominal_area are both given: give one of them")
    if surface.labelled:
        raise InputError("nominal_area is of numbers and arrays: give DataArrays h_max, of extremes.highest_point")
    area = finite_array("nominal_area", Units(surface.unit).number("nominal_area", nominal_area))
    median, *ends = (highest_point(surface.h_rms, surface.m2, area, chance) for chance in (0.5, *ENDS))
    told = "h_max is the median over Gaussian surfaces of the nominal area; two of three are between from and to"
    record = {"step": "nominal_area", "nominal_area": area.tolist(), "from": ends[0].tolist(), "to": ends[1].tolist()}
    return median[()], (*surface.provenance, record | {"assumed": [told]})
