"""``python -m generate coverage``: which lines of the compiled core tests run, by gcov."""

import collections
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import click

from generate.files import ROOT


@click.command(context_settings={"ignore_unknown_options": True})
@click.argument("tests", nargs=-1, type=click.UNPROCESSED)
def coverage(tests: tuple[str, ...]) -> None:
    """Run pytest with the plain module built for gcov, and print the lines of C that were not run; needs gcc."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        shutil.copytree(ROOT / "mbma_tables", folder / "mbma_tables", ignore=shutil.ignore_patterns("__pycache__"))
        for other in ("docs", "tables", "setup.py", "build_backend.py", "pyproject.toml", "README.md", "LICENSE"):
            (folder / other).symlink_to(ROOT / other)
        # atomic: tests have threads
        given = {"CC": "gcc", "CFLAGS": "-O0 --coverage -fprofile-update=atomic", "MBMA_TABLES_CORE": "plain"}
        build = [sys.executable, "-W", "ignore", "setup.py", "--quiet", "build_ext", "--inplace"]
        subprocess.run(build, cwd=folder, env=os.environ | given, check=True)
        paths = os.pathsep.join([name, os.environ.get("PYTHONPATH", "")])
        environment = os.environ | given | {"PYTHONPATH": paths}
        # -P: else the checkout would come first
        command = [sys.executable, "-P", "-m", "pytest", "-p", "no:cacheprovider", *tests]
        code = subprocess.run(command, cwd=ROOT, env=environment, check=False).returncode
        runs: dict[str, collections.Counter[int]] = collections.defaultdict(collections.Counter)
        for data in sorted(folder.rglob("*.gcda")):
            line = ["gcov", "--json-format", "--stdout", str(data)]
            counted = subprocess.run(line, cwd=folder, check=True, capture_output=True)
            for file in json.loads(counted.stdout)["files"]:
                for line in file["lines"] if file["file"].startswith("mbma_tables") else ():
                    runs[pathlib.Path(file["file"]).name][line["line_number"]] += line["count"]
        for file, lines in sorted(runs.items()):
            missed = sorted(line for line, count in lines.items() if count == 0)
            share = 1 - len(missed) / len(lines)
            click.echo(f"{file:24}{len(lines):6}{share:8.1%}  {', '.join(map(str, missed))}")
    sys.exit(code)
