"""`python -m generate machined`: maps as machines make them, pressed by boundary elements.

The truth is contact on the full grid, at loads between those of `Simulated(grid="full")`, and flow
both ways; of some maps also contact with a hardness, at a tolerance of 1e-6. Beside it is what
theories answer. Stiffness is -dF/du by a step of 3% of the pressure of both.
"""

import functools
import importlib.metadata
import pathlib
from typing import Any, cast

import click
import numpy as np
import xarray as xr

from generate.boundary_elements import run as campaigns
from generate.boundary_elements.solve import Contact, Solve
from generate.boundary_elements.surfaces import Recipe, Task
from generate.calibrated_file import Variable, attributes, variable, write_part
from generate.machined.makers import FAMILIES, GRADIENT, Part, heights
from mbma_tables import Bodies, Surface, contact
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.surfaces.surface import MeasuredSurface
from mbma_tables.theories import Calibrated, Simulated
from mbma_tables.theories.dataset import FILE
from mbma_tables.theories.simulated import boundary_elements
from mbma_tables.theories.simulated.own_map import law_loads
from mbma_tables.theories.simulated.reynolds import flow_conductance
from mbma_tables.theories.yielding.theory import Yielding

NUMBERS = 10  # parts of each family
LARGE = 512  # points a side of one more of each family
SMOOTHEST = 2  # its number: of the longest shortest wavelength
EVERY = 3  # part that is pressed with a hardness, too
FULL = Simulated(grid="full")
# theories, by what their columns of the file begin with
FORMS: dict[str, Calibrated | Simulated] = {
    "calibrated": Calibrated(),
    "corrected": Simulated(grid="quick"),
    "simulated": FULL,
}
TEXTS = campaigns.TEXTS["groups"]["machined"]
AREAS = (
    0.003,
    0.025,
    0.067,
    0.14,
    0.39,
    0.58,
    0.78,
)  # of the quick law, which never refuses them
STEP = 1.03  # of pressure, of the stiffness
OPEN = 0.45  # A/A0 up to which flow is solved
ANSWERS = (
    "area",
    "mean_separation",
    "stiffness",
    "flow_x",
    "flow_y",
    "pressure_scatter",
    "area_scatter",
    "stiffness_scatter",
    "flow_scatter",
    "valid",
    "flow_valid",
    "sensitivity",
)

ETA = (0.1, 0.4)  # p_m/(E* g)
HARD_AREAS = (0.025, 0.067, 0.14, 0.39, 0.58)  # that loads of maps with a hardness aim at
QUANTITIES = ("area", "mean_separation", "yielded", "unloading_stiffness")
WAYS = ("true", "simulated", "law")


def parts() -> list[Part]:
    """Every part, families in turn, so that stopping early leaves a balanced set.

    Last come large ones of all families but one.
    """
    usual = [Part(family, number) for number in range(NUMBERS) for family in FAMILIES]
    large = [Part(family, SMOOTHEST, LARGE) for family in FAMILIES if family != "milled"]
    return usual + large


def yielding_parts() -> list[Part]:
    return parts()[: NUMBERS * len(FAMILIES) : EVERY]


def surface_of(part: Part) -> tuple[FloatArray, MeasuredSurface]:
    """The map and its surface, sampling step 1."""
    values = heights(part)
    surface = Surface.from_map(values, 1.0, periodic=True)
    assert isinstance(surface, MeasuredSurface)
    return values, surface


def solved(part: Part) -> dict[str, Any]:
    """Contact and flow of a part; lengths in sampling steps."""
    values, surface = surface_of(part)
    engine = Contact(values, values.shape)
    rows = []
    for pressure in law_loads(surface, AREAS):
        pressed = engine.press(float(pressure))
        # of this load: the next one overwrites it
        gap = engine.gap
        slightly_closer = engine.press(float(pressure * STEP))["mean_separation"]
        is_open = pressed["area"] < OPEN
        flow = flow_conductance(gap, values.shape) if is_open else np.full(2, np.nan)
        stiffness = pressure * (STEP - 1) / (pressed["mean_separation"] - slightly_closer)
        contact_numbers = (pressed["area"], pressed["mean_separation"], pressed["energy"])
        rows.append((pressure, *contact_numbers, stiffness, *flow))
    names = (
        "pressure",
        "area",
        "mean_separation",
        "energy",
        "stiffness",
        "flow_x",
        "flow_y",
    )
    columns: dict[str, Any] = dict(zip(names, np.array(rows).T, strict=True))
    columns["engine"] = f"Tamaas {importlib.metadata.version('tamaas')}"
    return columns


