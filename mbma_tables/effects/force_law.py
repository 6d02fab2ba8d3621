"""A sphere or cylinder on an elastic half-space with a contact law as its layer.

At the approach delta from where the smooth bodies would touch, with p = law(u), u = r^2/(2
R) - delta + w, and w the displacement of the half-space under p: the problem of J. A.
Greenwood and J. H. Tripp (J. Appl. Mech. 34 (1967) 153) with any law. Newton's unknown is w
at the nodes of `islands.half_space`. Forces are over E*; a cylinder's are per length.
"""

from __future__ import annotations

import dataclasses
import functools
import math
import re
import types
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike

from mbma_tables.bodies.bodies import Bodies, BodiesInUnits
from mbma_tables.common.arguments import FloatArray, Numbers, finite_array, require
from mbma_tables.common.errors import ConvergenceError, InputError
from mbma_tables.common.units import SIZES, Units, factor
from mbma_tables.contacts.law.law import ContactLaw
from mbma_tables.contacts.law.make import theory_law
from mbma_tables.contacts.quantities.registry import unit_of
from mbma_tables.contacts.result import Setup
from mbma_tables.islands.half_space import Basis, basis, gauss_legendre, made
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.base import Theory, TheoryAnswer

RTOL = 1e-7  # tolerance of the force of one contact
NODES = (24, 32, 48, 64, 96, 128, 192, 256, 384, 512)  # numbers of nodes, tried in turn
# steps of Newton's method, and size of the last one over the lengths that add up
STEPS = 100
SETTLED = 1e-12
EDGE = 1e-10  # share of the largest pressure that defines the edge
# share of a law's error, by which its polynomials differ where they meet: sufficient
# accuracy of forces
JUMPS = 0.05
PLACES = 4  # points per node in the search for the edge
FLAT = 0.01  # share of h_max by which a fully compressed layer may be thinner than its law allows
LIGHT = 1e-9  # share of the largest force at which laws without a last contact begin
NEWTONS = {"uN": 1e-6, "mN": 1e-3, "N": 1.0, "kN": 1e3, "MN": 1e6}
_FORCE = re.compile(
    r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([umkM]?N)\s*(?:/\s*(\w+))?\s*"
)


@functools.lru_cache(maxsize=64)
def plane_basis(nodes: int) -> Basis:
    """The basis of pressures even in x, at nodes in (0, 1), v = (x/a)^2; w for x = a.

    Of Legendre polynomials of even degree under the kernel -(2/pi) ln|x - s|, by Neumann's
    integral 2 Q_n of P_n.
    """
    x, weights = (part[nodes:] for part in gauss_legendre(2 * nodes))
    x = 2 * x - 1
    m = 2.0 * np.arange(nodes)[:, None]
    n = 2.0 * np.arange(nodes)
    with np.errstate(divide="ignore", invalid="ignore"):
        overlap = (
            4
            / (2 * n + 1)
            * (1 / ((m - n + 1) * (m + n)) - 1 / ((m - n - 1) * (m + n + 2)))
        )
    overlap[0, 0] = 6 - 4 * np.log(2)
    odd = 2 * n + 1
    values = legendre.legvander(x, 2 * nodes - 1)[:, ::2]
    return made(
        x**2, 2 * weights, values, odd, overlap * np.sqrt(np.outer(odd, odd)) / np.pi
    )


class PressedBody(NamedTuple):
    """Solution at one approach: radius of the loaded area, and values at its nodes."""

    radius: float
    basis: Basis
    u: FloatArray
    p: FloatArray  # over E*
    jacobian: FloatArray  # derivative of u by its load
    error: float  # relative change of force with the number of nodes

    def raised(self, dp: FloatArray) -> FloatArray:
        """Change of the pressures where those of the layer change by `dp` at given gaps."""
        root = self.basis.root_weights
        return np.asarray(np.linalg.solve(self.jacobian.T, dp * root)) / root


