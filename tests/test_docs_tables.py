"""The page on the tables: its measured parts are what the code and the shipped files give, its names exist."""

import math
import pathlib
import re
import warnings

import click
import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from generate.pages import tables as table_page
from generate.pages.page import MARKED, ROOT, fill
from generate.tables import schemes as table_schemes
from mbma_tables.models.tables import shipped
from mbma_tables.tablefiles.schema import FORMAT_VERSION, ISLAND4D, KINDS, UNIVERSAL
from mbma_tables.tablefiles.splines import coefficients

PAGE = (ROOT / "docs" / "tables.md").read_text(encoding="utf-8")
PARTS = {match[2]: match[0] for match in MARKED.finditer(PAGE)}


def rows(text):
    """Body rows of the only table in a text."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


@pytest.fixture
def tables():
    """The shipped tables; a stale one is another test's matter."""
    missing = [kind for kind in KINDS if not shipped(kind).exists()]
    if missing:
        pytest.skip(f"not made yet: {missing}; python -m generate tables all")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


@pytest.mark.usefixtures("tables")
@pytest.mark.parametrize("part", ["sizes", "axes", "universal", "island4d"])
def test_measured_part_is_not_stale(part):
    fresh = {
        "sizes": table_page.sizes,
        "axes": table_page.axes,
        "universal": table_page.example_universal,
        "island4d": table_page.example_island4d,
    }[part]()
    assert fresh in PARTS[part], "python -m generate pages tables"


@pytest.mark.usefixtures("tables")
@pytest.mark.parametrize("kind", [UNIVERSAL, ISLAND4D])
def test_worked_example_meets_the_stored_answers(kind):
    shown = dict(rows(PARTS[kind]))
    stored = [float(x) for x in shown["stored table_F, table_A"].split(", ")]
    phi = [float(next(v for k, v in shown.items() if k.startswith(f"Phi_{f}"))) for f in "FA"]
    scales = [float(next((v for k, v in shown.items() if k.startswith(f"{f}_hat")), "1")) for f in "FA"]
    for found, scale, wanted in zip(phi, scales, stored, strict=True):
        # thirteen digits are printed of each factor
        assert found * scale == pytest.approx(wanted, rel=3e-12, abs=0)


@pytest.mark.slow
def test_comparison_is_what_the_code_measures():
    least, total = table_schemes.LEAST_SPREADS[0], table_schemes.SIZES[0]
    shown = {(r[0], r[1], r[2]): r[3:] for r in rows(PARTS["comparison"])}
    trial = table_schemes.rows_of(
        table_schemes.trial_grid(least),
        {"trial's axes, log F": False, "trial's axes, log ratio": True},
        least,
        total,
    )
    own = table_schemes.rows_of(table_schemes.own_grid(least), {"library's axes, log ratio": True}, least, total)
    for fresh in rows(table_page.comparison_table([*trial, *own])):
        assert shown[tuple(fresh[:3])] == fresh[3:]


def test_comparison_is_at_equal_size_and_says_so_of_every_scheme():
    found = {}
    for least, shape, scheme, *errors in rows(PARTS["comparison"]):
        nodes, factors = shape.split(" = ")
        assert math.prod(map(int, factors.split(" x "))) == int(nodes)
        found.setdefault(least, {}).setdefault(scheme, []).append((int(nodes), *map(float, errors)))
    for schemes in found.values():
        assert len(schemes) == 3
        for columns in zip(*schemes.values(), strict=True):
            sizes = [column[0] for column in columns]
            assert max(sizes) <= 1.05 * min(sizes)
    assert max(n for n, *_ in found["0.001"]["trial's axes, log ratio"]) == math.prod(table_schemes.TRIAL_SHAPE)


@pytest.mark.parametrize("degree", [3, 5])
def test_spline_of_the_comparison(degree):
    # one axis against scipy's, the other a plane that any spline reproduces
    x, y = np.arange(12.0), np.arange(8.0)
    values = np.sin(x)[:, None, None] * np.ones(8)[:, None] + y[:, None] * np.array([1.0, 2.0])
    coefs = coefficients(values, degree, 2)
    rng = np.random.default_rng(2)
    at = [rng.uniform(0, 11, 700), rng.uniform(0, 7, 700)]
    found = table_schemes.spline_at(coefs, at, degree)
    wanted = make_interp_spline(x, np.sin(x), k=degree)(at[0])[:, None] + at[1][:, None] * np.array([1.0, 2.0])
    assert np.abs(found - wanted).max() < 1e-12


@pytest.mark.parametrize("grid", [table_schemes.trial_grid, table_schemes.own_grid])
def test_grid_goes_there_and_back(grid):
    made = grid(1e-3)
    raw, _ = table_schemes.held_out(1e-3)
    back = made.from_own(*made.to_own(*raw))
    for found, wanted in zip(back, raw, strict=True):
        assert found == pytest.approx(wanted, rel=1e-9, abs=0)
    for axis, place in zip(made.axes, made.to_own(*raw), strict=True):
        assert (place >= axis.low * (1 - 1e-12)).all()
        assert (place <= axis.high * (1 + 1e-12)).all()


def test_marks_that_do_not_fit_are_refused():
    with pytest.raises(click.ClickException, match="marks"):
        fill("<!-- measured: nothing -->\n<!-- end -->", {"sizes": ""})


def test_filling_keeps_the_rest_and_is_idempotent():
    blocks = {name: f"numbers of {name}" for name in PARTS}
    once = fill(PAGE, blocks)
    assert fill(once, blocks) == once
    assert MARKED.sub("", once) == MARKED.sub("", PAGE)


def test_figures_that_the_page_shows_exist():
    shown = re.findall(r"\]\((figures/[^)]+)\)", PAGE)
    assert len(shown) == 2
    for name in shown:
        content = (ROOT / "docs" / name).read_bytes()
        assert content.startswith(b"\x89PNG")


def test_page_names_what_files_hold(tables):
    import netCDF4

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
    assert f"format, {FORMAT_VERSION};" in PAGE


def test_page_names_no_folder_of_a_machine():
    assert str(pathlib.Path.home()) not in PAGE
    assert str(ROOT) not in PAGE
