"""Sensitivity of results to each parameter of a surface: logarithmic derivatives."""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.answers.contact import chosen_theory, contact, one_known
from mbma_tables.common.arguments import FloatArray, hinted, one_number
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import Units, modulus_and_units, unit_of
from mbma_tables.materials import Metal, Pair, bodies, hardness_in
from mbma_tables.models import AnyModel
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.heights import Heights
from mbma_tables.surfaces.maps import extrapolated
from mbma_tables.surfaces.self_affine import PARAMETERS
from mbma_tables.surfaces.surface import MeasuredSurface, Surface
from mbma_tables.surfaces.variants import Variant
from mbma_tables.theories import OF_MAPS, theory_name
from mbma_tables.theories.calibrated import Calibrated
from mbma_tables.theories.protocol import Theory, UserTheory

STEP = 0.02  # step of the logarithm of a parameter
NEAR = 0.9  # share of a parameter's upper limit above which its steps go down
MAX_ERROR = 0.05  # largest error of a slope, over itself or 1; else it is NaN
ANSWERS = ("mean_separation", "pressure", "area", "stiffness", "conductance")


@dataclasses.dataclass(frozen=True, eq=False)
class Sensitivity:
    """Result of `sensitivity`; its text is a table.

    Stiffness is that of loading, conductance that over the mean conductivity of the bodies [1/length].
    """

    by: str  #: quantity held fixed: "separation", "mean_separation", "pressure" or "area"
    parameters: dict[str, float]  #: the surface's parameters, the modulus if given, and the quantity held fixed
    answers: dict[str, float]  #: the results for these parameters
    #: d ln(result)/d ln(parameter) by parameter and result, the other parameters held; NaN where the result jumps
    slopes: dict[str, dict[str, float]]
    errors: dict[str, dict[str, float]]  #: estimates of their errors
    units: Units  #: of parameters and results

    def __str__(self) -> str:
        width = max(map(len, self.parameters)) + 2
        lines = [f"d ln(answer)/d ln(parameter) at given {self.by}", f"{'':{width}}{'value':>22}"]
        lines[1] += "".join(f"{name:>17}" for name in self.answers)
        for name, value in self.parameters.items():
            slopes = "".join(f"{round(self.slopes[name][answer], 3) + 0.0:>17.3f}" for answer in self.answers)
            number = f"{value:.5g} {unit_of(name, self.units)}".removesuffix(" 1")
            lines.append(f"{name:{width}}{number:>22}{slopes}")
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
    theory: str | Theory | UserTheory | None = None,
    island_model: str | AnyModel = "universal",
    variant: str | Variant = "reported",
    rtol: float = 1e-8,
    hardness: float | str | None = None,
    materials: str | Metal | Pair | Sequence[str | Metal] | None = None,
) -> Sensitivity:
    """Sensitivity of pressure, area, stiffness and conductance to each parameter of a surface, for any theory.

    Parameters
    ----------
    surface : Surface
        One surface. Its parameters are its five numbers, or those of the drawing that it was made from
        (`Surface.from_roughness`). Those of one given by a spectrum are "heights" and "lengths", factors of all
        heights and of all lengths along the plane, like an instrument's calibration factors; h_max alone; the
        "shortest" and "longest" wavelengths, cut-offs that only remove wavelengths, and with an extrapolated spectrum
        its exponent "extrapolate_hurst". Where the calibrated law uses a map's own heights and curves, h_max and
        cut-offs are left out: they follow from the map.
    separation, mean_separation, pressure, area : float or str, one of them
        The quantity held fixed, as for `contact`.
    E_star : float or str
        Effective modulus, as for `contact`.
    theory, island_model, variant, rtol, hardness, materials : optional
        As for `contact`, but for maps "calibrated" by default, since a simulation applies to one surface only; a
        hardness is one of the parameters.

    Returns
    -------
    Sensitivity

    Raises
    ------
    InputError, OutOfRangeError
        For a batch, unknown names, and where there is no contact.

    Examples
    --------
    >>> from mbma_tables import Surface, sensitivity
    >>> ground = Surface.from_roughness(Rq=0.5, Rdq=0.1, longest=100, hurst=0.8, h_max=1.8, unit="um")
    >>> found = sensitivity(ground, pressure="10 MPa", E_star="100 GPa")
    >>> print(f"area goes like Rdq^{found.slopes['Rdq']['area']:.2f}")
    area goes like Rdq^-1.03
    >>> found = sensitivity(ground, pressure="10 MPa", materials="steel 1020", theory="calibrated")
    >>> f"conductance goes like hardness^{found.slopes['hardness']['conductance']:.2f}"
    'conductance goes like hardness^-0.68'
    """
    from scipy.differentiate import jacobian

    named = theory_name(surface, theory, island_model=island_model, variant=variant, rtol=rtol)
    # a simulation is of one surface only
    named = "calibrated" if theory is None and named in OF_MAPS else named
    chosen = chosen_theory(surface, named, island_model=island_model, variant=variant, rtol=rtol)
    by, value = one_known(separation=separation, mean_separation=mean_separation, pressure=pressure, area=area)
    E_star, hardness, _ = bodies(materials, E_star, hardness)
    modulus, units = modulus_and_units(E_star, surface)
    cap = hardness_in(units, np.inf if hardness is None else hardness)
    make, parameters = _parameters(surface) if isinstance(surface, Surface) else _of_spectrum(surface, chosen)
    given = parameters | {"E_star": modulus, by: units.number(by, value)}
    given |= {} if np.equal(cap, np.inf).all() else {"hardness": cap}
    numbers = {name: float(one_number(name, number)) for name, number in given.items()}
    same = "mean_separation" if by == "separation" else by
    wanted, batches = [name for name in ANSWERS if name != same], isinstance(surface, Surface)
    varied = [name for name, number in numbers.items() if number != 0 and (name != "E_star" or units.stress != "1")]

    @np.errstate(all="ignore")
    def logarithms(x: FloatArray) -> FloatArray:
        """Of the results, as rows, where the logarithms of the varied parameters are moved by rows of x."""
        moved, back = np.unique(x.reshape(len(varied), -1), axis=1, return_inverse=True)
        given = {name: np.full(moved.shape[1], number) for name, number in numbers.items()}
        given |= {name: numbers[name] * np.exp(row) for name, row in zip(varied, moved, strict=True)}
        # there are no batches of spectra
        each: Any = [given] if batches else [{n: row[k] for n, row in given.items()} for k in range(moved.shape[1])]
        rows = []
        for own in each:
            modulus, cap, held = own.pop("E_star"), own.pop("hardness", np.inf), {by: own.pop(by)}
            found: Any = contact(make(**own), **held, E_star=modulus, hardness=cap, theory=chosen)
            values = {"conductance": found.unloading_stiffness / modulus}
            rows.append(np.log([values[name] if name in values else getattr(found, name) for name in wanted]))
        table = np.asarray(rows[0] if batches else np.transpose(rows))
        return table[:, back.ravel()].reshape(-1, *x.shape[1:])

    here = np.exp(logarithms(np.zeros((len(varied), 1))))[:, 0]
    if not (here > 0).all():
        raise InputError(f"there is no contact at this {by}, or full contact: logarithmic derivatives do not exist")
    how = {"order": 4, "maxiter": 3 if batches else 2, "initial_step": STEP, "step_direction": _sides(varied, numbers)}
    with np.errstate(all="ignore"):
        steep = jacobian(logarithms, np.zeros(len(varied)), **how)
        # a discontinuous result has no slope
        slopes = np.where(steep.error <= MAX_ERROR * np.maximum(1, np.abs(steep.df)), steep.df, np.nan)
    by_name, off = (
        {name: dict(zip(wanted, row, strict=True)) for name, row in zip(varied, table.T.tolist(), strict=True)}
        for table in (slopes, steep.error)
    )
    answers = dict(zip(wanted, here.tolist(), strict=True))
    return Sensitivity(by, {name: numbers[name] for name in varied}, answers, by_name, off, units)


def _sides(varied: Sequence[str], numbers: Mapping[str, float]) -> FloatArray:
    """Signs of one-sided steps, 0 for central ones: cut-offs only remove wavelengths, others may be near a limit."""
    ends = {"hurst": 1.0, "extrapolate_hurst": 1.0, "area": 1.0, "pressure": numbers.get("hardness", np.inf)}
    ways = {name: -1.0 for name, end in ends.items() if numbers.get(name, 0.0) > NEAR * end}
    ways |= {"shortest": 1.0, "longest": -1.0, "hardness": 1.0 if "pressure" in ways else 0.0}
    return np.array([ways.get(name, 0.0) for name in varied])


def _parameters(surface: Surface) -> tuple[Callable[..., Surface], dict[str, Any]]:
    """The function that makes the surface, and the parameters it is made from."""
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
    """The same for a surface given by a spectrum."""
    steps = {record["step"]: record for record in surface.provenance}
    own: dict[str, Any] = {"heights": 1.0, "lengths": 1.0}
    known: MeasuredSurface = surface
    # the calibrated law uses measured heights, which have their own highest point and shortest wavelengths
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
