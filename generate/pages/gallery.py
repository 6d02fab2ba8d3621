"""docs/gallery.md: measured maps from file to contact law, with boundary elements on the same map."""

from __future__ import annotations

import dataclasses
import itertools
import os
import pathlib
import time
from typing import Any

import numpy as np
import pandas as pd
from scipy.signal import resample

from generate.pages.page import ROOT, Measured, read_csv, table, to_csv
from mbma_tables import contact_law
from mbma_tables.answers.measurement import curves, described, draw
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import MbmaError
from mbma_tables.common.files import write_file
from mbma_tables.laws.boundary_elements import LOADS
from mbma_tables.scenes.specimen import measured
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.surfaces.treatment import mirrored
from mbma_tables.theories import BoundaryElements, get_theory
from mbma_tables.theories.protocol import Theory
from mbma_tables.theories.wrapped import answer_where_finite

FOLDER = "docs/data/maps"
ROWS = f"{FOLDER}/boundary_elements.csv"
VARIABLE = "MBMA_REFERENCE_MAPS"
LAWS = ("mbma", "calibrated", "persson")
COLUMNS = ["force", "area", "mean_separation", "energy"]
HEAD = """\
# boundary elements on measured maps (Tamaas), plane removed, continued by mirror images, waves below
# four sampling steps removed; force over A0 E*, lengths in the map's unit
"""
SHOWN = (0.002, 0.01, 0.1, 0.3, 0.6)  # contact
GAPS = np.append(np.geomspace(1e-6, 0.1, 90)[:-1], np.linspace(0.1, 0.995, 300))  # u/h_max


@dataclasses.dataclass(frozen=True)
class Example:
    """A measurement and its options on the command line."""

    name: str
    options: dict[str, Any]

    def path(self) -> pathlib.Path | None:
        """The file, in the repository or in the folder that MBMA_REFERENCE_MAPS names; None if in neither."""
        places = [ROOT / FOLDER, *([pathlib.Path(os.environ[VARIABLE])] if VARIABLE in os.environ else [])]
        return next((place / self.name for place in places if (place / self.name).is_file()), None)


EXAMPLES = (
    Example("top-1.top", {"short_cutoff": "9.4nm"}),
    Example("frt-2.frt", {"fill": "harmonic", "outliers": 10, "short_cutoff": "0.8mm"}),
    Example("dektak-1.csv", {"outliers": 10, "long_cutoff": "100um"}),
)
REFINED, REFINED_LOADS = "di-1.di", 4  # whose light contacts are solved on a finer grid too
# too large to be shipped; their boundary elements are
BARS = (
    Example("al3d-1.al3d", {"short_cutoff": f"{4 * 4.38027e-07 * (1 - 1e-9)}m"}),
    Example("di-1.di", {"short_cutoff": f"{4 * 500 / 512 * (1 - 1e-9)}nm"}),
)


def read_rows() -> dict[str, FloatArray]:
    """Boundary elements by map: `COLUMNS`, shape (4, n), lengths in the file's unit."""
    if not (ROOT / ROWS).is_file():
        return {}
    return {str(name): own[COLUMNS].to_numpy().T for name, own in read_csv(ROOT / ROWS).groupby("map")}


def written(rows: dict[str, FloatArray]) -> bytes:
    """The same as a file."""
    frames = [pd.DataFrame(own.T, columns=COLUMNS).assign(map=name) for name, own in sorted(rows.items())]
    return to_csv(HEAD, pd.concat(frames)[["map", *COLUMNS]], "%.9g")


def refined(path: pathlib.Path, options: dict[str, Any]) -> FloatArray:
    """Light loads of a map on twice as many points along each side, by Fourier interpolation: ten minutes."""
    treated = measured(path, options)[0]
    values = mirrored(treated.heights - treated.heights.mean())
    for axis, count in enumerate(values.shape):
        values = resample(values, 2 * count, axis=axis)
    steps = [step / 2 for step in treated.steps]
    return BoundaryElements.from_map(values, *steps, periodic=True, loads=LOADS[:REFINED_LOADS]).rows


def simulated(example: Example, rows: dict[str, FloatArray]) -> FloatArray | None:
    """Loads of one map: those that are known, else solved, minutes; None of a line."""
    path = example.path()
    if example.name not in rows and path is not None:
        if measured(path, example.options)[0].heights.ndim == 1:
            return None
        rows[example.name] = BoundaryElements.from_map(path, **example.options).rows
        # at once: what comes after may be stopped
        write_file(ROOT / ROWS, written(rows))
    return rows.get(example.name)


