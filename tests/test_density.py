"""Figures of `benchmarks/density.py`, on sources whose counts are known."""

import pytest

from benchmarks.density import Density, density, table

SOURCE = '''"""Docstring
of two lines, with a text that is not counted."""

# a comment
from typing import Any


def area(radius: Any) -> float:
    """Of a disc."""
    # Archimedes
    return 3.14 * radius**2  # behind code, this is no comment line
'''


def test_lines_are_code_without_docstrings_comments_and_empty_lines():
    counts = density(SOURCE)
    assert (counts.lines, counts.comments, counts.any_types) == (3, 2, 2)
    assert counts.figures()["comments/100"] == pytest.approx(200 / 3)
    assert counts.figures()["Any/1000"] == pytest.approx(2000 / 3)


def test_nodes_are_those_of_the_syntax_tree():
    # module, assignment, name, its context, number
    assert density("x = 1\n").figures()["nodes/line"] == 5


@pytest.mark.parametrize(("length", "long_lines"), [(90, 0), (91, 1)])
def test_a_line_of_90_characters_is_not_long(length, long_lines):
    assert density("x = " + "1" * (length - 4)).long_lines == long_lines


@pytest.mark.parametrize(
    ("source", "nested"),
    [
        ("[x for x in y]", 0),
        ("[x for x in y if x], {x for x in y}", 0),
        ("[x for y in z for x in y]", 1),
        ("{x: [y for y in x] for x in z}", 1),
        ("[x for x in [y for y in (z for z in w)]]", 2),
    ],
)
def test_a_comprehension_is_nested_with_two_loops_or_another_inside(source, nested):
    assert density(source).nested == nested


@pytest.mark.parametrize(
    ("source", "packed"),
    [
        ("x, y = 1, 2", 1),
        ("x, y = y, x", 1),
        ("x, y = pair", 0),
        ("x = 1, 2", 0),
        ("x, y = [1, 2]", 0),
    ],
)
def test_packed_are_assignments_of_a_tuple_to_a_tuple(source, packed):
    assert density(source).packed == packed


def test_names_that_hide_are_counted_where_they_are_assigned():
    counts = density(
        "found = pressure = area\nknown: int = found\nfor own in found:\n    gap = own.found\n"
    )
    assert (counts.names, counts.hiding_names) == (5, 3)
    assert counts.figures()["hiding [%]"] == 60


def test_a_table_has_a_row_for_each_folder_without_its_tests(tmp_path):
    for name in ("empty", "rows/tests", "rows/.hidden"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "rows" / "one.py").write_text("x = 1\n")
    (tmp_path / "rows" / "two.py").write_text("x, y = 1, 2\n")
    for unread in ("tests/three.py", ".hidden/four.py", "test_five.py"):
        (tmp_path / "rows" / unread).write_text("found = 1\n")
    heading, empty, rows = table([tmp_path / "empty", tmp_path / "rows"]).splitlines()
    assert heading.split()[:3] == ["code", "lines", "nodes/line"]
    assert empty.split() == ["empty", "0", *["0.0"] * 7]
    # 5 nodes of the first file; 12 of the second: the module, the assignment, two tuples and two
    # names with a context each, and two numbers
    assert rows.split() == [
        "rows",
        "2",
        "8.5",
        "0.0",
        "0.0",
        "0.0",
        "500.0",
        "0.0",
        "0.0",
    ]


def test_counts_of_several_sources_add_up():
    assert density("x = 1\n") + Density(lines=2, nested=3) == Density(
        lines=3, nodes=5, nested=3, names=1
    )
