"""Certified tables: the certificate against fresh exact solutions, refinement by error, physical checks."""

import dataclasses
import itertools
import json

import numpy as np
import pytest
from click.testing import CliRunner
from small_builds import KINDS, SMALL, small

from generate.__main__ import main
from generate.tables import build as build_module
from generate.tables.build import UncertifiedError, build, certify, evaluate, held_out, resolve
from generate.tables.chunks import ChunkedSolver, log_ratio
from generate.tables.configuration import load
from mbma_tables.islands import greenwood_tripp
from mbma_tables.tablefiles.netcdf import read_table, write_table
from mbma_tables.tablefiles.schema import error_cell

FRESH = 4000
# fresh points find other worst places than the few hundred of a small certificate
STATED_FACTOR = 1.5


def fresh(kind, content, count=FRESH, seed=5):
    """Positions at random, and both functions' relative errors there against exact solutions at tight tolerance."""
    rng = np.random.default_rng(seed)
    positions = [rng.uniform(0, axis.nodes - 1, count) for axis in content.axes]
    X, mu = kind.arguments(*(axis.coordinate(p) for axis, p in zip(content.axes, positions, strict=True)))
    solved = greenwood_tripp.solve(X, mu, rtol=1e-10)
    rigid = greenwood_tripp.rigid_sphere(X, mu)
    table = np.exp(evaluate(content.coefficients, positions)).T * rigid
    return positions, np.abs(table / np.stack([solved.phi_F, solved.phi_A]) - 1).T


def test_fresh_points_confirm_the_certificate(built):
    kind, content = built
    _, errors = fresh(kind, content)
    target = content.attributes["target"]
    for number, function in enumerate("FA"):
        stated = [content.attributes[f"{what}_error_{function}"] for what in ("median", "p99", "largest")]
        assert 0 < stated[0] < stated[1] <= stated[2] <= target
        assert errors[:, number].max() <= STATED_FACTOR * target
        assert errors[:, number].max() <= 2 * stated[2]
        # half of the certificate's points lie where surfaces go, so only the order is the same
        assert stated[1] / 3 < np.percentile(errors[:, number], 99) < 3 * stated[1]


def test_the_local_bound_is_honest(built):
    kind, content = built
    positions, errors = fresh(kind, content, seed=6)
    cells = content.local_error.shape[:-1]
    where = tuple(error_cell(a, c, p) for a, c, p in zip(content.axes, cells, positions, strict=True))
    assert (errors > content.local_error[where]).any(axis=1).mean() < 1e-3
    # and no idle talk: it follows the error down
    assert np.median(content.local_error[where]) < 0.5 * content.local_error.max()


