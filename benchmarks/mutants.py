"""Mutation testing of islands, height integrals and totals: what the tests notice of altered lines.

Run with ``python benchmarks/mutants.py --out mutants.csv --sample 40 --seed 1 --jobs 2``; started again with the same
arguments it goes on where it stopped. Mutants are cosmic-ray's, made and run in copies of the tree. Compiled code is
kept between processes and would not notice that something it calls was altered: the altered module and all that import
it run uncompiled, the rest compiled. Of the tests, those count that pass that way on the unaltered module, each within
`SLOWEST` seconds; ``--compiled`` tries the survivors with all tests and everything compiled.
"""

from __future__ import annotations

import ast
import collections
import concurrent.futures
import contextlib
import csv
import dataclasses
import functools
import hashlib
import importlib
import json
import math
import multiprocessing
import os
import pathlib
import random
import re
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from typing import Any

import click

ROOT = pathlib.Path(__file__).resolve().parents[1]
SLOWEST = 0.6  # seconds of one test
PATIENCE = 15.0  # seconds of one test: longer is a mutant killed
COMPILING = 300.0  # seconds, instead, where the code is compiled for each mutant
PRELOADED = ["numba", "xarray", "dask.array", "scipy.integrate", "scipy.optimize", "hypothesis", "mpmath", "pytest"]
KEPT_OUT = shutil.ignore_patterns(".git", ".venv", ".hypothesis", ".*_cache", "build", "dist")
# bits and remainders of floats are type errors or wild; decorators say how to compile; `is` of floats is never meant
OPERATORS = re.compile(
    r"core/(AddNot|ExceptionReplacer|NumberReplacer|Replace(AndWithOr|OrWithAnd|TrueWithFalse|FalseWithTrue)"
    r"|Replace(BreakWithContinue|ContinueWithBreak)|ZeroIterationForLoop|ReplaceUnaryOperator_Delete_(Not|USub)"
    r"|ReplaceBinaryOperator_(Add|Sub|Mul|Div|FloorDiv|Mod|Pow|RShift)_(Add|Sub|Mul|Div|FloorDiv|Pow)"
    r"|ReplaceComparisonOperator_(Eq|NotEq|Lt|LtE|Gt|GtE)_(Eq|NotEq|Lt|LtE|Gt|GtE)"
    r"|ReplaceComparisonOperator_(Is_IsNot|IsNot_Is))"
)
MESSAGES = ("require", "InputError", "OutOfRangeError", "ConvergenceError")

LOOKUP = ("totals/test_lookup.py", "totals/test_sensitivity.py", "totals/test_tiers.py")
CONTACT = ("totals/test_contact.py", "totals/test_sensitivity.py", "totals/test_tiers.py")
# tests that this program asked for
TOTALS_LINES, ISLAND_LINES = "totals/test_held_lines.py", "islands/test_held_lines_of_islands.py"
SUITES = {
    "islands/height_integrals.py": ("islands/test_height_integrals.py", ISLAND_LINES),
    "islands/island.py": ("islands/test_island.py", "totals/test_contact.py", "totals/test_labelled.py", ISLAND_LINES),
    "totals/conductance.py": (TOTALS_LINES,),
    "totals/contact.py": (*CONTACT, "totals/test_labelled.py", TOTALS_LINES),
    "totals/intervals.py": (*LOOKUP, TOTALS_LINES),
    "totals/island_sum.py": ("totals/test_contact.py", "totals/test_tiers.py", TOTALS_LINES),
    "totals/labelled.py": ("totals/test_labelled.py", TOTALS_LINES),
    "totals/law.py": ("totals/test_law.py", TOTALS_LINES),
    "totals/law_kernel.py": ("totals/test_law.py", TOTALS_LINES),
    "totals/looked_up.py": (*LOOKUP, "models/test_model_limits.py", TOTALS_LINES),
    "totals/lookup.py": (*LOOKUP, TOTALS_LINES),
    "totals/pairs.py": ("totals/test_contact.py", "totals/test_lookup.py", "totals/test_sensitivity.py", TOTALS_LINES),
    "totals/quadrature.py": ("totals/test_quadrature.py", "totals/test_contact.py", TOTALS_LINES),
    "totals/sensitivity.py": ("totals/test_sensitivity.py", TOTALS_LINES),
    "totals/theories.py": ("totals/test_theories.py", TOTALS_LINES),
}


@dataclasses.dataclass(frozen=True)
class Mutant:
    """One altered place; `source` marks the module's text, so that records of an older one do not count."""

    module: str
    source: str
    operator: str
    occurrence: int
    line: int


FIELDS = (
    *(field.name for field in dataclasses.fields(Mutant)),
    *("before", "after", "outcome", "killer", "seconds"),
)


