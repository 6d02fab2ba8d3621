"""``python -m generate cost``: time, error and evaluations of every way to answer.

Ways to answer an island, a gap or a surface.
"""

import dataclasses
import functools
import itertools
import json
import math
import platform
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from importlib import metadata
from typing import Any, NamedTuple

import click
import numpy as np
import pandas as pd
from scipy.special import ellipkm1
from scipy.stats import qmc

from generate import cost_distances
from generate.files import ROOT, read_csv, to_csv
from generate.timing import measure
from mbma_tables import Bodies, Scene, Surface, contact, contact_law, theories
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError
from mbma_tables.common.files import write_file
from mbma_tables.core import core
from mbma_tables.design.scenes.plan import UNIT
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.geometry import geometry
from mbma_tables.islands.island_models import ISLAND_MODELS, answer_islands
from mbma_tables.islands.variants import get_variant
from mbma_tables.tables.certificate import phi
from mbma_tables.theories import Mbma
from mbma_tables.theories.mbma.closed_forms import FormulaModel
from mbma_tables.theories.mbma.models import get_model


class Row(NamedTuple):
    """One measurement: method, task, largest relative error, time and evaluations."""

    island_model: str
    variant: str  # "gap rtol=1e-06", "island", "open"
    quantity: str  # "both", or "pressure" that a law is inverted for
    error: float | None
    # time over that of the fixed work; seconds in the row of island model `UNIT`
    cost: float
    # islands for a gap, pressures for an exact island, height integrals for a table
    evaluations: float | None = None


# random islands: lowest and highest H, log10 zeta_1, log10 delta/h_rms
ISLANDS = 1000
SEED = 2026
RANGES = ((0.32, 0.7, -4.0), (0.98, 3.9, 0.9))
# of these islands, for the classical iteration and for p(r)
HARD = 12
PROFILES = 20
# rings and tolerance
MESHES = (
    (25, 1e-2),
    (25, 1e-4),
    (50, 1e-3),
    (100, 1e-2),
    (100, 1e-4),
    (100, 1e-6),
    (200, 1e-5),
    (400, 1e-6),
    (800, 1e-7),
    (1600, 1e-8),
)
NEWTON_RTOLS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
NEWTON_NODES = (8, 12, 16, 24, 32, 48, 64, 96)
FORMS = ("pocket", "standard", "long")
# surfaces that no table, formula or fit was made from: H, zeta_1, q0 h_rms, h_max/h_rms
SURFACES = tuple(
    Surface(hurst, 1.0, zeta_1, rough, top * rough)
    for hurst, zeta_1, rough, top in (
        (0.35, 40.0, 0.05, 3.1),
        (0.52, 1300.0, 0.02, 3.4),
        (0.63, 14.0, 0.30, 2.7),
        (0.74, 330.0, 0.10, 3.0),
        (0.86, 6100.0, 0.18, 3.6),
        (0.97, 90.0, 0.08, 3.8),
    )
)
MOVES = itertools.count()  # of surfaces that are fresh
GAPS = 50  # of each surface,
EVERY = 5  # and which of them are compared with the reference
REFERENCE_RTOL = 1e-11
REFERENCE_ISLANDS = 1e-12
RTOLS = tuple(10.0**-k for k in range(1, 9))
LAW_RTOLS = RTOLS[1:]
SLOW_LAW_RTOLS = (1e-2, 1e-4)
THEORY_LAW_RTOLS = (1e-3, 1e-5, 1e-7)
MANY = 20_000  # gaps, about as many as a law begins to pay for
# scenes that have one quantity, or a hardness, more than pressures and areas; a mean pressure keeps the plan
# of theories that have its slopes at once from a law
EFFECTS = {
    "base": ["area", "mean_pressure"],
    "inverse": ["area", "mean_pressure"],
    "slopes": ["area", "stiffness"],
    "energy": ["area", "energy"],
    "leakage": ["area", "leakage"],
    "yield": ["area"],
    "yield inverse": ["area"],
}
# gaps of those that take longer
COUNTS = {"energy": 1000, "leakage": 1000}
FIRST_USE = (
    "import mbma_tables, numpy, time; s = mbma_tables.Surface(0.74, 1.0, 330.0, 0.1, 0.3); "
    "t = time.process_time(); "
    "mbma_tables.contact(s, separation=0.1, theory=mbma_tables.theories.Mbma({!r}, rtol=1e-2)); "
    "print(time.process_time() - t)"
)
HEAD = """\
# What accuracy costs, measured by python -m generate cost; docs/lookup.md says how. Costs are times over that of a
# fixed piece of work in the same run; the row of island model unit has its seconds.
"""


