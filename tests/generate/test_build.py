"""Certified tables: the certificate against fresh exact solutions, errors by target, physical checks."""

import dataclasses

import numpy as np
import pytest
from small_tables import small, small_build

from generate.tables.certificate import UncertifiedError
from generate.tables.commands import KINDS
from generate.tables.configuration import load
from generate.tables.island4d import evaluate
from generate.tables.universal import AIM, Strip
from generate.tables.writing import write_table
from mbma_tables.islands import greenwood_tripp
from mbma_tables.models.universal import UniversalModel
from mbma_tables.tablefiles.netcdf import read_table
from mbma_tables.tablefiles.schema import BUCKET_BITS, CELL_EDGES, UNIVERSAL, error_cell

FRESH = 4000
# fresh points find other worst places than the few hundred of a small certificate
STATED_FACTOR = 1.5


@pytest.fixture(params=KINDS)
def built(request):
    """(kind, its content) of a small table."""
    return small_build(request.param)


@pytest.fixture
def nodes():
    """The same over nodes."""
    return small_build("island4d")


def fresh(kind, content, count=FRESH, seed=5):
    """Both functions' relative errors and bounds at random points, against exact solutions at tight tolerance."""
    rng = np.random.default_rng(seed)
    if content.kind == UNIVERSAL:
        X, mu = kind.held_out(content, count, seed)
        found = UniversalModel(content).answer(X, mu)
        solved = greenwood_tripp.solve(X, mu, rtol=1e-10)
        ratio = np.stack([found.phi_F / solved.phi_F, found.phi_A / solved.phi_A], axis=-1)
        return np.abs(ratio - 1), found.error[:, None]
    positions = [rng.uniform(0, axis.nodes - 1, count) for axis in content.axes]
    X, mu = kind.arguments(*(axis.coordinate(p) for axis, p in zip(content.axes, positions, strict=True)))
    solved = greenwood_tripp.solve(X, mu, rtol=1e-10)
    table = np.exp(evaluate(content.coefficients, positions)).T * greenwood_tripp.rigid_sphere(X, mu)
    cells = content.local_error.shape[:-1]
    where = tuple(error_cell(a, c, p) for a, c, p in zip(content.axes, cells, positions, strict=True))
    return np.abs(table / np.stack([solved.phi_F, solved.phi_A]) - 1).T, content.local_error[where]


def test_fresh_points_confirm_the_certificate(built):
    kind, content = built
    errors, _ = fresh(kind, content)
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
    errors, bound = fresh(kind, content, seed=6)
    assert (errors > bound).any(axis=1).mean() < 1e-3
    # and no idle talk
    assert np.median(bound / np.maximum(errors, 1e-300)) < 300


