"""The four-parameter table: islands over (delta/h_rms, zeta_d, zeta_u, H), on axes that follow the physics.

    X       approach over the summits' sigma, for delta/h_rms = X sigma + zeta_d^(-H)
    spread  zeta_u/zeta_d - 1
    sphere  (1.25/zeta_d)^(4 - 2H), on which mu depends smoothly and little
    hurst   H

with sigma of Eq. (32) in units of s: the first parameter is read at zeta_1 without bound,
where s is h_rms.
"""

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc
from threadpoolctl import threadpool_limits

from mbma_tables.common.arguments import FloatArray, filled
from mbma_tables.common.errors import UncertifiedError
from mbma_tables.core import core
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.geometry import geometry
from mbma_tables.islands.variants import Variant, get_variant
from mbma_tables.surfaces.spectrum import BROADENING
from mbma_tables.tables.certificate import (
    CONFORMANCE_POINTS,
    Forecast,
    Kind,
    conformance,
)
from mbma_tables.tables.island4d import (
    SPHERE_FLOOR,
    band_fields,
    core_table,
    to_axes,
)
from mbma_tables.tables.schema import (
    DEGREE,
    FUNCTIONS,
    ISLAND4D,
    Axis,
    TableContent,
)
from mbma_tables.tables.splines import coefficients, padding
from mbma_tables.tables.writer import TEXTS, about, label

VISITED = {
    "hurst": (0.3, 1.0),
    "log10_zeta_1": (math.log10(3.001), 4.0),
    "log10_approach": (-8.0, 1.0),
}
COVER_TRIALS = 4096
# islands that are solved for a forecast; bytes of a file, and of one of its nodes
SAMPLED = 256
FILE_BYTES = 1e5
BYTES_PER_NODE = 32
BLAS_THREADS = 2  # as when the shipped table was made
LOCAL_FLOOR = 0.8  # smallest bound, in units of the islands' tolerance
LOCAL_FACTOR = 1.5  # bound over the sum of the largest errors along the edges of a cell
# places on an edge, in units of nodes, where errors of a quintic spline are largest: of an
# even shape in the middle, of an odd one at both sides of it
EDGE_PLACES = (0.25, 0.5, 0.75)
# spreads below the first, over it: the error of first order in mu is largest at half its mu,
# which is proportional to the root of the spread
BELOW = (1 / 16, 1 / 4, 9 / 16)


def from_axes(sphere: Any, hurst: Any) -> Any:
    """zeta_d at a coordinate of the axis `sphere`; infinite at 0."""
    with np.errstate(divide="ignore"):
        return SPHERE_FLOOR * np.asarray(sphere, dtype=float) ** (
            -1 / (4 - 2 * np.asarray(hurst))
        )


def single(values: FloatArray) -> FloatArray:
    """`values` rounded to single precision, upwards."""
    rounded = values.astype(np.float32)
    above = np.nextafter(rounded, np.float32(np.inf))
    return np.where(rounded < values, above, rounded).astype(float)


def along_edges(errors: FloatArray, axis: int) -> tuple[FloatArray, FloatArray]:
    """Largest errors above and below 0 at the edges of each cell that are parallel to an axis.

    `errors` has the cells of this axis, then the places on an edge, in the place of the axis,
    and the nodes of the other axes; last axis F, A.
    """
    above = errors.max(axis=axis + 1).clip(0)
    below = (-errors.min(axis=axis + 1)).clip(0)
    for other in range(4):
        if other != axis:
            above, below = (
                np.maximum(
                    np.delete(part, -1, axis=other), np.delete(part, 0, axis=other)
                )
                for part in (above, below)
            )
    return above, below


