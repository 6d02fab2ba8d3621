"""The page on the tables: its measured parts are what the shipped files hold, its names exist."""

import re

import click
import netCDF4
import pytest

from generate.pages import tables as table_page
from generate.pages.page import MARKED, ROOT, fill
from mbma_tables.models.tables import shipped
from mbma_tables.tablefiles.schema import FORMAT_VERSIONS, KINDS

PAGE = (ROOT / "docs" / "tables.md").read_text(encoding="utf-8")
PARTS = {match[2]: match[0] for match in MARKED.finditer(PAGE)}


def rows(text):
    """Body rows of the only table in a text."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


@pytest.mark.parametrize("part", ["sizes", "cells", "axes", "universal", "island4d"])
def test_measured_parts_are_what_the_files_hold(part):
    fresh = getattr(table_page, f"example_{part}" if part in KINDS else part)()
    assert fresh in PARTS[part], "python -m generate pages tables"


@pytest.mark.parametrize("kind", KINDS)
def test_worked_example_meets_the_stored_answers(kind):
    shown = dict(rows(PARTS[kind]))
    stored = [float(x) for x in shown["stored table_F, table_A"].split(", ")]
    phi = [float(next(v for k, v in shown.items() if k.startswith(f"Phi_{f}"))) for f in "FA"]
    scales = [float(next((v for k, v in shown.items() if k.startswith(f"{f}_hat")), "1")) for f in "FA"]
    for found, scale, wanted in zip(phi, scales, stored, strict=True):
        # thirteen digits are printed of each factor
        assert found * scale == pytest.approx(wanted, rel=3e-12, abs=0)


def test_marks_that_do_not_fit_are_refused():
    with pytest.raises(click.ClickException, match="marks"):
        fill("<!-- measured: nothing -->\n<!-- end -->", {"sizes": ""})


def test_page_names_what_files_hold():
    names = set()
    for kind in KINDS:
        with netCDF4.Dataset(shipped(kind)) as dataset:
            names |= set(dataset.ncattrs()) | set(dataset.variables)
            names |= {n for variable in dataset.variables.values() for n in variable.ncattrs()}
    # f stands for F or A
    words = re.findall(r"`([a-z]+[0-9]*(?:_[a-zA-Z0-9]+)+)`", PAGE)
    quoted = {re.sub(r"_f(?=_|$)", "_F", word) for word in words}
    # words of the library, of formulas and of the surface, not of a file
    quoted -= {"mbma_tables", "zeta_d", "zeta_1", "h_d", "g_F", "g_A"}
    assert len(quoted) > 15
    assert quoted <= names
    for kind, version in FORMAT_VERSIONS.items():
        assert f"{version} of `{kind}.nc`" in PAGE
