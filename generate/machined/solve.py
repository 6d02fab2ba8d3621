"""Truth of one part: contact on the full grid at loads between those of `theory="simulated"`, and flow both ways."""

from __future__ import annotations

import importlib.metadata
from typing import Any

import numpy as np

from generate.machined.makers import Part, heights
from mbma_tables import Surface
from mbma_tables.common.arguments import FloatArray
from mbma_tables.laws.boundary_elements import Contact
from mbma_tables.laws.reynolds import flow_conductance
from mbma_tables.theories.calibrated_curves import own_law

AREAS = (0.003, 0.025, 0.067, 0.14, 0.39, 0.58, 0.78)  # of the quick law, which never refuses them
STEP = 1.03  # of force, of the stiffness
OPEN = 0.45  # A/A0 up to which flow is solved


def surface_of(part: Part) -> tuple[FloatArray, Any]:
    """The map and its surface, sampling step 1."""
    values = heights(part)
    return values, Surface.from_map(values, 1.0, periodic=True)


def loads_at(surface: Any, areas: tuple[float, ...]) -> FloatArray:
    """F/(A0 E*) at which the quick law has these areas."""
    force = np.geomspace(1e-6, 5, 4000) * float(surface.rms_gradient)
    found = np.maximum.accumulate(own_law(surface).area(force)) + 1e-15 * np.arange(force.size)
    return np.asarray(np.exp(np.interp(np.log(areas), np.log(found), np.log(force))))


def solved(part: Part) -> dict[str, Any]:
    """Contact and flow of a part; lengths in sampling steps."""
    values, surface = surface_of(part)
    contact, sizes, rows = Contact(values, values.shape), values.shape, []
    for force in loads_at(surface, AREAS):
        found = contact.press(float(force))
        gap = contact.gap
        beside = contact.press(float(force * STEP))["mean_separation"]
        flow = flow_conductance(gap, sizes) if found["area"] < OPEN else np.full(2, np.nan)
        stiffness = force * (STEP - 1) / (found["mean_separation"] - beside)
        rows.append((force, found["area"], found["mean_separation"], found["energy"], stiffness, *flow))
    names = ("force", "area", "mean_separation", "energy", "stiffness", "flow_x", "flow_y")
    return dict(zip(names, np.array(rows).T, strict=True)) | {
        "engine": f"Tamaas {importlib.metadata.version('tamaas')}"
    }
