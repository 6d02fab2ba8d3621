"""A contact law as rows for other codes: what it is, in which units, and rows chosen by their error.

Overclosure is c = h_max - u with the mean separation u = (h_max + d)/2 (50): zero at first contact, rising as bodies
approach, so that -dp/du = dp/dc.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from mbma_tables import __version__
from mbma_tables.arguments import FloatArray, hinted, number_in
from mbma_tables.display import Displayed, Variable, shown
from mbma_tables.errors import InputError
from mbma_tables.export.chords import chosen_rows
from mbma_tables.plots import draw_lines
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.readings import Reading
from mbma_tables.theories.contact import contact
from mbma_tables.theories.law import contact_law
from mbma_tables.theories.law_object import ContactLaw
from mbma_tables.theories.mbma import Mbma
from mbma_tables.theories.protocol import Theory, UserTheory
from mbma_tables.theories.registry import get_theory
from mbma_tables.theories.result import ELASTIC_PSI, Contact
from mbma_tables.totals.conductance import conductance
from mbma_tables.units import Units, in_unit, resolve

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUANTITIES = ("pressure", "conductance")
FLOOR = 1e-3  # of the largest value, where no range is given: below it, errors are relative to this, not to the value
LOOKED_AT = 200  # compressions at which validity and scatter are looked at
FINE = 20_001  # points at which the error of a choice of rows is measured
LAW_RTOL = 1e-8
OWN_NUMBERS = ("q0", "q1", "h_rms", "h_max", "rms_gradient")  # said of a surface that is its own spectrum


@dataclasses.dataclass(frozen=True, repr=False)
class LawTable(Displayed):
    """Rows of a contact law, ready to be written.

    Attributes
    ----------
    x, y : ndarray
        Overclosure and pressure, or pressure and conductance; both start at zero and rise.
    x_name, y_name, x_unit, y_unit : str
    largest_error : float
        Largest relative error of linear interpolation between the rows as written against the model, where y
        is above `floor`.
    comments : tuple of str
        What a reader of the file must know.
    theory : str
        Whose law it is.
    floor : float
        Value below which errors are relative to it.
    behaviour : LawTable or None
        The pressure of the same joint, with its conductance.
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
    floor: float = 0.0
    behaviour: LawTable | None = None

    def _facts(self) -> dict[str, str]:
        columns = {self.x_name: shown(self.x, self.x_unit), self.y_name: shown(self.y, self.y_unit)}
        return columns | {"rows": str(self.x.size), "theory": self.theory, "largest error": shown(self.largest_error)}

    def _variables(self) -> dict[str, Variable]:
        dims = (self.x_name,)
        return {
            self.x_name: Variable(self.x, self.x_unit, self.x_name, dims),
            self.y_name: Variable(self.y, self.y_unit, self.y_name, dims),
        }

    def _figure(self) -> Figure:
        labels = (f"{name} [{unit}]" for name, unit in ((self.x_name, self.x_unit), (self.y_name, self.y_unit)))
        return draw_lines({self.y_name: (self.x[1:], self.y[1:])}, *labels)


def _curve(
    law: ContactLaw,
    quantity: str,
    max_overclosure: float,
    k_s: float,
    E_star: float,
    frozen: Callable[[FloatArray], FloatArray] | None,
) -> tuple[FloatArray, FloatArray]:
    """The law on fine points; conductance by the frozen contact's stiffness where it is not the law's own slope."""
    # squares: fine where p is a high power of the overclosure
    c = max_overclosure * np.linspace(0, 1, FINE) ** 2
    d = law.h_max - 2 * c
    pressure, stiffness = np.asarray(law.force(d)), np.asarray(law.stiffness_mean(d))
    pressure[0] = stiffness[0] = 0.0
    if quantity == "pressure":
        return c, pressure
    if frozen is not None:
        stiffness[1:] = frozen(law.h_max - c[1:])
    rises = np.concatenate([[True], np.diff(pressure) > 0])
    return pressure[rises], np.asarray(conductance(stiffness, k_s, E_star))[rises]


