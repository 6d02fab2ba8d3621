"""Times of tables, totals, laws, the calibrated law, exported C, scenes and a fresh process, each beside a peer.

``python -m benchmarks`` prints them, ``--write`` puts them into docs/lookup.md too, and
``python -m benchmarks joints`` those of joints and tables of designs. One
core; every ratio is of two processor times taken in turn, the median over the rounds, so
that what else the machine does falls on both. docs/lookup.md has error against time of every
island model.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import dataclasses
import functools
import importlib.util
import itertools
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time
import timeit
from collections.abc import Callable
from typing import Any

import click
import numpy as np
from scipy.interpolate import NdBSpline, RegularGridInterpolator, make_interp_spline

from benchmarks.display import display, display_command
from benchmarks.exports import exported
from benchmarks.functions import functions
from benchmarks.kernels import BEFORE, held_out, measured
from benchmarks.maps import maps
from benchmarks.programs import exports_command
from benchmarks.rows import LINES, Line, microseconds, report, rounds, times_faster
from benchmarks.scenes import scenes
from benchmarks.surrogates import surrogates
from benchmarks.table_uses import table_uses
from generate import page
from generate.files import ROOT
from mbma_tables import (
    Adhesion,
    Bodies,
    Joint,
    Surface,
    contact,
    contact_law,
    greenwood_tripp,
    in_chunks,
    open_table,
)
from mbma_tables.common.files import shipped_file
from mbma_tables.design import batch as designs
from mbma_tables.theories import Calibrated, Mbma
from mbma_tables.theories.calibrated.formulas import Spectrum, SpectrumLaw

POINTS = 20_000
HELD_OUT = 500
MANY = 100_000
GRID = 256
SURFACES = 2_000
GAPS = 100_000
MANY_GAPS = 1_000_000
CALLS = 10_000  # of one number: a loop of them, not its first ones
JOINTS = 10_000
MILLION = 1_000_000
ROWS = 100_000  # of a table of designs
METALS = ("steel 4140 hard", "aluminium 6061 hard")
HARD = Bodies(hardness=0.1)
BAND_NUMBERS = ("hurst", "longest", "shortest")
FLOWS = ("flow_coefficient", "hydraulic_aperture", "leakage_scatter")
DESIGNS = 20  # surfaces of a design loop, likewise
NOMINAL_EXACT = 15_000  # islands/s, a rate to compare with that is not measured here
SEED = 7


def peers(X: np.ndarray, mu: np.ndarray) -> dict[str, Callable[[], Any]]:
    """Other interpolators of log(Phi_F/mu) over (X, log mu), all on one grid."""
    nodes = [np.linspace(-6.25, 41, GRID), np.linspace(np.log(1e-8), np.log(1e6), GRID)]
    grid = np.meshgrid(nodes[0], np.exp(nodes[1]), indexing="ij")
    values = np.log(open_table("universal").answer(*grid).phi_F / grid[1])
    at = np.stack([X, np.log(mu)], axis=-1)
    cubic = RegularGridInterpolator(nodes, values, method="cubic")
    spline = NdBSpline(*_knots(nodes, values), 5)
    found = {
        "scipy RGI, cubic": lambda: cubic(at),
        "scipy NdBSpline, quintic": lambda: spline(at),
    }
    if importlib.util.find_spec("interpn"):
        import interpn

        starts = np.array([n[0] for n in nodes])
        steps = np.array([n[1] - n[0] for n in nodes])
        fast = interpn.MulticubicRegular.new(
            [GRID, GRID], starts, steps, np.ascontiguousarray(values)
        )
        columns = [np.ascontiguousarray(column) for column in at.T]
        found["interpn, cubic"] = lambda: fast.eval(columns)
    return found


def _knots(
    nodes: list[np.ndarray], values: np.ndarray
) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    knots = []
    for axis, own in enumerate(nodes):
        one = make_interp_spline(own, values, k=5, axis=axis)
        knots.append(one.t)
        values = np.moveaxis(one.c, 0, axis)
    return tuple(knots), values


def tables(rng: np.random.Generator) -> None:
    """The universal table against its past and others' interpolators."""
    universal = open_table("universal")
    X = rng.uniform(-6.25, 41.0, MANY)
    mu = 10 ** rng.uniform(-8, 6, MANY)
    click.echo("\nUniversal table: Phi_F, Phi_A and the bound on their error at once")
    some = slice(HELD_OUT)
    exact = greenwood_tripp.solve(X[some], mu[some], rtol=1e-12)
    found = universal.answer(X[some], mu[some])
    error = max(
        np.abs(found.phi_F / exact.phi_F - 1).max(),
        np.abs(found.phi_A / exact.phi_A - 1).max(),
    )
    report(f"largest error on {HELD_OUT} fresh points", error, "", at_most=1e-9)
    report("file", shipped_file("universal.nc").stat().st_size / 1e6, "MB", at_most=6)
    given = X[:POINTS], mu[:POINTS]
    own = {"own": lambda: universal.answer(*given)}
    others = peers(*given)
    beside = rounds(own | others, 3)
    for name in others:
        report(
            f"faster than {name}, {GRID} x {GRID} nodes, one function",
            times_faster(beside, name, "own"),
            "x",
        )


