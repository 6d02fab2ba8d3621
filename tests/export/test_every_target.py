"""Numbers of every target, read back or run, beside the library's contacts: random laws in four systems of units.

`python -m benchmarks exports` has a thousand of them, and the table of docs/export.md.
"""

import dataclasses
import itertools
import shutil

import pytest
from helpers import skip_without_package

from benchmarks import programs
from generate.pages import export
from mbma_tables.export.code.languages import LANGUAGES
from mbma_tables.export.registry import targets

OF_ROWS = targets("SOLVERS", "DATA")
OF_CODE = programs.of_code()
QUICK = ("c-law", "javascript-law", "python-law")
# laws by their numbers, of which the first is in the units that some programs prescribe
FIRST = 2000


@pytest.fixture(scope="module")
def rows():
    """Rows of a law of every kind, all quantities in turns, and all of the joint in metres and pascals."""
    made = []
    for place, kind in enumerate(programs.KINDS):
        one = programs.case(FIRST + place, kind, programs.SYSTEMS[place])
        names = list(programs.quantities(one))
        some = names if place == 0 else (names[0], names[place])
        made += [(one, programs.rows(one, name)) for name in some]
    return made


@pytest.mark.parametrize("name", OF_ROWS)
def test_numbers_of_rows_are_those_of_the_library(name, rows):
    skip_without_package(name)
    found = [programs.in_rows(one, OF_ROWS[name], law) for one, law in rows]
    found = [one for one in found if one is not None]
    assert found
    for one in found:
        assert 0 < one.share <= 1


@pytest.mark.parametrize(
    ("number", "kind", "quantity"),
    [(410, "map", "tangential_stiffness"), (589, "mbma", "hydraulic_aperture")],
)
def test_errors_of_jumps_and_of_slopes_are_stated(number, kind, quantity):
    """Of the thousand: a jump between two points of the fine curve, a slope of the law's polynomials."""
    one = programs.case(number, kind)
    found = programs.in_rows(one, OF_ROWS["csv"], programs.rows(one, quantity))
    assert found.share <= 1


def test_a_wrong_number_is_noticed(rows):
    """The comparison does not pass what is no number of the library."""
    one, law = rows[0]
    wrong = dataclasses.replace(law, y=1.003 * law.y)
    found = programs.in_rows(one, OF_ROWS["csv"], wrong)
    assert found.share > 1


def skip_without(name):
    """Skip the test where the programs of a target are not installed."""
    words = ["cc"]
    modules = ["fmpy"] if name.startswith("fmu") else []
    if name in LANGUAGES:
        program = LANGUAGES[name].program
        modules = program.modules
        words = [command.split()[0] for command in program.commands]
    for word in {*words} - {"python"}:
        if not word.startswith("./") and shutil.which(word) is None:
            pytest.skip(f"not installed: {word}")
    for module in modules:
        pytest.importorskip(module)


@pytest.mark.parametrize(
    ("name", "place"),
    [
        pytest.param(name, place, marks=() if name in QUICK else pytest.mark.slow)
        for name, place in zip(OF_CODE, itertools.count())
    ],
)
def test_functions_of_code_are_those_of_the_library(name, place, tmp_path):
    skip_without(name)
    kinds = programs.kinds_of(name)
    system = programs.SYSTEMS[place // 2 % len(programs.SYSTEMS)]
    one = programs.case(FIRST + place, kinds[-place % len(kinds)], system)
    found = OF_CODE[name](one, name, tmp_path)
    assert 0 < found.share <= 1


def test_every_target_states_what_it_does_outside_the_range():
    assert [name for name, target in targets().items() if not target.outside] == []


def test_the_stiffness_of_a_map_that_falls_with_pressure_keeps_its_rows():
    """Rows below the value at the smallest pressure were left out wherever they were."""
    one = programs.case(81, "map")
    law = programs.rows(one, "tangential_stiffness")
    assert programs.in_rows(one, OF_ROWS["csv"], law).share <= 1


def test_a_film_without_a_valid_factor_states_its_errors():
    """They were stated as zero."""
    one = programs.case(171, "joint")
    law = programs.rows(one, "film")
    assert programs.in_rows(one, OF_ROWS["csv"], law).share <= 1
    assert law.largest_error > 0


def test_a_new_target_is_listed_before_it_is_measured(monkeypatch, tmp_path):
    """The table failed for one, and its recipe then took a file more."""
    path = tmp_path / "exports.csv"
    path.write_text(export.MEASURED.read_text(encoding="utf-8").splitlines()[0] + "\n")
    monkeypatch.setattr(export, "MEASURED", path)
    for name in targets():
        assert f"| `{name}` | not measured |" in export.formats()[0]["programs"]
