"""From a configuration to a certified table over nodes: resolution, solution, certificate, checks, file."""

from __future__ import annotations

import dataclasses
import itertools
import json
from typing import Any

import numpy as np
import scipy.ndimage
from scipy.interpolate import BSpline
from scipy.stats import qmc
from threadpoolctl import threadpool_limits

from generate.splines import coefficients
from generate.tables.certificate import CONFORMANCE_POINTS, UncertifiedError, certificate, checked, rtol_for
from generate.tables.chunks import ChunkedSolver
from generate.tables.configuration import Configuration
from generate.tables.island4d import Island4d, evaluate
from generate.tables.writing import error_cells, labels_of_nodes
from mbma_tables.common.arguments import FloatArray
from mbma_tables.islands import greenwood_tripp
from mbma_tables.tablefiles.schema import DEGREE, Axis, TableContent, error_cell

BLAS_THREADS = 2  # as when the shipped tables were made
LINES = 24  # sample lines along an axis that decide its resolution
TESTS = 2  # points between two nodes of a sample line
GROWTH = 1.05  # least factor by which an axis is refined
ROUNDS = 4  # certificates tried before giving up
AXIS_SHARE = 0.4  # of the target, for one axis alone; the errors of axes add up in part
LOCAL_FLOOR = 0.8  # smallest bound, in units of the islands' tolerance
LOCAL_FACTOR = 2.5  # bound over the largest error at the middles of the cells nearby


def line_errors(
    kind: Island4d, axes: tuple[Axis, ...], number: int, solver: ChunkedSolver, configuration: Configuration
) -> FloatArray:
    """Largest error of F and A when interpolating along axis `number` alone, over sample lines."""
    own, others = axes[number], [axis for k, axis in enumerate(axes) if k != number]
    # edges of the box first, where trouble sits
    edges = np.array(list(itertools.product((0.0, 1.0), repeat=len(others))))
    random = qmc.Halton(len(others), seed=configuration.seed + number).random(LINES - len(edges))
    draws = np.concatenate([edges, random]).T
    # between the nodes, never on one
    tests = (np.arange(own.nodes - 1)[:, None] + (np.arange(TESTS) + 0.5) / TESTS).ravel()
    along = own.coordinate(np.concatenate([np.arange(own.nodes), tests]))
    coordinates = [axis.coordinate(d * (axis.nodes - 1))[:, None] for axis, d in zip(others, draws, strict=True)]
    coordinates.insert(number, along[None])
    X, mu = kind.arguments(*coordinates)
    values = solver.log_ratio(f"{own.name} x {own.nodes}", X, mu, rtol=rtol_for(configuration))
    coefs = coefficients(np.moveaxis(values[:, : own.nodes], 1, 0), DEGREE, 1)
    fitted = BSpline(np.arange(own.nodes + 2 * DEGREE) - DEGREE, coefs, DEGREE)(tests)
    return np.asarray(np.abs(fitted - np.moveaxis(values[:, own.nodes :], 1, 0)).max(axis=(0, 1)))


@dataclasses.dataclass(frozen=True)
class Resolution:
    """Node counts and what each axis costs: its own largest error."""

    nodes: dict[str, int]
    errors: dict[str, FloatArray]


def resolve(
    kind: Island4d, configuration: Configuration, solver: ChunkedSolver, aim: float, start: dict[str, int]
) -> Resolution:
    """Refine each axis until its sample lines meet `aim`."""
    nodes, errors = dict(start), dict[str, FloatArray]()
    for number, name in enumerate(nodes):
        while True:
            errors[name] = line_errors(kind, kind.axes(nodes), number, solver, configuration)
            worst = errors[name].max()
            if configuration.axes[name].nodes is not None or worst <= aim:
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


