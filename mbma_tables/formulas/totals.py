"""Total force and area in closed form, over the range of practice."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.arguments import broadcast_shape, finite_array, require
from mbma_tables.formulas.file import TOTALS, get_form
from mbma_tables.surfaces.surface import Surface


def closed_totals(surface: Surface, separation: ArrayLike, E_star: ArrayLike = 1.0) -> tuple[Any, Any, float]:
    """Force over nominal area and A/A0 by the closed totals, reading "reported".

    Parameters
    ----------
    surface : Surface
        One surface or a batch; it broadcasts against `separation`.
    separation : array_like
        d between the rigid plane and the mid-plane [length].
    E_star : array_like
        Effective modulus; force is in its unit.

    Returns
    -------
    force, area : ndarray
        In the broadcast shape.
    error : float
        Largest relative error of either that the form's certificate states.

    Raises
    ------
    InputError, OutOfRangeError
        For surfaces and separations outside the range of the form: its `range`, and less contact than it answers.
    """
    form = get_form(TOTALS)
    gap, modulus = finite_array("separation", separation), finite_array("E_star", E_star)
    require("E_star", modulus, modulus > 0, "positive")
    shape = broadcast_shape(separation=gap, surface=surface.hurst, E_star=modulus)
    fields = {
        "d_over_h_rms": gap / surface.h_rms,
        "h_max_over_h_rms": surface.h_max / surface.h_rms,
        "zeta_1": surface.zeta_1,
        "hurst": surface.hurst,
    }
    given = {name: np.broadcast_to(np.asarray(field), shape) for name, field in fields.items()}
    for name, field in given.items():
        low, high = form.range[name]
        require(name, field, (field >= low) & (field <= high), f"in [{low:g}, {high:g}], where the closed totals hold")
    h_max = np.broadcast_to(np.asarray(surface.h_max), shape)
    require("separation", np.broadcast_to(gap, shape), gap >= -h_max, "at least -h_max, where the model ends")
    require("separation", np.broadcast_to(gap, shape), gap < h_max, "below h_max: there is no contact from there on")
    found = form.evaluate({name: field.ravel() for name, field in given.items()})
    area = found["area"].reshape(shape)
    least = form.range["area"][0]
    require("area", area, area >= least, f"at least {least:g}, where the closed totals hold")
    force = found["force"].reshape(shape) * modulus * surface.q0 * surface.h_rms
    return force[()], area[()], max(form.largest_error(name) for name in form.outputs)
