"""The audit finds what is wrong, and nothing in what it was run on; workers of a generator end with it."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from generate import audit
from mbma_tables import InputError


@pytest.mark.parametrize("what", audit.BOUNDS)
def test_bounds_hold_in_a_short_search(what):
    (found,) = audit.bound(what, 7, 0.02)
    assert found.answers > 100
    assert found.beyond == 0


def test_a_bound_that_is_exceeded_is_counted_and_quoted(monkeypatch):
    monkeypatch.setitem(
        audit.BOUNDS,
        "too tight",
        (lambda surface, u, rtol: np.array([0.5, np.nan, 2.0]), 10, {}),
    )
    (found,) = audit.bound("too tight", 1, 1.0)
    assert found.beyond == 2 * found.answers / 3
    assert "Surface(" in found.where


def test_untested_answers_and_bad_failures_are_found(monkeypatch):
    monkeypatch.setattr(audit, "LONGEST", 1.0)
    monkeypatch.setitem(audit.CALLS, "island", lambda *given, **options: time.sleep(1.1))
    monkeypatch.setitem(audit.CALLS, "surface", lambda *given: 1 / 0)
    monkeypatch.setitem(
        audit.CALLS, "sensitivity", lambda *given, **options: np.float64(1) / 0
    )
    warning, error, hang = audit.failures(1, 1e-3)
    assert all(
        "1 / 0" not in each.where and each.beyond == 2 for each in (warning, error, hang)
    )
    assert audit.validity(3, 0.02)[0].beyond == 0


@pytest.mark.slow
def test_every_route_answers_a_question_alike():
    """Contact, texts, table, both commands, law and exported C within rounding or stated errors."""
    for found in audit.routes(5, 0.05):
        assert found.answers > 100
        assert found.beyond == 0, found


def test_a_route_that_answers_otherwise_is_counted(monkeypatch):
    def wrong(question):
        return question.misses({"area": np.asarray(question.answer.area) * (1 + 1e-9)})

    def failing(question):
        raise InputError("no such route")

    monkeypatch.setattr(audit, "routes_here", {"wrong": wrong, "failing": failing}.copy)
    by_wrong, by_failing = audit.routes(1, 0.01)
    assert by_wrong.beyond == by_wrong.answers == 5
    assert by_wrong.worst == pytest.approx(1000, rel=1e-3)
    assert by_failing.beyond == 1
    assert by_failing.where.startswith("no such route: ")


@pytest.mark.skipif(not os.path.isdir("/proc"), reason="needs /proc")
def test_workers_end_with_a_killed_parent():
    code = (
        "import time\n"
        "from generate.workers import results\n"
        "if __name__ == '__main__':\n"
        "    for found in results('', eval, 2 * [(\"__import__('os').getpid()\",)], 2):\n"
        "        print(found, flush=True)\n"
        "        time.sleep(60)\n"
    )
    command = [sys.executable, "-W", "ignore", "-c", code]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as parent:
        worker = int(parent.stdout.readline())
        parent.send_signal(signal.SIGKILL)
    end = time.monotonic() + 20
    while os.path.isdir(f"/proc/{worker}") and time.monotonic() < end:
        time.sleep(0.1)
    assert not os.path.isdir(f"/proc/{worker}")
