"""Derivatives of quantities of contacts by every number that they are described by.

Values are smooth to rounding, so that differences over 3e-5 of a number have nine
digits. They are taken at given gaps, where contacts cost least, and the chain rule
turns them into those at a given pressure or area P::

    dQ/dx at given P = dQ/dx at given gap - dQ/dgap (dP/dx)/(dP/dgap)

Where the second difference is larger than a smooth function has, both sides are looked at
again in smaller steps: a derivative that jumps is that of one side, and none exists where
the quantity itself jumps.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbma_tables.bodies.bodies import BodiesInUnits
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError, InputError
from mbma_tables.contacts.quantities import registry
from mbma_tables.contacts.quantities.tangential import ratio_on
from mbma_tables.contacts.question import GAPS
from mbma_tables.contacts.result import Contact
from mbma_tables.design.body_numbers import MODULI, POISSONS_RATIOS, BodyNumbers
from mbma_tables.design.unknowns import Asked, OfOneMap, Unknowns
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.base import Theory

STEP = 3e-5  # of a number, relative
FINER = 0.2  # of a step, where both sides are looked at
LEVELS = 3  # finer steps that are tried
SMOOTH = 1e-7  # relative difference of two orders of a smooth function
SAME = 1e-3  # likewise of one side of a kink
JUMP = 1e-9  # relative difference of the limits of both sides
NOISE = 2e-14  # rounding of values, relative
ROWS = 200_000  # contacts that are asked for at once
GAP = "the gap"  # the column of the gap, beside those of numbers
# from the smallest to the largest number that is defined
ENDS = {
    "hurst": (0.0, 1.0),
    "extrapolate_hurst": (0.0, 1.0),
    "area": (0.0, 1.0),
    "accommodation": (0.0, 1.0),
    "temperature": (200.0, 600.0),
    "nu": (-1.0, 0.5),
}
# names of what quantities need, and of the numbers that matter to these alone
NEEDED_BY = {
    "conductivity": ("conductivity",),
    "gas": ("temperature", "gas_pressure", "accommodation"),
}


def difference_weights(offsets: Sequence[float]) -> FloatArray:
    """Weights of values at offsets whose sum is the derivative at 0, exact for polynomials."""
    powers = np.vander(offsets, increasing=True).T
    right = np.zeros(len(offsets))
    right[1] = 1.0
    return np.linalg.solve(powers, right)


CENTRAL = (-1.0, 1.0)
ONE_SIDE = (1.0, 2.0, 3.0, 4.0)
BOTH_SIDES = (-3.0, -2.0, -1.0, 1.0, 2.0, 3.0)
SIDE_WEIGHTS = difference_weights(ONE_SIDE)
FINE_WEIGHTS = difference_weights(BOTH_SIDES)
MIDDLE_WEIGHTS = difference_weights(BOTH_SIDES[1:5])
RIGHT_WEIGHTS = difference_weights(BOTH_SIDES[3:])
SIMPLER_WEIGHTS = difference_weights(BOTH_SIDES[3:5])
LIMIT_WEIGHTS = np.array([3.0, -3.0, 1.0])  # of a parabola at 0, by its values at 1, 2, 3
# offsets of polynomials through values that are not smooth to rounding
WIDE = 100.0
FAR = 30.0  # likewise, over which one side of a kink is compared
MANY = (-6.0, -5.0, -4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
INNER = slice(3, 9)
POWERS = np.vander(MANY, 5, increasing=True)
FIT = np.linalg.pinv(POWERS)
MANY_WEIGHTS = FIT[1]
INNER_WEIGHTS = np.linalg.pinv(POWERS[INNER])[1]
MAX_ERROR = 0.05  # of a slope, over itself or the value over the number; else it is NaN


@dataclasses.dataclass(frozen=True)
class Described:
    """Contacts at one given quantity, by all their numbers."""

    surface: AnySurface
    unknowns: Unknowns  # of the surface
    body_numbers: BodyNumbers
    theory: Theory
    by: str
    numbers: Mapping[str, Any]  # by name, with the quantity held fixed as the last

    @classmethod
    def of(
        cls,
        surface: AnySurface,
        unknowns: Unknowns,
        body_numbers: BodyNumbers,
        theory: Theory,
        by: str,
        value: Any,
    ) -> Described:
        """The contacts of the numbers of a surface and of bodies."""
        if isinstance(unknowns, OfOneMap) and body_numbers.bodies.yields:
            raise InputError(
                f"theory {theory.name!r} simulates the map anew for each hardness, too coarsely for derivatives by it: "
                "give theory='calibrated', or Bodies(..., hardness=float('inf')) for the elastic contact"
            )
        numbers = {**unknowns.numbers, **body_numbers.numbers, by: value}
        return cls(surface, unknowns, body_numbers, theory, by, numbers)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the contacts."""
        return np.broadcast_shapes(*map(np.shape, self.numbers.values()))

    @property
    def gap(self) -> str:
        """The gap at which differences are taken."""
        return self.by if self.by in GAPS else "mean_separation"

    def asked(self, columns: Mapping[str, Any]) -> Asked:
        """The question at the gaps of columns of numbers."""
        bodies, interface = self.body_numbers.of_columns(columns)
        return Asked(bodies, self.gap, columns[GAP], self.theory, interface)

    def contact(self) -> Contact:
        """The contact as it was described."""
        body = self.body_numbers
        given = self.numbers[self.by]
        asked = Asked(body.bodies, self.by, given, self.theory, body.interface)
        return asked.contact(self.surface)

    def answers(
        self, columns: Mapping[str, FloatArray], names: Sequence[str]
    ) -> FloatArray:
        """Quantities of contacts at given gaps as rows, for columns of numbers of the same size."""
        size = next(iter(columns.values())).size
        table = np.empty((len(names), size))
        for own, here in self.unknowns.groups(columns):
            asked = self.asked({name: row[here] for name, row in columns.items()})
            found = self.unknowns.answers(own, asked, names)
            for name, row in zip(names, table, strict=True):
                # some do not depend on the gap, such as the plasticity index
                row[here] = found[name]
        return table

    def is_batched(self, numbers: Sequence[str], quantities: Sequence[str]) -> bool:
        """Whether contacts of arrays of these numbers are made at once."""
        of_ratio = {*MODULI, *POISSONS_RATIOS, "nu"} & set(numbers)
        if of_ratio and "nu" in needs_of(quantities):
            return False
        return self.unknowns.batches or not set(self.unknowns.numbers) & set(numbers)

    def moved(self, numbers: Mapping[str, Any]) -> Described:
        """What is described by other numbers, others as they are."""
        moved = {**self.numbers, **numbers}
        surface = self.surface
        own = self.unknowns.numbers
        if set(own) & set(numbers):
            given = {name: moved[name] for name in own}
            surface = self.unknowns.make(**given)
        body_numbers = self.body_numbers.moved(moved)
        unknowns = dataclasses.replace(
            self.unknowns, numbers={name: moved[name] for name in own}
        )
        return dataclasses.replace(
            self,
            surface=surface,
            unknowns=unknowns,
            body_numbers=body_numbers,
            numbers=moved,
        )

    def depends(self, name: str, needs: set[str]) -> bool:
        """Whether quantities with these needs depend on a number."""
        own = name.rpartition(".")[2]
        for need, numbers in NEEDED_BY.items():
            if own in numbers:
                return need in needs
        return name != "nu" or "nu" in needs


