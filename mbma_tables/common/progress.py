"""Progress on a terminal: one line for tasks of more than two seconds, erased at the end."""

import contextlib
import sys
import threading
import time
from collections.abc import Iterator

import click

from mbma_tables.common.plain_text import visible

PATIENCE = 2.0  # seconds before the first display
WIPE = "\r\x1b[K"

_doing = ["working"]  # the innermost task last
_ended = threading.Event()
_visible = threading.Event()


def doing(what: str) -> None:
    """Set the text of the progress line, which is shown if the task takes long."""
    _doing[-1] = what


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
    _doing.append(what)
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
        text = (
            f"{WIPE}mbma: {visible(_doing[-1])}, {time.monotonic() - start:.0f} s "
            "(Ctrl-C ends it)"
        )
        click.echo(text, err=True, nl=False)


def _end() -> None:
    _ended.set()
    if _visible.is_set():
        _visible.clear()
        click.echo(WIPE, err=True, nl=False)
