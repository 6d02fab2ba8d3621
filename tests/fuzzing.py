"""Ways to spoil an input, and the one outcome that is allowed: a typed error, or a right answer."""

import copy
import signal

import numpy as np

from mbma_tables import MbmaError

LONGEST = 10.0  # seconds for one input
WORDS = [
    b"",
    b"nan",
    b"inf",
    b"-1",
    b"1e400",
    b"[",
    b"]",
    b"{",
    b"}",
    b"=",
    b",",
    b"#",
    b"\n",
    b"\x00",
    b"\xff",
    b"'",
    b'"',
    b'"""',
    b"0" * 400,
    b"9" * 5000,
    b"0x" + b"f" * 9000,
    b"[" * 3000,
    b'{"a":' * 3000,
    b"a=" * 3000,
    b"a." * 3000,
    b"1979-05-27T07:32:00Z",
    b"\xef\xbb\xbf",
    "\u202e\u00b2\u0663".encode(),
]
ODD = [
    None,
    True,
    -1,
    0,
    1e-100,
    1e200,
    float("nan"),
    float("inf"),
    "",
    "x" * 5000,
    "\x00",
    [],
    {},
    [[]],
    [1, "2"],
    {"a": {}},
    "1e400",
    "__import__('os')",
    "../../../etc/passwd",
    10**40,
    10**400,
]


class Endless(BaseException):
    """No answer in time; no reader catches it."""


class Tally:
    """How many inputs were tried, and how many of them were refused."""

    def __init__(self):
        self.tried = self.refused = 0

    def read(self, reader, *arguments):
        """What the reader answers; None for a typed error. Anything else comes through."""
        self.tried += 1
        signal.setitimer(signal.ITIMER_REAL, LONGEST)
        try:
            return reader(*arguments)
        except (MbmaError, OSError):
            self.refused += 1
            return None
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)

    def read_file(self, path, content, reader):
        """The same of a file with that content, which stays as it is."""
        path.write_bytes(content)
        try:
            return self.read(reader, path)
        finally:
            assert path.read_bytes() == content


def spoilt(content, rng):
    """Bytes with a few cut, doubled, swapped or replaced places."""
    data = bytearray(content)
    for _ in range(rng.integers(1, 5)):
        at, to = sorted(int(place) for place in rng.integers(0, len(data) + 1, 2))
        kind = rng.integers(6)
        if kind == 0:
            del data[at : min(to, at + 40)]
        elif kind == 1:
            data[at:at] = data[at : min(to, at + 200)]
        elif kind == 2:
            data[at:at] = WORDS[rng.integers(len(WORDS))]
        elif kind == 3 and data:
            data[min(at, len(data) - 1)] = rng.integers(256)
        elif kind == 4:
            length = min(40, (to - at) // 2)
            data[at : at + length], data[to - length : to] = data[to - length : to], data[at : at + length]
        else:
            data = data[: max(at, 1)]
    return bytes(data)


def places(node, path=()):
    """Every place in a document of lists and tables."""
    yield path
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, child in items:
        yield from places(child, (*path, key))


def replaced(document, path, value):
    """The document with something else at one place; None takes a key away."""
    if not path:
        return value
    other = copy.deepcopy(document)
    node = other
    for key in path[:-1]:
        node = node[key]
    if value is None and isinstance(node, dict):
        del node[path[-1]]
    else:
        node[path[-1]] = value
    return other


def changed(document, rng):
    """The document with something odd at one or two places."""
    for _ in range(rng.integers(1, 3)):
        every = list(places(document))
        document = replaced(document, every[rng.integers(len(every))], ODD[rng.integers(len(ODD))])
        if not isinstance(document, dict):
            break
    return document


def as_toml(value):
    """A value as TOML spells it inline."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{as_toml(str(key))} = {as_toml(child)}" for key, child in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(as_toml, value)) + "]"
    if isinstance(value, str):
        return '"' + "".join(c if c.isprintable() and c not in '"\\' else f"\\u{ord(c):04x}" for c in value) + '"'
    return str(value).lower()


def toml_text(document):
    """A TOML file of a document; what is no table stands alone."""
    if not isinstance(document, dict):
        return as_toml(document).encode()
    return "\n".join(f"{as_toml(str(key))} = {as_toml(value)}" for key, value in document.items()).encode()


def finite(*values):
    """Whether all is finite."""
    return all(np.isfinite(np.asarray(value, dtype=float)).all() for value in values)
