"""Fixtures of several files; what they need is imported when they are first asked for."""

import os

import pytest
from hypothesis import settings

# a busy machine is no fault
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

# parallel workers share the cores, and threads of BLAS that wait for each other cost more
# than the work itself
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# simulations are not kept between tests
os.environ["MBMA_TABLES_CACHE"] = "off"

# tests and files that skipped, for want of a package or a program; CI runs them again where
# these are installed
skipped = []


def pytest_runtest_logreport(report):
    if report.skipped:
        skipped.append(report.nodeid)


def pytest_collectreport(report):
    if report.skipped:
        skipped.append(report.nodeid)


def pytest_sessionfinish(session):
    path = os.environ.get("MBMA_SKIPPED")
    # a parallel worker has a part of them
    if path and not hasattr(session.config, "workerinput"):
        with open(path, "w", encoding="utf-8") as file:
            file.writelines(f"{name}\n" for name in sorted(set(skipped)))


@pytest.fixture(scope="session")
def generations():
    """The modules of the core that round alike, as they have an fma, and that this processor can run."""
    import importlib

    from mbma_tables.core import GENERATIONS, core

    names = [name for name, least in GENERATIONS.items() if 0 < least <= core.generation]
    return [importlib.import_module(f"mbma_tables.core._{name}") for name in names] or [
        core
    ]


@pytest.fixture(scope="session")
def table_files(tmp_path_factory):
    from small_tables import KINDS, small_table

    from mbma_tables.tables.writer import write_table

    folder = tmp_path_factory.mktemp("tables")
    return {kind: write_table(folder / f"{kind}.nc", small_table(kind)) for kind in KINDS}


@pytest.fixture(scope="session")
def sources(table_files):
    return {kind: path.read_bytes() for kind, path in table_files.items()}
