"""An answer depends on its question alone: not on the process, on what was imported before, on the folder, or on the
kind of argument; each question is asked in new processes and must have the same bits there.
"""

import functools
import importlib
import json
import os
import pathlib
import pickle
import pkgutil
import shutil
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr
from helpers import contact_of

import mbma_tables
from mbma_tables import (
    Bodies,
    Joint,
    Surface,
    contact,
    contact_law,
    flow_factors,
    island,
    open_table,
    sensitivity,
)
from mbma_tables.common.files import shipped_file
from mbma_tables.theories import THEORIES, BoundaryElements, resolve

PACKAGE = pathlib.Path(mbma_tables.__file__).parent
ROUGH = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.5, unit="um")
FACE = {"Rq": "0.4 um", "longest": "100 um", "shortest": "2 um", "hurst": 0.8}
METALS = ("steel 4140 hard", "aluminium 6061 hard")
PRESSURES = ["1 MPa", "10 MPa", "100 MPa"]
RTOL = 1e-6


def heights():
    """A small periodic map of random waves."""
    noise = np.fft.rfft2(np.random.default_rng(5).standard_normal((32, 32)))
    q = np.hypot(np.fft.fftfreq(32)[:, None], np.fft.rfftfreq(32))
    return np.fft.irfft2(
        np.where((q > 0.05) & (q < 0.15), noise * np.maximum(q, 1e-3) ** -1.8, 0)
    )


def by_pressure(theory, **options):
    found = contact_of(ROUGH, "100 GPa", pressure=PRESSURES, theory=theory, **options)
    return [
        found.mean_separation,
        found.area,
        found.stiffness,
        found.error,
        found.scatter,
    ]


def of_a_law():
    law = contact_law(ROUGH, "100 GPa", theory="calibrated", rtol=RTOL)
    return [law.pressure(1.5), law.area(1.5), law.at_pressure("10 MPa").mean_separation]


def of_a_joint():
    joint = Joint(FACE, FACE, bodies=METALS, nominal_area="4 cm^2", theory="calibrated")
    found = joint.at_pressure(PRESSURES)
    return [found.area, found.mean_separation, found.stiffness, found.solid_conductance]


def of_flow_factors():
    found = flow_factors(ROUGH, [1.0, 2.0, 4.0])
    return [found.phi_x, found.phi_y]


def of_a_map():
    found = contact(
        Surface.from_map(heights(), 1.0), area=[0.02, 0.2], theory="simulated"
    )
    return [found.pressure, found.mean_separation, found.stiffness]


def of_a_sensitivity():
    found = sensitivity(ROUGH, pressure=1e-3, theory="calibrated")
    return [
        found.slopes[name][answer]
        for name in found.slopes
        for answer in found.slopes[name]
    ]


# by name, so that a new process can ask it too
QUESTIONS = {
    **{f"contact by {name}": (by_pressure, (name,), {}) for name in sorted(THEORIES)},
    "contact that yields": (by_pressure, ("calibrated",), {"hardness": "1.5 GPa"}),
    "contact that yields by MBMA": (by_pressure, ("mbma",), {"hardness": "1.5 GPa"}),
    "law": (of_a_law, (), {}),
    "joint": (of_a_joint, (), {}),
    "flow factors": (of_flow_factors, (), {}),
    "map": (of_a_map, (), {}),
    "sensitivity": (of_a_sensitivity, (), {}),
}


def bits(name):
    """The answer to a question in hexadecimal digits."""
    ask, given, options = QUESTIONS[name]
    return [
        np.asarray(values, float).tobytes().hex() for values in ask(*given, **options)
    ]


HERE = {}


def bits_here(name):
    """The answer of this process, which has imported whatever the tests before needed."""
    if name not in HERE:
        HERE[name] = bits(name)
    return HERE[name]


def everything_imported():
    """Import every module of the library, the last first."""
    names = [
        module.name
        for module in pkgutil.walk_packages(mbma_tables.__path__, "mbma_tables.")
        if "__main__" not in module.name
    ]
    for name in reversed(names):
        importlib.import_module(name)


# the module itself imports what it asks with; nothing else comes before the first question
ALONE = (
    "import json, sys, test_promises; print(json.dumps(test_promises.bits(sys.argv[1])))"
)
AFTER_ALL = """
import json, test_promises
test_promises.everything_imported()
print(json.dumps({name: test_promises.bits(name) for name in reversed(test_promises.QUESTIONS)}))
"""


