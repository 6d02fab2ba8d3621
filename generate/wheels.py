"""``python -m generate wheels``: a wheel for each platform, built by zig's compiler, the sources, and what is wrong."""

import os
import pathlib
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from collections.abc import Iterator

import click

from generate.files import ROOT

# a wheel's platform, and what zig calls it; of the C library's version, which it links against
PLATFORMS = {
    "manylinux2014_x86_64": "x86_64-linux-gnu.2.17",
    "manylinux2014_aarch64": "aarch64-linux-gnu.2.17",
    "musllinux_1_2_x86_64": "x86_64-linux-musl",
    "musllinux_1_2_aarch64": "aarch64-linux-musl",
    "macosx_10_13_x86_64": "x86_64-macos.10.13",
    "macosx_11_0_arm64": "aarch64-macos.11.0",
    "win_amd64": "x86_64-windows-gnu",
}
SOURCE = "source"
# bytes; of the sources' ten million, 5.3 are tables and 3 the documents' data and figures, which
# hardly compress: above these, a file went in by mistake
LARGEST_WHEEL = 7_000_000
LARGEST_SOURCE = 12_000_000


def faults(wheel: pathlib.Path, platform: str) -> Iterator[str]:
    """What is wrong with a wheel, symbols beyond Python's stable ABI included; or with the sources."""
    most = LARGEST_SOURCE if platform == SOURCE else LARGEST_WHEEL
    if wheel.stat().st_size > most:
        yield f"{wheel.stat().st_size} bytes are more than {most}"
    if platform == SOURCE:
        with tarfile.open(wheel) as archive:
            held = {name.partition("/")[2] for name in archive.getnames()}
        tracked = subprocess.run(
            ["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True
        ).stdout
        yield from (
            f"{name} is missing"
            for name in tracked.splitlines()
            if name[0] != "." and name not in held
        )
        return
    levels = (
        ["plain", "x86_64_v3", "x86_64_v4"]
        if PLATFORMS[platform].startswith("x86_64")
        else ["plain"]
    )
    suffix = ".pyd" if platform == "win_amd64" else ".abi3.so"
    with zipfile.ZipFile(wheel) as packed:
        names = packed.namelist()
        (about,) = (
            packed.read(name).decode()
            for name in names
            if name.endswith(".dist-info/WHEEL")
        )
    tag = f"cp311-abi3-{platform}"
    if (
        not wheel.name.endswith(f"-{tag}.whl")
        or f"Tag: {tag}\n" not in about
        or "Purelib: false" not in about
    ):
        yield f"it is not tagged {tag}"
    expected = [f"mbma_tables/core/_{level}{suffix}" for level in levels]
    if (
        found := sorted(
            name for name in names if name.endswith((".so", ".pyd", ".dylib", ".dll"))
        )
    ) != expected:
        yield f"its modules are {found}, not {expected}"
    audit = [
        sys.executable,
        "-m",
        "abi3audit",
        "--strict",
        "--verbose",
        "--assume-minimum-abi3",
        "3.11",
        str(wheel),
    ]
    audited = subprocess.run(audit, capture_output=True, text=True)
    if audited.returncode:
        yield " ".join((audited.stdout + audited.stderr).split())


def build(platform: str, out: pathlib.Path) -> pathlib.Path:
    """Build a wheel of the checkout for a platform, or its source distribution."""
    with tempfile.TemporaryDirectory() as folder:
        # nothing of another platform's build gets in
        where = ["build", "--build-base", folder, "egg_info", "--egg-base", folder]
        to = ["bdist_wheel", "--plat-name", platform, "--bdist-dir", f"{folder}/wheel"]
        to = [*(["sdist"] if platform == SOURCE else to), "--dist-dir", f"{folder}/dist"]
        # what zig makes of each platform's C library is kept, Windows' takes a minute
        kept = {
            f"ZIG_{name}_CACHE_DIR": str(ROOT / "build" / "zig")
            for name in ("GLOBAL", "LOCAL")
        }
        environment = (
            kept | os.environ | {"MBMA_TABLES_TARGET": PLATFORMS.get(platform, "")}
        )
        command = [sys.executable, "-W", "ignore", "setup.py", "--quiet", *where, *to]
        subprocess.run(command, cwd=ROOT, env=environment, check=True)
        (wheel,) = pathlib.Path(folder, "dist").iterdir()
        out.mkdir(parents=True, exist_ok=True)
        return pathlib.Path(shutil.move(wheel, out / wheel.name))


@click.command()
@click.argument(
    "platforms", nargs=-1, type=click.Choice([*PLATFORMS, SOURCE, "all"]), required=True
)
@click.option(
    "--out",
    type=click.Path(path_type=pathlib.Path, file_okay=False),
    default=ROOT / "dist",
    help="Folder.",
)
def wheels(platforms: tuple[str, ...], out: pathlib.Path) -> None:
    """Build wheels and the source distribution, and look into them; needs the extra "wheels"."""
    for platform in [*PLATFORMS, SOURCE] if "all" in platforms else platforms:
        wheel = build(platform, out)
        click.echo(f"{wheel} {wheel.stat().st_size / 1e6:.2f} MB")
        if found := list(faults(wheel, platform)):
            raise click.ClickException(f"{wheel.name}: {'; '.join(found)}")
