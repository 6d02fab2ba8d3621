"""Write, open and check table files (netCDF-4).

A file ends in a line with the SHA-256 of all bytes before it. It is read whole, checked, and only then shown to
the HDF5 library, which may crash on damaged bytes. HDF5 ignores what follows its own end of file, so every netCDF
reader opens the file as it is.
"""

from __future__ import annotations

import hashlib
import json
import os
import pathlib
import platform
import stat
import threading
import warnings
from typing import Any

import netCDF4
import numpy as np

from mbma_tables.errors import InputError, StaleTableWarning, TableFileError
from mbma_tables.files import shipped_file, write_file, written_bytes
from mbma_tables.tablefiles import provenance
from mbma_tables.tablefiles.consistency import misfit
from mbma_tables.tablefiles.contents import Contents, attributes_of, contents_of, foreign_contents
from mbma_tables.tablefiles.schema import (
    ANSWERS,
    CONVENTIONS,
    DEGREES,
    DOCUMENTATION,
    FORMAT_VERSION,
    FUNCTIONS,
    HEIGHT_INTEGRALS,
    ISLAND4D,
    KINDS,
    OUT_OF_RANGE,
    WEIGHTS,
    Axis,
    TableContent,
)
from mbma_tables.tablefiles.splines import padding

SEAL = b"\nmbma-table sha256 "
SEAL_LENGTH = len(SEAL) + 64 + 1
ONE_AT_A_TIME = threading.Lock()  # the HDF5 library crashes where threads enter it together
LARGEST_FILE = 256 * 2**20
MODULES = {kind: provenance.SOLVER + (provenance.GEOMETRY if kind == ISLAND4D else ()) for kind in KINDS}
MEANING = {
    "log_ratio": "natural logarithm of Phi_{f} over its value for a rigid sphere, at the nodes",
    "spline": "coefficients of cardinal B-splines that interpolate log_ratio_{f}",
    "error": "bound on the relative error of Phi_{f} in this part of the table",
}
CONFORMANCE = {
    "table": "{answer} by this table, at the conformance points",
    "exact": "{answer} by the solver, at the conformance points",
    "tolerance": "largest relative difference to allow at the conformance points",
}


def versions() -> dict[str, str]:
    """Versions of what computes."""
    import numba
    import scipy

    from mbma_tables import __version__

    return {
        "mbma_tables": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "numba": numba.__version__,
        "netCDF4": netCDF4.__version__,
    }


def _digest_of(attributes: dict[str, Any], variables: dict[str, tuple[tuple[str, ...], dict[str, Any]]]) -> str:
    """SHA-256 of every attribute of a file but this hash itself, and of each variable's dimensions and attributes."""
    content = {"": {name: value for name, value in attributes.items() if name != "attributes_sha256"}}
    for name, (dimensions, own) in variables.items():
        content[name] = own | {"dimensions": list(dimensions)}
    return provenance.digest_json(content)


def _attributes_digest(dataset: netCDF4.Dataset) -> str:
    variables = {name: (variable.dimensions, attributes_of(variable)) for name, variable in dataset.variables.items()}
    return _digest_of(attributes_of(dataset), variables)