@hinted
def describe_law(
    surface: AnySurface,
    E_star: float | str,
    *,
    length_unit: str | None = None,
    stress_unit: str | None = None,
    quantity: str = "pressure",
    rows: int | None = None,
    rtol: float | None = None,
    largest_overclosure: float | str | None = None,
    pressures: tuple[float | str, float | str] | None = None,
    conductivity: float | None = None,
    conductivity_unit: str | None = None,
    reading: str | Reading = "reported",
    evenly: bool = False,
    theory: str | Theory | UserTheory = "mbma",
    hardness: float | str = np.inf,
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
        Largest relative error of the interpolation where the result is above a thousandth of its largest, or
        between `pressures`.
    largest_overclosure : float or str, optional
        Where the rows end, in the rows' unit or with its own; else at full compression, or where the force turns down.
    pressures : pair of float or str, optional
        Smallest and largest pressure of the user's problem: rows end at the largest, and the error holds from the
        smallest on. Not with `largest_overclosure`.
    conductivity : float, optional
        k_s = 2 k1 k2/(k1 + k2) for conductance, thermal or electrical, with its unit.
    reading : str or Reading
        Of the MBMA model.
    theory : str or theory
        As for `contact`.
    hardness : float or str
        As for `contact`: the law of loading, and conductance by the stiffness of the frozen contact.
    evenly : bool
        Equally spaced rows instead, for comparison.

    Raises
    ------
    InputError, OutOfRangeError
        For a batch of surfaces, missing units, a range beyond the law, and rows that cannot meet `rtol`.

    Examples
    --------
    >>> from mbma_tables import Surface
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
    units = Units(length_unit, stress_unit)
    end = units.number("overclosure", largest_overclosure)
    k_s, names = 1.0, ("overclosure", "pressure", length_unit, stress_unit)
    if quantity == "conductance":
        if conductivity is None or not conductivity_unit:
            raise InputError("conductance needs conductivity, k_s = 2 k1 k2/(k1 + k2), and conductivity_unit")
        if not conductivity_unit.isprintable():
            raise InputError(f"conductivity_unit is not printable: {conductivity_unit!r}")
        k_s = number_in("conductivity", conductivity, 1e-300, 1e300)
        names = ("pressure", "conductance", stress_unit, f"{conductivity_unit}/{length_unit}")
    elif conductivity is not None or conductivity_unit is not None:
        raise InputError("conductivity and conductivity_unit belong to quantity='conductance': leave them out")
    cap = units.number("hardness", hardness)
    law = contact_law(surface, LAW_RTOL, reading=reading, E_star=modulus, theory=theory, hardness=cap)
    least, end = _range(law, end, pressures, units)
    own = Mbma(reading=reading) if theory == Mbma.name else get_theory(theory)

    def answer(u: FloatArray) -> Contact:
        return contact(surface, mean_separation=u, E_star=modulus, theory=own, hardness=cap)

    yields = cap < np.inf
    frozen = (lambda u: np.asarray(answer(u).incremental_stiffness)) if yields else None
    fine_x, fine_y = _curve(law, quantity, end, k_s, modulus, frozen)
    floor = FLOOR * float(fine_y[-1])
    if pressures is not None:
        floor = least if quantity == "pressure" else float(np.interp(least, fine_x, fine_y))
    x, y, error = chosen_rows(fine_x, fine_y, floor, rows, rtol, evenly)
    behaviour = None
    if quantity == "conductance":
        behaviour = describe_law(
            surface,
            modulus,
            stress_unit=stress_unit,
            rows=rows,
            rtol=rtol,
            largest_overclosure=end if pressures is None else None,
            pressures=pressures,
            reading=reading,
            theory=theory,
            hardness=cap,
            evenly=evenly,
        )
    comments = _comments(surface, law, modulus, names, x, error, floor, units)
    gradient = modulus * float(surface.rms_gradient)
    if yields:
        comments += (
            f"hardness = {cap:.10g} {stress_unit}, plasticity index {gradient / cap:.3g}: loading only, "
            "unloading starts with the incremental stiffness",
        )
    else:
        comments += (f"elastic: within 5% in area for hardnesses from {gradient / ELASTIC_PSI:.4g} {stress_unit} on",)
    known = _validity(answer, law, own, end, stress_unit)
    return LawTable(x, y, *names, error, (*comments, *known), law.theory, floor, behaviour)


def _known(name: str, unit: str | None) -> str:
    if unit is None:
        raise InputError(f"{name} is missing: a law without units is read wrongly sooner or later")
    return unit


def _range(
    law: ContactLaw, end: float | None, pressures: tuple[float | str, float | str] | None, units: Units
) -> tuple[float, float]:
    """Smallest pressure whose error counts, and largest overclosure, by a range of pressures or by an overclosure."""
    if pressures is None:
        return 0.0, _range_end(law, end)
    if end is not None:
        raise InputError("largest_overclosure and pressures are both given: give one of them")
    low, high = (number_in("pressures", units.number("pressure", p), 1e-300, 1e300) for p in pressures)
    if low >= high:
        raise InputError(f"pressures must be two rising numbers, got {low:g} and {high:g}")
    return low, (law.h_max - float(law.separation(force=high))) / 2


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
    surface: AnySurface,
    law: ContactLaw,
    E_star: float,
    names: tuple[str, str, str, str],
    x: FloatArray,
    error: float,
    floor: float,
    units: Units,
) -> tuple[str, ...]:
    numbers = ", ".join(f"{name} = {float(getattr(surface, name)):.10g}" for name in surface.parameters or OWN_NUMBERS)
    end = "the same"
    if names[0] == "overclosure":
        end = "the largest asked for, or full compression"
        if law.turning_point is not None:
            end = "where the force of this surface turns down, or the largest asked for; nothing is known beyond"
    model = f"MBMA model, reading {law.reading!r}" if law.theory == Mbma.name else f"theory {law.theory!r}"
    return (
        f"Contact law of a rough surface, {model}; mbma_tables {__version__}",
        f"{names[1]} [{names[3]}] against {names[0]} [{names[2]}]",
        f"surface: {numbers}; lengths in {units.length}",
        f"E* = {E_star:.10g} {units.stress}, 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2",
        "pressure is force over nominal area;",
        "overclosure c = h_max - u, u = (h_max + d)/2 the mean separation, d the separation from the mid-plane;",
        "c = 0 is first contact: bodies meet where their mean planes are h_max apart",
        f"range: {names[0]} from 0 to {x[-1]:.10g}, {end}",
        f"{x.size} rows; largest error of linear interpolation {error:.1e}, relative, "
        f"above {names[1]} {floor:.4g} {names[3]}",
        f"the law is within {law.error:.1e} of its theory, in pressure and area",
    )


def _validity(
    answer: Callable[[FloatArray], Contact], law: ContactLaw, theory: Theory, end: float, stress_unit: str
) -> tuple[str, ...]:
    """Lines that say where the law holds, how far simulations scatter about it, and where its numbers come from."""
    u = np.linspace(law.h_max, law.h_max - end, LOOKED_AT + 1)[1:]
    found = answer(u)
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
