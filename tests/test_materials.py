import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mbma_tables import Surface, contact, materials
from mbma_tables.common.errors import InputError, OutOfRangeError
from mbma_tables.materials import effective_modulus

moduli = st.floats(1e-6, 1e12)
ratios = st.floats(-0.99, 0.5)


def test_textbook_values():
    # steel on steel, E/(2 (1 - nu^2)); rubber at nu = 1/2 on a body 1e9 times stiffer, 4 E/3
    assert effective_modulus(210.0, 0.3, 210.0, 0.3) == pytest.approx(210 / 1.82, rel=1e-15)
    assert effective_modulus(3.0, 0.5, 3e9, 0.0) == pytest.approx(4 / (1 + 4e-9 / 3), rel=1e-15)


@given(moduli, ratios, moduli, ratios)
def test_bodies_may_be_exchanged_and_compliances_add(E1, nu1, E2, nu2):
    together = effective_modulus(E1, nu1, E2, nu2)
    assert together == effective_modulus(E2, nu2, E1, nu1)
    assert 1 / together == pytest.approx((1 - nu1**2) / E1 + (1 - nu2**2) / E2, rel=1e-13)


def test_texts_give_a_text_that_contact_takes():
    found = effective_modulus("210 GPa", 0.3, "7e4 MPa", 0.33)
    assert found == f"{effective_modulus(210.0, 0.3, 70.0, 0.33)} GPa"
    pressed = contact(Surface.named("challenge"), pressure="1 MPa", E_star=found)
    assert pressed.units["pressure"] == "GPa"
    with pytest.raises(InputError, match="E2 without a unit beside numbers in GPa"):
        effective_modulus("210 GPa", 0.3, 70.0, 0.33)
    with pytest.raises(TypeError, match=r"E_star=materials\.effective_modulus"):
        contact(Surface.named("challenge"), pressure="1 MPa", E1="210 GPa")


def test_arrays_broadcast_and_scalars_stay_scalars():
    found = effective_modulus([[1.0], [2.0]], 0.3, 5.0, [0.0, 0.5])
    assert found.shape == (2, 2)
    assert found[1, 0] == effective_modulus(2.0, 0.3, 5.0, 0.0)
    assert np.ndim(effective_modulus(1, 0, 1, 0)) == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0.0, 0.3, 1.0, 0.3), "E1 must be positive"),
        ((1.0, 0.3, -1.0, 0.3), "E2 must be positive"),
        ((1.0, 0.51, 1.0, 0.3), "nu1 must be in"),
        ((1.0, 0.3, 1.0, -1.0), "nu2 must be in"),
    ],
)
def test_out_of_range(arguments, message):
    with pytest.raises(OutOfRangeError, match=message) as caught:
        effective_modulus(*arguments)
    assert caught.value.mask.all()


# tensile strength of the hardest temper [MPa]: data sheets of the tempers, Callister's table B.4 for gold
TENSILE = {
    "steel 1020": 460, "steel 4140": 1965, "stainless steel 304": 1180, "aluminium 1100": 130, "aluminium 6061": 310,
    "aluminium 7075": 572, "copper C11000": 360, "brass C26000": 640, "titanium Ti-6Al-4V": 1170,
    "magnesium AZ31B": 290, "gold": 220,
}  # fmt: skip
# of other pages than the module's: E [GPa], nu, conductivity [W/(m K)]
ELSEWHERE = {
    "steel 1020": (203, 0.29, 52),  # ASME B31.1 at Engineering ToolBox; MakeItFrom
    "steel 4140": (205, 0.29, 43),  # the same
    "steel 52100": (200, 0.285, 50),  # dhanlaxmimetals.com; unitedmetalsc.com.my; material-properties.org, high carbon
    "stainless steel 304": (197, 0.305, 15),  # Miki Pulley; Engineering ToolBox
    "cast iron, grey": (100, 0.26, 46),  # Miki Pulley; formulafactory.tools; MakeItFrom
    "aluminium 1100": (69, 0.33, 220),  # Callister's table B.2; MakeItFrom, 1200; CRC at 273 K
    "aluminium 6061": (69, 0.33, 167),  # ecoursesbook.com; MatWeb, T6
    "aluminium 7075": (72, 0.33, 130),  # Miki Pulley; ecoursesbook.com
    "copper C11000": (110, 0.34, 393),  # Aurubis, Cu-ETP; electrical-contacts-wiki.com
    "brass C26000": (110, 0.33, 120),  # MakeItFrom; ecoursesbook.com
    "titanium grade 2": (105, 0.34, 16),  # Superior Tube; formulafactory.tools; alloyfyi.com
    "titanium Ti-6Al-4V": (113.8, 0.33, None),  # ecoursesbook.com
    "magnesium AZ31B": (45, 0.35, 100),  # MakeItFrom; Engineers Edge
    "silver": (82, 0.37, None),  # electrical-contacts-wiki.com
    "gold": (79, 0.42, 317),  # electrical-contacts-wiki.com; Engineers Edge, 183 Btu/(h ft F)
}


@pytest.mark.parametrize("name", materials.METALS)
def test_metals_agree_with_other_pages(name):
    metal, (E, nu, conductivity) = materials.get(name), ELSEWHERE[name]
    assert pytest.approx(E, rel=0.1) == metal.E
    assert metal.nu == pytest.approx(nu, abs=0.021)
    assert conductivity is None or 0.9 * metal.conductivity[0] < conductivity < 1.1 * metal.conductivity[1]
    assert 0 < metal.hardness[0] <= metal.hardness[1]


@pytest.mark.parametrize(("name", "tensile"), TENSILE.items())
def test_hardness_is_about_three_tensile_strengths(name, tensile):
    # plasticity: the pressure of an indentation is about three flow stresses; here within a factor of 1.5
    assert 2 < 1e3 * materials.get(name).hardness[1] / tensile < 4.5


@pytest.mark.parametrize(
    ("name", "numbers", "pressure"), [("steel 4140", (200, 578), 3000), ("aluminium 6061", (30, 95), 500)]
)
def test_brinell_numbers_from_the_indentation(name, numbers, force):
    ball = 10.0  # mm
    depth = force / (np.pi * ball * np.array(numbers))  # number is force over the cap's area, pi D depth
    radius_squared = depth * (ball - depth)
    pressure = force * 9.80665 / (np.pi * radius_squared) / 1e3
    np.testing.assert_allclose(materials.get(name).hardness, pressure, atol=0.0051)


def test_vickers_numbers_from_the_indentation():
    diagonal = np.sqrt(1.8544 / np.array((55.0, 200.0)))  # mm, at 1 kgf, ISO 6507
    np.testing.assert_allclose(materials.get("brass C26000").hardness, 9.80665e-3 / (diagonal**2 / 2), atol=0.0051)


def test_unknown_metal():
    with pytest.raises(InputError, match="steel 4140"):
        materials.get("steel 4141")
