"""Calls into the compiled functions and their answers; as a program, the same of the functions as plain Python."""

import dataclasses
import functools
import json
import math
import sys

import numpy as np

MAX_INTERVALS = 8


def leave_plain():
    """As where numba is not installed."""
    sys.modules["numba"] = sys.modules["llvmlite"] = None

    from mbma_tables.totals import intervals

    # giving up takes long uncompiled
    intervals.MAX_INTERVALS = MAX_INTERVALS


def solver():
    from mbma_tables import greenwood_tripp
    from mbma_tables.islands import newton
    from mbma_tables.islands.height_integrals import ORDERS, height_integral
    from mbma_tables.islands.spectral import basis

    for n in ORDERS:
        yield f"F_{n}", height_integral(n, [-30.0, -7.0, -5.0, -3.0, -1.0, 0.5, 2.0, 5.0, 30.0, 41.0])
    X = [1.0, 6.0, -5.0, 3.0, -50.0, -37.0, 2.0, -6.0, 1.0]
    mu = [0.5, 100.0, 1e-3, 0.0, 1.0, 1.0, 1e-18, 1e12, 1e4]
    found = greenwood_tripp.solve(X, mu, rtol=1e-6)
    yield "solved", (found.phi_F, found.phi_A)
    yield "steps and nodes", (found.iterations, found.nodes)
    yield "profiles", (found.pressure, found.gap)
    coarse = basis(12)
    fine = basis(24)
    w, p = np.zeros(12), np.zeros(12)
    steps, left = newton.newton_steps(1.0, 0.5, 16.0, coarse, -1.0, w, p)
    yield "never content", (steps, math.isnan(left), *w, *p)
    start = np.ones(24)
    steps = newton.coarse_start(1.0, 0.5, 16.0, coarse, fine.modes, start)
    yield "first guess", (steps, *start)
    for most, damping, stiffness in ((100, 0.3, 0.5), (3, 0.3, 0.5), (200, 0.9, 1e14)):
        used, converged, *phi = greenwood_tripp.solve_classical(5.0, stiffness, 12, damping, 1e-4, most)[:4]
        yield f"rings, {most} at most", (used, converged, *phi)


def tables():
    from mbma_tables.islands.geometry import geometry
    from mbma_tables.models.tables import island4d_model, universal_model
    from mbma_tables.surfaces.readings import REPORTED

    model = universal_model()
    highest = model.content.axes[1].high
    X = np.array([-5.0, 0.3, 3.0, 9.0, 20.0, 40.0, 1.0, 1.0, -7.0, 42.0, 1.0])
    mu = np.array([1e-4, 1.0, 30.0, 1e-6, 1e3, highest, 1e-9, 0.0, 1.0, 1.0, 2 * highest])
    for parallel in (False, True):
        found = model.answer(X, mu, parallel=parallel, outside="nan")
        yield f"universal, parallel {parallel}", (found.phi_F, found.phi_A, found.error)
    yield "universal, slopes", [[part.phi_F, part.phi_A] for part in model.slopes(X[:8], mu[:8])]

    model = island4d_model()
    hurst = np.array([0.8, 0.5, 0.95])
    g = geometry(np.array([1.0, 3.0, 2.0]), hurst, np.array([10.0, 200.0, 1000.0]), REPORTED)
    islands = g["X"] * g["sigma"] + g["zeta_d"] ** -hurst, g["zeta_d"], g["zeta_u"], hurst
    for parallel in (False, True):
        found = model.lookup(*islands, parallel=parallel)
        yield f"island4d, parallel {parallel}", (found.F_hat, found.A_hat, found.error)
    found = model.lookup(*islands, derivatives=True)
    yield "four numbers, slopes", [list(by.values()) for by in (found.F_by, found.A_by)]


def band():
    from mbma_tables.islands.geometry import geometry
    from mbma_tables.surfaces.readings import PRINTED, REPORTED
    from mbma_tables.surfaces.spectrum import band_moment

    approach, hurst = np.array([1e-9, 1e-3, 0.1, 2.0, 30.0]), np.array([0.8, 0.5, 1.0, 0.3, 0.8])
    plain = dataclasses.replace(REPORTED, name="plain", offset=False, summit_sigma=False)
    for reading in (REPORTED, PRINTED, plain):
        yield f"islands, {reading.name}", list(geometry(approach, hurst, np.full(5, 200.0), reading).values())
    for order in (0, 2, 4):
        yield f"m{order}", band_moment(order, [0.3, 1.0, 0.8], [1.0, 2.0, 3.0], [1.0, 5.0, 3.1])


