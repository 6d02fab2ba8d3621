"""Writing text and numbers into other codes, so that no text of a user or a table is executed there."""

import functools
import pathlib
import re
import shlex
import textwrap
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from mbma_tables import __version__
from mbma_tables.common.errors import InputError

COMMENT_WIDTH = 108
DIGITS = 10  # of the numbers in a law's file
_ROOT = pathlib.Path(__file__).parent
_ASCII = str.maketrans({"\N{MICRO SIGN}": "u", "\N{GREEK SMALL LETTER MU}": "u", "\N{MIDDLE DOT}": ".", "²": "2"})
# begin or end of a C comment, end of a script in a page, trigraphs
_MARKS = re.compile(r"\*(?=/)|/(?=\*)|<(?=[/!])|\?(?=\?)")
# first characters of a formula in a spreadsheet
_FORMULA = ("=", "+", "-", "@", "\t", "\r")


def printable(text: str) -> str:
    """Text as printable ASCII on one line; other characters as escapes."""
    return "".join(
        letter if " " <= letter <= "~" else letter.encode("unicode_escape").decode("ascii")
        for letter in text.translate(_ASCII)
    )


def comment(lines: Iterable[str], mark: str) -> str:
    """Lines as comments that reach from a mark to the end of the line, "<!--" for comments of XML."""
    if mark == "<!--":
        return "".join(f"<!-- {printable(line).replace('--', '-%2D')} -->\n" for line in lines)
    return "".join(f"{mark} {printable(line)}".rstrip() + "\n" for line in lines)


def opening(paragraphs: Iterable[str], mark: str) -> str:
    """Head of a source file: wrapped paragraphs as comments by their mark, "/*" for one comment of C and JavaScript."""
    wrap = textwrap.TextWrapper(COMMENT_WIDTH, break_long_words=False, break_on_hyphens=False).wrap
    lines = [line for text in paragraphs for line in wrap(text)]
    if mark != "/*":
        return comment(lines, mark).rstrip()
    return f"/*\n{comment((_MARKS.sub(lambda mark: mark[0] + ' ', printable(line)) for line in lines), ' *')} */"


wrapped = functools.partial(textwrap.fill, width=118, break_on_hyphens=False)


def core_file(name: str) -> str:
    """A file of the core, as the library is compiled from it."""
    return (_ROOT.parent / "core" / name).read_text(encoding="utf-8")


def page_file(name: str) -> bytes:
    """A file of the explorer's page, or a compiled module beside it."""
    return (_ROOT / "page" / name).read_bytes()


def filled(name: str, each: Mapping[str, str] = {}, /, **parts: str) -> str:
    """A template with its places, such as @HEADER@, filled in; @IF PLACE@ ... @END@ stays where that is not empty.

    @EACH@ ... @END@ is repeated for each function that is a slope times a ratio: @WHAT@, @PLACE@ and @RATIO@.
    """
    chosen = re.compile(r"@(?:IF ([A-Z]+)|EACH)@(\n)?(.*?)@END@(?(2)\n)", re.S)

    def repeated(text: str) -> str:
        places = ((("@WHAT@", what), ("@PLACE@", what.upper()), ("@RATIO@", ratio)) for what, ratio in each.items())
        return "".join(functools.reduce(lambda part, place: part.replace(*place), own, text) for own in places)

    text = (_ROOT / "templates" / f"{name}.in").read_text(encoding="utf-8")
    text = chosen.sub(lambda found: (parts[found[1]] and found[3]) if found[1] else repeated(found[3]), text)
    # in one pass: a header may hold such a name itself
    return re.sub("@([A-Z_]+)@", lambda place: parts[place[1]], text)


def written_by(words: Iterable[str]) -> str:
    """The line of a header with the arguments of `mbma export`."""
    return f"written by mbma_tables {__version__}: mbma export {shlex.join(words)}"


def csv_cell(text: str) -> str:
    """A header of a CSV column that no spreadsheet interprets as a formula; the csv module quotes it."""
    return f"'{text}" if text.startswith(_FORMULA) else text


def checked_name(name: str, max_length: int) -> str:
    """A name that every target can use: an ASCII letter, then letters, digits and underscores."""
    if not isinstance(name, str) or not re.fullmatch(rf"[A-Za-z][A-Za-z0-9_]{{0,{max_length - 1}}}", name):
        raise InputError(
            f"a name must be a letter, then letters, digits and underscores, {max_length} at most, got {name!r}"
        )
    return name


def number(value: float) -> str:
    """A number of a law's file."""
    return f"{value:.{DIGITS}g}"


def numerals(values: Any) -> list[str]:
    """Numbers in the shortest decimals of their precision, as C has them."""
    flat = np.ravel(values)
    return [f"{text}f" for text in flat.astype(str)] if flat.dtype == np.float32 else flat.astype(str).tolist()


def braces(*parts: Any) -> str:
    """An initialiser in C of texts and arrays."""
    texts = (part if isinstance(part, str) else braces(*numerals(part)) for part in parts)
    return f"{{{', '.join(texts)}}}"
