"""The universal table: Chebyshev series of Phi_F/mu and Phi_A over cells of (X, mu)."""

import dataclasses
import math
import time
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from scipy.stats import qmc

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import UncertifiedError
from mbma_tables.common.workers import results
from mbma_tables.islands import greenwood_tripp
from mbma_tables.islands.geometry import geometry
from mbma_tables.islands.variants import VARIANTS
from mbma_tables.tables.certificate import (
    CONFORMANCE_POINTS,
    Forecast,
    Kind,
    conformance,
    phi,
)
from mbma_tables.tables.schema import (
    BUCKET_BITS,
    CELL_EDGES,
    UNIVERSAL,
    X_STEPS,
    TableContent,
)
from mbma_tables.tables.universal import TERMS, UniversalModel, fractions_of_mu
from mbma_tables.tables.writer import about, label

VISITED = {
    "hurst": (0.05, 1.0),
    "log10_zeta_1": (0.4786, 8.0),
    "log10_approach": (-7.0, 1.0),
}

# ranges of X that are made for a forecast; bytes of a file, and of one of its cells
SAMPLED = 6
FILE_BYTES = 5e4
BYTES_PER_CELL = 380
AIM = 0.5  # of the target, for the tests of a cell
AIM_IN_X = 0.4  # of that, for a line along X
LOCAL_FACTOR = 1.5  # bound over the largest error at the tests of a cell
DIGITS = 40  # binary ones of a coefficient, counted from the first of its cell's mean
FIRST_BUCKETS = (
    8 * 64
)  # eighths of octaves below the largest mu, at most, where the first cell ends
SMALLEST_MU = 1e-30  # what is solved at mu = 0
LINES = (0.0, 1e-2, 1.0, 10.0, 100.0, 1e4)  # mu that decide widths in X

NODES: FloatArray = np.cos(np.pi * (np.arange(TERMS) + 0.5) / TERMS)
FIT: FloatArray = np.asarray(
    np.linalg.inv(chebyshev.chebvander(NODES, TERMS - 1)), dtype=float
)
# where the first term that is left out is largest, corners and edges included
TESTS: FloatArray = np.cos(np.pi * np.arange(TERMS + 1) / TERMS)
AT_TESTS: FloatArray = np.asarray(chebyshev.chebvander(TESTS, TERMS - 1), dtype=float)


