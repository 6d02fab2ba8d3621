"""The wheel, away from the checkout, does what the README shows; the source distribution is complete.

Built by the machine's compiler, by zig where there is none, and by zig for other machines.
"""

import os
import pathlib
import re
import subprocess
import sys
import tarfile
import zipfile

import pytest

from generate.wheels import SOURCE, build, faults

ROOT = pathlib.Path(__file__).parents[1]
pytestmark = pytest.mark.slow


def run(*command, **options):
    return subprocess.run(command, check=True, capture_output=True, text=True, **options)


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    source = tmp_path_factory.mktemp("source") / "clone"
    run("git", "clone", "--quiet", str(ROOT), str(source))
    return source


PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check")


def wheel_of(source, folder, **options):
    run(
        *PIP,
        "wheel",
        "--no-deps",
        "--no-build-isolation",
        "-w",
        str(folder),
        str(source),
        **options,
    )
    (wheel,) = folder.glob("*.whl")
    assert wheel.stat().st_size < 9e6
    assert "-cp311-abi3-" in wheel.name
    return wheel


@pytest.fixture(scope="module")
def site(source, tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    run(
        *PIP,
        "install",
        "--no-deps",
        "--target",
        str(folder / "site"),
        str(wheel_of(source, folder)),
    )
    return folder / "site"


def test_installed_wheel_runs_the_readme_command(site, tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(site)}
    where = run(
        sys.executable,
        "-c",
        "import mbma_tables; print(mbma_tables.__file__)",
        cwd=tmp_path,
        env=environment,
    )
    assert pathlib.Path(where.stdout.strip()).is_relative_to(site)
    curve = (
        "-m",
        "mbma_tables",
        "curve",
        "--surface",
        "concrete",
        "--points",
        "5",
        "--plot",
        "concrete.png",
    )
    shown = run(sys.executable, *curve, cwd=tmp_path, env=environment)
    assert "concrete road of Lorenz" in shown.stdout
    assert (tmp_path / "concrete.png").read_bytes().startswith(b"\x89PNG")


def test_the_readme_of_an_index_has_no_links_into_a_checkout(site):
    (metadata,) = site.glob("mbma_tables-*.dist-info/METADATA")
    text = metadata.read_text(encoding="utf-8")
    links = re.findall(r"\]\(([^)]*)\)", text)
    assert len(links) >= 4
    assert all(link.startswith("https://") for link in links)
    assert "## A bolted joint" in text


def test_source_distribution_holds_what_the_checkout_holds(tmp_path):
    archive = build(SOURCE, tmp_path)
    assert list(faults(archive, SOURCE)) == []
    with tarfile.open(tmp_path / "empty", "w:gz"):
        pass
    assert "README.md is missing" in list(faults(tmp_path / "empty", SOURCE))
    with zipfile.ZipFile(wheel_of(archive, tmp_path)) as packed:
        assert any(re.search(r"core/_plain\.\S+$", name) for name in packed.namelist())


def asked(source, **environment):
    """What the build backend asks for, and whether it asks for the same of an editable installation."""
    program = (
        "import build_backend as b; asked = b.get_requires_for_build_wheel(); "
        "assert asked == b.get_requires_for_build_editable(); print(*asked)"
    )
    said = run(
        sys.executable, "-c", program, cwd=source, env={**os.environ, **environment}
    ).stdout.splitlines()
    return [one for one in said[-1:] if "ziglang" in one]


@pytest.mark.skipif(sys.platform != "linux", reason="compilers are hidden by PATH")
def test_without_a_compiler(source, tmp_path):
    pytest.importorskip("ziglang")
    hidden = {"PATH": str(tmp_path / "empty"), "CC": ""}
    assert asked(source, **hidden)
    assert not asked(source, CC="cc")
    wheel = wheel_of(source, tmp_path, env={**os.environ, **hidden})
    run(*PIP, "install", "--no-deps", "--target", str(tmp_path / "site"), str(wheel))
    program = (
        "import mbma_tables.core as c; print(c.__file__, c.core.island_geometry.__name__)"
    )
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "site")}
    said = run(sys.executable, "-c", program, cwd=tmp_path, env=environment).stdout
    assert said.startswith(str(tmp_path))


@pytest.mark.skipif(sys.platform == "win32", reason="made on Linux")
def test_a_wheel_for_another_machine(tmp_path):
    pytest.importorskip("abi3audit", reason="of the extra wheels")
    wheel = build("manylinux2014_aarch64", tmp_path)
    assert list(faults(wheel, "manylinux2014_aarch64")) == []
    found = "; ".join(faults(wheel, "musllinux_1_2_x86_64"))
    for expected in ("it is not tagged", "its modules are"):
        assert expected in found
