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
    assert (PRINTED.floor_d, PRINTED.floor_u) == (1.5, 3.0)
    assert PRINTED.jacobian == "printed"
    assert PRINTED.offset
    assert PRINTED.summit_sigma


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


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("density_divisor", 0.0),
        ("density_divisor", -1.0),
        ("density_divisor", math.nan),
        ("density_divisor", math.inf),
        ("jacobian", "guessed"),
        ("beta", 0.0),
        ("beta", 0.75),
        ("beta", math.nan),
        ("phi", 0.0),
        ("phi", 2.0),
        ("phi", math.nan),
        ("floor_d", 1.0),
        ("floor_d", 3.0),
        ("floor_u", 1.2),
        ("floor_u", math.nan),
    ],
)
def test_nonsense_is_refused(field, value):
    with pytest.raises(InputError, match="variant 'own'"):
        dataclasses.replace(PRINTED, name="own", **{field: value})
