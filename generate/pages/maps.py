"""Theories on maps beside boundary elements: docs/gallery.md, docs/maps.md and docs/machined.md."""

import itertools
import os
import pathlib
from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd
from scipy.signal import resample

from generate.boundary_elements.evidence import simulated as simulated_surfaces
from generate.boundary_elements.surfaces import TRAINING, Recipe, heights
from generate.files import ROOT, dataset, read_csv, to_csv
from generate.machined import makers
from generate.machined.campaign import FORMS
from generate.machined.evaluation import by_family, covered, families_left_out, yielding
from generate.page import Measured, panels, printed, table
from mbma_tables import Surface, contact
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import MbmaError
from mbma_tables.common.files import write_file
from mbma_tables.contacts.measurement import curves, draw
from mbma_tables.scenes.specimen import measured
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.surfaces.treatment import Treated, mirrored
from mbma_tables.theories import BoundaryElements, Simulated, get_theory
from mbma_tables.theories.base import Theory
from mbma_tables.theories.calibrated.curves import own_law
from mbma_tables.theories.simulated.boundary_elements import LOADS
from mbma_tables.theories.simulated.pressing import Press
from mbma_tables.theories.users import answer_where_finite

FOLDER = "docs/data/maps"
ROWS = f"{FOLDER}/boundary_elements.csv"
COLUMNS = ["force", "area", "mean_separation", "energy"]
HEAD = """\
# boundary elements on measured maps (Tamaas), plane removed, continued by mirror images, waves below
# four sampling steps removed; force over A0 E*, lengths in the map's unit
"""
GAPS = np.append(
    np.geomspace(1e-6, 0.1, 90)[:-1], np.linspace(0.1, 0.995, 300)
)  # u/h_max
KINDS = ("stretched", "peaks", "valleys", "patchy", "worn")
GRADIENT = 0.1  # of surfaces: theories are for small ones
# contacts that are summed up: as far as islands do not lie on one another, and all
RANGES = {"mbma": (0.01, 0.1), "calibrated": (0.01, 0.97)}
EXTRAPOLATION = (
    f"mbma contact --map {FOLDER}/top-1.top --short-cutoff 9.4nm --extrapolate-to 2nm --extrapolate-hurst 0.8 "
    "--theory persson --pressure 0.0001,0.001,0.01"
)
Seen = tuple[str, MeasuredSurface, FloatArray]


# files and their options on the command line
EXAMPLES: dict[str, dict[str, Any]] = {
    "top-1.top": {"short_cutoff": "9.4nm"},
    "frt-2.frt": {"fill": "harmonic", "outliers": 10, "short_cutoff": "0.8mm"},
    "dektak-1.csv": {"outliers": 10, "long_cutoff": "100um"},
}
# too large to be shipped; their boundary elements are
BARS: dict[str, dict[str, Any]] = {
    "al3d-1.al3d": {"short_cutoff": f"{4 * 4.38027e-07 * (1 - 1e-9)}m"},
    "di-1.di": {"short_cutoff": f"{4 * 500 / 512 * (1 - 1e-9)}nm"},
}


def path_of(name: str) -> pathlib.Path | None:
    """The file, in the repository or in the folder that MBMA_REFERENCE_MAPS names; None if in neither."""
    places = (
        ROOT / FOLDER / name,
        pathlib.Path(os.environ.get("MBMA_REFERENCE_MAPS", ""), name),
    )
    return next(filter(pathlib.Path.is_file, places), None)


def read_rows() -> dict[str, FloatArray]:
    """Boundary elements by map: `COLUMNS`, shape (4, n), lengths in the file's unit."""
    return {
        str(name): own[COLUMNS].to_numpy().T
        for name, own in read_csv(ROOT / ROWS).groupby("map")
    }


def refined(treated: Treated, surface: MeasuredSurface) -> FloatArray:
    """Light loads of a map on twice as many points along each side, by Fourier interpolation: ten minutes."""
    values = mirrored(treated.heights - treated.heights.mean())
    sizes = values.shape[0] * treated.steps[0], values.shape[1] * treated.steps[1]
    for axis, count in enumerate(values.shape):
        values = resample(values, 2 * count, axis=axis)
    press = Press(values, sizes, own_law(surface).gradient)
    force, rows = press.loads(press.gradient * np.array(LOADS[:4]), False)
    return np.array([force, *rows])


def gallery() -> Measured:
    """What `mbma fit` prints of each example, and its picture with boundary elements, solved where none are known."""
    rows, parts, files = read_rows(), {}, dict[str, Any]()
    # light contacts of one map are solved on a finer grid too
    for label in (*EXAMPLES, *BARS, "di-1.di refined"):
        name = label.split()[0]
        path, options = path_of(name), (EXAMPLES | BARS)[name]
        if path is None:
            continue
        treated, surface = measured(path, options)
        if label not in rows and treated.heights.ndim == 2:
            rows[label] = (
                BoundaryElements.of(surface).rows
                if label == name
                else refined(treated, surface)
            )
            frames = [
                pd.DataFrame(own.T, columns=COLUMNS).assign(map=of)
                for of, own in sorted(rows.items())
            ]
            # at once: what comes after may be stopped
            write_file(
                ROOT / ROWS, to_csv(HEAD, pd.concat(frames)[["map", *COLUMNS]], "%.9g")
            )
        if name in EXAMPLES:
            found = (
                dict(zip(["pressure", *COLUMNS[1:]], rows[name], strict=True))
                if name in rows
                else None
            )
            picture = draw(
                treated, surface, curves(surface), name, "pressure  F/(A0 E*)", found
            )
            files[f"docs/figures/gallery_{path.stem}.svg"] = picture
            shown = " ".join(
                f"--{key.replace('_', '-')} {value}" for key, value in options.items()
            )
            parts[path.stem.replace("-", "_")] = printed(
                f"mbma fit {FOLDER}/{name} {shown}"
            )
    return parts, files


