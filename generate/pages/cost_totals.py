"""What totals cost: tiers, quadrature orders, laws, theories, first use, and force alone."""

from __future__ import annotations

import functools
import inspect
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any
from unittest import mock

import numpy as np

from generate.pages.comparisons import REFERENCES
from generate.tables.solves import log_ratio
from mbma_tables import Scene, Surface, contact, contact_law, theories
from mbma_tables.arguments import FloatArray
from mbma_tables.islands import greenwood_tripp
from mbma_tables.models import TIERS, get_model
from mbma_tables.models.protocol import IslandAnswer, TwoNumberModel
from mbma_tables.models.universal import Island4dModel, UniversalModel, shipped
from mbma_tables.scenes.costs import GAPS, Row, gap_batch, held_out_surfaces, measure, measured_gaps, variant
from mbma_tables.scenes.plan import rigid_error
from mbma_tables.surfaces.readings import get_reading
from mbma_tables.tablefiles.netcdf import read_table
from mbma_tables.totals import island_sum
from mbma_tables.totals.gauss_kronrod import Integrals
from mbma_tables.totals.pairs import Pairs

EVERY = 5  # of the timed gaps, one is held against the reference
REFERENCE_RTOL, REFERENCE_ISLANDS = 1e-11, 1e-12
RTOLS = tuple(10.0**-k for k in range(1, 9))
EXACT_RTOLS = (*RTOLS, 1e-9, 1e-10)
LAW_RTOLS = RTOLS[1:]
SLOW_LAW_RTOLS = (1e-2, 1e-4)
ORDERS = (4, 6, 8, 12, 16, 24, 32, 48)
FIRST_USE = (
    "import mbma_tables, numpy, time; s = mbma_tables.Surface(0.74, 1.0, 330.0, 0.1, 0.3); t = time.perf_counter(); "
    "mbma_tables.contact(s, 0.1, tier={tier!r}, rtol=1e-2); print(time.perf_counter() - t)"
)


class Doubled(TwoNumberModel):
    """The exact solver on twice the nodes that it would take."""

    name = "doubled"

    def answer(self, X: FloatArray, mu: FloatArray, *, outside: str = "raise") -> IslandAnswer:
        """Phi_F and Phi_A."""
        flat_X, flat_mu = X.ravel(), mu.ravel()
        rigid = greenwood_tripp.rigid_sphere(flat_X, flat_mu)
        phi = np.exp(log_ratio(flat_X, flat_mu, REFERENCE_ISLANDS, 2)).T * rigid
        force, area = phi.reshape(2, *X.shape)
        return IslandAnswer(force, area, np.full(X.shape, REFERENCE_ISLANDS))


def pairs_of(surface: Surface, gap: FloatArray) -> Pairs:
    """One surface's gaps as the sums take them."""
    zeta_1, hurst, h_rms = (float(value) for value in (surface.zeta_1, surface.hurst, surface.h_rms))
    full = functools.partial(np.full, gap.size)
    return Pairs(
        hurst=full(hurst),
        zeta_1=full(zeta_1),
        room=full(h_rms / float(surface.s)),
        reach=(float(surface.h_max) - gap) / h_rms,
        top=full(float(surface.h_max) / h_rms),
        layer=full(zeta_1**-hurst),
    )


def summed(surface: Surface, gap: FloatArray, model: Any, rtol: float) -> tuple[FloatArray, int]:
    """(F/(A0 E*), A/A0), shape (2, gaps), and the islands evaluated, by the quadrature of any model."""
    force, area, _, islands = island_sum.sum_islands(pairs_of(surface, gap), get_reading("reported"), model, rtol)
    return np.stack([force * float(surface.q0 * surface.s), area]), islands


@functools.cache
def reference() -> tuple[tuple[Surface, FloatArray, FloatArray], ...]:
    """Held-out surfaces, every fifth of their gaps, and force and area there."""
    rows = []
    for surface in held_out_surfaces():
        gap = measured_gaps(surface)[::EVERY]
        rows.append((surface, gap, summed(surface, gap, Doubled(), REFERENCE_RTOL)[0]))
    return tuple(rows)


