"""``python -m generate cost``: time, error and evaluations of every way to answer an island, a gap or a surface."""

import dataclasses
import functools
import itertools
import json
import math
import platform
import subprocess
import sys
from collections.abc import Iterator, Sequence
from importlib import metadata
from typing import Any

import click
import numpy as np
import pandas as pd
from scipy.special import ellipkm1
from scipy.stats import qmc

from generate import cost_distances
from generate.files import ROOT, to_csv
from generate.tables.certificate import phi
from generate.timing import measure
from mbma_tables import Scene, Surface, contact, contact_law, theories
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.common.files import write_file
from mbma_tables.core import core
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.geometry import geometry
from mbma_tables.models import ISLAND_MODELS, answer_islands
from mbma_tables.models.closed_forms import FormulaModel
from mbma_tables.models.tables import get_model
from mbma_tables.scenes.plan import UNIT, Row
from mbma_tables.surfaces.variants import get_variant

# islands, random ones: H, log10 zeta_1, log10 delta/h_rms
ISLANDS, SEED, RANGES = 1000, 2026, ((0.32, 0.7, -4.0), (0.98, 3.9, 0.9))
HARD, PROFILES = 12, 20  # of them, for the classical iteration and for p(r)
MESHES = (  # rings and tolerance
    *((25, 1e-2), (25, 1e-4), (50, 1e-3), (100, 1e-2), (100, 1e-4), (100, 1e-6)),
    *((200, 1e-5), (400, 1e-6), (800, 1e-7), (1600, 1e-8)),
)
NEWTON_RTOLS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
NEWTON_NODES = (8, 12, 16, 24, 32, 48, 64, 96)
FORMS = ("pocket", "standard", "long")
# surfaces that no table, formula or fit was made from: H, zeta_1, q0 h_rms, h_max/h_rms
SURFACES = tuple(
    Surface(hurst, 1.0, zeta_1, rough, top * rough)
    for hurst, zeta_1, rough, top in (
        *((0.35, 40.0, 0.05, 3.1), (0.52, 1300.0, 0.02, 3.4), (0.63, 14.0, 0.30, 2.7)),
        *((0.74, 330.0, 0.10, 3.0), (0.86, 6100.0, 0.18, 3.6), (0.97, 90.0, 0.08, 3.8)),
    )
)
MOVES = itertools.count()  # of surfaces that are fresh
GAPS, EVERY = 50, 5  # of each surface, and which of them are compared with the reference
REFERENCE_RTOL, REFERENCE_ISLANDS = 1e-11, 1e-12
RTOLS = tuple(10.0**-k for k in range(1, 9))
LAW_RTOLS, SLOW_LAW_RTOLS, THEORY_LAW_RTOLS = RTOLS[1:], (1e-2, 1e-4), (1e-3, 1e-5, 1e-7)
MANY = 20_000  # gaps, about as many as a law begins to pay for
FIRST_USE = (
    "import mbma_tables, numpy, time; s = mbma_tables.Surface(0.74, 1.0, 330.0, 0.1, 0.3); t = time.process_time(); "
    "mbma_tables.contact(s, separation=0.1, island_model={!r}, rtol=1e-2); print(time.process_time() - t)"
)
HEAD = """\
# What accuracy costs, measured by python -m generate cost; docs/cost.md says how. Costs are times over that of a
# fixed piece of work in the same run; the row of island model unit has its seconds.
"""


def at(what: str, rtol: float) -> str:
    """The name of a variant at a tolerance, as `Row` reads it."""
    return f"{what} rtol={rtol:.0e}"


@functools.cache
def held_out(count: int = ISLANDS) -> tuple[dict[str, FloatArray], FloatArray]:
    """Islands of random surfaces that made no table, and their Phi_F and Phi_A (2, islands) on twice the nodes."""
    hurst, log_zeta, log_approach = qmc.scale(qmc.Halton(3, seed=SEED).random(count), *RANGES).T
    fields = geometry(10**log_approach, hurst, 10**log_zeta, get_variant("reported"))
    return fields | {"hurst": hurst}, phi(fields["X"], fields["mu"], REFERENCE_ISLANDS, 2).T


