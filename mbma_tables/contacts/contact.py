"""`contact`: pressure, area and stiffness of a surface by any theory, at a given separation, pressure or area."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import (
    FloatArray,
    any_labelled,
    broadcast_shape,
    checked_hardness,
    describe_entries,
    finite_array,
    hinted,
    positive_array,
    require,
    spread,
)
from mbma_tables.common.errors import InputError, OutOfRangeError
from mbma_tables.common.units import modulus_and_units
from mbma_tables.contacts.result import Contact
from mbma_tables.contacts.source import Source, named
from mbma_tables.materials import Metal, Pair, bodies, hardness_in
from mbma_tables.surfaces.any_surface import AnySurface, apply_to_surface
from mbma_tables.theories import (
    OPTIONS,
    THEORIES,
    default_theory,
    get_theory,
    theory_name,
)
from mbma_tables.theories.base import Theory, UserTheory
from mbma_tables.theories.mbma.island_models import QUANTITIES, AnyModel
from mbma_tables.theories.mbma.theory import Mbma
from mbma_tables.theories.mbma.variants import Variant


@hinted
def contact(
    surface: AnySurface,
    *,
    separation: ArrayLike | None = None,
    mean_separation: ArrayLike | None = None,
    pressure: ArrayLike | None = None,
    area: ArrayLike | None = None,
    theory: str | Theory | UserTheory | None = None,
    hardness: ArrayLike | str | None = None,
    materials: str | Metal | Pair | Sequence[str | Metal] | None = None,
    island_model: str | AnyModel = "universal",
    variant: str | Variant = "reported",
    E_star: ArrayLike = 1.0,
    rtol: float = 1e-8,
    outside: str = "raise",
) -> Contact:
    """Pressure, real contact area and stiffness of a surface at given separation, pressure or area.

    Parameters
    ----------
    surface : Surface
        One surface or a batch; it broadcasts against the given quantity.
    separation : array_like
        d between the rigid plane and the mid-plane, in the surface's unit or, as text, with
        its own ("0.8 um"); at least -h_max (full compression). Above h_max the bodies are
        apart: pressure and area are zero, and u is d. Exactly one of the four is given.
    mean_separation : array_like
        u = (h_max + d)/2 (50) [length].
    pressure : array_like
        F/A0 in the unit of `E_star`, or as text with its own; on the branch that begins at
        first contact.
    area : array_like
        A/A0, on the same branch.
    theory : str or theory, optional
        By name, one of `mbma_tables.theories.THEORIES`, or an object: one of
        `mbma_tables.theories`, or any with a `name` and ``answer(surface, u)``. Default,
        here and wherever a theory can be given: "mbma" at a `separation`, its coordinate,
        or where an option of MBMA is given (`island_model`, `variant`, `rtol`, `outside`);
        otherwise "simulated" for a resolved map of at most 2^18 points, and "calibrated"
        for any other surface.
    hardness : array_like or str, optional
        Largest pressure p_m that the softer body supports, in the unit of `E_star` (over E*
        if that is 1), or a text that `mbma_tables.materials.hardness` accepts: "1.5 GPa",
        "200 HV", "58 HRC", "aluminium 6061 hard". The theory's elastic result is corrected
        by `mbma_tables.theories.yielding`; u is then the mean gap with yielded points
        flattened. Each of several entries is a first loading, also after a larger one.
        Default: that of the softer of `materials`, or infinite. If it is infinite, nothing
        yields, and results at which the named metals (without names: all metals) would
        yield are not `valid`.
    materials : str, pair of str, optional
        Metals in contact, one of `mbma_tables.materials.METALS` each, or `Metal` objects;
        in place of `E_star`.
    island_model : {"universal", "island4d", "exact", "formula", "rigid"} or island model
        MBMA's island model: a table, the full solver, a closed form, or spheres that do not
        deform; or an object: a table from `open_table`, or a user-defined model with a
        `name` and ``answer(X, mu)``.
    variant : {"reported", "printed", "fitted"} or Variant
        Variant of the paper's equations in MBMA.
    E_star : array_like or str
        Effective modulus, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2, or text with its unit,
        "100 GPa"; pressure is in it.
    rtol : float
        Requested relative error of MBMA's sums, in [1e-11, 0.1]; `error` includes that of a table.
    outside : {"raise", "exact", "nan"}
        For islands outside MBMA's table: raise an error, use the exact solver, or return NaN.

    Returns
    -------
    Contact

    Raises
    ------
    InputError, OutOfRangeError
        For NaN, infinite or empty input, separations below -h_max, islands that no table
        covers, pressures and areas that the branch of first contact does not reach.
    ConvergenceError
        Where the accuracy was not reached; `mask` is true for these entries.

    Examples
    --------
    >>> from mbma_tables import Surface, contact
    >>> surface = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0)  # um
    >>> found = contact(surface, separation=[1.0, 0.5], E_star=100e3)  # MPa
    >>> [f"{pressure:.4g} MPa on {area:.3%}" for pressure, area in zip(found.pressure, found.area)]
    ['7.982 MPa on 0.287%', '20.28 MPa on 0.735%']
    >>> bool((found.error < 1e-8).all())
    True
    >>> joint = contact(surface, pressure=10.0, E_star=100e3)
    >>> f"{joint.mean_separation:.3f} um, {joint.stiffness:.1f} MPa/um by theory {joint.theory!r}"
    "2.048 um, 29.4 MPa/um by theory 'calibrated'"
    >>> face = Surface(hurst=0.8, q0=0.06, q1=3.0, h_rms=1.0, h_max=3.5, unit="um")
    >>> metals = ("steel 4140 hard", "aluminium 6061 hard")
    >>> joint = contact(face, pressure="10 MPa", theory="calibrated", materials=metals)
    >>> f"{joint.area:.2%}, {joint.yielded:.0%} of it yields; {joint.conductance():.2g} W/(m^2 K)"
    '1.05%, 100% of it yields; 1.1e+05 W/(m^2 K)'
    """
    by, value = one_known(
        separation=separation,
        mean_separation=mean_separation,
        pressure=pressure,
        area=area,
    )
    pair = None
    if materials is not None:
        E_star, hardness, pair = bodies(materials, E_star, hardness)
    E_star, units = modulus_and_units(E_star, surface)
    value, stated = units.number(by, value), hardness is not None
    hardness = hardness_in(units, hardness) if stated else np.inf
    chosen = chosen_theory(
        surface,
        theory,
        by,
        island_model=island_model,
        variant=variant,
        rtol=rtol,
        outside=outside,
    )
    # what is no number is refused where it is checked
    known = np.asarray(hardness) if isinstance(hardness, float | np.ndarray) else None
    yields = stated and (
        known is None
        or known.dtype.kind != "f"
        or not known.size
        or bool((known != np.inf).any())
    )
    source = Source(
        chosen, surface, E_star, hardness, units, yields, materials=pair, stated=stated
    )
    if not any_labelled(surface, value, E_star, hardness):
        source, fields = _contact(surface, value, E_star, hardness, by, source)
    else:
        fields = _of_labelled(surface, value, E_star, hardness, by, source)
    fields |= {
        "theory": chosen.name,
        "variant": chosen.variant_name,
        "island_model": chosen.island_model_name,
    }
    return Contact(**fields, _source=source)


def chosen_theory(
    surface: AnySurface,
    theory: str | Theory | UserTheory | None,
    by: str | None = None,
    **options: Any,
) -> Theory:
    """The requested theory, by default that of `theory_name`, with MBMA's `options`; other theories reject these."""
    try:
        given = (
            []
            if options == OPTIONS
            else [name for name, value in options.items() if value != OPTIONS[name]]
        )
    except ValueError:
        raise InputError(
            f"{', '.join(options)} take one value each, not an array"
        ) from None
    named = theory_name(surface, theory, by, **options) if theory is None else theory
    if isinstance(named, str) and named in THEORIES:
        if not given:
            return default_theory(named)
        if named == "mbma":
            return Mbma(**options)
    if given:
        raise InputError(
            f"{', '.join(given)}: options of theory 'mbma' alone, given by its name"
        )
    return get_theory(named, surface)


