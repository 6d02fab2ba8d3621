"""`contact`: a surface pressed against a flat by any theory, at a given separation, pressure or area."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.bodies.bodies import Bodies, BodiesInUnits, after
from mbma_tables.common.arguments import (
    FloatArray,
    any_labelled,
    broadcast_shape,
    describe_entries,
    hinted,
    require,
    spread,
)
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.contacts.quantities.interface import NOTHING_BETWEEN, Interface
from mbma_tables.contacts.question import GAPS, Question, both_separations
from mbma_tables.contacts.result import Contact, Setup
from mbma_tables.surfaces.any_surface import AnySurface, apply_to_surface
from mbma_tables.theories import resolve
from mbma_tables.theories.base import (
    Gaps,
    Solved,
    Theory,
    UserTheory,
    require_domain,
)

# what a theory gives at once; the other quantities follow
ANSWERED = ("separation", "mean_separation", "pressure", "area", "error")


@hinted
def contact(
    surface: AnySurface,
    bodies: Bodies | ArrayLike | str = 1.0,
    *,
    separation: ArrayLike | None = None,
    mean_separation: ArrayLike | None = None,
    pressure: ArrayLike | None = None,
    area: ArrayLike | None = None,
    largest_pressure: ArrayLike | str | None = None,
    theory: str | Theory | UserTheory | None = None,
) -> Contact:
    """Contact of a surface at a given separation, pressure or area.

    Parameters
    ----------
    surface : Surface
        One surface or a batch; it broadcasts against the given quantity.
    bodies : Bodies or array_like or str
        The bodies in contact: `Bodies` with their hardness, conductivity and so on; or
        their effective modulus, "100 GPa"; or a metal or a pair of metals by name, ("steel
        4140 hard", "aluminium 6061 hard"). Pressures are in the unit of the modulus; with
        1, the default, they are over E*. With a hardness the theory's elastic result is
        corrected by `mbma_tables.theories.yielding`; u is then the mean gap with yielded
        points flattened.
    separation : array_like
        d between the rigid plane and the mid-plane, in the surface's unit or, as text, with
        its own ("0.8 um"); at least -h_max (full compression). Above h_max the bodies are
        apart: pressure and area are zero, and u is d. Exactly one of the four is given.
    mean_separation : array_like
        u = (h_max + d)/2 (50) [length].
    pressure : array_like
        F/A0 in the unit of the modulus, or as text with its own; on the branch that begins
        at first contact. Each of several pressures is reached by first loading.
    area : array_like
        A/A0, on the same branch.
    largest_pressure : array_like or str, optional
        The largest pressure so far, where a hardness is given: contacts below it are those
        of unloading and reloading, after what yielded under it. `Bodies` may have it, too.
        Default: first loading.
    theory : str or theory, optional
        By name, one of `mbma_tables.theories.THEORIES`, or an object: one of
        `mbma_tables.theories` with its own options, such as ``Mbma(island_model="exact")``,
        or any with a `name` and ``answer(surface, u)``. Default, here and wherever a theory
        can be given: "mbma" at a `separation`, its coordinate; otherwise "simulated" for a
        map of at least 64 points a side, and "calibrated" for any other surface. A raw map
        is simulated at a cut-off that the `surface` of the contact names (`resolution`).

    Returns
    -------
    Contact
        Every quantity of `mbma_tables.contacts.quantities` by its name, with its model uncertainty
        and validity.

    Raises
    ------
    InputError, OutOfRangeError
        For NaN, infinite or empty input, separations below -h_max, islands that no table
        covers, pressures and areas that the branch of first contact does not reach.
    ConvergenceError
        Where the accuracy was not reached; `mask` is true for these entries.

    Examples
    --------
    >>> from mbma_tables import Bodies, Surface, contact
    >>> face = Surface(hurst=0.8, q0=0.06, q1=3.0, h_rms=1.0, h_max=3.5, unit="um")
    >>> pressed = contact(face, "100 GPa", pressure="10 MPa")
    >>> f"{pressed.area:.3%}, {pressed.mean_separation:.3f} um, {pressed.stiffness:.3g} GPa/um"
    '0.091%, 2.720 um, 0.0339 GPa/um'
    >>> metals = contact(face, ("steel 4140 hard", "aluminium 6061 hard"), pressure="10 MPa")
    >>> f"{metals.area:.2%}, {metals.yielded:.0%} of it yields; {metals.solid_conductance:.2g} W/(m^2 K)"
    '1.05%, 100% of it yields; 1.1e+05 W/(m^2 K)'

    The paper's model at separations d:

    >>> surface = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0)  # um
    >>> at_gaps = contact(surface, 100e3, separation=[1.0, 0.5])  # MPa
    >>> [f"{pressure:.4g} MPa on {area:.3%}" for pressure, area in zip(at_gaps.pressure, at_gaps.area)]
    ['7.982 MPa on 0.287%', '20.28 MPa on 0.735%']
    >>> bool((at_gaps.error < 1e-8).all())
    True
    """
    candidates = {
        "separation": separation,
        "mean_separation": mean_separation,
        "pressure": pressure,
        "area": area,
    }
    if largest_pressure is not None:
        bodies = after(Bodies.of(bodies), largest_pressure)
    return contact_of(surface, bodies, candidates, theory)


def contact_of(
    surface: AnySurface,
    bodies: Any,
    candidates: Mapping[str, Any],
    theory: str | Theory | UserTheory | None,
    interface: Interface = NOTHING_BETWEEN,
) -> Contact:
    """The contact at one given quantity, with what a joint has between its bodies."""
    in_units = (
        bodies
        if isinstance(bodies, BodiesInUnits)
        else Bodies.of(bodies).in_units(surface)
    )
    question = Question.of(in_units.units, candidates)
    chosen = resolve(theory, surface, question.name)
    surface = chosen.surface_of(surface)
    setup = Setup(surface, in_units, chosen, interface)
    numbers = in_units.numbers
    if any_labelled(surface, question.value, *numbers.values()):
        return _of_labelled(setup, question)
    solved, gaps = _solved(setup, question, numbers)
    values = {
        "pressure": solved.pressure,
        "area": solved.area,
        "error": solved.error,
        "separation": gaps.separation[()],
        "mean_separation": gaps.mean_separation[()],
    }
    return Contact(setup, values, solved.islands, solved.answer, solved.loaded)


def contact_where_finite(
    surface: AnySurface, bodies: BodiesInUnits, separation: FloatArray, theory: Any
) -> Contact:
    """The contact of one surface at separations, NaN where the theory's force has no bound, as Persson's at u = 0."""
    from mbma_tables.theories.users import answer_where_finite

    setup = Setup(surface, bodies, resolve(theory, surface))
    own = setup.theory_of(bodies)
    _, u = both_separations("separation", separation, surface.h_max, own.ends_at_h_max)
    answer = answer_where_finite(own, surface, u)
    return Contact(setup, {"separation": separation, "mean_separation": u}, answer=answer)


def _solved(
    setup: Setup, question: Question, numbers: Mapping[str, Any]
) -> tuple[Solved, Gaps]:
    """The contact of plain arrays at a given quantity, and its separations.

    The numbers of the bodies, `bodies.numbers`, are checked already, and given since the
    caller has made them.
    """
    bodies = setup.bodies
    surface = setup.surface
    modulus = np.asarray(bodies.E_star)
    cap = np.asarray(bodies.hardness if bodies.yields else np.inf)
    shape = broadcast_shape(
        **{question.name: question.value, "surface": surface.h_rms},
        **numbers,
    )
    if np.shape(question.value) != shape:
        question = Question(question.name, np.broadcast_to(question.value, shape))
    if modulus.shape != shape:
        modulus = np.broadcast_to(modulus, shape)
    theory = setup.theory_of(bodies)
    gaps = _separations(setup, theory, surface, question, modulus, cap)
    return theory.solved(surface, gaps, modulus), gaps


def _separations(
    setup: Setup,
    theory: Theory,
    surface: AnySurface,
    question: Question,
    modulus: FloatArray,
    cap: FloatArray,
) -> Gaps:
    """Both separations for the given quantity."""
    h_max = np.asarray(surface.h_max)
    if setup.bodies.largest is not None:
        h_max = theory.highest(surface)
    name = question.name
    gap = question.value
    is_gap = name in GAPS
    lighter = None
    question.require_in_range(h_max, setup.bodies.adhesion is not None)
    if not is_gap:
        gap, lighter = _inverted(setup, theory, surface, question, modulus, cap)
        name = "mean_separation"
    d, u = both_separations(name, gap, h_max, theory.ends_at_h_max)
    if is_gap:
        require_domain(theory, surface, name, gap, u)
    return Gaps(np.asarray(d), np.asarray(u), lighter)


def _inverted(
    setup: Setup,
    theory: Theory,
    surface: AnySurface,
    question: Question,
    modulus: FloatArray,
    cap: FloatArray,
) -> tuple[FloatArray, Any]:
    """Mean separations at pressures or areas."""
    name = question.name
    given = question.value
    with np.errstate(over="ignore"):  # what is infinite is refused as too large
        wanted = given / modulus if name == "pressure" else given
    try:
        if name == "pressure":
            return theory.at_force(surface, wanted)
        return theory.mean_separation_at(surface, name, wanted), None
    except OutOfRangeError as fault:
        refused = fault
    # outside of the handler, so that users see one error and not two
    if name == "pressure":
        _refuse_pressure(setup, theory, surface, given, modulus, cap)
    raise refused


def _refuse_pressure(
    setup: Setup,
    theory: Theory,
    surface: AnySurface,
    given: FloatArray,
    modulus: FloatArray,
    cap: FloatArray,
) -> None:
    """Errors for pressures above the hardness or the theory's largest, in the unit of the pressures."""
    limits = [(cap, "the hardness")]
    with contextlib.suppress(
        OutOfRangeError
    ):  # at full compression Persson's theory has no finite force
        end_of = "pressure" if theory.ends_at_h_max else "area"
        deepest = theory.interval(surface, end_of)[0]
        largest = modulus * theory.answer(surface, deepest).pressure
        limits.append((largest, f"what theory {theory.name!r} reaches on this surface"))
    unit = setup.bodies.units.stress
    name = "pressure" if unit in (None, "1") else f"pressure [{unit}]"
    for limit, meaning in limits:
        end = spread(limit, given.shape)
        require(
            name,
            given,
            given <= end,
            f"at most {meaning}, {describe_entries(end, given > end)}",
        )


def _of_labelled(setup: Setup, question: Question) -> Contact:
    """The contact of DataArrays, lazy where they are."""
    bodies = setup.bodies

    def solve(block: AnySurface, given: Any, *numbers: Any) -> tuple[Any, ...]:
        own = dataclasses.replace(
            setup, surface=block, bodies=bodies.at(*numbers).checked()
        )
        solved, gaps = _solved(own, question.of_block(given), own.bodies.numbers)
        answer = solved.pressure, solved.area, solved.error
        return (gaps.separation, gaps.mean_separation, *answer)

    name = question.name
    value = question.value
    arrays = {name: value, **bodies.numbers}
    outputs = apply_to_surface(solve, setup.surface, arrays, len(ANSWERED))
    contact = Contact(setup, dict(zip(ANSWERED, outputs, strict=True)))
    # a separation that was given keeps its name and attributes
    contact.describe({name: value} if question.is_gap else {})
    return contact
