"""Islands solved in chunks: the same bits whoever computes them."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from generate.files import ROOT
from generate.provenance import versions
from generate.tables import certificate
from generate.tables.certificate import Kind, phi
from generate.tables.configuration import load
from mbma_tables.models.tables import shipped
from mbma_tables.tablefiles.netcdf import read_table

# of numpy and its BLAS, on any processor with AVX2, the code of the one that made the shipped tables
HASWELL = {
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
    "OPENBLAS_CORETYPE": "Haswell",
}


def test_any_workers_give_the_same_bits(monkeypatch):
    monkeypatch.setattr(certificate, "CHUNK", 10)
    X, mu = np.linspace(0.0, 5.0, 40), np.geomspace(1e-3, 10.0, 40)
    expected = phi(X, mu, 1e-6)
    for workers in (1, 2):
        found = Kind(load("universal"), workers).phi("test", X.reshape(8, 5), mu.reshape(8, 5), 1e-6)
        np.testing.assert_array_equal(found, expected.reshape(8, 5, 2))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["universal", "island4d"])
def test_the_shipped_tables_rebuild_to_the_last_bit(kind, tmp_path):
    """With the code of their processor type and their versions, as docs/tables.md says."""
    said = json.loads(read_table(shipped(kind)).attributes["versions"])
    if said != versions():
        pytest.skip("other versions or another arithmetic than those of the shipped tables")
    out = tmp_path / f"{kind}.nc"
    name = [sys.executable, "-m", "generate", "tables", kind, "--out", str(out), "--workers", "2"]
    subprocess.run(name, cwd=ROOT, env=os.environ | HASWELL, check=True, capture_output=True)
    old, new = (read_table(path).attributes for path in (shipped(kind), out))
    differing = {key for key in old if old[key] != new[key]}
    # the record of the source follows every edit of it
    assert differing <= {"source_sha256", "source_modules", "attributes_sha256"}
