"""Contact islands: band, radii, densities, force and area."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import (
    FloatArray,
    Numbers,
    any_labelled,
    broadcast_shape,
    hinted,
    positive_array,
    require,
)
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import modulus_and_units
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.geometry import geometry, measured_islands
from mbma_tables.islands.island_models import (
    AnyModel,
    answer_islands,
    island_model_name,
)
from mbma_tables.islands.variants import Variant, get_variant
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.surface import MeasuredSurface, Surface
from mbma_tables.theories.mbma.models import get_model, with_table


@dataclasses.dataclass(frozen=True, eq=False)
class Island:
    """Contact islands at approaches delta = z_max - d, in the surface's own length unit."""

    delta: Numbers  #: approach [length], broadcast against the surface
    zeta_d: Numbers  #: magnifications between which roughness deforms (27, 30)
    zeta_u: Numbers
    R_d: Numbers  #: radii of the island's sphere and of its summits (26, 29) [length]
    R_u: Numbers
    #: density [1/length^2] and standard deviation of height [length] of its summits (32)
    D: Numbers
    sigma: Numbers
    h_d: Numbers  #: roughness above zeta_d (B.3) [length]
    eta: Numbers  #: reduction factor of a summit's contact area by finer roughness (39)
    X: Numbers  #: the two numbers of the island problem (34, 36, 37)
    mu: Numbers
    force: Numbers  #: F^i [E_star length^2] and A^i [length^2] (40)
    area: Numbers
    error: Numbers  #: bound on the relative error of both
    variant: str  #: names of what computed them
    island_model: str


GEOMETRY = ("zeta_d", "zeta_u", "R_d", "R_u", "D", "sigma", "h_d", "eta", "X", "mu")
SMALLEST_DELTA = 1e-250  # [length], below which quotients underflow


def scale_force(g: dict[str, FloatArray]) -> FloatArray:
    """F^i over E* s/q0 per unit of Phi_F: sigma L."""
    return g["sigma"] * np.sqrt(2 * g["R_d"] * g["sigma"])


def scale_area(g: dict[str, FloatArray]) -> FloatArray:
    """A^i over 1/q0^2 per unit of Phi_A: eta pi D R_u sigma L^2."""
    return 2 * math.pi * g["eta"] * g["D"] * g["R_u"] * g["R_d"] * g["sigma"] ** 2


@hinted
def island(
    surface: AnySurface,
    delta: ArrayLike,
    island_model: str | AnyModel = "universal",
    variant: str | Variant = "reported",
    E_star: ArrayLike = 1.0,
    rtol: float = 1e-9,
) -> Island:
    """Contact islands of a surface at the approaches `delta`.

    Parameters
    ----------
    surface : Surface
        One surface or a batch; it broadcasts against `delta`.
    delta : array_like
        Approach z_max - d of the island, positive, in the surface's unit or, as text, with its own.
    island_model : {"universal", "island4d", "exact", "formula", "rigid"} or island model
        The island model, by name or an object, as for `contact`.
    variant : {"reported", "printed", "fitted"} or Variant
        Variant of the paper's equations.
    E_star : array_like or str
        Effective modulus, a number or text with a unit, "100 GPa"; force is in that unit
        times length squared.
    rtol : float
        Requested relative error of force and area.

    Returns
    -------
    Island

    Raises
    ------
    InputError, OutOfRangeError
        For approaches that are not positive and finite, and islands outside the table.
    ConvergenceError
        Where an exact island is not solved.

    Examples
    --------
    >>> from mbma_tables import Surface, island
    >>> found = island(Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0), [0.5, 2.0])  # um
    >>> [f"{number:.4g}" for number in (found.zeta_d[0], found.X[0], found.mu[0])]
    ['6.537', '1.322', '3.352']
    """
    E_star, units = modulus_and_units(E_star, surface)
    delta = units.number("delta", delta)
    rule = get_variant(variant)
    named: dict[str, Any] = {
        "variant": rule.name,
        "island_model": island_model_name(island_model),
    }
    if any_labelled(surface, delta, E_star):
        raise InputError("island takes plain arrays: use .values of the DataArrays")
    approach = positive_array("delta", delta)
    modulus = positive_array("E_star", E_star)
    model = get_model(with_table(island_model), rtol, rule)
    require("delta", approach, approach >= SMALLEST_DELTA, f"at least {SMALLEST_DELTA:g}")
    if not isinstance(surface, Surface | MeasuredSurface):
        # islands of sums of power laws are those of one spectrum at a time
        surface = surface.sampled()
    broadcast_shape(delta=approach, surface=surface.h_rms, E_star=modulus)
    shape = broadcast_shape(delta=approach, surface=surface.h_rms)
    if isinstance(surface, MeasuredSurface):
        refuse_bands(model)
    g, s, q0 = islands_of(surface, np.broadcast_to(approach, shape), rule)
    force, area, error = loads_of(model, g, s, q0)
    sizes = {
        "R_d": 1 / (s * q0**2),
        "R_u": 1 / (s * q0**2),
        "D": q0**2,
        "sigma": s,
        "h_d": s,
    }
    values = {name: (g[name] * sizes.get(name, 1.0))[()] for name in GEOMETRY}
    return Island(
        delta=np.broadcast_to(np.asarray(delta, dtype=float), shape)[()],
        force=(modulus * force)[()],
        area=area[()],
        error=np.asarray(error)[()],
        **values,
        **named,
    )


