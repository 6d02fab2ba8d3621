"""The shipped tables are whole, as small and as accurate as they must be."""

import json

import pytest

from mbma_tables.models.tables import shipped, verify
from mbma_tables.surfaces.variants import get_variant
from mbma_tables.tablefiles.netcdf import digest_json, read_table
from mbma_tables.tablefiles.schema import ISLAND4D, KINDS, UNIVERSAL

LARGEST_BYTES = {UNIVERSAL: 2e6, ISLAND4D: 16e6}
LARGEST_ERROR = {UNIVERSAL: 1e-9, ISLAND4D: 1e-3}


@pytest.fixture(scope="module", params=KINDS)
def table(request):
    return read_table(shipped(request.param), request.param)


@pytest.mark.parametrize("kind", KINDS)
def test_the_installed_solver_answers_the_conformance_points(kind):
    verdict = verify(shipped(kind), kind)
    assert verdict.points == 64
    assert verdict.solver_error < 1e-11


def test_the_configuration_is_what_its_hash_says(table):
    variant = get_variant(table.attributes["variant"]).recorded if table.kind == ISLAND4D else []
    configuration = json.loads(table.attributes["configuration"])
    assert digest_json([configuration, variant]) == table.attributes["configuration_sha256"]
    assert configuration["kind"] == table.kind


def test_small_enough(table):
    assert shipped(table.kind).stat().st_size <= LARGEST_BYTES[table.kind]


def test_accurate_enough_on_held_out_points(table):
    attributes = table.attributes
    assert attributes["certificate_points"] >= 5000
    for function in "FA":
        typical, rare, largest = (attributes[f"{what}_error_{function}"] for what in ("median", "p99", "largest"))
        assert 0 < typical <= rare <= largest <= LARGEST_ERROR[table.kind]
        assert attributes[f"visited_largest_error_{function}"] <= largest
    if table.kind == ISLAND4D:
        assert attributes["visited_p99_error_F"] <= 3e-4
        assert attributes["visited_p99_error_A"] <= 3e-4


def test_the_error_field_covers_the_certificate(table):
    assert (table.local_error > 0).all()
    for number, function in enumerate("FA"):
        assert table.local_error[..., number].max() >= table.attributes[f"largest_error_{function}"]


def test_conformance_points(table):
    assert all(values.size >= 32 for values in table.conformance.values())
    assert 0 < table.conformance["tolerance"].max() < 1e-6
