"""Spoilt table files: bytes, and content under right hashes."""

import numpy as np
import pytest
from fuzzing import finite
from helpers import SCALE
from small_tables import edited

from mbma_tables.models.island4d import Island4dModel
from mbma_tables.models.tables import verify
from mbma_tables.models.universal import UniversalModel
from mbma_tables.tablefiles.netcdf import attributes_digest, digest_arrays, read_table
from mbma_tables.tablefiles.schema import KINDS, UNIVERSAL

SPECIAL = (np.nan, np.inf, -np.inf, 0.0, -1.0, 1e300, 700.1, 5e-324)
ODD = ("", "x" * 5000, -1, 0, 2**40, 5e-324, 1e308, np.nan, -np.inf, [1.5, 2.5], "1", "log", "a\nb")


def forge(dataset, rng):
    """Something odd in one or two places, under hashes that are right."""
    for _ in range(rng.integers(1, 3)):
        variable = list(dataset.variables.values())[rng.integers(len(dataset.variables))]
        owner = (dataset, variable, None)[rng.integers(3)]
        if owner is None:
            values = variable[...]
            values.flat[rng.integers(0, values.size, 3)] = SPECIAL[rng.integers(len(SPECIAL))]
            variable[...] = values
        else:
            name = owner.ncattrs()[rng.integers(len(owner.ncattrs()))]
            if rng.integers(4):
                owner.setncattr(name, ODD[rng.integers(len(ODD))])
            else:
                owner.delncattr(name)
    values = {name: np.ma.getdata(variable[...]) for name, variable in dataset.variables.items()}
    dataset.setncattr("values_sha256", digest_arrays(values))
    dataset.setncattr("attributes_sha256", attributes_digest(dataset))


def answers(path):
    """Answers of a table, as far as its axes reach, and how far its conformance points are from them."""
    content = read_table(path)
    places = np.linspace(0, 1, 7)
    if content.kind == UNIVERSAL:
        X, mu = (axis.coordinate(places * (axis.nodes - 1)) for axis in content.axes)
        found = UniversalModel(content).answer(X[:, None], mu)
        values = found.phi_F, found.phi_A, found.error
    else:
        raw = (content.conformance[name] for name in ("delta_over_h_rms", "zeta_d", "zeta_u", "hurst"))
        values = tuple(Island4dModel(content).lookup(*raw))
    return (*values, verify(path).table_error)


@pytest.mark.parametrize("kind", KINDS)
def test_content_under_right_hashes(kind, sources, tmp_path, tally):
    rng = np.random.default_rng(23)
    path = tmp_path / "table.nc"
    # the file as it is passes
    assert finite(*answers(edited(path, sources[kind], lambda dataset: None)))
    for _ in range(40 * SCALE):
        edited(path, sources[kind], lambda dataset: forge(dataset, rng))
        found = tally.read_file(path, path.read_bytes(), answers)
        assert found is None or finite(*found)