def largest_error(answers: Sequence[Any], chosen: slice = slice(None)) -> float:
    """Of force and area of every surface against the reference; `chosen` picks one of the two."""
    errors = [
        np.abs(np.stack(list(own)) / truth[chosen] - 1).max()
        for own, (_, _, truth) in zip(answers, reference(), strict=True)
    ]
    return float(max(errors))


def single_quantities() -> dict[str, dict[str, Any]]:
    """Keywords by quantity: both, and force or area alone where `contact` takes them apart."""
    found: dict[str, dict[str, Any]] = {"both": {}}
    if "quantities" in inspect.signature(contact).parameters:
        found |= {name: {"quantities": (name,)} for name in ("force", "area")}
    return found


def scene_rows() -> Iterator[Row]:
    """What a scene takes besides its steps: planning, making the result, and the bound on rigid spheres."""
    surface = held_out_surfaces()[0]
    gap = 0.9 * float(surface.h_max)
    loose, tight = (Scene(surface, effects=["force"], separations=gap, rtol=rtol) for rtol in (1e-2, 1e-4))
    whole = measure(tight.run)[0]
    step = measure(functools.partial(contact, surface, gap, rtol=1e-4, quantities=["force"]))[0]
    yield Row("scene", "call", "both", None, max(whole - step, 0.0))
    yield Row("scene", "bound", "both", None, measure(functools.partial(rigid_error, loose))[0])


def gap_rows(quick: bool) -> Iterator[Row]:
    """Totals of each tier at several tolerances: the call, and each further gap."""
    surfaces = held_out_surfaces()
    for tier in TIERS:
        for quantity, options in single_quantities().items():
            call = functools.partial(_single_gaps, surfaces, tier, options)
            one = measure(call)[0] / len(surfaces)
            batch = measure(gap_batch(tier, 1e-2, **options))[0] / len(surfaces)
            fixed = max((GAPS * one - batch) / (GAPS - 1), 1e-3 * one)
            yield Row(tier, "call", quantity, None, fixed)
            names = ("force", "area") if quantity == "both" else (quantity,)
            chosen = {"both": slice(None), "force": slice(0, 1), "area": slice(1, 2)}[quantity]
            tolerances = EXACT_RTOLS if tier == "exact" else RTOLS
            if quick or quantity != "both":
                tolerances = tolerances[1::3]
            for rtol in tolerances:
                run = gap_batch(tier, rtol, **options)
                islands = [answer.islands for answer in run()]
                answers = [
                    [getattr(contact(s, gap, tier=tier, rtol=rtol, **options), name) for name in names]
                    for s, gap, _ in reference()
                ]
                cost = max(measure(run)[0] / len(surfaces) - fixed, 1e-9) / GAPS
                count = sum(islands) / (len(surfaces) * GAPS)
                yield Row(tier, variant("gap", rtol), quantity, largest_error(answers, chosen), cost, count)


def _single_gaps(surfaces: Sequence[Surface], tier: str, options: dict[str, Any]) -> None:
    for surface in surfaces:
        contact(surface, 0.25 * float(surface.h_max), tier=tier, rtol=1e-2, **options)


def order_rows() -> Iterator[Row]:
    """Gauss-Legendre of a fixed order between the kinks, without an estimate, in place of the adaptive rule."""
    model = get_model("universal", 1e-8, get_reading("reported"))
    batches = [(surface, measured_gaps(surface)) for surface in held_out_surfaces()]
    for order in ORDERS:
        nodes, weights = np.polynomial.legendre.leggauss(order)

        def rule(
            integrand: Callable[..., FloatArray],
            owner: Any,
            low: FloatArray,
            high: FloatArray,
            count: int,
            *_: Any,
            nodes: FloatArray = nodes,
            weights: FloatArray = weights,
            **__: Any,
        ) -> Integrals:
            half = (high - low) / 2
            values = integrand(owner, (low + high)[:, None] / 2 + half[:, None] * nodes)
            parts = np.einsum("kic,i,k->kc", values, weights, half)
            total = np.stack([np.bincount(owner, column, count) for column in parts.T], axis=1)
            return Integrals(total.astype(float), np.zeros(total.shape), owner.size * len(nodes))

        with mock.patch.object(island_sum, "integrate", rule):
            answers = [summed(surface, gap, model, 1.0)[0] for surface, gap, _ in reference()]
            islands = sum(summed(surface, gap, model, 1.0)[1] for surface, gap in batches)
            cost, _ = measure(lambda: [summed(surface, gap, model, 1.0) for surface, gap in batches])
        per = len(batches) * GAPS
        yield Row("universal", f"order={order}", "both", largest_error(answers), cost / per, islands / per)


