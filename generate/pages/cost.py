"""Measure what accuracy costs: tables/cost.csv, docs/cost.md and its figure, and the table for the README.

Run ``python -m generate.pages.cost --out docs``. Every number is measured in the run, as a ratio to one fixed piece of
work.
"""

from __future__ import annotations

import csv
import io
import json
import pathlib
import platform
import time
from collections.abc import Sequence
from importlib import metadata

import click

from mbma_tables.files import write_file
from mbma_tables.scenes.costs import COLUMNS, EVALUATIONS, UNIT, Row, measure, read_costs

DATA = pathlib.Path(__file__).parents[2] / "tables" / "cost.csv"
LIBRARIES = ("numpy", "scipy", "numba")
HEAD = """\
# What accuracy costs, measured by python -m generate cost; docs/cost.md says how. Costs are times over that of a
# fixed piece of work in the same run; the row of tier unit has its seconds. Times of boundary_elements are of others'
# machines.
"""


def to_csv(rows: Sequence[Row], quick: bool) -> str:
    """The rows as text."""
    versions = {name: metadata.version(name) for name in LIBRARIES} | {"python": platform.python_version()}
    text = io.StringIO()
    text.write(HEAD)
    text.write(f"# {json.dumps({'machine': platform.machine(), 'quick': quick} | versions)}\n")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow((*COLUMNS, EVALUATIONS))
    for row in rows:
        numbers = ("" if number is None else f"{number:.4g}" for number in (row.error, row.cost, row.evaluations))
        writer.writerow((row.tier, row.variant, row.quantity, *numbers))
    return text.getvalue()


def study(quick: bool) -> list[Row]:
    """Every measurement."""
    from generate.pages.cost_islands import island_rows
    from generate.pages.cost_totals import brute_force_rows, total_rows

    rows, seconds = [], []
    for part in (island_rows, total_rows):
        seconds.append(measure(lambda: None)[1])
        rows += part(quick)
    # the least: what else the machine does can only add
    unit = min(*seconds, measure(lambda: None)[1])
    return [Row(UNIT, "seconds", "both", None, unit), *rows, *brute_force_rows(unit)]


@click.command()
@click.option(
    "--out", type=click.Path(path_type=pathlib.Path), default=pathlib.Path("docs"), show_default=True, help="Folder."
)
@click.option("--data", type=click.Path(path_type=pathlib.Path), default=DATA, help="File; default tables/cost.csv.")
@click.option("--quick", is_flag=True, help="Fewer tolerances and meshes.")
@click.option("--page", "page_only", is_flag=True, help="Measure nothing: page and figure from the data as they are.")
def main(out: pathlib.Path, data: pathlib.Path, quick: bool, page_only: bool) -> None:
    """Write tables/cost.csv, OUT/cost.md and OUT/figures/cost.png; print the table for the README."""
    from generate.pages.cost_page import draw, page, readme_table

    started = time.perf_counter()
    if not page_only:
        write_file(data, to_csv(study(quick), quick).encode(), make_folders=True)
    costs = read_costs(data)
    write_file(out / "cost.md", page(costs).encode(), make_folders=True)
    write_file(out / "figures" / "cost.png", draw(costs), make_folders=True)
    click.echo(readme_table(costs))
    click.echo(f"wrote {data}, {out / 'cost.md'}; {time.perf_counter() - started:.0f} s", err=True)


if __name__ == "__main__":
    main()
