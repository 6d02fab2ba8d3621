"""What both tables are held to: held-out errors, points to replay, physical rules."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.stats import qmc

from generate.tables.configuration import Configuration
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import MbmaError
from mbma_tables.islands import greenwood_tripp
from mbma_tables.tablefiles.schema import FUNCTIONS, TableContent, check_content

CONFORMANCE_POINTS = 64
CONFORMANCE_TOLERANCE = 1e-11
SOLVER_SHARE = 0.01
MAX_DRAWS = 400  # islands drawn for each that a narrow table covers


class UncertifiedError(MbmaError):
    """A table that broke a physical check or missed its target; it is not written."""


def rtol_for(configuration: Configuration) -> float:
    """Accuracy of the islands that a table is made of: far below its target."""
    return max(SOLVER_SHARE * configuration.target, greenwood_tripp.MIN_SOLVER_RTOL)


def visited_surfaces(count: int, seed: int, ranges: dict[str, tuple[float, float]]) -> list[FloatArray]:
    """H, zeta_1 and delta/h_rms of `count` islands, low-discrepancy over the ranges."""
    low, high = np.array(list(ranges.values())).T
    hurst, zeta_1, approach = qmc.scale(qmc.Halton(3, seed=seed).random(count), low, high).T
    return [hurst, 10**zeta_1, 10**approach]


def enough(kind: str, count: int, first: int, drawn: Callable[[int], list[FloatArray]]) -> list[FloatArray]:
    """Coordinates of at least `count` islands within a table's axes, of ever more random ones."""
    draw, places = first, drawn(first)
    while places[0].size < count:
        draw *= 2
        if draw > MAX_DRAWS * count:
            raise UncertifiedError(f"{kind}: hardly a surface visits these axes, so there is nothing to certify")
        places = drawn(draw)
    return places


def certificate(configuration: Configuration, errors: FloatArray, places: dict[str, FloatArray]) -> dict[str, Any]:
    """Errors (points, 2) at places by name as attributes; the second half of the points is visited by surfaces."""
    result: dict[str, Any] = {"certificate_points": configuration.certificate_points}
    for number, function in enumerate(FUNCTIONS):
        own, visited = errors[:, number], errors[configuration.certificate_points // 2 :, number]
        result[f"largest_error_{function}"] = float(own.max())
        result[f"p99_error_{function}"] = float(np.percentile(own, 99))
        result[f"median_error_{function}"] = float(np.median(own))
        result[f"visited_largest_error_{function}"] = float(visited.max())
        result[f"visited_p99_error_{function}"] = float(np.percentile(visited, 99))
        worst = int(own.argmax())
        result[f"largest_error_{function}_at"] = ", ".join(f"{n} = {float(x[worst]):.6g}" for n, x in places.items())
    return result


def conformance(
    arguments: dict[str, FloatArray], X: FloatArray, mu: FloatArray, table: FloatArray, scales: Any, conditioning: Any
) -> dict[str, FloatArray]:
    """Points to replay: arguments as stored, the table's answers, the exact ones, and a tolerance for both.

    `scales` turns Phi_F and Phi_A into the stored answers, `conditioning` magnifies rounding of the arguments.
    """
    solved = greenwood_tripp.solve(X, mu, rtol=greenwood_tripp.MIN_SOLVER_RTOL)
    exact, stored = scales * np.stack([solved.phi_F, solved.phi_A]), dict(arguments)
    for number, function in enumerate(FUNCTIONS):
        stored |= {f"table_{function}": table[number], f"exact_{function}": exact[number]}
    # rounding of the arguments enters through X, whose digits cancel for a small sigma
    return stored | {"tolerance": CONFORMANCE_TOLERANCE * np.broadcast_to(1.0 + conditioning, X.shape)}


def require(kind: str, where: str, rules: dict[str, Any]) -> None:
    """Raise UncertifiedError for the first rule that is broken."""
    for rule, kept in rules.items():
        if not kept:
            raise UncertifiedError(f"{kind}: {where} the table breaks: {rule}")


def checked(kind: Any, content: TableContent) -> TableContent:
    """The content, or UncertifiedError where it breaks the schema or a physical rule."""
    try:
        check_content(content)
    except ValueError as fault:
        raise UncertifiedError(f"{content.kind}: the table {fault}") from None
    kind.check(content)
    return content
