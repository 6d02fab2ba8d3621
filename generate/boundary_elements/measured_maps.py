"""`python -m generate measured_maps`: boundary elements on measured maps, what docs/fidelity.md needs of them."""

from __future__ import annotations

import io
import pathlib

import click
import numpy as np

from generate.boundary_elements.solve import pressed
from mbma_tables.arguments import FloatArray
from mbma_tables.files import write_file
from mbma_tables.surfaces.maps import detrended_map

TARGET = pathlib.Path("docs/data")
LARGEST = 256  # points a side that are kept, from the middle


def continued(heights: FloatArray) -> FloatArray:
    """The middle of a map and its mirror images, which is periodic."""
    middle = tuple(slice((n - min(n, LARGEST)) // 2, (n + min(n, LARGEST)) // 2) for n in heights.shape)
    kept = heights[middle]
    whole = np.concatenate([kept, kept[::-1]])
    whole = np.concatenate([whole, whole[:, ::-1]], axis=1)
    mean: FloatArray = whole - whole.mean()
    return mean


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("maps", nargs=-1, required=True, type=click.Path(path_type=pathlib.Path, exists=True, dir_okay=False))
@click.option("--folder", type=click.Path(path_type=pathlib.Path), default=TARGET, show_default=True)
def measured_maps(maps: tuple[pathlib.Path, ...], folder: pathlib.Path) -> None:
    """Press measured maps, read by SurfaceTopography, flat: a few minutes each."""
    import SurfaceTopography

    for path in maps:
        topography = SurfaceTopography.read_topography(str(path))
        heights, dx, dy, _ = detrended_map(topography, None, None, False, None)
        surface = continued(heights)
        sizes = surface.shape[0] * dx, surface.shape[1] * dy
        # in units of the shorter side, as random surfaces are
        unit = min(sizes)
        found = pressed(surface / unit, (sizes[0] / unit, sizes[1] / unit), 2 * np.pi)
        content = io.BytesIO()
        np.savez_compressed(content, **found)
        target = folder / f"measured_{path.stem}.npz"
        write_file(target, content.getvalue(), make_folders=True)
        click.echo(
            f"{target}: h_rms {heights.std():.4g} {topography.unit}, anisotropy {float(found['anisotropy']):.3g}"
        )
