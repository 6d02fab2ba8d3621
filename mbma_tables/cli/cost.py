"""The command `mbma cost`: what accuracy costs, as measured."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import click

from mbma_tables.cli.format import Report, to_columns, to_json
from mbma_tables.cli.options import json_option
from mbma_tables.cli.progress import echo
from mbma_tables.errors import InputError


@click.command("cost", short_help="What accuracy costs, in time.")
@click.option("--tier", help="Rows of this tier alone.")
@click.option("--distance", is_flag=True, help="Theories' distance from brute force in place of numerical error.")
@json_option("a table")
def cost_command(tier: str | None, distance: bool, as_json: bool) -> None:
    """Error and time of everything that answers, as measured on held-out surfaces.

    Costs are times over that of a fixed piece of work; seconds are those of the machine that measured. docs/cost.md
    says what each row is. With --distance: root mean squares of ln(theory/boundary elements), of area at equal force
    and force at equal separation, light at 1-10% contact and deep at 10-97%.

    Example: mbma cost --tier universal
    """
    from mbma_tables.scenes.costs import UNIT, shipped_costs, shipped_distances

    costs = shipped_costs()
    if distance:
        if tier is not None:
            raise InputError("--tier is about numerical error: leave it or --distance out")
        _show("distance", shipped_distances(), costs.seconds, as_json)
        return
    rows = [row for row in costs.rows if row.tier != UNIT]
    if tier is not None:
        known = tuple(dict.fromkeys(row.tier for row in rows))
        rows = [row for row in rows if row.tier == tier]
        if not rows:
            raise InputError(f"--tier must be one of {known}, got {tier!r}")
    _show("cost", rows, costs.seconds, as_json)


def _show(title: str, rows: Sequence[Any], unit: float, as_json: bool) -> None:
    records = [row._asdict() | {"seconds": row.cost * unit} for row in rows]
    if as_json:
        echo(to_json({"unit_seconds": unit, "rows": records}))
        return
    columns = to_columns({name: [record[name] for record in records] for name in records[0]}, {})
    echo(Report(title, f"fixed piece of work {unit:.3g} s", [], {}, columns).to_table(), nl=False)
