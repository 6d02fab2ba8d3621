"""How much each unknown of a surface matters: logarithmic derivatives of answers, and answers over stated ranges."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.arguments import FloatArray, hinted, one_number
from mbma_tables.errors import InputError
from mbma_tables.models import AnyModel
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.heights import Heights
from mbma_tables.surfaces.measured import MeasuredSurface
from mbma_tables.surfaces.readings import Reading
from mbma_tables.surfaces.resolution import extrapolated
from mbma_tables.surfaces.surface import PARAMETERS, Surface
from mbma_tables.theories.calibrated import Calibrated
from mbma_tables.theories.contact import contact, one_known
from mbma_tables.theories.protocol import Theory, UserTheory
from mbma_tables.units import Units, modulus_and_units, unit_of

STEP = 0.02  # of the logarithm of a parameter
RTOL = 1e-6
MAX_HURST = 0.9  # from which its steps go down: two of them, and 1 is the end
MAX_ERROR = 0.05  # of a slope that is told, over itself or 1
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
        d ln(answer)/d ln(parameter) by parameter and answer, the other parameters held, NaN where the answer jumps,
        and estimates of their errors.
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
        for name, value in self.parameters.items():
            slopes = "".join(f"{round(self.slopes[name][answer], 3) + 0.0:>17.3f}" for answer in self.answers)
            number = f"{value:.5g} {unit_of(name, self.units)}".removesuffix(" 1")
            lines.append(f"{name:{width}}{number:>22}{slopes}")
        for name, found in self.ranges.items():
            ends = "; ".join(f"{a} {low:.4g} to {high:.4g}" for a, (low, high) in found.items())
            lines.append(f"range of {name}: {ends}")
        return "\n".join(lines)


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
        (`Surface.from_roughness`). Those of one that is its own spectrum are "heights" and "lengths", factors of all
        heights and of all lengths along the plane, which calibrations of an instrument are about; h_max alone; the
        "shortest" and "longest" wavelengths, cut-offs that only take waves away, and with an extrapolated spectrum
        its exponent "extrapolate_hurst". Where the calibrated law takes a map's own heights, tops and valleys, h_max
        and cut-offs are left out: they are the map's.
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
    by, value = one_known(separation=separation, mean_separation=mean_separation, pressure=pressure, area=area)
    modulus, units = modulus_and_units(E_star, surface)
    make, parameters = _parameters(surface) if isinstance(surface, Surface) else _of_spectrum(surface, theory)
    given = parameters | {"E_star": modulus, by: units.number(by, value)}
    numbers = {name: float(one_number(name, number)) for name, number in given.items()}
    same = {"pressure": "force", "separation": "mean_separation"}.get(by, by)
    wanted = [name for name in ANSWERS if name != same]

    def answers(moved: Mapping[str, Any]) -> Answers:
        own = {name: moved.get(name, number) for name, number in numbers.items()}
        if isinstance(surface, Surface):
            return of_contact(**own)
        # there are no batches of spectra
        places = np.broadcast(*own.values())
        found = [one(*map(float, entry)) for entry in places]
        return {name: np.reshape([each[name] for each in found], places.shape) for name in wanted}

    def of_contact(**own: Any) -> Answers:
        modulus, place = own.pop("E_star"), own.pop(by)
        found = contact(make(**own), **{by: place}, E_star=modulus, **options)
        values = {name: getattr(found, name) for name in ANSWERS[:-1]} | {"conductance": found.stiffness / modulus}
        return {name: np.asarray(values[name]) for name in wanted}

    @functools.cache
    def one(*own: float) -> Answers:
        return of_contact(**dict(zip(numbers, own, strict=True)))

    here = answers({})
    if not all(number > 0 for number in here.values()):
        raise InputError(f"there is no contact at this {by}, or full contact: nothing to take a logarithm of")
    varied = [name for name, number in numbers.items() if number != 0 and (name != "E_star" or units.stress != "1")]
    slopes, errors = _slopes(answers, numbers, varied, wanted, 4 if isinstance(surface, Surface) else 2)
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


def _of_spectrum(surface: Any, theory: Any) -> tuple[Callable[..., MeasuredSurface], dict[str, Any]]:
    """The same of a surface that is its own spectrum."""
    steps = {record["step"]: record for record in surface.provenance}
    own: dict[str, Any] = {"heights": 1.0, "lengths": 1.0}
    known: MeasuredSurface = surface
    # the calibrated law takes measured heights and tops, which have their own highest point and shortest waves
    takes_map = getattr(theory, "name", theory) == Calibrated.name
    if surface.heights.is_gaussian or not takes_map:
        own["h_max"] = float(surface.h_max)
    if "extrapolated" in steps:
        known = surface.between(float(surface.q0), 2 * math.pi / steps["resolution"]["shortest"])
        own["extrapolate_hurst"] = steps["extrapolated"]["hurst"]
    elif surface.bearing is None or not takes_map:
        own |= {"shortest": 2 * math.pi / float(surface.q1), "longest": 2 * math.pi / float(surface.q0)}

    def make(heights: float, lengths: float, **others: float) -> MeasuredSurface:
        moved: MeasuredSurface = known
        if "shortest" in others and any(others[name] != own[name] for name in ("shortest", "longest")):
            moved = known.between(2 * math.pi / others["longest"], 2 * math.pi / others["shortest"])
        if "extrapolate_hurst" in others:
            moved = extrapolated(known, steps["extrapolated"]["shortest"], others["extrapolate_hurst"])
        if "h_max" in others:
            gaussian, h_max = moved.heights.is_gaussian, others["h_max"]
            kept = Heights.gaussian(float(moved.h_rms), h_max) if gaussian else moved.heights
            moved = dataclasses.replace(moved, h_max=h_max, heights=kept)
        return moved.resized(heights, lengths)

    return make, own


def _slopes(
    answers: Callable[[Mapping[str, Any]], Answers],
    numbers: Mapping[str, float],
    varied: list[str],
    wanted: list[str],
    rounds: int,
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

    # exponents near their end, and cut-offs, which only take waves away
    ways = {name: -1.0 for name in ("hurst", "extrapolate_hurst") if numbers.get(name, 0.0) > MAX_HURST}
    ways |= {"shortest": 1.0, "longest": -1.0}
    found = derivative(
        logarithm,
        np.zeros(of.shape),
        args=(of, what),
        initial_step=STEP,
        step_direction=np.array([[ways.get(name, 0.0)] * len(wanted) for name in varied]),
        tolerances={"rtol": RTOL, "atol": RTOL},
        maxiter=rounds,
    )
    # an answer that jumps has no slope
    df = np.where(found.error <= MAX_ERROR * np.maximum(1, np.abs(found.df)), found.df, np.nan)
    slopes, errors = (
        {name: dict(zip(wanted, row, strict=True)) for name, row in zip(varied, table.tolist(), strict=True)}
        for table in (df, found.error)
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
        low, high = (float(one_number(name, units.number(name, end))) for end in pair)
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