def at(what: str, rtol: float) -> str:
    """The name of a variant at a tolerance, as `Row` reads it."""
    return f"{what} rtol={rtol:.0e}"


@functools.cache
def held_out(count: int = ISLANDS) -> tuple[dict[str, FloatArray], FloatArray]:
    """Islands of random surfaces that made no table, and their Phi_F and Phi_A (2, islands).

    These are solved on twice the nodes.
    """
    lows, highs = RANGES
    places = qmc.scale(qmc.Halton(3, seed=SEED).random(count), lows, highs)
    hurst, log_zeta, log_approach = places.T
    fields = geometry(10**log_approach, hurst, 10**log_zeta, get_variant("reported"))
    truth = phi(fields["X"], fields["mu"], REFERENCE_ISLANDS, 2).T
    return fields | {"hurst": hurst}, truth


def island_error(phi_F: FloatArray, phi_A: FloatArray, truth: FloatArray) -> float:
    return float(np.abs(np.stack([phi_F, phi_A]) / truth - 1).max())


def model_rows(models: Sequence[str] | None = None) -> Iterator[Row]:
    """Models of islands that do not solve."""
    islands, truth = held_out()
    reported = get_variant("reported")
    unsolved = [name for name in models or ISLAND_MODELS if name != "exact"]
    named: list[tuple[str, str, Any]] = []
    named += [(name, "island", get_model(name, 1e-8, reported)) for name in unsolved]
    if models is None or "formula" in models:
        named += [
            ("formula", f"island form={name}", FormulaModel(name)) for name in FORMS
        ]
    for island_model, name, model in named:
        run = functools.partial(answer_islands, model, islands)
        answer = run()
        cost, _ = measure(run)
        error = island_error(answer.phi_F, answer.phi_A, truth)
        yield Row(island_model, name, "both", error, cost / ISLANDS, 2)


def newton_rows() -> Iterator[Row]:
    """Newton's method by tolerance and by nodes, and with p(r)."""
    islands, truth = held_out()
    X = islands["X"][::4]
    mu = islands["mu"][::4]
    ways: dict[str, dict[str, Any]] = {}
    for rtol in NEWTON_RTOLS:
        ways[at("island", rtol)] = {
            "rtol": max(0.1 * rtol, greenwood_tripp.MIN_SOLVER_RTOL)
        }
    for nodes in NEWTON_NODES:
        ways[f"nodes={nodes}"] = {"rtol": 1e-11, "nodes": nodes}
    for name, options in ways.items():
        run = functools.partial(greenwood_tripp.solve, X, mu, **options)
        solved = run()
        cost, _ = measure(run)
        error = island_error(solved.phi_F, solved.phi_A, truth[:, ::4])
        # pressures that are evaluated: at each node, in each iteration and at its end
        evaluations = float((solved.nodes * (solved.iterations + 1)).mean())
        yield Row("exact", name, "both", error, cost / X.size, evaluations)

    def profiles(rtol: float) -> Any:
        return greenwood_tripp.solve(X[:PROFILES], mu[:PROFILES], rtol=rtol).pressure

    for rtol in (1e-4, 1e-8):
        cost, _ = measure(functools.partial(profiles, rtol))
        yield Row("exact", at("profile", rtol), "both", None, cost / PROFILES)


