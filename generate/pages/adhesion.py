"""Measured parts of docs/adhesion.md: the theory against boundary elements with an attraction."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from generate.adhesion import FILE, TABOR, answered, face_of, under_compression
from generate.page import Measured, panels, percent, table
from mbma_tables import Adhesion, Bodies, contact
from mbma_tables.theories import adhesion as theory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = (16, 17)  # seeds of held-out surfaces of the figure
RANGE = 0.3  # over h_rms
SHOWN_TABOR = 0.2


def adhesion() -> Measured:
    """The table of errors and the figure."""
    rows = pd.read_csv(FILE, comment="#")
    pressed = rows[(rows.net_pressure > 0) & (rows.mean_separation > 0.01)]
    lines = []
    for name, number in itertools.product(("simulated", "calibrated"), TABOR[:3]):
        chosen = pressed[pressed.tabor == number]
        found = answered(chosen, name, theory.THETA)
        of_area = np.log(found.area / under_compression(chosen)).abs()[found.valid]
        of_gap = np.log(found.gap / chosen.mean_separation).abs()[found.valid]
        free_area = np.log(chosen.elastic_area / under_compression(chosen)).abs()
        free_gap = np.log(chosen.elastic_separation / chosen.mean_separation).abs()
        lines.append(
            [
                name,
                f"{number:g}",
                str(int(found.valid.sum())),
                *(_middle_and_most(part) for part in (of_area, of_gap)),
                *(_middle_and_most(part[found.valid]) for part in (free_area, free_gap)),
            ]
        )
    header = (
        "theory | Tabor's number | contacts | area: median, nine in ten | mean gap | "
        "area without attraction | mean gap without"
    )
    return {"errors": table(header, lines)}, {"docs/figures/adhesion.svg": _figure(rows)}


def _middle_and_most(errors: pd.Series) -> str:
    return f"{percent(errors.median())}, {percent(errors.quantile(0.9))}%"


def _figure(rows: pd.DataFrame) -> Figure:
    """Area over load with and without an attraction, of two held-out surfaces; simulations as dots."""
    figure, axes = panels(1, 2, (9, 3.6))
    for axis, seed in zip(axes, SHOWN, strict=True):
        chosen = (rows.seed == seed) & (rows.range == RANGE) & (rows.tabor == SHOWN_TABOR)
        own = rows[chosen & rows.net_pressure.notna()]
        first = next(own.itertuples())
        face = face_of(first, "calibrated")
        gradient, h_rms = float(face.rms_gradient), float(face.h_rms)
        attraction = Adhesion(first.work * h_rms * gradient, first.range * h_rms)
        u = h_rms * np.geomspace(0.03, 3.0, 80)
        for bodies, label, line in (
            (Bodies(1.0, adhesion=attraction), "with attraction", "-"),
            (Bodies(1.0), "without", "--"),
        ):
            found = contact(face, bodies, mean_separation=u, theory="calibrated")
            axis.plot(found.pressure / gradient, found.area, line, label=label)
        axis.plot(
            own.net_pressure, under_compression(own), "o", ms=4, label="boundary elements"
        )
        axis.set_title(f"H {first.hurst:g}, zeta_1 {first.zeta_1:g}", fontsize=9)
        axis.set_xlim(-0.01, 0.25)
        axis.set_ylim(0, 0.55)
        axis.set_xlabel("net pressure over E* g")
        axis.set_ylabel("contact area A/A0")
        axis.legend(frameon=False, fontsize=8)
    return figure
