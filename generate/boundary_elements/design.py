"""The campaign: which surfaces, in which order, and which of them no fit may see.

Nodes are spectra (with a transform where there is one). Those marked held out are never fitted, nor is the second
surface of every other node; so a law is tested on new surfaces of known spectra and on spectra of its own.
"""

from __future__ import annotations

import dataclasses
import itertools
import zlib
from collections.abc import Iterable, Iterator

from generate.boundary_elements.surfaces import Recipe

TRAINING, HELD_OUT_SURFACE, HELD_OUT_SPECTRUM, REFINEMENT = (
    "training",
    "held_out_surface",
    "held_out_spectrum",
    "refine",
)
SPLITS = (TRAINING, HELD_OUT_SURFACE, HELD_OUT_SPECTRUM, REFINEMENT)


@dataclasses.dataclass(frozen=True)
class Node:
    """A spectrum, how many surfaces of it, and whether fits may see it."""

    recipe: Recipe
    surfaces: int
    held_out: bool


@dataclasses.dataclass(frozen=True)
class Task:
    """A surface to solve and the set that it belongs to."""

    recipe: Recipe
    split: str


def _nodes(
    kind: str, hursts: str, bands: str, points: int, surfaces: int, shapes: str = "0", held_out: bool = False
) -> Iterator[Node]:
    """Nodes over all combinations; bands as "zeta_1xwaves"."""
    for hurst, band, shape in itertools.product(hursts.split(), bands.split(), shapes.split()):
        zeta_1, waves = band.split("x")
        yield Node(Recipe(kind, float(hurst), float(zeta_1), int(waves), 0, points, float(shape)), surfaces, held_out)


def nodes() -> list[Node]:
    """All nodes: four points a shortest wave, eight where heights are transformed."""
    small = [
        *_nodes("self_affine", "0.2 0.4 0.6 0.8 1", "8x8 16x4 32x2", 256, 4),
        *_nodes("self_affine", "0.4 0.8", "64x1", 256, 2),
        *_nodes("self_affine", "0.3 0.5 0.7 0.9", "12x5 21x3", 256, 2, held_out=True),
        *_nodes("plateau", "0.4 0.8", "8x8 16x4", 256, 2),
        *_nodes("plateau", "0.6 1", "12x5", 256, 2, held_out=True),
        *_nodes("filtered", "0.4 0.8", "8x4 16x2", 256, 2),
        *_nodes("filtered", "0.6 1", "10x3", 256, 2, held_out=True),
        *_nodes("stretched", "0.4 0.8", "16x4", 256, 2, "2 4 8 16"),
        *_nodes("stretched", "0.6", "12x5", 256, 2, "3 6 12", held_out=True),
        *_nodes("peaks", "0.4 0.8", "8x4", 256, 2, "0.25 0.5"),
        *_nodes("valleys", "0.4 0.8", "8x4", 256, 2, "0.25 0.5"),
        *_nodes("worn", "0.4 0.8", "8x4", 256, 2, "0.001 1"),
        *_nodes("patchy", "0.4 0.8", "8x4", 256, 2, "0.3 0.6"),
        *_nodes("peaks", "0.6", "16x2", 256, 2, "0.35", held_out=True),
        *_nodes("valleys", "0.6", "16x2", 256, 2, "0.35", held_out=True),
        *_nodes("worn", "0.6", "16x2", 256, 2, "0.5", held_out=True),
        *_nodes("patchy", "0.6", "16x2", 256, 2, "0.45", held_out=True),
    ]
    middle = [
        *_nodes("self_affine", "0.2 0.4 0.6 0.8 1", "16x8 32x4 64x2", 512, 2),
        *_nodes("self_affine", "0.6 0.8", "128x1", 512, 1),
        *_nodes("self_affine", "0.3 0.7 0.9", "24x5 42x3", 512, 1, held_out=True),
        *_nodes("plateau", "0.4 0.8", "16x8 32x4", 512, 1),
        *_nodes("plateau", "0.6 1", "24x5", 512, 1, held_out=True),
        *_nodes("filtered", "0.8", "16x4 32x2", 512, 1),
        *_nodes("filtered", "0.6", "21x3", 512, 1, held_out=True),
        *_nodes("stretched", "0.8", "32x4", 512, 1, "4 16"),
        *_nodes("stretched", "0.6", "24x5", 512, 1, "8", held_out=True),
        *_nodes("peaks", "0.8", "16x4", 512, 1, "0.5"),
        *_nodes("valleys", "0.8", "16x4", 512, 1, "0.5"),
        *_nodes("worn", "0.8", "16x4", 512, 1, "0.001 1"),
        *_nodes("patchy", "0.8", "16x4", 512, 1, "0.6"),
    ]
    large = [
        *_nodes("self_affine", "0.4 0.8", "32x8 64x4 128x2", 1024, 1),
        *_nodes("self_affine", "0.6", "85x3 256x1", 1024, 1, held_out=True),
        *_nodes("plateau", "0.8", "64x4", 1024, 1, held_out=True),
    ]
    return small + middle + large


