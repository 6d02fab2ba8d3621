"""The fidelity page: its tables parse, say what the code computes, and are not stale."""

import math
import re

import numpy as np
import pytest

from generate.pages import distances, fidelity
from generate.pages.page import MARKED, ROOT
from mbma_tables import Surface, theories

PAGE = (ROOT / "docs" / "fidelity.md").read_text(encoding="utf-8")
PARTS = {match[2]: match[0] for match in MARKED.finditer(PAGE)}
PICKED = ("bem", "gfmd", "challenge", "rolloff", *distances.MEASURED)  # data sets of few surfaces
LAST_DIGIT = 0.011  # three digits are printed, so one unit of the last is at most 1%


def tables(text):
    """All tables of a text, each a header and its rows."""
    found, block = [], []
    for line in [*text.splitlines(), ""]:
        if line.startswith("|"):
            block.append([cell.strip() for cell in line.strip("|").split("|")])
        elif block:
            found.append((block[0], block[2:]))
            block = []
    return found


def number(cell):
    return math.nan if cell.startswith("—") else float(cell.split()[0])


@pytest.fixture(scope="module")
def fresh():
    """Measured parts, the first of some data sets only."""
    sets = distances.data_sets()
    parts = {
        "summary": fidelity.summary_table([sets[name] for name in PICKED]),
        "challenge": fidelity.challenge_table(),
        "heights": fidelity.heights_table(),
        "quoted": fidelity.quoted_table(),
    }
    return {name: tables(text) for name, text in parts.items()}


def test_separations_beyond_a_theory_are_left_open():
    surface = Surface.named("yang-persson")
    assert np.isnan(fidelity.force_at(surface, "Persson full", 0.0))
    assert fidelity.force_at(surface, "MBMA reported", 3.5) == 0
    expected = theories.Persson("simplified").answer(surface, 0.0).pressure
    assert fidelity.force_at(surface, "Persson simplified", 0.0) == expected
    # by Persson's theory A = erf(sqrt(2) F/g), nearly linear at light load
    kappa = fidelity.kappa(surface, 1e-4)
    assert kappa["Persson full"] == kappa["Persson simplified"] == pytest.approx(np.sqrt(8 / np.pi), rel=1e-6)


def test_committed_page_is_what_the_code_computes(fresh):
    assert set(PARTS) == set(fresh)
    for name, blocks in fresh.items():
        for (old_names, old_rows), (names, rows) in zip(tables(PARTS[name]), blocks, strict=True):
            assert old_names == names
            old_by_title = {(old[0], old[1] if name != "summary" else ""): old for old in old_rows}
            for row in rows:
                old = old_by_title[row[0], row[1] if name != "summary" else ""]
                for before, now in zip(old, row, strict=True):
                    numbers = [re.findall(r"\d[\d.e+-]*", cell) for cell in (before, now)]
                    assert re.sub(r"\d[\d.e+-]*", "", before) == re.sub(r"\d[\d.e+-]*", "", now)
                    found, expected = ([float(text) for text in part] for part in numbers)
                    # two digits are printed where a distance is told
                    assert found == pytest.approx(expected, rel=LAST_DIGIT if name == "quoted" else 0.06), (name, row)
