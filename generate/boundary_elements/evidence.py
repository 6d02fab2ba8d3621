"""Surfaces of the evidence, as laws are fitted to them and tested on them."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import xarray as xr

from generate.boundary_elements.design import HELD_OUT_SPECTRUM, HELD_OUT_SURFACE, SPLITS, TRAINING
from mbma_tables.arguments import FloatArray
from mbma_tables.calibrated import Constants, Law, Spectrum
from mbma_tables.calibrated_map import MapConstants, MapLaw

GAUSSIAN = ("self_affine", "plateau", "filtered")
MIN_WAVES = 2  # constants see no surface of one longest wave a side
MAX_AREA = 0.98  # beyond, gaps are a few points


@dataclasses.dataclass(frozen=True, eq=False)
class Case:
    """One simulated surface: what laws may know of it, and what was found."""

    kind: str
    split: str
    node: tuple[float | str, ...]
    waves: int
    points: int
    spectrum: Spectrum
    own_spectrum: Spectrum
    h_max: float
    curves: dict[str, Any]
    force: FloatArray
    area: FloatArray
    u: FloatArray

    @property
    def gaussian(self) -> bool:
        """Whether constants of the spectrum's law are fitted to surfaces like it."""
        return self.kind in GAUSSIAN and self.waves >= MIN_WAVES

    def law(self, constants: Constants) -> Law:
        """The spectrum's law with h_max."""
        return Law(self.spectrum, self.h_max, constants)

    def map_law(self, constants: Constants, map_constants: MapConstants) -> MapLaw:
        """The map's law."""
        return MapLaw(self.own_spectrum, **self.curves, constants=constants, map_constants=map_constants)


def cases(data: xr.Dataset) -> list[Case]:
    """Surfaces of a file by `python -m generate boundary_elements`, refinements left out."""
    kinds = data.kind.attrs["flag_meanings"].split()
    found = []
    for number in range(data.sizes["surface"]):
        one = data.isel(surface=number)
        if (split := SPLITS[int(one.split)]) not in (TRAINING, HELD_OUT_SURFACE, HELD_OUT_SPECTRUM):
            continue
        kind, hurst, zeta_1 = kinds[int(one.kind)], float(one.hurst), float(one.zeta_1)
        share, x = one.band_variance.values, one.band_q.values
        plain = kind == "self_affine"
        seen = np.isfinite(one.force.values) & (one.area.values > 0) & (one.area.values < MAX_AREA)
        curves: dict[str, Any] = {
            name: one[name].values.astype(float) for name in ("mean_height", "top_gradient", "tension_force", "tension")
        }
        curves["anisotropy"] = float(one.anisotropy)
        own_spectrum = Spectrum.from_shares(x[share > 0], share[share > 0])
        found.append(
            Case(
                kind,
                split,
                (kind, hurst, zeta_1, int(one.waves), float(one["shape"])),
                int(one.waves),
                int(one.points),
                Spectrum.self_affine(hurst, zeta_1) if plain else own_spectrum,
                own_spectrum,
                float(one.h_max),
                curves,
                *(one[name].values[seen] for name in ("force", "area", "mean_separation")),
            )
        )
    return found
