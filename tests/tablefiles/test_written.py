"""Files are written whole or not at all, the same each time, and any netCDF reader opens them."""

import dataclasses
import errno
import os
import resource
import shutil
import subprocess
import sys

import netCDF4
import numpy as np
import pytest
import xarray
from small_tables import small_table

from mbma_tables.errors import TableFileError
from mbma_tables.tablefiles import netcdf as files
from mbma_tables.tablefiles.netcdf import MODULES, read_sealed, read_table, write_table
from mbma_tables.tablefiles.provenance import digest_arrays, physics_digest
from mbma_tables.tablefiles.schema import DEGREES, FORMAT_VERSION, FUNCTIONS, KINDS, UNIVERSAL


@pytest.fixture(scope="module", params=KINDS)
def written(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("written") / f"{request.param}.nc"
    assert write_table(path, small_table(request.param)) == path
    return path


def test_what_is_written_is_read(written):
    content = small_table(written.stem)
    found = read_table(written, written.stem)
    assert found.kind == content.kind
    assert found.axes == content.axes
    assert found.auxiliary.keys() == content.auxiliary.keys()
    assert found.conformance.keys() == content.conformance.keys()
    assert found.attributes.items() >= content.attributes.items()
    arrays, expected = found.arrays(), content.arrays()
    assert arrays.keys() == expected.keys()
    for name, values in expected.items():
        np.testing.assert_array_equal(arrays[name], values, err_msg=name)


def test_versions_and_hashes(written):
    content = small_table(written.stem)
    attributes = read_table(written).attributes
    digest = digest_arrays(content.arrays())
    assert attributes["format_version"] == FORMAT_VERSION
    assert attributes["values_sha256"] == digest
    assert attributes["data_version"] == digest[:12]
    assert attributes["spline_degree"] == DEGREES[content.kind]
    assert attributes["physics_sha256"] == physics_digest(MODULES[content.kind])
    assert attributes["physics_modules"].split() == list(MODULES[content.kind])


def test_another_value_is_another_data_version_of_the_same_format(written, tmp_path):
    content = small_table(written.stem)
    error = content.local_error * 2
    other = read_table(write_table(tmp_path / "other.nc", dataclasses.replace(content, local_error=error))).attributes
    own = read_table(written).attributes
    differing = {name for name in own if own[name] != other[name]}
    assert differing == {"data_version", "values_sha256", "attributes_sha256"}


def test_two_writes_are_identical(written, tmp_path):
    content = small_table(written.stem)
    again = write_table(tmp_path / "of_another_name.nc", content)
    assert again.read_bytes() == written.read_bytes()
    # what was read and is written again, too
    own = {n: v for n, v in read_table(written).attributes.items() if n in content.attributes}
    third = write_table(tmp_path / "third.nc", dataclasses.replace(read_table(written), attributes=own))
    assert third.read_bytes() == written.read_bytes()


def test_two_processes_write_the_same(tmp_path):
    command = (
        "import sys\n"
        f"sys.path.insert(0, {os.path.dirname(__file__)!r})\n"
        "from small_tables import small_table\n"
        "from mbma_tables.tablefiles.netcdf import write_table\n"
        "for kind in ('universal', 'island4d'):\n"
        "    write_table(f'{sys.argv[1]}/{kind}.nc', small_table(kind))\n"
    )
    subprocess.run([sys.executable, "-c", command, str(tmp_path)], check=True)
    for kind in KINDS:
        own = write_table(tmp_path / "own.nc", small_table(kind))
        assert (tmp_path / f"{kind}.nc").read_bytes() == own.read_bytes()


def test_plain_netcdf_reads_it(written):
    content = small_table(written.stem)
    with netCDF4.Dataset(written) as dataset:
        assert dataset.data_model == "NETCDF4"
        assert dataset.Conventions.startswith("CF-")
        for name in ("title", "source", "references", "comment", "out_of_range", "versions"):
            assert dataset.getncattr(name)
        for number, function in enumerate(FUNCTIONS):
            variable = dataset[f"log_ratio_{function}"]
            assert variable.dimensions == tuple(axis.name for axis in content.axes)
            np.testing.assert_array_equal(variable[...], content.log_ratio[..., number])
        for name, variable in dataset.variables.items():
            assert variable.dtype == np.float64, name
            assert variable.units == "1", name
            assert len(variable.long_name) > 1, name
        assert len({variable.long_name for variable in dataset.variables.values()}) == len(dataset.variables)


def test_xarray_opens_it_with_labelled_axes(written):
    content = small_table(written.stem)
    with xarray.open_dataset(written) as dataset:
        for axis in content.axes:
            coordinate = dataset.coords[axis.name]
            np.testing.assert_array_equal(coordinate, axis.values)
            assert coordinate.attrs["long_name"] == axis.long_name
            assert coordinate.attrs["units"] == "1"
            assert coordinate.attrs["position_formula"] == axis.formula()
        for function in FUNCTIONS:
            assert set(dataset[f"log_ratio_{function}"].dims) <= set(dataset.coords)
            assert set(dataset[f"error_{function}"].dims) <= set(dataset.coords)
            assert set(dataset[f"spline_{function}"].dims) <= set(dataset.coords)
        node = {axis.name: axis.values[1] for axis in content.axes}
        expected = content.log_ratio[(1,) * len(content.axes)]
        assert [float(dataset[f"log_ratio_{f}"].sel(node)) for f in FUNCTIONS] == list(expected)


@pytest.mark.skipif(shutil.which("ncdump") is None, reason="ncdump is not installed")
def test_ncdump_reads_it(written):
    text = subprocess.run(["ncdump", "-h", written], capture_output=True, text=True, check=True).stdout
    assert f':mbma_kind = "{written.stem}"' in text
    for function in FUNCTIONS:
        assert f"double log_ratio_{function}(" in text


def unwritten(path, folder, content, why):
    """The refusal to write, after which the folder is as it was."""
    before = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    with pytest.raises(TableFileError, match=why) as caught:
        write_table(path, content)
    assert str(path) in str(caught.value)
    assert {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()} == before
    assert not [p for p in folder.rglob(".*") if p.is_dir()]


def test_a_folder_that_is_missing_or_none(tmp_path):
    content = small_table(UNIVERSAL)
    unwritten(tmp_path / "missing" / "table.nc", tmp_path, content, "No such file or directory; nothing was changed")
    (tmp_path / "file").write_bytes(b"own")
    unwritten(tmp_path / "file" / "table.nc", tmp_path, content, "Not a directory")
    (tmp_path / "folder.nc").mkdir()
    unwritten(tmp_path / "folder.nc", tmp_path, content, "not a regular file")


def test_a_folder_that_may_not_be_written(tmp_path):
    (tmp_path / "table.nc").write_bytes(b"old")
    tmp_path.chmod(0o500)
    own = os.geteuid()
    # whoever may write everywhere becomes nobody for a moment
    if own == 0:
        os.seteuid(65534)
    try:
        with pytest.raises(TableFileError, match=r"table\.nc: Permission denied"):
            write_table(tmp_path / "table.nc", small_table(UNIVERSAL))
    finally:
        if own == 0:
            os.seteuid(own)
        tmp_path.chmod(0o700)
    assert [p.name for p in tmp_path.iterdir()] == ["table.nc"]
    assert (tmp_path / "table.nc").read_bytes() == b"old"


@pytest.mark.parametrize("share", [0.0, 0.02, 0.3, 0.9, 0.999])
def test_a_full_disk(share, tmp_path):
    path = write_table(tmp_path / "table.nc", small_table(UNIVERSAL))
    room = int(share * path.stat().st_size)
    # a limit of the file size fails where a full disk does, inside the HDF5 library or at the seal
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    before = path.read_bytes()
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
    try:
        with pytest.raises(TableFileError, match=r"cannot write .*table\.nc: .*; nothing was changed"):
            write_table(path, small_table(UNIVERSAL))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == before
    # and the library still works
    assert read_table(write_table(path, small_table(UNIVERSAL))).kind == UNIVERSAL


def test_no_space_left_at_the_last_moment(tmp_path, monkeypatch):
    path = write_table(tmp_path / "table.nc", small_table(UNIVERSAL))

    def full(descriptor):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(files.os, "fsync", full)
    unwritten(path, tmp_path, small_table(KINDS[1]), "No space left on device")
    assert read_table(path).kind == UNIVERSAL


@pytest.mark.parametrize("fault", [KeyboardInterrupt, ZeroDivisionError, MemoryError])
def test_an_interruption_leaves_the_old_file(fault, tmp_path, monkeypatch):
    path = write_table(tmp_path / "table.nc", small_table(UNIVERSAL))
    before = path.read_bytes()

    def interrupted(dataset):
        raise fault

    monkeypatch.setattr(files, "_attributes_digest", interrupted)
    with pytest.raises(fault):
        write_table(path, small_table(UNIVERSAL))
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == before


def test_content_that_does_not_fit_leaves_nothing(tmp_path):
    content = small_table(UNIVERSAL)
    conformance = content.conformance | {"tolerance": np.ones(5)}
    with pytest.raises((ValueError, IndexError)):
        write_table(tmp_path / "table.nc", dataclasses.replace(content, conformance=conformance))
    assert list(tmp_path.iterdir()) == []


def test_the_seal_is_the_hash_of_what_stands_before_it(written):
    body = read_sealed(written)
    content = written.read_bytes()
    assert content.startswith(body)
    found = subprocess.run(["sha256sum"], input=body, capture_output=True, check=True).stdout.split()[0]
    assert content[len(body) :] == b"\nmbma-table sha256 " + found + b"\n"