class Island4d(Kind):
    """The four-parameter table of a configuration."""

    # errors of the spline are far below the target in most cells, and their bounds with them
    solver_share = 1e-5

    @property
    def variant(self) -> Variant:
        """The variant of the paper that it is made for."""
        return get_variant(self.configuration.variant)

    # the spline's factors are rounded differently on another number of BLAS threads
    @threadpool_limits.wrap(limits=BLAS_THREADS)
    def build(self) -> TableContent:
        """The table, certified."""
        own = self.configuration
        axes = tuple(own.axes.values())
        grid = np.meshgrid(*(axis.values for axis in axes), indexing="ij")
        values = self.log_ratio("island4d table", *self.arguments(*grid), rtol=self.rtol)
        coefs = coefficients(values, DEGREE, len(axes)).astype(np.float32).astype(float)
        certified = self.certify(axes, coefs)
        content = TableContent(
            kind=ISLAND4D,
            axes=axes,
            coefficients=coefs,
            local_error=self.local_errors(axes, coefs),
            auxiliary=self.auxiliary(axes, values),
            conformance=self.conformance(
                axes, coefs, self.held_out(axes, CONFORMANCE_POINTS, own.seed + 303)
            ),
            attributes=self.attributes() | certified | own.attributes(),
        )
        return self.checked(content)

    def forecast(self) -> Forecast:
        """What `build` would take: islands at nodes, at places on edges, and held-out ones."""
        own = self.configuration
        axes = tuple(own.axes.values())
        nodes = math.prod(axis.nodes for axis in axes)
        solved = nodes * (1 + len(EDGE_PLACES) * len(axes))
        box = qmc.Halton(len(axes), seed=own.seed).random(SAMPLED)
        X, mu = self.arguments(
            *(
                axis.coordinate(place * (axis.nodes - 1))
                for axis, place in zip(axes, box.T, strict=True)
            )
        )
        seconds = solved * self.seconds_of(X, mu) / self.workers
        seconds += own.certificate_points * self.seconds_of(X, mu, 2) / self.workers
        return Forecast(
            nodes,
            solved + own.certificate_points,
            seconds,
            round(FILE_BYTES + BYTES_PER_NODE * nodes),
        )

    def held_out(self, axes: tuple[Axis, ...], count: int, seed: int) -> list[FloatArray]:
        """Coordinates of certificate points: half over the whole box, half where surfaces really go."""
        box = qmc.Halton(len(axes), seed=seed).random(count // 2)
        spread = [
            axis.coordinate(d * (axis.nodes - 1))
            for axis, d in zip(axes, box.T, strict=True)
        ]
        return [
            np.concatenate(pair)
            for pair in zip(spread, self.manifold(count - count // 2), strict=True)
        ]

    def certify(self, axes: tuple[Axis, ...], coefs: FloatArray) -> dict[str, Any]:
        """Errors on held-out points, solved on twice the nodes that made the table."""
        places = self.held_out(
            axes, self.configuration.certificate_points, self.configuration.seed + 101
        )
        positions = [axis.position(x) for axis, x in zip(axes, places, strict=True)]
        if any((p == np.round(p)).any() for p in positions):
            raise UncertifiedError("island4d: a held-out point lies on a node")
        errors = np.abs(self.errors("certificate", axes, coefs, places, self.rtol, 2))
        return self.certificate(
            errors, {axis.name: x for axis, x in zip(axes, places, strict=True)}
        )

    def evaluate(
        self, axes: tuple[Axis, ...], coefs: FloatArray, places: Sequence[FloatArray]
    ) -> FloatArray:
        """Phi_F and Phi_A by the table at coordinates of the axes, shape (entries, 2)."""
        flat = [np.ascontiguousarray(place, dtype=float).ravel() for place in places]
        mu = self.arguments(*flat)[1]
        no_errors = np.zeros((*(axis.nodes - 1 for axis in axes), 2))
        table = core_table(axes, coefs, no_errors, self.variant)
        return filled(core.island_answers, (*flat, mu), 3, *table)[:2].T

    def errors(
        self,
        label: str,
        axes: tuple[Axis, ...],
        coefs: FloatArray,
        places: Sequence[FloatArray],
        rtol: float,
        refinement: int = 1,
    ) -> FloatArray:
        """Relative errors of the table at coordinates of the axes of one shape, (..., 2)."""
        exact = self.phi(label, *self.arguments(*places), rtol, refinement)
        return self.evaluate(axes, coefs, places).reshape(exact.shape) / exact - 1

    def local_errors(self, axes: tuple[Axis, ...], coefs: FloatArray) -> FloatArray:
        """Bounds on the error in each cell, by the errors at places on its edges.

        At nodes the spline is exact, and errors inside a cell are nearly the sum of one for
        each axis, which those at the edges are.
        """
        rtol = max(0.1 * self.rtol, greenwood_tripp.MIN_SOLVER_RTOL)
        cells = tuple(axis.nodes - 1 for axis in axes)
        above, below = np.zeros((2, *cells, 2))
        for number, axis in enumerate(axes):
            edges = np.arange(cells[number])[:, None] + EDGE_PLACES
            lines = [other.values for other in axes]
            lines[number] = axis.coordinate(edges.ravel())
            places = np.meshgrid(*lines, indexing="ij")
            errors = self.errors(f"errors along {axis.name}", axes, coefs, places, rtol)
            shape = *errors.shape[:number], *edges.shape, *errors.shape[number + 1 :]
            parts = along_edges(errors.reshape(shape), number)
            above += parts[0]
            below += parts[1]
        bound = LOCAL_FACTOR * np.maximum(above, below) + LOCAL_FLOOR * self.rtol
        first = [axis.values for axis in axes]
        first[1] = axes[1].low * np.array(BELOW)
        places = np.meshgrid(*first, indexing="ij")
        errors = np.abs(self.errors("errors below", axes, coefs, places, rtol))
        beyond, _ = along_edges(errors[:, None], 1)
        bound[:, :1] += LOCAL_FACTOR * beyond
        return single(bound)

    def arguments(self, *coordinates: FloatArray) -> tuple[FloatArray, FloatArray]:
        """X and mu at coordinates of the axes: X is one of them, mu follows from the other three."""
        X, spread, sphere, hurst = (
            np.ascontiguousarray(c, dtype=float)
            for c in np.broadcast_arrays(*coordinates)
        )
        return X, band_fields(spread, sphere, hurst, self.variant)[0]

    def manifold(self, count: int) -> list[FloatArray]:
        """Coordinates of `count` islands of random surfaces, as far as the table's axes reach."""

        def drawn(draw: int) -> list[FloatArray]:
            places, inside = self._visited(draw)
            return [place[inside] for place in places]

        return [place[:count] for place in self.enough(count, 2 * count, drawn)]

    def _visited(self, draw: int) -> tuple[list[FloatArray], NDArray[np.bool_]]:
        """Coordinates of islands of random surfaces, and which of them the axes cover."""
        own = self.configuration.axes["hurst"]
        approach, hurst, zeta_1 = self.visited_surfaces(
            draw, VISITED | {"hurst": (own.low, own.high)}
        )
        fields = geometry(approach, hurst, zeta_1, self.variant)
        spread = np.expm1(np.log(fields["zeta_u"]) - np.log(fields["zeta_d"]))
        places = [
            fields["X"],
            spread,
            (SPHERE_FLOOR / fields["zeta_d"]) ** (4 - 2 * hurst),
            hurst,
        ]
        pairs = zip(self.configuration.axes.values(), places, strict=True)
        return places, np.all(
            [(place > axis.low) & (place < axis.high) for axis, place in pairs], axis=0
        )

    def auxiliary(self, axes: tuple[Axis, ...], log_ratio: FloatArray) -> dict[str, Any]:
        """Values at the nodes, the raw parameters there, and coordinates of coefficients and of the error's cells."""
        _, spread, sphere, hurst = (axis.values for axis in axes)
        mu, sigma, _, _ = band_fields(
            *np.meshgrid(spread, sphere, hurst, indexing="ij"), self.variant
        )
        names = tuple(axis.name for axis in axes)
        inverse = 1 / from_axes(sphere[:, None], hurst)
        found: dict[str, Any] = {
            "mu": (names[1:], mu, label(TEXTS["axes"]["mu"])),
            "sigma": (
                names[1:],
                sigma,
                label("standard deviation of summit heights over s, times zeta_d^hurst"),
            ),
            "inverse_zeta_d": (
                names[2:],
                inverse,
                label("1/zeta_d; zeta_u = zeta_d (1 + spread)"),
            ),
        }
        for number, f in enumerate(FUNCTIONS):
            text = f"natural logarithm of Phi_{f} over its value for a rigid sphere, at the nodes"
            found[f"log_ratio_{f}"] = (names, log_ratio[..., number], label(text))
        for axis in axes:
            cell = f"{axis.name}_cell"
            knot = f"{axis.name}_knot"
            middles = axis.coordinate(np.arange(axis.nodes - 1) + 0.5)
            knots = np.arange(-padding(DEGREE), axis.nodes + padding(DEGREE), dtype=float)
            text = f"middle of the cells along {axis.name}, as {axis.name}"
            found[cell] = ((cell,), middles, label(text))
            text = f"position along {axis.name}, in node units, of the middle of a coefficient's B-spline"
            found[knot] = ((knot,), knots, label(text))
        return found

    def attributes(self) -> dict[str, Any]:
        """Attributes of its file."""
        sigma = (
            f"sqrt((1 - {BROADENING}/alpha) m0)"
            if self.variant.summit_sigma
            else "sqrt(m0)"
        )
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
            **about(
                ISLAND4D,
                floor=SPHERE_FLOOR,
                divisor=self.variant.density_divisor,
                sigma=sigma,
            ),
            "variant": self.variant.name,
            "variant_numbers": json.dumps(self.variant.recorded),
            "covers": covers,
        }

    def conformance(
        self, axes: tuple[Axis, ...], coefs: FloatArray, places: list[FloatArray]
    ) -> dict[str, FloatArray]:
        """Points to replay near coordinates of the axes: the four raw numbers, and what these as stored give."""
        X, spread, sphere, hurst = places
        zeta_d = from_axes(sphere, hurst)
        sigma = band_fields(spread, sphere, hurst, self.variant)[1]
        delta = (X * sigma + 1) * zeta_d**-hurst
        zeta_u = zeta_d * (1 + spread)
        raw = {
            "delta_over_h_rms": delta,
            "zeta_d": zeta_d,
            "zeta_u": zeta_u,
            "hurst": hurst,
        }
        found = to_axes(delta, zeta_d, zeta_u, hurst, self.variant)
        scales = np.stack([found.force, found.area])
        table = scales * self.evaluate(axes, coefs, found[:4]).T
        return conformance(
            raw, found.X, found.mu, table, scales, 1e-4 * (1 + found.X) / found.sigma
        )

    def check(self, content: TableContent) -> None:
        """Force and area increase with X and stay within the limits of a rigid sphere."""
        places = [np.arange(2 * (axis.nodes - 1) + 1) / 2 for axis in content.axes[:2]]
        places += [
            np.minimum(np.arange(axis.nodes - 0.5), axis.nodes - 1)
            for axis in content.axes[2:]
        ]
        grid = np.meshgrid(
            *(axis.coordinate(p) for axis, p in zip(content.axes, places, strict=True)),
            indexing="ij",
        )
        X, mu = self.arguments(*grid)
        phi = self.evaluate(content.axes, content.coefficients, grid)
        force, area = phi.T.reshape(2, *X.shape)
        rigid = greenwood_tripp.rigid_sphere(X, mu)
        ratio = np.stack([force, area]) / rigid
        rules = {
            "force and area finite": np.isfinite(ratio).all(),
            "force and area no larger than a rigid sphere's": (
                ratio <= 1 + self.configuration.target
            ).all(),
            "force increasing in X": (np.diff(force, axis=0) > 0).all(),
            "area increasing in X": (np.diff(area, axis=0) > 0).all(),
            "force increasing with the spread": (np.diff(force, axis=1) > 0).all(),
            "rigid limit at the smallest spread": (
                np.abs(ratio[:, :, 0] - 1) <= 100 * mu[:, 0]
            ).all(),
        }
        self.require(rules)
