"""Values of quantities of contacts with their derivatives by every number of the description, and their table."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.bodies.bodies import Bodies
from mbma_tables.common.arguments import hinted
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import Units
from mbma_tables.contacts.quantities import registry
from mbma_tables.contacts.quantities.interface import Gas, Interface
from mbma_tables.contacts.quantities.registry import unit_of
from mbma_tables.contacts.question import Question
from mbma_tables.design.body_numbers import BodyNumbers
from mbma_tables.design.derivatives import Described, derivatives_of
from mbma_tables.design.labels import Labels
from mbma_tables.design.specimen import surface_of_entries
from mbma_tables.design.unknowns import Unknowns, unknowns_of
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories import resolve
from mbma_tables.theories.base import Theory, UserTheory

if TYPE_CHECKING:
    from mbma_tables.contacts.result import Contact

MOST_SHOWN = 10  # contacts whose tables a text has
NO_LABELS = Labels(None)
SIDES = {1: "increasing", -1: "decreasing"}


@dataclasses.dataclass(frozen=True, eq=False)
class Sensitivity:
    """Values of quantities and their derivatives by each number; its text is a table.

    Numbers, answers and derivatives are numbers for one contact, and arrays in the shape of
    a batch.
    """

    by: str  #: quantity held fixed: "separation", "mean_separation", "pressure" or "area"
    parameters: dict[
        str, Any
    ]  #: numbers of the surfaces, the bodies and the gas, and the quantity held fixed
    answers: dict[str, Any]  #: the quantities for these numbers
    #: d ln(answer)/d ln(number) by number and answer, the other numbers held; NaN where the
    #: answer jumps, or is zero
    slopes: dict[str, dict[str, Any]]
    errors: dict[str, dict[str, Any]]  #: estimates of their errors
    #: d(answer)/d(number), in the unit of the answer over that of the number
    derivatives: dict[str, dict[str, Any]]
    #: by number 0, or where derivatives are those of one side alone the sign of that side: 1
    #: of larger numbers, -1 of smaller ones
    sides: dict[str, Any]
    units: Units  #: of numbers with a length or a stress
    parameter_units: dict[str, str]  #: of other numbers
    answer_units: dict[str, str]  #: the unit of each answer

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the batch; () for one contact."""
        return np.shape(next(iter(self.answers.values())))

    def unit(self, name: str) -> str:
        """The unit of a number or of an answer."""
        for units in (self.answer_units, self.parameter_units):
            if name in units:
                return units[name]
        return unit_of(name.rpartition(".")[2], self.units)

    def values_and_jacobian(
        self,
        quantities: Sequence[str] | None = None,
        numbers: Sequence[str] | None = None,
    ) -> tuple[Any, Any]:
        """Answers, and their derivatives, as arrays.

        Parameters
        ----------
        quantities, numbers : sequence of str, optional
            In this order; by default all.

        Returns
        -------
        values : ndarray, shape (..., quantities)
        jacobian : ndarray, shape (..., quantities, numbers)
        """
        answers = list(self.answers) if quantities is None else quantities
        rows = list(self.parameters) if numbers is None else numbers
        values = np.stack([self.answers[name] for name in answers], axis=-1)
        jacobian = [
            np.stack([self.derivatives[row][name] for row in rows], axis=-1)
            for name in answers
        ]
        return values, np.stack(jacobian, axis=-2)

    def __str__(self) -> str:
        if self.shape == ():
            return self._table(())
        entries = list(np.ndindex(self.shape))
        tables = []
        for entry in entries[:MOST_SHOWN]:
            place = ", ".join(map(str, entry))
            tables.append(f"[{place}]\n{self._table(entry)}")
        if len(entries) > MOST_SHOWN:
            tables.append(
                f"and {len(entries) - MOST_SHOWN} more: slopes[number][answer] has them all"
            )
        return "\n\n".join(tables)

    def _table(self, entry: tuple[int, ...]) -> str:
        """The table of one contact."""
        width = max(map(len, self.parameters)) + 2
        lines = [
            f"d ln(answer)/d ln(parameter) at given {self.by}",
            f"{'':{width}}{'value':>22}",
        ]
        widths = {name: max(17, len(name) + 2) for name in self.answers}
        lines[1] += "".join(f"{name:>{widths[name]}}" for name in self.answers)
        notes = []
        for name, value in self.parameters.items():
            slopes = ""
            for answer in self.answers:
                slope = _at(self.slopes[name][answer], entry)
                slopes += f"{round(slope, 3) + 0.0:>{widths[answer]}.3f}"
            unit = self.unit(name)
            number = f"{_at(value, entry):.5g} {unit}".removesuffix(" 1")
            lines.append(f"{name:{width}}{number:>22}{slopes}")
            side = int(_at(self.sides[name], entry))
            if side:
                notes.append(f"{name}: one-sided, for {SIDES[side]} {name}")
        zero = [name for name in self.answers if _at(self.answers[name], entry) == 0]
        if zero:
            notes.append(f"zero, which has no logarithm: {', '.join(zero)}")
        return "\n".join(lines + notes)


