"""A folder of results that take long to compute, kept between processes: whole files, the oldest removed first.

The folder is that of the platform's caches; the environment variable `MBMA_TABLES_CACHE` names another, and "off"
turns it off. Results that cannot be read or written are computed again, without a warning.
"""

import contextlib
import io
import os
import pathlib
import sys
import zipfile
from typing import Any

import numpy as np

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import read_file, write_file

VARIABLE = "MBMA_TABLES_CACHE"
MAX_BYTES = 2**30  # total size of the files
SUFFIX = ".npz"


def folder() -> pathlib.Path | None:
    """The folder of stored results; None if the cache is off."""
    named = os.environ.get(VARIABLE, "").strip()
    if named.lower() == "off":
        return None
    if named:
        return pathlib.Path(named)
    home = pathlib.Path.home()
    own = {"darwin": home / "Library" / "Caches", "win32": pathlib.Path(os.environ.get("LOCALAPPDATA") or home)}
    return own.get(sys.platform, pathlib.Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache")) / "mbma_tables"


def load(name: str, **shapes: tuple[int, ...]) -> dict[str, FloatArray] | None:
    """The arrays stored under a name, of these shapes; None if there are none."""
    place = folder()
    if place is None:
        return None
    try:
        content = read_file(place / f"{name}{SUFFIX}", MAX_BYTES)
        with np.load(io.BytesIO(content), allow_pickle=False) as kept:
            found: dict[str, Any] = {key: kept[key] for key in shapes}
    # damaged file
    except (InputError, OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    if any(found[key].shape != shape or not np.isfinite(found[key]).all() for key, shape in shapes.items()):
        return None
    with contextlib.suppress(OSError):
        os.utime(place / f"{name}{SUFFIX}")
    return found


def keep(name: str, **arrays: FloatArray) -> None:
    """Store arrays under a name."""
    place = folder()
    if place is None:
        return
    content = io.BytesIO()
    np.savez_compressed(content, allow_pickle=False, **arrays)
    with contextlib.suppress(InputError):
        write_file(place / f"{name}{SUFFIX}", content.getvalue(), make_folders=True)


def files() -> list[tuple[pathlib.Path, os.stat_result]]:
    """The stored files, least recently used first."""
    place, found = folder(), []
    for path in place.glob(f"*{SUFFIX}") if place is not None else ():
        # another process may remove it
        with contextlib.suppress(OSError):
            found.append((path, path.stat()))
    return sorted(found, key=lambda entry: entry[1].st_mtime)


def trim(most: int = MAX_BYTES) -> int:
    """Remove files, least recently used first, until the rest has at most so many bytes; returns how many."""
    kept, removed = files(), 0
    size = sum(stat.st_size for _, stat in kept)
    for path, stat in kept:
        if size <= most:
            break
        with contextlib.suppress(OSError):
            path.unlink()
            removed += 1
        size -= stat.st_size
    return removed
