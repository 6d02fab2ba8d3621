"""A journal bearing in mixed lubrication: its Stribeck curve, with the flow factors and asperity pressure of a surface.

The average Reynolds equation (Patir and Cheng 1978) of the film u = c (1 + e cos x/R), both
faces equally rough,

    d/dx (phi_x u^3/(12 eta) dp/dx) + d/dy (phi_y u^3/(12 eta) dp/dy) = U/2 du/dx,    p >= 0,

by finite differences; where p would be negative the film is broken (active set). The table
of `mbma export csv --quantity film` has phi_x, phi_y, asperity pressure and area against u.
The eccentricity e carries the load by both pressures; friction is viscous between the
contacts and mu_b times the asperity pressure in them. Rigid bodies, one temperature; beyond
the table the last flow factors. Run with ``python examples/bearing.py``. SI units.
"""

import dataclasses
import pathlib

import click
import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import brentq
from scipy.sparse import csr_matrix, diags
from scipy.sparse.linalg import spsolve

from mbma_tables import Surface
from mbma_tables.common.plots import to_picture
from mbma_tables.export.rows.law_rows import describe_law

# m
RADIUS = 25e-3
LENGTH = 25e-3
CLEARANCE = 25e-6
# Pa s, N, in contacts
VISCOSITY = 0.02
LOAD = 5e3
BOUNDARY_FRICTION = 0.12
FACES = Surface(
    hurst=0.8, q0=5e4, q1=1.5e6, h_rms=0.5e-6, h_max=1.75e-6, unit="m"
)  # both faces' roughness in one
LAY = 3.0  # length of the roughness around the bearing over that along its axis
SPEEDS = np.geomspace(0.02, 20, 16)  # m/s, of the journal's surface
# points around the bearing and from its middle to its end
AROUND = 120
ALONG = 13


def film_table() -> dict[str, np.ndarray]:
    """Columns against the mean gap, as in the CSV."""
    rows = describe_law(FACES, "110 GPa", stress_unit="Pa", quantity="film", peklenik=LAY)
    return {name: values for name, (values, _) in rows.columns.items()}


def film_pressure(
    u: np.ndarray, phi: tuple[np.ndarray, np.ndarray], speed: float
) -> np.ndarray:
    """Pressure on AROUND x ALONG points, the last at the end; symmetric about the first; gap u around."""
    dx = 2 * np.pi * RADIUS / AROUND
    dy = LENGTH / 2 / (ALONG - 1)
    k_x, k_y = (factor * u**3 / (12 * VISCOSITY) for factor in phi)
    index = np.arange(AROUND * ALONG).reshape(AROUND, ALONG)
    j = np.arange(ALONG)
    beside = (
        np.roll(index, -1, 0),
        np.roll(index, 1, 0),
        index[:, np.minimum(j + 1, ALONG - 1)],
        index[:, abs(j - 1)],
    )
    east = (k_x + np.roll(k_x, -1)) / 2 / dx**2
    weights = [
        np.repeat(weight, ALONG)
        for weight in (east, np.roll(east, 1), k_y / dy**2, k_y / dy**2)
    ]
    places = np.tile(index.ravel(), 4), np.ravel(beside)
    A = diags([sum(weights)], [0], format="csr") - csr_matrix(
        (np.concatenate(weights), places)
    )
    b = -np.repeat((np.roll(u, -1) - np.roll(u, 1)) / (2 * dx), ALONG) * speed / 2
    inside = np.tile(j < ALONG - 1, AROUND)
    filled = inside
    while True:
        p = np.zeros(index.size)
        p[filled] = spsolve(A[filled][:, filled].tocsc(), b[filled])
        before = filled
        filled = inside & (p - (A @ p - b) / A.diagonal() > 0)
        if (before == filled).all():
            return p.reshape(AROUND, ALONG)


@dataclasses.dataclass(frozen=True)
class State:
    """The bearing at one eccentricity and speed: load [N], share of it on contacts, coefficient of friction."""

    eccentricity: float
    load: float
    in_contact: float
    friction: float
    thinnest: float  # m


def state(table: dict[str, np.ndarray], eccentricity: float, speed: float) -> State:
    """Loads and friction, by trapezoids along the axis."""
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    u = CLEARANCE * (1 + eccentricity * np.cos(angle))
    phi_x, phi_y, asperity, area = (
        np.interp(u, table["mean_separation"], table[name])
        for name in ("phi_x", "phi_y", "pressure", "area")
    )
    film = np.trapezoid(
        film_pressure(u, (phi_x, phi_y), speed), dx=1 / (ALONG - 1), axis=1
    )
    strip = LENGTH * RADIUS * 2 * np.pi / AROUND
    force = (
        strip
        * np.stack([film + asperity, asperity])
        @ np.stack([-np.cos(angle), np.sin(angle)], axis=1)
    )
    load, contact = np.hypot(*force.T)
    shear = VISCOSITY * speed / u * (1 - area) + BOUNDARY_FRICTION * asperity
    return State(eccentricity, load, contact / load, strip * shear.sum() / load, u.min())


def stribeck(speeds: np.ndarray = SPEEDS) -> list[State]:
    """At each speed the state that carries LOAD."""
    table = film_table()
    most = 1 - 0.25 * float(FACES.h_rms) / CLEARANCE
    ends = [
        (
            brentq(
                lambda e, U=U: np.log(state(table, e, U).load / LOAD),
                0.02,
                most,
                xtol=1e-7,
            ),
            U,
        )
        for U in speeds
    ]
    return [state(table, e, U) for e, U in ends]


@click.command()
@click.option(
    "--out",
    type=click.Path(path_type=pathlib.Path, dir_okay=False),
    help="Draw to this file, .png or .svg.",
)
def command(out: pathlib.Path | None) -> None:
    """Stribeck curve of a journal bearing."""
    states = stribeck()
    click.echo("U [m/s]   eccentricity   thinnest [um]   load on contacts   friction")
    for U, s in zip(SPEEDS, states, strict=True):
        thinnest = f"{1e6 * s.thinnest:7.3f}         {s.in_contact:7.1%}"
        click.echo(
            f"{U:7.3f}   {s.eccentricity:.4f}         {thinnest}            {s.friction:.4f}"
        )
    if out is not None:
        figure = Figure(figsize=(6, 6), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True)
        above.loglog(SPEEDS, [s.friction for s in states], "o-", ms=4)
        above.set(ylabel="coefficient of friction", ylim=(5e-4, 0.3))
        below.semilogx(SPEEDS, [100 * s.in_contact for s in states], "C1o-", ms=4)
        below.set(xlabel="sliding speed [m/s]", ylabel="load on contacts [%]")
        for axes in (above, below):
            axes.xaxis.set_major_formatter("{x:g}")
            axes.grid(True, alpha=0.3)
        above.yaxis.set_major_formatter("{x:g}")
        out.write_bytes(to_picture(figure, out.suffix[1:], outlines=True))


if __name__ == "__main__":
    command()
