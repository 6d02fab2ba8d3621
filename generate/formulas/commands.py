"""`python -m generate formulas`: fit and certify the closed forms."""

from __future__ import annotations

import pathlib

import click

from generate.formulas.fit import build

FILE = pathlib.Path(__file__).parents[2] / "tables" / "formula.json"


@click.command()
@click.option("--out", type=click.Path(path_type=pathlib.Path), default=FILE, help="File; default tables/formula.json.")
def formulas(out: pathlib.Path) -> None:
    """Fit, certify and write the closed forms."""
    for form in build(out).forms.values():
        errors = ", ".join(f"{name} {form.largest_error(name):.2e}" for name in form.outputs)
        click.echo(f"{out}: {form.name}; largest held-out error {errors}")
