"""A contact law as rows for other codes: what it is, in which units, and rows chosen by their error.

Overclosure is c = h_max - u with the mean separation u = (h_max + d)/2 (50): zero at first contact, rising as bodies
approach, so that -dp/du = dp/dc.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from mbma_tables.common.arguments import FloatArray, hinted, number_in, one_number
from mbma_tables.common.display import Displayed, Variable, shown
from mbma_tables.common.errors import InputError
from mbma_tables.common.plots import draw_lines
from mbma_tables.common.units import Units
from mbma_tables.export.chords import chosen_rows
from mbma_tables.export.joint import Joint, checked_conductivity, frozen_joint
from mbma_tables.law.law import ROUNDING, ContactLaw
from mbma_tables.laws.effective_medium import LARGEST_AREA
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.variants import Variant
from mbma_tables.theories.protocol import Theory, UserTheory
from mbma_tables.totals.conductance import conductance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUANTITIES = ("pressure", "conductance", "leakage")
FLOOR = 1e-3  # of the largest value, where no range is given: below it, errors are relative to this, not to the value
FINE, LAST = 20_001, 2_001  # points at which the error of a choice of rows is measured
LAST_SHARE, NEAREST_END = 1e-2, 1e-9  # of h_max, mean separations of the last points


@dataclasses.dataclass(frozen=True, repr=False)
class LawTable(Displayed):
    """Rows of a contact law, ready to be written."""

    x: FloatArray  # overclosure, or pressure: zero, then rising
    y: FloatArray  # pressure or conductance, rising from zero; or flow, which falls, to zero where contact blocks it
    x_name: str
    y_name: str
    x_unit: str
    y_unit: str
    largest_error: float  # relative, of linear interpolation between rows as written, where y is above `floor`
    comments: tuple[str, ...]  # what a reader of the file must know
    theory: str  # whose law it is
    floor: float = 0.0  # value below which errors are relative to it
    behaviour: LawTable | None = None  # the pressure of the same joint, with its conductance

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


def _curve(joint: Joint, quantity: str, max_overclosure: float, k_s: float) -> tuple[FloatArray, FloatArray]:
    """The law on fine points; conductance by the frozen contact's stiffness where it is not the law's own slope."""
    law = joint.law
    # squares: fine where p is a high power of the overclosure
    c = max_overclosure * np.linspace(0, 1, FINE) ** (2 if law.highest == np.inf else 1)
    # close to full compression pressure may run up with the logarithm of the mean separation
    u = law.h_max * np.geomspace(max(1 - max_overclosure / law.h_max, NEAREST_END), LAST_SHARE, LAST)
    c = np.union1d(c, law.h_max - u[1:-1]) if u[0] < u[-1] else c
    d = law.h_max - 2 * c
    pressure, stiffness = np.asarray(law.pressure(separation=d)), np.asarray(law.stiffness(separation=d))
    pressure[0] = stiffness[0] = 0.0
    if quantity == "pressure":
        return c, pressure
    if quantity == "leakage":
        flow = np.asarray(joint.leakage(separation=d))
        # the first row that is blocked is the last
        open_ = np.append(True, (np.diff(pressure) > 0) & (flow[:-1] > 0))
        return pressure[open_], flow[open_]
    if joint.hardness < np.inf:
        stiffness[1:] = joint.answer(law.h_max - c[1:]).unloading_stiffness
    rises = np.concatenate([[True], np.diff(pressure) > 0])
    return pressure[rises], np.asarray(conductance(stiffness, k_s, joint.modulus))[rises]


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
    variant: str | Variant = "reported",
    evenly: bool = False,
    theory: str | Theory | UserTheory | None = None,
    hardness: float | str = np.inf,
    made_by: tuple[str, ...] = (),
    direction: str | float | None = None,
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
    quantity : {"pressure", "conductance", "leakage"}
        Pressure against overclosure, or conductance against pressure, or the flow coefficient k h_rms^3 of the gaps
        (`ContactLaw.leakage`) against pressure.
    rows : int, optional
        How many; else as few as `rtol` needs, 1e-3 where neither is given.
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
    variant : str or Variant
        Of the MBMA model.
    theory : str or theory
        As for `contact`.
    hardness : float or str
        As for `contact`: the law of loading, and conductance by the stiffness of the frozen contact.
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
    joint = frozen_joint(surface, E_star, length_unit, stress_unit, variant, theory, hardness, made_by, direction)
    law, units = joint.law, joint.units
    least, end = _range(law, units.number("overclosure", largest_overclosure), pressures, units)
    k_s, names = 1.0, (own := ("overclosure", "pressure", joint.length, joint.stress))
    if quantity == "conductance":
        k_s, unit = checked_conductivity(conductivity, conductivity_unit)
        names = ("pressure", "conductance", joint.stress, f"{unit}/{joint.length}")
    elif quantity == "leakage":
        names = ("pressure", "leakage", joint.stress, f"{joint.length}^3")
    if quantity != "conductance" and (conductivity is not None or conductivity_unit is not None):
        raise InputError("conductivity and conductivity_unit belong to quantity='conductance': leave them out")
    choose = functools.partial(chosen_rows, rows=rows, rtol=rtol, evenly=evenly)
    behaviour = _table(joint, "pressure", own, least, end, choose) if quantity == "conductance" else None
    return _table(joint, quantity, names, least, end, choose, k_s, behaviour)


def _table(
    joint: Joint,
    quantity: str,
    names: tuple[str, str, str, str],
    least: float | None,
    end: float,
    choose: Callable[..., tuple[FloatArray, FloatArray, float]],
    k_s: float = 1.0,
    behaviour: LawTable | None = None,
) -> LawTable:
    """Rows up to an overclosure, whose error holds from the `least` pressure on, or above `FLOOR`."""
    law = joint.law
    fine_x, fine_y = _curve(joint, quantity, end, k_s)
    floor = FLOOR * float(fine_y[-1])
    if quantity == "leakage":
        floor = float(fine_y[-1])
        if law.at_pressure(fine_x[-1]).area > LARGEST_AREA:
            floor = float(joint.leakage(separation=law.separation(area=LARGEST_AREA)))
        # without so much contact gaps may close for want of a mean separation
        floor = (floor or FLOOR * float(fine_y[0])) * (1 - 1e-9)
    elif least is not None:
        floor = least if quantity == "pressure" else float(np.interp(least, fine_x, fine_y))
    if heat := quantity == "conductance":
        # between no contact and the smallest pressure that counts there is one row alone, that of zero
        used = np.append(True, fine_y[1:] > floor * (1 - 1e-9))
        fine_x, fine_y = fine_x[used], fine_y[used]
    x, y, error = choose(fine_x, fine_y, floor, jump=heat or law.highest < np.inf)
    comments = joint.header(
        f"{names[1]} [{names[3]}] against {names[0]} [{names[2]}]",
        f"{names[0]} from 0 to {x[-1]:.10g} {names[2]}, {_why_there(joint, end, quantity)}",
        f"{x.size} rows; largest error of linear interpolation {error:.1e}, relative, "
        f"above {names[1]} {floor:.4g} {names[3]}",
        *(["the first row is zero, whatever the theory has up to the second"] if law.highest < np.inf else ()),
        end=end,
        leakage=quantity == "leakage",
    )
    return LawTable(x, y, *names, error, comments, law.theory, floor, behaviour)


def _why_there(joint: Joint, end: float, quantity: str) -> str:
    """Why rows end where they do."""
    law = joint.law
    if quantity == "leakage" and joint.leakage.blocked_at >= law.h_max - 2 * end:
        return "where contact blocks the gaps"
    if end < _last(law) * (1 - ROUNDING):
        return "the largest asked for"
    if law.turning_point is None:
        return "where the law ends"
    return "where the force of this surface turns down; nothing is known beyond"


def _last(law: ContactLaw) -> float:
    """Overclosure at full compression, or where the force turns down."""
    return (law.h_max - (law.lowest if law.turning_point is None else law.turning_point)) / 2


def _range(
    law: ContactLaw, end: float | None, pressures: tuple[float | str, float | str] | None, units: Units
) -> tuple[float | None, float]:
    """Smallest pressure whose error counts, and largest overclosure, by a range of pressures or by an overclosure."""
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
    """The largest overclosure: as asked, or at full compression, or where the force turns down."""
    end = _last(law)
    found = end if asked is None else one_number("largest_overclosure", asked)
    if not 0 < found <= end:
        why = "full compression" if law.turning_point is None else "where the force of this surface turns down"
        raise InputError(f"largest_overclosure must be in (0, {end:g}], up to {why}, got {found:g}")
    return found