def new_process(code, *arguments, folder, paths=()):
    """What code prints as JSON in a new interpreter in another folder, with these paths before all others."""
    places = [
        *map(str, paths),
        str(pathlib.Path(__file__).parent),
        os.environ.get("PYTHONPATH", ""),
    ]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, places))}
    command = [sys.executable, "-P", "-W", "error", "-c", code, *arguments]
    ran = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True
    )
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)


@pytest.mark.slow
@pytest.mark.parametrize("name", QUESTIONS)
def test_an_answer_is_the_same_in_a_process_that_asks_nothing_else(name, tmp_path):
    """As the first question of a process, in another folder."""
    assert new_process(ALONE, name, folder=tmp_path) == bits_here(name)


@pytest.mark.slow
def test_an_answer_does_not_depend_on_what_was_imported_or_asked_before(tmp_path):
    """With every module imported in another order, and the questions asked in reverse."""
    found = new_process(AFTER_ALL, folder=tmp_path)
    assert found == {name: bits_here(name) for name in reversed(QUESTIONS)}


@pytest.mark.slow
def test_an_answer_does_not_depend_on_the_name_of_the_librarys_folder(tmp_path):
    """In a folder with a blank, a bracket and a letter beyond ASCII, and in one of the library's own name."""
    tables = pathlib.Path(shipped_file("universal.nc")).parent
    for name in ("my contacts (β)", "mbma_tables"):
        copy = tmp_path / name
        shutil.copytree(
            PACKAGE, copy / "mbma_tables", ignore=shutil.ignore_patterns("__pycache__")
        )
        if tables.parent != PACKAGE:
            shutil.copytree(tables, copy / "tables")
        where = "import json, mbma_tables; print(json.dumps(mbma_tables.__file__))"
        assert new_process(where, folder=tmp_path, paths=[copy]).startswith(str(copy))
        found = new_process(AFTER_ALL, folder=tmp_path, paths=[copy])
        assert found == {name: bits_here(name) for name in reversed(QUESTIONS)}


def asked_law(law):
    return [
        law.pressure(1.5),
        law.area(1.5),
        law.stiffness(1.5),
        law.at_pressure("10 MPa").area,
    ]


def asked_contact(found):
    return [
        found.pressure,
        found.area,
        found.mean_separation,
        found.stiffness,
        found.leakage.K,
    ]


def asked_joint(joint):
    found = joint.at_pressure(PRESSURES)
    return [found.area, found.stiffness, found.solid_conductance]


def asked_surface(surface):
    return [contact(surface, pressure=[0.001, 0.01], theory="calibrated").area]


def asked_map(surface):
    return [contact(surface, area=[0.02, 0.2], theory="simulated").pressure]


def asked_theory(theory):
    elastic = contact(ROUGH, pressure=[0.001, 0.004], theory=theory)
    yielded = contact(
        ROUGH, Bodies(hardness=0.05), pressure=[0.001, 0.004], theory=theory
    )
    return [elastic.area, elastic.mean_separation, yielded.area, yielded.mean_separation]


def asked_own_table(theory):
    surface = Surface.from_map(heights(), 1.0)
    elastic = contact(surface, area=[0.02, 0.2], theory=theory)
    yielded = contact(
        surface,
        Bodies(hardness=5.0),
        pressure=np.asarray(elastic.pressure),
        theory=theory,
    )
    return [elastic.pressure, yielded.area]


def made_surface():
    return ROUGH


def made_batch():
    return Surface([0.5, 0.8], 0.01, 2.0, 1.0, 3.5)


def made_map():
    return Surface.from_map(heights(), 1.0)


def made_spectrum():
    q = np.geomspace(0.01, 2.0, 40)
    return Surface.from_spectrum(q, 1e-3 * q**-3.6, h_max=8.0, unit="um")


def made_contact():
    return contact(ROUGH, pressure=[0.001, 0.01], theory="calibrated")


def made_law():
    return contact_law(ROUGH, "100 GPa", theory="calibrated", rtol=RTOL)


def made_law_that_yields():
    return contact_law(
        ROUGH, Bodies("100 GPa", hardness="1.5 GPa"), theory="calibrated", rtol=RTOL
    )


def made_joint():
    return Joint(FACE, FACE, bodies=METALS, nominal_area="4 cm^2", theory="calibrated")


def made_own_table():
    pytest.importorskip("tamaas")
    return BoundaryElements.of(made_map())


