"""`python -m generate formulas`: fit the closed forms, certify them, and write them as Python."""

from __future__ import annotations

import click

from generate.formulas.printing import MODULE, write_forms


@click.command()
def formulas() -> None:
    """Fit and certify the closed forms; write their Python module (about five minutes)."""
    from generate.formulas.islands import SIZES, island_form
    from generate.formulas.totals import totals_form

    forms = [*map(island_form, SIZES), totals_form()]
    write_forms(forms)
    for form in forms:
        errors = ", ".join(f"{name} {found.largest:.2e}" for name, found in form.certificates.items())
        click.echo(f"{form.name}: largest held-out error {errors}")
    click.echo(MODULE)
