"""Lookups timed: tables against scipy, totals against the solver, laws against numpy, the first call.

Run with ``python benchmarks/lookup.py``. One core; every ratio is of two processor times taken in turn, the median
over the rounds, so that what else the machine does falls on both. docs/cost.md has error against time of every tier.
"""

from __future__ import annotations

import os

os.environ["NUMBA_NUM_THREADS"] = "1"
os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import dataclasses
import functools
import itertools
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import click
import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.special import erf

from mbma_tables import Surface, contact, contact_law, open_table
from mbma_tables.calibrated import Law, Spectrum, light_factor
from mbma_tables.models import universal_kernel
from mbma_tables.tablefiles.interpolate import fill_4d, fill_gradient_4d, value_4d
from mbma_tables.tablefiles.schema import FUNCTIONS, TableContent
from mbma_tables.theories import Calibrated
from mbma_tables.theories.calibrated_table import fill, shipped

ROUNDS = 9
POINTS = 20_000
HELD_OUT = 500
SURFACES = 2_000
GAPS, MANY_GAPS = 100_000, 1_000_000
NOMINAL_EXACT = 15_000  # islands/s, a rate to compare with that is not measured here
SEED = 7


@dataclasses.dataclass(frozen=True)
class Line:
    """One measured number; `wanted` as a sentence part, empty where nothing is asked."""

    name: str
    value: float
    unit: str
    wanted: str = ""
    met: bool | None = None


LINES: list[Line] = []


def report(name: str, value: float, unit: str, at_least: float | None = None, at_most: float | None = None) -> None:
    """Keep and print a number."""
    wanted, met = "", None
    if at_least is not None:
        wanted, met = f">= {at_least:g}", value >= at_least
    if at_most is not None:
        wanted, met = f"<= {at_most:g}", value <= at_most
    LINES.append(Line(name, float(value), unit, wanted, None if met is None else bool(met)))
    mark = {None: "", True: "met", False: "MISSED"}[met]
    click.echo(f"  {name:<72} {value:10.4g} {unit:<6} {wanted:>9} {mark}".rstrip())


def rounds(runs: dict[str, Callable[[], Any]], count: int = ROUNDS) -> dict[str, list[float]]:
    """Processor seconds of each run in every round; runs take turns, a first round, which compiles, is not counted."""
    taken: dict[str, list[float]] = {name: [] for name in runs}
    for number in range(count + 1):
        for name, run in runs.items():
            start = time.thread_time()
            run()
            spent = time.thread_time() - start
            if number:
                taken[name].append(spent)
    return taken


def times_faster(taken: dict[str, list[float]], slow: str, fast: str) -> float:
    """Median over rounds of the ratio of two times."""
    return statistics.median(a / b for a, b in zip(taken[slow], taken[fast], strict=True))


def microseconds(taken: list[float], count: int) -> float:
    """Median time of one of `count`."""
    return 1e6 * statistics.median(taken) / count


def reference(content: TableContent, functions: Any = 0) -> RegularGridInterpolator:
    """Scipy's cubic interpolator of log_ratio, F or both, on the table's own nodes, in node units."""
    nodes = [np.arange(axis.nodes, dtype=float) for axis in content.axes]
    values = np.stack([content.auxiliary[f"log_ratio_{f}"][1] for f in FUNCTIONS], axis=-1)
    return RegularGridInterpolator(nodes, values[..., functions], method="cubic")


def random_places(content: TableContent, rng: np.random.Generator) -> np.ndarray:
    """Random points in node units, (points, axes)."""
    return rng.uniform(size=(POINTS, len(content.axes))) * [axis.nodes - 1 for axis in content.axes]


