"""The page on the model has every equation that the library cites, each once."""

import ast
import io
import pathlib
import re
import tokenize

import pytest

ROOT = pathlib.Path(__file__).parents[1]
NUMBER = r"(?:[BCD]\.)?\d+[ab]?"
CITATION = re.compile(rf"Eqs?\.\s+({NUMBER}(?:(?:, | and |, and |-){NUMBER})*)")
TAGS = re.findall(rf"\\tag{{({NUMBER})}}", (ROOT / "docs" / "model.md").read_text(encoding="utf-8"))


def prose(path):
    """Comments and strings of a module."""
    text = path.read_text(encoding="utf-8")
    yield from (
        token.string for token in tokenize.generate_tokens(io.StringIO(text).readline) if token.type == tokenize.COMMENT
    )
    yield from (
        node.value
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    )


def cited(text):
    """Numbers of equations in a text; a range stands for its members."""
    for listed in CITATION.findall(re.sub(r"\(|\)", "", text)):
        for part in re.split(r", and |, | and ", listed):
            ends = part.split("-")
            yield from map(str, range(int(ends[0]), int(ends[1]) + 1)) if len(ends) == 2 else ends


def test_equations_are_there_once():
    assert len(TAGS) == len(set(TAGS))
    assert {re.sub("[ab]", "", tag) for tag in TAGS} >= set(map(str, range(1, 52)))


@pytest.mark.parametrize("package", ["mbma_tables", "generate"])
def test_every_cited_equation_is_on_the_page(package):
    found = {
        (path.name, number) for path in (ROOT / package).rglob("*.py") for text in prose(path) for number in cited(text)
    }
    assert len(found) > 3
    missing = {(name, number) for name, number in found if number not in TAGS and f"{number}a" not in TAGS}
    assert missing == set()
