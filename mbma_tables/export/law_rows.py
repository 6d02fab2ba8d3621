"""A contact law as rows for other codes, with quantity and units; the rows are chosen by their error.

Overclosure is c = h_max - u with the mean separation u = (h_max + d)/2 (50): zero at first contact, rising as bodies
approach, so that -dp/du = dp/dc.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray, hinted, number_in, one_number, whole_number_in
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import Units
from mbma_tables.export.chords import MAX_ROWS, MIN_ROWS, chosen_rows
from mbma_tables.export.exported_law import ExportedLaw, checked_conductivity, checked_kappa, exported_law
from mbma_tables.export.film_rows import facts_of, film_rows
from mbma_tables.export.law_table import LawTable
from mbma_tables.law.force_law import ForceLaw
from mbma_tables.law.law import ROUNDING, ContactLaw
from mbma_tables.laws.effective_medium import LARGEST_AREA
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.variants import Variant
from mbma_tables.theories.protocol import Theory, UserTheory

QUANTITIES = ("pressure", "conductance", "tangential_stiffness", "leakage", "hydraulic_aperture", "film")
OF_FRICTION = 5  # pressures at which a friction card's comments have the stiffness
FLOOR = 1e-3  # of the largest value, where no range is given: below it, errors are relative to this, not to the value
FINE, LAST = 20_001, 2_001  # points at which the error of a choice of rows is measured
LAST_SHARE, NEAREST_END = 1e-2, 1e-9  # mean separations of the last points, over h_max
FILM_ROWS = 200


def _curve(exported: ExportedLaw, quantity: str, max_overclosure: float, scale: float) -> tuple[FloatArray, FloatArray]:
    """The law on fine points; what follows the unloading stiffness is `scale` times that."""
    law = exported.law
    # squares: fine where p is a high power of the overclosure
    c = max_overclosure * np.linspace(0, 1, FINE) ** (2 if law.highest == np.inf else 1)
    # near full compression pressure may diverge with the logarithm of the mean separation
    u = law.h_max * np.geomspace(max(1 - max_overclosure / law.h_max, NEAREST_END), LAST_SHARE, LAST)
    c = np.union1d(c, law.h_max - u[1:-1]) if u[0] < u[-1] else c
    d = law.h_max - 2 * c
    pressure, stiffness = np.asarray(law.pressure(separation=d)), np.asarray(law.stiffness(separation=d))
    pressure[0] = stiffness[0] = 0.0
    if quantity == "pressure":
        return c, pressure
    if quantity in ("leakage", "hydraulic_aperture"):
        flow = np.asarray(exported.leakage(separation=d))
        # the first row that is blocked is the last
        open_ = np.append(True, (np.diff(pressure) > 0) & (flow[:-1] > 0))
        return pressure[open_], flow[open_] if quantity == "leakage" else np.cbrt(flow[open_])
    if exported.hardness < np.inf:
        stiffness[1:] = exported.answer(law.h_max - c[1:]).unloading_stiffness
    rises = np.concatenate([[True], np.diff(pressure) > 0])
    return pressure[rises], scale * stiffness[rises]


def _friction(
    exported: ExportedLaw, friction: float, kappa: Any, pressure: Any, pressures: tuple[Any, Any] | None
) -> tuple[dict[str, tuple[float, str]], str]:
    """Facts for friction cards, by the stiffness of a small unloading, and what these mean."""
    law, units = exported.law, exported.units
    if kappa is None or (pressure is None and pressures is None):
        raise InputError("friction needs kappa, normal over tangential stiffness, and friction_pressure or pressures")
    ends = [float(units.number("pressure", p)) for p in (pressures or (pressure, pressure))]
    at = float(units.number("pressure", pressure)) if pressure is not None else math.sqrt(math.prod(ends))
    ratio = checked_kappa(kappa(float(law.at_pressure(at).area)) if callable(kappa) else kappa)

    def stiffness(p: float) -> float:
        return float(law.unloading_stiffness(law.at_pressure(p).mean_separation)) / ratio

    stick, unit = stiffness(at), f"{exported.stress}/{exported.length}"
    places = dict.fromkeys(np.geomspace(ends[0], ends[1], OF_FRICTION).tolist())
    facts = {"friction": (number_in("friction", friction, 1e-12, 1e12), "1")}
    return facts | {"stick": (stick, unit), "stick_pressure": (at, exported.stress)}, (
        f"friction coefficient {friction:.10g}; shear stress over displacement before slip, the stiffness of a small "
        f"unloading over kappa = {ratio:.4g}: {stick:.4g} {unit} at {at:.4g} {exported.stress}, where the friction "
        f"card holds; {', '.join(f'{stiffness(p):.4g} at {p:.4g}' for p in places)} {exported.stress}"
    )


@hinted
def describe_law(
    surface: AnySurface | ForceLaw,
    E_star: float | str = 1.0,
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
    kappa: float | Callable[[float], float] | None = None,
    friction: float | None = None,
    friction_pressure: float | str | None = None,
    variant: str | Variant = "reported",
    evenly: bool = False,
    theory: str | Theory | UserTheory | None = None,
    hardness: float | str = np.inf,
    peklenik: float | None = None,
    made_by: tuple[str, ...] = (),
    direction: str | float | None = None,
) -> LawTable:
    """A contact law as rows for a code that interpolates linearly.

    Parameters
    ----------
    surface : Surface
        One surface; or the force law of a rough sphere or cylinder (`RoughContact.law`) alone, of pressure as force.
    E_star : float or str
        Effective modulus in `stress_unit`, or with its unit: 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2.
    length_unit, stress_unit : str, optional
        Units of the rows. A surface or modulus that has another one is converted; one that has none is in these.
    quantity : {"pressure", "conductance", "tangential_stiffness", "leakage", "hydraulic_aperture", "film"}
        Pressure against overclosure, or against pressure conductance, tangential stiffness before slip, the flow
        coefficient k h_rms^3 of the gaps (`ContactLaw.leakage`), or the hydraulic aperture k^(1/3) h_rms with the
        aperture u, the derivative by u and the stiffness -dp/du. A film: flow factors (`flow_factors`), asperity
        pressure and contact area against the mean gap u, from 0.2 h_rms or the largest of `pressures` to 10 h_rms, of
        theory "calibrated" by default.
    rows : int, optional
        How many; else as few as `rtol` needs, 1e-3 where neither is given; 200 of a film, which has no `rtol`.
    rtol : float, optional
        Largest relative error of the interpolation where the result is above a thousandth of its largest, or
        between `pressures`; of leakage from its largest down to that at 30% contact, or at the largest of `pressures`.
    largest_overclosure : float or str, optional
        Where the rows end, in the rows' unit or with its own; else at full compression, or where the force turns down.
    pressures : pair of float or str, optional
        Smallest and largest pressure of the user's problem: rows end at the largest, and the error holds from the
        smallest on. Not with `largest_overclosure`.
    conductivity : float, optional
        k_s = 2 k1 k2/(k1 + k2) for conductance, thermal or electrical, with its unit.
    kappa : float or callable, optional
        Normal over tangential stiffness (`materials.tangential_ratio`), a number or a function of the contact area.
    friction : float, optional
        Coefficient of friction, for the friction cards of solvers; with `kappa`.
    friction_pressure : float or str, optional
        Pressure at which the one tangential stiffness of a friction card holds; by default the geometric mean of
        `pressures`. Comments have the stiffness at other pressures.
    variant : str or Variant
        Of the MBMA model.
    theory : str or theory
        As for `contact`.
    hardness : float or str
        As for `contact`: the law of loading, and conductance by the stiffness of the frozen contact.
    peklenik : float, optional
        Of a film: as for `flow_factors`.
    evenly : bool
        Equally spaced rows instead, for comparison.
    made_by : tuple of str
        Lines for the header of a file that say how to write it again.
    direction : str or float, optional
        Of leakage of a simulated map: "x", "y" or degrees from x; else the geometric mean of both axes.

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
    ('pressure', 'MPa', 'mm', 0.021)
    """
    if quantity not in QUANTITIES:
        raise InputError(f"quantity must be one of {QUANTITIES}, got {quantity!r}")
    of_body = isinstance(surface, ForceLaw)
    if of_body and quantity != "pressure":
        raise InputError(f"a force law has no {quantity}")
    if film := quantity == "film":
        theory = "calibrated" if theory is None else theory
        if any(given is not None for given in (rtol, largest_overclosure)):
            raise InputError("rtol and largest_overclosure are not of a film: give rows and pressures")
    elif peklenik is not None:
        raise InputError("peklenik belongs to quantity='film': leave it out")
    exported = exported_law(surface, E_star, length_unit, stress_unit, variant, theory, hardness, made_by, direction)
    law = exported.law
    units = law.units
    least, end = _range(law, units.number("overclosure", largest_overclosure), pressures, units)
    scale, names, facts = (
        1.0,
        (own := ("overclosure", "force" if of_body else "pressure", exported.length, exported.stress)),
        facts_of(exported),
    )
    if quantity == "conductance":
        k_s, unit = checked_conductivity(conductivity, conductivity_unit)
        scale, facts = k_s / exported.modulus, facts | {"conductivity": (k_s, unit)}
        names = ("pressure", "conductance", exported.stress, f"{unit}/{exported.length}")
    elif quantity == "tangential_stiffness":
        names = ("pressure", quantity, exported.stress, f"{exported.stress}/{exported.length}")
        scale = 1 / checked_kappa(kappa)
    elif quantity == "leakage":
        names = ("pressure", "leakage", exported.stress, f"{exported.length}^3")
    elif quantity == "hydraulic_aperture":
        names = ("pressure", quantity, exported.stress, exported.length)
    if quantity != "conductance" and (conductivity is not None or conductivity_unit is not None):
        raise InputError("conductivity and conductivity_unit belong to quantity='conductance': leave them out")
    if film:
        count = whole_number_in("rows", FILM_ROWS if rows is None else rows, MIN_ROWS, MAX_ROWS)
        return film_rows(exported, count, least, end if pressures else np.inf, peklenik)
    choose = functools.partial(chosen_rows, rows=rows, rtol=rtol, evenly=evenly)
    heat = quantity == "conductance"
    behaviour = _table(exported, "pressure", own, least, end, choose, 1.0, facts_of(exported)) if heat else None
    said: list[str] = []
    if friction is not None:
        more, *said = _friction(exported, friction, kappa, friction_pressure, pressures)
        facts |= more
    return _table(exported, quantity, names, least, end, choose, scale, facts, behaviour, *said)


def _table(
    exported: ExportedLaw,
    quantity: str,
    names: tuple[str, str, str, str],
    least: float | None,
    end: float,
    choose: Callable[..., tuple[FloatArray, FloatArray, float]],
    scale: float,
    facts: dict[str, tuple[float, str]],
    behaviour: LawTable | None = None,
    *said: str,
) -> LawTable:
    """Rows up to an overclosure, whose error bound applies above the pressure `least`, or above `FLOOR`."""
    law = exported.law
    fine_x, fine_y = _curve(exported, quantity, end, scale)
    floor = FLOOR * float(fine_y[-1])
    aperture, flow = quantity == "hydraulic_aperture", quantity in ("leakage", "hydraulic_aperture")
    if flow:
        floor = float(fine_y[-1])
        if law.at_pressure(fine_x[-1]).area > LARGEST_AREA:
            floor = float(exported.leakage(separation=law.separation(area=LARGEST_AREA))) ** (1 / 3 if aperture else 1)
        # without so much contact gaps may close for want of a mean separation
        floor = (floor or FLOOR * float(fine_y[0])) * (1 - 1e-9)
    elif least is not None:
        floor = least if quantity == "pressure" else float(np.interp(least, fine_x, fine_y))
    if slope := quantity in ("conductance", "tangential_stiffness"):
        # below the smallest pressure of interest there is only the row of zero pressure
        used = np.append(True, fine_y[1:] > floor * (1 - 1e-9))
        fine_x, fine_y = fine_x[used], fine_y[used]
    x, y, error = choose(fine_x, fine_y, floor, jump=slope or law.highest < np.inf)
    comments = exported.header(
        f"{names[1]} [{names[3]}] against {names[0]} [{names[2]}]",
        f"{names[0]} from 0 to {x[-1]:.10g} {names[2]}, {_why_there(exported, end, quantity)}",
        f"{x.size} rows; largest error of linear interpolation {error:.1e}, relative, "
        f"above {names[1]} {floor:.4g} {names[3]}",
        *(["the first row is zero, whatever the theory has up to the second"] if law.highest < np.inf else ()),
        *said,
        end=end,
        leakage=flow,
    )
    more = {}
    if aperture:
        found = law.at_pressure(x)
        fine_u = np.asarray(law.at_pressure(fine_x).mean_separation)
        by_u = np.interp(-np.asarray(found.mean_separation), -fine_u, np.gradient(fine_y, fine_u))
        more = {
            "aperture": (np.asarray(found.mean_separation), exported.length), "derivative": (by_u, "1"),
            "stiffness": (np.asarray(found.stiffness), f"{exported.stress}/{exported.length}"),
        }  # fmt: skip
    return LawTable(x, y, *names, error, comments, law.theory, floor, behaviour, more, facts)


def _why_there(exported: ExportedLaw, end: float, quantity: str) -> str:
    """The reason for the end of the rows."""
    law = exported.law
    if quantity == "leakage" and exported.leakage.blocked_at >= law.h_max - 2 * end:
        return "where contact blocks the gaps"
    if end < _last(law) * (1 - ROUNDING):
        return "the largest asked for"
    if law.turning_point is None:
        return "where the law ends"
    return "where the force of this surface has its maximum; the law ends there"


def _last(law: ContactLaw) -> float:
    """Overclosure at full compression, or where the force has its maximum."""
    return (law.h_max - (law.lowest if law.turning_point is None else law.turning_point)) / 2


def _range(
    law: ContactLaw, end: float | None, pressures: tuple[float | str, float | str] | None, units: Units
) -> tuple[float | None, float]:
    """Smallest pressure for the error, and largest overclosure, from a range of pressures or an overclosure."""
    if pressures is None:
        return None, _range_end(law, end)
    if end is not None:
        raise InputError("largest_overclosure and pressures are both given: give one of them")
    if not isinstance(pressures, tuple | list | np.ndarray) or len(pressures) != 2:
        raise InputError(f"pressures must be two rising numbers, got {pressures!r}")
    low, high = (number_in("pressures", units.number("pressure", p), 1e-300, 1e300) for p in pressures)
    if low >= high:
        raise InputError(f"pressures must be two rising numbers, got {low:g} and {high:g}")
    found = (law.h_max - float(law.at_pressure(high).separation)) / 2
    if found <= 0:
        least = f"{float(law.pressure(law.h_max)):.4g} {units.stress}"
        raise InputError(f"pressures must reach above {least}, that at c = 0, where rows begin, got {high:g}")
    return low, found


def _range_end(law: ContactLaw, asked: float | None) -> float:
    """The largest overclosure: as requested, or at full compression, or where the force has its maximum."""
    end = _last(law)
    found = end if asked is None else one_number("largest_overclosure", asked)
    if not 0 < found <= end:
        why = "full compression" if law.turning_point is None else "where the force of this surface has its maximum"
        raise InputError(f"largest_overclosure must be in (0, {end:g}], up to {why}, got {found:g}")
    return found