def classical_rows() -> Iterator[Row]:
    """The classical iteration by rings and tolerance."""
    islands, truth = held_out()
    chosen = np.linspace(0, ISLANDS - 1, HARD).astype(int)
    places = list(zip(islands["X"][chosen], islands["mu"][chosen], strict=True))

    def iterated_islands(matrix: FloatArray, tolerance: float) -> FloatArray:
        return np.array([iterated(X, mu, matrix, tolerance) for X, mu in places]).T

    for rings, tolerance in MESHES:
        # the matrix is made beforehand, and not timed
        run = functools.partial(iterated_islands, ring_matrix(rings), tolerance)
        steps, converged, force, area = run()
        if not converged.all():
            message = f"the classical iteration on {rings} rings did not converge"
            raise ConvergenceError(message, converged == 0)
        error = island_error(force, area, truth[:, chosen])
        pressures = rings * (float(steps.mean()) + 1)
        cost, _ = measure(run)
        name = at(f"rings={rings}", tolerance)
        yield Row("classical", name, "both", error, cost / HARD, pressures)


def island_rows() -> Iterator[Row]:
    """All ways to answer an island."""
    yield from model_rows()
    yield from newton_rows()
    yield from classical_rows()


def gaps_of(surface: Surface, count: int = GAPS) -> FloatArray:
    """Gaps evenly over [-h_max/2, h_max), the upper end left out."""
    return np.linspace(-0.5, 1.0, count, endpoint=False) * float(surface.h_max)


def fresh(surface: Surface) -> Surface:
    """The same surface up to rounding, of which nothing is cached."""
    return dataclasses.replace(
        surface, q1=surface.q1 * (1 + next(MOVES) % 4096 * 2.0**-51)
    )


def gap_batch(count: int, every: int = 1, *, island_model: str, rtol: float) -> list[Any]:
    """Totals at `count` gaps of each surface, or at some of them, one call a surface."""
    answers = []
    for surface in SURFACES:
        gaps = gaps_of(surface, count)[::every]
        theory = Mbma(island_model, rtol=rtol)
        answers.append(contact(fresh(surface), separation=gaps, theory=theory))
    return answers


@functools.cache
def reference() -> tuple[dict[str, FloatArray], ...]:
    exact = gap_batch(GAPS, EVERY, island_model="exact", rtol=REFERENCE_RTOL)
    return tuple(totals_of(answer) for answer in exact)


def totals_of(answer: Any) -> dict[str, FloatArray]:
    return {"pressure": np.asarray(answer.pressure), "area": np.asarray(answer.area)}


def largest_error(answers: Sequence[dict[str, FloatArray]]) -> float:
    """Largest error of answers to some quantities, surface by surface, at the reference's gaps."""
    errors = []
    for answer, truth in zip(answers, reference(), strict=True):
        for name, values in answer.items():
            errors.append(float(np.abs(values / truth[name] - 1).max()))
    return max(errors)


def scene_rows() -> Iterator[Row]:
    """What a scene takes besides its steps: planning and making the result."""
    surface = SURFACES[0]
    gap = 0.9 * float(surface.h_max)

    def run_scene() -> Any:
        return Scene(
            fresh(surface), quantities=["pressure"], separation=gap, rtol=1e-4
        ).run()

    def its_step() -> Any:
        return contact(fresh(surface), separation=gap, theory=Mbma(rtol=1e-4))

    whole, _ = measure(run_scene)
    step, _ = measure(its_step)
    yield Row("scene", "call", "both", None, max(whole - step, 0.0))


