"""Reynolds' equation on the gaps of boundary elements."""

from __future__ import annotations

import importlib.metadata
from typing import Any

import numpy as np

from generate.boundary_elements.capped import CappedContact, load_at
from generate.boundary_elements.solve import Contact, prepared
from generate.boundary_elements.surfaces import Recipe, heights
from mbma_tables.laws.reynolds import flow_conductance

# F/(A0 E* g): 0.5% to 42% contact, where the last cells are blocked
LOADS = (0.0025, 0.005, 0.01, 0.02, 0.035, 0.055, 0.08, 0.105, 0.13, 0.155, 0.18, 0.2, 0.22)
FEW_LOADS = (0.005, 0.02, 0.055, 0.08, 0.105, 0.13, 0.155)  # of the largest grids
AREAS = (0.01, 0.03, 0.06, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4)  # that loads of surfaces that yield aim at
LARGE = 1024
QUANTITIES = ("area", "area_raw", "mean_separation", "residual", "seconds")


def solve_flow(recipe: Recipe) -> dict[str, Any]:
    """Contact and flow coefficient of one surface up to its blocking: lengths in h_rms, force in A0 E* g."""
    surface, spectrum, known = prepared(heights(recipe), recipe.sizes, recipe.q0)
    h_rms = float(surface.std())
    contact: Contact | CappedContact = Contact(surface, recipe.sizes)
    loads: tuple[float, ...] = FEW_LOADS if recipe.points >= LARGE else LOADS
    if recipe.kind == "yielded":
        contact, loads = (
            CappedContact(surface, recipe.sizes, recipe.shape),
            tuple(load_at(area, recipe.shape) for area in AREAS),
        )
    rows, flows, forces = [], [], []
    for force in loads:
        result = contact.press(force)
        flows.append(flow_conductance(contact.gap / h_rms, recipe.sizes))
        forces.append(force)
        rows.append([result[name] for name in QUANTITIES])
        if not flows[-1].any():
            break
    length = np.array([1, 1, h_rms, h_rms, 1])
    held = spectrum.variance > 0
    return {
        **dict(zip(QUANTITIES, (np.array(rows) / length).T, strict=True)),
        "force": np.array(forces),
        "flow": np.array(flows),
        **known,
        "band_q": np.where(held, spectrum.q / recipe.q0, np.nan),
        "engine": f"Tamaas {importlib.metadata.version('tamaas')}",
    }
