"""The audit finds what is wrong, and nothing in what it was run on."""

import time

import numpy as np
import pytest

from generate import audit


@pytest.mark.parametrize("what", audit.BOUNDS)
def test_bounds_hold_in_a_short_search(what):
    (found,) = audit.bound(what, 7, 0.02)
    assert found.answers > 100
    assert found.beyond == 0


def test_a_bound_that_is_exceeded_is_counted_and_quoted(monkeypatch):
    monkeypatch.setitem(audit.BOUNDS, "too tight", (lambda surface, u, rtol: np.array([0.5, np.nan, 2.0]), 10, {}))
    (found,) = audit.bound("too tight", 1, 1.0)
    assert found.beyond == 2 * found.answers / 3
    assert "Surface(" in found.where


def test_untested_answers_and_bad_failures_are_found(monkeypatch):
    monkeypatch.setattr(audit, "LONGEST", 1.0)
    monkeypatch.setitem(audit.CALLS, "island", lambda *given, **options: time.sleep(1.1))
    monkeypatch.setitem(audit.CALLS, "surface", lambda *given: 1 / 0)
    monkeypatch.setitem(audit.CALLS, "sensitivity", lambda *given, **options: np.float64(1) / 0)
    warning, error, hang = audit.failures(1, 1e-3)
    assert all("1 / 0" not in each.where and each.beyond == 2 for each in (warning, error, hang))
    assert audit.validity(3, 0.02)[0].beyond == 0
