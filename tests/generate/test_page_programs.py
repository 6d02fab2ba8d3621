"""The programs that write pages: what they draw is what the library computes; corners of parameters of its atlas."""

import math
import re

import numpy as np
import pytest
from click.testing import CliRunner

from generate import height_coefficients
from generate.__main__ import COMMANDS, main
from generate.files import ROOT
from generate.page import MARKED, fill, svg
from generate.pages import export, library, maps, simulations, stability
from mbma_tables import InputError, Surface, contact, theories
from mbma_tables.export.registry import targets

SVG = b"<?xml"
# corners of parameters
FEW = {
    "X_CORNERS": np.array([-40.0, -5.0, 0.0, 2.0, 30.0, 1e4]),
    "MU_CORNERS": np.array([0.0, 1e-300, 1e-16, 1e-6, 1.0, 1e5]),
    "APPROACHES": np.geomspace(1e-12, 30, 6),
    "BANDS": np.array([3.0000001, 30.0, 1e8]),
    "DEPTHS": (1e-12, 1e-3, 6.0),
    "TOTAL_BANDS": (3.0000001, 216.0, 1e6),
    "TOTAL_HURSTS": (0.1, 0.8, 1.0),
}


def run(command, *arguments):
    done = CliRunner().invoke(command, list(map(str, arguments)), catch_exceptions=False)
    assert done.exit_code == 0
    return done.output


@pytest.mark.parametrize("what", [[], ["pages"], *([name] for name in COMMANDS)])
def test_every_command_has_help(what):
    assert run(main, *what, "--help").startswith(f"Usage: main {' '.join(what)}".rstrip())


def test_every_command_of_the_docs_is_there():
    texts = [
        path.read_text("utf-8")
        for path in (ROOT / "CONTRIBUTING.md", *(ROOT / "docs").rglob("*.md"))
    ]
    named = {
        name for text in texts for name in re.findall(r"python -m generate (\w+)", text)
    }
    assert {"score", "tables"} < named <= {"pages", *COMMANDS}


def test_ratios_of_a_theory_to_itself_are_one():
    surface = Surface(hurst=0.8, q0=0.01, q1=0.5, h_rms=1.0, h_max=3.0)
    u = np.array([1.2, 2.0, 2.5])
    found = contact(surface, mean_separation=u, theory="persson")
    area, force = maps.ratios(
        theories.Persson(), surface, found.pressure, 2 * found.area, u
    )
    np.testing.assert_allclose(area, 0.5, rtol=1e-3)
    np.testing.assert_allclose(force, 1.0, rtol=1e-9)
    assert np.isnan(
        maps.ratios(theories.Persson(), surface, np.array([1e3]), np.array([1.0]), u[:1])[
            0
        ]
    )


def test_a_page_is_written_with_its_figures(tmp_path, monkeypatch):
    parts = {"corners": "of corners"}
    monkeypatch.setattr(
        "generate.pages.stability.measure", lambda: (parts, {"docs/a/b.svg": SVG})
    )
    place = tmp_path / "docs"
    assert run(main, "pages", "guarantees", "--out", tmp_path).split() == [
        str(place / "guarantees.md"),
        str(place / "a" / "b.svg"),
    ]
    text = (place / "guarantees.md").read_text(encoding="utf-8")
    before = (ROOT / "docs" / "guarantees.md").read_text(encoding="utf-8")
    written = {match[2]: match[0] for match in MARKED.finditer(text)}
    # another command writes the other block, which stays as it was
    kept = {match[2]: match[0] for match in MARKED.finditer(before)}
    assert written.pop("corners") == (
        "<!-- measured: corners -->\n\nof corners\n\n<!-- end -->"
    )
    del kept["corners"]
    assert written == kept != {}
    assert MARKED.sub("", text) == MARKED.sub("", before)
    assert (place / "a" / "b.svg").read_bytes() == SVG


