"""Faults while files are written: a full disk, a read-only folder and SIGKILL, at each step of each writer.

A step is an event that the interpreter reports to its audit hooks (open, rename, remove, ...) or a size at which a file
grows no more. With MBMA_GAUNTLET above 1 every step is tried, else some are drawn.
"""

import ast
import concurrent.futures
import dataclasses
import errno
import json
import os
import pathlib
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile

import numpy as np
import pytest
from click.testing import CliRunner

from generate.tables import campaign
from mbma_tables import files as whole_files
from mbma_tables.cli import main
from mbma_tables.errors import InputError, MbmaError
from mbma_tables.export.code import write_code
from mbma_tables.files import ABANDONED, DRAFT, write_files
from mbma_tables.formulas import file as formula_file
from mbma_tables.models.universal import universal_model
from mbma_tables.scenes.costs import Calibration, write_calibration
from mbma_tables.tablefiles.netcdf import write_table
from mbma_tables.tablefiles.shipped import shipped_file

SCALE = int(os.environ.get("MBMA_GAUNTLET", "1"))
DRAWN = 6  # steps of a writer that are tried in the reduced set
EVENTS = {
    "open",
    "os.chmod",
    "os.listdir",
    "os.mkdir",
    "os.remove",
    "os.rename",
    "os.rmdir",
    "os.scandir",
    "shutil.copyfile",
    "tempfile.mkdtemp",
}
REMOVALS = {"os.remove", "os.rmdir", "os.scandir"}
SCENE = pathlib.Path(__file__).parents[1] / "examples" / "scene_joint.toml"


class CommandFailed(MbmaError):
    """A command that ended with exit code 2."""


def command(*arguments):
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    if result.exit_code == 2 and result.output.startswith("mbma: "):
        raise CommandFailed(result.output)
    assert result.exit_code == 0, result.output


def table(folder, version):
    content = universal_model().content
    attributes = content.attributes | {"history": str(version)}
    write_table(folder / "t.nc", dataclasses.replace(content, attributes=attributes))


def formulas(folder, version):
    forms = json.loads(shipped_file("formula.json").read_bytes())["forms"]
    formula_file.write(folder / "formula.json", forms, {"version": version})


def calibration(folder, version):
    write_calibration(Calibration(1e-3 * (1 + version), {"exact": 1.0}, "data"), folder / "cost.json")


def code(folder, version):
    write_code("c", folder, ("reported", "printed")[version])


def law(target):
    units = ["--E-star", "13.3", "--length-unit", "mm", "--stress-unit", "MPa"]

    def write(folder, version):
        command(
            *("export", target, "--surface", "concrete", *units, "--rows", 20 + version),
            *("--out", folder / ("law.mat" if target == "matlab" else "law")),
        )

    return write


def scene(folder, version):
    command("run", folder.parent / f"scene_{version}.toml", "--out", folder / "scene.csv")


def curve(folder, version):
    points = ["--surface", "concrete", "--points", str(5 + version)]
    command("curve", *points, "--plot", folder / "c.png", "--out", folder / "c.csv", "--csv")


def chunk(folder, version):
    campaign._store(folder / "chunks", "key", np.full(1000, float(version)))


def page(folder, version):
    write_files({folder / "page.md": b"page %d" % version, folder / "figures" / "f.png": b"%d" % version * 999}, True)


WRITERS = {
    "table": table,
    "formulas": formulas,
    "calibration": calibration,
    "code": code,
    "law-calculix": law("calculix"),
    "law-netcdf": law("netcdf"),
    "law-matlab": law("matlab"),
    "scene": scene,
    "curve": curve,
    "chunk": chunk,
    "page": page,
}


class Steps:
    """What an audit hook does at the numbered step of the writing that is watched."""

    def __init__(self):
        self.folder = None
        self.seen = []
        self.at = -1
        self.act = None
        sys.addaudithook(self)

    def __call__(self, event, arguments):
        if self.folder is None or event not in EVENTS:
            return
        if event != "tempfile.mkdtemp" and not str(arguments[0]).startswith(self.places):
            return
        self.step(event)

    def step(self, event):
        self.seen.append(event)
        if len(self.seen) - 1 == self.at:
            self.act()

    def watch(self, folder, write, version, at=-1, act=None):
        """Write, with `act` at step `at`; returns the events seen and the error that came of it."""
        self.seen, self.at, self.act = [], at, act
        self.places = (str(folder), tempfile.gettempdir() + "/tmp")
        self.folder = folder
        try:
            write(folder, version)
        except (MbmaError, campaign.CampaignError) as fault:
            return self.seen, fault
        finally:
            self.folder = None
        return self.seen, None


