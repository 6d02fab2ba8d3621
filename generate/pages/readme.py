"""README.md: theories, their deviation from simulations and their cost, and the first picture."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from generate.pages.formula import pocket_errors
from generate.pages.page import Measured, duration, evidence, table, unmarked
from mbma_tables import Surface, contact
from mbma_tables.common.plots import draw_compression, theory_label
from mbma_tables.scenes.costs import shipped_costs, shipped_distances

SHOWN = ("self_affine", 0.7, 24.0, 5, 0.0)  # a held-out spectrum: kind, H, zeta_1, wavelengths a side, shape
LOADS = np.geomspace(1e-4, 0.6, 60)  # F/(A0 E* g), g the rms gradient
ROWS = {
    ("calibrated", "law"): '`"calibrated"`: fitted to boundary-element (BEM) simulations',
    ("calibrated, map", "map of 256 x 256"): '`"calibrated"`, from a measured map',
    ("Persson", "law"): '`"persson"`: no fitted constants',
    ("MBMA reported", "law"): '`"mbma"`: the paper\'s model',
    ("boundary elements", "256 x 256, cold"): "for comparison: BEM on 256 x 256 points",
}


def picture() -> Any:
    """Force against separation and area against force by three theories, and simulated surfaces as dots."""
    seen = [one for one in evidence() if one.node == SHOWN]
    _, hurst, zeta_1, *_ = SHOWN
    surface = Surface(float(hurst), 1.0, float(zeta_1), 1.0, float(np.mean([one.h_max for one in seen])))
    u = contact(surface, pressure=LOADS * surface.rms_gradient, theory="calibrated").mean_separation
    curves = []
    for theory in ("calibrated", "mbma", "persson"):
        curve = contact(surface, mean_separation=u, theory=theory).curve()
        # three bands would hide one another
        bands: dict[str, Any] = {} if theory == "calibrated" else {"scatter": None, "area_scatter": None}
        curves.append(dataclasses.replace(curve, label=theory_label(theory), **bands))
    figure = draw_compression(curves, f"H = {hurst:g}, q1/q0 = {zeta_1:g}: a spectrum that no constant was fitted to")
    by_gap, by_force = unmarked(figure)
    for number, one in enumerate(seen):
        force = one.force * float(surface.rms_gradient)
        by_gap.plot(one.u, force, "k.", label="_" if number else "boundary elements")
        by_force.plot(force, one.area, "k.")
    by_gap.legend()
    return figure


def measure() -> Measured:
    """Blocks of the page, and its picture."""

    def off(*deviations: float) -> str:
        factors = (f"{100 * math.expm1(d):.2g}%" if d < 0.5 else f"factor {math.exp(d):.2g}" for d in deviations)
        return " / ".join(factors)

    known, rows = {(row.theory, row.way): row for row in shipped_distances()}, []
    for key, what in ROWS.items():
        row = known[key]
        cells = off(row.area_light, row.area_deep), off(row.force_light, row.force_deep)
        rows.append([what, *cells, duration(row.cost * shipped_costs().seconds)])
    header = "theory | error of area at given pressure | error of pressure at given separation | time per point"
    shares = "; ".join(
        f"error of {what} below {nine:.2g}% in nine cases of ten, at most {most:.2g}%"
        for what, _, nine, most, _ in pocket_errors()
    )
    pocket = f"On held-out surfaces at 1-97% contact: {shares} ([method](docs/formula.md#pocket-laws))."
    return {"theories": table(header, rows), "pocket": pocket}, {"docs/figures/first.svg": picture()}
