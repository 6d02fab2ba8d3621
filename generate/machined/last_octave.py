"""`python -m generate last_octave`: what `mbma_tables.last_octave` states, against accurate simulations.

Raw maps of all kinds, with seeds that no fit saw, are asked with the defaults; both maps, with and
without the last octave of wavelengths, are pressed by Tamaas at a tolerance of 1e-7.
"""

import pathlib

import click
import numpy as np
import pandas as pd

import mbma_tables
from generate.files import ROOT
from generate.machined import raw_maps
from mbma_tables import Surface, contact

FILE = ROOT / "docs/data/last_octave.csv"
NUMBER = 600  # of the maps
AREAS = np.array([0.008, 0.06, 0.3])  # A/A0


@click.command()
@click.option("--out", type=click.Path(path_type=pathlib.Path), default=FILE)
def last_octave(out: pathlib.Path) -> None:
    """Write stated and true changes of ln A; stopped and called again, it goes on where it was."""
    rows = pd.read_csv(out).to_dict("records") if out.exists() else []
    done = {row["kind"] for row in rows}
    for k, kind in enumerate(raw_maps.KINDS):
        heights, periodic = raw_maps.raw(kind, NUMBER + k % 2)
        surface = Surface.from_map(heights, 1.0, periodic=periodic)
        found = contact(surface, area=AREAS)
        if kind in done or not np.all(found.valid):
            continue
        study = mbma_tables.last_octave(found)
        areas = []
        for each in study.contacts:
            simulated = each.surface.map.heights  # type: ignore[attr-defined]
            truth = raw_maps.pressed(simulated, periodic, study.pressure, 1)
            areas.append(truth[:, 0])
        true = np.log(areas[0] / areas[1])
        stated = study.change("area")
        for area, of_law, of_truth in zip(AREAS, stated, true, strict=True):
            rows.append(
                {"kind": kind, "area": area, "stated": of_law, "simulated": of_truth}
            )
        pd.DataFrame(rows).to_csv(out, index=False, float_format="%.4f")
