"""docs/theories.md: results of every theory for one surface, and their curves."""

from __future__ import annotations

import numpy as np

from generate.pages.page import Measured, svg, table, unmarked
from mbma_tables import Surface, contact
from mbma_tables.common.plots import Curve, draw_compression, theory_label
from mbma_tables.theories import THEORIES, get_theory
from mbma_tables.theories.protocol import answer_where_finite

PRESSURES = (1e-4, 1e-3, 1e-2)  # over E*
CURVE_POINTS = 121


def draw(road: Surface) -> bytes:
    """Force and area of a surface by every theory."""
    u = float(road.h_max) * (1 - np.linspace(0.002, 1.0, CURVE_POINTS))
    curves = []
    for name in THEORIES:
        theory = get_theory(name)
        found = answer_where_finite(theory, road, u)
        known = np.isfinite(found.pressure)
        scatter, area_scatter = theory.scatter(road, found.area[known])
        gap = u[known] / road.h_rms
        curves.append(Curve(theory_label(name), gap, found.pressure[known], found.area[known], scatter, area_scatter))
    figure = draw_compression(curves, "concrete road of Lorenz, by every theory")
    by_gap, by_force = unmarked(figure)
    by_gap.legend()
    by_gap.set_ylim(1e-8, 20)
    by_force.set(xlim=(1e-6, 10), ylim=(1e-6, 5))
    return svg(figure)


def measure() -> Measured:
    """Separation, area and stiffness of the concrete road at a few pressures, by every theory, and the figure."""
    road, lines = Surface.named("concrete"), []
    for pressure in PRESSURES:
        for name in THEORIES:
            found = contact(road, pressure=pressure, theory=name)
            spread = f"{found.scatter:.2g}" if np.isfinite(found.scatter) else "not known"
            numbers = (found.mean_separation / road.h_rms, 100 * found.area, found.stiffness * road.h_rms / pressure)
            valid = "yes" if found.valid else "no"
            lines.append([f"{pressure:g}", f"`{name}`", *(f"{number:.3g}" for number in numbers), valid, spread])
    header = ["F/(A0 E*)", "theory", "u/h_rms", "A/A0 [%]", "stiffness h_rms/F", "valid", "scatter of ln F"]
    return {"answers": table(header, lines)}, {"docs/figures/theories.svg": draw(road)}
