"""`python -m generate measured_maps`: boundary elements on measured maps, what docs/fidelity.md needs of them."""

from __future__ import annotations

import dataclasses
import io
import pathlib

import click
import numpy as np

from generate.boundary_elements.solve import pressed
from mbma_tables.common.files import write_file
from mbma_tables.surfaces.maps import prepared
from mbma_tables.surfaces.treatment import Treated
from mbma_tables.theories.own_map import continued

TARGET = pathlib.Path("docs/data")
LARGEST = 256  # points a side that are kept, from the middle


def middle(treated: Treated) -> Treated:
    """At most `LARGEST` points a side from the middle of a map."""
    kept = tuple(slice((n - min(n, LARGEST)) // 2, (n + min(n, LARGEST)) // 2) for n in treated.heights.shape)
    return dataclasses.replace(treated, heights=treated.heights[kept])


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("maps", nargs=-1, required=True, type=click.Path(path_type=pathlib.Path, exists=True, dir_okay=False))
@click.option("--folder", type=click.Path(path_type=pathlib.Path), default=TARGET, show_default=True)
def measured_maps(maps: tuple[pathlib.Path, ...], folder: pathlib.Path) -> None:
    """Press measured maps, read by SurfaceTopography, flat: a few minutes each."""
    for path in maps:
        treated = middle(prepared(path, {"periodic": False}))
        surface, sizes = continued(treated)
        # in units of the shorter side, as random surfaces are
        unit = min(sizes)
        found = pressed(surface / unit, (sizes[0] / unit, sizes[1] / unit), 2 * np.pi)
        content = io.BytesIO()
        np.savez_compressed(content, **found)
        target = folder / f"measured_{path.stem}.npz"
        write_file(target, content.getvalue(), make_folders=True)
        click.echo(f"{target}: h_rms {surface.std():.4g} {treated.unit}, anisotropy {float(found['anisotropy']):.3g}")
