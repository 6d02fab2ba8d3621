"""`python -m generate unloading --fit`: constants of the law of unloading, and its scatter on groups left out.

The elastic contact of a group is that simulated on the same map; deviations are of what the
law says of pressures below the largest, over what is simulated at the largest.
"""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pandas as pd
from scipy.interpolate import PchipInterpolator
from scipy.optimize import least_squares

from mbma_tables.common.arguments import FloatArray
from mbma_tables.theories.yielding.unloading import (
    FRACTIONS,
    SHARES,
    Spots,
    area_ratio,
    energy,
    raised,
    stiffness_ratio,
)

FEWEST = 30  # points in contact, of rows that count
LIGHT = 0.095  # pressures over the largest, below which rows count less
LIGHT_WEIGHT = 0.4
LARGEST_LOAD = 1 / 3  # of the hardness, above which the bulk yields
FOLDS = 5
MOST_SHARE = (0.35, 0.9)  # ends between which shares of `SHARES` are averaged
START = Spots(1.16, -0.4, -2.0, -0.1, 1.4, -3.2, 0.11)
NAMES = ("stiffness", "area", "lift", "energy")
GROUP = ["family", "seed", "points", "psi"]
CLASSES = {
    "psi 4 and above": (3.9, 99.0),
    "psi 1.5 to 4": (1.5, 3.9),
    "psi 1.2": (0, 1.5),
}


def ratios(data: pd.DataFrame) -> pd.DataFrame:
    """Rows of unloaded contacts over those at the largest pressure, with the elastic ones."""
    return pd.DataFrame(list(_ratios(data)))


def _ratios(data: pd.DataFrame) -> Iterator[dict[str, Any]]:
    for key, group in data.groupby(GROUP):
        elastic = group[group.kind == "elastic"].sort_values("p")
        log_p = np.log(elastic.p.to_numpy())
        curves = {
            name: PchipInterpolator(log_p, values)
            for name, values in {
                "stiffness": np.log(elastic.frozen_stiffness),
                "area": np.log(elastic.area),
                "gap": elastic.mean_separation,
                "energy": np.log(elastic.energy),
            }.items()
        }
        for number, peak in group[group.kind != "elastic"].groupby("peak"):
            loaded = peak[peak.kind == "loaded"].iloc[0]
            after = peak[peak.kind == "unloaded"].sort_values("p")
            if after.empty or loaded.p0 * key[3] > LARGEST_LOAD:
                continue
            top = after.iloc[-1]
            for _, row in after.iloc[:-1].iterrows():
                few = row.area_raw * row.points**2 < FEWEST
                if few or np.log(row.p) < log_p[0]:
                    continue
                ends = np.log([row.p, loaded.p0])
                moved = {name: np.diff(curve(ends))[0] for name, curve in curves.items()}
                stiffness = np.exp(curves["stiffness"](ends[1]))
                yield {
                    "group": "_".join(map(str, key)),
                    "family": key[0],
                    "psi": key[3],
                    "peak": number,
                    "waves": row.waves,
                    "points": row.points,
                    "seed": row.seed,
                    "s": row.p / loaded.p0,
                    "peak_area": loaded.area,
                    "yielded": loaded.area_yielded / loaded.area,
                    "stiffness": row.frozen_stiffness / top.frozen_stiffness,
                    "area": row.area / top.area,
                    "lift": (row.mean_separation - top.mean_separation)
                    * top.frozen_stiffness
                    / loaded.p0,
                    "energy": row.energy * top.frozen_stiffness / loaded.p0**2,
                    "elastic_stiffness": np.exp(-moved["stiffness"]),
                    "elastic_area": np.exp(-moved["area"]),
                    "elastic_lift": -moved["gap"] * stiffness / loaded.p0,
                    "elastic_energy": np.exp(curves["energy"](ends[0]))
                    * stiffness
                    / loaded.p0**2,
                }


def predicted(rows: pd.DataFrame, stiffness: Spots, area: Spots) -> dict[str, FloatArray]:
    """What the law says of the rows."""
    c = {name: rows[name].to_numpy() for name in rows if rows[name].dtype == float}
    s = c["s"]
    spots = stiffness.of(c["yielded"], c["peak_area"])
    weight, *powers = spots
    return {
        "stiffness": stiffness_ratio(s, c["elastic_stiffness"], *spots),
        "lift": raised(s, c["elastic_lift"], 1.0, *spots),
        "area": area_ratio(s, c["elastic_area"], *area.of(c["yielded"], c["peak_area"])),
        "energy": (1 - weight) * c["elastic_energy"] + weight * energy(s, *powers),
    }


