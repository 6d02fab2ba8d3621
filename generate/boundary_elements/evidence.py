"""Surfaces of the evidence, with or without a hardness, as laws are fitted to them and tested on them."""

import dataclasses
import functools
from collections.abc import Iterator
from typing import Any, Self

import numpy as np
import xarray as xr
from scipy.interpolate import PchipInterpolator
from scipy.special import erf, erfinv

from generate.boundary_elements.surfaces import REFINEMENT, SPLITS
from generate.files import dataset
from mbma_tables import Surface
from mbma_tables.common.arguments import FloatArray
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.maps import matched
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.theories.calibrated.curves import CompressionCurve
from mbma_tables.theories.calibrated.formulas import (
    CalibratedConstants,
    Spectrum,
    SpectrumLaw,
)
from mbma_tables.theories.calibrated.map_curves import MapConstants, MapLaw
from mbma_tables.theories.yielding import formulas as hardness

GAUSSIAN = ("self_affine", "plateau", "filtered")
MIN_WAVES = 2  # constants see no surface of one longest wave a side
MAX_AREA = 0.98  # beyond, gaps are a few points
LEVELS = np.geomspace(1e-5, 1.0, 400)  # u/h_max of a law's curve
PRESSURES = np.geomspace(1e-5, 10.0, 400)  # F/(A0 E* g), likewise
# u/h_max at which a theory's curve is known
DEPTHS = np.concatenate(
    [1 - np.geomspace(1e-4, 0.5, 150), np.geomspace(0.5, 1e-6, 151)[1:]]
)


@dataclasses.dataclass(frozen=True, eq=False)
class Simulated:
    """One simulated surface, and what laws may know of it."""

    kind: str
    split: str
    node: tuple[float | str, ...]
    waves: int
    points: int
    spectrum: Spectrum
    own_spectrum: Spectrum
    h_max: float

    @property
    def zeta_1(self) -> float:
        return float(self.node[2])

    @property
    def gaussian(self) -> bool:
        """Whether constants of the spectrum's law are fitted to surfaces like it."""
        return self.kind in GAUSSIAN and self.waves >= MIN_WAVES

    @property
    def surface(self) -> AnySurface:
        """What theories are given, q0 = h_rms = 1: five numbers, or the surface's own spectrum by bands."""
        if self.kind in ("self_affine", "yielded"):
            return Surface(float(self.node[1]), 1.0, self.zeta_1, 1.0, self.h_max)
        x = self.own_spectrum.x
        variance = self.own_spectrum.variance
        middle = np.sqrt(x[1:] * x[:-1])
        edges = np.concatenate(
            [[x[0] ** 2 / middle[0]], middle, [x[-1] ** 2 / middle[-1]]]
        )
        level = variance / (np.pi * np.diff(edges**2))
        q = np.repeat(edges, 2)[1:-1]
        C = np.repeat(level, 2)
        # of the mean square wavenumber that it has
        return MeasuredSurface(
            q, matched(q, C, 1.0, self.own_spectrum.gradient**2), self.h_max
        )


