"""What a law is asked by: gaps, pressures and areas, in any form, as `contact` takes them and with its answers."""

import itertools
import pickle
import warnings

import numpy as np
import pytest
import xarray as xr

from mbma_tables import (
    Bodies,
    InputError,
    Joint,
    OutOfRangeError,
    Surface,
    contact,
    contact_law,
)
from mbma_tables.contacts.result import Contact
from mbma_tables.theories import Mbma, Theory

FACE = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0, unit="um")
BODIES = Bodies("100 GPa", conductivity="45 W/(m K)", nu=0.3)
# deep islands of a surface this rough lie outside the universal table
ROUGH = Surface(hurst=0.05, q0=1, q1=1e8, h_rms=1, h_max=4.5)
QUESTIONS = {
    "mean_separation": 2.0,
    "separation": 1.0,
    "pressure": 0.008,
    "area": 0.003,
}
METHODS = (
    "pressure",
    "area",
    "stiffness",
    "area_slope",
    "energy",
    "separation",
    "mean_separation",
    "unloading_stiffness",
    "solid_conductance",
    "leakage",
    "slope_error",
    "pressure_and_stiffness",
    "values",
)
METHODS_OF_CONTACTS = METHODS[:3] + METHODS[4:9]


@pytest.fixture(scope="module", params=["mbma", "calibrated", "persson"])
def law(request):
    return contact_law(FACE, BODIES, theory=request.param)


def test_whatever_is_asked_answers_with_a_contact(law):
    """A law answered `at_pressure` with five numbers alone."""
    theory = law.theory
    joint = Joint(FACE, bodies=BODIES, theory=theory)
    answers = [
        contact(FACE, BODIES, pressure=0.008, theory=theory),
        law.at(pressure=0.008),
        law.at_pressure(0.008),
        joint.at(pressure=0.008),
        joint.at_pressure(0.008),
    ]
    known = answers[0].to_dataset()
    for answer in answers:
        assert isinstance(answer, Contact)
        found = answer.to_dataset()
        assert set(found) >= set(known) > {"pressure", "solid_conductance", "valid"}
        for name in ("mean_separation", "area", "stiffness", "energy"):
            assert float(found[name]) == pytest.approx(float(known[name]), rel=1e-6)


def forms(name, value):
    """A number as text, list, tuple, array and DataArray, each of two entries but for the text."""
    unit = {"pressure": " GPa", "area": ""}.get(name, " um")
    two = [value, 0.9 * value]
    yield f"{value}{unit}"
    yield from (two, tuple(two), np.array(two), xr.DataArray(two, dims="k"))
    yield [f"{number}{unit}" for number in two]


@pytest.mark.parametrize("name", QUESTIONS)
def test_every_method_takes_every_question_in_every_form(law, name):
    value = QUESTIONS[name]
    for method in METHODS:
        ask = getattr(law, method)
        one = np.array(ask(**{name: value}))
        other = np.array(ask(**{name: 0.9 * value}))
        both = np.stack([one, other], axis=-1)
        for given in forms(name, value):
            expected = one if isinstance(given, str) else both
            np.testing.assert_allclose(ask(**{name: given}), expected, rtol=1e-12)
            if name == "mean_separation":
                np.testing.assert_array_equal(ask(given), ask(**{name: given}))


@pytest.mark.parametrize("name", QUESTIONS)
def test_answers_are_those_of_contact(law, name):
    given = {name: QUESTIONS[name] * np.array([1.0, 0.9, 1.05])}
    pressed = contact(FACE, BODIES, theory=law.theory, **given)
    for method, quantity in itertools.product((True, False), METHODS_OF_CONTACTS):
        value = getattr(law, quantity)(**given) if method else None
        value = value if method else getattr(law.at(**given), quantity)
        expected = getattr(pressed, quantity)
        np.testing.assert_allclose(value, expected, rtol=2e-6, err_msg=quantity)


