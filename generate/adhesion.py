"""`python -m generate adhesion`: contacts with an attraction by boundary elements, and what the theory answers.

Each surface and attraction has a file of its own, and called again it goes on where it was.
Heights have an rms gradient of one and E* is one, so that pressures are over E* g; lengths are in h_rms.
"""

import dataclasses
import itertools
import pathlib
from typing import Any, cast

import click
import numpy as np
import pandas as pd

from generate import files
from generate.boundary_elements import run as campaigns
from generate.boundary_elements.solve import load_at, prepared
from generate.boundary_elements.surfaces import Recipe, Task, heights
from mbma_tables import Adhesion, Bodies, Surface, contact
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import ConvergenceError, MbmaError
from mbma_tables.common.files import write_file
from mbma_tables.theories import adhesion as theory
from mbma_tables.theories.simulated.adhesive import AdhesiveContact

FILE = files.ROOT / "docs" / "data" / "adhesion.csv"
# H, zeta_1, waves, seed, whether a constant may see it: eight points to the shortest wave
SURFACES = (
    (0.8, 8, 4, 11, True),
    (0.3, 8, 4, 15, False),
    (0.4, 16, 2, 12, True),
    (0.9, 16, 2, 16, False),
    (1.0, 8, 4, 13, True),
    (0.6, 16, 2, 17, False),
    (0.6, 8, 4, 14, True),
    (0.2, 8, 4, 18, False),
)
POINTS = 256
RANGES = (0.03, 0.1, 0.3, 1.0)  # over h_rms
TABOR = (0.1, 0.2, 0.35, 0.5)
AREAS = (0.002, 0.006, 0.02, 0.06, 0.15, 0.3, 0.55, 0.8)  # of elastic loads, about
TOLERANCE = 1e-6
PATH_RANGE = 0.3  # over h_rms, of contacts followed in approach
COVERED = 0.92  # share of contacts that two standard deviations are to cover
GRADIENT = 0.1  # rms, of surfaces that theories are asked about
HEAD = """\
# Contacts with an exponential attraction by mbma_tables.theories.simulated.adhesive, by python -m generate adhesion.
# Pressures over E* g, g the rms gradient; lengths and work over E* g in h_rms; tabor: Tabor's number of a summit; fitted: 1 where constants may see it.
# area: A/A0 that touches, corrected for its edges; area_raw: share of points; area_compressed: of points with a net pressure; elastic_*: without attraction.
# Empty: the attraction does not settle.
"""
COLUMNS = (
    *("hurst", "zeta_1", "waves", "seed", "fitted", "range", "tabor", "work"),
    *("contact_pressure", "net_pressure", "area", "area_raw", "area_compressed"),
    *("mean_separation", "elastic_area", "elastic_separation", "renewals"),
)


@dataclasses.dataclass(frozen=True)
class Case:
    """A surface and an attraction."""

    surface: Recipe
    fitted: bool  # whether a constant may see it
    range: float  # over h_rms
    tabor: float

    @property
    def name(self) -> str:
        return f"{self.surface.name}_r{self.range:g}_t{self.tabor:g}"

    def map(self) -> FloatArray:
        """Heights at rms gradient 1, of unit sides."""
        recipe = self.surface
        values, _, _ = prepared(heights(recipe), recipe.sizes, recipe.q0)
        return np.asarray(values)

    def lengths(self, surface: FloatArray) -> tuple[float, float]:
        """Work over E* and range."""
        face = Surface.from_map(surface, dx=1 / len(surface), periodic=True)
        rho = self.range * float(surface.std())
        curvature = np.sqrt(theory.LAPLACIAN * float(face.m4))
        return float(np.sqrt(self.tabor**3 * curvature * rho**3 / 2)), rho


def cases() -> list[Case]:
    """Every case of the campaign."""
    return [
        Case(
            Recipe("self_affine", hurst, zeta_1, waves, seed, POINTS),
            fitted,
            length,
            number,
        )
        for hurst, zeta_1, waves, seed, fitted in SURFACES
        for length, number in itertools.product(RANGES, TABOR)
    ]


