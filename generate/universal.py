"""The universal table: Phi_F and Phi_A over (X, mu)."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.stats import qmc

from generate.build import ConformancePoints, UncertifiedError
from generate.configuration import Configuration, make_axis
from mbma_tables.arguments import FloatArray
from mbma_tables.islands.height_integrals import height_integral
from mbma_tables.islands.island import geometry
from mbma_tables.surfaces.readings import READINGS
from mbma_tables.tablefiles.interpolate import fill_gradient_2d
from mbma_tables.tablefiles.schema import Axis, TableContent

VISITED = {"hurst": (0.05, 1.0), "log10_zeta_1": (0.4786, 8.0), "log10_approach": (-7.0, 1.0)}


def visited_surfaces(count: int, seed: int, ranges: dict[str, tuple[float, float]]) -> list[FloatArray]:
    """H, zeta_1 and delta/h_rms of `count` islands, low-discrepancy over the ranges."""
    low, high = np.array(list(ranges.values())).T
    hurst, zeta_1, approach = qmc.scale(qmc.Halton(3, seed=seed).random(count), low, high).T
    return [hurst, 10**zeta_1, 10**approach]


class Universal:
    """`build.Kind` of the universal table."""

    def __init__(self, configuration: Configuration) -> None:
        self.configuration = configuration

    def axes(self, nodes: dict[str, int]) -> tuple[Axis, ...]:
        """X on log(X + offset), mu on log(mu)."""
        given = self.configuration.axes
        return (
            make_axis("X", "approach of the island over its summits' sigma", "log", given["X"], nodes["X"]),
            make_axis("mu", "stiffness of the roughness against the sphere", "log", given["mu"], nodes["mu"]),
        )

    def arguments(self, *coordinates: FloatArray) -> tuple[FloatArray, FloatArray]:
        """X and mu are the coordinates."""
        X, mu = coordinates
        return X, mu

    def manifold(self, count: int) -> list[FloatArray]:
        """(X, mu) of islands of random surfaces, both readings, as far as the table covers them."""
        X_range, mu_range = (self.configuration.axes[name] for name in ("X", "mu"))
        X = mu = np.empty(0)
        draw = 4 * count
        while X.size < count:
            hurst, zeta_1, approach = visited_surfaces(draw, self.configuration.seed + 7, VISITED)
            fields = [geometry(approach, hurst, zeta_1, reading) for reading in READINGS.values()]
            X, mu = (np.concatenate([f[name] for f in fields]) for name in ("X", "mu"))
            inside = (X_range.low < X) & (X_range.high > X) & (mu > mu_range.low) & (mu < mu_range.high)
            X, mu = X[inside], mu[inside]
            draw *= 2
        chosen = np.linspace(0, X.size - 1, count).astype(int)
        return [X[chosen], mu[chosen]]

    def auxiliary(self, axes: tuple[Axis, ...]) -> dict[str, Any]:
        """Nothing more."""
        return {}

    def attributes(self) -> dict[str, Any]:
        """What the file says of itself."""
        return {
            "title": "Island problem of the MBMA model of rough contact (Greenwood and Tripp 1967)",
            "source": "python -m generate universal",
            "references": (
                "Guo, Ma, Zhu: A magnification-based multi-asperity (MBMA) model of rough contact, Eqs. 34-40; "
                "Greenwood and Tripp (1967)"
            ),
            "comment": (
                "F^i = E* sigma L Phi_F, A^i = eta pi D R_u sigma L^2 Phi_A with L = sqrt(2 R_d sigma); serves every "
                "reading. Phi = Phi_rigid exp(g), g the spline of log_ratio; Phi_F,rigid = mu pi F_5/2(-X)/5, "
                "Phi_A,rigid = pi F_2(-X)/2, F_n(x) = integral_x^inf (z - x)^n phi(z) dz, "
                "phi the standard normal density"
            ),
            "reading": "any",
        }

    def conformance(self, places: list[FloatArray]) -> ConformancePoints:
        """X and mu as they are."""
        X, mu = places
        return ConformancePoints({"X": X, "mu": mu}, places, X, mu, np.ones((2, X.size)), np.zeros(X.size))

    def check(self, content: TableContent) -> None:
        """Force and area positive and increasing in X, force increasing in mu, the rigid limit met."""
        X_axis, mu_axis = content.axes
        places = [np.arange(3 * (axis.nodes - 1) + 1) / 3 for axis in content.axes]
        x, y = (p.ravel() for p in np.meshgrid(*places, indexing="ij"))
        out = np.empty((6, x.size))
        fill_gradient_2d(content.coefficients, x, y, out)
        X = X_axis.coordinate(x)
        # d(position)/dX and d(position)/d(log mu)
        by_X = 1 / (X_axis.step * (X + X_axis.offset))
        by_mu = 1 / mu_axis.step
        force_slope = out[1] * by_X + 2.5 * height_integral(1.5, -X) / height_integral(2.5, -X)
        area_slope = out[4] * by_X + 2.0 * height_integral(1.0, -X) / height_integral(2.0, -X)
        lowest = y == 0
        checks = {
            "force and area finite and positive": np.isfinite(np.exp(out[[0, 3]])).all(),
            "force and area no larger than a rigid sphere's": (out[[0, 3]] <= self.configuration.target).all(),
            "force increasing in X": (force_slope > 0).all(),
            "area increasing in X": (area_slope > 0).all(),
            "force increasing in mu": (1 + out[2] * by_mu > 0).all(),
            "rigid limit: log ratio proportional to mu at the smallest mu": (
                np.abs(out[2][lowest] * by_mu - out[0][lowest]) <= self.configuration.target
            ).all(),
        }
        for rule, kept in checks.items():
            if not kept:
                raise UncertifiedError(f"universal: between its nodes the table breaks: {rule}")
