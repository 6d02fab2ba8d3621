"""Tables of designs as files: CSV, Parquet and netCDF, read and written in chunks of rows."""

from __future__ import annotations

import contextlib
import csv
import itertools
import pathlib
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple, TextIO

import numpy as np

from mbma_tables.common.arguments import needed
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import drafted
from mbma_tables.common.netcdf import HDF5_LOCK

CHUNK = 20_000  # rows that are in memory at a time
LINES = 1_000  # of a file that are read together
_SPECIAL = re.compile('[,"\r\n]')  # signs that end cells or lines
_HEADER = re.compile(r"\s*(.*?)\s*(?:\[\s*(.*?)\s*\])?\s*")


class Chunk(NamedTuple):
    """Some rows of a table, their cells by column: lists of texts, or arrays of numbers."""

    columns: dict[str, Any]
    #: what is wrong with the form of rows, by their place in the chunk
    faults: dict[int, str]
    done: float  # share of the file up to its end, for progress

    @property
    def rows(self) -> int:
        """Their number."""
        return len(next(iter(self.columns.values())))


class RowSource(NamedTuple):
    """A table that is read in chunks."""

    units: dict[str, str]  # of each column, "" where its header has none
    headers: dict[str, str]  # of each column, as they are in the file
    chunks: Iterator[Chunk]


# what a file takes of a chunk: columns, or the lines of CSV
Rows = Mapping[str, Any] | str
Writer = Callable[[Rows], None]


def header_of(name: str, unit: str) -> str:
    """The header of a column, such as "area" and "pressure [GPa]"."""
    return f"{name} [{unit}]" if unit not in ("", "1") else name


def _source(path: object, headers: Sequence[str], chunks: Iterator[Chunk]) -> RowSource:
    """A source with these headers, each once."""
    names: dict[str, str] = {}
    units: dict[str, str] = {}
    for header in headers:
        match = _HEADER.fullmatch(header)
        name, unit = (match[1], match[2] or "") if match is not None else ("", "")
        if not name:
            raise InputError(f"{path}: a column has no name, its header is {header!r}")
        if name in names:
            raise InputError(f"{path}: two columns are named {name!r}")
        names[name] = header.strip()
        units[name] = unit
    return RowSource(units, names, chunks)


@contextlib.contextmanager
def opened(path: pathlib.Path) -> Iterator[RowSource]:
    """A table by the end of its name: .csv, .parquet or .nc; "-" is CSV from standard input."""
    kind = path.suffix
    if str(path) != "-" and not path.is_file():
        raise InputError(f"{path} cannot be read: it is no file")
    if str(path) == "-":
        yield _csv_source(path, sys.stdin, 0)
    elif kind == ".csv":
        with open(path, encoding="utf-8-sig", newline="") as stream:
            yield _csv_source(path, stream, path.stat().st_size)
    elif kind == ".parquet":
        with needed("pyarrow.parquet").ParquetFile(path) as file:
            yield _parquet_source(path, file)
    elif kind == ".nc":
        import netCDF4

        with HDF5_LOCK:
            data = netCDF4.Dataset(path)
        try:
            yield _netcdf_source(path, data)
        finally:
            with HDF5_LOCK:
                data.close()
    else:
        raise InputError(f"{path}: tables are .csv, .parquet or .nc")


def _csv_source(path: pathlib.Path, stream: TextIO, size: int) -> RowSource:
    read = [0]
    rows = csv.reader(itertools.chain.from_iterable(_counted(stream, read)))
    headers = next(rows, None)
    if headers is None:
        raise InputError(f"{path} has no header: the first line names the columns")
    names = list(_source(path, headers, iter(())).headers)

    def chunks() -> Iterator[Chunk]:
        while cells := _some(rows):
            yield _chunk_of_cells(names, cells, read[0] / size if size else 0.0)

    return _source(path, headers, chunks())


def _counted(stream: TextIO, read: list[int]) -> Iterator[list[str]]:
    """Lines without comments and empty ones, many together; the number of characters goes to `read`."""
    while lines := list(itertools.islice(stream, LINES)):
        read[0] += sum(map(len, lines))
        yield [line for line in lines if line[0] != "#" and not line.isspace()]


def _some(rows: Iterator[list[str]]) -> list[list[str]]:
    """The next rows, at most those of a chunk."""
    try:
        return list(itertools.islice(rows, CHUNK))
    except (csv.Error, UnicodeDecodeError) as fault:
        raise InputError(f"the table is no CSV: {fault}") from None


def _chunk_of_cells(names: list[str], cells: list[list[str]], done: float) -> Chunk:
    """Rows of text; those of another length are named."""
    width = len(names)
    faults = {}
    widths = np.fromiter(map(len, cells), int, len(cells))
    for k in np.flatnonzero(widths != width).tolist():
        row = cells[k]
        cut = f", the last ones {row[width:]}" if len(row) > width else ""
        faults[k] = f"the row has {len(row)} cells, the header {width}{cut}"
        cells[k] = (row + [""] * width)[:width]
    columns = zip(*cells, strict=True)
    return Chunk(
        {name: list(column) for name, column in zip(names, columns, strict=True)},
        faults,
        done,
    )


def _cells(column: Any) -> Any:
    """A column of another format: numbers as they are, other entries as texts, missing ones empty."""
    array = np.ma.asarray(column)
    if array.dtype.kind in "fiub":
        return np.ma.filled(array.astype(float), np.nan)
    return ["" if entry is None else str(entry) for entry in array.tolist()]


