"""Table files as others open them: CF 1.11, xarray, ncdump, and a reader that follows docs/tables.md."""

import importlib.metadata
import math
import pathlib
import shutil
import socket
import subprocess
import warnings

import mpmath
import netCDF4
import numpy as np
import pytest
import xarray
from independent_reader import Reader, height_integral, seal_matches
from small_tables import KINDS, small_table

from generate.tables.writing import write_table

SHIPPED = pathlib.Path(__file__).parents[1] / "tables"


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """A small table of each kind, as the generator writes it."""
    folder = tmp_path_factory.mktemp("tables")
    return {kind: write_table(folder / f"{kind}.nc", small_table(kind)) for kind in KINDS}


@pytest.fixture(params=list(KINDS))
def path(request, small):
    return small[request.param]


def shipped(kind):
    path = SHIPPED / f"{kind}.nc"
    if not path.exists():
        pytest.skip(f"{path} is not made yet: python -m generate tables {kind}")
    return path


def complaints(path):
    """What compliance-checker's test of CF 1.11 has to say, of any weight."""
    try:
        version = importlib.metadata.version("compliance-checker")
    except importlib.metadata.PackageNotFoundError:
        pytest.skip("compliance-checker is not installed")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from compliance_checker.suite import CheckSuite

        CheckSuite.load_all_available_checkers()
        if "cf:1.11" not in CheckSuite.checkers:
            pytest.skip(f"compliance-checker {version} has no test of CF 1.11")
        suite = CheckSuite()
        dataset = suite.load_dataset(str(path))
        results, failures = suite.run_all(dataset, ["cf:1.11"])["cf:1.11"]
        dataset.close()
    assert not failures
    assert len(results) > 5
    found = []
    pending = list(results)
    while pending:
        result = pending.pop()
        pending += result.children or []
        # messages of what passed only tell where something was found
        if isinstance(result.value, tuple) and result.value[0] == result.value[1]:
            continue
        found += result.msgs or ([] if result.value in (None, True) else [str(result.name)])
    return found


@pytest.fixture
def offline(monkeypatch):
    def refuse(self, address):
        raise OSError(f"no network in tests: {address}")

    monkeypatch.setattr(socket.socket, "connect", refuse)


@pytest.mark.usefixtures("offline")
def test_compliance_checker_finds_nothing(path):
    assert complaints(path) == []


@pytest.mark.usefixtures("offline")
@pytest.mark.parametrize("kind", KINDS)
def test_compliance_checker_finds_nothing_in_the_shipped_tables(kind):
    assert complaints(shipped(kind)) == []


