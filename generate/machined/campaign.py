"""`python -m generate machined`: maps as machines make them, pressed by boundary elements, and what theories answer.

The truth is contact on the full grid, at loads between those of `theory="simulated"`, and flow both ways; of some maps
also contact with a hardness, at a tolerance of 1e-6. Stiffness is -dF/du by a step of 3% of the pressure of both.
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
from generate.boundary_elements.surfaces import Task
from generate.calibrated_file import attributes, variable, write_part
from generate.machined.makers import FAMILIES, GRADIENT, Part, heights
from mbma_tables import Surface, contact
from mbma_tables.common.arguments import FloatArray
from mbma_tables.common.errors import OutOfRangeError
from mbma_tables.data import FILE
from mbma_tables.laws import boundary_elements
from mbma_tables.laws.reynolds import flow_conductance
from mbma_tables.theories.own_map import law_loads
from mbma_tables.theories.saturated import of_map
from mbma_tables.theories.yielding import Yielding

NUMBERS = 10  # parts of each family
# points a side of one more of each family, and its number: of the longest shortest wavelength
LARGE, SMOOTHEST = 512, 2
EVERY = 3  # part that is pressed with a hardness, too
FORMS = ("calibrated", "corrected", "simulated")
TEXTS = campaigns.TEXTS["groups"]["machined"]
AREAS = (0.003, 0.025, 0.067, 0.14, 0.39, 0.58, 0.78)  # of the quick law, which never refuses them
STEP = 1.03  # of pressure, of the stiffness
OPEN = 0.45  # A/A0 up to which flow is solved
ANSWERS = ("area", "mean_separation", "stiffness", "flow_x", "flow_y", "pressure_scatter", "area_scatter",
           "stiffness_scatter", "flow_scatter", "valid", "flow_valid", "sensitivity")  # fmt: skip

ETA = (0.1, 0.4)  # p_m/(E* g)
HARD_AREAS = (0.025, 0.067, 0.14, 0.39, 0.58)  # that loads of maps with a hardness aim at
QUANTITIES = ("area", "mean_separation", "yielded", "unloading_stiffness")
WAYS = ("true", "simulated", "law")


def parts() -> list[Part]:
    """Every part, families in turn, so that stopping early leaves a balanced set; large ones of all but one."""
    large = [Part(family, SMOOTHEST, LARGE) for family in FAMILIES if family != "milled"]
    return [Part(family, number) for number in range(NUMBERS) for family in FAMILIES] + large


def yielding_parts() -> list[Part]:
    return parts()[: NUMBERS * len(FAMILIES) : EVERY]


def surface_of(part: Part) -> tuple[FloatArray, Any]:
    """The map and its surface, sampling step 1."""
    values = heights(part)
    return values, Surface.from_map(values, 1.0, periodic=True)


def solved(part: Part) -> dict[str, Any]:
    """Contact and flow of a part; lengths in sampling steps."""
    values, surface = surface_of(part)
    contact, sizes, rows = Contact(values, values.shape), values.shape, []
    for pressure in law_loads(surface, AREAS):
        found = contact.press(float(pressure))
        gap = contact.gap
        beside = contact.press(float(pressure * STEP))["mean_separation"]
        flow = flow_conductance(gap, sizes) if found["area"] < OPEN else np.full(2, np.nan)
        stiffness = pressure * (STEP - 1) / (found["mean_separation"] - beside)
        rows.append((pressure, found["area"], found["mean_separation"], found["energy"], stiffness, *flow))
    names = ("pressure", "area", "mean_separation", "energy", "stiffness", "flow_x", "flow_y")
    engine = f"Tamaas {importlib.metadata.version('tamaas')}"
    return dict(zip(names, np.array(rows).T, strict=True)) | {"engine": engine}


def answered(part: Part, theory: str, folder: pathlib.Path) -> dict[str, Any]:
    """A theory's answers at the loads of a part that is solved, with its stated scatter; NaN where it refuses."""
    _, surface = surface_of(part)
    with np.load(folder / f"{part.name}.npz") as truth:
        pressures = truth["pressure"]
    rows = np.full((len(ANSWERS), pressures.size), np.nan)
    for k, pressure in enumerate(map(float, pressures)):
        try:
            found, beside = (contact(surface, pressure=by * pressure, theory=theory) for by in (1.0, STEP))
        except OutOfRangeError:
            rows[[ANSWERS.index("valid"), ANSWERS.index("flow_valid")], k] = 0
            continue
        stiffness, leakage = pressure * (STEP - 1) / (found.mean_separation - beside.mean_separation), found.leakage
        of_it = (found.scatter, found.area_scatter, found.stiffness_scatter, leakage.scatter, found.valid)
        own = None if theory == "calibrated" else of_map(theory, surface)
        sensitivity = np.nan if own is None else own.sensitivity_at(np.asarray(found.area))
        answer = found.area, found.mean_separation, stiffness, leakage.x, leakage.y
        rows[:, k] = *answer, *of_it, leakage.valid, sensitivity
    return dict(zip(ANSWERS, rows, strict=True))


