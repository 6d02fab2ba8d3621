"""``python -m generate explorer``: compile the C of the page of `mbma explore` to WebAssembly."""

from __future__ import annotations

import pathlib

import click

from generate.pages.page import ROOT
from mbma_tables.export.explorer import MODULE, c_sources, compiled
from mbma_tables.files import write_file


@click.command()
def explorer() -> None:
    """Compile the C of the page to mbma_tables/export/page/explorer.wasm; needs ziglang."""
    texts, values = c_sources()
    path = pathlib.Path(ROOT, "mbma_tables", "export", "page", MODULE)
    write_file(path, compiled(texts, list(values)))
    click.echo(path)
