"""``python -m generate explorer``: the WebAssembly of the page of `mbma explore`.

And the page's size and speed in a browser.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import pathlib
import shutil
import statistics
import sys
import tempfile
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import click

from generate.files import ROOT
from generate.page import Cell, Measured, table
from mbma_tables import Surface
from mbma_tables.common.files import write_file
from mbma_tables.export.code.languages.javascript import LAW_MODULE
from mbma_tables.export.model import c_code
from mbma_tables.export.page.explorer import MODULE, explorer_page
from mbma_tables.export.text import core_file
from mbma_tables.islands.variants import REPORTED
from mbma_tables.tables.open import universal_model

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

# with two numbers at a time, which browsers have learned by 2023
ZIG = (
    "-m",
    "ziglang",
    "cc",
    "-target",
    "wasm32-wasi",
    "-mexec-model=reactor",
    *c_code.FLAGS,
    "-s",
    "-msimd128",
)
FUNCTIONS = (
    "mbma_total_of",
    "mbma_calibrated_of",
    "mbma_message",
    "mbma_spectrum_of",
    "mbma_surface_spectrum_of",
    "mbma_spectrum_contact_of",
    "mbma_spectrum_separation_of",
    "mbma_yielding_at_gaps",
    "mbma_yielding_areas",
    "mbma_frozen_factors",
    "mbma_tangential_ratios",
    "mbma_tangential_stiffnesses",
    "mbma_solid_conductances",
    "mbma_covered_areas",
)
LAW_FUNCTIONS = (
    "mbma_law_open",
    "mbma_law_at_overclosure",
    "mbma_law_and_slope",
    "mbma_law_overclosure",
    "mbma_law_flow",
)

# how often is measured
OPENINGS = 5
STEPS = 40
# moves a slider; milliseconds to the end of the drawing that follows
STEP = """async (place) => {
  const slider = document.getElementById("slide-hurst"), start = performance.now();
  slider.value = place;
  slider.dispatchEvent(new Event("input"));
  await new Promise((done) => setTimeout(done));
  return performance.now() - start;
}"""


def c_sources() -> tuple[dict[str, str], dict[str, Any]]:
    """The C of the page by file, and the tables that are variables in it by name."""
    model = universal_model()
    without_heads = dict.fromkeys(c_code.MODEL, "")
    texts = c_code.core_texts() | c_code.model_texts(without_heads)
    texts["mbma_data.c"] = c_code.data_text(model, REPORTED, later=True)
    return texts, c_code.tables(model)


def law_sources() -> dict[str, str]:
    return {name: core_file(name) for name in ("mbma.h", "elementary.h", "law.c")}


def compiled(texts: dict[str, str], names: Iterable[str]) -> bytes:
    """The module, at its end a section with the digest of what it was compiled from."""
    section = b"\x06digest" + digest_of(texts)
    exports = [f"-Wl,--export={name}" for name in names]
    module = c_code.built_by([sys.executable, *ZIG, *exports], texts, "mbma.wasm")
    return module + bytes([0, len(section)]) + section


def digest_of(texts: dict[str, str]) -> bytes:
    return hashlib.sha256(json.dumps(texts, sort_keys=True).encode()).digest()


@click.command()
def explorer() -> None:
    """Compile the C of the page and of laws in JavaScript; needs ziglang.

    Into mbma_tables/export/page.
    """
    texts, values = c_sources()
    folder = pathlib.Path(ROOT, "mbma_tables", "export", "page")
    write_file(folder / MODULE, compiled(texts, [*FUNCTIONS, "MBMA_VARIANT", *values]))
    write_file(folder / LAW_MODULE, compiled(law_sources(), LAW_FUNCTIONS))
    click.echo(f"{folder / MODULE}\n{folder / LAW_MODULE}")


def program() -> str | None:
    """The path of a browser, where one is installed."""
    for name in ("chromium", "chromium-browser", "google-chrome"):
        path = shutil.which(name)
        if path:
            return path
    return None


@contextlib.contextmanager
def browser() -> Iterator[Browser]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        # as root, as often in CI, it only runs without a sandbox
        opened = playwright.chromium.launch(
            executable_path=program(), args=["--no-sandbox"]
        )
        yield opened
        opened.close()


def visit(opened: Browser, address: str, **options: Any) -> Page:
    """A tab with the page, once it has drawn; in a context of its own."""
    options = {"viewport": {"width": 1280, "height": 800}, **options}
    tab = opened.new_context(**options).new_page()
    tab.goto(address)
    tab.wait_for_selector("html[data-ready]", state="attached")
    return tab


def _clocks(opened: Browser, address: str) -> dict[str, list[float]]:
    """Milliseconds that each action took, several times."""
    clocks = {}
    milliseconds = "document.documentElement.dataset.ready"
    openings = []
    for _ in range(OPENINGS):
        tab = visit(opened, address)
        openings.append(float(tab.evaluate(milliseconds)))
    clocks["opening to the first curves"] = openings
    for against in ("gap", "pressure"):
        tab = visit(opened, f"{address}#against={against}&beside=mbma,calibrated,persson")
        # what the opening still does ends before
        tab.wait_for_timeout(1000)
        clock = [tab.evaluate(STEP, 400 + 10 * step) for step in range(STEPS)]
        clocks[f"a slider's step, three theories against {against}"] = clock
    return clocks


def measure() -> Measured:
    """docs/export.md: size and speed of the page, and its picture."""
    text = explorer_page(
        Surface.named("concrete"),
        13.3,
        "MPa",
        "calibrated",
        title="concrete road of Lorenz",
    )
    with tempfile.TemporaryDirectory() as folder, browser() as opened:
        path = pathlib.Path(folder, "explorer.html")
        path.write_text(text, encoding="utf-8")
        clocks = _clocks(opened, path.as_uri())
        tab = visit(opened, path.as_uri())
        tab.locator(".chart").first.hover(position={"x": 200, "y": 100})
        picture = tab.screenshot()
    megabytes = len(text.encode()) / 1e6
    rows: list[list[Cell]] = [["size of the file", f"{megabytes:.2f} MB", ""]]
    for name, clock in clocks.items():
        rows.append([name, statistics.median(clock), max(clock)])
    numbers = table("quantity | median | largest", rows, "{} | {:.0f} ms")
    return {"numbers": numbers}, {"docs/figures/explorer.png": picture}
