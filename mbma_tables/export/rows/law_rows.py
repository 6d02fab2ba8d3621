"""A contact law as rows for other codes, with quantity and units; the rows are chosen by their error.

Overclosure is c = h_max - u with the mean separation u = (h_max + d)/2 (50): zero at first
contact, rising as bodies approach, so that -dp/du = dp/dc.
"""

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from mbma_tables.bodies.adhesion import Adhesion
from mbma_tables.bodies.bodies import Bodies
from mbma_tables.common.arguments import FloatArray, hinted, number_in, whole_number_in
from mbma_tables.common.errors import InputError
from mbma_tables.contacts.law.law import ROUNDING, ContactLaw
from mbma_tables.contacts.quantities.effective_medium import LARGEST_AREA
from mbma_tables.contacts.quantities.interface import NOTHING_BETWEEN, Interface
from mbma_tables.contacts.quantities.leakage import (
    hydraulic_aperture,
    power_of_flow,
)
from mbma_tables.contacts.quantities.registry import in_files, unit_of
from mbma_tables.contacts.quantities.stiffnesses import unloading_stiffness
from mbma_tables.effects.film import flow_factors
from mbma_tables.effects.force_law import ForceLaw
from mbma_tables.export.exported_law import (
    KAPPA,
    ExportedLaw,
    GasInGaps,
    exported_law,
    with_conductivity,
)
from mbma_tables.export.law_table import (
    FILM,
    MAX_ROWS,
    MIN_ROWS,
    LawTable,
    chosen_rows,
    rounded,
)
from mbma_tables.export.targets import (
    CONDUCTANCES,
    against,
    follows,
    has_gas,
    options_of,
    require_quantity,
)
from mbma_tables.export.text import about, bound, number
from mbma_tables.islands.variants import Variant
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.base import Theory, UserTheory
from mbma_tables.theories.tested import below, elastic_ranges

OF_FRICTION = 5  # pressures at which a friction card's comments have the stiffness
# of the largest value, where no range is given: below it, errors are relative to this, not
# to the value
FLOOR = 1e-3
DIFFERENCE = 1e-5  # of h_max: between gaps whose flow is compared for a slope
# points at which the error of a choice of rows is measured
FINE = 20_001
LAST = 2_001
# mean separations of the last points, over h_max
LAST_SHARE = 1e-2
NEAREST_END = 1e-9
FILM_ROWS = 200
FILM_RANGE = (0.2 * (1 + 1e-9), 10.0)  # u/h_rms
NEAREST_GAP = 1e-9  # smallest overclosure of a film evaluated, over h_max
FILM_NAMES = ("phi_x", "phi_y", "shear_x", "shear_y", "pressure")
OF_SPOTS = ("pressure", "area", "stiffness")  # columns of a film that end with contact


