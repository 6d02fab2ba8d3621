"""Theories on maps beside boundary elements: docs/tutorials/map.md, docs/maps.md and docs/fidelity.md."""

from __future__ import annotations

import itertools
import os
import pathlib
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import pandas as pd
from scipy.signal import resample

from generate.boundary_elements.evidence import Simulated
from generate.boundary_elements.evidence import simulated as simulated_surfaces
from generate.boundary_elements.surfaces import TRAINING, Recipe, heights
from generate.files import ROOT, dataset, read_csv, to_csv
from generate.machined import artefacts, makers, profiles, raw_maps
from generate.machined.campaign import FORMS
from generate.machined.evaluation import by_family, covered, families_left_out, yielding
from generate.machined.unseen import UNSEEN
from generate.page import Cell, Measured, Picture, panels, printed, table
from mbma_tables import Surface, contact, theories
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import MbmaError
from mbma_tables.common.files import write_file
from mbma_tables.contacts.measurement import curves, draw
from mbma_tables.design.specimen import measured
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.surfaces.treatment import Treated, mirrored
from mbma_tables.theories import BoundaryElements, resolve
from mbma_tables.theories.base import Theory
from mbma_tables.theories.calibrated.curves import own_law
from mbma_tables.theories.simulated.boundary_elements import LOADS
from mbma_tables.theories.simulated.pressing import Press
from mbma_tables.theories.users import answer_where_finite

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FOLDER = "docs/data/maps"
ROWS = f"{FOLDER}/boundary_elements.csv"
COLUMNS = ["force", "area", "mean_separation", "energy"]
HEAD = (
    "# boundary elements on measured maps (Tamaas), plane removed, "
    "continued by mirror images, waves below\n"
    "# four sampling steps removed; force over A0 E*, lengths in the map's unit\n"
)
# u/h_max: by factors near to full contact, evenly above
GAPS = np.append(np.geomspace(1e-6, 0.1, 90)[:-1], np.linspace(0.1, 0.995, 300))
KINDS = ("stretched", "peaks", "valleys", "patchy", "worn")
GRADIENT = 0.1  # of surfaces: theories are for small ones
# contacts that are summed up: as far as islands do not lie on one another, and all
RANGES = {"mbma": (0.01, 0.1), "calibrated": (0.01, 0.97)}
EXTRAPOLATION = (
    f"mbma contact --map {FOLDER}/top-1.top --short-cutoff 9.4nm "
    "--extrapolate-to 2nm --extrapolate-hurst 0.8 "
    "--theory persson --pressure 0.0001,0.001,0.01"
)
Seen: TypeAlias = tuple[str, MeasuredSurface, FloatArray]
Options: TypeAlias = Mapping[str, str | int]

# files and their options on the command line
EXAMPLES: dict[str, Options] = {
    "top-1.top": {"short_cutoff": "9.4nm"},
    "frt-2.frt": {"fill": "harmonic", "outliers": 10, "short_cutoff": "0.8mm"},
    "dektak-1.csv": {"outliers": 10, "long_cutoff": "100um"},
}
# too large to be shipped; their boundary elements are. Waves of four sampling steps stay
BARS: dict[str, Options] = {
    "al3d-1.al3d": {"short_cutoff": f"{4 * 4.38027e-07 * (1 - 1e-9)}m"},
    "di-1.di": {"short_cutoff": f"{4 * 500 / 512 * (1 - 1e-9)}nm"},
}


def path_of(name: str) -> pathlib.Path | None:
    """The file, in the repository or in the folder that MBMA_REFERENCE_MAPS names.

    None if in neither.
    """
    shipped = ROOT / FOLDER / name
    reference = pathlib.Path(os.environ.get("MBMA_REFERENCE_MAPS", ""), name)
    for place in (shipped, reference):
        if place.is_file():
            return place
    return None


def read_rows() -> dict[str, FloatArray]:
    """Boundary elements by map: `COLUMNS`, shape (4, n), lengths in the file's unit."""
    by_map = {}
    for name, frame in read_csv(ROOT / ROWS).groupby("map"):
        by_map[str(name)] = frame[COLUMNS].to_numpy().T
    return by_map


