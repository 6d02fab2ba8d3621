"""What measured scatter of the roughness does to the force at a given gap: a Monte Carlo over surfaces.

H, h_rms and q1 scatter; the samples are dask arrays, so `contact` answers lazily, block by
block, on all cores, and memory holds a few blocks and the forces. Run with ``python
examples/scatter.py [--samples 1000000]``; it needs dask (``pip install '.[distributed]'``).
Lengths in um; force is F/(A0 E*).
"""

import dataclasses
import pathlib

import click
import dask.array as da
import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from scipy.special import ndtr, ndtri

from mbma_tables import Surface, contact
from mbma_tables.common.plots import to_picture
from mbma_tables.theories import Mbma

BLOCK = 10_000
SEED = 20260101
Q0 = 2 * np.pi / 500  # 1/um
GAP = 1.0  # um, d from the mid-plane
CREST = 3.0  # h_max/h_rms
HURST = (0.8, 0.05)  # mean and standard deviation
LOG_H_RMS = (np.log(1.0), 0.10)  # of log(um)
LOG_Q1 = (np.log(5.0), 0.30)  # of log(1/um)
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


@dataclasses.dataclass(frozen=True)
class Spread:
    """Forces, their quantiles and the standard errors of these."""

    force: np.ndarray
    quantiles: np.ndarray
    standard_errors: np.ndarray


def scattered(
    rng: da.random.Generator,
    count: int,
    centre: tuple[float, float],
    low: float,
    high: float,
) -> xr.DataArray:
    """A normal sample truncated to [low, high]: the inverse of the distribution at uniform numbers."""
    mean, deviation = centre
    below, above = (ndtr((end - mean) / deviation) for end in (low, high))
    uniform = rng.uniform(below, above, size=count, chunks=BLOCK)
    return xr.DataArray(
        mean + deviation * da.map_blocks(ndtri, uniform, dtype=float), dims="sample"
    )


def sample_surfaces(count: int) -> Surface:
    """Lazy samples; H stays in (0.3, 1], lognormal numbers within three standard deviations."""
    rng = da.random.default_rng(SEED)
    hurst = scattered(rng, count, HURST, 0.3, 1.0)
    h_rms, q1 = (
        np.exp(scattered(rng, count, (mean, width), mean - 3 * width, mean + 3 * width))
        for mean, width in (LOG_H_RMS, LOG_Q1)
    )
    return Surface(hurst, Q0, q1, h_rms, CREST * h_rms)


def spread_of_force(count: int) -> Spread:
    """Forces of the samples at GAP and their quantiles."""
    force = (
        contact(sample_surfaces(count), separation=GAP, theory=Mbma(rtol=1e-6))
        .pressure.compute(scheduler="threads")
        .values
    )
    levels = np.array(QUANTILES)
    # the rank of a quantile is binomial
    rank = np.sqrt(levels * (1 - levels) / count)
    low, high = (
        np.quantile(force, np.clip(levels + sign * rank, 0, 1)) for sign in (-1, 1)
    )
    return Spread(force, np.quantile(force, levels), (high - low) / 2)


def draw(spread: Spread, nominal: float) -> Figure:
    """Histogram of the force, with the force of the nominal surface."""
    figure = Figure(figsize=(7, 4.5), layout="constrained")
    axes = figure.subplots()
    low, high = np.quantile(spread.force, [0.001, 0.999])
    bins = np.geomspace(low, high, 80)
    axes.hist(spread.force, bins=bins, color="tab:blue", alpha=0.7)
    axes.axvline(nominal, color="black", label="nominal surface")
    for level, value in zip(QUANTILES, spread.quantiles, strict=True):
        axes.axvline(value, color="tab:red", linestyle=":")
        axes.text(
            value,
            1.01,
            f"{level:.0%}",
            color="tab:red",
            ha="center",
            transform=axes.get_xaxis_transform(),
        )
    axes.set(
        xscale="log",
        xlabel=f"force F/(A0 E*) at d = {GAP} um",
        ylabel=f"number of {spread.force.size} samples",
    )
    axes.legend()
    return figure


def main(out: pathlib.Path | None = None, samples: int = 200_000) -> Spread:
    """Sample, print and draw."""
    spread = spread_of_force(samples)
    middle = np.exp(LOG_H_RMS[0])
    nominal = contact(
        Surface(HURST[0], Q0, np.exp(LOG_Q1[0]), middle, CREST * middle), separation=GAP
    ).pressure
    mean = spread.force.mean()
    error = spread.force.std(ddof=1) / np.sqrt(samples)
    click.echo(
        f"{samples} samples at d = {GAP} um, F/(A0 E*); the nominal surface gives {nominal:.4e}"
    )
    click.echo(f"mean {mean:.4e} +- {error:.1e}")
    for level, value, error in zip(
        QUANTILES, spread.quantiles, spread.standard_errors, strict=True
    ):
        click.echo(f"{level:4.0%} below {value:.4e} +- {error:.1e}")
    if out is not None:
        out.write_bytes(to_picture(draw(spread, nominal), out.suffix[1:], outlines=True))
    return spread


@click.command()
@click.option(
    "--samples", default=200_000, show_default=True, type=click.IntRange(min=20)
)
@click.option(
    "--out",
    type=click.Path(path_type=pathlib.Path, dir_okay=False),
    help="Draw to this file, .png or .svg.",
)
def command(samples: int, out: pathlib.Path | None) -> None:
    """Spread of force over scattered surfaces."""
    main(out, samples)


if __name__ == "__main__":
    command()
