"""Tables that are replaced or cut while others read them, and folders that cannot keep what is compiled."""

import concurrent.futures
import dataclasses
import os
import pathlib
import shutil
import subprocess
import sys
import threading

import click
import pytest

import mbma_tables
from mbma_tables.errors import InputError, TableFileError
from mbma_tables.files import write_files
from mbma_tables.islands.height_integrals import height_integral
from mbma_tables.models.universal import shipped, universal_model
from mbma_tables.scenes.costs import Calibration, read_calibration, write_calibration
from mbma_tables.tablefiles.netcdf import check_table, write_table

SCALE = int(os.environ.get("MBMA_GAUNTLET", "1"))


def beside(work, change):
    """Run `work` while another thread calls `change` again and again."""
    ended = threading.Event()
    faults = []

    def others():
        try:
            while not ended.is_set():
                change()
        except BaseException as fault:
            faults.append(fault)
            raise

    thread = threading.Thread(target=others)
    thread.start()
    try:
        work()
    finally:
        ended.set()
        thread.join()
    assert not faults


def test_a_table_swapped_while_it_is_opened(tmp_path, record_property):
    contents = [shipped(kind).read_bytes() for kind in ("universal", "island4d")]
    path = tmp_path / "table.nc"
    path.write_bytes(contents[0])
    kinds = []

    def swap():
        contents.reverse()
        write_files({path: contents[0]})

    def read():
        kinds.extend(check_table(path)[0].kind for _ in range(20 * SCALE))

    beside(read, swap)
    assert set(kinds) == {"universal", "island4d"}
    record_property("faults injected", len(kinds))


def test_a_table_overwritten_in_place_is_refused_until_it_is_whole(tmp_path, record_property):
    content = shipped("universal").read_bytes()
    path = tmp_path / "table.nc"
    path.write_bytes(content)
    digest = check_table(path)[0].attributes["values_sha256"]
    outcomes = []

    def overwrite():
        with path.open("wb") as file:
            for start in range(0, len(content), 100_000):
                file.write(content[start : start + 100_000])
                file.flush()

    def read():
        while len(outcomes) < 40 * SCALE:
            try:
                outcomes.append(check_table(path)[0].attributes["values_sha256"] == digest)
            except TableFileError:
                outcomes.append(None)

    beside(read, overwrite)
    assert None in outcomes
    assert False not in outcomes
    record_property("faults injected", len(outcomes))


def test_an_opened_table_does_not_follow_its_file(tmp_path):
    path = tmp_path / "table.nc"
    shutil.copy(shipped("universal"), path)
    model = universal_model(path)
    before = model.answer([0.5, 3.0], 2.0)
    path.write_bytes(b"cut")
    after = model.answer([0.5, 3.0], 2.0)
    assert (after.phi_F == before.phi_F).all()
    path.unlink()
    assert (model.answer([0.5, 3.0], 2.0).phi_A == before.phi_A).all()
    with pytest.raises(TableFileError):
        check_table(path)


def test_a_replaced_table_is_opened_anew(tmp_path, monkeypatch):
    path = tmp_path / "table.nc"
    shutil.copy(shipped("universal"), path)
    first = universal_model(path)
    assert universal_model(path) is first
    content = first.content
    write_table(path, dataclasses.replace(content, attributes=content.attributes | {"history": "another"}))
    assert universal_model(path).content.attributes["history"] == "another"
    # one relative name, two folders
    (tmp_path / "other").mkdir()
    shutil.copy(shipped("universal"), tmp_path / "other" / "table.nc")
    found = []
    for folder in (tmp_path, tmp_path / "other"):
        monkeypatch.chdir(folder)
        found.append(universal_model("table.nc").content.attributes["history"])
    assert found[0] == "another" != found[1]


def test_threads_that_open_one_table_at_once(tmp_path):
    path = tmp_path / "table.nc"
    shutil.copy(shipped("universal"), path)
    gate = threading.Barrier(16)

    def opened(_):
        gate.wait()
        return universal_model(path), float(check_table(path)[0].log_ratio.sum())

    with concurrent.futures.ThreadPoolExecutor(16) as threads:
        found = list(threads.map(opened, range(16)))
    assert len({id(model) for model, _ in found}) == 1
    assert {total for _, total in found} == {float(universal_model().content.log_ratio.sum())}


SMALL = "from mbma_tables.islands.height_integrals import height_integral as h; print(repr(float(h(1.5, 0.3))))"
TOTAL = (
    "from mbma_tables import Surface, contact;"
    "print(repr(float(contact(Surface(0.8, 1.0, 200.0, 1.0, 3.0), 1.0).force)))"
)


def run(root, text, **variables):
    environment = os.environ | {"PYTHONPATH": str(root)} | variables
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", f"import mbma_tables; print(mbma_tables.__file__);{text}"],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
        cwd=root,
    )


def test_nowhere_to_keep_what_is_compiled(tmp_path, record_property):
    root = pathlib.Path(mbma_tables.__file__).parents[1]
    for name in ("mbma_tables", "tables"):
        shutil.copytree(root / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    # files where folders are needed: nobody can write there, not even root
    for folder in [p for p in (tmp_path / "mbma_tables").rglob("*") if p.is_dir()] + [tmp_path / "mbma_tables"]:
        (folder / "__pycache__").write_bytes(b"")
    nowhere = tmp_path / "file"
    nowhere.write_bytes(b"")
    places = {name: str(nowhere / "x") for name in ("HOME", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR")}
    made = run(tmp_path, TOTAL if SCALE > 1 else SMALL, **places)
    assert (made.returncode, made.stderr) == (0, "")
    place, value = made.stdout.splitlines()
    assert place.startswith(str(tmp_path))
    if SCALE == 1:
        assert float(value) == float(height_integral(1.5, 0.3))
    else:
        surface = mbma_tables.Surface(0.8, 1.0, 200.0, 1.0, 3.0)
        assert float(value) == float(mbma_tables.contact(surface, 1.0).force)
    record_property("faults injected", 1)


def test_a_cache_folder_of_the_user_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_bytes(b"")
    made = run(pathlib.Path(mbma_tables.__file__).parents[1], SMALL, NUMBA_CACHE_DIR=str(tmp_path / "file" / "x"))
    assert (made.returncode, made.stderr) == (0, "")


def test_a_calibration_that_cannot_be_kept(tmp_path, monkeypatch):
    (tmp_path / "file").write_bytes(b"")
    monkeypatch.setattr(click, "get_app_dir", lambda name: str(tmp_path / "file" / name))
    assert read_calibration() is None
    with pytest.raises(InputError, match=r"cost\.json cannot be written: Not a directory"):
        write_calibration(Calibration(1e-3, {"exact": 1.0}, "data"))
