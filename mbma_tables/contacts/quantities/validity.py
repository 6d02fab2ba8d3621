"""Why contacts are not valid: masks of entries by reason, of arrays of any kind."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mbma_tables.bodies.materials import ELASTIC_PSI, HARDEST
from mbma_tables.common.arguments import FloatArray, any_labelled
from mbma_tables.common.units import factor
from mbma_tables.contacts.quantities.state import State
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.theories.base import Theory, TheoryAnswer

# masks by reason, of theory, surface, mean separations, modulus and more arrays
Reasons = Callable[..., Mapping[str, Any]]
# larger rms gradients suggest that heights and wavenumbers are in different units
MAX_GRADIENT = 1.0


def valid_where_none(contact: State, reasons: Reasons, more: Mapping[str, Any]) -> Any:
    """True where no reason applies."""

    def none_applies(*arguments: Any) -> tuple[FloatArray]:
        masks = list(reasons(*arguments).values())
        return (np.asarray(~np.logical_or.reduce(masks), dtype=float),)

    return contact.evaluate(none_applies, 1, more)[0].astype(bool)


def reasons_with_masks(
    contact: State, reasons: Reasons, more: Mapping[str, Any]
) -> dict[str, Any]:
    """The reasons that apply anywhere, with their masks as plain arrays."""
    surface = contact.surface
    bodies = contact.bodies
    own = bodies.numbers.values()
    fields = [contact.mean_separation, *own, *more.values()]
    is_labelled = any_labelled(surface, *fields)
    if is_labelled:
        import xarray as xr

        numbers_of_surface = list(surface.numbers().values())
        arrays = xr.broadcast(*map(xr.DataArray, [*fields, *numbers_of_surface]))
        plain = [np.asarray(array) for array in arrays]
        fields = plain[: len(fields)]
        if numbers_of_surface:
            surface = surface.with_numbers(*plain[len(fields) :])
    u, *others = map(np.asarray, fields)
    one = bodies.at(*others[: len(own)]) if is_labelled else bodies
    theory = contact.theory_of(one)
    masks = reasons(theory, surface, u, np.asarray(one.E_star), *others[len(own) :])
    return {reason: mask for reason, mask in masks.items() if mask.any()}


def reasons_of_contact(
    contact: State,
    theory: Theory,
    surface: AnySurface,
    u: FloatArray,
    E_star: FloatArray,
    *fields: FloatArray,
) -> dict[str, Any]:
    """Every reason why a contact by a theory, perhaps with a hardness, is not valid, with its mask."""
    answer = TheoryAnswer(*fields)
    shape = np.shape(answer.pressure)
    is_steep = np.broadcast_to(np.asarray(surface.rms_gradient) > MAX_GRADIENT, shape)
    everywhere = np.ones(shape, dtype=bool)
    scatter = theory.scatter(surface, "pressure", answer.area)
    no_scatter = (
        f"the model uncertainty of theory {theory.name!r} is not known for such contacts"
    )
    reasons = {
        "the rms gradient is above 1: are heights and wavenumbers in one unit?": is_steep,
        **dict.fromkeys(theory.elastic.departures(surface), everywhere),
        **theory.reasons(surface, answer, u),
    }
    # what no simulation was compared with is not tested, whatever else is known of it
    is_unexplained = np.isnan(scatter) & (answer.area > 0)
    if is_unexplained.any():
        explained = np.logical_or.reduce([*reasons.values(), np.zeros(shape, bool)])
        reasons[no_scatter] = is_unexplained & ~explained
    return reasons | _reasons_of_bodies(contact, theory, surface, E_star, answer)


def _reasons_of_bodies(
    contact: State,
    theory: Theory,
    surface: AnySurface,
    E_star: FloatArray,
    answer: TheoryAnswer,
) -> dict[str, Any]:
    """Elastic contacts with pressures that the named metals (without names: any metal) do not support."""
    bodies = contact.bodies
    stress = bodies.units.stress
    if stress in (None, "1") or (bodies.pair is None and bodies.hardness_is_given):
        return {}
    gigapascal = factor("GPa", str(stress), "stress")
    with np.errstate(invalid="ignore"):
        mean_pressure = E_star * answer.pressure / answer.area
    is_elastic = np.isinf(getattr(theory, "hardness", np.inf)) & (answer.pressure > 0)
    if bodies.pair is None:
        text = (
            f"no hardness is given, and the mean contact pressure is above {HARDEST:g} GPa, that of the hardest metal "
            "in materials.METALS: give Bodies(..., hardness=) of the softer body, or infinity where it does not yield"
        )
        return {text: is_elastic & (mean_pressure > HARDEST * gigapascal)}
    softer = bodies.pair.softer
    soft = softer.hardness[0]
    yields = E_star * np.asarray(surface.rms_gradient) > ELASTIC_PSI * soft * gigapascal
    text = f"{softer.name} yields here: give {bodies.pair.remedy}"
    return {text: is_elastic & (yields | (mean_pressure > soft * gigapascal))}
