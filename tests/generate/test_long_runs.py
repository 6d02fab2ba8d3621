"""Long runs: killed, resumed, shared among processes and machines, they end in the same bytes."""

import contextlib
import json
import os
import pathlib
import pty
import re
import signal
import subprocess
import sys
import time

import pytest
from small_builds import SMALL

from mbma_tables.errors import TableFileError
from mbma_tables.tablefiles.netcdf import read_table

ROOT = pathlib.Path(__file__).parents[2]
PATIENCE = 120.0
# some twenty chunks
TEXT = SMALL["universal"].replace("1e-4", "1e-5").replace("= 1e-3", "= 1e-5").replace("= 400", "= 30000")
needs_proc = pytest.mark.skipif(not pathlib.Path("/proc/self/task").exists(), reason="children are found in /proc")


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    path = tmp_path_factory.mktemp("config") / "small.toml"
    path.write_text(TEXT)
    return path


@pytest.fixture(scope="module")
def uninterrupted(config, tmp_path_factory):
    """Bytes of an uninterrupted run on one worker, and what a terminal saw of it."""
    out = tmp_path_factory.mktemp("expected") / "table.nc"
    ours, theirs = pty.openpty()
    process = start(config, out, "--workers", "1", stderr=theirs)
    os.close(theirs)
    seen = b""
    # the end is an error on Linux, nothing elsewhere
    with contextlib.suppress(OSError):
        while part := os.read(ours, 4096):
            seen += part
    os.close(ours)
    done(process)
    assert [path.name for path in out.parent.iterdir()] == ["table.nc"]
    assert read_table(out).kind == "universal"
    return out.read_bytes(), seen.decode()


@pytest.fixture(scope="module")
def expected(uninterrupted):
    return uninterrupted[0]


def start(config, out, *arguments, before="", **extra):
    code = f"{before}import runpy; runpy.run_module('generate', run_name='__main__', alter_sys=True)"
    command = [sys.executable, "-W", "error", "-c", code] if before else [sys.executable, "-m", "generate"]
    return subprocess.Popen(
        [*command, "universal", "--config", str(config), "--out", str(out), *arguments],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=extra.pop("stderr", subprocess.PIPE),
        text=True,
        start_new_session=True,
        **extra,
    )


def done(process, code=0):
    try:
        out, err = process.communicate(timeout=PATIENCE)
    finally:
        kill_group(process)
    assert process.returncode == code, err
    return out, err


def kill_group(process):
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def until(condition, process):
    """Wait for a condition that holds at the latest when the process ends."""
    end = time.monotonic() + PATIENCE
    while not (found := condition()):
        assert process.poll() is None, process.stderr.read()
        assert time.monotonic() < end
        time.sleep(0.001)
    return found


def kept(out):
    """Finished chunks, by inode: a chunk written again has another."""
    folder = out.parent / f".{out.name}.checkpoints"
    if not folder.exists():
        return {}
    return {path.name: path.stat().st_ino for path in folder.iterdir() if not path.name.startswith(".")}


def assert_no_table(folder):
    for path in folder.rglob("*"):
        if path.is_file():
            with pytest.raises(TableFileError):
                read_table(path)


def children(pid):
    """Worker processes of a run."""
    found = []
    for task in pathlib.Path(f"/proc/{pid}/task").glob("*/children"):
        for child in task.read_text().split():
            command = pathlib.Path(f"/proc/{child}/cmdline").read_text()
            if "spawn_main" in command:
                found.append(int(child))
    return found


def alive(pid):
    try:
        return pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def test_a_run_killed_again_and_again_keeps_what_was_done_and_believes_no_damage(config, expected, tmp_path):
    out = tmp_path / "table.nc"
    before: dict[str, int] = {}
    for count in (1, 3, 6):
        process = start(config, out, "--workers", "2", "--processes", "--resume")
        until(lambda least=count: len(kept(out)) >= least, process)
        kill_group(process)
        process.communicate()
        assert not out.exists()
        assert_no_table(tmp_path)
        now = kept(out)
        assert before.items() <= now.items()
        before = now
    first, second, third, *_ = (tmp_path / f".{out.name}.checkpoints" / name for name in sorted(before))
    first.write_bytes(second.read_bytes())
    second.write_bytes(second.read_bytes()[:-100])
    third.write_bytes(b"garbage")
    _, err = done(start(config, out, "--workers", "2", "--processes", "--resume"))
    assert out.read_bytes() == expected
    assert [path.name for path in tmp_path.iterdir()] == ["table.nc"]
    # a pipe is no terminal
    assert "chunk" not in err


