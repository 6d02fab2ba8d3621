"""``python -m generate wheels``: a wheel for each platform, built by zig's compiler, the sources, and what is wrong."""

from __future__ import annotations

import os
import pathlib
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from generate.files import ROOT

if TYPE_CHECKING:
    import lief

# a wheel's platform, what zig calls it, and the libraries that its modules may ask for
LINUX, MUSL, MACOS = ("libc.so.6", "libm.so.6"), ("libc.so",), ("/usr/lib/libSystem.B.dylib",)
PLATFORMS = {
    "manylinux2014_x86_64": ("x86_64-linux-gnu.2.17", LINUX),
    "manylinux2014_aarch64": ("aarch64-linux-gnu.2.17", LINUX),
    "musllinux_1_2_x86_64": ("x86_64-linux-musl", MUSL),
    "musllinux_1_2_aarch64": ("aarch64-linux-musl", MUSL),
    "macosx_10_13_x86_64": ("x86_64-macos.10.13", MACOS),
    "macosx_11_0_arm64": ("aarch64-macos.11.0", MACOS),
    "win_amd64": ("x86_64-windows-gnu", ("python3.dll", "KERNEL32.dll", "api-ms-win-crt-")),
}
SOURCE = "source"
PYTHON, GLIBC, LARGEST = (3, 11), (2, 17), 9_000_000


def parts(data: bytes) -> tuple[str, list[str], list[str], dict[str, str]]:
    """Of a module of any platform: its processor, the libraries it asks for, what it offers, what it wants and of whom.

    What is resolved by the interpreter that loads the module, whatever its file is called, is wanted of "".
    """
    import lief

    lief.logging.disable()
    module = lief.parse(list(data))
    if isinstance(module, lief.ELF.Binary):
        symbols = [symbol for symbol in module.dynamic_symbols if symbol.name]
        libraries = [str(library) for library in module.libraries]
        offered = [str(symbol.name) for symbol in symbols if symbol.shndx]
        wanted = {str(symbol.name): _version(symbol) for symbol in symbols if not symbol.shndx}
    elif isinstance(module, lief.MachO.Binary):
        own = lief.MachO.LoadCommand.TYPE.ID_DYLIB
        libraries = [library.name for library in module.libraries if library.command != own]
        offered = [str(symbol.name)[1:] for symbol in module.exported_symbols]
        bound = [(one.symbol, one.library) for one in module.bindings if one.symbol]
        wanted = {str(symbol.name)[1:]: library.name if library else "" for symbol, library in bound}
    elif isinstance(module, lief.PE.Binary):
        libraries = [str(library.name) for library in module.imports]
        offered = [str(function.name) for function in module.exported_functions]
        names = [(str(entry.name), str(library.name)) for library in module.imports for entry in library.entries]
        wanted = {name: library.replace("python3.dll", "") for name, library in names}
    else:
        raise click.ClickException("not a module of a known platform")
    return module.abstract.header.architecture.name, libraries, offered, wanted


def _version(symbol: lief.ELF.Symbol) -> str:
    version = symbol.symbol_version if symbol.has_version else None
    auxiliary = version.symbol_version_auxiliary if version else None
    return str(auxiliary.name) if auxiliary else ""


def _stable(name: str) -> bool:
    import abi3info

    known = abi3info.FUNCTIONS | abi3info.DATAS
    found = known.get(abi3info.models.Symbol(name))
    return found is not None and (found.added.major, found.added.minor) <= PYTHON


