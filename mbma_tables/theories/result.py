"""What `contact` answers: force and area, and what follows from them when it is read."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from mbma_tables.arguments import FloatArray, Numbers, is_labelled
from mbma_tables.labels import apply_to_surface
from mbma_tables.surfaces.surface import PARAMETERS, Surface
from mbma_tables.theories.protocol import Theory, TheoryAnswer

MAX_GRADIENT = 1.0  # rms gradient above which heights and wavenumbers are hardly in one unit


@dataclasses.dataclass(frozen=True, eq=False)
class Contact:
    """A contact: force, area and what follows from them; arrays of the broadcast shape, or DataArrays.

    Attributes
    ----------
    separation : ndarray
        d, between the rigid plane and the mid-plane [length].
    mean_separation : ndarray
        u = (h_max + d)/2 (50) [length].
    force : ndarray or None
        F/A0 in the unit of E_star; F/(A0 E*) where that is 1. None where not asked for.
    area : ndarray or None
        A/A0, None where not asked for. MBMA does not end at 1 under full compression, and this is not clamped.
    error : ndarray
        Bound on the relative numerical error of both against the theory (for "mbma" against what the tier stands
        for), NaN where not known. The theory's own distance from simulation is another number, `scatter`.
    theory, reading, tier : str
        What made them; reading and tier are empty where the theory is not MBMA.
    islands : int or None
        Islands evaluated; None where that is left to dask, or where there are none.
    force_by, area_by, separation_by : dict of ndarray, or None
        Partial derivatives by "separation", "hurst", "q0", "q1", "h_rms" and "h_max", the others held. Asked by
        pressure or area, that is held in place of the separation, whose own derivatives are `separation_by`, and
        "pressure" or "area" stands for "separation".
    """

    separation: Numbers
    mean_separation: Numbers
    force: Numbers
    area: Numbers
    error: Numbers
    theory: str
    reading: str
    tier: str
    islands: int | None
    force_by: dict[str, Numbers] | None = None
    area_by: dict[str, Numbers] | None = None
    separation_by: dict[str, Numbers] | None = None
    _source: Source = dataclasses.field(repr=False, kw_only=True)

    @functools.cached_property
    def stiffness(self) -> Numbers:
        """-d(F/A0)/du [stress/length], against the mean separation; computed when first read."""
        return self._source.map(lambda s, u, E: E * self._source.theory.answer(s, u).stiffness, self)

    @functools.cached_property
    def energy(self) -> Numbers:
        """Elastic energy per nominal area [stress length], the integral of F/A0 over u; computed when first read."""
        return self._source.map(lambda s, u, E: E * self._source.theory.energy(s, u), self)

    @property
    def mean_pressure(self) -> Numbers:
        """Mean pressure in the contact, F/A [stress]; NaN where there is none."""
        with np.errstate(invalid="ignore"):
            return self.force / self.area

    @functools.cached_property
    def scatter(self) -> Numbers:
        """Standard deviation of ln F at this mean separation from simulation to simulation; NaN where not known."""
        return self._source.map(lambda s, u, E: self._scatter(s, u)[0], self)

    @functools.cached_property
    def area_scatter(self) -> Numbers:
        """Standard deviation of ln A at this force, likewise."""
        return self._source.map(lambda s, u, E: self._scatter(s, u)[1], self)

    def _scatter(self, surface: Surface, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        theory = self._source.theory
        return theory.scatter(surface, theory.answer(surface, u).area)

    @functools.cached_property
    def valid(self) -> Numbers:
        """Whether the theory was tested for contacts such as these; `reasons` says where and why not."""

        def none(s: Surface, u: FloatArray, E: FloatArray) -> FloatArray:
            masks = list(self._source.concerns(s, u).values())
            return np.asarray(~np.logical_or.reduce(masks), dtype=float)

        return self._source.map(none, self).astype(bool)

    @functools.cached_property
    def reasons(self) -> dict[str, Any]:
        """Reasons for which entries are not `valid`, each with a mask; of plain arrays."""
        u = np.asarray(self.mean_separation)
        surface = self._source.surface
        plain = Surface(*(np.asarray(getattr(surface, name)) for name in PARAMETERS)) if surface.labelled else surface
        return {reason: mask for reason, mask in self._source.concerns(plain, u).items() if mask.any()}


@dataclasses.dataclass(frozen=True, eq=False)
class Source:
    """What a `Contact` is of, for quantities that are computed when they are read."""

    theory: Theory
    surface: Surface
    E_star: Any

    def map(self, function: Callable[[Surface, FloatArray, FloatArray], FloatArray], contact: Contact) -> Numbers:
        """``function(surface, u, E_star)`` of the contact's entries."""
        u = contact.mean_separation
        if self.surface.labelled or is_labelled(u) or is_labelled(self.E_star):
            arrays = {"mean_separation": u, "E_star": self.E_star}
            found: Numbers = apply_to_surface(lambda *given: (function(*given),), self.surface, arrays, 1)[0]
            return found
        return function(self.surface, np.asarray(u), np.asarray(self.E_star))[()]

    def concerns(self, surface: Surface, u: FloatArray) -> dict[str, Any]:
        """Every reason against the entries, with its mask."""
        answer: TheoryAnswer = self.theory.answer(surface, u)
        steep = np.broadcast_to(np.asarray(surface.rms_gradient) > MAX_GRADIENT, np.shape(answer.force))
        text = "the rms gradient is above 1: are heights and wavenumbers in one unit?"
        return {text: steep, **self.theory.concerns(surface, answer, u)}
