"""The audit finds what is wrong, and nothing in what it was run on; workers of a generator end with it."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from generate import audit


@pytest.mark.parametrize("what", audit.BOUNDS)
def test_bounds_hold_in_a_short_search(what):
    (found,) = audit.bound(what, 7, 0.02)
    assert found.answers > 100
    assert found.beyond == 0


def test_a_bound_that_is_exceeded_is_counted_and_quoted(monkeypatch):
    monkeypatch.setitem(audit.BOUNDS, "too tight", (lambda surface, u, rtol: np.array([0.5, np.nan, 2.0]), 10, {}))
    (found,) = audit.bound("too tight", 1, 1.0)
    assert found.beyond == 2 * found.answers / 3
    assert "Surface(" in found.where


def test_untested_answers_and_bad_failures_are_found(monkeypatch):
    monkeypatch.setattr(audit, "LONGEST", 1.0)
    monkeypatch.setitem(audit.CALLS, "island", lambda *given, **options: time.sleep(1.1))
    monkeypatch.setitem(audit.CALLS, "surface", lambda *given: 1 / 0)
    monkeypatch.setitem(audit.CALLS, "sensitivity", lambda *given, **options: np.float64(1) / 0)
    warning, error, hang = audit.failures(1, 1e-3)
    assert all("1 / 0" not in each.where and each.beyond == 2 for each in (warning, error, hang))
    assert audit.validity(3, 0.02)[0].beyond == 0


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
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as parent:
        worker = int(parent.stdout.readline())
        parent.send_signal(signal.SIGKILL)
    end = time.monotonic() + 20
    while os.path.isdir(f"/proc/{worker}") and time.monotonic() < end:
        time.sleep(0.1)
    assert not os.path.isdir(f"/proc/{worker}")
