"""Templates of source code."""

import pathlib

import jinja2
import pytest

from mbma_tables.export import text
from mbma_tables.export.code.languages import LANGUAGES


def test_a_place_that_nothing_is_given_for_is_an_error(tmp_path, monkeypatch):
    (tmp_path / "law.jinja").write_text(
        "{% if PRESENT %}\nint {{ NAME }};\n{% endif %}\n"
    )
    monkeypatch.setattr(text, "_ROOT", tmp_path)
    assert text.filled("law", PRESENT="yes", NAME="{{ x }} @X@") == "int {{ x }} @X@;\n"
    for parts in ({"PRESENT": "yes"}, {"NAME": "road"}):
        with pytest.raises(jinja2.UndefinedError, match="is undefined"):
            text.filled("law", **parts)


def test_user_subroutines_of_solvers_are_beside_the_languages_not_among_them():
    """C that Abaqus and CalculiX call was a language among others."""
    code = pathlib.Path(text.__file__).parent / "code"
    routines = {each.subroutine for each in LANGUAGES.values() if each.subroutine}
    assert routines == {"uinter", "vuinter", "gapcon"}
    for routine in routines:
        assert code.joinpath("subroutines", f"{routine}.c.jinja").is_file()
        assert not list(code.joinpath("languages").rglob(f"{routine}*"))
    for path in code.joinpath("languages").glob("*.py"):
        assert "subroutine(" not in path.read_text(encoding="utf-8")
