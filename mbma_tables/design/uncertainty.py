"""Quantities of contacts whose numbers are not known exactly: quantiles, shares of inputs, replicas."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import ArrayLike, NDArray

from mbma_tables.bodies.bodies import Bodies
from mbma_tables.common.arguments import (
    FloatArray,
    finite_array,
    hinted,
    require,
    whole_number_in,
)
from mbma_tables.common.display import Displayed, Variable
from mbma_tables.common.distributions import (
    FORMS,
    Distribution,
    distribution_of,
    distributions_in,
    of_all,
    with_numbers,
)
from mbma_tables.common.errors import InputError
from mbma_tables.common.plots import Line, draw_panels, pressure_label
from mbma_tables.common.progress import doing, shown
from mbma_tables.contacts.contact import contact
from mbma_tables.contacts.quantities import registry
from mbma_tables.contacts.quantities.declaration import DIMENSIONLESS, Quantity
from mbma_tables.contacts.quantities.leakage import (
    flow_coefficient,
    leak_rate,
    power_of_flow,
)
from mbma_tables.contacts.result import Contact, panel_label
from mbma_tables.design.specimen import surface_of_entries
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.drawing import entries_of, lacks_area, with_area
from mbma_tables.surfaces.roughness import spread_of_processes
from mbma_tables.theories.base import Theory, UserTheory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DRAWS = 2000
LEVELS = (0.05, 0.5, 0.95)
MODEL = "model"  # the name of the share of the theory's error
DEGREE = 5  # of the polynomials whose variances are the shares of inputs
MOST_DRAWS = 10**6
# corners of the box of ranges are all looked at up to this number of inputs
MOST_CORNERS = 8
LOAD = "pressure"  # the name of the share of pressures that are ranges
Pressed = Callable[[Any], Contact]


@dataclasses.dataclass(frozen=True)
class Load:
    """Pressures of which any may be a distribution; one level draws all of them together."""

    given: list[Any]
    distributions: dict[int, Distribution]  # by their place

    @classmethod
    def of(cls, pressure: Any) -> Load:
        """One pressure or several, as they were typed."""
        is_one = isinstance(pressure, Mapping)
        given = [pressure] if is_one else np.asarray(pressure, dtype=object)
        entries = np.atleast_1d(np.asarray(given, dtype=object)).tolist()
        found = {k: distribution_of(LOAD, each) for k, each in enumerate(entries)}
        return cls(entries, {k: each for k, each in found.items() if each is not None})

    @property
    def inputs(self) -> dict[str, Distribution]:
        """The distribution of the first pressure that is one, with the text of all."""
        if not self.distributions:
            return {}
        several = list(self.distributions.values())
        text = ", ".join(each.text for each in several)
        return {LOAD: dataclasses.replace(several[0], text=text)}

    def at(self, level: float) -> list[Any]:
        """The pressures at a level of their distributions, as they would be typed."""
        pressures = list(self.given)
        for k, each in self.distributions.items():
            pressures[k] = each.written(float(each.quantile(level)))
        return pressures

    def at_all(self, levels: FloatArray) -> list[Any]:
        """A row of pressures for each level, or the pressures themselves where all are known."""
        if not self.distributions:
            return self.given
        return [self.at(level) for level in levels.tolist()]


@dataclasses.dataclass(frozen=True)
class Description:
    """How a contact is made of numbers of which some are distributions."""

    inputs: Mapping[str, Distribution]  # by place, such as "part_a.Ra"
    #: the contact at pressures, from what is typed in place of the inputs; arrays are batches
    make: Callable[[Mapping[str, Any]], Pressed]
    what: str = "the contact"

    def with_load(self, load: Load) -> Description:
        """The same with pressures that are distributions as the last input."""
        inputs = {**self.inputs, **load.inputs}
        return dataclasses.replace(self, inputs=inputs)

    def levels(self, draws: int, seed: int) -> FloatArray:
        """Uniform numbers of each draw, for the inputs, the model and the load.

        The first draws are the same for any number of them, and whether or not the load is
        a distribution.
        """
        generator = np.random.default_rng(seed)
        own = len(self.inputs) - (LOAD in self.inputs)
        levels = generator.random((draws, own + 1))
        of_load = np.random.default_rng([seed, 1]).random((draws, 1))
        return np.concatenate([levels, of_load], axis=1)

    def of_inputs(self, levels: FloatArray) -> FloatArray:
        """Levels of the inputs alone, in their order."""
        own = len(self.inputs) - (LOAD in self.inputs)
        if LOAD not in self.inputs:
            return levels[:, :own]
        return np.delete(levels, own, axis=1)

    def of_model(self, levels: FloatArray) -> FloatArray:
        """Levels of the model's error."""
        return levels[:, -2]

    def drawn(self, levels: FloatArray) -> dict[str, FloatArray]:
        """Numbers of the inputs at levels, rows of draws."""
        return {
            name: each.quantile(levels[:, k])
            for k, (name, each) in enumerate(self.inputs.items())
        }

    def corners(self) -> FloatArray:
        """Levels of the corners of the box of ranges; of more than a few inputs those of its axes."""
        count = len(self.inputs)
        if count <= MOST_CORNERS:
            return np.array(list(itertools.product((0.0, 1.0), repeat=count)))
        middle = np.full((2 * count, count), 0.5)
        middle[np.arange(2 * count), np.repeat(np.arange(count), 2)] = [0.0, 1.0] * count
        return middle