def island_error(phi_F: FloatArray, phi_A: FloatArray, truth: FloatArray) -> float:
    return float(np.abs(np.stack([phi_F, phi_A]) / truth - 1).max())


def island_rows() -> Iterator[Row]:
    """Models that do not solve, Newton by tolerance and by nodes and with p(r) kept, and the classical iteration."""
    islands, truth = held_out()
    named = [name for name in ISLAND_MODELS if name != "exact"]
    models: list[Any] = [(name, "island", get_model(name, 1e-8, get_variant("reported"))) for name in named]
    models += [("formula", f"island form={name}", FormulaModel(name)) for name in FORMS]
    for island_model, name, model in models:
        run: Any = functools.partial(answer_islands, model, islands)
        answer, (cost, _) = run(), measure(run)
        yield Row(island_model, name, "both", island_error(answer.phi_F, answer.phi_A, truth), cost / ISLANDS, 2)

    X, mu = islands["X"][::4], islands["mu"][::4]
    least = greenwood_tripp.MIN_SOLVER_RTOL
    ways: dict[str, dict[str, Any]] = {at("island", rtol): {"rtol": max(0.1 * rtol, least)} for rtol in NEWTON_RTOLS}
    ways |= {f"nodes={nodes}": {"rtol": 1e-11, "nodes": nodes} for nodes in NEWTON_NODES}
    for name, options in ways.items():
        run = functools.partial(greenwood_tripp.solve, X, mu, **options)
        solved, (cost, _) = run(), measure(run)
        error = island_error(solved.phi_F, solved.phi_A, truth[:, ::4])
        yield Row("exact", name, "both", error, cost / X.size, float((solved.nodes * (solved.iterations + 1)).mean()))
    for rtol in (1e-4, 1e-8):
        cost, _ = measure(lambda rtol=rtol: greenwood_tripp.solve(X[:PROFILES], mu[:PROFILES], rtol=rtol).pressure)  # type: ignore[misc]
        yield Row("exact", at("profile", rtol), "both", None, cost / PROFILES)

    chosen = np.linspace(0, ISLANDS - 1, HARD).astype(int)
    places = list(zip(islands["X"][chosen], islands["mu"][chosen], strict=True))
    for rings, tolerance in MESHES:
        # the matrix is made beforehand, and not timed
        matrix = ring_matrix(rings)

        def run(matrix: FloatArray = matrix, tolerance: float = tolerance) -> FloatArray:
            return np.array([iterated(X, mu, matrix, tolerance) for X, mu in places]).T

        steps, converged, force, area = run()
        if not converged.all():
            raise ConvergenceError(f"the classical iteration on {rings} rings did not converge", converged == 0)
        error, pressures = island_error(force, area, truth[:, chosen]), rings * (float(steps.mean()) + 1)
        yield Row("classical", at(f"rings={rings}", tolerance), "both", error, measure(run)[0] / HARD, pressures)


def gaps_of(surface: Surface, count: int = GAPS) -> FloatArray:
    """Gaps evenly over [-h_max/2, h_max), the upper end left out."""
    return np.linspace(-0.5, 1.0, count, endpoint=False) * float(surface.h_max)


def fresh(surface: Surface) -> Surface:
    """The same surface up to rounding, of which nothing is cached."""
    return dataclasses.replace(surface, q1=surface.q1 * (1 + next(MOVES) % 4096 * 2.0**-51))


def gap_batch(count: int, every: int = 1, **options: Any) -> list[Any]:
    """Totals at `count` gaps of each surface, or at some of them, one call a surface."""
    return [contact(fresh(one), separation=gaps_of(one, count)[::every], **options) for one in SURFACES]


@functools.cache
def reference() -> tuple[dict[str, FloatArray], ...]:
    found = gap_batch(GAPS, EVERY, island_model="exact", rtol=REFERENCE_RTOL)
    return tuple({"pressure": np.asarray(one.pressure), "area": np.asarray(one.area)} for one in found)


