"""Island models of one's own: what the library asks of them, and that totals, laws, islands and scenes take them."""

import pathlib
import runpy

import numpy as np
import pytest

from mbma_tables import InputError, OutOfRangeError, Scene, Surface, contact, contact_law, greenwood_tripp, island
from mbma_tables.models.tables import open_table, shipped

ROOT = pathlib.Path(__file__).parents[2]
SURFACE = Surface(0.8, 0.3, 60.0, 0.7, 2.1)
GAPS = np.array([2.09, 1.0, -1.5, 2.5])


class Own:
    """The least that the library asks for."""

    name = "own"

    def __init__(self, change=lambda *answer: answer):
        self.change = change

    def answer(self, X, mu):
        return self.change(*greenwood_tripp.rigid_sphere(X, mu), np.full(X.shape, 1e-14))


def test_totals_laws_islands_and_scenes():
    for ask, given, load in ((contact, {"separation": GAPS}, "pressure"), (island, {"delta": [0.1, 1.0]}, "force")):
        found, known = (ask(SURFACE, **given, island_model=island_model) for island_model in (Own(), "rigid"))
        assert found.island_model == "own"
        for name in (load, "area", "error"):
            np.testing.assert_allclose(getattr(found, name), getattr(known, name), rtol=1e-13)
    law, known = (contact_law(SURFACE, rtol=1e-4, island_model=island_model) for island_model in (Own(), "rigid"))
    assert law.island_model == "own"
    np.testing.assert_allclose(law.pressure(separation=GAPS), known.pressure(separation=GAPS), rtol=1e-12)
    scene = Scene(SURFACE, effects=("pressure",), separations=[1.0], rtol=1e-4, island_model=Own()).run()
    expected = contact(SURFACE, separation=1.0, island_model="rigid").pressure
    assert float(scene["pressure"][0]) == pytest.approx(expected, rel=1e-4, abs=0)


def test_a_table_from_a_file_is_the_shipped_one():
    models = open_table(shipped("universal")), "universal"
    for derivatives in (False, True):
        found, known = (
            contact(SURFACE, separation=GAPS, island_model=model, derivatives=derivatives) for model in models
        )
        np.testing.assert_array_equal(found.pressure, known.pressure)
    np.testing.assert_array_equal(found.pressure_by["hurst"], known.pressure_by["hurst"])
    found, known = (contact_law(SURFACE, island_model=model).pressure(separation=1.0) for model in models)
    assert found == known


@pytest.mark.parametrize("bad", [None, 3, Own, object(), "unknown", type("Nameless", (), {"answer": 1})()])
def test_what_is_no_island_model(bad):
    for ask, given in ((contact, {"separation": 1.0}), (contact_law, {}), (island, {"delta": 1.0})):
        with pytest.raises(InputError, match="island_model must be one of"):
            ask(SURFACE, **given, island_model=bad)


def test_answers_are_checked():
    with pytest.raises(InputError, match=r"'own' must answer Phi_F, Phi_A and error of shape"):
        contact(SURFACE, separation=1.0, island_model=Own(lambda F, A, error: (F[0, :3], A, error)))
    with pytest.raises(InputError, match=r"'own' must answer"):
        contact(SURFACE, separation=1.0, island_model=Own(lambda F, A, error: F))
    silent = Own(lambda F, A, error: (np.where(np.median(F) < F, np.nan, F), A, error))
    with pytest.raises(OutOfRangeError, match="'own' has no answer for") as caught:
        contact(SURFACE, separation=[2.5, 1.0], island_model=silent)
    assert caught.value.mask.tolist() == [False, True]
    assert np.isnan(contact(SURFACE, separation=[2.5, 1.0], island_model=silent, outside="nan").pressure).tolist() == [
        False,
        True,
    ]
    # one number for all islands is enough
    one = contact(SURFACE, separation=1.0, island_model=Own(lambda F, A, error: (F, A, 1e-3)))
    assert 1e-3 <= one.error < 1.1e-3


def test_derivatives_that_a_model_does_not_have():
    with pytest.raises(InputError, match="derivatives come from island model 'universal', 'own' has none"):
        contact(SURFACE, separation=1.0, island_model=Own(), derivatives=True)


@pytest.mark.slow
def test_the_example_prints_what_its_page_shows(capsys):
    example = runpy.run_path(str(ROOT / "examples" / "own_island_model.py"))
    example["main"]([], standalone_mode=False)
    shown = capsys.readouterr().out.splitlines()
    page = (ROOT / "docs" / "lookup.md").read_text(encoding="utf-8")
    assert len(shown) == 8
    # bounds in the last digit apart, as from one machine to another
    assert all(f"    {line}" in page for line in shown if "states" not in line)
