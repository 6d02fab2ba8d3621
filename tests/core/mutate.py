"""Calls of record.py with arguments spoilt, for a core under sanitizers: ``python mutate.py FILE COUNT``.

Every argument of every function is spoilt alone, in each way that `ways` lists, and COUNT
times together with others. Prints as JSON how many calls each argument of each function was
spoilt in.
"""

import ctypes
import itertools
import json
import pathlib
import pickle
import sys

import numpy as np
from record import Call, functions

from mbma_tables.core import core

NUMBERS = [
    0.0,
    -0.0,
    5e-324,
    -1e-310,
    1e-300,
    1.0,
    -1.0,
    2.5,
    1e19,
    -1e300,
    np.inf,
    -np.inf,
    np.nan,
]
WHOLE = [0, 1, -1, 2, 3, 17, 4096, 2**31 - 1, -(2**31), 2**32, 2**62, 2**63 - 1, -(2**63)]
HEAD = 20  # leading items of an array, each of which may have a meaning of its own
EACH = 32  # leading items that are spoilt one by one
SCATTERED = 10  # items anywhere behind them
LARGE = 50_000  # bytes of an array, as tables have them, but no results
RANDOM = np.random.default_rng(1)


def exact(content, kind):
    """An array in memory of its own, beyond whose end a sanitizer looks."""
    return np.frombuffer(bytearray(content), kind)


def unaligned(array):
    """The same numbers one byte off, in a buffer that does not mention it."""
    memory = memoryview(bytearray(b"\0" + array.tobytes()))
    return memory[1:].cast(array.dtype.char)


def whole_numbers(kind):
    """`WHOLE`, as far as a type of whole numbers has them."""
    limits = np.iinfo(kind)
    return np.array(
        [number for number in WHOLE if limits.min <= number <= limits.max], kind
    )


def odd_numbers(kind):
    """Odd numbers for an item of an array, also as the bits of a float."""
    if kind.kind != "f":
        return whole_numbers(kind)
    bits = whole_numbers(np.dtype(f"i{kind.itemsize}"))
    with np.errstate(over="ignore"):
        return np.concatenate([np.array(NUMBERS).astype(kind), bits.view(kind)])