def _at(values: Any, entry: tuple[int, ...]) -> float:
    """The number of one contact."""
    return float(np.asarray(values)[entry])


@hinted
def sensitivity(
    surface: AnySurface | Mapping[str, Any],
    bodies: Bodies | ArrayLike | str = 1.0,
    *,
    separation: ArrayLike | None = None,
    mean_separation: ArrayLike | None = None,
    pressure: ArrayLike | None = None,
    area: ArrayLike | None = None,
    gas: str | Gas | Mapping[str, Any] | None = None,
    theory: str | Theory | UserTheory | None = None,
    quantities: Sequence[str] | None = None,
) -> Sensitivity:
    """Quantities of a contact and their derivatives by each number of its description, for any theory.

    Parameters
    ----------
    surface : Surface or mapping
        One surface, or a batch; or by name the arguments of `Surface.from_roughness`, of
        `Surface` or of `Surface.from_moments`. Its parameters are its five numbers, or
        those of the drawing that it was made from. Those of one
        given by a spectrum are
        "heights" and "lengths", factors of all heights and of all lengths along the plane,
        like an instrument's calibration factors; h_max alone; the "shortest" and "longest"
        wavelengths, cut-offs that only remove wavelengths, and with an extrapolated
        spectrum its exponent "extrapolate_hurst". Where the calibrated law uses a map's own
        heights and curves, and where the map is simulated, h_max and cut-offs are left out:
        they follow from the map.
    separation, mean_separation, pressure, area : array_like or str, one of them
        The quantity held fixed, as for `contact`; it broadcasts with the surface.
    bodies : Bodies or array_like or str
        As for `contact`. Their numbers are "E_star", or "part_a.E" and "part_b.E" with
        Poisson's ratios "part_a.nu" and "part_b.nu" where the modulus is that of two bodies;
        "hardness"; "nu" for the tangential stiffness; "conductivity", or "part_a.conductivity"
        and "part_b.conductivity".
    gas : str, Gas or mapping, optional
        In the gaps, as for `Joint`: adds `gas_conductance` and `total_conductance`, and of a
        `Gas` the numbers "temperature", "gas_pressure" and "accommodation".
    theory : str or theory, optional
        As for `contact`, with the same default. The simulation of a map answers for its
        heights and lengths by similarity, without a hardness.
    quantities : sequence of str, optional
        Names of quantities of a contact, in whose units they are. Default: those with a
        model uncertainty that tables show of the contact, such as pressure, area, stiffness
        and, of bodies with a conductivity, `solid_conductance`.

    Returns
    -------
    Sensitivity
        Derivatives have errors of at most 1e-6 of answer/number where the theory is smooth,
        which `errors` estimates. Where any number is a DataArray, all of them are, with its
        dimensions and coordinates. At the ends of what is defined, where contact begins or
        ends, and where the derivative of the theory jumps, they are those of one side, which
        `sides` names.

    Raises
    ------
    InputError, OutOfRangeError
        As `contact`; for plain arrays beside DataArrays, unknown names, quantities that need what was not given,
        and for the simulation of a map with a hardness.

    Examples
    --------
    >>> from mbma_tables import Surface, sensitivity
    >>> ground = Surface.from_roughness(Rq=0.5, Rdq=0.1, longest=100, hurst=0.8, h_max=1.8, unit="um")
    >>> found = sensitivity(ground, "100 GPa", pressure="10 MPa")
    >>> print(f"area goes like Rdq^{found.slopes['Rdq']['area']:.2f}")
    area goes like Rdq^-1.15
    >>> found = sensitivity(ground, "steel 1020", pressure="10 MPa", theory="calibrated")
    >>> f"conductance goes like hardness^{found.slopes['hardness']['solid_conductance']:.2f}"
    'conductance goes like hardness^-0.68'

    Of a batch, at two pressures each:

    >>> faces = Surface.from_roughness(
    ...     Rq=[0.4, 0.5, 0.6], Rdq=0.1, longest=100, hurst=0.8, h_max=2.4, unit="um"
    ... )
    >>> found = sensitivity(
    ...     faces, "100 GPa", pressure=[["10 MPa"], ["20 MPa"]], theory="calibrated"
    ... )
    >>> found.derivatives["Rq"]["mean_separation"].shape
    (2, 3)
    """
    candidates = {
        "separation": separation,
        "mean_separation": mean_separation,
        "pressure": pressure,
        "area": area,
    }
    labels = Labels.of(surface, bodies, candidates, gas)
    surface, bodies, candidates, gas = (
        labels.plain(each) for each in (surface, bodies, candidates, gas)
    )
    if isinstance(surface, Mapping):
        surface = surface_of_entries(surface)
    described = described_contact(surface, bodies, candidates, theory, gas)
    return sensitivity_of(described, quantities, labels)


