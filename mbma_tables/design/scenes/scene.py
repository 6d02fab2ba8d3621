"""A scene: surface, gaps or loads, requested effects, and tolerance or time budget."""

from __future__ import annotations

import dataclasses
import os
import pathlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mbma_tables.common.errors import InputError
from mbma_tables.common.toml_files import check, read_toml
from mbma_tables.design.scenes.plan import Plan, make_plan
from mbma_tables.design.scenes.problem import Problem
from mbma_tables.design.scenes.specimen import from_tables, refuse_joint, schema
from mbma_tables.islands.island_models import beside

if TYPE_CHECKING:
    import xarray


@dataclasses.dataclass(frozen=True, eq=False)
class Scene(Problem):
    """Description of a simulation, checked on construction; it can be run repeatedly.

    Parameters
    ----------
    surface : Surface
        One surface, not a batch.
    effects : sequence of str
        Requested effects: names of quantities of a contact, and of
        `mbma_tables.design.scenes.problem.OTHERS`.
    without : sequence of str
        Refinements of the model switched off: "subscale_area", "sphere_deformation",
        "finite_height".
    separations, mean_separations, pressures, areas : array_like, one of them
        d [length], u [length], F/A0 in the unit of `E_star`, or A/A0; one number or a list.
        Texts such as "0.8 um" are converted to the units of the surface and the modulus.
    E_star : float or str
        Effective modulus, as a number or as text with a unit ("100 GPa"); stresses are in
        its unit, over E* if it is 1.
    hardness : float or str, optional
        Largest pressure that the softer body supports, in the unit of `E_star`, for
        "yield": the theory's elastic result is corrected by
        `mbma_tables.theories.yielding`, and conductance is that at constant contact area.
    rtol : float, optional
        Requested relative error, in [1e-10, 0.1]; without `seconds` by default 1e-6, or
        1e-4 for other theories.
    seconds : float, optional
        Time budget instead of `rtol`; the measured costs determine the accuracy that it allows.
    variant : str or Variant
        Variant of the paper's equations.
    island_model : str, path or IslandModel, optional
        Island model, as for `Mbma`; without it the plan chooses between "universal" and "exact".
    theory : str or theory, optional
        One of `mbma_tables.theories.THEORIES` or an object, as for `contact`. Refinements,
        island model and variant are MBMA's.
    conductivities : pair of float or str, optional
        Of the two bodies, thermal or electrical, for "solid_conductance", as for `Contact.solid_conductance`.
    deltas : array_like, optional
        Approaches [length] of the islands of "pressure_profile".
    theories : sequence of str
        For "comparison": names of other theories.
    points : int
        Points of the distribution of "island_statistics", over the approach.
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
    ['contact']
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
        refuse_joint(file, entries)
        try:
            return cls.from_mapping(entries, file.parent, file.stem)
        except InputError as fault:
            raise InputError(f"{file}: {fault}") from None

    @classmethod
    def from_mapping(
        cls,
        content: Mapping[str, Any],
        folder: pathlib.Path = pathlib.Path(),
        title: str = "scene",
    ) -> Scene:
        """The scene of the content of a TOML file; paths in it are relative to `folder`, the current one by default."""
        check(content, schema())
        specimen = from_tables(content, folder, title)
        if (
            content.get("island_statistics")
            and "island_statistics" not in content["effects"]["on"]
        ):
            raise InputError(
                "[island_statistics] is given and the effect is off: add it to on, or leave the table out"
            )
        found: dict[str, Any] = {
            "surface": specimen.surface,
            "effects": content["effects"]["on"],
            "without": content["effects"].get("off", ()),
            "E_star": specimen.modulus,
            "title": title,
        }
        found |= {
            name: content[name]
            for name in ("title", "theory", "variant", "island_model")
            if name in content
        }
        if "island_model" in found:
            found["island_model"] = beside(found["island_model"], folder)
        for name in (
            "prescribed",
            "pressure_profile",
            "accuracy",
            "island_statistics",
            "comparison",
            "yield",
        ):
            found |= content.get(name, {})
        if "solid_conductance" in content:
            found["conductivities"] = (
                content["solid_conductance"]["k1"],
                content["solid_conductance"]["k2"],
            )
        return cls(**found)

    def plan(self) -> Plan:
        """The planned steps with island models, tolerances, certified errors and measured costs."""
        return make_plan(self)

    def explain(self) -> str:
        """The plan as text."""
        return self.plan().text()

    def run(self) -> xarray.Dataset:
        """Compute the requested effects.

        Returns
        -------
        xarray.Dataset
            Quantities with units; in its attributes the plan, the error bound reached, the
            variant and the hashes of the tables that were used.

        Raises
        ------
        InputError, OutOfRangeError, ConvergenceError
        """
        from mbma_tables.design.scenes.run import run_plan

        return run_plan(self, self.plan())