STEPS = Steps()


@pytest.fixture(autouse=True)
def sync_is_a_step(monkeypatch):
    own = os.fsync

    def fsync(descriptor):
        if STEPS.folder is not None:
            STEPS.step("fsync")
        own(descriptor)

    monkeypatch.setattr(whole_files.os, "fsync", fsync)


def found(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def drafts(folder):
    return {name for name in found(folder) if name.endswith(DRAFT)}


@pytest.fixture(scope="module", params=WRITERS)
def case(request, tmp_path_factory):
    """A writer, a folder with its old files, what these hold, and what new ones hold."""
    write, folder = WRITERS[request.param], tmp_path_factory.mktemp("fault") / "folder"
    text = SCENE.read_text(encoding="utf-8")
    contents = []
    for version in (1, 0):
        titled = text.replace('title = "', f'title = "{version} ', 1)
        (folder.parent / f"scene_{version}.toml").write_text(titled, encoding="utf-8")
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        write(folder, version)
        contents.append(found(folder))
    new, old = contents
    assert new.keys() == old.keys()
    assert any(new[name] != old[name] for name in new)
    return write, folder, old, new


def restore(folder, old):
    for path in sorted(folder.rglob("*"), reverse=True):
        if path.is_file() and str(path.relative_to(folder)) not in old:
            path.unlink()
    for name, content in old.items():
        (folder / name).write_bytes(content)


def steps_of(case, folder):
    write, _, old, _ = case
    events, fault = STEPS.watch(folder, write, 1)
    assert fault is None
    restore(folder, old)
    every = list(enumerate(events))
    return every if SCALE > 1 else random.Random(len(every)).sample(every, min(DRAWN, len(every)))


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EROFS], ids=["full", "read-only"])
def test_a_step_that_fails(case, code, record_property):
    write, folder, old, new = case

    def fail():
        raise OSError(code, os.strerror(code))

    chosen = steps_of(case, folder)
    failed = 0
    for at, event in chosen:
        events, fault = STEPS.watch(folder, write, 1, at, fail)
        assert events[at] == event
        left = drafts(folder)
        kept = {name: content for name, content in found(folder).items() if name not in left}
        failed += fault is not None
        assert kept == (new if fault is None else old), (at, event, fault)
        assert not left or event in REMOVALS
        if fault is not None:
            assert os.strerror(code) in str(fault)
            assert "\n" not in str(fault).strip()
        restore(folder, old)
    assert failed > 0
    record_property("faults injected", len(chosen))


def in_child(work):
    """Run in a forked process; the signal that ended it, 0 where it ended by itself."""
    child = os.fork()
    if child == 0:
        try:
            signal.alarm(60)
            work()
        finally:
            os._exit(0)
    status = os.waitpid(child, 0)[1]
    number = os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0
    assert number != signal.SIGALRM, "hung"
    return number


def whole_after_a_kill(case):
    """Each file is the old or the new one; a later write succeeds and takes old drafts away."""
    write, folder, old, new = case
    left = drafts(folder)
    for name, content in found(folder).items():
        assert name in left or content in (old.get(name), new[name])
    assert set(old) <= set(found(folder))
    for name in left:
        os.utime(folder / name, (0, 0))
    write(folder, 1)
    assert found(folder) == new
    restore(folder, old)


def test_killed_at_a_step(case, record_property):
    write, folder, _, _ = case
    chosen = steps_of(case, folder)
    for at, _ in chosen:
        kill = in_child(lambda at=at: STEPS.watch(folder, write, 1, at, lambda: os.kill(os.getpid(), signal.SIGKILL)))
        assert kill == signal.SIGKILL
        whole_after_a_kill(case)
    record_property("faults injected", len(chosen))


def limited(size, write, folder):
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))
    write(folder, 1)