@hinted
def describe_law(
    surface: AnySurface | ForceLaw,
    E_star: float | str | Bodies = 1.0,
    *,
    length_unit: str | None = None,
    stress_unit: str | None = None,
    quantity: str = "pressure",
    rows: int | None = None,
    rtol: float | None = None,
    pressures: tuple[float | str, float | str] | None = None,
    conductivity: float | None = None,
    conductivity_unit: str | None = None,
    kappa: float | Callable[[float], float] | None = None,
    friction: float | None = None,
    friction_pressure: float | str | None = None,
    variant: str | Variant = "reported",
    evenly: bool = False,
    theory: str | Theory | UserTheory | None = None,
    hardness: float | str = np.inf,
    largest_pressure: float | str | None = None,
    peklenik: float | None = None,
    made_by: tuple[str, ...] = (),
    direction: str | float | None = None,
    gas: GasInGaps | None = None,
    most_rows: int | None = None,
    interface: Interface = NOTHING_BETWEEN,
    adhesion: Adhesion | None = None,
) -> LawTable:
    """A contact law as rows for a code that interpolates linearly.

    Parameters
    ----------
    surface : Surface
        One surface; or the force law of a rough sphere or cylinder (`RoughContact.law`)
        alone, of pressure as force.
    E_star, variant, theory, hardness, largest_pressure, adhesion
        As for `contact`; with a hardness the law of loading, below a largest pressure that of
        unloading and reloading, and conductance by the stiffness of the frozen contact.
        `Bodies` in place of a modulus have both.
    length_unit, stress_unit : str, optional
        Units of the rows. A surface or modulus that has another one is converted; one that
        has none is in these.
    quantity : str
        The name of a quantity of contacts, "leakage", or "film": pressure against overclosure, or against pressure the conductance of the solid spots,
        or of these and of a `gas` together, tangential stiffness
        before slip, the flow coefficient k h_rms^3 of the gaps (`ContactLaw.leakage`), or
        the hydraulic aperture k^(1/3) h_rms with the aperture u, the derivative by u and
        the stiffness -dp/du. A film: flow factors (`flow_factors`), asperity pressure and
        contact area against the mean gap u, from 0.2 h_rms or the largest of `pressures` to
        10 h_rms, of theory "calibrated" by default. Any other quantity of a contact is
        against pressure, as far as it is known and not negative, with what it needs in
        `Bodies`, `conductivity` and `interface`.
    rows : int, optional
        How many; else as few as `rtol` needs, 1e-3 where neither is given; 200 of a film,
        which has no `rtol`.
    rtol : float, optional
        Largest relative error of the interpolation where the result is above a thousandth
        of its largest, or between `pressures`; of leakage from its largest down to that at
        30% contact, or at the largest of `pressures`.
    pressures : pair of float or str, optional
        Smallest and largest pressure of the user's problem: rows end at the largest, and
        the error holds from the smallest on. Else they end at full compression, or where
        the force turns down.
    conductivity, conductivity_unit : float and str, optional
        k_s = 2 k1 k2/(k1 + k2) for conductance, thermal or electrical, with its unit.
    kappa : float or callable, optional
        Normal over tangential stiffness (`materials.tangential_ratio`), a number or a
        function of the contact area.
    friction, friction_pressure : float, and float or str, optional
        Coefficient of friction, for the friction cards of solvers, with `kappa`; the
        pressure at which their one stiffness holds, by default the geometric mean of
        `pressures`. Comments have it at other pressures.
    evenly : bool
        Equally spaced rows instead, for comparison.
    peklenik : float, optional
        Of a film: as for `flow_factors`.
    made_by : tuple of str
        Lines for the header of a file that say how to write it again.
    direction : str or float, optional
        Of leakage of a simulated map: "x", "y" or degrees from x; else the geometric mean
        of both axes.
    gas : GasInGaps, optional
        In the gaps, parallel to the solid spots, for the total conductance.
    most_rows : int, optional
        Rows that the program keeps, taken where neither `rows` nor `rtol` is given and
        fewer miss the usual error.
    interface : Interface, optional
        What is between the bodies, for quantities other than those named.

    Raises
    ------
    InputError, OutOfRangeError
        For a batch of surfaces, missing units, a range beyond the law, and rows that cannot
        meet `rtol`.

    Examples
    --------
    >>> from mbma_tables import Surface
    >>> law = describe_law(Surface.named("concrete"), "13.3 MPa", rows=20)
    >>> law.y_name, law.y_unit, law.x_unit, round(law.largest_error, 3)
    ('pressure', 'MPa', 'mm', 0.024)
    """
    require_quantity(quantity)
    film = quantity == FILM
    of_law = follows(quantity)
    of_registry = not of_law and not film
    of_body = isinstance(surface, ForceLaw)
    heat = quantity in CONDUCTANCES
    sticks = of_law == unloading_stiffness.name and not heat
    belong = options_of(quantity)
    for given, needs, names in (
        (of_body, quantity == "pressure", "a force law"),
        (peklenik is not None, film, "peklenik"),
        (
            conductivity is not None or conductivity_unit is not None,
            "conductivity" in belong,
            "conductivity",
        ),
        (friction is not None, not of_registry, "friction"),
        (kappa is not None, not of_registry or friction is None, "kappa"),
        (film, rtol is None, "rtol"),
        (gas is not None, has_gas(quantity), "gas"),
    ):
        if given and not needs:
            raise InputError(
                f"{names} does not belong to quantity={quantity!r}: leave it out"
            )
    if has_gas(quantity) and gas is None:
        raise InputError(
            f"{quantity} needs the gas in the gaps, which is missing: Joint(..., gas='air').export(...), "
            "or `mbma export TARGET --joint FILE`; without gas it is quantity='solid_conductance'"
        )
    theory = "calibrated" if film and theory is None else theory
    bodies = E_star
    if of_registry and conductivity is not None:
        bodies = with_conductivity(E_star, hardness, conductivity, conductivity_unit)
    exported = exported_law(
        surface,
        bodies,
        length_unit,
        stress_unit,
        variant,
        theory,
        hardness,
        made_by,
        direction,
        interface,
        largest_pressure,
        adhesion,
    )
    if film and exported.attracts:
        raise InputError(
            "a film has gaps wider than those at which bodies that attract each other bear a "
            "pressure: give bodies without adhesion"
        )
    least, end = _range(exported, pressures)
    if film:
        count = whole_number_in(
            "rows", FILM_ROWS if rows is None else rows, MIN_ROWS, MAX_ROWS
        )
        return _film_rows(exported, count, least, end if pressures else np.inf, peklenik)
    choose = functools.partial(chosen_rows, rows=rows, rtol=rtol, evenly=evenly)
    if of_registry:
        choose = functools.partial(choose, most_rows=most_rows)
        return _rows_of_registry(exported, quantity, least, end, choose)
    scale = 1.0
    unit = exported.stress
    facts = exported.facts
    behaviour = None
    said: list[str] = []
    if heat:
        behaviour = _table(exported, "pressure", unit, least, end, choose, 1.0, facts)
        scale, unit = exported.slope(quantity, conductivity, conductivity_unit)
        said.extend(exported.of_gas(gas, unit, end, included=True))
        assert conductivity is not None
        facts = facts | {"conductivity": (float(conductivity), str(conductivity_unit))}
    elif sticks:
        number_of = 1.0 if callable(kappa) else kappa
        scale, unit = exported.slope(quantity, kappa=number_of)
    else:
        unit = exported.unit_of(in_files()[quantity])
    if friction is not None:
        of_friction, *more_said = _friction(
            exported, friction, kappa, friction_pressure, pressures
        )
        facts |= of_friction
        said.extend(more_said)
    choose = functools.partial(choose, most_rows=most_rows)
    ratio = kappa if sticks and callable(kappa) else None
    return _table(
        exported,
        quantity,
        unit,
        least,
        end,
        choose,
        scale,
        facts,
        behaviour,
        *said,
        gas=gas,
        kappa=ratio,
    )