def yielded(part: Part) -> dict[str, Any]:
    """With a hardness: truth, the map simulated, and the law of hardness on its simulated elastic contact.

    Of each, `QUANTITIES` by hardness and load, and the slope of the pressure.
    """
    values, surface = surface_of(part)
    elastic = law_loads(surface, HARD_AREAS)
    found = np.empty((len(WAYS), len(QUANTITIES), len(ETA), len(HARD_AREAS)))
    force, slope = np.empty((2, len(ETA), len(HARD_AREAS)))
    for k, cap in enumerate(GRADIENT * eta for eta in ETA):
        force[k] = ((cap * np.array(HARD_AREAS)) ** -2 + elastic**-2) ** -0.5
        engine = boundary_elements.Contact(values, values.shape, hardness=cap)
        for place, load in enumerate(force[k].tolist()):
            row = engine.press(load)
            share = row["area_yielded"] / row["area"]
            found[0, :, k, place] = row["area"], row["mean_separation"], share, engine.frozen_stiffness()
        answer = contact(surface, pressure=force[k], hardness=cap, theory="simulated")
        found[1, :, k] = [getattr(answer, name) for name in QUANTITIES]
        law = Yielding(of_map("simulated", surface), cap)
        u, lighter = law.pressed(surface, force[k])
        loaded = law.loaded(surface, u, lighter)
        found[2, :, k] = loaded.answer.area, u, loaded.yielded, loaded.unloading_stiffness
        slope[k] = answer.stiffness
    columns = zip(QUANTITIES, np.swapaxes(found, 0, 1), strict=True)
    return {f"hard_{name}": values for name, values in columns} | {"hard_pressure": force, "hard_stiffness": slope}


def gathered(folder: pathlib.Path) -> xr.Dataset:
    have = [p for p in parts() if all((folder / form / f"{p.name}.npz").exists() for form in FORMS)]
    hard = {p.name: dict(np.load(folder / "hardness" / f"{p.name}.npz")) for p in yielding_parts() if p in have}
    names: dict[str, Any] = {"surface": [part.name for part in have], "family": [part.family for part in have]}
    names |= {"yielding": [*hard], "eta": list(ETA), "way": list(WAYS)}
    over = {name: "surface" if name == "family" else name for name in names}
    data = xr.Dataset(coords={n: variable(over[n], values, TEXTS["names"][n]) for n, values in names.items()})
    for form in ("", *FORMS):
        read = [dict(np.load(folder / form / f"{part.name}.npz")) for part in have]
        data.attrs |= {} if form else attributes(TEXTS, {"engine": str(read[0]["engine"])})
        for name in (name for name in TEXTS["columns"] if name in read[0]):
            values: Any = np.array([one[name] for one in read], "f4")
            data[f"{form}_{name}" if form else name] = variable(("surface", "load"), values, TEXTS["columns"][name])
    for name, meaning in TEXTS["hard"].items():
        values = np.array([one[f"hard_{name}"] for one in hard.values()], "f4")
        ways = ("way",) if values.ndim == 4 else ()
        data[f"hard_{name}"] = variable(("yielding", *ways, "eta", "hard_load"), values, meaning)
    surfaces = [surface_of(part)[1] for part in have]
    known = {name: [getattr(one, name) for one in surfaces] for name in ("h_rms", "skewness", "kurtosis")}
    known |= {name: [getattr(one.bearing, name) for one in surfaces] for name in ("anisotropy", "slope_kurtosis")}
    known["shortest"] = [part.shortest for part in have]
    for name, meaning in TEXTS["surface"].items():
        data[name] = variable("surface", np.array(known[name], float), meaning)
    return data


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--folder", type=click.Path(path_type=pathlib.Path), default="machined", show_default=True)
@click.option("--workers", type=click.IntRange(1), default=1, show_default=True, help="Processes.")
@click.option("--out", type=click.Path(path_type=pathlib.Path), default=FILE, show_default=True)
def machined(folder: pathlib.Path, workers: int, out: pathlib.Path) -> None:
    """Press maps of machined surfaces by boundary elements (Tamaas): an hour on one core.

    Stopped and called again, it goes on where it was. Answers of theories are kept in folders of their own: remove
    these to ask a changed library again.
    """
    solvers: dict[str, Solve] = {"hardness": yielded, "": solved}
    solvers |= {form: functools.partial(answered, theory=form, folder=folder) for form in FORMS}
    for name, solve in solvers.items():
        tasks = [Task(cast(Any, part), "") for part in (yielding_parts() if solve is yielded else parts())]
        campaigns.run(tasks, folder / name, workers, solve)
    data = gathered(folder)
    write_part(out, data, "machined")
    click.echo(f"{out}: {data.sizes['surface']} of {len(parts())} surfaces")
