"""Results that are kept and shared by all callers cannot be changed by one of them."""

import functools
import gc
import importlib
import pickle
import pkgutil

import numpy as np
import pytest

import mbma_tables
from mbma_tables import Bodies, Surface, contact, contact_law, greenwood_tripp, open_table
from mbma_tables.common.shared import frozen, parts_of
from mbma_tables.theories import THEORIES

SURFACE = Surface(0.7, 0.2, 60.0, 1.0, 3.0)


def arrays_in(value):
    """Every array of a container or an object of the package, its surfaces apart, by a path to it."""
    pending = [(type(value).__name__, value)]
    seen = {}
    while pending:
        path, part = pending.pop()
        if id(part) in seen:
            continue
        seen[id(part)] = part
        if isinstance(part, np.ndarray):
            yield path, part
        names = (
            part
            if isinstance(part, dict)
            else getattr(part, "__dict__", range(len(parts_of(part))))
        )
        pending += [
            (f"{path}.{name}", inner)
            for name, inner in zip(names, parts_of(part), strict=False)
        ]


def caches():
    """Every cache of the package's modules by name."""
    for module in pkgutil.walk_packages(mbma_tables.__path__, "mbma_tables."):
        if (
            module.name.endswith("__main__")
            or "abi3" in module.name
            or ".core._" in module.name
        ):
            continue
        for name, value in vars(importlib.import_module(module.name)).items():
            if isinstance(value, functools._lru_cache_wrapper):
                yield f"{module.name}.{name}", value


def kept_in(cache):
    """What a cache without or with a limit keeps."""
    (kept,) = (
        part
        for part in gc.get_referents(cache)
        if isinstance(part, dict) and part is not vars(cache)
    )
    for value in kept.values():
        bounded = type(value).__name__ == "_lru_list_elem"
        yield from gc.get_referents(value) if bounded else [value]


def test_arrays_of_everything_that_is_kept_are_read_only():
    for theory in THEORIES:
        hardness = np.inf if theory == "greenwood_williamson" else 0.05
        found = contact(
            SURFACE, Bodies(hardness=hardness), mean_separation=[0.5, 1.0], theory=theory
        )
        contact(
            SURFACE, Bodies(hardness=hardness), pressure=found.pressure, theory=theory
        )
        assert (
            contact(SURFACE, mean_separation=[0.5, 1.0], theory=theory).leakage
            is not None
        )
    open_table("island4d").lookup(1.0, 3.0, 20.0, 0.8)
    assert greenwood_tripp.solve(2.0, 1.0).error < 1e-10
    number = 0
    for name, cache in caches():
        for value in kept_in(cache):
            for path, array in arrays_in(value):
                assert not array.flags.writeable, f"{name}: {path}"
                number += 1
    assert number > 100


def test_a_shared_table_cannot_be_scaled():
    """Times 1.5, every later pressure would be 1.5 times too large, with an error of 8e-10."""
    before = contact(SURFACE, separation=1.0, theory="mbma").pressure
    for kind in ("universal", "island4d"):
        content = open_table(kind).content
        arrays = [
            content.coefficients,
            content.local_error,
            *content.conformance.values(),
        ]
        arrays += [values for _, values, _ in content.auxiliary.values()]
        for array in arrays:
            with pytest.raises(ValueError, match="read-only"):
                array *= 1.5
    assert not any(array.flags.writeable for array in open_table("universal").cells)
    assert contact(SURFACE, separation=1.0, theory="mbma").pressure == before


@pytest.mark.parametrize("theory", THEORIES)
def test_arrays_of_laws_are_read_only_after_unpickling_too(theory):
    law = contact_law(SURFACE, theory=theory)
    law.separation(pressure=law.pressure(1.0))
    for one in (law, pickle.loads(pickle.dumps(law))):
        arrays = dict(arrays_in(one))
        assert len(arrays) >= 2
        assert not [path for path, array in arrays.items() if array.flags.writeable]
        assert one.pressure(1.0) == law.pressure(1.0)


def test_a_surface_of_a_user_is_not_made_read_only():
    numbers = np.array([0.5, 0.7])
    surface = Surface(numbers, 0.2, 60.0, 1.0, 3.0)
    frozen([surface, {"surface": surface}])
    contact(surface, mean_separation=1.0, theory="calibrated")
    numbers[0] = 0.6
    for name in surface.parameters:
        assert isinstance(getattr(surface, name), np.ndarray)
    assert numbers.flags.writeable
