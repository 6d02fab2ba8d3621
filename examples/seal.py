"""The roughness of a face seal that keeps most contact in the valleys of its own waviness, by gradients.

Half of the face stands at the gap d, the other half, the valleys, WAVINESS further away. Looked for are
h_rms, the Hurst exponent, the largest wavenumber q1 and the gap that give the largest real contact area in the
valleys, where the mean pressure over both halves must not exceed a limit. A smooth face does not reach into its
valleys, a rough one has little area for its load: the best h_rms lies between. H and q1 end at their bounds: less
fine roughness is always better here.

Run with ``python examples/seal.py``. Lengths in um, stresses in MPa.
"""

from __future__ import annotations

import dataclasses
import pathlib

import click
import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import OptimizeResult, approx_fprime, minimize

from mbma_tables import Surface, contact

Q0 = 2 * np.pi / 500  # 1/um
CREST = 3.0  # h_max/h_rms
WAVINESS = 2.0  # um
E_STAR = 700.0  # MPa, filled PTFE
LIMIT = 0.3  # MPa
# log(h_rms), hurst, log(q1), and how far the valleys are compressed, (h_max - d - WAVINESS)/h_max
BOUNDS = [(np.log(0.8), np.log(8.0)), (0.6, 0.95), (np.log(0.5), np.log(10.0)), (0.02, 0.9)]
START = np.array([np.log(4.0), 0.75, np.log(3.0), 0.3])


@dataclasses.dataclass(frozen=True)
class Found:
    """Optimum of the minimiser, objective along its way, and the best of the grid."""

    result: OptimizeResult
    path: list[float]
    gradient_error: float
    grid_h_rms: np.ndarray
    grid_area: np.ndarray  # over h_rms, hurst, q1


def log_answers(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """log(pressure/LIMIT) and log(area of the valleys), and their gradients (2, 4)."""
    h_rms, hurst, q1, depth = np.exp(x[0]), x[1], np.exp(x[2]), x[3]
    h_max = CREST * h_rms
    gap = h_max * (1 - depth) - np.array([WAVINESS, 0.0])
    answer = contact(Surface(hurst, Q0, q1, h_rms, h_max), gap, E_star=E_STAR, derivatives=True)

    def by_x(slopes: dict[str, np.ndarray]) -> np.ndarray:
        # h_max and the gap follow h_rms
        by_h_rms = h_rms * slopes["h_rms"] + h_max * (slopes["h_max"] + (1 - depth) * slopes["separation"])
        return np.stack([by_h_rms, slopes["hurst"], q1 * slopes["q1"], -h_max * slopes["separation"]])

    pressure, area = answer.force.mean(), answer.area[1]
    gradients = by_x(answer.force_by).mean(axis=1) / pressure, by_x(answer.area_by)[:, 1] / area
    return np.log([pressure / LIMIT, area]), np.stack(gradients)


def brute_force(points: int) -> tuple[np.ndarray, np.ndarray]:
    """h_rms, and the area of the valleys at the load limit over a grid of h_rms, hurst and q1; gaps by bisection."""
    axes = [np.linspace(low, high, points) for low, high in BOUNDS[:3]]
    log_h_rms, hurst, log_q1 = (a[..., None] for a in np.meshgrid(*axes, indexing="ij"))
    h_max = CREST * np.exp(log_h_rms)
    surfaces = Surface(hurst, Q0, np.exp(log_q1), np.exp(log_h_rms), h_max)
    low, high = (np.full(h_max.shape, end) for end in BOUNDS[3])
    for _ in range(25):
        middle = (low + high) / 2
        answer = contact(surfaces, h_max * (1 - middle) - np.array([WAVINESS, 0.0]), E_star=E_STAR, rtol=1e-6)
        too_much = answer.force.mean(axis=-1, keepdims=True) > LIMIT
        low, high = np.where(too_much, low, middle), np.where(too_much, middle, high)
    # a limit passed at the least depth already leaves nothing
    reached = low[..., 0] > BOUNDS[3][0]
    return np.exp(axes[0]), np.where(reached, answer.area[..., 1], 0.0)


def optimise(points: int = 9) -> Found:
    """The optimum by SLSQP, and the grid with so many points an axis."""
    values, gradients = log_answers(START)
    differences = np.stack([approx_fprime(START, lambda x, k=k: log_answers(x)[0][k], 1e-6) for k in range(2)])
    path = [-float(values[1])]
    result = minimize(
        lambda x: (-log_answers(x)[0][1], -log_answers(x)[1][1]),
        START,
        jac=True,
        method="SLSQP",
        bounds=BOUNDS,
        constraints={"type": "ineq", "fun": lambda x: -log_answers(x)[0][0], "jac": lambda x: -log_answers(x)[1][0]},
        options={"ftol": 1e-12, "maxiter": 200},
        callback=lambda x: path.append(-float(log_answers(x)[0][1])),
    )
    error = float(np.abs(gradients - differences).max() / np.abs(gradients).max())
    return Found(result, path, error, *brute_force(points))


def draw(found: Found) -> Figure:
    """The objective along the iterations, and area against h_rms on the grid with the optimum."""
    figure = Figure(figsize=(10, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(np.exp(-np.array(found.path)), "o-")
    left.set(xlabel="iteration", ylabel="A/A0 in the valleys (load limit not yet kept)")
    right.plot(found.grid_h_rms, found.grid_area.max(axis=(1, 2)), "s-", label="grid, best hurst and q1")
    right.plot(np.exp(found.result.x[0]), np.exp(-found.result.fun), "r*", markersize=14, label="SLSQP with gradients")
    right.set(xlabel="h_rms [um]", ylabel="A/A0 in the valleys at the load limit")
    right.legend()
    return figure


def main(out: pathlib.Path | None = None, points: int = 9) -> Found:
    """Optimise, print and draw."""
    found = optimise(points)
    h_rms, hurst, q1, depth = found.result.x
    pressure = LIMIT * np.exp(log_answers(found.result.x)[0][0])
    click.echo(f"gradients against differences: {found.gradient_error:.1e}")
    click.echo(f"SLSQP: {found.result.nit} iterations, {found.result.nfev} evaluations, {found.result.message}")
    click.echo(f"h_rms = {np.exp(h_rms):.4f} um, hurst = {hurst:.4f}, q1 = {np.exp(q1):.4f} /um, depth = {depth:.4f}")
    click.echo(f"A/A0 in the valleys = {np.exp(-found.result.fun):.6f} at {pressure:.6f} MPa")
    click.echo(f"best of a grid of {found.grid_area.size} surfaces: {found.grid_area.max():.6f}")
    if out is not None:
        draw(found).savefig(out, dpi=120)
    return found


@click.command()
@click.option("--points", default=9, show_default=True, type=click.IntRange(min=2), help="Of the grid along each axis.")
@click.option("--out", type=click.Path(path_type=pathlib.Path, dir_okay=False), help="Draw to this file, .png or .svg.")
def command(points: int, out: pathlib.Path | None) -> None:
    """The roughness of a face seal, by gradients and by a grid."""
    main(out, points)


if __name__ == "__main__":
    command()
