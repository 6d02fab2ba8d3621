"""The measured part of docs/explorer.md: its size, how long it takes, and what it looks like."""

from __future__ import annotations

import contextlib
import pathlib
import shutil
import statistics
import tempfile
from collections.abc import Iterator
from typing import Any

from generate.pages.page import table
from mbma_tables import Surface
from mbma_tables.export.explorer import explorer_page

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
OPENINGS, STEPS = 5, 40
# milliseconds from moving a slider to the end of the drawing that follows
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
        # as root, which CI often is, it runs without a sandbox alone
        opened = playwright.chromium.launch(executable_path=program(), args=["--no-sandbox"])
        yield opened
        opened.close()


def visit(opened: Any, address: str, **options: Any) -> Any:
    """A tab with the page, once it has drawn; in a context of its own."""
    tab = opened.new_context(**{"viewport": {"width": 1280, "height": 800}, **options}).new_page()
    tab.goto(address)
    tab.wait_for_selector("html[data-ready]", state="attached")
    return tab


def measure() -> tuple[dict[str, str], dict[str, bytes]]:
    """The measured part of the page, and its picture."""
    text = explorer_page(Surface.named("concrete"), 13.3, "MPa", "calibrated", title="concrete road of Lorenz")
    with tempfile.TemporaryDirectory() as folder, browser() as opened:
        path = pathlib.Path(folder, "explorer.html")
        path.write_text(text, encoding="utf-8")
        first, steps = [], {}
        for _ in range(OPENINGS):
            tab = visit(opened, path.as_uri())
            first.append(float(tab.evaluate("document.documentElement.dataset.ready")))
            tab.context.close()
        for against in ("gap", "pressure"):
            tab = visit(opened, f"{path.as_uri()}#against={against}&beside=mbma,calibrated,persson")
            tab.wait_for_timeout(1000)
            steps[against] = [tab.evaluate(STEP, 400 + 10 * k) for k in range(STEPS)]
            tab.context.close()
        tab = visit(opened, path.as_uri())
        tab.locator(".chart").first.hover(position={"x": 200, "y": 100})
        picture = tab.screenshot()
    rows = [
        ["one file", f"{len(text.encode()) / 1e6:.2f} MB"],
        ["opening to the first curves", f"{statistics.median(first):.0f} ms, at most {max(first):.0f}"],
        *(
            [
                f"a slider's step, three theories against {against}",
                f"{statistics.median(found):.0f} ms, at most {max(found):.0f}",
            ]
            for against, found in steps.items()
        ),
    ]
    return {"numbers": table(["what", "measured"], rows)}, {"docs/figures/explorer.png": picture}
