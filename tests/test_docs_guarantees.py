"""Every promise names tests that are there."""

import pathlib
import re

ROOT = pathlib.Path(__file__).parents[1]


def test_every_named_test_exists():
    named = set(re.findall(r"`(tests/[a-z0-9_/]+\.py)`", (ROOT / "docs" / "guarantees.md").read_text()))
    assert len(named) > 20
    assert [name for name in sorted(named) if not (ROOT / name).is_file()] == []
