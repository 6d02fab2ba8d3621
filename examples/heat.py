"""Heat through a bolted joint of two plates in scikit-fem, with the conductance of a rough interface by its pressure.

    pip install scikit-fem
    python examples/heat.py

The bolt presses the plates around its hole. Where they touch, the flux is h (T1 - T2) with
the table of `mbma export csv --conductivity` at the pressure there; elsewhere nothing
flows. Axisymmetric, by quadratic elements; SI units.
"""

import pathlib

import click
import numpy as np
from matplotlib.figure import Figure
from scipy.sparse import block_diag, coo_matrix
from skfem import Basis, BilinearForm, ElementQuad2, LinearForm, MeshQuad, condense, solve

from mbma_tables import Bodies, Surface, contact, materials
from mbma_tables.bodies.bodies import mean_conductivity
from mbma_tables.common.plots import to_picture
from mbma_tables.export.rows.law_rows import describe_law

# m: radii of the hole, of the pressed ring, of the plates
HOLE = 4e-3
CONE = 12e-3
RIM = 30e-3
THICK = 6e-3
STEEL = materials.get("steel 4140")
ALUMINIUM = materials.get("aluminium 6061")
CONDUCTIVITY = (
    STEEL.conductivity[0],
    float(np.mean(ALUMINIUM.conductivity)),
)  # W/(m K), of the lower and upper plate
E_STAR = float(
    materials.effective_modulus(STEEL.E * 1e9, STEEL.nu, ALUMINIUM.E * 1e9, ALUMINIUM.nu)
)
JOINT = Surface(
    hurst=0.8,
    q0=2 * np.pi / 1e-3,
    q1=2 * np.pi / 5e-6,
    h_rms=1.5e-6,
    h_max=5.5e-6,
    unit="m",
)
HARDNESS = 0.6e9  # Pa, of the aluminium
# N of the bolt; W/m^2 into the lower plate
FORCE = 5e3
FLUX = 1e4

mesh = MeshQuad.init_tensor(
    np.linspace(HOLE, RIM, 53), np.linspace(0, THICK, 13)
).with_defaults()
basis = Basis(mesh, ElementQuad2())
top, bottom = (basis.boundary(side) for side in ("top", "bottom"))


@BilinearForm
def conduction(u, v, w):
    """Of unit conductivity."""
    return 2 * np.pi * w.x[0] * (u.grad[0] * v.grad[0] + u.grad[1] * v.grad[1])


@BilinearForm
def interface(u, v, w):
    """h u v on a face."""
    return 2 * np.pi * w.x[0] * w.h * u * v


@LinearForm
def heating(v, w):
    """FLUX into a face."""
    return 2 * np.pi * w.x[0] * FLUX * v


def pressure(r: np.ndarray) -> np.ndarray:
    """Of the bolt's force, falling from the hole to the end of the cone."""
    share = np.maximum(1 - (r / CONE) ** 2, 0)
    return FORCE * share / (np.pi * (CONE**2 / 2 - HOLE**2 + HOLE**4 / (2 * CONE**2)))


def conductance_table() -> tuple[np.ndarray, np.ndarray]:
    """Pressures and conductances, with yield."""
    most = float(pressure(np.array(HOLE)))
    k_s = float(mean_conductivity(*CONDUCTIVITY))
    rows = describe_law(
        JOINT, E_STAR, stress_unit="Pa", quantity="solid_conductance", conductivity=k_s, conductivity_unit="W/(m K)",
        theory="calibrated", hardness=HARDNESS, pressures=(1e4, most),
    )  # fmt: skip
    return rows.x, rows.y


def temperatures(h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of both plates at their nodes, the upper one's top at 0; h on the interface's quadrature points."""
    faces = [
        side.get_dofs(name).all() for side, name in ((basis, "top"), (basis, "bottom"))
    ]
    lower, upper = (face[np.argsort(basis.doflocs[0, face])] for face in faces)
    of_face = interface.assemble(top, h=h)[lower][:, lower].tocoo()
    places = (lower, upper + basis.N)
    n = 2 * basis.N
    K = block_diag([k * conduction.assemble(basis) for k in CONDUCTIVITY], format="csr")
    for i, j, sign in ((0, 0, 1), (0, 1, -1), (1, 0, -1), (1, 1, 1)):
        K = K + coo_matrix(
            (sign * of_face.data, (places[i][of_face.row], places[j][of_face.col])),
            shape=(n, n),
        )
    load = np.append(heating.assemble(bottom), np.zeros(basis.N))
    found = solve(*condense(K.tocsr(), load, D=faces[0] + basis.N))
    return found[: basis.N], found[basis.N :]


def resistance(h: np.ndarray) -> float:
    """Mean temperature where heat enters, over the heat [K/W]."""
    return (
        float(heating.assemble(bottom) @ temperatures(h)[0])
        / (FLUX * np.pi * (RIM**2 - HOLE**2)) ** 2
    )


@click.command()
@click.option(
    "--out",
    type=click.Path(path_type=pathlib.Path, dir_okay=False),
    help="Draw to this file, .png or .svg.",
)
def command(out: pathlib.Path | None) -> None:
    """Heat through a bolted joint."""
    p = pressure(top.global_coordinates()[0])
    table = conductance_table()
    h = np.interp(p, *table)
    scatter = float(
        contact(
            JOINT, Bodies(E_STAR, hardness=HARDNESS), pressure=2e7, theory="calibrated"
        ).unloading_stiffness_scatter
    )
    click.echo(
        f"pressure up to {p.max() / 1e6:.0f} MPa, h up to {h.max():.3g} W/(m^2 K), scatter of ln h {scatter:.2f}"
    )
    cases = {
        "perfect contact in the cone": 1e9 * (p > 0),
        "law": h,
        "law, one sd less": h * np.exp(-scatter),
    }
    cases |= {
        "law, one sd more": h * np.exp(scatter),
        "smooth faces bonded everywhere": np.full_like(h, 1e9),
    }
    for name, values in cases.items():
        click.echo(f"{name:32s} {resistance(values):.4f} K/W")
    if out is not None:
        figure = Figure(figsize=(6, 4), layout="constrained")
        axes = figure.subplots()
        for T, name, plate in zip(
            temperatures(h), ("top", "bottom"), ("steel", "aluminium"), strict=True
        ):
            face = basis.get_dofs(name).all()
            order = np.argsort(basis.doflocs[0, face])
            axes.plot(
                1e3 * basis.doflocs[0, face][order],
                T[face][order],
                label=f"{plate} at the interface",
            )
        axes.axvline(1e3 * CONE, color="0.7", linestyle=":", label="end of the contact")
        axes.set(xlabel="radius [mm]", ylabel="temperature above the cooled face [K]")
        axes.legend()
        out.write_bytes(to_picture(figure, out.suffix[1:], outlines=True))


if __name__ == "__main__":
    command()
