"""Tests and modules that the documentation names are there."""

import pathlib
import re
import tomllib

import pytest

ROOT = pathlib.Path(__file__).parents[1]
PAGES = [*(ROOT / "docs").glob("*.md"), *ROOT.glob("*.md")]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_named_test_exists(page):
    named = set(re.findall(r"`(tests/[a-z0-9_/]+(?:\.py)?)`", page.read_text(encoding="utf-8")))
    assert [name for name in sorted(named) if not (ROOT / name).exists()] == []


def test_every_module_of_the_architecture_exists():
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    named = set(re.findall(r"\b[a-z]+/[a-z_0-9]+\.py", text))
    assert len(named) > 15
    assert [name for name in sorted(named) if not (ROOT / "mbma_tables" / name).exists()] == []
    path = re.findall(r"^\d\. `(\S+)`", text, re.MULTILINE)
    lines = [len((ROOT / "mbma_tables" / name).read_text(encoding="utf-8").splitlines()) for name in path]
    assert len(lines) == 7
    assert 900 < sum(lines) < 1100


def test_layers_are_those_of_the_import_contract():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    contract = [set(re.findall(r"\b[a-z]\w*", layer)) for layer in settings["contracts"][0]["layers"]]
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    cells = re.findall(r"^\| (`[a-z_]+`[^|]*) \|", text, re.MULTILINE)
    assert [set(re.findall(r"`(\w+)`", cell)) for cell in cells if ".py" not in cell][: len(contract)] == contract


def test_every_guarantee_names_its_test():
    text = (ROOT / "docs" / "guarantees.md").read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if line.startswith("| ") and not line.startswith(("| ---", "| promise"))]
    assert len(rows) > 15
    assert [row for row in rows if "`tests/" not in row] == []