def test_bodies_apart_are_at_the_distance_of_their_mean_planes():
    law = contact_law(FACE, BODIES, theory="calibrated")
    gaps = np.array([3.0, 3.5, 10.0])
    for name in ("separation", "mean_separation"):
        pressed = contact(FACE, BODIES, theory="calibrated", **{name: gaps})
        by_law = law.at(**{name: gaps})
        for quantity in ("separation", "mean_separation"):
            np.testing.assert_array_equal(getattr(by_law, quantity), gaps)
            np.testing.assert_array_equal(getattr(pressed, quantity), gaps)
            np.testing.assert_array_equal(getattr(law, quantity)(**{name: gaps}), gaps)
        np.testing.assert_array_equal(
            by_law.gap_conductance("air"), pressed.gap_conductance("air")
        )
        np.testing.assert_allclose(
            law.leakage(**{name: gaps}), pressed.flow_coefficient, rtol=1e-3
        )
        assert not np.any(by_law.pressure)


def test_gaps_at_the_largest_numbers_are_answered_without_a_warning():
    largest = 1e308
    law = contact_law(FACE, BODIES, theory="mbma")
    endless = contact_law(FACE, BODIES, theory="persson")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for gap in (largest, [largest], np.full(100, largest)):
            assert not np.any(law.pressure(gap))
            assert np.all(law.at(gap).mean_separation == largest)
            with pytest.raises(OutOfRangeError, match="where the law ends"):
                endless.pressure(gap)


def test_a_labelled_gap_in_another_unit_is_refused_by_every_method():
    law = contact_law(FACE, BODIES, theory="calibrated")
    gap = xr.DataArray([0.001, 0.002], dims="k", attrs={"units": "mm"})
    for method in (*METHODS, "at", "plane_separation"):
        for name in ("mean_separation", "separation"):
            with pytest.raises(InputError, match="in 'mm' by its attribute units"):
                getattr(law, method)(**{name: gap})
    in_its_unit = gap * 1000
    in_its_unit.attrs["units"] = "um"
    np.testing.assert_array_equal(
        law.pressure(in_its_unit), law.pressure(in_its_unit.values)
    )


@pytest.mark.parametrize("given", [True, [True, False], "2 kg", None, np.nan, [], "x"])
def test_what_is_no_gap_is_refused_by_every_method(given):
    law = contact_law(FACE, BODIES, theory="calibrated")
    for method in (*METHODS, "at", "plane_separation"):
        with pytest.raises(InputError):
            getattr(law, method)(given)


def test_a_question_has_one_quantity():
    law = contact_law(FACE, BODIES, theory="calibrated")
    for method in (*METHODS, "at", "tangential", "plane_separation"):
        ask = getattr(law, method)
        for names in ((), ("pressure", "area"), ("separation", "pressure")):
            given = {name: QUESTIONS[name] for name in names}
            with pytest.raises(InputError, match="give exactly one of separation, mean"):
                ask(**given)
        with pytest.raises(InputError, match="got separation and mean_separation"):
            ask(2.0, separation=1.0)
        with pytest.raises(TypeError, match="unexpected keyword argument 'v'"):
            ask(v=1.0)


def test_the_work_of_loading_a_yielded_contact_is_no_energy():
    law = contact_law(FACE, Bodies("100 GPa", hardness="1 GPa"), theory="calibrated")
    again = pickle.loads(pickle.dumps(law))
    for ask in (law.energy, again.energy):
        with pytest.raises(InputError, match="is the work of loading"):
            ask(2.0)
    with pytest.raises(InputError, match="is the work of loading"):
        law.compiled("energy")
    assert "energy" not in law.to_dataset()
    by_theory = contact(
        FACE, law.setup.bodies.bodies, mean_separation=2.0, theory="calibrated"
    )
    assert law.at(2.0).energy == pytest.approx(by_theory.energy, rel=1e-4)


def test_energy_by_pressure_is_the_laws():
    """It took the theory's quadrature, hundreds of times longer; that is asked for no more."""

    class Counted(Theory):
        name = "counted"
        count = 0

        def answer(self, surface, mean_separation):
            type(self).count += 1
            return contact_law_of_the_test.setup.theory.answer(surface, mean_separation)

    contact_law_of_the_test = contact_law(FACE, theory="calibrated")
    law = contact_law(FACE, theory=Counted())
    before = Counted.count
    u = law.at_pressure(1e-4).mean_separation
    assert law.at(pressure=1e-4).energy == pytest.approx(law.energy(u), rel=1e-12)
    assert Counted.count == before


