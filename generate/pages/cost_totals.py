"""docs/cost.md: cost of totals by island models, laws and theories, of first use, and of force alone."""

from __future__ import annotations

import functools
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from generate.tables import chunks
from generate.timing import GAPS, held_out_surfaces, measure, measured_gaps, variant
from mbma_tables import Scene, Surface, contact, contact_law, theories
from mbma_tables.common.arguments import FloatArray
from mbma_tables.models import ISLAND_MODELS, IslandAnswer
from mbma_tables.scenes.costs import Row

EVERY = 5  # of the timed gaps, one is compared with the reference
REFERENCE_RTOL, REFERENCE_ISLANDS = 1e-11, 1e-12
RTOLS = tuple(10.0**-k for k in range(1, 9))
EXACT_RTOLS = (*RTOLS, 1e-9, 1e-10)
LAW_RTOLS = RTOLS[1:]
# as many as a law begins to pay for
THEORY_GAPS = {"calibrated": 20_000, "greenwood_williamson": 20_000, "persson": 100}
THEORY_LAW_RTOLS = (1e-3, 1e-5, 1e-7)
SLOW_LAW_RTOLS = (1e-2, 1e-4)
FIRST_USE = (
    "import mbma_tables, numpy, time; s = mbma_tables.Surface(0.74, 1.0, 330.0, 0.1, 0.3); t = time.process_time(); "
    "mbma_tables.contact(s, separation=0.1, island_model={island_model!r}, rtol=1e-2); print(time.process_time() - t)"
)
# keywords of `contact` by quantity, and the answers that these give
QUANTITIES: dict[str, tuple[dict[str, Any], tuple[str, ...]]] = {
    "both": ({}, ("pressure", "area")),
    "pressure": ({"quantities": ("pressure",)}, ("pressure",)),
    "area": ({"quantities": ("area",)}, ("area",)),
}


class Doubled:
    """The exact solver on twice the nodes that it would take."""

    name = "doubled"

    def answer(self, X: FloatArray, mu: FloatArray) -> IslandAnswer:
        """Phi_F and Phi_A."""
        flat_X, flat_mu = X.ravel(), mu.ravel()
        phi = chunks.phi(flat_X, flat_mu, REFERENCE_ISLANDS, 2).T
        force, area = phi.reshape(2, *X.shape)
        return IslandAnswer(force, area, np.full(X.shape, REFERENCE_ISLANDS))


@functools.cache
def reference() -> tuple[tuple[Surface, FloatArray, dict[str, FloatArray]], ...]:
    """Held-out surfaces, every fifth of their gaps, and force and area there."""
    rows = []
    for surface in held_out_surfaces():
        gap = measured_gaps(surface)[::EVERY]
        found = contact(surface, separation=gap, island_model=Doubled(), rtol=REFERENCE_RTOL)
        rows.append((surface, gap, {"pressure": np.asarray(found.pressure), "area": np.asarray(found.area)}))
    return tuple(rows)


def largest_error(answers: Sequence[dict[str, FloatArray]]) -> float:
    """Of what is answered, surface by surface, at the reference's gaps."""
    return max(
        float(np.abs(values / truth[name] - 1).max())
        for answer, (_, _, truth) in zip(answers, reference(), strict=True)
        for name, values in answer.items()
    )


def scene_rows() -> Iterator[Row]:
    """What a scene takes besides its steps: planning and making the result."""
    surface = held_out_surfaces()[0]
    gap = 0.9 * float(surface.h_max)
    whole = measure(Scene(surface, effects=["pressure"], separations=gap, rtol=1e-4).run)[0]
    step = measure(functools.partial(contact, surface, separation=gap, rtol=1e-4, quantities=["pressure"]))[0]
    yield Row("scene", "call", "both", None, max(whole - step, 0.0))


def gap_batch(island_model: str, rtol: float, count: int = GAPS, **options: Any) -> list[Any]:
    """Totals at `count` gaps of each held-out surface, one call a surface."""
    pairs = [(surface, measured_gaps(surface, count)) for surface in held_out_surfaces()]
    return [contact(surface, separation=gap, island_model=island_model, rtol=rtol, **options) for surface, gap in pairs]


