"""The law calibrated on BEM as a theory: self-affine surfaces by its table, others by the law itself."""

from __future__ import annotations

import copy
import dataclasses
import math
import weakref
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mbma_tables.common.arguments import FloatArray, entries_at, require, spread
from mbma_tables.common.shared import shared
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.banded import BandedSurface
from mbma_tables.surfaces.spectral import PRESSED
from mbma_tables.surfaces.surface import MeasuredSurface, Surface
from mbma_tables.theories import tested
from mbma_tables.theories.base import Theory, TheoryAnswer, select, unfinished
from mbma_tables.theories.calibrated import table as calibrated_table
from mbma_tables.theories.calibrated.formulas import (
    KEPT,
    LAW_ERROR,
    force_at_area,
    light_factor,
)
from mbma_tables.theories.calibrated.formulas import area as law_area
from mbma_tables.theories.calibrated.spectra import (
    Spectra,
    laws_of,
    power_laws_of,
)
from mbma_tables.theories.evidence import NAME, shipped_checksum, shipped_deviations
from mbma_tables.theories.inversion import Curve

if TYPE_CHECKING:
    from mbma_tables.theories.calibrated.curves import OwnLaw

NEAREST = 0.95  # share of h_max at which the certificate of the table ends
TAIL = (
    3.0,
    0.8,
)  # u/h_rms from which the error of the table grows, and its rate: exp(0.8 (u/h_rms - 3))
# standard deviations added to those of the data that the law was fitted to, for maps
# without `departures` and for others, by which 70% of the errors of `python -m generate
# machined` lie within one and 97.5% within two
MAP_SCATTER = {
    "area": (0.01, 0.15),
    "pressure": (0.029, 0.18),
    "stiffness": (0.056, 0.23),
}
# standard deviations added to those of spectra for the first doubling of the bandwidth beyond
# that of the data that the law was fitted to, and times its root for more doublings: the
# errors of a few surfaces with two longest waves a side (docs/fidelity.md)
WIDE_SCATTER = {"area": 0.01, "pressure": 0.05, "stiffness": 0.08}
LIKE_SCANS = 1e-3, 0.9  # A/A0 at which scans are compared
MANY = 1000  # entries for which polynomials of one surface are made
ROUNDING = 1e-14  # rounding of a separation beside h_max
# nodes of the rule for energies of surfaces of the table, whose error is below 6e-9 where
# u/h_max is at least CLOSED; below, the table errs by more
NODES = 48
CLOSED = 1e-6
TOGETHER = 2**17  # forces in memory at once


def _own_law(surface: MeasuredSurface) -> OwnLaw:
    # imports scipy, which takes long
    from mbma_tables.theories.calibrated.curves import own_law

    return own_law(surface)


def _error(stated: Any, nearer: float, share: FloatArray) -> FloatArray:
    """Relative error at shares of h_max; nearer to it than NEAREST, force is a small difference with cancellation."""
    near = (share > NEAREST) & (share < 1)
    error = np.array(np.broadcast_to(stated, share.shape))
    error[near] = nearer * error[near] + ROUNDING / (1 - share[near])
    return error