def test_certificate_points_stand_off_the_nodes_and_half_of_them_where_surfaces_go(nodes):
    kind, content = nodes
    count = 300
    places = kind.held_out(content.axes, count, 11)
    assert all(place.size == count for place in places)
    for axis, place in zip(content.axes, places, strict=True):
        assert ((axis.low <= place) & (place <= axis.high)).all()
        assert (axis.position(place) != np.round(axis.position(place))).all()
    visited = kind.manifold(count // 2)
    for place, own in zip(places, visited, strict=True):
        np.testing.assert_array_equal(place[count // 2 :], own)


def test_a_held_out_point_on_a_node_is_refused(nodes, monkeypatch):
    kind, content = nodes
    places = kind.held_out(content.axes, 100, 11)
    places[0][3] = content.axes[0].low
    monkeypatch.setattr(kind, "held_out", lambda *_: places)
    with pytest.raises(UncertifiedError, match="a held-out point lies on a node"):
        kind.certify(content.axes, content.coefficients)


def test_a_tighter_target_takes_more_cells_and_is_met(tmp_path):
    cells = []
    for target in (1e-4, 1e-6, 1e-8):
        configuration = load("universal", small(tmp_path, "universal"), target)
        content = KINDS["universal"](configuration).build()
        assert max(content.attributes[f"largest_error_{f}"] for f in "FA") <= target
        cells.append(len(content.coefficients))
    assert cells[0] < cells[1] < cells[2]
    # eighth order both ways: a hundredth of the error for about three times the cells
    assert cells[2] < 6 * cells[1]


def test_cells_end_where_they_must(tmp_path):
    """A cell that were an eighth of an octave longer would miss its aim."""
    configuration = load("universal", small(tmp_path, "universal"))
    content = KINDS["universal"](configuration).build()
    X_low, X_high, low, high = (content.auxiliary[name][1] for name in CELL_EDGES)
    aim = AIM * configuration.target
    for cell in np.flatnonzero(high < content.axes[1].high)[::3]:
        strip = Strip(X_low[cell], X_high[cell], content.axes[1].high, aim, 1e-8)
        longer = ((high[cell : cell + 1].view(np.int64) >> BUCKET_BITS) + 1 << BUCKET_BITS).view(float)[0]
        assert strip.cell(low[cell], high[cell])[1].max() <= 1.01 * aim
        assert strip.cell(low[cell], longer)[1].max() > 0.99 * aim


def test_nodes_that_follow_the_target_meet_it(tmp_path):
    found = []
    for target in (1e-1, 2e-2):
        configuration = load("island4d", small(tmp_path, "island4d"), target)
        content = KINDS["island4d"](configuration).build()
        found.append(max(content.attributes[f"largest_error_{f}"] for f in "FA"))
    assert found[1] < found[0] / 3


def test_a_target_that_is_missed_is_refused(nodes):
    kind, content = nodes
    tight = dataclasses.replace(kind.configuration, target=1e-6)
    with pytest.raises(UncertifiedError, match=r"the largest held-out error is .*, the target 1\.00e-06"):
        type(kind)(tight).certify(content.axes, content.coefficients)


def bump(content, place, height):
    """A wave between the nodes: coefficients of alternating sign add nothing that the nodes would show at once."""
    spoiled = content.coefficients.copy()
    spoiled[place] += height
    return dataclasses.replace(content, coefficients=spoiled)


def middle(content, function, spread=0):
    return (*(slice(n // 2 - spread, n // 2 + 1 + spread) for n in content.coefficients.shape[:-1]), function)


def test_what_no_islands_can_do_breaks_a_rule(nodes):
    kind, content = nodes
    first, second, *others = content.coefficients.shape[:-1]
    rest = (slice(None),) * len(others)
    dips = (first // 2, slice(None), *rest), (slice(None), second // 2, *rest)
    spoilt = [("force increasing in X", (*dips[0], 0), -12.0), ("area increasing in X", (*dips[0], 1), -12.0)]
    # at the smallest spread mu is about 0.01
    spoilt += [("force increasing with the spread", (*dips[1], 0), -12.0), ("rigid limit", (Ellipsis, 1), -5.0)]
    for number in (0, 1):
        spoilt.append(("force and area finite", middle(content, number), np.nan))
        spoilt.append(("no larger than a rigid sphere's", middle(content, number, 1), 20.0))
    for rule, place, height in spoilt:
        with pytest.raises(UncertifiedError, match=rule):
            kind.check(bump(content, place, height))


def test_what_no_islands_can_do_breaks_a_rule_in_a_cell(tmp_path):
    configuration = load("universal", small(tmp_path, "universal"))
    kind = KINDS["universal"](configuration)
    content = kind.build()
    last = len(content.coefficients) - 1
    assert content.auxiliary["mu_low"][1][last] > 0
    for number, cell, terms, rule in (
        (0, last, {(0, 0): np.nan}, "finite and positive"),
        (1, last, {(0, 0): -1.0}, "finite and positive"),
        (1, last, {(0, 0): 30.0}, "no larger than a rigid sphere's"),
        (0, last, {(0, 0): 0.5, (1, 0): -0.1}, "force increasing in X"),
        (1, last, {(0, 0): 0.5, (1, 0): -0.1}, "area increasing in X"),
        # Phi_F/mu falls faster than mu rises
        (0, last, {(0, 0): 0.5, (1, 0): 0.1, (0, 1): -0.35}, "force increasing in mu"),
        (1, 0, {(0, 0): 0.1, (1, 0): 0.01}, "rigid limit"),
    ):
        series = content.coefficients.copy()
        mean = series[cell, 0, 0, number]
        series[cell, ..., number] = 0.0
        for place, share in terms.items():
            series[(cell, *place, number)] = share * mean
        with pytest.raises(UncertifiedError, match=rule):
            kind.check(dataclasses.replace(content, coefficients=series))


def test_an_unspoiled_table_passes_and_survives_its_file(built, tmp_path):
    kind, content = built
    kind.check(content)
    kind.check(read_table(write_table(tmp_path / "table.nc", content)))
