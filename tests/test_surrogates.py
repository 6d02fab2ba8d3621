"""`python -m benchmarks surrogates`: errors, behaviour outside and the page, on what is fitted in a second."""

import re

import numpy as np
import pytest

from benchmarks import surrogates
from benchmarks.surrogates import (
    FIGURE,
    HELD_OUT,
    Surrogate,
    drawn,
    errors,
    grid_interpolator,
    measured_before,
    of_form,
    of_points,
    outside,
    random_islands,
    row_of,
    spline,
    text_of,
)
from generate import page
from generate.files import ROOT
from mbma_tables import greenwood_tripp, open_table


@pytest.fixture(scope="module")
def held_out():
    return random_islands(200, 5)


def test_islands_are_those_of_the_four_numbers(held_out):
    """Force by the four numbers is Phi_F by X and mu, scaled alike for all of one band."""
    found = open_table("island4d").lookup(*held_out.numbers)
    solved = greenwood_tripp.solve(held_out.X, held_out.mu, rtol=1e-10)
    np.testing.assert_allclose(held_out.exact[0], solved.phi_F)
    scale = found.F_hat / held_out.exact[0]
    deeper = random_islands(200, 5)
    deeper.X = 1.5 * held_out.X
    inside = deeper.X < 26
    more = open_table("island4d").lookup(*(n[inside] for n in deeper.numbers))
    exact = greenwood_tripp.solve(deeper.X[inside], deeper.mu[inside], rtol=1e-10)
    np.testing.assert_allclose(more.F_hat / exact.phi_F, scale[inside], rtol=1e-4)


def test_the_shipped_table_is_the_quintic_spline_of_scipy(held_out):
    by_scipy = of_points("quintic", "scipy", 1, lambda: spline(5))
    four = open_table("island4d")
    fields = {"X": held_out.X, "width": np.log1p(held_out.spread), "mu": held_out.mu}
    fields |= {
        "zeta_d": 1.25 * held_out.sphere ** (-1 / (4 - 2 * held_out.hurst)),
        "hurst": held_out.hurst,
    }
    own = Surrogate("own", "", 1, 0.0, 1, None, None, in_logarithms=False)
    own.answer = lambda _: four.of_islands(fields)[:2]
    # coefficients of single precision
    np.testing.assert_allclose(
        errors(own, held_out), errors(by_scipy, held_out), atol=1e-6
    )
    assert errors(by_scipy, held_out).max() < 2e-5


def test_rows_say_what_is_covered_and_what_happens_outside(held_out, monkeypatch):
    monkeypatch.setattr(surrogates, "SECONDS", 1e-3)
    linear = of_points("linear", "scipy", 1, lambda: grid_interpolator("linear"))
    form = of_form("pocket")
    assert outside(linear) == outside(form) == "raises an error"
    beyond = of_points("zero", "none", 1, lambda: (lambda p: np.zeros((len(p), 2)), 1))
    assert outside(beyond) == "answers"
    row = row_of(form, held_out)
    share = np.mean((held_out.X >= 0.8) & (held_out.X <= 25) & (held_out.mu <= 2000))
    assert row["answered"] == share < 1
    assert row["median"] < row["largest"] < 0.04
    assert 0 < row["many"] < row["one"] < 1
    table = text_of([row])
    assert "closed form, pocket | mbma_tables" in table
    assert table.count("\n") == 2


def test_the_page_is_written_by_the_command():
    text = (ROOT / "docs/tables.md").read_text(encoding="utf-8")
    assert f"{HELD_OUT:,} random" in text
    blocks = dict(
        re.findall(r"<!-- measured: (\w+) -->\n(.*?)<!-- end -->", text, re.DOTALL)
    )
    for name in ("universal, shipped", "island4d, shipped", "Gaussian process"):
        assert name in blocks["surrogates"]
    # no error of a million is above its bound
    assert blocks["bounds"].strip().splitlines()[-1].endswith("| 0 |")


def test_labels_of_the_figure_cover_nothing():
    """Each began beside its marker, seven of them across one another."""
    rows = measured_before()
    figure = drawn(rows)
    figure.draw_without_rendering()
    (axis,) = figure.axes
    assert sorted(text.get_text() for text in axis.texts) == sorted(
        row["name"] for row in rows
    )
    boxes = [text.get_window_extent() for text in axis.texts]
    markers = [line.get_window_extent() for line in axis.lines]
    for number, box in enumerate(boxes):
        assert not box.count_overlaps(boxes[:number])
        assert not box.count_overlaps(markers)
        assert axis.bbox.x0 < box.x0 < box.x1 < axis.bbox.x1
        assert axis.bbox.y0 < box.y0 < box.y1 < axis.bbox.y1


def test_the_figure_shows_the_table_of_the_page():
    picture = (ROOT / FIGURE).read_text(encoding="utf-8")
    for row in measured_before():
        # numbers of a picture are rounded
        assert f"<!-- {row['name'].split(' 0.')[0]}" in picture, row["name"]


@pytest.mark.parametrize("time", [1.8e-6, 5.5e-1, 3.2e-9, 140.0])
def test_times_of_a_page_are_read_again(time):
    assert page.seconds(page.duration(time)) == pytest.approx(time, rel=1e-12)
