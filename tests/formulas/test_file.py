"""The formula file: its certificate measured anew, and what is refused."""

import copy
import json
import subprocess
import sys

import numpy as np
import pytest

from mbma_tables import OutOfRangeError, TableFileError, contact, greenwood_tripp
from mbma_tables.files import shipped_file
from mbma_tables.formulas import file
from mbma_tables.formulas.file import ISLAND_FORMS, TOTALS, check, get_form, read, write
from mbma_tables.surfaces.surface import Surface


@pytest.fixture(scope="module")
def document():
    return json.loads(shipped_file("formula.json").read_text())


@pytest.mark.parametrize("name", ISLAND_FORMS)
def test_island_certificate_on_points_of_its_own(name):
    form = get_form(name)
    rng = np.random.default_rng(77)
    X = rng.uniform(*form.range["X"], 4000)
    mu = 10 ** rng.uniform(-8, np.log10(form.range["mu"][1]), 4000)
    solved = greenwood_tripp.solve(X, mu, rtol=1e-9)
    found = form.evaluate({"X": X, "mu": mu})
    for result in form.outputs:
        error = np.abs(found[result] / getattr(solved, result) - 1).max()
        # a tenth for points that the certificate's own did not meet
        assert error <= 1.1 * form.largest_error(result)
        assert error >= 0.3 * form.largest_error(result)


@pytest.mark.parametrize(
    ("name", "largest", "count"), [("pocket", 0.05, 10), ("standard", 0.01, 24), ("long", 1e-3, 80)]
)
def test_what_was_promised(name, largest, count):
    form = get_form(name)
    for result in form.outputs:
        assert form.largest_error(result) <= largest
        assert form.coefficients[result] <= count


@pytest.mark.parametrize("name", ISLAND_FORMS)
def test_the_rigid_limit(name):
    form = get_form(name)
    X = np.linspace(form.range["X"][0], form.range["X"][1], 200)
    mu = np.full(200, 1e-12)
    found = form.evaluate({"X": X, "mu": mu})
    rigid = greenwood_tripp.rigid_sphere(X, mu)
    for number, result in enumerate(form.outputs):
        assert np.abs(found[result] / rigid[number] - 1).max() < 3e-3


@pytest.mark.parametrize("name", ISLAND_FORMS)
def test_positive_and_rising_down_to_no_load(name):
    form = get_form(name)
    X = np.linspace(*form.range["X"], 500)
    mu = np.concatenate([[0.0, 5e-324, 1e-300], np.geomspace(1e-30, form.range["mu"][1], 500)])
    flat = [np.ascontiguousarray(a).ravel() for a in np.broadcast_arrays(X[:, None], mu)]
    for values in form.evaluate(dict(zip(form.arguments, flat, strict=True))).values():
        field = values.reshape(X.size, mu.size)
        assert (field >= 0).all()
        assert (np.diff(field[:, 3:], axis=0) > 0).all()


def test_no_result_is_silently_infinite():
    with pytest.raises(OutOfRangeError, match="phi_F of the pocket form must be finite") as caught:
        get_form("pocket").evaluate({"X": np.array([1.0, -9.0, 2.0]), "mu": np.ones(3)})
    assert caught.value.mask.tolist() == [False, True, False]


def test_totals_certificate_on_surfaces_of_its_own():
    form = get_form(TOTALS)
    rng = np.random.default_rng(78)
    count = 3000
    surface = Surface(
        rng.uniform(0.5, 1, count), 1.0, np.exp(rng.uniform(np.log(10), np.log(1000), count)), 1.0,
        rng.uniform(3, 4.5, count),
    )  # fmt: skip
    gap = surface.h_max - np.exp(rng.uniform(np.log(0.1), np.log(2 * surface.h_max)))
    exact = contact(surface, gap)
    some = exact.area > form.range["area"][0]
    found = form.evaluate(
        {"d_over_h_rms": gap, "h_max_over_h_rms": surface.h_max, "zeta_1": surface.zeta_1, "hurst": surface.hurst}
    )
    for result in form.outputs:
        error = np.abs(found[result] / getattr(exact, result) - 1)[some].max()
        assert error <= 1.1 * form.largest_error(result)


def spoiled(document, change):
    other = copy.deepcopy(document)
    change(other)
    other["data_hash"] = file.data_hash(other)
    return other


BROKEN = {
    "format": lambda d: d.update(format="other"),
    "version": lambda d: d.update(format_version=2),
    "forms": lambda d: d["forms"].pop("long"),
    "steps": lambda d: d["forms"]["pocket"].update(steps=[]),
    "step": lambda d: d["forms"]["pocket"]["steps"].append(["a", "b", "c"]),
    "unknown": lambda d: d["forms"]["pocket"]["steps"].append(["extra", "nothing + 1"]),
    "twice": lambda d: d["forms"]["pocket"]["steps"].append(["X", "1"]),
    "call": lambda d: d["forms"]["pocket"]["steps"].append(["extra", "open(X)"]),
    "outputs": lambda d: d["forms"]["pocket"].update(outputs={"phi_F": "phi_F"}),
    "unhashable": lambda d: d["forms"]["pocket"]["outputs"].update(phi_F={}),
    "range": lambda d: d["forms"]["pocket"].update(range={"X": [1, 0], "mu": [0, 1]}),
    "errors": lambda d: d["forms"]["pocket"].update(errors={}),
    "provenance": lambda d: d.update(provenance=3),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_broken_documents(document, kind):
    with pytest.raises(TableFileError):
        check(spoiled(document, BROKEN[kind]))


def test_a_changed_constant_is_noticed(document):
    other = copy.deepcopy(document)
    other["forms"]["pocket"]["steps"][0][1] = "1/(X + 3.0)"
    with pytest.raises(TableFileError, match="data_hash does not fit"):
        check(other)


@pytest.mark.parametrize("text", ["", "[]", "{", "[" * 100_000, "{}", '{"format": 1}'])
def test_files_that_are_none(tmp_path, text):
    path = tmp_path / "formula.json"
    path.write_text(text)
    with pytest.raises(TableFileError):
        read(path)


def test_a_huge_file_is_not_read(tmp_path):
    path = tmp_path / "formula.json"
    with path.open("wb") as stream:
        stream.truncate(10_000_000_000)
    with pytest.raises(TableFileError, match="at most"):
        read(path)


def test_written_and_read_back(document, tmp_path):
    path = tmp_path / "formula.json"
    write(path, document["forms"], document["provenance"])
    assert read(path) == check(document)
    assert [p.name for p in tmp_path.iterdir()] == ["formula.json"]


def test_nothing_is_unpickled_and_scikit_learn_stays_out():
    code = (
        "import sys, mbma_tables as m; m.contact(m.Surface(0.8, 1.0, 100.0, 1.0, 3.0), 1.0, tier='formula'); "
        "print(sorted({'sklearn', 'joblib'} & set(sys.modules)))"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "[]"