def write_rows(rows: Mapping[str, FloatArray]) -> None:
    frames = []
    for name, values in sorted(rows.items()):
        frames.append(pd.DataFrame(values.T, columns=COLUMNS).assign(map=name))
    together = pd.concat(frames)[["map", *COLUMNS]]
    write_file(ROOT / ROWS, to_csv(HEAD, together, "%.9g"))


def refined(treated: Treated, surface: MeasuredSurface) -> FloatArray:
    """Light loads of a map on twice as many points along each side: ten minutes.

    Heights between the points are by Fourier interpolation.
    """
    values = mirrored(treated.heights - treated.heights.mean())
    sizes = values.shape[0] * treated.steps[0], values.shape[1] * treated.steps[1]
    for axis, count in enumerate(values.shape):
        values = resample(values, 2 * count, axis=axis)
    press = Press(values, sizes, own_law(surface).gradient)
    force, rows = press.loads(press.gradient * np.array(LOADS[:4]), False)
    return np.array([force, *rows])


def gallery() -> Measured:
    """What `mbma fit` prints of each example, and its picture with boundary elements.

    They are solved where the file has none.
    """
    rows = read_rows()
    parts: dict[str, str] = {}
    files: dict[str, Picture] = {}
    # light contacts of one map are solved on a finer grid too
    for label in (*EXAMPLES, *BARS, "di-1.di refined"):
        name = label.split()[0]
        path = path_of(name)
        options = (EXAMPLES | BARS)[name]
        if path is None:
            continue
        treated, surface = measured(path, options)
        if label not in rows and treated.heights.ndim == 2:
            if label == name:
                rows[label] = BoundaryElements.of(surface).rows
            else:
                rows[label] = refined(treated, surface)
            # at once: what comes after may be stopped
            write_rows(rows)
        if name not in EXAMPLES:
            continue

        simulated_curve = None
        if name in rows:
            quantities = ["pressure", *COLUMNS[1:]]
            simulated_curve = dict(zip(quantities, rows[name], strict=True))
        files[f"docs/figures/gallery_{path.stem}.svg"] = draw(
            treated,
            surface,
            curves(surface),
            name,
            "pressure  F/(A0 E*)",
            simulated_curve,
        )
        typed = [f"--{key.replace('_', '-')} {value}" for key, value in options.items()]
        command = f"mbma fit {FOLDER}/{name} {' '.join(typed)}"
        parts[path.stem.replace("-", "_")] = printed(command)
    return parts, files


