"""The roughness of a face seal that leaks least under a given load once a track is worn into it, by gradients.

Half of the face stands at the mean gap u over its counterface, the other half, the worn
track, DEPTH further away; both leak side by side. Looked for are h_rms, the Hurst exponent,
the largest wavenumber q1 and u of least leakage at a mean pressure LOAD. A smooth face does
not reach into its track, a rough one has wide gaps: the best h_rms lies between. H and q1
end at their bounds: less fine roughness is always better here. The best design is then
pressed by boundary elements, under the loads of its two halves, and Reynolds' equation
solved on the gaps.

Run with ``python examples/seal.py``; the simulation needs ``pip install tamaas``. Lengths in um,
stresses in MPa.
"""

import dataclasses
import pathlib

import click
import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import OptimizeResult, minimize

from mbma_tables import Contact, Surface, contact
from mbma_tables.common.plots import to_picture
from mbma_tables.theories.simulated import boundary_elements
from mbma_tables.theories.simulated.reynolds import flow_conductance

LONGEST = 500.0  # um
Q0 = 2 * np.pi / LONGEST
CREST = 4.0  # h_max/h_rms
DEPTH = 1.0  # um, of the worn track
E_STAR = 10.0  # MPa, rubber
LOAD = 0.1  # MPa
OIL = {"viscosity": "0.1 Pa s", "pressure_drop": "0.05 MPa", "width": "2 mm"}
# log(h_rms), hurst, log(q1), u/h_max
BOUNDS = [
    (np.log(0.2), np.log(10.0)),
    (0.5, 0.95),
    (np.log(8 * Q0), np.log(32 * Q0)),
    (0.005, 0.98),
]
START = np.array([np.log(3.0), 0.7, np.log(16 * Q0), 0.3])
STEP = 1e-5  # of central differences, all in one call


@dataclasses.dataclass(frozen=True)
class Found:
    """Optimum of the minimiser, its contact (face and track), objective on its way, and flow by simulations."""

    result: OptimizeResult
    best: Contact
    path: list[float]
    simulated: np.ndarray


def answer(points: np.ndarray) -> Contact:
    """Contacts of face and track at rows of the four unknowns."""
    h_rms, hurst, q1, share = (column[:, None] for column in points.T)
    h_max = CREST * np.exp(h_rms)
    surfaces = Surface(hurst, Q0, np.exp(q1), np.exp(h_rms), h_max, unit="um")
    return contact(
        surfaces,
        f"{E_STAR} MPa",
        mean_separation=share * h_max + [0.0, DEPTH],
        theory="calibrated",
    )


