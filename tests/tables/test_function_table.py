"""Tables of any function: targets on points that nothing saw, bounds, derivatives, inverses, pieces, bad functions."""

import json
import os
import pathlib
import pickle
import subprocess
import sys
import time

import mpmath
import numpy as np
import pytest
import tabulated
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from mbma_tables import InputError, OutOfRangeError, TableFileError, open_table
from mbma_tables.cli import main
from mbma_tables.common.errors import UncertifiedError
from mbma_tables.common.workers import crew
from mbma_tables.tables import make_function
from mbma_tables.tables.boxes import (
    MOST_HALVINGS,
    TRIMMED,
    Aim,
    Box,
    Piece,
)
from mbma_tables.tables.make_function import make, merge, verified_errors, wanted_of

UNIT = {"low": 0.0, "high": 1.0}
TWO = {"x": {"low": 0.01, "high": 10.0, "transform": "log"}, "y": UNIT}
SMOOTH = {
    "function": "tabulated:smooth",
    "axes": TWO,
    "outputs": {"u": {"unit": "N"}, "v": {"error": "absolute"}},
    "certificate_points": 1000,
}
FUNCTIONS = {
    "smooth": (SMOOTH, 1e-8),
    "kinked": ({"axes": {"x": UNIT, "y": UNIT}}, 1e-6),
    "steep": (
        {"axes": {"x": UNIT, "y": UNIT}, "outputs": {"s": {"error": "absolute"}}},
        1e-6,
    ),
    "periodic": (
        {"axes": {"x": UNIT | {"outside": "periodic"}, "y": UNIT, "z": UNIT}},
        1e-6,
    ),
    "four": ({"axes": dict.fromkeys("xyzw", UNIT)}, 1e-6),
    "six": ({"axes": dict.fromkeys("abcdef", UNIT)}, 1e-4),
}


def made(folder, function, entries, target=None, **options):
    wanted = wanted_of({"function": f"tabulated:{function}", **entries}, target=target)
    return make(wanted, folder / "t.nc", **options)


@pytest.fixture(scope="module")
def smooth(tmp_path_factory):
    return made(tmp_path_factory.mktemp("smooth"), "smooth", SMOOTH, 1e-8)


def errors_of(table, count, seed=11):
    """Largest error over its target, and how many exceed their bound, of points that no part of a table saw."""
    worst = np.zeros(len(table.outputs))
    above = 0
    for block in verified_errors(table, count, seed):
        error, bound, size = block.swapaxes(0, 1)
        relative = [output.error == "relative" for output in table.outputs]
        scale = np.where(np.array(relative)[:, None], size, 1.0)
        worst = np.maximum(worst, (error / scale).max(axis=1))
        above += int((error > bound).any(axis=0).sum())
    return worst, above


@pytest.mark.parametrize("function", FUNCTIONS)
def test_targets_hold_on_points_that_nothing_saw(function, tmp_path):
    entries, target = FUNCTIONS[function]
    table = made(tmp_path, function, entries, target)
    worst, above = errors_of(table, 20_000)
    assert (worst <= target).all()
    assert above == 0


@pytest.mark.slow
@pytest.mark.parametrize("function", FUNCTIONS)
def test_targets_hold_on_many_points(function, tmp_path):
    entries, target = FUNCTIONS[function]
    table = made(tmp_path, function, entries, target)
    # a lookup of six axes takes 10 us; `python -m benchmarks functions` has a million of it
    points = 1_000_000 if len(table.axes) < 6 else 100_000
    worst, above = errors_of(table, points, seed=12)
    assert (worst <= target).all()
    assert above <= 10  # and none above the target


@pytest.mark.slow
def test_the_island_problem_as_a_users_function(tmp_path):
    """On the axes of the shipped four-number table: certified, and its largest error beside that table's."""
    axes = {
        "X": {"low": 0.05, "high": 20.0, "transform": "log", "offset": 1.5},
        "spread": {"low": 1e-3, "high": 10.0, "transform": "log"},
        "sphere": UNIT,
        "hurst": {"low": 0.5, "high": 1.0},
    }
    table = made(
        tmp_path, "island", {"axes": axes, "outputs": {"F": {}, "A": {}}}, 1e-4, workers=2
    )
    worst, above = errors_of(table, 20_000)
    assert (worst <= 1e-4).all()
    assert above == 0