def _uncertain(name: str) -> tuple[Quantity, float]:
    """The quantity whose model uncertainty one has, and the power of it that it is."""
    declared = registry.get(name)
    power = power_of_flow(declared)
    if declared.uncertainty is None and power > 0:
        return flow_coefficient, power
    return declared, 1.0


def relative_scatter(pressed: Contact, name: str) -> Any:
    """Standard deviation of the model's error of ln of a quantity at a pressure, with its sign.

    In simulations of self-affine surfaces from 0.5% to 10% contact, errors at a pressure of
    area and stiffness correlate by 0.5 to 0.6, of stiffness and mean gap by -0.6 to -0.7, of
    area and mean gap by -0.2 to -0.3: a replica has one number for all of them. NaN where not known or not stated at a pressure.
    """
    declared, power = _uncertain(name)
    if declared.uncertainty is None or not declared.error_sign:
        return np.nan * pressed.mean_separation
    kind = registry.get(declared.uncertainty).spread_of_process
    provenance = pressed.surface.provenance
    spread = spread_of_processes(provenance, kind) if kind else 0.0
    scatter = pressed.scatter_of(declared.name)
    if spread > 0 and not np.isfinite(scatter).all():
        # no scatter is stated of faces of a process; maps of it have this one
        return power * declared.error_sign * spread + 0 * pressed.mean_separation
    if registry.get(declared.uncertainty).dimension != DIMENSIONLESS:
        with np.errstate(divide="ignore", invalid="ignore"):
            scatter = scatter / pressed.quantity(declared.name)
    return power * declared.error_sign * scatter


def model_error(pressed: Contact, name: str, deviations: Any) -> Any:
    """ln of a quantity with the model's error, so many standard deviations, over that without."""
    if name != leak_rate.name:
        return deviations * relative_scatter(pressed, name)
    of_flow = deviations * relative_scatter(pressed, flow_coefficient.name)
    seal = pressed.interface.seal
    assert seal is not None
    return pressed.leakage.error_of_rate(seal, of_flow, deviations)


def names_by_default(pressed: Contact) -> list[str]:
    """Names of the quantities that have a model uncertainty at a pressure."""
    return [
        name
        for name in registry.results()
        if name != LOAD and registry.get(name).is_shown(pressed)
    ]


def _names(pressed: Contact, quantities: Sequence[str] | None) -> list[str]:
    """Names of the quantities that are asked for, or that have a model uncertainty at a pressure."""
    if quantities is None:
        return names_by_default(pressed)
    if isinstance(quantities, str) or not quantities:
        raise InputError(f"quantities are a list of names, got {quantities!r}")
    for name in quantities:
        registry.get(name).of(pressed)
    return list(dict.fromkeys(quantities))


_Batch = tuple[
    dict[str, FloatArray],
    dict[str, FloatArray],
    NDArray[np.bool_],
    dict[str, NDArray[np.bool_]],
]


