"""Commands that take a table's file refuse a bad one by name, and write nothing; nor do they leave parts on a full disk."""

import os
import pathlib
import subprocess
import sys

import netCDF4
import pytest
import tabulated
from helpers import refused
from small_tables import SMALL, small_table

from mbma_tables import Joint, Scene, Surface, TableFileError, open_table
from mbma_tables.tables.writer import write_table
from mbma_tables.theories import Mbma

SURFACE = Surface(0.8, 1.0, 30.0, 1.0, 3.0)
NUMBERS = ["--hurst", "0.8", "--q0", "1", "--q1", "30", "--h-rms", "1", "--h-max", "3"]
SAMPLED = ("--X", "1", "--mu", "0.1")
COMMANDS = {
    "show": ("tables", "show", "FILE"),
    "verify": ("tables", "verify", "FILE"),
    "plot": ("tables", "plot", "FILE", "--out", "OUT.svg"),
    "sample": ("tables", "sample", "FILE", *SAMPLED, "--out", "OUT.nc"),
    "code of a function": ("tables", "export", "c", "FILE", "--out", "OUT"),
    "code": ("export", "c", "--table", "FILE", "--out", "OUT"),
    "contact": (
        *("contact", *NUMBERS, "--separation", "2", "--out", "OUT.csv"),
        *("--island-model", "FILE"),
    ),
    "joint": (
        *("joint", "--set", "bodies=1 GPa", "--set", "island_model=FILE"),
        *("--set", "part_a={Rq='1 um', hurst=0.8, longest='6 um', shortest='0.2 um'}"),
        *("--pressure", "10MPa", "--out", "OUT.csv"),
    ),
}


def damaged(path):
    write_table(path, small_table("universal"))
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)


def cut(path):
    write_table(path, small_table("island4d"))
    path.write_bytes(path.read_bytes()[:-1000])


def foreign(path):
    with netCDF4.Dataset(path, "w") as dataset:
        dataset.createDimension("time", 3)
        dataset.createVariable("temperature", "f8", ("time",))[...] = [1.0, 2.0, 3.0]


def text(path):
    path.write_text("X,mu,phi_F\n1,2,3\n")


BAD = [damaged, cut, foreign, text]


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("spoil", BAD)
def test_a_bad_file_is_one_error_that_names_it(spoil, command, tmp_path):
    path = tmp_path / "bad.nc"
    spoil(path)
    names = {"FILE": str(path), "OUT": str(tmp_path / "out")}
    words = []
    for word in COMMANDS[command]:
        for mark, value in names.items():
            word = word.replace(mark, value)
        words.append(word)
    message = refused(*words)
    assert str(path) in message
    assert "`mbma tables make " in message
    assert len(message.splitlines()) == 1
    assert [*tmp_path.iterdir()] == [path]


@pytest.mark.parametrize("spoil", BAD)
def test_a_bad_file_is_a_typed_error_of_every_class_that_takes_one(spoil, tmp_path):
    path = tmp_path / "bad.nc"
    spoil(path)
    entries = {
        "bodies": "1 GPa",
        "island_model": "bad.nc",
        "part_a": {"Rq": "1 um", "hurst": 0.8, "longest": "6 um", "shortest": "0.2 um"},
    }
    numbers = {"hurst": 0.8, "q0": 1.0, "q1": 30.0, "h_rms": 1.0, "h_max": 3.0}
    scene = {"surface": numbers, "separation": 2.0, "island_model": "bad.nc"}
    for take in (
        lambda: open_table(path),
        lambda: Mbma(island_model=path),
        lambda: Scene.from_mapping(scene, tmp_path),
        lambda: Joint.from_entries(entries, tmp_path / "joint.toml"),
    ):
        with pytest.raises(TableFileError, match=r"bad\.nc: .*`mbma tables make "):
            take()


FUNCTION = """
target = 1e-8
certificate_points = 500
[axes.x]
low = 0.1
high = 3.0
[axes.y]
low = 0.1
high = 3.0
[outputs.u]
[outputs.v]
error = "absolute"
"""
WRITES = {
    "universal": ("tables", "make", "universal", "--config", "grid.toml", "--out"),
    "function": ("tables", "make", "tabulated:smooth", "--config", "axes.toml", "--out"),
    "plot": ("tables", "plot", "universal", "--out"),
    "sample": (
        *("tables", "sample", "universal", "--X", ",".join(map(str, range(40)))),
        *("--mu", ",".join(str(k / 10) for k in range(1, 100)), "--out"),
    ),
    "page": ("explore", *NUMBERS, "--out"),
}


def limited(words, folder, size):
    """A command whose files may have so many bytes at most: a write fails as on a full disk."""
    program = (
        "import resource, sys; "
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size})); "
        "from mbma_tables.cli import main; main(sys.argv[1:])"
    )
    paths = os.pathsep.join([str(pathlib.Path(__file__).parents[1]), *sys.path])
    return subprocess.run(
        [sys.executable, "-c", program, *words],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": paths, "MBMA_TABLES_CACHE": "off"},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.skipif(sys.platform == "win32", reason="no limit of a file's size")
@pytest.mark.parametrize("command", WRITES)
def test_what_does_not_fit_on_the_disk_leaves_what_was_there(command, tmp_path):
    """The write that fails is one of the library or of HDF5, and the error is one line."""
    (tmp_path / "grid.toml").write_text(SMALL["universal"])
    (tmp_path / "axes.toml").write_text(FUNCTION)
    suffix = {"plot": ".svg", "page": ".html"}.get(command, ".nc")
    out = tmp_path / f"mine{suffix}"
    out.write_bytes(b"before")
    before = sorted(tmp_path.iterdir())
    words = (*WRITES[command], str(out))
    ran = limited(words, tmp_path, 12_000)
    assert ran.returncode == 2, ran.stderr
    assert "Traceback" not in ran.stderr
    assert len(ran.stderr.splitlines()) == 1
    assert out.read_bytes() == b"before"
    # pieces of a table of a function are kept, whole, for --resume
    pieces = tmp_path / "mine.nc.pieces"
    assert sorted({*tmp_path.iterdir()} - {pieces}) == before
    if command == "function":
        ran = limited((*words, "--resume"), tmp_path, 10_000_000)
        assert ran.returncode == 0, ran.stderr
        expected = tabulated.smooth(1.0, 1.0)[0]
        assert open_table(out).lookup(1.0, 1.0)["u"] == pytest.approx(expected)
    else:
        assert not pieces.exists()