def ratios(
    theory: Theory,
    surface: MeasuredSurface,
    force: FloatArray,
    area: FloatArray,
    u: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """A theory's area at a force and force at a separation over simulated ones; NaN where it does not reach them."""
    fine = answer_where_finite(theory, surface, np.append(u, GAPS * float(surface.h_max)))
    loads, areas = fine.pressure[u.size :], fine.area[u.size :]
    order = np.argsort(loads)[: np.isfinite(loads).sum()]
    loads, areas = loads[order], np.maximum.accumulate(areas[order])
    # between gaps, a force that vanishes cannot be interpolated
    held = loads > 0
    own = np.interp(
        np.log(force), np.log(loads[held]), np.log(areas[held]), np.nan, np.nan
    )
    return np.exp(own) / area, fine.pressure[: u.size] / force


def simulated() -> Iterator[Seen]:
    """Held-out surfaces by name, as maps, with F/(A0 E*), A/A0 and u of boundary elements."""
    pairs = (
        (one, known)
        for one, known in simulated_surfaces(dataset("elastic"))
        if known.kind in KINDS
    )
    for one, known in sorted(
        pairs, key=lambda pair: (KINDS.index(pair[1].kind), pair[1].node[-1])
    ):
        if known.split == TRAINING:
            continue
        shape, points = float(one["shape"]), known.points
        recipe = Recipe(
            known.kind,
            float(one.hurst),
            known.zeta_1,
            known.waves,
            int(one.seed),
            points,
            shape,
        )
        # of the map as it is, whose h_rms is 1
        scale = GRADIENT * float(one.q0_h_rms) / recipe.q0
        surface = Surface.from_map(
            scale * heights(recipe),
            *(side / points for side in recipe.sizes),
            periodic=True,
        )
        assert isinstance(surface, MeasuredSurface)
        rows = np.stack([one.force * GRADIENT, one.area, one.mean_separation * scale])
        name = (
            f"stretched 1:{shape:g}"
            if known.kind == "stretched"
            else f"{known.kind} {shape:g}"
        )
        yield (
            name,
            surface,
            rows[:, np.isfinite(rows).all(axis=0) & (one.area.values > 0)],
        )


def summary(simulations: list[Seen]) -> list[Any]:
    """Cells of one row: area and force of both theories over simulation, and how many answers are valid."""
    cells: list[Any] = []
    for name, (low, high) in RANGES.items():
        theory, found = get_theory(name), []
        for _, surface, rows in simulations:
            force, area, u = rows[:, (rows[1] >= low) & (rows[1] <= high)]
            valid = np.full(u.size, np.nan)
            try:
                # a map's curve may end before full contact
                reached = u >= theory.interval(surface)[0]
                valid[reached] = contact(
                    surface, mean_separation=u[reached], theory=theory
                ).valid
                found.append(np.stack([*ratios(theory, surface, force, area, u), valid]))
            except MbmaError:
                found.append(np.full((3, u.size), np.nan))
        *columns, valid = np.concatenate(found, axis=1)
        for column in columns:
            known = column[np.isfinite(column) & (column > 0)]
            cells.append(
                (np.exp(np.mean(np.log(known))), known.min(), known.max())
                if known.size
                else "-"
            )
        answered = valid[np.isfinite(valid)]
        cells.append(f"{answered.mean():.0%}" if answered.size else "-")
    return cells


def maps() -> Measured:
    groups, known = dict[str, list[Seen]](), read_rows()
    for one in simulated():
        groups.setdefault(one[0], []).append(one)
    for name, options in (EXAMPLES | BARS).items():
        path = path_of(name)
        if name in known and path is not None:
            label = f"measured: {name}"
            groups[label] = [(label, measured(path, options)[1], known[name][:3])]
    rows = []
    for name, own in groups.items():
        stretch, kurtosis, skewness = (
            np.mean([getattr(s.bearing, key, getattr(s, key, 0.0)) for _, s, _ in own])
            for key in ("anisotropy", "slope_kurtosis", "skewness")
        )
        rows.append([f"{name} ({len(own)})", stretch, kurtosis, skewness, *summary(own)])
    columns = (
        f"{name}: {what}"
        for name in ("MBMA", "calibrated")
        for what in ("area", "force", "valid")
    )
    header = f"surfaces (number) | anisotropy | kurtosis of slopes | skewness | {' | '.join(columns)}"
    shapes = table(
        header, rows, "{} | {:.1f} | {:.1f} | {:.1f} | {:.2f} ({:.2f} to {:.2f})"
    )
    return {"shapes": shapes, "extrapolation": printed(EXTRAPOLATION)}, {}


def draw_families() -> Any:
    figure, axes = panels(2, 7, (14, 4.4))
    for axis, family in itertools.zip_longest(axes.ravel(), makers.FAMILIES):
        axis.set_axis_off()
        if family:
            axis.imshow(
                makers.heights(makers.Part(family, 1))[::4, ::4].T,
                origin="lower",
                interpolation="none",
            )
            axis.set_title(family)
    return figure


def machined() -> Measured:
    data = dataset("machined")
    parts = {"yielding": yielding(data), "coverage": covered(data)}
    for form, theory in FORMS.items():
        section = theory.grid if isinstance(theory, Simulated) else theory.name
        parts[str(section)] = by_family(data, form)
        parts[f"left_out_{section}"] = families_left_out(data, form)
    return parts, {"docs/figures/machined.svg": draw_families()}