def answered(
    part: Part, theory: Calibrated | Simulated, folder: pathlib.Path
) -> dict[str, FloatArray]:
    """A theory's answers at the loads of a part that is solved, with its stated scatter.

    NaN where it refuses.
    """
    _, surface = surface_of(part)
    with np.load(folder / f"{part.name}.npz") as truth:
        pressures = truth["pressure"]
    rows = np.full((len(ANSWERS), pressures.size), np.nan)
    for k, pressure in enumerate(map(float, pressures)):
        try:
            answer = contact(surface, pressure=1.0 * pressure, theory=theory)
            closer = contact(surface, pressure=STEP * pressure, theory=theory)
        except OutOfRangeError:
            rows[[ANSWERS.index("valid"), ANSWERS.index("flow_valid")], k] = 0
            continue
        stiffness = (
            pressure * (STEP - 1) / (answer.mean_separation - closer.mean_separation)
        )
        leakage = answer.leakage
        # the calibrated law solves no map, so it has no sensitivity to the grid
        sensitivity: float | FloatArray = np.nan
        if isinstance(theory, Simulated):
            simulation = theory.of(surface)
            sensitivity = simulation.sensitivity_at(np.asarray(answer.area))
        # in the order of `ANSWERS`
        rows[:, k] = (
            answer.area,
            answer.mean_separation,
            stiffness,
            leakage.x,
            leakage.y,
            answer.scatter,
            answer.area_scatter,
            answer.stiffness_scatter,
            leakage.scatter,
            answer.valid,
            leakage.valid,
            sensitivity,
        )
    return dict(zip(ANSWERS, rows, strict=True))


def yielded(part: Part) -> dict[str, FloatArray]:
    """With a hardness: truth, the map simulated, and the law of hardness.

    The law has the map's simulated elastic contact. Of each, `QUANTITIES` by hardness and load, and
    the slope of the pressure.
    """
    values, surface = surface_of(part)
    elastic = law_loads(surface, HARD_AREAS)
    answers = np.empty((len(WAYS), len(QUANTITIES), len(ETA), len(HARD_AREAS)))
    force = np.empty((len(ETA), len(HARD_AREAS)))
    slope = np.empty((len(ETA), len(HARD_AREAS)))
    for k, eta in enumerate(ETA):
        hardness = GRADIENT * eta
        # between the load at which all that touches yields and the elastic one
        force[k] = ((hardness * np.array(HARD_AREAS)) ** -2 + elastic**-2) ** -0.5
        # the truth
        engine = boundary_elements.BoundaryElementContact(
            values, values.shape, hardness=hardness
        )
        for place, load in enumerate(force[k].tolist()):
            row = engine.press(load)
            share = row["area_yielded"] / row["area"]
            stiffness = engine.frozen_stiffness()
            answers[0, :, k, place] = (
                row["area"],
                row["mean_separation"],
                share,
                stiffness,
            )
        # the map simulated by the library
        simulated = contact(
            surface, Bodies(hardness=hardness), pressure=force[k], theory="simulated"
        )
        answers[1, :, k] = [getattr(simulated, name) for name in QUANTITIES]
        slope[k] = simulated.stiffness
        # the law of hardness
        law = Yielding(FULL.of(surface), hardness)
        u, lighter = law.at_force(surface, force[k])
        loaded = law.loaded(surface, u, lighter)
        answers[2, :, k] = (
            loaded.answer.area,
            u,
            loaded.yielded,
            loaded.unloading_stiffness,
        )
    columns = {}
    for name, by_way in zip(QUANTITIES, np.swapaxes(answers, 0, 1), strict=True):
        columns[f"hard_{name}"] = by_way
    columns["hard_pressure"] = force
    columns["hard_stiffness"] = slope
    return columns


