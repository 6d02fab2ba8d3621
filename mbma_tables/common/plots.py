"""Pictures of compression: pressure and contact area, with the scatter of theories.

Figures are drawn without pyplot, so nothing of the caller's matplotlib state is read or changed.
"""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from mbma_tables.common.arguments import FloatArray, needed
from mbma_tables.common.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

KINDS = ("png", "svg", "pdf")  # formats of files of pictures
FEW_DECADES = 300.0  # largest over smallest number of an axis that shows 1, 2, 5, 10 ...
GAP_LABEL = "mean separation  u/h_rms"
PRESSURE_LABEL = "pressure  F/(A0 E*)"
LEAKAGE_LABEL = "flow coefficient  k h_rms^3"
LABELS = {"mbma": "MBMA", "greenwood_williamson": "Greenwood-Williamson"}


def theory_label(name: str) -> str:
    """A theory's name in a legend."""
    return LABELS.get(name, name.replace("_", " ").capitalize())


def pressure_label(unit: str) -> str:
    """The axis of pressure in a unit; "1" where it is over the modulus."""
    return PRESSURE_LABEL if unit == "1" else f"pressure  F/A0 [{unit}]"


def leakage_label(unit: str) -> str:
    """The axis of flow coefficient in a unit; "1" where that is not known."""
    return LEAKAGE_LABEL if unit == "1" else f"{LEAKAGE_LABEL} [{unit}]"


class Line(NamedTuple):
    """A line of a panel, with its band."""

    name: str
    values: FloatArray
    scatter: FloatArray | None = None  # standard deviation of ln of the values
    #: in place of it the lower and the upper end of the band
    ends: tuple[FloatArray, FloatArray] | None = None


# one surface's contact, in lines of one length by what is along their axis: the "gap"
# u/h_rms (50), the "pressure" F/A0, or F/(A0 E*), with its scatter at the gap, the "area"
# A/A0 with that at the pressure, and perhaps "leakage", the flow coefficient of the gaps,
# zero where blocked; scatter is NaN where not known
CompressionLines = Mapping[str, Line]


def new_figure(width: float, height: float) -> Figure:
    """A figure [inches] that is independent of pyplot and that notebooks show."""
    figure: Any = needed("matplotlib.figure").Figure(
        figsize=(width, height), layout="constrained"
    )
    figure._repr_png_ = lambda: to_picture(figure, dpi=72)
    made: Figure = figure
    return made


def draw_line(x: Any, y: Any, x_label: str, y_label: str) -> Figure:
    """One line on logarithmic axes."""
    figure = new_figure(5.5, 4)
    axes = figure.subplots()
    axes.loglog(x, y)
    axes.set(xlabel=x_label, ylabel=y_label)
    axes.grid(True, which="major", alpha=0.3)
    return figure


