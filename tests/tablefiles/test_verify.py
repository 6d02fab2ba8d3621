"""`verify`: the stored conformance points against the table's own answers and those of the exact solver."""

import dataclasses

import numpy as np
import pytest
from small_tables import small_table

from generate.tables.writing import write_table
from mbma_tables.common.errors import TableFileError
from mbma_tables.islands import greenwood_tripp
from mbma_tables.models.tables import verify
from mbma_tables.tablefiles.schema import ISLAND4D, KINDS, UNIVERSAL

POINTS = 64


def with_points(kind, **changes):
    content = small_table(kind)
    points = {name: values.copy() for name, values in content.conformance.items()}
    for name, change in changes.items():
        points[name] = change(points[name])
    return dataclasses.replace(content, conformance=points)


@pytest.fixture(params=KINDS)
def path(request, table_files):
    return table_files[request.param]


def test_a_sound_table(path):
    verdict = verify(path, path.stem)
    assert (verdict.path, verdict.kind, verdict.points) == (str(path), path.stem, POINTS)
    assert 0 <= verdict.table_error < 1e-11
    # the points were made by this solver a moment ago
    assert verdict.solver_error == 0


def test_the_difference_of_another_solver_is_measured(path, monkeypatch):
    solve = greenwood_tripp.solve

    def nearby(X, mu, rtol):
        found = solve(X, mu, rtol=rtol)
        return dataclasses.replace(found, phi_F=found.phi_F * (1 + 2e-12))

    monkeypatch.setattr(greenwood_tripp, "solve", nearby)
    assert verify(path).solver_error == pytest.approx(2e-12, rel=1e-3, abs=0)


@pytest.mark.parametrize(
    ("name", "who"),
    [("table_F", "the table"), ("table_A", "the table"), ("exact_F", "exact solver"), ("exact_A", "exact solver")],
)
@pytest.mark.parametrize("kind", KINDS)
def test_an_answer_beyond_its_tolerance_is_refused(kind, name, who, tmp_path):
    tolerance = small_table(kind).conformance["tolerance"][7]

    def beyond(factor):
        return lambda v: np.where(np.arange(POINTS) == 7, v * (1 + factor * tolerance), v)

    verify(write_table(tmp_path / "a.nc", with_points(kind, **{name: beyond(0.9)})))
    write_table(tmp_path / "a.nc", with_points(kind, **{name: beyond(1.2)}))
    with pytest.raises(TableFileError, match=rf"a\.nc: the answers of .*{who} .*`python -m generate tables {kind}`"):
        verify(tmp_path / "a.nc")


@pytest.mark.parametrize(
    ("kind", "changes"),
    [
        (UNIVERSAL, {"mu": lambda v: -v}),
        (UNIVERSAL, {"X": lambda v: v + 100}),
        (ISLAND4D, {"zeta_d": lambda v: 0 * v}),
        (ISLAND4D, {"zeta_u": lambda v: 1e9 * v}),
    ],
)
def test_points_outside_the_axes_are_refused(kind, changes, tmp_path):
    path = write_table(tmp_path / "a.nc", with_points(kind, **changes))
    with pytest.raises(TableFileError, match="conformance points cannot be answered"):
        verify(path)


def test_another_spline_is_found_out(tmp_path):
    content = small_table(ISLAND4D)
    path = write_table(tmp_path / "a.nc", dataclasses.replace(content, coefficients=content.coefficients + 1e-7))
    with pytest.raises(TableFileError, match="the answers of the table differ"):
        verify(path)
