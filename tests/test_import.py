"""Importing the package stays cheap: heavy modules come in when first needed."""

import pytest
from helpers import fresh

import mbma_tables

HEAVY = ("scipy", "matplotlib", "xarray", "SurfaceTopography", "pandas")


def test_nothing_heavy_comes_with_the_package_its_errors_and_its_dir():
    code = (
        "import mbma_tables, sys, json; dir(mbma_tables); mbma_tables.InputError; mbma_tables.__version__;"
        "print(json.dumps(sorted(sys.modules)))"
    )
    loaded = {name.partition(".")[0] for name in fresh(code)}
    assert "mbma_tables" in loaded
    assert loaded.isdisjoint(HEAVY)


@pytest.mark.parametrize("name", mbma_tables.__all__)
def test_every_public_name_is_there(name):
    assert getattr(mbma_tables, name) is not None
    assert name in dir(mbma_tables)


def test_unknown_name():
    with pytest.raises(AttributeError, match="no attribute 'contacts'"):
        _ = mbma_tables.contacts
