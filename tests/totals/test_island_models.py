"""Island models of `contact` compared: tables within their certificate, variants, islands outside, bad options."""

import dataclasses
import functools
import math

import numpy as np
import pytest
from catalogue import LEVEL, OWN, random_gaps, random_surfaces
from helpers import fresh

from mbma_tables import InputError, OutOfRangeError, Surface, contact
from mbma_tables.core import core
from mbma_tables.surfaces.variants import REPORTED, VARIANTS
from mbma_tables.totals import island_sum

SHALLOW = dataclasses.replace(REPORTED, name="shallow", beta=0.01, phi=0.001)
OPEN = dataclasses.replace(REPORTED, name="open", floor_d=1.3, floor_u=2.2, density_divisor=11.0)


@functools.cache
def solved(variant):
    surfaces = random_surfaces(80, seed=101, hurst=(0.3, 1.0), zeta_1=(3.01, 1e4))
    gaps = random_gaps(surfaces, seed=102)
    return surfaces, gaps, contact(surfaces, separation=gaps, island_model="exact", variant=variant, rtol=1e-10)


def apart(found, true):
    return np.maximum(np.abs(found.pressure / true.pressure - 1), np.abs(found.area / true.area - 1))


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-8, 1e-10])
def test_universal_within_1e7_and_its_tolerance_of_exact(variant, rtol):
    surfaces, gaps, true = solved(variant)
    found = contact(surfaces, separation=gaps, variant=variant, rtol=rtol)
    assert found.island_model == "universal"
    error = apart(found, true)
    assert (error <= found.error).all()
    assert found.error.max() <= rtol + 1e-7
    assert true.error.max() <= 1e-10


def test_island4d_within_1e3_of_exact():
    surfaces, gaps, true = solved("reported")
    found = contact(surfaces, separation=gaps, island_model="island4d", rtol=1e-6)
    assert found.island_model == "island4d"
    assert (apart(found, true) <= found.error).all()
    assert found.error.max() <= 1e-3
    # a coarser table than the other
    assert np.median(apart(found, true)) > 1e-8


@pytest.mark.parametrize("variant", [OWN, LEVEL, OPEN], ids=lambda variant: variant.name)
def test_a_variant_of_ones_own(variant):
    surfaces = random_surfaces(25, seed=102, hurst=(0.4, 1.0), zeta_1=(3.6, 1e4))
    gaps = random_gaps(surfaces, seed=103)
    true = contact(surfaces, separation=gaps, island_model="exact", variant=variant, rtol=1e-9)
    found = contact(surfaces, separation=gaps, variant=variant, rtol=1e-9)
    assert (found.variant, true.variant) == (variant.name, variant.name)
    error = apart(found, true)
    assert (error <= found.error + true.error).all()
    assert found.error.max() <= 1e-7
    # the variant matters: its name alone did not decide
    assert (np.abs(contact(surfaces, separation=gaps).area / found.area - 1) > 1e-3).any()


@pytest.mark.parametrize("island_model", ["universal", "exact", "rigid"])
def test_a_floor_above_the_largest_magnification_or_at_it(island_model):
    options = {"separation": 1.0, "island_model": island_model, "variant": OWN}
    with pytest.raises(OutOfRangeError, match=r"q1/q0 must be greater than 3\.5, the variant's floor") as caught:
        contact(Surface([0.5, 0.8, 0.8], 0.2, [0.68, 40.0, 0.7], 1.0, 3.0), **options)
    assert caught.value.mask.tolist() == [True, False, True]
    assert contact(Surface(0.8, 1.0, math.nextafter(3.5, 4), 1.0, 3.0), **options).pressure > 0


@pytest.mark.parametrize(
    "variant", ["printed", LEVEL, dataclasses.replace(REPORTED, name="own", density_divisor=11.0)], ids=str
)
def test_the_four_parameter_table_is_of_one_variant(variant):
    with pytest.raises(InputError, match=r"island4d table was made for the variant 'reported', not for .*'universal'"):
        contact(Surface(0.8, 0.2, 40.0, 1.0, 3.0), separation=1.0, island_model="island4d", variant=variant)


def test_the_four_parameter_table_serves_variants_that_share_its_islands():
    # floors, beta and K1 move along the table's axes and do not change it
    near = dataclasses.replace(REPORTED, name="near", jacobian="exact", floor_d=1.6, beta=0.3)
    surface, gaps = Surface(0.7, 0.2, 40.0, 1.0, 3.0), np.array([2.5, 1.0, -2.0])
    found = contact(surface, separation=gaps, island_model="island4d", variant=near, rtol=1e-6)
    true = contact(surface, separation=gaps, island_model="exact", variant=near)
    assert (apart(found, true) <= found.error + true.error).all()
    assert found.error.max() <= 1e-3


ROUGH = Surface([[0.05], [0.8]], 0.2, 0.2 * 1e8, 1.0, 3.0)  # the first row leaves the table where it is pressed
GAPS = np.array([2.9999, 0.0, -2.0, 3.5])
MISSING = np.array([[False, True, True, False], [False] * 4])


def test_outside_raises_with_a_mask_in_the_callers_shape():
    with pytest.raises(OutOfRangeError) as caught:
        contact(ROUGH, separation=GAPS, variant="reported")
    np.testing.assert_array_equal(caught.value.mask, MISSING)
    facts = "2 of 8 entries", "(-6.25 <= X <= 41, mu <= 1.1e+06)", "hurst = 0.05, zeta_1 = 1e+08", "mu above"
    assert all(fact in str(caught.value) for fact in (*facts, "outside='exact'"))
    one = Surface(0.05, 0.2, 0.2 * 1e8, 1.0, 3.0)
    with pytest.raises(OutOfRangeError) as caught:
        contact(one, separation=0.0)
    assert caught.value.mask.shape == ()
    assert caught.value.mask
    assert math.isnan(contact(one, separation=0.0, outside="nan").pressure)


