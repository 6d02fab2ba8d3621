"""Reading of measured maps and line scans from files, arrays and topographies.

Most formats are read by SurfaceTopography (the extra `maps`).
"""

import contextlib
import io
import itertools
import math
import os
import pathlib
import re
import sys
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np

from mbma_tables.common.arguments import finite_array, needed, one_number, require
from mbma_tables.common.errors import InputError, MbmaError
from mbma_tables.common.files import numbers_of, read_file
from mbma_tables.common.units import factor, known

LISTS = (2, 3)  # columns of a list of points, as opposed to a matrix of heights
MAX_TEXT_BYTES = 256 * 2**20
MAX_HEADER_BYTES = 2**14
TEXTS = (".csv", ".txt", ".asc", ".xyz")  # names of files that hold numbers as text
CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1f\x7f]")  # bytes that no text has
INFINITE = re.compile(rb"(?i)(?<![a-z])inf(inity|inite)?(?![a-z])")
# rows of numbers of a text, with separators of any kind
ROW = re.compile(rb"[-+\d.,;\seEnNaA]*")
DIGIT = re.compile(rb"\d")
SEPARATORS = re.compile(rb"[ \t;,]+")
HEADS = (b"X;Y;valid", b"Scan Parameters")  # of formats with tables of their own
LEAST_FILLED = 0.5  # share of a grid that the points of a list with missing rows fill
SAME_PLACE = 1e-6  # over the extent: smaller differences of coordinates are rounding
OFF_GRID = 0.1  # sampling steps by which rounded coordinates may be off an even grid
LONGEST_GAP = 2.5  # over the median step of a line scan
BYTE_ORDER_MARK = b"\xef\xbb\xbf"  # of UTF-8
# blanks that are no space: unbreakable, thin, figure and narrow ones
BLANKS = re.compile("[\u00a0\u2007\u2009\u202f]")
NUMBER = re.compile(r"(?<![^\s;,])[-+]?[.,]?\d[-+\d.,eE]*(?![^\s;,])")
# formats that define heights which are not finite as undefined
UNDEFINED_IF_INFINITE = ("DATXReader", "OPDReader")
# in any unit: their fourth powers, as in C, neither overflow nor underflow
MIN_LENGTH = 1e-30
MAX_LENGTH = 1e30