def needs_of(names: Sequence[str]) -> set[str]:
    """Names of all that quantities need, also for those that they are made of."""
    needs: set[str] = set()
    for name in names:
        declared = registry.get(name)
        needs |= {need.name for need in declared.needs}
        needs |= needs_of(declared.made_of)
    return needs


@dataclasses.dataclass(frozen=True)
class Derivatives:
    """Values and derivatives of quantities, each in the shape of the contacts."""

    values: dict[str, FloatArray]
    derivatives: dict[str, dict[str, FloatArray]]  # by number and quantity
    errors: dict[str, dict[str, FloatArray]]  # estimates
    #: by number: 0 where both sides have this derivative, else 1 or -1, the sign of its side
    sides: dict[str, NDArray[np.int8]]


@dataclasses.dataclass
class _SlopeTable:
    """Differences of rows of quantities by each direction, in a last axis of contacts."""

    slopes: FloatArray  # (directions, quantities, contacts)
    errors: FloatArray
    sides: NDArray[np.int8]  # (directions, contacts)

    def put(
        self,
        pairs: tuple[NDArray[np.intp], ...],
        chosen: NDArray[np.bool_],
        slopes: FloatArray,
        errors: FloatArray,
    ) -> None:
        """Write those of chosen quantities (quantities, pairs) at pairs of a direction and a contact."""
        place, entry = pairs
        for values, own in ((self.slopes, slopes), (self.errors, errors)):
            values[place, :, entry] = np.where(chosen, own, values[place, :, entry].T).T