def _evaluated(
    description: Description,
    drawn: Mapping[str, FloatArray],
    last: FloatArray,
    load: Load,
    names: Sequence[str],
    deviations: FloatArray,
) -> _Batch:
    """The contacts of all draws: one batch, or one after the other where the batch is refused."""
    inputs = description.inputs
    typed = {name: inputs[name].written(rows[:, None]) for name, rows in drawn.items()}
    pressures = load.at_all(last)
    try:
        pressed = description.make(typed)(pressures)
        shape = (len(last), len(load.given))
        batches = [_of_contact(pressed, names, shape, deviations[:, None])]
    except InputError:
        # a number out of range is refused again there
        rows = [load.at(level) for level in last.tolist()]
        batches = list(_one_by_one(description, typed, rows, names, deviations))
    reasons: dict[str, NDArray[np.bool_]] = {}
    for part in batches:
        for reason, mask in part[3].items():
            here = np.asarray(mask.any(axis=0))
            reasons[reason] = reasons.get(reason, np.False_) | here
    values, errors, valid = (
        list(column) for column in zip(*[p[:3] for p in batches], strict=True)
    )
    return (
        {name: np.concatenate([each[name] for each in values]) for name in names},
        {name: np.concatenate([each[name] for each in errors]) for name in names},
        np.concatenate(valid),
        reasons,
    )


def _of_contact(
    pressed: Contact, names: Sequence[str], shape: tuple[int, int], deviations: Any
) -> _Batch:
    """Values, the model's errors of their ln, validity and reasons of a contact, each in the shape of rows and pressures."""
    values = {
        name: np.broadcast_to(np.asarray(pressed.quantity(name), float), shape)
        for name in names
    }
    errors = {
        name: np.broadcast_to(model_error(pressed, name, deviations), shape)
        for name in names
    }
    judged = pressed.judged(names)
    valid = np.broadcast_to(judged.valid, shape)
    reasons = {
        reason: np.broadcast_to(mask, shape) for reason, mask in judged.reasons.items()
    }
    return values, errors, valid, reasons


def _one_by_one(
    description: Description,
    typed: Mapping[str, Any],
    loads: Sequence[list[Any]],
    names: Sequence[str],
    deviations: FloatArray,
) -> Iterator[_Batch]:
    """The draws one after the other, where their contacts make no batch."""
    with shown("draws"):
        for k, pressures in enumerate(loads):
            doing(f"draw {k + 1} of {len(loads)}", k / len(loads))
            one = {name: entries[k][0] for name, entries in typed.items()}
            pressed = description.make(one)(pressures)
            yield _of_contact(pressed, names, (1, len(pressures)), deviations[k])


def _standard_normal(levels: FloatArray) -> FloatArray:
    from scipy.special import ndtri

    return np.asarray(ndtri(levels))


def _with_model(values: FloatArray, errors: FloatArray) -> FloatArray:
    """Values with the model's errors of their ln; as they are at pressures where these are not known."""
    is_known = np.isfinite(errors).all(axis=0)
    return values * np.exp(np.where(is_known, errors, 0.0))


def _basis(numbers: FloatArray) -> FloatArray:
    """Polynomials of an input without their means, as columns."""
    low = numbers.min()
    width = np.ptp(numbers)
    degree = min(DEGREE, np.unique(numbers).size - 1)
    columns = legvander(2 * (numbers - low) / (width or 1.0) - 1, degree)[:, 1:]
    return np.asarray(columns - columns.mean(axis=0))


