"""docs/explorer.md: size and speed of the explorer's page in a browser, and its picture."""

from __future__ import annotations

import contextlib
import pathlib
import shutil
import statistics
import tempfile
from collections.abc import Callable, Iterator
from typing import Any

from generate.pages.page import Measured, table
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


def processor(tab: Any) -> Callable[[], float]:
    """Milliseconds of processor time of a tab's main thread since it began, other programs excluded."""
    session = tab.context.new_cdp_session(tab)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})

    def spent() -> float:
        metrics = {each["name"]: each["value"] for each in session.send("Performance.getMetrics")["metrics"]}
        return 1e3 * float(metrics["TaskDuration"])

    return spent


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
    go(tab, address)
    return tab


def go(tab: Any, address: str) -> None:
    """Open the page in a tab, and wait until it has drawn."""
    tab.goto(address)
    tab.wait_for_selector("html[data-ready]", state="attached")


def openings(opened: Any, address: str) -> Iterator[tuple[float, float]]:
    """Milliseconds of each opening to the first curves, by the clock and of the processor."""
    for _ in range(OPENINGS):
        tab = opened.new_page()
        spent = processor(tab)
        go(tab, address)
        yield float(tab.evaluate("document.documentElement.dataset.ready")), spent()
        tab.close()


def steps(opened: Any, address: str) -> Iterator[tuple[float, float]]:
    """Milliseconds of each step of a slider, by the clock and of the processor."""
    tab = visit(opened, address)
    spent = processor(tab)
    tab.wait_for_timeout(1000)
    for k in range(STEPS):
        before = spent()
        yield tab.evaluate(STEP, 400 + 10 * k), spent() - before
    tab.context.close()


def measure() -> Measured:
    """The measured block of the page, and its picture."""
    text = explorer_page(Surface.named("concrete"), 13.3, "MPa", "calibrated", title="concrete road of Lorenz")
    rows: list[list[Any]] = [["size of the file", f"{len(text.encode()) / 1e6:.2f} MB", "", ""]]
    with tempfile.TemporaryDirectory() as folder, browser() as opened:
        path = pathlib.Path(folder, "explorer.html")
        path.write_text(text, encoding="utf-8")
        timed = {"opening to the first curves": openings(opened, path.as_uri())}
        for against in ("gap", "pressure"):
            address = f"{path.as_uri()}#against={against}&beside=mbma,calibrated,persson"
            timed[f"a slider's step, three theories against {against}"] = steps(opened, address)
        for name, found in timed.items():
            clock, spent = zip(*found, strict=True)
            rows.append([name, statistics.median(clock), max(clock), statistics.median(spent)])
        tab = visit(opened, path.as_uri())
        tab.locator(".chart").first.hover(position={"x": 200, "y": 100})
        picture = tab.screenshot()
    header = "quantity | median | largest | processor time of the page, median"
    return {"numbers": table(header, rows, "{} | {:.0f} ms")}, {"docs/figures/explorer.png": picture}
