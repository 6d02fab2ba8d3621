import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mbma_tables.errors import InputError, OutOfRangeError
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


def test_ranges_of_metals():
    from mbma_tables import materials

    assert len(materials.METALS) >= 12
    for name in materials.METALS:
        metal = materials.get(name)
        assert 20 < metal.E < 420
        assert 0.2 < metal.nu < 0.45
        for low, high in (metal.hardness, metal.conductivity):
            assert 0 < low <= high
        # hardness over modulus of metals
        assert metal.hardness[1] / metal.E < 0.06
    with pytest.raises(InputError, match="steel 4140"):
        materials.get("steel 4141")
