"""A table's bounds on its error over its grid, drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.plots import new_figure
from mbma_tables.tables.function_table import FunctionTable
from mbma_tables.tables.schema import CELL_EDGES, FUNCTIONS, UNIVERSAL, TableContent

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RELATIVE = "bound on the relative error"
ABSOLUTE = "bound on the absolute error"
PANEL_WIDTH, HEIGHT, BAR_WIDTH = 3.9, 3.6, 1.2  # inches
# an axis from zero is drawn from this share of its least other edge on a logarithmic scale
FROM_ZERO = 0.25
DECADE = 10.0  # least ratio of the ends of a scale of colours


class PictureAxis(NamedTuple):
    """An axis of the drawing: what is written on it, its scale, and the ends of the cells."""

    label: str
    is_log: bool
    low: FloatArray
    high: FloatArray


class Cells(NamedTuple):
    """Cells of a table over its first axes, and the bounds on the error in each."""

    sides: list[PictureAxis]  # one or two
    titles: list[str]  # of each result
    labels: list[str]  # what its bound is
    bounds: FloatArray  # (results, cells)


def _of_islands() -> tuple[list[str], list[str]]:
    """Titles and labels of force and area."""
    titles = [f"$\\Phi_{function}$" for function in FUNCTIONS]
    return titles, [RELATIVE] * len(FUNCTIONS)


def _universal_cells(content: TableContent) -> Cells:
    X_low, X_high, mu_low, mu_high = (content.auxiliary[name][1] for name in CELL_EDGES)
    # cells from mu = 0 end at the bottom of the logarithmic scale
    bottom = FROM_ZERO * mu_high.min()
    sides = [
        PictureAxis("X", False, X_low, X_high),
        PictureAxis(r"$\mu$", True, np.maximum(mu_low, bottom), mu_high),
    ]
    return Cells(sides, *_of_islands(), content.local_error.T)


def _island4d_cells(content: TableContent) -> Cells:
    """Cells of X and the spread, with the largest bound over the other axes."""
    first, second = (axis.values for axis in content.axes[:2])
    low = np.meshgrid(first[:-1], second[:-1], indexing="ij")
    high = np.meshgrid(first[1:], second[1:], indexing="ij")
    sides = []
    for number, axis in enumerate(content.axes[:2]):
        sides.append(
            PictureAxis(
                axis.name,
                axis.transform == "log" and axis.offset == 0,
                low[number].ravel(),
                high[number].ravel(),
            )
        )
    largest = content.local_error.max(axis=(2, 3))
    return Cells(sides, *_of_islands(), largest.reshape(-1, len(FUNCTIONS)).T)


def _in(unit: str) -> str:
    """A unit as labels have it."""
    return "" if unit == "1" else f" [{unit}]"


def _function_cells(table: FunctionTable) -> Cells:
    """Cells of the first two axes, those of others behind one another."""
    low, high, errors = table.cells()
    sides = []
    for number, axis in enumerate(table.axes[:2]):
        sides.append(
            PictureAxis(
                axis.name + _in(axis.unit),
                axis.transform == "log" and axis.offset == 0,
                axis.from_grid(low[:, number]),
                axis.from_grid(high[:, number]),
            )
        )
    labels = []
    for number, output in enumerate(table.outputs):
        if output.transform == "log":
            # the file bounds the error of the logarithm
            errors[:, number] = np.expm1(errors[:, number])
        is_absolute = output.transform != "log" and output.error == "absolute"
        labels.append(ABSOLUTE + _in(output.unit) if is_absolute else RELATIVE)
    titles = [output.name for output in table.outputs]
    return Cells(sides, titles, labels, errors.T)


def cells_of(table: TableContent | FunctionTable) -> Cells:
    """The cells that a table is drawn by."""
    if isinstance(table, FunctionTable):
        return _function_cells(table)
    if table.kind == UNIVERSAL:
        return _universal_cells(table)
    return _island4d_cells(table)


def draw_errors(table: TableContent | FunctionTable) -> Figure:
    r"""The bound on the error of each result of a table, over the cells of its grid.

    Parameters
    ----------
    table : TableContent or FunctionTable
        A table of islands, such as ``open_table("universal").content``, or of a function.

    Returns
    -------
    Figure
        A panel for each result, with one scale of colours. Cells are drawn over the first
        two axes, and the largest bound over further axes is in front; of one axis the bound
        is a line of steps.

    Raises
    ------
    MbmaError
        If matplotlib is missing; it is in the extra ``plot``.

    Examples
    --------
    >>> from mbma_tables import open_table
    >>> figure = draw_errors(open_table("universal").content)
    >>> [axes.get_title() for axes in figure.axes[:2]]
    ['$\\Phi_F$', '$\\Phi_A$']
    """
    cells = cells_of(table)
    count = len(cells.titles)
    bars = 1 if len(set(cells.labels)) == 1 else count
    figure = new_figure(PANEL_WIDTH * count + BAR_WIDTH * bars, HEIGHT)
    panels = list(figure.subplots(1, count, squeeze=False)[0])
    for axes, title in zip(panels, cells.titles, strict=True):
        axes.set(title=title, xlabel=cells.sides[0].label)
        axes.set_xscale("log" if cells.sides[0].is_log else "linear")
    if len(cells.sides) == 1:
        _draw_steps(panels, cells)
    else:
        _draw_rectangles(figure, panels, cells)
    return figure


def _draw_steps(panels: list[Axes], cells: Cells) -> None:
    (side,) = cells.sides
    order = np.argsort(side.low)
    edges = np.append(side.low[order], side.high.max())
    for axes, label, bounds in zip(panels, cells.labels, cells.bounds, strict=True):
        axes.stairs(bounds[order], edges, baseline=None)
        axes.set(ylabel=label, yscale="log")


def _draw_rectangles(figure: Figure, panels: list[Axes], cells: Cells) -> None:
    from matplotlib.collections import PolyCollection

    first, second = cells.sides
    corners = [
        np.stack([first.low, second.low], axis=-1),
        np.stack([first.high, second.low], axis=-1),
        np.stack([first.high, second.high], axis=-1),
        np.stack([first.low, second.high], axis=-1),
    ]
    rectangles = np.stack(corners, axis=1)
    one_scale = len(set(cells.labels)) == 1
    for number, axes in enumerate(panels):
        bounds = cells.bounds[number]
        norm = _scale(cells.bounds if one_scale else bounds)
        # the largest last, so that of cells behind one another it is what is seen
        order = np.argsort(bounds)
        drawn = PolyCollection(
            list(rectangles[order]),
            # a bound of zero is below the scale
            array=np.maximum(bounds[order], norm.vmin),
            norm=norm,
            linewidths=0,
            # smoothed edges of neighbours would leave a light line between them
            antialiaseds=False,
            rasterized=True,
        )
        axes.add_collection(drawn)
        axes.set_yscale("log" if second.is_log else "linear")
        axes.set(
            xlim=(first.low.min(), first.high.max()),
            ylim=(second.low.min(), second.high.max()),
            ylabel=second.label,
        )
        if one_scale:
            axes.label_outer()
        else:
            figure.colorbar(drawn, ax=axes, label=cells.labels[number])
    if one_scale:
        figure.colorbar(drawn, ax=panels, label=cells.labels[0])


def _scale(bounds: FloatArray) -> Any:
    """A logarithmic scale of colours from the least to the largest bound, a decade at least."""
    from matplotlib.colors import LogNorm

    highest = max(float(bounds.max()), np.finfo(float).tiny * DECADE)
    positive = bounds[bounds > 0]
    lowest = float(positive.min()) if positive.size else highest
    return LogNorm(min(lowest, highest / DECADE), highest)
