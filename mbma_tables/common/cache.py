"""A folder of results that take long to compute, kept between processes.

Files are written whole; the oldest are removed first.

The folder is that of the platform's caches; the environment variable `MBMA_TABLES_CACHE`
names another, and "off" turns it off. Results that cannot be read or written are computed
again, without a warning.

Each file ends in `SUFFIX`; files of other names in the folder are never read, counted or
removed. It begins with the SHA-256 of what follows, arrays in numpy's compressed format, so
that a damaged file is recognised before it is opened.
"""

import contextlib
import hashlib
import io
import os
import pathlib
import sys
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import read_file, write_file

VARIABLE = "MBMA_TABLES_CACHE"
MAX_BYTES = 2**30  # total size of the files
SUFFIX = ".mbma_tables_cache"  # no other program gives this name to its files
DIGEST = hashlib.sha256().digest_size


def folder() -> pathlib.Path | None:
    """The folder of stored results; None if the cache is off."""
    named = os.environ.get(VARIABLE, "").strip()
    if named.lower() == "off":
        return None
    if named:
        return pathlib.Path(named)
    home = pathlib.Path.home()
    standard_folders = {
        "darwin": home / "Library" / "Caches",
        "win32": pathlib.Path(os.environ.get("LOCALAPPDATA") or home),
    }
    return (
        standard_folders.get(
            sys.platform,
            pathlib.Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache"),
        )
        / "mbma_tables"
    )


def load(name: str, **shapes: tuple[int, ...]) -> dict[str, FloatArray] | None:
    """The arrays stored under a name, of these shapes; None if absent or damaged."""
    place = folder()
    if place is None:
        return None
    path = place / f"{name}{SUFFIX}"
    try:
        content = read_file(path, MAX_BYTES)
    except InputError:
        return None
    checksum = content[:DIGEST]
    packed = content[DIGEST:]
    if hashlib.sha256(packed).digest() != checksum:
        return None
    with np.load(io.BytesIO(packed), allow_pickle=False) as archive:
        if not shapes.keys() <= set(archive.files):
            return None
        arrays: dict[str, Any] = {key: archive[key] for key in shapes}
    if any(
        arrays[key].shape != shape or not np.isfinite(arrays[key]).all()
        for key, shape in shapes.items()
    ):
        return None
    with contextlib.suppress(OSError):
        os.utime(path)
    return arrays


def keep(name: str, **arrays: FloatArray) -> None:
    """Store arrays under a name."""
    place = folder()
    if place is None:
        return
    packed = io.BytesIO()
    np.savez_compressed(packed, allow_pickle=False, **arrays)
    content = hashlib.sha256(packed.getvalue()).digest() + packed.getvalue()
    with contextlib.suppress(InputError):
        write_file(place / f"{name}{SUFFIX}", content, make_folders=True)


def files() -> list[tuple[pathlib.Path, os.stat_result]]:
    """The stored files, least recently used first."""
    place = folder()
    if place is None:
        return []
    stored = []
    for path in place.glob(f"*{SUFFIX}"):
        # another process may remove it
        with contextlib.suppress(OSError):
            stored.append((path, path.stat()))
    return sorted(stored, key=lambda entry: entry[1].st_mtime)


def trim(most: int = MAX_BYTES) -> int:
    """Remove the oldest files until the rest has at most so many bytes; how many went."""
    stored = files()
    removed = 0
    size = sum(stat.st_size for _, stat in stored)
    for path, stat in stored:
        if size <= most:
            break
        with contextlib.suppress(OSError):
            path.unlink()
            removed += 1
        size -= stat.st_size
    return removed
