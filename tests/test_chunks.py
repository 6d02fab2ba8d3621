"""Candidates in chunks: in order, few at a time."""

import threading
import weakref

import numpy as np
import pytest

from mbma_tables import Bodies, Surface, contact, in_chunks
from mbma_tables.common.errors import InputError, OutOfRangeError

N = 1000


def face(some):
    Rq = np.linspace(0.2, 0.4, N)
    return Surface(0.8, 0.01, 2.0, Rq[some], 1.5, unit="um")


def pressed(some):
    return contact(face(some), Bodies("58 GPa", hardness="1 GPa"), pressure="10 MPa")


@pytest.mark.parametrize("threads", [None, 1, 3])
def test_chunks_are_the_whole_in_order(threads):
    parts = list(in_chunks(lambda some: pressed(some).area, N, size=128, threads=threads))
    assert [some.start for some, _ in parts] == list(range(0, N, 128))
    assert parts[-1][0].stop == N
    whole = pressed(slice(None)).area
    np.testing.assert_array_equal(np.concatenate([area for _, area in parts]), whole)


class Answer:
    """Something whose end is known."""


def test_few_answers_are_in_memory():
    alive = weakref.WeakSet()
    most = 0
    lock = threading.Lock()

    def make(some):
        answer = Answer()
        with lock:
            alive.add(answer)
        return answer

    for _, answer in in_chunks(make, 500, size=5, threads=2):
        del answer
        with lock:
            most = max(most, len(alive))
    # two threads, one that waits, and the one that was just handed over
    assert 1 <= most <= 4


def test_errors_of_candidates_and_of_arguments_are_raised():
    def make(some):
        return contact(face(some), "58 GPa", pressure=-1.0 if some.start else 1e-3)

    chunks = in_chunks(make, N, size=300, what="designs")
    some, first = next(chunks)
    assert (some.stop, first.area.shape) == (300, (300,))
    with pytest.raises(OutOfRangeError, match="pressure must be at least 0"):
        next(chunks)
    assert list(in_chunks(make, 0)) == []
    for wrong in ({"size": 0}, {"threads": 0}, {"threads": 1.5}):
        with pytest.raises(
            InputError, match=f"{next(iter(wrong))} must be a whole number"
        ):
            in_chunks(make, N, **wrong)
    with pytest.raises(InputError, match="count must be a whole number"):
        in_chunks(make, -1)