def ratios(
    theory: Theory,
    surface: MeasuredSurface,
    force: FloatArray,
    area: FloatArray,
    u: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """A theory's area at a force and force at a separation over simulated ones.

    NaN where it does not reach them.
    """
    gaps = np.append(u, GAPS * float(surface.h_max))
    fine = answer_where_finite(theory, surface, gaps)
    pressure_at_gap = fine.pressure[: u.size]
    loads = fine.pressure[u.size :]
    areas = fine.area[u.size :]
    # rising loads; those that are not finite are sorted to the end
    order = np.argsort(loads)[: np.isfinite(loads).sum()]
    loads = loads[order]
    areas = np.maximum.accumulate(areas[order])
    # between gaps, a force that vanishes cannot be interpolated
    is_loaded = loads > 0
    log_loads = np.log(loads[is_loaded])
    log_areas = np.log(areas[is_loaded])
    log_area = np.interp(np.log(force), log_loads, log_areas, np.nan, np.nan)
    return np.exp(log_area) / area, pressure_at_gap / force


def _by_kind_and_shape(one: Simulated) -> tuple[int, float | str]:
    return KINDS.index(one.kind), one.node[-1]


def simulated() -> Iterator[Seen]:
    """Held-out surfaces by name, as maps, with F/(A0 E*), A/A0 and u of boundary elements."""
    tested = []
    for one, simulation in simulated_surfaces(dataset("elastic")):
        if simulation.kind in KINDS and simulation.split != TRAINING:
            tested.append((one, simulation))
    tested.sort(key=lambda pair: _by_kind_and_shape(pair[1]))
    for one, simulation in tested:
        shape = float(one["shape"])
        recipe = Recipe(
            simulation.kind,
            float(one.hurst),
            simulation.zeta_1,
            simulation.waves,
            int(one.seed),
            simulation.points,
            shape,
        )
        # of the map as it is, whose h_rms is 1
        scale = GRADIENT * float(one.q0_h_rms) / recipe.q0
        steps = [side / simulation.points for side in recipe.sizes]
        surface = Surface.from_map(scale * heights(recipe), *steps, periodic=True)
        assert isinstance(surface, MeasuredSurface)
        rows = np.stack([one.force * GRADIENT, one.area, one.mean_separation * scale])
        usable = np.isfinite(rows).all(axis=0) & (one.area.values > 0)
        ratio = "1:" if simulation.kind == "stretched" else ""
        yield f"{simulation.kind} {ratio}{shape:g}", surface, rows[:, usable]


def summary(simulations: Sequence[Seen]) -> list[Cell]:
    """Cells of one row: area and force of both theories over simulation.

    And how many answers are valid.
    """
    cells: list[Cell] = []
    for name, (low, high) in RANGES.items():
        theory = resolve(name)
        parts = []
        for _, surface, rows in simulations:
            inside = (rows[1] >= low) & (rows[1] <= high)
            parts.append(_ratios_and_validity(theory, surface, rows[:, inside]))
        *columns, valid = np.concatenate(parts, axis=1)
        cells += map(_mean_and_range, columns)
        answered = valid[np.isfinite(valid)]
        cells.append(f"{answered.mean():.0%}" if answered.size else "-")
    return cells


def _ratios_and_validity(
    theory: Theory, surface: MeasuredSurface, rows: FloatArray
) -> FloatArray:
    """Ratios of area and force, and whether an answer is valid; NaN where there is none."""
    force, area, u = rows
    valid = np.full(u.size, np.nan)
    try:
        # a map's curve may end before full contact
        reached = u >= theory.interval(surface)[0]
        answer = contact(surface, mean_separation=u[reached], theory=theory)
        valid[reached] = answer.valid
        return np.stack([*ratios(theory, surface, force, area, u), valid])
    except MbmaError:
        return np.full((3, u.size), np.nan)


def _mean_and_range(ratio: FloatArray) -> Cell:
    """Geometric mean, least and largest."""
    positive = ratio[np.isfinite(ratio) & (ratio > 0)]
    if not positive.size:
        return "-"
    return np.exp(np.mean(np.log(positive))), positive.min(), positive.max()


def _mean_property(simulations: Sequence[Seen], name: str) -> float:
    """Mean of a property of surfaces, which their bearing or they themselves have."""
    values = []
    for _, surface, _ in simulations:
        values.append(getattr(surface.bearing, name, getattr(surface, name, 0.0)))
    return float(np.mean(values))


def maps() -> Measured:
    groups: dict[str, list[Seen]] = {}
    for one in simulated():
        groups.setdefault(one[0], []).append(one)
    rows_of_maps = read_rows()
    for name, options in (EXAMPLES | BARS).items():
        path = path_of(name)
        if name in rows_of_maps and path is not None:
            _, surface = measured(path, options)
            label = f"measured: {name}"
            groups[label] = [(label, surface, rows_of_maps[name][:3])]

    rows = []
    for name, simulations in groups.items():
        row: list[Cell] = [
            f"{name} ({len(simulations)})",
            _mean_property(simulations, "anisotropy"),
            _mean_property(simulations, "slope_kurtosis"),
            _mean_property(simulations, "skewness"),
            *summary(simulations),
        ]
        rows.append(row)
    header = (
        "surfaces (number) | anisotropy | kurtosis of slopes | skewness"
        " | MBMA: area | MBMA: force | MBMA: valid"
        " | calibrated: area | calibrated: force | calibrated: valid"
    )
    forms = "{} | {:.1f} | {:.1f} | {:.1f} | {:.2f} ({:.2f} to {:.2f})"
    parts = {
        "shapes": table(header, rows, forms),
        "extrapolation": printed(EXTRAPOLATION),
        "artefacts": artefacts_by_group(),
        "raw_maps": raw_maps_by_truth(),
    }
    return parts, {"docs/figures/profiles.svg": draw_profiles()}


def draw_profiles() -> Figure:
    """Height and gradient of single traces over those of their maps, with stated errors."""
    chosen = itertools.chain(profiles.machined(5, 2), profiles.elastic(30, 2))
    isotropic = [one for one in chosen if one.family in profiles.ISOTROPIC]
    found = list(itertools.chain.from_iterable(map(profiles.reduced, isotropic)))
    titles = {"h_rms": "$h_{rms}$", "rms_gradient": "rms gradient"}
    figure, axes = panels(1, 2, (9, 3.6), sharex=True, sharey=True)
    for axis, (number, title) in zip(axes, titles.items(), strict=True):
        own = [each for each in found if each.number == number]
        for sides in sorted({each.sides for each in own}):
            some = [each for each in own if each.sides == sides]
            misses = np.array([(each.ratio - 1) / each.deviation for each in some])
            within = [(np.abs(misses) < most).mean() for most in (1, 2)]
            axis.errorbar(
                [each.waves for each in some],
                [each.ratio for each in some],
                [each.deviation for each in some],
                fmt="o",
                markersize=3,
                linewidth=0.8,
                label=f"{sides} sides: {within[0]:.0%} within one standard error, {within[1]:.0%} within two",
            )
        axis.axhline(1.0, color="black", linewidth=0.8)
        axis.set_xscale("log")
        axis.set_xlabel("longest wavelengths in the trace")
        axis.set_title(f"{title} of a trace over that of its map", fontsize="medium")
        axis.legend(fontsize="x-small", loc="lower right")
    return figure


def artefacts_by_group() -> str:
    """Planted artefacts: maps reported, wrong, and wrong but not reported, as `artefacts` wrote them."""
    counts = ["maps", "reported", "wrong", "missed"]
    sums = pd.read_csv(artefacts.FILE).groupby("group", sort=False)[counts].sum()
    planted = sums.drop(index="none")
    sums.loc["all with an artefact"] = planted.sum()
    rows: list[list[Cell]] = [
        [str(group), *map(int, row)] for group, row in sums.iterrows()
    ]
    header = "artefact | maps | not valid | area wrong | wrong and no warning"
    return table(header, rows, "{} | {:d}")


def raw_maps_by_truth() -> str:
    """Errors of default answers of raw maps and how many the scatter covers."""
    data = pd.read_csv(raw_maps.FILE)
    rows: list[list[Cell]] = []
    for (times, truth), new in itertools.product(TRUTHS.items(), (False, True)):
        chosen = (data.times == times) & (data.valid == 1)
        found = data[chosen & (data.kind.isin(UNSEEN) == new)]
        name = f"{'new kinds' if new else 'machined'}, {truth}"
        for quantity, (error, scatter) in raw_maps.errors(found).items():
            if error.empty:
                continue
            ratio = (error / scatter).abs()
            shares = [(ratio < 1).mean(), (ratio < 2).mean(), ratio.max()]
            most = error.abs().quantile(0.9)
            rows.append([name, quantity, len(error), most, *map(float, shares)])
    header = (
        "maps and truth | quantity | answers | 90% of errors below"
        " | within one | within two standard deviations | largest"
    )
    counts = data.groupby(["kind", "number"]).times.max()
    loads = len(raw_maps.RANGES)
    share = ((data.times == 1) & (data.valid == 1)).sum() / (loads * counts.size)
    text = f"{counts.size} maps of {data.kind.nunique()} kinds; {share:.0%} of the answers are valid."
    errors = table(header, rows, "{} | {} | {:d} | {:.1%} | {:.0%} | {:.0%} | {:.1f}")
    return f"{text}\n\n{errors}"


TRUTHS = {1: "same points", 2: "twice the points", 4: "four times the points"}


def draw_families() -> Figure:
    figure, axes = panels(2, 7, (14, 5))
    for axis, family in itertools.zip_longest(axes.ravel(), makers.FAMILIES):
        axis.set_axis_off()
        if not family:
            continue
        z = makers.heights(makers.Part(family, 1))
        # every fourth point is enough for a small picture
        axis.imshow(z[::4, ::4].T, origin="lower", interpolation="none")
        side = f"{len(z)} × {len(z)} steps"
        heights = f"{z.min():.2g} to {z.max():.2g}"
        axis.set_title(f"{family}\n{side}, {heights}", fontsize="small")
    return figure


def machined() -> Measured:
    data = dataset("machined")
    parts = {"yielding": yielding(data), "coverage": covered(data)}
    for form, theory in FORMS.items():
        section = theory.name
        if isinstance(theory, theories.Simulated):
            section = str(theory.grid)
        parts[section] = by_family(data, form)
        parts[f"left_out_{section}"] = families_left_out(data, form)
    return parts, {"docs/figures/machined.svg": draw_families()}