def ratios(
    theory: Theory, surface: MeasuredSurface, force: FloatArray, area: FloatArray, u: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """A theory's area at a force and force at a separation over simulated ones; NaN where it does not reach them."""
    fine = answer_where_finite(theory, surface, np.append(u, GAPS * float(surface.h_max)))
    loads, areas = fine.pressure[u.size :], fine.area[u.size :]
    order = np.argsort(np.where(np.isfinite(loads), loads, np.inf))[: np.isfinite(loads).sum()]
    loads, areas = loads[order], np.maximum.accumulate(areas[order])
    # between gaps, a force that vanishes cannot be interpolated
    held = loads > 0
    own = np.interp(np.log(force), np.log(loads[held]), np.log(areas[held]), np.nan, np.nan)
    return np.exp(own) / area, fine.pressure[: u.size] / force


def compared(surface: MeasuredSurface, rows: FloatArray) -> str:
    """The calibrated law and MBMA over boundary elements, as a table."""
    force, area, u, _ = rows[:, [int(np.argmin(np.abs(np.log(rows[1] / share)))) for share in SHOWN]]
    columns = [area]
    for theory in map(get_theory, ("calibrated", "mbma")):
        try:
            columns += ratios(theory, surface, force, area, u)
        except MbmaError:
            columns += [np.full(u.size, np.nan)] * 2
    header = "contact | calibrated: area at given pressure | calibrated: force at given separation"
    text = table(f"{header} | MBMA: area | MBMA: force", zip(*columns, strict=True), "{:.2%} | {:.2f}")
    return text.replace("—", "-")


def laws(surfaces: dict[str, MeasuredSurface]) -> str:
    """What contact laws of surfaces cover, their bounds, and the time to make one."""
    rows = []
    for (name, surface), theory in itertools.product(surfaces.items(), LAWS):
        own, times = contact_law(surface, theory=theory), []
        # of another size each time, so that nothing is kept of it
        for other in [surface.resized(up, 1.0) for up in (1.1, 1.2, 1.3)]:
            started = time.process_time()
            contact_law(other, theory=theory)
            times.append(time.process_time() - started)
        low = (own.h_max + max(own.lowest, -own.h_max)) / 2 / own.h_max
        rows.append([name, theory, low, own.error, min(times)])
    header = "surface | theory | u/h_max from | error | time to make [s]"
    return table(header, rows, "{} | {} | {:.2g} | {:.1e} | {:.3f}")


def measure() -> Measured:
    """The blocks of the page, and its figures and data."""
    rows, surfaces = read_rows(), {}
    parts, files = {}, dict[str, Any]()
    for example in EXAMPLES:
        path, found = example.path(), simulated(example, rows)
        assert path is not None
        treated, surface = measured(path, example.options)
        surfaces[example.name] = surface
        stem, points = path.stem, None if found is None else dict(zip(["pressure", *COLUMNS[1:]], found, strict=True))
        picture = draw(treated, surface, curves(surface), example.name, "pressure  F/(A0 E*)", points)
        files[f"docs/figures/gallery_{stem}.svg"] = picture
        options = " ".join(f"--{name.replace('_', '-')} {value}" for name, value in example.options.items())
        command = f"mbma fit {FOLDER}/{example.name} {options} --plot {stem}.png"
        text = "\n".join(["```", f"$ {command}", *described(surface), "```"])
        if found is not None:
            text += f"\n\nRatios to boundary elements on this map:\n\n{compared(surface, found)}"
        parts[stem.replace("-", "_")] = text
    for example in BARS:
        simulated(example, rows)
        path = example.path()
        if example.name == REFINED and path is not None and f"{REFINED} refined" not in rows:
            rows[f"{REFINED} refined"] = refined(path, example.options)
    # a plateau and a power law in 2,000 samples that scatter, as single waves of a periodogram do
    q = np.geomspace(0.2, 60, 2000)
    C = np.minimum(1, q**-3.5) * np.random.default_rng(1).uniform(0.7, 1.4, q.size)
    scattered = MeasuredSurface(q, 1e-4 * C, h_max=0.07)
    parts["laws"] = laws(surfaces | {"2,000 scattered samples": scattered})
    return parts, files | {ROWS: written(rows)}