def largest_error(answers: Sequence[dict[str, FloatArray]]) -> float:
    """Largest error of answers to some quantities, surface by surface, at the reference's gaps."""
    pairs = zip(answers, reference(), strict=True)
    return max(float(np.abs(own[name] / truth[name] - 1).max()) for own, truth in pairs for name in own)


def scene_rows() -> Iterator[Row]:
    """What a scene takes besides its steps: planning and making the result."""
    surface = SURFACES[0]
    gap = 0.9 * float(surface.h_max)
    whole = measure(lambda: Scene(fresh(surface), effects=["pressure"], separations=gap, rtol=1e-4).run())[0]
    step = measure(lambda: contact(fresh(surface), separation=gap, rtol=1e-4))[0]
    yield Row("scene", "call", "both", None, max(whole - step, 0.0))


def gap_rows() -> Iterator[Row]:
    """Totals of each island model at several tolerances: the call, and each further gap."""
    for island_model in ISLAND_MODELS:
        ask = functools.partial(gap_batch, island_model=island_model)
        one, many = (measure(functools.partial(ask, count, rtol=1e-2))[0] / len(SURFACES) for count in (1, MANY))
        each = (many - one) / (MANY - 1)
        yield Row(island_model, "call", "both", None, one - each)
        for rtol in (*RTOLS, 1e-9, 1e-10) if island_model == "exact" else RTOLS:
            run = functools.partial(ask, GAPS, rtol=rtol)
            islands = sum(answer.islands for answer in run()) / (len(SURFACES) * GAPS)
            cost = max((measure(run)[0] / len(SURFACES) - one + each) / GAPS, each)
            found = [{"pressure": answer.pressure, "area": answer.area} for answer in run(every=EVERY)]
            yield Row(island_model, at("gap", rtol), "both", largest_error(found), cost, islands)


def law_rows() -> Iterator[Row]:

    def make(island_model: str, rtol: float, surfaces: Sequence[Surface] = SURFACES) -> list[Any]:
        return [contact_law(fresh(surface), "mbma", rtol=rtol, island_model=island_model) for surface in surfaces]

    for island_model in ISLAND_MODELS:
        timed = SURFACES[:2] if island_model == "exact" else SURFACES
        for rtol in LAW_RTOLS if island_model == "universal" else SLOW_LAW_RTOLS:
            pairs = zip(make(island_model, rtol), (gaps_of(surface)[::EVERY] for surface in SURFACES), strict=True)
            answers = [{"pressure": law.pressure(separation=d), "area": law.area(separation=d)} for law, d in pairs]
            cost, _ = measure(functools.partial(make, island_model, rtol, timed))
            yield Row(island_model, at("law", rtol), "both", largest_error(answers), cost / len(timed))
    law, gaps = contact_law(SURFACES[3], "mbma"), gaps_of(SURFACES[3], 10_000)
    loads = law.pressure(separation=gaps)
    for name, quantity, run in (
        ("lookup", "pressure", lambda: law.pressure(separation=gaps)),
        ("lookup", "area", lambda: law.area(separation=gaps)),
        ("lookup", "both", lambda: (law.pressure(separation=gaps), law.area(separation=gaps))),
        ("invert", "pressure", lambda: law.separation(pressure=loads)),
    ):
        yield Row("law", name, quantity, None, measure(run)[0] / gaps.size)


def theory_rows() -> Iterator[Row]:
    """Theories other than MBMA: a call, each further gap by separation or by pressure, energies, and laws."""
    for name in theories.THEORIES[1:]:
        u = np.linspace(0.1, 0.9, MANY) * float(SURFACES[3].h_max)

        def ask(name: str = name, **known: Any) -> Any:
            return contact(fresh(SURFACES[3]), theory=name, **known)

        given = ask(mean_separation=u).pressure
        one, gap, inverse = (
            measure(functools.partial(ask, **options))[0]
            for options in ({"mean_separation": u[:1]}, {"mean_separation": u}, {"pressure": given})
        )
        fixed = max((u.size * one - gap) / (u.size - 1), 1e-3 * one)
        energy = measure(lambda ask=ask, u=u: ask(mean_separation=u).energy)[0]  # type: ignore[misc]
        yield Row(name, "call", "both", None, fixed)
        for what, cost in {"gap": gap - fixed, "invert": inverse - fixed, "energy": energy - gap}.items():
            yield Row(name, what, "both", None, max(cost, 1e-9) / u.size)
        for rtol in THEORY_LAW_RTOLS:
            cost, _ = measure(lambda rtol=rtol, name=name: contact_law(fresh(SURFACES[3]), name, rtol=rtol))  # type: ignore[misc]
            yield Row(name, at("law", rtol), "both", None, cost)