def described(case: Case) -> dict[str, Any]:
    """Columns of a case."""
    own = case.surface
    return {
        "hurst": own.hurst,
        "zeta_1": own.zeta_1,
        "waves": own.waves,
        "seed": own.seed,
        "fitted": int(case.fitted),
        "range": case.range,
        "tabor": case.tabor,
    }


def solved(case: Any) -> dict[str, FloatArray]:
    """Contacts of a case from the heaviest load on; NaN where the attraction does not settle."""
    surface = case.map()
    face = Surface.from_map(surface, dx=1 / len(surface), periodic=True)
    h_rms = float(surface.std())
    work, rho = case.lengths(surface)
    engine = AdhesiveContact(
        surface, (1.0, 1.0), lambda gap: work / rho * np.exp(-gap / rho), TOLERANCE
    )
    rows = []
    for share in reversed(AREAS):
        load = load_at(share, np.inf)
        row = {"work": work / h_rms, "contact_pressure": load}
        rows.append(row | _answers(engine, load, face, h_rms))
    names = COLUMNS[COLUMNS.index("work") :]
    return {name: np.array([row.get(name, np.nan) for row in rows]) for name in names}


def _answers(
    engine: AdhesiveContact, load: float, face: Any, h_rms: float
) -> dict[str, float]:
    """What is found at a load, and without attraction at the same net pressure."""
    try:
        found = dict(engine.press(load))
    except ConvergenceError:
        return {}
    found["mean_separation"] /= h_rms
    if found["net_pressure"] > 0:
        free = contact(face, pressure=found["net_pressure"], theory="simulated")
        found["elastic_area"] = float(free.area)
        found["elastic_separation"] = float(free.mean_separation) / h_rms
    return found


def approached(case: Case, work: float) -> pd.DataFrame:
    """Contacts of a case from the lightest load on, each from the one before it; work over E* in h_rms."""
    surface = case.map()
    h_rms = float(surface.std())
    rho, strength = case.range * h_rms, work / case.range
    engine = AdhesiveContact(
        surface, (1.0, 1.0), lambda gap: strength * np.exp(-gap / rho), TOLERANCE
    )
    found = []
    for share in AREAS:
        row = {"contact_pressure": load_at(share, np.inf)}
        try:
            row |= engine.press(row["contact_pressure"])
        except ConvergenceError:
            break
        row["mean_separation"] /= h_rms
        found.append(row)
    return pd.DataFrame(found)


def _hysteresis(rows: pd.DataFrame) -> None:
    """Contacts in approach beside those in retreat, of which the file is, on held-out surfaces."""
    for number in TABOR:
        differences = []
        for case in cases():
            if case.fitted or case.tabor != number or case.range != PATH_RANGE:
                continue
            own = (rows.seed == case.surface.seed) & (rows.range == case.range)
            retreat = rows[own & (rows.tabor == number)].sort_values("contact_pressure")
            approach = approached(case, float(retreat.work.iloc[0]))
            retreat = retreat.iloc[: len(approach)]
            net = approach.net_pressure.to_numpy() - retreat.net_pressure.to_numpy()
            differences.append(
                [
                    np.abs(net) / approach.contact_pressure,
                    np.abs(
                        np.log(
                            approach.mean_separation / retreat.mean_separation.to_numpy()
                        )
                    ),
                    np.abs(approach.area_compressed - retreat.area_compressed.to_numpy()),
                ]
            )
        found = np.concatenate([np.array(each) for each in differences], axis=1)
        found = found[:, np.isfinite(found).all(axis=0)]
        net, gap, area = found.max(axis=1) if found.size else (np.nan,) * 3
        click.echo(
            f"Tabor {number:g}: {found.shape[1]} contacts in approach and retreat; largest difference of "
            f"net pressure over contact pressure {net:.1e}, of ln of the mean gap {gap:.1e}, of A/A0 {area:.1e}"
        )


