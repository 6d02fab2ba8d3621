"""The core as compilers see it: no warnings, the same bits on other processors, and nothing that sanitizers find."""

import hashlib
import importlib.util
import pathlib
import pickle
import platform
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig

import numpy as np
import pytest

from mbma_tables.core import core

ROOT = pathlib.Path(__file__).parents[2]
CORE = ROOT / "mbma_tables" / "core"
SOURCES = sorted(path for path in CORE.glob("*.c") if path.name != "binding.c")
STRICT = ["-Wall", "-Wextra", "-Wconversion", "-Werror"]
SANITIZERS = [
    "-O1",
    "-g",
    "-fsanitize=address,undefined,float-cast-overflow",
    "-fno-sanitize-recover=all",
]
INTEL = platform.machine() in ("x86_64", "AMD64")
# what calls no function of the C library: the same bits wherever a processor has an fma
EXACT = {
    *("calibrated_contact", "calibrated_ends", "calibrated_separation", "elementary"),
    *("contact_flows", "height_integrals", "island_extents", "islands_work"),
    *("phi", "profile_missed", "self_affine", "solve_islands", "spline_pieces"),
}

# coefficients of polynomials, of which small ones are differences of large numbers
COEFFICIENTS = {"spectrum_law_of"}

pytestmark = pytest.mark.skipif(
    sys.platform == "win32", reason="the core's compiler there is zig's alone"
)