def first_use_rows() -> Iterator[Row]:
    seconds = measure(lambda: None)[1]
    for island_model in ISLAND_MODELS:
        command = [sys.executable, "-c", FIRST_USE.format(island_model)]
        taken = [float(subprocess.run(command, check=True, capture_output=True).stdout) for _ in range(4)]
        # the first fills the caches of the system
        yield Row(island_model, "import", "both", None, min(taken[1:]) / seconds)


def study() -> bytes:
    seconds, rows = [measure(lambda: None)[1]], list[Row]()
    for part in (island_rows, scene_rows, gap_rows, law_rows, theory_rows, first_use_rows):
        rows += part()
        seconds.append(measure(lambda: None)[1])
    facts = {"machine": platform.machine()} | {name: metadata.version(name) for name in ("numpy", "scipy")}
    head = f"{HEAD}# {json.dumps(facts | {'python': platform.python_version()})}\n"
    # the least: other processes can only add
    return to_csv(head, pd.DataFrame([Row(UNIT, "seconds", "both", None, min(seconds)), *rows]), "%.4g")


@click.command()
def cost() -> None:
    """Measure tables/cost.csv and tables/distance.csv, for `mbma cost`, plans of scenes and docs/cost.md."""
    for name, content in {"cost": study, "distance": cost_distances.study}.items():
        write_file(ROOT / "tables" / f"{name}.csv", content(), make_folders=True)
        click.echo(f"tables/{name}.csv")


DAMPING, MAX_STEPS, MAX_DEFORMATION = 0.1, 5000, 1e12  # a larger deformation is divergence


def ring_matrix(rings: int) -> FloatArray:
    """w at the rings' middles per unit radius a, from pressures on `rings` rings of equal width (Eq. 37)."""
    r = (np.arange(rings) + 0.5) / rings
    t, rho = r[None, :], r[:, None]
    complement = ((t - rho) / (t + rho)) ** 2
    np.fill_diagonal(complement, 1.0)
    matrix: FloatArray = 4 / np.pi * t / (t + rho) * ellipkm1(complement) / rings
    # the midpoint rule across ln|t - rho| is of second order with ln(h/2 pi) in the ring itself
    np.fill_diagonal(matrix, 2 / np.pi * np.log(16 * np.pi * r * rings) / rings)
    return matrix


@np.errstate(all="ignore")
def iterated(X: float, mu: float, matrix: FloatArray, tolerance: float) -> tuple[int, bool, float, float]:
    """Iterations from w = 0, whether they converged, Phi_F and Phi_A, NaN where they diverged."""
    squared, w = np.empty(1), np.zeros(len(matrix))
    core.island_extents(np.array([X]), np.array([mu]), 0.03 * tolerance, squared)
    a, loads = math.sqrt(squared[0]), np.empty(w.size)
    rho, steps, converged = a * (np.arange(w.size) + 0.5) / w.size, 0, False
    while not converged and steps < MAX_STEPS:
        core.height_integrals(3, rho**2 - X + w, loads)
        change = DAMPING * (a * (matrix @ (mu / 2 * loads)) - w)
        w += change
        steps, scale = steps + 1, np.abs(w).max()
        if not scale < MAX_DEFORMATION:
            return steps, False, math.nan, math.nan
        converged = bool(np.abs(change).max() <= tolerance * DAMPING * scale)
    sums = []
    for twice_n, strength in ((3, mu / 2), (2, 1.0)):
        core.height_integrals(twice_n, rho**2 - X + w, loads)
        sums.append(float(2 * np.pi * a / w.size * strength * (rho @ loads)))
    return steps, converged, sums[0], sums[1]