def _fill(dataset: netCDF4.Dataset, content: TableContent) -> None:
    def add(name: str, dimensions: tuple[str, ...], values: Any, attributes: dict[str, Any]) -> None:
        variable = dataset.createVariable(
            name, "f8", dimensions, zlib=True, complevel=6, shuffle=True, endian="little", fill_value=False
        )
        variable.setncatts(attributes)
        variable[...] = values

    pad = padding(content.degree)
    names = tuple(axis.name for axis in content.axes)
    beside = " ".join(name for name, entry in content.auxiliary.items() if set(entry[0]) <= set(names))
    for axis, cells in zip(content.axes, content.local_error.shape, strict=False):
        dataset.createDimension(axis.name, axis.nodes)
        dataset.createDimension(f"{axis.name}_knot", axis.nodes + 2 * pad)
        dataset.createDimension(f"{axis.name}_cell", cells)
        add(axis.name, (axis.name,), axis.values, axis.attributes())
    for number, function in enumerate(FUNCTIONS):
        for what, suffix, array in (
            ("log_ratio", "", content.log_ratio),
            ("spline", "_knot", content.coefficients),
            ("error", "_cell", content.local_error),
        ):
            meaning = {"long_name": MEANING[what].format(f=function), "units": "1"}
            if what == "log_ratio" and beside:
                meaning["coordinates"] = beside
            add(
                f"{what}_{function}",
                tuple(name + suffix for name in names),
                array[..., number],
                meaning,
            )
    for name, (dimensions, values, attributes) in content.auxiliary.items():
        add(name, dimensions, values, attributes)
    points = next(iter(content.conformance.values())).size
    dataset.createDimension("conformance", points)
    for name, values in content.conformance.items():
        what, _, function = name.rpartition("_") if name[-2:] in ("_F", "_A") else (name, "", "")
        text = CONFORMANCE.get(what, f"argument {name} of the conformance points")
        meaning = {"long_name": text.format(answer=ANSWERS[content.kind].format(f=function)), "units": "1"}
        add(f"conformance_{name}", ("conformance",), values, meaning)


def write_table(path: os.PathLike[str] | str, content: TableContent) -> pathlib.Path:
    """Write a table file, whole or not at all.

    Raises
    ------
    TableFileError
        Where the folder cannot be written or the disk is full; nothing is left behind.
    """
    target = pathlib.Path(path)
    digest = provenance.digest_arrays(content.arrays())
    attributes = {
        "Conventions": CONVENTIONS,
        **content.attributes,
        "mbma_kind": content.kind,
        "format_version": FORMAT_VERSION,
        "data_version": digest[:12],
        "spline_degree": DEGREES[content.kind],
        "spline_weights": WEIGHTS[content.degree],
        "height_integrals": HEIGHT_INTEGRALS,
        "out_of_range": OUT_OF_RANGE[content.kind],
        **DOCUMENTATION,
        "values_sha256": digest,
        "physics_sha256": provenance.physics_digest(MODULES[content.kind]),
        "physics_modules": " ".join(MODULES[content.kind]),
        "versions": json.dumps(versions(), sort_keys=True),
    }

    def write(path: str) -> None:
        with ONE_AT_A_TIME, netCDF4.Dataset(path, "w", format="NETCDF4") as dataset:
            _fill(dataset, content)
            dataset.setncatts(attributes)
            dataset.setncattr("attributes_sha256", _attributes_digest(dataset))

    try:
        body = written_bytes(target.name, write)
        write_file(target, body + SEAL + hashlib.sha256(body).hexdigest().encode() + b"\n")
    except (InputError, OSError) as fault:
        raise TableFileError(f"cannot write {target}: {fault}") from None
    return target


def _refuse(path: pathlib.Path, why: str, kind: str = "all") -> TableFileError:
    return TableFileError(f"{path}: {why}; make it anew with `python -m generate {kind}` or reinstall mbma_tables")


def read_sealed(path: pathlib.Path) -> bytes:
    """The netCDF bytes of a table file, checked against its seal."""
    try:
        status = path.stat()
        size = status.st_size
        content = path.read_bytes() if stat.S_ISREG(status.st_mode) and size <= LARGEST_FILE else None
    except OSError as fault:
        raise _refuse(path, f"cannot be read ({fault.strerror or fault})") from None
    if content is None:
        why = f"{size} bytes are more than any table has" if size > LARGEST_FILE else "is no regular file"
        raise _refuse(path, why)
    body, seal = content[:-SEAL_LENGTH], content[-SEAL_LENGTH:]
    if not seal.startswith(SEAL) or not seal.endswith(b"\n"):
        raise _refuse(path, "is no table file, or is cut short (no checksum at its end)")
    if seal[len(SEAL) : -1] != hashlib.sha256(body).hexdigest().encode():
        raise _refuse(path, "is damaged (its checksum does not match)")
    return body


