"""`docs/architecture.md`: the rooms of the library as a picture, drawn from their imports."""

from __future__ import annotations

import ast
import collections

from benchmarks.import_circles import import_graph
from generate.files import ROOT
from generate.pages.page import Measured, panels

BOX = {"boxstyle": "square,pad=0.4", "facecolor": "#e8eef7", "edgecolor": "#4a6fa5"}
RIGHT = 0.83  # edge of the boxes
SHARED = ("common", "core")  # every room uses them: no arrows


def rooms() -> tuple[dict[str, set[str]], dict[str, str]]:
    """What each folder, or module at the top, imports of the others, and what is written in its box."""
    graph: dict[str, set[str]] = collections.defaultdict(set)
    lines: collections.Counter[str] = collections.Counter()
    titles = {}
    imports, files = import_graph(ROOT / "mbma_tables")
    for name, others in imports.items():
        room = name.split(".")[1]
        text = files[name].read_text(encoding="utf-8")
        lines[room] += len(text.splitlines())
        graph[room] |= {other.split(".")[1] for other in others} - {room}
        if name.count(".") == 1:
            titles[room] = (ast.get_docstring(ast.parse(text)) or "").split("\n")[0].rstrip(".").replace("`", "")
    del graph["__main__"]
    lines["core"] += sum(len(path.read_text().splitlines()) for path in (ROOT / "mbma_tables/core").glob("*.[ch]"))
    return graph, {room: f"{room:<11}{titles[room]:<72}{lines[room]:>6,}" for room in graph}


def measure() -> Measured:
    """The picture: arrows to the rooms that are imported, less those that follow from others."""
    graph, texts = rooms()
    below = {room: set(others) for room, others in graph.items()}
    for middle in graph:
        for room in graph:
            if middle in below[room]:
                below[room] |= below[middle]
    order = sorted(graph, key=lambda room: (len(below[room]), room))
    figure, axes = panels(1, 1, (7.4, 7.2))
    axes.set_position((0, 0, 1, 1))
    axes.set(xlim=(0, 1), ylim=(-0.6, len(order) - 0.4))
    axes.axis("off")
    for y, room in enumerate(order):
        axes.text(0.01, y, texts[room], va="center", family="monospace", fontsize=8, bbox=BOX)
    for y, room in enumerate(order):
        direct = graph[room] - set().union(*(below[other] for other in graph[room])) - set(SHARED)
        for other in sorted(direct):
            down = order.index(other)
            style = {"arrowstyle": "-|>", "color": "#555555", "connectionstyle": f"arc3,rad={-0.15 - 0.4 / (y - down)}"}
            axes.annotate("", (RIGHT, down + 0.12), (RIGHT, y - 0.12), arrowprops=style)
    return {}, {"docs/figures/architecture.svg": figure}
