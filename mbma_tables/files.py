"""Files that are written whole or not at all."""

from __future__ import annotations

import contextlib
import os
import pathlib
import shutil
import tempfile
import time
import uuid
from collections.abc import Callable, Mapping

from mbma_tables.errors import InputError

DRAFT = ".draft"
ABANDONED = 3600.0  # seconds; the writer of a draft that old was killed


def _remove_abandoned(target: pathlib.Path) -> None:
    """Remove drafts of this file whose writers were killed; others may still be written to."""
    # a folder that cannot be listed may be writable all the same
    with contextlib.suppress(OSError):
        for other in target.parent.iterdir():
            if other.name.startswith(f".{target.name}.") and other.name.endswith(DRAFT):
                with contextlib.suppress(OSError):
                    if time.time() - other.stat().st_mtime > ABANDONED:
                        other.unlink()


def _name_beside(target: pathlib.Path) -> pathlib.Path:
    return target.with_name(f".{target.name}.{uuid.uuid4().hex[:12]}{DRAFT}")


def _write_draft(target: pathlib.Path, draft: pathlib.Path, content: bytes) -> None:
    with draft.open("xb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())
    with contextlib.suppress(FileNotFoundError):
        shutil.copymode(target, draft)


def write_whole(files: Mapping[pathlib.Path, bytes], make_folders: bool = False) -> None:
    """Write every file, or none of them: under temporary names beside them first, then renamed.

    A process that is killed leaves each file as it was or as it shall be; a draft that it leaves behind is
    removed by a later write of the same file.

    Parameters
    ----------
    files : mapping of path to bytes
        What to write where; links are followed.
    make_folders : bool, optional
        Whether to make the folders that are missing.

    Raises
    ------
    OSError
        Where one of them cannot be written; what stood there before still does.
    """
    targets = {path.resolve(): content for path, content in files.items()}
    drafts: dict[pathlib.Path, pathlib.Path] = {}
    kept: dict[pathlib.Path, pathlib.Path] = {}
    replaced: list[pathlib.Path] = []
    target = pathlib.Path()
    try:
        for target, content in targets.items():
            # renaming would replace a device such as /dev/null by a plain file
            if target.exists() and not target.is_file():
                raise OSError("it is not a plain file")
            if make_folders:
                target.parent.mkdir(parents=True, exist_ok=True)
            _remove_abandoned(target)
            drafts[target] = _name_beside(target)
            _write_draft(target, drafts[target], content)
        if len(targets) > 1:
            for target in targets:
                if target.exists():
                    kept[target] = _name_beside(target)
                    shutil.copy2(target, kept[target])
        for target, draft in drafts.items():
            draft.replace(target)
            replaced.append(target)
    except BaseException as fault:
        for done in replaced:
            with contextlib.suppress(OSError):
                kept[done].replace(done) if done in kept else done.unlink()
        if isinstance(fault, OSError):
            fault.filename = str(target)
        raise
    finally:
        for draft in (*drafts.values(), *kept.values()):
            with contextlib.suppress(OSError):
                draft.unlink(missing_ok=True)


def reason(fault: OSError) -> str:
    """Why a file could not be written, in few words."""
    return fault.strerror or str(fault.args[0])


def write_files(files: Mapping[pathlib.Path, bytes], make_folders: bool = False) -> None:
    """Write every file as `write_whole` does.

    Raises
    ------
    InputError
        Where one of them cannot be written; what stood there before still does.
    """
    try:
        write_whole(files, make_folders)
    except OSError as fault:
        raise InputError(f"{fault.filename} cannot be written: {reason(fault)}") from None


def written_bytes(name: str, write: Callable[[str], object]) -> bytes:
    """The bytes that a library writes where it takes only a path, by way of the system's temporary folder.

    Raises
    ------
    OSError
        Where that folder cannot be written or is full.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, name)
        try:
            write(path)
        # the HDF5 library reports a full disk so
        except RuntimeError as fault:
            raise OSError(f"{fault} (in {folder})") from None
        return pathlib.Path(path).read_bytes()
