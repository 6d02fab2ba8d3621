"""``python -m benchmarks table_uses``: derivatives, inverses, tables of theories, and the ways to make a table.

It writes three tables of docs/tables.md: derivatives and inverses of tables of functions
against the functions, tables of theories with the time of their answers, and the bits of a
table that was made in parts, on a cluster, or after its process was killed.
"""

import functools
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
from typing import Any

import click
import numpy as np

from benchmarks import functions
from benchmarks.rows import microseconds, rounds
from generate import page
from generate.files import ROOT
from mbma_tables import Surface
from mbma_tables.tables.function_table import FunctionTable
from mbma_tables.tables.make_function import make, merge, verified_errors, wanted_of
from mbma_tables.theories import Tabulated
from mbma_tables.theories.totals import persson

POINTS = 20_000
STEP = 1e-30  # of derivatives by a complex number, which are exact to rounding
ANSWER = 1e-3  # s, of the slow theory
KILLED_AFTER = 2.0  # s, from the first call on
TARGET = 1e-4  # of theories
TARGET_OF_WAYS = 1e-3  # of tables whose bits are compared
CALLS = "MBMA_BENCHMARK_CALLS"  # name of a file to which each call adds its points
USES = (
    "function | axes | derivatives: largest error | of their bound | inverses: largest error | "
    "of their bound | value | with derivatives | inverse"
)
THEORIES = (
    "theory | target | cells | made in | largest error | of points | above the bound | "
    "an answer in batches"
)
WAYS = "made | same bits | work lost"
RANGE: dict[str, Any] = {
    "axes": {
        "hurst": {"low": 0.6, "high": 0.9},
        "zeta_1": {"low": 32.0, "high": 256.0, "transform": "log"},
        "gap": {"low": 0.5, "high": 2.5},
    },
    "outputs": {"pressure": {"transform": "log"}, "area": {"transform": "log"}},
    "certificate_points": 2000,
}


def slow_theory(hurst: Any, zeta_1: Any, gap: Any) -> Any:
    """Persson's theory, as one that takes 1 ms an answer."""
    count = np.size(hurst)
    if CALLS in os.environ:
        with open(os.environ[CALLS], "ab") as stream:
            stream.write(b"." * count)
    time.sleep(ANSWER * count)
    return persson(hurst, zeta_1, gap)


def made(entries: dict[str, Any], target: float, name: str, **options: Any) -> Any:
    """A table in a folder that is removed, and the seconds that it took."""
    wanted = wanted_of({"function": name, **entries}, target=target)
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        table = make(wanted, pathlib.Path(folder, "table.nc"), **options)
        assert isinstance(table, FunctionTable)
        return table, time.perf_counter() - start


def places(table: FunctionTable, count: int) -> Any:
    """Random points of a table, shape (points, axes)."""
    draws = np.random.default_rng(3)
    columns = [
        axis.from_grid(
            draws.uniform(axis.to_grid(axis.low), axis.to_grid(axis.high), count)
        )
        for axis in table.axes
    ]
    return np.stack(columns, axis=-1)


def use_of(name: str) -> list[page.Cell]:
    """A line on derivatives and inverses of one of the test functions."""
    function = getattr(functions, name)
    entries, target = functions.CASES[name]
    table, _ = made(
        {"chunk": 1024} | entries, target, f"benchmarks.functions:{name}", workers=2
    )
    x = places(table, POINTS)
    output = table.outputs[0].name
    found = table.lookup(*x.T, derivatives=1)
    largest = over = 0.0
    # the absolute value of a complex number has no such derivative
    for a, axis in enumerate(table.axes if name != "kinked" else ()):
        moved = x.astype(complex)
        moved[:, a] += 1j * STEP
        exact = function(*moved.T).imag / STEP
        error = np.abs(found.derivatives[output][axis.name] - exact)
        largest = max(largest, float(error.max() / np.abs(exact).max()))
        bound = found.derivative_error[output][axis.name]
        over = max(over, float((error / bound).max()))
    taken = {
        "value": functools.partial(table.lookup, *x.T),
        "slopes": functools.partial(table.lookup, *x.T, derivatives=1),
    }
    inverses: list[page.Cell] = [None, None]
    solved = next((a.name for a in table.axes if table.has_inverse(output, a.name)), None)
    if solved is not None:
        names = [axis.name for axis in table.axes]
        given = dict(zip(names, x.T, strict=True))
        wanted = given.pop(solved)
        given[output] = function(*x.T)
        # values of the function that the table, at an end of an axis, does not reach
        ends = [
            table.lookup(**(given_axes(given, names) | {solved: end}))[output]
            for a in table.axes
            if a.name == solved
            for end in (a.low, a.high)
        ]
        good = (given[output] >= np.minimum(*ends)) & (given[output] <= np.maximum(*ends))
        given = {key: values[good] for key, values in given.items()}
        inverse, bound = table.inverse(solved, **given)
        error = np.abs(inverse - wanted[good])
        width = np.ptp(wanted)
        inverses = [
            f"{float(error.max() / width):.1e}",
            f"{float((error / bound).max()):.2g}",
        ]
        taken["inverse"] = functools.partial(table.inverse, solved, **given)
    times = rounds(taken)
    return [
        name,
        str(len(table.axes)),
        None if name == "kinked" else f"{largest:.1e}",
        None if name == "kinked" else f"{over:.2g}",
        *inverses,
        *(page.duration(1e-6 * microseconds(t, len(x))) for t in times.values()),
        *([None] if solved is None else []),
    ]


