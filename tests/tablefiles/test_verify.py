"""`verify`: hashes, conformance points replayed, and the exact solver at some of them."""

import dataclasses

import numpy as np
import pytest
from small_tables import POINTS, small_table

from mbma_tables.errors import TableFileError
from mbma_tables.islands import greenwood_tripp
from mbma_tables.models.verify import verify
from mbma_tables.tablefiles import netcdf as files
from mbma_tables.tablefiles.netcdf import write_table
from mbma_tables.tablefiles.schema import ISLAND4D, KINDS, UNIVERSAL


def with_points(kind, **changes):
    content = small_table(kind)
    points = {name: values.copy() for name, values in content.conformance.items()}
    for name, change in changes.items():
        points[name] = change(points[name])
    return dataclasses.replace(content, conformance=points)


@pytest.fixture(params=KINDS)
def path(request, tmp_path):
    return write_table(tmp_path / f"{request.param}.nc", small_table(request.param))


def test_a_sound_table(path):
    verdict = verify(path, path.stem)
    assert (verdict.path, verdict.kind) == (str(path), path.stem)
    assert verdict.conformance_error < 1e-11
    assert verdict.resolved == 0
    assert not verdict.identical
    assert verdict.stale is None


@pytest.mark.parametrize("count", [1, 5, POINTS, 10 * POINTS])
def test_points_solved_anew(path, count, monkeypatch):
    asked = []
    solve = greenwood_tripp.solve

    def counted(X, mu, rtol):
        asked.extend(zip(X, mu, strict=True))
        assert rtol == greenwood_tripp.TIGHTEST
        return solve(X, mu, rtol=rtol)

    monkeypatch.setattr(greenwood_tripp, "solve", counted)
    verdict = verify(path, resolve=count)
    assert verdict.resolved == min(count, POINTS) == len(set(asked))
    # the points were made by this solver a moment ago
    assert verdict.identical
    assert verdict.resolved_error == 0


@pytest.mark.parametrize("name", ["table_F", "table_A"])
@pytest.mark.parametrize("kind", KINDS)
def test_an_answer_that_is_not_the_tables(kind, name, tmp_path):
    tolerance = small_table(kind).conformance["tolerance"][7]

    def beyond(factor):
        return lambda v: np.where(np.arange(POINTS) == 7, v * (1 + factor * tolerance), v)

    verify(write_table(tmp_path / "a.nc", with_points(kind, **{name: beyond(0.9)})))
    write_table(tmp_path / "a.nc", with_points(kind, **{name: beyond(1.2)}))
    with pytest.raises(TableFileError, match=rf"a\.nc: its own answers differ .*`python -m generate {kind}`"):
        verify(tmp_path / "a.nc")


@pytest.mark.parametrize("name", ["exact_F", "exact_A"])
@pytest.mark.parametrize("kind", KINDS)
def test_an_answer_that_is_not_the_solvers(kind, name, tmp_path):
    path = write_table(tmp_path / "a.nc", with_points(kind, **{name: lambda v: v * (1 + 1e-6)}))
    verify(path)
    for count in (1, POINTS):
        with pytest.raises(TableFileError, match=r"a\.nc: the exact solver's answers differ .* by 1\.0e-06 where"):
            verify(path, resolve=count)


def test_answers_that_are_no_numbers(tmp_path):
    for change in (lambda v: v * np.nan, lambda v: np.where(np.arange(POINTS) == 3, np.nan, v)):
        path = write_table(tmp_path / "a.nc", with_points(UNIVERSAL, table_F=change))
        with pytest.raises(TableFileError, match="its own answers differ"):
            verify(path)


def test_another_spline_is_found_out(tmp_path):
    content = small_table(ISLAND4D)
    path = write_table(tmp_path / "a.nc", dataclasses.replace(content, coefficients=content.coefficients + 1e-7))
    with pytest.raises(TableFileError, match="its own answers differ"):
        verify(path)


def test_a_stale_table_is_verified_all_the_same(path, monkeypatch):
    monkeypatch.setattr(files.provenance, "physics_digest", lambda modules: "0" * 64)
    verdict = verify(path, resolve=2)
    assert f"`python -m generate {path.stem}` makes it anew" in verdict.stale
    assert str(path) in verdict.stale
    assert verdict.identical


def test_the_wrong_kind_and_damage(path):
    other = next(kind for kind in KINDS if kind != path.stem)
    with pytest.raises(TableFileError, match=f"not {other}"):
        verify(path, other)
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(TableFileError, match="cut short"):
        verify(path)
