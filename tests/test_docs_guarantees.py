"""Every promise, and every mend, names tests that are there."""

import pathlib
import re

import pytest

ROOT = pathlib.Path(__file__).parents[1]


@pytest.mark.parametrize(("page", "least"), [("guarantees", 20), ("stability", 10), ("tests", 2)])
def test_every_named_test_exists(page, least):
    text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`(tests/[a-z0-9_/]+\.py)(?:::(\w+))?`", text))
    assert len(named) > least
    files = {name: (ROOT / name).read_text(encoding="utf-8") for name, _ in named if (ROOT / name).is_file()}
    assert [name for name, _ in sorted(named) if name not in files] == []
    assert [test for name, test in sorted(named) if test and f"def {test}(" not in files[name]] == []
