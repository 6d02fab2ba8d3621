"""A contact law as rows for other codes: what it is, in which units, and rows chosen by their error.

Overclosure is c = h_max - u with the mean separation u = (h_max + d)/2 (50): zero at first contact, rising as bodies
approach, so that -dp/du = dp/dc. Linear interpolation over a step h has an error of about h^2 p''/8. Rows are spaced so
that this is the same fraction of p everywhere above a floor, and are then moved by half of it, so that the error has
both signs.
"""

from __future__ import annotations

import bisect
import dataclasses

import numpy as np

from mbma_tables import __version__
from mbma_tables.arguments import FloatArray, number_in, whole_number_in
from mbma_tables.errors import InputError
from mbma_tables.export.text import number
from mbma_tables.surfaces.readings import Reading
from mbma_tables.surfaces.surface import PARAMETERS, Surface
from mbma_tables.theories.contact import contact
from mbma_tables.theories.law import contact_law
from mbma_tables.theories.mbma import Mbma
from mbma_tables.theories.protocol import Theory, UserTheory
from mbma_tables.theories.registry import get_theory
from mbma_tables.totals.conductance import conductance
from mbma_tables.totals.law_protocol import ContactLaw
from mbma_tables.units import Units, in_unit, resolve

QUANTITIES = ("pressure", "conductance")
FLOOR = 1e-3  # of the largest pressure: below it, errors are relative to this and not to the pressure
LOOKED_AT = 200  # compressions at which validity and scatter are looked at
FINE = 20_001  # points at which the error of a choice of rows is measured
MIN_ROWS, MAX_ROWS = 3, 5000
ROUNDS = 40  # of making the errors of chords equal
LAW_RTOL = 1e-8
MIN_STEP = 1e-10  # some readers change rows that are closer than this in the file's unit


@dataclasses.dataclass(frozen=True)
class LawTable:
    """Rows of a contact law, ready to be written.

    Attributes
    ----------
    x, y : ndarray
        Overclosure and pressure, or pressure and conductance; both start at zero and rise.
    x_name, y_name, x_unit, y_unit : str
    largest_error : float
        Largest relative error of linear interpolation between the rows as written against the model, where y
        is above `FLOOR` of its largest.
    comments : tuple of str
        What a reader of the file must know.
    theory : str
        Whose law it is.
    """

    x: FloatArray
    y: FloatArray
    x_name: str
    y_name: str
    x_unit: str
    y_unit: str
    largest_error: float
    comments: tuple[str, ...]
    theory: str = "mbma"


def rounded(values: FloatArray) -> FloatArray:
    """Numbers as a file holds them."""
    return np.array([float(number(value)) for value in values])


def spread(x: FloatArray, y: FloatArray, count: int) -> FloatArray:
    """Places of `count` rows along x whose chords have equal errors relative to max(y, floor), by iteration."""
    scale = np.maximum(y, FLOOR * y[-1])
    # logarithmic in y above the floor to begin with, linear below
    filled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(y)) / scale[1:])]) + np.linspace(0, 3, x.size)
    places = _cut(filled, x, count)
    best, found = np.inf, places
    for _ in range(ROUNDS):
        chords = np.interp(places, x, y)
        step = np.clip(np.searchsorted(places, x, side="right") - 1, 0, count - 2)
        error = np.zeros(count - 1)
        np.maximum.at(error, step, np.abs(np.interp(x, places, chords) - y) / scale)
        if error.max() < best:
            best, found = error.max(), places
        # the error of a chord falls like the square of its length
        root = np.sqrt(error + 1e-3 * error.max())
        places = _cut(np.concatenate([[0.0], np.cumsum(root)]), places, count)
    return found


def _cut(filled: FloatArray, x: FloatArray, count: int) -> FloatArray:
    """`count` places between which `filled` grows by equal amounts."""
    places: FloatArray = np.interp(np.linspace(filled[0], filled[-1], count), filled, x)
    places[0], places[-1] = x[0], x[-1]
    return places


def chord_error(x: FloatArray, y: FloatArray, fine_x: FloatArray, fine_y: FloatArray) -> float:
    """Largest relative error of linear interpolation where y is above the floor."""
    kept = fine_y > FLOOR * fine_y[-1]
    return float(np.abs(np.interp(fine_x[kept], x, y) / fine_y[kept] - 1).max())


def balanced(x: FloatArray, y: FloatArray, fine_x: FloatArray, fine_y: FloatArray) -> FloatArray:
    """Rows moved by half of the error of the chords beside them, which halves the largest error."""
    scale = np.maximum(fine_y, FLOOR * fine_y[-1])
    over = (np.interp(fine_x, x, y) - fine_y) / scale
    step = np.clip(np.searchsorted(x, fine_x, side="right") - 1, 0, x.size - 2)
    high, low = np.zeros(x.size - 1), np.zeros(x.size - 1)
    np.maximum.at(high, step, over)
    np.minimum.at(low, step, over)
    middle = (high + low) / 2
    beside = np.concatenate([[middle[0]], (middle[1:] + middle[:-1]) / 2, [middle[-1]]])
    moved = np.maximum(y - beside * np.maximum(y, FLOOR * y[-1]), 0.0)
    moved[0] = y[0]
    # pressure rises; conductance may fall where the model's stiffness jumps
    if (np.diff(fine_y) >= 0).all():
        moved = np.maximum.accumulate(moved)
    result: FloatArray = moved
    return result


