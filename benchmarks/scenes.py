"""Random scenes: what they promised beside what they did, in error and in time."""

import time
from typing import Any

import click
import numpy as np
from scipy.integrate import quad_vec

from benchmarks.rows import report
from mbma_tables import Bodies, InputError, Scene, Surface, contact
from mbma_tables.theories import Mbma

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