def given_axes(given: dict[str, Any], names: list[str]) -> dict[str, Any]:
    """Those of given numbers that are of axes."""
    return {name: values for name, values in given.items() if name in names}


def theory_row(label: str, function: str, points: int) -> list[page.Cell]:
    """A line on the table of a theory."""
    wanted = wanted_of({"function": function, **RANGE}, target=TARGET)
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder, "theory.nc")
        start = time.perf_counter()
        table = make(wanted, path, workers=2)
        taken = time.perf_counter() - start
        assert isinstance(table, FunctionTable)
        largest, above = 0.0, 0
        for block in verified_errors(table, points):
            error, bound, size = block.swapaxes(0, 1)
            largest = max(largest, float((error / size).max()))
            above += int((error > bound).any(axis=0).sum())
        theory = Tabulated(str(path))
        x = places(table, POINTS)
        surface = Surface(x[:, 0], 1.0, x[:, 1], 1.0, 3.0)
        answers = rounds({"answer": functools.partial(theory.answer, surface, x[:, 2])})
    return [
        label,
        f"{TARGET:.0e}",
        f"{len(table.arrays['starts']):,}",
        page.duration(taken),
        f"{largest:.1e}",
        f"{points:,}",
        str(above),
        page.duration(1e-6 * microseconds(answers["answer"], len(x))),
    ]


def bits(table: FunctionTable) -> tuple[bytes, ...]:
    """All arrays of a table, and what it says of them."""
    arrays = (table.arrays[name].tobytes() for name in sorted(table.arrays))
    return *arrays, table.attributes["certificate"].encode()


def after_a_kill(folder: pathlib.Path, entries: dict[str, Any]) -> tuple[Any, float]:
    """The table of the slow theory whose process was killed and resumed, and the seconds of work done twice."""
    calls = folder / "calls"
    program = (
        "import json, pathlib, sys\n"
        "from mbma_tables.tables.make_function import make, wanted_of\n"
        "entries = json.loads(sys.argv[1])\n"
        f"make(wanted_of(entries, target={TARGET_OF_WAYS}), pathlib.Path(sys.argv[2]))\n"
    )
    line = [sys.executable, "-c", program, json.dumps(entries), str(folder / "killed.nc")]
    environment = os.environ | {CALLS: str(calls)}
    process = subprocess.Popen(line, env=environment, cwd=ROOT, stderr=subprocess.DEVNULL)
    while process.poll() is None and not calls.exists():
        time.sleep(0.05)
    time.sleep(KILLED_AFTER)
    assert process.poll() is None, "it was finished before"
    process.send_signal(signal.SIGKILL)
    process.wait()
    os.environ[CALLS] = str(calls)
    try:
        wanted = wanted_of(entries, target=TARGET_OF_WAYS)
        resumed = make(wanted, folder / "killed.nc", resume=True)
        both = calls.stat().st_size
        calls.unlink()
        make(wanted, folder / "whole.nc")
        whole = calls.stat().st_size
    finally:
        del os.environ[CALLS]
    return resumed, ANSWER * (both - whole)


def way_rows() -> list[list[page.Cell]]:
    """A line each on how the table of the slow theory was made."""
    entries = {"function": "benchmarks.table_uses:slow_theory", **RANGE}
    entries |= {"certificate_points": 500}
    wanted = wanted_of(entries, target=TARGET_OF_WAYS)
    rows: list[list[page.Cell]] = []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        once = make(wanted, folder / "once.nc", workers=2)
        assert isinstance(once, FunctionTable)
        for count in (2, 8):
            for part in range(count):
                place = folder / f"{count}-{part}.nc"
                make(wanted, place, part=(part + 1, count), workers=2)
            pieces = [folder / f"{count}-{part}.nc.pieces" for part in range(count)]
            found = merge(folder / f"{count}.nc", pieces)
            rows.append([f"in {count} parts", same(found, once), None])
        cluster = make(wanted, folder / "cluster.nc", local_cluster=2)
        rows.append(["on a cluster of 2", same(cluster, once), None])
        killed, lost = after_a_kill(folder, entries)
        label = f"after kill -9 at {KILLED_AFTER:.0f} s, resumed"
        rows.append([label, same(killed, once), page.duration(lost)])
    return rows


def same(found: FunctionTable | None, once: FunctionTable) -> str:
    """Whether two tables have the same bits, in a word."""
    return "yes" if found is not None and bits(found) == bits(once) else "no"


def theory_rows() -> list[list[page.Cell]]:
    """Lines on the tables of a quick and of a slow theory."""
    slow = "benchmarks.table_uses:slow_theory"
    return [
        theory_row("Persson", "mbma_tables.theories.totals:persson", POINTS),
        theory_row("of 1 ms an answer", slow, POINTS // 4),
    ]


BLOCKS: dict[str, Any] = {
    "uses": lambda: page.table(USES, map(use_of, functions.CASES)),
    "theories": lambda: page.table(THEORIES, theory_rows()),
    "ways": lambda: page.table(WAYS, way_rows()),
}


@click.command("table_uses")
@click.argument("blocks", nargs=-1, type=click.Choice([*BLOCKS]))
@click.option("--out", type=click.Path(path_type=pathlib.Path), default=ROOT)
def table_uses(blocks: tuple[str, ...], out: pathlib.Path) -> None:
    """Use tables of functions and theories, measure that, and write docs/tables.md (five minutes)."""
    for block in blocks or BLOCKS:
        text = BLOCKS[block]()
        click.echo(text)
        for path in page.write("docs/tables.md", {block: text}, {}, out):
            click.echo(path)
