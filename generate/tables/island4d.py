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

from generate.tables.certificate import conformance, enough, require, visited_surfaces
from generate.tables.configuration import Configuration, make_axis
from generate.tables.writing import TEXTS, about, label
from mbma_tables.common.arguments import FloatArray
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.four_numbers import SPHERE_FLOOR, band_fields, to_axes
from mbma_tables.islands.geometry import geometry
from mbma_tables.islands.height_integrals import height_integral
from mbma_tables.models.island4d import at_places
from mbma_tables.surfaces.spectrum import BROADENING
from mbma_tables.surfaces.variants import get_variant
from mbma_tables.tablefiles.schema import ISLAND4D, Axis, TableContent

VISITED = {"hurst": (0.3, 1.0), "log10_zeta_1": (math.log10(3.001), 4.0), "log10_approach": (-8.0, 1.0)}
COVER_TRIALS = 4096


def from_axes(sphere: Any, hurst: Any) -> Any:
    """zeta_d at a coordinate of the axis `sphere`; infinite at 0."""
    with np.errstate(divide="ignore"):
        return SPHERE_FLOOR * np.asarray(sphere, dtype=float) ** (-1 / (4 - 2 * np.asarray(hurst)))


def evaluate(coefs: FloatArray, positions: list[FloatArray]) -> FloatArray:
    """The table's spline at positions in node units, shape (entries, 2)."""
    return at_places(coefs, np.stack(positions)).T


class Island4d:
    """The four-parameter table of a configuration."""

    def __init__(self, configuration: Configuration) -> None:
        self.configuration = configuration
        self.variant = get_variant(configuration.variant)

    def axes(self, nodes: dict[str, int]) -> tuple[Axis, ...]:
        """Axes with these node counts."""
        return tuple(make_axis(ISLAND4D, name, self.configuration.axes[name], count) for name, count in nodes.items())

    def arguments(self, *coordinates: FloatArray) -> tuple[FloatArray, FloatArray]:
        """X and mu at coordinates of the axes: X is one of them, mu follows from the other three."""
        X, spread, sphere, hurst = (np.ascontiguousarray(c, dtype=float) for c in np.broadcast_arrays(*coordinates))
        return X, band_fields(spread, sphere, hurst, self.variant)[0]

    def manifold(self, count: int) -> list[FloatArray]:
        """Coordinates of `count` islands of random surfaces, as far as the table's axes reach."""

        def drawn(draw: int) -> list[FloatArray]:
            places, inside = self._visited(draw)
            return [place[inside] for place in places]

        return [place[:count] for place in enough(ISLAND4D, count, 2 * count, drawn)]

    def _visited(self, draw: int) -> tuple[list[FloatArray], NDArray[np.bool_]]:
        """Coordinates of islands of random surfaces, and which of them the axes cover."""
        own = self.configuration.axes["hurst"]
        ranges = VISITED | {"hurst": (own.low, own.high)}
        hurst, zeta_1, approach = visited_surfaces(draw, self.configuration.seed + 7, ranges)
        fields = geometry(approach, hurst, zeta_1, self.variant)
        spread = np.expm1(np.log(fields["zeta_u"]) - np.log(fields["zeta_d"]))
        places = [fields["X"], spread, (SPHERE_FLOOR / fields["zeta_d"]) ** (4 - 2 * hurst), hurst]
        pairs = zip(self.configuration.axes.values(), places, strict=True)
        return places, np.all([(place > axis.low) & (place < axis.high) for axis, place in pairs], axis=0)

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
        axes, (places, _) = self.configuration.axes, self._visited(COVER_TRIALS)
        # by trial; smaller spreads are covered too
        left = any(
            (place > axis.high).any() or (name != "spread" and (place < axis.low).any())
            for (name, axis), place in zip(axes.items(), places, strict=True)
        )
        covers = (
            f"{'the islands within the axes, of those' if left else 'every island'} that the model visits for "
            f"{axes['hurst'].low:g} <= H <= {axes['hurst'].high:g}, 3 < zeta_1 <= 1e4, 0 < delta/h_rms <= 10; "
            "spreads below the first are answered to first order in mu"
        )
        return {
            **about(ISLAND4D, floor=SPHERE_FLOOR, divisor=self.variant.density_divisor, sigma=sigma),
            "variant": self.variant.name,
            "variant_numbers": json.dumps(self.variant.recorded),
            "covers": covers,
        }

    def conformance(self, axes: tuple[Axis, ...], coefs: FloatArray, places: list[FloatArray]) -> dict[str, FloatArray]:
        """Points to replay near coordinates of the axes: the four raw numbers, and what these as stored give."""
        X, spread, sphere, hurst = places
        zeta_d = from_axes(sphere, hurst)
        sigma = band_fields(spread, sphere, hurst, self.variant)[1]
        delta, zeta_u = (X * sigma + 1) * zeta_d**-hurst, zeta_d * (1 + spread)
        raw = {"delta_over_h_rms": delta, "zeta_d": zeta_d, "zeta_u": zeta_u, "hurst": hurst}
        found = to_axes(delta, zeta_d, zeta_u, hurst, self.variant)
        scales, rigid = np.stack([found.force, found.area]), greenwood_tripp.rigid_sphere(found.X, found.mu)
        positions = [axis.position(x) for axis, x in zip(axes, found[:4], strict=True)]
        table = scales * np.exp(evaluate(coefs, positions).T) * rigid
        return conformance(raw, found.X, found.mu, table, scales, 1e-4 * (1 + found.X) / found.sigma)

    def check(self, content: TableContent) -> None:
        """Force and area finite and positive, below the rigid sphere's, increasing in X, force increasing in mu."""
        places = [np.arange(2 * (axis.nodes - 1) + 1) / 2 for axis in content.axes[:2]]
        places += [np.minimum(np.arange(axis.nodes - 0.5), axis.nodes - 1) for axis in content.axes[2:]]
        grid = np.meshgrid(*places, indexing="ij")
        ratio = evaluate(content.coefficients, [g.ravel() for g in grid]).reshape(*grid[0].shape, 2)
        X = content.axes[0].coordinate(places[0])[:, None, None, None]
        _, mu = self.arguments(*(axis.coordinate(g) for axis, g in zip(content.axes, grid, strict=True)))
        force = ratio[..., 0] + np.log(height_integral(2.5, -X)) + np.log(mu)
        area = ratio[..., 1] + np.log(height_integral(2.0, -X))
        rules = {
            "force and area finite": np.isfinite(force).all() and np.isfinite(area).all(),
            "force and area no larger than a rigid sphere's": (ratio <= self.configuration.target).all(),
            "force increasing in X": (np.diff(force, axis=0) > 0).all(),
            "area increasing in X": (np.diff(area, axis=0) > 0).all(),
            "force increasing with the spread": (np.diff(force, axis=1) > 0).all(),
            "rigid limit at the smallest spread": (np.abs(ratio[:, 0]) <= 100 * mu[:, 0, ..., None]).all(),
        }
        require(ISLAND4D, "between its nodes", rules)
