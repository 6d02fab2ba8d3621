"""From a configuration to a certified table over nodes: resolution, solution, certificate, checks, file."""

from __future__ import annotations

import dataclasses
import itertools
import json
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
import scipy.ndimage
from scipy.interpolate import BSpline
from scipy.stats import qmc
from threadpoolctl import threadpool_limits

from generate.splines import coefficients
from generate.tables.chunks import ChunkedSolver
from generate.tables.configuration import Configuration
from generate.tables.writing import error_cells, labels_of_nodes
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import MbmaError
from mbma_tables.islands import greenwood_tripp
from mbma_tables.models.island4d import at_places
from mbma_tables.tablefiles.schema import DEGREE, FUNCTIONS, Axis, TableContent, check_content, error_cell

BLAS_THREADS = 2  # as when the shipped tables were made
LINES = 24  # sample lines along an axis that decide its resolution
TESTS = 2  # points between two nodes of a sample line
GROWTH = 1.05  # least factor by which an axis is refined
ROUNDS = 4  # certificates tried before giving up
AXIS_SHARE = 0.4  # of the target, for one axis alone; the errors of axes add up in part
LOCAL_FLOOR = 0.8  # smallest bound, in units of the islands' tolerance
LOCAL_FACTOR = 2.5  # bound over the largest error at the middles of the cells nearby
CONFORMANCE_POINTS = 64
CONFORMANCE_TOLERANCE = 1e-11
SOLVER_SHARE = 0.01


def rtol_for(configuration: Configuration) -> float:
    """Accuracy of the islands that a table is made of: far below its target."""
    return max(SOLVER_SHARE * configuration.target, greenwood_tripp.MIN_SOLVER_RTOL)


class UncertifiedError(MbmaError):
    """A table that broke a physical check or missed its target; it is not written."""


