"""How much each unknown of a surface matters: logarithmic derivatives of answers, and answers over stated ranges."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.arguments import FloatArray, finite_array, hinted
from mbma_tables.errors import InputError
from mbma_tables.models import AnyModel
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.readings import Reading
from mbma_tables.surfaces.surface import PARAMETERS, Surface
from mbma_tables.theories.contact import KNOWN, contact
from mbma_tables.theories.protocol import Theory, UserTheory
from mbma_tables.units import Units, modulus_and_units, unit_of

STEP = 0.02  # of the logarithm of a parameter
RTOL = 1e-6
MAX_HURST = 0.9  # from which its steps go down: two of them, and 1 is the end
POINTS = 33  # of a range, geometric
ANSWERS = ("mean_separation", "force", "area", "stiffness", "conductance")

Answers = dict[str, FloatArray]


@dataclasses.dataclass(frozen=True, eq=False)
class Sensitivity:
    """What `sensitivity` answers; its text is a table.

    Attributes
    ----------
    by : str
        What is held: "separation", "mean_separation", "pressure" or "area".
    parameters : dict of float
        The surface's numbers, the modulus where there is one, and what is held.
    answers : dict of float
        What is asked, at these numbers; conductance over the mean conductivity of the bodies [1/length].
    slopes, errors : dict of dict of float
        d ln(answer)/d ln(parameter) by parameter and answer, the other parameters held, and estimates of their errors.
    ranges : dict of dict of tuple of float
        Smallest and largest answer while a parameter runs over its range, and, under "all", over the ends and the
        present values of all ranges together.
    units : Units
        Of parameters and answers.
    """

    by: str
    parameters: dict[str, float]
    answers: dict[str, float]
    slopes: dict[str, dict[str, float]]
    errors: dict[str, dict[str, float]]
    ranges: dict[str, dict[str, tuple[float, float]]]
    units: Units

    def __str__(self) -> str:
        width = max(map(len, self.parameters)) + 2
        lines = [f"d ln(answer)/d ln(parameter) at given {self.by}", f"{'':{width}}{'value':>22}"]
        lines[1] += "".join(f"{name:>17}" for name in self.answers)
        lines += [
            f"{name:{width}}{_with_unit(name, value, self.units):>22}"
            + "".join(f"{round(self.slopes[name][answer], 3) + 0.0:>17.3f}" for answer in self.answers)
            for name, value in self.parameters.items()
        ]
        for name, found in self.ranges.items():
            ends = "; ".join(f"{a} {low:.4g} to {high:.4g}" for a, (low, high) in found.items())
            lines.append(f"range of {name}: {ends}")
        return "\n".join(lines)


def _with_unit(name: str, value: float, units: Units) -> str:
    unit = unit_of(name, units)
    return f"{value:.5g}" + ("" if unit == "1" else f" {unit}")


@hinted
def sensitivity(
    surface: AnySurface,
    *,
    separation: ArrayLike | None = None,
    mean_separation: ArrayLike | None = None,
    pressure: ArrayLike | None = None,
    area: ArrayLike | None = None,
    E_star: float | str = 1.0,
    ranges: Mapping[str, tuple[Any, Any]] | None = None,
    theory: str | Theory | UserTheory = "mbma",
    tier: str | AnyModel = "universal",
    reading: str | Reading = "reported",
    rtol: float = 1e-8,
) -> Sensitivity:
    """How much each number of a surface matters to force, area, stiffness and conductance, by any theory.

    Parameters
    ----------
    surface : Surface
        One surface. Its parameters are its five numbers, or those of the drawing that it was made from
        (`Surface.from_roughness`).
    separation, mean_separation, pressure, area : float or str, one of them
        What is held, as for `contact`.
    E_star : float or str
        Effective modulus, as for `contact`.
    ranges : mapping of pairs, optional
        Between what a parameter may lie: {"hurst": (0.6, 0.9), "h_max": ("2 um", "4 um")}.
    theory, tier, reading, rtol : optional
        As for `contact`.

    Returns
    -------
    Sensitivity

    Raises
    ------
    InputError, OutOfRangeError
        For a batch, unknown names, ranges that end where no surface is, and where there is no contact.

    Examples
    --------
    >>> from mbma_tables import Surface, sensitivity
    >>> ground = Surface.from_roughness(Rq=0.5, Rdq=0.1, longest=100, hurst=0.8, h_max=1.8, unit="um")
    >>> found = sensitivity(ground, pressure="10 MPa", E_star="100 GPa", ranges={"hurst": (0.7, 0.9)})
    >>> print(f"area goes like Rdq^{found.slopes['Rdq']['area']:.2f}")
    area goes like Rdq^-1.03
    >>> low, high = found.ranges["hurst"]["stiffness"]
    >>> f"stiffness {low:.3g} to {high:.3g} {unit_of('stiffness', found.units)}"
    'stiffness 0.0885 to 0.094 GPa/um'
    """
    options: Any = {"theory": theory, "tier": tier, "reading": reading, "rtol": rtol}
    known = {"separation": separation, "mean_separation": mean_separation, "pressure": pressure, "area": area}
    held = {name: value for name, value in known.items() if value is not None}
    if len(held) != 1:
        raise InputError(f"give exactly one of {', '.join(KNOWN)}; got {' and '.join(held) or 'none'}")
    modulus, units = modulus_and_units(E_star, surface)
    if not isinstance(surface, Surface):
        raise InputError(
            "sensitivity is to a surface's numbers, and this one is its own spectrum: take surface.fit(), or --model "
            "self-affine; what its shortest waves are worth, `mbma fit` tells"
        )
    make, parameters = _parameters(surface)
    (by, value), *_ = held.items()
    given = parameters | {"E_star": modulus, by: units.number(by, value)}
    numbers = {name: _one_number(name, number) for name, number in given.items()}
    same = {"pressure": "force", "separation": "mean_separation"}.get(by, by)
    wanted = [name for name in ANSWERS if name != same]

    def answers(moved: Mapping[str, Any]) -> Answers:
        own = {name: moved.get(name, number) for name, number in numbers.items()}
        modulus, place = own.pop("E_star"), own.pop(by)
        found = contact(make(**own), **{by: place}, E_star=modulus, **options)
        values = {name: getattr(found, name) for name in ANSWERS[:-1]} | {"conductance": found.stiffness / modulus}
        return {name: np.asarray(values[name]) for name in wanted}

    here = answers({})
    if not all(number > 0 for number in here.values()):
        raise InputError(f"there is no contact at this {by}, or full contact: nothing to take a logarithm of")
    varied = [name for name, number in numbers.items() if number != 0 and (name != "E_star" or units.stress != "1")]
    slopes, errors = _slopes(answers, numbers, varied, wanted)
    return Sensitivity(
        by,
        {name: numbers[name] for name in varied},
        {name: float(number) for name, number in here.items()},
        slopes,
        errors,
        _ranges(answers, numbers, ranges or {}, units),
        units,
    )


def _parameters(surface: Surface) -> tuple[Callable[..., Surface], dict[str, Any]]:
    """How the surface is made, and from which numbers."""
    if surface.labelled or surface.shape != ():
        raise InputError("sensitivities are of one surface, not of a batch")
    own = {name: getattr(surface, name) for name in PARAMETERS}
    first = surface.provenance[0] if surface.provenance else {}
    if first.get("step") == "from_roughness" and first["unit"] == surface.unit:
        drawn = Surface.from_roughness(**first["given"])
        # unless a number was replaced since
        if all(np.isclose(getattr(drawn, name), number, rtol=1e-9) for name, number in own.items()):
            return lambda **numbers: Surface.from_roughness(**numbers), dict(first["given"])
    return Surface, own


def _one_number(name: str, value: Any) -> float:
    number = finite_array(name, value)
    if number.ndim:
        raise InputError(f"{name} must be one number here, got shape {number.shape}")
    return float(number)


def _slopes(
    answers: Callable[[Mapping[str, Any]], Answers], numbers: Mapping[str, float], varied: list[str], wanted: list[str]
) -> tuple[dict[str, dict[str, float]], dict[str, dict[str, float]]]:
    """Logarithmic derivatives and their errors, by Richardson extrapolation of differences."""
    from scipy.differentiate import derivative

    of, what = (index.astype(float) for index in np.indices((len(varied), len(wanted))))

    def logarithm(x: Any, parameter: Any, answer: Any) -> Any:
        x, parameter, answer = np.broadcast_arrays(x, parameter, answer)
        moved = {
            name: numbers[name] * np.exp(np.where(parameter == place, x, 0.0)) for place, name in enumerate(varied)
        }
        found = answers(moved)
        return np.log(np.choose(answer.astype(int), [found[name] for name in wanted]))

    down = np.array([[name == "hurst" and numbers[name] > MAX_HURST] * len(wanted) for name in varied])
    found = derivative(
        logarithm,
        np.zeros(of.shape),
        args=(of, what),
        initial_step=STEP,
        step_direction=np.where(down, -1.0, 0.0),
        tolerances={"rtol": RTOL, "atol": RTOL},
        maxiter=4,
    )
    slopes, errors = (
        {name: dict(zip(wanted, row, strict=True)) for name, row in zip(varied, table.tolist(), strict=True)}
        for table in (found.df, found.error)
    )
    return slopes, errors


def _ranges(
    answers: Callable[[Mapping[str, Any]], Answers],
    numbers: Mapping[str, float],
    ranges: Mapping[str, tuple[Any, Any]],
    units: Units,
) -> dict[str, dict[str, tuple[float, float]]]:
    """Smallest and largest answers over each range, and over the ends of all."""
    ends = {}
    for name, pair in ranges.items():
        if name not in numbers:
            raise InputError(f"ranges: there is no {name!r}; there are {', '.join(numbers)}")
        if isinstance(pair, str) or np.size(pair) != 2:
            raise InputError(f"ranges: {name} needs two numbers, from and to, got {pair!r}")
        low, high = (_one_number(name, units.number(name, end)) for end in pair)
        if not 0 < low < high:
            raise InputError(f"ranges: {name} must be two rising positive numbers, got {low:g} and {high:g}")
        ends[name] = (low, high)
    found = {name: answers({name: np.geomspace(*pair, POINTS)}) for name, pair in ends.items()}
    if len(ends) > 1:
        corners = np.array(list(itertools.product(*((low, numbers[name], high) for name, (low, high) in ends.items()))))
        found["all"] = answers(dict(zip(ends, corners.T, strict=True)))
    return {
        name: {answer: (float(np.min(v)), float(np.max(v))) for answer, v in values.items()}
        for name, values in found.items()
    }
