"""Errors of a gas's conductance against gaps of boundary elements: ``python -m generate.boundary_elements.gaps``.

The constants of `mbma_tables.laws.gas` were chosen by the first set of surfaces, the table of docs/joints.md is of the
second. Three minutes a set on one core.
"""

from __future__ import annotations

from typing import Any

import click
import numpy as np

from generate.boundary_elements.capped import CappedContact, load_at
from generate.boundary_elements.solve import prepared
from generate.boundary_elements.surfaces import Recipe, heights
from mbma_tables import Surface, contact
from mbma_tables.laws.gas import mean_inverse

POINTS = 256
JUMPS = np.array([0.03, 0.1, 0.3, 1.0, 3.0])  # [h_rms]
AREAS = (0.003, 0.01, 0.03, 0.1, 0.2, 0.35, 0.55, 0.75)
LIGHT, HEAVY = 0.05, 0.3  # contact fractions
MANY = 3  # long waves a side from which the highest point is a surface's, not a map's
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


def errors(kind: str) -> dict[str, np.ndarray]:
    """ln(law/simulation) by contacts and `JUMPS`: with the simulated contact, with one gap for all, of the whole chain.

    The chain, from pressure and hardness by the calibrated law, is that of self-affine surfaces, else NaN.
    """
    found: dict[str, list[Any]] = {"law": [], "one gap": [], "chain": [], "area": [], "waves": []}
    for numbers in SURFACES[kind]:
        recipe = Recipe(*numbers, POINTS)
        surface, _, known = prepared(heights(recipe), recipe.sizes, recipe.q0)
        h_rms = float(surface.std())
        like = Surface(recipe.hurst, recipe.q0, recipe.q0 * recipe.zeta_1, h_rms, known["h_max"] * h_rms)
        for eta in HARDNESSES[kind]:
            solved = CappedContact(surface, recipe.sizes, eta)
            for load in (load_at(area, eta) for area in AREAS):
                found["area"].append(solved.press(load)["area"])
                found["waves"].append(recipe.waves)
                assert solved.pressure is not None
                open_, gap = solved.pressure <= 0, solved.gap / h_rms
                measured = np.array([(open_ / (gap + jump)).mean() for jump in JUMPS])
                law = mean_inverse(gap.mean(), 1 - open_.mean(), JUMPS, 1.0, eta)
                found["law"].append(np.log(law / measured))
                found["one gap"].append(np.log(1 / (gap.mean() + JUMPS) / measured))
                chain = np.full(JUMPS.size, np.nan)
                if recipe.kind == "self_affine":
                    own = contact(like, pressure=load, theory="calibrated", hardness=eta)
                    chain = mean_inverse(float(own.mean_separation) / h_rms, float(own.area), JUMPS, 1.0, eta)
                found["chain"].append(np.log(chain / measured))
    return {name: np.array(rows) for name, rows in found.items()}


if __name__ == "__main__":
    for kind in SURFACES:
        known = errors(kind)
        light, many = known["area"] < LIGHT, (known["waves"] >= MANY) & (known["area"] < HEAVY)
        click.echo(f"{kind}: M/h_rms; root mean square and largest error; largest of k/(u + M) below 5% contact;")
        click.echo("mean and standard deviation of the chain, from three long waves a side on, below 30% contact [%]")
        columns = [np.sqrt(np.mean(known["law"] ** 2, axis=0)), np.abs(known["law"]).max(axis=0)]
        columns += [np.abs(known["one gap"][light]).max(axis=0)]
        columns += [np.nanmean(known["chain"][many], axis=0), np.nanstd(known["chain"][many], axis=0)]
        for jump, row in zip(JUMPS, 100 * np.array(columns).T, strict=True):
            click.echo(" ".join([f"{jump:5g}", *(f"{value:6.1f}" for value in row)]))
