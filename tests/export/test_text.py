"""Nothing that a table, a variant or a user says becomes code: hostile text leaves the same code as plain text."""

import copy
import csv
import dataclasses
import io
import re

import pytest

from mbma_tables import InputError, Surface
from mbma_tables.export import CODE, SOLVERS, code, conformance, data, solvers
from mbma_tables.export.law_rows import describe_law
from mbma_tables.export.text import checked_name
from mbma_tables.models.tables import universal_model
from mbma_tables.models.universal import UniversalModel
from mbma_tables.surfaces.variants import get_variant

HOSTILE = (
    "x */ int evil(void); /* \n*INCLUDE, INPUT=evil\r\nsystem('evil') ??/\u2028evil()\x0cevil\x85"
    "@WASM@ @CLOSED_FORMS@ </script><script>evil()//\x00\\"
)
COMMENT_MARKS = {"calculix": "**", "abaqus": "**", "lsdyna": "$", "optistruct": "$", "comsol": "%", "moose": "#"} | {
    "modelica": "#"
}


@pytest.fixture(scope="module")
def law():
    return describe_law(Surface.named("concrete"), 13.3, length_unit="mm", stress_unit="MPa", rows=5)


def hostile_law(law):
    return dataclasses.replace(law, comments=(HOSTILE, *law.comments[1:], HOSTILE), x_unit=HOSTILE, y_unit=HOSTILE)


@pytest.mark.parametrize("target", CODE)
def test_source_code(target, monkeypatch):
    monkeypatch.setattr(code, "web_assembly", lambda *given: b"wasm")
    content = copy.copy(universal_model().content)
    # a certificate's numbers are numbers in any case; the rest is text of the file
    texts = {name: HOSTILE for name, value in content.attributes.items() if isinstance(value, str)}
    attributes = content.attributes | texts | {"certificate_points": HOSTILE}
    model = UniversalModel(dataclasses.replace(content, attributes=attributes))
    variant = dataclasses.replace(get_variant("reported"), name=HOSTILE)

    def live(texts):
        return [
            line
            for name, text in texts.items()
            for line in re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL).splitlines()
            if line.strip() and not (line.startswith("!") and name.endswith(".f90"))
        ]

    found = code.source_texts(target, model, variant)
    assert any("int evil" in text for text in found.values())
    assert live(found) == live(code.source_texts(target, universal_model(), get_variant("reported")))
    assert all(text.isascii() for text in found.values())
    assert "</script" not in found.get("mbma.mjs", "")
    points, plain = (
        [line for line in conformance.points_text(*of).splitlines() if not line.startswith("#")]
        for of in ((model, variant), (universal_model(), get_variant("reported")))
    )
    assert points == plain


@pytest.mark.parametrize("target", SOLVERS)
def test_solver_decks(target, law):
    def live(text):
        return [line for line in text.splitlines() if not line.startswith(COMMENT_MARKS[target])]

    write = getattr(solvers, target)
    assert live(write(hostile_law(law))) == live(write(law))


@pytest.mark.parametrize("name", ["A\n*INCLUDE, INPUT=evil", "A, B", "", "1", "x'); system('evil", "é", "A" * 81, 3])
def test_names_of_cards_and_functions(name, law):
    writers = (solvers.calculix, solvers.abaqus, solvers.modelica, data.matlab_reader)
    for write in writers:
        with pytest.raises(InputError, match="a name must be a letter"):
            write(law, name)
    assert checked_name("Rough_2", 7) == "Rough_2"


def test_matlab_reader(law):
    lines = data.matlab_reader(hostile_law(law), "law").decode().splitlines()
    changed = dataclasses.replace(law, comments=(law.comments[0], HOSTILE))
    hostile = data.matlab_reader(changed, "law").decode().splitlines()
    assert [line for line in hostile if not line.startswith("%")] == [line for line in lines if line[0] != "%"]


@pytest.mark.parametrize("unit", ["mW/(mm, K)", 'a "quoted" unit', "=HYPERLINK(evil)", "µm"])
def test_csv_cells(unit, law):
    changed = dataclasses.replace(law, y_unit=unit, comments=(*law.comments, f"in {unit}\n=HYPERLINK(evil)"))
    lines = data.to_csv(changed).decode().splitlines()
    head = len(changed.comments)
    assert all(line.startswith("# ") for line in lines[:head])
    cells = list(csv.reader(io.StringIO("\n".join(lines[head:]))))
    assert cells[0] == ["overclosure [mm]", f"pressure [{unit}]"]
    assert [[float(cell) for cell in row] for row in cells[1:]] == [list(row) for row in zip(law.x, law.y, strict=True)]


@pytest.mark.parametrize("name", ["=1+1", "+1", "-1", "@SUM", "\tx"])
def test_csv_cells_are_no_formulas(name, law):
    last = data.to_csv(dataclasses.replace(law, x_name=name)).decode().splitlines()[len(law.comments)]
    assert next(csv.reader([last]))[0] == f"'{name} [mm]"


@pytest.mark.parametrize("unit", ["W\n*INCLUDE, INPUT=evil", "W\u2028"])
@pytest.mark.parametrize("which", ["length_unit", "stress_unit", "conductivity_unit"])
def test_units_are_printable(which, unit):
    units = {"length_unit": "mm", "stress_unit": "MPa", "conductivity_unit": "mW/K"} | {which: unit}
    with pytest.raises(InputError, match=r"is no known unit|is not printable"):
        describe_law(Surface.named("concrete"), 13.3, quantity="conductance", conductivity=1.0, rows=5, **units)
