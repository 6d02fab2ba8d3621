"""Members of tables of functions: variants and replicas, combined by the rules of LHAPDF, by numpy on the functions."""

import json
import pickle
import shutil
import subprocess

import numpy as np
import pytest
import tabulated
from click.testing import CliRunner

from mbma_tables import InputError, TableFileError, open_table
from mbma_tables.cli import main
from mbma_tables.export.model.function_code import function_code
from mbma_tables.export.text import core_file
from mbma_tables.tables import make_function
from mbma_tables.tables.make_function import make, merge, wanted_of
from mbma_tables.tables.merged_members import merge_members

AXES = {
    "x": {"low": 0.1, "high": 10.0, "transform": "log"},
    "y": {"low": 0.0, "high": 1.0},
}
OUTPUTS = {"u": {"unit": "N", "transform": "log"}, "v": {"error": "absolute"}}
SEEDS = [1, 2, 3, 4, 5]
BASE = {"axes": AXES, "outputs": OUTPUTS, "certificate_points": 400, "pieces": 4}


def entries(rule="replicas", **changes):
    return {
        "function": "tabulated:replica",
        **BASE,
        "members": {"argument": "seed", "values": SEEDS, "rule": rule, **changes},
    }


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    folder = tmp_path_factory.mktemp("members")
    rules = ("replicas", "envelope", "symmetric_hessian", "hessian")
    return {
        rule: make(wanted_of(entries(rule), target=1e-6), folder / f"{rule}.nc")
        for rule in rules
    }


def ends_by_hand(rule, f):
    """Value and ends from the members of one point, in a loop, as the LHAPDF paper has them."""
    if rule == "replicas":
        mean = sum(f) / len(f)
        deviation = (sum((one - mean) ** 2 for one in f) / (len(f) - 1)) ** 0.5
        return mean, mean - deviation, mean + deviation
    if rule == "envelope":
        return f[0], min(f), max(f)
    if rule == "symmetric_hessian":
        root = sum((one - f[0]) ** 2 for one in f[1:]) ** 0.5
        return f[0], f[0] - root, f[0] + root
    up = down = 0.0
    for plus, minus in zip(f[1::2], f[2::2], strict=True):
        up += max(plus - f[0], minus - f[0], 0.0) ** 2
        down += max(f[0] - plus, f[0] - minus, 0.0) ** 2
    return f[0], f[0] - down**0.5, f[0] + up**0.5


@pytest.mark.parametrize("rule", ["replicas", "envelope", "symmetric_hessian", "hessian"])
def test_a_lookup_answers_with_its_spread(rule, tables):
    table = tables[rule]
    draws = np.random.default_rng(5)
    x, y = draws.uniform(0.1, 10, 200), draws.random(200)
    found = table.lookup(x, y, members=True)
    spread = found.spread["u"]
    members = [tabulated.replica(x, y, seed)[0] for seed in SEEDS]
    for k in range(x.size):
        value, low, high = ends_by_hand(rule, [member[k] for member in members])
        assert abs(found["u"][k] - value) <= found.error["u"][k]
        assert abs(spread.low[k] - low) <= spread.error[k]
        assert abs(spread.high[k] - high) <= spread.error[k]
    assert (spread.error <= 3e-5 * found["u"]).all()
    np.testing.assert_allclose(spread.members, members, rtol=1e-6)
    # an output that is the same in all
    assert (np.abs(found.spread["v"].high - found["v"]) <= 1e-5).all()


def test_a_member_is_a_table_of_its_own(tables, tmp_path):
    for rule in ("replicas", "envelope"):
        table = pickle.loads(pickle.dumps(tables[rule]))
        for seed in SEEDS:
            one = table.member(str(seed))
            exact = tabulated.replica(2.0, 0.3, seed)[0]
            found = one.lookup(2.0, 0.3)
            assert abs(found["u"] - exact) <= found.error["u"]
            assert one.replayed()[1] <= 1
            assert one.members is None
            make_function.write(tmp_path / "one.nc", _unhashed(one))
            assert open_table(tmp_path / "one.nc").lookup(2.0, 0.3)["u"] == found["u"]
        with pytest.raises(InputError, match="no member '6'"):
            table.member("6")


