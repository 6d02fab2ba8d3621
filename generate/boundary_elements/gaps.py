"""Errors of a gas's conductance against gaps of boundary elements: ``python -m generate.boundary_elements.gaps``.

The constants of `mbma_tables.laws.gas` were chosen by the first set of surfaces, the table of docs/joints.md is of the
second. Three minutes a set on one core.
"""

from __future__ import annotations

import click
import numpy as np

from generate.boundary_elements.capped import CappedContact, load_at
from generate.boundary_elements.solve import prepared
from generate.boundary_elements.surfaces import Recipe, heights
from mbma_tables.laws.gas import mean_inverse

POINTS = 256
JUMPS = np.array([0.03, 0.1, 0.3, 1.0, 3.0])  # [h_rms]
AREAS = (0.003, 0.01, 0.03, 0.1, 0.2, 0.35, 0.55, 0.75)
LIGHT = 0.05  # contact fraction below which k/(u + M) is of use
HARDNESSES = {"fitted": (np.inf, 0.4, 0.1), "held out": (np.inf, 0.8, 0.2, 0.05)}
SURFACES = {
    "fitted": (
        ("self_affine", 0.8, 16, 4, 1), ("self_affine", 0.8, 32, 2, 2), ("self_affine", 0.5, 16, 4, 3),
        ("self_affine", 0.3, 8, 4, 4), ("self_affine", 1.0, 16, 4, 5), ("plateau", 0.8, 8, 8, 6),
        ("self_affine", 0.8, 8, 8, 7), ("self_affine", 0.8, 32, 3, 8), ("plateau", 0.8, 16, 4, 9),
        ("self_affine", 0.5, 32, 2, 10), ("self_affine", 0.9, 12, 4, 11), ("plateau", 0.5, 8, 8, 12),
    ),
    "held out": (
        ("self_affine", 0.7, 20, 3, 101), ("self_affine", 0.6, 12, 5, 102), ("self_affine", 0.9, 32, 2, 103),
        ("self_affine", 0.2, 8, 4, 104), ("self_affine", 0.4, 10, 6, 105), ("plateau", 0.8, 10, 6, 106),
        ("filtered", 0.8, 5, 6, 107), ("self_affine", 0.8, 16, 4, 108), ("self_affine", 0.8, 24, 2, 109),
        ("self_affine", 0.8, 64, 1, 110),
    ),
}  # fmt: skip


def errors(kind: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """ln(law/simulation) by contacts and `JUMPS`, the same of a gap like the mean one, and contact fractions."""
    law, plain, areas = [], [], []
    for numbers in SURFACES[kind]:
        recipe = Recipe(*numbers, POINTS)
        surface, _, _ = prepared(heights(recipe), recipe.sizes, recipe.q0)
        h_rms = float(surface.std())
        for eta in HARDNESSES[kind]:
            contact = CappedContact(surface, recipe.sizes, eta)
            for area in AREAS:
                found = contact.press(load_at(area, eta))
                assert contact.pressure is not None
                open_, gap = contact.pressure <= 0, contact.gap / h_rms
                measured = np.array([(open_ / (gap + jump)).mean() for jump in JUMPS])
                law.append(np.log(mean_inverse(gap.mean(), 1 - open_.mean(), JUMPS, 1.0, eta) / measured))
                plain.append(np.log(1 / (gap.mean() + JUMPS) / measured))
                areas.append(found["area"])
    return np.array(law), np.array(plain), np.array(areas)


if __name__ == "__main__":
    for kind in SURFACES:
        law, plain, areas = errors(kind)
        click.echo(f"{kind}: M/h_rms, root mean square and largest error; largest of k/(u + M) below 5% contact [%]")
        columns = np.sqrt(np.mean(law**2, axis=0)), np.abs(law).max(axis=0), np.abs(plain[areas < LIGHT]).max(axis=0)
        for jump, row in zip(JUMPS, 100 * np.array(columns).T, strict=True):
            click.echo(" ".join([f"{jump:5g}", *(f"{value:6.1f}" for value in row)]))
