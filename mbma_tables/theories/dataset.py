"""The boundary-element (BEM) simulations that laws were fitted to and tested on."""

from __future__ import annotations

import os
import pathlib
from typing import TYPE_CHECKING, Any

import netCDF4

from mbma_tables.common.errors import TableFileError
from mbma_tables.common.netcdf import HDF5_LOCK, read_sealed

if TYPE_CHECKING:
    import xarray as xr

FILE = pathlib.Path(__file__).parents[2] / "docs" / "data" / "boundary_elements.nc"


def read_groups(path: pathlib.Path) -> dict[str, Any]:
    """The groups of a file with a checksum as `xarray.Dataset`, its root as "/"."""
    import xarray

    read_sealed(path)
    with HDF5_LOCK:
        with netCDF4.Dataset(path) as opened:
            names = ("/", *opened.groups)
        return {
            name: xarray.load_dataset(path, group=name, engine="netcdf4")
            for name in names
        }


def boundary_elements(path: os.PathLike[str] | str | None = None) -> xr.DataTree:
    """The data set of BEM simulations, one group for each campaign, as described in docs/data/README.md.

    Parameters
    ----------
    path : path-like, optional
        The file ``boundary_elements.nc``; by default that of the clone or source
        distribution which contains the package. Wheels do not contain it.

    Returns
    -------
    xarray.DataTree
        In memory. ``boundary_elements()["elastic"]`` has arrays of shape (surface, load):
        ``force`` over A0 E* g with the rms gradient g, ``area`` over A0,
        ``mean_separation`` in h_rms, ``stiffness``, ``energy``, and what each surface is
        made of. Attributes describe every variable and its unit.

    Raises
    ------
    TableFileError
        If there is no such file, or it is damaged.

    Examples
    --------
    >>> from mbma_tables.theories.dataset import boundary_elements
    >>> elastic = boundary_elements()["elastic"]
    >>> elastic["mean_separation"].attrs["long_name"]
    'u, the mean gap, in h_rms'
    """
    source = FILE if path is None else pathlib.Path(path)
    if not source.exists():
        raise TableFileError(
            f"{source} does not exist: wheels do not contain the BEM data set; "
            "give the path of docs/data/boundary_elements.nc in a clone or the source distribution of mbma_tables"
        )
    import xarray

    return xarray.DataTree.from_dict(read_groups(source))
