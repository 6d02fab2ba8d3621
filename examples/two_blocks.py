"""Two heated and sheared blocks in CalculiX, with the pressure, friction and conductance of their joint in one card.

Run: python examples/two_blocks.py, with ccx (CalculiX 2.20) installed. Units: N, mm, MPa,
mW. Poisson's ratio is zero and nothing expands, so that pressure, shear and heat flux are
uniform and known from the law of the joint.
"""

import pathlib
import subprocess
import tempfile

import click
from matplotlib.figure import Figure

from mbma_tables import Joint
from mbma_tables.common.plots import new_figure, to_picture

SIDE = 10.0
HEIGHT = 1.0
HOT = 100.0
# of steel and aluminium
E = (205e3, 68.9e3)
K = (42.7, 167.0)
PRESSURE = 10.0
FRICTION = 0.2
SHARES = (0.5, 2.0)  # shears over that at which the joint slips

FACE = {"Rq": "0.4 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
METALS = ("steel 4140 hard", "aluminium 6061 hard")

STEP = f"""*STEP
*COUPLED TEMPERATURE-DISPLACEMENT, STEADY STATE
1., 1.
*BOUNDARY, OP=NEW
BOTTOM, 1, 3
BOTTOM, 11, 11, 0.
TOP, 2, 2
TOP, 11, 11, {HOT}
TOP, 1, 1, {{:.9e}}
"""
PRINT = """*NODE PRINT, NSET=ALL, FREQUENCY=1000
NT
*NODE PRINT, NSET=TOP, TOTALS=ONLY, FREQUENCY=1000
RF, RFL
*END STEP
"""


def deck(card: str, closure: float, displacements: list[float]) -> str:
    """Pressed by a displacement, from there on by a force, and sheared by displacements of the top."""
    text = "*NODE, NSET=ALL\n"
    for layer, z in enumerate((0.0, HEIGHT, HEIGHT, 2 * HEIGHT)):
        for corner, (x, y) in enumerate(
            ((0.0, 0.0), (SIDE, 0.0), (SIDE, SIDE), (0.0, SIDE))
        ):
            text += f"{4 * layer + corner + 1}, {x}, {y}, {z}\n"
    text += "*NSET, NSET=BOTTOM\n1, 2, 3, 4\n*NSET, NSET=TOP\n13, 14, 15, 16\n"
    for block, (name, modulus, k) in enumerate(zip(("LOW", "HIGH"), E, K, strict=True)):
        nodes = ", ".join(str(8 * block + node) for node in range(1, 9))
        text += f"*ELEMENT, TYPE=C3D8, ELSET={name}\n{block + 1}, {nodes}\n*MATERIAL, NAME={name}\n"
        text += f"*ELASTIC\n{modulus}, 0.\n*CONDUCTIVITY\n{k}\n*EXPANSION\n0.\n"
        text += f"*SOLID SECTION, ELSET={name}, MATERIAL={name}\n"
    text += "*SURFACE, NAME=MASTER, TYPE=ELEMENT\n1, S2\n*SURFACE, NAME=SLAVE, TYPE=ELEMENT\n2, S1\n"
    text += f"{card}*CONTACT PAIR, INTERACTION=JOINT, TYPE=SURFACE TO SURFACE\nSLAVE, MASTER\n"
    text += "".join(
        f"*EQUATION\n2\n{node}, 3, 1., 13, 3, -1.\n" for node in (14, 15, 16)
    )  # the top stays level
    text += f"*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, {HOT / 2}\n"
    text += f"{STEP.format(0.0)}13, 3, 3, {-closure:.9e}\n{PRINT}"
    for moved in (0.0, *displacements):
        text += f"{STEP.format(moved)}*CLOAD\n13, 3, {-PRESSURE * SIDE**2}\n{PRINT}"
    return text


def run(text: str) -> list[dict[str, float]]:
    """Temperatures of both faces and shear stress at the end of each step of CalculiX."""
    with tempfile.TemporaryDirectory() as folder:
        pathlib.Path(folder, "blocks.inp").write_text(text)
        said = subprocess.run(
            ["ccx", "blocks"], cwd=folder, capture_output=True, text=True, check=False
        ).stdout
        printed = pathlib.Path(folder, "blocks.dat")
        lines = printed.read_text().splitlines() if printed.exists() else []
    rows = [
        [float(word) for word in line.split()]
        for line in lines
        if line.strip() and "set" not in line
    ]
    if not rows or "Job finished" not in said:
        raise RuntimeError(f"CalculiX: {said[-1000:]}")
    steps = [
        rows[k : k + 18] for k in range(0, len(rows), 18)
    ]  # 16 nodes, force and heat
    return [{"low": s[4][1], "high": s[8][1], "shear": s[16][0] / SIDE**2} for s in steps]


def expected(joint: Joint) -> tuple[dict[str, float], list[float], list[float]]:
    """Temperatures of the faces by the law, displacements, and the shear stresses that they need."""
    found = joint.at_pressure(f"{PRESSURE} MPa")
    stick = 1e6 * float(found.tangential_stiffness)  # MPa/mm of GPa/um
    # W/(m^2 K) of solid spots and air, as the card has them
    contact = float(found.total_conductance)
    flux = HOT / (HEIGHT / K[0] + HEIGHT / K[1] + 1e3 / contact)
    faces = {"low": flux * HEIGHT / K[0], "high": HOT - flux * HEIGHT / K[1]}
    # shear moduli are E/2
    compliance = 1 / stick + 2 * HEIGHT / E[0] + 2 * HEIGHT / E[1]
    wanted = [share * FRICTION * PRESSURE for share in SHARES]
    return (
        faces,
        [tau * compliance for tau in wanted],
        [min(tau, FRICTION * PRESSURE) for tau in wanted],
    )


def compared() -> list[tuple[str, float, float]]:
    """What CalculiX finds and what the law says, by name."""
    joint = Joint(
        FACE,
        FACE | {"Rq": "0.7 um"},
        bodies=METALS,
        nominal_area="1 cm^2",
        friction=FRICTION,
    )
    card = joint.export(
        "calculix",
        ("1 MPa", "50 MPa"),
        name="JOINT",
        friction_pressure=f"{PRESSURE} MPa",
    )
    faces, displacements, shears = expected(joint)
    closure = (
        float(joint.surface.h_max - joint.at_pressure(f"{PRESSURE} MPa").mean_separation)
        * 1e-3
    )
    _, pressed, *sheared = run(deck(card, closure, displacements))
    rows = [
        (f"temperature of the {name} face", pressed[name], faces[name]) for name in faces
    ]
    names = ("half way to slip", "past slip")
    rows += [
        (f"shear stress {name} [MPa]", s["shear"], tau)
        for name, s, tau in zip(names, sheared, shears, strict=True)
    ]
    return rows


def draw(rows: list[tuple[str, float, float]]) -> Figure:
    """Temperatures through both blocks, by CalculiX and by the law, beside those of a perfect contact."""
    heights = [0.0, HEIGHT, HEIGHT, 2 * HEIGHT]
    simulated, law = ([0.0, rows[0][k], rows[1][k], HOT] for k in (1, 2))
    perfect = HOT / (1 + K[0] / K[1])
    figure = new_figure(5.5, 3.6)
    axes = figure.subplots()
    axes.plot(heights, law, label="by the law of the joint")
    axes.plot(heights, simulated, "ko", label="CalculiX")
    axes.plot(
        [0.0, HEIGHT, 2 * HEIGHT], [0.0, perfect, HOT], "--", label="perfect contact"
    )
    axes.set(xlabel="height: steel, then aluminium [mm]", ylabel="temperature")
    axes.grid(alpha=0.3)
    axes.legend()
    return figure


@click.command()
@click.option(
    "--out",
    type=click.Path(path_type=pathlib.Path, dir_okay=False),
    help="Draw to this file, .png or .svg.",
)
def command(out: pathlib.Path | None) -> None:
    """Two heated and sheared blocks in CalculiX."""
    rows = compared()
    for name, simulated, law in rows:
        click.echo(
            f"{name}: CalculiX {simulated:.4g}, law {law:.4g}, difference {simulated / law - 1:+.2%}"
        )
    if out:
        picture = to_picture(draw(rows), out.suffix[1:], dpi=100, outlines=True)
        out.write_bytes(picture)


if __name__ == "__main__":
    command()
