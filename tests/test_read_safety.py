"""What is read may be meant badly: nothing in it is executed, no path in it is followed, no size in it is believed."""

import ast
import bz2
import gzip
import io
import os
import pathlib
import subprocess
import sys
import tracemalloc
import zlib

import h5py
import numpy as np
import pytest

import generate
import mbma_tables
from generate.tables import campaign, configuration
from mbma_tables import InputError, MbmaError, Scene, TableFileError
from mbma_tables.files import shipped_file
from mbma_tables.surfaces.maps import read_map
from mbma_tables.tablefiles import contents
from mbma_tables.tablefiles.netcdf import SEAL_LENGTH, check_table

FORBIDDEN = {"eval", "exec", "compile", "__import__"}
UNSAFE_MODULES = {"pickle", "cPickle", "dill", "cloudpickle", "joblib", "shelve", "marshal", "yaml"}
SOURCES = [
    path for package in (mbma_tables, generate) for path in sorted(pathlib.Path(package.__file__).parent.rglob("*.py"))
]
MOST_MEMORY = 300 * 2**20
KEY = "0" * 64
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
    body = path.read_bytes()
    (tmp_path / KEY).write_bytes(campaign._digest(KEY, body) + body)
    assert campaign._load(tmp_path, KEY) is None


def sealed(path, edit):
    """At `path` the shipped universal table after `edit(file)`, with a right checksum."""
    from small_tables import seal

    path.write_bytes(shipped_file("universal.nc").read_bytes()[:-SEAL_LENGTH])
    with h5py.File(path, "r+") as file:
        edit(file)
    path.write_bytes(seal(path.read_bytes()))
    return path


@pytest.fixture(autouse=True)
def tables_within_reach(monkeypatch):
    monkeypatch.syspath_prepend(pathlib.Path(__file__).parent / "tablefiles")


def external_link(file, other):
    file["other"] = h5py.ExternalLink(str(other), "/log_ratio_F")


def external_storage(file, other):
    file.create_dataset("other", (4,), "f8", external=[(str(other), 0, 32)])


def virtual_dataset(file, other):
    layout = h5py.VirtualLayout((4,), "f8")
    layout[:] = h5py.VirtualSource(str(other), "log_ratio_F", (4,))
    file.create_virtual_dataset("other", layout)


@pytest.mark.parametrize("edit", [external_link, external_storage, virtual_dataset])
def test_no_path_in_a_table_is_followed(edit, tmp_path):
    # whoever opens this pipe is seen, and waits for ever
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    path = sealed(tmp_path / "table.nc", lambda file: edit(file, pipe))
    watch = "import os, sys; end = os.open(sys.argv[1], os.O_WRONLY); sys.exit(7)"
    watcher = subprocess.Popen([sys.executable, "-c", watch, str(pipe)])
    try:
        with pytest.raises(TableFileError):
            check_table(path)
        assert watcher.poll() is None
    finally:
        watcher.kill()
        watcher.wait()


def soft_link(file):
    file["other"] = h5py.SoftLink("/")


def circle(file):
    file.create_group("a")["b"] = file["/"]


def nested_groups(file):
    group = file
    for _ in range(2000):
        group = group.create_group("a")


def huge_dataset(file):
    file.create_dataset("other", (40000, 40000), "f8", chunks=(100, 100), compression="gzip")


def endless_dataset(file):
    file.create_dataset("other", (10**15,), "f8", maxshape=(None,), chunks=(1000,))


def overflowing_dataset(file):
    file.create_dataset("other", (2**32, 2**32), "f4", chunks=(10, 10))


def huge_chunk(file):
    file.create_dataset("other", (4, 2**28), "f8", chunks=(1, 2**28), compression="gzip")


def packed_thrice(file):
    settings = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    settings.set_chunk((1,))
    for _ in range(3):
        settings.set_deflate(9)
    space = h5py.h5s.create_simple((1,))
    made = h5py.h5d.create(file.id, b"other", h5py.h5t.IEEE_F64LE, space, settings)
    packer = zlib.compressobj(1)
    packed = b"".join(packer.compress(bytes(2**20)) for _ in range(320)) + packer.flush()
    made.write_direct_chunk((0,), zlib.compress(zlib.compress(packed, 9), 9))


def strings(file):
    file.create_dataset("other", (3,), h5py.string_dtype())