def test_certificate_points_stand_off_the_nodes_and_half_of_them_where_surfaces_go(built):
    kind, content = built
    count = 300
    places = held_out(kind, content.axes, count, 11)
    assert all(place.size == count for place in places)
    for axis, place in zip(content.axes, places, strict=True):
        assert ((axis.low <= place) & (place <= axis.high)).all()
        assert (axis.position(place) != np.round(axis.position(place))).all()
    visited = kind.manifold(count // 2)
    for place, own in zip(places, visited, strict=True):
        np.testing.assert_array_equal(place[count // 2 :], own)


def test_a_held_out_point_on_a_node_is_refused(built, monkeypatch):
    kind, content = built
    places = held_out(kind, content.axes, 100, 11)
    places[0][3] = content.axes[0].low
    monkeypatch.setattr(build_module, "held_out", lambda *_: places)
    with pytest.raises(UncertifiedError, match="a held-out point lies on a node"):
        certify(kind, content.axes, content.coefficients, ChunkedSolver(), kind.configuration)


def test_the_certificate_is_solved_on_twice_the_nodes(built, monkeypatch):
    kind, content = built
    asked = []

    class Noting(ChunkedSolver):
        def log_ratio(self, label, X, mu, rtol, refinement=1):
            asked.append((label, refinement))
            return super().log_ratio(label, X, mu, rtol, refinement)

    certify(kind, content.axes, content.coefficients, Noting(), kind.configuration)
    assert asked == [("certificate", 2)]
    X, mu = np.array([0.7, 4.0]), np.array([1e-2, 3.0])
    counts = []
    solve = greenwood_tripp.solve

    def watch(X, mu, rtol, nodes=None):
        found = solve(X, mu, rtol=rtol, nodes=nodes)
        counts.append(np.unique(found.nodes).tolist())
        return found

    monkeypatch.setattr(greenwood_tripp, "solve", watch)
    log_ratio(X, mu, 1e-6, 2)
    assert sorted(n for (n,) in counts[1:]) == [2 * n for n in sorted(counts[0])]


def test_the_file_tells_what_each_axis_cost(built):
    kind, content = built
    errors = json.loads(content.attributes["axis_errors"])
    history = json.loads(content.attributes["refinement"])
    names = [axis.name for axis in content.axes]
    assert list(errors) == names
    assert history[-1]["nodes"] == {axis.name: axis.nodes for axis in content.axes}
    assert history[-1]["largest_error"] == max(content.attributes[f"largest_error_{f}"] for f in "FA")
    assert all(0 < e <= history[-1]["aim"] for pair in errors.values() for e in pair)
    assert json.loads(content.attributes["configuration"]) == dataclasses.asdict(kind.configuration)


def test_axis_errors_are_those_of_interpolation_along_that_axis(built):
    """A line of exact solutions along each axis, fitted by scipy's spline instead of the table's own."""
    from scipy.interpolate import make_interp_spline

    kind, content = built
    errors = json.loads(content.attributes["axis_errors"])
    for number, axis in enumerate(content.axes):
        worst = 0.0
        others = [a for k, a in enumerate(content.axes) if k != number]
        cells = np.arange(axis.nodes - 1)
        between = np.concatenate([cells + 0.25, cells + 0.75])
        for place in itertools.product((0.0, 0.35, 0.7, 1.0), repeat=len(others)):
            fixed = [a.coordinate(p * (a.nodes - 1)) for a, p in zip(others, place, strict=True)]

            def values(positions, axis=axis, fixed=fixed, number=number):
                line = [np.full(positions.size, f) for f in fixed]
                line.insert(number, axis.coordinate(positions))
                return log_ratio(*kind.arguments(*line), 1e-10)

            nodes = np.arange(float(axis.nodes))
            spline = make_interp_spline(nodes, values(nodes), k=content.degree)
            worst = max(worst, np.abs(spline(between) - values(between)).max())
        stated = max(errors[axis.name])
        # other lines than the generator's
        assert stated / 2 < worst < 2 * stated


def test_a_tighter_target_takes_more_nodes_and_is_met(tmp_path):
    nodes = []
    for target in (1e-3, 1e-5, 1e-7):
        path = tmp_path / f"{target}.toml"
        # so far down that the first order in mu is within the tightest target
        path.write_text(SMALL["universal"].replace("1e-4", str(target)).replace("1e-3\nhigh", "1e-6\nhigh"))
        configuration = load("universal", path)
        content = build(KINDS["universal"](configuration), configuration, ChunkedSolver())
        assert max(content.attributes[f"largest_error_{f}"] for f in "FA") <= target
        nodes.append([axis.nodes for axis in content.axes])
    assert nodes[0] <= nodes[1] < nodes[2]
    # sixth order: a hundredth of the error for about twice the nodes
    assert np.prod(nodes[2]) < 8 * np.prod(nodes[1])


def test_refinement_stops_at_the_target_not_far_beyond(tmp_path):
    configuration = load("universal", small(tmp_path, "universal"))
    kind = KINDS["universal"](configuration)
    aim = 1e-7
    found = resolve(kind, configuration, ChunkedSolver(), aim, {"X": 8, "mu": 8})
    fewer = {name: int(count / 1.25) for name, count in found.nodes.items()}
    coarser = resolve(kind, configuration, ChunkedSolver(), 1.0, fewer)
    for name in fewer:
        assert found.errors[name].max() <= aim < coarser.errors[name].max()


def invoke(folder, text, kind="universal"):
    path = folder / "own.toml"
    path.write_text(text)
    out = folder / "table.nc"
    result = CliRunner().invoke(main, ["tables", kind, "--config", str(path), "--out", str(out), "--workers", "1"])
    return result, sorted(p.name for p in folder.iterdir() if p != path)


REFUSED = {
    "too few nodes allowed": (
        lambda text: text.replace("max_nodes = 5000", "max_nodes = 100"),
        "needs more than the 100 nodes allowed; raise max_nodes or the target",
    ),
    "fixed axes that miss the target": (
        lambda text: text.replace("= 0.5\n", "= 0.5\nnodes = 8\n").replace("= 1e-3\n", "= 1e-3\nnodes = 8\n"),
        "the target 1.00e-04; the configuration fixes every axis",
    ),
    "a range that no surface visits": (
        lambda text: text.replace("6.0", "100.0").replace("low = 0.5", "low = 90.0"),
        "hardly a surface visits these axes",
    ),
    # at mu of order one the answer below the table is no longer first order in mu
    "a broken check": (
        lambda text: text.replace("1e-3", "0.5"),
        "universal: between its nodes the table breaks: rigid limit",
    ),
}


@pytest.mark.parametrize(("change", "message"), REFUSED.values(), ids=REFUSED)
def test_what_makes_no_table_is_one_message_and_nothing_written(change, message, tmp_path):
    result, left = invoke(tmp_path, change(SMALL["universal"]))
    assert result.exit_code == 2
    assert message in result.stderr
    assert len(result.stderr.splitlines()) == 1
    assert left == []


def bump(content, place, height):
    """A wave between the nodes: coefficients of alternating sign add nothing that the nodes would show at once."""
    spoiled = content.coefficients.copy()
    spoiled[place] += height
    return dataclasses.replace(content, coefficients=spoiled)


def middle(content, function, spread=0):
    return (*(slice(n // 2 - spread, n // 2 + 1 + spread) for n in content.coefficients.shape[:-1]), function)


def test_what_no_islands_can_do_breaks_a_rule(built):
    kind, content = built
    nodes, others = content.coefficients.shape[:2], (slice(None),) * (len(content.axes) - 2)
    dips = (nodes[0] // 2, slice(None), *others), (slice(None), nodes[1] // 2, *others)
    of_mu = "force increasing in mu" if content.kind == "universal" else "force increasing with the spread"
    # at the smallest spread mu is about 0.01
    limit = ((Ellipsis, 0), -0.01) if content.kind == "universal" else ((Ellipsis, 1), -5.0)
    spoilt = [("force increasing in X", (*dips[0], 0), -12.0), ("area increasing in X", (*dips[0], 1), -12.0)]
    spoilt += [(of_mu, (*dips[1], 0), -12.0), ("rigid limit", *limit)]
    for number in (0, 1):
        spoilt.append(("force and area finite", middle(content, number), np.nan))
        spoilt.append(("no larger than a rigid sphere's", middle(content, number, 1), 20.0))
    for rule, place, height in spoilt:
        with pytest.raises(UncertifiedError, match=rule):
            kind.check(bump(content, place, height))


def test_an_unspoiled_table_passes_and_survives_its_file(built, tmp_path):
    kind, content = built
    kind.check(content)
    kind.check(read_table(write_table(tmp_path / "table.nc", content)))


def test_island4d_says_when_it_covers_a_part_only(tmp_path):
    narrow = KINDS["island4d"](load("island4d", small(tmp_path, "island4d")))
    shipped = KINDS["island4d"](load("island4d"))
    assert narrow.attributes()["covers"].startswith("the islands within the axes, of those that the model visits")
    assert "0.6 <= H <= 0.9" in narrow.attributes()["covers"]
    assert shipped.attributes()["covers"].startswith("every island that the model visits for 0.3 <= H <= 1,")
