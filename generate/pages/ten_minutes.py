"""The sketch of docs/ten_minutes.md: what d, u, h_max and islands are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from generate.pages.page import pyplot, svg
from mbma_tables.arguments import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK, BODY, PLANE = "#1f3b57", "#b8c7d6", "#c0392b"


def sketch() -> bytes:
    """A rough profile under a rigid plane: undeformed, with d, h_max and islands, and pressed flat, with u."""
    figure, (left, right) = pyplot().subplots(1, 2, figsize=(10.5, 3.0), layout="constrained", sharey=True)
    x, z = _profile()
    highest, d = float(z.max()), 0.35 * float(z.max())
    for axes in (left, right):
        axes.set_axis_off()
        axes.set_xlim(-0.16, 1.25)
    left.set_title("as it would be if nothing gave way", fontsize=10)
    _body(left, x, z)
    left.fill_between(x, d, z, where=(z > d).tolist(), color=PLANE, alpha=0.35, lw=0)
    _level(left, d, "rigid plane", PLANE, "-")
    _level(left, 0.0, "mid-plane", INK, "--")
    _level(left, highest, "first contact", INK, ":")
    _arrow(left, -0.055, 0, d, "d")
    _arrow(left, -0.125, 0, highest, "h_max")
    _arrow(left, float(x[z.argmax()]), d, highest, "delta")
    left.text(0.65, highest * 0.65, "contact\nislands", fontsize=9, color=PLANE, ha="center", va="center")
    right.set_title("as it is: tops flattened, the rest pushed down", fontsize=10)
    # drawn, not solved
    pressed = np.minimum(z, d)
    _body(right, x, pressed)
    _level(right, d, "rigid plane", PLANE, "-")
    _level(right, float(pressed.mean()), "mean plane", INK, "--")
    _arrow(right, -0.055, float(pressed.mean()), d, "u")
    return svg(figure)


def _profile() -> tuple[FloatArray, FloatArray]:
    """One line of a rough surface."""
    rng = np.random.default_rng(11)
    x = np.linspace(0, 1, 500)
    waves = np.arange(2, 60)
    phases = rng.uniform(0, 2 * np.pi, waves.size)
    z = np.sum(waves[:, None] ** -1.2 * np.cos(2 * np.pi * waves[:, None] * x + phases[:, None]), axis=0)
    return x, (z - z.mean()) / z.std()


def _body(axes: Axes, x: FloatArray, z: FloatArray) -> None:
    axes.fill_between(x, z, -3.4, color=BODY, lw=0)
    axes.plot(x, z, color=INK, lw=1)


def _level(axes: Axes, z: float, text: str, colour: str, style: str) -> None:
    axes.plot([-0.13, 1], [z, z], color=colour, ls=style, lw=1.2)
    axes.text(1.01, z, text, color=colour, fontsize=8, va="center")


def _arrow(axes: Axes, x: float, low: float, high: float, text: str) -> None:
    axes.annotate("", (x, high), (x, low), arrowprops={"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0})
    box = {"facecolor": "white", "edgecolor": "none", "pad": 1}
    axes.text(x + 0.015, (low + high) / 2, text, fontsize=9, va="center", bbox=box)


def measure() -> tuple[dict[str, str], dict[str, bytes]]:
    """One figure; the page has no measured parts."""
    return {}, {"docs/figures/sketch.svg": sketch()}