@np.errstate(all="ignore")
def derivatives_of(
    described: Described, names: Sequence[str], pressed: Contact
) -> Derivatives:
    """Values of quantities and their derivatives by each number, all others held.

    Parameters
    ----------
    described : Described
    names : sequence of str
        Of the quantities.
    pressed : Contact
        The contact as described.
    """
    needs = needs_of(names)
    shape = np.broadcast_shapes(described.shape, np.shape(pressed.pressure))
    varied = [name for name in described.numbers if described.depends(name, needs)]
    columns = {
        name: np.broadcast_to(np.asarray(number, float), shape).ravel()
        for name, number in described.numbers.items()
    }
    gap = np.broadcast_to(pressed.quantity(described.gap), shape).ravel()
    columns[GAP] = np.asarray(gap, dtype=float)
    held = [] if described.by == described.gap else [described.by]
    asked = [*names, *held]
    values = np.array(
        [np.broadcast_to(pressed.quantity(name), shape).ravel() for name in asked], float
    )
    directions = [name for name in varied if name != described.by] + [GAP]
    scale = np.broadcast_to(np.asarray(pressed.surface.h_rms), shape).ravel()
    difference = _Differences(described, asked, directions)
    table = difference.of(columns, values, scale)
    if "nu" in needs:
        _add_ratio(described, table, asked, directions, pressed)
    found = _at_given(table, len(names), bool(held))
    found_names = [name for name in varied if name != described.by] + [described.by]
    order = [found_names.index(name) for name in varied]
    return Derivatives(
        {name: row.reshape(shape) for name, row in zip(names, values, strict=False)},
        _named(varied, names, found.slopes[order], shape),
        _named(varied, names, found.errors[order], shape),
        {
            name: row.reshape(shape)
            for name, row in zip(varied, found.sides[order], strict=True)
        },
    )


def _named(
    varied: Sequence[str], names: Sequence[str], table: FloatArray, shape: tuple[int, ...]
) -> dict[str, dict[str, FloatArray]]:
    """A table by the names of numbers and quantities."""
    return {
        number: {name: row.reshape(shape) for name, row in zip(names, rows, strict=True)}
        for number, rows in zip(varied, table, strict=True)
    }


def _at_given(table: _SlopeTable, count: int, is_held: bool) -> _SlopeTable:
    """Derivatives at the quantity held fixed, from those at given gaps; the last is by that quantity."""
    if not is_held:
        return table
    slopes = table.slopes[:, :count]
    held = table.slopes[:, count]
    errors = table.errors[:, :count]
    error_of_held = table.errors[:, count]
    by_gap = slopes[-1]
    # of each quantity by the one held fixed; those that do not vary have none
    by_held = np.where(by_gap == 0, 0.0, by_gap / held[-1])
    error_by_held = (errors[-1] + np.abs(by_held) * error_of_held[-1]) / np.abs(held[-1])
    moved = np.where(by_held == 0, 0.0, by_held * held[:-1, None])
    error_of_moved = np.where(
        by_held == 0,
        0.0,
        np.abs(by_held) * error_of_held[:-1, None]
        + error_by_held * np.abs(held[:-1, None]),
    )
    all_slopes = np.concatenate([slopes[:-1] - moved, by_held[None]])
    all_errors = np.concatenate([errors[:-1] + error_of_moved, error_by_held[None]])
    # a one-sided derivative by the gap makes all of them one-sided
    own = table.sides[:-1]
    sides = np.where(own == 0, np.abs(table.sides[-1]), own)
    return _SlopeTable(
        all_slopes, all_errors, np.concatenate([sides, -table.sides[-1:]]).astype(np.int8)
    )