def islands_of(
    surface: AnySurface, delta: FloatArray, variant: Variant
) -> tuple[dict[str, FloatArray], Any, Any]:
    """`FIELDS` of islands at approaches > 0 [length], their Hurst exponent where they have one, and units s and q0."""
    if isinstance(surface, MeasuredSurface):
        return measured_islands(surface, delta, variant), 1.0, 1.0
    assert isinstance(surface, Surface)
    check_band(surface, variant)
    hurst, zeta_1 = (
        np.broadcast_to(array, delta.shape) for array in (surface.hurst, surface.zeta_1)
    )
    g = geometry(np.asarray(delta / surface.h_rms), hurst, zeta_1, variant)
    return g | {"hurst": hurst}, surface.s, surface.q0


def loads_of(
    model: AnyModel, g: dict[str, FloatArray], s: Any, q0: Any, outside: str = "raise"
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """F^i over E* and A^i (40) of `islands_of`, and a bound on the relative error of both."""
    phi = answer_islands(model, g, outside)
    force = s / q0 * scale_force(g) * phi.phi_F
    return force, scale_area(g) * phi.phi_A / q0**2, phi.error


def profiles_of(
    surface: AnySurface, delta: FloatArray, variant: Variant, rtol: float
) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """r [length], p(r) over E* and d(r) [length] in islands at approaches (Eqs. 34, 36, 37), and their error.

    Each of shape (islands, nodes); solved exactly.
    """
    g, s, q0 = islands_of(surface, delta, variant)
    sigma = g["sigma"]
    solved = greenwood_tripp.solve(g["X"], g["mu"], rtol=rtol)
    radius = np.sqrt(2 * g["R_d"] * sigma)
    stress = q0 * s * sigma / radius
    return (
        solved.rho * radius[:, None] / q0,
        stress[:, None] * solved.pressure,
        solved.gap * sigma[:, None] * s,
        float(np.max(solved.error)),
    )


def check_band(surface: Any, variant: Variant) -> None:
    """Reject self-affine surfaces whose band of wavenumbers is too narrow for a variant's islands."""
    largest = np.asarray(surface.zeta_1)
    allowed = f"greater than {variant.floor_u:g}, the variant's floor of zeta_u"
    require("q1/q0", largest, largest > variant.floor_u, allowed)


def refuse_bands(model: AnyModel) -> None:
    """Reject an island model that supports self-affine bands only."""
    if model.name == "island4d":
        raise InputError(
            f"island model {model.name!r} supports islands of self-affine surfaces only: use 'universal' or 'exact', "
            "or surface.fit()"
        )
