"""Contact laws as data: CSV, JSON, MATLAB, netCDF, HDF5, Parquet; each returns the bytes of a file."""

import csv
import io
import json
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray, needed
from mbma_tables.common.files import written_bytes
from mbma_tables.export.law_table import Curve, LawTable
from mbma_tables.export.reserved_words import matlab_words
from mbma_tables.export.targets import AGAINST, Target
from mbma_tables.export.text import checked_name, comment, csv_cell, number

MAX_MATLAB_NAME = 63
READER = """function y = {name}(x)
{title}% Linear interpolation in {name}.mat; x and y in its units. Beyond the range: an error.
  rows = load('{name}.mat');
  row_x = rows.x(:); row_y = rows.y(:);
  if any(x(:) < row_x(1)) || any(x(:) > row_x(end))
    error('{name}: x must be in [%g, %g]', row_x(1), row_x(end));
  end
  y = interp1(row_x, row_y, x);
end
"""


def _header(law: LawTable) -> dict[str, Any]:
    return {
        "x": law.x_name,
        "y": law.y_name,
        "x_unit": law.x_unit,
        "y_unit": law.y_unit,
        "largest_error": law.largest_error,
        "theory": law.theory,
        "comments": list(law.comments),
        "floor": law.floor,
        "units": {name: unit for name, (_, unit) in law.columns.items()},
        "facts": {name: list(fact) for name, fact in law.facts.items()},
    }


def _cells(values: FloatArray) -> list[str]:
    """Numbers of a column as text; what is not known as "nan"."""
    return [number(value, infinity="inf", missing="nan") for value in values]


def to_csv(law: LawTable) -> bytes:
    """Columns with a header of comments."""
    stream = io.StringIO()
    stream.write(comment(law.comments, "#"))
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(
        [csv_cell(f"{name} [{unit}]") for name, (_, unit) in law.columns.items()]
    )
    columns = (_cells(values) for values, _ in law.columns.values())
    writer.writerows(zip(*columns, strict=True))
    return stream.getvalue().encode()


def to_json(law: LawTable) -> bytes:
    """One object: the header, and the columns by name; of a conductance those of its pressure as "behaviour"."""

    def content(table: LawTable) -> dict[str, Any]:
        return _header(table) | {
            "columns": {
                name: values.tolist() for name, (values, _) in table.columns.items()
            }
        }

    whole = content(law) | (
        {} if law.behaviour is None else {"behaviour": content(law.behaviour)}
    )
    return (json.dumps(whole, indent=1) + "\n").encode()


def to_matlab(law: LawTable) -> bytes:
    """A MATLAB file of version 5: x, y, and the header as text."""
    from scipy.io import savemat

    stream = io.BytesIO()
    text = {
        name: value
        for name, value in _header(law).items()
        if name not in ("x", "y", "comments", "facts")
    }
    comments = np.array(law.comments, dtype=object)
    named = {
        "x": law.x[:, None],
        "y": law.y[:, None],
        "x_name": law.x_name,
        "y_name": law.y_name,
    }
    named |= {name: values[:, None] for name, (values, _) in law.more.items()}
    savemat(stream, named | text | {"comments": comments}, format="5", oned_as="column")
    # the first 116 bytes are free text, where scipy writes the time: replaced, for identical bytes
    return b"MATLAB 5.0 MAT-file, mbma_tables".ljust(116) + stream.getvalue()[116:]


def matlab_reader(law: LawTable, name: str) -> bytes:
    """The function NAME.m that looks up the MATLAB file NAME.mat."""
    checked_name(name, MAX_MATLAB_NAME, matlab_words(READER), "matlab")
    return READER.format(name=name, title=comment(law.comments[1:2], "%")).encode()