def gap_rows(models: Sequence[str] | None = None) -> Iterator[Row]:
    """Totals of each island model at several tolerances: the call, and each further gap."""
    for island_model in models or ISLAND_MODELS:
        batch = functools.partial(gap_batch, island_model=island_model)
        # costs of a surface with one gap, and with many
        one = measure(functools.partial(batch, 1, rtol=1e-2))[0] / len(SURFACES)
        many = measure(functools.partial(batch, MANY, rtol=1e-2))[0] / len(SURFACES)
        each = (many - one) / (MANY - 1)
        yield Row(island_model, "call", "both", None, one - each)
        rtols = (*RTOLS, 1e-9, 1e-10) if island_model == "exact" else RTOLS
        for rtol in rtols:
            run = functools.partial(batch, GAPS, rtol=rtol)
            islands = sum(answer.islands for answer in run()) / (len(SURFACES) * GAPS)
            of_surface = measure(run)[0] / len(SURFACES)
            # less the call; noise makes no gap cheaper than one of many
            cost = max((of_surface - one + each) / GAPS, each)
            answers = [totals_of(answer) for answer in run(every=EVERY)]
            yield Row(
                island_model,
                at("gap", rtol),
                "both",
                largest_error(answers),
                cost,
                islands,
            )


def laws_of(
    island_model: str,
    rtol: float,
    surfaces: Sequence[Surface] = SURFACES,
) -> list[Any]:
    """A law of each surface, of which nothing is cached."""
    theory = Mbma(island_model)
    return [contact_law(fresh(surface), theory=theory, rtol=rtol) for surface in surfaces]


def answers_of_laws(laws: Sequence[Any]) -> list[dict[str, FloatArray]]:
    """Pressures and areas by a law of each surface at the reference's gaps."""
    answers = []
    for law, surface in zip(laws, SURFACES, strict=True):
        gaps = gaps_of(surface)[::EVERY]
        pressure = law.pressure(separation=gaps)
        answers.append({"pressure": pressure, "area": law.area(separation=gaps)})
    return answers


def law_rows() -> Iterator[Row]:
    """Making a law by island model and tolerance, and what a law answers."""
    yield from law_making_rows()
    yield from law_answer_rows()


def law_making_rows(models: Sequence[str] | None = None) -> Iterator[Row]:
    """Making a law by island model and tolerance."""
    for island_model in models or ISLAND_MODELS:
        timed = SURFACES[:2] if island_model == "exact" else SURFACES
        rtols = LAW_RTOLS if island_model == "universal" else SLOW_LAW_RTOLS
        for rtol in rtols:
            answers = answers_of_laws(laws_of(island_model, rtol))
            cost, _ = measure(functools.partial(laws_of, island_model, rtol, timed))
            error = largest_error(answers)
            yield Row(island_model, at("law", rtol), "both", error, cost / len(timed))


def law_answer_rows() -> Iterator[Row]:
    """What a law answers."""
    law = contact_law(SURFACES[3], theory="mbma")
    gaps = gaps_of(SURFACES[3], 10_000)
    loads = law.pressure(separation=gaps)

    def both() -> tuple[Any, Any]:
        return law.pressure(separation=gaps), law.area(separation=gaps)

    answers_of_law: tuple[tuple[str, str, Callable[[], Any]], ...] = (
        ("lookup", "pressure", functools.partial(law.pressure, separation=gaps)),
        ("lookup", "area", functools.partial(law.area, separation=gaps)),
        ("lookup", "both", both),
        ("invert", "pressure", functools.partial(law.separation, pressure=loads)),
    )
    for name, quantity, run in answers_of_law:
        cost, _ = measure(run)
        yield Row("law", name, quantity, None, cost / gaps.size)


def theory_rows() -> Iterator[Row]:
    """Theories other than MBMA: a call, each further gap, and laws."""
    surface = SURFACES[3]
    u = np.linspace(0.1, 0.9, MANY) * float(surface.h_max)

    def answer(theory: str, **arguments: Any) -> Any:
        return contact(fresh(surface), theory=theory, **arguments)

    def law_of(theory: str, rtol: float) -> Any:
        return contact_law(fresh(surface), theory=theory, rtol=rtol)

    for name in theories.THEORIES[1:]:
        one, _ = measure(functools.partial(answer, name, mean_separation=u[:1]))
        gaps, _ = measure(functools.partial(answer, name, mean_separation=u))
        # what a call takes besides its gaps: noise does not make it negative
        fixed = max((u.size * one - gaps) / (u.size - 1), 1e-3 * one)
        yield Row(name, "call", "both", None, fixed)
        yield Row(name, "gap", "both", None, max(gaps - fixed, 1e-9) / u.size)
        for rtol in THEORY_LAW_RTOLS:
            cost, _ = measure(functools.partial(law_of, name, rtol))
            yield Row(name, at("law", rtol), "both", None, cost)