def draw_panels(
    x: FloatArray,
    panels: Mapping[str, Sequence[Line]],
    x_label: str,
    title: str = "bands: one standard deviation of the model",
) -> Figure:
    """Panels by their ordinate's label, under a title on their bands."""
    figure = new_figure(5 * (len(panels) + 1) // 2, 8)
    for axes, (label, lines) in zip(
        figure.subplots(2, -(-len(panels) // 2)).flat, panels.items(), strict=False
    ):
        for name, y, scatter, ends in lines:
            axes.loglog(x, y, label=name)
            _band(axes, x, y, scatter)
            if ends is not None:
                colour = axes.lines[-1].get_color()
                axes.fill_between(x, *ends, alpha=0.25, color=colour, lw=0)
        axes.set(xlabel=x_label, ylabel=label)
        axes.grid(True, which="major", alpha=0.3)
        number_ticks(axes)
        if len(lines) > 1:
            axes.legend()
    if any(axes.collections for axes in figure.axes):
        figure.suptitle(title, fontsize="medium")
    return figure


def number_ticks(axes: Axes) -> None:
    """Plain numbers on logarithmic axes of few decades, where powers of ten are too sparse."""
    ticker = needed("matplotlib.ticker")
    for axis, (low, high) in (
        (axes.xaxis, axes.get_xlim()),
        (axes.yaxis, axes.get_ylim()),
    ):
        if high / low < FEW_DECADES:
            axis.set_major_locator(ticker.LogLocator(subs=(1, 2, 5)))
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter(ticker.NullFormatter())


def draw_compression(
    curves: Sequence[CompressionLines],
    title: str = "",
    pressure_label: str = PRESSURE_LABEL,
    gap_label: str = GAP_LABEL,
    leakage_label: str = LEAKAGE_LABEL,
    more: Mapping[str, Sequence[Line]] = MappingProxyType({}),
) -> Figure:
    """Two panels: pressure against u/h_rms, and area against pressure (logarithmic).

    A third one, flow coefficient against pressure, where a curve has leakage, and one for
    each label of `more`, with lines over the first curve's pressure. Points without
    contact, and blocked flow, have no place on a logarithmic axis and are left out.
    """
    if not curves:
        raise InputError("no curves to draw: at least one is needed")
    panels = [
        ("gap", "pressure", gap_label, pressure_label),
        ("pressure", "area", pressure_label, "real contact area  A/A0"),
        ("pressure", "leakage", pressure_label, leakage_label),
    ][: 2 + any("leakage" in curve for curve in curves)]
    figure = new_figure(5 * (len(panels) + len(more)), 4.5)
    standard_axes, others = np.split(
        figure.subplots(1, len(panels) + len(more)), [len(panels)]
    )
    for axes, (x_name, y_name, x_label, y_label) in zip(
        standard_axes, panels, strict=True
    ):
        for curve in curves:
            touches = (curve["pressure"].values > 0) & (curve["area"].values > 0)
            if not touches.any():
                raise InputError(
                    f"{curve['pressure'].name!r} has no contact to draw on logarithmic axes"
                )
            line = curve.get(y_name)
            if line is not None:
                x = curve[x_name].values
                y = np.where(touches & (line.values > 0), line.values, np.nan)
                marker = "." if curve is curves[0] else ""
                axes.plot(x, y, marker=marker, label=line.name)
                _band(axes, x, y, line.scatter)
        axes.set(
            xlabel=x_label,
            ylabel=y_label,
            xscale="linear" if x_name == "gap" else "log",
            yscale="log",
        )
    for axes, (label, lines) in zip(others, more.items(), strict=True):
        pressure = curves[0]["pressure"].values
        for line in lines:
            axes.loglog(pressure, line.values, marker=".", label=line.name)
            _band(axes, pressure, line.values, line.scatter)
        axes.set(xlabel=pressure_label, ylabel=label)
    for axes in figure.axes:
        axes.grid(True, which="major", alpha=0.3)
    for axes in (figure.axes[0], *others):
        axes.legend()
    figure.suptitle(title)
    return figure


def _band(axes: Axes, x: FloatArray, y: FloatArray, scatter: FloatArray | None) -> None:
    """One standard deviation of ln y about a line, in its colour, where it is known."""
    if scatter is None or not np.isfinite(scatter).any():
        return
    has_scatter = np.isfinite(scatter) & (y > 0)
    factor = np.exp(np.where(has_scatter, scatter, 0.0))
    colour = axes.lines[-1].get_color()
    axes.fill_between(
        x,
        y / factor,
        y * factor,
        where=has_scatter.tolist(),
        alpha=0.25,
        color=colour,
        lw=0,
    )


def to_picture(
    figure: Figure, kind: str = "png", dpi: float = 120, outlines: bool = False
) -> bytes:
    """The figure as the content of a file of a `kind` of `KINDS`, always the same bytes.

    Text stays text in SVG; with `outlines` its letters are drawn as paths, which need no
    font, and coordinates have two decimals, so that rounding differences between machines
    do not change the file.
    """
    import matplotlib as mpl

    content = io.BytesIO()
    # files contain no time stamps and no random numbers
    stable: Any = {
        "svg.fonttype": "path" if outlines else "none",
        "svg.hashsalt": "mbma_tables",
    }
    undated: dict[str, Any] = {
        "svg": {"Date": None, "Creator": None},
        "pdf": {"CreationDate": None},
    }
    with mpl.rc_context(stable):
        figure.savefig(content, format=kind, dpi=dpi, metadata=undated.get(kind))
    drawn = content.getvalue()
    return (
        re.sub(rb'(\.\d\d)\d+(?=[ \n"])', rb"\1", drawn)
        if kind == "svg" and outlines
        else drawn
    )
