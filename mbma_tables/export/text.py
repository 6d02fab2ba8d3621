"""Writing text and numbers into other codes, so that no text of a user or a table is executed there."""

import functools
import math
import pathlib
import re
import shlex
import textwrap
from collections.abc import Container, Iterable
from decimal import ROUND_CEILING, Context
from typing import Any, SupportsFloat

import numpy as np

from mbma_tables import __version__
from mbma_tables.common.errors import InputError

COMMENT_WIDTH = 108
_ROOT = pathlib.Path(__file__).parent
_ASCII = str.maketrans(
    {
        "\N{MICRO SIGN}": "u",
        "\N{GREEK SMALL LETTER MU}": "u",
        "\N{MIDDLE DOT}": ".",
        "²": "2",
    }
)
# what some reader takes for more than text, even in a comment
_ACTIVE = re.compile(
    r"\*(?=/)|/(?=\*)"  # end and begin of a comment of C
    r"|<(?=[/!])"  # end of a script in a page
    r"|\?(?=\?)"  # trigraphs
    r"|coding(?=[:=])"  # encoding of a file of Python (PEP 263)
    r"|\b(?:vim?|Vim|ex)(?=[<=>]?\d*:)|-(?=\*-)"  # settings of editors
)
# first characters of a formula in a spreadsheet
_FORMULA = ("=", "+", "-", "@", "\t", "\r")


def printable(text: str) -> str:
    """Text as printable ASCII on one line; other characters as escapes."""
    return "".join(
        letter
        if " " <= letter <= "~"
        else letter.encode("unicode_escape").decode("ascii")
        for letter in text.translate(_ASCII)
    )


def inert(line: str) -> str:
    """Text for a comment of any language: on one line, in ASCII, ending no comment and setting no encoding."""
    text = _ACTIVE.sub(lambda mark: f"{mark[0]} ", printable(line))
    # at the end of a line it joins the next one to the comment, or ends the comment's mark
    return f"{text} ." if text.endswith("\\") else text


def comment(lines: Iterable[str], mark: str) -> str:
    """Lines as comments that reach from a mark to the end of the line, "<!--" for comments of XML."""
    if mark == "<!--":
        return "".join(
            f"<!-- {inert(line).replace('--', '-%2D')} -->\n" for line in lines
        )
    return "".join(f"{mark} {inert(line)}".rstrip() + "\n" for line in lines)


def opening(paragraphs: Iterable[str], mark: str) -> str:
    """Head of a source file: wrapped paragraphs as comments by their mark, "/*" for one comment of C and JavaScript."""
    wrap = textwrap.TextWrapper(
        COMMENT_WIDTH, break_long_words=False, break_on_hyphens=False
    ).wrap
    lines = [line for text in paragraphs for line in wrap(text)]
    if mark != "/*":
        return comment(lines, mark).rstrip()
    return f"/*\n{comment(lines, ' *')} */"


wrapped = functools.partial(textwrap.fill, width=118, break_on_hyphens=False)


def core_file(name: str) -> str:
    """A file of the core, as the library is compiled from it."""
    return (_ROOT.parent / "core" / name).read_text(encoding="utf-8")


def page_file(name: str) -> bytes:
    """A file of the explorer's page, or a compiled module beside it."""
    return (_ROOT / "page" / name).read_bytes()


def file(name: str) -> str:
    """The text of a file, named from this folder on."""
    return (_ROOT / name).read_text(encoding="utf-8")


def template(name: str) -> str:
    """The text of a template of jinja, named from this folder on, without the end of its name."""
    return file(f"{name}.jinja")


def filled(name: str, /, **parts: Any) -> str:
    """A template with its places filled in; a place that nothing is given for is an error."""
    return str(_templates().get_template(name).render(parts))


def rendered(source: str, /, **parts: Any) -> str:
    """The same of a template that is no file."""
    return str(_templates().from_string(source).render(parts))


@functools.cache
def _templates() -> Any:
    """The templates' settings; jinja is imported when first needed."""
    import jinja2

    # lines that are tags alone leave nothing behind
    templates = jinja2.Environment(
        loader=jinja2.FunctionLoader(template),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # code, not a page
    )
    templates.tests["finite"] = math.isfinite
    return templates


def written_by(words: Iterable[str], command: str = "export") -> str:
    """The line of a header with the command and its arguments."""
    return f"written by mbma_tables {__version__}: mbma {command} {shlex.join(words)}"


def csv_cell(text: str) -> str:
    """A header of a CSV column that no spreadsheet interprets as a formula; the csv module quotes it."""
    return f"'{text}" if text.startswith(_FORMULA) else text


