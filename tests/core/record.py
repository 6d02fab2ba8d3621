"""Record calls of the compiled core, as the library makes them, for replay.c: ``python record.py FILE``."""

import operator
import pathlib
import struct
import sys

import numpy as np

from mbma_tables import core as package

MOST_CALLS = 12  # of each function
MOST_BYTES = 20_000_000  # of an array


def functions():
    """The functions of the core by their names."""
    found = vars(package.core).items()
    return [(name, one) for name, one in found if type(one).__name__ == "builtin_function_or_method"]


class Recorder:
    """Stands in for every function of the core, and writes down the first calls of each."""

    def __init__(self):
        self.numbers, self.arrays, self.trusted, self.calls = {}, [], set(), {}
        for name, function in functions():
            self.calls[name] = []
            setattr(package.core, name, self.recording(name, function))

    def number(self, array):
        """Of an array in the file, where equal ones are one."""
        view = memoryview(array)
        key = ({"q": "l", "?": "B"}.get(view.format, view.format), view.itemsize, view.tobytes())
        return self.numbers.setdefault(key, len(self.numbers))

    def before(self, given):
        """Arguments as they are written, but for what becomes of arrays."""
        for one in given:
            if one is None:
                yield struct.pack("<I", ord("N"))
            elif isinstance(one, np.ndarray):
                yield struct.pack("<III", ord("A"), one.flags.writeable, self.number(one))
            elif isinstance(one, float):
                yield struct.pack("<Id", ord("d"), one)
            else:
                yield struct.pack("<Iq", ord("i"), operator.index(one))

    def recording(self, name, function):
        def call(*given):
            arrays = [one for one in given if isinstance(one, np.ndarray)]
            if len(self.calls[name]) == MOST_CALLS or any(one.nbytes > MOST_BYTES for one in arrays):
                return function(*given)
            before = list(self.before(given))
            returned = function(*given)
            after = [struct.pack("<I", self.number(one)) if isinstance(one, np.ndarray) else b"" for one in given]
            arguments = b"".join(part for pair in zip(before, after, strict=True) for part in pair)
            head = struct.pack(f"<I{len(name)}sqI", len(name), name.encode(), returned, len(given))
            self.calls[name].append(head + arguments)
            if name.endswith("_fits") and returned:
                self.trusted |= {self.number(one) for one in arrays}
            return returned

        return call

    def write(self, path):
        """A file for replay.c."""
        parts = [struct.pack("<I", len(self.numbers))]
        for (kind, size, content), number in self.numbers.items():
            parts += [struct.pack("<IIII", ord(kind), size, number in self.trusted, len(content)), content]
        calls = [call for recorded in self.calls.values() for call in recorded]
        pathlib.Path(path).write_bytes(b"".join([*parts, struct.pack("<I", len(calls)), *calls]))


def use():
    """Call every function, by the library where it does."""
    from mbma_tables import Surface, contact, contact_law, greenwood_tripp, open_table
    from mbma_tables.laws import hardness
    from mbma_tables.laws.bearing_curve import FRACTIONS
    from mbma_tables.theories.calibrated_table import shipped

    core = package.core
    for which, first in enumerate([-700.0, -2.0, 1e-300, -0.9, -6.0]):
        x = np.linspace(first, 10.0, 501)
        core.elementary(which, x, np.empty(501))
    core.island_geometry(0.3, 0.7, 300.0, np.array([2.0, 0.37, 0.5, 1.5, 1.5, 1.0, 1.0, 0.0]), np.empty(14))
    surfaces = np.linspace(0.3, 0.9, 20), np.linspace(1.5, 6.0, 20), np.full(20, 3.0)
    core.calibrated_slopes(*shipped().core_table, *surfaces, None, None, np.linspace(0.3, 2.5, 20), np.empty((20, 10)))
    core.self_affine(*surfaces[:2], np.empty(20), np.empty(20))
    greenwood_tripp.solve_classical(2.0, 0.5, 20, 0.3, 1e-6, 100)
    hardness.diffused(surfaces[0], 0.1, 1.0)
    hardness.BearingCurve(np.linspace(3.0, 1.0, FRACTIONS.size), 3.0)
    u = np.geomspace(2.9, 0.1, 12)
    core.gap_start(1, u, np.exp(-u), np.exp(-u), 1, surfaces[0], surfaces[2], np.full((6, 20), 0.5))

    open_table("island4d").lookup(np.linspace(1.0, 2.0, 100), 3.0, 20.0, 0.8)
    universal = open_table("universal")
    X, mu = np.linspace(-5, 40, 300), np.geomspace(1e-6, 1e5, 300)
    universal.answer(X, mu)
    universal.slopes(X, mu)
    greenwood_tripp.solve(X[50:250:10], mu[50:250:10]).pressure.sum()
    one = Surface(0.7, 0.2, 60.0, 1.0, 3.0)
    many = Surface(np.linspace(0.3, 1.0, 40), 0.2, np.geomspace(0.7, 4000, 40), 1.0, 3.0)
    for derivatives in (False, True):
        contact(one, separation=[0.5, 1.0], derivatives=derivatives)
        contact(many, separation=np.linspace(-2, 2.9, 40), rtol=1e-6, derivatives=derivatives)
    law, gaps = contact_law(one), np.linspace(-2.9, 2.9, 100)
    for quantity in (law.pressure, law.area, law.stiffness, law.area_slope, law.energy):
        quantity(separation=0.5)
        quantity(separation=np.linspace(-2.9, 2.9, 2000))
    law.at_pressure(law.pressure(separation=np.linspace(-2, 2.5, 30)))
    law.leakage(separation=gaps)
    law.slope_error(separation=gaps)
    for theory in ("mbma", "calibrated", "persson"):
        for cap in (np.inf, 0.05):
            found = contact(one, mean_separation=np.linspace(0.2, 2.5, 30), theory=theory, hardness=cap)
            contact(one, pressure=found.pressure, theory=theory, hardness=cap)
    contact(many, mean_separation=1.0, theory="calibrated")
    # outside the calibrated table
    contact(Surface(0.05, 1.0, 30.0, 1.0, 3.0), pressure=[0.01, 0.1], theory="calibrated")


if __name__ == "__main__":
    recorder = Recorder()
    use()
    recorder.write(sys.argv[1])
    missing = [name for name, calls in recorder.calls.items() if not calls]
    if missing:
        sys.exit(f"use() calls nothing of {', '.join(missing)}")
