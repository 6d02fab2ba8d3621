"""The four-parameter table: islands over (delta/h_rms, zeta_d, zeta_u, H), on axes that follow the physics.

    X       approach over the summits' sigma, for delta/h_rms = X sigma + zeta_d^(-H)
    spread  zeta_u/zeta_d - 1
    sphere  (1.25/zeta_d)^(4 - 2H), on which mu depends smoothly and little
    hurst   H

with sigma of Eq. (32) in units of s: the first parameter is read at zeta_1 without bound, where s is h_rms.
"""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generate.tables.build import ConformancePoints, UncertifiedError, evaluate
from generate.tables.configuration import Configuration, make_axis
from generate.tables.universal import MAX_DRAWS, visited_surfaces
from generate.tables.writing import TEXTS, about, label
from mbma_tables.common.arguments import FloatArray
from mbma_tables.islands.four_numbers import SPHERE_FLOOR, band_fields, to_axes
from mbma_tables.islands.geometry import geometry
from mbma_tables.islands.height_integrals import height_integral
from mbma_tables.surfaces.spectrum import BROADENING
from mbma_tables.surfaces.variants import get_variant
from mbma_tables.tablefiles.schema import ISLAND4D, Axis, TableContent

VISITED = {"hurst": (0.3, 1.0), "log10_zeta_1": (math.log10(3.001), 4.0), "log10_approach": (-8.0, 1.0)}
COVER_TRIALS = 4096


def from_axes(sphere: Any, hurst: Any) -> Any:
    """zeta_d at a coordinate of the axis `sphere`; infinite at 0."""
    with np.errstate(divide="ignore"):
        return SPHERE_FLOOR * np.asarray(sphere, dtype=float) ** (-1 / (4 - 2 * np.asarray(hurst)))


