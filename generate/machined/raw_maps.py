"""How well the default answer of a raw map agrees with accurate simulations: `python -m generate raw_maps`.

Maps are of all machined kinds, with seeds that no fit saw, and of kinds that no fit saw at all, as an
instrument gives them: averaged over its spot, with waves down to the sampling step, noise and heights of 16 bits, every
second one cut out of a larger map, tilted and not periodic. The library is asked with its
defaults. Truths are of the map at the cut-off that the answer names: by Tamaas at a tolerance of
1e-7 on the map's own points, and by the library's own boundary elements at twice and, of every
fourth map, at four times the points along each side.
"""

import itertools
import pathlib
import time
import zlib
from collections.abc import Iterator
from typing import Any

import click
import numpy as np
import pandas as pd
from scipy.ndimage import gaussian_filter

from generate.boundary_elements.solve import Contact as Tamaas
from generate.files import ROOT
from generate.machined.makers import FAMILIES
from generate.machined.unseen import UNSEEN
from mbma_tables import Surface, contact
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import MbmaError
from mbma_tables.surfaces.any_surface import AnySurface
from mbma_tables.surfaces.treatment import mirrored
from mbma_tables.theories.simulated.boundary_elements import BoundaryElementContact
from mbma_tables.theories.simulated.own_map import refined
from mbma_tables.theories.simulated.reynolds import flow_tensor

FILE = ROOT / "docs/data/raw_maps.csv.gz"
POINTS = 128  # along a side
LARGER = 160  # of a map of which one that is not periodic is cut out
FIRST = 500  # number of a map, beyond those of every campaign
SPOT = 0.7  # standard deviation, in sampling steps, of the spot that an instrument averages over
NOISE = 0.01  # standard deviation of white noise over that of heights
BITS = 16
RANGES = ((0.004, 0.04), (0.04, 0.2), (0.2, 0.75))  # A/A0, one load in each
STEP = 1.03  # of the pressure, of the stiffness
OPEN = 0.2  # A/A0 up to which flow is compared
TOLERANCE = 1e-7
FOUR_TIMES = 4  # the points, at which flow takes too much memory
FINEST = 4  # every so many maps, at four times the points
KINDS = {**FAMILIES, **UNSEEN}
QUANTITIES = ("area", "mean_separation", "stiffness", "flow_x", "flow_y")
SCATTERS = ("area_scatter", "scatter", "stiffness_scatter", "flow_scatter")
ANSWERS = (*(f"answer_{name}" for name in QUANTITIES), *SCATTERS, "valid", "flow_valid")


def raw(kind: str, number: int) -> tuple[FloatArray, bool]:
    """Heights as an instrument gives them, and whether they are periodic; sampling step 1."""
    rng = np.random.default_rng(zlib.crc32(f"raw {kind} {number}".encode()))
    periodic = number % 2 == 0
    values = KINDS[kind](rng, POINTS if periodic else LARGER, 2.0)
    values = gaussian_filter(values, SPOT, mode="wrap")
    values = values[:POINTS, :POINTS] - values.mean()
    values += NOISE * values.std() * rng.standard_normal(values.shape)
    if not periodic:
        values = values + values.std() * np.linspace(0, rng.uniform(-3, 3), POINTS)
    least = np.ptp(values) / 2**BITS
    return np.asarray(least * np.rint(values / least)), periodic