def test_xarray_opens_cells_and_labelled_axes(path):
    with xarray.open_dataset(path) as dataset:
        for name in dataset.variables:
            assert dataset[name].attrs["long_name"]
            assert dataset[name].attrs["units"] == "1"
            assert np.isfinite(dataset[name]).all()
        if "chebyshev_F" in dataset:
            assert {"cell"} == set(dataset["error_F"].dims) == set(dataset["X_low"].dims)
            return
        assert set(dataset.sizes) <= set(dataset.coords) | {"conformance"}
        ratio = dataset["log_ratio_F"]
        assert set(ratio.dims) <= set(ratio.coords)
        middle = {name: dataset.sizes[name] // 2 for name in ratio.dims}
        labels = {name: float(dataset[name][k]) for name, k in middle.items()}
        assert float(ratio.sel(labels)) == float(ratio.isel(middle)) < 0


def test_hdf5_readers_open_the_sealed_file(path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path) as file, netCDF4.Dataset(path) as dataset:
        assert (file["error_F"][...] == dataset["error_F"][...]).all()
        assert file.attrs["mbma_kind"].decode() == dataset.mbma_kind
        for variable in dataset.variables.values():
            assert variable.filters()["zlib"]
            assert (variable.endian(), variable.dtype) == ("little", "f8")
            assert "_FillValue" not in variable.ncattrs()


def test_ncdump_reads_as_documentation(path):
    tool = shutil.which("ncdump")
    if tool is None:
        pytest.skip("ncdump is not installed")
    header = subprocess.run([tool, "-h", path], capture_output=True, check=True, text=True).stdout
    for word in ("lookup_01", "out_of_range", "position_formula", "error_field"):
        assert word in header
    for word in ("certificate", "conformance", "hashes", "seal", "versions", "data_version", "format_version"):
        assert f":{word} = " in header
    # one line an attribute, none broken
    assert "\\n" not in header
    assert max(map(len, header.splitlines())) < 800


def test_four_parameters_come_back_from_the_auxiliary_coordinates(small):
    reader = Reader(small["island4d"])
    with xarray.open_dataset(small["island4d"]) as dataset:
        assert {"mu", "sigma", "inverse_zeta_d"} <= set(dataset["log_ratio_F"].coords)
        # the formulas in the file's own words
        delta = (1 + dataset.X * dataset.sigma) * dataset.inverse_zeta_d**dataset.hurst
        place = {"X": 3, "spread": 4, "sphere": 5, "hurst": 2}
        zeta_d = 1 / float(dataset.inverse_zeta_d.isel(sphere=5, hurst=2))
        zeta_u = (1 + float(dataset.spread[4])) * zeta_d
        node = dataset.isel(place)
        found = reader.answer(
            delta_over_h_rms=float(delta.isel(place)), zeta_d=zeta_d, zeta_u=zeta_u, hurst=float(node.hurst)
        )
        rigid = Reader.rigid(float(node.X), float(node.mu))
        mu, sigma, _ = reader.band(float(node.spread), float(node.sphere), float(node.hurst))
        assert mu == pytest.approx(float(node.mu), rel=1e-13, abs=0)
        assert sigma == pytest.approx(float(node.sigma), rel=1e-13, abs=0)
        # F_hat/A_hat by radii and density alone, from the two log ratios at the node
        power = 4 - 2 * float(node.hurst)
        c = 0.75 * float(node.hurst) / power
        R_d, R_u = (3 * math.sqrt(math.pi) / 8 / math.sqrt(c * (z**power - 1)) for z in (zeta_d, zeta_u))
        S = sigma * zeta_d ** -float(node.hurst)
        force = S * math.sqrt(2 * R_d * S) * rigid["F"] * math.exp(float(node.log_ratio_F))
        assert found["F"] == pytest.approx(force, rel=1e-9, abs=0)
        D = mu / (8 / 3 * S * math.sqrt(2 * R_u * R_d))
        area = 2 * math.pi * D * R_u * R_d * S**2 * rigid["A"] * math.exp(float(node.log_ratio_A))
        assert found["A"] == pytest.approx(area, rel=1e-9, abs=0)


def test_seal_and_hashes_can_be_recomputed(path):
    assert seal_matches(path)
    reader = Reader(path)
    for name in ("values_sha256", "attributes_sha256", "configuration_sha256"):
        assert getattr(reader, name)() == reader.attributes[name]
    assert reader.values_sha256().startswith(reader.attributes["data_version"])
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    damaged = path.with_suffix(".damaged")
    damaged.write_bytes(content)
    assert not seal_matches(damaged)


@pytest.mark.parametrize("n", [2, 2.5])
@pytest.mark.parametrize("x", [-42, -26, -5.5, -1, 0, 0.5, 3, 7])
def test_height_integrals_of_the_file(n, x):
    with mpmath.workdps(30):
        scale = mpmath.gamma(n + 1) / mpmath.sqrt(2 * mpmath.pi) * mpmath.exp(-(mpmath.mpf(x) ** 2) / 4)
        exact = scale * mpmath.pcfu(mpmath.mpf(n) + 0.5, x)
        assert abs(height_integral(n, x) / exact - 1) < 1e-13


def test_independent_reader_replays_every_conformance_point(path):
    assert Reader(path).replay() <= 1


@pytest.mark.parametrize("kind", KINDS)
def test_independent_reader_replays_the_shipped_tables(kind):
    path = shipped(kind)
    assert seal_matches(path)
    reader = Reader(path)
    assert reader.values_sha256() == reader.attributes["values_sha256"]
    assert reader.replay() <= 1


def test_outside_there_is_no_answer(small):
    universal = Reader(small["universal"])
    with pytest.raises(ValueError, match="X = 7"):
        universal.answer(X=7.0, mu=1.0)
    with pytest.raises(ValueError, match="mu = 101"):
        universal.answer(X=2.0, mu=101.0)


def test_error_field_is_read_where_the_library_reads_it(small):
    from mbma_tables import open_table

    model, reader = open_table(small["universal"]), Reader(small["universal"])
    rng = np.random.default_rng(5)
    X, mu = rng.uniform(0.5, 6, 40), np.exp(rng.uniform(math.log(1e-3), math.log(10), 40))
    theirs = model.answer(X, mu).error
    ours = [max(reader.error(f, point) for f in "FA") for point in zip(X, mu, strict=True)]
    np.testing.assert_array_equal(theirs, ours)