def one_step() -> dict[str, Callable[[], Any]]:
    """From pressures to displacements on GRID x GRID points, once, in boundary-element programs that are installed."""
    pressures = np.random.default_rng(SEED).uniform(0, 1, (GRID, GRID))
    steps: dict[str, Callable[[], Any]] = {}
    if importlib.util.find_spec("ContactMechanics"):
        from ContactMechanics import PeriodicFFTElasticHalfSpace

        half_space = PeriodicFFTElasticHalfSpace((GRID, GRID), 1.0, (1.0, 1.0))
        steps["ContactMechanics"] = lambda: half_space.evaluate_disp(pressures)
    if importlib.util.find_spec("tamaas"):
        import tamaas

        model = tamaas.ModelFactory.createModel(
            tamaas.model_type.basic_2d, [1.0, 1.0], [GRID, GRID]
        )
        model.traction[:] = pressures
        steps["Tamaas"] = model.solveNeumann
    return steps


def totals(rng: np.random.Generator) -> None:
    """`contact` on many surfaces."""
    surfaces, gaps = held_out(SURFACES, rng)
    taken = rounds(
        {
            "exact": lambda: contact(
                surfaces, separation=gaps, theory=Mbma(island_model="exact")
            ),
            "value": lambda: contact(surfaces, separation=gaps),
        },
        3,
    )
    exact = contact(surfaces, separation=gaps, theory=Mbma(island_model="exact")).islands
    looked_up = contact(surfaces, separation=gaps).islands
    click.echo(f"\ncontact at 1e-8, one gap on each of {SURFACES} surfaces")
    report("time a total", microseconds(taken["value"], SURFACES), "us", at_most=7)
    rate = exact / statistics.median(taken["exact"])
    report("islands solved by exact, a second", rate, "1/s")
    report(
        "islands looked up, a second",
        looked_up / statistics.median(taken["value"]),
        "1/s",
    )
    report(
        "faster than our own exact island model",
        times_faster(taken, "exact", "value"),
        "x",
        150,
    )
    nominal = exact / NOMINAL_EXACT / statistics.median(taken["value"])
    report(
        f"faster than a solver of {NOMINAL_EXACT} islands/s at exact's island count",
        nominal,
        "x",
    )
    steps = one_step()
    if steps:
        one = Surface.named("concrete")
        both = rounds({"contact": lambda: contact(one, separation=0.4)} | steps)
        for name in steps:
            report(
                f"one contact is faster than one step of {name}",
                times_faster(both, name, "contact"),
                "x",
            )