def island_tables(rng: np.random.Generator) -> None:
    """Both tables against RegularGridInterpolator."""
    raw, universal = open_table("island4d"), open_table("universal")
    four = raw.content
    scipy_four, scipy_both = reference(four), reference(four, slice(None))
    at_four = random_places(four, rng)
    columns = np.ascontiguousarray(at_four.T)
    X, mu = rng.uniform(-6.25, 41.0, POINTS), 10 ** rng.uniform(-8, 6, POINTS)
    values, slopes = np.empty((2, POINTS)), np.empty((10, POINTS))
    phi, phi_slopes = np.empty((POINTS, 3)), np.empty((POINTS, 7))
    status = np.empty(POINTS, dtype=np.int64)
    taken = rounds(
        {
            "scipy 4-D": lambda: scipy_four(at_four),
            "scipy 4-D, F and A": lambda: scipy_both(at_four),
            "island4d": lambda: fill_4d(four.coefficients, columns, values),
            "island4d slopes": lambda: fill_gradient_4d(four.coefficients, columns, slopes),
            "universal": lambda: universal_kernel.fill_phi(X, mu, universal.kernel, status, phi),
            "universal slopes": lambda: universal_kernel.fill_slopes(X, mu, universal.kernel, status, phi_slopes),
        }
    )
    one = at_four[0]
    numbers = [float(x) for x in one]
    scalar = rounds(
        {
            "scipy": lambda: [scipy_four(one) for _ in range(200)],
            "island4d": lambda: [value_4d(four.coefficients, *numbers) for _ in range(200)],
        }
    )
    click.echo(
        f"\nTables against scipy's RegularGridInterpolator, cubic, {POINTS} random points. Ours answer F and A at"
    )
    click.echo("once. Each ratio: against scipy's F alone; per function, twice that; against scipy's F and A at once")
    for name, spent in taken.items():
        report(f"time of {name}", microseconds(spent, POINTS), "us")

    def against(text: str, name: str, bar: float) -> None:
        strict = times_faster(taken, "scipy 4-D", name)
        report(f"{text}, against F of scipy 4-D", strict, "x", bar)
        report("  per function", 2 * strict, "x", bar)
        report("  against F and A of scipy 4-D", times_faster(taken, "scipy 4-D, F and A", name), "x", bar)

    against("island4d value", "island4d", 8)
    against("island4d value and four derivatives", "island4d slopes", 3)
    report("scalar call of value_4d from Python", times_faster(scalar, "scipy", "island4d"), "x", 20)
    against("universal value with error", "universal", 20)
    against("universal value, two derivatives, error", "universal slopes", 12)
    far_four = np.abs(values[0] - scipy_four(at_four)).max()
    report("largest |log_ratio_F - scipy's|, island4d, both cubic, not-a-knot", far_four, "")


def held_out(count: int, rng: np.random.Generator) -> tuple[Surface, np.ndarray]:
    """Random surfaces, and a gap of each between -h_max and 0.9999 h_max."""
    hurst = rng.uniform(0.3, 1, count)
    zeta_1 = np.exp(rng.uniform(np.log(3.01), np.log(1e4), count))
    h_max = rng.uniform(2.5, 4.7, count)
    return Surface(hurst, 1.0, zeta_1, 1.0, h_max), rng.uniform(-1, 0.9999, count) * h_max