def one_known(**given: Any) -> tuple[str, Any]:
    """The one quantity that is given, its name first."""
    known = []
    for name, value in given.items():
        if value is not None:
            known.append(name)
    if len(known) != 1:
        raise InputError(
            f"give exactly one of {', '.join(given)}; got {' and '.join(known) or 'none'}"
        )
    return known[0], given[known[0]]


def _contact(
    surface: AnySurface, value: Any, E_star: Any, hardness: Any, by: str, source: Source
) -> tuple[Source, dict[str, Any]]:
    """Fields of `contact` of plain arrays, and the source with the theory's answer."""
    asked, modulus = finite_array(by, value), positive_array("E_star", E_star)
    cap = checked_hardness(hardness) if source.yields else np.asarray(np.inf)
    shape = broadcast_shape(
        **{by: asked, "surface": surface.h_rms, "E_star": modulus, "hardness": cap}
    )
    value, E_star = spread(asked, shape), spread(modulus, shape)
    theory: Any = source.theory
    if source.yields:
        theory = theory.with_hardness(cap, modulus)
    places, lighter = _places(surface, value, E_star, cap, by, theory, source)
    if isinstance(theory, Mbma):
        found = theory.totals(surface, places["separation"], E_star)
        fields = (
            dict(zip((*QUANTITIES, "error", "islands"), found[:4], strict=True)) | places
        )
    else:
        u = np.asarray(places["mean_separation"])
        loaded = theory.loaded(surface, u, lighter) if source.yields else None
        found = theory.answer(surface, u) if loaded is None else loaded.answer
        source = dataclasses.replace(source, answer=found, loaded=loaded)
        fields = {
            "pressure": (E_star * found.pressure)[()],
            "area": found.area[()],
            "islands": None,
        } | places
        fields["error"] = spread(found.error, np.shape(found.pressure))[()]
    return source, fields


