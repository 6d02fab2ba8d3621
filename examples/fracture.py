"""A rock fracture's permeability against stress, and the water that a well draws from it.

The hydraulic aperture w of `mbma export geos` gives the permeability w^2/12 at the
effective stress, that is, normal stress less the water's pressure. A well lowers the
pressure and so closes the fracture around itself. Radial flow between the pressures p_w at
the well and p_e at the edge is, exactly,

    Q = (2 pi/(12 eta ln(r_e/r_w))) integral from p_w to p_e of w^3(stress - p) dp.

Run with ``python examples/fracture.py``. SI units.
"""

import pathlib

import click
import numpy as np
from matplotlib.figure import Figure
from scipy.integrate import quad

from mbma_tables import Surface, contact
from mbma_tables.common.plots import to_picture
from mbma_tables.export.rows.law_rows import LawTable, describe_law

# both faces' roughness together: wavelengths from 20 mm to 0.1 mm that do not fit into each other
FRACTURE = Surface(
    hurst=0.8,
    q0=2 * np.pi / 20e-3,
    q1=2 * np.pi / 0.1e-3,
    h_rms=60e-6,
    h_max=210e-6,
    unit="m",
)
# Pa, Pa s: granite, water
E_STAR = 30e9
VISCOSITY = 1e-3
STRESSES = np.array([0.5, 1, 2, 5, 10, 20, 50]) * 1e6  # Pa, effective
# Pa, Pa at the edge, m, m
NORMAL = 25e6
PORE = 20e6
WELL = 0.1
EDGE = 100.0
WELL_PRESSURES = np.array([18, 15, 10, 5, 0]) * 1e6  # Pa


def aperture_table() -> LawTable:
    """Hydraulic aperture, aperture and its derivative against the effective stress."""
    return describe_law(
        FRACTURE,
        E_STAR,
        stress_unit="Pa",
        quantity="hydraulic_aperture",
        theory="calibrated",
        pressures=(1e5, 6e7),
    )


def drawn(table: LawTable, at_well: float, stiff: bool = False) -> float:
    """Q [m^3/s]; of a fracture that does not close where `stiff`."""
    stress = (lambda p: NORMAL - PORE) if stiff else (lambda p: NORMAL - p)
    flow = quad(
        lambda p: np.interp(stress(p), table.x, table.y) ** 3,
        at_well,
        PORE,
        limit=200,
        epsrel=1e-6,
    )[0]
    return 2 * np.pi * flow / (12 * VISCOSITY * np.log(EDGE / WELL))


@click.command()
@click.option(
    "--out",
    type=click.Path(path_type=pathlib.Path, dir_okay=False),
    help="Draw to this file, .png or .svg.",
)
def command(out: pathlib.Path | None) -> None:
    """Permeability of a rock fracture against stress."""
    table = aperture_table()
    found = contact(FRACTURE, E_STAR, pressure=STRESSES, theory="calibrated")
    w = np.interp(STRESSES, table.x, table.y)
    scatter = found.leakage.scatter * 2 / 3  # of ln w^2, K = w^3
    click.echo(
        "stress [MPa]   A/A0     u [um]   w [um]   permeability [m^2]   sd of its ln"
    )
    for row in zip(
        STRESSES / 1e6,
        found.area,
        1e6 * found.mean_separation,
        1e6 * w,
        w**2 / 12,
        scatter,
        strict=True,
    ):
        click.echo(
            "{:8.1f}       {:6.2%}   {:6.1f}   {:6.1f}      {:.2e}           {:.2f}".format(
                *row
            )
        )
    click.echo("well [MPa]     Q [l/s]   without closure")
    for p in WELL_PRESSURES:
        click.echo(
            f"{p / 1e6:8.1f}       {1e3 * drawn(table, p):6.3f}   {1e3 * drawn(table, p, stiff=True):6.3f}"
        )
    if out is not None:
        figure = Figure(figsize=(6, 4), layout="constrained")
        axes = figure.subplots()
        # where the uncertainty was computed
        rows = (table.x >= STRESSES[0]) & (table.x <= STRESSES[-1])
        p = table.x[rows] / 1e6
        k = 1e9 * table.y[rows] ** 2 / 12
        axes.semilogx(p, k, label="fracture, w²/12")
        axes.semilogx(
            p,
            1e9 * table.more["aperture"][0][rows] ** 2 / 12,
            "--",
            label="parallel faces at the same mean gap, u²/12",
        )
        band = np.interp(p, STRESSES / 1e6, scatter)
        axes.fill_between(
            p,
            k * np.exp(-band),
            k * np.exp(band),
            alpha=0.2,
            label="one standard deviation",
        )
        axes.set(
            xlabel="effective normal stress [MPa]",
            ylabel="permeability [10⁻⁹ m²]",
            xticks=STRESSES / 1e6,
            ylim=(0, None),
        )
        axes.xaxis.set_major_formatter("{x:g}")
        axes.minorticks_off()
        axes.grid(True, alpha=0.3)
        axes.legend()
        out.write_bytes(to_picture(figure, out.suffix[1:], outlines=True))


if __name__ == "__main__":
    command()
