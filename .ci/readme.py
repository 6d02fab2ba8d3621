#!/usr/bin/env python3
"""Run the commands of README's section "Installation" as they are printed there.

The repository around this file is cloned, as it is committed, in place of the address that README
leaves open, into a new folder with the name that README gives, and each command runs in a shell in
that folder. With an argument, the names of the tests that skipped are written to that file.
"""

import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
LARGEST = 800  # MB of the environment of the tests


def megabytes(folder: pathlib.Path) -> float:
    """The size of the files in a folder; links do not count."""
    files = [
        path for path in folder.rglob("*") if path.is_file() and not path.is_symlink()
    ]
    return sum(path.stat().st_size for path in files) / 1e6


def main() -> None:
    """Stop at the first command that fails."""
    readme = (ROOT / "README.md").read_text("utf-8")
    section = re.search(r"^## Installation\n(.*?)^## ", readme, re.DOTALL | re.MULTILINE)
    assert section, "README has no section Installation"
    clone, *commands = re.findall(r"^    (.+)$", section[1], re.MULTILINE)
    open_address = "<address of this repository>"
    assert open_address in clone, f"README does not clone {open_address}"
    assert len(commands) == 2, (
        f"README has {len(commands)} commands after the clone's, not 2"
    )
    cloning, _, entering = clone.replace(open_address, shlex.quote(str(ROOT))).partition(
        " && "
    )
    folder_name = shlex.split(entering)[-1]

    environment = dict(os.environ)
    for name in ("PYTHONPATH", "VIRTUAL_ENV"):
        environment.pop(name, None)
    if len(sys.argv) > 1:
        environment["MBMA_SKIPPED"] = os.path.abspath(sys.argv[1])
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as parent:
        subprocess.run(cloning, shell=True, check=True, cwd=parent, env=environment)
        checkout = pathlib.Path(parent, folder_name)
        for command in commands:
            print(f"$ {command}", flush=True)
            start = time.perf_counter()
            subprocess.run(command, shell=True, check=True, cwd=checkout, env=environment)
            size = megabytes(checkout / ".venv")
            print(
                f"{time.perf_counter() - start:.0f} s, {size:.0f} MB of .venv", flush=True
            )
            assert size <= LARGEST, (
                f"the environment takes {size:.0f} MB, more than {LARGEST}"
            )


if __name__ == "__main__":
    main()
