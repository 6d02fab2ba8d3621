"""Files are written whole or not at all, the same each time; their hashes and conformance points verify them."""

import dataclasses
import hashlib
import pathlib

import numpy as np
import pytest
from small_tables import small_table

import mbma_tables
from mbma_tables.common.errors import TableFileError
from mbma_tables.islands import greenwood_tripp
from mbma_tables.tables.open import verify
from mbma_tables.tables.reader import read_table
from mbma_tables.tables.schema import ISLAND4D, KINDS, UNIVERSAL
from mbma_tables.tables.sources import MODULES, source_digest
from mbma_tables.tables.writer import write_table


@pytest.fixture(params=KINDS)
def written(request, table_files):
    return table_files[request.param]


def test_what_is_written_is_read(written):
    content = small_table(written.stem)
    found = read_table(written, written.stem)
    assert found.kind == content.kind
    assert found.axes == content.axes
    assert found.auxiliary.keys() == content.auxiliary.keys()
    assert found.conformance.keys() == content.conformance.keys()
    assert found.attributes.items() >= content.attributes.items()
    arrays = found.arrays()
    expected = content.arrays()
    assert arrays.keys() == expected.keys()
    for name, values in expected.items():
        np.testing.assert_array_equal(arrays[name], values, err_msg=name)


def test_two_writes_are_identical(written, tmp_path):
    content = small_table(written.stem)
    again = write_table(tmp_path / "of_another_name.nc", content)
    assert again.read_bytes() == written.read_bytes()
    # what was read and is written again, too: it keeps its provenance
    third = write_table(tmp_path / "third.nc", read_table(written))
    assert third.read_bytes() == written.read_bytes()


def test_content_that_does_not_fit_leaves_nothing(tmp_path):
    content = small_table(UNIVERSAL)
    conformance = content.conformance | {"tolerance": np.ones(5)}
    with pytest.raises(ValueError, match="incomplete conformance points"):
        write_table(
            tmp_path / "table.nc", dataclasses.replace(content, conformance=conformance)
        )
    assert list(tmp_path.iterdir()) == []


PACKAGE = pathlib.Path(mbma_tables.__file__).parent


def test_the_source_digest_is_that_of_the_files():
    assert set(MODULES[UNIVERSAL]) < set(MODULES[ISLAND4D])
    python, c = (
        [name for name in MODULES[ISLAND4D] if ("/" in name) == is_c]
        for is_c in (False, True)
    )
    assert (*c, *python) == MODULES[ISLAND4D]
    files = [
        PACKAGE.parent / path
        for path in (*c, *(f"{name.replace('.', '/')}.py" for name in python))
    ]
    joined = b"".join(file.read_bytes() for file in files)
    assert source_digest(MODULES[ISLAND4D]) == hashlib.sha256(joined).hexdigest()
    with pytest.raises(ModuleNotFoundError, match=r"mbma_tables\.nowhere"):
        source_digest(("mbma_tables.nowhere",))


POINTS = 64


def with_points(kind, **changes):
    content = small_table(kind)
    points = {name: values.copy() for name, values in content.conformance.items()}
    for name, change in changes.items():
        points[name] = change(points[name])
    return dataclasses.replace(content, conformance=points)


def test_the_difference_of_another_solver_is_measured(written, monkeypatch):
    solve = greenwood_tripp.solve

    def nearby(X, mu, rtol):
        found = solve(X, mu, rtol=rtol)
        return dataclasses.replace(found, phi_F=found.phi_F * (1 + 2e-12))

    monkeypatch.setattr(greenwood_tripp, "solve", nearby)
    assert verify(written).solver_error == pytest.approx(2e-12, rel=1e-3, abs=0)


@pytest.mark.parametrize(
    ("name", "who"),
    [
        ("table_F", "the table"),
        ("table_A", "the table"),
        ("exact_F", "exact solver"),
        ("exact_A", "exact solver"),
    ],
)
@pytest.mark.parametrize("kind", KINDS)
def test_an_answer_beyond_its_tolerance_is_refused(kind, name, who, tmp_path):
    tolerance = small_table(kind).conformance["tolerance"][7]

    def beyond(factor):
        return lambda v: np.where(np.arange(POINTS) == 7, v * (1 + factor * tolerance), v)

    verify(write_table(tmp_path / "a.nc", with_points(kind, **{name: beyond(0.9)})))
    write_table(tmp_path / "a.nc", with_points(kind, **{name: beyond(1.2)}))
    with pytest.raises(
        TableFileError,
        match=rf"a\.nc: the answers of .*{who} .*`mbma tables make {kind} --out FILE",
    ):
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
