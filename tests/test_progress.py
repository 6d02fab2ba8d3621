"""The progress line of a terminal: what is done, for how long, and the time that is left."""

import io
import time

import pytest

from mbma_tables.common import progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_time_left_follows_from_the_share_that_is_done(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setattr(progress, "PATIENCE", 0.05)
    with progress.shown("loads"):
        time.sleep(0.2)
        # 0.2 s for 1/500 of it
        progress.doing("loads: 1 of 500", 1 / 500)
        time.sleep(0.6)
    assert "mbma: loads, 0 s (Ctrl-C" in terminal.getvalue()
    line = terminal.getvalue().split("loads: 1 of 500, ")[1]
    # where another process had the processor, more than 100 s are left
    assert line.startswith(("0 s, about ", "1 s, about "))
    assert " left (Ctrl-C" in line
    left, unit = line.split("about ")[1].split()[:2]
    seconds = float(left) * {"s": 1, "min": 60}[unit]
    assert 95 <= seconds < 600


def test_time_left_is_of_the_innermost_task(monkeypatch):
    clock = iter([14.0, 20.0, 21.0, 30.0, 31.0])
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))
    outer = progress._Task("outer", 0.0)
    inner = progress._Task("inner", 10.0)
    monkeypatch.setattr(progress, "_doing", [outer, inner])
    progress.doing("2 of 8", 0.25)
    # begun at 10, a quarter done at 14: until 26
    assert progress._line(inner, 0.0) == "2 of 8, 20 s, about 6 s left"
    assert progress._line(outer, 0.0) == "outer, 21 s"
    # late: never a negative time
    assert progress._line(inner, 0.0) == "2 of 8, 30 s, about 0 s left"
    progress.doing("what has no share")
    assert progress._line(inner, 0.0) == "what has no share, 31 s"


@pytest.mark.parametrize(
    ("seconds", "text"), [(7.4, "7 s"), (119, "119 s"), (300, "5 min"), (9000, "2.5 h")]
)
def test_durations(seconds, text):
    assert progress._duration(seconds) == text
