"""Small tables, built once."""

import pytest
from small_builds import KINDS, small

from generate.tables.build import build
from generate.tables.chunks import ChunkedSolver
from generate.tables.configuration import load


@pytest.fixture(scope="session", params=KINDS)
def built(request, tmp_path_factory):
    """(kind, its content) of a small table built here."""
    path = small(tmp_path_factory.mktemp("built"), request.param)
    configuration = load(request.param, path)
    kind = KINDS[request.param](configuration)
    return kind, build(kind, configuration, ChunkedSolver())