def library() -> Any:
    """SurfaceTopography, without its warnings on missing optional parts."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return needed("SurfaceTopography")


def read_measurement(
    path: str | os.PathLike[str],
    dx: float | None = None,
    dy: float | None = None,
    unit: str | None = None,
    channel: int | None = None,
) -> Any:
    """The topography or line scan in a file of any format of SurfaceTopography, or text.

    The path "-" is standard input.
    Sampling steps, in `unit`, are of files that have none, and so is the unit. A list of
    points may name units in the header of its columns, like "x [um]". Rows of a matrix
    without lengths are x, as those of an array. Numbers of a text are separated by
    semicolons, tabs, blanks or commas; a comma is a decimal mark where another separator is
    used.
    """
    module = library()
    place = pathlib.Path(path)
    piped = os.fspath(path) == "-"
    if not piped and not os.path.isfile(place):
        raise InputError(
            "there is no file "
            f"{os.fspath(path)!r}{': it is a folder' if os.path.isdir(place) else ''}"
        )
    suffix = place.suffix.lower()
    with warnings.catch_warnings():
        # its readers warn of faults that they correct
        warnings.simplefilter("ignore")
        try:
            # opened here, because its readers leave unreadable files open
            with (
                io.BytesIO(sys.stdin.buffer.read())
                if piped
                else open(place, "rb") as stream
            ):
                start = stream.read(MAX_HEADER_BYTES)
                if suffix in TEXTS and CONTROL.search(start):
                    # a binary format would be recognised in nearly any bytes
                    raise InputError(
                        f"{place.name} is no text, as its name says: rename it to its own format"
                    )
                named = _units_of_header(start)
                stream.seek(0)
                _refuse_cut_short(stream, place.name)
                plain = _without_mark(stream)
                _refuse_mixed_marks(plain, place.name)
                with module.open_topography(plain) as reader:
                    topography = _completed(
                        reader, plain, place, (dx, dy, unit, channel, named)
                    )
                    if type(reader).__name__ == "AscReader":
                        _refuse_lost_lines(plain, topography, place.name)
                    _refuse_infinite(reader, topography, place.name)
                    return topography
        except MbmaError:
            raise
        # its readers pass on any exception of their parsers
        except Exception as fault:
            reason = str(fault).strip().splitlines() or [type(fault).__name__]
            name = type(fault).__name__
            why = (
                "no reader supports its format"
                if name == "CannotDetectFileFormat"
                else f"{name}: {reason[0]}"
            )
        if suffix in TEXTS:
            plain = io.BytesIO(_plain_matrix(place, why))
            with module.open_topography(plain) as reader:
                return _completed(reader, plain, place, (dx, dy, unit, channel, named))
        raise InputError(
            f"SurfaceTopography cannot read {os.fspath(path)!r} as a map: {why}"
        )


def _refuse_cut_short(stream: Any, name: str) -> None:
    """Raise an error for an array of numpy that ends too early; its reader makes up the rest."""
    wanted = found = 0
    if stream.read(len(np.lib.format.MAGIC_PREFIX)) == np.lib.format.MAGIC_PREFIX:
        stream.seek(0)
        # a fault in the header is the reader's to judge
        with contextlib.suppress(ValueError):
            wanted = _bytes_of_array(stream)
        found = -stream.tell() + stream.seek(0, io.SEEK_END)
    stream.seek(0)
    if found < wanted:
        raise InputError(
            f"{name} is cut short: its header names {wanted} bytes of heights, and it holds "
            f"{found}"
        )


def _bytes_of_array(stream: Any) -> int:
    """Bytes behind the header of an array of numpy, which is read."""
    layout = np.lib.format
    major, _ = layout.read_magic(stream)
    header = layout.read_array_header_1_0 if major == 1 else layout.read_array_header_2_0
    shape, _, kind = header(stream)
    # objects have no size of their own
    return 0 if kind.hasobject else math.prod(shape) * kind.itemsize


def _refuse_mixed_marks(stream: Any, name: str) -> None:
    """Raise an error for a text whose rows of numbers have commas in part.

    A reader takes rows up to the last one that differs as those of a header.
    """
    start = stream.read(MAX_HEADER_BYTES)
    if CONTROL.search(start) or start.startswith(HEADS):
        stream.seek(0)
        return
    with_comma: dict[bool, int] = {}
    stream.seek(0)
    for place, line in enumerate(stream, 1):
        if _is_row(line) and len(line.split()) + line.count(b";") > 1:
            with_comma.setdefault(b"," in line, place)
    stream.seek(0)
    if len(with_comma) > 1:
        raise InputError(
            f"{name} has decimal commas in line {with_comma[True]} and none in line "
            f"{with_comma[False]}: write all numbers with one decimal mark"
        )


def _is_row(line: bytes) -> bool:
    """Whether a line of a text holds numbers alone."""
    return bool(ROW.fullmatch(line)) and bool(DIGIT.search(line))


def _completed(reader: Any, stream: Any, path: pathlib.Path, options: Any) -> Any:
    """The channel of an open file, in which missing rows of a list are undefined points."""
    dx, dy, unit, channel, named = options
    chosen = reader.default_channel
    is_list = type(reader).__name__ in ("AscReader", "XYZReader")
    if is_list:
        is_grid = chosen.physical_sizes is not None and len(chosen.nb_grid_pts) == 2
        if is_grid or 3 in chosen.nb_grid_pts:
            content = _with_missing_rows(stream, path.name)
            if content is not None:
                stream = io.BytesIO(content)
                with library().open_topography(stream) as complete:
                    return _channel_of(complete, path, dx, dy, unit, channel, named)
    return _channel_of(reader, path, dx, dy, unit, channel, named)


def _with_missing_rows(stream: Any, name: str) -> bytes | None:
    """A list of x, y and height with a row for each point of its grid; None if it has all.

    None also for a text that is no such list.
    """
    stream.seek(0)
    lines = stream.read().splitlines()
    stream.seek(0)
    comments = {line: None for line in lines if line.lstrip().startswith(b"#")}
    content = [line.strip() for line in lines if line.strip() and line not in comments]
    first = next((k for k, line in enumerate(content) if _is_row(line)), 0)
    rows = content[first:]
    if not all(map(_is_row, rows)):
        # words among the rows, such as those for infinity, are the reader's to judge
        return None
    words = [SEPARATORS.split(row) for row in rows]
    widths = set(map(len, words))
    if widths != {len(("x", "y", "height"))}:
        return None
    points = numbers_of([b" ".join(row).decode() for row in words], None)
    places = [_places(points[:, axis], "xy"[axis], name) for axis in (0, 1)]
    counts = [int(place.max()) + 1 for place, _ in places]
    flat = places[0][0] * counts[1] + places[1][0]
    if np.unique(flat).size < flat.size:
        raise InputError(f"{name} has several heights at one x and y: write one row each")
    size = counts[0] * counts[1]
    if flat.size == size:
        return None
    if flat.size < LEAST_FILLED * size:
        raise InputError(
            f"{name} holds {flat.size} points, {flat.size / size:.0%} of a grid of "
            f"{counts[0]} x {counts[1]} on which all of them lie: a list of x, y and height "
            "is read where its points fill a grid of even steps, but for missing rows"
        )
    heights = np.full(size, np.nan)
    heights[flat] = points[:, 2]
    x, y = (axis[1] for axis in places)
    filled = io.BytesIO()
    filled.writelines(comment + b"\n" for comment in comments)
    columns = [np.repeat(x, counts[1]), np.tile(y, counts[0]), heights]
    np.savetxt(filled, np.transpose(columns), fmt="%.12g")
    return filled.getvalue()


def _places(values: Any, axis: str, name: str) -> tuple[Any, Any]:
    """Number of each coordinate on a grid of even steps, and the coordinates of the grid."""
    if not np.isfinite(values).all():
        raise InputError(f"{name} has points whose {axis} is no number")
    first = float(values.min())
    span = float(values.max()) - first
    gaps = np.diff(np.unique(values))
    gaps = gaps[gaps > SAME_PLACE * span]
    if not gaps.size:
        raise InputError(f"all points of {name} have one {axis}")
    count = round(span / float(gaps.min()))
    place = (values - first) / (span / count)
    number = np.rint(place).astype(int)
    off = np.abs(place - number)
    if off.max() > OFF_GRID:
        row = int(off.argmax())
        raise InputError(
            f"{name}: {axis} = {values[row]:g} of point {row + 1} is {off.max():.2f} steps "
            f"off a grid of even steps of {span / count:g}"
        )
    return number, first + span / count * np.arange(count + 1)


def _without_mark(stream: Any) -> Any:
    """The same stream, or the rest of it as one where it begins with a byte-order mark.

    With the mark the first number of a text is none, and its row would be lost.
    """
    begins = stream.read(len(BYTE_ORDER_MARK)) == BYTE_ORDER_MARK
    if begins:
        return io.BytesIO(stream.read())
    stream.seek(0)
    return stream


def _refuse_lost_lines(stream: Any, topography: Any, name: str) -> None:
    """Raise an error for rows of a text that its reader skips, or takes as undefined.

    It skips lines in which anything is no number, as those of a header, and reads the
    words for infinity as undefined heights.
    """
    stream.seek(0)
    row = min(topography.nb_grid_pts)
    for place, line in enumerate(stream, 1):
        if line.lstrip().startswith(b"#"):
            continue
        if INFINITE.search(line):
            raise InputError(_infinite(name))
        words = line.split()
        other = [word for word in words if not _is_height(word)]
        if other and 2 * (len(words) - len(other)) >= row:
            raise InputError(
                f"{name}: line {place} holds {len(words) - len(other)} numbers and "
                f"{len(other)} words that are none: write NaN where a height is undefined, "
                "and # before lines that are no heights"
            )


def _is_height(word: bytes) -> bool:
    """Whether a word of a text is a number, or says that a height is undefined."""
    if word.lower() in (b"bad", b"nan"):
        return True
    try:
        float(word)
    except ValueError:
        return False
    return True


def _refuse_infinite(reader: Any, topography: Any, name: str) -> None:
    """Raise an error for infinite heights, which most readers take as undefined."""
    if type(reader).__name__ in UNDEFINED_IF_INFINITE:
        return
    # what is masked is as it stands in the file
    heights = np.ma.getdata(topography.heights())
    if np.isinf(heights).any():
        raise InputError(_infinite(name))


def _infinite(name: str) -> str:
    return f"{name} holds infinite heights: write NaN where a height is undefined"


def _plain_matrix(path: pathlib.Path, why: str) -> bytes:
    """A matrix of numbers with any separator and decimal mark, as that library's plain text.

    `why` says what that library found wrong with the file.
    """
    try:
        text = read_file(path, MAX_TEXT_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(
            f"{path.name} cannot be read as a map: it is no text in UTF-8"
        ) from None
    lines = [
        BLANKS.sub(" ", line)
        for line in text.splitlines()
        if line.strip() and not line.lstrip().startswith("#")
    ]
    # names of columns above the numbers
    first = next((k for k, line in enumerate(lines) if NUMBER.search(line)), 0)
    rows = _separated(lines[first:], path.name)
    try:
        numbers = numbers_of([" ".join(row) for row in rows], None)
    except InputError as fault:
        raise InputError(
            f"{path.name} cannot be read as a map ({why}): it must hold numbers with one "
            f"separator between them, semicolons, tabs, blanks or commas: {fault}"
        ) from None
    if np.isinf(numbers).any():
        raise InputError(_infinite(path.name))
    content = io.BytesIO()
    np.savetxt(content, numbers)
    content.seek(0)
    return content.getvalue()


def _separated(lines: Sequence[str], name: str) -> list[list[str]]:
    """The numbers of each line as text with decimal points.

    The separator is the first of semicolon, tab, comma with a blank, blank, comma that
    occurs. Beside another separator a comma is the decimal mark.
    """
    text = "\n".join(lines)
    points = "." in text
    if ";" in text:
        separator = r"\s*;\s*"
    elif "\t" in text:
        separator = r"\s*\t\s*"
    elif points and "," in text:
        separator = r"\s*,\s*"
    elif re.search(r",[ ]", text):
        separator = r"\s*,\s+"
    elif re.search(r"\S[ ]+\S", text):
        separator = r"\s+"
    else:
        separator = ","
    rows = []
    for line in lines:
        numbers = re.split(separator, line.strip())
        # some programs end each row with a separator
        rows.append(numbers[:-1] if numbers[-1] == "" else numbers)
    if separator == ",":
        _refuse_ambiguous(rows, name)
    every = list(itertools.chain.from_iterable(rows))
    if any("," in number for number in every):
        if points or any(number.count(",") > 1 for number in every):
            raise InputError(
                f"{name} has commas inside numbers that also hold points, or several "
                "commas: write decimal points, and no separators of thousands"
            )
        return [_with_points(row) for row in rows]
    return rows


def _with_points(row: Sequence[str]) -> list[str]:
    """Numbers with decimal commas as numbers with decimal points."""
    return [number.replace(",", ".") for number in row]


def _refuse_ambiguous(rows: Sequence[Sequence[str]], name: str) -> None:
    """Raise an error for whole numbers between commas that may be numbers with decimal commas.

    Every second one of these is a fraction: it has no sign, and either zeros in front,
    which no whole number has, or always the same number of digits, unlike the whole
    numbers.
    """
    if any(len(row) % 2 for row in rows):
        return
    fractions: list[str] = []
    wholes: list[str] = []
    for row in rows:
        fractions += row[1::2]
        wholes += row[::2]
    if not fractions or not all(number.isdigit() for number in fractions):
        return
    widths = {len(number) for number in fractions}
    padded = any(len(number) > 1 and number.startswith("0") for number in fractions)
    alike = len(widths) == 1 and (
        widths == {1} or {len(number.lstrip("+-")) for number in wholes} != widths
    )
    if padded or alike:
        raise InputError(
            f"{name} has commas only: it cannot be told whether they separate numbers or "
            "are decimal commas. Write decimal points, or semicolons between the numbers"
        )


def _units_of_header(content: bytes) -> list[str]:
    """Units in brackets beside the names of columns, above the numbers of a text."""
    units: list[str] = []
    # no text has zero bytes; what is no UTF-8 is the micro sign of Latin-1
    text = (
        ""
        if b"\0" in content
        else content.decode("utf-8", "replace").replace("\ufffd", "u")
    )
    for line in text.splitlines():
        if re.fullmatch(r"[\s,;]*[-+.]?\d[-+.\deE\s,;]*", line):
            break
        for name in re.findall(r"[\[(]\s*([^\W\d]+)\s*[\])]", line):
            with contextlib.suppress(InputError):
                units.append(known(name))
    return units


def _channel_of(
    reader: Any,
    path: pathlib.Path,
    dx: float | None,
    dy: float | None,
    unit: str | None,
    channel: int | None,
    named: Sequence[str] = (),
) -> Any:
    """A channel of an open file; `named` are the units of its header, that of heights last."""
    channels = reader.channels
    if channel is not None and not 0 <= channel < len(channels):
        raise InputError(
            f"{path.name} has channels 0 to {len(channels) - 1}, not {channel}"
        )
    chosen = reader.default_channel if channel is None else channels[channel]
    arguments: dict[str, Any] = {} if channel is None else {"channel_index": channel}
    # a plain matrix of text, whose rows are x as those of an array; that library takes its columns
    turned = (
        type(reader).__name__ == "AscReader"
        and chosen.physical_sizes is None
        and len(chosen.nb_grid_pts) == 2
    )
    unit_of_file = chosen.unit
    if unit_of_file is None and named:
        *lateral, height = named
        if len(set(lateral)) > 1:
            raise InputError(
                f"{path.name} names the units {', '.join(named)}: write x and y in one unit"
            )
        arguments["unit"] = unit_of_file = (lateral or named)[0]
        if height != unit_of_file:
            arguments["height_scale_factor"] = factor(height, unit_of_file)
    elif unit_of_file is None and unit is not None:
        arguments["unit"] = unit
    if chosen.physical_sizes is None:
        if min(chosen.nb_grid_pts) in LISTS:
            raise InputError(
                f"{path.name} holds {' x '.join(map(str, chosen.nb_grid_pts))} numbers. "
                "A list of x, y and height is read where its points fill a grid: give "
                "missing ones a row with NaN, or write a matrix"
            )
        if dx is None:
            raise InputError(f"{path.name} has no lengths: give the sampling step dx")
        scale = (
            1.0 if unit_of_file is None or unit is None else factor(unit, unit_of_file)
        )
        steps = [("dx", dx), ("dy", dx if dy is None else dy)][:: -1 if turned else 1]
        sides = zip(chosen.nb_grid_pts, steps, strict=False)
        arguments["physical_sizes"] = tuple(
            count * scale * sampling_step(*step) for count, step in sides
        )
    elif dx is not None or dy is not None:
        raise InputError(
            f"{path.name} has its own lengths: leave dx and dy out (unit=... sets their unit)"
        )
    topography = reader.topography(**arguments)
    return topography.transpose() if turned else topography


def sampling_step(name: str, value: Any) -> float:
    """A sampling step [length] as a number."""
    step = one_number(name, value)
    require(
        name,
        step,
        (step >= MIN_LENGTH) & (step <= MAX_LENGTH),
        "positive, in [1e-30, 1e30]",
    )
    return float(step)


def grid_of(
    source: Any, dx: Any, dy: Any, periodic: bool | None, dimensions: int = 2
) -> tuple[Any, tuple[float, ...], bool, str | None]:
    """Heights, sampling steps, periodicity and unit, from an array or a topography."""
    if not callable(getattr(source, "heights", None)):
        if dx is None:
            raise InputError(
                "dx is missing: the sampling step of a plain array of heights"
            )
        steps = tuple(
            sampling_step(*step)
            for step in (("dx", dx), ("dy", dx if dy is None else dy))[:dimensions]
        )
        # of a DataArray
        stated = getattr(source, "attrs", {}).get("units")
        return source, steps, bool(periodic), None if stated in ("", "1") else stated
    if dx is not None or dy is not None:
        raise InputError(
            "dx and dy belong to a plain array; a topography has its own physical_sizes"
        )
    if not getattr(source, "is_uniform", True):
        # its points are nearly as dense where they are not even
        _refuse_gaps(source)
        try:
            source = source.to_uniform(nb_points=source.nb_grid_pts[0])
        except RuntimeError:
            raise InputError(
                "the points of a line scan must be in the order of rising x"
            ) from None
    grid = source.heights()
    sizes = getattr(source, "physical_sizes", None)
    if np.ndim(grid) != dimensions or sizes is None or np.shape(sizes) != (dimensions,):
        other = (
            "Surface.from_profile takes line scans"
            if dimensions == 2
            else "Surface.from_map takes maps"
        )
        raise InputError(
            f"a topography must have heights along {dimensions} axes and as many "
            f"physical_sizes, got shape {np.shape(grid)} and {np.asarray(sizes).tolist()}; {other}"
        )
    extent = finite_array("physical_sizes", sizes)
    allowed = "in [1e-30, 1e30], x and y rising"
    require(
        "physical_sizes", extent, (extent >= MIN_LENGTH) & (extent <= MAX_LENGTH), allowed
    )
    whole = getattr(source, "is_periodic", False) if periodic is None else periodic
    sampling = tuple(
        float(size) / max(count, 1)
        for size, count in zip(extent, np.shape(grid), strict=True)
    )
    return grid, sampling, bool(whole), getattr(source, "unit", None)


def _refuse_gaps(scan: Any) -> None:
    """Raise an error for a line scan with a gap, over which it would be interpolated."""
    x = np.ma.getdata(scan.positions())
    steps = np.diff(x)
    # what does not rise is refused later
    if (steps > 0).all() and steps.max() > LONGEST_GAP * np.median(steps):
        place = int(steps.argmax())
        raise InputError(
            f"the line scan has no points between x = {x[place]:g} and {x[place + 1]:g}, "
            f"{steps[place] / np.median(steps):.3g} times its usual step: give missing "
            "points rows with NaN, or give its parts as traces, Surface.from_profile([...])"
        )


def heights_of(grid: Any, dimensions: int = 2) -> Any:
    """Heights as a masked array of floats, NaN being undefined; infinite ones are errors."""
    heights = defined_or_masked(grid, dimensions)
    if np.ma.getmaskarray(heights).all():
        raise InputError("every height is undefined")
    return heights


def defined_or_masked(grid: Any, dimensions: int = 2) -> Any:
    """The same of heights that may all be undefined, as in a part of a map."""
    try:
        values = np.ma.asanyarray(grid)
    except (TypeError, ValueError) as fault:
        raise InputError(f"heights must be an array of numbers: {fault}") from None
    if values.ndim != dimensions:
        raise InputError(
            f"heights must be {('one', 'two')[dimensions - 1]}-dimensional, got shape "
            f"{values.shape}"
        )
    if values.dtype.kind not in "fiu":
        raise InputError(f"heights must be real numbers: entries of type {values.dtype}")
    numbers = np.ma.getdata(values).astype(float)
    holes = np.ma.getmaskarray(values) | np.isnan(numbers)
    if not holes.all():
        defined = finite_array("heights", numbers[~holes])
        allowed = "at most 1e30 in magnitude"
        require("heights", defined, np.abs(defined) <= MAX_LENGTH, allowed)
    return np.ma.masked_array(numbers, holes)


def wrapped(heights: Any, steps: tuple[float, ...], periodic: bool) -> Any:
    """A plain array of heights as a topography or line scan; masked points are undefined."""
    module = library()
    values = heights if np.ma.getmaskarray(heights).any() else np.ma.getdata(heights)
    sizes = tuple(count * step for count, step in zip(values.shape, steps, strict=True))
    if values.ndim == 1:
        return module.UniformLineScan(values, sizes[0], periodic=periodic)
    return module.Topography(values, sizes, periodic=periodic)