def faults(wheel: pathlib.Path, platform: str) -> Iterator[str]:
    """What is wrong with a wheel, or would keep it from being loaded somewhere on its platform; or with the sources."""
    if wheel.stat().st_size > LARGEST:
        yield f"{wheel.stat().st_size} bytes are more than {LARGEST}"
    if platform == SOURCE:
        with tarfile.open(wheel) as archive:
            held = {name.partition("/")[2] for name in archive.getnames()}
        tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
        yield from (f"{name} is missing" for name in tracked.splitlines() if name[0] != "." and name not in held)
        return
    target, allowed = PLATFORMS[platform]
    levels = ["plain", "x86_64_v3", "x86_64_v4"] if target.startswith("x86_64") else ["plain"]
    suffix = ".pyd" if "windows" in target else ".abi3.so"
    with zipfile.ZipFile(wheel) as packed:
        files = {name: packed.read(name) for name in packed.namelist()}
    (about,) = (text.decode() for name, text in files.items() if name.endswith(".dist-info/WHEEL"))
    tag = f"cp311-abi3-{platform}"
    if not wheel.name.endswith(f"-{tag}.whl") or f"Tag: {tag}\n" not in about or "Purelib: false" not in about:
        yield f"it is not tagged {tag}"
    expected = [f"mbma_tables/core/_{level}{suffix}" for level in levels]
    if (found := sorted(name for name in files if name.endswith((".so", ".pyd", ".dylib", ".dll")))) != expected:
        yield f"its modules are {found}, not {expected}"
    for name in set(found) & set(expected):
        processor, libraries, offered, wanted = parts(files[name])
        if processor != ("X86_64" if target.startswith("x86_64") else "ARM64"):
            yield f"{name} is for {processor}"
        if f"PyInit_{pathlib.PurePath(name).name.removesuffix(suffix)}" not in offered:
            yield f"{name} offers {offered}"
        yield from (f"{name} asks for {library}" for library in libraries if not library.startswith(allowed))
        for symbol, source in wanted.items():
            if symbol.startswith(("Py", "_Py")):
                right = source == "" and _stable(symbol)
            elif "gnu.2" in target:
                right = source.startswith("GLIBC_") and tuple(map(int, source[6:].split("."))) <= GLIBC
            else:
                right = not symbol.startswith("mbma") and (allowed is MUSL or source != "")
            if not right:
                yield f"{name} wants {symbol} {source}"


def build(platform: str, out: pathlib.Path) -> pathlib.Path:
    """Build a wheel of the checkout for a platform, or its source distribution."""
    with tempfile.TemporaryDirectory() as folder:
        # nothing of another platform's build gets in
        where = ["build", "--build-base", folder, "egg_info", "--egg-base", folder]
        to = ["bdist_wheel", "--plat-name", platform, "--bdist-dir", f"{folder}/wheel"]
        to = [*(["sdist"] if platform == SOURCE else to), "--dist-dir", f"{folder}/dist"]
        # what zig makes of each platform's C library is kept, Windows' takes a minute
        kept = {f"ZIG_{name}_CACHE_DIR": str(ROOT / "build" / "zig") for name in ("GLOBAL", "LOCAL")}
        environment = kept | os.environ | {"MBMA_TABLES_TARGET": PLATFORMS.get(platform, ("",))[0]}
        command = [sys.executable, "-W", "ignore", "setup.py", "--quiet", *where, *to]
        subprocess.run(command, cwd=ROOT, env=environment, check=True)
        (wheel,) = pathlib.Path(folder, "dist").iterdir()
        out.mkdir(parents=True, exist_ok=True)
        return pathlib.Path(shutil.move(wheel, out / wheel.name))


@click.command()
@click.argument("platforms", nargs=-1, type=click.Choice([*PLATFORMS, SOURCE, "all"]), required=True)
@click.option("--out", type=click.Path(path_type=pathlib.Path, file_okay=False), default=ROOT / "dist", help="Folder.")
def wheels(platforms: tuple[str, ...], out: pathlib.Path) -> None:
    """Build wheels and the source distribution, and look into them; needs the extra "wheels"."""
    for platform in [*PLATFORMS, SOURCE] if "all" in platforms else platforms:
        wheel = build(platform, out)
        click.echo(f"{wheel} {wheel.stat().st_size / 1e6:.2f} MB")
        if found := list(faults(wheel, platform)):
            raise click.ClickException(f"{wheel.name}: {'; '.join(found)}")
