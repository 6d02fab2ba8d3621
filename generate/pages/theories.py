"""docs/theories.md: results of every theory for one surface, and their curves."""

from __future__ import annotations

import itertools

import numpy as np

from generate.pages.page import Measured, table, unmarked
from mbma_tables import Surface, contact
from mbma_tables.common.plots import Curve, draw_compression, theory_label
from mbma_tables.scenes.steps import other_theory
from mbma_tables.theories import THEORIES

PRESSURES = (1e-4, 1e-3, 1e-2)  # over E*


def measure() -> Measured:
    """Separation, area and stiffness at a few pressures, and curves of force and area, by every theory."""
    road, rows, curves = Surface.named("concrete"), [], []
    for pressure, name in itertools.product(PRESSURES, THEORIES):
        found = contact(road, pressure=pressure, theory=name)
        numbers = found.mean_separation / road.h_rms, 100 * found.area, found.stiffness * road.h_rms / pressure
        spread = found.scatter if np.isfinite(found.scatter) else "not known"
        rows.append([pressure, f"`{name}`", *numbers, "yes" if found.valid else "no", spread])
    header = "F/(A0 E*) | theory | u/h_rms | A/A0 [%] | stiffness h_rms/F | valid | scatter of ln F"
    text = table(header, rows, "{:g} | {} | {:.3g} | {:.3g} | {:.3g} | {} | {:.2g}")
    gap = float(road.h_max) * (1 - 2 * np.linspace(0.002, 1.0, 121))
    for name in THEORIES:
        line = other_theory(name, road, gap, 1.0)
        known, u = np.isfinite(line.pressure), (road.h_max + gap) / (2 * road.h_rms)
        curves.append(Curve(theory_label(name), u[known], *(field[known] for field in line)))
    figure = draw_compression(curves, "concrete road of Lorenz, by every theory")
    by_gap, by_force = unmarked(figure)
    by_gap.legend()
    by_gap.set_ylim(1e-8, 20)
    by_force.set(xlim=(1e-6, 10), ylim=(1e-6, 5))
    return {"answers": text}, {"docs/figures/theories.svg": figure}