def to_netcdf(law: LawTable) -> bytes:
    """A netCDF-4 file with CF attributes, which is an HDF5 file, too."""
    dataset = law.to_dataset()
    dataset.attrs = {
        "Conventions": "CF-1.11",
        "title": law.comments[0],
        "comment": "\n".join(law.comments),
        "largest_error": law.largest_error,
        "theory": law.theory,
        "interpolation": "linear",
        # CF 1.11, section 2.6.2; without a time, for identical bytes
        "history": law.comments[-1],
    }
    if law.x_name == "pressure":
        # CF takes a dimension of pressures for heights in the atmosphere: rows are counted,
        # and have their pressures
        dataset = dataset.rename_dims(pressure="row").drop_indexes("pressure")
    # CF 2.5.1: a coordinate has no missing values, nor has anything here
    whole = {name: {"_FillValue": None} for name in law.columns}
    return written_bytes(
        "law.nc", lambda path: dataset.to_netcdf(path, engine="netcdf4", encoding=whole)
    )


to_hdf5 = to_netcdf


def to_parquet(law: LawTable) -> bytes:
    """A Parquet file: two columns, the header as metadata of the schema."""
    pyarrow, parquet = (needed(module) for module in ("pyarrow", "pyarrow.parquet"))
    table = pyarrow.table({name: values for name, (values, _) in law.columns.items()})
    table = table.replace_schema_metadata(
        {name: json.dumps(value) for name, value in _header(law).items()}
    )
    stream = io.BytesIO()
    parquet.write_table(table, stream)
    return stream.getvalue()


def _matlab_files(law: LawTable, name: str) -> dict[str, bytes]:
    return {"": to_matlab(law), ".m": matlab_reader(law, name)}


def _curves(columns: Mapping[str, Any]) -> list[Curve]:
    """Columns against the first one."""
    arrays = {name: np.asarray(values, dtype=float) for name, values in columns.items()}
    x, *names = arrays
    return [Curve(name, arrays[x], arrays[name]) for name in names]


def read_csv(content: bytes) -> list[Curve]:
    """Columns below the comments."""
    text = content.decode()
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    head, *rows = csv.reader(lines)
    names = [cell.partition(" [")[0] for cell in head]
    return _curves(dict(zip(names, np.array(rows, dtype=float).T, strict=True)))


def read_json(content: bytes) -> list[Curve]:
    """Columns of the object."""
    return _curves(json.loads(content)["columns"])


def read_matlab(content: bytes) -> list[Curve]:
    """The vectors x and y by their names, and the other columns."""
    from scipy.io import loadmat

    held = loadmat(io.BytesIO(content))
    rows = held["x"].size
    columns = {}
    for name in ("x", "y"):
        columns[held[f"{name}_name"].item()] = held.pop(name)[:, 0]
    for name, values in held.items():
        if isinstance(values, np.ndarray) and values.shape == (rows, 1):
            columns[name] = values[:, 0]
    return _curves(columns)


def read_netcdf(content: bytes) -> list[Curve]:
    """Variables of the file."""
    import netCDF4

    with netCDF4.Dataset("law.nc", memory=content) as held:
        columns = {name: np.array(values[:]) for name, values in held.variables.items()}
    return _curves(columns)


def read_parquet(content: bytes) -> list[Curve]:
    """Columns of the table."""
    table = needed("pyarrow.parquet").read_table(io.BytesIO(content))
    return _curves({name: table[name].to_numpy() for name in table.column_names})


def _target(
    name: str,
    write: Callable[..., Any],
    read: Callable[[bytes], list[Curve]],
    tested: str,
    output: str = "rows with units and the header",
    **other: Any,
) -> Target:
    """A format of data, which takes any quantity."""
    return Target(
        name,
        write,
        quantities=tuple(AGAINST),
        output=output,
        tested=tested,
        read=read,
        **other,
    )


TARGETS = (
    _target("csv", to_csv, read_csv, "R 4.2"),
    _target("json", to_json, read_json, "Python's `json`"),
    _target("netcdf", to_netcdf, read_netcdf, "R 4.2, netCDF4 of Python"),
    _target(
        "hdf5", to_netcdf, read_netcdf, "h5py", "the netCDF file, which is one of HDF5"
    ),
    _target("parquet", to_parquet, read_parquet, "pyarrow"),
    _target(
        "matlab",
        _matlab_files,
        read_matlab,
        "Octave 7.3, to 1e-12",
        "a `.mat` file of version 5 and a function that interpolates in it",
        end=".mat",
        longest_name=MAX_MATLAB_NAME,
        beside=(".m",),
    ),
)
