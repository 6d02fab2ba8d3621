"""Tables of a user's own surface: BEM results of one map, in a netCDF-4 file with a checksum like other tables."""

import hashlib
import os
import pathlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from mbma_tables.common.errors import InputError, TableFileError
from mbma_tables.common.files import write_file, written_bytes
from mbma_tables.tablefiles import netcdf
from mbma_tables.tablefiles.netcdf import HDF5_LOCK, SEAL, opened, verified

KIND, FORMAT = "simulated_map", "2.0"
REQUIRED = ("mbma_kind", "format_version", "values_sha256")
ADVICE = "make it anew: `mbma fit MAP --simulate --out OWN.nc`"


def is_own(path: os.PathLike[str] | str) -> bool:
    """Whether a file ends with a table's checksum."""
    try:
        with open(path, "rb") as stream:
            stream.seek(-netcdf.SEAL_LENGTH, os.SEEK_END)
            return stream.read().startswith(SEAL)
    except (OSError, ValueError):
        return False


def holds_own(path: os.PathLike[str] | str) -> bool:
    """Whether a file is such a table, damaged or not, and no other."""
    return is_own(path) and KIND.encode() in pathlib.Path(path).read_bytes()


def write_own(
    path: os.PathLike[str] | str,
    variables: Mapping[str, tuple[tuple[str, ...], Any, str, str]],
    attributes: Mapping[str, str],
) -> None:
    """Write variables (dimensions, values, long_name, units) and attributes whole, or not at all."""
    import netCDF4

    arrays = {name: np.asarray(entry[1], float) for name, entry in variables.items()}
    own = {"mbma_kind": KIND, "format_version": FORMAT, "values_sha256": netcdf.digest_arrays(arrays), **attributes}

    def write(draft: str) -> None:
        with HDF5_LOCK, netCDF4.Dataset(draft, "w", format="NETCDF4") as dataset:
            for name, (over, _, meaning, units) in variables.items():
                for dimension, size in zip(over, arrays[name].shape, strict=True):
                    if dimension not in dataset.dimensions:
                        dataset.createDimension(dimension, size)
                variable = dataset.createVariable(name, "f8", over, zlib=bool(over), endian="little", fill_value=False)
                variable.setncatts({"long_name": meaning, "units": units})
                variable[...] = arrays[name]
            dataset.setncatts(own)
            dataset.setncattr("attributes_sha256", netcdf.attributes_digest(dataset))

    try:
        body = written_bytes(pathlib.Path(path).name, write)
        write_file(path, body + SEAL + hashlib.sha256(body).hexdigest().encode() + b"\n")
    except (InputError, OSError) as fault:
        raise TableFileError(f"cannot write {path}: {fault}") from None


def read_own(path: os.PathLike[str] | str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Values and attributes of such a file, checked; TableFileError for damaged, edited and other ones."""
    with opened(path, ADVICE) as dataset:
        own, _, values = verified(dataset, REQUIRED)
        if (own["mbma_kind"], own["format_version"]) != (KIND, FORMAT):
            raise ValueError(f"holds a {own['mbma_kind']} of format {own['format_version']}, not a {KIND} of {FORMAT}")
        lost = [name for name, array in values.items() if not np.isfinite(array).all()]
        if lost:
            raise ValueError(f"has variable {lost[0]}, which is not finite")
    return values, own
