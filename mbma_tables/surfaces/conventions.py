"""Spectra by name of convention: conversions, averages, and files of contact.engineering.

"paper" and "isotropic" are spectra of an isotropic surface [length^4], "C1D" and "C1D+"
those of its traces [length^3]::

    paper:      h_rms^2 = 2 pi integral C q dq
    isotropic:  h_rms^2 = integral C q dq/(2 pi)     (C^2D, C^iso)
    C1D:        h_rms^2 = integral C dq/pi           (of both signs of q)
    C1D+:       h_rms^2 = integral C dq/(2 pi)       (of q > 0 alone, twice C1D)
"""

from __future__ import annotations

import csv
import dataclasses
import io
import math
import os
import pathlib
import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mbma_tables.common.arguments import (
    FloatArray,
    finite_array,
    needed,
    positive_array,
    require,
    require_name,
)
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import read_file
from mbma_tables.common.units import factor, known
from mbma_tables.surfaces.profiles import isotropic_spectrum
from mbma_tables.surfaces.spectrum import PowerLaws

# C over that of the first of its kind: "paper" or "C1D"
OVER_PAPER = {"paper": 1.0, "isotropic": 4 * math.pi**2}
OVER_C1D = {"C1D": 1.0, "C1D+": 2.0}
CONVENTIONS = (*OVER_PAPER, *OVER_C1D)
NODES = 16  # of a Gauss-Legendre rule between two samples
MAX_BYTES = 64 * 2**20
# series of contact.engineering, whose C is that of a convention times q to a power
SERIES = {
    "1D PSD along x": ("C1D", 1.0, 0),
    "1D PSD along y": ("C1D", 1.0, 0),
    "q/\N{GREEK SMALL LETTER PI} \N{MULTIPLICATION SIGN} 2D PSD": (
        "isotropic",
        math.pi,
        -1,
    ),
}
RECIPROCAL = "\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT ONE}"
COLUMNS = re.compile(r"Wavevector \(([^()]+)" + RECIPROCAL + r"\)")
ERROR = "standard error"


