"""Help of public functions begins with a signature that can be read."""

import inspect
import pydoc

import pytest

import mbma_tables
from mbma_tables.bodies import materials

FUNCTIONS = {name: getattr(mbma_tables, name) for name in mbma_tables.__all__}
FUNCTIONS |= {
    name: getattr(materials, name) for name in ("effective_modulus", "tangential_ratio")
}
METHODS = {
    f"{name}.{method}": function
    for name, kind in FUNCTIONS.items()
    if inspect.isclass(kind)
    for method, function in inspect.getmembers(kind, callable)
    if not method.startswith("_")
    and str(getattr(function, "__module__", "")).startswith("mbma_tables")
}
LONGEST = 1200  # characters: fifteen lines of a terminal


@pytest.mark.parametrize("name", [*FUNCTIONS, *METHODS])
def test_a_signature_names_types_and_does_not_expand_them(name):
    function = FUNCTIONS.get(name, METHODS.get(name))
    if not callable(function) or inspect.isclass(function):
        pytest.skip("no function")
    text = pydoc.plain(pydoc.render_doc(function))
    signature = text.split("\n\n")[1]
    assert "_ArrayLike" not in signature
    assert "_SupportsArray" not in signature
    assert len(signature.split("\n    ")[0]) <= LONGEST
