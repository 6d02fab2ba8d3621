"""Files are written whole or not at all, the same each time, and any netCDF reader opens them."""

import dataclasses
import resource

import numpy as np
import pytest
from small_tables import small_table

from generate.tables.writing import write_table
from mbma_tables.common.errors import TableFileError
from mbma_tables.tablefiles.netcdf import read_table
from mbma_tables.tablefiles.schema import KINDS, UNIVERSAL


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
    arrays, expected = found.arrays(), content.arrays()
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


@pytest.mark.parametrize("share", [0.0, 0.3, 0.999])
def test_a_full_disk(share, tmp_path):
    path = write_table(tmp_path / "table.nc", small_table(UNIVERSAL))
    before = path.read_bytes()
    # a limit of the file size fails where a full disk does, inside the HDF5 library or at the seal
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(share * len(before)), hard))
    try:
        with pytest.raises(TableFileError, match=r"cannot write .*table\.nc: "):
            write_table(path, small_table(UNIVERSAL))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == before
    # and the library still works
    assert read_table(write_table(path, small_table(UNIVERSAL))).kind == UNIVERSAL


def test_content_that_does_not_fit_leaves_nothing(tmp_path):
    content = small_table(UNIVERSAL)
    conformance = content.conformance | {"tolerance": np.ones(5)}
    with pytest.raises(ValueError, match="incomplete conformance points"):
        write_table(tmp_path / "table.nc", dataclasses.replace(content, conformance=conformance))
    assert list(tmp_path.iterdir()) == []
