"""Files are written whole or not at all, whatever fails; what is read is a regular file of a believable size."""

import concurrent.futures
import errno
import os
import resource
import signal

import pytest
from helpers import refused

from mbma_tables import InputError, Surface
from mbma_tables.common import files
from mbma_tables.common.files import read_file, write_file


@pytest.fixture
def old(tmp_path):
    path = tmp_path / "a.txt"
    path.write_bytes(b"old")
    path.chmod(0o640)
    return path


def unchanged(path):
    return [p.name for p in path.parent.iterdir()] == [
        path.name
    ] and path.read_bytes() == b"old"


def test_a_file_is_replaced_and_keeps_its_mode(old):
    write_file(old, b"new")
    assert old.read_bytes() == b"new"
    assert old.stat().st_mode & 0o777 == 0o640
    write_file(old.parent / "b" / "c.txt", b"deep", make_folders=True)
    assert (old.parent / "b" / "c.txt").read_bytes() == b"deep"


@pytest.mark.parametrize(
    ("owner", "step"), [("os", "fsync"), ("shutil", "copymode"), ("os", "replace")]
)
@pytest.mark.parametrize(
    ("fault", "seen"),
    [
        (OSError(errno.EIO, "Input/output error"), InputError),
        (KeyboardInterrupt(""), KeyboardInterrupt),
    ],
)
def test_a_step_that_fails_leaves_the_old_file(
    old, owner, step, fault, seen, monkeypatch
):
    def fail(*_):
        raise fault

    monkeypatch.setattr(getattr(files, owner), step, fail)
    with pytest.raises(seen, match=r"a\.txt cannot be written: Input/output|^$"):
        write_file(old, b"new")
    assert unchanged(old)


@pytest.mark.filterwarnings("ignore:.*multi-threaded:DeprecationWarning")
# other tests may have imported jax, which warns of every fork
@pytest.mark.filterwarnings("ignore:os.fork:RuntimeWarning")
def test_a_process_killed_before_the_rename_leaves_the_old_file(old):
    child = os.fork()
    if child == 0:
        files.os.replace = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
        write_file(old, b"new")
        os._exit(0)
    assert os.WTERMSIG(os.waitpid(child, 0)[1]) == signal.SIGKILL
    assert old.read_bytes() == b"old"
    write_file(old, b"new")
    assert old.read_bytes() == b"new"


def test_a_full_disk_leaves_the_old_file(old):
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        with pytest.raises(InputError, match="File too large"):
            write_file(old, bytes(2000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert unchanged(old)


def test_threads_that_write_one_file(tmp_path):
    target = tmp_path / "a.txt"
    contents = [bytes([65 + number]) * 100_000 for number in range(8)]
    with concurrent.futures.ThreadPoolExecutor(8) as threads:
        list(threads.map(lambda content: write_file(target, content), contents * 4))
    assert target.read_bytes() in contents
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_links_are_followed(old):
    link = old.parent / "link"
    link.symlink_to(old)
    write_file(link, b"new")
    assert link.is_symlink()
    assert old.read_bytes() == read_file(link, 3) == b"new"


@pytest.mark.parametrize(
    "what", ["pipe", "/dev/zero", ".", "file/a.txt", "missing/a.txt"]
)
def test_only_regular_files_are_written_and_read(what, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(InputError, match="cannot be written"):
        write_file(tmp_path / what, b"new")
    with pytest.raises(InputError, match="cannot be read"):
        read_file(tmp_path / what, 100)


def test_a_size_is_not_believed(tmp_path):
    path = tmp_path / "sparse"
    with path.open("wb") as file:
        file.truncate(2**40)
    with pytest.raises(InputError, match="has more than 1000 bytes"):
        read_file(path, 1000)
    path.write_bytes(bytes(1000))
    assert read_file(path, 1000) == bytes(1000)


@pytest.mark.parametrize(
    "text", ["root:hunter2:0\n", "1.0 2.0\n3.0 hunter2\n", "1.0 hunter2 3.0\n"]
)
def test_errors_quote_no_contents(tmp_path, text):
    (tmp_path / "private.csv").write_text(text.replace(" ", ","))
    told = refused("fit", tmp_path / "private.csv")
    assert "hunter2" not in told
    assert "row" in told


def test_drafts_of_killed_runs_are_removed(tmp_path):
    old, young, other = (
        tmp_path / name
        for name in (".a.nc.0123.draft", ".a.nc.4567.draft", ".b.nc.0123.draft")
    )
    for draft in (old, young, other):
        draft.write_bytes(b"half")
    for draft in (old, other):
        os.utime(draft, (1e9, 1e9))
    write_file(tmp_path / "a.nc", b"whole")
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        young.name,
        other.name,
        "a.nc",
    ]


def test_names_that_no_file_has():
    with pytest.raises(InputError, match="there is no file"):
        Surface.from_map("1" * 300, 1.0)
