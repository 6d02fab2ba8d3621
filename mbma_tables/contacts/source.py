"""Common parts of contacts and laws: meanings of quantities, the source of a contact, reasons against validity."""

from __future__ import annotations

import collections
import dataclasses
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mbma_tables.common.arguments import (
    FloatArray,
    Numbers,
    any_labelled,
    broadcast_shape,
    checked_hardness,
    is_labelled,
)
from mbma_tables.common.display import shown
from mbma_tables.common.units import Units, factor, unit_of
from mbma_tables.materials import ELASTIC_PSI, HARDEST, Pair
from mbma_tables.surfaces.any_surface import AnySurface, apply_to_surface
from mbma_tables.theories.base import Theory, TheoryAnswer

if TYPE_CHECKING:
    from mbma_tables.theories.yielding.theory import Loaded

MEANINGS = {
    "separation": "d, rigid plane to mid-plane",
    "mean_separation": "u = (h_max + d)/2",
    "pressure": "force over nominal area",
    "area": "real over nominal contact area",
    "stiffness": "-dF/du per nominal area",
    "energy": "elastic energy per nominal area",
    "mean_pressure": "mean pressure in the contact",
    "yielded": "share of the contact area at the hardness",
    "unloading_stiffness": "-dF/du per nominal area of a small unloading",
    "plane_separation": "gap between mean planes",
    "error": "bound on the relative numerical error against the theory",
    "scatter": "model uncertainty: standard deviation of ln F at this mean separation",
    "area_scatter": "model uncertainty: standard deviation of ln A at this pressure",
    "stiffness_scatter": "model uncertainty: standard deviation of ln of the stiffness at this pressure",
    "unloading_stiffness_scatter": "model uncertainty: standard deviation of ln of the unloading stiffness, "
    "and of the conductance, at this pressure",
    "separation_scatter": "model uncertainty: standard deviation of the mean separation at this pressure",
    "valid": "whether the theory was tested for such contacts",
}
# larger rms gradients suggest that heights and wavenumbers are in different units
MAX_GRADIENT = 1.0


def named(value: Any, name: str, units: Units) -> Any:
    """A quantity of a contact; a DataArray gets its name, meaning and unit."""
    if not is_labelled(value):
        return value
    return value.rename(name).assign_attrs(
        long_name=MEANINGS[name], units=unit_of(name, units)
    )


Against = Callable[..., dict[str, Any]]


@dataclasses.dataclass(frozen=True, eq=False)
class Source:
    """Inputs of a `Contact`, for quantities that are computed on access."""

    theory: Theory
    surface: AnySurface
    E_star: Any
    hardness: Any
    units: Units
    yields: bool  # whether a hardness is given, and not an infinite one
    answer: TheoryAnswer | None = None  # if computed already
    loaded: Loaded | None = None  # the same with a hardness
    materials: Pair | None = None  # if named
    stated: bool = False  # whether the hardness is, infinite or not

    def theory_at(self, E_star: Any, hardness: Any) -> Theory:
        """The theory, with the hardness where there is one."""
        if not self.yields:
            return self.theory
        broadcast_shape(E_star=E_star, hardness=hardness)
        return self.theory.with_hardness(checked_hardness(hardness), E_star)

    def map(
        self,
        function: Callable[..., tuple[Any, ...]],
        contact: Any,
        outputs: int,
        more: Any = None,
    ) -> tuple[Numbers, ...]:
        """``function(theory, surface, u, E_star, *more)``, a tuple, of the contact's entries."""
        arrays = {
            "mean_separation": contact.mean_separation,
            "E_star": self.E_star,
            "hardness": self.hardness,
        }
        arrays |= more or {}

        def block(
            surface: AnySurface, u: Any, E_star: Any, hardness: Any, *others: Any
        ) -> tuple[Any, ...]:
            return function(self.theory_at(E_star, hardness), surface, u, E_star, *others)

        if any_labelled(self.surface, *arrays.values()):
            found: tuple[Numbers, ...] = apply_to_surface(
                block, self.surface, arrays, outputs
            )
            return found
        return tuple(
            part[()] for part in block(self.surface, *map(np.asarray, arrays.values()))
        )

    def valid(self, contact: Any, against: Against, more: Mapping[str, Any]) -> Numbers:
        """True where none of the reasons (masks by text) of ``against(theory, surface, u, E_star, *more)`` applies."""

        def none(*given: Any) -> tuple[FloatArray]:
            return (
                np.asarray(
                    ~np.logical_or.reduce(list(against(*given).values())), dtype=float
                ),
            )

        return self.map(none, contact, 1, more)[0].astype(bool)

    def reasons(
        self, contact: Any, against: Against, more: Mapping[str, Any]
    ) -> dict[str, Any]:
        """The same reasons with their masks, plain arrays, where any entry has them."""
        surface, fields = (
            self.surface,
            [contact.mean_separation, self.E_star, self.hardness, *more.values()],
        )
        if any_labelled(surface, *fields):
            import xarray as xr

            own = [getattr(surface, name) for name in surface.parameters]
            fields = list(
                map(np.asarray, xr.broadcast(*map(xr.DataArray, [*fields, *own])))
            )
            surface = surface.with_numbers(*fields[3 + len(more) :]) if own else surface
        u, E_star, hardness, *known = map(np.asarray, fields[: 3 + len(more)])
        found = against(self.theory_at(E_star, hardness), surface, u, E_star, *known)
        return {reason: mask for reason, mask in found.items() if mask.any()}