def _add_ratio(
    described: Described,
    table: _SlopeTable,
    names: Sequence[str],
    directions: Sequence[str],
    pressed: Contact,
) -> None:
    """Add what moduli and Poisson's ratios change by the ratio of normal to tangential stiffness alone."""
    body = described.body_numbers
    varied = [name for name in (*POISSONS_RATIOS, "nu", *MODULI) if name in directions]
    if not varied:
        return
    sheared = [k for k, name in enumerate(names) if "nu" in needs_of([name])]
    shape = np.broadcast_shapes(described.shape, np.shape(pressed.pressure))
    steps = {name: STEP * (abs(float(body.numbers[name])) or 1.0) for name in varied}

    def both_ends(name: str) -> list[BodiesInUnits]:
        """Bodies with a little more and a little less of a number."""
        number = float(body.numbers[name])
        return [
            body.with_ratio(body.bodies, name, number + sign * steps[name])
            for sign in (1.0, -1.0)
        ]

    def ratios(name: str) -> list[Any]:
        """The ratios of stiffnesses at both ends."""
        direction = body.interface.direction
        return [
            ratio_on(pressed.surface, bodies.bodies, direction, pressed.area)
            for bodies in both_ends(name)
        ]

    gap = pressed.quantity(described.gap)
    found = []
    # a Poisson's ratio, which matters whatever the other numbers are
    for bodies in both_ends(varied[0]):
        asked = Asked(bodies, described.gap, gap, described.theory, body.interface)
        contact = asked.contact(described.surface)
        rows = [np.broadcast_to(contact.quantity(names[k]), shape) for k in sheared]
        found.append(np.array(rows, dtype=float).reshape(len(sheared), -1))
    more, less = ratios(varied[0])
    by_ratio = (found[0] - found[1]) / np.ravel(np.broadcast_to(more - less, shape))
    for name in varied:
        more, less = ratios(name)
        slope = np.ravel(np.broadcast_to((more - less) / (2 * steps[name]), shape))
        table.slopes[directions.index(name), sheared] += by_ratio * slope


