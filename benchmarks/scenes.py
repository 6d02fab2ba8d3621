"""Random scenes: what they promised beside what they did, in error and in time."""

import itertools
import time
from typing import Any

import click
import numpy as np
from scipy.integrate import quad_vec

from benchmarks.rows import report
from generate.timing import measure
from mbma_tables import Bodies, InputError, Scene, Surface, contact
from mbma_tables.design.scenes.plan import shipped_costs
from mbma_tables.theories import THEORIES, Mbma

SCENES = 200
GAPS = 4
WARMED = 20  # scenes before times count: modules are loaded and tables opened by then
REQUESTED = (
    ("pressure", "area"),
    ("energy",),
    ("stiffness",),
    ("pressure", "energy"),
    ("pressure", "area", "theories"),
    ("area", "points"),
    ("pressure", "solid_conductance"),
)
# what is requested by another argument than quantities, and what a quantity needs
MORE: dict[str, dict[str, Any]] = {
    "theories": {"theories": ["greenwood_williamson"]},
    "points": {"points": 64},
    "solid_conductance": {"bodies": Bodies(conductivity=(50.0, 20.0))},
}


def truth(surface: Surface, gaps: np.ndarray, name: str) -> np.ndarray:
    """Exact force and area; stiffness and energy by other means than a law's."""
    if name in ("pressure", "area"):
        return np.asarray(
            getattr(
                contact(
                    surface,
                    separation=gaps,
                    theory=Mbma(island_model="exact", rtol=1e-10),
                ),
                name,
            )
        )
    if name == "stiffness":
        return np.asarray(
            contact(surface, separation=gaps, theory=Mbma(rtol=1e-10)).stiffness
        )
    span = surface.h_max - gaps

    def integrand(t: float) -> np.ndarray:
        # t^2 for the power at first contact
        return (
            t
            * span
            * contact(
                surface, separation=surface.h_max - span * t**2, theory=Mbma(rtol=1e-10)
            ).pressure
        )

    return np.asarray(quad_vec(integrand, 0, 1, epsrel=1e-9, norm="max")[0])


def scenes(rng: np.random.Generator) -> None:
    """Scenes of a random surface, gaps, quantities and tolerance."""
    above: list[float] = []
    ratios: list[float] = []
    refused = 0
    for number in range(SCENES):
        h_rms = 10 ** rng.uniform(-3, 1)
        h_max = h_rms * rng.uniform(2.5, 3.8)
        surface = Surface(
            rng.uniform(0.3, 1), 1.0, 10 ** rng.uniform(0.7, 4), h_rms, h_max
        )
        gaps = np.sort(rng.uniform(-0.5, 0.99, GAPS)) * h_max
        rtol = 10 ** rng.uniform(-8, -1)
        requested = REQUESTED[number % len(REQUESTED)]
        extra: dict[str, Any] = {}
        for name in requested:
            extra |= MORE.get(name, {})
        names = [name for name in requested if name not in extra]
        try:
            scene = Scene(surface, quantities=names, separation=gaps, rtol=rtol, **extra)
            plan = scene.plan()
            start = time.process_time()
            found = scene.run()
            spent = time.process_time() - start
        except InputError:
            refused += 1  # a tolerance too tight for the energy
            continue
        if number >= WARMED:
            ratios.append(spent / plan.seconds)
        # the truth of stiffness is known to 1e-7
        names = [name for name in ("pressure", "area", "energy") if name in found]
        names += ["stiffness"] * ("stiffness" in found and rtol > 1e-6)
        above += [
            np.abs(found[name].values / truth(surface, gaps, name) - 1).max() / rtol
            for name in names
        ]
    ratio = np.array(ratios)
    click.echo(f"\n{SCENES} random scenes, {refused} of them refused as too tight")
    report("largest error over the tolerance asked", max(above), "x", at_most=1)
    report("time over the plan's, median", float(np.median(ratio)), "x")
    report(
        "within a factor 2 of the plan's time",
        float(np.mean((ratio > 0.5) & (ratio < 2))),
        "",
    )


SIZES = (10, 1000, 30_000)
ASKED = (["area"], ["area", "stiffness", "solid_conductance"], ["energy"])


def over_plan(
    by: str, size: int, generator: np.random.Generator, **options: Any
) -> float:
    """Time of a scene of many loads over its plan's, both over the fixed work of this moment."""
    pressures = np.geomspace(1e-4, 2e-2, size)
    values = pressures if by == "pressure" else np.linspace(0.5, 3.0, size)

    def scene() -> Scene:
        q1 = 1.0 + 1e-6 * generator.random()  # which no theory has seen
        surface = Surface(0.8, 0.01, q1, 1.0, 3.6, unit="um")
        given: dict[str, Any] = {by: values, **options}
        return Scene(surface, rtol=1e-4, **given)

    cost, _ = measure(lambda: scene().run())
    making, _ = measure(scene)
    return (cost - making) * shipped_costs().seconds / scene().plan().seconds


def sizes(generator: np.random.Generator) -> None:
    """Scenes of few and of many loads by every theory: `python -m benchmarks.scenes`."""
    ratios: dict[int, list[float]] = {size: [] for size in SIZES}
    for theory, hardness, by, quantities in itertools.product(
        THEORIES, (None, "2 GPa"), ("pressure", "mean_separation"), ASKED
    ):
        bodies = Bodies("100 GPa", hardness=hardness, conductivity="45 W/(m K)")
        options = {"bodies": bodies, "theory": theory, "quantities": quantities}
        found = [over_plan(by, size, generator, **options) for size in SIZES]
        for size, ratio in zip(SIZES, found, strict=True):
            ratios[size].append(ratio)
        texts = "".join(f"{ratio:8.2f}" for ratio in found)
        kind = hardness or "elastic"
        click.echo(f"{theory:22}{kind:9}{by:17}{'+'.join(quantities):40}{texts}")
    for size, of_size in ratios.items():
        within = np.mean([0.5 < ratio < 2 for ratio in of_size])
        report(f"{size} loads: within a factor 2 of the plan's time", float(within), "")
        report(f"{size} loads: median over it", float(np.median(of_size)), "x")


if __name__ == "__main__":
    sizes(np.random.default_rng(1))
