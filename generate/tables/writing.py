"""Write table files (netCDF-4): what every file says about its parts, and its fields with their labels."""

from __future__ import annotations

import hashlib
import json
import os
import pathlib
from collections.abc import Sequence
from typing import Any

import netCDF4
import numpy as np

from generate.provenance import MODULES, source_digest, versions
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError, TableFileError
from mbma_tables.common.files import write_file, written_bytes
from mbma_tables.tablefiles import schema
from mbma_tables.tablefiles.netcdf import HDF5_LOCK, SEAL, attributes_digest, digest_arrays
from mbma_tables.tablefiles.schema import check_content

CONVENTIONS = "CF-1.11"
ANSWERS = {schema.UNIVERSAL: "Phi_{f}", schema.ISLAND4D: "{f}_hat"}

OUT_OF_RANGE = {
    schema.UNIVERSAL: "outside the cells there is no answer: never clamp, never extrapolate",
    schema.ISLAND4D: (
        "below the smallest spread, g = g(X, first spread, sphere, hurst) mu/mu(first spread, sphere, hurst): first "
        "order about the rigid sphere, within the stated error; anywhere else outside the axes there is no answer: "
        "never clamp, never extrapolate"
    ),
}
WEIGHTS = "w0 = v^3/6, w1 = 2/3 - u^2 (1 - u/2), w2 = 2/3 - v^2 (1 - v/2), w3 = u^3/6, with v = 1 - u"
HEIGHT_INTEGRALS = (
    "F_n(x) = integral from x to infinity of (z - x)^n phi(z) dz, phi(z) = exp(-z^2/2)/sqrt(2 pi). To 1e-13 for "
    "-42 <= x <= 7 and n = 2 or 5/2: F_n(x) = h sum over k = -192 ... 272 of "
    "t^(n + 1) (1 + exp(-u)) phi(x + t), with h = 1/64, u = k h, t = exp(u - exp(-u))"
)
SYMBOLS = (
    "delta approach of the island, h_d how far its top stands below the highest; R_d radius of the sphere "
    "(band [1, zeta_d]); R_u radius of its summits (band [1, zeta_u]); D density, sigma standard deviation of height "
    "of its summits (band [zeta_d, zeta_u]); eta share of a summit's contact that is real; E* contact modulus; "
    "q0 smallest wave number; zeta_1 largest magnification"
)
ERROR_FIELD = {
    schema.UNIVERSAL: "error_F and error_A bound the relative error in each cell",
    schema.ISLAND4D: (
        "error_F and error_A bound the relative error, each over one cell of a coarser grid: an axis of n nodes has "
        "c equal cells in position, and cell k holds the positions with k = min(floor(position c/(n - 1)), c - 1)"
    ),
}
AXIS_ERRORS = ". axis_errors: largest error (F, A) from interpolating along one axis alone"
# what every file says about its parts
DOCUMENTATION = {
    "certificate": (
        "largest_error, p99_error and median_error are relative errors of the table on certificate_points held-out "
        "points, solved on twice the nodes that made the table: half over the whole box, half (visited) at islands "
        "of random surfaces"
    ),
    "conformance": (
        "Points to replay in any language: conformance_ and the name of an argument; table_F, table_A: what this table "
        "answers; exact_F, exact_A: what the solver answers; tolerance: largest relative difference to allow between "
        "a reader's answers and table_F, table_A, or a solver's and exact_F, exact_A"
    ),
    "hashes": (
        "values_sha256: for each variable, sorted by name, the text name:<f8:shape; (shape as (3,) or (3, 4)) and "
        "then its values as little-endian doubles, last dimension fastest. attributes_sha256: the JSON text of "
        "{variable: {attribute: value}}, with 'dimensions' as a further attribute of each, '' for the global ones "
        "without attributes_sha256; keys sorted, no spaces, non-ASCII escaped, shortest floats. configuration_sha256: "
        "the same form of the list of configuration and variant_numbers. data_version: the first 12 digits of "
        "values_sha256. source_sha256: the bytes of the files of source_modules, one after the other, when the table "
        "was made; a record only"
    ),
    "seal": (
        "the netCDF bytes are followed by one line: a newline, 'mbma-table sha256 ', the SHA-256 of all bytes before "
        "that newline in 64 hexadecimal digits, a newline; netCDF readers ignore it"
    ),
}
MEANING = {
    "chebyshev": "coefficients of Chebyshev polynomials of X and of mu in each cell, of {chebyshev}",
    "spline": "coefficients of cardinal B-splines that interpolate log_ratio_{f}",
    "error": "bound on the relative error of Phi_{f} in this part of the table",
}
OF_SPLINES = {
    "spline_degree": schema.DEGREE,
    "spline_weights": WEIGHTS,
    "height_integrals": HEIGHT_INTEGRALS,
    "certificate": DOCUMENTATION["certificate"] + AXIS_ERRORS,
}
CONFORMANCE = {
    "table": "{answer} by this table, at the conformance points",
    "exact": "{answer} by the solver, at the conformance points",
    "tolerance": "largest relative difference to allow at the conformance points",
}


def labels_of_cells(edges: FloatArray) -> dict[str, Any]:
    """The edges of the universal table's cells, (4, cells) in the order of `CELL_EDGES`, as auxiliary variables."""
    rows = zip(schema.CELL_EDGES.items(), edges, strict=True)
    return {name: (("cell",), row, _label(text)) for (name, text), row in rows}