def _places(
    surface: AnySurface,
    asked: FloatArray,
    modulus: FloatArray,
    cap: FloatArray,
    by: str,
    theory: Any,
    source: Source,
) -> tuple[dict[str, Any], Any]:
    """Both separations for the given quantity; with a hardness also `lighter` of `Yielding.loaded`."""
    h_max, lighter = np.asarray(surface.h_max), None
    if by == "separation":
        require(
            by,
            asked,
            asked >= -h_max,
            "at least -h_max, where the model ends at full compression",
        )
    else:
        require(by, asked, asked >= 0, "at least 0")
    if by in ("separation", "mean_separation"):
        average = (h_max + asked) / 2 if by == "separation" else asked
    else:
        with np.errstate(over="ignore"):  # what is infinite is refused as too large
            wanted = asked / modulus if by == "pressure" else asked
        try:
            if by == "pressure" and source.yields:
                average, lighter = theory.pressed(surface, wanted)
            else:
                average = theory.mean_separation_at(surface, by, wanted)
        except OutOfRangeError:
            if (
                by == "pressure"
            ):  # above the hardness or the theory's largest, in its own unit
                unit, limits = source.units.stress, [(cap, "the hardness")]
                with contextlib.suppress(
                    OutOfRangeError
                ):  # at full compression Persson's theory has no finite force
                    deepest = theory.interval(
                        surface, "pressure" if theory.ends_at_h_max else "area"
                    )[0]
                    reached = modulus * theory.answer(surface, deepest).pressure
                    limits.append(
                        (reached, f"what theory {theory.name!r} reaches on this surface")
                    )
                for limit, what in limits:
                    name, end = (
                        "pressure" if unit in (None, "1") else f"pressure [{unit}]",
                        spread(limit, asked.shape),
                    )
                    require(
                        name,
                        asked,
                        asked <= end,
                        f"at most {what}, {describe_entries(end, asked > end)}",
                    )
            raise
    gap = asked if by == "separation" else 2 * average - h_max
    if theory.ends_at_h_max:
        # without contact, both are the distance of the mean planes
        average = np.maximum(average, gap) if by == "separation" else average
        gap = np.minimum(gap, average)
    return {"separation": gap[()], "mean_separation": average[()]}, lighter


def _of_labelled(
    surface: AnySurface, value: Any, E_star: Any, hardness: Any, by: str, source: Source
) -> dict[str, Any]:
    """Fields of `contact` of DataArrays, lazily where they are."""
    names = ("separation", "mean_separation", *QUANTITIES, "error")

    def answer(block: AnySurface, asked: Any, modulus: Any, cap: Any) -> tuple[Any, ...]:
        _, found = _contact(block, asked, modulus, cap, by, source)
        return tuple(found[name] for name in names)

    outputs = apply_to_surface(
        answer, surface, {by: value, "E_star": E_star, "hardness": hardness}, len(names)
    )
    fields: dict[str, Any] = {
        name: named(found, name, source.units)
        for found, name in zip(outputs, names, strict=True)
    }
    # a separation keeps its name and attributes
    return fields | {"islands": None} | ({} if by in QUANTITIES else {by: value})
