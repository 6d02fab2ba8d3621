"""Templates of source code."""

import jinja2
import pytest

from mbma_tables.export import text


def test_a_place_that_nothing_is_given_for_is_an_error(tmp_path, monkeypatch):
    (tmp_path / "law.jinja").write_text(
        "{% if PRESENT %}\nint {{ NAME }};\n{% endif %}\n"
    )
    monkeypatch.setattr(text, "_ROOT", tmp_path)
    assert text.filled("law", PRESENT="yes", NAME="{{ x }} @X@") == "int {{ x }} @X@;\n"
    for parts in ({"PRESENT": "yes"}, {"NAME": "road"}):
        with pytest.raises(jinja2.UndefinedError, match="is undefined"):
            text.filled("law", **parts)