def _spared(text: str) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    """Stretches of a module that are not altered: annotations, decorators, imports, messages of errors."""
    for node in ast.walk(ast.parse(text)):
        parts: list[Any] = []
        if isinstance(node, ast.FunctionDef):
            parts = [*node.decorator_list, node.returns]
        elif isinstance(node, ast.ClassDef):
            parts = list(node.decorator_list)
        elif isinstance(node, ast.arg | ast.AnnAssign):
            parts = [node.annotation]
        elif isinstance(node, ast.Import | ast.ImportFrom | ast.JoinedStr):
            parts = [node]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in MESSAGES:
            parts = node.args[3:] if node.func.id == "require" else node.args[:1]
        for part in parts:
            if part is not None:
                yield (part.lineno, part.col_offset), (part.end_lineno, part.end_col_offset)


def mutants_of(module: str) -> list[Mutant]:
    """All mutants of a module."""
    from cosmic_ray import plugins
    from cosmic_ray.ast import ast_nodes, get_ast

    text = (ROOT / "mbma_tables" / module).read_text(encoding="utf-8")
    tree, spared = get_ast(text), list(_spared(text))
    source = hashlib.sha256(text.encode()).hexdigest()[:8]
    found = []
    for name in sorted(plugins.operator_names()):
        if not OPERATORS.fullmatch(name):
            continue
        operator = plugins.get_operator(name)()
        places = [place for node in ast_nodes(tree) for place in operator.mutation_positions(node)]
        for occurrence, (start, end) in enumerate(places):
            if not any(low <= start and end <= high for low, high in spared):
                found.append(Mutant(module, source, name.removeprefix("core/"), occurrence, start[0]))
    return found


def altered_text(text: str, operator: str, occurrence: int) -> str:
    """The module with one place altered."""
    from cosmic_ray import mutating, plugins

    altered: str = mutating.mutate_code(text, plugins.get_operator(operator)(), occurrence)
    return altered


@functools.cache
def importers(module: str) -> set[str]:
    """Names of this module and of all modules of the library that import it, of whatever depth."""
    names: dict[str, set[str]] = {}
    for path in (ROOT / "mbma_tables").rglob("*.py"):
        parts = path.relative_to(ROOT).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        wanted = names.setdefault(name, set())
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module:
                wanted |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    found = {"mbma_tables." + module.removesuffix(".py").replace("/", ".")}
    # the package itself loads names when they are used
    names.pop("mbma_tables")
    while more := {name for name, wanted in names.items() if wanted & found} - found:
        found |= more
    return found


def copy_tree(place: pathlib.Path) -> None:
    """The tree at another place, its compiled code with it; there modules can be left uncompiled."""
    shutil.copytree(ROOT, place, ignore=KEPT_OUT)
    path = place / "mbma_tables" / "compiled.py"
    text = path.read_text(encoding="utf-8")
    head = "    def wrap(function: Function) -> Function:\n"
    test = "        if function.__module__ in __import__('os').environ['UNCOMPILED'].split():\n"
    test += "            return function\n"
    if text.count(head) != 1:
        raise click.ClickException("mbma_tables/compiled.py is not what this program knows")
    path.write_text(text.replace(head, head + test), encoding="utf-8")


class Recorder:
    """A plugin of pytest: runs the wanted tests in the wanted order, and notes how each ended and when.

    A test that takes too long fails; that of a mutant ends the process.
    """

    def __init__(self, wanted: list[str] | None, limit: float) -> None:
        self.wanted = wanted
        self.limit = limit
        signal.signal(signal.SIGALRM, self.stop)
        self.seconds: dict[str, float] = {}
        self.failed: list[str] = []

    def pytest_collection_modifyitems(self, items: list[Any]) -> None:
        """Drop what is not wanted."""
        if self.wanted is not None:
            own = {item.nodeid: item for item in items}
            items[:] = [own[name] for name in self.wanted if name in own]

    def pytest_runtest_setup(self) -> None:
        """Start the clock."""
        signal.setitimer(signal.ITIMER_REAL, self.limit)

    def stop(self, *_: object) -> None:
        """Time is over."""
        if self.wanted is not None:
            os.killpg(0, signal.SIGKILL)
        raise TimeoutError

    def pytest_runtest_logreport(self, report: Any) -> None:
        """Note one phase of a test."""
        signal.setitimer(signal.ITIMER_REAL, self.limit if report.when == "setup" else 0.0)
        self.seconds[report.nodeid] = self.seconds.get(report.nodeid, 0.0) + report.duration
        if report.failed:
            self.failed.append(report.nodeid)


