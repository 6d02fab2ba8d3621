"""Files: shipped data, reading with a size limit, writing whole or not at all."""

import contextlib
import csv
import glob
import os
import pathlib
import re
import shutil
import stat
import sys
import tempfile
import time
import uuid
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError, MbmaError
from mbma_tables.common.shared import shared

Content = TypeVar("Content")

MAX_BYTES = 1 << 30  # of an input file
ABANDONED = 3600.0  # s, age from which on a draft is no longer being written


def shipped_file(name: str) -> pathlib.Path:
    """Path of a file of `tables`: in the installed package, or in a checkout's `tables` folder."""
    package = pathlib.Path(__file__).parents[1]
    inside = package / "tables" / "data" / name
    return inside if inside.exists() else package.parent / "tables" / name


@shared(16)
def _read_in_state(
    path: pathlib.Path, state: tuple[int, int], read: Callable[[pathlib.Path], Any]
) -> Any:
    """What a reader makes of a file in a state, by its time and size."""
    return read(path)


def read_once(
    path: os.PathLike[str] | str, read: Callable[[pathlib.Path], Content]
) -> Content:
    """What a reader makes of a file as it is now, read once, so that what holds it is equal."""
    file = pathlib.Path(path)
    try:
        stat = file.stat()
    except OSError:
        # the reader's error
        return read(file)
    state = stat.st_mtime_ns, stat.st_size
    content: Content = _read_in_state(file.resolve(), state, read)
    return content


def records(path: pathlib.Path) -> list[dict[str, str]]:
    """Rows of a CSV file that ships, by column; lines that begin with # are comments."""
    lines = path.read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))


def numbers_of(lines: list[str], delimiter: str | None) -> FloatArray:
    """The numbers of text, shape (rows, columns); the error names row and column.

    It quotes nothing of the file.
    """
    import warnings

    import numpy as np

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # for a file without numbers
            return np.loadtxt(lines, ndmin=2, delimiter=delimiter)
    except (ValueError, UserWarning) as fault:
        raise InputError(
            re.sub(
                r"could not convert string .* to float64 at", "no number at", str(fault)
            )
        ) from None


def read_file(path: os.PathLike[str] | str, max_bytes: int) -> bytes:
    """The content of a regular file of at most `max_bytes`; "-" is standard input.

    Links are followed.
    """
    try:
        # a pipe would wait for a writer, a device may have no end
        if os.fspath(path) != "-" and not stat.S_ISREG(os.stat(path).st_mode):
            raise InputError(f"{path} cannot be read: it is not a regular file")
        with (
            contextlib.nullcontext(sys.stdin.buffer)
            if os.fspath(path) == "-"
            else open(path, "rb") as stream
        ):
            content = stream.read(max_bytes + 1)
    except OSError as fault:
        raise InputError(f"{path} cannot be read: {fault.strerror or fault}") from None
    if len(content) > max_bytes:
        raise InputError(
            f"{path} has more than {max_bytes} bytes, which is too large for such a file"
        )
    return content


def write_file(
    path: os.PathLike[str] | str, content: bytes, make_folders: bool = False
) -> None:
    """Write a file whole or not at all: under a temporary name beside it, which then replaces it.

    Links are followed, "-" is standard output. Where it cannot be written, what was there
    before is unchanged.
    """
    if os.fspath(path) == "-":
        sys.stdout.buffer.write(content)
        sys.stdout.flush()
        return
    with drafted(path, make_folders) as draft, open(draft, "xb") as stream:
        stream.write(content)


@contextlib.contextmanager
def drafted(
    path: os.PathLike[str] | str, make_folders: bool = False
) -> Iterator[pathlib.Path]:
    """A temporary name beside a file for what is written in parts; at the end it replaces the file.

    After an error the file is as it was before. Links are followed.
    """
    target = pathlib.Path(os.path.realpath(path))
    draft = target.with_name(f".{target.name}.{uuid.uuid4().hex[:12]}.draft")
    # drafts of runs that were killed
    for left in target.parent.glob(f".{glob.escape(target.name)}.*.draft"):
        with contextlib.suppress(OSError):
            if time.time() - left.stat().st_mtime > ABANDONED:
                left.unlink()
    try:
        if make_folders:
            target.parent.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(FileNotFoundError):
            # replacing would turn a device such as /dev/null into a regular file; a link to
            # itself ends here
            if not stat.S_ISREG(os.stat(target).st_mode):
                raise InputError(f"{path} cannot be written: it is not a regular file")
        try:
            yield draft
            with open(draft, "rb") as stream:
                os.fsync(stream.fileno())
            with contextlib.suppress(FileNotFoundError):
                shutil.copymode(target, draft)
            os.replace(draft, target)
        finally:
            with contextlib.suppress(OSError):
                draft.unlink()
    except OSError as fault:
        if isinstance(fault, MbmaError):
            raise
        raise InputError(f"{path} cannot be written: {fault.strerror or fault}") from None


def written_bytes(name: str, write: Callable[[str], object]) -> bytes:
    """The bytes that a library writes to a path, by way of the temporary folder."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, name)
        try:
            write(path)
        # the HDF5 library reports a full disk so
        except RuntimeError as fault:
            raise OSError(f"{fault} (in {folder})") from None
        return pathlib.Path(path).read_bytes()