def test_derivatives_are_within_their_bounds(smooth):
    draws = np.random.default_rng(3)
    x, y = np.exp(draws.uniform(np.log(0.01), np.log(10), 5000)), draws.random(5000)
    found = smooth.lookup(x, y, derivatives=1)
    u = np.exp(x * y / 5) * x**1.5
    exact = {
        ("u", "x"): u * (y / 5 + 1.5 / x),
        ("u", "y"): u * x / 5,
        ("v", "x"): np.cos(x) * y,
        ("v", "y"): np.sin(x),
    }
    for (output, axis), expected in exact.items():
        error = np.abs(found.derivatives[output][axis] - expected)
        assert (error <= found.derivative_error[output][axis]).all()
        assert (error <= 1e-5 * np.abs(expected).max()).all()


def test_an_inverse_is_within_its_bound(smooth):
    draws = np.random.default_rng(4)
    x, y = np.exp(draws.uniform(np.log(0.01), np.log(10), 300)), draws.random(300)
    u = tabulated.smooth(x, y)[0]
    inside = (u > 1.0001 * u.min()) & (u < 0.9999 * u.max())
    found, error = smooth.inverse("x", u=u[inside], y=y[inside])
    assert (np.abs(found - x[inside]) <= error).all()
    assert (error <= 1e-6 * x[inside]).all()
    one, _ = smooth.inverse("x", u=float(u[0]), y=float(y[0]))
    assert np.ndim(one) == 0
    assert abs(one / x[0] - 1) < 1e-7


def test_an_inverse_leads_back_to_rounding_and_does_not_depend_on_the_batch(smooth):
    """Also of a power whose value is not stored by its logarithm."""
    draws = np.random.default_rng(8)
    x, y = np.exp(draws.uniform(np.log(0.02), np.log(9), 2000)), draws.random(2000)
    u = tabulated.smooth(x, y)[0]
    found, error = smooth.inverse("x", u=u, y=y)
    np.testing.assert_allclose(smooth.lookup(found, y)["u"], u, rtol=1e-14)
    for k in range(0, 2000, 97):
        assert smooth.inverse("x", u=u[k], y=y[k]) == (found[k], error[k])
    # the ends themselves are reached
    for end in (axis := smooth.axes[0]).low, axis.high:
        there = smooth.inverse("x", u=smooth.lookup(end, y)["u"], y=y)[0]
        np.testing.assert_allclose(there, end, rtol=1e-13)


def test_derivatives_and_inverses_beside_thirty_digits(tmp_path):
    """By mpmath on the formulas: each within its bound, derivatives also to 1e-9."""
    entries = SMOOTH | {"outputs": {"u": {}, "v": {"error": "absolute"}}}
    table = made(tmp_path, "smooth", entries, 1e-12)
    draws = np.random.default_rng(9)
    x, y = np.exp(draws.uniform(np.log(0.01), np.log(10), 60)), draws.random(60)
    found = table.lookup(x, y, derivatives=1)
    wanted = tabulated.smooth(x, y)[0]
    inverse, inverse_error = table.inverse("x", u=wanted, y=y)
    formulas = {
        "u": lambda a, b: mpmath.exp(a * b / 5) * a ** mpmath.mpf(1.5),
        "v": lambda a, b: mpmath.sin(a) * b,
    }
    with mpmath.workdps(30):
        for k, point in enumerate(
            zip(map(mpmath.mpf, x), map(mpmath.mpf, y), strict=True)
        ):
            for name, formula in formulas.items():
                off = abs(float(found[name][k] - formula(*point)))
                assert off <= found.error[name][k] <= 1e-6
                for axis, orders in {"x": (1, 0), "y": (0, 1)}.items():
                    exact = mpmath.diff(formula, point, orders)
                    off = abs(float(found.derivatives[name][axis][k] - exact))
                    assert off <= found.derivative_error[name][axis][k]
                    assert off <= 1e-9 * max(1.0, abs(exact))
            b, u = point[1], mpmath.mpf(wanted[k])
            exact = mpmath.findroot(lambda a, b=b, u=u: formulas["u"](a, b) - u, point[0])
            off = abs(float(mpmath.mpf(inverse[k]) - exact))
            assert off <= inverse_error[k] <= 1e-9 * x[k]


