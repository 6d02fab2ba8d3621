"""README: its measured parts are those that the generator writes, and a newcomer meets results before terms."""

import re

from generate.pages import introduction
from generate.pages.page import MARKED, ROOT, svg

TEXT = (ROOT / "README.md").read_text(encoding="utf-8")


def test_it_is_short_and_begins_with_results():
    lines = TEXT.splitlines()
    assert len(lines) <= 90
    first = TEXT.index("print(")
    assert all(TEXT.index(word) > first for word in ("island_model", "variant"))
    assert len(re.findall(r"^```python$", TEXT, re.MULTILINE)) == 3


def test_measured_parts_are_the_generators():
    parts, files = introduction.readme()
    assert {match[2]: match[0] for match in MARKED.finditer(TEXT)} == {
        name: f"<!-- measured: {name} -->\n\n{part}\n\n<!-- end -->" for name, part in parts.items()
    }
    for name, figure in files.items():
        assert (ROOT / name).read_bytes()[:5] == svg(figure)[:5] == b"<?xml"
    assert introduction.pocket_laws() in (ROOT / "docs" / "formula.md").read_text(encoding="utf-8")


def test_pocket_laws_are_printed_as_they_are_computed():
    """The text's constants against the functions whose errors are told."""
    for page in (TEXT, (ROOT / "docs" / "formula.md").read_text(encoding="utf-8")):
        pocket = page[page.index("    t = p/(E* g)/") :]
        names = {"log": __import__("math").log, "erf": __import__("math").erf, "exp": __import__("math").exp}
        names |= {"sqrt": __import__("math").sqrt, "p": 0.04, "alpha": 30.0, "nu": 0.6, "x": 1.3}
        lines = [line.strip() for line in pocket.splitlines()[:4]]
        for line in lines:
            name, _, text = line.partition(" = ")
            text = (
                text.replace("E* q0 h_rms ", "").replace("u/h_rms", "x").replace("(E* g)", "1").replace("ln(", "log(")
            )
            text = re.sub(r"\((x)\)\^(-[\d.]+) exp", r"\1**\2*exp", text)
            text = re.sub(r"([\d.]) (log|x|\()", r"\1*\2", text).replace("p/1 sqrt", "p*sqrt")
            names[name] = eval(text, {}, names)
            if name == "A/A0":
                assert abs(names[name] / float(introduction.pocket_area(0.04, 30.0)) - 1) < 1e-12
        assert abs(names["p"] / float(introduction.pocket_pressure(1.3, 0.6)) - 1) < 1e-12