def log_answers(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """log(pressure/LOAD) and log(flow coefficient), means of face and track, and their gradients (2, 4)."""
    found = answer(x + STEP * np.concatenate([np.zeros((1, 4)), np.eye(4), -np.eye(4)]))
    both = np.log([found.pressure.mean(axis=1) / LOAD, found.leakage.K.mean(axis=1)])
    return both[:, 0], (both[:, 1:5] - both[:, 5:]) / (2 * STEP)


def simulate(best: Contact, x: np.ndarray, grid: int, seed: int) -> float:
    """Mean flow coefficient of face and track by boundary elements and Reynolds' equation, of one random cell."""
    h_rms = np.exp(x[0])
    hurst = x[1]
    zeta_1 = np.exp(x[2]) / Q0
    waves = round(grid / 4 / zeta_1)  # four points on the shortest
    k = np.hypot(np.fft.fftfreq(grid, 1 / grid)[:, None], np.fft.rfftfreq(grid, 1 / grid))
    phases = np.exp(2j * np.pi * np.random.default_rng(seed).random(k.shape))
    inside = (k >= waves) & (k <= zeta_1 * waves * (1 + 1e-9))
    heights = np.fft.irfft2(
        np.where(inside, np.maximum(k, 1.0) ** -(1 + hurst) * phases, 0)
    )
    heights *= h_rms / heights.std()
    gradient = float(Surface(hurst, Q0, np.exp(x[2]), h_rms, CREST * h_rms).rms_gradient)
    # in h_rms, and lengths stretched until the rms gradient is 1
    side = waves * LONGEST * gradient / h_rms
    engine = boundary_elements.BoundaryElementContact(heights / h_rms, (side, side))
    flows = []
    for force in best.pressure[0, ::-1]:
        engine.press(force / E_STAR / gradient)
        flows.append(np.sqrt(np.prod(flow_conductance(engine.gap * h_rms))))
    return float(np.mean(flows))


def optimise(cells: int, grid: int) -> Found:
    """The optimum by SLSQP, and simulations of it."""
    path = [float(log_answers(START)[0][1])]
    result = minimize(
        lambda x: (log_answers(x)[0][1], log_answers(x)[1][1]),
        START,
        jac=True,
        method="SLSQP",
        bounds=BOUNDS,
        constraints={
            "type": "eq",
            "fun": lambda x: log_answers(x)[0][0],
            "jac": lambda x: log_answers(x)[1][0],
        },
        options={"ftol": 1e-10, "maxiter": 200},
        callback=lambda x: path.append(float(log_answers(x)[0][1])),
    )
    best = answer(result.x[None])
    return Found(
        result,
        best,
        path,
        np.array([simulate(best, result.x, grid, seed) for seed in range(cells)]),
    )


def alike(x: np.ndarray, log_h_rms: np.ndarray) -> np.ndarray:
    """Conductances of designs with other h_rms under the same load; gaps by bisection."""
    low, high = (np.full(log_h_rms.size, end) for end in BOUNDS[3])
    for _ in range(40):
        points = np.stack(
            [
                log_h_rms,
                *(np.full(low.size, value) for value in x[1:3]),
                (low + high) / 2,
            ],
            axis=1,
        )
        heavy = answer(points).pressure.mean(axis=1) > LOAD
        low = np.where(heavy, points[:, 3], low)
        high = np.where(heavy, high, points[:, 3])
    return np.asarray(answer(points).leakage.K.mean(axis=1))


def draw(found: Found) -> Figure:
    """The objective along the iterations, and flow coefficient against h_rms with the optimum and its simulations."""
    figure = Figure(figsize=(10, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.semilogy(np.exp(found.path), "o-")
    left.set(xlabel="iteration", ylabel="flow coefficient [um^3] (load not yet kept)")
    x = found.result.x
    log_h_rms = x[0] + np.linspace(-0.7, 0.7, 41)
    right.loglog(np.exp(log_h_rms), alike(x, log_h_rms), label="same load, hurst and q1")
    right.plot(
        np.exp(x[0]),
        np.exp(found.result.fun),
        "r*",
        markersize=14,
        label="SLSQP with gradients",
    )
    right.plot(
        np.full(found.simulated.size, np.exp(x[0])),
        found.simulated,
        "k_",
        label="simulated cells",
    )
    right.set(xlabel="h_rms [um]", ylabel="flow coefficient [um^3]")
    right.legend()
    return figure


def main(out: pathlib.Path | None = None, cells: int = 3, grid: int = 256) -> Found:
    """Optimise, simulate, print and draw."""
    found = optimise(cells, grid)
    h_rms, hurst, q1, share = found.result.x
    leakage = found.best.leakage
    click.echo(
        f"SLSQP: {found.result.nit} iterations, {found.result.nfev} evaluations, {found.result.message}"
    )
    click.echo(
        f"h_rms = {np.exp(h_rms):.4f} um, hurst = {hurst:.4f}, q1/q0 = {np.exp(q1) / Q0:.4f}, u = {share:.4f} h_max"
    )
    for k, name in enumerate(("face", "track")):
        state = (
            "blocked"
            if leakage.blocked[0, k]
            else f"leaks {leakage.liquid(**OIL)[0, k]:.3g} um^2/s of oil"
        )
        click.echo(
            f"{name}: {found.best.pressure[0, k]:.4f} MPa, contact {found.best.area[0, k]:.3f}, {state}"
        )
    law = np.exp(found.result.fun)
    click.echo(
        f"flow coefficient {law:.4g} um^3, stated scatter of the track {leakage.scatter[0, 1]:.2f}"
    )
    for simulated in found.simulated:
        click.echo(
            f"boundary elements {simulated:.4g} um^3: ln(law/simulation) = {np.log(law / simulated):+.2f}"
        )
    if out is not None:
        out.write_bytes(to_picture(draw(found), out.suffix[1:], outlines=True))
    return found


@click.command()
@click.option(
    "--cells",
    default=3,
    show_default=True,
    type=click.IntRange(min=0),
    help="Random cells to simulate.",
)
@click.option(
    "--grid",
    default=256,
    show_default=True,
    type=click.IntRange(min=128),
    help="Points a side of a cell.",
)
@click.option(
    "--out",
    type=click.Path(path_type=pathlib.Path, dir_okay=False),
    help="Draw to this file, .png or .svg.",
)
def command(cells: int, grid: int, out: pathlib.Path | None) -> None:
    """The roughness of a worn face seal that leaks least, by gradients, and a direct simulation of it."""
    main(out, cells, grid)


if __name__ == "__main__":
    command()