def run_tests(tree: str, module: str, wanted: list[str] | None, uncompiled: str, limit: float, answer: str) -> None:
    """In a process of its own: the tests of a module in a tree; writes what came of it to the file `answer`."""
    os.setsid()
    sys.dont_write_bytecode = True
    os.environ |= {"UNCOMPILED": uncompiled, "PYTHONPATH": tree, "PYTHONDONTWRITEBYTECODE": "1"}
    sys.path.insert(0, tree)
    os.chdir(tree)
    log = os.open(answer + ".log", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(log, 1)
    os.dup2(log, 2)
    import hypothesis
    import pytest

    # a slow machine must not count as a mutant killed
    checks = list(hypothesis.HealthCheck)
    hypothesis.settings.register_profile(
        "mutants", deadline=None, derandomize=True, database=None, suppress_health_check=checks
    )
    hypothesis.settings.load_profile("mutants")
    recorder = Recorder(wanted, limit)
    files = [f"tests/{name}" for name in SUITES[module] if pathlib.Path("tests", name).exists()]
    # hypothesis is there before pytest
    options = ["-p", "no:cacheprovider", "-W", "ignore::pytest.PytestAssertRewriteWarning"]
    if wanted is not None:
        options.append("-x")
    code = int(pytest.main(options + files, plugins=[recorder]))
    text = json.dumps({"code": code, "failed": recorder.failed, "seconds": recorder.seconds})
    pathlib.Path(answer).write_text(text, encoding="utf-8")


class Sweep:
    """The runs of one job: its own tree, and the processes started there."""

    context = multiprocessing.get_context("forkserver")

    def __init__(self, place: pathlib.Path, compiled: bool) -> None:
        self.tree = place / "tree"
        self.compiled = compiled
        self.answer = place / "answer.json"
        place.mkdir()
        copy_tree(self.tree)

    def run(self, module: str, wanted: list[str] | None, limit: float | None = None) -> dict[str, Any]:
        """What `run_tests` found; nothing failed and no code where it took longer than `limit` or died."""
        self.answer.unlink(missing_ok=True)
        uncompiled = "" if self.compiled else " ".join(importers(module))
        patience = COMPILING if self.compiled else PATIENCE
        arguments = (str(self.tree), module, wanted, uncompiled, patience, str(self.answer))
        process = self.context.Process(target=run_tests, args=arguments)
        process.start()
        process.join(limit)
        # with what tests started
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid or 0, signal.SIGKILL)
        process.join()
        if not self.answer.exists():
            return {"code": None, "failed": [], "seconds": {}}
        answer: dict[str, Any] = json.loads(self.answer.read_text(encoding="utf-8"))
        return answer

    def forget(self, module: str) -> None:
        """Remove the compiled code that an alteration of this module reaches."""
        if self.compiled:
            for name in importers(module):
                path = self.tree / name.replace(".", "/")
                for kept in (path.parent / "__pycache__").glob(f"{path.name}.*.nb[ic]"):
                    kept.unlink()

    def try_one(self, mutant: Mutant, wanted: list[str], limit: float) -> dict[str, str]:
        """The lines, the outcome, the test that noticed, seconds."""
        path = self.tree / "mbma_tables" / mutant.module
        text, times = path.read_text(encoding="utf-8"), path.stat()
        altered = altered_text(text, f"core/{mutant.operator}", mutant.occurrence)
        before, after = (own.splitlines()[mutant.line - 1].strip() for own in (text, altered))
        path.write_text(altered, encoding="utf-8")
        self.forget(mutant.module)
        start = time.perf_counter()
        found = self.run(mutant.module, wanted, limit)
        seconds = time.perf_counter() - start
        self.forget(mutant.module)
        path.write_text(text, encoding="utf-8")
        # what is kept of a module goes by its time
        os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
        if found["code"] == 0:
            outcome, killer = "survived", ""
        else:
            # a module that cannot be imported fails before any test
            outcome, killer = "killed", next(iter(found["failed"]), "import" if found["code"] else "time or death")
        return {"before": before, "after": after, "outcome": outcome, "killer": killer, "seconds": f"{seconds:.1f}"}


class Tests:
    """The tests of a module that pass uncompiled, those that killed most first."""

    def __init__(self, sweep: Sweep, module: str) -> None:
        found = sweep.run(module, None)
        limit = math.inf if sweep.compiled else SLOWEST
        self.seconds = {
            name: own for name, own in found["seconds"].items() if own < limit and name not in found["failed"]
        }
        if not self.seconds:
            raise click.ClickException(f"no test of {module} passes")
        self.kills: collections.Counter[str] = collections.Counter()
        whole = sum(self.seconds.values())
        self.limit = 10 * PATIENCE + 3 * whole + (COMPILING if sweep.compiled else 0.0)
        click.echo(f"{module}: {len(self.seconds)} of {len(found['seconds'])} tests, {whole:.1f} s")

    def ordered(self) -> list[str]:
        """Names in the order to run them."""
        return sorted(self.seconds, key=lambda name: (-self.kills[name], self.seconds[name]))


