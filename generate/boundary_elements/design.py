"""The campaigns of `campaign.toml`: which surfaces, in which order, and which of them no fit may see.

Nodes are spectra (with a transform where there is one). Those marked held out are never fitted, nor is the second
surface of every other node; so a law is tested on new surfaces of known spectra and on spectra of its own.
"""

from __future__ import annotations

import dataclasses
import itertools
import pathlib
import tomllib
import zlib

from generate.boundary_elements.surfaces import Recipe

CAMPAIGNS = tomllib.loads(pathlib.Path(__file__).with_name("campaign.toml").read_text(encoding="utf-8"))
SPLITS = ("training", "held_out_surface", "held_out_spectrum", "refine")
TRAINING, HELD_OUT_SURFACE, HELD_OUT_SPECTRUM, REFINEMENT = SPLITS
FINER = (64, 128, 256, 512)  # grids of refined surfaces: 2 to 32 points a shortest wave


@dataclasses.dataclass(frozen=True)
class Task:
    """A surface to solve and the set that it belongs to."""

    recipe: Recipe
    split: str


def cost(recipe: Recipe) -> float:
    """Grid points a side, more where stretching makes the equations ill-conditioned."""
    return recipe.points * (max(1.0, recipe.shape / 4) if recipe.kind == "stretched" else 1.0)


def campaign(kind: str = "elastic") -> list[Task]:
    """Every surface to solve, cheap ones first and kinds in turn, so that stopping early leaves a balanced set.

    `kind` is elastic, hardness (pressures are capped) or leakage (gaps are solved for flow).
    """
    refined = [
        Task(dataclasses.replace(recipe, points=points), REFINEMENT)
        for points, recipe in itertools.product(FINER, (Recipe(*row) for row in CAMPAIGNS["refined"][kind]))
        if points > 2 * recipe.band[1]
    ]
    tasks = []
    for family, hursts, bands, points, surfaces, shapes, held_out in CAMPAIGNS[kind]:
        for hurst, band, shape in itertools.product(hursts.split(), bands.split(), shapes.split()):
            zeta_1, waves = band.split("x")
            node = Recipe(family, float(hurst), float(zeta_1), int(waves), 0, points, float(shape))
            for turn in range(surfaces):
                split = HELD_OUT_SPECTRUM if held_out else HELD_OUT_SURFACE if turn == 1 else TRAINING
                # of the spectrum alone, so that a longer list moves no seed; its order mixes the kinds
                seed = zlib.crc32(node.name.encode()) % 10_000_000 * 100 + turn
                tasks.append((cost(node), turn, seed, Task(dataclasses.replace(node, seed=seed), split)))
    tasks.sort(key=lambda entry: entry[:3])
    return sorted(refined + [entry[3] for entry in tasks], key=lambda task: cost(task.recipe))
