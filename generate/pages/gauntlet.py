"""The gauntlet (``python -m generate gauntlet``): the atlas, and every bulk test at its full size.

Bulk tests are those that take their size from MBMA_GAUNTLET; each reports how many cases it tried as properties of
the junit report.
"""

from __future__ import annotations

import collections
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence

import click

from generate.pages import stability as atlas
from generate.pages.page import fill
from mbma_tables.files import write_file

ROOT = pathlib.Path(__file__).parents[2]
SIZE = "MBMA_GAUNTLET"
FULL = 20  # times the size of the tests in CI
KINDS = ("inputs fuzzed", "faults injected", "pairs compared", "properties' examples", "refused")


def bulk_tests() -> list[pathlib.Path]:
    """The test files that take their size from the environment, by themselves or from a module beside them."""
    scaled = {path for path in ROOT.glob("tests/**/*.py") if SIZE in path.read_text(encoding="utf-8")}
    folders = {path.parent for path in scaled if not path.name.startswith("test_")}
    return sorted(path for path in ROOT.glob("tests/**/test_*.py") if path in scaled or path.parent in folders)


def run(files: Sequence[pathlib.Path], size: int, report: pathlib.Path) -> int:
    """Run these tests at that size, warnings being errors; returns pytest's exit code."""
    # the older form of the report is the one that holds properties
    options = ["-o", "junit_family=xunit1", f"--junitxml={report}"]
    command = [sys.executable, "-m", "pytest", *options, *map(str, files)]
    return subprocess.run(command, cwd=ROOT, env=os.environ | {SIZE: str(size)}, check=False).returncode


def tally(report: pathlib.Path) -> dict[str, collections.Counter[str]]:
    """By test file: tests, failures, skips, seconds, and the cases of each kind."""
    found: dict[str, collections.Counter[str]] = collections.defaultdict(collections.Counter)
    # written by our own pytest
    for case in ElementTree.parse(report).iter("testcase"):
        counter = found[case.attrib["file"]]
        counter["tests"] += 1
        counter["failed"] += sum(case.find(kind) is not None for kind in ("failure", "error"))
        counter["skipped"] += case.find("skipped") is not None
        counter["seconds"] += round(float(case.attrib["time"]))
        for item in case.iter("property"):
            counter[item.attrib["name"]] += int(item.attrib["value"])
    return dict(found)


def table(found: Mapping[str, collections.Counter[str]]) -> str:
    """The counts as a table."""
    columns = ("tests", "failed", "skipped", *KINDS, "seconds")
    total: collections.Counter[str] = sum(found.values(), collections.Counter())
    rows = [(f"`{name}`", counter) for name, counter in sorted(found.items())] + [("all", total)]
    lines = [f"| file | {' | '.join(columns)} |", "| --- |" + " ---: |" * len(columns)]
    for name, counter in rows:
        cells = (str(counter[column]) if counter[column] or column not in KINDS else "" for column in columns)
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


@click.command()
@click.option("--out", type=click.Path(path_type=pathlib.Path, file_okay=False), default=atlas.DOCS, help="Folder.")
@click.option("--size", type=click.IntRange(1), default=FULL, show_default=True, help="Times the size in CI.")
@click.option("--no-atlas", is_flag=True, help="Leave the corners as they are.")
def main(out: pathlib.Path, size: int, no_atlas: bool) -> None:
    """Run it; where all passed, write OUT/stability.md."""
    started = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        report = pathlib.Path(folder) / "report.xml"
        code = run(bulk_tests(), size, report)
        if code != 0:
            raise click.ClickException(f"pytest ended with {code}; the page stays as it was")
        counts = table(tally(report))
    corners = {} if no_atlas else atlas.parts(out / atlas.FIGURE)
    left = atlas.CORNERS if no_atlas else ()
    page = fill(atlas.PAGE.read_text(encoding="utf-8"), {"counts": lambda: counts, **corners}, left)
    write_file(out / atlas.PAGE.name, page.encode(), make_folders=True)
    click.echo(f"{out / atlas.PAGE.name}; {time.perf_counter() - started:.0f} s")


if __name__ == "__main__":
    main()