def hardness_nodes() -> list[Node]:
    """Nodes solved with a cap on pressure."""
    return [
        *_nodes("self_affine", "0.2 0.4 0.6 0.8 1", "8x8 16x4 32x2", 256, 2),
        *_nodes("self_affine", "0.3 0.5 0.7 0.9", "12x5 21x3", 256, 1, held_out=True),
        *_nodes("plateau", "0.4 0.8", "8x8 16x4", 256, 2),
        *_nodes("plateau", "0.6 1", "12x5", 256, 1, held_out=True),
        *_nodes("filtered", "0.4 0.8", "8x4", 256, 1),
        *_nodes("filtered", "0.6", "10x3", 256, 1, held_out=True),
        *_nodes("stretched", "0.6", "12x5", 256, 1, "3 6", held_out=True),
        *_nodes("self_affine", "0.3 0.5 0.8", "64x2", 512, 2),
        *_nodes("self_affine", "0.4 0.7 0.9", "42x3", 512, 1, held_out=True),
        *_nodes("plateau", "0.6", "24x5", 512, 1, held_out=True),
        *_nodes("self_affine", "0.5 0.8", "128x2", 1024, 1),
        *_nodes("self_affine", "0.7", "85x3", 1024, 1, held_out=True),
    ]


def leakage_nodes() -> list[Node]:
    """Nodes whose gaps are solved for flow: four surfaces tell how far cells of one spectrum differ."""
    return [
        *_nodes("self_affine", "0.2 0.4 0.6 0.8 1", "8x8 16x4", 256, 4),
        *_nodes("self_affine", "0.4 0.8", "32x2", 256, 2),
        *_nodes("self_affine", "0.3 0.5 0.7 0.9", "12x5", 256, 3, held_out=True),
        *_nodes("plateau", "0.4 0.8", "8x8 16x4", 256, 2),
        *_nodes("plateau", "0.6 1", "12x5", 256, 2, held_out=True),
        *_nodes("stretched", "0.8", "16x4", 256, 2, "2 4"),
        *_nodes("stretched", "0.6", "12x5", 256, 1, "3", held_out=True),
        *_nodes("yielded", "0.4 0.8", "16x4", 256, 1, "0.05 0.2", held_out=True),
        *_nodes("self_affine", "0.4 0.6 0.8", "32x4", 512, 2),
        *_nodes("self_affine", "0.4 0.8", "64x2", 512, 2),
        *_nodes("self_affine", "0.3 0.7 0.9", "24x5", 512, 1, held_out=True),
        *_nodes("self_affine", "0.4 0.8", "64x4", 1024, 1, held_out=True),
        *_nodes("self_affine", "0.8", "128x2", 1024, 1, held_out=True),
    ]


def refinement(kind: str = "elastic") -> list[Recipe]:
    """The same surfaces on grids of 2 to 32 points a shortest wave, at most 512 points a side."""
    surfaces = {
        "elastic": [
            Recipe("self_affine", 0.3, 8, 2, 901, 0),
            Recipe("self_affine", 0.8, 8, 2, 902, 0),
            Recipe("self_affine", 0.8, 16, 2, 903, 0),
            Recipe("plateau", 0.6, 4, 4, 904, 0),
            Recipe("stretched", 0.8, 8, 2, 905, 0, 4.0),
            Recipe("peaks", 0.8, 8, 2, 906, 0, 0.5),
            Recipe("worn", 0.8, 8, 2, 907, 0, 0.001),
        ],
        "hardness": [
            Recipe("self_affine", 0.3, 8, 2, 911, 0),
            Recipe("self_affine", 0.8, 8, 2, 912, 0),
            Recipe("plateau", 0.6, 4, 4, 913, 0),
        ],
        "leakage": [],
    }
    return [
        dataclasses.replace(surface, points=points)
        for points in (64, 128, 256, 512)
        for surface in surfaces[kind]
        if points > 2 * surface.band[1]
    ]


def cost(recipe: Recipe) -> float:
    """Grid points a side, more where stretching makes the equations ill-conditioned."""
    return recipe.points * (max(1.0, recipe.shape / 4) if recipe.kind == "stretched" else 1.0)


def campaign(kind: str = "elastic") -> list[Task]:
    """Every surface to solve, cheap ones first and kinds in turn, so that stopping early leaves a balanced set.

    `kind` is elastic, hardness (pressures are capped) or leakage (gaps are solved for flow).
    """
    chosen = {"elastic": nodes, "hardness": hardness_nodes, "leakage": leakage_nodes}[kind]
    repeated = [Task(recipe, REFINEMENT) for recipe in refinement(kind)]
    return sorted(repeated + tasks_of(chosen()), key=lambda task: cost(task.recipe))


def tasks_of(chosen: Iterable[Node]) -> list[Task]:
    """Surfaces of nodes, cheap ones first."""
    tasks = []
    for node in chosen:
        for turn in range(node.surfaces):
            split = HELD_OUT_SPECTRUM if node.held_out else HELD_OUT_SURFACE if turn == 1 else TRAINING
            # of the spectrum alone, so that a longer list moves no seed; its order mixes the kinds
            seed = zlib.crc32(node.recipe.name.encode()) % 10_000_000 * 100 + turn
            recipe = dataclasses.replace(node.recipe, seed=seed)
            tasks.append((cost(recipe), turn, seed, Task(recipe, split)))
    tasks.sort(key=lambda entry: entry[:3])
    return [entry[3] for entry in tasks]
