"""The compiled core, once for each generation of processor, and the README of a package index."""

import os
import pathlib
import platform
import re
import sys

from setuptools import Extension, setup

# what GCC's and clang's loops need: no rounding depends on the compiler, none sets errno or traps
FLAGS = ["-std=c11", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-fvisibility=hidden"]
LEVELS = {"x86_64_v4": ["-march=x86-64-v4"], "x86_64_v3": ["-march=x86-64-v3"], "plain": []}
CORE = pathlib.Path("mbma_tables/core")


def extensions() -> list[Extension]:
    """The modules of this machine, or of the one that MBMA_TABLES_MACHINE names."""
    machine = os.environ.get("MBMA_TABLES_MACHINE", platform.machine()).lower()
    levels = list(LEVELS) if machine in ("x86_64", "amd64") else ["plain"]
    return [
        Extension(
            f"mbma_tables.core._{level}",
            sorted(map(str, CORE.glob("*.c"))),
            depends=sorted(map(str, CORE.glob("*.h"))),
            define_macros=[("MBMA_MODULE", f"_{level}")],
            extra_compile_args=FLAGS + LEVELS[level],
            libraries=[] if sys.platform == "win32" else ["m"],
            py_limited_api=True,
        )
        for level in levels
    ]


readme = pathlib.Path("README.md").read_text(encoding="utf-8")
readme = re.sub(r"!\[[^]]*\]\((?!https:)[^)]*\)\n+", "", readme)
# whole in brackets, such as "(why)"
readme = re.sub(r" \(\[[^]]+\]\((?!https:)[^)]*\)\)", "", readme)
readme = re.sub(r"\[([^]]+)\]\((?!https:)[^)]*\)", r"\1", readme)
readme += "\nPages named here are in the folder docs of the source distribution.\n"
setup(
    long_description=readme,
    long_description_content_type="text/markdown",
    ext_modules=extensions(),
    options={"bdist_wheel": {"py_limited_api": "cp311"}},
)
