"""The universal table: Phi_F and Phi_A over (X, mu)."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.stats import qmc

from generate.tables.build import ConformancePoints, UncertifiedError
from generate.tables.configuration import Configuration, make_axis
from mbma_tables.arguments import FloatArray
from mbma_tables.islands.geometry import geometry
from mbma_tables.islands.height_integrals import height_integral
from mbma_tables.surfaces.readings import READINGS
from mbma_tables.tablefiles.interpolate import fill_gradient_2d
from mbma_tables.tablefiles.schema import DEGREES, SYMBOLS, UNIVERSAL, Axis, TableContent, grid_labels, numbered

LOOKUP = (
    "X = (delta - h_d)/sigma and mu = (8/3) D sigma sqrt(2 R_u R_d) of the island, in any consistent units",
    "on each axis: p by its position_formula, i = min(floor(p), nodes - 2), u = p - i, w_k(u) of spline_weights; "
    "for a mu below its first see out_of_range",
    "g_F = sum over k, m = 0 ... 5 of w_k(u_X) w_m(u_mu) spline_F[i_X + k, i_mu + m]; g_A the same of spline_A",
    "Phi_F = exp(g_F) pi mu F_5/2(-X)/5 and Phi_A = exp(g_A) pi F_2(-X)/2, F_n as height_integrals says; "
    "without the exponentials this is the limit of a rigid sphere, mu to 0",
    "the island's force is E* sigma L Phi_F, its contact area eta pi D R_u sigma L^2 Phi_A, L = sqrt(2 R_d sigma)",
    "error_F and error_A, as error_field says, bound the relative error of Phi_F and Phi_A",
)
VISITED = {"hurst": (0.05, 1.0), "log10_zeta_1": (0.4786, 8.0), "log10_approach": (-7.0, 1.0)}
MAX_DRAWS = 400  # islands drawn for each that a narrow table covers


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
            make_axis("X", "how deep the island is: (delta - h_d)/sigma", "log", given["X"], nodes["X"]),
            make_axis(
                "mu", "stiffness of the roughness: (8/3) D sigma sqrt(2 R_u R_d)", "log", given["mu"], nodes["mu"]
            ),
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
            if draw > MAX_DRAWS * count:
                raise UncertifiedError("universal: hardly a surface visits these axes, so there is nothing to certify")
            hurst, zeta_1, approach = visited_surfaces(draw, self.configuration.seed + 7, VISITED)
            fields = [geometry(approach, hurst, zeta_1, reading) for reading in READINGS.values()]
            X, mu = (np.concatenate([f[name] for f in fields]) for name in ("X", "mu"))
            inside = (X_range.low < X) & (X_range.high > X) & (mu > mu_range.low) & (mu < mu_range.high)
            X, mu = X[inside], mu[inside]
            draw *= 2
        chosen = np.linspace(0, X.size - 1, count).astype(int)
        return [X[chosen], mu[chosen]]

    def auxiliary(self, axes: tuple[Axis, ...]) -> dict[str, Any]:
        """Coordinates of coefficients and error cells."""
        return grid_labels(axes, DEGREES[UNIVERSAL])

    def attributes(self) -> dict[str, Any]:
        """Attributes of the file."""
        return {
            "title": "Island problem of the MBMA model of rough contact (Greenwood and Tripp 1967)",
            "history": "made by python -m generate tables universal",
            "source": "numerical solution of the integral equation by mbma_tables",
            "references": (
                "Guo, Ma, Zhu: A magnification-based multi-asperity (MBMA) model of rough contact, Eqs. 34-40; "
                "Greenwood and Tripp (1967)"
            ),
            "summary": (
                "Force Phi_F and area Phi_A of a contact island, a sphere covered with summits of normally distributed "
                "heights, as functions of two numbers: X, how deep, and mu, how stiff the roughness is against "
                "the sphere. With heights in units of sigma and radii rho in units of L: "
                "d(rho) = rho^2 - X + w(rho), p(rho) = (mu/2) F_3/2(d), w(rho) = (4/pi) integral over t from 0 to "
                "infinity of t/(t + rho) p(t) K(k) dt, K of modulus k = 2 sqrt(rho t)/(rho + t); "
                "Phi_F = 2 pi integral of rho p, Phi_A = 2 pi integral of rho F_1(d)"
            ),
            "symbols": SYMBOLS,
            **numbered("lookup", LOOKUP),
            "reading": "any",
            "reading_numbers": "[]",
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
            "rigid limit: log ratio proportional to mu at the smallest mu (try a lower axes.mu.low)": (
                np.abs(out[2][lowest] * by_mu - out[0][lowest]) <= self.configuration.target
            ).all(),
        }
        for rule, kept in checks.items():
            if not kept:
                raise UncertifiedError(f"universal: between its nodes the table breaks: {rule}")