# of the second variant, with hardly any deformation, islands are deeper than the table at any gap
@pytest.mark.parametrize("variant", [REPORTED, SHALLOW], ids=lambda variant: variant.name)
def test_outside_answered_by_the_solver(variant):
    surface = ROUGH if variant is REPORTED else Surface(0.9, 0.2, 400.0, 1.0, 3.0)
    found, table = (contact(surface, separation=GAPS, variant=variant, outside=way) for way in ("exact", "nan"))
    true, missing = contact(surface, separation=GAPS, variant=variant, island_model="exact"), np.isnan(table.pressure)
    assert missing.any()
    for name in ("pressure", "area", "error"):
        expected = np.where(missing, getattr(true, name), getattr(table, name))
        np.testing.assert_array_equal(getattr(found, name), expected)
    assert found.islands > table.islands


@pytest.mark.parametrize("derivatives", [False, True])
def test_outside_as_nan(derivatives):
    found = contact(ROUGH, separation=GAPS, outside="nan", derivatives=derivatives)
    inside = contact(Surface(0.8, 0.2, 0.2 * 1e8, 1.0, 3.0), separation=GAPS, derivatives=derivatives)
    for name in ("pressure", "area", "error"):
        np.testing.assert_array_equal(np.isnan(getattr(found, name)), MISSING)
        np.testing.assert_array_equal(getattr(found, name)[1], getattr(inside, name))
        assert getattr(found, name)[0, 3] == 0
    if derivatives:
        for name, slope in found.pressure_by.items():
            np.testing.assert_array_equal(np.isnan(slope), MISSING)
            np.testing.assert_array_equal(slope[1], inside.pressure_by[name])


def test_outside_in_X():
    with pytest.raises(OutOfRangeError, match=r"2 of 3 entries .*X above") as caught:
        contact(Surface(0.9, 0.2, 400.0, 1.0, 4.7), separation=np.array([4.6, -4.7, 4.8]), variant=SHALLOW)
    assert caught.value.mask.tolist() == [True, True, False]


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"outside": "clamp"}, "outside must be one of"),
        ({"island_model": "formula4"}, "island_model must be one of"),
        *(
            ({"island_model": name, "derivatives": True}, "derivatives come from island model 'universal'")
            for name in ("exact", "island4d", "rigid")
        ),
        ({"outside": "exact", "derivatives": True}, "outside must be 'raise' or 'nan'"),
    ],
)
def test_bad_options(options, match):
    with pytest.raises(InputError, match=match):
        contact(Surface(0.8, 0.2, 40.0, 1.0, 3.0), separation=1.0, **options)


@pytest.mark.slow
def test_memory_is_that_of_the_batch():
    code = """
import json, resource, tracemalloc
import numpy as np
from mbma_tables import Surface, contact
gaps = np.linspace(2.5, 3.0, 200_000)
surface = Surface(0.8, 0.2, 40.0, np.linspace(0.9, 1.1, gaps.size), 3.0)
contact(Surface(0.8, 0.2, 40.0, np.linspace(0.9, 1.1, 1000), 3.0), separation=gaps[:1000])
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
tracemalloc.start()
found = contact(surface, separation=gaps)
traced = tracemalloc.get_traced_memory()[1]
grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024
print(json.dumps([traced / gaps.nbytes, grown / gaps.nbytes, found.islands / gaps.size]))
"""
    traced, grown, islands = fresh(code)
    # an array of every node of every gap would be 31 times the gaps, or more, by itself
    assert islands > 30
    assert traced < 25
    assert grown < 30


class Counted:
    """The core, whose calls of `totals` are counted and may be interrupted."""

    def __init__(self, interrupted=False):
        self.calls, self.interrupted = 0, interrupted

    def totals(self, *given):
        if self.interrupted:
            raise KeyboardInterrupt
        self.calls += 1
        return core.totals(*given)


@pytest.mark.parametrize("derivatives", [False, True])
def test_long_batches_run_in_blocks(monkeypatch, derivatives):
    """Between two blocks Ctrl-C is honoured; the bits are those of one block."""
    surfaces = Surface(0.8, 0.3, 60.0, 0.7, np.linspace(2.1, 2.2, 50))
    whole, counted = contact(surfaces, separation=1.0, derivatives=derivatives), Counted()
    monkeypatch.setattr(island_sum, "core", counted)
    monkeypatch.setattr(island_sum, "BLOCK", 16)
    cut = contact(surfaces, separation=1.0, derivatives=derivatives)
    assert counted.calls == 4
    np.testing.assert_array_equal(cut.pressure, whole.pressure)
    assert cut.islands == whole.islands
    monkeypatch.setattr(island_sum, "core", Counted(interrupted=True))
    with pytest.raises(KeyboardInterrupt):
        contact(surfaces, separation=1.0, derivatives=derivatives)


@pytest.mark.parametrize("island_model", ["exact", "universal"])
def test_what_is_nearly_nothing_ends_and_states_its_digits(island_model):
    """Heights of 32 standard deviations: totals below the normal numbers, whose digits no halving brings back."""
    surface = Surface(0.12887275768129156, 1.0, 7.092276972058787, 1.0, 32.0)
    gaps = np.array([31.9, 31.998, 31.999])
    found = contact(surface, separation=gaps, island_model=island_model)
    known = contact(surface, separation=gaps, island_model="exact", rtol=1e-10)
    assert (np.abs(found.pressure - known.pressure) <= (found.error + known.error) * known.pressure).all()
    assert found.error[2] > 1e-7