def _curve(
    exported: ExportedLaw,
    quantity: str,
    end: float,
    scale: float,
    gas: GasInGaps | None = None,
) -> tuple[FloatArray, FloatArray]:
    """The law on fine points; what follows the unloading stiffness is `scale` times that, beside the gas."""
    law = exported.law
    # squares: fine where p is a high power of the overclosure
    begin = exported.begin
    c = begin + (end - begin) * np.linspace(0, 1, FINE) ** (2 if exported.ends else 1)
    # rows begin at zero pressure, wherever the law does
    c = np.union1d(0.0, c)
    # near full compression pressure may diverge with the logarithm of the mean separation
    u = law.h_max * np.geomspace(max(1 - end / law.h_max, NEAREST_END), LAST_SHARE, LAST)
    c = np.union1d(c, law.h_max - u[1:-1]) if u[0] < u[-1] else c
    return _at_overclosures(exported, quantity, c, scale, gas)


def _at_overclosures(
    exported: ExportedLaw,
    quantity: str,
    c: FloatArray,
    scale: float,
    gas: GasInGaps | None = None,
) -> tuple[FloatArray, FloatArray]:
    """What rows are against, and a quantity, at rising overclosures of which the first is that of no load."""
    law = exported.law
    begin = exported.begin
    d = law.h_max - 2 * np.maximum(c, begin)
    pressure = np.asarray(law.pressure(separation=d))
    stiffness = np.asarray(law.stiffness(separation=d))
    pressure[0] = stiffness[0] = 0.0
    if quantity == "pressure":
        return c, pressure
    rises = np.append(True, np.diff(pressure) > 0)
    if power := power_of_flow(in_files()[quantity]):
        flow = np.asarray(exported.leakage(separation=d))
        # the first row that is blocked is the last; what is not known has no row
        open_ = rises & np.append(True, flow[:-1] > 0) & ~np.isnan(flow)
        if not open_.any():
            raise InputError(f"{quantity} of this yielded contact is not known anywhere")
        return pressure[open_], flow[open_] ** power
    if exported.hardness < np.inf:
        stiffness[1:] = exported.answer(law.h_max - c[1:]).unloading_stiffness
    if exported.attracts:
        # what follows it does so at no load, too
        stiffness = np.asarray(law.unloading_stiffness(separation=d))
    values = scale * stiffness
    if gas is not None:
        # the gaps of first contact conduct, too
        values += gas.conductance(exported.answer(law.h_max - np.maximum(c, begin)))
    return pressure[rises], values[rises]