class Kind(Protocol):
    """What `build` asks of a table over nodes."""

    def axes(self, nodes: dict[str, int]) -> tuple[Axis, ...]:
        """Axes with these node counts."""

    def arguments(self, *coordinates: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(X, mu) at coordinates of the axes."""

    def manifold(self, count: int) -> list[FloatArray]:
        """Coordinates of `count` islands that surfaces really visit."""

    def auxiliary(self, axes: tuple[Axis, ...]) -> dict[str, Any]:
        """Further variables of the file."""

    def attributes(self) -> dict[str, Any]:
        """Further attributes of the file."""

    def check(self, content: TableContent) -> None:
        """Physical checks between the nodes; raises UncertifiedError."""

    def conformance(self, places: list[FloatArray]) -> ConformancePoints:
        """Conformance points near coordinates of the axes."""


@dataclasses.dataclass(frozen=True)
class ConformancePoints:
    """Points to replay.

    Attributes
    ----------
    arguments : dict
        The numbers that a reader knows, exactly as stored.
    places : sequence of arrays
        Coordinates of the axes that follow from them.
    X, mu : ndarray
    scales : (2, points) ndarray
        What turns Phi_F and Phi_A into the stored answers.
    conditioning : ndarray
        How much rounding of the arguments is magnified.
    """

    arguments: dict[str, FloatArray]
    places: Sequence[FloatArray]
    X: FloatArray
    mu: FloatArray
    scales: FloatArray
    conditioning: FloatArray


def evaluate(coefs: FloatArray, positions: list[FloatArray]) -> FloatArray:
    """The table's spline at positions in node units, shape (entries, 2)."""
    return at_places(coefs, np.stack(positions)).T


def _between(axis: Axis) -> FloatArray:
    """Positions between the nodes of an axis, never on one."""
    inside = (np.arange(TESTS) + 0.5) / TESTS
    return (np.arange(axis.nodes - 1)[:, None] + inside).ravel()


def line_errors(
    kind: Kind, axes: tuple[Axis, ...], number: int, solver: ChunkedSolver, configuration: Configuration
) -> FloatArray:
    """Largest error of F and A when interpolating along axis `number` alone, over sample lines."""
    seed = configuration.seed
    others = [axis for k, axis in enumerate(axes) if k != number]
    # edges of the box first, where trouble sits
    edges = np.array(list(itertools.product((0.0, 1.0), repeat=len(others))))
    draws = np.concatenate([edges, qmc.Halton(len(others), seed=seed + number).random(LINES - len(edges))])
    fixed = [axis.coordinate(d * (axis.nodes - 1)) for axis, d in zip(others, draws.T, strict=True)]
    tests = _between(axes[number])
    positions = np.concatenate([np.arange(axes[number].nodes), tests])
    along = axes[number].coordinate(positions)
    coordinates = [np.broadcast_to(f[:, None], (LINES, along.size)) for f in fixed]
    coordinates.insert(number, np.broadcast_to(along, (LINES, along.size)))
    X, mu = kind.arguments(*coordinates)
    values = solver.log_ratio(f"{axes[number].name} x {axes[number].nodes}", X, mu, rtol=rtol_for(configuration))
    nodes = axes[number].nodes
    coefs = coefficients(np.moveaxis(values[:, :nodes], 1, 0), DEGREE, 1)
    fitted = BSpline(np.arange(nodes + 2 * DEGREE) - DEGREE, coefs, DEGREE)(tests)
    worst: FloatArray = np.abs(fitted - np.moveaxis(values[:, nodes:], 1, 0)).max(axis=(0, 1))
    return worst


@dataclasses.dataclass(frozen=True)
class Resolution:
    """Node counts and what each axis costs: its own largest error."""

    nodes: dict[str, int]
    errors: dict[str, FloatArray]


def resolve(
    kind: Kind, configuration: Configuration, solver: ChunkedSolver, aim: float, start: dict[str, int]
) -> Resolution:
    """Refine each axis until its sample lines meet `aim`."""
    nodes = dict(start)
    errors: dict[str, FloatArray] = {}
    for number, name in enumerate(nodes):
        fixed = configuration.axes[name].nodes
        while True:
            axes = kind.axes(nodes)
            errors[name] = line_errors(kind, axes, number, solver, configuration)
            worst = errors[name].max()
            if fixed is not None or worst <= aim:
                break
            # the error is of order h^(degree + 1)
            predicted = nodes[name] * (worst / aim) ** (1 / (DEGREE + 1))
            nodes[name] = int(max(nodes[name] * GROWTH, min(predicted, nodes[name] * 2))) + 1
            if np.prod([float(n) for n in nodes.values()]) > configuration.max_nodes:
                raise UncertifiedError(
                    f"{configuration.kind}: an error of {aim:.1e} along {name} needs more than the "
                    f"{configuration.max_nodes} nodes allowed; raise max_nodes or the target"
                )
    return Resolution(nodes, errors)


def held_out(kind: Kind, axes: tuple[Axis, ...], count: int, seed: int) -> list[FloatArray]:
    """Coordinates of certificate points: half over the whole box, half where surfaces really go."""
    box = qmc.Halton(len(axes), seed=seed).random(count // 2)
    spread = [axis.coordinate(d * (axis.nodes - 1)) for axis, d in zip(axes, box.T, strict=True)]
    visited = kind.manifold(count - count // 2)
    return [np.concatenate(pair) for pair in zip(spread, visited, strict=True)]


def certify(
    kind: Kind, axes: tuple[Axis, ...], coefs: FloatArray, solver: ChunkedSolver, configuration: Configuration
) -> dict[str, Any]:
    """Errors on held-out points, solved on twice the nodes that made the table."""
    places = held_out(kind, axes, configuration.certificate_points, configuration.seed + 101)
    positions = [axis.position(x) for axis, x in zip(axes, places, strict=True)]
    if any((p == np.round(p)).any() for p in positions):
        raise UncertifiedError(f"{configuration.kind}: a held-out point lies on a node")
    X, mu = kind.arguments(*places)
    truth = solver.log_ratio("certificate", X, mu, rtol=rtol_for(configuration), refinement=2)
    errors = np.abs(np.expm1(evaluate(coefs, positions) - truth))
    return certificate(configuration, errors, {axis.name: x for axis, x in zip(axes, places, strict=True)})


def certificate(configuration: Configuration, errors: FloatArray, places: dict[str, FloatArray]) -> dict[str, Any]:
    """Errors (points, 2) at places by name as attributes; the second half of the points is visited by surfaces."""
    on_manifold = errors[configuration.certificate_points // 2 :]
    result: dict[str, Any] = {"certificate_points": configuration.certificate_points}
    for number, function in enumerate(FUNCTIONS):
        own = errors[:, number]
        result[f"largest_error_{function}"] = float(own.max())
        result[f"p99_error_{function}"] = float(np.percentile(own, 99))
        result[f"median_error_{function}"] = float(np.median(own))
        result[f"visited_largest_error_{function}"] = float(on_manifold[:, number].max())
        result[f"visited_p99_error_{function}"] = float(np.percentile(on_manifold[:, number], 99))
        worst = int(own.argmax())
        result[f"largest_error_{function}_at"] = ", ".join(
            f"{name} = {float(x[worst]):.6g}" for name, x in places.items()
        )
    return result


def local_errors(
    kind: Kind, axes: tuple[Axis, ...], coefs: FloatArray, solver: ChunkedSolver, configuration: Configuration
) -> FloatArray:
    """Bounds on the error over a coarser grid, from the middle of every cell of the table."""
    cells = tuple(error_cells(axis) for axis in axes)
    field = np.zeros((*cells, 2))
    corners = np.stack(np.meshgrid(*(np.arange(a.nodes - 1) for a in axes), indexing="ij"), axis=-1)
    corners = corners.reshape(-1, len(axes))
    positions = list((corners + 0.5).T)
    places = [axis.coordinate(p) for axis, p in zip(axes, positions, strict=True)]
    rtol = max(0.1 * rtol_for(configuration), greenwood_tripp.MIN_SOLVER_RTOL)
    truth = solver.log_ratio("local error", *kind.arguments(*places), rtol=rtol)
    error = np.abs(np.expm1(evaluate(coefs, positions) - truth))
    where = tuple(error_cell(a, c, p) for a, c, p in zip(axes, cells, positions, strict=True))
    np.maximum.at(field, where, error)
    # a neighbour's worst point may lie just across the border
    spread = scipy.ndimage.maximum_filter(field, size=(*(3 for _ in axes), 1), mode="nearest")
    bound: FloatArray = LOCAL_FACTOR * spread + LOCAL_FLOOR * rtol_for(configuration)
    return bound


# the spline's factors are rounded differently on another number of BLAS threads
@threadpool_limits.wrap(limits=BLAS_THREADS)
def build(kind: Kind, configuration: Configuration, solver: ChunkedSolver) -> TableContent:
    """Make a table that meets its target, or raise UncertifiedError."""
    start = {name: given.nodes or given.start for name, given in configuration.axes.items()}
    aim = AXIS_SHARE * configuration.target
    history = []
    for _ in range(ROUNDS):
        resolution = resolve(kind, configuration, solver, aim, start)
        axes = kind.axes(resolution.nodes)
        grid = np.meshgrid(*(axis.values for axis in axes), indexing="ij")
        values = solver.log_ratio(f"{configuration.kind} table", *kind.arguments(*grid), rtol=rtol_for(configuration))
        coefs = coefficients(values, DEGREE, len(axes))
        certified = certify(kind, axes, coefs, solver, configuration)
        worst = max(certified["largest_error_F"], certified["largest_error_A"])
        history.append({"nodes": resolution.nodes, "aim": aim, "largest_error": worst})
        if worst <= configuration.target:
            break
        if all(given.nodes for given in configuration.axes.values()):
            raise UncertifiedError(
                f"{configuration.kind}: the largest held-out error is {worst:.2e}, "
                f"the target {configuration.target:.2e}; the configuration fixes every axis"
            )
        start = resolution.nodes
        aim *= 0.8 * configuration.target / worst
    else:
        raise UncertifiedError(
            f"{configuration.kind}: the largest held-out error is still {worst:.2e} after {ROUNDS} refinements, "
            f"the target {configuration.target:.2e}"
        )
    points = kind.conformance(held_out(kind, axes, CONFORMANCE_POINTS, configuration.seed + 303))
    positions = [axis.position(x) for axis, x in zip(axes, points.places, strict=True)]
    rigid = greenwood_tripp.rigid_sphere(points.X, points.mu)
    by_table = points.scales * np.exp(evaluate(coefs, positions).T) * rigid
    content = TableContent(
        kind=configuration.kind,
        axes=axes,
        coefficients=coefs,
        local_error=local_errors(kind, axes, coefs, solver, configuration),
        auxiliary=kind.auxiliary(axes) | labels_of_nodes(axes, values),
        conformance=conformance(points, by_table),
        attributes={
            **kind.attributes(),
            **certified,
            "target": configuration.target,
            "configuration": json.dumps(dataclasses.asdict(configuration), sort_keys=True),
            "configuration_sha256": configuration.digest(),
            "axis_errors": json.dumps(
                {name: [float(f"{e:.3e}") for e in errors] for name, errors in resolution.errors.items()}
            ),
            "refinement": json.dumps(history),
        },
    )
    try:
        check_content(content)
    except ValueError as fault:
        raise UncertifiedError(f"{configuration.kind}: the table {fault}") from None
    kind.check(content)
    return content


def conformance(points: ConformancePoints, table: FloatArray) -> dict[str, FloatArray]:
    """Points to replay: arguments, the `table`'s answers, the exact ones, and tolerances for both."""
    solved = greenwood_tripp.solve(points.X, points.mu, rtol=greenwood_tripp.MIN_SOLVER_RTOL)
    exact = points.scales * np.stack([solved.phi_F, solved.phi_A])
    stored = dict(points.arguments)
    for number, function in enumerate(FUNCTIONS):
        stored[f"table_{function}"] = table[number]
        stored[f"exact_{function}"] = exact[number]
    # rounding of the arguments enters through X, whose digits cancel for a small sigma
    stored["tolerance"] = CONFORMANCE_TOLERANCE * (1 + points.conditioning)
    return stored