def test_an_inverse_of_what_turns_back_or_is_not_reached_is_refused(smooth):
    with pytest.raises(InputError, match="no inverse"):
        smooth.inverse("x", v=0.2, y=0.5)
    with pytest.raises(OutOfRangeError, match="u must be within"):
        smooth.inverse("x", u=1e9, y=0.5)
    with pytest.raises(InputError, match="one of u, v"):
        smooth.inverse("x", y=0.5)


def test_answers_broadcast_and_take_names(smooth):
    grid = smooth.lookup(np.array([[0.5], [2.0]]), y=[0.0, 0.5, 1.0])
    assert grid["u"].shape == (2, 3)
    assert grid["u"][1, 2] == smooth.lookup(2.0, 1.0)["u"]
    with pytest.raises(InputError, match="did you mean"):
        smooth.lookup(0.5, yy=0.1)
    with pytest.raises(InputError, match="y is missing"):
        smooth.lookup(0.5)
    with pytest.raises(OutOfRangeError, match=r"x must be in \[0.01, 10\]"):
        smooth.lookup(11.0, 0.5)


def test_a_point_has_the_same_bits_among_any_others(tmp_path):
    """Points of many cells in any order, some outside and some in a box without an answer, beside one at a time."""
    entries = {
        "axes": {"x": UNIT | {"outside": "nan"}, "y": UNIT | {"outside": "periodic"}},
        "outputs": {"a": {}, "b": {"transform": "log"}},
        "on_failure": "mark",
    }
    table = made(tmp_path, "holed", entries, 1e-3)
    draws = np.random.default_rng(6)
    x, y = draws.uniform(-0.1, 1.1, 7000), draws.uniform(-1, 2, 7000)
    x[:3000] = draws.uniform(0.24, 0.26, 3000)
    many = table.lookup(x, y, derivatives=1)
    for k in range(0, 7000, 70):
        one = table.lookup(x[k], y[k], derivatives=1)
        for name in ("a", "b"):
            np.testing.assert_equal(one[name], many[name][k])
            np.testing.assert_equal(one.error[name], many.error[name][k])
            for axis, slope in one.derivatives[name].items():
                np.testing.assert_equal(slope, many.derivatives[name][axis][k])
    assert 0.2 < np.isnan(many["a"]).mean() < 0.5
    assert np.isnan(many["b"][(x < 0) | (x > 1)]).all()


def test_labelled_arguments_give_labelled_answers(smooth):
    xr = pytest.importorskip("xarray")
    x = xr.DataArray([0.5, 1.0], dims="load")
    y = xr.DataArray([0.1, 0.2, 0.3], dims="place")
    found = smooth.lookup(x, y)
    assert found["u"].dims == ("load", "place")
    assert found["u"].attrs["units"] == "N"
    data = smooth.to_dataset(x=[0.5, 1.0], y=0.2)
    assert float(data["u"].sel(x=0.5, y=0.2)) == smooth.lookup(0.5, 0.2)["u"]


def test_a_file_explains_itself_and_opens_again(smooth, tmp_path):
    again = pickle.loads(pickle.dumps(smooth))
    assert again.lookup(0.3, 0.4)["u"] == smooth.lookup(0.3, 0.4)["u"]
    table = made(tmp_path, "four", FUNCTIONS["four"][0], 1e-3)
    opened = open_table(tmp_path / "t.nc")
    assert (
        opened.lookup(0.1, 0.2, 0.3, 0.4)["value"]
        == table.lookup(0.1, 0.2, 0.3, 0.4)["value"]
    )
    certificate = json.loads(opened.attributes["certificate"])
    assert certificate["largest_error"]["value"] <= 1e-3
    assert f"error value {certificate['largest_error']['value']:.2g}" in repr(opened)
    content = (tmp_path / "t.nc").read_bytes()
    for damaged in (content[:-200], content[:500] + b"x" + content[501:]):
        (tmp_path / "bad.nc").write_bytes(damaged)
        with pytest.raises(TableFileError, match=r"make|rebuild"):
            open_table(tmp_path / "bad.nc")