class TheoryCurve:
    """A theory on a surface: forces over A0 E* g, lengths over h_rms; NaN where the theory does not reach.

    A theory has an ``answer`` at mean separations, or an ``at_pressure``, which returns
    A/A0 and the mean separation.
    """

    def __init__(self, theory: Any, surface: AnySurface) -> None:
        self._theory, self._surface = theory, surface
        self._g, self._h_rms = float(surface.rms_gradient), float(surface.h_rms)
        u = DEPTHS * float(self._surface.h_max)
        pressure = PRESSURES * self._g
        with np.errstate(all="ignore"):
            if hasattr(theory, "answer"):
                pressure, area, *_ = theory.answer(self._surface, u)
            else:
                area, u = theory.at_pressure(self._surface, pressure)
        # of a theory whose force falls again, the branch of first contact
        falls = (np.diff(pressure) <= 0) | (np.diff(u) >= 0) | (u[1:] <= 0)
        end = np.flatnonzero(np.append(falls, True))[0] + 1
        kept = slice(int(np.argmax(pressure[:end] > 0)), end)
        self._log_force, self._u = np.log(pressure[kept] / self._g), u[kept] / self._h_rms
        self._log_area = np.log(area[kept])

    def area(self, force: FloatArray) -> FloatArray:
        return np.asarray(
            np.exp(
                PchipInterpolator(self._log_force, self._log_area, extrapolate=False)(
                    np.log(force)
                )
            )
        )

    def separation(self, force: FloatArray) -> FloatArray:
        return np.asarray(
            PchipInterpolator(self._log_force, self._u, extrapolate=False)(np.log(force))
        )

    def force(self, u: FloatArray) -> FloatArray:
        if hasattr(self._theory, "answer"):
            gap = np.minimum(u * self._h_rms, self._surface.h_max)
            return np.asarray(self._theory.answer(self._surface, gap)[0] / self._g)
        return np.asarray(
            np.exp(
                PchipInterpolator(
                    self._u[::-1], self._log_force[::-1], extrapolate=False
                )(u)
            )
        )


@dataclasses.dataclass(frozen=True, eq=False)
class Case(Simulated):
    curves: dict[str, Any]
    force: FloatArray
    area: FloatArray
    u: FloatArray

    def at(self, kept: Any) -> Self:
        return dataclasses.replace(
            self, force=self.force[kept], area=self.area[kept], u=self.u[kept]
        )

    def law(self, constants: CalibratedConstants) -> SpectrumLaw:
        return SpectrumLaw(self.spectrum, self.h_max, constants)

    def map_law(
        self, constants: CalibratedConstants, map_constants: MapConstants
    ) -> MapLaw:
        return MapLaw(
            self.own_spectrum,
            **self.curves,
            constants=constants,
            map_constants=map_constants,
        )


@dataclasses.dataclass(frozen=True, eq=False)
class Capped(Simulated):
    """One surface at one hardness: what was found, and the elastic contact of the same surface, simulated and by laws.

    Loads are in rows as simulated; `bare` has the surface's forces, areas, mean gaps and
    stiffnesses if elastic. `curves` have force, stiffness and Q of each form of the elastic
    law at `LEVELS`.
    """

    eta: float
    law: SpectrumLaw
    map_curve: CompressionCurve
    heights: hardness.BearingCurve
    curves: dict[str, tuple[FloatArray, FloatArray, FloatArray]]
    force: FloatArray
    area: FloatArray
    yielded: FloatArray
    u: FloatArray
    planes: FloatArray
    frozen: FloatArray
    bare: dict[str, FloatArray]

    @functools.cached_property
    def elastic_area(self) -> FloatArray:
        """Simulated, at these forces."""
        known = PchipInterpolator(
            np.log(self.bare["force"]), np.log(erfinv(self.bare["area"]))
        )
        return np.asarray(erf(np.exp(known(np.log(self.force)))))

    @functools.cached_property
    def elastic(self) -> tuple[FloatArray, FloatArray]:
        """Simulated force and stiffness at these gaps; by the law, fitted at its end, where not pressed so far."""
        u = self.bare["u"]
        found = []
        laws = self.by_law, self.law.contact(u[-1:])[::2]
        for name, beyond, end in zip(("force", "frozen"), *laws, strict=True):
            known = PchipInterpolator(u[::-1], np.log(self.bare[name][::-1]))
            inside = np.exp(known(np.maximum(self.u, u[-1])))
            found.append(
                np.where(self.u > u[-1], inside, beyond * self.bare[name][-1] / end[0])
            )
        return found[0], found[1]

    @functools.cached_property
    def by_law(self) -> tuple[FloatArray, FloatArray]:
        """Elastic force and stiffness at these gaps, by the spectrum's law."""
        return self.law.contact(self.u)[::2]

    @functools.cached_property
    def shares(self) -> tuple[FloatArray, FloatArray]:
        """Q at these gaps, of the surface's heights and of Gaussian ones up to h_max."""
        return self.heights(self.u)[0], hardness.bearing_share(self.u, self.h_max)[0]


