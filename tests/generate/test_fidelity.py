"""The fidelity page: its tables parse, say what the code computes, and are not stale."""

import dataclasses
import math
import re

import numpy as np
import pytest
from scipy.optimize import brentq

from generate.pages import comparisons, fidelity
from generate.pages.fidelity_figures import ROADS
from generate.pages.page import MARKED, ROOT
from mbma_tables import Surface, contact, theories

PAGE = (ROOT / "docs" / "fidelity.md").read_text(encoding="utf-8")
PARTS = {match[2]: match[0] for match in MARKED.finditer(PAGE)}
PICKED = "challenge"
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
    """Measured parts, of one data set only."""
    parts = {"quoted": fidelity.quoted_table()} | {name: fidelity.kappa_table(name) for name in ROADS}
    parts[PICKED] = fidelity.reference_tables(comparisons.REFERENCES[PICKED])
    return {name: tables(text) for name, text in parts.items()}


def test_tables_are_rectangular_and_name_every_theory(fresh):
    ((header, rows),) = fresh["quoted"]
    assert header == ["case", "what", "paper", *comparisons.THEORIES]
    for blocks in fresh.values():
        for names, lines in blocks:
            assert lines
            assert all(len(line) == len(names) for line in lines)
    # each quoted number stands beside a computed one, its ratio in brackets
    quoted = [row for row in rows if re.fullmatch(r"[\d.e+-]+", row[2])]
    assert len(quoted) >= 12
    for row in quoted:
        bracketed = [cell for cell in row[3:] if "(" in cell]
        assert bracketed, row
        for cell in bracketed:
            value, ratio = re.fullmatch(r"(\S+) \((\S+)\)", cell).groups()
            assert float(value) / float(row[2]) == pytest.approx(float(ratio), rel=0.06)


def test_quoted_rows_equal_the_library(fresh):
    ((header, rows),) = fresh["quoted"]
    surface = Surface.named("yang-persson")
    cells = {(row[0], row[1]): dict(zip(header, row, strict=True)) for row in rows}
    row = cells["yang-persson", "F/(A0 E*), u = 2.5 h_rms: MBMA"]
    assert float(row["paper"]) == 2.2e-4
    for reading in ("reported", "printed"):
        force = contact(surface, 2.0 * surface.h_rms, reading=reading).force
        assert number(row[f"MBMA {reading}"]) == pytest.approx(force, rel=LAST_DIGIT)
    row = cells["yang-persson", "F/(A0 E*), u = 3 h_rms: Persson"]
    assert number(row["Persson simplified"]) == pytest.approx(3.64e-4, rel=LAST_DIGIT)
    assert number(row["MBMA reported"]) == 0


def test_areas_at_equal_force_equal_a_root_found_otherwise(fresh):
    reference = comparisons.REFERENCES[PICKED]
    header, rows = fresh[PICKED][0]
    surface = reference.surface()
    assert surface.rms_gradient == pytest.approx(reference.gradient, rel=1e-14)
    force, area = reference.column("force"), reference.column("area")
    assert [float(row[0]) for row in rows] == pytest.approx(force)
    for load, brute, row in zip(force, area, rows, strict=True):
        cells = dict(zip(header, row, strict=True))

        def excess(d, load=load):
            return math.log(contact(surface, d, rtol=1e-8).force / load)

        gap = brentq(excess, -surface.h_max, 0.9 * surface.h_max, xtol=1e-9)
        found = contact(surface, gap, rtol=1e-8)
        assert number(cells["MBMA reported"]) == pytest.approx(found.area / brute, rel=LAST_DIGIT)
        persson = math.erf(load / math.sqrt(surface.m2)) / brute
        assert number(cells["Persson"]) == pytest.approx(persson, rel=LAST_DIGIT)


@pytest.mark.parametrize("theory", ["MBMA reported", "MBMA printed", "G-W", "Persson"])
@pytest.mark.parametrize("kind", ["force", "area"])
def test_solutions_have_the_wanted_value(theory, kind):
    surface = Surface.named("yang-persson")
    wanted = np.array([3e-4, 2e-3, 9e-3])
    force, area = comparisons.solve(surface, theory, kind, wanted)
    assert {"force": force, "area": area}[kind] == pytest.approx(wanted, rel=1e-6)


def test_loads_beyond_a_theory_are_left_open():
    surface = Surface.named("yang-persson")
    assert np.isnan(comparisons.solve(surface, "MBMA printed", "force", 1.0)).all()
    assert np.isnan(comparisons.force_at(surface, "Persson full", 0.0))
    assert comparisons.force_at(surface, "MBMA reported", 3.5) == 0
    expected = theories.persson_force(surface, 0.0, method="simplified")
    assert comparisons.force_at(surface, "Persson simplified", 0.0) == expected


def test_committed_page_is_what_the_code_computes(fresh):
    assert set(PARTS) == {"quoted", *ROADS, *comparisons.REFERENCES}
    for name, blocks in fresh.items():
        for (old_names, old_rows), (names, rows) in zip(tables(PARTS[name]), blocks, strict=True):
            assert old_names == names
            for old, new in zip(old_rows, rows, strict=True):
                for before, now in zip(old, new, strict=True):
                    if re.fullmatch(r"—|[\d.e+-]+( \(\S+\))?", now):
                        expected = pytest.approx(number(now), rel=LAST_DIGIT, nan_ok=True)
                        assert number(before) == expected, (name, old, new)
                    else:
                        assert before == now


def test_committed_figures_are_there():
    shown = re.findall(r"\((figures/\w+\.png)\)", PAGE)
    assert len(shown) == 8
    for name in shown:
        content = (ROOT / "docs" / name).read_bytes()
        assert content.startswith(b"\x89PNG")
        assert len(content) < 100_000


def test_a_band_of_areas_without_data_has_no_span():
    reference = dataclasses.replace(comparisons.REFERENCES["challenge"], band=(1e-9, 2e-9))
    for own, dashes in ((reference, True), (comparisons.REFERENCES["challenge"], False)):
        assert ("| — | — | — | — |" in fidelity.reference_tables(own)) == dashes
