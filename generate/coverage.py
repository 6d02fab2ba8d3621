"""``python -m generate coverage``: which lines of the compiled core tests run, by gcov."""

from __future__ import annotations

import collections
import json
import os
import pathlib
import shutil
import subprocess
import sys
import sysconfig
import tempfile

import click

from generate.pages.page import ROOT


@click.command(context_settings={"ignore_unknown_options": True})
@click.argument("tests", nargs=-1, type=click.UNPROCESSED)
def coverage(tests: tuple[str, ...]) -> None:
    """Run pytest with the plain module built for gcov, and print the lines of C that were not run; needs gcc."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        shutil.copytree(ROOT / "mbma_tables", folder / "mbma_tables", ignore=shutil.ignore_patterns("__pycache__"))
        for other in ("docs", "tables"):
            (folder / other).symlink_to(ROOT / other)
        core = folder / "mbma_tables" / "core"
        # atomic: tests have threads
        options = ["-std=c11", "-O0", "-ffp-contract=off", "--coverage", "-fprofile-update=atomic", "-fPIC"]
        include = f"-I{sysconfig.get_path('include')}"
        sources = sorted(path.name for path in core.glob("*.c"))
        subprocess.run(["gcc", *options, include, "-DMBMA_MODULE=_plain", "-c", *sources], cwd=core, check=True)
        objects = [f"{pathlib.Path(source).stem}.o" for source in sources]
        (core / "_plain.abi3.so").unlink(missing_ok=True)
        subprocess.run(["gcc", "--coverage", "-shared", *objects, "-o", "_plain.abi3.so", "-lm"], cwd=core, check=True)
        paths = os.pathsep.join([name, os.environ.get("PYTHONPATH", "")])
        environment = os.environ | {"PYTHONPATH": paths, "MBMA_TABLES_CORE": "plain"}
        # -P: else the checkout would come first
        command = [sys.executable, "-P", "-m", "pytest", "-p", "no:cacheprovider", *tests]
        code = subprocess.run(command, cwd=ROOT, env=environment, check=False).returncode
        runs: dict[str, collections.Counter[int]] = collections.defaultdict(collections.Counter)
        for data in sorted(core.glob("*.gcda")):
            counted = subprocess.run(
                ["gcov", "--json-format", "--stdout", data.name], cwd=core, check=True, capture_output=True
            )
            for file in json.loads(counted.stdout)["files"]:
                for line in file["lines"]:
                    runs[file["file"]][line["line_number"]] += line["count"]
        for file, lines in sorted(runs.items()):
            missed = sorted(line for line, count in lines.items() if count == 0)
            share = 1 - len(missed) / len(lines)
            click.echo(f"{file:24}{len(lines):6}{share:8.1%}  {', '.join(map(str, missed))}")
    sys.exit(code)
