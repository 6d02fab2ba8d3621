"""The command `mbma cost`: what accuracy costs, as measured, and what it costs on this machine."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from mbma_tables.scenes.costs import Costs, Row

HEADER = ("tier", "asked", "of", "error", "cost", "seconds", "evaluations")


def _record(row: Row, costs: Costs) -> dict[str, Any]:
    """One measurement, with its seconds on this machine."""
    cost = row.cost * costs.factors.get(row.tier, 1.0)
    return {
        "tier": row.tier,
        "variant": row.variant,
        "quantity": row.quantity,
        "error": row.error,
        "cost": cost,
        "seconds": cost * costs.seconds,
        "evaluations": row.evaluations,
    }


def _lines(records: list[dict[str, Any]]) -> list[str]:
    """An aligned table."""
    rows = [HEADER]
    for record in records:
        numbers = tuple("" if record[name] is None else f"{record[name]:.2g}" for name in ("error", "cost", "seconds"))
        count = "" if record["evaluations"] is None else f"{record['evaluations']:.0f}"
        rows.append((record["tier"], record["variant"], record["quantity"], *numbers, count))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


@click.command("cost", short_help="What accuracy costs, in time.")
@click.option("--tier", help="Rows of this tier alone.")
@click.option("--calibrate", is_flag=True, help="Time each tier here first, in a few seconds, and keep the factors.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object instead of a table.")
def cost_command(tier: str | None, calibrate: bool, as_json: bool) -> None:
    """Error and time of everything that answers, as measured on held-out surfaces.

    Costs are times over that of a fixed piece of work; the seconds are those of the machine that measured, or of this
    one once it is calibrated. docs/cost.md says what each row is.

    Example: mbma cost --tier universal
    """
    from mbma_tables.errors import InputError
    from mbma_tables.scenes import costs as data

    shipped = data.read_costs(data.cost_file())
    rows = [row for row in shipped.measured if row.tier != data.UNIT]
    if tier is not None:
        known = tuple(dict.fromkeys(row.tier for row in rows))
        rows = [row for row in rows if row.tier == tier]
        if not rows:
            raise InputError(f"--tier must be one of {known}, got {tier!r}")
    kept = None
    if calibrate:
        kept = data.write_calibration(data.calibrate(shipped))
        data.shipped_costs.cache_clear()
    costs = shipped.calibrated(data.read_calibration())
    records = [_record(row, costs) for row in rows]
    calibrated = costs is not shipped
    if as_json:
        facts = {"unit_seconds": costs.seconds, "calibrated": calibrated, "factors": dict(costs.factors)}
        click.echo(json.dumps(facts | {"rows": records}, indent=2))
        return
    where = "calibrated on this machine" if calibrated else "of the machine that measured; --calibrate adapts them"
    click.echo(f"fixed piece of work: {costs.seconds:.3g} s, {where}")
    if kept is not None:
        factors = ", ".join(f"{name} {factor:.2f}" for name, factor in costs.factors.items())
        click.echo(f"cost here over the measured one: {factors}; kept in {kept}")
    for line in _lines(records):
        click.echo(line)
