"""The measured parts of docs/leakage.md: how far laws of leakage are from simulation, and their curves."""

from __future__ import annotations

import itertools

import numpy as np
import xarray as xr

from generate.boundary_elements.design import TRAINING
from generate.leakage_flow import Flow, cases
from generate.leakage_law import EDGES, EVIDENCE, LARGE, errors, noise_floor, summary
from generate.pages.page import pyplot, svg, table
from mbma_tables import Surface, contact
from mbma_tables.theories.calibrated_table import shipped, shipped_part
from mbma_tables.theories.leakage_table import GROUP, shipped_flow

BINS = ((0.004, 0.05), (0.05, 0.15), (0.15, 0.3), (0.3, 0.4))
SHOWN_SETS = (
    "training", "held out", "plateaus", "stretched", "yielded", "zeta_1 32, two waves", "zeta_1 64 and 128"
)  # fmt: skip
MANY_WAVES = 8  # longest waves a side
DRAWN = (0.4, 0.8)  # Hurst exponents


def pooled(rows: np.ndarray, bins: tuple[tuple[float, float], ...] = BINS) -> list[str]:
    """Bias and root mean square in wider bins, from bias, root mean square and number in narrow ones."""
    told = []
    for low, high in bins:
        own = rows[[low <= a and b <= high + 1e-9 for a, b in itertools.pairwise(EDGES)]]
        own = own[np.isfinite(own[:, 0])]
        number = own[:, 2].sum()
        if not number:
            told.append("")
            continue
        bias, square = own[:, 0] @ own[:, 2] / number, own[:, 1] ** 2 @ own[:, 2] / number
        told.append(f"{bias:+.2f}, {np.sqrt(square):.2f} ({number:.0f})")
    return told


def accuracy() -> str:
    """Every law on held-out surfaces, and the law on every set."""
    values, facts = shipped_part(GROUP)
    sets, laws = facts["sets"].split("; "), facts["laws"].split("; ")
    errors = values["accuracy"]
    header = ["law, set", *(f"A {100 * a:.3g}-{100 * b:.3g}%" for a, b in BINS)]
    held = sets.index("held out")
    lines = [[f"{law}, held out", *pooled(errors[held, k])] for k, law in enumerate(laws)]
    for name in SHOWN_SETS:
        if name in sets and name != "held out":
            lines.append([f"calibrated, {name}", *pooled(errors[sets.index(name), 0])])
            if "zeta_1" in name:
                lines.append([f"closed form, {name}", *pooled(errors[sets.index(name), laws.index("closed form")])])
    return table(header, lines)


def floor() -> str:
    """Cell-to-cell scatter, stated scatter and share of directions that are blocked, by contact."""
    values, facts = shipped_part(GROUP)
    rows = {
        "cells of one spectrum differ by": values["noise"],
        **{
            f"stated scatter, `{name}`": values["stated_scatter"][k] for k, name in enumerate(facts["theories"].split())
        },
        "share of directions blocked": values["share_blocked"],
    }
    header = ["A [%]", *(f"{100 * a:.3g}-{100 * b:.3g}" for a, b in itertools.pairwise(EDGES))]
    lines = [[name, *("" if np.isnan(v) else f"{v:.2f}" for v in row)] for name, row in rows.items()]
    one, two = facts["coverage"]
    flow = shipped_flow().constants
    return (
        f"{table(header, lines)}\n\nHeld-out errors up to 30% contact within one and two of the stated scatter: "
        f"{one:.0%} and {two:.0%}. Constants: Ac = {flow.threshold:g}, m = {flow.obstruction:g}; closed form "
        f"{flow.prefactor:g} u^3 (1 - A/Ac)^{flow.exponent:g}. The table is within "
        f"{facts['largest_error_simulated']:.2g} of the medium in ln R up to zeta_1 = 64, and "
        f"{facts['largest_error_log_factor']:.2g} beyond."
    )


def of_cells() -> str:
    """Held-out errors, and what cells of one spectrum differ by, with many and with few longest waves a side."""
    with xr.open_dataset(EVIDENCE) as data:
        found = [one for one in cases(data.load()) if one.isotropic and one.zeta_1 < LARGE]
    contact, constants = shipped().constants, shipped_flow().constants
    lines = []
    for name, many in (("eight", True), ("four or five", False)):
        own = [one for one in found if (one.waves >= MANY_WAVES) == many]
        edges = [low for low, _ in BINS] + [BINS[-1][1]]
        spread = noise_floor(own, edges)
        flows = [Flow(one, contact) for one in own if one.split != TRAINING]
        laws = {
            "calibrated": [errors(f, f.medium(constants)) for f in flows],
            "medium, simulated area and gap": [errors(f, f.medium(constants, f.one.area, f.one.u)) for f in flows],
        }
        for law, misses in laws.items():
            rows = summary(misses, edges)
            lines.append([f"{law}, {name} waves", *(f"{rms:.2f} ({n:.0f})" for _, rms, n in rows)])
        lines.append([f"cells of one spectrum, {name} waves", *(f"{value:.2f}" for value in spread)])
    return table(["rms of ln k", *(f"A {100 * a:.3g}-{100 * b:.3g}%" for a, b in BINS)], lines)


def draw() -> bytes:
    """k against contact of simulated surfaces, and the laws."""
    plt = pyplot()
    with xr.open_dataset(EVIDENCE) as data:
        found = cases(data.load())
    figure, panels = plt.subplots(1, 2, figsize=(10, 4.5), layout="constrained", sharey=True)
    area = np.linspace(0.004, 0.405, 200)
    flow = shipped_flow().constants
    for axes, hurst in zip(panels, DRAWN, strict=True):
        for one in found:
            if one.kind == "self_affine" and one.node[1] == hurst and (one.isotropic or one.zeta_1 >= 64):
                colour, label = ("k", "simulated, zeta_1 < 64") if one.zeta_1 < 64 else ("r", "simulated, zeta_1 >= 64")
                axes.plot(one.area, np.exp(one.log_k), ".", color=colour, ms=4, alpha=0.6, label=label)
        for zeta, style in ((16.0, "-"), (64.0, "--"), (1024.0, ":")):
            answer = contact(Surface(hurst, 1.0, zeta, 1.0, 4.0), area=area, theory="calibrated")
            k = np.where(answer.leakage.blocked, np.nan, answer.leakage.k)
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
    panels[0].set_ylabel("flow conductance over h_rms^3,  k")
    # one entry for all simulations of a colour
    entries = {text: handle for handle, text in zip(*panels[0].get_legend_handles_labels(), strict=True)}
    panels[0].legend(entries.values(), entries.keys(), fontsize="small")
    return svg(figure)


def measure() -> tuple[dict[str, str], dict[str, bytes]]:
    """The measured parts of the page, and its figure."""
    return {"accuracy": accuracy(), "cells": of_cells(), "floor": floor()}, {"docs/figures/leakage.svg": draw()}