def _curve(
    law: ContactLaw, quantity: str, max_overclosure: float, k_s: float, E_star: float
) -> tuple[FloatArray, FloatArray]:
    """The law on fine points."""
    # squares: fine where p is a high power of the overclosure
    c = max_overclosure * np.linspace(0, 1, FINE) ** 2
    d = law.h_max - 2 * c
    pressure, stiffness = np.asarray(law.force(d)), np.asarray(law.stiffness_mean(d))
    pressure[0] = stiffness[0] = 0.0
    if quantity == "pressure":
        return c, pressure
    rises = np.concatenate([[True], np.diff(pressure) > 0])
    return pressure[rises], np.asarray(conductance(stiffness, k_s, E_star))[rises]


def describe_law(
    surface: Surface,
    E_star: float | str,
    *,
    length_unit: str | None = None,
    stress_unit: str | None = None,
    quantity: str = "pressure",
    rows: int | None = None,
    rtol: float | None = None,
    largest_overclosure: float | str | None = None,
    conductivity: float | None = None,
    conductivity_unit: str | None = None,
    reading: str | Reading = "reported",
    evenly: bool = False,
    theory: str | Theory | UserTheory = "mbma",
) -> LawTable:
    """A contact law as rows for a code that interpolates linearly.

    Parameters
    ----------
    surface : Surface
        One surface.
    E_star : float or str
        Effective modulus in `stress_unit`, or with its unit: 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2.
    length_unit, stress_unit : str, optional
        Units of the rows. A surface or modulus that has another one is converted; one that has none is in these.
    quantity : {"pressure", "conductance"}
        Pressure against overclosure, or conductance against pressure.
    rows : int, optional
        How many; else as few as `rtol` needs, 1e-3 where neither is given.
    rtol : float, optional
        Largest relative error of the interpolation where the result is above a thousandth of its largest.
    largest_overclosure : float or str, optional
        Where the rows end, in the rows' unit or with its own; else at full compression, or where the force turns down.
    conductivity : float, optional
        k_s = 2 k1 k2/(k1 + k2) for conductance, thermal or electrical, with its unit.
    reading : str or Reading
        Of the MBMA model.
    theory : str or theory
        As for `contact`.
    evenly : bool
        Equally spaced rows instead, for comparison.

    Raises
    ------
    InputError, OutOfRangeError
        For a batch of surfaces, missing units, a range beyond the law, and rows that cannot meet `rtol`.

    Examples
    --------
    >>> road = Surface.named("concrete")
    >>> law = describe_law(road, "13.3 MPa", rows=20)
    >>> law.y_name, law.y_unit, law.x_unit, round(law.largest_error, 3)
    ('pressure', 'MPa', 'mm', 0.013)
    """
    surface = in_unit(surface, length_unit)
    plain, stress_unit = resolve({"E_star": E_star}, stress_unit, "stress")
    length_unit = _known("length_unit", surface.unit)
    stress_unit = _known("stress_unit", stress_unit)
    if surface.shape != ():
        raise InputError("a contact law is of one surface, not of a batch")
    if quantity not in QUANTITIES:
        raise InputError(f"quantity must be one of {QUANTITIES}, got {quantity!r}")
    modulus = number_in("E_star", plain["E_star"], 1e-300, 1e300)
    end = Units(length_unit).number("overclosure", largest_overclosure)
    if rows is not None and rtol is not None:
        raise InputError("rows and rtol are both given: give one of them")
    k_s, names = 1.0, ("overclosure", "pressure", length_unit, stress_unit)
    if quantity == "conductance":
        if conductivity is None or not conductivity_unit:
            raise InputError("conductance needs conductivity, k_s = 2 k1 k2/(k1 + k2), and conductivity_unit")
        if not conductivity_unit.isprintable():
            raise InputError(f"conductivity_unit is not printable: {conductivity_unit!r}")
        k_s = number_in("conductivity", conductivity, 1e-300, 1e300)
        names = ("pressure", "conductance", stress_unit, f"{conductivity_unit}/{length_unit}")
    law = contact_law(surface, LAW_RTOL, reading=reading, E_star=modulus, theory=theory)
    fine_x, fine_y = _curve(law, quantity, _range_end(law, end), k_s, modulus)

    def with_rows(count: int) -> tuple[FloatArray, FloatArray, float]:
        places = np.linspace(0, fine_x[-1], count) if evenly else spread(fine_x, fine_y, count)
        x = rounded(places)
        y = np.interp(x, fine_x, fine_y)
        y = rounded(y if evenly else balanced(x, y, fine_x, fine_y))
        return x, y, chord_error(x, y, fine_x, fine_y)

    if rows is not None:
        x, y, error = with_rows(whole_number_in("rows", rows, MIN_ROWS, MAX_ROWS))
    else:
        asked = number_in("rtol", 1e-3 if rtol is None else rtol, 1e-7, 0.5)
        # the error falls with the number of rows
        fewest = bisect.bisect_left(range(MAX_ROWS + 1), -asked, MIN_ROWS, key=lambda count: -with_rows(count)[2])
        if fewest > MAX_ROWS:
            raise InputError(f"rtol = {asked:g} needs more than {MAX_ROWS} rows under linear interpolation")
        x, y, error = with_rows(fewest)
    if (np.diff(x) <= (MIN_STEP if quantity == "pressure" else 0.0)).any():
        raise InputError(
            f"rows are closer than {MIN_STEP:g} {length_unit}, which some readers cannot tell apart: "
            "take fewer rows or a smaller unit of length"
        )
    own = Mbma(reading=reading) if theory == Mbma.name else get_theory(theory)
    comments = _comments(surface, law, modulus, names, x, error)
    known = _validity(surface, law, own, float(_range_end(law, end)), stress_unit)
    return LawTable(x, y, *names, error, (*comments, *known), law.theory)


