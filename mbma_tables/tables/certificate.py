"""What both tables share: exact islands, solved in chunks, held-out errors, points to replay, physical rules."""

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import qmc

from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import UncertifiedError
from mbma_tables.common.workers import results
from mbma_tables.islands import greenwood_tripp
from mbma_tables.tables.configuration import Configuration
from mbma_tables.tables.schema import FUNCTIONS, TableContent, check_content

CONFORMANCE_POINTS = 64
CONFORMANCE_TOLERANCE = 1e-11
SOLVER_SHARE = 0.01
MAX_DRAWS = 400  # islands drawn for each that a narrow table covers
CHUNK = 2000


class Forecast(NamedTuple):
    """What a table would take on this machine, estimated."""

    points: int  # nodes of the table, or coefficients
    islands: int  # to be solved
    seconds: float
    bytes: int


def phi(X: FloatArray, mu: FloatArray, rtol: float, refinement: int = 1) -> FloatArray:
    """Phi_F and Phi_A at flat (X, mu), shape (entries, 2), on `refinement` times the nodes that `rtol` asks."""
    solved = greenwood_tripp.solve(X, mu, rtol=rtol)
    found = np.stack([solved.phi_F, solved.phi_A], axis=-1)
    if refinement > 1:
        for nodes in np.unique(solved.nodes):
            same = solved.nodes == nodes
            finer = greenwood_tripp.solve(
                X[same], mu[same], rtol=rtol, nodes=refinement * int(nodes)
            )
            found[same] = np.stack([finer.phi_F, finer.phi_A], axis=-1)
    return found


class Kind:
    """A kind of table, computed by worker processes; the values are the same to the last bit."""

    # of the target, the accuracy of the islands that the table is made of
    solver_share = SOLVER_SHARE

    def __init__(self, configuration: Configuration, workers: int = 1) -> None:
        self.configuration, self.workers = configuration, workers
        self.rtol = max(
            self.solver_share * configuration.target, greenwood_tripp.MIN_SOLVER_RTOL
        )

    def phi(
        self, label: str, X: FloatArray, mu: FloatArray, rtol: float, refinement: int = 1
    ) -> FloatArray:
        """`phi` of arrays of any one shape, shape (..., 2)."""
        flat = [np.ascontiguousarray(array, dtype=float).ravel() for array in (X, mu)]
        parts = (slice(k, k + CHUNK) for k in range(0, flat[0].size, CHUNK))
        jobs = [(flat[0][part], flat[1][part], rtol, refinement) for part in parts]
        return np.concatenate([*results(label, phi, jobs, self.workers)]).reshape(
            (*np.shape(X), 2)
        )

    def log_ratio(
        self, label: str, X: FloatArray, mu: FloatArray, rtol: float, refinement: int = 1
    ) -> FloatArray:
        """log(Phi/Phi_rigid) of arrays of any one shape, shape (..., 2)."""
        rigid = np.moveaxis(greenwood_tripp.rigid_sphere(X, mu), 0, -1)
        return np.asarray(np.log(self.phi(label, X, mu, rtol, refinement) / rigid))

    def visited_surfaces(
        self, count: int, ranges: dict[str, tuple[float, float]]
    ) -> list[FloatArray]:
        """delta/h_rms, H and zeta_1 of `count` islands, low-discrepancy over the ranges."""
        low, high = np.array(list(ranges.values())).T
        draws = qmc.Halton(3, seed=self.configuration.seed + 7).random(count)
        hurst, zeta_1, approach = qmc.scale(draws, low, high).T
        return [10**approach, hurst, 10**zeta_1]

    def enough(
        self, count: int, first: int, drawn: Callable[[int], list[FloatArray]]
    ) -> list[FloatArray]:
        """Coordinates of at least `count` islands within the table's axes, of ever more random ones."""
        draw = first
        places = drawn(first)
        while places[0].size < count:
            draw *= 2
            if draw > MAX_DRAWS * count:
                kind = self.configuration.kind
                raise UncertifiedError(
                    f"{kind}: hardly a surface visits these axes, so there is nothing to certify"
                )
            places = drawn(draw)
        return places

    def certificate(
        self, errors: FloatArray, places: dict[str, FloatArray]
    ) -> dict[str, Any]:
        """Errors (points, 2) at places by name as attributes; the second half of the points is visited by surfaces."""
        own = self.configuration
        half = self.configuration.certificate_points // 2
        if errors.max() > own.target:
            raise UncertifiedError(
                f"{own.kind}: the largest held-out error is {errors.max():.2e}, the target {own.target:.2e}: "
                f"ask for a lower target, for which more nodes are taken, or give the axes more nodes"
            )
        result: dict[str, Any] = {"certificate_points": own.certificate_points}
        for function, values in zip(FUNCTIONS, errors.T, strict=True):
            visited = values[half:]
            worst = int(values.argmax())
            result |= {
                f"largest_error_{function}": float(values.max()),
                f"p99_error_{function}": float(np.percentile(values, 99)),
                f"median_error_{function}": float(np.median(values)),
                f"visited_largest_error_{function}": float(visited.max()),
                f"visited_p99_error_{function}": float(np.percentile(visited, 99)),
                f"largest_error_{function}_at": ", ".join(
                    f"{n} = {float(x[worst]):.6g}" for n, x in places.items()
                ),
            }
        return result

    def build(self) -> TableContent:
        """The table, certified."""
        raise NotImplementedError

    def forecast(self) -> Forecast:
        """What `build` would take."""
        raise NotImplementedError

    def seconds_of(self, X: FloatArray, mu: FloatArray, refinement: int = 1) -> float:
        """Measured seconds of one exact island of these, flat arrays."""
        phi(X[:1], mu[:1], self.rtol)
        start = time.perf_counter()
        phi(X, mu, self.rtol, refinement)
        return (time.perf_counter() - start) / X.size

    def require(self, rules: dict[str, Any]) -> None:
        """Raise UncertifiedError that names the first of these rules that is not kept."""
        for rule, kept in rules.items():
            if not kept:
                raise UncertifiedError(
                    f"{self.configuration.kind}: the table breaks: {rule}"
                )

    def check(self, content: TableContent) -> None:
        """Raise UncertifiedError for a table that breaks a physical rule."""
        raise NotImplementedError

    def checked(self, content: TableContent) -> TableContent:
        """The table, consistent and within the physical rules, or UncertifiedError."""
        try:
            check_content(content)
        except ValueError as fault:
            raise UncertifiedError(f"{content.kind}: the table {fault}") from None
        self.check(content)
        return content


def conformance(
    arguments: dict[str, FloatArray],
    X: FloatArray,
    mu: FloatArray,
    table: FloatArray,
    scales: Any,
    conditioning: Any,
) -> dict[str, FloatArray]:
    """Points to replay: arguments as stored, the table's answers, the exact ones, and a tolerance for both.

    `scales` turns Phi_F and Phi_A into the stored answers, `conditioning` magnifies
    rounding of the arguments.
    """
    solved = greenwood_tripp.solve(X, mu, rtol=greenwood_tripp.MIN_SOLVER_RTOL)
    exact = scales * np.stack([solved.phi_F, solved.phi_A])
    stored = dict(arguments)
    for number, function in enumerate(FUNCTIONS):
        stored |= {f"table_{function}": table[number], f"exact_{function}": exact[number]}
    # rounding of the arguments enters through X, whose digits cancel for a small sigma
    return stored | {
        "tolerance": CONFORMANCE_TOLERANCE * np.broadcast_to(1.0 + conditioning, X.shape)
    }