@dataclasses.dataclass(frozen=True, eq=False)
class Body:
    """What is pressed, and units: forces over E* times `newtons` are in the force's unit."""

    law: ContactLaw  # of the layer
    radius: float  # R [length]
    plane: bool  # whether it is a cylinder
    reference: float  # of a cylinder, where it does not move [length]
    surface: AnySurface
    theory: Theory
    units: dict[str, str]
    newtons: float

    attracts: ClassVar[bool] = False

    @functools.cached_property
    def ends(self) -> tuple[float, float]:
        """Mean separations between which the layer's law holds.

        That at full compression or at the maximum of pressure, and that at the end of contact.
        """
        law = self.law
        low = law.lowest if law.turning_point is None else law.turning_point
        high = min(law.highest, law.h_max if self.touches else np.inf)
        # the law's coordinate is 2 u - h_max
        return (law.h_max + low) / 2, (law.h_max + high) / 2

    @property
    def touches(self) -> bool:
        """Whether the law has a last contact."""
        return math.isinf(self.law.highest)

    def layer(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Pressure over E* and -dp/du.

        Both are zero beyond last contact; beyond the heaviest load the law is its tangent.
        """
        low, high = self.ends
        u_of_law = np.clip(u, low, high)
        p, k = self.law.pressure_and_stiffness(u_of_law)
        apart = u > high
        pressure = np.where(apart, 0.0, p + k * (u_of_law - u))
        stiffness = np.where(apart, 0.0, k)
        return pressure / self.law.E_star, stiffness / self.law.E_star

    def integral(self, at: PressedBody, values: FloatArray) -> float:
        """Over the contact, of a cylinder per length."""
        shares = np.asarray(at.basis.root_weights) ** 2
        return float(np.sum(shares * values)) * (
            2 * at.radius if self.plane else math.pi * at.radius**2
        )

    def between(self, at: PressedBody, values: FloatArray, t: FloatArray) -> FloatArray:
        """Values at the nodes, at radii of t times that of the contact, t up to 1."""
        degrees = np.arange(len(values)) * (2 if self.plane else 1)
        series = np.zeros(degrees[-1] + 1)
        series[degrees] = (
            at.basis.modes @ (values * at.basis.root_weights) * np.sqrt(2 * degrees + 1)
        )
        return np.asarray(legendre.legval(t if self.plane else 2 * t**2 - 1, series))

    def domain(
        self, approach: float, nodes: int, radius: float | None = None
    ) -> tuple[float, Basis, FloatArray]:
        """Radius of what may be loaded, its basis, and gaps of rigid bodies at the nodes."""
        if radius is None:
            radius = math.sqrt(2 * self.radius * (approach + self.ends[1]))
        pressures = plane_basis(nodes) if self.plane else basis(nodes)
        return radius, pressures, pressures.v * radius**2 / (2 * self.radius) - approach

    def operator(self, radius: float, pressures: Basis) -> FloatArray:
        """Displacements of the half-space by pressures, of values times the roots of weights."""
        operator = radius * pressures.operator
        if self.plane:
            root = pressures.root_weights
            operator = operator + 4 / math.pi * radius * math.log(
                self.reference / radius
            ) * np.outer(root, root)
        return operator

    def _newton(self, approach: float, radius: float | None, nodes: int) -> PressedBody:
        radius, pressures, rigid = self.domain(approach, nodes, radius)
        root = pressures.root_weights
        operator = self.operator(radius, pressures)
        w = np.zeros(nodes)
        scale = abs(approach) + float(np.abs(rigid).max())
        for _ in range(STEPS):
            p, k = self.layer(rigid + w / root)
            jacobian = np.eye(nodes) + operator * k
            step = np.linalg.solve(jacobian, operator @ (p * root) - w)
            w = w + step
            if np.abs(step / root).max() <= SETTLED * scale:
                break
        else:
            raise ConvergenceError(
                f"the half-space at the approach {approach:.6g} is not found in {STEPS} steps"
            )
        u = rigid + w / root
        return PressedBody(radius, pressures, u, self.layer(u)[0], jacobian, math.inf)

    def solved(self, approach: float, rtol: float) -> PressedBody:
        """The contact at an approach.

        The last number of nodes changes the force by a relative `rtol` at most.
        """
        solution = self._newton(approach, None, NODES[0])
        for nodes in NODES:
            t = np.linspace(0, 1, PLACES * nodes + 1)
            p = self.layer(self.between(solution, solution.u, t))[0]
            edge = t[min(int(np.flatnonzero(p > EDGE * p.max())[-1]) + 1, len(t) - 1)]
            before = self.integral(solution, solution.p)
            solution = self._newton(approach, solution.radius * edge, nodes)
            error = abs(before / self.integral(solution, solution.p) - 1)
            if error <= max(rtol, JUMPS * self.law.error):
                break
        if not error <= max(rtol, self.law.error):
            raise ConvergenceError(
                f"the force at the approach {approach:.6g} is found to {error:.1g} by "
                f"{nodes} nodes, not to {rtol:g}"
            )
        return solution._replace(error=error)

    def quantities(self, at: PressedBody) -> tuple[float, float, float]:
        """Force over E*, its derivative by the approach over E*, and the real area."""
        middle = finite_array("mean_separation", at.u.min())
        low = self.ends[0]
        allowed = f"at least {low:.6g}, where the law of {self.law.theory!r} ends"
        require(
            "mean_separation in the middle",
            middle,
            middle >= low - FLAT * self.law.h_max,
            allowed,
        )
        stiffness = at.raised(self.layer(at.u)[1])
        area: Any = self.law.area(np.clip(at.u, *self.ends))
        return (
            self.integral(at, at.p),
            self.integral(at, stiffness),
            self.integral(at, np.where(at.p > 0, area, 0.0)),
        )

    def compressive(self, at: PressedBody) -> FloatArray:
        """Pressure over E* of what touches."""
        return at.p

    @property
    def pull_off(self) -> float:
        """Tension over E* at which the bodies part."""
        return 0.0

    @property
    def name(self) -> str:
        """What it is, in words."""
        return (
            f"{'cylinder' if self.plane else 'sphere'} of radius {self.radius:.10g} "
            f"{self.units['approach']}"
        )

    def smooth_approach(self, force: FloatArray) -> FloatArray:
        """Hertz's approach at a force over E*."""
        if not self.plane:
            return np.asarray((0.75 * force / math.sqrt(self.radius)) ** (2 / 3))
        a = np.sqrt(4 * self.radius * force / math.pi)
        return np.asarray(force / math.pi * (2 * np.log(2 * self.reference / a) + 1))

    def approach_at(self, force: float) -> float:
        """Approach at a force over E*.

        It lies between that of the smooth body, and that of one larger by h_max.
        """
        from scipy.optimize import brentq

        smooth = float(self.smooth_approach(np.asarray(force)))
        thin, wide = self.ends

        def miss(approach: float) -> float:
            solution = self.solved(approach, RTOL)
            return math.log(self.integral(solution, solution.p) / force)

        low = smooth - wide * (1 - 1e-9)
        high = smooth - thin + 2 * FLAT * wide
        # no layer is thinner than its law allows: there may be no such force
        if miss(high) < 0:
            self.quantities(self.solved(high, RTOL))
        return float(brentq(miss, low, high, xtol=1e-12 * wide, rtol=1e-12))


def units_of(units: Units, plane: bool) -> tuple[dict[str, str], float]:
    """Units by quantity, and the factor from stress times area to the unit of force."""
    length = unit_of("approach", units)
    force = unit_of("energy" if plane else "island_force", units)
    newtons = 1.0
    if units.length is not None and units.stress in SIZES["stress"]:
        force, per = ("N/mm", 1e-3) if plane else ("N", 1.0)
        newtons = (
            per
            * factor(units.stress, "Pa", "stress")
            * factor(units.length, "m", power=1 if plane else 2)
        )
    unit_by_quantity = {
        "force": force,
        "stiffness": f"{force}/{length}",
        "area": length if plane else f"{length}^2",
    }
    unit_by_quantity |= dict.fromkeys(
        ("approach", "contact_radius", "position", "mean_separation"), length
    )
    return unit_by_quantity | {"pressure": unit_of("pressure", units)}, newtons


def forces(force: Any, body: Body, length: str | None) -> Any:
    """Forces in the unit of results, of numbers and of texts such as "10 N"."""
    if isinstance(force, list | tuple):
        return [forces(value, body, length) for value in force]
    if not isinstance(force, str):
        return force
    match = _FORCE.fullmatch(force)
    unit = body.units["force"]
    if match is None or (match[3] is None) == body.plane or unit not in ("N", "N/mm"):
        requirement = (
            "the units of surface and E_star are known"
            if unit not in ("N", "N/mm")
            else "it"
        )
        raise InputError(
            f"force must be a number or, where {requirement} is, like '10 {unit}', got {force!r}"
        )
    return (
        float(match[1])
        * NEWTONS[match[2]]
        * (1.0 if match[3] is None else factor("mm", match[3]))
    )


def _of(quantity: str, meaning: str) -> Any:
    def at_approach(self: Any, approach: ArrayLike | str) -> Numbers:
        value: Numbers = getattr(self.law, quantity)(self._left(approach))
        return value

    at_approach.__doc__ = meaning
    return at_approach


@dataclasses.dataclass(frozen=True, eq=False)
class ForceLaw:
    """Force of a rough sphere or cylinder against its approach; per length of a cylinder.

    `RoughContact.law` makes it.

    Approaches are numbers in the surface's unit or texts, "0.8 um"; zero force below `first`.
    """

    #: the same in the layout of contact laws, against the approach that is left to the
    #: largest one: "pressure" is force and "area" real area, `error` bounds the relative
    #: error of both
    law: ContactLaw
    #: approach of first contact; of a layer without one, at a thousand-millionth of the
    #: largest force [length]
    first: float
    body: Body

    force = _of("pressure", "F.")
    stiffness = _of("stiffness", "dF/d(approach).")
    area = _of("area", "Real contact area.")
    energy = _of("energy", "Work of loading, the integral of F over the approach.")

    def approach(self, force: Any) -> Numbers:
        """Approach at a force."""
        wanted = forces(force, self.body, self.law.units.length)
        left = self.law.at_pressure(wanted).mean_separation
        return self.law.h_max + self.first - left

    def _left(self, approach: ArrayLike | str) -> FloatArray:
        return (
            self.law.h_max
            + self.first
            - finite_array("approach", self.law.units.number("approach", approach))
        )


class _Pressed(Theory):
    """The contacts of a body as a theory of the approach that is left up to a largest one."""

    def __init__(self, body: Body, top: float, rtol: float) -> None:
        self.name = body.law.theory
        self.ends_at_h_max = body.touches
        self._body = body
        self._top = top
        self._rtol = rtol

    def answer(self, surface: Any, mean_separation: FloatArray) -> TheoryAnswer:
        """Force over E*, real area and stiffness."""
        approaches = self._top - np.asarray(mean_separation, float)
        solutions = [
            self._body.solved(approach, self._rtol)
            for approach in map(float, approaches.ravel())
        ]
        rows = np.array(
            [
                (*self._body.quantities(at), at.error + self._body.law.error)
                for at in solutions
            ]
        )
        force, stiffness, area, error = (
            part.reshape(approaches.shape) for part in rows.T
        )
        return TheoryAnswer(force, area, stiffness, error)

    def energy(self, surface: Any, mean_separation: FloatArray) -> FloatArray:
        """Beyond the lightest load, where force is an exponential."""
        pressed = self.answer(surface, mean_separation)
        return np.asarray(pressed.pressure**2 / pressed.stiffness)


def force_law(body: Body, top: float, rtol: float) -> ForceLaw:
    """Force against approach up to `top`."""
    first = -body.ends[1]
    if not body.touches:
        largest = body.solved(top, RTOL)
        first = body.approach_at(LIGHT * body.integral(largest, largest.p))
    # in place of a surface: first contact is where so much of the approach is left
    span: Any = types.SimpleNamespace(h_max=top - first)
    theory = _Pressed(body, top, 0.01 * rtol)
    scale = body.law.E_star * body.newtons
    bodies = BodiesInUnits(Bodies(scale), scale, math.inf, Units(body.law.units.length))
    return ForceLaw(theory_law(Setup(span, bodies, theory), theory, rtol), first, body)
