"""The command that wrote a file, stored in the file's header, from which the file can be written again."""

from __future__ import annotations

import hashlib
import io
import pathlib
import re
import shlex
import tomllib
import urllib.parse
import zipfile
from collections.abc import Iterable

from mbma_tables import __version__
from mbma_tables.common.errors import InputError
from mbma_tables.common.files import read_file

MAX_BYTES = 1 << 30
PLAIN = "".join(chr(k) for k in range(32, 127) if chr(k) not in '%;"&<>*?\\@{}')  # what no comment changes
_BREAK = re.compile(r"\n ?(?:\*\*|//|[*!#%$]) ")  # of a line in a comment
_COMMAND = re.compile(r"written by mbma_tables (\S+): mbma export ([^;]*);")
_INPUT = re.compile(r"input ([^;]*): sha256 ([0-9a-f]{64});")


def made_by(words: Iterable[str], out: pathlib.Path, inputs: Iterable[pathlib.Path]) -> tuple[str, ...]:
    """Lines of a header: hashes of the input files, and the arguments of `mbma export`, --out last."""
    words = list(words)
    if "--out" in words:
        del words[words.index("--out") : words.index("--out") + 2]
    words = [word for word in words if not word.startswith("--out=")]
    files = [*inputs]
    for path in [path for path in files if path.suffix == ".toml"]:
        table = tomllib.loads(read_file(path, MAX_BYTES).decode()).get("surface", {})
        files += [path.parent / table[name] for name in ("map", "psd") if name in table]
    lines = [f"input {urllib.parse.quote(str(path), safe=PLAIN)}: sha256 {_digest(path)};" for path in files]
    return *lines, written_by([*words, "--out", out.name])


def written_by(words: Iterable[str]) -> str:
    """The line of a header with the arguments of `mbma export`."""
    command = urllib.parse.quote(shlex.join(words).replace("  ", " %20"), safe=f"{PLAIN}%")
    return f"written by mbma_tables {__version__}: mbma export {command};"


def _digest(path: pathlib.Path) -> str:
    return hashlib.sha256(read_file(path, MAX_BYTES)).hexdigest()


def again(path: pathlib.Path) -> tuple[str, list[str]]:
    """The version that wrote a file, and the arguments of `mbma export` that write it again in its place.

    Raises
    ------
    InputError
        If the file contains no command, or an input file has changed.
    """
    content = read_file(path, MAX_BYTES)
    if content.startswith(b"PK"):
        content = zipfile.ZipFile(io.BytesIO(content)).read("modelDescription.xml")
    text = _BREAK.sub(" ", content.decode("latin-1"))
    found = _COMMAND.search(text)
    if found is None:
        raise InputError(f"{path} has no command of `mbma export` in its header")
    for name, digest in _INPUT.findall(text):
        if _digest(pathlib.Path(urllib.parse.unquote(name))) != digest:
            raise InputError(
                f"{urllib.parse.unquote(name)} has changed since {path} was written: its sha256 was {digest}"
            )
    *words, _, name = shlex.split(urllib.parse.unquote(found[2]))
    if name == ".":  # source code is a folder
        return found[1], [*words, "--out", str(path.parent)]
    own = path if pathlib.Path(name).suffix == path.suffix else path.with_name(name)
    return found[1], [*words, "--out", str(own)]