def test_a_table_of_a_function_is_no_island_model(tmp_path):
    from mbma_tables import Surface, contact
    from mbma_tables.theories import Mbma

    made(tmp_path, "four", FUNCTIONS["four"][0], 1e-3)
    with pytest.raises(TableFileError, match="holds a table of kind 'function'"):
        contact(
            Surface(0.8, 1.0, 200.0, 0.1, 0.3),
            separation=0.1,
            theory=Mbma(island_model=str(tmp_path / "t.nc")),
        )


def test_policies_of_axes(tmp_path):
    axes = {
        "x": UNIT | {"outside": "periodic"},
        "y": UNIT | {"outside": "nearest"},
        "z": UNIT | {"outside": "nan"},
    }
    table = made(tmp_path, "periodic", {"axes": axes}, 1e-6)
    base = table.lookup(0.25, 1.0, 0.5)["value"]
    assert table.lookup(2.25, 1.0, 0.5)["value"] == pytest.approx(base, rel=1e-12)
    found = table.lookup(0.25, 7.0, 0.5, derivatives=1)
    assert found["value"] == base
    assert found.derivatives["value"]["y"] == 0
    assert np.isnan(table.lookup(0.25, 1.0, 1.5)["value"])


def bits(path):
    table = open_table(path)
    return [table.arrays[name].tobytes() for name in sorted(table.arrays)]


def test_tables_are_the_same_by_one_process_two_or_in_parts(tmp_path):
    wanted = wanted_of(SMOOTH, target=1e-6)
    for name, options in {"one.nc": {}, "two.nc": {"workers": 2}}.items():
        make(wanted, tmp_path / name, **options)
    for part in (1, 2, 3):
        assert make(wanted, tmp_path / "parts.nc", part=(part, 3)) is None
    merge(tmp_path / "parts.nc", [tmp_path / "parts.nc.pieces"])
    assert (
        bits(tmp_path / "one.nc")
        == bits(tmp_path / "two.nc")
        == bits(tmp_path / "parts.nc")
    )


def test_parts_of_other_configurations_and_missing_pieces_are_refused(tmp_path):
    make(wanted_of(SMOOTH, target=1e-6), tmp_path / "a.nc", part=(1, 2))
    make(wanted_of(SMOOTH, target=1e-5), tmp_path / "b.nc", part=(2, 2))
    folders = [tmp_path / "a.nc.pieces", tmp_path / "b.nc.pieces"]
    with pytest.raises(InputError, match=r"another configuration .* differ in target"):
        merge(tmp_path / "c.nc", folders)
    with pytest.raises(InputError, match="8 of 16 pieces are not finished"):
        merge(tmp_path / "c.nc", folders[:1])
    with pytest.raises(InputError, match="holds no pieces"):
        merge(tmp_path / "c.nc", [tmp_path])
    with pytest.raises(InputError, match="another configuration, with other target:"):
        make(wanted_of(SMOOTH, target=1e-4), tmp_path / "a.nc", resume=True)
    assert not (tmp_path / "c.nc").exists()


