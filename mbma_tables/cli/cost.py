"""The command `mbma cost`: what accuracy costs, as measured."""

from __future__ import annotations

import json

import click

from mbma_tables.cli.format import Column, Report
from mbma_tables.errors import InputError


@click.command("cost", short_help="What accuracy costs, in time.")
@click.option("--tier", help="Rows of this tier alone.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of a table.")
def cost_command(tier: str | None, as_json: bool) -> None:
    """Error and time of everything that answers, as measured on held-out surfaces.

    Costs are times over that of a fixed piece of work; seconds are those of the machine that measured. docs/cost.md
    says what each row is.

    Example: mbma cost --tier universal
    """
    from mbma_tables.scenes.costs import UNIT, shipped_costs

    costs = shipped_costs()
    rows = [row for row in costs.rows if row.tier != UNIT]
    if tier is not None:
        known = tuple(dict.fromkeys(row.tier for row in rows))
        rows = [row for row in rows if row.tier == tier]
        if not rows:
            raise InputError(f"--tier must be one of {known}, got {tier!r}")
    records = [{**vars(row), "seconds": row.cost * costs.seconds} for row in rows]
    if as_json:
        click.echo(json.dumps({"unit_seconds": costs.seconds, "rows": records}, indent=2))
        return
    names = ("tier", "variant", "quantity", "error", "cost", "seconds", "evaluations")
    columns = [Column(name, "-", [record[name] for record in records]) for name in names]
    click.echo(Report("cost", f"fixed piece of work {costs.seconds:.3g} s", [], {}, columns).to_table(), nl=False)