def checked_name(
    name: str, max_length: int, reserved: Container[str] = (), target: str = "this target"
) -> str:
    """A name for a target: an ASCII letter, then letters, digits and underscores; none of its reserved words.

    Case does not matter to reserved words, which are in small letters.
    """
    if not isinstance(name, str) or not re.fullmatch(
        rf"[A-Za-z][A-Za-z0-9_]{{0,{max_length - 1}}}", name
    ):
        raise InputError(
            f"a name must be a letter, then letters, digits and underscores, {max_length} at most, got {name!r}"
        )
    if name.lower() in reserved:
        raise InputError(
            f"name must not be {name!r}, which {target} needs for itself: take another, such as '{name}_law'"
        )
    return name


def number(
    value: SupportsFloat,
    *,
    digits: int = 17,
    width: int | None = None,
    exponent: str = "",
    infinity: str | None = None,
    missing: str | None = None,
) -> str:
    """A number for another program or for a header, always with a decimal point: no reader takes it for an integer.

    Programs that read whole numbers as integers of 32 bits turn 3240000000 into -1054967296.

    Parameters
    ----------
    value : float
    digits : int
        Significant digits. The default reads back as the same double, written as shortly as
        that allows.
    width : int, optional
        Columns of a field. Where the number needs more, it has as many digits as fit: 13 in
        20 columns and 9 in 16 at least, hence relative errors of at most 5e-13 and 5e-9.
    exponent : str
        Letter of an exponent that must be there, such as "d" for double precision in Fortran.
    infinity, missing : str, optional
        How the language writes infinity and NaN.

    Raises
    ------
    InputError
        For a number that is not finite where the language has no word for it, and for one
        that no field holds.

    Examples
    --------
    >>> number(3.24e9), number(1e22), number(1 / 3), number(2 / 3, digits=3)
    ('3240000000.0', '1.0e+22', '0.3333333333333333', '0.667')
    >>> number(-1.2345678901234567e-05, width=20), number(2.0, exponent="d")
    ('-1.2345678901235e-05', '2.0d0')
    """
    double = float(value)
    if math.isinf(double) and infinity is not None:
        return infinity if double > 0 else f"-{infinity}"
    if math.isnan(double) and missing is not None:
        return missing
    if not math.isfinite(double):
        raise InputError(
            f"a number in a file for another program must be finite, got {double}"
        )
    text = _pointed(repr(float(f"{double:.{digits}g}")), exponent)
    if width is None or len(text) <= width:
        return text
    # with an exponent, the most digits that fit
    for decimals in range(digits - 1, 0, -1):
        mantissa, _, power = f"{double:.{decimals}e}".partition("e")
        text = _pointed(f"{mantissa.rstrip('0').rstrip('.')}e{power}", exponent)
        # next to the largest double fewer digits may round beyond it
        if len(text) <= width and math.isfinite(
            float(text.replace(exponent or "e", "e"))
        ):
            return text
    raise InputError(f"{double!r} does not fit into a field of {width} columns")


def about(value: SupportsFloat, digits: int = 4) -> str:
    """A number of a header, rounded for its reader."""
    return number(value, digits=digits, infinity="infinity", missing="not known")


def bound(value: float) -> str:
    """The bound of an error in a header, in two digits, which are rounded up.

    Examples
    --------
    >>> bound(9.81e-4), bound(2.0e-3), bound(0.0)
    ('9.9e-04', '2.0e-03', '0.0e+00')
    """
    rounded_up = Context(prec=2, rounding=ROUND_CEILING).create_decimal(
        repr(float(value))
    )
    return f"{float(rounded_up):.1e}"


def _pointed(text: str, exponent: str = "") -> str:
    """Decimals with a point in the mantissa, and with the letter of an exponent where one is asked for."""
    mantissa, letter, power = text.partition("e")
    if "." not in mantissa:
        mantissa += ".0"
    if not (letter or exponent):
        return mantissa
    return f"{mantissa}{exponent or letter}{power or 0}"


def numerals(values: Any) -> list[str]:
    """Numbers in the shortest decimals of their precision, as C has them; those of an integer type as integers."""
    flat = np.ravel(values)
    texts: list[str] = flat.astype(str).tolist()
    if not np.issubdtype(flat.dtype, np.floating):
        return texts
    suffix = "f" if flat.dtype == np.float32 else ""
    return [f"{_pointed(text)}{suffix}" for text in texts]


def braces(*parts: Any) -> str:
    """An initialiser in C of texts and arrays."""
    texts = (part if isinstance(part, str) else braces(*numerals(part)) for part in parts)
    return f"{{{', '.join(texts)}}}"
