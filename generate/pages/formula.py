"""Draw docs/formula.md from tables/formula.json and the studies of the fits (``python -m generate.pages.formula``)."""

from __future__ import annotations

import pathlib
from typing import Any

import click

from generate.formulas import alternatives as formula_alternatives
from generate.formulas import islands as formula_islands
from generate.pages.page import png
from mbma_tables.files import write_file
from mbma_tables.formulas.file import ISLAND_FORMS, TOTALS, Form, get_form, shipped_formulas
from mbma_tables.formulas.printers import latex_steps

PAGE = pathlib.Path("formula.md")
FIGURE = pathlib.Path("figures") / "formula.png"


def draw(front: list[dict[str, float]], path: pathlib.Path) -> None:
    """Accuracy against length of the island forms."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(6, 4), layout="constrained")
    for name, mark in (("phi_F", "o-"), ("phi_A", "s-")):
        label = {"phi_F": "force", "phi_A": "area"}[name]
        x, y = ([row[f"{kind}_{name}"] for row in front] for kind in ("coefficients", "error"))
        axes.loglog(x, y, mark, label=label)
    axes.set(xlabel="fitted coefficients", ylabel="largest relative error on held-out points")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend()
    write_file(path, png(figure, dpi=130), make_folders=True)


def _table(head: list[str], rows: list[list[str]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "| " + " | ".join("---" for _ in head) + " |"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def _where(worst: dict[str, float]) -> str:
    return ", ".join(f"{name} = {value:g}" for name, value in worst.items())


def _summary(form: Form) -> list[list[str]]:
    ranges = ", ".join(f"{low:g} <= {name} <= {high:g}" for name, (low, high) in form.range.items())
    return [
        [
            form.name,
            result,
            str(form.coefficients[result]),
            f"{form.errors[result]['largest']:.2g}",
            f"{form.errors[result]['median']:.2g}",
            _where(form.errors[result]["worst_at"]),
            ranges,
        ]
        for result in form.outputs
    ]


def _equations(form: Form) -> str:
    return "\n\n".join(f"$${line}$$" for line in latex_steps(form))


def page(front: list[dict[str, float]], islands: list[dict[str, Any]], totals: list[dict[str, Any]]) -> str:
    """The text of the page."""
    forms = [get_form(name) for name in (*ISLAND_FORMS, TOTALS)]
    summary = _table(
        ["form", "function", "coefficients", "largest error", "median", "worst at", "range"],
        [row for form in forms for row in _summary(form)],
    )
    lengths = _table(
        ["terms", "coefficients of force", "its largest error", "coefficients of area", "its largest error"],
        [
            [
                f"{row['terms']:g}",
                f"{row['coefficients_phi_F']:g}",
                f"{row['error_phi_F']:.2g}",
                f"{row['coefficients_phi_A']:g}",
                f"{row['error_phi_A']:.2g}",
            ]
            for row in front
        ],
    )
    compared = [
        _table(
            ["model", "largest error", "us an answer"],
            [[row["model"], f"{row['largest_error']:.2g}", f"{row['microseconds']:.2g}"] for row in rows],
        )
        for rows in (islands, totals)
    ]
    return f"""# The empirical formula

`python -m generate formula` fits these forms to exact solves and writes `tables/formula.json` (data hash
`{shipped_formulas().data_hash[:12]}`), from which the tier `formula`, the exports and this page are made. This page:
`python -m generate.pages.formula --out docs`.

An island of any surface is two functions of `X = (delta - h_d)/sigma` and `mu = (8/3) D sigma sqrt(2 R_u R_d)`:
`F^i = E* sigma L Phi_F`, `A^i = eta pi D R_u sigma L^2 Phi_A`, with `L = sqrt(2 R_d sigma)`. The forms divide the rigid
sphere by `1 + mu Q(X, mu)`, so that `mu -> 0` is the rigid sphere and large `X` the smooth sphere of Hertz whatever is
fitted; both are positive, and on a grid of the range checked to rise with `X`. Errors are the largest on
{forms[0].errors["points"]} exact solves that no fit saw, of the text as printed, with its rounded constants.

{summary}

The coefficients of the rigid sphere's own approximations, `R_F = (pi/5) F_(5/2)(-X)` and `R_A = (pi/2) F_2(-X)`,
are not counted; they hold for `-0.5 <= X <= 60`.

```python
from mbma_tables import Surface, contact
from mbma_tables.formulas.totals import closed_totals

contact(Surface(0.8, 1.0, 200.0, 1.0, 3.0), 1.0, tier="formula").force  # the standard form, summed over islands
closed_totals(Surface(0.8, 1.0, 200.0, 1.0, 3.0), 1.0)  # force, area and their largest error, without a sum
```

## Pocket form

{_equations(forms[0])}

## Standard form

{_equations(forms[1])}

The long form is in `tables/formula.json`; `mbma_tables.formulas.printers` prints any of them in C, Fortran, MATLAB,
Python, JavaScript, for spreadsheets, or in LaTeX.

## Totals

Force over `E* q0 h_rms` and area, reading `reported`, with `\\tilde d = d/h_rms` and `\\tilde h = h_max/h_rms`. The
two branches meet where the largest islands reach the floor of `zeta_d`, at `l = k`; they do not join, but jump by up to
a seventh there, so these forms are for estimates and not for slopes. The errors are of random surfaces, many on the
edges of the range; a search for the worst surface finds a tenth more, at the least areas.

{_equations(forms[3])}

## Accuracy against length

![largest error of the island forms against their number of coefficients]({FIGURE.as_posix()})

Islands with `X >= 0.8`, unrounded, the rigid sphere exact:

{lengths}

## Against plain regressors

The same samples, `Phi_F` of islands:

{compared[0]}

Total force:

{compared[1]}

Times are of one machine and one run.
"""


@click.command()
@click.option("--out", type=click.Path(path_type=pathlib.Path, file_okay=False), default="docs", show_default=True)
def main(out: pathlib.Path) -> None:
    """Write the page and its figure."""
    front = formula_islands.front()
    draw(front, out / FIGURE)
    text = page(front, formula_alternatives.islands(), formula_alternatives.totals())
    write_file(out / PAGE, text.encode(), make_folders=True)
    click.echo(out / PAGE)


if __name__ == "__main__":
    main()