@dataclasses.dataclass(frozen=True)
class _Differences:
    """Differences of quantities at given gaps by several directions."""

    described: Described
    names: Sequence[str]
    directions: Sequence[str]

    def of(
        self, columns: Mapping[str, FloatArray], values: FloatArray, scale: FloatArray
    ) -> _SlopeTable:
        """All differences, in blocks of contacts."""
        count = values.shape[1]
        table = _SlopeTable(
            np.empty((len(self.directions), len(self.names), count)),
            np.empty((len(self.directions), len(self.names), count)),
            np.zeros((len(self.directions), count), np.int8),
        )
        size = max(1, ROWS // (2 * len(self.directions)))
        blocks = [slice(start, start + size) for start in range(0, count, size)]
        while blocks:
            here = blocks.pop(0)
            part = {name: column[here] for name, column in columns.items()}
            steps = self._steps(part, scale[here])
            try:
                found = self._block(part, values[:, here], steps)
            except (InputError, ConvergenceError):
                # an entry beside the end of what is defined is found by halves
                if part[GAP].size > 1:
                    blocks = [*_halves(here, part[GAP].size), *blocks]
                    continue
                found = self._at_an_end(part, values[:, here], steps)
            table.slopes[..., here] = found.slopes
            table.errors[..., here] = found.errors
            table.sides[..., here] = found.sides
        return table

    def _steps(self, part: Mapping[str, FloatArray], scale: FloatArray) -> FloatArray:
        """Steps of each direction; of numbers that are zero those of a height, or of one."""
        steps = []
        for name in self.directions:
            size = np.abs(part[name])
            of_zero = scale if name in (GAP, *GAPS) else 1.0
            steps.append(STEP * np.where(size > 0, size, of_zero))
        return np.array(steps)

    def _sides(self, part: Mapping[str, FloatArray], steps: FloatArray) -> NDArray[Any]:
        """Signs of directions that end: 0 where there is room on both sides."""
        sides = np.zeros(steps.shape, np.int8)
        for name, step, row in zip(self.directions, steps, sides, strict=True):
            row[:] = self.described.unknowns.one_sided.get(name, 0)
            low, high = ENDS.get(name.rpartition(".")[2], (-np.inf, np.inf))
            row[part[name] + step > high] = -1
            row[part[name] - step < low] = 1
        return sides

    def _block(
        self,
        part: Mapping[str, FloatArray],
        values: FloatArray,
        steps: FloatArray,
        sides: NDArray[Any] | None = None,
    ) -> _SlopeTable:
        """Differences of a block: central where there is room on both sides."""
        if sides is None:
            sides = self._sides(part, steps)
        central = np.nonzero(sides == 0)
        ended = np.nonzero(sides)
        step = steps[central]
        # a batch of spectra and one of them differ by more than rounding
        with_base = self.described.unknowns.batches
        (below, above), base = self._at_pairs(part, central, step, CENTRAL, with_base)
        if with_base:
            values = base
        table = _SlopeTable(
            np.empty((len(self.directions), *values.shape)),
            np.empty((len(self.directions), *values.shape)),
            sides,
        )
        place, entry = central
        here = values[:, entry]
        slope = (above - below) / (2 * step)
        second = np.abs(above - 2 * here + below)
        size = np.maximum(np.maximum(np.abs(above), np.abs(below)), np.abs(here))
        table.slopes[place, :, entry] = slope.T
        # the third derivative is about the second squared over the first
        first = np.abs(above - below)
        cubic = np.minimum(second**2 / first, second) / 6
        error = (np.where(second == 0, 0.0, cubic) + NOISE * size) / step
        table.errors[place, :, entry] = error.T
        bent = (cubic > SMOOTH * np.maximum(first / 2, STEP * size)).any(axis=0)
        if bent.any():
            some = place[bent], entry[bent]
            self._look_again(table, part, some, step[bent] * FINER)
        if ended[0].size:
            self._one_sided(table, part, ended, steps[ended], sides[ended])
        return table

    def _at_pairs(
        self,
        part: Mapping[str, FloatArray],
        pairs: tuple[NDArray[np.intp], ...],
        step: FloatArray,
        offsets: Sequence[float],
        with_base: bool = False,
    ) -> tuple[FloatArray, FloatArray]:
        """Quantities where a direction of an entry is moved by multiples of its step: (offsets, quantities, pairs).

        Also the quantities of the entries as they are, by the same route, if asked for.
        """
        place, entry = pairs
        count = place.size
        columns = {}
        for name, column in part.items():
            moved = np.tile(column[entry], len(offsets))
            # the entries as they are, for second differences
            columns[name] = np.concatenate([moved, column]) if with_base else moved
        for k, offset in enumerate(offsets):
            row = slice(k * count, (k + 1) * count)
            for direction in np.unique(place):
                some = place == direction
                name = self.directions[direction]
                columns[name][row][some] += offset * step[some]
        found = self.described.answers(columns, self.names)
        size = count * len(offsets)
        moved = found[:, :size].reshape(len(self.names), len(offsets), count)
        return moved.swapaxes(0, 1), found[:, size:]

    def _one_sided(
        self,
        table: _SlopeTable,
        part: Mapping[str, FloatArray],
        pairs: tuple[NDArray[np.intp], ...],
        step: FloatArray,
        side: NDArray[Any],
    ) -> None:
        """Write differences towards one side to the table."""
        signed = step * side
        found, _ = self._at_pairs(part, pairs, signed, ONE_SIDE)
        slope = np.tensordot(SIDE_WEIGHTS, found, 1) / signed
        simpler = np.tensordot(RIGHT_WEIGHTS, found[:3], 1) / signed
        size = np.abs(found).max(axis=0)
        error = np.abs(slope - simpler) * STEP + 10 * NOISE * size / step
        place, entry = pairs
        table.slopes[place, :, entry] = slope.T
        table.errors[place, :, entry] = error.T
        table.sides[place, entry] = side

    def _look_again(
        self,
        table: _SlopeTable,
        part: Mapping[str, FloatArray],
        pairs: tuple[NDArray[np.intp], ...],
        step: FloatArray,
        levels: int = LEVELS,
    ) -> None:
        """Write differences over finer and finer steps to the table, until they are those of a smooth function."""
        found, _ = self._at_pairs(part, pairs, step, BOTH_SIDES)
        size = np.abs(found).max(axis=0)
        slope = np.tensordot(FINE_WEIGHTS, found, 1) / step
        coarser = np.tensordot(MIDDLE_WEIGHTS, found[1:5], 1) / step
        noise = 4 * NOISE * size / step
        error = np.abs(slope - coarser)
        relative = STEP * FINER ** (LEVELS + 1 - levels)
        allowed = SMOOTH * np.maximum(np.abs(slope), size / (step / relative))
        rough = ~(error <= np.maximum(allowed, 10 * noise))
        # of a kink as of |x|, central differences of every order are equal, and no side's
        left = np.tensordot(RIGHT_WEIGHTS, found[2::-1], 1) / -step
        right = np.tensordot(RIGHT_WEIGHTS, found[3:], 1) / step
        steepest = np.maximum(np.abs(left), np.abs(right))
        rough |= ~(np.abs(right - left) <= SAME * steepest + 10 * (allowed + noise))
        place, entry = pairs
        table.slopes[place, :, entry] = slope.T
        table.errors[place, :, entry] = (error + noise).T
        again = rough.any(axis=0)
        if not again.any():
            return
        some = place[again], entry[again]
        if levels > 1:
            self._look_again(table, part, some, step[again] * FINER, levels - 1)
            return
        self._to_one_side(table, part, some, step[again], found[..., again])

    def _to_one_side(
        self,
        table: _SlopeTable,
        part: Mapping[str, FloatArray],
        pairs: tuple[NDArray[np.intp], ...],
        step: FloatArray,
        found: FloatArray,
    ) -> None:
        """Write derivatives of the side in contact to the table, where both sides differ but each is smooth."""
        sides = [_OneSided(found[2::-1], -step), _OneSided(found[3:], step)]
        size = np.abs(found).max(axis=0)
        jumps = ~(np.abs(sides[0].limit - sides[1].limit) <= JUMP * size)
        ends = sides[0].is_empty | sides[1].is_empty
        uneven = ~ends & (jumps | ~sides[0].is_smooth(size) | ~sides[1].is_smooth(size))
        kinked = (~uneven).any(axis=0)
        strength = [np.where(side.is_empty, 0.0, np.abs(side.slope)) for side in sides]
        share = np.nan_to_num((strength[1] - strength[0]) * np.abs(step) / size)
        side = np.where(share.sum(axis=0) >= 0, 1, -1)
        slope = np.where(side > 0, sides[1].slope, sides[0].slope)
        place, entry = pairs
        keep = ~uneven
        table.put(pairs, keep, slope, np.abs(sides[1].slope - sides[1].simpler))
        table.sides[place, entry] = np.where(kinked, side, 0)
        if kinked.any():
            some = place[kinked], entry[kinked]
            far = np.abs(step[kinked]) * (FAR / FINER**LEVELS) * side[kinked]
            self._compare_with_far(table, part, some, far, keep[:, kinked])
        wide = uneven.any(axis=0)
        if wide.any():
            some = place[wide], entry[wide]
            over = step[wide] * (WIDE / FINER**LEVELS)
            self._over_more(table, part, some, over, uneven[:, wide])

    def _compare_with_far(
        self,
        table: _SlopeTable,
        part: Mapping[str, FloatArray],
        pairs: tuple[NDArray[np.intp], ...],
        step: FloatArray,
        chosen: NDArray[np.bool_],
    ) -> None:
        """Raise the errors of one side's derivatives to the difference from those over far longer steps.

        A sum over bands of wavelengths may bend over the width of one band as the theory
        does not: its derivative is that of this sum alone.
        """
        try:
            found, _ = self._at_pairs(part, pairs, step, ONE_SIDE)
        except (InputError, ConvergenceError):
            # nothing is defined so far on this side
            return
        place, entry = pairs
        far = np.tensordot(SIDE_WEIGHTS, found, 1) / step
        slopes = table.slopes[place, :, entry].T
        apart = np.nan_to_num(np.abs(far - slopes))
        errors = np.maximum(table.errors[place, :, entry].T, apart)
        table.put(pairs, chosen, slopes, errors)

    def _over_more(
        self,
        table: _SlopeTable,
        part: Mapping[str, FloatArray],
        pairs: tuple[NDArray[np.intp], ...],
        step: FloatArray,
        chosen: NDArray[np.bool_],
    ) -> None:
        """Write slopes of polynomials over wide steps to the table, of values that are not smooth; NaN at jumps."""
        try:
            found, _ = self._at_pairs(part, pairs, step, MANY)
        except (InputError, ConvergenceError):
            found = np.full((len(MANY), *chosen.shape), np.nan)
        slope = np.tensordot(MANY_WEIGHTS, found, 1) / step
        inner = np.tensordot(INNER_WEIGHTS, found[INNER], 1) / step
        coefficients = np.tensordot(FIT, found, 1)
        apart = found - np.tensordot(POWERS, coefficients, 1)
        spread = np.sqrt(np.sum(apart**2, axis=0) / (len(MANY) - len(FIT)))
        error = np.abs(slope - inner) + 2 * np.linalg.norm(MANY_WEIGHTS) * spread / step
        of_number = step / (STEP * WIDE)
        size = np.maximum(np.abs(found).max(axis=0) / of_number, np.abs(slope))
        exists = error <= MAX_ERROR * size
        table.put(pairs, chosen, np.where(exists, slope, np.nan), error)

    def _at_an_end(
        self, part: Mapping[str, FloatArray], values: FloatArray, steps: FloatArray
    ) -> _SlopeTable:
        """Differences of one contact, each direction towards the side on which there are contacts."""
        sides = self._sides(part, steps)
        tables = []
        for k, name in enumerate(self.directions):
            alone = dataclasses.replace(self, directions=[name])
            tried = (
                [sides[k : k + 1]]
                if sides[k].any()
                else [np.full((1, 1), sign, np.int8) for sign in (0, 1, -1)]
            )
            tables.append(_first(alone, part, values, steps[k : k + 1], tried))
        return _SlopeTable(
            np.concatenate([each.slopes for each in tables]),
            np.concatenate([each.errors for each in tables]),
            np.concatenate([each.sides for each in tables]),
        )


class _OneSided:
    """One side of a point: three values of quantities at one, two and three steps."""

    def __init__(self, found: FloatArray, step: FloatArray) -> None:
        self.step = np.abs(step)
        self.slope = np.tensordot(RIGHT_WEIGHTS, found, 1) / step
        self.simpler = np.tensordot(SIMPLER_WEIGHTS, found[:2], 1) / step
        self.limit = np.tensordot(LIMIT_WEIGHTS, found, 1)
        #: where there is no contact, or nothing that is defined
        self.is_empty = (found == 0).all(axis=0) | ~np.isfinite(found).all(axis=0)

    def is_smooth(self, size: FloatArray) -> NDArray[np.bool_]:
        """Where two orders of differences agree."""
        apart = np.abs(self.slope - self.simpler)
        # rounding over these steps
        noise = 10 * NOISE * size / self.step
        smooth: NDArray[np.bool_] = apart <= SAME * np.abs(self.slope) + noise
        return smooth


def _first(
    difference: _Differences,
    part: Mapping[str, FloatArray],
    values: FloatArray,
    steps: FloatArray,
    tried: Sequence[NDArray[Any]],
) -> _SlopeTable:
    """The differences towards the first of several sides on which there are contacts."""
    for sides in tried[:-1]:
        try:
            return difference._block(part, values, steps, sides)
        except (InputError, ConvergenceError):
            continue
    return difference._block(part, values, steps, tried[-1])


def _halves(here: slice, size: int) -> Iterator[slice]:
    """Both halves of a block of contacts."""
    middle = here.start + size // 2
    yield slice(here.start, middle)
    yield slice(middle, here.start + size)
