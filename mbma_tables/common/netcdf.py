"""Open and check sealed files (netCDF-4); write those of a user's own surface.

A file ends in a line with the SHA-256 of all bytes before it, which is checked before the
HDF5 library opens the file, since that may crash on damaged bytes. HDF5 ignores what
follows its own end of file.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import pathlib
import re
import threading
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mbma_tables.common.errors import InputError, TableFileError
from mbma_tables.common.files import read_file, write_file, written_bytes

if TYPE_CHECKING:
    import netCDF4

REMEDY = "reinstall mbma_tables"
# tables of a user's own surface, BEM results of one map
OWN = "simulated_map"
OWN_FORMAT = "2.0"
OWN_REMEDY = "make it anew: `mbma fit MAP --simulate --out OWN.nc`"
SEAL = b"\nmbma-table sha256 "
SEAL_LENGTH = len(SEAL) + 64 + 1
MAX_BYTES = 256 * 2**20  # largest size of a file, and of its values
# the HDF5 library is not thread-safe, and a process must not be forked during its calls
HDF5_LOCK = threading.RLock()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(
        before=HDF5_LOCK.acquire,
        after_in_parent=HDF5_LOCK.release,
        after_in_child=HDF5_LOCK.release,
    )


# the first pattern that matches a name determines the type of the attribute
ATTRIBUTES: tuple[tuple[str, type, Callable[[Any], Any], str], ...] = (
    (
        "certificate_points|spline_degree",
        int,
        lambda value: value > 0,
        "a whole number above 0",
    ),
    (
        "target|.*_error_[FA]",
        float,
        lambda value: 0 <= value < np.inf,
        "a finite number, at least 0",
    ),
    ("offset|first|last", float, np.isfinite, "a finite number"),
    (".*_sha256", str, re.compile("[0-9a-f]{64}").fullmatch, "64 hexadecimal digits"),
    ("data_version", str, re.compile("[0-9a-f]{12}").fullmatch, "12 hexadecimal digits"),
    (
        "variant|mbma_kind|transform",
        str,
        re.compile("[A-Za-z][A-Za-z0-9_]{0,39}").fullmatch,
        "a name",
    ),
    (".*", str, str.isprintable, "printable text"),
)


def check_attribute(owner: str, name: str, value: Any) -> None:
    """Raise ValueError if an attribute does not have its type; `owner` is empty for a file."""
    expected, good, text = next(
        row[1:] for row in ATTRIBUTES if re.fullmatch(row[0], name)
    )
    if type(value) is not expected or not good(value):
        shown = repr(value)[:60]
        raise ValueError(
            f"has attribute {owner + ':' if owner else ''}{name} = {shown}, which must be {text}"
        )


def digest_json(content: Any) -> str:
    """SHA-256 of a JSON value in its canonical form."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(text.encode()).hexdigest()


