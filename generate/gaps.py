"""`python -m generate gaps`: the campaign, the constants and the errors of the law of gaps.

Constants are from the training set, errors are those of held-out surfaces; docs/adhesion.md
has the law.
"""

import dataclasses
import pathlib
from collections.abc import Sequence
from typing import Any

import click
import numpy as np
import xarray as xr
from scipy.optimize import least_squares

from generate import files
from generate.boundary_elements.run import dataset, run
from generate.boundary_elements.solve import SOLVERS
from generate.boundary_elements.surfaces import (
    HELD_OUT_SPECTRUM,
    HELD_OUT_SURFACE,
    SPLITS,
    TRAINING,
    campaign,
)
from generate.calibrated_file import write_part
from mbma_tables.common.arguments import FloatArray
from mbma_tables.theories import gap_law
from mbma_tables.theories.dataset import read_groups
from mbma_tables.theories.gap_law import GapConstants
from mbma_tables.theories.simulated.map_gaps import restored

KIND = "gaps"
FILE = files.ROOT / "docs" / "data" / "gaps.nc"
LARGEST = 2048  # grid points a side
MIN_WAVES = 2  # longest waves a side: below, a cell's own scatter rules
MANY_WAVES = 4  # from which a surface has its full weight
FITTED = np.geomspace(0.01, 3.2, 10)  # ranges over h_rms
TYPICAL_ERROR = 0.05  # of a logarithm, above which an error counts less than its square
HELD_OUT = (HELD_OUT_SURFACE, HELD_OUT_SPECTRUM)


@dataclasses.dataclass(frozen=True)
class Contacts:
    """Simulated contacts: a row each."""

    area: FloatArray
    u: FloatArray  # [h_rms]
    alpha: FloatArray
    waves: FloatArray
    gaps: FloatArray  # at the shares of `gap_law` [h_rms]

    def mean_decay(self, ranges: FloatArray) -> FloatArray:
        """Mean of exp(-gap/range) where the contact is open, over the nominal area."""
        _, weight = gap_law.rule()
        decay = np.exp(-self.gaps[:, None] / np.asarray(ranges)[:, None])
        return np.asarray((decay * weight).sum(axis=-1) * (1 - self.area[:, None]))

    def decay_of_law(self, ranges: FloatArray, constants: GapConstants) -> FloatArray:
        """The same by the law."""
        share, gap = gap_law.open_gaps(self.u, self.area, self.alpha, constants=constants)
        decay = np.exp(-gap[:, None] / np.asarray(ranges)[:, None])
        return np.asarray((decay * share[:, None]).sum(axis=-1))


def simulated(data: xr.Dataset, splits: Sequence[str]) -> Contacts:
    """The contacts of some sets, of surfaces with enough waves a side."""
    chosen = [SPLITS.index(split) for split in splits]
    rows: list[tuple[Any, ...]] = []
    for number in range(data.sizes["surface"]):
        one = data.isel(surface=number)
        if int(one.split) not in chosen or int(one.waves) < MIN_WAVES:
            continue
        alpha = 4 * float(one.band_curvature.sum())
        for load in range(data.sizes["load"]):
            numbers = (one.area, one.area_raw, one.mean_separation)
            area, raw, u = (float(values[load]) for values in numbers)
            quantiles = one.gap_quantile.values[load].astype(float)
            gaps = restored(quantiles, area, raw, u)
            rows.append((area, u, alpha, int(one.waves), gaps))
    area, u, alpha, waves = np.array([row[:4] for row in rows], float).T
    return Contacts(area, u, alpha, waves, np.array([row[4] for row in rows]))


