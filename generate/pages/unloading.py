"""Measured tables and the figure of docs/yield.md."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from generate.boundary_elements.surfaces import Recipe, heights
from generate.files import read_csv
from generate.page import Cell, Measured, table
from generate.unloading_fit import (
    CLASSES,
    LIGHT,
    NAMES,
    deviations,
    left_out,
    predicted,
    ratios,
    rms,
)
from mbma_tables import Bodies, Joint, Surface, contact
from mbma_tables.common.plots import new_figure
from mbma_tables.theories import Simulated
from mbma_tables.theories.simulated.boundary_elements import (
    BoundaryElementContact as BoundaryElements,
)
from mbma_tables.theories.yielding.unloading import CONTACT, STIFFNESS, ratio_scatter

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MEASURED = ("stiffness", "area", "lift")
FACES = {"Ra 0.4 um": 0.4, "Ra 0.8 um": 0.8, "Ra 1.6 um": 1.6}
METAL = "steel 1020"
LOADS = ("10 MPa", "50 MPa", "100 MPa")
# of a simulated map: points a side, psi, and pressures over the hardness, the largest first
POINTS = 256
PSI = 8
SHARES_OF_HARDNESS = (0.05, 0.04, 0.025, 0.015, 0.005)
FINE_TOLERANCE = 1e-6
SHOWN = (2.5, 8.0)  # psi of the figure's points


def measure() -> Measured:
    rows = ratios(read_csv("unloading.csv.gz"))
    tested = left_out(rows[rows.waves != 2])
    parts = {
        "accuracy": accuracy(tested),
        "random": accuracy(tested[tested.waves > 0]),
        "cells": cells(),
        "other": other(),
        "grids": grids(rows),
        "maps": maps(),
        "settling": settling(),
    }
    return parts, {"docs/figures/unloading.svg": draw(rows)}


def accuracy(tested: pd.DataFrame) -> str:
    """Deviations on groups left out, from a tenth of the largest pressure on."""
    lines: list[list[Cell]] = []
    above = tested[tested.s > LIGHT]
    for label, (low, high) in CLASSES.items():
        own = above[(above.psi > low) & (above.psi < high)]
        line: list[Cell] = [label]
        for name in NAMES:
            missed = own[f"missed_{name}"]
            stated = ratio_scatter(name, own.s.to_numpy(), own.yielded.to_numpy())
            inside = [100 * np.mean(np.abs(missed) <= k * stated) for k in (1, 2)]
            line.append((100 * rms(missed), *inside))
        lines.append(line)
    header = f"surfaces | {' | '.join(NAMES)}"
    return table(header, lines, "{} | {:.1f}%; {:.0f}%, {:.0f}%")


def cells() -> str:
    """The law against maps of one spectrum that no fit saw, against their means, and how the maps differ."""
    rows = ratios(read_csv("unloading_cells.csv.gz"))
    rows = rows[rows.s > LIGHT].assign(at=rows.s.round(2))
    lines: list[list[Cell]] = []
    for (waves, psi), own in rows.groupby(["waves", "psi"]):
        for name, missed in deviations(own, STIFFNESS, CONTACT).items():
            alike = own.assign(missed=missed, value=np.log(own[name]))
            same = alike.groupby(["peak", "at"])
            differs = np.sqrt(same.value.var().mean())
            means = rms(same.missed.mean())
            each: list[Cell] = [name, 100 * rms(missed), 100 * means, 100 * differs]
            lines.append([int(waves), psi, own.group.nunique(), *each])
    header = (
        "longest wavelengths a side | psi | maps | ratio | law against each map [%] | "
        "against their mean [%] | maps among themselves [%]"
    )
    return table(header, lines, "{:g} | {:g} | {:g} | {} | {:.1f}")


def missed_of_others() -> pd.DataFrame:
    """ln(law/simulation) of ratios by another program, by the calibrated law with h_max."""
    data = read_csv("unloading_other.csv")
    face = Surface(hurst=0.8, q0=2 * np.pi / 80, q1=2 * np.pi / 6.4, h_rms=1.0, h_max=3.3)
    gradient = float(face.rms_gradient)
    frames = []
    for (_, psi, _), group in data.groupby(["seed", "psi", "target"]):
        largest = float(group.p0_over_Eg.iloc[0]) * gradient
        bodies = Bodies(hardness=gradient / psi, largest_pressure=largest)
        s = group.p_over_p0.to_numpy()
        pressed = contact(face, bodies, pressure=largest * s, theory="calibrated")
        top = contact(face, bodies, pressure=largest, theory="calibrated")
        K0 = top.unloading_stiffness
        lifted = (pressed.mean_separation - top.mean_separation) * K0 / largest
        own = group.assign(
            stiffness=np.log(
                pressed.unloading_stiffness / K0 / group.stiffness_over_peak
            ),
            area=np.log(pressed.area / top.area / group.area_over_peak),
        )
        inside = (s > LIGHT) & (s < 1)
        below = own[inside].copy()
        below["lift"] = np.log(np.asarray(lifted)[inside] / below.lift_times_k0_over_p0)
        frames.append(below)
    return pd.concat(frames)


def other() -> str:
    """Root mean squares of these, by psi."""
    missed = missed_of_others()
    lines = [
        [psi, *(100 * rms(own[name]) for name in MEASURED)]
        for psi, own in missed.groupby("psi")
    ]
    return table("psi | stiffness [%] | area [%] | lift [%]", lines, "{:g} | {:.1f}")


def grids(rows: pd.DataFrame) -> str:
    """Root mean squares of ln of ratios on a grid over those on one twice as fine."""
    lines: list[list[Cell]] = []
    for _, own in rows[(rows.waves > 0) & (rows.s > LIGHT)].groupby(["seed", "psi"]):
        counts = sorted(own.points.unique())
        if len(counts) < 2:
            continue
        sides = [own[own.points == count].assign(s=own.s.round(2)) for count in counts]
        both = [side.groupby(["s", "peak"])[list(MEASURED)].mean() for side in sides]
        ratio = np.log(both[0] / both[1]).dropna()
        first = own.iloc[0]
        lines.append(
            [first.waves, first.psi, *(100 * rms(ratio[name]) for name in MEASURED)]
        )
    header = "longest wavelengths a side | psi | stiffness [%] | area [%] | lift [%]"
    return table(header, sorted(lines), "{:g} | {:g} | {:.1f}")


def maps() -> str:
    """A simulated map after a largest pressure over boundary elements of it at twice the points."""
    recipe = Recipe("self_affine", 0.8, 8.0, 4, 77, POINTS)
    surface = Surface.from_map(heights(recipe), 1.0, periodic=True)
    hardness = float(surface.rms_gradient) / PSI
    fine = heights(dataclasses.replace(recipe, points=2 * POINTS))
    engine = BoundaryElements(fine, (POINTS, POINTS), FINE_TOLERANCE, hardness)
    pressures = hardness * np.array(SHARES_OF_HARDNESS)
    bodies = Bodies(hardness=hardness, largest_pressure=pressures[0])
    theory = Simulated(grid="full")
    pressed: Any = contact(surface, bodies, pressure=pressures, theory=theory)
    start = engine.press(pressures[0])["mean_separation"]
    after = engine.unloading()
    lines: list[list[Cell]] = []
    lifted = pressed.mean_separation - pressed.mean_separation[0]
    for k, pressure in enumerate(pressures):
        found = after.press(float(pressure))
        lift = found["mean_separation"] - start
        lines.append(
            [
                float(pressure / pressures[0]),
                pressed.stiffness[k] / after.frozen_stiffness(),
                lifted[k] / lift if k else None,
                pressed.area[k] / found["area"],
            ]
        )
    return table("s | stiffness | lift | area", lines, "{:.2g} | {:.3f}")


def joint(Ra: float) -> Joint:
    face = {"Ra": f"{Ra} um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
    area = "4 cm^2"
    return Joint(face, face, bodies=METAL, nominal_area=area, theory="calibrated")


def settling() -> str:
    """Settling of ground steel joints, both faces alike."""
    lines: list[list[Cell]] = []
    for label, Ra in FACES.items():
        lines.append([label, *map(float, joint(Ra).settling(list(LOADS), "0.5 MPa"))])
    header = " | ".join(["both faces", *LOADS])
    return table(header, lines, "{} | {:.2f}")


def draw(rows: pd.DataFrame) -> Figure:
    """A loop of pressure over gap, stiffness below the largest pressure, and a residual shape."""
    figure = new_figure(13, 4.2)
    loop, ratio, shape = figure.subplots(1, 3)
    steel = joint(0.8)
    # denser at light loads, where gaps grow fastest
    share = np.linspace(0.0, 1.0, 120) ** 4
    pressures = 0.5 + 59.5 * share
    first = steel.at_pressure([f"{p} MPa" for p in pressures])
    later = steel.after("50 MPa").at_pressure([f"{p} MPa" for p in 50 * share])
    loop.plot(first.mean_separation, pressures, label="first loading")
    loop.plot(later.mean_separation, 1e3 * later.pressure, label="after 50 MPa")
    loop.set_xlabel("mean gap u [um]")
    loop.set_ylabel("pressure [MPa]")
    loop.legend()
    for color, psi in zip(("C0", "C1"), SHOWN, strict=True):
        own = rows[np.isclose(rows.psi, psi) & (rows.waves > 2)]
        law = own.assign(law=predicted(own, STIFFNESS, CONTACT)["stiffness"])
        mean = law.groupby(law.s.round(2)).law.mean()
        label = f"simulated, psi {psi:g}"
        ratio.plot(own.s, own.stiffness, ".", ms=3, color=color, label=label)
        ratio.plot(mean.index, mean, color=color, label=f"law, psi {psi:g}")
    s = np.linspace(0.005, 1, 100)
    ratio.plot(s, s**0.5, "k:", label="s^(1/2)")
    ratio.plot(s, s, "k--", lw=0.8, label="s")
    ratio.set_xlabel("s = p/p0")
    ratio.set_ylabel("K/K0")
    ratio.legend()
    draw_residual(shape)
    return figure


def draw_residual(axes: Axes) -> None:
    """Highest profile of a map before a load and after it."""
    before = heights(Recipe("self_affine", 0.8, 8.0, 4, 77, POINTS // 2))
    before = before / np.std(before)
    side = float(len(before))
    gradient = float(Surface.from_map(before, 1.0, periodic=True).rms_gradient)
    engine = BoundaryElements(before, (side, side), FINE_TOLERANCE, gradient / PSI)
    engine.press(2 * SHARES_OF_HARDNESS[0] * gradient / PSI)
    row = int(np.argmax(before.max(axis=1)))
    axes.plot(before[row], lw=0.8, label="before")
    axes.plot(
        engine.residual_heights()[row],
        label=f"after {2 * SHARES_OF_HARDNESS[0]:g} of the hardness",
    )
    axes.set_xlabel("place [points]")
    axes.set_ylabel("height [h_rms]")
    axes.legend()