def answered(rows: pd.DataFrame, name: str, share: float) -> pd.DataFrame:
    """What a theory answers at the net pressures of simulations, with a share of the traction in contact.

    Areas over A0, gaps and their scatter in h_rms; NaN where it refuses.
    """
    kept = theory.THETA
    theory.THETA = share
    try:
        found = [_answer(row, name) for row in rows.itertuples()]
    finally:
        theory.THETA = kept
    columns = ["area", "gap", "area_scatter", "gap_scatter", "valid"]
    return pd.DataFrame(found, columns=columns, index=rows.index)


_FACES: dict[Any, Any] = {}


def face_of(row: Any, name: str) -> Any:
    """The map for "simulated", the numbers of the surface for other theories."""
    key = (row.seed, name)
    if key not in _FACES:
        recipe = Recipe(
            "self_affine", row.hurst, row.zeta_1, int(row.waves), int(row.seed), POINTS
        )
        surface, _, known = prepared(heights(recipe), recipe.sizes, recipe.q0)
        surface = GRADIENT * surface
        if name == "simulated":
            _FACES[key] = Surface.from_map(surface, dx=1 / POINTS, periodic=True)
        else:
            h_rms = float(surface.std())
            h_max = float(known["h_max"]) * h_rms
            q0 = recipe.q0
            _FACES[key] = Surface(row.hurst, q0, q0 * row.zeta_1, h_rms, h_max)
    return _FACES[key]


def elastic(rows: pd.DataFrame, name: str) -> pd.DataFrame:
    """What a theory answers at the same net pressures without attraction: areas over A0, gaps in h_rms."""
    found = []
    for row in rows.itertuples():
        face: Any = face_of(row, name)
        free = contact(
            face, 1.0, pressure=float(row.net_pressure) * GRADIENT, theory=name
        )
        gap = float(free.mean_separation) / float(face.h_rms)
        found.append([float(free.area), gap])
    return pd.DataFrame(found, columns=["area", "gap"], index=rows.index)


def _answer(row: Any, name: str) -> list[Any]:
    face = face_of(row, name)
    h_rms = float(face.h_rms)
    attraction = Adhesion(row.work * h_rms * GRADIENT, row.range * h_rms)
    pressure = row.net_pressure * GRADIENT
    try:
        pressed = contact(
            face, Bodies(1.0, adhesion=attraction), pressure=pressure, theory=name
        )
    except MbmaError:
        return [np.nan] * 4 + [False]
    return [
        float(pressed.area),
        float(pressed.mean_separation) / h_rms,
        float(pressed.area_scatter),
        float(pressed.separation_scatter) / h_rms,
        bool(pressed.valid),
    ]


@click.command()
@click.option(
    "--folder",
    type=click.Path(path_type=pathlib.Path),
    default="adhesion",
    show_default=True,
    help="One file a surface and attraction.",
)
@click.option(
    "--data", type=click.Path(path_type=pathlib.Path), default=FILE, show_default=True
)
@click.option("--compare", is_flag=True, help="Print errors of the theory, no runs.")
@click.option(
    "--scatter", is_flag=True, help="Print what covers held-out contacts, no runs."
)
@click.option(
    "--hysteresis", is_flag=True, help="Follow held-out contacts in approach, in minutes."
)
def adhesion(
    folder: pathlib.Path,
    data: pathlib.Path,
    compare: bool,
    scatter: bool,
    hysteresis: bool,
) -> None:
    """Solve contacts with an attraction, half an hour on one core; `--compare` with the theory.

    Stopped and called again, it goes on where it was.
    """
    if hysteresis:
        _hysteresis(pd.read_csv(data, comment="#"))
        return
    if scatter:
        _fit_scatter(pd.read_csv(data, comment="#"))
        return
    if compare:
        _compare(pd.read_csv(data, comment="#"))
        return
    asked = cases()
    campaigns.run([Task(cast(Recipe, case), "") for case in asked], folder, 1, solved)
    frame = campaigns.gathered(folder, asked, described)
    write_file(data, files.to_csv(HEAD, frame[list(COLUMNS)], "%.8g"))


def under_compression(rows: pd.DataFrame) -> pd.Series:
    """Area under compression, corrected for the edges of contact as the contact area is."""
    return rows.area - (rows.area_raw - rows.area_compressed)


