"""Variants: what they say, what they refuse."""

import dataclasses
import math

import pytest

from mbma_tables import InputError
from mbma_tables.surfaces.variants import PRINTED, REPORTED, VARIANTS, get_variant


def test_the_two_variants_differ_by_pi_alone():
    assert math.pi * REPORTED.density_divisor == pytest.approx(PRINTED.density_divisor, rel=1e-15, abs=0)
    assert PRINTED.density_divisor == pytest.approx(6 * math.pi * math.sqrt(3), rel=1e-15, abs=0)
    same = dataclasses.replace(REPORTED, name="printed", density_divisor=PRINTED.density_divisor)
    assert same == PRINTED
    assert set(VARIANTS) == {"reported", "printed"}


def test_the_papers_constants():
    assert (PRINTED.beta, PRINTED.phi) == (1 / 3, 0.05)
    assert (PRINTED.floor_d, PRINTED.floor_u, PRINTED.jacobian) == (1.5, 3.0, "printed")
    assert (PRINTED.offset, PRINTED.summit_sigma) == (True, True)


def test_by_name_or_own():
    assert get_variant("printed") is PRINTED
    own = dataclasses.replace(PRINTED, name="own", beta=0.3)
    assert get_variant(own) is own
    assert own.recorded == [PRINTED.density_divisor, 0.3, 0.05, 1.5, 3.0, True, True]
    assert own.numbers.tolist() == [*own.recorded, True]


@pytest.mark.parametrize("name", ["guessed", "", None, 3, ["printed"]])
def test_unknown(name):
    with pytest.raises(InputError, match="variant must be one of"):
        get_variant(name)


NONSENSE = {"density_divisor": (0.0, -1.0, math.nan, math.inf), "jacobian": ("guessed",), "beta": (0.0, 0.75, math.nan)}
NONSENSE |= {"phi": (0.0, 2.0, math.nan), "floor_d": (1.0, 3.0), "floor_u": (1.2, math.nan)}


@pytest.mark.parametrize(("field", "value"), [(field, value) for field in NONSENSE for value in NONSENSE[field]])
def test_nonsense_is_refused(field, value):
    with pytest.raises(InputError, match="variant 'own'"):
        dataclasses.replace(PRINTED, name="own", **{field: value})
