"""The numbers that a surface was made from, and the surface of others: what derivatives are taken by."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mbma_tables.bodies.bodies import BodiesInUnits
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import InputError
from mbma_tables.common.units import DIMENSIONS, factor
from mbma_tables.contacts.contact import contact_of
from mbma_tables.contacts.quantities import registry
from mbma_tables.contacts.quantities.interface import Interface
from mbma_tables.contacts.question import GAPS
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.banded import BandedSurface
from mbma_tables.surfaces.heights import Heights
from mbma_tables.surfaces.maps import extrapolated
from mbma_tables.surfaces.self_affine import PARAMETERS
from mbma_tables.surfaces.surface import MeasuredSurface, Surface
from mbma_tables.theories.base import Theory

if TYPE_CHECKING:
    from mbma_tables.contacts.result import Contact


@dataclasses.dataclass(frozen=True)
class Asked:
    """A contact at one given quantity, but for its surface."""

    bodies: BodiesInUnits
    by: str
    value: Any
    theory: Theory
    interface: Interface

    def contact(self, surface: AnySurface) -> Contact:
        """The contact of a surface."""
        candidates = dict.fromkeys((*GAPS, "pressure", "area"))
        return contact_of(
            surface,
            self.bodies,
            candidates | {self.by: self.value},
            self.theory,
            self.interface,
        )


@dataclasses.dataclass(frozen=True)
class Unknowns:
    """Numbers that a surface was made from, and the function that makes it again of others."""

    numbers: Mapping[str, Any]
    make: Callable[..., AnySurface]  # takes the numbers by name
    batches: bool = False  # whether `make` takes arrays of them
    #: signs of steps of numbers that can move to one side only
    one_sided: Mapping[str, float] = dataclasses.field(default_factory=dict)
    #: names of the numbers in results, where they are not their own
    labels: Mapping[str, str] = dataclasses.field(default_factory=dict)

    def answers(
        self, numbers: Mapping[str, Any], asked: Asked, names: Sequence[str]
    ) -> dict[str, Any]:
        """Quantities of the contact of the surface of these numbers."""
        pressed = asked.contact(self.make(**numbers))
        return {name: pressed.quantity(name) for name in names}

    def groups(
        self, columns: Mapping[str, FloatArray]
    ) -> Iterator[tuple[dict[str, Any], Any]]:
        """Numbers of surfaces that are made at once, and the places of these in the columns."""
        own = {name: columns[name] for name in self.numbers}
        if self.batches or not own:
            yield own, slice(None)
            return
        rows = np.array(list(own.values()))
        unique, place = np.unique(rows, axis=1, return_inverse=True)
        for k in range(unique.shape[1]):
            here: NDArray[np.intp] = np.flatnonzero(place.ravel() == k)
            yield dict(zip(own, unique[:, k].tolist(), strict=True)), here

    def knows(self, name: str) -> bool:
        """Whether a quantity follows for other numbers."""
        return True


class OfOneMap(Unknowns):
    """A map whose theory is a simulation of it: heights and lengths scale what was simulated.

    A map with heights `a` and lengths `l` times as large is pressed as the map itself is by
    bodies of modulus E* a/l, at gaps 1/a times as large.
    """

    def answers(
        self, numbers: Mapping[str, Any], asked: Asked, names: Sequence[str]
    ) -> dict[str, Any]:
        """Quantities of the contact of the map with these factors."""
        heights = numbers["heights"]
        lengths = numbers["lengths"]
        equal_modulus = asked.bodies.E_star * heights / lengths
        scale = heights ** _similarity(asked.by)[0]
        equal = dataclasses.replace(
            asked,
            bodies=dataclasses.replace(asked.bodies, E_star=equal_modulus),
            value=asked.value / scale,
        )
        pressed = equal.contact(self.make())
        answers = {}
        for name in names:
            of_heights, of_lengths = _similarity(name)
            factors = heights**of_heights * lengths**of_lengths
            answers[name] = factors * pressed.quantity(name)
        return answers

    def knows(self, name: str) -> bool:
        """Whether a quantity follows by similarity."""
        return registry.get(name).similarity is not None


def _similarity(name: str) -> tuple[int, int]:
    """Powers of `a` and `l` by which a quantity is larger than in the contact of the map."""
    powers = registry.get(name).similarity
    assert powers is not None
    return powers


def unknowns_of(
    surface: AnySurface, theory: Theory | None, unit: str | None = None
) -> Unknowns:
    """The numbers that a surface was made from.

    Parameters
    ----------
    surface : AnySurface
        One surface, or a batch of five numbers.
    theory : Theory or None
        The theory that is asked about it; None where the surface is combined with another,
        which leaves the curves and the points of a map out.
    unit : str, optional
        Unit of length of the numbers; default: the surface's.
    """
    if surface.labelled:
        raise InputError(
            "derivatives are of numbers or plain arrays, and this surface has DataArrays: "
            "give their values"
        )
    drawn = _of_drawing(surface, theory, unit)
    if drawn is not None:
        return drawn
    if surface.shape != () and not isinstance(surface, Surface):
        raise InputError(
            "derivatives of a batch of spectra are by numbers of drawings or of joints, of "
            "which this one was not made: take one surface at a time"
        )
    if isinstance(surface, BandedSurface):
        # of a sum of power laws nothing else is known
        surface = surface.sampled()
    moved: Any = surface if unit in (None, surface.unit) else surface.to(unit or "")
    if isinstance(moved, Surface):
        own = {name: getattr(moved, name) for name in PARAMETERS}
        return Unknowns(own, functools.partial(Surface, unit=moved.unit), batches=True)
    # what keeps points of a map, or the table of their simulation, has the theory of one map
    simulated = moved.map is not None or moved.table is not None
    if simulated and theory is not None:
        of_one_map = theory.gaps() is not None
        if of_one_map:
            return OfOneMap({"heights": 1.0, "lengths": 1.0}, lambda **factors: moved)
    return _of_spectrum(moved, theory)


def _of_drawing(surface: Any, theory: Theory | None, unit: str | None) -> Unknowns | None:
    """The numbers of the drawing, if the surface was made of these and not changed since."""
    record = surface.provenance[0] if surface.provenance else {}
    if record.get("step") != "from_roughness" or record["unit"] != surface.unit:
        return None
    drawn: Any = Surface.from_roughness(**record["given"], unit=record["unit"])
    if type(drawn) is not type(surface):
        return None
    is_sampled = isinstance(surface, MeasuredSurface)
    for name in ("q", "C", "h_max") if is_sampled else surface.parameters:
        before = getattr(drawn, name)
        now = getattr(surface, name)
        if np.shape(before) != np.shape(now) or not np.allclose(
            before, now, rtol=1e-9, atol=0
        ):
            return None
    numbers = {name: np.asarray(given)[()] for name, given in record["given"].items()}
    if unit not in (None, surface.unit):
        for name in numbers:
            power = DIMENSIONS.get(name, (0, 0))[0]
            numbers[name] = numbers[name] * factor(surface.unit, unit, power=power)
    make = functools.partial(
        Surface.from_roughness, unit=unit or surface.unit, process=record.get("process")
    )
    return Unknowns(numbers, make, batches=True)


def _of_spectrum(surface: MeasuredSurface, theory: Theory | None) -> Unknowns:
    """Factors of heights and lengths, and what else the spectrum was made from."""
    steps = {record["step"]: record for record in surface.provenance}
    own: dict[str, float] = {"heights": 1.0, "lengths": 1.0}
    cut_offs: dict[str, float] = {}
    uncut = surface
    # measured heights have their own highest point and shortest wavelengths
    takes_map = theory is not None and theory.takes_heights
    of_its_heights = takes_map or theory is None
    if surface.heights.is_gaussian or not of_its_heights:
        own["h_max"] = float(surface.h_max)
    if "extrapolated" in steps:
        uncut = surface.between(
            float(surface.q0), 2 * math.pi / steps["resolution"]["shortest"]
        )
        own["extrapolate_hurst"] = steps["extrapolated"]["hurst"]
    elif surface.bearing is None or not takes_map:
        cut_offs = {
            "shortest": 2 * math.pi / float(surface.q1),
            "longest": 2 * math.pi / float(surface.q0),
        }

    def make(heights: float, lengths: float, **others: float) -> MeasuredSurface:
        moved = uncut
        if any(others[name] != wavelength for name, wavelength in cut_offs.items()):
            moved = uncut.between(
                2 * math.pi / others["longest"], 2 * math.pi / others["shortest"]
            )
        if "extrapolate_hurst" in others:
            shortest = steps["extrapolated"]["shortest"]
            moved = extrapolated(uncut, shortest, others["extrapolate_hurst"])
        if "h_max" in others:
            h_max = others["h_max"]
            distribution = moved.heights
            if distribution.is_gaussian:
                distribution = Heights.gaussian(float(moved.h_rms), h_max)
            moved = dataclasses.replace(moved, h_max=h_max, heights=distribution)
        return moved.resized(heights, lengths)

    # a spectrum is not known beyond its ends: cut-offs only remove wavelengths
    return Unknowns(own | cut_offs, make, one_sided={"shortest": 1.0, "longest": -1.0})