def test_figures_are_small_drawings_each_shown_by_a_page():
    pages = [*(ROOT / "docs").rglob("*.md"), ROOT / "README.md"]
    shown = {
        name
        for page in pages
        for name in re.findall(
            r"\]\((?:docs/|\.\./)?figures/([^)]+)\)", page.read_text("utf-8")
        )
    }
    assert shown == {path.name for path in (ROOT / "docs" / "figures").iterdir()}
    # a photograph of the screen
    for name in shown - {"explorer.png"}:
        content = (ROOT / "docs" / "figures" / name).read_bytes()
        assert content.startswith(SVG)
        assert b"<text" not in content
        assert len(content) < 300_000


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (
            ModuleNotFoundError("No module named 'mpmath'"),
            "No module named 'mpmath'; install the extra: pip install",
        ),
        (InputError("no such\nthing"), "no such thing"),
    ],
)
def test_errors_are_one_line(fault, said, monkeypatch):
    def fail():
        raise fault

    monkeypatch.setattr("generate.pages.stability.measure", fail)
    done = CliRunner().invoke(main, ["pages", "guarantees"])
    assert done.exit_code == 2
    assert done.stderr.startswith(f"generate: {said}")
    assert len(done.stderr.splitlines()) == 1


def test_the_page_of_theories_lists_them_all():
    text = (ROOT / "docs" / "theories.md").read_text(encoding="utf-8")
    for name in theories.THEORIES:
        assert f"\n| `{name}`" in text
    assert fill(text, library.theories()[0]) == text


def test_coefficients_of_the_height_integrals_are_the_shipped_ones(monkeypatch, tmp_path):
    shipped = height_coefficients.TARGET.read_bytes()
    monkeypatch.setattr(height_coefficients, "TARGET", tmp_path / "again.h")
    height_coefficients.main()
    assert (tmp_path / "again.h").read_bytes() == shipped


@pytest.mark.slow
def test_corners_have_numbers_within_their_bounds_and_no_warning(monkeypatch):
    for name, value in FEW.items():
        monkeypatch.setattr(stability, name, value)
    found = stability.islands() | stability.island_geometry() | stability.totals()
    rows = {name: stability.row(name, outcomes)[1:] for name, outcomes in found.items()}
    # the comparison would show it if the formulas as printed were fine
    assert rows.pop("geometry, the paper's formulas as printed")[2] > 0
    for name, (tried, refused, not_finite, warned, _, beyond) in rows.items():
        assert not_finite == warned == beyond == 0, name
        assert refused < tried
    assert rows["geometry, library"][4] < 1e-13
    assert svg(stability.draw(found)).startswith(SVG)


def test_what_goes_wrong_is_counted():
    def refuse():
        raise InputError("no")

    answers = [
        lambda: ([1.0], 0.1),
        lambda: ([1.5], 0.1),
        lambda: ([math.nan], 0.1),
        lambda: ([1 / 0], 0.1),
        refuse,
    ]
    found = [stability.outcome(answer, [1.0]) for answer in answers]
    assert [one.error for one in found] == pytest.approx(
        [0.0, 0.5, math.nan, math.nan, math.nan], nan_ok=True
    )
    assert stability.row("some", found) == ["some", 5, 1, 2, 0, 0.5, 1]


def test_the_tables_of_targets_are_those_of_their_declarations():
    text = (ROOT / "docs/export.md").read_text(encoding="utf-8")
    parts, _ = export.formats()
    assert fill(text, parts) == text
    listed = "\n".join(parts.values())
    for name, target in targets().items():
        assert f"| `{name}` | {target.output} | " in listed
        assert target.output
        assert target.tested


@pytest.mark.slow
def test_the_front_of_the_tutorial_has_all_joints_that_no_other_one_beats(capsys):
    parts, files = simulations.design()
    (axes,) = files["docs/figures/design_front.svg"].axes
    *pairs, front = axes.lines
    assert [line.get_label() for line in (*pairs, front)] == [
        "stainless steel on itself",
        "titanium on itself",
        "stainless steel on titanium",
        "steel on aluminium",
        "front",
    ]
    stiffness, conductance = np.concatenate([line.get_data() for line in pairs], axis=1)
    is_stiffer = stiffness > stiffness[:, None]
    conducts_less = conductance < conductance[:, None]
    is_beaten = (is_stiffer & conducts_less).any(axis=1)
    expected = np.sort(stiffness[~is_beaten])
    np.testing.assert_array_equal(np.sort(front.get_xdata()), expected)
    time = float(re.search(r"10,000 candidates took (\S+) s", parts["time"])[1])
    assert 0 < time < 60
    assert f"{stiffness.size:,} valid candidates" in capsys.readouterr().out
