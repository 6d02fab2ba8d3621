"""The fidelity page: its tables parse, say what the code computes, and are not stale."""

import math
import re

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.optimize import brentq

from generate.pages import fidelity
from mbma_tables import Surface, contact, theories

DOCS = fidelity.DATA.parent
PICKED = "challenge"
LAST_DIGIT = 0.011  # three digits are printed, so one unit of the last is at most 1%


def tables(text):
    """All tables by heading, each a list of (header, rows)."""
    found, heading, block = {}, "", []
    for line in [*text.splitlines(), ""]:
        if line.startswith("#"):
            heading = line.lstrip("# ")
        if line.startswith("|"):
            block.append([cell.strip() for cell in line.strip("|").split("|")])
        elif block:
            found.setdefault(heading, []).append((block[0], block[2:]))
            block = []
    return found


def number(cell):
    return math.nan if cell.startswith("—") else float(cell.split()[0])


@pytest.fixture(scope="module")
def fresh(tmp_path_factory):
    folder = tmp_path_factory.mktemp("docs")
    arguments = ["--out", str(folder), "--sets", PICKED, "--no-figures"]
    result = CliRunner().invoke(fidelity.main, arguments, catch_exceptions=False)
    assert result.exit_code == 0
    assert [path.name for path in folder.iterdir()] == ["fidelity.md"]
    return tables((folder / "fidelity.md").read_text(encoding="utf-8"))


def test_tables_are_rectangular_and_name_every_theory(fresh):
    ((header, rows),) = fresh["What the paper quotes"]
    assert header == ["case", "what", "paper", *fidelity.THEORIES]
    assert {"concrete", "asphalt", *fresh}
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
    ((header, rows),) = fresh["What the paper quotes"]
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
    reference = fidelity.REFERENCES[PICKED]
    header, rows = fresh[reference.title][0]
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
    force, area = fidelity.solve(surface, theory, kind, wanted)
    assert {"force": force, "area": area}[kind] == pytest.approx(wanted, rel=1e-6)


def test_loads_beyond_a_theory_are_left_open():
    surface = Surface.named("yang-persson")
    assert np.isnan(fidelity.solve(surface, "MBMA printed", "force", 1.0)).all()
    assert np.isnan(fidelity.force_at(surface, "Persson full", 0.0))
    assert fidelity.force_at(surface, "MBMA reported", 3.5) == 0
    expected = theories.persson_force(surface, 0.0, method="simplified")
    assert fidelity.force_at(surface, "Persson simplified", 0.0) == expected


def test_committed_page_is_what_the_code_computes(fresh):
    committed = tables((DOCS / "fidelity.md").read_text(encoding="utf-8"))
    assert {reference.title for reference in fidelity.REFERENCES.values()} <= set(committed)
    for heading, blocks in fresh.items():
        assert len(committed[heading]) == len(blocks)
        for (old_names, old_rows), (names, rows) in zip(committed[heading], blocks, strict=True):
            assert old_names == names
            assert len(old_rows) == len(rows)
            for old, new in zip(old_rows, rows, strict=True):
                for before, now in zip(old, new, strict=True):
                    if re.fullmatch(r"—|[\d.e+-]+( \(\S+\))?", now):
                        expected = pytest.approx(number(now), rel=LAST_DIGIT, nan_ok=True)
                        assert number(before) == expected, (heading, old, new)
                    else:
                        assert before == now


def test_committed_figures_are_the_ones_that_the_page_shows():
    page = (DOCS / "fidelity.md").read_text(encoding="utf-8")
    shown = re.findall(r"\(figures/(\w+\.png)\)", page)
    assert set(shown) == {f"{name}.png" for name in (*fidelity.CAPTIONS, "reference")}
    for name in shown:
        content = (DOCS / "figures" / name).read_bytes()
        assert content.startswith(b"\x89PNG")
        assert len(content) < 100_000
