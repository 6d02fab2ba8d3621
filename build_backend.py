"""The build backend: setuptools, and zig's C compiler (374 MB, for the build alone) on machines that have none."""

import os
import pathlib
import platform
import shlex
import subprocess
import sys
import sysconfig
import tempfile
from typing import Any

from setuptools import build_meta
from setuptools.build_meta import *  # noqa: F403

# no rounding depends on the compiler; nothing sets errno or traps, which would keep loops
# from being vectorised
FLAGS = [
    "-std=c11",
    "-O3",
    "-ffp-contract=off",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-fvisibility=hidden",
]
LEVELS = {
    "_x86_64_v4": ["-march=x86-64-v4"],
    "_x86_64_v3": ["-march=x86-64-v3"],
    "_plain": [],
}
# in zig's words; clang vectorises loops that read tables only where it is told that
# gathering is fast
ZIG_LEVELS = LEVELS | {
    f"_{name}": [f"-mcpu={name}+fast_gather"] for name in ("x86_64_v4", "x86_64_v3")
}


def compiler() -> list[str] | None:
    """The C compiler of the environment variable CC, or the first that compiles; None on Windows, and where none does.

    What is named `cc` may be a stub, have no headers, or be too old to know the generations
    of processors.
    """
    if sys.platform == "win32":
        return None  # Microsoft's does not know GNU's attributes
    if given := os.environ.get("CC"):
        return shlex.split(given)
    flags = [
        "-std=c11",
        *(["-march=x86-64-v4"] if platform.machine() == "x86_64" else []),
    ]
    with tempfile.TemporaryDirectory() as folder:
        source = pathlib.Path(folder, "trial.c")
        source.write_text(
            "#include <math.h>\ndouble trial(double x) { return sin(x); }\n",
            encoding="utf-8",
        )
        for named in (sysconfig.get_config_var("CC"), "cc", "gcc", "clang"):
            line = [
                *shlex.split(named or ""),
                *flags,
                "-shared",
                "-fPIC",
                str(source),
                "-o",
                f"{folder}/trial.so",
                "-lm",
            ]
            try:
                subprocess.run(line, check=True, capture_output=True)
            except (OSError, subprocess.CalledProcessError):
                continue
            return shlex.split(named)
    return None


def _with_zig(required: list[str]) -> list[str]:
    return required if compiler() else [*required, "ziglang>=0.15.1"]


def get_requires_for_build_wheel(config_settings: Any = None) -> list[str]:
    """What setuptools asks for, and a compiler."""
    return _with_zig(build_meta.get_requires_for_build_wheel(config_settings))


def get_requires_for_build_editable(config_settings: Any = None) -> list[str]:
    """Likewise."""
    return _with_zig(build_meta.get_requires_for_build_editable(config_settings))
