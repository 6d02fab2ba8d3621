"""The measured parts of README.md and its picture: a simulated surface as dots, theories as lines."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr

from generate.boundary_elements.evidence import cases
from generate.pages import formula
from generate.pages.page import ROOT, svg, table
from mbma_tables import Surface, contact
from mbma_tables.plots import Curve, draw_compression, theory_label
from mbma_tables.scenes.costs import shipped_costs, shipped_distances

SHOWN = ("self_affine", 0.7, 24.0, 5, 0.0)  # a spectrum that no fit saw: H, zeta_1, waves a side
EVIDENCE = ROOT / "docs" / "data" / "boundary_elements.nc"
LOADS = np.geomspace(1e-4, 0.6, 60)  # F/(A0 E* g), g the rms gradient
ROWS = {
    ("calibrated", "law"): '`"calibrated"`: numbers that a simulation would find',
    ("calibrated, map", "map of 256 x 256"): '`"calibrated"` of a measured map',
    ("Persson", "law"): '`"persson"`: nothing fitted',
    ("MBMA reported", "law"): '`"mbma"`, the default: the paper\'s islands',
    ("boundary elements", "256 x 256, cold"): "boundary elements of 256 x 256 points, for comparison",
}


def theories() -> str:
    """Five ways to an answer, their distance from simulation and their time."""
    known, seconds = {(row.theory, row.way): row for row in shipped_distances()}, shipped_costs().seconds
    rows = []
    for key, what in ROWS.items():
        row = known[key]
        area, force = (row.area_light, row.area_deep), (row.force_light, row.force_deep)
        rows.append([what, " / ".join(map(_off, area)), " / ".join(map(_off, force)), _time(row.cost * seconds)])
    header = ("theory", "area at a pressure off by", "pressure at a separation off by", "a separation takes")
    return table(header, rows)


def _off(deviation: float) -> str:
    """A standard deviation of a logarithm in percent, or as a factor."""
    return f"{100 * math.expm1(deviation):.2g}%" if deviation < 0.5 else f"factor {math.exp(deviation):.2g}"


def _time(seconds: float) -> str:
    unit, size = next((u, s) for u, s in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 0.0)) if seconds >= s)
    return f"{float(f'{seconds / (size or 1e-9):.2g}'):g} {unit}"


def pocket() -> str:
    """Errors of the pocket laws in a line."""
    told = formula.pocket_errors()[0]
    shares = [
        f"{what} within {nine:.2g}% in nine cases of ten and {most:.2g}% in all"
        for what, (_, nine, most) in told.items()
    ]
    return f"On surfaces that no fit saw, at 1-97% contact: {'; '.join(shares)} ([how](docs/formula.md#pocket-laws))."


def picture() -> bytes:
    """Force against separation and area against force by three theories, and simulated surfaces as dots."""
    seen = [one for one in cases(xr.open_dataset(EVIDENCE)) if one.node == SHOWN]
    _, hurst, zeta_1, *_ = SHOWN
    surface = Surface(float(hurst), 1.0, float(zeta_1), 1.0, float(np.mean([one.h_max for one in seen])))
    u = np.asarray(contact(surface, pressure=LOADS * surface.rms_gradient, theory="calibrated").mean_separation)
    curves = []
    for theory in ("calibrated", "mbma", "persson"):
        found = contact(surface, mean_separation=u, theory=theory)
        # three bands would hide one another
        bands = (found.scatter, found.area_scatter) if theory == "calibrated" else (None, None)
        fields: Any = (found.mean_separation, found.force, found.area, *bands)
        curves.append(Curve(theory_label(theory), *fields))
    title = f"H = {hurst:g}, q1/q0 = {zeta_1:g}: a spectrum that no constant was fitted to"
    figure = draw_compression(curves, title)
    by_gap, by_force = figure.axes
    for line in (*by_gap.lines, *by_force.lines):
        line.set_marker("")
    for number, one in enumerate(seen):
        force = one.force * float(surface.rms_gradient)
        by_gap.plot(one.u, force, "k.", label="_" if number else "boundary elements")
        by_force.plot(force, one.area, "k.")
    by_gap.legend()
    return svg(figure)


def measure() -> tuple[dict[str, str], dict[str, bytes]]:
    """Parts of the page, and its picture."""
    parts = {"theories": theories(), "pocket": pocket()}
    return parts, {"docs/figures/first.svg": picture()}