@pytest.mark.parametrize("end", [3, 60])
def test_a_run_that_was_killed_goes_on(end, tmp_path, monkeypatch):
    """After SIGKILL in some call of the function: the same bits, and finished pieces are not made again."""
    slow = SMOOTH | {"function": "tabulated:slow", "pieces": 4, "chunk": 64}
    config = tmp_path / "axes.json"
    config.write_text(json.dumps(slow))
    program = (
        "import json, pathlib, sys; from mbma_tables.tables.make_function import make, wanted_of; "
        "make(wanted_of(json.loads(pathlib.Path(sys.argv[1]).read_text()), target=1e-4), "
        "pathlib.Path(sys.argv[2]), resume=True)"
    )
    line = [sys.executable, "-c", program, str(config), str(tmp_path / "t.nc")]
    counter = tmp_path / "calls"
    paths = [
        str(pathlib.Path(tabulated.__file__).parent),
        os.environ.get("PYTHONPATH", ""),
    ]
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(paths),
        "MBMA_TEST_CALLS": str(counter),
        "MBMA_TEST_END": str(end),
    }
    killed = subprocess.run(line, env=environment, capture_output=True)
    assert killed.returncode == -9
    assert not (tmp_path / "t.nc").exists()
    first = counter.stat().st_size
    subprocess.run(line, env=environment, check=True, capture_output=True)
    both = counter.stat().st_size
    counter.unlink()
    monkeypatch.setenv("MBMA_TEST_CALLS", str(counter))
    monkeypatch.setenv("MBMA_TEST_END", "0")
    make(wanted_of(slow, target=1e-4), tmp_path / "whole.nc")
    whole = counter.stat().st_size
    assert bits(tmp_path / "t.nc") == bits(tmp_path / "whole.nc")
    # finished pieces are not asked again
    assert first == end
    assert both <= whole + end - (end > whole / 2) * whole / 4
    assert not (tmp_path / "t.nc.pieces").exists()


@pytest.mark.slow
def test_workers_of_a_scheduler_make_the_same_table(tmp_path):
    distributed = pytest.importorskip("distributed")
    wanted = wanted_of(SMOOTH, target=1e-4)
    make(wanted, tmp_path / "here.nc")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster:
        make(wanted, tmp_path / "there.nc", scheduler=cluster.scheduler_address)
    assert bits(tmp_path / "here.nc") == bits(tmp_path / "there.nc")


@pytest.mark.slow
@pytest.mark.parametrize("function", ["slow", "limping"])
def test_workers_that_are_killed_or_slow_make_the_same_table(
    function, tmp_path, monkeypatch
):
    """A worker of a cluster ends by SIGKILL in its tenth call, or takes 50 times as long as the other."""
    pytest.importorskip("distributed")
    calls = tmp_path / "calls"
    monkeypatch.setenv("MBMA_TEST_CALLS", str(calls))
    monkeypatch.setenv("MBMA_TEST_END", "10")
    entries = SMOOTH | {"pieces": 2, "chunk": 32, "certificate_points": 400}
    wanted = wanted_of(entries | {"function": f"tabulated:{function}"}, target=1e-3)
    make(wanted, tmp_path / "there.nc", local_cluster=2)
    found = calls.read_text()
    if function == "limping":
        by_process = [found.split().count(one) for one in {*found.split()}]
        assert min(by_process) < max(by_process)
    else:
        assert len(found) > 10
    make(wanted_of(entries, target=1e-3), tmp_path / "here.nc")
    assert bits(tmp_path / "here.nc") == bits(tmp_path / "there.nc")


@pytest.mark.slow
@pytest.mark.parametrize("options", [{"workers": 2}, {"local_cluster": 2}])
def test_results_come_as_they_are_finished(options, tmp_path):
    """Those of a cluster also where a worker ends by SIGKILL; those of processes before a slow one's."""
    cluster = "local_cluster" in options
    if cluster:
        pytest.importorskip("distributed")
    jobs = [(number, str(tmp_path / "first"), cluster) for number in range(6)]
    with crew(**options) as run:
        found = [*run.as_finished(tabulated.killed_or_slow, jobs)]
    assert sorted(found) == [0, 1, 4, 9, 16, 25]
    assert (tmp_path / "first").exists()
    assert cluster or found[0] != 0


def test_two_clusters_are_refused(tmp_path):
    with pytest.raises(InputError, match="not both"):
        make(
            wanted_of(SMOOTH),
            tmp_path / "t.nc",
            scheduler="tcp://localhost:1",
            local_cluster=2,
        )


