"""The measured parts of docs/formula.md: closed forms with their certificates, and accuracy against length."""

from __future__ import annotations

from generate.formulas import islands
from generate.formulas.printing import MODULE, latex_steps, read_functions
from generate.pages.page import png, pyplot, table
from mbma_tables.models.closed_form_functions import CERTIFICATES, RANGES

SHOWN = ("pocket", "standard", "totals")
HEADER = ("form", "function", "coefficients", "largest error", "median", "worst at")
LABELS = {"phi_F": "force", "phi_A": "area"}


def certificates() -> str:
    """What each function's certificate states."""
    rows = []
    for form, results in CERTIFICATES.items():
        for result, found in results.items():
            worst = ", ".join(f"{name} = {value:g}" for name, value in found.worst_at.items())
            rows.append([form, result, str(found.coefficients), f"{found.largest:g}", f"{found.median:.2g}", worst])
    return table(HEADER, rows)


def ranges() -> str:
    """Where each form holds."""
    return "\n".join(
        f"- {form}: {', '.join(f'`{low:g} <= {name} <= {high:g}`' for name, (low, high) in found.items())}"
        for form, found in RANGES.items()
    )


def equations(form: str) -> str:
    """The equations of a form, steps that its functions share once."""
    functions = read_functions(MODULE.read_text(encoding="utf-8"))
    lines = [line for function in functions.values() if function.form == form for line in latex_steps(function)]
    return "\n\n".join(f"$${line}$$" for line in dict.fromkeys(lines))


def lengths(front: list[dict[str, float]]) -> str:
    """Error against number of coefficients."""
    return table(
        ["terms", "coefficients of force", "its largest error", "coefficients of area", "its largest error"],
        [
            [f"{row['terms']:g}"]
            + [text for name in LABELS for text in (f"{row[f'coefficients_{name}']:g}", f"{row[f'error_{name}']:.2g}")]
            for row in front
        ],
    )


def draw(front: list[dict[str, float]]) -> bytes:
    """Error against number of coefficients."""
    figure, axes = pyplot().subplots(figsize=(6, 4), layout="constrained")
    for (name, label), mark in zip(LABELS.items(), ("o-", "s-"), strict=True):
        x, y = ([row[f"{kind}_{name}"] for row in front] for kind in ("coefficients", "error"))
        axes.loglog(x, y, mark, label=label)
    axes.set(xlabel="fitted coefficients", ylabel="largest relative error on held-out points")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend()
    return png(figure, dpi=130)


def measure() -> tuple[dict[str, str], dict[str, bytes]]:
    """The measured parts of the page, and its figure."""
    front = islands.front()
    parts = {"certificates": certificates(), "ranges": ranges(), "lengths": lengths(front)}
    return parts | {form: equations(form) for form in SHOWN}, {"docs/figures/formula.png": draw(front)}
