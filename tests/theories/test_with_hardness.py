"""A theory with a hardness is the same in every process, and any theory can have one."""

import pickle

import numpy as np
import pytest
import xarray as xr
from helpers import fresh, random_map

from mbma_tables import Bodies, Surface, contact
from mbma_tables.theories import THEORIES, BoundaryElements, Simulated, resolve
from mbma_tables.theories.hardness import with_hardness
from mbma_tables.theories.yielding.theory import Yielding

MAP = 0.1 * random_map(64, 0.05, 0.25, power=0)
PRESSURES = np.array([1e-3, 3e-3])
HARDNESS = 0.02

# reads pickled pairs of a theory and a surface, and prints the bits of their contacts
OTHER_PROCESS = """
import json, pickle, sys
from mbma_tables import Bodies, contact
with open(sys.argv[1], "rb") as file:
    pairs, pressures, hardness = pickle.load(file)
bits = {}
for name, (theory, surface) in pairs.items():
    for cap in (None, hardness):
        pressed = contact(surface, Bodies(hardness=cap), pressure=pressures, theory=theory)
        fields = pressed.area, pressed.mean_separation, pressed.unloading_stiffness
        bits[f"{name}, hardness {cap}"] = [value.hex() for field in fields for value in field.tolist()]
print(json.dumps(bits))
"""


@pytest.fixture(scope="module")
def pairs(tmp_path_factory):
    """Every theory with a surface of its own, also those of maps and of a map's table."""
    rough = Surface(hurst=0.8, q0=0.01, q1=0.64, h_rms=1.0, h_max=3.3)
    measured = Surface.from_map(MAP, dx=1.0, periodic=True)
    path = tmp_path_factory.mktemp("table") / "map.nc"
    BoundaryElements.of(measured).to_netcdf(path)
    opened = BoundaryElements.from_netcdf(path)
    pairs = {name: (resolve(name), rough) for name in THEORIES}
    for grid in ("full", "quick"):
        pairs[grid] = Simulated(grid).of(measured), measured
    return pairs | {"table": (opened, opened.surface)}


# the theory of a map alone, since importing others may import what it needs
@pytest.mark.parametrize(
    "names",
    [
        ("full",),
        pytest.param((*THEORIES, "quick", "table"), marks=pytest.mark.slow),
    ],
)
def test_every_theory_has_the_same_bits_in_a_new_process(pairs, tmp_path, names):
    bits = {}
    for name in names:
        theory, surface = pairs[name]
        for cap in (None, HARDNESS):
            pressed = contact(
                surface, Bodies(hardness=cap), pressure=PRESSURES, theory=theory
            )
            fields = pressed.area, pressed.mean_separation, pressed.unloading_stiffness
            rows = [value.hex() for field in fields for value in field.tolist()]
            bits[f"{name}, hardness {cap}"] = rows
    path = tmp_path / "pairs.pickle"
    path.write_bytes(
        pickle.dumps(({name: pairs[name] for name in names}, PRESSURES, HARDNESS))
    )
    assert fresh(OTHER_PROCESS, str(path)) == bits


@pytest.mark.slow
def test_workers_of_dask_have_the_same_bits(pairs):
    theory, surface = pairs["full"]
    pressures = xr.DataArray(PRESSURES, dims="load")
    here = contact(
        surface, Bodies(hardness=HARDNESS), pressure=pressures, theory=theory
    ).area
    chunks = contact(
        surface,
        Bodies(hardness=HARDNESS),
        pressure=pressures.chunk(load=1),
        theory=theory,
    ).area
    there = chunks.compute(scheduler="processes", num_workers=1)
    np.testing.assert_array_equal(there, here)


def test_a_theory_with_a_hardness_pickles(pairs):
    for theory, surface in pairs.values():
        capped = with_hardness(theory, 0.02 * 58.0, E_star=58.0)
        assert isinstance(capped, Yielding)
        u = 0.4 * surface.h_max * np.ones(1)
        again = pickle.loads(pickle.dumps(capped)).answer(surface, u)
        np.testing.assert_array_equal(again, capped.answer(surface, u))
