"""Tests that matter to the core pass with the module of every generation of processor, and under sanitizers."""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import sysconfig

import pytest
from record import functions
from test_core_builds import BUILD, CORE, SANITIZERS, SOURCES, found, recording, run

from mbma_tables.core import GENERATIONS, core

ROOT = pathlib.Path(__file__).parents[2]
QUICK = [
    "core/test_calibrated_core.py",
    "islands/test_core_islands.py",
]
QUICK += [
    "theories/mbma/test_kernel.py",
    "contacts/law/test_law.py",
    "islands/test_island_models.py",
]
MORE = [
    "islands/test_geometry.py",
    "tables/test_universal_model.py",
    "theories/mbma/test_contact.py",
]
MORE += ["tables/test_island4d_model.py", "theories/mbma/test_closed_forms.py"]
MORE += [
    "theories/calibrated/test_calibrated_theory.py",
    "theories/yielding/test_yielding.py",
]
pytestmark = pytest.mark.slow


def passed(tests, **environment):
    options = ["-P", "-m", "pytest", "-n", "0", "-p", "no:cacheprovider"]
    command = [sys.executable, *options, *(f"tests/{name}" for name in tests)]
    done = subprocess.run(
        command,
        cwd=ROOT,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.parametrize("generation", GENERATIONS)
def test_with_each_generation(generation):
    if core.generation < GENERATIONS[generation]:
        pytest.skip(f"this processor is no {generation}")
    forced = "MBMA_TABLES_CORE" in os.environ
    if core.generation == GENERATIONS[generation] and not forced:
        pytest.skip("what all other tests are run with")
    passed(QUICK + MORE, MBMA_TABLES_CORE=generation)


@pytest.fixture
def sanitized(tmp_path):
    """Environment in which the library's core is one compiled with sanitizers, and its folder."""
    if sys.platform != "linux":
        pytest.skip("LD_PRELOAD")
    package = tmp_path / "mbma_tables"
    shutil.copytree(
        CORE.parent, package, ignore=shutil.ignore_patterns("__pycache__", "_plain.*")
    )
    for name in ("docs", "tables"):
        (tmp_path / name).symlink_to(ROOT / name)
    include = f"-I{sysconfig.get_path('include')}"
    cc = found("cc")
    options = [
        *BUILD.FLAGS,
        *SANITIZERS,
        include,
        "-DMBMA_MODULE=_plain",
        "-shared",
        "-fPIC",
    ]
    run(
        cc,
        *options,
        *SOURCES,
        CORE / "binding.c",
        "-o",
        package / "core" / "_plain.abi3.so",
        "-lm",
    )
    # Python itself keeps what it has allocated
    environment = {
        "LD_PRELOAD": run(cc, "-print-file-name=libasan.so").strip(),
        "ASAN_OPTIONS": "detect_leaks=0",
        "MBMA_TABLES_CORE": "plain",
        "PYTHONPATH": os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]),
    }
    imported = run(
        *(sys.executable, "-P", "-c", "from mbma_tables.core import core; print(core.__file__)"),
        env=os.environ | environment, cwd=tmp_path,
    )  # fmt: skip
    assert imported.startswith(str(package))
    return environment, tmp_path


def test_under_sanitizers(sanitized):
    environment, _ = sanitized
    passed(QUICK, **environment)


def test_spoiled_calls_under_sanitizers(sanitized):
    environment, folder = sanitized
    calls = recording(folder)
    script = ROOT / "tests" / "core" / "mutate.py"
    tried = json.loads(
        run(
            sys.executable,
            script,
            calls,
            "60",
            env=os.environ | environment | {"PYTHONMALLOC": "malloc"},
            cwd=folder,
        )
    )
    assert set(tried) == {name for name, _ in functions()} | {"Law"}
    # of every function every argument, numbers in at least ten ways, arrays in hundreds
    assert all(min(counts, default=10) >= 10 for counts in tried.values())
    assert sum(map(sum, tried.values())) > 24_000
