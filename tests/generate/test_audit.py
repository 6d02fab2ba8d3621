"""The audit finds what is wrong, and nothing in what it was run on; workers of a generator end with it."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generate import audit
from generate import audit_routes as routes
from mbma_tables import InputError
from mbma_tables.bodies.materials import METALS
from mbma_tables.common.errors import MbmaError


@pytest.mark.parametrize("what", audit.BOUNDS)
def test_bounds_hold_in_a_short_search(what):
    (found,) = audit.bound(what, 7, 0.02)
    assert found.answers > 100
    assert found.beyond == 0


def test_a_bound_that_is_exceeded_is_counted_and_quoted(monkeypatch):
    monkeypatch.setitem(
        audit.BOUNDS,
        "too tight",
        (lambda surface, u, rtol: np.array([0.5, np.nan, 2.0]), 10, {}),
    )
    (found,) = audit.bound("too tight", 1, 1.0)
    assert found.beyond == 2 * found.answers / 3
    assert "Surface(" in found.where


def test_untested_answers_and_bad_failures_are_found(monkeypatch):
    monkeypatch.setattr(audit, "LONGEST", 1.0)
    monkeypatch.setitem(audit.CALLS, "island", lambda *given, **options: time.sleep(1.1))
    monkeypatch.setitem(audit.CALLS, "surface", lambda *given: 1 / 0)
    monkeypatch.setitem(
        audit.CALLS, "sensitivity", lambda *given, **options: np.float64(1) / 0
    )
    warning, error, hang = audit.failures(1, 1e-3)
    assert all(
        "1 / 0" not in each.where and each.beyond == 2 for each in (warning, error, hang)
    )
    assert audit.validity(3, 0.02)[0].beyond == 0


@st.composite
def questions(draw):
    """Joints as people type them; pressures from light contact to half of the hardness."""
    longest = draw(st.floats(10, 1000))
    ratio = draw(st.floats(5, 300))
    part = st.fixed_dictionaries(
        {
            "Rq": st.floats(3e-4, 3e-3).map(lambda slope: f"{slope * longest!r} um"),
            "hurst": st.floats(0.15, 1.0),
            "longest": st.just(f"{longest!r} um"),
            "shortest": st.just(f"{longest / ratio!r} um"),
        }
    )
    form = draw(st.sampled_from(routes.FORMS))
    temper = " hard" if form == "metals" else ""
    metal = st.sampled_from(list(METALS)).map(lambda name: name + temper)
    E_star = draw(st.floats(0.01, 300))
    loads = st.lists(
        st.floats(-3, -0.3), min_size=routes.PRESSURES, max_size=routes.PRESSURES
    )
    return routes.Question(
        parts=tuple(draw(st.lists(part, min_size=1, max_size=2))),
        nominal_area=f"{(longest * draw(st.floats(2, 100))) ** 2!r} um^2",
        form=form,
        metals=(draw(metal), draw(metal)),
        E_star=E_star,
        hardness=E_star * draw(st.floats(1e-3, 0.3)),
        theory_name=draw(st.sampled_from(list(routes.THEORIES))),
        loads=tuple(10**exponent for exponent in sorted(draw(loads))),
    )


def check_routes(question):
    """Every route of a question: values within stated errors, the same `valid`, scatter and reasons."""
    try:
        reference = routes.Reference(question)
    except MbmaError:
        assert not routes.refusals(question).any()
        return
    differences = {}
    for name, route in routes.routes_here().items():
        for what, ratios in route(reference).items():
            if not (ratios <= 1).all():
                differences[name, what] = ratios
    assert not differences


@settings(max_examples=15)
@given(questions())
def test_every_route_answers_a_question_alike(question):
    check_routes(question)


@pytest.mark.slow
@settings(max_examples=50)
@given(questions())
def test_every_route_answers_many_questions_alike(question):
    check_routes(question)


def test_a_route_that_answers_otherwise_is_counted(monkeypatch):
    def wrong(reference):
        return reference.ratios({"area": np.asarray(reference.answer.area) * (1 + 1e-9)})

    def failing(reference):
        raise InputError("no such route")

    monkeypatch.setattr(audit, "routes_here", {"wrong": wrong, "failing": failing}.copy)
    monkeypatch.setattr(audit, "ROUTE_QUESTIONS", 1)
    by_wrong, by_failing = audit.routes(1, 1.0)
    assert by_wrong.beyond == by_wrong.answers == routes.PRESSURES
    assert by_wrong.worst == pytest.approx(1000, rel=1e-3)
    assert by_failing.beyond == 1
    assert by_failing.where.startswith("no such route: ")


@pytest.mark.skipif(not os.path.isdir("/proc"), reason="needs /proc")
def test_workers_end_with_a_killed_parent():
    code = (
        "import time\n"
        "from mbma_tables.common.workers import results\n"
        "if __name__ == '__main__':\n"
        "    for found in results('', eval, 2 * [(\"__import__('os').getpid()\",)], 2):\n"
        "        print(found, flush=True)\n"
        "        time.sleep(60)\n"
    )
    command = [sys.executable, "-W", "ignore", "-c", code]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as parent:
        worker = int(parent.stdout.readline())
        parent.send_signal(signal.SIGKILL)
    end = time.monotonic() + 20
    while os.path.isdir(f"/proc/{worker}") and time.monotonic() < end:
        time.sleep(0.1)
    assert not os.path.isdir(f"/proc/{worker}")
