"""The wheel, away from the checkout, does what the README shows; the source distribution is complete."""

import os
import pathlib
import re
import subprocess
import sys
import tarfile

import pytest

ROOT = pathlib.Path(__file__).parents[1]
pytestmark = pytest.mark.slow


def run(*command, **options):
    return subprocess.run(command, check=True, capture_output=True, text=True, **options)


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    source = tmp_path_factory.mktemp("source") / "clone"
    run("git", "clone", "--quiet", str(ROOT), str(source))
    return source


@pytest.fixture(scope="module")
def site(source, tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check")
    run(*pip, "wheel", "--no-deps", "--no-build-isolation", "-w", str(folder), str(source))
    (wheel,) = folder.glob("*.whl")
    assert wheel.stat().st_size < 8e6
    run(*pip, "install", "--no-deps", "--target", str(folder / "site"), str(wheel))
    return folder / "site"


def test_installed_wheel_runs_the_readme_command(site, tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(site)}
    where = run(sys.executable, "-c", "import mbma_tables; print(mbma_tables.__file__)", cwd=tmp_path, env=environment)
    assert pathlib.Path(where.stdout.strip()).is_relative_to(site)
    curve = ("-m", "mbma_tables", "curve", "--surface", "concrete", "--points", "5", "--plot", "concrete.png")
    shown = run(sys.executable, *curve, cwd=tmp_path, env=environment)
    assert "reading" in shown.stdout
    assert (tmp_path / "concrete.png").read_bytes().startswith(b"\x89PNG")


def test_the_readme_of_an_index_has_no_links_into_a_checkout(site):
    (metadata,) = site.glob("mbma_tables-*.dist-info/METADATA")
    text = metadata.read_text(encoding="utf-8")
    links = re.findall(r"\]\(([^)]*)\)", text)
    assert len(links) >= 4
    assert all(link.startswith("https://") for link in links)
    assert "## Three recipes" in text


def test_source_distribution_holds_what_the_checkout_holds(source, tmp_path):
    program = f"from setuptools.build_meta import build_sdist; build_sdist({str(tmp_path)!r})"
    run(sys.executable, "-c", program, cwd=source)
    (archive,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(archive) as packed:
        held = {name.partition("/")[2] for name in packed.getnames()}
    tracked = run("git", "ls-files", cwd=source).stdout.splitlines()
    assert [name for name in tracked if not name.startswith(".") and name not in held] == []
