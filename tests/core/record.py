"""Record calls of the compiled core, as the library makes them: ``python record.py FILE``."""

import operator
import pathlib
import pickle
import struct
import sys
from typing import Any, NamedTuple
from unittest import mock

import numpy as np

from mbma_tables import Bodies
from mbma_tables import core as package
from mbma_tables.islands.variants import REPORTED
from mbma_tables.surfaces.bearing_curve import FRACTIONS
from mbma_tables.tables.island4d import band_fields
from mbma_tables.theories import Mbma
from mbma_tables.theories.mbma import sums
from mbma_tables.theories.yielding.formulas import (
    BearingCurve,
    bearing_share,
    diffused,
    force,
)

MOST_CALLS = 12  # of each function
MOST_BYTES = 5_000_000  # of an array


def functions():
    found = vars(package.core).items()
    return [
        (name, one)
        for name, one in found
        if type(one).__name__ == "builtin_function_or_method"
    ]


def copied(given):
    return [np.copy(one) if isinstance(one, np.ndarray) else one for one in given]


class Call(NamedTuple):
    name: str
    given: list[Any]  # arguments, arrays as they were before
    returned: int
    after: list[Any]  # and as they were after it

    def packed(self):
        """For replay.c."""
        parts = [struct.pack("<64sq", self.name.encode(), len(self.given))]
        for one in self.given:
            if isinstance(one, np.ndarray):
                parts += [
                    struct.pack("<qqqd", one.nbytes, one.itemsize, 0, 0.0),
                    one.tobytes(),
                ]
            else:
                whole = (
                    0 if one is None or isinstance(one, float) else operator.index(one)
                )
                parts.append(
                    struct.pack("<qqqd", -1, 1, whole, 0.0 if one is None else one)
                )
        return b"".join(parts)


def recorded(using):
    calls = {}

    def recording(name, function):
        def call(*given):
            found = calls.setdefault(name, [])
            big = any(
                one.nbytes > MOST_BYTES for one in given if isinstance(one, np.ndarray)
            )
            if len(found) == MOST_CALLS or big:
                return function(*given)
            before = copied(given)
            returned = function(*given)
            found.append(Call(name, before, int(returned), copied(given)))
            return returned

        return call

    for name, function in functions():
        calls[name] = []
        setattr(package.core, name, recording(name, function))
    using()
    missing = [name for name, found in calls.items() if not found]
    assert not missing, f"nothing is called of {', '.join(missing)}"
    return [call for found in calls.values() for call in found]


def table_of_a_function():
    """A table of two numbers and two outputs, three cells of four coefficients each."""
    from mbma_tables.tables.function_table import (
        FunctionAxis,
        FunctionOutput,
        FunctionTable,
    )

    axes = (
        FunctionAxis("x", 0.0, 1.0, "log", 0.5),
        FunctionAxis("y", 0.0, 2.0, outside="periodic"),
    )
    arrays = {
        "branches": np.array([[0, 1], [-1, 0], [1, 3], [-1, 1], [-1, 2]]),
        "middles": np.array([-0.3, 0.0, 1.0, 0.0, 0.0]),
        "starts": np.array([0, 8, 16]),
        "terms": np.full((3, 2), 2),
        "coefficients": np.linspace(0.1, 1.0, 24),
        "errors": np.full((3, 2), 1e-3),
    }
    return FunctionTable(
        axes, (FunctionOutput("u"), FunctionOutput("v", transform="log")), arrays, {}
    )


