"""Truth of one part: contact on the full grid at loads between those of `theory="simulated"`, and flow both ways.

Beside it, what theories answer at these loads. Stiffness is -dF/du by a step of 3% of the pressure, of both alike.
"""

import importlib.metadata
from typing import Any

import numpy as np

from generate.boundary_elements.tamaas_contact import Contact
from generate.machined.makers import Part, heights
from mbma_tables import Surface, contact
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.laws.reynolds import flow_conductance
from mbma_tables.theories.own_map import law_loads
from mbma_tables.theories.saturated import of_map

AREAS = (0.003, 0.025, 0.067, 0.14, 0.39, 0.58, 0.78)  # of the quick law, which never refuses them
STEP = 1.03  # of pressure, of the stiffness
OPEN = 0.45  # A/A0 up to which flow is solved


def surface_of(part: Part) -> tuple[FloatArray, Any]:
    """The map and its surface, sampling step 1."""
    values = heights(part)
    return values, Surface.from_map(values, 1.0, periodic=True)


def solved(part: Part) -> dict[str, Any]:
    """Contact and flow of a part; lengths in sampling steps."""
    values, surface = surface_of(part)
    contact, sizes, rows = Contact(values, values.shape), values.shape, []
    for pressure in law_loads(surface, AREAS):
        found = contact.press(float(pressure))
        gap = contact.gap
        beside = contact.press(float(pressure * STEP))["mean_separation"]
        flow = flow_conductance(gap, sizes) if found["area"] < OPEN else np.full(2, np.nan)
        stiffness = pressure * (STEP - 1) / (found["mean_separation"] - beside)
        rows.append((pressure, found["area"], found["mean_separation"], found["energy"], stiffness, *flow))
    names = ("pressure", "area", "mean_separation", "energy", "stiffness", "flow_x", "flow_y")
    return dict(zip(names, np.array(rows).T, strict=True)) | {
        "engine": f"Tamaas {importlib.metadata.version('tamaas')}"
    }


def answered(part: Part, theory: str, truth: dict[str, Any]) -> dict[str, Any]:
    """A theory's answers at the loads of the truth, with its stated scatter; NaN where it refuses."""
    _, surface = surface_of(part)
    names = ["area", "mean_separation", "stiffness", "flow_x", "flow_y"]
    names += [f"{name}_scatter" for name in ("pressure", "area", "stiffness", "flow")]
    names += ["valid", "flow_valid", "sensitivity"]
    rows = np.full((len(names), truth["pressure"].size), np.nan)
    for k, pressure in enumerate(map(float, truth["pressure"])):
        try:
            found, beside = (contact(surface, pressure=by * pressure, theory=theory) for by in (1.0, STEP))
        except OutOfRangeError:
            rows[[names.index("valid"), names.index("flow_valid")], k] = 0
            continue
        stiffness = pressure * (STEP - 1) / (found.mean_separation - beside.mean_separation)
        leakage = found.leakage
        of_it = (found.scatter, found.area_scatter, found.stiffness_scatter, leakage.scatter, found.valid)
        sensitivity = np.nan if theory == "calibrated" else of_map(theory, surface).sensitivity
        answer = found.area, found.mean_separation, stiffness, leakage.x, leakage.y
        rows[:, k] = *answer, *of_it, leakage.valid, sensitivity
    return dict(zip(names, rows, strict=True))
