"""Sensitivity of results to each parameter of a surface: logarithmic derivatives."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.bodies.bodies import Bodies, BodiesInUnits
from mbma_tables.common.arguments import FloatArray, hinted, one_number
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import DIMENSIONS, Units, factor
from mbma_tables.contacts.contact import contact_of
from mbma_tables.contacts.quantities import registry
from mbma_tables.contacts.quantities.interface import NOTHING_BETWEEN, Interface
from mbma_tables.contacts.quantities.registry import unit_of
from mbma_tables.contacts.question import GAPS, Question
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.heights import Heights
from mbma_tables.surfaces.maps import extrapolated
from mbma_tables.surfaces.self_affine import PARAMETERS
from mbma_tables.surfaces.surface import MeasuredSurface, Surface
from mbma_tables.theories import resolve
from mbma_tables.theories.base import Theory, UserTheory

if TYPE_CHECKING:
    from mbma_tables.contacts.result import Contact

STEP = 0.02  # step of the logarithm of a parameter
NEAR = 0.9  # share of a parameter's upper limit above which its steps go down
MAX_ERROR = 0.05  # largest error of a slope, over itself or 1; else it is NaN


@dataclasses.dataclass(frozen=True, eq=False)
class Sensitivity:
    """Result of `sensitivity`; its text is a table."""

    by: str  #: quantity held fixed: "separation", "mean_separation", "pressure" or "area"
    parameters: dict[
        str, float
    ]  #: the surface's parameters, the modulus if given, and the quantity held fixed
    answers: dict[str, float]  #: the results for these parameters
    #: d ln(result)/d ln(parameter) by parameter and result, the other parameters held; NaN
    #: where the result jumps
    slopes: dict[str, dict[str, float]]
    errors: dict[str, dict[str, float]]  #: estimates of their errors
    units: Units  #: of parameters
    answer_units: dict[str, str]  #: the unit of each result

    def unit(self, name: str) -> str:
        """The unit of a parameter or of a result."""
        if name in self.answer_units:
            return self.answer_units[name]
        return unit_of(name.rpartition(".")[2], self.units)

    def __str__(self) -> str:
        width = max(map(len, self.parameters)) + 2
        lines = [
            f"d ln(answer)/d ln(parameter) at given {self.by}",
            f"{'':{width}}{'value':>22}",
        ]
        widths = {name: max(17, len(name) + 2) for name in self.answers}
        lines[1] += "".join(f"{name:>{widths[name]}}" for name in self.answers)
        for name, value in self.parameters.items():
            slopes = "".join(
                f"{round(self.slopes[name][answer], 3) + 0.0:>{widths[answer]}.3f}"
                for answer in self.answers
            )
            unit = self.unit(name)
            number = f"{value:.5g} {unit}".removesuffix(" 1")
            lines.append(f"{name:{width}}{number:>22}{slopes}")
        return "\n".join(lines)


@hinted
def sensitivity(
    surface: AnySurface,
    bodies: Bodies | float | str = 1.0,
    *,
    separation: ArrayLike | None = None,
    mean_separation: ArrayLike | None = None,
    pressure: ArrayLike | None = None,
    area: ArrayLike | None = None,
    theory: str | Theory | UserTheory | None = None,
    quantities: Sequence[str] | None = None,
) -> Sensitivity:
    """Sensitivity of quantities of a contact to each parameter of a surface, for any theory.

    Parameters
    ----------
    surface : Surface
        One surface. Its parameters are its five numbers, or those of the drawing that it
        was made from (`Surface.from_roughness`). Those of one given by a spectrum are
        "heights" and "lengths", factors of all heights and of all lengths along the plane,
        like an instrument's calibration factors; h_max alone; the "shortest" and "longest"
        wavelengths, cut-offs that only remove wavelengths, and with an extrapolated
        spectrum its exponent "extrapolate_hurst". Where the calibrated law uses a map's own
        heights and curves, and where the map is simulated, h_max and cut-offs are left out:
        they follow from the map.
    separation, mean_separation, pressure, area : float or str, one of them
        The quantity held fixed, as for `contact`.
    bodies : Bodies or float or str
        As for `contact`; the modulus and a hardness are among the parameters.
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

    Raises
    ------
    InputError, OutOfRangeError
        For a batch, unknown names, quantities that need what was not given or are not
        positive, where there is no contact, and for the simulation of a map with a hardness.

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
    """
    in_units = Bodies.of(bodies).in_units(surface)
    candidates = {
        "separation": separation,
        "mean_separation": mean_separation,
        "pressure": pressure,
        "area": area,
    }
    question = Question.of(in_units.units, candidates)
    chosen = resolve(theory, surface, question.name)
    return relative_derivatives(
        unknowns_of(surface, chosen),
        chosen,
        in_units,
        moduli={"E_star": in_units.E_star},
        modulus_of=_itself,
        by=question.name,
        value=question.value,
        quantities=quantities,
    )


def _itself(E_star: Any) -> Any:
    return E_star


@dataclasses.dataclass(frozen=True)
class Unknowns:
    """Numbers that a surface was made from, and the function that makes it again of others."""

    numbers: Mapping[str, float]
    make: Callable[..., AnySurface]  # takes the numbers by name
    batches: bool = False  # whether `make` takes arrays of them
    #: signs of steps of numbers that can move to one side only
    one_sided: Mapping[str, float] = dataclasses.field(default_factory=dict)
    #: names of the numbers in results, where they are not their own
    labels: Mapping[str, str] = dataclasses.field(default_factory=dict)

    def answers(
        self, numbers: Mapping[str, Any], asked: Asked, names: Sequence[str]
    ) -> dict[str, Any]:
        """Quantities of the contact of the surface of these numbers."""
        pressed = asked.contact(self.make(**numbers))
        return {name: pressed.quantity(name) for name in names}

    def knows(self, name: str) -> bool:
        """Whether a quantity follows for other numbers."""
        return True


class OfOneMap(Unknowns):
    """A map whose theory is a simulation of it: heights and lengths scale what was simulated.

    A map with heights `a` and lengths `l` times as large is pressed as the map itself is by
    bodies of modulus E* a/l, at gaps 1/a times as large.
    """

    #: powers of `a` and `l` by which a quantity is larger than in the contact of the map
    powers: ClassVar[Mapping[str, tuple[int, int]]] = {
        "mean_separation": (1, 0),
        "separation": (1, 0),
        "pressure": (0, 0),
        "mean_pressure": (0, 0),
        "area": (0, 0),
        "stiffness": (-1, 0),
        "unloading_stiffness": (-1, 0),
        "tangential_stiffness": (-1, 0),
        "energy": (1, 0),
        "solid_conductance": (0, -1),
    }

    def answers(
        self, numbers: Mapping[str, Any], asked: Asked, names: Sequence[str]
    ) -> dict[str, Any]:
        """Quantities of the contact of the map with these factors."""
        heights = numbers["heights"]
        lengths = numbers["lengths"]
        equal_modulus = asked.bodies.E_star * heights / lengths
        scale = heights ** self.powers[asked.by][0]
        equal = dataclasses.replace(
            asked,
            bodies=dataclasses.replace(asked.bodies, E_star=equal_modulus),
            value=asked.value / scale,
        )
        pressed = equal.contact(self.make())
        answers = {}
        for name in names:
            of_heights, of_lengths = self.powers[name]
            factors = heights**of_heights * lengths**of_lengths
            answers[name] = factors * pressed.quantity(name)
        return answers

    def knows(self, name: str) -> bool:
        """Whether a quantity follows by similarity."""
        return name in self.powers


@dataclasses.dataclass(frozen=True)
class Asked:
    """A contact at one given quantity, but for its surface."""

    bodies: BodiesInUnits
    by: str
    value: Any
    theory: Theory
    interface: Interface

    def contact(self, surface: AnySurface) -> Contact:
        """The contact of a surface."""
        candidates = dict.fromkeys((*GAPS, "pressure", "area"))
        return contact_of(
            surface,
            self.bodies,
            candidates | {self.by: self.value},
            self.theory,
            self.interface,
        )


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
            and (is_open or np.all(pressed.quantity(name) > 0))
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


def relative_derivatives(
    unknowns: Unknowns,
    theory: Theory,
    bodies: BodiesInUnits,
    *,
    moduli: Mapping[str, Any],
    modulus_of: Callable[..., Any],
    by: str,
    value: Any,
    quantities: Sequence[str] | None = None,
    interface: Interface = NOTHING_BETWEEN,
) -> Sensitivity:
    """d ln(answer)/d ln(number) for the numbers of a surface, the moduli, the quantity held fixed and the hardness.

    Parameters
    ----------
    unknowns : Unknowns
        Of the surface.
    theory : Theory
    bodies : BodiesInUnits
        In the units of all numbers.
    moduli : mapping
        Of the bodies, by name.
    modulus_of : callable
        E* of these moduli, in their order.
    by, value : str, float
        The quantity held fixed.
    quantities : sequence of str, optional
        Whose derivatives they are, as of `sensitivity`.
    interface : Interface, optional
        What is between the bodies.
    """
    from scipy.differentiate import jacobian

    units = bodies.units
    hardness = bodies.hardness
    yields = not np.equal(hardness, np.inf).all()
    if yields and isinstance(unknowns, OfOneMap):
        raise InputError(
            f"theory {theory.name!r} simulates the map anew for each hardness, too coarsely for derivatives by it: "
            "give theory='calibrated', or Bodies(..., hardness=float('inf')) for the elastic contact"
        )
    given = {**unknowns.numbers, **moduli, by: value}
    if yields:
        given["hardness"] = hardness
    numbers = {name: float(one_number(name, number)) for name, number in given.items()}
    # without a modulus all stresses are over it; the logarithm of zero does not vary
    fixed = set(moduli) if units.stress == "1" else set()
    varied = [
        name for name, number in numbers.items() if number != 0 and name not in fixed
    ]
    here_asked = Asked(bodies, by, numbers[by], theory, interface)
    pressed = here_asked.contact(unknowns.make(**unknowns.numbers))
    wanted = _names(pressed, quantities, unknowns, by)

    def logarithms_of(given: dict[str, Any]) -> FloatArray:
        """Of the answers wanted, for numbers or arrays of them."""
        moved = dataclasses.replace(
            bodies,
            E_star=modulus_of(*(given[name] for name in moduli)),
            hardness=given.get("hardness", np.inf),
        )
        asked = dataclasses.replace(here_asked, bodies=moved, value=given[by])
        own = {name: given[name] for name in unknowns.numbers}
        answers = unknowns.answers(own, asked, wanted)
        # some do not depend on the gap, such as the plasticity index
        shape = np.broadcast_shapes(*map(np.shape, given.values()))
        return np.log([np.broadcast_to(answers[name], shape) for name in wanted])

    @np.errstate(all="ignore")
    def logarithms(x: FloatArray) -> FloatArray:
        """Of the answers, as rows, where the logarithms of the varied numbers are moved by rows of x."""
        moved, back = np.unique(x.reshape(len(varied), -1), axis=1, return_inverse=True)
        count = moved.shape[1]
        columns = {name: np.full(count, number) for name, number in numbers.items()}
        for name, row in zip(varied, moved, strict=True):
            columns[name] = numbers[name] * np.exp(row)
        if unknowns.batches:
            table = logarithms_of(columns)
        else:
            entries = [
                {name: column[k] for name, column in columns.items()}
                for k in range(count)
            ]
            table = np.transpose([logarithms_of(entry) for entry in entries])
        return table[:, back.ravel()].reshape(-1, *x.shape[1:])

    here = np.exp(logarithms(np.zeros((len(varied), 1))))[:, 0]
    if not (here > 0).all():
        none = ", ".join(np.array(wanted)[~(here > 0)])
        raise InputError(
            f"there is no contact at this {by}, or full contact: logarithmic derivatives do not exist, of {none}"
        )
    with np.errstate(all="ignore"):
        derivative = jacobian(
            logarithms,
            np.zeros(len(varied)),
            order=4,
            maxiter=3 if unknowns.batches else 2,
            initial_step=STEP,
            step_direction=_sides(varied, numbers, unknowns.one_sided),
        )
        # a discontinuous result has no slope
        accurate = derivative.error <= MAX_ERROR * np.maximum(1, np.abs(derivative.df))
        slopes = np.where(accurate, derivative.df, np.nan)
    labels = [unknowns.labels.get(name, name) for name in varied]
    return Sensitivity(
        by,
        {label: numbers[name] for label, name in zip(labels, varied, strict=True)},
        dict(zip(wanted, here.tolist(), strict=True)),
        _by_name(labels, wanted, slopes),
        _by_name(labels, wanted, derivative.error),
        units,
        {name: registry.get(name).unit(pressed) for name in wanted},
    )


def _by_name(
    labels: Sequence[str], wanted: Sequence[str], table: FloatArray
) -> dict[str, dict[str, float]]:
    """A table with a row for each answer and a column for each number, by the names of both."""
    columns = table.T.tolist()
    return {
        name: dict(zip(wanted, column, strict=True))
        for name, column in zip(labels, columns, strict=True)
    }


def _sides(
    varied: Sequence[str], numbers: Mapping[str, float], one_sided: Mapping[str, float]
) -> FloatArray:
    """Signs of one-sided steps, 0 for central ones, which need room to a number's upper limit."""
    limits = {"area": 1.0, "pressure": numbers.get("hardness", np.inf)}
    signs = dict(one_sided)
    for name in varied:
        limit = 1.0 if name.endswith("hurst") else limits.get(name, np.inf)
        if numbers[name] > NEAR * limit:
            signs[name] = -1.0
    if signs.get("pressure"):
        signs["hardness"] = 1.0
    return np.array([signs.get(name, 0.0) for name in varied])


