"""Contact laws as data: CSV, JSON, MATLAB, netCDF, HDF5, Parquet, workbooks; each returns the bytes of a file."""

import csv
import datetime
import io
import json
import math
import re
import zipfile
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray, finite_array, needed
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import written_bytes
from mbma_tables.export.law_table import MIN_ROWS, Curve, LawTable
from mbma_tables.export.reserved_words import matlab_words
from mbma_tables.export.targets import Target
from mbma_tables.export.text import checked_name, comment, csv_cell, number, printable

MAX_MATLAB_NAME = 63
LETTERS_OF_SHEET = 31  # of its name, as spreadsheets allow
ABOUT = "about"  # begins the names of sheets with errors and headers
OF_CELLS = 1e-15  # of the 16 digits that openpyxl writes
EPOCH = datetime.datetime(1980, 1, 1)
MODIFIED = re.compile(rb"(<dcterms:modified[^>]*>)[^<]*(</dcterms:modified>)")
# what a function takes, and where the rows are in the file
OF_ONE = {"arguments": "x", "place": ""}
OF_SEVERAL = {"arguments": "x, quantity", "place": ".(quantity)"}
READER = """function y = {name}({arguments})
{title}% Linear interpolation in {name}.mat; x and y in its units. Beyond the range: an error.
  rows = load('{name}.mat');
  rows = rows{place};
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


def to_json(law: LawTable | Sequence[LawTable]) -> bytes:
    """One object: the header, and the columns by name; of a conductance those of its pressure as "behaviour".

    Of several laws a list of such objects, as "laws".
    """
    whole = (
        _content(law)
        if isinstance(law, LawTable)
        else {"laws": [_content(one) for one in law]}
    )
    return (json.dumps(whole, indent=1) + "\n").encode()


def _content(law: LawTable) -> dict[str, Any]:
    """Header and columns of a law, and of the one beside it."""
    columns = {name: values.tolist() for name, (values, _) in law.columns.items()}
    content = _header(law) | {"columns": columns}
    if law.behaviour is not None:
        content["behaviour"] = _content(law.behaviour)
    return content


def from_json(content: bytes) -> list[LawTable]:
    """The laws of a file that `to_json` wrote.

    Raises
    ------
    InputError
        Where it is no such file.
    """
    try:
        whole = json.loads(content)
        return [_law_of(one) for one in whole.get("laws", [whole])]
    except (ValueError, KeyError, TypeError, AttributeError) as fault:
        raise InputError(
            f"this is no file of rows that `mbma export json` writes: {fault!r}"
        ) from None


def _law_of(content: Mapping[str, Any]) -> LawTable:
    """The law of an object, whose numbers are checked."""
    columns = {
        name: finite_array(name, values) for name, values in content["columns"].items()
    }
    x = columns.pop(content["x"])
    y = columns.pop(content["y"])
    for name, values in (("y", y), *columns.items()):
        if values.shape != x.shape or x.ndim != 1 or x.size < MIN_ROWS:
            raise InputError(f"{name} has shape {values.shape}, and x {x.shape}")
    if (np.diff(x) <= 0).any():
        raise InputError(f"{content['x']} must rise from row to row")
    more = {name: (values, content["units"][name]) for name, values in columns.items()}
    behaviour = content.get("behaviour")
    facts = {}
    for name, (value, unit) in content["facts"].items():
        facts[name] = (float(value), str(unit))
    return LawTable(
        x,
        y,
        x_name=str(content["x"]),
        y_name=str(content["y"]),
        x_unit=str(content["x_unit"]),
        y_unit=str(content["y_unit"]),
        largest_error=float(content["largest_error"]),
        comments=tuple(map(str, content["comments"])),
        theory=str(content["theory"]),
        floor=float(content["floor"]),
        behaviour=None if behaviour is None else _law_of(behaviour),
        more=more,
        facts=facts,
    )


def to_matlab(law: LawTable | Sequence[LawTable]) -> bytes:
    """A MATLAB file of version 5: x, y, and the header as text; of several laws a structure for each quantity."""
    from scipy.io import savemat

    stream = io.BytesIO()
    content = (
        _matlab_content(law)
        if isinstance(law, LawTable)
        else {one.quantity: _matlab_content(one) for one in law}
    )
    savemat(stream, content, format="5", oned_as="column")
    # the first 116 bytes are free text, where scipy writes the time: replaced, for identical bytes
    return b"MATLAB 5.0 MAT-file, mbma_tables".ljust(116) + stream.getvalue()[116:]


def _matlab_content(law: LawTable) -> dict[str, Any]:
    """Variables of a law."""
    text = {
        name: value
        for name, value in _header(law).items()
        if name not in ("x", "y", "comments", "facts")
    }
    named = {
        "x": law.x[:, None],
        "y": law.y[:, None],
        "x_name": law.x_name,
        "y_name": law.y_name,
    }
    named |= {name: values[:, None] for name, (values, _) in law.more.items()}
    return named | text | {"comments": np.array(law.comments, dtype=object)}


def matlab_reader(law: LawTable | Sequence[LawTable], name: str) -> bytes:
    """The function NAME.m that looks up the MATLAB file NAME.mat; of several laws by the quantity as well."""
    checked_name(name, MAX_MATLAB_NAME, matlab_words(READER), "matlab")
    if isinstance(law, LawTable):
        titles = law.comments[1:2]
        return READER.format(name=name, title=comment(titles, "%"), **OF_ONE).encode()
    titles = tuple(one.title for one in law)
    return READER.format(name=name, title=comment(titles, "%"), **OF_SEVERAL).encode()


def to_netcdf(law: LawTable | Sequence[LawTable]) -> bytes:
    """A netCDF-4 file with CF attributes, which is an HDF5 file, too; of several laws a group for each quantity."""
    if isinstance(law, LawTable):
        return written_bytes("law.nc", lambda path: _write_group(path, law, None, "w"))

    def write(path: str) -> None:
        for place, one in enumerate(law):
            _write_group(path, one, one.quantity, "a" if place else "w")

    return written_bytes("law.nc", write)


def _write_group(path: Any, law: LawTable, group: str | None, mode: Any) -> None:
    """Write a law into a group of a file, or into the file itself."""
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
    dataset.to_netcdf(path, engine="netcdf4", encoding=whole, group=group, mode=mode)


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


def to_xlsx(law: LawTable | Sequence[LawTable]) -> bytes:
    """A workbook: a sheet of rows for each law, and one with its errors, validity and the other lines of its header."""
    openpyxl = needed("openpyxl")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for one in [law] if isinstance(law, LawTable) else law:
        sheet = book.create_sheet(one.quantity[:LETTERS_OF_SHEET])
        names = [f"{name} [{unit}]" for name, (_, unit) in one.columns.items()]
        _append(sheet, names)
        columns = [values.tolist() for values, _ in one.columns.values()]
        for row in zip(*columns, strict=True):
            # an empty cell where a number is not known
            sheet.append([value if math.isfinite(value) else None for value in row])
        about = book.create_sheet(f"{ABOUT} {one.quantity}"[:LETTERS_OF_SHEET])
        about.append(["largest error", one.largest_error])
        _append(about, ["theory", one.theory])
        for line in one.comments:
            _append(about, [line])
    book.properties.created = book.properties.modified = EPOCH
    stream = io.BytesIO()
    book.save(stream)
    return _without_times(stream.getvalue())


def _append(sheet: Any, texts: Sequence[str]) -> None:
    """A row of texts, none of which is a formula."""
    sheet.append([printable(text) for text in texts])
    for cell in sheet[sheet.max_row]:
        cell.data_type = "s"


def _without_times(content: bytes) -> bytes:
    """The same archive with one time for all files, for identical bytes."""
    stream = io.BytesIO()
    with (
        zipfile.ZipFile(io.BytesIO(content)) as given,
        zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as written,
    ):
        for name in sorted(given.namelist()):
            text = given.read(name)
            if name == "docProps/core.xml":
                # openpyxl writes the time of saving
                text = MODIFIED.sub(rb"\g<1>1980-01-01T00:00:00Z\g<2>", text)
            written.writestr(zipfile.ZipInfo(name), text)
    return stream.getvalue()


def _matlab_files(law: LawTable | Sequence[LawTable], name: str) -> dict[str, bytes]:
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
    """Columns of the object, or of several."""
    whole = json.loads(content)
    curves = []
    for one in whole.get("laws", [whole]):
        curves += _curves(one["columns"])
    return curves


def read_matlab(content: bytes) -> list[Curve]:
    """The vectors x and y by their names, and the other columns."""
    from scipy.io import loadmat

    held = loadmat(io.BytesIO(content))
    if "x" in held:
        return _matlab_curves(held)
    curves = []
    for name, values in held.items():
        if not name.startswith("__"):
            record = values[0, 0]
            curves += _matlab_curves({key: record[key] for key in record.dtype.names})
    return curves


def _matlab_curves(held: dict[str, Any]) -> list[Curve]:
    """The vectors of a structure."""
    rows = held["x"].size
    columns = {}
    for name in ("x", "y"):
        columns[held[f"{name}_name"].item()] = held.pop(name)[:, 0]
    for name, values in held.items():
        # comments may be as many as rows
        is_numeric = isinstance(values, np.ndarray) and values.dtype.kind == "f"
        if is_numeric and values.shape == (rows, 1):
            columns[name] = values[:, 0]
    return _curves(columns)


def read_netcdf(content: bytes) -> list[Curve]:
    """Variables of the file, or of its groups."""
    import netCDF4

    curves = []
    with netCDF4.Dataset("law.nc", memory=content) as held:
        for group in (held, *held.groups.values()):
            if group.variables:
                found = group.variables.items()
                curves += _curves({name: np.array(values[:]) for name, values in found})
    return curves


def read_xlsx(content: bytes) -> list[Curve]:
    """Columns of the sheets of rows."""
    book = needed("openpyxl").load_workbook(io.BytesIO(content), read_only=True)
    curves = []
    for sheet in book.worksheets:
        if sheet.title.startswith(ABOUT):
            continue
        head, *rows = sheet.iter_rows(values_only=True)
        names = [str(cell).partition(" [")[0] for cell in head]
        columns = np.array(rows, dtype=float).T
        found = _curves(dict(zip(names, columns, strict=True)))
        curves += [curve._replace(rtol=OF_CELLS) for curve in found]
    return curves


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
    outside: str = "rows end there; the program that reads them decides",
    **other: Any,
) -> Target:
    """A format of data, which takes any quantity."""
    return Target(
        name,
        write,
        output=output,
        outside=outside,
        tested=tested,
        read=read,
        **other,
    )


TARGETS = (
    _target("csv", to_csv, read_csv, "R 4.2"),
    _target("json", to_json, read_json, "Python's `json`", several=True),
    _target("netcdf", to_netcdf, read_netcdf, "R 4.2, netCDF4 of Python", several=True),
    _target(
        "hdf5",
        to_netcdf,
        read_netcdf,
        "h5py",
        "the netCDF file, which is one of HDF5",
        several=True,
    ),
    _target("parquet", to_parquet, read_parquet, "pyarrow"),
    _target(
        "xlsx",
        to_xlsx,
        read_xlsx,
        "openpyxl 3.1",
        "a workbook: a sheet of rows with units for each quantity, and one with its error, "
        "validity and header",
        several=True,
    ),
    _target(
        "matlab",
        _matlab_files,
        read_matlab,
        "Octave 7.3, to 1e-12",
        "a `.mat` file of version 5 and a function that interpolates in it",
        end=".mat",
        longest_name=MAX_MATLAB_NAME,
        several=True,
        beside=(".m",),
        outside="an error of the function beside it",
    ),
)
