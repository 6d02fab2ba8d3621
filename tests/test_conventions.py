"""Table files as others open them: CF 1.11, xarray, ncdump, and a reader that follows docs/tables.md."""

import pathlib
import socket
import warnings

import netCDF4
import numpy as np
import pytest
import xarray
from independent_reader import Reader, seal_matches
from small_tables import KINDS

from mbma_tables import Surface
from mbma_tables.export.rows.data import to_netcdf
from mbma_tables.export.rows.law_rows import describe_law

SHIPPED = pathlib.Path(__file__).parents[1] / "tables"


@pytest.fixture(params=[*KINDS, *(f"shipped {kind}" for kind in KINDS)])
def path(request, table_files):
    shipped, _, kind = request.param.rpartition(" ")
    return SHIPPED / f"{kind}.nc" if shipped else table_files[kind]


def follows_conventions(path, folder, monkeypatch):
    """Passes or fails as the compliance checker does, with its words."""
    suite = pytest.importorskip("compliance_checker.suite")
    from compliance_checker.runner import ComplianceChecker

    # without a network
    monkeypatch.setattr(socket.socket, "connect", None)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        suite.CheckSuite.load_all_available_checkers()
        if "cf:1.11" not in suite.CheckSuite.checkers:
            pytest.skip("compliance-checker has no test of CF 1.11")
        passed, failed = ComplianceChecker.run_checker(
            str(path),
            ["cf:1.11"],
            0,
            "strict",
            output_filename=str(folder / "said.txt"),
            output_format="text",
        )
    assert (passed, failed) == (True, False), (folder / "said.txt").read_text()


def test_compliance_checker_finds_nothing(path, tmp_path, monkeypatch):
    follows_conventions(path, tmp_path, monkeypatch)


OF_ROWS = {
    "pressure": {},
    "solid_conductance": {"conductivity": 2.0, "conductivity_unit": "W/(m K)"},
    "tangential_stiffness": {"kappa": 1.2},
    "leakage": {},
    "hydraulic_aperture": {},
    "film": {},
}


@pytest.mark.slow
@pytest.mark.parametrize("quantity", [*OF_ROWS])
def test_rows_of_every_quantity_follow_the_conventions(quantity, tmp_path, monkeypatch):
    """Rows against pressure failed: CF takes a dimension of pressures for heights in the atmosphere."""
    law = describe_law(
        Surface.named("concrete"),
        "13.3 MPa",
        quantity=quantity,
        theory="calibrated",
        rows=12,
        **OF_ROWS[quantity],
    )
    path = tmp_path / "law.nc"
    path.write_bytes(to_netcdf(law))
    follows_conventions(path, tmp_path, monkeypatch)
    with xarray.open_dataset(path) as dataset:
        assert dataset.attrs["history"].startswith("written from Python by mbma_tables")
        for name, (values, unit) in law.columns.items():
            np.testing.assert_array_equal(dataset[name], values)
            assert dataset[name].attrs["units"] == unit


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


def test_auxiliary_coordinates_are_those_of_the_islands(table_files):
    reader = Reader(table_files["island4d"])
    with xarray.open_dataset(table_files["island4d"]) as dataset:
        node = dataset.isel(X=3, spread=4, sphere=5, hurst=2)
        mu, sigma, hurst = (float(node[name]) for name in ("mu", "sigma", "hurst"))
        known = reader.band(float(node.spread), float(node.sphere), hurst)[:2]
        assert (mu, sigma) == pytest.approx(known, rel=1e-13, abs=0)
        assert float(node.inverse_zeta_d) <= 1 / 1.25


def test_seal_and_hashes_can_be_recomputed(path, tmp_path):
    assert seal_matches(path)
    reader = Reader(path)
    for name in ("values_sha256", "attributes_sha256", "configuration_sha256"):
        assert getattr(reader, name)() == reader.attributes[name]
    assert reader.values_sha256().startswith(reader.attributes["data_version"])
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    damaged = tmp_path / "damaged.nc"
    damaged.write_bytes(content)
    assert not seal_matches(damaged)


def test_independent_reader_replays_every_conformance_point(path):
    assert Reader(path).replay() <= 1
