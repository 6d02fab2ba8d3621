"""The fidelity page says what the code computes."""

import re

import numpy as np
import pytest

from generate import distances
from generate.files import ROOT
from generate.pages import fidelity
from generate.pages.page import MARKED
from mbma_tables import Surface, theories

PICKED = ("bem", "gfmd", "gfmd 3", "challenge", "rolloff", *distances.MEASURED)  # data sets of few surfaces
LAST_DIGIT = {"quoted": 0.011, "summary": 0.06}  # three digits are printed, and two where a distance is told
NUMBER = r"\d[\d.e+-]*"


def test_separations_beyond_a_theory_are_left_open():
    surface = Surface.named("yang-persson")
    assert np.isnan(fidelity.force_at(surface, "Persson", 0.0))
    assert fidelity.force_at(surface, "MBMA reported", 3.5) == 0
    expected = theories.Persson("simplified").answer(surface, 0.0).pressure
    assert fidelity.force_at(surface, "Persson simplified", 0.0) == expected
    # by Persson's theory A = erf(sqrt(2) F/g), nearly linear at light load
    kappa = fidelity.kappa(surface, 1e-4)
    assert kappa["Persson"] == kappa["Persson simplified"] == pytest.approx(np.sqrt(8 / np.pi), rel=1e-6)


def test_committed_page_is_what_the_code_computes():
    sets = distances.data_sets()
    fresh = {"summary": fidelity.summary_table(sets[name] for name in PICKED), "quoted": fidelity.quoted_table()}
    parts = {match[2]: match[0] for match in MARKED.finditer((ROOT / "docs" / "fidelity.md").read_text("utf-8"))}
    assert set(parts) == set(fresh)
    for name, text in fresh.items():
        named = 2 if name == "quoted" else 1  # first cells of a row
        committed = {tuple(line.split(" | ")[:named]): line for line in parts[name].splitlines()}
        for line in text.splitlines():
            before = committed[tuple(line.split(" | ")[:named])]
            assert re.sub(NUMBER, "", before) == re.sub(NUMBER, "", line)
            found, expected = (list(map(float, re.findall(NUMBER, one))) for one in (before, line))
            assert found == pytest.approx(expected, rel=LAST_DIGIT[name]), line


@pytest.mark.slow
def test_every_figure_of_the_page_is_drawn():
    shown = re.findall(r"figures/(\w+)\.svg", (ROOT / "docs" / "fidelity.md").read_text(encoding="utf-8"))
    assert {*fidelity.drawn(), "paper"} == set(shown)
