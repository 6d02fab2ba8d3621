"""The measured parts of docs/formula.md: closed forms with their certificates."""

from __future__ import annotations

from generate.formulas.printing import MODULE, latex_steps, read_functions
from generate.pages.page import table
from mbma_tables.models.closed_form_functions import CERTIFICATES, RANGES

SHOWN = ("pocket", "standard", "totals")
HEADER = ("form", "function", "coefficients", "largest error", "median", "worst at")


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


def measure() -> tuple[dict[str, str], dict[str, bytes]]:
    """The measured parts of the page."""
    return {"certificates": certificates(), "ranges": ranges()} | {form: equations(form) for form in SHOWN}, {}