def unknowns_of(
    surface: AnySurface, theory: Theory | None, unit: str | None = None
) -> Unknowns:
    """The numbers that a surface was made from.

    Parameters
    ----------
    surface : AnySurface
        One surface.
    theory : Theory or None
        The theory that is asked about it; None where the surface is combined with another,
        which leaves the curves and the points of a map out.
    unit : str, optional
        Unit of length of the numbers; default: the surface's.
    """
    if surface.labelled or surface.shape != ():
        raise InputError("sensitivities are of one surface, not of a batch")
    drawn = _of_drawing(surface, unit)
    if drawn is not None:
        return drawn
    moved: Any = surface if unit in (None, surface.unit) else surface.to(unit or "")
    if isinstance(moved, Surface):
        own = {name: getattr(moved, name) for name in PARAMETERS}
        return Unknowns(own, functools.partial(Surface, unit=moved.unit), batches=True)
    # what keeps points of a map, or the table of their simulation, has the theory of one map
    simulated = moved.map is not None or moved.table is not None
    if simulated and theory is not None:
        of_one_map = theory.gaps() is not None
        if of_one_map:
            return OfOneMap({"heights": 1.0, "lengths": 1.0}, lambda **factors: moved)
    return _of_spectrum(moved, theory)


def _of_drawing(surface: Any, unit: str | None) -> Unknowns | None:
    """The numbers of the drawing, if the surface was made of these and not changed since."""
    record = surface.provenance[0] if surface.provenance else {}
    if record.get("step") != "from_roughness" or record["unit"] != surface.unit:
        return None
    drawn: Any = Surface.from_roughness(**record["given"], unit=record["unit"])
    if type(drawn) is not type(surface):
        return None
    names = PARAMETERS if isinstance(surface, Surface) else ("q", "C", "h_max")
    for name in names:
        before = getattr(drawn, name)
        now = getattr(surface, name)
        if np.shape(before) != np.shape(now) or not np.allclose(
            before, now, rtol=1e-9, atol=0
        ):
            return None
    numbers = dict(record["given"])
    if unit not in (None, surface.unit):
        for name in numbers:
            power = DIMENSIONS.get(name, (0, 0))[0]
            numbers[name] *= factor(surface.unit, unit, power=power)
    make = functools.partial(
        Surface.from_roughness, unit=unit or surface.unit, process=record.get("process")
    )
    return Unknowns(numbers, make, batches=isinstance(surface, Surface))


