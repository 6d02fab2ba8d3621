"""`mbma tables formula`: a closed formula for a range of one's own."""

from pathlib import Path

import click

from mbma_tables.common.errors import InputError
from mbma_tables.common.progress import echo

LANGUAGES = ("text", "latex", "python", "c")


@click.command("formula", short_help="A closed formula for a range of one's own.")
@click.option(
    "--config",
    type=click.Path(path_type=Path),
    help="TOML file of the range; --example prints one.",
)
@click.option(
    "--terms",
    type=int,
    default=8,
    show_default=True,
    help="Coefficients of each formula, at most.",
)
@click.option(
    "--as",
    "languages",
    type=click.Choice(LANGUAGES),
    multiple=True,
    default=("text",),
    show_default=True,
    help="What to write; may be given several times.",
)
@click.option("--example", is_flag=True, help="Print a commented TOML file.")
def formula_command(
    config: Path | None, terms: int, languages: tuple[str, ...], example: bool
) -> None:
    """Choose a closed formula for a range of surfaces or islands, and print it with its held-out error.

    Terms are chosen by cross-validation over surfaces; the errors that are printed are those
    on surfaces that neither the choice nor the fit saw.

    Example: mbma tables formula --config range.toml --terms 8 --as latex --as c
    """
    from mbma_tables.export.model.own_formula import (
        EXAMPLE,
        fit_formula,
        read_range,
        written,
    )

    if example:
        echo(EXAMPLE.rstrip())
        return
    if config is None:
        raise InputError("--config is needed: the file of a range, which --example shows")
    own = read_range(config)
    formulas = fit_formula(own, terms)
    echo("\n\n".join(written(own, formulas, language) for language in languages))