def _shares(
    columns: Mapping[str, FloatArray], table: FloatArray
) -> dict[str, FloatArray]:
    """First-order Sobol indices of inputs, of each column of a table of draws.

    The sum of a polynomial of each input is fitted to the draws; the share of an input is
    the variance of its polynomial over the sum of all of them and of what the fit leaves.
    The variance of a fitted polynomial is too large by what is left over the number of
    draws, for each of its coefficients.
    """
    bases = {name: _basis(numbers) for name, numbers in columns.items()}
    design = np.concatenate(list(bases.values()), axis=1)
    centred = table - table.mean(axis=0)
    fitted = np.linalg.lstsq(design, centred, rcond=None)[0]
    draws, unknowns = design.shape
    residual = centred - design @ fitted
    noise = (residual**2).sum(axis=0) / max(draws - unknowns - 1, 1)
    variances = {}
    place = 0
    for name, basis in bases.items():
        count = basis.shape[1]
        part = basis @ fitted[place : place + count]
        place += count
        variances[name] = part.var(axis=0, ddof=1) - noise * count / draws
    # the inputs are independent: their draws correlate by chance alone, which adds nothing
    total = np.sum(list(variances.values()), axis=0) + noise
    with np.errstate(divide="ignore", invalid="ignore"):
        return {name: variance / total for name, variance in variances.items()}


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Uncertainty(Displayed):
    """Quantiles of quantities at pressures, and the share of each input in their variance.

    Attributes
    ----------
    pressure : ndarray
        Given pressures, in the unit of `units`.
    inputs : dict
        The numbers that are not known, by place, each a `Distribution`.
    levels : tuple of float
        Of the quantiles.
    quantiles : dict
        By quantity, arrays of shape (levels, pressures): inputs and model together.
    shares : dict
        By quantity and input, arrays over the pressures: first-order Sobol indices, of ln
        of the quantity. The model's own is "model", NaN where its scatter is not stated
        for the whole range; quantiles are then those of the inputs alone. What is missing
        to 1 is of inputs together.
    valid : ndarray of bool
        Whether contacts of the whole range of every input are of a tested kind, by pressure;
        with quantities of the flow, whether it is, too.
    reasons : dict
        Why not, with the mask of the pressures where it applies to a part of the range.
    draws : int
    seed : int
    units : dict
        Unit of each quantity.
    """

    pressure: FloatArray
    inputs: Mapping[str, Distribution]
    levels: tuple[float, ...]
    quantiles: dict[str, FloatArray]
    shares: dict[str, dict[str, FloatArray]]
    valid: NDArray[np.bool_]
    reasons: dict[str, NDArray[np.bool_]]
    draws: int
    seed: int
    units: dict[str, str]

    def _facts(self) -> dict[str, str]:
        facts = {name: each.text for name, each in self.inputs.items()}
        count = f"{self.draws} by seed {self.seed}"
        facts |= {"quantities": ", ".join(self.quantiles), "draws": count}
        facts["valid"] = f"{int(self.valid.sum())} of {self.valid.size}"
        if self.reasons:
            facts["reasons"] = "; ".join(self.reasons)
        return facts

    def _variables(self) -> dict[str, Variable]:
        along = ("pressure",)
        variables = {
            "pressure": Variable(
                self.pressure, self.units["pressure"], "force over nominal area", along
            ),
            "quantile": Variable(np.array(self.levels), "1", "level", ("quantile",)),
        }
        names = [*self.inputs, MODEL]
        variables["input"] = Variable(np.array(names), "1", "", ("input",))
        for name, rows in self.quantiles.items():
            meaning = registry.get(name).meaning
            variables[name] = Variable(
                rows, self.units[name], meaning, ("quantile", *along)
            )
            table = np.array([self.shares[name][each] for each in names])
            meaning = f"share of each input in the variance of ln {name}"
            variables[f"{name}_share"] = Variable(table, "1", meaning, ("input", *along))
        variables["valid"] = Variable(
            self.valid, "1", registry.get("valid").meaning, along
        )
        return variables

    def _figure(self) -> Figure:
        """Medians with the band between the first and the last quantile."""
        if self.pressure.size < 2:
            raise InputError(
                "quantities at several pressures make a curve, and this has one"
            )
        order = np.argsort(self.pressure)
        panels: dict[str, list[Line]] = {}
        middle = len(self.levels) // 2
        for name, rows in self.quantiles.items():
            if not (rows > 0).all():
                continue
            label = panel_label(name, self.units[name])
            # without the model a band would look narrower than it is
            is_stated = np.isfinite(self.shares[name][MODEL][order])
            low, high = (np.where(is_stated, rows[k, order], np.nan) for k in (0, -1))
            line = Line(name.replace("_", " "), rows[middle, order], None, (low, high))
            panels.setdefault(label, []).append(line)
        ends = f"from {self.levels[0]:.3g} to {self.levels[-1]:.3g}"
        title = f"bands: quantiles {ends}, of inputs and model, where that is known"
        label = pressure_label(self.units["pressure"])
        return draw_panels(self.pressure[order], panels, label, title)

    def what_to_measure(self, quantity: str | None = None) -> dict[str, FloatArray]:
        """By how much the band of a quantity narrows if one number were known, the most helpful first.

        Parameters
        ----------
        quantity : str, optional
            Default: the first of `quantiles` whose inputs have the largest share.

        Returns
        -------
        dict
            By place, arrays over the pressures: the standard deviation of ln of the quantity
            with the number known over that without, between 0 and 1. That of "model" is of a
            simulated map of the face, which has no error of the law.

        Raises
        ------
        InputError
            For a quantity that is not among the quantiles.

        Examples
        --------
        >>> from mbma_tables import Joint
        >>> joint = Joint({"Ra": "1.6 um", "process": "milled"}, bodies="steel 1020 hard")
        >>> found = joint.uncertainty("5 MPa", draws=500)
        >>> list(found.what_to_measure("unloading_stiffness"))[:2]
        ['part_a.longest', 'model']
        """
        if quantity is None:
            quantity = max(self.shares, key=self._share_of_inputs)
        if quantity not in self.shares:
            raise InputError(
                f"quantity must be one of {', '.join(self.shares)}, got {quantity!r}"
            )
        rest = {
            name: np.sqrt(np.clip(1 - np.nan_to_num(share), 0, 1))
            for name, share in self.shares[quantity].items()
        }
        return dict(sorted(rest.items(), key=lambda entry: float(entry[1].mean())))

    def _share_of_inputs(self, quantity: str) -> float:
        """The mean share of all inputs in the variance of a quantity."""
        shares = self.shares[quantity]
        return float(sum(np.mean(shares[name]) for name in self.inputs))

    def shares_text(self, name: str, k: int) -> str:
        """The shares in a quantity at the k-th pressure that are known, in whole percent."""
        percents = {
            of: round(100 * float(share[k]))
            for of, share in self.shares[name].items()
            if np.isfinite(share[k])
        }
        return ", ".join(f"{of} {percent}%" for of, percent in percents.items())

    def __str__(self) -> str:
        lines = []
        for k, pressure in enumerate(self.pressure):
            lines.append(f"at {pressure:.4g} {self.units['pressure']}".removesuffix(" 1"))
            for name, rows in self.quantiles.items():
                numbers = " ".join(f"{number:.4g}" for number in rows[:, k])
                unit = self.units[name]
                quantiles = f"{numbers} {unit}".removesuffix(" 1")
                lines.append(f"  {name}: {quantiles}; {self.shares_text(name, k)}")
        levels = ", ".join(f"{level:g}" for level in self.levels)
        if self.reasons:
            lines.append(f"not valid over the whole range: {'; '.join(self.reasons)}")
        return "\n".join([f"quantiles {levels}, and shares in the variance", *lines])