def digest_arrays(arrays: dict[str, Any]) -> str:
    """SHA-256 of named arrays: names, shapes, and bytes in little-endian order."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = np.asarray(arrays[name])
        plain = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("<"))
        digest.update(f"{name}:{plain.dtype.str}:{plain.shape};".encode())
        digest.update(plain.tobytes())
    return digest.hexdigest()


def _attributes_of(owner: Any) -> dict[str, Any]:
    """The attributes of a file or variable as Python values, lists where they are arrays."""
    values = {name: owner.getncattr(name) for name in owner.ncattrs()}
    return {
        name: v.tolist() if isinstance(v, np.ndarray | np.generic) else v
        for name, v in values.items()
    }


def attributes_digest(dataset: netCDF4.Dataset) -> str:
    """SHA-256 of a file's attributes except this hash, and of its variables' descriptions.

    The latter are their dimensions and attributes.
    """
    attributes_of_file = _attributes_of(dataset)
    content = {
        "": {
            name: value
            for name, value in attributes_of_file.items()
            if name != "attributes_sha256"
        }
    }
    for name, variable in dataset.variables.items():
        content[name] = _attributes_of(variable) | {
            "dimensions": list(variable.dimensions)
        }
    return digest_json(content)


def read_sealed(path: pathlib.Path, remedy: str = REMEDY) -> bytes:
    """The netCDF bytes of a table file, checked against its checksum."""
    try:
        content = read_file(path, MAX_BYTES)
    except InputError as fault:
        raise TableFileError(
            f"{path}: {str(fault).removeprefix(f'{path} ')}; {remedy}"
        ) from None
    body = content[:-SEAL_LENGTH]
    seal = content[-SEAL_LENGTH:]
    if not seal.startswith(SEAL) or not seal.endswith(b"\n"):
        raise TableFileError(
            f"{path}: is not a table file, or is cut short (no checksum at its end); {remedy}"
        )
    if seal[len(SEAL) : -1] != hashlib.sha256(body).hexdigest().encode():
        raise TableFileError(
            f"{path}: is damaged (its checksum does not match); {remedy}"
        )
    return body


@contextlib.contextmanager
def opened(path: os.PathLike[str] | str, remedy: str) -> Iterator[netCDF4.Dataset]:
    """The dataset of a table file, its checksum verified.

    All errors are `TableFileError` and name the remedy.
    """
    import netCDF4

    source = pathlib.Path(path)
    body = read_sealed(source, remedy)
    try:
        with HDF5_LOCK, netCDF4.Dataset(source.name, memory=body) as dataset:
            yield dataset
    except ValueError as fault:
        raise TableFileError(f"{source}: {fault}; {remedy}") from None
    # raised by netCDF4 for bytes that are not a netCDF file, or without a variable
    except (OSError, RuntimeError, LookupError) as fault:
        raise TableFileError(
            f"{source}: is not a table file ({fault}); {remedy}"
        ) from None


def verified(
    dataset: netCDF4.Dataset, required: tuple[str, ...] = ("values_sha256",)
) -> tuple[dict[str, Any], dict[str, dict[str, Any]], dict[str, Any]]:
    """Attributes of an open file and of its variables, and their values, all checked."""
    # values as they are stored, for their hash
    dataset.set_auto_maskandscale(False)
    attributes_of_file = _attributes_of(dataset)
    described = {
        name: _attributes_of(variable) for name, variable in dataset.variables.items()
    }
    for owner, attributes in {"": attributes_of_file, **described}.items():
        for name, value in attributes.items():
            check_attribute(owner, name, value)
    for name, variable in dataset.variables.items():
        if variable.dtype != np.dtype("<f8"):
            raise ValueError(
                f"holds variable {name}, which must hold little-endian doubles, not "
                f"{variable.dtype}"
            )
    missing = [name for name in required if name not in attributes_of_file]
    if missing or attributes_of_file.get("attributes_sha256") != attributes_digest(
        dataset
    ):
        raise ValueError(
            f"lacks attribute {missing[0]}"
            if missing
            else "has attributes that were edited"
        )
    if (
        dataset.groups
        or sum(variable.size for variable in dataset.variables.values()) * 8 > MAX_BYTES
    ):
        raise ValueError(f"has groups, or more than {MAX_BYTES} bytes of values")
    values = {
        name: np.ascontiguousarray(variable[...])
        for name, variable in dataset.variables.items()
    }
    # the stored axes, not recomputed ones: another processor's logarithm may differ in the last bit
    if digest_arrays(values) != attributes_of_file["values_sha256"]:
        raise ValueError("has values that do not match their hash")
    return attributes_of_file, described, values


def is_own(path: os.PathLike[str] | str) -> bool:
    """Whether a file ends with a table's checksum."""
    try:
        with open(path, "rb") as stream:
            stream.seek(-SEAL_LENGTH, os.SEEK_END)
            return stream.read().startswith(SEAL)
    except (OSError, ValueError):
        return False


def holds_own(path: os.PathLike[str] | str) -> bool:
    """Whether a file is such a table, damaged or not, and no other."""
    return is_own(path) and OWN.encode() in pathlib.Path(path).read_bytes()


def write_own(
    path: os.PathLike[str] | str,
    variables: Mapping[str, tuple[tuple[str, ...], Any, str, str]],
    attributes: Mapping[str, str],
    kind: str = OWN,
    version: str = OWN_FORMAT,
) -> None:
    """Write variables (dimensions, values, long_name, units) and attributes whole.

    If that fails, nothing is written.
    """
    import netCDF4

    arrays = {name: np.asarray(entry[1], float) for name, entry in variables.items()}
    attributes_of_file = {
        "mbma_kind": kind,
        "format_version": version,
        "values_sha256": digest_arrays(arrays),
        **attributes,
    }

    def write(draft: str) -> None:
        with HDF5_LOCK, netCDF4.Dataset(draft, "w", format="NETCDF4") as dataset:
            for name, (over, _, meaning, units) in variables.items():
                for dimension, size in zip(over, arrays[name].shape, strict=True):
                    if dimension not in dataset.dimensions:
                        dataset.createDimension(dimension, size)
                variable = dataset.createVariable(
                    name, "f8", over, zlib=bool(over), endian="little", fill_value=False
                )
                variable.setncatts({"long_name": meaning, "units": units})
                variable[...] = arrays[name]
            dataset.setncatts(attributes_of_file)
            dataset.setncattr("attributes_sha256", attributes_digest(dataset))

    try:
        body = written_bytes(pathlib.Path(path).name, write)
        write_file(path, body + SEAL + hashlib.sha256(body).hexdigest().encode() + b"\n")
    except (InputError, OSError) as fault:
        raise TableFileError(f"cannot write {path}: {fault}") from None


def own_content(
    dataset: netCDF4.Dataset, kind: str, version: str
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Values and attributes of an open file of `write_own`, which must be of a kind; else ValueError."""
    attributes_of_file, _, values = verified(
        dataset, ("mbma_kind", "format_version", "values_sha256")
    )
    of_file = tuple(attributes_of_file[name] for name in ("mbma_kind", "format_version"))
    if of_file != (kind, version):
        raise ValueError(
            f"holds a {of_file[0]} of format {of_file[1]}, not a {kind} of {version}"
        )
    lost = [name for name, array in values.items() if not np.isfinite(array).all()]
    if lost:
        raise ValueError(f"has variable {lost[0]}, which is not finite")
    return values, attributes_of_file


def read_own(path: os.PathLike[str] | str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Values and attributes of a table of a user's own surface; TableFileError where damaged or edited."""
    with opened(path, OWN_REMEDY) as dataset:
        return own_content(dataset, OWN, OWN_FORMAT)