def _known(name: str, unit: str | None) -> str:
    if unit is None:
        raise InputError(f"{name} is missing: a law without units is read wrongly sooner or later")
    return unit


def _range_end(law: ContactLaw, asked: float | None) -> float:
    """The largest overclosure: as asked, or at full compression, or where the force turns down."""
    turn = law.turning_point
    end = (law.h_max - (law.lowest if turn is None else turn)) / 2
    found = end if asked is None else float(asked)
    if not 0 < found <= end:
        why = "full compression" if turn is None else "where the force of this surface turns down"
        raise InputError(f"largest_overclosure must be in (0, {end:g}], up to {why}, got {found:g}")
    return found


def _comments(
    surface: Surface, law: ContactLaw, E_star: float, names: tuple[str, str, str, str], x: FloatArray, error: float
) -> tuple[str, ...]:
    numbers = ", ".join(f"{name} = {float(getattr(surface, name)):.10g}" for name in PARAMETERS)
    unit, end = "the unit of length of the conductance", "the same"
    if names[0] == "overclosure":
        unit, end = names[2], "full compression"
        if law.turning_point is not None:
            end = "where the force of this surface turns down; nothing is known beyond"
    model = f"MBMA model, reading {law.reading!r}" if law.theory == Mbma.name else f"theory {law.theory!r}"
    return (
        f"Contact law of a rough surface, {model}; mbma_tables {__version__}",
        f"{names[1]} [{names[3]}] against {names[0]} [{names[2]}]",
        f"surface: {numbers}; lengths in {unit}",
        f"E* = {E_star:.10g}, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2; pressure is force over nominal area",
        "overclosure c = h_max - u, u = (h_max + d)/2 the mean separation, d the separation from the mid-plane;",
        "c = 0 is first contact: bodies meet where their mean planes are h_max apart",
        f"range: {names[0]} from 0 to {x[-1]:.10g}, {end}",
        f"{x.size} rows; largest error of linear interpolation {error:.1e}, relative, above 1e-3 of the largest value",
        f"the law is within {law.error:.1e} of its theory, in pressure and area",
    )


def _validity(surface: Surface, law: ContactLaw, theory: Theory, end: float, stress_unit: str) -> tuple[str, ...]:
    """Lines that say where the law holds, how far simulations scatter about it, and where its numbers come from."""
    u = np.linspace(law.h_max, law.h_max - end, LOOKED_AT + 1)[1:]
    found = contact(surface, mean_separation=u, E_star=law.E_star, theory=theory)
    pressure = np.asarray(law.force(u=u))
    lines = []
    for reason, mask in found.reasons.items():
        first, last = pressure[mask].min(), pressure[mask].max()
        lines.append(f"not valid from p = {first:.4g} to {last:.4g} {stress_unit}: {reason}")
    if law.softening is not None:
        lines.append(
            f"softening: stiffness falls with compression from c = {law.h_max - law.softening:.4g}, "
            f"p = {float(law.force(u=law.softening)):.4g} {stress_unit} on, which no simulation shows"
        )
    if law.highest < np.inf:
        lines.append(
            f"the theory has no last contact: its pressure at c = 0, {float(law.force(law.h_max)):.4g} {stress_unit}, "
            "is written as zero"
        )
    scatter = np.asarray(found.scatter)
    known = np.flatnonzero(np.isfinite(scatter))
    places = known[np.linspace(0, known.size - 1, 5).astype(int)] if known.size else known
    listed = ", ".join(f"{scatter[k]:.2g} at {pressure[k]:.3g}" for k in places)
    spread = f"one standard deviation of ln p at a given c: {listed} {stress_unit}" if listed else "not known"
    lines.append(f"scatter of simulations about the theory, {spread}")
    if isinstance(theory, Mbma):
        from mbma_tables.models.tables import universal_model

        lines.append(f"table: data {str(universal_model().content.attributes['values_sha256'])[:16]}")
    return tuple(lines)
