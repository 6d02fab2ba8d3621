"""A rough sphere or cylinder that a flat attracts: the path of retreat from contact to pull-off.

The layer's pressure is the net one of `theories.adhesion`, a tension beyond the gap at zero load. Contacts
that were pressed together and are moved apart are followed from one to the next, since
several may balance one approach where bodies are large and soft.
"""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError, OutOfRangeError
from mbma_tables.effects.force_law import Body, PressedBody
from mbma_tables.theories.adhesion import Adhesive

NODES = (64, 128, 256)  # numbers of nodes, tried in turn
RTOL = 1e-3  # change of the pull-off from one to the next, and that beyond which it is refused
MOST_ERROR = 0.02
STEPS = 60  # of Newton's method
SETTLED = 1e-7  # its last step, of ln u
LONGEST = 3.0  # and its longest
HALVINGS = 12  # of a step that does not come nearer
SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)  # of the attraction, to find a first contact
# approaches of a path over (W^2 R/E*^2)^(1/3), W the work of parting: the first one, that from which
# on steps are alike, and the last one
FIRST, TOP, BOTTOM = 10.0, 3.0, -3.0
DEEP, PATH = 8, 32  # contacts of a path, of either part
SPLIT = 4  # halvings of a step of a path that finds no contact


@dataclasses.dataclass(frozen=True, eq=False)
class AttractingBody(Body):
    """A body whose layer attracts, of one number of nodes."""

    net: Adhesive  # of net pressures
    nodes: int = NODES[0]
    error: float = math.inf  # relative change of the pull-off with the number of nodes

    attracts = True

    @functools.cached_property
    def ends(self) -> tuple[float, float]:
        """Mean gaps [length] between which the layer is the theory's."""
        low, high = self.net.range_of_gaps(self.surface)
        return float(low), float(high)

    @property
    def touches(self) -> bool:
        """True: the layer ends where attraction is rounding."""
        return True

    def layer(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Net pressure over E* and -dp/du."""
        return self._layer(u, 1.0)

    def _layer(self, u: FloatArray, share: float) -> tuple[FloatArray, FloatArray]:
        """Pressure over E* and -dp/du with a share of the attraction."""
        low, high = self.ends
        inside = np.clip(u, low, high)
        elastic = self.net.elastic.answer(self.surface, inside)
        net = self.net.answer(self.surface, inside)
        p = elastic.pressure + share * (net.pressure - elastic.pressure)
        k = elastic.stiffness + share * (net.stiffness - elastic.stiffness)
        apart = u > high
        return np.where(apart, 0.0, p + k * (inside - u)), np.where(apart, 0.0, k)

    @functools.cached_property
    def scale(self) -> float:
        """Approach [length] by which the attraction of smooth soft bodies deforms them."""
        work = float(self.net.parting_work(self.surface))
        return float((work**2 * self.radius) ** (1 / 3))

    @functools.cached_property
    def path(self) -> list[tuple[float, float, PressedBody]]:
        """Approaches from the largest on, forces over E* and contacts, to beyond pull-off."""
        reach = float(self.net.adhesion.range) + float(self.net.free_gap(self.surface))
        start = TOP * self.scale
        last = max(BOTTOM * (self.scale + reach), -self.ends[1])
        wanted = [
            *np.geomspace(FIRST * self.scale, start, DEEP, endpoint=False),
            *np.linspace(start, last, PATH, endpoint=False),
        ]
        found: list[tuple[float, float, PressedBody]] = []
        for approach in wanted:
            if not self._follow(found, float(approach)):
                break
        return found

    def _follow(
        self, found: list[tuple[float, float, PressedBody]], approach: float
    ) -> bool:
        """Add the contact at an approach to a path, by smaller steps where they are needed."""
        if not found:
            at = self._first(approach)
            found.append((approach, self.integral(at, at.p), at))
            return True
        begin = found[-1][0]
        for halvings in range(SPLIT + 1):
            steps = np.linspace(begin, approach, 2**halvings + 1)[1:]
            before = found[-1][2]
            try:
                for step in steps:
                    before = self.next(float(step), before)
            except ConvergenceError:
                continue
            found.append((approach, self.integral(before, before.p), before))
            return True
        return False

    def _first(self, approach: float) -> PressedBody:
        """A contact that attraction changes little, from none of it on."""
        rigid = self.domain(approach, self.nodes)[2]
        u = np.maximum(rigid, float(self.net.free_gap(self.surface)))
        for share in SHARES:
            found = self._solved(approach, u, share)
            u = found.u
        return found

    def next(self, approach: float, before: PressedBody) -> PressedBody:
        """The contact at an approach, from one at a larger approach."""
        radius, pressures, rigid = self.domain(approach, self.nodes)
        # the displacement of the half-space but for its approach
        own = before.u - before.basis.v * before.radius**2 / (2 * self.radius)
        t = np.minimum(np.sqrt(pressures.v) * radius / before.radius, 1.0)
        return self._solved(
            approach, rigid + approach + self.between(before, own, t), 1.0
        )

    def _solved(self, approach: float, u: FloatArray, share: float) -> PressedBody:
        """Gaps at the nodes from others, as logarithms, in which pressures of small ones are nearly linear."""
        radius, pressures, rigid = self.domain(approach, self.nodes)
        root = pressures.root_weights
        operator = self.operator(radius, pressures)

        def missed(z: FloatArray) -> tuple[FloatArray, FloatArray]:
            p, k = self._layer(np.exp(z), share)
            return operator @ (p * root) + (rigid - np.exp(z)) * root, k

        z = np.log(np.maximum(u, 2 * self.ends[0]))
        residual, k = missed(z)
        for _ in range(STEPS):
            jacobian = (np.eye(self.nodes) + operator * k) * np.exp(z)
            step = np.linalg.solve(jacobian, residual) / root
            length = float(np.abs(step).max())
            part = min(1.0, LONGEST / length)
            for _ in range(HALVINGS):
                nearer = missed(z + part * step)
                if np.linalg.norm(nearer[0]) < np.linalg.norm(residual):
                    break
                part /= 2
            z = z + part * step
            residual, k = nearer
            if length <= SETTLED:
                break
        else:
            raise ConvergenceError(
                f"the half-space at the approach {approach:.6g} is not found in {STEPS} "
                "steps: its contact edge necks"
            )
        u = np.exp(z)
        jacobian = np.eye(self.nodes) + operator * k
        return PressedBody(radius, pressures, u, self.layer(u)[0], jacobian, self.error)

    @functools.cached_property
    def parting(self) -> tuple[float, float]:
        """Tension at which the body parts, over E*, and the approach there."""
        from scipy.optimize import minimize_scalar

        forces = [force for _, force, _ in self.path]
        lowest = int(np.argmin(forces))
        if lowest in (0, len(forces) - 1):
            raise ConvergenceError(
                "pull-off is not found: the path of retreat ends at the approach "
                f"{self.path[-1][0]:.6g}"
            )
        high, _, before = self.path[lowest - 1]
        low = self.path[lowest + 1][0]

        def force(approach: float) -> float:
            at = self.next(approach, before)
            return self.integral(at, at.p)

        # the force is flat there
        found = minimize_scalar(force, bounds=(low, high), method="bounded")
        return -float(found.fun), float(found.x)

    @property
    def pull_off(self) -> float:
        """Tension over E* at which the bodies part."""
        return self.parting[0]

    def solved(self, approach: float, rtol: float) -> PressedBody:
        """The contact at an approach in retreat."""
        if approach > self.path[0][0]:
            return self._first(approach)
        nearest = [row for row in self.path if row[0] >= approach]
        if approach < self.path[-1][0]:
            raise OutOfRangeError(
                f"approach must be above {self.path[-1][0]:.6g}, where the bodies are apart, "
                f"got {approach:.6g}",
                np.array(True),
            )
        return self.next(approach, nearest[-1][2])

    def quantities(self, at: PressedBody) -> tuple[float, float, float]:
        """Force over E*, its derivative by the approach over E*, and the real area."""
        area = self.net.elastic.answer(self.surface, np.clip(at.u, *self.ends)).area
        stiffness = at.raised(self.layer(at.u)[1])
        return (
            self.integral(at, at.p),
            self.integral(at, stiffness),
            self.integral(at, area),
        )

    def compressive(self, at: PressedBody) -> FloatArray:
        """Pressure over E* of what touches, without the attraction."""
        inside = np.clip(at.u, *self.ends)
        return np.asarray(self.net.elastic.answer(self.surface, inside).pressure)

    def approach_at(self, force: float) -> float:
        """Approach at a force over E*, that of a contact in retreat, before pull-off."""
        from scipy.optimize import brentq

        tension, parting = self.parting
        if force < -tension:
            raise OutOfRangeError(
                f"force must be at least that at which the bodies part, {-tension:.6g} of E* "
                f"times an area, got {force:.6g}",
                np.array(True),
            )

        def missed(approach: float) -> float:
            at = self.solved(approach, RTOL)
            return self.integral(at, at.p) - force

        high = self.path[0][0]
        while missed(high) < 0:
            high *= 2
        return float(brentq(missed, parting, high, xtol=1e-9 * self.scale))


def resolved(body: AttractingBody) -> AttractingBody:
    """The body with as many nodes as its pull-off needs; an error where the finest are too few."""
    tension, error = math.nan, math.inf
    finer = body
    for nodes in NODES:
        finer = dataclasses.replace(body, nodes=nodes)
        try:
            found = finer.pull_off
        except ConvergenceError:
            if nodes == NODES[-1]:
                raise
            continue
        error = abs(tension / found - 1)
        tension = found
        if error <= RTOL:
            break
    if not error <= MOST_ERROR:
        raise ConvergenceError(
            f"the pull-off is found to {error:.1g} by {finer.nodes} nodes: the edge of contact is "
            "too sharp; a smaller radius or a longer range is covered"
        )
    return dataclasses.replace(finer, error=error)