def _friction(
    exported: ExportedLaw,
    friction: float,
    kappa: Any,
    pressure: Any,
    pressures: tuple[Any, Any] | None,
) -> tuple[dict[str, tuple[float, str]], str]:
    """Facts for friction cards, by the stiffness of a small unloading, and what these mean."""
    law = exported.law
    units = exported.law.units
    if kappa is None or (pressure is None and pressures is None):
        raise InputError(
            "friction needs kappa, normal over tangential stiffness, and friction_pressure or pressures"
        )
    ends = [
        float(units.number("pressure", p)) for p in (pressures or (pressure, pressure))
    ]
    at = math.sqrt(math.prod(ends))
    if pressure is not None:
        at = number_in(
            "friction_pressure", units.number("pressure", pressure), 1e-300, 1e300
        )
    ratio = number_in(
        "kappa",
        kappa(float(law.at_pressure(at).area)) if callable(kappa) else kappa,
        *KAPPA,
    )

    def stiffness(p: float) -> float:
        return float(law.unloading_stiffness(law.at_pressure(p).mean_separation)) / ratio

    stick = stiffness(at)
    unit = f"{exported.stress}/{exported.length}"
    places = dict.fromkeys(np.geomspace(ends[0], ends[1], OF_FRICTION).tolist())
    listed = [f"{about(stiffness(p))} at {about(p)}" for p in places]
    facts = {"friction": (number_in("friction", friction, 1e-12, 1e12), "1")}
    return facts | {"stick": (stick, unit), "stick_pressure": (at, exported.stress)}, (
        f"friction coefficient {number(friction)}; shear stress over displacement before slip, the stiffness of a "
        f"small unloading over kappa = {about(ratio)}: {about(stick)} {unit} at {about(at)} {exported.stress}, where "
        f"the friction card holds; {', '.join(listed)} {exported.stress}"
    )