# how an object of each kind is made, and what is asked of it
OBJECTS = {
    "surface": (made_surface, asked_surface),
    "batch": (made_batch, asked_surface),
    "map": (made_map, asked_map),
    "spectrum": (made_spectrum, asked_surface),
    "contact": (made_contact, asked_contact),
    "law": (made_law, asked_law),
    "law that yields": (made_law_that_yields, asked_law),
    "joint": (made_joint, asked_joint),
    **{
        name: (functools.partial(resolve, name), asked_theory)
        for name in sorted(THEORIES)
    },
    "own table": (made_own_table, asked_own_table),
}
UNPICKLED = """
import json, pickle, sys
path, name = sys.argv[1:]
with open(path, "rb") as file:
    one = pickle.load(file)
import test_promises
print(json.dumps(test_promises.bits_of(test_promises.OBJECTS[name][1](one))))
"""


def bits_of(values):
    return [np.asarray(one, float).tobytes().hex() for one in values]


@pytest.mark.slow
@pytest.mark.parametrize("name", OBJECTS)
def test_what_is_unpickled_in_a_new_process_answers_as_before(name, tmp_path):
    """Its module is imported by the unpickling alone, which must bring all that its answers need."""
    make, ask = OBJECTS[name]
    one = make()
    path = tmp_path / "one.pickle"
    path.write_bytes(pickle.dumps(one))
    assert new_process(UNPICKLED, str(path), name, folder=tmp_path) == bits_of(ask(one))


@pytest.mark.slow
@pytest.mark.parametrize("hardness", [np.inf, 0.05], ids=["elastic", "yields"])
@pytest.mark.parametrize("theory", sorted(THEORIES))
def test_a_worker_of_dask_has_the_bits_of_this_process(theory, hardness):
    """Workers are new processes, to which chunks of gaps and the question go by pickle."""
    dask = pytest.importorskip("dask")
    gaps = xr.DataArray(np.linspace(0.5, 3.0, 24), dims="gap")
    eager = contact(ROUGH, Bodies(hardness=hardness), mean_separation=gaps, theory=theory)
    lazy = contact(
        ROUGH, Bodies(hardness=hardness), mean_separation=gaps.chunk(gap=8), theory=theory
    )
    with dask.config.set(scheduler="processes", num_workers=2):
        found = dask.compute(lazy.pressure, lazy.area)
    for values, expected in zip(found, (eager.pressure, eager.area), strict=True):
        np.testing.assert_array_equal(values, expected)


QUANTITIES = (
    "pressure",
    "area",
    "separation",
    "mean_separation",
    "stiffness",
    "error",
    "scatter",
    "valid",
)
HARDNESSES = pytest.mark.parametrize(
    "hardness", [np.inf, 0.05], ids=["elastic", "yields"]
)


@HARDNESSES
@pytest.mark.parametrize("given", ["separation", "mean_separation", "pressure", "area"])
@pytest.mark.parametrize("theory", sorted(THEORIES))
def test_numbers_lists_arrays_and_labels_have_the_same_bits(theory, given, hardness):
    """Each kind of argument, alone and among others, of any shape."""
    first = contact(
        ROUGH,
        Bodies(hardness=hardness),
        mean_separation=np.linspace(0.4, 3.0, 12),
        theory=theory,
    )
    asked = np.asarray(getattr(first, given))

    def answers(values):
        return contact_of(
            ROUGH, Bodies(hardness=hardness), **{given: values}, theory=theory
        )

    whole = answers(asked)
    kinds = {
        "list": asked.tolist(),
        "named": xr.DataArray(asked, dims="case"),
        "folded": asked.reshape(3, 4),
        "column by column": np.asfortranarray(asked.reshape(3, 4)),
        "every second": np.repeat(asked, 2)[::2],
        "read only": np.frombuffer(asked.tobytes()),
    }
    for kind, values in kinds.items():
        found = answers(values)
        for name in QUANTITIES:
            expected = np.asarray(getattr(whole, name))
            value = np.asarray(getattr(found, name))
            np.testing.assert_array_equal(
                value.ravel(), expected, err_msg=f"{kind}: {name}"
            )
    for place in (0, 5, 11):
        for number in (float(asked[place]), asked[place], np.array(asked[place])):
            found = answers(number)
            for name in QUANTITIES:
                expected = np.asarray(getattr(whole, name))[place]
                value = getattr(found, name)
                np.testing.assert_array_equal(
                    value, expected, err_msg=f"{type(number)}: {name}"
                )


def test_an_island_and_a_lookup_are_the_same_of_a_number_and_of_an_array():
    """As contacts are."""
    approach = np.linspace(0.01, 0.3, 7)
    X = np.linspace(0.5, 5.0, 7)
    table = open_table("universal")
    whole = island(ROUGH, approach)
    for place in range(7):
        one = island(ROUGH, float(approach[place]))
        assert (one.force, one.area) == (whole.force[place], whole.area[place])
        looked_up = table.answer(float(X[place]), 0.5)
        assert looked_up.phi_F == table.answer(X, 0.5).phi_F[place]
