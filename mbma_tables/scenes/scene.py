"""A scene: surface, gaps or loads, requested effects, and tolerance or time budget."""

from __future__ import annotations

import dataclasses
import math
import os
import pathlib
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mbma_tables.common.arguments import finite_array, needed
from mbma_tables.common.errors import InputError
from mbma_tables.scenes.costs import shipped_costs
from mbma_tables.scenes.plan import Plan, duration, make_plan, seconds_by_theory
from mbma_tables.scenes.problem import INVERTED, PRESCRIBED, Problem
from mbma_tables.scenes.specimen import check, from_tables, read_toml, schema

if TYPE_CHECKING:
    import xarray

MAX_AREA = 0.99
CANDIDATES = ("calibrated", "persson", "greenwood_williamson")
# effect: the quantity of tables/calibrated.nc whose deviation from simulation is compared
QUANTITIES = {"stiffness": "stiffness", "conductance": "stiffness", "pressure": "pressure", "energy": "pressure"}


@dataclasses.dataclass(frozen=True, eq=False)
class Scene(Problem):
    """Description of a simulation, checked on construction; it can be run repeatedly.

    Parameters
    ----------
    surface : Surface
        One surface, not a batch.
    effects : sequence of str
        Requested effects, names of `mbma_tables.scenes.problem.OUTPUTS`.
    without : sequence of str
        Refinements of the model switched off: "subscale_area", "sphere_deformation", "finite_height".
    separations, mean_separations, pressures, areas : array_like, one of them
        d [length], u [length], F/A0 in the unit of `E_star`, or A/A0; one number or a list. Texts such as "0.8 um" are
        converted to the units of the surface and the modulus.
    E_star : float or str
        Effective modulus; stresses come out in its unit. 1 gives them over E*. A text has its unit: "100 GPa".
    hardness : float or str, optional
        Largest pressure that the softer body bears, in the unit of `E_star`, for "yield": the theory's elastic result
        is corrected by `mbma_tables.laws.hardness`, and conductance is that of the frozen contact.
    rtol : float, optional
        Requested relative error, in [1e-10, 0.1]; 1e-6 where no `seconds` are given either, 1e-4 of other theories.
    seconds : float, optional
        Instead of `rtol`: a time budget, spent on as much accuracy as the measured costs allow.
    variant : str or Variant
        Which variant of the paper's equations.
    island_model : str or IslandModel, optional
        Island model, as for `contact`; without it the plan chooses between "universal" and "exact".
    theory : str or theory, optional
        One of `mbma_tables.theories.THEORIES` or an object, as for `contact`. Refinements, island model and variant
        are MBMA's.
    conductivities : pair of float or str, optional
        Of the two bodies, thermal or electrical, for "conductance", as for `Contact.conductance`.
    deltas : array_like, optional
        Approaches [length] of the islands of "pressure_profile".
    theories : sequence of str
        For "comparison": names of other theories, or "persson_simplified".
    points : int
        Points of the distribution of "island_statistics", over the approach.
    length_unit : str, optional
        For a surface without a unit.
    stress_unit : str, optional
        Unit of `E_star`; a text with another unit is converted.
    title : str, optional
        For the result.

    Raises
    ------
    InputError, OutOfRangeError
        For meaningless or contradictory arguments; the message has the correction.

    Examples
    --------
    >>> from mbma_tables import Scene, Surface
    >>> scene = Scene(Surface.named("concrete"), effects=["pressure"], separations=[0.2, 0.5], rtol=1e-5)
    >>> [step.name for step in scene.plan().steps]
    ['totals']
    >>> found = scene.run()
    >>> [f"{pressure:.3e}" for pressure in found["pressure"].values]
    ['1.754e-03', '1.292e-04']
    >>> found.attrs["error"] <= 1e-5
    True
    """

    @classmethod
    def from_toml(cls, path: os.PathLike[str] | str) -> Scene:
        """The scene of a TOML file, see docs/scenes.md and `scene.schema.json`.

        Raises
        ------
        InputError
            For errors in the file: one message that starts with its path and has the correction.
        """
        file = pathlib.Path(path)
        entries = read_toml(file, "scene")
        try:
            return cls(**_arguments(entries, file.parent, file.stem))
        except InputError as fault:
            raise InputError(f"{file}: {fault}") from None

    @classmethod
    def from_mapping(cls, content: Mapping[str, Any]) -> Scene:
        """The scene of the content of a TOML file; paths in it are relative to the current folder."""
        return cls(**_arguments(content, pathlib.Path(), "scene"))

    def plan(self) -> Plan:
        """The planned steps with island models, tolerances, certified errors and measured costs."""
        return make_plan(self)

    def explain(self) -> str:
        """The plan as text, with a line on the theory that is closer to simulation, if there is one."""
        return self.plan().text() + advice(self)

    def run(self, progress: Callable[[str, int, int], None] | None = None) -> xarray.Dataset:
        """Compute the requested effects.

        Parameters
        ----------
        progress : callable, optional
            Called as ``progress(step, done, total)``.

        Returns
        -------
        xarray.Dataset
            Quantities with units; in its attributes the plan, the error bound reached, the variant and the hashes
            of the tables that were used.

        Raises
        ------
        InputError, OutOfRangeError, ConvergenceError
        """
        needed("xarray")
        from mbma_tables.scenes.run import run_plan

        return run_plan(self, self.plan(), progress)


