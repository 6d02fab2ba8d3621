"""The exact islands that tables are made of: log ratios to the rigid sphere, as chunks of a campaign."""

from __future__ import annotations

import numpy as np

from generate.tables.campaign import Campaign, split
from mbma_tables.arguments import FloatArray
from mbma_tables.islands import greenwood_tripp
from mbma_tables.tablefiles.provenance import SOLVER, digest_json, physics_digest

CHUNK = 2000
# what decides a chunk's bits: the physics, and how node counts and starts are chosen
CODE = (*SOLVER, "mbma_tables.islands.greenwood_tripp", "generate.tables.solves")


def log_ratio(X: FloatArray, mu: FloatArray, rtol: float, refinement: int = 1) -> FloatArray:
    """log(Phi/Phi_rigid) at flat (X, mu), shape (entries, 2), on `refinement` times the nodes that `rtol` asks."""
    solved = greenwood_tripp.solve(X, mu, rtol=rtol)
    phi = np.stack([solved.phi_F, solved.phi_A], axis=-1)
    if refinement > 1:
        for nodes in np.unique(solved.nodes):
            same = solved.nodes == nodes
            finer = greenwood_tripp.solve(X[same], mu[same], rtol=rtol, nodes=refinement * int(nodes))
            phi[same] = np.stack([finer.phi_F, finer.phi_A], axis=-1)
    ratio: FloatArray = np.log(phi / greenwood_tripp.rigid_sphere(X, mu).T)
    return ratio


def solve_all(
    campaign: Campaign, label: str, X: FloatArray, mu: FloatArray, rtol: float, refinement: int = 1
) -> FloatArray:
    """`log_ratio` of arrays of any one shape, through a campaign; shape (..., 2)."""
    identity = digest_json([physics_digest(CODE), rtol, refinement])
    flat = [np.ascontiguousarray(array, dtype=float).ravel() for array in (X, mu)]
    parts = campaign.run(label, identity, log_ratio, split(CHUNK, *flat), (rtol, refinement))
    return np.concatenate(parts).reshape((*np.shape(X), 2))