@pytest.mark.parametrize("outside", ["exact", "nan"])
def test_islands_beyond_the_table_are_as_the_theory_says(outside):
    theory = Mbma(outside=outside)
    law = contact_law(ROUGH, theory=theory)
    d = np.array([-4.4, -1.0, 2.9, 3.5])
    pressed = contact(ROUGH, separation=d, theory=theory)
    assert np.isnan(pressed.pressure).any() == (outside == "nan")
    for quantity in ("pressure", "area"):
        np.testing.assert_allclose(
            getattr(law, quantity)(separation=d), getattr(pressed, quantity), rtol=1e-8
        )
    one = law.pressure(separation=-1.0)
    assert np.isnan(one) == (outside == "nan")
    with pytest.raises(OutOfRangeError, match="where the theory ends"):
        law.pressure(separation=-4.6)


def test_a_users_islands_beyond_its_range_are_solved():
    class Half:
        """The shipped table, as far as X = 3."""

        name = "half"

        def answer(self, X, mu):
            from mbma_tables import open_table

            parts = open_table("universal").answer(X, mu)
            return tuple(np.where(X < 3, part, np.nan) for part in parts)

    law = contact_law(FACE, theory=Mbma(Half(), outside="exact"))
    whole = contact_law(FACE, theory="mbma")
    assert contact_law(FACE, theory=Mbma(Half())).lowest > whole.lowest == law.lowest
    d = np.array([-2.0, 0.0, 2.0])
    np.testing.assert_allclose(
        law.pressure(separation=d), whole.pressure(separation=d), rtol=1e-7
    )


def test_the_tolerance_of_the_theory_is_that_of_its_law():
    errors = [contact_law(FACE, theory=Mbma(rtol=r)).error for r in (1e-3, 1e-8, 1e-11)]
    assert errors[0] > 1e-6 > errors[1] > errors[2]
    assert contact_law(FACE, theory=Mbma(rtol=1e-3), rtol=1e-8).error < 2e-8


class Partial(Theory):
    """A theory that answers between half and nine tenths of h_max alone."""

    name = "partial"

    def interval(self, surface, quantity="pressure"):
        h_max = np.asarray(surface.h_max)
        return 0.5 * h_max, 0.9 * h_max

    def answer(self, surface, mean_separation):
        low, high = self.interval(surface)
        u = np.asarray(mean_separation)
        if not ((u >= low * (1 - 1e-12)) & (u <= high * (1 + 1e-12))).all():
            raise RuntimeError("asked beyond its interval")
        from mbma_tables.theories import TheoryAnswer

        pressure = np.exp(-2 * u)
        return TheoryAnswer(pressure, 0.1 * pressure, 2 * pressure, np.zeros(u.shape))


def test_an_interval_binds_contacts_and_laws():
    u = np.linspace(1.5, 2.7, 20)
    pressed = contact(FACE, mean_separation=u, theory=Partial())
    law = contact_law(FACE, theory=Partial())
    np.testing.assert_allclose(pressed.pressure, np.exp(-2 * u), rtol=1e-14)
    np.testing.assert_allclose(law.pressure(u), np.exp(-2 * u), rtol=1e-7)
    for beyond in (0.1, 1.49, 2.71, 3.5):
        for ask in (law.at, lambda u: contact(FACE, mean_separation=u, theory=Partial())):
            with pytest.raises(OutOfRangeError) as caught:
                ask([2.0, beyond])
            assert np.array_equal(caught.value.mask, [False, True])
    with pytest.raises(OutOfRangeError, match=r"is defined, u at least 1\.5"):
        contact(FACE, separation=-1.0, theory=Partial())
    with pytest.raises(OutOfRangeError, match="partial"):
        contact(FACE, pressure=0.9, theory=Partial())


def test_a_theory_that_fails_near_full_contact_is_told_of_interval():
    class Careless:
        name = "careless"

        def answer(self, surface, mean_separation):
            if np.min(mean_separation) < 1:
                raise ZeroDivisionError("u is below 1")
            pressure = (3 - mean_separation) ** 2
            return pressure, 0.01 * pressure

    with pytest.raises(OutOfRangeError, match=r"u is below 1\); its method `interval`"):
        contact_law(FACE, theory=Careless())