def totals(rng: np.random.Generator) -> None:
    """`contact` on many surfaces, with derivatives, and on many gaps of one surface."""
    surfaces, gaps = held_out(SURFACES, rng)
    taken = rounds(
        {
            "exact": lambda: contact(surfaces, gaps, tier="exact"),
            "value": lambda: contact(surfaces, gaps),
            "slopes": lambda: contact(surfaces, gaps, derivatives=True),
        },
        3,
    )
    exact = contact(surfaces, gaps, tier="exact").islands
    looked_up = contact(surfaces, gaps).islands
    click.echo(f"\ncontact at 1e-8, one gap on each of {SURFACES} surfaces")
    report("time a total", microseconds(taken["value"], SURFACES), "us", at_most=7)
    rate = exact / statistics.median(taken["exact"])
    report("islands solved by exact, a second", rate, "1/s")
    report("islands looked up, a second", looked_up / statistics.median(taken["value"]), "1/s")
    report("faster than our own exact tier", times_faster(taken, "exact", "value"), "x", 150)
    nominal = exact / NOMINAL_EXACT / statistics.median(taken["value"])
    report(f"faster than a solver of {NOMINAL_EXACT} islands/s at exact's island count", nominal, "x")
    report("derivatives=True against the value alone", times_faster(taken, "slopes", "value"), "x", at_most=2)
    one, fresh = Surface.named("asphalt"), itertools.count(1)
    some, many = (rng.uniform(-one.h_max, 0.9999 * one.h_max, count) for count in (1000, GAPS))

    def another() -> Surface:
        # one that nothing is kept of
        return Surface(one.hurst, one.q0, one.q1, one.h_rms, one.h_max * (1 + 1e-9 * next(fresh)))

    taken = rounds({"some": lambda: contact(another(), some), "many": lambda: contact(another(), many)})
    report("1000 random gaps on one new surface, a gap", microseconds(taken["some"], 1000), "us", at_most=0.4)
    report(f"{GAPS} of them", microseconds(taken["many"], GAPS), "us", at_most=0.4)
    batch, gaps = held_out(10 * SURFACES, rng)
    walls: dict[int, list[float]] = {1: [], 2: []}
    for workers in (1, 2) * 4:
        start = time.perf_counter()
        contact(batch, gaps, workers=workers)
        walls[workers].append(time.perf_counter() - start)
    report("two workers against one, by the clock", min(walls[1]) / min(walls[2]), "x", 1.8)


def laws(rng: np.random.Generator) -> None:
    """A frozen surface against numpy and scipy."""
    surface = Surface.named("asphalt")
    start = time.perf_counter()
    law = contact_law(surface)
    spent = time.perf_counter() - start
    gaps = rng.uniform(-surface.h_max, 0.9999 * surface.h_max, MANY_GAPS)
    nodes = np.linspace(-surface.h_max, surface.h_max, 1000)
    values = law.force(nodes)
    linear = RegularGridInterpolator((nodes,), values)
    one, point, forces, fresh = float(gaps[0]), gaps[:1], law.force(gaps), itertools.count(1)
    taken = rounds(
        {
            "law": lambda: law.force(gaps),
            "slope": lambda: law.force_and_stiffness(gaps),
            "energy": lambda: law.energy(gaps),
            "inverse": lambda: law.at_pressure(forces),
            # a surface that nothing is kept of
            "making": lambda: contact_law(dataclasses.replace(surface, h_max=surface.h_max * (1 + 1e-9 * next(fresh)))),
            "numpy": lambda: np.interp(gaps, nodes, values),
            "scalar law": lambda: [law.force(one) for _ in range(1000)],
            "scalar scipy": lambda: [linear(point) for _ in range(1000)],
        }
    )
    some = gaps[:2000]
    truth = contact(surface, some, rtol=1e-10).force
    click.echo("\ncontact_law of one surface, asphalt")
    report("making the first law", spent, "s")
    report("making a law", 1e3 * statistics.median(taken["making"]), "ms", at_most=2)
    report("law.force, a random gap", 1e3 * microseconds(taken["law"], MANY_GAPS), "ns")
    for what, key, most in (
        ("force", "law", 0.1),
        ("force and stiffness", "slope", 0.12),
        ("energy", "energy", 0.12),
        ("gap, area and stiffness at a force", "inverse", 0.3),
    ):
        name = f"{what} against numpy.interp on 1000 nodes, same points"
        report(name, times_faster(taken, key, "numpy"), "x", at_most=most)
    report("scalar call", microseconds(taken["scalar law"], 1000), "us", at_most=0.3)
    report("scalar call against RegularGridInterpolator's", times_faster(taken, "scalar scipy", "scalar law"), "x", 25)
    report("largest error of the law", np.abs(law.force(some) / truth - 1).max(), "")
    report("largest error of numpy.interp", np.abs(np.interp(some, nodes, values) / truth - 1).max(), "")