def _parquet_source(path: pathlib.Path, file: Any) -> RowSource:
    headers = file.schema_arrow.names
    names = list(_source(path, headers, iter(())).headers)
    total = max(file.metadata.num_rows, 1)

    def chunks() -> Iterator[Chunk]:
        read = 0
        for batch in file.iter_batches(batch_size=CHUNK):
            read += batch.num_rows
            columns = {
                name: _cells(column.to_numpy(zero_copy_only=False))
                for name, column in zip(names, batch.columns, strict=True)
            }
            yield Chunk(columns, {}, read / total)

    return _source(path, headers, chunks())


def _netcdf_source(path: pathlib.Path, data: Any) -> RowSource:
    with HDF5_LOCK:
        along = [v for v in data.variables.values() if v.ndim == 1]
        dimensions = {v.dimensions[0] for v in along}
        if len(dimensions) != 1 or len(along) != len(data.variables):
            raise InputError(
                f"{path}: every variable of a table of designs has the same one dimension"
            )
        units = {v.name: str(getattr(v, "units", "")) for v in along}
        total = int(along[0].shape[0])
    headers = [header_of(name, unit) for name, unit in units.items()]

    def chunks() -> Iterator[Chunk]:
        for start in range(0, total, CHUNK):
            some = slice(start, start + CHUNK)
            with HDF5_LOCK:
                columns = {name: _cells(data[name][some]) for name in units}
            yield Chunk(columns, {}, min(start + CHUNK, total) / total)

    return _source(path, headers, chunks())


@contextlib.contextmanager
def open_writer(path: pathlib.Path, units: Mapping[str, str]) -> Iterator[Writer]:
    """What writes rows, chunk by chunk, to a file that appears when all are written."""
    headers = {name: header_of(name, unit) for name, unit in units.items()}
    if str(path) == "-":
        yield _csv_writer(sys.stdout, headers)
        return
    with drafted(path) as draft:
        if is_csv(path):
            with open(draft, "x", encoding="utf-8", newline="") as stream:
                yield _csv_writer(stream, headers)
        elif path.suffix == ".parquet":
            with _parquet_writer(draft, headers) as write:
                yield write
        else:
            with _netcdf_writer(draft, units) as write:
                yield write


def require_writable(path: pathlib.Path) -> None:
    """Refuse a file of an unknown kind, before anything is computed."""
    if str(path) != "-" and path.suffix not in (".csv", ".parquet", ".nc"):
        raise InputError(f"--out must end with .csv, .parquet or .nc, got {path}")
    if path.suffix == ".parquet":
        needed("pyarrow.parquet")


def is_csv(path: pathlib.Path) -> bool:
    """Whether rows are written to it as lines of text."""
    return path.suffix == ".csv" or str(path) == "-"


def _csv_writer(stream: TextIO, headers: Mapping[str, str]) -> Writer:
    stream.write(",".join(_quoted(header) for header in headers.values()) + "\n")

    def write(rows: Rows) -> None:
        stream.write(rows if isinstance(rows, str) else csv_lines(rows, list(headers)))

    return write


def csv_lines(columns: Mapping[str, Any], names: Sequence[str]) -> str:
    """The lines of some columns in this order."""
    cells = [_written(columns[name]) for name in names]
    return "\n".join(map(",".join, zip(*cells, strict=True))) + "\n"


def _written(column: Any) -> Sequence[str]:
    """Cells of a column: numbers with all their digits, empty where there is none."""
    if not (isinstance(column, np.ndarray) and column.dtype.kind == "f"):
        texts = list(map(str, column))
        if not _SPECIAL.search("".join(texts)):
            return texts
        quoted = {text: _quoted(text) for text in set(texts)}
        return [quoted[text] for text in texts]
    missing = np.isnan(column)
    if missing.all():
        return [""] * column.size
    entries = list(map(repr, column.tolist()))
    for k in np.flatnonzero(missing).tolist():
        entries[k] = ""
    return entries


def _quoted(text: str) -> str:
    """A cell as it is, or in quotes where it has signs that end cells or lines."""
    if _SPECIAL.search(text):
        return '"' + text.replace('"', '""') + '"'
    return text


@contextlib.contextmanager
def _parquet_writer(draft: pathlib.Path, headers: Mapping[str, str]) -> Iterator[Writer]:
    pyarrow, parquet = (needed(module) for module in ("pyarrow", "pyarrow.parquet"))
    made: list[Any] = []

    def write(columns: Rows) -> None:
        assert not isinstance(columns, str)
        table = pyarrow.table({header: columns[name] for name, header in headers.items()})
        if not made:
            made.append(parquet.ParquetWriter(draft, table.schema))
        made[0].write_table(table)

    try:
        yield write
    finally:
        for writer in made:
            writer.close()


@contextlib.contextmanager
def _netcdf_writer(draft: pathlib.Path, units: Mapping[str, str]) -> Iterator[Writer]:
    import netCDF4

    with HDF5_LOCK:
        data = netCDF4.Dataset(draft, "x")
        data.createDimension("row", None)
    written = 0

    def write(columns: Rows) -> None:
        nonlocal written
        assert not isinstance(columns, str)
        with HDF5_LOCK:
            for name, unit in units.items():
                column = columns[name]
                is_number = isinstance(column, np.ndarray) and column.dtype.kind == "f"
                if name not in data.variables:
                    kind: Any = "f8" if is_number else str
                    data.createVariable(name, kind, ("row",)).units = unit or "1"
                rows = slice(written, written + len(column))
                data[name][rows] = column if is_number else np.array(column, dtype=object)
        written += len(column)

    try:
        yield write
    finally:
        with HDF5_LOCK:
            data.close()