def laws(rng: np.random.Generator) -> None:
    """A frozen surface against numpy and scipy."""
    surface = Surface.named("asphalt")
    law = contact_law(surface, theory="mbma")
    gaps = rng.uniform(0, 0.99995 * surface.h_max, MANY_GAPS)
    nodes = np.linspace(0, surface.h_max, 1000)
    values = law.pressure(nodes)
    linear = RegularGridInterpolator((nodes,), values)
    one = float(gaps[0])
    point = gaps[:1]
    forces = law.pressure(gaps)
    fresh = itertools.count(1)
    taken = rounds(
        {
            "law": lambda: law.pressure(gaps),
            "slope": lambda: law.pressure_and_stiffness(gaps),
            "energy": lambda: law.energy(gaps),
            "inverse": lambda: law.at_pressure(forces),
            # a surface that nothing is kept of
            "making": lambda: contact_law(
                dataclasses.replace(
                    surface, h_max=surface.h_max * (1 + 1e-9 * next(fresh))
                ),
                theory="mbma",
            ),
            "numpy": lambda: np.interp(gaps, nodes, values),
            "scalar law": lambda: [law.pressure(one) for _ in range(CALLS)],
            "scalar scipy": lambda: [linear(point) for _ in range(CALLS)],
        }
    )
    some = gaps[:2000]
    truth = contact(surface, mean_separation=some, theory=Mbma(rtol=1e-10)).pressure
    click.echo("\ncontact_law of one surface, asphalt")
    report("making a law", 1e3 * statistics.median(taken["making"]), "ms", at_most=2)
    report(
        "law.pressure, a random gap", 1e3 * microseconds(taken["law"], MANY_GAPS), "ns"
    )
    for what, key, most in (
        ("pressure", "law", 0.1),
        ("pressure and stiffness", "slope", 0.12),
        ("energy", "energy", 0.12),
        ("gap, area and stiffness at a pressure", "inverse", 0.3),
    ):
        name = f"{what} against numpy.interp on 1000 nodes, same points"
        report(name, times_faster(taken, key, "numpy"), "x", at_most=most)
    report(
        "scalar call against RegularGridInterpolator's",
        times_faster(taken, "scalar scipy", "scalar law"),
        "x",
        25,
    )
    report("largest error of the law", np.abs(law.pressure(some) / truth - 1).max(), "")
    report(
        "largest error of numpy.interp",
        np.abs(np.interp(some, nodes, values) / truth - 1).max(),
        "",
    )


def calibrated(rng: np.random.Generator) -> None:
    """The calibrated law through its table, against numpy, and against its own quadrature."""
    click.echo("\nThe calibrated law")
    surface = Surface(0.8, 1.0, 64.0, 1.0, 3.3)
    u = rng.uniform(0.01, 3.3, GAPS)
    some = u[:HELD_OUT]
    theory = Calibrated()
    law = SpectrumLaw(Spectrum.self_affine(0.8, 64.0), 3.3)
    taken = rounds(
        {
            "table": lambda: theory.answer(surface, u),
            "law": lambda: law.contact(some)[::2],
        }
    )
    spent = microseconds(taken["table"], GAPS)
    report(
        "force, area and stiffness of a random separation", 1e3 * spent, "ns", at_most=100
    )
    surfaces, gaps = held_out(SURFACES, rng)
    asked_of = {
        "one surface": (surface, u),
        "one gap a surface": (surfaces, (gaps + surfaces.h_max) / 2),
    }
    for what, (batch, mean) in asked_of.items():
        asked = functools.partial(
            contact, batch, mean_separation=mean, theory="calibrated"
        )
        both = rounds({"contact": asked, "leakage": lambda asked=asked: asked().leakage})
        report(
            f"contact with leakage, {what}",
            times_faster(both, "leakage", "contact"),
            "x",
            at_most=1.5,
        )
    report(
        "faster than the law's quadrature",
        microseconds(taken["law"], HELD_OUT) / spent,
        "x",
    )


def attracted(rng: np.random.Generator) -> None:
    """Contacts at pressures with an attraction between the bodies, over those without."""
    click.echo("\nContacts with an attraction over elastic ones, by pressure")
    bodies = Bodies("1 GPa", adhesion=Adhesion("10 mJ/m^2", "10 nm"))

    def face() -> Surface:
        return Surface(0.8, q0=0.1, q1=1.6, h_rms=0.1, h_max=0.35, unit="um")

    one = face()
    for loads in (1, 100, SURFACES):
        pressure = np.sort(rng.uniform(1e-4, 2e-2, loads))
        asked = functools.partial(contact, pressure=pressure, theory="calibrated")
        taken = rounds(
            {
                "with": lambda asked=asked: asked(one, bodies).area,
                "without": lambda asked=asked: asked(one, "1 GPa").area,
                "first with": lambda asked=asked: asked(face(), bodies).area,
                "first without": lambda asked=asked: asked(face(), "1 GPa").area,
            },
            31,
        )
        report(
            f"{loads} loads of one pair of bodies",
            times_faster(taken, "with", "without"),
            "x",
            at_most=2,
        )
        report(
            f"the first {loads} of a new surface",
            times_faster(taken, "first with", "first without"),
            "x",
        )


def kernels(rng: np.random.Generator) -> None:
    """Every kernel in terms of its time with numba."""
    click.echo("\nTimes over those of the last version that used numba, warm")
    found = measured()
    shares = {name: found[name] / BEFORE[name] for name in found}
    for name, share in shares.items():
        exact = name.startswith("exact")
        report(name, share, "x", at_most=0.85 if exact else 1.35)
    report("mean of all", statistics.mean(shares.values()), "x", at_most=1.0)