def pressed(
    heights: FloatArray, periodic: bool, pressures: FloatArray, times: int
) -> FloatArray:
    """`QUANTITIES` at pressures over E*, by Tamaas or on a finer grid; NaN for flow not solved."""
    mean_free = heights - heights.mean()
    sizes = (float(POINTS), float(POINTS))
    engine: Tamaas | BoundaryElementContact
    if times == 1:
        whole = mean_free if periodic else mirrored(mean_free)
        side = (1.0 if periodic else 2.0) * POINTS
        engine = Tamaas(whole, (side, side), TOLERANCE)
    else:
        for _ in range(times // 2):
            mean_free = refined(mean_free, not periodic)
        engine = BoundaryElementContact(
            mean_free, sizes, TOLERANCE, mirrored=not periodic
        )
    rows = []
    for pressure in pressures.tolist():
        found = engine.press(pressure)
        # of this load: the next one overwrites it
        gap = engine.gap[: len(mean_free), : len(mean_free)]
        flow = np.full(2, np.nan)
        if found["area"] < OPEN and times < FOUR_TIMES:
            flow = flow_tensor(gap, sizes, not periodic)[:2]
        closer = engine.press(pressure * STEP)["mean_separation"]
        stiffness = pressure * (STEP - 1) / (found["mean_separation"] - closer)
        rows.append((found["area"], found["mean_separation"], stiffness, *flow))
    return np.array(rows)


def answered(surface: AnySurface, pressures: FloatArray) -> FloatArray:
    """The library's `QUANTITIES` and `SCATTERS`, and whether contact and flow are valid."""
    found = contact(surface, pressure=pressures)
    closer = contact(surface, pressure=STEP * pressures)
    stiffness = pressures * (STEP - 1) / (found.mean_separation - closer.mean_separation)
    flow = found.leakage
    return np.array(
        [
            found.area,
            found.mean_separation,
            stiffness,
            flow.x,
            flow.y,
            found.area_scatter,
            found.scatter,
            found.stiffness_scatter,
            flow.scatter,
            found.valid,
            flow.valid,
        ],
        float,
    ).T


def rows_of(kind: str, number: int, finest: bool) -> Iterator[dict[str, Any]]:
    """A row for each load and truth of a map, or one that says why it has no valid answer."""
    heights, periodic = raw(kind, number)
    named = {"kind": kind, "number": number, "periodic": int(periodic)}
    rng = np.random.default_rng(zlib.crc32(f"loads {kind} {number}".encode()))
    areas = np.array([np.exp(rng.uniform(*np.log(ends))) for ends in RANGES])
    try:
        surface = Surface.from_map(heights, 1.0, periodic=periodic)
        start = contact(surface, area=areas)
    except MbmaError as fault:
        yield named | {"times": 0, "valid": 0, "reason": str(fault)[:60]}
        return
    if not start.valid.any():
        reason = next(iter(start.reasons))
        yield named | {"times": 0, "valid": 0, "reason": reason[:60]}
        return
    pressures = np.asarray(start.pressure)
    answers = answered(surface, pressures)
    simulated: Any = start.surface
    named["anisotropy"] = float(f"{simulated.anisotropy or 1.0:.3g}")
    for times in (1, 2, 4) if finest else (1, 2):
        truths = pressed(simulated.map.heights, periodic, pressures, times)
        for pressure, truth, answer in zip(pressures, truths, answers, strict=True):
            yield (
                named
                | {"times": times, "pressure": pressure}
                | dict(zip(QUANTITIES, truth, strict=True))
                | dict(zip(ANSWERS, answer, strict=True))
            )


def errors(data: pd.DataFrame) -> dict[str, tuple[pd.Series, pd.Series]]:
    """Errors of rows, of logarithms, and the standard deviations stated, by quantity.

    Those of the pressure are at equal gap, the others at equal pressure; flow counts along open
    axes.
    """
    moved = data.answer_mean_separation - data.mean_separation
    found = {
        "area": (np.log(data.answer_area / data.area), data.area_scatter),
        "pressure": (moved * data.stiffness / data.pressure, data.scatter),
        "stiffness": (
            np.log(data.answer_stiffness / data.stiffness),
            data.stiffness_scatter,
        ),
    }
    flows = []
    for axis in "xy":
        own = data[f"answer_flow_{axis}"]
        true = data[f"flow_{axis}"]
        is_open = (data.flow_valid == 1) & (data.area < OPEN) & (own > 0) & (true > 0)
        flows.append((np.log(own[is_open] / true[is_open]), data.flow_scatter[is_open]))
    found["flow"] = (
        pd.concat([flows[0][0], flows[1][0]]),
        pd.concat([flows[0][1], flows[1][1]]),
    )
    return found


def asked_again(data: pd.DataFrame) -> pd.DataFrame:
    """The same truths beside what the library, which may have changed, answers now."""
    known = data[data.times > 0]
    for (kind, number), rows in known.groupby(["kind", "number"]):
        heights, periodic = raw(kind, number)
        surface = Surface.from_map(heights, 1.0, periodic=periodic)
        answers = answered(surface, rows.pressure.to_numpy())
        data.loc[rows.index, list(ANSWERS)] = answers
    return data


@click.command()
@click.option("--out", type=click.Path(path_type=pathlib.Path), default=FILE)
@click.option("--each", default=4, help="Maps of each kind.")
@click.option("--minutes", default=600.0, help="After which no new map begins.")
@click.option("--again", is_flag=True, help="Only ask the library again.")
def raw_maps(out: pathlib.Path, each: int, minutes: float, again: bool) -> None:
    """Simulate raw maps; stopped and called again, it goes on where it was."""
    if again:
        asked_again(pd.read_csv(out)).to_csv(out, index=False, float_format="%.6g")
        return
    rows: list[Any] = pd.read_csv(out).to_dict("records") if out.exists() else []
    done = {(row["kind"], row["number"]) for row in rows}
    end = time.monotonic() + 60 * minutes
    tasks = itertools.product(range(FIRST, FIRST + each), KINDS)
    for count, (number, kind) in enumerate(tasks):
        if (kind, number) in done:
            continue
        if time.monotonic() > end:
            break
        rows += list(rows_of(kind, number, count % FINEST == 0))
        pd.DataFrame(rows).to_csv(out, index=False, float_format="%.6g")