def _compare(rows: pd.DataFrame) -> None:
    pressed = rows[(rows.net_pressure > 0) & (rows.mean_separation > 0.01)]
    for name in ("calibrated", "simulated"):
        found = answered(pressed, name, theory.THETA)
        of_area = np.log(found.area / under_compression(pressed)).abs()
        of_gap = (found.gap - pressed.mean_separation).abs()
        relative = np.log(found.gap / pressed.mean_separation).abs()
        # errors of the theory without attraction, and of what the attraction adds
        free = elastic(pressed, name)
        own_area = np.log(free.area / pressed.elastic_area)
        own_gap = np.log(free.gap / pressed.elastic_separation)
        area_grown = (np.log(found.area / under_compression(pressed)) - own_area).abs()
        gap_grown = (np.log(found.gap / pressed.mean_separation) - own_gap).abs()
        for fitted, number in itertools.product((1, 0), TABOR):
            chosen = (pressed.tabor == number) & (pressed.fitted == fitted) & found.valid
            area, gap = of_area[chosen], relative[chosen]
            within = area < 2 * found.area_scatter[chosen]
            gap_within = of_gap[chosen] < 2 * found.gap_scatter[chosen]
            click.echo(
                f"{name}, fitted {fitted}, Tabor {number:g}: {chosen.sum()} valid; "
                f"area {area.median():.3f} {area.quantile(0.9):.3f}, {within.mean():.0%} within two; "
                f"gap {gap.median():.3f} {gap.quantile(0.9):.3f}, {gap_within.mean():.0%}; nine in ten "
                f"without attraction {own_area[chosen].abs().quantile(0.9):.3f} "
                f"{own_gap[chosen].abs().quantile(0.9):.3f}, of the change by it "
                f"{area_grown[chosen].quantile(0.9):.3f} {gap_grown[chosen].quantile(0.9):.3f}"
            )


def coverage(rows: pd.DataFrame) -> pd.DataFrame:
    """Errors of the theory of numbers alone over the stated scatter, of contacts that are valid."""
    pressed = rows[(rows.net_pressure > 0) & (rows.mean_separation > 0.01)]
    found = answered(pressed, "calibrated", theory.THETA)
    table = pressed.assign(
        share=found.area,
        area_error=np.log(found.area / under_compression(pressed)),
        gap_error=np.log(found.gap / pressed.mean_separation),
        area_scatter=found.area_scatter,
        gap_scatter=found.gap_scatter / found.gap,
    )
    return table[found.valid]


def _fit_scatter(rows: pd.DataFrame) -> None:
    """Least additions by which two standard deviations cover the contacts of held-out surfaces."""
    kept = theory.CELL_AREA, theory.CELL_GAP
    theory.CELL_AREA = theory.CELL_GAP = 0.0
    try:
        table = coverage(rows)
    finally:
        theory.CELL_AREA, theory.CELL_GAP = kept
    held_out = table[table.fitted == 0]
    for name, shape in (("area", 1 - table.share), ("gap", np.sqrt(table.share))):
        for hundredths in range(100):
            scatter = np.hypot(table[f"{name}_scatter"], hundredths / 100 * shape)
            within = table[f"{name}_error"].abs() < 2 * scatter
            if within[held_out.index].mean() >= COVERED:
                break
        before = table[f"{name}_error"].abs() < 2 * table[f"{name}_scatter"]
        for fitted, number in itertools.product((1, 0), TABOR):
            chosen = (table.fitted == fitted) & (table.tabor == number)
            if chosen.any():
                click.echo(
                    f"{name}, {hundredths / 100:g}, fitted {fitted}, Tabor {number:g}: {chosen.sum()} "
                    f"valid, {before[chosen].mean():.0%} within two before, {within[chosen].mean():.0%} with it"
                )
        click.echo(
            f"{name}: {within[table.fitted == 1].mean():.1%} of fitted, "
            f"{within[held_out.index].mean():.1%} of held-out surfaces"
        )
