"""The core as Python calls it: wrong arguments, threads, forks and Ctrl-C."""

import dataclasses
import itertools
import os
import pathlib
import pickle
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from mbma_tables import Surface, contact_law, open_table
from mbma_tables.core import core
from mbma_tables.theories.mbma.profile import RULES


def run(code, timeout=120):
    ended = subprocess.run(
        [sys.executable, *code], capture_output=True, text=True, timeout=timeout
    )
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


def test_wrong_arguments_are_refused():
    assert int(run([str(pathlib.Path(__file__).with_name("refusals.py"))])) > 1500


def test_arrays_of_wrong_sizes_are_refused():
    x = np.linspace(0.1, 1.0, 10)
    for size in (0, 9, 11):
        with pytest.raises(
            ValueError, match="sizes of the arrays of elementary do not match"
        ):
            core.elementary(0, x, np.empty(size))
    locked = x.copy()
    locked.flags.writeable = False
    out = np.empty(10)
    assert core.elementary(0, locked, out) == 0
    np.testing.assert_allclose(out, np.exp(x), rtol=1e-15)
    with pytest.raises(ValueError, match="read-only"):
        core.elementary(0, x, locked)


def lookup(cells, places, numbers):
    """An island by a universal table."""
    answer = np.empty((1, 3))
    core.phi(np.array([2.0]), np.array([1e-3]), cells, places, numbers, answer, None)
    return answer[0]