def simulated(data: xr.Dataset) -> Iterator[tuple[xr.Dataset, Simulated]]:
    """Surfaces of a file by `python -m generate`, refinements left out."""
    kinds = data.kind.attrs["flag_meanings"].split()
    for one in (
        data.isel(surface=number)
        for number in np.flatnonzero(data.split.values < SPLITS.index(REFINEMENT))
    ):
        kind = kinds[int(one.kind)]
        hurst = float(one.hurst)
        zeta_1 = float(one.zeta_1)
        share = one.band_variance.values
        x = one.band_q.values
        own = Spectrum.from_shares(x[share > 0], share[share > 0])
        spectrum = (
            Spectrum.self_affine(hurst, zeta_1)
            if kind in ("self_affine", "yielded")
            else own
        )
        node = (kind, hurst, zeta_1, int(one.waves), float(one["shape"]))
        waves = int(one.waves)
        split = SPLITS[int(one.split)]
        points = int(one.points)
        h_max = float(one.h_max)
        yield one, Simulated(kind, split, node, waves, points, spectrum, own, h_max)


def curves_of(one: xr.Dataset) -> dict[str, Any]:
    """What a map's law knows of a surface beside its spectrum."""
    names = ("mean_height", "top_gradient", "tension_force", "tension")
    return {name: one[name].values.astype(float) for name in names} | {
        "anisotropy": float(one.anisotropy)
    }


def cases(data: xr.Dataset) -> list[Case]:
    """Surfaces of a file by `python -m generate boundary_elements`, refinements left out."""
    found = []
    for one, known in simulated(data):
        seen = (
            np.isfinite(one.force.values)
            & (one.area.values > 0)
            & (one.area.values < MAX_AREA)
        )
        force, area, u = (
            one[name].values[seen] for name in ("force", "area", "mean_separation")
        )
        found.append(
            Case(**vars(known), curves=curves_of(one), force=force, area=area, u=u)
        )
    return found


@functools.cache
def evidence() -> tuple[Case, ...]:
    return tuple(cases(dataset("elastic")))


def capped(data: xr.Dataset) -> list[Capped]:
    """Surfaces of a file by `python -m generate boundary_elements --of hardness`, refinements left out."""
    found = []
    names = {
        "force": "force",
        "area": "area",
        "yielded": "area_yielded",
        "u": "mean_separation",
    }
    names |= {"planes": "plane_separation", "frozen": "frozen_stiffness"}
    for one, known in simulated(data):
        curves = curves_of(one)
        u = known.h_max * LEVELS[:-1]
        law = SpectrumLaw(known.spectrum, known.h_max)
        by_map = CompressionCurve(MapLaw(known.own_spectrum, **curves), known.h_max)
        heights = hardness.BearingCurve(curves["mean_height"], known.h_max)
        force, _, stiffness = by_map.answer(u)
        levels = {
            "calibrated": (
                *law.contact(u)[::2],
                hardness.bearing_share(u, known.h_max)[0],
            ),
            "calibrated_map": (force, stiffness, heights(u)[0]),
        }
        rows = {own: one[name].values.astype(float) for own, name in names.items()}
        fixed: dict[str, Any] = {
            "law": law,
            "map_curve": by_map,
            "heights": heights,
            "curves": levels,
        }
        fixed["bare"] = {own: values[-1] for own, values in rows.items()}
        for row, eta in enumerate(data.eta.values[:-1]):
            loads = {own: values[row] for own, values in rows.items()}
            found.append(Capped(**vars(known), eta=float(eta), **fixed, **loads))
    return found