def use():
    """Call every function, by the library where it does."""
    from mbma_tables import Surface, contact, contact_law, greenwood_tripp, open_table

    core = package.core
    for which, first in enumerate([-700.0, -2.0, 1e-300, -0.9, -6.0]):
        x = np.linspace(first, 10.0, 501)
        core.elementary(which, x, np.empty(501))
    core.island_geometry(
        0.3, 0.7, 300.0, np.array([2.0, 0.37, 0.5, 1.5, 1.5, 1.0, 1.0, 0.0]), np.empty(14)
    )
    surfaces = np.linspace(0.3, 0.9, 20), np.linspace(1.5, 6.0, 20), np.full(20, 3.0)
    core.self_affine(*surfaces[:2], np.empty(20), np.empty(20))
    core.island_extents(np.array([2.0]), np.array([0.5]), 3e-8, np.empty(1))

    universal = open_table("universal")
    X = np.linspace(-5, 40, 300)
    mu = np.geomspace(1e-6, 1e5, 300)
    universal.answer(X, mu)
    four = np.linspace(1.0, 3.0, 40), 3.0, np.linspace(3.1, 400.0, 40), 0.8
    open_table("island4d").lookup(*four)
    band_fields(np.geomspace(1e-9, 1e3, 300), np.linspace(0, 1, 300), 0.7, REPORTED)
    of_functions = table_of_a_function()
    of_functions.lookup(np.linspace(0, 1, 300), 0.5)
    of_functions.lookup(np.linspace(0, 1, 300), 3.7, derivatives=1)
    for guess in (np.empty(0), of_functions._guesses[0].ravel()):
        # more points than are sorted at a time, some without an answer
        wanted = np.linspace(-2.0, 3.0, 2200)
        points = np.tile([0.3, 1.2], (2200, 1)).reshape(-1)
        numbers = np.empty((2, 2200))
        core.cell_inverse(
            *(*of_functions._core, 0, 0, 1, guess, wanted),
            *(points, *numbers, np.empty(2200, dtype=np.int64)),
        )
    greenwood_tripp.rigid_sphere(X, mu)
    greenwood_tripp.solve(X[50:250:10], mu[50:250:10]).pressure.sum()
    one = Surface(0.7, 0.2, 60.0, 1.0, 3.0)
    many = Surface(np.linspace(0.3, 1.0, 40), 0.2, np.geomspace(0.7, 4000, 40), 1.0, 3.0)
    assert contact(one, separation=[0.5, 1.0]).stiffness.all()
    contact(many, separation=np.linspace(-2, 2.9, 40), theory=Mbma(rtol=1e-6))
    # a batch of two surfaces: each of its numbers is spoilt in many ways under sanitizers
    few = Surface(np.array([0.5, 0.9]), 0.2, 60.0, 1.0, 3.0)
    with mock.patch.object(sums, "FEW_SURFACES", 1):
        by_table = Mbma("island4d", rtol=1e-2, outside="nan")
        contact(few, separation=2.0, theory=by_table)
        contact(few, separation=2.0, theory=Mbma(variant="fitted"))
    law = contact_law(one, theory="mbma")
    gaps = np.linspace(-2.9, 2.9, 100)
    for quantity in (law.pressure, law.area, law.stiffness, law.area_slope, law.energy):
        quantity(separation=0.5)
        quantity(separation=np.linspace(-2.9, 2.9, 2000))
    law.at_pressure(law.pressure(separation=np.linspace(-2, 2.5, 30)))
    law.leakage(separation=gaps)
    law.slope_error(separation=gaps)
    for theory in ("mbma", "calibrated", "persson"):
        for cap in (np.inf, 0.05):
            found = contact(
                one,
                Bodies(hardness=cap),
                mean_separation=np.linspace(0.2, 2.5, 30),
                theory=theory,
            )
            contact(one, Bodies(hardness=cap), pressure=found.pressure, theory=theory)
    assert (found.plane_separation < found.mean_separation).any()
    yielded = contact(one, Bodies(hardness=0.05), pressure=1e-3, theory="calibrated")
    assert yielded.flow_coefficient > 0
    after = {"largest_pressure": 2e-3, "theory": "calibrated"}
    pressed = contact(one, Bodies(hardness=0.05), pressure=[1e-3, 5e-4], **after)
    assert pressed.energy.all()
    assert pressed.flow_coefficient.all()
    assert found.yielded.any()
    assert (found.unloading_stiffness > found.stiffness).any()
    bearing_share(np.linspace(0.0, 3.5, 30), 3.0)
    force(0.1, 0.5, 0.2, -0.4, 0.3)
    diffused(np.linspace(0.0, 1.0, 30), np.geomspace(1e-3, 1.0, 30), -1.0)
    BearingCurve(np.linspace(3.0, 0.0, FRACTIONS.size), 3.3)
    bodies = Bodies("1 GPa", nu=0.3, conductivity="45 W/(m K)")
    in_units = Surface(0.7, 0.2, 60.0, 1.0, 3.0, unit="um")
    pressed = contact(in_units, bodies, pressure=["1 MPa", "2 MPa"], theory="calibrated")
    assert pressed.tangential_stiffness.all()
    assert pressed.solid_conductance.all()
    contact(many, mean_separation=1.0, theory="calibrated")
    # outside the calibrated table
    beyond = Surface(0.05, 1.0, 30.0, 1.0, 3.0)
    pressed = contact(beyond, pressure=[0.01, 0.1], theory="calibrated")
    assert pressed.leakage.K.all()
    assert pressed.energy.all()


if __name__ == "__main__":
    from record import recorded, use  # whose calls others can read

    pathlib.Path(sys.argv[1]).write_bytes(pickle.dumps(recorded(use)))