def few_numbers(rng: np.random.Generator) -> None:
    """Calls of single numbers and of ten."""
    surface = Surface.named("asphalt")
    law = contact_law(surface, theory="mbma")
    ten = np.linspace(0.1, 1.0, 10)
    u = np.linspace(0.05, 0.9, 100) * surface.h_max
    law.at_pressure(1e-4)
    calls: dict[str, tuple[Callable[[], Any], int, float]] = {
        "law.pressure(1.0)": (lambda: law.pressure(1.0), CALLS, 0.1),
        "law.pressure(separation=1.0)": (
            lambda: law.pressure(separation=1.0),
            CALLS,
            0.15,
        ),
        "law.pressure of ten numbers": (lambda: law.pressure(ten), CALLS, 1.0),
        "contact at a pressure with a hardness": (
            lambda: contact(
                surface, Bodies(hardness=0.1), pressure=1e-3, theory="calibrated"
            ),
            50,
            500.0,
        ),
        "100 gaps of Persson's theory": (
            lambda: contact(surface, mean_separation=u, theory="persson"),
            3,
            2000.0,
        ),
        "Persson's law": (lambda: contact_law(surface, theory="persson"), 3, 50e3),
        "Persson's law with a hardness": (
            lambda: contact_law(surface, Bodies(hardness=0.1), theory="persson"),
            1,
            150e3,
        ),
    }
    click.echo("\nFew numbers")
    for name, (call, count, most) in calls.items():
        call()
        spent = min(timeit.repeat(call, number=count, repeat=5)) / count
        report(name, 1e6 * spent, "us", at_most=most)


def _parts(rng: np.random.Generator, count: int) -> list[dict[str, Any]]:
    """Two faces of many joints, each with a band of its own."""
    return [
        {
            "hurst": rng.uniform(0.6, 0.95, count),
            "longest": rng.uniform(200.0, 800.0, count),
            "shortest": rng.uniform(2.0, 8.0, count),
            "Rq": rng.uniform(0.2, most, count),
            "unit": "um",
        }
        for most in (0.8, 1.6)
    ]


def _every_quantity(
    faces: list[dict[str, Any]], pressures: np.ndarray, flow: bool
) -> None:
    """All quantities of a batch of joints, those of flow where they are asked for."""
    joint = Joint(*faces, bodies=METALS, nominal_area="4 cm^2", friction=0.2)
    pressed = joint.at_pressure(pressures)
    for name in pressed.available():
        if flow or name not in FLOWS:
            pressed.quantity(name)


def _table_of_one(shortest: float, changed: float) -> None:
    """A design that nothing is kept of, from its numbers to its table."""
    band = {"hurst": 0.8, "longest": 500.0, "unit": "um"}
    joint = Joint(
        band | {"Rq": 0.4, "shortest": 8.0},
        band | {"Rq": 0.7 * changed, "shortest": shortest},
        bodies=METALS,
        nominal_area="4 cm^2",
    )
    joint.table(["1 MPa", "10 MPa", "50 MPa"])


def _table_of_designs(folder: pathlib.Path, rng: np.random.Generator) -> pathlib.Path:
    """A CSV file of faces of five numbers, of a modulus and a hardness, for `mbma batch`."""
    numbers = {
        "part_a.hurst": rng.uniform(0.6, 0.95, ROWS),
        "part_a.q0 [1/um]": np.full(ROWS, 0.01),
        "part_a.q1 [1/um]": rng.uniform(0.3, 3.0, ROWS),
        "part_a.h_rms [um]": np.full(ROWS, 1.0),
        "part_a.h_max [um]": np.full(ROWS, 4.0),
        "pressure [MPa]": rng.uniform(1.0, 50.0, ROWS),
    }
    path = folder / "designs.csv"
    columns = np.stack(list(numbers.values()), axis=1)
    header = ",".join(numbers)
    np.savetxt(path, columns, "%.6g", ",", header=header, comments="")
    return path


def rows_of_designs(rng: np.random.Generator) -> None:
    """`mbma batch`, every quantity, on one process and on two."""
    common = {"bodies": {"E_star": "115 GPa", "hardness": "1.5 GPa"}}
    a_million = MILLION / ROWS
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        path = _table_of_designs(folder, rng)
        out = folder / "answers.csv"
        alone = rounds({"one": lambda: designs.batch(path, out, common=common)}, 3)["one"]
        twice = folder / "twice.csv"
        lines = path.read_text().splitlines(keepends=True)
        twice.write_text("".join([*lines, *lines[1:]]))
        once, more = (
            _of_all_processes(
                functools.partial(designs.batch, each, out, common=common, workers=2)
            )
            for each in (path, twice)
        )
    report(
        "a million rows of mbma batch, every quantity, of one core",
        a_million * statistics.median(alone),
        "s",
        at_most=20,
    )
    # the processes start once
    both = once + (a_million - 1) * (more - once)
    report("the same on two processes, half the time of all", both / 2, "s", at_most=10)


