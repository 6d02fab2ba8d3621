"""The command that wrote a file, in the file's header."""

from __future__ import annotations

import hashlib
import pathlib
import shlex
import tomllib
from collections.abc import Iterable

from mbma_tables import __version__
from mbma_tables.common.files import read_file

MAX_BYTES = 1 << 30


def made_by(words: Iterable[str], inputs: Iterable[pathlib.Path]) -> tuple[str, ...]:
    """Lines of a header: hashes of the input files, and the command."""
    files = [*inputs]
    for path in [path for path in files if path.suffix == ".toml"]:
        table = tomllib.loads(read_file(path, MAX_BYTES).decode()).get("surface", {})
        files += [path.parent / table[name] for name in ("map", "psd") if name in table]
    digests = {path: hashlib.sha256(read_file(path, MAX_BYTES)).hexdigest() for path in files}
    return *(f"input {path}: sha256 {digest}" for path, digest in digests.items()), written_by(words)


def written_by(words: Iterable[str]) -> str:
    """The line of a header with the arguments of `mbma export`."""
    return f"written by mbma_tables {__version__}: mbma export {shlex.join(words)}"