@pytest.mark.parametrize(
    ("function", "outputs", "message"),
    [
        ("raises", {}, r"raised ZeroDivisionError: too deep; at x = 0\.[789]"),
        (
            "not_a_number",
            {},
            r"returned value = nan, not a finite number; at x = 0\.[789]",
        ),
        ("wrong_shape", {}, r"returned arrays of shape \(3,\) for"),
        ("texts", {}, "returned what are no numbers"),
        ("complex_numbers", {}, "returned what are no numbers: they are complex"),
        (
            "negative",
            {"f": {"transform": "log"}},
            "not a finite number above 0; at x = 0",
        ),
        ("jump", {}, r"is not smooth at x = 0\.321[67]"),
        ("single", {"square": {}}, "set vectorized = false"),
    ],
)
def test_functions_that_cannot_be_tabulated_are_named(
    function, outputs, message, tmp_path
):
    entries = {"axes": {"x": UNIT}, **({"outputs": outputs} if outputs else {})}
    with pytest.raises((InputError, UncertifiedError), match=message):
        made(tmp_path, function, entries, 1e-6)
    assert not (tmp_path / "t.nc").exists()


def test_failures_are_marked_where_that_is_asked_for(tmp_path):
    for function in ("raises", "not_a_number"):
        table = made(
            tmp_path, function, {"axes": {"x": UNIT | {"low": 0.1}}, "on_failure": "mark"}
        )
        inside = np.linspace(0.1, 0.69, 50)
        exact = getattr(tabulated, function)(inside)
        assert np.allclose(table.lookup(inside)["value"], exact, rtol=1e-6)
        assert np.isnan(table.lookup(np.linspace(0.7001, 1, 50))["value"]).all()
        certificate = json.loads(table.attributes["certificate"])
        assert certificate["without_answer"] > 0


def test_a_jump_is_marked(tmp_path):
    table = made(tmp_path, "jump", {"axes": {"x": UNIT}, "on_failure": "mark"})
    assert table.lookup([0.2, 0.9])["value"] == pytest.approx([1, 2])
    assert np.isnan(table.lookup(0.3217)["value"]) or table.lookup(0.3217)["value"] in (
        1,
        2,
    )


def test_one_point_a_call(tmp_path):
    table = made(
        tmp_path,
        "single",
        {
            "axes": {"x": {"low": 1.0, "high": 2.0}},
            "outputs": {"cube": {}, "square": {}},
            "vectorized": False,
            "pieces": 1,
            "certificate_points": 100,
        },
    )
    assert table.lookup(1.5)["cube"] == pytest.approx(3.375, rel=1e-6)


@pytest.mark.parametrize(
    ("entries", "message"),
    [
        ({"axes": {"x": {"low": 1.0, "high": 0.0}, "y": UNIT}}, "low must be below high"),
        ({"axes": {"x": {"low": 1.0, "high": 1.0}, "y": UNIT}}, "low must be below high"),
        (
            {"axes": {"x": UNIT | {"transform": "log"}, "y": UNIT}},
            "above 0 on a logarithmic",
        ),
        ({"axes": {"x": UNIT | {"offset": 1.0}, "y": UNIT}}, "of logarithmic axes alone"),
        ({"axes": {"x": UNIT}}, "axes.y is missing"),
        ({"axes": {"x": UNIT, "z": UNIT}}, "has no argument 'z'"),
        ({"axes": {"x": UNIT, "y": UNIT}, "tarjet": 1e-3}, "did you mean 'target'"),
        ({"axes": {"x": UNIT | {"lo": 1}, "y": UNIT}}, "did you mean 'low'"),
        ({"axes": {"x": UNIT, "y": UNIT}, "outputs": {"x": {}}}, "an axis and an output"),
        ({"axes": {"x": UNIT | {"low": float("nan")}, "y": UNIT}}, "must be finite"),
        ({"axes": {"x": UNIT, "y": UNIT}, "function": "tabulated:smoth"}, "did you mean"),
        (
            {"axes": {"x": UNIT, "y": UNIT}, "function": "no_module:f"},
            "cannot be imported",
        ),
        ({"axes": {"x": UNIT, "y": UNIT}, "function": "smooth"}, "module:function"),
    ],
)
def test_wrong_configurations_are_refused_by_name(entries, message):
    with pytest.raises(InputError, match=message):
        wanted_of({"function": "tabulated:smooth"} | entries)


