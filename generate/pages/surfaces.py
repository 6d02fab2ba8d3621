"""Figures of what numbers of a surface mean: cut-offs of a profile, and sensitivities."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from generate.page import Measured, panels
from mbma_tables import sensitivity
from mbma_tables.common.arguments import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STEP = 1.0  # um between points of the profile
POINTS = 2048
LONGEST = 500.0  # um
SHORTEST = 16.0
ROUGHNESS = 0.8  # rms height [um]
HURST = 0.8
CLOSER = (700.0, 860.0)  # um, the part that is magnified
# the surface of the table of docs/surfaces.md, and what its answers are called there
FACE = {"Ra": "0.4 um", "Rdq": 0.1, "longest": "0.1 mm", "hurst": 0.8, "h_max": "1.8 um"}
PRESSURE = "10 MPa"
ANSWERS = {"mean_separation": "gap", "area": "area", "stiffness": "stiffness"}


def cutoff() -> Measured:
    """A profile with Ra, Rq and both cut-offs."""
    heights = _heights()
    figure, axes = panels(1, 2, (10, 3.6), width_ratios=(3, 2))
    for ax in axes:
        ax.plot(STEP * np.arange(POINTS), heights, color="0.2", lw=0.8)
        ax.set_xlabel("along the profile [um]")
        ax.grid(alpha=0.3)
    _draw_heights(axes[0], heights)
    _draw_length(axes[0], 100.0, LONGEST, 2.6, "longest")
    inside = slice(int(CLOSER[0] / STEP), int(CLOSER[1] / STEP))
    top = float(heights[inside].max())
    axes[0].axvspan(*CLOSER, color="C0", alpha=0.15, lw=0)
    axes[1].set(xlim=CLOSER, ylim=(float(heights[inside].min()) - 0.1, top + 0.5))
    axes[1].set_title("the shaded part")
    _draw_length(axes[1], CLOSER[0] + 20.0, SHORTEST, top + 0.15, "shortest")
    return {}, {"docs/figures/cutoffs.svg": figure}


def _heights() -> FloatArray:
    """A random profile of rms height `ROUGHNESS`, self-affine between the two cut-offs."""
    wavelength = STEP * POINTS / np.maximum(np.arange(POINTS // 2 + 1), 1)
    is_inside = (wavelength >= SHORTEST) & (wavelength <= LONGEST)
    amplitude = np.where(is_inside, wavelength ** (HURST + 0.5), 0.0)
    noise = np.fft.rfft(np.random.default_rng(5).standard_normal(POINTS))
    heights = np.fft.irfft(noise * amplitude)
    return np.asarray(ROUGHNESS * heights / heights.std())


def _draw_heights(axes: Axes, heights: FloatArray) -> None:
    """Ra and Rq of a profile, as lines above its mean line."""
    axes.axhline(0.0, color="0.5", lw=0.8)
    for name, value, colour in (
        ("Ra", np.abs(heights).mean(), "C1"),
        ("Rq", heights.std(), "C3"),
    ):
        axes.axhline(value, color=colour, lw=1.2, label=f"{name} {value:.2f} um")
    axes.set(xlim=(0.0, STEP * POINTS), ylim=(-2.8, 3.2), ylabel="height [um]")
    axes.legend(fontsize="small", loc="lower right", ncols=2)


def _draw_length(
    axes: Axes, start: float, length: float, height: float, name: str
) -> None:
    """A wavelength as an arrow with its name."""
    arrow = {"arrowstyle": "<->", "color": "C0", "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", (start, height), (start + length, height), arrowprops=arrow)
    axes.text(start + length, height, f"  {name} {length:g} um", va="center", color="C0")


def sensitivities() -> Measured:
    """Bars of the relative change of each answer by each number of a surface."""
    found = sensitivity(FACE, "100 GPa", pressure=PRESSURE, quantities=[*ANSWERS])
    names = list(found.slopes)
    figure, axes = panels(1, len(ANSWERS), (10, 3.2), sharey=True)
    for ax, (answer, title) in zip(axes, ANSWERS.items(), strict=True):
        slopes = np.array([float(found.slopes[name][answer]) for name in names])
        ax.barh(names, slopes, color=np.where(slopes < 0, "C1", "C0"))
        ax.axvline(0.0, color="0.3", lw=0.8)
        ax.set(title=title, xlim=(-1.3, 1.3), xlabel="d ln(answer)/d ln(number)")
        ax.grid(alpha=0.3, axis="x")
    axes[0].invert_yaxis()
    return {}, {"docs/figures/sensitivity.svg": figure}