def deviations(
    rows: pd.DataFrame, stiffness: Spots, area: Spots
) -> dict[str, FloatArray]:
    """ln(law/boundary elements) of stiffness, lift, area and energy given back."""
    found = predicted(rows, stiffness, area)
    return {name: np.log(value / rows[name].to_numpy()) for name, value in found.items()}


def fitted(rows: pd.DataFrame) -> tuple[Spots, Spots]:
    """Constants by least squares: of stiffness with the lift, and of area."""
    weight = np.where(rows.s.to_numpy() < LIGHT, LIGHT_WEIGHT, 1.0)

    def solve(missed: Callable[[Spots], list[FloatArray]]) -> Spots:
        def residuals(x: FloatArray) -> FloatArray:
            return np.concatenate([weight * part for part in missed(Spots(*x))])

        return Spots(*map(float, least_squares(residuals, START).x))

    def of_stiffness(spots: Spots) -> list[FloatArray]:
        found = deviations(rows, spots, START)
        return [found["stiffness"], found["lift"]]

    return solve(of_stiffness), solve(
        lambda spots: [deviations(rows, START, spots)["area"]]
    )


def left_out(rows: pd.DataFrame) -> pd.DataFrame:
    """The rows with deviations of laws that were fitted without their group."""
    seeds = sorted({(row.family, row.seed) for row in rows.itertuples()})
    places = {seed: place % FOLDS for place, seed in enumerate(seeds)}
    fold = np.array([places[row.family, row.seed] for row in rows.itertuples()])
    result = rows.copy()
    for number in range(FOLDS):
        own = fold == number
        constants = fitted(rows[~own])
        for name, value in deviations(rows[own], *constants).items():
            result.loc[own, f"missed_{name}"] = value
    return result


def scatter_table(rows: pd.DataFrame) -> dict[str, tuple[tuple[float, ...], ...]]:
    """Root mean squares of deviations by share of the area that yielded, and pressure over the largest."""
    ends = (0.0, *MOST_SHARE, 1.0)
    table = {}
    for name in NAMES:
        lines = []
        for k in range(len(SHARES)):
            own = rows[(rows.yielded > ends[k]) & (rows.yielded <= ends[k + 1])]
            line = []
            for s in FRACTIONS[:-1]:
                near = own[np.abs(np.log(own.s / s)) < 0.05]
                line.append(rms(near[f"missed_{name}"]))
            # at the largest pressure itself stiffness and area are those of loading
            line.append(0.0 if name in ("stiffness", "area") else line[-1])
            lines.append(tuple(round(float(one), 3) for one in line))
        table[name] = tuple(lines)
    return table


def rms(values: Any) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def report(data: pd.DataFrame) -> str:
    """Constants, scatter, and the table of docs/yield.md."""
    rows = ratios(data)
    many = rows[(rows.waves != 2)]
    constants = fitted(many)
    tested = left_out(many)
    table = scatter_table(tested)
    lines = [
        f"STIFFNESS = {constants[0]}",
        f"CONTACT = {constants[1]}",
        f"SCATTER = {table}",
    ]
    lines.append(
        f"{len(rows)} rows of {rows.group.nunique()} groups, {many.group.nunique()} used"
    )
    from mbma_tables.theories.yielding import unloading as law

    law.SCATTER.update(table)
    above = tested[tested.s > LIGHT]
    for label, (low, high) in CLASSES.items():
        own = above[(above.psi > low) & (above.psi < high)]
        machined = own[own.waves == 0]
        for name in NAMES:
            missed = own[f"missed_{name}"]
            stated = law.ratio_scatter(name, own.s.to_numpy(), own.yielded.to_numpy())
            inside = [np.mean(np.abs(missed) <= k * stated) for k in (1, 2)]
            lines.append(
                f"{label:16} {name:10} rms {rms(missed):.3f} (machined {rms(machined[f'missed_{name}']):.3f}) mean {missed.mean():+.3f} "
                f"within one, two {inside[0]:.2f} {inside[1]:.2f}; n {len(own)}"
            )
    return "\n".join(lines)
