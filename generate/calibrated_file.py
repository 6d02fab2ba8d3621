"""The library's file of calibrated laws, tables/calibrated.nc: a root, and groups that other commands write."""

from __future__ import annotations

import hashlib
import os
import pathlib

import netCDF4
import xarray as xr

from mbma_tables.common.files import write_file, written_bytes
from mbma_tables.tablefiles.netcdf import HDF5_LOCK, SEAL, read_sealed


def read_parts(path: os.PathLike[str] | str) -> dict[str, xr.Dataset]:
    """The groups of a sealed file by name, its root as ""; none where there is no file."""
    source = pathlib.Path(path)
    if not source.exists():
        return {}
    read_sealed(source)  # whole and undamaged
    with HDF5_LOCK:
        with netCDF4.Dataset(source) as opened:
            names = ("", *opened.groups)
        return {name: xr.load_dataset(source, group=name or None, engine="netcdf4") for name in names}


def write_part(path: os.PathLike[str] | str, data: xr.Dataset, group: str = "") -> None:
    """Write the root or one group of a file, compressed and sealed; what else the file holds stays as it is.

    Parameters
    ----------
    path : path
        The file; made where there is none.
    data : xarray.Dataset
        The part's variables and attributes; an encoding of its variables is kept.
    group : str, optional
        Name of the group, such as "hardness"; the root without it.
    """
    parts = read_parts(path) | {group: data}

    def store(name: str) -> None:
        with HDF5_LOCK:
            for k, (own, part) in enumerate(sorted(parts.items())):
                encoding = {
                    str(n): {"zlib": True, "complevel": 9, "shuffle": True, "_FillValue": None} | _kept(v)
                    for n, v in part.variables.items()
                }
                part.to_netcdf(name, "a" if k else "w", engine="netcdf4", group=own or None, encoding=encoding)

    body = written_bytes(pathlib.Path(path).name, store)
    write_file(path, body + SEAL + hashlib.sha256(body).hexdigest().encode() + b"\n", make_folders=True)


def _kept(variable: xr.Variable) -> dict[str, object]:
    """Of a variable's encoding, how its numbers are stored."""
    return {key: value for key, value in variable.encoding.items() if key == "dtype" and variable.dtype.kind in "fiu"}