def effect_rows(effects: Sequence[str] = tuple(EFFECTS)) -> Iterator[Row]:
    """What effects of scenes cost besides pressures and areas at given gaps: once, and for each gap."""
    surface = SURFACES[3]
    farthest = float(surface.h_max)

    def run(theory: str, part: str, count: int) -> Any:
        u = np.linspace(0.6, 0.95, count) * farthest
        asked = EFFECTS[part]
        if theory == "mbma" and part in ("base", "inverse"):
            asked = ["pressure", "area"]
        given: dict[str, Any] = {"mean_separation": u}
        pressure = contact(surface, mean_separation=u, theory=theory).pressure
        if "inverse" in part:
            given = {"pressure": pressure}
        if "yield" in part:
            # asperities yield, and the bulk does not
            at_most = float(surface.rms_gradient) / 2
            hardness = max(at_most, 4 * float(np.max(pressure)))
            given["bodies"] = Bodies(hardness=hardness)

        def scene() -> Any:
            made = Scene(
                fresh(surface), quantities=asked, theory=theory, rtol=1e-4, **given
            )
            return made.run()

        return measure(scene)[0]

    for theory in theories.THEORIES:
        base = {
            count: run(theory, "base", count) for count in (1, MANY, *COUNTS.values())
        }
        for part in effects:
            if part == "base" or (part == "slopes" and theory != "mbma"):
                continue
            count = COUNTS.get(part, MANY)
            one = run(theory, part, 1) - base[1]
            many = run(theory, part, count) - base[count]
            each = max((many - one) / (count - 1), 1e-9)
            yield Row(theory, f"{part} once", "both", None, max(one - each, 1e-9))
            yield Row(theory, f"{part} gap", "both", None, each)


def first_use_rows(models: Sequence[str] | None = None) -> Iterator[Row]:
    _, seconds = measure(lambda: None)
    for island_model in models or ISLAND_MODELS:
        command = [sys.executable, "-c", FIRST_USE.format(island_model)]
        taken = []
        for _ in range(4):
            done = subprocess.run(command, check=True, capture_output=True)
            taken.append(float(done.stdout))
        # the first fills the caches of the system
        yield Row(island_model, "import", "both", None, min(taken[1:]) / seconds)


def study() -> bytes:

    def seconds_of_work() -> float:
        _, seconds = measure(lambda: None)
        return seconds

    seconds = [seconds_of_work()]
    rows = list[Row]()
    for part in (
        island_rows,
        scene_rows,
        gap_rows,
        law_rows,
        theory_rows,
        effect_rows,
        first_use_rows,
    ):
        rows += part()
        seconds.append(seconds_of_work())
    facts = {
        "machine": platform.machine(),
        "numpy": metadata.version("numpy"),
        "scipy": metadata.version("scipy"),
        "python": platform.python_version(),
    }
    head = f"{HEAD}# {json.dumps(facts)}\n"
    # the least: other processes can only add
    unit = Row(UNIT, "seconds", "both", None, min(seconds))
    return to_csv(head, pd.DataFrame([unit, *rows]), "%.4g")


def again(island_model: str) -> bytes:
    """The shipped costs with those of one island model measured anew, in the same places.

    All are over the fixed work of their own run, so that those of two runs stand beside
    one another.
    """
    models = (island_model,)
    return replaced(
        row
        for rows in (model_rows, gap_rows, law_making_rows, first_use_rows)
        for row in rows(models)
    )


