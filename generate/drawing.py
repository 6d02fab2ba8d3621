"""``python -m generate drawing``: how far faces of a process are from what their Ra tells, and the coverage of bands."""

import contextlib
import csv
import io
import pathlib
from collections.abc import Iterator
from typing import Any, NamedTuple

import click
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from generate.files import dataset
from generate.machined.campaign import parts, surface_of
from generate.machined.makers import Part
from mbma_tables import Surface, contact, uncertainty
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.files import write_file
from mbma_tables.contacts.result import Contact
from mbma_tables.surfaces.roughness import processes

FILE = pathlib.Path("tables/processes.csv")
SPREADS = {"area": "area", "gap": "mean_separation", "stiffness": "stiffness"}
RANGE = (0.01, 0.6)  # A/A0 of the contacts that count
FLOW = "flow"  # the kind of spread of both axes' flow coefficients
FLOW_AREA = 0.2  # A/A0 up to which they count, where neither is blocked
KINDS = (*SPREADS, FLOW)
HURST = 0.85  # the middle of what engineering surfaces have
TOP = 4.5  # h_max/h_rms
# Ra [um] to which maps are enlarged, in both directions alike
HEIGHTS = (0.4, 0.8, 1.6, 3.2, 6.3)
# spread of a process without maps over the largest of those with maps
BEYOND = 1.1
BAND = (0.025, 0.5, 0.975)
NORMAL_95 = 1.96  # standard deviations
DRAWS = 400


class Reduced(NamedTuple):
    """A simulated map and what a drawing would tell of it, lengths in sampling steps, E* = 1."""

    family: str
    Ra: float
    longest: float
    shortest: float
    pressure: FloatArray
    simulated: dict[str, FloatArray]  # by quantity
    counts: Any  # mask of the loads
    flow: FloatArray  # of both axes, 0 where blocked, NaN where it does not count


def reduced(chosen: list[Part] | None = None) -> Iterator[Reduced]:
    """Maps of the group machined, by default every one."""
    data = dataset("machined")
    families = data.family.values.astype(str)
    for part in tqdm(parts() if chosen is None else chosen, disable=None):
        values, surface = surface_of(part)
        same = np.isclose(data.h_rms.values, float(surface.h_rms), rtol=2e-5)
        (number,) = np.flatnonzero((families == part.family) & same)
        one = data.isel(surface=number)
        simulated = {
            name: one[name].values.astype(float)
            for name in SPREADS.values()
            if name in one
        }
        area = simulated["area"]
        flow = np.stack([one.flow_x.values, one.flow_y.values]).astype(float)
        yield Reduced(
            part.family,
            float(np.mean(np.abs(values - values.mean()))),
            2 * np.pi / float(surface.longest),
            float(part.shortest),
            one.pressure.values.astype(float),
            simulated,
            (area >= RANGE[0]) & (area <= RANGE[1]),
            np.where(area <= FLOW_AREA, flow, np.nan),
        )


def told(one: Reduced) -> Contact:
    """The law's answers from Ra and the ends of the band."""
    face = Surface.from_roughness(
        Ra=one.Ra,
        hurst=HURST,
        longest=max(one.longest, 3.01 * one.shortest),
        shortest=one.shortest,
        h_max=TOP * one.Ra * np.sqrt(np.pi / 2),
    )
    return contact(face, pressure=one.pressure, theory="calibrated")


def errors_of_flow(one: Reduced) -> FloatArray:
    """ln of the law's flow over the simulation's along both axes, infinite where that is blocked."""
    with np.errstate(divide="ignore"):
        found = np.log(told(one).leakage.K / one.flow)
    return np.asarray(found[~np.isnan(one.flow)])


def errors(one: Reduced) -> dict[str, FloatArray]:
    """ln of the law's answers over the simulation's at equal pressure, of flow where neither is blocked."""
    pressed = told(one)
    found = {
        kind: np.log(pressed.quantity(name) / one.simulated[name])[one.counts]
        for kind, name in SPREADS.items()
    }
    of_flow = errors_of_flow(one)
    found[FLOW] = of_flow[np.isfinite(of_flow)]
    return found


def flows_in_bands(maps: list[Reduced]) -> NDArray[np.bool_]:
    """Whether flows are in the 95% band by the spread of the half of the maps that they are not of."""
    inside = []
    for half in (0, 1):
        found = spreads(maps[1 - half :: 2])
        for one in maps[half::2]:
            spread = found.get(one.family, found[""])[FLOW]
            inside.append(np.abs(errors_of_flow(one)) < NORMAL_95 * spread)
    return np.concatenate(inside)