class Island4d:
    """`build.Kind` of the four-parameter table."""

    def __init__(self, configuration: Configuration) -> None:
        self.configuration = configuration
        self.variant = get_variant(configuration.variant)

    def axes(self, nodes: dict[str, int]) -> tuple[Axis, ...]:
        """X and spread on logarithms, sphere and hurst as they are."""
        return tuple(make_axis(ISLAND4D, name, self.configuration.axes[name], count) for name, count in nodes.items())

    def arguments(self, *coordinates: FloatArray) -> tuple[FloatArray, FloatArray]:
        """X is a coordinate, mu follows from the other three."""
        X, spread, sphere, hurst = (np.ascontiguousarray(c, dtype=float) for c in np.broadcast_arrays(*coordinates))
        mu = band_fields(spread, sphere, hurst, self.variant)[0]
        return X, mu

    def manifold(self, count: int) -> list[FloatArray]:
        """Islands of random surfaces, as far as the table's axes reach."""
        kept = [np.empty(0)] * 4
        draw = 2 * count
        while kept[0].size < count:
            if draw > MAX_DRAWS * count:
                raise UncertifiedError("island4d: hardly a surface visits these axes, so there is nothing to certify")
            places, inside = self._visited(draw)
            kept = [place[inside] for place in places]
            draw *= 2
        return [place[:count] for place in kept]

    def _visited(self, draw: int) -> tuple[list[FloatArray], NDArray[np.bool_]]:
        """Coordinates of islands of random surfaces, and which of them the axes cover."""
        own = self.configuration.axes["hurst"]
        ranges = VISITED | {"hurst": (own.low, own.high)}
        hurst, zeta_1, approach = visited_surfaces(draw, self.configuration.seed + 7, ranges)
        fields = geometry(approach, hurst, zeta_1, self.variant)
        spread = np.expm1(np.log(fields["zeta_u"]) - np.log(fields["zeta_d"]))
        sphere = (SPHERE_FLOOR / fields["zeta_d"]) ** (4 - 2 * hurst)
        places = [fields["X"], spread, sphere, hurst]
        inside = np.ones(draw, dtype=bool)
        for axis, place in zip(self.configuration.axes.values(), places, strict=True):
            inside &= (place > axis.low) & (place < axis.high)
        return places, inside

    def _covers(self) -> str:
        """Whether surfaces can leave the axes, by trial."""
        axes = self.configuration.axes
        places, _ = self._visited(COVER_TRIALS)
        left = any(
            (place > axis.high).any() or (name != "spread" and (place < axis.low).any())
            for (name, axis), place in zip(axes.items(), places, strict=True)
        )
        return (
            f"{'the islands within the axes, of those' if left else 'every island'} that the model visits for "
            f"{axes['hurst'].low:g} <= H <= {axes['hurst'].high:g}, 3 < zeta_1 <= 1e4, 0 < delta/h_rms <= 10; "
            "spreads below the first are answered to first order in mu"
        )

    def auxiliary(self, axes: tuple[Axis, ...]) -> dict[str, Any]:
        """The raw parameters on the grid, and the numbers that turn a ratio into a force."""
        _, spread, sphere, hurst = (axis.values for axis in axes)
        mu, sigma, _, _ = band_fields(*np.meshgrid(spread, sphere, hurst, indexing="ij"), self.variant)
        names, inverse = tuple(axis.name for axis in axes), 1 / from_axes(sphere[:, None], hurst)
        return {
            "mu": (names[1:], mu, label(TEXTS["axes"]["mu"])),
            "sigma": (names[1:], sigma, label("standard deviation of summit heights over s, times zeta_d^hurst")),
            "inverse_zeta_d": (names[2:], inverse, label("1/zeta_d; zeta_u = zeta_d (1 + spread)")),
        }

    def attributes(self) -> dict[str, Any]:
        """Attributes of the file."""
        sigma = f"sqrt((1 - {BROADENING}/alpha) m0)" if self.variant.summit_sigma else "sqrt(m0)"
        return {
            **about(ISLAND4D, floor=SPHERE_FLOOR, divisor=self.variant.density_divisor, sigma=sigma),
            "variant": self.variant.name,
            "variant_numbers": json.dumps(self.variant.recorded),
            "covers": self._covers(),
        }

    def conformance(self, places: list[FloatArray]) -> ConformancePoints:
        """The four raw numbers, and the coordinates that these numbers as stored have."""
        X, spread, sphere, hurst = places
        zeta_d = from_axes(sphere, hurst)
        sigma = band_fields(spread, sphere, hurst, self.variant)[1]
        raw = {
            "delta_over_h_rms": (X * sigma + 1) * zeta_d**-hurst,
            "zeta_d": zeta_d,
            "zeta_u": zeta_d * (1 + spread),
            "hurst": hurst,
        }
        found = to_axes(raw["delta_over_h_rms"], zeta_d, raw["zeta_u"], hurst, self.variant)
        conditioning = 1e-4 * (1 + found.X) / found.sigma
        scales = np.stack([found.force, found.area])
        return ConformancePoints(raw, found[:4], found.X, found.mu, scales, conditioning)

    def check(self, content: TableContent) -> None:
        """Force and area finite and positive, below the rigid sphere's, increasing in X, force increasing in mu."""
        places = [np.arange(2 * (axis.nodes - 1) + 1) / 2 for axis in content.axes[:2]]
        places += [np.arange(axis.nodes - 0.5) for axis in content.axes[2:]]
        places = [np.minimum(p, axis.nodes - 1) for p, axis in zip(places, content.axes, strict=True)]
        grid = np.meshgrid(*places, indexing="ij")
        ratio = evaluate(content.coefficients, [g.ravel() for g in grid]).reshape(*grid[0].shape, 2)
        X = content.axes[0].coordinate(places[0])[:, None, None, None]
        coordinates = [axis.coordinate(g) for axis, g in zip(content.axes, grid, strict=True)]
        _, mu = self.arguments(*coordinates)
        force = ratio[..., 0] + np.log(height_integral(2.5, -X)) + np.log(mu)
        area = ratio[..., 1] + np.log(height_integral(2.0, -X))
        target = self.configuration.target
        checks = {
            "force and area finite": np.isfinite(force).all() and np.isfinite(area).all(),
            "force and area no larger than a rigid sphere's": (ratio <= target).all(),
            "force increasing in X": (np.diff(force, axis=0) > 0).all(),
            "area increasing in X": (np.diff(area, axis=0) > 0).all(),
            "force increasing with the spread": (np.diff(force, axis=1) > 0).all(),
            "rigid limit at the smallest spread": (np.abs(ratio[:, 0]) <= 100 * mu[:, 0, ..., None]).all(),
        }
        for rule, kept in checks.items():
            if not kept:
                raise UncertifiedError(f"island4d: between its nodes the table breaks: {rule}")