def labels_of_nodes(axes: tuple[schema.Axis, ...], log_ratio: FloatArray) -> dict[str, Any]:
    """Of a table over nodes: `log_ratio` there, and coordinates of coefficients and of the error field's cells."""
    names = tuple(axis.name for axis in axes)
    labels: dict[str, Any] = {}
    for number, f in enumerate(schema.FUNCTIONS):
        text = f"natural logarithm of Phi_{f} over its value for a rigid sphere, at the nodes"
        labels[f"log_ratio_{f}"] = (names, log_ratio[..., number], _label(text))
    for axis in axes:
        pad = (schema.DEGREE - 1) // 2
        cells = error_cells(axis)
        middles = (np.arange(cells) + 0.5) * ((axis.nodes - 1) / cells)
        knots = np.arange(-pad, axis.nodes + pad, dtype=float)
        text = f"middle of the error field's cells along {axis.name}, as {axis.name}"
        labels[f"{axis.name}_cell"] = ((f"{axis.name}_cell",), axis.coordinate(middles), _label(text))
        text = f"position along {axis.name}, in node units, of the middle of a coefficient's B-spline"
        labels[f"{axis.name}_knot"] = ((f"{axis.name}_knot",), knots, _label(text))
    return labels


def _label(text: str) -> dict[str, Any]:
    return {"long_name": text, "units": "1"}


def numbered(name: str, lines: Sequence[str]) -> dict[str, str]:
    """Steps as attributes in their order, one line of a header each."""
    return {f"{name}_{number:02d}": line for number, line in enumerate(lines, 1)}


def error_cells(axis: schema.Axis, largest: int = 32) -> int:
    """Cells of the error field along an axis: as the nodes where those are few."""
    return min(axis.nodes - 1, largest)


def _fill(dataset: netCDF4.Dataset, content: schema.TableContent) -> None:
    def add(name: str, dimensions: tuple[str, ...], values: Any, attributes: dict[str, Any]) -> None:
        variable = dataset.createVariable(
            name, "f8", dimensions, zlib=True, complevel=6, shuffle=True, endian="little", fill_value=False
        )
        variable.setncatts(attributes)
        variable[...] = values

    over_coefficients, over_cells = schema.dimensions(content.kind)
    names = tuple(axis.name for axis in content.axes)
    for axis in content.axes:
        dataset.createDimension(axis.name, axis.nodes)
        add(axis.name, (axis.name,), axis.values, axis.attributes())
    sizes = dict(zip(over_cells, content.local_error.shape, strict=False))
    for name, size in (sizes | dict(zip(over_coefficients, content.coefficients.shape, strict=False))).items():
        dataset.createDimension(name, size)
    for number, function in enumerate(schema.FUNCTIONS):
        for what, over, array in (
            (schema.COEFFICIENTS[content.kind], over_coefficients, content.coefficients),
            ("error", over_cells, content.local_error),
        ):
            text = MEANING[what].format(f=function, chebyshev=("Phi_F/mu", "Phi_A")[number])
            add(f"{what}_{function}", over, array[..., number], {"long_name": text, "units": "1"})
    beside = " ".join(n for n, entry in content.auxiliary.items() if set(entry[0]) < set(names))
    for name, (over, values, attributes) in content.auxiliary.items():
        add(name, over, values, attributes | ({"coordinates": beside} if over == names and beside else {}))
    points = next(iter(content.conformance.values())).size
    dataset.createDimension("conformance", points)
    for name, values in content.conformance.items():
        what, _, function = name.rpartition("_") if name[-2:] in ("_F", "_A") else (name, "", "")
        text = CONFORMANCE.get(what, f"argument {name} of the conformance points")
        meaning = {"long_name": text.format(answer=ANSWERS[content.kind].format(f=function)), "units": "1"}
        add(f"conformance_{name}", ("conformance",), values, meaning)


def write_table(path: os.PathLike[str] | str, content: schema.TableContent) -> pathlib.Path:
    """Write a table file, whole or not at all."""
    target = pathlib.Path(path)
    check_content(content)
    digest = digest_arrays(content.arrays())
    attributes = {
        "Conventions": CONVENTIONS,
        # where the values came from, unless the table was read from a file that says so
        "source_sha256": source_digest(MODULES[content.kind]),
        "source_modules": " ".join(MODULES[content.kind]),
        "versions": json.dumps(versions(), sort_keys=True),
        **{name: value for name, value in content.attributes.items() if name != "attributes_sha256"},
        "mbma_kind": content.kind,
        "format_version": schema.FORMAT_VERSIONS[content.kind],
        "data_version": digest[:12],
        "out_of_range": OUT_OF_RANGE[content.kind],
        "error_field": ERROR_FIELD[content.kind],
        **DOCUMENTATION,
        **(OF_SPLINES if content.kind == schema.ISLAND4D else {}),
        "values_sha256": digest,
    }

    def write(path: str) -> None:
        with HDF5_LOCK, netCDF4.Dataset(path, "w", format="NETCDF4") as dataset:
            _fill(dataset, content)
            dataset.setncatts(attributes)
            dataset.setncattr("attributes_sha256", attributes_digest(dataset))

    try:
        body = written_bytes(target.name, write)
        write_file(target, body + SEAL + hashlib.sha256(body).hexdigest().encode() + b"\n")
    except (InputError, OSError) as fault:
        raise TableFileError(f"cannot write {target}: {fault}") from None
    return target