def _table(
    exported: ExportedLaw,
    quantity: str,
    y_unit: str,
    least: float | None,
    end: float,
    choose: Callable[..., tuple[FloatArray, FloatArray, float]],
    scale: float,
    facts: dict[str, tuple[float, str]],
    behaviour: LawTable | None = None,
    *said: str,
    gas: GasInGaps | None = None,
    kappa: Callable[[Any], Any] | None = None,
) -> LawTable:
    """Rows up to an overclosure, whose error bound applies above the pressure `least`, or above `FLOOR`."""
    law = exported.law
    fine_x, fine_y = _curve(exported, quantity, end, scale, gas)
    x_name = against(quantity)
    x_unit = unit_of(x_name, law.units)
    power = power_of_flow(in_files()[quantity])
    y_name = quantity if exported.force is None else "force"
    floor = FLOOR * float(fine_y[-1])
    above = ""
    if power:
        floor = float(fine_y[-1])
        if law.at_pressure(fine_x[-1]).area > LARGEST_AREA:
            floor = (
                float(exported.leakage(separation=law.separation(area=LARGEST_AREA)))
                ** power
            )
        # without so much contact gaps may close for want of a mean separation
        floor = (floor or FLOOR * float(fine_y[0])) * (1 - 1e-9)
    elif least is not None:
        floor = (
            least if quantity == "pressure" else float(np.interp(least, fine_x, fine_y))
        )
    if slope := follows(quantity) == unloading_stiffness.name:
        # below the smallest pressure of interest there is only the row of zero pressure
        # of a map the stiffness may fall with pressure, and be less than there above it
        reached = fine_y > floor * (1 - 1e-9) if least is None else fine_x >= least
        used = np.append(True, reached[1:])
        fine_x = fine_x[used]
        fine_y = fine_y[used]
        if least is not None:
            floor = min(floor, float(fine_y[1:].min()) * (1 - 1e-9))
            above = f", from pressure {about(least)} {x_unit} on"
    if kappa is not None:
        # of a surface with a lay it depends on the contact area, and is known for some of them
        fine_y[1:] /= _normal_over_tangential(law, fine_x[1:], kappa)
        floor = float(fine_y[1:].min()) * (1 - 1e-9)
    x, y, error = choose(fine_x, fine_y, floor, jump=slope or not exported.ends)
    why = (
        "where the law ends"
        if law.turning_point is None
        else "where the force of this surface has its maximum"
    )
    if power and exported.leakage.blocked_at >= law.h_max - end:
        why = "where contact blocks the gaps"
        if exported.unknown_from == -np.inf:
            why = "where the elastic contact blocks the gaps: beyond, the flow of the yielded one is not known"
    elif end < exported.c_turn * (1 - ROUNDING):
        why = "the largest asked for"
    more: dict[str, tuple[FloatArray, str]] = {}
    of_others: list[str] = []
    if quantity == hydraulic_aperture.name:
        more, of_others = _of_aperture(exported, x, fine_x, fine_y, floor)
    elif not power:
        # a jump of the law between two fine points shows between two rows alone
        middle = (x[2:] + x[1:-1]) / 2
        if x_name == "pressure":
            middle = (law.h_max - np.asarray(law.at_pressure(middle).separation)) / 2
        overclosures = np.append(0.0, middle)
        between = _at_overclosures(exported, quantity, overclosures, scale, gas)
        between_x, between_y = (part[1:] for part in between)
        if kappa is not None:
            between_y = between_y / _normal_over_tangential(law, between_x, kappa)
        kept = between_y > floor
        off = np.interp(between_x[kept], x, y) / between_y[kept] - 1
        error = max(error, float(np.abs(off).max(initial=0.0)))
    columns = {y_name: (y, y_unit), **more}
    named = ", ".join(f"{name} [{unit}]" for name, (_, unit) in columns.items())
    comments = exported.header(
        f"{named} against {x_name} [{x_unit}]",
        f"{x_name} from 0 to {number(x[-1])} {x_unit}, {why}",
        _of_rows(y_name, x.size, error, f"{y_name} {about(floor)} {y_unit}{above}"),
        *of_others,
        *(
            []
            if exported.ends
            else [
                "the first row has zero pressure, whatever the theory has up to the second"
            ]
        ),
        *said,
        end=end,
        leakage=bool(power),
    )
    return LawTable(
        x,
        y,
        x_name,
        y_name,
        x_unit,
        y_unit,
        error,
        comments,
        law.theory,
        floor,
        behaviour,
        more,
        facts,
    )


