"""Fixtures of several files; what they need is imported when they are first asked for."""

import os
import signal

import pytest
from hypothesis import settings

# a busy machine is no fault
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

# parallel workers share the cores, and threads of BLAS that wait for each other cost more than the work itself
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


@pytest.fixture(scope="session", params=["universal", "island4d"])
def built(request, tmp_path_factory):
    """(kind, its content) of a small table built here."""
    from small_builds import KINDS, small

    from generate.tables import commands
    from generate.tables.chunks import ChunkedSolver
    from generate.tables.configuration import load

    configuration = load(request.param, small(tmp_path_factory.mktemp("built"), request.param))
    return KINDS[request.param](configuration), commands.built(configuration, ChunkedSolver())


@pytest.fixture
def tally(record_property):
    """Reads inputs one by one, each under a watch, and counts what it tried."""
    from fuzzing import Endless, Tally

    def ring(*_):
        raise Endless

    before = signal.signal(signal.SIGALRM, ring)
    count = Tally()
    yield count
    signal.signal(signal.SIGALRM, before)
    record_property("inputs fuzzed", count.tried)
    record_property("refused", count.refused)
    assert count.tried