def _content(contents: Contents, kind: str) -> TableContent:
    variables = contents.variables

    def array(name: str) -> Any:
        return np.ascontiguousarray(variables[name].values, dtype=np.float64)

    names = variables["log_ratio_F"].dimensions
    axes = tuple(
        Axis(
            name=name,
            long_name=own["long_name"],
            transform=own["transform"],
            offset=float(own["offset"]),
            low=float(own["first"]),
            high=float(own["last"]),
            nodes=variables[name].values.size,
        )
        for name, own in ((name, variables[name].attributes) for name in names)
    )
    main = {f"{what}_{function}" for what in MEANING for function in FUNCTIONS} | set(names)
    auxiliary = {
        name: (variable.dimensions, array(name), variable.attributes)
        for name, variable in variables.items()
        if name not in main and not name.startswith("conformance_")
    }
    conformance = {
        name.removeprefix("conformance_"): array(name) for name in variables if name.startswith("conformance_")
    }

    def both(what: str) -> Any:
        return np.stack([array(f"{what}_{function}") for function in FUNCTIONS], axis=-1)

    return TableContent(
        kind=kind,
        axes=axes,
        log_ratio=both("log_ratio"),
        coefficients=both("spline"),
        local_error=both("error"),
        auxiliary=auxiliary,
        conformance=conformance,
        attributes=contents.attributes,
    )


def _checked(source: pathlib.Path, contents: Contents, kind: str | None) -> TableContent:
    """The content of a file whose kind, format, attributes and values are as they were written."""
    attributes, variables = contents.attributes, contents.variables
    found = attributes.get("mbma_kind")
    if found not in KINDS or (kind is not None and found != kind):
        raise _refuse(source, f"holds a table of kind {found!r}, not {kind or ' or '.join(KINDS)}", kind or "all")
    version = attributes.get("format_version")
    if version != FORMAT_VERSION:
        raise _refuse(source, f"has format {version!r}, this library reads {FORMAT_VERSION}", found)
    if attributes.get("attributes_sha256") != _digest_of(
        attributes, {name: (variable.dimensions, variable.attributes) for name, variable in variables.items()}
    ):
        raise _refuse(source, "has attributes that were edited", found)
    # the stored axes, not ones computed anew: another processor's logarithm may differ in the last bit
    if provenance.digest_arrays({n: v.values for n, v in variables.items()}) != attributes["values_sha256"]:
        raise _refuse(source, "has values that do not match their hash", found)
    content = _content(contents, found)
    why = misfit(content)
    if why:
        raise _refuse(source, why, found)
    return content


def check_table(path: os.PathLike[str] | str, kind: str | None = None) -> tuple[TableContent, str | None]:
    """Open and check a table file as `read_table` does, without its warning.

    Returns
    -------
    content : TableContent
    stale : str or None
        Why the table is stale, if it is.
    """
    source = pathlib.Path(path)
    body = read_sealed(source)
    try:
        if source.resolve() == shipped_file(source.name).resolve():
            with ONE_AT_A_TIME:
                contents = contents_of(body)
        else:
            contents = foreign_contents(body)
        content = _checked(source, contents, kind)
    except TableFileError:
        raise
    except (OSError, RuntimeError, KeyError, AttributeError, TypeError, ValueError, IndexError) as fault:
        raise _refuse(source, f"is no table file ({fault})") from None
    return content, None


def read_table(path: os.PathLike[str] | str, kind: str | None = None) -> TableContent:
    """Open and check a table file.

    Parameters
    ----------
    path : path
        The file.
    kind : str, optional
        The kind that it must be.

    Raises
    ------
    TableFileError
        Where it is unreadable, damaged, edited, of another format or of another kind.

    Warns
    -----
    StaleTableWarning
        Where the solver has changed since the table was made.
    """
    content, stale = check_table(path, kind)
    if stale is not None:
        warnings.warn(stale, StaleTableWarning, stacklevel=2)
    return content