def _normal_over_tangential(
    law: ContactLaw, pressure: FloatArray, kappa: Callable[[Any], Any]
) -> FloatArray:
    """Normal over tangential stiffness at pressures."""
    return np.asarray(kappa(np.asarray(law.at_pressure(pressure).area)))


def _rows_of_registry(
    exported: ExportedLaw,
    quantity: str,
    least: float | None,
    end: float,
    choose: Callable[..., tuple[FloatArray, FloatArray, float]],
) -> LawTable:
    """Rows of any quantity of the registry against pressure, between two pressures where they are given."""
    law = exported.law
    c, pressure = _curve(exported, "pressure", end, 1.0)
    rises = np.append(True, np.diff(pressure) > 0)
    c, pressure = c[rises], pressure[rises]
    if least is not None:
        # rows begin at the last fine point below the smallest pressure
        first = max(int(np.searchsorted(pressure, least, side="right")) - 1, 0)
        c, pressure = c[first:], pressure[first:]
    pressed = law.at(separation=law.h_max - 2 * np.maximum(c, exported.begin))
    declared = in_files()[quantity]
    values = np.asarray(pressed.quantity(quantity))
    if values.dtype == bool:
        raise InputError(f"{quantity} is true or false, and has no rows")
    values = np.broadcast_to(values, c.shape).astype(float)
    fine_x, fine_y = _known_part(quantity, pressure, values, least is not None)
    ends_early = fine_x[-1] < pressure[-1]
    floor = FLOOR * float(fine_y.max())
    if fine_y.min() > 0:
        floor = float(fine_y.min()) * (1 - 1e-9)
    x, y, error = choose(fine_x, fine_y, floor)
    unit = declared.unit(pressed)
    why = f"where {quantity} is no longer known" if ends_early else "where the law ends"
    if not ends_early and end < exported.c_turn * (1 - ROUNDING):
        why = "the largest asked for"
    comments = exported.header(
        f"{quantity} [{unit}] against pressure [{exported.stress}]: {declared.meaning}",
        f"pressure from {number(x[0])} to {number(x[-1])} {exported.stress}, {why}",
        _of_rows(quantity, x.size, error, f"{quantity} {about(floor)} {unit}"),
        end=end,
    )
    names = "pressure", quantity, exported.stress, unit
    return LawTable(
        x, y, *names, error, comments, law.theory, floor, facts=exported.facts
    )


def _known_part(
    name: str, pressure: FloatArray, values: FloatArray, from_first: bool
) -> tuple[FloatArray, FloatArray]:
    """The first pressures between which a quantity is finite; from the smallest on, where that was asked for."""
    is_known = np.isfinite(values)
    if not is_known.any() or (from_first and not is_known[0]):
        where = f"at {about(pressure[0])}" if is_known.any() else "at any pressure"
        raise InputError(f"{name} has no rows: it is not known {where}")
    first = int(np.argmax(is_known))
    unknown = np.flatnonzero(~is_known[first:])
    last = first + int(unknown[0]) if unknown.size else values.size
    if last - first < MIN_ROWS:
        raise InputError(f"{name} has no rows: it is known at single pressures alone")
    part = values[first:last]
    if not part.any():
        raise InputError(f"{name} has no rows: it is 0 at all pressures")
    if (part < 0).any():
        raise InputError(
            f"{name} has no rows: it is negative from {about(part.min())} on, and errors of rows are relative"
        )
    return pressure[first:last], part


def _of_rows(name: str, rows: int, error: float, above: str) -> str:
    """The line of a header on the rows of one quantity."""
    return f"{name}: {rows} rows; largest error of linear interpolation {bound(error)}, relative, above {above}"