def gap_rows() -> Iterator[Row]:
    """Totals of each island model at several tolerances: the call, and each further gap."""
    surfaces = held_out_surfaces()
    for island_model in ISLAND_MODELS:
        for quantity, (options, names) in QUANTITIES.items():
            one = measure(functools.partial(gap_batch, island_model, 1e-2, 1, **options))[0] / len(surfaces)
            batch = measure(functools.partial(gap_batch, island_model, 1e-2, **options))[0] / len(surfaces)
            fixed = max((GAPS * one - batch) / (GAPS - 1), 1e-3 * one)
            yield Row(island_model, "call", quantity, None, fixed)
            tolerances = EXACT_RTOLS if island_model == "exact" else RTOLS
            for rtol in tolerances[1::3] if quantity != "both" else tolerances:
                asked: Callable[..., Any] = functools.partial(contact, island_model=island_model, rtol=rtol, **options)
                run = functools.partial(gap_batch, island_model, rtol, **options)
                count = sum(found.islands for found in run()) / (len(surfaces) * GAPS)
                cost = max(measure(run)[0] / len(surfaces) - fixed, 1e-9) / GAPS
                answers = [asked(surface, separation=gap) for surface, gap, _ in reference()]
                error = largest_error([{name: getattr(found, name) for name in names} for found in answers])
                yield Row(island_model, variant("gap", rtol), quantity, error, cost, count)


def law_rows() -> Iterator[Row]:
    """Making laws, and evaluating them."""
    surfaces = held_out_surfaces()
    for island_model in ISLAND_MODELS:
        tolerances = LAW_RTOLS if island_model == "universal" else SLOW_LAW_RTOLS
        for rtol in tolerances:
            laws: list[Any] = [contact_law(surface, rtol, island_model=island_model) for surface in surfaces]
            answers = [
                {"pressure": law.pressure(separation=gap), "area": law.area(separation=gap)}
                for law, (_, gap, _) in zip(laws, reference(), strict=True)
            ]
            timed = surfaces[:2] if island_model == "exact" else surfaces
            cost, _ = measure(lambda t=timed, r=rtol, n=island_model: [contact_law(s, r, island_model=n) for s in t])  # type: ignore[misc]
            yield Row(island_model, variant("law", rtol), "both", largest_error(answers), cost / len(timed))
    surface = surfaces[3]
    law, gaps = contact_law(surface), measured_gaps(surface, 10_000)
    loads = law.pressure(separation=gaps)
    ways: dict[tuple[str, str], Callable[[], Any]] = {
        ("lookup", "pressure"): lambda: law.pressure(separation=gaps),
        ("lookup", "area"): lambda: law.area(separation=gaps),
        ("lookup", "both"): lambda: (law.pressure(separation=gaps), law.area(separation=gaps)),
        ("invert", "pressure"): lambda: law.separation(pressure=loads),
    }
    for (name, quantity), run in ways.items():
        yield Row("law", name, quantity, None, measure(run)[0] / gaps.size)


def theory_rows() -> Iterator[Row]:
    """Theories other than MBMA: a call, each further gap by separation or by pressure, energies, and laws."""
    surface = held_out_surfaces()[3]
    for name in theories.THEORIES[1:]:
        u = np.linspace(0.1, 0.9, THEORY_GAPS[name]) * float(surface.h_max)
        ask = functools.partial(contact, surface, theory=name)
        known: dict[str, dict[str, Any]] = {
            "gap": {"mean_separation": u},
            "invert": {"pressure": ask(mean_separation=u).pressure},
        }
        one = measure(functools.partial(ask, mean_separation=u[:1]))[0]
        batch = {what: measure(functools.partial(ask, **given))[0] for what, given in known.items()}
        batch["energy"] = measure(lambda ask=ask, u=u: ask(mean_separation=u).energy)[0] - batch["gap"]  # type: ignore[misc]
        fixed = max((u.size * one - batch["gap"]) / (u.size - 1), 1e-3 * one)
        yield Row(name, "call", "both", None, fixed)
        for what, cost in batch.items():
            yield Row(name, what, "both", None, max(cost - (0 if what == "energy" else fixed), 1e-9) / u.size)
        for rtol in THEORY_LAW_RTOLS:
            cost, _ = measure(functools.partial(contact_law, surface, rtol, theory=name))
            yield Row(name, variant("law", rtol), "both", None, cost)


def first_use_rows() -> Iterator[Row]:
    """First use in a new process."""
    seconds = measure(lambda: None)[1]
    for island_model in ISLAND_MODELS:
        command = [sys.executable, "-c", FIRST_USE.format(island_model=island_model)]
        taken = [float(subprocess.run(command, check=True, capture_output=True).stdout) for _ in range(4)]
        # the first fills the caches of the system
        yield Row(island_model, "import", "both", None, min(taken[1:]) / seconds)


def total_rows() -> list[Row]:
    """Everything that answers a gap."""
    return [*scene_rows(), *gap_rows(), *law_rows(), *theory_rows(), *first_use_rows()]
