"""Fuzz tests use the small tables of the tests of table files, and count what they try."""

import pathlib
import signal
import sys

import pytest
from fuzzing import Endless, Tally

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "tablefiles"))


@pytest.fixture
def tally(record_property):
    """Reads inputs one by one, each under a watch."""

    def ring(*_):
        raise Endless

    before = signal.signal(signal.SIGALRM, ring)
    count = Tally()
    yield count
    signal.signal(signal.SIGALRM, before)
    record_property("inputs fuzzed", count.tried)
    record_property("refused", count.refused)
    assert count.tried
