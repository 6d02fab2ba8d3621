"""The wheel, away from the checkout, does what the README shows."""

import os
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parents[1]


def run(*command, **options):
    return subprocess.run(command, check=True, capture_output=True, text=True, **options)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    run("git", "clone", "--quiet", str(ROOT), str(source))
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check")
    run(*pip, "wheel", "--no-deps", "--no-build-isolation", "-w", str(folder), str(source))
    (wheel,) = folder.glob("*.whl")
    run(*pip, "install", "--no-deps", "--target", str(folder / "site"), str(wheel))
    return folder / "site"


def test_installed_wheel_runs_the_readme_command(site, tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(site)}
    where = run(sys.executable, "-c", "import mbma_tables; print(mbma_tables.__file__)", cwd=tmp_path, env=environment)
    assert pathlib.Path(where.stdout.strip()).is_relative_to(site)
    shown = run(
        sys.executable,
        "-m",
        "mbma_tables",
        "curve",
        "--surface",
        "concrete",
        "--points",
        "5",
        "--plot",
        "concrete.png",
        cwd=tmp_path,
        env=environment,
    )
    assert "reading" in shown.stdout
    assert (tmp_path / "concrete.png").read_bytes().startswith(b"\x89PNG")