@dataclasses.dataclass(frozen=True, eq=False)
class MeasuredSpectrum:
    """A spectrum of a file, or an average.

    Attributes
    ----------
    name : str
        Of the measurement and the series.
    q, C : ndarray, shape (n,)
        Wavenumber [1/length] and spectrum, [length^4] or of traces [length^3].
    convention : {"paper", "isotropic", "C1D", "C1D+"}
        What C means.
    unit : str, optional
        Unit of length.
    error : ndarray, shape (n,), optional
        Standard error of C, NaN where not known.
    left_out : int
        Rows of the file in which C is not a number: bins without data.
    """

    name: str
    q: FloatArray
    C: FloatArray
    convention: str
    unit: str | None = None
    error: FloatArray | None = None
    left_out: int = 0

    def to(self, convention: str) -> MeasuredSpectrum:
        """The same spectrum by another convention; see `converted`."""
        C = converted(self.q, self.C, self.convention, convention)
        return dataclasses.replace(self, C=C, convention=convention, error=None)

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of `Surface.from_spectrum`."""
        names = ("q", "C", "convention", "unit")
        return {name: getattr(self, name) for name in names}


def converted(q: ArrayLike, C: ArrayLike, convention: str, to: str) -> FloatArray:
    """A spectrum by another convention, at the same wavenumbers.

    Parameters
    ----------
    q : array_like, shape (n,)
        Wavenumber [1/length], rising.
    C : array_like, shape (n,)
        Spectrum, a power law between neighbours: [length^4], of traces [length^3].
    convention, to : {"paper", "isotropic", "C1D", "C1D+"}
        Those of C and of the result. The spectrum of traces of an isotropic surface is
        4 pi integral of C q' dq'/sqrt(q'^2 - q^2), C being the paper's, over the wavenumbers
        given. Its inverse is a power law between nodes, as straight as C allows, and
        continued beyond the last wavenumber.

    Returns
    -------
    ndarray, shape (n,)

    Raises
    ------
    InputError, OutOfRangeError
        For an unknown convention, columns of different lengths, less than six wavenumbers
        of traces, and numbers that are not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from mbma_tables.surfaces.conventions import converted
    >>> q = np.geomspace(1, 100, 5)
    >>> float(converted(q, q**-3.6, "C1D+", "C1D")[0])
    0.5
    """
    for name, value in (("convention", convention), ("to", to)):
        require_name(name, value, CONVENTIONS)
    wavenumber = positive_array("q", q)
    values = positive_array("C", C)
    if wavenumber.ndim != 1 or wavenumber.shape != values.shape or wavenumber.size < 2:
        raise InputError(
            "q and C must be two columns of one length, of two rows or more, got shapes "
            f"{wavenumber.shape} and {values.shape}"
        )
    is_rising = np.append(True, np.diff(wavenumber) > 0)
    require("q", wavenumber, is_rising, "rising")
    if convention in OVER_PAPER:
        of_surface = values / OVER_PAPER[convention]
        if to in OVER_PAPER:
            return np.asarray(of_surface * OVER_PAPER[to])
        return OVER_C1D[to] * of_traces(wavenumber, of_surface)
    along_trace = values / OVER_C1D[convention]
    if to in OVER_C1D:
        return np.asarray(along_trace * OVER_C1D[to])
    return OVER_PAPER[to] * isotropic_spectrum(wavenumber, along_trace)


def of_traces(q: FloatArray, C: FloatArray) -> FloatArray:
    """C1D of the traces of an isotropic surface of power laws between samples."""
    laws = PowerLaws(q, C)
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    found = np.zeros(q.size)
    for place in range(q.size - 1):
        # with q'^2 = q^2 + t^2 the integrand is smooth
        ends = np.sqrt(np.maximum(q[place:] ** 2 - q[place] ** 2, 0.0))
        half = np.diff(ends)[:, None] / 2
        t = ends[:-1, None] + half * (1 + nodes)
        values = laws.at(np.hypot(q[place], t).ravel()).reshape(t.shape)
        found[place] = 4 * math.pi * float((half * values * weights).sum())
    return found


def average_spectra(
    spectra: Sequence[MeasuredSpectrum], lengths: ArrayLike | None = None
) -> MeasuredSpectrum:
    """The mean of spectra of one surface, each by the length of its traces.

    Parameters
    ----------
    spectra : sequence of MeasuredSpectrum
        Of one convention; in the unit of the first.
    lengths : array_like, optional
        Weights, the lengths of traces; equal by default.

    Returns
    -------
    MeasuredSpectrum
        At the wavenumbers of all; where some do not reach, the mean of the others.

    Raises
    ------
    InputError
        For no spectra, other conventions, units of some only, and weights that are not
        positive or of another number.
    """
    every = list(spectra)
    if not every or not all(isinstance(one, MeasuredSpectrum) for one in every):
        raise InputError("average_spectra takes one or more spectra, of read_spectra")
    weights = (
        np.ones(len(every)) if lengths is None else positive_array("lengths", lengths)
    )
    if weights.shape != (len(every),):
        raise InputError(
            f"lengths must be {len(every)} numbers, one of each spectrum, got shape "
            f"{weights.shape}"
        )
    first = every[0]
    others = sorted({one.convention for one in every})
    if len(others) > 1:
        raise InputError(
            f"spectra have the conventions {', '.join(others)}: spectrum.to(convention) "
            "converts one"
        )
    same = [_in_unit(one, first.unit) for one in every]
    q = np.unique(np.concatenate([one.q for one in same]))
    values = np.array([PowerLaws(one.q, one.C).at(q) for one in same])
    covered = np.array([(q >= one.q[0]) & (q <= one.q[-1]) for one in same])
    total = weights @ covered
    is_known = total > 0
    C = (weights @ values)[is_known] / total[is_known]
    name = f"mean of {len(same)} spectra"
    return MeasuredSpectrum(name, q[is_known], C, first.convention, first.unit)


def _in_unit(one: MeasuredSpectrum, unit: str | None) -> MeasuredSpectrum:
    if one.unit == unit:
        return one
    if unit is None or one.unit is None:
        raise InputError("some spectra have a unit of length and some do not")
    by = factor(one.unit, unit)
    power = 4 if one.convention in OVER_PAPER else 3
    return dataclasses.replace(one, q=one.q / by, C=one.C * by**power, unit=unit)


def read_spectra(path: str | os.PathLike[str]) -> list[MeasuredSpectrum]:
    r"""Spectra in a file of the analysis "Power spectrum" of contact.engineering.

    Parameters
    ----------
    path : path
        The text (.txt), the table (.csv), or with openpyxl the workbook (.xlsx) that the
        page exports.

    Returns
    -------
    list of MeasuredSpectrum
        The series "1D PSD along x" and "along y" are "C1D"; "q/pi x 2D PSD" is divided by
        q/pi and is "isotropic".

    Raises
    ------
    InputError
        For a file that is none of these, holds no spectrum, or numbers that are no spectrum.

    Examples
    --------
    >>> import pathlib
    >>> import tempfile
    >>> from mbma_tables.surfaces.conventions import read_spectra
    >>> folder = tempfile.TemporaryDirectory()
    >>> path = pathlib.Path(folder.name, "psd.txt")
    >>> rows = "\n".join(f"{q} {q**-3.0}" for q in (1, 2, 4, 8))
    >>> columns = "# Columns: Wavevector (µm⁻¹), PSD (µm³)"
    >>> _ = path.write_text(f"# 1D PSD along x\n# ---\n{columns}\n{rows}\n", "utf-8")
    >>> (spectrum,) = read_spectra(path)
    >>> spectrum.convention, spectrum.unit, spectrum.C.tolist()
    ('C1D', 'um', [1.0, 0.125, 0.015625, 0.001953125])
    >>> folder.cleanup()
    """
    place = pathlib.Path(path)
    if place.suffix.lower() == ".xlsx":
        tables = list(_tables_of_workbook(place))
    else:
        try:
            text = read_file(place, MAX_BYTES).decode("utf-8-sig")
        except UnicodeDecodeError:
            raise InputError(f"{place.name} is no text in UTF-8") from None
        is_table = ";" in next(iter(text.splitlines()), "")
        tables = list(_tables_of_csv(text) if is_table else _tables_of_text(text))
    found = [_spectrum(*table, place.name) for table in tables if table[1] in SERIES]
    if not found:
        names = sorted({table[1] for table in tables})
        raise InputError(
            f"{place.name} holds no spectrum, one of {', '.join(map(repr, SERIES))}"
            + (f"; it holds {', '.join(map(repr, names))}" if names else "")
        )
    return found


Table = tuple[str, str, str, list[list[str]]]  # subject, series, columns, rows


def _tables_of_text(text: str) -> Iterator[Table]:
    """The series of a text, each under its name and its columns."""
    subject = ""
    comments: list[str] = []
    rows: list[list[str]] = []
    current: tuple[str, str] | None = None
    for line in [*text.splitlines(), "# "]:
        words = line.lstrip("#").strip()
        if not line.startswith("#"):
            if line.strip() and current is not None:
                rows.append(line.split())
            continue
        if rows and current is not None:
            yield (subject, *current, rows)
            rows, current = [], None
        if match := re.fullmatch(r"(?:Topography|Measurement|Surface|Tag): (.*)", words):
            subject = match[1]
        if words.startswith("Columns:") and len(comments) > 1:
            current = comments[-2], words
        comments.append(words)


def _tables_of_csv(text: str) -> Iterator[Table]:
    """The series of a table with semicolons, by subject and series."""
    lines = list(csv.reader(io.StringIO(text), delimiter=";"))
    names = lines[0]
    columns = [k for k, name in enumerate(names) if COLUMNS.search(name)]
    if not columns or "Data series" not in names:
        return
    first = columns[0]
    subject = names.index("Subject name") if "Subject name" in names else None
    series = names.index("Data series")
    grouped: dict[tuple[str, str], list[list[str]]] = {}
    for line in lines[1:]:
        if len(line) < first + 2:
            continue
        key = ("" if subject is None else line[subject], line[series])
        grouped.setdefault(key, []).append(line[first : first + 3])
    header = ", ".join(names[first : first + 3])
    for (of, name), rows in grouped.items():
        yield of, name, header, rows


def _tables_of_workbook(path: pathlib.Path) -> Iterator[Table]:
    """The series of a workbook, a sheet each."""
    openpyxl = needed("openpyxl")
    content = io.BytesIO(read_file(path, MAX_BYTES))
    try:
        book = openpyxl.load_workbook(content, read_only=True, data_only=True)
    # it passes on any exception of its parsers
    except Exception as fault:
        raise InputError(f"{path.name} is no workbook: {fault}") from None
    for sheet in book.worksheets:
        rows = [list(row) for row in sheet.iter_rows(values_only=True)]
        labels = {str(row[0]): row[1] for row in rows[:5] if len(row) > 1}
        if "Data Series" not in labels or len(rows) < 7:
            continue
        names = [str(name or "") for name in rows[5][1:4]]
        body = [
            ["" if cell is None else str(cell) for cell in row[1:4]] for row in rows[6:]
        ]
        subject = str(labels.get("Subject", ""))
        yield subject, str(labels["Data Series"]), ", ".join(names), body


def _spectrum(
    subject: str, series: str, columns: str, rows: list[list[str]], file: str
) -> MeasuredSpectrum:
    """A spectrum of the text of its rows."""
    name = ": ".join(filter(None, (subject, series)))
    match = COLUMNS.search(columns)
    if match is None:
        raise InputError(
            f"{file}: {name} has the columns {columns!r}, not a wavevector and its unit, "
            "such as 'Wavevector (\N{MICRO SIGN}m" + RECIPROCAL + ")'"
        )
    widths = {len(row) for row in rows}
    if len(widths) != 1 or not widths <= {2, 3}:
        raise InputError(
            f"{file}: {name} must have two columns, or three with errors, got rows of "
            f"{', '.join(map(str, sorted(widths)))} numbers"
        )
    width = 3 if ERROR in columns and widths == {3} else 2
    try:
        numbers = np.array(
            [[float(cell or "nan") for cell in row[:width]] for row in rows]
        )
    except ValueError as fault:
        raise InputError(
            f"{file}: {name} holds words that are no numbers: {fault}"
        ) from None
    convention, times, power = SERIES[series]
    is_known = ~np.isnan(numbers[:, 1])
    q, C = (finite_array(each, numbers[is_known, k]) for k, each in enumerate("qC"))
    scale = times * positive_array("q", q) ** power
    error = scale * numbers[is_known, 2] if width == 3 else None
    C = scale * positive_array("C", C)
    left_out = int((~is_known).sum())
    return MeasuredSpectrum(
        name, q, C, convention, known(match[1].strip()), error, left_out
    )