def _arguments(content: Mapping[str, Any], folder: pathlib.Path, title: str) -> dict[str, Any]:
    """The arguments of `Scene` from a file's content; files that it names are relative to `folder`."""
    check(content, schema())
    specimen = from_tables(content, folder, title)

    def lengths(table: dict[str, Any]) -> dict[str, Any]:
        """The numbers of a table, in the surface's unit."""
        if not table.pop("over_h_rms", False):
            return table
        return {name: finite_array(name, value) * float(specimen.surface.h_rms) for name, value in table.items()}

    prescribed = dict(content.get("prescribed", {}))
    for name in INVERTED:
        if "over_h_rms" in prescribed and name in prescribed:
            raise InputError(f"[prescribed]: over_h_rms is for lengths, {name} are not: leave it out")
    if not prescribed and "prescribed" in content:
        raise InputError(f"[prescribed] is empty: give one of {', '.join(PRESCRIBED)}")
    statistics = content.get("island_statistics", {})
    if statistics and "island_statistics" not in content["effects"]["on"]:
        raise InputError("[island_statistics] is given and the effect is off: add it to on, or leave the table out")
    found: dict[str, Any] = {
        "surface": specimen.surface,
        "effects": content["effects"]["on"],
        "without": content["effects"].get("off", ()),
        "E_star": 1.0 if specimen.E_star is None else specimen.E_star,
        "stress_unit": specimen.stress_unit,
        "title": title,
    }
    found |= {name: content[name] for name in ("title", "theory", "variant") if name in content}
    found |= lengths(prescribed) | lengths(dict(content.get("pressure_profile", {})))
    found |= dict(content.get("accuracy", {})) | statistics | content.get("comparison", {})
    found |= content.get("yield", {})
    if "conductance" in content:
        found["conductivities"] = (content["conductance"]["k1"], content["conductance"]["k2"])
    return found


def advice(problem: Problem) -> str:
    """Advice if a gap, stiffness or conductance is requested of MBMA; else empty."""
    asked = {name: quantity for name, quantity in QUANTITIES.items() if name in problem.outputs}
    if problem.prescribed in INVERTED:
        asked = {"gap": "pressure"} | {name: quantity for name, quantity in asked.items() if quantity == "stiffness"}
    contacts = _contacts(problem) if problem.theory == "mbma" and asked else np.empty(0)
    if not contacts.size:
        return ""
    from mbma_tables.answers.contact import contact
    from mbma_tables.theories.calibrated_table import shipped
    from mbma_tables.theories.mbma import Mbma

    # stiffness first, if both are requested
    name, quantity = next((pair for pair in asked.items() if pair[1] == "stiffness"), next(iter(asked.items())))
    # deviations at the contact fraction by the calibrated law, in the middle of the prescribed range
    area = float(np.median(contacts))
    rows = {"mbma": Mbma(variant=problem.variant).scatter_name(problem.surface), **{row: row for row in CANDIDATES}}
    spread = {
        theory: float(shipped().standard_deviation(row, quantity, np.asarray(area))) for theory, row in rows.items()
    }
    # NaN: not compared, or no such contact is reached
    nearest = min(CANDIDATES, key=lambda theory: np.nan_to_num(spread[theory], nan=math.inf))
    if not spread[nearest] < np.nan_to_num(spread["mbma"], nan=math.inf):
        return ""
    measured = shipped_costs()
    price = seconds_by_theory(measured, nearest, problem.gaps.size, problem.prescribed in INVERTED)
    reasons = contact(problem.surface, area=min(area, MAX_AREA), theory=nearest).reasons
    return (
        f"  advice: for {name} theory {nearest!r} is closer to boundary elements, {_size(spread[nearest])} instead of "
        f"{_size(spread['mbma'])} at {area:.2%} contact, in {duration(price)} instead of "
        f"{duration(make_plan(problem, measured).seconds)}{'; not tested there: ' if reasons else ''}"
        f"{', '.join(reasons)}\n"
    )


def _size(spread: float) -> str:
    """A standard deviation of a logarithm in words."""
    if math.isnan(spread):
        return "an unknown distance"
    return f"{spread:.1%}" if spread < 0.3 else f"a factor {math.exp(spread):.2g}"


def _contacts(problem: Problem) -> Any:
    """Contact fractions by the calibrated law where surfaces touch."""
    from mbma_tables.laws.calibrated import area
    from mbma_tables.theories import get_theory

    surface, known = problem.surface, problem.gaps
    if problem.prescribed == "areas":
        found = known
    elif problem.prescribed == "pressures":
        found = area(known / problem.E_star / float(surface.rms_gradient), float(surface.alpha))
    else:
        h_max = float(surface.h_max)
        u = known if problem.prescribed == "mean_separations" else (h_max + known) / 2
        found = get_theory("calibrated").answer(surface, np.minimum(u, h_max)).area
    return found[found > 0]
