"""The compiled core, one module for each generation of processor, and the README of a package index."""

import os
import pathlib
import platform
import re
import shlex
import subprocess
import sys
import sysconfig
import tempfile
from concurrent.futures import ThreadPoolExecutor

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

from build_backend import FLAGS, LEVELS, ZIG_LEVELS, compiler

CORE = pathlib.Path("mbma_tables/core")


def this_machine() -> str:
    """The machine as a target of zig."""
    machine = platform.machine().lower()
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(machine, machine)
    if sys.platform == "linux":
        return f"{machine}-linux-" + (
            "gnu.2.17" if platform.libc_ver()[0] == "glibc" else "musl"
        )
    return machine + ("-windows-gnu" if sys.platform == "win32" else "-macos")


# a target of zig, such as aarch64-linux-gnu.2.17: zig builds for other machines, and for
# this one without a compiler
OTHER = os.environ.get("MBMA_TABLES_TARGET")
COMPILER = None if OTHER else compiler()
TARGET = OTHER or this_machine()


def command(folder: str) -> list[str]:
    """The compiler and what it needs; files made for it are put in `folder`."""
    linking = (
        ["-Wl,-undefined,dynamic_lookup", "-Wl,-install_name,@rpath/mbma_core"]
        if "macos" in TARGET
        else []
    )
    if COMPILER:
        headers = sorted(
            {sysconfig.get_path(name) for name in ("include", "platinclude")}
        )
        return [*COMPILER, *(f"-I{path}" for path in headers), *linking]
    # else zig keeps what it makes of the C library in the user's home
    os.environ.setdefault("ZIG_GLOBAL_CACHE_DIR", folder)
    os.environ.setdefault("ZIG_LOCAL_CACHE_DIR", folder)
    zig = [sys.executable, "-m", "ziglang"]
    if "windows" in TARGET:
        # an import library holds nothing but names
        names = re.findall(
            r"PyAPI_(FUNC|DATA)\([\w *]+\) (_?Py\w+)",
            (CORE / "stable_abi.h").read_text("utf-8"),
        )
        exported = "\n".join(
            f"{name} DATA" if kind == "DATA" else name for kind, name in names
        )
        definition = pathlib.Path(folder, "python3.def")
        library = f"{folder}/python3.lib"
        definition.write_text(
            f"LIBRARY python3.dll\nEXPORTS\n{exported}\n", encoding="utf-8"
        )
        machine = "arm64" if TARGET.startswith("aarch64") else "i386:x86-64"
        subprocess.run(
            [*zig, "dlltool", "-m", machine, "-d", str(definition), "-l", library],
            check=True,
        )
        linking = [library]
    return [*zig, "cc", "-target", TARGET, "-fno-sanitize=undefined", "-s", *linking]


class Build(build_ext):
    """Builds the modules, each by one command, at the same time; CC, CFLAGS and LDFLAGS are heeded."""

    def get_ext_filename(self, fullname: str) -> str:
        """The name of a module of the stable ABI on the target."""
        return os.path.join(*fullname.split(".")) + (
            ".pyd" if "windows" in TARGET else ".abi3.so"
        )

    def build_extensions(self) -> None:
        """Build all modules."""
        given = [
            shlex.split(os.environ.get(name, ""))
            for name in ("CPPFLAGS", "CFLAGS", "LDFLAGS")
        ]
        with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor() as pool:
            begun = command(folder)
            extra = [option for options in given for option in options]

            def build(module: Extension) -> None:
                name = module.name.rpartition(".")[2]
                path = pathlib.Path(self.get_ext_fullpath(module.name))
                path.parent.mkdir(parents=True, exist_ok=True)
                options = [
                    *FLAGS,
                    *(LEVELS if COMPILER else ZIG_LEVELS)[name],
                    f"-DMBMA_MODULE={name}",
                    *extra,
                ]
                line = [
                    *begun,
                    *options,
                    "-shared",
                    "-fPIC",
                    *module.sources,
                    "-o",
                    str(path),
                    "-lm",
                ]
                subprocess.run(line, check=True)

            list(pool.map(build, self.extensions))


if sys.implementation.name != "cpython" or sysconfig.get_config_var("Py_GIL_DISABLED"):
    sys.exit(
        "mbma_tables needs CPython with its global lock: the compiled core is of the stable ABI"
    )
modules = [
    Extension(
        f"mbma_tables.core.{name}",
        sorted(map(str, CORE.glob("*.c"))),
        py_limited_api=True,
    )
    for name in LEVELS
    if TARGET.startswith("x86_64") or name == "_plain"
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
    ext_modules=modules,
    cmdclass={"build_ext": Build},
    options={"bdist_wheel": {"py_limited_api": "cp311"}},
)
