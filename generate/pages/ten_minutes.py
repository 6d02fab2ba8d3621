"""docs/ten_minutes.md: a sketch of d, u, h_max and contact islands."""

from __future__ import annotations

from typing import Any

import numpy as np

from generate.pages.page import Measured, panels

INK, BODY, PLANE = "#1f3b57", "#b8c7d6", "#c0392b"


def measure() -> Measured:
    """A rough profile under a rigid plane: undeformed, with d, h_max and islands, and pressed flat, with u."""
    x, waves, rng = np.linspace(0, 1, 500), np.arange(2, 60)[:, None], np.random.default_rng(11)
    phases = rng.uniform(0, 2 * np.pi, waves.size)[:, None]
    z = np.sum(waves**-1.2 * np.cos(2 * np.pi * waves * x + phases), axis=0)
    z = (z - z.mean()) / z.std()
    highest, d = float(z.max()), 0.35 * float(z.max())
    pressed = np.minimum(z, d)  # drawn, not solved
    figure, (left, right) = panels(1, 2, (10.5, 3.0), sharey=True)

    def level(axes: Any, height: float, text: str, colour: str, style: str) -> None:
        axes.plot([-0.13, 1], [height, height], color=colour, ls=style, lw=1.2)
        axes.text(1.01, height, text, color=colour, fontsize=8, va="center")

    def arrow(axes: Any, place: float, low: float, high: float, text: str) -> None:
        axes.annotate("", (place, high), (place, low), arrowprops={"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0})
        box = {"facecolor": "white", "edgecolor": "none", "pad": 1}
        axes.text(place + 0.015, (low + high) / 2, text, fontsize=9, va="center", bbox=box)

    titles = "undeformed profile", "deformed: summits flattened, the rest pushed down"
    for axes, line, title in ((left, z, titles[0]), (right, pressed, titles[1])):
        axes.set_axis_off()
        axes.set_xlim(-0.16, 1.25)
        axes.set_title(title, fontsize=10)
        axes.fill_between(x, line, -3.4, color=BODY, lw=0)
        axes.plot(x, line, color=INK, lw=1)
        level(axes, d, "rigid plane", PLANE, "-")
    left.fill_between(x, d, z, where=(z > d).tolist(), color=PLANE, alpha=0.35, lw=0)
    level(left, 0.0, "mid-plane", INK, "--")
    level(left, highest, "first contact", INK, ":")
    arrow(left, -0.055, 0, d, "d")
    arrow(left, -0.125, 0, highest, "h_max")
    arrow(left, float(x[z.argmax()]), d, highest, "delta")
    left.text(0.65, highest * 0.65, "contact\nislands", fontsize=9, color=PLANE, ha="center", va="center")
    mean = float(pressed.mean())
    level(right, mean, "mean plane", INK, "--")
    arrow(right, -0.055, mean, d, "u")
    return {}, {"docs/figures/sketch.svg": figure}
