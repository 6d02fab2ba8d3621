"""The expression language: against Python's own arithmetic, and what it refuses."""

import contextlib
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mbma_tables import TableFileError
from mbma_tables.formulas import expressions
from mbma_tables.formulas.expressions import evaluate_steps, names_in, parse

FINE = [
    ("-X**2", lambda X, y: -(X**2)),
    ("2**-y", lambda X, y: 2**-y),
    ("X - (y - 1)", lambda X, y: X - (y - 1)),
    ("X/y/2", lambda X, y: X / y / 2),
    ("X/(y/2)", lambda X, y: X / (y / 2)),
    ("X**y**0.5", lambda X, y: X**y**0.5),
    ("exp(-X) + log(y)*sqrt(X)", lambda X, y: math.exp(-X) + math.log(y) * math.sqrt(X)),
    ("min(X, y) - max(X, 1e-3)", lambda X, y: min(X, y) - max(X, 1e-3)),
    ("select(X - y, X, -y)", lambda X, y: X if X - y > 0 else -y),
    ("X**3 + y**8", lambda X, y: X**3 + y**8),
]


@pytest.mark.parametrize(("text", "plain"), FINE, ids=[text for text, _ in FINE])
@given(X=st.floats(1e-3, 1e3), y=st.floats(1e-2, 20))
def test_against_plain_python(text, plain, X, y):
    found = evaluate_steps([["r", text]], {"X": np.array([X]), "y": np.array([y])}, ["r"])["r"][0]
    expected = plain(X, y)
    scale = abs(expected) + abs(X) + abs(y) if "-" in text or "+" in text else abs(expected)
    assert abs(found - expected) <= 1e-14 * scale


BAD = [
    "__import__('os').system('true')",
    "X.real",
    "X[0]",
    "lambda: 1",
    "[X]",
    "X if X else y",
    "X < 1",
    "X % 2",
    "X // 2",
    "f(X)",
    "exp(X, X)",
    "exp(X=1)",
    "exp(*X)",
    "'text'",
    "True",
    "1j",
    "1e999",
    "+X",
    "~X",
    "X := 1",
    "",
    "X y",
    "(" * 5000,
    "-" * 300 + "X",
    "+".join(["X"] * 6000),
    "X\x00",
]


@pytest.mark.parametrize("text", BAD, ids=range(len(BAD)))
def test_what_is_no_expression(text):
    with pytest.raises(TableFileError):
        parse(text)


@given(st.text(max_size=40))
def test_any_text_is_parsed_or_refused(text):
    with contextlib.suppress(TableFileError):
        names_in(parse(text))


def test_only_needed_steps_run():
    steps = [["a", "X + 1"], ["b", "log(X - 5)"], ["c", "a*a"]]
    assert [name for name, _ in expressions.needed(steps, ["c"])] == ["a", "c"]


def test_chunks_do_not_matter(monkeypatch):
    X = np.linspace(0.1, 9, 1000)
    steps = [["a", "exp(-X)*X**2.5"], ["b", "select(a - 0.2, a, sqrt(X))"]]
    whole = evaluate_steps(steps, {"X": X}, ["b"])["b"]
    monkeypatch.setattr(expressions, "CHUNK", 7)
    np.testing.assert_array_equal(evaluate_steps(steps, {"X": X}, ["b"])["b"], whole)