def reasons_against(
    source: Source,
    theory: Theory,
    surface: AnySurface,
    u: FloatArray,
    E_star: FloatArray,
    *known: FloatArray,
) -> dict[str, Any]:
    """Every reason why results of a source's theory, perhaps with a hardness, are not valid, with its mask."""
    answer = TheoryAnswer(*known)
    steep = np.broadcast_to(
        np.asarray(surface.rms_gradient) > MAX_GRADIENT, np.shape(answer.pressure)
    )
    text = "the rms gradient is above 1: are heights and wavenumbers in one unit?"
    measured = dict.fromkeys(
        theory.elastic.departures(surface), np.ones(np.shape(answer.pressure), dtype=bool)
    )
    found = {text: steep, **measured, **theory.reasons(surface, answer, u)}
    # elastic contacts with pressures that the named metals (without names: any metal) do
    # not support
    stress, pair = source.units.stress, source.materials
    if stress in (None, "1") or (pair is None and source.stated):
        return found
    unit = factor("GPa", stress, "stress")
    with np.errstate(invalid="ignore"):
        mean = E_star * answer.pressure / answer.area
    elastic = np.isinf(getattr(theory, "hardness", np.inf)) & (answer.pressure > 0)
    if pair is None:
        text = (
            f"no hardness is given, and the mean contact pressure is above {HARDEST:g} GPa, that of the hardest metal "
            "in materials.METALS: give hardness= of the softer body, or infinity where it does not yield"
        )
        return found | {text: elastic & (mean > HARDEST * unit)}
    soft, hard = pair.softer.hardness
    needed = (
        f"'{soft:g} GPa'"
        if soft == hard
        else f" of its temper, '{soft:g} GPa' to '{hard:g} GPa'"
    )
    yields = E_star * np.asarray(surface.rms_gradient) > ELASTIC_PSI * soft * unit
    text = f"{pair.softer.name} yields here: give hardness={needed}"
    return found | {text: elastic & (yields | (mean > soft * unit))}


class LawPoint(
    collections.namedtuple(
        "LawPoint", ("separation", "mean_separation", "area", "stiffness", "pressure")
    )
):
    """Results of a law at given pressures: separation d, mean separation u, A/A0, -dF/du and F/A0, of their shape."""

    units = Units()  #: the law's

    def __repr__(self) -> str:
        fields = self._asdict().items()
        return f"LawPoint({', '.join(f'{name} {shown(value, unit_of(name, self.units))}' for name, value in fields)})"


#: results of a law at separations: F/A0, A/A0, -dF/du and the energy, of their shape
LawValues = collections.namedtuple(
    "LawValues", ("pressure", "area", "stiffness", "energy")
)
