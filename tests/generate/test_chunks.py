"""Islands solved in chunks: the same bits whoever computes them, and chunks that are kept."""

import concurrent.futures
import json
import os
import pathlib
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from small_tables import SMALL

from generate.provenance import versions
from generate.tables import chunks
from generate.tables.chunks import ChunkedSolver, WorkerError, phi
from mbma_tables.models.tables import shipped
from mbma_tables.tablefiles.netcdf import read_table

ROOT = pathlib.Path(chunks.__file__).parents[2]
COUNT = 4
X = np.linspace(0.0, 5.0, 40)
MU = np.geomspace(1e-3, 10.0, 40)
# of numpy and its BLAS, on any processor with AVX2, the code of the one that made the shipped tables
HASWELL = {
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
    "OPENBLAS_CORETYPE": "Haswell",
}


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch):
    monkeypatch.setattr(chunks, "CHUNK", 10)


def run(solver):
    return solver.phi("test", X, MU, 1e-6)


@pytest.fixture(scope="module")
def expected():
    return phi(X, MU, 1e-6)


def test_any_executor_gives_the_same_bits(expected):
    np.testing.assert_array_equal(run(ChunkedSolver()), expected)
    with concurrent.futures.ThreadPoolExecutor(3) as threads:
        np.testing.assert_array_equal(run(ChunkedSolver(threads)), expected)
    square = ChunkedSolver().phi("test", X.reshape(8, 5), MU.reshape(8, 5), 1e-6)
    np.testing.assert_array_equal(square, expected.reshape(8, 5, 2))


def test_finished_chunks_are_not_computed_again(expected, tmp_path, monkeypatch):
    run(ChunkedSolver(folder=tmp_path))
    assert len(list(tmp_path.iterdir())) == COUNT
    monkeypatch.delattr(chunks.greenwood_tripp, "solve")
    np.testing.assert_array_equal(run(ChunkedSolver(folder=tmp_path)), expected)


@pytest.mark.parametrize(
    ("name", "own"),
    [("versions", lambda: versions() | {"numpy": "1.0"}), ("source_digest", lambda modules: "0" * 64)],
)
def test_chunks_of_other_versions_or_another_source_are_not_mixed_in(name, own, expected, tmp_path, monkeypatch):
    run(ChunkedSolver(folder=tmp_path))
    monkeypatch.setattr(chunks, name, own)
    np.testing.assert_array_equal(run(ChunkedSolver(folder=tmp_path)), expected)
    assert len(list(tmp_path.iterdir())) == 2 * COUNT


def test_a_dead_worker_ends_the_run_with_the_others_kept(tmp_path):
    class Dying(concurrent.futures.Executor):
        def submit(self, work, /, *arguments):
            future = concurrent.futures.Future()
            if arguments[0][0] > 3:
                future.set_exception(concurrent.futures.BrokenExecutor("killed"))
            else:
                future.set_result(work(*arguments))
            return future

    with pytest.raises(WorkerError, match=r"a worker process died .*--resume continues"):
        run(ChunkedSolver(Dying(), tmp_path))


def command(config, out, *arguments):
    name = [sys.executable, "-m", "generate", "tables", "universal"]
    return [*name, "--config", str(config), "--out", str(out), *arguments]


@pytest.mark.slow
def test_a_killed_run_is_resumed_to_the_same_bytes(tmp_path):
    config, out, whole = (tmp_path / name for name in ("own.toml", "table.nc", "whole.nc"))
    # some twenty chunks
    config.write_text(SMALL["universal"].replace("1e-4", "1e-5").replace("400", "30000"))
    subprocess.run(command(config, whole, "--workers", "1"), cwd=ROOT, check=True, capture_output=True)
    folder = tmp_path / ".table.nc.chunks"
    with subprocess.Popen(
        command(config, out, "--workers", "2"),
        cwd=ROOT,
        start_new_session=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as process:
        while not (folder.exists() and len(list(folder.glob("[0-9a-f]*"))) >= 3):
            assert process.poll() is None
            time.sleep(0.001)
        os.killpg(process.pid, signal.SIGKILL)
    assert len(list(folder.glob("[0-9a-f]*"))) >= 3
    assert not out.exists()
    subprocess.run(command(config, out, "--workers", "2", "--resume"), cwd=ROOT, check=True, capture_output=True)
    assert out.read_bytes() == whole.read_bytes()
    assert not folder.exists()


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["universal", "island4d"])
def test_the_shipped_tables_rebuild_to_the_last_bit(kind, tmp_path):
    """With the code of their processor type and their versions, as docs/tables.md says."""
    said = json.loads(read_table(shipped(kind)).attributes["versions"])
    if said != versions():
        pytest.skip("other versions or another arithmetic than those of the shipped tables")
    out = tmp_path / f"{kind}.nc"
    name = [sys.executable, "-m", "generate", "tables", kind, "--out", str(out), "--workers", "2"]
    subprocess.run(name, cwd=ROOT, env=os.environ | HASWELL, check=True, capture_output=True)
    old, new = (read_table(path).attributes for path in (shipped(kind), out))
    differing = {key for key in old if old[key] != new[key]}
    # the record of the source follows every edit of it
    assert differing <= {"source_sha256", "source_modules", "attributes_sha256"}
