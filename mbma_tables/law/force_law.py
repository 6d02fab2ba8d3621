"""Force of a rough sphere or cylinder against its approach, its units, and as polynomials."""

from __future__ import annotations

import dataclasses
import math
import re
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import FloatArray, Numbers, finite_array
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import SIZES, Units, factor, unit_of
from mbma_tables.law.half_space import FLAT, HalfSpace
from mbma_tables.law.law import ContactLaw
from mbma_tables.law.make import theory_law
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.protocol import Theory, TheoryAnswer

RTOL = 1e-7  # tolerance of the force of one contact
LIGHT = 1e-9  # share of the largest force at which laws without a last contact begin
NEWTONS = {"uN": 1e-6, "mN": 1e-3, "N": 1.0, "kN": 1e3, "MN": 1e6}
_FORCE = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([umkM]?N)\s*(?:/\s*(\w+))?\s*")


@dataclasses.dataclass(frozen=True, eq=False)
class Body:
    """The body and its units: forces over E* times `newtons` are in the unit of force."""

    surface: AnySurface
    theory: Theory
    problem: HalfSpace
    shape: str
    units: dict[str, str]
    newtons: float

    @property
    def first(self) -> float:
        """Approach of first contact, or from which on a law without one is covered."""
        return -self.problem.ends[1]

    def smooth_approach(self, force: FloatArray) -> FloatArray:
        """Hertz's approach at a force over E*."""
        R = self.problem.radius
        if not self.problem.plane:
            return np.asarray((0.75 * force / math.sqrt(R)) ** (2 / 3))
        a = np.sqrt(4 * R * force / math.pi)
        return np.asarray(force / math.pi * (2 * np.log(2 * self.problem.reference / a) + 1))

    def approach_at(self, force: float) -> float:
        """Approach at a force over E*: between those of the smooth body, and of one larger by h_max."""
        from scipy.optimize import brentq

        smooth, ends = float(self.smooth_approach(np.asarray(force))), self.problem.ends

        def miss(approach: float) -> float:
            found = self.problem.solved(approach, RTOL)
            return math.log(self.problem.integral(found, found.p) / force)

        low, high = smooth - ends[1] * (1 - 1e-9), smooth - ends[0] + 2 * FLAT * ends[1]
        # no layer is thinner than its law allows: there may be no such force
        if miss(high) < 0:
            self.problem.quantities(self.problem.solved(high, RTOL))
        return float(brentq(miss, low, high, xtol=1e-12 * ends[1], rtol=1e-12))


def units_of(units: Units, plane: bool) -> tuple[dict[str, str], float]:
    """Units by quantity, and the factor from stress times area to the unit of force."""
    length, stress = units.length, units.stress
    force, newtons = unit_of("energy" if plane else "island_force", units), 1.0
    if length is not None and stress in SIZES["stress"]:
        newtons = factor(stress, "Pa", "stress") * factor(length, "m", power=1 if plane else 2) / (1e3 if plane else 1)
        force = "N/mm" if plane else "N"
    lengths = dict.fromkeys(("approach", "contact_radius", "position", "mean_separation"), length or "length")
    area = lengths["approach"] if plane else f"{lengths['approach']}^2"
    known = {"force": force, "stiffness": f"{force}/{lengths['approach']}", "area": area}
    return lengths | known | {"pressure": unit_of("pressure", units)}, newtons


def forces(given: Any, body: Body, length: str | None) -> Any:
    """Forces in the unit of results, of numbers and of texts such as "10 N"."""
    if isinstance(given, list | tuple):
        return [forces(value, body, length) for value in given]
    if not isinstance(given, str):
        return given
    found, unit = _FORCE.fullmatch(given), body.units["force"]
    if found is None or (found[3] is None) == body.problem.plane or unit not in ("N", "N/mm"):
        known = "the units of surface and E_star are known" if unit not in ("N", "N/mm") else "it"
        raise InputError(f"force must be a number or, where {known} is, like '10 {unit}', got {given!r}")
    return float(found[1]) * NEWTONS[found[2]] * (1.0 if found[3] is None else factor("mm", found[3]))


@dataclasses.dataclass(frozen=True, eq=False)
class ForceLaw:
    """Force of a rough sphere or cylinder against its approach, made by `RoughContact.law`.

    Approaches are numbers in the surface's unit or texts, "0.8 um"; zero force below `first`. `export.law_text` writes
    it as source code.

    Attributes
    ----------
    law : ContactLaw
        The same in the layout of contact laws: "pressure" is force and "area" real area, against the approach that is
        left to the largest one. Its `error` bounds the relative error of both.
    first : float
        Approach of first contact; of a layer without one, at a thousand-millionth of the largest force [length].
    """

    law: ContactLaw
    first: float
    body: Body

    def force(self, approach: ArrayLike | str) -> Numbers:
        """F; of a cylinder per length."""
        return self.law.pressure(self._left(approach))

    def stiffness(self, approach: ArrayLike | str) -> Numbers:
        """dF/d(approach)."""
        return self.law.stiffness(self._left(approach))

    def area(self, approach: ArrayLike | str) -> Numbers:
        """Real contact area; of a cylinder per length."""
        return self.law.area(self._left(approach))

    def energy(self, approach: ArrayLike | str) -> Numbers:
        """Work of loading, the integral of F over the approach."""
        return self.law.energy(self._left(approach))

    def approach(self, force: Any) -> Numbers:
        """Approach at a force."""
        found: FloatArray = self.law.at_pressure(forces(force, self.body, self.law.units.length)).mean_separation
        return self.law.h_max + self.first - found

    def _left(self, approach: ArrayLike | str) -> FloatArray:
        return self.law.h_max + self.first - finite_array("approach", self.law.units.number("approach", approach))


@dataclasses.dataclass(frozen=True)
class _Span:
    """Stands for a surface: first contact is at this remaining approach."""

    h_max: float


class _Pressed(Theory):
    """The contacts of a body as a theory of the approach that is left up to a largest one."""

    def __init__(self, body: Body, top: float, rtol: float) -> None:
        self.name, self.ends_at_h_max = body.problem.law.theory, body.problem.touches
        self._problem, self._top, self._rtol = body.problem, top, rtol

    def answer(self, surface: Any, mean_separation: FloatArray) -> TheoryAnswer:
        """Force over E*, real area and stiffness."""
        approaches = self._top - np.asarray(mean_separation, float)
        found = [self._problem.solved(approach, self._rtol) for approach in map(float, approaches.ravel())]
        rows = np.array([(*self._problem.quantities(at), at.error + self._problem.law.error) for at in found])
        force, stiffness, area, error = (part.reshape(approaches.shape) for part in rows.T)
        return TheoryAnswer(force, area, stiffness, error)

    def energy(self, surface: Any, mean_separation: FloatArray) -> FloatArray:
        """Beyond the lightest load, where force is an exponential."""
        found = self.answer(surface, mean_separation)
        return np.asarray(found.pressure**2 / found.stiffness)


def force_law(body: Body, top: float, rtol: float) -> ForceLaw:
    """Force against approach up to `top`."""
    problem, first = body.problem, body.first
    if not problem.touches:
        largest = problem.solved(top, RTOL)
        first = body.approach_at(LIGHT * problem.integral(largest, largest.p))
    span: Any = _Span(top - first)
    units = Units(problem.law.units.length)
    facts = {"surface": span, "E_star": problem.law.E_star * body.newtons, "units": units}
    law = theory_law(span, _Pressed(body, top, 0.01 * rtol), rtol, facts)
    return ForceLaw(dataclasses.replace(law, surface=None), first, body)