def other_arrays(array):
    """Arrays of other sizes, types and places than a function takes."""
    for count in {0, 1, array.size // 2, array.size - 1}:
        if 0 <= count < array.size:
            yield exact(array.ravel()[:count].tobytes(), array.dtype)
    yield exact(array.tobytes() + array.ravel()[:1].tobytes(), array.dtype)
    yield exact(2 * array.tobytes(), array.dtype)
    for kind in "dlifB":
        yield exact(array.tobytes()[: array.nbytes // 8 * 8], kind)
    locked = exact(array.tobytes(), array.dtype)
    locked.flags.writeable = False
    yield locked
    if array.size > 0:
        yield unaligned(array)


def spoilt_items(array):
    """The array with odd numbers in one item, and in all of them."""
    leading = range(min(EACH, array.size))
    scattered = RANDOM.integers(array.size, size=SCATTERED if array.size > EACH else 0)
    for place in (*leading, *scattered.tolist()):
        odd = odd_numbers(array.dtype)
        for number in odd if place < HEAD else RANDOM.choice(odd, 3):
            spoilt = exact(array.tobytes(), array.dtype)
            spoilt[place] = number
            yield spoilt
    for number in odd_numbers(array.dtype):
        spoilt = exact(array.tobytes(), array.dtype)
        spoilt[:] = number
        yield spoilt


def ways(given):
    """Everything that an argument is replaced by."""
    if isinstance(given, float):
        yield from NUMBERS
    elif isinstance(given, np.ndarray):
        yield None
        yield from other_arrays(given)
        if given.size > 0:
            yield from spoilt_items(given)
    elif given is None:
        yield from (1.0, np.zeros(1), np.zeros(300, np.uint8))
    else:
        yield from WHOLE


def fresh(given):
    """Arguments whose arrays are in memory of their own, large tables excepted, which calls only read."""
    return [
        exact(one.tobytes(), one.dtype)
        if isinstance(one, np.ndarray) and one.nbytes < LARGE
        else one
        for one in given
    ]


def spoilt_calls(given, together, alone):
    """(numbers of the spoilt arguments, all arguments) of one call; those numbered `alone` are spoilt alone too."""
    for place in alone:
        for other in ways(given[place]):
            arguments = fresh(given)
            arguments[place] = other
            yield [place], arguments
    # results that are written over what is read
    arrays = [
        place for place, argument in enumerate(given) if isinstance(argument, np.ndarray)
    ]
    for first, second in itertools.permutations(arrays, 2):
        if given[second].nbytes >= given[first].nbytes > 0:
            arguments = fresh(given)
            arguments[first] = (
                arguments[second]
                .view(np.uint8)[: given[first].nbytes]
                .view(given[first].dtype)
            )
            yield [first, second], arguments
    several = [list(itertools.islice(ways(argument), 60)) for argument in given]
    for _ in range(together if given else 0):
        arguments = fresh(given)
        places = RANDOM.integers(len(given), size=3).tolist()
        for place in places:
            choice = several[place][RANDOM.integers(len(several[place]))]
            arguments[place] = (
                exact(choice.tobytes(), choice.dtype)
                if isinstance(choice, np.ndarray)
                else choice
            )
        yield places, arguments


def chosen(calls):
    """Recorded calls of a function, the shortest first, each with the numbers of its arguments that no other had.

    What is None in one call is an array in another.
    """
    covered = set()
    for call in sorted(
        calls,
        key=lambda call: sum(
            one.nbytes for one in call.given if isinstance(one, np.ndarray)
        ),
    ):
        given = {
            place for place, argument in enumerate(call.given) if argument is not None
        }
        if given - covered:
            yield call, sorted(given - covered)
        covered |= given
    if len(covered) < len(call.given):
        yield call, [place for place in range(len(call.given)) if place not in covered]


class AnyLaw(core.Law):
    """A contact law of any block."""

    def __init__(self, block):
        if isinstance(block, np.ndarray):
            block.flags.writeable = False
        self.block = block

    def _ask_one(self, *given):
        """What Python would answer."""


def ask_law(block, gap, gaps):
    """Ask a law object of the core for everything, with and without Python."""
    law = AnyLaw(block)
    quantities = (law.pressure, law.area, law.stiffness, law.area_slope, law.energy)
    addresses, data = law._addresses()
    for quantity, address in zip(quantities, addresses, strict=True):
        quantity(gap)
        quantity(separation=gap)
        quantity(separation=gaps)
        if isinstance(gap, float):
            ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double, ctypes.c_void_p)(address)(
                gap, data
            )


if __name__ == "__main__":
    recorded = pickle.loads(pathlib.Path(sys.argv[1]).read_bytes())
    together = int(sys.argv[2])
    called = {**dict(functions()), "Law": ask_law}
    counts = {name: [] for name in called}
    for call in [call for call in recorded if call.name == "law_fill"]:
        recorded.append(Call("Law", [call.given[1], 0.5, call.given[0]], 0, []))
    for name, function in called.items():
        for call, alone in chosen([call for call in recorded if call.name == name]):
            tables = [
                exact(one.tobytes(), one.dtype) if isinstance(one, np.ndarray) else one
                for one in call.given
            ]
            call = call._replace(given=tables)
            counts[name] = spoilt = counts[name] or [0] * len(call.given)
            for places, arguments in spoilt_calls(call.given, together, alone):
                for place in places:
                    spoilt[place] += 1
                try:
                    function(*arguments)
                except (TypeError, ValueError, BufferError, OverflowError):
                    continue
    sys.stdout.write(json.dumps(counts))
