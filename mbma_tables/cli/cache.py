"""The command `mbma cache`: stored simulations of maps, which are not repeated."""

from __future__ import annotations

import json

import click

from mbma_tables.cli import options
from mbma_tables.common import cache
from mbma_tables.common.progress import echo


@click.command("cache", short_help="Simulations that are kept.")
@click.option("--clear", is_flag=True, help="Remove them all.")
@options.json_option("a line")
def cache_command(clear: bool, as_json: bool) -> None:
    """Folder in which loads and flows of simulated maps are stored, number of files, and their size.

    The environment variable MBMA_TABLES_CACHE names another folder; "off" disables the cache. When it
    exceeds 1 GiB, the files used longest ago are removed.

    Example: mbma cache --clear
    """
    place = cache.folder()
    removed = cache.trim(0) if clear else 0
    kept = cache.files()
    size = sum(stat.st_size for _, stat in kept)
    facts = {"folder": None if place is None else str(place), "files": len(kept), "bytes": size, "removed": removed}
    if as_json:
        echo(json.dumps(facts))
        return
    if place is None:
        echo(f"nothing is kept: {cache.VARIABLE} is off")
        return
    echo(f"{place}: {len(kept)} files, {size} bytes" + (f"; {removed} removed" if clear else ""))
