"""Importing the package stays cheap: heavy modules come in when first needed."""

import pytest
from helpers import fresh

import mbma_tables

HEAVY = ("scipy", "numba", "matplotlib", "xarray", "SurfaceTopography", "llvmlite", "pandas")


def test_nothing_heavy_comes_with_the_package():
    code = "import mbma_tables, sys, json; print(json.dumps(sorted(sys.modules)))"
    loaded = {name.partition(".")[0] for name in fresh(code)}
    assert "mbma_tables" in loaded
    assert loaded.isdisjoint(HEAVY)


def test_errors_and_dir_stay_light():
    code = (
        "import mbma_tables, sys, json; dir(mbma_tables); mbma_tables.InputError; mbma_tables.__version__;"
        "print(json.dumps(sorted(sys.modules)))"
    )
    assert {name.partition(".")[0] for name in fresh(code)}.isdisjoint(HEAVY)


@pytest.mark.parametrize("name", mbma_tables.__all__)
def test_every_public_name_is_there(name):
    assert getattr(mbma_tables, name) is not None
    assert name in dir(mbma_tables)


def test_unknown_name():
    with pytest.raises(AttributeError, match="no attribute 'contacts'"):
        _ = mbma_tables.contacts
