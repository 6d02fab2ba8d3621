"""Force of a rough sphere or cylinder against its approach, its units, and as polynomials."""

import dataclasses
import re
import types
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, Numbers, finite_array
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import SIZES, Units, factor, unit_of
from mbma_tables.law.half_space import RTOL, Body
from mbma_tables.law.law import ContactLaw
from mbma_tables.law.make import theory_law
from mbma_tables.theories.protocol import Theory, TheoryAnswer

LIGHT = 1e-9  # share of the largest force at which laws without a last contact begin
NEWTONS = {"uN": 1e-6, "mN": 1e-3, "N": 1.0, "kN": 1e3, "MN": 1e6}
_FORCE = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([umkM]?N)\s*(?:/\s*(\w+))?\s*")


def units_of(units: Units, plane: bool) -> tuple[dict[str, str], float]:
    """Units by quantity, and the factor from stress times area to the unit of force."""
    length, force, newtons = unit_of("approach", units), unit_of("energy" if plane else "island_force", units), 1.0
    if units.length is not None and units.stress in SIZES["stress"]:
        force, per = ("N/mm", 1e-3) if plane else ("N", 1.0)
        newtons = per * factor(units.stress, "Pa", "stress") * factor(units.length, "m", power=1 if plane else 2)
    known = {"force": force, "stiffness": f"{force}/{length}", "area": length if plane else f"{length}^2"}
    known |= dict.fromkeys(("approach", "contact_radius", "position", "mean_separation"), length)
    return known | {"pressure": unit_of("pressure", units)}, newtons


def forces(given: Any, body: Body, length: str | None) -> Any:
    """Forces in the unit of results, of numbers and of texts such as "10 N"."""
    if isinstance(given, list | tuple):
        return [forces(value, body, length) for value in given]
    if not isinstance(given, str):
        return given
    found, unit = _FORCE.fullmatch(given), body.units["force"]
    if found is None or (found[3] is None) == body.plane or unit not in ("N", "N/mm"):
        known = "the units of surface and E_star are known" if unit not in ("N", "N/mm") else "it"
        raise InputError(f"force must be a number or, where {known} is, like '10 {unit}', got {given!r}")
    return float(found[1]) * NEWTONS[found[2]] * (1.0 if found[3] is None else factor("mm", found[3]))


def _of(quantity: str, meaning: str) -> Any:
    def found(self: Any, approach: ArrayLike | str) -> Numbers:
        value: Numbers = getattr(self.law, quantity)(self._left(approach))
        return value

    found.__doc__ = meaning
    return found


@dataclasses.dataclass(frozen=True, eq=False)
class ForceLaw:
    """Force of a rough sphere or cylinder against its approach, made by `RoughContact.law`; per length of a cylinder.

    Approaches are numbers in the surface's unit or texts, "0.8 um"; zero force below `first`.
    """

    #: the same in the layout of contact laws, against the approach that is left to the largest one: "pressure" is force
    #: and "area" real area, `error` bounds the relative error of both
    law: ContactLaw
    #: approach of first contact; of a layer without one, at a thousand-millionth of the largest force [length]
    first: float
    body: Body

    force = _of("pressure", "F.")
    stiffness = _of("stiffness", "dF/d(approach).")
    area = _of("area", "Real contact area.")
    energy = _of("energy", "Work of loading, the integral of F over the approach.")

    def approach(self, force: Any) -> Numbers:
        """Approach at a force."""
        left: FloatArray = self.law.at_pressure(forces(force, self.body, self.law.units.length)).mean_separation
        return self.law.h_max + self.first - left

    def _left(self, approach: ArrayLike | str) -> FloatArray:
        return self.law.h_max + self.first - finite_array("approach", self.law.units.number("approach", approach))


class _Pressed(Theory):
    """The contacts of a body as a theory of the approach that is left up to a largest one."""

    def __init__(self, body: Body, top: float, rtol: float) -> None:
        self.name, self.ends_at_h_max = body.law.theory, body.touches
        self._body, self._top, self._rtol = body, top, rtol

    def answer(self, surface: Any, mean_separation: FloatArray) -> TheoryAnswer:
        """Force over E*, real area and stiffness."""
        approaches = self._top - np.asarray(mean_separation, float)
        found = [self._body.solved(approach, self._rtol) for approach in map(float, approaches.ravel())]
        rows = np.array([(*self._body.quantities(at), at.error + self._body.law.error) for at in found])
        force, stiffness, area, error = (part.reshape(approaches.shape) for part in rows.T)
        return TheoryAnswer(force, area, stiffness, error)

    def energy(self, surface: Any, mean_separation: FloatArray) -> FloatArray:
        """Beyond the lightest load, where force is an exponential."""
        found = self.answer(surface, mean_separation)
        return np.asarray(found.pressure**2 / found.stiffness)


def force_law(body: Body, top: float, rtol: float) -> ForceLaw:
    """Force against approach up to `top`."""
    first = -body.ends[1]
    if not body.touches:
        largest = body.solved(top, RTOL)
        first = body.approach_at(LIGHT * body.integral(largest, largest.p))
    # in place of a surface: first contact is where so much of the approach is left
    span: Any = types.SimpleNamespace(h_max=top - first)
    facts = {"surface": span, "E_star": body.law.E_star * body.newtons, "units": Units(body.law.units.length)}
    law = theory_law(span, _Pressed(body, top, 0.01 * rtol), rtol, facts)
    return ForceLaw(dataclasses.replace(law, surface=None), first, body)