def _of_spectrum(surface: MeasuredSurface, theory: Theory | None) -> Unknowns:
    """Factors of heights and lengths, and what else the spectrum was made from."""
    steps = {record["step"]: record for record in surface.provenance}
    own: dict[str, float] = {"heights": 1.0, "lengths": 1.0}
    cut_offs: dict[str, float] = {}
    uncut = surface
    # measured heights have their own highest point and shortest wavelengths
    takes_map = theory is not None and theory.takes_heights
    of_its_heights = takes_map or theory is None
    if surface.heights.is_gaussian or not of_its_heights:
        own["h_max"] = float(surface.h_max)
    if "extrapolated" in steps:
        uncut = surface.between(
            float(surface.q0), 2 * math.pi / steps["resolution"]["shortest"]
        )
        own["extrapolate_hurst"] = steps["extrapolated"]["hurst"]
    elif surface.bearing is None or not takes_map:
        cut_offs = {
            "shortest": 2 * math.pi / float(surface.q1),
            "longest": 2 * math.pi / float(surface.q0),
        }

    def make(heights: float, lengths: float, **others: float) -> MeasuredSurface:
        moved = uncut
        if any(others[name] != wavelength for name, wavelength in cut_offs.items()):
            moved = uncut.between(
                2 * math.pi / others["longest"], 2 * math.pi / others["shortest"]
            )
        if "extrapolate_hurst" in others:
            shortest = steps["extrapolated"]["shortest"]
            moved = extrapolated(uncut, shortest, others["extrapolate_hurst"])
        if "h_max" in others:
            h_max = others["h_max"]
            distribution = moved.heights
            if distribution.is_gaussian:
                distribution = Heights.gaussian(float(moved.h_rms), h_max)
            moved = dataclasses.replace(moved, h_max=h_max, heights=distribution)
        return moved.resized(heights, lengths)

    # a spectrum is not known beyond its ends: cut-offs only remove wavelengths
    return Unknowns(own | cut_offs, make, one_sided={"shortest": 1.0, "longest": -1.0})