@pytest.mark.parametrize("share", [0.0, 0.4, 0.999])
def test_a_file_that_grows_no_more(case, share, record_property):
    write, folder, old, new = case
    size = int(share * max(len(content) for content in new.values()))
    hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    try:
        with pytest.raises((MbmaError, campaign.CampaignError)):
            limited(size, write, folder)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (before[0], hard))
    assert found(folder) == old

    def killed():
        signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
        limited(size, write, folder)

    assert in_child(killed) == signal.SIGXFSZ
    whole_after_a_kill(case)
    record_property("faults injected", 2)


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 64 KiB of its own."""
    folder = tmp_path / "disk"
    folder.mkdir()
    made = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", folder], capture_output=True, check=False)
    if made.returncode != 0:
        pytest.skip("mounting is not permitted")
    yield folder
    subprocess.run(["umount", "-l", folder], check=True)


@pytest.mark.skipif(shutil.which("mount") is None, reason="mount is not installed")
@pytest.mark.parametrize("name", ["table", "code", "page"])
def test_a_real_disk_that_is_full_or_read_only(name, small_disk, record_property):
    write = WRITERS[name]
    (small_disk / "room").write_bytes(bytes(60000))
    before = found(small_disk)
    with pytest.raises(MbmaError, match="No space left on device"):
        write(small_disk, 0)
    assert found(small_disk) == before
    subprocess.run(["mount", "-o", "remount,ro", small_disk], check=True)
    with pytest.raises(MbmaError, match="Read-only file system"):
        write(small_disk, 0)
    assert found(small_disk) == before
    record_property("faults injected", 2)


def test_a_rename_that_fails_after_another_is_taken_back(tmp_path, monkeypatch):
    one, two = tmp_path / "one.txt", tmp_path / "two.txt"
    new = tmp_path / "new.txt"
    one.write_bytes(b"old")
    (two / "in the way").mkdir(parents=True)
    monkeypatch.setattr(pathlib.Path, "is_file", lambda path: True)
    with pytest.raises(InputError, match=r"two\.txt cannot be written"):
        write_files({one: b"new", new: b"new", two: b"new"})
    assert one.read_bytes() == b"old"
    assert {path.name for path in tmp_path.iterdir()} == {"one.txt", "two.txt"}


def test_threads_that_write_one_file(tmp_path):
    target = tmp_path / "a.txt"
    contents = [bytes([65 + number]) * 100_000 for number in range(8)]
    with concurrent.futures.ThreadPoolExecutor(8) as threads:
        list(threads.map(lambda content: write_files({target: content}), contents * 4))
    assert target.read_bytes() in contents
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_drafts_of_others_that_still_write_are_left(tmp_path):
    target = tmp_path / "a.txt"
    fresh, old, foreign = (tmp_path / name for name in (f".a.txt.1{DRAFT}", f".a.txt.2{DRAFT}", f".b.txt.3{DRAFT}"))
    for path in (fresh, old, foreign):
        path.write_bytes(b"draft")
    for path in (old, foreign):
        os.utime(path, (0, os.stat(path).st_mtime - 2 * ABANDONED))
    write_files({target: b"new"})
    assert {path.name for path in tmp_path.iterdir()} == {"a.txt", fresh.name, foreign.name}


def test_the_mode_of_a_file_stays(tmp_path):
    target = tmp_path / "a.txt"
    target.write_bytes(b"old")
    target.chmod(0o640)
    write_files({target: b"new"})
    assert target.stat().st_mode & 0o777 == 0o640


# what may write by itself: into a stream, or into a temporary folder
DIRECT = {
    ("mbma_tables/whole_files.py", "open"),
    ("mbma_tables/plots.py", "savefig"),
    ("generate/pages.py", "savefig"),
    ("mbma_tables/cli/scene.py", "to_netcdf"),
    ("mbma_tables/export/data.py", "to_netcdf"),
}
WRITING = {"write_text", "write_bytes", "savefig", "savetxt", "to_netcdf", "tofile", "mkstemp", "NamedTemporaryFile"}
MODES = {first + rest for first in "wxa" for rest in ("", "b", "t", "b+", "+")}


def writes(node):
    name = getattr(node.func, "attr", getattr(node.func, "id", ""))
    arguments = (*node.args, *(keyword.value for keyword in node.keywords))
    modes = {argument.value for argument in arguments if isinstance(argument, ast.Constant)}
    return name if name in WRITING or (name == "open" and modes & MODES) else None


def test_nothing_else_writes_files():
    root = pathlib.Path(__file__).parents[1]
    found = set()
    for path in (*root.glob("mbma_tables/**/*.py"), *root.glob("generate/**/*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and writes(node) is not None:
                found.add((str(path.relative_to(root)), writes(node)))
    assert found == DIRECT
