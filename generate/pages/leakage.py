"""docs/leakage.md: deviations of leakage laws from simulation, and their curves."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from generate.boundary_elements.design import TRAINING
from generate.leakage_flow import Flow, cases
from generate.leakage_law import EDGES, EVIDENCE, LARGE, errors, noise_floor, summary
from generate.pages.page import Measured, dataset, panels, spans, table
from mbma_tables import Surface, contact
from mbma_tables.answers.leakage_table import GROUP, shipped_flow
from mbma_tables.theories.calibrated_table import shipped, shipped_part

BINS = (0.004, 0.05, 0.15, 0.3, 0.4)
SPAN, HEADER = "{:.3g}-{:.3g}", "A {:.3g}-{:.3g}%"
SHOWN_SETS = ("training", "plateaus", "stretched", "yielded", "zeta_1 32, two waves", "zeta_1 64 and 128")
MANY_WAVES = 8  # longest wavelengths a side
DRAWN = (0.4, 0.8)  # Hurst exponents


def pooled(rows: np.ndarray) -> list[tuple[float, float, float] | None]:
    """Bias, root mean square and number in wider bins, from those in narrow ones."""
    cells: list[tuple[float, float, float] | None] = []
    for low, high in itertools.pairwise(BINS):
        own = rows[[low <= a and b <= high + 1e-9 for a, b in itertools.pairwise(EDGES)]]
        bias, rms, number = own[np.isfinite(own[:, 0])].T
        total = number.sum()
        cells.append((bias @ number / total, np.sqrt(rms**2 @ number / total), total) if total else None)
    return cells


def accuracy() -> str:
    """Every law on held-out surfaces, and the law on every set."""
    values, facts = shipped_part(GROUP)
    sets, laws = facts["sets"].split("; "), facts["laws"].split("; ")
    shown = [(law, "held out") for law in laws]
    for name in (name for name in SHOWN_SETS if name in sets):
        shown += [(law, name) for law in ("calibrated", "closed form")[: 2 if "zeta_1" in name else 1]]
    number = {law: k for k, law in enumerate(laws)} | {"calibrated": 0}
    lines = []
    for law, name in shown:
        cells = pooled(values["accuracy"][sets.index(name), number[law]])
        lines.append([f"{law}, {name}".replace("waves", "wavelengths a side"), *cells])
    return table(f"law, set | {spans(BINS, HEADER)}", lines, "{} | {:+.2f}, {:.2f} ({:.0f})")


def floor() -> str:
    """Cell-to-cell scatter, stated scatter and share of directions that are blocked, by contact."""
    values, facts = shipped_part(GROUP)
    rows = {"cells of one spectrum differ by": values["noise"]}
    rows |= {
        f"stated scatter, `{name}`": values["stated_scatter"][k] for k, name in enumerate(facts["theories"].split())
    }
    rows["share of directions blocked"] = values["share_blocked"]
    lines = [[name, *(None if np.isnan(v) else v for v in row)] for name, row in rows.items()]
    (one, two), flow = facts["coverage"], shipped_flow().constants
    cells = table(f"A [%] | {spans(EDGES, SPAN)}", lines, "{} | {:.2f}")
    return (
        f"{cells}\n\nHeld-out errors up to 30% contact within one and two of the stated scatter: {one:.0%} and "
        f"{two:.0%}. Constants: Ac = {flow.threshold:g}, m = {flow.obstruction:g}; closed form {flow.prefactor:g} u^3 "
        f"(1 - A/Ac)^{flow.exponent:g}. The table is within {facts['largest_error_simulated']:.2g} of the medium in "
        f"ln R up to zeta_1 = 64, and {facts['largest_error_log_factor']:.2g} beyond."
    )


def of_cells(seen: Sequence[Any]) -> str:
    """Held-out errors, and the spread of cells of one spectrum, with many and with few longest wavelengths a side."""
    isotropic = [one for one in seen if one.isotropic and one.zeta_1 < LARGE]
    contact, constants, lines = shipped().constants, shipped_flow().constants, list[list[Any]]()
    for name, many in (("eight", True), ("four or five", False)):
        own = [one for one in isotropic if (one.waves >= MANY_WAVES) == many]
        flows = [Flow(one, contact) for one in own if one.split != TRAINING]
        laws = {
            "calibrated": [errors(f, f.medium(constants)) for f in flows],
            "medium, simulated area and gap": [errors(f, f.medium(constants, f.one.area, f.one.u)) for f in flows],
        }
        cells = {law: [f"{rms:.2f} ({n:.0f})" for _, rms, n in summary(misses, BINS)] for law, misses in laws.items()}
        cells["cells of one spectrum"] = [f"{value:.2f}" for value in noise_floor(own, BINS)]
        lines += [[f"{law}, {name} wavelengths a side", *row] for law, row in cells.items()]
    return table(f"rms of ln k | {spans(BINS, HEADER)}", lines)


def draw(seen: Sequence[Any]) -> Any:
    """k against contact of simulated surfaces, and the laws."""
    figure, axes_of = panels(1, 2, (10, 4.5), sharey=True)
    area, flow = np.linspace(0.004, 0.405, 200), shipped_flow().constants
    for axes, hurst in zip(axes_of, DRAWN, strict=True):
        for one in seen:
            if one.kind == "self_affine" and one.node[1] == hurst and (one.isotropic or one.zeta_1 >= 64):
                colour, label = ("k", "simulated, zeta_1 < 64") if one.zeta_1 < 64 else ("r", "simulated, zeta_1 >= 64")
                axes.plot(one.area, np.exp(one.log_k), ".", color=colour, ms=4, alpha=0.6, label=label)
        for zeta, style in ((16.0, "-"), (64.0, "--"), (1024.0, ":")):
            answer = contact(Surface(hurst, 1.0, zeta, 1.0, 4.0), area=area, theory="calibrated")
            k = np.where(answer.leakage.blocked, np.nan, answer.leakage.K)
            axes.plot(area, k, f"C0{style}", label=f"calibrated, zeta_1 {zeta:g}")
            if zeta == 16:
                spread = np.exp(answer.leakage.scatter)
                axes.fill_between(area, k / spread, k * spread, color="C0", alpha=0.2, lw=0, label="its scatter")
                u = answer.mean_separation
                closed = flow.closed_form(u, area)
                axes.plot(area, np.where(closed > 0, closed, np.nan), "C1-", lw=1, label="closed form, zeta_1 16")
                axes.plot(area, u**3, "C2-", lw=1, label="u^3, zeta_1 16")
        axes.set(xlabel="real contact area  A/A0", yscale="log", ylim=(1e-7, 20), title=f"H = {hurst:g}")
        axes.grid(alpha=0.3)
    axes_of[0].set_ylabel("flow coefficient over h_rms^3,  k")
    # one entry for all simulations of a colour
    entries = {text: handle for handle, text in zip(*axes_of[0].get_legend_handles_labels(), strict=True)}
    axes_of[0].legend(entries.values(), entries.keys(), fontsize="small")
    return figure


def measure() -> Measured:
    """The measured blocks of the page, and its figure."""
    seen = cases(dataset(EVIDENCE))
    parts = {"accuracy": accuracy(), "cells": of_cells(seen), "floor": floor()}
    return parts, {"docs/figures/leakage.svg": draw(seen)}