def held_out(kind: Island4d, axes: tuple[Axis, ...], count: int, seed: int) -> list[FloatArray]:
    """Coordinates of certificate points: half over the whole box, half where surfaces really go."""
    box = qmc.Halton(len(axes), seed=seed).random(count // 2)
    spread = [axis.coordinate(d * (axis.nodes - 1)) for axis, d in zip(axes, box.T, strict=True)]
    return [np.concatenate(pair) for pair in zip(spread, kind.manifold(count - count // 2), strict=True)]


def certify(
    kind: Island4d, axes: tuple[Axis, ...], coefs: FloatArray, solver: ChunkedSolver, configuration: Configuration
) -> dict[str, Any]:
    """Errors on held-out points, solved on twice the nodes that made the table."""
    places = held_out(kind, axes, configuration.certificate_points, configuration.seed + 101)
    positions = [axis.position(x) for axis, x in zip(axes, places, strict=True)]
    if any((p == np.round(p)).any() for p in positions):
        raise UncertifiedError(f"{configuration.kind}: a held-out point lies on a node")
    truth = solver.log_ratio("certificate", *kind.arguments(*places), rtol=rtol_for(configuration), refinement=2)
    errors = np.abs(np.expm1(evaluate(coefs, positions) - truth))
    return certificate(configuration, errors, {axis.name: x for axis, x in zip(axes, places, strict=True)})


def local_errors(
    kind: Island4d, axes: tuple[Axis, ...], coefs: FloatArray, solver: ChunkedSolver, configuration: Configuration
) -> FloatArray:
    """Bounds on the error over a coarser grid, from the middle of every cell of the table."""
    cells = tuple(error_cells(axis) for axis in axes)
    field = np.zeros((*cells, 2))
    positions = [
        np.asarray(p.ravel() + 0.5) for p in np.meshgrid(*(np.arange(a.nodes - 1) for a in axes), indexing="ij")
    ]
    places = [axis.coordinate(p) for axis, p in zip(axes, positions, strict=True)]
    rtol = max(0.1 * rtol_for(configuration), greenwood_tripp.MIN_SOLVER_RTOL)
    truth = solver.log_ratio("local error", *kind.arguments(*places), rtol=rtol)
    where = tuple(error_cell(a, c, p) for a, c, p in zip(axes, cells, positions, strict=True))
    np.maximum.at(field, where, np.abs(np.expm1(evaluate(coefs, positions) - truth)))
    # a neighbour's worst point may lie just across the border
    spread = scipy.ndimage.maximum_filter(field, size=(*(3 for _ in axes), 1), mode="nearest")
    return np.asarray(LOCAL_FACTOR * spread + LOCAL_FLOOR * rtol_for(configuration))


# the spline's factors are rounded differently on another number of BLAS threads
@threadpool_limits.wrap(limits=BLAS_THREADS)
def build(kind: Island4d, configuration: Configuration, solver: ChunkedSolver) -> TableContent:
    """Make a table that meets its target, or raise UncertifiedError."""
    start = {name: given.nodes or given.start for name, given in configuration.axes.items()}
    aim, history = AXIS_SHARE * configuration.target, []
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
        missed = f"{worst:.2e}{{}}, the target {configuration.target:.2e}"
        if all(given.nodes for given in configuration.axes.values()):
            fixed = f"the largest held-out error is {missed.format('')}; the configuration fixes every axis"
            raise UncertifiedError(f"{configuration.kind}: {fixed}")
        start, aim = resolution.nodes, aim * 0.8 * configuration.target / worst
    else:
        still = f"the largest held-out error is still {missed.format(f' after {ROUNDS} refinements')}"
        raise UncertifiedError(f"{configuration.kind}: {still}")
    errors = {name: [float(f"{e:.3e}") for e in errors] for name, errors in resolution.errors.items()}
    content = TableContent(
        kind=configuration.kind,
        axes=axes,
        coefficients=coefs,
        local_error=local_errors(kind, axes, coefs, solver, configuration),
        auxiliary=kind.auxiliary(axes) | labels_of_nodes(axes, values),
        conformance=kind.conformance(axes, coefs, held_out(kind, axes, CONFORMANCE_POINTS, configuration.seed + 303)),
        attributes=kind.attributes()
        | certified
        | configuration.attributes()
        | {"axis_errors": json.dumps(errors), "refinement": json.dumps(history)},
    )
    return checked(kind, content)