def described_contact(
    surface: AnySurface,
    bodies: Any,
    candidates: Mapping[str, Any],
    theory: str | Theory | UserTheory | None,
    gas: str | Gas | Mapping[str, Any] | None = None,
) -> Described:
    """All numbers of contacts at the one candidate that is given."""
    between = Interface(gas=None if gas is None else Gas.of(gas))
    in_units = Bodies.of(bodies).in_units(surface)
    question = Question.of(in_units.units, candidates)
    chosen = resolve(theory, surface, question.name)
    return Described.of(
        surface,
        unknowns_of(surface, chosen),
        BodyNumbers.of(in_units, between, isinstance(gas, str)),
        chosen,
        question.name,
        question.value,
    )


def sensitivity_of(
    described: Described,
    quantities: Sequence[str] | None,
    labels_of_arrays: Labels = NO_LABELS,
) -> Sensitivity:
    """Values and derivatives of what is described, with labels that its numbers had."""
    pressed = described.contact()
    wanted = _names(pressed, quantities, described.unknowns, described.by)
    found = derivatives_of(described, wanted, pressed)
    labels = {
        name: described.unknowns.labels.get(name, name) for name in found.derivatives
    }
    numbers = {
        labels[name]: np.broadcast_to(described.numbers[name], found.sides[name].shape)
        for name in found.derivatives
    }
    slopes: dict[str, dict[str, Any]] = {}
    errors: dict[str, dict[str, Any]] = {}
    with np.errstate(all="ignore"):
        for name, label in labels.items():
            ratios = {
                answer: numbers[label] / value for answer, value in found.values.items()
            }
            slopes[label] = {
                answer: ratio * found.derivatives[name][answer]
                for answer, ratio in ratios.items()
            }
            errors[label] = {
                answer: np.abs(ratio) * found.errors[name][answer]
                for answer, ratio in ratios.items()
            }
    found_units = {name: registry.get(name).unit(pressed) for name in wanted}

    def plain(values: Mapping[str, Any], units: Mapping[str, str]) -> dict[str, Any]:
        """Numbers of one contact, arrays, or DataArrays with their units."""
        return {
            name: labels_of_arrays.labelled(_number(value), units.get(name, "1"))
            for name, value in values.items()
        }

    made = Sensitivity(
        described.by,
        {},
        plain(found.values, found_units),
        {label: plain(row, {}) for label, row in slopes.items()},
        {label: plain(row, {}) for label, row in errors.items()},
        {},
        {
            labels[name]: labels_of_arrays.labelled(int(side) if side.ndim == 0 else side)
            for name, side in found.sides.items()
        },
        described.body_numbers.bodies.units,
        dict(described.body_numbers.units),
        found_units,
    )
    own = {label: made.unit(label) for label in numbers}
    made.parameters.update(plain(numbers, own))
    for name, row in found.derivatives.items():
        label = labels[name]
        units = {answer: _ratio(unit, own[label]) for answer, unit in found_units.items()}
        made.derivatives[label] = plain(row, units)
    return made


def _ratio(above: str, below: str) -> str:
    """The unit of a derivative."""
    if below in ("", "1"):
        return above
    return f"({above})/({below})" if above not in ("", "1") else f"1/({below})"


def _number(value: Any) -> Any:
    """An array, or the number of one contact."""
    return float(value) if np.ndim(value) == 0 else np.array(value)


def _names(
    pressed: Contact, quantities: Sequence[str] | None, unknowns: Unknowns, by: str
) -> list[str]:
    """Names of the quantities whose derivatives are asked for, or that have them by default."""
    # one separation gives the other
    same = "mean_separation" if by == "separation" else by
    if quantities is None:
        is_open = bool(np.all(pressed.area == 0))
        return [
            name
            for name in registry.results()
            if name != same
            and registry.get(name).is_shown(pressed)
            and unknowns.knows(name)
            # a vacuum conducts nothing
            and (is_open or np.any(pressed.quantity(name) > 0))
        ]
    if isinstance(quantities, str) or not quantities:
        raise InputError(f"quantities are a list of names, got {quantities!r}")
    for name in quantities:
        registry.get(name)
        if not unknowns.knows(name):
            raise InputError(
                f"{name} of a simulated map does not follow from its simulation for other "
                "heights and lengths: give theory='calibrated'"
            )
        if name == by:
            raise InputError(f"{name} is held fixed: leave it out of quantities")
    return list(dict.fromkeys(quantities))