def _unhashed(table):
    """As it is before it is written, without hashes."""
    plain = {n: v for n, v in table.attributes.items() if not n.endswith("_sha256")}
    plain = {n: v for n, v in plain.items() if n not in ("mbma_kind", "format_version")}
    return type(table)(table.axes, table.outputs, table.arrays, plain)


def test_members_that_are_functions(tmp_path):
    members = {
        "functions": ["tabulated:softer"],
        "names": ["paper", "softer"],
        "rule": "envelope",
    }
    wanted = wanted_of(
        {"function": "tabulated:smooth", **BASE, "members": members}, target=1e-6
    )
    for part in (1, 2):
        make(wanted, tmp_path / "t.nc", part=(part, 2))
    table = merge(tmp_path / "t.nc", [tmp_path / "t.nc.pieces"])
    u = table.lookup(3.0, 0.5, members=True).spread["u"]
    exact = [f(3.0, 0.5)[0] for f in (tabulated.smooth, tabulated.softer)]
    assert [u.low, u.high] == pytest.approx(sorted(exact), rel=1e-6)
    assert list(u.members) == pytest.approx(exact, rel=1e-6)


def test_labelled_spreads_and_grids(tables):
    xr = pytest.importorskip("xarray")
    table = tables["replicas"]
    x = xr.DataArray([0.5, 1.0, 2.0], dims="load")
    spread = table.lookup(x, 0.3, members=True).spread["u"]
    assert spread.members.dims == ("member", "load")
    assert list(spread.members["member"].values) == [*map(str, SEEDS)]
    plain = table.lookup([0.5, 1.0, 2.0], 0.3, members=True).spread["u"]
    assert np.array_equal(spread.low, plain.low)
    assert spread.high.attrs["units"] == "N"
    data = table.to_dataset(x=[0.5, 1.0], y=0.3)
    assert float(data["u_high"][1, 0]) == float(plain.high[1])


