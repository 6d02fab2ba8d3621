"""``python -m generate explorer``: compile the C of the page of `mbma explore` to WebAssembly."""

import hashlib
import json
import pathlib
import sys
from collections.abc import Iterable
from typing import Any

import click

from generate.files import ROOT
from mbma_tables.common.files import write_file
from mbma_tables.export import c_code
from mbma_tables.export.explorer import MODULE
from mbma_tables.export.law_code import LAW_MODULE
from mbma_tables.export.text import core_file
from mbma_tables.models.tables import universal_model
from mbma_tables.surfaces.variants import REPORTED

# with two numbers at a time, which browsers have learned by 2023
ZIG = ("-m", "ziglang", "cc", "-target", "wasm32-wasi", "-mexec-model=reactor", *c_code.FLAGS, "-s", "-msimd128")
FUNCTIONS = (
    *("mbma_total_of", "mbma_calibrated_of", "mbma_message", "mbma_spectrum_of", "mbma_surface_spectrum_of"),
    *("mbma_spectrum_contact_of", "mbma_spectrum_separation_of"),
)
LAW_FUNCTIONS = (
    *("mbma_law_open", "mbma_law_at_overclosure", "mbma_law_and_slope", "mbma_law_overclosure", "mbma_law_flow"),
)


def c_sources() -> tuple[dict[str, str], dict[str, Any]]:
    """The C of the page by file, and the tables that are variables in it by name."""
    model, heads = universal_model(), dict.fromkeys(c_code.MODEL, "")
    data = {"mbma_data.c": c_code.data_text(model, REPORTED, later=True)}
    return c_code.core_texts() | c_code.model_texts(heads) | data, c_code.tables(model)


def law_sources() -> dict[str, str]:
    """The C of laws in JavaScript."""
    return {name: core_file(name) for name in ("mbma.h", "elementary.h", "law.c")}


def compiled(texts: dict[str, str], names: Iterable[str]) -> bytes:
    """The module, with the digest of what it was compiled from in a section of its own at the end."""
    section = b"\x06digest" + digest_of(texts)
    exports = [f"-Wl,--export={name}" for name in names]
    module = c_code.built_by([sys.executable, *ZIG, *exports], texts, "mbma.wasm")
    return module + bytes([0, len(section)]) + section


def digest_of(texts: dict[str, str]) -> bytes:
    """Of what the module is compiled from."""
    return hashlib.sha256(json.dumps(texts, sort_keys=True).encode()).digest()


@click.command()
def explorer() -> None:
    """Compile the C of the page and of laws in JavaScript into mbma_tables/export/page; needs ziglang."""
    texts, values = c_sources()
    folder = pathlib.Path(ROOT, "mbma_tables", "export", "page")
    write_file(folder / MODULE, compiled(texts, [*FUNCTIONS, "MBMA_VARIANT", *values]))
    write_file(folder / LAW_MODULE, compiled(law_sources(), LAW_FUNCTIONS))
    click.echo(f"{folder / MODULE}\n{folder / LAW_MODULE}")