def calibrated(rng: np.random.Generator) -> None:
    """The calibrated law through its table, against numpy, and against its own quadrature."""
    click.echo("\nThe calibrated law")
    surface = Surface(0.8, 1.0, 64.0, 1.0, 3.3)
    u = rng.uniform(0.01, 3.3, GAPS)
    some = u[:HELD_OUT]
    theory, law = Calibrated(), Law(Spectrum.self_affine(0.8, 64.0), 3.3)
    taken = rounds(
        {
            "table": lambda: theory.answer(surface, u),
            "erf": lambda: erf(u),
            "law": lambda: law.force_and_stiffness(some),
        }
    )
    spent = microseconds(taken["table"], GAPS)
    report("force, area and stiffness of a random separation", 1e3 * spent, "ns", at_most=100)
    report("the same in evaluations of scipy.special.erf", spent / microseconds(taken["erf"], GAPS), "")
    surfaces, gaps = held_out(SURFACES, rng)
    light = np.asarray(light_factor(surfaces.alpha))
    rows = np.stack([surfaces.hurst, np.log(surfaces.zeta_1), light, surfaces.h_max], axis=1)
    at, out = np.arange(SURFACES), np.empty((3, SURFACES))
    table = shipped()
    alone = rounds({"fill": lambda: fill(table.coefficients, table.numbers, rows, at, (gaps + rows[:, 3]) / 2, out)})
    report(
        "the same with a new surface each, table alone", 1e3 * microseconds(alone["fill"], SURFACES), "ns", at_most=100
    )
    asked_of = {"one surface": (surface, u), "one gap a surface": (surfaces, (gaps + surfaces.h_max) / 2)}
    for what, (batch, mean) in asked_of.items():
        asked = functools.partial(contact, batch, mean_separation=mean, theory="calibrated")
        both = rounds({"contact": asked, "leakage": lambda asked=asked: asked().leakage})
        report(f"contact with leakage, {what}", times_faster(both, "leakage", "contact"), "x", at_most=1.5)
    report("faster than the law's quadrature", microseconds(taken["law"], HELD_OUT) / spent, "x")


def fresh_process() -> None:
    """Import, first lookup with compiled code at hand, and the very first one."""
    lookup = (
        "import time; t = time.perf_counter(); import mbma_tables as m; a = time.perf_counter(); "
        "m.contact(m.Surface(0.8, 1.0, 200.0, 1.0, 3.0), 1.0); b = time.perf_counter(); print(a - t, b - a)"
    )

    def run(**environment: str) -> list[float]:
        said = subprocess.check_output([sys.executable, "-c", lookup], env={**os.environ, **environment})
        return [float(word) for word in said.split()]

    run()
    warm = np.median([run() for _ in range(5)], axis=0)
    with tempfile.TemporaryDirectory() as folder:
        cold = run(NUMBA_CACHE_DIR=folder)
    click.echo("\nA fresh process")
    report("import mbma_tables", warm[0], "s", at_most=0.5)
    report("first lookup after the import", warm[1], "s", at_most=0.8)
    report("very first lookup, nothing compiled yet", cold[1], "s", at_most=1.5)


@click.command()
@click.option("--json", "json_path", type=click.Path(path_type=pathlib.Path, dir_okay=False), help="Write the table.")
def main(json_path: pathlib.Path | None) -> None:
    """Time the lookups."""
    rng = np.random.default_rng(SEED)
    load = os.getloadavg()
    click.echo(f"{os.cpu_count()} cores, load average {load[0]:.2f} at the start; numpy {np.__version__}")
    island_tables(rng)
    totals(rng)
    laws(rng)
    calibrated(rng)
    fresh_process()
    end = os.getloadavg()
    click.echo(f"\nload average {end[0]:.2f} at the end")
    if json_path is not None:
        rows = [dataclasses.asdict(line) for line in LINES]
        json_path.write_text(json.dumps({"load": [load[0], end[0]], "lines": rows}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