def load(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


BUILD = load(ROOT / "build_backend.py")
GENERATIONS = [name for name in BUILD.LEVELS if INTEL or name == "_plain"]


def found(program):
    path = shutil.which(program)
    if path is None:
        pytest.skip(f"{program} is not installed")
    return path


def zig():
    pytest.importorskip("ziglang")
    return [sys.executable, "-m", "ziglang", "cc", "-fno-sanitize=undefined"]


def run(*command, **options):
    done = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    assert done.returncode == 0, (
        f"{shlex.join(map(str, command))}\n{done.stdout}{done.stderr}"
    )
    return done.stdout


def checked(compiler, folder, *options):
    """Compiles without a word; binding.c too, with its own declarations of Python."""
    for file in (*SOURCES, CORE / "binding.c"):
        line = [
            *compiler,
            *BUILD.FLAGS,
            *options,
            *STRICT,
            "-DMBMA_MODULE=_plain",
            "-c",
            file,
        ]
        assert run(*line, "-o", folder / "object") == ""


@pytest.mark.slow
@pytest.mark.parametrize("generation", GENERATIONS)
def test_no_warnings(generation, tmp_path):
    checked([found("cc")], tmp_path, *BUILD.LEVELS[generation])


@pytest.mark.slow
@pytest.mark.parametrize(
    "target",
    [
        "x86_64-linux-gnu.2.17",
        "aarch64-linux-musl",
        "aarch64-macos",
        "x86_64-windows-gnu",
    ],
)
def test_no_warnings_of_clang(target, tmp_path):
    for generation in (
        BUILD.ZIG_LEVELS if target.startswith("x86_64-linux") else ["_plain"]
    ):
        checked(zig(), tmp_path, "-O1", "-target", target, *BUILD.ZIG_LEVELS[generation])


FIELDS = {
    "PyObject": "ob_refcnt ob_type",
    "Py_buffer": "buf obj len itemsize readonly ndim format shape strides suboffsets internal",
    "PyMethodDef": "ml_name ml_meth ml_flags ml_doc",
    "PyModuleDef": "m_base m_name m_doc m_size m_methods m_slots m_traverse m_clear m_free",
    "PyModuleDef_Slot": "slot value",
    "PyType_Slot": "slot pfunc",
    "PyType_Spec": "name basicsize itemsize flags slots",
}


def test_declarations_of_python_are_those_of_its_headers(tmp_path):
    include = sysconfig.get_path("include")
    if not pathlib.Path(include, "Python.h").exists():
        pytest.skip("Python's headers are not installed")
    text = (CORE / "stable_abi.h").read_text(encoding="utf-8")
    assert set(re.findall(r"} (Py\w+);", text)) == set(FIELDS)
    names = re.findall(
        r"\b(METH_\w+|Py_mod_\w+|Py_tp_\w+|Py_TPFLAGS_\w+|PyBUF_\w+) = ", text
    )
    assert len(names) > 10
    names += [f"sizeof({kind})" for kind in FIELDS]
    names += [
        f"offsetof({kind}, {field})"
        for kind, fields in FIELDS.items()
        for field in fields.split()
    ]
    lines = "".join(
        f'    printf("{name} %lld\\n", (long long)({name}));\n' for name in names
    )
    source = tmp_path / "layout.c"
    source.write_text(
        "#define Py_LIMITED_API 0x030B0000\n#include <stddef.h>\n#include <stdio.h>\n"
        '#ifdef THEIRS\n#include <Python.h>\n#endif\n#ifndef ALONE\n#include "stable_abi.h"\n#endif\n'
        f"int main(void) {{\n{lines}}}\n"
    )
    # that both can be included shows that their functions are alike
    run(
        found("cc"),
        "-DTHEIRS",
        f"-I{include}",
        f"-I{CORE}",
        "-fsyntax-only",
        "-Werror",
        source,
    )
    shown = []
    for options in (["-DTHEIRS", "-DALONE", f"-I{include}"], [f"-I{CORE}"]):
        run(found("cc"), *options, source, "-o", tmp_path / "layout")
        shown.append(run(tmp_path / "layout"))
    assert shown[0] == shown[1]


def recording(folder):
    path = folder / "calls"
    run(sys.executable, ROOT / "tests" / "core" / "record.py", path)
    return path


def replay(compiler, folder, *options):
    program = folder / "replay"
    begin = [*compiler, *BUILD.FLAGS, *options, "-DMBMA_MODULE=_plain", f"-I{CORE}"]
    run(*begin, ROOT / "tests" / "core" / "replay.c", *SOURCES, "-o", program, "-lm")
    return program


def off(found, expected):
    """How far numbers are from others, relatively; of less than 1e-3 as if they were as much."""
    if found.dtype.kind != "f":
        return 0.0 if (found == expected).all() else np.inf
    with np.errstate(all="ignore"):
        scale = np.maximum(1e-3, np.maximum(abs(found), abs(expected)))
        apart = np.where(
            (found == expected) | (np.isnan(found) & np.isnan(expected)),
            0.0,
            abs(found - expected) / scale,
        )
    return np.nan_to_num(apart, nan=np.inf).max(initial=0.0)


def answers(calls, *command):
    """Of each function: hash of its answers, and how far from what was recorded they are."""
    given = b"".join(call.packed() for call in calls)
    done = subprocess.run(command, input=given, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    said = memoryview(done.stdout)
    bits = {}
    worst = {}
    for call in calls:
        (returned,), said = np.frombuffer(said[:8], np.int64), said[8:]
        parts = [int(returned).to_bytes(8, "little", signed=True)]
        far = [0.0 if returned == call.returned else np.inf]
        for one in call.after:
            if isinstance(one, np.ndarray):
                found = np.frombuffer(said[: one.nbytes], one.dtype)
                said = said[one.nbytes :]
                far.append(off(found, one.ravel()))
                # every NaN is one, as processors differ in its sign
                parts.append(
                    np.where(np.isnan(found), 0, found).tobytes()
                    if one.dtype.kind == "f"
                    else found.tobytes()
                )
        bits.setdefault(call.name, hashlib.sha256()).update(b"".join(parts))
        worst[call.name] = max(*far, worst.get(call.name, 0.0))
    assert not said
    return {name: (bits[name].hexdigest(), worst[name]) for name in bits}


@pytest.mark.slow
def test_answers_of_other_processors(tmp_path, record_property):
    """Roundings depend on fma alone, and on the C library where a function calls it."""
    compiler = [found("cc")]
    seen = {}
    calls = pickle.loads(recording(tmp_path).read_bytes())
    for generation in GENERATIONS:
        if generation == "_plain" or getattr(core, "generation", 0) >= int(
            generation[-1]
        ):
            seen[generation] = answers(
                calls, replay(compiler, tmp_path, *BUILD.LEVELS[generation])
            )
    emulator = shutil.which("qemu-aarch64") or shutil.which("qemu-aarch64-static")
    if emulator:
        arm = replay(zig(), tmp_path, "-target", "aarch64-linux-musl", "-static")
        seen["arm64"] = answers(calls, emulator, arm)
    for name in seen["_plain"]:
        line = "  ".join(
            f"{build} {found[name][0]} {found[name][1]:.1e}"
            for build, found in seen.items()
        )
        record_property(name, line)
    assert set(seen["_plain"]) > EXACT
    assert all(far < 1e-6 for _, far in seen["_plain"].values())
    fused = [build for build in seen if build != "_plain"]
    for name in seen["_plain"]:
        libraries = {
            seen[build][name][0] for build in fused if name in EXACT or build != "arm64"
        }
        assert len(libraries) <= 1, name
        most = 1e-6 if name in COEFFICIENTS else 1e-12
        assert all(
            seen[build][name][1] < most for build in fused if core.arithmetic == "fma"
        ), name
