"""The four-parameter table: islands over (delta/h_rms, zeta_d, zeta_u, H), on axes that follow the physics.

    X       approach over the summits' sigma, for delta/h_rms = X sigma + zeta_d^(-H)
    spread  zeta_u/zeta_d - 1
    sphere  (1.25/zeta_d)^(4 - 2H), on which mu depends smoothly and little
    hurst   H

with sigma of Eq. (32) in units of s: the first parameter is read at zeta_1 without bound, where s is h_rms.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from generate.build import ConformancePoints, UncertifiedError, evaluate
from generate.configuration import Configuration, make_axis
from generate.universal import visited_surfaces
from mbma_tables.arguments import FloatArray
from mbma_tables.islands.height_integrals import height_integral
from mbma_tables.islands.island import geometry
from mbma_tables.models.raw import SPHERE_FLOOR, band_fields, from_axes, hat_scales, to_axes
from mbma_tables.surfaces.readings import get_reading
from mbma_tables.tablefiles.schema import Axis, TableContent

VISITED = {"hurst": (0.3, 1.0), "log10_zeta_1": (math.log10(3.001), 4.0), "log10_approach": (-8.0, 1.0)}


class Island4d:
    """`build.Kind` of the four-parameter table."""

    def __init__(self, configuration: Configuration) -> None:
        self.configuration = configuration
        self.reading = get_reading(configuration.reading)

    def axes(self, nodes: dict[str, int]) -> tuple[Axis, ...]:
        """X and spread on logarithms, sphere and hurst as they are."""
        given = self.configuration.axes
        rows = (
            ("X", "approach of the island over its summits' sigma", "log"),
            ("spread", "zeta_u/zeta_d - 1", "log"),
            ("sphere", f"({SPHERE_FLOOR}/zeta_d)^(4 - 2 hurst)", "linear"),
            ("hurst", "Hurst exponent", "linear"),
        )
        return tuple(make_axis(name, text, transform, given[name], nodes[name]) for name, text, transform in rows)

    def arguments(self, *coordinates: FloatArray) -> tuple[FloatArray, FloatArray]:
        """X is a coordinate, mu follows from the other three."""
        X, spread, sphere, hurst = (np.ascontiguousarray(c, dtype=float) for c in np.broadcast_arrays(*coordinates))
        mu = band_fields(spread, sphere, hurst, self.reading)[0]
        return X, mu

    def manifold(self, count: int) -> list[FloatArray]:
        """Islands of random surfaces, as far as the table's axes reach."""
        kept = [np.empty(0)] * 4
        draw = 2 * count
        while kept[0].size < count:
            hurst, zeta_1, approach = visited_surfaces(draw, self.configuration.seed + 7, VISITED)
            fields = geometry(approach, hurst, zeta_1, self.reading)
            spread = np.expm1(np.log(fields["zeta_u"]) - np.log(fields["zeta_d"]))
            sphere = (SPHERE_FLOOR / fields["zeta_d"]) ** (4 - 2 * hurst)
            places = [fields["X"], spread, sphere, hurst]
            inside = np.ones(draw, dtype=bool)
            for axis, place in zip(self.configuration.axes.values(), places, strict=True):
                inside &= (place > axis.low) & (place < axis.high)
            kept = [place[inside] for place in places]
            draw *= 2
        return [place[:count] for place in kept]

    def auxiliary(self, axes: tuple[Axis, ...]) -> dict[str, Any]:
        """The raw parameters on the grid, and the numbers that turn a ratio into a force."""
        _, spread, sphere, hurst = (axis.values for axis in axes)
        grid = np.meshgrid(spread, sphere, hurst, indexing="ij")
        mu, sigma, _ = band_fields(*grid, self.reading)
        zeta_d = from_axes(sphere[:, None], hurst)
        names = tuple(axis.name for axis in axes)
        return {
            "mu": (names[1:], mu, {"long_name": "stiffness of the roughness against the sphere", "units": "1"}),
            "sigma": (
                names[1:],
                sigma,
                {"long_name": "standard deviation of summit heights over s, times zeta_d^hurst", "units": "1"},
            ),
            "inverse_zeta_d": (
                names[2:],
                1 / zeta_d,
                {"long_name": "1/zeta_d; zeta_u = zeta_d (1 + spread)", "units": "1"},
            ),
        }

    def attributes(self) -> dict[str, Any]:
        """What the file says of itself."""
        return {
            "title": "Contact islands of the MBMA model of rough contact over its four parameters",
            "source": "python -m generate island4d",
            "references": (
                "Guo, Ma, Zhu: A magnification-based multi-asperity (MBMA) model of rough contact, Eqs. 26-40"
            ),
            "comment": (
                "Lookup from delta_over_h_rms, zeta_d, zeta_u, hurst: spread = zeta_u/zeta_d - 1; "
                f"sphere = ({SPHERE_FLOOR}/zeta_d)^(4 - 2 hurst); mu and sigma of the reading (docs/tables.md); "
                "X = (delta_over_h_rms - zeta_d^(-hurst))/sigma; Phi = Phi_rigid exp(g), g the spline of log_ratio. "
                "F_hat = sigma sqrt(2 R_d sigma) Phi_F, A_hat = 2 pi D R_u R_d sigma^2 Phi_A"
            ),
            "delta_over_h_rms": "X sigma_hat + zeta_d^(-hurst), sigma_hat = sigma zeta_d^(-hurst)",
            "reading": self.reading.name,
            "covers": (
                "every island that the model visits for 0.3 <= H <= 1, 3 < zeta_1 <= 1e4, 0 < delta/h_rms <= 10; "
                "spreads below the first are answered to first order in mu"
            ),
        }

    def conformance(self, places: list[FloatArray]) -> ConformancePoints:
        """The four raw numbers, and the coordinates that these numbers as stored have."""
        X, spread, sphere, hurst = places
        zeta_d = from_axes(sphere, hurst)
        sigma = band_fields(spread, sphere, hurst, self.reading)[1]
        raw = {
            "delta_over_h_rms": (X * sigma + 1) * zeta_d**-hurst,
            "zeta_d": zeta_d,
            "zeta_u": zeta_d * (1 + spread),
            "hurst": hurst,
        }
        found = to_axes(raw["delta_over_h_rms"], zeta_d, raw["zeta_u"], hurst, self.reading)
        scales = np.stack(hat_scales(found.spread, zeta_d, hurst, found.sigma, self.reading))
        conditioning = 1e-4 * (1 + found.X) / found.sigma
        return ConformancePoints(raw, found.axes, found.X, found.mu, scales, conditioning)

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
