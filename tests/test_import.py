"""Importing the package stays cheap: heavy modules come in when first needed."""

import pytest
from helpers import fresh

import mbma_tables

HEAVY = ("scipy", "numba", "matplotlib", "xarray", "SurfaceTopography", "llvmlite", "pandas")


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


SMALL = (
    "contact(Surface.named('concrete'), 0.4).valid",
    "contact(Surface.named('concrete'), [0.4, 0.2]).stiffness",
    "contact(Surface.named('concrete'), pressure=1e-4).area",
    "contact(Surface.named('concrete'), pressure=1e-4, theory='calibrated').stiffness",
    "contact(Surface.named('concrete'), 0.4, theory='persson').stiffness",
    "island(Surface.named('concrete'), 0.4)",
    "Scene(Surface.named('concrete'), effects=['force', 'area'], separations=[0.4, 0.2]).run()",
)


@pytest.mark.parametrize("asked", SMALL)
def test_small_requests_need_no_compiler(asked):
    """numba takes long to import and longer to compile: what numpy answers at once does not wait for it."""
    names = f"{asked.partition(chr(40))[0]}, Surface"
    code = f"from mbma_tables import {names}; {asked}; import sys, json; print(json.dumps(sorted(sys.modules)))"
    loaded = {name.partition(".")[0] for name in fresh(code)}
    assert loaded.isdisjoint({"numba", "llvmlite"})
