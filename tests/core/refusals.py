"""Give every function of the core wrong arguments; prints how many were refused, all of them unless it fails."""

import sys

import numpy as np
from record import functions, recorded, use


def wrong(given, changed):
    """Cases of a call by the number of arguments, their kinds, the type of items, their order, locked results."""
    if given:
        yield given[:-1]
    yield [*given, 1.0]
    for k, one in enumerate(given):
        others = ["text", [1.0], 1j]
        if isinstance(one, np.ndarray):
            others += [
                1.0,
                *(np.zeros(one.shape, kind) for kind in (np.complex64, np.int16, ">f8")),
                b"1234567",
            ]
            if one.size > 1:
                others.append(np.repeat(one.ravel(), 2)[::2])
        elif one is not None:
            others += [None, np.zeros(3)]
        for other in others:
            yield [*given[:k], other, *given[k + 1 :]]
    for k in changed:
        locked = given[k].copy()
        locked.flags.writeable = False
        yield [*given[:k], locked, *given[k + 1 :]]


if __name__ == "__main__":
    known = dict(functions())
    first = {}
    for call in recorded(use):
        first.setdefault(call.name, (call.given, call.after))
    refused = 0
    for name, (before, after) in first.items():
        changed = [
            k
            for k, one in enumerate(before)
            if isinstance(one, np.ndarray) and one.tobytes() != after[k].tobytes()
        ]
        for case in wrong(before, changed):
            try:
                known[name](*case)
            except (TypeError, ValueError, BufferError):
                refused += 1
            else:
                raise SystemExit(f"{name} took {case}")
    sys.stdout.write(f"{refused}\n")