def fitted(known: Contacts) -> GapConstants:
    """Constants of the law, by errors of ln of the mean of exp(-gap/range)."""
    truth = np.log(known.mean_decay(FITTED))
    weight = np.sqrt(np.minimum(known.waves, MANY_WAVES) / MANY_WAVES)[:, None]

    def errors(logs: FloatArray) -> FloatArray:
        law = known.decay_of_law(FITTED, GapConstants(*np.exp(logs)))
        return np.asarray((weight * (np.log(law) - truth)).ravel())

    start = np.log(dataclasses.astuple(GapConstants()))
    found = least_squares(errors, start, loss="soft_l1", f_scale=TYPICAL_ERROR)
    return GapConstants(*(float(f"{value:.3g}") for value in np.exp(found.x)))


def errors_of(known: Contacts, constants: GapConstants) -> FloatArray:
    """ln(law/simulation) of contacts at `gap_law.RANGES`."""
    ranges = np.array(gap_law.RANGES)
    law = known.decay_of_law(ranges, constants)
    return np.log(law / known.mean_decay(ranges))


def by_area(known: Contacts, errors: FloatArray) -> FloatArray:
    """Root mean squares around each of `gap_law.AREAS`, up to half way to its neighbours."""
    nodes = np.log(gap_law.AREAS)
    nearest = np.abs(np.log(known.area)[:, None] - nodes).argmin(axis=1)
    mean_squares = [(errors[nearest == k] ** 2).mean(axis=0) for k in range(nodes.size)]
    return np.sqrt(mean_squares)


@click.command()
@click.option(
    "--folder",
    type=click.Path(path_type=pathlib.Path),
    default=pathlib.Path("boundary_elements", KIND),
    show_default=True,
    help="One file a surface.",
)
@click.option(
    "--collect",
    "target",
    type=click.Path(path_type=pathlib.Path),
    help="Write what there is into this file, no runs.",
)
@click.option("--fit", is_flag=True, help="Fit the constants; print them and errors.")
@click.option(
    "--data", type=click.Path(path_type=pathlib.Path), default=FILE, show_default=True
)
@click.option("--points", type=click.IntRange(64), default=LARGEST, show_default=True)
@click.option("--workers", type=click.IntRange(1), default=1, show_default=True)
def gaps(
    folder: pathlib.Path,
    target: pathlib.Path | None,
    fit: bool,
    data: pathlib.Path,
    points: int,
    workers: int,
) -> None:
    """Solve surfaces for their gaps, half an hour on one core; `--collect`, then `--fit`.

    Stopped and called again, it goes on where it was.
    """
    if fit:
        _report(read_groups(data)[KIND])
        return
    tasks = [task for task in campaign(KIND) if task.recipe.points <= points]
    if target is not None:
        found = dataset(tasks, folder, KIND)
        write_part(target, found, KIND)
        click.echo(f"{target}: {found.sizes['surface']} of {len(tasks)} surfaces")
        return
    run(tasks, folder, workers, SOLVERS[KIND])


def _report(data: xr.Dataset) -> None:
    """Print constants and errors of the law of gaps."""
    constants = fitted(simulated(data, [TRAINING]))
    click.echo(constants)
    for splits in ([TRAINING], [HELD_OUT_SURFACE], [HELD_OUT_SPECTRUM]):
        known = simulated(data, splits)
        errors = np.abs(errors_of(known, constants))
        click.echo(
            f"{splits[0]}: {known.area.size} contacts, alpha {known.alpha.min():.3g} to "
            f"{known.alpha.max():.3g}; median {np.median(errors):.2%}, "
            f"{(errors < 0.03).mean():.0%} within 3%"
        )
    held = simulated(data, HELD_OUT)
    errors = errors_of(held, constants)
    stated = by_area(held, errors)
    click.echo("rms by A/A0 (rows) and range/h_rms (columns):")
    for area, row in zip(gap_law.AREAS, stated, strict=True):
        click.echo(f"    {tuple(float(f'{value:.2g}') for value in row)},  # {area:g}")
    scatter = gap_law.scatter_of_decay(held.area[:, None], np.array(gap_law.RANGES))
    inside = np.isfinite(scatter)
    within = np.abs(errors)[inside] <= 2 * scatter[inside]
    click.echo(f"within twice the stated scatter: {within.mean():.1%}")
