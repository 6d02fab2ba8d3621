"""Write table files (netCDF-4): their fields with labels, and the texts of `texts.toml`."""

import hashlib
import json
import os
import pathlib
import tomllib
from typing import Any

import netCDF4
import numpy as np

from mbma_tables.common.errors import InputError, TableFileError
from mbma_tables.common.files import write_file, written_bytes
from mbma_tables.common.netcdf import HDF5_LOCK, SEAL, attributes_digest, digest_arrays
from mbma_tables.tables import schema as schema
from mbma_tables.tables.schema import check_content
from mbma_tables.tables.sources import MODULES, source_digest, versions

CONVENTIONS = "CF-1.11"
ANSWERS = {schema.UNIVERSAL: "Phi_{f}", schema.ISLAND4D: "{f}_hat"}
TEXTS = tomllib.loads(
    pathlib.Path(__file__).with_name("texts.toml").read_text(encoding="utf-8")
)
OF_WRITING = (
    "out_of_range",
    "error_field",
    "spline_weights",
    "height_integrals",
    "certificate",
)


def about(kind: str, **numbers: Any) -> dict[str, str]:
    """What a table of a kind says of itself, the steps of a lookup numbered and filled with numbers."""
    own = {
        name: text
        for name, text in TEXTS[kind].items()
        if name not in (*OF_WRITING, "lookup")
    }
    lines = {
        f"lookup_{number:02d}": line.format(**numbers)
        for number, line in enumerate(TEXTS[kind]["lookup"], 1)
    }
    return own | {"symbols": TEXTS["symbols"]} | lines


def label(text: str) -> dict[str, Any]:
    """Attributes of a variable without a unit."""
    return {"long_name": text, "units": "1"}


def _fill(dataset: netCDF4.Dataset, content: schema.TableContent) -> None:
    packed: dict[str, Any] = {
        "zlib": True,
        "complevel": 6,
        "shuffle": True,
        "endian": "little",
        "fill_value": False,
    }

    def add(
        name: str, dimensions: tuple[str, ...], values: Any, attributes: dict[str, Any]
    ) -> None:
        for dimension, size in zip(dimensions, np.shape(values), strict=True):
            if dimension not in dataset.dimensions:
                dataset.createDimension(dimension, size)
        variable = dataset.createVariable(name, "f8", dimensions, **packed)
        variable.setncatts(attributes)
        variable[...] = values

    over_coefficients, over_cells = schema.dimensions(content.kind)
    names = tuple(axis.name for axis in content.axes)
    for axis in content.axes:
        add(axis.name, (axis.name,), axis.values, axis.attributes())
    for number, function in enumerate(schema.FUNCTIONS):
        for what, over, array in (
            (schema.COEFFICIENTS[content.kind], over_coefficients, content.coefficients),
            ("error", over_cells, content.local_error),
        ):
            text = TEXTS["meaning"][what].format(
                f=function, chebyshev=("Phi_F/mu", "Phi_A")[number]
            )
            add(f"{what}_{function}", over, array[..., number], label(text))
    beside = " ".join(
        n for n, entry in content.auxiliary.items() if set(entry[0]) < set(names)
    )
    for name, (over, values, attributes) in content.auxiliary.items():
        add(
            name,
            over,
            values,
            attributes | ({"coordinates": beside} if over == names and beside else {}),
        )
    for name, values in content.conformance.items():
        what, _, function = (
            name.rpartition("_") if name[-2:] in ("_F", "_A") else (name, "", "")
        )
        text = TEXTS["meaning"].get(
            f"conformance_{what}", f"argument {name} of the conformance points"
        )
        text = text.format(answer=ANSWERS[content.kind].format(f=function))
        add(f"conformance_{name}", ("conformance",), values, label(text))


def write_table(
    path: os.PathLike[str] | str, content: schema.TableContent
) -> pathlib.Path:
    """Write a table's file whole, or raise TableFileError and write nothing."""
    target = pathlib.Path(path)
    check_content(content)
    digest = digest_arrays(content.arrays())
    attributes = {
        "Conventions": CONVENTIONS,
        # where the values came from, unless the table was read from a file that has it
        "source_sha256": source_digest(MODULES[content.kind]),
        "source_modules": " ".join(MODULES[content.kind]),
        "versions": json.dumps(versions(), sort_keys=True),
        **{
            name: value
            for name, value in content.attributes.items()
            if name != "attributes_sha256"
        },
        "mbma_kind": content.kind,
        "format_version": schema.FORMAT_VERSIONS[content.kind],
        "data_version": digest[:12],
        **TEXTS["documentation"],
        **{
            name: text for name, text in TEXTS[content.kind].items() if name in OF_WRITING
        },
        **({"spline_degree": schema.DEGREE} if content.kind == schema.ISLAND4D else {}),
        "values_sha256": digest,
    }

    def write(path: str) -> None:
        with HDF5_LOCK, netCDF4.Dataset(path, "w", format="NETCDF4") as dataset:
            _fill(dataset, content)
            dataset.setncatts(attributes)
            dataset.setncattr("attributes_sha256", attributes_digest(dataset))

    try:
        body = written_bytes(target.name, write)
        write_file(
            target, body + SEAL + hashlib.sha256(body).hexdigest().encode() + b"\n"
        )
    except (InputError, OSError) as fault:
        raise TableFileError(f"cannot write {target}: {fault}") from None
    return target