def _of_aperture(
    exported: ExportedLaw,
    x: FloatArray,
    fine_x: FloatArray,
    fine_y: FloatArray,
    floor: float,
) -> tuple[dict[str, tuple[FloatArray, str]], list[str]]:
    """Columns beside the hydraulic aperture, at pressures x, and the lines of a header on their rows."""
    law = exported.law
    # of laws that begin above zero pressure the first row is where they do
    least = 0.0
    if not exported.ends:
        least = float(law.pressure(separation=law.h_max - 2 * exported.begin))
        fine_x, fine_y = fine_x[1:], fine_y[1:]
    at_rows = law.at_pressure(np.maximum(x, least))
    at_fine = law.at_pressure(np.maximum(fine_x, least))
    u = np.asarray(at_rows.mean_separation)
    fine_u = np.asarray(at_fine.mean_separation)
    fine_derivative = np.gradient(fine_y, fine_u)
    by_u = np.interp(-u, -fine_u, fine_derivative)
    columns = {
        "aperture": (u, exported.length),
        "derivative": (by_u, "1"),
        "stiffness": (
            np.asarray(at_rows.stiffness),
            f"{exported.stress}/{exported.length}",
        ),
    }
    fine = {
        "aperture": fine_u,
        "derivative": fine_derivative,
        "stiffness": np.asarray(at_fine.stiffness),
    }
    # where the main column is above its floor, and beyond the first row, below which
    # stiffness is that of no contact
    inside = (fine_y > floor) & (fine_x >= x[1])
    lines = []
    for name, (values, _) in columns.items():
        error = np.abs(np.interp(fine_x[inside], x, values) / fine[name][inside] - 1).max(
            initial=0.0
        )
        if name == "derivative":
            # slopes of the law's polynomials are further from those of the theory than values
            known = _derivative_of_aperture(exported, u[1:])
            measured = np.isfinite(known) & (np.interp(x[1:], fine_x, fine_y) > floor)
            off = np.abs(values[1:][measured] / known[measured] - 1).max(initial=0.0)
            error = (1 + error) * (1 + off) - 1
        above = f"hydraulic_aperture {about(floor)} {exported.length}, from pressure {about(x[1])} {exported.stress} on"
        lines.append(_of_rows(name, x.size, float(error), above))
    return columns, lines


def _derivative_of_aperture(exported: ExportedLaw, u: FloatArray) -> FloatArray:
    """Of the hydraulic aperture by the mean separation, by the theory; NaN where a gap beside u is blocked."""
    step = DIFFERENCE * exported.law.h_max
    ends = (
        np.minimum(u + step, exported.law.h_max - exported.begin),
        np.maximum(u - step, u.min()),
    )
    apertures = []
    for end in ends:
        leakage = exported.answer(end).leakage
        direction = exported.direction
        K = np.asarray(leakage.K if direction is None else leakage.along(direction))
        apertures.append(np.where(K > 0, np.cbrt(K), np.nan))
    return np.asarray((apertures[0] - apertures[1]) / (ends[0] - ends[1]))


def _range(
    exported: ExportedLaw, pressures: tuple[float | str, float | str] | None
) -> tuple[float | None, float]:
    """Smallest pressure for the error, and largest overclosure, from a range of pressures."""
    law = exported.law
    units = exported.law.units
    if pressures is None:
        return None, exported.c_turn
    two = isinstance(pressures, tuple | list | np.ndarray) and len(pressures) == 2
    ends = [
        number_in("pressures", units.number("pressure", p), 1e-300, 1e300)
        for p in (pressures if two else ())
    ]
    if not two or ends[0] >= ends[1]:
        raise InputError(f"pressures must be two rising numbers, got {pressures!r}")
    low, high = ends
    found = (law.h_max - float(law.at_pressure(high).separation)) / 2
    if found <= 0:
        least = f"{about(law.pressure(law.h_max))} {units.stress}"
        raise InputError(
            f"pressures must reach above {least}, that at c = 0, where rows begin, got {high:g}"
        )
    return low, found