def totals():
    from mbma_tables import Surface, contact
    from mbma_tables.surfaces.readings import REPORTED

    exact = dataclasses.replace(REPORTED, name="exact", jacobian="exact")
    plain = dataclasses.replace(exact, name="plain", offset=False, summit_sigma=False)
    surfaces = Surface([0.8, 1.0, 0.998, 0.8], q0=1.0, q1=[200.0, 200.0, 200.0, 3.2], h_rms=1.0, h_max=4.0)
    gaps = np.array([[4.0], [3.999], [1.5], [-3.0]])
    for reading in ("reported", "printed", exact, plain):
        found = contact(surfaces, gaps, reading=reading, rtol=1e-4, derivatives=True)
        name = reading if isinstance(reading, str) else reading.name
        yield f"totals, {name}", (found.force, found.area)
        yield f"totals by all numbers, {name}", [list(by.values()) for by in (found.force_by, found.area_by)]
    found = contact(Surface(0.8, 1.0, 200.0, 1.0, 4.0), 1.0, rtol=1e-11, derivatives=True)
    yield "totals by all numbers, refined", [list(by.values()) for by in (found.force_by, found.area_by)]
    for which in ("force", "area"):
        yield f"{which} alone", getattr(contact(surfaces, 1.0, rtol=1e-6, quantities=[which]), which)


def statuses():
    """Totals that end without an answer, and whose sums underflow."""
    from scipy.optimize import brentq

    from mbma_tables.models.protocol import BOTH, FORCE
    from mbma_tables.models.tables import universal_model
    from mbma_tables.surfaces.readings import REPORTED
    from mbma_tables.totals import intervals, kernel

    table = universal_model().kernel
    surface = kernel.surface_constants(0.8, 200.0, REPORTED.numbers, True)
    # the deepest island is just outside, the last node of the quadrature inside
    outside = (1 + 1e-9) * table.X_high
    last = brentq(lambda x: kernel.island_node(x, True, True, surface).X - outside, 2.0, 100.0)
    for name, compression, peak, rtol in (
        ("unresolved", 3.0, 4.0, 1e-30),
        ("nothing", 1e-3, 60.0, 1e-3),
        ("outside", 100.0, 100.0, 1e-3),
        ("at the table's end", last, 40.0, 1e-3),
        ("no contact", 0.0, 3.0, 1e-3),
    ):
        gap, out = intervals.Gap(compression, peak), np.empty((2, intervals.COLUMNS))
        asked = (BOTH, None), (FORCE, None), (BOTH, True)
        yield name, [intervals.total(which, gap, rtol, surface, slopes, table, out)[0] for which, slopes in asked]


class Bounded:
    """A theory whose contact ends at h_max, with a force that has no bound at u = 0."""

    name = "bounded"

    def answer(self, surface, u):
        with np.errstate(divide="ignore", invalid="ignore"):
            return (surface.h_max - u) ** 1.5 / u, 0.1 * (surface.h_max - u)


def laws():
    from mbma_tables import Surface, contact_law
    from mbma_tables.theories import law_kernel

    gaps = [5.0, 3.0, 2.9, 1.0, 0.0, -3.0]
    # turning, not turning, and turning for a hundredth of the range
    for hurst, q1, h_max in ((0.2, 1e7, 3.0), (0.8, 30.0, 4.0), (0.5, 334390.7992055036, 3.163258089330122)):
        law = contact_law(Surface(hurst, 1.0, q1, 1.0, h_max), reading="printed", rtol=1e-3)
        for name in ("force", "area", "stiffness", "area_slope", "energy"):
            yield f"law at H = {hurst}, {name}", getattr(law, name)(gaps)
        turns = law.turning_point, law.area_turning_point
        yield f"ends at H = {hurst}", [math.nan if turn is None else turn for turn in turns]
        for name, turn in zip(("force", "area"), turns, strict=True):
            one, most = getattr(law, name)([2.5, -h_max if turn is None else turn])
            wanted = np.array([0.0, 1e-9 * one, one, 0.99 * most])
            yield f"inverse of {name} at H = {hurst}", law.separation(**{name: wanted})
    for theory in ("greenwood_williamson", Bounded()):
        law = contact_law(Surface(0.8, 1.0, 30.0, 1.0, 4.0), rtol=1e-3, theory=theory)
        for name in ("force", "area", "stiffness", "area_slope", "energy"):
            yield f"law of {law.theory}, {name}", getattr(law, name)([-1.0, 2.0, 3.999999])
        yield f"inverse of {law.theory}", law.at_pressure(law.force([-1.0, 2.0]))[0]
    law = contact_law(Surface(0.8, 1.0, 30.0, 1.0, 4.0), reading="printed", rtol=1e-3)
    own = functools.partial(law_kernel.evaluate, law_kernel.ENERGY, law.block.ctypes.data)
    yield "bound", (own(1.0), own(5.0), math.isnan(own(-4.1)), math.isnan(own(math.nan)))


GROUPS = (solver, tables, band, totals, statuses, laws)


def answers():
    """Name of each call and its answer, flat."""
    return {name: np.ravel(value).astype(float).tolist() for group in GROUPS for name, value in group()}


if __name__ == "__main__":
    leave_plain()
    json.dump(answers(), sys.stdout)
