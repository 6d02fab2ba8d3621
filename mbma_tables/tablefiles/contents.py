"""What stands in netCDF bytes that anyone may have written, read by a process of its own.

On bytes made for it the HDF5 library opens the files that they name, walks groups in circles and unpacks whatever
they say to hold. The process that meets them can open no file and has little memory and little time; what it hands
back are numbers and attributes alone.
"""

from __future__ import annotations

import atexit
import contextlib
import dataclasses
import json
import math
import os
import pathlib
import subprocess
import sys
import threading
import warnings
from collections.abc import Callable
from typing import IO, Any

import netCDF4
import numpy as np
from numpy.typing import NDArray

LARGEST_CONTENT = 256 * 2**20  # bytes of values
SPARE_MEMORY = 192 * 2**20  # bytes that reading may take beyond a multiple of the file's size
MEMORY_RATIO = 16
LONGEST = 8.0  # seconds
WIDTH = 8  # bytes of a length
GOOD, BAD = b"+", b"-"

_processes: dict[int, subprocess.Popen[bytes]] = {}  # of each process that asks: after a fork there are two
_one_at_a_time = threading.Lock()


@dataclasses.dataclass(frozen=True)
class Variable:
    """An array of a file."""

    dimensions: tuple[str, ...]
    attributes: dict[str, Any]
    values: NDArray[Any]


@dataclasses.dataclass(frozen=True)
class Contents:
    """The attributes and variables of a file, in its order."""

    attributes: dict[str, Any]
    variables: dict[str, Variable]


def plain(value: Any) -> Any:
    """An attribute as JSON holds it, the same before writing and after reading."""
    if isinstance(value, np.ndarray):
        return [plain(item) for item in value.tolist()]
    return value.item() if isinstance(value, np.generic) else value


def attributes_of(owner: netCDF4.Dataset | netCDF4.Variable[Any]) -> dict[str, Any]:
    """The attributes of a file or a variable, as JSON holds them."""
    return {name: plain(owner.getncattr(name)) for name in owner.ncattrs()}


def contents_of(body: bytes) -> Contents:
    """The contents of netCDF bytes.

    Raises
    ------
    ValueError
        Where there is more in it than arrays of numbers and attributes, or more than a table has.
    """
    with netCDF4.Dataset("given", memory=body) as dataset:
        if dataset.groups:
            raise ValueError("it has groups")
        size = 0
        for name, variable in dataset.variables.items():
            if not isinstance(variable.dtype, np.dtype) or variable.dtype.kind not in "fiu":
                raise ValueError(f"variable {name!r} holds no numbers")
            size += math.prod(variable.shape) * variable.dtype.itemsize
        if size > LARGEST_CONTENT:
            raise ValueError(f"it claims {size} bytes of values, at most {LARGEST_CONTENT} are read")
        # values as they are stored, for their hash
        dataset.set_auto_maskandscale(False)
        variables = {
            name: Variable(variable.dimensions, attributes_of(variable), variable[...])
            for name, variable in dataset.variables.items()
        }
        return Contents(attributes_of(dataset), variables)


def packed(contents: Contents) -> bytes:
    """Contents as bytes: a line of JSON, then the values."""
    described = [
        (name, variable.dimensions, variable.attributes, variable.values.dtype.str, variable.values.shape)
        for name, variable in contents.variables.items()
    ]
    head = json.dumps([contents.attributes, described]).encode()
    return b"\n".join([head, b"".join(variable.values.tobytes() for variable in contents.variables.values())])


def unpacked(message: bytes) -> Contents:
    """The contents that were packed."""
    head, _, rest = message.partition(b"\n")
    attributes, described = json.loads(head)
    variables, start = {}, 0
    for name, dimensions, own, dtype, shape in described:
        count = math.prod(shape)
        # copied: aligned, and writable as what a library reads
        values = np.frombuffer(rest, dtype, count, start).reshape(shape).copy()
        start += values.nbytes
        variables[name] = Variable(tuple(dimensions), own, values)
    return Contents(attributes, variables)


def answer(body: bytes) -> bytes:
    """GOOD and the packed contents, or BAD and the reason."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return GOOD + packed(contents_of(body))
        # whatever the libraries raise on such bytes: this process has no other work that it could spoil
        except Exception as fault:
            return BAD + (str(fault) or type(fault).__name__).encode(errors="replace")


def _receive(stream: IO[bytes]) -> bytes:
    """A message, which begins with its length; empty where the other side has ended."""
    size = int.from_bytes(stream.read(WIDTH), "little")
    message = stream.read(size)
    return message if len(message) == size else b""


def _send(stream: IO[bytes], message: bytes) -> None:
    stream.write(len(message).to_bytes(WIDTH, "little"))
    stream.write(message)
    stream.flush()


def _limits() -> Callable[[int], None]:
    """Give up the right to open files; what is returned limits the memory for a file of that size."""
    try:
        import resource
    except ImportError:  # not everywhere
        return lambda size: None
    taken = 0
    with contextlib.suppress(OSError):
        taken = resource.getpagesize() * int(pathlib.Path("/proc/self/statm").read_text().split()[0])
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_NOFILE, (0, 0))

    def limit(size: int) -> None:
        if taken:
            most = taken + SPARE_MEMORY + MEMORY_RATIO * size
            resource.setrlimit(resource.RLIMIT_AS, (most, resource.RLIM_INFINITY))

    return limit


def serve(given: IO[bytes], answers: IO[bytes]) -> None:
    """Answer until nothing comes any more, with no right to open a file."""
    # what the libraries load late is loaded now
    netCDF4.Dataset("nothing", "w", memory=1024).close()
    answer(b"")
    limit = _limits()
    _send(answers, GOOD)
    while body := _receive(given):
        limit(len(body))
        _send(answers, answer(body))


def _start() -> subprocess.Popen[bytes]:
    """A process that serves, ready."""
    try:
        process = subprocess.Popen(
            [sys.executable, "-P", __file__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )
    except OSError as fault:
        raise ValueError(f"sys.executable = {sys.executable!r} cannot be run to read it: {fault.strerror}") from None
    _processes[os.getpid()] = process
    assert process.stdout is not None
    _receive(process.stdout)
    return process


@atexit.register
def _end() -> None:
    """End the process, where there is one."""
    process = _processes.pop(os.getpid(), None)
    if process is not None:
        with contextlib.suppress(OSError), process:
            process.kill()


def foreign_contents(body: bytes) -> Contents:
    """`contents_of`, by the other process.

    Raises
    ------
    ValueError
        Where they could not be read, or the other process could not be started or came to no end.
    """
    reply = b""
    with _one_at_a_time:
        process = _processes.get(os.getpid()) or _start()
        assert process.stdin is not None
        assert process.stdout is not None
        clock = threading.Timer(LONGEST, process.kill)
        clock.start()
        try:
            with contextlib.suppress(OSError):
                _send(process.stdin, body)
                reply = _receive(process.stdout)
        finally:
            clock.cancel()
            # what the libraries stumbled on once may stay with them
            if not reply.startswith(GOOD):
                _end()
    if not reply:
        raise ValueError(f"the HDF5 library crashes on it, or reads for more than {LONGEST:g} s")
    if not reply.startswith(GOOD):
        raise ValueError(reply[len(BAD) :].decode())
    return unpacked(reply[len(GOOD) :])


if __name__ == "__main__":
    serve(sys.stdin.buffer, sys.stdout.buffer)
