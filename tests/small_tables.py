"""Small tables, built in a second, and ways to spoil the files that they are written to."""

import functools
import hashlib
import pathlib
import tempfile

import netCDF4
import numpy as np

from mbma_tables.common.netcdf import SEAL, SEAL_LENGTH
from mbma_tables.tables.configuration import load
from mbma_tables.tables.make import KINDS

SMALL = {
    "universal": """
target = 1e-4
certificate_points = 400
max_nodes = 5000
[axes.X]
low = -2.0
high = 6.0
[axes.mu]
high = 100.0
""",
    "island4d": """
target = 5e-2
certificate_points = 200
max_nodes = 50000
[axes.X]
low = 0.5
high = 26.0
[axes.spread]
low = 1e-6
high = 100.0
""",
}


def small(folder, kind, extra=""):
    """A small table's configuration file; `extra` comes first, so it may not repeat a key."""
    path = folder / f"{kind}.toml"
    path.write_text(extra + SMALL[kind])
    return path


@functools.cache
def small_build(kind):
    with tempfile.TemporaryDirectory() as folder:
        configuration = load(kind, small(pathlib.Path(folder), kind))
    made = KINDS[kind](configuration)
    return made, made.build()


def small_table(kind):
    return small_build(kind)[1]


def unseal(content):
    return content[:-SEAL_LENGTH]


def seal(body):
    return body + SEAL + hashlib.sha256(body).hexdigest().encode() + b"\n"


def edited(path, source, edit):
    """At `path` the table file `source` after `edit(dataset)`, with a right checksum."""
    path.write_bytes(unseal(source))
    with netCDF4.Dataset(path, "r+") as dataset:
        edit(dataset)
    path.write_bytes(seal(path.read_bytes()))
    return path


def copied(path, source, leave_out="", change_type=()):
    """At `path` a copy of the netCDF file `source`, less one variable or with one in another type, sealed."""
    with (
        netCDF4.Dataset("source", memory=unseal(source)) as old,
        netCDF4.Dataset(path, "w") as new,
    ):
        for name, dimension in old.dimensions.items():
            new.createDimension(name, dimension.size)
        for name, variable in old.variables.items():
            if name != leave_out:
                dtype = np.dtype(
                    change_type[1]
                    if change_type and change_type[0] == name
                    else variable.dtype
                )
                order = "big" if dtype.byteorder == ">" else "little"
                made = new.createVariable(
                    name, dtype, variable.dimensions, fill_value=False, endian=order
                )
                made.setncatts({n: variable.getncattr(n) for n in variable.ncattrs()})
                made[...] = variable[...]
        new.setncatts({n: old.getncattr(n) for n in old.ncattrs()})
    path.write_bytes(seal(path.read_bytes()))
    return path