def spreads(maps: list[Reduced]) -> dict[str, dict[str, float]]:
    """Root mean squares of the errors, by process and kind; under "" those of a process without maps."""
    found: dict[str, dict[str, float]] = {}
    for family in dict.fromkeys(one.family for one in maps):
        own = [errors(one) for one in maps if one.family == family]
        found[family] = {
            kind: float(
                np.sqrt(np.mean(np.concatenate([each[kind] for each in own]) ** 2))
            )
            for kind in KINDS
        }
    largest = {kind: max(own[kind] for own in found.values()) for kind in KINDS}
    found[""] = {kind: BEYOND * spread for kind, spread in largest.items()}
    return found


def covered(one: Reduced, Ra: float) -> dict[str, float]:
    """Shares of the loads at which the 95% band of Ra and the process has the simulated answer."""
    step = Ra / one.Ra
    names = list(SPREADS.values())
    found = uncertainty(
        {"Ra": f"{Ra} um", "process": one.family},
        "1 GPa",
        pressure=[f"{pressure!r} GPa" for pressure in one.pressure.tolist()],
        theory="calibrated",
        draws=DRAWS,
        quantiles=BAND,
        quantities=names,
    )
    lengths = {"area": 1.0, "mean_separation": step, "stiffness": 1 / step}
    shares = {}
    for name in names:
        low, _, high = found.quantiles[name]
        answer = one.simulated[name] * lengths[name]
        shares[name] = float(((low < answer) & (answer < high))[one.counts].mean())
    return shares


def with_spreads(text: str, found: dict[str, dict[str, float]]) -> str:
    """The file of processes with other spreads."""
    lines = text.splitlines()
    head = [line for line in lines if line.startswith("#")]
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    for row in rows:
        own = found.get(row["process"], found[""])
        row |= {f"{kind}_spread": f"{own[kind]:.3f}" for kind in KINDS}
    body = io.StringIO()
    writer = csv.DictWriter(body, rows[0].keys(), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return "\n".join([*head, body.getvalue()])


@contextlib.contextmanager
def with_other_spreads(found: dict[str, dict[str, float]]) -> Iterator[None]:
    """Bands by these spreads in place of those of the shipped file."""
    rows = processes()
    shipped = {name: dict(row) for name, row in rows.items()}
    for name, row in rows.items():
        own = found.get(name, found[""])
        row |= {f"{kind}_spread": f"{own[kind]:.3f}" for kind in KINDS}
    try:
        yield
    finally:
        rows |= shipped


def coverage(maps: list[Reduced], Ra: float, held_out: bool) -> list[dict[str, float]]:
    """What `covered` finds of each map, by spreads of all maps or of the half that it is not in."""
    if not held_out:
        return [covered(one, Ra) for one in tqdm(maps, disable=None)]
    shares: dict[int, dict[str, float]] = {}
    for half in (0, 1):
        with with_other_spreads(spreads(maps[1 - half :: 2])):
            for place in tqdm(range(half, len(maps), 2), disable=None):
                shares[place] = covered(maps[place], Ra)
    return [shares[place] for place in range(len(maps))]


@click.command()
@click.option("--write/--no-write", default=True, help="Write tables/processes.csv.")
@click.option(
    "--held-out",
    is_flag=True,
    help="Count each map by the spreads of the half of the maps that it is not in.",
)
def drawing(write: bool, held_out: bool) -> None:
    """Compare simulated machined maps with what Ra and the process tell: five minutes.

    Prints a table of the shares of their contacts in the 95% band of Ra and process: of
    area, gap and stiffness, by Ra and process; before it that of flows, by the spread alone
    of the half of the maps that they are not of.
    """
    maps = list(reduced())
    if write:
        text = with_spreads(FILE.read_text(encoding="utf-8"), spreads(maps))
        write_file(FILE, text.encode())
    flows = flows_in_bands(maps)
    click.echo(f"{flows.size} flows, in the band {flows.mean():.1%}")
    families = np.array([one.family for one in maps])
    click.echo(f"| process (maps) | {' | '.join(f'{Ra:g} um' for Ra in HEIGHTS)} |")
    click.echo(f"| --- | {' | '.join('---' for _ in HEIGHTS)} |")
    shares = np.array(
        [
            [
                [one[name] for name in SPREADS.values()]
                for one in coverage(maps, Ra, held_out)
            ]
            for Ra in HEIGHTS
        ]
    )
    for family in ("all", *dict.fromkeys(families)):
        own = shares[:, (families == family) | (family == "all")]
        cells = [
            ", ".join(f"{100 * share:.0f}" for share in row) for row in own.mean(axis=1)
        ]
        click.echo(f"| {family} ({own.shape[1]}) | {' | '.join(cells)} |")
