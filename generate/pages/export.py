"""The measured part of docs/export.md: what rows chosen by their error are worth, and the figure."""

from __future__ import annotations

from generate.pages.page import png, pyplot, table
from mbma_tables import Surface
from mbma_tables.export.law_rows import LawTable, describe_law

NAMES = ("concrete", "asphalt", "yang-persson", "challenge")
ROWS = (20, 50, 200)
E_STAR = 13.3


def law(name: str, rows: int, evenly: bool = False) -> LawTable:
    """Rows of a named surface."""
    return describe_law(Surface.named(name), E_STAR, stress_unit="MPa", rows=rows, evenly=evenly)


def errors() -> str:
    """Largest errors of linear interpolation by surface and rows."""
    lines = []
    for name in NAMES:
        for rows in ROWS:
            chosen, even = (law(name, rows, evenly).largest_error for evenly in (False, True))
            lines.append([name, str(rows), f"{chosen:.1e}", f"{even:.1e}", f"{even / chosen:.1f}"])
    return table(["surface", "rows", "chosen", "equally spaced", "ratio"], lines)


def draw() -> bytes:
    """Rows of the concrete road, chosen by error and equally spaced, on the curve."""
    figure, axes = pyplot().subplots(figsize=(6, 4), layout="constrained")
    fine = law("concrete", 500)
    axes.semilogy(fine.x[1:], fine.y[1:], "k-", lw=0.8, label="model")
    for evenly, mark, label in ((False, "o", "chosen"), (True, "x", "equally spaced")):
        rows = law("concrete", 20, evenly)
        axes.semilogy(rows.x[1:], rows.y[1:], mark, label=f"20 rows, {label}: error {rows.largest_error:.1%}")
    axes.set(xlabel="overclosure [mm]", ylabel="pressure [MPa]", ylim=(1e-4, 5))
    axes.grid(True, alpha=0.3)
    axes.legend()
    return png(figure, dpi=130)


def measure() -> tuple[dict[str, str], dict[str, bytes]]:
    """The measured part of the page, and its figure."""
    return {"errors": errors()}, {"docs/figures/export.png": draw()}
