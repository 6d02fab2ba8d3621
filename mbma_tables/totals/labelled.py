"""Totals of surfaces and gaps that are DataArrays."""

from __future__ import annotations

from typing import Any

from mbma_tables.labels import apply, refuse_unnamed
from mbma_tables.surfaces.surface import PARAMETERS, Surface

NAMES = ("force", "area", "error")


def contact_of_labelled(
    answer: Any, surface: Surface, separation: Any, E_star: Any, derivatives: bool
) -> dict[str, Any]:
    """Fields of a `Contact` as DataArrays.

    Parameters
    ----------
    answer : callable
        ``answer(surface, separation, E_star)`` gives a `Contact` of plain arrays.
    """
    by = [(kind, name) for kind in ("force", "area") for name in ("separation", *PARAMETERS)] if derivatives else []

    def block(*fields: Any) -> tuple[Any, ...]:
        *numbers, gap, modulus = fields
        found = answer(Surface(*numbers), gap, modulus)
        slopes = (getattr(found, f"{kind}_by")[name] for kind, name in by)
        return tuple(getattr(found, name) for name in NAMES) + tuple(slopes)

    arguments = (*(getattr(surface, name) for name in PARAMETERS), separation, E_star)
    refuse_unnamed(dict(zip((*PARAMETERS, "separation", "E_star"), arguments, strict=True)))
    outputs = apply(block, arguments, len(NAMES) + len(by))
    force, area, error = (found.rename(name) for found, name in zip(outputs, NAMES, strict=False))
    force.attrs = {"long_name": "force over nominal area", "units": "unit of E_star"}
    area.attrs = {"long_name": "real over nominal contact area", "units": "1"}
    error.attrs = {"long_name": "bound on the relative error of force and area", "units": "1"}
    slopes = dict(zip(by, outputs[len(NAMES) :], strict=True))
    return {
        "separation": separation,
        "mean_separation": (surface.h_max + separation) / 2,
        "force": force,
        "area": area,
        "error": error,
        "force_by": {name: value for (kind, name), value in slopes.items() if kind == "force"} or None,
        "area_by": {name: value for (kind, name), value in slopes.items() if kind == "area"} or None,
    }
