"""The exported Python reader: numpy alone, and answers as the runtime's."""

from __future__ import annotations

import importlib.util
import pathlib
import subprocess
import sys
from typing import Any

import code_points
import numpy as np
import pytest

from mbma_tables import Surface, contact
from mbma_tables.export.code import write_code
from mbma_tables.export.conformance import check
from mbma_tables.export.numbers import FORM
from mbma_tables.islands.geometry import FIELDS, fill_islands
from mbma_tables.models.closed_forms import FormulaModel
from mbma_tables.models.universal import universal_model
from mbma_tables.surfaces.readings import get_reading


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    place = tmp_path_factory.mktemp("python")
    write_code("python", place)
    return place


@pytest.fixture(scope="module")
def reader(folder: pathlib.Path) -> Any:
    spec = importlib.util.spec_from_file_location("mbma_reader", folder / "mbma_reader.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_needs_numpy_alone(folder: pathlib.Path) -> None:
    ask = (
        f"import sys; sys.path.insert(0, {str(folder)!r}); import mbma_reader; "
        "print([name for name in ('mbma_tables', 'numba', 'scipy', 'netCDF4', 'xarray') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-W", "error", "-c", ask], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_conformance_points(folder: pathlib.Path) -> None:
    found = check("python", folder)
    assert found.reason == ""
    fixed = {"phi": 64, "slopes": 64, "geometry": 24, "total": 12, "status": 10}
    assert found.points == fixed | {"formula": found.points["formula"]}
    assert found.points["formula"] > 5


def test_islands_equal_to_the_runtime(reader: Any) -> None:
    X, mu = code_points.random_islands()
    answer = universal_model().answer(X, mu)
    _, by_X, by_mu = universal_model().slopes(X, mu)
    phi_F, phi_A, error, status = reader.phi(X, mu)
    assert not status.any()
    np.testing.assert_allclose(phi_F, answer.phi_F, rtol=code_points.VALUES, atol=0)
    np.testing.assert_allclose(phi_A, answer.phi_A, rtol=code_points.VALUES, atol=0)
    np.testing.assert_array_equal(error, answer.error)
    *slopes, status = reader.phi_slopes(X, mu)
    expected = (by_X.phi_F, by_X.phi_A, by_mu.phi_F, by_mu.phi_A)
    natural = (phi_F / np.abs(X), phi_A / np.abs(X), phi_F / mu, phi_A / mu)
    for own, known, scale in zip(slopes, expected, natural, strict=True):
        assert (np.abs(own - known) / np.maximum(np.abs(known), scale)).max() <= code_points.SLOPES


def test_closed_form_equal_to_the_runtime(reader: Any) -> None:
    X, mu = code_points.random_formula_islands()
    answer = FormulaModel(FORM).answer(X, mu)
    phi_F, phi_A, error, status = reader.formula(X, mu)
    assert not status.any()
    np.testing.assert_allclose(phi_F, answer.phi_F, rtol=code_points.VALUES, atol=0)
    np.testing.assert_allclose(phi_A, answer.phi_A, rtol=code_points.VALUES, atol=0)
    np.testing.assert_array_equal(error, answer.error)
    assert reader.formula([26.0, 1.0], [1.0, 1e4])[3].tolist() == [reader.X_ABOVE, reader.MU_ABOVE]


def test_geometry_equal_to_the_runtime(reader: Any) -> None:
    approach, hurst, zeta_1 = code_points.random_approaches()
    known = np.empty((len(FIELDS), approach.size))
    fill_islands(approach, hurst, zeta_1, get_reading("reported").numbers, known)
    found = reader.island_geometry(approach, hurst, zeta_1)
    assert not found["status"].any()
    for name, values in zip(FIELDS, known, strict=True):
        np.testing.assert_allclose(found[name], values, rtol=code_points.GEOMETRY, atol=0, err_msg=name)


def test_totals_equal_to_the_runtime(reader: Any) -> None:
    # the runtime cancels a few roundings of top2 over p2 log 1.5 >= 0.004, twice in a node; the reader uses expm1
    for surface in code_points.random_surfaces()[:20]:
        gaps = surface[4] * np.array(code_points.GAPS)
        known = contact(Surface(*surface), gaps)
        found = [reader.total(reader.Surface(*surface), gap) for gap in gaps]
        np.testing.assert_allclose([answer[0] for answer in found], known.force, rtol=1e-12, atol=0)
        np.testing.assert_allclose([answer[1] for answer in found], known.area, rtol=1e-12, atol=0)
        assert {answer[3] for answer in found} == {reader.OK}


def test_slope_by_mu_is_finite_at_no_roughness(reader: Any) -> None:
    rigid, _, _, _ = reader.phi(2.0, 1e-12)
    _, _, by_mu, area_by_mu, status = reader.phi_slopes(2.0, 0.0)
    assert status == reader.OK
    # Phi_F is proportional to mu there, to first order
    assert float(by_mu) == pytest.approx(float(rigid) / 1e-12, rel=1e-9, abs=0)
    assert np.isfinite(area_by_mu)


def test_refusals(reader: Any) -> None:
    phi_F, _, _, status = reader.phi([np.nan, -7.0, 42.0, 1.0, 1.0], [1.0, 1.0, 1.0, 1e7, -1.0])
    assert status.tolist() == [reader.INVALID, reader.X_BELOW, reader.X_ABOVE, reader.MU_ABOVE, reader.INVALID]
    assert np.isnan(phi_F).all()
    assert reader.island_geometry([0.0, 1.0], [0.5, 1.2], 100.0)["status"].tolist() == [reader.INVALID] * 2
    with pytest.raises(ValueError, match="hurst must lie"):
        reader.Surface(0.8, 1.0, 2.0, 1.0, 3.0)
    surface = reader.Surface(0.8, 1.0, 100.0, 1.0, 3.0)
    for gap, E_star, rtol in ((-3.1, 1.0, 1e-8), (np.nan, 1.0, 1e-8), (1.0, 0.0, 1e-8), (1.0, 1.0, 0.5)):
        assert reader.total(surface, gap, E_star, rtol)[3] == reader.INVALID
