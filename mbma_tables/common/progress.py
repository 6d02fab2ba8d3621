"""Progress on a terminal: one line for tasks of more than two seconds, erased at the end."""

import contextlib
import dataclasses
import sys
import threading
import time
from collections.abc import Iterator

import click

from mbma_tables.common.plain_text import visible

PATIENCE = 2.0  # seconds before the first display
WIPE = "\r\x1b[K"


@dataclasses.dataclass
class _Task:
    """What is done since `start`, and when it is expected to end."""

    text: str
    start: float = dataclasses.field(default_factory=time.monotonic)
    end: float | None = None  # of the clock; None where it is not known


_doing = [_Task("working")]  # the innermost task last
_ended = threading.Event()
_visible = threading.Event()


def doing(what: str, share: float = 0.0) -> None:
    """Set the text of the progress line, which is shown if the task takes long.

    From the `share` of the task that is done, in [0, 1], the time left is estimated; without
    it none is shown.
    """
    task = _doing[-1]
    task.text = what
    task.end = None
    if share > 0:
        task.end = task.start + (time.monotonic() - task.start) / min(share, 1.0)


def echo(text: object, nl: bool = True, err: bool = False) -> None:
    """Print to standard output, or with `err` to standard error, after erasing the progress line.

    Control characters of the text are escapes, but for tabs and ends of lines.
    """
    _end()
    click.echo(visible(str(text), keep="\n\t"), nl=nl, err=err)


@contextlib.contextmanager
def shown(what: str) -> Iterator[None]:
    """Show the current task and its duration on standard error, if that is a terminal.

    Within another such call, only the text changes until its end.
    """
    _doing.append(_Task(what))
    thread = threading.Thread(target=_beat, args=(time.monotonic(),), daemon=True)
    outermost = len(_doing) == 2 and sys.stderr.isatty()
    if outermost:
        _ended.clear()
        thread.start()
    try:
        yield
    finally:
        _doing.pop()
        if outermost:
            _end()
            thread.join()


def _beat(start: float) -> None:
    wait = PATIENCE
    while not _ended.wait(wait):
        wait = 0.5
        _visible.set()
        text = f"{WIPE}mbma: {_line(_doing[-1], start)} (Ctrl-C ends it)"
        click.echo(text, err=True, nl=False)


def _line(task: _Task, start: float) -> str:
    """What is done, for how long, and how long it takes still."""
    now = time.monotonic()
    line = f"{visible(task.text)}, {now - start:.0f} s"
    if task.end is None:
        return line
    return f"{line}, about {_duration(max(task.end - now, 0.0))} left"


def _duration(seconds: float) -> str:
    """Seconds up to two minutes, then minutes, then hours."""
    if seconds < 120:
        return f"{seconds:.0f} s"
    minutes = seconds / 60
    return f"{minutes:.0f} min" if minutes < 120 else f"{minutes / 60:.1f} h"


def _end() -> None:
    _ended.set()
    if _visible.is_set():
        _visible.clear()
        click.echo(WIPE, err=True, nl=False)
