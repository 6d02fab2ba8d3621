"""Table files that are replaced or overwritten while others read them."""

import concurrent.futures
import dataclasses
import os
import shutil
import signal
import threading

import pytest

from mbma_tables.errors import TableFileError
from mbma_tables.files import write_file
from mbma_tables.models import tables
from mbma_tables.models.tables import open_table, shipped
from mbma_tables.tablefiles.netcdf import read_table, write_table


@pytest.fixture
def path(tmp_path):
    return shutil.copy(shipped("universal"), tmp_path / "table.nc")


def beside(work, change):
    """Run `work` while another thread calls `change` again and again."""
    ended = threading.Event()

    def others():
        while not ended.is_set():
            change()

    with concurrent.futures.ThreadPoolExecutor(1) as threads:
        changing = threads.submit(others)
        try:
            work()
        finally:
            ended.set()
        changing.result()


def test_a_table_replaced_while_it_is_opened(path):
    contents = [shipped(kind).read_bytes() for kind in ("universal", "island4d")]
    kinds = []

    def swap():
        contents.reverse()
        write_file(path, contents[0])

    beside(lambda: kinds.extend(read_table(path).kind for _ in range(20)), swap)
    assert set(kinds) == {"universal", "island4d"}


def test_a_table_overwritten_in_place_is_refused_until_it_is_whole(path):
    content, digest = path.read_bytes(), read_table(path).attributes["values_sha256"]
    outcomes = []

    def overwrite():
        with path.open("wb") as file:
            for start in range(0, len(content), 100_000):
                file.write(content[start : start + 100_000])
                file.flush()

    def read():
        for _ in range(40):
            try:
                outcomes.append(read_table(path).attributes["values_sha256"] == digest)
            except TableFileError:
                outcomes.append(None)

    beside(read, overwrite)
    assert None in outcomes
    assert False not in outcomes


def test_an_opened_table_does_not_follow_its_file(path):
    model = open_table(path)
    before = model.answer([0.5, 3.0], 2.0)
    path.write_bytes(b"cut")
    assert (model.answer([0.5, 3.0], 2.0).phi_F == before.phi_F).all()
    with pytest.raises(TableFileError):
        read_table(path)


def test_a_replaced_table_is_opened_again(path):
    content = open_table(path).content
    write_table(path, dataclasses.replace(content, attributes=content.attributes | {"history": "another"}))
    assert open_table(path).content.attributes["history"] == "another"


def test_threads_that_open_one_table_at_once():
    gate = threading.Barrier(16)

    def opened(_):
        gate.wait()
        return open_table("universal")

    tables._opened.cache_clear()
    with concurrent.futures.ThreadPoolExecutor(16) as threads:
        found = list(threads.map(opened, range(16)))
    assert len({id(model) for model in found}) == 1


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
@pytest.mark.filterwarnings("ignore:.*multi-threaded:DeprecationWarning")
def test_a_process_forked_while_a_thread_reads_can_read_too(path):
    def forked():
        for _ in range(8):
            child = os.fork()
            if child == 0:
                # ended by the signal where a lock of the other thread never opens
                signal.alarm(20)
                os._exit(0 if read_table(path).kind == "universal" else 1)
            assert os.waitpid(child, 0)[1] == 0

    beside(forked, lambda: read_table(path))
