"""The programs that write pages: what they draw is what the library computes, and nothing else of a page changes."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from click.testing import CliRunner

from generate.__main__ import main
from generate.pages import distances, fidelity_figures, maps
from generate.pages import export as export_page
from generate.pages import tables as table_page
from generate.pages import theories as theories_page
from generate.pages.gallery import ratios
from generate.pages.page import MARKED, ROOT
from generate.tables import height_coefficients
from mbma_tables import InputError, Surface, contact, theories
from mbma_tables.export.law_rows import describe_law
from mbma_tables.files import shipped_file
from mbma_tables.islands import height_integrals

DATA = ROOT / "docs" / "data"
PNG = b"\x89PNG"


def run(command, *arguments):
    done = CliRunner().invoke(command, list(map(str, arguments)), catch_exceptions=False)
    assert done.exit_code == 0
    return done.output


@pytest.mark.parametrize("what", [[], ["tables"], ["formulas"], ["pages"]])
def test_every_command_has_help(what):
    assert run(main, *what, "--help").startswith(f"Usage: main {' '.join(what)}".rstrip())


def test_ratios_of_a_theory_to_itself_are_one():
    surface = Surface(hurst=0.8, q0=0.01, q1=0.5, h_rms=1.0, h_max=3.0)
    u = np.array([1.2, 2.0, 2.5])
    found = contact(surface, mean_separation=u, theory="persson")
    area, force = ratios(theories.Persson(), surface, found.force, 2 * found.area, u)
    np.testing.assert_allclose(area, 0.5, rtol=1e-3)
    np.testing.assert_allclose(force, 1.0, rtol=1e-9)
    assert np.isnan(ratios(theories.Persson(), surface, np.array([1e3]), np.array([1.0]), u[:1])[0])


def test_shapes_are_told_with_extremes_and_validity():
    surface = Surface.from_map(np.random.default_rng(1).normal(size=(32, 32)), 1e3, periodic=True)
    u = 0.5 * surface.h_max * np.ones(2)
    found = contact(surface, mean_separation=u, theory="calibrated")
    rows = np.stack([found.force, np.full(2, 0.05), u])
    area, force, valid = maps.summary([("one", surface, rows)])[3:]
    assert force == "1.00 (1.00 to 1.00)"
    assert area.startswith(f"{found.area[0] / 0.05:.2f} (")
    assert valid in ("0%", "100%")


def test_a_page_is_written_with_its_figures(tmp_path, monkeypatch):
    monkeypatch.setattr("generate.pages.stability.measure", lambda: ({"corners": "of corners"}, {"docs/a/b.png": PNG}))
    place = tmp_path / "docs"
    assert run(main, "pages", "stability", "--out", tmp_path).split() == [
        str(place / "stability.md"),
        str(place / "a" / "b.png"),
    ]
    text = (place / "stability.md").read_text(encoding="utf-8")
    (match,) = MARKED.finditer(text)
    assert match[0] == f"{match[1]}\nof corners\n\n{match[3]}"
    assert MARKED.sub("", text) == MARKED.sub("", (ROOT / "docs" / "stability.md").read_text(encoding="utf-8"))
    assert (place / "a" / "b.png").read_bytes() == PNG


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (ModuleNotFoundError("No module named 'mpmath'"), "No module named 'mpmath'; install the extra: pip install"),
        (InputError("no such\nthing"), "no such thing"),
    ],
)
def test_errors_are_one_line(fault, said, monkeypatch):
    def fail():
        raise fault

    monkeypatch.setattr("generate.pages.stability.measure", fail)
    done = CliRunner().invoke(main, ["pages", "stability"])
    assert done.exit_code == 2
    assert done.stderr.startswith(f"generate: {said}")
    assert len(done.stderr.splitlines()) == 1


def test_the_page_of_theories_lists_them_all():
    text = (ROOT / "docs" / "theories.md").read_text(encoding="utf-8")
    for name in theories.THEORIES:
        assert f"\n| `{name}`" in text
    parts, files = theories_page.measure()
    assert f"<!-- measured: answers -->\n\n{parts['answers']}\n\n<!-- end -->" in text
    assert files["docs/figures/theories.png"].startswith(PNG[:8])


@pytest.mark.slow
def test_the_export_page(monkeypatch):
    monkeypatch.setattr(export_page, "NAMES", ("asphalt",))
    monkeypatch.setattr(export_page, "ROWS", (10, 40))
    parts, files = export_page.measure()
    found = re.findall(r"\| asphalt \| (\d+) \| (\S+) \| (\S+) \| (\S+) \|", parts["errors"])
    assert [int(count) for count, *_ in found] == [10, 40]
    road = Surface.named("asphalt")
    for count, *numbers in found:
        chosen, even = (
            describe_law(road, 13.3, length_unit="mm", stress_unit="MPa", rows=int(count), evenly=evenly).largest_error
            for evenly in (False, True)
        )
        # two digits are printed
        assert list(map(float, numbers)) == pytest.approx([chosen, even, even / chosen], rel=0.06, abs=0)
    (figure,) = files.values()
    assert figure.startswith(PNG)


@pytest.fixture(scope="module")
def drawn():
    """The fidelity figures by name, as matplotlib holds them."""
    yield dict(fidelity_figures.drawn())
    fidelity_figures.pyplot().close("all")


def curve(axes, label):
    (line,) = (line for line in axes.lines if line.get_label() == label)
    return line.get_xdata(), line.get_ydata()


@pytest.mark.slow
def test_every_figure_of_the_fidelity_page(drawn):
    shown = re.findall(r"figures/(\w+)\.png", (ROOT / "docs" / "fidelity.md").read_text(encoding="utf-8"))
    assert set(drawn) == set(shown)


@pytest.mark.slow
def test_curves_are_the_librarys(drawn):
    surface = Surface.named("concrete")
    axes = drawn["fig13"].axes[0]
    assert axes.get_title() == "concrete"
    for reading in ("reported", "printed"):
        ratio, force = curve(axes, f"MBMA {reading}")
        gap = 2 * ratio * surface.h_rms - surface.h_max
        found = contact(surface, gap, reading=reading, rtol=1e-8).force
        assert force == pytest.approx(found, rel=1e-5, abs=0)
    ratio, force = curve(axes, "Persson simplified")
    assert force == pytest.approx(theories.Persson("simplified").answer(surface, ratio * surface.h_rms).force, rel=1e-9)
    # area against force
    force, area = curve(drawn["fig14"].axes[0], "Persson")
    assert area == pytest.approx(theories.Persson().area_at(surface, force), rel=1e-12, abs=0)


@pytest.mark.slow
def test_points_are_the_published_ones(drawn):
    data, surface = np.loadtxt(DATA / "challenge.csv", delimiter=",", skiprows=4, usecols=(0, 1, 2)), "challenge"
    place, force = curve(drawn["fig15"].axes[0], "boundary elements")
    assert place == pytest.approx(data[:, 2], rel=1e-15, abs=0)
    # of rms gradient 1
    assert force == pytest.approx(data[:, 0] * Surface.named(surface).rms_gradient, rel=1e-14, abs=0)


@pytest.mark.slow
def test_ratios_to_the_references(drawn):
    one = distances.older("bem")
    area, ratio = curve(drawn["reference"].axes[0], "Persson")
    assert area == pytest.approx(one.area, rel=1e-15, abs=0)
    assert ratio == pytest.approx([math.erf(math.sqrt(2) * f) / a for f, a in zip(one.force, one.area, strict=True)])
    # on a measured map with its curves at hand the law is nearer than without
    maps = drawn["maps"].axes[0]
    near, far = (np.abs(np.log(curve(maps, name)[1])).mean() for name in ("calibrated, map", "Persson"))
    assert near < far


@pytest.mark.slow
def test_the_page_on_tables():
    parts, files = table_page.measure()
    assert set(parts) == {"sizes", "cells", "axes", "universal", "island4d"}
    assert [content[:4] for content in files.values()] == [PNG]


def test_pieces_of_a_height_integral_are_the_shipped_ones():
    import mpmath

    with mpmath.workdps(height_coefficients.DIGITS):
        found = [[float(value) for value in row] for row in height_coefficients.pieces(2)]
    np.testing.assert_array_equal(found, height_integrals._ONE)


def test_the_file_of_coefficients_is_written_as_it_is(tmp_path, monkeypatch):
    target = tmp_path / "made.csv"
    monkeypatch.setattr(height_coefficients, "TARGET", target)
    shipped = np.loadtxt(shipped_file("height_coefficients.csv"), delimiter=",").reshape(5, 8, 19)
    monkeypatch.setattr(height_coefficients, "pieces", lambda twice: shipped[twice - 1])
    height_coefficients.main()
    assert target.read_bytes() == shipped_file("height_coefficients.csv").read_bytes()
