"""What is read may be meant badly: nothing in it is executed, no path in it is followed, no size in it is believed."""

import ast
import bz2
import gzip
import io
import os
import pathlib
import tracemalloc

import numpy as np
import pytest

import mbma_tables
from generate.tables import configuration
from mbma_tables import InputError, MbmaError, Scene
from mbma_tables.surfaces.maps import read_map
from mbma_tables.tablefiles.netcdf import read_table

FORBIDDEN = {"eval", "exec", "compile", "__import__"}
UNSAFE_MODULES = {"pickle", "cPickle", "dill", "cloudpickle", "joblib", "shelve", "marshal", "yaml"}
SOURCES = sorted(pathlib.Path(mbma_tables.__file__).parent.rglob("*.py"))
MAX_MEMORY = 300 * 2**20
CLAIM = 10 * 2**30


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_nothing_executes_what_is_read(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call):
            name = node.func.id if isinstance(node.func, ast.Name) else ""
            assert name not in FORBIDDEN, f"{name} in line {node.lineno}"
            pickled = [word.value for word in node.keywords if word.arg == "allow_pickle"]
            assert all(isinstance(value, ast.Constant) and value.value is False for value in pickled)
            if (
                isinstance(node.func, ast.Attribute)
                and node.func.attr in ("load", "save")
                and ast.unparse(node.func)[:3] == "np."
            ):
                assert pickled, f"allow_pickle is not said in line {node.lineno}"
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        assert not {name.split(".")[0] for name in names} & UNSAFE_MODULES


class Executed(Exception):
    """What a pickle says was done."""


class Charge:
    """An object whose unpickling is seen."""

    def __reduce__(self):
        return execute, ()


def execute():
    raise Executed


def objects(save):
    stream = io.BytesIO()
    array = np.empty((40, 40), dtype=object)
    array[:] = Charge()
    save(stream, array, allow_pickle=True)
    return stream.getvalue()


@pytest.mark.parametrize(("suffix", "save"), [("npy", np.save), ("npz", np.savez)])
def test_arrays_of_objects_are_refused(suffix, save, tmp_path):
    pytest.importorskip("NuMPI")
    path = tmp_path / f"map.{suffix}"
    path.write_bytes(objects(save))
    with pytest.raises(InputError, match="cannot read"):
        read_map(path)


def npy_claim():
    """A header of 10 GB, and no data."""
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": (40000, 40000)})
    return head.getvalue()


def scene_with(entry):
    text = '[effects]\non = ["force"]\n[prescribed]\nseparations = 1e-6\n[surface]\nhurst = '
    return text.encode() + entry


DEEP = b"[" * 100_000
CASES = {
    # name: what is read by what
    "map-npy": (read_map, "map.npy", npy_claim()),
    "scene-deep": (Scene.from_toml, "scene.toml", scene_with(DEEP)),
    "scene-tables": (Scene.from_toml, "scene.toml", scene_with(b"{a=" * 100_000)),
    "scene-dotted": (Scene.from_toml, "scene.toml", b"a." * 100_000 + b"a = 1"),
    "scene-digits": (Scene.from_toml, "scene.toml", scene_with(b"9" * 900_000)),
    "scene-hexadecimal": (Scene.from_toml, "scene.toml", scene_with(b"0x" + b"f" * 900_000)),
    "scene-long": (Scene.from_toml, "scene.toml", b"#" * 2_000_000),
    "configuration-deep": (lambda path: configuration.load("universal", path), "own.toml", b"seed = " + DEEP),
    "configuration-digits": (
        lambda path: configuration.load("universal", path),
        "own.toml",
        b"seed = 0x" + b"f" * 900_000,
    ),
    "configuration-long": (lambda path: configuration.load("universal", path), "own.toml", b"#" * 2_000_000),
}


def tried(read, path):
    """Whether it was refused, and the memory that this took."""
    tracemalloc.start()
    try:
        found = read(path)
    except (MbmaError, OSError):
        found = None
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    return found is None, peak


@pytest.mark.parametrize("name", CASES)
def test_sizes_are_not_believed(name, tmp_path):
    read, file, content = CASES[name]
    if name.startswith("map"):
        pytest.importorskip("NuMPI")
    path = tmp_path / file
    path.write_bytes(content)
    refused, peak = tried(read, path)
    assert refused
    assert peak < MAX_MEMORY


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("psd.txt", b"1 1\n" * 5_000_000),
        ("psd.gz", gzip.compress(bytes(2**20))),
        ("psd.bz2", bz2.compress(bytes(2**20))),
        ("psd.npy", npy_claim()),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_spectrum_is_not_unpacked(name, content, tmp_path):
    (tmp_path / name).write_bytes(content)
    scene = tmp_path / "scene.toml"
    scene.write_text(
        f'[surface]\npsd = "{name}"\nh_max = 1.0\n[effects]\non = ["force"]\n[prescribed]\nseparations = 1.0\n'
    )
    refused, peak = tried(Scene.from_toml, scene)
    assert refused
    assert peak < MAX_MEMORY


def test_a_sparse_file_is_not_read(tmp_path):
    path = tmp_path / "sparse"
    with path.open("wb") as file:
        file.truncate(CLAIM)
    for read in (
        read_table,
        Scene.from_toml,
        lambda path: configuration.load("universal", path),
    ):
        refused, peak = tried(read, path)
        assert refused
        assert peak < MAX_MEMORY


@pytest.mark.parametrize("key", ["map", "psd"])
@pytest.mark.parametrize("name", ["pipe", "/dev/zero", ".", "none", "http://localhost/psd.txt", "file:///etc/hostname"])
def test_a_scene_reads_no_other_files_than_plain_ones(key, name, tmp_path):
    # map and psd are the only paths that a scene has; from what is no file here, nobody would come back
    os.mkfifo(tmp_path / "pipe")
    more = "h_max = 1.0\n" if key == "psd" else ""
    scene = tmp_path / "scene.toml"
    scene.write_text(f'[surface]\n{key} = "{name}"\n{more}[effects]\non = ["force"]\n[prescribed]\nseparations = 1.0\n')
    with pytest.raises(InputError, match="is not a file"):
        Scene.from_toml(scene)