def opaque(file):
    file.create_dataset("other", (3,), np.dtype("V7"))


def compound(file):
    file.create_dataset("other", (3,), np.dtype([("a", "f8"), ("b", "i4")]))


def lists(file):
    file.create_dataset("other", (3,), h5py.vlen_dtype("f8"))


def no_dataspace(file):
    file.create_dataset("other", data=h5py.Empty("f8"))


@pytest.mark.parametrize(
    "edit",
    [
        soft_link,
        circle,
        nested_groups,
        huge_dataset,
        endless_dataset,
        overflowing_dataset,
        huge_chunk,
        strings,
        opaque,
        compound,
        lists,
        no_dataspace,
    ],
)
def test_what_no_table_has_is_refused(edit, tmp_path):
    path = sealed(tmp_path / "table.nc", edit)
    with pytest.raises(TableFileError) as caught:
        check_table(path)
    assert "`python -m generate " in str(caught.value)
    # a good file after it is read
    assert check_table(sealed(path, lambda file: None))[0].kind == "universal"


def test_a_value_that_unpacks_to_more_than_the_memory(tmp_path):
    path = sealed(tmp_path / "table.nc", packed_thrice)
    assert path.stat().st_size < 2_000_000
    # not "has attributes that were edited", which is found where everything could be read
    with pytest.raises(TableFileError, match="HDF error"):
        check_table(path)


def test_a_library_that_crashes_or_does_not_end(tmp_path, monkeypatch):
    path = sealed(tmp_path / "table.nc", lambda file: None)
    assert check_table(path)[0].kind == "universal"
    process = contents._processes[os.getpid()]
    process.kill()
    process.wait()
    with pytest.raises(TableFileError, match="crashes on it, or reads for more than"):
        check_table(path)
    monkeypatch.setattr(contents, "LONGEST", 0.0)
    with pytest.raises(TableFileError, match="crashes on it, or reads for more than"):
        check_table(path)
    monkeypatch.undo()
    assert check_table(path)[0].kind == "universal"


def test_no_interpreter_to_read_with(tmp_path, monkeypatch):
    path = sealed(tmp_path / "table.nc", lambda file: None)
    contents._end()
    monkeypatch.setattr(sys, "executable", str(tmp_path / "none"))
    with pytest.raises(TableFileError, match="cannot be run to read it: No such file or directory"):
        check_table(path)


def test_the_process_that_reads_can_open_no_file(tmp_path):
    work = "import contents, sys; contents._limits(); open(sys.argv[1])"
    place = pathlib.Path(contents.__file__)
    done = subprocess.run(
        [sys.executable, "-c", work, str(place)], cwd=place.parent, capture_output=True, text=True, check=False
    )
    assert "Too many open files" in done.stderr


def test_packed_contents_come_back(tmp_path):
    body = sealed(tmp_path / "table.nc", lambda file: None).read_bytes()[:-SEAL_LENGTH]
    given = contents.contents_of(body)
    found = contents.unpacked(contents.packed(given))
    assert found.attributes == given.attributes
    assert list(found.variables) == list(given.variables)
    for name, variable in given.variables.items():
        other = found.variables[name]
        assert (other.dimensions, other.attributes, other.values.dtype) == (
            variable.dimensions,
            variable.attributes,
            variable.values.dtype,
        )
        assert other.values.tobytes() == variable.values.tobytes()
    stream, answers = io.BytesIO(), io.BytesIO()
    contents._send(stream, body)
    contents._send(stream, b"no netCDF")
    stream.seek(0)
    assert contents.answer(contents._receive(stream)).startswith(contents.GOOD)
    assert contents.answer(contents._receive(stream)).startswith(contents.BAD)
    assert contents._receive(stream) == contents._receive(answers) == b""


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
    "chunk": (lambda path: campaign._load(path.parent, KEY), KEY, campaign._digest(KEY, npy_claim()) + npy_claim()),
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
    assert peak < MOST_MEMORY


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
    assert peak < MOST_MEMORY


def test_a_sparse_file_is_not_read(tmp_path):
    path = tmp_path / "sparse"
    with path.open("wb") as file:
        file.truncate(CLAIM)
    for read in (
        check_table,
        Scene.from_toml,
        lambda path: configuration.load("universal", path),
    ):
        refused, peak = tried(read, path)
        assert refused
        assert peak < MOST_MEMORY


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
