"""Total force and area of a surface at a gap: the sum over its contact islands (Eqs. 44-50).

Everything of an island depends on its approach delta alone; the gap enters through the Gaussian weight and
the upper limit h_max - d. In units of s and 1/q0,

    F/(A0 E* q0 s) = integral_0^((h_max - d)/s) F_hat D_d K1 G d(delta/s),
    G = exp(-z'^2/2 sigma_d^2)/(sqrt(2 pi) sigma_d),   z' = (d + delta)/s - h_d (41),

and A/A0 likewise.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.arguments import FloatArray, broadcast_shape, finite_array, is_labelled, require
from mbma_tables.errors import ConvergenceError, InputError, OutOfRangeError
from mbma_tables.models import AnyModel, get_model, tier_name
from mbma_tables.models.protocol import AREA, BOTH, FORCE, OUTSIDE, QUANTITIES
from mbma_tables.surfaces.readings import Reading, get_reading
from mbma_tables.surfaces.surface import PARAMETERS, Surface
from mbma_tables.totals.island_sum import Pairs, slopes_of, totals_of

ATTRIBUTES = {
    "force": {"long_name": "force over nominal area", "units": "unit of E_star"},
    "area": {"long_name": "real over nominal contact area", "units": "1"},
    "error": {"long_name": "bound on the relative error of force and area", "units": "1"},
}


@dataclasses.dataclass(frozen=True, eq=False)
class Contact:
    """Force and area at given separations; arrays of the broadcast shape.

    Attributes
    ----------
    separation : ndarray
        d, between the rigid plane and the mid-plane [length].
    mean_separation : ndarray
        u = (h_max + d)/2 (50) [length].
    force : ndarray or None
        F/A0 in the unit of E_star; F/(A0 E*) where that is 1. None where not asked for.
    area : ndarray or None
        A/A0, None where not asked for. The model does not end at 1 under full compression, and this is not clamped.
    error : ndarray
        Bound on the relative error of both against the model that the tier stands for, of quadrature and islands
        together. For tier "rigid" that model is the undeformed sphere, which may be far from the elastic one.
    reading, tier : str
        What made them.
    islands : int or None
        Islands evaluated; None where that is left to dask.
    force_by, area_by : dict of ndarray, or None
        Partial derivatives by "separation", "hurst", "q0", "q1", "h_rms" and "h_max", the others held.
    """

    separation: Any
    mean_separation: Any
    force: Any
    area: Any
    error: Any
    reading: str
    tier: str
    islands: int | None
    force_by: dict[str, Any] | None = None
    area_by: dict[str, Any] | None = None


def contact(
    surface: Surface,
    separation: ArrayLike,
    tier: str | AnyModel = "universal",
    reading: str | Reading = "reported",
    E_star: ArrayLike = 1.0,
    rtol: float = 1e-8,
    outside: str = "raise",
    derivatives: bool = False,
    quantities: Iterable[str] = QUANTITIES,
) -> Contact:
    """Force and real contact area of a surface at given separations (Eqs. 48, 49).

    Parameters
    ----------
    surface : Surface
        One surface or a batch; it broadcasts against `separation`.
    separation : array_like
        d between the rigid plane and the mid-plane [length], at least -h_max (full compression). From h_max
        on there is no contact, and force and area are zero.
    tier : {"universal", "island4d", "exact", "formula", "rigid"} or island model
        The island model: a table, the full solver, a closed form, or spheres that do not deform; or an object: a
        table from `open_table`, or a model of one's own with a `name` and ``answer(X, mu)``.
    reading : {"reported", "printed"} or Reading
        Which reading of the paper's equations.
    E_star : array_like
        Effective modulus, (1 - nu1^2)/E1 + (1 - nu2^2)/E2 inverted; force is in its unit.
    rtol : float
        Relative error asked of force and area, in [1e-11, 0.1]. A table adds its own error; `error` holds both.
    outside : {"raise", "exact", "nan"}
        For surfaces with islands outside the table: an error, the exact solver, or NaN.
    derivatives : bool
        Whether `force_by` and `area_by` are asked for (tier "universal").
    quantities : iterable of {"force", "area"}
        What is wanted. One alone costs less; the other is then None, and `error` is of the one.

    Returns
    -------
    Contact

    Raises
    ------
    InputError, OutOfRangeError
        For NaN, infinite or empty input, separations below -h_max, islands that no table covers.
    ConvergenceError
        Where the accuracy was not reached; its `mask` says which entries.

    See Also
    --------
    contact_law : for many gaps on one surface.

    Examples
    --------
    >>> from mbma_tables import Surface, contact
    >>> surface = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0)  # um
    >>> found = contact(surface, [1.0, 0.5], E_star=100e3)  # MPa
    >>> [f"{force:.4g} MPa on {area:.3%}" for force, area in zip(found.force, found.area)]
    ['7.982 MPa on 0.287%', '20.28 MPa on 0.735%']
    >>> bool((found.error < 1e-8).all())
    True
    """
    options: dict[str, Any] = {
        "tier": tier,
        "reading": get_reading(reading),
        "rtol": rtol,
        "outside": outside,
        "derivatives": derivatives,
        "quantities": _wanted(quantities),
    }
    if surface.labelled or is_labelled(separation) or is_labelled(E_star):
        return _of_labelled(surface, separation, E_star, options)
    return _contact(surface, separation, E_star, **options)


def _wanted(quantities: Iterable[str]) -> tuple[str, ...]:
    """The quantities asked for, each once, in the order of `QUANTITIES`."""
    asked = (quantities,) if isinstance(quantities, str) else tuple(quantities)
    if not asked or not set(asked) <= set(QUANTITIES):
        raise InputError(f"quantities must be some of {QUANTITIES}, got {quantities!r}")
    return tuple(name for name in QUANTITIES if name in asked)


def _contact(
    surface: Surface,
    separation: ArrayLike,
    E_star: ArrayLike,
    *,
    tier: str | AnyModel,
    reading: Reading,
    rtol: float,
    outside: str,
    derivatives: bool,
    quantities: tuple[str, ...],
) -> Contact:
    """`contact` of plain arrays."""
    gap = finite_array("separation", separation)
    modulus = finite_array("E_star", E_star)
    require("E_star", modulus, modulus > 0, "positive")
    if outside not in OUTSIDE:
        raise InputError(f"outside must be one of {OUTSIDE}, got {outside!r}")
    model = get_model(tier, rtol, reading)
    which = BOTH if len(quantities) > 1 else QUANTITIES.index(quantities[0])
    shape = broadcast_shape(separation=gap, surface=surface.hurst, E_star=modulus)
    gap = np.broadcast_to(gap, shape)
    h_max = np.broadcast_to(np.asarray(surface.h_max), shape)
    require("separation", gap, gap >= -h_max, "at least -h_max, where the model ends")
    zeta_1 = np.asarray(surface.zeta_1)
    require(
        "q1/q0", zeta_1, zeta_1 > reading.floor_u, f"greater than {reading.floor_u:g}, the reading's floor of zeta_u"
    )
    pairs = Pairs.of(surface, np.asarray(h_max - gap))
    stress = modulus * surface.q0 * surface.s
    force_by = area_by = None
    try:
        if derivatives:
            sums, error, islands = slopes_of(model, pairs, reading, rtol, outside)
            force, area = sums[:, 0, 0], sums[:, 1, 0]
            force_by, area_by = _by_parameter(surface, sums.reshape((*shape, *sums.shape[1:])), pairs, stress)
        else:
            force, area, error, islands = totals_of(model, pairs, reading, rtol, outside, which)
    except (ConvergenceError, OutOfRangeError) as fault:
        if fault.mask is not None:
            fault.mask = fault.mask.reshape(shape)
        raise
    return Contact(
        separation=gap[()],
        mean_separation=((h_max + gap) / 2)[()],
        force=(force.reshape(shape) * stress)[()] if which != AREA else None,
        area=area.reshape(shape)[()] if which != FORCE else None,
        error=error.reshape(shape)[()],
        reading=reading.name,
        tier=model.name,
        islands=islands,
        force_by=force_by if which != AREA else None,
        area_by=area_by if which != FORCE else None,
    )


def _of_labelled(surface: Surface, separation: Any, E_star: Any, options: dict[str, Any]) -> Contact:
    """`contact` of DataArrays, lazily where they are."""
    # xarray comes in with its own objects
    from mbma_tables.labels import apply_to_surface

    wanted = options["quantities"]
    by = [(kind, name) for kind in wanted for name in ("separation", *PARAMETERS)] if options["derivatives"] else []
    names = (*wanted, "error")

    def answer(block: Surface, gaps: Any, modulus: Any) -> tuple[Any, ...]:
        found = _contact(block, gaps, modulus, **options)
        slopes = (getattr(found, f"{kind}_by")[name] for kind, name in by)
        return (*(getattr(found, name) for name in names), *slopes)

    arrays = {"separation": separation, "E_star": E_star}
    outputs = apply_to_surface(answer, surface, arrays, len(names) + len(by))
    fields: dict[str, Any] = {"force": None, "area": None}
    for found, name in zip(outputs, names, strict=False):
        fields[name] = found.rename(name).assign_attrs(ATTRIBUTES[name])
    slopes = dict(zip(by, outputs[len(names) :], strict=True))
    for kind in QUANTITIES:
        fields[f"{kind}_by"] = {name: value for (own, name), value in slopes.items() if own == kind} or None
    return Contact(
        separation=separation,
        mean_separation=(surface.h_max + separation) / 2,
        reading=options["reading"].name,
        tier=tier_name(options["tier"]),
        islands=None,
        **fields,
    )


def _by_parameter(
    surface: Surface, sums: FloatArray, pairs: Pairs, stress: FloatArray
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Chain rule from H, log(zeta_1), compression and peak to the gap and the surface's own parameters."""
    shape = sums.shape[:-2]
    hurst, zeta_1, rms_over_s, compression, peak, _ = (field.reshape(shape) for field in pairs)
    h_rms, q0, q1 = surface.h_rms, surface.q0, surface.q1
    # log(s/h_rms) by H and by log(zeta_1): (h_rms/s)^2 = 1 - zeta_1^(-2H)
    lift = -(1 - rms_over_s**2) / rms_over_s**2
    answers = []
    for number in range(2):
        value, by_H, by_zeta, by_compression, by_peak, _ = np.moveaxis(sums[..., number, :], -1, 0)
        scale: Any = 1.0
        own = np.zeros_like(value)
        if number == 0:
            # force carries q0 s
            scale = stress
            by_H = by_H + value * lift * np.log(zeta_1)
            by_zeta = by_zeta + value * lift * hurst
            own = value
        found = {
            "separation": -by_compression / h_rms,
            "hurst": by_H,
            "q0": (own - by_zeta) / q0,
            "q1": by_zeta / q1,
            "h_rms": (own - compression * by_compression - peak * by_peak) / h_rms,
            "h_max": (by_compression + by_peak) / h_rms,
        }
        answers.append({name: (scale * slope)[()] for name, slope in found.items()})
    return answers[0], answers[1]
