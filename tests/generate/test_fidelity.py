"""The fidelity page says what the code computes."""

import re

import pytest

from generate import distances
from generate.files import ROOT
from generate.pages import simulations

PICKED = ("bem", "gfmd", "gfmd 3", "challenge", "rolloff", *distances.MEASURED)  # data sets of few surfaces
NUMBER = r"\d[\d.e+-]*"


def test_committed_page_is_what_the_code_computes():
    sets, page = distances.data_sets(), (ROOT / "docs" / "fidelity.md").read_text("utf-8")
    committed = {line.split(" | ")[0]: line for line in reversed(page.splitlines())}  # the first table
    for line in simulations.summary_table(sets[name] for name in PICKED).splitlines():
        before = committed[line.split(" | ")[0]]
        assert re.sub(NUMBER, "", before) == re.sub(NUMBER, "", line)
        found, expected = (list(map(float, re.findall(NUMBER, one))) for one in (before, line))
        assert found == pytest.approx(expected, rel=0.06), line  # two digits are printed
