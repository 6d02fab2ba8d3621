"""Ways to spoil an input, and the one outcome that is allowed: a typed error, or a right answer."""

import signal

import numpy as np

from mbma_tables import MbmaError

LONGEST = 10.0  # seconds for one input
WORDS = [*b' nan inf -1 1e400 [ ] { } = , # \n \x00 \xff \' " """ 1979-05-27T07:32:00Z \xef\xbb\xbf'.split(b" ")]
WORDS += [b"0" * 400, b"9" * 5000, b"0x" + b"f" * 9000, "\u202e\u00b2\u0663".encode()]
WORDS += [3000 * word for word in (b"[", b'{"a":', b"a=", b"a.")]


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


def finite(*values):
    """Whether all is finite."""
    return all(np.isfinite(np.asarray(value, dtype=float)).all() for value in values)