class Batch:
    """Surfaces prepared for about so many entries: for the table, and by their spectra outside of it."""

    def __init__(self, surface: Surface | BandedSurface, entries: int) -> None:
        names = ("h_max", "h_rms", "rms_gradient", "alpha")
        h_max, h_rms, gradient, alpha = (
            np.asarray(getattr(surface, name), float).ravel() for name in names
        )
        self.shape, self.h_max = surface.shape, h_max
        self.h_rms, self.gradient = h_rms, gradient
        self.rows = np.arange(h_rms.size)
        heights = h_max / h_rms
        table = calibrated_table.shipped()
        hurst, zeta_1, is_self_affine = power_laws_of(surface)
        columns = np.array([hurst, np.log(zeta_1), heights])
        self.covered = (
            is_self_affine
            & table.covers(*columns[:2])
            & (heights <= np.exp(table.covered[2, 1]))
        )
        self.whole = bool(self.covered.all())
        self.contacts, self.separations = table.prepared(columns, entries)
        if not self.whole:
            rows = np.flatnonzero(~self.covered)
            self.number = np.cumsum(~self.covered) - 1
            self.spectra = Spectra(laws_of(surface)[rows], alpha[rows], heights[rows])

    def part(self, rows: NDArray[np.intp], shape: tuple[int, ...]) -> Batch:
        """Some of the surfaces, which share what was prepared for all."""
        some = copy.copy(self)
        some.shape = shape
        some.rows = rows
        return some

    def placed(self, value: FloatArray) -> tuple[FloatArray, Any, tuple[int, ...], Any]:
        """Numbers that broadcast with the surfaces, flat; the surface of each, as a number and to index; the shape."""
        if not self.shape:
            return (
                np.ravel(value),
                np.zeros(value.size, np.int64),
                value.shape,
                slice(None),
            )
        shape = np.broadcast_shapes(value.shape, self.shape)
        number = self.rows.reshape(self.shape)
        flat, owner = (
            np.ascontiguousarray(spread(each, shape)).ravel() for each in (value, number)
        )
        return flat, owner, shape, owner

    def contact(self, u: FloatArray) -> FloatArray:
        """Force, area and stiffness at mean separations [length]."""
        flat, owner, shape, own = (
            self.placed(u)
            if self.shape
            else (u.ravel(), np.zeros(u.size, np.int64), u.shape, slice(None))
        )
        gradient = self.gradient[own]
        h_rms = self.h_rms[own]
        x = flat / h_rms
        if self.whole:
            out = self.contacts((owner, x))
        else:
            out = np.empty((3, x.size))
            for some, contacts, owners in self.routes(owner, True):
                out[:, some] = contacts((owners, x[some]))
        out[0] *= gradient
        out[2] *= gradient
        out[2] /= h_rms
        return out.reshape(3, *shape)

    def energy(self, u: FloatArray) -> FloatArray:
        """Integrals of force from mean separations to h_max, both lengths."""
        flat, owner, shape, _ = self.placed(u)
        covered = self.covered[owner]
        if covered.all():
            return self._energy_by_table(flat, owner).reshape(shape)
        energy = np.empty(flat.size)
        some = np.flatnonzero(covered)
        energy[some] = self._energy_by_table(flat[some], owner[some])
        some = np.flatnonzero(~covered)
        some = some[np.argsort(owner[some], kind="stable")]
        number = owner[some]
        h_rms = self.h_rms[number]
        found = self.spectra.energies((self.number[number], flat[some] / h_rms))
        energy[some] = found * self.gradient[number] * h_rms
        return energy.reshape(shape)

    def _energy_by_table(self, u: FloatArray, owner: NDArray[np.intp]) -> FloatArray:
        # towards full contact force is smooth over the root of u, and beside h_max, where it
        # is a power of what is left, over the root of that
        nodes, weights = np.polynomial.legendre.leggauss(NODES)
        h_rms = self.h_rms[owner]
        h_max = self.h_max[owner]
        last = np.sqrt(np.sqrt(h_max))
        width = last - np.sqrt(np.sqrt(u))
        energy = np.zeros(u.size)
        step = max(1, TOGETHER // max(u.size, 1))
        for start in range(0, NODES, step):
            some = slice(start, start + step)
            place = 0.5 * (1 + nodes[some, None])
            root = last - width * place**2
            x = np.minimum(root**4, h_max) / h_rms
            number = np.ascontiguousarray(np.broadcast_to(owner, x.shape)).ravel()
            force = self.contacts((number, x.ravel()))[0].reshape(x.shape)
            # one after the other, so that sums do not depend on how many there are
            for weight, one in zip(
                weights[some], force * 4 * root**3 * place, strict=True
            ):
                energy += weight * one
        return np.asarray(energy * width * self.gradient[owner])

    def separation(self, owner: Any, loads: FloatArray) -> FloatArray:
        """Mean separations over h_rms at forces over A0 E* g; infinite without a force."""
        u = np.full(loads.size, np.inf)
        for some, separations, owners in self.routes(owner, False, loads > 0):
            u[some] = separations((owners, loads[some]))[0]
        return u

    def routes(
        self, owner: Any, at_gaps: bool, asked: Any = True
    ) -> Iterator[tuple[Any, Callable[..., FloatArray], Any]]:
        """Entries with their loop of the core and its owners: by the table, and outside of it."""
        covered = self.covered[owner]
        if self.covered.any():
            some = np.flatnonzero(covered & asked)
            yield some, self.contacts if at_gaps else self.separations, owner[some]
        if not self.whole:
            some = np.flatnonzero(~covered & asked)
            # one surface after the other, each of which the loop prepares once
            some = some[np.argsort(owner[some], kind="stable")]
            loop = self.spectra.contacts if at_gaps else self.spectra.separations
            yield some, loop, self.number[owner[some]]


@shared(KEPT)
def _single(surface: Surface | BandedSurface) -> Batch:
    return Batch(surface, MANY)


# batches with surfaces outside of the table, whose wavenumbers are found once
_prepared: weakref.WeakKeyDictionary[AnySurface, Batch] = weakref.WeakKeyDictionary()


def _bound(surface: AnySurface, value: FloatArray) -> Batch:
    assert isinstance(surface, Surface | BandedSurface)
    if not surface.shape:
        return _single(surface)
    whole, rows = surface.origin
    batch = _prepared.get(whole)
    if batch is not None:
        return batch if rows is None else batch.part(rows, surface.shape)
    batch = Batch(surface, max(np.size(value), math.prod(surface.shape)))
    if not batch.whole and rows is None:
        _prepared[surface] = batch
    return batch


def _spread(surface: MeasuredSurface, quantity: str, area: FloatArray) -> FloatArray:
    """Standard deviation of ln of a quantity from scan to scan of a surface of several, at its contact areas."""
    law = _own_law(surface)
    u = law.mean_separation("area", np.clip(area, *LIKE_SCANS))
    (pressure, _, steep), _ = law.answer(u)
    found = []
    for own in map(_own_law, surface.scans):
        closer = own.mean_separation("pressure", pressure)
        if quantity == "pressure":
            found.append((closer - u) * steep / pressure)
        else:
            found.append(
                np.log(
                    own.area(pressure) if quantity == "area" else own.answer(closer)[0][2]
                )
            )
    return np.asarray(np.std(found, axis=0, ddof=1))


@dataclasses.dataclass(frozen=True, repr=False)
class Calibrated(Theory):
    """Persson's energy integral with cover and weight calibrated on boundary elements.

    Self-affine surfaces are evaluated by its table, those outside of it (H below 0.1,
    zeta_1 above 1e5, h_max above 8 h_rms) by the law's quadrature. For a surface given by a
    spectrum, the spectrum is used; measured heights determine the separation, and a
    measured map also determines the area, by its highest and lowest parts.
    """

    name = "calibrated"
    takes_heights = True
    has_yielded_flow = True

    def interval(
        self, surface: AnySurface, quantity: str = "pressure"
    ) -> tuple[FloatArray, FloatArray]:
        """From full contact, or from the end of a map's curve, to last contact."""
        high = np.asarray(surface.h_max, dtype=float)
        return (
            np.asarray(_own_law(surface).end)
            if isinstance(surface, MeasuredSurface)
            else np.zeros_like(high)
        ), high

    def provenance(self) -> tuple[str, ...]:
        return (f"table: {NAME} {shipped_checksum()}",)

    def answer(self, surface: AnySurface, mean_separation: FloatArray) -> TheoryAnswer:
        """Force, area and stiffness at mean separations u [length]; without bound at u = 0."""
        if isinstance(surface, MeasuredSurface):
            gap = np.asarray(mean_separation, float)
            require("mean_separation", gap, gap >= 0, "at least 0")
            (pressure, area, stiffness), own_error = _own_law(surface).answer(gap)
            error = _error(own_error, 1.0, gap / np.asarray(surface.h_max))
            return TheoryAnswer(pressure, area, stiffness, error)
        gap, h_rms, (start, rate) = (
            np.asarray(mean_separation, float),
            np.asarray(surface.h_rms),
            TAIL,
        )
        found = _bound(surface, gap).contact(gap)
        x = gap / h_rms
        require("mean_separation", spread(gap, x.shape), x >= 0, "at least 0")
        stated = calibrated_table.shipped().error * np.exp(
            rate * np.clip(x - start, 0, tested.elastic_ranges()["heights"][1] - start)
        )
        if isinstance(surface, BandedSurface):
            one_law = np.reshape(surface.power_laws[2], surface.shape)
            stated = np.where(one_law, stated, LAW_ERROR)
        pressure, area, stiffness = found
        return TheoryAnswer(
            pressure,
            area,
            stiffness,
            _error(stated, 2.0, x / (np.asarray(surface.h_max) / h_rms)),
        )

    def curve(self, surface: AnySurface, quantity: str) -> Curve:
        if isinstance(surface, MeasuredSurface):
            return super().curve(surface, quantity)
        batch = _bound(surface, np.empty(0))

        def values(u: FloatArray) -> tuple[Any, Any, bool]:
            pressure, area, stiffness = batch.contact(u)
            if quantity == "pressure":
                return pressure, stiffness, True
            return area, area * stiffness / pressure, False

        return values

    def mean_separation_at(
        self, surface: AnySurface, quantity: str, wanted: FloatArray
    ) -> FloatArray:
        """Mean separation u [length] at a force over A0 E* or an area below 1; h_max at zero."""
        wanted = np.asarray(wanted, float)
        u = self._mean_separation(surface, quantity, wanted)
        # nearer to h_max the rounding of u is as large as what is left, and with it the force
        rounded = (u > surface.h_max * (1 - ROUNDING)) & (wanted > 0)
        if rounded.any():
            raise unfinished(rounded, f"the separation at this {quantity}")
        return u

    def _mean_separation(
        self, surface: AnySurface, quantity: str, wanted: FloatArray
    ) -> FloatArray:
        """The same, also where u differs from h_max by rounding."""
        if isinstance(surface, MeasuredSurface):
            return _own_law(surface).mean_separation(quantity, wanted)
        if quantity == "area":
            shape = np.broadcast_shapes(wanted.shape, surface.shape)
            light = np.broadcast_to(light_factor(surface.alpha), shape)
            loads = force_at_area(np.broadcast_to(wanted, shape), light)
        else:
            loads = wanted / np.asarray(surface.rms_gradient)
        u = self._at_loads(surface, loads)
        require(quantity, spread(wanted, u.shape), ~np.isnan(u), "less: u is 0")
        return u

    def _at_loads(self, surface: AnySurface, loads: FloatArray) -> FloatArray:
        """Mean separations [length] at forces over A0 E* g, NaN where these are not reached."""
        batch = _bound(surface, loads)
        flat, owner, shape, own = batch.placed(loads)
        u = batch.separation(owner, flat) * batch.h_rms[own]
        # zero load is last contact
        return np.asarray(np.minimum(u.reshape(shape), surface.h_max))

    def force_near(self, surface: AnySurface, pressure: FloatArray) -> FloatArray | None:
        if isinstance(surface, MeasuredSurface):
            return None
        return self._at_loads(surface, pressure / np.asarray(surface.rms_gradient))

    def area_at(self, surface: AnySurface, pressure: FloatArray) -> FloatArray:
        if isinstance(surface, MeasuredSurface):
            return _own_law(surface).area(np.asarray(pressure, float))
        return law_area(
            pressure / np.asarray(surface.rms_gradient),
            surface.alpha,
            calibrated_table.shipped().constants,
        )

    def energy(self, surface: AnySurface, mean_separation: FloatArray) -> FloatArray:
        """Elastic energy over A0 E* [length], by rules of a fixed number of forces but for closed surfaces."""
        if isinstance(surface, MeasuredSurface):
            return super().energy(surface, mean_separation)
        u = np.asarray(mean_separation, float)
        h_max = np.asarray(surface.h_max)
        batch = _bound(surface, u)
        found = batch.energy(np.minimum(u, h_max))
        is_closed = batch.covered.reshape(surface.shape) & (u < CLOSED * h_max)
        rest = np.flatnonzero(np.broadcast_to(is_closed, found.shape))
        if rest.size:
            others = select(surface, found.shape, rest)
            gaps = entries_at(u, found.shape, rest)
            found.ravel()[rest] = super().energy(others, gaps)
        return found

    def heights(self, surface: AnySurface) -> Any:
        """Heights of a map, or Gaussian."""
        own = _own_law(surface).heights if isinstance(surface, MeasuredSurface) else None
        return (
            np.asarray(surface.h_max) / np.asarray(surface.h_rms) if own is None else own
        )

    def reasons(
        self,
        surface: AnySurface,
        answer: TheoryAnswer,
        mean_separation: FloatArray,
    ) -> Mapping[str, Any]:
        reasons = super().reasons(surface, answer, mean_separation)
        if not isinstance(surface, MeasuredSurface):
            return reasons
        law = _own_law(surface)
        if law.curve is None:
            return reasons
        text = (
            "the light-load and near-full-contact approximations disagree for this map: stiffness is "
            "constant over a range of forces"
        )
        straight = law.curve.straight(np.asarray(mean_separation) / law.h_rms)
        light = tested.below(answer.area, tested.elastic_ranges()["area"])
        return {text: straight & ~light, **reasons}

    def departures(self, surface: AnySurface) -> tuple[str, ...]:
        return surface.departures(by_map=self.by_heights(surface))

    def scatter(self, surface: AnySurface, quantity: str, area: FloatArray) -> FloatArray:
        """Scatter as of any theory; for maps with an addition to that of Gaussian ones."""
        if not self.by_heights(surface):
            stated = super().scatter(surface, quantity, area)
            wide = np.hypot(stated, self.wide_scatter(surface, quantity))
            if not surface.scans or np.isnan(wide).all():
                return np.asarray(wide)
            assert isinstance(surface, MeasuredSurface)
            return np.asarray(np.hypot(wide, _spread(surface, quantity, area)))
        assert isinstance(surface, MeasuredSurface)
        if surface.outside(PRESSED):
            return np.full(np.shape(area), np.nan)
        stated = shipped_deviations().standard_deviation(
            self.scatter_name(surface), quantity, area
        )
        stated = np.hypot(stated, MAP_SCATTER[quantity][bool(self.departures(surface))])
        return (
            np.hypot(stated, _spread(surface, quantity, area))
            if surface.scans
            else stated
        )

    def wide_scatter(self, surface: AnySurface, quantity: str) -> FloatArray:
        if self.by_heights(surface):
            return super().wide_scatter(surface, quantity)
        most = WIDE_SCATTER.get(quantity, 0.0)
        return np.asarray(most * tested.beyond_all(surface) ** 0.5)

    def scatter_name(self, surface: AnySurface) -> str:
        """With a map its own."""
        return f"{self.name}_map" if self.by_heights(surface) else self.name
