"""The Python code of the README and of the pages runs, each page from top to bottom."""

import pathlib
import re

import pytest

ROOT = pathlib.Path(__file__).parents[1]
PAGES = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "README.md", *(ROOT / "docs").glob("*.md"))}
BLOCKS = {name: re.findall(r"```python\n(.*?)```", text, re.DOTALL) for name, text in PAGES.items()}


@pytest.mark.slow
@pytest.mark.parametrize("page", [name for name, blocks in BLOCKS.items() if blocks])
def test_code_of_a_page_runs(page, monkeypatch):
    pytest.importorskip("dask")
    pytest.importorskip("tamaas")
    monkeypatch.chdir(ROOT)
    names = {"__name__": "__main__"}
    for block in BLOCKS[page]:
        exec(block, names)


def test_the_first_steps_are_there():
    assert {"README.md", "lookup.md", "scenes.md"} <= {name for name, blocks in BLOCKS.items() if blocks}