def test_commands_know_members(tables, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    make_function.write(tmp_path / "m.nc", _unhashed(tables["replicas"]))
    shown = CliRunner().invoke(main, ["tables", "show", "m.nc"])
    assert "members_rule: replicas: the mean of all members" in shown.output
    checked = CliRunner().invoke(main, ["tables", "verify", "m.nc"])
    assert checked.exit_code == 0
    line = ["tables", "export", "python", "m.nc", "--member", "2", "--out", "code"]
    done = CliRunner().invoke(main, line)
    assert done.exit_code == 0, done.output
    space = {}
    exec(compile((tmp_path / "code/table.py").read_text(), "table.py", "exec"), space)
    found = space["table"](2.0, 0.3)[0][0]
    assert found == pytest.approx(tables["replicas"].member("2").lookup(2.0, 0.3)["u"])
    sampled = CliRunner().invoke(
        main, ["tables", "sample", "m.nc", "--at", "x=2", "--at", "y=0.3"]
    )
    assert "u_high" in sampled.output


@pytest.mark.parametrize(
    ("members", "message"),
    [
        ({"values": SEEDS}, "argument and values"),
        ({"argument": "seed"}, "argument and values"),
        (
            {"argument": "seed", "values": SEEDS, "functions": ["tabulated:softer"]},
            "or functions",
        ),
        ({"argument": "sed", "values": SEEDS}, "no argument 'sed'"),
        ({"argument": "x", "values": SEEDS}, "an axis and the argument of members"),
        ({"argument": "seed", "values": [1, 1]}, "different names"),
        ({"argument": "seed", "values": [1, 2], "rule": "hessian"}, "an odd number"),
        ({"argument": "seed", "values": [1, 2], "rule": "mean"}, "rule"),
        ({"functions": ["tabulated:four"]}, "axes.z is missing"),
    ],
)
def test_wrong_members_are_refused(members, message):
    with pytest.raises(InputError, match=message):
        wanted_of({"function": "tabulated:replica", **BASE, "members": members})


def test_members_that_a_file_lacks_are_refused(tables, tmp_path):
    table = _unhashed(tables["replicas"])
    for name in ("member_coefficients", "member_errors", "member_exact"):
        arrays = {n: a for n, a in table.arrays.items() if n != name}
        make_function.write(
            tmp_path / "bad.nc",
            type(table)(table.axes, table.outputs, arrays, table.attributes),
        )
        with pytest.raises(TableFileError, match=name):
            open_table(tmp_path / "bad.nc")
    plain = tables["replicas"].member("1")
    with pytest.raises(InputError, match="has no members"):
        plain.lookup(1.0, 0.5, members=True)


def test_a_failing_member_is_named(tmp_path):
    wrong = entries(values=[1, 2, "three"])
    with pytest.raises(InputError, match=r"\(member three\) raised"):
        make(wanted_of(wrong, target=1e-3), tmp_path / "t.nc")
    assert json.loads(wanted_of(wrong).as_json)["members"]["values"] == [1, 2, "three"]


VARIANTS = ("smooth", "bumped", "waved")
LINEAR = {"u": {"unit": "N"}, "v": {"error": "absolute"}}


@pytest.fixture(scope="module")
def variants(tmp_path_factory):
    """Files of three functions, each with boxes of its own."""
    folder = tmp_path_factory.mktemp("variants")
    found = {}
    for outputs in (OUTPUTS, LINEAR):
        kind = outputs["u"].get("transform", "linear")
        for name in VARIANTS:
            path = folder / f"{name}-{kind}.nc"
            entry = {"function": f"tabulated:{name}", **BASE, "outputs": outputs}
            make(wanted_of(entry, target=1e-5), path)
            found[kind, name] = path
    return found


@pytest.mark.parametrize("kind", ["log", "linear"])
@pytest.mark.parametrize("rule", ["replicas", "envelope"])
def test_tables_of_different_boxes_become_members(rule, kind, variants, tmp_path):
    files = [variants[kind, name] for name in VARIANTS]
    table = merge_members(tmp_path / "t.nc", files, rule)
    cells = {open_table(file).arrays["starts"].size for file in files}
    assert len(cells) == 3
    assert table.arrays["starts"].size > max(cells)  # none has the boxes of all
    assert table.members.names == VARIANTS
    assert table.replayed()[1] <= 1
    draws = np.random.default_rng(9)
    x, y = np.exp(draws.uniform(np.log(0.1), np.log(10), 2000)), draws.random(2000)
    found = table.lookup(x, y, members=True)
    exact = np.array([getattr(tabulated, name)(x, y) for name in VARIANTS])
    for k, output in enumerate(("u", "v")):
        value, low, high = ends_by_hand(rule, [*exact[:, k]]) if rule == "replicas" else (
            exact[0, k], exact[:, k].min(axis=0), exact[:, k].max(axis=0)
        )  # fmt: skip
        spread = found.spread[output]
        assert (np.abs(found[output] - value) <= found.error[output]).all()
        assert (np.abs(spread.low - low) <= spread.error).all()
        assert (np.abs(spread.high - high) <= spread.error).all()
        size = 1.0 if k else value
        assert (found.error[output] <= 1e-4 * size).all()
    for file, name in zip(files, VARIANTS, strict=True):
        alone = open_table(file).lookup(x, y)
        member = table.member(name).lookup(x, y)
        for output in ("u", "v"):
            np.testing.assert_allclose(
                member[output], alone[output], rtol=1e-13, atol=1e-13
            )


def test_the_command_merges_members(variants, tmp_path):
    out = str(tmp_path / "t.nc")
    files = [str(variants["log", name]) for name in VARIANTS]
    line = ["tables", "merge", out, *files]
    named = ["--name", "a", "--name", "b", "--name", "c"]
    done = CliRunner().invoke(main, [*line, "--members", "hessian", *named])
    assert done.exit_code == 0, done.output
    assert "3 members (hessian)" in done.output
    assert open_table(out).members.names == ("a", "b", "c")
    verified = CliRunner().invoke(main, ["tables", "verify", out])
    assert verified.exit_code == 0, verified.output
    for wrong, message in {
        (*line,): "--members merges tables",
        (*line, "--name", "a"): "--name is of members",
        (*line[:4], "--members", "envelope"): "two tables or more",
        (*line, out, "--members", "envelope"): "has members itself",
        (*line[:4], line[3], "--members", "envelope"): "different names",
        (
            *line[:4],
            str(variants["linear", "waved"]),
            "--members",
            "envelope",
        ): "outputs",
    }.items():
        refused = CliRunner().invoke(main, wrong)
        assert refused.exit_code != 0
        assert message in refused.output


def test_members_of_other_axes_are_refused(variants, tmp_path):
    axes = AXES | {"y": {"low": 0.0, "high": 2.0}}
    entry = {"function": "tabulated:softer", **BASE, "axes": axes}
    make(wanted_of(entry, target=1e-3), tmp_path / "wide.nc")
    files = [variants["log", "smooth"], tmp_path / "wide.nc"]
    with pytest.raises(InputError, match=r"axes of .*wide.nc differ .* high=2"):
        merge_members(tmp_path / "t.nc", files, "envelope")
    assert not (tmp_path / "t.nc").exists()


SPREADS = r"""
#include <stdio.h>
#include "made_members.h"
int main(void)
{
    double x[2];
    while (scanf("%lf %lf", x, x + 1) == 2) {
        made_spread found[2];
        const mbma_status status = made_spreads(x, found);
        for (int f = 0; f < 2; f++) {
            printf("%d %.17g %.17g %.17g", status != MBMA_OK, found[f].low, found[f].high, found[f].error);
            for (int m = 0; m < MADE_MEMBERS; m++)
                printf(" %.17g", found[f].members[m]);
            printf("\n");
        }
    }
}
"""


@pytest.fixture(scope="module")
def cells(tmp_path_factory):
    """cells.c of the exported files, compiled once for all rules."""
    folder = tmp_path_factory.mktemp("cells")
    for file in ("cells.c", "elementary.h", "four.h", "mbma.h"):
        (folder / file).write_text(core_file(file))
    subprocess.run(["gcc", "-std=c11", "-O0", "-c", "cells.c"], cwd=folder, check=True)
    return folder / "cells.o"


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no C compiler")
@pytest.mark.parametrize("rule", ["replicas", "envelope", "symmetric_hessian", "hessian"])
def test_c_of_all_members_answers_with_their_spread(rule, tables, cells, tmp_path):
    """Within the bounds of the functions themselves, at points where the self-test has none."""
    for file, text in function_code(tables[rule], "c", "made").items():
        (tmp_path / file).write_text(text)
    (tmp_path / "run.c").write_text(SPREADS)
    strict = ["-std=c11", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-O0"]
    line = ["gcc", *strict, "-c", "made.c", "made_members.c"]
    subprocess.run(line, cwd=tmp_path, check=True)
    shared = ["made.o", "made_members.o", str(cells), "-lm", "-o"]
    for program in ("made_members_selftest.c", "run.c"):
        line = ["gcc", *strict, program, *shared, program[:-2]]
        subprocess.run(line, cwd=tmp_path, check=True)
    tested = subprocess.run(["./made_members_selftest"], cwd=tmp_path, check=False)
    assert tested.returncode == 0
    x = [(0.11, 0.02), (2.0, 0.3), (9.0, 0.99)]
    text = "\n".join(f"{a} {b}" for a, b in [*x, (11.0, 0.5)])
    done = subprocess.run(
        ["./run"], cwd=tmp_path, input=text, text=True, capture_output=True, check=True
    )
    rows = np.array([line.split() for line in done.stdout.splitlines()], float)
    assert (rows[:-2, 0] == 0).all()
    assert (rows[-2:, 0] == 1).all()
    assert np.isnan(rows[-2:, 1:]).all()
    for k, point in enumerate(x):
        u = rows[2 * k, 1:]
        exact = [tabulated.replica(*point, seed)[0] for seed in SEEDS]
        _, low, high = ends_by_hand(rule, exact)
        assert abs(u[0] - low) <= u[2]
        assert abs(u[1] - high) <= u[2]
        assert u[2] <= 3e-5 * high
        np.testing.assert_allclose(u[3:], exact, rtol=1e-6)