def _film_rows(
    exported: ExportedLaw,
    rows: int,
    least: float | None,
    end: float,
    peklenik: float | None,
) -> LawTable:
    """Flow factors and asperity pressure at mean gaps whose ratios are equal."""
    h_rms = float(exported.surface.h_rms)
    h_max = exported.law.h_max
    length = exported.length
    stress = exported.stress
    u = rounded(
        np.geomspace(max(FILM_RANGE[0] * h_rms, h_max - end), FILM_RANGE[1] * h_rms, rows)
    )
    at = functools.partial(
        flow_factors,
        exported.surface,
        bodies=exported.bodies,
        peklenik=peklenik,
        theory=exported.theory,
    )
    found = at(u)
    middle = at((u[1:] + u[:-1]) / 2)
    tested = found.pressure[~below(found.area, elastic_ranges()["area"])]
    floor = least if least is not None else float(tested.min()) if tested.size else np.inf
    units = dict.fromkeys((*FILM_NAMES, "area", "scatter"), "1") | {"pressure": stress}
    columns = {name: (getattr(found, name), unit) for name, unit in units.items()}
    columns["stiffness"] = (
        np.asarray(exported.answer(u).unloading_stiffness),
        f"{stress}/{length}",
    )
    # where no factor is valid, errors are those at every gap
    of_valid = bool(middle.valid.any())
    measured = middle.valid | (not of_valid)
    pressed = measured & (middle.pressure > floor)
    errors = {}  # largest of linear interpolation, in the middle of the intervals
    for name, (value, _) in columns.items():
        between = (
            np.asarray(exported.answer(middle.mean_separation).unloading_stiffness)
            if name == "stiffness"
            else getattr(middle, name)
        )
        kept = pressed if name in OF_SPOTS else measured & (between > 0)
        off = (value[1:] + value[:-1])[kept] / (2 * between[kept]) - 1
        errors[name] = float(np.abs(off).max(initial=0.0))
    error = max(errors[name] for name in FILM_NAMES)
    where = (
        "where flow factors are valid" if of_valid else "at all gaps, none being valid"
    )
    listed = ", ".join(f"{name} {bound(value)}" for name, value in errors.items())
    gaps = {reason: found.mean_separation[bad] for reason, bad in found.reasons.items()}
    comments = exported.header(
        f"{', '.join(f'{name} [{unit}]' for name, (_, unit) in columns.items())} against mean_separation [{length}]",
        f"mean separation u from {number(u[0])} to {number(u[-1])} {length}",
        f"{rows} rows; largest errors of linear interpolation, relative, {where}: {listed}; of "
        f"{', '.join(OF_SPOTS)} at pressures above {about(floor)} {stress}",
        "flow along x is -phi_x u^3/(12 viscosity) dp/dx + (U1 + U2)/2 u + (U1 - U2)/2 h_rms shear_x",
        "stiffness is that of a small change of the gap, with the contact area as it is",
        f"peklenik = {about(found.peklenik, 6)}: length of the roughness along x over that along y",
        f"scatter: one standard deviation of ln phi; of ln shear_x, ln shear_y: {about(found.shear_scatter[0], 2)}",
        *(
            f"flow factors not valid from u = {about(bad.min())} to {about(bad.max())} {length}: {reason}"
            for reason, bad in gaps.items()
        ),
        end=h_max - min(u[0], h_max * (1 - NEAREST_GAP)),
    )
    facts = exported.facts | {"peklenik": (found.peklenik, "1")}
    y, unit = columns.pop("phi_x")
    names = ("mean_separation", "phi_x")
    theory = exported.law.theory
    return LawTable(
        u, y, *names, length, unit, error, comments, theory, floor, None, columns, facts
    )