def replaced(measured: Iterable[Row]) -> bytes:
    """The shipped costs with rows that were measured anew, in the same places."""
    path = ROOT / "tables" / "cost.csv"
    text = path.read_text(encoding="utf-8")
    head = "".join(line for line in text.splitlines(True) if line.startswith("#"))
    frame = read_csv(path)
    key = ["island_model", "variant", "quantity"]
    numeric = dict.fromkeys(("error", "cost", "evaluations"), float)
    fresh = pd.DataFrame(list(measured)).astype(numeric).set_index(key)
    numbers = frame.set_index(key)
    missing = fresh.index.difference(numbers.index)
    if len(missing):
        raise click.ClickException(
            f"the shipped costs lack {list(missing)}: measure all, without --model"
        )
    numbers.loc[fresh.index] = fresh
    return to_csv(head, numbers.reset_index(), "%.4g")


@click.command()
@click.option(
    "--model",
    type=click.Choice([name for name in ISLAND_MODELS if name != "exact"]),
    help="Only this island model; the others' rows stay.",
)
@click.option(
    "--effect",
    type=click.Choice([name for name in EFFECTS if name != "base"]),
    help="Only what this adds to scenes by every theory; other rows stay.",
)
def cost(model: str | None, effect: str | None) -> None:
    """Measure tables/cost.csv and tables/distance.csv.

    For `mbma cost`, plans of scenes and docs/lookup.md.
    """
    studies = {"cost": study, "distance": cost_distances.study}
    if model is not None:
        studies = {
            "cost": functools.partial(again, model),
            "distance": functools.partial(cost_distances.again, model),
        }
    if effect is not None:
        studies = {"cost": lambda: replaced(effect_rows([effect]))}
    for name, content in studies.items():
        write_file(ROOT / "tables" / f"{name}.csv", content(), make_folders=True)
        click.echo(f"tables/{name}.csv")


DAMPING = 0.1
MAX_STEPS = 5000
MAX_DEFORMATION = 1e12  # a larger deformation is divergence


def ring_matrix(rings: int) -> FloatArray:
    """w at the rings' middles per unit radius a, from pressures on rings of equal width.

    Eq. (37).
    """
    r = (np.arange(rings) + 0.5) / rings
    t = r[None, :]
    rho = r[:, None]
    # 1 - k^2 of the elliptic integral; it is infinite in the ring itself, whose term follows below
    complement = ((t - rho) / (t + rho)) ** 2
    np.fill_diagonal(complement, 1.0)
    matrix: FloatArray = 4 / np.pi * t / (t + rho) * ellipkm1(complement) / rings
    # the midpoint rule across ln|t - rho| is of second order with ln(h/2 pi) in the ring itself
    np.fill_diagonal(matrix, 2 / np.pi * np.log(16 * np.pi * r * rings) / rings)
    return matrix


@np.errstate(all="ignore")
def iterated(
    X: float,
    mu: float,
    matrix: FloatArray,
    tolerance: float,
) -> tuple[int, bool, float, float]:
    """Iterations from w = 0, whether they converged, Phi_F and Phi_A, NaN where they diverged."""
    # the island's radius a, beyond which its pressure is below the tolerance
    squared = np.empty(1)
    core.island_extents(np.array([X]), np.array([mu]), 0.03 * tolerance, squared)
    a = math.sqrt(squared[0])
    w = np.zeros(len(matrix))
    loads = np.empty(w.size)
    rho = a * (np.arange(w.size) + 0.5) / w.size

    steps = 0
    converged = False
    while not converged and steps < MAX_STEPS:
        core.height_integrals(3, rho**2 - X + w, loads)
        change = DAMPING * (a * (matrix @ (mu / 2 * loads)) - w)
        w += change
        steps += 1
        scale = np.abs(w).max()
        if not scale < MAX_DEFORMATION:
            return steps, False, math.nan, math.nan
        converged = bool(np.abs(change).max() <= tolerance * DAMPING * scale)

    def integral(twice_n: int, strength: float) -> float:
        core.height_integrals(twice_n, rho**2 - X + w, loads)
        return float(2 * np.pi * a / w.size * strength * (rho @ loads))

    return steps, converged, integral(3, mu / 2), integral(2, 1.0)