def _checked_levels(levels: ArrayLike) -> tuple[float, ...]:
    """Levels of quantiles, rising between 0 and 1."""
    numbers = np.atleast_1d(finite_array("quantiles", levels))
    require("quantiles", numbers, (numbers > 0) & (numbers < 1), "between 0 and 1")
    if numbers.ndim != 1 or (np.diff(numbers) <= 0).any():
        raise InputError(f"quantiles must rise, got {levels!r}")
    return tuple(numbers.tolist())


def require_inputs(inputs: Mapping[str, Distribution], what: str) -> None:
    """Reject what has no number that is not known."""
    if not inputs:
        raise InputError(f"{what} has no number that is not known: {FORMS}")


def uncertainty_of(
    description: Description,
    pressure: Any,
    *,
    draws: int = DRAWS,
    quantiles: ArrayLike = LEVELS,
    quantities: Sequence[str] | None = None,
    seed: int = 0,
    may_be_known: bool = False,
) -> Uncertainty:
    """Quantiles and shares of a description at pressures; see `uncertainty`.

    With `may_be_known` of one without ranges, too, whose quantiles are those of the model.
    """
    whole_number_in("draws", draws, 100, MOST_DRAWS)
    whole_number_in("seed", seed, 0, 2**63 - 1)
    levels = _checked_levels(quantiles)
    load = Load.of(pressure)
    description = description.with_load(load)
    if not may_be_known:
        require_inputs(description.inputs, description.what)
    uniform = description.levels(draws, seed)
    corners = description.corners()
    # corners first: where one is refused, no draws are made in vain
    of_inputs = np.concatenate([corners, description.of_inputs(uniform)])
    medians = of_all(description.inputs, lambda each: each.median)
    central = description.make(medians)(load.at(0.5))
    drawn = description.drawn(of_inputs)
    # of the load, if it is a distribution: the last input then
    last = of_inputs[:, -1] if description.inputs else np.zeros(len(of_inputs))
    error = _standard_normal(description.of_model(uniform))
    names = _names(central, quantities)
    deviations = np.concatenate([np.zeros(len(corners)), error])
    values, errors, valid, reasons = _evaluated(
        description, drawn, last, load, names, deviations
    )
    columns = {name: rows[-draws:] for name, rows in drawn.items()} | {MODEL: error}
    bands = {}
    logarithms = []
    for name, rows in values.items():
        table = _with_model(rows[-draws:], errors[name][-draws:])
        bands[name] = np.quantile(table, levels, axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            logarithms.append(np.where((table > 0).all(axis=0), np.log(table), table))
    # one fit for all quantities
    fitted = _shares(columns, np.concatenate(logarithms, axis=1))
    shares = {}
    for k, name in enumerate(bands):
        own = slice(k * len(load.given), (k + 1) * len(load.given))
        shares[name] = {of: share[own] for of, share in fitted.items()}
        is_stated = np.isfinite(errors[name][-draws:]).all(axis=0)
        shares[name][MODEL] = np.where(is_stated, shares[name][MODEL], np.nan)
    return Uncertainty(
        np.ravel(central.pressure),
        description.inputs,
        levels,
        bands,
        shares,
        np.asarray(valid.all(axis=0)),
        reasons,
        draws,
        seed,
        {name: central.units[name] for name in ("pressure", *bands)},
    )


@dataclasses.dataclass(frozen=True, eq=False)
class Replica:
    """One draw of all numbers that are not known, and of the model's error.

    Attributes
    ----------
    inputs : dict
        The numbers of this draw by place, as they would be typed.
    model : float
        The model's error in standard deviations: the same for all quantities and loads.
    """

    inputs: dict[str, Any]
    model: float
    _pressed: Pressed
    _level_of_load: float

    def at_pressure(self, pressure: ArrayLike | str) -> ReplicaContact:
        """The contact of this draw at pressures, as of `Joint.at_pressure`; of a range it has its own draw."""
        load = Load.of(pressure)
        if load.distributions:
            drawn = load.at(self._level_of_load)
            is_one = isinstance(pressure, str | Mapping)
            pressure = drawn[0] if is_one else drawn
        return ReplicaContact(self._pressed(pressure), self.model)


@dataclasses.dataclass(frozen=True, eq=False)
class ReplicaContact:
    """A contact of a replica: every quantity of the registry by its name, with the replica's error of the model.

    Quantities without a model uncertainty are those of `contact`; they are NaN where it is
    not known.
    """

    contact: Contact  #: without the error of the model
    model: float

    def quantity(self, name: str) -> Any:
        """A quantity by its name."""
        value = self.contact.quantity(name)
        declared, _ = _uncertain(name)
        if declared.uncertainty is None or not declared.error_sign:
            return value
        return value * np.exp(model_error(self.contact, name, self.model))

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name not in registry.registry():
            raise AttributeError(
                f"{type(self).__name__!r} object has no attribute {name!r}"
            )
        return self.quantity(name)


def replicas_of(description: Description, n: int, seed: int = 0) -> list[Replica]:
    """Draws of a description, the first ones of `uncertainty_of` with this seed."""
    whole_number_in("n", n, 1, MOST_DRAWS)
    whole_number_in("seed", seed, 0, 2**63 - 1)
    require_inputs(description.inputs, description.what)
    uniform = description.levels(n, seed)
    drawn = description.drawn(description.of_inputs(uniform))
    errors = _standard_normal(description.of_model(uniform))
    made = []
    for k, error in enumerate(errors.tolist()):
        numbers = {
            name: each.written(float(drawn[name][k]))
            for name, each in description.inputs.items()
        }
        level = float(uniform[k, -1])
        made.append(Replica(numbers, error, description.make(numbers), level))
    return made


def _described(
    surface: Any, bodies: Any, theory: str | Theory | UserTheory | None
) -> Description:
    """The contact of a surface and bodies, of which numbers may be distributions."""
    if not isinstance(surface, Mapping | AnySurface):
        raise InputError(
            "surface is a Surface, or by name the arguments of Surface.from_roughness, of "
            f"Surface or of Surface.from_moments, got {surface!r}"
        )
    surface, assumed = entries_of(surface)
    if lacks_area(surface):
        with_area(surface, assumed)
    given = {"surface": surface, "bodies": entries_of_bodies(bodies)}

    def make(numbers: Mapping[str, Any]) -> Pressed:
        entries = with_numbers(given, numbers)
        face = entries["surface"]
        if isinstance(face, Mapping):
            face = surface_of_entries(face)
        pair = bodies_of_entries(bodies, entries["bodies"])

        def pressed(pressure: Any) -> Contact:
            return contact(face, pair, pressure=pressure, theory=theory)

        return pressed

    return Description(dict(distributions_in(given)), make)


def entries_of_bodies(bodies: Any) -> Any:
    """Bodies as nested entries: of `Bodies` with a range their constants by name."""
    return vars(bodies) if isinstance(bodies, Bodies) else bodies


def bodies_of_entries(given: Any, entries: Any) -> Any:
    """Bodies of entries with other numbers than the given ones."""
    if distribution_of("E_star", given) is not None:
        return Bodies(entries)
    if isinstance(entries, Mapping) and "conductivity" in entries:
        constants = vars(given) if isinstance(given, Bodies) else given
        if distribution_of("conductivity", constants["conductivity"]) is not None:
            # a list alone would be one conductivity of each body
            both = (entries["conductivity"],) * 2
            entries = {**entries, "conductivity": both}
    if isinstance(given, Bodies):
        changed = {
            k: each for k, each in entries.items() if each is not getattr(given, k)
        }
        return dataclasses.replace(given, **changed)
    return entries


@hinted
def uncertainty(
    surface: AnySurface | Mapping[str, Any],
    bodies: Any = 1.0,
    *,
    pressure: ArrayLike | str,
    theory: str | Theory | UserTheory | None = None,
    draws: int = DRAWS,
    quantiles: ArrayLike = LEVELS,
    quantities: Sequence[str] | None = None,
    seed: int = 0,
) -> Uncertainty:
    """Quantities of a contact of which some numbers are not known: quantiles, and shares of inputs.

    Parameters
    ----------
    surface : Surface or mapping
        A surface, or by name the arguments of `Surface.from_roughness`, of `Surface` or of
        `Surface.from_moments`, of which any number may be a range "0.25..2.5 mm", a mean and its standard deviation "1.6 um +- 0.2 um",
        or a mapping of measured values, {"measured": ["1.5 um", "1.7 um"]}.
    bodies : Bodies, mapping, float or str
        As for `contact`; constants of `Bodies` may be such texts, too.
    pressure : array_like or str
        F/A0, one or several, as for `contact`; any may be a distribution, too.
    theory : str or theory, optional
        As for `contact`.
    draws : int
        Number of draws of all inputs.
    quantiles : array_like
        Levels of the quantiles, between 0 and 1.
    quantities : sequence of str, optional
        Default: those with a model uncertainty at a pressure.
    seed : int
        Of the random numbers: the same seed gives the same draws.

    Returns
    -------
    Uncertainty

    Raises
    ------
    InputError, OutOfRangeError
        For ranges that are upside down, missing units, numbers of which a part of the range
        is no surface, and where no number is a range.

    Examples
    --------
    >>> from mbma_tables import uncertainty
    >>> ground = {"Ra": "0.8 um +- 0.1 um", "hurst": "0.7..0.9", "longest": "0.25..2.5 mm",
    ...           "shortest": "8 um", "nominal_area": "4 cm^2"}
    >>> found = uncertainty(ground, "steel 1020", pressure="10 MPa", theory="calibrated")
    >>> low, median, high = found.quantiles["solid_conductance"][:, 0]
    >>> high > 2 * low, max(found.shares["solid_conductance"], key=lambda name: found.shares["solid_conductance"][name])
    (np.True_, 'surface.longest')
    """
    return uncertainty_of(
        _described(surface, bodies, theory),
        pressure,
        draws=draws,
        quantiles=quantiles,
        quantities=quantities,
        seed=seed,
    )