@needs_proc
def test_a_killed_worker_costs_its_chunks_and_no_more(config, expected, tmp_path):
    out = tmp_path / "table.nc"
    process = start(config, out, "--workers", "2", "--processes")
    until(lambda: kept(out), process)
    os.kill(until(lambda: children(process.pid), process)[0], signal.SIGKILL)
    done(process)
    assert out.read_bytes() == expected


@needs_proc
def test_workers_do_not_outlive_the_run_that_started_them(config, tmp_path):
    out = tmp_path / "table.nc"
    process = start(config, out, "--workers", "2", "--processes")
    until(lambda: kept(out), process)
    workers = until(lambda: children(process.pid), process)
    process.kill()
    process.wait()
    end = time.monotonic() + PATIENCE
    try:
        while any(alive(pid) for pid in workers):
            assert time.monotonic() < end
            time.sleep(0.01)
    finally:
        kill_group(process)
        process.communicate()


def test_two_builds_at_once_do_not_disturb_each_other(config, expected, tmp_path):
    out = tmp_path / "table.nc"
    first = start(config, out, "--workers", "1")
    second = start(config, out, "--workers", "1")
    done(first)
    assert out.read_bytes() == expected
    done(second)
    assert out.read_bytes() == expected
    assert [path.name for path in tmp_path.iterdir()] == ["table.nc"]


def test_a_disk_that_takes_no_more_is_one_message(config, expected, tmp_path):
    # `expected` has run before, so that no compiled code is left to be kept
    pytest.importorskip("resource")
    out = tmp_path / "table.nc"
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096)); "
    _, err = done(start(config, out, "--workers", "1", before=limit), code=2)
    assert err.startswith(f"generate: cannot keep finished chunks in {tmp_path}")
    assert len(err.splitlines()) == 1
    assert not out.exists()
    assert_no_table(tmp_path)


def test_a_folder_that_cannot_be_written_is_one_message(config, tmp_path):
    taken = tmp_path / "taken"
    taken.write_text("")
    _, err = done(start(config, taken / "table.nc", "--workers", "1"), code=2)
    assert len(err.splitlines()) == 1
    assert "taken" in err
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


def test_a_terminal_sees_rate_and_time_left(uninterrupted):
    assert re.search(r"certificate: +\d+%.*\d+/\d+ \[\d\d:\d\d<\d\d:\d\d, .*chunk", uninterrupted[1])


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory):
    """(address, worker processes) of a dask scheduler with two workers, on the loopback."""
    pytest.importorskip("distributed", reason="dask.distributed is not installed")
    folder = tmp_path_factory.mktemp("dask")
    told = folder / "scheduler.json"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": folder}
    environment = os.environ | {"PYTHONPATH": str(ROOT)}

    def dask(what, *arguments):
        command = [sys.executable, "-m", f"distributed.cli.dask_{what}", *arguments]
        return subprocess.Popen(command, env=environment, start_new_session=True, **quiet)

    common = ("--host", "127.0.0.1", "--no-dashboard")
    started = [dask("scheduler", "--port", "0", *common, "--scheduler-file", str(told))]
    try:
        end = time.monotonic() + PATIENCE
        while not (told.exists() and told.read_text().endswith("}")):
            assert started[0].poll() is None
            assert time.monotonic() < end
            time.sleep(0.01)
        address = json.loads(told.read_text())["address"]
        options = ("--no-nanny", "--nthreads", "1", "--local-directory", str(folder))
        workers = [dask("worker", address, *common, *options) for _ in range(2)]
        started += workers
        yield address, workers
    finally:
        for process in started:
            kill_group(process)


def test_a_dask_scheduler_gives_the_same_bytes_though_a_worker_dies(config, expected, scheduler, tmp_path):
    address, workers = scheduler
    out = tmp_path / "table.nc"
    process = start(config, out, "--scheduler", address)
    until(lambda: len(kept(out)) >= 3, process)
    workers[0].kill()
    done(process)
    assert out.read_bytes() == expected


def test_a_local_dask_cluster_gives_the_same_bytes(config, expected, tmp_path):
    pytest.importorskip("distributed", reason="dask.distributed is not installed")
    out = tmp_path / "table.nc"
    done(start(config, out, "--workers", "2"))
    assert out.read_bytes() == expected


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nowhere://x"])
def test_a_scheduler_that_does_not_answer_is_one_message(config, tmp_path, address, monkeypatch):
    pytest.importorskip("distributed", reason="dask.distributed is not installed")
    monkeypatch.setenv("DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT", "1s")
    _, err = done(start(config, tmp_path / "table.nc", "--scheduler", address), code=2)
    assert err.splitlines()[-1].startswith(f"generate: no dask scheduler at {address}")
    assert "Traceback" not in err
    assert list(tmp_path.iterdir()) == []
