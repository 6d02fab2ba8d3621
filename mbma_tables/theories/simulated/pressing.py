"""One map pressed at a list of loads by boundary elements, and the flow through its gaps.

Each load, and each flow, is stored in `mbma_tables.common.cache` as soon as it is computed.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
from collections.abc import Callable
from typing import Any

import numpy as np

from mbma_tables.common import cache
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.common.interrupts import at_once
from mbma_tables.common.progress import doing, shown
from mbma_tables.surfaces.map_simulation import ROUNDING
from mbma_tables.theories.simulated.boundary_elements import (
    BoundaryElementContact,
    composed,
    wavenumbers,
    waves,
)
from mbma_tables.theories.simulated.grids import FULL
from mbma_tables.theories.simulated.reynolds import AT_ONCE, flow_tensor

TOLERANCE = FULL.tolerance
LOWEST, HIGHEST = FULL.tested  # A/A0 that the loads reach at least
# loads added for that, at most, and their factors
MORE = 6
LIGHTER = 0.5
HEAVIER = 1.2
# loads added where the areas of two neighbours differ by more than this factor, at most so
# many; where an area jumps, as when a plateau is reached, no two loads closer than this in
# ln F
SPACING = 2.5
BETWEEN = 10
CLOSEST = 0.1
# loads added for the flow, at most: where its logarithm falls by more than this, and where
# an axis closes between loads further apart than this in ln F, which counts as such a fall
FLOWS = 6
STEEP = 1.2
NARROW = 0.1
CLOSING = 3.5
# A/A0 up to which flow along both axes was open on most maps, so that its scatter is known;
# a fall beyond counts less
AREA_OF_FLOW = 0.2
BEYOND = 0.6
KEPT = "pressed 2"  # of what is cached: another text where this file finds other numbers
QUANTITIES = ("area", "mean_separation", "energy")
YIELDING = (
    *QUANTITIES,
    "plane_separation",
    "area_yielded",
    "frozen_stiffness",
    "pressure_weighted_height",
)


def coarser(
    values: FloatArray, points: float = 0.0, mirrored: bool = False
) -> FloatArray:
    """A map on half as many points along each axis, by its waves of at least `points` of the new sampling steps."""
    from scipy.signal import resample

    if points:
        q = wavenumbers(values.shape, values.shape, mirrored)
        kept = np.where(q <= np.pi / points * (1 + ROUNDING), waves(values, mirrored), 0)
        values = composed(kept, values.shape, mirrored)
    half = tuple(count // 2 for count in values.shape)
    if mirrored:
        return composed(waves(values, True), half, True)
    return np.asarray(resample(resample(values, half[0]), half[1], axis=1))


class Press:
    """A map that is pressed when it is first called with a load over A0 E*; lengths of the map.

    `gradient` is about its rms gradient, `hardness` is over E*, and `left_out` the
    wavelength [length] below which a large map was cut off, 0 if it was not; `mirrored` as
    for `BoundaryElementContact`.
    """

    def __init__(
        self, heights: FloatArray, sizes: tuple[float, float], gradient: float, tolerance: float = TOLERANCE,
        mirrored: bool = False, hardness: float = np.inf, left_out: float = 0.0,
    ) -> None:  # fmt: skip
        self.left_out = left_out
        self.heights, self.sizes, self.gradient, self.mirrored = (
            heights,
            sizes,
            gradient,
            mirrored,
        )
        self._tolerance, self._cap = tolerance, hardness / gradient
        self._engine: BoundaryElementContact | None = None
        self.quantities = YIELDING if hardness < np.inf else QUANTITIES
        # of rms gradient one, heights of order one
        self.scale = float(np.abs(heights).max())
        self._sizes = sizes[0] * gradient / self.scale, sizes[1] * gradient / self.scale
        settings = (
            heights.shape,
            *(f"{side:.9g}" for side in self._sizes),
            tolerance,
            mirrored,
            f"{self._cap:.9g}",
        )
        self._own = _digest(heights / self.scale, *settings)
        units = {
            "energy": gradient * self.scale,
            "frozen_stiffness": gradient / self.scale,
        }
        lengths = dict.fromkeys(
            ("mean_separation", "plane_separation", "pressure_weighted_height"),
            self.scale,
        )
        self._units = np.array(
            [(units | lengths).get(name, 1.0) for name in self.quantities]
        )
        self._found: dict[float, tuple[FloatArray, FloatArray]] = {}

    def name(self, load: float) -> str:
        """Under which a load is cached."""
        return _digest(self._own, f"{load / self.gradient:.9g}")

    def __call__(self, load: float) -> tuple[FloatArray, FloatArray]:
        """`quantities`, and the gaps in single precision."""
        if load not in self._found:
            name = self.name(load)
            kept = cache.load(name, row=(len(self.quantities),), gap=self.heights.shape)
            if kept is None:
                if self._engine is None:
                    own = self.heights / self.scale
                    self._engine = BoundaryElementContact(
                        own, self._sizes, self._tolerance, self._cap, self.mirrored
                    )
                result = self._engine.press(load / self.gradient)
                if self._cap < np.inf:
                    result["frozen_stiffness"] = self._engine.frozen_stiffness()
                row = np.array([result[name] for name in self.quantities])
                kept = {"row": row, "gap": self._engine.gap.astype(np.float32)}
                cache.keep(name, **kept)
            self._found[load] = (
                kept["row"] * self._units,
                kept["gap"] * np.float32(self.scale),
            )
        return self._found[load]

    def residual(self, load: float) -> FloatArray:
        """Heights of the map after a load over A0 E*, whose yielded points stay flat."""
        name = f"{self.name(load)}-residual"
        kept = cache.load(name, heights=self.heights.shape)
        if kept is None:
            own = self.heights / self.scale
            engine = BoundaryElementContact(
                own, self._sizes, self._tolerance, self._cap, self.mirrored
            )
            with shown("boundary elements"):
                engine.press(load / self.gradient)
            kept = {"heights": engine.residual_heights()}
            cache.keep(name, **kept)
        return np.asarray(kept["heights"] * self.scale)

    def loads(self, wanted: FloatArray, more: bool) -> tuple[FloatArray, FloatArray]:
        """Loads, and rows of `quantities` at them, rising.

        `more` are added until contact is covered far enough, and where it grows too much
        from load to load.
        """
        found: dict[float, FloatArray] = {}

        def add(load: float) -> None:
            number = max(len(wanted), len(found) + 1)
            done = len(found)
            doing(f"boundary elements {_bar(done, number)}", done / number)
            found[load] = self(load)[0]

        with shown("boundary elements"):
            for load in wanted.tolist():
                add(load)
            for _ in range(MORE if more else 0):
                low = min(found)
                high = max(found)
                # where one element touches, the solver may fail
                if found[low][0] > LOWEST:
                    with contextlib.suppress(ConvergenceError):
                        add(low * LIGHTER)
                if (
                    found[high][0] < HIGHEST
                    and high * HEAVIER < self._cap * self.gradient
                ):
                    add(high * HEAVIER)
            for _ in range(BETWEEN if more else 0):
                between = _widest(
                    np.array(sorted(found)),
                    np.array([found[load][0] for load in sorted(found)]),
                )
                if between is None:
                    break
                add(between)
        cache.trim()
        return np.array(sorted(found)), np.array(
            [found[load] for load in sorted(found)]
        ).T

    def flow(self, load: float) -> FloatArray:
        """Flow coefficients xx, yy and xy [length^3] through the gaps under a load over A0 E*; 0 where blocked."""
        name = f"{self.name(load)}-flow"
        kept = cache.load(name, flow=(3,))
        if kept is None:
            kept = {
                "flow": flow_tensor(self(load)[1] / self.scale, self.sizes, self.mirrored)
            }
            cache.keep(name, **kept)
        return np.asarray(kept["flow"] * self.scale**3)

    def flows(
        self, x: FloatArray, separation: Callable[[FloatArray], FloatArray]
    ) -> tuple[FloatArray, FloatArray]:
        """Mean gaps u of some loads [length], falling, and their flow, shape (m, 3).

        At every second ln F, then between loads where it falls most, or an axis closes;
        `separation` is u at ln F.
        """
        found: dict[float, FloatArray] = {}
        # between mirrors the two axes are solved at once
        side_by_side = 1 if self.mirrored or self.heights.size > AT_ONCE else 2

        def add(loads: list[float]) -> None:
            number = max(x.size // 2 + FLOWS // 2, len(found) + len(loads))
            done = len(found)
            doing(f"flow through the gaps {_bar(done, number)}", done / number)
            forces = [float(np.exp(own)) for own in loads]
            # gaps first: the engine goes from load to load
            for force in forces:
                self(force)
            flows = at_once([functools.partial(self.flow, force) for force in forces])
            found.update(zip(loads, flows, strict=True))

        with shown("flow through the gaps"):
            every = x[::2].tolist()
            for first in range(0, len(every), side_by_side):
                add(every[first : first + side_by_side])
                # once blocked both ways, heavier loads are
                if not found[max(found)][:2].any():
                    break
            most = len(found) + FLOWS
            while len(found) < most:
                steep = self._steep(found, x)[: min(side_by_side, most - len(found))]
                if not steep:
                    break
                add(steep)
        at = np.array(sorted(found))
        cache.trim()
        return separation(at), np.array([found[own] for own in at.tolist()])

    def _steep(self, found: dict[float, FloatArray], x: FloatArray) -> list[float]:
        """Loads ln F between those whose flow falls most from one to the next, steepest first."""
        at = np.array(sorted(found))
        K = np.array([found[own][:2] for own in at.tolist()])
        with np.errstate(divide="ignore", invalid="ignore"):
            fall = np.nan_to_num(np.log(K[:-1] / K[1:]), posinf=np.inf)
        closing = np.where(np.diff(at) > NARROW, CLOSING, 0.0)[:, None]
        area = np.array([self(float(np.exp(own)))[0][0] for own in at[:-1].tolist()])
        worst = np.where(np.isinf(fall), closing, fall).max(axis=1)
        worst = worst * np.where(area > AREA_OF_FLOW, BEYOND, 1.0)
        loads = []
        for k in np.argsort(-worst, kind="stable"):
            if worst[k] < STEEP:
                break
            between = x[(x > at[k]) & (x < at[k + 1])]
            middle = between[between.size // 2] if between.size else at[k : k + 2].mean()
            loads.append(float(middle))
        return loads


def _widest(force: FloatArray, area: FloatArray) -> float | None:
    """The load in the middle, in ln F, of the neighbours whose areas differ most; None if they are close enough."""
    ratio = area[1:] / area[:-1]
    # lighter and heavier contacts than those that the loads reach are not valid
    inside = (
        (area[1:] > LOWEST)
        & (area[:-1] < HIGHEST)
        & (np.diff(np.log(force)) > 2 * CLOSEST)
    )
    ratio = np.where(inside, ratio, 0.0)
    widest = int(ratio.argmax())
    if ratio[widest] <= SPACING:
        return None
    return float(np.sqrt(force[widest] * force[widest + 1]))


def _digest(*parts: Any) -> str:
    """SHA-256 of numbers and of arrays, these in single precision, so that it is independent of the unit of length."""
    digest = hashlib.sha256(KEPT.encode())
    for part in parts:
        array = isinstance(part, np.ndarray)
        digest.update(
            np.ascontiguousarray(part, "<f4").tobytes()
            if array
            else f";{part!r};".encode()
        )
    return digest.hexdigest()


def _bar(done: int, number: int) -> str:
    return f"[{'#' * done}{'.' * (number - done)}] {done} of {number}"