def _read(out: pathlib.Path) -> dict[Mutant, dict[str, str]]:
    if not out.exists():
        return {}
    with out.open(newline="", encoding="utf-8") as handle:
        rows = list(csv.DictReader(handle))
    # the last record of a mutant counts
    return {
        Mutant(row["module"], row["source"], row["operator"], int(row["occurrence"]), int(row["line"])): row
        for row in rows
    }


def report(records: dict[Mutant, dict[str, str]], possible: dict[str, int]) -> None:
    """Killed and tried by module, and the survivors, as tables of a page."""
    click.echo("\n| module | possible | tried | killed | share |\n| --- |" + " ---: |" * 4)
    total = [0, 0]
    rows = []
    for module, count in possible.items():
        own = [row["outcome"] for mutant, row in records.items() if mutant.module == module]
        killed = own.count("killed")
        total = [total[0] + len(own), total[1] + killed]
        rows.append((module, count, len(own), killed))
    for module, count, tried, killed in (*rows, ("all", sum(possible.values()), *total)):
        click.echo(f"| {module} | {count} | {tried} | {killed} | {killed / max(tried, 1):.0%} |")
    click.echo("\n| where | line | altered |\n| --- | --- | --- |")
    for mutant, row in sorted(records.items(), key=lambda pair: (pair[0].module, pair[0].line)):
        if row["outcome"] == "survived":
            lines = " | ".join("`" + row[name].replace("|", "\\|") + "`" for name in ("before", "after"))
            click.echo(f"| {mutant.module}:{mutant.line} | {lines} |")


@click.command()
@click.option("--out", type=click.Path(path_type=pathlib.Path), required=True, help="CSV of what was tried.")
@click.option("--sample", default=40, help="Mutants of each module, all where it has fewer.")
@click.option("--seed", default=1, help="Of the sample.")
@click.option("--jobs", default=2, help="Processes.")
@click.option("--only", default="", help="A part of the names of the modules wanted.")
@click.option("--again", is_flag=True, help="Try survivors once more, with the tests as they are now.")
@click.option("--compiled", is_flag=True, help="Likewise, compiled: about a minute each, and no test is left out.")
def main(out: pathlib.Path, sample: int, seed: int, jobs: int, only: str, again: bool, compiled: bool) -> None:
    """Try mutants, and tell which survived."""
    importlib.import_module("cosmic_ray.plugins")
    Sweep.context.set_forkserver_preload(PRELOADED)
    everything = {module: mutants_of(module) for module in SUITES if only in module}
    # ordered by chance, not cut by it: a larger sample holds the smaller one
    chosen = {module: random.Random(seed).sample(own, len(own))[:sample] for module, own in everything.items()}
    known = _read(out)
    left = [
        mutant
        for own in chosen.values()
        for mutant in own
        if mutant not in known or ((again or compiled) and known[mutant]["outcome"] == "survived")
    ]
    left.sort(key=lambda mutant: mutant not in known)
    possible = {module: len(own) for module, own in everything.items()}
    click.echo(f"{sum(possible.values())} mutants possible, {len(left)} to try")
    lock = threading.Lock()
    suites: dict[str, Tests] = {}
    with tempfile.TemporaryDirectory() as folder, out.open("a", newline="", encoding="utf-8") as handle:
        writer = csv.DictWriter(handle, FIELDS)
        if handle.tell() == 0:
            writer.writeheader()
        sweeps = [Sweep(pathlib.Path(folder, str(job)), compiled) for job in range(jobs)]
        queue = collections.deque(left)

        def work(sweep: Sweep) -> None:
            while True:
                with lock:
                    if not queue:
                        return
                    mutant = queue.popleft()
                    if mutant.module not in suites:
                        suites[mutant.module] = Tests(sweep, mutant.module)
                    tests = suites[mutant.module]
                row = sweep.try_one(mutant, tests.ordered(), tests.limit)
                with lock:
                    tests.kills[row["killer"]] += 1
                    writer.writerow(dataclasses.asdict(mutant) | row)
                    handle.flush()

        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            for finished in [pool.submit(work, sweep) for sweep in sweeps]:
                finished.result()
    records = _read(out)
    report({mutant: records[mutant] for own in chosen.values() for mutant in own}, possible)


if __name__ == "__main__":
    main()
