"""The examples of all docstrings run."""

import doctest
import importlib
import pkgutil

import pytest

import mbma_tables

MODULES = [m.name for m in pkgutil.walk_packages(mbma_tables.__path__, "mbma_tables.") if "__main__" not in m.name]


@pytest.mark.parametrize("name", MODULES)
def test_examples_of(name):
    module = importlib.import_module(name)
    found = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
    assert found.failed == 0


def test_public_names_have_examples():
    finder = doctest.DocTestFinder()
    public = ("Surface", "contact", "contact_law", "island", "open_table", "Scene", "height_integral")
    assert [n for n in public if not any(test.examples for test in finder.find(getattr(mbma_tables, n), n))] == []