def _of_all_processes(run: Callable[[], Any]) -> float:
    """Processor seconds of this process and of those that it started and ended."""
    before = os.times()
    run()
    return sum(after - at for after, at in zip(os.times()[:4], before[:4], strict=True))


def unknown_numbers() -> None:
    """A joint of which five numbers are ranges."""
    face = {
        "Ra": "0.8 um +- 0.1 um",
        "hurst": "0.7..0.9",
        "longest": "0.4..0.8 mm",
        "shortest": "8 um",
    }
    bodies = {"E_star": "58 GPa", "hardness": "0.95..1.3 GPa"}
    joint = Joint(face, bodies=bodies, nominal_area="2..4 cm^2")
    seeds = itertools.count()
    taken = rounds(
        {"one": lambda: joint.uncertainty("10 MPa", draws=2000, seed=next(seeds))}, 5
    )
    report(
        "uncertainty of a joint with five ranges, 2,000 draws",
        statistics.median(taken["one"]),
        "s",
        at_most=1,
    )


def joints(rng: np.random.Generator) -> None:
    """Two parts of metal, surfaces beyond the table, and a million candidates."""
    faces = _parts(rng, JOINTS)
    alike = [face | {n: faces[0][n] for n in BAND_NUMBERS} for face in faces]
    pressures = rng.uniform(1e-3, 0.05, JOINTS)
    fresh = itertools.count(1)

    def tables(shortest: float) -> None:
        for _ in range(DESIGNS):
            _table_of_one(shortest, 1 + 1e-9 * next(fresh))

    def beyond(top: float, bodies: Any, theory: str) -> None:
        # surfaces that nothing is kept of
        heights = 0.01 * (1 + 1e-9 * next(fresh))
        numbers = faces[0]["hurst"], 1.0, rng.uniform(30, 300, JOINTS), heights
        surface = Surface(*numbers, rng.uniform(top, 1.2 * top, JOINTS) * heights)
        contact(surface, bodies, pressure=2e-4, theory=theory)

    def million() -> None:
        def make(some: slice) -> Any:
            size = some.stop - some.start
            surface = Surface(
                rng.uniform(0.6, 0.95, size), 1.0, rng.uniform(30, 300, size), 0.01, 0.04
            )
            return contact(surface, HARD, pressure=2e-4, theory="calibrated").area

        for _ in in_chunks(make, MILLION // 10):
            pass

    asked: dict[str, Callable[[], None]] = {
        "alike": lambda: _every_quantity(alike, pressures, flow=True),
        "batch": lambda: _every_quantity(faces, pressures, flow=True),
        "without flow": lambda: _every_quantity(faces, pressures, flow=False),
        "one": lambda: tables(8.0),
        "two bands": lambda: tables(5.0),
        "inside": lambda: beyond(4.0, 1.0, "calibrated"),
        "beyond": lambda: beyond(8.1, 1.0, "calibrated"),
        "beyond, hard": lambda: beyond(8.1, HARD, "calibrated"),
        "mbma": lambda: beyond(3.0, 1.0, "mbma"),
    }
    taken = rounds(asked, 3)
    click.echo("\nJoints of two parts of metal")
    for name, key, most in (
        ("joints of parts with one band by pressure, every quantity", "alike", 2),
        ("joints of parts with two bands, likewise", "batch", 2),
        ("the same without flow through the gaps", "without flow", 2),
    ):
        report(f"{JOINTS} {name}", statistics.median(taken[key]), "s", at_most=most)
    for name, key, most in (
        ("one joint, from its numbers to its table", "one", 5.0),
        ("one joint whose parts have two bands, likewise", "two bands", None),
    ):
        report(name, 1e-3 * microseconds(taken[key], DESIGNS), "ms", at_most=most)
    for name, key, most in (
        ("a surface beyond the table, by pressure", "beyond", 30.0),
        ("the same with a hardness", "beyond, hard", 60.0),
        ("MBMA by pressure, a surface", "mbma", 25.0),
    ):
        report(name, microseconds(taken[key], JOINTS), "us", at_most=most)
    slower = times_faster(taken, "beyond", "inside")
    report("a surface beyond the table over one inside it", slower, "x")
    # its threads are not those that rounds measure
    start = time.process_time()
    million()
    spent = 10 * (time.process_time() - start)
    report(
        "a million surfaces with a hardness in chunks, of one core",
        spent,
        "s",
        at_most=20,
    )
    rows_of_designs(rng)
    unknown_numbers()


FIRST = {
    "import mbma_tables": "m",
    "an answer": "m.contact(m.Surface(0.8, 1.0, 200.0, 1.0, 3.0), separation=1.0)",
    "100,000 gaps of a law": "m.contact_law(S(), theory='mbma').pressure(np.linspace(0.05, 2.95, 100_000))",
    "10,000 surfaces": "m.contact(S(10_000), separation=1.0)",
    "an exact total": "m.contact(S(), separation=1.0, theory=m.theories.Mbma('exact'))",
}


def fresh_process(rng: np.random.Generator) -> None:
    """The first answer of anything in a new process, import included."""
    begin = (
        "import time; t = time.perf_counter(); import mbma_tables as m, numpy as np; "
        "S = lambda n=1: m.Surface(np.linspace(0.5, 0.9, n) if n > 1 else 0.8, 1.0, 200.0, 1.0, 3.0); "
    )
    click.echo("\nFirst answers in a new process, import included")
    for name, asked in FIRST.items():
        code = f"{begin}{asked}; print(time.perf_counter() - t)"
        taken = [
            float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(5)
        ]
        report(name, statistics.median(taken), "s", at_most=0.5)
    command = [
        sys.executable,
        "-m",
        "mbma_tables",
        "contact",
        "--surface",
        "concrete",
        "-d",
        "0.4",
    ]
    taken = []
    for _ in range(5):
        start = time.perf_counter()
        subprocess.check_output(command)
        taken.append(time.perf_counter() - start)
    report(
        "mbma contact --surface concrete -d 0.4",
        statistics.median(taken),
        "s",
        at_most=0.8,
    )


@click.group(invoke_without_command=True)
@click.option("--write", is_flag=True, help="Put the table into docs/lookup.md.")
@click.pass_context
def main(context: click.Context, write: bool) -> None:
    """Time the library beside its peers."""
    if context.invoked_subcommand is not None:
        return
    rng = np.random.default_rng(SEED)
    load = os.getloadavg()
    click.echo(
        f"{os.cpu_count()} cores, load average {load[0]:.2f} at the start; numpy {np.__version__}"
    )
    for section in (
        kernels,
        few_numbers,
        fresh_process,
        display,
        tables,
        totals,
        laws,
        calibrated,
        attracted,
        maps,
        exported,
        scenes,
    ):
        section(rng)
    click.echo(f"\nload average {os.getloadavg()[0]:.2f} at the end")
    if write:
        _put("times", LINES, load[0])


def _put(block: str, lines: list[Line], load: float) -> None:
    """Write lines into a block of docs/lookup.md, whose other blocks stay as they are."""
    marks = {None: "", True: "met", False: "missed"}
    rows = [
        [x.name.strip(), f"{x.value:.3g} {x.unit}".strip(), x.wanted, marks[x.met]]
        for x in lines
    ]
    measured = page.table("what | measured | wanted | ", rows)
    machine = f"{os.cpu_count()} cores, load average {load:.1f}."
    text = (ROOT / "docs" / "lookup.md").read_text(encoding="utf-8")
    parts = {
        match[2]: match[0].removeprefix(match[1]).removesuffix(match[3]).strip("\n")
        for match in page.MARKED.finditer(text)
    }
    page.write("docs/lookup.md", parts | {block: f"{machine}\n\n{measured}"}, {}, ROOT)


@main.command("joints")
@click.option("--write", is_flag=True, help="Put the table into docs/lookup.md.")
def joints_command(write: bool) -> None:
    """Time joints, batches of them and tables of designs alone."""
    load = os.getloadavg()[0]
    joints(np.random.default_rng(SEED))
    if write:
        _put("joints", LINES, load)


@main.command("adhesion")
def adhesion_command() -> None:
    """Time contacts with an attraction beside elastic ones."""
    attracted(np.random.default_rng(SEED))


main.add_command(functions)
main.add_command(table_uses)
main.add_command(surrogates)
main.add_command(display_command)
main.add_command(exports_command)

if __name__ == "__main__":
    main()
