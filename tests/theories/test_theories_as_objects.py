"""Theories as values: their options are fields, and make equality, text and pickle; a user's have what shipped ones have."""

import dataclasses
import pickle

import numpy as np
import pytest

from mbma_tables import (
    Bodies,
    InputError,
    OutOfRangeError,
    Surface,
    contact,
    contact_law,
)
from mbma_tables.theories import (
    Calibrated,
    GreenwoodWilliamson,
    Mbma,
    Persson,
    Theory,
    TheoryAnswer,
    Variant,
    resolve,
)
from mbma_tables.theories.hardness import with_hardness

FACE = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0)
EACH = [Mbma, Calibrated, Persson, GreenwoodWilliamson]
OTHERS = [
    Mbma(island_model="exact"),
    Mbma(variant="printed"),
    Mbma(rtol=1e-4),
    Mbma(outside="nan"),
    Persson("simplified"),
]


@pytest.mark.parametrize("make", EACH)
def test_two_with_the_same_options_are_equal(make):
    assert make() == make() == resolve(make.name)
    assert hash(make()) == hash(make())
    assert repr(make()) == f"{make.__name__}()"
    assert all(make() != other for other in OTHERS)


@pytest.mark.parametrize("theory", OTHERS, ids=repr)
def test_options_are_in_text_and_pickle(theory):
    names = {"Mbma": Mbma, "Persson": Persson, "Variant": Variant}
    assert eval(repr(theory), names) == theory
    assert pickle.loads(pickle.dumps(theory)) == theory
    assert sum(theory != other for other in OTHERS) == len(OTHERS) - 1
    option = dataclasses.fields(theory)[0].name
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(theory, option, "another")


def test_a_pickle_leaves_out_what_was_computed():
    theory = Mbma(island_model="exact")
    size = len(pickle.dumps(theory))
    contact(FACE, separation=1.0, theory=theory)
    assert len(pickle.dumps(theory)) == size


class Plain:
    """A user's object with everything that it may have beside its answer."""

    name = "plain"
    ends_at_h_max = False

    def answer(self, surface, mean_separation):
        force = np.exp(-3 * mean_separation)
        return force, 0.1 * force

    def interval(self, surface, quantity="pressure"):
        return np.asarray(0.5), np.asarray(20.0)

    def scatter(self, surface, quantity, area):
        return np.full(np.shape(area), 0.25)

    def reasons(self, surface, answer, mean_separation):
        return {"u is below 1": mean_separation < 1}


@pytest.mark.parametrize("again", [False, True], ids=["itself", "pickled"])
def test_a_users_object_has_what_a_shipped_theory_has(again):
    theory = resolve(Plain())
    theory = pickle.loads(pickle.dumps(theory)) if again else theory
    found = contact(FACE, mean_separation=[0.6, 1.5, 5.0], theory=theory)
    assert found.reasons["u is below 1"].tolist() == [True, False, False]
    assert found.scatter.tolist() == [0.25, 0.25, 0.25]
    assert found.pressure == pytest.approx(np.exp(-3 * found.mean_separation))
    law = contact_law(FACE, theory=theory)
    assert law.pressure(5.0) == pytest.approx(np.exp(-15.0), rel=1e-6)
    for ask in (law.at, lambda u: contact(FACE, mean_separation=u, theory=theory)):
        for beyond in (0.4, 21.0):
            with pytest.raises(OutOfRangeError):
                ask(beyond)


class Borrowed:
    """A user's object that answers what a shipped theory does."""

    name = "borrowed"

    def __init__(self, theory):
        self.theory = theory
        self.ends_at_h_max = theory.ends_at_h_max
        self.interval = theory.interval

    def answer(self, surface, mean_separation):
        answer = self.theory.answer(surface, mean_separation)
        return answer.pressure, answer.area


def test_a_users_object_can_have_a_hardness():
    shipped = resolve("persson")
    metal = Bodies(100.0, hardness=3.0)
    pressures = [0.01, 0.1, 0.5]
    known = contact(FACE, metal, pressure=pressures, theory=shipped)
    found = contact(FACE, metal, pressure=pressures, theory=Borrowed(shipped))
    assert (known.yielded > 0.5).all()
    assert found.area == pytest.approx(known.area, rel=1e-7)
    assert found.yielded == pytest.approx(known.yielded, rel=1e-6)
    wrapped = with_hardness(resolve(Borrowed(shipped)), 0.03)
    u = known.mean_separation
    assert 100.0 * wrapped.answer(FACE, u).pressure == pytest.approx(pressures, rel=1e-7)


class Pair(Theory):
    name = "pair"

    def answer(self, surface, mean_separation):
        return mean_separation, mean_separation


class Triple:
    name = "triple"

    def answer(self, surface, mean_separation):
        return 1.0, 2.0, 3.0


class Short:
    name = "short"

    def answer(self, surface, mean_separation):
        return np.ones(7), np.ones(7)


@pytest.mark.parametrize(
    ("theory", "said"),
    [
        (Pair(), "'pair', a Theory, must answer a TheoryAnswer of"),
        (Triple(), "'triple' must answer F/"),
        (Short(), "'short' must answer F/"),
    ],
    ids=["pair", "triple", "short"],
)
def test_answers_of_another_kind_are_refused(theory, said):
    with pytest.raises(InputError, match=said):
        contact(FACE, mean_separation=[1.0, 2.0], theory=theory)


def test_options_of_a_users_dataclass():
    @dataclasses.dataclass(frozen=True, repr=False)
    class Exponential(Theory):
        decay: float
        strength: float = 0.1

        name = "exponential"

        def answer(self, surface, mean_separation):
            force = self.strength * np.exp(-mean_separation / self.decay)
            return TheoryAnswer(force, force, force / self.decay, np.zeros(force.shape))

    assert repr(Exponential(0.5)).endswith("Exponential(decay=0.5, strength=0.1)")
    assert Exponential(0.5) == Exponential(0.5, 0.1) != Exponential(0.6)
    assert Exponential(0.5).options == {"decay": 0.5, "strength": 0.1}
    assert (
        contact(FACE, mean_separation=1.0, theory=Exponential(0.5)).theory
        == "exponential"
    )
