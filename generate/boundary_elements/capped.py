"""The campaign of contacts with a hardness, and that of flow, by the library's own boundary elements.

Tamaas has pressures capped at a hardness too (KatoSaturated), but its iteration always runs to its limit.
"""

from __future__ import annotations

import importlib.metadata
from typing import Any

import numpy as np
from scipy.special import erfinv

from generate.boundary_elements.solve import Contact, prepared
from generate.boundary_elements.surfaces import Recipe, heights
from mbma_tables.laws import boundary_elements
from mbma_tables.laws.reynolds import flow_conductance

HARDNESSES = (0.025, 0.05, 0.1, 0.2, 0.4, 0.8, np.inf)  # eta = p_m/(E* g)
AREAS = (0.003, 0.006, 0.012, 0.025, 0.05, 0.1, 0.18, 0.3, 0.45, 0.6, 0.75, 0.9)  # that loads aim at
QUANTITIES = (
    *("area", "area_raw", "area_yielded", "area_yielded_raw", "mean_separation", "plane_separation", "energy"),
    *("frozen_stiffness", "residual", "iterations", "seconds"),
)

# of flow, F/(A0 E* g): 0.5% to 42% contact, where the last cells are blocked; and of the largest grids
FLOW_LOADS = (0.0025, 0.005, 0.01, 0.02, 0.035, 0.055, 0.08, 0.105, 0.13, 0.155, 0.18, 0.2, 0.22)
FEW_LOADS = (0.005, 0.02, 0.055, 0.08, 0.105, 0.13, 0.155)
FLOW_AREAS = (0.01, 0.03, 0.06, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4)  # that loads of surfaces that yield aim at
LARGE = 1024
OF_FLOW = ("area", "area_raw", "mean_separation", "residual", "seconds")


def load_at(area: float, eta: float) -> float:
    """F/(A0 E* g) at about that A/A0, below eta."""
    elastic = float(erfinv(area)) * np.sqrt(0.3 + 0.2 * area)
    return float(((eta * area) ** -2.0 + elastic**-2.0) ** -0.5)


def simulate_capped(recipe: Recipe) -> dict[str, Any]:
    """All that is kept of one surface: lengths in h_rms, force in A0 E* g, rows for `HARDNESSES`, columns for loads."""
    surface, _, known = prepared(heights(recipe), recipe.sizes, recipe.q0)
    h_rms = float(surface.std())
    units = {"mean_separation": h_rms, "plane_separation": h_rms, "energy": h_rms, "frozen_stiffness": 1 / h_rms}
    found = np.empty((len(QUANTITIES), len(HARDNESSES), len(AREAS)))
    forces = np.array([[load_at(area, eta) for area in AREAS] for eta in HARDNESSES])
    for row, eta in enumerate(HARDNESSES):
        contact = boundary_elements.Contact(surface, recipe.sizes, hardness=eta)
        for column, force in enumerate(forces[row]):
            result = contact.press(force)
            result["frozen_stiffness"] = contact.frozen_stiffness()
            found[:, row, column] = [result[name] / units.get(name, 1.0) for name in QUANTITIES]
    return {**dict(zip(QUANTITIES, found, strict=True)), **known, "force": forces, "engine": "conjugate gradients here"}


def solve_flow(recipe: Recipe) -> dict[str, Any]:
    """Contact and flow coefficient, by Reynolds' equation, of one surface up to its blocking: lengths in h_rms."""
    surface, spectrum, known = prepared(heights(recipe), recipe.sizes, recipe.q0)
    h_rms = float(surface.std())
    contact: Any = Contact(surface, recipe.sizes)
    loads: tuple[float, ...] = FEW_LOADS if recipe.points >= LARGE else FLOW_LOADS
    if recipe.kind == "yielded":
        contact = boundary_elements.Contact(surface, recipe.sizes, hardness=recipe.shape)
        loads = tuple(load_at(area, recipe.shape) for area in FLOW_AREAS)
    rows, flows = [], []
    for force in loads:
        result = contact.press(force)
        flows.append(flow_conductance(contact.gap / h_rms, recipe.sizes))
        rows.append([result[name] for name in OF_FLOW])
        if not flows[-1].any():
            break
    length = np.array([1, 1, h_rms, h_rms, 1])
    held = spectrum.variance > 0
    return {
        **dict(zip(OF_FLOW, (np.array(rows) / length).T, strict=True)),
        "force": np.array(loads[: len(flows)]),
        "flow": np.array(flows),
        **known,
        "band_q": np.where(held, spectrum.q / recipe.q0, np.nan),
        "engine": f"Tamaas {importlib.metadata.version('tamaas')}",
    }
