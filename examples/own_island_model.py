"""An island model of one's own, and a table of one's own, behind the same totals and laws as the shipped ones.

Run with ``python examples/own_island_model.py``.
"""

import pathlib

import click
import numpy as np
from numpy.typing import NDArray

from mbma_tables import Surface, contact, contact_law, greenwood_tripp, island, open_table
from mbma_tables.islands.island_models import IslandAnswer
from mbma_tables.tables.open import shipped
from mbma_tables.theories import Mbma


class FirstOrder:
    """Islands to first order in mu about the sphere that does not deform: Phi = rigid/(1 + c mu).

    c is taken from the solver once, at a small mu; the whole correction is what it states
    as its error.
    """

    name = "first order"

    def __init__(self) -> None:
        self.X, small = np.linspace(-6.0, 40.0, 93), 1e-3
        rigid_F, rigid_A = greenwood_tripp.rigid_sphere(
            self.X, np.full(self.X.size, small)
        )
        solved = greenwood_tripp.solve(self.X, small)
        self.slope_F = (rigid_F / solved.phi_F - 1) / small
        self.slope_A = (rigid_A / solved.phi_A - 1) / small

    def answer(self, X: NDArray[np.float64], mu: NDArray[np.float64]) -> IslandAnswer:
        """All that the library asks for: Phi_F, Phi_A and a bound on their relative error, of the shape of X and mu."""
        rigid_F, rigid_A = greenwood_tripp.rigid_sphere(X, mu)
        drop_F, drop_A = (
            1 + mu * np.interp(X, self.X, slope) for slope in (self.slope_F, self.slope_A)
        )
        return IslandAnswer(rigid_F / drop_F, rigid_A / drop_A, 1 - 1 / drop_F)


@click.command()
@click.argument(
    "table_file", type=click.Path(path_type=pathlib.Path), default=shipped("universal")
)
def main(table_file: pathlib.Path) -> None:
    """Compare one's own model and one's own table with the shipped ones."""
    surface = Surface(hurst=0.8, q0=0.01, q1=2.0, h_rms=1.0, h_max=3.0)  # um
    gaps = np.array([2.8, 2.0, 1.0])  # um
    exact = contact(surface, separation=gaps, theory=Mbma(island_model="exact"))
    models = {"first order": FirstOrder(), "my table": open_table(table_file)}
    for name, model in models.items():
        found = contact(
            surface, separation=gaps, theory=Mbma(island_model=model, rtol=1e-6)
        )
        law = contact_law(surface, rtol=1e-6, theory=Mbma(island_model=model))
        one = island(surface, 0.01, island_model=model)
        off = ", ".join(f"{ratio:.1e}" for ratio in found.pressure / exact.pressure - 1)
        bounds = ", ".join(f"{bound:.1e}" for bound in found.error)
        click.echo(f"{name}, which results call {found.island_model!r}")
        click.echo(f"  F/F_exact - 1 of totals {off}, where the model states {bounds}")
        click.echo(
            f"  force by its law over force by its total: {law.pressure(separation=gaps[0]) / found.pressure[0]:.6f}"
        )
        click.echo(f"  force of an island pressed by 0.01 um: {one.force:.4g} E* um^2")


if __name__ == "__main__":
    main()
