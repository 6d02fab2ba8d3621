"""Totals of surfaces and gaps that are DataArrays."""

from __future__ import annotations

from typing import Any

from mbma_tables.labels import apply, refuse_unnamed
from mbma_tables.surfaces.surface import PARAMETERS, Surface

ATTRIBUTES = {
    "force": {"long_name": "force over nominal area", "units": "unit of E_star"},
    "area": {"long_name": "real over nominal contact area", "units": "1"},
    "error": {"long_name": "bound on the relative error of force and area", "units": "1"},
}


def contact_of_labelled(
    answer: Any, surface: Surface, separation: Any, E_star: Any, derivatives: bool, quantities: tuple[str, ...]
) -> dict[str, Any]:
    """Fields of a `Contact` as DataArrays.

    Parameters
    ----------
    answer : callable
        ``answer(surface, separation, E_star)`` gives a `Contact` of plain arrays.
    """
    by = [(kind, name) for kind in quantities for name in ("separation", *PARAMETERS)] if derivatives else []
    names = (*quantities, "error")

    def block(*fields: Any) -> tuple[Any, ...]:
        *numbers, gap, modulus = fields
        found = answer(Surface(*numbers), gap, modulus)
        slopes = (getattr(found, f"{kind}_by")[name] for kind, name in by)
        return tuple(getattr(found, name) for name in names) + tuple(slopes)

    arguments = (*(getattr(surface, name) for name in PARAMETERS), separation, E_star)
    refuse_unnamed(dict(zip((*PARAMETERS, "separation", "E_star"), arguments, strict=True)))
    outputs = apply(block, arguments, len(names) + len(by))
    fields: dict[str, Any] = {"force": None, "area": None}
    for found, name in zip(outputs, names, strict=False):
        fields[name] = found.rename(name)
        fields[name].attrs = dict(ATTRIBUTES[name])
    slopes = dict(zip(by, outputs[len(names) :], strict=True))
    return fields | {
        "separation": separation,
        "mean_separation": (surface.h_max + separation) / 2,
        "force_by": {name: value for (kind, name), value in slopes.items() if kind == "force"} or None,
        "area_by": {name: value for (kind, name), value in slopes.items() if kind == "area"} or None,
    }