def mu_at(y: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """mu at places in [-1, 1] of cells."""
    a, b, c, d = fractions_of_mu(low, high)
    return np.asarray(np.clip((b - d * y) / (c * y - a), low, high))


def X_at(x: FloatArray, low: Any, high: Any) -> FloatArray:
    """X at places in [-1, 1] of cells."""
    return np.asarray(0.5 * (low + high) + 0.5 * (high - low) * x)


def values(X: FloatArray, mu: FloatArray, rtol: float) -> FloatArray:
    """Phi_F/mu and Phi_A on a grid, shape (2, X, mu)."""
    grid = [g.ravel() for g in np.meshgrid(X, np.maximum(mu, SMALLEST_MU), indexing="ij")]
    found = phi(grid[0], grid[1], rtol).T
    found[0] /= grid[1]
    return found.reshape(2, X.size, mu.size)


@dataclasses.dataclass(frozen=True)
class Strip:
    """A range of X, with the cells of mu that it is divided into."""

    low: float
    high: float
    mu_high: float
    aim: float
    rtol: float

    def is_narrow(self) -> bool:
        """Whether polynomials of X are accurate over its range."""
        mu = np.minimum(LINES, self.mu_high)
        series = FIT @ values(X_at(NODES, self.low, self.high), mu, self.rtol)
        exact = values(X_at(TESTS, self.low, self.high), mu, self.rtol)
        return bool(np.abs(AT_TESTS @ series / exact - 1).max() <= AIM_IN_X * self.aim)

    def cell(self, low: float, high: float) -> tuple[FloatArray, FloatArray]:
        """Coefficients over a range of mu, as they are stored, and the largest errors at the tests."""
        ends = np.array(low), np.array(high)
        series = (
            FIT
            @ values(X_at(NODES, self.low, self.high), mu_at(NODES, *ends), self.rtol)
            @ FIT.T
        )
        last = 2.0 ** (np.floor(np.log2(np.abs(series[:, :1, :1]))) - DIGITS)
        series = np.round(series / last) * last
        exact = values(X_at(TESTS, self.low, self.high), mu_at(TESTS, *ends), self.rtol)
        return series, np.abs(AT_TESTS @ series @ AT_TESTS.T / exact - 1).max(axis=(1, 2))

    def cells(self) -> FloatArray | None:
        """Its cells from mu = 0 upwards, each as long as it meets the aim; None where one cannot be short enough.

        A row is the four edges, two errors and the coefficients.
        """
        last = (int(np.float64(self.mu_high).view(np.int64) - 1) >> BUCKET_BITS) + 1
        rows: list[FloatArray] = []
        edge = 0
        length = 0
        low = 0.0
        while low < self.mu_high:
            # an edge by its bits; the first cell is searched by halves, others start from
            # the one before
            best = None
            least = edge + 1 if edge else last - FIRST_BUCKETS
            most = last
            trial = last if edge == 0 else min(edge + length, last)
            while least <= trial <= most:
                high = min(
                    float(np.int64(trial << BUCKET_BITS).view(np.float64)), self.mu_high
                )
                series, errors = self.cell(low, high)
                if errors.max() <= self.aim:
                    best = (trial, high, series, errors)
                    least = trial + 1
                else:
                    most = trial - 1
                trial = (
                    (least + most + 1) // 2
                    if edge == 0
                    else trial + 1
                    if best
                    else trial - 1
                )
            if best is None:
                return None
            length = best[0] - edge
            edge = best[0]
            rows.append(
                np.concatenate(
                    [[self.low, self.high, low, best[1]], best[3], best[2].ravel()]
                )
            )
            low = best[1]
        return np.array(rows)


def cells_of(
    low: float, high: float, mu_high: float, aim: float, rtol: float
) -> FloatArray:
    """Rows of `Strip.cells`, of halves of the strip where it is too wide."""
    rows = Strip(low, high, mu_high, aim, rtol).cells()
    if rows is not None:
        return rows
    middle = low + (math.ceil((high - low) * X_STEPS) // 2) / X_STEPS
    if middle == low:
        raise UncertifiedError(
            f"universal: no cell of X in [{low:g}, {high:g}] is short enough in mu for {aim:.1e}"
        )
    return np.concatenate(
        [cells_of(*ends, mu_high, aim, rtol) for ends in ((low, middle), (middle, high))]
    )


class Universal(Kind):
    """The two-parameter table of a configuration."""

    def strips(self) -> list[Strip]:
        """Ranges of X, each as wide as polynomials allow."""
        X, mu = (self.configuration.axes[name] for name in ("X", "mu"))
        strips = list[Strip]()
        low = X.low
        width = 1

        def strip(steps: int) -> Strip:
            high = min(low + steps / X_STEPS, X.high)
            return Strip(low, high, mu.high, AIM * self.configuration.target, self.rtol)

        while low < X.high:
            widest = math.ceil((X.high - low) * X_STEPS)
            width = min(width, widest)
            while width > 1 and not strip(width).is_narrow():
                width -= max(1, width // 8)
            while width < widest:
                wider = min(width + max(1, width // 8), widest)
                if not strip(wider).is_narrow():
                    break
                width = wider
            strips.append(strip(width))
            low = strips[-1].high
        return strips

    def build(self) -> TableContent:
        """The table, certified."""
        own = self.configuration
        jobs = [dataclasses.astuple(strip) for strip in self.strips()]
        rows = np.concatenate([*results("cells", cells_of, jobs, self.workers)])
        if len(rows) * TERMS**2 > own.max_nodes:
            raise UncertifiedError(
                f"universal: an error of {own.target:.1e} needs {len(rows) * TERMS**2} coefficients, more than the "
                f"{own.max_nodes} allowed; raise max_nodes or the target"
            )
        series = np.moveaxis(rows[:, 6:].reshape(-1, 2, TERMS, TERMS), 1, -1)
        content = TableContent(
            kind=UNIVERSAL,
            axes=tuple(own.axes.values()),
            coefficients=np.ascontiguousarray(series),
            local_error=LOCAL_FACTOR * rows[:, 4:6] + self.rtol,
            auxiliary={
                n: (("cell",), r, label(t))
                for (n, t), r in zip(CELL_EDGES.items(), rows.T, strict=False)
            },
            conformance={},
            attributes={},
        )
        X, mu = self.held_out(content, CONFORMANCE_POINTS, own.seed + 303)
        table = np.stack(UniversalModel(content).answer(X, mu)[:2])
        points = conformance({"X": X, "mu": mu}, X, mu, table, 1.0, 0.0)
        known = (
            about(UNIVERSAL)
            | {"variant": "any", "variant_numbers": "[]"}
            | own.attributes()
        )
        attributes = known | self.certify(content)
        return self.checked(
            dataclasses.replace(content, conformance=points, attributes=attributes)
        )

    def forecast(self) -> Forecast:
        """What `build` would take, from the cells of a few of its ranges of X."""
        start = time.perf_counter()
        strips = self.strips()
        before = time.perf_counter()
        chosen = strips[:: math.ceil(len(strips) / SAMPLED)]
        cells = [len(cells_of(*dataclasses.astuple(strip))) for strip in chosen]
        share = len(strips) / len(chosen)
        count = round(share * sum(cells))
        now = time.perf_counter()
        points = self.configuration.certificate_points
        place = np.full(100, 5.0), np.logspace(-3, 3, 100)
        seconds = points * self.seconds_of(*place, 2) + share * (now - before)
        return Forecast(
            count * TERMS**2,
            count * (TERMS**2 + TESTS.size**2) + points,
            before - start + seconds / self.workers,
            round(FILE_BYTES + BYTES_PER_CELL * count),
        )

    def held_out(self, content: TableContent, count: int, seed: int) -> list[FloatArray]:
        """(X, mu) of points: half anywhere in any cell, half where surfaces really go."""
        edges = np.stack([content.auxiliary[name][1] for name in CELL_EDGES])
        which, x, y = qmc.Halton(3, seed=seed).random(count // 2).T
        X_low, X_high, mu_low, mu_high = edges[:, (which * edges.shape[1]).astype(int)]
        box = [X_at(2 * x - 1, X_low, X_high), mu_at(2 * y - 1, mu_low, mu_high)]
        return [
            np.concatenate(pair)
            for pair in zip(box, self.manifold(count - count // 2), strict=True)
        ]

    def certify(self, content: TableContent) -> dict[str, Any]:
        """Errors on held-out points, solved on twice the nodes that made the table."""
        X, mu = self.held_out(
            content, self.configuration.certificate_points, self.configuration.seed + 101
        )
        truth = self.phi("certificate", X, mu, rtol=self.rtol, refinement=2)
        errors = np.abs(
            np.stack(UniversalModel(content).answer(X, mu)[:2], axis=-1) / truth - 1
        )
        return self.certificate(errors, {"X": X, "mu": mu})

    def manifold(self, count: int) -> list[FloatArray]:
        """(X, mu) of islands of random surfaces, every variant, as far as the table covers them."""
        axes = self.configuration.axes

        def drawn(draw: int) -> list[FloatArray]:
            approach, hurst, zeta_1 = self.visited_surfaces(draw, VISITED)
            fields = [
                geometry(approach, hurst, zeta_1, variant)
                for variant in VARIANTS.values()
            ]
            X, mu = (np.concatenate([f[name] for f in fields]) for name in ("X", "mu"))
            inside = (
                (axes["X"].low < X)
                & (axes["X"].high > X)
                & (mu > 0)
                & (mu < axes["mu"].high)
            )
            return [X[inside], mu[inside]]

        X, mu = self.enough(count, 4 * count, drawn)
        chosen = np.linspace(0, X.size - 1, count).astype(int)
        return [X[chosen], mu[chosen]]

    def check(self, content: TableContent) -> None:
        """Force and area are positive and monotonic, and agree where cells meet."""
        X_low, X_high, mu_low, mu_high = (
            content.auxiliary[name][1][:, None] for name in CELL_EDGES
        )
        x, y = (g.ravel() for g in np.meshgrid(*2 * [np.linspace(-0.99, 0.99, 5)]))
        X = X_at(x, X_low, X_high).ravel()
        mu = mu_at(y, mu_low, mu_high).ravel()
        answer = UniversalModel(content).answer
        found = np.stack(answer(X, mu)[:2])
        beside = (
            X_at(x + 1e-3, X_low, X_high).ravel(),
            mu_at(y + 1e-3, mu_low, mu_high).ravel(),
        )
        more_X, more_mu = (
            np.stack(answer(*place)[:2]) for place in ((beside[0], mu), (X, beside[1]))
        )
        rigid = greenwood_tripp.rigid_sphere(X, mu)
        rigid_limit = X, np.full(X.size, SMALLEST_MU)
        limit = (
            np.stack(answer(*rigid_limit)[:2])
            / greenwood_tripp.rigid_sphere(*rigid_limit)
            - 1
        )
        target = self.configuration.target
        rules = {
            "force and area finite and positive": (
                np.isfinite(found) & (found > 0)
            ).all(),
            "force and area no larger than a rigid sphere's": (
                found <= (1 + target) * rigid
            ).all(),
            "force increasing in X": (more_X > found)[0].all(),
            "area increasing in X": (more_X > found)[1].all(),
            "force increasing in mu": (more_mu > found)[0].all(),
            "rigid limit at mu = 0": (np.abs(limit) <= target).all(),
        }
        self.require(rules)
