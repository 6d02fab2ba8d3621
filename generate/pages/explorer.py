"""docs/explorer.md: size and speed of the explorer's page in a browser, and its picture."""

import contextlib
import pathlib
import shutil
import statistics
import tempfile
from collections.abc import Iterator
from typing import Any

from generate.page import Measured, table
from mbma_tables import Surface
from mbma_tables.export.explorer import explorer_page

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
OPENINGS, STEPS = 5, 40
# moves a slider; milliseconds to the end of the drawing that follows
STEP = """async (place) => {
  const slider = document.getElementById("slide-hurst"), start = performance.now();
  slider.value = place;
  slider.dispatchEvent(new Event("input"));
  await new Promise((done) => setTimeout(done));
  return performance.now() - start;
}"""


def program() -> str | None:
    """A Chromium on this machine."""
    return next((found for name in PROGRAMS if (found := shutil.which(name))), None)


@contextlib.contextmanager
def browser() -> Iterator[Any]:
    """A headless Chromium."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        # as root, as often in CI, it only runs without a sandbox
        opened = playwright.chromium.launch(executable_path=program(), args=["--no-sandbox"])
        yield opened
        opened.close()


def visit(opened: Any, address: str, **options: Any) -> Any:
    """A tab with the page, once it has drawn; in a context of its own."""
    tab = opened.new_context(**{"viewport": {"width": 1280, "height": 800}, **options}).new_page()
    tab.goto(address)
    tab.wait_for_selector("html[data-ready]", state="attached")
    return tab


def measure() -> Measured:
    text = explorer_page(Surface.named("concrete"), 13.3, "MPa", "calibrated", title="concrete road of Lorenz")
    clocks, ready = dict[str, list[float]](), "document.documentElement.dataset.ready"
    with tempfile.TemporaryDirectory() as folder, browser() as opened:
        path = pathlib.Path(folder, "explorer.html")
        path.write_text(text, encoding="utf-8")
        openings = (visit(opened, path.as_uri()) for _ in range(OPENINGS))
        clocks["opening to the first curves"] = [float(tab.evaluate(ready)) for tab in openings]
        for against in ("gap", "pressure"):
            tab = visit(opened, f"{path.as_uri()}#against={against}&beside=mbma,calibrated,persson")
            tab.wait_for_timeout(1000)
            clock = [tab.evaluate(STEP, 400 + 10 * k) for k in range(STEPS)]
            clocks[f"a slider's step, three theories against {against}"] = clock
        tab = visit(opened, path.as_uri())
        tab.locator(".chart").first.hover(position={"x": 200, "y": 100})
        picture = tab.screenshot()
    rows = [[name, statistics.median(clock), max(clock)] for name, clock in clocks.items()]
    size = ["size of the file", f"{len(text.encode()) / 1e6:.2f} MB", ""]
    parts = {"numbers": table("quantity | median | largest", [size, *rows], "{} | {:.0f} ms")}
    return parts, {"docs/figures/explorer.png": picture}
