"""Long requests are computed in blocks: their memory does not grow with what each entry needs."""

import tracemalloc

import numpy as np
import pytest

from mbma_tables import InputError, OutOfRangeError, Surface
from mbma_tables.bodies.bodies import mean_conductivity
from mbma_tables.contacts.quantities.effective_medium import FlowConstants
from mbma_tables.contacts.quantities.gas import mean_inverse
from mbma_tables.contacts.quantities.lay import factors
from mbma_tables.theories.calibrated.formulas import self_affine_law

COUNT = 20_000
GAPS = np.linspace(0.5, 6.0, COUNT)


def flow(u):
    return np.concatenate(factors(u, np.full(u.shape, 0.02), 3.0, FlowConstants()))


def gas(u):
    return mean_inverse(u, 0.02, 0.3, 1.0)


def energy(u):
    return self_affine_law(0.8, 64.0, None).energy(0.01 / u)


@pytest.mark.parametrize(
    "computed", [pytest.param(flow, marks=pytest.mark.slow), gas, energy]
)
def test_blocks_have_the_bits_of_single_entries_and_little_memory(computed):
    computed(GAPS[:2])
    tracemalloc.start()
    many = computed(GAPS)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # a dozen arrays of all nodes would take 180 MB or more
    assert peak < 80e6
    for k in (0, 777, COUNT - 1):
        np.testing.assert_array_equal(computed(GAPS[k : k + 1])[..., 0], many[..., k])
    assert computed(GAPS.reshape(2, -1)).shape == (*many.shape[:-1], 2, COUNT // 2)


def test_numbers_of_any_size_raise_no_warning():
    rough = {"Rq": 1.0, "longest": 100.0, "shortest": 2.0, "hurst": 0.8}
    with pytest.raises(OutOfRangeError, match="nominal_area must be at least"):
        Surface.from_roughness(**rough, nominal_area=5e-324)
    assert mean_conductivity(1.0, 1e-320) == pytest.approx(2e-320, rel=1e-3)
    assert mean_conductivity(1e308, 1e308) == 1e308
    assert mean_conductivity(45.0, 167.0) == pytest.approx(
        2 * 45.0 * 167.0 / 212.0, rel=1e-15
    )


def test_one_wavelength_is_refused_by_its_name():
    wave = np.cos(2 * np.pi * np.arange(64) / 16)
    with pytest.raises(InputError, match=r"the map holds wavelengths of 11\.31 only"):
        Surface.from_map(wave[:, None] * wave, dx=1.0, periodic=True)