def gathered(folder: pathlib.Path) -> xr.Dataset:
    """The group of the data set: parts that every theory has answered."""
    complete = [part for part in parts() if is_answered(folder, part)]
    hard = {}
    for part in yielding_parts():
        if part in complete:
            hard[part.name] = dict(np.load(folder / "hardness" / f"{part.name}.npz"))
    data = xr.Dataset(coords=coordinates(complete, list(hard)))
    for form in ("", *FORMS):
        add_columns(data, form, folder, complete)
    for name, meaning in TEXTS["hard"].items():
        values = np.array([columns[f"hard_{name}"] for columns in hard.values()], "f4")
        # force and slope are those of all ways
        ways = ("way",) if values.ndim == 4 else ()
        data[f"hard_{name}"] = variable(
            ("yielding", *ways, "eta", "hard_load"), values, meaning
        )
    numbers = numbers_of_surfaces(complete)
    for name, meaning in TEXTS["surface"].items():
        data[name] = variable("surface", np.array(numbers[name], float), meaning)
    return data


def is_answered(folder: pathlib.Path, part: Part) -> bool:
    return all((folder / form / f"{part.name}.npz").exists() for form in FORMS)


def coordinates(complete: list[Part], yielding: list[str]) -> dict[str, Variable]:
    labels: dict[str, list[Any]] = {
        "surface": [part.name for part in complete],
        "family": [part.family for part in complete],
        "yielding": yielding,
        "eta": list(ETA),
        "way": list(WAYS),
    }
    variables = {}
    for name, values in labels.items():
        dimension = "surface" if name == "family" else name
        variables[name] = variable(dimension, values, TEXTS["names"][name])
    return variables


def add_columns(
    data: xr.Dataset, form: str, folder: pathlib.Path, complete: list[Part]
) -> None:
    """Add what files of a theory hold, or of the truth, whose form is empty."""
    files = [dict(np.load(folder / form / f"{part.name}.npz")) for part in complete]
    if not form:
        data.attrs |= attributes(TEXTS, {"engine": str(files[0]["engine"])})
    for name, meaning in TEXTS["columns"].items():
        if name in files[0]:
            values = np.array([content[name] for content in files], "f4")
            label = f"{form}_{name}" if form else name
            data[label] = variable(("surface", "load"), values, meaning)


def numbers_of_surfaces(complete: list[Part]) -> dict[str, list[float]]:
    """What describes surfaces: moments of heights and slopes, and shortest wavelengths."""
    surfaces = [surface_of(part)[1] for part in complete]
    numbers: dict[str, list[float]] = {}
    for name in ("h_rms", "skewness", "kurtosis"):
        numbers[name] = [getattr(surface, name) for surface in surfaces]
    for name in ("anisotropy", "slope_kurtosis"):
        numbers[name] = [getattr(surface.bearing, name) for surface in surfaces]
    numbers["shortest"] = [part.shortest for part in complete]
    return numbers


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--folder",
    type=click.Path(path_type=pathlib.Path),
    default="machined",
    show_default=True,
)
@click.option(
    "--workers", type=click.IntRange(1), default=1, show_default=True, help="Processes."
)
@click.option(
    "--out", type=click.Path(path_type=pathlib.Path), default=FILE, show_default=True
)
def machined(folder: pathlib.Path, workers: int, out: pathlib.Path) -> None:
    """Press maps of machined surfaces by boundary elements (Tamaas): an hour on one core.

    Stopped and called again, it goes on where it was. Answers of theories are kept in folders of
    their own: remove these to ask a changed library again.
    """
    solvers: dict[str, Solve] = {"hardness": yielded, "": solved}
    for form, theory in FORMS.items():
        solvers[form] = functools.partial(answered, theory=theory, folder=folder)
    for name, solve in solvers.items():
        chosen = yielding_parts() if solve is yielded else parts()
        # a campaign asks of a recipe no more than its name
        tasks = [Task(cast(Recipe, part), "") for part in chosen]
        campaigns.run(tasks, folder / name, workers, solve)
    data = gathered(folder)
    write_part(out, data, "machined")
    click.echo(f"{out}: {data.sizes['surface']} of {len(parts())} surfaces")