def test_too_few_coefficients_are_named(tmp_path):
    entries = SMOOTH | {"max_coefficients": 10, "pieces": 1}
    with pytest.raises(
        UncertifiedError,
        match=r"10 coefficients do not reach the target: .* boxes miss it, by up to [1-9]",
    ):
        made(tmp_path, "smooth", entries, 1e-10)
    with pytest.raises(UncertifiedError, match="coefficients do not reach the target"):
        made(
            tmp_path,
            "diagonal",
            {"axes": {"x": UNIT, "y": UNIT}, "max_coefficients": 3000, "pieces": 1},
            1e-9,
        )


def test_the_command_makes_a_table(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    example = CliRunner().invoke(main, ["tables", "make", "a:b", "--example"])
    assert example.exit_code == 0
    assert "on_failure" in example.output
    pathlib.Path("axes.toml").write_text(
        "certificate_points = 500\n[axes.x]\nlow = 0.01\nhigh = 10.0\ntransform = 'log'\n"
        "[axes.y]\nlow = 0.0\nhigh = 1.0\n[outputs.u]\n[outputs.v]\nerror = 'absolute'\n"
    )
    line = [
        "tables",
        "make",
        "tabulated:smooth",
        "--config",
        "axes.toml",
        "--target",
        "1e-5",
    ]
    dry = CliRunner().invoke(main, [*line, "--dry-run"])
    assert dry.exit_code == 0
    assert "points in 16 pieces" in dry.output
    for options in (["--out", "t.nc"], ["--part", "1/2", "--out", "p.nc"]):
        done = CliRunner().invoke(main, [*line, "--workers", "1", *options])
        assert done.exit_code == 0, done.output
    assert "FunctionTable" in CliRunner().invoke(main, [*line, "--out", "t.nc"]).output
    early = CliRunner().invoke(main, ["tables", "merge", "p.nc"])
    assert early.exit_code != 0
    assert "not finished" in early.output
    CliRunner().invoke(main, [*line, "--workers", "1", "--part", "2/2", "--out", "p.nc"])
    assert CliRunner().invoke(main, ["tables", "merge", "p.nc"]).exit_code == 0
    assert bits("t.nc") == bits("p.nc")
    for wrong in (["--resume"], ["--part", "1/2"]):
        refused = CliRunner().invoke(main, ["tables", "make", "universal", *wrong])
        assert refused.exit_code != 0
        assert "for tables of functions" in refused.output
    refused = CliRunner().invoke(main, [*line, "--part", "3/2", "--out", "q.nc"])
    assert refused.exit_code != 0
    assert "1 <= k <= n" in refused.output


def a_piece(axes, width, target, seed=1, marks=False):
    """A piece of one output with an absolute error, without files."""
    aim = Aim(
        np.array([target]), np.array([False]), np.array([1e-300]), np.array([False])
    )
    whole = Box(np.zeros(axes), np.full(axes, width), np.zeros(axes, int), ())
    return Piece(whole, aim, 200, seed, marks, 10**6)


def test_a_piece_goes_on_from_any_state():
    """Also where a box that was a polynomial was found to miss the target, and cannot be halved any more."""
    there, back = a_piece(1, 1.0, 1e-6), a_piece(1, 1.0, 1e-6, marks=True)
    while not there.is_done:
        x = there.points()[:, 0]
        there.take(1 / (1 + 400 * (x - 0.37) ** 2)[:, None])
        back.restore(there.state())
        assert np.array_equal(back.points(), there.points())
    lost = next(b for b in back.boxes if b.coefficients is not None)
    lost.halvings[0] = MOST_HALVINGS
    back._halve(lost, 0, lost.terms)
    again = a_piece(1, 1.0, 1e-6)
    again.restore(back.state())
    for one, other in zip(back.boxes, again.boxes, strict=True):
        assert (one.axis, one.child, one.terms) == (other.axis, other.child, other.terms)
        assert np.array_equal(one.coefficients, other.coefficients)


def test_folders_of_others_and_damaged_pieces_are_refused(tmp_path):
    wanted = wanted_of(SMOOTH, target=1e-5)
    folder = tmp_path / "t.nc.pieces"
    folder.mkdir()
    (folder / "thesis.txt").write_text("kept")
    with pytest.raises(InputError, match="something else than pieces"):
        make(wanted, tmp_path / "t.nc")
    assert (folder / "thesis.txt").read_text() == "kept"
    make(wanted, tmp_path / "a.nc", part=(1, 2))
    piece = tmp_path / "a.nc.pieces" / "piece-000.npz"
    piece.write_bytes(piece.read_bytes()[:-100])
    with pytest.raises(TableFileError, match=r"piece-000.npz is damaged"):
        make(wanted, tmp_path / "a.nc", resume=True)


@settings(max_examples=20, deadline=None)
@given(
    st.lists(st.floats(-2, 2), min_size=3, max_size=3),
    st.floats(0.2, 3.0),
    st.integers(1, 6),
)
def test_polynomials_are_tabulated_exactly(factors, width, seed):
    """A cubic in two numbers, but for terms that the target leaves out; by pieces alone, without files."""
    a, b, c = factors
    piece = a_piece(2, width, 1e-9, seed)
    while not piece.is_done:
        x, y = piece.points().T
        piece.take((a * x**3 + b * x * y * y + c)[:, None])
    is_small = any(0 < abs(factor) < 1e-3 for factor in factors)
    left_out = TRIMMED * 1e-9 if is_small else 1e-12
    assert np.nanmax(piece.errors) < left_out
    assert len(piece.boxes) == 1


def test_the_forecast_calls_the_function_a_few_times():
    text = make_function.forecast(wanted_of(SMOOTH))
    assert "points in 16 pieces" in text


def test_points_of_a_file_are_replayed(tmp_path):
    entries = SMOOTH | {
        "outputs": {"u": {"transform": "log"}, "v": {"error": "absolute"}}
    }
    table = made(tmp_path, "smooth", entries, 1e-4)
    count, excess = table.replayed()
    assert count == 16 * 16
    assert 0 < excess <= 1
    x, y = table.arrays["conformance_x"].T
    exact = np.stack(tabulated.smooth(x, y), axis=-1)
    np.testing.assert_allclose(table.arrays["conformance_exact"], exact, rtol=1e-12)
    found = CliRunner().invoke(main, ["tables", "verify", str(tmp_path / "t.nc")])
    assert "256 conformance points" in found.output
    # coefficients that are off, in a file whose hashes fit
    other = {**table.arrays, "coefficients": table.arrays["coefficients"] * 1.01}
    kept = {n: v for n, v in table.attributes.items() if not n.endswith("_sha256")}
    off = type(table)(table.axes, table.outputs, other, kept)
    make_function.write(tmp_path / "off.nc", off)
    found = CliRunner().invoke(main, ["tables", "verify", str(tmp_path / "off.nc")])
    assert found.exit_code != 0
    assert "times its bound" in found.output


def test_the_text_for_slurm_submits_jobs_with_workers_of_its_scheduler(
    tmp_path, monkeypatch, capsys
):
    """The page's program with a stand-in for `sbatch` that keeps what it is given; no SLURM is at hand."""
    pytest.importorskip("dask_jobqueue")
    page = pathlib.Path(__file__).parents[2] / "docs/tutorials/functions.md"
    block = next(
        part
        for part in page.read_text(encoding="utf-8").split("```text\n")
        if part.startswith("from dask_jobqueue")
    ).partition("```")[0]
    stands_in = {
        "sbatch": 'cp "$1" "$(mktemp "$0.XXXXXX")"; echo "job $$"',
        "scancel": "",
    }
    for name, line in stands_in.items():
        (tmp_path / name).write_text(f"#!/bin/sh\n{line}\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    space = {}
    exec(block, space)
    try:
        address = space["cluster"].scheduler_address
        assert address in capsys.readouterr().out
        deadline = time.monotonic() + 30
        while len(jobs := [*tmp_path.glob("sbatch.*")]) < 20:
            assert time.monotonic() < deadline
            time.sleep(0.05)
        for job in jobs:
            text = job.read_text()
            for line in (
                "--cpus-per-task=8",
                "--mem=15G",
                "-t 04:00:00",
                "--partition=cpu",
            ):
                assert f"#SBATCH {line}\n" in text
            assert f"dask_worker {address} " in text
            subprocess.run(["bash", "-n", str(job)], check=True)
    finally:
        space["cluster"].close()
