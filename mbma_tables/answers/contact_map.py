"""Pressures and gaps at every point of a map at one load, simulated by boundary elements."""

import dataclasses
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.display import Displayed, Variable, shown
from mbma_tables.common.errors import InputError
from mbma_tables.common.plots import new_figure, pressure_label
from mbma_tables.common.progress import shown as progress
from mbma_tables.common.units import Units, unit_of
from mbma_tables.laws.boundary_elements import Contact as Simulation
from mbma_tables.laws.pressing import TOLERANCE
from mbma_tables.theories.own_map import map_of, sides


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class ContactMap(Displayed):
    """Contact of one map at one load, from `Contact.map`; arrays of shape (nx, ny), the first axis is x."""

    pressure: FloatArray  #: contact pressure, zero where the gap is open [stress]
    gap: FloatArray  #: gap to the plane, zero in contact [length]
    heights: FloatArray  #: heights above their mean [length]
    steps: tuple[float, ...]  #: sampling steps along x and y [length]
    units: Units

    contact = property(lambda self: self.pressure > 0, doc="True where the map is in contact.")

    def _facts(self) -> dict[str, str]:
        stress, length = unit_of("pressure", self.units), self.units.length or "1"
        return {
            "points": " x ".join(map(str, self.pressure.shape)),
            "pressure": shown(self.pressure.mean(), stress),
            "contact": f"{self.contact.mean():.4g} of the points",
            "largest_pressure": shown(self.pressure.max(), stress),
            "mean_gap": shown(self.gap.mean(), length),
        }

    def _variables(self) -> dict[str, Variable]:
        stress, length = unit_of("pressure", self.units), self.units.length or "1"
        axes = zip("xy", self.pressure.shape, self.steps, strict=True)
        places = {name: Variable(np.arange(count) * step, length, "", (name,)) for name, count, step in axes}
        return places | {
            "pressure": Variable(self.pressure, stress, "contact pressure", ("x", "y")),
            "gap": Variable(self.gap, length, "gap to the rigid plane", ("x", "y")),
            "contact": Variable(self.contact, "1", "whether the map touches", ("x", "y")),
            "heights": Variable(self.heights, length, "height above the mean", ("x", "y")),
        }

    def _figure(self) -> Any:
        figure = new_figure(10, 4.2)
        length, stress = self.units.length or "length", unit_of("pressure", self.units)
        sides = [count * step for count, step in zip(self.pressure.shape, self.steps, strict=True)]
        fields = {
            pressure_label(stress): (np.where(self.contact, self.pressure, np.nan), "magma_r"),
            f"gap [{length}]": (np.where(self.contact, np.nan, self.gap), "viridis"),
        }
        for axes, (label, (values, colours)) in zip(figure.subplots(1, 2), fields.items(), strict=True):
            picture = axes.imshow(values.T, origin="lower", extent=(0, sides[0], 0, sides[1]), cmap=colours)
            axes.set_xlabel(f"x [{length}]")
            axes.set_ylabel(f"y [{length}]")
            figure.colorbar(picture, ax=axes, label=label, shrink=0.8)
        return figure


def contact_map(found: Any) -> ContactMap:
    """Simulation of a contact's map at the contact's pressure; see `Contact.map`."""
    source, pressure = found._source, np.asarray(found.pressure, float)
    if pressure.ndim or np.ndim(source.E_star) or np.ndim(source.hardness):
        raise InputError("a map is of one contact: give one pressure, one modulus and one hardness")
    surface: Any = source.surface
    whole = map_of(surface)
    modulus, force = float(source.E_star), float(pressure) / float(source.E_star)
    if not 0 < force < np.inf:
        raise InputError(f"a map needs a pressure above 0, got {float(pressure):g}")
    values, sizes = whole.heights - whole.heights.mean(), sides(whole)
    # of rms gradient one, heights of order one
    scale, gradient = float(np.abs(values).max()), float(surface.bearing.gradient)
    stretched = sizes[0] * gradient / scale, sizes[1] * gradient / scale
    cap = float(source.hardness) / modulus / gradient
    engine = Simulation(values / scale, stretched, TOLERANCE, cap, not whole.periodic)
    with progress("boundary elements"):
        engine.press(force / gradient)
    fields = modulus * gradient * engine.traction, scale * engine.gap, values
    return ContactMap(*fields, whole.steps, source.units)