def test_a_table_whose_places_are_no_cells_of_it_is_refused():
    """Looked up once a call: places that begin or lie outside, and ranges with more strips or buckets than places."""
    cells, places, numbers = open_table("universal").cells
    assert lookup(cells, places, numbers)[0] == pytest.approx(0.0051784366, abs=1e-10)
    strips = int((numbers[1] - numbers[0]) * numbers[2]) + 1
    record = 136
    for place, number in (
        (0, -1),
        (0, strips - 1),
        (0, places.size),
        (strips, -1),
        (places.size - 1, cells.size // record),
    ):
        wrong = places.copy()
        wrong[place] = number
        with pytest.raises(ValueError, match="phi, or numbers of items in them"):
            lookup(cells, wrong, numbers)
    for place, number in itertools.product(range(6), (-1e300, np.nan, np.inf, -np.inf)):
        # the largest mu is compared, not counted with
        if place == 3:
            continue
        wrong = numbers.copy()
        wrong[place] = number
        with pytest.raises(ValueError, match="phi, or numbers of items in them"):
            lookup(cells, places, wrong)
    with pytest.raises(ValueError, match="phi, or numbers of items in them"):
        lookup(cells[:record], places, numbers)


@pytest.mark.parametrize("word", [1, 2])
@pytest.mark.parametrize("number", [np.nan, -1.0, 0.0, 17.0, 1e300])
def test_rules_of_panels_with_other_numbers_of_nodes_and_gaps_are_refused(word, number):
    rules = RULES.copy()
    rules[word] = number
    ends = np.array([0.1])
    fields = np.ones((4, 1, 19))
    error = np.empty(1)
    given = np.array([1]), ends, 2 * ends, fields, 2, 1.0, error
    assert core.profile_missed(RULES, *given) == 0
    with pytest.raises(ValueError, match="profile_missed, or numbers of items in them"):
        core.profile_missed(rules, *given)


def test_arrays_that_are_not_aligned_or_overlap_results_are_refused():
    x = np.linspace(0.1, 1.0, 10)
    shifted = memoryview(bytearray(b"\0" + x.tobytes()))[1:].cast("d")
    with pytest.raises(ValueError, match="not aligned"):
        core.elementary(0, shifted, np.empty(10))
    both = np.linspace(0.1, 1.0, 15)
    for read, written in ((both[:10], both[5:]), (both[5:], both[:10]), (x, x)):
        with pytest.raises(
            ValueError, match="a result of elementary overlaps another of its arrays"
        ):
            core.elementary(0, read, written)
    assert core.elementary(0, both[:5], both[5:10]) == 0


def test_a_law_is_asked_only_of_a_block_that_nothing_changes():
    """It is checked when it is opened, and not again."""
    law = contact_law(Surface(0.7, 0.2, 60.0, 1.0, 3.0))
    block = law.block.copy()
    with pytest.raises(ValueError, match="must be read-only"):
        dataclasses.replace(law, block=block).pressure(1.0)
    block.flags.writeable = False
    assert dataclasses.replace(law, block=block).pressure(1.0) == law.pressure(1.0)
    restored = pickle.loads(pickle.dumps(law))
    assert not restored.block.flags.writeable
    assert restored.pressure(1.0) == law.pressure(1.0)


def test_a_table_as_an_object_is_made_once_of_arrays_that_nothing_changes():
    model = open_table("island4d")
    for arrays, island in (
        (open_table("universal").cells, (2.0, 1e-3)),
        (model.core_table, (1.0, 3.0, 20.0, 0.8)),
    ):
        table = core.Table(*arrays)
        assert len(table.at(*island)) == 3
        assert table.at(*island[:-1], np.nan) is None
        assert table.at(*island[:-1], "0.8") is None
        with pytest.raises(TypeError, match="an island is not 3 numbers"):
            table.at(1.0, 2.0, 3.0)
        with pytest.raises(TypeError, match="made once"):
            table.__init__(*arrays)
        with pytest.raises(TypeError, match="of 3 or of 5 arrays"):
            core.Table(*arrays[:2])
        for k, array in enumerate(arrays):
            changed = [*arrays]
            changed[k] = array.copy()
            with pytest.raises(ValueError, match="read-only"):
                core.Table(*changed)
            changed[k] = array[:1]
            with pytest.raises(ValueError, match="match"):
                core.Table(*changed)
            changed[k] = None
            with pytest.raises(ValueError, match=r"match|read-only"):
                core.Table(*changed)
    wrong = model.core_table[2].copy()
    wrong[1] = -5
    wrong.flags.writeable = False
    with pytest.raises(ValueError, match="or numbers of items in them"):
        core.Table(*model.core_table[:2], wrong, *model.core_table[3:])
    with pytest.raises(TypeError, match="an island is not 2 numbers"):
        core.Table.__new__(core.Table).at(1.0, 2.0)


def test_other_threads_go_on_during_a_call():
    x = np.full(3_000_000, 0.5)
    worker = threading.Thread(target=lambda: core.elementary(3, x, np.empty(x.size)))
    worker.start()
    turns = 0
    while worker.is_alive():
        turns += 1
    assert turns > 100


FORK = """
import os, signal
import numpy as np
from mbma_tables import Surface, contact, contact_law
signal.alarm(100)
n = 1000
many = Surface(np.linspace(0.3, 1.0, n), 0.2, np.geomspace(0.7, 4000, n), 1.0, 3.0)

def answers():
    law = contact_law(Surface(0.7, 0.2, 60.0, 1.0, 3.0), theory="mbma")
    total = contact(many, separation=1.0).pressure
    found = total, law.pressure(0.5), law.at_pressure(1e-3).area
    return b"".join(np.asarray(one).tobytes() for one in found)

known = answers()
for _ in range(4):
    child = os.fork()
    if child == 0:
        os._exit(answers() != known)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), answers() == known)
"""


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_forks_after_use_go_on():
    assert run(["-c", FORK]) == "0 True\n" * 4


# of each long request what it needs, and the request
LONG = {
    "totals": ("", "contact(many, separation=1.0, theory='mbma')"),
    "exact": (
        "from mbma_tables.theories import Mbma\nexact = Mbma(island_model='exact')",
        "contact(one, separation=np.linspace(0, 2, 2000), theory=exact)",
    ),
    "islands": ("X = np.linspace(-5, 40, 100_000)", "greenwood_tripp.solve(X, 1.0)"),
    "four numbers": (
        "four, delta = open_table('island4d'), np.linspace(1, 2, 3_000_000)",
        "four.lookup(delta, 3.0, 20.0, 0.8)",
    ),
    "a law": (
        "law, d = contact_law(one, theory='mbma'), np.linspace(-2, 2.5, 3_000_000)",
        "law.at_pressure(law.pressure(separation=d))",
    ),
    "calibrated": ("", "contact(one, mean_separation=u, theory='calibrated')"),
    "hardness": (
        "from mbma_tables import Bodies\n"
        "pressure, bodies = np.geomspace(1e-4, 1e-2, 1_000_000), Bodies(hardness=0.05)",
        "contact(one, bodies, pressure=pressure, theory='calibrated')",
    ),
    "leakage": (
        "found = contact(one, mean_separation=u, theory='calibrated')",
        "found.leakage.K",
    ),
    "factors of the flow through a map": (
        "from mbma_tables.theories.simulated.reynolds import flow_conductance\n"
        "gap = np.random.default_rng(1).uniform(0.1, 1.0, (600, 600))",
        "flow_conductance(gap, (1.0, 1.0))",
    ),
    "gas conductance": (
        "from mbma_tables.contacts.quantities.gas import mean_inverse\nshare = np.linspace(1e-3, 0.1, u.size)",
        "mean_inverse(u, share, 0.3, 1.0)",
    ),
    "energy": ("", "contact(one, mean_separation=u[::10], theory='persson').energy"),
    "flow factors": (
        "from mbma_tables.contacts.quantities.effective_medium import FlowConstants\n"
        "from mbma_tables.contacts.quantities.lay import factors\n"
        "gaps, share = u[::300], np.full(u[::300].shape, 0.02)",
        "factors(gaps, share, 3.0, FlowConstants())",
    ),
}
ASKED = """
import signal, sys, time
import numpy as np
from mbma_tables import Surface, contact, contact_law, greenwood_tripp, open_table
# a shell that starts the tests in the background has them ignore it
signal.signal(signal.SIGINT, signal.default_int_handler)
one, n = Surface(0.7, 0.2, 60.0, 1.0, 3.0), 100_000
many = Surface(np.linspace(0.3, 1.0, n), 0.2, np.geomspace(0.7, 4000, n), 1.0, 3.0)
u = np.linspace(0.2, 2.5, 3_000_000)
{needed}
{request}  # imports what it needs: one that is interrupted can end in other errors than KeyboardInterrupt
try:
    print("begun", flush=True)
    while True:  # however fast the processor
        {request}
except KeyboardInterrupt:
    print(time.process_time())
"""


def processor_time(process):
    """Seconds that a process has computed for, in all its threads."""
    fields = (
        pathlib.Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    )
    return sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")


@pytest.mark.slow
@pytest.mark.skipif(
    sys.platform != "linux", reason="reads the processor time of another process"
)
@pytest.mark.parametrize("name", LONG)
def test_control_c_ends_long_requests_within_a_second(name):
    """A signal from outside; counted in time of the processor, whatever else the machine does."""
    needed, request = LONG[name]
    code = ASKED.format(needed=needed, request=request)
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            assert process.stdout.readline() == "begun\n"
            before = processor_time(process)
            # into the midst of it
            while processor_time(process) < before + 0.2:
                time.sleep(0.02)
            sent = processor_time(process)
            process.send_signal(signal.SIGINT)
            assert float(process.stdout.readline()) - sent < 1.0
        finally:
            process.kill()