def law_rows(quick: bool) -> Iterator[Row]:
    """Making laws, and asking them."""
    surfaces = held_out_surfaces()
    for tier in TIERS:
        tolerances = LAW_RTOLS if tier == "universal" else SLOW_LAW_RTOLS
        if quick:
            tolerances = tolerances[::3] if tier == "universal" else ()
        for rtol in tolerances:
            laws = [contact_law(surface, rtol, tier=tier) for surface in surfaces]
            answers = [(law.force(gap), law.area(gap)) for law, (_, gap, _) in zip(laws, reference(), strict=True)]
            own = surfaces[:2] if tier == "exact" else surfaces
            cost, _ = measure(functools.partial(_make_laws, own, rtol, tier))
            yield Row(tier, variant("law", rtol), "both", largest_error(answers), cost / len(own))
    surface = surfaces[3]
    law = contact_law(surface)
    gaps = measured_gaps(surface, 10_000)
    for quantity, ask in (("force", law.force), ("area", law.area)):
        yield Row("law", "lookup", quantity, None, measure(functools.partial(ask, gaps))[0] / gaps.size)
    # a lookup of both is two lookups
    both, _ = measure(lambda: (law.force(gaps), law.area(gaps)))
    yield Row("law", "lookup", "both", None, both / gaps.size)
    loads = law.force(gaps)
    yield Row("law", "invert", "force", None, measure(lambda: law.separation(force=loads))[0] / gaps.size)


def _make_laws(surfaces: Sequence[Surface], rtol: float, tier: str) -> None:
    for surface in surfaces:
        contact_law(surface, rtol, tier=tier)


def theory_rows() -> Iterator[Row]:
    """The theories that `comparison` puts beside the model."""
    surface = held_out_surfaces()[3]
    gap = measured_gaps(surface, 20)
    average = theories.mean_separation(surface, gap)

    def persson() -> None:
        theories.persson_area(surface, theories.persson_force(surface, average))

    ways = {"greenwood_williamson": lambda: theories.greenwood_williamson(surface, gap), "persson": persson}
    for name, run in ways.items():
        yield Row(name, "gap", "both", None, measure(run)[0] / gap.size)


def first_use_rows(quick: bool) -> Iterator[Row]:
    """First use in a new process, compiled code in its cache, and opening a table in a warm one."""
    seconds = measure(lambda: None)[1]
    for tier in TIERS:
        command = [sys.executable, "-c", FIRST_USE.format(tier=tier)]
        taken = [
            float(subprocess.run(command, check=True, capture_output=True).stdout) for _ in range(2 if quick else 4)
        ]
        # the first fills the caches
        yield Row(tier, "import", "both", None, min(taken[1:]) / seconds)
    openings: dict[str, Callable[[], Any]] = {
        "universal": lambda: UniversalModel(read_table(shipped("universal"), "universal")).kernel,
        "island4d": lambda: Island4dModel(read_table(shipped("island4d"), "island4d")),
    }
    for tier, run in openings.items():
        yield Row(tier, "open", "both", None, measure(run)[0])


def brute_force_rows(seconds: float) -> Iterator[Row]:
    """Boundary elements, each load's time on the machine of those who ran them, over this machine's fixed work."""
    data = REFERENCES["bem"]
    for force, spent in zip(data.column("force"), data.column("seconds_per_step"), strict=True):
        yield Row("boundary_elements", f"load force={force:g}", "both", None, spent / seconds)


def total_rows(quick: bool) -> list[Row]:
    """Everything that answers a gap."""
    return [
        *scene_rows(),
        *gap_rows(quick),
        *order_rows(),
        *law_rows(quick),
        *theory_rows(),
        *first_use_rows(quick),
    ]
